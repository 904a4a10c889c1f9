//! What happened, and when.

use serde::{Deserialize, Serialize};
use sidestep_kernel::{Cycle, EntityId};

/// Kinds of events.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum EventKind {
    /// Two airplanes have come nearer than their separation; the value is how near
    /// they were at first, in meters.
    LossOfSeparation,
    /// An airplane has done with its last way-point; the value is its delay in seconds.
    Arrival,
    /// The shield has changed what an airplane wanted; the value is the number of the way it
    /// flies instead, counted from the one it wanted.
    Override,
    /// The shield keeps an airplane on its stored orbit.
    Orbit,
    /// An airplane heard nothing of another one in spite of asking.
    Unheard,
    /// Time was up before an airplane's agent was done.
    Deadline,
    /// An airplane stays on its orbit since not everybody has agreed to what it wanted.
    HeldBack,
    /// A group is too large for the memory allowed: its airplanes fly straight on, as far as the
    /// shield lets them; the value is how many they are.
    GroupTooLarge,
}

impl EventKind {
    /// All kinds.
    pub const ALL: [Self; 8] = [
        Self::LossOfSeparation,
        Self::Arrival,
        Self::Override,
        Self::Orbit,
        Self::Unheard,
        Self::Deadline,
        Self::HeldBack,
        Self::GroupTooLarge,
    ];

    /// Its name in files.
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
        }
    }
}

/// One event.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Event {
    /// Cycle in which it happened.
    pub cycle: Cycle,
    /// What.
    pub kind: EventKind,
    /// To whom.
    pub airplane: EntityId,
    /// With whom; the airplane itself where there is nobody else.
    pub other: EntityId,
    /// See [`EventKind`]; 0 where a kind has none.
    pub value: f64,
}

impl Event {
    /// An event of one airplane.
    pub fn of(cycle: Cycle, kind: EventKind, airplane: EntityId) -> Self {
        Self { cycle, kind, airplane, other: airplane, value: 0.0 }
    }

    /// An event between two.
    pub fn of_pair(cycle: Cycle, kind: EventKind, airplane: EntityId, other: EntityId) -> Self {
        Self { other, ..Self::of(cycle, kind, airplane) }
    }

    /// The same with a value.
    #[must_use]
    pub fn with(self, value: f64) -> Self {
        Self { value, ..self }
    }

    /// The order of a table's rows: a group's events in whatever order groups were looked at.
    pub(super) fn key(&self) -> (Cycle, EntityId, EventKind, EntityId) {
        (self.cycle, self.airplane, self.kind, self.other)
    }
}
