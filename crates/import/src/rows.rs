//! Maps that are drawn with characters: what the two such formats share.

use sidestep_kernel::InputError;

use sidestep_map::{Cell, GridMap, MAX_BOXES, check_box_count, check_box_size};

/// The most bytes a map of characters may have: all boxes, and as much again for line ends.
pub(super) const MAX_TEXT_BYTES: u64 = 2 * MAX_BOXES;

/// The text of a file or of a part of it, for error messages.
#[derive(Clone, Copy)]
pub(super) struct Source<'a> {
    /// The file's name, or the option's.
    pub(super) place: &'a str,
    /// All of the text.
    pub(super) text: &'a str,
}

impl<'a> Source<'a> {
    /// An error at the byte `offset` of the text.
    pub(super) fn error(
        &self,
        offset: usize,
        cause: impl Into<String>,
        remedy: impl Into<String>,
    ) -> InputError {
        InputError::new(self.place, cause, remedy).in_text(self.text, offset)
    }

    /// Bytes of the text before `part`, a piece of that text.
    pub(super) fn offset_of(&self, part: &str) -> usize {
        part.as_ptr() as usize - self.text.as_ptr() as usize
    }

    /// The lines of `part`, a piece of the text, without their ends (LF or CR LF).
    pub(super) fn lines_of(self, part: &'a str) -> impl Iterator<Item = Line<'a>> {
        part.lines().map(move |text| Line { offset: self.offset_of(text), text })
    }
}

/// A line of a text.
#[derive(Clone, Copy)]
pub(super) struct Line<'a> {
    /// Bytes of the text before the line.
    pub(super) offset: usize,
    /// The line without its end.
    pub(super) text: &'a str,
}

/// What the characters of a map mean.
pub(super) struct Legend {
    /// The cell that a character stands for.
    pub(super) cell: fn(char) -> Option<Cell>,
    /// The characters that stand for something, as a remedy.
    pub(super) remedy: &'static str,
}

impl Legend {
    /// Appends to `cells` those of a line that has to have `width` characters.
    pub(super) fn read_row(
        &self,
        source: Source<'_>,
        line: Line<'_>,
        width: usize,
        cells: &mut Vec<Cell>,
    ) -> Result<(), InputError> {
        let before = cells.len();
        for (at, character) in line.text.char_indices() {
            let cell = (self.cell)(character).ok_or_else(|| {
                let cause = format!("`{}` means nothing in a map", character.escape_debug());
                source.error(line.offset + at, cause, self.remedy)
            })?;
            cells.push(cell);
        }
        match cells.len() - before {
            length if length == width => Ok(()),
            length => Err(ragged(source, line, length, width)),
        }
    }
}

/// The error of a row of `length` characters that had to have `width`, where it should end.
fn ragged(source: Source<'_>, line: Line<'_>, length: usize, width: usize) -> InputError {
    let at = line.text.char_indices().nth(width).map_or(line.text.len(), |(at, _)| at);
    let cause = format!("this row has {length} characters, not {width}");
    source.error(line.offset + at, cause, "give all rows the same number of characters")
}

/// A map of `cells` that are given row by row from the top, `width` in a row.
///
/// # Errors
/// When there are no boxes or too many, or a box has no positive size.
pub(super) fn map_from_top(
    place: &str,
    cells: &[Cell],
    width: usize,
    box_size_m: f64,
) -> Result<GridMap, InputError> {
    let height = cells.len().checked_div(width).unwrap_or(0);
    let (columns, rows) = check_box_count(place, width as u64, height as u64)?;
    let cells = cells.rchunks(width).flatten().copied().collect();
    Ok(GridMap::new(columns, rows, check_box_size(box_size_m)?, cells))
}
