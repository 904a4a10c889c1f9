//! The sink of a cycle's events.

use crate::events::{Event, EventKind};
use crate::trace::InspectionTrace;
use sidestep_kernel::{Cycle, EntitySlot};
use sidestep_rods::Chain;
use sidestep_rods::geometry::convert_dimensions;

/// The sink of what happens to a chain in a cycle.
pub(super) struct EventSink<'a, const D: usize> {
    pub(super) slot: EntitySlot,
    pub(super) now: Cycle,
    pub(super) events: &'a mut Vec<Event>,
    /// The record of an inspection, if one of this chain is under way.
    pub(super) trace: Option<&'a mut InspectionTrace<D>>,
}

impl<const D: usize> EventSink<'_, D> {
    /// Records something if this chain is inspected.
    pub(super) fn record_in_trace(&mut self, record: impl FnOnce(&mut InspectionTrace<D>)) {
        if let Some(trace) = self.trace.as_deref_mut() {
            record(trace);
        }
    }

    /// Returns an event where a connector is, for callers that add a reason or an obstacle to it.
    pub(super) fn new_event(
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
            at_m: convert_dimensions(chain.points()[connector]),
            reason: None,
            obstacle: None,
            missing: 0,
            value,
        }
    }

    pub(super) fn record(
        &mut self,
        chain: &Chain<D>,
        kind: EventKind,
        connector: usize,
        value: f64,
    ) {
        self.events.push(self.new_event(chain, kind, connector, value));
    }
}
