//! The events of a run, for viewers.

use super::body::BodyId;
use super::pose::Vec3;
use crate::units::Cycle;
use serde::{Deserialize, Serialize};
use std::borrow::Cow;

/// An event in the form that is the same for all worlds.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LogEvent {
    /// The cycle in which it happened, of which the frame after it shows the result.
    pub cycle: Cycle,
    /// Its severity: the level in the logs of viewers.
    pub level: Severity,
    /// Its kind, which also defines the meaning of `value`.
    pub kind: LogEventKind,
    /// The body that it happened to.
    pub who: BodyId,
    /// The other body involved, if there is one and the world knows it.
    pub with: Option<BodyId>,
    /// The position, in meters.
    pub at_m: Option<Vec3>,
    /// The number that its kind defines, e.g. a distance.
    pub value: Option<Quantity>,
    /// A sentence about the event, for people.
    pub words: String,
}

impl LogEvent {
    /// Returns the name of the body it happened to.
    pub fn name(&self) -> String {
        self.who.to_string()
    }
}

/// The value of an event, with the unit that its kind defines.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Quantity {
    /// The number, in `unit`.
    pub value: f64,
    /// Its unit; empty for plain numbers.
    pub unit: Cow<'static, str>,
}

impl Quantity {
    /// Creates a quantity; `unit` is empty for plain numbers.
    pub fn new(value: f64, unit: &'static str) -> Self {
        Self { value, unit: Cow::Borrowed(unit) }
    }
}

/// Declares the kinds of events with their names in files.
macro_rules! log_event_kinds {
    ($($(#[$doc:meta])* $kind:ident = $name:literal,)*) => {
        /// The kinds of events of all worlds; a kind has the same meaning in each.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
        #[serde(rename_all = "kebab-case")]
        pub enum LogEventKind {
            $($(#[$doc])* $kind,)*
        }

        impl LogEventKind {
            /// Every kind once, in the order of declaration.
            pub const ALL: &[Self] = &[$(Self::$kind),*];

            /// Returns its name in files.
            pub fn name(self) -> &'static str {
                match self {
                    $(Self::$kind => $name,)*
                }
            }
        }
    };
}

log_event_kinds! {
    /// Two bodies, or a body and a wall, touch.
    Contact = "contact",
    /// A door has opened; the body is the door.
    DoorOpened = "door-opened",
    /// A door has closed; the body is the door.
    DoorClosed = "door-closed",
    /// Two bodies are nearer to each other than they may be; the value is their distance.
    LossOfSeparation = "loss-of-separation",
    /// A body has finished its route; the value is its delay.
    Arrival = "arrival",
    /// The shield has overridden an action; the value is the number of the action that is taken instead.
    Override = "override",
    /// The shield keeps a body on its stored fallback.
    Orbit = "orbit",
    /// An agent does not answer another one's requests.
    Unheard = "unheard",
    /// An agent that did not answer is heard again.
    Heard = "heard",
    /// The deadline passed before an agent had decided.
    Deadline = "deadline",
    /// A body keeps its course because not all others have agreed to another.
    HeldBack = "held-back",
    /// A group is too large to decide together; the value is the number of its bodies.
    GroupTooLarge = "group-too-large",
    /// The errors of a body exceed their assumed bounds; the value is the ratio of the two.
    BeyondBound = "beyond-bound",
    /// A non-cooperative body can reach a body; the value is their distance.
    Intruder = "intruder",
    /// A body keeps to its safe plan, because no decision for it arrived in time.
    Absent = "absent",
    /// A part has vetoed a motion; the value is the distance that it could have moved.
    Veto = "veto",
    /// A part penetrates another body; the value is the depth.
    Penetration = "penetration",
    /// A body is clear of all others again.
    Clear = "clear",
    /// A part has evaded an obstacle; the value is the number of motions that it took.
    Escape = "escape",
    /// A bumper touches an obstacle; the value is the distance between the robot and the contact.
    Bumper = "bumper",
    /// A leader continues in another direction after a veto; the value is the turn.
    Sideways = "sideways",
    /// The other end has taken over, to pull a chain back.
    PulledBack = "pulled-back",
    /// The leader cannot move in any direction.
    Stuck = "stuck",
    /// A part has failed, or its abilities have changed.
    Changed = "changed",
    /// Parts were scattered; the value is their number.
    Broken = "broken",
    /// Scattered parts start to be joined again; the value is the number of passes that it takes.
    Reforming = "reforming",
    /// Scattered parts are joined again.
    Reformed = "reformed",
    /// A gap is longer than the parts that could close it; the value is the missing length.
    GapTooLong = "gap-too-long",
    /// No positions were found that join the scattered parts; the value is the remaining error.
    NotReformed = "not-reformed",
    /// A target has been reached; the value is its number.
    Target = "target",
    /// A task is done; the value is its number.
    Done = "done",
    /// A task was given up; the value is its number.
    GivenUp = "given-up",
    /// A path to a target was found; the value is the number of its segments.
    Planned = "planned",
    /// No path to a target was found; the value is its number.
    NotPlanned = "not-planned",
    /// Bodies wait for each other in a circle; the value is their number, and the body the first of them.
    Gridlock = "gridlock",
    /// Such bodies move again.
    GridlockEnded = "gridlock-ended",
    /// A body has come to where an area does not permit it to be; the value is the number of the area.
    AreaEntry = "area-entry",
    /// The shield does not keep a body clear of an area; the value is the number of the area.
    AreaExempt = "area-exempt",
    /// The shield has not cleared a level or a speed that a method commands.
    CommandHeld = "command-held",
    /// Two bodies come too close as far as a search has found, and it has come to its limit.
    SearchLimit = "search-limit",
    /// The shield holds a change of level of a body; the value is its altitude.
    LevelOff = "level-off",
    /// The shield holds a body below the altitude that is safe; the value is its altitude.
    LowHold = "low-hold",
    /// A body is in the air for longer than its fuel lasts; the value is how long that lasts.
    EnduranceExceedance = "endurance-exceedance",
    /// A body drops its track of another one, of which it receives no reports; the value is the age of the last one.
    TrackDropped = "track-dropped",
}

/// The severity of an event, rising.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Severity {
    /// A normal course of the run.
    Info,
    /// Unusual, but allowed.
    Warning,
    /// An event that the run is meant to avoid.
    Error,
}

/// Events kept for the next frame, up to a maximum; further ones are only counted.
#[derive(Debug, Clone)]
pub struct EventBuffer<E> {
    events: Vec<E>,
    dropped: u64,
    /// Whether events are kept, because somebody reads frames.
    pub is_enabled: bool,
}

/// The maximum number of events between two frames: more than a viewer can list, and a bound for the memory of a run
/// whose viewer reads no frames for hours.
const MAX_EVENTS: usize = 10_000;

impl<E> Default for EventBuffer<E> {
    fn default() -> Self {
        Self { events: Vec::new(), dropped: 0, is_enabled: false }
    }
}

impl<E> EventBuffer<E> {
    /// Keeps an event, if events are kept.
    pub fn push(&mut self, event: E) {
        if !self.is_enabled {
            return;
        }
        if self.events.len() < MAX_EVENTS {
            self.events.push(event);
        } else {
            self.dropped += 1;
        }
    }

    /// Moves out all events since the last call, and the number of those that were dropped.
    pub fn take(&mut self) -> (Vec<E>, u64) {
        (std::mem::take(&mut self.events), std::mem::take(&mut self.dropped))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn kinds_of_events_have_one_name_each_and_the_same_in_all_files() {
        for kind in LogEventKind::ALL {
            assert_eq!(serde_json::to_value(kind).unwrap(), kind.name());
            assert_eq!(LogEventKind::ALL.iter().filter(|k| k.name() == kind.name()).count(), 1);
        }
    }

    #[test]
    fn a_log_keeps_nothing_unless_somebody_watches_and_counts_what_is_too_much() {
        let mut log = EventBuffer::default();
        log.push(1);
        assert_eq!(log.take(), (vec![], 0));
        log.is_enabled = true;
        (0..MAX_EVENTS + 3).for_each(|k| log.push(k));
        let (kept, left_out) = log.take();
        assert_eq!((kept.len(), left_out), (MAX_EVENTS, 3));
        assert_eq!(log.take(), (vec![], 0));
    }
}
