//! The ranges of a scanner.

use super::grid::Pose2;
use sidestep_kernel::math::{cos, sin};
use std::f64::consts::TAU;

/// One turn of a scanner: ranges at equal steps of bearing.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct RangeScan {
    /// The pose of the scanner on its robot.
    pub mount: Pose2,
    /// The bearing of the first range in the frame of the scanner, in radians.
    pub first_rad: f64,
    /// The step from one range to the next in radians, below 0 for a scanner that turns clockwise.
    pub step_rad: f64,
    /// The ranges in meters; infinite where there is no echo, not a number where nothing was measured.
    pub ranges_m: Vec<f32>,
    /// The smallest range that means something, in meters.
    pub min_m: f64,
    /// The largest range that means something, in meters; a larger one is no echo.
    pub max_m: f64,
}

/// What a scanner reports in a direction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Echo {
    /// Something at a point in the frame of the robot, in meters.
    At([f64; 2]),
    /// Nothing within its range.
    Nothing,
}

impl RangeScan {
    /// Returns whether its numbers can be those of a scan.
    pub fn is_valid(&self) -> bool {
        let numbers = [self.first_rad, self.step_rad, self.min_m, self.max_m];
        let is_finite = numbers.iter().all(|number| number.is_finite()) && self.mount.is_finite();
        is_finite && self.step_rad != 0.0 && self.min_m >= 0.0 && self.max_m > self.min_m
    }

    /// Returns the echo of a range; none where nothing was measured.
    pub fn echo(&self, index: usize) -> Option<Echo> {
        let range_m = f64::from(*self.ranges_m.get(index)?);
        if range_m.is_nan() || range_m < self.min_m {
            return None;
        }
        if range_m > self.max_m {
            return Some(Echo::Nothing);
        }
        let bearing_rad = self.first_rad + index as f64 * self.step_rad;
        let point = [range_m * cos(bearing_rad), range_m * sin(bearing_rad)];
        Some(Echo::At(self.mount.transform_point(point)))
    }

    /// Returns the echo of the range that is nearest to a bearing in the frame of the robot, within half a step of it; a
    /// range that was not measured is replaced by that of a neighbor. None where the scanner does not look.
    pub fn echo_toward(&self, bearing_rad: f64) -> Option<Echo> {
        let index = self.index_of(bearing_rad)?;
        let neighbors = [Some(index), index.checked_sub(1), Some(index + 1)];
        neighbors.into_iter().flatten().find_map(|index| self.echo(index))
    }

    /// Returns whether it has a range in a direction, whatever that reports.
    pub(super) fn looks_toward(&self, bearing_rad: f64) -> bool {
        self.index_of(bearing_rad).is_some()
    }

    fn index_of(&self, bearing_rad: f64) -> Option<usize> {
        let in_scanner_rad = bearing_rad - self.mount.yaw_rad;
        let last = self.ranges_m.len() as f64 - 1.0;
        // Scans begin at -pi, at 0 or elsewhere: the same direction has several numbers.
        let turns = [0.0, TAU, -TAU, 2.0 * TAU, -2.0 * TAU];
        let steps = turns.map(|turn| (in_scanner_rad + turn - self.first_rad) / self.step_rad);
        let found = steps.into_iter().find(|steps| (-0.5..=last + 0.5).contains(steps));
        found.map(|steps| steps.round().clamp(0.0, last.max(0.0)) as usize)
    }
}
