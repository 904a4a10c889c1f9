//! The worlds. They stand side by side on the kernel and never import each other.

pub mod airspace;
pub mod any;
pub mod chain;
pub mod robots;
