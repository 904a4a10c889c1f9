//! A robot on wheels that keeps to its connector (slide E2).
//!
//! The chain says where the robot shall be; wheels get there late, and face elsewhere on the way.
//! Short-range sensors let it slide along nearby obstacles and keep it from touching them. Robots
//! that only stop get stuck at walls when they have to graze them, so their connectors' radius has
//! to exceed their own by a margin.

use super::drive::{DifferentialDrive, Pose2, WheelSpeeds};
use super::laser::{NearbyBodies, RobotBody};
use super::proximity::{SECTOR_RAD, SectorGaps, SensorRing, safe_speed_m_s};
use sidestep_kernel::InputError;
use sidestep_kernel::math::{atan2, cos, sin, wrap_angle};
use sidestep_rods::geometry::{Point, add_scaled, dot, norm, sub};
use std::f64::consts::PI;

/// A follower: its wheels, its sensors and the parameters of its behavior.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Follower {
    /// Its wheels, with the limit of their speed.
    pub drive: DifferentialDrive,
    /// Its body and sensors.
    pub ring: SensorRing,
    /// Speed per distance from the connector, beyond the connector's own speed.
    pub gain_per_s: f64,
    /// Turn rate per angle between its heading and its wanted direction.
    pub turn_gain_per_s: f64,
    /// Time to collision that it keeps: it goes no faster than that allows.
    pub horizon_s: f64,
    /// Distance below which it slides along obstacles, meters; 0 for a robot that only stops.
    pub slide_m: f64,
}

/// Position and velocity of the connector that a follower keeps to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FollowerTarget {
    /// Its place at the end of the tick, meters.
    pub at: Point<2>,
    /// Its mean velocity in the tick, m/s.
    pub velocity_m_s: Point<2>,
}

/// What a follower does in a tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FollowerDecision {
    /// Speeds of its wheels.
    pub wheels: WheelSpeeds,
    /// Whether its sensors slowed it down.
    pub is_held: bool,
}

/// A follower after a tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FollowResult {
    /// Its place and heading.
    pub pose: Pose2,
    /// Whether its sensors slowed it down.
    pub is_held: bool,
    /// Whether its bumper is pressed.
    pub is_bumped: bool,
    /// Gap between its body and the nearest obstacle, up to 1 m.
    pub gap_m: f64,
}

/// Distance below which a bumper is pressed, meters.
const BUMPER_M: f64 = 1e-3;
/// Distance up to which the gap around a robot is measured, meters.
const GAP_RANGE_M: f64 = 1.0;

/// Angle between a robot's heading and its goal beyond which it drives backward: more than a right angle, because a robot
/// that is to go aside should turn and go ahead.
const BACKWARD_RAD: f64 = 2.0;
/// Wanted speed up to which a robot stands still, m/s: the direction of a velocity that is nearly zero is noise, and the
/// robot would turn after it.
const STANDING_M_S: f64 = 1e-3;

/// Range of the sensors, unless it is given, meters.
const SENSOR_RANGE_M: f64 = 0.15;
/// Speed per distance from the connector, unless it is given, 1/s: half a step of lag is made up for in a few cycles, and
/// at 0.1 m the wheels' reserve of a fifth is used up.
const GAIN_PER_S: f64 = 3.0;
/// Turn rate per angle, unless it is given, 1/s: twice the gain of the distance, because a robot has to face its connector
/// before it can go there.
const TURN_GAIN_PER_S: f64 = 6.0;
/// Time to collision that a follower keeps, s.
const HORIZON_S: f64 = 0.1;
/// Distance below which a follower slides along obstacles, meters: the default margin of connectors around robots, so
/// that a robot at its place beside a wall does not slide.
const SLIDE_M: f64 = 0.08;

impl Follower {
    /// Returns a follower with the usual gains, and with sensors that see 0.15 m.
    ///
    /// # Errors
    /// When the radius is not above 0.
    pub fn new(drive: DifferentialDrive, radius_m: f64) -> Result<Self, InputError> {
        if !(radius_m > 0.0 && radius_m.is_finite()) {
            let cause = format!("has a radius of {radius_m} m");
            return Err(InputError::new("follower", cause, "give more than 0"));
        }
        let ring = SensorRing { radius_m, range_m: SENSOR_RANGE_M };
        Ok(Self {
            drive,
            ring,
            gain_per_s: GAIN_PER_S,
            turn_gain_per_s: TURN_GAIN_PER_S,
            horizon_s: HORIZON_S,
            slide_m: SLIDE_M,
        })
    }

    /// Returns the distance from its place within which its body and its bumper stay for `dt_s` seconds.
    pub(crate) fn max_reach_m(&self, dt_s: f64) -> f64 {
        self.ring.radius_m + self.drive.max_wheel_m_s() * dt_s + BUMPER_M
    }

    /// Returns wheel speeds that keep to a connector, limited by the sensors' readings. The wheels
    /// will turn for `dt_s`.
    pub fn decide(
        &self,
        pose: &Pose2,
        goal: &FollowerTarget,
        gaps: &SectorGaps,
        dt_s: f64,
    ) -> FollowerDecision {
        let wished = add_scaled(goal.velocity_m_s, sub(goal.at, pose.at), self.gain_per_s);
        let wanted = self.avoid_obstacles(wished, pose.heading_rad, gaps);
        let speed_m_s = norm(wanted);
        if speed_m_s <= STANDING_M_S {
            return FollowerDecision {
                wheels: WheelSpeeds::default(),
                is_held: norm(wished) > STANDING_M_S,
            };
        }
        let off_rad = wrap_angle(atan2(wanted[1], wanted[0]) - pose.heading_rad);
        let is_backward = off_rad.abs() > BACKWARD_RAD;
        let off_rad = if is_backward { wrap_angle(off_rad - PI) } else { off_rad };
        // Only the part of the wish along the heading is driven; the turn makes the rest possible.
        let ahead_m_s = speed_m_s * cos(off_rad).max(0.0);
        let wheels = self.drive.wheel_speeds(ahead_m_s, self.turn_gain_per_s * off_rad);
        self.limit_speed(wheels, is_backward, gaps, dt_s)
    }

    /// Makes one tick: reads the sensors and turns the wheels.
    pub fn follow(
        &self,
        pose: &Pose2,
        goal: &FollowerTarget,
        around: NearbyBodies<'_, impl Iterator<Item = RobotBody> + Clone>,
        dt_s: f64,
    ) -> FollowResult {
        let NearbyBodies { obstacles, robots } = around;
        let gaps = self.ring.read(pose, obstacles, robots.clone());
        let command = self.decide(pose, goal, &gaps, dt_s);
        let pose = self.drive.step(*pose, command.wheels, dt_s);
        let radius_m = self.ring.radius_m;
        let mut apart_m: f64 = GAP_RANGE_M;
        for robot in robots {
            let distance_m = robot.core.nearest_to_point(pose.at).distance_m;
            apart_m = apart_m.min(distance_m - robot.radius_m - radius_m);
        }
        let gap_m = obstacles.clearance_m([pose.at; 2], radius_m, GAP_RANGE_M).min(apart_m);
        FollowResult { pose, is_held: command.is_held, is_bumped: gap_m < BUMPER_M, gap_m }
    }

    /// Returns a wish without its part toward nearby obstacles, which is reduced more the nearer
    /// they are: the robot slides along.
    fn avoid_obstacles(
        &self,
        mut wished: Point<2>,
        heading_rad: f64,
        gaps: &SectorGaps,
    ) -> Point<2> {
        for (k, gap_m) in gaps.iter().enumerate().filter(|&(_, &gap_m)| gap_m < self.slide_m) {
            let toward = heading_rad + k as f64 * SECTOR_RAD;
            let u = [cos(toward), sin(toward)];
            let closing_m_s = dot(wished, u).max(0.0);
            wished = add_scaled(wished, u, closing_m_s * (gap_m / self.slide_m - 1.0));
        }
        wished
    }

    /// Slows the middle, never the turn, because a round body that turns on the spot touches
    /// nothing.
    fn limit_speed(
        &self,
        wheels: WheelSpeeds,
        is_backward: bool,
        gaps: &SectorGaps,
        dt_s: f64,
    ) -> FollowerDecision {
        let turn_rad_s = self.drive.turn_rad_s(wheels);
        let (toward_rad, sign) = if is_backward { (PI, -1.0) } else { (0.0, 1.0) };
        // The chord of an arc leads half of its turn aside.
        let slack_rad = 0.5 * turn_rad_s.abs() * dt_s;
        // With less than two cycles a robot could use up the gap in one, and another body the rest.
        let horizon_s = self.horizon_s.max(2.0 * dt_s);
        let safe_m_s = safe_speed_m_s(gaps, toward_rad, slack_rad, horizon_s);
        let speed_m_s = wheels.speed_m_s();
        FollowerDecision {
            wheels: self.drive.wheel_speeds(sign * speed_m_s.min(safe_m_s), turn_rad_s),
            is_held: speed_m_s > safe_m_s,
        }
    }
}

/// Returns the fraction of its speed at which a leader may go, given the largest lag of a follower: it
/// slows down from half the limit on.
///
/// A connector that is pulled around a sharp corner goes up to three times as fast as the leader, too
/// fast for wheels. A late follower cuts the corner and gets stuck there. Therefore each robot reports
/// its lag to the robot before it, as it would report a veto, and the leader slows down.
pub(crate) fn speed_fraction(worst_lag_m: f64, limit_m: f64) -> f64 {
    (2.0 - 2.0 * worst_lag_m / limit_m).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::super::ray::tests::core_strategy;
    use super::*;
    use proptest::prelude::*;
    use sidestep_rods::geometry::distance;
    use sidestep_rods::{Obstacle, Obstacles};

    const DT_S: f64 = 0.02;

    fn follower() -> Follower {
        Follower::new(DifferentialDrive::new(0.4, 0.6).unwrap(), 0.25).unwrap()
    }

    fn run(mut pose: Pose2, goal: impl Fn(f64) -> FollowerTarget, ticks: usize) -> (Pose2, f64) {
        let follower = follower();
        let open = [follower.ring.range_m; 8];
        for k in 0..ticks {
            let command = follower.decide(&pose, &goal(k as f64 * DT_S), &open, DT_S);
            pose = follower.drive.step(pose, command.wheels, DT_S);
        }
        (pose, distance(pose.at, goal(ticks as f64 * DT_S).at))
    }

    #[test]
    fn it_arrives_at_a_connector_at_rest_from_wherever_it_looks() {
        for k in 0..24 {
            let pose = Pose2 { at: [0.0, 0.0], heading_rad: f64::from(k) * 0.26 - PI };
            let rest = FollowerTarget { at: [0.5, 0.3], velocity_m_s: [0.0; 2] };
            let (_, off_m) = run(pose, |_| rest, 600);
            assert!(off_m < 0.01, "from {}: {off_m}", pose.heading_rad);
        }
    }

    #[test]
    fn it_keeps_up_with_a_connector_that_moves() {
        let goal = |t: f64| FollowerTarget { at: [0.5 * t, 0.0], velocity_m_s: [0.5, 0.0] };
        let (_, lag_m) = run(Pose2 { at: [-0.3, 0.1], heading_rad: 0.0 }, goal, 500);
        assert!(lag_m < 0.02, "{lag_m}");
    }

    #[test]
    fn it_backs_off_where_its_connector_goes_back() {
        let goal = |t: f64| FollowerTarget { at: [-0.4 * t, 0.0], velocity_m_s: [-0.4, 0.0] };
        let (pose, lag_m) = run(Pose2 { at: [0.0, 0.0], heading_rad: 0.0 }, goal, 300);
        assert!(lag_m < 0.02 && pose.heading_rad.abs() < 0.01, "{pose:?}");
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(100))]
        #[test]
        fn it_never_enters_what_stands_still(
            cores in prop::collection::vec((core_strategy(), 0.01..0.4f64), 1..8),
            at in prop::array::uniform2(-3.0..3.0f64), heading_rad in -3.1..3.1f64,
            goal in prop::array::uniform2(-3.0..3.0f64),
        ) {
            let all: Vec<_> = cores.iter().map(|(core, r)| Obstacle::new_static(1, *core, *r)).collect();
            let obstacles = Obstacles::new(all, 1.0).unwrap();
            prop_assume!(obstacles.clearance_m([at, at], 0.25, 1.0) > 0.0);
            let follower = follower();
            let goal = FollowerTarget { at: goal, velocity_m_s: [0.0; 2] };
            let mut pose = Pose2 { at, heading_rad };
            for _ in 0..300 {
                let gaps = follower.ring.read(&pose, &obstacles, []);
                let command = follower.decide(&pose, &goal, &gaps, DT_S);
                pose = follower.drive.step(pose, command.wheels, DT_S);
                prop_assert!(obstacles.clearance_m([pose.at; 2], 0.25, 1.0) > -1e-9);
            }
        }
    }
}
