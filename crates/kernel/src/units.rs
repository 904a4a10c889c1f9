//! The few quantities every world shares, as types that cannot be mixed up.

use serde::{Deserialize, Serialize};

/// The seed from which all randomness of a run grows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct Seed(pub u64);

/// A cycle of the synchronous loop, counted from 0.
pub type Cycle = u64;

/// The index of an entity in a state's columns. Slots may be permuted without changing any result,
/// because draws and ties depend on the entity's [`EntityId`].
pub type EntitySlot = u32;

/// The identity of an entity: constant through a run and independent of storage.
pub type EntityId = u32;
