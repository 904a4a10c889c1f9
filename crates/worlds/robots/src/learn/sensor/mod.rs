//! What a sensor reports against what was there.
//!
//! [`from_mrclam`] judges barcode readings by motion capture (rules L1 to L4 below);
//! [`from_csv`] takes readings whose truth is already known.
//!
//! - L1, pose at a time: linear between the motion-capture samples around it; refused
//!   outside the track and in gaps wider than 0.5 s.
//! - L2, true subject of a sighting: another subject is *consistent* with it when its true
//!   bearing is within 0.15 rad and its true range within max(0.5 m, 25 %). If the decoded
//!   subject is consistent, it is the true one; if it is a robot without ground truth at that
//!   time, the reading is skipped; otherwise the consistent subject with the least
//!   `(db / 0.03)^2 + (dr / (0.1 r))^2`, or nobody. (The geometrically nearest alone would not
//!   do: landmarks stand as little as 0.2 m apart.)
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

/// A learned sensor: what was counted, and the rows a simulation draws from.
#[derive(Debug, Clone, PartialEq)]
pub struct SensorModel {
    /// Counts, probabilities with intervals, fit; serializable and printable.
    pub report: SensorReport,
    /// The sensor as a profile holds it.
    pub profile: SensorProfile,
}

/// Learns a camera from an MRCLAM folder.
///
/// # Errors
/// When a file is missing or damaged, or `options` mean nothing.
pub fn from_mrclam(folder: &Path, options: &SensorOptions) -> Result<SensorModel, InputError> {
    let classes = options.check()?;
    let dataset = sidestep_import::mrclam::read(folder)?;
    mrclam::learn(&folder.display().to_string(), &dataset, options, &classes)
}

/// Learns a sensor from a CSV file.
///
/// Columns, found by name in the header:
/// - `true`, `reported`: the observation that was right and the one that came out, each one
///   word; `nothing` says that nothing was in range, or reported;
/// - either `true_distance_m`, `reported_distance_m` (m, at least 0) or `true_class`,
///   `reported_class` (names out of [`SensorOptions::distance_classes`]); empty or `beyond`
///   where there is nothing;
/// - optional `sensor`: the name of the sensor; with several in one file,
///   [`SensorOptions::sensor`] chooses.
///
/// The table `readings` that a simulated run records for calibration has these columns.
///
/// # Errors
/// When the file is missing or damaged, or `options` mean nothing.
pub fn from_csv(file: &Path, options: &SensorOptions) -> Result<SensorModel, InputError> {
    learn_csv(&CsvTable::read(file)?, options)
}

/// Learns from a CSV table already read, see [`from_csv`].
///
/// # Errors
/// When the table is damaged or `options` mean nothing.
pub fn learn_csv(table: &CsvTable, options: &SensorOptions) -> Result<SensorModel, InputError> {
    let classes = options.check()?;
    csv::learn(table, options, &classes)
}
