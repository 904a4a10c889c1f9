//! Sizes and colors that all pictures share.

use crate::error::DrawError;
use sidestep_kernel::view::{BODY_COLORS, Color};
use std::collections::{BTreeMap, BTreeSet};

/// One more than bodies have: charts also use black, which on a map would be a wall.
const SERIES_COLOR_COUNT: usize = BODY_COLORS.len() + 1;

/// Returns the colors of series in SVG notation, those of bodies and black: Okabe and Ito's palette without its
/// yellow, which is unreadable on white; distinct for every common color blindness.
pub fn series_colors() -> Vec<String> {
    (0..SERIES_COLOR_COUNT).map(series_color).collect()
}

/// Text and axes.
pub(crate) const INK: &str = "#222222";
/// Secondary text.
pub(crate) const FAINT_INK: &str = "#555555";
/// Grid lines behind the data.
pub(crate) const GRID: &str = "#E4E4E4";

/// The ground of a picture.
pub(crate) const GROUND: &str = "#FFFFFF";

/// Returns the attributes of a thin line behind the data.
pub(crate) fn reference_line(color: &str, width_px: f64) -> String {
    format!(r#"fill="none" stroke="{color}" stroke-width="{width_px}" stroke-opacity="0.55""#)
}

/// Returns the color of the series (or track) with this number; colors repeat after seven.
pub(crate) fn series_color(index: usize) -> String {
    const BLACK: Color = [0; 3];
    hex(BODY_COLORS.get(index % SERIES_COLOR_COUNT).copied().unwrap_or(BLACK))
}

/// Dashes of lines, as attributes: the first time through the colors they have none.
const DASHES: [&str; 4] = [
    "",
    r#" stroke-dasharray="7 4""#,
    r#" stroke-dasharray="2 4""#,
    r#" stroke-dasharray="7 3 2 3""#,
];

/// The look of a series: numbers of its color, its marker, and the dashes of its line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SeriesLook {
    /// Colors repeat after seven.
    pub color: usize,
    /// Markers repeat after five.
    pub marker: usize,
    /// Dashes repeat after four; the first ones are a whole line.
    pub dash: usize,
}

impl SeriesLook {
    /// Returns the look of the series with this number, where each has a color of its own; its dashes differ where colors
    /// repeat.
    pub fn of_series(index: usize) -> Self {
        Self { color: index, marker: index, dash: index / SERIES_COLOR_COUNT }
    }

    /// Returns the attributes of the dashes of its line.
    pub(crate) fn dash_attribute(self) -> &'static str {
        DASHES[self.dash % DASHES.len()]
    }
}

/// Returns the dashes of the trails of bodies with these numbers, which differ where colors repeat.
pub(crate) fn body_dashes(numbers: &BTreeSet<u32>) -> BTreeMap<u32, &'static str> {
    // Number of bodies so far that have each color.
    let mut times = [0; BODY_COLORS.len()];
    let mut dashes = BTreeMap::new();
    for &number in numbers {
        let time = &mut times[number as usize % BODY_COLORS.len()];
        dashes.insert(number, DASHES[*time % DASHES.len()]);
        *time += 1;
    }
    dashes
}

/// Returns the opacity of the bars of a series, and the color of their rim: bars of one color differ in
/// both.
pub(crate) fn series_fill(index: usize) -> (f64, &'static str) {
    match index / SERIES_COLOR_COUNT {
        0 => (1.0, "none"),
        1 => (0.5, INK),
        _ => (0.15, INK),
    }
}

pub(crate) fn hex([r, g, b]: Color) -> String {
    format!("#{r:02X}{g:02X}{b:02X}")
}

/// The size of a picture, and of its text.
///
/// A chart takes the whole `width_px` x `height_px`, and grows in height if a title, a legend or
/// labels need it. A map is scaled to fit that size, and its title, axes and legend are added to
/// it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Style {
    /// Width in SVG pixels.
    pub width_px: f64,
    /// Height in SVG pixels.
    pub height_px: f64,
    /// Size of ordinary text in SVG pixels; titles are a little larger, notes smaller.
    pub font_px: f64,
}

impl Style {
    /// Least width and height in SVG pixels.
    pub const MIN_SIDE_PX: f64 = 100.0;
    /// A figure one column wide.
    pub const CHART: Self = Self { width_px: 640.0, height_px: 420.0, font_px: 13.0 };
    /// A map as large as a page.
    pub const MAP: Self = Self { width_px: 900.0, height_px: 900.0, font_px: 13.0 };

    pub(crate) fn title_px(&self) -> f64 {
        self.font_px * 1.15
    }

    /// Returns the size of notes and tick labels in pixels.
    pub(crate) fn small_px(&self) -> f64 {
        self.font_px * 0.88
    }

    /// Refuses sizes that give no picture or an absurd one.
    pub(crate) fn check(&self) -> Result<(), DrawError> {
        for (what, value) in
            [("picture width in px", self.width_px), ("picture height in px", self.height_px)]
        {
            if !(Self::MIN_SIDE_PX..=20_000.0).contains(&value) {
                return Err(DrawError::Value { what, value, must: "100 to 20000" });
            }
        }
        if !(4.0..=100.0).contains(&self.font_px) {
            let what = "text size in px";
            return Err(DrawError::Value { what, value: self.font_px, must: "4 to 100" });
        }
        Ok(())
    }
}

impl Default for Style {
    fn default() -> Self {
        Self::CHART
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dashes_begin_where_colors_repeat() {
        let numbers = BTreeSet::from([2, 8, 9, 14]);
        let dashes: Vec<&str> = body_dashes(&numbers).into_values().collect();
        assert_eq!(dashes, [DASHES[0], DASHES[1], DASHES[0], DASHES[2]]);
    }

    #[test]
    fn series_have_the_colors_of_bodies_and_black() {
        let colors = series_colors();
        assert_eq!(colors[..BODY_COLORS.len()], BODY_COLORS.map(hex));
        assert_eq!((colors.len(), &*colors[6]), (7, "#000000"));
        assert_eq!([0, 7, 8].map(series_color), ["#0072B2", "#0072B2", "#D55E00"]);
    }
}
