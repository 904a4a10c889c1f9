//! An arm in a posture as a picture.

use crate::exit::Failure;
use sidestep::arms::kinematics::{ObstacleSphere, Vector};
use sidestep::kernel::view::{Body, BodyKind, Frame, Pose, Scenery, Shape};
use sidestep::worlds::chain::kinds::{CONNECTOR, RODS};
use sidestep_draw::{PictureOptions, draw};
use sidestep_session::write_png;
use std::path::Path;

/// Drawn thickness of links, and radius of connectors, as fractions of the arm's length: the picture's scale follows from the
/// arm, and a connector is a little thicker than the links that it joins.
const THICKNESS_FRACTION: f64 = 0.012;
const RADIUS_FRACTION: f64 = 0.014;
/// Drawn radius of a target, as a fraction of the arm's length: larger than a connector, so that one at the tip stays
/// visible.
const TARGET_FRACTION: f64 = 0.02;

/// The content of a picture, in the frame of the arm's base.
pub(crate) struct ArmPicture<'a> {
    /// The robot's name, which becomes the title.
    pub(crate) robot: &'a str,
    /// Positions of the connectors in m, from the base out.
    pub(crate) connectors: &'a [Vector],
    /// Target position of the tip, in m.
    pub(crate) target: Option<Vector>,
    /// Spheres in m that the posture had to avoid.
    pub(crate) obstacles: &'a [ObstacleSphere],
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
            bodies: self.static_bodies(length_m),
            names: vec![(CONNECTOR, 0, self.robot.into())],
            groups: Vec::new(),
            earth: Default::default(),
            traffic: None,
        };
        let frame = Frame { bodies: self.arm(length_m), ..Frame::default() };
        let caption = "Positions in m in the frame of the base.";
        let svg = draw(&scenery, &frame, &[], &PictureOptions::page(&scenery, caption))?;
        write_png(path, &svg)
    }

    /// Returns the length of all links together, which the drawn sizes follow.
    fn length_m(&self) -> f64 {
        let links = self.connectors.windows(2);
        // A chain of length 0 would have bodies of size 0, which no picture can be fitted to.
        links.map(|ends| distance_m(&ends[0], &ends[1])).sum::<f64>().max(1e-3)
    }

    fn arm(&self, length_m: f64) -> Vec<Body> {
        let line = Shape::Line {
            points_m: self.connectors.to_vec(),
            thickness_m: THICKNESS_FRACTION * length_m,
        };
        let ball = Shape::Sphere { radius_m: RADIUS_FRACTION * length_m };
        let mut bodies = vec![Body::new(RODS, 0, Pose::from_position([0.0; 3]), line)];
        for (part, at_m) in (0..).zip(self.connectors) {
            let pose = Pose::from_position(*at_m);
            let connector = Body::new(CONNECTOR, 0, pose, ball.clone());
            bodies.push(connector.with_part(part));
        }
        bodies
    }

    fn static_bodies(&self, length_m: f64) -> Vec<Body> {
        let mut bodies = Vec::new();
        for (number, obstacle) in (0..).zip(self.obstacles) {
            let ball = Shape::Sphere { radius_m: obstacle.radius_m };
            let pose = Pose::from_position(obstacle.center_m);
            bodies.push(Body::new(BodyKind::OBSTACLE, number, pose, ball));
        }
        if let Some(at_m) = self.target {
            let ball = Shape::Sphere { radius_m: TARGET_FRACTION * length_m };
            let goal = Body::new(BodyKind::GOAL, 0, Pose::from_position(at_m), ball);
            bodies.push(goal.with_part(0));
        }
        bodies
    }
}

fn distance_m(from: &Vector, to: &Vector) -> f64 {
    let square = (to[0] - from[0]).powi(2) + (to[1] - from[1]).powi(2) + (to[2] - from[2]).powi(2);
    square.sqrt()
}
