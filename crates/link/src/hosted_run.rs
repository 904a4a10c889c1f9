//! The run at the server of a fleet: recorded, and with agents that decide at their nodes.

use crate::agent::{AgentPercept, InvalidControl, SerializedControls};
use crate::distributed::DistributedWorld;
use sidestep::kernel::view::{Frame, FrameOptions, LogEvent};
use sidestep::kernel::{Cycle, EntityId, Simulation};
use sidestep_session::{Error, ManagedRun, Watcher};
use std::sync::Arc;

/// Most events of a frame for viewers, who get the last ones: a viewer may have missed any of the frames before.
const MAX_VIEW_EVENTS: usize = 200;

/// Receives every frame of a run.
pub trait FrameObserver {
    /// Receives the frame before the first cycle, or after one, with the events since the frame before.
    fn on_frame(&mut self, frame: &Frame);

    /// Is called when there is no further frame.
    fn on_end(&mut self);
}

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
    observer: Option<Box<dyn FrameObserver>>,
    /// The newest frame that the observer has received, with events that no viewer has; none once a viewer has it.
    unviewed: Option<Frame>,
}

impl HostedRun {
    /// Returns a run of a world, at its present cycle.
    pub fn new(
        run: ManagedRun,
        world: Arc<dyn DistributedWorld>,
        watcher: &'static dyn Watcher,
    ) -> Self {
        Self {
            run,
            watcher,
            world,
            controls: Vec::new(),
            keeps_events: false,
            observer: None,
            unviewed: None,
        }
    }

    /// Returns the same run with an observer, which receives the present frame at once.
    #[must_use]
    pub fn with_observer(mut self, observer: Box<dyn FrameObserver>) -> Self {
        self.observer = Some(observer);
        self.show_observer();
        self
    }

    /// Returns the run, to be finished.
    pub fn into_managed_run(self) -> ManagedRun {
        if let Some(mut observer) = self.observer {
            observer.on_end();
        }
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
        self.show_observer();
        Ok(invalid)
    }

    /// Shows the observer the present frame, and keeps it for viewers: each event is in one frame only.
    fn show_observer(&mut self) {
        if self.observer.is_none() {
            return;
        }
        let mut frame = self.take_frame();
        if let Some(observer) = &mut self.observer {
            observer.on_frame(&frame);
        }
        if let Some(unviewed) = self.unviewed.take() {
            frame.log_left_out += unviewed.log_left_out;
            prepend_events(&mut frame, unviewed.log);
        }
        self.unviewed = Some(frame);
    }

    /// Returns the present frame for viewers, with the events since the one before. The state of the run does not change.
    pub fn frame(&mut self) -> Frame {
        self.unviewed.take().unwrap_or_else(|| self.take_frame())
    }

    fn take_frame(&mut self) -> Frame {
        let simulation = self.run.simulation_mut();
        // The simulation keeps events from the first frame on: without a viewer nobody would ever take them.
        if !self.keeps_events {
            simulation.enable_events();
            self.keeps_events = true;
        }
        simulation.frame(FrameOptions::WITHOUT_SCANS)
    }
}

/// Adds earlier events to a frame for viewers, as far as there is room; those that go are counted.
pub(crate) fn prepend_events(frame: &mut Frame, mut earlier: Vec<LogEvent>) {
    earlier.append(&mut frame.log);
    let excess = earlier.len().saturating_sub(MAX_VIEW_EVENTS);
    earlier.drain(..excess);
    frame.log_left_out += excess as u64;
    frame.log = earlier;
}
