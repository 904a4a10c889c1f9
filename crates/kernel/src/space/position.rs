//! A box of a grid by column and row, in one word.

/// Column (from the west) and row (from the south) of a box; both below 65,536.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct GridPosition(u32);

impl GridPosition {
    /// Creates the position in this column and row.
    #[inline(always)]
    pub fn new(col: u32, row: u32) -> Self {
        debug_assert!(col < 1 << 16 && row < 1 << 16);
        Self(row << 16 | col)
    }

    /// Creates a position from the word of [`GridPosition::word`].
    #[inline(always)]
    pub fn from_word(word: u32) -> Self {
        Self(word)
    }

    /// Column and row in one word: `row << 16 | col`.
    #[inline(always)]
    pub fn word(self) -> u32 {
        self.0
    }

    /// Column, from the west.
    #[inline(always)]
    pub fn col(self) -> u32 {
        self.0 & 0xffff
    }

    /// Row, from the south.
    #[inline(always)]
    pub fn row(self) -> u32 {
        self.0 >> 16
    }

    /// Index in a grid stored row by row, `width` boxes wide.
    #[inline(always)]
    pub fn row_major_index(self, width: u32) -> u32 {
        self.row() * width + self.col()
    }

    /// Returns the box `dx` columns east and `dy` rows north; the caller makes sure that it exists.
    #[inline(always)]
    pub fn translate(self, dx: i32, dy: i32) -> Self {
        Self::new(self.col().wrapping_add_signed(dx), self.row().wrapping_add_signed(dy))
    }
}
