//! Charts show the metrics of `sidestep run --cycles N --json`, live and replayed, whatever the way of a page through the
//! run.

use super::recordings::{made_by_another, opened, recorded, wait_for_verdict};
use super::*;
use serde_json::Map;

/// A chain with targets: the progress of one that wanders is a share of the planned number of cycles, which differs here.
const ARRIVING_CHAINS: &str = "format = 1\nworld = \"chain\"\ncycles = 60\n[[obstacles]]\nat_m = [3.0, 0.3]\n\
    radius_m = 0.4\n[[chains]]\nconnectors = 4\nat_m = [0.0, 0.0]\nrod_m = 0.7\n[[chains.tasks]]\n\
    kind = \"targets\"\ntargets_m = [[2.5, 0.0]]\n";

/// Number of cycles at which charts are compared.
const COMPARED_CYCLES: u64 = 50;

/// The scenarios, a world each, and their last cycles.
const SCENARIOS: [(&str, u64); 3] = [(ROBOTS, 600), (ARRIVING_CHAINS, 60), (AIRPLANES, 40)];

/// Returns the metrics of a run of so many cycles.
fn plain_metrics(text: &str, cycles: u64) -> Value {
    let source = Source::new("s.toml", text, "");
    let source = source.with_overrides(&[format!("cycles={cycles}")]).expect("a key");
    let mut run = WORLDS.compile(&source).expect("valid").start(&source, 1);
    while run.cycle() < cycles && run.advance(cycles - run.cycle()) > 0 {}
    assert_eq!(run.cycle(), cycles);
    run.metrics()
}

/// Returns the number that a chart shows of a metric of a summary.
fn charted(metrics: &Value, key: &str) -> Option<f64> {
    let value = |name: &str| metrics.pointer(&format!("/{}", name.replace('.', "/")));
    match value(key) {
        Some(Value::Bool(flag)) => Some(f64::from(u8::from(*flag))),
        Some(value) => value.as_f64(),
        None => {
            let list = key.strip_suffix("_count").and_then(value);
            Some(list.unwrap_or_else(|| panic!("no metric {key}")).as_array()?.len() as f64)
        }
    }
}

/// The charts of a page, as the server has told them.
struct Charts {
    keys: Vec<String>,
    cycles: Vec<f64>,
    columns: Vec<Vec<Option<f64>>>,
    present: Value,
}

impl Charts {
    fn ask(page: &mut Page) -> Self {
        let told = page.ask(json!({ "do": "metrics", "from": 0 }));
        let names = told["names"].as_array().expect("names");
        let key = |name: &Value| name["key"].as_str().expect("a key").to_string();
        Self {
            keys: names.iter().map(key).collect(),
            cycles: serde_json::from_value(told["cycles"].clone()).expect("numbers"),
            columns: serde_json::from_value(told["values"].clone()).expect("numbers"),
            present: told["present"].clone(),
        }
    }

    /// Returns the row after so many cycles; none if it is not known.
    fn row(&self, cycle: u64) -> Option<Vec<Option<f64>>> {
        if self.present["cycle"] == cycle as f64 {
            return serde_json::from_value(self.present["values"].clone()).expect("numbers");
        }
        let at = self.cycles.iter().position(|known| *known == cycle as f64)?;
        Some(self.columns.iter().map(|column| column[at]).collect())
    }

    /// Compares a row with the metrics of a plain run.
    fn assert_row(&self, text: &str, cycle: u64) {
        let row = self.row(cycle).unwrap_or_else(|| panic!("cycle {cycle} is not known"));
        let plain = plain_metrics(text, cycle);
        for (key, value) in self.keys.iter().zip(row) {
            assert_eq!(value, charted(&plain, key), "{key} after {cycle} cycles");
        }
        assert!(self.keys.len() > 10, "{:?}", self.keys);
    }
}

/// Returns the compared cycles in an order that leads forth and back.
fn scattered_cycles(end: u64) -> Vec<u64> {
    let count = COMPARED_CYCLES.min(end);
    (0..count).map(|k| (k * 37 % count + 1) * end / count).collect()
}

#[test]
fn charts_equal_plain_runs_at_the_cycles_where_a_page_seeks() {
    for (text, end) in SCENARIOS {
        let (mut page, _) = Page::open(text, 2);
        for cycle in scattered_cycles(end) {
            page.digest_at(cycle);
            let charts = Charts::ask(&mut page);
            assert_eq!(charts.present["cycle"], cycle as f64);
            charts.assert_row(text, cycle);
        }
        let charts = Charts::ask(&mut page);
        let expected: Vec<f64> = (0..=end).map(|cycle| cycle as f64).collect();
        assert_eq!(charts.cycles, expected, "every cycle of a short run, in order");
        for cycle in scattered_cycles(end) {
            charts.assert_row(text, cycle);
        }
    }
}

#[test]
fn the_cycles_of_charts_do_not_depend_on_how_fast_a_run_was_played() {
    let text = ROBOTS.replace("cycles = 600", "cycles = 25000");
    let told = |way: &[Value]| {
        let (mut page, _) = Page::open(&text, 2);
        for call in way {
            page.ask(call.clone());
            Charts::ask(&mut page);
        }
        page.ask(json!({ "do": "play", "speed": "fastest" }));
        page.state("over");
        let charts = Charts::ask(&mut page);
        (charts.cycles, charts.columns)
    };
    let hasty = told(&[]);
    let slow = json!({ "do": "play", "speed": { "times": 100.0 } });
    let seeks = [2000, 20, 1333].map(|cycle| json!({ "do": "seek", "cycle": cycle }));
    let steps = [json!({ "do": "step", "cycles": 7 }), slow];
    let long = told(&[&seeks[..], &steps[..]].concat());
    assert_eq!(hasty.0, (0..=1000).map(|k| f64::from(k * 25)).collect::<Vec<_>>());
    assert!(hasty == long);
}

#[test]
fn charts_of_a_recording_are_whole_and_equal_plain_runs() {
    for (text, end) in SCENARIOS {
        let (mut page, _) = opened(recorded(text));
        wait_for_verdict(&mut page);
        let charts = Charts::ask(&mut page);
        assert_eq!(charts.cycles.last(), Some(&(end as f64)));
        for cycle in scattered_cycles(end) {
            charts.assert_row(text, cycle);
        }
    }
}

#[test]
fn charts_of_a_recording_are_known_before_it_is_computed_again() {
    let (mut page, _) = opened(recorded(ROBOTS));
    let charts = Charts::ask(&mut page);
    assert_eq!(charts.cycles, (0..=600).map(f64::from).collect::<Vec<_>>());
    charts.assert_row(ROBOTS, 600);
}

#[test]
fn charts_of_a_recording_of_another_build_are_its_recorded_metrics() {
    for (text, end) in SCENARIOS {
        let folder = recorded(text);
        made_by_another(&folder);
        let (mut page, _) = opened(folder);
        let charts = Charts::ask(&mut page);
        assert!(charts.present.is_null());
        for cycle in scattered_cycles(end) {
            charts.assert_row(text, cycle);
        }
    }
}

#[test]
fn charts_begin_with_what_the_world_is_about_and_never_with_a_clock() {
    let primary = |text: &str| -> Vec<String> {
        let (mut page, _) = Page::open(text, 1);
        let told = page.ask(json!({ "do": "metrics", "from": 0 }));
        let names = told["names"].as_array().expect("names");
        let entries: Vec<&Map<String, Value>> =
            names.iter().map(|name| name.as_object().expect("an object")).collect();
        assert!(entries.iter().all(|name| !name["key"].as_str().expect("text").ends_with("cpu_s")));
        assert!(
            entries.is_sorted_by_key(|name| name["is_primary"] == false),
            "the primary ones first"
        );
        let primary = entries.iter().filter(|name| name["is_primary"] == true);
        primary.map(|name| name["key"].as_str().expect("text").to_string()).collect()
    };
    assert_eq!(primary(ROBOTS)[..3], ["contacts", "trips", "tasks_finished"]);
    assert_eq!(primary(CHAINS)[..3], ["vetoes", "min_clearance_m", "progress"]);
    let of_airplanes = ["min_separation_m", "losses_of_separation", "mean_delay_percent"];
    assert_eq!(primary(AIRPLANES)[..3], of_airplanes);
}
