//! Answers to the goals of an arm.

use crate::ik::IkEngine;

/// The posture that meets a goal, or else the one that came nearest.
#[derive(Debug, Clone, PartialEq)]
pub struct IkResult {
    /// Whether the goal is met, with all joints inside their limits and no part where it must not
    /// be.
    pub reached: bool,
    /// Distance of the tip from the target in m, along the axes that count, by forward kinematics at
    /// the values.
    pub error_m: f64,
    /// Angle in rad by which the tip is turned otherwise than asked, in [0, pi]; 0 if no orientation
    /// counts.
    pub error_rad: f64,
    /// A value for each variable, inside the limits unless they are ignored; if the goal is not
    /// met, the values that came nearest.
    pub values: Vec<f64>,
    /// Further postures that meet the goal, distinct from this one and from each other, the nearest
    /// to the start first; only where the goal asks for several.
    pub others: Vec<IkSolution>,
    /// The engine that found the answer; [`IkEngine::Chain`] if the connectors led to it.
    pub engine: IkEngine,
    /// Steps over all starts.
    pub iterations: usize,
    /// Postures that it started from.
    pub starts: usize,
    /// The reason why the goal is not met; `None` if it is.
    pub reason: Option<IkFailure>,
}

/// One of several postures that meet a goal.
#[derive(Debug, Clone, PartialEq)]
pub struct IkSolution {
    /// A value for each variable of the arm, rad or m.
    pub values: Vec<f64>,
    /// Distance of the tool from its goal, see [`IkResult::error_m`].
    pub error_m: f64,
    /// Angle of the tool to its goal, see [`IkResult::error_rad`].
    pub error_rad: f64,
}

/// A part of the arm that is where it must not be.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{part} would be {depth_m:.6} m deep in {against}")]
pub struct Collision {
    /// The part that is in another body; of two links of the arm the later one.
    pub part: ArmBodyPart,
    /// The body that it is in.
    pub against: CollidesWith,
    /// How far they overlap in m, above 0.
    pub depth_m: f64,
}

/// How a collision names a part: by its link, or by its rod where no link has a shape.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ArmBodyPart {
    /// The rod from the connector of this index (from 0) to the next.
    #[error("the rod from connector {}", .0 + 1)]
    Rod(usize),
    /// A shape of the link of this name.
    #[error("link `{0}`")]
    Link(String),
}

/// A body that an arm must not touch.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CollidesWith {
    /// The sphere of this index (from 0).
    #[error("obstacle {}", .0 + 1)]
    Sphere(usize),
    /// The arm's own link of this name.
    #[error("link `{0}`")]
    Link(String),
}

/// Why a goal is not met: of the constraints without which it would be, the nearest to being kept.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum IkFailure {
    /// The rods are too short.
    #[error(
        "the target is {far_m:.6} m from the arm's first connector, and its rods reach {reach_m:.6} m"
    )]
    TooFar {
        /// Distance of the target from the first connector in m.
        far_m: f64,
        /// The sum of the rods' greatest lengths in m.
        reach_m: f64,
    },
    /// One rod is longer than all the others together.
    #[error(
        "the target is {far_m:.6} m from the arm's first connector, and the tip comes no nearer than {hole_m:.6} m"
    )]
    TooNear {
        /// Distance of the target from the first connector in m.
        far_m: f64,
        /// The least that the rods allow in m.
        hole_m: f64,
    },
    /// The target can be reached, but only with a joint outside its limits.
    #[error(
        "joint `{joint}` would have to be at {value:.6}, outside {lower:.6} to {upper:.6}; within the limits the nearest \
         posture found is {}",
        off(*error_m, *error_rad)
    )]
    OutsideLimits {
        /// The joint that is the farthest outside, where all joints leave their limits as little as the target allows.
        joint: String,
        /// Its value in rad or m.
        value: f64,
        /// Lowest value allowed.
        lower: f64,
        /// Highest value allowed.
        upper: f64,
        /// Distance of the tip from the target within the limits, in m.
        error_m: f64,
        /// Angle from the orientation asked, in rad; 0 if none counts.
        error_rad: f64,
    },
    /// The target can be reached, but only with a part in a sphere or in another part.
    #[error("{0}")]
    Blocked(Collision),
    /// The tip gets to the target, but no posture was found in which it is turned as asked.
    #[error(
        "the tip can get there, but not turned as asked: the best of {starts} starts is {error_rad:.6} rad off there"
    )]
    NotTurned {
        /// Postures that the search started from.
        starts: usize,
        /// The least angle from the orientation asked with the tip at the target, in rad.
        error_rad: f64,
    },
    /// No start led to the target.
    #[error("no posture was found from {starts} starts; the nearest is {error_m:.6} m off")]
    NotFound {
        /// Postures that it started from.
        starts: usize,
        /// Distance of the nearest from the target in m.
        error_m: f64,
    },
}

/// Returns how far a posture is off, with the angle if one counts.
fn off(error_m: f64, error_rad: f64) -> String {
    if error_rad > 0.0 {
        format!("{error_m:.6} m and {error_rad:.6} rad off")
    } else {
        format!("{error_m:.6} m off")
    }
}
