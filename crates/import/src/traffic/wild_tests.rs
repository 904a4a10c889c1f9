//! Files as networks, decoders and spreadsheets write them beside the common sources, and the flights that they are.

use super::tests::finding;
use super::*;
use crate::report::Treatment;
use std::fmt::Write as _;

const HEADER: &str = "time_s,icao24,callsign,lat_deg,lon_deg,alt_ft,gs_kt,track_deg,vs_fpm\n";
const BEGIN_S: u32 = 1_533_114_900;

/// Rows of an airplane that flies east at 440 kt at 35,000 ft, one every 10 s, after replacements.
fn table(rows: u32, change: impl Fn(u32, String) -> String) -> String {
    let mut text = String::from(HEADER);
    for k in 0..rows {
        let time_s = BEGIN_S + 10 * k;
        let lon_deg = 7.0 + 0.03 * f64::from(k);
        text.push_str(&change(k, format!("{time_s},aaaaa1,ABC1,47,{lon_deg:.2},35000,440,90,0\n")));
    }
    text
}

fn read_text(text: &str) -> RecordedTraffic {
    parse(&"f", text).unwrap_or_else(|error| panic!("{error}"))
}

fn assert_east_flight(traffic: &RecordedTraffic, rows: usize) {
    assert_eq!(traffic.tracks.len(), 1, "{:?}", traffic.report);
    let track = &traffic.tracks[0];
    assert_eq!((track.icao24.as_str(), track.callsign.as_str()), ("aaaaa1", "ABC1"));
    assert_eq!(track.samples.len(), rows, "{:?}", traffic.report);
    for (k, sample) in track.samples.iter().enumerate() {
        assert_eq!(sample.time_s, f64::from(BEGIN_S) + 10.0 * k as f64);
        let lon_deg = 7.0 + 0.03 * k as f64;
        assert!(
            (sample.position.lon_deg - lon_deg).abs() < 1e-9 && sample.position.lat_deg == 47.0
        );
        assert!((sample.altitude_ft - 35_000.0).abs() < 1e-6);
        assert_eq!(sample.ground_speed_kt.map(f64::round), Some(440.0));
        assert_eq!(sample.track_deg, Some(90.0));
    }
}

#[test]
fn aircraft_of_readsb_and_of_its_networks_are_read_with_their_units() {
    let aircraft = |k: u32| {
        let lon_deg = 7.0 + 0.03 * f64::from(k);
        format!(
            r#"{{"hex":"aaaaa1","flight":"ABC1    ","lat":47.0,"lon":{lon_deg:.2},"alt_baro":35000,"alt_geom":35500,
            "gs":440.0,"track":90.0,"baro_rate":0,"seen_pos":0.3,"seen":0.1}},
            {{"hex":"bbbbb2","lat":47.1,"lon":7.1,"alt_baro":"ground","gs":40.0}}"#
        )
    };
    let mut own = String::new();
    let mut network = String::new();
    for k in 0..3 {
        let now_s = BEGIN_S + 10 * k;
        writeln!(own, r#"{{"now":{now_s},"messages":5,"aircraft":[{}]}}"#, aircraft(k)).unwrap();
        writeln!(network, r#"{{"ac":[{}],"msg":"No error","now":{now_s}000}}"#, aircraft(k))
            .unwrap();
    }
    for text in [own, network] {
        let traffic = read_text(&text);
        assert_east_flight(&traffic, 3);
        let ground = finding(&traffic, "on the ground").expect("a rule");
        assert_eq!((ground.treatment, ground.count), (Treatment::NotUsed, 3));
    }
}

#[test]
fn a_trace_of_readsb_has_times_after_its_begin_and_levels_of_two_kinds() {
    let mut points = Vec::new();
    for k in 0..5 {
        let lon_deg = 7.0 + 0.03 * f64::from(k);
        // The fourth point has the geometric altitude in the place of the other one.
        let (altitude_ft, flags) = if k == 3 { (35_500, 8) } else { (35_000, 0) };
        let details = if k == 0 { r#"{"flight":"ABC1    "}"# } else { "null" };
        points.push(format!(
            "[{}.0,47.0,{lon_deg:.2},{altitude_ft},440.0,90.0,{flags},0,{details},\"adsb_icao\",35500,0,null,null]",
            10 * k
        ));
    }
    let text =
        format!(r#"{{"icao":"aaaaa1","timestamp":{BEGIN_S},"trace":[{}]}}"#, points.join(","));
    let traffic = read_text(&text);
    assert_eq!(finding(&traffic, "without an altitude").map(|found| found.count), Some(1));
    let samples = &traffic.tracks[0].samples;
    assert_eq!(samples.len(), 4);
    assert!(samples.iter().all(|sample| sample.altitude_ft == 35_000.0));
    assert_eq!(traffic.tracks[0].callsign, "ABC1");
    assert_eq!(samples[3].time_s, f64::from(BEGIN_S) + 40.0);
}

#[test]
fn tracks_of_the_interfaces_of_flightradar24_and_flightaware_have_their_units() {
    let time = |k: u32| format_utc(f64::from(BEGIN_S + 10 * k));
    let mut radar = Vec::new();
    let mut aware = Vec::new();
    for k in 0..3 {
        let lon_deg = 7.0 + 0.03 * f64::from(k);
        let time = time(k);
        radar.push(format!(
            r#"{{"timestamp":"{time}","lat":47.0,"lon":{lon_deg:.2},"alt":35000,"gspeed":440,"vspeed":0,"track":90,
            "callsign":"ABC1","hex":"AAAAA1"}}"#
        ));
        aware.push(format!(
            r#"{{"altitude":350,"groundspeed":440,"heading":90,"latitude":47.0,"longitude":{lon_deg:.2},"timestamp":"{time}"}}"#
        ));
    }
    let radar = format!(r#"[{{"fr24_id":"x","tracks":[{}]}}]"#, radar.join(","));
    assert_east_flight(&read_text(&radar), 3);
    let aware =
        format!(r#"{{"fa_flight_id":"ABC1-1","ident":"ABC1","positions":[{}]}}"#, aware.join(","));
    let traffic = read_text(&aware);
    assert_eq!(traffic.tracks[0].flight_id, "ABC1-1");
    let sample = traffic.tracks[0].samples[2];
    assert_eq!((sample.altitude_ft, sample.ground_speed_kt), (35_000.0, Some(440.0)));
}

#[test]
fn messages_of_base_station_are_put_together_by_aircraft() {
    let mut text = String::from("SEL,,496,2286,4CA4E5,27215,2018/08/01,09:15:00.000,x,x,RYR1427\n");
    for k in 0..4 {
        let stamp = format_utc(f64::from(BEGIN_S + 10 * k));
        let (date, clock) = (stamp[..10].replace('-', "/"), &stamp[11..19]);
        let head = format!("1,1,AAAAA1,1,{date},{clock}.000,{date},{clock}.000");
        let lon_deg = 7.0 + 0.03 * f64::from(k);
        writeln!(text, "MSG,4,{head},,,440,90,,,0,,0,0,0,0").unwrap();
        writeln!(text, "MSG,1,{head},ABC1    ,,,,,,,,,,,0").unwrap();
        writeln!(text, "MSG,3,{head},,35000,,,47.0,{lon_deg:.2},,,0,0,0,0").unwrap();
        writeln!(
            text,
            "MSG,2,1,1,BBBBB2,1,{date},{clock}.000,{date},{clock}.000,,,12,90,47.1,7.1,,,0,0,0,-1"
        )
        .unwrap();
    }
    text.push_str("MSG,3,cut\n");
    let traffic = read_text(&text);
    assert_east_flight(&traffic, 4);
    assert_eq!(traffic.report.format, "messages of BaseStation (SBS-1)");
    assert_eq!(finding(&traffic, "on the ground").map(|found| found.count), Some(4));
    assert_eq!(finding(&traffic, "no message of 22 fields").map(|found| found.count), Some(1));
}

#[test]
fn a_speed_of_long_ago_is_not_that_of_a_position() {
    let line = |kind: u32, k: u32, rest: &str| {
        format!(
            "MSG,{kind},1,1,AAAAA1,1,2018/08/01,09:15:{k:02}.000,2018/08/01,09:15:{k:02}.000,{rest}\n"
        )
    };
    let mut text = line(4, 0, ",,440,90,,,0,,0,0,0,0");
    for k in 1..20 {
        text.push_str(&line(
            3,
            k,
            &format!(",35000,,,47.0,{:.4},,,0,0,0,0", 7.0 + 0.003 * f64::from(k)),
        ));
    }
    let samples = &read_text(&text).tracks[0].samples;
    assert_eq!(samples[0].ground_speed_kt, Some(440.0));
    assert_eq!(samples[18].ground_speed_kt, None);
}

#[test]
fn a_call_sign_that_takes_a_page_is_none() {
    let head = "1,1,AAAAA1,1,2018/08/01,09:15:0";
    let mut text =
        format!("MSG,1,{head}0.000,2018/08/01,09:15:00.000,{},,,,,,,,,,,0\n", "X".repeat(5000));
    for k in 1..5 {
        let lon_deg = 7.0 + 0.003 * f64::from(k);
        writeln!(
            text,
            "MSG,3,{head}{k}.000,2018/08/01,09:15:0{k}.000,,35000,,,47.0,{lon_deg:.4},,,0,0,0,0"
        )
        .unwrap();
    }
    let traffic = read_text(&text);
    assert_eq!(finding(&traffic, "no message of 22 fields").map(|found| found.count), Some(1));
    assert_eq!(traffic.tracks[0].callsign, "");
}

#[test]
fn tables_that_a_shell_of_a_database_drew_are_read() {
    let text = table(5, |_, row| row).replace(',', " | ");
    let mut drawn = String::new();
    let border = "+-----+-----+\n";
    for (k, line) in text.lines().enumerate() {
        drawn.push_str(if k < 2 { border } else { "" });
        writeln!(drawn, "| {line} |").unwrap();
    }
    drawn.push_str(border);
    assert_east_flight(&read_text(&drawn), 5);
    assert_east_flight(&read_text(&text), 5);
}

#[test]
fn texts_in_utf16_are_read_and_bytes_of_other_alphabets_are_counted() {
    let text = table(3, |_, row| row);
    let options = TrafficOptions::default();
    let with_mark = format!("\u{feff}{text}");
    let mut files: Vec<Vec<u8>> = vec![
        with_mark.encode_utf16().flat_map(u16::to_le_bytes).collect(),
        with_mark.encode_utf16().flat_map(u16::to_be_bytes).collect(),
        text.encode_utf16().flat_map(u16::to_le_bytes).collect(),
    ];
    for file in files.drain(..) {
        assert_east_flight(&from_bytes(&"f", file, &options).expect("UTF-16"), 3);
    }
    let note = table(9, |k, row| if k == 4 { row.replace("ABC1", "AB\u{1}1") } else { row });
    let latin: Vec<u8> = note.bytes().map(|b| if b == 1 { 0xdc } else { b }).collect();
    let traffic = from_bytes(&"f", latin, &options).expect("one bad name");
    let found = finding(&traffic, "not UTF-8").expect("a rule");
    assert_eq!((found.treatment, found.count), (Treatment::Repaired, 1));
    assert_eq!(found.places, ["line 6"]);
    let error = from_bytes(&"f", vec![b'a', 0xff, b'\n', 0xfe], &options).expect_err("mostly bad");
    assert!(error.cause().contains("neither a text"), "{error}");
}

#[test]
fn aircraft_on_the_ground_need_no_level() {
    let mut states = String::new();
    for k in 0..4 {
        let time_s = BEGIN_S + 10 * k;
        let lon_deg = 7.0 + 0.03 * f64::from(k);
        let ground = (0..3).map(|n| {
            format!(r#"["bbbbb{n}","X{n}","X",{time_s},{time_s},8.5,47.4,null,true,3.0,90.0,null,null,null,null,false,0],"#)
        });
        writeln!(
            states,
            r#"{{"time":{time_s},"states":[{}["aaaaa1","ABC1","X",{time_s},{time_s},{lon_deg:.2},47.0,10668.0,false,226.4,90.0,0.0,null,10900.0,null,false,0]]}}"#,
            ground.collect::<String>()
        )
        .unwrap();
    }
    let traffic = read_text(&states);
    assert_east_flight(&traffic, 4);
    assert_eq!(traffic.report.dropped(), 0, "{:?}", traffic.report);
    assert_eq!(finding(&traffic, "on the ground").map(|found| found.count), Some(12));
}

#[test]
fn what_follows_a_broken_line_of_json_is_read() {
    let state = |k: u32| {
        let time_s = BEGIN_S + 10 * k;
        let lon_deg = 7.0 + 0.03 * f64::from(k);
        format!(
            r#"{{"time":{time_s},"states":[["aaaaa1","ABC1","X",{time_s},{time_s},{lon_deg:.2},47.0,10668.0,false,226.4,90.0,0.0,null,10900.0,null,false,0]]}}"#
        )
    };
    let lines: Vec<String> = (0..6).map(state).collect();
    let cut = format!("{}\n{}\n{}", lines[..3].join("\n"), &lines[3][..90], lines[4..].join("\n"));
    let traffic = read_text(&cut);
    assert_eq!(traffic.tracks[0].samples.len(), 5, "{:?}", traffic.report);
    let found = finding(&traffic, "no JSON").expect("a rule");
    assert_eq!((found.count, &found.places[..]), (1, &["line 4".to_string()][..]));
    assert!(parse(&"f", &lines[0][..90]).is_err(), "nothing was read before");
    let list = format!("[{}]", lines.join(",\n"));
    let traffic = read_text(&list[..list.len() - 30]);
    assert_eq!(traffic.tracks[0].samples.len(), 5, "{:?}", traffic.report);
    let found = finding(&traffic, "no JSON").expect("a rule");
    assert_eq!((found.count, &found.places[..]), (1, &["line 6".to_string()][..]));
}

#[test]
fn more_than_half_left_out_after_reading_is_refused_with_what_helps() {
    // Days since 1900, as spreadsheets count.
    let days = table(20, |k, row| {
        row.replacen(
            &(BEGIN_S + 10 * k).to_string(),
            &format!("{:.9}", 43_313.0 + f64::from(k) / 8640.0),
            1,
        )
    });
    let error = parse(&"f", &days).expect_err("times are days");
    assert!(error.remedy().contains("not days"), "{error}");
    let whole_minutes = table(20, |k, row| {
        row.replacen(&(BEGIN_S + 10 * k).to_string(), &(BEGIN_S + k / 6 * 60).to_string(), 1)
    });
    let error = parse(&"f", &whole_minutes).expect_err("six rows have one time");
    assert!(
        error.cause().contains("16 of 20 rows") && error.remedy().contains("digits"),
        "{error}"
    );
}

#[test]
fn several_positions_of_one_second_without_fractions_are_kept_once() {
    // Four a second, at 440 kt.
    let position =
        |k: u32, row: String, step_deg: f64| {
            let lon_deg = format!(",{:.5},", 7.0 + step_deg * f64::from(k));
            row.replacen(&(BEGIN_S + 10 * k).to_string(), &(BEGIN_S + k / 4).to_string(), 1)
                .replacen(&format!(",{:.2},", 7.0 + 0.03 * f64::from(k)), &lon_deg, 1)
        };
    let traffic = read_text(&table(40, |k, row| position(k, row, 0.000_75)));
    assert_eq!(traffic.report.dropped(), 0, "{:?}", traffic.report);
    assert_eq!((traffic.tracks[0].samples.len(), traffic.repeated_rows), (10, 30));
    let found = finding(&traffic, "rows of one second").expect("a rule");
    assert_eq!((found.treatment, found.count), (Treatment::Repaired, 30));
    // Farther than it flies in a second, which fractions would not explain.
    assert!(parse(&"f", &table(40, |k, row| position(k, row, 0.01))).is_err());
    let fractions = table(40, |k, row| {
        position(k, row, 0.000_75).replacen(
            &(BEGIN_S + k / 4).to_string(),
            &format!("{}.5", BEGIN_S + k / 4),
            1,
        )
    });
    assert!(parse(&"f", &fractions).is_err(), "these times have fractions");
}

#[test]
fn rows_of_one_aircraft_far_apart_are_no_picture_of_one_instant() {
    let hourly = table(3, |k, row| {
        row.replacen(&(BEGIN_S + 10 * k).to_string(), &(BEGIN_S + 3600 * k).to_string(), 1)
    });
    let error = parse(&"f", &hourly).expect_err("three rows an hour apart");
    assert!(error.cause().contains("import.max_gap_s"), "{error}");
}

#[test]
fn directions_that_are_not_those_of_motion_are_named_once() {
    let radians = read_text(&table(12, |_, row| row.replace(",90,", ",1.5708,")));
    let found = finding(&radians, "move in a direction").expect("a rule");
    assert_eq!((found.treatment, found.count), (Treatment::Suspicious, 1));
    assert!(found.rule.contains("88 deg") && found.rule.contains("radians"), "{}", found.rule);
    let reversed = read_text(&table(12, |_, row| row.replace(",90,", ",270,")));
    assert!(finding(&reversed, "180 deg").is_some(), "{:?}", reversed.report);
    let crosswind = read_text(&table(12, |_, row| row.replace(",90,", ",65,")));
    assert!(finding(&crosswind, "direction").is_none(), "{:?}", crosswind.report);
}

#[test]
fn positions_at_0_0_and_far_away_do_not_hide_each_other() {
    let zero = read_text(&table(31, |k, row| {
        if k % 7 == 0 {
            row.replace(",47,", ",0,")
                .replace(&format!(",{:.2},", 7.0 + 0.03 * f64::from(k)), ",0,")
        } else {
            row
        }
    }));
    assert_eq!(finding(&zero, "stand for no position").map(|found| found.count), Some(5));
    assert_eq!(zero.tracks[0].samples.len(), 26);
    let over_it = read_text(&table(31, |k, row| {
        let longitude = format!("{:.2}", 7.0 + 0.03 * f64::from(k));
        let shifted = format!("{:?}", 0.03 * (f64::from(k) - 15.0));
        row.replace(",47,", ",0,").replace(&format!(",{longitude},"), &format!(",{shifted},"))
    }));
    assert_eq!(over_it.tracks[0].samples.len(), 31, "{:?}", over_it.report);
    let elsewhere =
        read_text(&table(31, |k, row| if k % 7 == 3 { row.replace(",47,", ",-12,") } else { row }));
    let far = finding(&elsewhere, "does not lead to").expect("a rule");
    assert_eq!((far.treatment, far.count), (Treatment::Suspicious, 4), "{:?}", elsewhere.report);
    assert_eq!(elsewhere.tracks[0].samples.len(), 27, "nothing reaches these rows");
}

#[test]
fn a_flight_that_is_faster_than_anything_is_left_out() {
    let jumps = |k: u32, row: String| if k % 3 == 1 { row.replace(",47,", ",48,") } else { row };
    let good: String =
        table(30, |_, row| row.replace("aaaaa1,ABC1,47", "bbbbb2,XYZ9,40")).split_off(HEADER.len());
    let traffic = read_text(&(table(12, jumps) + &good));
    assert_eq!(finding(&traffic, "faster than anything").map(|found| found.count), Some(12));
    assert_eq!(traffic.tracks.len(), 1);
    assert!(parse(&"f", &table(12, jumps)).is_err(), "nothing remains");
}

#[test]
fn a_number_that_stands_for_no_speed_is_none() {
    let traffic = read_text(&table(12, |_, row| row.replace(",440,", ",9999,")));
    assert_eq!(finding(&traffic, "a speed that is none").map(|found| found.count), Some(12));
    assert_eq!(traffic.tracks[0].samples[3].ground_speed_kt, None);
}

#[test]
fn levels_at_which_nobody_flies_so_fast_are_named_once() {
    for altitude in ["350", "0"] {
        let low = read_text(&table(12, |_, row| row.replace(",35000,", &format!(",{altitude},"))));
        let found = finding(&low, "faster than 300 kt").expect("a rule");
        assert_eq!((found.treatment, found.count), (Treatment::Suspicious, 1));
    }
}

#[test]
fn a_row_that_is_fast_and_low_says_nothing_of_its_column() {
    let light = |k: u32, row: String| {
        let row = row.replace(",440,", ",110,").replace(",35000,", ",800,");
        let lon_deg = 7.0 + 0.03 * f64::from(k);
        let slow = row
            .replace(&format!(",{lon_deg:.2},"), &format!(",{:.4},", 7.0 + 0.0075 * f64::from(k)));
        if k == 9 { slow.replace(",110,", ",310,") } else { slow }
    };
    let traffic = read_text(&table(30, light));
    assert!(finding(&traffic, "faster than 300 kt").is_none(), "{:?}", traffic.report);
}

#[test]
fn a_cell_with_its_unit_says_what_to_write() {
    for (change, wanted) in [
        (("35000", "35000ft"), "plain numbers in the unit"),
        ((",47,", ",47d,"), "negative in the south"),
        (("15331", "x15331"), "2018-08-01T09:00:00Z"),
    ] {
        let error = parse(&"f", &table(4, |_, row| row.replace(change.0, change.1)));
        let error = error.expect_err(change.1);
        assert!(error.remedy().contains(wanted), "{error}");
    }
}

#[test]
fn files_of_maps_say_what_to_give_in_their_place() {
    let line = r#"{"type":"FeatureCollection","features":[]}"#;
    let xml = r#"<?xml version="1.0"?><gpx version="1.1"><trk/></gpx>"#;
    for text in [line, xml] {
        let error = parse(&"f", text).expect_err("no table");
        for column in ["`time_s`", "`lat_deg`", "`alt_m`"] {
            assert!(error.remedy().contains(column), "{error}");
        }
    }
}

#[test]
fn traffic_is_known_by_its_first_lines_where_the_name_tells_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let message = "MSG,3,1,1,AAAAA1,1,2018/08/01,09:15:00.000,2018/08/01,09:15:00.000,,35000,,,47,7,,,0,0,0,0\n";
    for (name, text, is_known) in [
        ("a.txt", table(3, |_, row| row), true),
        ("log", message.to_string(), true),
        ("map.txt", "###\n#.#\n###\n".to_string(), false),
        ("notes.txt", "a, b and c\n1, 2\n".to_string(), false),
        ("a.toml", table(3, |_, row| row), false),
    ] {
        let path = folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        assert_eq!(is_traffic(&path), is_known, "{name}");
    }
}
