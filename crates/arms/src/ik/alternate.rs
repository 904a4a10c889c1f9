//! The chain's own rule, alternated: the tip is pulled to the target and the others follow down to
//! the base, the base is pulled home and the others follow up to the tip, until the tip stays.
//!
//! With rods of fixed length this is FABRIK (Aristidou and Lasenby, 2011), whose inner step is the
//! push and the pull of the chain (slides A2 and A3). Rods of variable length that need not change
//! keep their length (A4), so far fewer passes are needed.

use super::dls::bend_to_arc;
use super::limb::RodLengthRange;
use sidestep_rods::geometry::{Point, add, add_scaled, distance, norm, sub, unit_x};

/// Largest number of double passes before the search is given up: FABRIK takes a median of 135 for a target within 0.9 of
/// the reach of 450 rods in space, and ever more toward the full reach.
pub(super) const MAX_DOUBLE_PASSES: usize = 1000;
/// Double passes in a row with hardly any gain before the search is given up: a limb in line with its target gains
/// nothing in any of them.
const MAX_IDLE_PASSES: usize = 8;
/// Least part of the error that a double pass must remove to count as gain.
const MIN_GAIN: f64 = 1e-4;

/// Alternates passes over `points`, the first of which is the base, until the last is at `target`.
/// Returns the number of double passes and the remaining error.
pub(super) fn solve<const D: usize>(
    points: &mut [Point<D>],
    spans: &[RodLengthRange],
    target: Point<D>,
    tolerance_m: f64,
) -> (usize, f64) {
    let base = points[0];
    let tip = points.len() - 1;
    let mut error_m = distance(points[tip], target);
    let mut idle = 0;
    for double_passes in 0..MAX_DOUBLE_PASSES {
        if error_m <= tolerance_m || idle == MAX_IDLE_PASSES {
            return (double_passes, error_m);
        }
        points[tip] = target;
        let mut master = target;
        for (slave, span) in points[..tip].iter_mut().zip(spans).rev() {
            master = slave_position(master, *slave, *span);
            *slave = master;
        }
        points[0] = base;
        master = base;
        for (slave, span) in points[1..].iter_mut().zip(spans) {
            master = slave_position(master, *slave, *span);
            *slave = master;
        }
        let now_m = distance(master, target);
        idle = if now_m > error_m * (1.0 - MIN_GAIN) { idle + 1 } else { 0 };
        error_m = now_m;
    }
    (MAX_DOUBLE_PASSES, error_m)
}

/// Returns the slave's place after a push, pull or resize.
#[inline(always)]
fn slave_position<const D: usize>(
    master: Point<D>,
    slave: Point<D>,
    span: RodLengthRange,
) -> Point<D> {
    let g = sub(slave, master);
    let d = norm(g);
    if d > 0.0 {
        add_scaled(master, g, span.clamp_m(d) / d)
    } else {
        // Connectors in one place give no direction; any fixed one will do.
        add_scaled(master, unit_x(), span.min_m)
    }
}

/// Solves like [`solve`], for rod vectors from a base at the origin. A limb that lies in one line
/// with the target, where passes get stuck, is bowed once.
pub(super) fn solve_rod_vectors<const D: usize>(
    vectors: &mut [Point<D>],
    spans: &[RodLengthRange],
    target: Point<D>,
    tolerance_m: f64,
) -> (usize, f64) {
    let mut points = Vec::with_capacity(vectors.len() + 1);
    let mut passes = 0;
    for attempt in 0..2 {
        if attempt == 1 {
            bend_to_arc(vectors, target);
        }
        points.clear();
        points.push([0.0; D]);
        points.extend(vectors.iter().scan([0.0; D], |at, v| {
            *at = add(*at, *v);
            Some(*at)
        }));
        let (more, left_m) = solve(&mut points, spans, target, tolerance_m);
        passes += more;
        for (v, pair) in vectors.iter_mut().zip(points.windows(2)) {
            *v = sub(pair[1], pair[0]);
        }
        if left_m <= tolerance_m || attempt == 1 {
            return (passes, left_m);
        }
    }
    (passes, f64::INFINITY)
}
