//! The distributed worlds, by their scenarios.

use crate::airspace::DistributedAirspace;
use crate::chain::DistributedChains;
use crate::distributed::DistributedWorld;
use crate::protocol::ScenarioFingerprint;
use crate::robots::DistributedRobots;
use sidestep::kernel::{Digest, InputError};
use sidestep::scenario::{CompiledScenario, Source};
use sidestep::worlds::{airspace, chain, robots};
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
    let world: Result<Arc<dyn DistributedWorld>, (String, String)> = if let Some(airspace) =
        compiled_world.downcast_ref::<airspace::scenario::CompiledAirspace>()
    {
        shared(DistributedAirspace::new(airspace.world.clone()))
    } else if let Some(plane) = compiled_world.downcast_ref::<chain::scenario::ChainScenario<2>>() {
        shared(DistributedChains::new(plane.world.clone()))
    } else if let Some(space) = compiled_world.downcast_ref::<chain::scenario::ChainScenario<3>>() {
        shared(DistributedChains::new(space.world.clone()))
    } else if let Some(building) = compiled_world.downcast_ref::<robots::scenario::Compiled>() {
        shared(DistributedRobots::new(building.world.clone()))
    } else {
        let cause = format!("agents of the world `{}` decide in one process", compiled.world());
        let remedy = "give a scenario with world = \"airspace\", \"chain\" or \"robots\"";
        return Err(InputError::new(&source.place, cause, remedy));
    };
    world.map_err(|(cause, remedy)| InputError::new(&source.place, cause, remedy))
}

/// Returns one of the worlds as any of them, or why its agents cannot be nodes: the cause and the remedy.
fn shared<W: DistributedWorld + 'static>(
    world: Result<W, (impl Into<String>, impl Into<String>)>,
) -> Result<Arc<dyn DistributedWorld>, (String, String)> {
    match world {
        Ok(world) => Ok(Arc::new(world)),
        Err((cause, remedy)) => Err((cause.into(), remedy.into())),
    }
}
