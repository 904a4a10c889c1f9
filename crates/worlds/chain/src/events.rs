//! Events of a run, with their cycles.

use serde::{Deserialize, Serialize};
use sidestep_kernel::view::{LogEventKind, Vec3};
use sidestep_kernel::{Cycle, EntityId};
use sidestep_rods::VetoReason;

/// What may happen to a chain; each kind says what the value of its events is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum EventKind {
    /// A connector has objected to a motion that the driver wanted; the value is the distance that
    /// the initiator could have gone, in meters.
    Veto,
    /// Some part of the chain has entered an obstacle; the value is the depth in meters.
    Penetration,
    /// The chain is clear of obstacles again.
    Clear,
    /// A part got out of an obstacle's way, after a cycle in which none had to; the value is the number
    /// of motions needed.
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
    /// Parts of the chain were scattered; the value is their number.
    Broken,
    /// The scattered parts start to be joined again; the value is the number of double passes
    /// needed to find their places.
    Reforming,
    /// The scattered parts are joined again.
    Reformed,
    /// The gap between the whole ends is longer than the parts; the value is the missing length in
    /// meters.
    GapTooLong,
    /// No places were found where the scattered parts are joined, or something was in their way for too long; the value
    /// is the error of the worst rod, in meters.
    NotReformed,
    /// A target has been reached; the value is its number.
    Target,
    /// A task is done; the value is its number.
    Done,
    /// A task was given up, or ended with none of its targets reached; the value is its number.
    GivenUp,
    /// A planner has found a path to a target; the value is the number of its postures.
    Planned,
    /// A planner has found no path to a target; the value is the target's number.
    NotPlanned,
    /// A neighbor no longer hears the connector, and the chain stands; the value is the neighbor.
    Unheard,
    /// The neighbor hears the connector again, and the chain goes on; the value is the neighbor.
    Heard,
    /// Time was up before the leader had finished its talk.
    Deadline,
    /// A target was given up; the value is its number.
    TargetGivenUp,
}

impl EventKind {
    /// All kinds, in the order of the labels in tables.
    pub const ALL: [Self; 23] = [
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
        Self::Planned,
        Self::NotPlanned,
        Self::Unheard,
        Self::Heard,
        Self::Deadline,
        Self::TargetGivenUp,
    ];

    /// Returns its kind for viewers, which know no world.
    pub(crate) fn view_kind(self) -> LogEventKind {
        match self {
            Self::Veto => LogEventKind::Veto,
            Self::Penetration => LogEventKind::Penetration,
            Self::Clear => LogEventKind::Clear,
            Self::Escape => LogEventKind::Escape,
            Self::Bumper => LogEventKind::Bumper,
            Self::Sideways => LogEventKind::Sideways,
            Self::PulledBack => LogEventKind::PulledBack,
            Self::Stuck => LogEventKind::Stuck,
            Self::Changed => LogEventKind::Changed,
            Self::Broken => LogEventKind::Broken,
            Self::Reforming => LogEventKind::Reforming,
            Self::Reformed => LogEventKind::Reformed,
            Self::GapTooLong => LogEventKind::GapTooLong,
            Self::NotReformed => LogEventKind::NotReformed,
            Self::Target => LogEventKind::Target,
            Self::Done => LogEventKind::Done,
            Self::GivenUp | Self::TargetGivenUp => LogEventKind::GivenUp,
            Self::Planned => LogEventKind::Planned,
            Self::NotPlanned => LogEventKind::NotPlanned,
            Self::Unheard => LogEventKind::Unheard,
            Self::Heard => LogEventKind::Heard,
            Self::Deadline => LogEventKind::Deadline,
        }
    }

    /// Returns its name in files.
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
            Self::Planned => "planned",
            Self::NotPlanned => "not-planned",
            Self::Unheard => "unheard",
            Self::Heard => "heard",
            Self::Deadline => "deadline",
            Self::TargetGivenUp => "target-given-up",
        }
    }
}

/// Something that happened to a chain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Event {
    /// Cycle in which it happened.
    pub(crate) cycle: Cycle,
    /// Slot of the chain.
    pub(crate) chain: EntityId,
    /// What happened; it gives `value` its meaning.
    pub(crate) kind: EventKind,
    /// The connector concerned.
    pub(crate) connector: u32,
    /// Where that connector was, meters.
    pub(crate) at_m: Vec3,
    /// Reason of a veto, or of the last one before a target was given up.
    pub(crate) reason: Option<VetoReason>,
    /// The obstacle concerned, if any.
    pub(crate) obstacle: Option<u32>,
    /// Number of parts that are missing in a gap that is too long; 0 for other events.
    pub(crate) missing: u32,
    /// See [`EventKind`]; 0 where a kind has none.
    pub(crate) value: f64,
}
