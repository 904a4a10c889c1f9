//! A scenario with the files that it refers to, as stored in a run folder.

use super::Source;
use super::file::read_bytes;
use crate::Spanned;
use serde::Deserialize;
use sidestep_kernel::InputError;
use std::fmt::Display;
use std::path::Path;

/// The folder of the files, relative to the scenario.
const FOLDER: &str = "inputs";
/// Maximum size in bytes of a file that is copied, after decompression: far above any map, and small enough to hold.
const MAX_BYTES: u64 = 64 << 20;

/// A scenario that needs no file from elsewhere, together with the files that it contains instead.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ResolvedScenario {
    /// The TOML text, with seed and cycles and with paths of `files` alone.
    pub text: String,
    /// Files by their path relative to the scenario.
    pub files: Vec<(String, Vec<u8>)>,
}

/// The text of a resolved scenario before and after its seed: the texts of all scenarios that differ only by
/// their seed, without parsing or editing any of them. A sweep has thousands.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SeedTemplate {
    before: String,
    after: String,
}

/// The only key of a resolved scenario that is read.
#[derive(Deserialize)]
struct SeedKey {
    seed: Spanned<i64>,
}

impl ResolvedScenario {
    /// Returns its text without its seed; `None` if it has none, and so is no resolved scenario.
    pub fn seed_template(&self) -> Option<SeedTemplate> {
        let SeedKey { seed } = toml::from_str(&self.text).ok()?;
        let span = seed.span();
        Some(SeedTemplate {
            before: self.text[..span.start].into(),
            after: self.text[span.end..].into(),
        })
    }
}

impl SeedTemplate {
    /// Returns the text with a seed.
    pub fn with_seed(&self, seed: u64) -> String {
        format!("{}{seed}{}", self.before, self.after)
    }
}

/// A scenario that is being resolved.
#[derive(Debug)]
pub struct Bundle<'a> {
    source: &'a Source,
    overrides: Vec<String>,
    files: Vec<(String, Vec<u8>)>,
}

impl<'a> Bundle<'a> {
    /// Starts with the scenario's text; seed and cycles are written even where they are the
    /// default, because a default may change in a later version.
    pub fn new(source: &'a Source, seed: u64, cycles: u64) -> Self {
        // TOML has no larger integers.
        let cycles = cycles.min(i64::MAX as u64);
        let overrides = vec![format!("seed={seed}"), format!("cycles={cycles}")];
        Self { source, overrides, files: Vec::new() }
    }

    /// Sets a key of the scenario to a value, given as TOML.
    pub fn set(&mut self, key: &str, value: impl Display) {
        self.overrides.push(format!("{key}={value}"));
    }

    /// Adds a file; returns its path relative to the scenario.
    pub fn add(&mut self, name: &str, bytes: Vec<u8>) -> String {
        let path = format!("{FOLDER}/{name}");
        self.files.push((path.clone(), bytes));
        path
    }

    /// Copies a file, found relative to the scenario's folder; returns its new path.
    ///
    /// # Errors
    /// When it can no longer be read.
    pub fn copy(&mut self, name: &str, path: &str) -> Result<String, InputError> {
        let bytes = read_bytes(&self.source.path(Path::new(path)), MAX_BYTES)?;
        Ok(self.add(name, bytes))
    }

    /// Returns the number of files that were added so far, for names that no other file has.
    pub fn count(&self) -> usize {
        self.files.len()
    }

    /// Returns the scenario's text with all keys set, and the files.
    ///
    /// # Errors
    /// When a key leads through something that is not a table.
    pub fn finish(self) -> Result<ResolvedScenario, InputError> {
        let text = self.source.clone().with_overrides(&self.overrides)?.text;
        Ok(ResolvedScenario { text: format!("{}{text}", self.source.heading()), files: self.files })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn resolved(text: &str, seed: u64) -> ResolvedScenario {
        let source = Source::new("s.toml", text, "");
        let mut bundle = Bundle::new(&source, seed, 100);
        bundle.set("map.file", "\"seed = 4\"");
        bundle.finish().expect("resolved")
    }

    #[test]
    fn the_text_of_another_seed_is_that_of_resolving_with_it() {
        for text in [
            "format = 1\nworld = \"w\"\n[map]\n# seed = 3\n",
            "seed = 0x10 # why\nformat = 1\n[map]\nseed = 5\n",
            "format = 1\nname = 'seed = 1'\nseed =    7\nmap = {}\n",
        ] {
            let one = resolved(text, 7);
            let seedless = one.seed_template().expect("it has a seed");
            for seed in [0, 7, 12_345_678_901, i64::MAX as u64] {
                assert_eq!(seedless.with_seed(seed), resolved(text, seed).text);
            }
        }
        let none = ResolvedScenario { text: "format = 1\n".into(), files: Vec::new() };
        assert_eq!(none.seed_template(), None);
    }
}
