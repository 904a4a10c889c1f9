//! The ways that bodies have gone, and how rows of recorded tables tell them.

use super::body::Kind;
use super::pose::Place;
use crate::units::Cycle;

/// Which body: its kind, its number, and its part of things that have parts.
pub type Who = (Kind, u32, Option<u32>);

/// The way that a body has gone.
#[derive(Debug, Clone, PartialEq)]
pub struct Trail {
    /// Whose way it is.
    pub of: Who,
    /// Where its middle was at the beginning of a cycle, the earliest first.
    pub way: Vec<(Cycle, Place)>,
}

/// Rows of a recorded table as places of bodies.
#[derive(Debug, Clone, PartialEq)]
pub struct PlaceRows {
    /// Name of the table; its column `cycle` says when.
    pub table: &'static str,
    /// What the bodies are.
    pub kind: Kind,
    /// The column with their numbers.
    pub number: &'static str,
    /// The column with the numbers of their parts.
    pub part: Option<&'static str>,
    /// Columns with the coordinates x, y and perhaps z.
    pub axes: Vec<Axis>,
    /// Whether the places are those of a body's corner with the lowest coordinates, not those of
    /// its middle.
    pub is_corner: bool,
    /// The column with headings in quarter turns from east, of bodies that go straight ahead
    /// before they slip to a side.
    pub ahead: Option<&'static str>,
    /// Cycles between two rows of a body.
    pub every: Cycle,
    /// So many cycles before the present are worth showing.
    pub worth: Cycle,
}

/// A column with coordinates: meters are `offset_m` and the value times `scale_m`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Axis {
    /// Its name.
    pub column: &'static str,
    /// Meters of a step of 1.
    pub scale_m: f64,
    /// Where the value 0 is.
    pub offset_m: f64,
}

impl Axis {
    /// A column that is in meters already.
    pub fn meters(column: &'static str) -> Self {
        Self { column, scale_m: 1.0, offset_m: 0.0 }
    }
}

/// Where a body is between two places, if it has gone ahead before it slipped to a side: in the
/// heading, in quarter turns from east, in which it left the first one.
pub fn corner(from: Place, quarters: u32, to: Place) -> Place {
    if quarters.is_multiple_of(2) { [to[0], from[1], from[2]] } else { [from[0], to[1], from[2]] }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slip_goes_ahead_before_it_goes_aside() {
        let (east, north) = (0, 1);
        assert_eq!(corner([5.0, 5.0, 0.0], east, [6.0, 6.0, 0.0]), [6.0, 5.0, 0.0]);
        assert_eq!(corner([5.0, 5.0, 0.0], north, [4.0, 6.0, 0.0]), [5.0, 6.0, 0.0]);
        assert_eq!(corner([5.0, 5.0, 0.0], east, [5.0, 5.0, 0.0]), [5.0, 5.0, 0.0]);
    }
}
