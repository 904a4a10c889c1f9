//! The worlds with agents that may be processes, by their scenarios.

use crate::airspace::DistributedAirspace;
use crate::chain::DistributedChains;
use crate::distributed::DistributedWorld;
use crate::protocol::Fingerprint;
use sidestep::kernel::{Digest, InputError};
use sidestep::scenario::{CompiledScenario, Source};
use sidestep::worlds::{airspace, chain};
use std::sync::Arc;

/// Returns the fingerprint of a scenario: of its text, with all changes, and of all files that it names.
///
/// # Errors
/// When one of them cannot be read.
pub fn fingerprint(
    compiled: &dyn CompiledScenario,
    source: &Source,
) -> Result<Fingerprint, InputError> {
    let resolved = compiled.resolve(source)?;
    let mut all = resolved.text.into_bytes();
    for (name, content) in resolved.files {
        all.extend(
            [name.as_bytes(), &content]
                .map(|part| Digest::hash_bytes(part).to_string())
                .concat()
                .bytes(),
        );
    }
    Ok(Digest::hash_bytes(&all).to_string()[..16].to_string())
}

/// Returns the world of a scenario, if its agents can be nodes.
///
/// # Errors
/// When it is another world, or one process decides for all.
pub fn distributed_world(
    compiled: &dyn CompiledScenario,
    source: &Source,
) -> Result<Arc<dyn DistributedWorld>, InputError> {
    let any = compiled.as_any();
    let found: Result<Arc<dyn DistributedWorld>, (&str, &str)> =
        if let Some(one) = any.downcast_ref::<airspace::scenario::CompiledAirspace>() {
            DistributedAirspace::new(one.world.clone()).map(|all| Arc::new(all) as _)
        } else if let Some(one) = any.downcast_ref::<chain::scenario::ChainScenario<2>>() {
            DistributedChains::new(one.world.clone()).map(|all| Arc::new(all) as _)
        } else if let Some(one) = any.downcast_ref::<chain::scenario::ChainScenario<3>>() {
            DistributedChains::new(one.world.clone()).map(|all| Arc::new(all) as _)
        } else {
            let cause = format!("agents of the world `{}` decide in one process", compiled.world());
            let remedy = "give a scenario with world = \"airspace\" or world = \"chain\"";
            return Err(InputError::new(&source.place, cause, remedy));
        };
    found.map_err(|(cause, remedy)| InputError::new(&source.place, cause, remedy))
}
