//! The joints of an arm in time. While a chain acts, an arm stands at its *reference*: where the rules of the chain and
//! its planner have led it. At the end of each cycle the joints follow the reference within their speeds, accelerations
//! and jerks, and the chain stands where they are.
//!
//! The reference moves only to where the joints can stop: every posture of the cycles in which they would come to rest
//! there is checked as a posture of a plan is. So a reference that is vetoed may always rest. Obstacles that move, and
//! escapes from them, do not wait for that.

use super::ChainContext;
use crate::scratch::PositionBuffer;
use crate::state::ChainBodyState;
use sidestep_arms::Arm;
use sidestep_arms::motion::MotionState;
use sidestep_arms::plan::{JointPosture, JointSpace};
use sidestep_rods::geometry::{Point, norm, normalized, perpendicular_component, sub};
use sidestep_rods::{Chain, Veto, VetoReason, find_tunneling};

/// Puts an arm at its reference; returns where its joints are. Nothing happens to other chains.
pub(super) fn start_cycle<const D: usize>(
    context: ChainContext<'_, D>,
    body: &mut ChainBodyState<D>,
) -> Option<Vec<f64>> {
    let arm = context.spec.arm.as_deref()?;
    let joints = body.joints.as_mut()?;
    let reference = body.motion.reference(joints).to_vec();
    let actual = std::mem::replace(joints, reference);
    // At rest the chain is at the reference already.
    if !body.motion.is_at_rest() {
        let points: Vec<Point<D>> = arm.connector_positions(joints);
        body.chain.points_mut().copy_from_slice(&points);
    }
    Some(actual)
}

/// Lets the joints follow the reference for a cycle from where they were, and puts the chain where they are.
pub(super) fn finish_cycle<const D: usize>(
    context: ChainContext<'_, D>,
    body: &mut ChainBodyState<D>,
    actual: Option<Vec<f64>>,
) {
    let (Some(arm), Some(actual)) = (context.spec.arm.as_deref(), actual) else { return };
    let Some(reference) = body.joints.take() else { return };
    let step = arm.motion.advance(&mut body.motion, &actual, &reference);
    body.tally.add_joint_rates(&step.rates);
    if step.joints != reference {
        let points: Vec<Point<D>> = arm.connector_positions(&step.joints);
        body.chain.points_mut().copy_from_slice(&points);
    }
    body.joints = Some(step.joints);
}

/// Returns whether a chain's connector is where it is led to be: of an arm the joints follow its reference, and have to
/// be there as well. `actual` are the positions before this cycle.
pub(super) fn has_followed<const D: usize>(
    body: &ChainBodyState<D>,
    actual: &PositionBuffer<D>,
    arrival: impl Fn(Point<D>) -> bool,
    k: usize,
) -> bool {
    has_come_to_rest(body) || actual.points.get(k).is_none_or(|at| arrival(*at))
}

/// Returns whether the joints of an arm rest where their reference is; always of other chains.
pub(super) fn has_come_to_rest<const D: usize>(body: &ChainBodyState<D>) -> bool {
    body.motion.is_at_rest()
}

/// The least distances of an arm's body.
pub(super) struct ArmClearance {
    /// From obstacles, as far as they are looked for, m.
    pub(super) obstacles_m: f64,
    /// The connector that stands for the part which is nearest to one.
    pub(super) connector: usize,
    /// Between parts that must not touch, m; infinite if it does not matter how far apart they are.
    pub(super) own_m: f64,
}

/// Returns the least distances of an arm with shapes; none of other chains.
pub(super) fn arm_clearance<const D: usize>(
    context: ChainContext<'_, D>,
    body: &ChainBodyState<D>,
) -> Option<ArmClearance> {
    let arm = context.spec.arm.as_deref()?;
    let shapes = arm.body.as_ref()?;
    let look_m = context.world.look_m;
    let posture = arm.posture(body.joints.as_ref()?);
    let (obstacles_m, link) = shapes.clearance_m(posture, context.obstacles, look_m);
    let own_m = shapes.own_gap_m(posture, body.tally.own_gap_to_find_m(look_m));
    Some(ArmClearance { obstacles_m, connector: arm.connector_of_link(link), own_m })
}

/// The check of the cycles in which joints come to rest.
pub(super) struct StopCheck<'a, const D: usize> {
    pub(super) context: ChainContext<'a, D>,
    pub(super) arm: &'a Arm,
    /// The arm's chain at its reference.
    pub(super) chain: &'a Chain<D>,
    /// The connector that leads.
    pub(super) k: usize,
    /// How far it may leave the straight line of its recent references, m; none where it has to follow none.
    pub(super) line_tolerance_m: Option<f64>,
}

impl<const D: usize> StopCheck<'_, D> {
    /// Returns the first veto of the postures in which the joints come to rest at `reference`, or of tunneling between
    /// two of them; `joints` are the last reference.
    pub(super) fn find_veto(
        &self,
        motion: &MotionState,
        joints: &[f64],
        reference: &[f64],
    ) -> Option<Veto<D>> {
        let ChainContext { world, obstacles, .. } = self.context;
        let present = JointPosture { arm: self.arm, joints };
        let is_solid = world.rules.self_collision;
        let space = JointSpace::new(present, self.chain, obstacles, is_solid, self.k);
        let line = self.line_tolerance_m.map(|tolerance_m| StraightLine {
            ends: [motion.oldest_reference(joints), reference].map(|posture| self.tool(posture)),
            tolerance_m,
        });
        let mut moved = self.chain.clone();
        let mut before: Option<Vec<Point<D>>> = None;
        for posture in self.arm.motion.stop_postures(motion, joints, reference) {
            let points: Vec<Point<D>> = self.arm.connector_positions(&posture);
            if let Some(veto) = space.find_veto(&posture, &points) {
                return Some(veto);
            }
            if line.as_ref().is_some_and(|line| line.is_left_at(points[self.k])) {
                let reached = self.chain.points()[self.k];
                let reason = VetoReason::StepLimit;
                return Some(Veto { by: self.k, from: self.k, reason, obstacle: None, reached });
            }
            moved.points_mut().copy_from_slice(&points);
            if let Some(before) = before.replace(points)
                && let Some(tunneled) = find_tunneling(&moved, &before, obstacles, 0.0)
            {
                let reached = self.chain.points()[self.k];
                return Some(Veto {
                    by: tunneled.rod + 1,
                    from: self.k,
                    reason: VetoReason::WouldTunnel,
                    obstacle: Some(tunneled.obstacle),
                    reached,
                });
            }
        }
        None
    }

    /// Returns where the connector that leads is in a posture.
    fn tool(&self, posture: &[f64]) -> Point<D> {
        self.arm.connector_positions(posture)[self.k]
    }
}

/// The line that a tool follows.
struct StraightLine<const D: usize> {
    ends: [Point<D>; 2],
    tolerance_m: f64,
}

impl<const D: usize> StraightLine<D> {
    fn is_left_at(&self, at: Point<D>) -> bool {
        let [from, to] = self.ends;
        let along = normalized(sub(to, from)).unwrap_or([0.0; D]);
        norm(perpendicular_component(sub(at, from), along)) > self.tolerance_m
    }
}
