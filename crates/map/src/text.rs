//! A map as text, for the terminal.

use super::{Cell, GridMap};

impl GridMap {
    /// Returns the map in characters, north up: `#` wall, `.` free, `?` unknown, one line per row
    /// of characters, each ended by a line feed.
    ///
    /// A map of more than `max_cols` columns is drawn smaller: a character then stands for a square
    /// of boxes, by the rule that merges pixels into boxes (wall where any of them is a wall,
    /// else unknown where any is unknown), so that no wall is lost.
    pub fn to_text(&self, max_cols: u32) -> String {
        let step = self.boxes_per_char(max_cols);
        let cols = self.width().div_ceil(step);
        let rows = self.height().div_ceil(step);
        let mut text = String::with_capacity((cols as usize + 1) * rows as usize);
        for row in (0..rows).rev() {
            text.extend(
                (0..cols).map(|col| symbol(self.merged_cell(col * step, row * step, step))),
            );
            text.push('\n');
        }
        text
    }

    /// Returns the number of boxes along each side of the square that a character stands for.
    fn boxes_per_char(&self, max_cols: u32) -> u32 {
        self.width().div_ceil(max_cols.max(1))
    }

    /// Returns the map as [`GridMap::to_text`] does, with rulers: the row of boxes before every fifth line,
    /// the column of boxes below every tenth character, both counted from the southwest.
    pub fn to_text_with_rulers(&self, max_cols: u32) -> String {
        let margin = self.height().to_string().len() + 1;
        let max_cols = max_cols.saturating_sub(margin as u32);
        let step = self.boxes_per_char(max_cols);
        let map = self.to_text(max_cols);
        let rows = map.lines().count() as u32;
        let mut text = String::new();
        for (line, row) in map.lines().zip((0..rows).rev()) {
            let label = if row % 5 == 0 { (row * step).to_string() } else { String::new() };
            text += &format!("{label:>width$} {line}\n", width = margin - 1);
        }
        let cols = map.lines().next().map_or(0, str::len) as u32;
        let ruler = (0..cols).step_by(10).map(|col| format!("{:<10}", col * step));
        let ruler = " ".repeat(margin) + &ruler.collect::<String>();
        text + ruler.trim_end() + "\n"
    }

    /// Returns the combined cell of the square of `side` boxes with the lower-left box (`col`,
    /// `row`).
    fn merged_cell(&self, col: u32, row: u32, side: u32) -> Cell {
        let mut merged = Cell::Free;
        for row in row..(row + side).min(self.height()) {
            for col in col..(col + side).min(self.width()) {
                match self.cell(col, row) {
                    Cell::Wall => return Cell::Wall,
                    Cell::Unknown => merged = Cell::Unknown,
                    Cell::Free => {}
                }
            }
        }
        merged
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
    fn rulers_count_boxes_from_the_south_west() {
        let map = GridMap::new(12, 6, 1.0, vec![Free; 72]);
        let expected = "5 ............\n  ............\n  ............\n  ............\n  ............\n\
                        0 ............\n  0         10\n";
        assert_eq!(map.to_text_with_rulers(80), expected);
        assert_eq!(
            map.to_text_with_rulers(8),
            "  ......\n  ......\n0 ......\n  0\n",
            "half as large"
        );
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
