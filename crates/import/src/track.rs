//! Poses over time, cut where one motion cannot lead from one to the next.
//!
//! Motion capture loses a body, a localization program finds itself elsewhere, a driver of odometry starts again at 0:
//! between such poses the robot did not move, and what is learned across them would be errors that no robot makes.

use std::ops::Deref;

use sidestep_kernel::math::{hypot, wrap_angle};

use crate::report::{ImportReport, Treatment};

/// A pose in the plane at a time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StampedPose2 {
    /// Time in s.
    pub t_secs: f64,
    /// Position in the world, in meters.
    pub position_m: [f64; 2],
    /// Heading in rad, counterclockwise from the x axis.
    pub heading_rad: f64,
}

/// Poses by time. Nothing is known of the time between the two poses at a cut.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Track {
    poses: Vec<StampedPose2>,
    /// The index of the first pose after each cut, increasing.
    cuts: Vec<usize>,
}

impl From<Vec<StampedPose2>> for Track {
    /// Returns poses, given by time, as a track without cuts.
    fn from(poses: Vec<StampedPose2>) -> Self {
        Self { poses, cuts: Vec::new() }
    }
}

impl FromIterator<StampedPose2> for Track {
    fn from_iter<I: IntoIterator<Item = StampedPose2>>(poses: I) -> Self {
        Vec::from_iter(poses).into()
    }
}

impl Deref for Track {
    type Target = [StampedPose2];

    fn deref(&self) -> &[StampedPose2] {
        &self.poses
    }
}

impl Track {
    /// Returns whether the track is cut before the pose at `index`.
    pub fn is_cut_before(&self, index: usize) -> bool {
        self.cuts.binary_search(&index).is_ok()
    }

    /// Returns the number of cuts.
    pub fn cuts(&self) -> usize {
        self.cuts.len()
    }
}

/// The usual speed times this is the limit: a robot that mostly drives at one speed can be faster at times.
const SPEED_FACTOR: f64 = 3.0;
/// What is slower, in m/s or rad/s, is the noise of a robot that stands: the usual speed is the median of the others.
const MIN_USUAL: f64 = 0.02;
/// Where a greater share of steps, and more than a few, would be jumps, the limit is too low: it is doubled.
const MAX_JUMP_FRACTION: f64 = 0.05;
const MAX_FEW_JUMPS: usize = 4;
/// No limit that is guessed is below this speed in m/s, nor below this rate in rad/s: slow robots are pushed and lifted.
const MIN_SPEED_MPS: f64 = 1.0;
const MIN_RATE_RADPS: f64 = 4.0;
/// Speeds are taken over at least this time: over a shorter one they are those of the noise of poses.
const SPEED_STEP_SECS: f64 = 0.2;
/// Stamps may be wrong by this time, and poses by this distance and angle.
const STAMP_TOLERANCE_SECS: f64 = 0.1;
const DISTANCE_TOLERANCE_M: f64 = 0.1;
const ANGLE_TOLERANCE_RAD: f64 = 0.3;
/// Poses far off for at most this time, after which the track goes on where it was, are poses of something else.
const MAX_EXCURSION_SECS: f64 = 2.0;
/// As many poses that are equal to the last bit are no measurements, where a jump follows or precedes them.
const MIN_FROZEN: usize = 3;

/// The greatest speed of a robot: what is faster is no motion of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpeedRule {
    /// The greatest speed in m/s.
    pub max_speed_mps: f64,
    /// The greatest rate of turning in rad/s.
    pub max_rate_radps: f64,
    /// Whether the speed was given, else it is guessed from the tracks.
    pub is_given: bool,
}

impl SpeedRule {
    /// Returns the rule for tracks of one robot: the given speed, or three times its usual speed, at least 1 m/s; twice that,
    /// and so on, while more than 5 % of the steps would be jumps. Of several tracks the slower counts.
    pub fn for_tracks(max_speed_mps: Option<f64>, tracks: &[&[StampedPose2]]) -> Self {
        let [mut speed_mps, mut rate_radps] = [f64::INFINITY; 2];
        for track in tracks {
            let [usual_mps, usual_radps] = usual_motion(track);
            if usual_mps > 0.0 || usual_radps > 0.0 {
                speed_mps = speed_mps.min(limit(track, usual_mps, MIN_SPEED_MPS, is_moved));
                rate_radps = rate_radps.min(limit(track, usual_radps, MIN_RATE_RADPS, is_turned));
            }
        }
        let guessed_mps = if speed_mps.is_finite() { speed_mps } else { MIN_SPEED_MPS };
        Self {
            max_speed_mps: max_speed_mps.unwrap_or(guessed_mps),
            max_rate_radps: if rate_radps.is_finite() { rate_radps } else { MIN_RATE_RADPS },
            is_given: max_speed_mps.is_some(),
        }
    }

    /// Returns whether the robot can have moved from one pose to the other: over the time between their stamps and a
    /// tenth of a second, and 0.1 m and 0.3 rad more.
    pub fn is_possible(&self, from: &StampedPose2, to: &StampedPose2) -> bool {
        !is_moved(from, to, self.max_speed_mps) && !is_turned(from, to, self.max_rate_radps)
    }
}

/// Returns whether a step is longer than a speed in m/s allows.
fn is_moved(from: &StampedPose2, to: &StampedPose2, max_mps: f64) -> bool {
    distance_m(from, to) > max_mps * step_secs(from, to) + DISTANCE_TOLERANCE_M
}

/// Returns whether a turn is wider than a rate in rad/s allows.
fn is_turned(from: &StampedPose2, to: &StampedPose2, max_radps: f64) -> bool {
    let turn_rad = wrap_angle(to.heading_rad - from.heading_rad).abs();
    turn_rad > max_radps * step_secs(from, to) + ANGLE_TOLERANCE_RAD
}

fn step_secs(from: &StampedPose2, to: &StampedPose2) -> f64 {
    (to.t_secs - from.t_secs).abs() + STAMP_TOLERANCE_SECS
}

/// Returns the limit of a track by its usual speed or rate.
fn limit(
    track: &[StampedPose2],
    usual: f64,
    least: f64,
    is_beyond: fn(&StampedPose2, &StampedPose2, f64) -> bool,
) -> f64 {
    let max_jumps = MAX_FEW_JUMPS.max((track.len() as f64 * MAX_JUMP_FRACTION) as usize);
    let mut limit = (SPEED_FACTOR * usual).max(least);
    let jumps =
        |limit| track.windows(2).filter(|pair| is_beyond(&pair[0], &pair[1], limit)).count();
    while limit.is_finite() && jumps(limit) > max_jumps {
        limit *= 2.0;
    }
    limit
}

fn distance_m(from: &StampedPose2, to: &StampedPose2) -> f64 {
    hypot(to.position_m[0] - from.position_m[0], to.position_m[1] - from.position_m[1])
}

/// Returns the usual speed in m/s and rate in rad/s of a robot while it moves; 0 where it never does.
fn usual_motion(track: &[StampedPose2]) -> [f64; 2] {
    let mut speeds = Vec::new();
    let mut rates = Vec::new();
    let Some(mut last) = track.first() else { return [0.0; 2] };
    for pose in track {
        let secs = pose.t_secs - last.t_secs;
        if secs < SPEED_STEP_SECS {
            continue;
        }
        speeds.push(distance_m(last, pose) / secs);
        rates.push(wrap_angle(pose.heading_rad - last.heading_rad).abs() / secs);
        last = pose;
    }
    [usual(speeds), usual(rates)]
}

fn usual(mut values: Vec<f64>) -> f64 {
    values.retain(|value| *value >= MIN_USUAL);
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}

/// A track after its jumps were cut.
#[derive(Debug, Clone, PartialEq)]
pub struct CutTrack {
    /// The poses that are left.
    pub track: Track,
    /// The jumps, as `at 5.000 s: 3.21 m in 0.050 s`.
    pub jumps: Vec<String>,
    /// Number of poses that were left out: those of an excursion, and frozen ones beside a jump.
    pub dropped: usize,
}

/// Cuts poses, given by time, where the robot cannot have moved from one to the next. Left out are excursions of at most
/// two seconds after which the track goes on where it was, and poses that are equal to the last bit beside a jump: a
/// body that motion capture has lost stays where it was seen last, or at the origin.
pub fn cut_track(poses: Vec<StampedPose2>, rule: &SpeedRule) -> CutTrack {
    let jumps: Vec<usize> =
        (1..poses.len()).filter(|k| !rule.is_possible(&poses[k - 1], &poses[*k])).collect();
    if jumps.is_empty() {
        return CutTrack { track: poses.into(), jumps: Vec::new(), dropped: 0 };
    }
    let described = jumps.iter().map(|k| describe_jump(&poses[k - 1], &poses[*k])).collect();
    let mut is_kept = vec![true; poses.len()];
    drop_frozen(&poses, &jumps, &mut is_kept);
    drop_excursions(&poses, &jumps, rule, &mut is_kept);
    let mut track = Track::default();
    let mut is_cut = false;
    for (k, pose) in poses.iter().enumerate() {
        is_cut |= !is_kept[k] || jumps.binary_search(&k).is_ok();
        if !is_kept[k] {
            continue;
        }
        if is_cut && !track.poses.is_empty() {
            track.cuts.push(track.poses.len());
        }
        track.poses.push(*pose);
        is_cut = false;
    }
    let dropped = poses.len() - track.poses.len();
    CutTrack { track, jumps: described, dropped }
}

/// Describes a step, as `at 5.000 s: 3.21 m and 0.10 rad in 0.050 s`.
pub(crate) fn describe_jump(from: &StampedPose2, to: &StampedPose2) -> String {
    let turn_rad = wrap_angle(to.heading_rad - from.heading_rad).abs();
    format!(
        "at {:.3} s: {:.2} m and {:.2} rad in {:.3} s",
        to.t_secs,
        distance_m(from, to),
        turn_rad,
        to.t_secs - from.t_secs
    )
}

/// Drops equal poses before and after jumps; the first before a jump was measured.
fn drop_frozen(poses: &[StampedPose2], jumps: &[usize], is_kept: &mut [bool]) {
    let is_same = |a: &StampedPose2, b: &StampedPose2| {
        a.position_m == b.position_m && a.heading_rad == b.heading_rad
    };
    for &jump in jumps {
        let mut start = jump - 1;
        while start > 0 && is_same(&poses[start - 1], &poses[jump - 1]) {
            start -= 1;
        }
        if jump - start >= MIN_FROZEN {
            is_kept[start + 1..jump].fill(false);
        }
        let mut end = jump + 1;
        while end < poses.len() && is_same(&poses[end], &poses[jump]) {
            end += 1;
        }
        if end - jump >= MIN_FROZEN {
            is_kept[jump..end].fill(false);
        }
    }
}

/// Drops short stretches between two jumps after which the track goes on where it was.
fn drop_excursions(
    poses: &[StampedPose2],
    jumps: &[usize],
    rule: &SpeedRule,
    is_kept: &mut [bool],
) {
    let mut next = 0;
    while next < jumps.len() {
        let start = jumps[next];
        let last = &poses[start - 1];
        let is_back = |end: &usize| {
            poses[*end].t_secs - last.t_secs <= MAX_EXCURSION_SECS
                && rule.is_possible(last, &poses[*end])
        };
        let back = jumps[next + 1..].iter().position(is_back);
        let Some(back) = back else {
            next += 1;
            continue;
        };
        let end = jumps[next + 1 + back];
        is_kept[start..end].fill(false);
        next += back + 2;
    }
}

/// Cuts the poses of `place` (`/truth`) and records what was found.
pub fn cut_and_report(
    place: &str,
    poses: Vec<StampedPose2>,
    rule: &SpeedRule,
    report: &mut ImportReport,
) -> Track {
    let cut = cut_track(poses, rule);
    for jump in &cut.jumps {
        let rule = format!("jumps of {place}, at which its track is cut");
        report.record(Treatment::Repaired, rule, jump.clone(), "");
    }
    if !cut.jumps.is_empty() && !rule.is_given {
        let rule = format!("the robot moves at most {:.2} m/s", rule.max_speed_mps);
        let is_known = report.findings.iter().any(|finding| finding.rule == rule);
        if !is_known {
            report.record(Treatment::Guessed, rule, "", "give --max-speed M/S for another limit");
        }
    }
    let rule = format!("poses of {place} beside a jump, of a body that was lost");
    for _ in 0..cut.dropped {
        report.record(Treatment::Dropped, rule.clone(), "", "");
    }
    cut.track
}

/// No robot usually drives as fast as this, in m/s: lengths are in other units then.
const MAX_USUAL_MPS: f64 = 60.0;

/// Returns the usual speed in m/s where it is one that no robot has.
pub(crate) fn absurd_speed_mps(poses: &[StampedPose2]) -> Option<f64> {
    let [usual_mps, _] = usual_motion(poses);
    (usual_mps > MAX_USUAL_MPS).then_some(usual_mps)
}

/// Records a usual speed that no robot has.
pub(crate) fn record_absurd_speed(place: &str, speed_mps: Option<f64>, report: &mut ImportReport) {
    let Some(speed_mps) = speed_mps else { return };
    let rule =
        format!("the usual speed of {place} is {speed_mps:.0} m/s: lengths look like millimeters");
    report.record(Treatment::Suspicious, rule, "", "give lengths in meters");
}

/// Truth that stays equal to the last bit while odometry claims more than this way is hardly measured.
const MAX_FROZEN_WAY_M: f64 = 3.0;

/// Records where true poses stay as they are to the last bit while odometry drives on: the body was lost, or the robot
/// stood against a wall.
pub fn report_frozen(place: &str, truth: &Track, odometry: &Track, report: &mut ImportReport) {
    let mut start = 0;
    for end in 1..=truth.len() {
        let is_same = end < truth.len()
            && truth[end].position_m == truth[start].position_m
            && truth[end].heading_rad == truth[start].heading_rad;
        if is_same {
            continue;
        }
        let [from_secs, to_secs] = [truth[start].t_secs, truth[end - 1].t_secs];
        let way_m =
            if end - start >= MIN_FROZEN { way_m(odometry, from_secs, to_secs) } else { 0.0 };
        if way_m > MAX_FROZEN_WAY_M {
            let rule =
                format!("poses of {place} that stay equal to the last bit while odometry drives");
            let place = format!("from {from_secs:.3} to {to_secs:.3} s: {way_m:.2} m");
            let remedy = "cut that time out of the recording if the body was lost";
            report.record(Treatment::Suspicious, rule, place, remedy);
        }
        start = end;
    }
}

/// Returns the length of the way of a track between two times.
fn way_m(track: &Track, from_secs: f64, to_secs: f64) -> f64 {
    let first = track.partition_point(|pose| pose.t_secs < from_secs);
    let last = track.partition_point(|pose| pose.t_secs <= to_secs);
    let steps = (first + 1..last).filter(|k| !track.is_cut_before(*k));
    steps.map(|k| distance_m(&track[k - 1], &track[k])).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Twenty poses a second at 0.4 m/s.
    fn drive(n: u32) -> Vec<StampedPose2> {
        let at = |k: u32| StampedPose2 {
            t_secs: 0.05 * f64::from(k),
            position_m: [3.0 + 0.02 * f64::from(k), 1.0],
            heading_rad: 0.0,
        };
        (0..n).map(at).collect()
    }

    fn cut(poses: Vec<StampedPose2>) -> CutTrack {
        let rule = SpeedRule::for_tracks(None, &[&drive(100), &poses]);
        cut_track(poses, &rule)
    }

    #[test]
    fn a_drive_in_millimeters_is_suspicious() {
        let said = |factor: f64| {
            let mut poses = drive(100);
            poses.iter_mut().for_each(|pose| pose.position_m[0] *= factor);
            let mut report = ImportReport::new("log");
            record_absurd_speed("ODOM", absurd_speed_mps(&poses), &mut report);
            report.findings.iter().map(ToString::to_string).collect::<Vec<_>>()
        };
        assert_eq!(said(1.0), [""; 0]);
        let words = "suspicious: the usual speed of ODOM is 400 m/s: lengths look like millimeters";
        assert!(said(1000.0)[0].starts_with(words), "{:?}", said(1000.0));
    }

    #[test]
    fn a_plain_drive_is_one_piece() {
        let found = cut(drive(100));
        assert_eq!((found.track.len(), found.track.cuts(), found.jumps.len()), (100, 0, 0));
    }

    #[test]
    fn a_body_that_is_lost_for_a_while_is_left_out() {
        let mut poses = drive(400);
        for pose in &mut poses[200..220] {
            (pose.position_m, pose.heading_rad) = ([0.0; 2], 0.0);
        }
        let found = cut(poses);
        assert_eq!((found.dropped, found.jumps.len()), (20, 2));
        assert_eq!((found.track.len(), found.track.cuts()), (380, 1));
        assert!(found.track.is_cut_before(200) && !found.track.is_cut_before(199));
        assert!(found.jumps[0].starts_with("at 10.000 s: 7.0"), "{:?}", found.jumps);
    }

    #[test]
    fn one_pose_elsewhere_is_left_out() {
        let mut poses = drive(50);
        poses[20].position_m = [9.0, 9.0];
        let found = cut(poses);
        assert_eq!((found.dropped, found.track.cuts()), (1, 1));
    }

    #[test]
    fn a_robot_that_finds_itself_elsewhere_and_odometry_that_starts_again_are_cut_only() {
        let mut poses = drive(100);
        for pose in &mut poses[60..] {
            pose.position_m[0] -= 4.2;
        }
        let found = cut(poses);
        assert_eq!((found.dropped, found.track.len(), found.track.cuts()), (0, 100, 1));
    }

    #[test]
    fn a_body_that_stays_where_it_was_seen_last_is_left_out_until_it_is_seen_again() {
        let mut poses = drive(200);
        for k in 61..140 {
            poses[k].position_m = poses[60].position_m;
        }
        let found = cut(poses);
        assert_eq!((found.dropped, found.track.cuts()), (79, 1));
    }

    #[test]
    fn the_greatest_speed_can_be_given() {
        let poses = drive(100);
        let given = SpeedRule::for_tracks(Some(0.0), &[&poses]);
        assert!(given.is_given && given.is_possible(&poses[0], &poses[1]), "0.1 m is noise");
        assert!(!given.is_possible(&poses[0], &poses[9]));
        let fast = SpeedRule::for_tracks(None, &[&poses]);
        assert!((fast.max_speed_mps - 1.2).abs() < 1e-9, "{fast:?}");
        assert_eq!(SpeedRule::for_tracks(None, &[]).max_speed_mps, MIN_SPEED_MPS);
    }

    #[test]
    fn a_vehicle_that_is_much_faster_for_a_part_of_its_way_does_not_jump() {
        let (mut x_m, mut poses) = (0.0, Vec::new());
        for k in 0..400 {
            x_m += if (100..180).contains(&k) { 3.0 } else { 0.05 };
            poses.push(StampedPose2 {
                t_secs: 0.1 * f64::from(k),
                position_m: [x_m, 0.0],
                heading_rad: 0.0,
            });
        }
        let rule = SpeedRule::for_tracks(None, &[&poses]);
        assert_eq!(cut_track(poses, &rule).jumps.len(), 0, "{rule:?}");
    }

    #[test]
    fn a_body_that_is_lost_to_the_end_is_suspicious() {
        let odometry = Track::from(drive(400));
        let mut lost = drive(400);
        for k in 201..400 {
            lost[k].position_m = lost[200].position_m;
        }
        let mut report = ImportReport::default();
        report_frozen("/truth", &odometry, &odometry, &mut report);
        assert_eq!(report.findings, []);
        report_frozen("/truth", &lost.into(), &odometry, &mut report);
        assert!(
            report.findings[0].to_string().contains("from 10.000 to 19.950 s: 3.98 m"),
            "{report:?}"
        );
        report_frozen("/truth", &Track::default(), &odometry, &mut report);
    }

    #[test]
    fn a_heading_that_turns_around_at_once_is_a_jump() {
        let mut poses = drive(100);
        poses[50].heading_rad = 3.0;
        assert_eq!(cut(poses).dropped, 1);
    }

    proptest::proptest! {
        #[test]
        fn poses_are_kept_in_order_and_cuts_lie_between_them(
            steps in proptest::collection::vec((0.0..0.5, -0.5..0.5, proptest::bool::weighted(0.2)), 0..60),
        ) {
            let (mut t_secs, mut x_m) = (0.0, 0.0);
            let mut poses = Vec::new();
            for (secs, step_m, jumps) in steps {
                t_secs += secs;
                x_m += if jumps { 50.0 * step_m } else { 0.1 * step_m };
                poses.push(StampedPose2 { t_secs, position_m: [x_m, 0.0], heading_rad: 0.0 });
            }
            let rule = SpeedRule::for_tracks(None, &[&poses]);
            let found = cut_track(poses.clone(), &rule);
            assert_eq!(found.track.len() + found.dropped, poses.len());
            assert!(found.track.windows(2).all(|pair| pair[0].t_secs <= pair[1].t_secs));
            for k in 1..found.track.len() {
                let is_possible = rule.is_possible(&found.track[k - 1], &found.track[k]);
                assert!(is_possible || found.track.is_cut_before(k));
            }
        }
    }
}
