//! Airplanes as a scenario has them, and as their group knows them.

use super::motion::{Model, Point, Pose};
use super::order::{FlightOrder, Task};
use super::track::Track;
use sidestep_kernel::Slot;

/// One airplane as it begins.
#[derive(Debug, Clone, PartialEq)]
pub struct Airplane {
    /// Its abilities.
    pub model: Model,
    /// Its first pose.
    pub start: Pose,
    /// Way-points that it is to reach.
    pub mission: Vec<Point>,
    /// The level with which the method takes it over.
    pub altitude_m: f64,
    /// Time of its appearance, seconds after the start.
    pub appears_s: f64,
    /// Time at which it vanishes, seconds after the start; infinite for never.
    pub leaves_s: f64,
    /// Orders on its way, by rising time.
    pub orders: Vec<FlightOrder>,
    /// The way that it is recorded to have flown, and follows until it is handed over.
    pub track: Option<Track>,
}

impl Airplane {
    /// Whether its last order about where to fly leads to no way-point.
    pub(crate) fn keeps_a_heading(&self) -> bool {
        let is_about_the_way = |order: &&FlightOrder| {
            matches!(order.task, Task::Heading(_) | Task::Proceed | Task::WayPoints(_))
        };
        let last = self.orders.iter().rev().find(is_about_the_way);
        last.is_some_and(|order| matches!(order.task, Task::Heading(_)))
    }

    /// The order after the first `done` ones, if its time has come.
    pub(crate) fn due(&self, done: usize, now_s: f64) -> Option<&FlightOrder> {
        self.orders.get(done).filter(|order| order.at_s <= now_s)
    }
}

/// An airplane of a group, as the group knows it.
#[derive(Debug, Clone, Copy)]
pub struct Known {
    /// Which airplane.
    pub slot: Slot,
    /// Its assumed pose.
    pub pose: Pose,
    /// Way-points done with.
    pub next: usize,
    /// Orders carried out.
    pub orders: u32,
    /// Altitude.
    pub altitude_m: f64,
}
