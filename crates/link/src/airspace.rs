//! Airplanes: their world at the server, and the program of a pilot at each node.

use crate::agent::{
    AgentActivity, AgentPercept, AgentProgram, ChannelModel, InvalidControl, OutgoingPacket,
    SerializedControls,
};
use crate::distributed::DistributedWorld;
use crate::faults::FaultyChannel;
use crate::protocol::CycleStart;
use crate::recent_senders::{RecentSenders, drop_counts};
use sidestep::kernel::network::NetworkAgent;
use sidestep::kernel::{Cycle, EntityId, Simulation, World};
use sidestep::worlds::airspace::pilot::{Percept, Pilot};
use sidestep::worlds::airspace::settings::Deployment;
use sidestep::worlds::airspace::{AirspaceRun, AirspaceWorld, RemotePilotRun};
use sidestep_session::fleet::AgentName;
use std::any::Any;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Fraction of a cycle after which an agent repeats a request in real time, where the scenario has no network. A scenario
/// must leave room for eight requests in a conversation, and two conversations have nine tenths of a cycle: 0.45 / 8,
/// rounded down.
const RETRY_DELAY_FRACTION: f64 = 0.05;

/// Airplanes that may be nodes.
pub(crate) struct DistributedAirspace {
    world: Arc<AirspaceWorld>,
}

impl DistributedAirspace {
    /// Returns the airplanes of a world; an error has the cause and the remedy.
    pub(crate) fn new(world: Arc<AirspaceWorld>) -> Result<Self, (&'static str, &'static str)> {
        if world.deployment == Deployment::Direct {
            let cause = "one process decides for all airplanes (deployment = \"direct\")";
            let remedy = "add --set airspace.deployment=compact-team, or another one of team, replica-team, \
                          pim and hierarchical-pim";
            return Err((cause, remedy));
        }
        Ok(Self { world })
    }
}

fn downcast_airspace_run(run: &dyn Simulation) -> &AirspaceRun {
    let run: &dyn Any = run;
    run.downcast_ref().expect("it is a run of an airspace")
}

impl DistributedWorld for DistributedAirspace {
    fn agent_count(&self) -> usize {
        self.world.airplanes.len()
    }

    fn name(&self, agent: EntityId) -> AgentName {
        AgentName::new(AirspaceWorld::AGENT, agent, None)
    }

    fn id(&self, name: &AgentName) -> Option<EntityId> {
        let id = name.number;
        let exists = (id as usize) < self.agent_count() && *name == self.name(id);
        exists.then_some(id)
    }

    fn cycle_s(&self) -> f64 {
        self.world.timing.dt_s
    }

    fn has_faults(&self) -> bool {
        self.world.network.is_some()
    }

    fn response_timeout_override(&self, _: f64) -> Option<String> {
        // As long as a scenario may give: processes answer more slowly than agents in memory, and a shorter time would
        // repeat requests that are about to be answered.
        let patience_s = RETRY_DELAY_FRACTION * self.cycle_s();
        (!self.has_faults()).then(|| format!("airspace.network.patience_s={patience_s}"))
    }

    fn percepts(&self, run: &dyn Simulation) -> Vec<AgentPercept> {
        let run = downcast_airspace_run(run);
        let out_of_range: BTreeMap<EntityId, Vec<EntityId>> =
            run.unreachable_members().into_iter().collect();
        let mut agent_percepts = Vec::new();
        for percept in run.percepts() {
            let agent = percept.own.id;
            let start = CycleStart {
                cycle: percept.cycle,
                percept: postcard::to_stdvec(&percept).expect("percepts are plain data"),
                out_of_range: out_of_range.get(&agent).cloned().unwrap_or_default(),
            };
            agent_percepts.push(AgentPercept { agent, group: percept.members(), start });
        }
        agent_percepts
    }

    fn find_invalid_controls(
        &self,
        run: &dyn Simulation,
        controls: &SerializedControls,
    ) -> Vec<InvalidControl> {
        let invalid = downcast_airspace_run(run).find_invalid_controls(controls).into_iter();
        invalid.map(|(agent, reason)| InvalidControl { agent, reason }).collect()
    }

    fn program(&self, agent: EntityId, build: &str) -> Box<dyn AgentProgram> {
        let pilot = Pilot::new(self.world.clone(), agent, Default::default()).with_build_id(build);
        Box::new(PilotProgram {
            world: self.world.clone(),
            pilot,
            senders: RecentSenders::default(),
        })
    }

    fn channel(&self, agent: EntityId) -> Option<Box<dyn ChannelModel>> {
        let world = self.world.clone();
        let injector = self.world.fault_injector()?;
        Some(Box::new(FaultyChannel::new(injector, agent, move |cycle| {
            world.conversation_times(cycle).to_vec()
        })))
    }
}

/// The program of a pilot at a node, with what the node reports about it.
struct PilotProgram {
    world: Arc<AirspaceWorld>,
    pilot: Pilot,
    senders: RecentSenders,
}

impl AgentProgram for PilotProgram {
    fn start_cycle(&mut self, cycle: Cycle, percept: &[u8]) -> Result<u64, String> {
        let percept: Percept = postcard::from_bytes(percept).map_err(|e| e.to_string())?;
        if (percept.own.id, percept.cycle) != (self.pilot.id(), cycle) {
            return Err("it is of another airplane, or of another cycle".into());
        }
        percept.check(&self.world).map_err(|error| format!("it cannot be: {error:?}"))?;
        self.senders.start_cycle();
        let tick = self.world.conversation_times(cycle)[0].0;
        self.pilot.start(percept, tick);
        Ok(tick)
    }

    fn on_packet(&mut self, from: EntityId, payload: &[u8], tick: u64) {
        self.senders.record(from);
        self.pilot.on_packet(from, payload, tick);
    }

    fn on_timer(&mut self, tick: u64) {
        self.pilot.on_timer(tick);
    }

    fn next_timer(&self) -> Option<u64> {
        self.pilot.next_timer()
    }

    fn take_packets(&mut self) -> Vec<OutgoingPacket> {
        self.pilot.take_packets()
    }

    fn control(&self) -> Option<Vec<u8>> {
        let control = self.pilot.control()?;
        Some(postcard::to_stdvec(&control).expect("controls are plain data"))
    }

    fn is_done(&self) -> bool {
        self.pilot.is_done()
    }

    fn activity(&self) -> AgentActivity {
        let name = if self.pilot.is_done() {
            "done"
        } else if self.pilot.has_decided() {
            "shield"
        } else if self.pilot.has_group() {
            "decide"
        } else {
            "group"
        };
        let progress = self.pilot.progress().unwrap_or_default();
        AgentActivity { name, round: progress.round, epoch: progress.epoch.into() }
    }

    fn heard_agents(&self) -> Vec<EntityId> {
        self.senders.senders()
    }

    fn drop_counts(&self) -> Vec<(String, u64)> {
        drop_counts(&self.pilot.drop_counts())
    }
}
