//! `sidestep report`: a report of a run or a sweep, as a page and as Markdown.

use crate::console::Console;
use crate::exit::{ExitCode, Failure};
use crate::pages::{Pages, Raster};
use crate::watch::Watch;
use crate::worlds;
use clap::Args;
use serde_json::json;
use sidestep::kernel::InputError;
use sidestep_session::report::document;
use std::path::PathBuf;

const EXAMPLES: &str = "\
Examples:
  sidestep report runs/office           runs/office/report.html and report.md
  sidestep report runs/office --out office.html
  sidestep report sweeps/methods        intervals, comparisons, figures

The page is one file that needs no network. A run that is not complete can be reported too; its \
report says so.";

/// Write a report of a run or a sweep: one HTML file, and Markdown.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct ReportArgs {
    /// Folder of a run or a sweep
    #[arg(value_name = "DIR")]
    folder: PathBuf,

    /// Output file; the Markdown version is written beside it [default: DIR/report.html]
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
    let document = document(worlds(), &args.folder, &Watch::new(console))?;
    pages.store(&document, Raster::None)?;
    let (html, markdown) = (pages.html.display(), pages.markdown());
    let json = json!({ "html": html.to_string(), "markdown": markdown.display().to_string() });
    console.result(&json, || format!("{html}\n{}\n", markdown.display()));
    Ok(ExitCode::Done)
}

/// Returns the files of the report.
///
/// # Errors
/// When the page's name does not end in `.html` or `.htm`.
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
