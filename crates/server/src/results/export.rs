//! Exports of recorded runs, by the exporters of the command, to a file that the browser saves.

use super::ResultError;
use super::job_queue::{CancelToken, result_error};
use super::query::QueryFields;
use crate::protocol::Problem;
use crate::state::AppState;
use axum::extract::State;
use axum::http::header::{CACHE_CONTROL, CONTENT_DISPOSITION, CONTENT_TYPE};
use axum::http::{HeaderMap, StatusCode, Uri};
use axum::response::{IntoResponse, Response};
use sidestep_kernel::{Cycle, Interrupt};
use sidestep_scenario::Worlds;
use sidestep_session::export::{AnimationOptions, ExportRequest, Format, export};
use sidestep_session::{Error, RecordedRun, Watcher};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The largest export; the command has no such bound.
const MAX_EXPORT_BYTES: u64 = 256 << 20;

/// Returns a recorded run in another format.
pub(crate) async fn answer(
    State(house): State<Arc<AppState>>,
    headers: HeaderMap,
    uri: Uri,
) -> Response {
    if let Err(refusal) = house.guard.authorize_fetch(&headers) {
        return refusal.into_response();
    }
    export_response(&house, &QueryFields::from_query(uri.query()))
        .await
        .unwrap_or_else(ResultError::into_response)
}

async fn export_response(house: &AppState, fields: &QueryFields) -> Result<Response, ResultError> {
    let path = house.means.files.resolve(fields.require("path")?)?;
    let wanted = ExportSpec::from_fields(fields)?;
    let worlds = house.means.worlds.clone();
    let workers = house.means.workers;
    let name = wanted.file_name(&path);
    let media = wanted.media;
    let work = move |client: &CancelToken| write_export(&worlds, &path, &wanted, workers, client);
    let bytes = house.workshop.run(work).await?;
    let disposition = format!("attachment; filename=\"{name}\"");
    let about = [
        (CONTENT_TYPE, media),
        (CACHE_CONTROL, "no-store"),
        (CONTENT_DISPOSITION, disposition.as_str()),
    ];
    Ok((about, bytes).into_response())
}

/// The part of a run that is wanted, and its format.
struct ExportSpec {
    form: Format,
    /// The text that is added to the name of the run.
    ending: String,
    media: &'static str,
    cycle: Option<Cycle>,
}

impl ExportSpec {
    fn from_fields(fields: &QueryFields) -> Result<Self, ResultError> {
        let table = || fields.require("table").map(String::from);
        let (form, media) = match fields.require("as")? {
            "csv" => (Format::Csv(Some(table()?)), "text/csv; charset=utf-8"),
            "parquet" => (Format::Parquet(Some(table()?)), "application/vnd.apache.parquet"),
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
        let ending = match &form {
            Format::Csv(Some(table)) => format!("-{table}.csv"),
            Format::Parquet(Some(table)) => format!("-{table}.parquet"),
            _ => format!(".{}", fields.require("as")?),
        };
        let cycle =
            fields.get("cycle").map(|cycle| cycle.parse().map_err(|_| no_such_cycle(cycle)));
        Ok(Self { form, ending, media, cycle: cycle.transpose()? })
    }

    /// Returns the name of the file.
    fn file_name(&self, path: &Path) -> String {
        let whole: PathBuf = path.canonicalize().unwrap_or_else(|_| path.to_path_buf());
        let stem = if whole.is_file() { whole.file_stem() } else { whole.file_name() };
        plain_file_name(&(stem.unwrap_or_default().to_string_lossy() + self.ending.as_str()))
    }
}

fn no_such_cycle(text: &str) -> Problem {
    Problem::new("export", format!("`{text}` is no cycle"), "give a whole number")
}

/// Returns a name of a file that needs no quoting anywhere.
pub(super) fn plain_file_name(name: &str) -> String {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "-_.".contains(c);
    let name: String = name.chars().map(|c| if is_plain(c) { c } else { '-' }).collect();
    if name.starts_with('.') || name.is_empty() { format!("run{name}") } else { name }
}

/// Exports to a temporary folder; returns the content of the file.
fn write_export(
    worlds: &Worlds,
    path: &Path,
    wanted: &ExportSpec,
    workers: usize,
    client: &CancelToken,
) -> Result<Vec<u8>, ResultError> {
    let recorded = RecordedRun::open(worlds, path).map_err(|e| result_error(&e))?;
    let place = tempfile::tempdir()
        .map_err(|e| result_error(&Error::cannot_write(&std::env::temp_dir(), &e)))?;
    let out = place.path().join("export");
    let until = wanted.cycle.filter(|_| !matches!(wanted.form, Format::Svg | Format::Png { .. }));
    let from = if until.is_some() { None } else { wanted.cycle };
    let asked = ExportRequest {
        form: wanted.form.clone(),
        out: Some(&out),
        replace: false,
        from,
        until,
        every: None,
        workers,
    };
    let bounded = SizeLimitWatcher { client, folder: place.path() };
    match export(&recorded, &asked, &bounded) {
        Err(_) if bounded.is_too_large() => Err(too_large()),
        Err(error) => Err(result_error(&error)),
        Ok(_) if bounded.is_too_large() => Err(too_large()),
        Ok(_) => std::fs::read(&out).map_err(|e| result_error(&Error::cannot_write(&out, &e))),
    }
}

fn too_large() -> ResultError {
    let cause = format!("it would have more than {} MiB", MAX_EXPORT_BYTES >> 20);
    let remedy = "use the command, which has no such bound: sidestep export";
    ResultError::new(StatusCode::PAYLOAD_TOO_LARGE, Problem::new("export", cause, remedy))
}

/// A watcher that stops an export that becomes too large.
struct SizeLimitWatcher<'a> {
    client: &'a CancelToken,
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
        self.client.should_continue() && !self.is_too_large()
    }

    fn interrupt(&self) -> Interrupt {
        self.client.interrupt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_files_are_plain_whatever_the_folder_is_called() {
        assert_eq!(plain_file_name("office 2\"\r\n; é.csv"), "office-2------.csv");
        assert_eq!([plain_file_name(""), plain_file_name(".svg")], ["run", "run.svg"]);
    }

    #[test]
    fn what_is_wanted_is_read_or_refused_in_words() {
        let of = |query: &str| ExportSpec::from_fields(&QueryFields::from_query(Some(query)));
        let wanted = of("as=csv&table=events").unwrap_or_else(|_| panic!("a table"));
        assert_eq!(wanted.file_name(Path::new("/no/office")), "office-events.csv");
        for query in ["as=csv", "as=exe", "", "as=svg&cycle=-1", "as=png&cycle=x"] {
            assert!(of(query).is_err(), "{query}");
        }
        assert_eq!(of("as=png&cycle=12").ok().and_then(|wanted| wanted.cycle), Some(12));
    }
}
