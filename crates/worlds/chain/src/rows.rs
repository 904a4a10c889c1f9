//! What a run records: tables, and their rows until they are recorded.

use super::events::{Event, EventKind};
use super::geometry::{Core, Point};
use super::state::ChainState;
use super::swarm::drive::Pose;
use super::veto::Reason;
use super::world::ChainWorld;
use sidestep_kernel::ports::{ColumnSpec, ColumnType, RecordError, Recorder, TableSchema, Values};
use sidestep_kernel::{Cycle, EntityId};

/// Rows kept at most before they must be recorded.
const MAX_ROWS: usize = 1 << 20;
/// The number of an obstacle in an event that is about none.
const NO_OBSTACLE: u32 = u32::MAX;

/// Tables of a run of chains.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Table {
    /// A row per connector and recorded cycle.
    Trajectories,
    /// A row per robot of a swarm and recorded cycle.
    Robots,
    /// A row per obstacle that moves and recorded cycle.
    Movers,
    /// A row per event.
    Events,
}

fn column(name: &str, ty: ColumnType, meaning: &str) -> ColumnSpec {
    ColumnSpec { name: name.into(), ty, meaning: meaning.into(), labels: Vec::new() }
}

fn labels(name: &str, meaning: &str, labels: Vec<String>) -> ColumnSpec {
    ColumnSpec { labels, ..column(name, ColumnType::Label, meaning) }
}

const AXES: [&str; 3] = ["x_m", "y_m", "z_m"];

fn axes(n: usize) -> impl Iterator<Item = ColumnSpec> {
    let names = AXES.into_iter().take(n);
    names.map(|name| column(name, ColumnType::F64, "position"))
}

impl Table {
    pub(super) const ALL: [Self; 4] =
        [Self::Trajectories, Self::Robots, Self::Movers, Self::Events];

    fn schema(self, dimensions: usize) -> TableSchema {
        let at = || column("cycle", ColumnType::U64, "cycle of dt at whose start this holds");
        let chain = || column("chain", ColumnType::U32, "entity id");
        let (name, columns) = match self {
            Self::Trajectories => {
                let who = [at(), chain(), column("connector", ColumnType::U32, "its index")];
                ("trajectories", who.into_iter().chain(axes(dimensions)).collect())
            }
            Self::Robots => (
                "robots",
                vec![
                    at(),
                    chain(),
                    column("robot", ColumnType::U32, "the connector that it follows"),
                    column("x_m", ColumnType::F64, "position of the body"),
                    column("y_m", ColumnType::F64, "position of the body"),
                    column("heading_rad", ColumnType::F64, "counter-clockwise from x"),
                ],
            ),
            Self::Movers => {
                let who = [at(), column("obstacle", ColumnType::U32, "its number")];
                ("movers", who.into_iter().chain(axes(dimensions)).collect())
            }
            Self::Events => (
                "events",
                vec![
                    column("cycle", ColumnType::U64, "cycle of dt in which it happened"),
                    chain(),
                    labels(
                        "event",
                        "what happened",
                        EventKind::ALL.iter().map(|kind| kind.name().into()).collect(),
                    ),
                    column("connector", ColumnType::U32, "the connector that it is about"),
                    labels("reason", "why, of vetoes", reasons()),
                    column("obstacle", ColumnType::U32, "the obstacle; 4294967295 for none"),
                    column("value", ColumnType::F64, "meters, radians or a number, by event"),
                ],
            ),
        };
        TableSchema { name: name.into(), columns }
    }
}

/// Labels of the column `reason`: first that of events without one.
fn reasons() -> Vec<String> {
    let names = Reason::ALL.iter().map(|reason| reason.name().into());
    std::iter::once("none".to_string()).chain(names).collect()
}

/// Rows that wait for being recorded.
#[derive(Debug, Default)]
pub(super) struct Rows {
    /// Every how many cycles places are kept, and the tables that will be recorded.
    asked: (Cycle, Vec<Table>),
    dimensions: usize,
    /// The tables that are recorded at all, in the order of their numbers.
    tables: Vec<Table>,
    trajectories: Places,
    robots: Places,
    movers: Places,
    events: Vec<Event>,
}

/// Rows of who is where.
#[derive(Debug, Default)]
struct Places {
    cycle: Vec<u64>,
    who: [Vec<u32>; 2],
    at: [Vec<f64>; 3],
}

impl Places {
    fn push(&mut self, cycle: Cycle, who: [u32; 2], at: &[f64]) {
        self.cycle.push(cycle);
        for (column, id) in self.who.iter_mut().zip(who) {
            column.push(id);
        }
        for (column, &x) in self.at.iter_mut().zip(at) {
            column.push(x);
        }
    }

    /// Its columns; `who` of the two ids stand in the table.
    fn take(&mut self, who: std::ops::Range<usize>, dimensions: usize) -> Vec<Values> {
        let Self { cycle, who: ids, at } = std::mem::take(self);
        let ids = ids.into_iter().skip(who.start).take(who.len()).map(Values::U32);
        let at = at.into_iter().take(dimensions).map(Values::F64);
        std::iter::once(Values::U64(cycle)).chain(ids).chain(at).collect()
    }
}

impl Rows {
    /// Nothing yet; later rows of these tables, of places every so many cycles.
    pub(super) fn new(asked: (Cycle, Vec<Table>)) -> Self {
        Self { asked, ..Self::default() }
    }

    /// Every how many cycles places are kept.
    pub(super) fn every(&self) -> Cycle {
        self.asked.0
    }

    /// Begins to keep rows.
    pub(super) fn begin(&mut self, dimensions: usize) {
        self.dimensions = dimensions;
        self.tables = self.asked.1.clone();
    }

    /// Keeps where everything is at the start of cycle `now`.
    pub(super) fn places<const D: usize>(
        &mut self,
        world: &ChainWorld<D>,
        state: &ChainState<D>,
        now: Cycle,
    ) {
        if self.tables.is_empty() || !now.is_multiple_of(self.asked.0) {
            return;
        }
        if self.keeps(Table::Trajectories) {
            for slot in 0..state.len() {
                self.connectors(now, slot as EntityId, state.body(slot).chain.points());
            }
        }
        if self.keeps(Table::Robots) {
            for slot in 0..state.len() {
                for (k, robot) in (0..).zip(&state.body(slot).robots) {
                    let Pose { at: [x, y], heading_rad } = robot.pose;
                    self.robot(now, slot as EntityId, k, [x, y, heading_rad]);
                }
            }
        }
        if self.keeps(Table::Movers) {
            for obstacle in world.movers.at(world.starts_s(now)) {
                self.mover(now, obstacle.id, middle(&obstacle.core));
            }
        }
    }

    /// Whether rows must be recorded before more can be kept.
    pub(super) fn is_full(&self) -> bool {
        let places = [&self.trajectories, &self.robots, &self.movers];
        places.iter().any(|p| p.cycle.len() >= MAX_ROWS) || self.events.len() >= MAX_ROWS
    }

    fn keeps(&self, table: Table) -> bool {
        self.tables.contains(&table)
    }

    fn connectors<const D: usize>(&mut self, cycle: Cycle, chain: EntityId, points: &[Point<D>]) {
        for (k, at) in (0..).zip(points) {
            self.trajectories.push(cycle, [chain, k], at);
        }
    }

    fn robot(&mut self, cycle: Cycle, chain: EntityId, robot: u32, pose: [f64; 3]) {
        self.robots.push(cycle, [chain, robot], &pose);
    }

    fn mover<const D: usize>(&mut self, cycle: Cycle, id: u32, at: Point<D>) {
        self.movers.push(cycle, [0, id], &at);
    }

    pub(super) fn event(&mut self, event: Event) {
        if self.keeps(Table::Events) {
            self.events.push(event);
        }
    }

    pub(super) fn schemas(&self) -> Vec<TableSchema> {
        self.tables.iter().map(|table| table.schema(self.dimensions)).collect()
    }

    pub(super) fn record(&mut self, recorder: &mut dyn Recorder) -> Result<(), RecordError> {
        for (number, table) in self.tables.clone().into_iter().enumerate() {
            let columns = self.take(table);
            recorder.append(number, &columns)?;
        }
        Ok(())
    }

    fn take(&mut self, table: Table) -> Vec<Values> {
        match table {
            Table::Trajectories => self.trajectories.take(0..2, self.dimensions),
            Table::Robots => self.robots.take(0..2, 3),
            Table::Movers => self.movers.take(1..2, self.dimensions),
            Table::Events => events(std::mem::take(&mut self.events)),
        }
    }
}

/// A point of a core that moves with it.
fn middle<const D: usize>(core: &Core<D>) -> [f64; D] {
    match core {
        Core::Point(c) => *c,
        Core::Segment([a, b]) => std::array::from_fn(|i| 0.5 * (a[i] + b[i])),
        Core::Cuboid(cuboid) => cuboid.center,
    }
}

fn events(rows: Vec<Event>) -> Vec<Values> {
    let label = |reason: Option<Reason>| {
        reason
            .and_then(|r| Reason::ALL.iter().position(|&all| all == r))
            .map_or(0, |k| k as u32 + 1)
    };
    let kind = |kind: EventKind| {
        EventKind::ALL.iter().position(|&all| all == kind).unwrap_or_default() as u32
    };
    vec![
        Values::U64(rows.iter().map(|e| e.cycle).collect()),
        Values::U32(rows.iter().map(|e| e.chain).collect()),
        Values::Label(rows.iter().map(|e| kind(e.kind)).collect()),
        Values::U32(rows.iter().map(|e| e.connector).collect()),
        Values::Label(rows.iter().map(|e| label(e.reason)).collect()),
        Values::U32(rows.iter().map(|e| e.obstacle.unwrap_or(NO_OBSTACLE)).collect()),
        Values::F64(rows.iter().map(|e| e.value).collect()),
    ]
}
