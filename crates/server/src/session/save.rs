//! Saving of scenarios: whole or not at all, and never over a text that another program has written meanwhile.

use crate::files::AllowedFiles;
use crate::protocol::{Problem, ReplyBody};
use crate::write::{WriteTarget, replace_file};
use serde_json::Value;
use sidestep_scenario::{Source, Worlds};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

/// The file of a session, as last read or written.
#[derive(Debug, Clone)]
pub(super) struct SessionFile {
    pub(super) path: PathBuf,
    pub(super) text: String,
}

/// The scenario of a session, shared with other threads: its place is the file in which it was last saved.
#[derive(Debug, Clone, Default)]
pub(crate) struct SharedScenarioText(Arc<Mutex<Option<Source>>>);

impl SharedScenarioText {
    /// Returns the scenario; `None` until the session's thread has opened it.
    pub(crate) fn get(&self) -> Option<Source> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    pub(super) fn set(&self, source: &Source) {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = Some(source.clone());
    }
}

impl SessionFile {
    /// Returns the file from which a scenario was read; none where the scenario was made from a file of another program.
    pub(super) fn open(path: &Path, source: &Source) -> Option<Self> {
        let read = Source::read(path, &[]).ok()?;
        (read.text == source.text).then(|| Self { path: path.into(), text: read.text })
    }
}

/// Returns a file's path, or the problem of a session that has none.
pub(super) fn session_path(own: Option<&SessionFile>, place: &str) -> Result<String, Problem> {
    let path = own.and_then(|own| own.path.to_str()).map(String::from);
    path.ok_or_else(|| {
        let remedy = "give a name that ends in .toml";
        Problem::new(place, "the scenario is in no file yet", remedy)
    })
}

#[derive(Debug, Clone, Default)]
pub(super) struct SaveOptions {
    /// The text that the page believes the file holds; without it, the text that the session has read or written.
    pub(super) base: Option<String>,
    /// Whether the file is replaced regardless of its content.
    pub(super) overwrite: bool,
}

/// Refuses a text that would let a page read forbidden files, and one that is no scenario. A text that is no TOML may
/// be saved, half-typed: it can be read neither as a scenario nor as the file of another program, and formats that
/// refer to further files (maps, worlds of Stage) are never read from a file that ends in `.toml`.
///
/// # Errors
/// With the file to which it refers, or the kind of text that it has to be.
pub(super) fn check_savable_text(
    files: &AllowedFiles,
    worlds: &Worlds,
    source: &Source,
) -> Result<(), Problem> {
    let Ok(values) = source.parse::<Value>() else { return Ok(()) };
    files.check_referenced_files(source)?;
    // A scenario may not be replaced by anything else, either: in two saves, a page could otherwise make any file out of it.
    if values["world"].is_null() {
        let worlds = worlds.names().join(", ");
        let cause = "would be no scenario: it has no `world`";
        let remedy = format!("begin it with world = \"...\", one of {worlds}");
        return Err(Problem::new(source.place.as_str(), cause, remedy));
    }
    Ok(())
}

/// Writes a text into a file, unless the file holds something that the page does not know.
///
/// # Errors
/// When it cannot be written; then the file is as it was.
pub(super) fn write_scenario(
    target: &WriteTarget,
    own: Option<&SessionFile>,
    text: &str,
    options: &SaveOptions,
) -> Result<ReplyBody, Problem> {
    let own = own.filter(|own| is_same_file(&own.path, target)).map(|own| own.text.as_str());
    // A reconnected page knows a different text from the one that its new session has read.
    let known = options.base.as_deref().or(own);
    let kept = replace_file(target, text, own.is_some(), |found| match found {
        None => true,
        Some(found) => options.overwrite || known == Some(found) || found == text,
    })?;
    match kept {
        None => Ok(ReplyBody::Saved { place: target.path.display().to_string() }),
        Some(text) => Ok(ReplyBody::Differs { text }),
    }
}

fn is_same_file(path: &Path, target: &WriteTarget) -> bool {
    path == target.path || path.canonicalize().is_ok_and(|real| real == target.real)
}
