//! The time that runs took.

use sidestep_experiment::sweep::Outcome;
use std::time::Instant;

/// The time that runs took in this process, in seconds.
#[derive(Debug, Clone, Copy, Default)]
pub struct SweepTiming {
    started_at: Option<Instant>,
    /// Elapsed time in seconds.
    pub wall_s: f64,
    /// Elapsed time of all workers in seconds.
    worked_s: f64,
    /// The part of that time spent on simulation.
    simulated_s: f64,
    /// Number of runs, those that failed among them.
    pub runs: u64,
    /// Largest number of runs in progress at once.
    pub at_once: usize,
}

impl SweepTiming {
    /// Starts the measurement.
    pub(super) fn start() -> Self {
        Self { started_at: Some(Instant::now()), ..Self::default() }
    }

    pub(super) fn record(&mut self, outcome: &Outcome) {
        self.runs += 1;
        self.simulated_s += outcome.costs.get("run_wall_s").and_then(|v| v.as_f64()).unwrap_or(0.0);
    }

    /// Ends the measurement, with the number of runs in progress at once.
    pub(super) fn stop(&mut self, at_once: usize) {
        self.wall_s = self.started_at.map_or(0.0, |at| at.elapsed().as_secs_f64());
        self.worked_s = self.wall_s * at_once as f64;
        self.at_once = at_once;
    }

    /// Adds the times of later runs; their number at once is kept if it is larger.
    pub(super) fn add(&mut self, later: Self) {
        self.wall_s += later.wall_s;
        self.worked_s += later.worked_s;
        self.simulated_s += later.simulated_s;
        self.runs += later.runs;
        self.at_once = self.at_once.max(later.at_once);
    }

    /// Returns the mean time of a run's simulation, in seconds.
    pub fn simulation_s_per_run(&self) -> f64 {
        self.simulated_s / self.runs.max(1) as f64
    }

    /// Returns the mean time of a run beyond its simulation, in ms: to read and compile its
    /// scenario, to store its row, to wait for work at the end.
    pub fn overhead_ms_per_run(&self) -> f64 {
        1000.0 * (self.worked_s - self.simulated_s) / self.runs.max(1) as f64
    }
}
