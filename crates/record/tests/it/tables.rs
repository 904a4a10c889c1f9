//! Rows come back as they were recorded, in one go or resumed.

use proptest::prelude::*;
use sidestep_kernel::ports::recorder::{check_conformance, conformance_test_schemas};
use sidestep_kernel::ports::{ColumnSpec, ColumnType, ColumnValues, Recorder, TableSchema};
use sidestep_record::{ParquetRecorder, read_table};

use crate::support::{column, joined, names, origin, recorder, rows, trajectories};

#[test]
fn the_parquet_recorder_conforms() {
    let folder = tempfile::tempdir().unwrap();
    let schemas = conformance_test_schemas();
    let recorder = ParquetRecorder::create(folder.path(), &schemas, &origin()).unwrap();
    check_conformance(recorder, |_| {
        let read = |s: &TableSchema| read_table(folder.path(), &s.name, ..).unwrap().columns;
        let tables: Vec<_> = schemas.iter().map(read).collect();
        Box::new(move |table, column| tables[table][column].clone())
    });
}

#[test]
fn a_table_comes_back_with_its_schema_and_origin() {
    let folder = tempfile::tempdir().unwrap();
    let mut recorder = recorder(folder.path());
    recorder.append(0, &rows(0, 40)).unwrap();
    recorder.finish().unwrap();
    let table = read_table(folder.path(), "trajectories", ..).unwrap();
    assert_eq!(table.schema, trajectories());
    assert_eq!(table.origin, origin());
    assert!(table.complete);
    assert_eq!(table.rows(), 80);
    assert_eq!(table.column("robot"), Some(&rows(0, 40)[1]));
    assert_eq!(table.column("mood"), None);
}

#[test]
fn a_table_without_rows_is_a_table() {
    let folder = tempfile::tempdir().unwrap();
    recorder(folder.path()).finish().unwrap();
    let table = read_table(folder.path(), "trajectories", ..).unwrap();
    assert_eq!((table.rows(), table.complete), (0, true));
}

#[test]
fn rows_are_chosen_by_cycle_across_parts_and_row_groups() {
    let folder = tempfile::tempdir().unwrap();
    let mut recorder = recorder(folder.path());
    recorder.append(0, &rows(0, 600_000)).unwrap();
    recorder.append(0, &rows(600_000, 600_100)).unwrap();
    recorder.make_durable(600_100).unwrap();
    recorder.append(0, &rows(600_100, 600_200)).unwrap();
    recorder.finish().unwrap();
    let read = |from, to| read_table(folder.path(), "trajectories", from..to).unwrap().columns;
    assert_eq!(read(7, 8), rows(7, 8));
    assert_eq!(read(600_099, 600_101), joined(&[rows(600_099, 600_100), rows(600_100, 600_101)]));
    assert_eq!(read(600_200, u64::MAX)[0], ColumnValues::U64(vec![].into()));
    let whole = read_table(folder.path(), "trajectories", ..).unwrap().columns;
    let blocks = [rows(0, 600_000), rows(600_000, 600_100), rows(600_100, 600_200)];
    assert!(whole == joined(&blocks), "every row comes back over page and row group borders");
}

#[test]
fn a_range_of_cycles_of_a_table_without_cycles_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let schema = TableSchema::new("robots", vec![column("size_m", ColumnType::F64, &[])]);
    let mut recorder = ParquetRecorder::create(folder.path(), &[schema], &origin()).unwrap();
    recorder.append(0, &[ColumnValues::F64(vec![f64::NAN, 0.5].into())]).unwrap();
    recorder.finish().unwrap();
    assert_eq!(read_table(folder.path(), "robots", ..).unwrap().rows(), 2);
    let error = read_table(folder.path(), "robots", 3..4).unwrap_err();
    assert!(error.cause().contains("no column `cycle`"), "{error}");
}

#[test]
fn a_recording_dropped_before_its_end_never_looks_whole() {
    let folder = tempfile::tempdir().unwrap();
    let mut recorder = recorder(folder.path());
    recorder.append(0, &rows(0, 600_000)).unwrap();
    drop(recorder);
    assert_eq!(names(folder.path()), ["trajectories.partial"]);
    let growing = folder.path().join("trajectories.partial");
    assert_eq!(names(&growing), ["part-000000000000000.parquet.partial"]);
    let error = read_table(folder.path(), "trajectories", ..).unwrap_err();
    assert!(error.cause().contains("no part"), "{error}");
}

#[test]
fn a_killed_recording_shows_its_sealed_rows_as_incomplete() {
    let folder = tempfile::tempdir().unwrap();
    let mut recorder = recorder(folder.path());
    recorder.append(0, &rows(0, 10)).unwrap();
    recorder.make_durable(10).unwrap();
    recorder.append(0, &rows(10, 15)).unwrap();
    drop(recorder);
    let table = read_table(folder.path(), "trajectories", ..).unwrap();
    assert_eq!((table.columns, table.complete), (rows(0, 10), false));
}

#[test]
fn a_resumed_recording_has_the_rows_of_one_in_one_go() {
    let folder = tempfile::tempdir().unwrap();
    let mut first = recorder(folder.path());
    first.append(0, &rows(0, 10)).unwrap();
    first.make_durable(10).unwrap();
    first.append(0, &rows(10, 20)).unwrap();
    // Sealed, but killed before the checkpoint at 20 was stored: back to 10.
    first.make_durable(20).unwrap();
    first.append(0, &rows(20, 25)).unwrap();
    drop(first);
    let mut second =
        ParquetRecorder::resume(folder.path(), &[trajectories()], &origin(), 10).unwrap();
    second.append(0, &rows(10, 20)).unwrap();
    second.make_durable(20).unwrap();
    second.append(0, &rows(20, 30)).unwrap();
    second.finish().unwrap();
    let table = read_table(folder.path(), "trajectories", ..).unwrap();
    assert_eq!(table.columns, joined(&[rows(0, 10), rows(10, 20), rows(20, 30)]));
    assert_eq!(names(&folder.path().join("trajectories")).len(), 3);
}

#[test]
fn a_run_killed_while_its_tables_were_finished_can_be_resumed() {
    let folder = tempfile::tempdir().unwrap();
    let mut first = recorder(folder.path());
    first.append(0, &rows(0, 10)).unwrap();
    first.make_durable(10).unwrap();
    first.append(0, &rows(10, 20)).unwrap();
    first.finish().unwrap();
    let mut second =
        ParquetRecorder::resume(folder.path(), &[trajectories()], &origin(), 10).unwrap();
    assert_eq!(names(folder.path()), ["trajectories.partial"]);
    second.append(0, &rows(10, 20)).unwrap();
    second.finish().unwrap();
    let table = read_table(folder.path(), "trajectories", ..).unwrap();
    assert_eq!(table.columns, joined(&[rows(0, 10), rows(10, 20)]));
}

#[test]
fn resuming_where_nothing_was_sealed_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let mut first = recorder(folder.path());
    first.append(0, &rows(0, 20)).unwrap();
    first.make_durable(20).unwrap();
    first.append(0, &rows(20, 30)).unwrap();
    first.make_durable(30).unwrap();
    drop(first);
    let resume =
        |cycle| ParquetRecorder::resume(folder.path(), &[trajectories()], &origin(), cycle);
    assert!(resume(10).err().unwrap().to_string().contains("not sealed at cycle 10"));
    assert!(resume(30).is_ok(), "the refusal deleted nothing");
    let table = read_table(folder.path(), "trajectories", ..).unwrap();
    assert_eq!(table.columns, joined(&[rows(0, 20), rows(20, 30)]));
    assert!(resume(20).is_ok());
}

#[test]
fn a_table_that_is_there_is_not_written_over() {
    let folder = tempfile::tempdir().unwrap();
    recorder(folder.path()).finish().unwrap();
    let again = ParquetRecorder::create(folder.path(), &[trajectories()], &origin());
    assert!(again.err().unwrap().to_string().contains("there already"));
}

#[test]
fn rows_after_the_end_and_cycles_sealed_twice_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let mut recorder = recorder(folder.path());
    recorder.append(0, &rows(0, 10)).unwrap();
    recorder.make_durable(10).unwrap();
    recorder.finish().unwrap();
    assert!(recorder.append(0, &rows(10, 20)).is_err());

    let folder = tempfile::tempdir().unwrap();
    let mut recorder = crate::support::recorder(folder.path());
    recorder.append(0, &rows(0, 10)).unwrap();
    recorder.make_durable(0).unwrap();
    recorder.append(0, &rows(10, 20)).unwrap();
    assert!(recorder.make_durable(20).unwrap_err().to_string().contains("sealed at this cycle"));
    assert!(recorder.finish().unwrap_err().to_string().contains("stopped earlier"));
}

/// Blocks of columns of every type, of the lengths given, with runs, steps and extremes.
fn blocks() -> impl Strategy<Value = Vec<Vec<ColumnValues>>> {
    let value = prop_oneof![
        4 => (0..4_u64).boxed(),
        2 => Just(1_000_000_u64).boxed(),
        1 => any::<u64>().boxed(),
        1 => Just(u64::MAX).boxed(),
        1 => Just(u64::MAX / 2 + 1).boxed(),
    ];
    let run = (value, 1..200_usize, 0..3_u64);
    let runs = proptest::collection::vec(run, 0..12).prop_map(|runs| {
        let run = |(value, n, step): (u64, usize, u64)| {
            (0..n as u64).map(move |i| value.wrapping_add(i.wrapping_mul(step)))
        };
        block(&runs.into_iter().flat_map(run).collect::<Vec<_>>())
    });
    proptest::collection::vec(runs, 1..5)
}

fn block(values: &[u64]) -> Vec<ColumnValues> {
    vec![
        ColumnValues::U64(values.to_vec().into()),
        ColumnValues::U32(values.iter().map(|&v| v as u32).collect()),
        ColumnValues::I32(values.iter().map(|&v| v as i32).collect()),
        ColumnValues::Label(values.iter().map(|&v| (v % 5) as u32).collect()),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn any_values_in_any_blocks_come_back(blocks in blocks()) {
        let schema = TableSchema::new("t", vec![
                column("count", ColumnType::U64, &[]),
                column("id", ColumnType::U32, &[]),
                column("delta", ColumnType::I32, &[]),
                column("event", ColumnType::Label, &["a", "b", "", "ü", "e e"]),
            ]);
        let folder = tempfile::tempdir().unwrap();
        let mut recorder = ParquetRecorder::create(folder.path(), &[schema], &origin()).unwrap();
        for block in &blocks {
            recorder.append(0, block).unwrap();
        }
        recorder.finish().unwrap();
        prop_assert_eq!(read_table(folder.path(), "t", ..).unwrap().columns, joined(&blocks));
    }
}

/// Columns of every type with `rows` rows; one in every `missing` values is missing.
fn every_type(rows: u64, missing: u64) -> (TableSchema, Vec<ColumnValues>) {
    let value = |k: u64| (missing > rows || k % missing != 1).then_some(k);
    let all = || (0..rows).map(value);
    let blocks = vec![
        ColumnValues::U32(all().map(|v| v.map(|k| k as u32)).collect()),
        ColumnValues::U64(all().collect()),
        ColumnValues::I32(all().map(|v| v.map(|k| -(k as i32))).collect()),
        ColumnValues::I64(all().map(|v| v.map(|k| i64::MIN + k as i64)).collect()),
        ColumnValues::F64(all().map(|v| v.map(|k| k as f64 / 3.0)).collect()),
        ColumnValues::Bool(all().map(|v| v.map(|k| k % 3 == 0)).collect()),
        ColumnValues::Label(all().map(|v| v.map(|k| (k / 9 % 2) as u32)).collect()),
        ColumnValues::Text(all().map(|v| v.map(|k| format!("a{}", k % 7))).collect()),
    ];
    let spec = |values: &ColumnValues| {
        let labels =
            if values.column_type() == ColumnType::Label { &["no", "yes"][..] } else { &[] };
        let spec = column(values.column_type().name(), values.column_type(), labels);
        ColumnSpec { is_nullable: missing <= rows, ..spec }
    };
    (TableSchema::new("t", blocks.iter().map(spec).collect()), blocks)
}

#[test]
fn columns_of_every_type_come_back_also_where_values_are_missing() {
    // One page, several ones, none missing, all but the first missing.
    for (rows, missing) in [(100, 7), (70_000, 5), (70_000, 70_001), (2, 2)] {
        let (schema, block) = every_type(rows, missing);
        let folder = tempfile::tempdir().unwrap();
        let mut recorder =
            ParquetRecorder::create(folder.path(), std::slice::from_ref(&schema), &origin())
                .unwrap();
        recorder.append(0, &block).unwrap();
        recorder.append(0, &block).unwrap();
        recorder.finish().unwrap();
        let table = read_table(folder.path(), "t", ..).unwrap();
        assert_eq!(table.schema, schema);
        assert_eq!(table.columns, joined(&[block.clone(), block]), "{rows} rows");
    }
}
