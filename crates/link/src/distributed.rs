//! A world whose agents may be processes: the interface that a server and its nodes use.

use crate::agent::{AgentPercept, AgentProgram, ChannelModel, InvalidControl, SerializedControls};
use crate::vehicle::VehiclePort;
use sidestep::kernel::{EntityId, InputError, Simulation};
use sidestep_session::fleet::AgentName;

/// A world of agents with programs of their own.
pub trait DistributedWorld: Send + Sync {
    /// Number of agents; their ids on the network are those below.
    fn agent_count(&self) -> usize;

    /// Returns the name by which users call an agent.
    fn name(&self, agent: EntityId) -> AgentName;

    /// Returns the id of a named agent; none if there is no such agent.
    fn id(&self, name: &AgentName) -> Option<EntityId>;

    /// Duration of a cycle, in seconds of the scenario.
    fn cycle_s(&self) -> f64;

    /// Returns whether packets may be lost, delayed or duplicated.
    fn has_faults(&self) -> bool;

    /// Returns the change of the scenario, as `key=value`, that gives agents a timeout for the answers of others, where
    /// time passes `speed` times as fast: without one they would wait forever for an agent whose node is lost. None where
    /// the scenario's own timeout will do.
    fn response_timeout_override(&self, speed: f64) -> Option<String>;

    /// Returns whether a fleet in lockstep waits for a lost node to be replaced. Otherwise it ends.
    fn waits_for_lost_nodes(&self) -> bool {
        false
    }

    /// Returns the percepts of the agents that decide next in the present cycle, by ascending id.
    fn percepts(&self, run: &dyn Simulation) -> Vec<AgentPercept>;

    /// Returns the largest number of rounds of this cycle that may follow one with this number of groups; 0 where all
    /// agents decide at once.
    fn max_further_rounds(&self, _: &dyn Simulation, _: usize) -> usize {
        0
    }

    /// Returns whether a control counts if it arrived before the node of its agent was lost.
    fn accepts_controls_from_lost_nodes(&self) -> bool {
        true
    }

    /// Receives the controls of a round with the given groups, where later rounds depend on them, and removes invalid
    /// ones, which it returns. `lost` are the agents without a node; `controls` has none of theirs unless these count
    /// ([`DistributedWorld::accepts_controls_from_lost_nodes`]).
    fn accept_controls(
        &self,
        _run: &dyn Simulation,
        _groups: &[Vec<EntityId>],
        _controls: &mut SerializedControls,
        _lost: &[EntityId],
    ) -> Vec<InvalidControl> {
        Vec::new()
    }

    /// Returns the controls of the present cycle that cannot be read or carried out.
    fn find_invalid_controls(
        &self,
        run: &dyn Simulation,
        controls: &SerializedControls,
    ) -> Vec<InvalidControl>;

    /// Returns the program of an agent, which accepts packets only from programs of the same build.
    fn program(&self, agent: EntityId, build: &str) -> Box<dyn AgentProgram>;

    /// Returns whether vehicles may decide for its agents: these have public messages.
    fn has_vehicles(&self) -> bool {
        false
    }

    /// Returns the program of an agent that a vehicle decides for, which is beyond a port; none where agents of this world
    /// have no public messages.
    fn vehicle_program(
        &self,
        _: EntityId,
        _: Box<dyn VehiclePort>,
    ) -> Option<Box<dyn AgentProgram>> {
        None
    }

    /// Returns the faults of the scenario's network for packets of an agent; none where it has no network.
    fn channel(&self, agent: EntityId) -> Option<Box<dyn ChannelModel>>;

    /// Returns the id of a named agent.
    ///
    /// # Errors
    /// When there is no such agent.
    fn find_agent_id(&self, name: &AgentName) -> Result<EntityId, InputError> {
        self.id(name).ok_or_else(|| {
            let cause = format!("the scenario has no {} {name}", name.noun);
            InputError::new(name.option(), cause, self.agent_hint())
        })
    }

    /// Returns a remedy that lists the existing agents, by the option that selects one.
    fn agent_hint(&self) -> String {
        let last = self.name(self.agent_count().saturating_sub(1) as EntityId);
        format!("give {} to {last}", self.name(0).option())
    }
}
