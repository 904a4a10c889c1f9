//! Exports of recorded runs, by the exporters of the command, to a file that the browser saves.

use super::Failed;
use super::fields::Fields;
use super::work::{Client, failed};
use crate::house::House;
use crate::protocol::Problem;
use axum::extract::State;
use axum::http::header::{CACHE_CONTROL, CONTENT_DISPOSITION, CONTENT_TYPE};
use axum::http::{HeaderMap, StatusCode, Uri};
use axum::response::{IntoResponse, Response};
use sidestep::kernel::{Cycle, Interrupt};
use sidestep::scenario::Worlds;
use sidestep_session::export::{Export, Film, Form, export};
use sidestep_session::{Error, Recorded, Watcher};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The largest export; the command has no such bound.
const MOST_BYTES: u64 = 256 << 20;

/// Returns a recorded run in another format.
pub(crate) async fn answer(
    State(house): State<Arc<House>>,
    headers: HeaderMap,
    uri: Uri,
) -> Response {
    if let Err(refusal) = house.guard.trust_fetch(&headers) {
        return refusal.into_response();
    }
    made(&house, &Fields::of(uri.query())).await.unwrap_or_else(Failed::into_response)
}

async fn made(house: &House, fields: &Fields) -> Result<Response, Failed> {
    let path = house.means.files.find(fields.need("path")?)?;
    let wanted = Wanted::of(fields)?;
    let (worlds, workers) = (house.means.worlds, house.means.workers);
    let name = wanted.name(&path);
    let media = wanted.media;
    let work = move |client: &Client| written(worlds, &path, &wanted, workers, client);
    let bytes = house.workshop.work(work).await?;
    let disposition = format!("attachment; filename=\"{name}\"");
    let about = [
        (CONTENT_TYPE, media),
        (CACHE_CONTROL, "no-store"),
        (CONTENT_DISPOSITION, disposition.as_str()),
    ];
    Ok((about, bytes).into_response())
}

/// The part of a run that is wanted, and its format.
struct Wanted {
    form: Form,
    /// The text that is added to the name of the run.
    ending: String,
    media: &'static str,
    cycle: Option<Cycle>,
}

impl Wanted {
    fn of(fields: &Fields) -> Result<Self, Failed> {
        let table = || fields.need("table").map(String::from);
        let (form, media) = match fields.need("as")? {
            "csv" => (Form::Csv(Some(table()?)), "text/csv; charset=utf-8"),
            "parquet" => (Form::Parquet(Some(table()?)), "application/vnd.apache.parquet"),
            "mcap" => (Form::Mcap, "application/octet-stream"),
            "svg" => (Form::Svg, "image/svg+xml"),
            "png" => (Form::Png { width_px: None }, "image/png"),
            "gif" => (Form::Gif(Film::default()), "image/gif"),
            other => {
                let remedy = "give csv, parquet, mcap, svg, png or gif";
                return Err(
                    Problem::new("export", format!("`{other}` is no format"), remedy).into()
                );
            }
        };
        let ending = match &form {
            Form::Csv(Some(table)) => format!("-{table}.csv"),
            Form::Parquet(Some(table)) => format!("-{table}.parquet"),
            _ => format!(".{}", fields.need("as")?),
        };
        let cycle = fields.get("cycle").map(|cycle| cycle.parse().map_err(|_| no_cycle(cycle)));
        Ok(Self { form, ending, media, cycle: cycle.transpose()? })
    }

    /// Returns the name of the file.
    fn name(&self, path: &Path) -> String {
        let whole: PathBuf = path.canonicalize().unwrap_or_else(|_| path.to_path_buf());
        let stem = if whole.is_file() { whole.file_stem() } else { whole.file_name() };
        plain(&(stem.unwrap_or_default().to_string_lossy() + self.ending.as_str()))
    }
}

fn no_cycle(text: &str) -> Problem {
    Problem::new("export", format!("`{text}` is no cycle"), "give a whole number")
}

/// Returns a name of a file that needs no quoting anywhere.
pub(super) fn plain(name: &str) -> String {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "-_.".contains(c);
    let name: String = name.chars().map(|c| if is_plain(c) { c } else { '-' }).collect();
    if name.starts_with('.') || name.is_empty() { format!("run{name}") } else { name }
}

/// Exports to a temporary folder; returns the content of the file.
fn written(
    worlds: Worlds,
    path: &Path,
    wanted: &Wanted,
    workers: usize,
    client: &Client,
) -> Result<Vec<u8>, Failed> {
    let recorded = Recorded::open(worlds, path).map_err(|e| failed(&e))?;
    let place =
        tempfile::tempdir().map_err(|e| failed(&Error::write(&std::env::temp_dir(), &e)))?;
    let out = place.path().join("export");
    let until = wanted.cycle.filter(|_| !matches!(wanted.form, Form::Svg | Form::Png { .. }));
    let from = if until.is_some() { None } else { wanted.cycle };
    let asked = Export {
        form: wanted.form.clone(),
        out: Some(&out),
        replace: false,
        from,
        until,
        every: None,
        workers,
    };
    let bounded = Bounded { client, folder: place.path() };
    match export(&recorded, &asked, &bounded) {
        Err(_) if bounded.is_too_large() => Err(too_large()),
        Err(error) => Err(failed(&error)),
        Ok(_) if bounded.is_too_large() => Err(too_large()),
        Ok(_) => std::fs::read(&out).map_err(|e| failed(&Error::write(&out, &e))),
    }
}

fn too_large() -> Failed {
    let cause = format!("it would have more than {} MiB", MOST_BYTES >> 20);
    let remedy = "use the command, which has no such bound: sidestep export";
    Failed::new(StatusCode::PAYLOAD_TOO_LARGE, Problem::new("export", cause, remedy))
}

/// A watcher that stops an export that becomes too large.
struct Bounded<'a> {
    client: &'a Client,
    folder: &'a Path,
}

impl Bounded<'_> {
    fn is_too_large(&self) -> bool {
        let entries = std::fs::read_dir(self.folder).into_iter().flatten().flatten();
        entries.filter_map(|entry| Some(entry.metadata().ok()?.len())).sum::<u64>() > MOST_BYTES
    }
}

impl Watcher for Bounded<'_> {
    fn go_on(&self) -> bool {
        self.client.go_on() && !self.is_too_large()
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
        assert_eq!(plain("office 2\"\r\n; é.csv"), "office-2------.csv");
        assert_eq!([plain(""), plain(".svg")], ["run", "run.svg"]);
    }

    #[test]
    fn what_is_wanted_is_read_or_refused_in_words() {
        let of = |query: &str| Wanted::of(&Fields::of(Some(query)));
        let wanted = of("as=csv&table=events").unwrap_or_else(|_| panic!("a table"));
        assert_eq!(wanted.name(Path::new("/no/office")), "office-events.csv");
        for query in ["as=csv", "as=exe", "", "as=svg&cycle=-1", "as=png&cycle=x"] {
            assert!(of(query).is_err(), "{query}");
        }
        assert_eq!(of("as=png&cycle=12").ok().and_then(|wanted| wanted.cycle), Some(12));
    }
}
