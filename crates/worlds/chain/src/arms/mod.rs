//! Arms of joints as chains of rods: from URDF to connectors and back, and postures that reach a
//! target. No run, no clock, no cycle.
//!
//! ```text
//! kinematics/: joints -> connectors -> joints     ik/: postures of chains that reach a target
//! plan/: ways among obstacles from one posture to another
//! ```

pub(crate) mod arm;
pub mod ik;
pub mod kinematics;
pub(crate) mod plan;

pub use arm::Arm;
