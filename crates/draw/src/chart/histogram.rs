//! Histograms.

use crate::axis::{Axis, Fitted};
use crate::chart::bars::column;
use crate::chart::frame::{Across, Frame, Words, most_ticks};
use crate::error::DrawError;
use crate::style::{Style, series_color};

/// Most bins: more bins than a screen has pixels show nothing more.
const MOST_BINS: usize = 10_000;

/// A histogram: counts of values between edges.
#[derive(Debug, Clone, PartialEq)]
pub struct Histogram {
    title: String,
    note: String,
    x: Axis,
    y: Axis,
    edges: Vec<f64>,
    counts: Vec<u64>,
}

impl Histogram {
    /// Returns a histogram of counts: `counts[i]` values lie between `edges[i]` and `edges[i + 1]`.
    ///
    /// # Errors
    /// [`DrawError::Length`] if there is not one edge more than counts, [`DrawError::Value`] if the
    /// edges do not rise, [`DrawError::TooLarge`] above 10 000 bins.
    pub fn from_counts(
        title: impl Into<String>,
        edges: Vec<f64>,
        counts: Vec<u64>,
    ) -> Result<Self, DrawError> {
        check_bins(counts.len())?;
        DrawError::length("histogram edges", counts.len() + 1, edges.len())?;
        if let Some(pair) = edges.windows(2).find(|pair| !rises(pair)) {
            let must = "finite and above the edge before it";
            return Err(DrawError::Value { what: "histogram edge", value: pair[1], must });
        }
        let (x, y) = (Axis::linear("value"), Axis::linear("count"));
        Ok(Self { title: title.into(), note: String::new(), x, y, edges, counts })
    }

    /// Returns a histogram of `values` in `bins` bins of equal width from the least value to the
    /// greatest. Non-finite values are not counted; without any values all counts are zero.
    ///
    /// # Errors
    /// [`DrawError::Value`] for zero bins, [`DrawError::TooLarge`] above 10 000.
    pub fn from_values(
        title: impl Into<String>,
        values: &[f64],
        bins: usize,
    ) -> Result<Self, DrawError> {
        DrawError::positive("number of bins", bins as f64)?;
        check_bins(bins)?;
        let axis = Axis::linear("value");
        let values = || values.iter().copied().filter(|v| axis.holds(*v));
        let low = values().reduce(f64::min).unwrap_or(0.0);
        let high = values().reduce(f64::max).unwrap_or(1.0);
        // A bin narrower than the rounding of the values would have no width.
        let least = 1e-9 * low.abs().max(high.abs()).max(1e-90) * bins as f64;
        let width = (high - low).max(least) / bins as f64;
        let mut counts = vec![0; bins];
        for value in values() {
            counts[(((value - low) / width) as usize).min(bins - 1)] += 1;
        }
        let edges = (0..=bins).map(|bin| low + bin as f64 * width).collect();
        Self::from_counts(title, edges, counts)
    }

    /// Sets the horizontal axis.
    #[must_use]
    pub fn x_axis(mut self, axis: Axis) -> Self {
        self.x = axis;
        self
    }

    /// Sets the vertical axis, which is linear and labeled `count` by default.
    #[must_use]
    pub fn y_axis(mut self, axis: Axis) -> Self {
        self.y = axis;
        self
    }

    /// Sets the small print under the histogram.
    #[must_use]
    pub fn note(mut self, note: impl Into<String>) -> Self {
        self.note = note.into();
        self
    }

    /// Draws the histogram.
    ///
    /// # Errors
    /// [`DrawError::Value`] if the style or an axis's given range is impossible.
    pub fn to_svg(&self, style: &Style) -> Result<String, DrawError> {
        style.check()?;
        let (most_across, most_up) = most_ticks(style);
        let x = self.x.clone().tight().fit(self.edges.iter().copied(), most_across)?;
        // Without any counts the axis still shows where one would be.
        let counts = self.counts.iter().map(|&n| n as f64).chain([0.0, 1.0]);
        let y = self.y.clone().counting().fit(counts, most_up)?;
        let words = Words {
            title: &self.title,
            note: &self.note,
            x_label: self.x.label(),
            y_label: self.y.label(),
            legend: vec![],
        };
        let mut frame = Frame::open(style, words, &Across::Values(x.clone()), &y);
        frame.open_data();
        self.draw_bins(&mut frame, &x);
        frame.svg.close_group();
        Ok(frame.finish())
    }

    fn draw_bins(&self, frame: &mut Frame, x: &Fitted) {
        let scale = frame.x_scale(x);
        for (pair, &count) in self.edges.windows(2).zip(&self.counts) {
            let (left, right) = (scale.px(pair[0]), scale.px(pair[1]));
            if count > 0 {
                let gap = if right - left > 4.0 { 1.0 } else { 0.0 };
                column(
                    frame,
                    (left + gap / 2.0, right - left - gap),
                    count as f64,
                    series_color(0),
                );
            }
        }
    }
}

fn check_bins(bins: usize) -> Result<(), DrawError> {
    if bins > MOST_BINS {
        let (found, limit) = (bins as u64, MOST_BINS as u64);
        return Err(DrawError::TooLarge { what: "histogram bins", found, limit });
    }
    Ok(())
}

fn rises(pair: &[f64]) -> bool {
    pair[0].is_finite() && pair[1].is_finite() && pair[0] < pair[1]
}
