//! Areas from end to end: the shipped scenario, flights around areas, files, and the earth.

use sidestep_airspace::{AirspaceRun, airspace_run};
use sidestep_kernel::Simulation;
use sidestep_scenario::{Source, WorldType};
use std::path::Path;

const METHODS: [&str; 5] = ["pc", "mvp", "orca", "bands", "none"];

fn run(text: &str, workers: usize) -> AirspaceRun {
    airspace_run(&Source::new("areas", text, ""), workers).expect("a scenario")
}

fn scenario(airspace: &str, rest: &str) -> String {
    format!("format = 1\nworld = \"airspace\"\n[airspace]\n{airspace}\n{rest}")
}

fn airplane(at: [f64; 2], to: [f64; 2]) -> String {
    format!("[[airplanes]]\nat_m = {at:?}\nheading_deg = 0\nway_points_m = [{to:?}]\n")
}

#[test]
fn in_the_shipped_scenario_all_arrive_by_every_method_and_nobody_enters_an_area() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../scenarios/airspace/areas.toml");
    let Ok(text) = std::fs::read_to_string(path) else { return };
    for method in METHODS {
        let text = text.replace("method = \"pc\"", &format!("method = \"{method}\""));
        let mut run = run(&text, 2);
        run.advance(400);
        let metrics = run.metrics();
        assert_eq!((metrics.area_entries, metrics.losses_of_separation), (Some(0), 0), "{method}");
        assert!(metrics.exempt_areas.is_empty(), "{method}: {:?}", metrics.exempt_areas);
        assert_eq!((metrics.arrived, metrics.airplanes), (6, 6), "{method}: {metrics:?}");
    }
}

/// A cul-de-sac, open toward the airplane.
const CUL_DE_SAC: &str = "[[airspace.areas]]\npolygon_m = [[-1000, -3000], [4000, -3000], [4000, 3000], \
                          [-1000, 3000], [-1000, 2500], [3500, 2500], [3500, -2500], [-1000, -2500]]\n";

#[test]
fn flights_lead_out_of_a_cul_de_sac_by_every_method_with_the_shield_and_without() {
    let flight = airplane([0.0, 0.0], [9000.0, 0.0]);
    for method in METHODS {
        for shield in ["on", "off"] {
            let airspace = format!("method = \"{method}\"\nshield = \"{shield}\"");
            let mut run = run(&scenario(&airspace, &format!("{CUL_DE_SAC}{flight}")), 1);
            run.advance(400);
            let metrics = run.metrics();
            assert_eq!((metrics.arrived, metrics.area_entries), (1, Some(0)), "{method}, {shield}");
        }
    }
}

#[test]
fn a_fence_with_a_bay_is_flown_around_on_the_inside() {
    let fence = "[[airspace.areas]]\nkind = \"in\"\npolygon_m = [[-6000, -6000], [6000, -6000], [6000, 6000], \
                 [1000, 6000], [1000, -2000], [-1000, -2000], [-1000, 6000], [-6000, 6000]]\n";
    let flight = airplane([-4000.0, 3000.0], [4000.0, 3000.0]);
    for method in METHODS {
        let airspace = format!("method = \"{method}\"");
        let mut run = run(&scenario(&airspace, &format!("{fence}{flight}")), 1);
        run.advance(600);
        let metrics = run.metrics();
        assert_eq!((metrics.arrived, metrics.area_entries), (1, Some(0)), "{method}");
        assert!(metrics.exempt_areas.is_empty(), "{method}");
    }
}

/// Two of them, so that they optimize together; the cell comes from the side and crosses the route of both.
#[test]
fn all_methods_let_a_weather_cell_pass_or_fly_around_it() {
    let cell = "[[airspace.areas]]\ncircle = { at_m = [1500, 5000], radius_m = 900 }\nvelocity_m_s = [0.0, -15.0]\n";
    let flights =
        airplane([-8000.0, 0.0], [8000.0, 0.0]) + &airplane([-8000.0, 900.0], [8000.0, 900.0]);
    for method in METHODS {
        let airspace = format!("method = \"{method}\"");
        let mut run = run(&scenario(&airspace, &format!("{cell}{flights}")), 1);
        run.advance(400);
        let metrics = run.metrics();
        assert_eq!((metrics.arrived, metrics.area_entries_unreported), (2, Some(0)), "{method}");
        assert_eq!(metrics.losses_of_separation, 0, "{method}");
    }
}

#[test]
fn on_the_earth_areas_are_kept_clear_of_as_on_a_plane() {
    let sector = "[[airspace.areas]]\npolygon_deg = [[49.9, 14.3], [49.9, 14.6], [50.1, 14.6], [50.1, 14.3]]\n";
    let cell = "[[airspace.areas]]\ncircle = { at_deg = [50.3, 14.9], radius_m = 4000 }\nvelocity_m_s = [-20.0, -25.0]\n";
    let flight = |at: [f64; 2], to: [f64; 2]| {
        format!("[[airplanes]]\nat_deg = {at:?}\nheading_deg = 0\nway_points_deg = [{to:?}]\n")
    };
    let flights = flight([50.0, 13.8], [50.0, 15.2]) + &flight([49.98, 15.2], [49.99, 13.9]);
    let model = "[airplane]\nv_m_s = 200\nomega_max_deg_s = 2.0\nseparation_m = 5000\n";
    for method in METHODS {
        let airspace = format!("method = \"{method}\"");
        let mut run = run(&scenario(&airspace, &format!("{sector}{cell}{model}{flights}")), 1);
        run.advance(400);
        let metrics = run.metrics();
        assert_eq!((metrics.arrived, metrics.losses_of_separation), (2, 0), "{method}");
        assert_eq!(metrics.area_entries_unreported, Some(0), "{method}");
    }
}

#[test]
fn areas_of_a_file_are_those_of_keys_and_the_file_goes_with_the_run() {
    let folder = tempfile::tempdir().expect("a folder");
    let ring = "[[14.3, 49.9], [14.6, 49.9], [14.6, 50.1], [14.3, 50.1], [14.3, 49.9]]";
    let file = format!(
        "{{\"type\":\"Feature\",\"geometry\":{{\"type\":\"Polygon\",\"coordinates\":[{ring}]}},\
         \"properties\":{{\"name\":\"TSA\",\"floor_m\":100,\"ceiling_m\":900,\"class\":\"D\"}}}}"
    );
    std::fs::write(folder.path().join("tsa.geojson"), file).expect("written");
    let flight = "[[airplanes]]\nat_deg = [50.0, 13.8]\nheading_deg = 0\nway_points_deg = [[50.0, 15.2]]\n\
                  altitude_m = 500\n[airplane]\nv_m_s = 200\nomega_max_deg_s = 2\n";
    let keys = "[[airspace.areas]]\nname = \"TSA\"\nlevels_m = [100, 900]\n\
                polygon_deg = [[49.9, 14.3], [49.9, 14.6], [50.1, 14.6], [50.1, 14.3]]\n";
    let by_keys = run(&scenario("method = \"none\"", &format!("{keys}{flight}")), 1);
    let text = scenario("method = \"none\"\nareas_file = \"tsa.geojson\"", flight);
    let source = Source::new("areas", text, folder.path());
    let by_file = airspace_run(&source, 1).expect("a scenario");
    assert_eq!(by_file.world().areas, by_keys.world().areas);
    let compiled = sidestep_airspace::Airspace::new().compile(&source).expect("a scenario");
    let remarks: Vec<String> = compiled.remarks().iter().map(|one| one.words.clone()).collect();
    assert!(remarks.iter().any(|words| words.contains("`class`")), "{remarks:?}");
    let resolved = compiled.resolve(&source).expect("resolved");
    assert_eq!(resolved.files.len(), 1);
    assert!(resolved.text.contains(&resolved.files[0].0), "{}", resolved.text);
}

fn error(airspace: &str, areas: &str) -> String {
    let text = scenario(airspace, &format!("{areas}{}", airplane([0.0, 0.0], [9000.0, 0.0])));
    airspace_run(&Source::new("areas", text, ""), 1).expect_err(areas).to_string()
}

#[test]
fn areas_that_are_none_are_refused_with_a_remedy() {
    let of = |keys: &str| error("", &format!("[[airspace.areas]]\n{keys}\n"));
    for (keys, words) in [
        ("name = \"x\"", "one outline"),
        (
            "polygon_m = [[0, 0], [9, 0], [9, 9]]\ncircle = { at_m = [0, 0], radius_m = 5 }",
            "one outline",
        ),
        ("polygon_m = [[0, 0], [9, 0]]", "2 different corners"),
        ("polygon_m = [[0, 0], [9, 0], [0, 0], [0, 0]]", "2 different corners"),
        ("polygon_m = [[0, 0], [900, 900], [900, 0], [0, 900]]", "crosses itself"),
        ("polygon_deg = [[0, 0], [9, 0], [9, 9]]", "beside airplanes in meters"),
        ("circle = { at_deg = [50, 14], radius_m = 5 }", "beside airplanes in meters"),
        ("circle = { radius_m = 5 }", "one center"),
        ("circle = { at_m = [0, 0], radius_m = 0 }", "radius_m"),
        ("circle = { at_m = [0, 0], radius_m = 5 }\nlevels_m = [9, 3]", "levels from 9 to 3"),
        ("circle = { at_m = [0, 0], radius_m = 5 }\nlevels_m = [nan, 3]", "levels from NaN to 3"),
        ("circle = { at_m = [0, 0], radius_m = 5 }\nfrom_s = 9\nuntil_s = 9", "ends at 9 s"),
        ("circle = { at_m = [0, 0], radius_m = 5 }\nkind = \"off\"", "kind"),
    ] {
        let error = of(keys);
        assert!(error.contains(words), "{keys}: {error}");
    }
    assert!(error("areas_file = \"no-such.geojson\"", "").contains("no-such.geojson"));
}

#[test]
fn way_points_and_starts_in_areas_are_warned_of() {
    let areas = "[[airspace.areas]]\nname = \"A\"\ncircle = { at_m = [0, 0], radius_m = 500 }\n\
                 [[airspace.areas]]\nname = \"B\"\ncircle = { at_m = [9000, 0], radius_m = 500 }\n";
    let text = scenario("", &format!("{areas}{}", airplane([0.0, 0.0], [9000.0, 0.0])));
    let source = Source::new("areas", text, "");
    let compiled = sidestep_airspace::Airspace::new().compile(&source).expect("a scenario");
    let found: Vec<(String, String)> =
        compiled.remarks().into_iter().map(|one| (one.key, one.words)).collect();
    assert_eq!(found.len(), 2, "{found:?}");
    assert!(found[0].0 == "airspace.areas.0" && found[0].1.contains("A: airplane 0 begins"));
    assert!(
        found[1].0 == "airspace.areas.1" && found[1].1.contains("B: airplane 0 has a way-point")
    );
}

#[test]
fn results_with_areas_do_not_depend_on_the_number_of_workers() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../scenarios/airspace/areas.toml");
    if !Path::new(path).exists() {
        return;
    }
    let text = std::fs::read_to_string(path).expect("readable");
    let digest = |workers: usize| {
        let mut run = run(&text, workers);
        run.advance(80);
        (run.digest(), format!("{:?}", run.collector().counters.areas))
    };
    assert_eq!(digest(1), digest(3));
}
