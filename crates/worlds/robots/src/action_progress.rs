//! Actions that take several cycles: how long each goes on, and where its body was before it. What follows from that on the
//! floor is in `long_action.rs`.

use sidestep_kernel::space::GridPosition;
use sidestep_kernel::{AtomicColumn, EntityId};

/// The actions in progress of all bodies, by id; empty where every action takes one cycle.
#[derive(Debug, Clone)]
pub(crate) struct ProgressColumns {
    /// Cycles until the present action ends.
    pub(super) left: AtomicColumn<u32>,
    /// The anchor before its steps, as a word of a grid position.
    pub(super) from: AtomicColumn<u32>,
    /// Which walk it is: the index of the action in the upper half, that of the transition in the lower one.
    pub(super) walk: AtomicColumn<u32>,
    /// The number of its steps that were made; 0 for a body that holds no boxes but its own.
    pub(super) steps: AtomicColumn<u32>,
    /// Cycles in all in which an action that had begun before went on.
    busy: AtomicColumn<u32>,
}

impl ProgressColumns {
    /// Returns columns for this number of bodies; 0 where every action takes one cycle.
    pub(crate) fn new(bodies: usize) -> Self {
        let column = || AtomicColumn::filled(bodies, 0);
        Self { left: column(), from: column(), walk: column(), steps: column(), busy: column() }
    }

    fn columns(&self) -> [&AtomicColumn<u32>; 5] {
        [&self.left, &self.from, &self.walk, &self.steps, &self.busy]
    }

    pub(super) fn word_of(column: &AtomicColumn<u32>, id: EntityId) -> u32 {
        if column.is_empty() { 0 } else { column.get(id as usize) }
    }

    /// Returns the cycles until a body's action ends; 0 for one that may begin another.
    pub(crate) fn left(&self, id: EntityId) -> u32 {
        Self::word_of(&self.left, id)
    }

    /// Returns the anchor that a body leaves; none for one that holds no boxes but its own.
    pub(crate) fn place_left(&self, id: EntityId) -> Option<GridPosition> {
        let is_holding = Self::word_of(&self.steps, id) > 0;
        is_holding.then(|| GridPosition::from_word(self.from.get(id as usize)))
    }

    /// Returns the cycles in which an action of a body went on that had begun before.
    pub(crate) fn busy(&self, id: EntityId) -> u32 {
        Self::word_of(&self.busy, id)
    }

    /// Begins an action that goes on for this number of cycles after the present one.
    pub(crate) fn begin(&self, id: EntityId, cycles: u32) {
        self.left.set(id as usize, cycles);
    }

    /// Counts a cycle of an action that began before; a delay makes it no shorter.
    pub(crate) fn spend(&self, id: EntityId, is_delayed: bool) {
        let id = id as usize;
        self.busy.add(id, 1);
        if !is_delayed {
            self.left.set(id, self.left.get(id) - 1);
        }
    }

    /// Returns the state of a body's action in words; none where every action takes one cycle. The boxes that are
    /// left are no part of it once the action has ended, whether or not the floor shows them still.
    pub(crate) fn words(&self, id: EntityId) -> impl Iterator<Item = u32> {
        let [left, from, walk, steps, busy] =
            self.columns().map(|column| Self::word_of(column, id));
        let is_holding = left > 0 && steps > 0;
        let held = [from, walk, steps].map(|word| if is_holding { word } else { 0 });
        let words = [left, held[0], held[1], held[2], busy];
        words.into_iter().take(if self.left.is_empty() { 0 } else { words.len() })
    }

    /// Takes over what [`Self::words`] returned.
    pub(crate) fn restore(&self, id: EntityId, words: &[u32]) {
        let columns = self.columns().into_iter().filter(|column| !column.is_empty());
        columns.zip(words).for_each(|(column, &word)| column.set(id as usize, word));
    }

    pub(crate) fn heap_bytes(&self) -> usize {
        self.columns().iter().map(|column| column.heap_bytes()).sum()
    }
}
