//! Coordinators and hosts, as they see each other.

use super::epoch::CoordinatorEpoch;
use crate::agents::participant::InvalidMessage;
use sidestep_kernel::network::RetryPolicy;

/// The next step of a coordinator that was run on a host.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum CoordinatorItineraryStep {
    /// It hops to the host at this place.
    Hop(usize),
    /// It waits here for another one.
    Stay,
    /// It has completed all its tasks.
    Done,
}

/// The circumstances in which a coordinator is run on a host.
#[derive(Debug, Clone, Copy)]
pub(super) struct CoordinatorHostContext<'a> {
    /// The newest epoch of each coordinator of the group that the host has accepted.
    pub epochs: &'a [CoordinatorEpoch],
    /// Whether each coordinator is on the host.
    pub is_here: &'a [bool],
    /// Whether it has waited here for [`CoordinatorHostConfig::wait_timeout_ticks`].
    pub has_timed_out: bool,
    /// The tick on the host's own clock.
    pub tick: u64,
}

/// A coordinator, all of whose state migrates from host to host.
pub(super) trait MigratingCoordinator: Sized {
    type Services: CoordinatorHostServices;

    /// Returns the coordinator with this number before it has visited any host.
    fn new(services: &Self::Services, number: usize) -> Self;

    /// Returns its state in the form in which it travels.
    fn encode(&self) -> Vec<u8>;

    /// Returns a state that has come to a host.
    ///
    /// # Errors
    /// When any part of it is not sound.
    fn decode(
        bytes: &[u8],
        services: &Self::Services,
        number: usize,
    ) -> Result<Self, InvalidMessage>;

    /// Continues until it has to hop, to wait, or is done.
    fn advance(
        &mut self,
        services: &mut Self::Services,
        context: &CoordinatorHostContext<'_>,
    ) -> CoordinatorItineraryStep;

    /// Records that a host cannot be reached.
    fn on_unreachable(&mut self, place: usize);

    /// Returns whether it would be done if a host, to which it is on its way, cannot be reached.
    fn is_done_without(&self, place: usize) -> bool;
}

/// What a host exposes to the coordinators that it hosts.
pub(super) trait CoordinatorHostServices {
    /// Returns whether the host misses a coordinator that is not heard of.
    fn is_awaiting_coordinator(&self, number: usize) -> bool;

    /// Returns whether a coordinator has left news for another one on the host since the last call.
    fn has_news(&mut self) -> bool {
        false
    }

    /// Called when no majority can be found to bring a coordinator back, with the hosts that
    /// have not answered.
    fn on_no_majority(&mut self, number: usize, unanswering: &[usize]);
}

/// A host at a moment: its services, and its tick.
pub(super) struct HostMoment<'a, S> {
    pub services: &'a S,
    pub tick: u64,
}

/// The rules by which a host waits for others.
#[derive(Debug, Clone)]
pub(super) struct CoordinatorHostConfig {
    /// Size of the group.
    pub group: usize,
    /// Place of the host in the group.
    pub me: usize,
    /// Repetition of unacknowledged messages; `None` on a network that loses nothing.
    pub retry_policy: Option<RetryPolicy>,
    /// Whether an answer of each other host can be expected.
    pub expected: Vec<bool>,
    /// Number of ticks without a sign of life after which a coordinator is missed.
    pub election_timeout_ticks: u64,
}

impl CoordinatorHostConfig {
    /// Returns the ticks after which a host that has a coordinator in its care says so: a few messages
    /// may be lost before it is missed.
    pub(super) fn heartbeat_ticks(&self) -> u64 {
        (self.election_timeout_ticks / 4).max(1)
    }

    /// Returns the ticks after which a coordinator continues without another one that it waits for:
    /// enough to bring that one back.
    pub(super) fn wait_timeout_ticks(&self) -> u64 {
        match self.retry_policy {
            Some(_) => self.election_timeout_ticks.saturating_mul(2),
            None => u64::MAX,
        }
    }
}
