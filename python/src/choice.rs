//! Words that choose one of several values.

use crate::error::argument_error;
use pyo3::prelude::*;

/// Returns the value of a word. `known` is the only list of the words: an error lists them from it.
pub(crate) fn choose<T: Copy>(name: &str, word: &str, known: &[(&str, T)]) -> PyResult<T> {
    if let Some((_, value)) = known.iter().find(|(name, _)| *name == word) {
        return Ok(*value);
    }
    let words: Vec<&str> = known.iter().map(|(word, _)| *word).collect();
    let listed = match words.split_last() {
        Some((last, others)) if !others.is_empty() => format!("{} or {last}", others.join(", ")),
        _ => words.concat(),
    };
    Err(argument_error(name, format!("`{word}` is none of {listed}"), format!("give {listed}")))
}
