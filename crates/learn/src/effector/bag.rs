//! Odometry against the true poses of a bag, by the rule for corrected logs (L6).

use super::carmen::{EventRule, learn_with_rule};
use super::{LearnedEffector, check_box};
use crate::EstimateOptions;
use crate::track::{Gaps, Pose2, pose_at};
use sidestep_import::bag::BagLog;
use sidestep_import::carmen::{CorrectedLog, Scan};
use sidestep_import::track::{StampedPose2, Track};
use sidestep_import::{ImportReport, Treatment};
use sidestep_kernel::InputError;
use sidestep_kernel::math::hypot;

/// A window ends after this turn: the programs that correct CARMEN logs take a scan then.
const WINDOW_TURN_RAD: f64 = 0.5;
/// A claimed path this much shorter than a box is one: poses are rounded.
const PATH_TOLERANCE: f64 = 1e-6;
/// The least move and the longest path of a turn, as a share of a box: 0.3 m of the meter after which programs that
/// correct CARMEN logs take a scan (rule L6).
const PATH_FRACTION: f64 = 0.3;

/// The rule by which events become transitions.
const RULE: &str = "odometry against true poses over windows of one box or half a radian, displacement over \
    claimed path, phase-averaged (L6), outcomes beyond the five spread in proportion; turns in place, true \
    over claimed taken for the share of a quarter turn, phase-averaged; every count plus alpha";

pub(super) fn learn(
    source: &str,
    log: &BagLog,
    box_m: f64,
    options: &EstimateOptions,
) -> Result<LearnedEffector, InputError> {
    check_box(box_m)?;
    let rule = EventRule {
        words: RULE,
        path_m: PATH_FRACTION * box_m,
        remedy: "choose a smaller box, or a bag in which the robot drives and its true pose is told often",
    };
    let windows = Windows::cut(&log.odometry, &log.truth, box_m);
    let mut model = learn_with_rule(&rule, source, &windows.log, options)?;
    model.report.box_m = Some(box_m);
    model.profile.box_m = Some(box_m);
    windows.report(&mut model);
    Ok(model)
}

/// The length of the windows of a CARMEN log with true poses: programs that correct such logs take a scan about every
/// meter.
const CARMEN_WINDOW_M: f64 = 1.0;
/// The rule by which events of such a log become transitions.
const CARMEN_RULE: &str = "odometry against true poses over windows of one meter or half a radian, displacement over \
    claimed path, phase-averaged (L6), outcomes beyond the five spread in proportion; turns in place, true \
    over claimed taken for the share of a quarter turn, phase-averaged; every count plus alpha";

/// Learns from the tracks of a CARMEN log, in units of the claimed move.
pub(super) fn learn_tracks(
    source: &str,
    odometry: &Track,
    truth: &Track,
    options: &EstimateOptions,
) -> Result<LearnedEffector, InputError> {
    let rule = EventRule {
        words: CARMEN_RULE,
        path_m: PATH_FRACTION * CARMEN_WINDOW_M,
        remedy: "give a log in which the robot drives",
    };
    let windows = Windows::cut(odometry, truth, CARMEN_WINDOW_M);
    let mut model = learn_with_rule(&rule, source, &windows.log, options)?;
    windows.report(&mut model);
    Ok(model)
}

/// Adds what was found in a log to the warnings of what was learned from it.
pub(super) fn add_findings(model: &mut LearnedEffector, name: &str, report: &ImportReport) {
    model.report.warnings.extend(crate::import_warnings(name, report));
}

/// Number of findings that an error repeats.
const MAX_CAUSES: usize = 3;

/// Returns an error of learning with what was found in the log before: it may be the cause.
pub(super) fn with_findings(error: InputError, report: &ImportReport) -> InputError {
    let findings = report.findings.iter().filter(|found| found.treatment != Treatment::NotUsed);
    let found: Vec<String> = findings.take(MAX_CAUSES).map(ToString::to_string).collect();
    if found.is_empty() {
        return error;
    }
    let cause = format!("{}; {}", error.cause(), found.join("; "));
    InputError::new(error.place(), cause, error.remedy())
}

/// The true pose at the end of each window, and the poses that odometry claims in between.
struct Windows {
    log: CorrectedLog,
    /// Number of windows that a gap or a jump has cut short.
    broken: u64,
}

impl Windows {
    fn cut(odometry: &Track, truth: &Track, box_m: f64) -> Self {
        let breaks = [Gaps::from_track(odometry), Gaps::cuts_of(truth)];
        let mut scans: Vec<Scan> = Vec::new();
        let mut open: Option<OdometryWindow> = None;
        let mut broken = 0;
        for truth in truth.iter() {
            let Some(believed) = pose_at(odometry, truth.t_secs) else { continue };
            let stretch = breaks.iter().map(|gaps| gaps.count_before(truth.t_secs)).sum();
            let Some(window) = open.as_mut().filter(|window| window.stretch == stretch) else {
                // Between stretches the claims of odometry, or the motion, are unknown.
                broken += u64::from(open.is_some());
                scans.extend(open.take().map(OdometryWindow::into_unpaired_scan));
                open = Some(OdometryWindow::new(truth, believed, stretch));
                continue;
            };
            if window.extend(&believed, box_m) {
                let done = open.replace(OdometryWindow::new(truth, believed, stretch));
                scans.extend(done.map(|done| done.scan));
            }
        }
        scans.extend(open.map(|last| last.scan));
        Self { log: CorrectedLog { odometry_before: Vec::new(), scans }, broken }
    }

    fn report(&self, model: &mut LearnedEffector) {
        if self.broken > 0 {
            model.report.rejected.insert("gap".into(), self.broken);
        }
    }
}

/// The time since a true pose, and the claims of odometry about it.
struct OdometryWindow {
    /// Number of gaps of odometry before it; no window reaches across one.
    stretch: usize,
    /// The pose that odometry claims at the start, in the frame of odometry.
    start: Pose2,
    scan: Scan,
}

impl OdometryWindow {
    fn new(truth: &StampedPose2, believed: Pose2, stretch: usize) -> Self {
        let pose = [truth.position_m[0], truth.position_m[1], truth.heading_rad];
        let scan = Scan { t_secs: truth.t_secs, n_beams: 0, pose, odometry: vec![pose] };
        Self { stretch, start: believed, scan }
    }

    /// Adds the next pose that odometry claims; returns whether the window ends there.
    fn extend(&mut self, believed: &Pose2, box_m: f64) -> bool {
        let claimed = self.start.motion_to(believed);
        // A CARMEN scan lists odometry in the frame of its corrected pose, so the claims are put into that frame.
        self.scan.odometry.push(Pose2::from(self.scan.pose).compose(&claimed).into());
        let path_m = hypot(claimed.ahead_m, claimed.left_m);
        path_m >= box_m * (1.0 - PATH_TOLERANCE) || claimed.turn_rad.abs() >= WINDOW_TURN_RAD
    }

    /// Returns a scan that begins no pair.
    fn into_unpaired_scan(mut self) -> Scan {
        self.scan.odometry.clear();
        self.scan
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sidestep_import::track::{SpeedRule, cut_track};

    fn pose(t_secs: f64, x_m: f64, heading_rad: f64) -> StampedPose2 {
        StampedPose2 { t_secs, position_m: [x_m, 0.0], heading_rad }
    }

    /// Ten poses a second at a speed.
    fn track(n: u32, speed_mps: f64) -> Vec<StampedPose2> {
        let at = |k: u32| pose(0.1 * f64::from(k), 0.1 * f64::from(k) * speed_mps, 0.0);
        (0..n).map(at).collect()
    }

    fn log(odometry: Vec<StampedPose2>, truth: Vec<StampedPose2>) -> BagLog {
        BagLog { odometry: odometry.into(), truth: truth.into(), ..BagLog::default() }
    }

    #[test]
    fn a_window_is_a_box_of_claimed_path_and_tells_the_true_share_of_it() {
        let log = log(track(101, 1.0), track(101, 0.9));
        let model = learn("f", &log, 0.5, &EstimateOptions::default()).unwrap();
        assert_eq!(model.report.events, 20);
        let ahead = model.report.moments["ahead_boxes"];
        assert!((ahead.mean - 0.9).abs() < 1e-9 && ahead.sd < 1e-9, "{ahead:?}");
        assert_eq!((model.report.box_m, model.profile.box_m), (Some(0.5), Some(0.5)));
    }

    #[test]
    fn nothing_is_learned_across_a_gap_of_odometry() {
        let mut odometry = track(101, 1.0);
        // The robot was carried meanwhile.
        odometry.drain(42..60);
        let model = learn("f", &log(odometry, track(101, 1.0)), 1.0, &EstimateOptions::default());
        let report = model.unwrap().report;
        assert_eq!(report.events, 8, "0 to 4 s and 6 to 10 s");
        assert!(report.moments["ahead_boxes"].sd < 1e-9);
    }

    #[test]
    fn nothing_is_learned_across_a_jump_of_the_truth_or_of_odometry() {
        let cut = |poses: Vec<StampedPose2>| {
            let rule = SpeedRule::for_tracks(None, &[&poses, &track(401, 1.0)]);
            cut_track(poses, &rule).track
        };
        let mut lost = track(401, 1.0);
        for pose in &mut lost[200..220] {
            pose.position_m = [0.0; 2];
        }
        // The driver starts again at 0.
        let mut restarted = track(401, 1.0);
        for pose in &mut restarted[123..] {
            pose.position_m[0] -= 12.3;
        }
        let logs = [
            BagLog { odometry: track(401, 1.0).into(), truth: cut(lost), ..BagLog::default() },
            BagLog { odometry: cut(restarted), truth: track(401, 1.0).into(), ..BagLog::default() },
        ];
        for log in logs {
            let report = learn("f", &log, 0.5, &EstimateOptions::default()).unwrap().report;
            let ahead = report.moments["ahead_boxes"];
            assert!(
                ahead.n >= 74 && (ahead.mean - 1.0).abs() < 1e-9 && ahead.sd < 1e-9,
                "{ahead:?}"
            );
            assert_eq!(report.rejected, [("gap".to_string(), 1)].into());
        }
    }

    #[test]
    fn the_true_poses_of_a_carmen_log_are_compared_over_a_meter() {
        let model = learn_tracks(
            "f",
            &track(101, 1.0).into(),
            &track(101, 0.9).into(),
            &EstimateOptions::default(),
        );
        let report = model.unwrap().report;
        assert_eq!((report.events, report.box_m), (10, None));
        assert!((report.moments["ahead_boxes"].mean - 0.9).abs() < 1e-9);
    }

    #[test]
    fn odometry_that_drifts_is_no_error_as_only_motions_are_compared() {
        let turned = track(101, 1.0)
            .into_iter()
            .map(|p| StampedPose2 {
                position_m: [5.0, p.position_m[0]],
                heading_rad: 0.5 * std::f64::consts::PI,
                ..p
            })
            .collect();
        let model = learn("f", &log(turned, track(101, 1.0)), 0.5, &EstimateOptions::default());
        let moments = model.unwrap().report.moments;
        assert!((moments["ahead_boxes"].mean - 1.0).abs() < 1e-9);
        assert!(moments["left_boxes"].mean.abs() < 1e-9);
    }

    #[test]
    fn a_turn_in_place_is_told_as_a_share_of_the_claimed_one() {
        let turning = |rate: f64| {
            let at =
                |k: u32| pose(0.1 * f64::from(k), 0.05 * f64::from(k / 20), rate * f64::from(k));
            (0..200).map(at).collect::<Vec<_>>()
        };
        let mut odometry = turning(0.02);
        odometry.extend(
            track(20, 1.0).into_iter().map(|p| StampedPose2 { t_secs: 30.0 + p.t_secs, ..p }),
        );
        let mut truth = turning(0.018);
        truth.extend(
            track(20, 1.0).into_iter().map(|p| StampedPose2 { t_secs: 30.0 + p.t_secs, ..p }),
        );
        let report =
            learn("f", &log(odometry, truth), 0.5, &EstimateOptions::default()).unwrap().report;
        let turns = report.turns.expect("turns");
        assert_eq!((turns.n_left, turns.n_right), (turns.n, 0));
        assert!((turns.true_over_commanded.unwrap().mean - 0.9).abs() < 0.01, "{turns:?}");
    }

    #[test]
    fn a_robot_that_never_moves_and_a_box_without_size_are_errors() {
        let still = || log(track(20, 0.0), track(20, 0.0));
        let learned = |box_m| learn("f", &still(), box_m, &EstimateOptions::default()).unwrap_err();
        assert!(learned(0.5).remedy().contains("drives"));
        assert!(learned(0.0).remedy().contains("0.001"));
    }
}
