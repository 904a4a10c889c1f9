//! Elections: how a missing coordinator is brought back.

use super::Passenger;
use super::epoch::{Epoch, Position, is_majority};
use super::messages::{Candidacy, Message};
use super::seat::{Copy, Missed, Post, Seat, Standing};
use crate::agents::party::Unsound;

impl<P: Passenger> Seat<P> {
    /// Stands for election, since the coordinator is missed.
    pub(super) fn stand(&mut self, missed: Missed, ship: &P::Ship, tick: u64) {
        let Some(patience) = self.rules.patience else { return };
        self.stood = 1 + self.promised.number.max(self.stood);
        let epoch = Epoch { number: self.stood, owner: self.rules.me as u16 };
        let has = self.copy.as_ref().map(|copy| copy.at);
        let was_lost = missed != Missed::Unheard;
        let asks = Candidacy { epoch, seen: self.seen, has, was_lost };
        let mut votes = vec![false; self.rules.group];
        votes[self.rules.me] = true;
        let heard = votes.clone();
        let due = tick + self.answer_ticks();
        let (tries_left, is_elected) = (patience.tries.saturating_sub(1), is_majority(&votes));
        let lost = match missed {
            Missed::OnHop(to) => Some(to),
            Missed::Unheard | Missed::Outdated => None,
        };
        self.post = Post::Standing(Standing { asks, lost, votes, heard, tries_left, due });
        if is_elected {
            return self.bring_back(ship, tick);
        }
        self.broadcast(&Message::Elect(asks));
    }

    /// Returns the number of ticks that a question and its answer take, with a copy if need be.
    pub(super) fn answer_ticks(&self) -> u64 {
        let bytes = self.copy.as_ref().map_or(0, |copy| copy.state.len());
        self.rules.patience.map_or(u64::MAX, |patience| patience.ticks_for(bytes))
    }

    /// Takes part in an election.
    ///
    /// A host that has the coordinator in its care, or has heard of it lately, says so. After a
    /// loss on a hop only news from beyond that hop counts as having heard of it.
    pub(super) fn on_elect(&mut self, from: usize, asks: Candidacy, tick: u64) {
        let standing = match &self.post {
            Post::Standing(standing) => Some(standing.asks.epoch),
            _ => None,
        };
        let newest = standing.map_or(self.promised, |own| own.max(self.promised));
        if asks.epoch < newest {
            return self.send(from, &Message::Stale(newest), &[]);
        }
        let is_news = !asks.was_lost || self.seen > asks.seen;
        let has_voted = asks.epoch == self.promised;
        let is_alive = match self.post {
            Post::Aboard(_) | Post::Leaving { .. } => true,
            Post::Standing(_) => false,
            Post::Empty => !has_voted && is_news && tick < self.missed_at(),
        };
        if is_alive {
            let ago = if self.is_empty() { tick.saturating_sub(self.heard_at) } else { 0 };
            return self.send(from, &Message::Alive(self.seen, ago), &[]);
        }
        // This is no sign of life: the epoch may never begin.
        self.promised = asks.epoch;
        self.post = Post::Empty;
        self.keep_quiet(tick);
        let newer = self.copy.clone().filter(|copy| asks.has.is_none_or(|has| copy.at > has));
        match newer {
            Some(Copy { at, state }) => {
                self.send(from, &Message::Vote(asks.epoch, Some(at)), &state);
            }
            None => self.send(from, &Message::Vote(asks.epoch, None), &[]),
        }
    }

    /// Takes a vote, and the copy that came with it if that is the newest one.
    ///
    /// # Errors
    /// When that copy is not sound.
    pub(super) fn on_vote(
        &mut self,
        from: usize,
        epoch: Epoch,
        copy: Option<Copy>,
        ship: &P::Ship,
        tick: u64,
    ) -> Result<(), Unsound> {
        let Post::Standing(standing) = &mut self.post else { return Ok(()) };
        if standing.asks.epoch != epoch {
            return Ok(());
        }
        let is_newer = |copy: &Copy| self.copy.as_ref().is_none_or(|own| copy.at > own.at);
        if let Some(copy) = copy.filter(is_newer) {
            P::read(&copy.state, ship, self.number.into())?;
            self.copy = Some(copy);
            // The hop on which it was lost is not known then.
            standing.lost = None;
        }
        standing.votes[from] = true;
        if is_majority(&standing.votes) {
            self.bring_back(ship, tick);
        }
        Ok(())
    }

    /// Brings the coordinator back from the newest copy that a majority has, or else from nothing.
    pub(super) fn bring_back(&mut self, ship: &P::Ship, tick: u64) {
        let Post::Standing(Standing { asks, lost, .. }) = &self.post else { return };
        let (at, lost): (Position, _) = (asks.epoch.start(), *lost);
        let number = self.number.into();
        let copied = self.copy.as_ref().and_then(|copy| P::read(&copy.state, ship, number).ok());
        let mut passenger = copied.unwrap_or_else(|| P::new(ship, number));
        if let Some(lost) = lost {
            passenger.cannot_reach(lost);
        }
        self.note(at, tick);
        self.taken = at;
        self.board(passenger, tick);
        self.broadcast(&Message::Alive(at, 0));
    }

    /// Again asks the hosts that have not voted, unless they have been asked often enough.
    pub(super) fn ask_again(&mut self, tick: u64) {
        let due = tick + self.answer_ticks();
        let Post::Standing(standing) = &mut self.post else { return };
        let Some(left) = standing.tries_left.checked_sub(1) else {
            // Where a majority is in touch, a lack of contact is not why it was not elected.
            if is_majority(&standing.heard) {
                self.quiet_until = tick.saturating_add(self.rules.miss_ticks);
            } else {
                let heard = standing.heard.iter().enumerate();
                self.unanswering = Some(heard.filter(|(_, is)| !**is).map(|(k, _)| k).collect());
            }
            self.post = Post::Empty;
            return;
        };
        (standing.tries_left, standing.due) = (left, due);
        let asks = standing.asks;
        let silent: Vec<usize> =
            (0..standing.votes.len()).filter(|&k| !standing.votes[k]).collect();
        for place in silent {
            self.send(place, &Message::Elect(asks), &[]);
        }
    }
}
