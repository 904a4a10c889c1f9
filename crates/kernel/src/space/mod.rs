//! Where things are: positions and claims on the boxes of a grid.

pub mod claims;
pub mod position;

pub use claims::{ClaimGrid, FIXED, StoredTag, Tag, Tags};
pub use position::Position;
