#![deny(clippy::disallowed_methods)]
//! Scenario files: TOML text with overrides -> typed sections, and errors that point.
//!
//! This module knows the form of the file that all worlds share. What stands in it is each
//! world's own business.

pub mod file;
pub mod kind;

pub use kind::{Compiled, Foreign, Kind, Worlds};
use serde::Deserialize;
use serde::de::DeserializeOwned;
use sidestep_kernel::InputError;
use std::ops::Range;
use std::path::{Path, PathBuf};
use toml::Spanned;
use toml_edit::{DocumentMut, Item, Value};

/// Version of the scenario format that this program reads.
pub const FORMAT: u32 = 1;

/// What the place of a changed scenario ends in.
const WITH_OVERRIDES: &str = " (with --set)";

/// The text of a scenario, where it came from, and the folder its paths are relative to.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Source {
    /// How errors name it.
    pub place: String,
    /// The TOML text, overrides applied: the resolved scenario.
    pub text: String,
    /// Files named in the scenario are relative to this folder.
    pub folder: PathBuf,
}

/// A scenario that needs no other file any more, and the files it has instead.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Resolved {
    /// The TOML text.
    pub text: String,
    /// Files by their path relative to the scenario.
    pub files: Vec<(String, Vec<u8>)>,
}

/// What every scenario begins with.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
pub struct Preamble {
    /// See [`FORMAT`].
    pub format: toml::Spanned<u32>,
    /// Name of the world.
    pub world: toml::Spanned<String>,
}

impl Source {
    /// Reads a scenario file and applies `key=value` overrides.
    ///
    /// # Errors
    /// When the file cannot be read or an override does not fit.
    pub fn read(path: &Path, overrides: &[String]) -> Result<Self, InputError> {
        let text = crate::file::read_text(path, 16 << 20)?;
        let folder = path.parent().unwrap_or(Path::new("")).to_path_buf();
        Self::new(path.display().to_string(), text, folder).with(overrides)
    }

    /// A scenario from text; `place` names it in errors.
    pub fn new(
        place: impl Into<String>,
        text: impl Into<String>,
        folder: impl Into<PathBuf>,
    ) -> Self {
        Self { place: place.into(), text: text.into(), folder: folder.into() }
    }

    /// Applies `key=value` overrides: `seed=3`, `robots.count=20`, `map.file="x.yaml"`. A
    /// value that is not TOML is taken as text. A table that stands alone in an array needs
    /// no index; others are counted from 0 (`robots.1.count`).
    ///
    /// # Errors
    /// When the text is not TOML, or a key leads through something that is not a table.
    pub fn with(mut self, overrides: &[String]) -> Result<Self, InputError> {
        if overrides.is_empty() {
            return Ok(self);
        }
        let mut document: DocumentMut = self.text.parse().map_err(|e: toml_edit::TomlError| {
            self.error(e.span(), e.message().to_string(), "write valid TOML")
        })?;
        for override_text in overrides {
            set(&mut document, override_text)?;
        }
        self.text = document.to_string();
        if !self.place.ends_with(WITH_OVERRIDES) {
            self.place.push_str(WITH_OVERRIDES);
        }
        Ok(self)
    }

    /// Parses the text into a type whose fields refuse unknown keys.
    ///
    /// # Errors
    /// With line and column; an unknown key is answered with the nearest known one.
    pub fn parse<T: DeserializeOwned>(&self) -> Result<T, InputError> {
        toml::from_str(&self.text).map_err(|e| {
            let (cause, remedy) = explain(e.message());
            self.error(e.span(), cause, remedy)
        })
    }

    /// Reads format and world, and refuses a format that this program does not know.
    ///
    /// # Errors
    /// When either is missing or the format is another.
    pub fn preamble(&self) -> Result<Preamble, InputError> {
        let preamble: Preamble = self.parse().map_err(|e| self.sweep_instead().unwrap_or(e))?;
        if *preamble.format.get_ref() == FORMAT {
            return Ok(preamble);
        }
        let cause = format!("scenario format {} is not known", preamble.format.get_ref());
        Err(self.error(Some(preamble.format.span()), cause, format!("write `format = {FORMAT}`")))
    }

    /// The error of a file that is wrong as a scenario because it is a sweep.
    fn sweep_instead(&self) -> Option<InputError> {
        let table = self.text.parse::<toml::Table>().ok()?;
        let is_sweep = table.contains_key("scenario") && !table.contains_key("world");
        let remedy = "run it with `sidestep sweep`, or name the scenario that it names";
        is_sweep.then(|| self.error(None, "this is a sweep, not a scenario", remedy))
    }

    /// An error at a span of the text.
    pub fn error(
        &self,
        span: Option<Range<usize>>,
        cause: impl Into<String>,
        remedy: impl Into<String>,
    ) -> InputError {
        let error = InputError::new(&self.place, cause, remedy);
        match span {
            Some(span) => error.in_text(&self.text, span.start),
            None => error,
        }
    }

    /// The first line of a resolved scenario: what it was made from, and by whom.
    pub fn heading(&self) -> String {
        let place = self.place.trim_end_matches(WITH_OVERRIDES);
        let name = Path::new(place).file_name().unwrap_or_default().display();
        format!("# {name}, resolved by sidestep {}\n", env!("CARGO_PKG_VERSION"))
    }

    /// A path of the scenario, relative to its folder.
    pub fn path(&self, path: &Path) -> PathBuf {
        self.folder.join(path)
    }
}

/// Cause and remedy of a message of the TOML reader.
fn explain(message: &str) -> (String, String) {
    let message = message.trim();
    if let Some(rest) = message.strip_prefix("unknown field `")
        && let Some((found, known)) = rest.split_once('`')
    {
        return (format!("unknown key `{found}`"), nearest(found, &quoted(known)));
    }
    if let Some(rest) = message.strip_prefix("unknown variant `")
        && let Some((found, known)) = rest.split_once('`')
    {
        return (format!("unknown value `{found}`"), nearest(found, &quoted(known)));
    }
    if let Some(rest) = message.strip_prefix("missing field `")
        && let Some((missing, _)) = rest.split_once('`')
    {
        return (format!("the key `{missing}` is missing"), format!("add `{missing} = ...`"));
    }
    (
        message.replace('\n', " "),
        "see what `sidestep new robots` (or airspace, chain) writes".into(),
    )
}

fn quoted(text: &str) -> Vec<&str> {
    text.split('`').skip(1).step_by(2).collect()
}

/// "did you mean" with the nearest of `known`, or the whole list.
pub fn nearest(found: &str, known: &[&str]) -> String {
    let distance = |k: &&&str| strsim::osa_distance(found, k);
    match known.iter().min_by_key(distance) {
        Some(best) if strsim::osa_distance(found, best) <= 1 + found.len() / 3 => {
            format!("did you mean `{best}`?")
        }
        Some(_) => format!("known are: {}", known.join(", ")),
        None => "nothing is known here".into(),
    }
}

fn set(document: &mut DocumentMut, override_text: &str) -> Result<(), InputError> {
    let place = format!("--set {override_text}");
    let (key, value) = override_text.split_once('=').ok_or_else(|| {
        InputError::new(
            &place,
            "there is no `=`",
            "write --set key=value, e.g. --set robots.count=20",
        )
    })?;
    let value: Value = value.trim().parse().unwrap_or_else(|_| Value::from(value.trim()));
    let keys: Vec<&str> = key.trim().split('.').collect();
    let (last, path) = keys.split_last().expect("split gives at least one part");
    if keys.iter().any(|k| k.is_empty()) {
        return Err(InputError::new(&place, "a part of the key is empty", "write a.b.c=value"));
    }
    let mut item = document.as_item_mut();
    for part in path {
        item = descend(item, part, &place)?;
    }
    let item = only_element(item);
    let table = item.as_table_like_mut().ok_or_else(|| not_a_table(&place, last))?;
    match table.get_mut(last).and_then(Item::as_value_mut) {
        // Comments around the old value stay where they are.
        Some(old) => {
            let decor = old.decor().clone();
            *old = value;
            *old.decor_mut() = decor;
        }
        None => {
            table.insert(last, Item::Value(value));
        }
    }
    Ok(())
}

fn descend<'a>(item: &'a mut Item, part: &str, place: &str) -> Result<&'a mut Item, InputError> {
    if let Ok(index) = part.parse::<usize>() {
        return item.get_mut(index).ok_or_else(|| {
            InputError::new(place, format!("there is no element {index}"), "count from 0")
        });
    }
    let item = only_element(item);
    if !item.is_table_like() {
        return Err(not_a_table(place, part));
    }
    let table = item.as_table_like_mut().expect("checked just now");
    if !table.contains_key(part) {
        let mut new = toml_edit::Table::new();
        new.set_implicit(true);
        table.insert(part, Item::Table(new));
    }
    Ok(table.get_mut(part).expect("inserted just now"))
}

/// The table itself, or the only table of an array of tables.
fn only_element(item: &mut Item) -> &mut Item {
    let is_single = item.as_array_of_tables().is_some_and(|a| a.len() == 1)
        || item.as_array().is_some_and(|a| a.len() == 1);
    if is_single { item.get_mut(0).expect("one element") } else { item }
}

fn not_a_table(place: &str, key: &str) -> InputError {
    InputError::new(
        place,
        format!("`{key}` does not stand in a table"),
        "name the element of an array by its number, e.g. robots.0.count",
    )
}

/// One table or an array of tables under one key: `[robots]` or `[[robots]]`.
#[derive(Debug, Clone, PartialEq)]
pub struct OneOrMany<T>(pub Vec<T>);

impl<T> Default for OneOrMany<T> {
    fn default() -> Self {
        Self(Vec::new())
    }
}

impl<'de, T: Deserialize<'de>> Deserialize<'de> for OneOrMany<T> {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Ok(Self(match OneOrEach::<T, T>::deserialize(deserializer)? {
            OneOrEach::One(one) => vec![one],
            OneOrEach::Each(many) => many,
        }))
    }
}

/// The same of tables that know where they stand.
#[derive(Debug, Clone, PartialEq)]
pub struct Sections<T>(pub Vec<Spanned<T>>);

impl<T> Default for Sections<T> {
    fn default() -> Self {
        Self(Vec::new())
    }
}

impl<'de, T: Deserialize<'de>> Deserialize<'de> for Sections<T> {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let spanned = Spanned::<OneOrEach<T, Spanned<T>>>::deserialize(deserializer)?;
        let span = spanned.span();
        Ok(Self(match spanned.into_inner() {
            OneOrEach::One(one) => vec![Spanned::new(span, one)],
            OneOrEach::Each(many) => many,
        }))
    }
}

/// What stands in a table's place: one table, or an array of them.
enum OneOrEach<One, Each> {
    One(One),
    Each(Vec<Each>),
}

impl<'de, One: Deserialize<'de>, Each: Deserialize<'de>> Deserialize<'de> for OneOrEach<One, Each> {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Visitor<One, Each>(std::marker::PhantomData<(One, Each)>);

        impl<'de, One: Deserialize<'de>, Each: Deserialize<'de>> serde::de::Visitor<'de>
            for Visitor<One, Each>
        {
            type Value = OneOrEach<One, Each>;

            fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str("a table or an array of tables")
            }

            fn visit_map<A: serde::de::MapAccess<'de>>(
                self,
                map: A,
            ) -> Result<Self::Value, A::Error> {
                One::deserialize(serde::de::value::MapAccessDeserializer::new(map))
                    .map(OneOrEach::One)
            }

            fn visit_seq<A: serde::de::SeqAccess<'de>>(
                self,
                mut seq: A,
            ) -> Result<Self::Value, A::Error> {
                let mut many = Vec::new();
                while let Some(one) = seq.next_element()? {
                    many.push(one);
                }
                Ok(OneOrEach::Each(many))
            }
        }
        deserializer.deserialize_any(Visitor(std::marker::PhantomData))
    }
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

    #[test]
    fn sections_stand_alone_or_in_an_array_and_know_where() {
        #[derive(Debug, Deserialize)]
        struct File {
            #[serde(default)]
            a: Sections<Section>,
        }
        #[derive(Debug, Deserialize)]
        #[serde(deny_unknown_fields)]
        struct Section {
            n: u32,
        }
        let read = |text: &str| Source::new("s.toml", text, "").parse::<File>();
        for (text, starts) in [
            ("[a]\nn = 1\n", vec![(1, 0)]),
            ("[[a]]\nn = 1\n[[a]]\nn = 2\n", vec![(1, 0), (2, 12)]),
            ("a = [{ n = 1 }, { n = 2 }]", vec![(1, 5), (2, 16)]),
            ("", vec![]),
        ] {
            let file = read(text).expect(text);
            let told: Vec<_> = file.a.0.iter().map(|s| (s.get_ref().n, s.span().start)).collect();
            assert_eq!(told, starts, "{text}");
        }
        for text in ["[a]\nm = 1\n", "[[a]]\nn = 1\n[[a]]\nm = 1\n"] {
            let error = read(text).expect_err(text).to_string();
            assert!(error.contains("unknown key `m`"), "{error}");
        }
    }

    #[test]
    fn an_unknown_key_is_answered_with_the_nearest() {
        #[derive(Debug, Deserialize)]
        #[serde(deny_unknown_fields)]
        #[expect(dead_code, reason = "only the error is of interest")]
        struct Small {
            cycles: u32,
            seed: u32,
        }
        let error = Source::new("s.toml", "seed = 1\ncylces = 3\n", "").parse::<Small>();
        let error = error.expect_err("misspelled");
        assert_eq!(error.position(), Some((2, 1)));
        assert_eq!(
            (error.cause(), error.remedy()),
            ("unknown key `cylces`", "did you mean `cycles`?")
        );
    }
}
