//! What a run records: tables, and their rows until they are recorded.

use super::decide::Optimization;
use super::events::{Event, EventKind};
use super::flight::Pose;
use super::scenario::RecordSection;
use sidestep_kernel::ports::{ColumnSpec, ColumnType, RecordError, Recorder, TableSchema, Values};
use sidestep_kernel::{Cycle, EntityId};

/// Rows kept at most before they must be recorded.
const MAX_ROWS: usize = 1 << 20;

/// Tables of an airspace run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Table {
    /// A row per airplane and cycle.
    Trajectories,
    /// A row per event.
    Events,
    /// A row per optimization.
    Optimizations,
}

impl Table {
    pub(super) const ALL: [Self; 3] = [Self::Trajectories, Self::Events, Self::Optimizations];

    fn schema(self) -> TableSchema {
        let column = |name: &str, ty, meaning: &str| ColumnSpec {
            name: name.into(),
            ty,
            meaning: meaning.into(),
            labels: Vec::new(),
        };
        let labels = |name: &str, meaning: &str, labels: Vec<String>| ColumnSpec {
            labels,
            ..column(name, ColumnType::Label, meaning)
        };
        let (name, columns) = match self {
            Self::Trajectories => (
                "trajectories",
                vec![
                    column("cycle", ColumnType::U64, "cycle of dt at whose start this holds"),
                    column("airplane", ColumnType::U32, "entity id"),
                    column("x_m", ColumnType::F64, "position east"),
                    column("y_m", ColumnType::F64, "position north"),
                    column("heading_rad", ColumnType::F64, "heading, counter-clockwise from east"),
                ],
            ),
            Self::Events => (
                "events",
                vec![
                    column("cycle", ColumnType::U64, "cycle of dt in which it happened"),
                    labels(
                        "event",
                        "what happened",
                        EventKind::ALL.iter().map(|kind| kind.name().into()).collect(),
                    ),
                    column("airplane", ColumnType::U32, "entity id"),
                    column("other", ColumnType::U32, "the other airplane, or the same"),
                    column("value", ColumnType::F64, "metres, seconds or a number, by event"),
                ],
            ),
            Self::Optimizations => (
                "optimizations",
                vec![
                    column("cycle", ColumnType::U64, "cycle of dt before which it was made"),
                    column("airplane", ColumnType::U32, "smallest entity id of the group"),
                    column("airplanes", ColumnType::U32, "members of the group"),
                    column("rounds", ColumnType::U32, "rounds made"),
                    labels(
                        "converged",
                        "whether the distributions had settled",
                        ["no", "yes"].map(String::from).to_vec(),
                    ),
                    column("messages", ColumnType::U64, "messages, one per receiver"),
                    column("bytes", ColumnType::U64, "their bytes"),
                ],
            ),
        };
        TableSchema { name: name.into(), columns }
    }
}

/// Rows that wait for being recorded.
#[derive(Debug, Default)]
pub(super) struct Rows {
    record: RecordSection,
    /// The tables that are recorded at all, in the order of their numbers.
    tables: Vec<Table>,
    poses: Poses,
    events: Vec<Event>,
    optimizations: Vec<Optimization>,
}

#[derive(Debug, Default)]
struct Poses {
    cycle: Vec<u64>,
    airplane: Vec<u32>,
    x_m: Vec<f64>,
    y_m: Vec<f64>,
    heading_rad: Vec<f64>,
}

impl Rows {
    /// Nothing yet; later what `record` asks for.
    pub(super) fn new(record: RecordSection) -> Self {
        Self { record, ..Self::default() }
    }

    /// Begins to keep rows.
    pub(super) fn begin(&mut self) {
        let record = &self.record;
        let asked = [record.trajectories, record.events, record.optimizations];
        let tables = Table::ALL.into_iter().zip(asked).filter(|(_, asked)| *asked);
        self.tables = tables.map(|(table, _)| table).collect();
    }

    /// Whether rows must be recorded before more can be kept.
    pub(super) fn is_full(&self) -> bool {
        self.poses.cycle.len() >= MAX_ROWS || self.events.len() >= MAX_ROWS
    }

    pub(super) fn pose(&mut self, cycle: Cycle, id: EntityId, pose: Pose) {
        if self.tables.contains(&Table::Trajectories) {
            self.poses.cycle.push(cycle);
            self.poses.airplane.push(id);
            self.poses.x_m.push(pose.at[0]);
            self.poses.y_m.push(pose.at[1]);
            self.poses.heading_rad.push(pose.heading_rad);
        }
    }

    pub(super) fn event(&mut self, event: Event) {
        if self.tables.contains(&Table::Events) {
            self.events.push(event);
        }
    }

    pub(super) fn optimization(&mut self, optimization: Optimization) {
        if self.tables.contains(&Table::Optimizations) {
            self.optimizations.push(optimization);
        }
    }

    pub(super) fn schemas(&self) -> Vec<TableSchema> {
        self.tables.iter().map(|table| table.schema()).collect()
    }

    pub(super) fn record(&mut self, recorder: &mut dyn Recorder) -> Result<(), RecordError> {
        for (number, table) in self.tables.clone().into_iter().enumerate() {
            recorder.append(number, &self.take(table))?;
        }
        Ok(())
    }

    fn take(&mut self, table: Table) -> Vec<Values> {
        match table {
            Table::Trajectories => {
                let Poses { cycle, airplane, x_m, y_m, heading_rad } =
                    std::mem::take(&mut self.poses);
                vec![
                    Values::U64(cycle),
                    Values::U32(airplane),
                    Values::F64(x_m),
                    Values::F64(y_m),
                    Values::F64(heading_rad),
                ]
            }
            Table::Events => {
                let rows = std::mem::take(&mut self.events);
                let number = |event: &Event| EventKind::ALL.iter().position(|k| *k == event.kind);
                vec![
                    Values::U64(rows.iter().map(|e| e.cycle).collect()),
                    Values::Label(rows.iter().map(|e| number(e).unwrap_or(0) as u32).collect()),
                    Values::U32(rows.iter().map(|e| e.airplane).collect()),
                    Values::U32(rows.iter().map(|e| e.other).collect()),
                    Values::F64(rows.iter().map(|e| e.value).collect()),
                ]
            }
            Table::Optimizations => {
                let rows = std::mem::take(&mut self.optimizations);
                vec![
                    Values::U64(rows.iter().map(|o| o.cycle).collect()),
                    Values::U32(rows.iter().map(|o| o.airplane).collect()),
                    Values::U32(rows.iter().map(|o| o.airplanes).collect()),
                    Values::U32(rows.iter().map(|o| o.rounds).collect()),
                    Values::Label(rows.iter().map(|o| u32::from(o.converged)).collect()),
                    Values::U64(rows.iter().map(|o| o.traffic.messages).collect()),
                    Values::U64(rows.iter().map(|o| o.traffic.bytes).collect()),
                ]
            }
        }
    }
}
