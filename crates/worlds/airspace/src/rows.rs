//! What a run records: its tables, and their rows until they are recorded.

use super::decide::Optimization;
use super::events::{Event, EventKind};
use super::flight::Pose;
use super::scenario::RecordSection;
use sidestep_kernel::ports::table::label_of;
use sidestep_kernel::ports::{Buffer, Buffers, RowBuffer, Table};
use sidestep_kernel::{Cycle, EntityId};

/// Where an airplane is at the start of a cycle.
#[derive(Debug)]
struct Place {
    cycle: Cycle,
    airplane: EntityId,
    pose: Pose,
}

fn trajectories() -> Table<Place> {
    Table::new("trajectories")
        .u64("cycle", "cycle of dt at whose start this holds", |p: &Place| p.cycle)
        .u32("airplane", "entity id", |p| p.airplane)
        .f64("x_m", "position east", |p| p.pose.at[0])
        .f64("y_m", "position north", |p| p.pose.at[1])
        .f64("heading_rad", "heading, counter-clockwise from east", |p| p.pose.heading_rad)
}

fn events() -> Table<Event> {
    let kinds = EventKind::ALL.map(EventKind::name);
    Table::new("events")
        .u64("cycle", "cycle of dt in which it happened", |e: &Event| e.cycle)
        .label("event", "what happened", kinds, |e| label_of(&EventKind::ALL, &e.kind))
        .u32("airplane", "entity id", |e| e.airplane)
        .u32("other", "the other airplane, or the same", |e| e.other)
        .f64("value", "metres, seconds or a number, by event", |e| e.value)
}

fn optimizations() -> Table<Optimization> {
    Table::new("optimizations")
        .u64("cycle", "cycle of dt before which it was made", |o: &Optimization| o.cycle)
        .u32("airplane", "smallest entity id of the group", |o| o.airplane)
        .u32("airplanes", "members of the group", |o| o.airplanes)
        .u32("rounds", "rounds made", |o| o.rounds)
        .label("converged", "whether the distributions had settled", ["no", "yes"], |o| {
            u32::from(o.converged)
        })
        .u64("messages", "messages, one per receiver", |o| o.traffic.messages)
        .u64("bytes", "their bytes", |o| o.traffic.bytes)
}

/// Rows that wait for being recorded.
#[derive(Debug, Default)]
pub(super) struct Rows {
    record: RecordSection,
    places: RowBuffer<Place>,
    events: RowBuffer<Event>,
    optimizations: RowBuffer<Optimization>,
}

impl Rows {
    /// Nothing yet; later what `record` asks for.
    pub(super) fn new(record: RecordSection) -> Self {
        Self { record, ..Self::default() }
    }

    /// Begins to keep rows.
    pub(super) fn begin(&mut self) {
        self.places.begin(self.record.trajectories.then(trajectories));
        self.events.begin(self.record.events.then(events));
        self.optimizations.begin(self.record.optimizations.then(optimizations));
    }

    pub(super) fn pose(&mut self, cycle: Cycle, airplane: EntityId, pose: Pose) {
        self.places.push(Place { cycle, airplane, pose });
    }

    pub(super) fn event(&mut self, event: Event) {
        self.events.push(event);
    }

    pub(super) fn optimization(&mut self, optimization: Optimization) {
        self.optimizations.push(optimization);
    }
}

impl Buffers for Rows {
    fn buffers(&self) -> Vec<&dyn Buffer> {
        vec![&self.places, &self.events, &self.optimizations]
    }

    fn buffers_mut(&mut self) -> Vec<&mut dyn Buffer> {
        vec![&mut self.places, &mut self.events, &mut self.optimizations]
    }
}
