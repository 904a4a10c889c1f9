//! A fleet: a world at a server, and its agents as processes on a network.
//!
//! ```text
//! wire/      frames between parties: in memory, or by Zenoh (the one file that names sockets)
//! party.rs   who speaks                              post.rs   letters: numbered, acknowledged, repeated
//! words.rs   words that parties say to each other
//! mail.rs    a party's letters and notes             ports.rs  what is asked of a world and of an agent's program
//! airspace.rs  airplanes: the world, the pilot, and the faults of the network
//! program/   the process: job, logs, metrics, other processes
//! server/    the world's server                      node/     the node of an agent
//! ```

pub mod airspace;
pub mod mail;
pub mod node;
pub mod party;
pub mod ports;
mod post;
pub mod program;
pub mod server;
pub mod wire;
pub mod words;
