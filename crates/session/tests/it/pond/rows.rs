//! What is recorded of a pond.

use super::{PondState, PondWorld};
use sidestep_kernel::ports::{ColumnSpec, ColumnType, RecordError, Recorder, TableSchema, Values};
use sidestep_kernel::{Cycle, Slot};

/// Something that a frog did.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Event {
    pub(super) cycle: Cycle,
    pub(super) frog: Slot,
    pub(super) what: What,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum What {
    Hop,
    Bump,
}

/// Rows that wait to be handed over.
#[derive(Debug, Default)]
pub(super) struct Rows {
    is_kept: bool,
    cycles: Vec<u64>,
    frogs: Vec<u32>,
    places_m: [Vec<f64>; 2],
    events: Vec<Event>,
}

impl Rows {
    pub(super) fn begin(&mut self) {
        self.is_kept = true;
    }

    pub(super) fn poses(&mut self, world: &PondWorld, state: &PondState, now: Cycle) {
        for (frog, pad) in (0..).zip(state.pad.iter()).filter(|_| self.is_kept) {
            self.cycles.push(now);
            self.frogs.push(frog);
            let [x_m, y_m] = world.place_m(pad);
            self.places_m[0].push(x_m);
            self.places_m[1].push(y_m);
        }
    }

    pub(super) fn event(&mut self, event: Event) {
        if self.is_kept {
            self.events.push(event);
        }
    }

    pub(super) fn record(&mut self, recorder: &mut dyn Recorder) -> Result<(), RecordError> {
        let Self { cycles, frogs, places_m: [x_m, y_m], events, .. } =
            std::mem::replace(self, Self { is_kept: self.is_kept, ..Self::default() });
        let poses = [Values::U64(cycles), Values::U32(frogs), Values::F64(x_m), Values::F64(y_m)];
        recorder.append(0, &poses)?;
        let events = [
            Values::U64(events.iter().map(|event| event.cycle).collect()),
            Values::U32(events.iter().map(|event| event.frog).collect()),
            Values::Label(events.iter().map(|event| event.what as u32).collect()),
        ];
        recorder.append(1, &events)
    }
}

/// The tables, poses first.
pub(super) fn schemas() -> Vec<TableSchema> {
    let column = |name: &str, ty, labels: &[&str]| ColumnSpec {
        name: name.into(),
        ty,
        meaning: format!("the {name} of a frog"),
        labels: labels.iter().map(ToString::to_string).collect(),
    };
    let head = || [column("cycle", ColumnType::U64, &[]), column("frog", ColumnType::U32, &[])];
    let place = [column("x_m", ColumnType::F64, &[]), column("y_m", ColumnType::F64, &[])];
    let event = [column("event", ColumnType::Label, &["hop", "bump"])];
    vec![
        TableSchema {
            name: "trajectories".into(),
            columns: head().into_iter().chain(place).collect(),
        },
        TableSchema { name: "events".into(), columns: head().into_iter().chain(event).collect() },
    ]
}
