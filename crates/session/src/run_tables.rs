//! Tables of a recorded run, also as CSV, the format of logs to learn from.

use serde_json::Value;
use sidestep_draw::{TrailChoice, bodies_with_trails};
use sidestep_import::table::CsvTable;
use sidestep_kernel::InputError;
use sidestep_kernel::view::{Frame, PositionTableColumns, Scenery, Trail};
use sidestep_record::{Table, read_table};
use std::path::Path;

/// Largest number of recorded poses that are read for trails, some hundred megabytes; longer runs use the last ones.
const MAX_TRAIL_ROWS: u64 = 4_000_000;

/// Returns the tracks that led to a cycle, as far as they are recorded and worth showing.
///
/// # Errors
/// When a table is damaged.
pub(crate) fn read_trails(
    tables: &[PositionTableColumns],
    folder: &Path,
    scenery: &Scenery,
    frame: &Frame,
    choice: &TrailChoice,
) -> Result<Vec<Trail>, InputError> {
    let whose = bodies_with_trails(scenery, frame, choice);
    let mut trails = Vec::new();
    for rows in tables.iter().filter(|rows| has_rows(folder, rows.table)) {
        // Tables have rows of all bodies of a kind, also of those without a trail.
        let here = frame.bodies.iter().filter(|body| body.kind == rows.kind).count();
        let moments = (MAX_TRAIL_ROWS / here.max(whose.len()).max(1) as u64).max(1);
        // A chosen part is shown whole, whether it can be read or not.
        let history = choice.from.map_or(rows.history, |from| frame.cycle.saturating_sub(from));
        let cycles = moments.saturating_mul(rows.interval).min(history);
        let from = frame.cycle.saturating_sub(cycles);
        let table = read_table(folder, rows.table, from..frame.cycle)?;
        let of_table = rows.trails(scenery, frame, &whose, |name| table.column(name));
        trails.extend(of_table.unwrap_or_default());
    }
    Ok(trails)
}

/// A recorded table as CSV, with what the recording says of all of its rows.
#[derive(Debug)]
pub struct RecordedCsv {
    /// The rows.
    pub table: CsvTable,
    /// Facts by name, such as `box_m`.
    pub facts: Vec<(String, String)>,
}

/// Returns the table `name` of the run in `folder`; runs record it with `record.calibration =
/// true`.
///
/// # Errors
/// When the run has no such table, or it is damaged.
pub fn csv_table(folder: &Path, name: &str) -> Result<RecordedCsv, InputError> {
    let table = read_table(folder, name, ..).map_err(|e| {
        if folder.join(name).exists() {
            return e;
        }
        let remedy = "record the run with --set record.calibration=true";
        InputError::new(e.place(), e.cause(), remedy)
    })?;
    let csv = CsvTable::parse(&folder.join(name).display(), &to_csv(&table))?;
    Ok(RecordedCsv { table: csv, facts: table.schema.about })
}

/// Returns a table as CSV: a heading, then one line per row (a beam or an action).
fn to_csv(table: &Table) -> String {
    let columns = &table.schema.columns;
    let names: Vec<&str> = columns.iter().map(|c| c.name.as_str()).collect();
    let mut text = names.join(",") + "\n";
    for row in 0..table.rows() {
        for (k, (column, values)) in columns.iter().zip(&table.columns).enumerate() {
            let separator = if k == 0 { "" } else { "," };
            text.push_str(separator);
            // Writing to a string cannot fail.
            let _ = values.write(row, &column.labels, &mut text);
        }
        text.push('\n');
    }
    text
}

/// Returns whether some part of the table is complete: a run that was killed early has none.
pub(crate) fn has_rows(folder: &Path, table: &str) -> bool {
    has_parquet_file(&folder.join(table))
        || has_parquet_file(&folder.join(format!("{table}.partial")))
}

fn has_parquet_file(folder: &Path) -> bool {
    let Ok(entries) = std::fs::read_dir(folder) else { return false };
    let mut names = entries.filter_map(|entry| Some(entry.ok()?.file_name()));
    names.any(|name| Path::new(&name).extension() == Some("parquet".as_ref()))
}

/// Returns the content of `summary.json`, which a run writes at its end, if it exists.
///
/// # Errors
/// Text that is not JSON.
pub fn read_summary(folder: &Path) -> Result<Option<Value>, InputError> {
    let path = folder.join("summary.json");
    let Ok(text) = std::fs::read_to_string(&path) else { return Ok(None) };
    serde_json::from_str(&text).map(Some).map_err(|e| {
        let remedy = "restore the file, or run the scenario again in a new folder";
        InputError::new(path.display(), format!("this is no summary: {e}"), remedy)
    })
}
