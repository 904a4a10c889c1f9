//! Flights without a server: each airplane is a node, and all that a node knows of others they report themselves.
//!
//! ```text
//!   vehicle <──setpoints── guard <──reference── program of the node <──reports, packets──> other nodes
//!           ──measurements─>      ──what is flown─>      (replica, pilot)        │
//!                                                                               └──reports──> recorder
//! ```
//!
//! A node decides one cycle ahead (`sidestep::worlds::airspace::replica` has why that keeps airplanes apart whatever is
//! lost). Its guard is a thread of its own: it leads the vehicle along the reference, goes on by the stored fallback when
//! the program is late, and hands the vehicle over to its own autopilot when anything is beyond its limits.
//!
//! ```text
//! time.rs      clocks: when a cycle begins, and by how much others' clocks differ
//! message.rs   what nodes and the recorder send to each other
//! channel.rs   messages to and from others over a wire, with the faults of the scenario's network
//! board.rs     what a node's program and its guard share: the reference, and what the guard does
//! fence.rs     the area that an aircraft must not leave
//! guard.rs     the guard
//! journal.rs   what an airplane has reported last, for its node when it is started again
//! node.rs      the program of the node
//! recorder.rs  the recorder, which only listens
//! ```

pub mod board;
pub mod channel;
pub mod fence;
pub mod guard;
pub mod journal;
pub mod message;
pub mod node;
pub mod recorder;
#[cfg(test)]
mod tests;
pub mod time;
