//! Texts that are edited by keys, and the values in them.

use super::open_run::{SessionDeps, source_with_text};
use crate::encode::problem;
use crate::protocol::{Edit, Problem, ReplyBody};
use serde_json::Value;
use sidestep_scenario::Source;

/// The key under which dates are read.
const DATE_KEY: &str = "$__toml_private_datetime";

/// Returns a text with edits.
///
/// # Errors
/// When texts are refused, or an edit does not fit.
pub(crate) fn apply_edits(
    means: &SessionDeps,
    source: &Source,
    text: String,
    edits: Vec<Edit>,
) -> Result<ReplyBody, Problem> {
    let source = source_with_text(means, source, text)?;
    let edits: Vec<_> = edits.into_iter().map(Into::into).collect();
    let edited = source.edited(&edits).map_err(|e| problem(&e))?;
    Ok(ReplyBody::Edited { text: edited.text })
}

/// Returns the values in a text, and the files that it can name.
///
/// # Errors
/// When the text is not TOML.
pub(crate) fn model(
    means: &SessionDeps,
    source: &Source,
    text: String,
) -> Result<ReplyBody, Problem> {
    let source = Source { text, ..source.clone() };
    let mut value: Value = source.parse().map_err(|e| problem(&e))?;
    let mut names = Vec::new();
    stringify_dates(&mut value, &mut names);
    let files = means.files.file_choices(&source, &names);
    Ok(ReplyBody::Model { value, files })
}

/// Makes strings of dates, and collects all strings.
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
