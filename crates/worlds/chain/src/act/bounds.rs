//! Moves out of the way of approaching obstacles, and back from places where a chain must not be.

use super::joints::ArmFollower;
use super::{ActState, ChainContext};
use crate::events::{Event, EventKind};
use crate::motion::escape::Escaper;
use crate::scratch::PositionBuffer;
use crate::state::Body;
use sidestep_rods::geometry::{Bounds, Point, distance, with_dimensions};
use sidestep_rods::{Veto, VetoReason};

/// Relative tolerance for ways at exactly the greatest speed.
const ROUNDING: f64 = 1e-9;

/// A chain's means to be where nothing hits it.
pub(super) struct EscapeContext<'a, const D: usize> {
    pub(super) escaper: Option<&'a mut Escaper<D>>,
    /// Its places after parts got out of the way.
    pub(super) escaped: &'a mut PositionBuffer<D>,
    /// The box that it stays in.
    pub(super) claim: Bounds<D>,
}

impl<const D: usize> EscapeContext<'_, D> {
    /// Moves parts that an obstacle comes too near to, whichever connector leads. Returns whether the chain is
    /// pressed, so that its initiator gives way.
    pub(super) fn escape(
        &mut self,
        setting: ChainContext<'_, D>,
        acting: &mut ActState<'_, D>,
    ) -> bool {
        let Some(escaper) = &mut self.escaper else { return false };
        let ActState { body, before, propagator, told, .. } = acting;
        let escaped = escaper.escape(
            &mut body.chain,
            setting.obstacles,
            propagator,
            &before.points,
            &mut body.way_out,
        );
        // Out of the range of coordinates nothing escapes.
        let Ok(escaped) = escaped else { return false };
        if let Some(mut arm) = ArmFollower::from_body(setting, before, body) {
            arm.escape();
        }
        body.tally.escapes.add(&escaped);
        told.trace(|notes| notes.escapes = escaped.moves);
        self.escaped.record(body);
        move_leader_robot(setting, body);
        // Only the first of several cycles of escape in a row is an event.
        let first = escaped.first.filter(|_| !body.tally.is_escaping);
        if let Some((connector, obstacle)) = first {
            let (kind, moves) = (EventKind::Escape, escaped.moves as f64);
            let event = told.event(&body.chain, kind, connector, moves);
            told.events.push(Event { obstacle: Some(obstacle), ..event });
        }
        body.tally.is_escaping = escaped.moves > 0;
        escaped.is_pressed
    }

    /// Returns whether a connector got out of the way of something in this cycle.
    pub(super) fn has_escaped(&self, k: usize, before: &PositionBuffer<D>) -> bool {
        self.escaped.points.get(k) != before.points.get(k)
    }

    /// Takes back moves that would leave the claim, because other chains do not expect the chain
    /// there; also moves that, together with escapes, would be faster than escapes may be. Returns the objection to
    /// them.
    pub(super) fn enforce_claim(
        &self,
        setting: ChainContext<'_, D>,
        body: &mut Body<D>,
        before: &PositionBuffer<D>,
    ) -> Option<Veto<D>> {
        let world = setting.world;
        let most_m = match &world.escape {
            Some(escape) => escape.speed_max_m_s * world.dt_s * (1.0 + ROUNDING),
            None if world.chains.len() == 1 => return None,
            None => f64::INFINITY,
        };
        let is_beyond = |(p, was): (&Point<D>, &Point<D>)| {
            distance(*p, *was) > most_m || !self.claim.meets(&Bounds::from_points(&[*p]))
        };
        let mut ways = body.chain.points().iter().zip(&before.points);
        let by = ways.position(is_beyond)?;
        self.escaped.restore(body);
        let from = setting.task(body).map_or(0, |task| task.agent);
        let reached = body.chain.points()[from];
        move_leader_robot(setting, body);
        Some(Veto { by, from, reason: VetoReason::StepLimit, obstacle: None, reached })
    }
}

/// Keeps a leader on wheels at its connector, wherever that was moved to; if it is a robot, it follows
/// on its wheels, from where it is.
fn move_leader_robot<const D: usize>(setting: ChainContext<'_, D>, body: &mut Body<D>) {
    let agent = setting.task(body).map(|task| task.agent);
    let (Some(leader), Some(agent)) = (&mut body.driving.leader, agent) else { return };
    let at = with_dimensions(body.chain.points()[agent]);
    match body.robots.get(agent) {
        None => leader.pose.at = at,
        Some(robot) if leader.pose.at != at => leader.pose = robot.pose,
        Some(_) => {}
    }
}
