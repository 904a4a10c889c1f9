//! A run that passes at a speed, and that services pause, step and reset.

use super::goals::{GoalOrders, TRIP_ORDER};
use super::node::{RosInput, RosNode, RunService, ServiceRequest};
use super::trajectories::{JOINTS_ORDER, TrajectoryOrders};
use super::velocity::{ACTION_ORDER, VelocityOrders};
use crate::wire::endpoint::WireSetupError;
use sidestep::kernel::EntityId;
use sidestep::kernel::control::MultiAgentOrder;
use sidestep_session::fleet::RosGraph;
use sidestep_session::ros::RunTopics;
use sidestep_session::{Error, ManagedRun, Pacer, Watcher};
use std::time::{Duration, Instant};

/// The longest wait for a request: after it the process looks whether it has to end.
const POLL_INTERVAL: Duration = Duration::from_millis(20);

/// The reason why a run as a node has ended before its end.
#[derive(Debug, thiserror::Error)]
pub enum RosRunError {
    /// It was asked to end.
    #[error("interrupted")]
    Interrupted,
    /// A message cannot be sent.
    #[error(transparent)]
    Wire(#[from] WireSetupError),
    /// The run cannot be advanced or stored.
    #[error(transparent)]
    Run(#[from] Error),
}

/// How a run passes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RunPace {
    /// Seconds of the scenario in a second.
    pub speed: f64,
    /// Whether time stands still at first.
    pub starts_paused: bool,
}

/// A run as a node of ROS 2.
pub struct RosRun<'a> {
    run: ManagedRun,
    topics: RunTopics,
    velocities: VelocityOrders,
    goals: GoalOrders,
    trajectories: TrajectoryOrders,
    node: &'a mut RosNode,
    watcher: &'static dyn Watcher,
    /// The state at the start, to which the run is reset.
    start: Vec<u8>,
    cycles_per_s: f64,
    pacer: Pacer,
    is_paused: bool,
    /// Number of malformed inputs that were told.
    told_malformed: u64,
}

impl<'a> RosRun<'a> {
    /// Sends the first messages of a run, which is at its start; time does not pass yet.
    ///
    /// # Errors
    /// When they cannot be sent.
    pub fn start(
        mut run: ManagedRun,
        node: &'a mut RosNode,
        pace: RunPace,
        watcher: &'static dyn Watcher,
    ) -> Result<Self, RosRunError> {
        let start = run.checkpoint().map_err(Error::from)?;
        let topics = RunTopics::start(run.simulation_mut());
        let velocities = VelocityOrders::new(run.simulation());
        for robot in velocities.robots() {
            node.hear_velocities(robot)?;
        }
        let goals = GoalOrders::new(run.simulation());
        for robot in goals.robots() {
            node.hear_goals(robot)?;
        }
        let trajectories = TrajectoryOrders::new(run.simulation());
        for arm in trajectories.arms() {
            node.hear_trajectories(arm)?;
        }
        let cycle_s = run.simulation().scenery().cycle_s;
        let cycles_per_s = pace.speed / cycle_s;
        let pacer = Pacer::new(cycles_per_s, Instant::now(), run.cycle());
        let is_paused = pace.starts_paused;
        let told_malformed = 0;
        let mut started = Self {
            run,
            topics,
            velocities,
            goals,
            trajectories,
            node,
            watcher,
            start,
            cycles_per_s,
            pacer,
            is_paused,
            told_malformed,
        };
        started.publish()?;
        Ok(started)
    }

    /// Returns what the node shows by now.
    pub fn graph(&self) -> RosGraph {
        self.node.graph()
    }

    /// Lets the run pass until its end, or until `has_to_end` says so.
    ///
    /// # Errors
    /// When it is interrupted, or something cannot be sent or stored.
    pub fn pass(&mut self, has_to_end: &dyn Fn() -> bool) -> Result<(), RosRunError> {
        self.restart_clock();
        while !self.is_over() {
            if has_to_end() {
                return Err(RosRunError::Interrupted);
            }
            if let Some(input) = self.node.next_input(self.wait()) {
                self.receive(input)?;
            }
            self.tell_malformed_inputs();
            self.advance_to_due_cycle()?;
        }
        self.tell_refusals();
        Ok(())
    }

    /// Takes what has come in. The last command of a robot counts, whether it is a velocity or a goal.
    fn receive(&mut self, input: RosInput) -> Result<(), RosRunError> {
        match input {
            RosInput::Request(request) => self.handle(request)?,
            RosInput::Velocity { robot, velocity } => {
                self.goals.forget(robot);
                self.velocities.receive(robot, velocity, Instant::now());
            }
            RosInput::Goal { robot, goal } => {
                if self.goals.receive(self.run.simulation(), robot, &goal) {
                    self.velocities.forget(robot);
                }
            }
            RosInput::Trajectory { arm, trajectory } => {
                let run = self.run.simulation();
                self.trajectories.receive((run, &self.topics), arm, &trajectory);
            }
        }
        Ok(())
    }

    fn tell_refusals(&self) {
        let goals = self.goals.refused();
        let trajectories = self.trajectories.refused();
        if goals + trajectories > 0 {
            tracing::warn!(
                "{goals} goals and {trajectories} trajectories were refused, {} and {} taken",
                self.goals.accepted(),
                self.trajectories.accepted()
            );
        }
    }

    /// Returns the run, to be finished.
    pub fn into_managed_run(self) -> ManagedRun {
        self.run
    }

    fn is_over(&self) -> bool {
        let simulation = self.run.simulation();
        simulation.is_over() || simulation.cycle() >= simulation.config().cycles
    }

    /// Returns the time until the next cycle is due, or until the process has to look around.
    fn wait(&self) -> Duration {
        if self.is_paused {
            return POLL_INTERVAL;
        }
        let due = self.pacer.next_due(self.run.cycle());
        due.saturating_duration_since(Instant::now()).min(POLL_INTERVAL)
    }

    fn advance_to_due_cycle(&mut self) -> Result<(), RosRunError> {
        if self.is_paused {
            return Ok(());
        }
        let target = self.pacer.target(Instant::now(), self.run.cycle());
        // One at a time, so that each cycle has its messages.
        while self.run.cycle() < target && !self.is_over() {
            self.advance()?;
        }
        Ok(())
    }

    fn advance(&mut self) -> Result<(), RosRunError> {
        self.give_orders()?;
        self.run.advance_to(self.run.cycle() + 1, self.watcher)?;
        self.publish()
    }

    /// Orders what velocities, goals and trajectories ask for in the next cycle.
    fn give_orders(&mut self) -> Result<(), RosRunError> {
        let by_velocity = self.velocities.orders(Instant::now());
        self.order(ACTION_ORDER, &by_velocity.robots, &by_velocity.actions)?;
        let by_goal = self.goals.orders(self.run.simulation());
        self.order(ACTION_ORDER, &by_goal.robots, &by_goal.actions)?;
        self.order(TRIP_ORDER, &by_goal.marked, &by_goal.marks)?;
        for (arm, joints) in self.trajectories.orders(self.run.simulation(), &self.topics) {
            self.order(JOINTS_ORDER, &[arm], &joints)?;
        }
        Ok(())
    }

    fn order(
        &mut self,
        order: &str,
        agents: &[EntityId],
        values: &[f64],
    ) -> Result<(), RosRunError> {
        if agents.is_empty() {
            return Ok(());
        }
        let given = self.run.order(&MultiAgentOrder { order, agents, values });
        let bug = "please report it with the scenario: this is a bug";
        given.map_err(|error| Error::other(error.to_string(), bug))?;
        Ok(())
    }

    fn publish(&mut self) -> Result<(), RosRunError> {
        for message in self.topics.messages(self.run.simulation_mut()) {
            self.node.publish(&message)?;
        }
        Ok(())
    }

    /// Does what a service is asked for, and answers.
    fn handle(&mut self, request: ServiceRequest) -> Result<(), RosRunError> {
        let cycle = self.run.cycle();
        match request.service {
            RunService::Pause => {
                self.is_paused = true;
                request.answer(true, format!("paused at cycle {cycle}"));
            }
            RunService::Resume => {
                self.is_paused = false;
                self.restart_clock();
                request.answer(true, format!("time passes from cycle {cycle} on"));
            }
            RunService::Step if !self.is_paused => {
                request.answer(false, "time passes by itself: call pause first");
            }
            RunService::Step => {
                self.advance()?;
                request.answer(true, format!("at cycle {}", self.run.cycle()));
            }
            RunService::Reset => match self.reset() {
                Ok(()) => {
                    self.publish()?;
                    request.answer(true, format!("at cycle {}", self.run.cycle()));
                }
                Err(reason) => request.answer(false, reason),
            },
        }
        Ok(())
    }

    /// Takes the run back to its start, unless it is recorded: a folder holds one past.
    ///
    /// # Errors
    /// With the reason for the client.
    fn reset(&mut self) -> Result<(), String> {
        self.run.restore(&self.start).map_err(|error| error.to_string())?;
        // These were for where robots and arms were.
        self.velocities.clear();
        self.goals.clear();
        self.trajectories.clear();
        self.restart_clock();
        Ok(())
    }

    fn restart_clock(&mut self) {
        self.pacer = Pacer::new(self.cycles_per_s, Instant::now(), self.run.cycle());
    }

    fn tell_malformed_inputs(&mut self) {
        let malformed = self.node.malformed_inputs();
        if malformed > self.told_malformed {
            self.told_malformed = malformed;
            tracing::warn!(
                "{malformed} requests, velocities, goals and trajectories were dropped: they have no attachment as \
                 rmw_zenoh sends it, or their content is no CDR of finite numbers and of turns"
            );
        }
    }
}
