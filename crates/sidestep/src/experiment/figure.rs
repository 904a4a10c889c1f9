//! Figures and tables as plain data; others draw them.

use serde::Serialize;
use std::fmt::{self, Write};

/// A figure to draw.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Figure {
    /// What it shows.
    pub title: String,
    /// The horizontal quantity, with its unit.
    pub x_label: String,
    /// The vertical quantity, with its unit.
    pub y_label: String,
    /// How to draw the points.
    pub kind: FigureKind,
    /// The series, in the order of the legend.
    pub series: Vec<Series>,
}

/// How the points of a figure are drawn.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum FigureKind {
    /// Points joined by lines.
    Lines,
    /// Points alone.
    Points,
    /// Bars side by side; `x` is the number of a category.
    Bars {
        /// Names of the categories, from 0.
        categories: Vec<String>,
    },
}

/// A point: x, y, and the interval of y where it has one.
pub type Point = (f64, f64, Option<(f64, f64)>);

/// A named series of points.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Series {
    /// Name in the legend.
    pub name: String,
    /// The points.
    pub points: Vec<Point>,
}

/// A table to print.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Table {
    /// What it shows.
    pub title: String,
    /// What the numbers are: units, number of runs, how they were taken.
    pub note: String,
    /// Heads of the columns.
    pub columns: Vec<String>,
    /// Cells, row by row.
    pub rows: Vec<Vec<String>>,
}

impl Table {
    /// A table without rows.
    pub fn new(title: impl Into<String>, note: impl Into<String>, columns: &[&str]) -> Self {
        let columns = columns.iter().map(|c| (*c).to_string()).collect();
        Self { title: title.into(), note: note.into(), columns, rows: Vec::new() }
    }

    /// Appends a row; cells that are missing stay empty.
    pub fn row(&mut self, cells: impl IntoIterator<Item = String>) {
        self.rows.push(cells.into_iter().collect());
    }
}

/// Cells must not end their column: bars inside are escaped.
fn line(f: &mut fmt::Formatter<'_>, cells: &[String], columns: usize) -> fmt::Result {
    f.write_char('|')?;
    for k in 0..columns {
        let cell = cells.get(k).map_or("", String::as_str);
        write!(f, " {} |", cell.replace('|', "\\|").replace('\n', " "))?;
    }
    f.write_char('\n')
}

/// As Markdown, with the title as a heading of the third level.
impl fmt::Display for Table {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let n = self.columns.len();
        writeln!(f, "### {}\n", self.title)?;
        line(f, &self.columns, n)?;
        writeln!(f, "|{}", "---|".repeat(n))?;
        self.rows.iter().try_for_each(|row| line(f, row, n))?;
        if !self.note.is_empty() {
            writeln!(f, "\n{}", self.note)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_prints_as_markdown() {
        let mut table = Table::new("Title", "A note.", &["a", "b"]);
        table.row(["1".into(), "x|y".into()]);
        table.row(["2".into()]);
        assert_eq!(
            table.to_string(),
            "### Title\n\n| a | b |\n|---|---|\n| 1 | x\\|y |\n| 2 |  |\n\nA note.\n"
        );
    }
}
