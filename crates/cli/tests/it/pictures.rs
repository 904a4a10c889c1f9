//! Pictures of runs of every world, by the real command.

use crate::support::{Place, names};
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
    let ((a, from), (b, to)) = (ticks[0], ticks[ticks.len() - 1]);
    assert!(ticks.len() > 1, "an axis has two ticks at least");
    ((to - from) / (b - a)).abs()
}

#[test]
fn every_shipped_scenario_is_drawn_with_a_meter_as_long_both_ways() {
    let place = Place::new();
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

#[test]
fn airplanes_are_drawn_with_their_zones_starts_and_goals() {
    let place = Place::new();
    let file = format!("{SCENARIOS}/airspace/superconflict.toml");
    place.json(&["run", &file, "--set", "cycles=40", "--out", "r"]);
    let svg = place.read("r/trajectories.svg");
    for word in ["start", "goal", "zone of separation", "airplane 0", "km"] {
        assert!(svg.contains(word), "{word}");
    }
    let trails = svg.matches(r#"class="trail""#).count();
    assert_eq!(trails, 10, "each airplane has its trail");
}
