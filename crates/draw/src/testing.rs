//! Small sceneries for tests.

use sidestep_kernel::view::{
    Body, BodyKind, Frame, Isometry2, Occupancy, OccupancyGrid, Pose, Scenery, Shape, Vec3,
};

/// Returns an empty floor of boxes of 1 m.
pub(crate) fn plane(width: u32, height: u32) -> Scenery {
    let boxes = vec![Occupancy::Free; (width * height) as usize];
    let floor = OccupancyGrid { width, height, box_m: 1.0, plane: Isometry2::default(), boxes };
    Scenery { floor: Some(floor), ..open(2) }
}

/// Returns empty scenery.
pub(crate) fn open(dimensions: u8) -> Scenery {
    let name = "A title that wraps where the picture is small, as it is here".into();
    let earth = Default::default();
    Scenery {
        name,
        dimensions,
        cycle_s: 1.0,
        floor: None,
        bodies: vec![],
        names: vec![],
        groups: vec![],
        earth,
        traffic: None,
    }
}

pub(crate) fn ball(kind: BodyKind, number: u32, at_m: Vec3, radius_m: f64) -> Body {
    Body::new(kind, number, Pose::from_position(at_m), Shape::Sphere { radius_m })
}

pub(crate) fn moment(bodies: Vec<Body>) -> Frame {
    Frame { bodies, ..Frame::default() }
}
