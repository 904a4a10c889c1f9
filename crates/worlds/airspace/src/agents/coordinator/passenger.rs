//! Coordinators and hosts, as they see each other.

use super::epoch::Epoch;
use crate::agents::party::Unsound;
use sidestep_kernel::network::Patience;

/// The next step of a coordinator that was run on a host.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Step {
    /// It hops to the host at this place.
    Hop(usize),
    /// It waits here for another one.
    Stay,
    /// It has completed all its tasks.
    Over,
}

/// The circumstances in which a coordinator is run on a host.
#[derive(Debug, Clone, Copy)]
pub(super) struct Here<'a> {
    /// The newest epoch of each coordinator of the group that the host has accepted.
    pub epochs: &'a [Epoch],
    /// Whether each coordinator is on the host.
    pub aboard: &'a [bool],
    /// Whether it has waited here for long.
    pub is_impatient: bool,
    /// The host's tick.
    pub tick: u64,
}

/// A coordinator: the state that migrates.
pub(super) trait Passenger: Sized {
    /// The part of a host that a coordinator can see while it is there.
    type Ship: Ship;

    /// Returns the coordinator number `seat` before it has visited any host.
    fn new(ship: &Self::Ship, seat: usize) -> Self;

    /// Returns its state in the form in which it travels.
    fn written(&self) -> Vec<u8>;

    /// Returns a state that has come to a host.
    ///
    /// # Errors
    /// When any part of it is not sound.
    fn read(bytes: &[u8], ship: &Self::Ship, seat: usize) -> Result<Self, Unsound>;

    /// Goes on until it has to hop, to wait, or is done.
    fn go_on(&mut self, ship: &mut Self::Ship, here: &Here<'_>) -> Step;

    /// Notes that a host cannot be reached.
    fn cannot_reach(&mut self, place: usize);

    /// Returns whether it would be done if a host, to which it is on its way, cannot be reached.
    fn is_over_without(&self, place: usize) -> bool;
}

/// The part of a host that coordinators can see while they are there.
pub(super) trait Ship {
    /// Returns whether the host misses a coordinator that is not heard of.
    fn watches(&self, seat: usize) -> bool;

    /// Returns whether a coordinator has left news for another one on the host since the last call.
    fn has_news(&mut self) -> bool {
        false
    }

    /// Takes the news that no majority can be found to bring a coordinator back, and which hosts
    /// have answered nothing.
    fn cut_off(&mut self, seat: usize, unanswering: &[usize]);
}

/// The rules by which a host waits for others.
#[derive(Debug, Clone)]
pub(super) struct Rules {
    /// Size of the group.
    pub group: usize,
    /// Place of the host in the group.
    pub me: usize,
    /// Repetition of unacknowledged messages; `None` on a network that loses nothing.
    pub patience: Option<Patience>,
    /// Whether an answer of each other host can be expected.
    pub expected: Vec<bool>,
    /// Number of ticks without a sign of life after which a coordinator is missed.
    pub miss_ticks: u64,
}

impl Rules {
    /// Returns the ticks after which a host that has a coordinator in its care says so: a few of
    /// them may be lost before it is missed.
    pub(super) fn beat_ticks(&self) -> u64 {
        (self.miss_ticks / 4).max(1)
    }

    /// Returns the ticks after which a coordinator goes on without another one that it waits for:
    /// enough to bring that one back.
    pub(super) fn impatient_ticks(&self) -> u64 {
        match self.patience {
            Some(_) => self.miss_ticks.saturating_mul(2),
            None => u64::MAX,
        }
    }
}
