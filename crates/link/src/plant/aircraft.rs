//! An aircraft as its node sees it: measurements of its own in, setpoints of its reference flight out.
//!
//! A node decides a *reference*: where the aircraft is to be at each time, by which others know it and which the shield
//! keeps apart from theirs. The plant's controller keeps the aircraft near it, and the guard watches how near.

use sidestep::worlds::airspace::flight::Pose2;
use std::time::Duration;

/// What an aircraft has measured of itself.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AircraftState {
    /// Position in the scenario's coordinates, and the direction of its motion over the ground in radians
    /// counterclockwise from east.
    pub pose: Pose2,
    /// Altitude in meters, in the scenario's datum.
    pub altitude_m: f64,
    /// Speed over the ground in meters per second.
    pub ground_speed_m_s: f64,
    /// The age of the measurement in seconds, by the clock of this machine.
    pub age_s: f64,
    /// Whether the vehicle follows setpoints of its node.
    pub authority: Authority,
}

/// Who controls an aircraft.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Authority {
    /// Its node: it follows setpoints.
    Node,
    /// Its own autopilot or a pilot: it is not on the ground, and does not follow setpoints.
    Vehicle,
    /// Nobody: it is not armed, or has not taken off.
    Ground,
}

/// Where an aircraft is to be now, and how it is to move.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Setpoint {
    /// Its pose on the reference, in the scenario's coordinates.
    pub pose: Pose2,
    /// Speed over the ground on the reference, in meters per second.
    pub ground_speed_m_s: f64,
    /// Turn rate on the reference in radians per second, positive to the left.
    pub turn_rate_rad_s: f64,
    /// Altitude in meters, in the scenario's datum.
    pub altitude_m: f64,
}

/// Another aircraft that an aircraft's own receiver sees, or that its node tells it of.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrafficReport {
    /// Its address: of ICAO, or one that a node makes of an airplane's number.
    pub address: u32,
    /// Position in the scenario's coordinates, and the direction of its motion over the ground.
    pub pose: Pose2,
    /// Altitude in meters, in the scenario's datum.
    pub altitude_m: f64,
    /// Speed over the ground in meters per second.
    pub ground_speed_m_s: f64,
}

/// An aircraft that is measured and led.
pub trait AircraftPlant: Send {
    /// Waits for news of the aircraft, at most for the given time, and returns what is known; none before its first
    /// measurement.
    fn wait(&mut self, within: Duration) -> Option<AircraftState>;

    /// Sends a setpoint. It is also a proof of life: the autopilot's own failsafe acts when setpoints stop.
    ///
    /// # Errors
    /// When the aircraft cannot be reached anymore, with the reason.
    fn lead(&mut self, setpoint: &Setpoint) -> Result<(), String>;

    /// Hands the aircraft over to its own autopilot, which holds or loiters where it is.
    ///
    /// # Errors
    /// When the aircraft cannot be reached anymore, or refuses, with the reason.
    fn hold(&mut self, reason: &str) -> Result<(), String>;

    /// Shows the aircraft the traffic around it.
    ///
    /// # Errors
    /// When the aircraft cannot be reached anymore, with the reason.
    fn show_traffic(&mut self, traffic: &[TrafficReport]) -> Result<(), String>;

    /// Takes out what its own receiver has seen since the last call.
    fn take_traffic(&mut self) -> Vec<TrafficReport>;

    /// Returns what is wrong or was counted, by name, for the status.
    fn counts(&self) -> Vec<(String, u64)>;
}
