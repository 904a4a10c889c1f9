//! Goals of an arm.

use super::super::body::ArmBody;
use super::super::transform::{Transform, Vector};
use crate::ik::IkEngine;
use sidestep_kernel::InputError;

/// Most postures that one goal may ask for: each one found is compared with all before it.
pub const MAX_SOLUTIONS: usize = 1000;

/// A sphere that no part of the arm may enter. Where the arm's links have no shapes, its rods are
/// thin lines, so the radius must include the arm's thickness.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ObstacleSphere {
    /// Center in m, in the base's frame.
    pub center_m: Vector,
    /// Radius in m; 0 for a point.
    pub radius_m: f64,
}

impl ObstacleSphere {
    fn is_in_range(&self) -> bool {
        let mut numbers = self.center_m.iter().chain([&self.radius_m]);
        numbers.all(|x| x.abs() <= 1e7) && self.radius_m >= 0.0
    }
}

/// An axis of the tip's frame, as the column of its rotation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FrameAxis {
    /// Column 0.
    X,
    /// Column 1.
    Y,
    /// Column 2.
    Z,
}

impl FrameAxis {
    /// The three axes in their order.
    pub const ALL: [Self; 3] = [Self::X, Self::Y, Self::Z];
}

/// The part of the tip's orientation that counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OrientationMask {
    /// Nothing: the tip may be turned in any way.
    Free,
    /// The direction of one axis: the tip may turn about it.
    Axis(FrameAxis),
    /// All three axes.
    Whole,
}

/// The part of a target's pose that counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PoseMask {
    /// Whether the position along the axes x, y and z of the target's frame counts.
    pub along: [bool; 3],
    /// The turns that count, about the axes of that frame.
    pub turn: OrientationMask,
}

impl PoseMask {
    /// The position alone, which is what [`ArmGoal::new`] asks for.
    pub const POSITION: Self = Self { along: [true; 3], turn: OrientationMask::Free };
    /// Position and orientation, which is what [`ArmGoal::from_pose`] asks for.
    pub const POSE: Self = Self { along: [true; 3], turn: OrientationMask::Whole };

    /// Returns the part of a target that counts, with or without its orientation, where some axes of its frame are
    /// free: `along` them, and the turn `about` them. Errors name the option `--free` of the command.
    ///
    /// # Errors
    /// When a turn is free and none is asked for, two turns are free, or everything is.
    pub fn with_free(
        is_turned: bool,
        along: [bool; 3],
        about: [bool; 3],
    ) -> Result<Self, InputError> {
        let free =
            FrameAxis::ALL.into_iter().zip(about).filter_map(|(axis, free)| free.then_some(axis));
        let free: Vec<FrameAxis> = free.collect();
        if !is_turned && !free.is_empty() {
            let cause = "a turn is free, and none is asked for";
            return Err(InputError::new("--free", cause, "add --rpy or --quaternion"));
        }
        let turn = match free[..] {
            _ if !is_turned => OrientationMask::Free,
            [] => OrientationMask::Whole,
            [axis] => OrientationMask::Axis(axis),
            [_, _, _] => OrientationMask::Free,
            _ => {
                let remedy = "free one turn, which leaves the direction of its axis, or all three";
                return Err(InputError::new("--free", "two turns are free", remedy));
            }
        };
        let along = along.map(|free| !free);
        if along == [false; 3] && turn == OrientationMask::Free {
            let remedy = "leave something that the tip shall do";
            return Err(InputError::new("--free", "everything is free", remedy));
        }
        Ok(Self { along, turn })
    }

    /// Returns whether all of the position counts.
    pub fn has_whole_position(self) -> bool {
        self.along == [true; 3]
    }
}

/// A target for the tip of an arm.
#[derive(Debug, Clone, PartialEq)]
pub struct ArmGoal {
    /// Frame that the tip is to take, in the base's frame.
    pub target: Transform,
    /// The part of it that counts.
    pub asked: PoseMask,
    /// Distance at which the target counts as reached, in m.
    pub tolerance_m: f64,
    /// Angle at which the orientation counts as reached, in rad.
    pub tolerance_rad: f64,
    /// The engine. [`IkEngine::Chain`] starts from the connectors' solution; all others work on the
    /// joints from the first step.
    pub engine: IkEngine,
    /// Random postures to start from after the given one.
    pub restarts: usize,
    /// Random seed of these postures: the same one gives the same result.
    pub seed: u64,
    /// Number of postures wanted. From 2 on, the search continues from posture to posture until it has
    /// found as many that are [distinct](ArmGoal::apart), and the answer is the nearest to the start
    /// of those.
    pub solutions: usize,
    /// Whether the postures nearest to the start are wanted: then all restarts are made, and each
    /// posture found is drawn toward the start as far as the goal allows.
    pub nearest: bool,
    /// Least difference of distinct postures: of one joint at least, in rad, full turns apart; a
    /// slide counts as the angle that moves the tip as far at the arm's full reach.
    pub apart: f64,
    /// Whether joints may be outside their limits, to learn what these prevent.
    pub ignore_limits: bool,
    /// Spheres that the arm may not enter.
    pub spheres: Vec<ObstacleSphere>,
    /// The shapes of the arm's links; without them, and where links have none, the arm is its rods.
    pub body: Option<ArmBody>,
    /// Whether links of the body must not touch each other, except for those that may.
    pub own_body: bool,
}

impl ArmGoal {
    /// Returns a goal for the tip at `target_m`, turned in any way, to 1e-6 m, with 100 restarts,
    /// inside the limits.
    pub fn new(target_m: Vector) -> Self {
        let target = Transform { origin_m: target_m, ..Transform::IDENTITY };
        Self { asked: PoseMask::POSITION, ..Self::from_pose(target) }
    }

    /// Returns a goal for the position and the orientation of the tip, to 1e-6 m and 1e-6 rad, with
    /// 100 restarts, inside the limits.
    pub fn from_pose(target: Transform) -> Self {
        Self {
            target,
            asked: PoseMask::POSE,
            tolerance_m: 1e-6,
            tolerance_rad: 1e-6,
            engine: IkEngine::Auto,
            restarts: 100,
            seed: 0,
            solutions: 1,
            nearest: false,
            apart: 0.1,
            ignore_limits: false,
            spheres: Vec::new(),
            body: None,
            own_body: false,
        }
    }

    pub(super) fn check(&self) -> Result<(), InputError> {
        let Transform { origin_m, rotation } = &self.target;
        if !origin_m.iter().all(|x| x.abs() <= 1e7) {
            let cause = format!("is {origin_m:?}");
            return Err(InputError::new("target", cause, "give finite coordinates up to 1e7 m"));
        }
        if !self.target.has_valid_rotation() {
            let cause = format!("has {rotation:?} as its orientation, which is no rotation");
            return Err(InputError::new("target", cause, "give three orthogonal unit vectors"));
        }
        if self.asked.along == [false; 3] && self.asked.turn == OrientationMask::Free {
            let cause = "neither position nor orientation counts";
            return Err(InputError::new("target", cause, "ask for some of it"));
        }
        check_positive("tolerance", self.tolerance_m, "m", "a length")?;
        check_positive("tolerance", self.tolerance_rad, "rad", "an angle")?;
        check_positive("apart", self.apart, "rad", "an angle")?;
        if !(1..=MAX_SOLUTIONS).contains(&self.solutions) {
            let cause = format!("is {}", self.solutions);
            let remedy = format!("give a number from 1 to {MAX_SOLUTIONS}");
            return Err(InputError::new("solutions", cause, remedy));
        }
        self.check_sphere_values()
    }

    /// Returns whether the search continues from posture to posture, instead of ending at the first that
    /// meets the goal.
    pub(super) fn is_multi_solution(&self) -> bool {
        self.solutions > 1 || self.nearest
    }

    fn check_sphere_values(&self) -> Result<(), InputError> {
        if let Some(i) = self.spheres.iter().position(|sphere| !sphere.is_in_range()) {
            let cause = format!("is {:?}", self.spheres[i]);
            let remedy = "give finite coordinates and a radius that is not negative";
            return Err(InputError::new(format!("obstacle {}", i + 1), cause, remedy));
        }
        Ok(())
    }
}

fn check_positive(place: &str, value: f64, unit: &str, quantity: &str) -> Result<(), InputError> {
    if value > 0.0 && value.is_finite() {
        return Ok(());
    }
    Err(InputError::new(place, format!("is {value} {unit}"), format!("give {quantity} above 0")))
}
