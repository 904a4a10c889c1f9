//! Maps written in the format of `map_server`, so that a run can store the maps that it saw.

use std::path::Path;

use crate::{GridOptions, load_map, load_pixel_map};
use sidestep_kernel::InputError;
use sidestep_kernel::view::Isometry2;
use sidestep_map::{Cell, UnknownPolicy};

/// Name of the image to which [`map_files`] refers.
const IMAGE: &str = "map.pgm";

/// Returns YAML file and image of a map, with their names; rows of cells start at the bottom.
pub fn map_files(
    size: [u32; 2],
    resolution_m: f64,
    plane: Isometry2,
    cells: &[Cell],
) -> [(&'static str, Vec<u8>); 2] {
    let heading = "The map as the simulation saw it.";
    let map = MapToWrite { heading, size, resolution_m, plane, cells };
    let [yaml, image] = map.files(IMAGE);
    [("map.yaml", yaml), (IMAGE, image)]
}

/// Returns the map in the file at `path` as a YAML file and the image that it calls `image_name`. A box of a map in
/// characters, which has no size in the file, becomes a meter.
///
/// # Errors
/// When the map cannot be read, or is an image without the size of its pixels.
pub fn clean_map(path: &Path, image_name: &str) -> Result<[Vec<u8>; 2], InputError> {
    let heading = "A map, written anew by sidestep inspect.";
    if let Some(map) = load_pixel_map(path, None)? {
        let size = [map.width(), map.height()];
        let map = MapToWrite {
            heading,
            size,
            resolution_m: map.resolution_m(),
            plane: map.plane(),
            cells: map.pixels(),
        };
        return Ok(map.files(image_name));
    }
    let boxes = GridOptions { box_size_m: 1.0, resolution_m: None, unknown: UnknownPolicy::Keep };
    let map = load_map(path, boxes)?;
    let size = [map.width(), map.height()];
    let map = MapToWrite {
        heading: "A map, written anew by sidestep inspect. Its boxes are 1 m wide by assumption: its file does not say it.",
        size,
        resolution_m: map.box_size_m,
        plane: map.plane,
        cells: map.cells(),
    };
    Ok(map.files(image_name))
}

/// A map for the format of `map_server`.
struct MapToWrite<'a> {
    /// The comment at the head of the YAML file.
    heading: &'a str,
    size: [u32; 2],
    resolution_m: f64,
    plane: Isometry2,
    /// Row by row from the bottom.
    cells: &'a [Cell],
}

impl MapToWrite<'_> {
    /// Returns the YAML file and the image, which the former calls `image_name`.
    fn files(&self, image_name: &str) -> [Vec<u8>; 2] {
        let Isometry2 { origin_m: [x_m, y_m], yaw_rad } = self.plane;
        let is_plain = |c: char| c.is_ascii_alphanumeric() || "._-/".contains(c);
        // Another name as JSON, which is YAML: it may have blanks or colons.
        let image_name = if image_name.chars().all(is_plain) {
            image_name.to_string()
        } else {
            serde_json::Value::from(image_name).to_string()
        };
        let yaml = format!(
            "# {}\nimage: {image_name}\nresolution: {:?}\n\
             origin: [{x_m:?}, {y_m:?}, {yaw_rad:?}]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n",
            self.heading, self.resolution_m
        );
        let [width, height] = self.size;
        let image = pgm(width, height, self.cells.iter().map(|cell| gray(*cell)));
        [yaml.into_bytes(), image]
    }
}

/// Returns the gray value with which `map_saver` of ROS writes a cell.
fn gray(cell: Cell) -> u8 {
    match cell {
        Cell::Free => 254,
        Cell::Unknown => 205,
        Cell::Wall => 0,
    }
}

/// Returns a binary PGM of gray values with rows that start at the bottom: the first row of the
/// file is the north edge.
pub fn pgm(width: u32, height: u32, grays: impl Iterator<Item = u8>) -> Vec<u8> {
    let grays: Vec<u8> = grays.collect();
    let mut bytes = format!("P5\n{width} {height}\n255\n").into_bytes();
    for row in grays.chunks_exact(width.max(1) as usize).rev() {
        bytes.extend_from_slice(row);
    }
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;
    use sidestep_map::GridMap;

    #[test]
    fn the_map_comes_back_as_it_was() {
        let cells = vec![Cell::Free, Cell::Wall, Cell::Unknown, Cell::Free, Cell::Free, Cell::Wall];
        let map = GridMap::new(3, 2, 0.1 + 0.2, cells)
            .with_plane(Isometry2 { origin_m: [-1.5, 1e-7], yaw_rad: 0.1 + 0.2 });
        let folder = tempfile::tempdir().expect("a folder");
        for (name, bytes) in map_files([3, 2], map.box_size_m, map.plane, map.cells()) {
            std::fs::write(folder.path().join(name), bytes).expect("written");
        }
        let as_boxes = GridOptions {
            box_size_m: map.box_size_m,
            resolution_m: None,
            unknown: UnknownPolicy::Keep,
        };
        let back = crate::load_map(&folder.path().join("map.yaml"), as_boxes);
        assert_eq!(back, Ok(map));
    }
}
