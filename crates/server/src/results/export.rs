//! Exports of recorded runs, by the exporters of the command, to a file that the browser saves.

use super::HttpError;
use super::job_queue::{CancelToken, to_http_error};
use super::query::QueryFields;
use crate::protocol::Problem;
use crate::state::AppState;
use axum::extract::State;
use axum::http::header::{CACHE_CONTROL, CONTENT_DISPOSITION, CONTENT_TYPE};
use axum::http::{HeaderMap, StatusCode, Uri};
use axum::response::{IntoResponse, Response};
use sidestep_kernel::{Cycle, Interrupt};
use sidestep_scenario::Worlds;
use sidestep_session::export::{AnimationOptions, ExportRequest, ExportScope, Format, export};
use sidestep_session::{Error, PictureLook, RecordedRun, Watcher};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Maximum size of an export, which is held in memory; the command has no such limit.
const MAX_EXPORT_BYTES: u64 = 256 << 20;

/// Returns a recorded run in another format.
pub(crate) async fn answer(
    State(state): State<Arc<AppState>>,
    headers: HeaderMap,
    uri: Uri,
) -> Response {
    if let Err(refusal) = state.access.authorize_fetch(&headers) {
        return refusal.into_response();
    }
    export_response(&state, &QueryFields::from_query(uri.query()))
        .await
        .unwrap_or_else(HttpError::into_response)
}

async fn export_response(state: &AppState, fields: &QueryFields) -> Result<Response, HttpError> {
    let path = state.deps.files.resolve(fields.require("path")?)?;
    let spec = ExportSpec::from_fields(fields)?;
    let worlds = state.deps.worlds.clone();
    let workers = state.deps.workers;
    let name = spec.download_name(&path);
    let media = spec.media;
    let export = state
        .jobs
        .run(move |cancel: &CancelToken| write_export(&worlds, &path, &spec, workers, cancel));
    let bytes = export.await?;
    let disposition = format!("attachment; filename=\"{name}\"");
    let about = [
        (CONTENT_TYPE, media),
        (CACHE_CONTROL, "no-store"),
        (CONTENT_DISPOSITION, disposition.as_str()),
    ];
    Ok((about, bytes).into_response())
}

/// The requested part of a run, and its format, as read from the address.
struct ExportSpec {
    format: Format,
    /// The text that is added to the name of the run.
    suffix: String,
    media: &'static str,
    cycle: Option<Cycle>,
}

impl ExportSpec {
    fn from_fields(fields: &QueryFields) -> Result<Self, HttpError> {
        let (format, media) = match fields.require("as")? {
            "csv" => {
                let table = fields.require("table")?.to_string();
                (Format::Csv(Some(table)), "text/csv; charset=utf-8")
            }
            "parquet" => {
                let table = fields.require("table")?.to_string();
                (Format::Parquet(Some(table)), "application/vnd.apache.parquet")
            }
            "mcap" => (Format::Mcap, "application/octet-stream"),
            "svg" => (Format::Svg, "image/svg+xml"),
            "png" => (Format::Png { width_px: None }, "image/png"),
            "gif" => (Format::Gif(AnimationOptions::default()), "image/gif"),
            other => {
                let remedy = "give csv, parquet, mcap, svg, png or gif";
                return Err(
                    Problem::new("export", format!("`{other}` is no format"), remedy).into()
                );
            }
        };
        let suffix = match &format {
            Format::Csv(Some(table)) => format!("-{table}.csv"),
            Format::Parquet(Some(table)) => format!("-{table}.parquet"),
            _ => format!(".{}", fields.require("as")?),
        };
        let cycle =
            fields.get("cycle").map(|cycle| cycle.parse().map_err(|_| invalid_cycle_number(cycle)));
        Ok(Self { format, suffix, media, cycle: cycle.transpose()? })
    }

    /// Returns the name under which the browser saves the export: that of the run, with a suffix and the ending.
    fn download_name(&self, path: &Path) -> String {
        // `.` has no name of its own.
        let whole: PathBuf = path.canonicalize().unwrap_or_else(|_| path.to_path_buf());
        let stem = if whole.is_file() { whole.file_stem() } else { whole.file_name() };
        sanitize_file_name(&(stem.unwrap_or_default().to_string_lossy() + self.suffix.as_str()))
    }
}

fn invalid_cycle_number(text: &str) -> Problem {
    Problem::new("export", format!("`{text}` is no cycle"), "give a whole number")
}

/// Returns a name of a file that needs no quoting anywhere.
pub(super) fn sanitize_file_name(name: &str) -> String {
    let name = name.replace(|c: char| !c.is_ascii_alphanumeric() && !"-_.".contains(c), "-");
    if name.starts_with('.') || name.is_empty() { format!("run{name}") } else { name }
}

/// Exports to a temporary folder; returns the content of the file.
fn write_export(
    worlds: &Worlds,
    path: &Path,
    spec: &ExportSpec,
    workers: usize,
    cancel: &CancelToken,
) -> Result<Vec<u8>, HttpError> {
    let recorded = RecordedRun::open(worlds, path).map_err(|e| to_http_error(&e))?;
    let folder = tempfile::tempdir()
        .map_err(|e| to_http_error(&Error::cannot_write(&std::env::temp_dir(), &e)))?;
    let out = folder.path().join("export");
    // The page gives the cycle on display: a picture shows it, everything else ends there.
    let is_picture = matches!(spec.format, Format::Svg | Format::Png { .. });
    let scope = ExportScope {
        out: Some(&out),
        replace: false,
        from: spec.cycle.filter(|_| is_picture),
        until: spec.cycle.filter(|_| !is_picture),
        every: None,
        workers,
    };
    let look = PictureLook::default();
    let request = ExportRequest { form: spec.format.clone(), look, scope };
    let watcher = SizeLimitWatcher { cancel, folder: folder.path() };
    let exported = export(&recorded, &request, &watcher);
    // An export that was stopped because of its size ends like one that was cancelled.
    if watcher.is_too_large() {
        return Err(too_large());
    }
    exported.map_err(|error| to_http_error(&error))?;
    std::fs::read(&out).map_err(|e| to_http_error(&Error::cannot_write(&out, &e)))
}

fn too_large() -> HttpError {
    let cause = format!("it would have more than {} MiB", MAX_EXPORT_BYTES >> 20);
    let remedy = "use the command, which has no such bound: `sidestep export DIR --to csv`";
    HttpError::new(StatusCode::PAYLOAD_TOO_LARGE, Problem::new("export", cause, remedy))
}

/// A watcher that stops an export that becomes too large.
struct SizeLimitWatcher<'a> {
    cancel: &'a CancelToken,
    folder: &'a Path,
}

impl SizeLimitWatcher<'_> {
    fn is_too_large(&self) -> bool {
        let entries = std::fs::read_dir(self.folder).into_iter().flatten().flatten();
        entries.filter_map(|entry| Some(entry.metadata().ok()?.len())).sum::<u64>()
            > MAX_EXPORT_BYTES
    }
}

impl Watcher for SizeLimitWatcher<'_> {
    fn should_continue(&self) -> bool {
        self.cancel.should_continue() && !self.is_too_large()
    }

    fn interrupt(&self) -> Interrupt {
        self.cancel.interrupt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_files_are_plain_whatever_the_folder_is_called() {
        assert_eq!(sanitize_file_name("office 2\"\r\n; é.csv"), "office-2------.csv");
        assert_eq!([sanitize_file_name(""), sanitize_file_name(".svg")], ["run", "run.svg"]);
    }

    #[test]
    fn what_is_wanted_is_read_or_refused_in_words() {
        let of = |query: &str| ExportSpec::from_fields(&QueryFields::from_query(Some(query)));
        let spec = of("as=csv&table=events").unwrap_or_else(|_| panic!("a table"));
        assert_eq!(spec.download_name(Path::new("/no/office")), "office-events.csv");
        for query in ["as=csv", "as=exe", "", "as=svg&cycle=-1", "as=png&cycle=x"] {
            assert!(of(query).is_err(), "{query}");
        }
        assert_eq!(of("as=png&cycle=12").ok().and_then(|spec| spec.cycle), Some(12));
    }
}
