//! A host on the network: its packets, numbered and counted.

use super::Rules;
use super::aboard::Aboard;
use super::host::Hosting;
use super::seat::Sent;
use super::state::{Coordinator, block};
use crate::agents::link::Ended;
use crate::agents::network::{Patience, Traffic};
use crate::agents::{Conclusion, OwnShip};
use crate::flight::Point;
use sidestep_kernel::EntityId;
use sidestep_kernel::ports::{Envelope, Transport};
use std::sync::Arc;

/// The time of a talk, and the rule for repeating what is not acknowledged.
#[derive(Debug, Clone, Copy)]
pub struct Journey {
    /// The tick in which it begins.
    pub begin: u64,
    /// Number of ticks after which it ends.
    pub ticks: u64,
    /// `None` on a network that loses nothing.
    pub patience: Option<Patience>,
    /// Whether the radio of the host is dead: it sends nothing, hears nothing, and knows it.
    pub is_silent: bool,
}

/// The program aboard one airplane that takes coordinators in, runs them, and sends them on.
#[derive(Debug)]
pub struct Host {
    hosting: Hosting<Coordinator>,
    ids: Arc<[EntityId]>,
    is_silent: bool,
    /// Number of packets sent so far, which distinguishes those of one tick.
    sent: u32,
    traffic: Traffic,
}

impl Host {
    /// Returns the host aboard an airplane of a group, each of whose parts has a coordinator.
    pub fn new(own: OwnShip, parts: Arc<[Vec<usize>]>, journey: &Journey) -> Self {
        let ids = own.briefing.ids.clone();
        let rules = Rules {
            group: ids.len(),
            me: own.me,
            patience: journey.patience,
            expected: (0..ids.len()).map(|place| own.expects(place)).collect(),
            miss_ticks: miss_ticks(&own, journey),
        };
        let mut stops = parts.to_vec();
        if parts.len() > 1 {
            stops.push((0..ids.len()).collect());
        }
        // A quarter of the time is left to bring the controls.
        let enough_at = journey.begin.saturating_add(journey.ticks / 4 * 3);
        let hosting = Hosting::new(Aboard::new(own, parts, enough_at), &stops, rules);
        let is_silent = journey.is_silent;
        Self { hosting, ids, is_silent, sent: 0, traffic: Traffic::default() }
    }

    /// Begins: coordinators are on their first hosts.
    pub fn start(&mut self, transport: &mut dyn Transport, tick: u64) {
        if self.is_silent {
            let me = self.hosting.rules.me;
            let others = (0..self.ids.len()).filter(|&place| place != me).collect();
            self.hosting.ship.conclude_alone(others);
            return;
        }
        self.hosting.start(tick);
        self.send(transport, tick);
    }

    /// Takes the packets that have arrived by a tick, and does whatever is due.
    pub fn step(&mut self, transport: &mut dyn Transport, tick: u64) {
        let arrived = transport.receive(self.ids[self.hosting.rules.me], tick);
        if self.is_silent {
            return;
        }
        for envelope in arrived {
            // Senders outside the group are ignored.
            if let Ok(from) = self.ids.binary_search(&envelope.sender) {
                self.hosting.on_packet(from, &envelope.payload, tick);
            }
        }
        self.hosting.on_timer(tick);
        self.send(transport, tick);
    }

    /// Hands packets to the network, and counts them.
    fn send(&mut self, transport: &mut dyn Transport, tick: u64) {
        let me = self.hosting.rules.me;
        for Sent { to, payload } in self.hosting.take_sent() {
            let receivers: Vec<usize> = match to {
                Some(place) => vec![place],
                None => (0..self.ids.len()).filter(|&place| place != me).collect(),
            };
            self.traffic.count(receivers.len(), payload.len());
            for place in receivers {
                transport.send(Envelope {
                    cycle: tick,
                    sender: self.ids[me],
                    sequence: self.sent,
                    receiver: self.ids[place],
                    payload: payload.clone(),
                });
            }
            self.sent += 1;
        }
    }

    /// Returns the tick in which something is due.
    pub fn next_timer(&self) -> Option<u64> {
        self.hosting.next_timer().filter(|_| !self.is_silent)
    }

    /// Returns whether the talk has ended for the airplane; others may still need the host.
    pub fn is_done(&self) -> bool {
        self.hosting.ship.told.is_some()
    }

    /// Returns the count of its messages so far.
    pub fn traffic(&self) -> Traffic {
        self.traffic
    }

    /// Returns the end of the talk; where none has come, time is up.
    pub fn end(self) -> Ended<Conclusion> {
        let late = || Ended { outcome: None, unheard: Vec::new(), late: true };
        self.hosting.ship.told.unwrap_or_else(late)
    }
}

/// Returns the number of ticks without a sign of life after which a coordinator is missed: those of
/// a tour, and those in which nobody who is in touch stays silent; at most a quarter of the talk, so
/// that enough is left to bring it back.
fn miss_ticks(own: &OwnShip, journey: &Journey) -> u64 {
    let Some(patience) = journey.patience else { return u64::MAX };
    let group = own.briefing.ids.len();
    let ways = block(&own.briefing).unwrap_or(own.options.predictions.len());
    let bytes = group * ways * own.briefing.air.timing.horizon * size_of::<Point>();
    let hops = group as u64 + u64::from(patience.tries);
    hops.saturating_mul(patience.ticks_for(bytes)).min(journey.ticks / 4).max(1)
}
