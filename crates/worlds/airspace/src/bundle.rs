//! An airspace scenario that needs no other file: what a run folder keeps.

use super::scenario::Compiled;
use sidestep_kernel::InputError;
use sidestep_scenario::{Bundle, Resolved, Source};

/// The scenario as it ran. It names no other file, but its number of cycles may follow from the
/// flights.
///
/// # Errors
/// When the text is no scenario any more.
pub fn resolve(source: &Source, compiled: &Compiled) -> Result<Resolved, InputError> {
    Bundle::new(source, compiled.seed, compiled.cycles).finish()
}
