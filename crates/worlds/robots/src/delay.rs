//! Delays of robots: cycles in which one does nothing although its turn has come.

use sidestep_error_models::delay::{DelayEvent, DelayModel};
use sidestep_kernel::distr::{Bernoulli, Categorical};
use sidestep_kernel::{AtomicColumn, EntityId};

/// The delays of a robot type, prepared for drawing.
#[derive(Debug)]
pub(crate) struct Delays {
    start: Bernoulli,
    /// The chance of `start`.
    p: f64,
    per: DelayEvent,
    /// The lengths by the number that `duration` draws.
    cycles: Vec<u32>,
    duration: Categorical,
}

impl Delays {
    /// Returns `None` for a model in which no delay ever starts. Its durations must be a distribution.
    pub(crate) fn new(model: &DelayModel) -> Option<Self> {
        let row: Vec<f64> = model.durations.iter().map(|duration| duration.p).collect();
        let duration = Categorical::new(&row).ok()?;
        (model.p > 0.0).then(|| Self {
            start: Bernoulli::new(model.p),
            p: model.p,
            per: model.per,
            cycles: model.durations.iter().map(|duration| duration.cycles).collect(),
            duration,
        })
    }

    /// Returns whether a delay may start in a cycle; `pause` are the cycles of delay since the last action.
    pub(crate) fn may_start(&self, is_due: bool, pause: u32) -> bool {
        match self.per {
            DelayEvent::Cycle => true,
            // The action that comes after a delay has had its draw.
            DelayEvent::Action => is_due && pause == 0,
            // Drawn before the cycle, see `team_delays.rs`.
            DelayEvent::Team => false,
        }
    }

    /// Returns the chance that a robot of a section has for each delay of a cycle, where those are drawn together.
    pub(crate) fn team_chance(&self) -> Option<f64> {
        (self.per == DelayEvent::Team).then_some(self.p)
    }

    /// Returns the length of a delay by this draw.
    pub(crate) fn sample_length(&self, duration: u32) -> u32 {
        self.cycles[self.duration.sample(duration)]
    }

    /// Returns the length of the delay that starts by these draws, 0 for none.
    pub(crate) fn sample(&self, [start, duration, ..]: [u32; 4]) -> u32 {
        if self.start.sample(start) { self.sample_length(duration) } else { 0 }
    }
}

/// The delays of all bodies, by id; empty where no robot has any.
#[derive(Debug, Clone)]
pub(crate) struct DelayColumns {
    /// Cycles for which the present delay goes on.
    remaining: AtomicColumn<u32>,
    /// Cycles of delay since the last action.
    pause: AtomicColumn<u32>,
    /// Cycles of delay in all.
    total: AtomicColumn<u32>,
    /// Turns that passed without an action because of a delay.
    missed: AtomicColumn<u32>,
    /// Cycles of delay before the action of this cycle; only within a cycle.
    before_action: AtomicColumn<u32>,
}

impl DelayColumns {
    /// Counts a cycle of a delay that goes on for `cycles`, this one included.
    pub(crate) fn spend(&self, id: EntityId, cycles: u32, is_due: bool) {
        let id = id as usize;
        self.remaining.set(id, cycles - 1);
        self.pause.add(id, 1);
        self.total.add(id, 1);
        self.missed.add(id, u32::from(is_due));
    }

    /// Starts a delay before a cycle.
    pub(crate) fn start(&self, id: EntityId, cycles: u32) {
        self.remaining.set(id as usize, cycles);
    }

    /// Ends the pause before an action.
    pub(crate) fn begin_action(&self, id: EntityId) {
        let id = id as usize;
        self.before_action.set(id, self.pause.get(id));
        self.pause.set(id, 0);
    }

    /// Returns the cycles of delay since a body's last action.
    pub(crate) fn pause(&self, id: EntityId) -> u32 {
        Self::word_of(&self.pause, id)
    }

    /// Returns columns for this number of bodies; 0 where no robot has delays.
    pub(crate) fn new(bodies: usize) -> Self {
        let column = || AtomicColumn::filled(bodies, 0);
        Self {
            remaining: column(),
            pause: column(),
            total: column(),
            missed: column(),
            before_action: column(),
        }
    }

    fn saved_columns(&self) -> [&AtomicColumn<u32>; 4] {
        [&self.remaining, &self.pause, &self.total, &self.missed]
    }

    /// Returns the state of a body's delays in words; none where no robot has delays.
    pub(crate) fn words(&self, id: EntityId) -> impl Iterator<Item = u32> {
        let columns = self.saved_columns().into_iter().filter(|column| !column.is_empty());
        columns.map(move |column| column.get(id as usize))
    }

    /// Takes over what [`Self::words`] returned.
    pub(crate) fn restore(&self, id: EntityId, words: &[u32]) {
        let columns = self.saved_columns().into_iter().filter(|column| !column.is_empty());
        columns.zip(words).for_each(|(column, &word)| column.set(id as usize, word));
    }

    fn word_of(column: &AtomicColumn<u32>, id: EntityId) -> u32 {
        if column.is_empty() { 0 } else { column.get(id as usize) }
    }

    /// Returns the cycles for which a body's delay goes on; 0 for one that is not delayed.
    pub(crate) fn remaining(&self, id: EntityId) -> u32 {
        Self::word_of(&self.remaining, id)
    }

    /// Returns the cycles in which a body was delayed so far.
    pub(crate) fn total(&self, id: EntityId) -> u32 {
        Self::word_of(&self.total, id)
    }

    /// Returns the number of turns that passed without an action because of a delay.
    pub(crate) fn missed(&self, id: EntityId) -> u32 {
        Self::word_of(&self.missed, id)
    }

    /// Returns the cycles for which the action that a body does in this cycle was delayed.
    pub(crate) fn before_action(&self, id: EntityId) -> u32 {
        Self::word_of(&self.before_action, id)
    }

    pub(crate) fn heap_bytes(&self) -> usize {
        let saved: usize = self.saved_columns().iter().map(|column| column.heap_bytes()).sum();
        saved + self.before_action.heap_bytes()
    }
}
