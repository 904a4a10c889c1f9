//! Compression of responses: gzip, which all browsers of today accept.

use axum::http::HeaderMap;
use axum::http::header::ACCEPT_ENCODING;
use flate2::Compression;
use flate2::write::GzEncoder;
use std::io::Write;

/// Returns whether a browser accepts gzip: not with the weight `q=0`.
pub(crate) fn accepts_gzip(headers: &HeaderMap) -> bool {
    let values = headers.get_all(ACCEPT_ENCODING).iter().filter_map(|value| value.to_str().ok());
    let mut parts = values.flat_map(|value| value.split(','));
    parts.any(|part| {
        let (name, weight) = part.split_once(';').unwrap_or((part, ""));
        let weight = weight.trim().trim_start_matches("q=");
        name.trim().eq_ignore_ascii_case("gzip") && !weight.parse().is_ok_and(|q: f64| q == 0.0)
    })
}

pub(crate) fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = GzEncoder::new(Vec::with_capacity(bytes.len() / 3), Compression::default());
    // Writing to memory cannot fail.
    let written = encoder.write_all(bytes).and_then(|()| encoder.finish());
    written.unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Read;

    #[test]
    fn gzip_is_given_to_who_takes_it_and_is_read_back() {
        let takes = |said: &str| {
            accepts_gzip(&HeaderMap::from_iter([(ACCEPT_ENCODING, said.parse().expect("a value"))]))
        };
        for said in ["gzip", "deflate, GZIP;q=0.5", "br;q=1.0, gzip"] {
            assert!(takes(said), "{said}");
        }
        for said in ["", "br", "gzip;q=0", "gzip; q=0.0", "x-gzip"] {
            assert!(!takes(said), "{said}");
        }
        assert!(!accepts_gzip(&HeaderMap::new()));
        let mut text = String::new();
        let words = "words ".repeat(1000);
        let zipped = gzip(words.as_bytes());
        flate2::read::GzDecoder::new(zipped.as_slice()).read_to_string(&mut text).expect("gzip");
        assert_eq!((text, zipped.len() < 100), (words, true));
    }
}
