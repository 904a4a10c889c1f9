//! Animated GIFs: one palette for all frames, and for each frame only the part that has changed.

use gif::{DisposalMethod, Encoder, Frame, Repeat};
use sidestep_kernel::view::{
    ALERT_COLOR, BODY_COLORS, DOOR_COLOR, MOBILE_COLOR, UNKNOWN_COLOR, WALL_COLOR,
};
use std::borrow::Cow;
use std::io::{Error, Result, Write};

/// The palette entry for "same as before".
const UNCHANGED: u8 = 255;
// A GIF has 256 colors. These numbers are such that the colors of all drawings and their blends fit.

/// Number of steps between a color and the color beneath it, for edges and transparent areas.
const BLEND_STEPS: u32 = 7;
/// Number of grays for text.
const GRAYS: u32 = 16;
/// Bits of each color component by which palette entries are looked up: 32768 entries, searched once.
const COLOR_BITS: u32 = 5;

/// Writes frames of one size, with four bytes per pixel, at a number of frames per second.
///
/// # Errors
/// An I/O error, or an error of `pictures`.
pub(crate) fn write_gif(
    to: impl Write,
    (width, height): (u32, u32),
    per_second: f64,
    pictures: impl Iterator<Item = Result<Vec<u8>>>,
) -> Result<()> {
    let (Ok(width), Ok(height)) = (u16::try_from(width), u16::try_from(height)) else {
        return Err(Error::other("a GIF has at most 65535 pixels a side"));
    };
    let palette = Palette::new();
    let bytes: Vec<u8> = palette.colors.concat();
    let mut encoder = Encoder::new(to, width, height, &bytes).map_err(Error::other)?;
    encoder.set_repeat(Repeat::Infinite).map_err(Error::other)?;
    // In hundredths of a second; browsers take a delay below 2 for 10.
    let delay = (100.0 / per_second).round().clamp(2.0, 6000.0) as u16;
    let mut before: Option<Vec<u8>> = None;
    for picture in pictures {
        let pixels = palette.indices(&picture?);
        let frame = changed_area(before.as_deref(), &pixels, (width, height));
        encoder.write_frame(&Frame { delay, ..frame }).map_err(Error::other)?;
        before = Some(pixels);
    }
    Ok(())
}

/// Returns the rectangle in which a frame differs from the one before.
fn changed_area(before: Option<&[u8]>, now: &[u8], (width, height): (u16, u16)) -> Frame<'static> {
    let row = usize::from(width);
    let Some(before) = before else {
        return Frame { width, height, buffer: Cow::Owned(now.to_vec()), ..plain() };
    };
    let mut left = row;
    let mut right = 0;
    let mut top = usize::from(height);
    let mut bottom = 0;
    for (y, (was, is)) in before.chunks(row).zip(now.chunks(row)).enumerate() {
        let Some(first) = (0..row).find(|&x| was[x] != is[x]) else { continue };
        let last = (first..row).rfind(|&x| was[x] != is[x]).unwrap_or(first);
        left = left.min(first);
        right = right.max(last + 1);
        top = top.min(y);
        bottom = y + 1;
    }
    if bottom == 0 {
        // A frame of one pixel, so that its time passes.
        left = 0;
        right = 1;
        top = 0;
        bottom = 1;
    }
    let part = (top..bottom).flat_map(|y| (left..right).map(move |x| y * row + x));
    let pixels = part.map(|at| if before[at] == now[at] { UNCHANGED } else { now[at] });
    Frame {
        left: left as u16,
        top: top as u16,
        width: (right - left) as u16,
        height: (bottom - top) as u16,
        buffer: Cow::Owned(pixels.collect()),
        ..plain()
    }
}

fn plain() -> Frame<'static> {
    Frame { dispose: DisposalMethod::Keep, transparent: Some(UNCHANGED), ..Frame::default() }
}

/// The colors of all animations: those of the drawings, and their mixtures with possible colors
/// beneath.
struct Palette {
    colors: Vec<[u8; 3]>,
    /// The nearest color, by the upper bits of red, green and blue.
    nearest: Vec<u8>,
}

impl Palette {
    fn new() -> Self {
        let white = [255; 3];
        let mut colors: Vec<[u8; 3]> =
            (0..GRAYS).map(|k| [(255 * k / (GRAYS - 1)) as u8; 3]).collect();
        let drawn = BODY_COLORS.iter().chain([
            &ALERT_COLOR,
            &DOOR_COLOR,
            &WALL_COLOR,
            &UNKNOWN_COLOR,
            &MOBILE_COLOR,
        ]);
        for &color in drawn {
            colors.extend((0..=BLEND_STEPS).map(|k| blend(color, white, k)));
            // Edges against walls are fewer than those against white, so two steps have to do within 256 colors.
            colors.extend([2, 4].map(|k| blend(color, WALL_COLOR, k)));
        }
        // Lines in the color of a zone that cross another zone.
        for (k, &color) in BODY_COLORS.iter().enumerate() {
            // A zone is drawn nearly transparent, so the color under a crossing line is close to white.
            let under = blend(BODY_COLORS[(k + 1) % BODY_COLORS.len()], white, 5);
            colors.extend([1, 3, 5].map(|k| blend(color, under, k)));
        }
        colors.sort_unstable();
        colors.dedup();
        // The last entry is not a color. Colors that do not fit get the nearest one that does.
        colors.truncate(usize::from(UNCHANGED));
        let known = colors.len();
        // A palette has a power of two of entries; the rest stays unused.
        colors.resize(256, white);
        let nearest = (0..1 << (3 * COLOR_BITS))
            .map(|key| nearest(&colors[..known], color_of_key(key)))
            .collect();
        Self { nearest, colors }
    }

    fn indices(&self, rgba: &[u8]) -> Vec<u8> {
        rgba.chunks_exact(4).map(|pixel| self.nearest[color_key(pixel)]).collect()
    }
}

/// Returns the upper bits of red, green and blue, one after the other.
fn color_key(pixel: &[u8]) -> usize {
    let [red, green, blue] =
        [pixel[0], pixel[1], pixel[2]].map(|component| usize::from(component >> (8 - COLOR_BITS)));
    red << (2 * COLOR_BITS) | green << COLOR_BITS | blue
}

/// Returns the color in the middle of those that share a key, which errs least for all of them.
fn color_of_key(key: u32) -> [u8; 3] {
    [2 * COLOR_BITS, COLOR_BITS, 0].map(|shift| {
        let upper = key >> shift & ((1 << COLOR_BITS) - 1);
        (upper << (8 - COLOR_BITS) | 1 << (7 - COLOR_BITS)) as u8
    })
}

/// Returns the color that is `k` of [`BLEND_STEPS`] steps from a color to the one beneath it.
fn blend(color: [u8; 3], under: [u8; 3], k: u32) -> [u8; 3] {
    std::array::from_fn(|i| {
        let sum = u32::from(color[i]) * (BLEND_STEPS - k) + u32::from(under[i]) * k;
        (sum / BLEND_STEPS) as u8
    })
}

fn nearest(colors: &[[u8; 3]], to: [u8; 3]) -> u8 {
    let found = colors.iter().enumerate().min_by_key(|(_, color)| squared_distance(**color, to));
    found.map_or(0, |(index, _)| index as u8)
}

fn squared_distance(a: [u8; 3], b: [u8; 3]) -> i32 {
    let differences = a.iter().zip(b).map(|(&a, b)| i32::from(a) - i32::from(b));
    differences.map(|difference| difference * difference).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_color_that_is_drawn_comes_out_as_itself_but_for_a_shade() {
        let palette = Palette::new();
        for color in
            BODY_COLORS.into_iter().chain([ALERT_COLOR, DOOR_COLOR, WALL_COLOR, [255; 3], [0; 3]])
        {
            let index = palette.indices(&[color[0], color[1], color[2], 255])[0];
            assert_ne!(index, UNCHANGED);
            let shown = palette.colors[usize::from(index)];
            let apart = shown.iter().zip(color).map(|(a, b)| a.abs_diff(b)).max();
            assert!(apart <= Some(8), "{color:?} is shown as {shown:?}");
        }
    }

    #[test]
    fn only_what_changes_is_written() {
        let before = [1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1];
        let now = [1, 1, 1, 1, 1, 2, 1, 3, 1, 1, 1, 1];
        let frame = changed_area(Some(&before), &now, (4, 3));
        assert_eq!((frame.left, frame.top, frame.width, frame.height), (1, 1, 3, 1));
        assert_eq!(&*frame.buffer, [2, UNCHANGED, 3]);
        assert_eq!(changed_area(Some(&now), &now, (4, 3)).buffer.len(), 1);
        assert_eq!(changed_area(None, &now, (4, 3)).buffer.len(), 12);
    }

    #[test]
    fn a_gif_begins_as_gifs_do_and_ends() {
        let pictures = (0..3u8).map(|k| Ok(vec![80 * k; 4 * 16 * 10]));
        let mut bytes = Vec::new();
        write_gif(&mut bytes, (16, 10), 15.0, pictures).expect("written");
        assert!(bytes.starts_with(b"GIF89a") && bytes.ends_with(b";"));
        let fails = std::iter::once(Err(Error::other("no")));
        assert!(write_gif(&mut Vec::new(), (16, 10), 15.0, fails).is_err());
    }
}
