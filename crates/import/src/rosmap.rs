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

use std::path::Path;

use sidestep_kernel::InputError;
use sidestep_kernel::view::Isometry2;

use super::PixelMap;
use super::extension;
use super::image::{Bitmap, Shade};
use super::map_yaml::{MAX_YAML_BYTES, MapMetadata, MapMode, OccupancyRule};
use super::report::{Finding, ImportReport, Treatment};
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
    if reading.mode != MapMode::Raw {
        record_single_kind(&from_top, &survey, report);
    }
    from_top.rchunks(image.width() as usize).flatten().copied().collect()
}

/// The gray that `map_saver` writes for unknown pixels.
const UNKNOWN_GRAY: usize = 205;

/// Grays from this one on are as bright as free pixels are written (254), with room for noise.
const MIN_LIGHT_GRAY: usize = 240;

/// Share of the pixels from which a gray is no accident: the edges of lines and the noise of drawings have fewer of
/// any one gray.
const MIN_SUSPICIOUS_SHARE: f64 = 0.01;

/// What the pixels of an image are like, before any is read as a cell.
#[derive(Debug)]
struct Survey {
    /// Number of all pixels.
    pixels: usize,
    /// Number of pixels that are not opaque.
    transparent: usize,
    /// The greatest opacity of a pixel, from 0 to 1.
    max_opacity: f64,
    /// Number of opaque pixels whose brightness is that of free ground.
    opaque_free: usize,
    /// Number of those of each whole gray.
    free_grays: [usize; 256],
    /// Number of opaque pixels between free and occupied.
    opaque_between: usize,
    /// Number of opaque colored pixels that Nav2 reads otherwise.
    colored: usize,
    /// Number of opaque pixels whose occupancy is a threshold.
    at_threshold: usize,
    /// Number of pixels between free and occupied of the mode raw, and of those above occupied and below unknown.
    raw_between: usize,
    raw_beyond: usize,
    /// The darkest and the lightest brightness.
    range: [f64; 2],
}

impl Survey {
    fn of(image: &Bitmap, reading: OccupancyRule) -> Self {
        let mut survey = Self {
            pixels: 0,
            transparent: 0,
            max_opacity: 0.0,
            opaque_free: 0,
            opaque_between: 0,
            colored: 0,
            at_threshold: 0,
            raw_between: 0,
            raw_beyond: 0,
            free_grays: [0; 256],
            range: [255.0, 0.0],
        };
        image.map_shades(|shade| survey.add(shade, reading));
        survey
    }

    fn add(&mut self, shade: Shade, reading: OccupancyRule) {
        self.pixels += 1;
        self.range = [self.range[0].min(shade.brightness), self.range[1].max(shade.brightness)];
        self.max_opacity = self.max_opacity.max(shade.opacity);
        if reading.mode == MapMode::Raw {
            self.raw_between += usize::from(reading.is_between_raw(shade.brightness));
            self.raw_beyond += usize::from(reading.is_beyond_raw(shade.brightness));
        }
        if shade.opacity < 1.0 {
            self.transparent += 1;
            return;
        }
        if reading.mode != MapMode::Raw {
            let is_other = reading.cell(shade.luma) != reading.cell(shade.brightness);
            self.colored += usize::from(is_other);
            self.at_threshold += usize::from(reading.is_at_threshold(shade.brightness));
        }
        match reading.cell(shade.brightness) {
            Cell::Wall => {}
            Cell::Unknown => self.opaque_between += 1,
            Cell::Free => {
                self.opaque_free += 1;
                if shade.brightness.fract() == 0.0 {
                    self.free_grays[shade.brightness as usize] += 1;
                }
            }
        }
    }

    /// Records pixels that the map servers of ROS 1 and of Nav2 read in different ways.
    fn record_choices(&self, reading: OccupancyRule, report: &mut ImportReport) {
        let colored = "colored pixels count by the mean of their channels as in ROS 1; Nav2 weighs the channels, and \
                       reads them as other cells";
        let at_threshold = "pixels whose occupancy is a threshold are unknown as in ROS 1; in Nav2 they are free or \
                            occupied";
        let raw = "values of the mode raw between 0 and 100 are compared with the thresholds, and map_server hands them on";
        let choices = [
            (self.colored, colored, "save the image in grays"),
            (self.at_threshold, at_threshold, "give the threshold another digit"),
            (self.raw_between, raw, "write 0, 100 and 255 alone for free, occupied and unknown"),
        ];
        for (count, rule, remedy) in choices.into_iter().filter(|(count, ..)| *count > 0) {
            report.findings.push(Finding {
                treatment: Treatment::Guessed,
                rule: format!("{rule} ({})", self.share(count)),
                count: count as u64,
                places: Vec::new(),
                remedy: remedy.to_string(),
            });
        }
        if reading.mode == MapMode::Raw && reading.negate {
            let rule = "`negate` turns the values of the mode raw around, as in ROS 1; Nav2 does not obey it";
            report.record(Treatment::Guessed, rule, "", "set `negate: 0`, and negate the image");
        }
    }

    /// Records values of the mode raw that no program writes: an image of grays is none of occupancies.
    fn record_grays_of_raw(&self, report: &mut ImportReport) {
        if self.raw_beyond == 0 {
            return;
        }
        report.findings.push(Finding {
            treatment: Treatment::Suspicious,
            rule: format!(
                "values of the mode raw from 101 to 254, which are unknown ({}); black is free in this mode",
                self.share(self.raw_beyond)
            ),
            count: self.raw_beyond as u64,
            places: Vec::new(),
            remedy: "set `mode: trinary` if dark pixels are walls".to_string(),
        });
    }

    /// Records shades that `map_server` gives an occupancy between free and occupied.
    fn record_shades(&self, mode: MapMode, report: &mut ImportReport) {
        if mode != MapMode::Scale || self.opaque_between == 0 {
            return;
        }
        report.findings.push(Finding {
            treatment: Treatment::NotUsed,
            rule: "shades between free and occupied of the mode scale, which are unknown"
                .to_string(),
            count: self.opaque_between as u64,
            places: Vec::new(),
            remedy: String::new(),
        });
    }

    /// Records grays between black and white that are read as free, and can hardly be meant so.
    fn record_grays(&self, thresholds: ThresholdSource, report: &mut ImportReport) {
        let reading = thresholds.reading();
        // In the mode raw values are no grays, and with `negate` free pixels are dark.
        if reading.mode == MapMode::Raw || reading.negate {
            return;
        }
        let min_count = (MIN_SUSPICIOUS_SHARE * self.pixels as f64).max(1.0);
        for (gray, &count) in self.free_grays.iter().enumerate().take(MIN_LIGHT_GRAY) {
            if (count as f64) < min_count {
                continue;
            }
            let meaning = match gray {
                UNKNOWN_GRAY => ", which map_saver writes for unknown,",
                _ => "",
            };
            let rule = format!(
                "pixels of the gray {gray}{meaning} are free, because free_thresh is {} ({})",
                reading.free_thresh,
                self.share(count)
            );
            let remedy = format!(
                "{} `free_thresh: {}` if they are unknown",
                thresholds.remedy(),
                thresh_above(gray)
            );
            let treatment = Treatment::Suspicious;
            let places = Vec::new();
            report.findings.push(Finding { treatment, rule, count: count as u64, places, remedy });
        }
    }

    /// Returns a number of pixels as a share of all.
    fn share(&self, pixels: usize) -> String {
        format!("{:.1} % of all pixels", 100.0 * pixels as f64 / self.pixels as f64)
    }
}

/// Records that no pixel is free, or none is occupied: such a map is of no use, and mostly read otherwise than meant.
fn record_single_kind(cells: &[Cell], survey: &Survey, report: &mut ImportReport) {
    let [darkest, lightest] = survey.range;
    for (cell, word) in [(Cell::Free, "free"), (Cell::Wall, "occupied")] {
        if cells.contains(&cell) {
            continue;
        }
        let rule = format!(
            "no pixel is {word}; the darkest has {darkest:.0} and the lightest {lightest:.0} of 255"
        );
        let remedy = "dark pixels have to be walls and light ones free; for the contrary set \
                      `negate: 1` in the .yaml file, and for values that do not reach from 0 to 255 \
                      stretch the contrast of the image";
        report.record(Treatment::Suspicious, rule, "", remedy);
    }
}

/// Returns the largest threshold of three digits under which a gray is not free, and lighter ones are; for the gray 205
/// the one that everybody uses.
fn thresh_above(gray: usize) -> f64 {
    let occupancy = (255 - gray) as f64 / 255.0;
    (occupancy * 1000.0).floor() / 1000.0
}

/// What the transparent pixels of an image stand for.
#[derive(Debug, Clone, Copy, PartialEq)]
enum TransparentGround {
    /// Only opacities are looked at, as by `map_server` in the mode `scale`.
    UnknownByFormat,
    /// The image shows free ground as well, so that what it leaves out is not free.
    Unknown,
    /// Nothing opaque is free: the image is a drawing in ink, which viewers show on white.
    Free,
    /// The mode `raw` has no transparency.
    NotUsed,
    /// All pixels are fully transparent, and have grays all the same.
    Unset,
}

impl TransparentGround {
    fn of(survey: &Survey, mode: MapMode) -> Self {
        let [darkest, lightest] = survey.range;
        match mode {
            // Nothing would be seen of the image at all: its program has not filled the channel in.
            MapMode::Trinary | MapMode::Scale
                if survey.max_opacity == 0.0 && darkest < lightest =>
            {
                Self::Unset
            }
            MapMode::Scale => Self::UnknownByFormat,
            MapMode::Raw => Self::NotUsed,
            MapMode::Trinary if survey.opaque_free > 0 => Self::Unknown,
            MapMode::Trinary => Self::Free,
        }
    }

    /// Returns the cell of a pixel. The edges of drawn lines are half transparent: such a pixel is an obstacle where
    /// it would be one on free ground.
    fn cell(self, shade: Shade, reading: OccupancyRule) -> Cell {
        let Shade { brightness, opacity, .. } = shade;
        if opacity >= 1.0 || [Self::NotUsed, Self::Unset].contains(&self) {
            return reading.cell(brightness);
        }
        let on_ground = opacity * brightness + (1.0 - opacity) * reading.ground_brightness();
        match (self, reading.cell(on_ground)) {
            (Self::UnknownByFormat, _) => Cell::Unknown,
            (Self::Unknown, Cell::Free) => Cell::Unknown,
            (_, cell) => cell,
        }
    }
}

fn record_transparency(survey: &Survey, ground: TransparentGround, report: &mut ImportReport) {
    if survey.transparent == 0 {
        return;
    }
    let share = survey.share(survey.transparent);
    report.add_fact("transparent pixels", format!("{} ({share})", survey.transparent));
    let (treatment, rule, remedy) = match ground {
        TransparentGround::UnknownByFormat => return,
        TransparentGround::Unknown => (
            Treatment::Guessed,
            format!("transparent pixels are unknown, because opaque ones are free ({share})"),
            "save the image without transparency, on a white ground, if they are free",
        ),
        TransparentGround::Free => (
            Treatment::Guessed,
            format!(
                "transparent pixels are free, because the image has nothing but ink on them ({share})"
            ),
            "save the image without transparency, on a gray ground (128), if they are unknown",
        ),
        TransparentGround::Unset => (
            Treatment::Guessed,
            "transparency does not count, because every pixel is fully transparent".to_string(),
            "save the image without transparency",
        ),
        TransparentGround::NotUsed => (
            Treatment::NotUsed,
            format!("the transparency of pixels, as in map_server's mode raw ({share})"),
            "",
        ),
    };
    let count = survey.transparent as u64;
    let remedy = remedy.to_string();
    report.findings.push(Finding { treatment, rule, count, places: Vec::new(), remedy });
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use super::*;
    use ::image::{ImageBuffer, Luma, LumaA, Rgb, Rgba};
    use Cell::{Free, Unknown, Wall};

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

    /// A map of one row of gray pixels with opacities.
    fn read_row(head: &str, pixels: &[[u8; 2]]) -> PixelMap {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let image = ImageBuffer::from_fn(pixels.len() as u32, 1, |x, _| LumaA(pixels[x as usize]));
        image.save(folder.path().join("a.png")).expect("written");
        let yaml = format!(
            "{head}\nimage: a.png\nresolution: 0.5\norigin: [1, 2, 0]\noccupied_thresh: 0.65\n\
             free_thresh: 0.196\n"
        );
        let path = folder.path().join("a.yaml");
        std::fs::write(&path, yaml).expect("written");
        load(&path).expect("a map")
    }

    fn findings(map: &PixelMap) -> Vec<String> {
        map.report().findings.iter().map(ToString::to_string).collect()
    }

    #[test]
    fn ink_on_a_transparent_ground_is_walls_on_free_ground() {
        // The ground of drawing programs is transparent black or transparent white.
        let drawing = ImageBuffer::from_fn(12, 8, |x, y| {
            let is_ink = (2..10).contains(&x) && (y == 1 || y == 6);
            Rgba([0u8, 0, 0, if is_ink { 255 } else { 0 }])
        });
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("plan.png");
        drawing.save(&path).expect("written");
        let map = load_image(&path, 0.05).expect("a map");
        let counts = map.counts();
        assert_eq!((counts.free, counts.wall, counts.unknown), (80, 16, 0));
        assert_eq!(
            findings(&map),
            [
                "guessed: transparent pixels are free, because the image has nothing but ink on them \
              (83.3 % of all pixels) (80 times); save the image without transparency, on a gray \
              ground (128), if they are unknown"
            ]
        );
        let row = read_row("negate: 0", &[[0, 255], [255, 0], [0, 0], [0, 200], [0, 20]]);
        assert_eq!(row.pixels(), [Wall, Free, Free, Wall, Free]);
        let light = read_row("negate: 1", &[[255, 255], [255, 0], [0, 0]]);
        assert_eq!(light.pixels(), [Wall, Free, Free]);
    }

    #[test]
    fn beside_free_pixels_transparent_ones_are_unknown() {
        let row =
            read_row("negate: 0", &[[0, 255], [254, 255], [127, 0], [0, 0], [0, 200], [0, 20]]);
        assert_eq!(row.pixels(), [Wall, Free, Unknown, Unknown, Wall, Unknown]);
        assert_eq!(
            findings(&row),
            [
                "guessed: transparent pixels are unknown, because opaque ones are free (66.7 % of all \
              pixels) (4 times); save the image without transparency, on a white ground, if they are \
              free"
            ]
        );
    }

    #[test]
    fn transparent_pixels_are_unknown_as_map_saver_writes_them_in_the_mode_scale() {
        // 0.5, transparent: the unknown of map_saver; the file says what it means.
        let row = read_row("mode: scale\nnegate: 0", &[[0, 255], [255, 255], [127, 0], [0, 254]]);
        assert_eq!(row.pixels(), [Wall, Free, Unknown, Unknown]);
        assert!(findings(&row).is_empty());
        let unexplored = read_row("mode: scale\nnegate: 0", &[[0, 255], [127, 0]]);
        assert_eq!(unexplored.pixels(), [Wall, Unknown]);
    }

    #[test]
    fn shades_and_keys_that_are_not_used_are_reported() {
        let row =
            read_row("frame_id: map\nmode: scale\nnegate: 0", &[[0, 255], [100, 255], [255, 255]]);
        assert_eq!(row.pixels(), [Wall, Unknown, Free]);
        assert_eq!(
            findings(&row),
            [
                "not used: the key `frame_id`, line 1",
                "not used: shades between free and occupied of the mode scale, which are unknown",
            ]
        );
    }

    #[test]
    fn the_mode_raw_has_no_transparency_and_the_report_says_so() {
        let row = read_row("mode: raw\nnegate: 0", &[[0, 0], [100, 0], [255, 0]]);
        assert_eq!(row.pixels(), [Free, Wall, Unknown]);
        assert_eq!(row.report().findings[0].treatment, Treatment::NotUsed);
    }

    #[test]
    fn pixels_that_ros_and_nav2_read_in_different_ways_are_said() {
        let raw = read_row("mode: raw\nnegate: 1", &[[255, 255], [205, 255], [155, 255]]);
        assert_eq!(raw.pixels(), [Free, Unknown, Wall]);
        let said = findings(&raw);
        assert!(
            said[0].starts_with("guessed: values of the mode raw between 0 and 100"),
            "{said:?}"
        );
        assert!(
            said[1].starts_with("guessed: `negate` turns the values of the mode raw"),
            "{said:?}"
        );
        let plain = read_row("mode: raw\nnegate: 0", &[[0, 255], [100, 255], [255, 255]]);
        assert_eq!(findings(&plain), [""; 0]);
        let folder = tempfile::tempdir().expect("a temporary folder");
        let row = |name: &str, pixels: &[[u8; 3]]| {
            let image =
                ImageBuffer::from_fn(pixels.len() as u32, 1, |x, _| Rgb(pixels[x as usize]));
            let path = folder.path().join(name);
            image.save(&path).expect("written");
            load_image(&path, 1.0).expect("a map")
        };
        // Red has the mean 85 and the weighted mean 54; both are walls. Green has 182.
        let red = row("red.png", &[[255, 0, 0], [255; 3]]);
        assert_eq!((red.pixels(), findings(&red)), (&[Wall, Free][..], Vec::new()));
        let green = row("green.png", &[[0, 255, 0], [255; 3]]);
        assert_eq!(green.pixels(), [Wall, Free]);
        assert!(findings(&green)[0].starts_with("guessed: colored pixels count by the mean"));
        let photo = row("photo.jpg", &[[0; 3], [0; 3], [255; 3], [255; 3]]);
        assert!(photo.report().facts[0].value.contains("JPEG"), "{:?}", photo.report());
    }

    #[test]
    fn an_occupancy_that_is_a_threshold_is_unknown_and_said() {
        let row = read_row("negate: 0", &[[0, 255], [255, 255]]);
        assert_eq!(findings(&row), [""; 0]);
        let (folder, path) = written("a.pgm", b"P5 1 2 255\n\xff\x00");
        let text = std::fs::read_to_string(&path).expect("written").replace("0.65", "1.0");
        std::fs::write(&path, text).expect("written");
        let map = load(&path).expect("a map");
        assert_eq!(map.pixels(), [Unknown, Free]);
        let said = findings(&map);
        assert!(said[0].starts_with("guessed: pixels whose occupancy is a threshold"), "{said:?}");
        drop(folder);
    }

    #[test]
    fn remedies_for_transparency_change_what_it_means() {
        let white = read_row("negate: 0", &[[0, 255], [254, 255], [255, 255]]);
        assert_eq!((white.pixels(), findings(&white).len()), (&[Wall, Free, Free][..], 0));
        let gray = read_row("negate: 0", &[[0, 255], [128, 255]]);
        assert_eq!(gray.pixels(), [Wall, Unknown]);
    }

    #[test]
    fn opaque_pixels_with_opacities_are_what_they_are_without_them() {
        let opaque = [[0, 255], [205, 255], [206, 255], [255, 255]];
        let row = read_row("negate: 0", &opaque);
        assert_eq!(row.pixels(), [Wall, Unknown, Free, Free]);
        let findings = findings(&row);
        assert!(!findings.iter().any(|found| found.starts_with("guessed")), "{findings:?}");
    }

    /// A map of one row of gray pixels under a `free_thresh`.
    fn read_grays(free_thresh: &str, grays: &[u8]) -> PixelMap {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let mut image = format!("P5 {} 1 255\n", grays.len()).into_bytes();
        image.extend_from_slice(grays);
        std::fs::write(folder.path().join("a.pgm"), image).expect("written");
        let yaml = format!(
            "image: a.pgm\nmode: trinary\nresolution: 0.05\norigin: [0, 0, 0]\nnegate: 0\n\
             occupied_thresh: 0.65\nfree_thresh: {free_thresh}\n"
        );
        let path = folder.path().join("a.yaml");
        std::fs::write(&path, yaml).expect("written");
        load(&path).expect("a map")
    }

    #[test]
    fn the_gray_of_unknown_that_the_default_of_nav2_makes_free_is_suspicious() {
        let grays = [[205; 16], [0; 16], [254; 16], [254; 16]].concat();
        let map = read_grays("0.25", &grays);
        assert_eq!(map.counts().free, 48, "as map_server reads it");
        assert_eq!(
            findings(&map),
            [
                "suspicious: pixels of the gray 205, which map_saver writes for unknown, are free, because \
              free_thresh is 0.25 (25.0 % of all pixels) (16 times); set `free_thresh: 0.196` if they \
              are unknown"
            ]
        );
        let corrected = read_grays("0.196", &grays);
        assert_eq!((corrected.counts().free, corrected.counts().unknown), (32, 16));
        assert!(findings(&corrected).is_empty());
    }

    #[test]
    fn another_gray_that_is_free_is_suspicious_where_it_is_no_accident() {
        let grays = [[216; 16], [0; 16], [254; 16], [254; 16]].concat();
        let map = read_grays("0.196", &grays);
        assert_eq!(
            findings(&map),
            [
                "suspicious: pixels of the gray 216 are free, because free_thresh is 0.196 (25.0 % of all \
              pixels) (16 times); set `free_thresh: 0.152` if they are unknown"
            ]
        );
        assert_eq!(read_grays("0.152", &grays).counts().unknown, 16);
        let noise = [vec![216, 0], vec![254; 198]].concat();
        assert!(findings(&read_grays("0.196", &noise)).is_empty());
    }

    #[test]
    fn the_threshold_that_is_advised_for_a_gray_makes_it_unknown_and_lighter_ones_free() {
        // Darker ones are occupied.
        for gray in 90..MIN_LIGHT_GRAY {
            let reading = OccupancyRule { free_thresh: thresh_above(gray), ..READING };
            assert_ne!(reading.cell(gray as f64), Free, "{gray}");
            assert_eq!(reading.cell(gray as f64 + 1.0), Free, "{gray}");
        }
    }

    #[test]
    fn an_image_of_16_bits_that_uses_few_of_them_is_suspicious() {
        // Values from 0 to 255 in 16 bits: as good as black.
        let image = ImageBuffer::from_fn(4, 1, |x, _| Luma([x as u16 * 85]));
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("a.png");
        image.save(&path).expect("written");
        let map = load_image(&path, 0.5).expect("a map");
        assert_eq!(map.counts().wall, 4);
        let found = findings(&map);
        assert_eq!(found.len(), 1, "{found:?}");
        assert!(
            found[0].starts_with(
                "suspicious: no pixel is free; the darkest has 0 and the lightest 1 of 255"
            ),
            "{found:?}"
        );
        let stretched = ImageBuffer::from_fn(4, 1, |x, _| Luma([x as u16 * 21845]));
        stretched.save(&path).expect("written");
        let map = load_image(&path, 0.5).expect("a map");
        assert_eq!(map.pixels(), [Wall, Wall, Unknown, Free]);
        assert!(findings(&map).is_empty());
    }

    #[test]
    fn a_map_without_walls_is_suspicious() {
        let found = findings(&read_grays("0.196", &[254; 8]));
        assert_eq!(found.len(), 1, "{found:?}");
        assert!(
            found[0].starts_with("suspicious: no pixel is occupied; the darkest has 254"),
            "{found:?}"
        );
    }

    #[test]
    fn an_image_whose_every_pixel_is_transparent_is_read_by_its_grays() {
        let row = read_row("negate: 0", &[[0, 0], [254, 0], [205, 0]]);
        assert_eq!(row.pixels(), [Wall, Free, Unknown]);
        assert!(
            findings(&row)[0].starts_with("guessed: transparency does not count"),
            "{:?}",
            findings(&row)
        );
        // Nothing at all is drawn.
        assert_eq!(read_row("negate: 0", &[[0, 0], [0, 0]]).pixels(), [Free, Free]);
    }

    #[test]
    fn an_image_of_grays_under_the_mode_raw_is_suspicious() {
        let row = read_row("mode: raw\nnegate: 0", &[[0, 255], [205, 255], [254, 255], [255, 255]]);
        assert_eq!(row.pixels(), [Free, Unknown, Unknown, Unknown], "as map_server reads it");
        let said = findings(&row);
        assert!(
            said[0].starts_with("suspicious: values of the mode raw from 101 to 254"),
            "{said:?}"
        );
    }

    #[test]
    fn bytes_behind_an_image_are_said() {
        let (_folder, path) = written("a.pgm", b"P5 1 2 255\n\xff\x00P5 1 2 255\n\xff\x00");
        let said = findings(&load(&path).expect("a map"));
        assert!(said[0].starts_with("not used: 13 bytes behind the pixels"), "{said:?}");
    }

    #[test]
    fn a_yaml_file_of_absurd_size_is_refused() {
        let (_folder, path) = written("a.pgm", IMAGE);
        std::fs::write(&path, "#".repeat(1 << 20)).expect("written");
        assert!(load(&path).is_err());
    }
}
