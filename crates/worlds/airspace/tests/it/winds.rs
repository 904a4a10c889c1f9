//! Winds by height and place from end to end: the shipped scenario, files, methods, and the rows of a run.

use sidestep_airspace::{Airspace, AirspaceRun, airspace_run};
use sidestep_kernel::Simulation;
use sidestep_scenario::{Source, WorldType};
use std::path::Path;

const METHODS: [&str; 4] = ["pc", "mvp", "orca", "none"];

fn scenario(airspace: &str, rest: &str) -> String {
    format!("format = 1\nworld = \"airspace\"\n[airspace]\n{airspace}\n{rest}")
}

fn run(text: &str, folder: &Path, workers: usize) -> AirspaceRun {
    airspace_run(&Source::new("winds", text, folder), workers).expect("a scenario")
}

#[test]
fn in_the_shipped_scenario_all_arrive_by_every_method_and_nobody_is_named() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../scenarios/airspace/wind-layers.toml");
    let Ok(text) = std::fs::read_to_string(path) else { return };
    for method in METHODS {
        let text = text.replace("[airspace]\n", &format!("[airspace]\nmethod = \"{method}\"\n"));
        let mut one = run(&text, Path::new(""), 1);
        let mut two = run(&text, Path::new(""), 2);
        one.advance(300);
        two.advance(300);
        assert_eq!(one.digest(), two.digest(), "{method}: the workers make no difference");
        let metrics = one.metrics();
        assert_eq!((metrics.arrived, metrics.losses_of_separation), (6, 0), "{method}");
        assert!(metrics.too_close.is_empty(), "{method}: {:?}", metrics.too_close);
    }
}

/// Two that fly the same way on levels 100 m apart, the lower one behind: in still air they keep their distance, and a tail
/// wind below would bring the one behind too near.
#[test]
fn every_method_sees_that_another_one_comes_nearer_because_it_is_in_another_wind() {
    let layers = "winds = [{ altitude_m = 0, wind_m_s = [20, 0] }, { altitude_m = 100, wind_m_s = [-10, 0] }]";
    let flight = |x_m: f64, y_m: f64, altitude_m: f64| {
        format!(
            "[[airplanes]]\nat_m = [{x_m:?}, {y_m:?}]\nheading_deg = 0\nway_points_m = [[{:?}, {y_m:?}]]\n\
             altitude_m = {altitude_m:?}\n",
            x_m + 12_000.0
        )
    };
    let airplanes = flight(-3000.0, 20.0, 0.0) + &flight(0.0, 0.0, 100.0);
    let nearest_m = |airspace: &str| {
        let mut run = run(&scenario(airspace, &airplanes), Path::new(""), 1);
        run.advance(400);
        assert_eq!(run.metrics().arrived, 2, "{airspace}");
        run.metrics().min_separation_m.unwrap_or(f64::INFINITY)
    };
    assert!(nearest_m("method = \"none\"\nshield = \"off\"") > 2900.0, "in still air");
    assert!(nearest_m(&format!("method = \"none\"\nshield = \"off\"\n{layers}")) < 100.0);
    for method in ["pc", "mvp", "orca"] {
        let found_m = nearest_m(&format!("method = \"{method}\"\nshield = \"off\"\n{layers}"));
        assert!(found_m >= 500.0, "{method}: {found_m}");
    }
    for method in METHODS {
        let found_m = nearest_m(&format!("method = \"{method}\"\n{layers}"));
        assert!(found_m >= 500.0, "{method} under the shield: {found_m}");
    }
}

#[test]
fn a_file_of_winds_is_flown_as_layers_are_and_stays_with_the_run() {
    let folder = tempfile::tempdir().expect("a folder");
    let csv = "# from a forecast\naltitude_m;east_m_s;north_m_s\n1000;12,5;-3\n0;2;1\n";
    std::fs::write(folder.path().join("forecast.csv"), csv).expect("a file");
    let flight = "[[airplanes]]\nat_m = [0, 0]\nheading_deg = 0\nway_points_m = [[9000, 0]]\naltitude_m = 300\n\
                  orders = [{ at_s = 30, altitude_m = 800 }]\n";
    let layers = "winds = [{ altitude_m = 0, wind_m_s = [2, 1] }, { altitude_m = 1000, wind_m_s = [12.5, -3] }]";
    let text = scenario("wind_file = \"forecast.csv\"", flight);
    let mut by_file = run(&text, folder.path(), 1);
    let mut by_keys = run(&scenario(layers, flight), Path::new(""), 1);
    by_file.advance(400);
    by_keys.advance(400);
    let places = |run: &AirspaceRun| run.state().airplanes[0].pose();
    assert_eq!(places(&by_file), places(&by_keys));
    assert_eq!(by_file.metrics().arrived, 1);
    assert_eq!(by_file.metrics().mean_delay_percent, by_keys.metrics().mean_delay_percent);
    let source = Source::new("winds", text, folder.path());
    let compiled = Airspace::new().compile(&source).expect("a scenario");
    let resolved = compiled.resolve(&source).expect("resolved");
    assert_eq!(resolved.files.len(), 1);
    assert!(resolved.text.contains(&resolved.files[0].0), "{}", resolved.text);
}

#[test]
fn in_a_wind_that_differs_from_place_to_place_airplanes_drift_as_it_blows_where_they_are() {
    let folder = tempfile::tempdir().expect("a folder");
    let csv = "x_m,y_m,east_m_s,north_m_s\n0,0,0,0\n0,1,0,0\n10000,0,0,12\n10000,1,0,12\n";
    std::fs::write(folder.path().join("grid.csv"), csv).expect("a file");
    let flight = "[[airplanes]]\nat_m = [0, 0]\nheading_deg = 0\nway_points_m = [[1e6, 0]]\n\
                  orders = [{ at_s = 0, heading_deg = 0 }]\n";
    let text = scenario("wind_file = \"grid.csv\"", flight);
    let mut run = run(&text, folder.path(), 1);
    run.advance(100);
    // It keeps its track against a crosswind, and so comes along more slowly the farther it is in it.
    let [x_m, y_m] = run.state().airplanes[0].pose().at;
    assert!(y_m.abs() < 60.0, "{y_m}");
    assert!(x_m > 16_000.0 && x_m < 35.0 * 500.0 - 100.0, "{x_m}");
}

#[test]
fn what_a_file_of_winds_lacks_is_an_error_in_the_file() {
    let folder = tempfile::tempdir().expect("a folder");
    let flight = "[[airplanes]]\nat_m = [0, 0]\nheading_deg = 0\nway_points_m = [[9000, 0]]\n";
    for (csv, words) in [
        ("x_m,y_m,east_m_s,north_m_s\n0,0,1,2\n5,5,1,2\n", ["2 winds", "grid of 4"]),
        ("x_m,y_m,east_m_s,north_m_s\n0,0,1,2\n0,0,1,3\n", ["grid.csv:3", "a second wind"]),
        ("latitude_deg,longitude_deg,east_m_s,north_m_s\n0,0,1,2\n", ["origin_deg", "grid.csv"]),
        ("altitude_m,east_m_s\n0,1\n", ["north_m_s", "grid.csv"]),
    ] {
        std::fs::write(folder.path().join("grid.csv"), csv).expect("a file");
        let source = Source::new("w", scenario("wind_file = \"grid.csv\"", flight), folder.path());
        let error = airspace_run(&source, 1).expect_err("refused").to_string();
        assert!(words.iter().all(|word| error.contains(word)), "{csv}: {error}");
    }
}
