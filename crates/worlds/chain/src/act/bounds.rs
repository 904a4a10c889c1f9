//! Escapes from approaching obstacles, and the return of a chain to its claim.

use super::joints::ArmJointSolver;
use super::{ChainContext, ChainCycleState};
use crate::events::{Event, EventKind};
use crate::motion::escape::{ObstacleEscapeInput, ObstacleEscaper};
use crate::scratch::PositionBuffer;
use crate::state::ChainBodyState;
use sidestep_rods::geometry::{Aabb, convert_dimensions, distance};
use sidestep_rods::{Veto, VetoReason};

/// Relative tolerance for motions at exactly the maximum speed.
const ROUNDING: f64 = 1e-9;

/// How a chain escapes, and where it may be.
pub(super) struct EscapeContext<'a, const D: usize> {
    pub(super) escaper: Option<&'a mut ObstacleEscaper<D>>,
    /// Its positions after parts of it escaped; none where nothing escapes and no other chain is there.
    pub(super) escaped: &'a mut PositionBuffer<D>,
    /// The box that it stays in.
    pub(super) claim: Aabb<D>,
}

impl<const D: usize> EscapeContext<'_, D> {
    /// Moves parts that an obstacle comes too near to, whether they lead or follow. Returns whether the chain is
    /// pressed, so that its initiator gives way.
    pub(super) fn escape(
        &mut self,
        context: ChainContext<'_, D>,
        acting: &mut ChainCycleState<'_, D>,
    ) -> bool {
        let Some(escaper) = &mut self.escaper else { return false };
        let ChainCycleState { body, before, propagator, sink, .. } = acting;
        let tick = ObstacleEscapeInput {
            chain: &mut body.chain,
            obstacles: context.obstacles,
            propagator,
            start: &before.points,
        };
        let escaped = escaper.escape(tick, &mut body.escape_plan);
        // Beyond the range of coordinates there is no escape.
        let Ok(escaped) = escaped else { return false };
        if let Some(mut arm) = ArmJointSolver::from_body(context, before, body) {
            arm.escape();
        }
        body.tally.escapes.add(&escaped);
        sink.record_in_trace(|trace| trace.escapes = escaped.moves);
        self.escaped.record(body);
        move_leader_robot(context, body);
        // Only the first of several cycles of escape in a row is an event.
        let first = escaped.first.filter(|_| !body.tally.is_escaping);
        if let Some((connector, obstacle)) = first {
            let moves = escaped.moves as f64;
            let event = sink.new_event(&body.chain, EventKind::Escape, connector, moves);
            sink.events.push(Event { obstacle: Some(obstacle), ..event });
        }
        body.tally.is_escaping = escaped.moves > 0;
        escaped.is_pressed
    }

    /// Returns whether a connector escaped in this cycle.
    pub(super) fn has_escaped(&self, k: usize, before: &PositionBuffer<D>) -> bool {
        self.escaped.points.get(k).is_some_and(|at| before.points.get(k) != Some(at))
    }

    /// Undoes moves that would leave the claim, because chains of other conflict groups move at the same time and
    /// rely on it; also moves that, together with escapes, would be faster than escapes may be. Returns the veto of
    /// them.
    pub(super) fn enforce_claim(
        &self,
        context: ChainContext<'_, D>,
        body: &mut ChainBodyState<D>,
        before: &PositionBuffer<D>,
    ) -> Option<Veto<D>> {
        let world = context.world;
        let most_m = match &world.escape {
            Some(escape) => escape.speed_max_m_s * world.dt_s * (1.0 + ROUNDING),
            // No other chain relies on the claim of the only one.
            None if world.chains.len() == 1 => return None,
            None => f64::INFINITY,
        };
        let mut moves = body.chain.points().iter().zip(&before.points);
        let by = moves.position(|(p, was)| {
            distance(*p, *was) > most_m || !self.claim.intersects(&Aabb::from_points(&[*p]))
        })?;
        self.escaped.restore(body);
        // After the last task connector 0 stands for the chain.
        let from = context.task(body).map_or(0, |task| task.agent);
        let reached = body.chain.points()[from];
        move_leader_robot(context, body);
        Some(Veto { by, from, reason: VetoReason::StepLimit, obstacle: None, reached })
    }
}

/// Keeps a leader on wheels at its connector after the connector was moved; if it is a robot, it follows on its
/// wheels, from where it is.
fn move_leader_robot<const D: usize>(context: ChainContext<'_, D>, body: &mut ChainBodyState<D>) {
    let agent = context.task(body).map(|task| task.agent);
    let Some(leader) = &mut body.driving.leader else { return };
    let Some(agent) = agent else { return };
    let at = convert_dimensions(body.chain.points()[agent]);
    match body.robots.get(agent) {
        None => leader.pose.at = at,
        Some(robot) if leader.pose.at != at => leader.pose = robot.pose,
        Some(_) => {}
    }
}
