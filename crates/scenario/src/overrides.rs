//! Overrides: `key=value` set in the text of a scenario, keeping its comments and its order.

use crate::source::{Source, WITH_OVERRIDES};
use sidestep_kernel::InputError;
use toml_edit::Value;

impl Source {
    /// Applies `key=value` overrides: `seed=3`, `robots.count=20`, `map.file="x.yaml"`. A value
    /// that is not TOML is taken as text. A table that stands alone in an array needs no index;
    /// others are counted from 0 (`robots.1.count`).
    ///
    /// # Errors
    /// When the text is not TOML, or a key leads through something that is not a table.
    pub fn with(mut self, overrides: &[String]) -> Result<Self, InputError> {
        // Without overrides the text stays as it is, byte for byte.
        if overrides.is_empty() {
            return Ok(self);
        }
        for override_text in overrides {
            set(&mut self, override_text)?;
        }
        // Overrides may be applied in several steps.
        if !self.place.ends_with(WITH_OVERRIDES) {
            self.place.push_str(WITH_OVERRIDES);
        }
        Ok(self)
    }
}

/// Sets one key.
fn set(source: &mut Source, override_text: &str) -> Result<(), InputError> {
    let place = format!("--set {override_text}");
    let (key, value) = override_text.split_once('=').ok_or_else(|| {
        InputError::new(
            &place,
            "there is no `=`",
            "write --set key=value, e.g. --set robots.count=20",
        )
    })?;
    // Text needs no quotes on a command line, so a value that is not TOML is text.
    let value: Value = value.trim().parse().unwrap_or_else(|_| Value::from(value.trim()));
    source.set_to(key, &value, |refused| InputError::new(&place, refused.cause, refused.remedy))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn with(text: &str, overrides: &[&str]) -> Result<String, InputError> {
        let overrides: Vec<String> = overrides.iter().map(ToString::to_string).collect();
        Source::new("s.toml", text, "").with(&overrides).map(|s| s.text)
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

    #[test]
    fn an_override_that_does_not_fit_says_so() {
        for bad in ["seed", "=1", "a..b=1", "seed.x=1", "robots.5.count=1"] {
            let error = with("seed = 1\n[[robots]]\n[[robots]]\n", &[bad]).expect_err(bad);
            assert_eq!(error.place(), format!("--set {bad}"));
        }
    }
}
