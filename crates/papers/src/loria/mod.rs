//! The experiments of the robots world's source paper, "A parallel simulation of stochastic
//! agent/environment interaction" (LORIA, 2001), rerun.
//!
//! The paper's tables are lost, so its *claims* are examined: which quantity is larger, smaller,
//! faster. Every figure is our own, with the number of runs and a 95 % interval. `claims` says of
//! each claim whether it held, is refuted or undecided, whether its evidence is lost, or that it
//! states a setting.
//!
//! ```text
//! floor.rs, errors.rs              the buildings, the error tables
//! measure.rs   -> reliability.rs, genericity.rs               results of runs
//! timing.rs    -> performance.rs, strategies.rs, cost_model.rs   durations of runs
//! scenes.rs                        ways of robots, as pictures
//! claims/                          the verdicts
//! ```

mod claims;
mod cost_model;
mod errors;
mod floor;
mod genericity;
mod measure;
mod performance;
mod reliability;
pub mod scenes;
mod strategies;
mod timing;

use crate::claims::ReportParts;
use crate::study::{Progress, sub_progress};
use cost_model::CostModel;
use genericity::GenericityResults;
use performance::PerformanceResults;
use reliability::ReliabilityResults;
use serde::Serialize;
use sidestep::kernel::InputError;
use sidestep::kernel::ports::{MemoryRecorder, RecordError, Recorder, TableSchema};
use sidestep::kernel::workers::available_workers;
use sidestep_document::claim::{Claim, verdict_summary};
use sidestep_document::document::{Document, Experiment, Picture};
use strategies::StrategyResults;

/// The amount of work to run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LoriaConfig {
    /// Seeds per variant, at least 2 (an interval needs two).
    pub seeds: usize,
    /// Cycles of each run in which behavior is measured.
    pub cycles: u64,
    /// Error levels at which sensors and effectors are compared, above 0 and below 1.
    pub error_levels: Vec<f64>,
    /// Runs at once, when behavior is measured; no result depends on it.
    pub workers: usize,
    /// Maximum number of workers of one run, when time is measured.
    pub most_workers: usize,
    /// Repeats of each timing, at least 2.
    pub repeats: usize,
    /// Robots of the timed loads, sparse to dense.
    pub robots: Vec<u32>,
    /// Operations that a decision costs in the timed loads, from cheap to expensive.
    pub operations: Vec<u32>,
    /// Length of a timed stretch, as an approximate number of decisions of the cheapest kind.
    pub timed_robot_cycles: u64,
    /// Whether this is a rehearsal: fewer points, and figures without weight.
    pub quick: bool,
}

impl Default for LoriaConfig {
    /// The full plan: 24 seeds; a few minutes on two processors.
    fn default() -> Self {
        Self {
            seeds: 24,
            cycles: 4000,
            error_levels: vec![0.02, 0.05, 0.1, 0.2, 0.3, 0.4],
            workers: available_workers(),
            // The paper went to sixteen processors.
            most_workers: available_workers().min(16),
            repeats: 9,
            robots: vec![250, 1500],
            operations: vec![0, 1000, 10_000],
            timed_robot_cycles: 25_000,
            quick: false,
        }
    }
}

/// Upper bound of the amounts of a plan: a machine can do this much in a day.
const MAX_AMOUNT: u64 = 1_000_000;

impl LoriaConfig {
    /// Returns a rehearsal of seconds: everything is run once, and nothing is measured well.
    pub fn quick() -> Self {
        Self {
            seeds: 2,
            cycles: 700,
            error_levels: vec![0.1],
            workers: 2,
            most_workers: 2,
            repeats: 2,
            robots: vec![100],
            operations: vec![0, 1000],
            timed_robot_cycles: 500,
            quick: true,
        }
    }

    fn check(&self) -> Result<(), InputError> {
        let levels = &self.error_levels;
        let levels_are_right = !levels.is_empty() && levels.iter().all(|&e| e > 0.0 && e < 1.0);
        let robots_are_right =
            !self.robots.is_empty() && self.robots.iter().all(|n| (1..=3000).contains(n));
        let max_cycles = 10 * MAX_AMOUNT;
        let max_decisions = 1000 * MAX_AMOUNT;
        let rules = [
            ("seeds", (2..=100_000).contains(&self.seeds), "give 2 to 100000 seeds"),
            ("cycles", (100..=max_cycles).contains(&self.cycles), "give 100 to 10000000 cycles"),
            ("error_levels", levels_are_right, "give levels above 0 and below 1"),
            ("workers", (1..=1024).contains(&self.workers), "give 1 to 1024 workers"),
            ("most_workers", (1..=1024).contains(&self.most_workers), "give 1 to 1024 workers"),
            ("repeats", (2..=10_000).contains(&self.repeats), "give 2 to 10000 repeats"),
            ("robots", robots_are_right, "give numbers from 1 to 3000: more do not fit the floor"),
            ("operations", !self.operations.is_empty(), "give at least one cost, e.g. 0"),
            (
                "timed_robot_cycles",
                (100..=max_decisions).contains(&self.timed_robot_cycles),
                "give 100 to 1000000000",
            ),
        ];
        for (key, is_right, remedy) in rules {
            if !is_right {
                let cause = "out of range for the experiment";
                return Err(InputError::new(format!("plan.{key}"), cause, remedy));
            }
        }
        Ok(())
    }
}

/// Makes a recorder for a run with these tables.
pub type NewRecorder<'a> = dyn FnMut(&[TableSchema]) -> Result<Box<dyn Recorder>, RecordError> + 'a;

/// Keeps recordings in memory until their run ends.
///
/// # Errors
/// Never: the result has the type that [`NewRecorder`] asks for.
pub fn in_memory(schemas: &[TableSchema]) -> Result<Box<dyn Recorder>, RecordError> {
    Ok(Box::new(MemoryRecorder::new(schemas)))
}

/// The reason why the experiments could not be run.
#[derive(Debug, thiserror::Error)]
pub enum LoriaError {
    /// The plan is out of range.
    #[error(transparent)]
    Plan(#[from] InputError),
    /// A recording failed.
    #[error(transparent)]
    Record(#[from] RecordError),
}

/// All results of the experiments.
#[derive(Debug, Clone, Serialize)]
pub struct LoriaReport {
    /// The plan that was run.
    pub plan: LoriaConfig,
    /// Version of the program that made the report.
    pub program_version: String,
    reliability: ReliabilityResults,
    genericity: GenericityResults,
    performance: PerformanceResults,
    strategies: StrategyResults,
    cost_model: CostModel,
    /// The paper's claims and our verdicts.
    pub claims: Vec<Claim>,
}

/// Runs all experiments; recordings are kept in memory.
///
/// `progress` is called with the current activity and the finished share of the whole.
///
/// # Errors
/// When the plan is out of range.
pub fn run(plan: &LoriaConfig, progress: &mut Progress<'_>) -> Result<LoriaReport, LoriaError> {
    run_recorded(plan, &mut in_memory, progress)
}

/// Runs all experiments; `recorders` makes the recorders of timed runs.
///
/// # Errors
/// When the plan is out of range, or a recording fails.
pub fn run_recorded(
    plan: &LoriaConfig,
    recorders: &mut NewRecorder<'_>,
    progress: &mut Progress<'_>,
) -> Result<LoriaReport, LoriaError> {
    plan.check()?;
    // Shares of the whole by the time they take on two processors.
    let reliability = ReliabilityResults::run(plan, &mut sub_progress(progress, 0.0, 0.45));
    let genericity = GenericityResults::run(plan, &mut sub_progress(progress, 0.45, 0.55));
    let performance =
        PerformanceResults::run(plan, recorders, &mut sub_progress(progress, 0.55, 0.8))?;
    let strategies = StrategyResults::run(plan, &mut sub_progress(progress, 0.8, 0.93));
    let cost_model = CostModel::run(plan, &mut sub_progress(progress, 0.93, 1.0));
    let mut report = LoriaReport {
        plan: plan.clone(),
        program_version: env!("CARGO_PKG_VERSION").into(),
        reliability,
        genericity,
        performance,
        strategies,
        cost_model,
        claims: Vec::new(),
    };
    report.claims = claims::judge(&report);
    progress("done", 1.0);
    Ok(report)
}

impl LoriaReport {
    /// In the order of the file of claims, which has their words.
    fn experiments(&self) -> Vec<Experiment> {
        claims::CLAIMS.experiments([
            (self.reliability.figures(), self.reliability.tables()),
            (vec![self.genericity.figure()], vec![self.genericity.table()]),
            (self.performance.figures(), self.performance.tables()),
            (self.strategies.figures(), vec![self.strategies.table()]),
            (vec![self.cost_model.figure()], vec![self.cost_model.table()]),
        ])
    }

    /// Returns the report, the claims first; `pictures` are those of the [scenes](scenes::all),
    /// drawn.
    pub fn document(&self, pictures: Vec<Picture>) -> Document {
        let plan = &self.plan;
        let lead = format!(
            "{} The paper's tables are lost; every number here is ours. Version {}; seeds 1 to {} \
             for every variant, {} cycles a run, {} repeats of every timing, {} processors.",
            verdict_summary(&self.claims),
            self.program_version,
            plan.seeds,
            plan.cycles,
            plan.repeats,
            self.performance.processors,
        );
        let experiments = self.experiments();
        let parts = ReportParts { claims: &self.claims, pictures, experiments };
        claims::CLAIMS.document(lead, plan.quick, parts, self.command())
    }

    fn command(&self) -> String {
        let plan = &self.plan;
        format!(
            "sidestep reproduce loria{} --seeds {} --cycles {} --workers {} --out DIR",
            if plan.quick { " --quick" } else { "" },
            plan.seeds,
            plan.cycles,
            plan.workers,
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sidestep_document::document::Block;

    #[test]
    fn a_quick_plan_judges_every_claim_and_gives_text_figures_and_json() {
        let mut shares = Vec::new();
        let report = run(&LoriaConfig::quick(), &mut |_, share| shares.push(share)).unwrap();
        assert!(shares.is_sorted() && shares.last() == Some(&1.0));
        for number in 1..=15 {
            let id = format!("E-{number}");
            let of_id = |c: &&Claim| c.id.trim_end_matches(char::is_alphabetic) == id;
            let claim = report.claims.iter().find(of_id).expect("every claim is judged");
            assert!(!claim.ours.is_empty() && !claim.reason.is_empty(), "{id}");
        }
        assert!(report.strategies.all_valid() && report.performance.is_deterministic());
        let document = report.document(Vec::new());
        assert!(document.blocks.iter().any(|block| matches!(block, Block::Warning(_))));
        let text = format!("{document:?}");
        assert!(text.contains("E-9") && !text.contains("NaN"));
        for figure in report.experiments().into_iter().flat_map(|e| e.figures) {
            assert!(!figure.series.is_empty(), "{}", figure.title);
            assert!(figure.series.iter().any(|s| !s.points.is_empty()), "{}", figure.title);
        }
        assert!(serde_json::to_string(&report).is_ok_and(|json| json.contains("\"claims\"")));
    }

    #[test]
    fn plans_out_of_range_are_refused_before_anything_runs() {
        let quick = LoriaConfig::quick();
        let wrong = [
            LoriaConfig { seeds: 1, ..quick.clone() },
            LoriaConfig { cycles: u64::MAX, ..quick.clone() },
            LoriaConfig { error_levels: vec![f64::NAN], ..quick.clone() },
            LoriaConfig { workers: 0, ..quick.clone() },
            LoriaConfig { robots: vec![4_000_000_000], ..quick.clone() },
            LoriaConfig { operations: Vec::new(), ..quick.clone() },
        ];
        for plan in wrong {
            let outcome = run(&plan, &mut |_, _| panic!("nothing runs"));
            assert!(matches!(outcome, Err(LoriaError::Plan(_))), "{plan:?}");
        }
        assert!(LoriaConfig::default().check().is_ok() && quick.check().is_ok());
    }

    #[test]
    fn a_failing_recorder_ends_the_experiment_with_its_error() {
        let mut full = |_: &[TableSchema]| Err(RecordError::new("disk", "full"));
        let outcome = run_recorded(&LoriaConfig::quick(), &mut full, &mut |_, _| {});
        assert!(matches!(outcome, Err(LoriaError::Record(e)) if e.cause == "full"));
    }
}
