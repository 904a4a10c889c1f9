//! Problems of the League of Robot Runners, read as scenarios: a cycle is a tick.

use serde_json::json;
use sidestep_import::lorr::{self, Delays, DurationModel, EventModel, Problem};
use sidestep_import::report::Finding;
use sidestep_import::{ImportReport, Treatment};
use sidestep_kernel::InputError;
use sidestep_kernel::math::erfc;
use sidestep_map::{Cell, GridMap};
use sidestep_scenario::{FORMAT, ImportedScenario};
use std::f64::consts::SQRT_2;
use std::fmt::Write;
use std::path::Path;

/// Cycles of a run: the file says none, and a run of the League has at least as many.
const CYCLES: u64 = 1500;

/// Returns the scenario of a problem, and a report on the rest of it; `None` for other files.
///
/// # Errors
/// When the problem cannot be read, or something in it is wrong.
pub(super) fn import_file(file: &Path) -> Result<Option<ImportedScenario>, InputError> {
    if !lorr::is_problem(file)? {
        return Ok(None);
    }
    let mut problem = lorr::load(file)?;
    let mut report = std::mem::take(&mut problem.report);
    record_choices(&problem, &mut report);
    let name = file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let json = json!({ "import_report": report });
    let mut lines = report.lines();
    lines.extend(report.findings.iter().map(Finding::line));
    Ok(Some(ImportedScenario { scenario: Ok(scenario(&name, &problem)), report, json, lines }))
}

/// Records what the file does not say, and what of it has no effect.
fn record_choices(problem: &Problem, report: &mut ImportReport) {
    let rule = format!("a run has {CYCLES} cycles, one for each tick");
    report.record(Treatment::Guessed, rule, "", "give --cycles");
    let rule = "a PIBT planner leads the robots, and gives them the nearest tasks";
    let remedy = "give --set robots.tasks.policy=optimal, or another policy";
    report.record(Treatment::Guessed, rule, "", remedy);
    if problem.settings.robot_size < 1.0 {
        let rule = format!("agentSize {}: robots fill their boxes", problem.settings.robot_size);
        report.record(Treatment::NotUsed, rule, "", "");
    }
}

fn scenario(name: &str, problem: &Problem) -> String {
    let settings = &problem.settings;
    let delays = delay_keys(&settings.delays);
    let effector = if delays.is_some() { "effector = \"late\"\n" } else { "" };
    let delays = delays.map_or(String::new(), |keys| {
        format!("[effectors.late]\nforward = [{{ p = 1.0, path = \"F\" }}]\n[effectors.late.delays]\n{keys}")
    });
    format!(
        "format = {format}\nworld = \"robots\"\nname = {name:?}\nseed = {seed}\ncycles = {CYCLES}\n\
         description = \"A problem of the League of Robot Runners.\"\n\
         # Whoever is led by a planner, and not late, does what is planned.\n\
         conflict_policy = \"simultaneous\"\nregime = \"effectors\"\n\n\
         [map]\nbox_size_m = {box_size_m:?}\nascii = \"\"\"\n{map}\"\"\"\n\n\
         [robots]\nname = \"team\"\naction_cycles = {action_cycles}\n{effector}\
         planner = {{ method = \"pibt\" }}\n\
         # Column and row from the south-west, and heading: all face east.\nat = {starts}\n\
         [robots.tasks]\nreveal = {reveal:?}\nlist = {tasks}\n\n{delays}",
        format = FORMAT,
        // Numbers of a scenario have 63 bits.
        seed = settings.delays.seed & i64::MAX as u64,
        box_size_m = problem.map.box_size_m,
        map = map_art(&problem.map),
        action_cycles = settings.ticks_per_action,
        starts = place_list(&problem.starts, ", 0"),
        reveal = settings.revealed_per_robot,
        tasks = task_list(&problem.tasks),
    )
}

/// Returns the map in characters, the northern row first.
fn map_art(map: &GridMap) -> String {
    let mut art = String::with_capacity(map.cells().len() + map.height() as usize);
    for row in (0..map.height()).rev() {
        for col in 0..map.width() {
            art.push(match map.cell(col, row) {
                Cell::Free => '.',
                Cell::Wall => '#',
                Cell::Unknown => '?',
            });
        }
        art.push('\n');
    }
    art
}

/// Returns places as a list, each with `more` behind its column and row.
fn place_list(places: &[(u32, u32)], more: &str) -> String {
    let places: Vec<String> =
        places.iter().map(|(col, row)| format!("[{col}, {row}{more}]")).collect();
    format!("[{}]", places.join(", "))
}

/// Returns the errands of all tasks, one task in each line.
fn task_list(tasks: &[Vec<(u32, u32)>]) -> String {
    let mut text = String::from("[\n");
    for task in tasks {
        // Text takes any number of characters.
        let _ = writeln!(text, "  {},", place_list(task, ""));
    }
    text + "]"
}

/// Returns the keys of the delays; none where there are no delays.
fn delay_keys(delays: &Delays) -> Option<String> {
    let Delays { chance, events, duration, min_ticks, max_ticks, seed: _ } = *delays;
    let per = match events {
        EventModel::Bernoulli => "cycle",
        EventModel::Poisson => "team",
    };
    let lengths = match duration {
        DurationModel::Uniform => format!("min = {min_ticks}\nmax = {max_ticks}\n"),
        DurationModel::Gaussian { mean_ratio, deviation_ratio } => {
            let range = f64::from(max_ticks - min_ticks);
            let mean = f64::from(min_ticks) + mean_ratio * range;
            rounded_normal(min_ticks, max_ticks, mean, deviation_ratio * range)
        }
    };
    (chance > 0.0).then(|| format!("p = {chance:?}\nper = \"{per}\"\n{lengths}"))
}

/// Returns the lengths of delays that are drawn from a normal distribution, rounded, and moved to the fewest or the
/// most where they are outside: as the League does.
fn rounded_normal(min: u32, max: u32, mean: f64, sd: f64) -> String {
    if sd <= 0.0 || min == max {
        let length = ((mean + 0.5) as u32).clamp(min, max);
        return format!("min = {length}\nmax = {length}\n");
    }
    let below = |ticks: f64| 0.5 * erfc((mean - ticks) / (sd * SQRT_2));
    let mut rows = Vec::new();
    for cycles in min..=max {
        let low = if cycles == min { 0.0 } else { below(f64::from(cycles) - 0.5) };
        let high = if cycles == max { 1.0 } else { below(f64::from(cycles) + 0.5) };
        rows.push(format!("  {{ cycles = {cycles}, p = {:?} }},\n", high - low));
    }
    format!("durations = [\n{}]\n", rows.concat())
}

#[cfg(test)]
mod tests;
