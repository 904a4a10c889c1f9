//! Figures and tables as plain data; other crates draw them.

use serde::Serialize;

/// A figure to draw.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Figure {
    /// Its title: the content of the figure.
    pub title: String,
    /// The meaning of the intervals and the number of runs; may be empty.
    pub note: String,
    /// What the legend says of means and their intervals; empty where the note says it.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub interval_words: String,
    /// The horizontal quantity, with its unit.
    pub x_label: String,
    /// The vertical quantity, with its unit.
    pub y_label: String,
    /// Scale of the horizontal axis.
    pub x_scale: Scale,
    /// Scale of the vertical axis.
    pub y_scale: Scale,
    /// The kind of chart.
    pub kind: FigureKind,
    /// The series, in the order of the legend.
    pub series: Vec<Series>,
    /// Whether a page shows only the title until a reader opens it.
    pub is_folded: bool,
}

/// The scale of an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Scale {
    /// Equal steps are equal differences.
    #[default]
    Linear,
    /// Equal steps are equal ratios; values of 0 and below are not on the axis.
    Log,
}

/// The kind of a chart.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum FigureKind {
    /// Points joined by lines, intervals as error bars.
    #[default]
    Lines,
    /// Points joined by lines, intervals as a band around them.
    Bands,
    /// Points alone.
    Points,
    /// Paths in the plane: points joined by lines, both axes with the same scale.
    Ways,
    /// Bars side by side; `x` is the number of a category.
    Bars {
        /// Names of the categories, from 0.
        categories: Vec<String>,
    },
    /// Markers side by side, on an axis that need not start at zero; `x` is the number of a category.
    Dots {
        /// Names of the categories, from 0.
        categories: Vec<String>,
    },
    /// Steps up: the share of runs up to each value.
    Steps,
    /// Effects with their intervals against zero, one below the other: `x` is the number of a row, `y` the effect.
    Forest {
        /// Names of the rows, from the top.
        rows: Vec<String>,
        /// The effects in words, series by series and row by row.
        texts: Vec<Vec<String>>,
        /// What is said of them.
        words: ForestWords,
    },
    /// Single runs in named slots: a series is a slot, `x` the number of a seed, `y` the value of its run.
    Runs {
        /// The statistics of each slot.
        slots: Vec<SlotStats>,
        /// Whether lines join the runs of one seed.
        is_joined: bool,
        /// Whether there is a line at zero, as differences need it.
        has_zero_line: bool,
        /// Whether bars from zero show the means, as of counts.
        has_bars: bool,
        /// What the legend calls its marks.
        legend: RunLegend,
    },
    /// Colors over two factors: a series is a row, `x` the number of a column, `y` the value.
    Heat {
        /// Levels of the factor across, from 0.
        columns: Vec<String>,
        /// The quantity that the colors show, with its unit.
        value_label: String,
    },
    /// Points, and the front of those that no other is better than in both quantities.
    Front {
        /// The corners of the front.
        corners: Vec<(f64, f64)>,
    },
}

/// What a forest says of its effects.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize)]
pub struct ForestWords {
    /// The head of the effects in words; may be empty.
    pub heading: String,
    /// Why an effect has words and no mark; may be empty.
    pub unmarked: String,
}

/// What the legend of a figure of single runs calls its marks.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct RunLegend {
    /// A line that joins the runs of one seed.
    pub seed: String,
    /// A mean with its interval.
    pub mean: String,
}

impl Default for RunLegend {
    fn default() -> Self {
        Self { seed: "one seed".into(), mean: "mean, 95 % interval".into() }
    }
}

/// What is drawn beside the runs of a slot.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct SlotStats {
    /// The mean of the runs.
    pub mean: Option<f64>,
    /// Lower and upper end of its interval.
    pub interval: Option<(f64, f64)>,
    /// The least value within 1.5 interquartile ranges of the box, the quartiles with the median between them, and the
    /// greatest such value: a box as Tukey drew it.
    pub five_numbers: Option<[f64; 5]>,
}

/// A measured value at a place of the horizontal axis.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Point {
    /// Position along the horizontal axis.
    pub x: f64,
    /// The value, in the unit of the vertical axis; one that is not a number is not drawn.
    pub y: f64,
    /// Lower and upper end of the value's interval, if it has one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub interval: Option<(f64, f64)>,
    /// Left and right end of the interval of the position, if that is measured, too.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub x_interval: Option<(f64, f64)>,
    /// Number of runs behind the value, if known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub n: Option<usize>,
}

impl Figure {
    /// Returns whether any point has an interval.
    pub fn has_intervals(&self) -> bool {
        self.series.iter().flat_map(|s| &s.points).any(|p| p.interval.is_some())
    }

    /// Returns the numbers of runs behind its points, in words: "n = 8" or "n = 6 to 8"; `None` where none has one.
    pub fn runs_words(&self) -> Option<String> {
        let counts: Vec<usize> = match self.kind {
            FigureKind::Runs { .. } => {
                let runs = |s: &Series| s.points.iter().filter(|p| p.y.is_finite()).count();
                self.series.iter().map(runs).collect()
            }
            _ => self.series.iter().flat_map(|s| &s.points).filter_map(|p| p.n).collect(),
        };
        let (least, most) = counts.iter().min().zip(counts.iter().max())?;
        Some(if least == most { format!("n = {most}") } else { format!("n = {least} to {most}") })
    }

    /// Returns the same figure, of which a page shows the title alone until it is opened.
    #[must_use]
    pub fn folded(self) -> Self {
        Self { is_folded: true, ..self }
    }

    /// Returns the names of positions along the horizontal axis, where these are numbers of names.
    pub fn position_names(&self) -> Option<&[String]> {
        match &self.kind {
            FigureKind::Bars { categories } | FigureKind::Dots { categories } => Some(categories),
            FigureKind::Forest { rows, .. } => Some(rows),
            FigureKind::Heat { columns, .. } => Some(columns),
            _ => None,
        }
    }

    /// Returns the same names, to be replaced.
    pub fn position_names_mut(&mut self) -> &mut [String] {
        match &mut self.kind {
            FigureKind::Bars { categories } | FigureKind::Dots { categories } => categories,
            FigureKind::Forest { rows, .. } => rows,
            FigureKind::Heat { columns, .. } => columns,
            _ => &mut [],
        }
    }

    /// Returns the words of its legend that are no names of series.
    pub fn legend_words(&self) -> Vec<&String> {
        match &self.kind {
            FigureKind::Runs { legend, is_joined, slots, .. } => {
                let seed = is_joined.then_some(&legend.seed);
                let has_mean = slots.iter().any(|slot| slot.mean.is_some());
                seed.into_iter().chain(has_mean.then_some(&legend.mean)).collect()
            }
            _ if self.interval_words.is_empty() => Vec::new(),
            _ => vec![&self.interval_words],
        }
    }

    /// Returns the names of the positions and of the values of its points, as heads of columns.
    pub fn column_labels(&self) -> [&str; 2] {
        match &self.kind {
            FigureKind::Forest { .. } => ["metric", &self.x_label],
            FigureKind::Runs { .. } => ["replicate", &self.y_label],
            FigureKind::Heat { value_label, .. } => [&self.x_label, value_label],
            _ => [&self.x_label, &self.y_label],
        }
    }

    /// Returns the points as a table of comma-separated values with a head: the series, the position, the value, the
    /// ends of its 95 % interval and of that of the position, and the number of runs; what a point has not is empty, and
    /// what none has is no column.
    pub fn csv(&self) -> String {
        let [x, y] = self.column_labels();
        let mut columns = vec![("series", Vec::new()), (x, Vec::new()), (y, Vec::new())];
        columns.extend(["low", "high", "x_low", "x_high", "n"].map(|name| (name, Vec::new())));
        let number = |value: f64| if value.is_finite() { value.to_string() } else { String::new() };
        let ends = |interval: Option<(f64, f64)>| match interval {
            Some((low, high)) => [number(low), number(high)],
            None => Default::default(),
        };
        for series in &self.series {
            for point in &series.points {
                let x = match self.position_names() {
                    Some(names) => names.get(point.x as usize).cloned().unwrap_or_default(),
                    None => number(point.x),
                };
                let [low, high] = ends(point.interval);
                let [x_low, x_high] = ends(point.x_interval);
                let n = point.n.map_or(String::new(), |n| n.to_string());
                let row = [series.name.clone(), x, number(point.y), low, high, x_low, x_high, n];
                for ((_, cells), cell) in columns.iter_mut().zip(row) {
                    cells.push(cell);
                }
            }
        }
        let has_cells = |cells: &[String]| cells.iter().any(|cell| !cell.is_empty());
        let first = columns.drain(..3).collect::<Vec<_>>();
        columns.retain(|(_, cells)| has_cells(cells));
        let columns = [first, columns].concat();
        let line = |cells: Vec<String>| cells.join(",") + "\n";
        let mut text = line(columns.iter().map(|(name, _)| csv_cell(name)).collect());
        for row in 0..columns[0].1.len() {
            text += &line(columns.iter().map(|(_, cells)| csv_cell(&cells[row])).collect());
        }
        text
    }

    /// Adds a note on its intervals: those that an [`Estimate`](super::Estimate) gives.
    #[must_use]
    pub fn with_interval_note(mut self) -> Self {
        if self.note.is_empty() && self.has_intervals() {
            self.note = "Error bars are 95 % intervals of the mean.".into();
        }
        self
    }
}

/// Returns a cell of a table of comma-separated values (RFC 4180): in quotes where it has a mark of these.
fn csv_cell(text: &str) -> String {
    if text.contains([',', '"', '\n', '\r']) {
        return format!("\"{}\"", text.replace('"', "\"\""));
    }
    text.to_string()
}

impl Point {
    /// Returns a value without an interval.
    pub fn new(x: f64, y: f64) -> Self {
        Self { x, y, interval: None, x_interval: None, n: None }
    }

    /// Adds an interval to the value.
    #[must_use]
    pub fn with_interval(self, interval: Option<(f64, f64)>) -> Self {
        Self { interval, ..self }
    }

    /// Adds the number of runs behind the value.
    #[must_use]
    pub fn with_runs(self, n: usize) -> Self {
        Self { n: Some(n), ..self }
    }
}

/// Points that share a color and a name.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Series {
    /// Name in the legend; a series without a name is not listed there.
    pub name: String,
    /// The points, in the order in which a line joins them.
    pub points: Vec<Point>,
}

/// A table to print.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Table {
    /// Its title: the content of the table.
    pub title: String,
    /// The meaning of the numbers: units, number of runs, method, with the markup of
    /// [`Text::from_markup`](super::document::Text::from_markup).
    pub note: String,
    /// Headings of the columns.
    pub columns: Vec<String>,
    /// Cells, row by row; a short row has empty cells at its end.
    pub rows: Vec<Vec<String>>,
    /// Whether a page shows only the title until a reader opens it.
    pub is_folded: bool,
    /// The moment of the run that each row is about; empty where rows are about none.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub moments: Vec<RunMoment>,
}

/// A moment of a run, which a replay shows.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct RunMoment {
    /// The cycle.
    pub cycle: u64,
    /// The agent that it is about, as a replay names it: its number, and that of its part, if it has one.
    pub agent: Option<String>,
}

impl RunMoment {
    /// Returns the end of a replay's address that opens the moment: `cycle=12&agent=8`.
    pub fn fragment(&self) -> String {
        match &self.agent {
            Some(agent) => format!("cycle={}&agent={agent}", self.cycle),
            None => format!("cycle={}", self.cycle),
        }
    }
}

impl Table {
    /// Returns a table without rows.
    pub fn new(title: impl Into<String>, note: impl Into<String>, columns: &[&str]) -> Self {
        let columns = columns.iter().map(|c| (*c).to_string()).collect();
        Self {
            title: title.into(),
            note: note.into(),
            columns,
            rows: Vec::new(),
            is_folded: false,
            moments: Vec::new(),
        }
    }

    /// Returns the same table, of which a page shows the title alone until it is opened.
    #[must_use]
    pub fn folded(self) -> Self {
        Self { is_folded: true, ..self }
    }

    /// Appends a row; cells that are missing stay empty.
    pub fn push_row(&mut self, cells: impl IntoIterator<Item = String>) {
        self.rows.push(cells.into_iter().collect());
    }

    /// Returns the cells of a row, one per column.
    pub fn cells<'a>(&'a self, row: &'a [String]) -> impl Iterator<Item = &'a str> {
        (0..self.columns.len()).map(|k| row.get(k).map_or("", String::as_str))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_data_of_a_figure_have_the_names_of_its_positions_and_empty_cells_for_what_is_not_there()
    {
        let points = vec![
            Point::new(0.0, 1.5).with_interval(Some((1.0, 2.0))).with_runs(4),
            Point::new(1.0, f64::NAN),
        ];
        let figure = Figure {
            x_label: "kind".into(),
            y_label: "hits, all".into(),
            kind: FigureKind::Bars { categories: vec!["a \"wall\"".into(), "door".into()] },
            series: vec![Series { name: "calm".into(), points }],
            ..Figure::default()
        };
        let expected = "series,kind,\"hits, all\",low,high,n\n\
                        calm,\"a \"\"wall\"\"\",1.5,1,2,4\ncalm,door,,,,\n";
        assert_eq!(figure.csv(), expected);
    }
}
