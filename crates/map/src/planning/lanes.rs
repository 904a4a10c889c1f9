//! Lanes of passages in which there is room for two bodies side by side.

use super::{FreeSpace, STEPS};

/// Widest passage with lanes, in boxes. A wider one is a hall: bodies meet there rarely, and a lane would lead far around.
const MAX_PASSAGE_BOXES: u32 = 16;

/// Extra price of a step onto a place that is off lane and no goal, in steps: a path changes to its
/// lane unless its goal is very near.
pub const OFF_LANE_COST: u8 = 2;

/// The directions in which a body at each anchor is off the right half of its passage.
///
/// Who keeps to the right half of every passage in which two bodies fit side by side never meets another one head on
/// that does so, too. A passage is as wide as the row of free boxes across the direction of travel; in one that is wider
/// than 16 boxes, or narrower than two bodies, there are no lanes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Lanes {
    /// By direction: 0 east, 1 north, 2 west, 3 south.
    off_lane: [FreeSpace; 4],
}

impl Lanes {
    /// Finds the lanes for a body of `size` x `size` boxes; its place is its lower-left box.
    ///
    /// # Panics
    /// When `size` is 0.
    #[must_use]
    pub fn new(free: &FreeSpace, size: u32) -> Self {
        let anchors = free.anchors(size);
        let off_lane = [0, 1, 2, 3].map(|direction| {
            FreeSpace::new(free.width(), free.height(), |col, row| {
                anchors.is_free(col, row) && is_off_lane(&anchors, size, (col, row), direction)
            })
        });
        Self { off_lane }
    }

    /// Returns whether a body that goes in a direction at a place is off the right half of a passage with room for two.
    #[inline]
    #[must_use]
    pub fn is_off_lane(&self, col: u32, row: u32, direction: u8) -> bool {
        self.off_lane[usize::from(direction % 4)].is_free(col, row)
    }

    /// Returns the places that are off lane in a direction.
    #[must_use]
    pub fn off_lane(&self, direction: u8) -> &FreeSpace {
        &self.off_lane[usize::from(direction % 4)]
    }
}

/// Returns whether the right half of the passage does not hold a body at this anchor.
fn is_off_lane(anchors: &FreeSpace, size: u32, at: (u32, u32), direction: u8) -> bool {
    let right = free_steps(anchors, at, direction + 3);
    let left = free_steps(anchors, at, direction + 1);
    let width = right + left + size;
    let has_lanes = (2 * size..=MAX_PASSAGE_BOXES).contains(&width);
    has_lanes && right + size > width / 2
}

/// Returns the number of steps from an anchor in a direction, up to more than the widest passage has.
fn free_steps(anchors: &FreeSpace, (col, row): (u32, u32), direction: u8) -> u32 {
    let (east, north) = STEPS[usize::from(direction % 4)];
    let is_free = |&steps: &u32| {
        let steps = steps as i32;
        // Beyond the west and south edge the numbers wrap to large ones, which are off the grid.
        anchors
            .is_free(col.wrapping_add_signed(east * steps), row.wrapping_add_signed(north * steps))
    };
    (1..=MAX_PASSAGE_BOXES).take_while(is_free).count() as u32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::planning::parse_free_space as space;

    /// Returns the rows that are off lane in a direction, at a column in the middle.
    fn off_rows(height: usize, size: u32, direction: u8) -> Vec<u32> {
        let free = space(&[".".repeat(40).as_str()].repeat(height).join("\n"));
        let lanes = Lanes::new(&free, size);
        (0..height as u32).filter(|&row| lanes.is_off_lane(20, row, direction)).collect()
    }

    #[test]
    fn who_goes_east_keeps_south_and_who_goes_west_keeps_north() {
        let off = |height, size| [0, 2].map(|direction| off_rows(height, size, direction));
        assert_eq!(off(2, 1), [[1], [0]]);
        assert_eq!(off(5, 1), [[2, 3, 4], [0, 1, 2]]);
        assert_eq!(off(4, 2), [[1, 2], [0, 1]]);
        assert_eq!(off(8, 2), [[3, 4, 5, 6], [0, 1, 2, 3]]);
    }

    #[test]
    fn passages_without_room_for_two_and_halls_have_no_lanes() {
        for (height, size) in [(1, 1), (3, 2), (17, 1)] {
            assert!(off_rows(height, size, 0).is_empty(), "{size} in {height}");
        }
        assert_eq!(off_rows(16, 1, 0).len(), 8);
    }

    #[test]
    fn two_bodies_that_are_on_their_lanes_have_no_box_in_common() {
        for height in 2..=16 {
            for size in 1..=height as u32 / 2 {
                let anchors = 0..=height as u32 - size;
                let off = [0, 2].map(|direction| off_rows(height, size, direction));
                let eastbound = anchors.clone().filter(|row| !off[0].contains(row));
                let westbound = anchors.filter(|row| !off[1].contains(row));
                let highest_east = eastbound.max().expect("a lane");
                let lowest_west = westbound.min().expect("a lane");
                assert!(highest_east + size <= lowest_west, "{size} in {height}");
            }
        }
    }

    #[test]
    fn a_crossing_has_no_lanes_across_a_long_aisle() {
        let row = ".".repeat(40);
        let aisle = format!("{}..{}", "#".repeat(19), "#".repeat(19));
        let free = space(&[aisle.as_str(), &row, &row, &aisle].join("\n"));
        let lanes = Lanes::new(&free, 1);
        assert!(
            lanes.is_off_lane(19, 0, 1) && !lanes.is_off_lane(20, 0, 1),
            "in the aisle that goes north"
        );
        assert!(!lanes.is_off_lane(19, 1, 1), "on the crossing");
    }
}
