//! Files of all sources as people have them, built here, and the flights that they are.

use super::*;
use crate::report::{Finding, Treatment};
use sidestep_testing::shared_data as shared;
use std::fmt::Write;

const HEADER: &str = "time_s,icao24,callsign,lat_deg,lon_deg,alt_ft,gs_kt,track_deg,vs_fpm\n";

fn parsed(rows: &str) -> Result<RecordedTraffic, InputError> {
    parse(&"t.csv", &format!("{HEADER}{rows}"))
}

pub(super) fn finding<'a>(traffic: &'a RecordedTraffic, rule: &str) -> Option<&'a Finding> {
    traffic.report.findings.iter().find(|finding| finding.rule.contains(rule))
}

fn count(traffic: &RecordedTraffic, rule: &str) -> u64 {
    finding(traffic, rule).map_or(0, |finding| finding.count)
}

/// Rows of an aircraft that flies east at 440 kt along a parallel, one every 10 s.
struct EastFlight {
    address: &'static str,
    callsign: &'static str,
    lat_deg: f64,
}

impl EastFlight {
    fn row(&self, k: u32) -> String {
        self.row_at(k, 7.0 + 0.03 * f64::from(k))
    }

    fn row_at(&self, k: u32, lon_deg: f64) -> String {
        let Self { address, callsign, lat_deg } = self;
        let time_s = 1_533_114_900 + 10 * k;
        format!("{time_s},{address},{callsign},{lat_deg},{lon_deg:.2},35000,440,90,0\n")
    }

    fn rows(&self, range: std::ops::Range<u32>) -> String {
        range.map(|k| self.row(k)).collect()
    }
}

const A1: EastFlight = EastFlight { address: "aaaaa1", callsign: "ABC1", lat_deg: 47.0 };

#[test]
fn rows_become_flights_by_aircraft_sorted_by_time() {
    let traffic = parsed(
        "20,b,,46,6.01,38000,460,360,\n10,a,X1,46,6,38000,460,10,-64\n20,a,X1,46,6.03,38000,460,10,\n\
         10,b,Y2,46,6,38000,460,0,0\n",
    )
    .unwrap();
    assert_eq!(traffic.rows, 4);
    let names: Vec<_> = traffic.tracks.iter().map(|track| track.callsign.as_str()).collect();
    assert_eq!(names, ["X1", "Y2"]);
    assert_eq!(traffic.tracks[0].samples[0].vertical_speed_fpm, Some(-64.0));
    let b = &traffic.tracks[1].samples;
    assert_eq!((b[0].time_s, b[1].time_s), (10.0, 20.0));
    assert_eq!((b[1].track_deg, b[1].vertical_speed_fpm), (Some(0.0), None));
    assert_eq!(count(&traffic, "out of order"), 1);
}

#[test]
fn a_second_row_for_one_instant_is_left_out_and_counted() {
    let traffic =
        parsed(&(A1.rows(0..3) + &A1.row(2) + &A1.row_at(1, 7.05) + &A1.rows(3..5))).unwrap();
    assert_eq!((traffic.rows, traffic.repeated_rows), (7, 2));
    assert_eq!(traffic.tracks[0].samples.len(), 5);
    assert_eq!(traffic.tracks[0].samples[1].position.lon_deg, 7.03, "the first of the file");
    assert_eq!(finding(&traffic, "given twice").unwrap().treatment, Treatment::Repaired);
    let other = finding(&traffic, "another position at the instant").unwrap();
    assert_eq!((other.treatment, other.count), (Treatment::Dropped, 1));
    assert!(other.places[0].starts_with("line 6 (ABC1 at 2018-08-01T09:15:10Z"), "{other}");
}

#[test]
fn bad_rows_are_left_out_and_counted_with_their_lines() {
    for (row, rule) in [
        ("x,a,,46,6,1,200,3,", "rows with a time that is neither ISO 8601 nor a number"),
        (",a,,46,6,1,200,3,", "rows without a time"),
        ("1533114905,,,46,6,1,200,3,", "rows without the name of an aircraft"),
        ("1533114905,a,,,6,1,200,3,", "rows without a position"),
        ("1533114905,a,,46,NaN,1,200,3,", "rows without a position"),
        ("1533114905,a,,46,null,1,200,3,", "rows without a position"),
        ("1533114905,a,,46,6 X,1,200,3,", "rows with a position that is no number"),
        ("1533114905,a,,91,6,1,200,3,", "rows with a position that is not on the earth"),
        ("1533114905,a,,46,-181,1,200,3,", "rows with a position that is not on the earth"),
        ("1533114905,a,,46,6,,200,3,", "rows without an altitude"),
        ("1533114905,a,,46,6,high,200,3,", "rows with an altitude that is no number"),
        ("1533114905,a,,46,6,1e7,200,3,", "rows with an altitude that no aircraft has"),
        ("9e9,a,,46,6,1,200,3,", "rows with a time decades from that of the others"),
        ("1533114905,a,,46", "rows with fewer or more fields than the header"),
    ] {
        let traffic = parsed(&format!("{}{row}\n{}", A1.rows(0..2), A1.rows(2..4))).expect(row);
        let found =
            finding(&traffic, rule).unwrap_or_else(|| panic!("{row}: {:?}", traffic.report));
        assert_eq!((found.count, found.treatment), (1, Treatment::Dropped), "{row}");
        assert_eq!(found.places, ["line 4"], "{row}");
        assert_eq!((traffic.rows, traffic.tracks[0].samples.len()), (5, 4), "{row}");
        assert_eq!(traffic.report.dropped(), 1, "{row}");
    }
}

#[test]
fn a_bad_cell_that_a_row_can_do_without_is_left_out_alone() {
    for row in ["440,90,up", "440,x,0", "-2,90,0"] {
        let rows = A1.rows(0..2).replacen("440,90,0", row, 1);
        let traffic = parsed(&rows).unwrap();
        assert_eq!(traffic.tracks[0].samples.len(), 2);
        assert_eq!(count(&traffic, "cells with a"), 1, "{row}");
    }
    let empty = parsed(&A1.rows(0..2).replace("440,90,0", ",,")).unwrap();
    assert_eq!(empty.report.dropped(), 0);
    assert_eq!(empty.tracks[0].samples[0].ground_speed_kt, None);
}

#[test]
fn a_file_of_which_more_than_half_is_bad_is_refused_at_its_first_bad_row() {
    let bad = "1533114905,a,,,6,1,200,3,\n";
    assert!(parsed(&(A1.rows(0..2) + &bad.repeat(2))).is_ok());
    let error = parsed(&(A1.rows(0..2) + &bad.repeat(3))).unwrap_err();
    assert_eq!(error.line_and_column(), Some((4, 1)));
    assert!(error.cause().contains("3 of 5 rows cannot be used"), "{error}");
    assert!(error.cause().contains("rows without a position (3 times)"), "{error}");
    assert!(parsed("").unwrap_err().cause().contains("has no rows"));
    assert!(parse(&"t.csv", "time_s\n1\n").unwrap_err().cause().contains("icao24"));
    let single =
        parsed(&(A1.row(0) + "1533114900,b,,46,6,1,200,3,\n1533114910,b,,46,6,1,200,3,\n"))
            .unwrap();
    assert_eq!(count(&single, "flights of a single row"), 1);
}

#[test]
fn addresses_have_no_case() {
    let mixed: String = (0..6)
        .map(|k| if k % 2 == 0 { A1.row(k) } else { A1.row(k).replace("aaaaa1", "AAAAA1 ") })
        .collect();
    let traffic = parsed(&mixed).unwrap();
    assert_eq!(traffic.tracks.len(), 1);
    assert_eq!(traffic.tracks[0].samples.len(), 6);
    assert_eq!(count(&traffic, "addresses in several spellings"), 3);
    let zeros =
        A1.rows(0..2).replace("aaaaa1", "00aaa1") + &A1.rows(2..4).replace("aaaaa1", "aaa1");
    assert_eq!(parsed(&zeros).unwrap().tracks.len(), 1, "a spreadsheet takes zeros away");
}

#[test]
fn rows_on_the_ground_are_no_traffic() {
    let taxi =
        "1533114900,c,TAXI,47.45,8.55,1400,5,90,0\n1533114910,c,TAXI,47.45,8.5501,1400,5,90,0\n";
    let traffic = parsed(&(A1.rows(0..3) + taxi)).unwrap();
    assert_eq!(traffic.tracks.len(), 1);
    let slow = finding(&traffic, "slower than 30 kt").unwrap();
    assert_eq!((slow.count, slow.treatment), (2, Treatment::Guessed));
    assert_eq!(traffic.report.dropped(), 0);
    assert!(slow.remedy.contains("import.ground_speed_kt=0"));
    let error = parsed(taxi).unwrap_err();
    assert!(error.cause().contains("no flight remains of 2 rows"), "{error}");
    assert!(error.cause().contains("slower than 30 kt"), "{error}");
    let options = TrafficOptions { ground_speed_kt: 0.0, ..TrafficOptions::default() };
    let kept = parse_with(&"t.csv", &format!("{HEADER}{taxi}"), &options).unwrap();
    assert_eq!(kept.tracks.len(), 1, "for what hovers");
}

#[test]
fn a_flag_for_the_ground_counts_more_than_the_speed() {
    let header = "time_s,icao24,lat_deg,lon_deg,alt_ft,gs_kt,onground\n";
    let row = |k: u32, knots: u32, flag: &str| {
        format!("{},h,47.0,{},900,{knots},{flag}\n", 100 + 10 * k, 7.0 + 0.0001 * f64::from(k))
    };
    for (flags, tracks) in [("true", None), ("True", None), ("1", None), ("false", Some(1))] {
        let rows: String = (0..4).map(|k| row(k, 4, flags)).collect();
        let traffic = parse(&"t.csv", &format!("{header}{rows}"));
        assert_eq!(traffic.ok().map(|traffic| traffic.tracks.len()), tracks, "{flags}");
    }
}

#[test]
fn a_landing_ends_a_flight_and_a_flag_that_is_wrong_for_a_moment_does_not() {
    let header = "time_s,icao24,lat_deg,lon_deg,alt_ft,gs_kt,onground\n";
    let flight = |ground: std::ops::Range<u32>| {
        let row = |k: u32| {
            let flag = ground.contains(&k);
            format!("{},h,47.0,{:.2},9000,440,{flag}\n", 100 + 10 * k, 7.0 + 0.03 * f64::from(k))
        };
        let rows: String = (0..20).map(row).collect();
        parse(&"t.csv", &format!("{header}{rows}")).unwrap()
    };
    assert_eq!(flight(8..9).tracks.len(), 1);
    assert_eq!(flight(6..14).tracks.len(), 2);
}

#[test]
fn flights_end_at_gaps_and_at_changes_of_call_sign() {
    let gap = parsed(&(A1.rows(0..5) + &A1.rows(70..75))).unwrap();
    let lengths: Vec<usize> = gap.tracks.iter().map(|track| track.samples.len()).collect();
    assert_eq!(lengths, [5, 5]);
    assert_eq!(count(&gap, "gaps of more than 600 s"), 1);
    let near = parsed(&(A1.rows(0..5) + &A1.rows(60..65))).unwrap();
    assert_eq!(near.tracks.len(), 1, "560 s are no gap");
    let options = TrafficOptions { max_gap_s: 100.0, ..TrafficOptions::default() };
    let text = format!("{HEADER}{}{}", A1.rows(0..5), A1.rows(60..65));
    assert_eq!(parse_with(&"t.csv", &text, &options).unwrap().tracks.len(), 2);

    let renamed = A1.rows(0..5) + &A1.rows(5..10).replace("ABC1", "xyz9");
    let traffic = parsed(&renamed).unwrap();
    let names: Vec<&str> = traffic.tracks.iter().map(|track| track.callsign.as_str()).collect();
    assert_eq!(names, ["ABC1", "XYZ9"]);
    assert_eq!(count(&traffic, "changes of call sign"), 1);
    let partly =
        A1.rows(0..3).replace("ABC1", "") + &A1.rows(3..6) + &A1.rows(6..9).replace("ABC1", "");
    assert_eq!(parsed(&partly).unwrap().tracks.len(), 1, "an empty call sign is no other one");
}

#[test]
fn a_call_sign_that_is_wrong_for_a_moment_makes_no_second_airplane() {
    let flaps: String = (0..20)
        .map(|k| if k % 5 == 2 { A1.row(k).replace("ABC1", "ABC") } else { A1.row(k) })
        .collect();
    let traffic = parsed(&flaps).unwrap();
    assert_eq!(traffic.tracks.len(), 1);
    assert_eq!(traffic.tracks[0].samples.len(), 20);
    assert_eq!(count(&traffic, "another call sign for less than a minute"), 4);
}

#[test]
fn two_aircraft_with_one_address_are_told_apart_by_call_sign() {
    let far = EastFlight { callsign: "FAR2", lat_deg: 44.0, ..A1 };
    let rows: String = (0..10).map(|k| if k % 2 == 0 { A1.row(k) } else { far.row(k) }).collect();
    let traffic = parsed(&rows).unwrap();
    assert_eq!(traffic.tracks.len(), 2);
    assert!(traffic.tracks.iter().all(|track| track.samples.len() == 5));
    assert_eq!(count(&traffic, "the address of another one at the same time"), 1);
    assert_eq!(count(&traffic, "does not lead to"), 0);
}

fn options_without_suspicious() -> TrafficOptions {
    TrafficOptions { leaves_out_suspicious: true, ..TrafficOptions::default() }
}

#[test]
fn a_position_that_the_speed_does_not_lead_to_is_named_and_can_be_left_out() {
    for spike in ["47.0,8.45", "48.0,7.45", "-46.0,-172.0", "47.01,7.45"] {
        let rows = A1.rows(0..15) + &A1.row(15).replace("47,7.45", spike) + &A1.rows(16..30);
        let traffic = parsed(&rows).unwrap();
        let found = finding(&traffic, "the reported speed does not lead to").map(|f| f.count);
        let is_far = spike != "47.01,7.45";
        assert_eq!(found, is_far.then_some(1), "{spike}: a km may be noise");
        let text = format!("{HEADER}{rows}");
        let cleaned = parse_with(&"t.csv", &text, &options_without_suspicious()).unwrap();
        assert_eq!(cleaned.tracks.len(), 1, "{spike}");
        assert_eq!(cleaned.tracks[0].samples.len(), if is_far { 29 } else { 30 }, "{spike}");
    }
    let rows = A1.rows(0..15) + &A1.row(15).replace("47,7.45", "48,7.45") + &A1.rows(16..30);
    let traffic = parsed(&rows).unwrap();
    let found = finding(&traffic, "the reported speed does not lead to").unwrap();
    assert_eq!(found.treatment, Treatment::Suspicious);
    assert_eq!(found.places, ["line 17 (ABC1 at 2018-08-01T09:17:30Z, 48.0000 7.4500)"]);
    assert!(found.remedy.contains("--set import.leave_out_suspicious=true"), "{found}");
}

#[test]
fn a_level_that_no_climb_leads_to_is_named() {
    let rows = A1.rows(0..5) + &A1.row(5).replace("35000", "0") + &A1.rows(6..10);
    assert_eq!(count(&parsed(&rows).unwrap(), "does not lead to"), 1);
}

#[test]
fn a_frozen_position_is_named_and_the_jump_after_it_is_not() {
    let frozen: String = (0..30)
        .map(|k| if (10..16).contains(&k) { A1.row_at(k, 7.27) } else { A1.row(k) })
        .collect();
    let traffic = parsed(&frozen).unwrap();
    assert_eq!(count(&traffic, "the position of an earlier row"), 6);
    assert_eq!(count(&traffic, "does not lead"), 0);
    let text = format!("{HEADER}{frozen}");
    let cleaned = parse_with(&"t.csv", &text, &options_without_suspicious()).unwrap();
    assert_eq!((cleaned.tracks.len(), cleaned.tracks[0].samples.len()), (1, 24));
    assert_eq!(cleaned.report.dropped(), 6);
}

#[test]
fn positions_repeated_for_a_few_seconds_are_usual() {
    let rows: String = (0..40)
        .map(|s: u32| {
            let lon_deg = 7.0 + 0.003 * f64::from(s / 3 * 3);
            format!("{},a,,47.0,{lon_deg:.3},35000,440,90,0\n", 1_533_114_900 + s)
        })
        .collect();
    let traffic = parsed(&rows).unwrap();
    assert_eq!(traffic.report.findings, []);
}

#[test]
fn a_flight_that_goes_on_elsewhere_is_split_there_when_wanted() {
    let moved: String = (0..20)
        .map(|k| if k < 10 { A1.row(k) } else { A1.row(k).replace(",47,", ",52,") })
        .collect();
    let traffic = parsed(&moved).unwrap();
    assert_eq!(traffic.tracks.len(), 1);
    let jump = finding(&traffic, "go on elsewhere").unwrap();
    assert!(jump.places[0].starts_with("line 12 "), "{jump}");
    let text = format!("{HEADER}{moved}");
    let cleaned = parse_with(&"t.csv", &text, &options_without_suspicious()).unwrap();
    assert_eq!(cleaned.tracks.len(), 2);
}

#[test]
fn speeds_in_another_unit_than_the_column_says_are_named_once() {
    let rows = A1.rows(0..20).replace(",440,", ",226.4,");
    let traffic = parsed(&rows).unwrap();
    let found = finding(&traffic, "the column may have m/s").unwrap();
    assert_eq!(found.treatment, Treatment::Suspicious);
    assert_eq!(traffic.report.findings.len(), 1, "{:?}", traffic.report);
}

#[test]
fn flights_cross_the_date_line_and_pass_the_pole() {
    let date_line: String = (0..10)
        .map(|k: u32| {
            let lon_deg = 179.85 + 0.03 * f64::from(k);
            let lon_deg = if lon_deg > 180.0 { lon_deg - 360.0 } else { lon_deg };
            format!("{},a,,10.0,{lon_deg:.3},35000,640,90,0\n", 1_533_114_900 + 10 * k)
        })
        .collect();
    let traffic = parsed(&date_line).unwrap();
    assert_eq!(traffic.report.findings, []);
    let extent = &traffic.report.facts.iter().find(|fact| fact.name == "extent").unwrap().value;
    assert!(extent.contains("longitude 179.8500 to -179.8800"), "{extent}");
    let pole: String = (0..10)
        .map(|k: u32| {
            let north_deg = 89.91 + 0.02 * f64::from(k);
            let (lat, lon) =
                if north_deg > 90.0 { (180.0 - north_deg, -170.0) } else { (north_deg, 10.0) };
            format!("{},a,,{lat:.3},{lon},35000,432,0,0\n", 1_533_114_900 + 10 * k)
        })
        .collect();
    assert_eq!(parsed(&pole).unwrap().report.findings, []);
}

#[test]
fn state_vectors_of_opensky_are_read_with_their_units() {
    let text = "time,icao24,lat,lon,velocity,heading,vertrate,callsign,onground,alert,spi,squawk,baroaltitude,geoaltitude,lastposupdate,lastcontact\n\
        1498147200,4b1234,47.0,8.0,230.0,90.0,5.08,ABC123  ,false,false,false,1000,10668.0,10900.0,1498147199.1,1498147199.5\n\
        1498147210,4b1234,47.0,8.03,230.0,90.0,0.0,ABC123  ,false,false,false,1000,10668.0,10900.0,1498147209.1,1498147209.5\n\
        1498147210,4b5678,47.1,8.03,,,,XYZ9    ,false,false,false,1000,,,1498147209.1,1498147209.5\n";
    let traffic = parse(&"osky.csv", text).unwrap();
    assert_eq!(traffic.report.format, "OpenSky state vectors (CSV)");
    let sample = traffic.tracks[0].samples[0];
    assert_eq!(traffic.tracks[0].callsign, "ABC123");
    assert!((sample.altitude_ft - 35_000.0).abs() < 1e-6);
    assert!((sample.ground_speed_kt.unwrap() - 447.084).abs() < 1e-3);
    assert!((sample.vertical_speed_fpm.unwrap() - 1000.0).abs() < 1e-6);
    assert_eq!(count(&traffic, "rows without an altitude"), 1);
    assert_eq!(finding(&traffic, "columns").unwrap().treatment, Treatment::NotUsed);
    let old = text.replace(
        "1498147209.1,1498147209.5\n1498147210,4b5",
        "1498147190.1,1498147209.5\n1498147210,4b5",
    );
    let old = parse(&"osky.csv", &old).unwrap();
    assert_eq!(count(&old, "the position of an earlier row"), 1, "received 20 s before");
}

#[test]
fn answers_of_openskys_interface_are_read_as_lists_objects_and_tracks() {
    let state = |time: u32, lon: f64| {
        format!(
            "[\"aaaaa1\",\"ABC1 \",\"X\",{time},{time},{lon},47.0,10668.0,false,230.0,90.0,0.0,null,10900.0,null,false,0]"
        )
    };
    let answer = |time: u32, lon: f64| {
        format!(
            "{{\"time\": {time}, \"states\": [{}, [\"bbbbb2\",\"\",\"X\",null,1,null,null,null,false,null,null,null,null,null,null,false,0]]}}",
            state(time, lon)
        )
    };
    let [one, two] = [answer(1_533_114_900, 7.0), answer(1_533_114_910, 7.03)];
    for text in [format!("{one}\n{two}"), format!("[{one},{two}]")] {
        let traffic = parse(&"states.json", &text).unwrap();
        assert_eq!((traffic.tracks.len(), traffic.tracks[0].samples.len()), (1, 2));
        assert_eq!(count(&traffic, "rows without a position"), 2);
        assert!((traffic.tracks[0].samples[0].ground_speed_kt.unwrap() - 447.084).abs() < 1e-3);
        assert_eq!(traffic.report.format, "OpenSky state vectors (JSON)");
    }
    let objects = "{\"time\": 1533114900, \"states\": [{\"icao24\": \"aaaaa1\", \"callsign\": \"ABC1\", \
                   \"longitude\": 7.0, \"latitude\": 47.0, \"baro_altitude\": 10668.0, \"velocity\": 230, \
                   \"true_track\": 90, \"on_ground\": false}]}";
    let snapshot = parse(&"states.json", objects).unwrap();
    assert!(snapshot.is_snapshot);
    assert_eq!(snapshot.tracks[0].samples[0].track_deg, Some(90.0));
    assert_eq!(finding(&snapshot, "fly straight on").unwrap().treatment, Treatment::Guessed);
    let track = "{\"icao24\":\"aaaaa1\",\"callsign\":\"ABC1\",\"startTime\":1,\"endTime\":2,\"path\":\
                 [[1533114900,47.0,7.0,10668,90,false],[1533114910,47.0,7.03,10668,90,false]]}";
    assert_eq!(parse(&"track.json", track).unwrap().tracks[0].samples.len(), 2);
    let error = parse(&"a.json", "[{\"a\": 1}]").unwrap_err();
    assert!(
        error.cause().contains("nothing in it is recorded traffic: its columns are `a`"),
        "{error}"
    );
    assert!(error.remedy().contains("sidestep inspect --help"), "{error}");
    let error = parse(&"a.json", "[{\"time_s\": 1}]").unwrap_err();
    assert!(error.cause().contains("lacks a name of the aircraft"), "{error}");
    for wrong in ["[1]", "{\"states\": [", "{\"states\": 1}", "[[[["] {
        let error = parse(&"a.json", wrong).unwrap_err();
        assert!(error.remedy().contains("REST interface"), "{error}");
    }
}

#[test]
fn tables_of_the_library_traffic_are_read_with_their_flights() {
    let text = "timestamp,icao24,callsign,latitude,longitude,altitude,groundspeed,track,vertical_rate,flight_id,onground\n\
        2018-08-01 09:00:00+00:00,4b1234,ABC123,47.0,8.0,35000.0,447.0,90.0,0.0,ABC123_001,False\n\
        2018-08-01 09:00:10+00:00,4b1234,ABC123,47.0,8.03,35000.0,447.0,90.0,0.0,ABC123_001,False\n\
        2018-08-01 09:00:20+00:00,4b1234,ABC123,47.0,8.06,35000.0,447.0,90.0,0.0,ABC123_002,False\n\
        2018-08-01 09:00:30+00:00,4b1234,ABC123,47.0,8.09,35000.0,447.0,90.0,0.0,ABC123_002,False\n";
    let traffic = parse(&"traffic.csv", text).unwrap();
    assert_eq!(traffic.report.format, "tracks of the library traffic (CSV)");
    let ids: Vec<&str> = traffic.tracks.iter().map(|track| track.flight_id.as_str()).collect();
    assert_eq!(ids, ["ABC123_001", "ABC123_002"]);
    assert_eq!(traffic.tracks[0].samples[0].time_s, 1_533_114_000.0);
    assert_eq!(traffic.tracks[0].samples[0].ground_speed_kt, Some(447.0));
}

#[test]
fn rows_as_objects_are_a_table() {
    let row = |k: u32, more: &str| {
        let lon_deg = 8.0 + 0.03 * f64::from(k);
        format!(
            "{{\"icao24\":\"4b1234\",\"latitude\":47.0,\"longitude\":{lon_deg:.2},\"track\":90,\"altitude\":35000,\
             \"groundspeed\":447,\"timestamp\":{}000{more}}}",
            1_533_114_000 + 10 * k
        )
    };
    let list = format!("[{},{},{}]", row(0, ""), row(1, ",\"callsign\":\"ABC1\""), row(2, ""));
    let traffic = parse(&"a.json", &list).unwrap();
    assert_eq!(traffic.report.format, "tracks of the library traffic (JSON)");
    let [track] = &traffic.tracks[..] else { panic!("{:?}", traffic.tracks) };
    assert_eq!((track.callsign.as_str(), track.samples.len()), ("ABC1", 3));
    assert_eq!(format_utc(track.samples[0].time_s), "2018-08-01T09:00:00Z");
    let lines = format!("{}\n{}", row(0, ""), row(1, ""));
    assert_eq!(parse(&"a.json", &lines).unwrap().tracks[0].samples.len(), 2);
}

#[test]
fn the_flight_over_the_alps_is_read_as_it_is() {
    let Some(path) = shared("airspace/opensky/alpi_italiane.json.gz") else { return };
    let traffic = read(&path).unwrap();
    println!("{:#?}", traffic.report);
    assert_eq!(traffic.report.format, "tracks of the library traffic (JSON)");
    assert!(traffic.tracks.iter().all(|track| track.icao24 == "3ed6a0"));
}

#[test]
fn a_track_of_flightradar24_is_read_and_altitude_0_is_the_ground() {
    let text = "Timestamp,UTC,Callsign,Position,Altitude,Speed,Direction\n\
        1564999940,2019-08-05T10:12:20Z,KLM123,\"52.30,4.74\",0,140,90\n\
        1565000000,2019-08-05T10:13:20Z,KLM123,\"52.30,4.76\",1200,160,90\n\
        1565000060,2019-08-05T10:14:20Z,KLM123,\"52.30,4.86\",3000,220,90\n";
    let traffic = parse(&"fr24.csv", text).unwrap();
    assert_eq!(traffic.report.format, "Flightradar24 track (CSV)");
    assert_eq!(traffic.tracks[0].samples.len(), 2);
    assert_eq!(traffic.tracks[0].samples[0].position, LatLon { lat_deg: 52.3, lon_deg: 4.76 });
    assert_eq!(count(&traffic, "on the ground"), 1);
    let nameless = text.replace("KLM123", "");
    assert_eq!(parse(&"fr24.csv", &nameless).unwrap().tracks.len(), 1);
}

#[test]
fn segments_of_eurocontrol_are_read_end_to_end() {
    let text = "AAA_BBB LFPG EHAM A320 103000 103100 350 350 2 AFR1 180801 180801 2820 420 2820 430 123 1 6.8 0\n\
        BBB_CCC LFPG EHAM A320 103100 103200 350 340 1 AFR1 180801 180801 2820 430 2820 440 123 2 6.8 0\n\
        CCC_DDD LFPG EHAM A320 235930 000030 350 350 2 KLM2 180801 180802 -2820 -420 -2820 -430 124 1 6.8 0\n";
    let traffic = parse(&"a.so6", text).unwrap();
    assert_eq!(traffic.report.format, "flight segments (EUROCONTROL so6)");
    let lengths: Vec<usize> = traffic.tracks.iter().map(|track| track.samples.len()).collect();
    assert_eq!(lengths, [3, 2]);
    let first = traffic.tracks[0].samples[0];
    assert_eq!(first.position, LatLon { lat_deg: 47.0, lon_deg: 7.0 });
    assert_eq!((first.altitude_ft, first.ground_speed_kt), (35_000.0, None));
    assert_eq!(format_utc(first.time_s), "2018-08-01T10:30:00Z");
    let midnight = &traffic.tracks[1].samples;
    assert_eq!(midnight[1].time_s - midnight[0].time_s, 60.0);
    assert_eq!(traffic.report.dropped(), 0);
    let torn = parse(&"a.so6", &format!("{text}CCC_DDD LFPG\n")).unwrap();
    assert_eq!(count(&torn, "lines that are no segment"), 1);
}

#[test]
fn flight_points_of_eurocontrols_archive_have_the_day_first() {
    let text = "\"ECTRL ID\",\"Sequence Number\",\"Time Over\",\"Flight Level\",\"Latitude\",\"Longitude\"\n\
        \"186858226\",\"1\",\"01-03-2015 10:00:00\",\"350\",\"47.0\",\"7.0\"\n\
        \"186858226\",\"2\",\"01-03-2015 10:01:00\",\"350\",\"47.0\",\"7.18\"\n";
    let traffic = parse(&"points.csv", text).unwrap();
    let first = traffic.tracks[0].samples[0];
    assert_eq!(
        (format_utc(first.time_s).as_str(), first.altitude_ft),
        ("2015-03-01T10:00:00Z", 35_000.0)
    );
}

#[test]
fn encounters_of_daidalus_have_the_units_of_their_second_line() {
    let text = "NAME lat lon alt vs trk gs time\n[none] [deg] [deg] [ft] [fpm] [deg] [m/s] [s]\n\
        Ownship 28.5 -80.7 5000 0 90 100 0\nOwnship 28.5 -80.699 5000 0 90 100 1\n\
        Intruder, 28.6, -80.7, 5000, 0, 90, 100, 0\nIntruder 28.6 -80.699 5000 0 90 100 1\n";
    let traffic = parse(&"a.daa", text).unwrap();
    assert_eq!((traffic.tracks.len(), traffic.report.format.as_str()), (2, "encounter (DAIDALUS)"));
    let kt = traffic.tracks[0].samples[0].ground_speed_kt.unwrap();
    assert!((kt - 194.384).abs() < 1e-3, "{kt}");
    let error = parse(&"a.daa", &text.replace("[ft]", "[knot]")).unwrap_err();
    assert_eq!(error.line_and_column(), Some((2, 1)), "{error}");
}

#[test]
fn tables_have_any_separator_and_any_form_of_time() {
    let usual = parse(&"t.csv", &format!("{HEADER}{}", A1.rows(0..5))).unwrap();
    let text = format!("{HEADER}{}", A1.rows(0..5)).replace(',', ";");
    let points = parse(&"semi.csv", &text).unwrap();
    assert_eq!(points.tracks, usual.tracks);
    let commas = parse(&"semi.csv", &text.replace('.', ",")).unwrap();
    assert_eq!(commas.tracks, usual.tracks);
    assert_eq!(finding(&commas, "decimal commas").unwrap().treatment, Treatment::Guessed);
    assert_eq!(parse(&"a.tsv", &text.replace(';', "\t")).unwrap().tracks, usual.tracks);
    let mut iso = String::from(HEADER);
    let mut milliseconds = String::from(HEADER);
    for k in 0..5 {
        let row = A1.row(k);
        let (time_s, rest) = row.split_once(',').unwrap();
        let time_s: f64 = time_s.parse().unwrap();
        let _ = write!(iso, "{},{rest}", format_utc(time_s));
        let _ = write!(milliseconds, "{},{rest}", time_s * 1000.0);
    }
    let from_iso = parse(&"iso.csv", &iso).unwrap();
    assert_eq!((&from_iso.tracks, from_iso.report.findings.len()), (&usual.tracks, 0));
    let guessed = parse(&"ms.csv", &milliseconds).unwrap();
    assert_eq!(guessed.tracks, usual.tracks);
    assert_eq!(count(&guessed, "times are milliseconds since 1970"), 1);
    let local = parse(&"local.csv", &iso.replace("Z,", ",")).unwrap();
    assert_eq!(count(&local, "times without a zone are UTC"), 1);
}

#[test]
fn the_report_has_the_extent_and_what_was_kept() {
    let traffic = parsed(&A1.rows(0..5)).unwrap();
    let facts: Vec<(&str, &str)> =
        traffic.report.facts.iter().map(|fact| (fact.name, fact.value.as_str())).collect();
    assert_eq!(
        facts,
        [
            ("units", "as the names of the columns tell"),
            ("time", "2018-08-01T09:15:00Z to 2018-08-01T09:15:40Z (40 s)"),
            ("extent", "latitude 47.0000 to 47.0000, longitude 7.0000 to 7.1200"),
            ("altitude", "35000 to 35000 ft"),
            ("speed", "440 to 440 kt in 5 rows"),
        ]
    );
    let kept: Vec<u64> = traffic.report.kept.iter().map(|kept| kept.count).collect();
    assert_eq!(kept, [1, 5]);
}

#[test]
fn a_cleaned_table_is_the_same_traffic() {
    let rows = A1.rows(0..5)
        + &A1.rows(70..75)
        + &A1.rows(75..80).replace("ABC1", "X\"Y,1")
        + "1533114900,c,TAXI,47.45,8.55,1400,5,90,0\n1533114905,b,,,6,1,2,3,\n";
    let traffic = parsed(&rows).unwrap();
    let again = parse(&"clean.csv", &to_csv(&traffic)).unwrap();
    assert!(
        again.report.findings.iter().all(|f| f.treatment == Treatment::Guessed),
        "{:?}",
        again.report
    );
    let samples = |traffic: &RecordedTraffic| -> Vec<(String, String, Vec<Sample>)> {
        let one = |t: &Track| (t.icao24.clone(), t.callsign.clone(), t.samples.clone());
        traffic.tracks.iter().map(one).collect()
    };
    assert_eq!(samples(&again), samples(&traffic));
    assert_eq!(to_csv(&again), to_csv(&traffic));
}

#[test]
fn files_of_recorded_traffic_are_known_by_their_names() {
    for name in ["a.csv", "a.CSV.gz", "b.parquet", "c.so6", "d.json", "e.tsv", "f.daa"] {
        assert!(has_extension(Path::new(name)), "{name}");
    }
    assert!(!has_extension(Path::new("a.scn")) && !has_extension(Path::new("a.toml")));
}

#[test]
fn the_recording_over_switzerland_has_the_expected_aircraft_and_rows() {
    let Some(path) = shared("airspace/opensky/switzerland_20180801_dev.csv") else { return };
    let traffic = read(&path).unwrap();
    println!("{:#?}", traffic.report);
    assert_eq!((traffic.rows, traffic.repeated_rows), (6112, 0));
    let samples = || traffic.tracks.iter().flat_map(|track| &track.samples);
    let range = |of: fn(&Sample) -> f64| {
        let ends = (f64::INFINITY, f64::NEG_INFINITY);
        samples().map(of).fold(ends, |(low, high), value| (low.min(value), high.max(value)))
    };
    assert_eq!(range(|s| s.time_s), (1_533_114_900.0, 1_533_116_690.0));
    assert_eq!(range(|s| s.altitude_ft), (32_075.0, 43_000.0), "but for two single rows");
    assert_eq!(traffic.tracks.len(), 86);
    assert_eq!(range(|s| s.ground_speed_kt.unwrap()), (393.2, 509.0));
}

#[test]
fn a_packed_file_reads_the_same() {
    use std::io::Write;
    let text = format!("{HEADER}{}", A1.rows(0..3));
    let mut file = tempfile::NamedTempFile::new().unwrap();
    let mut gzip = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::default());
    gzip.write_all(text.as_bytes()).unwrap();
    file.write_all(&gzip.finish().unwrap()).unwrap();
    assert_eq!(read(file.path()), parse(&"t.csv", &text));
}

#[test]
fn a_file_that_is_neither_text_nor_parquet_is_refused() {
    let options = TrafficOptions::default();
    let error = from_bytes(&"f", vec![0xff, 0xfd, 0, 1], &options).unwrap_err();
    assert!(error.cause().contains("neither a text"), "{error}");
    for bytes in
        [&b"PAR1"[..], b"PAR1\0\0\0\0PAR1", b"PAR1xxxxxxxxxxxxxxxxxxxxx\xff\xff\xff\x7fPAR1"]
    {
        let error = from_bytes(&"f", bytes.to_vec(), &options).unwrap_err();
        assert!(error.cause().contains("cannot be read as Parquet"), "{error}");
    }
}

proptest::proptest! {
    #[test]
    fn any_text_is_traffic_or_an_error(rows in "([0-9a-z.,-]{0,30}\n){0,4}") {
        let _ = parsed(&rows);
    }

    #[test]
    fn any_json_is_traffic_or_an_error(states in "(\\[[0-9\",.a\\[\\]null:{}]{0,40}\\],?){0,3}") {
        let _ = parse(&"f", &format!("{{\"time\":1,\"states\":[{states}]}}"));
    }

    #[test]
    fn any_segment_is_traffic_or_an_error(numbers in proptest::collection::vec("[0-9.-]{1,7}", 60)) {
        let lines: Vec<String> = numbers.chunks(20).map(|line| line.join(" ")).collect();
        let _ = parse(&"f", &lines.join("\n"));
    }

    #[test]
    fn cleaning_any_rows_changes_no_flight(
        rows in proptest::collection::vec((0_u32..400, 0_u8..3, 0_u8..2, 0_u8..40), 2..40)
    ) {
        let mut text = String::from(HEADER);
        for (k, aircraft, callsign, north) in rows {
            let lat_deg = 47.0 + f64::from(north) * 0.01;
            let lon_deg = 7.0 + 0.02 * f64::from(k);
            let time_s = 1_533_114_900 + 10 * k;
            let _ = writeln!(text, "{time_s},a{aircraft},C{callsign},{lat_deg:.2},{lon_deg:.2},35000,440,90,0");
        }
        if let Ok(traffic) = parse(&"f", &text) {
            let again = parse(&"f", &to_csv(&traffic)).expect("its own table");
            let flights = |traffic: &RecordedTraffic| -> Vec<Vec<Sample>> {
                traffic.tracks.iter().map(|track| track.samples.clone()).collect()
            };
            proptest::prop_assert_eq!(flights(&again), flights(&traffic));
        }
    }
}
