//! The worlds with agents that may be processes, by their scenarios.

use crate::airspace::Airplanes;
use crate::chain::Connectors;
use crate::deployed::Deployed;
use crate::words::Fingerprint;
use sidestep::kernel::{Digest, InputError};
use sidestep::scenario::{Compiled, Source};
use sidestep::worlds::{airspace, chain};
use std::sync::Arc;

/// Returns the fingerprint of a scenario: of its text, with all changes, and of all files that it names.
///
/// # Errors
/// When one of them cannot be read.
pub fn fingerprint(compiled: &dyn Compiled, source: &Source) -> Result<Fingerprint, InputError> {
    let resolved = compiled.resolve(source)?;
    let mut all = resolved.text.into_bytes();
    for (name, content) in resolved.files {
        all.extend(
            [name.as_bytes(), &content].map(|part| Digest::of(part).to_string()).concat().bytes(),
        );
    }
    Ok(Digest::of(&all).to_string()[..16].to_string())
}

/// Returns the world of a scenario, if its agents can be nodes.
///
/// # Errors
/// When it is another world, or one process decides for all.
pub fn deployed(compiled: &dyn Compiled, source: &Source) -> Result<Arc<dyn Deployed>, InputError> {
    let any = compiled.as_any();
    let found: Result<Arc<dyn Deployed>, (&str, &str)> =
        if let Some(one) = any.downcast_ref::<airspace::scenario::Compiled>() {
            Airplanes::new(one.world.clone()).map(|all| Arc::new(all) as _)
        } else if let Some(one) = any.downcast_ref::<chain::scenario::Compiled<2>>() {
            Connectors::new(one.world.clone()).map(|all| Arc::new(all) as _)
        } else if let Some(one) = any.downcast_ref::<chain::scenario::Compiled<3>>() {
            Connectors::new(one.world.clone()).map(|all| Arc::new(all) as _)
        } else {
            let cause = format!("agents of the world `{}` decide in one process", compiled.world());
            let remedy = "give a scenario with world = \"airspace\" or world = \"chain\"";
            return Err(InputError::new(&source.place, cause, remedy));
        };
    found.map_err(|(cause, remedy)| InputError::new(&source.place, cause, remedy))
}
