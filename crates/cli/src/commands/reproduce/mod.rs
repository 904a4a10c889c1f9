//! `sidestep reproduce`: the experiments of a paper, run anew. One file a paper.

mod agentfly;
mod loria;
mod serpentine;

use crate::console::{Console, aligned};
use crate::exit::{ExitCode, Failure};
use crate::files::replace;
use crate::picture::{chart_svg, write_png};
use clap::{Args, Subcommand};
use serde::Serialize;
use sidestep::experiment::Figure;
use sidestep::experiment::claim::{Claim, Verdict};
use sidestep::kernel::InputError;
use std::io::Write;
use std::path::{Path, PathBuf};

const EXAMPLES: &str = "\
Examples:
  sidestep reproduce loria --quick              a rehearsal of seconds
  sidestep reproduce loria --out runs/loria     some minutes: report, figures, all numbers
  sidestep reproduce loria --seeds 40 --json > loria.json
  sidestep reproduce agentfly --quick
  sidestep reproduce serpentine --out runs/serpentine";

/// Run a paper's experiments anew and judge its claims.
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
}

/// Runs the command.
///
/// # Errors
/// When the plan or the folder is wrong, or results cannot be stored.
pub(crate) fn reproduce(args: &ReproduceArgs, console: Console) -> Result<ExitCode, Failure> {
    match &args.paper {
        Paper::Loria(args) => loria::reproduce(args, console),
        Paper::Agentfly(args) => agentfly::reproduce(args, console),
        Paper::Serpentine(args) => serpentine::reproduce(args, console),
    }
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
fn store(
    report: &impl Serialize,
    all: &[Figure],
    markdown: &str,
    folder: &Path,
) -> Result<(), Failure> {
    let json = serde_json::to_vec_pretty(report).expect("a report is plain data");
    let figures = folder_of_figures(folder)?;
    for (k, figure) in all.iter().enumerate() {
        let stem = figures.join(format!("{:02}-{}", k + 1, file_name(&figure.title)));
        store_svg(&chart_svg(figure)?, &stem)?;
    }
    replace(&folder.join("report.json"), |file| file.write_all(&json))?;
    replace(&folder.join("report.md"), |file| file.write_all(markdown.as_bytes()))
}

fn folder_of_figures(folder: &Path) -> Result<PathBuf, Failure> {
    let figures = folder.join("figures");
    std::fs::create_dir_all(&figures).map_err(|e| Failure::write(&figures, &e))?;
    Ok(figures)
}

/// Writes a picture as SVG and PNG.
fn store_svg(svg: &str, stem: &Path) -> Result<(), Failure> {
    replace(&stem.with_extension("svg"), |file| file.write_all(svg.as_bytes()))?;
    write_png(&stem.with_extension("png"), svg)
}

/// A title as a file name: `Trip times, by regime` becomes `trip-times-by-regime`.
fn file_name(title: &str) -> String {
    let words = title.split(|c: char| !c.is_ascii_alphanumeric()).filter(|w| !w.is_empty());
    words.map(str::to_ascii_lowercase).take(8).collect::<Vec<_>>().join("-")
}

/// Verdicts in few lines, and where the rest is.
fn summary(claims: &[Claim], quick: bool, folder: &Path) -> String {
    let lines: Vec<_> = claims.iter().map(claim_line).collect();
    let count = |verdict| claims.iter().filter(|c| c.verdict == verdict).count();
    format!(
        "{} claims: {} held, {} not held, {} cannot be judged{}\n{}Report: {}\n",
        lines.len(),
        count(Verdict::Held),
        count(Verdict::NotHeld),
        count(Verdict::Lost),
        if quick { " (a rehearsal: without weight)" } else { "" },
        aligned(&lines),
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
