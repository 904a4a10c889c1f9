//! Sensors that err: the true reading of a beam, and the reading that it reports.
//!
//! Source: the paper's perception model (confusion matrix over observations, distance
//! classes with a confusion matrix of their own). Both draws, observation and class, are
//! independent given the true pair, so they are one draw from their joint distribution.

use super::ray::reaches;
use sidestep_kernel::distr::{RowError, check_row};

/// Stands for the class of a sector in which nothing is reported; greater than any class.
pub const UNSEEN: u8 = u8::MAX;

/// Index of the observation `nothing`, always the first.
pub const NOTHING: u8 = 0;

/// One beam's report: an observation of its sensor and a distance class.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Reading {
    /// Index into the sensor's observations; 0 is `nothing`.
    pub observation: u8,
    /// Distance class, 0 the nearest; the number of classes stands for `beyond`.
    pub class: u8,
}

/// A sensor type as data.
#[derive(Debug, Clone, PartialEq)]
pub struct SensorModel {
    /// Name in the scenario.
    pub name: String,
    /// Bearings of the beams relative to the heading, degrees, positive to the left.
    pub bearings_deg: Vec<f64>,
    /// Distance in meters from the body's boundary (exclusive) up to which obstacles are met.
    pub range_m: f64,
    /// Observations; the first is `nothing`.
    pub observations: Vec<String>,
    /// `confusion[class][true][reported]`; one matrix per true class, the last for `beyond`.
    pub confusion: Vec<Vec<Vec<f64>>>,
    /// Interior edges of the distance classes in meters, rising; a class is closed below.
    pub distance_edges_m: Vec<f64>,
    /// Names of the classes, near to far: one more than there are edges.
    pub distance_classes: Vec<String>,
    /// `distance_confusion[true class][reported class]`; the last row is `beyond`.
    pub distance_confusion: Vec<Vec<f64>>,
    /// True observation of each kind of the scenario.
    pub designates: Vec<u8>,
}

impl SensorModel {
    /// Returns the class of a distance in boxes of side `box_size_m`. A distance equal to an edge is
    /// in the upper class.
    pub fn class_of(&self, distance: f64, box_size_m: f64) -> u8 {
        let is_beyond = |&&edge_m: &&f64| reaches(distance, edge_m / box_size_m);
        self.distance_edges_m.iter().filter(is_beyond).count() as u8
    }

    /// Returns the class that stands for "nothing in range".
    pub fn beyond(&self) -> u8 {
        self.distance_classes.len() as u8
    }

    /// Returns `P(reported
    /// true)` over all readings, or the certain reading where `reliable`.
    ///
    /// A spurious report of something where there is nothing draws its class from the row
    /// `beyond`; a missed report has class `beyond`.
    pub fn reading_row(&self, truth: Reading, reliable: bool) -> Vec<(Reading, f64)> {
        if reliable {
            return vec![(truth, 1.0)];
        }
        let seen = &self.confusion[usize::from(truth.class)][usize::from(truth.observation)];
        let classes = &self.distance_confusion[usize::from(truth.class)];
        let mut row = vec![(self.nothing(), seen[0])];
        for (observation, &p) in seen.iter().enumerate().skip(1) {
            for (class, &q) in classes.iter().enumerate() {
                let reading = Reading { observation: observation as u8, class: class as u8 };
                row.push((reading, p * q));
            }
        }
        row
    }

    /// Returns the reading of a beam that reports nothing.
    pub fn nothing(&self) -> Reading {
        Reading { observation: NOTHING, class: self.beyond() }
    }
}

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

/// A drawn reading, with its nearness.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct SampledReading {
    /// The reading.
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
    pub(crate) fn new(sensor: &SensorModel, reliable: bool) -> Result<Self, RowError> {
        let classes = sensor.distance_classes.len() + 1;
        let observations = sensor.observations.len();
        let most = 1 + (observations - 1) * (classes - 1);
        let bits = most.next_power_of_two().ilog2();
        let mut columns = Vec::with_capacity((observations * classes) << bits);
        for observation in 0..observations as u8 {
            for class in 0..classes as u8 {
                let row = sensor.reading_row(Reading { observation, class }, reliable);
                check_row(&row.iter().map(|r| r.1).collect::<Vec<_>>())?;
                columns.extend(alias_columns(row, 1 << bits));
            }
        }
        Ok(Self { classes, bits, columns: columns.into(), reliable })
    }

    /// Returns the row of a true reading.
    #[inline]
    pub(crate) fn row(&self, truth: Reading) -> RowIndex {
        let row = usize::from(truth.observation) * self.classes + usize::from(truth.class);
        RowIndex((row << self.bits) as u32)
    }

    /// Returns the true reading of a row.
    pub(crate) fn truth(&self, row: RowIndex) -> Reading {
        let row = row.0 as usize >> self.bits;
        Reading { observation: (row / self.classes) as u8, class: (row % self.classes) as u8 }
    }

    /// Returns the report for the true reading of `row`, drawn with the uniform word `u`.
    #[inline]
    pub(crate) fn sample(&self, row: RowIndex, u: u32) -> SampledReading {
        let column = (u64::from(u) << self.bits >> 32) as usize;
        let split = &self.columns[row.0 as usize | column];
        split.reports[usize::from(u << self.bits >= split.threshold)]
    }
}

/// Returns the columns of a row, `n` of them with probability 1/n each.
fn alias_columns(mut row: Vec<(Reading, f64)>, n: usize) -> Vec<AliasColumn> {
    let padding = row[0].0;
    row.resize(n, (padding, 0.0));
    let mut weights: Vec<f64> = row.iter().map(|r| r.1 * n as f64).collect();
    let (mut small, mut large): (Vec<usize>, Vec<usize>) = (0..n).partition(|&i| weights[i] < 1.0);
    let full =
        |reading| AliasColumn { threshold: u32::MAX, reports: [SampledReading::from(reading); 2] };
    let mut columns: Vec<AliasColumn> = row.iter().map(|r| full(r.0)).collect();
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
    use crate::ray::crossings;
    use crate::world::Radio;
    use proptest::prelude::*;

    fn with_edges(distance_edges_m: Vec<f64>) -> SensorModel {
        SensorModel {
            name: "ruler".into(),
            bearings_deg: vec![0.0],
            range_m: 1.0,
            observations: vec!["nothing".into()],
            confusion: Vec::new(),
            distance_classes: vec![String::new(); distance_edges_m.len() + 1],
            distance_edges_m,
            distance_confusion: Vec::new(),
            designates: Vec::new(),
        }
    }

    /// Every edge at a whole number of boxes, for the sides of boxes that people write.
    #[test]
    fn a_distance_equal_to_an_edge_is_in_the_upper_class_for_every_side_of_a_box() {
        for side_mm in (10..=500).step_by(5) {
            let side_m = f64::from(side_mm) / 1000.0;
            for boxes in 1..=60 {
                let edge_m = f64::from(boxes * side_mm) / 1000.0;
                let sensor = with_edges(vec![edge_m]);
                let classes = [boxes - 1, boxes].map(|k| sensor.class_of(f64::from(k), side_m));
                assert_eq!(classes, [0, 1], "{boxes} boxes of {side_m} m");
                assert_eq!(crossings(1, 0.0, edge_m / side_m).len(), boxes as usize);
                let reach2 = Radio::new(edge_m, side_m, 0.0).reach2_half_boxes;
                assert_eq!(reach2, (4 * boxes * boxes) as u64, "{boxes} boxes of {side_m} m");
            }
        }
    }

    #[test]
    fn a_distance_off_an_edge_is_where_it_belongs() {
        let sensor = with_edges(vec![0.3, 1.5]);
        let classes = [0.0, 1.0, 1.19, 1.2, 1.3, 5.99, 6.0, 9.0].map(|d| sensor.class_of(d, 0.25));
        assert_eq!(classes, [0, 0, 0, 1, 1, 1, 2, 2]);
    }

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
