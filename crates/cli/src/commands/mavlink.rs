//! Options of a node that leads an aircraft by MAVLink.

use clap::Args;
use sidestep_session::fleet::{MavlinkSettings, PlantChoice};
use std::path::PathBuf;

/// The aircraft of a node.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "Aircraft by MAVLink")]
pub(crate) struct MavlinkArgs {
    /// Lead an aircraft whose autopilot (ArduPilot or PX4) speaks MAVLink 2: udp:HOST:PORT waits for it at
    /// an address of this machine, udpout:HOST:PORT sends to it, tcp:HOST:PORT connects to it
    #[arg(long, value_name = "ENDPOINT", requires = "start")]
    mavlink: Option<String>,

    /// Where the origin of a planar scenario lies, in degrees; its altitude 0 is at ALT meters above the
    /// sea, or at the home of the aircraft
    #[arg(long, value_name = "LAT,LON[,ALT]", requires = "mavlink", allow_hyphen_values = true)]
    origin: Option<String>,

    /// Ask the aircraft, once, for the mode in which it follows the node (GUIDED, OFFBOARD), when it is
    /// in the air and near its first pose; else a pilot sets it. It is never armed, and never takes off
    #[arg(long, requires = "mavlink")]
    take_control: bool,

    /// Key of signed frames: a file of 32 bytes, or of 64 hexadecimal digits; needed where the
    /// endpoint is not of this machine alone, unless --insecure is given
    #[arg(long, value_name = "FILE", requires = "mavlink")]
    mavlink_key: Option<PathBuf>,

    /// System of the aircraft, if several are heard
    #[arg(long, value_name = "N", requires = "mavlink", value_parser = clap::value_parser!(u8).range(1..))]
    system_id: Option<u8>,

    /// System of the node: that of SYSID_MYGCS, if the failsafe of ArduPilot is to act when it ends
    #[arg(long, value_name = "N", requires = "mavlink", default_value_t = 245, value_parser = clap::value_parser!(u8).range(1..))]
    own_system_id: u8,

    /// Largest speed in m/s that it is asked for [default: 1.5 times that of its type]
    #[arg(long, value_name = "M/S", requires = "mavlink", value_parser = super::flight::parse_positive)]
    max_speed: Option<f64>,

    /// Largest acceleration in m/s^2 that it is asked for [default: 1.5 times that of its turns]
    #[arg(long, value_name = "M/S2", requires = "mavlink", value_parser = super::flight::parse_positive)]
    max_acceleration: Option<f64>,
}

impl MavlinkArgs {
    /// Returns the aircraft, if one is to be led, which is waited for so many seconds.
    pub(crate) fn plant(&self, patience_s: f64) -> Option<PlantChoice> {
        Some(PlantChoice::Mavlink(MavlinkSettings {
            endpoint: self.mavlink.clone()?,
            system_id: self.system_id,
            own_system_id: self.own_system_id,
            key_file: self.mavlink_key.clone(),
            origin: self.origin.clone(),
            takes_control: self.take_control,
            max_speed_m_s: self.max_speed,
            max_acceleration_m_s2: self.max_acceleration,
            patience_s,
        }))
    }
}
