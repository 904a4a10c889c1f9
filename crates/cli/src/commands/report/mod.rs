//! `sidestep report`: a folder of results as a page, and as Markdown.
//!
//! ```text
//! run.rs        a run folder -> a document       metrics.rs   numbers of a summary -> tables
//! sweep.rs      the folder of a sweep -> a document
//! recorded.rs   its tables: what is in them      events.rs    what happened, and when
//! ```

mod events;
mod metrics;
mod recorded;
mod run;
mod sweep;

use crate::console::{Console, grouped};
use crate::exit::{ExitCode, Failure};
use crate::pages::{Pages, Raster};
use crate::sweep::Folder;
use clap::Args;
use serde_json::json;
use sidestep::kernel::InputError;
use sidestep_document::Document;
use std::path::{Path, PathBuf};

const EXAMPLES: &str = "\
Examples:
  sidestep report runs/office                  runs/office/report.html and report.md
  sidestep report runs/office --out office.html
  sidestep report sweeps/methods               of all runs: intervals, comparisons, figures

The page is one file that needs no network. A run that has not ended can be reported too; the
report says so.";

/// Write a report of a run or a sweep: one HTML file, and Markdown.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct ReportArgs {
    /// The folder of a run or a sweep
    #[arg(value_name = "DIR")]
    folder: PathBuf,

    /// Write the page to this file, and its Markdown twin beside it [default: DIR/report.html]
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

/// Runs the command.
///
/// # Errors
/// When the folder holds nothing to report, something in it is damaged, or the report cannot be
/// written.
pub(crate) fn report(args: &ReportArgs, console: Console) -> Result<ExitCode, Failure> {
    let pages = pages(args)?;
    let document = document(&args.folder)?;
    pages.store(&document, Raster::None)?;
    let (html, markdown) = (pages.html.display(), pages.markdown());
    let json = json!({ "html": html.to_string(), "markdown": markdown.display().to_string() });
    console.result(&json, || format!("{html}\n{}\n", markdown.display()));
    Ok(ExitCode::Done)
}

/// What there is to say about a folder. The one place that tells sorts of folders apart.
fn document(folder: &Path) -> Result<Document, Failure> {
    match Folder::is_at(folder) {
        true => sweep::document(&Folder::open(folder)?),
        false => Ok(run::document(folder)?),
    }
}

/// A number whose groups of digits stay on one line.
fn count(number: u64) -> String {
    grouped(number).replace(' ', "\u{a0}")
}

/// Where the report goes; its Markdown twin must not be the page itself.
fn pages(args: &ReportArgs) -> Result<Pages, InputError> {
    let html = args.out.clone().unwrap_or_else(|| args.folder.join("report.html"));
    let ending = html.extension().and_then(|e| e.to_str());
    let stem = html.file_stem().and_then(|stem| stem.to_str());
    let (Some("html" | "htm"), Some(stem)) = (ending, stem) else {
        let cause = "the page is HTML, and Markdown is written beside it";
        return Err(InputError::new(html.display(), cause, "give a name that ends in .html"));
    };
    let pictures = format!("{stem}-figures");
    Ok(Pages { html, pictures })
}
