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
        // An error in another file, e.g. in a profile, has its own place.
        Err(error) if overrides.is_empty() || error.place() != source.place => Err(error),
        Err(error) => Err(explained(worlds, file, overrides, error)),
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

/// Returns the same error with its position in the file, or with the override that causes it: the
/// lines of the text that overrides have edited are nobody's.
fn explained(worlds: Worlds, file: &Path, overrides: &[String], error: InputError) -> InputError {
    let with = |count: usize| {
        let source = source_of(worlds, file, &overrides[..count]).ok()?;
        worlds.compile(&source).err().filter(|found| found.cause() == error.cause())
    };
    match (0..=overrides.len()).find_map(|count| Some((count, with(count)?))) {
        Some((0, plain)) => plain,
        Some((count, _)) => {
            let place = format!("{} with --set {}", file.display(), overrides[count - 1]);
            InputError::new(place, error.cause(), error.remedy())
        }
        None => error,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sidestep::worlds::WORLDS;

    #[test]
    fn an_error_names_the_override_that_causes_it_or_the_line_of_the_file() {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("s.toml");
        let text = "format = 1\nworld = \"airspace\"\n[airspace.generator]\n\
                    kind = \"superconflict\"\nn = 3\n";
        std::fs::write(&file, text).expect("written");
        let of = |overrides: &[&str]| {
            let overrides: Vec<String> = overrides.iter().map(ToString::to_string).collect();
            read(WORLDS, &file, &overrides).err().expect("wrong")
        };
        let error = of(&["airspace.dt_s=4", "airspace.generator.n=-3", "airspace.shield=off"]);
        assert!(error.place().ends_with("s.toml with --set airspace.generator.n=-3"), "{error}");
        assert_eq!((error.position(), error.cause()), (None, "n = -3"));
        std::fs::write(&file, text.replace("n = 3", "n = -4")).expect("written");
        let error = of(&["airspace.dt_s=4"]);
        assert_eq!((error.position(), error.cause()), (Some((5, 5)), "n = -4"));
        assert!(error.place().ends_with("s.toml"), "{error}");
    }
}
