//! The distance of the MovingAI benchmarks: 8-connected, diagonals of length sqrt 2, and no
//! diagonal past the corner of a blocked box.

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::f64::consts::SQRT_2;

use super::{FreeSpace, STEPS};

/// Returns the length in boxes of a shortest octile path from `start` to `goal` (column, row), by
/// A*; `None` where there is no path.
///
/// A diagonal step needs both boxes beside it free. The length is computed once from whole numbers
/// of straight and diagonal steps, so it carries no error summed along the path.
pub fn octile_distance(free: &FreeSpace, start: (u32, u32), goal: (u32, u32)) -> Option<f64> {
    if !free.is_free(start.0, start.1) || !free.is_free(goal.0, goal.1) {
        return None;
    }
    let mut best = vec![f64::INFINITY; free.len()];
    best[free.index(start.0, start.1)] = 0.0;
    let mut open =
        BinaryHeap::from([Reverse(FrontierNode::new(start, PathLength::default(), goal))]);
    while let Some(Reverse(node)) = open.pop() {
        if node.position == goal {
            return Some(node.length.in_boxes());
        }
        // A shorter path was found after this one was queued.
        if node.length.in_boxes() > best[free.index(node.position.0, node.position.1)] {
            continue;
        }
        for (next, length) in neighbors(free, node.position, node.length) {
            let best_length = &mut best[free.index(next.0, next.1)];
            if length.in_boxes() < *best_length {
                *best_length = length.in_boxes();
                open.push(Reverse(FrontierNode::new(next, length, goal)));
            }
        }
    }
    None
}

/// A length in straight and diagonal steps.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord)]
struct PathLength {
    straight: u32,
    diagonal: u32,
}

impl PathLength {
    fn in_boxes(self) -> f64 {
        f64::from(self.straight) + f64::from(self.diagonal) * SQRT_2
    }

    /// Returns the octile distance on a grid without walls.
    fn between(a: (u32, u32), b: (u32, u32)) -> Self {
        let x = a.0.abs_diff(b.0);
        let y = a.1.abs_diff(b.1);
        Self { straight: x.abs_diff(y), diagonal: x.min(y) }
    }
}

/// A box on the search's frontier; the smallest is expanded next.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct FrontierNode {
    /// Bits of a lower bound of the length of paths through this box: lengths are not negative, so their bits
    /// have the same order as the lengths.
    estimate_bits: u64,
    position: (u32, u32),
    length: PathLength,
}

impl FrontierNode {
    fn new(position: (u32, u32), length: PathLength, goal: (u32, u32)) -> Self {
        let heuristic = PathLength::between(position, goal);
        let estimate = PathLength {
            straight: length.straight + heuristic.straight,
            diagonal: length.diagonal + heuristic.diagonal,
        };
        Self { estimate_bits: estimate.in_boxes().to_bits(), position, length }
    }
}

/// The four diagonal steps as (columns, rows).
const DIAGONAL_STEPS: [(i32, i32); 4] = [(1, 1), (-1, 1), (-1, -1), (1, -1)];

/// Returns the boxes one step away and the length of the path to them.
fn neighbors(
    free: &FreeSpace,
    (col, row): (u32, u32),
    length: PathLength,
) -> impl Iterator<Item = ((u32, u32), PathLength)> {
    let after_straight = PathLength { straight: length.straight + 1, ..length };
    let after_diagonal = PathLength { diagonal: length.diagonal + 1, ..length };
    let straight = STEPS.into_iter().map(move |step| (stepped((col, row), step), after_straight));
    // A diagonal step sweeps the corners of both boxes beside it, so these must be free as well.
    let diagonal = DIAGONAL_STEPS
        .into_iter()
        .filter(move |&(east, north)| {
            is_free(free, stepped((col, row), (east, 0)))
                && is_free(free, stepped((col, row), (0, north)))
        })
        .map(move |step| (stepped((col, row), step), after_diagonal));
    straight.chain(diagonal).filter(move |&(position, _)| is_free(free, position))
}

/// Returns the box one step away; beyond the lower edges the number wraps, and such a box is never free.
fn stepped((col, row): (u32, u32), (east, north): (i32, i32)) -> (u32, u32) {
    (col.wrapping_add_signed(east), row.wrapping_add_signed(north))
}

fn is_free(free: &FreeSpace, (col, row): (u32, u32)) -> bool {
    free.is_free(col, row)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::planning::parse_free_space as space;

    #[test]
    fn an_open_grid_is_crossed_by_diagonals() {
        let free = space(&"......\n".repeat(4));
        assert_eq!(octile_distance(&free, (0, 0), (5, 3)), Some(2.0 + 3.0 * SQRT_2));
        assert_eq!(octile_distance(&free, (5, 3), (0, 0)), Some(2.0 + 3.0 * SQRT_2));
        assert_eq!(octile_distance(&free, (2, 2), (2, 2)), Some(0.0));
    }

    #[test]
    fn corners_are_not_cut() {
        assert_eq!(octile_distance(&space("..\n.#"), (0, 0), (1, 1)), Some(2.0));
        assert_eq!(octile_distance(&space("#.\n.#"), (0, 0), (1, 1)), None);
    }

    #[test]
    fn blocked_ends_and_ends_outside_have_no_way() {
        let free = space(".#.");
        for (start, goal) in
            [((0, 0), (2, 0)), ((1, 0), (0, 0)), ((0, 0), (1, 0)), ((0, 0), (9, 0))]
        {
            assert_eq!(octile_distance(&free, start, goal), None, "{start:?} {goal:?}");
        }
    }
}
