//! The double pool against the two strategies that the paper rejects.

use super::Plan;
use super::performance::{loads, worker_counts};
use super::timing::{Load, STRETCHES, race, seconds};
use crate::experiment::farm::Progress;
use crate::experiment::{Estimate, Figure, FigureKind, Series, Table};
use crate::worlds::robots::baseline::{Baseline, Strategy, breach};
use crate::worlds::robots::simulation::RobotsSimulation;
use serde::Serialize;
use sidestep_kernel::Simulation;
use std::convert::Infallible;

/// A strategy's time for a load.
#[derive(Debug, Clone, Serialize)]
pub struct Trial {
    /// Number of the load.
    pub load: usize,
    /// Name of the strategy.
    pub strategy: String,
    /// Workers.
    pub workers: usize,
    /// Milliseconds per cycle.
    pub cycle_ms: Estimate,
    /// Time of the double pool with one worker by this time.
    pub speed_up: Estimate,
    /// Contacts per 1000 actions: what a robot meets depends on the strategy.
    pub contacts: f64,
    /// Share of the bodies' cycles that one worker does while all others wait.
    pub serial_share: f64,
    /// Whether at the end no two bodies shared a box, and none stood in a wall.
    pub valid: bool,
    /// Whether every robot has acted once in every cycle.
    pub complete: bool,
}

/// All trials.
#[derive(Debug, Clone, Serialize)]
pub struct Strategies {
    /// What was timed.
    pub loads: Vec<Load>,
    /// The trials.
    pub trials: Vec<Trial>,
}

/// Name of the kernel's strategy.
const DOUBLE_POOL: &str = "double pool";

/// A run under any of the three strategies.
enum Run {
    DoublePool(Box<RobotsSimulation>),
    Baseline(Box<Baseline>),
}

impl Run {
    fn advance(&mut self, cycles: u64) {
        match self {
            Self::DoublePool(run) => {
                let mut done = 0;
                while done < cycles {
                    done += run.advance(cycles - done);
                }
            }
            Self::Baseline(run) => run.advance(cycles),
        }
    }
}

impl Strategies {
    /// Runs the comparison.
    pub fn run(plan: &Plan, report: &mut Progress<'_>) -> Self {
        let mut loads = loads(plan);
        let extremes = [plan.operations.iter().min(), plan.operations.iter().max()];
        loads.retain(|load| extremes.contains(&Some(&load.operations)));
        let mut trials = Vec::new();
        for (index, load) in loads.iter().enumerate() {
            report("rejected strategies", index as f64 / loads.len() as f64);
            trials.extend(try_load(plan, index, load));
        }
        Self { loads, trials }
    }

    /// Whether every trial has kept the laws and left nobody out.
    pub fn all_valid(&self) -> bool {
        self.trials.iter().all(|trial| trial.valid && trial.complete)
    }

    /// The comparison as a table.
    pub fn table(&self) -> Table {
        let columns = [
            "load",
            "strategy",
            "workers",
            "ms per cycle",
            "speed-up over double pool, 1 worker",
            "done serially",
            "contacts / 1000 actions",
            "laws kept",
        ];
        let note = format!(
            "Mean [95 % interval] over repeats, each the best of {STRETCHES} stretches that take \
             turns. The rejected strategies give valid worlds, but other ones: with the \
             partition results depend on the number of workers, with the lock on the moment \
             too. Under the lock fewer contacts count, since a robot sees the moves of those \
             before it in the same cycle. The partition makes no draws for priority, and the \
             lock keeps its threads between cycles; both favor them."
        );
        let mut table = Table::new("The double pool and the rejected strategies", note, &columns);
        for trial in &self.trials {
            table.row([
                self.loads[trial.load].name(),
                trial.strategy.clone(),
                trial.workers.to_string(),
                trial.cycle_ms.to_string(),
                trial.speed_up.to_string(),
                format!("{:.1} %", 100.0 * trial.serial_share),
                format!("{:.1}", trial.contacts),
                if trial.valid && trial.complete { "yes" } else { "NO" }.into(),
            ]);
        }
        table
    }

    /// Speed-up over workers, one figure per load.
    pub fn figures(&self) -> Vec<Figure> {
        let figure = |(index, load): (usize, &Load)| Figure {
            title: format!("Strategies: {}", load.name()),
            x_label: "workers".into(),
            y_label: "speed-up over the double pool with 1 worker".into(),
            kind: FigureKind::Lines,
            series: names().iter().map(|name| self.series(index, name)).collect(),
        };
        self.loads.iter().enumerate().map(figure).collect()
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

fn try_load(plan: &Plan, index: usize, load: &Load) -> Vec<Trial> {
    let cycles = load.cycles(plan.timed_robot_cycles);
    let mut runs = contestants(plan, load);
    runs.iter_mut().for_each(|(.., run)| run.advance(cycles));
    let raced = race(&mut runs, plan.repeats, |(.., run)| {
        Ok::<_, Infallible>(seconds(|| run.advance(cycles)).0)
    });
    let Ok(times_s) = raced;
    let finish = |((strategy, workers, run), own_s): (&(&str, usize, Run), &Vec<Option<f64>>)| {
        let (contacts, serial_share, valid, complete) = judge(load, run);
        Trial {
            load: index,
            strategy: (*strategy).into(),
            workers: *workers,
            cycle_ms: Estimate::of(own_s.iter().map(|t| t.map(|t| 1e3 * t / cycles as f64))),
            speed_up: Estimate::ratio(&times_s[0], own_s),
            contacts,
            serial_share,
            valid,
            complete,
        }
    };
    runs.iter().zip(&times_s).map(finish).collect()
}

/// Every strategy with every number of workers; the double pool with one worker is the first.
fn contestants(plan: &Plan, load: &Load) -> Vec<(&'static str, usize, Run)> {
    let mut runs = Vec::new();
    for workers in worker_counts(plan.most_workers) {
        runs.push((DOUBLE_POOL, workers, Run::DoublePool(Box::new(load.simulation(workers)))));
        runs.extend(Strategy::ALL.map(|strategy| {
            let run = Baseline::new(load.compiled(), strategy, workers);
            (strategy.name(), workers, Run::Baseline(Box::new(run)))
        }));
    }
    runs
}

/// Contacts per 1000 actions, the serial share, and whether laws and counts were kept.
fn judge(load: &Load, run: &Run) -> (f64, f64, bool, bool) {
    let (metrics, snapshot, share) = match run {
        Run::DoublePool(run) => (run.robot_metrics(), run.snapshot(), 0.0),
        Run::Baseline(run) => (run.metrics(), run.snapshot(), run.serial_share()),
    };
    let valid = breach(&load.compiled().world, &snapshot).is_none();
    let complete = metrics.total.actions == u64::from(load.robots) * snapshot.cycle;
    (1e3 * metrics.contacts_per_action, share, valid, complete)
}
