//! Departures, arrivals and overflights with and without the shield: who loses separation, and what it costs.

use crate::airspace_run;
use crate::metrics::Metrics;
use sidestep_kernel::Simulation;
use sidestep_scenario::Source;

const DEPARTURES: &str = include_str!("../../../../../scenarios/airspace/departures.toml");
const METHODS: [&str; 4] = ["pc", "mvp", "orca", "none"];
/// As many airplanes in half of the time, so that many come in too close.
const DENSE: [(&str, &str); 2] = [
    ("departure_interval_s = 120.0", "departure_interval_s = 60.0"),
    ("arrival_interval_s = 160.0", "arrival_interval_s = 80.0"),
];

/// Returns the metrics of a morning to its end, with some texts of the scenario replaced.
fn morning(seed: u64, method: &str, shield: &str, replaced: &[(&str, &str)]) -> Metrics {
    let mut text = DEPARTURES.to_string();
    let world = format!("world = \"airspace\"\nseed = {seed}");
    let decides = format!("method = \"{method}\"\nshield = \"{shield}\"");
    let settings = [("world = \"airspace\"", &*world), ("method = \"pc\"", &*decides)];
    for (from, to) in settings.iter().chain(replaced) {
        assert!(text.contains(from), "{from}");
        text = text.replacen(from, to, 1);
    }
    let mut run = airspace_run(&Source::new("departures", text, ""), 1).expect("a scenario");
    run.advance(run.config().cycles);
    run.metrics()
}

/// Sums over mornings with one method, with the shield off and on.
#[derive(Debug, Default)]
struct Totals {
    losses: [u64; 2],
    named: usize,
    level_offs: u64,
    orbits: u64,
    low_holds: u64,
    delay_percent: [f64; 2],
    in_flight: u64,
}

/// Flies mornings with the shield off and on, and checks what the shield promises of each.
fn fly_mornings(
    seeds: std::ops::RangeInclusive<u64>,
    method: &str,
    replaced: &[(&str, &str)],
) -> Totals {
    let mut totals = Totals::default();
    for seed in seeds {
        let [off, on] = ["off", "on"].map(|shield| morning(seed, method, shield, replaced));
        let about = format!("{method}, seed {seed}: {on:?}");
        assert_eq!(on.losses_of_unreported_pairs, 0, "{about}");
        assert_eq!(on.unproved_pairs, 0, "{about}");
        assert!(on.losses_of_separation <= off.losses_of_separation, "{off:?} {about}");
        totals.named += on.too_close.len();
        totals.level_offs += on.shield_level_offs;
        totals.orbits += on.shield_orbits;
        totals.low_holds += on.low_holds.unwrap_or(0);
        totals.in_flight += on.in_flight;
        for (k, metrics) in [off, on].iter().enumerate() {
            totals.losses[k] += metrics.losses_of_separation;
            totals.delay_percent[k] += metrics.mean_delay_percent.unwrap_or(0.0);
        }
    }
    totals
}

#[test]
fn in_mornings_of_departures_the_shield_loses_no_unnamed_pair_and_never_more_than_none() {
    for method in METHODS {
        let totals = fly_mornings(1..=3, method, &[]);
        assert_eq!(totals.in_flight, 0, "{method}: {totals:?}");
        fly_mornings(1..=2, method, &DENSE);
    }
}

/// Prints the table of the book (`model-airspace.md`).
#[test]
#[ignore = "minutes"]
fn a_hundred_mornings_of_departures_with_and_without_the_shield() {
    for (name, replaced) in [("departures.toml", &[][..]), ("twice as dense", &DENSE[..])] {
        for method in METHODS {
            let totals = fly_mornings(1..=100, method, replaced);
            println!("{name}, {method}: {totals:?}");
        }
    }
}
