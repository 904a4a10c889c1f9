//! Deployments of the rules by which a chain moves: the same rules, run in several places.
//!
//! - `direct`: one process moves a whole chain. The reference.
//! - `team`: an agent per connector ([`crate::agents`]), which knows its own connector, its two
//!   neighbors and its sensors' view. On a faultless network every connector is where `direct` puts it,
//!   bit for bit, because no agent needs to know more: scenarios in which one would are refused
//!   (`crate::scenario::deployment`).
//!
//! A deployment gives the connectors of a chain their perception (`sense.rs`), runs their negotiation over a network
//! in memory (`negotiation.rs`) or in other processes (`remote_agents.rs` of the world), and carries their decisions
//! out (`outcome.rs`).

pub(crate) mod deployment;
mod negotiation;
mod outcome;
mod sense;
#[cfg(test)]
mod tests;

use crate::agents::{ChainCycleControls, ConnectorAgent, ConnectorPercept};
use crate::world::ChainWorld;
pub use deployment::Deployment;
pub(crate) use outcome::final_positions;
pub(crate) use sense::SensingContext;
use sidestep_kernel::{Cycle, EntityId};

impl<const D: usize> ChainWorld<D> {
    /// Lets the agents of a chain talk in a cycle; returns their decisions.
    pub(crate) fn negotiate(
        &self,
        chain: EntityId,
        now: Cycle,
        sights: Vec<ConnectorPercept<D>>,
    ) -> ChainCycleControls<D> {
        let mut agents = self.chain_agents(chain);
        let controls = negotiation::run_agents(
            negotiation::NegotiationContext::new(self, chain, now),
            &mut agents,
            sights,
        );
        ChainCycleControls { cycle: now, controls, gone: Vec::new() }
    }

    fn chain_agents(&self, chain: EntityId) -> Vec<ConnectorAgent<D>> {
        let n = self.chains[chain as usize].start.points().len() as u32;
        (0..n).map(|k| ConnectorAgent::new(self, chain, k)).collect()
    }
}
