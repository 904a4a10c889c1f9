//! Trails as lines, or as the area that the body swept, paler with age.

use std::collections::BTreeSet;
use std::fmt::Write as _;

use super::canvas::{Canvas, Px};
use super::trails::DrawnTrail;
use crate::style::hex;
use crate::svg::{Svg, SvgNumber};
use sidestep_kernel::view::Color;

/// Shades of a trail, the first for the oldest part.
const SHADES: usize = 8;
/// Part of its color that the oldest part of a trail keeps.
const OLDEST_COLOR_FRACTION: f64 = 0.3;
/// Opacity of a ribbon, which must not hide the floor, and of a line.
const OPACITY: [f64; 2] = [0.5, 0.8];
/// Width of a trail that is a line: thinner than any body.
const LINE_PX: f64 = 1.8;
/// Distance below which points of a line cannot be distinguished.
const MIN_POINT_DISTANCE_PX: f64 = 0.7;

/// A point in hundredths of a pixel, which compares equal.
type CentiPxPoint = (i64, i64);

/// Draws a trail.
///
/// A ribbon is as wide as the body; square ends and sharp corners make it exactly the boxes that a
/// body moving along the grid has covered. All shades are opaque in one translucent group, the
/// newest on top, so that a place crossed often is no darker than one crossed once.
pub(super) fn draw(svg: &mut Svg, trail: &DrawnTrail<'_>, canvas: &Canvas) {
    let (width_px, ends) = match trail.width_m {
        Some(width_m) => {
            (width_m * canvas.px_per_m, r#"stroke-linecap="square" stroke-linejoin="miter""#)
        }
        None => (LINE_PX, r#"stroke-linecap="round" stroke-linejoin="round""#),
    };
    let dash = trail.dash;
    let points = trail.points.iter().map(|&(_, at)| canvas.px(at));
    let shades = trail.points.iter().map(|(cycle, _)| trail.shade(*cycle, SHADES));
    let points: Vec<(usize, Px)> = match trail.width_m {
        Some(_) => shades.zip(points).collect(),
        None => decimate(shades.zip(points)),
    };
    let width = SvgNumber(width_px);
    let opacity = OPACITY[usize::from(trail.width_m.is_none())];
    svg.push_raw(format_args!(
        r#"<g class="trail" opacity="{opacity}" fill="none" stroke-width="{width}" {ends}{dash}>"#
    ));
    for (shade, data) in path_data(&points).into_iter().enumerate() {
        if !data.is_empty() {
            svg.path(&data, format_args!(r#"stroke="{}""#, hex(aged_color(trail.color, shade))));
        }
    }
    svg.close_group();
}

/// Returns the color of a shade, the paler the older.
fn aged_color(color: Color, shade: usize) -> Color {
    let part =
        OLDEST_COLOR_FRACTION + (1.0 - OLDEST_COLOR_FRACTION) * shade as f64 / (SHADES - 1) as f64;
    color.map(|byte| (255.0 - part * (255.0 - f64::from(byte))).round() as u8)
}

/// Leaves out points that cannot be distinguished from the one before.
fn decimate(points: impl Iterator<Item = (usize, Px)>) -> Vec<(usize, Px)> {
    let mut kept: Vec<(usize, Px)> = Vec::new();
    let mut last = None;
    for (shade, (x, y)) in points {
        let is_apart = kept
            .last()
            .is_none_or(|&(_, (a, b))| (x - a).abs().max((y - b).abs()) >= MIN_POINT_DISTANCE_PX);
        last = Some((shade, (x, y)));
        if is_apart {
            kept.extend(last.take());
        }
    }
    kept.extend(last);
    kept
}

/// Returns path data of every shade: only corners, and every segment once however often the body
/// went there, in the shade of the last time.
fn path_data(points: &[(usize, Px)]) -> [String; SHADES] {
    let mut pieces: [Vec<Vec<CentiPxPoint>>; SHADES] = std::array::from_fn(|_| Vec::new());
    let mut seen = BTreeSet::new();
    let points: Vec<(usize, CentiPxPoint)> =
        points.iter().map(|&(k, p)| (k, hundredths(p))).collect();
    for pair in points.windows(2).rev() {
        let [(_, a), (shade, b)] = [pair[0], pair[1]];
        if a == b || !seen.insert((a.min(b), a.max(b))) {
            continue;
        }
        match pieces[shade].last_mut() {
            Some(piece) if piece.last() == Some(&b) => piece.push(a),
            _ => pieces[shade].push(vec![b, a]),
        }
    }
    if let (true, Some(&(shade, only))) = (seen.is_empty(), points.last()) {
        pieces[shade].push(vec![only]);
    }
    pieces.map(|pieces| {
        let mut data = String::new();
        for mut piece in pieces.into_iter().rev() {
            piece.reverse();
            write_piece(&mut data, &corners(&piece));
        }
        data
    })
}

fn hundredths((x, y): Px) -> CentiPxPoint {
    ((x * 100.0).round() as i64, (y * 100.0).round() as i64)
}

/// Leaves out points on the straight line between their neighbors.
fn corners(points: &[CentiPxPoint]) -> Vec<CentiPxPoint> {
    let mut kept: Vec<CentiPxPoint> = Vec::new();
    for &point in points {
        if let [.., a, b] = kept[..]
            && is_straight(a, b, point)
        {
            kept.pop();
        }
        kept.push(point);
    }
    kept
}

/// Returns whether the path from `a` over `b` to `c` is straight and does not turn back.
fn is_straight(a: CentiPxPoint, b: CentiPxPoint, c: CentiPxPoint) -> bool {
    let (ax, ay) = difference(a, b);
    let (bx, by) = difference(b, c);
    ax * by == ay * bx && ax * bx + ay * by > 0
}

/// Returns the step between two points, in a type in which products of two steps do not overflow.
fn difference(from: CentiPxPoint, to: CentiPxPoint) -> (i128, i128) {
    (i128::from(to.0 - from.0), i128::from(to.1 - from.1))
}

fn write_piece(data: &mut String, points: &[CentiPxPoint]) {
    // Writing into a String cannot fail.
    for (index, &point) in points.iter().enumerate() {
        let x = SvgNumber(point.0 as f64 / 100.0);
        let y = SvgNumber(point.1 as f64 / 100.0);
        let command = if index == 0 { 'M' } else { 'L' };
        let _ = write!(data, "{command}{x} {y}");
    }
    if let [only] = points {
        // A stroke of no length is not drawn, but one of a hundredth of a pixel is.
        let _ = write!(data, "H{}", SvgNumber((only.0 + 1) as f64 / 100.0));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns path data of a trail in one shade.
    fn data(points: &[Px]) -> String {
        let points: Vec<_> = points.iter().map(|&p| (SHADES - 1, p)).collect();
        let data = path_data(&points);
        assert!(data[..SHADES - 1].iter().all(String::is_empty));
        data[SHADES - 1].clone()
    }

    #[test]
    fn only_corners_are_kept() {
        let straight: Vec<_> = (0..100_000).map(|i| (f64::from(i) + 0.5, 0.5)).collect();
        assert_eq!(data(&straight), "M0.5 0.5L99999.5 0.5");
        assert_eq!(data(&[(0.5, 0.5), (1.5, 0.5), (1.5, 1.5)]), "M0.5 0.5L1.5 0.5L1.5 1.5");
    }

    #[test]
    fn a_way_taken_again_is_drawn_once() {
        let to_and_fro: Vec<_> =
            (0..100_001_i32).map(|i| (f64::from((i % 40 - 20).abs()), 0.5)).collect();
        assert_eq!(data(&to_and_fro), "M0 0.5L20 0.5");
    }

    #[test]
    fn a_turn_back_is_a_corner() {
        assert_eq!(data(&[(0.0, 0.0), (2.0, 0.0), (1.0, 0.0)]), "M0 0L2 0L1 0");
    }

    #[test]
    fn a_body_that_stays_still_has_a_ribbon() {
        assert_eq!(data(&[(1.5, 1.5); 3]), "M1.5 1.5H1.51");
        assert_eq!(data(&[]), "");
    }

    #[test]
    fn a_stretch_has_the_shade_of_the_last_time() {
        let path = [(0, (0.0, 0.0)), (1, (1.0, 0.0)), (2, (2.0, 0.0)), (3, (1.0, 0.0))];
        let data = path_data(&path);
        let drawn: Vec<_> = data.iter().filter(|data| !data.is_empty()).collect();
        assert_eq!(drawn, ["M0 0L1 0", "M2 0L1 0"]);
        assert_eq!((&data[1], &data[3]), (drawn[0], drawn[1]));
    }

    #[test]
    fn the_older_the_paler() {
        let red = [200, 0, 0];
        assert_eq!(aged_color(red, SHADES - 1), red);
        let greens: Vec<u8> = (0..SHADES).map(|shade| aged_color(red, shade)[1]).collect();
        assert!(greens.windows(2).all(|pair| pair[0] > pair[1]), "{greens:?}");
    }

    #[test]
    fn what_cannot_be_told_apart_is_left_out_but_for_the_end() {
        let steps = (0..100).map(|k| (0, (0.1 * f64::from(k), 0.0)));
        let kept = decimate(steps);
        assert!(kept.len() < 20 && kept[0].1 == (0.0, 0.0));
        assert!((kept[kept.len() - 1].1.0 - 9.9).abs() < 1e-9);
    }
}
