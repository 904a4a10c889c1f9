//! The distributed worlds, by their scenarios.

use crate::airspace::DistributedAirspace;
use crate::chain::DistributedChains;
use crate::distributed::DistributedWorld;
use crate::protocol::ScenarioFingerprint;
use sidestep::kernel::{Digest, InputError};
use sidestep::scenario::{CompiledScenario, Source};
use sidestep::worlds::{airspace, chain};
use std::sync::Arc;

/// Returns the fingerprint of a scenario: of its text, with all changes, and of all files to which it refers.
///
/// # Errors
/// When one of them cannot be read.
pub fn fingerprint(
    compiled: &dyn CompiledScenario,
    source: &Source,
) -> Result<ScenarioFingerprint, InputError> {
    let resolved = compiled.resolve(source)?;
    let mut bytes = resolved.text.into_bytes();
    for (name, content) in resolved.files {
        // Names and contents have any length: their digests, of a fixed length, cannot run into each other.
        bytes.extend(Digest::hash_bytes(name.as_bytes()).to_string().bytes());
        bytes.extend(Digest::hash_bytes(&content).to_string().bytes());
    }
    // 64 bits find any mistake, and are short enough for error messages.
    Ok(Digest::hash_bytes(&bytes).to_string()[..16].to_string())
}

/// Returns the world of a scenario, if its agents can be nodes.
///
/// # Errors
/// When it is another world, or the scenario has one process decide for all agents.
pub fn distributed_world(
    compiled: &dyn CompiledScenario,
    source: &Source,
) -> Result<Arc<dyn DistributedWorld>, InputError> {
    let compiled_world = compiled.as_any();
    let world: Result<Arc<dyn DistributedWorld>, (&str, &str)> = if let Some(airspace) =
        compiled_world.downcast_ref::<airspace::scenario::CompiledAirspace>()
    {
        DistributedAirspace::new(airspace.world.clone()).map(|world| Arc::new(world) as _)
    } else if let Some(plane) = compiled_world.downcast_ref::<chain::scenario::ChainScenario<2>>() {
        DistributedChains::new(plane.world.clone()).map(|world| Arc::new(world) as _)
    } else if let Some(space) = compiled_world.downcast_ref::<chain::scenario::ChainScenario<3>>() {
        DistributedChains::new(space.world.clone()).map(|world| Arc::new(world) as _)
    } else {
        let cause = format!("agents of the world `{}` decide in one process", compiled.world());
        let remedy = "give a scenario with world = \"airspace\" or world = \"chain\"";
        return Err(InputError::new(&source.place, cause, remedy));
    };
    world.map_err(|(cause, remedy)| InputError::new(&source.place, cause, remedy))
}
