//! The real motion of a robot after a commanded move or turn.
//!
//! [`from_mrclam`] compares velocity commands with motion capture (L5, L7), [`from_carmen`]
//! odometry with a corrected log (L6), [`from_bag`] odometry with the true poses of a ROS 2 bag by the same
//! rule; [`from_csv`] takes displacements that were already measured.
//! A displacement is given in the frame of the pose it starts from: ahead, left, and turn (+ =
//! left).
//!
//! - L5, one box ahead: velocity commands are integrated with zero-order hold; a step of more
//!   than 1.5 s starts the window again, more than 10 degrees of commanded turn starts it again
//!   at the next line; when the commanded path reaches the side of a box, the window is an
//!   event and the next starts there.
//! - L6, the same from a corrected log: the motion that odometry claims between two scans is the
//!   command, the motion between the corrected poses is the result. Forward: at least 0.3 m ahead,
//!   at most 10 degrees of turn; displacements are given in units of the commanded path. Turn in
//!   place: at least 20 degrees, at most 0.3 m of path.
//! - L7, turn: commands of at least 0.1 rad/s with one sign, until 45 degrees are commanded.
//!
//! A displacement becomes grid transitions by *phase averaging*, see [`grid_displacement`].

mod bag;
mod carmen;
mod csv;
mod events;
pub mod grid_displacement;
mod mrclam;
mod report;
mod transitions;

pub use report::{EffectorReport, ForwardShares, TurnReport};
pub use transitions::{EffectorProfile, ProfileTransition};

use std::path::Path;

use super::EstimateOptions;
use sidestep_import::bag::TopicSelection;
use sidestep_import::table::CsvTable;
use sidestep_kernel::InputError;

/// Sides of a box that make sense for a robot, in m.
const BOX_RANGE_M: std::ops::RangeInclusive<f64> = 0.001..=1000.0;

/// Refuses a box that makes no sense for a robot.
fn check_box(box_m: f64) -> Result<(), InputError> {
    if BOX_RANGE_M.contains(&box_m) {
        return Ok(());
    }
    let cause = format!("a box of {box_m} m");
    Err(InputError::new("box", cause, "give a side from 0.001 to 1000 m"))
}

/// A learned effector: its counts, and the transitions from which a simulation draws.
#[derive(Debug, Clone, PartialEq)]
pub struct LearnedEffector {
    /// Counts, probabilities with intervals, fit; serializable and printable.
    pub report: EffectorReport,
    /// The same in the form that a scenario loads.
    pub profile: EffectorProfile,
}

/// Learns moves of `box_m` meters and turns of 90 degrees from an MRCLAM folder.
///
/// # Errors
/// When a file is missing or damaged, `options` are not valid, `box_m` is not from 0.001 to 1000 m,
/// or no commanded path is as long as a box.
pub fn from_mrclam(
    folder: &Path,
    box_m: f64,
    options: &EstimateOptions,
) -> Result<LearnedEffector, InputError> {
    options.check()?;
    let dataset = sidestep_import::mrclam::read(folder)?;
    mrclam::learn(&folder.display().to_string(), &dataset, box_m, options)
}

/// Learns moves and turns from a corrected CARMEN log, in units of the commanded move.
///
/// The report warns when the odometry in the log slips sideways by more than 2 % of its steps,
/// because then the log holds the samples of a SLAM program instead of wheel measurements.
///
/// # Errors
/// When the file is missing or damaged, `options` are not valid, or no move is long enough.
pub fn from_carmen(file: &Path, options: &EstimateOptions) -> Result<LearnedEffector, InputError> {
    options.check()?;
    let log = sidestep_import::carmen::read(file)?;
    carmen::learn(&file.display().to_string(), &log, options)
}

/// Learns moves and turns from odometry and true poses in a ROS 2 bag.
///
/// A window ends at the first true pose at which odometry claims a path of `box_m` meters since the window began, or
/// a turn of half a radian, and the next begins there; across a gap of odometry of more than 0.5 s there is none.
/// Windows are judged as those of a CARMEN log between two scans, with paths in proportion to `box_m` in place of
/// 1 m, after which the mapping programs of such logs take a scan.
///
/// # Errors
/// Those of [`bag::read`](sidestep_import::bag::read); when `options` are not valid, `box_m` is not from 0.001 to
/// 1000 m, odometry is not wanted, or no move is long enough.
pub fn from_bag(
    path: &Path,
    wanted: &TopicSelection,
    box_m: f64,
    options: &EstimateOptions,
) -> Result<LearnedEffector, InputError> {
    options.check()?;
    let log = sidestep_import::bag::read(path, wanted)?;
    bag::learn(&path.display().to_string(), &log, box_m, options)
}

/// Learns any actions from a CSV file.
///
/// Columns, found by name in the header:
/// - `action`: `forward`, `left`, `right` or `stay`, or 0 to 3 in that order;
/// - `ahead_boxes`, `left_boxes`: displacement in boxes in the start frame, at most 8;
/// - `turn_deg`: turn in degrees, + to the left;
/// - optional `contact`, `yes` or `no`: whether an obstacle stopped it; such rows are left out.
///
/// The table `motions` that a simulated run records for calibration has these columns.
///
/// Whole boxes and multiples of 90 degrees are counted as they are, others are phase-averaged.
///
/// # Errors
/// When the file is missing or damaged, holds no row, or `options` are not valid.
pub fn from_csv(file: &Path, options: &EstimateOptions) -> Result<LearnedEffector, InputError> {
    learn_csv(&CsvTable::read(file)?, options)
}

/// Learns from a CSV table that was already read, see [`from_csv`].
///
/// # Errors
/// When the table is damaged or `options` are not valid.
pub fn learn_csv(
    table: &CsvTable,
    options: &EstimateOptions,
) -> Result<LearnedEffector, InputError> {
    options.check()?;
    csv::learn(table, options)
}
