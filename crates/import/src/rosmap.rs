//! Maps of ROS `map_server`: a YAML file and the image that it refers to.
//!
//! With `v` the mean of a pixel's color channels (0 to 255), `p = (255 - v) / 255`, or
//! `v / 255` where `negate` is set. The pixel is occupied where `p > occupied_thresh`, free
//! where `p < free_thresh` and else unknown. The modes differ as follows.
//!
//! - `trinary`, the default: as described above.
//! - `scale`: a pixel that is neither occupied nor free gets a shade between the two; because it is
//!   not certainly free, it is unknown here.
//! - `raw`: `v` (`255 - v` where `negate` is set) is itself the occupancy in percent, compared
//!   with both thresholds; above 100 it is unknown.
//!
//! The third number of `origin` rotates the image about its lower-left corner, counterclockwise. Pixels and
//! boxes stay along the axes of the image; only positions in the world are rotated.
//!
//! Transparency is ignored, unlike in `map_server`, where the trinary mode averages it with the
//! colors. Unknown keys are ignored, as in `map_server`.

use std::path::Path;

use sidestep_kernel::InputError;
use sidestep_kernel::view::Isometry2;

use super::PixelMap;
use super::extension;
use super::image::Bitmap;
use super::map_yaml::{MAX_YAML_BYTES, MapMetadata, OccupancyRule};
use super::report::ImportReport;
use sidestep_scenario::file::read_text;

/// Reads the map with its YAML file at `path`. YAML file and image may be compressed with gzip; an
/// image that exists only with `.gz` after its name is found too.
///
/// # Errors
/// When the YAML file does not end in `.yaml` or `.yml`, a file is missing, damaged or absurdly large, or a key is
/// missing or has an invalid value.
pub fn load(path: &Path) -> Result<PixelMap, InputError> {
    extension::check(path, "a map of ROS", &["yaml", "yml"])?;
    let place = path.display().to_string();
    let text = read_text(path, MAX_YAML_BYTES)?;
    let meta = MapMetadata::parse(&place, &text, path.parent().unwrap_or(Path::new("")))?;
    let image = Bitmap::load(&meta.image)?;
    let map = to_pixel_map(meta.resolution_m, meta.plane, meta.reading, &image);
    Ok(with_facts(map, ImportReport::new("ROS map (map_server)")))
}

/// Reads a plain image as `map_server` would with its usual thresholds: the corner in the southwest is
/// the origin, a pixel with `p > 0.65` is occupied, one with `p < 0.196` free.
///
/// # Errors
/// When the file is missing, damaged or absurdly large, or the side of a pixel is not positive.
pub fn load_image(path: &Path, resolution_m: f64) -> Result<PixelMap, InputError> {
    if !(resolution_m.is_finite() && resolution_m > 0.0) {
        let cause = format!("a resolution of {resolution_m} m per pixel");
        let remedy = "give the side of a pixel in meters, such as 0.05";
        return Err(InputError::new(path.display(), cause, remedy));
    }
    let image = Bitmap::load(path)?;
    let plane = Isometry2 { origin_m: [0.0, 0.0], yaw_rad: 0.0 };
    let map = to_pixel_map(resolution_m, plane, OccupancyRule::DEFAULT, &image);
    Ok(with_facts(map, ImportReport::new("image")))
}

/// Completes the report of a map.
fn with_facts(map: PixelMap, mut report: ImportReport) -> PixelMap {
    let [width, height] = [map.width(), map.height()];
    let resolution_m = map.resolution_m();
    let size_m = [width, height].map(|pixels| f64::from(pixels) * resolution_m);
    let Isometry2 { origin_m: [x, y], yaw_rad } = map.plane();
    report.add_fact("pixels", format!("{width} x {height} of {resolution_m} m"));
    report.add_fact("extent", format!("{:.2} x {:.2} m", size_m[0], size_m[1]));
    report.add_fact("origin", format!("({x}, {y}) m, turned by {yaw_rad} rad"));
    let counts = map.counts();
    report.add_kept("free pixels", counts.free);
    report.add_kept("occupied pixels", counts.wall);
    report.add_kept("unknown pixels", counts.unknown);
    map.with_report(report)
}

fn to_pixel_map(
    resolution_m: f64,
    plane: Isometry2,
    reading: OccupancyRule,
    image: &Bitmap,
) -> PixelMap {
    let from_top = image.map_brightness(|brightness| reading.cell(brightness));
    let from_bottom = from_top.rchunks(image.width() as usize).flatten().copied().collect();
    PixelMap::new(image.width(), image.height(), resolution_m, plane, from_bottom)
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use super::super::map_yaml::MapMode;
    use super::*;
    use Cell::{Free, Unknown, Wall};
    use sidestep_map::Cell;

    const READING: OccupancyRule = OccupancyRule::DEFAULT;

    fn cells(reading: OccupancyRule, brightnesses: &[f64]) -> Vec<Cell> {
        brightnesses.iter().map(|&brightness| reading.cell(brightness)).collect()
    }

    #[test]
    fn dark_is_occupied_light_is_free_and_205_is_unknown_by_a_hair() {
        assert_eq!(cells(READING, &[0.0, 205.0, 206.0, 255.0]), [Wall, Unknown, Free, Free]);
        let lenient = OccupancyRule { free_thresh: 0.25, ..READING };
        assert_eq!(cells(lenient, &[205.0]), [Free]);
    }

    #[test]
    fn both_thresholds_are_strict() {
        let reading = OccupancyRule { occupied_thresh: 0.6, free_thresh: 0.2, ..READING };
        assert_eq!(cells(reading, &[102.0, 101.0, 204.0, 205.0]), [Unknown, Wall, Unknown, Free]);
    }

    #[test]
    fn negate_turns_dark_and_light_around() {
        let reading = OccupancyRule { negate: true, ..READING };
        assert_eq!(cells(reading, &[0.0, 50.0, 255.0]), [Free, Unknown, Wall]);
    }

    #[test]
    fn the_shades_of_scale_are_unknown() {
        let reading = OccupancyRule { mode: MapMode::Scale, ..READING };
        assert_eq!(cells(reading, &[0.0, 128.0, 255.0]), [Wall, Unknown, Free]);
    }

    #[test]
    fn raw_values_are_percent_and_unknown_above_100() {
        let reading = OccupancyRule { mode: MapMode::Raw, ..READING };
        let values = [0.0, 19.0, 20.0, 65.0, 66.0, 100.0, 101.0, 255.0];
        let expected = [Free, Free, Unknown, Unknown, Wall, Wall, Unknown, Unknown];
        assert_eq!(cells(reading, &values), expected);
        let negated = OccupancyRule { negate: true, ..reading };
        assert_eq!(cells(negated, &[255.0, 155.0, 0.0]), [Free, Wall, Unknown]);
    }

    /// A folder with a map of 1 x 2 pixels, white over black, and its YAML file.
    fn written(image: &str, bytes: &[u8]) -> (tempfile::TempDir, PathBuf) {
        let folder = tempfile::tempdir().expect("a temporary folder");
        std::fs::write(folder.path().join(image), bytes).expect("written");
        let yaml = "image: a.pgm\nresolution: 0.5\norigin: [1, 2, 0]\nnegate: 0\n\
                    occupied_thresh: 0.65\nfree_thresh: 0.196\n";
        let path = folder.path().join("a.yaml");
        std::fs::write(&path, yaml).expect("written");
        (folder, path)
    }

    const IMAGE: &[u8] = b"P5 1 2 255\n\xff\x00";

    #[test]
    fn the_last_row_of_the_image_is_the_bottom_of_the_map() {
        let (_folder, path) = written("a.pgm", IMAGE);
        let map = load(&path).expect("a map");
        assert_eq!((map.width(), map.height(), map.resolution_m()), (1, 2, 0.5));
        assert_eq!((map.plane().origin_m, map.pixels()), ([1.0, 2.0], &[Wall, Free][..]));
    }

    #[test]
    fn an_image_that_is_there_in_packed_form_only_is_found() {
        use std::io::Write;
        let mut gzip = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
        gzip.write_all(IMAGE).expect("memory takes all");
        let (_folder, path) = written("a.pgm.gz", &gzip.finish().expect("memory takes all"));
        assert_eq!(load(&path).map(|map| map.counts().free), Ok(1));
    }

    #[test]
    fn a_missing_image_is_an_error_in_the_yaml_file_and_a_cut_one_in_the_image() {
        let (_folder, path) = written("b.pgm", IMAGE);
        let error = load(&path).expect_err("missing");
        assert!(error.place().ends_with("a.yaml"), "{error}");
        assert_eq!(error.line_and_column(), Some((1, 8)));
        let (_folder, path) = written("a.pgm", &IMAGE[..12]);
        let error = load(&path).expect_err("cut");
        assert!(error.place().ends_with("a.pgm") && error.cause().contains("short"), "{error}");
    }

    #[test]
    fn what_does_not_end_as_a_map_is_not_read_as_one() {
        let (folder, path) = written("a.pgm", IMAGE);
        for (name, is_map) in
            [("b.yml", true), ("B.YAML.gz", true), ("b.toml", false), ("b", false)]
        {
            let other = folder.path().join(name);
            std::fs::copy(&path, &other).expect("copied");
            assert_eq!(load(&other).is_ok(), is_map, "{name}");
        }
        let error = load(&folder.path().join("b.toml")).expect_err("a scenario");
        assert!(error.remedy().contains(".yaml or .yml"), "{error}");
    }

    #[test]
    fn a_yaml_file_of_absurd_size_is_refused() {
        let (_folder, path) = written("a.pgm", IMAGE);
        std::fs::write(&path, "#".repeat(1 << 20)).expect("written");
        assert!(load(&path).is_err());
    }
}
