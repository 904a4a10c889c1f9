//! Moves out of the way of approaching obstacles, and back from places where a chain must not be.

use super::Acting;
use crate::events::{Event, EventKind};
use crate::rods::geometry::{Bounds, Point, distance, in_dimensions};
use crate::rods::veto::{Reason, Veto};

/// Relative tolerance for ways at exactly the greatest speed.
const ROUNDING: f64 = 1e-9;

impl<const D: usize> Acting<'_, D> {
    /// Moves parts that an obstacle comes too near to, whichever connector leads.
    pub(super) fn get_out_of_the_way(&mut self) {
        let Some(escaper) = &mut self.scratch.escaper else { return };
        let escaped = escaper.escape(
            &mut self.body.chain,
            &self.scratch.obstacles,
            &mut self.scratch.propagator,
            &self.scratch.before,
            &mut self.body.way_out,
        );
        // Out of the range of coordinates nothing escapes.
        let Ok(escaped) = escaped else { return };
        self.joints_escape();
        self.body.tally.escapes.add(&escaped);
        self.note(|notes| notes.escapes = escaped.moves);
        self.scratch.escaped.copy_from_slice(self.body.chain.points());
        if let Some(joints) = &self.body.joints {
            self.scratch.joints_escaped.clone_from(joints);
        }
        self.take_leader_along();
        // Only the first of several cycles of escape in a row is an event.
        let first = escaped.first.filter(|_| !self.body.tally.is_escaping);
        if let Some((connector, obstacle)) = first {
            let event = self.event(EventKind::Escape, connector, escaped.moves as f64);
            self.scratch.events.push(Event { obstacle: Some(obstacle), ..event });
        }
        self.body.tally.is_escaping = escaped.moves > 0;
        self.gives_way = escaped.is_pressed;
    }

    /// Takes back moves that would leave the claim, because other chains do not expect the chain
    /// there; also moves that, together with escapes, would be faster than escapes may be.
    pub(super) fn keep_to_bounds(&mut self) {
        let most_m = match &self.world.escape {
            Some(escape) => escape.speed_max_m_s * self.world.dt_s * (1.0 + ROUNDING),
            None if self.world.chains.len() == 1 => return,
            None => f64::INFINITY,
        };
        let is_beyond = |(p, was): (&Point<D>, &Point<D>)| {
            distance(*p, *was) > most_m || !self.claim.meets(&Bounds::of(&[*p]))
        };
        let mut ways = self.body.chain.points().iter().zip(&self.scratch.before);
        let Some(by) = ways.position(is_beyond) else { return };
        self.body.chain.points_mut().copy_from_slice(&self.scratch.escaped);
        if let Some(joints) = &mut self.body.joints {
            joints.clone_from(&self.scratch.joints_escaped);
        }
        let from = self.task().map_or(0, |task| task.agent);
        let reached = self.body.chain.points()[from];
        self.take_leader_along();
        self.vetoed(&Veto { by, from, reason: Reason::StepLimit, obstacle: None, reached });
    }

    /// Keeps a leader on wheels at its connector, wherever that was moved to; if it is a robot, it follows
    /// on its wheels, from where it is.
    fn take_leader_along(&mut self) {
        let agent = self.task().map(|task| task.agent);
        let (Some(leader), Some(agent)) = (&mut self.body.driving.leader, agent) else { return };
        let at = in_dimensions(self.body.chain.points()[agent]);
        match self.body.robots.get(agent) {
            None => leader.pose.at = at,
            Some(robot) if leader.pose.at != at => leader.pose = robot.pose,
            Some(_) => {}
        }
    }
}
