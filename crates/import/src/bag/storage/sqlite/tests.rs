//! Promise: of a damaged bag in SQLite just what is damaged is lost, and counted.

use std::fs::File;

use super::super::read as read_bag;
use super::*;

const PAGE_BYTES: usize = 4096;
const QUERY: &str = "SELECT rowid, topic_id, timestamp, length(data), data FROM messages WHERE rowid >= ?1 ORDER BY rowid";

/// A bag of 2,010 messages of 200 bytes.
fn bag(path: &Path) -> Vec<u8> {
    let database = Connection::open(path).unwrap();
    database
        .execute_batch(
            "PRAGMA synchronous = OFF; PRAGMA page_size = 4096; \
             CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format TEXT); \
             CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, data BLOB); \
             INSERT INTO topics VALUES (1, '/note', 'std_msgs/msg/String', 'cdr'); \
             WITH RECURSIVE n(k) AS (SELECT 1 UNION ALL SELECT k + 1 FROM n WHERE k < 2010) \
             INSERT INTO messages SELECT k, 1, k, zeroblob(200) FROM n;",
        )
        .unwrap();
    drop(database);
    std::fs::read(path).unwrap()
}

/// The starts of pages with rows, in the order of the rows, and how many rows each has.
fn leaves(bytes: &[u8]) -> Vec<(usize, u64)> {
    const LEAF_OF_TABLE: u8 = 0x0d;
    let mut leaves = Vec::new();
    for start in (PAGE_BYTES..bytes.len()).step_by(PAGE_BYTES) {
        let rows = u16::from_be_bytes([bytes[start + 3], bytes[start + 4]]);
        if bytes[start] == LEAF_OF_TABLE && rows > 5 {
            leaves.push((start, rows.into()));
        }
    }
    leaves
}

/// The number of rows that are read of a file, and those that are lost.
fn read_all(path: &Path, max_restarts: usize) -> (u64, LostRows) {
    let database = open(path).unwrap().database;
    let mut read = 0;
    let lost = read_rows(&database, QUERY, max_restarts, &mut |_| {
        read += 1;
        Ok(())
    });
    (read, lost.ok().unwrap())
}

#[test]
fn just_the_rows_on_damaged_pages_are_lost_and_all_of_them_are_counted() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.db3");
    let mut bytes = bag(&path);
    let leaves = leaves(&bytes);
    let mut on_damaged = 0;
    for (start, rows) in [leaves[20], leaves[21], leaves[60]] {
        bytes[start..start + PAGE_BYTES].fill(0);
        on_damaged += rows;
    }
    std::fs::write(&path, &bytes).unwrap();
    let (read, lost) = read_all(&path, MAX_RESTARTS);
    let lost_rows: u64 = lost.ranges.iter().map(rows_in).sum();
    assert_eq!((read, lost_rows), (2010 - on_damaged, on_damaged));
    // Where reading does not go on any more, the rest is lost.
    let (read, lost) = read_all(&path, 1);
    let lost_rows: u64 = lost.ranges.iter().map(rows_in).sum();
    assert!(read < 2010 - on_damaged && read + lost_rows == 2010, "{read}, {lost:?}");
}

/// A page that is named twice has its rows once, and those of the page that is named no more are lost.
#[test]
fn rows_of_a_page_that_stands_twice_in_the_file_are_read_once() {
    const INNER_OF_TABLE: u8 = 0x05;
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.db3");
    let mut bytes = bag(&path);
    let inner = (PAGE_BYTES..bytes.len())
        .step_by(PAGE_BYTES)
        .find(|start| bytes[*start] == INNER_OF_TABLE)
        .unwrap();
    let cell = |k: usize| {
        let at = inner + 12 + 2 * k;
        inner + usize::from(u16::from_be_bytes([bytes[at], bytes[at + 1]]))
    };
    let [from, to] = [cell(10), cell(30)];
    bytes.copy_within(from..from + 4, to);
    std::fs::write(&path, &bytes).unwrap();
    let (read, lost) = read_all(&path, MAX_RESTARTS);
    let lost: u64 = lost.ranges.iter().map(rows_in).sum();
    assert!((10..30).contains(&lost), "{lost}");
    assert_eq!(read + lost, 2010);
}

fn read_file(path: &Path) -> Result<crate::report::ImportReport, InputError> {
    read_bag(path, &|_| true, &mut |_| Ok(())).map(|storage| storage.report)
}

#[test]
fn a_file_of_which_more_than_half_is_damaged_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.db3");
    let bytes = bag(&path);
    let leaves = leaves(&bytes);
    let damaged = |leaves: &[(usize, u64)]| {
        let mut bytes = bytes.clone();
        for (start, _) in leaves {
            bytes[*start..*start + PAGE_BYTES].fill(0);
        }
        std::fs::write(&path, bytes).unwrap();
        read_file(&path)
    };
    let n = leaves.len();
    let report = damaged(&leaves[n / 10..n / 2]).unwrap();
    let rows: u64 = leaves[n / 10..n / 2].iter().map(|(_, rows)| rows).sum();
    assert_eq!(report.dropped(), rows);
    let most = damaged(&leaves[n / 10..n * 9 / 10]).unwrap_err();
    assert!(most.cause().starts_with("more than half of its rows"), "{most}");
    // Nothing tells how many rows there were.
    let end = damaged(&leaves[n / 10..]).unwrap_err();
    assert!(end.cause().starts_with("more than half of its rows"), "{end}");
    assert_eq!(damaged(&leaves[n * 9 / 10..]).unwrap().dropped(), 1);
}

#[test]
fn a_file_that_is_too_large_to_be_completed_is_named_with_a_remedy_that_works() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.db3");
    let bytes = bag(&path);
    let whole = bytes.len() as u64;
    std::fs::write(&path, &bytes[..bytes.len() * 4 / 5]).unwrap();
    assert_eq!(whole_length(&path).unwrap(), Some(whole));
    let error = completed_copy("a.db3", &path, [whole, whole - 1]).unwrap_err();
    assert!(error.cause().contains("too large to be completed"), "{error}");
    assert!(error.remedy().contains(&format!("truncate -s {whole} whole.db3")), "{error}");
    let by_hand = folder.path().join("whole.db3");
    std::fs::copy(&path, &by_hand).unwrap();
    File::options().write(true).open(&by_hand).unwrap().set_len(whole).unwrap();
    assert!(read_file(&by_hand).is_ok());
    assert!(completed_copy("a.db3", &path, [whole, whole]).is_ok());
}
