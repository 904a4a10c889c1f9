//! A scenario file and overrides -> a valid scenario.

use sidestep::kernel::InputError;
use sidestep::scenario::{Compiled, Source, Worlds};
use std::path::Path;

/// Reads a scenario, applies `key=value` overrides and compiles it.
///
/// # Errors
/// When the scenario or an override is wrong.
pub fn read(
    worlds: Worlds,
    file: &Path,
    overrides: &[String],
) -> Result<(Source, Box<dyn Compiled>), InputError> {
    let source = source_of(worlds, file, overrides)?;
    match worlds.compile(&source) {
        Ok(compiled) => Ok((source, compiled)),
        Err(error) if overrides.is_empty() => Err(error),
        Err(error) => Err(in_the_file_itself(worlds, file, error)),
    }
}

/// Returns the scenario in a file, or the one that a file of another format stands for, with
/// overrides.
///
/// # Errors
/// When the file cannot be read, or an override does not fit.
pub(crate) fn source_of(
    worlds: Worlds,
    file: &Path,
    overrides: &[String],
) -> Result<Source, InputError> {
    match worlds.translate(file)? {
        Some(foreign) => {
            Source::new(file.display().to_string(), foreign.scenario?, "").with(overrides)
        }
        None => Source::read(file, overrides),
    }
}

/// Returns the same error with its position in the file, unless an override caused it: overrides
/// may move lines.
fn in_the_file_itself(worlds: Worlds, file: &Path, error: InputError) -> InputError {
    if !matches!(worlds.translate(file), Ok(None)) {
        return error;
    }
    let plain = Source::read(file, &[]).and_then(|source| worlds.compile(&source).map(drop));
    match plain {
        Err(plain) if plain.cause() == error.cause() => plain,
        _ => error,
    }
}
