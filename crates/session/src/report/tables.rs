//! The contents of the tables of a run folder, by their schemas.

use super::metrics::unit_of;
use crate::run_tables::has_rows;
use sidestep_document::{Document, Table};
use sidestep_kernel::InputError;
use sidestep_kernel::ports::{ColumnSpec, ColumnValues};
use sidestep_record::read_table;
use std::path::Path;

/// Returns the names of the tables in a run folder that have a complete part, sorted.
///
/// # Errors
/// When the folder cannot be read.
pub(super) fn table_names(folder: &Path) -> Result<Vec<String>, InputError> {
    let mut names = entry_names(folder).map_err(|e| {
        InputError::new(folder.display(), e.to_string(), "make the folder readable")
    })?;
    names.retain(|name| has_rows(folder, name));
    names.sort();
    names.dedup();
    Ok(names)
}

/// Returns the names of the entries of a folder; a table that is being written has the name of its finished folder.
fn entry_names(folder: &Path) -> std::io::Result<Vec<String>> {
    let mut names = Vec::new();
    for entry in std::fs::read_dir(folder)? {
        let name = entry?.file_name().to_string_lossy().into_owned();
        names.push(name.strip_suffix(".partial").unwrap_or(&name).to_string());
    }
    Ok(names)
}

/// Appends the columns and their meanings.
///
/// # Errors
/// When a table is damaged.
pub(super) fn append(document: &mut Document, folder: &Path) -> Result<(), InputError> {
    let note = "Parquet files below the run folder, one folder a table.";
    let columns = ["table", "column", "type", "unit", "meaning"];
    let mut table = Table::new("Columns", note, &columns).folded();
    for name in table_names(folder)? {
        // The first row is enough for the schema; the whole table may be large.
        let first = read_table(folder, &name, ..1).or_else(|_| read_table(folder, &name, ..))?;
        for column in &first.schema.columns {
            let unit = unit_of(&column.name);
            let ty = column.ty.name().to_string();
            table.push_row([name.clone(), column.name.clone(), ty, unit, column.meaning.clone()]);
        }
    }
    if !table.rows.is_empty() {
        document.section("What was recorded").tables([table]);
    }
    Ok(())
}

/// Returns a value of a column in a form for people.
pub(super) fn format_cell(column: &ColumnSpec, values: &ColumnValues, row: usize) -> String {
    match values {
        // The value that stands for a missing one.
        ColumnValues::U32(v) if v[row] == u32::MAX => "-".into(),
        ColumnValues::F64(v) => super::metrics::format_digits(v[row]),
        _ if values.is_missing(row) => "-".into(),
        _ => column.text(values, row),
    }
}

pub(super) fn format_rows(rows: usize) -> String {
    format!("{} row{}", super::text::format_count(rows as u64), if rows == 1 { "" } else { "s" })
}
