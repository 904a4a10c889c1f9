//! The real motion of a robot after a commanded move or turn.
//!
//! [`from_mrclam`] compares velocity commands with motion capture (L5, L7), [`from_carmen`]
//! odometry with a corrected log (L6), [`from_bag`] odometry with the true poses of a bag of ROS by the same
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
mod delays;
mod displacements;
mod events;
pub mod grid_displacement;
mod mrclam;
mod report;
mod rows;
mod transitions;

pub use delays::DelayReport;
pub use report::{EffectorReport, ForwardShares, TurnReport};
pub use transitions::{EffectorProfile, ProfileTransition};

use std::path::Path;

use super::EstimateOptions;
use super::log_table::LogTable;
use sidestep_import::bag::TopicSelection;
use sidestep_import::carmen::CarmenMotion;
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

impl LearnedEffector {
    /// Returns the same for boxes of `box_m` meters, for a log that does not say how long its moves are.
    ///
    /// # Errors
    /// When `box_m` is not from 0.001 to 1000 m.
    pub fn with_box(mut self, box_m: f64) -> Result<Self, InputError> {
        check_box(box_m)?;
        self.report.box_m = Some(box_m);
        self.profile.box_m = Some(box_m);
        Ok(self)
    }
}

/// Learns moves of `box_m` meters and turns of 90 degrees from an MRCLAM folder; `max_speed_mps` is the greatest speed of
/// the robots, see [`SpeedRule`](sidestep_import::track::SpeedRule).
///
/// # Errors
/// When a file is missing or damaged, `options` are not valid, `box_m` is not from 0.001 to 1000 m,
/// or no commanded path is as long as a box.
pub fn from_mrclam(
    folder: &Path,
    box_m: f64,
    max_speed_mps: Option<f64>,
    options: &EstimateOptions,
) -> Result<LearnedEffector, InputError> {
    options.check()?;
    let dataset = sidestep_import::mrclam::read(folder, max_speed_mps)?;
    let mut model = mrclam::learn(&folder.display().to_string(), &dataset, box_m, options)?;
    bag::add_findings(&mut model, "the logs", &dataset.report);
    Ok(judged(model))
}

/// Judges a model by the events and the windows of its log that were rejected.
fn judged(mut model: LearnedEffector) -> LearnedEffector {
    let turns = model.report.turns.as_ref().map_or(0, |turns| turns.n as u64);
    model.report.judge_left_out(model.report.events + turns);
    model
}

/// Learns moves and turns from a CARMEN log, in units of the commanded move; `max_speed_mps` is the greatest speed of the
/// robot, see [`SpeedRule`](sidestep_import::track::SpeedRule).
///
/// A log that a SLAM program has corrected is compared from scan to scan. Where it has true poses beside odometry
/// ([`CarmenMotion::Tracks`](sidestep_import::carmen::CarmenMotion)), windows of a meter or half a radian are, as
/// [`from_bag`] does.
///
/// The report warns when the odometry in the log slips sideways by more than 2 % of its steps,
/// because then the log holds the samples of a SLAM program instead of wheel measurements.
///
/// # Errors
/// When the file is missing or damaged, `options` are not valid, or no move is long enough.
pub fn from_carmen(
    file: &Path,
    max_speed_mps: Option<f64>,
    options: &EstimateOptions,
) -> Result<LearnedEffector, InputError> {
    options.check()?;
    let log = sidestep_import::carmen::read(file, max_speed_mps)?;
    let source = file.display().to_string();
    let mut model = match &log.motion {
        CarmenMotion::Corrected(corrected) => {
            carmen::learn(&source, corrected, max_speed_mps, options)?
        }
        CarmenMotion::Tracks { odometry, truth } => {
            bag::learn_tracks(&source, odometry, truth, options)?
        }
    };
    bag::add_findings(&mut model, "the log", &log.report);
    Ok(judged(model))
}

/// Learns moves and turns from odometry and true poses in a bag of ROS.
///
/// A window ends at the first true pose at which odometry claims a path of `box_m` meters since the window began, or
/// a turn of half a radian, and the next begins there; across a gap of odometry of more than 0.5 s, and across a
/// jump of either, there is none.
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
    let learned = bag::learn(&path.display().to_string(), &log, box_m, options);
    let mut model = learned.map_err(|error| bag::with_findings(error, &log.report))?;
    bag::add_findings(&mut model, "the bag", &log.report);
    Ok(judged(model))
}

/// Options of learning an effector from a table of displacements.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct EffectorOptions {
    /// The rule by which counts become probabilities.
    pub estimate: EstimateOptions,
    /// Side in meters of the boxes in which the table gives displacements; `None` where that is unknown.
    pub box_m: Option<f64>,
    /// Name of the effector to learn, for a table with several.
    pub effector: Option<String>,
    /// Numbers of the robots to learn from; all where empty.
    pub robots: Vec<u32>,
}

impl From<EstimateOptions> for EffectorOptions {
    fn from(estimate: EstimateOptions) -> Self {
        Self { estimate, ..Self::default() }
    }
}

impl EffectorOptions {
    fn check(&self) -> Result<(), InputError> {
        self.estimate.check()?;
        self.box_m.map_or(Ok(()), check_box)
    }
}

/// Learns any actions from a CSV file.
///
/// Columns, found by name in the header:
/// - `action`: `forward`, `left`, `right` or `stay`, or 0 to 3 in that order;
/// - `ahead_boxes`, `left_boxes`: displacement in boxes in the start frame, at most 8;
/// - `turn_deg`: turn in degrees, + to the left;
/// - optional `contact`, `yes` or `no`: whether an obstacle stopped it; such rows are left out;
/// - optional `delay_cycles`: steps without motion between the command of the action and its beginning, 0 for none, at
///   most 10,000; delays are learned from it, of rows with contact too;
/// - optional `robot`: number of the robot, by which robots that differ are found;
/// - optional `effector`: its name; with several in one file, [`EffectorOptions::effector`] chooses;
/// - optional `box_m`: side of the boxes in meters.
///
/// Rows are in the order of time. The table `motions` that a simulated run records for calibration has these columns.
/// A damaged row is left out and counted.
///
/// Whole boxes and multiples of 90 degrees are counted as they are, others are phase-averaged.
///
/// # Errors
/// When the file is missing or damaged, holds no row, more than half of its rows are damaged, it has several effectors
/// and none is chosen, or `options` are not valid.
pub fn from_csv(file: &Path, options: &EffectorOptions) -> Result<LearnedEffector, InputError> {
    learn_csv(&CsvTable::read_recording(file)?, options)
}

/// Learns from a table that was already read, see [`from_csv`].
///
/// # Errors
/// Those of [`from_csv`] that do not concern the file.
pub fn learn_csv(
    table: &dyn LogTable,
    options: &EffectorOptions,
) -> Result<LearnedEffector, InputError> {
    options.check()?;
    let mut model = csv::learn(table, options)?;
    model.report.warnings.extend(crate::table_warnings(table, COLUMNS));
    if model.profile.box_m.is_none() {
        model.report.warnings.push(NO_BOX.to_string());
    }
    Ok(model)
}

/// The columns of a table of displacements.
const COLUMNS: &[&str] = &[
    "action",
    "ahead_boxes",
    "left_boxes",
    "turn_deg",
    "contact",
    "delay_cycles",
    "robot",
    "effector",
    "box_m",
];

/// The warning on a table that does not say how long a box is.
const NO_BOX: &str = "the table gives displacements in boxes and does not say how long a box is, so that a scenario \
    with boxes of another size takes these slips for its own: give the side in meters with --box";

/// Learns from the table `motions` of a recorded run; `facts` are what the recording says of all of its rows, by name.
///
/// The run knows its box (`box_m`), and whether its wheels erred at all (`regime`, `obstacle_rule`).
///
/// # Errors
/// Those of [`learn_csv`]; when [`EffectorOptions::box_m`] is another box than that of the run.
pub fn learn_run(
    table: &dyn LogTable,
    facts: &[(String, String)],
    options: &EffectorOptions,
) -> Result<LearnedEffector, InputError> {
    let fact = |name: &str| facts.iter().find(|(known, _)| known == name).map(|(_, v)| v.as_str());
    let recorded_m = fact("box_m").and_then(|side| side.parse::<f64>().ok());
    if let (Some(asked_m), Some(recorded_m)) = (options.box_m, recorded_m)
        && (asked_m - recorded_m).abs() > 1e-9 * recorded_m
    {
        let cause = format!("the run was recorded with boxes of {recorded_m} m, not {asked_m} m");
        let remedy = format!("leave out {}", table.option_name("--box", "box_m"));
        return Err(InputError::new(table.place(), cause, remedy));
    }
    let options = EffectorOptions { box_m: recorded_m.or(options.box_m), ..options.clone() };
    let mut model = learn_csv(table, &options)?;
    let warnings = &mut model.report.warnings;
    if let Some(regime @ ("reliable" | "sensors")) = fact("regime") {
        warnings.push(format!(
            "the run was recorded with regime = \"{regime}\", in which wheels never err, whatever their tables say"
        ));
    }
    if fact("obstacle_rule") == Some("renormalise") {
        warnings.push(
            "the run was recorded with obstacle_rule = \"renormalise\", which strikes out slips that are blocked \
             without a contact: near obstacles they are seen too rarely, and nothing marks those moves"
                .to_string(),
        );
    }
    Ok(model)
}
