//! Reasons why a batch could not do something.

use crate::checkpoint::CheckpointError;
use crate::control::OrderError;
use crate::error::InputError;
use crate::units::Cycle;

/// A reason why a batch could not do something.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum BatchError {
    /// A batch of no worlds.
    #[error("a batch of no worlds; give at least one seed")]
    Empty,
    /// Too few or too many values, one for each world.
    #[error("a batch of {worlds} worlds needs {worlds} {what}, not {found}")]
    Count {
        /// Worlds of the batch: the number of values that would be right.
        worlds: usize,
        /// The plural noun for the values, e.g. `seeds`.
        what: &'static str,
        /// Number of values that were given.
        found: usize,
    },
    /// A world cannot start.
    #[error("world {world} cannot start with seed {seed}: {error}")]
    Start {
        /// Its index in the batch.
        world: usize,
        /// The seed that was refused; the world may still run with an older one.
        seed: u64,
        /// The error of the factory.
        error: InputError,
    },
    /// A checkpoint that a world cannot continue from.
    #[error("world {world} cannot continue from its checkpoint: {error}")]
    Restore {
        /// Its index in the batch.
        world: usize,
        /// The reason.
        error: CheckpointError,
    },
    /// A world with agents that observe, or are ordered, differently from those of the first.
    #[error("world {world} has other teams than world 0; a batch is of worlds of one shape")]
    Shape {
        /// Its index in the batch.
        world: usize,
    },
    /// An order that cannot be obeyed: no world got it if [`Batch::order`](super::Batch::order) found that, all others
    /// if [`Batch::advance`](super::Batch::advance) did.
    #[error("world {world}: {error}")]
    Order {
        /// Index of the world.
        world: usize,
        /// The error of that world's run.
        error: OrderError,
    },
    /// A missing team, or buffers of another shape.
    #[error(transparent)]
    Observe(#[from] OrderError),
    /// A world that panicked: it has no state until it is restarted.
    #[error(
        "world {world} (seed {seed}) broke off after cycle {cycle}, which is a bug: {cause}; the other worlds \
         are whole, restart this one"
    )]
    Broken {
        /// Its index in the batch.
        world: usize,
        /// The seed of its last start.
        seed: u64,
        /// Cycles that it had done before.
        cycle: Cycle,
        /// The message of the panic.
        cause: String,
    },
}
