//! The tables that a run records, and the rows that wait to be recorded.

use super::calibration_rows::{
    RangeRow, ReadingLabels, ReadingRow, motion_table, range_table, reading_table,
};
use super::effector::{HEADING_NAMES, Side};
use super::odometry::DeadReckoning;
use super::progress::GridlockEvent;
use super::scenario::RecordSection;
use super::sensor::SensorModel;
use super::state::{PoseBuffer, RobotsState};
use super::table_notes::{CYCLE_DESCRIPTION, box_notes};
use super::world::{RobotsWorld, Role};
use super::{Event, EventKind, MotionSample, RangeSample, RobotsEvent, Scratch, SensorSample};
use sidestep_kernel::ports::{
    ColumnBlockBuffer, ColumnSpec, ColumnType, ColumnValues, RecordError, Recorder, Table,
    TableBuffer, TableBuffers, TableRowsBuffer, TableSchema,
};
use sidestep_kernel::view::EventBuffer;
use sidestep_kernel::{Cycle, EntityId};
use std::ops::Range;

/// Number of poses kept before they must be recorded: as many as fit a processor's cache,
const TARGET_BUFFER_POSES: usize = 1 << 18;
/// or more for very many bodies, so that cycles run at least sixteen in a row,
const MIN_BUFFER_CYCLES: usize = 16;
/// but never more than this.
const MAX_BUFFER_POSES: usize = 1 << 24;
/// Number of bodies for which poses are collected together: a cache line of each cycle.
const BODIES_PER_BLOCK: usize = 16;

const HEADING_DESCRIPTION: &str =
    "heading, counterclockwise from east along the map: 0, 90, 180 or 270 degrees, by name";
const BODY_DESCRIPTION: &str = "entity id: robots first, then people, then doors";

const SINCE_DESCRIPTION: &str =
    "cycle since which no robot of a gridlock came nearer to its goal; of a gridlock alone";
const ROBOTS_DESCRIPTION: &str =
    "ids of the robots of a gridlock, with blanks between; of a gridlock alone";

/// Returns the table of poses, which are recorded as whole columns because there is one for every body and cycle.
fn trajectory_table(world: &RobotsWorld) -> TableSchema {
    let column = ColumnSpec::new;
    let columns = vec![
        column("cycle", ColumnType::U64, "the pose at the beginning of this cycle"),
        column("body", ColumnType::U32, BODY_DESCRIPTION),
        column("col_boxes", ColumnType::U32, "column of the body's lower-left box, from the west"),
        column("row_boxes", ColumnType::U32, "row of the body's lower-left box, from the south"),
        ColumnSpec::label("heading", HEADING_DESCRIPTION, HEADING_NAMES),
    ];
    TableSchema { about: box_notes(world), ..TableSchema::new("trajectories", columns) }
}

fn event_table(world: &RobotsWorld) -> Table<RobotsEvent> {
    let names = ["contact", "door_opened", "door_closed", "gridlock", "gridlock_ended"];
    let kinds = world.kinds.iter().cloned().chain([String::new()]);
    let no_kind = world.kinds.len() as u32;
    let sides = Side::ALL.iter().map(|side| side.name()).chain([""]);
    let no_side = Side::ALL.len() as u32;
    Table::new("events")
        .with_about(box_notes(world))
        .u64("cycle", CYCLE_DESCRIPTION, RobotsEvent::cycle)
        .u32("body", BODY_DESCRIPTION, RobotsEvent::body)
        .label("event", "what happened", names, |e| match e {
            RobotsEvent::Body(Event { event: EventKind::Contact { .. }, .. }) => 0,
            RobotsEvent::Body(Event { event: EventKind::DoorOpened, .. }) => 1,
            RobotsEvent::Body(Event { event: EventKind::DoorClosed, .. }) => 2,
            RobotsEvent::Gridlock(event) => 4 - u32::from(event.has_begun),
        })
        .label("kind", "kind of the thing touched, empty otherwise", kinds, move |e| match e {
            RobotsEvent::Body(Event { event: EventKind::Contact { kind, .. }, .. }) => {
                u32::from(*kind)
            }
            _ => no_kind,
        })
        .label(
            "side",
            "side of the robot that touched it, empty otherwise",
            sides,
            move |e| match e {
                RobotsEvent::Body(Event { event: EventKind::Contact { side, .. }, .. }) => {
                    *side as u32
                }
                _ => no_side,
            },
        )
        .u64("since_cycle", SINCE_DESCRIPTION, |e| match e {
            RobotsEvent::Body(_) => None,
            RobotsEvent::Gridlock(event) => Some(event.gridlock.since),
        })
        .text("robots", ROBOTS_DESCRIPTION, |e| match e {
            RobotsEvent::Body(_) => None,
            RobotsEvent::Gridlock(event) => Some(event.gridlock.ids_text(" ")),
        })
}

/// The tables, and their rows until they are recorded.
#[derive(Debug, Default)]
struct RowBuffers {
    trajectories: ColumnBlockBuffer,
    events: TableRowsBuffer<RobotsEvent>,
    readings: TableRowsBuffer<ReadingRow>,
    motions: TableRowsBuffer<MotionSample>,
    ranges: TableRowsBuffer<RangeRow>,
}

impl TableBuffers for RowBuffers {
    fn table_buffers(&self) -> Vec<&dyn TableBuffer> {
        vec![&self.trajectories, &self.events, &self.readings, &self.motions, &self.ranges]
    }

    fn table_buffers_mut(&mut self) -> Vec<&mut dyn TableBuffer> {
        vec![
            &mut self.trajectories,
            &mut self.events,
            &mut self.readings,
            &mut self.motions,
            &mut self.ranges,
        ]
    }
}

/// Data that a run keeps beside its state: events and samples that wait to be recorded.
#[derive(Debug, Default)]
pub struct Collector {
    record: RecordSection,
    /// First cycle of which the poses are not recorded yet.
    recorded: Cycle,
    is_recording: bool,
    rows: RowBuffers,
    /// Events as the workers have gathered them,
    gathered: Vec<RobotsEvent>,
    /// and those that wait for the next frame.
    pub(super) log: EventBuffer<RobotsEvent>,
    /// The pose that each robot's wheels report, by id, while odometry is watched.
    odometry: Option<Vec<DeadReckoning>>,
    sensor_samples: Vec<SensorSample>,
    range_samples: Vec<RangeSample>,
    motion_samples: Vec<MotionSample>,
}

impl Collector {
    /// Returns the empty collector of a run that records the tables named in `record` once recording starts.
    pub(crate) fn new(record: RecordSection) -> Self {
        Self { record, ..Self::default() }
    }

    /// Keeps rows from cycle `now` on; poses only where trajectories are recorded.
    pub(super) fn start(&mut self, world: &RobotsWorld, state: &mut RobotsState, now: Cycle) {
        let record = &self.record;
        self.rows.trajectories.set_schema(record.trajectories.then(|| trajectory_table(world)));
        self.rows.events.set_table(record.events.then(|| event_table(world)));
        self.rows.readings.set_table(
            record.calibration.then(|| reading_table(world, ReadingLabels::from_world(world))),
        );
        self.rows.motions.set_table(record.calibration.then(|| motion_table(world)));
        self.rows.ranges.set_table(record.calibration.then(|| range_table(world)).flatten());
        if record.trajectories {
            let bodies = world.bodies.len();
            let target = (TARGET_BUFFER_POSES / bodies).max(MIN_BUFFER_CYCLES);
            // With few bodies the cycles, and not the poses, limit how long rows wait to be
            // recorded.
            let capacity = target.min(MAX_BUFFER_POSES / bodies).clamp(1, 4096);
            state.frames = Some(PoseBuffer::new(now, capacity, bodies));
        }
        self.is_recording = true;
        self.recorded = now;
    }

    /// Continues from cycle `now`, after its state was restored.
    pub(super) fn resume(&mut self, world: &RobotsWorld, state: &mut RobotsState, now: Cycle) {
        self.recorded = now;
        // Wheels count from here on: what they counted belongs to another past.
        if self.odometry.take().is_some() {
            self.watch_odometry(world);
        }
        if self.is_recording {
            self.start(world, state, now);
        }
    }

    /// Returns whether controls from outside of the run are to be kept.
    pub(super) fn records_controls(&self) -> bool {
        self.record.controls
    }

    /// Starts to keep the events that frames report.
    pub(super) fn watch(&mut self) {
        self.log.is_enabled = true;
    }

    /// Starts to keep the poses that wheels report.
    pub(super) fn watch_odometry(&mut self, world: &RobotsWorld) {
        // Robots have the first ids.
        self.odometry.get_or_insert_with(|| vec![DeadReckoning::default(); world.robots.len()]);
    }

    /// Returns the pose that each robot's wheels report, by id; nothing unless odometry is watched.
    pub(super) fn odometry(&self) -> &[DeadReckoning] {
        self.odometry.as_deref().unwrap_or_default()
    }

    /// Makes a worker keep the events and samples that are wanted.
    pub(super) fn prepare(&self, scratch: &mut Scratch) {
        scratch.keep_events = self.log.is_enabled || self.rows.events.is_enabled();
        scratch.keep_readings = self.rows.readings.is_enabled();
        scratch.keep_motions = self.rows.motions.is_enabled() || self.odometry.is_some();
    }

    /// Takes a worker's events and samples over.
    pub(super) fn collect(&mut self, scratch: &mut Scratch) {
        self.gathered.extend(scratch.events.drain(..).map(RobotsEvent::Body));
        self.sensor_samples.append(&mut scratch.sensor_samples);
        self.range_samples.append(&mut scratch.range_samples);
        self.motion_samples.append(&mut scratch.motion_samples);
    }

    /// Takes over the gridlocks that a look at the state has found.
    pub(super) fn push_gridlocks(&mut self, found: Vec<GridlockEvent>) {
        if self.log.is_enabled || self.rows.events.is_enabled() {
            self.gathered.extend(found.into_iter().map(RobotsEvent::Gridlock));
        }
    }

    /// Puts the gathered rows in an order that does not depend on the workers that recorded them. A body has at
    /// most one event and one motion a cycle, so that the order is complete.
    pub(super) fn commit(&mut self, world: &RobotsWorld) {
        self.gathered.sort_by_key(|e| (e.cycle(), matches!(e, RobotsEvent::Gridlock(_)), e.body()));
        if self.log.is_enabled {
            self.gathered.iter().for_each(|event| self.log.push(event.clone()));
        }
        self.rows.events.extend(self.gathered.drain(..));
        self.motion_samples.sort_unstable_by_key(|s| (s.cycle, s.robot));
        for sample in &self.motion_samples {
            if let Some(odometry) = &mut self.odometry {
                odometry[sample.robot as usize].add(world, sample);
            }
        }
        self.rows.motions.extend(self.motion_samples.drain(..));
    }

    /// Returns the tables that are recorded.
    pub(super) fn schemas(&self) -> Vec<TableSchema> {
        self.rows.schemas()
    }

    /// Hands over the rows of all cycles before `now`.
    pub(super) fn record(
        &mut self,
        world: &RobotsWorld,
        state: &mut RobotsState,
        now: Cycle,
        recorder: &mut dyn Recorder,
    ) -> Result<(), RecordError> {
        if let Some(frames) = &mut state.frames {
            self.rows.trajectories.set(pose_columns(world, frames, self.recorded..now));
            frames.first = now;
        }
        // Stable, because a robot's beams of one cycle are in their order already.
        self.sensor_samples.sort_by_key(|sample| (sample.cycle, sample.robot));
        if !self.sensor_samples.is_empty() {
            let labels = ReadingLabels::from_world(world);
            let samples = self.sensor_samples.drain(..);
            self.rows
                .readings
                .extend(samples.filter_map(|sample| labels.reading_row(world, &sample)));
        }
        self.range_samples.sort_by_key(|sample| (sample.cycle, sample.robot));
        if !self.range_samples.is_empty() {
            let labels = ReadingLabels::from_world(world);
            let samples = self.range_samples.drain(..);
            self.rows.ranges.extend(samples.filter_map(|sample| labels.range_row(world, sample)));
        }
        self.recorded = now;
        self.rows.record(recorder)
    }
}

/// Rows are ordered by body, then by cycle.
fn pose_columns(world: &RobotsWorld, frames: &PoseBuffer, span: Range<Cycle>) -> Vec<ColumnValues> {
    let cycles = (span.end - span.start) as usize;
    // Doors never move; their events say when they open.
    let moving: Vec<EntityId> =
        (0..world.bodies.len() as EntityId).filter(|&id| !world.is_door(id)).collect();
    let [mut bodies, mut cols, mut rows, mut headings] =
        std::array::from_fn(|_| Vec::with_capacity(cycles * moving.len()));
    let mut at_cycle = Vec::with_capacity(cycles * moving.len());
    let from = (span.start - frames.first) as usize;
    // Poses are stored by cycle and written by body: a few bodies at a time, so that reads within a
    // cycle lie together.
    let mut tracks = vec![Vec::new(); BODIES_PER_BLOCK];
    for some in moving.chunks(BODIES_PER_BLOCK) {
        tracks.iter_mut().for_each(Vec::clear);
        for cycle in from..from + cycles {
            for (track, &id) in tracks.iter_mut().zip(some) {
                track.push(frames.poses.get(cycle * frames.bodies + id as usize));
            }
        }
        for (track, &id) in tracks.iter().zip(some) {
            bodies.extend(std::iter::repeat_n(id, cycles));
            at_cycle.extend(span.clone());
            cols.extend(track.iter().map(|pose| pose.col() - world.border));
            rows.extend(track.iter().map(|pose| pose.row() - world.border));
            headings.extend(track.iter().map(|pose| u32::from(pose.heading())));
        }
    }
    vec![
        ColumnValues::U64(at_cycle.into()),
        ColumnValues::U32(bodies.into()),
        ColumnValues::U32(cols.into()),
        ColumnValues::U32(rows.into()),
        ColumnValues::Label(headings.into()),
    ]
}

impl RobotsWorld {
    /// Returns the sensors of all robot types; one comes once for every type that carries it.
    pub fn sensors(&self) -> impl Iterator<Item = &SensorModel> {
        self.types.iter().flat_map(|ty| match &ty.role {
            Role::Robot(model) => model.body.sensors.iter().map(|s| &s.model).collect(),
            _ => Vec::new(),
        })
    }
}
