//! Changes of a scenario's text by keys. All text that an edit does not concern stays the same, byte for byte.
//!
//! ```text
//! path.rs     `robots.1.at` -> parts          layout.rs   text -> positions of all keys
//! value.rs    values -> text                  splice.rs   pieces of text that are replaced
//! set.rs      values in place of others       create.rs   new keys and sections
//! section.rs  text of new sections            insert.rs   new and moved elements
//! blocks.rs   lines and sections of a text    lists.rs    elements of arrays
//! members.rs  keys of inline tables           rename.rs   renamed keys
//! paint.rs    characters of maps drawn in text
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

/// The maximum number of edits at a time. The page sends edits in batches; without a bound a request could keep the
/// server busy.
const MAX_EDITS: usize = 1000;
/// The maximum number of bytes that all edits together may parse: each parses the text anew, some seconds in all.
const MAX_WORK_BYTES: usize = 1 << 30;

/// A change of a scenario. Keys are those of overrides: `robots.1.at.0`, with elements counted from 0; a single
/// section has the number 0 or none, and parts with dots are quoted.
#[derive(Debug, Clone, PartialEq)]
pub enum Edit {
    /// Sets a value; creates its parent tables.
    Set {
        /// The key, which need not exist.
        key: String,
        /// The value; whole numbers become integers, or floats where a float was.
        value: Value,
    },
    /// Inserts an element into an array or a list of sections, which is created if it does not exist.
    Insert {
        /// The key of the array.
        key: String,
        /// The element's number from then on; the last if not given.
        at: Option<usize>,
        /// The element.
        value: Value,
    },
    /// Removes a key, an element or a section.
    Remove {
        /// The key; of an element, it ends in its number.
        key: String,
    },
    /// Moves an element or a section to another position of its array.
    Move {
        /// The key of the element.
        key: String,
        /// Its number from then on.
        to: usize,
    },
    /// Gives a key another name.
    Rename {
        /// The key with its old name.
        key: String,
        /// The new name of its last part.
        to: String,
    },
    /// Changes characters of a map that is drawn in text.
    Paint {
        /// The key of the map, a string.
        key: String,
        /// The new characters.
        cells: Vec<CharEdit>,
    },
}

/// A character of a map that is drawn in text.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CharEdit {
    /// Its row, from 0 at the top; a first row that is empty does not count.
    pub row: usize,
    /// Its column, from 0 at the left.
    pub column: usize,
    /// The new character: no quote, backslash or control character.
    pub mark: char,
}

/// The reason why an edit cannot be done.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct EditError {
    pub(crate) cause: String,
    pub(crate) remedy: String,
}

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
    /// they do not concern stays the same, byte for byte.
    ///
    /// # Errors
    /// When the text is not TOML, or an edit does not fit it.
    pub fn edited(&self, edits: &[Edit]) -> Result<Self, InputError> {
        if edits.len() > MAX_EDITS || edits.len().saturating_mul(self.text.len()) > MAX_WORK_BYTES {
            let cause = format!("{} changes of this text are too many at a time", edits.len());
            return Err(InputError::new(&self.place, cause, "send fewer"));
        }
        let mut source = self.clone();
        for edit in edits {
            let input_error = |error: EditError| {
                let place = format!("{} ({})", self.place, edit.key());
                InputError::new(place, error.cause, error.remedy).with_key(edit.key())
            };
            if let Edit::Set { key, value } = edit {
                source.change(
                    |layout| set::add_header(layout, &parse_key(key)?, value),
                    input_error,
                )?;
            }
            source.change(|layout| edit.to_splices(layout), input_error)?;
        }
        Ok(source)
    }

    /// Sets a key to a value given as TOML.
    pub(crate) fn set_to(
        &mut self,
        key: &str,
        value: &toml_edit::Value,
        input_error: impl Fn(EditError) -> InputError,
    ) -> Result<(), InputError> {
        let text = value.to_string();
        self.change(
            |layout| set::set(layout, &parse_key(key)?, NewValue::Toml(text.trim())),
            input_error,
        )
    }

    /// Sets the keys that already have values to new ones, given as TOML, with one parse of the text; returns the
    /// numbers of the remaining keys. Sets none if one key equals another, or is a part of another.
    ///
    /// The other edits parse the text once for each key: a sweep overrides many keys in thousands of texts.
    pub(crate) fn replace_values(&mut self, values: &[(&str, String)]) -> Vec<usize> {
        let all = || (0..values.len()).collect();
        let Ok(layout) = Layout::parse(&self.text) else { return all() };
        let mut replacements = Vec::with_capacity(values.len());
        for (key, text) in values {
            let Ok(key) = parse_key(key) else { return all() };
            let Some(replacement) = set::replacement(&layout, &key, text) else { return all() };
            replacements.push(replacement);
        }
        let mut paths: Vec<_> = replacements.iter().map(|(path, _)| path).collect();
        // A path is then directly before its own continuations.
        paths.sort();
        if paths.windows(2).any(|pair| pair[1].starts_with(pair[0])) {
            return all();
        }
        let rest = (0..values.len()).filter(|k| replacements[*k].1.is_none()).collect();
        let splices = replacements.into_iter().filter_map(|(_, splice)| splice).collect();
        self.text = splice::apply_splices(&self.text, splices);
        rest
    }

    /// Makes one change, or leaves the text as it was: the result must be TOML again.
    fn change(
        &mut self,
        splices: impl FnOnce(&Layout<'_>) -> Result<Vec<Splice>, EditError>,
        input_error: impl Fn(EditError) -> InputError,
    ) -> Result<(), InputError> {
        // Splices may assume that every line ends in a line break; a last line without one stays so.
        let lacks_line_break = !self.text.is_empty() && !self.text.ends_with('\n');
        if lacks_line_break {
            self.text.push('\n');
        }
        let layout = Layout::parse(&self.text).map_err(|e| self.not_toml(&e))?;
        let splices = splices(&layout).map_err(&input_error)?;
        if splices.is_empty() {
            self.text.truncate(self.text.len() - usize::from(lacks_line_break));
            return Ok(());
        }
        let mut text = splice::apply_splices(&self.text, splices);
        if lacks_line_break && text.ends_with('\n') {
            text.pop();
        }
        Layout::parse(&text).map_err(|error| {
            let cause = format!("it would not be TOML any more: {}", error.message());
            input_error(edit_error(cause, "change the text itself"))
        })?;
        self.text = text;
        Ok(())
    }

    fn not_toml(&self, error: &toml_edit::TomlError) -> InputError {
        self.error(error.span(), error.message().to_string(), "write valid TOML")
    }
}
