//! Phase *act*: the actions of one chain in a cycle.
//!
//! ```text
//! broken.rs, gather.rs -> bounds.rs (out of the way) -> drive.rs -> foresee.rs -> go.rs, wheels.rs, obey.rs
//!           -> bounds.rs (back into the claim) -> follow.rs -> measure.rs
//! broken.rs -> drive.rs -> go.rs, later.rs         where nothing can object
//!              drive.rs -> plan.rs                 where local rules come no nearer
//!              go.rs -> talk.rs                    where each connector has an agent
//!              joints.rs                           after every motion of an arm
//! ```

mod bounds;
mod broken;
mod drive;
mod follow;
mod foresee;
mod gather;
mod go;
mod joints;
mod later;
mod measure;
mod obey;
mod plan;
mod talk;
#[cfg(test)]
mod tests;
mod wheels;

use super::driver::Task;
use super::driver::errand::Errand;
use super::driver::external::Orders;
use super::events::{Event, EventKind};
use super::notes::Notes;
use super::rods::geometry::{Bounds, in_dimensions};
use super::scratch::Scratch;
use super::state::Body;
use super::swarm::leader::Decision;
use super::world::{ChainSpec, ChainWorld};
use sidestep_kernel::{Cycle, Slot, Turn};

/// One chain that acts.
pub(crate) struct Acting<'a, const D: usize> {
    world: &'a ChainWorld<D>,
    spec: &'a ChainSpec<D>,
    slot: Slot,
    now: Cycle,
    /// Decision of its navigator.
    decision: Option<Decision>,
    /// Orders from outside,
    orders: Orders,
    /// and the errand on which they send it.
    errand: Option<Errand<D>>,
    /// The box that it stays in.
    claim: Bounds<D>,
    /// Whether its initiator gives way to parts that get out of something's way.
    gives_way: bool,
    body: &'a mut Body<D>,
    scratch: &'a mut Scratch<D>,
    /// Whether only the initiator moves for now.
    puts_off: bool,
    /// Whether its agents have talked in this cycle.
    has_talked: bool,
}

/// Lets the chains of one conflict group act, one after the other.
pub(crate) fn act<const D: usize>(turn: &mut Turn<'_, ChainWorld<D>>, group: &mut [Slot]) {
    group.sort_unstable();
    for &slot in &*group {
        act_one(turn, group, slot);
    }
}

/// Lets one chain of a conflict group act.
pub(crate) fn act_one<const D: usize>(
    turn: &mut Turn<'_, ChainWorld<D>>,
    group: &[Slot],
    slot: Slot,
) {
    let &mut Turn { world, state, now, .. } = turn;
    let claim = state.claim(slot as usize);
    let meets = |s: &Slot| *s != slot && state.claim(*s as usize).meets(&claim);
    turn.scratch.gather(world, state, now + 1, group.iter().copied().filter(meets));
    let mut body = state.body_mut(slot as usize);
    let mut acting = Acting {
        world,
        spec: &world.chains[slot as usize],
        slot,
        now,
        decision: state.decision(slot as usize),
        orders: Orders::default(),
        errand: None,
        claim,
        gives_way: false,
        body: &mut body,
        scratch: turn.scratch,
        puts_off: false,
        has_talked: false,
    };
    acting.act();
}

impl<'a, const D: usize> Acting<'a, D> {
    /// Makes one cycle of the chain, which stays in its claim.
    fn act(&mut self) {
        self.change();
        self.take_orders();
        self.puts_off = self.may_put_off();
        if self.puts_off {
            self.drive();
            self.body.tally.steps += 1;
            return;
        }
        self.body.catch_up();
        self.scratch.before.clear();
        self.scratch.before.extend_from_slice(self.body.chain.points());
        self.scratch.escaped.clone_from(&self.scratch.before);
        self.note_joints();
        if self.body.scattered.is_some() {
            self.come_together();
        } else {
            self.get_out_of_the_way();
            self.drive();
            self.rest_as_team();
            self.keep_to_bounds();
            self.answer();
        }
        self.scratch.robots_gap_m = f64::INFINITY;
        self.follow();
        self.measure();
    }

    /// Returns the present task; none after the last.
    fn task(&self) -> Option<&'a Task<D>> {
        self.spec.tasks.get(self.body.driving.task as usize)
    }

    /// Returns an event of this chain.
    fn event(&self, kind: EventKind, connector: usize, value: f64) -> Event {
        let (cycle, chain) = (self.now, self.slot);
        let at_m = in_dimensions(self.body.chain.points()[connector]);
        let (connector, reason, obstacle, missing) = (connector as u32, None, None, 0);
        Event { cycle, chain, kind, connector, at_m, reason, obstacle, missing, value }
    }

    /// Notes something for somebody who asks about this chain.
    fn note(&mut self, note: impl FnOnce(&mut Notes<D>)) {
        let slot = self.slot;
        if let Some(notes) = self.scratch.notes.as_deref_mut().filter(|notes| notes.slot == slot) {
            note(notes);
        }
    }

    /// Records an event.
    fn tell(&mut self, kind: EventKind, connector: usize, value: f64) {
        self.scratch.events.push(self.event(kind, connector, value));
    }
}
