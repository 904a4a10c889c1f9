//! Goals of an arm, and the answers.

use super::super::pose::Vector;
use crate::arms::ik::Engine;
use sidestep_kernel::InputError;

/// A sphere that no rod of the arm may enter. Rods are thin lines, so the radius must include the
/// arm's thickness.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sphere {
    /// Center in m, in the base's frame.
    pub center_m: Vector,
    /// Radius in m.
    pub radius_m: f64,
}

/// A target for the tip of an arm.
#[derive(Debug, Clone, PartialEq)]
pub struct ArmGoal {
    /// Target in m, in the base's frame.
    pub target_m: Vector,
    /// Distance at which the target counts as reached, in m.
    pub tolerance_m: f64,
    /// The engine. [`Engine::Chain`] starts from the connectors' solution; all others work on the
    /// joints from the first step.
    pub engine: Engine,
    /// Random postures to start from after the given one.
    pub restarts: usize,
    /// Random seed of these postures.
    pub seed: u64,
    /// Whether joints may be outside their limits.
    pub ignore_limits: bool,
    /// Spheres that no rod may enter.
    pub spheres: Vec<Sphere>,
}

impl ArmGoal {
    /// Returns a goal for the tip at `target_m` to 1e-6 m, with 100 restarts, inside the limits.
    pub fn new(target_m: Vector) -> Self {
        Self {
            target_m,
            tolerance_m: 1e-6,
            engine: Engine::Auto,
            restarts: 100,
            seed: 0,
            ignore_limits: false,
            spheres: Vec::new(),
        }
    }

    pub(super) fn check(&self) -> Result<(), InputError> {
        if !self.target_m.iter().all(|x| x.abs() <= 1e7) {
            let cause = format!("is {:?}", self.target_m);
            return Err(InputError::new("target", cause, "give finite coordinates up to 1e7 m"));
        }
        if !(self.tolerance_m > 0.0 && self.tolerance_m.is_finite()) {
            let cause = format!("is {} m", self.tolerance_m);
            return Err(InputError::new("tolerance", cause, "give a length above 0"));
        }
        let is_right = |s: &Sphere| {
            s.center_m.iter().chain([&s.radius_m]).all(|x| x.abs() <= 1e7) && s.radius_m >= 0.0
        };
        match self.spheres.iter().position(|s| !is_right(s)) {
            None => Ok(()),
            Some(i) => {
                let cause = format!("is {:?}", self.spheres[i]);
                let remedy = "give finite coordinates and a radius that is not negative";
                Err(InputError::new(format!("obstacle {}", i + 1), cause, remedy))
            }
        }
    }
}

/// The answer to a goal.
#[derive(Debug, Clone, PartialEq)]
pub struct ArmAnswer {
    /// Whether the goal is met, with all joints inside their limits and no rod in a sphere.
    pub reached: bool,
    /// Distance of the tip from the target in m, by forward kinematics at the values.
    pub error_m: f64,
    /// A value for each variable, inside the limits unless they are ignored; if the goal is not
    /// met, the values that came nearest.
    pub values: Vec<f64>,
    /// The engine that found the answer; [`Engine::Chain`] if the connectors led to it.
    pub engine: Engine,
    /// Steps over all starts.
    pub iterations: usize,
    /// Postures that it started from.
    pub starts: usize,
    /// The reason why the goal is not met; `None` if it is.
    pub reason: Option<ArmReason>,
}

/// A rod that is in a sphere.
#[derive(Debug, Clone, PartialEq)]
pub struct Hit {
    /// Index of the connector (from 0) from which the rod leads to the next.
    pub rod: usize,
    /// Index of the sphere.
    pub sphere: usize,
    /// Depth in m.
    pub depth_m: f64,
}

/// The reason why a goal is not met.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ArmReason {
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
    #[error("joint `{joint}` would have to be at {value:.6}, outside {lower:.6} to {upper:.6}")]
    OutsideLimits {
        /// Its name.
        joint: String,
        /// Its value in rad or m.
        value: f64,
        /// Lowest value allowed.
        lower: f64,
        /// Highest value allowed.
        upper: f64,
    },
    /// The target can be reached, but only with a rod in a sphere.
    #[error("the rod from connector {} would be {:.6} m deep in obstacle {}", .0.rod + 1, .0.depth_m, .0.sphere + 1)]
    Blocked(Hit),
    /// No start led to the target.
    #[error("no posture was found from {starts} starts; the nearest is {error_m:.6} m off")]
    NotFound {
        /// Postures that it started from.
        starts: usize,
        /// Distance of the nearest from the target in m.
        error_m: f64,
    },
}
