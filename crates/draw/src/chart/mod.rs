//! Charts: a frame with axes, title and legend, and the data in it.

pub(crate) mod bars;
pub(crate) mod frame;
pub(crate) mod plot;

use crate::svg::{Svg, SvgNumber};

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
