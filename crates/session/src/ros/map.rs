//! The floor as a map: files of `map_server`, and the message that it sends.

use super::{MAP_FRAME, header};
use sidestep_import::bag::messages::{MapMetaData, OccupancyGrid as RosGrid, Pose as RosPose};
use sidestep_import::write::map_files;
use sidestep_kernel::view::{Isometry2, Occupancy, OccupancyGrid, Pose};
use sidestep_map::Cell;

/// The floor with a wall around it, because nothing leaves it, not even a beam.
struct BorderedMap {
    size: [u32; 2],
    plane: Isometry2,
    /// Row by row from the first.
    cells: Vec<Cell>,
}

impl BorderedMap {
    fn new(floor: &OccupancyGrid) -> Self {
        let size = [floor.width + 2, floor.height + 2];
        let width = size[0] as usize;
        let mut cells = vec![Cell::Wall; width * size[1] as usize];
        let inside = cells.chunks_exact_mut(width).skip(1);
        for (row, boxes) in inside.zip(floor.boxes.chunks_exact(floor.width.max(1) as usize)) {
            for (cell, occupancy) in row[1..].iter_mut().zip(boxes) {
                *cell = match occupancy {
                    Occupancy::Free => Cell::Free,
                    Occupancy::Wall => Cell::Wall,
                    Occupancy::Unknown => Cell::Unknown,
                };
            }
        }
        let origin_m = floor.plane.transform_point([-floor.box_m; 2]);
        Self { size, plane: Isometry2 { origin_m, ..floor.plane }, cells }
    }
}

/// Returns the map as files of `map_server`, with their names.
pub(crate) fn map_files_with_border(floor: &OccupancyGrid) -> [(&'static str, Vec<u8>); 2] {
    let map = BorderedMap::new(floor);
    map_files(map.size, floor.box_m, map.plane, &map.cells)
}

/// Returns the map as `map_server` sends it.
pub(super) fn occupancy_grid(floor: &OccupancyGrid, time_s: f64) -> RosGrid {
    let map = BorderedMap::new(floor);
    let header = header(time_s, MAP_FRAME.into());
    let [x_m, y_m] = map.plane.origin_m;
    let origin = Pose::from_heading([x_m, y_m, 0.0], map.plane.yaw_rad);
    let info = MapMetaData {
        map_load_time: header.stamp.clone(),
        resolution_m: floor.box_m as f32,
        width: map.size[0],
        height: map.size[1],
        origin: RosPose { position: origin.at_m, orientation: origin.turn },
    };
    let data = map.cells.iter().map(|cell| match cell {
        Cell::Free => 0,
        Cell::Wall => 100,
        Cell::Unknown => -1,
    });
    RosGrid { header, info, data: data.collect() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_map_has_a_wall_around_it_and_its_corner_one_box_further_out() {
        let floor = OccupancyGrid {
            width: 2,
            height: 1,
            box_m: 0.5,
            plane: Isometry2 { origin_m: [3.0, 1.0], yaw_rad: 0.0 },
            boxes: vec![Occupancy::Free, Occupancy::Unknown],
        };
        let grid = occupancy_grid(&floor, 2.0);
        assert_eq!([grid.info.width, grid.info.height], [4, 3]);
        assert_eq!(grid.info.origin.position, [2.5, 0.5, 0.0]);
        assert_eq!(grid.data, [100, 100, 100, 100, 100, 0, -1, 100, 100, 100, 100, 100]);
        assert_eq!((grid.header.stamp.sec, &*grid.header.frame_id), (2, "map"));
    }
}
