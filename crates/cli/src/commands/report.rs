//! `sidestep report`: a report of a run or a sweep, as a page and as Markdown.

use crate::console::Console;
use crate::console_watcher::ConsoleWatcher;
use crate::exit::{ExitCode, Failure};
use crate::fonts::find_fonts;
use crate::interrupt;
use crate::report_files::{PngOutput, ReportFiles};
use crate::size::parse_sides;
use crate::worlds;
use clap::{Args, ValueEnum};
use serde_json::json;
use sidestep::kernel::InputError;
use sidestep::kernel::workers::available_workers;
use sidestep_document::Document;
use sidestep_draw::{DrawError, Fonts, MAX_PNG_PX, to_pdf, to_png_with_density};
use sidestep_record::FileSet;
use sidestep_report::{FigureLook, PrintFigure, PrintStyle};
use sidestep_server::replay_page::{InspectionRequest, PageRequest, page_document};
use sidestep_server::sweep_gallery::{GalleryRequest, RunChoice, find_sweep, write_gallery};
use sidestep_session::export::ExportScope;
use sidestep_session::report::{document, track_figure};
use sidestep_session::{RecordedRun, display_path};
use std::path::PathBuf;

const EXAMPLES: &str = "\
Examples:
  sidestep report runs/office           runs/office/report.html and report.md
  sidestep report runs/office --out office.html
  sidestep report sweeps/methods        intervals, comparisons, figures
  sidestep report sweeps/methods --figure pdf --figure-data
  sidestep report runs/office --page    with its replay, which events open

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

    /// Also write the replay as a page beside the report, which leads to it: of a run NAME-replay.html,
    /// of a sweep the folder NAME-replays, as `sidestep export --to page` makes them
    #[arg(long)]
    page: bool,

    #[command(flatten)]
    print: PrintArgs,
}

/// Options of figures for print.
#[derive(Debug, Args)]
#[command(next_help_heading = "Figures for print")]
struct PrintArgs {
    /// Also write every figure to files of its own, without title: pdf, svg, png
    #[arg(long = "figure", value_name = "FORM,...", value_delimiter = ',')]
    forms: Vec<FigureFormat>,

    /// Where they are shown: on paper, in a talk, or on a dark slide
    #[arg(long, value_name = "STYLE", default_value = "paper", requires = "forms")]
    figure_style: FigureStyle,

    /// Width and height in mm; differences in many metrics are as high as their rows need [default: 85x60, of slides
    /// 240x135]
    #[arg(long, value_name = "WxH", requires = "forms")]
    figure_size: Option<String>,

    /// Size of text in points [default: 8, of slides 16]
    #[arg(long, value_name = "PT", requires = "forms")]
    figure_font: Option<f64>,

    /// Font of their text: the name of an installed family, or a .ttf or .otf file [default: DejaVu
    /// Sans]
    #[arg(long, value_name = "NAME|FILE", requires = "forms")]
    figure_family: Option<String>,

    /// Pixels per inch of PNG
    #[arg(long, value_name = "DPI", default_value_t = 300.0, requires = "forms")]
    figure_dpi: f64,

    /// Also write the data of every figure, as CSV beside it
    #[arg(long, requires = "forms")]
    figure_data: bool,

    /// Rename a label of an axis or a series in these figures; repeatable
    #[arg(long = "label", value_name = "WORDS=OTHERS", requires = "forms")]
    labels: Vec<String>,
}

/// The picture of tracks in the folder of a run that has ended.
const RUN_PICTURE: &str = "trajectories.svg";
/// Millimeters of an inch.
const MM_PER_INCH: f64 = 25.4;

/// Formats of figures for print.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum FigureFormat {
    Pdf,
    Svg,
    Png,
}

/// Where figures are shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum FigureStyle {
    Paper,
    Talk,
    Dark,
}

impl FigureStyle {
    fn look(self) -> FigureLook {
        match self {
            Self::Paper => FigureLook::Paper,
            Self::Talk => FigureLook::Talk,
            Self::Dark => FigureLook::Dark,
        }
    }
}

/// Figures for print: their look, and the fonts of PNG and PDF.
struct Print {
    style: PrintStyle,
    fonts: Fonts,
}

/// # Errors
/// When the folder holds nothing to report, something in it is damaged, or the report cannot be
/// written.
pub(crate) fn report(args: &ReportArgs, console: Console) -> Result<ExitCode, Failure> {
    let files = report_files(args)?;
    // Wrong options are refused before a large folder is read.
    let mut figures = args.print.figures()?;
    files.begin()?;
    let watcher = ConsoleWatcher::new(console);
    let mut document = document(worlds(), &args.folder, &watcher)?;
    if let Some(print) = &mut figures {
        split_at_known_labels(&mut print.style.labels, &document);
        check_labels(&print.style, &document)?;
    }
    let mut listed = files.begin()?;
    if args.page {
        interrupt::listen()?;
        document.replay = Some(add_replay(args, &files, &mut listed, &watcher)?);
    }
    let figures = match figures {
        Some(print) => {
            let tracks = tracks(args, &print, console)?;
            Some(args.print.add(&print, &document, tracks, (&files, &mut listed))?)
        }
        None => None,
    };
    files.add(&mut listed, &document, PngOutput::None)?;
    listed.commit()?;
    let html = files.html.display();
    let markdown = files.markdown();
    let figures = figures.as_ref().map(|folder| folder.display().to_string());
    let beside = |name: &String| files.html.with_file_name(name).display().to_string();
    let replay = document.replay.as_ref().map(beside);
    let json = json!({
        "html": html.to_string(),
        "markdown": markdown.display().to_string(),
        "figures": figures,
        "replay": replay,
    });
    let more = [replay, figures].into_iter().flatten().map(|path| format!("{path}\n"));
    let more: String = more.collect();
    console.print_result(&json, || format!("{html}\n{}\n{more}", markdown.display()))?;
    Ok(ExitCode::Done)
}

/// Adds the replay of a run, or those of a sweep, beside the report; returns the name of the page that shows it.
///
/// # Errors
/// When it cannot be made or written; [`Failure::Interrupted`] when the user stopped it.
fn add_replay(
    args: &ReportArgs,
    files: &ReportFiles,
    listed: &mut FileSet,
    watcher: &ConsoleWatcher,
) -> Result<String, Failure> {
    let scope = ExportScope {
        out: None,
        replace: false,
        from: None,
        until: None,
        every: None,
        workers: available_workers(),
    };
    let inspections = InspectionRequest::default();
    if let Some(sweep) = find_sweep(&args.folder)? {
        let folder = format!("{}-replays", files.stem());
        let request = GalleryRequest { scope, inspections, runs: RunChoice::default() };
        let mut store =
            |name: &str, bytes: &[u8]| listed.stage_bytes(&format!("{folder}/{name}"), bytes);
        write_gallery(worlds(), &sweep, &request, &mut store, watcher)?;
        return Ok(format!("{folder}/index.html"));
    }
    let recorded = RecordedRun::open(worlds(), &args.folder)?;
    let request = PageRequest { scope, inspections, beside: None };
    let (page, _) = page_document(worlds(), &recorded, &request, watcher)?;
    let name = format!("{}-replay.html", files.stem());
    listed.stage_bytes::<Failure>(&name, page.as_bytes())?;
    Ok(name)
}

impl PrintArgs {
    /// Returns how figures for print look; `None` if none are requested.
    ///
    /// # Errors
    /// When a size, a label or a font is wrong.
    fn figures(&self) -> Result<Option<Print>, InputError> {
        if self.forms.is_empty() {
            return Ok(None);
        }
        let look = self.figure_style.look();
        let font_pt = self.figure_font.unwrap_or(look.font_pt());
        if !(4.0..=40.0).contains(&font_pt) {
            let cause = format!("is {font_pt} pt");
            return Err(InputError::new("--figure-font", cause, "give 4 to 40"));
        }
        if !(30.0..=1200.0).contains(&self.figure_dpi) {
            let cause = format!("is {}", self.figure_dpi);
            return Err(InputError::new("--figure-dpi", cause, "give 30 to 1200"));
        }
        let labels =
            self.labels.iter().map(|label| parse_label(label)).collect::<Result<_, _>>()?;
        let size_mm = match &self.figure_size {
            Some(size) => parse_size_mm(size)?,
            None => look.size_mm(),
        };
        self.check_size(look, size_mm)?;
        let style = PrintStyle { look, size_mm, font_pt, labels };
        Ok(Some(Print { style, fonts: self.fonts()? }))
    }

    /// Refuses sizes in which nothing has room, and more pixels than a PNG may have.
    fn check_size(&self, look: FigureLook, size_mm: [f64; 2]) -> Result<(), InputError> {
        let [width, height] = size_mm;
        let least_mm = look.least_mm();
        if width.min(height) < least_mm {
            let cause = format!("{width}x{height} mm leave no room for text this large");
            let size = size_mm.map(|mm| mm.max(least_mm));
            let remedy = format!("give --figure-size {}x{}, or more", size[0], size[1]);
            return Err(InputError::new("--figure-size", cause, remedy));
        }
        if self.forms.contains(&FigureFormat::Png) {
            let longer_mm = width.max(height);
            let max_dpi = (f64::from(MAX_PNG_PX) / longer_mm * MM_PER_INCH).floor();
            if self.figure_dpi > max_dpi {
                let px = (longer_mm / MM_PER_INCH * self.figure_dpi).round();
                let cause = format!("{longer_mm} mm at {} DPI are {px} pixels", self.figure_dpi);
                let remedy = format!("give --figure-dpi {max_dpi}, or a smaller --figure-size");
                return Err(InputError::new("--figure-dpi", cause, remedy));
            }
        }
        Ok(())
    }

    /// Returns the fonts of the figures.
    ///
    /// # Errors
    /// When no font has the name, or the file is no font.
    fn fonts(&self) -> Result<Fonts, InputError> {
        let Some(family) = &self.figure_family else { return Ok(Fonts::default()) };
        find_fonts(family)
    }

    /// Adds the figures beside the page, and returns their folder.
    ///
    /// # Errors
    /// When something cannot be drawn or written.
    fn add(
        &self,
        print: &Print,
        document: &Document,
        tracks: Option<PrintFigure>,
        (files, listed): (&ReportFiles, &mut FileSet),
    ) -> Result<PathBuf, Failure> {
        let folder = format!("{}-print", files.stem());
        let before = usize::from(tracks.is_some());
        let figures = print.style.figures(document, before)?;
        for figure in tracks.into_iter().chain(figures) {
            let place = format!("{folder}/{}", figure.file.stem);
            for (ending, bytes) in self.figure_files(print, &figure)? {
                listed.stage_bytes::<Failure>(&format!("{place}.{ending}"), &bytes)?;
            }
        }
        Ok(files.html.with_file_name(folder))
    }

    /// Returns a figure in all requested formats, with the ending of each.
    ///
    /// # Errors
    /// When it cannot be drawn.
    fn figure_files(
        &self,
        print: &Print,
        figure: &PrintFigure,
    ) -> Result<Vec<(&'static str, Vec<u8>)>, DrawError> {
        let svg = print.fonts.apply(&figure.file.svg);
        let mut files = Vec::new();
        if self.forms.contains(&FigureFormat::Pdf) {
            files.push(("pdf", to_pdf(&svg, &figure.title, &print.fonts)?));
        }
        if self.forms.contains(&FigureFormat::Png) {
            files.push(("png", to_png_with_density(&svg, self.figure_dpi, &print.fonts)?));
        }
        if self.forms.contains(&FigureFormat::Svg) {
            files.push(("svg", svg.into_bytes()));
        }
        if self.figure_data {
            files.push(("csv", figure.csv.clone().into_bytes()));
        }
        Ok(files)
    }
}

/// Returns the tracks of a run as its first figure; none of a sweep, and of a run of which no picture could be drawn.
///
/// # Errors
/// When the run is damaged, or the size leaves no room.
fn tracks(
    args: &ReportArgs,
    print: &Print,
    console: Console,
) -> Result<Option<PrintFigure>, Failure> {
    if !args.folder.join(RUN_PICTURE).is_file() {
        return Ok(None);
    }
    let watcher = ConsoleWatcher::new(console);
    // A column of a paper goes on below; a slide does not.
    let may_grow = print.style.look == FigureLook::Paper;
    let style = print.style.layout();
    let tracks = track_figure(worlds(), &args.folder, (&style, may_grow), &watcher)?;
    Ok(Some(print.style.finish(1, tracks.title, &tracks.svg, tracks.csv)))
}

/// Takes `n=4=four` apart where a figure has the words `n=4`, rather than at the first sign.
fn split_at_known_labels(labels: &mut [(String, String)], document: &Document) {
    let known = PrintStyle::document_labels(document);
    for label in labels {
        let text = format!("{}={}", label.0, label.1);
        let splits = text.match_indices('=').map(|(at, _)| (&text[..at], &text[at + 1..]));
        // The longest words: those of a variant may begin as those of another one do.
        if let Some((from, to)) = splits.rev().find(|(from, _)| known.contains(from)) {
            *label = (from.to_string(), to.to_string());
        }
    }
}

/// Checks that each label occurs in some figure, before anything is written.
///
/// # Errors
/// When one is in none; the error names the first, and the labels that there are.
fn check_labels(print: &PrintStyle, document: &Document) -> Result<(), InputError> {
    let Some(label) = print.unused_labels(document).first().copied() else { return Ok(()) };
    let cause = format!("no figure has the words `{label}`");
    let known: Vec<String> =
        PrintStyle::document_labels(document).iter().map(|known| format!("`{known}`")).collect();
    let remedy = match &known[..] {
        [] => "leave it out: there is no figure".to_string(),
        known => format!("write one of {}", known.join(", ")),
    };
    Err(InputError::new("--label", cause, remedy))
}

/// Parses width and height in mm.
fn parse_size_mm(text: &str) -> Result<[f64; 2], InputError> {
    let sides = parse_sides(text);
    sides.filter(|sides| sides.iter().all(|mm| (30.0..=500.0).contains(mm))).ok_or_else(|| {
        let cause = format!("`{text}` is no size");
        InputError::new("--figure-size", cause, "write WxH, 30 to 500 mm each: 85x60")
    })
}

/// Parses `WORDS=OTHERS`, for now at the first sign.
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
