//! Robots on a grid: their world at the server, and the program of one at each node.

use crate::agent::{
    AgentActivity, AgentPercept, AgentProgram, ChannelModel, InvalidControl, SerializedControls,
};
use crate::distributed::DistributedWorld;
use crate::protocol::CycleStart;
use crate::robot_percept::read_percept;
use crate::vehicle::{RobotVehicle, VehiclePort};
use sidestep::kernel::{Cycle, EntityId, Simulation, World};
use sidestep::worlds::robots::agents::{RobotAgent, RobotControl};
use sidestep::worlds::robots::world::CYCLE_S;
use sidestep::worlds::robots::{RobotsRun, RobotsWorld};
use sidestep_session::fleet::AgentName;
use std::any::Any;
use std::sync::Arc;

/// Robots that may be nodes. Each decides by itself, so a cycle is one round of percepts and controls without any packets;
/// words of the radio come with the percept, through the scenario's losses.
pub(crate) struct DistributedRobots {
    world: Arc<RobotsWorld>,
}

impl DistributedRobots {
    /// Returns the robots of a world; an error has the cause and the remedy.
    pub(crate) fn new(world: Arc<RobotsWorld>) -> Result<Self, (String, String)> {
        if world.robot_count() == 0 {
            return Err(("there is no robot".into(), "add a section [[robots]]".into()));
        }
        if let Some(robot) = world.find_external_robot() {
            let cause =
                format!("robot {robot} follows the orders of a caller, and decides nothing");
            let remedy =
                "give its section a behavior of its own, e.g. behaviour = { kind = \"wander\" }";
            return Err((cause, remedy.into()));
        }
        Ok(Self { world })
    }

    /// Returns the program of a robot.
    fn agent(&self, id: EntityId) -> RobotAgent {
        let agent = RobotAgent::new(self.world.clone(), id);
        agent.expect("`new` has found no robot without a program")
    }
}

fn downcast_robots_run(run: &dyn Simulation) -> &RobotsRun {
    let run: &dyn Any = run;
    run.downcast_ref().expect("it is a run of robots")
}

impl DistributedWorld for DistributedRobots {
    fn agent_count(&self) -> usize {
        self.world.robot_count()
    }

    fn name(&self, agent: EntityId) -> AgentName {
        AgentName::new(RobotsWorld::AGENT, agent, None)
    }

    fn id(&self, name: &AgentName) -> Option<EntityId> {
        let id = name.number;
        let exists = (id as usize) < self.agent_count() && *name == self.name(id);
        exists.then_some(id)
    }

    fn cycle_s(&self) -> f64 {
        CYCLE_S
    }

    fn has_faults(&self) -> bool {
        // Robots send no packets: the losses of the radio are those of the world.
        false
    }

    fn response_timeout_override(&self, _: f64) -> Option<String> {
        // None waits for another one.
        None
    }

    fn waits_for_lost_nodes(&self) -> bool {
        // A percept has the robot's memory, so that another node can take over.
        true
    }

    fn percepts(&self, run: &dyn Simulation) -> Vec<AgentPercept> {
        let run = downcast_robots_run(run);
        let mut agent_percepts = Vec::new();
        for percept in self.world.percepts_in_cycle(run.state(), run.cycle()) {
            let start = CycleStart {
                cycle: percept.cycle,
                percept: postcard::to_stdvec(&percept).expect("percepts are plain data"),
                out_of_range: Vec::new(),
            };
            let agent = percept.id;
            agent_percepts.push(AgentPercept { agent, group: vec![agent], start });
        }
        agent_percepts
    }

    fn find_invalid_controls(
        &self,
        run: &dyn Simulation,
        controls: &SerializedControls,
    ) -> Vec<InvalidControl> {
        let run = downcast_robots_run(run);
        let invalid = self.world.find_invalid_controls(run.state(), run.cycle(), controls);
        invalid.into_iter().map(|(agent, reason)| InvalidControl { agent, reason }).collect()
    }

    fn program(&self, agent: EntityId, _: &str) -> Box<dyn AgentProgram> {
        Box::new(RobotProgram { agent: self.agent(agent), control: None })
    }

    fn has_vehicles(&self) -> bool {
        true
    }

    fn vehicle_program(
        &self,
        agent: EntityId,
        port: Box<dyn VehiclePort>,
    ) -> Option<Box<dyn AgentProgram>> {
        Some(Box::new(RobotVehicle::new(self.world.clone(), agent, port)))
    }

    fn channel(&self, _: EntityId) -> Option<Box<dyn ChannelModel>> {
        None
    }
}

/// The program of a robot, at a node: it decides as soon as it perceives.
struct RobotProgram {
    agent: RobotAgent,
    /// Its decision in the present cycle.
    control: Option<RobotControl>,
}

impl AgentProgram for RobotProgram {
    fn start_cycle(&mut self, cycle: Cycle, percept: &[u8]) -> Result<u64, String> {
        // Of the cycle before.
        self.control = None;
        self.control = Some(self.agent.decide(&read_percept(cycle, percept)?)?);
        // A cycle of robots has no ticks.
        Ok(0)
    }

    fn is_done(&self) -> bool {
        self.control.is_some()
    }

    fn control(&self) -> Option<Vec<u8>> {
        let control = self.control.as_ref()?;
        Some(postcard::to_stdvec(control).expect("controls are plain data"))
    }

    fn activity(&self) -> AgentActivity {
        let name = if self.is_done() { "done" } else { "rest" };
        AgentActivity { name, ..AgentActivity::default() }
    }
}
