//! A chain of robots on wheels: one navigates, the others follow (slides N1 to N6, E2).
//!
//! The leader sees with a laser and decides by six layers; where it goes is where the chain's
//! first connector goes. The other robots follow their own connectors on real wheels, with
//! sensors that only tell what is about to be touched. Plain data in, plain data out:
//!
//! ```text
//! leader.rs:    perceive (laser.rs, ray.rs) -> Percept -> decide -> wheels and the layer that acted
//! follower.rs:  perceive (proximity.rs)     -> gaps    -> decide -> wheels
//! drive.rs:     wheels -> pose              convoy.rs: all of it, a tick at a time
//!                                           measures.rs: what a run comes to
//! ```

pub(crate) mod convoy;
pub mod drive;
pub(crate) mod follower;
pub mod laser;
pub mod leader;
pub(crate) mod measures;
pub(crate) mod proximity;
pub(crate) mod ray;
#[cfg(test)]
mod tests;

pub use convoy::{Convoy, Plan};
pub use drive::{Drive, Pose, Wheels};
pub use follower::Follower;
pub use laser::{Body, Laser, Scan};
pub use leader::{Leader, Leaving, Percept};
pub use measures::Measures;
