//! A heat map: a quantity over two factors, as the colors of cells.

use crate::axis::FittedAxis;
use crate::chart::DrawnChart;
use crate::chart::frame::{ChartFrame, FrameText, XAxis};
use crate::error::DrawError;
use crate::legend::{LegendEntry, LegendSymbol};
use crate::style::{GROUND, Style, hex};
use crate::svg::{Anchor, Rect, TextStyle};
use crate::text::{self, Weight};

/// Colors from the least to the greatest value: viridis of matplotlib at its quarters. Its lightness rises evenly, so
/// that it is read in gray, too, and with every common color blindness.
const COLORS: [[u8; 3]; 5] =
    [[68, 1, 84], [59, 82, 139], [33, 145, 140], [94, 201, 98], [253, 231, 37]];
/// Number of colors that the legend shows.
const LEGEND_COLORS: usize = 5;
/// Lightness above which a cell has dark text.
const LIGHT: f64 = 0.5;

/// A chart of a quantity over two factors.
#[derive(Debug, Clone, PartialEq)]
pub struct HeatChart {
    /// Its title.
    pub title: String,
    /// The small print under the chart.
    pub note: String,
    /// The factor across.
    pub x_label: String,
    /// The factor upward.
    pub y_label: String,
    /// The quantity that the colors show.
    pub value_label: String,
    /// Levels of the factor across, from left to right.
    pub columns: Vec<String>,
    /// Levels of the factor upward, from top to bottom.
    pub rows: Vec<String>,
    /// The values, row by row; a cell without a number is empty.
    pub values: Vec<Vec<f64>>,
}

impl HeatChart {
    /// Draws the chart.
    ///
    /// # Errors
    /// [`DrawError::Length`] if values and levels are not equally many, [`DrawError::Value`] if the style is
    /// impossible.
    pub fn draw(&self, style: &Style) -> Result<DrawnChart, DrawError> {
        style.check()?;
        DrawError::length("rows of a heat map", self.rows.len(), self.values.len())?;
        for row in &self.values {
            DrawError::length("cells of a row", self.columns.len(), row.len())?;
        }
        let range = self.range();
        let words = FrameText {
            title: &self.title,
            note: &self.note,
            x_label: &self.x_label,
            y_label: &self.y_label,
            legend: self.legend(range),
            ..FrameText::default()
        };
        let rows = FittedAxis::rows(&self.rows);
        let mut frame = ChartFrame::open(style, words, &XAxis::Categories(&self.columns), &rows);
        let width = frame.area.width / self.columns.len().max(1) as f64;
        let height = frame.area.height / self.rows.len().max(1) as f64;
        for (r, row) in self.values.iter().enumerate() {
            for (c, value) in row.iter().enumerate().filter(|(_, value)| value.is_finite()) {
                let x = frame.area.x + c as f64 * width;
                let y = frame.area.y + r as f64 * height;
                draw_cell(&mut frame, Rect { x, y, width, height }, (*value, range), style);
                frame.push_spot((x + width / 2.0, y + height / 2.0), r, c);
            }
        }
        Ok(frame.finish())
    }

    /// Returns the least and the greatest value.
    fn range(&self) -> [f64; 2] {
        let values = self.values.iter().flatten().copied().filter(|value| value.is_finite());
        let low = values.clone().fold(f64::INFINITY, f64::min);
        let high = values.fold(f64::NEG_INFINITY, f64::max);
        if low <= high { [low, high] } else { [0.0, 1.0] }
    }

    /// Returns the colors of some values, after the name of the quantity.
    fn legend(&self, [low, high]: [f64; 2]) -> Vec<LegendEntry> {
        let count = if high > low { LEGEND_COLORS } else { 1 };
        let mut entries = Vec::with_capacity(count);
        for k in 0..count {
            let part = k as f64 / (LEGEND_COLORS - 1) as f64;
            let fill = hex(color(part)).into();
            let symbol = LegendSymbol::Swatch { fill, rim: "none".into(), opacity: 1.0 };
            let value = short_number(low + part * (high - low));
            // The last one has the name, so that the numbers stay together.
            let label =
                if k + 1 == count { format!("{value}  {}", self.value_label) } else { value };
            entries.push(LegendEntry::new(symbol, label));
        }
        entries
    }
}

/// Fills a cell with the color of its value, and writes that into it where there is room.
fn draw_cell(
    frame: &mut ChartFrame,
    cell: Rect,
    (value, [low, high]): (f64, [f64; 2]),
    style: &Style,
) {
    let part = if high > low { (value - low) / (high - low) } else { 0.0 };
    let fill = color(part);
    let attributes = format!(r#"fill="{}" stroke="{GROUND}" stroke-width="1""#, hex(fill));
    frame.svg.rect(cell, attributes);
    let ink = if lightness(fill) > LIGHT { BLACK } else { WHITE };
    let text_style = TextStyle { fill: ink, ..TextStyle::new(style.small_px(), Anchor::Middle) };
    let label = short_number(value);
    let label_px = text::width(&label, text_style.size_px, Weight::Regular);
    if label_px + 4.0 <= cell.width && 1.2 * text_style.size_px <= cell.height {
        let x = cell.x + cell.width / 2.0;
        let y = cell.y + cell.height / 2.0 + text_style.middle_px();
        frame.svg.text(x, y, &label, &text_style);
    }
}

/// Colors of text on dark and on light cells, which are the same on a dark ground: unlike those of other text.
const WHITE: &str = "#FEFEFE";
const BLACK: &str = "#1A1A1A";

/// Returns the color at a place from 0 to 1.
fn color(part: f64) -> [u8; 3] {
    let place = part.clamp(0.0, 1.0) * (COLORS.len() - 1) as f64;
    let below = (place as usize).min(COLORS.len() - 2);
    let rest = place - below as f64;
    let mix = |k: usize| {
        let from = f64::from(COLORS[below][k]);
        let to = f64::from(COLORS[below + 1][k]);
        (from + rest * (to - from)).round() as u8
    };
    [mix(0), mix(1), mix(2)]
}

/// Returns how light a color is, from 0 to 1, as the eye weighs its parts.
fn lightness([red, green, blue]: [u8; 3]) -> f64 {
    let parts = 0.299 * f64::from(red) + 0.587 * f64::from(green) + 0.114 * f64::from(blue);
    parts / 255.0
}

/// Returns a number with three digits.
fn short_number(value: f64) -> String {
    let rounded: f64 = format!("{value:.2e}").parse().unwrap_or(value);
    if rounded != 0.0 && !(1e-3..1e6).contains(&rounded.abs()) {
        return format!("{rounded:e}");
    }
    rounded.to_string().replace('-', "\u{2212}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_have_the_color_and_the_number_of_their_value() {
        let chart = HeatChart {
            title: "T".into(),
            note: String::new(),
            x_label: "a".into(),
            y_label: "b".into(),
            value_label: "hits".into(),
            columns: vec!["1".into(), "2".into()],
            rows: vec!["low".into(), "high".into()],
            values: vec![vec![0.0, 1.234], vec![f64::NAN, 10.0]],
        };
        let drawn = chart.draw(&Style::CHART).unwrap();
        assert_eq!(drawn.spots.len(), 3);
        assert!(
            drawn.svg.contains(r##"fill="#440154""##) && drawn.svg.contains(r##"fill="#FDE725""##)
        );
        assert!(drawn.svg.contains(">1.23</text>") && drawn.svg.contains("10  hits"));
        let short = HeatChart { values: vec![vec![1.0]; 2], ..chart };
        assert!(short.draw(&Style::CHART).is_err());
    }

    #[test]
    fn lightness_rises_with_the_value() {
        let rising: Vec<f64> = (0..=20).map(|k| lightness(color(f64::from(k) / 20.0))).collect();
        assert!(rising.windows(2).all(|pair| pair[1] > pair[0]), "{rising:?}");
    }
}
