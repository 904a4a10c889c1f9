//! Views of the kernel as types of the protocol.

use crate::protocol::{
    Appearance, BodyId, BodyName, EarthChart, OccupancyGrid, Problem, RunEvent, Scan, Scene,
    SceneGroup, Shape, StaticBody, Traffic, TrafficArea, TrafficRoute,
};
use sidestep_kernel::InputError;
use sidestep_kernel::view::{
    self, AgentGroup, Body, BodyKind, BodyRole, EarthProjection, Kinds, LogEvent, Occupancy,
    Scenery, Severity,
};

/// Returns the scene of a world, which stays the same, by the world's name and its noun for an agent.
pub(crate) fn scene(world: &str, agent: &str, scenery: &Scenery, is_recording: bool) -> Scene {
    Scene {
        name: scenery.name.clone(),
        world: world.into(),
        agent: agent.into(),
        dimensions: scenery.dimensions,
        cycle_s: scenery.cycle_s,
        floor: scenery.floor.as_ref().map(occupancy_grid),
        bodies: scenery.bodies.iter().map(|body| static_body(body, scenery)).collect(),
        groups: scenery.groups.iter().map(group).collect(),
        names: scenery.names.iter().map(body_name).collect(),
        is_recording,
        traffic: scenery.traffic.as_ref().map(|plan| traffic(plan, scenery)),
    }
}

fn body_name((kind, number, name): &(BodyKind, u32, String)) -> BodyName {
    BodyName { kind: kind.name().into(), number: *number, name: name.clone() }
}

fn group(group: &AgentGroup) -> SceneGroup {
    SceneGroup {
        name: group.name.clone(),
        kind: group.kind.name().into(),
        first: group.numbers.start,
        count: group.numbers.len() as u32,
    }
}

fn traffic(plan: &view::TrafficPlan, scenery: &Scenery) -> Traffic {
    let mut starts = scenery.bodies.iter();
    let start = starts.find(|body| matches!(body.kind.role(), BodyRole::StartOf(_)));
    let is_on_one_level = scenery.dimensions == 2;
    Traffic {
        chart: scenery.earth.chart.map(earth_chart),
        level_m: start.filter(|_| is_on_one_level).map(|body| body.pose.at_m[2]),
        areas: plan.areas.iter().map(|area| traffic_area(area, scenery)).collect(),
        routes: plan.routes.iter().map(traffic_route).collect(),
    }
}

fn earth_chart(chart: view::EarthChart) -> EarthChart {
    let sphere_radius_m = match chart.projection {
        EarthProjection::AzimuthalEquidistant => None,
        EarthProjection::Equirectangular { radius_m } => Some(radius_m),
    };
    EarthChart { origin_deg: chart.origin_deg, sphere_radius_m }
}

fn traffic_area(levels: &view::AreaLevels, scenery: &Scenery) -> TrafficArea {
    let view::BodyId { kind, number, .. } = levels.area;
    let name = own_name(scenery, kind, number);
    TrafficArea {
        kind: kind.name().into(),
        number,
        name: name.unwrap_or_else(|| format!("{} {number}", kind.spec().noun)),
        is_fence: levels.is_fence,
        low_m: levels.low_m,
        high_m: levels.high_m,
    }
}

fn traffic_route(route: &view::Route) -> TrafficRoute {
    TrafficRoute { agent: body_id(&route.agent), points_m: route.points_m.clone() }
}

fn own_name(scenery: &Scenery, kind: BodyKind, number: u32) -> Option<String> {
    let mut names = scenery.names.iter();
    let own = names.find(|(named, its_number, _)| *named == kind && *its_number == number);
    own.map(|(_, _, name)| name.clone())
}

fn static_body(body: &Body, scenery: &Scenery) -> StaticBody {
    StaticBody {
        id: body_id(&body.id()),
        name: own_name(scenery, body.kind, body.number),
        at_m: body.pose.at_m,
        orientation: body.pose.turn,
        shape: shape(&body.shape),
        appearance: appearance(body, scenery.dimensions),
    }
}

fn occupancy_grid(floor: &view::OccupancyGrid) -> OccupancyGrid {
    let mut runs: Vec<u32> = Vec::new();
    for occupancy in &floor.boxes {
        let code = match occupancy {
            Occupancy::Free => 0,
            Occupancy::Wall => 1,
            Occupancy::Unknown => 2,
        };
        match runs.as_mut_slice() {
            [.., last, count] if *last == code => *count += 1,
            _ => runs.extend([code, 1]),
        }
    }
    let view::OccupancyGrid { width, height, box_m, plane, .. } = *floor;
    OccupancyGrid { width, height, box_m, origin_m: plane.origin_m, yaw_rad: plane.yaw_rad, runs }
}

pub(super) fn shape(shape: &view::Shape) -> Shape {
    match *shape {
        view::Shape::Cuboid { size_m } => Shape::Cuboid { size_m },
        view::Shape::Cylinder { radius_m, height_m } => Shape::Cylinder { radius_m, height_m },
        view::Shape::Sphere { radius_m } => Shape::Sphere { radius_m },
        view::Shape::Line { ref points_m, thickness_m } => {
            Shape::Line { points_m: points_m.clone(), thickness_m }
        }
        view::Shape::Dart { length_m, width_m } => Shape::Dart { length_m, width_m },
    }
}

pub(super) fn appearance(body: &Body, dimensions: u8) -> Appearance {
    let view::Appearance { color, opacity, layer, .. } = body.appearance(dimensions);
    Appearance { color, opacity, layer }
}

pub(crate) fn body_id(id: &view::BodyId) -> BodyId {
    BodyId { kind: id.kind.name().into(), number: id.number, part: id.part }
}

/// Returns a scan; ranges without an echo become null.
pub(crate) fn scan(scan: &view::Scan) -> Scan {
    Scan {
        body: body_id(&scan.of),
        sensor: scan.sensor.clone(),
        at_m: scan.pose.at_m,
        orientation: scan.pose.turn,
        bearings_rad: scan.bearings_rad.clone(),
        ranges_m: finite_or_null(&scan.ranges_m),
        true_m: finite_or_null(&scan.true_m),
        range_m: scan.range_m,
    }
}

/// Returns ranges with `None` for nothing in range, as JSON has no infinity.
fn finite_or_null(ranges_m: &[f64]) -> Vec<Option<f64>> {
    ranges_m.iter().map(|range_m| range_m.is_finite().then_some(*range_m)).collect()
}

/// Returns an event; its cycle becomes a float, because JavaScript has no other numbers.
pub(crate) fn event(entry: &LogEvent) -> RunEvent {
    let level = match entry.level {
        Severity::Info => "info",
        Severity::Warning => "warning",
        Severity::Error => "error",
    };
    RunEvent {
        cycle: entry.cycle as f64,
        level: level.into(),
        kind: entry.kind.name().into(),
        body: Some(body_id(&entry.who)),
        other: entry.with.as_ref().map(body_id),
        at_m: entry.at_m,
        value: entry.value.as_ref().map(|amount| amount.value),
        unit: entry.value.as_ref().map_or_else(String::new, |amount| amount.unit.to_string()),
        text: entry.words.clone(),
    }
}

/// Returns the body that a page asks for; `None` where there is no such kind.
pub(crate) fn requested_body(id: &BodyId, kinds: &Kinds) -> Option<view::BodyId> {
    let kind = kinds.find(&id.kind)?;
    Some(view::BodyId::new(kind, id.number, id.part))
}

/// Returns an error of the program's own.
pub(crate) fn problem(error: &InputError) -> Problem {
    let (line, column) = error.line_and_column().unzip();
    let (end_line, end_column) = error.end_line_and_column().unzip();
    Problem {
        place: error.place().into(),
        line: position_to_u32(line),
        column: position_to_u32(column),
        end_line: position_to_u32(end_line),
        end_column: position_to_u32(end_column),
        key: error.key().map(Into::into),
        cause: error.cause().into(),
        remedy: error.remedy().into(),
        is_warning: false,
    }
}

/// Returns a line or column of a text, whose limit of bytes is far below 4 GiB.
fn position_to_u32(number: Option<usize>) -> Option<u32> {
    number.and_then(|number| u32::try_from(number).ok())
}
