//! A track as a ribbon: the area that the robot's body swept.

use std::collections::BTreeSet;
use std::fmt::Write as _;

use super::Track;
use crate::svg::{Num, Svg};

/// A point in hundredths of a box, which is exact for bodies on the grid and compares equal.
type Point = (i64, i64);

/// Draws `track` in units of boxes.
///
/// The stroke is as wide as the body; square ends and sharp corners make it exactly the boxes that
/// a body moving along the grid has covered. It is one stroke, so that a place crossed often is no
/// darker than one crossed once.
pub(super) fn draw(svg: &mut Svg, track: &Track, color: &str) {
    let data = path_data(track);
    if data.is_empty() {
        return;
    }
    let (width, opacity) = (Num(track.width_boxes), if track.highlighted { 0.75 } else { 0.4 });
    svg.path(
        &data,
        format_args!(
            r#"class="track" fill="none" stroke="{color}" stroke-width="{width}" stroke-opacity="{opacity}" stroke-linecap="square" stroke-linejoin="miter""#
        ),
    );
}

/// First and last point of the track, in boxes, if it has any.
pub(super) fn ends(track: &Track) -> Option<((f64, f64), (f64, f64))> {
    let mut real = track.points.iter().copied().filter(|p| is_real(*p));
    let start = real.next()?;
    Some((start, real.next_back().unwrap_or(start)))
}

fn is_real((x, y): (f64, f64)) -> bool {
    x.is_finite() && y.is_finite()
}

/// Path data of the ribbon's middle line: only corners, and every stretch once however often the
/// robot went there.
fn path_data(track: &Track) -> String {
    let mut seen = BTreeSet::new();
    let mut data = String::new();
    for run in track.points.split(|p| !is_real(*p)).filter(|run| !run.is_empty()) {
        let points: Vec<Point> = run.iter().map(|&p| hundredths(p)).collect();
        for piece in unseen_pieces(&points, &mut seen) {
            write_piece(&mut data, &corners(&piece));
        }
    }
    data
}

fn hundredths((x, y): (f64, f64)) -> Point {
    // Far outside any map; keeps the differences of two points within an i64.
    let whole = |v: f64| (v * 100.0).round().clamp(-1e12, 1e12) as i64;
    (whole(x), whole(y))
}

/// The stretches of `points` between neighbors that have not been joined before, in either
/// direction. A robot that never moved is one point.
fn unseen_pieces(points: &[Point], seen: &mut BTreeSet<(Point, Point)>) -> Vec<Vec<Point>> {
    let mut pieces = vec![vec![points[0]]];
    for pair in points.windows(2).filter(|pair| pair[0] != pair[1]) {
        if !seen.insert((pair[0].min(pair[1]), pair[0].max(pair[1]))) {
            continue;
        }
        match pieces.last_mut() {
            Some(piece) if piece.last() == Some(&pair[0]) => piece.push(pair[1]),
            _ => pieces.push(pair.to_vec()),
        }
    }
    if pieces.len() > 1 && pieces[0].len() == 1 {
        pieces.remove(0);
    }
    pieces
}

/// Leaves out points on the straight way between their neighbors.
fn corners(points: &[Point]) -> Vec<Point> {
    let mut kept: Vec<Point> = Vec::new();
    for &point in points {
        if let [.., a, b] = kept[..]
            && goes_on(a, b, point)
        {
            kept.pop();
        }
        kept.push(point);
    }
    kept
}

/// Whether the way from `a` over `b` to `c` is straight and does not turn back.
fn goes_on(a: Point, b: Point, c: Point) -> bool {
    let step = |from: Point, to: Point| (i128::from(to.0 - from.0), i128::from(to.1 - from.1));
    let ((ax, ay), (bx, by)) = (step(a, b), step(b, c));
    ax * by == ay * bx && ax * bx + ay * by > 0
}

fn write_piece(data: &mut String, points: &[Point]) {
    let show = |(x, y): Point| (Num(x as f64 / 100.0), Num(y as f64 / 100.0));
    // Writing into a String cannot fail.
    for (index, &point) in points.iter().enumerate() {
        let (x, y) = show(point);
        let command = if index == 0 { 'M' } else { 'L' };
        let _ = write!(data, "{command}{x} {y}");
    }
    if let [only] = points {
        // A stroke of no length is not drawn: one of a hundredth of a box is.
        let _ = write!(data, "H{}", Num((only.0 + 1) as f64 / 100.0));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn data(points: &[(f64, f64)]) -> String {
        path_data(&Track { width_boxes: 1.0, points: points.to_vec(), ..Track::default() })
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
            (0..100_000_i32).map(|i| (f64::from((i % 40 - 20).abs()), 0.5)).collect();
        assert_eq!(data(&to_and_fro), "M20 0.5L0 0.5");
    }

    #[test]
    fn a_turn_back_is_a_corner() {
        assert_eq!(data(&[(0.0, 0.0), (2.0, 0.0), (1.0, 0.0)]), "M0 0L2 0L1 0");
    }

    #[test]
    fn what_is_not_a_number_interrupts_the_ribbon() {
        let gap = [(0.0, 0.0), (1.0, 0.0), (f64::NAN, 0.0), (3.0, 0.0), (4.0, 0.0)];
        assert_eq!(data(&gap), "M0 0L1 0M3 0L4 0");
        assert_eq!(data(&[(f64::INFINITY, 0.0)]), "");
        assert_eq!(data(&[]), "");
    }

    #[test]
    fn a_robot_that_stays_still_has_a_ribbon() {
        assert_eq!(data(&[(1.5, 1.5); 3]), "M1.5 1.5H1.51");
    }

    #[test]
    fn ends_skip_what_is_not_a_number() {
        let points = vec![(f64::NAN, 0.0), (1.0, 2.0), (3.0, 4.0), (0.0, f64::NAN)];
        let track = Track { width_boxes: 1.0, points, ..Track::default() };
        assert_eq!(ends(&track), Some(((1.0, 2.0), (3.0, 4.0))));
        assert_eq!(ends(&Track::default()), None);
    }
}
