//! An airspace scenario that needs no other file, as a run folder keeps it.

use super::scenario::CompiledAirspace;
use sidestep_kernel::InputError;
use sidestep_scenario::{Bundle, ResolvedScenario, Source};

/// Returns the scenario as it ran. It names no other file, but its number of cycles may follow from
/// the flights.
///
/// # Errors
/// When the text is no longer a valid scenario.
pub(crate) fn resolve_scenario(
    source: &Source,
    compiled: &CompiledAirspace,
) -> Result<ResolvedScenario, InputError> {
    Bundle::new(source, compiled.seed, compiled.cycles).finish()
}
