//! Grouped bars: one group per category, in each group one bar per series.

use crate::axis::Axis;
use crate::chart::frame::{ChartFrame, FrameText, XAxis, max_ticks};
use crate::chart::{DrawnChart, error_bar};
use crate::error::DrawError;
use crate::legend::{LegendEntry, LegendSymbol, Marker};
use crate::style::{INK, Style, series_color, series_fill};
use crate::svg::Rect;

/// The part of a category's slot that its bars fill; the rest separates it from the next.
const FILLED_FRACTION: f64 = 0.78;
/// Greatest width of a bar: a few wide ones would look like areas.
const MAX_BAR_WIDTH_PX: f64 = 60.0;

/// Radius of a marker in place of a bar, and half the width of the caps of its interval.
const DOT_PX: f64 = 4.5;
const DOT_CAP_PX: f64 = 4.0;

/// The height of a bar, optionally with its interval.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bar {
    /// Height in units of the vertical axis; a bar that is not a number is left out.
    pub value: f64,
    /// Lower and upper end of the error bar, in the same units.
    pub interval: Option<(f64, f64)>,
}

impl Bar {
    /// Returns a bar without an error bar.
    pub fn new(value: f64) -> Self {
        Self { value, interval: None }
    }

    fn heights(&self) -> [f64; 3] {
        let (low, high) = self.interval.unwrap_or((self.value, self.value));
        [low, self.value, high]
    }

    /// Adds an error bar from `low` to `high`, e.g. a 95 % confidence interval.
    #[must_use]
    pub fn with_interval(mut self, low: f64, high: f64) -> Self {
        self.interval = Some((low, high));
        self
    }
}

/// The bars of one color: one per category.
#[derive(Debug, Clone, PartialEq)]
pub struct BarSeries {
    /// Label in the legend.
    pub label: String,
    /// One bar per category, in their order.
    pub bars: Vec<Bar>,
}

impl BarSeries {
    /// Returns a series of `bars`, one per category.
    pub fn new(label: impl Into<String>, bars: Vec<Bar>) -> Self {
        Self { label: label.into(), bars }
    }
}

/// A chart of bars in groups, e.g. contacts by kind of obstacle, for each regime.
#[derive(Debug, Clone, PartialEq)]
pub struct BarChart {
    title: String,
    note: String,
    x_label: String,
    categories: Vec<String>,
    y: Axis,
    series: Vec<BarSeries>,
    are_dots: bool,
    interval_label: String,
}

impl BarChart {
    /// Returns an empty chart with these categories along the horizontal axis.
    pub fn new(
        title: impl Into<String>,
        categories: impl IntoIterator<Item = impl Into<String>>,
    ) -> Self {
        Self {
            title: title.into(),
            note: String::new(),
            x_label: String::new(),
            categories: categories.into_iter().map(Into::into).collect(),
            y: Axis::linear(""),
            series: vec![],
            are_dots: false,
            interval_label: String::new(),
        }
    }

    /// Draws markers in place of bars. They need no zero on the axis, so that small differences of large values are
    /// seen.
    #[must_use]
    pub fn dots(mut self) -> Self {
        self.are_dots = true;
        self
    }

    /// Names the categories as a whole.
    #[must_use]
    pub fn x_label(mut self, label: impl Into<String>) -> Self {
        self.x_label = label.into();
        self
    }

    /// Sets the vertical axis. Bars start at zero, or at the low end of a logarithmic axis.
    #[must_use]
    pub fn y_axis(mut self, axis: Axis) -> Self {
        self.y = axis;
        self
    }

    /// Adds a series.
    #[must_use]
    pub fn series(mut self, series: BarSeries) -> Self {
        self.series.push(series);
        self
    }

    /// Sets the small print under the chart, e.g. the meaning of the error bars.
    #[must_use]
    pub fn note(mut self, note: impl Into<String>) -> Self {
        self.note = note.into();
        self
    }

    /// Sets what the legend says of the intervals; empty words have no place there.
    #[must_use]
    pub fn interval_label(mut self, label: impl Into<String>) -> Self {
        self.interval_label = label.into();
        self
    }

    /// Draws the chart.
    ///
    /// # Errors
    /// [`DrawError::Length`] if a series has not one bar per category, [`DrawError::Value`] if the
    /// style or the axis's given range is impossible.
    pub fn to_svg(&self, style: &Style) -> Result<String, DrawError> {
        self.draw(style).map(|chart| chart.svg)
    }

    /// Draws the chart, and returns where its marks are.
    ///
    /// # Errors
    /// As [`Self::to_svg`].
    pub fn draw(&self, style: &Style) -> Result<DrawnChart, DrawError> {
        style.check()?;
        for series in &self.series {
            DrawError::length("bars of a series", self.categories.len(), series.bars.len())?;
        }
        let y = self.y.fit(self.heights(), max_ticks(style).1)?;
        let words = FrameText {
            title: &self.title,
            note: &self.note,
            x_label: &self.x_label,
            y_label: self.y.label(),
            legend: self.legend(),
            ..FrameText::default()
        };
        let mut frame = ChartFrame::open(style, words, &XAxis::Categories(&self.categories), &y);
        frame.open_data();
        for (index, series) in self.series.iter().enumerate() {
            self.draw_series(&mut frame, index, series);
        }
        if !self.are_dots {
            let base = frame.y.base_px();
            let area = frame.area;
            frame.svg.line((area.x, base), (area.right(), base), format_args!(r#"stroke="{INK}""#));
        }
        frame.svg.close_group();
        Ok(frame.finish())
    }

    /// Returns all values that the axis must show: zero is among them where bars start there.
    fn heights(&self) -> impl Iterator<Item = f64> {
        let bars = self.series.iter().flat_map(|series| &series.bars);
        let base = (!self.are_dots).then_some(0.0);
        bars.flat_map(Bar::heights).chain(base)
    }

    fn legend(&self) -> Vec<LegendEntry> {
        let mut entries = Vec::with_capacity(self.series.len());
        for (index, series) in self.series.iter().enumerate() {
            let (opacity, rim) = series_fill(index);
            let color = series_color(index).into();
            let symbol = if self.are_dots {
                LegendSymbol::Marker { color, marker: Marker::of_series(index) }
            } else {
                LegendSymbol::Swatch { fill: color, rim: rim.into(), opacity }
            };
            entries.push(LegendEntry::new(symbol, &series.label));
        }
        let intervals = LegendSymbol::Mean { color: INK.into() };
        entries.push(LegendEntry::new(intervals, &self.interval_label));
        entries
    }

    fn draw_series(&self, frame: &mut ChartFrame, index: usize, series: &BarSeries) {
        let slot = frame.area.width / self.categories.len().max(1) as f64;
        let count = self.series.len() as f64;
        let width = (slot * FILLED_FRACTION / count).min(MAX_BAR_WIDTH_PX);
        // Offset from the middle of the slot to the middle of this series' bar.
        let aside = (index as f64 - (count - 1.0) / 2.0) * width;
        for (category, bar) in series.bars.iter().enumerate() {
            if self.y.contains(bar.value) {
                let center = frame.area.x + (category as f64 + 0.5) * slot + aside;
                if self.are_dots {
                    draw_dot(frame, bar, center, index);
                } else {
                    draw_bar(frame, bar, center, width, index);
                }
                let end = frame.y.px(bar.value);
                frame.push_spot((center, end), index, category);
            }
        }
    }
}

/// Draws `bar` around `center`; a little of its `width` stays free beside the next one.
fn draw_bar(frame: &mut ChartFrame, bar: &Bar, center: f64, width: f64, index: usize) {
    let filled = width - (0.06 * width).min(1.5);
    column(frame, center - filled / 2.0, filled, bar.value, index);
    if let Some((low, high)) = bar.interval.filter(|(l, h)| l.is_finite() && h.is_finite()) {
        let ends = (frame.y.px(low), frame.y.px(high));
        error_bar(&mut frame.svg, center, ends, (0.2 * width).min(5.0), INK);
    }
}

/// Draws the marker of a series at the height of `bar`.
fn draw_dot(frame: &mut ChartFrame, bar: &Bar, center: f64, index: usize) {
    let color = series_color(index);
    if let Some((low, high)) = bar.interval.filter(|(l, h)| l.is_finite() && h.is_finite()) {
        let ends = (frame.y.px(low), frame.y.px(high));
        error_bar(&mut frame.svg, center, ends, DOT_CAP_PX, &color);
    }
    let at = (center, frame.y.px(bar.value));
    Marker::of_series(index).draw(&mut frame.svg, at, DOT_PX, &color);
}

/// Draws a filled column from the axis's base to `value`, its left edge at `x`.
fn column(frame: &mut ChartFrame, x: f64, width: f64, value: f64, index: usize) {
    let base = frame.y.base_px();
    let end = frame.y.px(value);
    let column = Rect { x, y: base.min(end), width, height: (base - end).abs() };
    let color = series_color(index);
    let (opacity, rim) = series_fill(index);
    let attributes = match opacity {
        1.0 => format!(r#"fill="{color}""#),
        _ => format!(r#"fill="{color}" fill-opacity="{opacity}" stroke="{rim}""#),
    };
    frame.svg.rect(column, attributes);
}
