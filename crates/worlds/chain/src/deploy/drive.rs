//! The agents of a chain on a network in memory, which can lose, delay, double and reorder packets,
//! cut links, and silence a connector.
//!
//! Time on it passes in ticks: a packet takes one, or more when it is delayed. Every draw depends
//! on sender, receiver and tick, never on the order in which agents are visited.

use crate::agents::network::Network;
use crate::agents::{ConnectorAgent, Control, Outgoing, Sight};
use crate::world::{ChainWorld, purpose};
use sidestep_kernel::interrupt;
use sidestep_kernel::ports::{Envelope, MemoryTransport, Transport};
use sidestep_kernel::stream::Streams;
use sidestep_kernel::{Cycle, EntityId};

/// The network of a chain for the talk of a cycle.
#[derive(Debug, Clone, Copy)]
pub(super) struct Talk<'a> {
    /// Faults of the network; with `None` it loses nothing, and agents wait as long as it takes.
    pub(super) network: Option<&'a Network>,
    pub(super) streams: Streams,
    pub(super) chain: EntityId,
    pub(super) first_id: EntityId,
    pub(super) now: Cycle,
    pub(super) at_s: f64,
}

impl<'a> Talk<'a> {
    /// Returns the talk of a chain in a cycle.
    pub(super) fn new<const D: usize>(
        world: &'a ChainWorld<D>,
        chain: EntityId,
        now: Cycle,
    ) -> Self {
        let (network, streams) = (world.network.as_ref(), world.streams);
        let (first_id, at_s) = (world.first_id(chain), world.starts_s(now));
        Self { network, streams, chain, first_id, now, at_s }
    }

    /// Returns the tick in which the talk starts.
    fn begins(&self) -> u64 {
        self.network.map_or(0, |network| self.now * (network.deadline_ticks() + 1))
    }

    fn carries(&self, envelope: &Envelope) -> bool {
        let Some(network) = self.network else { return true };
        let at_s = self.at_s + (envelope.cycle - self.begins()) as f64 * network.latency_s;
        let link = [envelope.sender, envelope.receiver].map(|id| id - self.first_id);
        network.carries(self.chain, link, at_s)
    }
}

/// The network, and until when something may still arrive at each agent.
struct Air<'a> {
    talk: Talk<'a>,
    memory: MemoryTransport,
    longest: u64,
    busy_until: Vec<u64>,
}

impl Air<'_> {
    /// Hands an agent's packets to the network.
    fn send<const D: usize>(&mut self, agent: &mut ConnectorAgent<D>, tick: u64) {
        let sender = agent.id();
        for (sequence, Outgoing { to, payload }) in (0..).zip(agent.take_packets()) {
            let envelope = Envelope { cycle: tick, sender, sequence, receiver: to, payload };
            if self.talk.carries(&envelope) {
                self.busy_until[(to - self.talk.first_id) as usize] = tick + self.longest;
                self.memory.send(envelope);
            }
        }
    }

    /// Lets an agent take what has arrived, look at the clock, and answer.
    fn step<const D: usize>(&mut self, k: usize, agent: &mut ConnectorAgent<D>, tick: u64) {
        let is_due = agent.next_timer().is_some_and(|due| due <= tick);
        if self.busy_until[k] >= tick {
            for envelope in self.memory.receive(agent.id(), tick) {
                agent.on_packet(envelope.sender, &envelope.payload, tick);
            }
        } else if !is_due {
            return;
        }
        agent.on_timer(tick);
        self.send(agent, tick);
    }
}

/// Lets the agents of a chain talk until all are done; `sights[k]` is that of `agents[k]`. Returns their
/// decisions in the same order.
///
/// # Panics
/// When a sight makes no sense.
pub(super) fn run<const D: usize>(
    talk: Talk<'_>,
    agents: &mut [ConnectorAgent<D>],
    sights: Vec<Sight<D>>,
) -> Vec<Option<Control<D>>> {
    let faults = talk.network.map(Network::faults).unwrap_or_default();
    let memory = MemoryTransport::new(talk.streams, purpose::NETWORK, faults);
    let longest = talk.network.map_or(1, Network::longest_ticks);
    let mut air = Air { talk, memory, longest, busy_until: vec![0; agents.len()] };
    let mut tick = talk.begins();
    for (agent, sight) in agents.iter_mut().zip(sights) {
        agent.begin(sight, tick).expect("a world shows its connectors what is there");
        air.send(agent, tick);
    }
    while !agents.iter().all(ConnectorAgent::is_done) {
        interrupt::look();
        let timers = agents.iter().filter_map(ConnectorAgent::next_timer);
        let next = timers.chain(air.memory.next_arrival()).min();
        tick = tick.max(next.expect("agents that are not done wait for something"));
        agents.iter_mut().enumerate().for_each(|(k, agent)| air.step(k, agent, tick));
    }
    agents.iter().map(ConnectorAgent::control).collect()
}
