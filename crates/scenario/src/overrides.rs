//! Overrides: `key=value` set in the text of a scenario, keeping its comments and its order.

use crate::edit::EditError;
use crate::source::{OVERRIDES_SUFFIX, Source};
use sidestep_kernel::InputError;
use toml_edit::Value;

impl Source {
    /// Applies `key=value` overrides: `seed=3`, `robots.count=20`, `map.file="x.yaml"`. A value
    /// that is not TOML is taken as text. The only table of an array needs no index;
    /// several are counted from 0 (`robots.1.count`).
    ///
    /// # Errors
    /// When the text is not TOML, or a key leads through something that is not a table.
    pub fn with_overrides(mut self, overrides: &[String]) -> Result<Self, InputError> {
        // Without overrides the text stays the same, byte for byte.
        if overrides.is_empty() {
            return Ok(self);
        }
        let overrides: Vec<Override<'_>> =
            overrides.iter().map(|text| parse_override(text)).collect::<Result<_, _>>()?;
        let values: Vec<(&str, String)> = overrides
            .iter()
            .map(|one| (one.key, one.value.to_string().trim().to_string()))
            .collect();
        let remaining = self.replace_values(&values);
        for Override { place, key, value } in remaining.into_iter().map(|k| &overrides[k]) {
            let input_error = |error: EditError| InputError::new(place, error.cause, error.remedy);
            self.set_to(key, value, input_error)?;
        }
        // Overrides may be applied in several steps.
        if !self.place.ends_with(OVERRIDES_SUFFIX) {
            self.place.push_str(OVERRIDES_SUFFIX);
        }
        Ok(self)
    }
}

/// A parsed override.
struct Override<'a> {
    /// The whole option as an error's place: `--set a=1`.
    place: String,
    key: &'a str,
    value: Value,
}

fn parse_override(override_text: &str) -> Result<Override<'_>, InputError> {
    let place = format!("--set {override_text}");
    let Some((key, value)) = override_text.split_once('=') else {
        let remedy = "write --set key=value, e.g. --set robots.count=20";
        return Err(InputError::new(place, "there is no `=`", remedy));
    };
    let text = value.trim();
    if let Ok(value) = text.parse() {
        return Ok(Override { place, key, value });
    }
    if !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit()) {
        let cause = format!("`{text}` is larger than any whole number of a file");
        return Err(InputError::new(place, cause, format!("give at most {}", i64::MAX)));
    }
    // As text, it would be refused later, where it is no longer clear that a number was meant.
    if overflows_to_infinity(text) {
        let cause = format!("`{text}` is larger than any number that can be held (1.8e308)");
        let remedy = "write a smaller number, or inf where that makes sense";
        return Err(InputError::new(place, cause, remedy));
    }
    // Text needs no quotes on a command line, so a value that is not TOML is text.
    Ok(Override { place, key, value: Value::from(text) })
}

/// Returns whether a text is a number in digits that rounds to infinity.
fn overflows_to_infinity(text: &str) -> bool {
    text.contains(|c: char| c.is_ascii_digit()) && text.parse().is_ok_and(f64::is_infinite)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn with(text: &str, overrides: &[&str]) -> Result<String, InputError> {
        let overrides: Vec<String> = overrides.iter().map(ToString::to_string).collect();
        Source::new("s.toml", text, "").with_overrides(&overrides).map(|s| s.text)
    }

    #[test]
    fn overrides_replace_add_and_reach_into_arrays() {
        let text = "seed = 1 # why\n[[robots]]\ncount = 2\n";
        let set = with(text, &["seed=7", "robots.count=20", "map.box_size_m=0.5", "regime=both"]);
        let table: toml::Table = set.expect("fits").parse().expect("TOML");
        assert_eq!(table["seed"].as_integer(), Some(7));
        assert_eq!(table["robots"][0]["count"].as_integer(), Some(20));
        assert_eq!(table["map"]["box_size_m"].as_float(), Some(0.5));
        assert_eq!(table["regime"].as_str(), Some("both"));
    }

    proptest! {
        #[test]
        fn overrides_together_are_what_they_are_one_after_the_other(
            picks in proptest::collection::vec((0..KEYS.len(), 0..VALUES.len()), 1..6),
        ) {
            let text = "seed = 1 # why\nname = \"a\"\nopen = { b = 1, c.d = 2 }\n[map]\nside = [1, 2]\n\
                        [[robots]]\ncount = 2\n[[robots]]\ncount = 3\n";
            let overrides: Vec<String> =
                picks.iter().map(|(k, v)| format!("{}={}", KEYS[*k], VALUES[*v])).collect();
            let together = Source::new("s.toml", text, "").with_overrides(&overrides);
            let first = Ok(Source::new("s.toml", text, ""));
            let one_by_one = overrides.iter().fold(first, |source: Result<Source, _>, o| source?.with_overrides(std::slice::from_ref(o)));
            match (together, one_by_one) {
                (Ok(a), Ok(b)) => prop_assert_eq!(a.text, b.text),
                (a, b) => prop_assert_eq!(a.is_err(), b.is_err()),
            }
        }
    }

    /// Keys, existing or not, alone or in lists, in braces, and above or below each other.
    const KEYS: [&str; 13] = [
        "seed",
        "name",
        "new",
        "open",
        "open.b",
        "open.c.d",
        "open.e",
        "map.side",
        "map.side.1",
        "map",
        "map.wide",
        "robots.0.count",
        "robots.1.count",
    ];
    const VALUES: [&str; 5] = ["7", "word", "[3, 4]", "{ x = 1 }", "\"two words\""];

    #[test]
    fn a_number_beyond_all_others_is_not_taken_for_text() {
        for bad in ["seed=1e400", "seed=-1e999", "seed= 1e400 "] {
            let error = with("seed = 1\n", &[bad]).expect_err(bad);
            assert!(error.to_string().contains("larger than any number"), "{error}");
        }
        for text in ["name=1e400m", "name=infinity", "name=infinite-2"] {
            assert!(with("name = \"a\"\n", &[text]).is_ok(), "{text}");
        }
    }

    #[test]
    fn an_override_that_does_not_fit_says_so() {
        for bad in ["seed", "=1", "a..b=1", "seed.x=1", "robots.5.count=1"] {
            let error = with("seed = 1\n[[robots]]\n[[robots]]\n", &[bad]).expect_err(bad);
            assert_eq!(error.place(), format!("--set {bad}"));
        }
    }
}
