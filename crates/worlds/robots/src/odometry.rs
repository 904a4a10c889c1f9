//! The poses that robots' wheels claim.

use super::MotionSample;
use super::effector::Transition;
use super::world::{RobotsWorld, Role};
use sidestep_kernel::view::Pose;
use std::f64::consts::FRAC_PI_2;

/// The pose that the wheels of a robot claim, in the frame in which it was when they began to count: every
/// action as it was intended, slips unnoticed. An action that an obstacle cuts short stalls the wheels, so that
/// they claim what was made.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct Claimed {
    /// Boxes along the axes of that frame.
    at_boxes: [i64; 2],
    /// Quarter turns to the left, 0 to 3.
    facing: u8,
}

impl Claimed {
    /// Adds an action of a robot.
    pub(super) fn add(&mut self, world: &RobotsWorld, sample: &MotionSample) {
        let Role::Robot(model) = &world.type_of(sample.robot).role else { return };
        let intended = &model.body.effector.transitions[usize::from(sample.action)][0];
        let (ahead, left, turn) = match sample.contact {
            true => (sample.ahead, sample.left, sample.quarter_turns),
            false => motion(intended),
        };
        let [dx, dy] = match self.facing {
            0 => [ahead, left],
            1 => [-left, ahead],
            2 => [-ahead, -left],
            _ => [left, -ahead],
        };
        self.at_boxes = [self.at_boxes[0] + i64::from(dx), self.at_boxes[1] + i64::from(dy)];
        self.facing = (self.facing + turn) % 4;
    }

    /// Returns the pose in meters.
    pub(super) fn pose(&self, box_m: f64) -> Pose {
        let [x_m, y_m] = self.at_boxes.map(|boxes| boxes as f64 * box_m);
        Pose::heading([x_m, y_m, 0.0], f64::from(self.facing) * FRAC_PI_2)
    }
}

/// Returns the boxes ahead and to the left and the quarter turns of a transition.
fn motion(transition: &Transition) -> (i32, i32, u8) {
    let (mut ahead, mut left) = (0, 0);
    for side in &transition.path {
        side.add_to(&mut ahead, &mut left);
    }
    (ahead, left, transition.turn)
}
