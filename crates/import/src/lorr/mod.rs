//! Problems of the League of Robot Runners of 2026: a JSON file that names a map, a list of starts and a list of tasks.
//!
//! The files count rows from the top; all rows here count from the bottom. All robots face east at the start.

mod keys;
mod lists;
#[cfg(test)]
mod tests;

use crate::named_file::{allowed_folder, folder_of, is_inside};
use crate::report::{ImportReport, Treatment};
use crate::{ImportedMap, movingai};
use keys::Keys;
use lists::Lists;
use sidestep_kernel::InputError;
use sidestep_map::{Cell, GridMap};
use sidestep_scenario::file::{read_start, read_text};
use std::path::{Path, PathBuf};

/// The most bytes of a problem or a list; the largest list of the start kit has 0.4 MB.
const MAX_BYTES: u64 = 1 << 28;

/// The version that problems and lists of 2026 name.
const VERSION: &str = "2026 LoRR";

/// A problem with its map, starts and tasks.
#[derive(Debug, Clone, PartialEq)]
pub struct Problem {
    /// What the JSON file says.
    pub settings: Settings,
    /// The map, with boxes of 1 m.
    pub map: GridMap,
    /// The start of each robot: column from the west and row from the south. All face east.
    pub starts: Vec<(u32, u32)>,
    /// The places that each task visits, in order.
    pub tasks: Vec<Vec<(u32, u32)>>,
    /// What became of the files.
    pub report: ImportReport,
}

/// The content of the JSON file of a problem.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// Name of the map file, from the folder of the problem.
    pub map_file: String,
    /// Name of the list of starts.
    pub agent_file: String,
    /// Name of the list of tasks.
    pub task_file: String,
    /// Number of robots.
    pub team_size: usize,
    /// Number of tasks that are known and not finished at any time, for each robot.
    pub revealed_per_robot: f64,
    /// Ticks that a step forward or a turn takes.
    pub ticks_per_action: u32,
    /// Side of a robot in boxes.
    pub robot_size: f64,
    /// When robots are delayed, and for how long.
    pub delays: Delays,
}

/// When robots are delayed, and for how long.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Delays {
    /// The seed of the file.
    pub seed: u64,
    /// The chance of a robot in a tick.
    pub chance: f64,
    /// How the robots of a tick are drawn.
    pub events: EventModel,
    /// How long a delay lasts.
    pub duration: DurationModel,
    /// The fewest ticks of a delay.
    pub min_ticks: u32,
    /// The most ticks of a delay.
    pub max_ticks: u32,
}

/// How the robots are drawn that are delayed in a tick.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum EventModel {
    /// Each robot that is not delayed has the same chance, on its own.
    Bernoulli,
    /// Their number is drawn from a Poisson distribution, then who they are.
    Poisson,
}

/// How the ticks of a delay are drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum DurationModel {
    /// Each number from the fewest to the most is as likely.
    Uniform,
    /// A normal distribution, cut off at the fewest and the most.
    Gaussian {
        /// The mean above the fewest, in parts of the range.
        mean_ratio: f64,
        /// The standard deviation, in parts of the range.
        deviation_ratio: f64,
    },
}

/// Keys of which a problem has at least one near its start, however it is cut off.
const TELLING_KEYS: [&str; 2] = ["\"mapFile\"", "\"agentFile\""];
/// Number of bytes by which a problem is recognized.
const START_BYTES: u64 = 4096;

/// Returns whether a file is a problem, by its content.
///
/// # Errors
/// When it cannot be read.
pub fn is_problem(path: &Path) -> Result<bool, InputError> {
    if path.is_dir() {
        return Ok(false);
    }
    Ok(begins_as_problem(&String::from_utf8_lossy(&read_start(path, START_BYTES)?)))
}

/// Returns whether a text begins as a problem does.
pub(crate) fn begins_as_problem(text: &str) -> bool {
    let is_object = text.trim_start_matches('\u{feff}').trim_start().starts_with('{');
    is_object && TELLING_KEYS.iter().any(|key| text.contains(key))
}

/// Reads a problem with the files that it names, plain or with gzip.
///
/// # Errors
/// When a file cannot be read, lies elsewhere, is cut off or has a value that is none; when a start or a place of a task
/// is outside the map or in a wall, or no robot can come to it; when there are fewer starts than robots.
pub fn load(path: &Path) -> Result<Problem, InputError> {
    let place = path.display().to_string();
    let text = read_text(path, MAX_BYTES)?;
    let keys = Keys::new(&place, &text)?;
    let mut report = ImportReport::new("problem of the League of Robot Runners (2026)");
    let settings = read_settings(&keys, &mut report)?;
    let map_path = named_file(&keys, path, "mapFile", &settings.map_file)?;
    let agent_path = named_file(&keys, path, "agentFile", &settings.agent_file)?;
    let task_path = named_file(&keys, path, "taskFile", &settings.task_file)?;
    let ImportedMap { map, report: map_report } = movingai::load_map(&map_path, 1.0)?;
    report.findings.extend(map_report.findings);
    let lists = Lists::new(&map);
    let agent_text = read_text(&agent_path, MAX_BYTES)?;
    let mut starts = lists.parse_starts(&agent_path.display().to_string(), &agent_text)?;
    if starts.len() < settings.team_size {
        let cause = format!(
            "teamSize is {}, and {} has {} starts",
            settings.team_size,
            agent_path.display(),
            starts.len()
        );
        let remedy = format!("set teamSize to {} or less", starts.len());
        return Err(keys.error("teamSize", cause, remedy));
    }
    if starts.len() > settings.team_size {
        let rule = format!("starts beyond teamSize ({})", starts.len() - settings.team_size);
        report.record(Treatment::NotUsed, rule, "", "set teamSize to the number of starts");
    }
    starts.truncate(settings.team_size);
    let task_text = read_text(&task_path, MAX_BYTES)?;
    let tasks = lists.parse_tasks(&task_path.display().to_string(), &task_text, &starts)?;
    add_counts(&mut report, &map, &starts, &tasks);
    Ok(Problem { settings, map, starts, tasks, report })
}

/// Reads the text of the JSON file of a problem without the files that it names; errors name `place`.
///
/// # Errors
/// When it is cut off, a key is absent, or a value is none of its key.
pub fn parse_settings(place: &str, text: &str) -> Result<Settings, InputError> {
    read_settings(&Keys::new(place, text)?, &mut ImportReport::default())
}

/// Reads the text of a list of starts, one in each line, for a map; errors name `place`.
///
/// # Errors
/// When the list is cut off, or a start is outside the map, in a wall, or used twice.
pub fn parse_starts(place: &str, text: &str, map: &GridMap) -> Result<Vec<(u32, u32)>, InputError> {
    Lists::new(map).parse_starts(place, text)
}

/// Reads the text of a list of tasks, one in each line, for a map with robots at some starts; errors name `place`.
///
/// # Errors
/// When the list is cut off, or a place is outside the map or in a wall, or no robot can come to it.
pub fn parse_tasks(
    place: &str,
    text: &str,
    map: &GridMap,
    starts: &[(u32, u32)],
) -> Result<Vec<Vec<(u32, u32)>>, InputError> {
    Lists::new(map).parse_tasks(place, text, starts)
}

/// Reads a list of tasks, plain or with gzip, for a map on which robots may start anywhere.
///
/// # Errors
/// As [`parse_tasks`], and when the file cannot be read.
pub fn load_tasks(path: &Path, map: &GridMap) -> Result<Vec<Vec<(u32, u32)>>, InputError> {
    let text = read_text(path, MAX_BYTES)?;
    Lists::new(map).parse_tasks_from_anywhere(&path.display().to_string(), &text)
}

fn add_counts(
    report: &mut ImportReport,
    map: &GridMap,
    starts: &[(u32, u32)],
    tasks: &[Vec<(u32, u32)>],
) {
    report.add_fact("boxes", format!("{} x {}", map.width(), map.height()));
    report.add_kept("free boxes", map.count(Cell::Free));
    report.add_kept("robots", starts.len());
    report.add_kept("tasks", tasks.len());
    report.add_kept("errands", tasks.iter().map(Vec::len).sum());
}

/// Returns where a file lies that the problem names.
fn named_file(
    keys: &Keys<'_>,
    problem: &Path,
    key: &'static str,
    name: &str,
) -> Result<PathBuf, InputError> {
    let path = folder_of(problem).join(name);
    if path.is_file() && is_inside(&path, &allowed_folder(problem)) {
        return Ok(path);
    }
    let cause = format!("there is no file `{}` beside the problem", name.escape_debug());
    let remedy = "name a file in the folder of the problem or in one beside it";
    Err(keys.error(key, cause, remedy))
}

/// Keys of problems that are read here.
const PROBLEM_KEYS: [&str; 9] = [
    "mapFile",
    "agentFile",
    "taskFile",
    "teamSize",
    "numTasksReveal",
    "version",
    "agentCounter",
    "agentSize",
    "delayConfig",
];

/// The most robots of a team: as many as maps of the League hold.
const MAX_TEAM: u64 = 1 << 20;
/// The most ticks of an action or a delay: more is no motion.
const MAX_TICKS: u64 = 1 << 20;

fn read_settings(keys: &Keys<'_>, report: &mut ImportReport) -> Result<Settings, InputError> {
    keys.record_others(&PROBLEM_KEYS, report);
    match keys.optional_text("version")? {
        Some(version) if version != VERSION => {
            let cause = format!("version is `{}`", version.escape_debug());
            return Err(keys.error("version", cause, format!("give a problem of \"{VERSION}\"")));
        }
        Some(_) => (),
        None => {
            let remedy = "write \"version\": \"2026 LoRR\"";
            report.record(Treatment::Guessed, "the version is that of 2026", "", remedy);
        }
    }
    Ok(Settings {
        map_file: keys.text("mapFile")?,
        agent_file: keys.text("agentFile")?,
        task_file: keys.text("taskFile")?,
        team_size: keys.whole("teamSize", 1, MAX_TEAM)? as usize,
        revealed_per_robot: keys.number_or(
            "numTasksReveal",
            [f64::MIN_POSITIVE, 1e6],
            1.0,
            report,
        )?,
        ticks_per_action: keys.whole_or("agentCounter", [1, MAX_TICKS], 1, report)? as u32,
        robot_size: keys.number_or("agentSize", [f64::MIN_POSITIVE, 1.0], 1.0, report)?,
        delays: read_delays(keys, report)?,
    })
}

/// Keys of delays that are read here.
const DELAY_KEYS: [&str; 8] = [
    "seed",
    "minDelay",
    "maxDelay",
    "eventModel",
    "pDelay",
    "durationModel",
    "gaussMeanRatio",
    "gaussStdRatio",
];

/// Without the key, no robot is ever delayed.
const NO_DELAYS: Delays = Delays {
    seed: 0,
    chance: 0.0,
    events: EventModel::Bernoulli,
    duration: DurationModel::Uniform,
    min_ticks: 1,
    max_ticks: 1,
};

fn read_delays(problem: &Keys<'_>, report: &mut ImportReport) -> Result<Delays, InputError> {
    let Some(keys) = problem.object("delayConfig")? else {
        let remedy = "give a delayConfig";
        report.record(
            Treatment::Guessed,
            "no robot is delayed: there is no delayConfig",
            "",
            remedy,
        );
        return Ok(NO_DELAYS);
    };
    keys.record_others(&DELAY_KEYS, report);
    let min_ticks = keys.whole("minDelay", 1, MAX_TICKS)? as u32;
    let max_ticks = keys.whole("maxDelay", 1, MAX_TICKS)? as u32;
    if min_ticks > max_ticks {
        let cause = format!("minDelay is {min_ticks}, and maxDelay is {max_ticks}");
        return Err(keys.error("minDelay", cause, "set minDelay to maxDelay or less"));
    }
    Ok(Delays {
        seed: keys.whole_or("seed", [0, u64::MAX], 0, report)?,
        chance: keys.number("pDelay", 0.0, 1.0)?,
        events: event_model(&keys)?,
        duration: duration_model(&keys, report)?,
        min_ticks,
        max_ticks,
    })
}

fn event_model(keys: &Keys<'_>) -> Result<EventModel, InputError> {
    match &*keys.text("eventModel")? {
        "bernoulli" => Ok(EventModel::Bernoulli),
        "poisson" => Ok(EventModel::Poisson),
        other => {
            let cause = format!("eventModel is `{}`", other.escape_debug());
            Err(keys.error("eventModel", cause, "write \"bernoulli\" or \"poisson\""))
        }
    }
}

fn duration_model(keys: &Keys<'_>, report: &mut ImportReport) -> Result<DurationModel, InputError> {
    match &*keys.text("durationModel")? {
        "uniform" => Ok(DurationModel::Uniform),
        "gaussian" => Ok(DurationModel::Gaussian {
            mean_ratio: keys.number_or("gaussMeanRatio", [0.0, 1.0], 0.5, report)?,
            deviation_ratio: keys.number_or("gaussStdRatio", [0.0, 1e3], 0.25, report)?,
        }),
        other => {
            let cause = format!("durationModel is `{}`", other.escape_debug());
            Err(keys.error("durationModel", cause, "write \"uniform\" or \"gaussian\""))
        }
    }
}
