//! Changes that a command or a program makes to the sweep of a file.

use super::baseline::Wanted;
use super::design::Factor;
use super::file::{MAX_RUNS, Sweep, Until};
use super::variant::Setting;
use sidestep_kernel::InputError;

/// Changes of a sweep; those left at their default change nothing.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Changes {
    /// Settings of every variant, after those of the file.
    pub fixed: Vec<Setting>,
    /// Further factors of the grid.
    pub factors: Vec<Factor>,
    /// The precision at which a variant has had enough runs; the metrics of the file's stay.
    pub until: Option<Until>,
    /// Number of runs of each variant, whatever the file says about precision.
    pub replicates: Option<u32>,
    /// Largest number of runs of each variant, where a precision ends them.
    pub max_runs: Option<u32>,
    /// The metrics to report, and that the precision applies to, where it names none.
    pub metrics: Vec<String>,
    /// The baseline.
    pub baseline: Option<Wanted>,
    /// The seed of the first run.
    pub first_seed: Option<u64>,
    /// Whether every run is recorded, even if the file does not say so.
    pub record: bool,
}

impl Sweep {
    /// Returns the sweep with these changes.
    ///
    /// # Errors
    /// When a largest number of runs is given, and no precision ends the sweep; when something is varied that
    /// no sweep can vary.
    pub fn changed(mut self, changes: Changes) -> Result<Self, InputError> {
        self.fixed.extend(changes.fixed);
        self.design.factors.extend(changes.factors);
        if let Some(until) = changes.until {
            // It replaces the precision alone; the other keys of the file's `until` stay.
            let metrics = self.until.take().map(|of_file| of_file.metrics);
            self.replicates = if metrics.is_some() { self.replicates } else { MAX_RUNS };
            self.until = Some(Until { metrics: metrics.unwrap_or_default(), ..until });
        }
        if let Some(n) = changes.replicates {
            (self.until, self.replicates) = (None, n);
        }
        if let Some(max) = changes.max_runs {
            if self.until.is_none() {
                let cause = "it bounds the runs of a sweep that goes on until it is precise";
                return Err(InputError::new("--max", cause, "give --until ci=0.05 as well"));
            }
            self.replicates = max;
        }
        self.measure(changes.metrics);
        self.baseline = changes.baseline.unwrap_or(self.baseline);
        self.first_seed = changes.first_seed.or(self.first_seed);
        self.record |= changes.record;
        self.check()?;
        Ok(self)
    }

    /// Sets the metrics to report, which the precision applies to as well if it names none.
    fn measure(&mut self, metrics: Vec<String>) {
        let is_asked = !metrics.is_empty();
        if is_asked {
            self.metrics = metrics;
        }
        let applies_to = |until: &Until| until.metrics.is_empty() || is_asked;
        if let Some(until) = self.until.as_mut().filter(|until| applies_to(until)) {
            until.metrics.clone_from(&self.metrics);
        }
    }
}
