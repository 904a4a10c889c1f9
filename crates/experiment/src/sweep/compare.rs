//! A variant against the baseline, on the same replicates.

use super::groups::RunGroups;
use super::table::RunColumn;
use serde::Serialize;
use sidestep_kernel::ports::Values;
use sidestep_statistics::{Bootstrap, Interval, Pairs, holm};

/// Difference between a variant and the baseline in one metric, over pairs of equal replicates.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Comparison {
    /// The variant.
    pub variant: String,
    /// The variant that it is compared with.
    pub baseline: String,
    /// Whether seeds change neither: there is one pair, and no interval.
    pub seedless: bool,
    /// Number of pairs in which both have a value.
    pub pairs: usize,
    /// Number of replicates in which only one has a value.
    pub incomplete: usize,
    /// Mean of variant minus baseline.
    pub difference: Option<f64>,
    /// Student's 95 % confidence interval of the difference.
    pub interval: Option<Interval>,
    /// The bootstrap's 95 % confidence interval of the difference.
    pub bootstrap: Option<Interval>,
    /// Mean of the variant divided by the mean of the baseline, if no value is negative and the
    /// baseline's mean is well away from 0.
    pub ratio: Option<f64>,
    /// Fieller's 95 % confidence interval of the ratio.
    pub ratio_interval: Option<Interval>,
    /// The bootstrap's 95 % confidence interval of the ratio.
    pub ratio_bootstrap: Option<Interval>,
    /// Number of pairs in which the variant is lower.
    pub lower: usize,
    /// Number of pairs in which both are equal.
    pub equal: usize,
    /// Number of pairs in which the variant is higher.
    pub higher: usize,
    /// P-value of no difference: Student's paired test; for a share the exact sign test, which is
    /// McNemar's.
    pub p: Option<f64>,
    /// The same p-value, adjusted by Holm over all variants compared in this metric.
    pub p_holm: Option<f64>,
    /// P-value of the exact sign test, which makes no assumption about the distribution; not
    /// adjusted.
    pub p_sign: Option<f64>,
}

/// The baseline of each variant.
pub(super) struct BaselineIndex {
    /// Its name in tables.
    pub(super) name: String,
    /// The variant that each variant is compared with, if there is one.
    pub(super) of: Vec<Option<usize>>,
}

/// Returns the comparison of every variant with that which corresponds to it, in one metric.
pub(super) fn comparisons(
    groups: &RunGroups<'_>,
    metric: &RunColumn,
    reference: &BaselineIndex,
    bootstrap: Option<&Bootstrap>,
) -> Vec<Comparison> {
    let is_share = matches!(metric.values, Values::Bool(_));
    let pairs_of = |variant: usize| {
        let baseline = reference.of[variant]?;
        let (own, base) =
            (groups.by_replicate(metric, variant), groups.by_replicate(metric, baseline));
        // Where seeds change neither, there is one pair; replicates that neither has are none.
        let seedless = groups.seedless[variant] && groups.seedless[baseline];
        let most = if seedless { 1 } else { usize::MAX };
        let there = own.iter().zip(&base).take(most).filter(|(a, b)| a.is_some() || b.is_some());
        let (own, base): (Vec<_>, Vec<_>) = there.map(|(a, b)| (*a, *b)).unzip();
        let names = [variant, baseline].map(|v| groups.variants[v].clone());
        let compared = compare_pairs(names, &Pairs::from_columns(&own, &base), is_share, bootstrap);
        Some(Comparison { seedless, ..compared })
    };
    let mut all: Vec<Comparison> = (0..groups.variants.len()).filter_map(pairs_of).collect();
    let adjusted = holm(&all.iter().map(|c| c.p).collect::<Vec<_>>());
    all.iter_mut().zip(adjusted).for_each(|(c, p)| c.p_holm = p);
    all
}

fn compare_pairs(
    [variant, baseline]: [String; 2],
    pairs: &Pairs,
    is_share: bool,
    bootstrap: Option<&Bootstrap>,
) -> Comparison {
    let (lower, equal, higher) = pairs.sign_counts();
    let ratio = pairs.ratio();
    Comparison {
        variant,
        baseline,
        seedless: false,
        pairs: pairs.n(),
        incomplete: pairs.incomplete(),
        difference: pairs.difference(),
        interval: pairs.difference_interval(),
        bootstrap: bootstrap.and_then(|b| pairs.difference_bootstrap(b)),
        ratio: ratio.map(|(ratio, _)| ratio),
        ratio_interval: ratio.map(|(_, interval)| interval),
        ratio_bootstrap: bootstrap.and_then(|b| pairs.ratio_bootstrap(b)),
        lower,
        equal,
        higher,
        p: if is_share { pairs.sign_p_value() } else { pairs.p_value() },
        p_holm: None,
        p_sign: pairs.sign_p_value(),
    }
}
