//! The events of a run.

use crate::shield::ShieldDecision;
use serde::{Deserialize, Serialize};
use sidestep_kernel::view::{LogEventKind, Vec3};
use sidestep_kernel::{Cycle, EntityId};

/// Kinds of events. Events of one cycle and airplane are recorded in their order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum EventKind {
    /// Two airplanes have come nearer than their separation; the value is their closest approach in
    /// the step of `dtau` in which they did, in meters.
    LossOfSeparation,
    /// An airplane has finished with its last way-point; the value is its delay in seconds.
    Arrival,
    /// The shield has changed an airplane's action; the value is the number of the candidate that it flies instead,
    /// counted from the preferred one.
    Override,
    /// The shield keeps an airplane on its stored fallback.
    Orbit,
    /// An airplane has not heard another one in spite of asking.
    Unheard,
    /// Time was up before an airplane's agent was done.
    Deadline,
    /// An airplane stays on its fallback because not all others have accepted its plan.
    HeldBack,
    /// A group is too large for the memory allowed: its airplanes fly straight on, as far as the
    /// shield lets them; the value is the number of airplanes.
    GroupTooLarge,
    /// An airplane's errors exceed the bounds for which the shield allows; the value is how many
    /// times.
    BeyondBound,
    /// An airplane can be reached in this `dt`, on any path, by a non-cooperative one; the value
    /// is their distance in meters.
    Intruder,
    /// An airplane with an external pilot stays on its fallback, because no control of it came in time.
    Absent,
    /// An airplane has come to where an area does not permit it to be; the value is the number of the area.
    AreaEntry,
    /// The shield does not keep an airplane clear of an area, because it has no fallback that is clear of it; the value
    /// is the number of the area.
    AreaExempt,
    /// The shield has not cleared what a method commands: the airplane keeps its speed, or levels off short of a level.
    CommandHeld,
    /// Two airplanes are named as too close, and the search for fallbacks that keep all apart has come to its limit: there
    /// may be some.
    SearchLimit,
    /// The shield begins to hold a change of level of an airplane; the value is its altitude in meters.
    LevelOff,
    /// The shield begins to hold an airplane, on its fallback or off its level, below the safe altitude; the value is its
    /// altitude in meters.
    LowHold,
    /// An airplane is in the air for longer than its endurance; the value is its endurance in seconds.
    EnduranceExceedance,
    /// An airplane drops its track of another one, because it has received no report of that one for the coast time. One that
    /// has only now come near counts, too, if there would have been a track of it in the cycle before. The value is the age
    /// of the last report in seconds.
    TrackDropped,
}

/// The quantity that the value of an event measures: each has a column of its own in the table.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum EventQuantity {
    /// Meters.
    Distance,
    /// Seconds.
    Delay,
    /// A number of something.
    Number,
}

impl EventQuantity {
    /// Returns its unit; empty for a number.
    pub(super) fn unit(self) -> &'static str {
        match self {
            Self::Distance => "m",
            Self::Delay => "s",
            Self::Number => "",
        }
    }
}

impl EventKind {
    /// Returns the quantity that its value measures; `None` for kinds without one.
    pub(super) fn measured_quantity(self) -> Option<EventQuantity> {
        match self {
            Self::LossOfSeparation | Self::Intruder => Some(EventQuantity::Distance),
            Self::Arrival => Some(EventQuantity::Delay),
            Self::Override
            | Self::GroupTooLarge
            | Self::BeyondBound
            | Self::AreaEntry
            | Self::AreaExempt
            | Self::LevelOff
            | Self::LowHold
            | Self::EnduranceExceedance
            | Self::TrackDropped => Some(EventQuantity::Number),
            Self::Orbit
            | Self::Unheard
            | Self::Deadline
            | Self::HeldBack
            | Self::Absent
            | Self::CommandHeld
            | Self::SearchLimit => None,
        }
    }

    /// All kinds; the table of events stores places in this list.
    pub const ALL: [Self; 19] = [
        Self::LossOfSeparation,
        Self::Arrival,
        Self::Override,
        Self::Orbit,
        Self::Unheard,
        Self::Deadline,
        Self::HeldBack,
        Self::GroupTooLarge,
        Self::BeyondBound,
        Self::Intruder,
        Self::Absent,
        Self::AreaEntry,
        Self::AreaExempt,
        Self::CommandHeld,
        Self::SearchLimit,
        Self::LevelOff,
        Self::LowHold,
        Self::EnduranceExceedance,
        Self::TrackDropped,
    ];

    /// Returns the kind that it is for viewers, which know no world.
    pub(super) fn log_event_kind(self) -> LogEventKind {
        match self {
            Self::LossOfSeparation => LogEventKind::LossOfSeparation,
            Self::Arrival => LogEventKind::Arrival,
            Self::Override => LogEventKind::Override,
            Self::Orbit => LogEventKind::Orbit,
            Self::Unheard => LogEventKind::Unheard,
            Self::Deadline => LogEventKind::Deadline,
            Self::HeldBack => LogEventKind::HeldBack,
            Self::GroupTooLarge => LogEventKind::GroupTooLarge,
            Self::BeyondBound => LogEventKind::BeyondBound,
            Self::Intruder => LogEventKind::Intruder,
            Self::Absent => LogEventKind::Absent,
            Self::AreaEntry => LogEventKind::AreaEntry,
            Self::AreaExempt => LogEventKind::AreaExempt,
            Self::CommandHeld => LogEventKind::CommandHeld,
            Self::SearchLimit => LogEventKind::SearchLimit,
            Self::LevelOff => LogEventKind::LevelOff,
            Self::LowHold => LogEventKind::LowHold,
            Self::EnduranceExceedance => LogEventKind::EnduranceExceedance,
            Self::TrackDropped => LogEventKind::TrackDropped,
        }
    }

    /// Returns its name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::LossOfSeparation => "loss-of-separation",
            Self::Arrival => "arrival",
            Self::Override => "override",
            Self::Orbit => "orbit",
            Self::Unheard => "unheard",
            Self::Deadline => "deadline",
            Self::HeldBack => "held-back",
            Self::GroupTooLarge => "group-too-large",
            Self::BeyondBound => "beyond-bound",
            Self::Intruder => "intruder",
            Self::Absent => "absent",
            Self::AreaEntry => "area-entry",
            Self::AreaExempt => "area-exempt",
            Self::CommandHeld => "command-held",
            Self::SearchLimit => "search-limit",
            Self::LevelOff => "level-off",
            Self::LowHold => "low-hold",
            Self::EnduranceExceedance => "endurance-exceedance",
            Self::TrackDropped => "track-dropped",
        }
    }
}

/// Something that has happened to an airplane in a cycle.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Event {
    /// Cycle in which it happened.
    pub cycle: Cycle,
    /// What has happened, and what `value` measures.
    pub kind: EventKind,
    /// The airplane to which it happened.
    pub airplane: EntityId,
    /// The other airplane involved; the airplane itself where there is none.
    pub other: EntityId,
    /// See [`EventKind`]; 0 where a kind has none.
    pub value: f64,
    /// The airplane's place at the end of the cycle.
    pub at_m: Option<Vec3>,
}

impl Event {
    /// Returns the other airplane involved, if there is one.
    pub(super) fn other_airplane(&self) -> Option<EntityId> {
        (self.other != self.airplane).then_some(self.other)
    }

    /// Returns the value, if it is measured so.
    pub(super) fn value_of_quantity(&self, measure: EventQuantity) -> Option<f64> {
        (self.kind.measured_quantity() == Some(measure)).then_some(self.value)
    }

    /// Returns an event of one airplane, without a value.
    pub fn new(cycle: Cycle, kind: EventKind, airplane: EntityId) -> Self {
        Self { cycle, kind, airplane, other: airplane, value: 0.0, at_m: None }
    }

    /// Returns an event of two airplanes without a value; it is recorded for the first of them.
    pub fn new_for_pair(
        cycle: Cycle,
        kind: EventKind,
        airplane: EntityId,
        other: EntityId,
    ) -> Self {
        Self { other, ..Self::new(cycle, kind, airplane) }
    }

    /// Returns the same event with a value.
    #[must_use]
    pub fn with_value(self, value: f64) -> Self {
        Self { value, ..self }
    }

    /// Returns the sort key of the table's rows, which does not depend on the order in which groups
    /// were handled.
    pub(super) fn sort_key(&self) -> (Cycle, EntityId, EventKind, EntityId) {
        (self.cycle, self.airplane, self.kind, self.other)
    }
}

/// Returns the event of an airplane for which the shield's search for a joint choice of plans, clear of a non-cooperative
/// aircraft, has come to its limit.
pub(crate) fn search_limit(
    decision: &ShieldDecision,
    airplane: EntityId,
    cycle: Cycle,
) -> Option<Event> {
    let other = decision.unproved_threat?;
    Some(Event::new_for_pair(cycle, EventKind::SearchLimit, airplane, other))
}
