//! Reports: the page of `sidestep report` in a frame, and its parts as files.

use super::HttpError;
use super::job_queue::{CancelToken, to_http_error};
use super::query::QueryFields;
use crate::compress;
use crate::protocol::Problem;
use crate::state::AppState;
use axum::extract::State;
use axum::http::header::{
    CACHE_CONTROL, CONTENT_DISPOSITION, CONTENT_ENCODING, CONTENT_SECURITY_POLICY, CONTENT_TYPE,
    VARY, X_FRAME_OPTIONS,
};
use axum::http::{HeaderMap, HeaderValue, Uri};
use axum::response::{IntoResponse, Response};
use sidestep_report::{RenderedReport, SvgFile, render};
use sidestep_scenario::Worlds;
use sidestep_session::report::document;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The policy of the page of a report, unlike that of all others: it runs its inline scripts, in our frame, and nothing
/// else. It has no origin, so it could send no requests even if a name in it were taken for a script.
const REPORT_POLICY: &str = "sandbox allow-scripts; default-src 'none'; script-src 'unsafe-inline'; \
    style-src 'unsafe-inline'; img-src data: blob:; font-src data:; base-uri 'none'; form-action 'none'; \
    frame-ancestors 'self'";

/// Returns the report of a folder, or a part of it.
pub(crate) async fn answer(
    State(state): State<Arc<AppState>>,
    headers: HeaderMap,
    uri: Uri,
) -> Response {
    if let Err(refusal) = state.access.authorize_fetch(&headers) {
        return refusal.into_response();
    }
    let fields = QueryFields::from_query(uri.query());
    let accepts_gzip = compress::accepts_gzip(&headers);
    report_response(&state, &fields, accepts_gzip).await.unwrap_or_else(HttpError::into_response)
}

async fn report_response(
    state: &AppState,
    fields: &QueryFields,
    is_zipped: bool,
) -> Result<Response, HttpError> {
    let path = state.deps.files.resolve(fields.require("path")?)?;
    let part = fields.get("as").map(String::from);
    let worlds = state.deps.worlds.clone();
    // The report itself is rendered anew each time: its run or sweep may have grown.
    let cached = state.jobs.cached_report(&path).filter(|_| part.is_some());
    let folder = path.clone();
    let rendering = state.jobs.run(move |cancel: &CancelToken| match cached {
        Some(report) => Ok(report),
        None => render_report(&worlds, &folder, cancel).map(Arc::new),
    });
    let report = rendering.await?;
    state.jobs.cache_report(path.clone(), report.clone());
    // A job, because gzip of a large report takes some time.
    let extraction = state.jobs.run(move |_: &CancelToken| {
        ReportPart::from_report(&report, &path, part.as_deref(), is_zipped)
    });
    Ok(extraction.await?.into_response())
}

fn render_report(
    worlds: &Worlds,
    folder: &Path,
    cancel: &CancelToken,
) -> Result<RenderedReport, HttpError> {
    let document = document(worlds, folder, cancel).map_err(|e| to_http_error(&e))?;
    render(&document, "figures").map_err(|e| to_http_error(&e.into()))
}

/// A part of a report that is sent.
struct ReportPart {
    media: &'static str,
    /// The name of the file that the browser saves; none where it shows the part.
    file: Option<String>,
    bytes: Vec<u8>,
    is_zipped: bool,
}

impl ReportPart {
    fn from_report(
        report: &RenderedReport,
        path: &Path,
        part: Option<&str>,
        is_zipped: bool,
    ) -> Result<Self, HttpError> {
        let name = folder_name(path);
        let (media, file, text) = match part {
            None => ("text/html; charset=utf-8", None, report.html.clone()),
            Some("html") => {
                ("text/html; charset=utf-8", Some(format!("{name}.html")), report.html.clone())
            }
            Some("markdown") => {
                let file = Some(format!("{name}.md"));
                ("text/markdown; charset=utf-8", file, report.markdown.clone())
            }
            Some("figures") => ("application/json", None, figure_names_json(report)),
            Some(stem) => {
                let found = report.pictures.iter().find(|picture| picture.stem == stem);
                let SvgFile { stem, svg } = found.ok_or_else(|| no_such_figure(stem))?;
                ("image/svg+xml", Some(format!("{name}-{stem}.svg")), svg.clone())
            }
        };
        let bytes = if is_zipped { compress::gzip(text.as_bytes()) } else { text.into_bytes() };
        Ok(Self { media, file, bytes, is_zipped })
    }
}

/// Returns the names of all figures as JSON, by which the page asks for each.
fn figure_names_json(report: &RenderedReport) -> String {
    let stems: Vec<&str> = report.pictures.iter().map(|picture| picture.stem.as_str()).collect();
    serde_json::json!(stems).to_string()
}

fn no_such_figure(stem: &str) -> Problem {
    let cause = format!("the report has no figure `{stem}`");
    Problem::new("report", cause, "give html, markdown, or one of figures")
}

/// Returns the name of a folder as part of a file name, in plain characters only.
fn folder_name(path: &Path) -> String {
    let whole: PathBuf = path.canonicalize().unwrap_or_else(|_| path.to_path_buf());
    super::export::sanitize_file_name(&whole.file_stem().unwrap_or_default().to_string_lossy())
}

impl IntoResponse for ReportPart {
    fn into_response(self) -> Response {
        let mut response = self.bytes.into_response();
        let headers = response.headers_mut();
        headers.insert(CONTENT_TYPE, HeaderValue::from_static(self.media));
        headers.insert(CACHE_CONTROL, HeaderValue::from_static("no-store"));
        headers.insert(VARY, HeaderValue::from_static("accept-encoding"));
        if self.is_zipped {
            headers.insert(CONTENT_ENCODING, HeaderValue::from_static("gzip"));
        }
        headers.insert(CONTENT_SECURITY_POLICY, HeaderValue::from_static(REPORT_POLICY));
        headers.insert(X_FRAME_OPTIONS, HeaderValue::from_static("SAMEORIGIN"));
        if let Some(file) = self.file
            && let Ok(disposition) = format!("attachment; filename=\"{file}\"").parse()
        {
            headers.insert(CONTENT_DISPOSITION, disposition);
        }
        response
    }
}
