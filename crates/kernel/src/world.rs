//! What a world supplies to the kernel: the phases of a cycle, and what a run of it needs.
//!
//! ```text
//! Phases   claim, join, act: called by the cycle, on any number of workers
//! Auction  bids for what is claimed, an extension of some worlds
//! World    all that a run asks besides: rows, frames, metrics, what to save, what to say
//! ```

use crate::checkpoint::CheckpointError;
use crate::conflict::Groups;
use crate::digest::Digest;
use crate::plan::Effort;
use crate::ports::{Clock, RecordError, Recorder, TableSchema};
use crate::units::{Cycle, Slot};
use crate::view::{Frame, Look, PlaceRows, Scenery};
use crate::words::{Lines, Said};
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::Value;
use std::ops::Range;

/// A worker's turn in one phase of one cycle: what it reads, and what it keeps for itself.
pub struct Turn<'a, W: Phases> {
    /// The immutable world.
    pub world: &'a W,
    /// The state; every slot of a column has one writer in each phase.
    pub state: &'a W::State,
    /// The cycle.
    pub now: Cycle,
    /// For measuring what something takes; nothing that it says may reach the state.
    pub clock: &'a dyn Clock,
    /// The worker's own buffers, events and sums.
    pub scratch: &'a mut W::Scratch,
}

/// Where agents decide what to do.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Decides {
    /// Each by itself in the phase *claim*, before anybody knows of conflicts.
    Alone,
    /// Together with their conflict group in the phase *act*.
    Together,
}

/// The phases of one cycle of a compiled, immutable world, in their order.
///
/// Each is called by several workers at once on disjoint parts, and everything a worker writes in
/// one phase is seen by all in the next. The state is shared, so its fields are
/// [`crate::column::Column`]s (or other cells) with one writer per slot and phase. No result may
/// depend on a clock, a shared generator, or anything else that is not in the state.
pub trait Phases: Sync + Sized {
    /// All that changes.
    type State: Sync;
    /// What one worker keeps for itself between tasks: buffers, events, sums.
    type Scratch: Send;

    /// Where agents decide: it names the phases in reports.
    const DECIDES: Decides = Decides::Alone;

    /// A fresh scratch.
    fn scratch(&self) -> Self::Scratch;

    /// Number of bodies: tasks that the pools hold.
    fn bodies(&self, state: &Self::State) -> usize;

    /// Moves bodies to other slots now and then between cycles, so that what is near in the world
    /// is near in memory and each worker keeps to a part of both. No result may depend on it.
    fn arrange(&self, _: &mut Self::State) {}

    /// *Claim*: each body of `bodies` that is due perceives the frozen state, decides (where
    /// agents decide alone), and publishes what it may come to need. Writes only the intents and
    /// claims of these bodies.
    fn claim(turn: &mut Turn<'_, Self>, bodies: Range<usize>);

    /// *Join*: joins each body of `bodies` with every other whose claims meet its own. Writes
    /// only `groups`.
    fn join(turn: &mut Turn<'_, Self>, bodies: Range<usize>, groups: &Groups);

    /// *Act*: the bodies of one conflict group decide (where agents decide together) and act, in
    /// an order that depends on state and seed alone. Writes only what the group has claimed.
    /// `group` comes in no particular order.
    fn act(turn: &mut Turn<'_, Self>, group: &mut [Slot]);

    /// The auction by which bodies in conflict act, in worlds that hold one.
    fn auction(&self) -> Option<&dyn Auction<Self>> {
        None
    }
}

/// Bodies in conflict that act in rounds instead of group by group: in each round those act that
/// hold the highest bid on all they claim, until all have. Inside a large group this is parallel,
/// and the outcome is the same as in the order of the bids.
pub trait Auction<W: Phases> {
    /// Bids for all that a body claims, and notes it in the scratch.
    fn bid(&self, turn: &mut Turn<'_, W>, body: Slot);

    /// Lets those of `pending` act whose bids are the highest, and takes them from the list.
    fn act_on_bids(&self, turn: &mut Turn<'_, W>, pending: &mut Vec<Slot>);

    /// Takes back all bids noted in the scratch.
    fn retract_bids(&self, turn: &mut Turn<'_, W>);
}

/// A world that [`crate::Run`] runs: its phases, and all that a run asks besides.
///
/// `state` is all that changes and that results depend on; `books` are what a run keeps beside
/// it: sums that metrics are made of, rows and events that wait to be handed over.
pub trait World: Phases<State: Send> + Send + 'static {
    /// Name of the world, as scenarios give it.
    const NAME: &'static str;
    /// Noun for one of its agents, e.g. `robot`.
    const AGENT: &'static str;
    /// Whether [`World::before_cycle`] and [`World::is_over`] are asked before every cycle; a
    /// world whose cycles take microseconds leaves it at `false`.
    const LOOKS_EACH_CYCLE: bool = false;

    /// What a run keeps beside the state.
    type Books: Send;
    /// The state, and what of the books results depend on, by entity id: a checkpoint's content.
    type Saved: Serialize + DeserializeOwned;
    /// What a run measures.
    type Metrics: Serialize;

    /// Number of agents.
    fn agents(&self) -> usize;

    /// Cycles that may run before rows must be handed over.
    fn room(&self, _: &Self::State, _: &Self::Books, _: Cycle) -> u64 {
        u64::MAX
    }

    /// Keeps rows of the state at the start of a cycle, if somebody records them.
    fn before_cycle(&self, _: &Self::State, _: &mut Self::Books, _: Cycle) {}

    /// Whether nothing can happen any more, e.g. when everybody has arrived: then a run is
    /// complete before its planned number of cycles.
    fn is_over(&self, _: &Self::State) -> bool {
        false
    }

    /// Takes over what one worker has gathered in one or more cycles. Which worker has gathered
    /// what differs from run to run.
    fn gather(&self, books: &mut Self::Books, scratch: &mut Self::Scratch);

    /// Books what was gathered of all workers, in an order that does not depend on who has
    /// gathered what.
    fn book(&self, books: &mut Self::Books);

    /// Begins to keep what [`World::record`] hands over.
    fn begin_recording(&self, state: &mut Self::State, books: &mut Self::Books, now: Cycle);

    /// Begins to keep events for frames.
    fn watch(&self, books: &mut Self::Books);

    /// Tells a worker's scratch what to gather, after [`World::begin_recording`] and
    /// [`World::watch`].
    fn prepare(&self, _: &Self::Books, _: &mut Self::Scratch) {}

    /// The tables that are recorded.
    fn schemas(&self, books: &Self::Books) -> Vec<TableSchema>;

    /// Hands over the rows of all cycles before `now` that were not handed over yet.
    ///
    /// # Errors
    /// When the recorder cannot store them.
    fn record(
        &self,
        state: &mut Self::State,
        books: &mut Self::Books,
        now: Cycle,
        recorder: &mut dyn Recorder,
    ) -> Result<(), RecordError>;

    /// The digest of a state.
    fn digest(&self, state: &Self::State, now: Cycle) -> Digest;

    /// What a checkpoint keeps.
    fn save(&self, state: &Self::State, books: &Self::Books, now: Cycle) -> Self::Saved;

    /// The state that was saved; the books take over what belongs to them.
    ///
    /// # Errors
    /// When it does not fit this world.
    fn restore(
        &self,
        saved: Self::Saved,
        books: &mut Self::Books,
    ) -> Result<Self::State, CheckpointError>;

    /// What stays as it is during the run.
    fn scenery(&self, name: &str) -> Scenery;

    /// How things are now, and what happened since the last frame.
    fn frame(&self, state: &Self::State, books: &mut Self::Books, now: Cycle, look: Look) -> Frame;

    /// Which recorded rows say where bodies were.
    fn place_rows(&self, _: &Self::Books) -> Vec<PlaceRows> {
        Vec::new()
    }

    /// What the run measured so far.
    fn metrics(
        &self,
        state: &Self::State,
        books: &Self::Books,
        now: Cycle,
        effort: &Effort,
    ) -> Self::Metrics;

    /// Metrics of every agent by itself, as a JSON array.
    fn agent_metrics(&self, state: &Self::State, books: &Self::Books, now: Cycle) -> Value;

    /// Metrics of pairs of agents, in worlds that have any.
    fn pair_metrics(&self, _: &Self::Books) -> Value {
        Value::Null
    }

    /// What came of a run, in lines for people.
    fn outcome(&self, metrics: &Self::Metrics) -> Lines;

    /// Where every body is.
    fn poses(&self, state: &Self::State, now: Cycle) -> Said;
}
