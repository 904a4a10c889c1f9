//! Two driven wheels on one axle.

use serde::{Deserialize, Serialize};
use sidestep_kernel::InputError;
use sidestep_kernel::math::{cos, sin, wrap_angle};
use sidestep_rods::geometry::Point;
use std::f64::consts::FRAC_PI_4;

/// Place and heading of a robot.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Pose2 {
    /// The middle of its axle, which is the middle of its body.
    pub at: Point<2>,
    /// Heading, counterclockwise from the first axis.
    pub heading_rad: f64,
}

impl Pose2 {
    /// Returns the direction of a point relative to the heading, in [-pi, pi); left is positive.
    pub fn bearing_rad(&self, p: Point<2>) -> f64 {
        let away = sidestep_kernel::math::atan2(p[1] - self.at[1], p[0] - self.at[0]);
        wrap_angle(away - self.heading_rad)
    }
}

/// Speeds of the two wheels; negative is backward.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct WheelSpeeds {
    /// Speed over ground of the wheel to the left of the heading, m/s.
    pub left_m_s: f64,
    /// Speed over ground of the wheel to the right of the heading, m/s.
    pub right_m_s: f64,
}

impl WheelSpeeds {
    /// Returns the two wheels' speeds, left first.
    pub fn new(left_m_s: f64, right_m_s: f64) -> Self {
        Self { left_m_s, right_m_s }
    }

    /// Returns the speed of the axle's middle along the heading, m/s.
    pub fn speed_m_s(&self) -> f64 {
        0.5 * (self.left_m_s + self.right_m_s)
    }

    /// Returns the same arc, slower.
    #[must_use]
    pub fn scaled(self, pace: f64) -> Self {
        Self::new(pace * self.left_m_s, pace * self.right_m_s)
    }

    /// Returns the same turn with the middle at rest.
    #[must_use]
    pub fn as_turn_in_place(self) -> Self {
        let half = 0.5 * (self.right_m_s - self.left_m_s);
        Self::new(-half, half)
    }
}

/// Two driven wheels on an axle through the middle of a body; none slips.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DifferentialDrive {
    wheelbase_m: f64,
    max_wheel_m_s: f64,
}

impl DifferentialDrive {
    /// Returns a drive with wheels `wheelbase_m` apart and speeds up to `max_wheel_m_s`.
    ///
    /// # Errors
    /// When a number is not finite and above 0.
    pub fn new(wheelbase_m: f64, max_wheel_m_s: f64) -> Result<Self, InputError> {
        for (place, number) in [("wheelbase", wheelbase_m), ("greatest wheel speed", max_wheel_m_s)]
        {
            if !(number > 0.0 && number.is_finite()) {
                return Err(InputError::new(place, format!("is {number}"), "give more than 0"));
            }
        }
        Ok(Self { wheelbase_m, max_wheel_m_s })
    }

    /// Returns the greatest speed of a wheel, m/s.
    pub fn max_wheel_m_s(&self) -> f64 {
        self.max_wheel_m_s
    }

    /// Returns the rate at which wheels turn the robot, rad/s; to the left is positive.
    pub fn turn_rad_s(&self, wheels: WheelSpeeds) -> f64 {
        (wheels.right_m_s - wheels.left_m_s) / self.wheelbase_m
    }

    /// Returns wheel speeds for a speed and a turn. If both together are too fast, the turn comes
    /// first, because a robot that faces the right way gets there, if late.
    pub fn wheel_speeds(&self, speed_m_s: f64, turn_rad_s: f64) -> WheelSpeeds {
        let max = self.max_wheel_m_s;
        let half = (0.5 * turn_rad_s * self.wheelbase_m).clamp(-max, max);
        let room = max - half.abs();
        let speed_m_s = speed_m_s.clamp(-room, room);
        WheelSpeeds::new(speed_m_s - half, speed_m_s + half)
    }

    /// Returns the pose to which wheels take a robot within `dt_s`: along an arc, exactly.
    pub fn step(&self, pose: Pose2, wheels: WheelSpeeds, dt_s: f64) -> Pose2 {
        let max = self.max_wheel_m_s;
        let [left_m_s, right_m_s] =
            [wheels.left_m_s, wheels.right_m_s].map(|speed| speed.clamp(-max, max));
        let wheels = WheelSpeeds { left_m_s, right_m_s };
        let half_rad = 0.5 * self.turn_rad_s(wheels) * dt_s;
        let chord_m = wheels.speed_m_s() * dt_s * sine_ratio(half_rad);
        let toward = pose.heading_rad + half_rad;
        Pose2 {
            at: [pose.at[0] + chord_m * cos(toward), pose.at[1] + chord_m * sin(toward)],
            heading_rad: wrap_angle(pose.heading_rad + 2.0 * half_rad),
        }
    }
}

/// Returns wheel speeds toward a bearing, the faster wheel at `speed_m_s`: straight on when the
/// bearing is 0, about the resting inner wheel from an eighth of a turn on.
pub fn steer(bearing_rad: f64, speed_m_s: f64) -> WheelSpeeds {
    let inner_m_s = speed_m_s * (1.0 - bearing_rad.abs() / FRAC_PI_4).max(0.0);
    if bearing_rad > 0.0 {
        WheelSpeeds::new(inner_m_s, speed_m_s)
    } else {
        WheelSpeeds::new(speed_m_s, inner_m_s)
    }
}

/// Returns `sin(x) / x`, and 1 at 0.
fn sine_ratio(x: f64) -> f64 {
    // Below this, the next term of the series is less than half a unit in the last place.
    if x.abs() < 1e-4 { 1.0 - x * x / 6.0 } else { sin(x) / x }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use sidestep_rods::geometry::distance;

    fn drive() -> DifferentialDrive {
        DifferentialDrive::new(0.4, 1.0).unwrap()
    }

    proptest! {
        #[test]
        fn two_half_steps_are_one_step(
            x in -5.0..5.0f64, heading_rad in -3.1..3.1f64,
            left in -1.0..1.0f64, right in -1.0..1.0f64, dt_s in 1e-6..2.0f64,
        ) {
            let (start, wheels) = (Pose2 { at: [x, 1.0], heading_rad }, WheelSpeeds::new(left, right));
            let once = drive().step(start, wheels, dt_s);
            let half = drive().step(start, wheels, 0.5 * dt_s);
            let twice = drive().step(half, wheels, 0.5 * dt_s);
            prop_assert!(distance(once.at, twice.at) < 1e-12);
            prop_assert!(wrap_angle(once.heading_rad - twice.heading_rad).abs() < 1e-12);
        }

        #[test]
        fn no_wheel_exceeds_its_limit(speed in -9.0..9.0f64, turn in -30.0..30.0f64) {
            let wheels = drive().wheel_speeds(speed, turn);
            prop_assert!(wheels.left_m_s.abs() <= 1.0 + 1e-12 && wheels.right_m_s.abs() <= 1.0 + 1e-12);
        }

        #[test]
        fn backward_undoes_forward(left in -1.0..1.0f64, right in -1.0..1.0f64) {
            let start = Pose2 { at: [0.3, -0.2], heading_rad: 0.5 };
            let there = drive().step(start, WheelSpeeds::new(left, right), 0.7);
            let back = drive().step(there, WheelSpeeds::new(-left, -right), 0.7);
            prop_assert!(distance(start.at, back.at) < 1e-12);
        }
    }

    #[test]
    fn one_wheel_turns_the_robot_about_the_other() {
        let start = Pose2 { at: [0.0, 0.0], heading_rad: 0.0 };
        // The right wheel goes a quarter circle of 0.4 m about the left one at (0, 0.2).
        let quarter_s = 0.4 * std::f64::consts::FRAC_PI_2;
        let end = drive().step(start, WheelSpeeds::new(0.0, 1.0), quarter_s);
        assert!(distance(end.at, [0.2, 0.2]) < 1e-12, "{end:?}");
    }

    #[test]
    fn steering_turns_to_where_the_bearing_is() {
        assert_eq!(steer(0.0, 0.5), WheelSpeeds::new(0.5, 0.5));
        assert_eq!(steer(2.0, 0.5), WheelSpeeds::new(0.0, 0.5));
        assert_eq!(steer(-2.0, 0.5), WheelSpeeds::new(0.5, 0.0));
    }

    #[test]
    fn a_drive_without_an_axle_is_refused() {
        assert_eq!(DifferentialDrive::new(0.0, 1.0).unwrap_err().place(), "wheelbase");
        assert_eq!(
            DifferentialDrive::new(0.4, f64::NAN).unwrap_err().place(),
            "greatest wheel speed"
        );
    }
}
