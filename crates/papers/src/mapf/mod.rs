//! A study of our own, in the form of a reproduction: does the order of methods of multi-agent path finding on perfect robots
//! hold on robots whose wheels err as those of real ones, and where does deciding alone beat a plan?
//!
//! ```text
//! mod.rs      maps, methods, results, report
//! claims.rs   the questions as claims, and our verdicts
//! ```

mod claims;

use crate::case_results::{
    CaseResults, CaseRun, CaseRuns, Columns, Format, Summary, Value, bars, column, figure,
};
use crate::claims::ReportParts;
use crate::study::{Progress, Study, setting_number, sub_progress};
use crate::trial_file::TrialFile;
use serde::Serialize;
use sidestep::experiment::sweep::PRIVILEGE_MARK;
use sidestep::kernel::InputError;
use sidestep::kernel::workers::available_workers;
use sidestep_document::claim::{Claim, verdict_summary};
use sidestep_document::{Document, Figure, FigureKind, Table};

/// The amount of work to run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MapfConfig {
    /// Runs of each case, by seed from 1.
    pub seeds: usize,
    /// Cycles of each run.
    pub cycles: u64,
    /// Numbers of robots, each of them a case.
    pub robots: Vec<usize>,
    /// Number of runs at once; only measured times depend on it.
    pub workers: usize,
    /// Whether this is a rehearsal.
    pub quick: bool,
}

impl Default for MapfConfig {
    /// About 20 minutes on two cores, most of them for LaCAM*.
    fn default() -> Self {
        let workers = available_workers();
        Self { seeds: 10, cycles: 800, robots: vec![20, 60], workers, quick: false }
    }
}

impl MapfConfig {
    /// Returns a rehearsal of seconds: everything is run, and nothing is measured well.
    pub fn quick() -> Self {
        Self { seeds: 2, cycles: 120, robots: vec![20], quick: true, ..Self::default() }
    }
}

/// A map of the study.
struct Map {
    name: &'static str,
    scenario: &'static str,
}

const MAPS: [Map; 5] = [
    Map { name: "random", scenario: include_str!("../../scenarios/mapf/random.toml") },
    Map { name: "room", scenario: include_str!("../../scenarios/mapf/room.toml") },
    Map { name: "maze", scenario: include_str!("../../scenarios/mapf/maze.toml") },
    Map { name: "warehouse", scenario: include_str!("../../scenarios/mapf/warehouse.toml") },
    Map { name: "office", scenario: include_str!("../../scenarios/mapf/office.toml") },
];

const SWEEP: &str = include_str!("../../scenarios/mapf/methods.sweep.toml");
const ROBOTS: &str = "robots.count";
const WHEELS: &str = "robots.effector";

/// The wheels of the sweep, those without errors first.
const ALL_WHEELS: [&str; 4] = ["perfect", "late", "nomad", "mrclam"];
/// Wheels that slip.
const SLIPPING_WHEELS: [&str; 2] = ["nomad", "mrclam"];

/// The methods of the sweep, by their names here.
const METHODS: [&str; 8] = [
    ALONE,
    ALONE_WITH_ERRORS,
    PIBT,
    PIBT_BY_REPORTS,
    "lacam, adg",
    "lacam, replan",
    "lacam, blind",
    "prioritized, adg",
];
const ALONE: &str = "alone";
const ALONE_WITH_ERRORS: &str = "alone, sensors err";
const PIBT: &str = "pibt";
const PIBT_BY_REPORTS: &str = "pibt, reports";

/// The name of throughput in results by seed.
const THROUGHPUT: &str = "trips_in_1000_robot_cycles";

const COLUMNS: Columns = Columns {
    case: &[
        column("robots", "robots", Summary::Setting(ROBOTS)),
        column("wheels", "wheels", Summary::Setting(WHEELS)),
        column("method", "method", Summary::Computed(method)),
        column("privileged", "privileged", Summary::Computed(privileged)),
    ],
    results: &[
        column("throughput", "trips in 1,000 robot-cycles", Summary::Computed(mean_throughput)),
        column("contacts_per_action", "contacts per action", Summary::Mean("contacts_per_action")),
        column("waiting_share", "share of turns waited", Summary::Mean("waiting_share")),
        column("gridlocks", "runs with a gridlock", Summary::Share("gridlocks")),
        column("off_plan", "times off the plan", Summary::Mean("off_plan")),
        column("plans", "plans", Summary::Mean("plans")),
        column("plan_failures", "without a plan", Summary::Mean("plan_failures")),
        column("plan_cost_gap", "above the bound", Summary::Mean("plan_cost_gap")),
        column("plan_ms", "ms per plan", Summary::Computed(plan_ms))
            .with_format(Format::Decimals(2)),
        column("by_seed", "", Summary::Computed(by_seed)),
    ],
};

/// Returns the method of a case, by the name of its variant.
fn method(case: &CaseRuns<'_>) -> Value {
    Value::Word(case.variant().name.clone().expect("each method of the sweep has a name"))
}

/// Returns whether somebody in a case knows what no robot could.
fn privileged(case: &CaseRuns<'_>) -> Value {
    let is_privileged = case.variant().privilege.is_some();
    Value::Word(if is_privileged { "yes" } else { "no" }.into())
}

/// Returns the trips there and back of a run in 1,000 robot-cycles.
fn throughput(case: &CaseRuns<'_>, run: &CaseRun<'_>) -> f64 {
    let robot_cycles = case.setting_number(ROBOTS) * run.number_or_zero("cycles_run");
    1000.0 * run.number_or_zero("trips") / robot_cycles
}

fn mean_throughput(case: &CaseRuns<'_>) -> Value {
    case.mean_of(|run| throughput(case, run))
}

/// Returns the processor time of a search, on average; none of robots that decide alone.
fn plan_ms(case: &CaseRuns<'_>) -> Value {
    let sum = |metric| case.iter_runs().map(|run| run.number_or_zero(metric)).sum::<f64>();
    let plans = sum("plans");
    Value::Maybe((plans > 0.0).then(|| 1000.0 * sum("plan_cpu_s") / plans))
}

/// Returns the numbers of each run that claims pair by seed.
fn by_seed(case: &CaseRuns<'_>) -> Value {
    Value::BySeed(case.iter_runs().map(|run| vec![(THROUGHPUT, throughput(case, &run))]).collect())
}

/// The results of a map.
#[derive(Debug, Clone, PartialEq, Serialize)]
struct MapResults {
    map: &'static str,
    /// In the order of the sweep's variants.
    #[serde(rename = "cells")]
    cases: Vec<CaseResults>,
}

/// All results of the study.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MapfReport {
    /// The plan that was run.
    pub plan: MapfConfig,
    /// Version of the program that made the report.
    pub program_version: String,
    maps: Vec<MapResults>,
    /// The questions and our verdicts.
    pub claims: Vec<Claim>,
}

fn study(map: &Map, plan: &MapfConfig) -> Result<Study, InputError> {
    let study = Study::from_file(SWEEP, map.scenario)?.with_size(plan.seeds, Some(plan.cycles));
    Ok(study.filtered(|v| plan.robots.contains(&(setting_number(v, ROBOTS) as usize))))
}

/// Runs the study, except for trials that are kept.
///
/// `progress` is called with the current map and the finished share of the whole.
///
/// # Errors
/// When the plan asks for an impossible scenario.
pub fn run(
    plan: &MapfConfig,
    kept: &TrialFile,
    progress: &mut Progress<'_>,
) -> Result<MapfReport, InputError> {
    let mut maps = Vec::with_capacity(MAPS.len());
    let part = 1.0 / MAPS.len() as f64;
    for (number, map) in MAPS.iter().enumerate() {
        let from = number as f64 * part;
        let progress = &mut sub_progress(progress, from, from + part);
        let results = study(map, plan)?.run(plan.workers, map.name, kept, progress)?;
        maps.push(MapResults { map: map.name, cases: COLUMNS.cases(&results) });
    }
    Ok(MapfReport {
        plan: plan.clone(),
        program_version: env!("CARGO_PKG_VERSION").into(),
        claims: claims::judge(&maps),
        maps,
    })
}

impl MapResults {
    /// Returns the case of some robots, wheels and a method.
    fn case(&self, robots: u64, wheels: &str, method: &str) -> Option<&CaseResults> {
        self.cases.iter().find(|case| {
            case.count("robots") == robots
                && case.has_text("wheels", wheels)
                && case.has_text("method", method)
        })
    }

    /// Returns the numbers of robots, the fewest first.
    fn robots(&self) -> Vec<u64> {
        let mut numbers: Vec<u64> = self.cases.iter().map(|case| case.count("robots")).collect();
        numbers.sort_unstable();
        numbers.dedup();
        numbers
    }

    fn table(&self) -> Table {
        let note = "Sensors are right but for `alone, sensors err`. Privileged: a planner knows the true places of all \
                    robots at any time, so it is a bound, and no equal of robots that decide alone.";
        COLUMNS.table(&format!("Map {}", self.map), note, &self.cases)
    }

    /// Throughput of each method by wheels.
    fn figure(&self, robots: u64) -> Figure {
        let mut series = Vec::with_capacity(METHODS.len());
        for method in METHODS {
            let cases: Vec<&CaseResults> =
                ALL_WHEELS.iter().filter_map(|wheels| self.case(robots, wheels, method)).collect();
            let is_privileged = cases.iter().any(|case| case.has_text("privileged", "yes"));
            let mark = if is_privileged { PRIVILEGE_MARK } else { "" };
            series.push(bars(format!("{method}{mark}"), cases, "throughput"));
        }
        let categories = ALL_WHEELS.map(String::from).to_vec();
        let labels = ["wheels", "trips in 1,000 robot-cycles"];
        let title = format!("Throughput on map {}, {robots} robots", self.map);
        let figure =
            Figure { kind: FigureKind::Bars { categories }, ..figure(&title, labels, series) };
        let figure = figure.with_interval_note();
        let note = format!(
            "{} * marks privileged methods: the planner knows all true places.",
            figure.note
        );
        Figure { note, ..figure }
    }
}

impl MapfReport {
    /// Returns the report, the claims first.
    pub fn document(&self) -> Document {
        let plan = &self.plan;
        let lead = format!(
            "{} No paper made these claims: they are questions of ours, on maps of ours. Version {}; seeds 1 to {}, {} \
             cycles, {} workers.",
            verdict_summary(&self.claims),
            self.program_version,
            plan.seeds,
            plan.cycles,
            plan.workers,
        );
        let mut figures = Vec::new();
        for map in &self.maps {
            figures.extend(map.robots().into_iter().map(|robots| map.figure(robots)));
        }
        let tables = self.maps.iter().map(MapResults::table).collect();
        let experiments = claims::CLAIMS.experiments([(figures, tables)]);
        let quick = if plan.quick { " --quick" } else { "" };
        let command = format!("sidestep reproduce mapf{quick} --seeds {} --out DIR", plan.seeds);
        let parts = ReportParts { claims: &self.claims, pictures: Vec::new(), experiments };
        claims::CLAIMS.document(lead, plan.quick, parts, command)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sidestep_document::document::Block;

    #[test]
    fn a_rehearsal_runs_every_method_on_every_map_and_judges_every_claim() {
        let short = MapfConfig { seeds: 1, cycles: 40, ..MapfConfig::quick() };
        let report = run(&short, &TrialFile::none(), &mut |_, _| ()).expect("a valid plan");
        assert_eq!(report.maps.len(), 5);
        for map in &report.maps {
            for wheels in ALL_WHEELS {
                for method in METHODS {
                    let case = map.case(20, wheels, method);
                    let case = case.unwrap_or_else(|| panic!("{}, {wheels}, {method}", map.map));
                    assert_eq!(case.number("plans") > 0.0, !method.starts_with(ALONE));
                }
            }
        }
        assert_eq!(report.claims.len(), 8);
        let document = report.document();
        assert!(document.blocks.contains(&Block::Claims(report.claims.clone())));
        let figures = document.blocks.iter().filter(|block| matches!(block, Block::Figure(_)));
        assert_eq!(figures.count(), 5);
        let figure = report.maps[0].figure(20);
        let names: Vec<&str> = figure.series.iter().map(|series| series.name.as_str()).collect();
        assert_eq!(names[1..4], ["alone, sensors err", "pibt *", "pibt, reports"]);
    }
}
