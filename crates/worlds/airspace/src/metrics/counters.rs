//! What a run counts beside its state.

use crate::decide::OptimizationStats;
use crate::encounters::Encounters;
use crate::events::{Event, EventKind};
use crate::flight::FlightPhase;
use crate::state::PairRecord;
use crate::surveillance::ObservationCounts;
use serde::{Deserialize, Serialize};
use sidestep_kernel::{Cycle, EntityId};
use std::collections::BTreeMap;

/// Everything that a run counts beside its state, and that a checkpoint keeps.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Counters {
    /// Pairs that came near each other, by ids.
    pub pairs: BTreeMap<(EntityId, EntityId), PairRecord>,
    /// Pairs for which the shield promises nothing, by rising ids, each with the first cycle in which it was
    /// named.
    pub too_close: BTreeMap<(EntityId, EntityId), Cycle>,
    /// Sums over optimizations.
    pub effort: OptimizationStats,
    /// Number of events of each kind.
    pub events: BTreeMap<EventKind, u64>,
    /// Airplanes with errors beyond the shield's bounds, with the first cycle of each.
    pub beyond_bound: BTreeMap<EntityId, Cycle>,
    /// Losses of separation of pairs of recorded flights, by their phase.
    pub losses_by_phase: BTreeMap<FlightPhase, u64>,
    /// Airplanes that were where an area does not permit it, by airplane and number of the area.
    pub areas: BTreeMap<(EntityId, u32), AreaRecord>,
    /// Airplanes that the shield does not keep clear of an area, with the first cycle of each.
    pub exempt_areas: BTreeMap<(EntityId, u32), Cycle>,
    /// Conflicts and other encounters of pairs; none where they are not measured.
    pub encounters: Encounters,
    /// Observations by surveillance; none where all see all.
    pub observed: ObservationCounts,
}

/// The time of an airplane where an area does not permit it to be.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct AreaRecord {
    /// Number of times that it came there.
    pub entries: u32,
    /// Time there, in nanoseconds.
    pub inside_ns: u64,
}

impl AreaRecord {
    /// Adds a later record.
    pub(crate) fn add(&mut self, later: Self) {
        self.entries += later.entries;
        self.inside_ns += later.inside_ns;
    }
}

impl Counters {
    pub(crate) fn add_pair(&mut self, pair: (EntityId, EntityId), record: PairRecord) {
        self.pairs.entry(pair).and_modify(|r| r.add(record)).or_insert(record);
    }

    /// Counts a pair as one for which the shield promises nothing. It stays one pair, from the first cycle on,
    /// when it is named again.
    pub(crate) fn add_too_close_pair(&mut self, now: Cycle, (a, b): (EntityId, EntityId)) {
        let first = self.too_close.entry((a.min(b), a.max(b))).or_insert(now);
        *first = now.min(*first);
    }

    /// Counts pairs of the start that are too close as far as the search of their fallbacks has come.
    pub(crate) fn add_unproved_pairs(&mut self, pairs: u64) {
        if pairs > 0 {
            *self.events.entry(EventKind::SearchLimit).or_default() += pairs;
        }
    }

    pub(crate) fn add_area(&mut self, key: (EntityId, u32), record: AreaRecord) {
        self.areas.entry(key).or_default().add(record);
    }

    /// Records that the shield does not keep an airplane clear of an area.
    pub(crate) fn add_exempt_area(&mut self, now: Cycle, key: (EntityId, u32)) {
        let first = self.exempt_areas.entry(key).or_insert(now);
        *first = now.min(*first);
    }

    pub(crate) fn add_event(&mut self, event: &Event) {
        *self.events.entry(event.kind).or_default() += 1;
        if event.kind == EventKind::BeyondBound {
            self.beyond_bound.entry(event.airplane).or_insert(event.cycle);
        }
    }

    /// Returns whether the shield has reported a pair, because it promises nothing for it.
    pub(crate) fn is_reported(&self, [a, b]: [EntityId; 2]) -> bool {
        let is_beyond_bound = [a, b].iter().any(|id| self.beyond_bound.contains_key(id));
        is_beyond_bound || self.too_close.contains_key(&(a.min(b), a.max(b)))
    }

    pub(super) fn event_count(&self, kind: EventKind) -> u64 {
        self.events.get(&kind).copied().unwrap_or(0)
    }
}
