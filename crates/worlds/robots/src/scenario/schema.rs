//! The JSON Schema of the sections.

use super::compile::unused_keys::BEHAVIOURS;
use super::kinds::BUILT_IN;
use super::{Behaviours, ProfileFile, RobotsFile, presets};
use serde_json::Value;
use sidestep_scenario::{FORMAT, Source, schema};

/// Returns the schema of a scenario's sections; `own` are behaviors beside the built-in ones.
pub(crate) fn sections(own: &Behaviours) -> Value {
    let mut sections = schema::for_type::<RobotsFile>();
    let profile = Source::new("presets", presets(), "").parse::<ProfileFile>();
    let profile = profile.expect("the presets are read in a test");
    let sensors: Vec<&str> = profile.sensors.keys().map(String::as_str).collect();
    let effectors = profile.effectors.keys().map(String::as_str);
    let effectors: Vec<&str> = effectors.collect();
    schema::mark_as_names(&mut sections, "robots.sensors", "sensors", &sensors);
    schema::mark_as_names(&mut sections, "robots.effector", "effectors", &effectors);
    for bodies in ["robots", "people", "doors"] {
        schema::mark_as_names(&mut sections, &format!("{bodies}.kind"), "kinds", &BUILT_IN[1..]);
    }
    schema::mark_as_names(&mut sections, "kind_order", "kinds", &BUILT_IN[1..]);
    let own = own.keys().map(String::as_str);
    let behaviours: Vec<&str> = BEHAVIOURS.iter().map(|(kind, _)| *kind).chain(own).collect();
    sections["$defs"]["BehaviourSection"]["properties"]["kind"]["enum"] = behaviours.into();
    sections
}

/// Returns the schema of a profile, a file of sensors and effectors; `scenario` has the words for their keys.
pub(crate) fn profile(scenario: &str) -> Value {
    let mut keys = schema::for_type::<ProfileFile>();
    keys["properties"]["format"]["const"] = FORMAT.into();
    schema::for_file("A profile: sensors and effectors of robots", keys, scenario)
}
