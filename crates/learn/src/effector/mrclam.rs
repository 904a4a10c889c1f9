//! Velocity commands against motion capture (rules L5 and L7).

use std::collections::BTreeMap;

use super::events::{Events, MoveEvent, TurnEvent};
use super::{LearnedEffector, check_box};
use crate::EstimateOptions;
use crate::track::{Displacement2, pose_at};
use sidestep_import::mrclam::{Dataset, RobotLog, VelocityCommand};
use sidestep_kernel::InputError;
use sidestep_kernel::math::wrap_angle;

/// Longest step between commands, because a longer one says nothing about the commands between.
const MAX_STEP_SECS: f64 = 1.5;
/// A move with more commanded turn than this is not a move ahead.
const MAX_FORWARD_TURN_DEG: f64 = 10.0;
/// A slower command is not a turn: it corrects the direction of a drive.
const MIN_TURN_RATE_RADPS: f64 = 0.1;
/// A turn ends when this much is commanded; its ratio of true to commanded turn is taken for that of 90 degrees.
const TURN_DEG: f64 = 45.0;

/// The rule by which events become transitions.
const RULE: &str = "commands integrated to one box ahead against motion capture, \
    phase-averaged (L5), outcomes beyond the five spread in proportion; turns of 45 degrees \
    (L7), true over commanded taken for the share of a quarter turn, phase-averaged; every \
    count plus alpha";

pub(super) fn learn(
    source: &str,
    dataset: &Dataset,
    box_m: f64,
    options: &EstimateOptions,
) -> Result<LearnedEffector, InputError> {
    check_box(box_m)?;
    let mut events = Events::default();
    let mut rejected = BTreeMap::new();
    for (&robot, log) in &dataset.robots {
        let moves = moves(log, box_m, &mut rejected);
        events.moves.extend(moves.into_iter().map(|m| MoveEvent { robot, ..m }));
        events.turns.extend(turns(log).into_iter().map(|turn| TurnEvent { robot, ..turn }));
    }
    if events.moves.is_empty() {
        let cause = format!("no commanded path ahead is {box_m} m long");
        return Err(InputError::new(source, cause, "choose a smaller box"));
    }
    let mut report = events.report(source, options);
    report.box_m = Some(box_m);
    report.rejected = rejected;
    let mut profile = events.profile(RULE, options);
    profile.box_m = Some(box_m);
    Ok(LearnedEffector { report, profile })
}

/// The motion commanded since a line.
#[derive(Debug, Clone, Copy)]
struct CommandWindow {
    start_secs: f64,
    path_m: f64,
    turn_rad: f64,
}

impl CommandWindow {
    fn from(command: &VelocityCommand) -> Self {
        Self { start_secs: command.t_secs, path_m: 0.0, turn_rad: 0.0 }
    }

    /// A command holds until the next one.
    fn add_command(&mut self, command: &VelocityCommand, step_secs: f64) {
        self.path_m += command.forward_mps * step_secs;
        self.turn_rad += command.turn_radps * step_secs;
    }

    /// Returns the robot's real motion until `end_secs`.
    fn motion(&self, robot: &RobotLog, end_secs: f64) -> Option<Displacement2> {
        let start = pose_at(&robot.truth, self.start_secs)?;
        Some(start.motion_to(&pose_at(&robot.truth, end_secs)?))
    }
}

/// Returns whether a command holds too long, or time goes back, so that the motion is unknown.
fn is_gap(step_secs: f64) -> bool {
    !(0.0..=MAX_STEP_SECS).contains(&step_secs)
}

/// Returns all moves of one box ahead; counts in `rejected` the windows that were not used.
fn moves(robot: &RobotLog, box_m: f64, rejected: &mut BTreeMap<String, u64>) -> Vec<MoveEvent> {
    let Some(first) = robot.commands.first() else { return Vec::new() };
    let mut moves = Vec::new();
    let mut window = CommandWindow::from(first);
    for pair in robot.commands.windows(2) {
        let [command, next] = pair else { continue };
        let step_secs = next.t_secs - command.t_secs;
        if is_gap(step_secs) {
            reject(rejected, "gap");
            window = CommandWindow::from(next);
            continue;
        }
        window.add_command(command, step_secs);
        if window.turn_rad.abs() > MAX_FORWARD_TURN_DEG.to_radians() {
            reject(rejected, "turn");
        } else if window.path_m < box_m {
            continue;
        } else if let Some(motion) = window.motion(robot, next.t_secs) {
            moves.push(as_move(&window, &motion, next.t_secs, box_m));
        } else {
            reject(rejected, "no_ground_truth");
        }
        window = CommandWindow::from(next);
    }
    moves
}

fn reject(rejected: &mut BTreeMap<String, u64>, cause: &str) {
    *rejected.entry(cause.to_string()).or_insert(0) += 1;
}

fn as_move(window: &CommandWindow, motion: &Displacement2, end_secs: f64, box_m: f64) -> MoveEvent {
    MoveEvent {
        robot: 0,
        ahead_boxes: motion.ahead_m / box_m,
        left_boxes: motion.left_m / box_m,
        turn_error_rad: wrap_angle(motion.turn_rad - window.turn_rad),
        duration_s: Some(end_secs - window.start_secs),
    }
}

/// Returns all turns of 45 degrees.
fn turns(robot: &RobotLog) -> Vec<TurnEvent> {
    let mut turns = Vec::new();
    let mut open: Option<CommandWindow> = None;
    for pair in robot.commands.windows(2) {
        let [command, next] = pair else { continue };
        let step_secs = next.t_secs - command.t_secs;
        if is_gap(step_secs) || command.turn_radps.abs() < MIN_TURN_RATE_RADPS {
            open = None;
            continue;
        }
        let same_side = open.filter(|w| w.turn_rad * command.turn_radps >= 0.0);
        let mut window = same_side.unwrap_or(CommandWindow::from(command));
        window.add_command(command, step_secs);
        open = Some(window);
        if window.turn_rad.abs() >= TURN_DEG.to_radians() {
            open = None;
            turns.extend(as_turn(&window, robot, next.t_secs));
        }
    }
    turns
}

fn as_turn(window: &CommandWindow, robot: &RobotLog, end_secs: f64) -> Option<TurnEvent> {
    let motion = window.motion(robot, end_secs)?;
    Some(TurnEvent::new(window.turn_rad, motion.turn_rad, Some(end_secs - window.start_secs)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use sidestep_import::ImportReport;
    use sidestep_import::mrclam::StampedPose2;

    /// Commands once a second from t = 0; the robot moves at 1.1 m/s along x and does not turn.
    fn robot(commands: &[(f64, f64)]) -> RobotLog {
        let command = |(i, (forward_mps, turn_radps)): (usize, &(f64, f64))| VelocityCommand {
            t_secs: i as f64,
            forward_mps: *forward_mps,
            turn_radps: *turn_radps,
        };
        let pose = |i: u32| {
            let t_secs = f64::from(i) * 0.25;
            StampedPose2 { t_secs, position_m: [1.1 * t_secs, 0.0], heading_rad: 0.0 }
        };
        RobotLog {
            truth: (0..40).map(pose).collect(),
            commands: commands.iter().enumerate().map(command).collect(),
            measurements: Vec::new(),
        }
    }

    #[test]
    fn a_window_ends_where_the_commanded_path_reaches_the_box() {
        let mut rejected = BTreeMap::new();
        let robot = robot(&[(1.0, 0.0); 6]);
        let found = moves(&robot, 2.0, &mut rejected);
        assert_eq!(found.len(), 2);
        assert!((found[0].ahead_boxes - 1.1).abs() < 1e-12);
        assert_eq!((found[1].duration_s, rejected.len()), (Some(2.0), 0));
    }

    #[test]
    fn a_turn_a_gap_and_lost_ground_truth_are_no_moves_ahead() {
        let mut rejected = BTreeMap::new();
        let mut log = robot(&[(1.0, 0.0), (1.0, 0.2), (1.0, 0.0), (1.0, 0.0), (1.0, 0.0)]);
        log.commands[4].t_secs = 9.0;
        log.commands.push(VelocityCommand { t_secs: 10.0, forward_mps: 0.0, turn_radps: 0.0 });
        let found = moves(&log, 1.0, &mut rejected);
        assert_eq!(found.len(), 2, "steps 0-1 and 2-3");
        let causes = [("gap", 1), ("no_ground_truth", 1), ("turn", 1)];
        assert_eq!(rejected, causes.map(|(cause, n)| (cause.to_string(), n)).into());
    }

    #[test]
    fn a_turn_needs_one_sign_and_enough_rate() {
        let found = turns(&robot(&[(0.0, 0.5), (0.0, 0.5), (0.0, 0.05), (0.0, 0.5), (0.0, -0.5)]));
        assert_eq!(found.len(), 1);
        assert_eq!((found[0].commanded_rad, found[0].true_rad), (1.0, 0.0));
        assert_eq!(turns(&robot(&[(0.0, 0.5), (0.0, -0.5), (0.0, 0.5), (0.0, 0.0)])), []);
    }

    #[test]
    fn a_box_that_no_path_fills_is_an_error() {
        let dataset = Dataset {
            subject_of_barcode: BTreeMap::new(),
            landmarks: BTreeMap::new(),
            robots: [(1, robot(&[(1.0, 0.0); 6]))].into(),
            report: ImportReport::default(),
        };
        let learned = |box_m| learn("folder", &dataset, box_m, &EstimateOptions::default());
        assert!(learned(100.0).unwrap_err().remedy().contains("smaller"));
        assert!(learned(0.0).is_err() && learned(f64::NAN).is_err());
        assert_eq!(learned(2.0).unwrap().report.events, 2);
    }
}
