//! Grids: positions, the occupants and claimants of boxes, sets of boxes.

pub mod bit_set;
pub mod floor;
pub mod position;

pub use bit_set::AtomicBitSet;
pub use floor::{Occupant, OccupantGrid, OccupantWord};
pub use position::GridPosition;
