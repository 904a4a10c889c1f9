//! Drivers and reactions that a program adds to the built-in ones.

use super::driver::own_driver::DriverRegistry;
use sidestep_rods::Reaction;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Reactions of a program's own, by the names that scenarios call them.
pub type ReactionRegistry = BTreeMap<String, Arc<dyn Reaction>>;

/// Drivers and reactions of a program's own.
#[derive(Debug, Clone, Default)]
pub struct CustomBehaviors {
    /// Kinds of tasks, see `chains.tasks.kind`.
    pub drivers: DriverRegistry,
    /// Reactions of connectors, see `chain.rotation`.
    pub reactions: ReactionRegistry,
}
