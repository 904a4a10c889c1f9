//! A scenario file and overrides -> a valid scenario.

use sidestep::kernel::InputError;
use sidestep::scenario::{CompiledScenario, Source, Worlds};
use std::path::Path;

/// Reads a scenario, applies `key=value` overrides and compiles it.
///
/// # Errors
/// When the scenario or an override is wrong.
pub fn read_scenario(
    worlds: Worlds,
    file: &Path,
    overrides: &[String],
) -> Result<(Source, Box<dyn CompiledScenario>), InputError> {
    let (source, is_made) = import_or_read(worlds, file, overrides)?;
    let told = match worlds.compile(&source) {
        Ok(compiled) => return Ok((source, compiled)),
        // An error in another file, e.g. in a profile, has its own place.
        Err(error) if overrides.is_empty() || error.place() != source.place => error,
        Err(error) => locate_error(worlds, file, overrides, error),
    };
    Err(if is_made { imported_text_error(file, &source, told) } else { told })
}

/// Returns an error in a text that was made from a file of another program, without its position: users do not see
/// the lines of that text.
fn imported_text_error(file: &Path, source: &Source, error: InputError) -> InputError {
    if ![source.place.as_str(), source.file_place()].contains(&error.place()) {
        return error;
    }
    let place = format!("the scenario made from {}", file.display());
    with_key(InputError::new(place, error.cause(), error.remedy()), error.key())
}

fn with_key(error: InputError, key: Option<&str>) -> InputError {
    match key {
        Some(key) => error.with_key(key),
        None => error,
    }
}

/// Returns all problems of a scenario and its overrides, see [`sidestep::problems`]; none if it is right. An error
/// that an override causes names it. For a file of another program only the first is reported: its author cannot edit
/// the text made from it, and the other problems may follow from the first.
///
/// # Errors
/// When the scenario cannot be read, or an override does not fit.
pub fn problems(
    worlds: Worlds,
    file: &Path,
    overrides: &[String],
) -> Result<Vec<InputError>, InputError> {
    if worlds.translate(file)?.is_some() {
        return Ok(read_scenario(worlds, file, overrides).err().into_iter().collect());
    }
    let of = |count: usize| {
        let source = read_source(worlds, file, &overrides[..count])?;
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
            Some(count) => override_error(file, &overrides[count - 1], &error),
            None => override_error(file, &overrides[overrides.len() - 1], &error),
        }
    };
    Ok(told.into_iter().map(explained).collect())
}

/// Returns an error with the override that caused it as its place.
fn override_error(file: &Path, override_text: &str, error: &InputError) -> InputError {
    let place = format!("{} with --set {override_text}", file.display());
    with_key(InputError::new(place, error.cause(), error.remedy()), error.key())
}

/// Returns the scenario in a file, or the one that a file of another format represents, with
/// overrides.
///
/// # Errors
/// When the file cannot be read, or an override does not fit.
pub(crate) fn read_source(
    worlds: Worlds,
    file: &Path,
    overrides: &[String],
) -> Result<Source, InputError> {
    Ok(import_or_read(worlds, file, overrides)?.0)
}

/// Returns the same scenario, and whether its text was made from a file of another format.
fn import_or_read(
    worlds: Worlds,
    file: &Path,
    overrides: &[String],
) -> Result<(Source, bool), InputError> {
    let Some(foreign) = worlds.translate(file)? else {
        return Ok((Source::read(file, overrides)?, false));
    };
    let source = Source::new(file.display().to_string(), foreign.scenario?, "");
    Ok((source.with_overrides(overrides)?, true))
}

/// Returns the same error with its position in the file, or with the override that caused it: users
/// do not see the lines of the text that overrides have edited.
fn locate_error(
    worlds: Worlds,
    file: &Path,
    overrides: &[String],
    error: InputError,
) -> InputError {
    let with = |count: usize| {
        let source = read_source(worlds, file, &overrides[..count]).ok()?;
        worlds.compile(&source).err().filter(|found| found.cause() == error.cause())
    };
    match (0..=overrides.len()).find_map(|count| Some((count, with(count)?))) {
        Some((0, plain)) => plain,
        Some((count, _)) => override_error(file, &overrides[count - 1], &error),
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
    fn errors_of_what_was_made_from_another_programs_file_point_at_no_line_of_it() {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("a.scn");
        // More orders than an airplane carries out: nothing is wrong with any of them.
        let turns = (1..=20_000)
            .map(|k| format!("00:10:{:05.2}>HDG A1 {}\n", 0.002 * f64::from(k), k % 360));
        let text = "00:00:00.00>CRE A1,B744,0,-0.4,90,FL200,250\n".to_string()
            + &turns.collect::<String>();
        std::fs::write(&file, text).expect("written");
        let error = read_scenario(WORLDS, &file, &[]).err().expect("wrong");
        let place = format!("the scenario made from {}", file.display());
        assert_eq!((error.place(), error.position()), (place.as_str(), None), "{error}");
        assert!(error.cause().contains("orders") && error.key().is_some(), "{error}");
        assert_eq!(problems(WORLDS, &file, &[]), Ok(vec![error.clone()]));
        let other = read_scenario(WORLDS, &file, &["seed=3".into()]).err().expect("wrong");
        assert_eq!(other, error, "no override causes it");
        let caused =
            read_scenario(WORLDS, &file, &["airspace.dt_s=-3".into()]).err().expect("wrong");
        assert!(caused.place().ends_with("a.scn with --set airspace.dt_s=-3"), "{caused}");
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
            read_scenario(WORLDS, &file, &overrides).err().expect("wrong")
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
