//! The run at the server of a fleet: recorded, and with agents that decide at their nodes.

use crate::agent::{AgentPercept, InvalidControl, SerializedControls};
use crate::distributed::DistributedWorld;
use sidestep::kernel::view::{Frame, FrameOptions};
use sidestep::kernel::{Cycle, EntityId, Simulation};
use sidestep_session::{Error, ManagedRun, Watcher};
use std::sync::Arc;

/// A run whose agents are nodes.
///
/// A cycle is one round of percepts and controls, or several where agents decide one after the other; then
/// [`HostedRun::advance`] computes it.
pub struct HostedRun {
    run: ManagedRun,
    watcher: &'static dyn Watcher,
    world: Arc<dyn DistributedWorld>,
    /// Controls of the present cycle.
    controls: SerializedControls,
    keeps_events: bool,
}

impl HostedRun {
    /// Returns a run of a world, at its present cycle.
    pub fn new(
        run: ManagedRun,
        world: Arc<dyn DistributedWorld>,
        watcher: &'static dyn Watcher,
    ) -> Self {
        Self { run, watcher, world, controls: Vec::new(), keeps_events: false }
    }

    /// Returns the run, to be finished.
    pub fn into_managed_run(self) -> ManagedRun {
        self.run
    }

    /// Returns the simulation, for reading.
    pub fn simulation(&self) -> &dyn Simulation {
        self.run.simulation()
    }

    /// Returns the world, with its agents.
    pub fn world(&self) -> &dyn DistributedWorld {
        self.world.as_ref()
    }

    /// Returns the agents that have nodes, in ascending order.
    pub fn all_agents(&self) -> impl Iterator<Item = EntityId> + use<> {
        0..self.world.agent_count() as EntityId
    }

    /// Returns the name of an agent for people, e.g. `airplane 3`.
    pub fn agent_display_name(&self, agent: EntityId) -> String {
        let name = self.world.name(agent);
        format!("{} {name}", name.noun)
    }

    /// Returns the present cycle: the one to be computed next.
    pub fn cycle(&self) -> Cycle {
        self.run.cycle()
    }

    /// Returns whether there is no further cycle.
    pub fn is_over(&self) -> bool {
        let simulation = self.simulation();
        simulation.is_over() || simulation.cycle() >= simulation.config().cycles
    }

    /// Returns the percepts of the agents that decide in the next round of the present cycle, by ascending id.
    pub fn percepts(&self) -> Vec<AgentPercept> {
        self.world.percepts(self.simulation())
    }

    /// Returns the largest number of rounds of this cycle that may follow one with this number of groups.
    pub fn max_further_rounds(&self, groups: usize) -> usize {
        self.world.max_further_rounds(self.simulation(), groups)
    }

    /// Receives the controls of a round with the given groups; agents without one do what is safe without. Returns the
    /// invalid ones.
    pub fn accept_controls(
        &mut self,
        groups: &[Vec<EntityId>],
        mut controls: SerializedControls,
        lost: &[EntityId],
    ) -> Vec<InvalidControl> {
        let invalid =
            self.world.accept_controls(self.run.simulation(), groups, &mut controls, lost);
        self.controls.append(&mut controls);
        invalid
    }

    /// Computes the present cycle with the controls of its rounds. Invalid ones are returned, and their agents do what is
    /// safe without one.
    ///
    /// # Errors
    /// When the cycle cannot be recorded.
    pub fn advance(&mut self) -> Result<Vec<InvalidControl>, Error> {
        let mut controls = std::mem::take(&mut self.controls);
        controls.sort_by_key(|(agent, _)| *agent);
        let mut invalid = Vec::new();
        // A simulation takes all controls or none. So the check of each by itself, which costs as much again, is made only
        // if there is an invalid one.
        if self.run.simulation_mut().submit_controls(&controls).is_err() {
            invalid = self.world.find_invalid_controls(self.simulation(), &controls);
            controls.retain(|(agent, _)| invalid.iter().all(|one| one.agent != *agent));
            let submitted = self.run.simulation_mut().submit_controls(&controls);
            submitted
                .map_err(|e| Error::other(e.to_string(), "please report it: this is a bug"))?;
        }
        let next = self.run.cycle() + 1;
        self.run.advance_to(next, self.watcher)?;
        Ok(invalid)
    }

    /// Returns the present frame, with the events since the frame before. The state of the run does not change.
    pub fn frame(&mut self) -> Frame {
        let simulation = self.run.simulation_mut();
        // The simulation keeps events from the first frame on: without a viewer nobody would ever take them.
        if !self.keeps_events {
            simulation.enable_events();
            self.keeps_events = true;
        }
        simulation.frame(FrameOptions::WITHOUT_SCANS)
    }
}
