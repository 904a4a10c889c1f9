//! Number of steps to the nearest goal, by breadth-first search.

use super::lanes::{Lanes, OFF_LANE_COST};
use super::{FreeSpace, STEPS};

/// The number of 4-connected steps from every box of a grid to the nearest goal.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Distances {
    width: u32,
    height: u32,
    /// Steps, row by row from the bottom, or [`Distances::UNREACHABLE`].
    steps: Vec<u32>,
}

impl Distances {
    pub(super) const UNREACHABLE: u32 = u32::MAX;

    /// Computes the distances to the nearest of `goals` (column, row) for a body of `size` x `size`
    /// boxes that has to fit into `free` along its path; boxes and goals mean its lower-left box. Goals
    /// where the body does not fit do not count.
    ///
    /// # Panics
    /// When `size` is 0.
    pub fn to_nearest(free: &FreeSpace, size: u32, goals: &[(u32, u32)]) -> Self {
        Self::from_anchors(&free.anchors(size), goals)
    }

    /// Computes the distances in the space of a body's anchors.
    pub(super) fn from_anchors(anchors: &FreeSpace, goals: &[(u32, u32)]) -> Self {
        let mut distances = Self {
            width: anchors.width(),
            height: anchors.height(),
            steps: vec![Self::UNREACHABLE; anchors.len()],
        };
        // The vector only grows, with the head of the queue as an index into it.
        let mut queue = distances.insert_goals(anchors, goals);
        let mut head = 0;
        while let Some(&position) = queue.get(head) {
            head += 1;
            distances.expand(anchors, position, &mut queue);
        }
        distances
    }

    /// Computes the cost to the nearest goal of paths on which a step costs 1, and [`OFF_LANE_COST`] more where it leads
    /// off lane and not to a goal.
    ///
    /// # Panics
    /// When `size` is 0, or where the lanes are those of another grid.
    pub(super) fn along_lanes(
        free: &FreeSpace,
        size: u32,
        goals: &[(u32, u32)],
        lanes: &Lanes,
    ) -> Self {
        let anchors = free.anchors(size);
        let mut distances = Self {
            width: anchors.width(),
            height: anchors.height(),
            steps: vec![Self::UNREACHABLE; anchors.len()],
        };
        // Dijkstra's search with a queue for each cost that a step can lead to.
        let mut queues: [Vec<(u32, u32)>; OFF_LANE_COST as usize + 2] = Default::default();
        queues[0] = distances.insert_goals(&anchors, goals);
        let mut cost = 0;
        while queues.iter().any(|queue| !queue.is_empty()) {
            for at in std::mem::take(&mut queues[0]) {
                // A place can be queued again at a lower cost, which was its turn then.
                if distances.steps[anchors.index(at.0, at.1)] == cost {
                    distances.expand_along_lanes(&anchors, lanes, at, &mut queues);
                }
            }
            queues.rotate_left(1);
            cost += 1;
        }
        distances
    }

    /// Lowers the cost of the neighbors from which a step leads to a box, and queues them by how much more it is.
    fn expand_along_lanes(
        &mut self,
        anchors: &FreeSpace,
        lanes: &Lanes,
        at: (u32, u32),
        queues: &mut [Vec<(u32, u32)>],
    ) {
        let cost = self.steps[anchors.index(at.0, at.1)];
        for (direction, (east, north)) in (0..).zip(STEPS) {
            // The step leads from there to here.
            let col = at.0.wrapping_add_signed(-east);
            let row = at.1.wrapping_add_signed(-north);
            if !anchors.is_free(col, row) {
                continue;
            }
            let off_lane = u32::from(cost > 0 && lanes.is_off_lane(at.0, at.1, direction));
            let step = 1 + u32::from(OFF_LANE_COST) * off_lane;
            let known = &mut self.steps[anchors.index(col, row)];
            if cost + step < *known {
                *known = cost + step;
                queues[step as usize].push((col, row));
            }
        }
    }

    /// Returns the steps from a box to the nearest goal, or `None` where no path leads to one.
    pub fn steps(&self, col: u32, row: u32) -> Option<u32> {
        if col >= self.width || row >= self.height {
            return None;
        }
        let steps = self.steps[row as usize * self.width as usize + col as usize];
        (steps != Self::UNREACHABLE).then_some(steps)
    }

    /// Returns the largest number of steps of any box with a path to a goal; `None` without a goal.
    pub fn max_steps(&self) -> Option<u32> {
        self.steps.iter().copied().filter(|&steps| steps != Self::UNREACHABLE).max()
    }

    /// Number of columns of the grid.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Number of rows of the grid.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// Returns the steps of all boxes, row by row from the bottom.
    pub(super) fn as_slice(&self) -> &[u32] {
        &self.steps
    }

    /// Sets the goals to 0; returns their boxes, each once.
    fn insert_goals(&mut self, anchors: &FreeSpace, goals: &[(u32, u32)]) -> Vec<(u32, u32)> {
        let mut queue = Vec::new();
        for &(col, row) in goals.iter().filter(|&&(col, row)| anchors.is_free(col, row)) {
            let steps = &mut self.steps[anchors.index(col, row)];
            if *steps == Self::UNREACHABLE {
                *steps = 0;
                queue.push((col, row));
            }
        }
        queue
    }

    /// Sets the distance of the unreached neighbors of a box and adds them to the queue.
    fn expand(&mut self, anchors: &FreeSpace, (col, row): (u32, u32), queue: &mut Vec<(u32, u32)>) {
        let steps = self.steps[anchors.index(col, row)] + 1;
        for (east, north) in STEPS {
            // A step off the west or south edge wraps to a large number, which is off the grid too.
            let col = col.wrapping_add_signed(east);
            let row = row.wrapping_add_signed(north);
            if col < self.width && row < self.height {
                let index = anchors.index(col, row);
                if self.steps[index] == Self::UNREACHABLE && anchors.contains(index) {
                    self.steps[index] = steps;
                    queue.push((col, row));
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::planning::parse_free_space as space;

    #[test]
    fn steps_go_around_walls_and_not_through_corners() {
        let free = space("...\n.#.\n.#.");
        let distances = Distances::to_nearest(&free, 1, &[(0, 0)]);
        assert_eq!(distances.steps(2, 0), Some(6));
        assert_eq!(distances.steps(1, 0), None, "a wall");
        assert_eq!(distances.steps(3, 0), None, "outside");
        assert_eq!(distances.max_steps(), Some(6));
    }

    #[test]
    fn the_nearest_of_several_goals_counts_and_blocked_ones_do_not() {
        let free = space("....#");
        let distances = Distances::to_nearest(&free, 1, &[(0, 0), (0, 0), (3, 0), (4, 0), (9, 9)]);
        let steps: Vec<_> = (0..5).map(|col| distances.steps(col, 0)).collect();
        assert_eq!(steps, [Some(0), Some(1), Some(1), Some(0), None]);
        assert_eq!(Distances::to_nearest(&free, 1, &[(4, 0)]).max_steps(), None);
    }

    #[test]
    fn a_large_body_needs_a_wide_way() {
        let free = space("....\n.#..\n....\n....");
        let distances = Distances::to_nearest(&free, 2, &[(0, 0)]);
        assert_eq!(distances.steps(2, 2), Some(4));
        assert_eq!(distances.steps(0, 2), None, "the wall is in the way");
    }
}
