//! Bags of ROS 2 in SQLite (`.db3`), row by row; rows on damaged pages are skipped.
//!
//! SQLite itself reads the file, page by page and without a change to it. What the file defines beside the two tables
//! of a bag (views, virtual tables, functions in them) is not run.

use std::collections::BTreeMap;
use std::ops::Range;
use std::path::Path;

use rusqlite::limits::Limit;
use rusqlite::types::ValueRef;
use rusqlite::{Connection, OpenFlags};
use sidestep_kernel::InputError;

use super::cut_file::{MAX_COPY_BYTES, completed_copy, has_journal, whole_length};
use super::sink::{MAX_RECORD_BYTES, Sink, Topic, ros2_name};
use crate::report::Treatment;

/// The first bytes of a file.
pub(super) const MAGIC: &[u8] = b"SQLite format 3\0";

/// Only data are read: no function of a trusted schema is called, and damage of a page is found.
const SETTINGS: &str =
    "PRAGMA trusted_schema = OFF; PRAGMA cell_size_check = ON; PRAGMA query_only = ON;";

/// Hands the topics and messages of a file to `sink`; `file` is its name for people.
///
/// # Errors
/// When it is no bag; those of the sink.
pub(super) fn read(file: &str, path: &Path, sink: &mut Sink<'_>) -> Result<(), InputError> {
    let completed = match whole_length(path).ok().flatten() {
        Some(whole) => {
            sink.cut_off(file);
            Some(completed_copy(file, path, [whole, MAX_COPY_BYTES])?)
        }
        None => None,
    };
    let path = completed.as_ref().map_or(path, |copy| copy.path());
    let opened = open(path).and_then(|opened| Ok((read_topics(&opened.database)?, opened)));
    let (topics, Opened { database, is_alone }) = opened.map_err(|error| {
        let cause = format!("is no readable bag in SQLite: {error}");
        let remedy = "give a bag of `ros2 bag record`; what is left of a damaged one, `sqlite3 OLD.db3 .recover | sqlite3 \
                      NEW.db3` saves";
        InputError::new(file, cause, remedy)
    })?;
    if is_alone && has_journal(path) {
        let rule =
            "a journal beside the file, which may hold its last messages and cannot be read here";
        let remedy = "copy the file and its journal into a folder that may be written to";
        sink.report.record(Treatment::Suspicious, rule, file, remedy);
    }
    for (name, topic) in topics.values() {
        sink.declare(name, topic.clone());
    }
    let file_bytes = std::fs::metadata(path).map_or(0, |metadata| metadata.len());
    let source = Source { file, file_bytes, database: &database, topics: &topics };
    match source.read_messages(sink) {
        Ok(()) => Ok(()),
        Err(ReadError::Sink(error)) => Err(error),
        Err(ReadError::Database(error)) => {
            sink.damaged_part("the rest of a file that is damaged", format!("{file} ({error})"));
            Ok(())
        }
    }
}

/// The end of reading rows before the last.
enum ReadError {
    Database(rusqlite::Error),
    Sink(InputError),
}

impl From<rusqlite::Error> for ReadError {
    fn from(error: rusqlite::Error) -> Self {
        Self::Database(error)
    }
}

/// A file that was opened, alone where its journal cannot be read.
struct Opened {
    database: Connection,
    is_alone: bool,
}

fn open(path: &Path) -> rusqlite::Result<Opened> {
    let flags = OpenFlags::SQLITE_OPEN_READ_ONLY | OpenFlags::SQLITE_OPEN_NO_MUTEX;
    let plain = Connection::open_with_flags(path, flags).and_then(prepared);
    // A bag whose recorder was killed has a journal; in a folder that cannot be written only the file itself is read.
    if let Ok(database) = plain {
        return Ok(Opened { database, is_alone: false });
    }
    let uri = format!("file:{}?immutable=1", uri_path(path));
    let alone = Connection::open_with_flags(uri, flags | OpenFlags::SQLITE_OPEN_URI);
    Ok(Opened { database: alone.and_then(prepared)?, is_alone: true })
}

fn prepared(database: Connection) -> rusqlite::Result<Connection> {
    database.set_limit(Limit::SQLITE_LIMIT_LENGTH, MAX_RECORD_BYTES as i32)?;
    database.execute_batch(SETTINGS)?;
    let tables = "SELECT count(*) FROM sqlite_master WHERE type = 'table' AND name IN ('topics', 'messages') \
                  AND sql NOT LIKE '%VIRTUAL%' AND sql NOT LIKE '%GENERATED%' AND sql NOT LIKE '% AS %'";
    let n: i64 = database.query_row(tables, [], |row| row.get(0))?;
    if n == 2 { Ok(database) } else { Err(rusqlite::Error::QueryReturnedNoRows) }
}

/// Returns a path as it stands in a URI.
fn uri_path(path: &Path) -> String {
    let mut text = String::new();
    for byte in path.to_string_lossy().bytes() {
        match byte {
            b'a'..=b'z' | b'A'..=b'Z' | b'0'..=b'9' | b'/' | b'.' | b'_' | b'-' => {
                text.push(byte.into())
            }
            other => text.push_str(&format!("%{other:02X}")),
        }
    }
    text
}

/// Returns the topics by their numbers.
fn read_topics(database: &Connection) -> rusqlite::Result<BTreeMap<i64, (String, Topic)>> {
    let definitions = read_definitions(database).unwrap_or_default();
    let mut statement =
        database.prepare("SELECT id, name, type, serialization_format FROM topics")?;
    let mut rows = statement.query([])?;
    let mut topics = BTreeMap::new();
    while let Some(row) = rows.next()? {
        let schema = ros2_name(&row.get::<_, String>(2)?);
        let (definition_encoding, definition) =
            definitions.get(&schema).cloned().unwrap_or_default();
        let topic = Topic {
            schema,
            encoding: row.get(3)?,
            definition: definition.into_bytes(),
            definition_encoding,
            ..Topic::default()
        };
        topics.insert(row.get(0)?, (row.get(1)?, topic));
    }
    Ok(topics)
}

/// Returns the language and the definition of types, which bags have since ROS 2 Iron.
fn read_definitions(database: &Connection) -> rusqlite::Result<BTreeMap<String, (String, String)>> {
    let query = "SELECT topic_type, encoding, encoded_message_definition FROM message_definitions";
    let mut statement = database.prepare(query)?;
    let rows = statement.query_map([], |row| Ok((row.get(0)?, (row.get(1)?, row.get(2)?))))?;
    rows.collect()
}

/// A file that is read.
struct Source<'a> {
    /// Its name for people.
    file: &'a str,
    file_bytes: u64,
    database: &'a Connection,
    /// Topics by their numbers.
    topics: &'a BTreeMap<i64, (String, Topic)>,
}

impl Source<'_> {
    /// Hands the messages on to `sink`. What is on a damaged page is skipped and counted.
    fn read_messages(&self, sink: &mut Sink<'_>) -> Result<(), ReadError> {
        let mut wanted = Vec::new();
        for (id, (name, _)) in self.topics {
            if sink.is_read(name) {
                wanted.push(id.to_string());
            }
        }
        // Messages on other topics are counted without their data, which are most of the file.
        let query = format!(
            "SELECT rowid, topic_id, timestamp, length(data), CASE WHEN topic_id IN ({}) THEN data END \
             FROM messages WHERE rowid >= ?1 ORDER BY rowid",
            wanted.join(",")
        );
        let mut size = ReadSize::default();
        let lost = read_rows(self.database, &query, MAX_RESTARTS, &mut |row| {
            size.add(row);
            let Some((name, _)) = topic_of(row).and_then(|id| self.topics.get(&id)) else {
                let number: i64 = row.get(0)?;
                let place = format!("{}, row {number}", self.file);
                sink.lose_rows("rows of no topic of a file", 1, place);
                return Ok(());
            };
            if !sink.is_read(name) {
                sink.count(name);
                return Ok(());
            }
            let time_ns = u64::try_from(row.get::<_, i64>(2).unwrap_or(0)).unwrap_or(0);
            let bytes = match row.get_ref(4)? {
                ValueRef::Blob(bytes) => Ok(bytes),
                _ => Err("it has no data".to_owned()),
            };
            sink.deliver(name, time_ns, bytes).map_err(ReadError::Sink)
        })?;
        for rows in &lost.ranges {
            let place = format!("{}, {} to {}", self.file, rows.start, rows.end - 1);
            sink.lose_rows("rows on damaged pages of a file", rows_in(rows), place);
        }
        if let Some(first) = lost.rest_from {
            let known = lost.ranges.iter().map(rows_in).sum();
            let rest = self.rows_behind(&size, known);
            sink.lose_rest(rest, format!("{}, from row {first} on", self.file));
        }
        Ok(())
    }

    /// Returns about how many rows are left of a file beside those that were read and those known to be lost.
    fn rows_behind(&self, read: &ReadSize, known_lost: u64) -> u64 {
        /// Bytes of tables and pages that have no messages.
        const OTHER_BYTES: u64 = 1 << 16;
        let definitions: usize =
            self.topics.values().map(|(_, topic)| topic.definition.len()).sum();
        let content = self.file_bytes.saturating_sub(OTHER_BYTES + definitions as u64);
        let rows = content / (read.bytes / read.rows.max(1)).max(1);
        rows.saturating_sub(read.rows).saturating_sub(known_lost).max(1)
    }
}

fn topic_of(row: &rusqlite::Row<'_>) -> Option<i64> {
    row.get(1).ok()
}

fn rows_in(range: &Range<i64>) -> u64 {
    range.end.abs_diff(range.start)
}

/// The size of the rows that were read.
#[derive(Default)]
struct ReadSize {
    rows: u64,
    bytes: u64,
}

impl ReadSize {
    fn add(&mut self, row: &rusqlite::Row<'_>) {
        /// Bytes of a row, and of its place in the index, beside its data.
        const ROW_BYTES: u64 = 40;
        let data: i64 = row.get(3).unwrap_or(0);
        self.rows += 1;
        self.bytes += ROW_BYTES + data.unsigned_abs();
    }
}

/// Number of times that reading goes on behind damaged pages.
const MAX_RESTARTS: usize = 20_000;

/// Rows that cannot be read.
#[derive(Debug, Default, PartialEq)]
struct LostRows {
    ranges: Vec<Range<i64>>,
    /// The first of those at the end, where nothing tells the last.
    rest_from: Option<i64>,
}

/// Calls `on_row` with the rows of a query that begins at a row, and returns which were on damaged pages. Behind those it
/// goes on, so many times at most.
fn read_rows(
    database: &Connection,
    query: &str,
    max_restarts: usize,
    on_row: &mut dyn FnMut(&rusqlite::Row<'_>) -> Result<(), ReadError>,
) -> Result<LostRows, ReadError> {
    let end = database
        .query_row("SELECT max(rowid) FROM messages", [], |row| row.get::<_, Option<i64>>(0));
    let end = end.ok().flatten();
    let mut statement = database.prepare(query)?;
    let mut lost = LostRows::default();
    let mut next = 1_i64;
    for _ in 0..max_restarts {
        // What is missing behind damage was on the damaged page.
        let mut behind = lost.ranges.last_mut();
        let is_whole = read_from(&mut statement, next, on_row, &mut |row| {
            if let Some(range) = behind.take() {
                range.end = row;
            }
            next = row.saturating_add(1);
        })?;
        if is_whole {
            return Ok(lost);
        }
        let Some(readable) = next_readable(&mut statement, next, end) else { break };
        lost.ranges.push(next..readable);
        next = readable;
    }
    match end {
        Some(end) if next <= end => lost.ranges.push(next..end.saturating_add(1)),
        Some(_) => {}
        None => lost.rest_from = Some(next),
    }
    Ok(lost)
}

/// Returns the first row behind a damaged one that can be read: found further and further away, and then between there and
/// the last that cannot.
fn next_readable(
    statement: &mut rusqlite::Statement<'_>,
    damaged: i64,
    end: Option<i64>,
) -> Option<i64> {
    const MAX_SKIPPED: i64 = 1 << 40;
    let limit = end.unwrap_or(i64::MAX).min(damaged.saturating_add(MAX_SKIPPED));
    let mut unreadable = damaged;
    let mut skipped = 1_i64;
    let mut readable = loop {
        let probe = damaged.saturating_add(skipped).min(limit);
        if probe <= unreadable {
            return None;
        }
        if is_readable(statement, probe) {
            break probe;
        }
        unreadable = probe;
        skipped *= 2;
    };
    while readable - unreadable > 1 {
        let middle = unreadable + (readable - unreadable) / 2;
        if is_readable(statement, middle) {
            readable = middle;
        } else {
            unreadable = middle;
        }
    }
    Some(readable)
}

fn is_readable(statement: &mut rusqlite::Statement<'_>, row: i64) -> bool {
    let is_of_order =
        |found: &rusqlite::Row<'_>| found.get(0).is_ok_and(|number: i64| number >= row);
    let rows = statement.query([row]);
    rows.is_ok_and(|mut rows| matches!(rows.next(), Ok(Some(found)) if is_of_order(found)))
}

/// Reads the rows from one on, and returns whether there are no more: else the next is damaged. A page that a damaged one
/// names in place of another has rows that were read before.
fn read_from(
    statement: &mut rusqlite::Statement<'_>,
    from: i64,
    on_row: &mut dyn FnMut(&rusqlite::Row<'_>) -> Result<(), ReadError>,
    on_number: &mut dyn FnMut(i64),
) -> Result<bool, ReadError> {
    let Ok(mut rows) = statement.query([from]) else { return Ok(false) };
    let mut least = from;
    loop {
        match rows.next() {
            Ok(Some(row)) => {
                let Ok(number) = row.get::<_, i64>(0) else { continue };
                if number < least {
                    return Ok(false);
                }
                least = number.saturating_add(1);
                on_number(number);
                match on_row(row) {
                    Err(ReadError::Database(_)) | Ok(()) => {}
                    Err(error) => return Err(error),
                }
            }
            Ok(None) => return Ok(true),
            Err(_) => return Ok(false),
        }
    }
}

#[cfg(test)]
mod tests;
