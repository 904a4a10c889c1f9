//! A check that the papers' scenarios and sweep files are valid as they are, so that users can run
//! them by hand.

use sidestep::experiment::sweep::{Setting, Sweep};
use sidestep::scenario::Source;
use sidestep::worlds::WORLDS;
use std::path::{Path, PathBuf};

fn files(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).expect("the folder is there");
    let paths = entries.map(|entry| entry.expect("readable").path());
    paths.flat_map(|path| if path.is_dir() { files(&path) } else { vec![path] }).collect()
}

fn is_sweep(path: &Path) -> bool {
    path.to_string_lossy().ends_with(".sweep.toml")
}

#[test]
fn every_scenario_compiles_and_so_do_the_variants_of_every_sweep() {
    let all = files(&Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios"));
    assert!(all.iter().filter(|path| is_sweep(path)).count() >= 5, "{all:?}");
    for path in all {
        if !is_sweep(&path) {
            let source = Source::read(&path, &[]).expect("readable");
            WORLDS.compile(&source).expect("a right scenario");
            continue;
        }
        let sweep = Sweep::read(&path).expect("a right sweep");
        for variant in sweep.design.variants(&sweep.place).expect("right variants") {
            let settings = variant.settings.iter();
            let overrides: Vec<String> = settings.map(Setting::to_override).collect();
            let source = Source::read(&sweep.scenario, &overrides).expect("settings that fit");
            WORLDS.compile(&source).expect("a right variant");
        }
    }
}
