//! The policy `rounds`: bids on boxes instead of an order within a group.
//!
//! A body bids its priority for every box it covers or may come to cover. It acts when its
//! bid is the highest in all of them: then all that conflict with it and come before it have
//! acted. So the outcome is that of the policy `random`, whose draws the bids are.

use super::Scratch;
use super::state::RobotsState;
use super::world::RobotsWorld;
use sidestep_kernel::space::Position;
use sidestep_kernel::{Cycle, Slot};
use std::sync::atomic::Ordering::Relaxed;

/// A body's bid of one round.
#[derive(Debug, Clone, Copy)]
pub(super) struct Bid {
    pub(super) slot: Slot,
    /// The body's draw of what its action comes to.
    pub(super) word: u32,
    /// Where it stood when it bid.
    at: Position,
    /// Higher acts first; never 0, unique per body.
    value: u64,
}

impl RobotsWorld {
    pub(super) fn bid_one(
        &self,
        state: &RobotsState,
        now: Cycle,
        slot: Slot,
        scratch: &mut Scratch,
    ) {
        let id = state.bodies[slot as usize].id;
        let [word, draw] = self.act_words(id, now);
        // The smallest (draw, id) acts first.
        let value = !(u64::from(draw) << 32 | u64::from(id));
        let bid = Bid { slot, word, at: state.at(slot), value };
        self.for_each_box_of(state, bid, |index| {
            state.bids[index].fetch_max(value, Relaxed);
        });
        scratch.bids.push(bid);
    }

    pub(super) fn is_highest(&self, state: &RobotsState, bid: Bid) -> bool {
        let mut highest = true;
        self.for_each_box_of(state, bid, |index| {
            highest &= state.bids[index].load(Relaxed) == bid.value;
        });
        highest
    }

    pub(super) fn retract(&self, state: &RobotsState, bid: Bid) {
        self.for_each_box_of(state, bid, |index| state.bids[index].store(0, Relaxed));
    }

    /// All boxes that a bidder covers, or may come to cover if it acts; walls included, which
    /// nobody contends for.
    fn for_each_box_of(&self, state: &RobotsState, bid: Bid, mut each: impl FnMut(usize)) {
        let cell = &state.bodies[bid.slot as usize];
        let body = &self.types[usize::from(cell.ty)];
        let base = bid.at.index(self.stride);
        let mut all = |boxes: &[i32]| {
            boxes.iter().for_each(|&o| each(base.wrapping_add_signed(o) as usize));
        };
        all(&body.own);
        if cell.intent.get() != super::state::IDLE
            && let Some(action) = body.actions.get(usize::from(cell.action.get()))
        {
            all(&action.claims);
        }
    }
}
