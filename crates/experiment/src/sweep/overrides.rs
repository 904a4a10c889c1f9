//! Changes that a command or a program makes to the sweep of a file.

use super::baseline::BaselineSpec;
use super::design::Factor;
use super::file::{DEFAULT_MAX_RUNS, Precision, Sweep};
use super::variant::Setting;
use sidestep_kernel::InputError;

/// Changes of a sweep; those left at their default change nothing.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SweepOverrides {
    /// Settings of every variant, after those of the file.
    pub fixed: Vec<Setting>,
    /// Further factors of the grid, behind those of the file.
    pub factors: Vec<Factor>,
    /// The precision at which a variant has had enough runs; the metrics of the file's stay.
    pub until: Option<Precision>,
    /// Number of runs of each variant, regardless of the file's precision.
    pub replicates: Option<u32>,
    /// Largest number of runs of each variant, where a precision ends them.
    pub max_runs: Option<u32>,
    /// The metrics to report, and that the precision applies to, where it names none.
    pub metrics: Vec<String>,
    /// The baseline, instead of the file's.
    pub baseline: Option<BaselineSpec>,
    /// The seed of the first run, instead of that of the file or the scenario.
    pub first_seed: Option<u64>,
    /// Whether every run is recorded, even if the file does not say so.
    pub record: bool,
    /// The metrics that runs keep over time, instead of the file's.
    pub series: Option<Vec<String>>,
}

impl Sweep {
    /// Returns the sweep with these changes.
    ///
    /// # Errors
    /// When a largest number of runs is given, and no precision ends the sweep; when something is varied that
    /// no sweep can vary; when a key is set that every variant sets.
    pub fn with_overrides(mut self, changes: SweepOverrides) -> Result<Self, InputError> {
        self.design.factors.extend(changes.factors);
        changes.fixed.iter().try_for_each(|setting| self.check_fixed(setting))?;
        self.fixed.extend(changes.fixed);
        if let Some(until) = changes.until {
            // It replaces the precision alone; the other keys of the file's `until` stay.
            let metrics = match self.until.take() {
                Some(of_file) => of_file.metrics,
                None => {
                    // The file's `replicates` is a number of runs, not a limit.
                    self.replicates = DEFAULT_MAX_RUNS;
                    Vec::new()
                }
            };
            self.until = Some(Precision { metrics, ..until });
        }
        if let Some(replicates) = changes.replicates {
            self.until = None;
            self.replicates = replicates;
        }
        if let Some(max) = changes.max_runs {
            if self.until.is_none() {
                let cause = "it bounds the runs of a sweep with a target precision";
                return Err(InputError::new("--max", cause, "give --until ci=0.05 as well"));
            }
            self.replicates = max;
        }
        self.set_metrics(changes.metrics);
        self.baseline = changes.baseline.unwrap_or(self.baseline);
        self.first_seed = changes.first_seed.or(self.first_seed);
        self.record |= changes.record;
        self.series = changes.series.or(self.series);
        self.check()?;
        Ok(self)
    }

    /// Refuses a setting for all variants of a key that each of them sets for itself: it would have no effect.
    fn check_fixed(&self, Setting { key, value }: &Setting) -> Result<(), InputError> {
        let Some(varied) = self.design.common_key(|varied| is_same_or_below(key, varied)) else {
            return Ok(());
        };
        let remedy = "leave it out, or take the key out of the sweep: what a variant sets counts";
        let cause = format!("`{varied}` is varied by the sweep");
        Err(InputError::new(format!("{key} = {value}"), cause, remedy))
    }

    /// Sets the metrics to report, which the precision applies to as well if it names none.
    fn set_metrics(&mut self, metrics: Vec<String>) {
        let are_requested = !metrics.is_empty();
        if are_requested {
            self.metrics = metrics;
        }
        if let Some(until) = &mut self.until
            && (until.metrics.is_empty() || are_requested)
        {
            until.metrics.clone_from(&self.metrics);
        }
    }
}

/// Returns whether a key is this one, or lies below it. A table that stands alone in an array needs no index:
/// `robots.count` may be `robots.0.count`.
fn is_same_or_below(key: &str, above: &str) -> bool {
    let key: Vec<&str> = key.split('.').filter(|part| *part != "0").collect();
    let above: Vec<&str> = above.split('.').filter(|part| *part != "0").collect();
    key.starts_with(&above)
}

#[cfg(test)]
mod tests {
    use super::*;
    use sidestep_scenario::Source;

    #[test]
    fn a_key_is_set_for_all_variants_unless_each_of_them_sets_it() {
        let text = "format = 1\nscenario = \"s.toml\"\n[set]\nregime = \"both\"\n\
                    [vary]\na.b = [1, 2]\n[[variant]]\nc = 3\nf = 3\n[[variant]]\nf = 4\nname = \"plain\"\n\
                    [latin_hypercube]\nsamples = 2\nrange.d.e = { low = 1, high = 2 }\n";
        let sweep = Sweep::parse(&Source::new("sweep.toml", text, "dir")).expect("valid");
        let fixed = |text: &str| SweepOverrides {
            fixed: vec![Setting::parse(text).expect("a setting")],
            ..SweepOverrides::default()
        };
        for (setting, varied) in [
            ("a.b=3", "a.b"),
            ("a.b.x=3", "a.b"),
            ("a.0.b=3", "a.b"),
            ("f=5", "f"),
            ("d.e=1.5", "d.e"),
        ] {
            let error = sweep.clone().with_overrides(fixed(setting)).expect_err(setting);
            assert_eq!(error.cause(), format!("`{varied}` is varied by the sweep"));
        }
        for setting in ["a.bc=3", "a.c=3", "regime=\"sensors\"", "cycles=7"] {
            sweep.clone().with_overrides(fixed(setting)).expect(setting);
        }
        let changed = sweep.clone().with_overrides(fixed("c=4")).expect("`plain` does not set it");
        assert!(changed.fixed.contains(&Setting::parse("c=4").expect("a setting")));
        let both = SweepOverrides {
            factors: vec![Factor::parse("cycles=1,2").expect("a factor")],
            ..fixed("cycles=7")
        };
        let error = sweep.with_overrides(both).expect_err("set and varied");
        assert_eq!(error.cause(), "`cycles` is varied by the sweep");
    }
}
