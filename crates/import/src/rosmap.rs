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
//! Transparency: `map_saver` of Nav2 writes unknown pixels as transparent ones in the mode `scale`, and there they are
//! unknown, as in `map_server`. In the mode `trinary` and in images without a YAML file it is guessed what they mean:
//! see `TransparentGround`. The mode `raw` does not look at it, as `map_server` does not.
//!
//! What is guessed, and what can hardly be right, is in the report of the map.

mod survey;
#[cfg(test)]
mod tests;
mod transparency;

use std::path::Path;

use self::survey::Survey;
use self::transparency::{TransparentGround, record_transparency};
use sidestep_kernel::InputError;
use sidestep_kernel::view::Isometry2;

use super::PixelMap;
use super::extension;
use super::image::Bitmap;
use super::map_yaml::{MAX_YAML_BYTES, MapMetadata, OccupancyRule};
use super::report::{ImportReport, Treatment};
use sidestep_map::Cell;
use sidestep_scenario::file::read_text;

/// Reads the map with its YAML file at `path`. YAML file and image may be compressed with gzip; an
/// image that exists only with `.gz` after its name is found too.
///
/// # Errors
/// When the YAML file does not end in `.yaml` or `.yml`, a file is missing, damaged or absurdly large, or a key is
/// missing or has an invalid value.
pub fn load(path: &Path) -> Result<PixelMap, InputError> {
    extension::check(path, "a map of ROS", &["yaml", "yml"])?;
    let text = read_text(path, MAX_YAML_BYTES)?;
    let mut report = ImportReport::new("ROS map (map_server)");
    let meta = MapMetadata::parse(path, &text, &mut report)?;
    let image = Bitmap::load(&meta.image)?;
    let cells = cells_from_bottom(&image, ThresholdSource::Yaml(meta.reading), &mut report);
    let size = [image.width(), image.height()];
    let map = PixelMap::new(size[0], size[1], meta.resolution_m, meta.plane, cells);
    Ok(with_facts(map, report))
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
    let mut report = ImportReport::new("image");
    let cells = cells_from_bottom(&image, ThresholdSource::Default, &mut report);
    Ok(with_facts(PixelMap::new(image.width(), image.height(), resolution_m, plane, cells), report))
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

/// Where the thresholds of a map come from.
#[derive(Debug, Clone, Copy)]
enum ThresholdSource {
    /// Its YAML file.
    Yaml(OccupancyRule),
    /// There is none: the usual thresholds hold.
    Default,
}

impl ThresholdSource {
    fn reading(self) -> OccupancyRule {
        match self {
            Self::Yaml(reading) => reading,
            Self::Default => OccupancyRule::DEFAULT,
        }
    }

    /// Returns how to change a threshold: the beginning of a remedy.
    fn remedy(self) -> &'static str {
        match self {
            Self::Yaml(_) => "set",
            Self::Default => "write a .yaml file for the image, with",
        }
    }
}

/// Returns the cells of an image, row by row from the bottom, and records what was guessed.
fn cells_from_bottom(
    image: &Bitmap,
    thresholds: ThresholdSource,
    report: &mut ImportReport,
) -> Vec<Cell> {
    let reading = thresholds.reading();
    let lossy = if image.is_lossy { ", with the errors of JPEG" } else { "" };
    report.add_fact("image", image.pixel_type() + lossy);
    let survey = Survey::of(image, reading);
    let ground = TransparentGround::of(&survey, reading.mode);
    let from_top = image.map_shades(|shade| ground.cell(shade, reading));
    record_transparency(&survey, ground, report);
    if image.is_turned {
        let rule = "the orientation that the camera wrote into the image, as in map_server";
        report.record(Treatment::NotUsed, rule, "", "turn the image, and save it as PNG");
    }
    if image.trailing_bytes > 0 {
        let rule = format!("{} bytes behind the pixels of the image", image.trailing_bytes);
        report.record(Treatment::NotUsed, rule, "", "give each image a file of its own");
    }
    survey.record_choices(reading, report);
    survey.record_grays_of_raw(report);
    survey.record_shades(reading.mode, report);
    survey.record_grays(thresholds, report);
    survey.record_single_kind(&from_top, reading.mode, report);
    from_top.rchunks(image.width() as usize).flatten().copied().collect()
}
