//! The request for the picture of a scenario that the program carries.

use crate::gallery::find_shipped;
use crate::results::QueryFields;
use crate::state::AppState;
use axum::extract::State;
use axum::http::header::{CACHE_CONTROL, CONTENT_TYPE};
use axum::http::{HeaderMap, StatusCode, Uri};
use axum::response::{IntoResponse, Response};
use std::sync::Arc;

/// Returns the picture of a scenario: `/picture?name=robots/office`.
pub(crate) async fn answer(
    State(state): State<Arc<AppState>>,
    headers: HeaderMap,
    uri: Uri,
) -> Response {
    if let Err(refusal) = state.access.authorize_fetch(&headers) {
        return refusal.into_response();
    }
    let fields = QueryFields::from_query(uri.query());
    let name = fields.get("name").unwrap_or_default();
    let Ok(shipped) = find_shipped(state.deps.gallery, name) else {
        return (StatusCode::NOT_FOUND, "There is no such picture.\n").into_response();
    };
    // Another build may have another picture at the same address.
    let about = [(CONTENT_TYPE, "image/png"), (CACHE_CONTROL, "private, max-age=3600")];
    (about, shipped.picture_png).into_response()
}
