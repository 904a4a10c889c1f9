//! A fleet: a world at a server, and its agents as processes on a network.
//!
//! ```text
//! wire/              frames between peers: in memory, or by Zenoh (the only code that opens sockets)
//! peer.rs            participants of a fleet: the server, and a node for each agent
//! protocol.rs        messages between peers, and the frames that carry them
//! arq.rs             reliable delivery to one peer: numbered, acknowledged, retransmitted
//! identity.rs        whom a certificate stands for
//! signature.rs       signatures of frames that the server relays
//! messenger.rs       a peer's reliable and best-effort messages to and from all other peers
//! agent.rs           the interface of an agent's program, of its percepts, controls and packets
//! distributed.rs     the interface of a world whose agents are processes
//! worlds.rs          the worlds that have it: airspace.rs (pilots), chain.rs (connectors), robots.rs
//! robot_percept.rs   percepts of robots, as the server sends them
//! faults.rs          the faults of the scenario's network, for the packets of one agent
//! recent_senders.rs  the senders that an agent has heard lately
//! replay_window.rs   which frames of a peer have arrived
//! resource_usage.rs  the processor time of a process
//! hosted_run.rs      the recorded run at the server
//! server/            the server of the world
//! vehicle/           programs of users that decide in place of an agent's own, over a public wire
//! node/              the node of an agent
//! ros2/              a run as a node of ROS 2, without ROS
//! vda5050/           vehicles of a warehouse that carry out a plan (its broker.rs opens a socket, too)
//! plant/             a real robot or aircraft as its program sees it: measurements in, commands out; by ROS 2, or a model
//! mavlink/           an aircraft whose autopilot speaks MAVLink (its socket.rs opens sockets, too)
//! drive/             the program of a robot that drives a plant
//! flight/            airplanes without a server: each node knows others by their reports
//! program/           the process: its job, logs, metrics and child processes
//! ```

pub mod agent;
mod airspace;
mod arq;
mod chain;
pub mod distributed;
pub mod drive;
mod faults;
pub mod flight;
pub mod hosted_run;
pub mod identity;
pub mod mavlink;
pub mod messenger;
pub mod node;
pub mod peer;
pub mod plant;
pub mod program;
pub mod protocol;
mod recent_senders;
mod replay_window;
mod resource_usage;
mod robot_percept;
mod robots;
pub mod ros2;
pub mod server;
pub mod signature;
pub mod vda5050;
pub mod vehicle;
pub mod wire;
pub mod worlds;
