//! Programs of agents on a network, and the loop that runs several of them in one process.
//!
//! Time passes in ticks. An agent acts when a packet comes or its timer is due; the ticks between are skipped.

use crate::interrupt;
use crate::ports::{Envelope, Transport};
use crate::units::EntityId;
use std::sync::Arc;

/// A packet that an agent has written and its loop is to send.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct OutgoingPacket {
    /// Ids of the receivers, shared by all packets to the same agents.
    pub to: Arc<[EntityId]>,
    /// Number among the sender's packets of the conversation.
    pub sequence: u32,
    /// All of its bytes, header included.
    pub payload: Vec<u8>,
}

/// The program of an agent, as a state machine without a clock or a socket: packets and ticks in, packets out.
pub trait NetworkAgent {
    /// Its id on the network, which never changes.
    fn id(&self) -> EntityId;

    /// Receives a packet that came off the network from an agent: any bytes. Unreadable and impossible packets are
    /// counted and dropped.
    fn on_packet(&mut self, from: EntityId, bytes: &[u8], tick: u64);

    /// Performs the actions that are due by a tick.
    fn on_timer(&mut self, tick: u64);

    /// Returns the tick in which something is due, unless a packet comes before it.
    fn next_timer(&self) -> Option<u64>;

    /// Takes out the packets that wait to be sent.
    fn take_packets(&mut self) -> Vec<OutgoingPacket>;
}

/// When an agent sends its answers to the packets that it receives in one tick.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ReplyBatching {
    /// After each packet.
    PerPacket,
    /// After all of them, so that one packet may answer several.
    PerTick,
}

/// Agents of one process, which exchange their packets over a transport.
#[derive(Debug)]
pub struct AgentLoop<T> {
    /// The network between them.
    pub transport: T,
    /// When the agents send their answers, on which the number of packets depends.
    pub replies: ReplyBatching,
    /// A bound on the ticks that a packet is on its way. With it, agents to which nothing can be on its way are not
    /// asked for packets: of a long chain nearly all connectors wait. Without it, each is asked in each tick.
    pub max_flight_ticks: Option<u64>,
}

impl<T: Transport> AgentLoop<T> {
    /// Runs agents that have started in `start_tick`, by rising id, until all are done or nothing more can happen.
    pub fn run<A: NetworkAgent>(
        &mut self,
        agents: &mut [A],
        start_tick: u64,
        is_done: impl Fn(&A) -> bool,
    ) {
        let mut arrivals = LatestPossibleArrivals::new(agents, self.max_flight_ticks);
        for agent in agents.iter_mut() {
            self.send(agent, start_tick, &mut arrivals);
        }
        // An agent's timer changes only when the agent does something. Asking all of them anew in each tick took a
        // tenth of the time of a chain, of which nearly all connectors wait.
        let mut timers: Vec<Option<u64>> = agents.iter().map(NetworkAgent::next_timer).collect();
        let mut tick = start_tick;
        while !agents.iter().all(&is_done) {
            interrupt::check();
            let next_timer = timers.iter().flatten().min().copied();
            let next = next_timer.into_iter().chain(self.transport.next_arrival()).min();
            // The last tick stands for a time that never comes.
            let Some(next) = next.filter(|next| *next < u64::MAX) else { return };
            // A timer may be set to a tick that has passed; it is due at once.
            tick = tick.max(next);
            for (place, agent) in agents.iter_mut().enumerate() {
                if arrivals.can_arrive(place, tick) {
                    self.receive(agent, tick, &mut arrivals);
                } else if timers[place].is_none_or(|due| due > tick) {
                    continue;
                }
                agent.on_timer(tick);
                self.send(agent, tick, &mut arrivals);
                timers[place] = agent.next_timer();
            }
        }
    }

    /// Hands an agent the packets that have reached it by a tick.
    fn receive(
        &mut self,
        agent: &mut impl NetworkAgent,
        tick: u64,
        arrivals: &mut LatestPossibleArrivals,
    ) {
        for Envelope { sender, payload, .. } in self.transport.receive(agent.id(), tick) {
            agent.on_packet(sender, &payload, tick);
            if self.replies == ReplyBatching::PerPacket {
                self.send(agent, tick, arrivals);
            }
        }
    }

    /// Sends the packets of an agent that wait to be sent.
    fn send(
        &mut self,
        agent: &mut impl NetworkAgent,
        tick: u64,
        arrivals: &mut LatestPossibleArrivals,
    ) {
        let sender = agent.id();
        for OutgoingPacket { to, sequence, payload } in agent.take_packets() {
            let Some((last, others)) = to.split_last() else { continue };
            let envelope = |receiver: EntityId, payload: Vec<u8>| Envelope {
                cycle: tick,
                sender,
                sequence,
                receiver,
                payload,
            };
            for &receiver in others {
                arrivals.record(receiver, tick);
                self.transport.send(envelope(receiver, payload.clone()));
            }
            arrivals.record(*last, tick);
            self.transport.send(envelope(*last, payload));
        }
    }
}

/// The last tick in which something may arrive at each agent.
struct LatestPossibleArrivals {
    max_flight_ticks: Option<u64>,
    /// Ids of the agents, rising, so that bisection finds a receiver.
    ids: Vec<EntityId>,
    /// By place in `ids`; 0 before anything was sent to the agent.
    last_ticks: Vec<u64>,
}

impl LatestPossibleArrivals {
    fn new<A: NetworkAgent>(agents: &[A], max_flight_ticks: Option<u64>) -> Self {
        Self {
            max_flight_ticks,
            ids: agents.iter().map(NetworkAgent::id).collect(),
            last_ticks: vec![0; agents.len()],
        }
    }

    fn record(&mut self, receiver: EntityId, tick: u64) {
        let Some(max_flight_ticks) = self.max_flight_ticks else { return };
        if let Ok(place) = self.ids.binary_search(&receiver) {
            self.last_ticks[place] = tick.saturating_add(max_flight_ticks);
        }
    }

    fn can_arrive(&self, place: usize, tick: u64) -> bool {
        self.max_flight_ticks.is_none() || self.last_ticks[place] >= tick
    }
}
