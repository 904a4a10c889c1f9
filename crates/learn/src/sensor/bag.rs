//! A laser scanner learned from the scans of a bag: the ranges expected from a map against those measured.

use std::collections::{BTreeMap, BTreeSet};

use super::LearnedSensor;
use super::camera::{NOTHING, SensorProfile};
use super::csv::ReadingLog;
use super::options::{DistanceClasses, SensorOptions};
use super::readings::{Distance, LabeledReading};
use super::report::MapComparison;
use crate::track::{Gaps, Pose2, pose_at};
use sidestep_import::bag::BagLog;
use sidestep_import::bag::messages::LaserScan;
use sidestep_import::{PixelMap, RayHit, Treatment};
use sidestep_kernel::InputError;
use sidestep_kernel::math::{atan2, cos, hypot, sin};
use sidestep_kernel::view;

/// The observations of a scanner: nothing, and anything that stops a beam.
const OBSERVATIONS: [&str; 2] = [NOTHING, WALL];
const WALL: &str = "wall";
/// Most beams of a profile, unless others are asked for; a scan has hundreds, a simulated robot few.
const MAX_BEAMS: usize = 16;
/// The longest distance in meters that odometry alone measures since the last true pose: programs that correct logs
/// take a true pose about every meter, and the errors of odometry grow with the distance.
const MAX_DEAD_RECKONING_M: f64 = 1.0;
/// A scanner with this share of its beams ending before the wall sees things that are not on the map; wrong readings
/// of the scanner itself are far rarer.
const MAX_IN_FRONT_FRACTION: f64 = 0.1;

/// The rule by which counts become rows.
const RULE: &str = "range to the first wall of the map from the true pose against measured range, no wall or \
    no echo within the range being nothing; every count plus alpha";

/// Learns the scanner; `options` have the fan and range of the profile, see [`scan_options`].
pub(super) fn learn(
    source: &str,
    log: &BagLog,
    map: &PixelMap,
    options: &SensorOptions,
    classes: &DistanceClasses,
) -> Result<LearnedSensor, InputError> {
    let judged = BeamEvaluator::new(log, map, options.range_m, classes).evaluate_all();
    if judged.readings.is_empty() {
        let causes =
            judged.skipped.iter().map(|(cause, n)| format!("{n} {}", cause.replace('_', " ")));
        let cause = format!("no beam can be judged: {}", causes.collect::<Vec<_>>().join(", "));
        let remedy =
            "give the map in whose frame the true poses are, and a truth that covers the scans";
        return Err(InputError::new(source, cause, remedy));
    }
    let n_skipped = judged.skipped.values().sum::<u64>();
    let against = MapComparison::from_ranges(judged.readings.iter().map(LabeledReading::ranges_m));
    let observations = OBSERVATIONS.map(String::from).to_vec();
    let log_of = ReadingLog { observations, classes, readings: &judged.readings, rule: RULE };
    let mut model = log_of.model(source, options);
    let report = &mut model.report;
    report.measurements = report.sightings + n_skipped;
    report.skipped = n_skipped;
    report.skipped_by_cause = judged.skipped;
    report.warnings.extend(against.frame_warning());
    report.warnings.extend(against.warning(MAX_IN_FRONT_FRACTION));
    report.warnings.extend(crate::import_warnings("the bag", &log.report));
    report.warnings.extend(mount_warnings(log));
    report.warnings.extend(map_warnings(map));
    report.against_map = Some(against);
    model.profile = with_walls_only(model.profile);
    let least_m = log.scans.first().map_or(0.0, |scan| f64::from(scan.range_min_m));
    model.fit_beam(&judged.readings, [least_m.max(0.0), options.range_m]);
    Ok(model)
}

/// Anything stops a beam, so all kinds look like a wall.
fn with_walls_only(profile: SensorProfile) -> SensorProfile {
    let designates = profile.designates.into_iter().map(|(kind, _)| (kind, WALL.to_string()));
    SensorProfile { designates: designates.collect(), ..profile }
}

fn mount_warnings(log: &BagLog) -> Vec<String> {
    let frames: BTreeSet<&str> = log.scans.iter().map(|scan| &*scan.header.frame_id).collect();
    let unplaced = frames.into_iter().filter(|frame| !log.mounts.contains_key(*frame));
    let warning = |frame| {
        format!(
            "no static transform places the frame `{frame}` of the scans on the robot (/tf_static): the scanner \
             is taken to sit in its middle and to look ahead"
        )
    };
    unplaced.map(warning).collect()
}

/// Returns what may make the map another than the one that its author means.
fn map_warnings(map: &PixelMap) -> Vec<String> {
    let mut warnings = Vec::new();
    for finding in &map.report().findings {
        if matches!(finding.treatment, Treatment::Guessed | Treatment::Suspicious) {
            warnings.push(format!("the map: {finding}"));
        }
    }
    warnings
}

/// Returns the options with the fan and the range of the scans, where no others are asked for.
pub(super) fn scan_options(
    options: &SensorOptions,
    scans: &[LaserScan],
    range_m: Option<f64>,
    bearings_deg: Option<&[f64]>,
) -> SensorOptions {
    let greatest_m = scans.iter().map(|scan| f64::from(scan.range_max_m)).fold(0.0, f64::max);
    let fan = || scans.first().map_or_else(Vec::new, thinned_bearings_deg);
    SensorOptions {
        range_m: range_m.unwrap_or(greatest_m),
        bearings_deg: bearings_deg.map_or_else(fan, <[f64]>::to_vec),
        ..options.clone()
    }
}

/// Returns at most [`MAX_BEAMS`] bearings of a scan: the fan cut into equal sectors, the middle beam of each.
fn thinned_bearings_deg(scan: &LaserScan) -> Vec<f64> {
    let step = scan.ranges_m.len().div_ceil(MAX_BEAMS).max(1);
    let beams = (step / 2..scan.ranges_m.len()).step_by(step);
    beams.map(|beam| rounded_deg(bearing_rad(scan, beam))).collect()
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
struct EvaluatedBeams {
    readings: Vec<LabeledReading>,
    skipped: BTreeMap<String, u64>,
}

impl EvaluatedBeams {
    fn skip(&mut self, cause: &str, n: usize) {
        *self.skipped.entry(cause.to_string()).or_insert(0) += n as u64;
    }
}

/// Compares scans with the ranges expected from a map.
struct BeamEvaluator<'a> {
    log: &'a BagLog,
    map: &'a PixelMap,
    range_m: f64,
    classes: &'a DistanceClasses,
    gaps: Gaps,
    /// The mounts of the frames of scans.
    mounts: BTreeMap<&'a str, ScannerMount>,
    /// The mount of a frame that nothing places.
    middle: ScannerMount,
}

impl<'a> BeamEvaluator<'a> {
    fn new(log: &'a BagLog, map: &'a PixelMap, range_m: f64, classes: &'a DistanceClasses) -> Self {
        let gaps = Gaps::from_track(&log.odometry);
        let mounts = log.mounts.iter();
        let mounts =
            mounts.map(|(frame, pose)| (&**frame, ScannerMount::from_pose(*pose))).collect();
        let middle = ScannerMount::from_pose(view::Pose::from_position([0.0; 3]));
        Self { log, map, range_m, classes, gaps, mounts, middle }
    }

    fn evaluate_all(&self) -> EvaluatedBeams {
        let mut judged = EvaluatedBeams::default();
        for (number, scan) in self.log.scans.iter().enumerate() {
            let Some(pose) = self.pose_at(scan.header.stamp.secs()) else {
                judged.skip("no_true_pose", scan.ranges_m.len());
                continue;
            };
            for beam in 0..scan.ranges_m.len() {
                match self.evaluate_beam(scan, beam, &pose) {
                    Ok(reading) => {
                        judged.readings.push(LabeledReading { scan: number as u32, ..reading });
                    }
                    Err(cause) => judged.skip(cause, 1),
                }
            }
        }
        judged
    }

    /// Returns the pose at a time: between true poses, else from the last one on by odometry.
    fn pose_at(&self, t_secs: f64) -> Option<Pose2> {
        pose_at(&self.log.truth, t_secs).or_else(|| self.dead_reckoned_pose(t_secs))
    }

    fn dead_reckoned_pose(&self, t_secs: f64) -> Option<Pose2> {
        let BagLog { truth, odometry, .. } = self.log;
        let n_before = truth.partition_point(|p| p.t_secs <= t_secs);
        let known = truth.get(n_before.checked_sub(1)?)?;
        let motion = pose_at(odometry, known.t_secs)?.motion_to(&pose_at(odometry, t_secs)?);
        let is_unbroken = self.gaps.count_before(known.t_secs) == self.gaps.count_before(t_secs);
        let is_short = hypot(motion.ahead_m, motion.left_m) <= MAX_DEAD_RECKONING_M;
        (is_unbroken && is_short).then(|| Pose2::from(*known).compose(&motion))
    }

    /// Compares a beam with the map; `Err` says why it cannot be judged.
    fn evaluate_beam(
        &self,
        scan: &LaserScan,
        beam: usize,
        pose: &Pose2,
    ) -> Result<LabeledReading, &'static str> {
        let min_m = f64::from(scan.range_min_m);
        let max_m = f64::from(scan.range_max_m);
        let measured_m = f64::from(scan.ranges_m[beam]);
        if measured_m.is_nan() {
            return Err("no_number");
        }
        if measured_m < min_m {
            return Err("nearer_than_measured");
        }
        let mount = self.mounts.get(&*scan.header.frame_id).unwrap_or(&self.middle);
        let (from_m, direction_rad) = mount.beam(pose, bearing_rad(scan, beam));
        let limit_m = self.range_m.min(max_m);
        let expected_m = match self.map.cast_ray(from_m, direction_rad, limit_m) {
            RayHit::Unknown => return Err("unmapped"),
            RayHit::Wall(range_m) if range_m <= min_m => return Err("nearer_than_measured"),
            RayHit::Wall(range_m) => Some(range_m),
            RayHit::Nothing => None,
        };
        // Ranges follow REP 117: where nothing answers they are infinite.
        let reported_m = (measured_m <= limit_m).then_some(measured_m);
        Ok(self.reading(expected_m, reported_m))
    }

    fn reading(&self, expected_m: Option<f64>, reported_m: Option<f64>) -> LabeledReading {
        LabeledReading {
            robot: 0,
            scan: 0,
            truth: usize::from(expected_m.is_some()),
            reported: usize::from(reported_m.is_some()),
            true_at: expected_m.map(|range_m| self.distance(range_m)),
            reported_at: reported_m.map(|range_m| self.distance(range_m)),
        }
    }

    fn distance(&self, range_m: f64) -> Distance {
        Distance { class: self.classes.class_of(range_m), range_m: Some(range_m) }
    }
}

/// The mount of a scanner on its robot, in the plane.
struct ScannerMount {
    place: Pose2,
    /// -1 where it hangs upside down, so that its bearings run the other way.
    side: f64,
}

impl ScannerMount {
    fn from_pose(pose: view::Pose) -> Self {
        let ahead = pose.rotate([1.0, 0.0, 0.0]);
        let up = pose.rotate([0.0, 0.0, 1.0]);
        let [x_m, y_m, _] = pose.at_m;
        let place = Pose2 { x_m, y_m, heading_rad: atan2(ahead[1], ahead[0]) };
        Self { place, side: if up[2] < 0.0 { -1.0 } else { 1.0 } }
    }

    /// Returns where a beam starts and its direction in the world.
    fn beam(&self, robot: &Pose2, bearing_rad: f64) -> ([f64; 2], f64) {
        let (s, c) = (sin(robot.heading_rad), cos(robot.heading_rad));
        let Pose2 { x_m, y_m, heading_rad } = self.place;
        let from_m = [robot.x_m + c * x_m - s * y_m, robot.y_m + s * x_m + c * y_m];
        (from_m, robot.heading_rad + heading_rad + self.side * bearing_rad)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sidestep_import::ImportReport;
    use sidestep_import::bag::messages::{Header, Time};
    use sidestep_import::mrclam::StampedPose2;
    use sidestep_kernel::view::Isometry2;
    use sidestep_map::Cell;
    use std::f64::consts::{FRAC_PI_2, PI};

    /// A room of 6 x 4 m with walls of a meter around it.
    fn room() -> PixelMap {
        let is_wall = |col: u32, row: u32| col == 0 || col == 7 || row == 0 || row == 5;
        let cell = |k: u32| if is_wall(k % 8, k / 8) { Cell::Wall } else { Cell::Free };
        let plane = Isometry2 { origin_m: [-1.0, -1.0], yaw_rad: 0.0 };
        PixelMap::new(8, 6, 1.0, plane, (0..48).map(cell).collect())
    }

    /// Beams to the right, ahead and to the left.
    fn scan(t_s: u64, ranges_m: [f32; 3]) -> LaserScan {
        LaserScan {
            header: Header { stamp: Time::from_ns(t_s * 1_000_000_000), frame_id: "laser".into() },
            angle_min_rad: -FRAC_PI_2 as f32,
            angle_max_rad: FRAC_PI_2 as f32,
            angle_increment_rad: FRAC_PI_2 as f32,
            time_increment_s: 0.0,
            scan_time_s: 0.0,
            range_min_m: 0.2,
            range_max_m: 4.5,
            ranges_m: ranges_m.to_vec(),
            intensities: Vec::new(),
        }
    }

    fn pose(t_secs: f64, x_m: f64) -> StampedPose2 {
        StampedPose2 { t_secs, position_m: [x_m, 1.0], heading_rad: 0.0 }
    }

    /// A robot that stands at (1, 1) and looks along x.
    fn log(scans: Vec<LaserScan>) -> BagLog {
        let truth = (0..5).map(|k| pose(f64::from(k), 1.0)).collect();
        BagLog {
            truth,
            scans,
            mounts: [("laser".to_owned(), view::Pose::from_position([0.0; 3]))].into(),
            ..BagLog::default()
        }
    }

    #[test]
    fn what_is_suspicious_about_the_map_is_a_warning_and_what_is_not_used_none() {
        let mut report = ImportReport::new("ROS map");
        report.record(Treatment::Suspicious, "gray 205 is free", "", "");
        report.record(Treatment::NotUsed, "the key `frame`", "line 1", "");
        let map = room().with_report(report);
        assert_eq!(map_warnings(&map), ["the map: suspicious: gray 205 is free"]);
    }

    fn learned(log: &BagLog) -> Result<LearnedSensor, InputError> {
        let own = scan_options(&SensorOptions::default(), &log.scans, None, None);
        let options = SensorOptions { distance_edges_m: vec![2.0], ..own };
        learn("f", log, &room(), &options, &options.check()?)
    }

    #[test]
    fn what_was_missed_and_what_is_not_there_is_told_by_the_map() {
        // Walls stand at 1 m, beyond the range (at 5 m), and at 3 m.
        let nothing = f32::INFINITY;
        let scans = vec![
            scan(0, [1.0, nothing, 3.0]),
            scan(1, [nothing, 2.0, 1.0]),
            scan(2, [1.1, nothing, 4.4]),
        ];
        let model = learned(&log(scans)).unwrap();
        let against =
            MapComparison { agreeing: 5, missed: 1, seen_through: 1, in_front: 1, not_there: 1 };
        assert_eq!(model.report.against_map, Some(against));
        assert_eq!(against.frame_warning(), None);
        let elsewhere = MapComparison { agreeing: 2, ..against };
        let warning = elsewhere.frame_warning().expect("most beams disagree");
        assert!(
            warning.starts_with("only 33.3 % of the beams end where the map has a wall"),
            "{warning}"
        );
        assert_eq!(model.report.confusion.cells(), [[2.0, 1.0], [1.0, 5.0]]);
        assert_eq!(model.report.distance_counts.0.cells(), [[2.0, 0.0], [1.0, 2.0]]);
        assert!(model.report.warnings[0].starts_with("11.1 % of the beams"));
        let designates = &model.profile.designates;
        assert!(designates.iter().all(|(_, seen)| seen == WALL) && designates.len() == 3);
        assert_eq!(
            (model.profile.range_m, &*model.profile.bearings_deg),
            (4.5, &[-90.0, 0.0, 90.0][..])
        );
    }

    #[test]
    fn what_cannot_be_judged_is_told_by_its_cause() {
        let scans = vec![scan(0, [f32::NAN, f32::NEG_INFINITY, 3.0]), scan(9, [1.0; 3])];
        let report = learned(&log(scans)).unwrap().report;
        let causes = [("nearer_than_measured", 1), ("no_number", 1), ("no_true_pose", 3)];
        assert_eq!(report.skipped_by_cause, causes.map(|(cause, n)| (cause.to_string(), n)).into());
        assert_eq!((report.measurements, report.sightings, report.skipped), (6, 1, 5));
        let error = learned(&log(vec![scan(9, [1.0; 3])])).unwrap_err();
        assert!(error.cause().contains("3 no true pose"), "{error}");
        let far = BagLog { truth: vec![pose(0.0, 99.0)].into(), ..log(vec![scan(0, [1.0; 3])]) };
        assert!(learned(&far).unwrap_err().cause().contains("3 unmapped"));
    }

    #[test]
    fn a_scanner_is_where_it_is_mounted_and_may_hang_upside_down() {
        // Ahead of the middle, turned by half a turn about x: left is right.
        let mount = view::Pose { at_m: [0.4, 0.0, 0.0], turn: [1.0, 0.0, 0.0, 0.0] };
        let mounts = [("laser".to_owned(), mount)].into();
        let hanging = BagLog { mounts, ..log(vec![scan(0, [3.0, 4.4, 1.0])]) };
        let report = learned(&hanging).unwrap().report;
        assert_eq!(report.against_map.map(|beams| (beams.agreeing, beams.not_there)), Some((2, 1)));
        assert!(report.errors.range_error_m.unwrap().sd < 1e-6);
        let behind = ScannerMount::from_pose(view::Pose::from_heading([0.0, 1.0, 0.0], PI));
        let (from_m, direction_rad) = behind.beam(&Pose2::from([2.0, 1.0, FRAC_PI_2]), 0.0);
        assert!((from_m[0] - 1.0).abs() < 1e-9 && (direction_rad - 1.5 * PI).abs() < 1e-9);
    }

    #[test]
    fn each_frame_of_scans_has_its_own_place_and_the_range_is_the_greatest_of_all() {
        let mut behind = scan(1, [3.0, 2.0, 1.0]);
        behind.header.frame_id = "rear".into();
        behind.range_max_m = 7.0;
        let mut both = log(vec![scan(0, [1.0, f32::INFINITY, 3.0]), behind]);
        // It looks to the right from a meter behind the first: the wall behind is at 1 m.
        both.truth = (0..5).map(|k| pose(f64::from(k), 2.0)).collect();
        let facing = view::Pose::from_heading([-1.0, 0.0, 0.0], -FRAC_PI_2);
        both.mounts.insert("rear".into(), facing);
        let own = scan_options(&SensorOptions::default(), &both.scans, None, None);
        assert_eq!(own.range_m, 7.0);
        let report = learned(&both).unwrap().report;
        assert_eq!(report.skipped, 0);
        assert!(!report.warnings.iter().any(|warning| warning.contains("places the frame")));
    }

    #[test]
    fn what_was_found_in_the_bag_is_a_warning() {
        let mut found = log(vec![scan(0, [1.0, f32::INFINITY, 3.0])]);
        found.report.record(Treatment::Guessed, "NaN on /scan is no echo", "", "");
        found.report.record(Treatment::NotUsed, "ranges that are 0", "", "");
        let warnings = learned(&found).unwrap().report.warnings;
        assert_eq!(warnings[0], "the bag: guessed: NaN on /scan is no echo");
        assert!(!warnings.iter().any(|warning| warning.contains("not used")));
    }

    #[test]
    fn a_scanner_that_nothing_places_is_warned_of() {
        let scans = vec![scan(0, [1.0, f32::INFINITY, 3.0])];
        let unplaced = BagLog { mounts: BTreeMap::new(), ..log(scans) };
        assert!(learned(&unplaced).unwrap().report.warnings[0].contains("`laser`"));
    }

    #[test]
    fn odometry_tells_the_way_since_the_last_true_pose_up_to_a_meter() {
        let way = |far_m: f64| {
            let odometry =
                (0..30).map(|k| pose(0.1 * f64::from(k), far_m * f64::from(k) / 20.0)).collect();
            // At 2 s the robot is `far_m` ahead of the last true pose, so that the wall is nearer.
            let truth = vec![pose(0.0, 1.0), pose(9.0, 1.0)].into();
            let scans = vec![scan(2, [1.0, (5.0 - far_m) as f32, 3.0])];
            learned(&BagLog { odometry, truth, ..log(scans) })
        };
        let report = way(0.8).unwrap().report;
        assert_eq!(report.against_map.map(|beams| beams.agreeing), Some(3), "{report:?}");
        assert!(way(1.2).unwrap_err().cause().contains("no true pose"));
    }

    #[test]
    fn a_scan_of_many_beams_becomes_a_fan_of_few_around_the_same_middle() {
        let mut wide = scan(0, [1.0; 3]);
        (wide.ranges_m, wide.angle_min_rad) = (vec![1.0; 360], -PI as f32);
        wide.angle_increment_rad = (PI / 180.0) as f32;
        let fan = scan_options(&SensorOptions::default(), &[wide], Some(3.0), None);
        assert_eq!((fan.bearings_deg.len(), fan.range_m), (16, 3.0));
        assert!((fan.bearings_deg[8] - 15.0).abs() < 2.0, "{:?}", fan.bearings_deg);
        assert!(matches!(room().cast_ray([1.0, 1.0], 0.0, 9.0), RayHit::Wall(_)));
    }
}
