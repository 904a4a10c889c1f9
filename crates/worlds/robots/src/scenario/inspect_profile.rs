//! What is in a profile, for people who ask before they name it in a scenario.

use super::{Behaviours, Compiled, ProfileFile, StorageOrder};
use sidestep_kernel::InputError;
use sidestep_scenario::{ImportReport, Source};
use std::path::Path;
use toml::Value;

/// The key by which a profile differs from a scenario.
const PROFILE_KEY: &str = "profile";
/// Side of a box in meters for effectors that do not say at which they were learned.
const ANY_BOX_M: f64 = 0.25;

/// Returns the report of the profile at `path`; `None` for another file.
///
/// # Errors
/// When it is a profile with mistakes: those that a scenario would meet that names it.
pub(crate) fn inspect_profile(path: &Path) -> Result<Option<ImportReport>, InputError> {
    if path.extension().is_none_or(|extension| extension != "toml") {
        return Ok(None);
    }
    let source = Source::read(path, &[])?;
    let table: Result<toml::Table, _> = source.text.parse();
    // A text that is not TOML is an error of a scenario, the more frequent kind of file.
    if !table.is_ok_and(|table| table.contains_key(PROFILE_KEY)) {
        return Ok(None);
    }
    let profile: ProfileFile = source.parse()?;
    let mut report = ImportReport::new("profile of sensors and effectors");
    for (name, sensor) in &profile.sensors {
        check(path, "sensors", &Value::from(vec![name.clone()]), ANY_BOX_M)?;
        let sensor = sensor.get_ref();
        let beams = sensor.bearings_deg.get_ref().len();
        let range_m = sensor.range_m.get();
        report.add_fact("sensor", format!("{name}: {beams} beams, range {range_m} m"));
    }
    for (name, effector) in &profile.effectors {
        let box_m = effector.get_ref().box_m.map(|m| m.get());
        check(path, "effector", &Value::from(name.clone()), box_m.unwrap_or(ANY_BOX_M))?;
        let learned = box_m.map_or(String::new(), |m| format!(", learned for boxes of {m} m"));
        report.add_fact("effector", format!("{name}{learned}"));
    }
    report.add_kept("sensors", profile.sensors.len());
    report.add_kept("effectors", profile.effectors.len());
    Ok(Some(report))
}

/// Compiles a scenario with one robot that names an entry of a profile: only that finds every mistake in it.
fn check(profile: &Path, key: &str, name: &Value, box_m: f64) -> Result<(), InputError> {
    let profile = std::path::absolute(profile).unwrap_or_else(|_| profile.to_path_buf());
    let profiles = Value::from(vec![profile.display().to_string()]);
    let text = format!(
        "format = 1\nworld = \"robots\"\nprofiles = {profiles}\nmap = {{ ascii = \".....\", box_size_m = {box_m:?} }}\n\
         robots = {{ count = 1, {key} = {name} }}\n"
    );
    let source = Source::new(profile.display().to_string(), text, "");
    Compiled::new(&source, &Behaviours::new(), StorageOrder::Spatial).map(|_| ())
}
