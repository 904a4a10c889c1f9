//! Conversion of SVG to PNG.

use resvg::tiny_skia::{Pixmap, Transform};
use resvg::usvg::{ImageHrefResolver, Options, Tree};

use crate::error::DrawError;
use crate::text::Fonts;
use std::sync::Arc;

/// Longest side of a PNG in pixels: 256 MiB of pixels.
pub const MAX_PNG_PX: u32 = 8192;

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
    let tree = parse(svg, &Fonts::default())?;
    let size = tree.size();
    render(&tree, max_px as f32 / size.width().max(size.height()))
}

/// Pixels of SVG per inch.
const PX_PER_INCH: f32 = 96.0;
/// Inches per meter.
const INCHES_PER_M: f64 = 1.0 / 0.0254;

/// Rasterizes an SVG picture with `dpi` pixels per inch of its size, and writes that into the file, so that programs
/// show it in that size.
///
/// # Errors
/// As [`to_png`].
pub fn to_png_with_density(svg: &str, dpi: f64, fonts: &Fonts) -> Result<Vec<u8>, DrawError> {
    let dpi = DrawError::positive("PNG resolution in dpi", dpi)?;
    let tree = parse(svg, fonts)?;
    let scale = dpi as f32 / PX_PER_INCH;
    let longest_px = f64::from(tree.size().width().max(tree.size().height()) * scale);
    if longest_px > f64::from(MAX_PNG_PX) {
        let (found, limit) = (longest_px as u64, u64::from(MAX_PNG_PX));
        return Err(DrawError::TooLarge { what: "PNG size in px", found, limit });
    }
    let png = render(&tree, scale)?;
    Ok(with_density(&png, (dpi * INCHES_PER_M).round() as u32))
}

/// Bytes of a PNG file before its second chunk: signature, and the chunk of its size.
const HEADER_BYTES: usize = 8 + 25;

/// Returns a PNG file with the chunk that gives its pixels per meter; it must stand before those of the pixels.
fn with_density(png: &[u8], px_per_m: u32) -> Vec<u8> {
    let mut chunk = b"pHYs".to_vec();
    chunk.extend(px_per_m.to_be_bytes());
    chunk.extend(px_per_m.to_be_bytes());
    // The unit is the meter.
    chunk.push(1);
    let mut file = png[..HEADER_BYTES].to_vec();
    let data_bytes = (chunk.len() - 4) as u32;
    file.extend(data_bytes.to_be_bytes());
    file.extend(&chunk);
    file.extend(crc(&chunk).to_be_bytes());
    file.extend(&png[HEADER_BYTES..]);
    file
}

/// Returns the checksum of a chunk of PNG: CRC-32 of ISO 3309.
fn crc(bytes: &[u8]) -> u32 {
    let mut crc = u32::MAX;
    for byte in bytes {
        crc ^= u32::from(*byte);
        for _ in 0..8 {
            let carry = if crc & 1 == 1 { 0xEDB8_8320 } else { 0 };
            crc = (crc >> 1) ^ carry;
        }
    }
    !crc
}

fn render(tree: &Tree, scale: f32) -> Result<Vec<u8>, DrawError> {
    let size = tree.size();
    let mut pixmap = Pixmap::new(side(size.width() * scale), side(size.height() * scale))
        .ok_or_else(|| DrawError::Svg("the picture has no area".into()))?;
    resvg::render(tree, Transform::from_scale(scale, scale), &mut pixmap.as_mut());
    pixmap.encode_png().map_err(|error| DrawError::Png(error.to_string()))
}

/// Returns a side's length in whole pixels, never 0 and never above the limit.
fn side(length_px: f32) -> u32 {
    (length_px.round() as u32).clamp(1, MAX_PNG_PX)
}

pub(crate) fn parse(svg: &str, fonts: &Fonts) -> Result<Tree, DrawError> {
    let options = Options {
        fontdb: Arc::clone(&fonts.database),
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
    fn a_picture_of_some_resolution_says_so() {
        let png = to_png_with_density(SQUARE, 300.0, &Fonts::default()).unwrap();
        let picture = image::load_from_memory(&png).unwrap();
        assert_eq!((picture.width(), picture.height()), (125, 63));
        assert_eq!(crc(b"IEND"), 0xAE42_6082);
        let at = png.windows(4).position(|bytes| bytes == b"pHYs").unwrap();
        assert_eq!(png[at + 4..at + 8], 11_811_u32.to_be_bytes());
        assert!(to_png_with_density(SQUARE, 1e6, &Fonts::default()).is_err());
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
