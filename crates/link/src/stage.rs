//! The stage of a fleet at its server: a recorded run with agents that decide elsewhere.

use crate::deployed::Deployed;
use crate::ports::{Absurd, Controls, Sight};
use sidestep::kernel::view::{Frame, Look as View};
use sidestep::kernel::{Cycle, EntityId, Simulation};
use sidestep_session::{Error, Journey, Watcher};
use std::sync::Arc;

/// A run of agents that are nodes.
///
/// A cycle is one round of sights and controls, or several where agents decide one after the other; then it is made.
pub struct Stage {
    journey: Journey,
    watcher: &'static dyn Watcher,
    world: Arc<dyn Deployed>,
    /// Controls of the cycle to come.
    controls: Controls,
    is_watched: bool,
}

impl Stage {
    /// Returns the stage of a run of a world.
    pub fn new(journey: Journey, world: Arc<dyn Deployed>, watcher: &'static dyn Watcher) -> Self {
        Self { journey, watcher, world, controls: Vec::new(), is_watched: false }
    }

    /// Returns the run, to be finished.
    pub fn into_journey(self) -> Journey {
        self.journey
    }

    /// Returns the run, for reading.
    pub fn run(&self) -> &dyn Simulation {
        self.journey.simulation()
    }

    /// Returns the world, with its agents.
    pub fn world(&self) -> &dyn Deployed {
        self.world.as_ref()
    }

    /// Returns the agents that have nodes, rising.
    pub fn agents(&self) -> impl Iterator<Item = EntityId> + use<> {
        0..self.world.count() as EntityId
    }

    /// Returns the name of an agent for people, e.g. `airplane 3`.
    pub fn called(&self, agent: EntityId) -> String {
        let name = self.world.name(agent);
        format!("{} {name}", name.noun())
    }

    /// Returns the cycle that comes next.
    pub fn cycle(&self) -> Cycle {
        self.journey.cycle()
    }

    /// Returns whether there is no further cycle.
    pub fn is_over(&self) -> bool {
        self.run().is_over() || self.run().cycle() >= self.run().plan().cycles
    }

    /// Returns the percepts of the agents that decide in the next round of the cycle to come, by rising id.
    pub fn sights(&self) -> Vec<Sight> {
        self.world.sights(self.run())
    }

    /// Returns the largest number of rounds of this cycle that may follow one with this number of groups.
    pub fn further_rounds(&self, groups: usize) -> usize {
        self.world.further_rounds(self.run(), groups)
    }

    /// Takes the controls of a round with the given groups; agents without one do the safe thing. Returns those that
    /// make no sense.
    pub fn take(
        &mut self,
        groups: &[Vec<EntityId>],
        mut controls: Controls,
        gone: &[EntityId],
    ) -> Vec<Absurd> {
        let absurd = self.world.take(self.journey.simulation(), groups, &mut controls, gone);
        self.controls.append(&mut controls);
        absurd
    }

    /// Makes the cycle to come with the controls that were taken. Those that make no sense are returned, and their
    /// agents do the safe thing.
    ///
    /// # Errors
    /// When it cannot be recorded.
    pub fn advance(&mut self) -> Result<Vec<Absurd>, Error> {
        let mut controls = std::mem::take(&mut self.controls);
        controls.sort_by_key(|(agent, _)| *agent);
        let mut absurd = Vec::new();
        if self.journey.simulation_mut().hand_over(&controls).is_err() {
            absurd = self.world.absurd(self.run(), &controls);
            controls.retain(|(agent, _)| absurd.iter().all(|one| one.agent != *agent));
            let handed = self.journey.simulation_mut().hand_over(&controls);
            handed.map_err(|e| Error::stopped(e.to_string(), "please report it: this is a bug"))?;
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
            run.watch();
        }
        run.frame(View::BODIES)
    }
}
