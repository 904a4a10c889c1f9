//! The YAML file of a ROS map: its keys, checked, each error with its position.

use std::path::{Path, PathBuf};

use super::named_file::{allowed_folder, is_inside};
use super::report::{ImportReport, Treatment};
use saphyr::{LoadableYamlNode, MarkedYaml, Scalar, ScanError, YamlData};
use sidestep_kernel::InputError;
use sidestep_kernel::view::Isometry2;
use sidestep_map::Cell;

/// The maximum size of the YAML file in bytes; the keys take 150 bytes.
pub(super) const MAX_YAML_BYTES: u64 = 64 << 10;

/// The maximum length of a line in bytes. A list within a list starts further right, so the limit
/// bounds their depth, and with it the stack that the parser's recursive tree takes.
const MAX_LINE_BYTES: usize = 1000;

/// The largest side of a pixel in meters that is no mistake.
const MAX_PIXEL_M: f64 = 2.0;

/// The smallest side of a pixel in meters that is no mistake.
const MIN_PIXEL_M: f64 = 0.001;

/// The largest coordinate of the origin in meters: positions far from 0 lose their digits. Coordinates of countries have up to
/// 1e7 m.
const MAX_ORIGIN_M: f64 = 1e9;

/// The largest rotation of an image in radians: a whole turn, with room for rounding.
const MAX_YAW_RAD: f64 = std::f64::consts::TAU + 1e-3;

/// The content of the YAML file.
#[derive(Debug, PartialEq)]
pub(super) struct MapMetadata {
    /// The path of an image file that exists.
    pub(super) image: PathBuf,
    /// Side of a pixel in meters, positive.
    pub(super) resolution_m: f64,
    /// The lower-left corner of the image in the world, and the rotation of the image about it.
    pub(super) plane: Isometry2,
    /// The conversion of pixels into cells.
    pub(super) reading: OccupancyRule,
}

impl MapMetadata {
    /// Parses `text`, that of the file at `path`; the image's path is relative to its folder.
    pub(super) fn parse(
        path: &Path,
        text: &str,
        report: &mut ImportReport,
    ) -> Result<Self, InputError> {
        let place = path.display().to_string();
        let text = &with_blanks(text);
        let document = Document::parse(&place, text)?;
        document.record_unused_keys(report);
        Ok(Self {
            resolution_m: document.resolution_m(report)?,
            plane: document.plane()?,
            reading: document.occupancy_rule()?,
            image: document.image(path, report)?,
        })
    }
}

/// The YAML file, with the positions of its values.
struct Document<'a> {
    place: &'a str,
    text: &'a str,
    root: MarkedYaml<'a>,
    /// Number of documents behind it in the file.
    others: usize,
}

impl<'a> Document<'a> {
    fn parse(place: &'a str, text: &'a str) -> Result<Self, InputError> {
        check_line_lengths(place, text)?;
        let documents =
            MarkedYaml::load_from_str(text).map_err(|error| malformed(place, text, &error))?;
        let others = documents.len().saturating_sub(1);
        match documents.into_iter().next() {
            Some(root) if root.data.is_mapping() => Ok(Self { place, text, root, others }),
            _ => Err(InputError::new(place, "is not a list of `key: value` lines", KEYS)),
        }
    }

    fn resolution_m(&self, report: &mut ImportReport) -> Result<f64, InputError> {
        let value = self.value("resolution")?;
        let resolution_m = self.number(value, "resolution")?;
        if resolution_m > 0.0 && resolution_m < MIN_PIXEL_M {
            let rule = format!("pixels of {resolution_m} m, smaller than a millimeter");
            let remedy = "`resolution` is the side of a pixel in meters, such as 0.05";
            let line = format!("line {}", value.span.start.line());
            report.record(Treatment::Suspicious, rule, line, remedy);
        }
        if resolution_m > MAX_PIXEL_M {
            let rule = format!("pixels of {resolution_m} m");
            let remedy = "`resolution` is the side of a pixel in meters, such as 0.05";
            let line = format!("line {}", value.span.start.line());
            report.record(Treatment::Suspicious, rule, line, remedy);
        }
        if resolution_m > 0.0 {
            return Ok(resolution_m);
        }
        let cause = format!("a resolution of {resolution_m} m per pixel");
        Err(self.error(value, cause, "give the side of a pixel in meters, such as 0.05"))
    }

    fn plane(&self) -> Result<Isometry2, InputError> {
        let value = self.value("origin")?;
        let Some([x, y, yaw]) = value.data.as_sequence().map(Vec::as_slice) else {
            let remedy = "write `origin: [x, y, yaw]` in meters and radians";
            return Err(self.error(value, "`origin` is not a list of three numbers", remedy));
        };
        let origin_m = [self.number(x, "origin")?, self.number(y, "origin")?];
        for (value, coordinate_m) in [(x, origin_m[0]), (y, origin_m[1])] {
            if coordinate_m.abs() > MAX_ORIGIN_M {
                let cause = format!("an origin {coordinate_m:e} m away");
                return Err(self.error(value, cause, "give meters, at most 1e9"));
            }
        }
        let yaw_rad = self.number(yaw, "origin")?;
        if yaw_rad.abs() > MAX_YAW_RAD {
            let cause = format!("an origin yaw of {yaw_rad} rad, more than a turn");
            return Err(self.error(
                yaw,
                cause,
                "write radians from -6.2832 to 6.2832, not degrees",
            ));
        }
        // Adding 0 turns a negative zero into a positive one, whose digits would differ in files.
        Ok(Isometry2 { origin_m, yaw_rad: yaw_rad + 0.0 })
    }

    fn occupancy_rule(&self) -> Result<OccupancyRule, InputError> {
        let (occupied_thresh, _) = self.threshold("occupied_thresh")?;
        let (free_thresh, free_value) = self.threshold("free_thresh")?;
        if free_thresh > occupied_thresh {
            let cause = format!("free_thresh {free_thresh} is above {occupied_thresh}");
            let remedy = "give a free_thresh that is not above occupied_thresh";
            return Err(self.error(free_value, cause, remedy));
        }
        Ok(OccupancyRule {
            mode: self.mode()?,
            negate: self.negate()?,
            occupied_thresh,
            free_thresh,
        })
    }

    fn threshold(&self, key: &str) -> Result<(f64, &MarkedYaml<'a>), InputError> {
        let value = self.value(key)?;
        let threshold = self.number(value, key)?;
        if (0.0..=1.0).contains(&threshold) {
            return Ok((threshold, value));
        }
        let cause = format!("`{key}` is {threshold}");
        Err(self.error(value, cause, "give a probability from 0 to 1, such as 0.65"))
    }

    fn mode(&self) -> Result<MapMode, InputError> {
        let Some(value) = self.root.data.as_mapping_get("mode") else {
            return Ok(MapMode::Trinary);
        };
        match value.data.as_str() {
            Some("trinary") => Ok(MapMode::Trinary),
            Some("scale") => Ok(MapMode::Scale),
            Some("raw") => Ok(MapMode::Raw),
            _ => Err(self.error(value, "not a mode", "write trinary, scale or raw")),
        }
    }

    fn negate(&self) -> Result<bool, InputError> {
        let value = self.value("negate")?;
        // The words of YAML 1.1, which map_server reads.
        let word = value.data.as_str().unwrap_or_default().to_ascii_lowercase();
        match (value.data.as_bool(), number_of(value), word.as_str()) {
            (Some(negate), ..) => Ok(negate),
            (None, Some(0.0), _) | (None, None, "no" | "off" | "n" | "false") => Ok(false),
            (None, Some(1.0), _) | (None, None, "yes" | "on" | "y" | "true") => Ok(true),
            _ => Err(self.error(value, "`negate` is neither 0 nor 1", "write 0 or 1")),
        }
    }

    /// Returns the path of the image, or of the same name with `.gz` where only that exists. An image that lies elsewhere,
    /// or no longer does, is searched for beside the file: `map_saver` writes whole paths of the robot it runs on.
    fn image(&self, path: &Path, report: &mut ImportReport) -> Result<PathBuf, InputError> {
        let value = self.value("image")?;
        let name = value.data.as_str().filter(|name| !name.is_empty()).ok_or_else(|| {
            self.error(value, "`image` is not a file name", "write the image's name, in quotes")
        })?;
        let folder = path.parent().unwrap_or(Path::new(""));
        let named = with_gz(folder, name);
        if let Some(image) = &named
            && is_inside(image, &allowed_folder(path))
        {
            return Ok(image.clone());
        }
        let own_name = name.rsplit(['/', '\\']).next().unwrap_or(name);
        let shown = name.escape_debug();
        if let Some(beside) = with_gz(folder, own_name) {
            let why = if named.is_some() { "lies elsewhere" } else { "is not there" };
            let rule = format!("the image `{shown}` {why}, and the one beside the file is read");
            let line = format!("line {}", value.span.start.line());
            report.record(Treatment::Guessed, rule, line, "write its name without a folder");
            return Ok(beside);
        }
        if named.is_some() {
            let cause = format!("the image `{shown}` is outside of the map's folder");
            let remedy = "copy the image beside this file, and write its name without a folder";
            return Err(self.error(value, cause, remedy));
        }
        if let Some(other) = in_other_case(folder, own_name) {
            let found = other.file_name().unwrap_or_default().display().to_string();
            let rule =
                format!("there is no image `{shown}`, and `{}` is read", found.escape_debug());
            let line = format!("line {}", value.span.start.line());
            report.record(Treatment::Guessed, rule, line, "write the name as the file has it");
            return Ok(other);
        }
        let cause = format!("there is no image file `{shown}`");
        Err(self.error(value, cause, "give the image's path, relative to this file's folder"))
    }

    /// Records keys that mean nothing to `map_server`.
    fn record_unused_keys(&self, report: &mut ImportReport) {
        if self.others > 0 {
            let rule = format!("{} YAML documents behind the first", self.others);
            report.record(Treatment::NotUsed, rule, "", "give each map a file of its own");
        }
        for (key, _) in self.root.data.as_mapping().into_iter().flatten() {
            let name = key.data.as_str().unwrap_or("a key that is no text");
            if !KNOWN_KEYS.contains(&name) {
                let rule = format!("the key `{}`", name.escape_debug());
                let line = format!("line {}", key.span.start.line());
                report.record(Treatment::NotUsed, rule, line, "");
            }
        }
    }

    fn value(&self, key: &str) -> Result<&MarkedYaml<'a>, InputError> {
        self.root
            .data
            .as_mapping_get(key)
            .ok_or_else(|| InputError::new(self.place, format!("the key `{key}` is missing"), KEYS))
    }

    fn number(&self, value: &MarkedYaml<'a>, key: &str) -> Result<f64, InputError> {
        number_of(value).ok_or_else(|| {
            let cause = format!("`{key}` has a value that is not a finite number");
            self.error(value, cause, "write a number")
        })
    }

    fn error(&self, value: &MarkedYaml<'a>, cause: impl Into<String>, remedy: &str) -> InputError {
        let offset = byte_offset(self.text, value.span.start.index());
        InputError::new(self.place, cause, remedy).with_byte_offset(self.text, offset)
    }
}

const KNOWN_KEYS: [&str; 7] =
    ["image", "resolution", "origin", "negate", "occupied_thresh", "free_thresh", "mode"];

const KEYS: &str = "write the keys image, resolution, origin, negate, occupied_thresh and \
                    free_thresh, and mode if you like";

/// Returns the path of a file in a folder, or of the same name with `.gz`, if one of them is there.
fn with_gz(folder: &Path, name: &str) -> Option<PathBuf> {
    [folder.join(name), folder.join(format!("{name}.gz"))].into_iter().find(|path| path.is_file())
}

/// Returns the only file of a folder whose name differs from this in its case alone.
fn in_other_case(folder: &Path, name: &str) -> Option<PathBuf> {
    let folder = if folder == Path::new("") { Path::new(".") } else { folder };
    let is_same = |path: &PathBuf| {
        let own = path.file_name().and_then(|own| own.to_str());
        own.is_some_and(|own| own.eq_ignore_ascii_case(name))
    };
    let entries = folder.read_dir().ok()?.filter_map(|entry| Some(entry.ok()?.path()));
    let mut found = entries.filter(|path| is_same(path) && path.is_file());
    let first = found.next()?;
    found.next().is_none().then(|| folder.join(first.file_name().unwrap_or_default()))
}

/// Returns a value as a finite number; also in quotes, as `map_server` accepts it.
fn number_of(value: &MarkedYaml<'_>) -> Option<f64> {
    let YamlData::Value(scalar) = &value.data else { return None };
    let number = match scalar {
        Scalar::Integer(number) => *number as f64,
        Scalar::FloatingPoint(number) => number.into_inner(),
        Scalar::String(text) => text.trim().parse().ok()?,
        Scalar::Boolean(_) | Scalar::Null => return None,
    };
    number.is_finite().then_some(number)
}

/// Returns a text with blanks in place of tabs behind colons, as `map_server` reads them and the parser here does not;
/// positions stay the same.
fn with_blanks(text: &str) -> String {
    let mut is_behind_colon = false;
    text.chars()
        .map(|character| {
            let is_blank = is_behind_colon && character == '\t';
            is_behind_colon =
                character == ':' || is_behind_colon && [' ', '\t'].contains(&character);
            if is_blank { ' ' } else { character }
        })
        .collect()
}

fn check_line_lengths(place: &str, text: &str) -> Result<(), InputError> {
    match text.lines().position(|line| line.len() > MAX_LINE_BYTES) {
        None => Ok(()),
        Some(line) => {
            let cause = format!("a line of more than {MAX_LINE_BYTES} bytes");
            Err(InputError::new(place, cause, KEYS).with_position(line + 1, MAX_LINE_BYTES + 1))
        }
    }
}

fn malformed(place: &str, text: &str, error: &ScanError) -> InputError {
    let is_double = error.info().contains("duplicated key");
    let remedy = if is_double { "write each key once" } else { KEYS };
    InputError::new(place, format!("is not YAML: {}", error.info()), remedy)
        .with_byte_offset(text, byte_offset(text, error.marker().index()))
}

/// Converts the parser's position, counted in characters, to bytes.
fn byte_offset(text: &str, index: usize) -> usize {
    text.char_indices().nth(index).map_or(text.len(), |(offset, _)| offset)
}

/// The meaning of a pixel's brightness; see [`super::rosmap`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum MapMode {
    Trinary,
    Scale,
    Raw,
}

/// The rule by which a brightness is read as a cell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct OccupancyRule {
    pub(super) mode: MapMode,
    pub(super) negate: bool,
    pub(super) occupied_thresh: f64,
    pub(super) free_thresh: f64,
}

impl OccupancyRule {
    /// The reading of most ROS maps, and of images without a YAML file.
    pub(super) const DEFAULT: Self =
        Self { mode: MapMode::Trinary, negate: false, occupied_thresh: 0.65, free_thresh: 0.196 };

    /// Returns whether the occupancy of a brightness is one of the thresholds, where ROS 1 and Nav2 differ.
    pub(super) fn is_at_threshold(&self, brightness: f64) -> bool {
        let shade = if self.negate { brightness } else { 255.0 - brightness };
        let occupancy = shade / 255.0;
        occupancy == self.occupied_thresh || occupancy == self.free_thresh
    }

    /// Returns whether a raw value is unknown, and not the 255 that programs write for unknown.
    pub(super) fn is_beyond_raw(&self, brightness: f64) -> bool {
        let value = if self.negate { 255.0 - brightness } else { brightness };
        (101.0..255.0).contains(&value)
    }

    /// Returns whether a raw value is neither free, occupied nor unknown by itself, so that the thresholds decide.
    pub(super) fn is_between_raw(&self, brightness: f64) -> bool {
        let value = if self.negate { 255.0 - brightness } else { brightness };
        (1.0..100.0).contains(&value)
    }

    pub(super) fn cell(&self, brightness: f64) -> Cell {
        let shade = if self.negate { brightness } else { 255.0 - brightness };
        match self.mode {
            MapMode::Trinary | MapMode::Scale => self.occupancy_cell(shade / 255.0),
            MapMode::Raw => self.raw_cell(255.0 - shade),
        }
    }

    /// `map_server` stores a raw value as a whole number; 101 to 255 mean unknown.
    fn raw_cell(&self, value: f64) -> Cell {
        let percent = value.floor();
        if percent > 100.0 { Cell::Unknown } else { self.occupancy_cell(percent / 100.0) }
    }

    /// Returns the brightness of ground that nothing was drawn on.
    pub(super) fn ground_brightness(&self) -> f64 {
        if self.negate { 0.0 } else { 255.0 }
    }

    fn occupancy_cell(&self, occupancy: f64) -> Cell {
        if occupancy > self.occupied_thresh {
            Cell::Wall
        } else if occupancy < self.free_thresh {
            Cell::Free
        } else {
            Cell::Unknown
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const YAML: &str = "image: map.rs
resolution: 0.05
origin: [-1.5, 2, 0.]
negate: 0
occupied_thresh: 0.65
free_thresh: 0.196
";

    /// The metadata of `text`, with this crate's sources for images.
    fn parse(text: &str) -> Result<MapMetadata, InputError> {
        parse_with_report(text).map(|(meta, _)| meta)
    }

    fn parse_with_report(text: &str) -> Result<(MapMetadata, Vec<String>), InputError> {
        let text = text.replace("map.rs", "map_yaml.rs");
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/m.yaml");
        let mut report = ImportReport::new("test");
        let meta = MapMetadata::parse(&path, &text, &mut report)?;
        Ok((meta, report.findings.iter().map(ToString::to_string).collect()))
    }

    /// The metadata of the usual file with one piece of it replaced.
    fn with(old: &str, new: &str) -> Result<MapMetadata, InputError> {
        assert!(YAML.contains(old), "{old}");
        parse(&YAML.replace(old, new))
    }

    fn error(old: &str, new: &str) -> InputError {
        with(old, new).expect_err(new)
    }

    #[test]
    fn the_six_keys_are_read_and_the_mode_is_trinary() {
        let meta = parse(YAML).expect("read");
        let plane = Isometry2 { origin_m: [-1.5, 2.0], yaw_rad: 0.0 };
        assert_eq!((meta.resolution_m, meta.plane), (0.05, plane));
        assert!(meta.image.ends_with("src/map_yaml.rs"));
        let expected = OccupancyRule {
            mode: MapMode::Trinary,
            negate: false,
            occupied_thresh: 0.65,
            free_thresh: 0.196,
        };
        assert_eq!(meta.reading, expected);
    }

    #[test]
    fn numbers_may_lack_digits_on_either_side_of_the_point_and_stand_in_quotes() {
        let origin = |text| with("[-1.5, 2, 0.]", text).map(|meta| meta.plane.origin_m);
        assert_eq!(origin("[-.5, 2., .0]"), Ok([-0.5, 2.0]));
        assert_eq!(origin("[1e1, +3, -0.0]"), Ok([10.0, 3.0]));
        assert_eq!(origin("\n- 1\n- '2'\n- 0"), Ok([1.0, 2.0]));
    }

    #[test]
    fn comments_unknown_keys_and_boolean_negation_are_tolerated() {
        let meta = with("negate: 0", "frame: map\nnegate: 1   # white is occupied").expect("read");
        assert!(meta.reading.negate);
        let unused = YAML.replace("negate: 0", "frame: map\nnegate: 0");
        assert_eq!(
            parse_with_report(&unused).expect("read").1,
            ["not used: the key `frame`, line 4"]
        );
        assert_eq!(parse_with_report(YAML).expect("read").1, [""; 0]);
        for word in ["true", "yes", "On", "'1'", "1.0", "TRUE", "y"] {
            assert!(with("negate: 0", &format!("negate: {word}")).expect(word).reading.negate);
        }
        for word in ["false", "no", "OFF", "'0'", "False", "n"] {
            assert!(!with("negate: 0", &format!("negate: {word}")).expect(word).reading.negate);
        }
    }

    #[test]
    fn the_three_modes_are_read_and_no_other() {
        let mode = |name: &str| {
            with("negate: 0", &format!("mode: {name}\nnegate: 0")).map(|meta| meta.reading.mode)
        };
        assert_eq!(mode("trinary"), Ok(MapMode::Trinary));
        assert_eq!(mode("scale"), Ok(MapMode::Scale));
        assert_eq!(mode("'raw'"), Ok(MapMode::Raw));
        assert_eq!(mode("Binary").expect_err("no mode").line_and_column(), Some((4, 7)));
    }

    #[test]
    fn a_map_may_be_turned_about_its_origin() {
        for (text, yaw_rad) in [("0.]", 0.0), ("-0.0]", 0.0), ("3.1]", 3.1), ("-1.570]", -1.57)] {
            assert_eq!(
                with("0.]", text).expect(text).plane.yaw_rad.to_bits(),
                f64::to_bits(yaw_rad)
            );
        }
        let degrees = error("0.]", "90]");
        assert_eq!(degrees.line_and_column(), Some((3, 19)));
        assert!(degrees.remedy().contains("not degrees"), "{degrees}");
    }

    #[test]
    fn a_wrong_value_is_pointed_at() {
        for wrong in ["0", "-0.05", ".nan", ".inf", "fine", "[1]", ""] {
            assert_eq!(error("0.05", wrong).line_and_column().map(|p| p.0), Some(2), "{wrong}");
        }
        assert_eq!(error("0.05", "-1").line_and_column(), Some((2, 13)));
        for wrong in ["[1, 2]", "[1, 2, 3, 4]", "0", "[a, 2, 0]", "[1, .inf, 0]", "[1, 2, .nan]"] {
            assert_eq!(
                error("[-1.5, 2, 0.]", wrong).line_and_column().map(|p| p.0),
                Some(3),
                "{wrong}"
            );
        }
        for wrong in ["2", "-1", "not", "[]", ""] {
            let error = error("negate: 0", &format!("negate: {wrong}"));
            assert_eq!(error.line_and_column().map(|p| p.0), Some(4), "{wrong}");
        }
        assert_eq!(error("0.65", "65").line_and_column(), Some((5, 18)));
        assert_eq!(error("0.196", "0.7").line_and_column(), Some((6, 14)), "above occupied_thresh");
        assert_eq!(error("map.rs", "none.pgm").line_and_column(), Some((1, 8)));
        assert_eq!(error("map.rs", "''").line_and_column(), Some((1, 8)));
        assert_eq!(error("map.rs", "7").line_and_column(), Some((1, 8)));
    }

    #[test]
    fn an_image_that_lies_elsewhere_or_nowhere_is_searched_for_beside_the_file() {
        let beside = |name: &str| {
            let (meta, said) = parse_with_report(&YAML.replace("map.rs", name)).expect(name);
            assert!(meta.image.ends_with("src/lib.rs"), "{:?}", meta.image);
            said
        };
        assert_eq!(beside("./lib.rs"), [""; 0]);
        assert_eq!(beside("../src/lib.rs"), [""; 0]);
        let whole = format!("{}/src/lib.rs", env!("CARGO_MANIFEST_DIR"));
        assert_eq!(beside(&whole), [""; 0]);
        let guessed = "guessed: the image `/robot/maps/lib.rs` is not there, and the one beside the file is read, \
                       line 1; write its name without a folder";
        assert_eq!(beside("/robot/maps/lib.rs"), [guessed]);
        assert!(beside("C:\\maps\\lib.rs")[0].contains("is not there"));
        assert!(beside("../../kernel/src/lib.rs")[0].contains("lies elsewhere"));
        let outside = error("map.rs", "../../kernel/src/world.rs");
        assert!(outside.cause().contains("outside of the map's folder"), "{outside}");
    }

    #[test]
    fn an_image_whose_name_has_another_case_is_the_one_that_there_is() {
        let (meta, said) = parse_with_report(&YAML.replace("map.rs", "LIB.RS")).expect("read");
        assert!(meta.image.ends_with("src/lib.rs"), "{:?}", meta.image);
        assert!(
            said[0].starts_with("guessed: there is no image `LIB.RS`, and `lib.rs` is read"),
            "{said:?}"
        );
    }

    #[test]
    fn tabs_behind_colons_are_blanks_and_a_key_that_is_there_twice_is_named() {
        let plain = parse(YAML).expect("read");
        assert_eq!(parse(&YAML.replace(": ", ":\t")), Ok(plain));
        let twice = parse(&format!("{YAML}resolution: 0.1\n")).expect_err("twice");
        assert_eq!(
            (twice.line_and_column(), twice.remedy()),
            (Some((7, 1)), "write each key once")
        );
    }

    #[test]
    fn what_is_hardly_meant_is_said() {
        let said = |text: String| parse_with_report(&text).expect("read").1.join("\n");
        assert!(
            said(format!("{YAML}---\nresolution: 1\n"))
                .contains("1 YAML documents behind the first")
        );
        assert!(
            said(YAML.replace("0.05", "0.00005")).starts_with("suspicious: pixels of 0.00005 m")
        );
        assert_eq!(error("[-1.5, 2, 0.]", "[0, 1e12, 0]").line_and_column(), Some((3, 13)));
    }

    #[test]
    fn pixels_as_large_as_rooms_are_said() {
        let (_, said) = parse_with_report(&YAML.replace("0.05", "5")).expect("read");
        assert!(said[0].starts_with("suspicious: pixels of 5 m, line 2"), "{said:?}");
    }

    #[test]
    fn a_missing_key_is_named() {
        for line in YAML.lines() {
            let error = error(line, "");
            let key = line.split(':').next().expect("a key");
            assert!(error.cause().contains(&format!("`{key}`")), "{error}");
        }
    }

    #[test]
    fn text_that_is_no_mapping_or_no_yaml_is_an_error() {
        for text in ["", "# nothing\n", "- 1\n", "text", "a: [1", "a: 1\na: 2\n", "\ta: 1", "*x"] {
            assert!(parse(text).is_err(), "{text:?}");
        }
        assert!(parse("a: 1\nb: [1, 2\nc: }\n").expect_err("broken").place().ends_with("m.yaml"));
    }

    #[test]
    fn deep_nesting_up_to_the_limits_is_no_stack_overflow() {
        let on_one_line = |piece: &str| piece.repeat(MAX_LINE_BYTES / piece.len());
        let indented: String = (0..350).map(|depth| format!("{:depth$}a:\n", "")).collect();
        assert!(indented.len() as u64 <= MAX_YAML_BYTES);
        for text in [on_one_line("["), on_one_line("- "), on_one_line("? "), indented] {
            assert!(parse(&text).is_err());
        }
        let long = parse(&"- ".repeat(MAX_LINE_BYTES)).expect_err("a long line");
        assert_eq!(long.line_and_column(), Some((1, MAX_LINE_BYTES + 1)));
    }

    proptest! {
        #[test]
        fn no_text_panics_the_reader(
            head in prop_oneof![Just(YAML), Just("image: map.rs\norigin: "), Just("")],
            pieces in proptest::collection::vec(
                prop_oneof![
                    Just("\n"), Just(" "), Just("image"), Just(": "), Just("["), Just("]"), Just(","),
                    Just("{"), Just("}"), Just("0.05"), Just("- "), Just("? "), Just("'"), Just("\""),
                    Just("# "), Just("&a "), Just("*a "), Just("!!float "), Just("|\n"), Just("\t"),
                    Just("é"), Just("---\n"), Just("%YAML 1.2\n"), Just("\\x"), Just("<<: "),
                ],
                0..40,
            ),
        ) {
            let _ = parse(&(head.to_owned() + &pieces.concat())).is_ok();
        }
    }

    #[test]
    fn columns_are_right_behind_characters_of_many_bytes() {
        let text = YAML.replace("image", "# Größe é\nimage").replace("0.65", "'é'");
        assert_eq!(parse(&text).expect_err("no number").line_and_column(), Some((6, 18)));
    }
}
