//! The hooks of a run of the pond, beside its phases.

use super::rows::{Event, Rows, What};
use super::{PondState, PondWorld, Saved, Sums};
use serde_json::{Value, json};
use sidestep_kernel::checkpoint::CheckpointError;
use sidestep_kernel::digest::Hasher;
use sidestep_kernel::ports::{Buffers, RecordError, Recorder, TableSchema};
use sidestep_kernel::view::{Axis, Body, Frame, Kind, Look, PlaceRows, Pose, Scenery, Shape};
use sidestep_kernel::words::{Lines, Said, line};
use sidestep_kernel::{Cycle, Digest, Effort, World};

/// The part of a run that is kept beside the state.
#[derive(Debug, Default)]
pub(crate) struct Books {
    sums: Sums,
    rows: Rows,
    gathered: Vec<Event>,
}

impl World for PondWorld {
    const NAME: &'static str = "pond";
    const AGENT: &'static str = "frog";
    const LOOKS_EACH_CYCLE: bool = true;

    type Books = Books;
    type Saved = Saved;
    type Metrics = Value;

    fn agents(&self) -> usize {
        self.frogs as usize
    }

    fn before_cycle(&self, state: &PondState, books: &mut Books, now: Cycle) {
        books.rows.poses(self, state, now);
    }

    fn gather(&self, books: &mut Books, scratch: &mut Vec<Event>) {
        books.gathered.append(scratch);
    }

    fn book(&self, books: &mut Books) {
        let mut events = std::mem::take(&mut books.gathered);
        events.sort_unstable_by_key(|event| (event.cycle, event.frog));
        for event in events {
            match event.what {
                What::Hop => books.sums.hops += 1,
                What::Bump => books.sums.bumps += 1,
            }
            books.rows.event(event);
        }
    }

    fn begin_recording(&self, _: &mut PondState, books: &mut Books, _: Cycle) {
        books.rows.begin();
    }

    fn watch(&self, _: &mut Books) {}

    fn schemas(&self, books: &Books) -> Vec<TableSchema> {
        books.rows.schemas()
    }

    fn record(
        &self,
        _: &mut PondState,
        books: &mut Books,
        _: Cycle,
        recorder: &mut dyn Recorder,
    ) -> Result<(), RecordError> {
        books.rows.record(recorder)
    }

    fn digest(&self, state: &PondState, now: Cycle) -> Digest {
        let mut hasher = Hasher::default();
        hasher.u64(now);
        state.pad.iter().for_each(|pad| hasher.u32(pad));
        hasher.finish()
    }

    fn save(&self, state: &PondState, books: &Books, _: Cycle) -> Saved {
        Saved { pads: state.pad.iter().collect(), sums: books.sums }
    }

    fn restore(&self, saved: Saved, books: &mut Books) -> Result<PondState, CheckpointError> {
        if saved.pads.len() != self.frogs as usize {
            return Err(CheckpointError::Damaged);
        }
        books.sums = saved.sums;
        Ok(self.with_pads(saved.pads))
    }

    fn scenery(&self, name: &str) -> Scenery {
        Scenery {
            name: name.into(),
            dimensions: 2,
            cycle_s: 1.0,
            floor: None,
            bodies: Vec::new(),
            names: Vec::new(),
        }
    }

    fn frame(&self, state: &PondState, _: &mut Books, now: Cycle, _: Look) -> Frame {
        let frog = |(number, pad)| {
            let [x_m, y_m] = self.place_m(pad);
            let shape = Shape::Cylinder { radius_m: 0.3, height_m: 0.2 };
            Body::new(Kind::Robot, number, Pose::at([x_m, y_m, 0.1]), shape)
        };
        let bodies = (0..).zip(state.pad.iter()).map(frog).collect();
        Frame { cycle: now, time_s: now as f64, bodies, ..Frame::default() }
    }

    fn place_rows(&self, _: &Books) -> Vec<PlaceRows> {
        vec![PlaceRows {
            table: "trajectories",
            kind: Kind::Robot,
            number: "frog",
            part: None,
            axes: vec![Axis::meters("x_m"), Axis::meters("y_m")],
            plane: None,
            is_corner: false,
            ahead: None,
            every: 1,
            worth: 400,
        }]
    }

    fn metrics(&self, _: &PondState, books: &Books, _: Cycle, _: &Effort) -> Value {
        let Sums { hops, bumps } = books.sums;
        json!({ "hops": hops, "bumps": bumps, "hops_per_frog": hops as f64 / f64::from(self.frogs) })
    }

    fn agent_metrics(&self, state: &PondState, _: &Books, _: Cycle) -> Value {
        state.pad.iter().map(|pad| json!({ "pad": pad })).collect()
    }

    fn outcome(&self, metrics: &Value) -> Lines {
        vec![line("hops", metrics["hops"].to_string())]
    }

    fn poses(&self, state: &PondState, _: Cycle) -> Said {
        let pads: Vec<u32> = state.pad.iter().collect();
        Said { text: format!("  pads {pads:?}\n"), json: json!(pads) }
    }
}
