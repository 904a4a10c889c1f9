//! Files of recorded traffic, by their names and their first bytes.

use super::columns::Layout;
use super::{base_station, so6};
use crate::extension::extension;
use crate::table::{CsvTable, data_lines};
use sidestep_scenario::file::read_start;
use std::path::Path;

/// Ends of names, without `.gz`, of files that hold recorded traffic.
const EXTENSIONS: [&str; 14] = [
    "csv", "tsv", "kml", "gpx", "json", "jsonl", "ndjson", "geojson", "parquet", "so6", "m1", "m3",
    "daa", "sbs",
];

/// Ends of names of files that may hold anything.
const OPEN_EXTENSIONS: [&str; 5] = ["txt", "dat", "log", "bst", ""];

/// Number of bytes by which a file is recognized: the names of a table's columns.
const START_BYTES: u64 = 4096;

/// Returns whether a file holds recorded traffic, by its name.
pub fn has_extension(file: &Path) -> bool {
    EXTENSIONS.contains(&extension(file).as_str())
}

/// Returns whether a file holds recorded traffic: by its name, or by its first lines where its name tells nothing.
pub fn is_traffic(file: &Path) -> bool {
    let extension = extension(file);
    if EXTENSIONS.contains(&extension.as_str()) {
        return true;
    }
    OPEN_EXTENSIONS.contains(&extension.as_str())
        && file.is_file()
        && read_start(file, START_BYTES)
            .is_ok_and(|start| begins_as_traffic(&String::from_utf8_lossy(&start)))
}

/// Returns whether a text begins as messages, segments, or a table with the columns of a track.
pub(crate) fn begins_as_traffic(start: &str) -> bool {
    let start = start.strip_prefix('\u{feff}').unwrap_or(start);
    if base_station::is_base_station(start) || so6::is_so6(start) {
        return true;
    }
    // The last line may be cut.
    let header: Vec<&str> = data_lines(start).take(3).map(|(_, line)| line).collect();
    let table = CsvTable::parse_recording(&"", &header.join("\n"));
    table.is_ok_and(|table| Layout::find("", table.header()).is_ok())
}
