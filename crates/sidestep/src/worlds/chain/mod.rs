//! The chain world: serpentine motion, manipulators and swarms of rods and connectors.

pub mod kinematics;
pub mod script;
