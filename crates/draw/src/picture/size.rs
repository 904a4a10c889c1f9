//! Pictures of exactly some size, with all their words.

use super::sheet::LegendPlace;
use super::{DrawnPicture, PictureOptions};
use crate::error::DrawError;
use crate::style::Style;
use crate::svg::{on_page, page_size};

/// How much larger than the picture its layout may be, one after the other: the words of small pictures are small.
const ENLARGEMENTS: [f64; 5] = [1.0, 1.3, 1.7, 2.2, 3.0];
/// Largest height of a picture that may grow, as a multiple of its longer side.
const MAX_GROWTH: f64 = 2.5;
/// Most layouts that are tried for one size: the room that words take is known after the first, but for line breaks.
const MAX_LAYOUTS: usize = 5;

/// Least gain in the scale of a picture for which its words are made smaller.
const MIN_GAIN: f64 = 1.25;

/// A picture in a layout that is shown in the given size.
struct SizedPicture {
    svg: String,
    layout_px: [f64; 2],
    /// Its scale, up to a factor that is the same for all layouts.
    shown_px_per_m: f64,
}

/// Draws a picture in the layout of the options, with its legend somewhere.
type DrawLayout<'a> = dyn Fn(&PictureOptions, LegendPlace) -> Result<DrawnPicture, DrawError> + 'a;

/// Draws a picture of exactly some size: as large as it can be in there, in the middle, with the legend where that leaves
/// more room. It is laid out in that size, but no larger than the style's, with which its words would be tiny beside it.
///
/// # Errors
/// When its words leave no room for it, or it cannot be drawn at all.
pub(super) fn fit(
    [width_px, height_px]: [u32; 2],
    options: &PictureOptions,
    draw: &DrawLayout<'_>,
) -> Result<String, DrawError> {
    let size_px = [f64::from(width_px), f64::from(height_px)];
    let longer_px = size_px[0].max(size_px[1]);
    let layout_px = options.style.width_px.max(options.style.height_px);
    let least = (layout_px / longer_px).min(1.0);
    let mut chosen: Option<SizedPicture> = None;
    for enlargement in ENLARGEMENTS {
        let layout_px = size_px.map(|side_px| side_px * least * enlargement);
        if options.may_grow {
            let tall_px = [layout_px[0], MAX_GROWTH * layout_px[0].max(layout_px[1])];
            let below = |options: &PictureOptions| draw(options, LegendPlace::Below);
            if let Some(drawn) = fit_layout(tall_px, options, &below)? {
                let own_px = page_size(&drawn.svg).unwrap_or(layout_px);
                let page_px = [layout_px[0], own_px[1].max(layout_px[1])];
                let shown_px = page_px.map(|side_px| side_px / (least * enlargement));
                return Ok(on_page(&drawn.svg, page_px, shown_px));
            }
            continue;
        }
        let mut best: Option<DrawnPicture> = None;
        for legend in [LegendPlace::Below, LegendPlace::Beside] {
            let drawn = fit_layout(layout_px, options, &|options| draw(options, legend))?;
            let most = best.as_ref().map_or(0.0, |best| best.px_per_m);
            best = drawn.filter(|drawn| drawn.px_per_m > most).or(best);
        }
        let Some(drawn) = best else { continue };
        let shown_px_per_m = drawn.px_per_m / enlargement;
        // Words that leave little room for the picture are better smaller.
        let is_larger =
            chosen.as_ref().is_none_or(|chosen| shown_px_per_m >= MIN_GAIN * chosen.shown_px_per_m);
        if !is_larger {
            break;
        }
        chosen = Some(SizedPicture { svg: drawn.svg, layout_px, shown_px_per_m });
    }
    if let Some(chosen) = chosen {
        return Ok(on_page(&chosen.svg, chosen.layout_px, size_px));
    }
    let value = longer_px;
    Err(DrawError::Value {
        what: "longer side of a picture in px",
        value,
        must: "larger for its words",
    })
}

/// Draws a picture that is no larger than some layout; `None` if its words leave no room for it.
fn fit_layout(
    layout_px: [f64; 2],
    options: &PictureOptions,
    draw: &dyn Fn(&PictureOptions) -> Result<DrawnPicture, DrawError>,
) -> Result<Option<DrawnPicture>, DrawError> {
    let mut room_px = layout_px;
    let size_px = Some(layout_px.map(|px| px.floor() as u32));
    for _ in 0..MAX_LAYOUTS {
        let style = Style { width_px: room_px[0], height_px: room_px[1], ..options.style };
        if style.check().is_err() {
            return Ok(None);
        }
        let drawn = draw(&PictureOptions { style, size_px, ..options.clone() })?;
        let Some(taken_px) = page_size(&drawn.svg) else { return Ok(None) };
        let excess_px = [0, 1].map(|k| (taken_px[k] - layout_px[k]).max(0.0));
        if excess_px == [0.0; 2] {
            return Ok(Some(drawn));
        }
        room_px = [0, 1].map(|k| room_px[k] - excess_px[k]);
    }
    Ok(None)
}
