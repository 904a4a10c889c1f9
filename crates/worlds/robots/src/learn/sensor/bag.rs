//! A laser scanner learned from the scans of a bag: the ranges that a map lets expect against those measured.

use std::collections::BTreeMap;

use super::SensorModel;
use super::camera::{NOTHING, SensorProfile};
use super::csv::ReadingLog;
use super::options::{DistanceClasses, SensorOptions};
use super::readings::{Distance, Reading};
use super::report::AgainstMap;
use crate::learn::track::{Gaps, Pose, pose_at};
use sidestep_import::bag::BagLog;
use sidestep_import::bag::messages::LaserScan;
use sidestep_import::{PixelMap, Sight};
use sidestep_kernel::InputError;
use sidestep_kernel::math::{atan2, cos, hypot, sin};
use sidestep_kernel::view;

/// The observations of a scanner: nothing, and whatever stops a beam.
const OBSERVATIONS: [&str; 2] = [NOTHING, WALL];
const WALL: &str = "wall";
/// Most beams of a profile, unless others are asked for; a scan has hundreds, a simulated robot few.
const BEAMS_MAX: usize = 16;
/// The longest way in meters that odometry alone tells since the last true pose.
const RECKONED_MAX_M: f64 = 1.0;
/// A scanner on which this share of beams ends before the wall sees what is not on the map.
const IN_FRONT_MAX: f64 = 0.1;

/// The rule by which counts become rows.
const RULE: &str = "range to the first wall of the map from the true pose against measured range, no wall or \
    no echo within the range being nothing; every count plus alpha";

/// Learns the scanner; `options` have the fan and range of the profile, see [`fan`].
pub(super) fn learn(
    source: &str,
    log: &BagLog,
    map: &PixelMap,
    options: &SensorOptions,
    classes: &DistanceClasses,
) -> Result<SensorModel, InputError> {
    let judged = Judge::new(log, map, options.range_m, classes).judge_all();
    if judged.readings.is_empty() {
        let causes =
            judged.skipped.iter().map(|(cause, n)| format!("{n} {}", cause.replace('_', " ")));
        let cause = format!("no beam can be judged: {}", causes.collect::<Vec<_>>().join(", "));
        let remedy =
            "give the map in whose frame the true poses are, and a truth that covers the scans";
        return Err(InputError::new(source, cause, remedy));
    }
    let n_skipped = judged.skipped.values().sum::<u64>();
    let against = AgainstMap::of(judged.readings.iter().map(Reading::ranges_m));
    let observations = OBSERVATIONS.map(String::from).to_vec();
    let log_of = ReadingLog { observations, classes, readings: judged.readings, rule: RULE };
    let mut model = log_of.model(source, options);
    let report = &mut model.report;
    (report.measurements, report.skipped) = (report.sightings + n_skipped, n_skipped);
    report.skipped_by_cause = judged.skipped;
    report.warnings.extend(against.warning(IN_FRONT_MAX));
    report.warnings.extend(mount_warning(log));
    report.against_map = Some(against);
    model.profile = seeing_all(model.profile);
    Ok(model)
}

/// A beam is stopped by whatever stands there, so all kinds look like a wall.
fn seeing_all(profile: SensorProfile) -> SensorProfile {
    let designates = profile.designates.into_iter().map(|(kind, _)| (kind, WALL.to_string()));
    SensorProfile { designates: designates.collect(), ..profile }
}

fn mount_warning(log: &BagLog) -> Option<String> {
    let frame = &log.scans.first()?.header.frame_id;
    log.mount.is_none().then(|| {
        format!(
            "no static transform places the frame `{frame}` of the scans on the robot (/tf_static): the scanner \
             is taken to sit in its middle and to look ahead"
        )
    })
}

/// Returns the options with the fan and the range of the scans, where no others are asked for.
pub(super) fn fan(
    options: &SensorOptions,
    scan: &LaserScan,
    range_m: Option<f64>,
    bearings_deg: Option<&[f64]>,
) -> SensorOptions {
    let step = scan.ranges_m.len().div_ceil(BEAMS_MAX).max(1);
    let own = || {
        let beams = (step / 2..scan.ranges_m.len()).step_by(step);
        beams.map(|beam| rounded_deg(bearing_rad(scan, beam))).collect()
    };
    SensorOptions {
        range_m: range_m.unwrap_or(f64::from(scan.range_max_m)),
        bearings_deg: bearings_deg.map_or_else(own, <[f64]>::to_vec),
        ..options.clone()
    }
}

/// Returns an angle in degrees from -180 to 180, to a hundredth.
fn rounded_deg(angle_rad: f64) -> f64 {
    (sidestep_kernel::math::wrap_angle(angle_rad).to_degrees() * 100.0).round() / 100.0
}

fn bearing_rad(scan: &LaserScan, beam: usize) -> f64 {
    f64::from(scan.angle_min_rad) + beam as f64 * f64::from(scan.angle_increment_rad)
}

/// Beams that were judged, and the others by cause.
#[derive(Default)]
struct Judged {
    readings: Vec<Reading>,
    skipped: BTreeMap<String, u64>,
}

/// Compares scans with what a map lets expect.
struct Judge<'a> {
    log: &'a BagLog,
    map: &'a PixelMap,
    range_m: f64,
    classes: &'a DistanceClasses,
    gaps: Gaps,
    mount: Mount,
}

impl<'a> Judge<'a> {
    fn new(log: &'a BagLog, map: &'a PixelMap, range_m: f64, classes: &'a DistanceClasses) -> Self {
        let gaps = Gaps::of(&log.odometry);
        let mount = Mount::of(log.mount.unwrap_or(view::Pose::at([0.0; 3])));
        Self { log, map, range_m, classes, gaps, mount }
    }

    fn judge_all(&self) -> Judged {
        let mut judged = Judged::default();
        for scan in &self.log.scans {
            let mut skip = |cause: &str, n: usize| {
                *judged.skipped.entry(cause.to_string()).or_insert(0) += n as u64;
            };
            let Some(pose) = self.pose_at(scan.header.stamp.secs()) else {
                skip("no_true_pose", scan.ranges_m.len());
                continue;
            };
            for beam in 0..scan.ranges_m.len() {
                match self.judge(scan, beam, &pose) {
                    Ok(reading) => judged.readings.push(reading),
                    Err(cause) => skip(cause, 1),
                }
            }
        }
        judged
    }

    /// Returns the pose at a time: between true poses, else from the last one on by odometry.
    fn pose_at(&self, t_secs: f64) -> Option<Pose> {
        let BagLog { truth, odometry, .. } = self.log;
        pose_at(truth, t_secs).or_else(|| {
            let known = truth.get(truth.partition_point(|p| p.t_secs <= t_secs).checked_sub(1)?)?;
            let motion = pose_at(odometry, known.t_secs)?.motion_to(&pose_at(odometry, t_secs)?);
            let is_unbroken = self.gaps.before(known.t_secs) == self.gaps.before(t_secs);
            (is_unbroken && hypot(motion.ahead_m, motion.left_m) <= RECKONED_MAX_M)
                .then(|| Pose::from(*known).after(&motion))
        })
    }

    /// Compares a beam with the map; `Err` says why it cannot be judged.
    fn judge(&self, scan: &LaserScan, beam: usize, pose: &Pose) -> Result<Reading, &'static str> {
        let (least_m, most_m) = (f64::from(scan.range_min_m), f64::from(scan.range_max_m));
        let measured_m = f64::from(scan.ranges_m[beam]);
        if measured_m.is_nan() {
            return Err("no_number");
        }
        if measured_m < least_m {
            return Err("nearer_than_measured");
        }
        let (from_m, direction_rad) = self.mount.beam(pose, bearing_rad(scan, beam));
        let limit_m = self.range_m.min(most_m);
        let expected_m = match self.map.sight(from_m, direction_rad, limit_m) {
            Sight::Unknown => return Err("unmapped"),
            Sight::Wall(range_m) if range_m <= least_m => return Err("nearer_than_measured"),
            Sight::Wall(range_m) => Some(range_m),
            Sight::Nothing => None,
        };
        // Many drivers say the greatest range where nothing answers.
        let reported_m = (measured_m < most_m && measured_m <= limit_m).then_some(measured_m);
        Ok(self.reading(expected_m, reported_m))
    }

    fn reading(&self, expected_m: Option<f64>, reported_m: Option<f64>) -> Reading {
        let at =
            |range_m: f64| Distance { class: self.classes.of(range_m), range_m: Some(range_m) };
        Reading {
            truth: usize::from(expected_m.is_some()),
            reported: usize::from(reported_m.is_some()),
            true_at: expected_m.map(at),
            reported_at: reported_m.map(at),
        }
    }
}

/// Where a scanner sits on its robot, in the plane.
struct Mount {
    place: Pose,
    /// -1 where it hangs upside down, so that its bearings run the other way.
    side: f64,
}

impl Mount {
    fn of(pose: view::Pose) -> Self {
        let (ahead, up) = (pose.turned([1.0, 0.0, 0.0]), pose.turned([0.0, 0.0, 1.0]));
        let [x_m, y_m, _] = pose.at_m;
        let place = Pose { x_m, y_m, heading_rad: atan2(ahead[1], ahead[0]) };
        Self { place, side: if up[2] < 0.0 { -1.0 } else { 1.0 } }
    }

    /// Returns where a beam starts and its direction in the world.
    fn beam(&self, robot: &Pose, bearing_rad: f64) -> ([f64; 2], f64) {
        let (s, c) = (sin(robot.heading_rad), cos(robot.heading_rad));
        let Pose { x_m, y_m, heading_rad } = self.place;
        let from_m = [robot.x_m + c * x_m - s * y_m, robot.y_m + s * x_m + c * y_m];
        (from_m, robot.heading_rad + heading_rad + self.side * bearing_rad)
    }
}
