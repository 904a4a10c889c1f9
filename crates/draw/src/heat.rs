//! A matrix as a picture: colored cells with their numbers, e.g. a confusion matrix.

use crate::axis::widened;
use crate::error::DrawError;
use crate::legend::{paragraph, title_look};
use crate::style::{FAINT_INK, INK, Style};
use crate::svg::{Anchor, Rect, Svg, TextLook};
use crate::text::{self, Weight};
use crate::ticks::{Ticks, label};

/// Most cells of a readable matrix.
const MOST_CELLS: usize = 40_000;
const EDGE_PX: f64 = 10.0;
const BAR_PX: f64 = 14.0;

/// A matrix with named rows and columns, drawn with one color scale and a number in each cell.
#[derive(Debug, Clone, PartialEq)]
pub struct Matrix {
    title: String,
    note: String,
    rows: Vec<String>,
    columns: Vec<String>,
    row_title: String,
    column_title: String,
    values: Vec<f64>,
    subscripts: Vec<String>,
    range: Option<(f64, f64)>,
    digits: usize,
}

impl Matrix {
    /// Returns a matrix whose `values` stand row by row, the first row on top. A value that is not
    /// a number is an empty gray cell.
    ///
    /// # Errors
    /// [`DrawError::Length`] if there is not one value per row and column, [`DrawError::TooLarge`]
    /// above 40 000 cells, [`DrawError::Value`] if there are none.
    pub fn new(
        title: impl Into<String>,
        rows: Vec<String>,
        columns: Vec<String>,
        values: Vec<f64>,
    ) -> Result<Self, DrawError> {
        let cells = rows.len().saturating_mul(columns.len());
        if cells > MOST_CELLS {
            let (found, limit) = (cells as u64, MOST_CELLS as u64);
            return Err(DrawError::TooLarge { what: "matrix cells", found, limit });
        }
        DrawError::some("number of matrix cells", cells)?;
        DrawError::length("values of the matrix", cells, values.len())?;
        Ok(Self {
            title: title.into(),
            note: String::new(),
            rows,
            columns,
            row_title: String::new(),
            column_title: String::new(),
            values,
            subscripts: vec![],
            range: None,
            digits: 2,
        })
    }

    /// Names the rows and the columns as a whole, e.g. `"true"` and `"reported"`.
    #[must_use]
    pub fn titles(mut self, rows: impl Into<String>, columns: impl Into<String>) -> Self {
        (self.row_title, self.column_title) = (rows.into(), columns.into());
        self
    }

    /// Sets the number of decimals (2 by default, 9 at most).
    #[must_use]
    pub fn digits(mut self, digits: usize) -> Self {
        self.digits = digits.min(9);
        self
    }

    /// Sets the color range, from white at `low` to dark at `high`. By default it is 0 to 1 if all
    /// values lie there, otherwise from the least value to the greatest.
    #[must_use]
    pub fn range(mut self, low: f64, high: f64) -> Self {
        self.range = Some((low, high));
        self
    }

    /// Adds a second, smaller line to each cell, row by row, e.g. the count behind a probability.
    ///
    /// # Errors
    /// [`DrawError::Length`] if there is not one per cell.
    pub fn subscripts(mut self, subscripts: Vec<String>) -> Result<Self, DrawError> {
        DrawError::length("subscripts of the matrix", self.values.len(), subscripts.len())?;
        self.subscripts = subscripts;
        Ok(self)
    }

    /// Sets the small print under the matrix.
    #[must_use]
    pub fn note(mut self, note: impl Into<String>) -> Self {
        self.note = note.into();
        self
    }

    /// Draws the matrix. The style's width is an upper bound; the height follows from the rows.
    ///
    /// # Errors
    /// [`DrawError::Value`] if the style or the color range is impossible.
    pub fn to_svg(&self, style: &Style) -> Result<String, DrawError> {
        style.check()?;
        let range = self.color_range()?;
        let layout = Layout::of(self, style);
        let mut svg = Svg::default();
        let title =
            text::wrap(&self.title, style.title_px(), Weight::Bold, layout.width - 2.0 * EDGE_PX);
        let head = paragraph(&mut svg, &title, (EDGE_PX, EDGE_PX), &title_look(style.title_px()));
        let grid = layout.grid(head);
        self.draw_cells(&mut svg, style, &layout, grid, range);
        self.draw_labels(&mut svg, style, &layout, grid);
        draw_color_bar(&mut svg, style, grid, range);
        let look = TextLook { fill: FAINT_INK, ..TextLook::new(style.small_px(), Anchor::Start) };
        let note =
            text::wrap(&self.note, look.size_px, Weight::Regular, layout.width - 2.0 * EDGE_PX);
        let end = paragraph(&mut svg, &note, (EDGE_PX, grid.bottom() + 12.0), &look);
        Ok(svg.finish(layout.width, end + EDGE_PX, &self.title))
    }

    fn color_range(&self) -> Result<(f64, f64), DrawError> {
        if let Some((low, high)) = self.range {
            if !(low.is_finite() && high.is_finite() && low < high) {
                let must = "finite and above the range's low end";
                return Err(DrawError::Value { what: "color range", value: high, must });
            }
            return Ok((low, high));
        }
        let finite = || self.values.iter().copied().filter(|v| v.abs() <= 1e100);
        let low = finite().fold(0.0, f64::min);
        let high = finite().fold(low, f64::max);
        let unit = low >= 0.0 && high <= 1.0;
        Ok(if unit { (low, low + 1.0) } else { widened((low, high)) })
    }

    fn number(&self, value: f64) -> String {
        if value.is_finite() { label(value, self.digits) } else { "–".into() }
    }

    /// Returns the size of a cell if each may be `room` wide, whether the column names must read
    /// upward, and whether numbers fit.
    fn cell_size(&self, font_px: f64, room: f64) -> ((f64, f64), bool, bool) {
        let numbers: Vec<String> = self.values.iter().map(|&v| self.number(v)).collect();
        let number_px = widest(numbers.iter().chain(&self.subscripts), font_px);
        let words = self.columns.iter().flat_map(|name| name.split(' '));
        let word_px = widest(words, font_px);
        let upright = word_px + 8.0 > room;
        let wanted = number_px.max(if upright { 0.0 } else { word_px }) + 14.0;
        let width = wanted.max(3.6 * font_px).min(room);
        let numbers_fit = number_px + 2.0 <= width;
        let lines = if self.subscripts.is_empty() { 2.4 } else { 3.2 };
        let height = match numbers_fit {
            true => (0.62 * width).max(lines * font_px),
            false => width.max(1.1 * font_px),
        };
        ((width, height), upright, numbers_fit)
    }

    fn draw_cells(
        &self,
        svg: &mut Svg,
        style: &Style,
        layout: &Layout,
        grid: Rect,
        range: (f64, f64),
    ) {
        for (index, &value) in self.values.iter().enumerate() {
            let (row, column) = (index / self.columns.len(), index % self.columns.len());
            let cell = layout.cell(grid, row, column);
            let part = (value - range.0) / (range.1 - range.0);
            let fill = if value.is_finite() { shade(part) } else { "#DDDDDD".into() };
            svg.rect(cell, format_args!(r##"fill="{fill}" stroke="#FFFFFF""##));
            if layout.numbers {
                let ink = if part > 0.55 { "#FFFFFF" } else { INK };
                let subscript = self.subscripts.get(index).map_or("", String::as_str);
                draw_number(svg, style, cell, &self.number(value), subscript, ink);
            }
        }
        svg.rect(grid, format_args!(r#"fill="none" stroke="{INK}""#));
    }

    fn draw_labels(&self, svg: &mut Svg, style: &Style, layout: &Layout, grid: Rect) {
        let right = TextLook::new(style.small_px(), Anchor::End);
        for (row, name) in layout.rows.iter().enumerate() {
            let cell = layout.cell(grid, row, 0);
            let y = cell.y + cell.height / 2.0 + right.middle_px();
            svg.text(grid.x - 6.0, y, name, &right);
        }
        for (column, lines) in layout.columns.iter().enumerate() {
            draw_column_name(svg, style, layout.cell(grid, 0, column), lines, layout.upright);
        }
        let look = TextLook::new(style.font_px, Anchor::Middle);
        let above = grid.y - layout.above + style.font_px + 4.0;
        svg.text(grid.x + grid.width / 2.0, above, &self.column_title, &look);
        let upward = TextLook { upward: true, ..look };
        svg.text(EDGE_PX + style.font_px, grid.y + grid.height / 2.0, &self.row_title, &upward);
    }
}

/// Positions of all parts.
struct Layout {
    width: f64,
    left: f64,
    /// Room over the cells for the column names and their title.
    above: f64,
    cell: (f64, f64),
    rows: Vec<String>,
    columns: Vec<Vec<String>>,
    /// Whether column names do not fit across and read upward.
    upright: bool,
    numbers: bool,
    extent: (f64, f64),
}

impl Layout {
    fn of(matrix: &Matrix, style: &Style) -> Self {
        let small = style.small_px();
        let most_px = 0.25 * style.width_px;
        let shorten = |name: &String| text::shorten(name, small, Weight::Regular, most_px);
        let rows: Vec<String> = matrix.rows.iter().map(shorten).collect();
        let left = EDGE_PX + 1.7 * style.font_px + widest(rows.iter(), small) + 8.0;
        let right = BAR_PX + 5.0 * style.font_px + EDGE_PX;
        let room = (style.width_px - left - right).max(60.0) / matrix.columns.len() as f64;
        let (cell, upright, numbers) = matrix.cell_size(small, room);
        let columns = column_lines(matrix, small, cell.0, upright);
        let title_px = if matrix.column_title.is_empty() { 0.0 } else { 1.6 * style.font_px };
        let above = names_px(&columns, small, upright) + title_px + 8.0;
        let extent = (cell.0 * matrix.columns.len() as f64, cell.1 * rows.len() as f64);
        // A small matrix still leaves some room for its title.
        let width = (left + extent.0 + right).max(0.5 * style.width_px);
        Self { width, left, above, cell, rows, columns, upright, numbers, extent }
    }

    fn grid(&self, head: f64) -> Rect {
        Rect { x: self.left, y: head + self.above, width: self.extent.0, height: self.extent.1 }
    }

    fn cell(&self, grid: Rect, row: usize, column: usize) -> Rect {
        let (width, height) = self.cell;
        Rect { x: grid.x + column as f64 * width, y: grid.y + row as f64 * height, width, height }
    }
}

/// Returns the width of the widest of `texts`.
fn widest(texts: impl Iterator<Item = impl AsRef<str>>, size: f64) -> f64 {
    texts.map(|t| text::width(t.as_ref(), size, Weight::Regular)).fold(0.0, f64::max)
}

/// Returns the lines of each column's name.
fn column_lines(matrix: &Matrix, size: f64, width: f64, upright: bool) -> Vec<Vec<String>> {
    let lines = |name: &String| match upright {
        true => vec![text::shorten(name, size, Weight::Regular, 10.0 * size)],
        false => text::wrap(name, size, Weight::Regular, width - 4.0),
    };
    matrix.columns.iter().map(lines).collect()
}

/// Returns the height that the column names take.
fn names_px(columns: &[Vec<String>], size: f64, upright: bool) -> f64 {
    if upright {
        return widest(columns.iter().flatten(), size);
    }
    columns.iter().map(Vec::len).max().unwrap_or(0) as f64 * size * 1.35
}

fn draw_column_name(svg: &mut Svg, style: &Style, cell: Rect, lines: &[String], upright: bool) {
    let size = style.small_px();
    let center = cell.x + cell.width / 2.0;
    if upright {
        let look = TextLook { upward: true, ..TextLook::new(size, Anchor::Start) };
        for name in lines {
            svg.text(center + look.middle_px(), cell.y - 5.0, name, &look);
        }
        return;
    }
    let top = cell.y - 4.0 - lines.len() as f64 * size * 1.35;
    paragraph(svg, lines, (center, top), &TextLook::new(size, Anchor::Middle));
}

fn draw_number(svg: &mut Svg, style: &Style, cell: Rect, number: &str, subscript: &str, ink: &str) {
    let look = TextLook { fill: ink, ..TextLook::new(style.small_px(), Anchor::Middle) };
    let (x, y) = (cell.x + cell.width / 2.0, cell.y + cell.height / 2.0 + look.middle_px());
    if subscript.is_empty() {
        return svg.text(x, y, number, &look);
    }
    let small = TextLook { size_px: 0.82 * look.size_px, ..look };
    svg.text(x, y - 0.6 * look.size_px, number, &look);
    svg.text(x, y + 0.7 * look.size_px, subscript, &small);
}

/// Draws the bar that explains the colors.
fn draw_color_bar(svg: &mut Svg, style: &Style, grid: Rect, (low, high): (f64, f64)) {
    const STEPS: u32 = 48;
    let (x, height) = (grid.right() + 1.2 * style.font_px, grid.height / f64::from(STEPS));
    for step in 0..STEPS {
        let fill = shade((f64::from(step) + 0.5) / f64::from(STEPS));
        // Each step reaches under the one below it, so that there is no seam.
        let overlap = if step > 0 { 0.5 } else { 0.0 };
        let y = grid.bottom() - f64::from(step + 1) * height;
        svg.rect(
            Rect { x, y, width: BAR_PX, height: height + overlap },
            format_args!(r#"fill="{fill}""#),
        );
    }
    svg.rect(Rect { x, width: BAR_PX, ..grid }, format_args!(r#"fill="none" stroke="{INK}""#));
    let most = ((grid.height / (2.0 * style.font_px)) as usize).clamp(1, 5);
    let look = TextLook::new(style.small_px(), Anchor::Start);
    for (value, label) in Ticks::linear(low, high, most).major {
        let y = grid.bottom() - (value - low) / (high - low) * grid.height;
        svg.line((x + BAR_PX, y), (x + BAR_PX + 3.0, y), format_args!(r#"stroke="{INK}""#));
        svg.text(x + BAR_PX + 6.0, y + look.middle_px(), &label, &look);
    }
}

/// Returns a shade from white to dark blue, of evenly falling lightness, so that it also reads in
/// gray.
fn shade(part: f64) -> String {
    const STOPS: [[f64; 3]; 5] = [
        [255.0, 255.0, 255.0],
        [198.0, 219.0, 239.0],
        [107.0, 174.0, 214.0],
        [33.0, 113.0, 181.0],
        [8.0, 48.0, 107.0],
    ];
    let place = part.clamp(0.0, 1.0) * 4.0;
    let below = (place as usize).min(3);
    let mix = |k: usize| {
        let (a, b) = (STOPS[below][k], STOPS[below + 1][k]);
        (a + (b - a) * (place - below as f64)).round() as u8
    };
    format!("#{:02X}{:02X}{:02X}", mix(0), mix(1), mix(2))
}
