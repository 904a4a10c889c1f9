//! Stages of a flight: what an airplane flies between two of its orders.

use super::airplane::Airplane;
use super::motion::{Model, Point};
use super::order::Task;
use sidestep_kernel::math;

/// Where an airplane that keeps a heading steers for: so far ahead that the bearing is the
/// heading wherever it is.
const FAR_AHEAD_M: f64 = 1e12;

/// The part of a flight between two orders.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Stage<'a> {
    pub(crate) model: &'a Model,
    pub(crate) mission: &'a [Point],
    /// The level it keeps or changes to,
    pub(crate) altitude_m: f64,
    /// and how fast.
    pub(crate) climb_m_s: f64,
}

/// The part of a flight from an order on.
#[derive(Debug, Clone)]
pub(crate) struct Later {
    model: Model,
    mission: Vec<Point>,
    altitude_m: f64,
    climb_m_s: f64,
    /// Way-points done with when this begins, if not as many as before.
    pub(crate) next: Option<u32>,
}

impl Later {
    pub(crate) fn stage(&self) -> Stage<'_> {
        let Self { model, mission, altitude_m, climb_m_s, .. } = self;
        Stage { model, mission, altitude_m: *altitude_m, climb_m_s: *climb_m_s }
    }
}

/// Returns the parts of a flight after each of its orders.
pub(crate) fn later(airplane: &Airplane) -> Vec<Later> {
    let mut route = airplane.mission.clone();
    let mut now = Later {
        model: airplane.model.clone(),
        mission: route.clone(),
        altitude_m: airplane.altitude_m,
        climb_m_s: 0.0,
        next: None,
    };
    let mut all = Vec::with_capacity(airplane.orders.len());
    for order in &airplane.orders {
        now.next = None;
        match &order.task {
            Task::Heading(heading_rad) => {
                let ahead =
                    [FAR_AHEAD_M * math::cos(*heading_rad), FAR_AHEAD_M * math::sin(*heading_rad)];
                // As many as on the route, so that the number of those done with still holds.
                now.mission = vec![ahead; route.len()];
            }
            Task::Speed(v_m_s) => now.model.v_m_s = *v_m_s,
            Task::Altitude { altitude_m, climb_m_s } => {
                (now.altitude_m, now.climb_m_s) = (*altitude_m, *climb_m_s);
            }
            Task::Proceed => now.mission.clone_from(&route),
            Task::WayPoints(way_points) => {
                route.clone_from(way_points);
                now.mission.clone_from(way_points);
                now.next = Some(0);
            }
        }
        all.push(now.clone());
    }
    all
}
