//! The steps to the goals of teams that a caller orders: what their robots observe beside the goals.

use sidestep_map::planning::{Distances, FreeSpace};
use sidestep_planners::GridPose;
use std::collections::BTreeMap;

/// Most bytes of the steps that are kept.
const MAX_BYTES: usize = 1 << 28;

/// The steps from each box to the goals of a team. They depend on the floor alone; what is forgotten is computed again.
#[derive(Debug)]
pub(crate) struct GoalDistances {
    free: FreeSpace,
    size: u32,
    max_fields: usize,
    fields: BTreeMap<(u32, u32), Distances>,
}

impl GoalDistances {
    /// Creates them for bodies of `size` x `size` boxes.
    pub(crate) fn new(free: FreeSpace, size: u32) -> Self {
        let boxes = free.width() as usize * free.height() as usize;
        let max_fields = (MAX_BYTES / (size_of::<u32>() * boxes.max(1))).max(1);
        Self { free, size, max_fields, fields: BTreeMap::new() }
    }

    /// Returns the steps from a pose to a goal, or -1 where no path leads there; and by how many steps each neighboring box is
    /// nearer to the goal, from the one ahead on counterclockwise: 0 where the body does not fit.
    pub(crate) fn steps(&mut self, pose: GridPose, goal: (u32, u32)) -> (i64, [i64; 4]) {
        let field = self.field(goal);
        let Some(here) = field.steps(pose.col, pose.row) else { return (-1, [0; 4]) };
        let nearer = std::array::from_fn(|side| {
            let direction = (usize::from(pose.heading) + side) % 4;
            let (east, north) = [(1, 0), (0, 1), (-1, 0), (0, -1)][direction];
            let col = pose.col.checked_add_signed(east);
            let row = pose.row.checked_add_signed(north);
            let there = col.zip(row).and_then(|(col, row)| field.steps(col, row));
            there.map_or(0, |there| i64::from(here) - i64::from(there))
        });
        (i64::from(here), nearer)
    }

    fn field(&mut self, goal: (u32, u32)) -> &Distances {
        if self.fields.len() >= self.max_fields && !self.fields.contains_key(&goal) {
            self.fields.pop_first();
        }
        let Self { free, size, fields, .. } = self;
        fields.entry(goal).or_insert_with(|| Distances::to_nearest(free, *size, &[goal]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_box_ahead_is_nearer_and_walls_are_neither() {
        // The lower row is free, and of the upper one its first box.
        let free = FreeSpace::new(4, 2, |col, row| row == 0 || col == 0);
        let mut distances = GoalDistances::new(free, 1);
        let goal = (3, 0);
        assert_eq!(distances.steps(GridPose::new(1, 0, 0), goal), (2, [1, 0, -1, 0]));
        // Looking west, the goal is behind.
        assert_eq!(distances.steps(GridPose::new(1, 0, 2), goal), (2, [-1, 0, 1, 0]));
        assert_eq!(distances.steps(GridPose::new(0, 1, 3), goal), (4, [1, 0, 0, 0]));
        assert_eq!(distances.steps(GridPose::new(3, 0, 0), goal), (0, [0, 0, -1, 0]));
    }

    #[test]
    fn what_does_not_fit_is_forgotten_and_computed_again() {
        let mut distances = GoalDistances::new(FreeSpace::new(3, 1, |_, _| true), 1);
        distances.max_fields = 1;
        for goal in [0, 2, 0, 2] {
            let (steps, _) = distances.steps(GridPose::new(0, 0, 0), (goal, 0));
            assert_eq!(steps, i64::from(goal));
            assert_eq!(distances.fields.len(), 1);
        }
    }
}
