//! The memory that the server uses, by what it is for. All that grows while runs are played has a bound, and all that a
//! session keeps ends with it.

use crate::drop_folder::MAX_DROPPED_BYTES;
use crate::protocol::ServerUsage;
use crate::state::AppState;
use crate::usage_registry::{StoreBytes, store};
use axum::extract::State;
use axum::http::HeaderMap;
use axum::http::header::{CACHE_CONTROL, CONTENT_TYPE};
use axum::response::{IntoResponse, Response};
use std::sync::Arc;

/// Returns the memory that a server uses.
pub(crate) fn server_usage(state: &AppState) -> ServerUsage {
    let dropped =
        StoreBytes { used: state.deps.files.drops().used_bytes(), max: MAX_DROPPED_BYTES };
    let mut stores = state.deps.usage.stores();
    stores.push(store(None, "the report shown last", state.jobs.report_bytes()));
    stores.push(store(None, "dropped files, on the disk", dropped));
    let (sessions, max_sessions) = state.session_count();
    ServerUsage { stores, resident_bytes: resident_bytes(), sessions, max_sessions }
}

/// Returns the memory that a server uses, as JSON: `GET /usage`.
pub(crate) async fn answer(State(state): State<Arc<AppState>>, headers: HeaderMap) -> Response {
    if let Err(refusal) = state.access.authorize_fetch(&headers) {
        return refusal.into_response();
    }
    let about = [(CONTENT_TYPE, "application/json"), (CACHE_CONTROL, "no-store")];
    let text = serde_json::json!(server_usage(&state)).to_string();
    (about, text).into_response()
}

/// Returns the bytes of memory of this process; `None` where the system does not tell them in a file.
fn resident_bytes() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"))?;
    let kib: u64 = line.split_whitespace().next()?.parse().ok()?;
    Some(kib << 10)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[cfg(target_os = "linux")]
    #[test]
    fn the_memory_of_the_process_is_that_of_a_program() {
        let bytes = resident_bytes().expect("Linux tells it");
        assert!(bytes > 1 << 20 && bytes < 1 << 40, "{bytes}");
    }
}
