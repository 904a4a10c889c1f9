//! The price of the shield where turn rates differ, in delay.

use crate::airspace_run;
use crate::metrics::Metrics;
use crate::traffic::{from_bluesky, from_tracks};
use sidestep_import::{bluesky, traffic};
use sidestep_kernel::math;
use sidestep_kernel::stream::{Purpose, Streams};
use sidestep_kernel::{Seed, Simulation};
use sidestep_scenario::Source;
use std::f64::consts::TAU;

/// Returns the metrics of a run that was flown to its end, and checks the promise of the shield.
fn flown(name: &str, text: &str, shield: &str, method: &str) -> Metrics {
    let mut set =
        vec![format!("airspace.shield=\"{shield}\""), format!("airspace.method=\"{method}\"")];
    if text.contains("\ntrack_deg = ") {
        set.push("airspace.replay_until_s=0".into());
    }
    let source = Source::new(name, text, "").with_overrides(&set).expect("known keys");
    let mut run = airspace_run(&source, 2).expect("a scenario");
    while !run.is_over() && run.cycle() < 1500 {
        run.advance(50);
    }
    let metrics = run.metrics();
    let mut lost = run.collector().counters.pairs.iter().filter(|(_, record)| record.losses > 0);
    let named: Vec<_> = metrics.too_close.iter().map(|pair| pair.airplanes).collect();
    assert!(shield == "off" || lost.all(|(&(a, b), _)| named.contains(&[a, b])), "{name}");
    metrics
}

/// Returns the mean delay in percent of a flight in which all arrive.
fn delay_percent(name: &str, text: &str, shield: &str, method: &str) -> f64 {
    let metrics = flown(name, text, shield, method);
    let delay = metrics.mean_delay_percent.expect("a delay");
    println!("{name}, {method}, shield {shield}: {delay:.2} % delay");
    assert_eq!(metrics.arrived, metrics.airplanes);
    delay
}

/// The bar on delays in percent: one and a quarter times that without the shield, and half a percent.
fn is_little(off: f64, on: f64) -> bool {
    on <= 1.25 * off + 0.5
}

fn costs_little(name: &str, text: &str, method: &str) {
    let [off, on] = ["off", "on"].map(|shield| delay_percent(name, text, shield, method));
    assert!(is_little(off, on), "{name}, {method}: {on} % with the shield, {off} % without");
}

/// Random traffic of airplanes that each have a speed and a turn rate of their own, up to five times
/// as fast as the slowest.
fn mixed(n: u32, seed: u64, slowest_deg_s: f64) -> String {
    let streams = Streams::new(Seed(seed));
    let radius_m = 6500.0 * (f64::from(n) / 5.0).sqrt();
    let mut text = "format = 1\nworld = \"airspace\"\n[airspace]\n".to_string();
    let mut starts: Vec<[f64; 2]> = Vec::new();
    for id in 0..n {
        let mut draws = streams.draws(id, 0, Purpose(99));
        let mut in_disc = || {
            let (r, angle) = (radius_m * draws.uniform().sqrt(), TAU * draws.uniform());
            [r * math::cos(angle), r * math::sin(angle)]
        };
        let far = |a: [f64; 2], b: [f64; 2]| math::hypot(a[0] - b[0], a[1] - b[1]);
        let mut from = in_disc();
        while starts.iter().any(|other| far(*other, from) < 3000.0) {
            from = in_disc();
        }
        let mut to = in_disc();
        while far(from, to) < 0.5 * radius_m {
            to = in_disc();
        }
        starts.push(from);
        let heading_deg = math::atan2(to[1] - from[1], to[0] - from[0]).to_degrees();
        let (v_m_s, rate) =
            (25.0 + 25.0 * draws.uniform(), slowest_deg_s + 4.0 * slowest_deg_s * draws.uniform());
        text += &format!(
            "[[airplanes]]\nat_m = {from:?}\nheading_deg = {heading_deg:?}\nway_points_m = [{to:?}]\n\
             v_m_s = {v_m_s:?}\nomega_max_deg_s = {rate:?}\n"
        );
    }
    text
}

#[test]
fn the_shield_costs_little_where_turn_rates_differ() {
    for (seed, slowest_deg_s) in [(1, 2.0), (2, 2.0), (3, 1.0)] {
        let name = format!("20 of {slowest_deg_s} to {} deg/s, seed {seed}", 5.0 * slowest_deg_s);
        costs_little(&name, &mixed(20, seed, slowest_deg_s), "pc");
    }
}

/// Speeds of 25 to 50 m/s and turn rates of 2 to 10 deg/s, by methods that do not know of the shield.
#[test]
fn the_shield_costs_every_method_little() {
    for method in ["pc", "mvp", "orca"] {
        let seeds: Vec<u64> = (1..25).collect();
        let mean = |shield: &str| {
            let one = |seed| delay_percent("mixed", &mixed(14, seed, 2.0), shield, method);
            seeds.iter().copied().map(one).sum::<f64>() / seeds.len() as f64
        };
        let off = mean("off");
        let on = mean("on");
        println!("MEAN {method}: {off:.2} {on:.2}");
        assert!(is_little(off, on), "{method}: {on} % with the shield, {off} % without");
    }
}

#[test]
fn the_shield_costs_recorded_traffic_little() {
    let path = "airspace/opensky/switzerland_20180801_dev.csv";
    let Some(path) = sidestep_testing::shared_data(path) else { return };
    let recorded = traffic::read(&path).expect("a table");
    let text = from_tracks("ch", &recorded).expect("it has tracks");
    costs_little("recorded traffic", &text, "pc");
}

/// The table in the world's README.
#[test]
#[ignore = "sixty runs: a minute"]
fn the_shield_costs_random_traffic_little_on_average() {
    for (slowest_deg_s, n) in [(2.0, 20), (1.0, 20), (2.0, 10)] {
        let mean = |shield: &str| {
            let one = |seed| delay_percent("mixed", &mixed(n, seed, slowest_deg_s), shield, "pc");
            (1..11).map(one).sum::<f64>() / 10.0
        };
        let (off, on) = (mean("off"), mean("on"));
        println!("MEAN {n} of {slowest_deg_s} to {} deg/s: {off:.2} {on:.2}", 5.0 * slowest_deg_s);
        assert!(is_little(off, on), "{on} {off}");
    }
}

/// All files of which the aircraft turn at different rates, and arrive.
#[test]
#[ignore = "flies every shared file twice: a minute"]
fn the_shield_costs_traffic_of_bluesky_files_little() {
    let Some(folder) = sidestep_testing::shared_data("airspace/bluesky") else { return };
    let files =
        std::fs::read_dir(folder).expect("a folder").map(|file| file.expect("a file").path());
    let mut files: Vec<_> = files.collect();
    files.sort();
    for file in files {
        let name = file.file_stem().expect("a name").to_string_lossy().into_owned();
        let scn = bluesky::read(&file).expect("a text");
        let count = scn.traffic.aircraft.len();
        let Some(text) = from_bluesky(&name, &scn).filter(|_| (2..60).contains(&count)) else {
            continue;
        };
        // On the earth no shield is proved in a wind.
        if text.contains("wind_m_s") {
            continue;
        }
        let flown = ["off", "on"].map(|shield| flown(&name, &text, shield, "pc"));
        if let [Some(off), Some(on)] = flown.map(|metrics| metrics.mean_delay_percent) {
            println!("BLUESKY {name} {count} {off:.2} {on:.2}");
        }
    }
}
