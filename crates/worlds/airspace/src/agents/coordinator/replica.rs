//! One coordinator, as one host sees it: whether it is here, on its way from here, or missed.
//!
//! The protocol and the argument for it are at the head of the module above.

use super::epoch::{CoordinatorEpoch, CoordinatorVersion};
use super::messages::{CoordinatorReplicaMessage, VoteRequest, encode};
use super::{CoordinatorHostConfig, HostMoment, MigratingCoordinator};
use crate::agents::participant::InvalidMessage;
use sidestep_kernel::network::PacketBuffer;
use std::sync::Arc;

/// A message on its way out, to one other host or to all.
#[derive(Debug, Clone)]
pub(super) struct OutgoingHostMessage {
    pub to: Option<usize>,
    pub message: PacketBuffer,
}

/// The state with which a coordinator has left a host.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(super) struct CoordinatorStateCopy {
    pub at: CoordinatorVersion,
    pub state: Arc<[u8]>,
}

/// The role of a host for the coordinator at a time.
#[derive(Debug, Clone)]
pub(super) enum ReplicaRole<P> {
    /// It is elsewhere.
    Idle,
    /// It is here.
    Hosting(HostedCoordinator<P>),
    /// It has left with the state of the copy, and is not known to have arrived.
    Sending { to: usize, tries_left: u32, due: u64, heartbeat_at: u64 },
    /// It is missed, and this host wants to bring it back.
    Candidate(ElectionCandidate),
}

/// A coordinator on this host, with what is due if it stays here.
#[derive(Debug, Clone)]
pub(super) struct HostedCoordinator<P> {
    pub coordinator: P,
    /// Tick in which the others are informed that it is alive.
    pub heartbeat_at: u64,
    /// Tick in which it stops waiting here.
    pub timeout_at: u64,
}

/// A host that stands for election.
#[derive(Debug, Clone)]
pub(super) struct ElectionCandidate {
    pub request: VoteRequest,
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
pub(super) enum ElectionCause {
    /// It was not heard of for long.
    Unheard,
    /// A newer epoch was accepted elsewhere, while it was in this host's care.
    Outdated,
    /// It could not reach this host from here.
    OnHop(usize),
}

/// One coordinator, as one host sees it.
#[derive(Debug, Clone)]
pub(super) struct CoordinatorReplica<P> {
    /// Its number among the coordinators of the group.
    pub number: u16,
    pub rules: Arc<CoordinatorHostConfig>,
    /// Place among the hosts that miss it, which stand for election one after the other.
    rank: u64,
    /// The newest epoch that this host has accepted; it refuses older ones.
    pub promised: CoordinatorEpoch,
    /// The farthest that it knows the coordinator to have come.
    pub newest: CoordinatorVersion,
    /// The hop that brought the coordinator here last; earlier ones are copies on the network.
    pub accepted: CoordinatorVersion,
    /// The highest number of an epoch that it has wanted to begin.
    pub candidate_number: u32,
    /// Tick of the last sign of life.
    pub heard_at: u64,
    /// Tick before which it does not stand for election, because another one does.
    pub quiet_until: u64,
    pub copy: Option<CoordinatorStateCopy>,
    pub role: ReplicaRole<P>,
    /// The hosts that did not answer when no majority could be found, if that has happened.
    pub unanswering: Option<Vec<usize>>,
    pub out: Vec<OutgoingHostMessage>,
}

impl<P: MigratingCoordinator> CoordinatorReplica<P> {
    /// Returns the replica of the coordinator with this number, which starts on the first of `stops`.
    pub(super) fn new(number: usize, stops: &[usize], rules: &Arc<CoordinatorHostConfig>) -> Self {
        let first = CoordinatorEpoch::initial(stops[0]);
        let rank = stops.iter().position(|&stop| stop == rules.me).unwrap_or(stops.len());
        Self {
            number: number as u16,
            rules: rules.clone(),
            rank: rank as u64,
            promised: first,
            newest: first.first_version(),
            accepted: first.first_version(),
            candidate_number: 0,
            heard_at: 0,
            quiet_until: 0,
            copy: None,
            role: ReplicaRole::Idle,
            unanswering: None,
            out: Vec::new(),
        }
    }

    /// Starts: the coordinator is on the first host.
    pub(super) fn start(&mut self, moment: &HostMoment<'_, P::Services>) {
        let &HostMoment { services, tick } = moment;
        self.heard_at = tick;
        if usize::from(self.promised.owner) == self.rules.me {
            let coordinator = P::new(services, self.number.into());
            self.host_coordinator(coordinator, tick);
        }
    }

    /// Takes the coordinator out in order to run it, if it is here.
    pub(super) fn take_coordinator(&mut self) -> Option<HostedCoordinator<P>> {
        match std::mem::replace(&mut self.role, ReplicaRole::Idle) {
            ReplicaRole::Hosting(stay) => Some(stay),
            other => {
                self.role = other;
                None
            }
        }
    }

    pub(super) fn is_hosting(&self) -> bool {
        matches!(self.role, ReplicaRole::Hosting(_))
    }

    /// Returns whether the host has nothing to do with the coordinator.
    pub(super) fn is_idle(&self) -> bool {
        matches!(self.role, ReplicaRole::Idle)
    }

    /// Takes the coordinator in at a tick, from which its times on this host count.
    pub(super) fn host_coordinator(&mut self, coordinator: P, tick: u64) {
        let heartbeat_at = tick.saturating_add(self.rules.heartbeat_ticks());
        let timeout_at = tick.saturating_add(self.rules.wait_timeout_ticks());
        self.role =
            ReplicaRole::Hosting(HostedCoordinator { coordinator, heartbeat_at, timeout_at });
    }

    /// Puts the coordinator back after it was run.
    pub(super) fn put_back(&mut self, stay: HostedCoordinator<P>) {
        self.role = ReplicaRole::Hosting(stay);
    }

    /// Sends the coordinator to another host.
    pub(super) fn migrate_coordinator(&mut self, coordinator: &P, to: usize, tick: u64) {
        let at = self.accepted.after_hop();
        let state: Arc<[u8]> = coordinator.encode().into();
        self.record_alive(at, tick);
        self.send(to, &CoordinatorReplicaMessage::Hop(at), &state);
        // Where nothing is lost, it has left for good.
        let Some(policy) = self.rules.retry_policy else { return };
        let tries = if self.rules.expected[to] { policy.tries } else { policy.first_tries };
        let due = tick + policy.timeout_ticks(state.len());
        let heartbeat_at = tick + self.rules.heartbeat_ticks();
        self.copy = Some(CoordinatorStateCopy { at, state });
        self.role =
            ReplicaRole::Sending { to, tries_left: tries.saturating_sub(1), due, heartbeat_at };
    }

    /// Receives a checked message of another host.
    ///
    /// # Errors
    /// When the state that comes with it is not sound; nothing has changed then.
    pub(super) fn on_message(
        &mut self,
        from: usize,
        message: CoordinatorReplicaMessage,
        state: &[u8],
        moment: &HostMoment<'_, P::Services>,
    ) -> Result<(), InvalidMessage> {
        let tick = moment.tick;
        match message {
            CoordinatorReplicaMessage::Hop(at) => self.on_hop(from, at, state, moment)?,
            CoordinatorReplicaMessage::Vote(epoch, copy) => {
                let copy = copy.map(|at| CoordinatorStateCopy { at, state: state.into() });
                self.on_vote(from, epoch, copy, moment)?;
            }
            CoordinatorReplicaMessage::Ack(at) => self.on_ack(from, at, tick),
            CoordinatorReplicaMessage::Alive(at, ago) => self.on_alive(from, at, ago, tick),
            CoordinatorReplicaMessage::Stale(epoch) => self.on_newer_epoch(epoch, moment),
            CoordinatorReplicaMessage::Elect(candidacy) => {
                self.on_vote_request(from, candidacy, tick)
            }
        }
        if let ReplicaRole::Candidate(candidate) = &mut self.role {
            candidate.heard[from] = true;
        }
        Ok(())
    }

    fn on_hop(
        &mut self,
        from: usize,
        at: CoordinatorVersion,
        state: &[u8],
        moment: &HostMoment<'_, P::Services>,
    ) -> Result<(), InvalidMessage> {
        let &HostMoment { services, tick } = moment;
        if at.epoch < self.promised {
            self.send(from, &CoordinatorReplicaMessage::Stale(self.promised), &[]);
        } else if at <= self.accepted {
            // A copy on the network, or the acknowledgement was lost.
            self.acknowledge(from, at);
        } else {
            let coordinator = P::decode(state, services, self.number.into())?;
            self.record_alive(at, tick);
            self.accepted = at;
            self.acknowledge(from, at);
            self.host_coordinator(coordinator, tick);
        }
        Ok(())
    }

    fn acknowledge(&mut self, to: usize, at: CoordinatorVersion) {
        if self.rules.retry_policy.is_some() {
            self.send(to, &CoordinatorReplicaMessage::Ack(at), &[]);
        }
    }

    fn on_ack(&mut self, from: usize, at: CoordinatorVersion, tick: u64) {
        let is_awaited = matches!(self.role, ReplicaRole::Sending { to, .. } if to == from);
        if is_awaited && self.copy.as_ref().is_some_and(|copy| copy.at == at) {
            self.role = ReplicaRole::Idle;
            self.heard_at = tick;
        }
    }

    /// Receives the news that it was alive some ticks ago.
    fn on_alive(&mut self, from: usize, at: CoordinatorVersion, ago: u64, tick: u64) {
        if at.epoch < self.promised {
            return self.send(from, &CoordinatorReplicaMessage::Stale(self.promised), &[]);
        }
        let is_over = match &self.role {
            ReplicaRole::Idle => false,
            // One of a newer epoch is there instead.
            ReplicaRole::Hosting(_) => at.epoch > self.accepted.epoch,
            // It has arrived, if the host that it went to knows of it, or if it has come farther.
            ReplicaRole::Sending { to, .. } => self.has_migration_arrived(*to, from, at),
            ReplicaRole::Candidate(ElectionCandidate { request, lost, .. }) => match lost {
                Some(lost) => self.has_migration_arrived(*lost, from, at),
                // The hearsay of others is of use unless it is so old that the coordinator is
                // missed all the same.
                None => at >= request.seen && ago < self.rules.election_timeout_ticks,
            },
        };
        if is_over {
            self.role = ReplicaRole::Idle;
        }
        self.record_alive(at, tick.saturating_sub(ago));
    }

    fn has_migration_arrived(&self, to: usize, from: usize, at: CoordinatorVersion) -> bool {
        let left = self.copy.as_ref().map(|copy| copy.at);
        left.is_none_or(|left| at > left || (at == left && from == to))
    }

    /// Receives the news that a newer epoch was accepted by another host. A host that has the
    /// coordinator in its care wants to bring it back in a still newer one, unless one is alive in
    /// that one.
    fn on_newer_epoch(&mut self, epoch: CoordinatorEpoch, moment: &HostMoment<'_, P::Services>) {
        if epoch <= self.promised {
            return;
        }
        self.promised = epoch;
        match std::mem::replace(&mut self.role, ReplicaRole::Idle) {
            ReplicaRole::Idle => {}
            ReplicaRole::Sending { .. } => self.start_election(ElectionCause::Outdated, moment),
            ReplicaRole::Hosting(HostedCoordinator { coordinator, .. }) => {
                self.copy = Some(CoordinatorStateCopy {
                    at: self.accepted,
                    state: coordinator.encode().into(),
                });
                self.start_election(ElectionCause::Outdated, moment);
            }
            ReplicaRole::Candidate(candidate) if candidate.request.epoch > epoch => {
                self.role = ReplicaRole::Candidate(candidate);
            }
            ReplicaRole::Candidate(_) => self.defer_election(moment.tick),
        }
    }

    /// Records that the coordinator was alive at a tick, and has come as far as this.
    pub(super) fn record_alive(&mut self, at: CoordinatorVersion, heard_at: u64) {
        self.promised = self.promised.max(at.epoch);
        self.newest = self.newest.max(at);
        self.heard_at = self.heard_at.max(heard_at);
    }

    /// Performs all actions that are due; `watches` says whether the host needs the coordinator.
    pub(super) fn on_timer(&mut self, watches: bool, moment: &HostMoment<'_, P::Services>) {
        let tick = moment.tick;
        if self.next_timer(watches).is_none_or(|due| due > tick) {
            return;
        }
        match &mut self.role {
            ReplicaRole::Idle => self.start_election(ElectionCause::Unheard, moment),
            ReplicaRole::Candidate(_) => self.retry_vote_requests(tick),
            ReplicaRole::Hosting(stay) if stay.heartbeat_at <= tick => {
                stay.heartbeat_at = tick + self.rules.heartbeat_ticks();
                self.broadcast(&CoordinatorReplicaMessage::Alive(self.accepted, 0));
            }
            // The coordinator checks the time when it is run.
            ReplicaRole::Hosting(_) => {}
            ReplicaRole::Sending { .. } => self.retry_hop(moment),
        }
    }

    fn retry_hop(&mut self, moment: &HostMoment<'_, P::Services>) {
        let &HostMoment { services, tick } = moment;
        let (ReplicaRole::Sending { to, tries_left, due, heartbeat_at }, Some(copy), Some(policy)) =
            (&mut self.role, self.copy.clone(), self.rules.retry_policy)
        else {
            return;
        };
        let to = *to;
        if *heartbeat_at <= tick {
            *heartbeat_at = tick + self.rules.heartbeat_ticks();
            let message = encode(self.number, &CoordinatorReplicaMessage::Alive(copy.at, 0), &[]);
            self.out.push(OutgoingHostMessage { to: None, message });
        }
        if *due > tick {
            return;
        }
        *due = tick + policy.timeout_ticks(copy.state.len());
        if let Some(left) = tries_left.checked_sub(1) {
            *tries_left = left;
            return self.send(to, &CoordinatorReplicaMessage::Hop(copy.at), &copy.state);
        }
        let coordinator = P::decode(&copy.state, services, self.number.into());
        if coordinator.is_ok_and(|coordinator| coordinator.is_done_without(to)) {
            self.role = ReplicaRole::Idle;
        } else {
            // It may have arrived all the same, so it continues in a new epoch or not at all.
            self.start_election(ElectionCause::OnHop(to), moment);
        }
    }

    /// Returns the tick in which something is due.
    pub(super) fn next_timer(&self, watches: bool) -> Option<u64> {
        let policy = self.rules.retry_policy?;
        match &self.role {
            ReplicaRole::Idle if watches && self.unanswering.is_none() => {
                let missed_at = self.election_due_tick().max(self.quiet_until);
                Some(missed_at.saturating_add(self.rank * policy.ticks))
            }
            ReplicaRole::Idle => None,
            ReplicaRole::Hosting(stay) => Some(stay.heartbeat_at.min(stay.timeout_at)),
            ReplicaRole::Sending { due, heartbeat_at, .. } => Some(*due.min(heartbeat_at)),
            ReplicaRole::Candidate(candidate) => Some(candidate.due),
        }
    }

    /// Returns the tick in which it is missed, if there is no further sign of life.
    pub(super) fn election_due_tick(&self) -> u64 {
        self.heard_at.saturating_add(self.rules.election_timeout_ticks)
    }

    /// Gives another host that stands for election time for some questions and answers.
    pub(super) fn defer_election(&mut self, tick: u64) {
        let answer_ticks = self.round_trip_ticks();
        // Three times, because a question or its answer may get lost and be repeated.
        self.quiet_until = tick.saturating_add(answer_ticks.saturating_mul(3));
    }

    pub(super) fn send(&mut self, to: usize, message: &CoordinatorReplicaMessage, state: &[u8]) {
        let message = encode(self.number, message, state);
        self.out.push(OutgoingHostMessage { to: Some(to), message });
    }

    pub(super) fn broadcast(&mut self, message: &CoordinatorReplicaMessage) {
        self.out.push(OutgoingHostMessage { to: None, message: encode(self.number, message, &[]) });
    }
}
