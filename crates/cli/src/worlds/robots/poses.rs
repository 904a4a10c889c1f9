//! Where every body is, and whether that is what was recorded.

use super::{Comparison, Said};
use crate::recorded::has_rows;
use serde_json::{Value, json};
use sidestep::kernel::ports::Values;
use sidestep::kernel::{InputError, Simulation};
use sidestep::worlds::robots::simulation::{HEADING_NAMES, RobotsSimulation};
use sidestep::worlds::robots::state::BodyRecord;
use sidestep_record::{Table, read_table};
use std::path::Path;

/// The table that holds poses.
pub(super) const TABLE: &str = "trajectories";

/// Every body by entity id.
pub(super) fn said(simulation: &RobotsSimulation) -> Said {
    let snapshot = simulation.snapshot();
    let bodies: Vec<Body<'_>> = snapshot
        .bodies
        .iter()
        .enumerate()
        .map(|(id, record)| Body { simulation, id: id as u32, record })
        .collect();
    let heading = "  body  kind        col_boxes  row_boxes  heading\n".to_string();
    let text = bodies.iter().fold(heading, |text, body| text + &body.row());
    Said { json: bodies.iter().map(Body::json).collect(), text }
}

struct Body<'a> {
    simulation: &'a RobotsSimulation,
    id: u32,
    record: &'a BodyRecord,
}

impl Body<'_> {
    fn kind(&self) -> &str {
        let world = self.simulation.world();
        &world.kinds[usize::from(world.type_of(self.id).kind)]
    }

    fn is_door(&self) -> bool {
        let world = self.simulation.world();
        world.is_door(self.id)
    }

    fn heading(&self) -> &'static str {
        HEADING_NAMES[usize::from(self.record.facing % 4)]
    }

    fn json(&self) -> Value {
        let (col, row) = self.record.at;
        let place = json!({
            "body": self.id, "kind": self.kind(), "col_boxes": col, "row_boxes": row,
        });
        let Value::Object(mut place) = place else { return place };
        match self.is_door() {
            true => place.insert("open".into(), (self.record.facing == 1).into()),
            false => place.insert("heading".into(), self.heading().into()),
        };
        Value::Object(place)
    }

    fn row(&self) -> String {
        let (col, row) = self.record.at;
        let look = match (self.is_door(), self.record.facing) {
            (true, 1) => "open",
            (true, _) => "closed",
            (false, _) => self.heading(),
        };
        format!("  {:<4}  {:<10}  {col:>9}  {row:>9}  {look}\n", self.id, self.kind())
    }
}

/// Compares the present poses with those recorded for the present cycle.
pub(super) fn compare(
    simulation: &RobotsSimulation,
    folder: &Path,
) -> Result<Comparison, InputError> {
    let cycle = simulation.cycle();
    if !has_rows(folder, TABLE) {
        return Ok(Comparison::NotRecorded);
    }
    let table = read_table(folder, TABLE, cycle..=cycle)?;
    let Some(recorded) = recorded(&table).filter(|rows| !rows.is_empty()) else {
        return Ok(Comparison::NotRecorded);
    };
    let now = simulation.snapshot();
    let differs = |row: &RecordedPose| {
        now.bodies
            .get(row.body as usize)
            .is_none_or(|b| b.at != row.at || u32::from(b.facing) != row.heading)
    };
    let different: Vec<u32> = recorded.iter().filter(|r| differs(r)).map(|r| r.body).collect();
    Ok(match different.is_empty() {
        true => Comparison::Equal(recorded.len()),
        false => Comparison::Different(different),
    })
}

/// One row of the table.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct RecordedPose {
    pub(super) cycle: u64,
    pub(super) body: u32,
    pub(super) at: (u32, u32),
    pub(super) heading: u32,
}

/// The rows of a table of trajectories; `None` for a table with other columns.
pub(super) fn recorded(table: &Table) -> Option<Vec<RecordedPose>> {
    let words = |name| match table.column(name)? {
        Values::U32(values) | Values::Label(values) => Some(values),
        _ => None,
    };
    let Values::U64(cycles) = table.column("cycle")? else { return None };
    let (bodies, cols, rows) = (words("body")?, words("col_boxes")?, words("row_boxes")?);
    let headings = words("heading")?;
    let row = |k: usize| RecordedPose {
        cycle: cycles[k],
        body: bodies[k],
        at: (cols[k], rows[k]),
        heading: headings[k],
    };
    Some((0..cycles.len()).map(row).collect())
}
