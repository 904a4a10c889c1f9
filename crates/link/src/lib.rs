//! A fleet: a world at a server, and its agents as processes on a network.
//!
//! ```text
//! wire/      frames between parties: in memory, or by Zenoh (the one file that names sockets)
//! party.rs     names of the parties                  post.rs   letters: numbered, acknowledged, repeated
//! mail.rs      a party's letters and notes           words.rs  words that parties exchange
//! deployed.rs  the interface of a world              ports.rs  the interface of an agent's program
//! worlds.rs    the known worlds                      stage.rs  the run at the server
//! airspace.rs  airplanes and their pilots            chain.rs  connectors of chains and their agents
//! faults.rs    the faults of a scenario's network    heard.rs  agents that an agent has heard
//! program/   the process: job, logs, metrics, other processes
//! server/    the world's server                      node/     the node of an agent
//! ```

pub mod agent;
mod airspace;
mod arq;
mod chain;
pub mod distributed;
mod faults;
pub mod hosted_run;
pub mod messenger;
pub mod node;
pub mod peer;
pub mod program;
pub mod protocol;
mod recent_senders;
pub mod server;
pub mod wire;
pub mod worlds;
