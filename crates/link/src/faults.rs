//! The faults of a scenario's network, for the packets of one agent.

use crate::agent::{ChannelModel, PacketInTransit, PacketTiming};
use sidestep::kernel::network::FaultInjector;
use sidestep::kernel::ports::Envelope;
use sidestep::kernel::{Cycle, EntityId};

/// Returns the first ticks of a cycle's conversations, each with its time in seconds after the start of the run.
type ConversationStartsFn = Box<dyn Fn(Cycle) -> Vec<(u64, f64)> + Send>;

/// The faults of the scenario's network, for the packets of one agent.
pub(crate) struct FaultyChannel {
    injector: FaultInjector,
    sender: EntityId,
    conversation_starts: ConversationStartsFn,
}

impl FaultyChannel {
    /// Returns the faults of a network whose conversations start at the given times of each cycle.
    pub(crate) fn new(
        injector: FaultInjector,
        sender: EntityId,
        conversation_starts: impl Fn(Cycle) -> Vec<(u64, f64)> + Send + 'static,
    ) -> Self {
        Self { injector, sender, conversation_starts: Box::new(conversation_starts) }
    }
}

impl ChannelModel for FaultyChannel {
    fn arrivals(&mut self, packet: &PacketInTransit) -> Vec<PacketTiming> {
        let &PacketInTransit { to, tick, sequence, bytes } = packet;
        let envelope = Envelope {
            // A transport of the kernel counts ticks where an envelope has its cycle.
            cycle: tick,
            sender: self.sender,
            sequence,
            receiver: to,
            // Faults depend on the size, never on the content.
            payload: vec![0; bytes],
        };
        let arrivals = self.injector.arrivals(envelope).into_iter();
        arrivals.map(|(departs, arrives)| PacketTiming { departs, arrives }).collect()
    }

    fn tick_s(&self) -> f64 {
        self.injector.tick_s()
    }

    fn start_cycle(&mut self, cycle: Cycle) {
        self.injector.start_cycle((self.conversation_starts)(cycle));
    }
}
