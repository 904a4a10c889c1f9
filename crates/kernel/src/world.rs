//! What a world supplies to the kernel's cycle.

use crate::conflict::Groups;
use crate::units::{Cycle, Slot};
use std::ops::Range;

/// A compiled, immutable world; all that changes lives in its `State`.
///
/// The methods are the phases of one cycle, in order. Each is called by several workers at
/// once on disjoint parts, and everything a worker writes in one phase is seen by all in the
/// next. The state is shared, so its fields are [`crate::column::Column`]s (or other
/// cells) with one writer per slot and phase. Nothing here may read a clock, a shared
/// generator, or anything else that is not in the state.
pub trait World: Sync {
    /// All that changes.
    type State: Sync;
    /// What one worker keeps for itself between tasks: buffers, events, sums.
    type Scratch: Send;

    /// A fresh scratch.
    fn scratch(&self) -> Self::Scratch;

    /// How many tasks the pools hold.
    fn bodies(&self, state: &Self::State) -> usize;

    /// Called between cycles now and then: may move bodies to other slots, so that what is
    /// near in the world is near in memory and each worker keeps to a part of both. No result
    /// may depend on it.
    fn arrange(&self, _: &mut Self::State) {}

    /// *Pool one*: each body of `bodies` that is due perceives the frozen state, decides,
    /// and publishes what it claims. Writes only the intents and claims of these bodies.
    fn perceive_and_decide(
        &self,
        state: &Self::State,
        now: Cycle,
        bodies: Range<usize>,
        scratch: &mut Self::Scratch,
    );

    /// Joins each body of `bodies` with every other whose claims meet its own. Writes only
    /// `groups`.
    fn find_conflicts(
        &self,
        state: &Self::State,
        now: Cycle,
        bodies: Range<usize>,
        groups: &Groups,
        scratch: &mut Self::Scratch,
    );

    /// *Pool two*: the bodies of one conflict group act one after the other, in an order
    /// that depends on state and seed alone. Writes only what the group has claimed.
    /// `group` comes in no particular order.
    fn react(
        &self,
        state: &Self::State,
        now: Cycle,
        group: &mut [Slot],
        scratch: &mut Self::Scratch,
    );

    /// Whether bodies in conflict react in rounds instead of group by group: in each round
    /// those act that hold the highest bid on all they claim, until all have. Inside a large
    /// group this is parallel, and the outcome is the same as in the order of the bids.
    fn reacts_in_rounds(&self) -> bool {
        false
    }

    /// Bids for all that a body claims, and notes it in the scratch.
    fn bid(&self, _: &Self::State, _: Cycle, _: Slot, _: &mut Self::Scratch) {}

    /// Lets those of `pending` act whose bids are the highest, and takes them from the list.
    fn act_on_bids(
        &self,
        _: &Self::State,
        _: Cycle,
        pending: &mut Vec<Slot>,
        _: &mut Self::Scratch,
    ) {
        pending.clear();
    }

    /// Takes back all bids noted in the scratch.
    fn retract_bids(&self, _: &Self::State, _: &mut Self::Scratch) {}
}
