//! What odometry and true poses of one robot say about each other: whether their units, clocks and frames are the same.
//!
//! Where they are not, what is learned from the two is wrong without being damaged: the result of a table of numbers that
//! looks as it should.

use sidestep_kernel::InputError;
use sidestep_kernel::math::{atan2, cos, hypot, sin, wrap_angle};

use crate::report::{ImportReport, Treatment};
use crate::track::{StampedPose2, Track};

/// Both tracks are compared at moments as far apart, in s.
const STEP_SECS: f64 = 0.1;
/// Poses further apart, in s, tell nothing of the motion between them.
const MAX_GAP_SECS: f64 = 2.0;
/// Maximum number of moments: those of a day.
const MAX_MOMENTS: usize = 1 << 20;
/// The greatest lag of a clock that is searched for, in steps.
const MAX_LAG: i64 = 30;
/// A shorter lag, in steps, is one of filters and not of clocks.
const MIN_LAG: i64 = 3;
/// A lag is one where speeds agree so well with it, and so much worse without.
const MIN_CORRELATION: f64 = 0.6;
const MIN_GAIN: f64 = 0.1;
/// Number of moments from which on speeds are compared.
const MIN_COMPARED: usize = 100;

/// Directions of motion are compared over this number of steps, in which the robot moves as far, in m, and turns no
/// further, in rad.
const MOVE_STEPS: usize = 5;
const MIN_MOVE_M: f64 = 0.08;
const MAX_MOVE_TURN_RAD: f64 = 0.2;
/// Number of moves or turns from which on directions are compared.
const MIN_MOVES: usize = 10;
/// Moves agree on an angle where the mean of their directions, as vectors of length 1, is as long.
const MIN_AGREEMENT: f64 = 0.9;
/// A body that is turned by less, in rad, is turned by accident.
const MIN_BODY_TURN_RAD: f64 = 0.2;
/// A body that is turned for a while is turned by more than this, in rad.
const MIN_PART_TURN_RAD: f64 = 0.6;
/// A turn of odometry from which on it has a side, in rad.
const MIN_SIDED_TURN_RAD: f64 = 0.1;
/// Odometry that has turned by more than this in all, in rad, shows that headings which stay are none.
const MIN_TURNED_RAD: f64 = 1.5;

/// Lengths in other units than meters, as the factor by which they are too large.
const UNITS: [(f64, &str); 2] = [(1000.0, "millimeters"), (100.0, "centimeters")];
/// The least way of a track over the moves that are compared, in its unit.
const MIN_WAY: f64 = 1.0;
/// Moves whose lengths are compared last at least as long, in s.
const MIN_MOVE_SECS: f64 = 0.5;
/// A shorter part of the usual move of a track is none: systems that measure a robot that stands report some millimeters.
const MIN_MOVE_SHARE: f64 = 0.3;

/// Checks that the moves of two tracks, given by time, do not differ by the factor of a unit.
///
/// # Errors
/// When those of one are a hundred or a thousand times those of the other over the same times, to 10 %.
pub(crate) fn check_units(
    file: &str,
    [(odometry_name, odometry), (truth_name, truth)]: [(&str, &[StampedPose2]); 2],
) -> Result<(), InputError> {
    let moves = common_moves([odometry, truth]);
    let [odometry_way, truth_way] = [0, 1].map(|i| moves.iter().map(|lengths| lengths[i]).sum());
    if moves.len() < MIN_MOVES || f64::min(odometry_way, truth_way) < MIN_WAY {
        return Ok(());
    }
    let mut ratios: Vec<f64> = moves.iter().map(|[claimed, real]| claimed / real).collect();
    ratios.sort_unstable_by(f64::total_cmp);
    let ratio = ratios[ratios.len() / 2];
    for (factor, unit) in UNITS {
        let is_factor = |ratio: f64| (ratio / factor - 1.0).abs() < 0.1;
        let name = match () {
            () if is_factor(ratio) => odometry_name,
            () if is_factor(1.0 / ratio) => truth_name,
            () => continue,
        };
        let cause = format!(
            "over {} moves of the same times the way of {odometry_name} is {odometry_way:.1} and that of {truth_name} \
             {truth_way:.1}: the lengths of {name} are {unit}",
            moves.len()
        );
        return Err(InputError::new(file, cause, format!("give {name} in meters")));
    }
    Ok(())
}

/// Returns the distances that two tracks move over the same times, where both do: between poses of the one that has fewer.
fn common_moves(tracks: [&[StampedPose2]; 2]) -> Vec<[f64; 2]> {
    let [Some(start_secs), Some(end_secs)] = [
        latest(tracks.map(|track| track.first().map(|pose| pose.t_secs))),
        latest(tracks.map(|track| track.last().map(|pose| -pose.t_secs))).map(|t_secs| -t_secs),
    ] else {
        return Vec::new();
    };
    let common = tracks.map(|track| {
        let start = track.partition_point(|pose| pose.t_secs < start_secs);
        let end = track.partition_point(|pose| pose.t_secs <= end_secs);
        &track[start.min(end)..end]
    });
    let sparse = if common[0].len() <= common[1].len() { common[0] } else { common[1] };
    let mut moments: Vec<f64> = Vec::new();
    for pose in sparse {
        if moments.last().is_none_or(|last| pose.t_secs - last >= MIN_MOVE_SECS) {
            moments.push(pose.t_secs);
        }
    }
    let [claimed, real] = tracks.map(|track| sample(track, &|_| false, moments.iter().copied()));
    let way =
        |poses: &[Option<StampedPose2>]| Some(distance(poses[0].as_ref()?, poses[1].as_ref()?));
    let pairs = claimed.windows(2).zip(real.windows(2));
    let moves: Vec<[f64; 2]> =
        pairs.filter_map(|(claimed, real)| Some([way(claimed)?, way(real)?])).collect();
    let usual = [0, 1].map(|i| usual_move(moves.iter().map(|lengths| lengths[i]).collect()));
    let is_move = |lengths: &[f64; 2]| {
        (0..2).all(|i| lengths[i] > 0.0 && lengths[i] >= MIN_MOVE_SHARE * usual[i])
    };
    moves.into_iter().filter(is_move).collect()
}

fn latest([a, b]: [Option<f64>; 2]) -> Option<f64> {
    Some(a?.max(b?))
}

/// Returns the length of a move such that longer ones make up half of the way: neither those of a robot that stands nor a
/// few jumps change it.
fn usual_move(mut lengths: Vec<f64>) -> f64 {
    lengths.sort_unstable_by(f64::total_cmp);
    let way: f64 = lengths.iter().sum();
    let mut passed = 0.0;
    for length in lengths {
        passed += length;
        if passed >= 0.5 * way {
            return length;
        }
    }
    0.0
}

/// Records where clocks or frames of odometry and truth can hardly be the same.
pub(crate) fn report_pair(
    [(odometry_name, odometry), (truth_name, truth)]: [(&str, &Track); 2],
    report: &mut ImportReport,
) {
    let Some(pair) = SampledPair::of(odometry, truth) else { return };
    if let Some(rule) = pair.lag_rule(odometry_name, truth_name) {
        let remedy = "synchronize the clocks of the machines, and record again";
        report.record(Treatment::Suspicious, rule, "", remedy);
    }
    if let Some((rule, remedy)) = pair.frame_rule(odometry_name, truth_name) {
        report.record(Treatment::Suspicious, rule, "", remedy);
    }
}

/// Two tracks at the same moments; `None` where one has no pose near.
struct SampledPair {
    odometry: Vec<Option<StampedPose2>>,
    truth: Vec<Option<StampedPose2>>,
}

impl SampledPair {
    fn of(odometry: &Track, truth: &Track) -> Option<Self> {
        let start_secs = odometry.first()?.t_secs.max(truth.first()?.t_secs);
        let end_secs = odometry.last()?.t_secs.min(truth.last()?.t_secs);
        let n = ((end_secs - start_secs) / STEP_SECS).floor();
        if n < 1.0 {
            return None;
        }
        let n = (n as usize).min(MAX_MOMENTS);
        let moments = (0..=n).map(|k| start_secs + k as f64 * STEP_SECS);
        let [odometry, truth] = [odometry, truth]
            .map(|track| sample(track, &|k| track.is_cut_before(k), moments.clone()));
        Some(Self { odometry, truth })
    }

    /// Returns what to say of a lag between the motions.
    fn lag_rule(&self, odometry_name: &str, truth_name: &str) -> Option<String> {
        let motions = [&self.odometry, &self.truth].map(|track| Motion::of(track));
        let without = agreement(&motions, 0)?;
        let (lag, best) = (-MAX_LAG..=MAX_LAG)
            .filter_map(|lag| Some((lag, agreement(&motions, lag)?)))
            .max_by(|(_, a), (_, b)| a.total_cmp(b))?;
        let is_lag = lag.abs() >= MIN_LAG && best >= MIN_CORRELATION && best - without >= MIN_GAIN;
        is_lag.then(|| {
            let side = if lag > 0 { "later" } else { "earlier" };
            format!(
                "the motion by {truth_name} is that by {odometry_name}, {:.1} s {side} (speeds correlate by {best:.2}, and by {without:.2} \
                 without that lag): their clocks differ",
                lag.abs() as f64 * STEP_SECS
            )
        })
    }

    /// Returns what to say of a truth that looks another way than the robot, and the remedy.
    fn frame_rule(&self, odometry_name: &str, truth_name: &str) -> Option<(String, &'static str)> {
        if let Some(turned_rad) = self.turn_beside_still_truth()
            && turned_rad > MIN_TURNED_RAD
        {
            let rule = format!(
                "the heading of {truth_name} never changes, while {odometry_name} turns by {turned_rad:.1} rad in all: these are \
                 positions without directions"
            );
            return Some((rule, "give true poses with the direction in which the robot looks"));
        }
        let pairs: Vec<[[f64; 3]; 2]> = self.displacements();
        let sided: Vec<f64> = pairs
            .iter()
            .filter(|[claimed, _]| claimed[2].abs() > MIN_SIDED_TURN_RAD)
            .map(|[claimed, real]| claimed[2] * real[2])
            .collect();
        let squares: f64 = pairs.iter().map(|[claimed, _]| claimed[2] * claimed[2]).sum();
        if sided.len() >= MIN_MOVES && sided.iter().sum::<f64>() < -0.5 * squares {
            let rule = format!(
                "by {truth_name} the robot turns to the right where by {odometry_name} it turns to the left: one is mirrored"
            );
            return Some((
                rule,
                "give both in frames whose y axis points to the left of x, and z up",
            ));
        }
        let angles = self.move_angles();
        if let Some(rule) = turned_part_rule(&angles, truth_name) {
            return Some((
                rule,
                "cut these times out of the recording: the body was turned, or taken for another",
            ));
        }
        let off_rad = usual_angle(&angles)?;
        (off_rad.abs() > MIN_BODY_TURN_RAD).then(|| {
            let side = if off_rad > 0.0 { "left" } else { "right" };
            let rule = format!(
                "the robot moves {:.0} degrees to the {side} of the heading by {truth_name}, as {odometry_name} shows: the body of \
                 {truth_name} is turned",
                off_rad.to_degrees().abs()
            );
            (rule, "turn the body in the system that gives the true poses, so that its x axis points ahead")
        })
    }

    /// Returns by how much odometry turns in all beside a truth whose heading never changes; `None` where it does, or too
    /// little of both is known.
    fn turn_beside_still_truth(&self) -> Option<f64> {
        let mut turned_rad = 0.0;
        let mut n = 0;
        for (claimed, real) in self.odometry.windows(2).zip(self.truth.windows(2)) {
            let [Some(claimed), Some(real)] = [claimed, real].map(displacement_of) else {
                continue;
            };
            if real[2] != 0.0 {
                return None;
            }
            turned_rad += claimed[2].abs();
            n += 1;
        }
        (n >= MIN_COMPARED).then_some(turned_rad)
    }

    /// Returns the angles from the direction of motion by odometry to that by truth, each in its own body, with the times
    /// in s, where both move without turning.
    fn move_angles(&self) -> Vec<(f64, f64)> {
        let starts = (0..self.odometry.len()).step_by(MOVE_STEPS);
        let times = starts.filter_map(|k| self.displacement_at(k));
        let angle = |(t_secs, [claimed, real]): (f64, [[f64; 3]; 2])| {
            let is_move = [claimed, real].iter().all(|motion| {
                hypot(motion[0], motion[1]) > MIN_MOVE_M && motion[2].abs() < MAX_MOVE_TURN_RAD
            });
            let angle_rad = atan2(real[1], real[0]) - atan2(claimed[1], claimed[0]);
            is_move.then_some((t_secs, angle_rad))
        };
        times.filter_map(angle).collect()
    }

    fn displacement_at(&self, k: usize) -> Option<(f64, [[f64; 3]; 2])> {
        let motion = |track: &[Option<StampedPose2>]| {
            Some(displacement(track[k].as_ref()?, track.get(k + MOVE_STEPS)?.as_ref()?))
        };
        let t_secs = self.truth[k].as_ref()?.t_secs;
        Some((t_secs, [motion(&self.odometry)?, motion(&self.truth)?]))
    }

    /// Returns the motions of odometry and truth over the same times.
    fn displacements(&self) -> Vec<[[f64; 3]; 2]> {
        let starts = (0..self.odometry.len()).step_by(MOVE_STEPS);
        starts.filter_map(|k| self.displacement_at(k)).map(|(_, motions)| motions).collect()
    }
}

/// Returns the usual one of angles with times; `None` where they do not agree on one.
fn usual_angle(angles: &[(f64, f64)]) -> Option<f64> {
    let [x, y] = [cos as fn(f64) -> f64, sin]
        .map(|part| angles.iter().map(|(_, angle_rad)| part(*angle_rad)).sum::<f64>());
    let agreement = hypot(x, y) / angles.len().max(1) as f64;
    (angles.len() >= MIN_MOVES && agreement > MIN_AGREEMENT).then(|| atan2(y, x))
}

/// Returns what to say of a truth that looks where the robot drives at times, and elsewhere at others.
fn turned_part_rule(angles: &[(f64, f64)], truth_name: &str) -> Option<String> {
    let parts = angles.chunks_exact(MIN_MOVES);
    let known = parts.filter_map(|part| Some((part[0].0, usual_angle(part)?)));
    let parts: Vec<(f64, f64)> = known.collect();
    let is_straight = parts.iter().any(|(_, angle_rad)| angle_rad.abs() <= MIN_BODY_TURN_RAD);
    let mut turned = parts.iter().filter(|(_, angle_rad)| angle_rad.abs() > MIN_PART_TURN_RAD);
    let (t_secs, angle_rad) = turned.next().filter(|_| is_straight)?;
    Some(format!(
        "the heading by {truth_name} is that in which the robot drives at times, and {:.0} degrees off at others, first about \
         {t_secs:.3} s",
        angle_rad.to_degrees().abs()
    ))
}

/// Returns the motion between two poses in the frame of the first: ahead and left in m, turn in rad.
fn displacement(from: &StampedPose2, to: &StampedPose2) -> [f64; 3] {
    let [dx_m, dy_m] = [0, 1].map(|i| to.position_m[i] - from.position_m[i]);
    let [c, s] = [cos(from.heading_rad), sin(from.heading_rad)];
    [c * dx_m + s * dy_m, c * dy_m - s * dx_m, wrap_angle(to.heading_rad - from.heading_rad)]
}

/// Returns the motion between two moments where both have a pose.
fn displacement_of(poses: &[Option<StampedPose2>]) -> Option<[f64; 3]> {
    Some(displacement(poses[0].as_ref()?, poses[1].as_ref()?))
}

fn distance(from: &StampedPose2, to: &StampedPose2) -> f64 {
    hypot(to.position_m[0] - from.position_m[0], to.position_m[1] - from.position_m[1])
}

/// Returns a track at moments in their order; `is_cut` tells before which of its poses it is cut.
fn sample(
    track: &[StampedPose2],
    is_cut: &dyn Fn(usize) -> bool,
    moments: impl Iterator<Item = f64>,
) -> Vec<Option<StampedPose2>> {
    let mut next = 0;
    moments
        .map(|t_secs| {
            while next < track.len() && track[next].t_secs <= t_secs {
                next += 1;
            }
            let before = &track[next.checked_sub(1)?];
            if before.t_secs == t_secs {
                return Some(*before);
            }
            between(before, track.get(next)?, t_secs).filter(|_| !is_cut(next))
        })
        .collect()
}

fn between(before: &StampedPose2, after: &StampedPose2, t_secs: f64) -> Option<StampedPose2> {
    let gap_secs = after.t_secs - before.t_secs;
    if gap_secs > MAX_GAP_SECS {
        return None;
    }
    let share = (t_secs - before.t_secs) / gap_secs;
    let along =
        |i: usize| before.position_m[i] + share * (after.position_m[i] - before.position_m[i]);
    let turn_rad = wrap_angle(after.heading_rad - before.heading_rad);
    let heading_rad = before.heading_rad + share * turn_rad;
    Some(StampedPose2 { t_secs, position_m: [along(0), along(1)], heading_rad })
}

/// Speeds in m/s and rates in rad/s, without their side, from moment to moment.
struct Motion {
    speeds: Vec<Option<f64>>,
    rates: Vec<Option<f64>>,
}

impl Motion {
    fn of(track: &[Option<StampedPose2>]) -> Self {
        let steps: Vec<Option<[f64; 3]>> = track.windows(2).map(displacement_of).collect();
        let of = |value: fn([f64; 3]) -> f64| steps.iter().map(|step| step.map(value)).collect();
        Self {
            speeds: of(|[ahead, left, _]| hypot(ahead, left) / STEP_SECS),
            rates: of(|[_, _, turn]| turn.abs() / STEP_SECS),
        }
    }
}

/// Returns the mean of the correlations of speeds and of rates, with truth so many steps later.
fn agreement([odometry, truth]: &[Motion; 2], lag: i64) -> Option<f64> {
    let speeds = correlation(&odometry.speeds, &truth.speeds, lag);
    let rates = correlation(&odometry.rates, &truth.rates, lag);
    match (speeds, rates) {
        (Some(a), Some(b)) => Some(0.5 * (a + b)),
        (one, other) => one.or(other),
    }
}

/// Returns the correlation of values with others `lag` places later; `None` where they are few or all the same.
fn correlation(a: &[Option<f64>], b: &[Option<f64>], lag: i64) -> Option<f64> {
    const MIN_VARIANCE: f64 = 1e-6;
    let mut sums = [0.0; 5];
    let mut n = 0;
    for (k, a) in a.iter().enumerate() {
        let other = usize::try_from(k as i64 + lag).ok().and_then(|k| b.get(k).copied().flatten());
        if let (Some(a), Some(b)) = (*a, other) {
            let terms = [a, b, a * a, b * b, a * b];
            (0..5).for_each(|i| sums[i] += terms[i]);
            n += 1;
        }
    }
    if n < MIN_COMPARED {
        return None;
    }
    let [a, b, aa, bb, ab] = sums.map(|sum| sum / n as f64);
    let [variance_a, variance_b] = [aa - a * a, bb - b * b];
    let is_varied = variance_a > MIN_VARIANCE && variance_b > MIN_VARIANCE;
    is_varied.then(|| (ab - a * b) / (variance_a * variance_b).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::FRAC_PI_2;

    /// A robot that drives ahead for 3 s and turns to the left for 1.7 s, again and again, at 20 poses a second; `view` makes
    /// of its pose what a system reports.
    fn drive(view: impl Fn([f64; 3]) -> [f64; 3], lag_secs: f64) -> Track {
        let mut at = [0.0, 0.0, 0.0_f64];
        let mut poses = Vec::new();
        for k in 0..1200 {
            let [x_m, y_m, heading_rad] = view(at);
            let t_secs = 0.05 * f64::from(k) + lag_secs;
            poses.push(StampedPose2 { t_secs, position_m: [x_m, y_m], heading_rad });
            let is_ahead = k % 94 < 60;
            let way_m = if is_ahead { 0.02 } else { 0.0 };
            at[0] += way_m * cos(at[2]);
            at[1] += way_m * sin(at[2]);
            at[2] += if is_ahead { 0.0 } else { 0.04 };
        }
        poses.into()
    }

    fn said(truth: &Track) -> Vec<String> {
        let odometry = drive(|[x, y, heading]| [0.97 * x, 0.97 * y, heading], 0.0);
        let mut report = ImportReport::default();
        report_pair([("/odom", &odometry), ("/truth", truth)], &mut report);
        report.findings.iter().map(ToString::to_string).collect()
    }

    #[test]
    fn tracks_of_one_clock_and_one_body_are_not_remarked() {
        assert_eq!(said(&drive(|at| at, 0.0)), [""; 0]);
        // In a frame of its own, and a little late.
        assert_eq!(said(&drive(|[x, y, heading]| [5.0 - y, x, heading + FRAC_PI_2], 0.1)), [""; 0]);
    }

    #[test]
    fn a_clock_that_is_a_second_off_is_found_by_the_motion() {
        let late = said(&drive(|at| at, 1.0));
        assert!(
            late[0].starts_with("suspicious: the motion by /truth is that by /odom, 1.0 s later"),
            "{late:?}"
        );
        let early = said(&drive(|at| at, -0.7));
        assert!(early[0].contains("0.7 s earlier"), "{early:?}");
    }

    #[test]
    fn a_truth_that_looks_elsewhere_is_named() {
        let turned = said(&drive(|[x, y, heading]| [x, y, heading + FRAC_PI_2], 0.0));
        assert!(
            turned[0].contains("moves 90 degrees to the right of the heading by /truth"),
            "{turned:?}"
        );
        let mirrored = said(&drive(|[x, y, heading]| [x, -y, -heading], 0.0));
        assert!(
            mirrored[0].contains("turns to the right where by /odom it turns to the left"),
            "{mirrored:?}"
        );
        let blind = said(&drive(|[x, y, _]| [x, y, 0.0], 0.0));
        assert!(blind[0].contains("the heading of /truth never changes"), "{blind:?}");
    }

    #[test]
    fn a_truth_that_looks_elsewhere_for_a_while_is_named() {
        let pose = std::cell::Cell::new(0);
        let view = |[x, y, heading]: [f64; 3]| {
            pose.set(pose.get() + 1);
            [x, y, heading + if pose.get() > 600 { 3.0 } else { 0.0 }]
        };
        let flipped = said(&drive(view, 0.0));
        let words = "suspicious: the heading by /truth is that in which the robot drives at times, and 172 degrees off";
        assert!(flipped.iter().any(|line| line.starts_with(words)), "{flipped:?}");
    }

    #[test]
    fn lengths_in_millimeters_are_refused() {
        let plain = drive(|at| at, 0.0);
        let in_mm = drive(|[x, y, heading]| [1000.0 * x, 1000.0 * y, heading], 0.0);
        let check = |odometry: &[StampedPose2], truth: &[StampedPose2]| {
            check_units("bag", [("/odom", odometry), ("/truth", truth)])
        };
        assert!(check(&plain, &plain).is_ok());
        let error = check(&in_mm, &plain).expect_err("millimeters");
        assert!(error.cause().ends_with("the lengths of /odom are millimeters"), "{error}");
        assert_eq!(
            check(&plain, &in_mm).expect_err("millimeters").remedy(),
            "give /truth in meters"
        );
    }

    #[test]
    fn a_truth_whose_poses_are_far_apart_is_not_called_one_without_directions() {
        let dense = drive(|at| at, 0.0);
        let sparse: Vec<StampedPose2> = dense.iter().step_by(50).copied().collect();
        assert_eq!(said(&sparse.into()), [""; 0]);
        // A truth that ends while the robot still drives ahead.
        let short: Vec<StampedPose2> = dense.iter().take(55).copied().collect();
        assert_eq!(said(&short.into()), [""; 0]);
    }

    #[test]
    fn meters_are_not_taken_for_centimeters() {
        let check = |odometry: &[StampedPose2], truth: &[StampedPose2]| {
            check_units("bag", [("/odom", odometry), ("/truth", truth)])
        };
        let pose = |t_secs: f64, x_m: f64| StampedPose2 {
            t_secs,
            position_m: [x_m, 0.0],
            heading_rad: 0.0,
        };
        // It stands for more than half of the time, and the cameras see it shake by a fiftieth of a millimeter.
        let mut x_m = 0.0;
        let mut standing = [Vec::new(), Vec::new()];
        for k in 0..6000 {
            let t_secs = 0.01 * f64::from(k);
            x_m += if k % 1000 < 400 { 0.02 } else { 0.0 };
            standing[0].push(pose(t_secs, 0.98 * x_m));
            standing[1].push(pose(t_secs, x_m + 1e-5 * f64::from(k % 3 - 1)));
        }
        assert_eq!(check(&standing[0], &standing[1]), Ok(()));
        // A truth for one part of the way of odometry.
        let long: Vec<StampedPose2> =
            (0..20_000).map(|k| pose(0.1 * f64::from(k), 0.05 * f64::from(k))).collect();
        let part = &long[500..700];
        assert_eq!(check(&long, part), Ok(()));
        // Three poses of a truth, each a round after the one before.
        let round: Vec<StampedPose2> = (0..=10_000)
            .map(|k| {
                let angle_rad = 1e-3 * f64::from(k) * std::f64::consts::TAU;
                let position_m = [10.0 * cos(angle_rad), 10.0 * sin(angle_rad)];
                StampedPose2 { position_m, ..pose(0.1 * f64::from(k), 0.0) }
            })
            .collect();
        let seldom = [0, 1009, 2018].map(|k| round[k]);
        assert_eq!(check(&round, &seldom), Ok(()));
        // A truth every five seconds is compared all the same.
        let in_cm: Vec<StampedPose2> = long
            .iter()
            .step_by(50)
            .map(|own| pose(own.t_secs, 100.0 * own.position_m[0]))
            .collect();
        assert!(check(&long, &in_cm).is_err());
    }
}
