//! Bodies: identity, pose, shape and condition.

use super::kind::{BodyKind, Kinds};
use super::pose::{Pose, Vec3};
use serde::{Deserialize, Serialize};
use std::fmt;

/// The identity of a body, which it keeps during the run; displayed as `robot/3` or `connector/0/7`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(from = "BodyIdTuple", into = "BodyIdTuple")]
pub struct BodyId {
    /// Its kind.
    pub kind: BodyKind,
    /// Its number among the bodies of its kind.
    pub number: u32,
    /// Its part, of bodies that have parts.
    pub part: Option<u32>,
}

/// An identity as files and the page have it: kind, number and part.
type BodyIdTuple = (BodyKind, u32, Option<u32>);

impl BodyId {
    /// Returns the identity of a body.
    pub fn new(kind: BodyKind, number: u32, part: Option<u32>) -> Self {
        Self { kind, number, part }
    }
}

impl From<BodyIdTuple> for BodyId {
    fn from((kind, number, part): BodyIdTuple) -> Self {
        Self { kind, number, part }
    }
}

impl From<BodyId> for BodyIdTuple {
    fn from(BodyId { kind, number, part }: BodyId) -> Self {
        (kind, number, part)
    }
}

impl Kinds {
    /// Returns the body with a name such as `robot/3` or `connector/0/7`.
    pub fn parse_body_id(&self, name: &str) -> Option<BodyId> {
        let mut parts = name.split('/');
        let kind = self.find(parts.next()?)?;
        let number = parts.next()?.parse().ok()?;
        let part = parts.next().map(str::parse).transpose().ok()?;
        parts.next().is_none().then_some(BodyId { kind, number, part })
    }
}

impl fmt::Display for BodyId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.kind, self.number)?;
        self.part.map_or(Ok(()), |part| write!(f, "/{part}"))
    }
}

/// Something visible.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Body {
    /// Its kind.
    pub kind: BodyKind,
    /// Its number among the bodies of its kind.
    pub number: u32,
    /// Its part, where the thing has parts.
    pub part: Option<u32>,
    /// Its position and orientation.
    pub pose: Pose,
    /// Its shape.
    pub shape: Shape,
    /// Its condition.
    pub state: BodyCondition,
    /// The velocity over the ground of traffic, and of a moving obstacle, which does not act; zero for all other bodies.
    pub velocity_m_s: Vec3,
}

impl Body {
    /// Creates a body without parts, in plain condition, at rest.
    pub fn new(kind: BodyKind, number: u32, pose: Pose, shape: Shape) -> Self {
        Self {
            kind,
            number,
            part: None,
            pose,
            shape,
            state: BodyCondition::Plain,
            velocity_m_s: [0.0; 3],
        }
    }

    /// Returns the same body as a part of a larger one.
    #[must_use]
    pub fn with_part(self, part: u32) -> Self {
        Self { part: Some(part), ..self }
    }

    /// Returns the same body in another condition, if `is_so`.
    #[must_use]
    pub fn with_condition_if(self, is_so: bool, state: BodyCondition) -> Self {
        if is_so { Self { state, ..self } } else { self }
    }

    /// Returns the same body with a velocity.
    #[must_use]
    pub fn with_velocity(self, velocity_m_s: Vec3) -> Self {
        Self { velocity_m_s, ..self }
    }

    /// Returns whether it has a velocity.
    pub fn is_moving(&self) -> bool {
        self.velocity_m_s != [0.0; 3]
    }

    /// Returns its identity.
    pub fn id(&self) -> BodyId {
        BodyId::new(self.kind, self.number, self.part)
    }

    /// Returns a name that it keeps during the run, such as `robot/3` or `connector/0/7`.
    pub fn name(&self) -> String {
        self.id().to_string()
    }
}

/// The condition of a body.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum BodyCondition {
    /// Nothing special.
    Plain,
    /// The part that leads the others.
    Leading,
    /// Open (doors).
    Open,
    /// The body touches something, or is too close to another agent.
    Touching,
    /// Out of order.
    Failed,
}

impl BodyCondition {
    /// All conditions.
    pub const ALL: [Self; 5] =
        [Self::Plain, Self::Leading, Self::Open, Self::Touching, Self::Failed];

    /// Its name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Plain => "plain",
            Self::Leading => "leading",
            Self::Open => "open",
            Self::Touching => "touching",
            Self::Failed => "failed",
        }
    }
}

/// The shape of a body, around its pose.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase", tag = "type")]
pub enum Shape {
    /// A box.
    Cuboid {
        /// Its extent along its axes, in meters.
        size_m: Vec3,
    },
    /// An upright cylinder.
    Cylinder {
        /// Its radius, in meters.
        radius_m: f64,
        /// Its extent along its third axis, in meters.
        height_m: f64,
    },
    /// A ball.
    Sphere {
        /// Its radius, in meters.
        radius_m: f64,
    },
    /// A polyline; its points are in the frame of the world, regardless of the pose.
    Line {
        /// Its points, in meters.
        points_m: Vec<Vec3>,
        /// Its thickness in meters; 0 for the thinnest line that can be drawn.
        thickness_m: f64,
    },
    /// An arrowhead along its first axis.
    Dart {
        /// Length from tail to tip, in meters.
        length_m: f64,
        /// Width, in meters.
        width_m: f64,
    },
}

#[cfg(test)]
mod tests {
    use super::super::kind::samples::CONNECTOR;
    use super::*;

    #[test]
    fn names_tell_kind_number_and_part() {
        let ball = Shape::Sphere { radius_m: 1.0 };
        let body = Body::new(CONNECTOR, 2, Pose::from_position([0.0; 3]), ball);
        assert_eq!(body.name(), "connector/2");
        assert_eq!(body.with_part(7).name(), "connector/2/7");
    }
}
