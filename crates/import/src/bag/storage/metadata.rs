//! `metadata.yaml`, in which ROS 2 lists the files and topics of a bag.
//!
//! It is read as a stream of YAML events in any style; no tree is built whose depth a file could choose.

use std::path::{Component, Path, PathBuf};

use saphyr_parser::{Event, Parser};
use sidestep_kernel::InputError;
use sidestep_scenario::file::read_text;

/// Maximum size of the file in bytes; it lists topics and files.
const MAX_BYTES: u64 = 1 << 20;
/// Maximum depth of lists and mappings; a bag has six.
const MAX_DEPTH: usize = 32;
/// Maximum number of files of a bag.
const MAX_FILES: usize = 100_000;

/// What the file says.
#[derive(Debug, Default, PartialEq)]
pub(super) struct Metadata {
    /// The files of the bag, as they are listed.
    pub(super) files: Vec<String>,
    /// `message` or `file`; empty without compression.
    pub(super) compression_mode: String,
    pub(super) compression_format: String,
    /// Topics and the numbers of their messages.
    pub(super) topics: Vec<(String, u64)>,
}

impl Metadata {
    /// Reads the file.
    ///
    /// # Errors
    /// When it is no YAML, or lists no files.
    pub(super) fn read(path: &Path) -> Result<Self, InputError> {
        Self::parse(&path.display().to_string(), &read_text(path, MAX_BYTES)?)
    }

    pub(super) fn parse(place: &str, text: &str) -> Result<Self, InputError> {
        let mut metadata = Self::default();
        let mut path = KeyPath::default();
        let mut is_listed = false;
        for event in Parser::new_from_str(text) {
            let (event, _) = event.map_err(|error| {
                let marker = error.marker();
                let cause = format!("is no YAML: {}", error.info());
                InputError::new(place, cause, REMEDY).with_position(marker.line(), marker.col() + 1)
            })?;
            match event {
                Event::Scalar(text, ..) => metadata.add_scalar(&mut path, &text),
                // What an anchor stands for is not repeated: no list of files is one.
                Event::Alias(_) => metadata.add_scalar(&mut path, ""),
                Event::MappingStart(..) => path.start(Level::Mapping(None)),
                Event::SequenceStart(..) => {
                    is_listed |= path.is_at(&["relative_file_paths"]);
                    path.start(Level::List(0));
                }
                Event::MappingEnd | Event::SequenceEnd => path.end(),
                _ => {}
            }
            if path.0.len() > MAX_DEPTH || metadata.files.len() > MAX_FILES {
                return Err(InputError::new(place, "is no list of the files of a bag", REMEDY));
            }
        }
        if is_listed {
            return Ok(metadata);
        }
        Err(InputError::new(place, "it lists no `relative_file_paths`", REMEDY))
    }

    fn add_scalar(&mut self, path: &mut KeyPath, text: &str) {
        if path.takes_key() {
            path.set_key(text);
            return;
        }
        path.start_item();
        self.add_value(path, text);
        path.end_value();
    }

    fn add_value(&mut self, path: &KeyPath, value: &str) {
        if path.is_at(&["relative_file_paths", ""]) {
            self.files.push(value.into());
        } else if path.is_at(&["compression_mode"]) {
            self.compression_mode = value.to_lowercase();
        } else if path.is_at(&["compression_format"]) {
            self.compression_format = value.to_lowercase();
        } else if path.is_at(&["topics_with_message_count", "", "topic_metadata", "name"]) {
            self.last_topic(path).0 = value.into();
        } else if path.is_at(&["topics_with_message_count", "", "message_count"]) {
            self.last_topic(path).1 = value.parse().unwrap_or(0);
        }
    }

    /// Returns the topic of the item in the list where `path` is.
    fn last_topic(&mut self, path: &KeyPath) -> &mut (String, u64) {
        let n = path.item("topics_with_message_count");
        if self.topics.len() < n {
            self.topics.push((String::new(), 0));
        }
        self.topics.last_mut().expect("an item has begun")
    }
}

const REMEDY: &str = "delete metadata.yaml: all files in the folder are read without it, in the order of their numbers";

/// The keys that lead to the present value.
#[derive(Debug, Default)]
struct KeyPath(Vec<Level>);

#[derive(Debug)]
enum Level {
    /// A mapping, and its present key; `None` before one.
    Mapping(Option<String>),
    /// A list, and the number of items that have begun.
    List(usize),
}

impl KeyPath {
    fn takes_key(&self) -> bool {
        matches!(self.0.last(), Some(Level::Mapping(None)))
    }

    fn set_key(&mut self, text: &str) {
        if let Some(Level::Mapping(key)) = self.0.last_mut() {
            *key = Some(text.into());
        }
    }

    fn start(&mut self, level: Level) {
        self.start_item();
        self.0.push(level);
    }

    fn end(&mut self) {
        self.0.pop();
        // A list or mapping may be a key: no key of a bag is one.
        if self.takes_key() { self.set_key("") } else { self.end_value() }
    }

    fn start_item(&mut self) {
        if let Some(Level::List(n)) = self.0.last_mut() {
            *n += 1;
        }
    }

    fn end_value(&mut self) {
        if let Some(Level::Mapping(key)) = self.0.last_mut() {
            *key = None;
        }
    }

    /// Returns whether these keys are the last, at most one level below the top; an item of a list is `""`.
    fn is_at(&self, keys: &[&str]) -> bool {
        let names = |level: &Level| match level {
            Level::Mapping(key) => key.clone().unwrap_or_default(),
            Level::List(_) => String::new(),
        };
        let Some(above) = self.0.len().checked_sub(keys.len()) else { return false };
        above <= 1 && self.0[above..].iter().map(names).eq(keys.iter().copied())
    }

    /// Returns the number of the present item in the list under a key, from 1.
    fn item(&self, key: &str) -> usize {
        let under = |pair: &&[Level]| matches!(&pair[0], Level::Mapping(Some(name)) if name == key);
        match self.0.windows(2).find(under) {
            Some([_, Level::List(n)]) => *n,
            _ => 0,
        }
    }
}

/// Returns the file that a bag names, within its folder: the name below the folder, or the last part of a path that
/// leads elsewhere, as old recorders and moved folders have it. `None` where there is no such file.
pub(super) fn path_within(folder: &Path, name: &str) -> Option<PathBuf> {
    let named = Path::new(name);
    let last = named.file_name()?;
    let is_inside = named.components().all(|part| matches!(part, Component::Normal(_)));
    let below = is_inside.then(|| folder.join(named));
    let candidates = [below, Some(folder.join(last))].into_iter().flatten();
    // Recorders that compress whole files list some of them without the ending.
    let with_packed = candidates.flat_map(|path| {
        let packed = PathBuf::from(format!("{}.zstd", path.display()));
        [path, packed]
    });
    with_packed.into_iter().find(|path| path.is_file())
}

#[cfg(test)]
mod tests {
    use super::*;

    const BLOCK: &str = "rosbag2_bagfile_information:\n  compression_format: 'zstd'\n  compression_mode: MESSAGE\n  \
        files:\n  - path: other.mcap\n  relative_file_paths:\n  - a_0.mcap\n  - \"a_1.mcap\"\n  \
        topics_with_message_count:\n  - message_count: 60\n    topic_metadata:\n      name: /odom\n      \
        offered_qos_profiles: \"- history: 3\\n  depth: 0\"\n  - topic_metadata: {name: /scan}\n    \
        message_count: 7\n  message_count: 67\n";

    #[test]
    fn the_list_is_the_same_in_every_style_of_yaml() {
        let read = Metadata::parse("m", BLOCK).unwrap();
        assert_eq!(read.files, ["a_0.mcap", "a_1.mcap"]);
        assert_eq!((&*read.compression_mode, &*read.compression_format), ("message", "zstd"));
        assert_eq!(read.topics, [("/odom".into(), 60), ("/scan".into(), 7)]);
        let flow = "{rosbag2_bagfile_information: {relative_file_paths: [a_0.mcap, 'a_1.mcap']}}";
        assert_eq!(Metadata::parse("m", flow).unwrap().files, read.files);
        let json =
            r#"{"rosbag2_bagfile_information": {"relative_file_paths": ["a_0.mcap", "a_1.mcap"]}}"#;
        assert_eq!(Metadata::parse("m", json).unwrap().files, read.files);
    }

    #[test]
    fn what_lists_no_files_or_is_no_yaml_is_an_error() {
        for text in ["", "a: b\n", "relative_file_paths: x\n", "a: [\n", "\t- a"] {
            assert!(Metadata::parse("m", text).is_err(), "{text:?}");
        }
        let deep = format!("relative_file_paths: {}", "[".repeat(100_000));
        assert!(Metadata::parse("m", &deep).is_err());
    }

    #[test]
    fn a_path_stays_in_the_folder_of_the_bag() {
        let folder = tempfile::tempdir().unwrap();
        let inside = folder.path().join("bag");
        std::fs::create_dir(&inside).unwrap();
        std::fs::write(folder.path().join("secret.mcap"), "").unwrap();
        std::fs::write(inside.join("a.mcap"), "").unwrap();
        std::fs::write(inside.join("b.db3.zstd"), "").unwrap();
        let found = |name: &str| path_within(&inside, name);
        assert_eq!(found("../secret.mcap"), None);
        assert_eq!(found(&folder.path().join("secret.mcap").display().to_string()), None);
        for name in ["a.mcap", "bag/a.mcap", "/elsewhere/a.mcap"] {
            assert_eq!(found(name), Some(inside.join("a.mcap")), "{name}");
        }
        assert_eq!(found("b.db3"), Some(inside.join("b.db3.zstd")));
    }

    proptest::proptest! {
        #[test]
        fn any_text_is_metadata_or_an_error(text in "([a-z_]{0,8}[:\\[{,}\\]-]{0,3} ?\n? {0,4}&?\\*?){0,12}") {
            let _ = Metadata::parse("m", &text);
        }
    }
}
