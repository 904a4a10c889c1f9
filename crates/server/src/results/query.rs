//! The fields of a query string.

use super::HttpError;
use crate::protocol::Problem;
use std::collections::BTreeMap;

/// The fields after the question mark of an address.
#[derive(Debug, Default)]
pub(crate) struct QueryFields(BTreeMap<String, String>);

impl QueryFields {
    /// Reads fields in the encoding of `encodeURIComponent`.
    pub(crate) fn from_query(query: Option<&str>) -> Self {
        let parts = query.unwrap_or_default().split('&').filter_map(|part| part.split_once('='));
        Self(
            parts
                .filter_map(|(name, value)| Some((percent_decode(name)?, percent_decode(value)?)))
                .collect(),
        )
    }

    /// Returns a field with its percent signs decoded; of several of one name, the last.
    pub(crate) fn get(&self, name: &str) -> Option<&str> {
        self.0.get(name).map(String::as_str)
    }

    /// Returns a required field.
    ///
    /// # Errors
    /// When it is missing.
    pub(crate) fn require(&self, name: &str) -> Result<&str, HttpError> {
        self.get(name).ok_or_else(|| {
            let remedy = format!("add it to the address: ?{name}=...");
            Problem::new("address", format!("it has no `{name}`"), remedy).into()
        })
    }
}

/// Returns a text with its percent signs decoded; `None` if they are malformed.
fn percent_decode(text: &str) -> Option<String> {
    let mut bytes = Vec::with_capacity(text.len());
    let mut parts = text.split('%');
    bytes.extend(parts.next()?.bytes());
    for part in parts {
        let (digits, rest) = part.split_at_checked(2)?;
        bytes.push(u8::from_str_radix(digits, 16).ok()?);
        bytes.extend(rest.bytes());
    }
    String::from_utf8(bytes).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_are_read_as_browsers_write_them_and_others_are_not_there() {
        let fields = QueryFields::from_query(Some(
            "path=runs%2Fa%20%26%20b&as=csv&as=svg&x&=&y=%zz&z=%f&w=%C3",
        ));
        assert_eq!(fields.get("path"), Some("runs/a & b"));
        assert_eq!(fields.get("as"), Some("svg"));
        for name in ["x", "y", "z", "w", "none"] {
            assert!(fields.require(name).is_err(), "{name}");
        }
        assert!(QueryFields::from_query(None).get("path").is_none());
    }
}
