//! Deployments of the rules by which a chain moves: the same rules, run in several places.
//!
//! - `direct`: one process moves a whole chain. The reference.
//! - `team`: an agent per connector ([`crate::agents`]), which knows its own connector, its two
//!   neighbors and its sensors' view. On a faultless network every connector is where `direct` puts it,
//!   bit for bit, because no agent needs to know more: scenarios in which one would are refused
//!   (`crate::scenario::deployment`).
//!
//! A deployment gives the connectors of a chain their perception (`sense.rs`), lets their agents talk over a network
//! in memory (`drive.rs`) or elsewhere (`elsewhere.rs` of the world), and carries their decisions out (`outcome.rs`).

mod drive;
pub(crate) mod kind;
mod outcome;
mod sense;
#[cfg(test)]
mod tests;

use crate::agents::{ConnectorAgent, Handed, Sight};
use crate::world::ChainWorld;
pub use kind::Deployment;
pub(crate) use outcome::settled;
pub(crate) use sense::Sensed;
use sidestep_kernel::{Cycle, EntityId};

impl<const D: usize> ChainWorld<D> {
    /// Lets the agents of a chain talk in a cycle; returns their decisions.
    pub(crate) fn talked(&self, chain: EntityId, now: Cycle, sights: Vec<Sight<D>>) -> Handed<D> {
        let mut agents = self.agents_of(chain);
        let controls = drive::run(drive::Talk::new(self, chain, now), &mut agents, sights);
        Handed { cycle: now, controls, gone: Vec::new() }
    }

    fn agents_of(&self, chain: EntityId) -> Vec<ConnectorAgent<D>> {
        let n = self.chains[chain as usize].start.points().len() as u32;
        (0..n).map(|k| ConnectorAgent::new(self, chain, k)).collect()
    }
}
