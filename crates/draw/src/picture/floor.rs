//! Floors: all boxes of one kind as one path of few rectangles.

use std::fmt::Write as _;

use super::canvas::Canvas;
use crate::style::hex;
use crate::svg::{Svg, SvgNumber};
use sidestep_kernel::view::{Occupancy, OccupancyGrid, UNKNOWN_COLOR, WALL_COLOR};

/// Largest number of rectangles of a floor (some megabytes of SVG); with more it is drawn at a coarser grain.
const MAX_RECTANGLES: usize = 100_000;

/// A run of columns over a span of rows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct FloorBlock {
    col: u32,
    width: u32,
    row: u32,
    height: u32,
}

/// Draws a floor, in a group with one box as its unit, y upward.
pub(super) fn draw(svg: &mut Svg, floor: &OccupancyGrid, canvas: &Canvas) {
    let [x_m, y_m] = floor.plane.origin_m;
    let (x, y) = canvas.px([x_m, y_m, 0.0]);
    let x = SvgNumber(x);
    let y = SvgNumber(y);
    let box_px = canvas.px_per_m * floor.box_m;
    let turn = match floor.plane.yaw_rad {
        0.0 => String::new(),
        yaw_rad => format!(" rotate({})", yaw_rad.to_degrees()),
    };
    svg.push_raw(format_args!(
        r#"<g transform="translate({x} {y}) scale({box_px} -{box_px}){turn}">"#
    ));
    for (occupancy, color) in [(Occupancy::Unknown, UNKNOWN_COLOR), (Occupancy::Wall, WALL_COLOR)] {
        let data = path_data(floor.width, floor.height, &|col, row| {
            floor.boxes[row as usize * floor.width as usize + col as usize] == occupancy
        });
        if !data.is_empty() {
            svg.path(&data, format_args!(r#"fill="{}""#, hex(color)));
        }
    }
    svg.close_group();
}

/// Returns path data of the boxes for which `is` holds.
///
/// If they need more than [`MAX_RECTANGLES`], squares of 2, 4, 8, ... boxes are filled if any of
/// their boxes is: nothing vanishes, and such boxes are smaller than a pixel anyway.
fn path_data(width: u32, height: u32, is: &dyn Fn(u32, u32) -> bool) -> String {
    let mut grain = 1;
    loop {
        let blocks = merged(width.div_ceil(grain), height.div_ceil(grain), &|col, row| {
            let mut rows = row * grain..((row + 1) * grain).min(height);
            let cols = col * grain..((col + 1) * grain).min(width);
            rows.any(|r| cols.clone().any(|c| is(c, r)))
        });
        match blocks {
            Some(blocks) => return write(&blocks, grain, width, height),
            None => grain *= 2,
        }
    }
}

/// Covers the boxes for which `is` holds with blocks that do not overlap: runs of a row, merged
/// with the equal run in the row below. Returns `None` above [`MAX_RECTANGLES`].
fn merged(width: u32, height: u32, is: &dyn Fn(u32, u32) -> bool) -> Option<Vec<FloorBlock>> {
    let mut done = Vec::new();
    let mut open: Vec<FloorBlock> = Vec::new();
    for row in 0..height {
        let mut above = Vec::new();
        let mut old = open.into_iter().peekable();
        for (col, width) in runs(width, |col| is(col, row)) {
            // Both lists are ordered by columns.
            while let Some(block) = old.next_if(|b| b.col < col) {
                done.push(block);
            }
            above.push(match old.next_if(|b| (b.col, b.width) == (col, width)) {
                Some(block) => FloorBlock { height: block.height + 1, ..block },
                None => FloorBlock { col, width, row, height: 1 },
            });
        }
        done.extend(old);
        open = above;
        if done.len() + open.len() > MAX_RECTANGLES {
            return None;
        }
    }
    done.extend(open);
    Some(done)
}

/// Returns first column and length of each unbroken run for which `is` holds.
fn runs(width: u32, is: impl Fn(u32) -> bool) -> impl Iterator<Item = (u32, u32)> {
    let mut col = 0;
    std::iter::from_fn(move || {
        let start = (col..width).find(|&c| is(c))?;
        let end = (start..width).find(|&c| !is(c)).unwrap_or(width);
        col = end;
        Some((start, end - start))
    })
}

fn write(blocks: &[FloorBlock], grain: u32, width: u32, height: u32) -> String {
    let mut data = String::new();
    for block in blocks {
        let (x, y) = (block.col * grain, block.row * grain);
        // The last coarse square may reach beyond the map.
        let right = (x + block.width * grain).min(width);
        let top = (y + block.height * grain).min(height);
        // Writing into a String cannot fail.
        let _ = write!(data, "M{x} {y}H{right}V{top}H{x}Z");
    }
    data
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn a_solid_map_is_one_rectangle() {
        assert_eq!(path_data(2000, 1000, &|_, _| true), "M0 0H2000V1000H0Z");
        assert_eq!(path_data(10, 10, &|_, _| false), "");
        assert_eq!(path_data(0, 0, &|_, _| true), "");
    }

    #[test]
    fn a_checkerboard_of_four_million_boxes_stays_small() {
        let data = path_data(2000, 2000, &|col, row| (col + row) % 2 == 0);
        assert!(data.matches('M').count() <= MAX_RECTANGLES);
        assert!(!data.is_empty());
    }

    proptest! {
        #[test]
        fn blocks_cover_each_box_once_and_no_other(
            width in 1u32..9,
            cells in prop::collection::vec(any::<bool>(), 0..64),
        ) {
            let height = cells.len() as u32 / width;
            let is = |col: u32, row: u32| cells[(row * width + col) as usize];
            let blocks = merged(width, height, &is).unwrap();
            for row in 0..height {
                for col in 0..width {
                    let holds = |b: &&FloorBlock| {
                        (b.col..b.col + b.width).contains(&col)
                            && (b.row..b.row + b.height).contains(&row)
                    };
                    prop_assert_eq!(blocks.iter().filter(holds).count(), usize::from(is(col, row)));
                }
            }
        }
    }
}
