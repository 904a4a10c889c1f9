//! An airspace scenario that needs no other file, as a run folder keeps it.

use super::scenario::CompiledAirspace;
use sidestep_kernel::InputError;
use sidestep_scenario::{Bundle, ResolvedScenario, Source};
use std::path::Path;

/// Returns the scenario as it ran, with the files of its areas and winds. Its number of cycles may follow from the flights, and types of
/// airplanes are stored as they were read: a later version may have other built-in ones.
///
/// # Errors
/// When the text is no longer a valid scenario, or the file can no longer be read.
pub(crate) fn resolve_scenario(
    source: &Source,
    compiled: &CompiledAirspace,
) -> Result<ResolvedScenario, InputError> {
    let mut bundle = Bundle::new(source, compiled.seed, compiled.cycles);
    if let Some(types) = compiled.types_text() {
        let path = bundle.add("types.toml", types.into_bytes());
        bundle.set("airspace.types_file", format_args!("{path:?}"));
    }
    if let Some(path) = compiled.areas_file() {
        let file = Path::new(path).file_name().unwrap_or_default().display();
        let path = bundle.copy(&format!("areas-{file}"), path)?;
        bundle.set("airspace.areas_file", format_args!("{path:?}"));
    }
    if let Some(path) = compiled.wind_file() {
        let file = Path::new(path).file_name().unwrap_or_default().display();
        let path = bundle.copy(&format!("wind-{file}"), path)?;
        bundle.set("airspace.wind_file", format_args!("{path:?}"));
    }
    bundle.finish()
}
