//! One coordinator, as one host sees it: whether it is here, on its way from here, or missed.
//!
//! The protocol and the argument for it are at the head of the module above.

use super::epoch::{Epoch, Position};
use super::messages::{Candidacy, Message, written};
use super::{Passenger, Rules};
use crate::agents::party::Unsound;
use sidestep_kernel::network::Draft;
use std::sync::Arc;

/// A message on its way out, to one other host or to all.
#[derive(Debug, Clone)]
pub(super) struct Sent {
    pub to: Option<usize>,
    pub message: Draft,
}

/// The state with which a coordinator has left a host.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(super) struct Copy {
    pub at: Position,
    pub state: Arc<[u8]>,
}

/// The part that a host has in the coordinator at a time.
#[derive(Debug, Clone)]
pub(super) enum Post<P> {
    /// It is elsewhere.
    Empty,
    /// It is here.
    Aboard(Stay<P>),
    /// It has set out from here with the state of the copy, and is not known to have arrived.
    Leaving { to: usize, tries_left: u32, due: u64, beat_at: u64 },
    /// It is missed, and this host wants to bring it back.
    Standing(Standing),
}

/// A coordinator that stays on a host.
#[derive(Debug, Clone)]
pub(super) struct Stay<P> {
    pub passenger: P,
    /// Tick in which the others are told that it is alive.
    pub beat_at: u64,
    /// Tick in which it stops waiting here and goes on.
    pub impatient_at: u64,
}

/// A host that stands for election.
#[derive(Debug, Clone)]
pub(super) struct Standing {
    pub asks: Candidacy,
    /// The host that the coordinator could not reach from here.
    pub lost: Option<usize>,
    pub votes: Vec<bool>,
    /// Hosts that have answered anything.
    pub heard: Vec<bool>,
    pub tries_left: u32,
    pub due: u64,
}

/// The reason for which a host misses a coordinator.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Missed {
    /// It was not heard of for long.
    Unheard,
    /// A newer epoch was accepted elsewhere, while it was in this host's care.
    Outdated,
    /// It could not reach this host from here.
    OnHop(usize),
}

/// One coordinator, as one host sees it.
#[derive(Debug, Clone)]
pub(super) struct Seat<P> {
    /// Its number among the coordinators of the group.
    pub number: u16,
    pub rules: Arc<Rules>,
    /// Place among the hosts that miss it, which stand for election one after the other.
    rank: u64,
    /// The newest epoch that this host has accepted; it refuses older ones.
    pub promised: Epoch,
    /// The farthest that it knows the coordinator to have come.
    pub seen: Position,
    /// The hop that brought the coordinator here last; earlier ones are copies on the network.
    pub taken: Position,
    /// The highest number of an epoch that it has wanted to begin.
    pub stood: u32,
    /// Tick of the last sign of life.
    pub heard_at: u64,
    /// Tick before which it does not stand for election, because another one does.
    pub quiet_until: u64,
    pub copy: Option<Copy>,
    pub post: Post<P>,
    /// The hosts that did not answer when no majority could be found, if that has happened.
    pub unanswering: Option<Vec<usize>>,
    pub out: Vec<Sent>,
}

impl<P: Passenger> Seat<P> {
    /// Returns the seat of the coordinator with this number, which begins on the first of `stops`.
    pub(super) fn new(number: usize, stops: &[usize], rules: &Arc<Rules>) -> Self {
        let first = Epoch::first(stops[0]);
        let rank = stops.iter().position(|&stop| stop == rules.me).unwrap_or(stops.len());
        Self {
            number: number as u16,
            rules: rules.clone(),
            rank: rank as u64,
            promised: first,
            seen: first.start(),
            taken: first.start(),
            stood: 0,
            heard_at: 0,
            quiet_until: 0,
            copy: None,
            post: Post::Empty,
            unanswering: None,
            out: Vec::new(),
        }
    }

    /// Starts: the coordinator is on the first host.
    pub(super) fn begin(&mut self, ship: &P::Ship, tick: u64) {
        self.heard_at = tick;
        if usize::from(self.promised.owner) == self.rules.me {
            let passenger = P::new(ship, self.number.into());
            self.board(passenger, tick);
        }
    }

    /// Takes the coordinator out in order to run it, if it is here.
    pub(super) fn take_aboard(&mut self) -> Option<Stay<P>> {
        match std::mem::replace(&mut self.post, Post::Empty) {
            Post::Aboard(stay) => Some(stay),
            other => {
                self.post = other;
                None
            }
        }
    }

    /// Returns whether the coordinator is here.
    pub(super) fn is_aboard(&self) -> bool {
        matches!(self.post, Post::Aboard(_))
    }

    /// Returns whether the host has nothing to do with the coordinator.
    pub(super) fn is_empty(&self) -> bool {
        matches!(self.post, Post::Empty)
    }

    /// Takes the coordinator in, or back in.
    pub(super) fn board(&mut self, passenger: P, tick: u64) {
        let beat_at = tick.saturating_add(self.rules.beat_ticks());
        let impatient_at = tick.saturating_add(self.rules.impatient_ticks());
        self.post = Post::Aboard(Stay { passenger, beat_at, impatient_at });
    }

    /// Puts the coordinator back after it was run.
    pub(super) fn stay(&mut self, stay: Stay<P>) {
        self.post = Post::Aboard(stay);
    }

    /// Lets the coordinator hop to another host.
    pub(super) fn depart(&mut self, passenger: &P, to: usize, tick: u64) {
        let at = self.taken.next();
        let state: Arc<[u8]> = passenger.written().into();
        self.note(at, tick);
        self.send(to, &Message::Hop(at), &state);
        // Where nothing is lost, it has left for good.
        let Some(patience) = self.rules.patience else { return };
        let tries = if self.rules.expected[to] { patience.tries } else { patience.first_tries };
        let (due, beat_at) =
            (tick + patience.ticks_for(state.len()), tick + self.rules.beat_ticks());
        self.copy = Some(Copy { at, state });
        self.post = Post::Leaving { to, tries_left: tries.saturating_sub(1), due, beat_at };
    }

    /// Takes a checked message of another host.
    ///
    /// # Errors
    /// When the state that comes with it is not sound; nothing has changed then.
    pub(super) fn on_message(
        &mut self,
        from: usize,
        message: Message,
        state: &[u8],
        ship: &P::Ship,
        tick: u64,
    ) -> Result<(), Unsound> {
        match message {
            Message::Hop(at) => self.on_hop(from, at, state, ship, tick)?,
            Message::Vote(epoch, copy) => {
                let copy = copy.map(|at| Copy { at, state: state.into() });
                self.on_vote(from, epoch, copy, ship, tick)?;
            }
            Message::Ack(at) => self.on_ack(from, at, tick),
            Message::Alive(at, ago) => self.on_alive(from, at, ago, tick),
            Message::Stale(epoch) => self.on_stale(epoch, ship, tick),
            Message::Elect(candidacy) => self.on_elect(from, candidacy, tick),
        }
        if let Post::Standing(standing) = &mut self.post {
            standing.heard[from] = true;
        }
        Ok(())
    }

    fn on_hop(
        &mut self,
        from: usize,
        at: Position,
        state: &[u8],
        ship: &P::Ship,
        tick: u64,
    ) -> Result<(), Unsound> {
        if at.epoch < self.promised {
            self.send(from, &Message::Stale(self.promised), &[]);
        } else if at <= self.taken {
            // A copy on the network, or the acknowledgement was lost.
            self.acknowledge(from, at);
        } else {
            let passenger = P::read(state, ship, self.number.into())?;
            self.note(at, tick);
            self.taken = at;
            self.acknowledge(from, at);
            self.board(passenger, tick);
        }
        Ok(())
    }

    fn acknowledge(&mut self, to: usize, at: Position) {
        if self.rules.patience.is_some() {
            self.send(to, &Message::Ack(at), &[]);
        }
    }

    fn on_ack(&mut self, from: usize, at: Position, tick: u64) {
        let is_awaited = matches!(self.post, Post::Leaving { to, .. } if to == from);
        if is_awaited && self.copy.as_ref().is_some_and(|copy| copy.at == at) {
            self.post = Post::Empty;
            self.heard_at = tick;
        }
    }

    /// Takes the news that it was alive some ticks ago.
    fn on_alive(&mut self, from: usize, at: Position, ago: u64, tick: u64) {
        if at.epoch < self.promised {
            return self.send(from, &Message::Stale(self.promised), &[]);
        }
        let is_over = match &self.post {
            Post::Empty => false,
            // One of a newer epoch is there instead.
            Post::Aboard(_) => at.epoch > self.taken.epoch,
            // It has arrived, if the host that it went to knows of it, or if it has come farther.
            Post::Leaving { to, .. } => self.has_arrived(*to, from, at),
            Post::Standing(Standing { asks, lost, .. }) => match lost {
                Some(lost) => self.has_arrived(*lost, from, at),
                // The hearsay of others is of use unless it is so old that the coordinator is
                // missed all the same.
                None => at >= asks.seen && ago < self.rules.miss_ticks,
            },
        };
        if is_over {
            self.post = Post::Empty;
        }
        self.note(at, tick.saturating_sub(ago));
    }

    fn has_arrived(&self, to: usize, from: usize, at: Position) -> bool {
        let left = self.copy.as_ref().map(|copy| copy.at);
        left.is_none_or(|left| at > left || (at == left && from == to))
    }

    /// Takes the news that a newer epoch was accepted by another host. A host that has the
    /// coordinator in its care wants to bring it back in a still newer one, unless one is alive in
    /// that one.
    fn on_stale(&mut self, epoch: Epoch, ship: &P::Ship, tick: u64) {
        if epoch <= self.promised {
            return;
        }
        self.promised = epoch;
        match std::mem::replace(&mut self.post, Post::Empty) {
            Post::Empty => {}
            Post::Leaving { .. } => self.stand(Missed::Outdated, ship, tick),
            Post::Aboard(Stay { passenger, .. }) => {
                self.copy = Some(Copy { at: self.taken, state: passenger.written().into() });
                self.stand(Missed::Outdated, ship, tick);
            }
            Post::Standing(standing) if standing.asks.epoch > epoch => {
                self.post = Post::Standing(standing);
            }
            Post::Standing(_) => self.keep_quiet(tick),
        }
    }

    /// Notes that the coordinator was alive at a tick, and has come as far as this.
    pub(super) fn note(&mut self, at: Position, heard_at: u64) {
        self.promised = self.promised.max(at.epoch);
        self.seen = self.seen.max(at);
        self.heard_at = self.heard_at.max(heard_at);
    }

    /// Performs all actions that are due; `watches` says whether the host needs the coordinator.
    pub(super) fn on_timer(&mut self, watches: bool, ship: &P::Ship, tick: u64) {
        if self.next_timer(watches).is_none_or(|due| due > tick) {
            return;
        }
        match &mut self.post {
            Post::Empty => self.stand(Missed::Unheard, ship, tick),
            Post::Standing(_) => self.ask_again(tick),
            Post::Aboard(stay) if stay.beat_at <= tick => {
                stay.beat_at = tick + self.rules.beat_ticks();
                self.broadcast(&Message::Alive(self.taken, 0));
            }
            // The coordinator looks at the time when it is run.
            Post::Aboard(_) => {}
            Post::Leaving { .. } => self.hop_again(ship, tick),
        }
    }

    fn hop_again(&mut self, ship: &P::Ship, tick: u64) {
        let (Post::Leaving { to, tries_left, due, beat_at }, Some(copy), Some(patience)) =
            (&mut self.post, self.copy.clone(), self.rules.patience)
        else {
            return;
        };
        let to = *to;
        if *beat_at <= tick {
            *beat_at = tick + self.rules.beat_ticks();
            let message = written(self.number, &Message::Alive(copy.at, 0), &[]);
            self.out.push(Sent { to: None, message });
        }
        if *due > tick {
            return;
        }
        *due = tick + patience.ticks_for(copy.state.len());
        if let Some(left) = tries_left.checked_sub(1) {
            *tries_left = left;
            return self.send(to, &Message::Hop(copy.at), &copy.state);
        }
        let passenger = P::read(&copy.state, ship, self.number.into());
        if passenger.is_ok_and(|passenger| passenger.is_over_without(to)) {
            self.post = Post::Empty;
        } else {
            // It may have arrived all the same, so it goes on in a new epoch or not at all.
            self.stand(Missed::OnHop(to), ship, tick);
        }
    }

    /// Returns the tick in which something is due.
    pub(super) fn next_timer(&self, watches: bool) -> Option<u64> {
        let patience = self.rules.patience?;
        match &self.post {
            Post::Empty if watches && self.unanswering.is_none() => {
                let missed_at = self.missed_at().max(self.quiet_until);
                Some(missed_at.saturating_add(self.rank * patience.ticks))
            }
            Post::Empty => None,
            Post::Aboard(stay) => Some(stay.beat_at.min(stay.impatient_at)),
            Post::Leaving { due, beat_at, .. } => Some(*due.min(beat_at)),
            Post::Standing(standing) => Some(standing.due),
        }
    }

    /// Returns the tick in which it is missed, if there is no further sign of life.
    pub(super) fn missed_at(&self) -> u64 {
        self.heard_at.saturating_add(self.rules.miss_ticks)
    }

    /// Gives another host that stands for election time for some questions and answers.
    pub(super) fn keep_quiet(&mut self, tick: u64) {
        let answer_ticks = self.answer_ticks();
        self.quiet_until = tick.saturating_add(answer_ticks.saturating_mul(3));
    }

    pub(super) fn send(&mut self, to: usize, message: &Message, state: &[u8]) {
        let message = written(self.number, message, state);
        self.out.push(Sent { to: Some(to), message });
    }

    pub(super) fn broadcast(&mut self, message: &Message) {
        self.out.push(Sent { to: None, message: written(self.number, message, &[]) });
    }
}
