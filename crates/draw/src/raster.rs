//! Conversion of SVG to PNG.

use resvg::tiny_skia::{Pixmap, Transform};
use resvg::usvg::{ImageHrefResolver, Options, Tree};

use crate::error::DrawError;
use crate::text;

/// Longest side of a PNG in pixels: 256 MiB of pixels.
const MAX_PNG_PX: u32 = 8192;

/// Rasterizes an SVG picture so that its longer side is `max_px` pixels.
///
/// Text is drawn in the embedded DejaVu Sans, regardless of the machine's fonts, and nothing
/// outside `svg` is read (an `<image>` in it stays undrawn), so the bytes depend only on the
/// arguments.
///
/// # Errors
/// [`DrawError::Svg`] if `svg` is no SVG, [`DrawError::Value`] or [`DrawError::TooLarge`] if `max_px`
/// is 0 or above 8192.
pub fn to_png(svg: &str, max_px: u32) -> Result<Vec<u8>, DrawError> {
    DrawError::positive("PNG size in px", f64::from(max_px))?;
    if max_px > MAX_PNG_PX {
        return Err(DrawError::TooLarge {
            what: "PNG size in px",
            found: u64::from(max_px),
            limit: u64::from(MAX_PNG_PX),
        });
    }
    let tree = parse(svg)?;
    let size = tree.size();
    let scale = max_px as f32 / size.width().max(size.height());
    let mut pixmap = Pixmap::new(side(size.width() * scale), side(size.height() * scale))
        .ok_or_else(|| DrawError::Svg("the picture has no area".into()))?;
    resvg::render(&tree, Transform::from_scale(scale, scale), &mut pixmap.as_mut());
    pixmap.encode_png().map_err(|error| DrawError::Png(error.to_string()))
}

/// Returns a side's length in whole pixels, never 0 and never above the limit.
fn side(length_px: f32) -> u32 {
    (length_px.round() as u32).clamp(1, MAX_PNG_PX)
}

pub(crate) fn parse(svg: &str) -> Result<Tree, DrawError> {
    let options = Options {
        fontdb: text::fonts(),
        font_family: "DejaVu Sans".into(),
        image_href_resolver: ImageHrefResolver {
            resolve_data: Box::new(|_, _, _| None),
            resolve_string: Box::new(|_, _| None),
        },
        ..Options::default()
    };
    Tree::from_str(svg, &options).map_err(|error| DrawError::Svg(error.to_string()))
}

#[cfg(test)]
mod tests {
    use super::*;

    const SQUARE: &str = r##"<svg xmlns="http://www.w3.org/2000/svg" width="40" height="20">
        <rect width="40" height="20" fill="#FF0000"/></svg>"##;

    #[test]
    fn the_longer_side_is_as_asked() {
        let png = to_png(SQUARE, 80).unwrap();
        let picture = image::load_from_memory(&png).unwrap().to_rgba8();
        assert_eq!(picture.dimensions(), (80, 40));
        assert_eq!(picture.get_pixel(40, 20).0, [255, 0, 0, 255]);
    }

    #[test]
    fn text_is_drawn_without_any_system_font() {
        let svg = r#"<svg xmlns="http://www.w3.org/2000/svg" width="40" height="20">
            <text x="2" y="15" font-family="No Such Font" font-size="15">Ag</text></svg>"#;
        let png = to_png(svg, 40).unwrap();
        let inked = image::load_from_memory(&png).unwrap().to_rgba8();
        assert!(inked.pixels().filter(|p| p.0[3] > 128).count() > 20);
    }

    #[test]
    fn nonsense_is_an_error() {
        assert!(matches!(to_png("<html/>", 10), Err(DrawError::Svg(_))));
        assert!(matches!(to_png("", 10), Err(DrawError::Svg(_))));
        assert!(matches!(to_png(SQUARE, 0), Err(DrawError::Value { .. })));
        assert!(matches!(to_png(SQUARE, 100_000), Err(DrawError::TooLarge { .. })));
    }
}
