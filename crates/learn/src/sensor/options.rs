//! Options of learning a sensor.

use crate::EstimateOptions;
use sidestep_kernel::InputError;

/// Largest number of distance classes; more are taken for a mistake: each has a row and a column of every table.
const MAX_CLASSES: usize = 64;

/// Options of learning a sensor; the default is the camera of the MRCLAM robots.
#[derive(Debug, Clone, PartialEq)]
pub struct SensorOptions {
    /// The rule by which counts become probabilities.
    pub estimate: EstimateOptions,
    /// Edges between distance classes in meters, increasing; `k` edges make `k + 1` classes. A
    /// class includes its lower edge. A leading 0 is allowed and adds no class.
    pub distance_edges_m: Vec<f64>,
    /// Names of the classes, near to far; `d0`, `d1`, ... when empty.
    pub distance_classes: Vec<String>,
    /// Bearings of the profile's beams in degrees relative to the heading, + to the left.
    pub bearings_deg: Vec<f64>,
    /// Range of the profile's sensor in meters.
    pub range_m: f64,
    /// Name of the sensor to learn, for a CSV file with several.
    pub sensor: Option<String>,
    /// Whether a table of ranges in meters, with one observation beside `nothing`, is also described by the four-part
    /// beam model; scans always are.
    pub beam: bool,
}

impl Default for SensorOptions {
    /// Returns the camera of the MRCLAM robots: 60 degrees wide, barcodes read up to 6.5 m.
    fn default() -> Self {
        Self {
            estimate: EstimateOptions::default(),
            distance_edges_m: vec![1.5, 2.5, 3.5, 4.5, 5.5],
            distance_classes: Vec::new(),
            bearings_deg: vec![-30.0, -20.0, -10.0, 0.0, 10.0, 20.0, 30.0],
            range_m: 6.5,
            sensor: None,
            beam: false,
        }
    }
}

impl SensorOptions {
    /// Edges and names of the distance classes are checked together, so the classes are made here.
    pub(super) fn check(&self) -> Result<DistanceClasses, InputError> {
        self.estimate.check()?;
        if !(self.range_m.is_finite() && self.range_m > 0.0) {
            let cause = format!("a range of {} m sees nothing", self.range_m);
            return Err(InputError::new("range_m", cause, "give a positive range"));
        }
        if self.bearings_deg.is_empty() || !self.bearings_deg.iter().all(|b| b.abs() <= 180.0) {
            let remedy = "give at least one bearing from -180 to 180 degrees";
            return Err(InputError::new("bearings_deg", "not a fan of beams", remedy));
        }
        DistanceClasses::new(&self.distance_edges_m, &self.distance_classes)
    }
}

/// Distances cut into classes, near to far.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct DistanceClasses {
    /// Edges between the classes, in meters.
    pub(super) edges_m: Vec<f64>,
    /// Names of the classes: one more than there are edges.
    pub(super) names: Vec<String>,
}

impl DistanceClasses {
    pub(super) fn new(edges_m: &[f64], names: &[String]) -> Result<Self, InputError> {
        let edges_m = edges_m.strip_prefix(&[0.0]).unwrap_or(edges_m).to_vec();
        let are_increasing = edges_m.windows(2).all(|pair| pair[0] < pair[1]);
        let are_positive = edges_m.iter().all(|edge| edge.is_finite() && *edge > 0.0);
        if !are_increasing || !are_positive || edges_m.len() >= MAX_CLASSES {
            let cause = format!("{edges_m:?} do not cut distances into classes");
            let remedy = "give fewer than 64 increasing, positive distances in m";
            return Err(InputError::new("distance edges", cause, remedy));
        }
        let names = match names {
            [] => (0..=edges_m.len()).map(|i| format!("d{i}")).collect(),
            names => names.to_vec(),
        };
        Self { edges_m, names }.with_checked_names()
    }

    fn with_checked_names(self) -> Result<Self, InputError> {
        let mut distinct: Vec<&String> = self.names.iter().collect();
        distinct.sort();
        distinct.dedup();
        let has_repeated = distinct.len() != self.names.len();
        let has_reserved = self.names.iter().any(|name| name.is_empty() || name == BEYOND);
        if self.names.len() != self.edges_m.len() + 1 || has_repeated || has_reserved {
            let cause = format!("{} edges and the classes {:?}", self.edges_m.len(), self.names);
            let remedy = "give one class more than there are edges, all different, none `beyond`";
            return Err(InputError::new("distance classes", cause, remedy));
        }
        Ok(self)
    }

    /// Returns the three classes that every report has, cut at [`THREE_EDGES_M`].
    pub(super) fn three_classes() -> Self {
        Self {
            edges_m: THREE_EDGES_M[1..].to_vec(),
            names: ["very_near", "near", "far"].map(String::from).to_vec(),
        }
    }

    pub(super) fn len(&self) -> usize {
        self.names.len()
    }

    /// Returns the class of a distance in meters; an edge belongs to the farther class.
    pub(super) fn class_of(&self, distance_m: f64) -> usize {
        self.edges_m.partition_point(|edge| *edge <= distance_m)
    }

    /// Returns the edges with the leading 0.
    pub(super) fn edges_from_zero_m(&self) -> Vec<f64> {
        std::iter::once(0.0).chain(self.edges_m.iter().copied()).collect()
    }
}

/// Lower edges in meters of very near, near and far: fixed, so that reports of different sensors can be compared.
pub(super) const THREE_EDGES_M: [f64; 3] = [0.0, 2.0, 4.0];

/// Name of the distance class where there is nothing.
pub(super) const BEYOND: &str = "beyond";

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_edge_belongs_to_the_farther_class_and_a_leading_zero_adds_none() {
        let classes = DistanceClasses::new(&[0.0, 2.0, 4.0], &[]).unwrap();
        assert_eq!(classes.names, ["d0", "d1", "d2"]);
        assert_eq!([1.99, 2.0, 3.9, 4.0, 9.0].map(|d| classes.class_of(d)), [0, 1, 1, 2, 2]);
        assert_eq!(classes.edges_from_zero_m(), [0.0, 2.0, 4.0]);
    }

    #[test]
    fn classes_that_mean_nothing_are_refused() {
        let named = |names: &[&str]| names.iter().map(|n| n.to_string()).collect::<Vec<_>>();
        assert!(DistanceClasses::new(&[2.0, 1.0], &[]).is_err());
        assert!(DistanceClasses::new(&[-1.0], &[]).is_err());
        assert!(DistanceClasses::new(&[f64::NAN], &[]).is_err());
        assert!(DistanceClasses::new(&[1.0], &named(&["near"])).is_err());
        assert!(DistanceClasses::new(&[1.0], &named(&["near", "near"])).is_err());
        assert!(DistanceClasses::new(&[1.0], &named(&["near", "beyond"])).is_err());
        assert!(DistanceClasses::new(&[], &named(&["any"])).is_ok());
        assert!(SensorOptions { range_m: 0.0, ..Default::default() }.check().is_err());
        assert!(SensorOptions { bearings_deg: vec![], ..Default::default() }.check().is_err());
    }
}
