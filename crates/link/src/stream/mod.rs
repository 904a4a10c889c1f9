//! The stream of a fleet: its states and events, for programs of users, over the public wire.
//!
//! Whoever has the run publishes it: the server of a fleet, or the recorder of a flight without one. Listeners only listen:
//! nothing that one does, or leaves undone, slows the fleet.
//!
//! ```text
//! messages.rs    the messages, in the encoding of ROS 2
//! event_log.rs   the last events by number, for those who have missed some
//! publisher.rs   the endpoint: keys of Zenoh, and the thread that sends
//! ```

mod event_log;
mod messages;
mod publisher;

pub(crate) use publisher::{FleetStream, StreamSource};
