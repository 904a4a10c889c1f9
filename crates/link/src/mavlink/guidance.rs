//! Setpoints of a reference flight.
//!
//! Whoever can be told a position and a velocity is told both (multirotors, and fixed wings of PX4): the autopilot closes
//! the loop by its own estimate, hundreds of times a second, and the velocity and the acceleration of the reference tell
//! it where to be before it is late. Velocities alone would leave that loop to this side of the link, with the delays of
//! two ways in it.
//!
//! Fixed wings of ArduPilot know no such setpoint. They are told a course over the ground: that of the reference where
//! they are abeam of it, ahead by the time that their course takes, and toward it by the angle to a point ahead on it.
//! What they are behind on it they catch up by their airspeed, whose integral is what the wind takes.

use super::autopilot::{CHANGE_ALTITUDE, CHANGE_HEADING, GLOBAL_FRAME, HOME_FRAME, Identity};
use super::commands::CommandMessage;
use super::coordinates::{AltitudeTarget, GeoPose, compass_rad};
use super::measured::Fix;
use super::messages::CommandInt;
use ::mavlink::dialects::common::{
    COMMAND_LONG_DATA, MavCmd, MavFrame, PositionTargetTypemask,
    SET_POSITION_TARGET_GLOBAL_INT_DATA,
};
use sidestep::kernel::math::{atan2, cos, hypot, sin, wrap_angle};
use sidestep::worlds::airspace::flight::{Pose2, Surface};
use std::time::{Duration, Instant};

/// Time in which a multirotor may make up for its deviation, in seconds: the distance of its target is bounded by what it
/// flies in it at most.
const REACH_S: f64 = 1.0;

/// Time in which a fixed wing goes back to its reference from the side, in seconds: four times what its course takes, so
/// that it does not swing.
const CROSS_TIME_S: f64 = 4.0;

/// Time that the course of a fixed wing takes, in seconds.
const COURSE_TIME_S: f64 = 1.3;

/// Time in which a fixed wing catches up along its reference, in seconds, and the largest part of the speed for it.
const ALONG_TIME_S: f64 = 4.0;
const MAX_CATCH_UP: f64 = 0.15;

/// Airspeed for each meter per second that the ground speed is wrong, and its change in a second: fast enough that in a turn
/// of a minute the wind, which changes by twice its speed, is followed.
const AIRSPEED_GAIN: f64 = 1.0;
const AIRSPEED_GAIN_PER_S: f64 = 0.5;

/// The longest time over which the airspeed is integrated at once, in seconds.
const MAX_STEP_S: f64 = 0.5;

/// Commands to a fixed wing: each is acknowledged, so their number is bounded.
const COURSE_INTERVAL: Duration = Duration::from_millis(240);
const AIRSPEED_INTERVAL: Duration = Duration::from_millis(490);
const ALTITUDE_INTERVAL: Duration = Duration::from_secs(4);

/// Changes that are not worth a command, in meters per second and in meters.
const MIN_AIRSPEED_CHANGE_M_S: f64 = 0.1;
const MIN_ALTITUDE_CHANGE_M: f64 = 3.0;

/// The largest speed and acceleration that setpoints ask for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FlightLimits {
    /// In meters per second over the ground; for fixed wings through the air.
    pub max_speed_m_s: f64,
    /// The smallest airspeed of fixed wings in meters per second.
    pub min_airspeed_m_s: f64,
    /// In meters per second squared, in the plane: turns and changes of speed.
    pub max_acceleration_m_s2: f64,
}

impl FlightLimits {
    /// Returns the airspeed within the limits that is nearest to one.
    fn airspeed_m_s(&self, wanted_m_s: f64) -> f64 {
        wanted_m_s.max(self.min_airspeed_m_s).min(self.max_speed_m_s)
    }
}

/// A reference on the earth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct GeoSetpoint {
    pub pose: GeoPose,
    pub ground_speed_m_s: f64,
    pub turn_rate_rad_s: f64,
    pub altitude: AltitudeTarget,
}

/// What is measured of the vehicle that is led.
#[derive(Debug, Clone, Copy)]
pub(super) struct VehicleView<'a> {
    pub identity: Identity,
    pub fix: &'a Fix,
    /// The age of the measurement in seconds.
    pub age_s: f64,
    /// Its altitude less that of the reference, in meters.
    pub altitude_error_m: f64,
}

/// The reference as the vehicle sees it, in the plane that touches the earth where it is measured.
struct Deviation {
    /// The reference, in meters east and north of where the vehicle is now by its measured velocity.
    reference: Pose2,
    /// How far the reference is ahead, along its direction, in meters.
    along_m: f64,
}

impl Deviation {
    fn new(setpoint: &GeoSetpoint, vehicle: &VehicleView<'_>) -> Self {
        let frame = Surface::Earth.frame_at(vehicle.fix.at);
        let pose = Pose2 { at: setpoint.pose.at, heading_rad: setpoint.pose.heading_rad };
        let mut reference = frame.pose_to_local(pose);
        for axis in 0..2 {
            reference.at[axis] -= vehicle.fix.velocity_m_s[axis] * vehicle.age_s;
        }
        let along_m = reference.at[0] * cos(reference.heading_rad)
            + reference.at[1] * sin(reference.heading_rad);
        Self { reference, along_m }
    }

    fn distance_m(&self) -> f64 {
        hypot(self.reference.at[0], self.reference.at[1])
    }
}

/// Returns how far a vehicle is from its reference, in meters.
pub(super) fn distance_m(setpoint: &GeoSetpoint, vehicle: &VehicleView<'_>) -> f64 {
    Deviation::new(setpoint, vehicle).distance_m()
}

/// The guidance of a vehicle.
#[derive(Debug)]
pub(super) struct Guidance {
    limits: FlightLimits,
    /// The velocity that was told last, in meters per second to the east and to the north.
    velocity: Option<SentCommand<[f64; 2]>>,
    airspeed: Option<SentCommand<f64>>,
    airspeed_m_s: Option<f64>,
    integrated_at: Option<Instant>,
    course_at: Option<Instant>,
    altitude: Option<SentCommand<AltitudeTarget>>,
}

/// The last value that was sent to the vehicle.
#[derive(Debug, Clone, Copy)]
struct SentCommand<T> {
    value: T,
    at: Instant,
}

impl Guidance {
    /// Returns the guidance of a vehicle that was told nothing.
    pub(super) fn new(limits: FlightLimits) -> Self {
        Self {
            limits,
            velocity: None,
            airspeed: None,
            airspeed_m_s: None,
            integrated_at: None,
            course_at: None,
            altitude: None,
        }
    }

    /// Forgets what was told: the vehicle may have forgotten it, too.
    pub(super) fn restart(&mut self) {
        *self = Self::new(self.limits);
    }

    /// Returns the setpoint of position, velocity and acceleration.
    pub(super) fn position_target(
        &mut self,
        setpoint: &GeoSetpoint,
        vehicle: &VehicleView<'_>,
        boot_ms: u32,
    ) -> SET_POSITION_TARGET_GLOBAL_INT_DATA {
        let pose = self.reachable_pose(setpoint, vehicle);
        let heading_rad = setpoint.pose.heading_rad;
        let direction = [cos(heading_rad), sin(heading_rad)];
        let speed_m_s = setpoint.ground_speed_m_s.min(self.limits.max_speed_m_s);
        let velocity_m_s = self.next_velocity(direction.map(|part| part * speed_m_s));
        let most_m_s2 = self.limits.max_acceleration_m_s2;
        let turn_m_s2 = (speed_m_s * setpoint.turn_rate_rad_s).clamp(-most_m_s2, most_m_s2);
        // To the left of the direction.
        let acceleration_m_s2 = [-direction[1] * turn_m_s2, direction[0] * turn_m_s2];
        let altitude = altitude_of(setpoint.altitude);
        let target = vehicle.identity.target();
        let place = pose.units();
        SET_POSITION_TARGET_GLOBAL_INT_DATA {
            time_boot_ms: boot_ms,
            lat_int: place[0],
            lon_int: place[1],
            alt: altitude.alt_m as f32,
            vx: velocity_m_s[1] as f32,
            vy: velocity_m_s[0] as f32,
            vz: 0.0,
            afx: acceleration_m_s2[1] as f32,
            afy: acceleration_m_s2[0] as f32,
            afz: 0.0,
            yaw: wrap_angle(compass_rad(heading_rad)) as f32,
            // Clockwise in MAVLink.
            yaw_rate: -setpoint.turn_rate_rad_s as f32,
            // Nothing is left out.
            type_mask: PositionTargetTypemask::empty(),
            target_system: target[0],
            target_component: target[1],
            coordinate_frame: altitude.setpoint_frame,
        }
    }

    /// Returns the reference's pose, or one on the way to it that is no farther than a second of flight: a target that is
    /// far away would be flown to at the autopilot's own largest speed.
    fn reachable_pose(&self, setpoint: &GeoSetpoint, vehicle: &VehicleView<'_>) -> GeoPose {
        let deviation = Deviation::new(setpoint, vehicle);
        let distance_m = deviation.distance_m();
        let reach_m = self.limits.max_speed_m_s * REACH_S;
        if distance_m <= reach_m {
            return setpoint.pose;
        }
        let part = reach_m / distance_m;
        let frame = Surface::Earth.frame_at(vehicle.fix.at);
        let flown_m = vehicle.fix.velocity_m_s.map(|speed_m_s| speed_m_s * vehicle.age_s);
        let at = [0, 1].map(|axis| flown_m[axis] + part * deviation.reference.at[axis]);
        GeoPose { at: frame.to_world(at), heading_rad: setpoint.pose.heading_rad }
    }

    /// Returns the velocity to be told, which changes no faster than the largest acceleration.
    fn next_velocity(&mut self, wanted_m_s: [f64; 2]) -> [f64; 2] {
        let now = Instant::now();
        let mut value = wanted_m_s;
        if let Some(told) = &self.velocity {
            let step_s = now.duration_since(told.at).as_secs_f64();
            let most_m_s = self.limits.max_acceleration_m_s2 * step_s;
            let change_m_s = [0, 1].map(|axis| wanted_m_s[axis] - told.value[axis]);
            let length_m_s = hypot(change_m_s[0], change_m_s[1]);
            if length_m_s > most_m_s {
                let part = most_m_s / length_m_s;
                value = [0, 1].map(|axis| told.value[axis] + part * change_m_s[axis]);
            }
        }
        self.velocity = Some(SentCommand { value, at: now });
        value
    }

    /// Returns the commands to a fixed wing that are due.
    pub(super) fn plane_commands(
        &mut self,
        setpoint: &GeoSetpoint,
        vehicle: &VehicleView<'_>,
    ) -> Vec<CommandMessage> {
        let deviation = Deviation::new(setpoint, vehicle);
        let mut commands = Vec::new();
        commands.extend(self.course_command(setpoint, vehicle, &deviation));
        commands.extend(self.airspeed_command(setpoint, vehicle, &deviation));
        commands.extend(self.altitude_command(setpoint, vehicle));
        commands
    }

    fn course_command(
        &mut self,
        setpoint: &GeoSetpoint,
        vehicle: &VehicleView<'_>,
        deviation: &Deviation,
    ) -> Option<CommandMessage> {
        if self.course_at.is_some_and(|at| at.elapsed() < COURSE_INTERVAL) {
            return None;
        }
        self.course_at = Some(Instant::now());
        let course_rad = course_rad(setpoint, deviation);
        let course_deg = compass_rad(course_rad).to_degrees() as f32;
        // The first parameter says that a course over the ground is meant, not where the nose points.
        let params = [0.0, course_deg, self.limits.max_acceleration_m_s2 as f32, 0.0];
        Some(CommandMessage::Int(vehicle.identity.command(CHANGE_HEADING, params)))
    }

    fn airspeed_command(
        &mut self,
        setpoint: &GeoSetpoint,
        vehicle: &VehicleView<'_>,
        deviation: &Deviation,
    ) -> Option<CommandMessage> {
        let speed_m_s = setpoint.ground_speed_m_s;
        let catch_up = (deviation.along_m / (speed_m_s * ALONG_TIME_S).max(1.0))
            .clamp(-MAX_CATCH_UP, MAX_CATCH_UP);
        let wanted_m_s = speed_m_s * (1.0 + catch_up);
        let error_m_s = wanted_m_s - vehicle.fix.ground_speed_m_s();
        let now = Instant::now();
        let since_s = self.integrated_at.map_or(0.0, |at| now.duration_since(at).as_secs_f64());
        self.integrated_at = Some(now);
        let before_m_s = self.airspeed_m_s.unwrap_or(speed_m_s);
        let step_m_s = AIRSPEED_GAIN_PER_S * error_m_s * since_s.min(MAX_STEP_S);
        let steady_m_s = self.limits.airspeed_m_s(before_m_s + step_m_s);
        self.airspeed_m_s = Some(steady_m_s);
        let airspeed_m_s = self.limits.airspeed_m_s(steady_m_s + AIRSPEED_GAIN * error_m_s);
        let is_known = self.airspeed.is_some_and(|told| {
            let is_same = (told.value - airspeed_m_s).abs() < MIN_AIRSPEED_CHANGE_M_S;
            is_same || now.duration_since(told.at) < AIRSPEED_INTERVAL
        });
        if is_known {
            return None;
        }
        self.airspeed = Some(SentCommand { value: airspeed_m_s, at: now });
        let target = vehicle.identity.target();
        Some(CommandMessage::Long(COMMAND_LONG_DATA {
            command: MavCmd::MAV_CMD_DO_CHANGE_SPEED,
            // An airspeed; the throttle stays the autopilot's.
            param1: 0.0,
            param2: airspeed_m_s as f32,
            param3: -1.0,
            target_system: target[0],
            target_component: target[1],
            ..COMMAND_LONG_DATA::DEFAULT
        }))
    }

    fn altitude_command(
        &mut self,
        setpoint: &GeoSetpoint,
        vehicle: &VehicleView<'_>,
    ) -> Option<CommandMessage> {
        let is_near = vehicle.altitude_error_m.abs() < MIN_ALTITUDE_CHANGE_M;
        let is_told = self.altitude.is_some_and(|told| {
            told.value == setpoint.altitude && told.at.elapsed() < ALTITUDE_INTERVAL
        });
        if is_told || (is_near && self.altitude.is_some_and(|told| told.value == setpoint.altitude))
        {
            return None;
        }
        self.altitude = Some(SentCommand { value: setpoint.altitude, at: Instant::now() });
        let altitude = altitude_of(setpoint.altitude);
        let command = vehicle.identity.command(CHANGE_ALTITUDE, [0.0; 4]);
        let z = altitude.alt_m as f32;
        Some(CommandMessage::Int(CommandInt { z, frame: altitude.command_frame, ..command }))
    }
}

/// Returns the course over the ground that leads a fixed wing back to its reference, in radians counterclockwise from the
/// east.
fn course_rad(setpoint: &GeoSetpoint, deviation: &Deviation) -> f64 {
    let speed_m_s = setpoint.ground_speed_m_s.max(1.0);
    let turn_rate_rad_s = setpoint.turn_rate_rad_s;
    // Where the vehicle is abeam of the reference, on the turn that the reference flies now.
    let behind_s = -deviation.along_m / speed_m_s;
    let abeam = deviation.reference.step(speed_m_s, turn_rate_rad_s, behind_s);
    let heading_rad = abeam.heading_rad;
    // Positive if the reference is to the left.
    let cross_m = abeam.at[1] * cos(heading_rad) - abeam.at[0] * sin(heading_rad);
    let toward_rad = atan2(cross_m, speed_m_s * CROSS_TIME_S);
    heading_rad + turn_rate_rad_s * COURSE_TIME_S + toward_rad
}

/// An altitude as messages give it.
struct AltitudeInMessages {
    alt_m: f64,
    setpoint_frame: MavFrame,
    command_frame: u8,
}

// Their replacements are not known to the autopilots of today: PX4 refuses setpoints in them.
#[expect(deprecated, reason = "autopilots know the frames of setpoints by their old names alone")]
fn altitude_of(target: AltitudeTarget) -> AltitudeInMessages {
    match target {
        AltitudeTarget::Sea(alt_m) => AltitudeInMessages {
            alt_m,
            setpoint_frame: MavFrame::MAV_FRAME_GLOBAL_INT,
            command_frame: GLOBAL_FRAME,
        },
        AltitudeTarget::Home(alt_m) => AltitudeInMessages {
            alt_m,
            setpoint_frame: MavFrame::MAV_FRAME_GLOBAL_RELATIVE_ALT_INT,
            command_frame: HOME_FRAME,
        },
    }
}
