//! A host: the airplane's part in all coordinators of its group.

use super::epoch::Epoch;
use super::messages::{self, MessageReader};
use super::replica::{CoordinatorReplica, HostedCoordinator, QueuedMessage};
use super::{CoordinatorStep, HostConfig, HostContext, HostServices, MigratingCoordinator};
use crate::agents::participant::InvalidMessage;
use std::sync::Arc;

/// The program aboard one airplane that takes coordinators in, runs them, and sends them on: a state
/// machine without a clock or a network of its own. Others are known by their place in the group.
#[derive(Debug, Clone)]
pub(super) struct CoordinatorHost<P: MigratingCoordinator> {
    pub ship: P::Services,
    pub seats: Vec<CoordinatorReplica<P>>,
    pub rules: Arc<HostConfig>,
}

impl<P: MigratingCoordinator> CoordinatorHost<P> {
    /// Returns a host of coordinators, each of which visits the hosts at some places and begins on
    /// the first of them.
    pub(super) fn new(ship: P::Services, stops: &[Vec<usize>], rules: HostConfig) -> Self {
        let rules = Arc::new(rules);
        let seat =
            |(number, stops): (usize, &Vec<usize>)| CoordinatorReplica::new(number, stops, &rules);
        Self { ship, seats: stops.iter().enumerate().map(seat).collect(), rules: rules.clone() }
    }

    /// Starts: the coordinators are on their first hosts.
    pub(super) fn start(&mut self, tick: u64) {
        for seat in &mut self.seats {
            seat.start(&self.ship, tick);
        }
        self.run_all(tick);
    }

    /// Takes a message of another host.
    ///
    /// # Errors
    /// When it is not sound; nothing has changed then.
    pub(super) fn on_message(
        &mut self,
        from: usize,
        bytes: &[u8],
        tick: u64,
    ) -> Result<(), InvalidMessage> {
        let HostConfig { me, group, .. } = *self.rules;
        let reader = MessageReader { me, group, seats: self.seats.len() };
        let (seat, message, state) = messages::decode(bytes, from, reader)?;
        let seat = &mut self.seats[usize::from(seat)];
        seat.on_message(from, message, state, &self.ship, tick)?;
        self.run_all(tick);
        Ok(())
    }

    /// Performs all actions that are due.
    pub(super) fn on_timer(&mut self, tick: u64) {
        for seat in &mut self.seats {
            let watches = self.ship.is_watching(seat.number.into());
            seat.on_timer(watches, &self.ship, tick);
        }
        self.run_all(tick);
    }

    /// Returns the tick in which something is due, whether the host itself is done or not: others
    /// may depend on it.
    pub(super) fn next_timer(&self) -> Option<u64> {
        let due = |seat: &CoordinatorReplica<P>| {
            seat.next_timer(self.ship.is_watching(seat.number.into()))
        };
        self.seats.iter().filter_map(due).min()
    }

    /// Runs the coordinators that are here until each has left, is over, or waits.
    fn run_all(&mut self, tick: u64) {
        for seat in &self.seats {
            if let Some(unanswering) = &seat.unanswering {
                self.ship.on_no_majority(seat.number.into(), unanswering);
            }
        }
        let mut has_changed = true;
        while std::mem::take(&mut has_changed) {
            for k in 0..self.seats.len() {
                has_changed |= self.run(k, tick);
            }
        }
    }

    /// Runs a coordinator if it is here. Returns whether anything has changed for the others here.
    fn run(&mut self, k: usize, tick: u64) -> bool {
        let epochs: Vec<Epoch> = self.seats.iter().map(|seat| seat.promised).collect();
        let aboard: Vec<bool> = self.seats.iter().map(CoordinatorReplica::is_hosting).collect();
        let seat = &mut self.seats[k];
        let Some(HostedCoordinator {
            coordinator: mut passenger,
            heartbeat_at: beat_at,
            timeout_at: impatient_at,
        }) = seat.take_coordinator()
        else {
            return false;
        };
        let is_impatient = impatient_at <= tick;
        let here =
            HostContext { epochs: &epochs, is_here: &aboard, has_timed_out: is_impatient, tick };
        match passenger.advance(&mut self.ship, &here) {
            CoordinatorStep::Hop(to) => seat.migrate(&passenger, to, tick),
            CoordinatorStep::Done => {}
            CoordinatorStep::Stay if is_impatient => seat.host(passenger, tick),
            CoordinatorStep::Stay => {
                seat.put_back(HostedCoordinator {
                    coordinator: passenger,
                    heartbeat_at: beat_at,
                    timeout_at: impatient_at,
                });
                return self.ship.has_news();
            }
        }
        true
    }

    /// Returns whether no coordinator is in the care of the host, and none is missed by it.
    pub(super) fn is_idle(&self) -> bool {
        self.seats.iter().all(CoordinatorReplica::is_idle)
    }

    /// Returns the messages on their way out.
    pub(super) fn take_messages(&mut self) -> Vec<QueuedMessage> {
        self.seats.iter_mut().flat_map(|seat| std::mem::take(&mut seat.out)).collect()
    }
}
