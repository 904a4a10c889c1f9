//! The files of a bag, and the messages in them in the order of the recording.
//!
//! Whatever the size of a bag, one record or chunk of it is in memory at a time, at most
//! [`MAX_RECORD_BYTES`](sink::MAX_RECORD_BYTES); SQLite reads its files page by page.

mod cut_file;
mod mcap;
mod metadata;
mod packed;
mod ros1;
mod sink;
mod sqlite;

use std::collections::BTreeMap;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use sidestep_kernel::InputError;

use self::metadata::{Metadata, path_within};
use self::packed::Unpacked;
use self::sink::Sink;
pub(super) use self::sink::{RawMessage, Topic};
use crate::report::ImportReport;

/// The files of a bag that was read, all of its topics, and what was found on the way.
pub(super) struct Storage {
    pub(super) topics: BTreeMap<String, Topic>,
    pub(super) report: ImportReport,
}

/// Calls `on_message` with every message on a topic that `is_read`, and returns all topics of the bag.
///
/// # Errors
/// When the bag is missing, damaged altogether or of another kind; those of `on_message`.
pub(super) fn read(
    path: &Path,
    is_read: &dyn Fn(&str) -> bool,
    on_message: &mut dyn FnMut(RawMessage<'_>) -> Result<(), InputError>,
) -> Result<Storage, InputError> {
    let files = BagFiles::find(path)?;
    let mut sink = Sink::new(is_read, on_message);
    for file in &files.paths {
        read_file(file, &mut sink)?;
    }
    for name in &files.missing {
        sink.damaged_part("files of the bag that are not there", name.clone());
    }
    let damage = sink.report.findings.first();
    if let (true, Some(damage)) = (sink.topics.is_empty(), damage) {
        let cause = format!(
            "nothing of the bag can be read: {}, {}",
            damage.rule,
            damage.places.join(", ")
        );
        let remedy = "copy it again if its original is whole, or give another bag";
        return Err(InputError::new(path.display(), cause, remedy));
    }
    let read: u64 = sink.topics.values().map(|topic| topic.messages).sum();
    if sink.lost_rows > read {
        let cause = format!(
            "more than half of its rows are on damaged pages: {read} can be read, and about {} cannot",
            sink.lost_rows
        );
        let remedy = "copy the bag again if its original is whole; what is left of a damaged file, `sqlite3 OLD.db3 .recover | \
                      sqlite3 NEW.db3` saves";
        return Err(InputError::new(path.display(), cause, remedy));
    }
    if sink.packed_messages > 0 {
        let value = format!("zstd, message by message ({} messages)", sink.packed_messages);
        sink.report.add_fact("compression", value);
    }
    files.check_counts(path, &sink.topics)?;
    Ok(Storage { topics: sink.topics, report: sink.report })
}

/// Reads one file, in the format that its first bytes tell.
fn read_file(path: &Path, sink: &mut Sink<'_>) -> Result<(), InputError> {
    let mut file = packed::open(path).map_err(|e| unreadable(path, &e))?;
    let name = path.display().to_string();
    let format = Format::from_head(&name, &file.head)?;
    if sink.report.format.is_empty() {
        sink.report.format = format.title().into();
    }
    if let Some(packing) = file.packing {
        sink.report.add_fact("compression", format!("{packing}, {name} as a whole"));
    }
    match format {
        Format::Mcap => mcap::read(&name, &mut *file.stream, sink),
        Format::Ros1 => ros1::read(&name, &mut *file.stream, sink),
        Format::Sqlite if file.packing.is_none() => sqlite::read(&name, path, sink),
        Format::Sqlite => {
            let unpacked = unpack_to_disk(&mut file).map_err(|e| unreadable(path, &e))?;
            sqlite::read(&name, unpacked.path(), sink)
        }
    }
}

/// Returns a temporary file with the content of a packed one: SQLite reads its pages in any order.
fn unpack_to_disk(file: &mut Unpacked) -> io::Result<tempfile::NamedTempFile> {
    let mut unpacked = tempfile::NamedTempFile::new()?;
    io::copy(&mut file.stream, &mut unpacked)?;
    unpacked.flush()?;
    Ok(unpacked)
}

/// The format of a bag of ROS 1 in reports.
pub(super) const ROS1_TITLE: &str = "bag of ROS 1";

/// The formats of files that bags consist of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Format {
    Mcap,
    Sqlite,
    Ros1,
}

impl Format {
    fn from_head(place: &str, head: &[u8]) -> Result<Self, InputError> {
        if head.starts_with(::mcap::MAGIC) {
            Ok(Self::Mcap)
        } else if head.starts_with(sqlite::MAGIC) {
            Ok(Self::Sqlite)
        } else if head.starts_with(ros1::MAGIC) {
            Ok(Self::Ros1)
        } else if head.starts_with(b"#ROSBAG") {
            let first_line = String::from_utf8_lossy(head);
            let version = first_line.lines().next().unwrap_or_default().escape_debug().to_string();
            let cause = format!("is a bag of ROS 1 of another version than 2.0: {version}");
            Err(InputError::new(
                place,
                cause,
                "give a bag of version 2.0, which ROS 1 has written since 2010",
            ))
        } else {
            let remedy = "give a bag of `ros2 bag record` (MCAP or SQLite) or of ROS 1 (.bag)";
            Err(InputError::new(place, "is no bag", remedy))
        }
    }

    fn title(self) -> &'static str {
        match self {
            Self::Mcap => "bag (MCAP)",
            Self::Sqlite => "bag of ROS 2 (SQLite)",
            Self::Ros1 => ROS1_TITLE,
        }
    }
}

/// The files of a bag, in the order of the recording.
#[derive(Debug, Default)]
struct BagFiles {
    paths: Vec<PathBuf>,
    /// Names of files that are listed and not there.
    missing: Vec<String>,
    /// The numbers of messages by topic that metadata give.
    counts: Vec<(String, u64)>,
}

impl BagFiles {
    /// Finds the files of a bag: the file itself, or those that the folder's `metadata.yaml` lists, or all in the folder.
    fn find(path: &Path) -> Result<Self, InputError> {
        if path.is_dir() {
            let metadata = path.join("metadata.yaml");
            return if metadata.is_file() {
                Self::listed(&metadata)
            } else {
                Self::in_folder(path)
            };
        }
        if path.extension().is_some_and(|extension| extension == "yaml") {
            return Self::listed(path);
        }
        Ok(Self { paths: vec![path.to_path_buf()], ..Self::default() })
    }

    fn listed(path: &Path) -> Result<Self, InputError> {
        let metadata = Metadata::read(path)?;
        let folder = path.parent().unwrap_or(Path::new(""));
        let mut files = Self { counts: metadata.topics, ..Self::default() };
        for name in metadata.files {
            match path_within(folder, &name) {
                Some(path) => files.paths.push(path),
                None => files.missing.push(name),
            }
        }
        if files.paths.is_empty() {
            let listed = files.missing.iter().take(3).cloned().collect::<Vec<_>>().join(", ");
            let cause = format!("none of the files that it lists is in its folder: {listed}");
            let remedy = "put the files of the bag beside metadata.yaml, or give one of them";
            return Err(InputError::new(path.display(), cause, remedy));
        }
        Ok(files)
    }

    /// Returns the files in a folder without `metadata.yaml`, in the order of their numbers.
    fn in_folder(folder: &Path) -> Result<Self, InputError> {
        let entries = std::fs::read_dir(folder).map_err(|e| unreadable(folder, &e))?;
        let names = entries.filter_map(|entry| entry.ok()?.file_name().into_string().ok());
        let mut names: Vec<String> = names.filter(|name| kind_of_name(name).is_some()).collect();
        // By length first: `hall_10.mcap` follows `hall_9.mcap`.
        names.sort_by(|a, b| (a.len(), a).cmp(&(b.len(), b)));
        let remedy = "give a folder of `ros2 bag record`, or a .mcap, .db3 or .bag file";
        let Some(first) = names.first() else {
            let cause = "the folder holds no .mcap, .db3 or .bag file";
            return Err(InputError::new(folder.display(), cause, remedy));
        };
        let other = names.iter().find(|name| kind_of_name(name) != kind_of_name(first));
        if let Some(other) = other {
            let cause = format!("the folder holds bags of two kinds: {first} and {other}");
            return Err(InputError::new(folder.display(), cause, "give one of the files"));
        }
        let missing = missing_names(&names);
        let paths = names.into_iter().map(|name| folder.join(name)).collect();
        Ok(Self { paths, missing, ..Self::default() })
    }

    /// Checks that at least half of the messages that metadata give were in the files.
    fn check_counts(
        &self,
        path: &Path,
        topics: &BTreeMap<String, Topic>,
    ) -> Result<(), InputError> {
        let listed: u64 = self.counts.iter().map(|(_, n)| n).sum();
        let stored: u64 = topics.values().map(|topic| topic.messages).sum();
        if stored >= listed.div_ceil(2) {
            return Ok(());
        }
        let cause =
            format!("{stored} of the {listed} messages that metadata.yaml gives are in the files");
        Err(InputError::new(
            path.display(),
            cause,
            "put all files of the bag beside metadata.yaml; delete metadata.yaml to read those that are there",
        ))
    }
}

/// Maximum number of files between two others that are missed.
const MAX_MISSING: u64 = 100;

/// Returns the files that are missing between others, by the numbers with which their names end: `hall_0.mcap`.
fn missing_names(names: &[String]) -> Vec<String> {
    let mut missing = Vec::new();
    for pair in names.windows(2) {
        let numbers = [numbered(&pair[0]), numbered(&pair[1])];
        let [Some((stem, before, ending)), Some((other, after, other_ending))] = numbers else {
            continue;
        };
        let is_series = (stem, ending) == (other, other_ending) && after > before;
        if is_series && after - before <= MAX_MISSING {
            missing.extend((before + 1..after).map(|n| format!("{stem}_{n}.{ending}")));
        }
    }
    missing
}

/// Splits the name of a file into the part before its number, the number, and the ending.
fn numbered(name: &str) -> Option<(&str, u64, &str)> {
    let (stem, ending) = name.split_once('.')?;
    let (stem, number) = stem.rsplit_once('_')?;
    // `hall_2026` beside `hall_2027` are two bags of two years, not parts of one; parts begin at 0.
    Some((stem, number.parse().ok().filter(|n| *n < 1000)?, ending))
}

/// Returns the ending of a bag's file, without that of its compression.
fn kind_of_name(name: &str) -> Option<&str> {
    let name = name.strip_suffix(".zstd").or(name.strip_suffix(".gz")).unwrap_or(name);
    let (_, ending) = name.rsplit_once('.')?;
    ["mcap", "db3", "bag"].contains(&ending).then_some(ending)
}

fn unreadable(path: &Path, error: &io::Error) -> InputError {
    let remedy = "check the path; relative ones start at the working directory";
    InputError::new(path.display(), format!("cannot be read: {error}"), remedy)
}
