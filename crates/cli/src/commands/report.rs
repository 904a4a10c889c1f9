//! `sidestep report`: a report of a run or a sweep, as a page and as Markdown.

use crate::console::Console;
use crate::console_watcher::ConsoleWatcher;
use crate::exit::{ExitCode, Failure};
use crate::report_files::{PngOutput, ReportFiles};
use crate::worlds;
use clap::{Args, ValueEnum};
use serde_json::json;
use sidestep::kernel::InputError;
use sidestep_document::Document;
use sidestep_record::FileSet;
use sidestep_report::{PrintStyle, SvgFile};
use sidestep_session::report::document;
use sidestep_session::{display_path, png_bytes};
use std::path::PathBuf;

const EXAMPLES: &str = "\
Examples:
  sidestep report runs/office           runs/office/report.html and report.md
  sidestep report runs/office --out office.html
  sidestep report sweeps/methods        intervals, comparisons, figures
  sidestep report sweeps/methods --figure svg,png --figure-size 85x60

The page is one file that needs no network. A run that is not complete can be reported too; its \
report says so.

A list with the digests of all files is written beside the page, NAME.manifest.json: `sidestep verify PAGE` \
compares them. An earlier report is replaced if its files are as they were written; a page of others, or one \
that was changed, is not.";

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

    #[command(flatten)]
    print: PrintArgs,
}

/// Options of figures for print.
#[derive(Debug, Args)]
#[command(next_help_heading = "Figures for print")]
struct PrintArgs {
    /// Also write every figure to a file of its own, without title, in these formats: svg, png
    #[arg(long = "figure", value_name = "FORM,...", value_delimiter = ',')]
    forms: Vec<FigureFormat>,

    /// Width and height of these figures in mm
    #[arg(long, value_name = "WxH", default_value = "85x60", requires = "forms")]
    figure_size: String,

    /// Size of their text in points
    #[arg(long, value_name = "PT", default_value_t = 8.0, requires = "forms")]
    figure_font: f64,

    /// Rename the label of an axis or a series in these figures; repeatable
    #[arg(long = "label", value_name = "WORDS=OTHERS", requires = "forms")]
    labels: Vec<String>,
}

/// Formats of figures for print; PDF is known so that its error can give a remedy.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum FigureFormat {
    Svg,
    Png,
    /// Refused, with the name of a program that converts SVG to it.
    #[value(hide = true)]
    Pdf,
}

/// # Errors
/// When the folder holds nothing to report, something in it is damaged, or the report cannot be
/// written.
pub(crate) fn report(args: &ReportArgs, console: Console) -> Result<ExitCode, Failure> {
    let files = report_files(args)?;
    // Wrong options are refused before a large folder is read.
    let figures = args.print.figures()?;
    files.begin()?;
    let document = document(worlds(), &args.folder, &ConsoleWatcher::new(console))?;
    figures.iter().try_for_each(|print| check_labels(print, &document))?;
    let mut listed = files.begin()?;
    let figures =
        figures.map(|print| args.print.add(&print, &document, &files, &mut listed)).transpose()?;
    files.add(&mut listed, &document, PngOutput::None)?;
    listed.commit()?;
    let html = files.html.display();
    let markdown = files.markdown();
    let figures = figures.as_ref().map(|folder| folder.display().to_string());
    let json = json!({
        "html": html.to_string(),
        "markdown": markdown.display().to_string(),
        "figures": figures,
    });
    let more = figures.map_or(String::new(), |folder| format!("{folder}\n"));
    console.print_result(&json, || format!("{html}\n{}\n{more}", markdown.display()))?;
    Ok(ExitCode::Done)
}

impl PrintArgs {
    /// Returns how figures for print look; `None` if none are requested.
    ///
    /// # Errors
    /// When a size, a label or a format is wrong.
    fn figures(&self) -> Result<Option<PrintStyle>, InputError> {
        if self.forms.contains(&FigureFormat::Pdf) {
            let remedy = "write svg, of which `rsvg-convert -f pdf` or Inkscape make PDF";
            return Err(InputError::new("--figure", "no figure is written as PDF", remedy));
        }
        if self.forms.is_empty() {
            return Ok(None);
        }
        if !(4.0..=40.0).contains(&self.figure_font) {
            let cause = format!("is {} pt", self.figure_font);
            return Err(InputError::new("--figure-font", cause, "give 4 to 40"));
        }
        let labels =
            self.labels.iter().map(|label| parse_label(label)).collect::<Result<_, _>>()?;
        let size_mm = parse_size_mm(&self.figure_size)?;
        Ok(Some(PrintStyle { size_mm, font_pt: self.figure_font, labels }))
    }

    /// Adds the figures beside the page, and returns their folder.
    ///
    /// # Errors
    /// When something cannot be drawn or written.
    fn add(
        &self,
        print: &PrintStyle,
        document: &Document,
        files: &ReportFiles,
        listed: &mut FileSet,
    ) -> Result<PathBuf, Failure> {
        let folder = format!("{}-print", files.stem());
        for SvgFile { stem, svg } in print.figures(document)? {
            if self.forms.contains(&FigureFormat::Svg) {
                listed.stage_bytes::<Failure>(&format!("{folder}/{stem}.svg"), svg.as_bytes())?;
            }
            if self.forms.contains(&FigureFormat::Png) {
                listed
                    .stage_bytes::<Failure>(&format!("{folder}/{stem}.png"), &png_bytes(&svg)?)?;
            }
        }
        Ok(files.html.with_file_name(folder))
    }
}

/// Checks that each label occurs in some figure, before anything is written.
///
/// # Errors
/// When one is in none; the error names the first.
fn check_labels(print: &PrintStyle, document: &Document) -> Result<(), InputError> {
    let Some(label) = print.unused_labels(document).first().copied() else { return Ok(()) };
    let cause = format!("no figure has the words `{label}`");
    Err(InputError::new("--label", cause, "write them as the figure's axis or legend does"))
}

/// Parses width and height in mm.
fn parse_size_mm(text: &str) -> Result<[f64; 2], InputError> {
    let sides: Vec<Option<f64>> = text.split('x').map(|side| side.trim().parse().ok()).collect();
    match sides[..] {
        [Some(width), Some(height)]
            if [width, height].iter().all(|mm| (30.0..=500.0).contains(mm)) =>
        {
            Ok([width, height])
        }
        _ => {
            let cause = format!("`{text}` is no size");
            Err(InputError::new("--figure-size", cause, "write WxH, 30 to 500 mm each: 85x60"))
        }
    }
}

/// Parses `WORDS=OTHERS`.
fn parse_label(text: &str) -> Result<(String, String), InputError> {
    let parts = text.split_once('=').filter(|(from, _)| !from.is_empty());
    let (from, to) = parts.ok_or_else(|| {
        let cause = format!("`{text}` has no label text");
        InputError::new("--label", cause, "write what stands there = what shall stand there")
    })?;
    Ok((from.into(), to.into()))
}

/// Returns the files of the report.
///
/// # Errors
/// When the page's name does not end in `.html` or `.htm`.
fn report_files(args: &ReportArgs) -> Result<ReportFiles, InputError> {
    let html = args.out.clone().unwrap_or_else(|| args.folder.join("report.html"));
    let ending = html.extension().and_then(|e| e.to_str());
    let stem = html.file_stem().map(display_path);
    let (Some("html" | "htm"), Some(stem)) = (ending, stem) else {
        let cause = "the page is HTML, and Markdown is written beside it";
        return Err(InputError::new(html.display(), cause, "give a name that ends in .html"));
    };
    let pictures = format!("{stem}-figures");
    Ok(ReportFiles { html, pictures })
}
