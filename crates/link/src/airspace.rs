//! Airplanes: their world at the server, and a pilot at each node.

use crate::agent::{
    Activity, AgentPercept, AgentProgram, Channel, Controls, InvalidControl, OutgoingPacket,
};
use crate::distributed::DistributedWorld;
use crate::faults::FaultyChannel;
use crate::protocol::CycleStart;
use crate::recent_senders::{RecentSenders, drop_counts};
use sidestep::kernel::network::NetworkAgent;
use sidestep::kernel::{Cycle, EntityId, Simulation};
use sidestep::worlds::airspace::pilot::{Percept, Pilot};
use sidestep::worlds::airspace::settings::Deployment;
use sidestep::worlds::airspace::{AirspaceRun, AirspaceWorld, Fleet};
use sidestep_session::fleet::AgentName;
use std::any::Any;
use std::sync::Arc;

/// Part of a cycle after which an agent asks again: an eighth of the time that a talk has, and a little less.
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
            let remedy = "add --set airspace.deployment=compact-team, or another one of team, pim and \
                          hierarchical-pim";
            return Err((cause, remedy));
        }
        Ok(Self { world })
    }
}

fn airspace_run(run: &dyn Simulation) -> &AirspaceRun {
    let run: &dyn Any = run;
    run.downcast_ref().expect("it is a run of an airspace")
}

impl DistributedWorld for DistributedAirspace {
    fn count(&self) -> usize {
        self.world.airplanes.len()
    }

    fn name(&self, agent: EntityId) -> AgentName {
        AgentName::Airplane(agent)
    }

    fn id(&self, name: AgentName) -> Option<EntityId> {
        match name {
            AgentName::Airplane(id) => Some(id).filter(|&id| (id as usize) < self.count()),
            AgentName::Connector { .. } => None,
        }
    }

    fn cycle_s(&self) -> f64 {
        self.world.timing.dt_s
    }

    fn has_faults(&self) -> bool {
        self.world.network.is_some()
    }

    fn timeout_override(&self, _: f64) -> Option<String> {
        // As long as possible, because processes answer more slowly than agents in memory.
        let patience_s = RETRY_DELAY_FRACTION * self.cycle_s();
        (!self.has_faults()).then(|| format!("airspace.network.patience_s={patience_s}"))
    }

    fn percepts(&self, run: &dyn Simulation) -> Vec<AgentPercept> {
        let beyond = airspace_run(run).out_of_range();
        let one = |percept: Percept| {
            let agent = percept.own.id;
            let place = beyond.binary_search_by_key(&agent, |(id, _)| *id);
            let beyond = place.map(|k| beyond[k].1.clone()).unwrap_or_default();
            let sight = postcard::to_stdvec(&percept).expect("percepts are plain data");
            let begin = CycleStart { cycle: percept.cycle, sight, beyond };
            AgentPercept { agent, group: percept.members(), begin }
        };
        airspace_run(run).percepts().into_iter().map(one).collect()
    }

    fn invalid_controls(&self, run: &dyn Simulation, controls: &Controls) -> Vec<InvalidControl> {
        let refused = airspace_run(run).invalid_controls(controls).into_iter();
        refused.map(|(agent, reason)| InvalidControl { agent, reason }).collect()
    }

    fn program(&self, agent: EntityId, build: &str) -> Box<dyn AgentProgram> {
        let pilot = Pilot::new(self.world.clone(), agent, Default::default()).with_build(build);
        Box::new(PilotProgram { world: self.world.clone(), pilot, heard: RecentSenders::default() })
    }

    fn channel(&self, agent: EntityId) -> Option<Box<dyn Channel>> {
        let world = self.world.clone();
        let talks = move |cycle| world.conversation_times(cycle).to_vec();
        Some(Box::new(FaultyChannel::new(self.world.fault_injector()?, agent, talks)))
    }
}

/// A pilot, at a node.
struct PilotProgram {
    world: Arc<AirspaceWorld>,
    pilot: Pilot,
    heard: RecentSenders,
}

impl AgentProgram for PilotProgram {
    fn start_cycle(&mut self, cycle: Cycle, sight: &[u8]) -> Result<u64, String> {
        let percept: Percept = postcard::from_bytes(sight).map_err(|e| e.to_string())?;
        if (percept.own.id, percept.cycle) != (self.pilot.id(), cycle) {
            return Err("it is of another airplane, or of another cycle".into());
        }
        percept.check(&self.world).map_err(|why| format!("it cannot be: {why:?}"))?;
        self.heard.start_cycle();
        let tick = self.world.conversation_times(cycle)[0].0;
        self.pilot.start(percept, tick);
        Ok(tick)
    }

    fn on_packet(&mut self, from: EntityId, payload: &[u8], tick: u64) {
        self.heard.record(from);
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

    fn activity(&self) -> Activity {
        let word = match &self.pilot {
            pilot if pilot.is_done() => "done",
            pilot if pilot.has_decided() => "shield",
            pilot if pilot.has_group() => "decide",
            _ => "group",
        };
        let progress = self.pilot.progress().unwrap_or_default();
        Activity { word, round: progress.round, epoch: progress.epoch.into() }
    }

    fn heard_agents(&self) -> Vec<EntityId> {
        self.heard.senders()
    }

    fn drop_counts(&self) -> Vec<(String, u64)> {
        drop_counts(&self.pilot.drop_counts())
    }
}
