//! Changes of a scenario's text, by keys.

use serde::Deserialize;
use serde_json::Value;
use sidestep_scenario::CharEdit;

/// A change of a text. Keys are those of `--set`: `robots.1.at.0`; elements count from 0, and a section that stands
/// alone is 0 or left out. Parts that hold dots or are not bare are quoted: `kinds."a.b".observation`. Everything else
/// in the text stays the same, byte for byte.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[cfg_attr(test, derive(ts_rs::TS))]
#[serde(tag = "op", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Edit {
    /// Sets a value; makes the tables on the way to it.
    Set {
        /// Its key.
        key: String,
        /// The value, which is not null.
        #[cfg_attr(test, ts(type = "unknown"))]
        value: Value,
    },
    /// Inserts an element into an array or a list of sections, which is made if it is not there.
    Insert {
        /// The key of the array.
        key: String,
        /// The element's number from then on; the last without it.
        at: Option<u32>,
        /// The element, which is not null.
        #[cfg_attr(test, ts(type = "unknown"))]
        value: Value,
    },
    /// Removes a key, an element or a section.
    Remove {
        /// Its key.
        key: String,
    },
    /// Moves an element or a section to another place of its array.
    Move {
        /// Its key, which ends in its number.
        key: String,
        /// Its number from then on.
        to: u32,
    },
    /// Gives a key another name.
    Rename {
        /// The key.
        key: String,
        /// Its new name, without the tables that it is in.
        to: String,
    },
    /// Changes characters of a drawing of several lines.
    Paint {
        /// The key of the drawing.
        key: String,
        /// Row from the top, column from the left, and the new character.
        cells: Vec<(u32, u32, char)>,
    },
}

impl From<Edit> for sidestep_scenario::Edit {
    fn from(edit: Edit) -> Self {
        match edit {
            Edit::Set { key, value } => Self::Set { key, value },
            Edit::Insert { key, at, value } => {
                Self::Insert { key, at: at.map(|at| at as usize), value }
            }
            Edit::Remove { key } => Self::Remove { key },
            Edit::Move { key, to } => Self::Move { key, to: to as usize },
            Edit::Rename { key, to } => Self::Rename { key, to },
            Edit::Paint { key, cells } => {
                Self::Paint { key, cells: cells.into_iter().map(char_edit).collect() }
            }
        }
    }
}

fn char_edit((row, column, mark): (u32, u32, char)) -> CharEdit {
    CharEdit { row: row as usize, column: column as usize, mark }
}
