//! Tables whose columns, cells and aircraft are written in ways of their own, and tables in JSON that is no list of rows.

use super::tests::finding;
use super::{RecordedTraffic, parse};
use crate::report::Treatment;
use std::fmt::Write as _;

const BEGIN_S: u32 = 1_533_114_900;
const HEADER: &str = "time_s,icao24,callsign,lat_deg,lon_deg,alt_ft,gs_kt,track_deg";

/// A table of an airplane that flies east at 440 kt at 35,000 ft, with these columns; `cells` gives a row by its number,
/// its time and its longitude.
fn table(header: &str, cells: impl Fn(u32, u32, f64) -> String) -> String {
    let mut text = format!("{header}\n");
    for k in 0..20 {
        let row = cells(k, BEGIN_S + 10 * k, 7.0 + 0.03 * f64::from(k));
        writeln!(text, "{row}").unwrap();
    }
    text
}

fn read_text(text: &str) -> RecordedTraffic {
    parse(&"f", text).unwrap_or_else(|error| panic!("{error}\n{text:.300}"))
}

/// Checks that a text is the flight of [`table`], in one part.
fn assert_flight(text: &str) -> RecordedTraffic {
    let traffic = read_text(text);
    assert_eq!(traffic.tracks.len(), 1, "{:?}", traffic.report);
    let samples = &traffic.tracks[0].samples;
    assert_eq!(samples.len(), 20, "{:?}", traffic.report);
    for (k, sample) in samples.iter().enumerate() {
        assert_eq!(sample.time_s, f64::from(BEGIN_S) + 10.0 * k as f64, "{text:.200}");
        assert_eq!(sample.position.lat_deg, 47.0);
        assert!((sample.position.lon_deg - (7.0 + 0.03 * k as f64)).abs() < 1e-9);
        assert!((sample.altitude_ft - 35_000.0).abs() < 1e-6, "{sample:?}");
    }
    traffic
}

#[test]
fn times_have_the_unit_that_their_column_names() {
    let milliseconds = table("time_ms,callsign,lat_deg,lon_deg,alt_ft", |_, t, lon| {
        format!("{t}000,A1,47,{lon:.2},35000")
    });
    assert_eq!(assert_flight(&milliseconds).report.findings, []);
    // As seconds, rows half a second apart would be 500 s apart, and flown so.
    let since_start = table("time_ms,callsign,lat_deg,lon_deg,alt_ft", |k, _, _| {
        format!("{},A1,47,{:.4},35000", 500 * k, 7.0 + 0.0015 * f64::from(k))
    });
    let traffic = read_text(&since_start);
    assert_eq!(traffic.tracks[0].samples[19].time_s, 9.5);
    assert_eq!(finding(&traffic, "before 1973").map(|f| f.treatment), Some(Treatment::Guessed));
}

#[test]
fn a_column_of_utc_counts_where_another_one_has_times_without_a_zone() {
    let clock = |s: u32| format!("2018-08-01T{:02}:{:02}:{:02}", s / 3600, s / 60 % 60, s % 60);
    let local = |t: u32| clock(t - 1_533_081_600 + 7200);
    let utc = |t: u32| clock(t - 1_533_081_600);
    let text = table("time,utc,callsign,lat,lon,alt_ft", |_, t, lon| {
        format!("{},{},A1,47,{lon:.2},35000", local(t), utc(t))
    });
    assert!(finding(&assert_flight(&text), "without a zone").is_none());
    let unix = table("timestamp,utc,callsign,lat,lon,alt_ft", |_, t, lon| {
        format!("{t},09:00,A1,47,{lon:.2},35000")
    });
    assert_flight(&unix);
    let alone = table("utc,callsign,lat,lon,alt_ft", |_, t, lon| {
        format!("{},A1,47,{lon:.2},35000", utc(t))
    });
    assert_flight(&alone);
}

#[test]
fn levels_and_halves_of_the_earth_are_read_with_their_letters() {
    let text = table("time_s,callsign,lat,lon,flight_level", |_, t, lon| {
        format!("{t},A1,47N,E{lon:.2},FL350")
    });
    assert_flight(&text);
    let in_feet =
        table("time_s,callsign,lat,lon,alt_ft", |_, t, lon| format!("{t},A1,N47,{lon:.2}e,FL350"));
    assert_flight(&in_feet);
    let west = read_text(&table("time_s,callsign,lat,lon,alt_ft", |_, t, lon| {
        format!("{t},A1,47S,{lon:.2}W,35000")
    }));
    let at = west.tracks[0].samples[0].position;
    assert_eq!([at.lat_deg, at.lon_deg], [-47.0, -7.0]);
    // Two signs are one too many.
    assert!(
        parse(&"f", &table(HEADER, |_, t, lon| format!("{t},a,A1,-47S,{lon},35000,440,90")))
            .is_err()
    );
}

#[test]
fn one_address_in_pairs_of_digits_is_one_aircraft() {
    let spellings = ["4b1234", "4B:12:34", "4B-12-34", "4b 12 34"];
    let text = table("time_s,icao24,lat,lon,alt_ft", |k, t, lon| {
        format!("{t},{},47,{lon:.2},35000", spellings[k as usize % 4])
    });
    assert!(finding(&assert_flight(&text), "several spellings").is_some());
}

#[test]
fn words_for_the_ground_are_flags_and_others_are_named() {
    let text = table(&format!("{HEADER},is_on_ground"), |k, t, lon| {
        let word = if k < 10 { "ground" } else { "airborne" };
        format!("{t},a,A1,47,{lon:.2},35000,440,90,{word}")
    });
    let traffic = read_text(&text);
    assert_eq!(traffic.tracks[0].samples.len(), 10);
    assert_eq!(finding(&traffic, "on the ground").map(|f| f.count), Some(10));
    let unknown = table(&format!("{HEADER},on_ground"), |_, t, lon| {
        format!("{t},a,A1,47,{lon:.2},35000,440,90,maybe")
    });
    let traffic = assert_flight(&unknown);
    let found = finding(&traffic, "flag for the ground").expect("it is named");
    assert_eq!((found.treatment, found.count), (Treatment::Dropped, 20));
}

#[test]
fn aircraft_that_taxi_are_on_the_ground_though_nothing_says_so_nor_how_fast_they_are() {
    let header = "time_s,callsign,lat_deg,lon_deg,alt_ft";
    let mut text = format!("{header}\n");
    for k in 0..60_u32 {
        // It taxies for 200 s, takes off, and stands again from 400 s on; another one only taxies.
        let lon_deg = 7.0 + 0.02 * f64::from(k.clamp(20, 40) - 20);
        let t = BEGIN_S + 10 * k;
        let taxi_deg = 47.0 + 2e-5 * f64::from(k);
        writeln!(text, "{t},A1,{taxi_deg:.5},{lon_deg:.2},1400").unwrap();
        writeln!(text, "{t},B2,{taxi_deg:.5},7.02,1400").unwrap();
    }
    let traffic = read_text(&text);
    assert_eq!(traffic.tracks.len(), 1, "{:?}", traffic.report);
    let samples = &traffic.tracks[0].samples;
    assert!((20..=26).contains(&samples.len()), "{}", samples.len());
    let found = finding(&traffic, "taken as on the ground").expect("it is named");
    assert_eq!(found.treatment, Treatment::Guessed);
    assert!(found.remedy.contains("ground_speed_kt=0"), "{found:?}");
}

#[test]
fn a_position_that_is_frozen_on_the_way_is_no_stand_on_the_ground() {
    let text = table("time_s,callsign,lat_deg,lon_deg,alt_ft", |k, t, lon| {
        let lon = if (8..14).contains(&k) { 7.24 } else { lon };
        format!("{t},A1,47,{lon:.2},35000")
    });
    let traffic = read_text(&text);
    assert_eq!(traffic.tracks[0].samples.len(), 20, "{:?}", traffic.report);
    assert!(finding(&traffic, "while the aircraft flies").is_some());
}

#[test]
fn rows_of_two_receivers_a_moment_apart_are_one_flight() {
    let mut text = String::from("time_s,icao24,lat_deg,lon_deg,alt_ft\n");
    for k in 0..40_u32 {
        let t = f64::from(BEGIN_S + 10 * k);
        let lon_deg = 7.0 + 0.03 * f64::from(k);
        writeln!(text, "{t},4b1234,47,{lon_deg:.5},35000").unwrap();
        writeln!(text, "{},4B1234,47.0001,{:.5},35000", t + 0.02, lon_deg - 0.002).unwrap();
    }
    let traffic = read_text(&text);
    assert_eq!(
        (traffic.tracks.len(), traffic.tracks[0].samples.len()),
        (1, 80),
        "{:?}",
        traffic.report
    );
    let v_m_s = traffic.tracks[0].median_speed_m_s().expect("it moves");
    assert!((v_m_s - 230.0).abs() < 30.0, "{v_m_s}");
}

#[test]
fn positions_in_radians_are_named_where_rows_report_speeds() {
    let text = table(HEADER, |_, t, lon| {
        let [lat, lon] = [47f64.to_radians(), lon.to_radians()];
        format!("{t},a,A1,{lat:.9},{lon:.9},35000,440,90")
    });
    let traffic = read_text(&text);
    let found = finding(&traffic, "in radians").expect("it is named");
    assert_eq!(found.treatment, Treatment::Suspicious);
}

#[test]
fn a_column_that_is_there_twice_is_read_once_and_named() {
    let text = table(&format!("{HEADER},lat_deg"), |_, t, lon| {
        format!("{t},a,A1,47,{lon:.2},35000,440,90,12")
    });
    let found = finding(&assert_flight(&text), "several times").cloned().expect("it is named");
    assert_eq!((found.treatment, found.places), (Treatment::Guessed, vec!["`lat_deg`".to_owned()]));
}

#[test]
fn states_without_a_time_of_their_own_have_that_of_their_position() {
    let header =
        "icao24,callsign,time_position,last_contact,longitude,latitude,baro_altitude,velocity";
    let text = table(header, |_, t, lon| format!("4b1234,A1,{t},{},{lon:.2},47,10668,226", t + 1));
    assert_flight(&text);
}

/// The rows of [`table`] as the library `traffic` names them, in JSON.
fn frame_rows() -> Vec<serde_json::Map<String, serde_json::Value>> {
    let row = |k: u32| {
        let value = serde_json::json!({
            "timestamp": u64::from(BEGIN_S + 10 * k) * 1000, "icao24": "4b1234", "callsign": "A1",
            "latitude": 47.0, "longitude": 7.0 + 0.03 * f64::from(k), "altitude": 35000, "groundspeed": 440,
        });
        value.as_object().expect("an object").clone()
    };
    (0..20).map(row).collect()
}

#[test]
fn tables_of_pandas_are_read_by_rows_by_columns_and_by_numbers() {
    let rows = frame_rows();
    let names: Vec<String> = rows[0].keys().cloned().collect();
    let by_column = |number: bool| {
        let column = |name: &String| -> serde_json::Value {
            let values = rows.iter().map(|row| row[name].clone());
            if number {
                let cells = values.enumerate().map(|(k, value)| (k.to_string(), value));
                return serde_json::Value::Object(cells.collect());
            }
            values.collect::<Vec<_>>().into()
        };
        let columns = names.iter().map(|name| (name.clone(), column(name)));
        serde_json::Value::Object(columns.collect())
    };
    let by_number = rows.iter().enumerate().map(|(k, row)| (k.to_string(), row.clone().into()));
    let lists: Vec<Vec<_>> =
        rows.iter().map(|row| names.iter().map(|name| row[name].clone()).collect()).collect();
    for (frame, value) in [
        ("columns", by_column(true)),
        ("lists", by_column(false)),
        ("index", serde_json::Value::Object(by_number.collect())),
        ("split", serde_json::json!({ "columns": names, "index": [0], "data": lists })),
        ("records", serde_json::json!(rows)),
    ] {
        let traffic = assert_flight(&value.to_string());
        assert!(finding(&traffic, "out of order").is_none(), "{frame}");
    }
}

#[test]
fn lists_of_virtual_radar_server_and_dump1090_are_read_with_their_units() {
    let mut radar = String::new();
    let mut decoder = String::new();
    for k in 0..20 {
        let t = BEGIN_S + 10 * k;
        let lon = 7.0 + 0.03 * f64::from(k);
        writeln!(
            radar,
            r#"{{"src":1,"acList":[{{"Icao":"4B1234","Call":"A1","Lat":47.0,"Long":{lon:.2},"Alt":35000,"GAlt":35100,"Spd":440.0,"Trak":90.0,"PosTime":{t}000,"Gnd":false}}]}}"#
        )
        .unwrap();
        writeln!(
            decoder,
            r#"{{"now":{t}.0,"aircraft":[{{"hex":"4b1234","flight":"A1","lat":47.0,"lon":{lon:.2},"altitude":35000,"speed":440,"track":90,"vert_rate":0,"seen_pos":0.1}}]}}"#
        )
        .unwrap();
    }
    for text in [radar, decoder] {
        let traffic = assert_flight(&text);
        assert_eq!(traffic.tracks[0].samples[0].ground_speed_kt, Some(440.0));
        assert!(finding(&traffic, "by their size").is_none(), "{:?}", traffic.report);
    }
}

#[test]
fn the_live_list_of_flightradar24_is_one_instant() {
    let row = |hex: &str, lon: f64, track: u32| {
        format!(
            r#"["{hex}",47.0,{lon},{track},35000,440,"1000","F-LSZH1","A320","HB-X",{BEGIN_S},"ZRH","LHR","LX1",0,64,"SWR1"]"#
        )
    };
    let text = format!(
        r#"{{"full_count":9,"version":4,"2d1a":{},"2d1b":{},"stats":{{"total":{{"ads-b":9}}}}}}"#,
        row("4B1234", 7.0, 90),
        row("4B1235", 8.0, 270)
    );
    let traffic = read_text(&text);
    assert!(traffic.is_snapshot && traffic.tracks.len() == 2, "{:?}", traffic.report);
    let sample = traffic.tracks[0].samples[0];
    assert_eq!((sample.ground_speed_kt, sample.track_deg), (Some(440.0), Some(90.0)));
    assert_eq!((sample.altitude_ft, sample.vertical_speed_fpm), (35_000.0, Some(64.0)));
}
