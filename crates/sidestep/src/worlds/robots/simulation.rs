//! A run of a robots world: the compiled world, the state, the engine, and what is recorded.

use super::effector::Side;
use super::metrics::Metrics;
use super::perceive::name_of;
use super::scenario::{Behaviours, Compiled, StorageOrder};
use super::state::{BodyRecord, Frames, RobotsState, Snapshot, pose_of_word};
use super::view::CYCLE_S;
use super::world::{RobotsWorld, Role};
use super::{Event, EventKind, MotionSample, Scratch, SensorSample};
use crate::scenario::Source;
use sidestep_kernel::checkpoint::{self, CheckpointError, Header};
use sidestep_kernel::cycle::PhaseTimes;
use sidestep_kernel::engine::Engine;
use sidestep_kernel::ports::{
    ColumnSpec, ColumnType, RecordError, Recorder, SystemClock, TableSchema, Values,
};
use sidestep_kernel::view::{Frame, Log, Look, PlaceRows, Scenery};
use sidestep_kernel::{Cycle, Digest, EntityId, InputError, Simulation};
use std::sync::Arc;

/// Poses kept before they must be recorded: what a processor's cache holds,
const FEW_POSES: usize = 1 << 18;
/// or more for very many bodies, so that cycles run at least sixteen in a row,
const CYCLES_IN_A_ROW: usize = 16;
/// but never more than this.
const MAX_POSES: usize = 1 << 24;
/// Bodies whose poses are brought together at a time: a cache line of each cycle.
const TRANSPOSED: usize = 16;

/// A run of a robots world.
#[derive(Debug)]
pub struct RobotsSimulation {
    compiled: Compiled,
    scenario: [u8; 16],
    state: RobotsState,
    engine: Engine<RobotsWorld>,
    cycle: Cycle,
    /// First cycle whose poses are not recorded yet.
    recorded: Cycle,
    clock: SystemClock,
    /// What the recorder is given; empty without recording.
    tables: Vec<Table>,
    /// Events that wait for being recorded,
    unrecorded: Vec<Event>,
    /// and those that wait for the next frame.
    log: Log<Event>,
}

/// Names of the headings by number.
pub const HEADING_NAMES: [&str; 4] = ["east", "north", "west", "south"];

/// The tables of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Table {
    Trajectories,
    Events,
    Readings,
    Motions,
}

impl RobotsSimulation {
    /// A run at its start.
    ///
    /// # Errors
    /// When the scenario is wrong.
    pub fn new(source: &Source, workers: usize) -> Result<Self, InputError> {
        let compiled = Compiled::new(source, &Behaviours::new(), StorageOrder::Spatial)?;
        Ok(Self::from_compiled(compiled, source, workers))
    }

    /// A run of a compiled scenario at its start; the world is shared, not copied.
    pub fn from_compiled(compiled: Compiled, source: &Source, workers: usize) -> Self {
        let start = compiled.start_snapshot();
        let state = RobotsState::restore(&compiled.world, &start);
        let engine = Engine::new(&*compiled.world, compiled.world.bodies.len(), workers);
        let scenario = *Digest::of(source.text.as_bytes()).as_bytes();
        Self {
            compiled,
            scenario,
            state,
            engine,
            cycle: 0,
            recorded: 0,
            clock: SystemClock::default(),
            tables: Vec::new(),
            unrecorded: Vec::new(),
            log: Log::default(),
        }
    }

    /// Continues from a checkpoint of the same scenario and program version.
    ///
    /// # Errors
    /// When the checkpoint is damaged or belongs to something else.
    pub fn restore(&mut self, bytes: &[u8]) -> Result<(), CheckpointError> {
        let (cycle, snapshot): (Cycle, Snapshot) = checkpoint::decode(bytes, &self.header())?;
        let world = &self.compiled.world;
        let fits = snapshot.bodies.len() == world.bodies.len()
            && snapshot.visited.len() == world.map.cells().len().div_ceil(8);
        if !fits {
            return Err(CheckpointError::Damaged);
        }
        self.state = RobotsState::restore(world, &snapshot);
        (self.cycle, self.recorded) = (cycle, cycle);
        if !self.tables.is_empty() {
            self.begin_recording();
        }
        Ok(())
    }

    /// From now on keeps what [`Simulation::record`] hands over.
    pub fn begin_recording(&mut self) {
        let record = &self.compiled.record;
        let wanted = [
            (record.trajectories, Table::Trajectories),
            (record.events, Table::Events),
            (record.calibration, Table::Readings),
            (record.calibration, Table::Motions),
        ];
        self.tables = wanted.iter().filter(|w| w.0).map(|w| w.1).collect();
        let samples = record.calibration;
        for mate in self.engine.crew_mut() {
            mate.scratch.keep_samples = samples;
        }
        if record.trajectories {
            let bodies = self.compiled.world.bodies.len();
            let wanted = (FEW_POSES / bodies).max(CYCLES_IN_A_ROW);
            let capacity = wanted.min(MAX_POSES / bodies).clamp(1, 4096);
            self.state.frames = Some(Frames::new(self.cycle, capacity, bodies));
        }
        self.recorded = self.cycle;
        self.keep_events();
    }

    /// Lets the workers keep events where anybody wants them.
    fn keep_events(&mut self) {
        let wanted = self.log.is_kept || self.tables.contains(&Table::Events);
        self.engine.crew_mut().iter_mut().for_each(|mate| mate.scratch.keep_events = wanted);
    }

    /// Takes the workers' events over, in an order that does not depend on who has seen what.
    fn gather_events(&mut self) {
        let mut events = self.gather(|s| &mut s.events);
        events.sort_unstable_by_key(|e: &Event| (e.cycle, e.body));
        events.iter().for_each(|&event| self.log.push(event));
        if self.tables.contains(&Table::Events) {
            self.unrecorded.append(&mut events);
        }
    }

    /// Uses all workers even where one would be faster; for tests and benchmarks.
    pub fn share_always(&mut self) {
        self.engine.share_always();
    }

    /// The world.
    pub fn world(&self) -> &Arc<RobotsWorld> {
        &self.compiled.world
    }

    /// What the scenario asks for.
    pub fn compiled(&self) -> &Compiled {
        &self.compiled
    }

    /// The state.
    pub fn state(&self) -> &RobotsState {
        &self.state
    }

    /// The state by entity id.
    pub fn snapshot(&self) -> Snapshot {
        self.state.snapshot(&self.compiled.world, self.cycle)
    }

    /// Orders an action for the next cycle of a robot with the behaviour `external`.
    pub fn order(&mut self, robot: EntityId, action: u8) {
        use super::decide::ORDER;
        self.state.body(robot).memory[ORDER].set(u32::from(action) + 1);
    }

    /// Metrics so far.
    pub fn robot_metrics(&self) -> Metrics {
        let mut sizes = [0; 32];
        let mut largest = 0;
        for mate in self.engine.crew() {
            sizes.iter_mut().zip(mate.group_sizes).for_each(|(sum, n)| *sum += n);
            largest = largest.max(mate.largest_group);
        }
        self.compiled.world.metrics(&self.state, self.cycle, &sizes, largest)
    }

    /// Bytes on the heap that grow with the boxes, and with the bodies.
    pub fn heap_bytes(&self) -> (usize, usize) {
        let (boxes, bodies) = self.state.heap_bytes();
        let world = &self.compiled.world;
        let per_body = std::mem::size_of_val(&*world.bodies)
            + std::mem::size_of_val(&*self.compiled.start)
            + std::mem::size_of_val(&*world.robots);
        (boxes, bodies + self.engine.heap_bytes() + per_body)
    }

    fn header(&self) -> Header {
        Header {
            format: checkpoint::FORMAT,
            program_version: env!("CARGO_PKG_VERSION").into(),
            world: "robots".into(),
            scenario: self.scenario,
            cycle: self.cycle,
        }
    }

    fn gather<T: Copy>(&mut self, from: impl Fn(&mut Scratch) -> &mut Vec<T>) -> Vec<T> {
        let crew = self.engine.crew_mut();
        crew.iter_mut().flat_map(|mate| std::mem::take(from(&mut mate.scratch))).collect()
    }

    fn trajectories(&mut self) -> Vec<Values> {
        let world = &self.compiled.world;
        let Some(frames) = &self.state.frames else { return Vec::new() };
        let cycles = (self.cycle - self.recorded) as usize;
        let moving: Vec<EntityId> =
            (0..world.bodies.len() as EntityId).filter(|&id| !world.is_door(id)).collect();
        let [mut bodies, mut cols, mut rows, mut headings] =
            std::array::from_fn(|_| Vec::with_capacity(cycles * moving.len()));
        let mut at_cycle = Vec::with_capacity(cycles * moving.len());
        let from = (self.recorded - frames.first) as usize;
        // Poses come by cycle and leave by body: a few bodies at a time, so that what is read
        // of a cycle lies together.
        let mut ways = vec![Vec::new(); TRANSPOSED];
        for some in moving.chunks(TRANSPOSED) {
            ways.iter_mut().for_each(Vec::clear);
            for cycle in from..from + cycles {
                for (way, &id) in ways.iter_mut().zip(some) {
                    way.push(frames.poses.get(cycle * frames.bodies + id as usize));
                }
            }
            for (way, &id) in ways.iter().zip(some) {
                bodies.extend(std::iter::repeat_n(id, cycles));
                at_cycle.extend(self.recorded..self.cycle);
                cols.extend(way.iter().map(|&pose| pose_of_word(pose).0 - world.border));
                rows.extend(way.iter().map(|&pose| pose_of_word(pose).1 - world.border));
                headings.extend(way.iter().map(|&pose| u32::from(pose_of_word(pose).2)));
            }
        }
        vec![
            Values::U64(at_cycle),
            Values::U32(bodies),
            Values::U32(cols),
            Values::U32(rows),
            Values::Label(headings),
        ]
    }

    fn events(&mut self) -> Vec<Values> {
        self.gather_events();
        let events = std::mem::take(&mut self.unrecorded);
        let none = self.compiled.world.kinds.len() as u32;
        let label = |e: &Event| match e.event {
            EventKind::Contact { .. } => 0,
            EventKind::Opened => 1,
            EventKind::Closed => 2,
        };
        let kind = |e: &Event| match e.event {
            EventKind::Contact { kind, .. } => u32::from(kind),
            _ => none,
        };
        let side = |e: &Event| match e.event {
            EventKind::Contact { side, .. } => side as u32,
            _ => 4,
        };
        vec![
            Values::U64(events.iter().map(|e| e.cycle).collect()),
            Values::U32(events.iter().map(|e| e.body).collect()),
            Values::Label(events.iter().map(label).collect()),
            Values::Label(events.iter().map(kind).collect()),
            Values::Label(events.iter().map(side).collect()),
        ]
    }

    /// Labels of readings in `Readings`: `sensor/observation` and `sensor/class` pairs.
    fn reading_labels(&self) -> (Vec<String>, Vec<String>) {
        let (mut observations, mut classes) = (Vec::new(), vec!["beyond".to_string()]);
        for sensor in self.compiled.sensors() {
            observations.extend(sensor.observations.iter().cloned());
            classes.extend(sensor.distance_classes.iter().cloned());
        }
        for names in [&mut observations, &mut classes] {
            names.sort_unstable();
            names.dedup();
        }
        (observations, classes)
    }

    fn readings(&mut self) -> Vec<Values> {
        let mut samples = self.gather(|s| &mut s.sensor_samples);
        samples.sort_by_key(|s: &SensorSample| (s.cycle, s.robot));
        let (observations, classes) = self.reading_labels();
        let index = |names: &[String], name: &str| {
            names.binary_search_by(|n| n.as_str().cmp(name)).unwrap_or(0) as u32
        };
        let mut columns: [Vec<u32>; 6] = std::array::from_fn(|_| Vec::with_capacity(samples.len()));
        for s in &samples {
            let world = &self.compiled.world;
            let Role::Robot(model) = &world.type_of(s.robot).role else { continue };
            let sensor = &model.body.sensors[usize::from(s.sensor)].model;
            let (truth, reported) = (name_of(s.truth, sensor), name_of(s.reported, sensor));
            let row = [
                s.robot,
                u32::from(s.sensor),
                index(&observations, truth.0),
                index(&classes, truth.1),
                index(&observations, reported.0),
                index(&classes, reported.1),
            ];
            columns.iter_mut().zip(row).for_each(|(column, value)| column.push(value));
        }
        let [robot, sensor, o, c, ro, rc] = columns;
        let cycles = samples.iter().map(|s| s.cycle).collect();
        vec![
            Values::U64(cycles),
            Values::U32(robot),
            Values::U32(sensor),
            Values::Label(o),
            Values::Label(c),
            Values::Label(ro),
            Values::Label(rc),
        ]
    }

    fn motions(&mut self) -> Vec<Values> {
        let mut samples = self.gather(|s| &mut s.motion_samples);
        samples.sort_unstable_by_key(|s: &MotionSample| (s.cycle, s.robot));
        let turn = |s: &MotionSample| {
            let quarters = i32::from(s.quarter_turns);
            90 * if quarters == 3 { -1 } else { quarters }
        };
        vec![
            Values::U64(samples.iter().map(|s| s.cycle).collect()),
            Values::U32(samples.iter().map(|s| s.robot).collect()),
            Values::U32(samples.iter().map(|s| u32::from(s.action)).collect()),
            Values::I32(samples.iter().map(|s| s.ahead).collect()),
            Values::I32(samples.iter().map(|s| s.left).collect()),
            Values::I32(samples.iter().map(turn).collect()),
            Values::Label(samples.iter().map(|s| u32::from(s.contact)).collect()),
        ]
    }

    fn schema(&self, table: Table) -> TableSchema {
        let column = |name: &str, ty, meaning: &str| ColumnSpec {
            name: name.into(),
            ty,
            meaning: meaning.into(),
            labels: Vec::new(),
        };
        let label = |name: &str, meaning: &str, labels: Vec<String>| ColumnSpec {
            name: name.into(),
            ty: ColumnType::Label,
            meaning: meaning.into(),
            labels,
        };
        let cycle = column("cycle", ColumnType::U64, "cycle, counted from 0");
        let body =
            column("body", ColumnType::U32, "entity id: robots first, then people, then doors");
        let (name, columns) = match table {
            Table::Trajectories => (
                "trajectories",
                vec![
                    column("cycle", ColumnType::U64, "the pose at the beginning of this cycle"),
                    body,
                    column(
                        "col_boxes",
                        ColumnType::U32,
                        "column of the body's lower-left box, from the west",
                    ),
                    column(
                        "row_boxes",
                        ColumnType::U32,
                        "row of the body's lower-left box, from the south",
                    ),
                    label(
                        "heading",
                        "where the body looks",
                        HEADING_NAMES.map(String::from).to_vec(),
                    ),
                ],
            ),
            Table::Events => {
                let mut kinds = self.compiled.world.kinds.clone();
                kinds.push(String::new());
                let mut sides: Vec<String> =
                    Side::ALL.iter().map(|s| s.name().to_string()).collect();
                sides.push(String::new());
                let events = ["contact", "door_opened", "door_closed"].map(String::from).to_vec();
                (
                    "events",
                    vec![
                        cycle,
                        body,
                        label("event", "what happened", events),
                        label("kind", "kind of the thing touched, empty otherwise", kinds),
                        label("side", "side of the robot that touched it, empty otherwise", sides),
                    ],
                )
            }
            Table::Readings => {
                let (observations, classes) = self.reading_labels();
                (
                    "readings",
                    vec![
                        cycle,
                        column("robot", ColumnType::U32, "entity id"),
                        column("sensor", ColumnType::U32, "number of the sensor on its robot"),
                        label("true", "what the beam met", observations.clone()),
                        label("true_class", "its true distance class", classes.clone()),
                        label("reported", "what the sensor reported", observations),
                        label("reported_class", "the reported distance class", classes),
                    ],
                )
            }
            Table::Motions => (
                "motions",
                vec![
                    cycle,
                    column("robot", ColumnType::U32, "entity id"),
                    column(
                        "action",
                        ColumnType::U32,
                        "action tried: 0 forward, 1 left, 2 right, 3 stay, then the effector's own",
                    ),
                    column(
                        "ahead_boxes",
                        ColumnType::I32,
                        "displacement ahead in the heading before",
                    ),
                    column("left_boxes", ColumnType::I32, "displacement to the left"),
                    column("turn_deg", ColumnType::I32, "turn made, positive to the left"),
                    label(
                        "contact",
                        "whether an obstacle cut it",
                        ["no", "yes"].map(String::from).to_vec(),
                    ),
                ],
            ),
        };
        TableSchema { name: name.into(), columns }
    }
}

impl Compiled {
    /// The state at the start, by entity id.
    pub fn start_snapshot(&self) -> Snapshot {
        let kinds = self.world.kinds.len();
        let record = |&(at, facing): &((u32, u32), u8)| BodyRecord {
            at,
            facing,
            contact: 0,
            memory: [0; 4],
            voice: 0,
            counts: [0; 3],
            trip: [0; 2],
            contacts: vec![0; kinds],
        };
        let visited = vec![0; self.world.map.cells().len().div_ceil(8)];
        Snapshot { cycle: 0, bodies: self.start.iter().map(record).collect(), visited }
    }

    /// The sensors of all robot types.
    pub fn sensors(&self) -> impl Iterator<Item = &super::sensor::SensorModel> {
        self.world.types.iter().flat_map(|ty| match &ty.role {
            Role::Robot(model) => model.body.sensors.iter().map(|s| &s.model).collect(),
            _ => Vec::new(),
        })
    }
}

impl Simulation for RobotsSimulation {
    fn world(&self) -> &'static str {
        "robots"
    }

    fn cycle(&self) -> Cycle {
        self.cycle
    }

    fn agents(&self) -> usize {
        self.compiled.world.robots.len()
    }

    fn advance(&mut self, cycles: u64) -> u64 {
        let room = self
            .state
            .frames
            .as_ref()
            .map_or(u64::MAX, |f| f.first + f.capacity as u64 - self.cycle);
        let cycles = cycles.min(room);
        let span = (self.cycle, cycles);
        self.engine.advance(&*self.compiled.world, &mut self.state, span, &self.clock);
        self.cycle += cycles;
        cycles
    }

    fn digest(&self) -> Digest {
        self.snapshot().digest()
    }

    fn checkpoint(&self) -> Vec<u8> {
        checkpoint::encode(&self.header(), &self.snapshot())
    }

    fn schemas(&self) -> Vec<TableSchema> {
        self.tables.iter().map(|&t| self.schema(t)).collect()
    }

    fn record(&mut self, recorder: &mut dyn Recorder) -> Result<(), RecordError> {
        for (index, table) in self.tables.clone().into_iter().enumerate() {
            let block = match table {
                Table::Trajectories => self.trajectories(),
                Table::Events => self.events(),
                Table::Readings => self.readings(),
                Table::Motions => self.motions(),
            };
            recorder.append(index, &block)?;
        }
        self.recorded = self.cycle;
        if let Some(frames) = &mut self.state.frames {
            frames.first = self.cycle;
        }
        Ok(())
    }

    fn scenery(&self) -> Scenery {
        self.compiled.world.scenery(&self.compiled.name)
    }

    fn watch(&mut self) {
        self.log.is_kept = true;
        self.keep_events();
    }

    fn frame(&mut self, look: Look) -> Frame {
        self.gather_events();
        let (events, log_left_out) = self.log.take();
        let (world, state) = (&self.compiled.world, &self.state);
        Frame {
            cycle: self.cycle,
            time_s: self.cycle as f64 * CYCLE_S,
            bodies: world.visible_bodies(state),
            scans: world.scans(state, self.cycle, look.scanning_bodies),
            log: events.iter().map(|event| world.entry(event)).collect(),
            log_left_out,
        }
    }

    fn place_rows(&self) -> Vec<PlaceRows> {
        self.compiled.world.place_rows()
    }

    fn metrics(&self) -> serde_json::Value {
        serde_json::to_value(self.robot_metrics()).unwrap_or_default()
    }

    fn phase_times(&self) -> PhaseTimes {
        self.engine.times()
    }
}
