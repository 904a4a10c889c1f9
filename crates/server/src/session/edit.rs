//! Texts that are edited by keys, and the values in them.

use super::stage::{Means, other_text};
use crate::encode::problem;
use crate::protocol::{Answer, Edit, Problem};
use serde_json::Value;
use sidestep::scenario::Source;

/// The key under which dates are read.
const DATE: &str = "$__toml_private_datetime";

/// Returns a text with edits.
///
/// # Errors
/// When texts are refused, or an edit does not fit.
pub(crate) fn edited(
    means: &Means,
    source: &Source,
    text: String,
    edits: Vec<Edit>,
) -> Result<Answer, Problem> {
    let source = other_text(means, source, text)?;
    let edits: Vec<_> = edits.into_iter().map(Into::into).collect();
    let edited = source.edited(&edits).map_err(|e| problem(&e))?;
    Ok(Answer::Edited { text: edited.text })
}

/// Returns the values in a text, and the files that it can name.
///
/// # Errors
/// When the text is not TOML.
pub(crate) fn model(means: &Means, source: &Source, text: String) -> Result<Answer, Problem> {
    let source = Source { text, ..source.clone() };
    let mut value: Value = source.parse().map_err(|e| problem(&e))?;
    let mut names = Vec::new();
    walk(&mut value, &mut names);
    let files = means.files.beside(&source, &names);
    Ok(Answer::Model { value, files })
}

/// Makes strings of dates, and collects all strings.
fn walk(value: &mut Value, strings: &mut Vec<String>) {
    if let Some(Value::String(date)) = value.get(DATE) {
        *value = Value::String(date.clone());
    }
    match value {
        Value::Array(items) => items.iter_mut().for_each(|item| walk(item, strings)),
        Value::Object(members) => members.values_mut().for_each(|member| walk(member, strings)),
        Value::String(text) => strings.push(text.clone()),
        _ => {}
    }
}
