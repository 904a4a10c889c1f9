//! The reports of a sensor compared with the truth.
//!
//! [`from_mrclam`] judges barcode readings by motion capture (rules L1 to L4 below); [`from_csv`]
//! takes readings whose true values are already known.
//!
//! - L1, pose at a time: linear between the motion-capture samples around it; refused
//!   outside the track and in gaps wider than 0.5 s.
//! - L2, true subject of a sighting: another subject is *consistent* with it when its true
//!   bearing is within 0.15 rad and its true range within max(0.5 m, 25 %). If the decoded
//!   subject is consistent, it is the true one; if it is a robot without ground truth at that
//!   time, the reading is skipped; otherwise the consistent subject with the least
//!   `(db / 0.03)^2 + (dr / (0.1 r))^2`, or nobody. (The nearest subject is not always the true
//!   one, because landmarks stand as little as 0.2 m apart.)
//! - L3, distance: class of the true range against class of the measured range, over the
//!   sightings whose subject was read correctly. The true range is center to center.
//! - L4, detection: per second, whether a subject in view was read; see [`Detection`].

mod camera;
mod csv;
mod detection;
mod mrclam;
mod options;
mod readings;
mod report;
mod sighting;
mod tables;

pub use camera::{NamedRow, SensorProfile};
pub use detection::Detection;
pub use options::SensorOptions;
pub use report::{ErrorMoments, SensorReport};

use std::path::Path;

use sidestep_import::table::CsvTable;
use sidestep_kernel::InputError;

/// A learned sensor: its counts, and the rows from which a simulation draws.
#[derive(Debug, Clone, PartialEq)]
pub struct SensorModel {
    /// Counts, probabilities with intervals, fit; serializable and printable.
    pub report: SensorReport,
    /// The sensor in the form of a profile.
    pub profile: SensorProfile,
}

/// Learns a camera from an MRCLAM folder.
///
/// # Errors
/// When a file is missing or damaged, or `options` are not valid.
pub fn from_mrclam(folder: &Path, options: &SensorOptions) -> Result<SensorModel, InputError> {
    let classes = options.check()?;
    let dataset = sidestep_import::mrclam::read(folder)?;
    mrclam::learn(&folder.display().to_string(), &dataset, options, &classes)
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
///   [`SensorOptions::sensor`] chooses.
///
/// The table `readings` that a simulated run records for calibration has these columns.
///
/// # Errors
/// When the file is missing or damaged, or `options` are not valid.
pub fn from_csv(file: &Path, options: &SensorOptions) -> Result<SensorModel, InputError> {
    learn_csv(&CsvTable::read(file)?, options)
}

/// Learns from a CSV table that was already read, see [`from_csv`].
///
/// # Errors
/// When the table is damaged or `options` are not valid.
pub fn learn_csv(table: &CsvTable, options: &SensorOptions) -> Result<SensorModel, InputError> {
    let classes = options.check()?;
    csv::learn(table, options, &classes)
}
