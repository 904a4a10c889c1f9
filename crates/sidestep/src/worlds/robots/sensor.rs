//! Sensors that confuse: what a beam truly meets, and what it reports.
//!
//! Source: the paper's perception model (confusion matrix over observations, distance
//! classes with a confusion matrix of their own). Both draws, observation and class, are
//! independent given the true pair, so they are one draw from their joint distribution.

use sidestep_kernel::distr::{Categorical, RowError};

/// Index of the observation `nothing`, always the first.
pub const NOTHING: u8 = 0;

/// What one beam reports: an observation of its sensor and a distance class.
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
    /// Farthest distance from the body's boundary at which something is met, in metres
    /// (exclusive).
    pub range_m: f64,
    /// Observations; the first is `nothing`.
    pub observations: Vec<String>,
    /// `confusion[class][true][reported]`; one matrix per true class, `beyond` the last.
    pub confusion: Vec<Vec<Vec<f64>>>,
    /// Interior edges of the distance classes in metres, rising; a class is closed below.
    pub distance_edges_m: Vec<f64>,
    /// Names of the classes, near to far: one more than edges.
    pub distance_classes: Vec<String>,
    /// `distance_confusion[true class][reported class]`; the last row is `beyond`.
    pub distance_confusion: Vec<Vec<f64>>,
    /// True observation of each kind (shape: kinds of the scenario).
    pub designates: Vec<u8>,
}

impl SensorModel {
    /// The class of a distance in metres.
    pub fn class_of(&self, distance_m: f64) -> u8 {
        self.distance_edges_m.iter().filter(|&&edge| edge <= distance_m).count() as u8
    }

    /// The class that stands for "nothing in range".
    pub fn beyond(&self) -> u8 {
        self.distance_classes.len() as u8
    }

    /// `P(reported | true)` over all readings, or the certain reading where `reliable`.
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

    /// The reading of a beam that reports nothing.
    pub fn nothing(&self) -> Reading {
        Reading { observation: NOTHING, class: self.beyond() }
    }
}

/// The joint distribution of readings, ready to draw from.
#[derive(Debug, Clone)]
pub struct ReadingTable {
    classes: usize,
    rows: Vec<Row>,
    /// True when every reading is the truth and no draw is needed.
    pub reliable: bool,
}

#[derive(Debug, Clone)]
struct Row {
    outcomes: Vec<Reading>,
    distribution: Categorical,
}

impl ReadingTable {
    /// Prepares the table of a sensor.
    ///
    /// # Errors
    /// When a row is no distribution; scenarios check that earlier and say where.
    pub fn new(sensor: &SensorModel, reliable: bool) -> Result<Self, RowError> {
        let classes = sensor.distance_classes.len() + 1;
        let mut rows = Vec::new();
        for observation in 0..sensor.observations.len() as u8 {
            for class in 0..classes as u8 {
                rows.push(Row::new(sensor, Reading { observation, class }, reliable)?);
            }
        }
        Ok(Self { classes, rows, reliable })
    }

    /// What is reported for `truth` with the uniform word `u`.
    #[inline]
    pub fn report(&self, truth: Reading, u: u32) -> Reading {
        let row =
            &self.rows[usize::from(truth.observation) * self.classes + usize::from(truth.class)];
        row.outcomes[row.distribution.sample(u)]
    }
}

impl Row {
    /// The likeliest outcome comes first, since a draw compares from the front.
    fn new(sensor: &SensorModel, truth: Reading, reliable: bool) -> Result<Self, RowError> {
        let mut row = sensor.reading_row(truth, reliable);
        row.sort_by(|a, b| b.1.total_cmp(&a.1));
        let probabilities: Vec<f64> = row.iter().map(|r| r.1).collect();
        let outcomes = row.into_iter().map(|r| r.0).collect();
        Ok(Self { outcomes, distribution: Categorical::new(&probabilities)? })
    }
}
