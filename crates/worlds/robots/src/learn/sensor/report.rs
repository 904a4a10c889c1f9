//! The report on a learned sensor, for people and for programs.

use std::collections::BTreeMap;
use std::fmt;

use serde::Serialize;

use super::detection::Detection;
use crate::learn::display::{self, Heading};
use crate::learn::holdout::Fit;
use crate::learn::{CountMatrix, Counts, Estimate, EstimateOptions, ThinRow};
use sidestep_statistics::Moments;

/// The report on a learned sensor. Displayed as readable tables, serialized for programs.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SensorReport {
    /// The folder or file from which it was learned.
    pub source: String,
    /// Number of readings in the source.
    pub measurements: u64,
    /// Number of readings that could be judged: `measurements - skipped`.
    pub sightings: u64,
    /// Number of readings that could not be judged.
    pub skipped: u64,
    /// The same by cause.
    pub skipped_by_cause: BTreeMap<String, u64>,
    /// Number of sightings whose report was correct.
    pub correct: u64,
    /// Number of sightings whose report agrees with the subject that geometry alone would choose.
    pub nearest_agrees: Option<u64>,
    /// Barcodes that no subject has, and how often they were read.
    pub unknown_codes: BTreeMap<u32, u64>,
    /// Counts of the true against the reported value: `{true: {reported: count}}`.
    pub confusion: Counts,
    /// The same by kind of subject.
    pub kinds: Option<Counts>,
    /// Lower edges of the distance classes in meters.
    pub distance_edges_m: Vec<f64>,
    /// Names of the distance classes.
    pub distance_classes: Vec<String>,
    /// True class against reported class, over correct reports; shape `(classes, classes)`.
    pub distance_counts: CountMatrix,
    /// The same over robots only.
    pub distance_counts_robots: Option<CountMatrix>,
    /// The same over landmarks only.
    pub distance_counts_landmarks: Option<CountMatrix>,
    /// Lower edges in meters of the three classes very near, near and far.
    pub distance3_edges_m: [f64; 3],
    /// [`Self::distance_counts`] by those classes; `None` where distances are known by class only.
    pub distance3_counts: Option<CountMatrix>,
    /// Errors of range and bearing, over correct reports.
    #[serde(flatten)]
    pub errors: ErrorMoments,
    /// The same by observer.
    pub per_observer: BTreeMap<u32, ErrorMoments>,
    /// Counts of subjects in view that were read or missed.
    pub detection: Option<Detection>,
    /// Every estimated probability with its count and interval. Of `confusion`, only the cells with
    /// counts.
    pub probabilities: Vec<Estimate>,
    /// Rows with few counts.
    pub thin: Vec<ThinRow>,
    /// Tests of how well a part of the events predicts the rest.
    pub hold_out: Vec<Fit>,
    /// The rule by which counts become probabilities.
    pub estimate: EstimateOptions,
    /// Warnings that the reader should see before trusting the numbers.
    pub warnings: Vec<String>,
}

/// Errors of measurement, measured minus true; `None` where nothing was measured.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct ErrorMoments {
    /// Error of the range in meters.
    pub range_error_m: Option<Moments>,
    /// Error of the range in meters, by class of the true range.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub range_error_by_true_class: Vec<Option<Moments>>,
    /// Error of the bearing in radians.
    pub bearing_error_rad: Option<Moments>,
}

impl fmt::Display for SensorReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "Sensor learned from {}", self.source)?;
        writeln!(
            f,
            "{} readings: {} skipped, {} judged, {} of them right",
            self.measurements, self.skipped, self.sightings, self.correct
        )?;
        for (cause, count) in &self.skipped_by_cause {
            writeln!(f, "  skipped {count}: {}", cause.replace('_', " "))?;
        }
        display::warnings(f, &self.warnings)?;
        let moments = [
            ("range error [m]", self.errors.range_error_m),
            ("bearing error [rad]", self.errors.bearing_error_rad),
        ];
        display::moments(f, &moments.map(|(name, m)| (name.to_string(), m)))?;
        display::estimates(f, &self.probabilities, &Heading { row: "true", column: "reported" })?;
        display::thin(f, &self.thin, self.estimate.thin_below)?;
        display::hold_out(f, &self.hold_out)
    }
}
