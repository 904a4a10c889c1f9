//! Segments of a flight: the flight between two orders.

use super::airplane::AirplaneStart;
use super::change::FiledLevelSpeed;
use super::command::MethodCommand;
use super::levels::FlightLevelRange;
use super::motion::{AircraftModel, Point};
use super::order::FlightTask;
use super::performance::Performance;
use super::surface::FAR_AHEAD_M;
use sidestep_kernel::math;
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::sync::Arc;

/// The part of a flight between two orders.
#[derive(Debug, Clone)]
pub(crate) struct InterOrderSegment<'a> {
    /// Its abilities; those of a commanded speed are of no order, and owned.
    pub(crate) model: Cow<'a, AircraftModel>,
    pub(crate) mission: &'a [Point],
    /// Altitude in meters of the level that it keeps or changes to.
    pub(crate) altitude_m: f64,
    /// Rate of that change upward, in meters per second.
    pub(crate) climb_m_s: f64,
    /// Rate of that change downward, in meters per second.
    pub(crate) descent_m_s: f64,
}

impl InterOrderSegment<'_> {
    /// Returns the altitude in meters that it has some seconds after `altitude_m`, if nothing holds it.
    pub(crate) fn altitude_after_m(&self, altitude_m: f64, seconds: f64) -> f64 {
        let max_climb_m = self.climb_m_s * seconds;
        let max_descent_m = self.descent_m_s * seconds;
        altitude_m + (self.altitude_m - altitude_m).clamp(-max_descent_m, max_climb_m)
    }

    /// Returns the rate in meters per second at which it changes its level from an altitude in meters.
    pub(crate) fn vertical_m_s(&self, altitude_m: f64) -> f64 {
        if self.altitude_m > altitude_m { self.climb_m_s } else { self.descent_m_s }
    }

    /// Returns the rate in meters per second at which it climbs from an altitude in meters, negative downward; 0 on its
    /// level.
    pub(crate) fn signed_climb_m_s(&self, altitude_m: f64) -> f64 {
        if altitude_m == self.altitude_m {
            0.0
        } else if self.altitude_m > altitude_m {
            self.climb_m_s
        } else {
            -self.descent_m_s
        }
    }

    /// Returns the same part of the flight with a command in force over it.
    #[must_use]
    pub(crate) fn with_command(
        mut self,
        command: &MethodCommand,
        performance: &Performance,
    ) -> Self {
        if let Some(level) = command.level {
            self.altitude_m = level.altitude_m;
            self.climb_m_s = level.vertical_m_s.min(performance.climb_max_m_s);
            self.descent_m_s = level.vertical_m_s.min(performance.descent_max_m_s);
        }
        if let Some(v_m_s) = command.v_m_s {
            let omega_max_rad_s = performance.turn.omega_rad_s(v_m_s);
            self.model =
                Cow::Owned(AircraftModel { v_m_s, omega_max_rad_s, ..self.model.into_owned() });
        }
        self
    }

    /// Returns the levels that it is on in some seconds after `altitude_m`, if nothing holds it.
    pub(crate) fn levels_within(&self, altitude_m: f64, seconds: f64) -> FlightLevelRange {
        FlightLevelRange::between(altitude_m, self.altitude_after_m(altitude_m, seconds))
    }
}

impl From<&InterOrderSegment<'_>> for FiledLevelSpeed {
    fn from(segment: &InterOrderSegment<'_>) -> Self {
        let &InterOrderSegment { altitude_m, climb_m_s, descent_m_s, ref model, .. } = segment;
        Self { altitude_m, climb_m_s, descent_m_s, v_m_s: model.v_m_s }
    }
}

/// The part of a flight from an order on, in which this order and all before it hold.
#[derive(Debug, Clone)]
pub(crate) struct SegmentAfterOrder {
    model: AircraftModel,
    mission: Arc<[Point]>,
    altitude_m: f64,
    climb_m_s: f64,
    descent_m_s: f64,
    /// Number of way-points done with when it starts, if not as many as before.
    pub(crate) next: Option<u32>,
}

impl SegmentAfterOrder {
    pub(crate) fn segment(&self) -> InterOrderSegment<'_> {
        let Self { model, mission, altitude_m, climb_m_s, descent_m_s, .. } = self;
        InterOrderSegment {
            model: Cow::Borrowed(model),
            mission,
            altitude_m: *altitude_m,
            climb_m_s: *climb_m_s,
            descent_m_s: *descent_m_s,
        }
    }
}

/// Returns the segments of a flight after each of its orders. Segments along the same route share its way-points,
/// because there may be ten thousand of each.
pub(crate) fn segments_after_orders(airplane: &AirplaneStart) -> Vec<SegmentAfterOrder> {
    let mut route: Arc<[Point]> = airplane.mission.as_slice().into();
    let mut straight_routes = BTreeMap::new();
    let mut segment = SegmentAfterOrder {
        model: airplane.model.clone(),
        mission: Arc::clone(&route),
        altitude_m: airplane.altitude_m,
        climb_m_s: 0.0,
        descent_m_s: 0.0,
        next: None,
    };
    let mut all = Vec::with_capacity(airplane.orders.len());
    for order in &airplane.orders {
        segment.next = None;
        match &order.task {
            FlightTask::Heading(heading_rad) => {
                // As many as on the route, so that the number of those done with stays valid.
                let key = (heading_rad.to_bits(), route.len());
                let straight = straight_routes
                    .entry(key)
                    .or_insert_with(|| route_along_heading(*heading_rad, route.len()));
                segment.mission = Arc::clone(straight);
            }
            FlightTask::Speed(v_m_s) | FlightTask::Acceleration(v_m_s) => {
                segment.model.v_m_s = *v_m_s;
                segment.model.omega_max_rad_s = airplane.performance.turn.omega_rad_s(*v_m_s);
            }
            FlightTask::Altitude { altitude_m, climb_m_s } => {
                segment.altitude_m = *altitude_m;
                // An order may find it above the level that it is to climb to, if others held it on its way.
                segment.climb_m_s = climb_m_s.min(airplane.performance.climb_max_m_s);
                segment.descent_m_s = climb_m_s.min(airplane.performance.descent_max_m_s);
            }
            FlightTask::Proceed => segment.mission = Arc::clone(&route),
            FlightTask::WayPoints(way_points) => {
                route = way_points.as_slice().into();
                segment.mission = Arc::clone(&route);
                segment.next = Some(0);
            }
        }
        all.push(segment.clone());
    }
    all
}

/// Returns way-points that lead along a heading forever.
fn route_along_heading(heading_rad: f64, way_points: usize) -> Arc<[Point]> {
    let far = [FAR_AHEAD_M * math::cos(heading_rad), FAR_AHEAD_M * math::sin(heading_rad)];
    vec![far; way_points].into()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenario::CompiledAirspace;
    use sidestep_scenario::Source;

    #[test]
    fn orders_after_which_an_airplane_flies_the_same_way_share_its_way_points() {
        let text = "format = 1\nworld = \"airspace\"\n[[airplanes]]\nat_m = [0, 0]\nheading_deg = 0\n\
                    way_points_m = [[9000, 0], [18000, 0]]\norders = [\n\
                    { at_s = 1, speed_m_s = 30 }, { at_s = 2, altitude_m = 90 }, { at_s = 3, heading_deg = 9 },\n\
                    { at_s = 4, speed_m_s = 31 }, { at_s = 5, proceeds = true }, { at_s = 6, heading_deg = 9 },\n\
                    { at_s = 7, way_points_m = [[0, 9000]] }, { at_s = 8, speed_m_s = 32 }]\n";
        let world = CompiledAirspace::new(&Source::new("o", text, "")).expect("a scenario").world;
        let all = segments_after_orders(&world.airplanes[0]);
        let is_shared = |a: usize, b: usize| Arc::ptr_eq(&all[a].mission, &all[b].mission);
        assert!([(0, 1), (0, 4), (2, 3), (2, 5), (6, 7)].into_iter().all(|(a, b)| is_shared(a, b)));
        let counts: Vec<usize> = all.iter().map(|one| one.mission.len()).collect();
        assert_eq!(counts, [2, 2, 2, 2, 2, 2, 1, 1]);
        assert_eq!(all.iter().map(|one| one.next).collect::<Vec<_>>()[5..], [None, Some(0), None]);
        assert_ne!(all[2].mission[0], all[0].mission[0]);
    }
}
