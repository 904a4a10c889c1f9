//! The agents of a chain elsewhere: their perception in a cycle, and the decisions that a world takes from them.
//!
//! A caller that runs agents in processes of their own asks for [`ChainWorld::percepts_in_cycle`], sends each
//! connector's sight to its agent, hands the decisions over ([`ChainWorld::submit_controls`]), and repeats
//! that until no sights are left: chains that may meet move one after the other. Then it advances the
//! run by a cycle. A chain for which nothing was handed over talks in memory.
//!
//! A run that is to be recorded and computed again is handed all decisions of a cycle, as bytes, before it advances
//! ([`sidestep_kernel::Simulation::submit_controls`]): in such a cycle no chain talks in memory, and one whose connectors
//! said nothing stands.

use super::agents::{ChainCycleControls, ChainPercepts, ConnectorControl};
use super::deploy::Deployment;
use super::perceive::Perceiver;
use super::scratch::Scratch;
use super::state::ChainWorldState;
use super::world::ChainWorld;
use super::{act, claim, join};
use sidestep_kernel::conflict::ConflictGroups;
use sidestep_kernel::control::OrderError;
use sidestep_kernel::ports::ManualClock;
use sidestep_kernel::{Cycle, EntityId, EntitySlot, InputError, PhaseContext};
use std::collections::BTreeSet;

impl<const D: usize> ChainWorld<D> {
    /// Returns the perception of chains' connectors in the cycle to come, `now`: of those chains whose
    /// turn it is, because those before them have handed over their decisions. Nothing changes. Where no
    /// team is deployed there is no perception.
    pub fn percepts_in_cycle(
        &self,
        state: &ChainWorldState<D>,
        now: Cycle,
    ) -> Vec<ChainPercepts<D>> {
        let state = &state.trial_copy();
        let clock = &ManualClock::default();
        let mut scratch = Scratch::new(self);
        scratch.percept_log = Some(Vec::new());
        let phase = &mut PhaseContext { world: self, state, now, clock, scratch: &mut scratch };
        let groups = ConflictGroups::new(state.len());
        (0..state.len()).for_each(|slot| claim::claim_box(phase, slot));
        join::join_conflict_groups(phase, 0..state.len(), &groups);
        for slot in 0..state.len() {
            let mut perceiver = Perceiver { world: self, state, now, scratch: phase.scratch };
            let decision = perceiver.decide(slot as EntitySlot);
            state.set_decision(slot, decision);
        }
        for slot in (0..state.len() as EntitySlot).filter(|&slot| groups.leader(slot) == slot) {
            let mut group = Vec::new();
            groups.members(slot, &mut group);
            group.sort_unstable();
            let percepts_before = count_percepts(phase.scratch);
            for &member in &group {
                act::act_one(phase, &group, member);
                // The chains after it perceive where it goes, which its agents have yet to decide.
                if count_percepts(phase.scratch) != percepts_before {
                    break;
                }
            }
        }
        scratch.percept_log.unwrap_or_default()
    }

    /// Hands over the decisions of a chain's agents for the cycle to come. Unless all that take part in a
    /// motion agree, no connector moves; nor does any where an agent is gone.
    ///
    /// # Errors
    /// When the chain does not exist, or a decision is not that of its connector in this cycle.
    pub fn submit_controls(
        &self,
        state: &ChainWorldState<D>,
        chain: EntityId,
        handed: ChainCycleControls<D>,
    ) -> Result<(), InputError> {
        let place = format!("decisions of chain {chain}");
        let Some(spec) = self.chains.get(chain as usize) else {
            let cause = format!("there are {} chains", self.chains.len());
            return Err(InputError::new(place, cause, "count from 0"));
        };
        if let Err((cause, remedy)) = handed.check(spec.start.points().len()) {
            return Err(InputError::new(place, cause, remedy));
        }
        state.body_mut(chain as usize).submitted = Some(handed);
        Ok(())
    }

    /// Reads the decision of a connector for cycle `now`, by its id on the network; none if its agent is gone
    /// ([`ChainCycleControls::ABSENT_CONTROL`]).
    ///
    /// # Errors
    /// With the cause, when it is no decision, or none of this connector in this cycle.
    pub fn read_control(
        &self,
        now: Cycle,
        id: EntityId,
        bytes: &[u8],
    ) -> Result<Option<ConnectorControl<D>>, String> {
        let Some((chain, connector)) = self.find_connector(id) else {
            return Err("there is no such connector; give ids of connectors".into());
        };
        if bytes == ChainCycleControls::<D>::ABSENT_CONTROL {
            return Ok(None);
        }
        let read = postcard::take_from_bytes::<ConnectorControl<D>>(bytes).ok();
        let Some((control, _)) = read.filter(|(_, rest)| rest.is_empty()) else {
            return Err("its bytes are none of a decision of this build".into());
        };
        let n = self.connector_count(chain);
        let mut alone = ChainCycleControls::empty(now, n as usize);
        alone.controls[connector as usize] = Some(control);
        alone.check(n as usize).map_err(|(cause, _)| cause)?;
        Ok(alone.controls.swap_remove(connector as usize))
    }

    /// Reads the decisions of connectors for cycle `now`, by their ids on the network; returns those of each chain.
    ///
    /// # Errors
    /// When one of them is none of its connector in this cycle.
    pub fn decode_agent_controls(
        &self,
        now: Cycle,
        controls: &[(EntityId, Vec<u8>)],
    ) -> Result<Vec<ChainCycleControls<D>>, OrderError> {
        let lengths = self.chains.iter().map(|spec| spec.start.points().len());
        let mut all: Vec<_> = lengths.map(|n| ChainCycleControls::empty(now, n)).collect();
        let mut known = BTreeSet::new();
        for (id, bytes) in controls {
            let control = self.read_control(now, *id, bytes);
            let control = control.map_err(|cause| self.control_error(*id, cause))?;
            if !known.insert(*id) {
                let cause = "there are two of it; give one for each connector".into();
                return Err(self.control_error(*id, cause));
            }
            let Some((chain, connector)) = self.find_connector(*id) else { continue };
            let handed = &mut all[chain as usize];
            match control {
                Some(control) => handed.controls[connector as usize] = Some(control),
                None => handed.gone.push(connector),
            }
        }
        Ok(all)
    }

    fn control_error(&self, id: EntityId, cause: String) -> OrderError {
        OrderError::Control { agent: self.connector_name(id), cause }
    }

    /// Records the decisions of connectors in cycle `now`, by their ids on the network: no chain talks in memory in it.
    ///
    /// # Errors
    /// When the chains are not deployed as teams, or a decision is none of its connector; nothing is recorded then.
    pub(crate) fn record_controls(
        &self,
        state: &ChainWorldState<D>,
        now: Cycle,
        controls: &[(EntityId, Vec<u8>)],
    ) -> Result<(), OrderError> {
        if self.deployment == Deployment::Direct {
            let cause =
                "one process moves the chains (deployment = \"direct\"); set deployment = \"team\"";
            return Err(OrderError::NoExternalAgents { cause: cause.into() });
        }
        for (chain, handed) in self.decode_agent_controls(now, controls)?.into_iter().enumerate() {
            state.body_mut(chain).submitted = Some(handed);
        }
        Ok(())
    }

    /// Returns the number of connectors of a chain; 0 of one that does not exist.
    pub fn connector_count(&self, chain: EntityId) -> u32 {
        self.chains.get(chain as usize).map_or(0, |spec| spec.start.points().len() as u32)
    }

    /// Returns the id on the network of a connector of a chain, if there is one.
    pub fn connector_id(&self, chain: EntityId, connector: u32) -> Option<EntityId> {
        (connector < self.connector_count(chain))
            .then(|| self.first_connector_id(chain) + connector)
    }

    /// Returns the chain of a connector and its number there, by its id on the network.
    pub fn find_connector(&self, id: EntityId) -> Option<(EntityId, u32)> {
        let mut k = id;
        for chain in 0..self.chains.len() as EntityId {
            match k.checked_sub(self.connector_count(chain)) {
                Some(beyond) => k = beyond,
                None => return Some((chain, k)),
            }
        }
        None
    }

    /// Returns the name of a connector for people.
    fn connector_name(&self, id: EntityId) -> String {
        match self.find_connector(id) {
            Some((chain, k)) => format!("connector {k} of chain {chain}"),
            None => format!("connector of id {id}"),
        }
    }
}

/// Returns the number of chains whose connectors have been asked what to do.
fn count_percepts<const D: usize>(scratch: &Scratch<D>) -> usize {
    scratch.percept_log.as_ref().map_or(0, Vec::len)
}
