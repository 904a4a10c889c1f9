//! Poses over time and relative to each other (rule L1).

use sidestep_import::track::{StampedPose2, Track};
use sidestep_kernel::math::{atan2, cos, hypot, sin, wrap_angle};

/// Motion capture with a wider gap than this says nothing about the time between: a robot may turn and come back.
const MAX_INTERPOLATION_SECS: f64 = 0.5;

#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Pose2 {
    pub(crate) x_m: f64,
    pub(crate) y_m: f64,
    pub(crate) heading_rad: f64,
}

/// A displacement in the frame of the pose it starts from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Displacement2 {
    pub(crate) ahead_m: f64,
    pub(crate) left_m: f64,
    /// The turn to the left, in [-pi, pi).
    pub(crate) turn_rad: f64,
}

impl From<[f64; 3]> for Pose2 {
    fn from([x_m, y_m, heading_rad]: [f64; 3]) -> Self {
        Self { x_m, y_m, heading_rad }
    }
}

impl From<StampedPose2> for Pose2 {
    fn from(StampedPose2 { position_m: [x_m, y_m], heading_rad, .. }: StampedPose2) -> Self {
        Self { x_m, y_m, heading_rad }
    }
}

impl From<Pose2> for [f64; 3] {
    fn from(pose: Pose2) -> Self {
        [pose.x_m, pose.y_m, pose.heading_rad]
    }
}

impl Pose2 {
    /// Returns the pose after a motion from here.
    pub(crate) fn compose(&self, motion: &Displacement2) -> Pose2 {
        let (s, c) = (sin(self.heading_rad), cos(self.heading_rad));
        Pose2 {
            x_m: self.x_m + c * motion.ahead_m - s * motion.left_m,
            y_m: self.y_m + s * motion.ahead_m + c * motion.left_m,
            heading_rad: wrap_angle(self.heading_rad + motion.turn_rad),
        }
    }

    /// In the frame of this pose.
    pub(crate) fn motion_to(&self, to: &Pose2) -> Displacement2 {
        let (dx, dy) = (to.x_m - self.x_m, to.y_m - self.y_m);
        let (s, c) = (sin(self.heading_rad), cos(self.heading_rad));
        Displacement2 {
            ahead_m: c * dx + s * dy,
            left_m: c * dy - s * dx,
            turn_rad: wrap_angle(to.heading_rad - self.heading_rad),
        }
    }

    /// Returns the range in meters and the bearing in radians (+ = left) of a point.
    pub(crate) fn range_and_bearing(&self, [x_m, y_m]: [f64; 2]) -> (f64, f64) {
        let (dx, dy) = (x_m - self.x_m, y_m - self.y_m);
        (hypot(dx, dy), wrap_angle(atan2(dy, dx) - self.heading_rad))
    }
}

/// Returns the pose at `t_secs`: linear between the two samples around it, the heading along the
/// shorter arc. `None` outside the track, across a cut of it and inside a gap wider than 0.5 s.
pub(crate) fn pose_at(track: &Track, t_secs: f64) -> Option<Pose2> {
    let after = track.partition_point(|sample| sample.t_secs < t_secs);
    let end = track.get(after)?;
    if after == 0 || end.t_secs == t_secs {
        return (end.t_secs == t_secs).then(|| interpolate(end, end, 0.0));
    }
    let start = &track[after - 1];
    let gap_secs = end.t_secs - start.t_secs;
    (gap_secs <= MAX_INTERPOLATION_SECS && !track.is_cut_before(after))
        .then(|| interpolate(start, end, (t_secs - start.t_secs) / gap_secs))
}

fn interpolate(start: &StampedPose2, end: &StampedPose2, fraction: f64) -> Pose2 {
    let [x_m, y_m] = start.position_m;
    let arc_rad = wrap_angle(end.heading_rad - start.heading_rad);
    Pose2 {
        x_m: x_m + fraction * (end.position_m[0] - x_m),
        y_m: y_m + fraction * (end.position_m[1] - y_m),
        heading_rad: wrap_angle(start.heading_rad + fraction * arc_rad),
    }
}

/// A step of a track is a gap when it is this many times the usual one, and longer than poses are interpolated
/// across.
const GAP_FACTOR: f64 = 3.0;

/// The gaps of a track: the times after which the next pose comes too late to interpolate between the two, or lies
/// behind a cut.
pub(crate) struct Gaps(Vec<f64>);

impl Gaps {
    pub(crate) fn from_track(track: &Track) -> Self {
        let step_secs = |pair: &[StampedPose2]| pair[1].t_secs - pair[0].t_secs;
        let mut steps_secs: Vec<f64> = track.windows(2).map(step_secs).collect();
        steps_secs.sort_by(f64::total_cmp);
        // A simulation with a cycle a second has no gaps between its cycles.
        let usual_secs = steps_secs.get(steps_secs.len() / 2).copied().unwrap_or(0.0);
        let most_secs = MAX_INTERPOLATION_SECS.max(GAP_FACTOR * usual_secs);
        let is_gap = |k: &usize| step_secs(&track[k - 1..=*k]) > most_secs;
        let gaps = (1..track.len()).filter(|k| is_gap(k) || track.is_cut_before(*k));
        Self(gaps.map(|k| track[k - 1].t_secs).collect())
    }

    /// Returns the cuts of a track alone: poses that come late are no gap of what is known at single times.
    pub(crate) fn cuts_of(track: &Track) -> Self {
        let cuts = (1..track.len()).filter(|k| track.is_cut_before(*k));
        Self(cuts.map(|k| track[k - 1].t_secs).collect())
    }

    /// Returns the number of gaps that begin before a time.
    pub(crate) fn count_before(&self, t_secs: f64) -> usize {
        self.0.partition_point(|begin| *begin < t_secs)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::{FRAC_PI_2, PI};

    fn sample(t_secs: f64, x_m: f64, heading_rad: f64) -> StampedPose2 {
        StampedPose2 { t_secs, position_m: [x_m, 0.0], heading_rad }
    }

    #[test]
    fn a_pose_is_linear_between_samples_and_turns_the_shorter_way() {
        let track = Track::from(vec![sample(0.0, 0.0, PI - 0.1), sample(0.4, 1.0, -PI + 0.1)]);
        let pose = pose_at(&track, 0.1).unwrap();
        assert!((pose.x_m - 0.25).abs() < 1e-12);
        assert!((wrap_angle(pose.heading_rad - (PI - 0.05))).abs() < 1e-12);
    }

    #[test]
    fn there_is_no_pose_outside_the_track_or_in_a_gap() {
        let samples = [sample(0.0, 0.0, 0.0), sample(0.75, 1.0, 0.0), sample(1.25, 1.0, 0.0)];
        let track = Track::from_iter(samples);
        assert_eq!(pose_at(&track, -0.1), None);
        assert_eq!(pose_at(&track, 1.3), None);
        assert_eq!(pose_at(&track, 0.3), None);
        assert!(pose_at(&track, 0.8).is_some(), "a gap of exactly 0.5 s is bridged");
        assert!(pose_at(&track, 0.0).is_some() && pose_at(&track, 1.25).is_some());
        assert_eq!(pose_at(&Track::default(), 0.0), None);
    }

    #[test]
    fn motion_is_told_in_the_start_frame() {
        let start = Pose2::from([1.0, 1.0, FRAC_PI_2]);
        let motion = start.motion_to(&Pose2::from([0.0, 3.0, PI]));
        assert!((motion.ahead_m - 2.0).abs() < 1e-12);
        assert!((motion.left_m - 1.0).abs() < 1e-12);
        assert!((motion.turn_rad - FRAC_PI_2).abs() < 1e-12);
        let end = start.compose(&motion);
        assert!((end.x_m - 0.0).abs() < 1e-12 && (end.y_m - 3.0).abs() < 1e-12, "{end:?}");
        let (range_m, bearing_rad) = start.range_and_bearing([0.0, 1.0]);
        assert!((range_m - 1.0).abs() < 1e-12 && (bearing_rad - FRAC_PI_2).abs() < 1e-12);
    }
}
