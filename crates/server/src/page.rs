//! The page: files that `build.rs` has put into the program.

use crate::compress;
use axum::http::header::{
    CACHE_CONTROL, CONTENT_ENCODING, CONTENT_TYPE, ETAG, IF_NONE_MATCH, VARY,
};
use axum::http::{HeaderMap, StatusCode};
use axum::response::{IntoResponse, Response};
use std::collections::BTreeMap;
use std::sync::LazyLock;

/// A file of the page, in the table that `build.rs` writes.
struct PageAsset {
    /// Its path below the page's address.
    path: &'static str,
    /// Its media type.
    media: &'static str,
    /// A digest of its content.
    tag: &'static str,
    bytes: &'static [u8],
}

include!(concat!(env!("OUT_DIR"), "/assets.rs"));

/// Files that are smaller as gzip, made once.
static GZIPPED: LazyLock<BTreeMap<&str, Vec<u8>>> = LazyLock::new(|| {
    let zipped = ASSETS.iter().map(|asset| (asset, compress::gzip(asset.bytes)));
    let smaller = zipped.filter(|(asset, zipped)| zipped.len() < asset.bytes.len());
    smaller.map(|(asset, zipped)| (asset.path, zipped)).collect()
});

/// Files in this folder have a digest in their names, so a browser may keep them for good.
const IMMUTABLE_FOLDER: &str = "assets/";

/// Returns the file at a path. A path without a dot is the page itself, so that the addresses that it shows can be opened.
pub(crate) fn answer(path: &str, headers: &HeaderMap) -> Response {
    let path = path.trim_start_matches('/');
    let is_page = path.is_empty() || !path.rsplit('/').next().unwrap_or_default().contains('.');
    let name = if is_page { "index.html" } else { path };
    let Some(asset) = find(name) else {
        return (StatusCode::NOT_FOUND, "There is no such file.\n").into_response();
    };
    let is_immutable = asset.path.starts_with(IMMUTABLE_FOLDER);
    let cache = if is_immutable { "public, max-age=31536000, immutable" } else { "no-cache" };
    let zipped = GZIPPED.get(asset.path).filter(|_| compress::accepts_gzip(headers));
    // HTTP wants another tag for other bytes, even if they decode to the same.
    let tag = if zipped.is_some() {
        asset.tag.trim_end_matches('"').to_string() + "-gzip\""
    } else {
        asset.tag.to_string()
    };
    let is_known = headers.get(IF_NONE_MATCH).is_some_and(|known| known == tag.as_str());
    let about = [(CACHE_CONTROL, cache), (ETAG, tag.as_str()), (VARY, "accept-encoding")];
    let media = [(CONTENT_TYPE, asset.media)];
    if is_known {
        return (StatusCode::NOT_MODIFIED, about).into_response();
    }
    match zipped {
        Some(zipped) => {
            (about, media, [(CONTENT_ENCODING, "gzip")], zipped.as_slice()).into_response()
        }
        None => (about, media, asset.bytes).into_response(),
    }
}

/// The files that the page needs first; it loads others only to edit.
pub(crate) struct EntryFiles<'a> {
    pub(crate) script: &'a str,
    pub(crate) style: &'a str,
    pub(crate) icon: &'a [u8],
}

/// Returns the files that the page needs first; none where the program has no page.
pub(crate) fn entry_files() -> Option<EntryFiles<'static>> {
    let index = std::str::from_utf8(find("index.html")?.bytes).ok()?;
    // Written by the page's build: each attribute occurs once with this ending.
    let referred = |ending: &str| {
        let mut values = index.split('"');
        let path = values.find(|value| value.starts_with('/') && value.ends_with(ending))?;
        find(path.trim_start_matches('/'))
    };
    Some(EntryFiles {
        script: std::str::from_utf8(referred(".js")?.bytes).ok()?,
        style: std::str::from_utf8(referred(".css")?.bytes).ok()?,
        icon: referred(".svg")?.bytes,
    })
}

fn find(path: &str) -> Option<&'static PageAsset> {
    ASSETS.iter().find(|asset| asset.path == path)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_the_page_needs_first_is_one_script_and_one_style() {
        let Some(EntryFiles { script, style, .. }) = entry_files() else { return };
        // A replay in one file has no place for a second one.
        assert!(!script.contains("from\"./") && !script.contains("import\"./"));
        assert!(!style.contains("url(") && !style.contains("@import") && !style.contains("</"));
    }

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
    fn a_file_is_small_for_who_takes_gzip_and_says_so() {
        let mut takes = HeaderMap::new();
        takes.insert("accept-encoding", "gzip, br".parse().expect("a value"));
        let (plain, small) = (answer("/", &HeaderMap::new()), answer("/", &takes));
        assert_eq!(small.headers()[CONTENT_ENCODING], "gzip");
        assert!(!plain.headers().contains_key(CONTENT_ENCODING));
        assert_ne!(plain.headers()[ETAG], small.headers()[ETAG]);
        for answer in [&plain, &small] {
            assert_eq!(answer.headers()[VARY], "accept-encoding");
        }
        takes.insert(IF_NONE_MATCH, small.headers()[ETAG].clone());
        assert_eq!(answer("/", &takes).status(), StatusCode::NOT_MODIFIED);
        takes.insert(IF_NONE_MATCH, plain.headers()[ETAG].clone());
        assert_eq!(answer("/", &takes).status(), StatusCode::OK, "it has other bytes");
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
