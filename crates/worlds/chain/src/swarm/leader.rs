//! The robot that navigates: wall following with a target, as six layers (slides N1 to N6).
//!
//! | layer | when | left, right wheel |
//! | --- | --- | --- |
//! | 6 keep moving | always | s, s |
//! | 5 target check | a target is seen | toward it |
//! | 4 far right | leaving the right wall | s, 0 |
//! | 3 far left | leaving the left wall, but not the right one | 0, s |
//! | 2 close right | wall close on the right | 0, s |
//! | 1 close left | wall close on the left, but not on the right | s, 0 |
//!
//! A lower number replaces a higher one. The exclusions let the right side win every tie, which
//! turns a robot around in a dead end. Distances are from the robot's middle.

use super::drive::{Pose2, WheelSpeeds, steer};
use super::laser::{Laser, LaserScan, NearbyBodies, RobotBody};
use super::ray;
use serde::{Deserialize, Serialize};
use sidestep_kernel::InputError;
use sidestep_kernel::stream::Draws;
use sidestep_rods::Obstacles;
use sidestep_rods::geometry::{Point, distance};

/// One of the six layers, with the number that the slides give it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum BehaviorLayer {
    /// 1: away from the left wall.
    CloseLeft = 1,
    /// 2: away from the right wall.
    CloseRight = 2,
    /// 3: back to the left wall.
    FarLeft = 3,
    /// 4: back to the right wall.
    FarRight = 4,
    /// 5: to the target.
    TargetCheck = 5,
    /// 6: straight on.
    KeepMoving = 6,
}

impl BehaviorLayer {
    /// All layers, layer 1 first.
    pub const ALL: [Self; 6] = [
        Self::CloseLeft,
        Self::CloseRight,
        Self::FarLeft,
        Self::FarRight,
        Self::TargetCheck,
        Self::KeepMoving,
    ];

    /// Returns its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::CloseLeft => "close left",
            Self::CloseRight => "close right",
            Self::FarLeft => "far left",
            Self::FarRight => "far right",
            Self::TargetCheck => "target check",
            Self::KeepMoving => "keep moving",
        }
    }
}

/// The rule for when a wall counts as being left. The slides do not say.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum WallLossCriterion {
    /// It was near, is no longer, and is not lost yet: an event with a memory.
    #[default]
    Latched,
    /// Its distance is between far and lost.
    Range,
    /// Its distance is above far: the slides' words taken literally. A leader in the open then
    /// turns forever, because it leaves walls that do not exist.
    Level,
}

/// The rule for when a target ends the following of a wall.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WallLeaveRule {
    /// Distance toward the target that must be free, meters.
    pub free_m: f64,
    /// Angle to each side of the target's bearing that must be free.
    pub half_angle_rad: f64,
}

impl Default for WallLeaveRule {
    /// Returns the rule with which a leader reached its target in 29, 28 and 20 of 30 open fields with 10, 25 and 40 discs;
    /// without one, in 11 and 1 of 30 with 10 and 25.
    fn default() -> Self {
        Self { free_m: 1.4, half_angle_rad: 0.5 }
    }
}

/// The detection of targets.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TargetDetector {
    /// Range, meters; infinite for a beacon.
    pub range_m: f64,
    /// Whether obstacles hide it.
    pub needs_line_of_sight: bool,
}

impl Default for TargetDetector {
    fn default() -> Self {
        Self { range_m: f64::INFINITY, needs_line_of_sight: false }
    }
}

/// The point about which a leader turns.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum TurnMode {
    /// About the resting wheel, as in the slides; if that is blocked it stands.
    #[default]
    AboutAWheel,
    /// About the resting wheel, and on the spot if that is blocked: for corridors too narrow to
    /// swing around in.
    OnTheSpotWhereBlocked,
}

/// A leader: its laser and the parameters of its behavior.
#[derive(Debug, Clone, PartialEq)]
pub struct LeaderController {
    /// The laser with which it sees walls and movers.
    pub laser: Laser,
    /// Angles to each side of straight ahead between which it looks for walls.
    pub sector_rad: [f64; 2],
    /// Speed of a driven wheel, m/s.
    pub speed_m_s: f64,
    /// Distance below which a wall is close, meters.
    pub near_m: f64,
    /// Distance above which a wall may be being left, meters.
    pub far_m: f64,
    /// Distance above which a wall is lost, meters.
    pub lost_m: f64,
    /// Rule for when a wall counts as being left.
    pub leaving: WallLossCriterion,
    /// Rule for when a target ends the following of a wall; `None` for never, as in the slides.
    pub leave_rule: Option<WallLeaveRule>,
    /// Detection of targets.
    pub target_sense: TargetDetector,
    /// Whether it turns on the spot where it cannot turn about a wheel.
    pub turning: TurnMode,
    /// Whether it treats no moving body as a wall, and stands while one is ahead and close. Otherwise a wall
    /// is anything that its laser meets, as in the slides, and a robot that crosses its path turns it around.
    pub gives_way: bool,
}

/// Angle to each side of straight ahead within which a leader stands for a moving body, about 60 degrees: what moves
/// farther aside has passed, or follows the leader.
const AHEAD_RAD: f64 = 1.05;

impl LeaderController {
    /// Returns the leader of the slides: 0.7 to 0.9 m from walls, a laser of 3.2 m all around whose
    /// front quarters count on each side, the latched reading and the leave rule.
    ///
    /// The slides do not say where the sensors look. Front quarters passed 48 of 48 corridors of 1.2 to 3 m without a
    /// touch; sectors that end at 60 degrees lose the wall in bends, and touched or were stuck in 10 of 48.
    ///
    /// # Errors
    /// When the speed is not above 0.
    pub fn new(speed_m_s: f64) -> Result<Self, InputError> {
        let leader = Self {
            laser: Laser::new(180, 3.2, std::f64::consts::PI, 0.0)?,
            sector_rad: [0.0, std::f64::consts::FRAC_PI_2],
            speed_m_s,
            near_m: 0.7,
            far_m: 0.9,
            lost_m: 1.3,
            leaving: WallLossCriterion::default(),
            leave_rule: Some(WallLeaveRule::default()),
            target_sense: TargetDetector::default(),
            turning: TurnMode::default(),
            gives_way: true,
        };
        leader.check()?;
        Ok(leader)
    }

    /// Checks that its numbers make sense together.
    ///
    /// # Errors
    /// When the speed is not above 0; the distances are not 0 < near <= far <= lost <= the laser's
    /// range; the sector's ends are not finite, or in the wrong order; targets are detected from no distance above 0; or
    /// the laser does not see the sector.
    pub fn check(&self) -> Result<(), InputError> {
        let Self { speed_m_s, near_m, far_m, lost_m, sector_rad: [from, to], .. } = *self;
        if !(speed_m_s > 0.0 && speed_m_s.is_finite()) {
            let cause = format!("has a speed of {speed_m_s} m/s");
            return Err(leader_error(cause, "give more than 0"));
        }
        let range_m = self.laser.range_m();
        if !(0.0 < near_m && near_m <= far_m && far_m <= lost_m && lost_m <= range_m) {
            let cause = format!("has walls near at {near_m}, far at {far_m}, lost at {lost_m} m");
            let remedy = "give 0 < near <= far <= lost <= the laser's range";
            return Err(leader_error(cause, remedy));
        }
        if !(from <= to && from.is_finite() && to.is_finite()) {
            let cause = format!("looks for walls from {from} to {to} rad");
            let remedy = "give the right end of the sector first, both finite";
            return Err(leader_error(cause, remedy));
        }
        let detects_m = self.target_sense.range_m;
        if detects_m.is_nan() || detects_m <= 0.0 {
            let cause = format!("detects targets from {detects_m} m");
            return Err(leader_error(cause, "give more than 0, or inf"));
        }
        if !self.laser.can_see_sector([from, to]) || !self.laser.can_see_sector([-to, -from]) {
            let cause = format!("looks for walls from {from} to {to} rad, where it has no beams");
            return Err(leader_error(cause, "widen the laser's field, or the sector"));
        }
        Ok(())
    }
}

fn leader_error(cause: String, remedy: &str) -> InputError {
    InputError::new("leader", cause, remedy)
}

/// What a leader keeps from cycle to cycle.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct LeaderState {
    /// Its place and heading.
    pub pose: Pose2,
    /// The walls that it follows.
    pub followed: LeftRight<bool>,
}

impl LeaderState {
    /// Returns a leader that follows no wall yet.
    pub fn new(pose: Pose2) -> Self {
        Self { pose, followed: LeftRight::default() }
    }
}

/// One value for the left of a robot, and one for the right.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct LeftRight<T> {
    /// That of what is counterclockwise of the heading.
    pub left: T,
    /// That of what is clockwise of the heading.
    pub right: T,
}

/// All that a leader's sensors may detect.
#[derive(Debug, Clone, Copy)]
pub struct LeaderSurroundings<'a> {
    /// Obstacles of the world, the moving ones where they are now.
    pub obstacles: &'a Obstacles<2>,
    /// Bodies of robots, without its own.
    pub bodies: &'a [RobotBody],
    /// The place that it seeks; `None` where it only follows walls.
    pub target: Option<Point<2>>,
}

/// What a leader makes of a scan, and of its target.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WallAndTargetPercept {
    /// Distances of the nearest walls, meters.
    pub walls_m: LeftRight<f64>,
    /// The target, if it is detected.
    pub target: Option<TargetSighting>,
    /// Whether a moving body is close ahead.
    pub is_mover_ahead: bool,
    /// Whether the leader still has the patience to stand for it.
    pub stands_for_it: bool,
}

/// A target that is detected, as seen from the heading.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TargetSighting {
    /// Direction relative to the heading, left positive.
    pub bearing_rad: f64,
    /// Whether the leave rule finds the way to it free.
    pub way_is_free: bool,
}

/// What a leader does in a cycle, and what it remembers for the next.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LeaderDecision {
    /// Speeds of its wheels.
    pub wheels: WheelSpeeds,
    /// The layer that acts.
    pub layer: BehaviorLayer,
    /// The walls that it follows from now on.
    pub followed: LeftRight<bool>,
    /// Whether it stands or goes on while a moving body is close ahead.
    pub is_mover_ahead: bool,
}

impl LeaderController {
    /// Reads the laser into `scan`, whose old contents are discarded.
    pub fn scan(
        &self,
        pose: &Pose2,
        around: &LeaderSurroundings<'_>,
        noise: &mut Draws,
        scan: &mut LaserScan,
    ) {
        let robots = around.bodies.iter().copied();
        let around = NearbyBodies { obstacles: around.obstacles, robots };
        self.laser.scan(pose, around, noise, scan);
    }

    /// Finds walls, movers and the target in a scan that was made at the same pose. A leader that `is_patient` treats no
    /// moving body as a wall.
    pub fn perceive(
        &self,
        pose: &Pose2,
        around: &LeaderSurroundings<'_>,
        scan: &LaserScan,
        is_patient: bool,
    ) -> WallAndTargetPercept {
        let [from, to] = self.sector_rad;
        let stands_for_it = self.gives_way && is_patient;
        let walls_m = LeftRight {
            left: self.wall_distance_m(scan, [from, to], stands_for_it),
            right: self.wall_distance_m(scan, [-to, -from], stands_for_it),
        };
        let target = around.target.filter(|&target| self.detects(pose, around, target));
        let mover_m = self.laser.min_range_where_moving_m(scan, [-AHEAD_RAD, AHEAD_RAD], true);
        let is_mover_ahead = self.gives_way && mover_m.is_some_and(|mover_m| mover_m < self.near_m);
        let target = target.map(|target| self.sighting(pose, target, scan));
        WallAndTargetPercept { walls_m, target, is_mover_ahead, stands_for_it }
    }

    /// Returns the distance of the nearest wall in a sector. A mover for which the leader stands is no wall, or it would
    /// turn around in front of it.
    fn wall_distance_m(
        &self,
        scan: &LaserScan,
        sector_rad: [f64; 2],
        stands_for_movers: bool,
    ) -> f64 {
        let range_m = if stands_for_movers {
            self.laser.min_range_where_moving_m(scan, sector_rad, false)
        } else {
            self.laser.min_sector_range_m(scan, sector_rad)
        };
        range_m.unwrap_or(self.laser.range_m())
    }

    fn detects(&self, pose: &Pose2, around: &LeaderSurroundings<'_>, target: Point<2>) -> bool {
        if distance(pose.at, target) > self.target_sense.range_m {
            return false;
        }
        if !self.target_sense.needs_line_of_sight {
            return true;
        }
        let line = [pose.at, target];
        let is_body_clear = |b: &RobotBody| b.core.is_clear_of_segment(line, b.radius_m);
        ray::is_clear(around.obstacles, line) && around.bodies.iter().all(is_body_clear)
    }

    fn sighting(&self, pose: &Pose2, target: Point<2>, scan: &LaserScan) -> TargetSighting {
        let bearing_rad = pose.bearing_rad(target);
        let mut way_is_free = false;
        if let Some(rule) = self.leave_rule {
            let cone = [bearing_rad - rule.half_angle_rad, bearing_rad + rule.half_angle_rad];
            let needed_m = rule.free_m.min(distance(pose.at, target));
            // Where the laser has no beams nothing is known to be free.
            let free_m = self.laser.min_sector_range_m(scan, cone);
            way_is_free = free_m.is_some_and(|free_m| free_m >= needed_m);
        }
        TargetSighting { bearing_rad, way_is_free }
    }

    /// Returns the layer that acts, and its wheel speeds.
    pub fn decide(
        &self,
        followed: LeftRight<bool>,
        percept: &WallAndTargetPercept,
    ) -> LeaderDecision {
        let leaves_walls = percept.target.is_some_and(|target| target.way_is_free);
        let left = self.wall_following_status(followed.left, percept.walls_m.left, leaves_walls);
        let right = self.wall_following_status(followed.right, percept.walls_m.right, leaves_walls);
        let s = self.speed_m_s;
        let to_left = WheelSpeeds::new(0.0, s);
        let to_right = WheelSpeeds::new(s, 0.0);
        let (layer, wheels) = if left.is_close && !right.is_close {
            (BehaviorLayer::CloseLeft, to_right)
        } else if right.is_close {
            (BehaviorLayer::CloseRight, to_left)
        } else if left.is_left_behind && !right.is_left_behind {
            (BehaviorLayer::FarLeft, to_left)
        } else if right.is_left_behind {
            (BehaviorLayer::FarRight, to_right)
        } else if let Some(target) = percept.target {
            (BehaviorLayer::TargetCheck, steer(target.bearing_rad, s))
        } else {
            (BehaviorLayer::KeepMoving, WheelSpeeds::new(s, s))
        };
        let followed = LeftRight { left: left.is_followed, right: right.is_followed };
        let is_mover_ahead = percept.is_mover_ahead;
        if is_mover_ahead && percept.stands_for_it {
            // It goes straight on as soon as the mover is gone.
            let layer = BehaviorLayer::KeepMoving;
            return LeaderDecision {
                wheels: WheelSpeeds::default(),
                layer,
                followed,
                is_mover_ahead,
            };
        }
        LeaderDecision { wheels, layer, followed, is_mover_ahead }
    }

    fn wall_following_status(
        &self,
        was_followed: bool,
        wall_m: f64,
        leaves_walls: bool,
    ) -> WallStatus {
        let is_far = wall_m > self.far_m;
        let is_followed = !leaves_walls && (!is_far || was_followed && wall_m <= self.lost_m);
        let is_left_behind = is_far
            && !leaves_walls
            && match self.leaving {
                WallLossCriterion::Latched => is_followed,
                WallLossCriterion::Range => wall_m < self.lost_m,
                WallLossCriterion::Level => true,
            };
        WallStatus { is_close: wall_m < self.near_m, is_followed, is_left_behind }
    }

    /// Returns the wheel speeds to use if the way of its wheels is blocked.
    pub fn wheel_speeds_if_blocked(&self, wheels: WheelSpeeds) -> WheelSpeeds {
        match self.turning {
            TurnMode::AboutAWheel => WheelSpeeds::default(),
            TurnMode::OnTheSpotWhereBlocked => wheels.as_turn_in_place(),
        }
    }
}

#[derive(Debug, Clone, Copy)]
struct WallStatus {
    is_close: bool,
    is_followed: bool,
    is_left_behind: bool,
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn leader(leaving: WallLossCriterion) -> LeaderController {
        LeaderController { leaving, ..LeaderController::new(0.5).unwrap() }
    }

    fn percept(left: f64, right: f64) -> WallAndTargetPercept {
        let walls_m = LeftRight { left, right };
        WallAndTargetPercept { walls_m, target: None, is_mover_ahead: false, stands_for_it: true }
    }

    fn layer(
        leader: &LeaderController,
        followed: (bool, bool),
        percept: &WallAndTargetPercept,
    ) -> BehaviorLayer {
        let (left, right) = followed;
        leader.decide(LeftRight { left, right }, percept).layer
    }

    #[test]
    fn the_table_of_the_slides_holds_line_by_line() {
        let leader = leader(WallLossCriterion::Latched);
        let (l, r) = (WheelSpeeds::new(0.0, 0.5), WheelSpeeds::new(0.5, 0.0));
        for (walls, followed, layer, wheels) in [
            ((0.6, 0.8), (false, false), BehaviorLayer::CloseLeft, r),
            ((0.8, 0.6), (false, false), BehaviorLayer::CloseRight, l),
            ((0.6, 0.6), (false, false), BehaviorLayer::CloseRight, l),
            ((1.0, 0.8), (true, true), BehaviorLayer::FarLeft, l),
            ((0.8, 1.0), (true, true), BehaviorLayer::FarRight, r),
            ((1.0, 1.0), (true, true), BehaviorLayer::FarRight, r),
            ((0.8, 0.8), (true, true), BehaviorLayer::KeepMoving, WheelSpeeds::new(0.5, 0.5)),
            // Close comes before far, whatever the sides.
            ((0.6, 1.0), (true, true), BehaviorLayer::CloseLeft, r),
            ((1.0, 0.6), (true, true), BehaviorLayer::CloseRight, l),
        ] {
            let (left, right) = followed;
            let decision = leader.decide(LeftRight { left, right }, &percept(walls.0, walls.1));
            assert_eq!((decision.layer, decision.wheels), (layer, wheels), "{walls:?}");
        }
    }

    #[test]
    fn a_wall_is_left_behind_as_the_reading_says() {
        let reading = |leaving, followed, left| {
            layer(&leader(leaving), (followed, false), &percept(left, 0.8))
        };
        let (far, keep) = (BehaviorLayer::FarLeft, BehaviorLayer::KeepMoving);
        assert_eq!(reading(WallLossCriterion::Latched, true, 1.0), far);
        assert_eq!(reading(WallLossCriterion::Latched, false, 1.0), keep, "never near");
        assert_eq!(reading(WallLossCriterion::Latched, true, 1.4), keep, "lost");
        assert_eq!(reading(WallLossCriterion::Range, false, 1.0), far);
        assert_eq!(reading(WallLossCriterion::Range, true, 1.4), keep);
        assert_eq!(reading(WallLossCriterion::Level, false, 3.2), far);
    }

    #[test]
    fn a_leader_that_cannot_work_is_refused() {
        let right = leader(WallLossCriterion::Latched);
        assert!(right.check().is_ok());
        assert!(LeaderController::new(f64::NAN).is_err());
        assert!(LeaderController { near_m: 1.0, ..right.clone() }.check().is_err());
        assert!(LeaderController { lost_m: 4.0, ..right.clone() }.check().is_err());
        let narrow = Laser::new(180, 3.2, 0.5, 0.0).unwrap();
        assert!(LeaderController { laser: narrow, ..right }.check().is_err());
    }

    #[test]
    fn a_lost_wall_is_forgotten() {
        let leader = leader(WallLossCriterion::Latched);
        let near = leader.decide(LeftRight::default(), &percept(0.8, 3.2)).followed;
        assert_eq!(near, LeftRight { left: true, right: false });
        let leaving = leader.decide(near, &percept(1.2, 3.2)).followed;
        assert_eq!(leaving, near);
        let lost = leader.decide(leaving, &percept(1.4, 3.2)).followed;
        assert_eq!(leader.decide(lost, &percept(1.2, 3.2)).layer, BehaviorLayer::KeepMoving);
    }

    #[test]
    fn a_free_way_to_the_target_ends_the_following() {
        let target = |way_is_free| Some(TargetSighting { bearing_rad: 0.1, way_is_free });
        for leaving in
            [WallLossCriterion::Latched, WallLossCriterion::Range, WallLossCriterion::Level]
        {
            let leader = leader(leaving);
            let seen = |free| WallAndTargetPercept { target: target(free), ..percept(1.0, 3.2) };
            assert_eq!(layer(&leader, (true, false), &seen(true)), BehaviorLayer::TargetCheck);
            assert_ne!(layer(&leader, (true, false), &seen(false)), BehaviorLayer::TargetCheck);
        }
    }

    #[test]
    fn a_target_behind_a_wall_is_seen_by_who_may_see_through_it() {
        use sidestep_kernel::{Seed, stream::Streams};
        use sidestep_rods::Obstacle;
        let wall = Obstacle::capsule(0, [[2.0, -1.0], [2.0, 1.0]], 0.0);
        let obstacles = Obstacles::new(vec![wall], 1.0).unwrap();
        let around =
            LeaderSurroundings { obstacles: &obstacles, bodies: &[], target: Some([4.0, 0.0]) };
        let pose = Pose2 { at: [0.0, 0.0], heading_rad: 0.0 };
        let mut noise = Streams::new(Seed(1)).draws(0, 0, super::super::laser::LASER_NOISE);
        let mut sees = |needs_line_of_sight, range_m| {
            let target_sense = TargetDetector { range_m, needs_line_of_sight };
            let leader = LeaderController { target_sense, ..leader(WallLossCriterion::Latched) };
            let scan = &mut LaserScan::default();
            leader.scan(&pose, &around, &mut noise, scan);
            leader.perceive(&pose, &around, scan, true).target.is_some()
        };
        assert!(sees(false, f64::INFINITY));
        assert!(!sees(true, f64::INFINITY));
        assert!(!sees(false, 3.9));
    }

    #[test]
    fn what_moves_is_waited_for_and_is_no_wall_until_patience_ends() {
        use sidestep_kernel::{Seed, stream::Streams};
        use sidestep_rods::Obstacle;
        let leader = leader(WallLossCriterion::Latched);
        let sees = |at, velocity_m_s, is_patient| {
            let disc = Obstacle { velocity_m_s, ..Obstacle::ball(0, at, 0.2) };
            let obstacles = Obstacles::new(vec![disc], 1.0).unwrap();
            let around = LeaderSurroundings { obstacles: &obstacles, bodies: &[], target: None };
            let pose = Pose2 { at: [0.0, 0.0], heading_rad: 0.0 };
            let mut noise = Streams::new(Seed(1)).draws(0, 0, super::super::laser::LASER_NOISE);
            let scan = &mut LaserScan::default();
            leader.scan(&pose, &around, &mut noise, scan);
            let percept = leader.perceive(&pose, &around, scan, is_patient);
            leader.decide(LeftRight::default(), &percept)
        };
        let (ahead, aside, moves, stands) = ([0.8, 0.1], [0.0, 0.8], [0.0, -0.4], [0.0, 0.0]);
        assert_eq!(sees(ahead, moves, true).wheels, WheelSpeeds::default(), "it waits");
        assert_ne!(sees(ahead, moves, false).wheels, WheelSpeeds::default(), "not forever");
        assert_eq!(sees(ahead, moves, false).layer, sees(ahead, stands, true).layer);
        assert_eq!(sees(aside, moves, true).layer, BehaviorLayer::KeepMoving, "it is no wall");
        assert_eq!(sees(aside, stands, true).layer, BehaviorLayer::CloseLeft);
    }

    proptest! {
        /// Without walls to tell apart by rank, left and right are mirror images.
        #[test]
        fn what_is_mirrored_decides_mirrored_but_for_ties(
            left in 0.3..2.0f64, right in 0.3..2.0f64, fl: bool, fr: bool,
        ) {
            let leader = leader(WallLossCriterion::Latched);
            let this = leader.decide(LeftRight { left: fl, right: fr }, &percept(left, right));
            let other = leader.decide(LeftRight { left: fr, right: fl }, &percept(right, left));
            let both_close = left < 0.7 && right < 0.7;
            let both_far = (fl && left > 0.9 && left <= 1.3) && (fr && right > 0.9 && right <= 1.3);
            if !both_close && !both_far {
                prop_assert_eq!(this.wheels.left_m_s, other.wheels.right_m_s);
                prop_assert_eq!(this.wheels.right_m_s, other.wheels.left_m_s);
            }
        }
    }
}
