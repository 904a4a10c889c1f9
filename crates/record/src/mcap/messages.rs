//! Frames as messages of Foxglove's schemas.

use std::collections::{BTreeMap, BTreeSet};
use std::f64::consts::FRAC_PI_2;

use foxglove::messages::{
    ArrowPrimitive, Color, CubePrimitive, CylinderPrimitive, FrameTransform, FrameTransforms, Grid,
    LaserScan, LinePrimitive, LocationFix, Log, PackedElementField, Point3, Pose, PosesInFrame,
    Quaternion, SceneEntity, SceneEntityDeletion, SceneUpdate, SpherePrimitive, Timestamp, Vector2,
    Vector3, line_primitive, log, packed_element_field, scene_entity_deletion,
};
use sidestep_kernel::math;
use sidestep_kernel::view::{
    Body, BodyKind, EarthChart, Frame, Isometry2, LogEvent, Occupancy, OccupancyGrid,
    Pose as ViewPose, Scan, Scenery, Severity, Shape, Vec3,
};

use super::WORLD;

const NS_PER_S: u64 = 1_000_000_000;

/// Converts simulated seconds to nanoseconds.
pub(super) fn to_ns(time_s: f64) -> u64 {
    (time_s.max(0.0) * NS_PER_S as f64).round() as u64
}

fn timestamp(ns: u64) -> Option<Timestamp> {
    let seconds = u32::try_from(ns / NS_PER_S).unwrap_or(u32::MAX);
    Some(Timestamp::new(seconds, (ns % NS_PER_S) as u32))
}

/// Returns the simulated time of a log entry, its own and not that of the frame that brings it.
pub(super) fn log_time_ns(entry: &Log) -> u64 {
    entry.timestamp.map_or(0, |t| u64::from(t.sec()) * NS_PER_S + u64::from(t.nsec()))
}

fn vector([x, y, z]: Vec3) -> Option<Vector3> {
    Some(Vector3 { x, y, z })
}

fn rotation(pose: &ViewPose) -> Option<Quaternion> {
    let [x, y, z, w] = pose.turn;
    Some(Quaternion { x, y, z, w })
}

fn pose(pose: &ViewPose) -> Option<Pose> {
    Some(Pose { position: vector(pose.at_m), orientation: rotation(pose) })
}

/// Returns a vector that was read; missing numbers are 0.
pub(super) fn read_vector(read: Option<&Vector3>) -> Vec3 {
    read.map_or([0.0; 3], |v| [v.x, v.y, v.z])
}

/// Returns a pose that was read; missing parts are the origin, without a turn.
pub(super) fn read_pose(read: Option<&Pose>) -> ViewPose {
    let plain = ViewPose::from_position([0.0; 3]);
    read.map_or(plain, |read| ViewPose {
        at_m: read_vector(read.position.as_ref()),
        turn: read.orientation.as_ref().map_or(plain.turn, |q| [q.x, q.y, q.z, q.w]),
    })
}

fn color([r, g, b]: [u8; 3], a: f64) -> Option<Color> {
    let [r, g, b] = [r, g, b].map(|byte| f64::from(byte) / 255.0);
    Some(Color { r, g, b, a })
}

fn color_of(body: &Body, dimensions: u8) -> Option<Color> {
    let appearance = body.appearance(dimensions);
    color(appearance.color, appearance.opacity)
}

/// Returns the byte of a box in ROS occupancy grids: the probability of a wall in percent, and -1 for unknown.
fn occupancy_byte(occupancy: &Occupancy) -> u8 {
    match occupancy {
        Occupancy::Free => 0,
        Occupancy::Wall => 100,
        Occupancy::Unknown => 255,
    }
}

/// Returns the floor as bytes: 0 free, 100 wall, 255 unknown.
pub(super) fn grid(floor: &OccupancyGrid, now_ns: u64) -> Grid {
    let data: Vec<u8> = floor.boxes.iter().map(occupancy_byte).collect();
    let Isometry2 { origin_m: [x_m, y_m], yaw_rad } = floor.plane;
    Grid {
        timestamp: timestamp(now_ns),
        frame_id: WORLD.into(),
        pose: pose(&ViewPose::from_heading([x_m, y_m, 0.0], yaw_rad)),
        column_count: floor.width,
        cell_size: Some(Vector2 { x: floor.box_m, y: floor.box_m }),
        row_stride: floor.width,
        cell_stride: 1,
        fields: vec![PackedElementField {
            name: "occupancy".into(),
            offset: 0,
            r#type: packed_element_field::NumericType::Uint8 as i32,
        }],
        data: data.into(),
    }
}

/// Returns everything that never moves, as one entity to show or hide.
pub(super) fn scenery(scenery: &Scenery, now_ns: u64) -> SceneUpdate {
    let mut whole = entity("scenery", now_ns);
    scenery.bodies.iter().for_each(|body| add(&mut whole, body, scenery.dimensions));
    SceneUpdate { deletions: Vec::new(), entities: vec![whole] }
}

/// Returns the bodies of a frame; those of the frame before that are gone are deleted.
pub(super) fn scene(
    frame: &Frame,
    now_ns: u64,
    dimensions: u8,
    shown: &mut BTreeSet<String>,
) -> SceneUpdate {
    let mut entities: Vec<SceneEntity> = Vec::new();
    for body in &frame.bodies {
        let name = entity_name(body);
        // Parts of an entity are adjacent.
        match entities.last_mut().filter(|last| last.id == name) {
            Some(last) => add(last, body, dimensions),
            None => {
                let mut new = entity(&name, now_ns);
                add(&mut new, body, dimensions);
                entities.push(new);
            }
        }
    }
    let here: BTreeSet<String> = entities.iter().map(|entity| entity.id.clone()).collect();
    let gone = shown.difference(&here);
    let deletions = gone.map(|name| SceneEntityDeletion {
        timestamp: timestamp(now_ns),
        r#type: scene_entity_deletion::Type::MatchingId as i32,
        id: name.clone(),
    });
    let deletions = deletions.collect();
    *shown = here;
    SceneUpdate { deletions, entities }
}

/// Returns the deletion of everything shown before.
pub(super) fn delete_all(now_ns: u64) -> Vec<SceneEntityDeletion> {
    vec![SceneEntityDeletion {
        timestamp: timestamp(now_ns),
        r#type: scene_entity_deletion::Type::All as i32,
        id: String::new(),
    }]
}

/// Returns the entity that a body belongs to: all connectors of a chain are one, as its rods are.
fn entity_name(body: &Body) -> String {
    format!("{}/{}", body.kind, body.number)
}

fn entity(id: &str, now_ns: u64) -> SceneEntity {
    SceneEntity {
        timestamp: timestamp(now_ns),
        frame_id: WORLD.into(),
        id: id.into(),
        ..SceneEntity::default()
    }
}

fn add(entity: &mut SceneEntity, body: &Body, dimensions: u8) {
    let color = color_of(body, dimensions);
    let at = pose(&body.pose);
    match &body.shape {
        Shape::Cuboid { size_m } => {
            entity.cubes.push(CubePrimitive { pose: at, size: vector(*size_m), color });
        }
        Shape::Cylinder { radius_m, height_m } => entity.cylinders.push(CylinderPrimitive {
            pose: at,
            size: vector([2.0 * radius_m, 2.0 * radius_m, *height_m]),
            bottom_scale: 1.0,
            top_scale: 1.0,
            color,
        }),
        Shape::Sphere { radius_m } => entity.spheres.push(SpherePrimitive {
            pose: at,
            size: vector([2.0 * radius_m; 3]),
            color,
        }),
        Shape::Line { points_m, thickness_m } => entity.lines.push(LinePrimitive {
            r#type: line_primitive::Type::LineStrip as i32,
            pose: at,
            // A line without thickness is drawn as thin as the screen allows, near and far.
            thickness: if *thickness_m > 0.0 { *thickness_m } else { 1.0 },
            scale_invariant: *thickness_m <= 0.0,
            points: points_m.iter().map(|&[x, y, z]| Point3 { x, y, z }).collect(),
            color,
            ..LinePrimitive::default()
        }),
        Shape::Dart { length_m, width_m } => {
            entity.arrows.push(ArrowPrimitive { color, ..arrow(body, *length_m, *width_m) });
        }
    }
    if body.kind.spec().shows_heading {
        entity.arrows.extend(heading_arrow(body));
    }
}

/// Returns an arrow centered on the body, nearly all head.
fn arrow(body: &Body, length_m: f64, width_m: f64) -> ArrowPrimitive {
    let tail =
        ViewPose { at_m: body.pose.transform_point([-0.5 * length_m, 0.0, 0.0]), ..body.pose };
    ArrowPrimitive {
        pose: pose(&tail),
        // Of the length 0.4 is shaft: with less the tail of a short body would not show where it heads.
        shaft_length: 0.4 * length_m,
        shaft_diameter: 0.3 * width_m,
        head_length: 0.6 * length_m,
        head_diameter: width_m,
        ..ArrowPrimitive::default()
    }
}

/// Returns an arrow on top of a body that shows its heading.
fn heading_arrow(body: &Body) -> Option<ArrowPrimitive> {
    let (half_m, top_m) = match body.shape {
        Shape::Cuboid { size_m: [x, _, z] } => (0.5 * x, 0.5 * z),
        Shape::Cylinder { radius_m, height_m } => (radius_m, 0.5 * height_m),
        _ => return None,
    };
    let from = ViewPose { at_m: body.pose.transform_point([0.0, 0.0, top_m]), ..body.pose };
    Some(ArrowPrimitive {
        pose: pose(&from),
        // As long as the body reaches ahead, and thin, so that it covers little of it.
        shaft_length: 0.5 * half_m,
        shaft_diameter: 0.25 * half_m,
        head_length: 0.5 * half_m,
        head_diameter: 0.6 * half_m,
        color: color([0x20, 0x20, 0x20], 1.0),
    })
}

fn agents(frame: &Frame) -> impl Iterator<Item = &Body> {
    frame.bodies.iter().filter(|body| body.kind.is_agent())
}

/// Returns the pose of each agent, as the frame of reference of its name.
pub(super) fn transforms(frame: &Frame, now_ns: u64) -> FrameTransforms {
    let now = timestamp(now_ns);
    let transforms = agents(frame).map(|body| FrameTransform {
        timestamp: now,
        parent_frame_id: WORLD.into(),
        child_frame_id: body.name(),
        translation: vector(body.pose.at_m),
        rotation: rotation(&body.pose),
    });
    FrameTransforms { transforms: transforms.collect() }
}

/// Returns the poses of the agents, by kind.
pub(super) fn poses_by_kind(frame: &Frame, now_ns: u64) -> BTreeMap<BodyKind, PosesInFrame> {
    let timestamp = timestamp(now_ns);
    let mut by_kind = BTreeMap::new();
    for body in agents(frame) {
        let of_kind = by_kind.entry(body.kind).or_insert_with(|| PosesInFrame {
            timestamp,
            frame_id: WORLD.into(),
            poses: Vec::new(),
        });
        of_kind.poses.extend(pose(&body.pose));
    }
    by_kind
}

/// Returns where on earth each agent is.
pub(super) fn location_fixes<'a>(
    frame: &'a Frame,
    chart: &'a EarthChart,
    now_ns: u64,
) -> impl Iterator<Item = (&'a Body, LocationFix)> {
    agents(frame).map(move |body| {
        let [x_m, y_m, altitude_m] = body.pose.at_m;
        let [latitude, longitude] = chart.lat_lon_deg([x_m, y_m]);
        let [ahead_x, ahead_y, _] = body.pose.rotate([1.0, 0.0, 0.0]);
        let heading_rad = chart.true_heading_rad([x_m, y_m], math::atan2(ahead_y, ahead_x));
        let fix = LocationFix {
            timestamp: timestamp(now_ns),
            frame_id: body.name(),
            latitude,
            longitude,
            altitude: altitude_m,
            // The schema's headings are clockwise from north.
            heading: Some(FRAC_PI_2 - heading_rad),
            ..LocationFix::default()
        };
        (body, fix)
    })
}

/// Returns a scan with evenly spaced beams, as the schema requires.
pub(super) fn laser_scan(scan: &Scan, now_ns: u64) -> LaserScan {
    let (start_angle, end_angle, ranges) = scan.resample_evenly(f64::INFINITY);
    LaserScan {
        timestamp: timestamp(now_ns),
        frame_id: WORLD.into(),
        pose: pose(&scan.pose),
        start_angle,
        end_angle,
        ranges,
        intensities: Vec::new(),
    }
}

/// Returns the events of a frame of a run that started at `start_ns`, and how many are left out.
pub(super) fn log(frame: &Frame, cycle_s: f64, start_ns: u64) -> Vec<Log> {
    let event_ns = |event: &LogEvent| start_ns + to_ns(event.cycle as f64 * cycle_s);
    let mut logs: Vec<Log> =
        frame.log.iter().map(|event| event_log(event, event_ns(event))).collect();
    if frame.log_left_out > 0 {
        logs.push(Log {
            timestamp: timestamp(start_ns + to_ns(frame.time_s)),
            level: log_level(Severity::Warning),
            message: format!("{} more events are not told", frame.log_left_out),
            name: "log".into(),
            ..Log::default()
        });
    }
    logs
}

fn event_log(event: &LogEvent, event_ns: u64) -> Log {
    Log {
        timestamp: timestamp(event_ns),
        level: log_level(event.level),
        message: format!("{} {}", event.name(), event.words),
        name: event.name(),
        ..Log::default()
    }
}

fn log_level(level: Severity) -> i32 {
    let level = match level {
        Severity::Info => log::Level::Info,
        Severity::Warning => log::Level::Warning,
        Severity::Error => log::Level::Error,
    };
    level as i32
}

#[cfg(test)]
mod tests {
    use super::*;
    use sidestep_airspace::kinds::ZONE;
    use sidestep_robots::kinds::{DOOR, PERSON, ROBOT};

    #[test]
    fn every_kind_has_the_colors_that_pictures_have() {
        let ball = Shape::Sphere { radius_m: 1.0 };
        for kind in [ROBOT, PERSON, DOOR, ZONE, BodyKind::OBSTACLE, BodyKind::GOAL] {
            for dimensions in [2, 3] {
                let body = Body::new(kind, 4, ViewPose::from_position([0.0; 3]), ball.clone());
                let appearance = body.appearance(dimensions);
                let frame = Frame { bodies: vec![body], ..Frame::default() };
                let update = scene(&frame, 0, dimensions, &mut BTreeSet::new());
                let shown = update.entities[0].spheres[0].color.expect("a color");
                let bytes = [shown.r, shown.g, shown.b].map(|part| (255.0 * part).round() as u8);
                assert_eq!((bytes, shown.a), (appearance.color, appearance.opacity), "{kind}");
            }
        }
    }

    #[test]
    fn times_are_told_in_nanoseconds_without_loss() {
        assert_eq!(to_ns(1.5), 1_500_000_000);
        assert_eq!(to_ns(0.1 * 3.0), 300_000_000);
        assert_eq!(to_ns(-1.0), 0);
        let entry = Log { timestamp: timestamp(7_000_000_001), ..Log::default() };
        assert_eq!(log_time_ns(&entry), 7_000_000_001);
    }
}
