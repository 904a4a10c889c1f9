//! The same flights by processes, which communicate over real sockets, beside those in one process.
//!
//! The caller passes in the function that runs a fleet: this crate opens no socket and starts no process. Messages and
//! bytes are counted at the nodes, with the headers of packets and without those of the network below. Time is that of
//! a clock from when all nodes have joined to the end of the flight, so it depends on the machine and on other load
//! on it.

use super::{
    AIRPLANES, AgentflyConfig, CLAIMS, SCENARIO, SocketsConfig, claim, join_estimates,
    judge_all_above,
};
use crate::study::{Progress, run_to_end, setting, source};
use crate::trial_file::TrialFile;
use serde::{Deserialize, Serialize};
use sidestep::kernel::InputError;
use sidestep::worlds::airspace::airspace_run;
use sidestep_document::claim::Claim;
use sidestep_document::{Estimate, Table};
use std::time::Instant;

/// Deployments with agents that can be processes.
const DEPLOYMENTS: [&str; 4] = ["team", "compact-team", "pim", "hierarchical-pim"];

/// The effort of a whole flight, in one process or over sockets.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct FlightMeasurement {
    /// Seconds by a clock.
    pub elapsed_s: f64,
    /// Messages, one per receiver.
    pub messages: f64,
    /// Bytes of the messages.
    pub bytes: f64,
}

/// A function that runs a scenario by processes, given its text.
pub type FleetRunner<'a, E> = dyn FnMut(&str) -> Result<FlightMeasurement, E> + 'a;

/// The measurements over sockets, or the reason why there are none.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum SocketMeasurements {
    /// They were left out.
    LeftOut {
        /// The reason, and how to get them.
        reason: String,
    },
    /// Cases by number of airplanes, and then by deployment.
    Measured(Vec<SocketCase>),
}

/// The flights of some airplanes with one deployment.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SocketCase {
    /// Number of airplanes that meet in the super-conflict.
    pub airplanes: usize,
    /// The deployment, by its name in scenarios.
    pub deployment: &'static str,
    /// Runs by seed, in one process.
    pub alone: Vec<FlightMeasurement>,
    /// Runs by seed, over sockets.
    pub over_sockets: Vec<FlightMeasurement>,
}

/// Measures the flights of a plan in one process, and by `run_fleet`, except for those that are kept.
///
/// # Errors
/// When the plan asks for an impossible scenario, and those of `run_fleet`.
pub fn measure<E: From<InputError>>(
    plan: &AgentflyConfig,
    kept: &TrialFile,
    run_fleet: &mut FleetRunner<'_, E>,
    progress: &mut Progress<'_>,
) -> Result<SocketMeasurements, E> {
    let mut all: Vec<(usize, &'static str)> = Vec::new();
    for &airplanes in &plan.sockets.airplanes {
        all.extend(DEPLOYMENTS.map(|deployment| (airplanes, deployment)));
    }
    let mut cases = Vec::with_capacity(all.len());
    for (k, &(airplanes, deployment)) in all.iter().enumerate() {
        progress("fleets over sockets", k as f64 / all.len() as f64);
        let mut alone = Vec::new();
        let mut over_sockets = Vec::new();
        for seed in 1..=plan.sockets.seeds as i64 {
            let settings = [
                setting("seed", seed),
                setting(AIRPLANES, airplanes as i64),
                setting("airspace.deployment", deployment),
                setting("cycles", plan.sockets.cycles as i64),
            ];
            let text = source(SCENARIO, &settings)?.text;
            let name = format!("{airplanes} airplanes, {deployment}, seed {seed}");
            let [one, fleet] = kept.result(&name, || -> Result<_, E> {
                Ok([measure_in_one_process(&text)?, run_fleet(&text)?])
            })?;
            alone.push(one);
            over_sockets.push(fleet);
        }
        cases.push(SocketCase { airplanes, deployment, alone, over_sockets });
    }
    Ok(SocketMeasurements::Measured(cases))
}

fn measure_in_one_process(text: &str) -> Result<FlightMeasurement, InputError> {
    let mut run = airspace_run(&source(text, &[])?, 1)?;
    let started = Instant::now();
    run_to_end(&mut run, |_| {});
    let elapsed_s = started.elapsed().as_secs_f64();
    let metrics = run.metrics();
    Ok(FlightMeasurement {
        elapsed_s,
        messages: metrics.messages as f64,
        bytes: metrics.bytes as f64,
    })
}

type Quantity = fn(&FlightMeasurement) -> f64;

/// The quantities of the table, each in one process and over sockets.
const QUANTITIES: [Quantity; 3] = [|m| m.elapsed_s, |m| m.messages, |m| m.bytes];

fn values_of(measured: &[FlightMeasurement], of: Quantity) -> Vec<Option<f64>> {
    measured.iter().map(|one| Some(of(one))).collect()
}

impl SocketCase {
    fn times_over_sockets_s(&self) -> Vec<Option<f64>> {
        values_of(&self.over_sockets, |m| m.elapsed_s)
    }

    /// Returns how many times as long the flight takes over sockets, seed by seed.
    fn slowdown(&self) -> Estimate {
        let alone_s = values_of(&self.alone, |m| m.elapsed_s);
        Estimate::geometric_ratio(&self.times_over_sockets_s(), &alone_s)
    }

    fn table_cells(&self) -> Vec<String> {
        let mut cells = vec![self.airplanes.to_string(), self.deployment.to_string()];
        for quantity in QUANTITIES {
            for flights in [&self.alone, &self.over_sockets] {
                let mean = Estimate::from_values(values_of(flights, quantity));
                cells.push(mean.to_string());
            }
        }
        cells.push(self.slowdown().to_string());
        cells
    }
}

impl SocketMeasurements {
    /// Returns the claim about time, judged by the measurements; none without any.
    pub(super) fn claim(&self) -> Option<Claim> {
        let Self::Measured(cases) = self else { return None };
        let mut ratios = Vec::new();
        for team in cases.iter().filter(|case| case.deployment == "team") {
            let of_pim =
                |case: &&SocketCase| case.deployment == "pim" && case.airplanes == team.airplanes;
            let pim = cases.iter().find(of_pim);
            let pim_s = pim.map_or_else(Vec::new, SocketCase::times_over_sockets_s);
            ratios.push(Estimate::geometric_ratio(&pim_s, &team.times_over_sockets_s()));
        }
        let verdict = judge_all_above(&ratios, CLAIMS.threshold("A-7"));
        let ours = format!("pim / team: {}", join_estimates(&ratios));
        Some(claim("A-7", verdict, ours))
    }

    /// One row for each case; without measurements the note has the reason.
    pub(super) fn table(&self, plan: &SocketsConfig) -> Table {
        let note = match self {
            Self::Measured(_) => format!(
                "Per run of up to {} cycles, with 95 % intervals: in one process, and with a process for each airplane, \
                 which talk over sockets of the loopback, in lockstep. Time is that of a clock, from when all have \
                 joined to the end; bytes are those of packets, without what the network below adds.",
                plan.cycles
            ),
            Self::LeftOut { reason } => format!("Left out: {reason}"),
        };
        let heads = [
            "airplanes",
            "deployment",
            "time, s",
            "over sockets",
            "messages",
            "over sockets",
            "bytes",
            "over sockets",
            "time, times as long",
        ];
        let mut table = Table::new("Over real sockets", note, &heads);
        if let Self::Measured(cases) = self {
            for case in cases {
                table.push_row(case.table_cells());
            }
        }
        table
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sidestep_document::claim::Verdict;

    fn plan(seeds: usize) -> AgentflyConfig {
        let sockets = SocketsConfig { airplanes: vec![3], seeds, cycles: 8 };
        AgentflyConfig { sockets, ..AgentflyConfig::quick() }
    }

    /// Returns measurements in which the flights of a deployment take as long as `times` says.
    fn measured(seeds: usize, times: impl Fn(&str) -> f64) -> SocketMeasurements {
        let mut run_fleet = |text: &str| -> Result<FlightMeasurement, InputError> {
            let name = DEPLOYMENTS.iter().find(|name| text.contains(&format!("\"{name}\"")));
            let alone = measure_in_one_process(text)?;
            Ok(FlightMeasurement { elapsed_s: times(name.expect("a deployment")), ..alone })
        };
        measure(&plan(seeds), &TrialFile::none(), &mut run_fleet, &mut |_, _| ()).expect("right")
    }

    #[test]
    fn every_deployment_is_measured_beside_itself_in_one_process() {
        let SocketMeasurements::Measured(cases) = measured(2, |_| 3.0) else { panic!("measured") };
        assert_eq!(cases.iter().map(|case| case.deployment).collect::<Vec<_>>(), DEPLOYMENTS);
        for case in &cases {
            assert!(case.alone[0].messages > 0.0, "{case:?}");
            assert_eq!(case.alone[0].messages, case.over_sockets[0].messages);
            assert_eq!(
                case.table_cells().len(),
                SocketMeasurements::Measured(Vec::new()).table(&plan(2).sockets).columns.len()
            );
        }
    }

    #[test]
    fn a_slower_coordinator_holds_the_claim_and_a_faster_one_refutes_it() {
        let verdict = |pim_s: f64| {
            let measured = measured(5, |name| if name == "pim" { pim_s } else { 1.0 });
            measured.claim().expect("judged").verdict
        };
        assert_eq!((verdict(2.0), verdict(0.5)), (Verdict::Held, Verdict::Refuted));
    }

    #[test]
    fn what_was_left_out_judges_nothing_and_says_why() {
        let left_out = SocketMeasurements::LeftOut { reason: "not found; get it".into() };
        assert_eq!(left_out.claim(), None);
        assert_eq!(left_out.table(&plan(1).sockets).note, "Left out: not found; get it");
    }
}
