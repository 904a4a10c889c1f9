//! The double pool against the two strategies that the paper rejects.

use super::LoriaConfig;
use super::performance::{loads, worker_counts};
use super::timing::{
    SEGMENTS, Workload, arithmetic, mean_cycle_ms, speed_ups, time_interleaved, time_s, times_of,
};
use crate::case_results::{figure, table};
use crate::study::Progress;
use serde::Serialize;
use sidestep::kernel::Simulation;
use sidestep::worlds::robots::RobotsRun;
use sidestep::worlds::robots::baseline::{BaselineRun, Strategy, find_violation};
use sidestep_document::{Estimate, Figure, Series, Table};
use std::convert::Infallible;

/// Times of a load under a strategy.
#[derive(Debug, Clone, Serialize)]
pub(super) struct StrategyTiming {
    /// Index into [`StrategyResults::loads`].
    pub(super) load: usize,
    /// Name of the strategy in tables.
    pub(super) strategy: String,
    /// Number of workers of the run.
    pub(super) workers: usize,
    /// Milliseconds per cycle.
    pub(super) cycle_ms: Estimate,
    /// Time of the double pool with one worker divided by this time.
    pub(super) speed_up: Estimate,
    /// The same by repeat, for pairs with other strategies.
    pub(super) ratios: Vec<Option<f64>>,
    /// Speed-up of plain arithmetic with as many workers, timed in turn with this.
    pub(super) machine: Estimate,
    /// Contacts per 1000 actions, which depend on the strategy.
    pub(super) contacts: f64,
    /// Share of the bodies' cycles that one worker does while all others wait.
    pub(super) serial_share: f64,
    /// Whether at the end no two bodies shared a box, and none stood in a wall.
    pub(super) valid: bool,
    /// Whether every robot has acted once in every cycle.
    pub(super) complete: bool,
}

#[derive(Debug, Clone, Serialize)]
pub(super) struct StrategyResults {
    pub(super) loads: Vec<Workload>,
    /// By load, then by number of workers, the double pool first.
    pub(super) trials: Vec<StrategyTiming>,
}

/// Name of the kernel's strategy.
const DOUBLE_POOL: &str = "double pool";
/// Name of the arithmetic that shows how much the machine can give.
const ARITHMETIC: &str = "arithmetic";

/// A participant of the timings: a run under one of the three strategies, or arithmetic.
enum StrategyRun {
    DoublePool(Box<RobotsRun>),
    Baseline(Box<BaselineRun>),
    Arithmetic,
}

struct StrategyCandidate {
    strategy: &'static str,
    workers: usize,
    run: StrategyRun,
}

impl StrategyRun {
    fn advance(&mut self, cycles: u64) {
        match self {
            Self::DoublePool(run) => {
                let mut done = 0;
                while done < cycles {
                    done += run.advance(cycles - done);
                }
            }
            Self::Baseline(run) => run.advance(cycles),
            Self::Arithmetic => {}
        }
    }
}

impl StrategyCandidate {
    fn is(&self, strategy: &str, workers: usize) -> bool {
        self.strategy == strategy && self.workers == workers
    }

    fn seconds(&mut self, cycles: u64, robot_cycles: u64) -> f64 {
        match self.run {
            StrategyRun::Arithmetic => arithmetic(self.workers, robot_cycles),
            _ => time_s(|| self.run.advance(cycles)).0,
        }
    }
}

impl StrategyResults {
    /// Times the loads with the cheapest and the costliest decisions under all three strategies.
    pub(super) fn run(plan: &LoriaConfig, report: &mut Progress<'_>) -> Self {
        let mut loads = loads(plan);
        // Three strategies take three times as long: the costs between show nothing that their ends do not.
        let extremes = [plan.operations.iter().min(), plan.operations.iter().max()];
        loads.retain(|load| extremes.contains(&Some(&load.operations)));
        let mut trials = Vec::new();
        for (index, load) in loads.iter().enumerate() {
            report("rejected strategies", index as f64 / loads.len() as f64);
            trials.extend(time_load(plan, index, load));
        }
        Self { loads, trials }
    }

    /// Returns whether every trial has kept the laws and every robot has acted.
    #[cfg(test)]
    pub(super) fn all_valid(&self) -> bool {
        self.trials.iter().all(|trial| trial.valid && trial.complete)
    }

    /// Returns the speed-up of the double pool minus that of another strategy, with the most
    /// workers, one estimate per load.
    pub(super) fn lead_over(&self, strategy: Strategy) -> Vec<Estimate> {
        let mut leads = Vec::new();
        for load in 0..self.loads.len() {
            let own = self.ratios_with_most_workers(load, DOUBLE_POOL);
            let other = self.ratios_with_most_workers(load, strategy.name());
            leads.push(Estimate::paired_difference(own, other));
        }
        leads
    }

    fn ratios_with_most_workers(&self, load: usize, strategy: &str) -> &[Option<f64>] {
        let max_workers = self.trials.iter().map(|t| t.workers).max().unwrap_or(1);
        let of_strategy = self.trials.iter().filter(|t| t.load == load && t.strategy == strategy);
        let mut with_most = of_strategy.filter(|t| t.workers == max_workers);
        with_most.next().map_or(&[], |t| &t.ratios[..])
    }

    pub(super) fn table(&self) -> Table {
        let note = format!(
            "Mean [95 % interval] over repeats, each the best of {SEGMENTS} stretches that take \
             turns. The rejected strategies give valid worlds, but other ones: with the \
             partition results depend on the number of workers, with the lock on the moment \
             too. Under the lock fewer contacts count, since a robot sees the moves of those \
             before it in the same cycle. The partition makes no draws for priority, and the \
             lock keeps its threads between cycles; both favor them."
        );

        table(
            "The double pool and the rejected strategies",
            note,
            &self.trials,
            &[
                ("load", &|trial| self.loads[trial.load].name()),
                ("strategy", &|trial| trial.strategy.clone()),
                ("workers", &|trial| trial.workers.to_string()),
                ("ms per cycle", &|trial| trial.cycle_ms.to_string()),
                ("speed-up over double pool, 1 worker", &|trial| trial.speed_up.to_string()),
                ("the machine's speed-up", &|trial| trial.machine.to_string()),
                ("done serially", &|trial| format!("{:.1} %", 100.0 * trial.serial_share)),
                ("contacts / 1000 actions", &|trial| format!("{:.1}", trial.contacts)),
                ("laws kept", &|trial| {
                    if trial.valid && trial.complete { "yes" } else { "NO" }.into()
                }),
            ],
        )
    }

    /// Returns speed-up over workers, one figure per load.
    pub(super) fn figures(&self) -> Vec<Figure> {
        let labels = ["workers", "speed-up over the double pool with 1 worker"];
        let mut figures = Vec::new();
        for (index, load) in self.loads.iter().enumerate() {
            let title = format!("Strategies: {}", load.name());
            let lines = names().map(|name| self.series(index, name));
            figures.push(figure(&title, labels, lines));
        }
        figures
    }

    fn series(&self, load: usize, name: &str) -> Series {
        let trials = self.trials.iter().filter(|t| t.load == load && t.strategy == name);
        let points = trials.filter_map(|t| t.speed_up.point(t.workers as f64)).collect();
        Series { name: name.into(), points }
    }
}

fn names() -> [&'static str; 3] {
    [DOUBLE_POOL, Strategy::SpatialPartition.name(), Strategy::OneLock.name()]
}

fn time_load(plan: &LoriaConfig, index: usize, load: &Workload) -> Vec<StrategyTiming> {
    let cycles = load.cycles(plan.timed_robot_cycles);
    let mut all = strategy_candidates(plan, load);
    // A first stretch that is not timed: it starts threads and fills buffers, which later ones do not.
    for candidate in &mut all {
        candidate.run.advance(cycles);
    }
    let Ok(times_s) = time_interleaved(&mut all, plan.repeats, |candidate| {
        Ok::<_, Infallible>(candidate.seconds(cycles, plan.timed_robot_cycles))
    });
    let reference_s = times_of(&all, &times_s, |c| c.is(DOUBLE_POOL, 1));
    let machine_alone_s = times_of(&all, &times_s, |c| c.is(ARITHMETIC, 1));
    let mut trials = Vec::new();
    for (candidate, own_s) in all.iter().zip(&times_s) {
        let Some(stats) = contact_stats(load, &candidate.run) else { continue };
        let machine_s = times_of(&all, &times_s, |c| c.is(ARITHMETIC, candidate.workers));
        let ratios = speed_ups(reference_s, own_s);
        trials.push(StrategyTiming {
            load: index,
            strategy: candidate.strategy.into(),
            workers: candidate.workers,
            cycle_ms: mean_cycle_ms(own_s, cycles),
            speed_up: Estimate::from_factors(ratios.iter().copied()),
            ratios,
            machine: Estimate::geometric_ratio(machine_alone_s, machine_s),
            contacts: stats.contacts,
            serial_share: stats.serial_share,
            valid: stats.valid,
            complete: stats.complete,
        });
    }
    trials
}

/// Returns every strategy with every number of workers, and arithmetic.
fn strategy_candidates(plan: &LoriaConfig, load: &Workload) -> Vec<StrategyCandidate> {
    let mut all = Vec::new();
    for workers in worker_counts(plan.most_workers) {
        let run = StrategyRun::DoublePool(Box::new(load.simulation(workers)));
        all.push(StrategyCandidate { strategy: DOUBLE_POOL, workers, run });
        for strategy in Strategy::ALL {
            let run = BaselineRun::new(load.compiled(), strategy, workers);
            let run = StrategyRun::Baseline(Box::new(run));
            all.push(StrategyCandidate { strategy: strategy.name(), workers, run });
        }
        all.push(StrategyCandidate { strategy: ARITHMETIC, workers, run: StrategyRun::Arithmetic });
    }
    all
}

/// Contacts of a run, and whether it kept the laws; see [`StrategyTiming`].
struct ContactStats {
    contacts: f64,
    serial_share: f64,
    valid: bool,
    complete: bool,
}

/// Returns the contacts of a run; `None` for arithmetic.
fn contact_stats(load: &Workload, run: &StrategyRun) -> Option<ContactStats> {
    let (metrics, snapshot, serial_share) = match run {
        StrategyRun::DoublePool(run) => (run.metrics(), run.snapshot(), 0.0),
        StrategyRun::Baseline(run) => (run.metrics(), run.snapshot(), run.serial_fraction()),
        StrategyRun::Arithmetic => return None,
    };
    Some(ContactStats {
        contacts: 1e3 * metrics.contacts_per_action,
        serial_share,
        valid: find_violation(&load.compiled().world, &snapshot).is_none(),
        complete: metrics.total.actions == u64::from(load.robots) * snapshot.cycle,
    })
}
