//! Cause and remedy of errors of the TOML reader.

use super::number::split_invalid_value;
use serde::de::DeserializeOwned;
use std::collections::BTreeSet;

/// Returns cause and remedy of an error of the TOML reader; `top` are the keys of the top level, some
/// of which the reader did not see, and `default_remedy` is for errors without a better one.
pub(crate) fn explain(
    error: &toml::de::Error,
    top: &[&str],
    default_remedy: String,
) -> (String, String) {
    let message = error.message().trim();
    let path = path_of(error);
    if let Some((value, remedy)) = split_invalid_value(message) {
        let key = path.as_deref().map_or("a value", last_key);
        return (format!("{key} = {value}"), remedy.into());
    }
    if let Some((found, known)) = backticked_name(message, "unknown field `") {
        let remedy = match path {
            None => suggestion(found, &[&quoted(known), top].concat()),
            // In TOML, keys after a [section] belong to it, even if their author meant otherwise.
            Some(_) if top.contains(&found) => top_level_remedy(found),
            Some(_) => suggestion(found, &quoted(known)),
        };
        return (format!("unknown key `{found}`"), remedy);
    }
    if let Some((found, known)) = backticked_name(message, "unknown variant `") {
        return (format!("unknown value `{found}`"), suggestion(found, &quoted(known)));
    }
    if let Some((missing, _)) = backticked_name(message, "missing field `") {
        return (format!("the key `{missing}` is missing"), format!("add `{missing} = ...`"));
    }
    if message.contains("recursion") {
        let cause = "tables and arrays within each other are too deep";
        return (cause.into(), "write fewer than 80 of them within each other".into());
    }
    (message.replace('\n', " "), default_remedy)
}

/// Returns the key that an error of the TOML reader calls unknown.
pub(crate) fn unknown_key(error: &toml::de::Error) -> Option<&str> {
    backticked_name(error.message().trim(), "unknown field `").map(|(found, _)| found)
}

fn top_level_remedy(key: &str) -> String {
    format!(
        "`{key}` belongs to the top level: above the first [section], or as [{key}] if it is one"
    )
}

/// Returns the keys of a table. Serde gives them only in the error for an unknown key, so one is provoked.
pub(crate) fn keys_of<T: DeserializeOwned>() -> Vec<String> {
    let Err(error) = toml::from_str::<T>("\"\" = 0") else { return Vec::new() };
    match backticked_name(error.message(), "unknown field `") {
        Some((_, known)) => quoted(known).into_iter().map(String::from).collect(),
        None => Vec::new(),
    }
}

/// Returns the name in backticks after a prefix, and the rest of the message.
fn backticked_name<'a>(message: &'a str, prefix: &str) -> Option<(&'a str, &'a str)> {
    message.strip_prefix(prefix)?.split_once('`')
}

/// Returns the path to the error, as keys joined by dots. The reader gives it in its message
/// only, and only where it has no text to quote.
fn path_of(error: &toml::de::Error) -> Option<String> {
    let mut error = error.clone();
    error.set_input(None);
    let message = error.to_string();
    let last = message.trim_end().lines().last()?;
    last.strip_prefix("in `")?.strip_suffix('`').map(String::from)
}

fn last_key(path: &str) -> &str {
    path.rsplit('.').next().unwrap_or(path)
}

/// Returns the names in backticks in a text.
pub(crate) fn quoted(text: &str) -> Vec<&str> {
    text.split('`').skip(1).step_by(2).collect()
}

/// Number of bytes above which a name is no misspelled one: the distance takes the time of their product.
const MAX_MISSPELLED_BYTES: usize = 100;

/// Returns "did you mean" with the nearest of `known`, or the whole list.
pub fn suggestion(found: &str, known: &[&str]) -> String {
    let is_name = found.len() <= MAX_MISSPELLED_BYTES;
    let distance =
        |name: &str| if is_name { strsim::osa_distance(found, name) } else { usize::MAX };
    match known.iter().min_by_key(|name| distance(name)) {
        // The longer a name, the more typing errors it may have.
        Some(best) if distance(best) <= 1 + found.len() / 3 => {
            format!("did you mean `{best}`?")
        }
        // The keys of the top level are joined from several lists, which may share keys.
        Some(_) => format!("known are: {}", deduplicated(known).join(", ")),
        None => "nothing is known here".into(),
    }
}

/// Returns the names in their order, without repetitions.
fn deduplicated<'a>(names: &[&'a str]) -> Vec<&'a str> {
    let mut seen = BTreeSet::new();
    names.iter().copied().filter(|name| seen.insert(*name)).collect()
}

#[cfg(test)]
mod tests {
    use super::explain;
    use crate::Source;
    use serde::Deserialize;

    #[derive(Debug, Deserialize)]
    #[serde(deny_unknown_fields)]
    #[expect(dead_code, reason = "only the error is of interest")]
    struct Small {
        cycles: u32,
        seed: u32,
    }

    #[test]
    fn an_unknown_key_is_answered_with_the_nearest() {
        let error = Source::new("s.toml", "seed = 1\ncylces = 3\n", "").parse::<Small>();
        let error = error.expect_err("misspelled");
        assert_eq!(error.line_and_column(), Some((2, 1)));
        assert_eq!(
            (error.cause(), error.remedy()),
            ("unknown key `cylces`", "did you mean `cycles`?")
        );
    }

    #[test]
    fn a_hostile_file_is_refused_at_its_limit_and_told_which() {
        for nested in ["[".repeat(100_000), "{b = ".repeat(5000)] {
            let error = Source::new("s.toml", format!("a = {nested}"), "").parse::<toml::Table>();
            let error = error.expect_err("too deep");
            assert!(error.cause().contains("too deep"), "{error}");
        }
        let error = Source::new("s.toml", format!("[{}]", ["a"; 50_000].join(".")), "");
        let error = error.parse::<toml::Table>().expect_err("too deep");
        assert!(error.cause().contains("too deep"), "{error}");
        let name = "y".repeat(1 << 20);
        let error = Source::new("s.toml", format!("{name} = 1"), "").parse::<Small>();
        let error = error.expect_err("unknown");
        assert_eq!(error.remedy(), "known are: cycles, seed");
        assert!(error.to_string().len() < 10_000);
    }

    #[test]
    fn known_keys_are_listed_once_though_the_top_level_has_them_too() {
        let error = toml::from_str::<Small>("wheelbarrow = 1").expect_err("unknown");
        let (_, remedy) = explain(&error, &["format", "seed", "cycles"], String::new());
        assert_eq!(remedy, "known are: cycles, seed, format");
    }
}
