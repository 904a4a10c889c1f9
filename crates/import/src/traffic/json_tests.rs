//! JSON that is broken here and there, or made to take memory, and what is read of it.

use super::tests::finding;
use super::{RecordedTraffic, parse};
use crate::report::Treatment;

const BEGIN_S: u32 = 1_533_114_900;

/// A row of an airplane that flies east at 440 kt.
fn row(k: u32) -> String {
    let lon_deg = 7.0 + 0.03 * f64::from(k);
    format!(
        "{{\"time_s\":{},\"icao24\":\"aaaaa1\",\"callsign\":\"ABC1\",\"lat_deg\":47,\"lon_deg\":{lon_deg:.2},\
         \"alt_ft\":35000,\"gs_kt\":440,\"extent\":{{\"a\":1}}}}",
        BEGIN_S + 10 * k
    )
}

fn read_text(text: &str) -> RecordedTraffic {
    parse(&"f", text).unwrap_or_else(|error| panic!("{error}"))
}

fn assert_broken(text: &str, rows: usize, count: u64, places: &[&str]) {
    let traffic = read_text(text);
    assert_eq!(traffic.tracks[0].samples.len(), rows, "{:?}", traffic.report);
    let found = finding(&traffic, "no JSON").expect("a rule");
    assert_eq!((found.treatment, found.count), (Treatment::Dropped, count));
    assert_eq!(found.places, places);
}

/// Faults of a row, as programs make them that build JSON from pieces of text.
const FAULTS: [(&str, &str); 5] = [
    ("\"gs_kt\":440", "\"gs_kt\":nan"),
    ("\"ABC1\"", "\"A\"BC1\""),
    ("\"ABC1\"", "\"ABC1"),
    ("}}", "}"),
    ("\"lat_deg\":47", "\"lat_deg\":,"),
];

#[test]
fn one_broken_row_of_a_list_is_one_row_less() {
    for (good, bad) in FAULTS {
        for broken in [0, 12, 29] {
            let mut rows: Vec<String> = (0..30).map(row).collect();
            rows[broken] = rows[broken].replacen(good, bad, 1);
            let line = format!("line {}", broken + 2);
            assert_broken(&format!("[\n{}\n]\n", rows.join(",\n")), 29, 1, &[&line]);
            assert_broken(&format!("[{}]", rows.join(",")), 29, 1, &["line 1"]);
            let line = format!("line {}", broken + 1);
            assert_broken(&rows.join("\n"), 29, 1, &[&line]);
            let line = format!("line {}", 10 * broken + 2);
            let many_lines = rows.iter().map(|row| row.replace(",\"", ",\n\"") + "\n\n\n");
            let many_lines: Vec<String> = many_lines.collect();
            assert_broken(&format!("[\n{}]", many_lines.join(",")), 29, 1, &[&line]);
        }
    }
}

#[test]
fn two_broken_rows_side_by_side_are_two() {
    let mut rows: Vec<String> = (0..20).map(row).collect();
    for k in [7, 8] {
        rows[k] = rows[k].replacen("440", "-", 1);
    }
    assert_broken(&format!("[{}]", rows.join(",")), 18, 2, &["line 1"]);
    assert_broken(&format!("[\n{}]", rows.join(",\n")), 18, 2, &["line 9", "line 10"]);
}

#[test]
fn a_list_that_ends_behind_a_whole_row_is_cut() {
    let rows: Vec<String> = (0..5).map(row).collect();
    assert_broken(&format!("[{},\n", rows.join(",\n")), 5, 1, &["line 6"]);
}

#[test]
fn lines_that_are_something_else_count_as_rows() {
    let rows: Vec<String> = (0..5).map(row).collect();
    let text = format!("{}\n{}", rows.join("\n"), "x\n".repeat(6));
    let error = parse(&"f", &text).expect_err("more than half");
    assert!(error.cause().contains("6 of 11 rows"), "{error}");
    // Each line was looked for from the start of the file, so that this took hours.
    let text = format!("{}\n{}", rows[0], "x\n".repeat(500_000));
    assert!(parse(&"f", &text).is_err());
    let text = format!("{}\n{}", rows[0], "{\"time_s\":x\n".repeat(50_000));
    assert!(parse(&"f", &text).is_err());
}

#[test]
fn broken_items_within_one_another_are_refused() {
    let pad = "1,".repeat(2_000);
    let text = format!("{}\n{}", row(0), format!("{{\"time_s\":[{pad}").repeat(60));
    let error = parse(&"f", &text).expect_err("no row");
    assert!(error.cause().contains("within one another"), "{error}");
}

#[test]
fn an_item_that_is_no_object_is_left_out_alone() {
    let rows: Vec<String> = (0..5).map(row).collect();
    let list = format!("[null,{},\n7,[1],{}]", rows[..3].join(","), rows[3..].join(","));
    let around = format!("{{\"aircraft\":{list}}}");
    for (text, place) in [(list, "line 1"), (around, "item 1")] {
        let traffic = read_text(&text);
        assert_eq!(traffic.tracks[0].samples.len(), 5);
        let found = finding(&traffic, "no object").expect("a rule");
        assert_eq!((found.treatment, found.count), (Treatment::Dropped, 3));
        assert_eq!(found.places[0], place);
    }
}

#[test]
fn a_text_for_all_rows_of_a_list_is_a_short_one() {
    let rows: Vec<String> = (0..3).map(|k| row(k).replace(",\"callsign\":\"ABC1\"", "")).collect();
    let long = "X".repeat(20_000);
    for (around, wanted) in [("XY1", "XY1"), (long.as_str(), "")] {
        let list = format!("{{\"callsign\":\"{around}\",\"ac\":[{}]}}", rows.join(","));
        assert_eq!(read_text(&list).tracks[0].callsign, wanted);
        let points: Vec<String> = (0..3)
            .map(|k| format!("[{},47.0,7.{:02},10668,90,false]", BEGIN_S + 10 * k, 3 * k))
            .collect();
        let points = points.join(",");
        let path =
            format!("{{\"icao24\":\"aaaaa1\",\"callsign\":\"{around}\",\"path\":[{points}]}}");
        assert_eq!(read_text(&path).tracks[0].callsign, wanted);
    }
    let shared = format!("{{\"callsign\":{{\"a\":1}},\"ac\":[{}]}}", rows.join(","));
    assert_eq!(finding(&read_text(&shared), "columns").map(|found| found.count), Some(1));
}

/// A trace of readsb; each point has `levels`.
fn trace(address: &str, levels: impl Fn(u32) -> (&'static str, u32, &'static str)) -> String {
    let mut points = Vec::new();
    for k in 0..6 {
        let (altitude, flags, geometric) = levels(k);
        let time_s = 10 * k;
        let lon_deg = 7.0 + 0.03 * f64::from(k);
        points.push(format!(
            "[{time_s}.0,47.0,{lon_deg:.2},{altitude},440.0,90.0,{flags},0,null,\"adsb_icao\",{geometric}]"
        ));
    }
    format!("{{\"icao\":\"{address}\",\"timestamp\":{BEGIN_S},\"trace\":[{}]}}", points.join(","))
}

#[test]
fn a_flight_that_has_geometric_altitudes_alone_is_flown_at_them() {
    let flagged = trace("aaaaa1", |_| ("35500", 8, "null"));
    let beside = trace("aaaaa1", |_| ("null", 0, "35500"));
    for text in [flagged, beside] {
        let traffic = read_text(&text);
        assert_eq!(traffic.report.dropped(), 0, "{:?}", traffic.report);
        assert_eq!(traffic.tracks[0].samples.len(), 6);
        assert_eq!(traffic.tracks[0].samples[2].altitude_ft, 35_500.0);
        let found = finding(&traffic, "geometric").expect("a rule");
        assert_eq!((found.treatment, found.count), (Treatment::Guessed, 1));
    }
    // One that has both kinds has no steps between them.
    let both =
        trace("bbbbb2", |k| if k == 2 { ("null", 0, "35500") } else { ("35000", 0, "null") });
    let traffic = read_text(&both);
    assert_eq!(finding(&traffic, "without an altitude").map(|found| found.count), Some(1));
    assert_eq!(traffic.tracks[0].samples.len(), 5);
}

#[test]
fn a_point_of_a_trace_that_is_no_list_is_counted() {
    let text = trace("aaaaa1", |_| ("35000", 0, "null")).replace("[[", "[null,{},[");
    let traffic = read_text(&text);
    let found = finding(&traffic, "points of a trace").expect("a rule");
    assert_eq!((found.treatment, found.count, traffic.rows), (Treatment::Dropped, 2, 8));
    assert_eq!(found.places, ["point 1", "point 2"]);
}

#[test]
fn aircraft_of_readsb_that_send_no_position_are_no_loss() {
    let mut text = String::new();
    for k in 0..3 {
        let now_s = BEGIN_S + 10 * k;
        let lon_deg = 7.0 + 0.03 * f64::from(k);
        text.push_str(&format!(
            "{{\"now\":{now_s},\"aircraft\":[{{\"hex\":\"aaaaa1\",\"lat\":47.0,\"lon\":{lon_deg:.2},\
             \"alt_baro\":35000,\"gs\":440.0,\"track\":90.0}},{{\"hex\":\"bbbbb2\",\"alt_baro\":35000}},\
             {{\"hex\":\"ccccc3\",\"alt_baro\":30000,\"lastPosition\":{{\"lat\":47.0,\"lon\":7.0,\"seen_pos\":90}}}}]}}\n"
        ));
    }
    let traffic = read_text(&text);
    assert_eq!((traffic.tracks.len(), traffic.rows), (1, 9));
    assert_eq!(traffic.report.dropped(), 0, "{:?}", traffic.report);
    let found = finding(&traffic, "send no position").expect("a rule");
    assert_eq!((found.treatment, found.count), (Treatment::NotUsed, 6));
    let none = "{\"now\":1533114900,\"aircraft\":[{\"hex\":\"bbbbb2\",\"alt_baro\":35000,\"lat\":null,\"lon\":null}]}";
    let error = parse(&"f", none).expect_err("no position at all");
    assert!(error.cause().contains("send no position"), "{error}");
}
