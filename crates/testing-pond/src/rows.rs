//! The tables recorded of a pond.

use super::{PondState, PondWorld};
use sidestep_kernel::ports::{Table, TableBuffer, TableBuffers, TableRowsBuffer};
use sidestep_kernel::{Cycle, EntitySlot};

/// An action of a frog.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Event {
    pub(super) cycle: Cycle,
    pub(super) frog: EntitySlot,
    pub(super) what: FrogAction,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum FrogAction {
    Hop,
    Bump,
}

/// The pad of a frog at the start of a cycle.
#[derive(Debug)]
struct PadRow {
    cycle: Cycle,
    frog: EntitySlot,
    at_m: [f64; 2],
}

fn trajectories() -> Table<PadRow> {
    Table::new("trajectories")
        .u64("cycle", "cycle at whose start this holds", |p: &PadRow| p.cycle)
        .u32("frog", "number of the frog", |p| p.frog)
        .f64("x_m", "position east", |p| p.at_m[0])
        .f64("y_m", "position north", |p| p.at_m[1])
}

fn events() -> Table<Event> {
    Table::new("events")
        .u64("cycle", "cycle in which it happened", |e: &Event| e.cycle)
        .u32("frog", "number of the frog", |e| e.frog)
        .label("event", "what happened", ["hop", "bump"], |e| e.what as u32)
}

/// Rows that wait to be passed on.
#[derive(Debug, Default)]
pub(super) struct Rows {
    places: TableRowsBuffer<PadRow>,
    events: TableRowsBuffer<Event>,
}

impl Rows {
    pub(super) fn begin(&mut self) {
        self.places.set_table(Some(trajectories()));
        self.events.set_table(Some(events()));
    }

    pub(super) fn poses(&mut self, world: &PondWorld, state: &PondState, now: Cycle) {
        for (frog, pad) in (0..).zip(state.pad.iter()) {
            self.places.push(PadRow { cycle: now, frog, at_m: world.place_m(pad) });
        }
    }

    pub(super) fn event(&mut self, event: Event) {
        self.events.push(event);
    }
}

impl TableBuffers for Rows {
    fn table_buffers(&self) -> Vec<&dyn TableBuffer> {
        vec![&self.places, &self.events]
    }

    fn table_buffers_mut(&mut self) -> Vec<&mut dyn TableBuffer> {
        vec![&mut self.places, &mut self.events]
    }
}
