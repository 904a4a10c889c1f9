//! Beams on a grid: the boxes a beam crosses, in order, with their distances.
//!
//! A body is always aligned with the grid, so the exact traversal (Amanatides and Woo, "A fast
//! voxel traversal algorithm for ray tracing", 1987) of a beam is done once per body type and
//! heading, and a cycle only walks a list of offsets.

use sidestep_kernel::math;

/// One box that a beam crosses after it has left the body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Crossing {
    /// Columns east of the body's anchor (its lower-left box).
    pub dx: i32,
    /// Rows north of the anchor.
    pub dy: i32,
    /// Distance in boxes along the beam, from the body's boundary to this box's boundary.
    pub distance: f64,
}

/// Differences below this are rounding errors, of the direction's sine and cosine, or of a length
/// divided by the side of a box; in boxes.
pub const EPSILON: f64 = 1e-9;

/// Returns whether a distance reaches a limit, both in boxes. This is the one rule for all edges of
/// distance classes and ranges: a thing at an edge is beyond it, also where the edge in meters is a
/// multiple of the side of a box that floating-point numbers cannot hold, like 0.9 m of 0.3 m.
pub fn reaches(distance: f64, limit: f64) -> bool {
    distance >= limit - EPSILON
}

/// Returns the boxes that a beam from the center of a `size` x `size` body crosses, nearest first,
/// for a body that heads east; `range` is in boxes, exclusive.
///
/// A beam through a corner of boxes goes on to the box across it. A beam that runs along a
/// line between boxes (even sizes, multiples of 90 degrees) counts as running on the left
/// side of it, seen along the beam.
pub fn crossings(size: u32, bearing_deg: f64, range: f64) -> Vec<Crossing> {
    // Quarter turns are made on integers, because a sine of a right angle is not exact and would let a beam along
    // an axis drift into the next row of boxes.
    let quarter = (bearing_deg / 90.0).floor();
    let rest_deg = bearing_deg - 90.0 * quarter;
    let along = first_quadrant(size, rest_deg, range);
    let turns = quarter.rem_euclid(4.0) as u8;
    along.into_iter().map(|c| turn_crossing(c, size, turns)).collect()
}

/// Returns the same crossing for a body turned `turns` quarters to the left.
pub fn turn_crossing(c: Crossing, size: u32, turns: u8) -> Crossing {
    let last = size as i32 - 1;
    let (dx, dy) = match turns % 4 {
        0 => (c.dx, c.dy),
        1 => (last - c.dy, c.dx),
        2 => (last - c.dx, last - c.dy),
        _ => (c.dy, last - c.dx),
    };
    Crossing { dx, dy, ..c }
}

/// Returns the crossings for bearings in [0, 90), where both components are non-negative.
fn first_quadrant(size: u32, bearing_deg: f64, range: f64) -> Vec<Crossing> {
    let (ux, uy) = direction(bearing_deg);
    let center = f64::from(size) / 2.0;
    // Where the beam leaves the body: at the side that it reaches first.
    let exit = (center / ux.max(uy)).min(f64::INFINITY);
    // Start in the box at the center; on a line, in the box north of it, to the left of an eastward
    // beam.
    let (mut col, mut row) = (center.floor() as i32, center.floor() as i32);
    let mut crossings = Vec::new();
    loop {
        let to_col = boundary(f64::from(col + 1), center, ux);
        let to_row = boundary(f64::from(row + 1), center, uy);
        let at = to_col.min(to_row);
        // Both, where the beam goes through a corner.
        if to_col <= at + EPSILON {
            col += 1;
        }
        if to_row <= at + EPSILON {
            row += 1;
        }
        let distance = (at - exit).max(0.0);
        if reaches(distance, range) {
            return crossings;
        }
        if col >= size as i32 || row >= size as i32 {
            crossings.push(Crossing { dx: col, dy: row, distance });
        }
    }
}

/// Returns the distance along the beam to the grid line `line`.
fn boundary(line: f64, center: f64, component: f64) -> f64 {
    if component == 0.0 { f64::INFINITY } else { (line - center) / component }
}

/// Returns the unit vector of a bearing in [0, 90) degrees, exact at 0 and 45.
fn direction(bearing_deg: f64) -> (f64, f64) {
    if bearing_deg.abs() < EPSILON {
        return (1.0, 0.0);
    }
    if (bearing_deg - 45.0).abs() < EPSILON {
        return (0.5f64.sqrt(), 0.5f64.sqrt());
    }
    let angle_rad = bearing_deg.to_radians();
    (math::cos(angle_rad), math::sin(angle_rad))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn boxes(size: u32, bearing_deg: f64, range: f64) -> Vec<(i32, i32)> {
        crossings(size, bearing_deg, range).iter().map(|c| (c.dx, c.dy)).collect()
    }

    #[test]
    fn straight_beams_cross_as_many_boxes_as_their_range() {
        assert_eq!(boxes(1, 0.0, 3.0), [(1, 0), (2, 0), (3, 0)]);
        assert_eq!(boxes(3, 0.0, 2.0), [(3, 1), (4, 1)]);
        assert_eq!(boxes(3, 90.0, 2.0), [(1, 3), (1, 4)]);
        assert_eq!(boxes(3, 180.0, 2.0), [(-1, 1), (-2, 1)]);
        assert_eq!(boxes(3, -90.0, 2.0), [(1, -1), (1, -2)]);
        assert_eq!(crossings(3, 0.0, 15.0).len(), 15);
        assert_eq!(crossings(3, 0.0, 15.0)[14].distance, 14.0);
    }

    #[test]
    fn diagonal_beams_go_through_corners() {
        assert_eq!(boxes(1, 45.0, 3.0), [(1, 1), (2, 2), (3, 3)]);
        assert_eq!(boxes(3, 135.0, 1.5), [(-1, 3), (-2, 4)]);
        let second = crossings(1, 45.0, 3.0)[1];
        assert!((second.distance - 2f64.sqrt()).abs() < 1e-12);
    }

    #[test]
    fn an_even_body_sees_along_the_left_side_of_its_middle_line() {
        assert_eq!(boxes(2, 0.0, 1.0), [(2, 1)]);
        assert_eq!(boxes(2, 90.0, 1.0), [(0, 2)]);
        assert_eq!(boxes(2, 180.0, 1.0), [(-1, 0)]);
        assert_eq!(boxes(2, 270.0, 1.0), [(1, -1)]);
    }

    /// Compares with a walk in tiny steps, for many sizes and bearings.
    #[test]
    fn traversal_agrees_with_dense_sampling() {
        for size in 1..6 {
            for tenth in (3..3600).step_by(37) {
                let bearing_deg = f64::from(tenth) / 10.0;
                let found = boxes(size, bearing_deg, 9.0);
                let angle_rad = bearing_deg.to_radians();
                let center = f64::from(size) / 2.0;
                let inside = 0..size as i32;
                let mut sampled: Vec<(i32, i32)> = Vec::new();
                for k in 0..140_000 {
                    let t = f64::from(k) * 1e-4;
                    let x = center + t * math::cos(angle_rad);
                    let y = center + t * math::sin(angle_rad);
                    let at = (x.floor() as i32, y.floor() as i32);
                    if !(inside.contains(&at.0) && inside.contains(&at.1))
                        && sampled.last() != Some(&at)
                    {
                        sampled.push(at);
                    }
                }
                // Sampling may miss a box that is cut for less than its step, but never invents
                // one.
                assert!(
                    sampled[..found.len().min(sampled.len()) / 2].iter().all(|b| found.contains(b))
                );
                let mut rest = sampled.iter();
                let missing = found.iter().filter(|b| !rest.clone().any(|s| s == *b)).count();
                assert!(missing <= 1, "size {size}, {bearing_deg} deg: {missing} boxes invented");
                rest.next();
            }
        }
    }
}
