//! `sidestep export`: converts a recorded run, or the runs of a sweep, to formats of other programs.

mod gallery;

use crate::console::{Console, group_thousands};
use crate::console_watcher::ConsoleWatcher;
use crate::exit::{ExitCode, Failure};
use crate::interrupt;
use crate::scenario_args::WorkersArg;
use crate::size::PixelSize;
use crate::worlds;
use clap::{Args, ValueEnum};
use serde_json::{Value, json};
use sidestep::kernel::view::AgentNumber;
use sidestep::kernel::{Cycle, InputError};
use sidestep_draw::PictureView;
use sidestep_record::origins_text;
use sidestep_server::replay_page::{
    InspectionRequest, PageContent, PageRequest, PageResult, export_page,
};
use sidestep_server::sweep_gallery::{RunChoice, find_sweep};
use sidestep_session::export::{
    self, AnimationOptions, CycleWindow, ExportRequest, ExportResult, ExportScope, Format,
};
use sidestep_session::{PictureLook, RecordedRun, display_path};
use std::path::{Path, PathBuf};

const EXAMPLES: &str = "\
Examples:
  sidestep export runs/office --to csv              runs/office-csv/
  sidestep export runs/office --to mcap --every 10  for Foxglove
  sidestep export runs/hall --to lorr               for PlanViz of the League
  sidestep export runs/reacher --to trajectory      motions of arms for ROS 2
  sidestep export runs/office --to gif --cycles 1000:2000
  sidestep export runs/office --to png --agents 1,4,8 --cycles 200:400
  sidestep export office.mcap --to mp4-frames       frames, and a call of ffmpeg
  sidestep export runs/office --to page --agents 1  one file for any browser
  sidestep export sweeps/methods --to page          its runs, each with a replay

Tables are copied from the run folder; those of a flight in real time come with a file that says \
which cycles were flown and which simulated. Everything else is computed again from the recorded \
scenario; an export that includes the recorded end confirms the recorded digest there.

A list with the digests of what was written comes with it: export.manifest.json in a folder, FILE.manifest.json \
beside a file; an MCAP file has checksums of its own. `sidestep verify PATH` compares them, and --replace \
deletes nothing else: files of others stay, and an export that was changed is left alone.";

/// The output formats.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum ExportFormat {
    /// Tables as text (CSV)
    Csv,
    /// Tables as Parquet, one file each
    Parquet,
    /// Paths of airplanes on earth, for maps (GeoJSON)
    #[value(name = "geojson")]
    GeoJson,
    /// Robots and tasks in JSON, with the map, for the viewer of the League of Robot Runners
    Lorr,
    /// Recording for Foxglove and other viewers: bodies, scans, events, places on earth
    Mcap,
    /// ROS 2 bag: odometry, true poses and scans of robots, and the map
    #[value(name = "rosbag")]
    RosBag,
    /// Motions of the joints of arms: a ROS 2 bag with JointTrajectory and JointState, CSV and JSON
    Trajectory,
    /// Picture of the run, or of one cycle, as SVG
    Svg,
    /// The same picture as PNG
    Png,
    /// Animated GIF
    Gif,
    /// The studio's view of the run as one HTML file, which needs no server and no network
    Page,
    /// Numbered PNG frames, to be made into a video
    #[value(name = "mp4-frames")]
    Mp4Frames,
}

impl ExportFormat {
    fn name(self) -> &'static str {
        match self {
            Self::Csv => "csv",
            Self::Parquet => "parquet",
            Self::GeoJson => "geojson",
            Self::Lorr => "lorr",
            Self::Mcap => "mcap",
            Self::RosBag => "rosbag",
            Self::Trajectory => "trajectory",
            Self::Svg => "svg",
            Self::Png => "png",
            Self::Gif => "gif",
            Self::Page => "page",
            Self::Mp4Frames => "mp4-frames",
        }
    }

    fn is_table(self) -> bool {
        matches!(self, Self::Csv | Self::Parquet)
    }

    fn is_animation(self) -> bool {
        matches!(self, Self::Gif | Self::Mp4Frames)
    }

    fn is_picture(self) -> bool {
        matches!(self, Self::Svg | Self::Png)
    }
}

/// Export a recorded run as tables, pictures, animations or recordings for viewers, or the runs of a sweep as pages.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct ExportArgs {
    /// Run folder, or MCAP file; for pages also the folder of a sweep
    #[arg(value_name = "DIR|FILE")]
    recorded: PathBuf,

    /// Output format
    #[arg(long, value_name = "FORM", value_enum)]
    to: ExportFormat,

    /// Output file or folder [default: beside DIR, with its name]
    #[arg(long, value_name = "PATH")]
    out: Option<PathBuf>,

    /// First cycle; svg and png show the state at the start of this cycle
    #[arg(long, value_name = "C")]
    from: Option<Cycle>,

    /// Last cycle [default: the end of the run]
    #[arg(long, value_name = "C")]
    until: Option<Cycle>,

    /// Export every N-th cycle [default: every cycle; of animations, at most 150 frames, of pages
    /// 20,000]; tables always have all events
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    every: Option<Cycle>,

    /// Export only this table (csv and parquet)
    #[arg(long, value_name = "NAME")]
    table: Option<String>,

    /// Frames per second of an animation [default: 15]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=50))]
    fps: Option<u16>,

    /// Longer side of pictures in pixels [default: gif 640, mp4-frames 1280, png 1600]
    #[arg(long, value_name = "PX", value_parser = clap::value_parser!(u16).range(64..=4096))]
    width: Option<u16>,

    /// Width and height of pictures in pixels, with all their words, in place of --width
    #[arg(long, value_name = "WxH")]
    size: Option<PixelSize>,

    /// Side from which pictures show a run in space: top, side, front, or degrees about the vertical
    /// and above the horizon, e.g. -60,30 [default: the one that shows the agents best]
    #[arg(long, value_name = "VIEW", allow_hyphen_values = true)]
    view: Option<PictureView>,

    /// Agents by their numbers, with that of a part where one is meant, e.g. 1,8 or 0/17: in pictures,
    /// those with tracks and names, the others pale [default: as many as can be distinguished]; of a
    /// page, those with percepts, decisions and actions [default: all in --cycles, else none]
    #[arg(long, value_name = "N,N,...", value_delimiter = ',')]
    agents: Vec<AgentNumber>,

    /// Cycles from A to B: svg and png show the state at B with the tracks since A; a page holds the
    /// percepts, decisions and actions in them; of all else, the same as --from A --until B
    #[arg(long, value_name = "A:B")]
    cycles: Option<CycleWindow>,

    /// Runs of a sweep that get a replay: all, outliers, or a number of them, first one of each variant,
    /// then outliers (page) [default: 24]
    #[arg(long, value_name = "WHICH")]
    runs: Option<RunChoice>,

    /// Another recorded run, shown beside it, with their first difference (page)
    #[arg(long, value_name = "DIR|FILE")]
    beside: Option<PathBuf>,

    #[command(flatten)]
    workers: WorkersArg,

    /// Replace an earlier export, if its files are as they were written; files of others in its folder stay
    #[arg(long)]
    replace: bool,
}

/// # Errors
/// When the recorded run or an option is wrong, or the result cannot be stored or differs from
/// the recording.
pub(crate) fn export(args: &ExportArgs, console: Console) -> Result<ExitCode, Failure> {
    if let Some(folder) = find_sweep(&args.recorded)? {
        return gallery::export_sweep(args, &folder, console);
    }
    check_options(args)?;
    let recorded = RecordedRun::open(worlds(), &args.recorded)?;
    let beside = args.beside.as_ref().map(|path| RecordedRun::open(worlds(), path)).transpose()?;
    interrupt::listen()?;
    for warning in
        [Some(&recorded), beside.as_ref()].into_iter().flatten().filter_map(incomplete_warning)
    {
        console.warn(&warning);
    }
    let watcher = ConsoleWatcher::new(console);
    let result = match export_format(args) {
        Some(form) => {
            let request =
                ExportRequest { form, look: picture_look(args), scope: export_scope(args) };
            export::export(&recorded, &request, &watcher).map(Exported::from)
        }
        None => export_page(worlds(), &recorded, &page_request(args, beside.as_ref()), &watcher)
            .map(Exported::from),
    };
    match result {
        Err(Failure::Interrupted) => Ok(ExitCode::Interrupted),
        result => {
            print_result(args.to, &recorded, &result?, console)?;
            Ok(ExitCode::Done)
        }
    }
}

/// What was written, and what a page holds.
struct Exported {
    written: ExportResult,
    page: Option<PageContent>,
}

impl From<ExportResult> for Exported {
    fn from(written: ExportResult) -> Self {
        Self { written, page: None }
    }
}

impl From<PageResult> for Exported {
    fn from(result: PageResult) -> Self {
        let PageResult { written, content } = result;
        Self { written, page: Some(content) }
    }
}

fn page_json(page: &PageContent) -> Value {
    json!({
        "frames": page.frames,
        "every": page.every,
        "inspections": page.inspections,
        "events_left_out": page.events_left_out,
    })
}

/// Returns what the page holds, and what it does not.
fn page_text(page: &PageContent) -> String {
    let frames = group_thousands(page.frames);
    let every = match page.every {
        1 => "one for each cycle".to_string(),
        every => format!("one every {} cycles", group_thousands(every)),
    };
    let inspections = match page.inspections {
        0 => "no inspections: --agents and --cycles choose some".to_string(),
        count => format!("{} inspections", group_thousands(count as u64)),
    };
    let lost = match page.events_left_out {
        0 => String::new(),
        count => format!("  {} events are not in it: too many\n", group_thousands(count)),
    };
    format!("  {frames} frames, {every}; {inspections}\n{lost}")
}

/// Returns what a user has to know of a run that did not reach its end.
fn incomplete_warning(recorded: &RecordedRun) -> Option<String> {
    if recorded.is_complete || recorded.folder.is_none() {
        return None;
    }
    let cycles = group_thousands(recorded.cycles_done);
    Some(if recorded.is_cut_off {
        format!("the flight was cut off: its rows end at cycle {cycles}")
    } else if recorded.is_flight {
        format!(
            "the flight is under way, or was killed: its rows end at cycle {cycles}, or within a second of it"
        )
    } else {
        "the run is not complete: its rows end at the last checkpoint".to_string()
    })
}

/// Returns the format with its options; none for the page, which is no format of the session's.
fn export_format(args: &ExportArgs) -> Option<Format> {
    let animation = AnimationOptions { fps: args.fps, width_px: args.width };
    Some(match args.to {
        ExportFormat::Csv => Format::Csv(args.table.clone()),
        ExportFormat::Parquet => Format::Parquet(args.table.clone()),
        ExportFormat::GeoJson => Format::GeoJson,
        ExportFormat::Lorr => Format::League,
        ExportFormat::Mcap => Format::Mcap,
        ExportFormat::RosBag => Format::RosBag,
        ExportFormat::Trajectory => Format::Trajectory,
        ExportFormat::Svg => Format::Svg,
        ExportFormat::Png => Format::Png { width_px: args.width },
        ExportFormat::Gif => Format::Gif(animation),
        ExportFormat::Mp4Frames => Format::Frames(animation),
        ExportFormat::Page => return None,
    })
}

fn picture_look(args: &ExportArgs) -> PictureLook {
    let window = args.cycles.filter(|_| args.to.is_picture());
    PictureLook {
        agents: args.agents.clone(),
        trails_from: window.map(|window| window.from),
        view: args.view.unwrap_or_default(),
        size_px: args.size.map(|PixelSize(sides)| sides),
    }
}

/// Returns the part of the run, and the place of the export.
fn export_scope(args: &ExportArgs) -> ExportScope<'_> {
    let (from, until) = match args.cycles {
        // A picture has one cycle: that of its state.
        Some(window) if args.to.is_picture() => (Some(window.until), None),
        Some(window) if args.to != ExportFormat::Page => (Some(window.from), Some(window.until)),
        _ => (args.from, args.until),
    };
    ExportScope {
        out: args.out.as_deref(),
        replace: args.replace,
        from,
        until,
        every: args.every,
        workers: args.workers.count(),
    }
}

fn page_request<'a>(args: &'a ExportArgs, beside: Option<&'a RecordedRun>) -> PageRequest<'a> {
    let inspections = InspectionRequest { agents: args.agents.clone(), cycles: args.cycles };
    PageRequest { scope: export_scope(args), inspections, beside }
}

/// Refuses options that have no effect on the chosen format.
fn check_options(args: &ExportArgs) -> Result<(), InputError> {
    if args.runs.is_some() {
        let remedy = "leave it out, or give the folder of a sweep";
        return Err(InputError::new("--runs", "means nothing for a single run", remedy));
    }
    check_format_options(args)
}

/// Refuses options that have no effect on the chosen format, of a run or of the runs of a sweep.
fn check_format_options(args: &ExportArgs) -> Result<(), InputError> {
    let format = args.to;
    let is_seen = format.is_picture() || format.is_animation();
    let is_page = format == ExportFormat::Page;
    let given = [
        ("--until", args.until.is_some(), !format.is_picture()),
        // The viewer begins at tick 0, and has all ticks.
        ("--from", args.from.is_some(), format != ExportFormat::Lorr),
        ("--every", args.every.is_some(), !format.is_picture() && format != ExportFormat::Lorr),
        ("--table", args.table.is_some(), format.is_table()),
        ("--agents", !args.agents.is_empty(), is_seen || is_page),
        ("--cycles", args.cycles.is_some(), format != ExportFormat::Lorr),
        ("--beside", args.beside.is_some(), is_page),
        ("--view", args.view.is_some(), is_seen),
        ("--size", args.size.is_some(), is_seen),
        ("--fps", args.fps.is_some(), format.is_animation()),
        ("--width", args.width.is_some(), format.is_animation() || format == ExportFormat::Png),
    ];
    for (option, is_given, has_meaning) in given {
        if is_given && !has_meaning {
            let cause = format!("means nothing for --to {}", format.name());
            return Err(InputError::new(option, cause, "leave it out"));
        }
    }
    check_pairs(args)
}

/// Refuses options that say the same in two ways, and sizes that no video has.
fn check_pairs(args: &ExportArgs) -> Result<(), InputError> {
    let has_span = args.from.is_some() || args.until.is_some();
    if args.cycles.is_some() && has_span && args.to != ExportFormat::Page {
        let cause = "--from and --until give the cycles, too";
        return Err(InputError::new("--cycles", cause, "leave one of them out"));
    }
    if args.size.is_some() && args.width.is_some() {
        let cause = "--width gives the size, too";
        return Err(InputError::new("--size", cause, "leave one of them out"));
    }
    if let Some(PixelSize(sides)) = args.size
        && args.to == ExportFormat::Mp4Frames
        && sides.iter().any(|side| side % 2 == 1)
    {
        let [width, height] = sides;
        let [even_width, even_height] = sides.map(|side| side & !1);
        let cause = format!("{width}x{height} has an odd side, which no video may have");
        let remedy = format!("give --size {even_width}x{even_height}");
        return Err(InputError::new("--size", cause, remedy));
    }
    Ok(())
}

/// Prints which files were written.
fn print_result(
    format: ExportFormat,
    recorded: &RecordedRun,
    exported: &Exported,
    console: Console,
) -> Result<(), Failure> {
    let Exported { written, page } = exported;
    let ExportResult { paths, is_confirmed, film: animation } = written;
    let shown: Vec<String> = paths.iter().map(display_path).collect();
    let origins = &recorded.origins;
    let mut json =
        json!({ "written": shown, "digest_confirmed": is_confirmed, "origins": origins });
    if let Some(page) = page {
        json["page"] = page_json(page);
    }
    let names = paths.iter().map(|path| format!("{}\n", path.display())).collect::<String>();
    console.print_result_or_short(&json, &names, || {
        let confirmed = if *is_confirmed { "  its end has the recorded digest\n" } else { "" };
        let bytes: u64 =
            paths.iter().filter_map(|path| Some(std::fs::metadata(path).ok()?.len())).sum();
        let size = format!("  {} bytes\n", group_thousands(bytes));
        let size = if paths.iter().all(|path| path.is_file()) { size } else { String::new() };
        let animation = animation.map_or(String::new(), |(pictures, fps)| {
            animation_text(format, pictures, fps, &paths[0])
        });
        let page = page.as_ref().map_or(String::new(), page_text);
        let origins = if recorded.is_flight {
            format!("  {}\n", origins_text(origins))
        } else {
            String::new()
        };
        format!("{names}{size}{page}{confirmed}{origins}{animation}")
    })
}

/// Returns the length of an animation, or the command that joins its frames.
fn animation_text(format: ExportFormat, pictures: usize, fps: u16, path: &Path) -> String {
    if format == ExportFormat::Gif {
        return format!("  {pictures} pictures, {:.1} s\n", pictures as f64 / f64::from(fps));
    }
    let folder = path.display();
    format!(
        "  {pictures} pictures; join them with:\n  ffmpeg -framerate {fps} \
         -i '{folder}/frame-%05d.png' -c:v libx264 -pix_fmt yuv420p '{folder}.mp4'\n"
    )
}
