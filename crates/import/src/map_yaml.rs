//! The YAML file of a ROS map: its keys, checked, each error with its position.

use std::path::{Path, PathBuf};

use saphyr::{LoadableYamlNode, MarkedYaml, Scalar, ScanError, YamlData};
use sidestep_kernel::InputError;
use sidestep_kernel::view::Isometry2;
use sidestep_map::Cell;

/// The maximum size of the YAML file in bytes; the keys take 150 bytes.
pub(super) const MAX_YAML_BYTES: u64 = 64 << 10;

/// The maximum length of a line in bytes. A list within a list starts further right, so the limit
/// bounds their depth, and with it the stack that the parser's recursive tree takes.
const MAX_LINE_BYTES: usize = 1000;

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
    /// Keys that mean nothing to `map_server`, each with its line.
    pub(super) unused_keys: Vec<(String, usize)>,
}

impl MapMetadata {
    /// Parses `text`; the image's path is relative to `folder`.
    pub(super) fn parse(place: &str, text: &str, folder: &Path) -> Result<Self, InputError> {
        let document = Document::parse(place, text)?;
        Ok(Self {
            resolution_m: document.resolution_m()?,
            plane: document.plane()?,
            reading: document.occupancy_rule()?,
            image: document.image(folder)?,
            unused_keys: document.unused_keys(),
        })
    }
}

/// The YAML file, with the positions of its values.
struct Document<'a> {
    place: &'a str,
    text: &'a str,
    root: MarkedYaml<'a>,
}

impl<'a> Document<'a> {
    fn parse(place: &'a str, text: &'a str) -> Result<Self, InputError> {
        check_line_lengths(place, text)?;
        let documents =
            MarkedYaml::load_from_str(text).map_err(|error| malformed(place, text, &error))?;
        match documents.into_iter().next() {
            Some(root) if root.data.is_mapping() => Ok(Self { place, text, root }),
            _ => Err(InputError::new(place, "is not a list of `key: value` lines", KEYS)),
        }
    }

    fn resolution_m(&self) -> Result<f64, InputError> {
        let value = self.value("resolution")?;
        let resolution_m = self.number(value, "resolution")?;
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
        match (value.data.as_bool(), number_of(value)) {
            (Some(negate), _) => Ok(negate),
            (None, Some(0.0)) => Ok(false),
            (None, Some(1.0)) => Ok(true),
            _ => Err(self.error(value, "`negate` is neither 0 nor 1", "write 0 or 1")),
        }
    }

    /// Returns the path of the image, or of the same name with `.gz` where only that exists.
    fn image(&self, folder: &Path) -> Result<PathBuf, InputError> {
        let value = self.value("image")?;
        let name = value.data.as_str().filter(|name| !name.is_empty()).ok_or_else(|| {
            self.error(value, "`image` is not a file name", "write the image's name, in quotes")
        })?;
        let plain = folder.join(name);
        let compressed = folder.join(format!("{name}.gz"));
        [plain, compressed].into_iter().find(|path| path.is_file()).ok_or_else(|| {
            let cause = format!("there is no image file `{}`", name.escape_debug());
            self.error(value, cause, "give the image's path, relative to this file's folder")
        })
    }

    fn unused_keys(&self) -> Vec<(String, usize)> {
        let mut unused = Vec::new();
        for (key, _) in self.root.data.as_mapping().into_iter().flatten() {
            let name = key.data.as_str().unwrap_or("a key that is no text");
            if !KNOWN_KEYS.contains(&name) {
                unused.push((name.to_string(), key.span.start.line()));
            }
        }
        unused
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
    InputError::new(place, format!("is not YAML: {}", error.info()), KEYS)
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
        let text = text.replace("map.rs", "map_yaml.rs");
        MapMetadata::parse("m.yaml", &text, &Path::new(env!("CARGO_MANIFEST_DIR")).join("src"))
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
        assert_eq!(meta.unused_keys, [("frame".to_string(), 4)]);
        assert_eq!(parse(YAML).expect("read").unused_keys, []);
        assert!(with("negate: 0", "negate: true").expect("read").reading.negate);
        assert!(!with("negate: 0", "negate: false").expect("read").reading.negate);
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
        assert_eq!(error("negate: 0", "negate: 2").line_and_column(), Some((4, 9)));
        assert_eq!(error("0.65", "65").line_and_column(), Some((5, 18)));
        assert_eq!(error("0.196", "0.7").line_and_column(), Some((6, 14)), "above occupied_thresh");
        assert_eq!(error("map.rs", "none.pgm").line_and_column(), Some((1, 8)));
        assert_eq!(error("map.rs", "''").line_and_column(), Some((1, 8)));
        assert_eq!(error("map.rs", "7").line_and_column(), Some((1, 8)));
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
        assert_eq!(parse("a: 1\nb: [1, 2\nc: }\n").expect_err("broken").place(), "m.yaml");
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
