//! Arms of joints: the chain goes ahead as a guide, and the joints follow it inside their limits and at their speeds.
//! The connectors are where the joints put them, so an arm is never where its joints cannot be.

#[cfg(test)]
mod tests;

use super::Acting;
use crate::arms::arm::Arm;
use crate::arms::kinematics::Aim;
use crate::arms::plan::JointSpace;
use crate::clearance::least_clearance;
use crate::driver::Task;
use crate::driver::errand::Errand;
use crate::motion::go::TOLERANCE_M;
use crate::motion::replan::Climbed;
use crate::rods::chain::{Connector, Mobility};
use crate::rods::geometry::{Point, between, distance};
use crate::rods::passage::passed;
use crate::rods::veto::{Motion, Moved, Outcome, Reason, Source, Veto};

/// Parts of a motion that are tried, each half of the one before.
const TRIES: usize = 6;
/// Parts of a motion out of the way that are tried.
const ESCAPES: usize = 3;
/// Part of its way that an initiator which only comes nearer must make good.
const NEARER: f64 = 0.25;
/// Relative tolerance for ways at exactly the greatest speed.
const ROUNDING: f64 = 1e-9;

/// A connector that leads, and where to.
type Led<const D: usize> = (usize, Point<D>);

/// A posture of an arm: its joints, and where they put its connectors.
struct Posed<const D: usize> {
    joints: Vec<f64>,
    points: Vec<Point<D>>,
}

/// The motion that joints are to follow.
struct Wanted<'b, const D: usize> {
    from: &'b [Point<D>],
    guide: Option<&'b [Point<D>]>,
    led: &'b [Led<D>],
}

impl<'a, const D: usize> Acting<'a, D> {
    fn arm(&self) -> Option<&'a Arm> {
        self.spec.arm.as_deref()
    }

    /// Notes the joints of an arm at the start of its cycle.
    pub(super) fn note_joints(&mut self) {
        let joints = self.body.joints.as_deref().unwrap_or_default();
        self.scratch.joints_before.clear();
        self.scratch.joints_before.extend_from_slice(joints);
        self.scratch.joints_escaped.clone_from(&self.scratch.joints_before);
    }

    /// Returns the distance at which an initiator is where a script wants it, meters: where a connector is held, return
    /// passes bring it only so near.
    pub(super) fn there_m(&self) -> f64 {
        let chain = &self.body.chain;
        let is_held = |c: &Connector<D>| c.is_still() || c.mobility != Mobility::Free;
        match self.arm() {
            Some(arm) => arm.follower.exact_m(),
            None if !chain.is_plain() && chain.connectors().iter().any(is_held) => TOLERANCE_M,
            None => chain.least_move_m(),
        }
    }

    /// Lets the joints follow an initiator's motion; what they cannot do is vetoed.
    pub(super) fn joints_climb(
        &mut self,
        task: &Task<D>,
        to: Point<D>,
        climbed: Climbed<D>,
    ) -> Climbed<D> {
        if self.body.joints.is_none() {
            return climbed;
        }
        let k = task.agent;
        let (has_moved, at) = match climbed {
            // The chain reaches a place to some tolerance, the joints exactly.
            Climbed::Straight(_) => (true, to),
            Climbed::Shorter { .. } | Climbed::Sideways { .. } => {
                (true, self.body.chain.points()[k])
            }
            _ => (false, to),
        };
        let followed = self.joints_follow(&[(k, at)], TRIES).or_else(|veto| {
            let comes_nearer = task.source() == Source::Autonomous && self.joints_approach((k, to));
            if comes_nearer { Ok(()) } else { Err(veto) }
        });
        match followed {
            Ok(()) if has_moved => climbed,
            Ok(()) => Climbed::Straight(alone(k)),
            Err(veto) => {
                self.vetoed(&veto);
                if has_moved { Climbed::Vetoed(veto) } else { climbed }
            }
        }
    }

    /// Lets the joints carry out an order: all of it, or nothing.
    pub(super) fn joints_obey(
        &mut self,
        errand: &Errand<D>,
        part: f64,
        outcome: Outcome<D>,
    ) -> Outcome<D> {
        if self.body.joints.is_none() {
            return outcome;
        }
        let followed = match errand.motion(part) {
            Motion::Connector { k, to } => self.joints_follow(&[(k, to)], 1),
            Motion::Rod { i, to } => self.joints_follow(&[(i, to[0]), (i + 1, to[1])], 1),
        };
        match (followed, outcome) {
            (Ok(()), Outcome::Vetoed(_)) => Outcome::Moved(alone(errand.first)),
            (Ok(()), moved) => moved,
            // Where the chain itself objects, it says more than its joints do.
            (Err(_), vetoed @ Outcome::Vetoed(_)) => vetoed,
            (Err(veto), Outcome::Moved(_)) => Outcome::Vetoed(veto),
        }
    }

    /// Brings the joints along a motion of the chain that took connectors to where they are `led`, or along the
    /// largest part of it of `tries`, with the chain as the guide and, where that leads into something, without.
    ///
    /// # Errors
    /// When no part goes: the objection to the least. Then everything is as before the motion.
    fn joints_follow(&mut self, led: &[Led<D>], tries: usize) -> Result<(), Veto<D>> {
        let (from, guide) = self.back_to_joints();
        let guide = (guide != from).then_some(&guide[..]);
        let guided = Wanted { from: &from, guide, led };
        let free = Wanted { guide: None, ..guided };
        let mut objection = None;
        let mut part = 1.0;
        for _ in 0..tries {
            for wanted in [&guided, &free] {
                let (posed, led) = self.posed(wanted, part);
                match self.joints_object(&from, &posed, &led) {
                    None => {
                        self.take(posed);
                        return Ok(());
                    }
                    objects => objection = objects,
                }
            }
            part *= 0.5;
        }
        objection.map_or(Ok(()), Err)
    }

    /// Brings an initiator nearer to a place to which its joints cannot take it straight; returns whether it came.
    fn joints_approach(&mut self, (k, to): Led<D>) -> bool {
        let (from, _) = self.back_to_joints();
        let wanted = Wanted { from: &from, guide: None, led: &[(k, to)] };
        let (posed, _) = self.posed(&wanted, 1.0);
        let left_m = distance(posed.points[k], to);
        let comes = left_m <= (1.0 - NEARER) * distance(from[k], to)
            && self.joints_object(&from, &posed, &[(k, posed.points[k])]).is_none();
        if comes {
            self.take(posed);
        }
        comes
    }

    /// Brings the joints along a motion of the chain out of the way: to where nothing objects or, where parts are
    /// in something already, to where they are in it least.
    pub(super) fn joints_escape(&mut self) {
        if self.body.joints.is_none() {
            return;
        }
        let (from, guide) = self.back_to_joints();
        if guide == from {
            return;
        }
        let wanted = Wanted { from: &from, guide: Some(&guide), led: &[] };
        let mut best: Option<Posed<D>> = None;
        let (mut least_m, mut part) = (self.clearance_m(&from), 1.0);
        for _ in 0..ESCAPES {
            let (posed, _) = self.posed(&wanted, part);
            let Some(veto) = self.joints_object(&from, &posed, &[]) else {
                best = Some(posed);
                break;
            };
            let clearance_m = self.clearance_m(&posed.points);
            if veto.reason == Reason::BothSidesBlocked && clearance_m > least_m {
                (least_m, best) = (clearance_m, Some(posed));
            }
            part *= 0.5;
        }
        if let Some(posed) = best {
            self.take(posed);
        }
    }

    /// Puts the chain back to where its joints are; returns where that is, and where the chain was.
    fn back_to_joints(&mut self) -> (Vec<Point<D>>, Vec<Point<D>>) {
        let (Some(arm), Some(joints)) = (self.arm(), &self.body.joints) else {
            return Default::default();
        };
        let from: Vec<Point<D>> = arm.places(joints);
        let guide = self.body.chain.points().to_vec();
        self.body.chain.points_mut().copy_from_slice(&from);
        (from, guide)
    }

    /// Returns the posture in which the joints follow a part of a motion, and where that leads to.
    fn posed(&self, wanted: &Wanted<'_, D>, part: f64) -> (Posed<D>, Vec<Led<D>>) {
        let (Some(arm), Some(joints)) = (self.arm(), &self.body.joints) else {
            return (Posed { joints: Vec::new(), points: Vec::new() }, Vec::new());
        };
        let on_the_way = |k: usize, to: Point<D>| match part < 1.0 {
            true => between(wanted.from[k], to, part),
            false => to,
        };
        let guide = wanted.guide.map(|guide| {
            let places = guide.iter().enumerate();
            places.map(|(k, to)| arm.in_base(on_the_way(k, *to))).collect::<Vec<_>>()
        });
        let led: Vec<Led<D>> = wanted.led.iter().map(|(k, to)| (*k, on_the_way(*k, *to))).collect();
        let aim = |(k, to): &Led<D>| Aim { connector: *k, at_m: arm.in_base(*to) };
        let aims: Vec<Aim> = led.iter().map(aim).collect();
        let room = arm.follower.room(&self.scratch.joints_before, self.world.dt_s);
        let joints = arm.follower.follow(joints, &room, guide.as_deref(), &aims);
        let points = arm.places(&joints);
        (Posed { joints, points }, led)
    }

    /// Returns the objection to a posture: of the joints, that do not take a connector to where it is led; of speeds;
    /// of the chain and all that is around it.
    fn joints_object(
        &mut self,
        from: &[Point<D>],
        posed: &Posed<D>,
        led: &[Led<D>],
    ) -> Option<Veto<D>> {
        let arm = self.arm()?;
        let k = led.first().map_or(0, |(k, _)| *k);
        let veto = |by, reason| Veto { by, from: k, reason, obstacle: None, reached: from[k] };
        let is_off = |(k, to): &Led<D>| distance(posed.points[*k], *to) > arm.follower.exact_m();
        if led.iter().any(is_off) {
            let is_at_limit = arm.follower.is_at_limit(&posed.joints);
            return Some(veto(k, if is_at_limit { Reason::JointLimit } else { Reason::StepLimit }));
        }
        let is_fast = |i: &usize| self.is_too_fast(*i, from[*i], posed.points[*i]);
        if let Some(by) = (0..from.len()).find(is_fast) {
            return Some(veto(by, Reason::StepLimit));
        }
        let joints = self.body.joints.as_deref()?;
        let (chain, obstacles) = (&self.body.chain, &self.scratch.obstacles);
        let is_solid = self.world.rules.self_collision;
        let space = JointSpace::new((arm, joints), chain, obstacles, is_solid, k);
        let objection = space.objection(&posed.points);
        let tunnels = |(by, id)| Veto { obstacle: Some(id), ..veto(by, Reason::WouldTunnel) };
        objection.or_else(|| self.passes(from, posed).map(tunnels))
    }

    /// Returns whether a connector goes farther than it may: at the speed of led joints from where it was before this
    /// motion, or at that of escapes from where it was before the cycle.
    fn is_too_fast(&self, i: usize, from: Point<D>, to: Point<D>) -> bool {
        let escape_m = self.world.escape.as_ref().map(|e| e.speed_max_m_s * self.world.dt_s);
        let is_beyond = |from, most_m: f64| distance(from, to) > most_m * (1.0 + ROUNDING);
        is_beyond(from, self.world.rules.joint_step_max_m)
            || escape_m.is_some_and(|most_m| is_beyond(self.scratch.before[i], most_m))
    }

    /// Returns the rod's outer connector and the obstacle that it would pass through on the way to a posture, if any.
    fn passes(&mut self, from: &[Point<D>], posed: &Posed<D>) -> Option<(usize, u32)> {
        let chain = &mut self.body.chain;
        chain.points_mut().copy_from_slice(&posed.points);
        let passed = passed(chain, from, &self.scratch.obstacles, 0.0);
        chain.points_mut().copy_from_slice(from);
        passed.map(|passed| (passed.rod + 1, passed.obstacle))
    }

    /// Returns the least clearance that the chain has, or would have, at some places.
    fn clearance_m(&mut self, points: &[Point<D>]) -> f64 {
        let was = self.body.chain.points().to_vec();
        self.body.chain.points_mut().copy_from_slice(points);
        let obstacles = &self.scratch.obstacles;
        let (least_m, _) = least_clearance(&self.body.chain, obstacles, self.world.look_m, true);
        self.body.chain.points_mut().copy_from_slice(&was);
        least_m
    }

    fn take(&mut self, posed: Posed<D>) {
        self.body.chain.points_mut().copy_from_slice(&posed.points);
        self.body.joints = Some(posed.joints);
    }
}

/// Returns the motion of an initiator whose joints move it without the chain's help.
fn alone<const D: usize>(k: usize) -> Moved<D> {
    Moved { touched: k..k + 1, changed: 1, rotated: 0, max_slave_step_m: 0.0, cut_short: None }
}
