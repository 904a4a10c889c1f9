//! `sidestep reproduce`: the experiments of a paper, run again, and a study of our own. One file each.

mod agentfly;
mod loria;
mod mapf;
mod serpentine;

use crate::console::{Console, align_pairs};
use crate::exit::{ExitCode, Failure};
use crate::interrupt;
use crate::report_files::{PngOutput, ReportFiles};
use crate::worlds;
use clap::{Args, Subcommand};
use serde::Serialize;
use sidestep::kernel::InputError;
use sidestep_document::Document;
use sidestep_document::claim::{Claim, verdict_summary};
use sidestep_document::document::Picture;
use sidestep_draw::{DrawError, PictureOptions, draw};
use sidestep_papers::{Scene, TrialFile, TrialFileError, TrialFileHead};
use std::path::Path;

const EXAMPLES: &str = "\
Examples:
  sidestep reproduce loria --quick              a trial of a few seconds
  sidestep reproduce loria --out runs/loria     report, figures, all numbers
  sidestep reproduce loria --seeds 40 --json > loria.json
  sidestep reproduce agentfly --quick
  sidestep reproduce mapf --out runs/mapf       about 20 minutes
  sidestep reproduce serpentine --out runs/serpentine";

/// Reproduce a paper's experiments, or a study, and judge the claims.
#[derive(Debug, Args)]
pub(crate) struct ReproduceArgs {
    #[command(subcommand)]
    paper: Paper,
}

#[derive(Debug, Subcommand)]
enum Paper {
    /// A parallel simulation of stochastic agent/environment interaction (LORIA, 2001)
    Loria(loria::LoriaArgs),
    /// Probability collectives for collision avoidance in AGENTFLY (2009)
    Agentfly(agentfly::AgentflyArgs),
    /// Multi-agent serpentine motion with reactive obstacle avoidance (2005)
    Serpentine(serpentine::SerpentineArgs),
    /// Planners and deciding alone on wheels that err (our own study)
    Mapf(mapf::MapfArgs),
}

/// # Errors
/// When the plan or the folder is wrong, or results cannot be stored.
pub(crate) fn reproduce(args: &ReproduceArgs, console: Console) -> Result<ExitCode, Failure> {
    match &args.paper {
        Paper::Loria(args) => loria::reproduce(args, console),
        Paper::Agentfly(args) => agentfly::reproduce(args, console),
        Paper::Serpentine(args) => serpentine::reproduce(args, console),
        Paper::Mapf(args) => mapf::reproduce(args, console),
    }
}

/// Returns a picture with its title and caption beside it.
fn scene_picture(scene: &Scene) -> Result<Picture, DrawError> {
    let page = PictureOptions::page(&scene.scenery, "");
    let options = PictureOptions { title: String::new(), ..page };
    let svg = draw(&scene.scenery, &scene.frame, &scene.trails, &options)?;
    Ok(Picture { title: scene.title.clone(), caption: scene.caption.clone(), svg })
}

fn check_vacant(folder: &Path) -> Result<(), InputError> {
    let is_used = match std::fs::read_dir(folder) {
        Ok(mut entries) => entries.next().is_some(),
        // A file, or a folder that may not be read.
        Err(_) => folder.exists(),
    };
    if !is_used {
        return Ok(());
    }
    Err(InputError::new(folder.display(), "already exists and is not empty", "give a new folder"))
}

/// Name of the file with the trials that have ended, beside which the report will be.
const TRIALS: &str = "trials.jsonl";

/// Opens the file of trials in the folder of a report: a new one, or that of an interrupted command. Nothing is kept
/// without a folder.
fn keep_trials(
    out: Option<&Path>,
    plan: &impl Serialize,
    console: Console,
) -> Result<TrialFile, Failure> {
    let Some(folder) = out else { return Ok(TrialFile::none()) };
    let mut plan = serde_json::to_value(plan).expect("a plan is plain data");
    // No result depends on it.
    if let Some(fields) = plan.as_object_mut() {
        fields.remove("workers");
    }
    let path = folder.join(TRIALS);
    let has_trials_alone = std::fs::read_dir(folder).is_ok_and(|mut entries| {
        entries.all(|entry| entry.is_ok_and(|entry| entry.file_name() == TRIALS))
    });
    if !has_trials_alone {
        check_vacant(folder)?;
    }
    std::fs::create_dir_all(folder).map_err(|e| Failure::cannot_write(folder, &e))?;
    let head = TrialFileHead { build: worlds().build().into(), plan };
    let kept = TrialFile::open(&path, &head).map_err(|error| match error {
        TrialFileError::Io(e) => Failure::cannot_write(&path, &e),
        TrialFileError::InUse | TrialFileError::Other(_) => Failure::Input(InputError::new(
            path.display(),
            error.to_string(),
            "give the arguments with which it began, or a new folder",
        )),
    })?;
    if kept.known_count() > 0 {
        console.note(format!("Goes on after {} trials in {}", kept.known_count(), path.display()));
    }
    interrupt::on_interrupt(move || {
        console.note(format!(
            "What has ended is kept in {}: the same command goes on",
            path.display()
        ));
    })?;
    Ok(kept)
}

/// Removes the file of trials, once their report is there, and tells if not all could be kept.
fn forget_trials(kept: TrialFile, console: Console) {
    if let Some(error) = kept.take_failure() {
        console.warn(format!("not all trials could be kept for the case of an interrupt: {error}"));
    }
    // The report is complete without it.
    if let Err(error) = kept.remove() {
        console.warn(format!("{TRIALS} could not be removed: {error}"));
    }
}

/// The results of a paper's experiments.
struct PaperResults<'a> {
    document: Document,
    claims: &'a [Claim],
    quick: bool,
}

/// Stores the report if a folder was given, and prints the results.
fn store_and_print(
    report: &impl Serialize,
    outcome: &PaperResults<'_>,
    out: Option<&Path>,
    console: Console,
) -> Result<ExitCode, Failure> {
    if let Some(folder) = out {
        let json = serde_json::to_vec_pretty(report).expect("a report is plain data");
        let files = ReportFiles { html: folder.join("report.html"), pictures: "figures".into() };
        let mut listed = files.begin()?;
        listed.stage_bytes::<Failure>("report.json", &json)?;
        files.add(&mut listed, &outcome.document, PngOutput::AlsoPng)?;
        listed.commit()?;
    }
    console.print_result(report, || summary(outcome, out))?;
    Ok(ExitCode::Done)
}

/// Returns the verdicts in a few lines, and where the report is.
fn summary(outcome: &PaperResults<'_>, out: Option<&Path>) -> String {
    let lines: Vec<_> = outcome.claims.iter().map(claim_line).collect();
    let report = match out {
        Some(folder) => format!("Report: {}", folder.join("report.html").display()),
        None => "No report was kept: --out DIR keeps it, with all figures and numbers.".into(),
    };
    format!(
        "{}{}\n{}{report}\n",
        verdict_summary(outcome.claims),
        if outcome.quick { " A rehearsal: without weight." } else { "" },
        align_pairs(&lines),
    )
}

fn claim_line(claim: &Claim) -> (String, String) {
    (format!("{:<5} {}", claim.id, claim.verdict.name()), claim.paper.to_string())
}
