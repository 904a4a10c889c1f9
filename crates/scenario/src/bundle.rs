//! A scenario with the files that it names, as a run folder keeps it.

use super::Source;
use super::file::read_bytes;
use sidestep_kernel::InputError;
use std::fmt::Display;
use std::path::Path;

/// The folder of the files, relative to the scenario.
const FOLDER: &str = "inputs";
/// Size in bytes of the largest file that is copied as it is, after unpacking.
const MAX_BYTES: u64 = 64 << 20;

/// A scenario that needs no other file, together with the files that it contains instead.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Resolved {
    /// The TOML text.
    pub text: String,
    /// Files by their path relative to the scenario.
    pub files: Vec<(String, Vec<u8>)>,
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
    /// default.
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

    /// Returns the number of files that were added so far.
    pub fn count(&self) -> usize {
        self.files.len()
    }

    /// Completes the bundle.
    ///
    /// # Errors
    /// When a key leads through something that is not a table.
    pub fn finish(self) -> Result<Resolved, InputError> {
        let text = self.source.clone().with(&self.overrides)?.text;
        Ok(Resolved { text: format!("{}{text}", self.source.heading()), files: self.files })
    }
}
