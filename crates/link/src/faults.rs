//! The faults of a scenario's network, for the packets of one agent.

use crate::agent::{Arrival, Channel, Transmission};
use sidestep::kernel::network::FaultInjector;
use sidestep::kernel::ports::Envelope;
use sidestep::kernel::{Cycle, EntityId};

/// First ticks of a cycle's talks, each with its time in seconds after the start of the run.
type ConversationStarts = Box<dyn Fn(Cycle) -> Vec<(u64, f64)> + Send>;

/// The faults of the scenario's network, for the packets of one agent.
pub(crate) struct FaultyChannel {
    ether: FaultInjector,
    sender: EntityId,
    talks: ConversationStarts,
}

impl FaultyChannel {
    /// Returns the faults of a network, with the given talks in each cycle.
    pub(crate) fn new(
        ether: FaultInjector,
        sender: EntityId,
        talks: impl Fn(Cycle) -> Vec<(u64, f64)> + Send + 'static,
    ) -> Self {
        Self { ether, sender, talks: Box::new(talks) }
    }
}

impl Channel for FaultyChannel {
    fn arrivals(&mut self, sent: &Transmission) -> Vec<Arrival> {
        let &Transmission { to, tick, sequence, bytes } = sent;
        let payload = vec![0; bytes];
        let sender = self.sender;
        let packet = Envelope { cycle: tick, sender, sequence, receiver: to, payload };
        let arrivals = self.ether.arrivals(packet).into_iter();
        arrivals.map(|(leaves, arrives)| Arrival { leaves, arrives }).collect()
    }

    fn tick_s(&self) -> f64 {
        self.ether.tick_s()
    }

    fn start_cycle(&mut self, cycle: Cycle) {
        self.ether.start_cycle((self.talks)(cycle));
    }
}
