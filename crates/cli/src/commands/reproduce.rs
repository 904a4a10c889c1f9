//! `sidestep reproduce`: the experiments of a paper, run anew.

use crate::console::{Console, aligned};
use crate::exit::{ExitCode, Failure};
use crate::files::replace;
use crate::interrupt;
use crate::picture::{chart_svg, write_png};
use crate::progress::Stages;
use clap::{Args, Subcommand};
use sidestep::experiment::loria::claims::{Claim, Verdict};
use sidestep::experiment::loria::{LoriaError, NewRecorder, Plan, Report, in_memory, run_recorded};
use sidestep::experiment::{Figure, agentfly};
use sidestep::kernel::InputError;
use sidestep::kernel::ports::{RecordError, Recorder, TableSchema};
use sidestep_record::{Origin, ParquetRecorder};
use std::io::Write;
use std::path::{Path, PathBuf};

const EXAMPLES: &str = "\
Examples:
  sidestep reproduce loria --quick              a rehearsal of seconds
  sidestep reproduce loria --out runs/loria     some minutes: report, figures, all numbers
  sidestep reproduce loria --seeds 40 --json > loria.json
  sidestep reproduce agentfly --quick";

/// Run a paper's experiments anew and judge its claims.
#[derive(Debug, Args)]
pub(crate) struct ReproduceArgs {
    #[command(subcommand)]
    paper: Paper,
}

#[derive(Debug, Subcommand)]
enum Paper {
    /// A parallel simulation of stochastic agent/environment interaction (LORIA, 2001)
    Loria(LoriaArgs),
    /// Probability collectives for collision avoidance in AGENTFLY (2009)
    Agentfly(AgentflyArgs),
}

/// How much to run.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
struct AgentflyArgs {
    /// Write report.md, report.json and the figures to this new or empty folder
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,

    /// Rehearse: run everything once, measure nothing well
    #[arg(long)]
    quick: bool,

    /// Seeds per number of airplanes
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=10_000))]
    seeds: Option<u32>,
}

/// How much to run.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
struct LoriaArgs {
    /// Write report.md, report.json and the figures to this new or empty folder
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,

    /// Rehearse: run everything once, measure nothing well
    #[arg(long)]
    quick: bool,

    /// Seeds per variant
    #[arg(long, value_name = "N")]
    seeds: Option<usize>,

    /// Cycles of each run whose behaviour is measured
    #[arg(long, value_name = "N")]
    cycles: Option<u64>,

    /// Most threads; what is measured of behaviour does not depend on it [default: all processors]
    #[arg(long, value_name = "W")]
    workers: Option<usize>,
}

impl LoriaArgs {
    fn plan(&self) -> Plan {
        let default = if self.quick { Plan::quick() } else { Plan::default() };
        Plan {
            seeds: self.seeds.unwrap_or(default.seeds),
            cycles: self.cycles.unwrap_or(default.cycles),
            workers: self.workers.unwrap_or(default.workers),
            most_workers: self.workers.unwrap_or(default.most_workers),
            ..default
        }
    }
}

/// Runs the command.
///
/// # Errors
/// When the plan or the folder is wrong, or results cannot be stored.
pub(crate) fn reproduce(args: &ReproduceArgs, console: Console) -> Result<ExitCode, Failure> {
    let args = match &args.paper {
        Paper::Loria(args) => args,
        Paper::Agentfly(args) => return agentfly(args, console),
    };
    let report = match &args.out {
        None => run(&args.plan(), &mut in_memory, console)?,
        Some(folder) => {
            check_vacant(folder)?;
            let report = recorded(&args.plan(), folder, console)?;
            store(&report, folder)?;
            report
        }
    };
    console.result(&report, || text(&report, args.out.as_deref()));
    Ok(ExitCode::Done)
}

fn agentfly(args: &AgentflyArgs, console: Console) -> Result<ExitCode, Failure> {
    let default = if args.quick { agentfly::Plan::quick() } else { agentfly::Plan::default() };
    let plan =
        agentfly::Plan { seeds: args.seeds.map_or(default.seeds, |n| n as usize), ..default };
    if let Some(folder) = &args.out {
        check_vacant(folder)?;
    }
    let stages = Stages::new(console);
    let report = agentfly::run(&plan, &mut |what, share| stages.at(what, share));
    stages.clear();
    let report = report?;
    if let Some(folder) = &args.out {
        let json = serde_json::to_vec_pretty(&report).expect("a report is plain data");
        store_parts(&report.figures(), &json, &report.to_markdown(), folder)?;
    }
    console.result(&report, || report.to_markdown());
    Ok(ExitCode::Done)
}

fn run(plan: &Plan, recorders: &mut NewRecorder<'_>, console: Console) -> Result<Report, Failure> {
    let stages = Stages::new(console);
    let report = run_recorded(plan, recorders, &mut |what, share| stages.at(what, share));
    stages.clear();
    report.map_err(|e| match e {
        LoriaError::Plan(e) => Failure::Input(e),
        LoriaError::Record(e) => Failure::Record(e),
    })
}

/// Runs with recordings on the disk, as the paper did; they are deleted in the end. Without a
/// report nothing stays.
fn recorded(plan: &Plan, folder: &Path, console: Console) -> Result<Report, Failure> {
    let timed = folder.join("timed-runs");
    let found = folder.exists();
    std::fs::create_dir_all(&timed).map_err(|e| Failure::write(&timed, &e))?;
    let (at, above) = (timed.clone(), folder.to_path_buf());
    let clean_up = move |failed: bool| {
        let _ = std::fs::remove_dir_all(&at);
        if failed && !found {
            let _ = std::fs::remove_dir(&above);
        }
    };
    let interrupted = clean_up.clone();
    interrupt::end_with(move || interrupted(true))?;
    let mut made = 0;
    let mut new = |schemas: &[TableSchema]| {
        made += 1;
        recorder(&timed.join(format!("{made:04}")), schemas)
    };
    let report = run(plan, &mut new, console);
    clean_up(report.is_err());
    report
}

fn recorder(folder: &Path, schemas: &[TableSchema]) -> Result<Box<dyn Recorder>, RecordError> {
    std::fs::create_dir(folder).map_err(|e| RecordError::new(folder.display(), e))?;
    let origin = Origin {
        program_version: env!("CARGO_PKG_VERSION").into(),
        scenario: "a timed run of `sidestep reproduce loria`".into(),
        seed: 1,
    };
    Ok(Box::new(ParquetRecorder::create(folder, schemas, &origin)?))
}

fn check_vacant(folder: &Path) -> Result<(), InputError> {
    let is_taken = match std::fs::read_dir(folder) {
        Ok(mut entries) => entries.next().is_some(),
        Err(_) => folder.exists(),
    };
    if !is_taken {
        return Ok(());
    }
    Err(InputError::new(folder.display(), "there is something already", "name a new folder"))
}

/// Figures first: where the report is, everything is.
fn store(report: &Report, folder: &Path) -> Result<(), Failure> {
    let json = serde_json::to_vec_pretty(report).expect("a report is plain data");
    store_parts(&report.figures(), &json, &report.to_markdown(), folder)
}

fn store_parts(all: &[Figure], json: &[u8], markdown: &str, folder: &Path) -> Result<(), Failure> {
    let figures = folder.join("figures");
    std::fs::create_dir_all(&figures).map_err(|e| Failure::write(&figures, &e))?;
    for (k, figure) in all.iter().enumerate() {
        draw(figure, &figures.join(format!("{:02}-{}", k + 1, file_name(&figure.title))))?;
    }
    replace(&folder.join("report.json"), |file| file.write_all(json))?;
    replace(&folder.join("report.md"), |file| file.write_all(markdown.as_bytes()))
}

fn draw(figure: &Figure, stem: &Path) -> Result<(), Failure> {
    let svg = chart_svg(figure)?;
    replace(&stem.with_extension("svg"), |file| file.write_all(svg.as_bytes()))?;
    write_png(&stem.with_extension("png"), &svg)
}

/// A title as a file name: `Trip times, by regime` becomes `trip-times-by-regime`.
fn file_name(title: &str) -> String {
    let words = title.split(|c: char| !c.is_ascii_alphanumeric()).filter(|w| !w.is_empty());
    words.map(str::to_ascii_lowercase).take(8).collect::<Vec<_>>().join("-")
}

fn text(report: &Report, folder: Option<&Path>) -> String {
    let Some(folder) = folder else { return report.to_markdown() };
    let claims: Vec<_> = report.claims.iter().map(claim_line).collect();
    let count = |verdict| report.claims.iter().filter(|c| c.verdict == verdict).count();
    format!(
        "{} claims: {} held, {} not held, {} cannot be judged{}\n{}Report: {}\n",
        claims.len(),
        count(Verdict::Held),
        count(Verdict::NotHeld),
        count(Verdict::Lost),
        if report.plan.quick { " (a rehearsal: without weight)" } else { "" },
        aligned(&claims),
        folder.join("report.md").display()
    )
}

fn claim_line(claim: &Claim) -> (String, String) {
    (format!("{:<5} {}", claim.id, claim.verdict.name()), claim.paper.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn titles_become_file_names() {
        assert_eq!(file_name("Trip times, by regime"), "trip-times-by-regime");
        assert_eq!(file_name("1/2 (s)"), "1-2-s");
    }
}
