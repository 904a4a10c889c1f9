//! Odometry against corrected poses (rule L6).
//!
//! [`learn`] takes a CARMEN log; [`learn_with_rule`] any source of pairs of poses, such as a bag.

use super::LearnedEffector;
use super::events::{Events, MoveEvent, TurnEvent};
use super::report::EffectorReport;
use crate::EstimateOptions;
use crate::track::{Displacement2, Pose2};
use sidestep_import::carmen::{CorrectedLog, Scan};
use sidestep_import::track::{SpeedRule, StampedPose2};
use sidestep_kernel::InputError;
use sidestep_kernel::math::{hypot, tan, wrap_angle};
use sidestep_statistics::{Moments, percentile};

/// A move with more turn than this is not a move ahead.
const MAX_FORWARD_TURN_DEG: f64 = 10.0;
/// A smaller turn does not count as a turn.
const MIN_TURN_DEG: f64 = 20.0;
/// A shorter step of odometry is too short to show its slip, a ratio in which the noise of poses is divided by the step.
const MIN_SLIP_STEP_M: f64 = 0.03;
/// A step of odometry as long as this, or a turn as wide, is none: the pose has jumped.
const MIN_JUMP_M: f64 = 1.0;
const MIN_JUMP_RAD: f64 = 0.3;
/// Factor that makes the median absolute deviation of a normal distribution its standard deviation, 1 / Phi^-1(3/4).
const MAD_TO_SD: f64 = 1.4826;
/// Real wheels slip sideways by less than 1 % of their way; the particles of a SLAM program, logged
/// in place of odometry, by 3 % to 13 %.
const MAX_SLIP_SD: f64 = 0.02;

/// The rule by which events become transitions.
const RULE: &str = "odometry against corrected poses, displacement over commanded path, \
    phase-averaged (L6), outcomes beyond the five spread in proportion; turns in place, true \
    over commanded taken for the share of a quarter turn, phase-averaged; every count plus alpha";

/// The thresholds that tell moves from turns, and how a result is described.
pub(super) struct EventRule {
    /// The rule in words, for the profile.
    pub(super) words: &'static str,
    /// A shorter move does not count as a move, and a turn with a longer path is not a turn in place.
    pub(super) path_m: f64,
    /// The remedy where there is no move.
    pub(super) remedy: &'static str,
}

const CARMEN_RULE: EventRule =
    EventRule { words: RULE, path_m: 0.3, remedy: "give a corrected log with ODOM messages" };

pub(super) fn learn(
    source: &str,
    log: &CorrectedLog,
    max_speed_mps: Option<f64>,
    options: &EstimateOptions,
) -> Result<LearnedEffector, InputError> {
    let (possible, jumps) = without_jumps(log, max_speed_mps);
    let mut model = learn_with_rule(&CARMEN_RULE, source, &possible, options)?;
    if jumps > 0 {
        model.report.rejected.insert("gap".into(), jumps);
    }
    Ok(model)
}

/// Returns a log without the odometry between scans over which it, or the corrected pose, moves faster than the robot can,
/// and the number of such pairs of scans. Stamps that go back tell no speed.
fn without_jumps(log: &CorrectedLog, max_speed_mps: Option<f64>) -> (CorrectedLog, u64) {
    let stamped = |t_secs: f64, [x_m, y_m, heading_rad]: [f64; 3]| StampedPose2 {
        t_secs,
        position_m: [x_m, y_m],
        heading_rad,
    };
    let corrected: Vec<StampedPose2> =
        log.scans.iter().map(|scan| stamped(scan.t_secs, scan.pose)).collect();
    let rule = SpeedRule::for_tracks(max_speed_mps, &[&corrected]);
    let mut possible = log.clone();
    let mut jumps = 0;
    for (k, pair) in corrected.windows(2).enumerate() {
        let Some(claimed) = log.scans[k].odometry.last() else { continue };
        let claimed = stamped(pair[1].t_secs, *claimed);
        let is_possible = [&pair[1], &claimed].iter().all(|end| rule.is_possible(&pair[0], end));
        if pair[1].t_secs > pair[0].t_secs && !is_possible {
            possible.scans[k].odometry.clear();
            jumps += 1;
        }
    }
    (possible, jumps)
}

/// Learns from a log by a rule that may differ from that for CARMEN logs.
pub(super) fn learn_with_rule(
    rule: &EventRule,
    source: &str,
    log: &CorrectedLog,
    options: &EstimateOptions,
) -> Result<LearnedEffector, InputError> {
    let pairs: Vec<ScanPair> = log.scans.windows(2).filter_map(ScanPair::from_scans).collect();
    let ahead: Vec<&ScanPair> = pairs.iter().filter(|pair| pair.is_ahead(rule.path_m)).collect();
    let events = Events {
        moves: ahead.iter().map(|pair| pair.as_move()).collect(),
        turns: pairs.iter().filter_map(|pair| pair.as_turn(rule.path_m)).collect(),
    };
    if events.moves.is_empty() {
        let cause = format!(
            "odometry claims no move of {} m ahead between two of the {} poses that it is compared with",
            rule.path_m,
            log.scans.len()
        );
        return Err(InputError::new(source, cause, rule.remedy));
    }
    let mut report = events.report(source, options);
    add_slip(&mut report, &odometry_steps(log));
    add_moments(&mut report, &ahead);
    Ok(LearnedEffector { report, profile: events.profile(rule.words, options) })
}

/// Adds the moments in meters, which only logs with two poses per move have.
fn add_moments(report: &mut EffectorReport, ahead: &[&ScanPair]) {
    let claimed_m = ahead.iter().map(|pair| pair.claimed.ahead_m);
    let error_ahead_m = ahead.iter().map(|pair| pair.corrected.ahead_m - pair.claimed.ahead_m);
    let error_left_m = ahead.iter().map(|pair| pair.corrected.left_m);
    let moments = [
        ("odometry_forward_m", Moments::from_values(claimed_m)),
        ("error_ahead_m", Moments::from_values(error_ahead_m)),
        ("error_left_m", Moments::from_values(error_left_m)),
    ];
    for (name, moments) in moments {
        if let Some(moments) = moments {
            report.moments.insert(name.to_string(), moments);
        }
    }
}

/// Adds the slip that the steps of odometry show, and the warning where it is too large.
fn add_slip(report: &mut EffectorReport, steps: &[Displacement2]) {
    report.lateral_slip = Moments::from_values(steps.iter().filter_map(slip_ratio));
    report.lateral_slip_sd = report.lateral_slip.map(|slip| slip.sd);
    let whole = steps.iter().filter(|step| !is_jump(step));
    report.lateral_slip_robust_sd = robust_spread(whole.filter_map(slip_ratio).collect());
    let spreads = report.lateral_slip_robust_sd.zip(report.lateral_slip_sd);
    report.warnings.extend(spreads.and_then(|(robust, plain)| slip_warning(robust, plain)));
}

/// The motion between two scans, in the frame of the first.
#[derive(Debug, Clone, Copy, PartialEq)]
struct ScanPair {
    /// According to odometry.
    claimed: Displacement2,
    /// According to the corrected poses.
    corrected: Displacement2,
    duration_s: f64,
}

impl ScanPair {
    /// Returns the motion; `None` where no odometry lies between the scans.
    fn from_scans(scans: &[Scan]) -> Option<Self> {
        let start = Pose2::from(scans[0].pose);
        let claimed = Pose2::from(*scans[0].odometry.last()?);
        Some(Self {
            claimed: start.motion_to(&claimed),
            corrected: start.motion_to(&Pose2::from(scans[1].pose)),
            duration_s: scans[1].t_secs - scans[0].t_secs,
        })
    }

    fn is_ahead(&self, path_min_m: f64) -> bool {
        self.claimed.turn_rad.abs() <= MAX_FORWARD_TURN_DEG.to_radians()
            && self.claimed.ahead_m >= path_min_m
    }

    fn as_move(&self) -> MoveEvent {
        MoveEvent {
            robot: 0,
            ahead_boxes: self.corrected.ahead_m / self.claimed.ahead_m,
            left_boxes: self.corrected.left_m / self.claimed.ahead_m,
            turn_error_rad: wrap_angle(self.corrected.turn_rad - self.claimed.turn_rad),
            duration_s: Some(self.duration_s),
        }
    }

    fn as_turn(&self, path_max_m: f64) -> Option<TurnEvent> {
        let path_m = hypot(self.claimed.ahead_m, self.claimed.left_m);
        let is_turn = self.claimed.turn_rad.abs() >= MIN_TURN_DEG.to_radians();
        let turn =
            TurnEvent::new(self.claimed.turn_rad, self.corrected.turn_rad, Some(self.duration_s));
        (is_turn && path_m <= path_max_m).then_some(turn)
    }
}

/// Returns the steps of odometry, between poses that follow each other.
fn odometry_steps(log: &CorrectedLog) -> Vec<Displacement2> {
    let runs = std::iter::once(&log.odometry_before).chain(log.scans.iter().map(|s| &s.odometry));
    let steps = runs.flat_map(|run| run.windows(2));
    steps.map(|step| Pose2::from(step[0]).motion_to(&Pose2::from(step[1]))).collect()
}

fn is_jump(step: &Displacement2) -> bool {
    hypot(step.ahead_m, step.left_m) >= MIN_JUMP_M || step.turn_rad.abs() >= MIN_JUMP_RAD
}

/// Returns the sideways motion of a step as a share of its length, beyond the part that an arc of
/// the turned angle explains.
fn slip_ratio(step: &Displacement2) -> Option<f64> {
    (step.ahead_m.abs() > MIN_SLIP_STEP_M)
        .then(|| step.left_m / step.ahead_m - tan(step.turn_rad / 2.0))
}

/// Returns the spread of some values by their median absolute deviation, which up to half of them
/// being wild changes little.
fn robust_spread(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    let median = percentile(&values, 0.5)?;
    let mut deviations: Vec<f64> = values.iter().map(|value| (value - median).abs()).collect();
    deviations.sort_by(f64::total_cmp);
    percentile(&deviations, 0.5).map(|deviation| MAD_TO_SD * deviation)
}

fn slip_warning(robust: f64, plain: f64) -> Option<String> {
    (robust > MAX_SLIP_SD).then(|| {
        format!(
            "odometry slips sideways by {:.1} % of each step (1.4826 times the median absolute \
             deviation, of steps below 1 m and 0.3 rad; {:.1} % by the standard deviation of all; \
             wheels: under 1 %): its poses look like the samples of a SLAM program, whose noise would \
             be learned instead of the robot's",
            100.0 * robust,
            100.0 * plain
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scan(t_secs: f64, pose: [f64; 3], odometry: &[[f64; 3]]) -> Scan {
        Scan { t_secs, n_beams: 0, pose, odometry: odometry.to_vec() }
    }

    fn log(scans: Vec<Scan>) -> CorrectedLog {
        CorrectedLog { odometry_before: Vec::new(), scans }
    }

    #[test]
    fn a_move_is_told_in_units_of_what_odometry_claims() {
        let log = log(vec![
            scan(0.0, [0.0; 3], &[[0.0; 3], [2.0, 0.0, 0.1]]),
            scan(1.5, [1.5, 0.5, 0.2], &[]),
            scan(2.0, [9.0, 0.0, 0.0], &[]),
        ]);
        let model = learn("f", &log, None, &EstimateOptions::default()).unwrap();
        assert_eq!(model.report.events, 1, "no odometry, no pair");
        let moments = &model.report.moments;
        assert_eq!((moments["ahead_boxes"].mean, moments["left_boxes"].mean), (0.75, 0.25));
        assert_eq!((moments["duration_s"].mean, moments["error_ahead_m"].mean), (1.5, -0.5));
        assert!((moments["dtheta_minus_cmd_rad"].mean - 0.1).abs() < 1e-12);
    }

    #[test]
    fn a_turn_in_place_is_no_move_and_an_arc_is_neither() {
        let turned = ScanPair::from_scans(&[
            scan(0.0, [0.0; 3], &[[0.1, 0.0, 0.6]]),
            scan(1.0, [0.1, 0.0, 0.5], &[]),
        ]);
        let turned = turned.unwrap();
        assert_eq!((turned.is_ahead(0.3), turned.as_turn(0.3).unwrap().true_rad), (false, 0.5));
        let arc = ScanPair::from_scans(&[
            scan(0.0, [0.0; 3], &[[1.0, 0.0, 0.6]]),
            scan(1.0, [1.0, 0.0, 0.5], &[]),
        ]);
        assert_eq!((arc.unwrap().is_ahead(0.3), arc.unwrap().as_turn(0.3)), (false, None));
    }

    /// Steps of half a meter that slip to either side by up to 1.6 times a share of that.
    fn slipping(slip: f64) -> Vec<[f64; 3]> {
        let mut aside_m = 0.0;
        let pose = |i: u32| {
            let pose = [0.5 * f64::from(i), aside_m, 0.0];
            aside_m += 0.5 * slip * 1.6 * (0.5 * f64::from(i % 5) - 1.0);
            pose
        };
        (0..40).map(pose).collect()
    }

    fn learned(odometry: &[[f64; 3]]) -> LearnedEffector {
        let scans = vec![scan(0.0, [0.0; 3], odometry), scan(1.0, [19.0, 0.0, 0.0], &[])];
        learn("f", &log(scans), None, &EstimateOptions::default()).unwrap()
    }

    #[test]
    fn odometry_that_slips_sideways_is_warned_of_with_both_figures() {
        let warnings = |slip| learned(&slipping(slip)).report.warnings;
        assert!(warnings(0.03)[0].contains("slips sideways by 3.6 %"), "{:?}", warnings(0.03));
        assert!(warnings(0.03)[0].contains("3.3 % by the standard deviation of all"));
        assert_eq!(warnings(0.01), Vec::<String>::new());
    }

    #[test]
    fn a_good_log_in_which_a_few_poses_jump_is_not_warned_of() {
        let mut odometry = slipping(0.005);
        // A step of 5 m aside and back, one of 0.4 m that also turns, and a wild one of 0.6 m.
        odometry[10][1] += 5.0;
        odometry[20][2] = 0.4;
        odometry[30][1] += 0.3;
        let report = learned(&odometry).report;
        let (robust, plain) =
            (report.lateral_slip_robust_sd.unwrap(), report.lateral_slip_sd.unwrap());
        assert!(robust < 0.01 && plain > 0.5, "{robust} {plain}");
        assert_eq!(report.warnings, Vec::<String>::new());
    }

    #[test]
    fn odometry_that_jumps_between_two_scans_is_no_slip() {
        let drive = |k: u32| {
            let x_m = f64::from(k);
            let claimed_m = if k == 7 { 60.0 } else { x_m + 1.1 };
            scan(2.0 * x_m, [x_m, 0.0, 0.0], &[[x_m, 0.0, 0.0], [claimed_m, 0.0, 0.0]])
        };
        let log = log((0..20).map(drive).collect());
        let report = learn("f", &log, None, &EstimateOptions::default()).unwrap().report;
        assert_eq!((report.events, report.rejected["gap"]), (18, 1));
        assert!(report.moments["ahead_boxes"].sd < 1e-9);
    }

    #[test]
    fn a_log_without_moves_is_an_error() {
        let log = log(vec![scan(0.0, [0.0; 3], &[]), scan(1.0, [0.0; 3], &[])]);
        assert!(learn("f", &log, None, &EstimateOptions::default()).is_err());
    }
}
