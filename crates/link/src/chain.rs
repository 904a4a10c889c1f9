//! Connectors of chains: their world at the server, and the agent of one at each node.

use crate::agent::{
    Activity, AgentPercept, AgentProgram, Channel, Controls, InvalidControl, OutgoingPacket,
};
use crate::distributed::DistributedWorld;
use crate::faults::FaultyChannel;
use crate::protocol::CycleStart;
use crate::recent_senders::{RecentSenders, drop_counts};
use sidestep::kernel::network::NetworkAgent;
use sidestep::kernel::{Cycle, EntityId, Simulation};
use sidestep::worlds::chain::agents::{ChainControls, ConnectorAgent, ConnectorPercept as Percept};
use sidestep::worlds::chain::{ChainRun, ChainWorld, Deployment};
use sidestep_session::fleet::AgentName;
use std::any::Any;
use std::sync::Arc;

/// Part of a cycle after which a connector asks again: an eighth of the time that a talk has, and a little less.
const RETRY_DELAY_FRACTION: f64 = 0.1;

/// Seconds of real time in which a process answers: a request repeated sooner is useless.
const MIN_RETRY_DELAY_S: f64 = 2e-3;

/// Connectors that may be nodes, of chains in `D` dimensions.
pub(crate) struct DistributedChains<const D: usize> {
    world: Arc<ChainWorld<D>>,
}

impl<const D: usize> DistributedChains<D> {
    /// Returns the connectors of a world; an error has the cause and the remedy.
    pub(crate) fn new(world: Arc<ChainWorld<D>>) -> Result<Self, (&'static str, &'static str)> {
        if world.deployment == Deployment::Direct {
            let cause = "one process moves the chains (deployment = \"direct\")";
            return Err((cause, "add --set chain.deployment=team"));
        }
        Ok(Self { world })
    }

    fn chain_run<'a>(&self, run: &'a dyn Simulation) -> &'a ChainRun<D> {
        let run: &dyn Any = run;
        run.downcast_ref().expect("it is a run of these chains")
    }

    /// Returns the chain of a connector and its number there.
    fn chain_and_number(&self, agent: EntityId) -> (EntityId, u32) {
        self.world.find_connector(agent).expect("agents are the connectors of the world")
    }

    /// Returns the neighbors that a connector's radio does not reach, rising.
    fn unreachable_neighbors(&self, agent: EntityId, percept: &Percept<D>) -> Vec<EntityId> {
        let range_m = self.world.network.as_ref().map_or(f64::INFINITY, |network| network.range_m);
        let neighbors =
            [agent.wrapping_sub(1), agent + 1].into_iter().zip(percept.neighbor_distances_m());
        let is_beyond = |apart_m: Option<f64>| apart_m.is_some_and(|apart_m| apart_m > range_m);
        neighbors.filter(|(_, apart_m)| is_beyond(*apart_m)).map(|(id, _)| id).collect()
    }
}

impl<const D: usize> DistributedWorld for DistributedChains<D> {
    fn count(&self) -> usize {
        let chains = 0..;
        let lengths = chains.map(|chain| self.world.connector_count(chain) as usize);
        lengths.take_while(|&n| n > 0).sum()
    }

    fn name(&self, agent: EntityId) -> AgentName {
        let (chain, connector) = self.chain_and_number(agent);
        AgentName::Connector { chain, connector }
    }

    fn id(&self, name: AgentName) -> Option<EntityId> {
        match name {
            AgentName::Connector { chain, connector } => self.world.connector_id(chain, connector),
            AgentName::Airplane(_) => None,
        }
    }

    fn cycle_s(&self) -> f64 {
        self.world.dt_s
    }

    fn has_faults(&self) -> bool {
        self.world.network.is_some()
    }

    fn timeout_override(&self, speed: f64) -> Option<String> {
        // A bus answers in microseconds, and a process does not: repeating so soon would send everything many times.
        let is_long = |given_s: f64| given_s / speed >= MIN_RETRY_DELAY_S;
        let given_s = self.world.network.as_ref().map(|network| network.patience_s);
        let patience_s = RETRY_DELAY_FRACTION * self.cycle_s();
        let is_kept = given_s.is_some_and(|given_s| is_long(given_s) || given_s >= patience_s);
        (!is_kept).then(|| format!("chain.network.patience_s={patience_s}"))
    }

    fn waits_for_lost_nodes(&self) -> bool {
        true
    }

    fn keeps_controls_of_lost_nodes(&self) -> bool {
        // Its messages to neighbors since its decision may be lost with it.
        false
    }

    fn percepts(&self, run: &dyn Simulation) -> Vec<AgentPercept> {
        let run = self.chain_run(run);
        let mut sights = Vec::new();
        for (chain, percepts) in self.world.percepts_at(run.state(), run.cycle()) {
            let n = percepts.len() as u32;
            let first = self.world.connector_id(chain, 0).expect("a chain has connectors");
            let group: Vec<EntityId> = (first..first + n).collect();
            for (&agent, percept) in group.iter().zip(&percepts) {
                let sight = postcard::to_stdvec(percept).expect("percepts are plain data");
                let beyond = self.unreachable_neighbors(agent, percept);
                let begin = CycleStart { cycle: percept.cycle, sight, beyond };
                sights.push(AgentPercept { agent, group: group.clone(), begin });
            }
        }
        sights.sort_unstable_by_key(|sight| sight.agent);
        sights
    }

    fn max_further_rounds(&self, run: &dyn Simulation, groups: usize) -> usize {
        let run = self.chain_run(run);
        let waits = |chain: &usize| !run.state().has_submitted_controls(*chain, run.cycle());
        let waiting = (0..run.state().len()).filter(waits).count();
        waiting.saturating_sub(groups)
    }

    fn accept_controls(
        &self,
        run: &dyn Simulation,
        groups: &[Vec<EntityId>],
        controls: &mut Controls,
        gone: &[EntityId],
    ) -> Vec<InvalidControl> {
        let run = self.chain_run(run);
        let absurd = self.invalid_controls(run, controls);
        controls.retain(|(agent, _)| absurd.iter().all(|one| one.agent != *agent));
        controls.extend(gone.iter().map(|&id| (id, ChainControls::<D>::ABSENT_CONTROL.to_vec())));
        let read = self.world.read_controls(run.cycle(), controls).expect("all were read");
        let mut read: Vec<Option<ChainControls<D>>> = read.into_iter().map(Some).collect();
        for group in groups {
            let (chain, _) = self.chain_and_number(group[0]);
            let handed = read[chain as usize].take().expect("a chain talks once in a cycle");
            self.world.submit_controls(run.state(), chain, handed).expect("all were read");
        }
        absurd
    }

    fn invalid_controls(&self, run: &dyn Simulation, controls: &Controls) -> Vec<InvalidControl> {
        let now = run.cycle();
        let why = |(agent, bytes): &(EntityId, Vec<u8>)| {
            let reason = match self.world.read_control(now, *agent, bytes) {
                Err(reason) => reason,
                // Only the server declares an agent gone.
                Ok(None) => "it is no decision".into(),
                Ok(Some(_)) => return None,
            };
            Some(InvalidControl { agent: *agent, reason })
        };
        controls.iter().filter_map(why).collect()
    }

    fn program(&self, agent: EntityId, build: &str) -> Box<dyn AgentProgram> {
        let (chain, connector) = self.chain_and_number(agent);
        let first_tick = {
            let world = self.world.clone();
            Box::new(move |cycle| world.negotiation_start(cycle).0)
        };
        let agent = ConnectorAgent::new(&self.world, chain, connector).with_build(build);
        Box::new(ConnectorProgram { first_tick, agent, heard: RecentSenders::default() })
    }

    fn channel(&self, agent: EntityId) -> Option<Box<dyn Channel>> {
        let world = self.world.clone();
        let talks = move |cycle| vec![world.negotiation_start(cycle)];
        Some(Box::new(FaultyChannel::new(self.world.fault_injector()?, agent, talks)))
    }
}

/// The agent of a connector, at a node. Of the world it knows the clock and the agent's behavior.
struct ConnectorProgram<const D: usize> {
    /// Returns the first tick of a cycle's talk.
    first_tick: Box<dyn Fn(Cycle) -> u64 + Send>,
    agent: ConnectorAgent<D>,
    heard: RecentSenders,
}

impl<const D: usize> AgentProgram for ConnectorProgram<D> {
    fn start_cycle(&mut self, cycle: Cycle, sight: &[u8]) -> Result<u64, String> {
        let percept: Percept<D> = postcard::from_bytes(sight).map_err(|e| e.to_string())?;
        if percept.cycle != cycle {
            return Err("it is of another cycle".into());
        }
        let tick = (self.first_tick)(cycle);
        self.agent.start(percept, tick).map_err(|e| e.to_string())?;
        self.heard.start_cycle();
        Ok(tick)
    }

    fn on_packet(&mut self, from: EntityId, payload: &[u8], tick: u64) {
        self.heard.record(from);
        self.agent.on_packet(from, payload, tick);
    }

    fn on_timer(&mut self, tick: u64) {
        self.agent.on_timer(tick);
    }

    fn next_timer(&self) -> Option<u64> {
        self.agent.next_timer()
    }

    fn take_packets(&mut self) -> Vec<OutgoingPacket> {
        self.agent.take_packets()
    }

    fn control(&self) -> Option<Vec<u8>> {
        let control = self.agent.control()?;
        Some(postcard::to_stdvec(&control).expect("decisions are plain data"))
    }

    fn is_done(&self) -> bool {
        self.agent.is_done()
    }

    fn activity(&self) -> Activity {
        Activity { word: self.agent.role_name(), ..Activity::default() }
    }

    fn heard_agents(&self) -> Vec<EntityId> {
        self.heard.senders()
    }

    fn drop_counts(&self) -> Vec<(String, u64)> {
        drop_counts(&self.agent.drop_counts())
    }
}
