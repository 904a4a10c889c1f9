//! Runs the source paper's experiments and prints its verdicts.
//!
//! `cargo run --release -p sidestep-papers --example reproduce_loria [-- --quick]`; timed runs are
//! recorded to a temporary folder, column by column.

use sidestep::kernel::ports::{ColumnValues, RecordError, Recorder, TableSchema};
use sidestep_papers::loria::{self, LoriaConfig};
use std::fs::File;
use std::io::{BufWriter, Write};

/// Writes every column to a file of its own, in the byte order of this machine.
struct ColumnFiles(Vec<Vec<BufWriter<File>>>);

fn bytes(values: &ColumnValues) -> Vec<u8> {
    match values {
        ColumnValues::U32(v) | ColumnValues::Label(v) => {
            v.iter().flat_map(|x| x.to_ne_bytes()).collect()
        }
        ColumnValues::U64(v) => v.iter().flat_map(|x| x.to_ne_bytes()).collect(),
        ColumnValues::I32(v) => v.iter().flat_map(|x| x.to_ne_bytes()).collect(),
        ColumnValues::F64(v) => v.iter().flat_map(|x| x.to_ne_bytes()).collect(),
        other => panic!("robots record no column of {}", other.column_type().name()),
    }
}

impl Recorder for ColumnFiles {
    fn append(&mut self, table: usize, block: &[ColumnValues]) -> Result<(), RecordError> {
        for (file, values) in self.0[table].iter_mut().zip(block) {
            file.write_all(&bytes(values)).map_err(|e| RecordError::new("column", e))?;
        }
        Ok(())
    }

    fn finish(&mut self) -> Result<(), RecordError> {
        let mut files = self.0.iter_mut().flatten();
        files.try_for_each(|file| file.flush()).map_err(|e| RecordError::new("column", e))
    }
}

fn columns(schemas: &[TableSchema]) -> Result<Box<dyn Recorder>, RecordError> {
    let file = || tempfile::tempfile().map(BufWriter::new);
    let open = |schema: &TableSchema| schema.columns.iter().map(|_| file()).collect();
    let tables: Result<_, std::io::Error> = schemas.iter().map(open).collect();
    Ok(Box::new(ColumnFiles(tables.map_err(|e| RecordError::new("temporary folder", e))?)))
}

fn main() -> Result<(), loria::LoriaError> {
    let quick = std::env::args().any(|argument| argument == "--quick");
    let plan = if quick { LoriaConfig::quick() } else { LoriaConfig::default() };
    let mut last = -1;
    let mut progress = |what: &str, share: f64| {
        let percent = (100.0 * share) as i32;
        if percent != std::mem::replace(&mut last, percent) {
            eprintln!("{percent:3} % {what}");
        }
    };
    let report = loria::run_recorded(&plan, &mut columns, &mut progress)?;
    for claim in &report.claims {
        println!("{:<6} {:<9} {}", claim.id, claim.verdict.name(), claim.ours);
    }
    Ok(())
}
