//! The choice of an initiator that decides for itself, while something approaches: to go as it wants, or to rest.

use super::Acting;
use super::drive::Wish;
use crate::driver::Task;
use crate::motion::escape::Lead;
use crate::rods::chain::{Connector, Mobility};
use crate::rods::geometry::{in_dimensions, sub};
use crate::rods::veto::Source;

impl<const D: usize> Acting<'_, D> {
    /// Lets an initiator give way to what approaches, if roll-outs tell that the chain is then inside for less time.
    pub(super) fn look_ahead(&mut self, task: &Task<D>, wish: Wish<D>) {
        let Some(escaper) = &self.scratch.escaper else { return };
        let Some(every) = escaper.chooses_every() else { return };
        match self.lead_by(task, wish) {
            None => self.body.way_out.set_rests(false),
            Some(lead) if (self.now + u64::from(self.slot)).is_multiple_of(every) => {
                let around = (&self.body.chain, &self.scratch.obstacles);
                escaper.choose(around, &self.world.rules, &lead, &mut self.body.way_out);
            }
            Some(_) => {}
        }
        self.gives_way |= self.body.way_out.rests();
    }

    /// Returns an initiator's wish to lead; none if it has none, or no choice: operators are obeyed, and chains that are
    /// held somewhere move by return passes, which cost too much to be rolled out.
    fn lead_by(&self, task: &Task<D>, wish: Wish<D>) -> Option<Lead<D>> {
        let chain = &self.body.chain;
        let is_held = |c: &Connector<D>| c.is_still() || c.mobility != Mobility::Free;
        if task.source() != Source::Autonomous || chain.connectors().iter().any(is_held) {
            return None;
        }
        let to = match wish {
            Wish::Go(to) => to,
            Wish::Steer(pose) => in_dimensions(pose.at),
            _ => return None,
        };
        Some(Lead { k: task.agent, way_m: sub(to, chain.points()[task.agent]) })
    }
}
