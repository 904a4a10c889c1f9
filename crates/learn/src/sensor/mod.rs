//! The reports of a sensor compared with the truth.
//!
//! [`from_mrclam`] judges barcode readings by motion capture (rules L1 to L4 below); [`from_bag`] judges the
//! ranges of a scanner by a map; [`from_csv`] takes readings with true values that are already known.
//!
//! - L1, pose at a time: linear between the motion-capture samples around it; refused
//!   outside the track and in gaps wider than 0.5 s.
//! - L2, true subject of a sighting: another subject is *consistent* with it when its true
//!   bearing is within 0.15 rad and its true range within max(0.5 m, 25 %). If the decoded
//!   subject is consistent, it is the true one; if it is a robot without ground truth at that
//!   time, the reading is skipped; otherwise the consistent subject with the least
//!   `(db / 0.03)^2 + (dr / (0.1 r))^2`, or none. (The nearest subject is not always the true
//!   one, because landmarks stand as little as 0.2 m apart.)
//! - L3, distance: class of the true range against class of the measured range, over the
//!   sightings with a correctly read subject. The true range is center to center.
//! - L4, detection: per second, whether a subject in view was read; see [`Detection`].

mod bag;
mod beam_fit;
mod beam_interval;
mod camera;
mod csv;
mod detection;
mod mrclam;
mod options;
mod readings;
mod recorded;
mod report;
mod sighting;
mod tables;

pub use beam_fit::{BeamFit, BeamParameter};
pub use camera::{NamedRow, SensorProfile};
pub use detection::Detection;
pub use options::SensorOptions;
pub use recorded::{RunSensorOptions, learn_run, recorded_table};
pub use report::{ErrorMoments, MapComparison, SensorReport};

use std::path::Path;

use crate::log_table::LogTable;
use sidestep_import::bag::TopicSelection;
use sidestep_import::table::CsvTable;
use sidestep_kernel::InputError;

/// A learned sensor: its counts, and the rows from which a simulation draws.
#[derive(Debug, Clone, PartialEq)]
pub struct LearnedSensor {
    /// Counts, probabilities with intervals, fit; serializable and printable.
    pub report: SensorReport,
    /// The same in the form that a scenario loads.
    pub profile: SensorProfile,
}

impl LearnedSensor {
    /// Fits the beam model to readings of a sensor that measures from `limits_m` first to last.
    fn fit_beam(&mut self, readings: &dyn readings::Readings, limits_m: [f64; 2]) {
        let fit = BeamFit::from_readings(readings, limits_m);
        self.report.warnings.extend(fit.iter().flat_map(BeamFit::warnings));
        if fit.is_none() {
            let words = "too few ranges for a beam model: it needs 100";
            self.report.warnings.push(words.to_string());
        }
        self.report.beam = fit;
    }
}

/// Learns a camera from an MRCLAM folder; `max_speed_mps` is the greatest speed of the robots, see
/// [`SpeedRule`](sidestep_import::track::SpeedRule).
///
/// # Errors
/// When a file is missing or damaged, or `options` are not valid.
pub fn from_mrclam(
    folder: &Path,
    max_speed_mps: Option<f64>,
    options: &SensorOptions,
) -> Result<LearnedSensor, InputError> {
    let classes = options.check()?;
    let dataset = sidestep_import::mrclam::read(folder, max_speed_mps)?;
    let mut model = mrclam::learn(&folder.display().to_string(), &dataset, options, &classes)?;
    model.report.warnings.extend(crate::import_warnings("the logs", &dataset.report));
    Ok(judged(model))
}

/// Judges a model by the readings of its log that were skipped.
fn judged(mut model: LearnedSensor) -> LearnedSensor {
    model.report.judge_left_out();
    model
}

/// The map by which scans are judged, and the scanner that the profile gets.
#[derive(Debug, Clone, Copy)]
pub struct Scanner<'a> {
    /// The file of the map in the frame of which the true poses are: a ROS map, or an image of one.
    pub map: &'a Path,
    /// Range of the profile's sensor in meters; `None` for that of the scans.
    pub range_m: Option<f64>,
    /// Bearings of the profile's beams in degrees; `None` for at most sixteen of the scans'.
    pub bearings_deg: Option<&'a [f64]>,
}

/// Learns a scanner from the scans and true poses in a bag of ROS.
///
/// A beam is expected to end at the first wall of the map, from the true pose at its time (L1; where true poses are
/// farther apart, odometry gives the motion since the last one, up to a meter). Beams that run into unmapped places
/// are skipped, and so are ranges below the least that the scanner measures.
///
/// # Errors
/// Those of [`bag::read`](sidestep_import::bag::read) and [`load_pixel_map`](sidestep_import::load_pixel_map); when scans
/// are not wanted, no beam can be judged, or `options` are not valid.
pub fn from_bag(
    path: &Path,
    wanted: &TopicSelection,
    scanner: &Scanner<'_>,
    options: &SensorOptions,
) -> Result<LearnedSensor, InputError> {
    let map = sidestep_import::load_pixel_map(scanner.map, None)?.ok_or_else(|| {
        let remedy = "give the .yaml file of a ROS map";
        InputError::new(scanner.map.display(), "this is no map of pixels", remedy)
    })?;
    let source = path.display().to_string();
    let log = sidestep_import::bag::read(path, wanted)?;
    if log.scans.is_empty() {
        return Err(InputError::new(source, "no scans were read", "give the topic of the scans"));
    }
    let options = bag::scan_options(options, &log.scans, scanner.range_m, scanner.bearings_deg);
    let classes = options.check()?;
    bag::learn(&source, &log, &map, &options, &classes).map(judged)
}

/// Learns a sensor from a CSV file.
///
/// Columns, found by name in the header:
/// - `true`, `reported`: the right observation and the reported one, each one word; `nothing` says
///   that nothing was in range, or reported;
/// - either `true_distance_m`, `reported_distance_m` (m, at least 0) or `true_class`,
///   `reported_class` (names out of [`SensorOptions::distance_classes`]); empty or `beyond`
///   where there is nothing;
/// - optional `sensor`: the name of the sensor; with several in one file,
///   [`SensorOptions::sensor`] chooses. A column `sensor_name` comes before it;
/// - optional `robot`: number of the robot, by which robots that differ are found.
///
/// Rows are in the order of time. A damaged row is left out and counted.
///
/// The table `readings` that a simulated run records for calibration has these columns.
///
/// # Errors
/// When the file is missing or damaged, more than half of its rows are, or `options` are not valid.
pub fn from_csv(file: &Path, options: &SensorOptions) -> Result<LearnedSensor, InputError> {
    learn_csv(&CsvTable::read_recording(file)?, options)
}

/// The columns of a table of readings.
const COLUMNS: &[&str] = &[
    "true",
    "reported",
    "true_distance_m",
    "reported_distance_m",
    "true_class",
    "reported_class",
    "sensor",
    "sensor_name",
    "robot",
];

/// Learns from a table that was already read, see [`from_csv`].
///
/// # Errors
/// When the table is damaged or `options` are not valid.
pub fn learn_csv(
    table: &dyn LogTable,
    options: &SensorOptions,
) -> Result<LearnedSensor, InputError> {
    let mut model = learn_known_csv(table, options)?;
    model.report.warnings.extend(crate::table_warnings(table, COLUMNS));
    if table.find("true_class").is_some() {
        let edges_m: Vec<String> = options.distance_edges_m.iter().map(f64::to_string).collect();
        model.report.warnings.push(format!(
            "the table gives distances by class and not where the classes end: {} m are taken (--edges)",
            edges_m.join(", ")
        ));
    }
    Ok(model)
}

/// Learns from a table with distance classes that are those of the options.
fn learn_known_csv(
    table: &dyn LogTable,
    options: &SensorOptions,
) -> Result<LearnedSensor, InputError> {
    let classes = options.check()?;
    csv::learn(table, options, &classes).map(judged)
}
