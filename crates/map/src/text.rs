//! A map as text, for the terminal.

use super::{Cell, GridMap};

impl GridMap {
    /// Returns the map in characters, north up: `#` wall, `.` free, `?` unknown, one line per row
    /// of characters, each ended by a line feed.
    ///
    /// A map of more than `max_cols` columns is drawn smaller: a character then stands for a square
    /// of boxes and follows the rule that makes boxes of pixels (wall where any of them is a wall,
    /// else unknown where any is unknown), so that no wall is lost.
    pub fn to_text(&self, max_cols: u32) -> String {
        let step = self.width().div_ceil(max_cols.max(1));
        let cols = self.width().div_ceil(step);
        let rows = self.height().div_ceil(step);
        let mut text = String::with_capacity((cols as usize + 1) * rows as usize);
        for row in (0..rows).rev() {
            text.extend((0..cols).map(|col| symbol(self.square(col * step, row * step, step))));
            text.push('\n');
        }
        text
    }

    /// Returns the combined cell of the square of `side` boxes with the lower-left box (`col`,
    /// `row`).
    fn square(&self, col: u32, row: u32, side: u32) -> Cell {
        let mut whole = Cell::Free;
        for row in row..(row + side).min(self.height()) {
            for col in col..(col + side).min(self.width()) {
                match self.cell(col, row) {
                    Cell::Wall => return Cell::Wall,
                    Cell::Unknown => whole = Cell::Unknown,
                    Cell::Free => {}
                }
            }
        }
        whole
    }
}

fn symbol(cell: Cell) -> char {
    match cell {
        Cell::Free => '.',
        Cell::Wall => '#',
        Cell::Unknown => '?',
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use Cell::{Free, Unknown, Wall};

    #[test]
    fn north_is_up() {
        let map = GridMap::new(2, 2, 1.0, vec![Free, Wall, Unknown, Free]);
        assert_eq!(map.to_text(80), "?.\n.#\n");
    }

    #[test]
    fn a_wide_map_is_drawn_smaller_and_loses_no_wall() {
        let mut cells = vec![Free; 5 * 3];
        cells[3] = Wall;
        cells[10] = Unknown;
        let map = GridMap::new(5, 3, 1.0, cells);
        assert_eq!(map.to_text(3), "?..\n.#.\n");
        assert_eq!(map.to_text(1), "#\n");
        assert_eq!(map.to_text(0), map.to_text(1));
    }
}
