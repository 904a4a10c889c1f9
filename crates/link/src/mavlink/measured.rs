//! What a vehicle has told of itself.

use super::autopilot::Identity;
use super::clock::{ClockUpdate, VehicleClock};
use super::coordinates::{GeoFrame, GeoPose, VehicleAltitude, heading_rad, place_of_units};
use super::counts::MavlinkCounts;
use crate::plant::aircraft::{AircraftState, Authority};
use ::mavlink::dialects::common::{GLOBAL_POSITION_INT_DATA, HEARTBEAT_DATA, MavLandedState};
use sidestep::kernel::math::{atan2, hypot};
use std::time::{Duration, Instant};

/// Time without a heartbeat from which on what is known grows old: three are missing.
const HEARTBEAT_PATIENCE: Duration = Duration::from_millis(3500);

/// Speed below which the motion of a vehicle has no direction, in meters per second: noise of its receiver.
const MIN_TRACK_SPEED_M_S: f64 = 0.5;

/// `hdg` of a vehicle that does not know where its nose points.
const UNKNOWN_HEADING: u16 = u16::MAX;

/// A position, and what belongs to it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Fix {
    /// Longitude and latitude in radians.
    pub at: [f64; 2],
    /// The altitude.
    pub altitude: VehicleAltitude,
    /// Velocity over the ground in meters per second, to the east and to the north.
    pub velocity_m_s: [f64; 2],
    /// Where the nose points, in radians counterclockwise from the east; none if the vehicle does not say so.
    pub nose_rad: Option<f64>,
}

/// All that is known of a vehicle.
#[derive(Debug)]
pub(super) struct Measured {
    pub clock: VehicleClock,
    pub fix: Option<Fix>,
    heartbeat: Option<HEARTBEAT_DATA>,
    heartbeat_at: Instant,
    is_silent: bool,
    landed: Option<MavLandedState>,
    /// The yaw of the last `ATTITUDE`, in radians counterclockwise from the east.
    yaw_rad: Option<f64>,
}

impl Fix {
    fn new(content: &GLOBAL_POSITION_INT_DATA) -> Option<Self> {
        let at = place_of_units([content.lat, content.lon])?;
        let altitude = VehicleAltitude {
            sea_m: f64::from(content.alt) / 1000.0,
            home_m: f64::from(content.relative_alt) / 1000.0,
        };
        // North comes first in MAVLink, and centimeters.
        let velocity_m_s = [content.vy, content.vx].map(|cm_s| f64::from(cm_s) / 100.0);
        let nose_rad = (content.hdg != UNKNOWN_HEADING)
            .then(|| heading_rad((f64::from(content.hdg) / 100.0).to_radians()));
        Some(Self { at, altitude, velocity_m_s, nose_rad })
    }

    /// Returns its speed over the ground in meters per second.
    pub(super) fn ground_speed_m_s(&self) -> f64 {
        let [east, north] = self.velocity_m_s;
        hypot(east, north)
    }
}

impl Measured {
    /// Returns what is known after the first heartbeat.
    pub(super) fn new(heartbeat: HEARTBEAT_DATA) -> Self {
        let now = Instant::now();
        Self {
            clock: VehicleClock::new(now),
            fix: None,
            heartbeat: Some(heartbeat),
            heartbeat_at: now,
            is_silent: false,
            landed: None,
            yaw_rad: None,
        }
    }

    /// Takes note of a heartbeat. Returns whether it tells another state than the one before.
    pub(super) fn on_heartbeat(&mut self, heartbeat: HEARTBEAT_DATA) -> bool {
        let is_news = self.is_silent || self.heartbeat.as_ref() != Some(&heartbeat);
        self.heartbeat = Some(heartbeat);
        self.heartbeat_at = Instant::now();
        self.is_silent = false;
        is_news
    }

    /// Takes note of a state of the ground. Returns whether it is another one.
    pub(super) fn on_landed_state(&mut self, landed: MavLandedState) -> bool {
        let is_news = self.landed != Some(landed);
        self.landed = Some(landed);
        is_news
    }

    /// Takes note of the yaw of the nose, in radians clockwise from the north.
    pub(super) fn on_yaw(&mut self, yaw_rad: f64) {
        self.yaw_rad = yaw_rad.is_finite().then(|| heading_rad(yaw_rad));
    }

    /// Takes note of a position. Returns whether it is used, and whether the vehicle has booted before it.
    pub(super) fn on_position(
        &mut self,
        content: &GLOBAL_POSITION_INT_DATA,
        counts: &mut MavlinkCounts,
    ) -> PositionUse {
        let Some(fix) = Fix::new(content) else {
            counts.bad_positions += 1;
            return PositionUse::Dropped;
        };
        match self.clock.update(content.time_boot_ms, Instant::now()) {
            ClockUpdate::Newer => {
                self.fix = Some(fix);
                PositionUse::Kept
            }
            ClockUpdate::Old | ClockUpdate::Doubtful => {
                counts.bad_positions += 1;
                PositionUse::Dropped
            }
            ClockUpdate::Jumped => {
                counts.clock_jumps += 1;
                self.fix = Some(fix);
                PositionUse::Kept
            }
            ClockUpdate::Rebooted => {
                counts.reboots += 1;
                self.fix = Some(fix);
                // What was told before the boot holds no longer.
                self.landed = None;
                self.yaw_rad = None;
                PositionUse::AfterBoot
            }
        }
    }

    /// Takes note of the time. Returns whether heartbeats have just stopped.
    pub(super) fn on_time(&mut self) -> bool {
        let is_silent = self.silence() > HEARTBEAT_PATIENCE;
        let is_news = is_silent && !self.is_silent;
        self.is_silent = is_silent;
        is_news
    }

    /// Returns the time since the last heartbeat.
    pub(super) fn silence(&self) -> Duration {
        self.heartbeat_at.elapsed()
    }

    /// Returns who is in control, as the last heartbeat says.
    pub(super) fn authority(&self, identity: Identity) -> Authority {
        let heartbeat = self.heartbeat.as_ref();
        heartbeat.map_or(Authority::Vehicle, |heartbeat| identity.authority(heartbeat, self.landed))
    }

    /// Returns where the vehicle is and where it moves on the earth; one that stands moves where its nose points.
    pub(super) fn pose(&self) -> Option<GeoPose> {
        let fix = self.fix.as_ref()?;
        let [east, north] = fix.velocity_m_s;
        let track_rad = atan2(north, east);
        let nose_rad = self.yaw_rad.or(fix.nose_rad).unwrap_or(track_rad);
        let is_moving = fix.ground_speed_m_s() >= MIN_TRACK_SPEED_M_S;
        let direction_rad = if is_moving { track_rad } else { nose_rad };
        Some(GeoPose { at: fix.at, heading_rad: direction_rad })
    }

    /// Returns the age of what is known in seconds. Without heartbeats nobody knows who is in control, so that they make it old,
    /// too.
    pub(super) fn age_s(&self) -> f64 {
        let silence = self.silence().saturating_sub(HEARTBEAT_PATIENCE);
        self.clock.age_s(Instant::now()).max(silence.as_secs_f64())
    }

    /// Returns the state in the scenario's coordinates; none before the first position.
    pub(super) fn state(&self, identity: Identity, geo: GeoFrame) -> Option<AircraftState> {
        let fix = self.fix.as_ref()?;
        Some(AircraftState {
            pose: geo.to_scenario(self.pose()?),
            altitude_m: geo.altitude_m(fix.altitude),
            ground_speed_m_s: fix.ground_speed_m_s(),
            age_s: self.age_s(),
            authority: self.authority(identity),
        })
    }
}

/// What has become of a position.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum PositionUse {
    /// It is the newest.
    Kept,
    /// It is the first after a boot.
    AfterBoot,
    /// It was dropped.
    Dropped,
}
