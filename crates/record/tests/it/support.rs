//! A small world's table and its rows.

use std::path::Path;

use sidestep_kernel::ports::{ColumnSpec, ColumnType, ColumnValues, TableSchema};
use sidestep_record::{CycleOrigin, NewRun, ParquetRecorder, Provenance};

/// A column without a meaning.
pub(crate) fn column(name: &str, ty: ColumnType, labels: &[&str]) -> ColumnSpec {
    let labels = labels.iter().map(ToString::to_string).collect();
    ColumnSpec { labels, ..ColumnSpec::new(name, ty, &format!("the {name}")) }
}

/// The places of two robots in every cycle.
pub(crate) fn trajectories() -> TableSchema {
    TableSchema::new(
        "trajectories",
        vec![
            column("cycle", ColumnType::U64, &[]),
            column("robot", ColumnType::U32, &[]),
            column("col", ColumnType::I32, &[]),
            column("x_m", ColumnType::F64, &[]),
            column("heading", ColumnType::Label, &["east", "north", "west", "south"]),
        ],
    )
}

/// The rows of the cycles from `from` to before `to`, robot after robot.
pub(crate) fn rows(from: u64, to: u64) -> Vec<ColumnValues> {
    let rows = || (0..2).flat_map(move |robot| (from..to).map(move |cycle| (robot, cycle)));
    vec![
        ColumnValues::U64(rows().map(|(_, c)| c).collect()),
        ColumnValues::U32(rows().map(|(r, _)| r).collect()),
        ColumnValues::I32(rows().map(|(r, c)| (c % 7) as i32 - 3 * r as i32).collect()),
        ColumnValues::F64(rows().map(|(r, c)| c as f64 * 0.1 - f64::from(r)).collect()),
        ColumnValues::Label(rows().map(|(r, c)| ((c / 5) as u32 % 4) ^ r).collect()),
    ]
}

/// `blocks` put behind each other.
pub(crate) fn joined(blocks: &[Vec<ColumnValues>]) -> Vec<ColumnValues> {
    let mut all: Vec<_> = blocks[0].iter().map(|v| ColumnValues::empty(v.column_type())).collect();
    for block in blocks {
        all.iter_mut().zip(block).for_each(|(column, values)| column.append(values));
    }
    all
}

/// The origin of every run in these tests.
pub(crate) fn origin() -> Provenance {
    Provenance { program_version: "0.1.0".into(), scenario: "[world]\n".into(), seed: u64::MAX }
}

/// A run to make a folder for.
pub(crate) fn new_run() -> NewRun {
    NewRun {
        world: "robots".into(),
        build: "0.1.0+a".into(),
        origin: origin(),
        cycles_planned: 100,
        cycle_origin: CycleOrigin::Simulated,
        mcap: None,
        series_every: 0,
    }
}

/// A recorder of [`trajectories`] in `folder`.
pub(crate) fn recorder(folder: &Path) -> ParquetRecorder {
    ParquetRecorder::create(folder, &[trajectories()], &origin()).unwrap()
}

/// The names in a folder, sorted.
pub(crate) fn names(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).unwrap();
    let mut names: Vec<_> =
        entries.map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}
