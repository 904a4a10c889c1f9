//! An arm in a posture as a picture.

use crate::exit::Failure;
use sidestep::kernel::view::{Body, Frame, Kind, Pose, Scenery, Shape};
use sidestep::worlds::chain::kinematics::{Sphere, Vector};
use sidestep_draw::{Options, draw};
use sidestep_session::write_png;
use std::path::Path;

/// Drawn thickness of links, and radius of connectors, as parts of the arm's length.
const THICKNESS: f64 = 0.012;
const RADIUS: f64 = 0.014;
/// Drawn radius of a target, as a part of the arm's length.
const TARGET: f64 = 0.02;

/// The content of a picture.
pub(crate) struct ArmPicture<'a> {
    /// Name of the robot.
    pub(crate) robot: &'a str,
    /// Positions of the connectors in m, from the base out.
    pub(crate) connectors: &'a [Vector],
    /// Target position of the tip, in m.
    pub(crate) target: Option<Vector>,
    /// The obstacles in the way.
    pub(crate) obstacles: &'a [Sphere],
}

impl ArmPicture<'_> {
    /// Writes the picture as PNG.
    ///
    /// # Errors
    /// When it cannot be drawn or written.
    pub(crate) fn write(&self, path: &Path) -> Result<(), Failure> {
        let length_m = self.length_m();
        let scenery = Scenery {
            name: self.robot.into(),
            dimensions: 3,
            cycle_s: 1.0,
            floor: None,
            bodies: self.still(length_m),
            names: vec![(Kind::Connector, 0, self.robot.into())],
        };
        let frame = Frame { bodies: self.arm(length_m), ..Frame::default() };
        let caption = "Positions in m in the frame of the base.";
        let svg = draw(&scenery, &frame, &[], &Options::page(&scenery, caption))?;
        write_png(path, &svg)
    }

    /// Returns the length of all links together, which the drawn sizes follow.
    fn length_m(&self) -> f64 {
        let apart = |pair: &[Vector]| {
            let square = |k: usize| (pair[1][k] - pair[0][k]).powi(2);
            (square(0) + square(1) + square(2)).sqrt()
        };
        self.connectors.windows(2).map(apart).sum::<f64>().max(1e-3)
    }

    fn arm(&self, length_m: f64) -> Vec<Body> {
        let line =
            Shape::Line { points_m: self.connectors.to_vec(), thickness_m: THICKNESS * length_m };
        let ball = Shape::Sphere { radius_m: RADIUS * length_m };
        let connector = |(part, at_m): (u32, &Vector)| {
            Body::new(Kind::Connector, 0, Pose::at(*at_m), ball.clone()).part(part)
        };
        let links = Body::new(Kind::Rods, 0, Pose::at([0.0; 3]), line);
        std::iter::once(links).chain((0..).zip(self.connectors).map(connector)).collect()
    }

    fn still(&self, length_m: f64) -> Vec<Body> {
        let sphere = |(number, it): (u32, &Sphere)| {
            let ball = Shape::Sphere { radius_m: it.radius_m };
            Body::new(Kind::Obstacle, number, Pose::at(it.center_m), ball)
        };
        let target = self.target.map(|at_m| {
            let ball = Shape::Sphere { radius_m: TARGET * length_m };
            Body::new(Kind::Goal, 0, Pose::at(at_m), ball).part(0)
        });
        (0..).zip(self.obstacles).map(sphere).chain(target).collect()
    }
}
