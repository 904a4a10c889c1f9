//! The agents of a chain on a network in memory, which can lose, delay, double and reorder packets,
//! cut links, and silence a connector.
//!
//! Its faults are those of any network ([`sidestep_kernel::network`]).

use crate::agents::{ConnectorAgent, ConnectorControl, ConnectorPercept};
use crate::world::{ChainWorld, purpose};
use sidestep_kernel::network::{
    AgentLoop, DistanceLookup, FaultInjector, FaultStreams, FaultyTransport, Network, ReplyBatching,
};
use sidestep_kernel::stream::Streams;
use sidestep_kernel::{Cycle, EntityId};
use sidestep_rods::geometry::distance;

/// The network of a chain for the talk of a cycle.
#[derive(Debug, Clone, Copy)]
pub(super) struct NegotiationContext<'a> {
    /// Faults of the network; with `None` it loses nothing, and agents wait as long as it takes.
    pub(super) network: Option<&'a Network>,
    pub(super) streams: Streams,
    pub(super) first_id: EntityId,
    /// Its first tick, and the time of that in seconds after the start of the run.
    pub(super) begins: (u64, f64),
}

impl<'a> NegotiationContext<'a> {
    /// Returns the talk of a chain in a cycle.
    pub(super) fn new<const D: usize>(
        world: &'a ChainWorld<D>,
        chain: EntityId,
        now: Cycle,
    ) -> Self {
        Self {
            network: world.network.as_ref(),
            streams: world.streams,
            first_id: world.first_connector_id(chain),
            begins: world.negotiation_start(now),
        }
    }
}

impl<const D: usize> ChainWorld<D> {
    /// Returns the first tick of a cycle's talk, and its time in seconds after the start of the run.
    pub fn negotiation_start(&self, now: Cycle) -> (u64, f64) {
        (first_tick(self.network.as_ref(), now), self.cycle_start_time_s(now))
    }

    /// Returns the faults of one connector's packets where each has a process of its own; none where the
    /// network is reliable.
    pub fn fault_injector(&self) -> Option<FaultInjector> {
        Some(FaultInjector::new(self.network.clone()?, fault_streams(self.streams)))
    }
}

/// Returns the tick in which the talk of a cycle starts.
pub(super) fn first_tick(network: Option<&Network>, now: Cycle) -> u64 {
    // One tick more than a talk lasts, so that no packet of a cycle arrives in the next one.
    network.map_or(0, |network| now * (network.conversation_ticks() + 1))
}

fn fault_streams(streams: Streams) -> FaultStreams {
    FaultStreams {
        streams,
        network: purpose::NETWORK,
        burst: purpose::BURST,
        burst_loss: purpose::BURST_LOSS,
    }
}

/// Places of a chain's connectors at the start of a cycle, by connector, and the id of the first one.
struct StartPositions<'a, const D: usize>(EntityId, &'a [ConnectorPercept<D>]);

impl<const D: usize> DistanceLookup for StartPositions<'_, D> {
    fn distance_m(&self, link: [EntityId; 2]) -> f64 {
        let [a, b] = link.map(|id| self.1[(id - self.0) as usize].at.0);
        distance(a, b)
    }
}

/// Lets the agents of a chain talk until all are done; `sights[k]` is that of `agents[k]`. Returns their
/// decisions in the same order.
///
/// # Panics
/// When a sight makes no sense.
pub(super) fn run_agents<const D: usize>(
    talk: NegotiationContext<'_>,
    agents: &mut [ConnectorAgent<D>],
    sights: Vec<ConnectorPercept<D>>,
) -> Vec<Option<ConnectorControl<D>>> {
    let places = StartPositions(talk.first_id, &sights);
    let begins = [talk.begins];
    let draws = fault_streams(talk.streams);
    let transport = FaultyTransport::in_memory(talk.network, draws, Some(&places), &begins);
    let (start_tick, _) = talk.begins;
    for (agent, sight) in agents.iter_mut().zip(&sights) {
        agent.start(sight.clone(), start_tick).expect("a world shows its connectors what is there");
    }
    let mut network = AgentLoop {
        transport,
        replies: match talk.network {
            Some(_) => ReplyBatching::PerTick,
            // Where no time is counted, a process answers each packet when it comes.
            None => ReplyBatching::PerPacket,
        },
        max_flight_ticks: Some(talk.network.map_or(1, max_packet_delay_ticks)),
    };
    network.run(agents, start_tick, ConnectorAgent::is_done);
    agents.iter().map(ConnectorAgent::control).collect()
}

/// Returns the most ticks that a packet takes; no bound where large ones take their time on a link.
fn max_packet_delay_ticks(network: &Network) -> u64 {
    let is_narrow = network.bandwidth_bit_s < f64::INFINITY;
    if is_narrow { u64::MAX } else { 1 + u64::from(network.faults().max_delay_cycles) }
}
