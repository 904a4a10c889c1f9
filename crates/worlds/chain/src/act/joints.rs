//! Arms: the chain moves first as a guide, and the joints follow it within their limits and speeds. Forward
//! kinematics then places the connectors, so an arm is never where its joints cannot be. All of this moves the
//! *reference* of the joints, which they follow in time; see `joint_motion`.

#[cfg(test)]
mod tests;

use super::joint_motion::StopCheck;
use super::situation::has_held_connector;
use super::{ChainContext, ChainCycleState, Initiator};
use crate::clearance::min_clearance;
use crate::driver::step_motion::StepMotion;
use crate::motion::recovery::RecoveryOutcome;
use crate::motion::request::TOLERANCE_M;
use crate::scratch::PositionBuffer;
use crate::state::ChainBodyState;
use sidestep_arms::Arm;
use sidestep_arms::kinematics::ConnectorTarget;
use sidestep_arms::motion::MotionState;
use sidestep_arms::plan::{JointPosture, JointSpace};
use sidestep_rods::geometry::{Point, distance, lerp};
use sidestep_rods::{
    Chain, CompletedMotion, MotionOutcome, RequestSource, RequestedMotion, Veto, VetoReason,
    find_tunneling,
};

/// Fractions of a motion that are tried, each half of the one before: down to 1/32; less is not worth
/// the search.
const MAX_TRIES: usize = 6;
/// Fractions of an escape that are tried; fewer, because escapes come in every cycle.
const MAX_ESCAPE_TRIES: usize = 3;
/// Fraction of the distance to its target by which an initiator that only approaches must come nearer; less is not
/// worth the joints' motion.
const MIN_APPROACH_FRACTION: f64 = 0.25;
/// Relative tolerance for motions at exactly the maximum speed.
const ROUNDING: f64 = 1e-9;

/// A connector that leads, and where to.
#[derive(Clone, Copy)]
struct LeadTarget<const D: usize> {
    k: usize,
    to: Point<D>,
}

/// A posture of an arm: its joints, and where they put its connectors.
struct ArmPosture<const D: usize> {
    joints: Vec<f64>,
    points: Vec<Point<D>>,
    /// The connectors that it is to lead, and their targets.
    led: Vec<LeadTarget<D>>,
}

/// The motion that joints are to follow.
struct TrackingReference<'b, const D: usize> {
    from: &'b [Point<D>],
    guide: Option<&'b [Point<D>]>,
    led: &'b [LeadTarget<D>],
}

impl<const D: usize> TrackingReference<'_, D> {
    /// Returns where connector `k` is after a fraction of its way to `to`.
    fn interpolated_position(&self, k: usize, to: Point<D>, fraction: f64) -> Point<D> {
        // An interpolation to the end would differ from it by rounding.
        if fraction < 1.0 { lerp(self.from[k], to, fraction) } else { to }
    }
}

/// An arm whose joints come along with its chain.
pub(super) struct ArmJointSolver<'a, const D: usize> {
    context: ChainContext<'a, D>,
    before: &'a PositionBuffer<D>,
    arm: &'a Arm,
    chain: &'a mut Chain<D>,
    joints: &'a mut Vec<f64>,
    motion: &'a MotionState,
}

/// Returns the distance at which an initiator is where a script wants it, meters: where a connector is held, return
/// passes bring it only so near.
pub(super) fn arrival_tolerance_m<const D: usize>(
    context: ChainContext<'_, D>,
    chain: &Chain<D>,
) -> f64 {
    match context.spec.arm.as_deref() {
        Some(arm) => arm.follower.arrival_tolerance_m(),
        None if !chain.is_plain() && has_held_connector(chain) => TOLERANCE_M,
        None => chain.min_move_m(),
    }
}

/// Lets the joints come along with an initiator's motion; what they cannot do is vetoed.
pub(super) fn move_joints_with_initiator<const D: usize>(
    initiator: Initiator<'_, D>,
    acting: &mut ChainCycleState<'_, D>,
    to: Point<D>,
    climbed: RecoveryOutcome<D>,
) -> RecoveryOutcome<D> {
    let Some(mut arm) = ArmJointSolver::from_body(initiator.context, acting.before, acting.body)
    else {
        return climbed;
    };
    let k = initiator.task.agent;
    let (has_moved, at) = match climbed {
        // The chain reaches a place to some tolerance, the joints exactly.
        RecoveryOutcome::Straight(_) => (true, to),
        RecoveryOutcome::Shorter { .. } | RecoveryOutcome::Sideways { .. } => {
            (true, arm.chain.points()[k])
        }
        _ => (false, to),
    };
    let followed = arm.follow(&[LeadTarget { k, to: at }], MAX_TRIES).or_else(|veto| {
        // Planners and operators want exactly this place, not one near it.
        let decides = initiator.task.request_source() == RequestSource::Autonomous;
        if decides && arm.approach(LeadTarget { k, to }) { Ok(()) } else { Err(veto) }
    });
    match followed {
        Ok(()) if has_moved => climbed,
        Ok(()) => RecoveryOutcome::Straight(initiator_only_motion(k)),
        Err(veto) => {
            acting.record_veto(&veto);
            if has_moved { RecoveryOutcome::Vetoed(veto) } else { climbed }
        }
    }
}

impl<'a, const D: usize> ArmJointSolver<'a, D> {
    /// Returns the arm that a chain represents, if it does.
    pub(super) fn from_body(
        context: ChainContext<'a, D>,
        before: &'a PositionBuffer<D>,
        body: &'a mut ChainBodyState<D>,
    ) -> Option<Self> {
        let arm = context.spec.arm.as_deref()?;
        let joints = body.joints.as_mut()?;
        Some(Self { context, before, arm, chain: &mut body.chain, joints, motion: &body.motion })
    }

    /// Lets the joints carry out an order: all of it, or nothing.
    pub(super) fn execute_order(
        &mut self,
        step: &StepMotion<D>,
        part: f64,
        outcome: MotionOutcome<D>,
    ) -> MotionOutcome<D> {
        let followed = match step.partial_motion(part) {
            RequestedMotion::Connector { k, to } => self.follow(&[LeadTarget { k, to }], 1),
            RequestedMotion::Rod { i, to: [to, next] } => {
                self.follow(&[LeadTarget { k: i, to }, LeadTarget { k: i + 1, to: next }], 1)
            }
        };
        match (followed, outcome) {
            (Ok(()), MotionOutcome::Vetoed(_)) => {
                MotionOutcome::Moved(initiator_only_motion(step.first))
            }
            (Ok(()), moved) => moved,
            // The veto of the chain itself says more than that of its joints.
            (Err(_), vetoed @ MotionOutcome::Vetoed(_)) => vetoed,
            (Err(veto), MotionOutcome::Moved(_)) => MotionOutcome::Vetoed(veto),
        }
    }

    /// Brings the joints along a motion of the chain that took connectors to where they are `led`, or along the
    /// largest part of it of `tries`, with the chain as the guide and, where that leads into something, without.
    ///
    /// # Errors
    /// When no part goes: the objection to the least. Then everything is as before the motion.
    fn follow(&mut self, led: &[LeadTarget<D>], tries: usize) -> Result<(), Veto<D>> {
        let (from, guide) = self.reset_to_joints();
        // A chain that has not moved guides the joints nowhere.
        let guide = (guide != from).then_some(&guide[..]);
        let guided = TrackingReference { from: &from, guide, led };
        let free = TrackingReference { guide: None, ..guided };
        let mut objection = None;
        let mut fraction = 1.0;
        for _ in 0..tries {
            for wanted in [&guided, &free] {
                let posed = self.solve_posture(wanted, fraction);
                let veto = self.find_motion_veto(&from, &posed);
                if veto.is_none() {
                    self.adopt(posed);
                    return Ok(());
                }
                objection = veto;
            }
            fraction *= 0.5;
        }
        objection.map_or(Ok(()), Err)
    }

    /// Brings an initiator nearer to a place to which its joints cannot take it straight; returns whether it came.
    fn approach(&mut self, led: LeadTarget<D>) -> bool {
        let LeadTarget { k, to } = led;
        let (from, _) = self.reset_to_joints();
        let mut posed =
            self.solve_posture(&TrackingReference { from: &from, guide: None, led: &[led] }, 1.0);
        let left_m = distance(posed.points[k], to);
        posed.led[0].to = posed.points[k];
        let comes = left_m <= (1.0 - MIN_APPROACH_FRACTION) * distance(from[k], to)
            && self.find_motion_veto(&from, &posed).is_none();
        if comes {
            self.adopt(posed);
        }
        comes
    }

    /// Brings the joints along an escape of the chain: to where nothing vetoes or, where parts are inside an obstacle
    /// already, to where they are least deep in it.
    pub(super) fn escape(&mut self) {
        let (from, guide) = self.reset_to_joints();
        if guide == from {
            return;
        }
        let wanted = TrackingReference { from: &from, guide: Some(&guide), led: &[] };
        let mut best: Option<ArmPosture<D>> = None;
        let joints = self.joints.clone();
        let mut least_m = self.clearance_m(&joints, &from);
        let mut part = 1.0;
        for _ in 0..MAX_ESCAPE_TRIES {
            let posed = self.solve_posture(&wanted, part);
            let Some(veto) = self.find_veto(&from, &posed) else {
                best = Some(posed);
                break;
            };
            let clearance_m = self.clearance_m(&posed.joints, &posed.points);
            if veto.reason == VetoReason::BothSidesBlocked && clearance_m > least_m {
                least_m = clearance_m;
                best = Some(posed);
            }
            part *= 0.5;
        }
        if let Some(posed) = best {
            self.adopt(posed);
        }
    }

    /// Puts the chain back to where its joints are; returns where that is, and where the chain was.
    fn reset_to_joints(&mut self) -> (Vec<Point<D>>, Vec<Point<D>>) {
        let from: Vec<Point<D>> = self.arm.connector_positions(self.joints);
        let guide = self.chain.points().to_vec();
        self.chain.points_mut().copy_from_slice(&from);
        (from, guide)
    }

    /// Returns the posture in which the joints follow a part of a motion.
    fn solve_posture(&self, wanted: &TrackingReference<'_, D>, part: f64) -> ArmPosture<D> {
        let arm = self.arm;
        let guide = wanted.guide.map(|guide| {
            let places = guide.iter().enumerate();
            places
                .map(|(k, to)| arm.to_base(wanted.interpolated_position(k, *to, part)))
                .collect::<Vec<_>>()
        });
        let mut led = Vec::with_capacity(wanted.led.len());
        let mut aims = Vec::with_capacity(wanted.led.len());
        for &LeadTarget { k, to } in wanted.led {
            let to = wanted.interpolated_position(k, to, part);
            led.push(LeadTarget { k, to });
            aims.push(ConnectorTarget { connector: k, at_m: arm.to_base(to) });
        }
        let limits = arm.follower.limits();
        let room = arm.motion.reference_ranges(self.motion, &self.before.joints, limits);
        let joints = arm.follower.track(self.joints, &room, guide.as_deref(), &aims);
        let points = arm.connector_positions(&joints);
        ArmPosture { joints, points, led }
    }

    /// Returns the veto of a posture, or of the way on which the joints come to rest in it.
    fn find_motion_veto(&mut self, from: &[Point<D>], posed: &ArmPosture<D>) -> Option<Veto<D>> {
        if let Some(veto) = self.find_veto(from, posed) {
            return Some(veto);
        }
        let k = posed.led.first().map_or(0, |led| led.k);
        let stop = StopCheck {
            context: self.context,
            arm: self.arm,
            chain: self.chain,
            k,
            line_tolerance_m: None,
        };
        stop.find_veto(self.motion, &self.before.joints, &posed.joints)
    }

    /// Returns the veto of a posture: by the joints, which do not take a connector to where it is led; by speeds; by
    /// the chain and the obstacles around it.
    fn find_veto(&mut self, from: &[Point<D>], posed: &ArmPosture<D>) -> Option<Veto<D>> {
        let follower = &self.arm.follower;
        let k = posed.led.first().map_or(0, |led| led.k);
        // A veto by the initiator for want of speed; the others differ from it in some fields.
        let reason = VetoReason::StepLimit;
        let too_slow = Veto { by: k, from: k, reason, obstacle: None, reached: from[k] };
        let tolerance_m = follower.arrival_tolerance_m();
        let mut led = posed.led.iter();
        if led.any(|led| distance(posed.points[led.k], led.to) > tolerance_m) {
            if follower.is_at_limit(&posed.joints) {
                return Some(Veto { reason: VetoReason::JointLimit, ..too_slow });
            }
            return Some(too_slow);
        }
        if let Some(by) = (0..from.len()).find(|&i| self.is_too_fast(i, from[i], posed.points[i])) {
            return Some(Veto { by, ..too_slow });
        }
        let ChainContext { world, obstacles, .. } = self.context;
        let is_solid = world.rules.self_collision;
        let present = JointPosture { arm: self.arm, joints: self.joints };
        let space = JointSpace::new(present, self.chain, obstacles, is_solid, k);
        if let Some(veto) = space.find_veto(&posed.joints, &posed.points) {
            return Some(veto);
        }
        let (by, id) = self.find_tunneling(from, posed)?;
        Some(Veto { by, reason: VetoReason::WouldTunnel, obstacle: Some(id), ..too_slow })
    }

    /// Returns whether a connector moves farther than it may: at the speed of led joints from where it was before this
    /// motion, or at that of escapes from where it was before the cycle.
    fn is_too_fast(&self, i: usize, from: Point<D>, to: Point<D>) -> bool {
        let world = self.context.world;
        if distance(from, to) > world.rules.joint_step_max_m * (1.0 + ROUNDING) {
            return true;
        }
        let Some(escape) = &world.escape else { return false };
        let most_m = escape.speed_max_m_s * world.dt_s;
        distance(self.before.points[i], to) > most_m * (1.0 + ROUNDING)
    }

    /// Returns the rod's outer connector and the obstacle that it would pass through on the way to a posture, if any.
    fn find_tunneling(&mut self, from: &[Point<D>], posed: &ArmPosture<D>) -> Option<(usize, u32)> {
        self.chain.points_mut().copy_from_slice(&posed.points);
        let passed = find_tunneling(self.chain, from, self.context.obstacles, 0.0);
        self.chain.points_mut().copy_from_slice(from);
        passed.map(|passed| (passed.rod + 1, passed.obstacle))
    }

    /// Returns the least clearance that the arm has, or would have, in a posture that puts its connectors there.
    fn clearance_m(&mut self, joints: &[f64], points: &[Point<D>]) -> f64 {
        let ChainContext { world, obstacles, .. } = self.context;
        if let Some(body) = &self.arm.body {
            return body.clearance_m(self.arm.posture(joints), obstacles, world.look_m).0;
        }
        let was = self.chain.points().to_vec();
        self.chain.points_mut().copy_from_slice(points);
        let (least_m, _) = min_clearance(self.chain, obstacles, world.look_m, true);
        self.chain.points_mut().copy_from_slice(&was);
        least_m
    }

    fn adopt(&mut self, posed: ArmPosture<D>) {
        self.chain.points_mut().copy_from_slice(&posed.points);
        *self.joints = posed.joints;
    }
}

/// Returns the motion of an initiator whose joints move it without the chain's help.
fn initiator_only_motion<const D: usize>(k: usize) -> CompletedMotion<D> {
    CompletedMotion {
        touched: k..k + 1,
        changed: 1,
        rotated: 0,
        max_slave_step_m: 0.0,
        cut_short: None,
    }
}
