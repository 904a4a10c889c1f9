//! What the odometry of a log is compared with.

use sidestep_kernel::InputError;
use sidestep_kernel::math::{hypot, wrap_angle};

use super::messages::{ScanKind, ScanMessage, TimedPose};
use super::{CarmenMotion, CorrectedLog, LogContent, LogEntry, PoseXyTheta, Scan};
use crate::report::{ImportReport, Treatment};
use crate::track::{
    SpeedRule, StampedPose2, absurd_speed_mps, cut_and_report, record_absurd_speed, report_frozen,
};
use crate::track_pair::report_pair;

/// Poses in a log are rounded to this, in m and rad.
const ROUNDING: f64 = 1e-3;
/// A scan this far from the one before shows whether odometry starts at its pose: a robot that stands proves nothing.
const MIN_MOVE_M: f64 = 0.01;
/// A stamp this far back is from a clock that was set back; the time after is moved behind it by whole seconds.
const MAX_BACKWARD_STEP_SECS: f64 = 0.5;
const PART_GAP_SECS: f64 = 10.0;
/// A stamp further ahead of the one before it is from a clock that was set forward, such as from 1970 to the present.
const MAX_FORWARD_STEP_SECS: f64 = 3600.0;
/// The share of scans at poses of odometry from which on a log was not corrected.
const UNCORRECTED_FRACTION: f64 = 0.9;

/// Chooses what odometry is compared with.
///
/// # Errors
/// When the log has nothing of the kind, or nothing but odometry.
pub(super) fn choose(
    place: &str,
    content: &LogContent,
    max_speed_mps: Option<f64>,
    report: &mut ImportReport,
) -> Result<CarmenMotion, InputError> {
    if content.count("TRUEPOS") >= 2 {
        report.add_fact("truth", "TRUEPOS");
        for kind in [ScanKind::Flaser, ScanKind::Robotlaser] {
            not_used(content, kind, "TRUEPOS", report);
        }
        return Ok(tracks(&true_poses(content), max_speed_mps, report));
    }
    let Some(kind) = scan_kind(content) else {
        let cause = format!(
            "the log has no two poses to compare odometry with; it has {}",
            content.describe()
        );
        let remedy =
            "give a log with ODOM and corrected FLASER or ROBOTLASER1 messages, or with TRUEPOS";
        return Err(InputError::new(place, cause, remedy));
    };
    let other = if kind == ScanKind::Flaser { ScanKind::Robotlaser } else { ScanKind::Flaser };
    not_used(content, other, kind.name(), report);
    let corrected = corrected_log(content, kind);
    let poses = timed_poses(content, kind);
    check_corrected(place, kind, &corrected, &poses)?;
    if does_odometry_restart(&corrected) {
        report.add_fact("truth", format!("{}, at which ODOM starts again", kind.name()));
        return Ok(CarmenMotion::Corrected(corrected));
    }
    report.add_fact("truth", format!("{}, beside ODOM in a frame of its own", kind.name()));
    Ok(tracks(&poses, max_speed_mps, report))
}

/// Returns the scans to use; `None` where there are fewer than two of any.
fn scan_kind(content: &LogContent) -> Option<ScanKind> {
    let kinds = [ScanKind::Flaser, ScanKind::Robotlaser];
    let most = kinds.into_iter().max_by_key(|kind| content.scans(*kind))?;
    (content.scans(most) >= 2).then_some(most)
}

fn not_used(content: &LogContent, kind: ScanKind, used: &str, report: &mut ImportReport) {
    let n = content.scans(kind);
    if n > 0 {
        let rule = format!("messages {}, {n} of them, beside {used}", kind.name());
        report.record(Treatment::NotUsed, rule, "", "");
    }
}

/// Poses of odometry, and those that it is compared with, each in the order of the log.
#[derive(Default)]
struct TimedPoses {
    odometry: Vec<TimedPose>,
    truth: Vec<TimedPose>,
    clock: LogClock,
}

impl TimedPoses {
    fn add_odometry(&mut self, pose: TimedPose) {
        let pose = self.clock.in_order(pose);
        self.odometry.push(pose);
    }

    fn add_truth(&mut self, pose: TimedPose) {
        let pose = self.clock.in_order(pose);
        self.truth.push(pose);
    }
}

/// The clock of a log, which all messages share. Where it was set back, the time after follows the time before.
struct LogClock {
    latest_secs: f64,
    shift_secs: f64,
    /// The steps back, in s.
    backward_steps_secs: Vec<f64>,
    /// The steps ahead that no pause of a log explains, in s.
    forward_steps_secs: Vec<f64>,
}

impl Default for LogClock {
    fn default() -> Self {
        Self {
            latest_secs: f64::NEG_INFINITY,
            shift_secs: 0.0,
            backward_steps_secs: Vec::new(),
            forward_steps_secs: Vec::new(),
        }
    }
}

impl LogClock {
    fn in_order(&mut self, pose: TimedPose) -> TimedPose {
        let step_secs = pose.t_secs + self.shift_secs - self.latest_secs;
        if step_secs < -MAX_BACKWARD_STEP_SECS {
            self.shift_secs += (PART_GAP_SECS - step_secs).ceil();
            self.backward_steps_secs.push(-step_secs);
        }
        if step_secs.is_finite() && step_secs > MAX_FORWARD_STEP_SECS {
            self.forward_steps_secs.push(step_secs);
        }
        let t_secs = pose.t_secs + self.shift_secs;
        self.latest_secs = self.latest_secs.max(t_secs);
        TimedPose { t_secs, ..pose }
    }
}

fn true_poses(content: &LogContent) -> TimedPoses {
    let mut poses = TimedPoses::default();
    for entry in &content.entries {
        if let LogEntry::TruePose(truth, odometry) = entry {
            poses.add_truth(*truth);
            poses.add_odometry(TimedPose { pose: *odometry, ..*truth });
        }
    }
    poses
}

/// Returns the poses of scans and of `ODOM`, or of the second pose of the scans where there is no `ODOM`.
fn timed_poses(content: &LogContent, kind: ScanKind) -> TimedPoses {
    let mut poses = TimedPoses::default();
    let has_odom = content.count("ODOM") > 0;
    for entry in &content.entries {
        match entry {
            LogEntry::Odometry(pose) => poses.add_odometry(*pose),
            LogEntry::Scan(ScanMessage { kind: own, at, odometry, .. }) if *own == kind => {
                poses.add_truth(*at);
                if let Some(pose) = odometry.filter(|_| !has_odom) {
                    poses.add_odometry(TimedPose { pose, ..*at });
                }
            }
            _ => {}
        }
    }
    poses
}

/// Returns the scans with the odometry that follows each.
fn corrected_log(content: &LogContent, kind: ScanKind) -> CorrectedLog {
    let mut log = CorrectedLog::default();
    for entry in &content.entries {
        match entry {
            LogEntry::Odometry(odometry) => match log.scans.last_mut() {
                Some(scan) => scan.odometry.push(odometry.pose),
                None => log.odometry_before.push(odometry.pose),
            },
            LogEntry::Scan(scan) if scan.kind == kind => log.scans.push(Scan {
                t_secs: scan.at.t_secs,
                n_beams: scan.n_beams,
                pose: scan.at.pose,
                odometry: Vec::new(),
            }),
            _ => {}
        }
    }
    log
}

fn distance_m(a: &PoseXyTheta, b: &PoseXyTheta) -> f64 {
    hypot(b[0] - a[0], b[1] - a[1])
}

fn is_same(a: &PoseXyTheta, b: &PoseXyTheta) -> bool {
    distance_m(a, b) <= ROUNDING && wrap_angle(b[2] - a[2]).abs() <= ROUNDING
}

/// Returns whether the first `ODOM` after a scan repeats its pose, for most scans between which the robot has moved.
fn does_odometry_restart(log: &CorrectedLog) -> bool {
    let mut moved = 0_u64;
    let mut repeated = 0_u64;
    for pair in log.scans.windows(2) {
        let [last, scan] = pair else { continue };
        let Some(first) = scan.odometry.first() else { continue };
        if distance_m(&last.pose, &scan.pose) < MIN_MOVE_M {
            continue;
        }
        moved += 1;
        repeated += u64::from(is_same(&scan.pose, first));
    }
    // Where nothing tells, a log is of the form that SLAM programs write.
    let has_odometry = log.scans.iter().any(|scan| !scan.odometry.is_empty());
    has_odometry && (2 * repeated > moved || moved == 0)
}

/// Checks that the scans are not where odometry has them.
fn check_corrected(
    place: &str,
    kind: ScanKind,
    log: &CorrectedLog,
    poses: &TimedPoses,
) -> Result<(), InputError> {
    let mut moved = 0_u64;
    let mut equal = 0_u64;
    let mut last_odometry: Option<&PoseXyTheta> = None;
    for pair in log.scans.windows(2) {
        let [before, scan] = pair else { continue };
        last_odometry = before.odometry.last().or(last_odometry);
        if distance_m(&before.pose, &scan.pose) < MIN_MOVE_M {
            continue;
        }
        moved += 1;
        let neighbors = [last_odometry, scan.odometry.first()];
        // That odometry starts again at a scan says nothing: what it has reached before does.
        let is_restart = scan.odometry.first().is_some_and(|first| is_same(&scan.pose, first))
            && !last_odometry.is_some_and(|last| is_same(&scan.pose, last));
        let is_equal = neighbors.into_iter().flatten().any(|pose| is_same(&scan.pose, pose));
        equal += u64::from(is_equal && !is_restart);
    }
    let has_odometry = !poses.odometry.is_empty();
    let is_copied = !poses.odometry.is_empty()
        && log.scans.iter().all(|scan| scan.odometry.is_empty())
        && poses.odometry.iter().zip(&poses.truth).all(|(a, b)| is_same(&a.pose, &b.pose));
    let is_uncorrected = moved > 0 && equal as f64 >= UNCORRECTED_FRACTION * moved as f64;
    if has_odometry && !is_copied && !is_uncorrected {
        return Ok(());
    }
    let n = log.scans.len();
    let cause = if has_odometry {
        format!(
            "the poses of its {n} {} messages are those of odometry: no program has corrected it",
            kind.name()
        )
    } else {
        format!("the log has {n} {} messages and no odometry (ODOM)", kind.name())
    };
    let remedy = "give the log as a SLAM program has corrected it, or one with TRUEPOS";
    Err(InputError::new(place, cause, remedy))
}

fn tracks(
    poses: &TimedPoses,
    max_speed_mps: Option<f64>,
    report: &mut ImportReport,
) -> CarmenMotion {
    for step_secs in &poses.clock.backward_steps_secs {
        let rule = "stamps that go back: the time after is a part of its own";
        report.record(Treatment::Repaired, rule, format!("by {step_secs:.3} s"), "");
    }
    for step_secs in &poses.clock.forward_steps_secs {
        let rule = "stamps that jump ahead: nothing is learned across";
        report.record(Treatment::Suspicious, rule, format!("by {step_secs:.3} s"), "");
    }
    let [odometry, truth] = [&poses.odometry, &poses.truth].map(|poses| by_time(poses));
    record_absurd_speed("ODOM", absurd_speed_mps(&odometry), report);
    record_absurd_speed("the true poses", absurd_speed_mps(&truth), report);
    let rule = SpeedRule::for_tracks(max_speed_mps, &[&odometry, &truth]);
    let odometry = cut_and_report("ODOM", odometry, &rule, report);
    let truth = cut_and_report("the true poses", truth, &rule, report);
    report_frozen("the true poses", &truth, &odometry, report);
    report_pair([("ODOM", &odometry), ("the true poses", &truth)], report);
    CarmenMotion::Tracks { odometry, truth }
}

fn by_time(poses: &[TimedPose]) -> Vec<StampedPose2> {
    let mut sorted = Vec::with_capacity(poses.len());
    for TimedPose { t_secs, pose: [x_m, y_m, heading_rad] } in poses {
        sorted.push(StampedPose2 {
            t_secs: *t_secs,
            position_m: [*x_m, *y_m],
            heading_rad: *heading_rad,
        });
    }
    sorted.sort_by(|a, b| a.t_secs.total_cmp(&b.t_secs));
    sorted
}
