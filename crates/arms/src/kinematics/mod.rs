//! Arms as chains of rods: forward kinematics, connectors from joint axes, and joint values back
//! from connectors.
//!
//! ```text
//! transform       vectors, rotations and frames
//! serial          model -> joints from base to tip, their values and limits; forward kinematics
//! skeleton        joint axes -> connectors and rods
//! bend            joint limits -> bend limits, where one joint alone bends a connector
//! recover         connectors -> joint values
//! body/           collision shapes of links
//! arm_selection   the files of a robot, and which part of it is the arm
//! inverse/        a target -> joint values, inside limits
//! ```
//!
//! A **connector** of an arm is a point that is fixed in two or more links at once: where axes
//! meet, or the foot of their common perpendicular. The joint origins in a URDF are not such
//! points; they may lie anywhere on an axis. Two connectors that are fixed in a common link have a
//! constant distance: a rod of fixed length. Two on either side of a prismatic joint have the
//! distance sqrt(offset^2 + (a + q)^2): a rod of variable length.
//!
//! A point says nothing about the twist of a rod about itself.
//! [`recover_joint_values`](SerialChain::recover_joint_values) reports which joints that leaves open, and refuses with
//! a reason if points do not determine the joints at all.

mod arm_selection;
mod bend;
mod body;
mod inverse;
mod recover;
mod serial;
mod skeleton;
#[cfg(test)]
mod tests;
mod transform;

pub use arm_selection::{ArmFiles, ArmModel};
pub use bend::BendLimit;
pub use body::{ArmBody, BodyContact, BodyPathCheck, BodyPosture, BodyTravel};
pub use inverse::{
    ArmBodyPart, ArmGoal, CollidesWith, Collision, FrameAxis, IkFailure, IkResult, IkSolution,
    MAX_SOLUTIONS, ObstacleSphere, OrientationMask, PoseMask,
};
pub use inverse::{ConnectorTarget, ConnectorTargetSolver};
pub use recover::{RecoverError, RecoveredJoints};
pub use serial::{Dof, JointMotionKind, LinkFrames, SerialChain};
pub use skeleton::{Skeleton, SkeletonRod};
pub use transform::{Transform, Vector};

pub(crate) use inverse::rotation_vector;
