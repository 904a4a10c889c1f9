//! What happened, and when.

use super::rods::veto::Reason;
use serde::{Deserialize, Serialize};
use sidestep_kernel::{Cycle, EntityId};

/// Kinds of events.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum EventKind {
    /// A connector has spoken against what the driver wanted; the value is the way that the
    /// initiator could have gone, in meters.
    Veto,
    /// Some part of the chain has come into an obstacle; the value is the depth in meters.
    Penetration,
    /// The chain is clear of obstacles again.
    Clear,
    /// A part got out of the way of something, after a cycle in which none had to; the value is how
    /// many motions that took.
    Escape,
    /// A robot's body touches something; the value is its distance from its connector in meters.
    Bumper,
    /// The initiator goes on in another direction after a veto; the value is the turn in radians.
    Sideways,
    /// The other end has taken over the initiative, to pull the chain back.
    PulledBack,
    /// Nothing helps: the initiator is stuck.
    Stuck,
    /// A connector has broken down, or got another bend limit or mobility.
    Changed,
    /// Parts of the chain were scattered; the value is how many.
    Broken,
    /// The scattered parts set out to be joined again; the value is the number of double passes
    /// that it took to find where to.
    Reforming,
    /// They are joined again.
    Reformed,
    /// The gap between the whole ends is longer than the parts; the value is what is wanting, in
    /// meters.
    GapTooLong,
    /// No places were found where the scattered parts are joined; the value is by how much the
    /// worst rod was off, in meters.
    NotReformed,
    /// A target has been reached; the value is its number.
    Target,
    /// A task is done; the value is its number.
    Done,
    /// A task was given up; the value is its number.
    GivenUp,
}

impl EventKind {
    /// All kinds.
    pub const ALL: [Self; 17] = [
        Self::Veto,
        Self::Penetration,
        Self::Clear,
        Self::Escape,
        Self::Bumper,
        Self::Sideways,
        Self::PulledBack,
        Self::Stuck,
        Self::Changed,
        Self::Broken,
        Self::Reforming,
        Self::Reformed,
        Self::GapTooLong,
        Self::NotReformed,
        Self::Target,
        Self::Done,
        Self::GivenUp,
    ];

    /// Its name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Veto => "veto",
            Self::Penetration => "penetration",
            Self::Clear => "clear",
            Self::Escape => "escape",
            Self::Bumper => "bumper",
            Self::Sideways => "sideways",
            Self::PulledBack => "pulled-back",
            Self::Stuck => "stuck",
            Self::Changed => "changed",
            Self::Broken => "broken",
            Self::Reforming => "reforming",
            Self::Reformed => "reformed",
            Self::GapTooLong => "gap-too-long",
            Self::NotReformed => "not-reformed",
            Self::Target => "target",
            Self::Done => "done",
            Self::GivenUp => "given-up",
        }
    }
}

/// One event.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Event {
    /// Cycle in which it happened.
    pub(crate) cycle: Cycle,
    /// The chain.
    pub(crate) chain: EntityId,
    /// What.
    pub(crate) kind: EventKind,
    /// The connector that it is about.
    pub(crate) connector: u32,
    /// Why, of vetoes.
    pub(crate) reason: Option<Reason>,
    /// The obstacle that it is about, if it is about one.
    pub(crate) obstacle: Option<u32>,
    /// See [`EventKind`]; 0 where a kind has none.
    pub(crate) value: f64,
}
