//! Elections: how a missing coordinator is brought back.

use super::epoch::{CoordinatorEpoch, is_majority};
use super::messages::{CoordinatorReplicaMessage, VoteRequest};
use super::replica::{
    CoordinatorReplica, CoordinatorStateCopy, ElectionCandidate, ElectionCause, ReplicaRole,
};
use super::{HostMoment, MigratingCoordinator};
use crate::agents::participant::InvalidMessage;

impl<P: MigratingCoordinator> CoordinatorReplica<P> {
    /// Stands for election, since the coordinator is missed.
    pub(super) fn start_election(
        &mut self,
        missed: ElectionCause,
        moment: &HostMoment<'_, P::Services>,
    ) {
        // On a network that loses nothing, no coordinator gets lost.
        let Some(policy) = self.rules.retry_policy else { return };
        self.candidate_number = 1 + self.promised.number.max(self.candidate_number);
        let epoch = CoordinatorEpoch { number: self.candidate_number, owner: self.rules.me as u16 };
        let has = self.copy.as_ref().map(|copy| copy.at);
        let was_lost = missed != ElectionCause::Unheard;
        let request = VoteRequest { epoch, seen: self.newest, has, was_lost };
        let mut votes = vec![false; self.rules.group];
        votes[self.rules.me] = true;
        let heard = votes.clone();
        let due = moment.tick + self.round_trip_ticks();
        let tries_left = policy.tries.saturating_sub(1);
        // A host that is alone in its group elects itself.
        let is_elected = is_majority(&votes);
        let lost = match missed {
            ElectionCause::OnHop(to) => Some(to),
            ElectionCause::Unheard | ElectionCause::Outdated => None,
        };
        self.role = ReplicaRole::Candidate(ElectionCandidate {
            request,
            lost,
            votes,
            heard,
            tries_left,
            due,
        });
        if is_elected {
            return self.restore_coordinator(moment);
        }
        self.broadcast(&CoordinatorReplicaMessage::Elect(request));
    }

    /// Returns the number of ticks that a question and its answer take, with a copy if need be.
    pub(super) fn round_trip_ticks(&self) -> u64 {
        let bytes = self.copy.as_ref().map_or(0, |copy| copy.state.len());
        self.rules.retry_policy.map_or(u64::MAX, |policy| policy.timeout_ticks(bytes))
    }

    /// Takes part in an election.
    ///
    /// A host that has the coordinator in its care, or has heard of it lately, says so. After a
    /// loss on a hop only news from beyond that hop counts as having heard of it.
    pub(super) fn on_vote_request(&mut self, from: usize, request: VoteRequest, tick: u64) {
        let candidate = match &self.role {
            ReplicaRole::Candidate(candidate) => Some(candidate.request.epoch),
            _ => None,
        };
        let newest = candidate.map_or(self.promised, |own| own.max(self.promised));
        if request.epoch < newest {
            return self.send(from, &CoordinatorReplicaMessage::Stale(newest), &[]);
        }
        let is_news = !request.was_lost || self.newest > request.seen;
        let has_voted = request.epoch == self.promised;
        let is_alive = match self.role {
            ReplicaRole::Hosting(_) | ReplicaRole::Sending { .. } => true,
            ReplicaRole::Candidate(_) => false,
            ReplicaRole::Idle => !has_voted && is_news && tick < self.election_due_tick(),
        };
        if is_alive {
            let ago = if self.is_idle() { tick.saturating_sub(self.heard_at) } else { 0 };
            return self.send(from, &CoordinatorReplicaMessage::Alive(self.newest, ago), &[]);
        }
        // This is no sign of life: the epoch may never begin.
        self.promised = request.epoch;
        self.role = ReplicaRole::Idle;
        self.defer_election(tick);
        let newer = self.copy.clone().filter(|copy| request.has.is_none_or(|has| copy.at > has));
        match newer {
            Some(CoordinatorStateCopy { at, state }) => {
                self.send(from, &CoordinatorReplicaMessage::Vote(request.epoch, Some(at)), &state);
            }
            None => self.send(from, &CoordinatorReplicaMessage::Vote(request.epoch, None), &[]),
        }
    }

    /// Receives a vote, and the copy that came with it if that is the newest one.
    ///
    /// # Errors
    /// When that copy is not sound.
    pub(super) fn on_vote(
        &mut self,
        from: usize,
        epoch: CoordinatorEpoch,
        copy: Option<CoordinatorStateCopy>,
        moment: &HostMoment<'_, P::Services>,
    ) -> Result<(), InvalidMessage> {
        let ReplicaRole::Candidate(candidate) = &mut self.role else { return Ok(()) };
        if candidate.request.epoch != epoch {
            return Ok(());
        }
        if let Some(copy) = copy
            && self.copy.as_ref().is_none_or(|own| copy.at > own.at)
        {
            P::decode(&copy.state, moment.services, self.number.into())?;
            self.copy = Some(copy);
            // The hop on which it was lost is not known then.
            candidate.lost = None;
        }
        candidate.votes[from] = true;
        if is_majority(&candidate.votes) {
            self.restore_coordinator(moment);
        }
        Ok(())
    }

    /// Brings the coordinator back from the newest copy that a majority has, or else from nothing.
    pub(super) fn restore_coordinator(&mut self, moment: &HostMoment<'_, P::Services>) {
        let &HostMoment { services, tick } = moment;
        let ReplicaRole::Candidate(ElectionCandidate { request, lost, .. }) = &self.role else {
            return;
        };
        let at = request.epoch.first_version();
        let lost = *lost;
        let number = self.number.into();
        let copied =
            self.copy.as_ref().and_then(|copy| P::decode(&copy.state, services, number).ok());
        let mut coordinator = copied.unwrap_or_else(|| P::new(services, number));
        if let Some(lost) = lost {
            coordinator.on_unreachable(lost);
        }
        self.record_alive(at, tick);
        self.accepted = at;
        self.host_coordinator(coordinator, tick);
        self.broadcast(&CoordinatorReplicaMessage::Alive(at, 0));
    }

    /// Again asks the hosts that have not voted, unless they have been asked often enough.
    pub(super) fn retry_vote_requests(&mut self, tick: u64) {
        let due = tick + self.round_trip_ticks();
        let ReplicaRole::Candidate(candidate) = &mut self.role else { return };
        let Some(left) = candidate.tries_left.checked_sub(1) else {
            // Where a majority is in touch, a lack of contact is not why it was not elected.
            if is_majority(&candidate.heard) {
                self.quiet_until = tick.saturating_add(self.rules.election_timeout_ticks);
            } else {
                let heard = candidate.heard.iter().enumerate();
                self.unanswering = Some(heard.filter(|(_, is)| !**is).map(|(k, _)| k).collect());
            }
            self.role = ReplicaRole::Idle;
            return;
        };
        candidate.tries_left = left;
        candidate.due = due;
        let request = candidate.request;
        let silent: Vec<usize> =
            (0..candidate.votes.len()).filter(|&k| !candidate.votes[k]).collect();
        for place in silent {
            self.send(place, &CoordinatorReplicaMessage::Elect(request), &[]);
        }
    }
}
