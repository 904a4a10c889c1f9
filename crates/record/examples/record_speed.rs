//! The cost of recording: CPU time and bytes for a row of robots' trajectories.
//!
//! `cargo run --release -p sidestep-record --example record_speed -- [ROBOTS] [CYCLES_PER_BLOCK]`
//!
//! Robots walk at random on a grid and pass on blocks of `CYCLES_PER_BLOCK` cycles, one robot after
//! another, as a world does.

use cpu_time::ProcessTime;
use sidestep_kernel::ports::{ColumnSpec, ColumnType, ColumnValues, Recorder, TableSchema};
use sidestep_record::{ParquetRecorder, Provenance};

const ROWS: usize = 8_000_000;

fn main() {
    let mut arguments = std::env::args().skip(1).map(|a| a.parse::<u64>().expect("a number"));
    let robots = arguments.next().unwrap_or(1000) as u32;
    let cycles = arguments.next().unwrap_or(256);
    let blocks = walk(robots, cycles);
    let rows: usize = blocks.iter().map(|b| b[0].len()).sum();

    let folder = tempfile::tempdir().expect("a temporary folder");
    let origin = Provenance { program_version: "0".into(), scenario: String::new(), seed: 1 };
    let mut recorder =
        ParquetRecorder::create(folder.path(), &[schema()], &origin).expect("a new run");
    let start = ProcessTime::now();
    for block in &blocks {
        recorder.append(0, block).expect("recorded");
    }
    recorder.finish().expect("finished");
    let ns = start.elapsed().as_nanos() as f64;

    let part = folder.path().join("trajectories/part-000000000000000.parquet");
    let bytes = part.metadata().expect("a file").len() as f64;
    let row_ns = ns / rows as f64;
    let row_bytes = bytes / rows as f64;
    println!(
        "{robots} robots, blocks of {cycles} cycles: {row_ns:.1} ns and {row_bytes:.2} bytes a row"
    );
    if let Ok(copy) = std::env::var("KEEP") {
        std::fs::copy(part, copy).expect("copied");
    }
}

fn schema() -> TableSchema {
    let column = |name: &str, ty| ColumnSpec::new(name, ty, "");
    TableSchema::new(
        "trajectories",
        vec![
            column("cycle", ColumnType::U64),
            column("robot", ColumnType::U32),
            column("col", ColumnType::U32),
            column("row", ColumnType::U32),
            ColumnSpec::label("heading", "", ["east", "north", "west", "south"]),
        ],
    )
}

/// A robot: column, row, heading.
type Robot = (u32, u32, u32);

fn walk(robots: u32, cycles: u64) -> Vec<Vec<ColumnValues>> {
    let mut random = 88_172_645_463_325_252;
    let mut next = move || {
        random ^= random << 13;
        random ^= random >> 7;
        random ^= random << 17;
        random
    };
    let mut team: Vec<Robot> = (0..robots)
        .map(|_| (2000 + next() as u32 % 1000, 2000 + next() as u32 % 1000, 0))
        .collect();
    let rows = team.len() * cycles as usize;
    (0..ROWS.div_ceil(rows) as u64)
        .map(|b| block(&mut team, b * cycles, cycles, &mut next))
        .collect()
}

fn block(
    team: &mut [Robot],
    first: u64,
    cycles: u64,
    next: &mut impl FnMut() -> u64,
) -> Vec<ColumnValues> {
    let (mut cycle, mut robot, mut col, mut row, mut heading) =
        (vec![], vec![], vec![], vec![], vec![]);
    for (r, state) in team.iter_mut().enumerate() {
        for c in first..first + cycles {
            step(state, next() % 10);
            cycle.push(c);
            robot.push(r as u32);
            col.push(state.0);
            row.push(state.1);
            heading.push(state.2);
        }
    }
    vec![
        ColumnValues::U64(cycle.into()),
        ColumnValues::U32(robot.into()),
        ColumnValues::U32(col.into()),
        ColumnValues::U32(row.into()),
        ColumnValues::Label(heading.into()),
    ]
}

/// Turns left once in ten cycles, walks in six, stays in three.
fn step((col, row, heading): &mut Robot, draw: u64) {
    match (draw, *heading) {
        (0, h) => *heading = (h + 1) % 4,
        (1..7, 0) => *col += 1,
        (1..7, 1) => *row += 1,
        (1..7, 2) => *col = col.saturating_sub(1),
        (1..7, _) => *row = row.saturating_sub(1),
        _ => {}
    }
}
