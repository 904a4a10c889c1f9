//! The books of a cycle.

use crate::events::{Event, EventKind};
use crate::trace::InspectionTrace;
use sidestep_kernel::{Cycle, Slot};
use sidestep_rods::Chain;
use sidestep_rods::geometry::with_dimensions;

/// The books of a chain's cycle: its events, and notes.
pub(super) struct EventSink<'a, const D: usize> {
    pub(super) slot: Slot,
    pub(super) now: Cycle,
    pub(super) events: &'a mut Vec<Event>,
    /// Notes for somebody who asks about this chain.
    pub(super) notes: Option<&'a mut InspectionTrace<D>>,
}

impl<const D: usize> EventSink<'_, D> {
    /// Notes something for somebody who asks about this chain.
    pub(super) fn trace(&mut self, note: impl FnOnce(&mut InspectionTrace<D>)) {
        if let Some(notes) = self.notes.as_deref_mut() {
            note(notes);
        }
    }

    /// Returns an event of this chain.
    pub(super) fn event(
        &self,
        chain: &Chain<D>,
        kind: EventKind,
        connector: usize,
        value: f64,
    ) -> Event {
        Event {
            cycle: self.now,
            chain: self.slot,
            kind,
            connector: connector as u32,
            at_m: with_dimensions(chain.points()[connector]),
            reason: None,
            obstacle: None,
            missing: 0,
            value,
        }
    }

    /// Records an event.
    pub(super) fn record(
        &mut self,
        chain: &Chain<D>,
        kind: EventKind,
        connector: usize,
        value: f64,
    ) {
        self.events.push(self.event(chain, kind, connector, value));
    }
}
