//! Dead reckoning: the poses that robots' wheels report.

use super::MotionSample;
use super::effector::Transition;
use super::world::{RobotsWorld, Role};
use sidestep_kernel::view::Pose;
use std::f64::consts::FRAC_PI_2;

/// The pose that the wheels of a robot report, in the frame in which it was when they began to count: every
/// action as it was intended, slips unnoticed. An action that an obstacle cuts short stalls the wheels, so that
/// they report the motion that was made.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct DeadReckoning {
    /// Boxes along the axes of that frame.
    at_boxes: [i64; 2],
    /// Quarter turns to the left, 0 to 3.
    facing: u8,
}

impl DeadReckoning {
    /// Has to see every action of the robot, in their order.
    pub(super) fn add(&mut self, world: &RobotsWorld, sample: &MotionSample) {
        let Role::Robot(model) = &world.type_of(sample.robot).role else { return };
        let intended = &model.body.effector.transitions[usize::from(sample.action)][0];
        let (ahead, left, turn) = if sample.contact {
            (sample.ahead, sample.left, sample.quarter_turns)
        } else {
            motion(intended)
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

    /// Returns the pose in meters; `turns` are those of [`Self::heading_orientations`], computed once for many robots.
    pub(super) fn pose(&self, box_m: f64, turns: &[[f64; 4]; 4]) -> Pose {
        let [x_m, y_m] = self.at_boxes.map(|boxes| boxes as f64 * box_m);
        Pose { at_m: [x_m, y_m, 0.0], turn: turns[usize::from(self.facing)] }
    }

    /// Returns the turn of each heading in the frame in which wheels began to count.
    pub(super) fn heading_orientations() -> [[f64; 4]; 4] {
        [0.0, 1.0, 2.0, 3.0].map(|quarters| Pose::from_heading([0.0; 3], quarters * FRAC_PI_2).turn)
    }
}

/// Returns the boxes ahead and to the left and the quarter turns of a transition.
fn motion(transition: &Transition) -> (i32, i32, u8) {
    let mut ahead = 0;
    let mut left = 0;
    for side in &transition.path {
        side.add_to(&mut ahead, &mut left);
    }
    (ahead, left, transition.turn)
}

#[cfg(test)]
mod tests {
    use crate::robots_run;
    use sidestep_kernel::Simulation;
    use sidestep_kernel::view::FrameOptions;
    use sidestep_scenario::Source;

    /// A robot in a corridor with wheels that do nothing half of the time.
    fn frames(cycles: u64) -> Vec<([f64; 2], [f64; 2])> {
        let text = format!(
            "format = 1\nworld = \"robots\"\nseed = 4\n[map]\nbox_size_m = 0.5\nascii = \"\"\"\n{}\n\"\"\"\n\
             [effectors.wheels]\n\
             forward = [{{ p = 0.5, path = \"F\" }}, {{ p = 0.5 }}]\n\
             left = [{{ p = 1.0, turn = 90 }}]\nright = [{{ p = 1.0, turn = -90 }}]\n\
             [robots]\nat = [[0, 0, 0]]\neffector = \"wheels\"\n\
             behaviour = {{ kind = \"replay\", actions = [\"forward\"], repeat = true }}\n",
            ".".repeat(60)
        );
        let mut run = robots_run(&Source::new("corridor.toml", text, ""), 1)
            .unwrap_or_else(|e| panic!("{e}"));
        run.enable_odometry();
        let mut seen = Vec::new();
        for _ in 0..=cycles {
            let frame = run.frame(FrameOptions::WITHOUT_SCANS);
            let [x, y, _] = frame.odometry[0].1.at_m;
            let [true_x, true_y, _] = frame.bodies[0].pose.at_m;
            seen.push(([x, y], [true_x - 0.25, true_y - 0.25]));
            run.advance(1);
        }
        seen
    }

    #[test]
    fn wheels_claim_what_was_meant_and_feel_no_slip() {
        let seen = frames(20);
        assert!((0..).zip(&seen).all(|(k, (claimed, _))| *claimed == [0.5 * f64::from(k), 0.0]));
        assert!(seen[20].1[0] < 8.0, "about half of the way: {seen:?}");
    }
}
