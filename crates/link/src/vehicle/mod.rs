//! Vehicles: programs of users that decide in place of an agent's own, over a public wire.
//!
//! A node serves its vehicle at an endpoint of its own. What goes over it is published (`docs/src/wire/`) and has a version:
//! within a version messages stay as they are, so that a vehicle works with later builds of the node.
//!
//! ```text
//! messages.rs   the messages, in the encoding of ROS 2
//! port.rs       the endpoint: keys of Zenoh
//! robot.rs      the program of a robot that is a vehicle
//! ```

mod messages;
mod port;
mod robot;

pub use port::VehiclePort;
pub(crate) use port::ZenohPort;
pub(crate) use robot::RobotVehicle;

/// The version of keys and messages. A change that a vehicle would notice makes another one.
pub(crate) const WIRE_VERSION: u32 = 1;
