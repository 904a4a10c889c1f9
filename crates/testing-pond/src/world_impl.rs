//! The hooks of a run of the pond, beside its phases.

use super::kinds;
use super::rows::{Event, FrogAction, Rows};
use super::{PondState, PondWorld, Saved, Sums};
use serde_json::{Value, json};
use sidestep_kernel::checkpoint::CheckpointError;
use sidestep_kernel::control::{AgentTeams, BufferMut, Order};
use sidestep_kernel::digest::Hasher;
use sidestep_kernel::ports::{RecordError, Recorder, TableBuffers, TableSchema};
use sidestep_kernel::text::{JsonTextReport, KeyValues, key_value_pair};
use sidestep_kernel::view::{
    Body, BodyKind, CoordinateColumn, Frame, FrameOptions, Pose, PositionTableColumns, Scenery,
    Shape,
};
use sidestep_kernel::{
    CheckpointableWorld, ControllableWorld, Cycle, Digest, RecordableWorld, RunStats, World,
    WorldMetrics, WorldView,
};
use std::sync::Arc;

/// The part of a run that is kept beside the state.
#[derive(Debug, Default)]
pub(crate) struct Collector {
    sums: Sums,
    rows: Rows,
    gathered: Vec<Event>,
}

impl World for PondWorld {
    const NAME: &'static str = "pond";
    const AGENT: &'static str = "frog";
    const OBSERVES_EACH_CYCLE: bool = true;

    type Collector = Collector;

    fn agent_count(&self) -> usize {
        self.frogs as usize
    }

    fn before_cycle(&self, state: &PondState, books: &mut Collector, now: Cycle) {
        books.rows.poses(self, state, now);
    }

    fn collect(&self, books: &mut Collector, scratch: &mut Vec<Event>) {
        books.gathered.append(scratch);
    }

    fn merge_worker_results(&self, books: &mut Collector) {
        let mut events = std::mem::take(&mut books.gathered);
        events.sort_unstable_by_key(|event| (event.cycle, event.frog));
        for event in events {
            match event.what {
                FrogAction::Hop => books.sums.hops += 1,
                FrogAction::Bump => books.sums.bumps += 1,
            }
            books.rows.event(event);
        }
    }
}

impl RecordableWorld for PondWorld {
    fn start_recording(&self, _: &mut PondState, books: &mut Collector, _: Cycle) {
        books.rows.begin();
    }

    fn enable_events(&self, _: &mut Collector) {}

    fn schemas(&self, books: &Collector) -> Vec<TableSchema> {
        books.rows.schemas()
    }

    fn record(
        &self,
        _: &mut PondState,
        books: &mut Collector,
        _: Cycle,
        recorder: &mut dyn Recorder,
    ) -> Result<(), RecordError> {
        books.rows.record(recorder)
    }

    fn position_columns(&self, _: &Collector) -> Vec<PositionTableColumns> {
        vec![PositionTableColumns {
            table: "trajectories",
            kind: kinds::FROG,
            number: "frog",
            part: None,
            axes: vec![CoordinateColumn::meters("x_m"), CoordinateColumn::meters("y_m")],
            plane: None,
            is_corner: false,
            heading: None,
            interval: 1,
            history: 400,
        }]
    }
}

impl CheckpointableWorld for PondWorld {
    type Snapshot = Saved;

    fn digest(&self, state: &PondState, now: Cycle) -> Digest {
        let mut hasher = Hasher::default();
        hasher.write_u64(now);
        state.pad.iter().for_each(|pad| hasher.write_u32(pad));
        // Given orders are part of the state; without any the digest is that of the pads.
        if self.takes_orders() {
            state.order.iter().for_each(|order| hasher.write_u32(order));
        }
        hasher.finish()
    }

    fn save(&self, state: &PondState, books: &Collector, _: Cycle) -> Saved {
        Saved {
            pads: state.pad.iter().collect(),
            orders: state.order.iter().collect(),
            sums: books.sums,
        }
    }

    fn restore(&self, saved: Saved, books: &mut Collector) -> Result<PondState, CheckpointError> {
        let frogs = self.frogs as usize;
        if saved.pads.len() != frogs || saved.orders.len() != frogs {
            return Err(CheckpointError::Damaged);
        }
        books.sums = saved.sums;
        Ok(self.state(saved.pads, saved.orders))
    }
}

impl WorldView for PondWorld {
    fn scenery(&self, name: &str) -> Scenery {
        Scenery {
            name: name.into(),
            dimensions: 2,
            cycle_s: 1.0,
            floor: None,
            bodies: (0..).zip(&self.reeds).map(|(number, &pad)| self.reed(number, pad)).collect(),
            names: Vec::new(),
            groups: Vec::new(),
            earth: Default::default(),
            traffic: None,
        }
    }

    fn frame(&self, state: &PondState, _: &mut Collector, now: Cycle, _: FrameOptions) -> Frame {
        let frog = |(number, pad)| {
            let [x_m, y_m] = self.place_m(pad);
            let shape = Shape::Cylinder { radius_m: 0.3, height_m: 0.2 };
            Body::new(kinds::FROG, number, Pose::from_position([x_m, y_m, 0.1]), shape)
        };
        let bodies = (0..).zip(state.pad.iter()).map(frog).collect();
        Frame { cycle: now, time_s: now as f64, bodies, ..Frame::default() }
    }
}

impl PondWorld {
    fn reed(&self, number: u32, pad: u32) -> Body {
        let [x_m, y_m] = self.place_m(pad);
        let shape = Shape::Cuboid { size_m: [1.0, 1.0, 0.5] };
        Body::new(BodyKind::OBSTACLE, number, Pose::from_position([x_m, y_m, 0.25]), shape)
    }
}

impl ControllableWorld for PondWorld {
    fn agent_teams(&self) -> Arc<AgentTeams> {
        Arc::clone(&self.teams)
    }

    fn order(&self, state: &mut PondState, order: &Order<'_>) {
        let [hop] = *order.values else { return };
        state.order.set(order.agent as usize, hop as u32);
    }

    fn observe(&self, state: &PondState, _: Cycle, _: usize, buffers: &mut [BufferMut<'_>]) {
        self.write_observations(state, buffers);
    }
}

impl WorldMetrics for PondWorld {
    type Metrics = Value;

    fn metrics(&self, _: &PondState, books: &Collector, _: Cycle, _: &RunStats) -> Value {
        let Sums { hops, bumps } = books.sums;
        json!({ "hops": hops, "bumps": bumps, "hops_per_frog": hops as f64 / f64::from(self.frogs) })
    }

    fn agent_metrics(&self, state: &PondState, _: &Collector, _: Cycle) -> Value {
        state.pad.iter().map(|pad| json!({ "pad": pad })).collect()
    }

    fn summary_lines(&self, metrics: &Value) -> KeyValues {
        vec![key_value_pair("hops", metrics["hops"].to_string())]
    }

    fn poses(&self, state: &PondState, _: Cycle) -> JsonTextReport {
        let pads: Vec<u32> = state.pad.iter().collect();
        JsonTextReport { text: format!("  pads {pads:?}\n"), json: json!(pads) }
    }
}
