//! The tables recorded of a pond.

use super::{PondState, PondWorld};
use sidestep_kernel::ports::{Buffer, Buffers, RowBuffer, Table};
use sidestep_kernel::{Cycle, Slot};

/// An action of a frog.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Event {
    pub(super) cycle: Cycle,
    pub(super) frog: Slot,
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
    frog: Slot,
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
    places: RowBuffer<PadRow>,
    events: RowBuffer<Event>,
}

impl Rows {
    pub(super) fn begin(&mut self) {
        self.places.start(Some(trajectories()));
        self.events.start(Some(events()));
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

impl Buffers for Rows {
    fn buffers(&self) -> Vec<&dyn Buffer> {
        vec![&self.places, &self.events]
    }

    fn buffers_mut(&mut self) -> Vec<&mut dyn Buffer> {
        vec![&mut self.places, &mut self.events]
    }
}
