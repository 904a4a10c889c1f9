//! `sidestep export`: a recorded run in the forms of other programs.

mod pictures;
mod tables;
mod target;

use crate::console::{Console, grouped};
use crate::driver::{Sinks, drive};
use crate::exit::{ExitCode, Failure};
use crate::film::{Ending, McapFilm};
use crate::interrupt;
use crate::plan::WorkersArg;
use crate::rerun::Recorded;
use clap::{Args, ValueEnum};
use serde_json::json;
use sidestep::kernel::Simulation;
use sidestep::kernel::{Cycle, InputError};
use std::path::PathBuf;
use target::Target;

const EXAMPLES: &str = "\
Examples:
  sidestep export runs/office --to csv                     runs/office-csv/, a file per table
  sidestep export runs/office --to parquet --table trajectories
  sidestep export runs/office --to mcap --every 10         runs/office.mcap, for Foxglove
  sidestep export runs/office --to gif --from 1000 --until 2000
  sidestep export runs/office --to png --from 1234         the state at the begin of this cycle
  sidestep export office.mcap --to mp4-frames              pictures, and how ffmpeg joins them

Tables are copied from the run folder. Everything else is computed again from the recorded
scenario; whoever comes to the recorded end confirms the recorded digest there.";

/// The forms.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Form {
    /// Tables as text
    Csv,
    /// Tables, each as one file
    Parquet,
    /// What can be seen, for Foxglove and other viewers
    Mcap,
    /// The picture of the run, or of a moment
    Svg,
    /// The same as pixels
    Png,
    /// A film
    Gif,
    /// A film as numbered PNG files
    #[value(name = "mp4-frames")]
    Mp4Frames,
}

impl Form {
    fn name(self) -> &'static str {
        match self {
            Self::Csv => "csv",
            Self::Parquet => "parquet",
            Self::Mcap => "mcap",
            Self::Svg => "svg",
            Self::Png => "png",
            Self::Gif => "gif",
            Self::Mp4Frames => "mp4-frames",
        }
    }

    fn is_table(self) -> bool {
        matches!(self, Self::Csv | Self::Parquet)
    }

    fn is_film(self) -> bool {
        matches!(self, Self::Gif | Self::Mp4Frames)
    }

    fn is_picture(self) -> bool {
        matches!(self, Self::Svg | Self::Png)
    }
}

/// Write a recorded run as tables, pictures, films or recordings for viewers.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct ExportArgs {
    /// The run folder, or an MCAP file
    #[arg(value_name = "DIR|FILE")]
    recorded: PathBuf,

    /// What to write
    #[arg(long, value_name = "FORM", value_enum)]
    to: Form,

    /// Where to [default: beside DIR, by its name]
    #[arg(long, value_name = "PATH")]
    out: Option<PathBuf>,

    /// Begin at this cycle; of svg and png, show the state at its begin
    #[arg(long, value_name = "C")]
    from: Option<Cycle>,

    /// End with this cycle [default: the last]
    #[arg(long, value_name = "C")]
    until: Option<Cycle>,

    /// Only cycles that are multiples of this; of films: so that they have 150 pictures at most,
    /// else each; events are never left out of tables
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    every: Option<Cycle>,

    /// Only this table, of csv and parquet
    #[arg(long, value_name = "NAME")]
    table: Option<String>,

    /// Pictures of a film per second [default: 15]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=50))]
    fps: Option<u16>,

    /// Longer side of pictures in pixels [default: 640 of gif, 1280 of mp4-frames, 1600 of png]
    #[arg(long, value_name = "PX", value_parser = clap::value_parser!(u16).range(64..=4096))]
    width: Option<u16>,

    #[command(flatten)]
    workers: WorkersArg,

    /// Replace what was exported before
    #[arg(long)]
    replace: bool,
}

/// Runs the command.
///
/// # Errors
/// When the recorded run or an option is wrong, or the result cannot be stored or differs from
/// what was recorded.
pub(crate) fn export(args: &ExportArgs, console: Console) -> Result<ExitCode, Failure> {
    check_options(args)?;
    let recorded = Recorded::open(&args.recorded)?;
    let span = Span::of(args, &recorded)?;
    interrupt::listen()?;
    match args.to {
        Form::Csv | Form::Parquet => tables::export(args, &recorded, span, console),
        Form::Mcap => export_mcap(args, &recorded, span, console),
        Form::Svg | Form::Png => pictures::export_picture(args, &recorded, span, console),
        Form::Gif | Form::Mp4Frames => pictures::export_film(args, &recorded, span, console),
    }
}

/// Refuses options that would do nothing.
fn check_options(args: &ExportArgs) -> Result<(), InputError> {
    let form = args.to;
    let given = [
        ("--until", args.until.is_some(), !form.is_picture()),
        ("--every", args.every.is_some(), !form.is_picture()),
        ("--table", args.table.is_some(), form.is_table()),
        ("--fps", args.fps.is_some(), form.is_film()),
        ("--width", args.width.is_some(), form.is_film() || form == Form::Png),
    ];
    match given.iter().find(|(_, is_given, has_meaning)| *is_given && !has_meaning) {
        None => Ok(()),
        Some((option, ..)) => {
            let cause = format!("means nothing for --to {}", form.name());
            Err(InputError::new(*option, cause, "leave it out"))
        }
    }
}

/// The cycles that are asked for, both ends included.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Span {
    from: Cycle,
    until: Cycle,
}

impl Span {
    fn of(args: &ExportArgs, recorded: &Recorded) -> Result<Self, InputError> {
        let done = recorded.cycles_done;
        let (from, until) = (args.from.unwrap_or(0), args.until.unwrap_or(done));
        let wrong = |option: &str, cycle: Cycle, cause: String, remedy: String| {
            Err(InputError::new(format!("{option} {cycle}"), cause, remedy))
        };
        if from > done {
            let cause = format!("{done} cycles are recorded");
            return wrong("--from", from, cause, format!("give 0 to {done}"));
        }
        if until < from || until > done {
            let cause = format!("the part begins at cycle {from}, {done} cycles are recorded");
            return wrong("--until", until, cause, format!("give {from} to {done}"));
        }
        Ok(Self { from, until })
    }
}

/// The run at the begin of a span; `None` after Ctrl-C.
fn run_up_to(
    recorded: &Recorded,
    cycle: Cycle,
    workers: WorkersArg,
    console: Console,
) -> Result<Option<Box<dyn Simulation>>, Failure> {
    let mut run = recorded.start_near(cycle, workers.count())?;
    drive(run.as_mut(), cycle, Sinks::default(), console)?;
    Ok((run.cycle() == cycle || run.is_over()).then_some(run))
}

fn export_mcap(
    args: &ExportArgs,
    recorded: &Recorded,
    span: Span,
    console: Console,
) -> Result<ExitCode, Failure> {
    let target = Target::file(args, ".mcap")?;
    let resolved = recorded.resolved()?;
    let Some(mut run) = run_up_to(recorded, span.from, args.workers, console)? else {
        return Ok(ExitCode::Interrupted);
    };
    let mut film = McapFilm::begin(target.path(), args.every.unwrap_or(1), resolved, run.as_mut())?;
    let sinks = Sinks { film: Some(&mut film), ..Sinks::default() };
    drive(run.as_mut(), span.until, sinks, console)?;
    if run.cycle() < span.until && !run.is_over() {
        return Ok(ExitCode::Interrupted);
    }
    let confirmed = recorded.confirm(run.as_ref())?;
    let is_whole = span.from == 0 && confirmed && recorded.is_complete;
    let ending = if is_whole { Ending::Complete } else { Ending::Extract };
    let path = film.finish(run.as_ref(), ending)?;
    report(console, &[path], confirmed, None);
    Ok(ExitCode::Done)
}

/// Says what was written; `more` is for people.
fn report(console: Console, written: &[PathBuf], confirmed: bool, more: Option<String>) {
    let json = json!({ "written": written, "digest_confirmed": confirmed });
    let paths = written.iter().map(|path| format!("{}\n", path.display())).collect::<String>();
    let short = || paths.clone();
    console.result_or_short(&json, short, || {
        let confirmed = if confirmed { "  its end has the recorded digest\n" } else { "" };
        let bytes: u64 =
            written.iter().filter_map(|path| Some(std::fs::metadata(path).ok()?.len())).sum();
        let size = format!("  {} bytes\n", grouped(bytes));
        let more = more.map_or(String::new(), |more| format!("  {more}\n"));
        let size = if written.iter().all(|path| path.is_file()) { size } else { String::new() };
        format!("{paths}{size}{confirmed}{more}")
    });
}
