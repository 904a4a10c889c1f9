//! What a run records: tables, and what waits for being recorded.

use super::effector::Side;
use super::perceive::name_of;
use super::scenario::RecordSection;
use super::sensor::SensorModel;
use super::state::{Frames, RobotsState, pose_of_word};
use super::world::{RobotsWorld, Role};
use super::{Event, EventKind, MotionSample, Scratch, SensorSample};
use sidestep_kernel::ports::{ColumnSpec, ColumnType, RecordError, Recorder, TableSchema, Values};
use sidestep_kernel::view::Log;
use sidestep_kernel::{Cycle, EntityId};

/// Poses kept before they must be recorded: what a processor's cache holds,
const FEW_POSES: usize = 1 << 18;
/// or more for very many bodies, so that cycles run at least sixteen in a row,
const CYCLES_IN_A_ROW: usize = 16;
/// but never more than this.
const MAX_POSES: usize = 1 << 24;
/// Bodies whose poses are brought together at a time: a cache line of each cycle.
const TRANSPOSED: usize = 16;

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

/// What a run keeps beside its state: events and samples that wait.
#[derive(Debug, Default)]
pub struct Books {
    record: RecordSection,
    /// First cycle whose poses are not recorded yet.
    recorded: Cycle,
    /// What the recorder is given; empty without recording.
    tables: Vec<Table>,
    /// Events as the workers have gathered them,
    gathered: Vec<Event>,
    /// those that wait for being recorded,
    unrecorded: Vec<Event>,
    /// and those that wait for the next frame.
    pub(super) log: Log<Event>,
    sensor_samples: Vec<SensorSample>,
    motion_samples: Vec<MotionSample>,
}

impl Books {
    /// Empty books of a run that may come to record what `record` says.
    pub fn new(record: RecordSection) -> Self {
        Self { record, ..Self::default() }
    }

    /// Begins to keep rows from cycle `now` on.
    pub(super) fn begin(&mut self, world: &RobotsWorld, state: &mut RobotsState, now: Cycle) {
        let record = &self.record;
        let wanted = [
            (record.trajectories, Table::Trajectories),
            (record.events, Table::Events),
            (record.calibration, Table::Readings),
            (record.calibration, Table::Motions),
        ];
        self.tables = wanted.iter().filter(|w| w.0).map(|w| w.1).collect();
        if record.trajectories {
            let bodies = world.bodies.len();
            let wanted = (FEW_POSES / bodies).max(CYCLES_IN_A_ROW);
            let capacity = wanted.min(MAX_POSES / bodies).clamp(1, 4096);
            state.frames = Some(Frames::new(now, capacity, bodies));
        }
        self.recorded = now;
    }

    /// Goes on from cycle `now`, whose state was restored.
    pub(super) fn go_on(&mut self, world: &RobotsWorld, state: &mut RobotsState, now: Cycle) {
        self.recorded = now;
        if !self.tables.is_empty() {
            self.begin(world, state, now);
        }
    }

    /// Lets a worker keep what is wanted.
    pub(super) fn prepare(&self, scratch: &mut Scratch) {
        scratch.keep_events = self.log.is_kept || self.tables.contains(&Table::Events);
        scratch.keep_samples = self.tables.contains(&Table::Readings);
    }

    /// Takes a worker's events and samples over.
    pub(super) fn gather(&mut self, scratch: &mut Scratch) {
        self.gathered.append(&mut scratch.events);
        self.sensor_samples.append(&mut scratch.sensor_samples);
        self.motion_samples.append(&mut scratch.motion_samples);
    }

    /// Files what was gathered, in an order that does not depend on who has seen what.
    pub(super) fn book(&mut self) {
        self.gathered.sort_unstable_by_key(|e| (e.cycle, e.body));
        self.gathered.iter().for_each(|&event| self.log.push(event));
        if self.tables.contains(&Table::Events) {
            self.unrecorded.append(&mut self.gathered);
        }
        self.gathered.clear();
    }

    /// The tables that are recorded.
    pub(super) fn schemas(&self, world: &RobotsWorld) -> Vec<TableSchema> {
        self.tables.iter().map(|&table| schema(world, table)).collect()
    }

    /// Hands over the rows of all cycles before `now`.
    pub(super) fn record(
        &mut self,
        world: &RobotsWorld,
        state: &mut RobotsState,
        now: Cycle,
        recorder: &mut dyn Recorder,
    ) -> Result<(), RecordError> {
        for (index, table) in self.tables.clone().into_iter().enumerate() {
            let block = match table {
                Table::Trajectories => self.trajectories(world, state, now),
                Table::Events => self.events(world),
                Table::Readings => self.readings(world),
                Table::Motions => self.motions(),
            };
            recorder.append(index, &block)?;
        }
        self.recorded = now;
        if let Some(frames) = &mut state.frames {
            frames.first = now;
        }
        Ok(())
    }

    fn trajectories(&self, world: &RobotsWorld, state: &RobotsState, now: Cycle) -> Vec<Values> {
        let Some(frames) = &state.frames else { return Vec::new() };
        let cycles = (now - self.recorded) as usize;
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
                at_cycle.extend(self.recorded..now);
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

    fn events(&mut self, world: &RobotsWorld) -> Vec<Values> {
        let events = std::mem::take(&mut self.unrecorded);
        let none = world.kinds.len() as u32;
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

    fn readings(&mut self, world: &RobotsWorld) -> Vec<Values> {
        let mut samples = std::mem::take(&mut self.sensor_samples);
        samples.sort_by_key(|s| (s.cycle, s.robot));
        let (observations, classes) = reading_labels(world);
        let index = |names: &[String], name: &str| {
            names.binary_search_by(|n| n.as_str().cmp(name)).unwrap_or(0) as u32
        };
        let mut columns: [Vec<u32>; 6] = std::array::from_fn(|_| Vec::with_capacity(samples.len()));
        for s in &samples {
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
        let mut samples = std::mem::take(&mut self.motion_samples);
        samples.sort_unstable_by_key(|s| (s.cycle, s.robot));
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
}

/// Labels of readings in `Readings`: `sensor/observation` and `sensor/class` pairs.
fn reading_labels(world: &RobotsWorld) -> (Vec<String>, Vec<String>) {
    let (mut observations, mut classes) = (Vec::new(), vec!["beyond".to_string()]);
    for sensor in world.sensors() {
        observations.extend(sensor.observations.iter().cloned());
        classes.extend(sensor.distance_classes.iter().cloned());
    }
    for names in [&mut observations, &mut classes] {
        names.sort_unstable();
        names.dedup();
    }
    (observations, classes)
}

fn schema(world: &RobotsWorld, table: Table) -> TableSchema {
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
    let body = column("body", ColumnType::U32, "entity id: robots first, then people, then doors");
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
                label("heading", "where the body looks", HEADING_NAMES.map(String::from).to_vec()),
            ],
        ),
        Table::Events => {
            let mut kinds = world.kinds.clone();
            kinds.push(String::new());
            let mut sides: Vec<String> = Side::ALL.iter().map(|s| s.name().to_string()).collect();
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
            let (observations, classes) = reading_labels(world);
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
                column("ahead_boxes", ColumnType::I32, "displacement ahead in the heading before"),
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

impl RobotsWorld {
    /// The sensors of all robot types.
    pub fn sensors(&self) -> impl Iterator<Item = &SensorModel> {
        self.types.iter().flat_map(|ty| match &ty.role {
            Role::Robot(model) => model.body.sensors.iter().map(|s| &s.model).collect(),
            _ => Vec::new(),
        })
    }
}
