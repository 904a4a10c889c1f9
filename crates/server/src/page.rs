//! The page: files that `build.rs` has put into the program.

use axum::http::header::{CACHE_CONTROL, CONTENT_TYPE, ETAG, IF_NONE_MATCH};
use axum::http::{HeaderMap, StatusCode};
use axum::response::{IntoResponse, Response};

/// A file of the page.
struct Asset {
    /// Its path below the page's address.
    path: &'static str,
    /// Its media type.
    media: &'static str,
    /// A digest of its content.
    tag: &'static str,
    bytes: &'static [u8],
}

include!(concat!(env!("OUT_DIR"), "/assets.rs"));

/// Files in this folder have a digest in their names: what has been loaded once stays right.
const LASTING: &str = "assets/";

/// Returns the file at a path. A path without a dot is the page itself, so that its own addresses can be opened.
pub(crate) fn answer(path: &str, headers: &HeaderMap) -> Response {
    let path = path.trim_start_matches('/');
    let is_page = path.is_empty() || !path.rsplit('/').next().unwrap_or_default().contains('.');
    let name = if is_page { "index.html" } else { path };
    let Some(asset) = ASSETS.iter().find(|asset| asset.path == name) else {
        return (StatusCode::NOT_FOUND, "There is no such file.\n").into_response();
    };
    let is_lasting = asset.path.starts_with(LASTING);
    let cache = if is_lasting { "public, max-age=31536000, immutable" } else { "no-cache" };
    let about = [(CACHE_CONTROL, cache), (ETAG, asset.tag)];
    match headers.get(IF_NONE_MATCH).is_some_and(|known| known == asset.tag) {
        true => (StatusCode::NOT_MODIFIED, about).into_response(),
        false => (about, [(CONTENT_TYPE, asset.media)], asset.bytes).into_response(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_page_is_there_under_all_its_addresses_and_nothing_else_is() {
        let status = |path: &str| answer(path, &HeaderMap::new()).status();
        for path in ["/", "/index.html", "/runs/3", ""] {
            assert_eq!(status(path), StatusCode::OK, "{path}");
        }
        for path in ["/../Cargo.toml", "/assets/../index.html", "/none.js", "/%2e%2e/Cargo.toml"] {
            assert_eq!(status(path), StatusCode::NOT_FOUND, "{path}");
        }
    }

    #[test]
    fn what_the_browser_has_is_not_sent_again() {
        let first = answer("/", &HeaderMap::new());
        let mut headers = HeaderMap::new();
        headers.insert(IF_NONE_MATCH, first.headers()[ETAG].clone());
        assert_eq!(answer("/", &headers).status(), StatusCode::NOT_MODIFIED);
        assert_eq!(first.headers()[CACHE_CONTROL], "no-cache");
    }
}
