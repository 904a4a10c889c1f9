//! The shipped scenarios, pair by pair: who loses separation with the shield, and who without it.

use super::guarantee_tests::{Pairs, lost_and_named};
use crate::airspace_run;
use sidestep_kernel::Simulation;
use sidestep_scenario::Source;
use std::path::{Path, PathBuf};

const METHODS: [&str; 4] = ["pc", "mvp", "orca", "none"];

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../scenarios/airspace")
}

/// Returns the names of all that are shipped, so that none is left out.
fn scenarios() -> Vec<String> {
    let files = std::fs::read_dir(folder()).expect("the folder of scenarios");
    let paths = files.map(|file| file.expect("a file").path());
    let names = paths.filter(|path| path.extension().is_some_and(|extension| extension == "toml"));
    let stem = |path: PathBuf| path.file_stem().expect("a name").to_string_lossy().into_owned();
    let mut names: Vec<String> = names.map(stem).collect();
    names.sort();
    assert!(names.len() >= 10, "{names:?}");
    names
}

/// Returns the pairs that lose separation in a scenario, and those that are named.
fn flown(name: &str, settings: &[&str]) -> (Pairs, Pairs) {
    let overrides: Vec<String> = settings.iter().map(ToString::to_string).collect();
    let source = Source::read(&folder().join(format!("{name}.toml")), &overrides);
    let source = source.unwrap_or_else(|e| panic!("{e}"));
    let mut run = airspace_run(&source, 1).unwrap_or_else(|e| panic!("{name} {settings:?}: {e}"));
    run.advance(run.config().cycles);
    lost_and_named(&run)
}

/// Checks that with the shield only named pairs lose separation. Returns how many pairs lose it without the shield, with
/// it, and with it alone.
fn assert_pair_by_pair(name: &str, method: &str, seed: u64) -> [usize; 3] {
    let method = format!("airspace.method=\"{method}\"");
    let seed = format!("seed={seed}");
    let [off, on] = ["off", "on"].map(|shield| {
        let shield = format!("airspace.shield=\"{shield}\"");
        flown(name, &[&method, &seed, &shield])
    });
    let (lost, named) = on;
    let about = format!("{name}, {method}, {seed}: {lost:?} of {named:?}, without {:?}", off.0);
    assert!(lost.is_subset(&named), "{about}");
    [off.0.len(), lost.len(), lost.difference(&off.0).count()]
}

#[test]
fn in_shipped_scenarios_only_named_pairs_lose_separation_and_no_others_than_without_the_shield() {
    for name in &scenarios() {
        for method in METHODS {
            let [_, _, anew] = assert_pair_by_pair(name, method, 1);
            assert_eq!(anew, 0, "{name} {method}");
        }
    }
}

#[test]
#[ignore = "twenty seeds of all scenarios: a minute"]
fn in_twenty_seeds_of_shipped_scenarios_only_named_pairs_lose_separation() {
    for name in &scenarios() {
        for method in METHODS {
            let mut totals = [0; 3];
            for seed in 1..=20 {
                let found = assert_pair_by_pair(name, method, seed);
                totals.iter_mut().zip(found).for_each(|(total, found)| *total += found);
            }
            let [off, on, anew] = totals;
            println!("{name} {method}: pairs lost without {off}, with {on}, of these anew {anew}");
        }
    }
}
