//! Options of a summary.

use super::front::Aim;
use sidestep_scenario::MetricInfo;
use sidestep_statistics::Bootstrap;
use std::collections::{BTreeMap, BTreeSet};

/// What a summary shows, and with which names and intervals.
#[derive(Debug, Clone, PartialEq)]
pub struct SummaryOptions {
    /// Metrics to show, in this order; `None` for the default order of the module.
    pub metrics: Option<Vec<String>>,
    /// Largest number of metrics shown if none are requested.
    pub max_metrics: usize,
    /// The baseline of variants; `None` for the first variant, but for nothing in grids of
    /// several parameters and in scattered designs, where the first is like no other.
    pub against: Option<BaselineChoice>,
    /// Two metrics with the values that are better, of which a figure shows the front; or none.
    pub better: Vec<Aim>,
    /// Names of the variants, where the table has their numbers.
    pub names: Option<Vec<String>>,
    /// Variants in which seeds change nothing: their one value has no interval.
    pub seedless: BTreeSet<String>,
    /// The note on variants in which somebody knows what no agent could, for tables and figures.
    pub privilege_note: Option<String>,
    /// Resamples, coverage and seed of bootstrap intervals.
    pub bootstrap: Bootstrap,
    /// The metrics that the world is about: where variants differ in them, they come before all others.
    pub central_metrics: &'static [&'static str],
    /// The metrics in words.
    pub meanings: &'static [MetricInfo],
}

/// What the variants are compared with.
#[derive(Debug, Clone, PartialEq)]
pub enum BaselineChoice {
    /// One variant for all others, by its name in tables.
    Variant(String),
    /// Each with a variant of its own.
    Matched {
        /// The name of these in tables.
        name: String,
        /// The names of variants, and of those that they are compared with.
        of: BTreeMap<String, String>,
        /// Number of variants to which none corresponds.
        alone: usize,
    },
}

impl Default for SummaryOptions {
    fn default() -> Self {
        Self {
            metrics: None,
            better: Vec::new(),
            names: None,
            // As many as one looks through; the others are listed as left out.
            max_metrics: 12,
            against: None,
            seedless: BTreeSet::new(),
            privilege_note: None,
            bootstrap: Bootstrap::default(),
            central_metrics: &[],
            meanings: &[],
        }
    }
}
