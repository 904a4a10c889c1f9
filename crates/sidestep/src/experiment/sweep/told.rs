//! The summary of a plan's runs: with its metrics, its baseline and the effect of its seeds.

use super::baseline::Baseline;
use super::options::{Against, SummaryOptions};
use super::plan::Plan;
use super::seeds;
use super::summary::Summary;
use super::table::RunTable;
use crate::worlds::WORLDS;
use sidestep_kernel::InputError;

impl Plan {
    /// Returns the summary of the runs of this plan, with its metrics and baseline.
    ///
    /// # Errors
    /// When a metric that is to be reported does not exist, or the table is not of this plan.
    pub fn summary(&self, runs: &RunTable) -> Result<Summary, InputError> {
        self.summary_watched(runs, &mut |_| ())
    }

    /// Returns the summary like [`Plan::summary`], and passes on the share of the work that is done.
    ///
    /// # Errors
    /// The same.
    pub fn summary_watched(
        &self,
        runs: &RunTable,
        progress: &mut dyn FnMut(f64),
    ) -> Result<Summary, InputError> {
        let names = self.names();
        let same = seeds::seedless(self, runs);
        let options = SummaryOptions {
            metrics: (!self.metrics.is_empty()).then(|| self.metrics.clone()),
            seedless: (0..names.len()).filter(|k| same[*k]).map(|k| names[k].clone()).collect(),
            against: self.baseline.as_ref().map(|baseline| against(baseline, &names)),
            meanings: WORLDS.named(&self.world).map_or(&[], |world| world.meanings()),
            names: Some(names),
            ..SummaryOptions::default()
        };
        let mut summary = Summary::watched(runs, &options, progress)?;
        summary.notes.splice(0..0, seeds::notes(self, runs));
        Ok(summary)
    }
}

/// Returns the baseline by the names of variants.
fn against(baseline: &Baseline, names: &[String]) -> Against {
    let name = |k: usize| names.get(k).cloned();
    let pair = |(k, of): (usize, &Option<u32>)| Some((name(k)?, name((*of)? as usize)?));
    let of = baseline.of.iter().enumerate().filter_map(pair).collect();
    Against::Matched { name: baseline.name.clone(), of, alone: baseline.alone }
}
