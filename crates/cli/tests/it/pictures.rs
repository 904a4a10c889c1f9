//! Pictures of runs of every world, by the real command.

use crate::support::{TestFolder, names};
use std::path::Path;

const SCENARIOS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenarios");

/// Pixels of a unit along an axis, by the labels of its ticks.
fn px_per_unit(svg: &str, anchor: &str, coordinate: &str) -> f64 {
    let value = |line: &str, name: &str| -> Option<f64> {
        line.split(&format!("{name}=\"")).nth(1)?.split('"').next()?.parse().ok()
    };
    let ticks: Vec<(f64, f64)> = svg
        .lines()
        .filter(|line| line.starts_with("<text") && line.contains(anchor))
        .filter_map(|line| {
            let words = line.split('>').nth(1)?.split('<').next()?.replace('−', "-");
            Some((words.parse().ok()?, value(line, coordinate)?))
        })
        .collect();
    assert!(ticks.len() > 1, "an axis has two ticks at least");
    // The first axis is that of the plan; a profile below it has another scale.
    let ((a, from), (b, to)) = (ticks[0], ticks[1]);
    ((to - from) / (b - a)).abs()
}

#[test]
fn every_shipped_scenario_is_drawn_with_a_meter_as_long_both_ways() {
    let place = TestFolder::new();
    let mut drawn = 0;
    for world in ["robots", "chain", "airspace"] {
        let folder = format!("{SCENARIOS}/{world}");
        let files = names(Path::new(&folder));
        for file in files.iter().filter(|name| name.ends_with(".toml")) {
            place.json(&[
                "run",
                &format!("{folder}/{file}"),
                "--set",
                "cycles=40",
                "--out",
                "r",
                "--replace",
            ]);
            let svg = place.read("r/trajectories.svg");
            assert!(svg.starts_with("<svg") && svg.contains("cycle"), "{file}");
            drawn += 1;
            if svg.contains("Shown: x") {
                continue;
            }
            let across = px_per_unit(&svg, r#"text-anchor="middle""#, "x");
            let upward = px_per_unit(&svg, r#"text-anchor="end""#, "y");
            assert!((across / upward - 1.0).abs() < 0.01, "{file}: {across} and {upward}");
        }
    }
    assert!(drawn >= 14, "{drawn}");
}

/// The elements of a picture that have this class.
fn of_class<'a>(svg: &'a str, class: &str) -> Vec<&'a str> {
    let mark = format!("class=\"{class}\"");
    svg.lines().filter(|line| line.contains(&mark)).collect()
}

#[test]
fn a_chain_shows_who_leads_and_where_to_go() {
    let place = TestFolder::new();
    let scenario = "format = 1\nworld = \"chain\"\ncycles = 60\n\
                    [[chains]]\nconnectors = 7\nat_m = [0.0, 0.0]\nrod_m = 0.5\n\
                    [[chains.tasks]]\nkind = \"targets\"\nconnector = 6\nspeed_m_s = 1.0\n\
                    targets_m = [[4.0, 1.0], [4.0, -1.0]]\n";
    place.write("led.toml", scenario);
    place.json(&["run", "led.toml", "--out", "r"]);
    let svg = place.read("r/trajectories.svg");
    // In the picture and in the legend.
    assert_eq!(of_class(&svg, "leader").len(), 2, "{svg}");
    assert_eq!(of_class(&svg, "target").len(), 3, "two in the picture, one in the legend: {svg}");
    assert!(svg.contains(">leader<") && svg.contains(">2</text>"), "{svg}");
}

#[test]
fn a_picture_in_space_has_numbers_on_its_axes() {
    let place = TestFolder::new();
    let file = format!("{SCENARIOS}/chain/arm.toml");
    place.json(&["run", &file, "--set", "cycles=20", "--out", "r"]);
    let svg = place.read("r/trajectories.svg");
    for axis in ["x (m)", "y (m)", "z (m)"] {
        assert!(svg.contains(axis), "{axis}");
    }
    let is_number = |line: &&str| {
        let words = line.split('>').nth(1).and_then(|rest| rest.split('<').next());
        line.starts_with("<text")
            && words.is_some_and(|w| w.replace('−', "-").parse::<f64>().is_ok())
    };
    assert!(svg.lines().filter(is_number).count() >= 9, "{svg}");
}

#[test]
fn recorded_traffic_is_drawn_with_callsigns_and_directions() {
    let place = TestFolder::new();
    let scenario = "format = 1\nworld = \"airspace\"\ncycles = 40\n\
                    [[airplanes]]\ncallsign = \"KLM204\"\nat_m = [0, 0]\nheading_deg = 0\n\
                    way_points_m = [[9000, 0]]\n\
                    [[airplanes]]\nat_m = [0, 4000]\nheading_deg = 0\nway_points_m = [[9000, 4000]]\n";
    place.write("sky.toml", scenario);
    place.json(&["run", "sky.toml", "--out", "r"]);
    let svg = place.read("r/trajectories.svg");
    assert!(svg.contains("KLM204") && svg.contains("airplane 1"), "{svg}");
    let directions = of_class(&svg, "direction").len() + of_class(&svg, "aircraft").len();
    assert_eq!(directions, 2, "each has a symbol, or an arrowhead on its track where it is gone");
}

#[test]
fn airplanes_are_drawn_in_plan_view_with_their_zones_and_routes() {
    let place = TestFolder::new();
    let file = format!("{SCENARIOS}/airspace/superconflict.toml");
    place.json(&["run", &file, "--set", "cycles=40", "--out", "r"]);
    let svg = place.read("r/trajectories.svg");
    for word in ["north (km)", "beginning of a track", "zone", "velocity", "route", "airplane 0"] {
        assert!(svg.contains(word), "{word}");
    }
    let trails = svg.matches(r#"class="trail""#).count();
    assert_eq!(trails, 10, "each airplane has its trail");
}
