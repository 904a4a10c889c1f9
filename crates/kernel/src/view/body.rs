//! Bodies: what they are, where, and what they look like.

use super::pose::{Place, Pose};
use serde::{Deserialize, Serialize};
use std::fmt;

/// Which body: its kind, its number, and its part of things that have parts.
pub type Who = (Kind, u32, Option<u32>);

/// Something that can be seen.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Body {
    /// What it is.
    pub kind: Kind,
    /// Which one of its kind.
    pub number: u32,
    /// Which part of it, of things that have parts.
    pub part: Option<u32>,
    /// Where it is and where it looks.
    pub pose: Pose,
    /// What it looks like.
    pub shape: Shape,
    /// How it is.
    pub state: Condition,
    /// Where it is carried, of things that do not act; zero for those that stand still.
    pub velocity_m_s: Place,
}

impl Body {
    /// A body without parts, in order.
    pub fn new(kind: Kind, number: u32, pose: Pose, shape: Shape) -> Self {
        Self {
            kind,
            number,
            part: None,
            pose,
            shape,
            state: Condition::Plain,
            velocity_m_s: [0.0; 3],
        }
    }

    /// The same as a part of a larger thing.
    #[must_use]
    pub fn part(self, part: u32) -> Self {
        Self { part: Some(part), ..self }
    }

    /// The same in another condition, if `is_so`.
    #[must_use]
    pub fn when(self, is_so: bool, state: Condition) -> Self {
        if is_so { Self { state, ..self } } else { self }
    }

    /// The same, carried along.
    #[must_use]
    pub fn moving(self, velocity_m_s: Place) -> Self {
        Self { velocity_m_s, ..self }
    }

    /// Whether it is carried along.
    pub fn moves(&self) -> bool {
        self.velocity_m_s != [0.0; 3]
    }

    /// Which body it is.
    pub fn who(&self) -> Who {
        (self.kind, self.number, self.part)
    }

    /// A name that it keeps during the run, such as `robot/3` or `connector/0/7`.
    pub fn name(&self) -> String {
        match self.part {
            Some(part) => format!("{}/{}/{part}", self.kind, self.number),
            None => format!("{}/{}", self.kind, self.number),
        }
    }
}

/// Kinds of things.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// A robot.
    Robot,
    /// A person, or something else that walks about.
    Person,
    /// A door.
    Door,
    /// A joint of a chain.
    Connector,
    /// The rods of a chain.
    Rods,
    /// An airplane.
    Airplane,
    /// What is to be kept free around an airplane.
    Zone,
    /// Something in the way.
    Obstacle,
    /// A place to go to.
    Goal,
    /// A place to come from.
    Start,
}

impl Kind {
    /// Its name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Robot => "robot",
            Self::Person => "person",
            Self::Door => "door",
            Self::Connector => "connector",
            Self::Rods => "rods",
            Self::Airplane => "airplane",
            Self::Zone => "zone",
            Self::Obstacle => "obstacle",
            Self::Goal => "goal",
            Self::Start => "start",
        }
    }

    /// Whether it acts: what a table of trajectories is about.
    pub fn is_agent(self) -> bool {
        matches!(self, Self::Robot | Self::Connector | Self::Airplane)
    }
}

impl fmt::Display for Kind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// How a body is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Condition {
    /// Nothing special.
    Plain,
    /// Open, of doors.
    Open,
    /// Touches something, or is too near to somebody.
    Touching,
    /// Does not work any more.
    Failed,
}

/// What a body looks like, around its pose.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase", tag = "type")]
pub enum Shape {
    /// A box.
    Cuboid {
        /// Its extent along its axes.
        size_m: Place,
    },
    /// An upright cylinder.
    Cylinder {
        /// Its radius.
        radius_m: f64,
        /// Its extent along its third axis.
        height_m: f64,
    },
    /// A ball.
    Sphere {
        /// Its radius.
        radius_m: f64,
    },
    /// A line from point to point; the points are those of the world, whatever the pose.
    Line {
        /// Its points.
        points_m: Vec<Place>,
        /// How thick it is; 0 for as thin as can be drawn.
        thickness_m: f64,
    },
    /// An arrowhead along its first axis.
    Dart {
        /// From tail to tip.
        length_m: f64,
        /// Across.
        width_m: f64,
    },
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_tell_kind_number_and_part() {
        let ball = Shape::Sphere { radius_m: 1.0 };
        let body = Body::new(Kind::Connector, 2, Pose::at([0.0; 3]), ball);
        assert_eq!(body.name(), "connector/2");
        assert_eq!(body.part(7).name(), "connector/2/7");
    }
}
