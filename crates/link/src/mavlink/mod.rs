//! Aircraft whose autopilot speaks MAVLink 2: an [`AircraftPlant`](crate::plant::aircraft::AircraftPlant) by UDP or TCP.
//!
//! ```text
//! endpoint.rs   where an autopilot is, as ground stations write it
//! socket.rs     bytes to and from there
//! splitter.rs   frames in bytes
//! signature.rs  the key of signed frames
//! channel.rs    verified frames in, messages out
//! messages.rs   the two messages whose commands may be of any dialect
//! counts.rs     what was dropped or refused, by name
//! coordinates.rs  the scenario's coordinates and those of the earth
//! clock.rs      the vehicle's clock on this machine's
//! autopilot.rs  kinds of vehicles, their modes, who is in control
//! measured.rs   what a vehicle has told of itself
//! commands.rs   commands until they are acknowledged
//! guidance.rs   setpoints of a reference flight
//! traffic.rs    other aircraft, told and heard
//! plant.rs      all of it together
//! ```
//!
//! Sources: MAVLink's definitions of the common dialect, its guides on serialization and message signing; the command
//! `MAV_CMD_GUIDED_CHANGE_HEADING` and its relatives of the dialect of ArduPilot.

mod autopilot;
mod channel;
mod clock;
mod commands;
mod coordinates;
mod counts;
mod endpoint;
mod guidance;
mod measured;
mod messages;
mod plant;
mod signature;
mod socket;
mod splitter;
mod traffic;

pub use autopilot::{Firmware, VehicleKind};
pub use coordinates::{GeoFrame, Origin};
pub use counts::MavlinkCounts;
pub use endpoint::{MavlinkEndpoint, MavlinkTransport};
pub use guidance::FlightLimits;
pub use plant::{MavlinkError, MavlinkOptions, MavlinkPlant};
pub use signature::{KEY_BYTES, read_key};
pub use traffic::address_of_airplane;
