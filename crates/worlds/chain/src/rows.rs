//! Recorded tables of a run, and their rows until they are written.

use super::events::{Event, EventKind};
use super::scenario::RecordSection;
use super::state::ChainWorldState;
use super::swarm::drive::Pose2;
use super::world::ChainWorld;
use sidestep_kernel::ports::table::label_index;
use sidestep_kernel::ports::{Table, TableBuffer, TableBuffers, TableRowsBuffer};
use sidestep_kernel::{Cycle, EntityId};
use sidestep_rods::VetoReason;
use sidestep_rods::geometry::{ConvexCore, Point, convert_dimensions};
use std::collections::BTreeMap;

/// Position of a connector, a robot or an obstacle at the start of a cycle.
#[derive(Debug)]
struct PositionRow {
    cycle: Cycle,
    /// The chain that a connector or robot belongs to.
    chain: EntityId,
    /// Its index in the chain, or the obstacle's number.
    id: u32,
    at: [f64; 3],
}

/// Value of an arm's joint at the start of a cycle.
#[derive(Debug)]
struct JointRow {
    cycle: Cycle,
    chain: EntityId,
    joint: u32,
    /// Index of its name.
    name: u32,
    value: f64,
}

/// The names of the joints of all arms.
#[derive(Debug, Default)]
struct JointNames {
    /// Each name once, in the order of the chains.
    names: Vec<String>,
    /// Index of the name of each joint of each chain; none of chains that are no arms.
    of_chains: Vec<Vec<u32>>,
}

impl JointNames {
    fn from_world<const D: usize>(world: &ChainWorld<D>) -> Self {
        let mut all = Self::default();
        let mut indices = BTreeMap::new();
        for spec in world.chains.iter() {
            let variables = spec.arm.iter().flat_map(|arm| &arm.serial.variables);
            let mut of_chain = Vec::new();
            for variable in variables {
                let index = *indices.entry(variable.name.clone()).or_insert_with(|| {
                    all.names.push(variable.name.clone());
                    all.names.len() as u32 - 1
                });
                of_chain.push(index);
            }
            all.of_chains.push(of_chain);
        }
        all
    }
}

/// Adds as many columns as there are dimensions, from x on.
fn add_position_columns(table: Table<PositionRow>, dimensions: usize) -> Table<PositionRow> {
    let axes = ["x_m", "y_m", "z_m"].into_iter().take(dimensions).enumerate();
    axes.fold(table, |table, (i, axis)| table.f64(axis, "position", move |p| p.at[i]))
}

fn position_table(name: &str) -> Table<PositionRow> {
    let meaning = "cycle of dt at whose start this holds";
    Table::new(name).u64("cycle", meaning, |p: &PositionRow| p.cycle)
}

fn trajectories_table(dimensions: usize) -> Table<PositionRow> {
    let table = position_table("trajectories").u32("chain", "entity id", |p| p.chain).u32(
        "connector",
        "its index",
        |p| p.id,
    );
    add_position_columns(table, dimensions)
}

fn robots_table() -> Table<PositionRow> {
    position_table("robots")
        .u32("chain", "entity id", |p| p.chain)
        .u32("robot", "the connector that it follows", |p| p.id)
        .f64("x_m", "position of the body", |p| p.at[0])
        .f64("y_m", "position of the body", |p| p.at[1])
        .f64("heading_rad", "heading, counterclockwise from east", |p| p.at[2])
}

fn joints_table(names: Vec<String>) -> Table<JointRow> {
    Table::new("joints")
        .u64("cycle", "cycle of dt at whose start this holds", |j: &JointRow| j.cycle)
        .u32("chain", "entity id", |j| j.chain)
        .u32("joint", "its number among the arm's variables, from base to tip", |j| j.joint)
        .label("name", "its name in the model", names, |j| j.name)
        .f64("value", "rad, or m where it slides", |j| j.value)
}

fn movers_table(dimensions: usize) -> Table<PositionRow> {
    add_position_columns(
        position_table("movers").u32("obstacle", "its number", |p| p.id),
        dimensions,
    )
}

fn events_table() -> Table<Event> {
    let kinds = EventKind::ALL.map(EventKind::name);
    // The first label stands for events without a reason.
    let reasons = std::iter::once("none").chain(VetoReason::ALL.map(VetoReason::name));
    Table::new("events")
        .u64("cycle", "cycle of dt in which it happened", |e: &Event| e.cycle)
        .u32("chain", "entity id", |e| e.chain)
        .label("event", "what happened", kinds, |e| label_index(&EventKind::ALL, &e.kind))
        .u32("connector", "the connector that it is about", |e| e.connector)
        .label("reason", "why, of vetoes", reasons, |e| {
            e.reason.as_ref().map_or(0, |reason| label_index(&VetoReason::ALL, reason) + 1)
        })
        .u32("obstacle", "the obstacle", |e| e.obstacle)
        .f64("value", "meters, radians or a number, by event", |e| e.value)
        .u32("missing", "parts missing in a gap that is too long; else 0", |e| e.missing)
}

/// Rows waiting to be recorded.
#[derive(Debug, Default)]
pub(super) struct RecordBuffers {
    record: RecordSection,
    trajectories: TableRowsBuffer<PositionRow>,
    joints: TableRowsBuffer<JointRow>,
    joint_names: JointNames,
    robots: TableRowsBuffer<PositionRow>,
    movers: TableRowsBuffer<PositionRow>,
    events: TableRowsBuffer<Event>,
}

impl RecordBuffers {
    /// Returns no rows yet; later they hold the tables in `record`.
    pub(super) fn new(record: RecordSection) -> Self {
        Self { record, ..Self::default() }
    }

    /// Returns the number of cycles from one recorded cycle to the next.
    pub(super) fn recording_interval(&self) -> Cycle {
        self.record.every
    }

    /// Returns whether controls from outside of the run are to be kept.
    pub(super) fn records_controls(&self) -> bool {
        self.record.controls
    }

    /// Starts to keep rows, for those tables that will have some.
    pub(super) fn start<const D: usize>(&mut self, world: &ChainWorld<D>) {
        let record = self.record;
        let has_arms = world.chains.iter().any(|spec| spec.arm.is_some());
        let has_movers = !world.movers.is_empty();
        self.trajectories.set_table(record.trajectories.then(|| trajectories_table(D)));
        self.joint_names = JointNames::from_world(world);
        let names = self.joint_names.names.clone();
        self.joints.set_table((record.joints && has_arms).then(|| joints_table(names)));
        self.robots.set_table((record.robots && world.has_robots()).then(robots_table));
        self.movers.set_table((record.movers && has_movers).then(|| movers_table(D)));
        self.events.set_table(record.events.then(events_table));
    }

    /// Keeps the positions of everything at the start of cycle `now`.
    pub(super) fn record_positions<const D: usize>(
        &mut self,
        world: &ChainWorld<D>,
        state: &ChainWorldState<D>,
        now: Cycle,
    ) {
        if !now.is_multiple_of(self.record.every) {
            return;
        }
        if self.trajectories.is_enabled() {
            // Positions are read in each cycle that is recorded.
            state.apply_deferred_motions();
            for slot in 0..state.len() {
                self.trajectories.extend(connector_rows(
                    now,
                    slot,
                    state.body(slot).chain.points(),
                ));
            }
        }
        if self.joints.is_enabled() {
            for slot in 0..state.len() {
                let body = state.body(slot);
                let chain = slot as EntityId;
                let names = self.joint_names.of_chains[slot].iter();
                let values = body.joints.iter().flatten().zip(names);
                for (joint, (&value, &name)) in (0..).zip(values) {
                    self.joints.push(JointRow { cycle: now, chain, joint, name, value });
                }
            }
        }
        if self.robots.is_enabled() {
            for slot in 0..state.len() {
                for (id, robot) in (0..).zip(&state.body(slot).robots) {
                    let Pose2 { at: [x, y], heading_rad } = robot.pose;
                    let at = [x, y, heading_rad];
                    self.robots.push(PositionRow { cycle: now, chain: slot as EntityId, id, at });
                }
            }
        }
        if self.movers.is_enabled() {
            for mover in world.movers.at(world.cycle_start_time_s(now)) {
                let at = convert_dimensions(middle(&mover.core));
                self.movers.push(PositionRow { cycle: now, chain: 0, id: mover.id, at });
            }
        }
    }

    pub(super) fn add_event(&mut self, event: Event) {
        self.events.push(event);
    }
}

fn connector_rows<const D: usize>(
    cycle: Cycle,
    slot: usize,
    points: &[Point<D>],
) -> impl Iterator<Item = PositionRow> {
    let chain = slot as EntityId;
    (0..).zip(points).map(move |(id, at)| PositionRow {
        cycle,
        chain,
        id,
        at: convert_dimensions(*at),
    })
}

/// Returns a point of a core that moves with it.
fn middle<const D: usize>(core: &ConvexCore<D>) -> [f64; D] {
    match core {
        ConvexCore::Point(c) => *c,
        ConvexCore::Segment([a, b]) => std::array::from_fn(|i| 0.5 * (a[i] + b[i])),
        ConvexCore::Cuboid(cuboid) => cuboid.center,
    }
}

impl TableBuffers for RecordBuffers {
    fn table_buffers(&self) -> Vec<&dyn TableBuffer> {
        vec![&self.trajectories, &self.joints, &self.robots, &self.movers, &self.events]
    }

    fn table_buffers_mut(&mut self) -> Vec<&mut dyn TableBuffer> {
        vec![
            &mut self.trajectories,
            &mut self.joints,
            &mut self.robots,
            &mut self.movers,
            &mut self.events,
        ]
    }
}
