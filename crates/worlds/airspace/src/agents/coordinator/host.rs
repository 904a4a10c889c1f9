//! A host: the airplane's part in all coordinators of its group.

use super::epoch::Epoch;
use super::messages::{self, Reader};
use super::seat::{Seat, Sent, Stay};
use super::{Here, Passenger, Rules, Ship, Step};
use crate::agents::party::Unsound;
use std::sync::Arc;

/// The program aboard one airplane that takes coordinators in, runs them, and sends them on: a state
/// machine without a clock or a network of its own. Others are known by their place in the group.
#[derive(Debug, Clone)]
pub(super) struct Hosting<P: Passenger> {
    pub ship: P::Ship,
    pub seats: Vec<Seat<P>>,
    pub rules: Arc<Rules>,
}

impl<P: Passenger> Hosting<P> {
    /// Returns a host of coordinators, each of which visits the hosts at some places and begins on
    /// the first of them.
    pub(super) fn new(ship: P::Ship, stops: &[Vec<usize>], rules: Rules) -> Self {
        let rules = Arc::new(rules);
        let seat = |(number, stops): (usize, &Vec<usize>)| Seat::new(number, stops, &rules);
        Self { ship, seats: stops.iter().enumerate().map(seat).collect(), rules: rules.clone() }
    }

    /// Starts: the coordinators are on their first hosts.
    pub(super) fn start(&mut self, tick: u64) {
        for seat in &mut self.seats {
            seat.begin(&self.ship, tick);
        }
        self.settle(tick);
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
    ) -> Result<(), Unsound> {
        let Rules { me, group, .. } = *self.rules;
        let reader = Reader { me, group, seats: self.seats.len() };
        let (seat, message, state) = messages::read(bytes, from, reader)?;
        let seat = &mut self.seats[usize::from(seat)];
        seat.on_message(from, message, state, &self.ship, tick)?;
        self.settle(tick);
        Ok(())
    }

    /// Performs all actions that are due.
    pub(super) fn on_timer(&mut self, tick: u64) {
        for seat in &mut self.seats {
            let watches = self.ship.watches(seat.number.into());
            seat.on_timer(watches, &self.ship, tick);
        }
        self.settle(tick);
    }

    /// Returns the tick in which something is due, whether the host itself is done or not: others
    /// may depend on it.
    pub(super) fn next_timer(&self) -> Option<u64> {
        let due = |seat: &Seat<P>| seat.next_timer(self.ship.watches(seat.number.into()));
        self.seats.iter().filter_map(due).min()
    }

    /// Runs the coordinators that are here until each has left, is over, or waits.
    fn settle(&mut self, tick: u64) {
        for seat in &self.seats {
            if let Some(unanswering) = &seat.unanswering {
                self.ship.cut_off(seat.number.into(), unanswering);
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
        let aboard: Vec<bool> = self.seats.iter().map(Seat::is_aboard).collect();
        let seat = &mut self.seats[k];
        let Some(Stay { mut passenger, beat_at, impatient_at }) = seat.take_aboard() else {
            return false;
        };
        let is_impatient = impatient_at <= tick;
        let here = Here { epochs: &epochs, aboard: &aboard, is_impatient, tick };
        match passenger.go_on(&mut self.ship, &here) {
            Step::Hop(to) => seat.depart(&passenger, to, tick),
            Step::Over => {}
            Step::Stay if is_impatient => seat.board(passenger, tick),
            Step::Stay => {
                seat.stay(Stay { passenger, beat_at, impatient_at });
                return self.ship.has_news();
            }
        }
        true
    }

    /// Returns whether no coordinator is in the care of the host, and none is missed by it.
    pub(super) fn is_idle(&self) -> bool {
        self.seats.iter().all(Seat::is_empty)
    }

    /// Returns the messages on their way out.
    pub(super) fn take_sent(&mut self) -> Vec<Sent> {
        self.seats.iter_mut().flat_map(|seat| std::mem::take(&mut seat.out)).collect()
    }
}
