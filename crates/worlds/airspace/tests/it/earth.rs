//! Geographic scenarios: what airplanes do on the earth is what a reference for geodesics says, wherever they are and
//! whoever else is there.

use geographiclib_rs::{DirectGeodesic, Geodesic, InverseGeodesic};
use serde_json::Value;
use sidestep_airspace::{AirspaceRun, airspace_run};
use sidestep_kernel::Simulation;
use sidestep_kernel::ports::{ColumnValues, MemoryRecorder};
use sidestep_kernel::stream::philox4x32;
use sidestep_scenario::Source;

const NAUTICAL_MILE_M: f64 = 1852.0;

/// An airplane: latitude and longitude, azimuth in degrees, and how far ahead its way-point lies.
#[derive(Clone, Copy)]
struct Flight {
    at_deg: [f64; 2],
    azimuth_deg: f64,
    ahead_m: f64,
}

fn ahead_deg([lat, lon]: [f64; 2], azimuth_deg: f64, length_m: f64) -> [f64; 2] {
    let (lat2, lon2): (f64, f64) = Geodesic::wgs84().direct(lat, lon, azimuth_deg, length_m);
    [lat2, lon2]
}

fn apart_m([lat1, lon1]: [f64; 2], [lat2, lon2]: [f64; 2]) -> f64 {
    Geodesic::wgs84().inverse(lat1, lon1, lat2, lon2)
}

impl Flight {
    fn text(&self, v_m_s: f64) -> String {
        let Self { at_deg, azimuth_deg, ahead_m } = *self;
        let goal_deg = ahead_deg(at_deg, azimuth_deg, ahead_m);
        let heading_deg = 90.0 - azimuth_deg;
        format!(
            "[[airplanes]]\nat_deg = {at_deg:?}\nheading_deg = {heading_deg:?}\n\
             way_points_deg = [{goal_deg:?}]\nv_m_s = {v_m_s:?}\n"
        )
    }
}

fn head(airspace: &str, airplane: &str) -> String {
    format!("format = 1\nworld = \"airspace\"\n[airspace]\n{airspace}\n[airplane]\n{airplane}\n")
}

fn run(text: String) -> AirspaceRun {
    airspace_run(&Source::new("earth", text, ""), 1).expect("a scenario")
}

/// Returns the smallest value of a function that falls and then rises at most once.
fn smallest(of: impl Fn(f64) -> f64, first: f64, last: f64) -> f64 {
    let (mut from, mut to) = (first, last);
    for _ in 0..24 {
        let third = (to - from) / 3.0;
        if of(from + third) < of(to - third) {
            to -= third;
        } else {
            from += third;
        }
    }
    of(0.5 * (from + to)).min(of(first)).min(of(last))
}

/// Numbers from 0 to 1, the same at each call.
fn uniform(k: u32, which: u32) -> f64 {
    f64::from(philox4x32([k, which, 7, 0], [1, 2])[0]) / f64::from(u32::MAX)
}

/// A place anywhere; one in four near a pole, one in four at the date line, one in four at the equator.
fn place_deg(k: u32) -> [f64; 2] {
    let [a, b, c] = [0, 1, 2].map(|which| uniform(k, which));
    let side = if c < 0.5 { -1.0 } else { 1.0 };
    match k % 4 {
        0 => [side * (90.0 - 0.6 * a), 360.0 * b - 180.0],
        1 => [140.0 * a - 70.0, side * (180.0 - 0.2 * b)],
        2 => [0.3 * (a - 0.5), 360.0 * b - 180.0],
        _ => [160.0 * a - 80.0, 360.0 * b - 180.0],
    }
}

/// Every pair flies some seconds; thousands of others are at that time all over the earth.
#[test]
fn separations_anywhere_on_earth_are_those_of_a_reference_for_geodesics() {
    const V_M_S: f64 = 250.0;
    const CYCLES: u64 = 3;
    const DT_S: f64 = 10.0;
    let mut text = head(
        "method = \"none\"\nshield = \"off\"\ndt_s = 10.0\ndtau_s = 5.0\nhorizon_s = 10.0",
        "separation_m = 15000.0\nomega_max_deg_s = 1.0",
    );
    let mut flights = Vec::new();
    for k in 0..1000_u32 {
        let at_deg = place_deg(k);
        let [aside, toward, turn] = [3, 4, 5].map(|which| uniform(k, which));
        let length_m = 200.0 + 49_800.0 * aside * aside;
        let other_deg = ahead_deg(at_deg, 360.0 * toward, length_m);
        for (at_deg, azimuth_deg) in [(at_deg, 360.0 * turn), (other_deg, 360.0 * aside)] {
            let flight = Flight { at_deg, azimuth_deg, ahead_m: 400_000.0 };
            text += &flight.text(V_M_S);
            flights.push(flight);
        }
    }
    let mut run = run(text);
    run.advance(CYCLES);
    let Value::Array(pairs) = Simulation::pair_metrics(&run) else { panic!("a list") };
    let mut compared = 0;
    for pair in &pairs {
        let [a, b] = [0, 1].map(|k| pair["airplanes"][k].as_u64().expect("an id") as usize);
        let apart_after_m = |seconds: f64| {
            let [p, q] = [a, b].map(|id| {
                let Flight { at_deg, azimuth_deg, .. } = flights[id];
                ahead_deg(at_deg, azimuth_deg, V_M_S * seconds)
            });
            apart_m(p, q)
        };
        let nearest_m = smallest(apart_after_m, 0.0, DT_S * CYCLES as f64);
        let found_m = pair["nearest_m"].as_f64().expect("a distance");
        let error_m = (found_m - nearest_m).abs();
        if nearest_m <= 50_000.0 {
            assert!(error_m < 1e-3 * nearest_m, "{a} {b}: {found_m} for {nearest_m}");
            // Most of the bar is left: a millionth, and what the search of the reference leaves.
            assert!(error_m < 1e-5 * nearest_m + 0.05, "{a} {b}: {found_m} for {nearest_m}");
        }
        compared += usize::from(b == a + 1 && a % 2 == 0);
    }
    assert_eq!(compared, 1000);
}

/// The public report of two airplanes near a pole that a plane put into one place.
#[test]
fn two_airplanes_that_cross_at_a_pole_lose_separation_when_they_are_there_and_not_before() {
    let airspace = "method = \"none\"\nshield = \"off\"\ndt_s = 5.0\ndtau_s = 1.0";
    let separation_m = 5.0 * NAUTICAL_MILE_M;
    let mut text =
        head(airspace, &format!("separation_m = {separation_m:?}\nomega_max_deg_s = 1.0"));
    for lon in [0.0, 180.0] {
        let flight = Flight { at_deg: [89.5, lon], azimuth_deg: 0.0, ahead_m: 120_000.0 };
        text += &flight.text(220.0);
    }
    let mut run = run(text);
    let start_m = apart_m([89.5, 0.0], [89.5, 180.0]);
    assert!((start_m - 60.3 * NAUTICAL_MILE_M).abs() < NAUTICAL_MILE_M);
    let lost_from_s = (start_m - separation_m) / 440.0;
    run.advance((lost_from_s / 5.0).floor() as u64);
    assert_eq!(run.metrics().losses_of_separation, 0);
    run.advance(40);
    let metrics = run.metrics();
    assert_eq!(metrics.losses_of_separation, 1);
    assert!((metrics.lost_s - 2.0 * separation_m / 440.0).abs() < 1e-3, "{}", metrics.lost_s);
    assert!(metrics.min_separation_m.is_some_and(|m| m < 0.1), "{:?}", metrics.min_separation_m);
    run.advance(100);
    assert_eq!(run.metrics().arrived, 2);
}

#[test]
fn what_happens_in_the_north_does_not_depend_on_who_flies_in_the_south() {
    let pair = [
        Flight { at_deg: [62.0, 5.0], azimuth_deg: 80.0, ahead_m: 90_000.0 },
        Flight { at_deg: [62.1, 6.2], azimuth_deg: 250.0, ahead_m: 90_000.0 },
    ];
    let far = Flight { at_deg: [-33.0, 18.0], azimuth_deg: 10.0, ahead_m: 90_000.0 };
    for method in ["pc", "mvp", "orca", "bands", "none"] {
        let airspace =
            format!("method = \"{method}\"\ndt_s = 10.0\ndtau_s = 5.0\nhorizon_s = 120.0");
        let text = |flights: &[Flight]| {
            let texts = flights.iter().map(|flight| flight.text(230.0));
            let airplane = "separation_m = 9260.0\nomega_max_deg_s = 1.0";
            head(&airspace, airplane) + &texts.collect::<String>()
        };
        let states = [&pair[..], &[pair[0], pair[1], far]].map(|flights| {
            let mut run = run(text(flights));
            run.advance(30);
            let airplanes = run.state().snapshot(30).airplanes;
            (airplanes[0], airplanes[1], Simulation::pair_metrics(&run)[0].clone())
        });
        assert_eq!(states[0], states[1], "{method}");
    }
}

#[test]
fn a_way_point_far_away_is_reached_on_the_shortest_path() {
    let (schiphol, kennedy) = ([52.3, 4.76], [40.64, -73.78]);
    let (length_m, azimuth_deg, _, _): (f64, f64, f64, f64) =
        Geodesic::wgs84().inverse(schiphol[0], schiphol[1], kennedy[0], kennedy[1]);
    let mut text = head(
        "method = \"none\"\nshield = \"off\"\ndt_s = 60.0\ndtau_s = 60.0\nhorizon_s = 60.0",
        "omega_max_deg_s = 1.0\nv_m_s = 250.0",
    );
    let heading_deg = 90.0 - azimuth_deg;
    text += &format!(
        "[[airplanes]]\nat_deg = {schiphol:?}\nheading_deg = {heading_deg:?}\nway_points_deg = [{kennedy:?}]\n"
    );
    let mut run = run(text);
    let half_way = (0.5 * length_m / (250.0 * 60.0)).round() as u64;
    run.advance(half_way);
    let [lon, lat] = run.state().airplanes[0].pose().at.map(f64::to_degrees);
    let due = ahead_deg(schiphol, azimuth_deg, half_way as f64 * 60.0 * 250.0);
    assert!(apart_m([lat, lon], due) < 1.0, "{lat} {lon} for {due:?}");
    run.advance(1000);
    let flight = Simulation::agent_metrics(&run)[0].clone();
    let flown_s = flight["flown_s"].as_f64().expect("it has arrived");
    assert!((flown_s - length_m / 250.0).abs() < 180.0, "{flown_s} for {}", length_m / 250.0);
    assert_eq!(flight["delay_percent"].as_f64().map(|percent| percent.abs() < 1e-9), Some(true));
}

/// Airplanes on a circle about a place, each bound for the opposite point.
fn conflict(center_deg: [f64; 2], n: u32, airspace: &str) -> String {
    let airplane = "separation_m = 9260.0\nomega_max_deg_s = 1.05\nv_m_s = 230.0";
    let mut text =
        head(&format!("dt_s = 10.0\ndtau_s = 5.0\nhorizon_s = 200.0\n{airspace}"), airplane);
    for k in 0..n {
        let azimuth = 360.0 * f64::from(k) / f64::from(n) + 3.0 * uniform(k, 9);
        let [from, to] = [azimuth, azimuth + 180.0].map(|deg| ahead_deg(center_deg, deg, 70_000.0));
        let (_, toward, _, _): (f64, f64, f64, f64) =
            Geodesic::wgs84().inverse(from[0], from[1], to[0], to[1]);
        let heading_deg = 90.0 - toward;
        text += &format!(
            "[[airplanes]]\nat_deg = {from:?}\nheading_deg = {heading_deg:?}\nway_points_deg = [{to:?}]\n"
        );
    }
    text
}

#[test]
fn under_the_shield_no_pair_loses_separation_anywhere_on_earth() {
    for center_deg in [[0.0, 0.0], [90.0, 0.0], [-89.9, 50.0], [0.1, 180.0], [67.0, -179.9]] {
        for method in ["none", "mvp", "pc"] {
            let mut run = run(conflict(center_deg, 5, &format!("method = \"{method}\"")));
            run.advance(60);
            let metrics = run.metrics();
            let about = format!("{method} about {center_deg:?}");
            assert_eq!(metrics.losses_of_separation, 0, "{about}");
            assert!(metrics.too_close.is_empty(), "{about}");
            let nearest_m = metrics.min_separation_m.expect("they have met");
            assert!((9260.0..20_000.0).contains(&nearest_m), "{about}: {nearest_m}");
        }
    }
}

#[test]
fn agents_that_exchange_messages_fly_on_earth_as_one_process_decides() {
    let digest = |deployment: &str| {
        let airspace = format!("deployment = \"{deployment}\"\nmax_rounds = 20");
        let mut run = run(conflict([80.0, 179.9], 4, &airspace));
        run.advance(25);
        run.digest()
    };
    let direct = digest("direct");
    for deployment in ["team", "compact-team", "pim", "hierarchical-pim"] {
        assert_eq!(digest(deployment), direct, "{deployment}");
    }
}

/// A chain from Lisbon to beyond Vienna: each has to consider the next, and so all decide together.
#[test]
fn a_chain_of_200_airplanes_over_3000_km_is_one_group_in_which_no_pair_loses_separation() {
    let mut text = head(
        "method = \"mvp\"\ndt_s = 10.0\ndtau_s = 5.0\nmvp = { look_ahead_s = 60.0 }",
        "separation_m = 9260.0\nomega_max_deg_s = 3.0\nv_m_s = 120.0",
    );
    let (start, azimuth_deg) = ([38.7, -9.1], 58.0);
    for k in 0..200 {
        let at_deg = ahead_deg(start, azimuth_deg, 15_075.0 * f64::from(k));
        let flight = Flight {
            at_deg,
            azimuth_deg: if k % 2 == 0 { 60.0 } else { 240.0 },
            ahead_m: 60_000.0,
        };
        text += &flight.text(120.0);
    }
    let mut run = run(text);
    let metrics = run.metrics();
    assert!(metrics.too_close.is_empty(), "{:?}", metrics.too_close);
    run.advance(20);
    assert_eq!(run.stats().groups.largest, 200);
    let metrics = run.metrics();
    assert_eq!(metrics.losses_of_separation, 0);
    assert!(metrics.min_separation_m.is_some_and(|m| m < 11_000.0), "they come near each other");
}

/// Shield, optimization, orders, a track, and errors of position and heading, over a pole.
#[test]
fn the_golden_digest_of_a_geographic_scenario_is_what_every_machine_gets() {
    let mut text = conflict([89.7, 20.0], 4, "position_noise_m = 20.0\nheading_noise_deg = 0.2")
        .replace("format = 1\n", "format = 1\nseed = 7\n");
    text += "orders = [{ at_s = 60.0, speed_m_s = 210.0 }, { at_s = 120.0, heading_deg = 30.0 },\n\
             { at_s = 200.0, way_points_deg = [[89.0, 0.0]] }]\n\
             [[airplanes]]\ntrack_deg = [[0, 89.0, 0, 0], [100, 89.1, 10, 0], [300, 89.2, 60, 0]]\n";
    let mut run = run(text);
    run.advance(60);
    assert_eq!(run.metrics().losses_of_separation, 0);
    assert_eq!(run.digest().to_string(), "79ab3ca8c0b536101e6b039469844cba");
}

#[test]
fn rows_say_where_on_earth_and_when() {
    let text =
        head("method = \"none\"\nshield = \"off\"\nstart_utc_s = 1533114900.0", "v_m_s = 200.0")
            + "[[airplanes]]\ncallsign = \"DAT1\"\nat_deg = [10.0, 179.99]\nheading_deg = 0.0\n\
           way_points_deg = [[10.0, -179.9]]\n";
    let mut run = run(text);
    run.start_recording();
    let mut recorder = MemoryRecorder::new(&run.schemas());
    run.advance(10);
    run.record(&mut recorder).expect("in memory");
    let numbers = |table: &str, name: &str| match recorder.column(table, name) {
        Some(ColumnValues::F64(values)) => values.clone(),
        other => panic!("{name}: {other:?}"),
    };
    let [lat, lon, utc_s, from_s] = ["latitude_deg", "longitude_deg", "utc_s", "from_s"]
        .map(|name| numbers("trajectories", name));
    assert!(lat.len() >= 10);
    for ((lat, lon), (utc_s, from_s)) in lat.iter().zip(&lon).zip(utc_s.iter().zip(&from_s)) {
        assert_eq!(*utc_s, 1_533_114_900.0 + from_s);
        let start_deg = [10.0, 179.99];
        let flown_m = apart_m(start_deg, [*lat, *lon]);
        assert!((flown_m - 200.0 * from_s).abs() < 0.01, "{flown_m} after {from_s} s");
    }
    assert!(lon.iter().any(|deg| *deg < -179.9) && lon.iter().all(|deg| deg.abs() <= 180.0));
}

#[test]
fn positions_in_a_plane_and_on_the_earth_do_not_mix() {
    let error = |airplanes: &str| {
        let text = head("", "") + airplanes;
        airspace_run(&Source::new("mixed", text, ""), 1).expect_err("wrong").to_string()
    };
    let in_plane = "[[airplanes]]\nat_m = [0, 0]\nheading_deg = 0\nway_points_m = [[700, 0]]\n";
    let on_earth = "[[airplanes]]\nat_deg = [10, 0]\nheading_deg = 0\nway_points_deg = [[11, 0]]\n";
    for mixed in [
        format!("{in_plane}{on_earth}"),
        "[[airplanes]]\nat_deg = [10, 0]\nheading_deg = 0\nway_points_m = [[700, 0]]\n".into(),
        format!("[airspace.generator]\nkind = \"random\"\nn = 3\n{on_earth}"),
    ] {
        assert!(error(&mixed).contains("positions in degrees"), "{}", error(&mixed));
    }
    let beyond =
        error("[[airplanes]]\nat_deg = [91, 0]\nheading_deg = 0\nway_points_deg = [[11, 0]]\n");
    assert!(beyond.contains("latitude of 91"), "{beyond}");
    let wind = format!("[airspace]\nwind_m_s = [10, 0]\n{on_earth}");
    let text = format!("format = 1\nworld = \"airspace\"\n{wind}");
    let wind =
        airspace_run(&Source::new("w", text.clone(), ""), 1).expect_err("a drift").to_string();
    assert!(wind.contains("shield = \"off\""), "{wind}");
    let bare = text.replace("wind_m_s", "shield = \"off\"\nwind_m_s");
    assert!(airspace_run(&Source::new("w", bare, ""), 1).is_ok());
}
