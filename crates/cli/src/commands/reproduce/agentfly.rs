//! `sidestep reproduce agentfly`.

use super::{EXAMPLES, PaperResults, forget_trials, keep_trials, store_and_print};
use crate::console::Console;
use crate::exit::{ExitCode, Failure};
use crate::link;
use crate::progress::StageBar;
use crate::worlds;
use clap::Args;
use sidestep_papers::TrialFile;
use sidestep_papers::agentfly::{self, AgentflyConfig, FlightMeasurement, SocketMeasurements};
use sidestep_session::fleet::{
    ClockMode, CommonSettings, FleetJob, Job, JobScenario, LinkMessage, Topology,
};
use std::path::{Path, PathBuf};

/// Seconds of silence after which an airplane is taken to be lost: six times the default of `--lease`. All processes share
/// this machine and may wait for a processor, and an airplane that is only slow must not count as lost, because its flight
/// would be missing in the measurement. In exchange, a process that died holds the experiment up for a minute.
const LEASE_S: f64 = 60.0;

/// The extent of the experiments.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(super) struct AgentflyArgs {
    /// Output folder (new or empty) for report.html, report.md, report.json and the figures; after an interrupt the same
    /// command goes on there
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,

    /// Quick run: everything once; the numbers are not precise
    #[arg(long)]
    quick: bool,

    /// Number of seeds for each number of airplanes
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=10_000))]
    seeds: Option<u32>,
}

/// Measures over real sockets, if the program for them is installed.
fn measure_sockets(
    plan: &AgentflyConfig,
    kept: &TrialFile,
    console: Console,
) -> Result<SocketMeasurements, Failure> {
    if let Err(missing) = link::find_program() {
        let reason = missing.to_string();
        console.note(format!("The part over real sockets is left out: {reason}"));
        return Ok(SocketMeasurements::LeftOut { reason });
    }
    let folder =
        tempfile::tempdir().map_err(|e| Failure::cannot_write(&std::env::temp_dir(), &e))?;
    let file = folder.path().join("superconflict.toml");
    let stages = StageBar::new(console);
    let measured = agentfly::measure(
        plan,
        kept,
        &mut |text: &str| -> Result<FlightMeasurement, Failure> {
            std::fs::write(&file, text).map_err(|e| Failure::cannot_write(&file, &e))?;
            measure_fleet(&file)
        },
        &mut |what, share| stages.set(what, share),
    );
    stages.clear();
    measured
}

/// Flies a scenario with a process for each airplane, and returns the measurements.
fn measure_fleet(file: &Path) -> Result<FlightMeasurement, Failure> {
    let mut measured = FlightMeasurement::default();
    link::run_job(&Job::Fleet(fleet_job(file)), |message| {
        if let LinkMessage::Ended { fleet, .. } = message {
            let messages: u64 = fleet.nodes.iter().map(|node| node.packets).sum();
            let bytes: u64 = fleet.nodes.iter().map(|node| node.bytes).sum();
            measured = FlightMeasurement {
                elapsed_s: fleet.flown_s,
                messages: messages as f64,
                bytes: bytes as f64,
            };
        }
    })?;
    Ok(measured)
}

fn fleet_job(file: &Path) -> FleetJob {
    let build = worlds().build().into();
    let common = CommonSettings {
        flown: JobScenario { file: file.into(), overrides: Vec::new(), build },
        tls: None,
        is_insecure: false,
        lease_s: LEASE_S,
        metrics: None,
        json_log: false,
        log: "warn".into(),
    };
    FleetJob {
        common,
        nodes: None,
        clock: ClockMode::Lockstep,
        topology: Topology::Mesh,
        multicast_group: None,
        listen: vec!["tcp/127.0.0.1:0".into()],
        out: None,
        replace: false,
        packets: false,
    }
}

pub(super) fn reproduce(args: &AgentflyArgs, console: Console) -> Result<ExitCode, Failure> {
    let default = if args.quick { AgentflyConfig::quick() } else { AgentflyConfig::default() };
    let plan =
        AgentflyConfig { seeds: args.seeds.map_or(default.seeds, |n| n as usize), ..default };
    let kept = keep_trials(args.out.as_deref(), &plan, console)?;
    let stages = StageBar::new(console);
    let report = agentfly::run(&plan, &kept, &mut |what, share| stages.set(what, share));
    stages.clear();
    let report = report?.with_sockets(measure_sockets(&plan, &kept, console)?);
    let exit = store_and_print(
        &report,
        &PaperResults { document: report.document(), claims: &report.claims, quick: plan.quick },
        args.out.as_deref(),
        console,
    )?;
    forget_trials(kept, console);
    Ok(exit)
}
