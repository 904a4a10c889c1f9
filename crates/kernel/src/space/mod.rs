//! Where things are on a grid: positions, who stands in or claims which box, marked boxes.

pub mod floor;
pub mod marks;
pub mod position;

pub use floor::{BoxWord, Floor, Occupant};
pub use marks::Marks;
pub use position::Position;
