//! The routes of the server, and the headers of all its answers.

use crate::access::AccessError;
use crate::request::MAX_REQUEST_BYTES;
use crate::state::AppState;
use crate::{drops, gallery_picture, page, results, socket, usage};
use axum::Router;
use axum::extract::ws::WebSocketUpgrade;
use axum::extract::{DefaultBodyLimit, Request, State};
use axum::http::{HeaderMap, HeaderName, HeaderValue, StatusCode, Uri, header};
use axum::middleware::{Next, from_fn, from_fn_with_state};
use axum::response::{IntoResponse, Response};
use axum::routing::{get, post};
use std::sync::Arc;
use std::time::Duration;

/// Maximum size of the body of a request: the only one is the token, and some room.
const MAX_BODY_BYTES: usize = 256;
/// The time in which a token must arrive.
const TOKEN_TIMEOUT: Duration = Duration::from_secs(10);
/// Maximum size of a WebSocket message. One that is longer than a request may be gets an answer that says so; beyond this the
/// socket is closed.
const MAX_MESSAGE_BYTES: usize = MAX_REQUEST_BYTES + (8 << 20);

/// Headers of every answer, unless it has its own: the page loads nothing from elsewhere, and is shown in no other
/// page.
const HEADERS: [(HeaderName, &str); 6] = [
    (
        header::CONTENT_SECURITY_POLICY,
        "default-src 'self'; img-src 'self' data:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
    ),
    (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
    (header::X_FRAME_OPTIONS, "DENY"),
    (header::REFERRER_POLICY, "no-referrer"),
    (HeaderName::from_static("cross-origin-opener-policy"), "same-origin"),
    (HeaderName::from_static("cross-origin-resource-policy"), "same-origin"),
];

/// Returns the routes: the page, its socket, and the entrance for holders of the token.
pub(crate) fn routes(state: Arc<AppState>) -> Router {
    Router::new()
        .route("/socket", get(upgrade))
        .route("/enter", get(access_status).post(sign_in).layer(from_fn(with_body_timeout)))
        .route("/report", get(results::report))
        .route("/export", get(results::export))
        .route("/picture", get(gallery_picture::answer))
        .route("/drop", post(drops::answer))
        .route("/usage", get(usage::answer))
        .fallback(get(file))
        .layer(DefaultBodyLimit::max(MAX_BODY_BYTES))
        .layer(from_fn_with_state(state.clone(), check_access))
        .with_state(state)
}

/// Lets requests of our own page through, and adds the headers of every answer.
async fn check_access(
    State(state): State<Arc<AppState>>,
    request: Request,
    next: Next,
) -> Response {
    let mut response = match state.access.check_origin(request.headers()) {
        Ok(()) => next.run(request).await,
        Err(refusal) => refusal.into_response(),
    };
    for (name, value) in HEADERS {
        // A report has a Content-Security-Policy of its own.
        response.headers_mut().entry(name).or_insert(HeaderValue::from_static(value));
    }
    response
}

/// Gives up a request if its body does not arrive.
async fn with_body_timeout(request: Request, next: Next) -> Response {
    let answer = tokio::time::timeout(TOKEN_TIMEOUT, next.run(request)).await;
    answer.unwrap_or_else(|_| StatusCode::REQUEST_TIMEOUT.into_response())
}

async fn upgrade(
    State(state): State<Arc<AppState>>,
    headers: HeaderMap,
    upgrade: WebSocketUpgrade,
) -> Response {
    if let Err(refusal) = state.access.authorize(&headers) {
        return refusal.into_response();
    }
    let upgrade = upgrade.max_message_size(MAX_MESSAGE_BYTES).max_frame_size(MAX_MESSAGE_BYTES);
    let Some(permit) = state.acquire_socket() else { return too_many_pages() };
    upgrade.on_upgrade(move |socket| socket::serve(socket, state, permit))
}

/// Refuses a further page.
fn too_many_pages() -> Response {
    let text =
        "So many pages are open that there is no place for another one: close one of them.\n";
    (StatusCode::SERVICE_UNAVAILABLE, text).into_response()
}

/// Answers whether the browser has the cookie, and whether another page may connect.
async fn access_status(State(state): State<Arc<AppState>>, headers: HeaderMap) -> Response {
    match state.access.authorize(&headers) {
        Ok(()) if state.is_socket_limit_reached() => too_many_pages(),
        Ok(()) => StatusCode::NO_CONTENT.into_response(),
        Err(refusal) => refusal.into_response(),
    }
}

/// Gives the cookie to a client that knows the token.
async fn sign_in(State(state): State<Arc<AppState>>, token: String) -> Response {
    match state.access.sign_in(&token) {
        Ok(cookie) => (StatusCode::NO_CONTENT, [(header::SET_COOKIE, cookie)]).into_response(),
        Err(refusal) => refusal.into_response(),
    }
}

async fn file(uri: Uri, headers: HeaderMap) -> Response {
    page::answer(uri.path(), &headers)
}

impl IntoResponse for AccessError {
    fn into_response(self) -> Response {
        match self {
            Self::Host => {
                let text = "This name is not the studio's: use the address that it printed.\n";
                (StatusCode::MISDIRECTED_REQUEST, text).into_response()
            }
            Self::Origin => {
                let text = "Only the studio's own page may ask.\n";
                (StatusCode::FORBIDDEN, text).into_response()
            }
            Self::Token => {
                let text = "Open the whole address that the studio printed, with its token.\n";
                (StatusCode::UNAUTHORIZED, text).into_response()
            }
        }
    }
}
