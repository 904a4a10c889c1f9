//! Sizes of figures and pictures, as options give them.

/// Parses width and height, `WxH`.
pub(crate) fn parse_sides(text: &str) -> Option<[f64; 2]> {
    let (width, height) = text.split_once('x')?;
    Some([width.trim().parse().ok()?, height.trim().parse().ok()?])
}

/// Width and height of a picture in pixels: `1600x900`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct PixelSize(pub(crate) [u32; 2]);

/// Least and greatest side of a picture in pixels.
const SIDES_PX: std::ops::RangeInclusive<f64> = 200.0..=4096.0;

impl std::str::FromStr for PixelSize {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let sides = parse_sides(text).filter(|sides| {
            sides.iter().all(|side| SIDES_PX.contains(side) && side.fract() == 0.0)
        });
        let sides = sides.ok_or_else(|| {
            format!("`{text}` is no size: write WxH, 200 to 4096 pixels each, like 1600x900")
        })?;
        Ok(Self(sides.map(|side| side as u32)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_size_has_two_sides_in_range() {
        assert_eq!("1600x900".parse(), Ok(PixelSize([1600, 900])));
        for text in ["1600", "1600x", "100x900", "5000x900", "300.5x300", "NaNx300", "1x2x3"] {
            let error = text.parse::<PixelSize>().expect_err("no size");
            assert!(error.contains(text) && error.contains("like 1600x900"), "{error}");
        }
        assert_eq!(parse_sides("85 x 60.5"), Some([85.0, 60.5]));
    }
}
