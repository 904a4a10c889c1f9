//! The policy `rounds`: bids on boxes instead of an order within a group.
//!
//! A body bids its priority for every box it covers or may come to cover. It acts when its bid is
//! the highest in all of them, because then all bodies that conflict with it and come before it
//! have acted. So the outcome is that of the policy `random`, because the bids are its draws.

use super::cycle_context::{CycleContext, box_index, with_cycle};
use super::world::RobotsWorld;
use sidestep_kernel::space::{GridPosition, OccupantWord};
use sidestep_kernel::world::Auction;
use sidestep_kernel::{EntitySlot, PhaseContext};
use std::sync::atomic::Ordering::Relaxed;

/// A body's bid of one round.
#[derive(Debug, Clone, Copy)]
pub(super) struct Bid {
    pub(super) slot: EntitySlot,
    /// The body's draw of its action's outcome.
    pub(super) word: u32,
    /// Position of the body when it bid: its bids are there, also after it has moved.
    at: GridPosition,
    /// Value of the bid: the higher one acts first. Never 0, and unique per body.
    value: u64,
}

impl<T: OccupantWord> CycleContext<'_, T> {
    /// Bids for all boxes that a body covers or may come to cover.
    fn bid(&self, slot: EntitySlot) -> Bid {
        let body = self.body(slot);
        let [word, draw] = self.act_words(body.id);
        // Inverted, because the smallest (draw, id) acts first.
        let value = !(u64::from(draw) << 32 | u64::from(body.id));
        let bid = Bid { slot, word, at: body.position(), value };
        self.for_each_box_of(bid, |index| {
            self.state.bids[index].fetch_max(value, Relaxed);
        });
        bid
    }

    fn is_highest(&self, bid: Bid) -> bool {
        let mut highest = true;
        self.for_each_box_of(bid, |index| {
            highest &= self.state.bids[index].load(Relaxed) == bid.value;
        });
        highest
    }

    fn retract(&self, bid: Bid) {
        self.for_each_box_of(bid, |index| self.state.bids[index].store(0, Relaxed));
    }

    /// Calls `each` for all boxes that a bidder covers, or may come to cover if it acts; walls
    /// included, for which no body contends.
    fn for_each_box_of(&self, bid: Bid, mut each: impl FnMut(usize)) {
        let body = self.body(bid.slot);
        let ty = self.type_of(body);
        let base = bid.at.row_major_index(self.world.stride);
        for &offset in &ty.own {
            each(box_index(base, offset));
        }
        // A door has no actions, and claims only its own boxes.
        if !body.intent.get().is_idle()
            && let Some(action) = ty.actions.get(usize::from(body.action.get()))
        {
            for &offset in &action.claims {
                each(box_index(base, offset));
            }
        }
    }
}

impl Auction<Self> for RobotsWorld {
    fn bid(&self, phase: &mut PhaseContext<'_, Self>, slot: EntitySlot) {
        let bid = with_cycle!(self, phase.state, phase.now, |cycle| cycle.bid(slot));
        phase.scratch.bids.push(bid);
    }

    fn act_on_bids(&self, phase: &mut PhaseContext<'_, Self>, pending: &mut Vec<EntitySlot>) {
        pending.clear();
        // Taken out, because acting borrows the whole scratch.
        let bids = std::mem::take(&mut phase.scratch.bids);
        with_cycle!(self, phase.state, phase.now, |cycle| {
            for &bid in &bids {
                if cycle.is_highest(bid) {
                    cycle.act(bid.slot, bid.word, phase.scratch);
                } else {
                    pending.push(bid.slot);
                }
            }
        });
        phase.scratch.bids = bids;
    }

    fn retract_bids(&self, phase: &mut PhaseContext<'_, Self>) {
        with_cycle!(self, phase.state, phase.now, |cycle| {
            phase.scratch.bids.drain(..).for_each(|bid| cycle.retract(bid));
        });
    }
}
