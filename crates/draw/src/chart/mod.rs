//! Charts: a frame with axes, title and legend, and the data in it.

pub(crate) mod bars;
pub(crate) mod forest;
pub(crate) mod frame;
pub(crate) mod heat;
pub(crate) mod plot;
pub(crate) mod slots;

use crate::svg::{Svg, SvgNumber};

/// A finished chart.
#[derive(Debug, Clone, PartialEq)]
pub struct DrawnChart {
    /// The picture.
    pub svg: String,
    /// The marks of its values, for programs that show these where the pointer is.
    pub spots: Vec<Spot>,
}

/// Where the mark of a value is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spot {
    /// Distance from the left edge of the picture in its pixels.
    pub x_px: f64,
    /// Distance from its upper edge.
    pub y_px: f64,
    /// Number of the series, row or column of the value, as given to the chart.
    pub series: usize,
    /// Number of the value in it.
    pub point: usize,
}

/// Draws the bar from `low` to `high` (pixels) at `x`, with a cap at either end.
pub(crate) fn error_bar(svg: &mut Svg, x: f64, (low, high): (f64, f64), cap: f64, color: &str) {
    let left = SvgNumber(x - cap);
    let right = SvgNumber(x + cap);
    let x = SvgNumber(x);
    let low = SvgNumber(low);
    let high = SvgNumber(high);
    let data = format!("M{left} {low}H{right}M{left} {high}H{right}M{x} {low}V{high}");
    svg.path(&data, format_args!(r#"stroke="{color}" stroke-width="1.3" fill="none""#));
}

/// Draws the bar from `low` to `high` (pixels) at the height `y`, with a cap at either end.
pub(crate) fn level_error_bar(
    svg: &mut Svg,
    y: f64,
    (low, high): (f64, f64),
    cap: f64,
    color: &str,
) {
    let top = SvgNumber(y - cap);
    let bottom = SvgNumber(y + cap);
    let y = SvgNumber(y);
    let low = SvgNumber(low);
    let high = SvgNumber(high);
    let data = format!("M{low} {top}V{bottom}M{high} {top}V{bottom}M{low} {y}H{high}");
    svg.path(&data, format_args!(r#"stroke="{color}" stroke-width="1.3" fill="none""#));
}
