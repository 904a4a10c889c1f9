//! Bags of ROS 2 in SQLite (`.db3`), row by row; rows on damaged pages are skipped.
//!
//! SQLite itself reads the file, page by page and without a change to it. What the file defines beside the two tables
//! of a bag (views, virtual tables, functions in them) is not run.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, Read};
use std::ops::Range;
use std::path::Path;

use rusqlite::limits::Limit;
use rusqlite::types::ValueRef;
use rusqlite::{Connection, OpenFlags};
use sidestep_kernel::InputError;

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
    let completed = completed_copy(path).ok().flatten();
    if completed.is_some() {
        sink.cut_off(file);
    }
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
    let read = read_messages(file, &database, &topics, sink);
    match read {
        Ok(()) => Ok(()),
        Err(ReadError::Sink(error)) => Err(error),
        Err(ReadError::Database(error)) => {
            sink.damaged_part("the rest of a file that is damaged", format!("{file} ({error})"));
            Ok(())
        }
    }
}

/// Returns a copy of a file that was cut off, as long as its head says it was: without the pages that are missing, which are
/// found as damaged ones are, SQLite reads none. `None` where the file is whole.
fn completed_copy(path: &Path) -> io::Result<Option<tempfile::NamedTempFile>> {
    const PAGE_SIZE: Range<usize> = 16..18;
    const PAGE_COUNT: Range<usize> = 28..32;
    let mut file = File::open(path)?;
    let length = file.metadata()?.len();
    let mut head = [0; 32];
    file.read_exact(&mut head)?;
    let page_size = match head[PAGE_SIZE] {
        [0, 1] => 1 << 16,
        [high, low] => u64::from(u16::from_be_bytes([high, low])),
        _ => 0,
    };
    let page_count =
        head[PAGE_COUNT].iter().fold(0_u64, |count, byte| count << 8 | u64::from(*byte));
    let whole = page_size * page_count;
    // A file of less than half of its pages has lost more than it has.
    if length >= whole || whole > 2 * length || has_journal(path) {
        return Ok(None);
    }
    let copy = tempfile::NamedTempFile::new()?;
    std::fs::copy(path, copy.path())?;
    copy.as_file().set_len(whole)?;
    Ok(Some(copy))
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

fn has_journal(path: &Path) -> bool {
    ["-wal", "-journal"]
        .iter()
        .any(|suffix| Path::new(&format!("{}{suffix}", path.display())).is_file())
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

/// Hands the messages on to `sink`. What is on a damaged page is skipped and counted.
fn read_messages(
    file: &str,
    database: &Connection,
    topics: &BTreeMap<i64, (String, Topic)>,
    sink: &mut Sink<'_>,
) -> Result<(), ReadError> {
    let mut wanted = Vec::new();
    for (id, (name, _)) in topics {
        if sink.is_read(name) {
            wanted.push(id.to_string());
        }
    }
    let wanted = wanted.join(",");
    let messages = format!(
        "SELECT rowid, topic_id, timestamp, data FROM messages WHERE rowid > ?1 AND topic_id IN ({wanted}) ORDER BY rowid"
    );
    let lost = read_rows(database, &messages, &mut |row| {
        let Some((name, _)) = topics.get(&row.get(1)?) else { return Ok(()) };
        let time_ns = row.get::<_, i64>(2).unwrap_or(0);
        let bytes = match row.get_ref(3)? {
            ValueRef::Blob(bytes) => Ok(bytes),
            _ => Err("it has no data".to_owned()),
        };
        let time_ns = u64::try_from(time_ns).unwrap_or(0);
        sink.deliver(name, time_ns, bytes).map_err(ReadError::Sink)
    })?;
    for rows in lost {
        let rule = "rows on damaged pages of a file";
        sink.damaged_part(rule, format!("{file}, {} to {}", rows.start, rows.end - 1));
    }
    // Messages on other topics are counted without their data, which are most of the file.
    let others = format!(
        "SELECT rowid, topic_id FROM messages WHERE rowid > ?1 AND topic_id NOT IN ({wanted}) ORDER BY rowid"
    );
    read_rows(database, &others, &mut |row| {
        if let Some((name, _)) = topics.get(&row.get(1)?) {
            sink.count(name);
        }
        Ok(())
    })?;
    Ok(())
}

/// Number of times that reading goes on behind a damaged page.
const MAX_RESTARTS: usize = 1000;

/// Calls `on_row` with the rows of a query that begins behind a row, and returns which rows were on damaged pages. Behind
/// one it goes on at a row further and further away, until a page can be read again.
fn read_rows(
    database: &Connection,
    query: &str,
    on_row: &mut dyn FnMut(&rusqlite::Row<'_>) -> Result<(), ReadError>,
) -> Result<Vec<Range<i64>>, ReadError> {
    let end = database
        .query_row("SELECT max(rowid) FROM messages", [], |row| row.get::<_, Option<i64>>(0));
    let end = end.ok().flatten();
    let mut statement = database.prepare(query)?;
    let mut lost: Vec<Range<i64>> = Vec::new();
    let mut last = 0_i64;
    let mut skipped = 0_i64;
    for _ in 0..MAX_RESTARTS {
        let from = last.saturating_add(skipped);
        let damage = read_from(&mut statement, from, on_row, &mut |row| {
            if skipped > 0 {
                lost.push(last + 1..row);
            }
            (last, skipped) = (row, 0);
        })?;
        let Some(damage) = damage else { return Ok(lost) };
        skipped = skipped.saturating_mul(2).max(1);
        match end {
            Some(end) if last.saturating_add(skipped) < end => {}
            Some(end) => {
                lost.push(last + 1..end.saturating_add(1));
                return Ok(lost);
            }
            None => return Err(ReadError::Database(damage)),
        }
    }
    Ok(lost)
}

/// Reads the rows behind one, and returns the damage that ends them, if any.
fn read_from(
    statement: &mut rusqlite::Statement<'_>,
    from: i64,
    on_row: &mut dyn FnMut(&rusqlite::Row<'_>) -> Result<(), ReadError>,
    on_number: &mut dyn FnMut(i64),
) -> Result<Option<rusqlite::Error>, ReadError> {
    let mut rows = match statement.query([from]) {
        Ok(rows) => rows,
        Err(damage) => return Ok(Some(damage)),
    };
    loop {
        match rows.next() {
            Ok(Some(row)) => {
                let Ok(number) = row.get(0) else { continue };
                on_number(number);
                match on_row(row) {
                    Err(ReadError::Database(_)) | Ok(()) => {}
                    Err(error) => return Err(error),
                }
            }
            Ok(None) => return Ok(None),
            Err(damage) => return Ok(Some(damage)),
        }
    }
}
