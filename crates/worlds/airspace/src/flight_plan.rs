//! The text of one airplane of a scenario: where it begins, its way-points, its recorded track,
//! and its orders.

use super::flight::{FlightOrder, MAX_ORDERS, Point, Task, Track, TrackPoint};
use serde::Deserialize;
use sidestep_kernel::{InputError, math};
use sidestep_scenario::Source;
use toml::Spanned;

/// How fast levels are changed when an order does not say it: 1500 ft/min.
pub(super) const CLIMB_M_S: f64 = 7.62;
/// No position, height or time is beyond this.
const MOST: f64 = 1e9;

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct AirplaneSection {
    pub(super) at_m: Option<Point>,
    pub(super) heading_deg: Option<f64>,
    pub(super) way_points_m: Option<Vec<Point>>,
    pub(super) altitude_m: Option<f64>,
    pub(super) appears_s: Option<f64>,
    pub(super) track: Option<Spanned<Vec<[f64; 4]>>>,
    #[serde(default)]
    pub(super) orders: Vec<Spanned<OrderSection>>,
    pub(super) v_m_s: Option<f64>,
    pub(super) omega_max_deg_s: Option<f64>,
    pub(super) separation_m: Option<f64>,
    pub(super) turns: Option<usize>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(super) struct OrderSection {
    at_s: f64,
    heading_deg: Option<f64>,
    speed_m_s: Option<f64>,
    altitude_m: Option<f64>,
    climb_m_s: Option<f64>,
    way_points_m: Option<Vec<Point>>,
    proceeds: Option<bool>,
    leaves: Option<bool>,
}

/// Orders in their order, and when the airplane is removed: never at infinity.
type Orders = (Vec<FlightOrder>, f64);

fn is_absurd(value: f64) -> bool {
    !value.is_finite() || value.abs() > MOST
}

impl AirplaneSection {
    /// The recorded track, if there is one.
    pub(super) fn track(&self, source: &Source) -> Result<Option<Track>, InputError> {
        let Some(rows) = &self.track else { return Ok(None) };
        let own = self.at_m.is_some() || self.heading_deg.is_some() || self.way_points_m.is_some();
        if own || self.altitude_m.is_some() || self.appears_s.is_some() || !self.orders.is_empty() {
            let remedy =
                "leave out at_m, heading_deg, way_points_m, altitude_m, appears_s and orders";
            return Err(source.error(
                Some(rows.span()),
                "a track beside what it tells itself",
                remedy,
            ));
        }
        let point =
            |&[t_s, x, y, altitude_m]: &[f64; 4]| TrackPoint { t_s, at: [x, y], altitude_m };
        let points: Vec<TrackPoint> = rows.get_ref().iter().map(point).collect();
        let begins_before = points.first().is_some_and(|p| p.t_s < 0.0);
        match Track::new(points).filter(|_| !begins_before) {
            Some(track) => Ok(Some(track)),
            None => {
                let remedy = "give two or more [t_s, x_m, y_m, altitude_m], times rising from 0";
                Err(source.error(Some(rows.span()), "this is no track", remedy))
            }
        }
    }

    /// What it is told on its way.
    pub(super) fn orders(&self, source: &Source) -> Result<Orders, InputError> {
        let (mut orders, mut leaves_s) = (Vec::new(), f64::INFINITY);
        let mut last_s = 0.0;
        for section in &self.orders {
            let order = section.get_ref();
            let error =
                |cause: &str, remedy: &str| Err(source.error(Some(section.span()), cause, remedy));
            if is_absurd(order.at_s) || order.at_s < last_s {
                return error(
                    "the order's time is before the one before",
                    "sort orders by at_s, from 0",
                );
            }
            last_s = order.at_s;
            match order.task() {
                Ok(Some(task)) => orders.push(FlightOrder { at_s: order.at_s, task }),
                Ok(None) => leaves_s = order.at_s.min(leaves_s),
                Err((cause, remedy)) => return error(cause, remedy),
            }
        }
        if orders.len() > MAX_ORDERS {
            let span = self.orders.last().map(Spanned::span);
            return Err(source.error(span, format!("{} orders", orders.len()), "give up to 10000"));
        }
        Ok((orders, leaves_s))
    }
}

impl OrderSection {
    /// The one task that the order is; `None` for leaving.
    fn task(&self) -> Result<Option<Task>, (&'static str, &'static str)> {
        let climb_m_s = self.climb_m_s.unwrap_or(CLIMB_M_S);
        let numbers = [self.heading_deg, self.speed_m_s, self.altitude_m, Some(climb_m_s)];
        let points = self.way_points_m.iter().flatten().flatten();
        if numbers.iter().flatten().chain(points).any(|v| is_absurd(*v)) {
            return Err((
                "an order with a value that is no number, or absurd",
                "give less than 1e9",
            ));
        }
        if climb_m_s <= 0.0 || self.speed_m_s.is_some_and(|v| v <= 0.0 || v >= 1e6) {
            return Err(("a speed that is not positive, or absurd", "give more than 0"));
        }
        if self.climb_m_s.is_some() && self.altitude_m.is_none() {
            return Err(("climb_m_s without altitude_m", "say to which altitude_m"));
        }
        let route = self.way_points_m.clone();
        let altitude = self.altitude_m.map(|altitude_m| Task::Altitude { altitude_m, climb_m_s });
        let heading = self.heading_deg.map(|deg| Task::Heading(math::wrap_angle(deg.to_radians())));
        let tasks = [
            heading,
            self.speed_m_s.map(Task::Speed),
            altitude,
            route.filter(|way_points| !way_points.is_empty()).map(Task::WayPoints),
            self.proceeds.filter(|yes| *yes).map(|_| Task::Proceed),
        ];
        let mut tasks: Vec<Task> = tasks.into_iter().flatten().collect();
        match (tasks.len(), self.leaves == Some(true)) {
            (1, false) => Ok(tasks.pop()),
            (0, true) => Ok(None),
            _ => Err((
                "an order that is not one thing",
                "give one of heading_deg, speed_m_s, altitude_m, way_points_m, proceeds = true and leaves = true",
            )),
        }
    }
}
