//! A chain of robots on wheels: one navigates, the others follow (slides N1 to N6, E2).
//!
//! The leader sees with a laser and decides by six layers; the chain's first connector goes where
//! the leader goes. The other robots follow their own connectors on real wheels, with sensors that
//! report only imminent contact. Plain data in, plain data out:
//!
//! ```text
//! leader.rs:    perceive (laser.rs, ray.rs) -> Percept -> decide -> wheels and the layer that acted
//! follower.rs:  perceive (proximity.rs)     -> gaps    -> decide -> wheels
//! drive.rs:     wheels -> pose
//! ```
//!
//! `act/` carries their decisions out in a run.

pub mod drive;
pub(crate) mod follower;
pub mod laser;
pub mod leader;
pub(crate) mod proximity;
pub(crate) mod ray;
#[cfg(test)]
mod tests;

pub use drive::{DifferentialDrive, Pose2, WheelSpeeds};
pub use follower::Follower;
pub use laser::{Laser, LaserScan, NearbyBodies, RobotBody};
pub use leader::{LeaderController, WallAndTargetPercept, WallLossCriterion};
