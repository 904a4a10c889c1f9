//! Frames of a run as rows of a table, one for each body.

use super::FrameSink;
use crate::Error;
use sidestep_kernel::ports::table::label_index;
use sidestep_kernel::ports::{ColumnValues, Table, TableSchema};
use sidestep_kernel::view::{Body, BodyCondition, Frame, FrameOptions, Kinds};
use sidestep_kernel::{Cycle, Simulation};
use std::ops::Range;

/// Name that [`RowSelection::frames`](crate::RowSelection) promises, beside the tables of the world.
const FRAMES_TABLE: &str = "frames";

/// A body at a moment: frames of a run have different bodies, so each one is a row.
struct Row {
    cycle: Cycle,
    time_s: f64,
    body: Body,
}

/// Frames kept in memory: the first one, then those at multiples of a number of cycles, and the last one of a run that
/// is over.
pub(crate) struct FrameRows {
    every: Cycle,
    /// The kinds of bodies, which label the rows.
    kinds: Kinds,
    /// The cycle of the first frame.
    first: Option<Cycle>,
    /// The cycle of the last frame, so that none is taken twice.
    last: Option<Cycle>,
    rows: Vec<Row>,
}

impl FrameRows {
    /// Returns a store of frames that are taken every `every` cycles.
    pub(crate) fn new(every: Cycle, kinds: Kinds) -> Self {
        Self { every: every.max(1), kinds, first: None, last: None, rows: Vec::new() }
    }

    pub(crate) fn take(&mut self) -> (TableSchema, Vec<ColumnValues>) {
        let table = frames_table(&self.kinds);
        let rows = std::mem::take(&mut self.rows);
        (table.schema(), table.block_from_rows(&rows))
    }

    /// Keeps only the frames of these cycles: the run is back at their end.
    pub(crate) fn rewind(&mut self, kept: Range<Cycle>) {
        self.rows.retain(|row| kept.contains(&row.cycle));
        self.first = self.first.filter(|&first| first < kept.end);
        // Any earlier frame will do: none is taken twice.
        self.last = self.first;
    }

    fn is_due(&self, run: &dyn Simulation) -> bool {
        let cycle = run.cycle();
        let is_wanted = self.last.is_none() || cycle.is_multiple_of(self.every) || run.is_over();
        is_wanted && self.last != Some(cycle)
    }
}

impl FrameSink for FrameRows {
    fn interval(&self) -> Cycle {
        self.every
    }

    fn capture(&mut self, run: &mut dyn Simulation) -> Result<(), Error> {
        // Each call that advances a run begins with a frame, so one that advances it in small steps gives more frames
        // than are due.
        if self.is_due(run) {
            self.last = Some(run.cycle());
            self.first = self.first.or(self.last);
            self.rows.extend(body_rows(run.frame(FrameOptions::WITHOUT_SCANS)));
        }
        Ok(())
    }
}

/// Returns the present frame of a run as a table, in which these are all kinds of bodies.
pub(crate) fn frame_rows(
    run: &mut dyn Simulation,
    kinds: &Kinds,
) -> (TableSchema, Vec<ColumnValues>) {
    let table = frames_table(kinds);
    let rows: Vec<Row> = body_rows(run.frame(FrameOptions::WITHOUT_SCANS)).collect();
    (table.schema(), table.block_from_rows(&rows))
}

fn body_rows(frame: Frame) -> impl Iterator<Item = Row> {
    let Frame { cycle, time_s, bodies, .. } = frame;
    bodies.into_iter().map(move |body| Row { cycle, time_s, body })
}

fn frames_table(kinds: &Kinds) -> Table<Row> {
    // The labels are the kinds of the program, not only those of the run's world, so that tables of all its runs have the
    // same schema.
    let labels = kinds.names();
    let kinds = kinds.clone();
    Table::new(FRAMES_TABLE)
        .u64("cycle", "cycles done: the frame shows the start of this cycle", |row: &Row| row.cycle)
        .f64("time_s", "simulated time since the start", |row| row.time_s)
        .label("kind", "kind of the body", labels, move |row| {
            label_index(kinds.as_slice(), &row.body.kind)
        })
        .u32("number", "its number among the bodies of its kind", |row| row.body.number)
        .u32("part", "its part, where the thing has parts", |row| row.body.part)
        .f64("x_m", "its place, east", |row| row.body.pose.at_m[0])
        .f64("y_m", "its place, north", |row| row.body.pose.at_m[1])
        .f64("z_m", "its place, up", |row| row.body.pose.at_m[2])
        .f64("turn_x", "its orientation, a unit quaternion: x", |row| row.body.pose.turn[0])
        .f64("turn_y", "its orientation: y", |row| row.body.pose.turn[1])
        .f64("turn_z", "its orientation: z", |row| row.body.pose.turn[2])
        .f64("turn_w", "its orientation: w", |row| row.body.pose.turn[3])
        .f64("velocity_x_m_s", "velocity, east, of a thing that is moved without acting", |row| {
            row.body.velocity_m_s[0]
        })
        .f64("velocity_y_m_s", "the same, north", |row| row.body.velocity_m_s[1])
        .f64("velocity_z_m_s", "the same, up", |row| row.body.velocity_m_s[2])
        .label("condition", "its condition", BodyCondition::ALL.map(BodyCondition::name), |row| {
            label_index(&BodyCondition::ALL, &row.body.state)
        })
}
