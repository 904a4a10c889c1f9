//! The pilot: the program aboard one airplane, as it flies in the simulator and in the field.
//!
//! ```text
//!            Sight ──> Pilot ──> Control           one of each per airplane and cycle
//!                      │   ^
//!              Packet  v   │  Packet               to and from the others of its group
//! ```
//!
//! A [`Pilot`] knows the filed flights (the world), perceives a [`Percept`], finds its group where that is not
//! announced, talks with the others of its group first about the wishes of each and then about whether those are
//! safe, and ends with a [`Control`]. It is a state machine without a clock, a socket or a thread. The simulator runs
//! a group of them over a network in memory (`deploy/`); a process on a network runs one.
//!
//! No process sees when all are done, so each ends by its own outcome or its deadline, and goes on to answer the
//! others' questions about talks that it has ended. One that is ahead may already be in the next talk: such packets
//! are kept until that starts, as many as there is room for.
//!
//! ```text
//! sight.rs  control.rs    the input of a cycle, and its output
//! aboard.rs               the state machine
//! schedule.rs  early.rs   when talks start and end; packets of talks to come
//! briefing.rs  talks.rs   the knowledge with which it goes into a talk; the parties to the talks
//! ```

mod common_knowledge;
mod control;
mod conversations;
mod early_packets;
mod percept;
mod program;
mod schedule;
#[cfg(test)]
mod tests;

pub use crate::agents::packet::{ConversationId, Protocol};
pub use control::{Control, Maneuver, Memory, OptimizerStats};
pub use percept::{OwnshipState, Percept, SurveillanceReport};
pub use program::Pilot;
pub(crate) use schedule::Schedule;
#[cfg(test)]
pub(crate) use schedule::retry_policy;
pub use sidestep_kernel::network::{DropCounts, DropReason};
