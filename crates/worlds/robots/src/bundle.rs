//! A robots scenario that needs no other file, as a run folder keeps it.
//!
//! The map goes along as the program saw it, one pixel per box, so that a later version of
//! an importer cannot change the replayed map. Profiles and lists of starts are kept as they are.

use super::scenario::Compiled;
use serde_json::Value;
use sidestep_import::write::map_files;
use sidestep_kernel::InputError;
use sidestep_map::GridMap;
use sidestep_scenario::{Bundle, ResolvedScenario, Source};

/// Returns the scenario with every file that it names beside it.
///
/// # Errors
/// When such a file can no longer be read.
pub(crate) fn resolve(
    source: &Source,
    compiled: &Compiled,
) -> Result<ResolvedScenario, InputError> {
    let file: Value = source.parse()?;
    let mut bundle = Bundle::new(source, compiled.seed, compiled.cycles);
    // Written even where it is the preset, because the run depends on it.
    bundle.set("regime", format_args!("{:?}", compiled.world.regime.name()));
    if !file["map"]["file"].is_null() {
        add_map(&mut bundle, &compiled.world.map);
        if !file["map"]["resolution_m"].is_null() {
            bundle.set("map.resolution_m", format_args!("{:?}", compiled.world.map.box_size_m));
        }
    }
    add_profiles(&mut bundle, &file["profiles"])?;
    add_starts(&mut bundle, &file["robots"])?;
    bundle.finish()
}

fn add_map(bundle: &mut Bundle<'_>, map: &GridMap) {
    let size = [map.width(), map.height()];
    let [yaml, image] = map_files(size, map.box_size_m, map.plane, map.cells());
    let path = bundle.add(yaml.0, yaml.1);
    bundle.add(image.0, image.1);
    bundle.set("map.file", format_args!("{path:?}"));
    bundle.set("map.box_size_m", format_args!("{:?}", map.box_size_m));
}

fn add_profiles(bundle: &mut Bundle<'_>, profiles: &Value) -> Result<(), InputError> {
    let paths = profiles.as_array().into_iter().flatten().filter_map(Value::as_str);
    let copy = |(k, path)| bundle.copy(&format!("profile-{k}.toml"), path);
    let names = paths.enumerate().map(copy).collect::<Result<Vec<_>, _>>()?;
    if !names.is_empty() {
        bundle.set("profiles", format_args!("{names:?}"));
    }
    Ok(())
}

/// Adds the lists of starts of one section or of many.
fn add_starts(bundle: &mut Bundle<'_>, robots: &Value) -> Result<(), InputError> {
    let many = robots.as_array().into_iter().flatten().enumerate();
    let many = many.map(|(k, section)| (format!("robots.{k}.scen"), k, section));
    for (key, k, section) in many.chain([("robots.scen".into(), 0, robots)]) {
        if let Some(path) = section["scen"].as_str() {
            let path = bundle.copy(&format!("starts-{k}.scen"), path)?;
            bundle.set(&key, format_args!("{path:?}"));
        }
    }
    Ok(())
}
