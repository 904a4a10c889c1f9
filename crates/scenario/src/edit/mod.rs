//! Changes of a scenario's text by keys. All text that an edit does not address stays the same, byte for byte.
//!
//! ```text
//! path.rs     `robots.1.at` -> parts          layout.rs   text -> places of all keys
//! value.rs    values -> text                  splice.rs   pieces of text that are replaced
//! set.rs      values in place of others       create.rs   new keys and sections
//! section.rs  text of new sections            insert.rs   new and moved elements
//! blocks.rs   lines and sections of a text    lists.rs    elements of arrays in brackets
//! members.rs  keys of tables in braces        rename.rs   renamed keys
//! paint.rs    characters of drawings
//! ```
//! An edit reads the text, and gives a list of pieces to replace: the text is never rebuilt from its parsed form,
//! so that comments, order and layout cannot be lost.

mod blocks;
mod create;
mod insert;
mod layout;
mod lists;
mod members;
mod paint;
mod path;
mod rename;
mod section;
mod set;
mod splice;
mod value;

#[cfg(test)]
mod tests;

pub(crate) use path::{KeyPart, parse_key};

use crate::Source;
use layout::Layout;
use serde_json::Value;
use sidestep_kernel::InputError;
use splice::Splice;
use value::NewValue;

/// The largest number of edits at a time.
const MAX_EDITS: usize = 1000;
/// The largest number of bytes that all edits together may read.
const MAX_WORK_BYTES: usize = 1 << 30;

/// A change of a scenario. Keys are those of overrides: `robots.1.at.0`, with elements counted from 0, and a section
/// that stands alone named by 0 or without a number; parts with dots stand in quotes.
#[derive(Debug, Clone, PartialEq)]
pub enum Edit {
    /// Sets a value; makes the tables on the way to it.
    Set {
        /// The key.
        key: String,
        /// The value; whole numbers become integers, or floats where a float was.
        value: Value,
    },
    /// Inserts an element into an array or a list of sections, which is made if it is not there.
    Insert {
        /// The key of the array.
        key: String,
        /// The element's number from then on; the last without it.
        at: Option<usize>,
        /// The element.
        value: Value,
    },
    /// Removes a key, an element or a section.
    Remove {
        /// The key.
        key: String,
    },
    /// Moves an element or a section to another place of its array.
    Move {
        /// The key of the element.
        key: String,
        /// Its number from then on.
        to: usize,
    },
    /// Gives a key another name.
    Rename {
        /// The key.
        key: String,
        /// The new name of its last part.
        to: String,
    },
    /// Changes characters of a drawing.
    Paint {
        /// The key of the drawing, a string.
        key: String,
        /// The new characters.
        cells: Vec<CharEdit>,
    },
}

/// A character of a drawing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CharEdit {
    /// Its row, from 0 at the top; a first row that is empty does not count.
    pub row: usize,
    /// Its column, from 0 at the left.
    pub column: usize,
    /// The character.
    pub mark: char,
}

/// The reason why an edit cannot be done.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct EditError {
    pub(crate) cause: String,
    pub(crate) remedy: String,
}

/// Returns a refusal.
fn edit_error(cause: impl Into<String>, remedy: impl Into<String>) -> EditError {
    EditError { cause: cause.into(), remedy: remedy.into() }
}

impl Edit {
    /// Returns the key that it changes.
    pub fn key(&self) -> &str {
        match self {
            Self::Set { key, .. }
            | Self::Insert { key, .. }
            | Self::Remove { key }
            | Self::Move { key, .. }
            | Self::Rename { key, .. }
            | Self::Paint { key, .. } => key,
        }
    }

    /// Returns the pieces that it replaces in a text.
    fn to_splices(&self, layout: &Layout<'_>) -> Result<Vec<Splice>, EditError> {
        let key = parse_key(self.key())?;
        match self {
            Self::Set { value, .. } => set::set(layout, &key, NewValue::Json(value)),
            Self::Insert { at, value, .. } => insert::insert(layout, &key, *at, value),
            Self::Remove { .. } => set::remove(layout, &key),
            Self::Move { to, .. } => insert::relocate(layout, &key, *to),
            Self::Rename { to, .. } => rename::rename(layout, &key, to),
            Self::Paint { cells, .. } => paint::paint(layout, &key, cells),
        }
    }
}

impl Source {
    /// Returns the scenario with changes of its text: all of them, one after the other, or an error. All text that
    /// they do not name stays the same, byte for byte.
    ///
    /// # Errors
    /// When the text is not TOML, or an edit does not fit it.
    pub fn edited(&self, edits: &[Edit]) -> Result<Self, InputError> {
        if edits.len() > MAX_EDITS || edits.len().saturating_mul(self.text.len()) > MAX_WORK_BYTES {
            let cause = format!("{} changes of this text are too many at a time", edits.len());
            return Err(InputError::new(&self.place, cause, "ask for fewer"));
        }
        let mut source = self.clone();
        for edit in edits {
            let told = |r: EditError| {
                let place = format!("{} ({})", self.place, edit.key());
                InputError::new(place, r.cause, r.remedy).with_key(edit.key())
            };
            if let Edit::Set { key, value } = edit {
                source.change(|layout| set::add_header(layout, &parse_key(key)?, value), told)?;
            }
            source.change(|layout| edit.to_splices(layout), told)?;
        }
        Ok(source)
    }

    /// Sets a key to a value given as TOML.
    pub(crate) fn set_to(
        &mut self,
        key: &str,
        value: &toml_edit::Value,
        told: impl Fn(EditError) -> InputError,
    ) -> Result<(), InputError> {
        let text = value.to_string();
        let set =
            |layout: &Layout<'_>| set::set(layout, &parse_key(key)?, NewValue::Toml(text.trim()));
        self.change(set, told)
    }

    /// Sets the keys that already have values to new ones, given as TOML, with one reading of the text; returns the
    /// numbers of the remaining keys. Sets none if one key equals another, or is a part of another.
    pub(crate) fn replace_values(&mut self, given: &[(&str, String)]) -> Vec<usize> {
        let all = || (0..given.len()).collect();
        let Ok(layout) = Layout::parse(&self.text) else { return all() };
        let found =
            |(key, text): &(&str, String)| set::replacement(&layout, &parse_key(key).ok()?, text);
        let Some(found) = given.iter().map(found).collect::<Option<Vec<_>>>() else { return all() };
        let mut ways: Vec<_> = found.iter().map(|(way, _)| way).collect();
        // A path comes directly before its own continuations.
        ways.sort();
        if ways.windows(2).any(|pair| pair[1].starts_with(pair[0])) {
            return all();
        }
        let rest = (0..given.len()).filter(|k| found[*k].1.is_none()).collect();
        let splices = found.into_iter().filter_map(|(_, splice)| splice).collect();
        self.text = splice::apply_splices(&self.text, splices);
        rest
    }

    /// Makes one change.
    fn change(
        &mut self,
        splices: impl FnOnce(&Layout<'_>) -> Result<Vec<Splice>, EditError>,
        told: impl Fn(EditError) -> InputError,
    ) -> Result<(), InputError> {
        let is_open = !self.text.is_empty() && !self.text.ends_with('\n');
        if is_open {
            self.text.push('\n');
        }
        let layout = Layout::parse(&self.text).map_err(|e| self.not_toml(&e))?;
        let splices = splices(&layout).map_err(&told)?;
        if splices.is_empty() {
            self.text.truncate(self.text.len() - usize::from(is_open));
            return Ok(());
        }
        let text = splice::apply_splices(&self.text, splices);
        let mut changed = Self { text, ..self.clone() };
        // A last line without a line break stays so.
        if is_open && changed.text.ends_with('\n') {
            changed.text.pop();
        }
        Layout::parse(&changed.text).map_err(|error| {
            let cause = format!("it would not be TOML any more: {}", error.message());
            told(edit_error(cause, "change the text itself"))
        })?;
        *self = changed;
        Ok(())
    }

    fn not_toml(&self, error: &toml_edit::TomlError) -> InputError {
        self.error(error.span(), error.message().to_string(), "write valid TOML")
    }
}
