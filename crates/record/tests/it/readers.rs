//! Files read by other programs.

use std::path::PathBuf;
use std::process::Command;

use sidestep_kernel::ports::Recorder;

use crate::support::{recorder, rows};

/// Prints the table's types and contents, in a form that is easy to compare.
const SCRIPT: &str = "
import sys, pyarrow.parquet as pq
t = pq.read_table(sys.argv[1])
print(','.join(f'{f.name}:{f.type}' for f in t.schema))
print(t.num_rows, sum(t['cycle'].to_pylist()), sum(t['robot'].to_pylist()),
      sum(t['col'].to_pylist()), round(sum(t['x_m'].to_pylist()), 6))
print(','.join(t['heading'].to_pylist()[:12:4]), t['heading'].to_pylist().count('south'))
print(pq.read_metadata(sys.argv[1] + '/part-000000000000000.parquet').metadata[b'sidestep.seed'])
";

/// Returns a Python that has pyarrow; `None`, with a reason in the output, where there is none.
fn python_with_pyarrow() -> Option<PathBuf> {
    let python = sidestep_testing::python();
    let tried = Command::new(&python).args(["-c", "import pyarrow.parquet"]).output();
    let has_pyarrow = tried.is_ok_and(|o| o.status.success());
    if !has_pyarrow {
        sidestep_testing::skip(format!("{} has no pyarrow", python.display()));
    }
    has_pyarrow.then_some(python)
}

#[test]
fn pyarrow_reads_a_folder_of_parts_as_one_table() {
    let Some(python) = python_with_pyarrow() else { return };
    let folder = tempfile::tempdir().unwrap();
    let mut recorder = recorder(folder.path());
    recorder.append(0, &rows(0, 500)).unwrap();
    recorder.make_durable(500).unwrap();
    recorder.append(0, &rows(500, 1000)).unwrap();
    recorder.finish().unwrap();
    let table = folder.path().join("trajectories");
    let output = Command::new(&python).args(["-c", SCRIPT]).arg(&table).output().unwrap();
    let said = String::from_utf8_lossy(&output.stdout);
    let error = String::from_utf8_lossy(&output.stderr);
    let lines: Vec<_> = said.lines().collect();
    let types = "cycle:uint64,robot:uint32,col:int32,x_m:double,heading:string";
    assert_eq!(
        lines,
        [types, &sums(), "east,east,north 500", "b'18446744073709551615'"],
        "{error}"
    );
}

/// Reads a table with checksums of pages, and prints whether they are right.
const CHECK: &str = "
import sys, pyarrow.parquet as pq
try:
    print(pq.read_table(sys.argv[1], page_checksum_verification=True).num_rows)
except OSError as error:
    print(error)
";

#[test]
fn pyarrow_notices_a_flipped_bit_in_a_page_by_its_checksum() {
    let Some(python) = python_with_pyarrow() else { return };
    let folder = tempfile::tempdir().unwrap();
    let mut recorder = recorder(folder.path());
    recorder.append(0, &rows(0, 500)).unwrap();
    recorder.finish().unwrap();
    let part = folder.path().join("trajectories/part-000000000000000.parquet");
    let read = || {
        let output = Command::new(&python).args(["-c", CHECK]).arg(&part).output().unwrap();
        String::from_utf8_lossy(&output.stdout).into_owned()
    };
    assert_eq!(read().trim(), "1000");
    let whole = std::fs::read(&part).unwrap();
    // Doubles in the middle of the file, any bits of which are a number.
    let mut flipped = whole.clone();
    flipped[whole.len() / 3] ^= 1;
    std::fs::write(&part, flipped).unwrap();
    assert!(read().to_lowercase().contains("crc"), "{}", read());
}

/// The second line of the script, from the rows themselves.
fn sums() -> String {
    let cycles: u64 = (0..1000).sum();
    let cols: u64 = (0..1000).map(|c| c % 7).sum();
    let cols = 2 * cols as i64 - 3 * 1000;
    let x_m: f64 = (0..1000).map(|c| f64::from(c) * 0.2 - 1.0).sum();
    format!("2000 {} 1000 {cols} {x_m:.1}", 2 * cycles)
}
