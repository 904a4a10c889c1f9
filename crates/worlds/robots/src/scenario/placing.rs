//! Where bodies stand at the start: where the scenario says, or in a free place by draw.

use crate::purpose;
use sidestep_kernel::EntityId;
use sidestep_kernel::stream::Streams;
use sidestep_map::{Cell, GridMap};

/// Nobody stands here yet.
const NOBODY: u32 = u32::MAX;
/// A wall.
const WALL: u32 = u32::MAX - 1;
/// Draws before a free place is looked for in order.
const TRIES: u32 = 200;

/// The occupant of each box of the map.
pub(super) struct Floor {
    width: u32,
    height: u32,
    occupant: Vec<u32>,
}

/// Why a body cannot stand somewhere.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Obstacle {
    Outside,
    Wall(u32, u32),
    Body(EntityId, u32, u32),
}

impl Floor {
    pub(super) fn new(map: &GridMap) -> Self {
        let occupant =
            map.cells().iter().map(|&c| if c == Cell::Free { NOBODY } else { WALL }).collect();
        Self { width: map.width(), height: map.height(), occupant }
    }

    /// Lets a body stand at `(col, row)`.
    pub(super) fn place(
        &mut self,
        id: EntityId,
        at: (u32, u32),
        size: (u32, u32),
    ) -> Result<(), Obstacle> {
        if let Some(obstacle) = self.obstacle(at, size) {
            return Err(obstacle);
        }
        for row in at.1..at.1 + size.1 {
            for col in at.0..at.0 + size.0 {
                self.occupant[(row * self.width + col) as usize] = id;
            }
        }
        Ok(())
    }

    fn obstacle(&self, (col, row): (u32, u32), (w, h): (u32, u32)) -> Option<Obstacle> {
        let inside = |at: u32, extent: u32, limit: u32| {
            at.checked_add(extent).is_some_and(|end| end <= limit)
        };
        if !inside(col, w, self.width) || !inside(row, h, self.height) {
            return Some(Obstacle::Outside);
        }
        for r in row..row + h {
            for c in col..col + w {
                match self.occupant[(r * self.width + c) as usize] {
                    NOBODY => {}
                    WALL => return Some(Obstacle::Wall(c, r)),
                    id => return Some(Obstacle::Body(id, c, r)),
                }
            }
        }
        None
    }

    /// A free place inside `region` (column, row, width, height), drawn for this body.
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
        let mut draws = streams.draws(id, 0, purpose::PLACE);
        let mut at = (col, row);
        for _ in 0..TRIES {
            at = (col + draws.below(across), row + draws.below(up));
            if self.place(id, at, size).is_ok() {
                return Some(at);
            }
        }
        // Crowded: the first free place after the last one drawn.
        let boxes = u64::from(across) * u64::from(up);
        let from = u64::from(at.1 - row) * u64::from(across) + u64::from(at.0 - col);
        (0..boxes).map(|k| (from + k) % boxes).find_map(|k| {
            let at = (col + (k % u64::from(across)) as u32, row + (k / u64::from(across)) as u32);
            self.place(id, at, size).is_ok().then_some(at)
        })
    }

    /// The whole map as a region.
    pub(super) fn region(&self) -> [u32; 4] {
        [0, 0, self.width, self.height]
    }
}
