//! A robots scenario that needs no other file: what a run folder keeps.
//!
//! The map goes along as the program saw it, one pixel per box, so that a later version of
//! an importer cannot change what is replayed. Profiles and lists of starts go along as they are.

use super::scenario::Compiled;
use serde_json::Value;
use sidestep_kernel::InputError;
use sidestep_map::{Cell, GridMap};
use sidestep_scenario::file::read_bytes;
use sidestep_scenario::{Resolved, Source};
use std::path::Path;

/// Where the files are, seen from the scenario.
const FOLDER: &str = "inputs";
/// Largest profile or list of starts, unpacked.
const MAX_BYTES: u64 = 64 << 20;

/// The scenario with every file that it names beside it.
///
/// # Errors
/// When such a file cannot be read any more.
pub fn resolve(source: &Source, compiled: &Compiled) -> Result<Resolved, InputError> {
    let file: &Value = &source.parse()?;
    let mut bundle = Bundle { source, overrides: said_outright(compiled), files: Vec::new() };
    bundle.add_map(file, &compiled.world.map);
    bundle.add_profiles(file)?;
    bundle.add_starts(file)?;
    let text = source.clone().with(&bundle.overrides)?.text;
    Ok(Resolved { text: format!("{}{text}", source.heading()), files: bundle.files })
}

/// What a run depends on is said even where it is the default.
fn said_outright(compiled: &Compiled) -> Vec<String> {
    let regime = compiled.world.regime.name();
    vec![
        format!("seed={}", compiled.seed),
        format!("cycles={}", compiled.cycles),
        format!("regime=\"{regime}\""),
    ]
}

struct Bundle<'a> {
    source: &'a Source,
    overrides: Vec<String>,
    files: Vec<(String, Vec<u8>)>,
}

impl Bundle<'_> {
    fn add_map(&mut self, file: &Value, map: &GridMap) {
        if file["map"]["file"].is_null() {
            return;
        }
        let yaml = format!("{FOLDER}/map.yaml");
        self.overrides.push(format!("map.file=\"{yaml}\""));
        self.overrides.push(format!("map.box_size_m={:?}", map.box_size_m));
        self.files.push((yaml, map_yaml(map).into_bytes()));
        self.files.push((format!("{FOLDER}/map.pgm"), map_pgm(map)));
    }

    fn add_profiles(&mut self, file: &Value) -> Result<(), InputError> {
        let mut names = Vec::new();
        for (k, profile) in file["profiles"].as_array().into_iter().flatten().enumerate() {
            let name = format!("{FOLDER}/profile-{k}.toml");
            self.add(&name, profile)?;
            names.push(format!("{name:?}"));
        }
        if !names.is_empty() {
            self.overrides.push(format!("profiles=[{}]", names.join(", ")));
        }
        Ok(())
    }

    fn add_starts(&mut self, file: &Value) -> Result<(), InputError> {
        let robots = &file["robots"];
        self.add_starts_of(robots, "robots".into(), 0)?;
        for (k, section) in robots.as_array().into_iter().flatten().enumerate() {
            self.add_starts_of(section, format!("robots.{k}"), k)?;
        }
        Ok(())
    }

    fn add_starts_of(&mut self, section: &Value, key: String, k: usize) -> Result<(), InputError> {
        let list = &section["scen"];
        if list.is_null() {
            return Ok(());
        }
        let name = format!("{FOLDER}/starts-{k}.scen");
        self.overrides.push(format!("{key}.scen=\"{name}\""));
        self.add(&name, list)
    }

    fn add(&mut self, name: &str, path: &Value) -> Result<(), InputError> {
        let path = self.source.path(Path::new(path.as_str().unwrap_or_default()));
        self.files.push((name.into(), read_bytes(&path, MAX_BYTES)?));
        Ok(())
    }
}

/// Gray values of free, unknown and occupied pixels, as `map_server` writes them.
const FREE: u8 = 254;
const UNKNOWN: u8 = 205;
const OCCUPIED: u8 = 0;

fn map_yaml(map: &GridMap) -> String {
    let [x, y] = map.origin_m;
    format!(
        "# The map as the simulation saw it: one pixel per box.\n\
         image: map.pgm\nresolution: {:?}\norigin: [{x:?}, {y:?}, 0.0]\nnegate: 0\n\
         occupied_thresh: 0.65\nfree_thresh: 0.196\n",
        map.box_size_m
    )
}

/// Binary PGM; the first row is the north edge.
fn map_pgm(map: &GridMap) -> Vec<u8> {
    let mut bytes = format!("P5\n{} {}\n255\n", map.width(), map.height()).into_bytes();
    for row in map.cells().chunks_exact(map.width() as usize).rev() {
        bytes.extend(row.iter().map(|cell| match cell {
            Cell::Free => FREE,
            Cell::Unknown => UNKNOWN,
            Cell::Wall => OCCUPIED,
        }));
    }
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;
    use sidestep_import::map_file;
    use sidestep_map::UnknownPolicy;

    #[test]
    fn the_map_comes_back_as_it_was() {
        let cells = vec![Cell::Free, Cell::Wall, Cell::Unknown, Cell::Free, Cell::Free, Cell::Wall];
        let map = GridMap::new(3, 2, 0.1 + 0.2, cells).with_origin([-1.5, 1e-7]);
        let folder = tempfile::tempdir().expect("a folder");
        let yaml = folder.path().join("map.yaml");
        std::fs::write(&yaml, map_yaml(&map)).expect("written");
        std::fs::write(folder.path().join("map.pgm"), map_pgm(&map)).expect("written");
        assert_eq!(map_file(&yaml, map.box_size_m, UnknownPolicy::Keep), Ok(map));
    }
}
