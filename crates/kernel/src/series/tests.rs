//! Tests of the metrics over time.

use super::*;
use serde_json::json;

#[derive(Serialize)]
struct SamplePart {
    lag_m: f64,
    hits: u64,
}

#[derive(Serialize)]
struct SampleMetrics {
    trips: u64,
    mean: Option<f64>,
    late: Option<u64>,
    sizes: Vec<u64>,
    given_up: Vec<SamplePart>,
    is_done: bool,
    word: &'static str,
    optimize_cpu_s: f64,
    part: Option<SamplePart>,
    #[serde(flatten)]
    rest: std::collections::BTreeMap<&'static str, i32>,
}

fn sample(trips: u64, mean: Option<f64>) -> SampleMetrics {
    SampleMetrics {
        trips,
        mean,
        late: mean.map(|_| 3),
        sizes: vec![1; trips as usize],
        given_up: (0..trips).map(|hits| SamplePart { lag_m: 0.5, hits }).collect(),
        is_done: trips > 1,
        word: "x",
        optimize_cpu_s: 0.1,
        part: Some(SamplePart { lag_m: f64::INFINITY, hits: trips }),
        rest: [("turn", -1)].into(),
    }
}

fn words(name: &str) -> &'static str {
    if name == "sizes_count" { "" } else { "a thing" }
}

#[test]
fn the_columns_are_the_same_whatever_the_metrics_are_when_recording_starts() {
    let schema = |metrics: &SampleMetrics| {
        let mut series = MetricSeries::default();
        series.start(SeriesInterval::every_cycles(1), metrics, words);
        series.schema().expect("rows")
    };
    let early = schema(&sample(0, None));
    assert_eq!(early, schema(&sample(2, Some(1.5))));
    let columns: Vec<_> = early.columns.iter().map(|c| (c.name.as_str(), c.ty)).collect();
    use ColumnType::{Bool, F64, I64, U64};
    let expected = [
        ("cycle", U64),
        ("trips", U64),
        ("mean", F64),
        ("late", F64),
        ("given_up_count", U64),
        ("is_done", Bool),
        ("part.lag_m", F64),
        ("part.hits", U64),
        ("turn", I64),
    ];
    assert_eq!(columns, expected);
    assert_eq!(early.columns[1].meaning, "a thing");
}

#[test]
fn rows_have_the_metrics_and_the_last_cycle_before_them() {
    let mut series = MetricSeries::default();
    series.start(SeriesInterval::every_cycles(5), &sample(0, None), words);
    series.push(5, &sample(2, Some(1.5)));
    series.push(10, &sample(3, None));
    let schema = series.schema().expect("rows");
    let block = series.take().expect("rows");
    crate::ports::recorder::check_block(&schema, &block).expect("fits");
    let rows: Vec<Vec<_>> =
        (0..2).map(|row| block.iter().map(|column| column.json(row)).collect()).collect();
    assert_eq!(json!(rows[0]), json!([4, 2, 1.5, 3.0, 2, true, null, 2, -1]));
    assert_eq!(json!(rows[1]), json!([9, 3, null, null, 3, true, null, 3, -1]));
    assert_eq!(series.row_count(), 0);
}

#[test]
fn without_an_interval_there_is_no_table() {
    let mut series = MetricSeries::default();
    series.start(SeriesInterval::NONE, &sample(0, None), words);
    assert_eq!((series.schema(), series.next_due(0)), (None, None));
}

/// Returns the numbers of cycles that have a row, up to `until`.
fn due(interval: SeriesInterval, until: Cycle) -> Vec<Cycle> {
    let next = |done: &Cycle| interval.next_due(*done).filter(|next| *next <= until);
    std::iter::successors(next(&0), next).collect()
}

#[test]
fn a_planned_run_has_at_most_a_thousand_rows_and_one_without_end_few() {
    for planned in [1, 7, 999, 1000, 1001, 4711, 10_000, 123_456] {
        let rows = due(SeriesInterval::from_planned_cycles(planned), planned).len() as Cycle;
        assert!(rows <= 1000 && rows >= planned.min(500), "{planned}: {rows}");
    }
    let endless = due(SeriesInterval::from_planned_cycles(Cycle::MAX), 1 << 30);
    assert!((10_000..20_000).contains(&endless.len()), "{}", endless.len());
    assert_eq!(endless[..3], [1, 2, 3]);
}

#[test]
fn the_cycles_with_rows_do_not_depend_on_where_a_run_was_interrupted() {
    let interval = SeriesInterval::from_planned_cycles(1700);
    let all = due(interval, 20_000);
    assert_eq!((all[0], all[999], all[1000]), (2, 2000, 2004));
    for done in 0..20_000 {
        let next = all.iter().find(|&&cycle| cycle > done).copied();
        assert_eq!(interval.next_due(done), next.or(interval.next_due(20_000 - 1)), "after {done}");
    }
}

#[test]
fn rows_as_numbers_have_the_cycles_done_and_no_number_for_what_is_missing() {
    let mut series = MetricSeries::default();
    series.start(SeriesInterval::every_cycles(5), &sample(0, None), words);
    series.push(5, &sample(1, None));
    series.push(10, &sample(2, Some(1.5)));
    let rows = series.take_rows();
    assert_eq!(rows.cycles_done, [5, 10]);
    let column = |name: &str| {
        let at = series.columns().iter().position(|column| column.name == name);
        &rows.columns[at.expect("a column")]
    };
    assert_eq!(*column("trips"), [1.0, 2.0]);
    assert!(column("mean")[0].is_nan() && column("mean")[1] == 1.5);
    assert_eq!(*column("is_done"), [0.0, 1.0]);
    assert!(rows.columns.len() == series.columns().len() && series.take_rows().is_empty());
    assert_eq!(rows.row(1).next(), Some(2.0));
}
