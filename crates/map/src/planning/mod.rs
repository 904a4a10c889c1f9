//! Distances and shortest paths on a grid of boxes.
//!
//! [`FreeSpace`] holds the boxes where a body may stand, [`Distances`] the number of steps to the
//! nearest goal, [`FlowField`] the direction of the next step, [`Lanes`] the right-hand side of passages; [`octile_distance`] is the
//! measure of the MovingAI benchmarks. Everything here is a pure function of its arguments; ties
//! are broken by documented rules.

mod distance;
mod flow_field;
mod free_space;
mod lanes;
mod octile;

pub use distance::Distances;
pub use flow_field::{FlowField, FlowWindow};
pub use free_space::{FREE_WINDOW_COLUMNS, FreeSpace, FreeWindow};
pub use lanes::{Lanes, OFF_LANE_COST};
pub use octile::octile_distance;

/// The four steps on a grid as (columns, rows), by direction: 0 east, 1 north, 2 west, 3 south.
pub const STEPS: [(i32, i32); 4] = [(1, 0), (0, 1), (-1, 0), (0, -1)];

/// Returns the free boxes of a drawing with the north edge as its first line; `#` is a wall.
#[cfg(test)]
fn parse_free_space(art: &str) -> FreeSpace {
    use crate::{Cell, GridMap};
    let rows: Vec<&str> = art.lines().rev().collect();
    let cell = |sign| if sign == '#' { Cell::Wall } else { Cell::Free };
    let cells = rows.iter().flat_map(|row| row.chars().map(cell)).collect();
    FreeSpace::from_map(&GridMap::new(rows[0].len() as u32, rows.len() as u32, 1.0, cells))
}
