//! Sets of places around a robot, a bit for each.

/// Distance in boxes up to which a robot plans. The square around it then has 81 places, which one word of
/// 128 bits holds as a set.
pub(super) const PLAN_RADIUS_BOXES: i32 = 4;
pub(super) const PLAN_SIDE_BOXES: i32 = 2 * PLAN_RADIUS_BOXES + 1;

/// Number of places of the square.
pub(super) const LOCAL_BOXES: usize = (PLAN_SIDE_BOXES * PLAN_SIDE_BOXES) as usize;
const SIDE: u32 = PLAN_SIDE_BOXES as u32;
/// The places of the column farthest west.
const WESTERNMOST: u128 = {
    let mut column = 0;
    let mut row = 0;
    while row < SIDE {
        column |= 1 << (row * SIDE);
        row += 1;
    }
    column
};
/// The places of the column farthest east.
const EASTERNMOST: u128 = WESTERNMOST << (SIDE - 1);
/// The places of one row, in the lowest bits.
const ROW: u128 = (1 << SIDE) - 1;

/// A set of places around a robot, by the columns and rows from its own place.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct LocalBoxSet(u128);

impl LocalBoxSet {
    /// All places of the square.
    pub(super) const ALL: Self = Self((1 << LOCAL_BOXES) - 1);
    /// The place of the robot itself.
    pub(super) const CENTER: Self = Self(1 << (LOCAL_BOXES / 2));
    /// The places at the edge of the square.
    pub(super) const EDGE: Self =
        Self(WESTERNMOST | EASTERNMOST | ROW | ROW << (LOCAL_BOXES as u32 - SIDE));

    /// Returns the set whose rows have these places, a bit each from the west; the rows begin in the south. Bits
    /// beyond the square are left out.
    #[inline(always)]
    pub(super) fn from_rows(mut row: impl FnMut(usize) -> u32) -> Self {
        let mut bits = 0;
        for n in 0..SIDE {
            bits |= (u128::from(row(n as usize)) & ROW) << (n * SIDE);
        }
        Self(bits)
    }

    /// Returns the number of a place, row by row from the southwest; none outside the square.
    fn index(col: i32, row: i32) -> Option<usize> {
        let inside = col.abs() <= PLAN_RADIUS_BOXES && row.abs() <= PLAN_RADIUS_BOXES;
        inside.then_some(
            ((row + PLAN_RADIUS_BOXES) * PLAN_SIDE_BOXES + col + PLAN_RADIUS_BOXES) as usize,
        )
    }

    /// Returns whether a place is in the set; none outside the square is.
    pub(super) fn contains(self, col: i32, row: i32) -> bool {
        Self::index(col, row).is_some_and(|n| self.0 >> n & 1 == 1)
    }

    pub(super) fn is_empty(self) -> bool {
        self.0 == 0
    }

    /// Returns the number of places.
    pub(super) fn len(self) -> usize {
        self.0.count_ones() as usize
    }

    pub(super) fn insert(&mut self, col: i32, row: i32) {
        if let Some(n) = Self::index(col, row) {
            self.0 |= 1 << n;
        }
    }

    pub(super) fn union(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    pub(super) fn intersection(self, other: Self) -> Self {
        Self(self.0 & other.0)
    }

    pub(super) fn without(self, other: Self) -> Self {
        Self(self.0 & !other.0)
    }

    /// Returns the places next to those of the set in a direction.
    #[inline(always)]
    pub(super) fn shift(self, direction: u8) -> Self {
        // What is moved beyond the last row is cut off by the mask, beyond the first one by the word.
        Self(match direction % 4 {
            0 => (self.0 & !EASTERNMOST) << 1,
            1 => self.0 << SIDE & Self::ALL.0,
            2 => (self.0 & !WESTERNMOST) >> 1,
            _ => self.0 >> SIDE,
        })
    }

    /// Returns the places beside those of the set.
    pub(super) fn neighbors(self) -> Self {
        (0..4).fold(Self::default(), |places, direction| places.union(self.shift(direction)))
    }

    /// Adds the place with a number.
    pub(super) fn insert_number(&mut self, number: usize) {
        self.0 |= 1 << number;
    }

    /// Returns the number of each place, row by row from the southwest.
    pub(super) fn numbers(self) -> impl Iterator<Item = usize> {
        let mut bits = self.0;
        std::iter::from_fn(move || {
            if bits == 0 {
                return None;
            }
            let number = bits.trailing_zeros() as usize;
            bits &= bits - 1;
            Some(number)
        })
    }

    /// Returns the number, and column and row, of each place, from the southwest.
    pub(super) fn numbered_places(self) -> impl Iterator<Item = (usize, (i32, i32))> {
        self.numbers().map(|number| {
            let col = number as i32 % PLAN_SIDE_BOXES - PLAN_RADIUS_BOXES;
            let row = number as i32 / PLAN_SIDE_BOXES - PLAN_RADIUS_BOXES;
            (number, (col, row))
        })
    }

    /// Returns column and row of each place, from the southwest.
    #[cfg(test)]
    pub(super) fn places(self) -> impl Iterator<Item = (i32, i32)> {
        self.numbered_places().map(|(_, place)| place)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effector::HEADINGS;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_shift_moves_each_place_by_one_and_none_around_the_edge(bits in any::<u128>(), direction in 0u8..4) {
            let set = LocalBoxSet(bits).intersection(LocalBoxSet::ALL);
            let (east, north) = HEADINGS[usize::from(direction)];
            let mut expected = LocalBoxSet::default();
            set.places().for_each(|(col, row)| expected.insert(col + east, row + north));
            prop_assert_eq!(set.shift(direction), expected);
        }
    }

    #[test]
    fn center_and_edge_are_where_they_are_said_to_be() {
        assert_eq!(LocalBoxSet::CENTER.places().collect::<Vec<_>>(), [(0, 0)]);
        let edge = LocalBoxSet::ALL.places();
        let edge = edge.filter(|(col, row)| col.abs().max(row.abs()) == PLAN_RADIUS_BOXES);
        assert_eq!(LocalBoxSet::EDGE.places().collect::<Vec<_>>(), edge.collect::<Vec<_>>());
    }

    #[test]
    fn rows_are_read_from_the_west_and_from_the_south() {
        let set = LocalBoxSet::from_rows(|row| if row == 0 { 0b10_0000_0010 } else { 0 });
        assert_eq!(set.places().collect::<Vec<_>>(), [(-3, -4)]);
    }
}
