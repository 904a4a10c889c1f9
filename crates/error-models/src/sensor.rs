//! Sensors that err: the true reading of a beam, and the reading that it reports.
//!
//! Source: the paper's perception model (confusion matrix over observations, distance
//! classes with a confusion matrix of their own). Both draws, observation and class, are
//! independent given the true pair, so they are one draw from their joint distribution.

use super::beam::BeamModel;
use super::ray::reaches;
use serde::{Deserialize, Serialize};

/// Index of the observation `nothing`, always the first.
pub const NOTHING: u8 = 0;

/// Index of the observation of a sensor that measures ranges: something, whatever it is.
pub const ANYTHING: u8 = 1;

/// The kind of an empty box.
pub const FREE: u8 = 0;
/// The kind of the static map's walls.
pub const WALL: u8 = 1;

/// One beam's report: an observation of its sensor and a distance class.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
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
    /// The model of ranges of a sensor that measures in meters: its reports come from there, and its matrices report
    /// the truth. Such a sensor has two observations: nothing, and anything.
    pub beam: Option<BeamModel>,
}

impl SensorModel {
    /// Returns the class of a distance in boxes of side `box_size_m`. A distance equal to an edge is
    /// in the upper class.
    pub fn class_of(&self, distance: f64, box_size_m: f64) -> u8 {
        let edges_m = self.distance_edges_m.iter();
        edges_m.filter(|&&edge_m| reaches(distance, edge_m / box_size_m)).count() as u8
    }

    /// Returns the class that stands for "nothing in range".
    pub fn beyond(&self) -> u8 {
        self.distance_classes.len() as u8
    }

    /// Returns `P(reported | true)` over all readings, or the certain reading where `reliable`.
    ///
    /// A spurious report of something where there is nothing draws its class from the row
    /// `beyond`; a missed report has class `beyond`.
    pub fn reading_row(&self, truth: Reading, reliable: bool) -> Vec<(Reading, f64)> {
        if reliable {
            return vec![(truth, 1.0)];
        }
        let seen = &self.confusion[usize::from(truth.class)][usize::from(truth.observation)];
        let classes = &self.distance_confusion[usize::from(truth.class)];
        // All reports of nothing are one reading: there is no class to draw.
        let mut row = vec![(self.nothing(), seen[0])];
        for (observation, &p) in seen.iter().enumerate().skip(1) {
            for (class, &q) in classes.iter().enumerate() {
                let reading = Reading { observation: observation as u8, class: class as u8 };
                row.push((reading, p * q));
            }
        }
        row
    }

    /// Returns `P(reported | true)` of a sensor with a beam model, where something stands at `true_m`, or nothing within
    /// its range; `None` for a sensor with tables.
    pub fn ranged_row(&self, true_m: Option<f64>) -> Option<Vec<(Reading, f64)>> {
        let beam = self.beam?;
        let mut row = vec![(self.nothing(), beam.no_echo_probability(true_m))];
        for class in 0..self.distance_classes.len() {
            let from_m = class.checked_sub(1).map_or(0.0, |below| self.distance_edges_m[below]);
            let to_m = self.distance_edges_m.get(class).copied().unwrap_or(f64::INFINITY);
            let reading = Reading { observation: ANYTHING, class: class as u8 };
            row.push((reading, beam.probability_between(true_m, [from_m, to_m], self.range_m)));
        }
        Some(row)
    }

    /// Returns the reading that a measured range stands for, `None` being no echo.
    pub fn reading_of_range(&self, range_m: Option<f64>) -> Reading {
        let Some(range_m) = range_m else { return self.nothing() };
        let class = self.distance_edges_m.iter().filter(|&&edge_m| range_m >= edge_m).count();
        Reading { observation: ANYTHING, class: class as u8 }
    }

    /// Returns the names of a reading's observation and class.
    pub fn names_of(&self, reading: Reading) -> (&str, &str) {
        let observation = &self.observations[usize::from(reading.observation)];
        let class = self.distance_classes.get(usize::from(reading.class));
        (observation, class.map_or("beyond", String::as_str))
    }

    /// Returns the reading of a beam that reports nothing.
    pub fn nothing(&self) -> Reading {
        Reading { observation: NOTHING, class: self.beyond() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ray::crossings;

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
            beam: None,
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
            }
        }
    }

    #[test]
    fn a_distance_off_an_edge_is_where_it_belongs() {
        let sensor = with_edges(vec![0.3, 1.5]);
        let classes = [0.0, 1.0, 1.19, 1.2, 1.3, 5.99, 6.0, 9.0].map(|d| sensor.class_of(d, 0.25));
        assert_eq!(classes, [0, 0, 0, 1, 1, 1, 2, 2]);
    }
}
