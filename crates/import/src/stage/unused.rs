//! What a world says that no obstacle and no robot's start has: named, with its places.

use super::definitions::Definition;
use super::files::WorldFiles;
use super::parse::Value;
use crate::{ImportReport, Treatment};

/// The properties of models that are read.
const READ: [&str; 9] = [
    "bitmap",
    "boundary",
    "name",
    "noblocks",
    "obstacle_return",
    "origin",
    "pose",
    "ranger_return",
    "size",
];

/// How models look, and how people handle them in the window.
const LOOKS: [&str; 12] = [
    "color",
    "color_rgba",
    "debug",
    "event_queue",
    "gui_grid",
    "gui_move",
    "gui_nose",
    "gui_outline",
    "map_resolution",
    "say",
    "trail_interval",
    "trail_length",
];

/// What sensors and tools of Stage see in a model; 0 is its default.
const RETURNS: [&str; 4] = ["blob_return", "fiducial_key", "fiducial_return", "gripper_return"];

/// The units, which are read for all models.
const UNITS: [&str; 2] = ["unit_angle", "unit_length"];

/// Records the properties of a model that are not read.
pub(super) fn record_unused(def: &Definition, files: &WorldFiles, report: &mut ImportReport) {
    for (&key, value) in &def.properties {
        let is_default = RETURNS.contains(&key) && value.words == ["0"];
        if READ.contains(&key) || is_default {
            continue;
        }
        if LOOKS.contains(&key) {
            let place = format!("`{key}` at {}", files.place(value.at));
            report.record(Treatment::NotUsed, "looks and windows of models", place, "");
            continue;
        }
        let rule = format!("the property `{key}` of models");
        report.record(Treatment::NotUsed, rule, files.place(value.at), "");
    }
}

/// Records a setting of the whole world.
pub(super) fn record_setting(
    key: &str,
    value: &Value,
    files: &WorldFiles,
    report: &mut ImportReport,
) {
    if UNITS.contains(&key) {
        return;
    }
    let place = format!("`{key}` at {}", files.place(value.at));
    report.record(Treatment::NotUsed, "settings of Stage itself", place, "");
}
