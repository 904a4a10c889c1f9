//! A chain scenario that needs no other file, as a run folder keeps it.
//!
//! Floors are stored as the program read them, because a later version of an importer must not
//! change the replay. Scripts and arm models are stored unchanged.

use super::scenario::ChainScenario;
use serde_json::Value;
use sidestep_import::stage::{self, BoxObstacle, FloorPlan, Pose2};
use sidestep_import::write::{map_files, pgm};
use sidestep_import::{PixelMap, rosmap};
use sidestep_kernel::InputError;
use sidestep_scenario::{Bundle, ResolvedScenario, Source};
use std::path::Path;

/// Keys whose values name files that are stored unchanged.
const PLAIN_FILE_KEYS: [&str; 4] = ["script_file", "urdf", "srdf", "joint_limits"];

/// Returns the scenario together with every file that it names.
///
/// # Errors
/// When such a file can no longer be read.
pub(crate) fn resolve_scenario<const D: usize>(
    source: &Source,
    compiled: &ChainScenario<D>,
) -> Result<ResolvedScenario, InputError> {
    let file: Value = source.parse()?;
    let mut bundle = Bundle::new(source, compiled.seed, compiled.cycles);
    // Scripts and arms are keys of chains alone.
    add_files_under_key(&mut bundle, &file["chains"], "chains")?;
    add_solids(&mut bundle, &file["chains"], compiled);
    if let Some(path) = file["ground"]["map"].as_str() {
        add_map_files(&mut bundle, &rosmap::load(&source.path(Path::new(path)))?);
    }
    if let Some(path) = file["ground"]["stage"].as_str() {
        add_stage_world_files(&mut bundle, &stage::load(&source.path(Path::new(path)))?);
    }
    bundle.finish()
}

/// Adds the shapes of links that were read from meshes, which the models only name.
fn add_solids<const D: usize>(
    bundle: &mut Bundle<'_>,
    sections: &Value,
    compiled: &ChainScenario<D>,
) {
    let mut slot = 0;
    for (k, section) in sections.as_array().into_iter().flatten().enumerate() {
        let arm = compiled.world.chains.get(slot).and_then(|spec| spec.arm.as_ref());
        slot += section["count"].as_u64().unwrap_or(1) as usize;
        let Some(arm) = arm.filter(|arm| !arm.solids.is_empty()) else { continue };
        let bytes = postcard::to_stdvec(&arm.solids).expect("shapes are plain data");
        let name = format!("{}-solids.bin", bundle.count());
        let path = bundle.add(&name, bytes);
        bundle.set(&format!("chains.{k}.arm.solids"), format_args!("{path:?}"));
    }
}

/// Adds all files that are named under a key.
fn add_files_under_key(
    bundle: &mut Bundle<'_>,
    value: &Value,
    key: &str,
) -> Result<(), InputError> {
    match value {
        Value::Array(items) => items
            .iter()
            .enumerate()
            .try_for_each(|(k, item)| add_files_under_key(bundle, item, &format!("{key}.{k}"))),
        Value::Object(table) => table.iter().try_for_each(|(name, item)| {
            let key = format!("{key}.{name}");
            match item.as_str().filter(|_| PLAIN_FILE_KEYS.contains(&name.as_str())) {
                Some(path) => copy_into_bundle(bundle, &key, path),
                None => add_files_under_key(bundle, item, &key),
            }
        }),
        _ => Ok(()),
    }
}

fn copy_into_bundle(bundle: &mut Bundle<'_>, key: &str, path: &str) -> Result<(), InputError> {
    let file = Path::new(path).file_name().unwrap_or_default().display();
    // Numbered, because files of different folders may have the same name.
    let path = bundle.copy(&format!("{}-{file}", bundle.count()), path)?;
    bundle.set(key, format_args!("{path:?}"));
    Ok(())
}

fn add_map_files(bundle: &mut Bundle<'_>, map: &PixelMap) {
    let size = [map.width(), map.height()];
    let [yaml, image] = map_files(size, map.resolution_m(), map.plane(), map.pixels());
    let path = bundle.add(yaml.0, yaml.1);
    bundle.add(image.0, image.1);
    bundle.set("ground.map", format_args!("{path:?}"));
}

fn add_stage_world_files(bundle: &mut Bundle<'_>, world: &stage::World) {
    let mut text = String::from("# The world as the simulation saw it.\n");
    for (k, plan) in world.floor_plans.iter().enumerate() {
        let bitmap = format!("floor-{k}.pgm");
        text.push_str(&stage_model_text(plan, &bitmap));
        // Black marks solid pixels.
        let grays = plan.solid.iter().map(|solid| if *solid { 0 } else { 255 });
        bundle.add(&bitmap, pgm(plan.width, plan.height, grays));
    }
    text.extend(world.boxes.iter().map(solid_text));
    let path = bundle.add("stage.world", text.into_bytes());
    bundle.set("ground.stage", format_args!("{path:?}"));
}

/// Stage expects degrees; these digits parse back to exactly the same angle.
fn pose_text(pose: &Pose2) -> String {
    format!("[{:?} {:?} 0.0 {:?}]", pose.x_m, pose.y_m, pose.yaw_rad.to_degrees())
}

fn stage_model_text(plan: &FloorPlan, bitmap: &str) -> String {
    let [width_m, height_m] = plan.size_m;
    format!(
        "model\n(\n  bitmap \"{bitmap}\"\n  size [{width_m:?} {height_m:?} 1.0]\n  pose {}\n  \
         boundary {}\n)\n",
        pose_text(&plan.pose),
        u8::from(plan.has_boundary)
    )
}

fn solid_text(body: &BoxObstacle) -> String {
    let [x_m, y_m] = body.size_m;
    format!("model\n(\n  size [{x_m:?} {y_m:?} 1.0]\n  pose {}\n)\n", pose_text(&body.pose))
}
