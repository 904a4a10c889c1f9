//! Migration: how coordinators hop from airplane to airplane.

use crate::agents::OwnShip;
use crate::agents::link::bytes_of;
use crate::agents::network::{Patience, Traffic};
use crate::objective::Objective;
use serde::Serialize;
use serde::de::DeserializeOwned;
use sidestep_collectives::Settings;
use sidestep_kernel::ports::{Envelope, Transport};

/// Message which says that a coordinator has arrived.
const ACKNOWLEDGED: [u8; 1] = [1];

/// The time in which coordinators may travel, and the rule for repeating a hop.
#[derive(Debug, Clone, Copy)]
pub struct Journey {
    /// The tick in which the first one sets out.
    pub begin: u64,
    /// The tick in which time is up.
    pub end: u64,
    /// Repetition of hops that are not acknowledged; `None` on a network that loses nothing.
    pub patience: Option<Patience>,
}

/// Coordinators of a group, on the airplanes that they visit.
pub struct Migration<'a> {
    transport: &'a mut dyn Transport,
    /// Data aboard each airplane.
    pub(super) hosts: &'a [OwnShip],
    /// Whether each airplane's radio is dead.
    pub(super) silent: &'a [bool],
    journey: Journey,
    /// Number of ticks gone by.
    pub(super) gone: u64,
    /// Number of messages so far, which distinguishes them.
    sent: u32,
    pub(super) traffic: Traffic,
}

impl<'a> Migration<'a> {
    /// Returns coordinators that have not set out yet. `silent` says for each airplane whether its
    /// radio is dead.
    pub fn new(
        transport: &'a mut dyn Transport,
        hosts: &'a [OwnShip],
        silent: &'a [bool],
        journey: Journey,
    ) -> Self {
        Self { transport, hosts, silent, journey, gone: 0, sent: 0, traffic: Traffic::default() }
    }

    pub(super) fn settings(&self) -> Settings {
        *self.hosts[0].settings()
    }

    pub(super) fn objective(&self) -> &'a Objective {
        &self.hosts[0].briefing.objective
    }

    /// Returns whether time is up.
    pub(super) fn is_late(&self) -> bool {
        self.gone >= self.journey.end - self.journey.begin
    }

    fn id(&self, place: usize) -> u32 {
        self.hosts[place].known.slot
    }

    /// Sends a message `after` ticks of the journey.
    fn send(&mut self, [from, to]: [usize; 2], payload: Vec<u8>, after: u64) {
        self.traffic.count(1, payload.len());
        self.transport.send(Envelope {
            cycle: self.journey.begin + after,
            sender: self.id(from),
            sequence: self.sent,
            receiver: self.id(to),
            payload,
        });
        self.sent += 1;
    }

    /// Waits for a message numbered `first` or later, sent before `after` ticks had gone by.
    /// Returns the message that arrives by tick `until` of the journey, and the tick.
    fn await_from(
        &mut self,
        [from, to]: [usize; 2],
        first: u32,
        (after, until): (u64, u64),
    ) -> Option<(Vec<u8>, u64)> {
        let (sender, receiver) = (self.id(from), self.id(to));
        for tick in after + 1..=until {
            let arrived = self.transport.receive(receiver, self.journey.begin + tick);
            // Copies of earlier hops no longer matter, and a dead radio hears nothing.
            let awaited = |e: &Envelope| e.sender == sender && e.sequence >= first;
            if let Some(envelope) = arrived.into_iter().find(awaited).filter(|_| !self.silent[to]) {
                return Some((envelope.payload, tick));
            }
        }
        None
    }

    /// Takes a coordinator's state from one airplane to another. Returns whether it has arrived.
    pub(super) fn hop<S: Serialize + DeserializeOwned>(
        &mut self,
        state: &mut S,
        way: [usize; 2],
    ) -> bool {
        let bytes = bytes_of(state);
        let first = self.sent;
        let is_expected = self.hosts[way[0]].expects(way[1]);
        let tries = |patience: Patience| match is_expected {
            true => patience.tries,
            false => patience.first_tries,
        };
        let tries = self.journey.patience.map_or(1, tries);
        let wait = self.journey.patience.map_or(1, |patience| patience.ticks_for(bytes.len()));
        let mut arrived = None;
        for _ in 0..tries {
            if self.is_late() {
                break;
            }
            let set_out = self.gone;
            self.send(way, bytes.clone(), set_out);
            if let Some((payload, tick)) = self.await_from(way, first, (set_out, set_out + wait)) {
                arrived = Some(payload);
                if self.is_acknowledged(way, (tick, set_out + wait)) {
                    self.gone = tick;
                    break;
                }
            }
            self.gone = set_out + wait;
        }
        // The state is read back on the other side.
        match arrived.as_deref().map(postcard::from_bytes) {
            Some(Ok(read)) => *state = read,
            _ => return false,
        }
        true
    }

    /// Acknowledges to the sender of a coordinator that it has arrived at tick `tick` of the
    /// journey. Returns whether the sender knows that by tick `until`.
    fn is_acknowledged(&mut self, [from, to]: [usize; 2], (tick, until): (u64, u64)) -> bool {
        if self.journey.patience.is_none() {
            return true;
        }
        let first = self.sent;
        self.send([to, from], ACKNOWLEDGED.to_vec(), tick);
        self.await_from([to, from], first, (tick, until)).is_some()
    }
}
