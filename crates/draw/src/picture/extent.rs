//! The extent of a picture, and checks that it can be drawn at all.

use super::Scene;
use super::canvas::Camera;
use crate::error::DrawError;
use sidestep_kernel::view::{Body, BodyKind, Frame, OccupancyGrid, Scenery, Shape, Trail, Vec3};

/// Most boxes of a map: 16384 x 16384.
const MAX_BOXES: u64 = 1 << 28;
/// Largest number of bodies, their points, and points of trails together: a picture of as many is some hundred megabytes
/// of SVG.
const MAX_PARTS: u64 = 1 << 22;
/// Largest coordinate, meters: beyond it, pictures show nothing useful.
const MAX_COORDINATE_M: f64 = 1e9;
/// Margin around the shown area, as a fraction of its longest side.
const MARGIN_FRACTION: f64 = 0.03;
/// Least length of a side, as a fraction of the longest: bodies in a row would otherwise make a picture of no height.
const MIN_SIDE_FRACTION: f64 = 0.2;

/// The lower and the upper corner of a box in meters.
pub(super) type BoxM = [Vec3; 2];

/// Returns the number of points that a body is drawn with, which limits the size of a picture.
fn point_count(body: &Body) -> usize {
    match &body.shape {
        Shape::Line { points_m, .. } => points_m.len(),
        _ => 1,
    }
}

/// Refuses content that no picture can be drawn of.
pub(crate) fn check_content(
    scenery: &Scenery,
    frame: &Frame,
    trails: &[Trail],
) -> Result<(), DrawError> {
    if let Some(floor) = &scenery.floor {
        check_floor(floor)?;
    }
    let mut bodies = scenery.bodies.iter().chain(&frame.bodies);
    let found = bodies.clone().map(point_count).sum::<usize>();
    let found = (found + trails.iter().map(|trail| trail.points.len()).sum::<usize>()) as u64;
    if found > MAX_PARTS {
        return Err(DrawError::TooLarge { what: "bodies", found, limit: MAX_PARTS });
    }
    bodies.try_for_each(check_body)?;
    trails.iter().flat_map(|trail| &trail.points).try_for_each(|(_, at)| check_place(at))
}

fn check_floor(floor: &OccupancyGrid) -> Result<(), DrawError> {
    let boxes = u64::from(floor.width) * u64::from(floor.height);
    if boxes > MAX_BOXES {
        return Err(DrawError::TooLarge {
            what: "boxes of the map",
            found: boxes,
            limit: MAX_BOXES,
        });
    }
    DrawError::positive("number of the map's boxes", boxes as f64)?;
    DrawError::length("boxes of the map", boxes as usize, floor.boxes.len())?;
    DrawError::positive("box size in m", floor.box_m)?;
    let [lo, hi] = floor_bounds(floor);
    check_place(&lo)?;
    check_place(&hi)?;
    let size_m = [hi[0] - lo[0], hi[1] - lo[1]];
    size_m.into_iter().try_for_each(|m| DrawError::positive("size of the map in m", m).map(drop))
}

fn check_body(body: &Body) -> Result<(), DrawError> {
    check_place(&body.pose.at_m)?;
    check_place(&body.velocity_m_s)?;
    check_place(&[body.pose.turn[0], body.pose.turn[1], body.pose.turn[2]])?;
    check_place(&[body.pose.turn[3], 0.0, 0.0])?;
    match &body.shape {
        Shape::Cuboid { size_m } => size_m.iter().try_for_each(|&m| check_size(m)),
        Shape::Cylinder { radius_m: a, height_m: b } | Shape::Dart { length_m: a, width_m: b } => {
            check_size(*a).and_then(|()| check_size(*b))
        }
        Shape::Sphere { radius_m } => check_size(*radius_m),
        Shape::Line { points_m, thickness_m } => {
            check_size(*thickness_m)?;
            points_m.iter().try_for_each(check_place)
        }
    }
}

fn check_place(at: &Vec3) -> Result<(), DrawError> {
    match at.iter().find(|x| !(-MAX_COORDINATE_M..=MAX_COORDINATE_M).contains(*x)) {
        None => Ok(()),
        Some(&value) => {
            Err(DrawError::Value { what: "a coordinate in m", value, must: "from -1e9 to 1e9" })
        }
    }
}

fn check_size(value: f64) -> Result<(), DrawError> {
    if !(0.0..=MAX_COORDINATE_M).contains(&value) {
        return Err(DrawError::Value { what: "a size in m", value, must: "from 0 to 1e9" });
    }
    Ok(())
}

fn floor_bounds(floor: &OccupancyGrid) -> [Vec3; 2] {
    let mut bounds = BoundingBox::default();
    floor.corners_m().into_iter().for_each(|[x, y]| bounds.include([x, y, 0.0], 0.0));
    [bounds.lo, bounds.hi]
}

/// Returns the lower and upper corner of everything shown; never empty.
pub(super) fn scene_bounds(scene: &Scene<'_>) -> Result<[Vec3; 2], DrawError> {
    if let Some(floor) = &scene.scenery.floor
        && scene.is_plane()
    {
        return Ok(floor_bounds(floor));
    }
    let mut bounds = BoundingBox::default();
    scene.visible().into_iter().for_each(|body| bounds.include_body(body));
    let places = scene.trails.iter().flat_map(|trail| trail.points);
    places.for_each(|(_, at)| bounds.include(*at, 0.0));
    bounds.with_margin()
}

/// Returns the lower and upper corner of a film's view: those of the floor, or otherwise of all
/// places where things other than obstacles are at some time.
pub(crate) fn animation_bounds(
    scenery: &Scenery,
    frames: &[Frame],
) -> Result<[Vec3; 2], DrawError> {
    if let Some(floor) = &scenery.floor
        && scenery.dimensions == 2
    {
        check_floor(floor)?;
        return Ok(floor_bounds(floor));
    }
    let mut bounds = BoundingBox::default();
    for body in frames.iter().flat_map(|frame| &frame.bodies) {
        if body.kind != BodyKind::OBSTACLE {
            check_body(body)?;
            bounds.include_body(body);
        }
    }
    bounds.with_margin()
}

/// Returns the rectangle in which a box is seen.
pub(crate) fn projected_bounds(camera: Camera, box_m: [Vec3; 2]) -> [[f64; 2]; 2] {
    let across = Camera::range(camera.right, box_m);
    let upward = Camera::range(camera.up, box_m);
    [[across[0], upward[0]], [across[1], upward[1]]]
}

struct BoundingBox {
    lo: Vec3,
    hi: Vec3,
}

impl Default for BoundingBox {
    fn default() -> Self {
        Self { lo: [f64::INFINITY; 3], hi: [f64::NEG_INFINITY; 3] }
    }
}

impl BoundingBox {
    fn include(&mut self, at: Vec3, by_m: f64) {
        for (k, x) in at.into_iter().enumerate() {
            self.lo[k] = self.lo[k].min(x - by_m);
            self.hi[k] = self.hi[k].max(x + by_m);
        }
    }

    fn include_body(&mut self, body: &Body) {
        let at = body.pose.at_m;
        match &body.shape {
            Shape::Line { points_m, thickness_m } => {
                points_m.iter().for_each(|&point| self.include(point, 0.5 * thickness_m));
            }
            Shape::Cuboid { size_m } => {
                let half = size_m.map(|m| 0.5 * m);
                for corner in super::canvas::corners([half.map(|m| -m), half]) {
                    self.include(body.pose.transform_point(corner), 0.0);
                }
            }
            Shape::Cylinder { radius_m, .. } | Shape::Sphere { radius_m } => {
                self.include(at, *radius_m);
            }
            Shape::Dart { length_m, .. } => self.include(at, 0.5 * length_m),
        }
    }

    /// Adds a margin on all sides, and widens a side that is very short compared with the others.
    fn with_margin(self) -> Result<[Vec3; 2], DrawError> {
        if self.lo[0] > self.hi[0] {
            return Ok([[0.0; 3], [1.0; 3]]);
        }
        let sides_m: Vec3 = std::array::from_fn(|k| self.hi[k] - self.lo[k]);
        let longest_m = sides_m.into_iter().fold(0.0, f64::max);
        let least_m = if longest_m > 0.0 { MIN_SIDE_FRACTION * longest_m } else { 1.0 };
        let by_m =
            sides_m.map(|side_m| MARGIN_FRACTION * longest_m + 0.5 * (least_m - side_m).max(0.0));
        let lo: Vec3 = std::array::from_fn(|k| self.lo[k] - by_m[k]);
        let hi: Vec3 = std::array::from_fn(|k| self.hi[k] + by_m[k]);
        for side_m in std::array::from_fn::<f64, 3, _>(|k| hi[k] - lo[k]) {
            DrawError::positive("extent of what is shown in m", side_m)?;
        }
        Ok([lo, hi])
    }
}
