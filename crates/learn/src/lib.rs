#![deny(clippy::disallowed_methods)]
#![doc = include_str!("../README.md")]

pub mod effector;
pub mod sensor;

mod beam_information;
pub mod columns;
mod counts;
mod display;
pub mod holdout;
mod left_out;
pub mod log_table;
pub mod profile;
mod track;
pub mod watched_table;

#[cfg(test)]
mod oracle;

pub use counts::{CountMatrix, CountTable, Estimate, LowCountRow};
pub use left_out::LeftOut;

use serde::Serialize;

use log_table::LogTable;
use sidestep_import::{ImportReport, Treatment};
use sidestep_kernel::InputError;

/// Greatest number that is added to a count: beside a larger one no count counts, and sums of rows overflow.
pub const MAX_ALPHA: f64 = 1e9;

/// The rule by which counts become probabilities.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct EstimateOptions {
    /// Count added to every cell of a row before the row is normalized. The default, 0.5, is
    /// Jeffreys' prior: an outcome is not impossible because it was not seen, and a hundred counts
    /// outweigh it.
    pub alpha: f64,
    /// Rows with fewer counts than this are reported as thin.
    pub thin_below: u32,
    /// Every `hold_out_every`-th event is held out; 2 compares odd with even.
    pub hold_out_every: usize,
    /// Greatest share of samples, from 0 to 1, that may be left out for a reason that nothing explains; above it no
    /// interval is given.
    pub max_unexplained: f64,
}

impl Default for EstimateOptions {
    fn default() -> Self {
        // With 30 counts the 95 % interval of a probability of one half is still a third wide.
        Self { alpha: 0.5, thin_below: 30, hold_out_every: 2, max_unexplained: 0.05 }
    }
}

impl EstimateOptions {
    /// Checks that the options are valid.
    ///
    /// # Errors
    /// When `alpha` is negative or above [`MAX_ALPHA`], `hold_out_every` is below 2, or `max_unexplained` is not from
    /// 0 to 1.
    pub fn check(&self) -> Result<(), InputError> {
        if !(0.0..=MAX_ALPHA).contains(&self.alpha) {
            let cause = format!("{:?} cannot be added to a count", self.alpha);
            let remedy = format!("give a number from 0 to {MAX_ALPHA}, such as 0.5");
            return Err(InputError::new("alpha", cause, remedy));
        }
        if self.hold_out_every < 2 {
            let cause = format!("holding out every {}th event leaves none", self.hold_out_every);
            return Err(InputError::new("hold-out", cause, "give 2 or more"));
        }
        if !(0.0..=1.0).contains(&self.max_unexplained) {
            let cause = format!("a share of {:?} of the samples", self.max_unexplained);
            return Err(InputError::new(
                "max-unexplained",
                cause,
                "give a share from 0 to 1, such as 0.05",
            ));
        }
        Ok(())
    }
}

/// Returns what was dropped, repaired, guessed or is suspicious in a log as warnings; what has another meaning and is not
/// used changes nothing.
pub(crate) fn import_warnings(name: &str, report: &ImportReport) -> Vec<String> {
    let findings = report.findings.iter().filter(|found| found.treatment != Treatment::NotUsed);
    findings.map(|finding| format!("{name}: {finding}")).collect()
}

/// Returns what to say of a table that is learned from: how it was read, and which of its columns are not.
pub(crate) fn table_warnings(table: &dyn LogTable, columns: &[&str]) -> Vec<String> {
    let mut report = ImportReport::default();
    table.record_separators(&mut report);
    let mut warnings = import_warnings("the table", &report);
    let is_other = |name: &&String| !name.is_empty() && !columns.contains(&name.as_str());
    let others: Vec<String> = table
        .header()
        .iter()
        .filter(is_other)
        .map(|name| format!("`{}`", name.escape_debug()))
        .collect();
    // Tables of recorded runs have columns of their own.
    if !others.is_empty() && !table.header().iter().any(|name| RUN_COLUMNS.contains(&name.as_str()))
    {
        let listed = others.iter().take(MAX_LISTED_COLUMNS).cloned().collect::<Vec<_>>().join(", ");
        let more = if others.len() > MAX_LISTED_COLUMNS { ", ..." } else { "" };
        warnings.push(format!("the table: not used: columns {listed}{more}"));
    }
    warnings
}

/// Maximum number of columns that a warning names.
const MAX_LISTED_COLUMNS: usize = 8;
/// Columns that only tables of recorded runs have.
const RUN_COLUMNS: [&str; 2] = ["cycle", "seed"];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn options_that_mean_nothing_are_refused() {
        let refused = [
            EstimateOptions { alpha: -0.1, ..Default::default() },
            EstimateOptions { alpha: f64::NAN, ..Default::default() },
            EstimateOptions { alpha: 1e308, ..Default::default() },
            EstimateOptions { hold_out_every: 1, ..Default::default() },
            EstimateOptions { max_unexplained: 5.0, ..Default::default() },
        ];
        assert!(refused.iter().all(|options| options.check().is_err()));
        assert!(EstimateOptions::default().check().is_ok());
    }
}
