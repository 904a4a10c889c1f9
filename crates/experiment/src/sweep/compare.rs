//! A variant against the baseline, on the same replicates.

use super::groups::RunGroups;
use super::table::RunColumn;
use serde::Serialize;
use sidestep_kernel::ports::ColumnValues;
use sidestep_statistics::{Bootstrap, Interval, Pairs};

/// Difference between a variant and the baseline in one metric, over pairs of equal replicates.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Comparison {
    /// Name of the variant in tables.
    pub variant: String,
    /// The variant that it is compared with.
    pub baseline: String,
    /// Whether seeds change nothing that metrics show in either: there is one pair, and no interval.
    pub seedless: bool,
    /// Number of pairs in which both have a value.
    pub pairs: usize,
    /// Number of replicates in which only one has a value.
    pub incomplete: usize,
    /// Mean of variant minus baseline.
    pub difference: Option<f64>,
    /// Student's 95 % confidence interval of the difference; absent where all pairs are equal but for rounding.
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
    /// McNemar's. Absent for fewer than 5 pairs, and where all are equal but for rounding.
    pub p: Option<f64>,
    /// The same p-value, adjusted by Holm over all comparisons of all metrics of the summary.
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

/// Returns the comparison of every variant with that which corresponds to it, in one metric, without adjusted p-values.
pub(super) fn comparisons(
    groups: &RunGroups<'_>,
    metric: &RunColumn,
    reference: &BaselineIndex,
    bootstrap: Option<&Bootstrap>,
) -> Vec<Comparison> {
    let is_share = matches!(metric.values, ColumnValues::Bool(_));
    let mut all = Vec::new();
    for variant in 0..groups.variants.len() {
        let Some(baseline) = reference.of[variant] else { continue };
        let pairs = pairs_of(groups, metric, variant, baseline);
        let names = [variant, baseline].map(|v| groups.variants[v].clone());
        let comparison = compare_pairs(names, &pairs, is_share, bootstrap);
        let seedless = groups.seedless[variant] && groups.seedless[baseline];
        all.push(Comparison { seedless, ..comparison });
    }
    all
}

/// Returns the values of a variant and its baseline, replicate by replicate. Where seeds change neither, there is one
/// pair; replicates that neither has are none.
fn pairs_of(groups: &RunGroups<'_>, metric: &RunColumn, variant: usize, baseline: usize) -> Pairs {
    let seedless = groups.seedless[variant] && groups.seedless[baseline];
    let max_pairs = if seedless { 1 } else { usize::MAX };
    let of_variant = groups.by_replicate(metric, variant);
    let of_baseline = groups.by_replicate(metric, baseline);
    let (of_variant, of_baseline): (Vec<_>, Vec<_>) = of_variant
        .into_iter()
        .zip(of_baseline)
        .take(max_pairs)
        .filter(|(a, b)| a.is_some() || b.is_some())
        .unzip();
    Pairs::from_columns(&of_variant, &of_baseline)
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
        ratio_interval: ratio.and_then(|(_, interval)| interval),
        ratio_bootstrap: bootstrap.and_then(|b| pairs.ratio_bootstrap(b)),
        lower,
        equal,
        higher,
        // Differences of yes and no are far from normal; the exact sign test (McNemar's) needs no distribution.
        p: if is_share { pairs.sign_p_value() } else { pairs.p_value() },
        p_holm: None,
        p_sign: pairs.sign_p_value(),
    }
}
