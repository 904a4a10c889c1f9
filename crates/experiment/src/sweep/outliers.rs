//! Runs that lie far from the other runs of their variant.

use super::table::{Role, RunColumn, RunTable};
use sidestep_statistics::{is_tied_measure, percentile};
use std::collections::BTreeMap;

/// The rule by which a run is an outlier, in words.
pub const OUTLIER_RULE: &str = "A run is an outlier in a metric if its value lies more than 1.5 interquartile ranges \
    outside the quartiles of the runs of its variant (Tukey's rule, that of the whiskers of boxes), in variants of 5 or \
    more runs. Where more than three quarters of the runs agree, every other value is one.";

/// Least number of runs of a variant among which one can be an outlier.
const MIN_RUNS: usize = 5;
/// Distance from the quartiles in interquartile ranges beyond which a value is an outlier.
const FENCE_RANGES: f64 = 1.5;
/// Relative difference of two values that may come from rounding alone.
const MAX_ROUNDING: f64 = 1e-9;

/// A value of a run that is far from those of the other runs of its variant.
#[derive(Debug, Clone, PartialEq)]
pub struct Outlier {
    /// The row of the run in the table.
    pub row: usize,
    /// The name of the metric.
    pub metric: String,
    /// Whether it is above the others.
    pub is_high: bool,
    /// The median of the variant's runs.
    pub median: f64,
    /// The distance from the nearer quartile in interquartile ranges; infinite where the quartiles are equal.
    pub distance_ranges: f64,
}

/// Returns the outliers of some metrics, by metric in that order, and by row.
pub fn outliers(table: &RunTable, metrics: &[&str]) -> Vec<Outlier> {
    let rows_of = rows_by_variant(table);
    let mut found = Vec::new();
    for metric in metrics {
        let mut columns = table.columns_with_role(Role::Metric);
        let Some(column) = columns.find(|column| column.name == *metric) else { continue };
        let mut of_metric: Vec<Outlier> =
            rows_of.values().flat_map(|rows| outliers_of_variant(column, rows)).collect();
        of_metric.sort_by_key(|outlier| outlier.row);
        found.extend(of_metric);
    }
    found
}

/// Returns the rows of each variant.
fn rows_by_variant(table: &RunTable) -> BTreeMap<String, Vec<usize>> {
    let variant = table.columns_with_role(Role::Variant).next();
    let mut rows: BTreeMap<String, Vec<usize>> = BTreeMap::new();
    for row in 0..table.runs() {
        let name = variant.map_or_else(String::new, |column| column.values.text(row));
        rows.entry(name).or_default().push(row);
    }
    rows
}

fn outliers_of_variant(column: &RunColumn, rows: &[usize]) -> Vec<Outlier> {
    let value_of = |row: usize| column.values.number(row).filter(|value| value.is_finite());
    let values: Vec<(usize, f64)> =
        rows.iter().filter_map(|&row| Some((row, value_of(row)?))).collect();
    let mut sorted: Vec<f64> = values.iter().map(|(_, value)| *value).collect();
    sorted.sort_by(f64::total_cmp);
    // A spread of rounding makes no run special.
    if sorted.len() < MIN_RUNS || is_tied_measure(&sorted) {
        return Vec::new();
    }
    let [Some(first), Some(median), Some(third)] =
        [0.25, 0.5, 0.75].map(|q| percentile(&sorted, q))
    else {
        return Vec::new();
    };
    let range = third - first;
    let outlier = |(row, value): (usize, f64)| {
        let beyond = (value - third).max(first - value);
        // Where most runs agree, another one is not special by its rounding alone.
        let rounding = MAX_ROUNDING * first.abs().max(third.abs()).max(value.abs());
        if beyond <= FENCE_RANGES * range || beyond <= rounding {
            return None;
        }
        Some(Outlier {
            row,
            metric: column.name.clone(),
            is_high: value > third,
            median,
            distance_ranges: beyond / range,
        })
    };
    values.into_iter().filter_map(outlier).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use sidestep_kernel::ports::ColumnValues;

    /// A table of runs of variant 0, and of as many of variant 1 that are all equal.
    fn table(values: &[f64]) -> RunTable {
        let n = values.len() as i64;
        let column = |name: &str, role, values| RunColumn { name: name.into(), role, values };
        let variants = (0..2 * n).map(|row| Some(row / n)).collect();
        let hops = values.iter().copied().chain(values.iter().map(|_| 4.0)).map(Some).collect();
        RunTable {
            columns: vec![
                column("variant", Role::Variant, ColumnValues::I64(variants)),
                column("hops", Role::Metric, ColumnValues::F64(hops)),
            ],
        }
    }

    fn rows(values: &[f64]) -> Vec<(usize, bool)> {
        let found = outliers(&table(values), &["hops", "none"]);
        found.iter().map(|outlier| (outlier.row, outlier.is_high)).collect()
    }

    #[test]
    fn values_beyond_the_whiskers_of_a_box_are_outliers_on_their_side() {
        assert_eq!(rows(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 90.0]), [(8, true)]);
        assert_eq!(rows(&[-90.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 13.0]), [(0, false)]);
        // The quartiles are 3 and 7: 13 is 1.5 ranges above, and not beyond.
        assert_eq!(rows(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 13.0]), []);
        assert_eq!(rows(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 13.1]), [(8, true)]);
    }

    #[test]
    fn where_nearly_all_agree_every_other_value_is_an_outlier() {
        let all = outliers(&table(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0]), &["hops"]);
        assert_eq!(all.len(), 1, "{all:?}");
        assert_eq!((all[0].row, all[0].distance_ranges, all[0].median), (3, f64::INFINITY, 0.0));
        assert_eq!(rows(&[0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 0.0]), []);
    }

    #[test]
    fn few_runs_rounding_and_missing_values_make_no_outlier() {
        assert_eq!(rows(&[1.0, 1.0, 1.0, 90.0]), []);
        let third = 1.0 / 3.0;
        assert_eq!(rows(&[third, third, third, third, third, third + 1e-16]), []);
        assert_eq!(rows(&[third, third, third, third, third + 1e-16, 5.0]), [(5, true)]);
        assert_eq!(rows(&[1.0, 1.0, 1.0, 1.0, f64::NAN, 9.0]), [(5, true)]);
    }
}
