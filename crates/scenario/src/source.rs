//! The text of a scenario, and its parser.

use super::explain::{explain, keys_of, unknown_key};
use super::locate::{dotted_path, locate};
use crate::{Integer, Spanned};
use schemars::JsonSchema;
use serde::Deserialize;
use serde::de::DeserializeOwned;
use sidestep_kernel::InputError;
use sidestep_kernel::shell::shell_quote;
use sidestep_kernel::terminal::escape_controls;
use std::ops::Range;
use std::path::{Path, PathBuf};
use toml::de::{DeTable, Deserializer};

/// Version of the scenario format that this program reads.
pub const FORMAT: u32 = 1;

/// Maximum size in bytes of a scenario file: thousands of agents with routes take one of them.
const MAX_BYTES: u64 = 16 << 20;

/// The suffix of the place of a scenario with overrides.
pub(crate) const OVERRIDES_SUFFIX: &str = " (with --set)";

/// The text of a scenario, its name in errors, and the folder that its paths are relative to.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Source {
    /// Its name in errors: a path, or what the caller gave.
    pub place: String,
    /// The TOML text with overrides applied: the resolved scenario.
    pub text: String,
    /// The folder that paths in the scenario are relative to.
    pub folder: PathBuf,
}

/// The first keys of every scenario, which identify its world.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize)]
pub struct Preamble {
    /// See [`FORMAT`].
    pub format: Spanned<u32>,
    /// Name of the world, which need not be a known one.
    pub world: Spanned<String>,
}

/// Remedy for a value of a wrong type, where there is no example.
const TYPE_REMEDY: &str = "give a value of the right type";

/// Words in errors about constructs that may span many lines: without its end, all errors after one follow from it.
const MULTILINE_CONSTRUCTS: [&str; 4] = ["array", "inline table", "key-value pairs", "multi-line"];

/// Keys of [`Head`], which must be known before a scenario is split into head and sections.
const HEAD_KEYS: [&str; 5] = ["format", "world", "name", "seed", "cycles"];

/// The keys that all worlds share.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Head {
    /// Version of the file's format.
    #[serde(rename = "format")]
    _format: u32,
    /// Name of the world.
    #[serde(rename = "world")]
    _world: String,
    /// Name of the scenario; may be empty.
    #[serde(default)]
    pub name: String,
    /// The seed; 1 by default. At most 2^63 - 1: files have no larger whole numbers, and a run writes its seed into one.
    #[serde(default = "default_seed", deserialize_with = "Integer::<0, MAX_SEED>::read")]
    pub seed: u64,
    /// Number of cycles to run, if given.
    pub cycles: Option<u64>,
}

/// Largest seed, which is the largest whole number of TOML.
const MAX_SEED: u64 = i64::MAX as u64;

fn default_seed() -> u64 {
    1
}

impl Source {
    /// Reads a scenario file and applies `key=value` overrides.
    ///
    /// # Errors
    /// When the file cannot be read or an override does not fit.
    pub fn read(path: &Path, overrides: &[String]) -> Result<Self, InputError> {
        let text = crate::file::read_text(path, MAX_BYTES)?;
        let folder = path.parent().unwrap_or(Path::new("")).to_path_buf();
        Self::new(path.display().to_string(), text, folder).with_overrides(overrides)
    }

    /// Creates a scenario from text; `place` names it in errors.
    pub fn new(
        place: impl Into<String>,
        text: impl Into<String>,
        folder: impl Into<PathBuf>,
    ) -> Self {
        Self { place: place.into(), text: text.into(), folder: folder.into() }
    }

    /// Parses the text into a type with fields that refuse unknown keys.
    ///
    /// # Errors
    /// When the text does not fit the type, with line and column; the error for an unknown key
    /// suggests the nearest known one.
    pub fn parse<T: DeserializeOwned>(&self) -> Result<T, InputError> {
        toml::from_str(&self.text).map_err(|error| self.toml_error(&error, &[]))
    }

    /// Parses a scenario: the head that all worlds share, and the sections of one world.
    ///
    /// # Errors
    /// The same as for [`Self::parse`].
    pub fn parse_world<T: DeserializeOwned>(&self) -> Result<(Head, T), InputError> {
        let input_error = |error| {
            let own = keys_of::<T>();
            let top: Vec<&str> =
                HEAD_KEYS.into_iter().chain(own.iter().map(String::as_str)).collect();
            self.toml_error(&error, &top)
        };
        let table = DeTable::parse(&self.text).map_err(input_error)?;
        let span = table.span();
        // Two tables instead of a flattened field, which would lose the positions of its entries.
        let (head, sections): (DeTable<'_>, DeTable<'_>) = table
            .into_inner()
            .into_iter()
            .partition(|(key, _)| HEAD_KEYS.contains(&&**key.get_ref()));
        let head = Deserializer::from(toml::Spanned::new(span.clone(), head));
        let head = Head::deserialize(head).map_err(input_error)?;
        let sections = Deserializer::from(toml::Spanned::new(span, sections));
        let sections = T::deserialize(sections).map_err(input_error)?;
        Ok((head, sections))
    }

    /// Returns the syntax errors: one for each line, and none that only follows from an array, a
    /// table or a text without an end.
    pub fn syntax_errors(&self) -> Vec<InputError> {
        let (_, mut errors) = DeTable::parse_recoverable(&self.text);
        // The reader reports errors in an array before errors above it.
        errors.sort_by_key(|error| error.span().map(|span| span.start));
        let mut reported: Vec<InputError> = Vec::new();
        let mut last_line = None;
        for error in errors {
            let error = self.toml_error(&error, &[]);
            let line = error.line_and_column().map(|(line, _)| line);
            if !reported.is_empty() && line == last_line {
                continue;
            }
            let is_open = MULTILINE_CONSTRUCTS.iter().any(|word| error.cause().contains(word));
            last_line = line;
            reported.push(error);
            if is_open {
                break;
            }
        }
        reported
    }

    fn toml_error(&self, error: &toml::de::Error, top: &[&str]) -> InputError {
        self.toml_error_with_remedy(error, top, self.example_remedy())
    }

    fn toml_error_with_remedy(
        &self,
        error: &toml::de::Error,
        top: &[&str],
        default_remedy: String,
    ) -> InputError {
        let (cause, remedy) = explain(error, top, default_remedy);
        let input_error = InputError::new(&self.place, cause, remedy);
        match error.span() {
            Some(span) => self.with_span(input_error, self.unknown_key_span(error, span)),
            None => input_error,
        }
    }

    /// Returns the position of the unknown key that an error is about. Of a table with a `kind` the reader knows only that
    /// of the whole table, because it reads the kind first.
    fn unknown_key_span(&self, error: &toml::de::Error, span: Range<usize>) -> Range<usize> {
        match unknown_key(error) {
            Some(key) if self.text.get(span.clone()) != Some(key) => self.key_span(span, &[key]),
            _ => span,
        }
    }

    /// Adds a span of the text to an error: position, end and key.
    fn with_span(&self, error: InputError, span: Range<usize>) -> InputError {
        let error = self.with_key_at(span.clone(), error);
        error.with_byte_span(&self.text, span)
    }

    /// Returns the remedy that points to an example of the scenario's own world.
    fn example_remedy(&self) -> String {
        let table = self.text.parse::<toml::Table>();
        let world = table.as_ref().ok().and_then(|table| table.get("world")?.as_str());
        match (&table, world) {
            (Err(error), _) if is_too_large(error.message()) => {
                format!("give at most {}, the largest whole number of a file", i64::MAX)
            }
            (Err(_), _) => "write valid TOML".into(),
            (_, Some(world)) => format!("see what `sidestep new {}` writes", shell_quote(world)),
            (_, None) => TYPE_REMEDY.into(),
        }
    }

    /// Reads format and world, and refuses a format that this program cannot read.
    ///
    /// # Errors
    /// When either is missing or the format is a different one.
    pub fn preamble(&self) -> Result<Preamble, InputError> {
        let preamble = match toml::from_str::<Preamble>(self.top()) {
            Ok(preamble) => preamble,
            Err(_) => self.parse_preamble().map_err(|e| self.sweep_error().unwrap_or(e))?,
        };
        if *preamble.format.get_ref() == FORMAT {
            return Ok(preamble);
        }
        let cause = format!("scenario format {} is not known", preamble.format.get_ref());
        Err(self.error(Some(preamble.format.span()), cause, format!("write `format = {FORMAT}`")))
    }

    /// Parses format and world of the whole text. Its errors give no example of the world, which may not exist.
    fn parse_preamble(&self) -> Result<Preamble, InputError> {
        toml::from_str(&self.text).map_err(|error| {
            let is_valid = self.text.parse::<toml::Table>().is_ok();
            let remedy = if is_valid { TYPE_REMEDY.into() } else { self.example_remedy() };
            self.toml_error_with_remedy(&error, &[], remedy)
        })
    }

    /// Returns the text above the first section, which has the keys of all worlds, so that the preamble of a large
    /// scenario is read without parsing all of it. It may end in the middle of a value with lines that look like a
    /// section.
    fn top(&self) -> &str {
        let section = if self.text.starts_with('[') { Some(0) } else { self.text.find("\n[") };
        &self.text[..section.unwrap_or(self.text.len())]
    }

    /// Returns the error for a file that is not a scenario because it is a sweep.
    fn sweep_error(&self) -> Option<InputError> {
        let table = self.text.parse::<toml::Table>().ok()?;
        let is_sweep = table.contains_key("scenario") && !table.contains_key("world");
        let remedy = "run it with `sidestep sweep`, or give the scenario that it refers to";
        is_sweep.then(|| self.error(None, "this is a sweep, not a scenario", remedy))
    }

    /// Creates an error in the text, at a span if one is given, with the innermost key that
    /// contains it in its name or value. The empty span of a default counts as none.
    pub fn error(
        &self,
        span: impl Into<Option<Range<usize>>>,
        cause: impl Into<String>,
        remedy: impl Into<String>,
    ) -> InputError {
        let error = InputError::new(&self.place, cause, remedy);
        match span.into().filter(|span| *span != (0..0)) {
            Some(span) => self.with_span(error, span),
            None => error,
        }
    }

    /// Adds the position of a section to an error from code that does not know the text.
    pub fn error_from(
        &self,
        span: impl Into<Option<Range<usize>>>,
        error: &InputError,
    ) -> InputError {
        self.error(span, format!("{}: {}", error.place(), error.cause()), error.remedy())
    }

    /// Adds the key at a span to an error, e.g. the key that refers to a file to the file's error.
    pub fn with_key_at(&self, span: Range<usize>, error: InputError) -> InputError {
        match locate(&self.text, &span) {
            Some(path) => error.with_key(dotted_path(&path)),
            None => error,
        }
    }

    /// Returns the result of reading a file that a key of the section at a span refers to; errors get the path to that
    /// key.
    ///
    /// # Errors
    /// Those of reading it.
    pub fn with_file_key<T>(
        &self,
        section: Range<usize>,
        key: &str,
        read: Result<T, InputError>,
    ) -> Result<T, InputError> {
        read.map_err(|error| self.with_key_at(self.key_span(section, &[key]), error))
    }

    /// Returns an error as one of this text, for readers who see only that: an error of a file that the text refers to
    /// becomes one of the key that refers to it.
    pub fn error_at_reference(&self, error: &InputError) -> InputError {
        let Some(key) = error.key().filter(|_| error.place() != self.place) else {
            return error.clone();
        };
        let position = match error.line_and_column() {
            Some((line, column)) => format!(":{line}:{column}"),
            None => String::new(),
        };
        let cause = format!("{}{position}: {}", error.place(), error.cause());
        self.error_at(key, cause, error.remedy())
    }

    /// Returns its place without the suffix of overrides.
    pub fn file_place(&self) -> &str {
        self.place.trim_end_matches(OVERRIDES_SUFFIX)
    }

    /// Returns the first line of a resolved scenario: its source, and the program that resolved it.
    pub fn heading(&self) -> String {
        let name = Path::new(self.file_place()).file_name().unwrap_or_default().to_string_lossy();
        // A name may have line ends, and a comment ends with its line.
        let name = escape_controls(&name);
        format!("# {name}, resolved by sidestep {}\n", env!("CARGO_PKG_VERSION"))
    }

    /// Resolves a path of the scenario against its folder.
    pub fn path(&self, path: &Path) -> PathBuf {
        self.folder.join(path)
    }
}

/// Returns whether the reader of TOML means a whole number that no file can hold: it has two ways to say so.
fn is_too_large(message: &str) -> bool {
    message.contains("overflow") || message.contains("too large")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_error_of_a_named_file_is_told_at_the_key_that_names_it() {
        let source = Source::new("s.toml", "n = 1\n[map]\nfile = \"a.png\"\n", "");
        let span = source.text.find("\"a.png\"").map(|at| at..at + 7).expect("it is there");
        let wrong = InputError::new("a.png", "it is cut off", "copy it again").with_position(3, 4);
        let named = source.with_key_at(span, wrong.clone());
        assert_eq!((named.place(), named.key()), ("a.png", Some("map.file")));
        let told = source.error_at_reference(&named);
        assert_eq!((told.place(), told.key()), ("s.toml", Some("map.file")));
        assert_eq!(told.line_and_column().map(|(line, _)| line), Some(3));
        assert_eq!((told.cause(), told.remedy()), ("a.png:3:4: it is cut off", "copy it again"));
        // An error of the text itself, and one of a file that no key names, stay the same.
        let own = source.error(0..1, "wrong", "right");
        assert_eq!(
            (source.error_at_reference(&own), source.error_at_reference(&wrong)),
            (own, wrong.clone())
        );
        assert_eq!(source.with_key_at(0..source.text.len(), wrong).key(), None);
    }

    #[derive(Debug, Deserialize)]
    #[serde(deny_unknown_fields)]
    struct Own {
        n: Spanned<u32>,
    }

    fn read(text: &str) -> Result<(Head, Own), InputError> {
        Source::new("s.toml", text, "").parse_world()
    }

    #[test]
    fn a_head_is_read_beside_what_is_a_worlds_own() {
        let (head, own) = read("format = 1\nn = 3\nworld = \"w\"\ncycles = 7\n").expect("right");
        assert_eq!((head.seed, head.cycles, head.name.as_str()), (1, Some(7), ""));
        assert_eq!((*own.n.get_ref(), own.n.span()), (3, 15..16));
    }

    #[test]
    fn an_example_is_advised_only_of_a_world_that_may_exist() {
        let preamble =
            Source::new("s.toml", "format = \"x\"\nworld = \"no such\"\n", "").preamble();
        assert_eq!(preamble.expect_err("a wrong type").remedy(), TYPE_REMEDY);
        let read = read("format = 1\nworld = \"my w\"\nn = -1\n");
        assert_eq!(read.expect_err("negative").remedy(), "see what `sidestep new 'my w'` writes");
    }

    #[test]
    fn format_and_world_are_found_above_sections_and_what_looks_like_one() {
        for more in ["", "[a]\n= =", "[[a]]\n", "a = [\n[1]\n]\n[b]\n"] {
            let text = format!("name = \"n\"\nformat = 1\nworld = \"w\"\n{more}");
            let preamble = Source::new("s.toml", text, "").preamble().expect(more);
            assert_eq!((preamble.world.get_ref().as_str(), preamble.world.span()), ("w", 30..33));
        }
        let none = Source::new("s.toml", "[a]\nworld = \"w\"\n", "").preamble();
        assert!(none.expect_err("no world").cause().contains("format"));
    }

    #[test]
    fn what_is_wrong_in_either_part_is_told_where_it_stands() {
        for (line, at, remedy) in [
            ("cylces = 3", (3, 1), "did you mean `cycles`?"),
            ("m = 3", (3, 1), "did you mean `n`?"),
            ("n = -1", (3, 5), "see what `sidestep new w` writes"),
            ("seed = \"five\"", (3, 8), "see what `sidestep new w` writes"),
            ("n = = 3", (3, 5), "write valid TOML"),
            ("n = 9223372036854775808", (3, 5), "give at most 9223372036854775807"),
        ] {
            let error = read(&format!("format = 1\nworld = \"w\"\n{line}\n")).expect_err(line);
            assert_eq!(error.line_and_column(), Some(at), "{error}");
            assert!(error.remedy().contains(remedy), "{error}");
            // Text that is no TOML has no keys.
            let key = line.split_once(' ').map(|(key, _)| key).filter(|_| !line.contains("= ="));
            assert_eq!(error.key(), key, "{error}");
        }
        assert!(read("n = 1\nworld = \"w\"").expect_err("no format").cause().contains("format"));
    }

    #[test]
    fn a_key_of_the_top_level_in_a_section_is_told_where_it_belongs() {
        #[derive(Debug, Deserialize)]
        #[serde(deny_unknown_fields)]
        #[expect(dead_code, reason = "only the error is of interest")]
        struct World {
            robots: Own,
            profiles: Option<Vec<String>>,
        }
        let read = |line: &str| {
            let text = format!("format = 1\nworld = \"w\"\n[robots]\nn = 1\n{line}\n");
            Source::new("s.toml", text, "").parse_world::<World>().expect_err(line)
        };
        for (line, key) in [("profiles = []", "profiles"), ("seed = 3", "seed")] {
            let error = read(line);
            assert_eq!(error.line_and_column(), Some((5, 1)), "{error}");
            let remedy = format!("`{key}` belongs to the top level: above the first [section]");
            assert!(error.remedy().starts_with(&remedy), "{error}");
        }
        assert!(read("nn = 1").remedy().contains("did you mean `n`?"));
    }

    #[test]
    fn all_lines_that_are_no_toml_are_told_and_nothing_that_follows_from_an_open_end() {
        let lines = |text: &str| {
            let errors = Source::new("s.toml", text, "").syntax_errors();
            errors.iter().map(|e| e.line_and_column().expect("a place").0).collect::<Vec<_>>()
        };
        assert_eq!(lines("a = 1\n[b]\nc = \"d\"\n"), [0; 0]);
        assert_eq!(lines("a = = 1\nb = 2\nc\n[d\ne = 3\n"), [1, 3, 4]);
        assert_eq!(lines("a = \"b\nc = = 1\n"), [1, 2]);
        assert_eq!(lines("a = 1 2\nb = { c = 1\nd = 2\ne = 3\n"), [1, 3]);
        assert_eq!(lines("a = 1 2\nb = [1\nc = 2\nd = 3\n"), [1, 3]);
    }

    #[test]
    fn the_place_of_a_default_is_nowhere() {
        let source = Source::new("s.toml", "a = 1", "");
        assert_eq!(source.error(0..0, "c", "r").line_and_column(), None);
        let error = source.error(4..5, "c", "r");
        assert_eq!(
            (error.line_and_column(), error.end_line_and_column()),
            (Some((1, 5)), Some((1, 6)))
        );
        assert_eq!(error.key(), Some("a"));
        let part = InputError::new("part", "is wrong", "mend it");
        assert_eq!(source.error_from(4..5, &part).cause(), "part: is wrong");
    }
}
