//! The summary of a plan's runs: with its metrics, its baseline and the effect of its seeds.

use super::baseline::Baseline;
use super::options::{BaselineChoice, SummaryOptions};
use super::plan::Plan;
use super::seeds;
use super::summary::Summary;
use super::table::RunTable;
use sidestep_kernel::InputError;
use sidestep_scenario::{WorldType, Worlds};

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
        let same = seeds::seedless_variants(self, runs);
        let options = SummaryOptions {
            metrics: (!self.metrics.is_empty()).then(|| self.metrics.clone()),
            seedless: (0..names.len()).filter(|k| same[*k]).map(|k| names[k].clone()).collect(),
            against: self.baseline.as_ref().map(|baseline| baseline_choice(baseline, &names)),
            meanings: world.map_or(&[], WorldType::metric_infos),
            names: Some(names),
            ..SummaryOptions::default()
        };
        let mut summary = Summary::from_table_with_progress(runs, &options, progress)?;
        summary.notes.splice(0..0, seeds::seed_notes(self, runs, world));
        Ok(summary)
    }
}

/// Returns the baseline by the names of variants.
fn baseline_choice(baseline: &Baseline, names: &[String]) -> BaselineChoice {
    let name = |k: usize| names.get(k).cloned();
    let pair = |(k, of): (usize, &Option<u32>)| Some((name(k)?, name((*of)? as usize)?));
    let of = baseline.of.iter().enumerate().filter_map(pair).collect();
    BaselineChoice::Matched { name: baseline.name.clone(), of, alone: baseline.alone }
}
