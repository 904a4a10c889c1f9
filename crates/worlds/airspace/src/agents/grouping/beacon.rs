//! Beacons: messages of airplanes about themselves, before they know the others that they decide with.

use crate::agents::intent::Intent;
use crate::agents::participant::{InvalidMessage, are_valid_coordinates};
use crate::flight::{CommandLimits, KnownAircraft, MethodCommand, Pose2};
use crate::non_cooperative::NonCooperativeAircraft;
use crate::shield::{Fallback, OrbitSide};
use serde::{Deserialize, Serialize};
use sidestep_kernel::EntityId;

/// Bound on headings in messages, in radians: those of airplanes are within half a turn.
const MAX_HEADING_RAD: f64 = 1e6;

/// An airplane as others see it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(from = "WireReport", into = "WireReport")]
pub struct SurveillanceReport {
    /// Id of the airplane that is seen.
    pub id: EntityId,
    /// Its pose, with the error of the cycle.
    pub pose: Pose2,
    /// Altitude in meters.
    pub altitude_m: f64,
    /// The side to which it turns, if it is seen to be on its stored orbit.
    pub orbit: Option<OrbitSide>,
    /// What all know who have watched it from its start; none after a plan that only those know who have heard it, and
    /// where airplanes have no common plans.
    pub tracked: Option<TrackedState>,
    /// The level and the speed that its method commands and that are in force, as transponders send the selected altitude
    /// and the airspeed.
    pub command: MethodCommand,
}

/// A report as it is sent: without a command it takes no byte more than it would if there were none.
#[derive(Serialize, Deserialize)]
struct WireReport {
    id: EntityId,
    pose: Pose2,
    altitude_m: f64,
    orbit: Option<OrbitSide>,
    more: WireReportEnd,
}

/// What not every report has.
#[derive(Serialize, Deserialize)]
enum WireReportEnd {
    None,
    Tracked(TrackedState),
    Command(MethodCommand),
    TrackedCommand(TrackedState, MethodCommand),
}

impl From<SurveillanceReport> for WireReport {
    fn from(report: SurveillanceReport) -> Self {
        let SurveillanceReport { id, pose, altitude_m, orbit, tracked, command } = report;
        let more = match tracked {
            None if command.is_none() => WireReportEnd::None,
            None => WireReportEnd::Command(command),
            Some(tracked) if command.is_none() => WireReportEnd::Tracked(tracked),
            Some(tracked) => WireReportEnd::TrackedCommand(tracked, command),
        };
        Self { id, pose, altitude_m, orbit, more }
    }
}

impl From<WireReport> for SurveillanceReport {
    fn from(WireReport { id, pose, altitude_m, orbit, more }: WireReport) -> Self {
        let tracked = match more {
            WireReportEnd::Tracked(tracked) | WireReportEnd::TrackedCommand(tracked, _) => {
                Some(tracked)
            }
            WireReportEnd::None | WireReportEnd::Command(_) => None,
        };
        let command = match more {
            WireReportEnd::Command(command) | WireReportEnd::TrackedCommand(_, command) => command,
            WireReportEnd::None | WireReportEnd::Tracked(_) => MethodCommand::NONE,
        };
        Self { id, pose, altitude_m, orbit, tracked, command }
    }
}

/// The part of an airplane's state that follows from its flight up to now and from its filed flight.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct TrackedState {
    /// Number of way-points done with.
    pub next: u32,
    /// Its stored fallback.
    pub fallback: Fallback,
}

impl SurveillanceReport {
    /// Returns the knowledge of it before it has sent anything: its filed flight, where it is seen.
    pub(crate) fn as_known_aircraft(&self) -> KnownAircraft {
        let &Self { id, pose, altitude_m, command, .. } = self;
        KnownAircraft { slot: id, pose, next: 0, orders: 0, altitude_m, command }
    }

    /// Returns the knowledge of it of those that have watched its flight.
    pub(crate) fn as_tracked_aircraft(&self) -> KnownAircraft {
        let next = self.tracked.map_or(0, |tracked| tracked.next as usize);
        KnownAircraft { next, ..self.as_known_aircraft() }
    }

    /// Returns the knowledge of it once it has sent its intentions.
    pub(crate) fn with_intent(&self, intent: &Intent) -> KnownAircraft {
        let &Intent { next, orders, altitude_m, .. } = intent;
        KnownAircraft {
            slot: self.id,
            pose: self.pose,
            next: next as usize,
            orders,
            altitude_m,
            command: self.command,
        }
    }
}

/// A message by which an airplane makes itself known.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Beacon {
    /// The sender, as all see it.
    pub own: SurveillanceReport,
    /// Ids of those that it sees near it, rising.
    pub near: Vec<EntityId>,
    /// Non-cooperative airplanes near it, by rising id.
    pub non_cooperative: Vec<NonCooperativeAircraft>,
}

/// A piece of knowledge about an airplane.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum GroupingMessageItem {
    /// What it says of itself; others relay it.
    Beacon(Beacon),
    /// What it has heard: sent once, when it expects no further beacon.
    Report {
        /// Id of the airplane that reports.
        about: EntityId,
        /// Ids of those near it that have sent it their beacons themselves, rising.
        heard: Vec<EntityId>,
    },
}

impl GroupingMessageItem {
    /// Returns the airplane that it is about.
    pub(super) fn subject_id(&self) -> EntityId {
        match self {
            Self::Beacon(beacon) => beacon.own.id,
            Self::Report { about, .. } => *about,
        }
    }

    /// Checks its content, in a world of `airplanes` airplanes for which commands within some limits may be in force.
    pub(super) fn check(
        &self,
        airplanes: usize,
        limits: &[CommandLimits],
    ) -> Result<(), InvalidMessage> {
        let list = match self {
            Self::Beacon(beacon) => &beacon.near,
            Self::Report { heard, .. } => heard,
        };
        let is_known = |id: EntityId| (id as usize) < airplanes;
        let is_ascending = list.windows(2).all(|pair| pair[0] < pair[1]);
        let are_others = list.iter().all(|&id| is_known(id) && id != self.subject_id());
        InvalidMessage::Airplane
            .ensure(is_known(self.subject_id()) && is_ascending && are_others)?;
        match self {
            Self::Beacon(beacon) => beacon.check(airplanes, limits),
            Self::Report { .. } => Ok(()),
        }
    }
}

impl Beacon {
    fn check(&self, airplanes: usize, limits: &[CommandLimits]) -> Result<(), InvalidMessage> {
        let SurveillanceReport { id, pose, altitude_m, command, .. } = self.own;
        let Pose2 { at: [x, y], heading_rad } = pose;
        InvalidMessage::Plan.ensure(CommandLimits::allow(limits, id, &command))?;
        InvalidMessage::Number.ensure(heading_rad.abs() < MAX_HEADING_RAD)?;
        InvalidMessage::Number.ensure(are_valid_coordinates([x, y, altitude_m]))?;
        let is_ascending = self.non_cooperative.windows(2).all(|pair| pair[0].slot < pair[1].slot);
        let are_known = self.non_cooperative.iter().all(|one| (one.slot as usize) < airplanes);
        InvalidMessage::Airplane.ensure(is_ascending && are_known)?;
        InvalidMessage::Number
            .ensure(self.non_cooperative.iter().all(NonCooperativeAircraft::is_valid))
    }
}

/// Returns the largest number of bytes of an item in a world of `airplanes` airplanes.
pub(super) fn max_item_bytes(airplanes: usize) -> usize {
    // For each other airplane its id of at most 5 bytes, and perhaps its observed flight of at most 96; a command of its own
    // of at most 27.
    96 + airplanes * (5 + 96)
}
