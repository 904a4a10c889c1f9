//! Start places of bodies: as the scenario says, or in a free place by draw.

use crate::purpose;
use sidestep_kernel::EntityId;
use sidestep_kernel::stream::Streams;
use sidestep_map::{Cell, GridMap, Rect};

/// Marks a box without an occupant.
const EMPTY: u32 = u32::MAX;
/// Marks a wall.
const WALL: u32 = u32::MAX - 1;
/// Number of draws before a free place is searched for in order.
const MAX_TRIES: u32 = 200;

/// The occupant of each box of the map.
pub(super) struct PlacementGrid {
    width: u32,
    height: u32,
    occupant: Vec<u32>,
}

/// The reason why a body cannot stand somewhere.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum PlacementError {
    OffMap,
    Wall(u32, u32),
    Body(EntityId, u32, u32),
}

impl PlacementGrid {
    pub(super) fn new(map: &GridMap) -> Self {
        let occupant =
            map.cells().iter().map(|&c| if c == Cell::Free { EMPTY } else { WALL }).collect();
        Self { width: map.width(), height: map.height(), occupant }
    }

    /// Places a body on some boxes, which may leave the map.
    pub(super) fn place(&mut self, id: EntityId, boxes: Rect) -> Result<(), PlacementError> {
        if let Some(obstacle) = self.find_obstacle(boxes) {
            return Err(obstacle);
        }
        for row in boxes.row..boxes.row + boxes.height {
            for col in boxes.col..boxes.col + boxes.width {
                self.occupant[(row * self.width + col) as usize] = id;
            }
        }
        Ok(())
    }

    fn find_obstacle(&self, Rect { col, row, width, height }: Rect) -> Option<PlacementError> {
        let inside = |at: u32, extent: u32, limit: u32| {
            at.checked_add(extent).is_some_and(|end| end <= limit)
        };
        if !inside(col, width, self.width) || !inside(row, height, self.height) {
            return Some(PlacementError::OffMap);
        }
        for r in row..row + height {
            for c in col..col + width {
                match self.occupant[(r * self.width + c) as usize] {
                    EMPTY => {}
                    WALL => return Some(PlacementError::Wall(c, r)),
                    id => return Some(PlacementError::Body(id, c, r)),
                }
            }
        }
        None
    }

    /// Returns a free place inside `region` (column, row, width, height), drawn for this body.
    pub(super) fn draw_place(
        &mut self,
        streams: &Streams,
        id: EntityId,
        size: (u32, u32),
        region: [u32; 4],
    ) -> Option<(u32, u32)> {
        let [col, row, width, height] = region;
        let (across, up) = ((width + 1).checked_sub(size.0)?, (height + 1).checked_sub(size.1)?);
        if across == 0 || up == 0 {
            return None;
        }
        let covered = |at: (u32, u32)| Rect { col: at.0, row: at.1, width: size.0, height: size.1 };
        let mut draws = streams.draws(id, 0, purpose::PLACE);
        let mut at = (col, row);
        for _ in 0..MAX_TRIES {
            at = (col + draws.uniform_below(across), row + draws.uniform_below(up));
            if self.place(id, covered(at)).is_ok() {
                return Some(at);
            }
        }
        // The region is crowded: take the first free place after the last one drawn.
        let boxes = u64::from(across) * u64::from(up);
        let from = u64::from(at.1 - row) * u64::from(across) + u64::from(at.0 - col);
        (0..boxes).map(|k| (from + k) % boxes).find_map(|k| {
            let at = (col + (k % u64::from(across)) as u32, row + (k / u64::from(across)) as u32);
            self.place(id, covered(at)).is_ok().then_some(at)
        })
    }

    /// Returns the whole map as a region.
    pub(super) fn region(&self) -> [u32; 4] {
        [0, 0, self.width, self.height]
    }
}
