//! The scenarios of the repository.

use sidestep::scenario::Source;
use std::path::{Path, PathBuf};

const FOLDER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenarios");

/// Returns all scenarios below `scenarios/`, with their worlds. Sweeps are none.
pub(crate) fn all() -> Vec<(String, Source)> {
    let mut found = Vec::new();
    let mut open = vec![PathBuf::from(FOLDER)];
    while let Some(folder) = open.pop() {
        for entry in std::fs::read_dir(&folder).expect("the scenarios are here") {
            let path = entry.expect("readable").path();
            if path.is_dir() {
                open.push(path);
            } else if path.extension().is_some_and(|ending| ending == "toml") {
                found.extend(scenario(&path));
            }
        }
    }
    found.sort_by(|(_, a), (_, b)| a.place.cmp(&b.place));
    assert!(found.len() >= 15, "{} scenarios", found.len());
    found
}

fn scenario(path: &Path) -> Option<(String, Source)> {
    let source = Source::read(path, &[]).expect("readable");
    let world = source.value("world")?.as_str().expect("a name").to_string();
    Some((world, source))
}
