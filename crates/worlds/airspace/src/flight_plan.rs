//! The text of one airplane of a scenario: its start, its way-points, its recorded track, and its orders.
//!
//! Positions are in meters on a plane, or latitudes and longitudes in degrees on the earth. All airplanes of a scenario
//! have them in the same form, which makes it planar or geographic.

pub(super) mod limits;

use super::flight::{
    CLIMB_M_S, FlightOrder, FlightTask, MAX_ORDERS, Performance, Surface, Track, TrackPoint,
    coordinates_from_degrees,
};
use super::settings::{
    AbilityKeys, AltitudeLimit, Bank, ChangeList, PositiveRate, PositiveTime, SeparationM, Speed,
    SpeedLimit, SurveillanceCategory, TurnCount, TurnRate, VelocityCategory, ability_keys,
};
use limits::{LevelChange, Mistake, level_order_mistake, speed_order_mistake};
use schemars::JsonSchema;
use serde::Deserialize;
use sidestep_kernel::{InputError, math};
use sidestep_scenario::{Closed, FixedList, Integer, LeftOpen, Number, Point, Source, Spanned};
use std::ops::Range;

/// A position, height or angle within reasonable bounds.
pub(super) type BoundedNumber = Number<Closed<-1_000_000_000, 1_000_000_000>>;
/// A time within reasonable bounds, not before the start.
pub(super) type BoundedTime = Number<Closed<0, 1_000_000_000>>;
pub(super) type BoundedPoint = Point<2, Closed<-1_000_000_000, 1_000_000_000>>;
/// Latitude and longitude in degrees; the latitude is checked beside that.
pub(super) type LatLonDeg = Point<2, Closed<-360, 360>>;

#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct AirplaneSection {
    callsign: Option<Spanned<String>>,
    /// Place at the start.
    pub(super) at_m: Option<BoundedPoint>,
    /// Latitude and longitude at the start, on the earth.
    at_deg: Option<Spanned<LatLonDeg>>,
    /// Heading at the start, counterclockwise from east.
    pub(super) heading_deg: Option<BoundedNumber>,
    /// Places to fly to, one after the other.
    way_points_m: Option<Vec<BoundedPoint>>,
    /// Latitudes and longitudes to fly to, one after the other, each on the shortest path.
    way_points_deg: Option<Vec<Spanned<LatLonDeg>>>,
    pub(super) altitude_m: Option<BoundedNumber>,
    pub(super) appears_s: Option<BoundedTime>,
    /// Recorded track: [t_s, x_m, y_m, altitude_m], ...
    track: Option<Spanned<Vec<FixedList<f64, 4>>>>,
    /// Recorded track on the earth: [t_s, latitude_deg, longitude_deg, altitude_m], ...
    track_deg: Option<Spanned<Vec<FixedList<f64, 4>>>>,
    /// Orders on its way, one thing each.
    #[serde(default)]
    orders: Vec<Spanned<OrderSection>>,
    /// Its type: one of the table of types_file, of OpenAP, or of the built-in ones.
    #[serde(rename = "type")]
    pub(super) type_name: Option<Spanned<String>>,
    /// Speed, if not that of all.
    pub(super) v_m_s: Option<Number<Speed>>,
    /// Greatest turn rate, if not that of all.
    pub(super) omega_max_deg_s: Option<Number<TurnRate>>,
    /// Greatest bank in turns: at any speed, turns pull no more to the side than at that bank.
    pub(super) bank_max_deg: Option<Number<Bank>>,
    /// Smallest airspeed: it stalls below.
    pub(super) v_min_m_s: Option<SpeedLimit>,
    /// Greatest airspeed.
    pub(super) v_max_m_s: Option<SpeedLimit>,
    /// Greatest rate of climb.
    pub(super) climb_max_m_s: Option<PositiveRate>,
    /// Greatest rate of descent, positive.
    pub(super) descent_max_m_s: Option<PositiveRate>,
    /// Lowest altitude.
    pub(super) floor_m: Option<AltitudeLimit>,
    /// Highest altitude.
    pub(super) ceiling_m: Option<AltitudeLimit>,
    /// Greatest change of airspeed; without it speeds change at once.
    pub(super) acceleration_m_s2: Option<PositiveRate>,
    /// Time for which its fuel, or its battery, lasts; a longer flight is reported.
    pub(super) endurance_s: Option<PositiveTime>,
    /// Distance that others have to keep, if not that of all.
    pub(super) separation_m: Option<SeparationM>,
    /// Number of turn rates to choose from, if not that of all.
    pub(super) turns: Option<TurnCount>,
    /// Changes of level among which method pc chooses, against the filed one.
    pub(super) level_changes_m: Option<ChangeList>,
    /// Changes of speed among which method pc chooses, against the filed one.
    pub(super) speed_changes_m_s: Option<ChangeList>,
    /// Category of accuracy of its reported positions, NACp of ADS-B, if not that of all.
    pub(super) nac_p: Option<SurveillanceCategory>,
    /// Category of integrity of its reported positions, NIC of ADS-B, if not that of all.
    pub(super) nic: Option<SurveillanceCategory>,
    /// Category of accuracy of its reported velocities, NACv of ADS-B, if not that of all.
    pub(super) nac_v: Option<VelocityCategory>,
    /// Priority from 0 to 3: it has right of way over airplanes with a smaller one.
    pub(super) priority: Option<Integer<0, 3>>,
    non_cooperative: Option<bool>,
    /// Earlier name of non_cooperative.
    intruder: Option<Spanned<bool>>,
}

#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
struct OrderSection {
    /// Time of the order.
    at_s: Option<BoundedTime>,
    /// Heading to fly until sent to a way-point.
    heading_deg: Option<BoundedNumber>,
    /// Speed to fly with.
    speed_m_s: Option<Number<Speed>>,
    /// Level to go to.
    altitude_m: Option<BoundedNumber>,
    /// Rate of the change of level.
    climb_m_s: Option<Number<LeftOpen<0, 1_000_000_000>>>,
    /// Way-points instead of those it has.
    way_points_m: Option<Vec<BoundedPoint>>,
    /// Latitudes and longitudes instead of the way-points it has.
    way_points_deg: Option<Vec<Spanned<LatLonDeg>>>,
    /// Whether it goes on to its next way-point.
    proceeds: Option<bool>,
    /// Whether it leaves the airspace.
    leaves: Option<bool>,
}

/// Orders in their order, and when the airplane is removed: infinity for never.
type OrdersAndRemovalTime = (Vec<FlightOrder>, f64);

fn points_m(given: Option<&Vec<BoundedPoint>>) -> Vec<[f64; 2]> {
    given.into_iter().flatten().map(|place| place.get()).collect()
}

/// Returns coordinates of positions on the earth.
///
/// # Errors
/// When a latitude is beyond a pole.
fn coordinates(
    source: &Source,
    given: Option<&Vec<Spanned<LatLonDeg>>>,
) -> Result<Vec<[f64; 2]>, InputError> {
    given.into_iter().flatten().map(|at| coordinates_of(source, at)).collect()
}

fn coordinates_of(source: &Source, at: &Spanned<LatLonDeg>) -> Result<[f64; 2], InputError> {
    let lat_lon_deg = at.get_ref().get();
    if lat_lon_deg[0].abs() <= 90.0 {
        return Ok(coordinates_from_degrees(lat_lon_deg));
    }
    let cause = format!("a latitude of {} degrees", lat_lon_deg[0]);
    Err(source.error(at.span(), cause, "give [latitude, longitude], the latitude from -90 to 90"))
}

/// Largest number of characters of a call sign.
const MAX_CALLSIGN_CHARS: usize = 40;

impl AirplaneSection {
    /// Returns the abilities that its own keys give.
    pub(super) fn abilities(&self) -> AbilityKeys {
        ability_keys!(self)
    }

    /// Returns whether it avoids nobody, under either name of the key.
    pub(super) fn is_non_cooperative(&self, source: &Source) -> Result<bool, InputError> {
        let Some(intruder) = &self.intruder else {
            return Ok(self.non_cooperative.unwrap_or(false));
        };
        if self.non_cooperative.is_some() {
            let cause = "`intruder` is an earlier name of `non_cooperative`, which is also given";
            return Err(source.error(intruder.span(), cause, "leave out `intruder`"));
        }
        Ok(*intruder.get_ref())
    }

    /// Returns the call sign, if it has one.
    pub(super) fn callsign(&self, source: &Source) -> Result<Option<String>, InputError> {
        let Some(given) = &self.callsign else { return Ok(None) };
        let callsign = given.get_ref();
        let is_right = (1..=MAX_CALLSIGN_CHARS).contains(&callsign.chars().count())
            && !callsign.chars().any(char::is_control);
        if is_right {
            return Ok(Some(callsign.clone()));
        }
        let cause = format!("the call sign {callsign:?}");
        let remedy = format!("give 1 to {MAX_CALLSIGN_CHARS} letters or digits, or leave it out");
        Err(source.error(given.span(), cause, remedy))
    }

    /// Returns the error of a call sign that another airplane has at the same time.
    pub(super) fn repeated_callsign_error(&self, source: &Source) -> Option<InputError> {
        let given = self.callsign.as_ref()?;
        let cause = format!(
            "the call sign {:?} is that of another airplane at the same time",
            given.get_ref()
        );
        Some(source.error(given.span(), cause, "give each airplane its own, or leave it out"))
    }

    /// Returns the surface on which it has its positions: the earth if any of them are in degrees, the plane if any are
    /// in meters.
    ///
    /// # Errors
    /// When it has both.
    pub(super) fn surface(
        &self,
        source: &Source,
        span: Range<usize>,
    ) -> Result<Option<Surface>, InputError> {
        let orders = || self.orders.iter().map(Spanned::get_ref);
        let is_on_earth = self.at_deg.is_some()
            || self.way_points_deg.is_some()
            || self.track_deg.is_some()
            || orders().any(|order| order.way_points_deg.is_some());
        let is_in_plane = self.at_m.is_some()
            || self.way_points_m.is_some()
            || self.track.is_some()
            || orders().any(|order| order.way_points_m.is_some());
        match (is_in_plane, is_on_earth) {
            (true, true) => Err(mixed_positions(source, span)),
            (false, true) => Ok(Some(Surface::Earth)),
            (true, false) => Ok(Some(Surface::Plane)),
            (false, false) => Ok(None),
        }
    }

    /// Returns the position at the start in coordinates, if it has one.
    ///
    /// # Errors
    /// When it is not on the earth.
    pub(super) fn start_at(&self, source: &Source) -> Result<Option<[f64; 2]>, InputError> {
        match &self.at_deg {
            Some(at) => coordinates_of(source, at).map(Some),
            None => Ok(self.at_m.map(|at| at.get())),
        }
    }

    /// Returns the way-points in their order, in coordinates; none if none are given.
    ///
    /// # Errors
    /// When one is not on the earth.
    pub(super) fn way_points(&self, source: &Source) -> Result<Vec<[f64; 2]>, InputError> {
        let on_earth = coordinates(source, self.way_points_deg.as_ref())?;
        Ok([points_m(self.way_points_m.as_ref()), on_earth].concat())
    }

    /// Returns the recorded track, if there is one.
    pub(super) fn track(&self, source: &Source) -> Result<Option<Track>, InputError> {
        let (rows, surface) = match (&self.track, &self.track_deg) {
            (Some(rows), _) => (rows, Surface::Plane),
            (None, Some(rows)) => (rows, Surface::Earth),
            (None, None) => return Ok(None),
        };
        let has_own_start = self.at_m.is_some()
            || self.at_deg.is_some()
            || self.altitude_m.is_some()
            || self.heading_deg.is_some();
        let has_own_flight = self.way_points_m.is_some()
            || self.way_points_deg.is_some()
            || self.appears_s.is_some()
            || !self.orders.is_empty();
        if has_own_start || has_own_flight {
            let remedy = match surface {
                Surface::Plane => {
                    "leave out at_m, heading_deg, way_points_m, altitude_m, appears_s and orders"
                }
                Surface::Earth => {
                    "leave out at_deg, heading_deg, way_points_deg, altitude_m, appears_s and orders"
                }
            };
            return Err(source.error(rows.span(), "a track beside keys that it replaces", remedy));
        }
        let mut is_on_earth = true;
        let points: Vec<TrackPoint> = rows
            .get_ref()
            .iter()
            .map(|row| {
                let [t_s, x, y, altitude_m] = row.get();
                let at = match surface {
                    Surface::Plane => [x, y],
                    Surface::Earth => {
                        is_on_earth &= x.abs() <= 90.0 && y.abs() <= 360.0;
                        coordinates_from_degrees([x, y])
                    }
                };
                TrackPoint { t_s, at, altitude_m }
            })
            .collect();
        let begins_before_run = points.first().is_some_and(|p| p.t_s < 0.0);
        match Track::new(surface, points).filter(|_| is_on_earth && !begins_before_run) {
            Some(track) => Ok(Some(track)),
            None => {
                let remedy = match surface {
                    Surface::Plane => {
                        "give two or more [t_s, x_m, y_m, altitude_m], times rising from 0"
                    }
                    Surface::Earth => {
                        "give two or more [t_s, latitude_deg, longitude_deg, altitude_m], times rising \
                         from 0, latitudes from -90 to 90"
                    }
                };
                Err(source.error(rows.span(), "this is no track", remedy))
            }
        }
    }

    /// Returns its orders, and the time at which it is removed.
    /// They are for an airplane with this performance, whose first level is at `altitude_m`.
    pub(super) fn orders(
        &self,
        source: &Source,
        performance: &Performance,
        altitude_m: f64,
    ) -> Result<OrdersAndRemovalTime, InputError> {
        let mut orders = Vec::new();
        let mut level_m = altitude_m;
        let mut leaves_s = f64::INFINITY;
        let mut last_s = 0.0;
        for section in &self.orders {
            let order = section.get_ref();
            let error = |cause: &str, remedy: &str| source.error(section.span(), cause, remedy);
            let at_s = order.at_s.map_or(0.0, f64::from);
            if at_s < last_s {
                let cause = "the order's time is before the one before";
                return Err(error(cause, "sort orders by at_s, from 0"));
            }
            last_s = at_s;
            if leaves_s.is_finite() {
                let cause = "an order after the airplane has left";
                return Err(error(
                    cause,
                    "leave it out, or let the airplane leave as its last order",
                ));
            }
            let way_points_deg = coordinates(source, order.way_points_deg.as_ref())?;
            let task = order.parse_task(way_points_deg);
            let Some(mut task) = task.map_err(|(cause, remedy)| error(cause, remedy))? else {
                leaves_s = at_s;
                continue;
            };
            if let Some((cause, remedy)) = order.limit_mistake(&task, performance, level_m) {
                return Err(error(&cause, &remedy));
            }
            if let FlightTask::Altitude { altitude_m, climb_m_s } = &mut task {
                *climb_m_s = climb_m_s.min(performance.vertical_max_m_s(*altitude_m > level_m));
                level_m = *altitude_m;
            }
            orders.push(FlightOrder { at_s, task });
        }
        if orders.len() > MAX_ORDERS {
            let span = self.orders.last().map(Spanned::span);
            return Err(source.error(span, format!("{} orders", orders.len()), "give up to 10000"));
        }
        Ok((orders, leaves_s))
    }
}

/// Returns the error of a scenario with positions in a plane and on the earth.
pub(super) fn mixed_positions(source: &Source, span: Range<usize>) -> InputError {
    let cause = "positions in meters beside positions in degrees";
    let remedy = "give all airplanes of a scenario at_m, way_points_m and track, or all of them at_deg, \
                  way_points_deg and track_deg";
    source.error(span, cause, remedy)
}

impl OrderSection {
    /// Returns what an airplane on a level could not do of a task, if there is something.
    fn limit_mistake(
        &self,
        task: &FlightTask,
        performance: &Performance,
        level_m: f64,
    ) -> Option<Mistake> {
        match task {
            FlightTask::Speed(v_m_s) => speed_order_mistake(performance, *v_m_s),
            FlightTask::Altitude { altitude_m, .. } => {
                let climb_m_s = self.climb_m_s.map(f64::from);
                let change = LevelChange { from_m: level_m, to_m: *altitude_m, climb_m_s };
                level_order_mistake(performance, change)
            }
            _ => None,
        }
    }

    /// Returns the one task of the order; `None` for leaving. `on_earth` are the coordinates of its way-points in
    /// degrees.
    fn parse_task(
        &self,
        on_earth: Vec<[f64; 2]>,
    ) -> Result<Option<FlightTask>, (&'static str, &'static str)> {
        if self.climb_m_s.is_some() && self.altitude_m.is_none() {
            return Err(("climb_m_s without altitude_m", "say to which altitude_m"));
        }
        let climb_m_s = self.climb_m_s.map_or(CLIMB_M_S, f64::from);
        let way_points = [points_m(self.way_points_m.as_ref()), on_earth].concat();
        let tasks = [
            self.heading_deg.map(|to| FlightTask::Heading(math::wrap_angle(to.get().to_radians()))),
            self.speed_m_s.map(|speed| FlightTask::Speed(speed.get())),
            self.altitude_m.map(|to| FlightTask::Altitude { altitude_m: to.get(), climb_m_s }),
            (!way_points.is_empty()).then_some(FlightTask::WayPoints(way_points)),
            (self.proceeds == Some(true)).then_some(FlightTask::Proceed),
        ];
        let mut tasks: Vec<FlightTask> = tasks.into_iter().flatten().collect();
        match (tasks.len(), self.leaves == Some(true)) {
            (1, false) => Ok(tasks.pop()),
            (0, true) => Ok(None),
            _ => Err((
                "an order that is not one thing",
                "give one of heading_deg, speed_m_s, altitude_m, way_points_m, way_points_deg, proceeds = true and \
                 leaves = true",
            )),
        }
    }
}
