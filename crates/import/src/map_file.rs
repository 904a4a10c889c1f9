//! One reader for all map files.

use std::path::Path;

use sidestep_kernel::InputError;

use super::extension::extension;
use super::imported_map::ImportedMap;
use super::report::ImportReport;
use super::{PixelMap, ascii, movingai, rosmap};
use sidestep_map::{GridMap, UnknownPolicy};

/// Endings of the names of images, in lower case: files that do not say the side of their pixels, which has to be given.
pub const IMAGE_ENDINGS: &[&str] =
    &[".png", ".pgm", ".jpg", ".jpeg", ".bmp", ".pbm", ".ppm", ".pnm"];

/// The conversion of a file into boxes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GridOptions {
    /// Side of a box in meters.
    pub box_size_m: f64,
    /// Side of a pixel in meters. A plain image needs it; that of a ROS map has to be the same.
    pub resolution_m: Option<f64>,
    /// The treatment of unknown boxes.
    pub unknown: UnknownPolicy,
}

/// Reads the map at `path` into boxes, as [`import_map`] does, without its report.
///
/// # Errors
/// Those of [`import_map`].
pub fn load_map(path: &Path, boxes: GridOptions) -> Result<GridMap, InputError> {
    import_map(path, boxes).map(|imported| imported.map)
}

/// Reads the map at `path` into boxes. The extension determines the format: `.yaml` and `.yml` for ROS
/// `map_server`, [`IMAGE_ENDINGS`] for a plain image (dark is wall, light is free, as in a ROS map without
/// thresholds), `.map` for MovingAI, `.txt` for characters, each of them also followed by `.gz`.
///
/// Pixels are resampled to boxes; in the last two formats a character is a box.
///
/// # Errors
/// When the extension is another one, a resolution is missing or contradicts the file, and those of
/// [`rosmap::load`] with [`PixelMap::to_boxes`], [`movingai::load_map`], [`ascii::load`].
pub fn import_map(path: &Path, boxes: GridOptions) -> Result<ImportedMap, InputError> {
    let Some(pixels) = load_pixel_map(path, boxes.resolution_m)? else {
        let ImportedMap { map, report } = load_char_map(path, boxes)?;
        return Ok(ImportedMap { map: map.with_unknown(boxes.unknown), report });
    };
    let map = pixels.to_boxes(boxes.box_size_m, boxes.unknown)?;
    Ok(ImportedMap { map, report: pixels.into_report() })
}

/// Reads the file at `path` if it is a map of pixels: a ROS map or a plain image.
///
/// # Errors
/// Those of [`import_map`].
pub fn load_pixel_map(
    path: &Path,
    resolution_m: Option<f64>,
) -> Result<Option<PixelMap>, InputError> {
    match (extension(path).as_str(), resolution_m) {
        ("yaml" | "yml", None) => rosmap::load(path).map(Some),
        ("yaml" | "yml", Some(given_m)) => {
            check_resolution(path, rosmap::load(path)?, given_m).map(Some)
        }
        (image, Some(resolution_m)) if is_image(image) => {
            rosmap::load_image(path, resolution_m).map(Some)
        }
        (image, None) if is_image(image) => {
            let cause = "an image does not have the size of its pixels";
            let remedy = "give the side of a pixel in meters: `--resolution 0.05`, in a scenario \
                          `map.resolution_m = 0.05`";
            Err(InputError::new(path.display(), cause, remedy))
        }
        _ => Ok(None),
    }
}

/// Returns whether an extension is that of a plain image.
pub(crate) fn is_image(extension: &str) -> bool {
    IMAGE_ENDINGS.iter().any(|ending| ending[1..] == *extension)
}

fn check_resolution(path: &Path, pixels: PixelMap, given_m: f64) -> Result<PixelMap, InputError> {
    let own_m = pixels.resolution_m();
    // The same number may have been printed and read with other digits.
    if (own_m - given_m).abs() <= 1e-9 * own_m {
        return Ok(pixels);
    }
    let cause = format!("its pixels are {own_m} m, not {given_m} m");
    Err(InputError::new(path.display(), cause, "leave the resolution out: the file has it"))
}

fn load_char_map(path: &Path, boxes: GridOptions) -> Result<ImportedMap, InputError> {
    let extension = extension(path);
    if !["map", "txt"].contains(&extension.as_str()) {
        return Err(unknown_map_format(path));
    }
    if boxes.resolution_m.is_some() {
        let cause = "a character is a box: there are no pixels";
        return Err(InputError::new(path.display(), cause, "leave the resolution out"));
    }
    match extension.as_str() {
        "map" => movingai::load_map(path, boxes.box_size_m),
        _ => {
            let map = ascii::load(path, boxes.box_size_m)?;
            Ok(ImportedMap::of_boxes(map, ImportReport::new("map in characters")))
        }
    }
}

fn unknown_map_format(path: &Path) -> InputError {
    InputError::new(
        path.display(),
        "the extension is not that of a map",
        "give a .yaml or .yml (ROS map_server), a .png, .pgm, .jpg, .jpeg, .bmp, .pbm, .ppm or .pnm (image), a .map \
         (MovingAI) or a .txt (characters) file, each also with .gz; save other images as PNG",
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use sidestep_map::Cell;

    fn read(name: &str, text: &str) -> Result<GridMap, InputError> {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join(name);
        std::fs::write(&path, text).expect("written");
        load_map(&path, BOXES)
    }

    const BOXES: GridOptions =
        GridOptions { box_size_m: 0.5, resolution_m: None, unknown: UnknownPolicy::Free };

    #[test]
    fn an_image_is_a_map_once_it_is_said_how_large_its_pixels_are() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("plan.pgm");
        std::fs::write(&path, "P2 2 2 255 0 255 255 205").expect("written");
        let boxes = GridOptions { resolution_m: Some(0.5), unknown: UnknownPolicy::Keep, ..BOXES };
        let map = load_map(&path, boxes).expect("read");
        // The last line of an image is south, where maps begin.
        assert_eq!(map.cells(), [Cell::Free, Cell::Unknown, Cell::Wall, Cell::Free]);
        assert_eq!(map.plane.origin_m, [0.0, 0.0]);
        let error = load_map(&path, BOXES).expect_err("no resolution");
        assert!(error.remedy().contains("--resolution"), "{error}");
        let error =
            load_map(&path, GridOptions { resolution_m: Some(0.0), ..BOXES }).expect_err("0 m");
        assert!(error.to_string().contains("0 m"), "{error}");
    }

    #[test]
    fn a_resolution_that_contradicts_the_file_is_refused() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let place = |name: &str| folder.path().join(name);
        std::fs::write(place("a.pgm"), "P2 1 1 255 255").expect("written");
        let yaml = "image: a.pgm\nresolution: 0.5\norigin: [0, 0, 0]\nnegate: 0\n\
                    occupied_thresh: 0.65\nfree_thresh: 0.196\n";
        std::fs::write(place("a.yaml"), yaml).expect("written");
        std::fs::write(place("a.txt"), "..\n").expect("written");
        let read = |name, m| load_map(&place(name), GridOptions { resolution_m: Some(m), ..BOXES });
        assert!(read("a.yaml", 0.5).is_ok());
        assert!(read("a.yaml", 0.25).expect_err("other").to_string().contains("not 0.25 m"));
        assert!(read("a.txt", 0.5).expect_err("boxes").to_string().contains("no pixels"));
    }

    #[test]
    fn the_extension_says_how_to_read() {
        let movingai = "type octile\nheight 1\nwidth 2\nmap\n.@\n";
        for (name, text) in [("a.txt", ".#\n"), ("A.MAP", movingai), ("a.b.txt.gz", ".#\n")] {
            let map = read(name, text).expect(name);
            assert_eq!(map.cells(), [Cell::Free, Cell::Wall], "{name}");
            assert_eq!(map.box_size_m, 0.5, "{name}");
        }
    }

    #[test]
    fn the_policy_holds_for_every_kind_of_file() {
        assert_eq!(read("a.txt", "?").expect("read").cells(), [Cell::Free]);
    }

    #[test]
    fn an_unknown_extension_lists_what_is_read() {
        for name in ["map.gif", "map", "map.gz", ".gz"] {
            let error = read(name, "").expect_err(name);
            for known in [&[".yaml", ".yml", ".map", ".txt", ".gz"], IMAGE_ENDINGS].concat() {
                assert!(error.remedy().contains(known), "{error}");
            }
        }
    }
}
