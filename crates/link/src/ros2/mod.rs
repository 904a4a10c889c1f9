//! A run as a node of ROS 2, without ROS: spoken by Zenoh alone, with the conventions of `rmw_zenoh`.
//!
//! ```text
//! rmw.rs       names, keys, tokens, qualities of service and attachments, as rmw_zenoh has them
//! types.rs     the types that are sent, with their hashes
//! node.rs      the node on the network: its topics and services
//! velocity.rs  velocities from outside as orders to robots
//! goals.rs     goal poses from outside, likewise
//! trajectories.rs  joint trajectories from outside as orders to arms
//! run.rs       a run that passes at a speed, and that services pause, step and reset
//! ```

pub mod goals;
pub mod node;
pub mod rmw;
pub mod run;
pub mod trajectories;
pub mod types;
pub mod velocity;
