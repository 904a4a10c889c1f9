//! The routes of the server, and the headers of all its answers.

use crate::access::AccessError;
use crate::request::MAX_REQUEST_BYTES;
use crate::state::AppState;
use crate::{page, results, socket};
use axum::Router;
use axum::extract::ws::WebSocketUpgrade;
use axum::extract::{DefaultBodyLimit, Request, State};
use axum::http::{HeaderMap, HeaderName, HeaderValue, StatusCode, Uri, header};
use axum::middleware::{Next, from_fn, from_fn_with_state};
use axum::response::{IntoResponse, Response};
use axum::routing::get;
use std::sync::Arc;
use std::time::Duration;

/// Longest body of a request that is no socket: a token.
const MAX_BODY_BYTES: usize = 256;
/// The longest time for a token to arrive.
const TOKEN_TIMEOUT: Duration = Duration::from_secs(10);
/// Longest message of a socket. Longer ones than a request may be are answered; beyond this the socket is closed.
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
pub(crate) fn routes(house: Arc<AppState>) -> Router {
    Router::new()
        .route("/socket", get(upgrade))
        .route("/enter", get(access_status).post(sign_in).layer(from_fn(with_body_timeout)))
        .route("/report", get(results::report))
        .route("/export", get(results::export))
        .fallback(get(file))
        .layer(DefaultBodyLimit::max(MAX_BODY_BYTES))
        .layer(from_fn_with_state(house.clone(), check_access))
        .with_state(house)
}

/// Lets requests of our own page through, and adds the headers of every answer.
async fn check_access(
    State(house): State<Arc<AppState>>,
    request: Request,
    next: Next,
) -> Response {
    let mut response = match house.guard.check_origin(request.headers()) {
        Ok(()) => next.run(request).await,
        Err(refusal) => refusal.into_response(),
    };
    for (name, value) in HEADERS {
        // A report has rights different from the page's.
        response.headers_mut().entry(name).or_insert(HeaderValue::from_static(value));
    }
    response
}

/// Gives up a request if its body does not come.
async fn with_body_timeout(request: Request, next: Next) -> Response {
    let answer = tokio::time::timeout(TOKEN_TIMEOUT, next.run(request)).await;
    answer.unwrap_or_else(|_| StatusCode::REQUEST_TIMEOUT.into_response())
}

async fn upgrade(
    State(house): State<Arc<AppState>>,
    headers: HeaderMap,
    upgrade: WebSocketUpgrade,
) -> Response {
    if let Err(refusal) = house.guard.authorize(&headers) {
        return refusal.into_response();
    }
    let upgrade = upgrade.max_message_size(MAX_MESSAGE_BYTES).max_frame_size(MAX_MESSAGE_BYTES);
    let Some(seat) = house.acquire_socket() else { return too_many_pages() };
    upgrade.on_upgrade(move |socket| socket::serve(socket, house, seat))
}

/// Refuses a further page.
fn too_many_pages() -> Response {
    let words =
        "So many pages are open that there is no place for another one: close one of them.\n";
    (StatusCode::SERVICE_UNAVAILABLE, words).into_response()
}

/// Answers whether the browser has the cookie, and whether there is a place for its page.
async fn access_status(State(house): State<Arc<AppState>>, headers: HeaderMap) -> Response {
    match house.guard.authorize(&headers) {
        Ok(()) if house.is_full() => too_many_pages(),
        Ok(()) => StatusCode::NO_CONTENT.into_response(),
        Err(refusal) => refusal.into_response(),
    }
}

/// Gives the cookie to a client that knows the token.
async fn sign_in(State(house): State<Arc<AppState>>, said: String) -> Response {
    match house.guard.sign_in(&said) {
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
                let words = "This name is not the studio's: use the address that it printed.\n";
                (StatusCode::MISDIRECTED_REQUEST, words).into_response()
            }
            Self::Origin => {
                let words = "Only the studio's own page may ask.\n";
                (StatusCode::FORBIDDEN, words).into_response()
            }
            Self::Token => {
                let words = "Open the whole address that the studio printed, with its token.\n";
                (StatusCode::UNAUTHORIZED, words).into_response()
            }
        }
    }
}
