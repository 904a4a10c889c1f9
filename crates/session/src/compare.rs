//! Comparison of a state that was computed again with the recorded one.

use crate::Error;
use crate::run_tables::has_rows;
use sidestep_kernel::InputError;
use sidestep_kernel::Simulation;
use sidestep_kernel::ports::{ColumnValues, MemoryRecorder};
use sidestep_kernel::view::{BodyId, PositionTableColumns};
use sidestep_record::{Table, read_table};
use std::collections::BTreeMap;
use std::path::Path;

/// Returns the number of recorded poses of the present cycle that were compared; `again` is the
/// same run at its start. The rows of a cycle are recorded at its start, so a copy of the run
/// records them once more, with the same bits.
///
/// # Errors
/// When a pose differs, or the folder is damaged.
pub(crate) fn compare_poses(
    run: &dyn Simulation,
    mut again: Box<dyn Simulation>,
    folder: &Path,
) -> Result<usize, Error> {
    let cycle = run.cycle();
    let mut recorded: Vec<(PositionTableColumns, Table)> = Vec::new();
    for rows in run.position_columns().into_iter().filter(|rows| has_rows(folder, rows.table)) {
        let table = read_table(folder, rows.table, cycle..=cycle)?;
        if table.rows() > 0 {
            recorded.push((rows, table));
        }
    }
    if recorded.is_empty() {
        return Ok(0);
    }
    again.restore(&run.checkpoint()).map_err(|e| {
        InputError::new(folder.display(), e.to_string(), "this is a bug: please report it")
    })?;
    again.start_recording();
    let mut memory = MemoryRecorder::new(&again.schemas());
    again.advance(1);
    again.record(&mut memory)?;
    let mut different = Vec::new();
    for (rows, table) in &recorded {
        different.extend(differing_bodies(rows, table, &memory));
    }
    // A body may have rows in several tables.
    different.sort_unstable();
    different.dedup();
    if let Some(&first) = different.first() {
        return Err(pose_mismatch(cycle, different.len(), first));
    }
    Ok(recorded.iter().map(|(rows, table)| count_bodies(rows, table)).sum())
}

fn pose_mismatch(cycle: u64, bodies: usize, first: BodyId) -> Error {
    let cause = format!(
        "at cycle {cycle} the poses of {bodies} bodies differ from what was recorded, first of {first}"
    );
    let remedy = "the folder was changed, or this is a bug: please report it with the folder";
    Error::other(cause, remedy)
}

/// Returns the bodies with recorded rows that differ from the present ones.
fn differing_bodies(
    rows: &PositionTableColumns,
    table: &Table,
    present: &MemoryRecorder,
) -> Vec<BodyId> {
    let names: Vec<&str> = table.schema.columns.iter().map(|c| c.name.as_str()).collect();
    let recorded = bits_by_body(rows, &names, |name| table.column(name));
    let present = bits_by_body(rows, &names, |name| present.column(rows.table, name));
    let mut differing = Vec::new();
    for (body, bits) in recorded {
        if present.get(&body) != Some(&bits) {
            differing.push(body);
        }
    }
    differing
}

fn count_bodies(rows: &PositionTableColumns, table: &Table) -> usize {
    bits_by_body(rows, &[], |name| table.column(name)).len()
}

/// Returns the bits of all columns by body, so that missing values and negative zeros count, too.
fn bits_by_body<'a>(
    rows: &PositionTableColumns,
    names: &[&str],
    column: impl Fn(&str) -> Option<&'a ColumnValues>,
) -> BTreeMap<BodyId, Vec<u64>> {
    let columns: Vec<Option<&ColumnValues>> = names.iter().map(|name| column(name)).collect();
    let Some(numbers) = column(rows.number) else { return BTreeMap::new() };
    let parts = rows.part.and_then(&column);
    let mut all: BTreeMap<BodyId, Vec<u64>> = BTreeMap::new();
    for row in 0..numbers.len() {
        let number = bits(numbers, row) as u32;
        let part = parts.map(|parts| bits(parts, row) as u32);
        let body_bits = all.entry(BodyId::new(rows.kind, number, part)).or_default();
        for values in &columns {
            // A missing value has bits that differ from those of every other value.
            body_bits.extend(match values {
                Some(values) if !values.is_missing(row) => [1, bits(values, row)],
                _ => [0, 0],
            });
        }
    }
    all
}

/// Returns the bits of a value that is no text.
pub(crate) fn bits(values: &ColumnValues, row: usize) -> u64 {
    match values {
        ColumnValues::Text(_) => 0,
        ColumnValues::I64(v) => v[row] as u64,
        ColumnValues::Bool(v) => v[row].into(),
        ColumnValues::U32(v) | ColumnValues::Label(v) => v[row].into(),
        ColumnValues::U64(v) => v[row],
        ColumnValues::I32(v) => v[row] as u64,
        ColumnValues::F64(v) => v[row].to_bits(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sidestep_kernel::view::CoordinateColumn;
    use sidestep_robots::kinds::ROBOT;

    #[test]
    fn one_changed_cell_is_found() {
        let rows = PositionTableColumns {
            table: "trajectories",
            kind: ROBOT,
            number: "chain",
            part: Some("connector"),
            axes: vec![CoordinateColumn::meters("x_m")],
            plane: None,
            is_corner: false,
            heading: None,
            interval: 1,
            history: 1,
        };
        let column = |name: &str, x: f64| match name {
            "x_m" => ColumnValues::F64(vec![1.5, x].into()),
            "chain" => ColumnValues::U32(vec![0, 0].into()),
            _ => ColumnValues::U32(vec![3, 4].into()),
        };
        let names = ["chain", "connector", "x_m"];
        let table = |x| names.map(|name| (name, column(name, x)));
        let bodies = |x| {
            let table: &'static _ = Box::leak(Box::new(table(x)));
            bits_by_body(&rows, &names, |name| {
                table.iter().find(|(n, _)| *n == name).map(|(_, v)| v)
            })
        };
        let (was, is) = (bodies(2.0), bodies(2.0 + f64::EPSILON * 2.0));
        assert_eq!(was, bodies(2.0));
        let same = |of: &BodyId| was[of] == is[of];
        assert!(same(&BodyId::new(ROBOT, 0, Some(3))) && !same(&BodyId::new(ROBOT, 0, Some(4))));
    }
}
