//! The common parts of the two formats of maps that are drawn in text.

use sidestep_kernel::InputError;

use sidestep_map::{Cell, GridMap, MAX_BOXES, check_box_count, check_box_size};

/// The maximum size of a map in text in bytes: all boxes, and as much again for line breaks.
pub(super) const MAX_TEXT_BYTES: u64 = 2 * MAX_BOXES;

/// The text of a file or of a part of it, for error messages.
#[derive(Clone, Copy)]
pub(super) struct SourceText<'a> {
    /// The name of the file or option.
    pub(super) place: &'a str,
    /// The whole text.
    pub(super) text: &'a str,
}

impl<'a> SourceText<'a> {
    pub(super) fn error(
        &self,
        offset: usize,
        cause: impl Into<String>,
        remedy: impl Into<String>,
    ) -> InputError {
        InputError::new(self.place, cause, remedy).with_byte_offset(self.text, offset)
    }

    /// Returns the place of a line for a report: `line 7`.
    pub(super) fn line_name(&self, line: Line<'_>) -> String {
        format!("line {}", self.text[..line.offset].matches('\n').count() + 1)
    }

    /// Returns the number of bytes of the text before `part`, a piece of that text.
    pub(super) fn offset_of(&self, part: &str) -> usize {
        part.as_ptr() as usize - self.text.as_ptr() as usize
    }

    /// Returns the lines of `part`, a piece of the text, without their ends (LF or CR LF).
    pub(super) fn lines_of(self, part: &'a str) -> impl Iterator<Item = Line<'a>> {
        part.lines().map(move |text| Line { offset: self.offset_of(text), text })
    }
}

#[derive(Clone, Copy)]
pub(super) struct Line<'a> {
    /// Number of bytes of the text before the line.
    pub(super) offset: usize,
    /// The line without its end.
    pub(super) text: &'a str,
}

/// The meaning of the characters of a map.
pub(super) struct Legend {
    /// The cell that a character stands for, if any.
    pub(super) cell: fn(char) -> Option<Cell>,
    /// The remedy for other characters: a list of those with a meaning.
    pub(super) remedy: &'static str,
    /// The remedy for rows of another width.
    pub(super) width_remedy: &'static str,
}

impl Legend {
    /// Appends the cells of a line to `cells`; the line must have `width` characters.
    pub(super) fn read_row(
        &self,
        source: SourceText<'_>,
        line: Line<'_>,
        width: usize,
        cells: &mut Vec<Cell>,
    ) -> Result<(), InputError> {
        let row_start = cells.len();
        for (offset, character) in line.text.char_indices() {
            let cell = (self.cell)(character).ok_or_else(|| {
                let cause = format!("`{}` means nothing in a map", character.escape_debug());
                source.error(line.offset + offset, cause, self.remedy)
            })?;
            cells.push(cell);
        }
        let length = cells.len() - row_start;
        if length == width { Ok(()) } else { Err(self.uneven_row(source, line, length, width)) }
    }

    /// Returns the error of a row of `length` instead of `width` characters, at the position where it should end.
    fn uneven_row(
        &self,
        source: SourceText<'_>,
        line: Line<'_>,
        length: usize,
        width: usize,
    ) -> InputError {
        let end = line.text.char_indices().nth(width).map_or(line.text.len(), |(offset, _)| offset);
        let cause = format!("this row has {length} characters, not {width}");
        source.error(line.offset + end, cause, self.width_remedy)
    }
}

/// Creates a map of `cells` that are given row by row from the top, `width` in a row.
///
/// # Errors
/// When there are no boxes or too many, or the side of a box is not positive.
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
