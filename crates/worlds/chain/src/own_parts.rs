//! Drivers and reactions that a program adds to the built-in ones.

use super::driver::own_driver::Drivers;
use sidestep_rods::Reaction;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Reactions of a program's own, by the names that scenarios call them.
pub type Reactions = BTreeMap<String, Arc<dyn Reaction>>;

/// Drivers and reactions of a program's own.
#[derive(Debug, Clone, Default)]
pub struct OwnParts {
    /// Kinds of tasks, see `chains.tasks.kind`.
    pub drivers: Drivers,
    /// Reactions of connectors, see `chain.rotation`.
    pub reactions: Reactions,
}
