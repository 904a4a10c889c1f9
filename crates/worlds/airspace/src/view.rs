//! The visible part of an airspace: airplanes, the zones around them, their starts and goals.

use super::areas::{Area, AreaKind};
use super::events::{Event, EventKind};
use super::flight::{Point, Pose2, rotated};
use super::state::AirspaceState;
use super::surveillance::present_state;
use super::world::AirspaceWorld;
use crate::kinds;
use sidestep_kernel::view::{
    AreaLevels, Body, BodyCondition, BodyId, BodyKind, CoordinateColumn, EarthReference, LogEvent,
    Pose, PositionTableColumns, Quantity, Route, Scenery, Severity, Shape, TrafficPlan,
};
use sidestep_kernel::{Cycle, EntitySlot};

/// Length of a drawn airplane, as a fraction of its zone's radius: large enough to be seen, and small
/// enough that airplanes with touching zones are drawn apart.
const LENGTH_FRACTION: f64 = 0.6;
/// Width of a drawn airplane, as a fraction of its length.
const WIDTH_FRACTION: f64 = 0.7;
/// Height of a zone, as a fraction of its radius: a flat disc hides little.
const ZONE_HEIGHT_FRACTION: f64 = 0.02;
/// Thickness of the border of an area, as a fraction of the largest zone's radius.
const BORDER_FRACTION: f64 = 0.1;
/// Radius of a goal, as a fraction of the zone's radius.
const GOAL_FRACTION: f64 = 0.15;

/// Returns the starts of airplanes, as wide as their zones, and their last way-points.
pub(super) fn scenery(world: &AirspaceWorld, name: &str) -> Scenery {
    let mut bodies = Vec::new();
    for (id, airplane) in (0..).zip(world.airplanes.iter()) {
        let [x_m, y_m] = world.display_m(airplane.start.at);
        let pose = Pose::from_position([x_m, y_m, airplane.altitude_m]);
        bodies.push(Body::new(kinds::START, id, pose, zone_shape(world, id)));
    }
    for (id, airplane) in (0..).zip(world.airplanes.iter()) {
        if let Some(&goal) = airplane.mission.last() {
            let [x_m, y_m] = world.display_m(goal);
            let pose = Pose::from_position([x_m, y_m, airplane.altitude_m]);
            let radius_m = GOAL_FRACTION * zone_radius_m(world, id);
            bodies.push(Body::new(BodyKind::GOAL, id, pose, Shape::Sphere { radius_m }));
        }
    }
    let permanent = |area: &Area| area.is_permanent();
    bodies.extend(area_bodies(world, 0.0, permanent));
    Scenery {
        name: name.into(),
        dimensions: if is_single_level_world(world) { 2 } else { 3 },
        cycle_s: world.timing.dt_s,
        floor: None,
        bodies,
        names: body_names(world),
        groups: Vec::new(),
        earth: EarthReference {
            chart: world.chart().earth_chart(),
            start_utc_s: world.start_utc_s,
        },
        traffic: Some(traffic_plan(world)),
    }
}

/// Returns the levels of all areas, and the filed routes. A recorded flight has none: its track is known as it is flown.
fn traffic_plan(world: &AirspaceWorld) -> TrafficPlan {
    let bound_m = |level_m: f64| level_m.is_finite().then_some(level_m);
    let mut areas = Vec::new();
    for (number, area) in (0..).zip(world.areas.iter()) {
        areas.push(AreaLevels {
            area: BodyId::new(kinds::AREA, number, None),
            is_fence: area.kind == AreaKind::In,
            low_m: bound_m(area.levels.low_m),
            high_m: bound_m(area.levels.high_m),
        });
    }
    let mut routes = Vec::new();
    for (id, airplane) in (0..).zip(world.airplanes.iter()) {
        if airplane.track.is_some() || airplane.mission.is_empty() {
            continue;
        }
        let places = std::iter::once(&airplane.start.at).chain(airplane.mission.iter());
        let points_m = places.map(|&at| {
            let [x_m, y_m] = world.display_m(at);
            [x_m, y_m, airplane.altitude_m]
        });
        let agent = BodyId::new(kinds::AIRPLANE, id, None);
        routes.push(Route { agent, points_m: points_m.collect() });
    }
    TrafficPlan { areas, routes }
}

/// Returns the call signs as names of bodies, and the names of areas; one without a name has none.
fn body_names(world: &AirspaceWorld) -> Vec<(BodyKind, u32, String)> {
    let airplanes = (0..)
        .zip(world.airplanes.iter())
        .filter_map(|(id, airplane)| Some((kinds::AIRPLANE, id, airplane.callsign.clone()?)));
    let areas = (0..)
        .zip(world.areas.iter())
        .filter_map(|(number, area)| Some((kinds::AREA, number, area.name.clone()?)));
    airplanes.chain(areas).collect()
}

/// Returns the borders of some areas at a time: on the one level of a flat world, else on their lowest and highest ones.
fn area_bodies(world: &AirspaceWorld, t_s: f64, is_shown: impl Fn(&Area) -> bool) -> Vec<Body> {
    let mut bodies = Vec::new();
    let level_m = world.airplanes.first().map_or(0.0, |airplane| airplane.altitude_m);
    let is_flat = is_single_level_world(world);
    let ids = 0..world.airplanes.len() as EntitySlot;
    let thickness_m = BORDER_FRACTION * ids.map(|id| zone_radius_m(world, id)).fold(0.0, f64::max);
    for (number, area) in (0..).zip(world.areas.iter()).filter(|(_, area)| is_shown(area)) {
        let plane = area.plane_at(world.surface, t_s);
        let ends_m = [area.levels.low_m, area.levels.high_m];
        let mut levels_m: Vec<f64> =
            ends_m.into_iter().filter(|level_m| level_m.is_finite() && !is_flat).collect();
        if levels_m.is_empty() {
            levels_m.push(level_m);
        }
        let mut part = 0;
        for line in area.shape.outlines() {
            for &level_m in &levels_m {
                let on_level = |&in_area: &Point| {
                    let [x_m, y_m] = world.display_m(plane.to_world(in_area));
                    [x_m, y_m, level_m]
                };
                let points_m = line.iter().map(on_level).collect();
                let shape = Shape::Line { points_m, thickness_m };
                let [x_m, y_m] = world.display_m(plane.to_world([0.0; 2]));
                let pose = Pose::from_position([x_m, y_m, level_m]);
                let body = Body::new(kinds::AREA, number, pose, shape).with_part(part);
                let is_fence = area.kind == AreaKind::In;
                bodies.push(body.with_condition_if(is_fence, BodyCondition::Open));
                part += 1;
            }
        }
    }
    bodies
}

/// Returns the columns of recorded tables that give the positions of airplanes.
pub(super) fn position_columns() -> Vec<PositionTableColumns> {
    vec![PositionTableColumns {
        table: "trajectories",
        kind: kinds::AIRPLANE,
        number: "airplane",
        part: None,
        axes: ["x_m", "y_m", "altitude_m"].map(CoordinateColumn::meters).to_vec(),
        plane: None,
        is_corner: false,
        heading: None,
        interval: 1,
        history: Cycle::MAX,
    }]
}

/// Returns whether all airplanes fly on one level from start to end.
fn is_single_level_world(world: &AirspaceWorld) -> bool {
    let first_m = world.airplanes.first().map_or(0.0, |airplane| airplane.altitude_m);
    world.airplanes.iter().all(|airplane| {
        let keeps_level = airplane.track.is_none() && airplane.orders.is_empty();
        keeps_level && airplane.altitude_m == first_m
    })
}

/// Returns half the separation in meters: airplanes are apart when their zones do not meet.
fn zone_radius_m(world: &AirspaceWorld, slot: EntitySlot) -> f64 {
    0.5 * world.airplanes[slot as usize].model.separation_m
}

/// Returns the disc that stands for an airplane's zone.
fn zone_shape(world: &AirspaceWorld, slot: EntitySlot) -> Shape {
    let radius_m = zone_radius_m(world, slot);
    Shape::Cylinder { radius_m, height_m: ZONE_HEIGHT_FRACTION * radius_m }
}

/// Returns the airplanes that are in the air, each followed by its zone, and the areas that come and go.
pub(super) fn visible_bodies(
    world: &AirspaceWorld,
    state: &AirspaceState,
    now: Cycle,
) -> Vec<Body> {
    let ids = 0..world.airplanes.len() as EntitySlot;
    let active: Vec<EntitySlot> = ids.filter(|&id| state.is_active(world, id, now)).collect();
    let too_near = too_close_aircraft(world, state, &active);
    let airplanes = active.iter().flat_map(|&id| {
        let is_too_near = too_near.binary_search(&id).is_ok();
        airplane_and_zone(world, state, now, id)
            .map(|body| body.with_condition_if(is_too_near, BodyCondition::Touching))
    });
    let now_s = world.cycle_start_s(now);
    let is_shown = |area: &Area| !area.is_permanent() && area.lasts_at(now_s);
    airplanes.chain(area_bodies(world, now_s, is_shown)).collect()
}

fn airplane_and_zone(
    world: &AirspaceWorld,
    state: &AirspaceState,
    now: Cycle,
    id: EntitySlot,
) -> [Body; 2] {
    let current = &state.airplanes[id as usize];
    let vector = present_state(world, state, now, id);
    let Pose2 { at: [x_m, y_m], heading_rad } = world.display_pose(current.pose());
    // East is another direction in another place on the earth.
    let turn_rad = heading_rad - vector.pose.heading_rad;
    let [east_m_s, north_m_s] = rotated(vector.velocity_m_s, turn_rad);
    let pose = Pose::from_heading([x_m, y_m, current.altitude_m.get()], heading_rad);
    let length_m = LENGTH_FRACTION * zone_radius_m(world, id);
    let dart = Shape::Dart { length_m, width_m: WIDTH_FRACTION * length_m };
    let velocity_m_s = [east_m_s, north_m_s, vector.climb_m_s];
    [
        Body::new(kinds::AIRPLANE, id, pose, dart).with_velocity(velocity_m_s),
        Body::new(kinds::ZONE, id, pose, zone_shape(world, id)),
    ]
}

/// Returns the airplanes that are nearer to another than allowed, by id.
fn too_close_aircraft(
    world: &AirspaceWorld,
    state: &AirspaceState,
    active: &[EntitySlot],
) -> Vec<EntitySlot> {
    let at = |slot: EntitySlot| state.airplanes[slot as usize].pose().at;
    let max_gap_m = world.airplanes.iter().map(|a| a.model.separation_m).fold(0.0, f64::max);
    // Sorted along one direction, so that only neighbors have to be compared.
    let sweep = |slot: EntitySlot| (world.surface.sweep_m(at(slot)), at(slot), slot);
    let mut by_x: Vec<(f64, Point, EntitySlot)> = active.iter().map(|&slot| sweep(slot)).collect();
    by_x.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.2.cmp(&b.2)));
    let mut near = Vec::new();
    for (k, &(p_m, p, a)) in by_x.iter().enumerate() {
        let candidates = by_x[k + 1..].iter().take_while(|(q_m, ..)| q_m - p_m < max_gap_m);
        for &(_, q, b) in candidates {
            let gap_m = 2.0 * zone_radius_m(world, a).max(zone_radius_m(world, b));
            if world.surface.is_within(p, q, gap_m)
                && world.surface.distance_m(p, q) < gap_m
                && are_on_one_level(world, state, a, b)
            {
                near.extend([a, b]);
            }
        }
    }
    near.sort_unstable();
    near.dedup();
    near
}

fn are_on_one_level(
    world: &AirspaceWorld,
    state: &AirspaceState,
    a: EntitySlot,
    b: EntitySlot,
) -> bool {
    let altitude_a_m = state.airplanes[a as usize].altitude_m.get();
    let altitude_b_m = state.airplanes[b as usize].altitude_m.get();
    (altitude_a_m - altitude_b_m).abs() < world.vertical_m
}

/// Returns an event in words.
pub(super) fn to_log_event(event: &Event) -> LogEvent {
    let value = event.value;
    let other = event.other;
    let (level, words) = match event.kind {
        EventKind::LossOfSeparation => {
            (Severity::Error, format!("loses separation from airplane/{other} at {value:.1} m"))
        }
        EventKind::Arrival => (Severity::Info, format!("arrives with a delay of {value:.1} s")),
        EventKind::Override => (
            Severity::Info,
            format!("is kept by the shield from what it wanted, flies way {value}"),
        ),
        EventKind::Orbit => (Severity::Warning, "is kept on its fallback by the shield".into()),
        EventKind::Unheard => (Severity::Warning, format!("has not heard of airplane/{other}")),
        EventKind::Deadline => (Severity::Warning, "had no time left to decide".into()),
        EventKind::HeldBack => (Severity::Warning, "stays on its fallback: not all agreed".into()),
        EventKind::GroupTooLarge => {
            (Severity::Warning, format!("is in a group of {value}, too large to optimize"))
        }
        EventKind::BeyondBound => {
            (Severity::Warning, format!("errs {value:.1} times as much as the shield allows for"))
        }
        EventKind::Intruder => (
            Severity::Warning,
            format!("can be reached by airplane/{other}, now {value:.0} m away"),
        ),
        EventKind::Absent => {
            (Severity::Warning, "stays on its fallback: no control of it came in time".into())
        }
        EventKind::AreaEntry => {
            (Severity::Error, format!("comes to where area/{value} does not permit it to be"))
        }
        EventKind::AreaExempt => {
            (Severity::Warning, format!("is not kept clear of area/{value} by the shield"))
        }
        EventKind::CommandHeld => {
            (Severity::Info, "is kept by the shield from a level or a speed that it wanted".into())
        }
        EventKind::LevelOff => {
            (Severity::Info, format!("is held on its way to a level, at {value:.0} m"))
        }
        EventKind::LowHold => {
            (Severity::Warning, format!("is held below the safe altitude, at {value:.0} m"))
        }
        EventKind::EnduranceExceedance => (
            Severity::Error,
            format!("is in the air for longer than its endurance of {value:.0} s"),
        ),
        EventKind::TrackDropped => (
            Severity::Warning,
            format!("drops its track of airplane/{other}: its last report is {value:.1} s old"),
        ),
        EventKind::SearchLimit => (
            Severity::Warning,
            format!(
                "comes too close to airplane/{other}, as far as a search up to its limit shows"
            ),
        ),
    };
    let airplane = |id| BodyId::new(kinds::AIRPLANE, id, None);
    LogEvent {
        cycle: event.cycle,
        level,
        kind: event.kind.log_event_kind(),
        who: airplane(event.airplane),
        with: event.other_airplane().map(airplane),
        at_m: event.at_m,
        value: event.kind.measured_quantity().map(|measure| Quantity::new(value, measure.unit())),
        words,
    }
}
