//! The pilot: the program aboard one airplane, as it flies in the simulator and in the field.
//!
//! ```text
//!          Percept ──> Pilot ──> Control           one of each per airplane and cycle
//!                      │   ^
//!             packets  v   │  packets              to and from the others of its group
//! ```
//!
//! A [`Pilot`] knows the filed flights (the world), perceives a [`Percept`], finds its group where that is not
//! announced, agrees with the others of its group first on what each prefers to fly and then on whether that is safe,
//! and ends with a [`AirplaneControl`]. It is a state machine without a clock, a socket or a thread. The simulator runs
//! a group of them over a network in memory (`deploy/`); a process on a network runs one.
//!
//! No process sees when all are done, so each ends by its own outcome or its deadline, and continues to answer the
//! others' requests about conversations that it has ended. One that is ahead may already be in the next conversation:
//! such packets are kept until that starts, up to a bound.
//!
//! ```text
//! percept.rs, control.rs           the input of a cycle, and its output
//! program.rs                       the state machine
//! schedule.rs, early_packets.rs    when conversations start and end; packets of conversations to come
//! common_knowledge.rs              the knowledge with which it goes into a conversation
//! common_plans.rs                  what all compute for each from what all see, where nobody is heard
//! conversations.rs                 the participants of the conversations
//! ```

mod common_knowledge;
mod common_plans;
mod control;
mod conversations;
mod early_packets;
mod percept;
mod program;
mod schedule;
#[cfg(test)]
mod tests;

pub use crate::agents::packet::{ConversationId, Protocol};
pub(crate) use common_plans::CommonPlans;
pub use control::{AirplaneControl, Maneuver, OptimizationStatus, PilotMemory};
pub use percept::{OwnshipState, Percept, SurveillanceReport, TrackedState};
pub use program::Pilot;
pub(crate) use schedule::ConversationSchedule;
#[cfg(test)]
pub(crate) use schedule::{ConversationWindows, retry_policy};
pub use sidestep_kernel::network::{DropCounts, DropReason};
