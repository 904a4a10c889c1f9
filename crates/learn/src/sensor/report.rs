//! The report on a learned sensor, for people and for programs.

use std::collections::BTreeMap;
use std::fmt;

use serde::Serialize;

use super::beam_fit::BeamFit;
use super::detection::Detection;
use super::sighting::is_consistent;
use crate::display::{self, TableHeading};
use crate::holdout::HoldoutTest;
use crate::{CountMatrix, CountTable, Estimate, EstimateOptions, LeftOut, LowCountRow};
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
    /// Number of readings, and of those that are in no table, with those among them that nothing explains.
    pub left_out: LeftOut,
    /// Number of sightings whose report is what was truly there.
    pub correct: u64,
    /// Number of sightings with a report that agrees with the subject that geometry alone would choose.
    pub nearest_agrees: Option<u64>,
    /// Barcodes that no subject has, and how often they were read.
    pub unknown_codes: BTreeMap<u32, u64>,
    /// Counts of the true against the reported value: `{true: {reported: count}}`.
    pub confusion: CountTable,
    /// The same by kind of subject.
    pub kinds: Option<CountTable>,
    /// Lower edges of the distance classes in meters.
    pub distance_edges_m: Vec<f64>,
    /// Names of the distance classes, near to far.
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
    /// Counts of beams by how they agree with a map.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub against_map: Option<MapComparison>,
    /// The four-part beam model that describes the ranges best, of sensors that measure ranges.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub beam: Option<BeamFit>,
    /// Every estimated probability with its count and interval. Of `confusion`, only the cells with
    /// counts.
    pub probabilities: Vec<Estimate>,
    /// Rows with fewer counts than [`EstimateOptions::thin_below`].
    pub thin: Vec<LowCountRow>,
    /// Tests of how well a part of the events predicts the rest.
    pub hold_out: Vec<HoldoutTest>,
    /// The rule by which counts become probabilities.
    pub estimate: EstimateOptions,
    /// Warnings that the reader should see before trusting the numbers.
    pub warnings: Vec<String>,
}

/// Errors of measurement, measured minus true; `None` where nothing was measured.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct ErrorMoments {
    /// Of the range in meters, + = measured too far.
    pub range_error_m: Option<Moments>,
    /// The same by class of the true range.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub range_error_by_true_class: Vec<Option<Moments>>,
    /// Of the bearing in radians, + = measured too far to the left.
    pub bearing_error_rad: Option<Moments>,
}

/// Numbers of beams by the thing they met against the map at that place. A range agrees with the map as that
/// of a sighting with its subject: within half a meter, or a quarter of the range.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub struct MapComparison {
    /// The wall was met where it is, or nothing where nothing is.
    pub agreeing: u64,
    /// Nothing was met where a wall is.
    pub missed: u64,
    /// Something was met far behind the wall, as through glass.
    pub seen_through: u64,
    /// Something was met far before the wall.
    pub in_front: u64,
    /// Something was met where nothing is.
    pub not_there: u64,
}

impl MapComparison {
    /// Counts expected against measured ranges in meters; `None` stands for nothing.
    pub(super) fn from_ranges(ranges_m: impl Iterator<Item = (Option<f64>, Option<f64>)>) -> Self {
        let mut counts = Self::default();
        for pair in ranges_m {
            let count = match pair {
                (Some(_), None) => &mut counts.missed,
                (None, Some(_)) => &mut counts.not_there,
                (Some(wall_m), Some(met_m)) if is_consistent(wall_m, met_m) => &mut counts.agreeing,
                (Some(wall_m), Some(met_m)) if met_m < wall_m => &mut counts.in_front,
                (Some(_), Some(_)) => &mut counts.seen_through,
                (None, None) => &mut counts.agreeing,
            };
            *count += 1;
        }
        counts
    }

    fn total(&self) -> u64 {
        self.agreeing + self.missed + self.seen_through + self.in_front + self.not_there
    }

    /// Returns a warning where most beams see something else than the map has.
    pub(super) fn frame_warning(&self) -> Option<String> {
        const MIN_AGREEING: f64 = 0.5;
        let share = self.agreeing as f64 / self.total().max(1) as f64;
        (self.total() > 0 && share < MIN_AGREEING).then(|| {
            format!(
                "only {:.1} % of the beams end where the map has a wall: what is learned is hardly the sensor's; check \
                 that the true poses are in the frame of the map, that the scanner is mounted as /tf_static says, and \
                 that clocks and units are right",
                100.0 * share
            )
        })
    }

    /// Returns a warning where more than a share of beams ends before the walls.
    pub(super) fn warning(&self, max_fraction: f64) -> Option<String> {
        let share = self.in_front as f64 / self.total().max(1) as f64;
        (share > max_fraction).then(|| {
            format!(
                "{:.1} % of the beams end far before the wall of the map: people, or things that are not on \
                 it, are learned as errors of the sensor; record in the building as it was mapped, and check \
                 that the truth is in the frame of the map",
                100.0 * share
            )
        })
    }
}

impl fmt::Display for MapComparison {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let rows = [
            (self.agreeing, "as the map has it"),
            (self.missed, "a wall that was missed"),
            (self.seen_through, "something far behind the wall"),
            (self.in_front, "something far before the wall"),
            (self.not_there, "something where nothing is"),
        ];
        let total = self.total().max(1) as f64;
        for (n, what) in rows {
            let percent = 100.0 * n as f64 / total;
            writeln!(f, "  {n:>9} {percent:>6.2} %  {what}")?;
        }
        Ok(())
    }
}

impl SensorReport {
    /// Counts the readings that were left out, and takes the intervals back where nothing explains too many.
    pub(super) fn judge_left_out(&mut self) {
        self.left_out = LeftOut::new(self.sightings, &self.skipped_by_cause);
        let Some(warning) = self.left_out.warning(&self.estimate) else { return };
        self.warnings.insert(0, warning);
        self.probabilities.iter_mut().for_each(|estimate| estimate.interval = None);
        let parameters = self.beam.iter_mut().flat_map(|fit| &mut fit.parameters);
        parameters.for_each(|parameter| parameter.interval = None);
    }
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
        if let Some(beams) = &self.against_map {
            write!(f, "{beams}")?;
        }
        display::write_warnings(f, &self.warnings)?;
        let moments = [
            ("range error [m]", self.errors.range_error_m),
            ("bearing error [rad]", self.errors.bearing_error_rad),
        ];
        display::write_moments(f, &moments.map(|(name, m)| (name.to_string(), m)))?;
        display::write_estimates(
            f,
            &self.probabilities,
            &TableHeading { row: "true", column: "reported" },
        )?;
        if let Some(fit) = &self.beam {
            write!(f, "{fit}")?;
        }
        display::write_low_count_rows(f, &self.thin, self.estimate.thin_below)?;
        display::write_holdout_tests(f, &self.hold_out)
    }
}

impl fmt::Display for BeamFit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "\nbeam model, of {} readings in {} scans", self.fitted, self.scans)?;
        if self.fitted < self.readings {
            writeln!(f, "  (taken evenly from {})", self.readings)?;
        }
        writeln!(f, "  {:20} {:>11}  95 % interval", "parameter", "value")?;
        for parameter in &self.parameters {
            let interval = match parameter.interval {
                Some(interval) => format!("[{:.5}, {:.5}]", interval.low, interval.high),
                None => "none".to_string(),
            };
            writeln!(f, "  {:20} {:>11.5}  {interval}", parameter.name, parameter.value)?;
        }
        let percent = 100.0 * self.largest_deviation;
        writeln!(f, "  {} steps; shares of ranges differ by {percent:.1} % at most", self.steps)
    }
}
