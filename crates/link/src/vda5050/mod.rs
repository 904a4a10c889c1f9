//! Vehicles of a warehouse by VDA 5050: a plan's action dependency graph, carried out over MQTT.
//!
//! ```text
//! routes.rs     plan -> the nodes that each vehicle passes, and what others have to have passed before
//! messages.rs   the messages of the standard
//! vehicle.rs    what is known of one vehicle, and which of its messages are dropped
//! master.rs     the master control: which node is released when; without a socket and a clock
//! broker.rs     the connection to a broker: the only code here that opens a socket
//! ```

pub mod broker;
pub mod master;
pub mod messages;
pub mod routes;
pub mod vehicle;
