//! Connectors of chains: their world at the server, and the program of one at each node.

use crate::agent::{
    AgentActivity, AgentPercept, AgentProgram, ChannelModel, InvalidControl, OutgoingPacket,
    SerializedControls,
};
use crate::distributed::DistributedWorld;
use crate::faults::FaultyChannel;
use crate::protocol::CycleStart;
use crate::recent_senders::{RecentSenders, drop_counts};
use sidestep::kernel::network::NetworkAgent;
use sidestep::kernel::{Cycle, EntityId, Simulation};
use sidestep::worlds::chain::agents::{
    ChainCycleControls, ConnectorAgent, ConnectorPercept as Percept,
};
use sidestep::worlds::chain::{ChainRun, ChainWorld, Deployment};
use sidestep_session::fleet::AgentName;
use std::any::Any;
use std::sync::Arc;

/// Fraction of a cycle after which a connector repeats a request in real time, where the scenario gives no usable time.
/// A scenario must leave room for eight requests in a conversation, which has nine tenths of a cycle: 0.9 / 8, rounded
/// down.
const RETRY_DELAY_FRACTION: f64 = 0.1;

/// Time in seconds of real time in which a process answers: a request that is repeated sooner is useless.
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

    fn downcast_chain_run<'a>(&self, run: &'a dyn Simulation) -> &'a ChainRun<D> {
        let run: &dyn Any = run;
        run.downcast_ref().expect("it is a run of these chains")
    }

    /// Returns the chain of a connector and its number there.
    fn chain_and_number(&self, agent: EntityId) -> (EntityId, u32) {
        self.world.find_connector(agent).expect("agents are the connectors of the world")
    }

    /// Returns the neighbors that a connector's radio does not reach, in ascending order.
    fn out_of_range_neighbors(&self, agent: EntityId, percept: &Percept<D>) -> Vec<EntityId> {
        let range_m = self.world.network.as_ref().map_or(f64::INFINITY, |network| network.range_m);
        let neighbors =
            [agent.wrapping_sub(1), agent + 1].into_iter().zip(percept.neighbor_distances_m());
        // An end of a chain has one neighbor: the distance to the other one is none.
        neighbors
            .filter(|(_, distance_m)| distance_m.is_some_and(|distance_m| distance_m > range_m))
            .map(|(id, _)| id)
            .collect()
    }
}

/// The noun for an agent of a fleet: each connector of a chain has a process of its own.
const CONNECTOR: &str = "connector";

impl<const D: usize> DistributedWorld for DistributedChains<D> {
    fn agent_count(&self) -> usize {
        // Chains are numbered from 0 on; one that does not exist has no connectors.
        let connectors = (0..).map(|chain| self.world.connector_count(chain) as usize);
        connectors.take_while(|&count| count > 0).sum()
    }

    fn name(&self, agent: EntityId) -> AgentName {
        let (chain, connector) = self.chain_and_number(agent);
        AgentName::new(CONNECTOR, chain, Some(connector))
    }

    fn id(&self, name: &AgentName) -> Option<EntityId> {
        if name.noun != CONNECTOR {
            return None;
        }
        self.world.connector_id(name.number, name.part?)
    }

    fn cycle_s(&self) -> f64 {
        self.world.dt_s
    }

    fn has_faults(&self) -> bool {
        self.world.network.is_some()
    }

    fn response_timeout_override(&self, speed: f64) -> Option<String> {
        let patience_s = RETRY_DELAY_FRACTION * self.cycle_s();
        if let Some(network) = &self.world.network {
            let given_s = network.patience_s;
            // A scenario may describe a bus, which answers in microseconds. Processes do not: repeating a request that
            // soon would send everything many times.
            let is_long_enough = given_s / speed >= MIN_RETRY_DELAY_S;
            if is_long_enough || given_s >= patience_s {
                return None;
            }
        }
        Some(format!("chain.network.patience_s={patience_s}"))
    }

    fn waits_for_lost_nodes(&self) -> bool {
        // A connector remembers nothing between cycles that the server does not tell it: another node can take over.
        true
    }

    fn accepts_controls_from_lost_nodes(&self) -> bool {
        // What it has sent its neighbors since its decision may be lost with it: they may have decided otherwise, and a rod
        // would tear if only one of its ends moved.
        false
    }

    fn percepts(&self, run: &dyn Simulation) -> Vec<AgentPercept> {
        let run = self.downcast_chain_run(run);
        let mut agent_percepts = Vec::new();
        for (chain, percepts) in self.world.percepts_in_cycle(run.state(), run.cycle()) {
            let n = percepts.len() as u32;
            let first = self.world.connector_id(chain, 0).expect("a chain has connectors");
            let group: Vec<EntityId> = (first..first + n).collect();
            for (&agent, percept) in group.iter().zip(&percepts) {
                let start = CycleStart {
                    cycle: percept.cycle,
                    percept: postcard::to_stdvec(percept).expect("percepts are plain data"),
                    out_of_range: self.out_of_range_neighbors(agent, percept),
                };
                agent_percepts.push(AgentPercept { agent, group: group.clone(), start });
            }
        }
        agent_percepts.sort_unstable_by_key(|percept| percept.agent);
        agent_percepts
    }

    fn max_further_rounds(&self, run: &dyn Simulation, groups: usize) -> usize {
        let run = self.downcast_chain_run(run);
        let undecided = (0..run.state().len())
            .filter(|&chain| !run.state().has_submitted_controls(chain, run.cycle()))
            .count();
        // In the worst case each of the other chains waits for another one, and decides in a round of its own.
        undecided.saturating_sub(groups)
    }

    fn accept_controls(
        &self,
        run: &dyn Simulation,
        groups: &[Vec<EntityId>],
        controls: &mut SerializedControls,
        lost: &[EntityId],
    ) -> Vec<InvalidControl> {
        let run = self.downcast_chain_run(run);
        let invalid = self.find_invalid_controls(run, controls);
        controls.retain(|(agent, _)| invalid.iter().all(|one| one.agent != *agent));
        // The neighbors of a lost connector have decided without its answers: the world must know that it was absent.
        controls
            .extend(lost.iter().map(|&id| (id, ChainCycleControls::<D>::ABSENT_CONTROL.to_vec())));
        let by_chain =
            self.world.decode_agent_controls(run.cycle(), controls).expect("all are valid");
        let mut by_chain: Vec<Option<ChainCycleControls<D>>> =
            by_chain.into_iter().map(Some).collect();
        for group in groups {
            let (chain, _) = self.chain_and_number(group[0]);
            let controls = by_chain[chain as usize].take().expect("a chain decides once a cycle");
            self.world.submit_controls(run.state(), chain, controls).expect("all are valid");
        }
        invalid
    }

    fn find_invalid_controls(
        &self,
        run: &dyn Simulation,
        controls: &SerializedControls,
    ) -> Vec<InvalidControl> {
        let mut invalid = Vec::new();
        for (agent, bytes) in controls {
            let reason = match self.world.read_control(run.cycle(), *agent, bytes) {
                Err(reason) => reason,
                // It reads as an absent connector, and only the server may declare one absent.
                Ok(None) => "it is no decision".into(),
                Ok(Some(_)) => continue,
            };
            invalid.push(InvalidControl { agent: *agent, reason });
        }
        invalid
    }

    fn program(&self, agent: EntityId, build: &str) -> Box<dyn AgentProgram> {
        let (chain, connector) = self.chain_and_number(agent);
        let world = self.world.clone();
        Box::new(ConnectorProgram {
            first_tick: Box::new(move |cycle| world.negotiation_start(cycle).0),
            agent: ConnectorAgent::new(&self.world, chain, connector).with_build(build),
            senders: RecentSenders::default(),
        })
    }

    fn channel(&self, agent: EntityId) -> Option<Box<dyn ChannelModel>> {
        let world = self.world.clone();
        let injector = self.world.fault_injector()?;
        Some(Box::new(FaultyChannel::new(injector, agent, move |cycle| {
            vec![world.negotiation_start(cycle)]
        })))
    }
}

/// The program of a connector, at a node. Of the world it knows the clock and the agent's behavior.
struct ConnectorProgram<const D: usize> {
    /// Returns the first tick of a cycle's conversation.
    first_tick: Box<dyn Fn(Cycle) -> u64 + Send>,
    agent: ConnectorAgent<D>,
    senders: RecentSenders,
}

impl<const D: usize> AgentProgram for ConnectorProgram<D> {
    fn start_cycle(&mut self, cycle: Cycle, percept: &[u8]) -> Result<u64, String> {
        let percept: Percept<D> = postcard::from_bytes(percept).map_err(|e| e.to_string())?;
        if percept.cycle != cycle {
            return Err("it is of another cycle".into());
        }
        let tick = (self.first_tick)(cycle);
        self.agent.start(percept, tick).map_err(|e| e.to_string())?;
        self.senders.start_cycle();
        Ok(tick)
    }

    fn on_packet(&mut self, from: EntityId, payload: &[u8], tick: u64) {
        self.senders.record(from);
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

    fn activity(&self) -> AgentActivity {
        AgentActivity { name: self.agent.role_name(), ..AgentActivity::default() }
    }

    fn heard_agents(&self) -> Vec<EntityId> {
        self.senders.senders()
    }

    fn drop_counts(&self) -> Vec<(String, u64)> {
        drop_counts(&self.agent.drop_counts())
    }
}
