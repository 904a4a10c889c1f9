//! The request with a file that was dropped on the page.

use crate::drop_folder::MAX_FILE_BYTES;
use crate::protocol::Problem;
use crate::results::{HttpError, QueryFields};
use crate::state::AppState;
use axum::body::to_bytes;
use axum::extract::{Request, State};
use axum::response::{IntoResponse, Response};
use std::sync::Arc;
use std::time::Duration;
use tokio::task::spawn_blocking;
use tokio::time::timeout;

/// Longest time for which a file has the turn while its bytes come: a page that is closed meanwhile sends no more.
const MAX_ARRIVAL_TIME: Duration = Duration::from_secs(120);

/// Keeps a copy of the file in the body of a request: `POST /drop?path=FOLDER/NAME`. Answers where it is.
pub(crate) async fn answer(State(state): State<Arc<AppState>>, request: Request) -> Response {
    if let Err(refusal) = state.access.authorize_fetch(request.headers()) {
        return refusal.into_response();
    }
    store_body(&state, request).await.unwrap_or_else(HttpError::into_response)
}

async fn store_body(state: &AppState, request: Request) -> Result<Response, HttpError> {
    let fields = QueryFields::from_query(request.uri().query());
    let path = fields.require("path")?.to_string();
    if state.deps.read_only {
        let remedy = "start the studio with the folder of the file, or without --read-only";
        return Err(Problem::new(path, "no files are taken here", remedy).into());
    }
    let drops = state.deps.files.drops();
    // The semaphore is never closed.
    let _turn = drops.turn.acquire().await.map_err(|_| internal_error(&path))?;
    let arrival = timeout(MAX_ARRIVAL_TIME, to_bytes(request.into_body(), MAX_FILE_BYTES)).await;
    // Too late, cut off or too large: in each case its folder is the way.
    let body = arrival.ok().and_then(Result::ok).ok_or_else(|| {
        let seconds = MAX_ARRIVAL_TIME.as_secs();
        let limit_mib = MAX_FILE_BYTES >> 20;
        let cause = format!("is cut off, larger than {limit_mib} MiB, or takes over {seconds} s");
        let remedy = "start the studio with its folder instead: `sidestep studio FOLDER`";
        Problem::new(path.as_str(), cause, remedy)
    })?;
    let keeper = drops.clone();
    let name = path.clone();
    let kept = spawn_blocking(move || keeper.store(&name, &body)).await;
    let kept = kept.map_err(|_| internal_error(&path))??;
    Ok(kept.display().to_string().into_response())
}

fn internal_error(path: &str) -> Problem {
    Problem::new(path, "internal error (a bug in Sidestep)", "please report it")
}
