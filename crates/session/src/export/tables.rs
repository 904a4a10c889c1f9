//! Recorded tables as CSV, or as one Parquet file each.

use super::target::Target;
use super::{ExportContext, ExportResult};
use crate::Error;
use csv::ByteRecord;
use sidestep_kernel::ports::{ColumnValues, TableSchema};
use sidestep_kernel::{Cycle, InputError};
use sidestep_record::{Table, TableFileWriter, for_each_block, tables};
use std::fmt::Write as _;
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;

/// Name of the table of which every row is kept, regardless of `every`.
const EVENTS: &str = "events";

/// File beside the tables of a flight: which cycles were flown, and which simulated.
const ORIGINS_FILE: &str = "flown-or-simulated.csv";

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum TableFormat {
    Csv,
    Parquet,
}

/// Exports the table `only`, or all of the run.
pub(super) fn export(
    job: &ExportContext<'_>,
    form: TableFormat,
    only: Option<&str>,
) -> Result<ExportResult, Error> {
    let source = TableExport::new(job, form)?;
    let ending = match form {
        TableFormat::Csv => "csv",
        TableFormat::Parquet => "parquet",
    };
    let paths = match only {
        Some(name) => {
            source.check_table(name)?;
            let target = Target::for_file(job, &format!("-{name}.{ending}"))?;
            target.write_file(|partial| source.write(name, partial))?;
            vec![target.path().to_path_buf()]
        }
        None => {
            let names = tables(source.folder)?;
            let target = Target::for_folder(job, &format!("-{ending}"))?;
            target.write_folder(job.watcher, |partial| {
                for name in &names {
                    source.write(name, &partial.join(format!("{name}.{ending}")))?;
                }
                source.write_origins(&partial.join(ORIGINS_FILE))
            })?;
            let files = names.iter().map(|name| format!("{name}.{ending}"));
            let origins = job.recorded.is_flight.then(|| ORIGINS_FILE.to_string());
            files.chain(origins).map(|file| target.path().join(file)).collect()
        }
    };
    Ok(ExportResult { paths, is_confirmed: false, film: None })
}

/// An export of tables, with the cycles of their rows.
pub(super) struct TableExport<'a> {
    folder: &'a Path,
    job: &'a ExportContext<'a>,
    form: TableFormat,
}

impl<'a> TableExport<'a> {
    /// Returns an export of the tables of a run folder.
    ///
    /// # Errors
    /// When the run was recorded in a form without tables.
    pub(super) fn new(job: &'a ExportContext<'a>, form: TableFormat) -> Result<Self, InputError> {
        let Some(folder) = &job.recorded.folder else {
            let remedy = "give the run folder; one is made by `sidestep run SCENARIO --out DIR`";
            let cause = "a recording for viewers has no tables";
            return Err(InputError::new(job.recorded.path.display(), cause, remedy));
        };
        Ok(Self { folder, job, form })
    }

    pub(super) fn check_table(&self, name: &str) -> Result<(), InputError> {
        let names = tables(self.folder)?;
        if names.iter().any(|known| known == name) {
            return Ok(());
        }
        let cause = "the run has no such table";
        let remedy = format!("give one of {}", names.join(", "));
        Err(InputError::new(format!("--table {name}"), cause, remedy))
    }

    fn write(&self, name: &str, to: &Path) -> Result<(), Error> {
        match self.form {
            TableFormat::Csv => self.write_csv(name, to),
            TableFormat::Parquet => self.write_parquet(name, to),
        }
    }

    /// Writes which cycles of a flight were flown, and which simulated; nothing for other runs, all of which are simulated.
    fn write_origins(&self, to: &Path) -> Result<(), Error> {
        let recorded = self.job.recorded;
        if !recorded.is_flight {
            return Ok(());
        }
        let mut text = "from_cycle,until_cycle,origin\n".to_string();
        for range in &recorded.origins {
            let _ = writeln!(text, "{},{},{}", range.from, range.until, range.origin.name());
        }
        std::fs::write(to, text).map_err(|e| Error::cannot_store(to, &e))
    }

    /// Passes on the requested rows, block by block.
    pub(super) fn for_each_block_of(
        &self,
        name: &str,
        mut each: impl FnMut(Table) -> Result<(), Error>,
    ) -> Result<(), Error> {
        let ExportContext { wanted, span, .. } = self.job;
        let every = if name == EVENTS { 1 } else { wanted.every.unwrap_or(1) };
        let each_downsampled = |mut block: Table| {
            downsample(&mut block, every);
            each(block)
        };
        if wanted.from.is_some() || wanted.until.is_some() {
            return for_each_block(self.folder, name, span.from..=span.until, each_downsampled);
        }
        // Without a range all rows are read, because the table may have no cycles.
        for_each_block(self.folder, name, .., each_downsampled)
    }

    fn write_parquet(&self, name: &str, to: &Path) -> Result<(), Error> {
        let mut file: Option<TableFileWriter> = None;
        self.for_each_block_of(name, |block| {
            let file = match &mut file {
                Some(file) => file,
                // The schema is known from the first block on.
                None => file.insert(TableFileWriter::create(to, &block.schema, &block.origin)?),
            };
            Ok(file.append(&block.columns)?)
        })?;
        Ok(file.map_or(Ok(()), TableFileWriter::finish)?)
    }

    fn write_csv(&self, name: &str, to: &Path) -> Result<(), Error> {
        let file = File::create_new(to).map_err(|e| Error::cannot_store(to, &e))?;
        let mut csv = csv::Writer::from_writer(BufWriter::new(file));
        let mut has_heading = false;
        self.for_each_block_of(name, |block| {
            let written = append_block(&mut csv, &block, !has_heading);
            has_heading = true;
            written.map_err(|e| Error::cannot_store(to, &io::Error::from(e)))
        })?;
        close(csv).map_err(|e| Error::cannot_store(to, &e))
    }
}

fn append_block(
    csv: &mut csv::Writer<impl Write>,
    block: &Table,
    with_heading: bool,
) -> Result<(), csv::Error> {
    if with_heading {
        csv.write_record(heading(&block.schema))?;
    }
    write_rows(csv, block)
}

/// Flushes all buffers, and waits until the file is on the disk.
fn close(csv: csv::Writer<BufWriter<File>>) -> io::Result<()> {
    let buffer = csv.into_inner().map_err(|e| e.into_error())?;
    let file = buffer.into_inner().map_err(|e| e.into_error())?;
    file.sync_all()
}

/// Keeps rows of cycles that are multiples of `every`.
fn downsample(block: &mut Table, every: Cycle) {
    let Some(ColumnValues::U64(cycles)) = block.column("cycle").filter(|_| every > 1) else {
        return;
    };
    let keep: Vec<bool> = cycles.iter().map(|cycle| cycle.is_multiple_of(every)).collect();
    block.columns.iter_mut().for_each(|column| column.retain_rows(&keep));
}

fn heading(schema: &TableSchema) -> impl Iterator<Item = &str> {
    schema.columns.iter().map(|column| column.name.as_str())
}

fn write_rows(csv: &mut csv::Writer<impl Write>, block: &Table) -> Result<(), csv::Error> {
    // Reused for all rows, because tables have millions of them.
    let mut record = ByteRecord::new();
    let mut field = String::new();
    for row in 0..block.rows() {
        record.clear();
        for (column, values) in block.schema.columns.iter().zip(&block.columns) {
            field.clear();
            values.write(row, &column.labels, &mut field).map_err(io::Error::other)?;
            record.push_field(field.as_bytes());
        }
        csv.write_byte_record(&record)?;
    }
    Ok(())
}
