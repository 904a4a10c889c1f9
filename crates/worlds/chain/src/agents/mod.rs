//! Agents: the programs of the connectors of a chain, each with its own data.
//!
//! An agent knows its own connector, its two neighbors' messages, and the perception of its own sensors
//! ([`ConnectorPercept`]). It is a state machine without a clock, a socket or a thread: packets and ticks in,
//! packets out, and at the end of a cycle the motion of its connector ([`ConnectorControl`]).
//!
//! ```text
//! percept.rs, control.rs   in and out of a cycle; chain_controls.rs: all decisions of a chain
//! connector.rs             the agent: one connector, its links, and the part it plays
//!   connector/follow.rs    as a slave of a master,
//!   connector/lead.rs      as the initiator of one motion,
//!   connector/climb.rs     as a leader, by the ladder of `motion::recovery`
//!   connector/clock.rs     time, outgoing packets, and the end of a cycle
//! link.rs                  makes messages between two neighbors arrive, once and in order
//! message.rs               the messages, and the checks of what comes over the network
//! traffic.rs               the traffic on their network
//! side.rs                  below and above along the chain
//! ```
//!
//! A motion is a wave. Its initiator asks one neighbor, which asks the next, until one need not
//! move or the chain ends; consent or a veto comes back along the same route. Then it asks the other one.
//! So it prepares sub-step after sub-step, and no connector moves. Once all have consented it says
//! "go", after a veto "stay". One that has consented and hears neither goes if its master goes: it
//! feels the rod. So a vetoed motion leaves every connector where it was, whatever is lost.

pub(crate) mod chain_controls;
mod connector;
pub(crate) mod control;
mod link;
mod message;
pub(crate) mod percept;
pub(crate) mod side;
pub(crate) mod traffic;

pub use chain_controls::ChainCycleControls;
pub use connector::ConnectorAgent;
pub use control::{ConnectorControl, ConnectorMove, ExecutedMotion, LeaderOutcome};
pub use message::MotionProtocol;
pub use percept::{ChainPercepts, ConnectorPercept, ConnectorRole, Intention, SensedObstacle};
pub use traffic::NetworkTraffic;
