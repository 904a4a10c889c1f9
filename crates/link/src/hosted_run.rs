//! The stage of a fleet at its server: a recorded run with agents that decide elsewhere.

use crate::agent::{AgentPercept, Controls, InvalidControl};
use crate::distributed::DistributedWorld;
use sidestep::kernel::view::{Frame, FrameOptions as View};
use sidestep::kernel::{Cycle, EntityId, Simulation};
use sidestep_session::{Error, ManagedRun, Watcher};
use std::sync::Arc;

/// A run of agents that are nodes.
///
/// A cycle is one round of sights and controls, or several where agents decide one after the other; then it is made.
pub struct HostedRun {
    journey: ManagedRun,
    watcher: &'static dyn Watcher,
    world: Arc<dyn DistributedWorld>,
    /// Controls of the cycle to come.
    controls: Controls,
    is_watched: bool,
}

impl HostedRun {
    /// Returns the stage of a run of a world.
    pub fn new(
        journey: ManagedRun,
        world: Arc<dyn DistributedWorld>,
        watcher: &'static dyn Watcher,
    ) -> Self {
        Self { journey, watcher, world, controls: Vec::new(), is_watched: false }
    }

    /// Returns the run, to be finished.
    pub fn into_managed_run(self) -> ManagedRun {
        self.journey
    }

    /// Returns the run, for reading.
    pub fn run(&self) -> &dyn Simulation {
        self.journey.simulation()
    }

    /// Returns the world, with its agents.
    pub fn world(&self) -> &dyn DistributedWorld {
        self.world.as_ref()
    }

    /// Returns the agents that have nodes, rising.
    pub fn agents(&self) -> impl Iterator<Item = EntityId> + use<> {
        0..self.world.count() as EntityId
    }

    /// Returns the name of an agent for people, e.g. `airplane 3`.
    pub fn agent_label(&self, agent: EntityId) -> String {
        let name = self.world.name(agent);
        format!("{} {name}", name.noun())
    }

    /// Returns the cycle that comes next.
    pub fn cycle(&self) -> Cycle {
        self.journey.cycle()
    }

    /// Returns whether there is no further cycle.
    pub fn is_over(&self) -> bool {
        self.run().is_over() || self.run().cycle() >= self.run().config().cycles
    }

    /// Returns the percepts of the agents that decide in the next round of the cycle to come, by rising id.
    pub fn percepts(&self) -> Vec<AgentPercept> {
        self.world.percepts(self.run())
    }

    /// Returns the largest number of rounds of this cycle that may follow one with this number of groups.
    pub fn max_further_rounds(&self, groups: usize) -> usize {
        self.world.max_further_rounds(self.run(), groups)
    }

    /// Takes the controls of a round with the given groups; agents without one do the safe thing. Returns those that
    /// make no sense.
    pub fn accept_controls(
        &mut self,
        groups: &[Vec<EntityId>],
        mut controls: Controls,
        gone: &[EntityId],
    ) -> Vec<InvalidControl> {
        let absurd =
            self.world.accept_controls(self.journey.simulation(), groups, &mut controls, gone);
        self.controls.append(&mut controls);
        absurd
    }

    /// Makes the cycle to come with the controls that were taken. Those that make no sense are returned, and their
    /// agents do the safe thing.
    ///
    /// # Errors
    /// When it cannot be recorded.
    pub fn advance(&mut self) -> Result<Vec<InvalidControl>, Error> {
        let mut controls = std::mem::take(&mut self.controls);
        controls.sort_by_key(|(agent, _)| *agent);
        let mut absurd = Vec::new();
        if self.journey.simulation_mut().submit_controls(&controls).is_err() {
            absurd = self.world.invalid_controls(self.run(), &controls);
            controls.retain(|(agent, _)| absurd.iter().all(|one| one.agent != *agent));
            let handed = self.journey.simulation_mut().submit_controls(&controls);
            handed.map_err(|e| Error::other(e.to_string(), "please report it: this is a bug"))?;
        }
        let next = self.journey.cycle() + 1;
        self.journey.advance_to(next, self.watcher)?;
        Ok(absurd)
    }

    /// Returns the present frame, with the events since the frame before. Looking changes nothing.
    pub fn frame(&mut self) -> Frame {
        let run = self.journey.simulation_mut();
        // Events are kept from now on: a fleet without watchers keeps none.
        if !std::mem::replace(&mut self.is_watched, true) {
            run.enable_events();
        }
        run.frame(View::WITHOUT_SCANS)
    }
}
