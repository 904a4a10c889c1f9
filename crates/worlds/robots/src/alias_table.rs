//! The readings of a sensor, ready to be drawn.

use super::sensor::{NOTHING, Reading, SensorModel};
use sidestep_kernel::distr::{DistributionError, check_probability_row};

/// Stands for the class of a sector in which nothing is reported; greater than any class.
pub const UNSEEN: u8 = u8::MAX;

/// The joint distribution of readings, ready to be drawn from with one word and no branch.
///
/// Each true reading has a row of `2^bits` columns of equal probability; a column is split
/// between at most two reports (Walker's alias method, built by Vose's algorithm). A report
/// has its probability within 2^-31.
#[derive(Debug, Clone)]
pub(crate) struct AliasTable {
    classes: usize,
    bits: u32,
    columns: Box<[AliasColumn]>,
    /// Whether every reading is the truth, so that no draw is needed.
    pub(crate) reliable: bool,
}

/// A true reading's row in a [`AliasTable`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct RowIndex(u32);

/// One column of a row: below the threshold the first reading is reported, else the second.
#[derive(Debug, Clone, Copy)]
struct AliasColumn {
    threshold: u32,
    reports: [SampledReading; 2],
}

impl AliasColumn {
    /// Returns a column that reports one reading only.
    fn whole(reading: Reading) -> Self {
        Self { threshold: u32::MAX, reports: [SampledReading::from(reading); 2] }
    }
}

/// A drawn reading, with its nearness.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct SampledReading {
    /// The report as the robot perceives it.
    pub(crate) reading: Reading,
    /// Its distance class, or [`UNSEEN`] where nothing is reported.
    pub(crate) nearness: u8,
}

impl From<Reading> for SampledReading {
    fn from(reading: Reading) -> Self {
        let nearness = if reading.observation == NOTHING { UNSEEN } else { reading.class };
        Self { reading, nearness }
    }
}

impl AliasTable {
    /// Prepares the table of a sensor.
    ///
    /// # Errors
    /// Returns an error when a row is not a distribution; scenarios check that earlier and say
    /// where.
    pub(crate) fn new(sensor: &SensorModel, reliable: bool) -> Result<Self, DistributionError> {
        let classes = sensor.distance_classes.len() + 1;
        let observations = sensor.observations.len();
        // Nothing, or one of the other observations in one of the classes but `beyond`. A power of 2, so that
        // the highest bits of a word are a column.
        let max_reports = 1 + (observations - 1) * (classes - 1);
        let bits = max_reports.next_power_of_two().ilog2();
        let mut columns = Vec::with_capacity((observations * classes) << bits);
        for observation in 0..observations as u8 {
            for class in 0..classes as u8 {
                let row = sensor.reading_row(Reading { observation, class }, reliable);
                check_probability_row(&row.iter().map(|r| r.1).collect::<Vec<_>>())?;
                columns.extend(alias_columns(row, 1 << bits));
            }
        }
        Ok(Self { classes, bits, columns: columns.into(), reliable })
    }

    /// Rows are ordered by observation, then by class.
    #[inline]
    pub(crate) fn row(&self, truth: Reading) -> RowIndex {
        let row = usize::from(truth.observation) * self.classes + usize::from(truth.class);
        RowIndex((row << self.bits) as u32)
    }

    /// The inverse of [`Self::row`], for logs that keep the truth beside the report.
    pub(crate) fn truth(&self, row: RowIndex) -> Reading {
        let row = row.0 as usize >> self.bits;
        Reading { observation: (row / self.classes) as u8, class: (row % self.classes) as u8 }
    }

    /// Returns the report for the true reading of `row`, drawn with the uniform word `u`.
    #[inline]
    pub(crate) fn sample(&self, row: RowIndex, u: u32) -> SampledReading {
        // The highest bits choose the column, the others are compared with its threshold.
        let column = (u64::from(u) << self.bits >> 32) as usize;
        let split = &self.columns[row.0 as usize | column];
        split.reports[usize::from(u << self.bits >= split.threshold)]
    }
}

/// Returns the columns of a row, `n` of them with probability 1/n each.
fn alias_columns(mut row: Vec<(Reading, f64)>, n: usize) -> Vec<AliasColumn> {
    let padding = row[0].0;
    row.resize(n, (padding, 0.0));
    let mut weights: Vec<f64> = row.iter().map(|(_, p)| p * n as f64).collect();
    let (mut small, mut large): (Vec<usize>, Vec<usize>) = (0..n).partition(|&i| weights[i] < 1.0);
    let mut columns: Vec<AliasColumn> =
        row.iter().map(|&(reading, _)| AliasColumn::whole(reading)).collect();
    while let (Some(&of), Some(from)) = (small.last(), large.last().copied()) {
        small.pop();
        let threshold = (weights[of] * (1u64 << 32) as f64).round() as u32;
        columns[of] = AliasColumn { threshold, reports: [row[of].0.into(), row[from].0.into()] };
        weights[from] -= 1.0 - weights[of];
        if weights[from] < 1.0 {
            large.pop();
            small.push(from);
        }
    }
    // The columns that are left are full but for rounding. An impossible reading must not be among
    // them, because its whole column would report it.
    for i in small.into_iter().filter(|&i| row[i].1 == 0.0) {
        columns[i] = columns[(0..n).max_by(|&a, &b| row[a].1.total_cmp(&row[b].1)).unwrap_or(i)];
        columns[i].reports[0] = columns[i].reports[1];
    }
    columns
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_columns_of_a_row_hold_its_probabilities(weights in prop::collection::vec(0u32..100, 1..16)) {
            let sum: u32 = weights.iter().sum();
            prop_assume!(sum > 0);
            let row: Vec<_> = weights
                .iter()
                .enumerate()
                .map(|(i, &w)| (Reading { observation: i as u8, class: 0 }, f64::from(w) / f64::from(sum)))
                .collect();
            let columns = alias_columns(row.clone(), 16);
            let mut held = [0.0; 16];
            for split in &columns {
                let low = f64::from(split.threshold) / (1u64 << 32) as f64;
                let [below, above] = split.reports.map(|r| usize::from(r.reading.observation));
                let is_full = below == above;
                held[below] += if is_full { 1.0 } else { low };
                held[above] += if is_full { 0.0 } else { 1.0 - low };
            }
            for (i, (_, p)) in row.iter().enumerate() {
                prop_assert!((held[i] / 16.0 - p).abs() < 1e-8);
                prop_assert!(*p > 0.0 || held[i] == 0.0);
            }
        }
    }
}
