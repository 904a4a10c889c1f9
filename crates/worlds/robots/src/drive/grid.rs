//! Places of a body on the map: its continuous pose, and the boxes in which it stands.

use crate::world::RobotsWorld;
use sidestep_kernel::EntityId;
use sidestep_kernel::math::{cos, sin, wrap_angle};
use sidestep_map::{Cell, GridMap};
use sidestep_planners::GridPose;
use std::f64::consts::FRAC_PI_2;
use std::sync::Arc;

/// A pose in a plane.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Pose2 {
    /// Position in meters.
    pub at_m: [f64; 2],
    /// Heading in radians, counterclockwise from the x axis.
    pub yaw_rad: f64,
}

impl Pose2 {
    /// Returns a pose that is given in the frame of this one, in the frame of which this one is given.
    pub fn compose(&self, inner: &Self) -> Self {
        Self {
            at_m: self.transform_point(inner.at_m),
            yaw_rad: wrap_angle(self.yaw_rad + inner.yaw_rad),
        }
    }

    /// Returns the pose of the outer frame in this one.
    pub fn inverse(&self) -> Self {
        let turned = Self { at_m: [0.0; 2], yaw_rad: -self.yaw_rad };
        let [x_m, y_m] = turned.transform_point(self.at_m);
        Self { at_m: [-x_m, -y_m], yaw_rad: -self.yaw_rad }
    }

    /// Returns a point of this frame in the outer one, in meters.
    pub fn transform_point(&self, [x_m, y_m]: [f64; 2]) -> [f64; 2] {
        let s = sin(self.yaw_rad);
        let c = cos(self.yaw_rad);
        [self.at_m[0] + c * x_m - s * y_m, self.at_m[1] + s * x_m + c * y_m]
    }

    /// Returns whether all of its numbers are finite.
    pub fn is_finite(&self) -> bool {
        self.at_m.iter().all(|m| m.is_finite()) && self.yaw_rad.is_finite()
    }
}

/// The places of a robot's body on the map of its scenario.
#[derive(Debug, Clone)]
pub struct BodyGrid {
    map: Arc<GridMap>,
    /// Width and height of the body in boxes.
    size: [u32; 2],
}

impl BodyGrid {
    /// Returns the places of a robot; none for a body that is not there.
    pub fn new(world: &RobotsWorld, id: EntityId) -> Option<Self> {
        world.robot_model(id)?;
        let ty = world.type_of(id);
        Some(Self { map: world.map.clone(), size: [ty.size.0, ty.size.1] })
    }

    /// Returns the side of a box in meters.
    pub fn box_m(&self) -> f64 {
        self.map.box_size_m
    }

    /// Returns the side of the body in boxes.
    pub fn side_boxes(&self) -> u32 {
        self.size[0]
    }

    /// Returns the pose of a body that stands exactly in its boxes.
    pub fn center(&self, pose: GridPose) -> Pose2 {
        let [width, height] = self.size.map(f64::from);
        let x_m = (f64::from(pose.col) + width / 2.0) * self.box_m();
        let y_m = (f64::from(pose.row) + height / 2.0) * self.box_m();
        Pose2 {
            at_m: self.map.plane.transform_point([x_m, y_m]),
            yaw_rad: wrap_angle(self.map.plane.yaw_rad + f64::from(pose.heading) * FRAC_PI_2),
        }
    }

    /// Returns the column and the row of the body's lower-left corner, as fractions of boxes.
    pub fn corner_boxes(&self, pose: &Pose2) -> [f64; 2] {
        let [x_m, y_m] = self.map.plane.inverse_transform_point(pose.at_m);
        let [width, height] = self.size.map(f64::from);
        [x_m / self.box_m() - width / 2.0, y_m / self.box_m() - height / 2.0]
    }

    /// Returns the nearest boxes and heading; none where the body would not be on the map.
    pub fn nearest(&self, pose: &Pose2) -> Option<GridPose> {
        let [col, row] = self.corner_boxes(pose).map(f64::round);
        let quarters = ((pose.yaw_rad - self.map.plane.yaw_rad) / FRAC_PI_2).round();
        let last_col = f64::from(self.map.width()) - f64::from(self.size[0]);
        let last_row = f64::from(self.map.height()) - f64::from(self.size[1]);
        let is_on_map = (0.0..=last_col).contains(&col) && (0.0..=last_row).contains(&row);
        is_on_map.then(|| GridPose {
            col: col as u32,
            row: row as u32,
            heading: quarters.rem_euclid(4.0) as u8,
        })
    }

    /// Returns whether a box of the map is free; a box outside of the map is not.
    pub fn is_free_box(&self, col: i64, row: i64) -> bool {
        let is_on_map = (0..i64::from(self.map.width())).contains(&col)
            && (0..i64::from(self.map.height())).contains(&row);
        is_on_map && self.map.cell(col as u32, row as u32) == Cell::Free
    }

    /// Returns whether the body fits at a place, by its lower-left box.
    pub fn fits(&self, col: i64, row: i64) -> bool {
        let [width, height] = self.size.map(i64::from);
        (0..width).all(|dx| (0..height).all(|dy| self.is_free_box(col + dx, row + dy)))
    }

    /// Returns whether the center of the body is on a free box.
    pub fn is_inside(&self, pose: &Pose2) -> bool {
        let [x_m, y_m] = self.map.plane.inverse_transform_point(pose.at_m);
        let col = (x_m / self.box_m()).floor();
        let row = (y_m / self.box_m()).floor();
        col.is_finite() && row.is_finite() && self.is_free_box(col as i64, row as i64)
    }
}

/// A box is kept until the body is off its center by so many boxes: half a box, and what noise of a localization adds.
const KEPT_BOXES: f64 = 0.6;

/// A heading is kept until the body is off it by so much: half a quarter turn, and what noise adds.
const KEPT_RAD: f64 = std::f64::consts::FRAC_PI_4 + 0.14;

/// The boxes and the heading of a robot, which noise of its localization does not flip.
#[derive(Debug, Clone)]
pub struct GridLocalizer {
    grid: BodyGrid,
    present: Option<GridPose>,
}

impl GridLocalizer {
    /// Returns a localizer that knows nothing yet.
    pub fn new(grid: BodyGrid) -> Self {
        Self { grid, present: None }
    }

    /// Returns the boxes and the heading by the last pose; none off the map, and before the first one.
    pub fn present(&self) -> Option<GridPose> {
        self.present
    }

    /// Returns the boxes and the heading by a pose in the frame of the map; none off the map.
    pub fn update(&mut self, pose: &Pose2) -> Option<GridPose> {
        let nearest = self.grid.nearest(pose);
        let is_kept = nearest.is_some() && self.present.is_some_and(|at| self.is_near(pose, at));
        if !is_kept {
            self.present = nearest;
        }
        self.present
    }

    fn is_near(&self, pose: &Pose2, at: GridPose) -> bool {
        let [col, row] = self.grid.corner_boxes(pose);
        let off_boxes = (col - f64::from(at.col)).abs().max((row - f64::from(at.row)).abs());
        let off_rad = wrap_angle(pose.yaw_rad - self.grid.center(at).yaw_rad).abs();
        off_boxes <= KEPT_BOXES && off_rad <= KEPT_RAD
    }
}
