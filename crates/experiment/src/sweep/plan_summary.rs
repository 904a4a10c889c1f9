//! The summary of a plan's runs: with its metrics, its baseline and the effect of its seeds.

use super::baseline::Baseline;
use super::options::{BaselineChoice, SummaryOptions};
use super::plan::Plan;
use super::seeds;
use super::summary::Summary;
use super::table::RunTable;
use sidestep_kernel::InputError;
use sidestep_scenario::{WorldType, Worlds};
use std::collections::{BTreeMap, BTreeSet};

impl Plan {
    /// Returns the summary of the runs of this plan, of one of `worlds`, with its metrics and baseline.
    ///
    /// # Errors
    /// When a metric that is to be reported does not exist, or the table is not of this plan.
    pub fn summary(&self, worlds: &Worlds, runs: &RunTable) -> Result<Summary, InputError> {
        self.summary_with_progress(worlds, runs, &mut |_| ())
    }

    /// Returns the summary like [`Plan::summary`], and passes on the share of the work that is done.
    ///
    /// # Errors
    /// The same.
    pub fn summary_with_progress(
        &self,
        worlds: &Worlds,
        runs: &RunTable,
        progress: &mut dyn FnMut(f64),
    ) -> Result<Summary, InputError> {
        let names = self.names();
        let world = worlds.find(&self.world);
        let mut seedless = BTreeSet::new();
        for (name, is_seedless) in names.iter().zip(seeds::seedless_variants(self, runs)) {
            if is_seedless {
                seedless.insert(name.clone());
            }
        }
        let options = SummaryOptions {
            metrics: (!self.metrics.is_empty()).then(|| self.metrics.clone()),
            seedless,
            better: self.better.clone(),
            privilege_note: self.privilege_note(),
            against: self.baseline.as_ref().map(|baseline| baseline_choice(baseline, &names)),
            central_metrics: world.map_or(&[], WorldType::chart_metrics),
            meanings: world.map_or(&[], WorldType::metric_infos),
            names: Some(names),
            ..SummaryOptions::default()
        };
        let mut summary = Summary::from_table_with_progress(runs, &options, progress)?;
        // First, because they say why there may be no intervals at all.
        summary.notes.splice(0..0, seeds::seed_notes(self, runs, world));
        Ok(summary)
    }
}

/// A summary finds variants by name, because a table may have runs of some of them only.
fn baseline_choice(baseline: &Baseline, names: &[String]) -> BaselineChoice {
    let mut of = BTreeMap::new();
    for (variant, baseline) in names.iter().zip(&baseline.of) {
        if let Some(baseline) = baseline.and_then(|baseline| names.get(baseline as usize)) {
            of.insert(variant.clone(), baseline.clone());
        }
    }
    BaselineChoice::Matched { name: baseline.name.clone(), of, alone: baseline.alone }
}
