//! Places on a grid: positions, the occupants and claimants of boxes, marked boxes.

pub mod floor;
pub mod marks;
pub mod position;

pub use floor::{BoxWord, Floor, Occupant};
pub use marks::Marks;
pub use position::Position;
