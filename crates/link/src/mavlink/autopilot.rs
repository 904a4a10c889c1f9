//! Kinds of vehicles, their modes, and who is in control.

use super::messages::CommandInt;
use crate::plant::aircraft::Authority;
use ::mavlink::dialects::common::{
    HEARTBEAT_DATA, MavAutopilot, MavLandedState, MavModeFlag, MavState, MavType,
};

/// The component of a vehicle that is its autopilot.
pub(super) const AUTOPILOT_COMPONENT: u8 = 1;

/// `MAV_CMD_NAV_LOITER_UNLIM`.
pub(super) const LOITER: u16 = 17;
/// `MAV_CMD_DO_SET_MODE`.
pub(super) const SET_MODE: u16 = 176;
/// `MAV_CMD_DO_REPOSITION`.
pub(super) const REPOSITION: u16 = 192;
/// `MAV_CMD_SET_MESSAGE_INTERVAL`.
pub(super) const SET_MESSAGE_INTERVAL: u16 = 511;
/// `MAV_CMD_GUIDED_CHANGE_ALTITUDE` of ArduPilot.
pub(super) const CHANGE_ALTITUDE: u16 = 43001;
/// `MAV_CMD_GUIDED_CHANGE_HEADING` of ArduPilot.
pub(super) const CHANGE_HEADING: u16 = 43002;

/// The program of an autopilot.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Firmware {
    /// ArduPilot.
    ArduPilot,
    /// PX4.
    Px4,
}

/// How a vehicle flies.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum VehicleKind {
    /// It can stand in the air and move in any direction.
    Multirotor,
    /// It has to fly forward.
    FixedWing,
}

/// A vehicle that was found by its heartbeat.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Identity {
    pub system: u8,
    pub firmware: Firmware,
    pub kind: VehicleKind,
}

/// A mode of an autopilot, as it is asked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Mode {
    pub name: &'static str,
    pub main: u8,
    pub sub: u8,
}

/// A way to let a vehicle hold.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum HoldOrder {
    /// By a mode.
    Mode(Mode),
    /// By `MAV_CMD_NAV_LOITER_UNLIM`.
    Loiter,
    /// By `MAV_CMD_DO_REPOSITION` to where it is.
    StayHere,
}

const COPTER_GUIDED: Mode = Mode { name: "GUIDED", main: 4, sub: 0 };
const COPTER_BRAKE: Mode = Mode { name: "BRAKE", main: 17, sub: 0 };
const PLANE_GUIDED: Mode = Mode { name: "GUIDED", main: 15, sub: 0 };
const PLANE_LOITER: Mode = Mode { name: "LOITER", main: 12, sub: 0 };
const PX4_OFFBOARD: Mode = Mode { name: "OFFBOARD", main: 6, sub: 0 };
const PX4_LOITER: Mode = Mode { name: "AUTO.LOITER", main: 4, sub: 3 };

/// Returns whether a heartbeat is of an autopilot, and not of a ground station, a camera or another box aboard.
pub(super) fn is_autopilot(component: u8, heartbeat: &HEARTBEAT_DATA) -> bool {
    component == AUTOPILOT_COMPONENT && heartbeat.autopilot != MavAutopilot::MAV_AUTOPILOT_INVALID
}

impl Identity {
    /// Returns the vehicle of a heartbeat.
    ///
    /// # Errors
    /// When it is of a kind that cannot be led.
    pub(super) fn new(system: u8, heartbeat: &HEARTBEAT_DATA) -> Result<Self, String> {
        let firmware = match heartbeat.autopilot {
            MavAutopilot::MAV_AUTOPILOT_ARDUPILOTMEGA => Firmware::ArduPilot,
            MavAutopilot::MAV_AUTOPILOT_PX4 => Firmware::Px4,
            other => {
                return Err(format!("system {system} is a {other:?}; ArduPilot and PX4 are known"));
            }
        };
        let kind = match heartbeat.mavtype {
            MavType::MAV_TYPE_QUADROTOR
            | MavType::MAV_TYPE_COAXIAL
            | MavType::MAV_TYPE_HELICOPTER
            | MavType::MAV_TYPE_HEXAROTOR
            | MavType::MAV_TYPE_OCTOROTOR
            | MavType::MAV_TYPE_TRICOPTER
            | MavType::MAV_TYPE_DODECAROTOR
            | MavType::MAV_TYPE_DECAROTOR
            | MavType::MAV_TYPE_GENERIC_MULTIROTOR => VehicleKind::Multirotor,
            MavType::MAV_TYPE_FIXED_WING => VehicleKind::FixedWing,
            other => {
                return Err(format!(
                    "system {system} is a {other:?}; multirotors, helicopters and fixed wings are known"
                ));
            }
        };
        Ok(Self { system, firmware, kind })
    }

    /// Returns the mode in which the vehicle follows setpoints.
    pub(super) fn node_mode(self) -> Mode {
        match (self.firmware, self.kind) {
            (Firmware::ArduPilot, VehicleKind::Multirotor) => COPTER_GUIDED,
            (Firmware::ArduPilot, VehicleKind::FixedWing) => PLANE_GUIDED,
            (Firmware::Px4, _) => PX4_OFFBOARD,
        }
    }

    /// Returns how the vehicle is brought to hold, what is tried first being first.
    ///
    /// BRAKE before LOITER: the latter obeys the sticks of a remote control, which need not be there.
    pub(super) fn hold_orders(self) -> [HoldOrder; 2] {
        match (self.firmware, self.kind) {
            (Firmware::ArduPilot, VehicleKind::Multirotor) => {
                [HoldOrder::Mode(COPTER_BRAKE), HoldOrder::Loiter]
            }
            (Firmware::ArduPilot, VehicleKind::FixedWing) => {
                [HoldOrder::Mode(PLANE_LOITER), HoldOrder::Loiter]
            }
            (Firmware::Px4, _) => [HoldOrder::Mode(PX4_LOITER), HoldOrder::StayHere],
        }
    }

    /// Returns whether a heartbeat tells a mode.
    pub(super) fn is_in(self, mode: Mode, custom_mode: u32) -> bool {
        match self.firmware {
            Firmware::ArduPilot => custom_mode == u32::from(mode.main),
            Firmware::Px4 => {
                let bytes = custom_mode.to_le_bytes();
                bytes[2] == mode.main && bytes[3] == mode.sub
            }
        }
    }

    /// Returns who is in control, by a heartbeat and what the vehicle tells of the ground.
    pub(super) fn authority(
        self,
        heartbeat: &HEARTBEAT_DATA,
        landed: Option<MavLandedState>,
    ) -> Authority {
        let is_armed = heartbeat.base_mode.contains(MavModeFlag::MAV_MODE_FLAG_SAFETY_ARMED);
        let is_on_ground = match landed {
            Some(MavLandedState::MAV_LANDED_STATE_ON_GROUND) => true,
            Some(MavLandedState::MAV_LANDED_STATE_UNDEFINED) | None => {
                heartbeat.system_status == MavState::MAV_STATE_STANDBY
            }
            Some(_) => false,
        };
        if !is_armed || is_on_ground {
            return Authority::Ground;
        }
        if self.is_in(self.node_mode(), heartbeat.custom_mode) {
            Authority::Node
        } else {
            Authority::Vehicle
        }
    }

    /// Returns system and component of the autopilot.
    pub(super) fn target(self) -> [u8; 2] {
        [self.system, AUTOPILOT_COMPONENT]
    }

    /// Returns a command without a place.
    pub(super) fn command(self, command: u16, params: [f32; 4]) -> CommandInt {
        let target = self.target();
        CommandInt { command, params, place: [0, 0], z: 0.0, frame: GLOBAL_FRAME, target }
    }
}

/// The frame of altitudes above mean sea level: `MAV_FRAME_GLOBAL`.
pub(super) const GLOBAL_FRAME: u8 = 0;
/// The frame of altitudes above the home of a vehicle: `MAV_FRAME_GLOBAL_RELATIVE_ALT`.
pub(super) const HOME_FRAME: u8 = 3;

#[cfg(test)]
mod tests {
    use super::*;

    fn heartbeat(custom_mode: u32, mavtype: MavType, autopilot: MavAutopilot) -> HEARTBEAT_DATA {
        HEARTBEAT_DATA {
            custom_mode,
            mavtype,
            autopilot,
            base_mode: MavModeFlag::MAV_MODE_FLAG_SAFETY_ARMED,
            system_status: MavState::MAV_STATE_ACTIVE,
            mavlink_version: 3,
        }
    }

    #[test]
    fn a_vehicle_obeys_its_node_in_one_mode_in_the_air_alone() {
        let quad = MavType::MAV_TYPE_QUADROTOR;
        let wing = MavType::MAV_TYPE_FIXED_WING;
        let ardupilot = MavAutopilot::MAV_AUTOPILOT_ARDUPILOTMEGA;
        let px4 = MavAutopilot::MAV_AUTOPILOT_PX4;
        for (custom_mode, mavtype, autopilot, expected) in [
            (4, quad, ardupilot, Authority::Node),
            (5, quad, ardupilot, Authority::Vehicle),
            (15, quad, ardupilot, Authority::Vehicle),
            (15, wing, ardupilot, Authority::Node),
            (6 << 16, quad, px4, Authority::Node),
            (6 << 16, wing, px4, Authority::Node),
            (4 << 16 | 3 << 24, quad, px4, Authority::Vehicle),
        ] {
            let mut told = heartbeat(custom_mode, mavtype, autopilot);
            let identity = Identity::new(1, &told).expect("a kind that is known");
            assert_eq!(identity.authority(&told, None), expected, "{told:?}");
            let ground = Some(MavLandedState::MAV_LANDED_STATE_ON_GROUND);
            assert_eq!(identity.authority(&told, ground), Authority::Ground);
            told.system_status = MavState::MAV_STATE_STANDBY;
            assert_eq!(identity.authority(&told, None), Authority::Ground);
            let air = Some(MavLandedState::MAV_LANDED_STATE_IN_AIR);
            assert_eq!(identity.authority(&told, air), expected);
            told.base_mode = MavModeFlag::empty();
            assert_eq!(identity.authority(&told, air), Authority::Ground);
        }
    }

    #[test]
    fn vehicles_that_cannot_be_led_are_refused_by_name() {
        let rover = heartbeat(0, MavType::MAV_TYPE_GROUND_ROVER, MavAutopilot::MAV_AUTOPILOT_PX4);
        let error = Identity::new(3, &rover).expect_err("it drives");
        assert!(error.contains("system 3") && error.contains("GROUND_ROVER"), "{error}");
        let other = heartbeat(0, MavType::MAV_TYPE_QUADROTOR, MavAutopilot::MAV_AUTOPILOT_PPZ);
        assert!(Identity::new(3, &other).is_err());
    }
}
