//! A robots scenario that needs no other file, as a run folder keeps it.
//!
//! The map goes along as the program saw it, one pixel per box, so that a later version of
//! an importer cannot change the replayed map. Profiles, lists of starts and tasks, and plans are kept as they are.

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
    add_robot_files(&mut bundle, &file["robots"])?;
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
    let mut names = Vec::new();
    for (k, path) in paths.enumerate() {
        names.push(bundle.copy(&format!("profile-{k}.toml"), path)?);
    }
    if !names.is_empty() {
        bundle.set("profiles", format_args!("{names:?}"));
    }
    Ok(())
}

/// Adds the lists of starts and tasks and the plans: of many sections `[[robots]]`, or of one `[robots]`.
fn add_robot_files(bundle: &mut Bundle<'_>, robots: &Value) -> Result<(), InputError> {
    match robots {
        Value::Array(sections) => {
            for (k, section) in sections.iter().enumerate() {
                add_section_files(bundle, &format!("robots.{k}"), k, section)?;
            }
            Ok(())
        }
        one => add_section_files(bundle, "robots", 0, one),
    }
}

fn add_section_files(
    bundle: &mut Bundle<'_>,
    section_key: &str,
    number: usize,
    section: &Value,
) -> Result<(), InputError> {
    let files = [
        ("scen", section["scen"].as_str(), format!("starts-{number}.scen")),
        ("tasks.file", section["tasks"]["file"].as_str(), format!("tasks-{number}.tasks")),
        ("planner.file", section["planner"]["file"].as_str(), format!("plan-{number}.plan")),
    ];
    for (key, path, name) in files {
        if let Some(path) = path {
            let path = bundle.copy(&name, path)?;
            bundle.set(&format!("{section_key}.{key}"), format_args!("{path:?}"));
        }
    }
    Ok(())
}
