//! Inverse kinematics of real arms: joint values that bring the tip to a target.
//!
//! Damped least squares on the joints themselves, inside their limits: points leave twist open and
//! couple the joints of some arms, joints do not. The engine [`IkEngine::Chain`] solves for the
//! connectors first, with joint limits as bend limits, reads the joints off them, and leaves only the
//! undecided rest to the joints.
//!
//! ```text
//! goal       a goal: a pose, the part of it that counts, tolerances
//! result     its answer, and the reason for a failure
//! fast_fk    forward kinematics without allocation, and the effect of each joint
//! contacts   parts that are in another body
//! criteria   errors of a posture and their Jacobian: the tip, its orientation, contacts
//! step       a damped step inside limits
//! descent    steps from one posture, until the goal is met or nothing is gained
//! search     descents from many postures
//! failure    the reason if none leads there
//! solutions  several postures, and those nearest to the start
//! guide      the connectors' solution as a posture to start from
//! tracking   joint values for the places of all connectors, within one cycle
//! ```
//!
//! Every answer's error is that of forward kinematics at its values.

mod contacts;
mod criteria;
mod descent;
mod failure;
mod fast_fk;
mod goal;
mod guide;
mod result;
mod search;
mod solutions;
mod step;
#[cfg(test)]
mod tests;
mod tracking;

pub use goal::{ArmGoal, FrameAxis, MAX_SOLUTIONS, ObstacleSphere, OrientationMask, PoseMask};
pub use result::{ArmBodyPart, CollidesWith, Collision, IkFailure, IkResult, IkSolution};
pub use tracking::{ConnectorTarget, ConnectorTargetSolver};

pub(crate) use fast_fk::rotation_between as rotation_vector;

use super::serial::SerialChain;
use criteria::PostureEvaluator;
use search::IkSearch;
use sidestep_kernel::InputError;

impl SerialChain {
    /// Returns joint values that bring the tip to the goal's target, starting from the posture
    /// `start`, which has a value for each variable; if that does not lead there, from random ones.
    ///
    /// # Errors
    /// When a target, tolerance, sphere or start is not in range. A target that cannot be reached
    /// is no error.
    pub fn solve(&self, goal: &ArmGoal, start: &[f64]) -> Result<IkResult, InputError> {
        goal.check()?;
        self.check_joint_values("start", start)?;
        let skeleton = self.skeleton();
        Ok(IkSearch::new(self, &skeleton, goal).run(start))
    }

    /// Returns the distance of the tip at these values from the goal's target in m, and the angle from its orientation
    /// in rad, of the parts that count.
    pub fn pose_error(&self, goal: &ArmGoal, values: &[f64]) -> (f64, f64) {
        let tip = self.forward_kinematics(values).tip;
        PostureEvaluator::new(self, &self.skeleton(), goal).tip_errors(&tip)
    }
}
