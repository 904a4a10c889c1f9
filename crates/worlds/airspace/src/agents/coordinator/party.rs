//! A host as a party to the talk of its group.

use super::Rules;
use super::aboard::{Aboard, parts};
use super::host::Hosting;
use super::seat::Sent;
use super::state::{Coordinator, block};
use crate::agents::link::{Ended, Radio};
use crate::agents::party::{Concludes, Outgoing, Party, Progress, Unsound};
use crate::agents::{Briefing, Conclusion, OwnShip};
use sidestep_kernel::EntityId;
use sidestep_kernel::network::HEADER_BYTES;
use std::sync::Arc;

/// The program aboard one airplane that takes coordinators in, runs them, and sends them on.
#[derive(Debug)]
pub struct Host {
    hosting: Hosting<Coordinator>,
    group: Arc<[EntityId]>,
    /// Number of ticks after which the talk ends.
    ticks: u64,
    is_silent: bool,
}

impl Host {
    /// Returns the host aboard an airplane. There is one coordinator for the group, or in a hierarchy one for each
    /// part of it and one above these.
    pub fn new(own: OwnShip, is_hierarchy: bool, radio: Radio) -> Self {
        let Radio { group, me, patience, ticks, is_silent } = radio;
        // No host waits forever, except where no message is lost.
        let patience = (patience.ticks < u64::MAX).then_some(patience);
        let at: Vec<_> = own.briefing.poses.iter().map(|pose| pose.at).collect();
        let parts = if is_hierarchy { parts(&at) } else { vec![(0..group.len()).collect()] };
        let bytes = state_bytes(&own.briefing);
        let miss_ticks = patience.map_or(u64::MAX, |patience| {
            // The ticks of a tour, and those within which every host in touch answers; at most a quarter of the talk,
            // so that enough is left to bring it back.
            let hops = group.len() as u64 + u64::from(patience.tries);
            hops.saturating_mul(patience.ticks_for(bytes)).min(ticks / 4).max(1)
        });
        let expected = (0..group.len()).map(|place| own.expects(place)).collect();
        let rules = Rules { group: group.len(), me, patience, expected, miss_ticks };
        let mut stops = parts.clone();
        if parts.len() > 1 {
            stops.push((0..group.len()).collect());
        }
        let hosting = Hosting::new(Aboard::new(own, parts), &stops, rules);
        Self { hosting, group, ticks, is_silent }
    }
}

/// Returns the number of bytes that the state of a coordinator of the whole group has at most.
fn state_bytes(briefing: &Briefing) -> usize {
    let (actions, block) = (briefing.most_actions(), block(briefing).unwrap_or(0));
    // A player, a decision, and the numbers beside the ways.
    let numbers = 10 * (6 * actions + 2 * block.max(actions)) + 10 * block + 256;
    briefing.ids.len() * (briefing.most_bytes(block.max(actions)) + numbers) + 512
}

impl Party for Host {
    fn progress(&self) -> Progress {
        let epochs = self.hosting.seats.iter().map(|seat| seat.promised.number);
        Progress { epoch: epochs.max().unwrap_or(0), ..Progress::default() }
    }

    fn start(&mut self, tick: u64) {
        if self.is_silent {
            let me = self.hosting.rules.me;
            let others = (0..self.group.len()).filter(|&place| place != me).collect();
            return self.hosting.ship.conclude_alone(others);
        }
        // A quarter of the time is left to bring the controls.
        self.hosting.ship.enough_at = tick.saturating_add(self.ticks / 4 * 3);
        self.hosting.start(tick);
    }

    fn on_message(&mut self, from: EntityId, message: &[u8], tick: u64) -> Result<(), Unsound> {
        let place = self.group.binary_search(&from).map_err(|_| Unsound::Airplane)?;
        if self.is_silent {
            return Ok(());
        }
        self.hosting.on_message(place, message, tick)
    }

    fn on_timer(&mut self, tick: u64) {
        if !self.is_silent {
            self.hosting.on_timer(tick);
        }
    }

    fn next_timer(&self) -> Option<u64> {
        self.hosting.next_timer().filter(|_| !self.is_silent)
    }

    /// Returns whether the airplane has its control, and no other one depends on it for now.
    fn is_done(&self) -> bool {
        self.hosting.ship.told.is_some() && self.hosting.is_idle()
    }

    fn take_messages(&mut self) -> Vec<Outgoing> {
        let sent = self.hosting.take_sent().into_iter();
        let to = |place: usize| self.group[place];
        sent.map(|Sent { to: place, message }| Outgoing { to: place.map(to), message }).collect()
    }

    fn most_bytes(&self) -> usize {
        HEADER_BYTES + state_bytes(&self.hosting.ship.own.briefing)
    }
}

impl Concludes for Host {
    type Outcome = Conclusion;

    fn end(&mut self) -> Ended<Conclusion> {
        let late = || Ended { outcome: None, unheard: Vec::new(), late: true };
        self.hosting.ship.told.clone().unwrap_or_else(late)
    }
}
