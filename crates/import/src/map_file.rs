//! One reader for all map files.

use std::path::Path;

use sidestep_kernel::InputError;

use super::{ascii, movingai, rosmap};
use sidestep_map::{GridMap, UnknownPolicy};

/// Reads the map at `path` into boxes with a side of `box_size_m` meters. The extension determines
/// the format: `.yaml` and `.yml` for ROS `map_server`, `.map` for MovingAI, `.txt` for characters,
/// each of them also followed by `.gz`. `unknown` decides on unknown boxes.
///
/// A `map_server` map is resampled to `box_size_m`; in the other two formats a character is a box.
///
/// # Errors
/// When the extension is another one, and those of [`rosmap::load`] with
/// [`PixelMap::to_boxes`](super::PixelMap::to_boxes), [`movingai::load_map`], [`ascii::load`].
pub fn map_file(
    path: &Path,
    box_size_m: f64,
    unknown: UnknownPolicy,
) -> Result<GridMap, InputError> {
    let map = match extension(path).as_str() {
        "yaml" | "yml" => rosmap::load(path)?.to_boxes(box_size_m, unknown)?,
        "map" => movingai::load_map(path, box_size_m)?,
        "txt" => ascii::load(path, box_size_m)?,
        _ => return Err(not_read(path)),
    };
    Ok(map.with_unknown(unknown))
}

/// Returns the extension in lower case, the one before `.gz` where that is the last.
fn extension(path: &Path) -> String {
    let name = path.file_name().unwrap_or_default().to_string_lossy().to_lowercase();
    let name = name.strip_suffix(".gz").unwrap_or(&name);
    name.rsplit_once('.').map_or("", |(_, extension)| extension).to_owned()
}

fn not_read(path: &Path) -> InputError {
    InputError::new(
        path.display(),
        "the file name does not say which kind of map this is",
        "give a .yaml or .yml (ROS map_server), a .map (MovingAI) or a .txt (characters) file, \
         each also with .gz",
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
        map_file(&path, 0.5, UnknownPolicy::Free)
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
        for name in ["map.pgm", "map", "map.gz", ".gz"] {
            let error = read(name, "").expect_err(name);
            for known in [".yaml", ".yml", ".map", ".txt", ".gz"] {
                assert!(error.remedy().contains(known), "{error}");
            }
        }
    }
}
