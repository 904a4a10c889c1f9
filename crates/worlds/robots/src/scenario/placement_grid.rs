//! Start places of bodies: as the scenario says, or in a free place by draw.

use crate::purpose;
use sidestep_kernel::EntityId;
use sidestep_kernel::stream::Streams;
use sidestep_map::{Cell, GridMap, Rect};

/// No entity has this id.
const EMPTY: u32 = u32::MAX;
/// Like [`EMPTY`] above every entity id.
const WALL: u32 = u32::MAX - 1;
/// Number of draws before a free place is searched for in order. Where one place in fifty is free, so many draws
/// fail in 2 % of all cases.
const MAX_TRIES: u32 = 200;

/// The occupant of each box of the map: an entity id, [`EMPTY`] or [`WALL`].
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
        let cells = map.cells().iter();
        let occupant = cells.map(|&cell| if cell == Cell::Free { EMPTY } else { WALL }).collect();
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
        if !is_inside(col, width, self.width) || !is_inside(row, height, self.height) {
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
        // Columns and rows in which the body's lower-left box may be.
        let cols = (width + 1).checked_sub(size.0)?;
        let rows = (height + 1).checked_sub(size.1)?;
        if cols == 0 || rows == 0 {
            return None;
        }
        let mut draws = streams.draws(id, 0, purpose::PLACE);
        let mut at = (col, row);
        for _ in 0..MAX_TRIES {
            at = (col + draws.uniform_below(cols), row + draws.uniform_below(rows));
            if self.place(id, covered_boxes(at, size)).is_ok() {
                return Some(at);
            }
        }
        // The region is crowded: take the first free place after the last one drawn, not the first of all,
        // so that the last bodies do not gather in one corner.
        let places = u64::from(cols) * u64::from(rows);
        let last_drawn = u64::from(at.1 - row) * u64::from(cols) + u64::from(at.0 - col);
        for k in 0..places {
            let place = (last_drawn + k) % places;
            let at =
                (col + (place % u64::from(cols)) as u32, row + (place / u64::from(cols)) as u32);
            if self.place(id, covered_boxes(at, size)).is_ok() {
                return Some(at);
            }
        }
        None
    }

    /// Returns the whole map as a region.
    pub(super) fn region(&self) -> [u32; 4] {
        [0, 0, self.width, self.height]
    }
}

/// Returns whether boxes in a row end before a limit; the numbers come from a file, and may overflow.
fn is_inside(at: u32, extent: u32, limit: u32) -> bool {
    at.checked_add(extent).is_some_and(|end| end <= limit)
}

fn covered_boxes(at: (u32, u32), (width, height): (u32, u32)) -> Rect {
    Rect { col: at.0, row: at.1, width, height }
}
