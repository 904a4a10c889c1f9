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

/// Returns all that is wrong with a scenario and its overrides, see [`sidestep::problems`]; none of one
/// that is right. An error that an override causes names it.
///
/// # Errors
/// When the scenario cannot be read, or an override does not fit.
pub fn problems(
    worlds: Worlds,
    file: &Path,
    overrides: &[String],
) -> Result<Vec<InputError>, InputError> {
    let of = |count: usize| {
        let source = source_of(worlds, file, &overrides[..count])?;
        Ok((sidestep::problems(worlds, &source), source.place))
    };
    let (told, place) = of(overrides.len())?;
    if overrides.is_empty() || told.is_empty() {
        return Ok(told);
    }
    let earlier: Result<Vec<_>, InputError> = (0..overrides.len()).map(of).collect();
    let earlier: Vec<Vec<InputError>> = earlier?.into_iter().map(|(told, _)| told).collect();
    let explained = |error: InputError| {
        let is_same = |one: &&InputError| (one.cause(), one.key()) == (error.cause(), error.key());
        let found = |told: &Vec<InputError>| told.iter().find(is_same).cloned();
        match earlier.iter().position(|told| found(told).is_some()) {
            _ if error.place() != place => error,
            Some(0) => found(&earlier[0]).unwrap_or(error),
            Some(count) => caused(file, &overrides[count - 1], &error),
            None => caused(file, &overrides[overrides.len() - 1], &error),
        }
    };
    Ok(told.into_iter().map(explained).collect())
}

/// Returns an error with the override that causes it as its place.
fn caused(file: &Path, override_text: &str, error: &InputError) -> InputError {
    let place = format!("{} with --set {override_text}", file.display());
    let told = InputError::new(place, error.cause(), error.remedy());
    match error.key() {
        Some(key) => told.with_key(key),
        None => told,
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
        Some((count, _)) => caused(file, &overrides[count - 1], &error),
        None => error,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sidestep::worlds::WORLDS;

    #[test]
    fn all_errors_name_their_overrides_or_their_lines() {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("s.toml");
        let text = "format = 1\nworld = \"airspace\"\n[airspace]\ndt_s = -1\n\
                    [airspace.generator]\nkind = \"superconflict\"\nn = 3\n";
        std::fs::write(&file, text).expect("written");
        let overrides = ["airspace.beta=7", "cycles=5", "airspace.generator.n=-3"];
        let told = problems(WORLDS, &file, &overrides.map(String::from)).expect("read");
        let told: Vec<_> = told.iter().map(|e| (e.key().unwrap_or(""), e.position())).collect();
        assert_eq!(
            told,
            [
                ("airspace.dt_s", Some((4, 8))),
                ("airspace.beta", None),
                ("airspace.generator.n", None)
            ]
        );
        assert_eq!(problems(WORLDS, &file, &["airspace.dt_s=5".into()]), Ok(vec![]));
    }

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
