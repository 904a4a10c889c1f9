//! A posture in closed form: straight except for at most two bends.
//!
//! Any place that a limb can reach, it reaches with its rods in three straight lines: those before the
//! rod that holds the middle of its length, that rod, and those behind it (Hopcroft, Joseph and
//! Whitesides, "On the movement of robot arms in 2-dimensional bounded regions", 1985). Two triangles
//! give the bends. The engines use it as a last resort, so that they always succeed; near the full
//! reach every other posture looks like it.

use super::limb::{ReachShell, RodLengthRange};
use sidestep_rods::geometry::{
    Point, add_scaled, dot, norm, normalized, perpendicular, scaled, sub, unit_x,
};

/// Lays `vectors` so that their sum is `target`, or as near as possible. Lengths of rods are kept
/// if the target allows it.
pub(super) fn solve<const D: usize>(
    vectors: &mut [Point<D>],
    spans: &[RodLengthRange],
    target: Point<D>,
) {
    let target = ReachShell::from_length_ranges(spans).nearest(target);
    let far_m = norm(target);
    let toward = normalized(target).unwrap_or(unit_x());
    let side = perpendicular(toward);
    let mut lengths_m: Vec<f64> =
        vectors.iter().zip(spans).map(|(v, span)| span.clamp_m(norm(*v))).collect();
    fit_lengths_to_distance(&mut lengths_m, spans, far_m);
    let middle = middle_rod(&lengths_m);
    let before_m: f64 = lengths_m[..middle].iter().sum();
    let behind_m: f64 = lengths_m[middle + 1..].iter().sum();
    // The bend behind the middle rod is as far from the base as both triangles allow.
    let diagonal_m = (before_m + lengths_m[middle]).min(behind_m + far_m);
    let second = triangle_apex(toward, side, far_m, [diagonal_m, behind_m]);
    let arm = normalized(second).unwrap_or(toward);
    let first = triangle_apex(
        arm,
        bend_direction(arm, toward, side),
        diagonal_m,
        [before_m, lengths_m[middle]],
    );
    let straight = [
        normalized(first).unwrap_or(arm),
        normalized(sub(second, first)).unwrap_or(arm),
        normalized(sub(target, second)).unwrap_or(toward),
    ];
    for (i, (v, length_m)) in vectors.iter_mut().zip(&lengths_m).enumerate() {
        let part = usize::from(i >= middle) + usize::from(i > middle);
        *v = scaled(straight[part], *length_m);
    }
}

/// Changes lengths as little as possible so that they allow the tip's distance.
fn fit_lengths_to_distance(lengths_m: &mut [f64], spans: &[RodLengthRange], far_m: f64) {
    let sum_m: f64 = lengths_m.iter().sum();
    let longest =
        (0..lengths_m.len()).max_by(|&i, &j| lengths_m[i].total_cmp(&lengths_m[j])).unwrap_or(0);
    let hole_m = 2.0 * lengths_m[longest] - sum_m;
    let (missing_m, shortens) = if far_m > sum_m {
        (far_m - sum_m, None)
    } else if far_m < hole_m {
        (hole_m - far_m, Some(longest))
    } else {
        return;
    };
    // The length toward which each rod may change.
    let mut ends_m: Vec<f64> = spans.iter().map(|span| span.max_m).collect();
    if let Some(i) = shortens {
        ends_m[i] = spans[i].min_m;
    }
    let changes = ends_m.iter().zip(&*lengths_m).map(|(end_m, length_m)| (end_m - length_m).abs());
    let room_m: f64 = changes.sum();
    let part = if room_m > 0.0 { (missing_m / room_m).min(1.0) } else { 0.0 };
    for i in 0..lengths_m.len() {
        lengths_m[i] = spans[i].clamp_m(lengths_m[i] + part * (ends_m[i] - lengths_m[i]));
    }
}

/// Returns the rod that holds the middle of the whole length.
fn middle_rod(lengths_m: &[f64]) -> usize {
    let half_m = 0.5 * lengths_m.iter().sum::<f64>();
    let mut until_m = 0.0;
    for (i, length_m) in lengths_m.iter().enumerate() {
        until_m += length_m;
        if until_m >= half_m {
            return i;
        }
    }
    lengths_m.len() - 1
}

/// Returns the corner of a triangle over a base line of `base_m` along `u`, on the side of `side`,
/// with the other two edges as given: the first from the line's start.
fn triangle_apex<const D: usize>(
    u: Point<D>,
    side: Point<D>,
    base_m: f64,
    [a_m, b_m]: [f64; 2],
) -> Point<D> {
    let x_m = if base_m > 0.0 {
        ((base_m * base_m + (a_m - b_m) * (a_m + b_m)) / (2.0 * base_m)).clamp(-a_m, a_m)
    } else {
        0.0
    };
    let height_m = ((a_m - x_m) * (a_m + x_m)).max(0.0).sqrt();
    add_scaled(scaled(u, x_m), side, height_m)
}

/// Returns the unit vector across `u` in the plane of `toward` and `side`, so that both bends turn
/// the same way.
fn bend_direction<const D: usize>(u: Point<D>, toward: Point<D>, side: Point<D>) -> Point<D> {
    add_scaled(scaled(toward, -dot(u, side)), side, dot(u, toward))
}
