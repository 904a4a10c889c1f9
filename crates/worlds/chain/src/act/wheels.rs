//! An initiator on wheels: the link between the swarm's leader and this world (slides N1 to N6).

use super::initiator::{move_initiator, wait_for_escape};
use super::outcome::MoveOutcome;
use super::{ChainCycleState, Initiator};
use crate::driver::TaskKind;
use crate::navigate::{NavigationGoal, Navigator};
use crate::state::ChainBodyState;
use crate::swarm::drive::{Pose2, WheelSpeeds};
use crate::swarm::follower::speed_fraction;
use crate::swarm::leader::LeaderDecision;
use sidestep_kernel::math::{atan2, cos, sin, wrap_angle};
use sidestep_rods::geometry::{Point, convert_dimensions, distance, move_toward};

/// Time for which a leader stands and waits for a robot that is late, s: enough to turn around and drive half a meter.
const LATE_ROBOT_TIMEOUT_S: f64 = 3.0;
/// Fraction of its speed at which it continues after that, because a robot that is blocked by another one may get
/// free only once their connectors have moved.
const RESUME_SPEED_FRACTION: f64 = 0.25;
/// Fraction of the gap to another robot that a leader leaves in a cycle, because the other one may take a fifth of
/// it in the same cycle.
const SHARED_GAP_FRACTION: f64 = 0.25;

/// Largest angle between two headings that differ by rounding only.
pub(super) const HEADING_TOLERANCE_RAD: f64 = 1e-9;

/// What a navigator's wheels would do in a cycle, if the chain does not veto it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct WheelStep {
    /// The pose to which it leads.
    pub(super) pose: Pose2,
    /// The navigator's decision, at full speed.
    wheels: WheelSpeeds,
}

/// A navigator and the chain that it leads.
pub(super) struct NavigatedChain<'a, const D: usize> {
    pub(super) initiator: Initiator<'a, D>,
    pub(super) navigator: &'a Navigator,
    pub(super) body: &'a mut ChainBodyState<D>,
}

/// Moves an initiator on wheels; one that is blocked may turn on the spot.
pub(super) fn drive_on_wheels<const D: usize>(
    initiator: Initiator<'_, D>,
    acting: &mut ChainCycleState<'_, D>,
    steered: WheelStep,
) {
    let TaskKind::Navigate(navigator) = &initiator.task.driver else { return };
    let WheelStep { pose, wheels } = steered;
    if comes_too_near(acting.body, initiator.task.agent, pose.at) {
        wait_for_escape(initiator, acting);
        return NavigatedChain { initiator, navigator, body: acting.body }.turn_if_blocked(wheels);
    }
    let was = initiator.position(acting.body);
    let went = move_initiator(initiator, acting, convert_dimensions(pose.at));
    let mut wheeled = NavigatedChain { initiator, navigator, body: acting.body };
    match went {
        MoveOutcome::Ahead => wheeled.update_heading(pose.heading_rad),
        // A robot whose connector was pulled away follows it on its wheels.
        MoveOutcome::Nowhere if wheeled.has_robots() && initiator.position(wheeled.body) != was => {
        }
        MoveOutcome::Nowhere => wheeled.turn_if_blocked(wheels),
    }
}

/// Sets the heading alone, which nothing can veto: a round body that turns touches nothing.
pub(super) fn turn_robot<const D: usize>(body: &mut ChainBodyState<D>, heading_rad: f64) {
    if let Some(leader) = &mut body.driving.leader {
        leader.pose.heading_rad = heading_rad;
    }
}

/// Returns whether a leader's robot would come nearer to another one of its chain than that one, which keeps a
/// part of the gap for itself, allows for.
fn comes_too_near<const D: usize>(body: &ChainBodyState<D>, agent: usize, to: Point<2>) -> bool {
    let robots = &body.robots;
    let Some(robot) = robots.get(agent) else { return false };
    let apart_m = 2.0 * body.robot_radius_m;
    let others = robots.iter().enumerate().filter(|(k, _)| *k != agent);
    let mut positions = others.map(|(_, other)| other.pose.at);
    positions.any(|other| {
        let was_m = distance(robot.pose.at, other) - apart_m;
        let gap_m = distance(to, other) - apart_m;
        gap_m < was_m && gap_m < SHARED_GAP_FRACTION * was_m.max(0.0)
    })
}

impl<const D: usize> NavigatedChain<'_, D> {
    fn has_robots(&self) -> bool {
        self.initiator.context.spec.robots.is_some()
    }

    /// Returns whether a navigator has reached its goal.
    pub(super) fn has_arrived(&self) -> bool {
        let at = convert_dimensions(self.initiator.position(self.body));
        let index = self.body.driving.next as usize;
        self.navigator.goal.as_ref().is_some_and(|goal| goal.is_reached(at, index))
    }

    /// Returns the step of a decision, slower if robots lag; counts the cycles in which it stands.
    pub(super) fn steer(&mut self, decision: LeaderDecision) -> WheelStep {
        let world = self.initiator.context.world;
        self.locate_on_goal_line();
        let pace = self.speed_fraction();
        let body = &mut *self.body;
        let driving = &mut body.driving;
        driving.rested = if pace == 0.0 { driving.rested.saturating_add(1) } else { 0 };
        if decision.wheels == WheelSpeeds::default() {
            body.standstill.cycles = body.standstill.cycles.saturating_add(1);
        } else if !decision.is_mover_ahead {
            // While a mover is ahead the count stays: otherwise a navigator that has stopped waiting for it
            // would wait again after one step.
            body.standstill.cycles = 0;
        }
        let mut leader = body.leader_state(self.initiator.task);
        leader.followed = decision.followed;
        body.driving.leader = Some(leader);
        body.tally.layers[decision.layer as usize - 1] += 1;
        let waited_s = world.cycle_start_time_s(u64::from(body.driving.rested));
        let pace = if waited_s > LATE_ROBOT_TIMEOUT_S { RESUME_SPEED_FRACTION } else { pace };
        let slowed = decision.wheels.scaled(pace);
        let pose = self.navigator.drive.step(leader.pose, slowed, world.dt_s);
        WheelStep { pose, wheels: decision.wheels }
    }

    /// Finds where on the line to its goal a navigator begins its task.
    fn locate_on_goal_line(&mut self) {
        // A task without a leader's memory has not taken its first step yet.
        if self.body.driving.leader.is_some() {
            return;
        }
        if let Some(goal) = &self.navigator.goal {
            let at = convert_dimensions(self.initiator.position(self.body));
            self.body.driving.next = goal.start_waypoint_index(at) as u32;
        }
    }

    /// Returns where the connector of a navigator goes to be at its robot again after an escape or a pull by the
    /// other end has moved it; none while it is there. One that an escape has just moved stays: on the way back it
    /// would meet the same obstacle.
    pub(super) fn robot_return_target(&self, has_fled: bool) -> Option<Point<D>> {
        let leader = self.body.driving.leader.filter(|_| self.has_robots())?;
        let at = self.initiator.position(self.body);
        let robot = convert_dimensions(leader.pose.at);
        if at == robot {
            return None;
        }
        Some(if has_fled { at } else { move_toward(at, robot, self.initiator.step_m()) })
    }

    /// Returns the heading to turn to in this cycle where a navigator's robot, which has followed its connector, no
    /// longer has the heading that it had when its own wheels led.
    pub(super) fn turn_target_rad(&self) -> Option<f64> {
        let leader = self.body.driving.leader.filter(|_| self.has_robots())?;
        let [x, y, _] = self.body.driving.ahead;
        let off_rad = wrap_angle(atan2(y, x) - leader.pose.heading_rad);
        let drive = &self.navigator.drive;
        let dt_s = self.initiator.context.world.dt_s;
        let most = drive.max_wheel_m_s();
        let most_rad = drive.turn_rad_s(WheelSpeeds::new(-most, most)) * dt_s;
        let turn_rad = off_rad.clamp(-most_rad, most_rad);
        (off_rad.abs() > HEADING_TOLERANCE_RAD)
            .then(|| wrap_angle(leader.pose.heading_rad + turn_rad))
    }

    /// Updates a navigator that has moved, with a heading that the chain did not veto.
    fn update_heading(&mut self, heading_rad: f64) {
        let at: Point<2> = convert_dimensions(self.initiator.position(self.body));
        let driving = &mut self.body.driving;
        let Some(leader) = &mut driving.leader else { return };
        leader.pose = Pose2 { at, heading_rad };
        driving.ahead = [cos(heading_rad), sin(heading_rad), 0.0];
        if let Some(goal) = &self.navigator.goal {
            driving.next = goal.reached_index(at, driving.next as usize) as u32;
            if let NavigationGoal::Target { at: target, .. } = goal {
                driving.nearest_m = driving.nearest_m.min(distance(at, *target));
            }
        }
    }

    /// Turns a navigator that is blocked on the spot, if it can.
    fn turn_if_blocked(&mut self, wheels: WheelSpeeds) {
        let Some(leader) = self.body.driving.leader else { return };
        let wheels = self.navigator.leader.wheel_speeds_if_blocked(wheels);
        let turned =
            self.navigator.drive.step(leader.pose, wheels, self.initiator.context.world.dt_s);
        self.update_heading(turned.heading_rad);
    }

    /// Returns the fraction of its speed at which a leader may drive, so that the robot that lags most keeps up.
    fn speed_fraction(&self) -> f64 {
        let Some(robots) = &self.initiator.context.spec.robots else { return 1.0 };
        let followers = self.body.robots.iter().zip(self.body.chain.points());
        let lags_m = followers.map(|(robot, at)| distance(robot.pose.at, convert_dimensions(*at)));
        speed_fraction(lags_m.fold(0.0, f64::max), robots.lag_limit_m)
    }
}
