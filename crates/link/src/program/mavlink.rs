//! The aircraft of a node, where its autopilot speaks MAVLink.

use super::parent_monitor::ParentMonitor;
use crate::mavlink::{
    FlightLimits, GeoFrame, MavlinkEndpoint, MavlinkError, MavlinkOptions, MavlinkPlant, Origin,
    read_key,
};
use sidestep::kernel::InputError;
use sidestep::worlds::airspace::flight::{AircraftModel, Surface};
use sidestep_session::Error;
use sidestep_session::fleet::MavlinkSettings;
use std::time::Duration;

/// What may be asked of an aircraft beyond what its reference needs: to catch up, and against the wind.
const RESERVE: f64 = 1.5;

/// The smallest part of its speed that a fixed wing is asked for: in a tail wind its ground speed is that of the reference.
const MIN_AIRSPEED_PART: f64 = 0.7;

/// The smallest acceleration in meters per second squared that is allowed for by itself: airplanes that hardly turn have to
/// catch up, too.
const MIN_ACCELERATION_M_S2: f64 = 2.0;

/// The aircraft that is to be reached.
pub(super) struct MavlinkJob<'a> {
    pub(super) settings: &'a MavlinkSettings,
    /// The surface of the scenario.
    pub(super) surface: Surface,
    /// Its type in the scenario.
    pub(super) model: &'a AircraftModel,
    /// Whether frames may go without signatures on a network that others reach.
    pub(super) is_insecure: bool,
}

impl MavlinkJob<'_> {
    /// Connects to the aircraft, and waits for its heartbeat.
    ///
    /// # Errors
    /// When an option is wrong, the aircraft is not there, or cannot be led.
    pub(super) fn open(&self, parent: &ParentMonitor) -> Result<MavlinkPlant, Error> {
        let options = self.options()?;
        let plant = MavlinkPlant::connect_while(&options, &|| !parent.has_ended());
        if parent.has_ended() {
            return Err(Error::Interrupted);
        }
        plant.map_err(|error| self.error(&error))
    }

    fn options(&self) -> Result<MavlinkOptions, InputError> {
        let settings = self.settings;
        let endpoint = MavlinkEndpoint::parse(&settings.endpoint).map_err(|cause| {
            InputError::new(
                format!("--mavlink {}", settings.endpoint),
                cause,
                "see --help for its forms",
            )
        })?;
        Ok(MavlinkOptions {
            endpoint,
            system_id: settings.system_id,
            own_system_id: settings.own_system_id,
            key: self.key()?,
            is_insecure: self.is_insecure,
            geo: self.geo()?,
            takes_control: settings.takes_control,
            limits: self.limits(),
            patience: Duration::from_secs_f64(settings.patience_s),
        })
    }

    fn key(&self) -> Result<Option<[u8; 32]>, InputError> {
        let Some(file) = &self.settings.key_file else { return Ok(None) };
        let key = read_key(file).map_err(|cause| {
            let place = format!("--mavlink-key {}", file.display());
            InputError::new(place, cause, "give the file with the key that the autopilot has")
        })?;
        Ok(Some(key))
    }

    fn geo(&self) -> Result<GeoFrame, InputError> {
        let origin = self.settings.origin.as_deref().map(Origin::parse).transpose();
        let frame = origin.and_then(|origin| GeoFrame::new(self.surface, origin));
        frame.map_err(|cause| {
            let remedy = "give --origin LATITUDE,LONGITUDE,ALTITUDE for a scenario on a plane, and none for one on the earth";
            InputError::new("--origin", cause, remedy)
        })
    }

    fn limits(&self) -> FlightLimits {
        let speed_m_s = self.model.v_m_s;
        let turn_m_s2 = speed_m_s * self.model.omega_max_rad_s;
        let settings = self.settings;
        FlightLimits {
            max_speed_m_s: settings.max_speed_m_s.unwrap_or(RESERVE * speed_m_s),
            min_airspeed_m_s: MIN_AIRSPEED_PART * speed_m_s,
            max_acceleration_m_s2: settings
                .max_acceleration_m_s2
                .unwrap_or((RESERVE * turn_m_s2).max(MIN_ACCELERATION_M_S2)),
        }
    }

    fn error(&self, error: &MavlinkError) -> Error {
        let place = format!("--mavlink {}", self.settings.endpoint);
        let cause = error.to_string();
        match error {
            MavlinkError::Insecure(_) => {
                let remedy = "give --mavlink-key FILE with the key that the autopilot has, or, on a network that you \
                              trust, --insecure";
                InputError::new(place, cause, remedy).into()
            }
            MavlinkError::Several(_) => {
                InputError::new(place, cause, "give --system-id with one of them").into()
            }
            MavlinkError::Unsupported(_) => {
                InputError::new(place, cause, "see docs/src/mavlink.md for what can be led").into()
            }
            MavlinkError::Connection(_) | MavlinkError::NoVehicle(..) => {
                let remedy = "see whether the autopilot sends MAVLink 2 there, with the same key, and a ground station \
                              does not have the port; --patience waits longer";
                Error::other(format!("{place}: {cause}"), remedy)
            }
        }
    }
}
