//! Airplanes as a scenario gives them, and as their group knows them.

use super::motion::{AircraftModel, Point, Pose2};
use super::order::{FlightOrder, FlightTask};
use super::track::Track;
use sidestep_kernel::EntitySlot;

/// One airplane at its start.
#[derive(Debug, Clone, PartialEq)]
pub struct AirplaneStart {
    /// Its call sign; `None` where only its id identifies it.
    pub callsign: Option<String>,
    /// Its abilities, with the speed that it has until an order changes it.
    pub model: AircraftModel,
    /// The pose in which it appears.
    pub start: Pose2,
    /// Way-points in the order in which it has to reach them.
    pub mission: Vec<Point>,
    /// Altitude in meters of the level on which the method takes it over.
    pub altitude_m: f64,
    /// Time of its appearance, in seconds after the start of the run.
    pub appears_s: f64,
    /// Time at which it vanishes, in seconds after the start of the run; infinite for never.
    pub leaves_s: f64,
    /// Orders in flight, by rising time.
    pub orders: Vec<FlightOrder>,
    /// Its recorded track, which it follows until the method takes it over.
    pub track: Option<Track>,
    /// Whether it avoids nobody: it flies its recorded track to the end, or straight from way-point to way-point.
    pub is_non_cooperative: bool,
    /// Its priority: it has right of way over airplanes with a smaller one.
    pub priority: u8,
}

impl AirplaneStart {
    /// Returns whether it keeps a heading, and flies to no way-point, after its first `done` orders.
    pub(crate) fn has_fixed_heading(&self, done: usize) -> bool {
        let last_direction = self.orders.iter().take(done).rev().find(|order| {
            matches!(
                order.task,
                FlightTask::Heading(_) | FlightTask::Proceed | FlightTask::WayPoints(_)
            )
        });
        last_direction.is_some_and(|order| matches!(order.task, FlightTask::Heading(_)))
    }

    /// Returns the order after the first `done` ones, if its time has come.
    pub(crate) fn due_order(&self, done: usize, now_s: f64) -> Option<&FlightOrder> {
        self.orders.get(done).filter(|order| order.at_s <= now_s)
    }
}

/// An airplane of a group, as the group knows it.
#[derive(Debug, Clone, Copy)]
pub struct KnownAircraft {
    /// Slot of the airplane, which is its id.
    pub slot: EntitySlot,
    /// Its pose as all see it, with the error of the cycle.
    pub pose: Pose2,
    /// Number of way-points done with.
    pub next: usize,
    /// Number of orders carried out.
    pub orders: u32,
    /// Altitude in meters.
    pub altitude_m: f64,
}
