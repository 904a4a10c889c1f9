//! Edits of texts by key, and the values in texts.

use super::open_run::{SessionDeps, source_with_text};
use crate::encode::problem;
use crate::protocol::{Edit, Problem, ReplyBody};
use serde_json::Value;
use sidestep_scenario::Source;

/// The key under which the TOML parser puts a date, which JSON does not have.
const DATE_KEY: &str = "$__toml_private_datetime";

/// Returns a text with all edits, one after the other.
///
/// # Errors
/// When texts are refused, or an edit does not fit.
pub(crate) fn apply_edits(
    deps: &SessionDeps,
    source: &Source,
    text: String,
    edits: Vec<Edit>,
) -> Result<ReplyBody, Problem> {
    let source = source_with_text(deps, source, text)?;
    let edits: Vec<_> = edits.into_iter().map(Into::into).collect();
    let edited = source.edited(&edits).map_err(|e| problem(&e))?;
    Ok(ReplyBody::Edited { text: edited.text })
}

/// Returns the values in a text, and the files to which it can refer.
///
/// # Errors
/// When the text is not TOML.
pub(crate) fn text_values_reply(
    deps: &SessionDeps,
    source: &Source,
    text: String,
) -> Result<ReplyBody, Problem> {
    let source = Source { text, ..source.clone() };
    let mut value: Value = source.parse().map_err(|e| problem(&e))?;
    let mut names = Vec::new();
    stringify_dates(&mut value, &mut names);
    let files = deps.files.file_choices(&source, &names);
    Ok(ReplyBody::Model { value, files })
}

/// Replaces dates by strings, and collects all strings.
fn stringify_dates(value: &mut Value, strings: &mut Vec<String>) {
    if let Some(Value::String(date)) = value.get(DATE_KEY) {
        *value = Value::String(date.clone());
    }
    match value {
        Value::Array(items) => items.iter_mut().for_each(|item| stringify_dates(item, strings)),
        Value::Object(members) => {
            members.values_mut().for_each(|member| stringify_dates(member, strings))
        }
        Value::String(text) => strings.push(text.clone()),
        _ => {}
    }
}
