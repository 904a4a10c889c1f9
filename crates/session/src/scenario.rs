//! A scenario as given and overrides -> a valid scenario.

use sidestep_experiment as experiment;
use sidestep_kernel::InputError;
use sidestep_scenario::{CompiledScenario, ImportOptions, ImportedScenario, Source, Worlds};
use std::path::Path;

/// Reads a scenario, applies `key=value` overrides and compiles it.
///
/// # Errors
/// When the scenario or an override is wrong.
pub fn read_scenario(
    worlds: &Worlds,
    file: &Path,
    overrides: &[String],
) -> Result<(Source, Box<dyn CompiledScenario>), InputError> {
    GivenScenario::read(worlds, file, overrides)?.compile(worlds, overrides)
}

/// Returns all problems of a scenario and its overrides, see [`GivenScenario::problems`].
///
/// # Errors
/// When the scenario cannot be read, or an override does not fit.
pub fn problems(
    worlds: &Worlds,
    file: &Path,
    overrides: &[String],
) -> Result<Vec<InputError>, InputError> {
    GivenScenario::read(worlds, file, overrides)?.problems(worlds, overrides)
}

/// Returns the scenario in a file, or the one that a file of another format represents, with
/// overrides.
///
/// # Errors
/// When the file cannot be read, or an override does not fit.
pub(crate) fn read_source(
    worlds: &Worlds,
    file: &Path,
    overrides: &[String],
) -> Result<Source, InputError> {
    let given = GivenScenario::read(worlds, file, overrides)?;
    let overrides = given.scenario_overrides(overrides);
    given.source.with_overrides(&overrides)
}

/// A scenario as it was given: in a file of its own format or another one, or as a text; without overrides.
#[derive(Debug, Clone)]
pub struct GivenScenario {
    source: Source,
    /// The report about the file of another program that the text was made from.
    import: Option<ImportedScenario>,
    /// The options by which that file was read.
    options: ImportOptions,
}

impl From<Source> for GivenScenario {
    fn from(source: Source) -> Self {
        Self { source, import: None, options: ImportOptions::default() }
    }
}

impl GivenScenario {
    /// Reads the scenario in a file, or the one that a file of another format represents: by those of the overrides
    /// that are options of an import.
    ///
    /// # Errors
    /// When the file cannot be read, or nothing in it can be simulated.
    pub fn read(worlds: &Worlds, file: &Path, overrides: &[String]) -> Result<Self, InputError> {
        let options = ImportOptions::from_overrides(overrides);
        let Some(import) = worlds.import_scenario(file, &options)? else {
            return Ok(Source::read(file, &[])?.into());
        };
        let text = import.scenario.clone()?;
        let source = Source::new(file.display().to_string(), text, "");
        Ok(Self { source, import: Some(import), options })
    }

    /// Returns the overrides without the options by which the file was read; others stay, and are unknown keys.
    pub fn scenario_overrides(&self, overrides: &[String]) -> Vec<String> {
        let is_used =
            self.import.is_some() && ImportOptions::from_overrides(overrides) == self.options;
        let is_kept = |text: &&String| !(is_used && ImportOptions::is_option(text));
        overrides.iter().filter(is_kept).cloned().collect()
    }

    /// The text, and the folder that its paths are relative to.
    pub fn source(&self) -> &Source {
        &self.source
    }

    /// The report about the file of another program that the text was made from.
    pub fn import_report(&self) -> Option<&ImportedScenario> {
        self.import.as_ref()
    }

    /// Compiles the scenario with overrides. An error that an override causes reports it.
    ///
    /// # Errors
    /// When the scenario or an override is wrong.
    pub fn compile(
        &self,
        worlds: &Worlds,
        overrides: &[String],
    ) -> Result<(Source, Box<dyn CompiledScenario>), InputError> {
        let overrides = &self.scenario_overrides(overrides);
        let source = self.source.clone().with_overrides(overrides)?;
        let error = match worlds.compile(&source) {
            Ok(compiled) => return Ok((source, compiled)),
            // An error in another file, e.g. in a profile, has its own place.
            Err(error) if overrides.is_empty() || error.place() != source.place => error,
            Err(error) => self.locate_error(worlds, overrides, error),
        };
        Err(self.without_imported_lines(&source, error))
    }

    /// Returns all problems of the scenario and its overrides, see [`sidestep_experiment::problems()`]; none if it is
    /// right. An error that an override causes reports it. For a file of another program only the first is reported:
    /// its author cannot edit the text made from it, and the other problems may follow from the first.
    ///
    /// # Errors
    /// When an override does not fit.
    pub fn problems(
        &self,
        worlds: &Worlds,
        overrides: &[String],
    ) -> Result<Vec<InputError>, InputError> {
        if self.import.is_some() {
            return Ok(self.compile(worlds, overrides).err().into_iter().collect());
        }
        let source = self.source.clone().with_overrides(overrides)?;
        let found = experiment::problems(worlds, &source);
        if overrides.is_empty() || found.is_empty() {
            return Ok(found);
        }
        let mut earlier = Vec::with_capacity(overrides.len());
        for count in 0..overrides.len() {
            let source = self.source.clone().with_overrides(&overrides[..count])?;
            earlier.push(experiment::problems(worlds, &source));
        }
        let mut explained = Vec::with_capacity(found.len());
        for error in found {
            let is_in_text = error.place() == source.place;
            explained.push(if is_in_text {
                self.explain_problem(error, overrides, &earlier)
            } else {
                error
            });
        }
        Ok(explained)
    }

    /// Returns a problem of the text with all overrides as one of the text as given, or of the override that caused
    /// it. `earlier` has the problems of the text with none of the overrides, with the first, and so on.
    fn explain_problem(
        &self,
        error: InputError,
        overrides: &[String],
        earlier: &[Vec<InputError>],
    ) -> InputError {
        for (count, errors) in earlier.iter().enumerate() {
            let Some(same) = errors.iter().find(|one| is_same_problem(one, &error)) else {
                continue;
            };
            return match count {
                // Its position is that in the text which its author sees.
                0 => same.clone(),
                _ => self.override_error(&overrides[count - 1], &error),
            };
        }
        self.override_error(&overrides[overrides.len() - 1], &error)
    }

    /// Returns the same error with its position in the text as given, or with the override that caused it: users
    /// do not see the lines of the text that overrides have edited.
    fn locate_error(&self, worlds: &Worlds, overrides: &[String], error: InputError) -> InputError {
        for count in 0..=overrides.len() {
            let Ok(source) = self.source.clone().with_overrides(&overrides[..count]) else {
                continue;
            };
            let found = worlds.compile(&source).err();
            let Some(same) = found.filter(|found| found.cause() == error.cause()) else {
                continue;
            };
            return match count {
                0 => same,
                _ => self.override_error(&overrides[count - 1], &error),
            };
        }
        error
    }

    /// Returns an error with the override that caused it as its place.
    fn override_error(&self, override_text: &str, error: &InputError) -> InputError {
        let place = format!("{} with --set {override_text}", self.source.place);
        with_key(InputError::new(place, error.cause(), error.remedy()), error.key())
    }

    /// Returns an error in a text that was made from a file of another program without its position: users do not see
    /// the lines of that text.
    fn without_imported_lines(&self, source: &Source, error: InputError) -> InputError {
        let is_in_text = [source.place.as_str(), source.file_place()].contains(&error.place());
        if self.import.is_none() || !is_in_text {
            return error;
        }
        let place = format!("the scenario made from {}", self.source.place);
        with_key(InputError::new(place, error.cause(), error.remedy()), error.key())
    }
}

/// Returns whether two errors are of one problem, wherever in the text they stand: overrides move lines.
fn is_same_problem(a: &InputError, b: &InputError) -> bool {
    a.cause() == b.cause() && a.key() == b.key()
}

fn with_key(error: InputError, key: Option<&str>) -> InputError {
    match key {
        Some(key) => error.with_key(key),
        None => error,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::WORLDS;

    #[test]
    fn all_errors_name_their_overrides_or_their_lines() {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("s.toml");
        let text = "format = 1\nworld = \"airspace\"\n[airspace]\ndt_s = -1\n\
                    [airspace.generator]\nkind = \"superconflict\"\nn = 3\n";
        std::fs::write(&file, text).expect("written");
        let overrides = ["airspace.beta=7", "cycles=5", "airspace.generator.n=-3"];
        let told = problems(&WORLDS, &file, &overrides.map(String::from)).expect("read");
        let told: Vec<_> =
            told.iter().map(|e| (e.key().unwrap_or(""), e.line_and_column())).collect();
        assert_eq!(
            told,
            [
                ("airspace.dt_s", Some((4, 8))),
                ("airspace.beta", None),
                ("airspace.generator.n", None)
            ]
        );
        assert_eq!(problems(&WORLDS, &file, &["airspace.dt_s=5".into()]), Ok(vec![]));
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
        let error = read_scenario(&WORLDS, &file, &[]).err().expect("wrong");
        let place = format!("the scenario made from {}", file.display());
        assert_eq!((error.place(), error.line_and_column()), (place.as_str(), None), "{error}");
        assert!(error.cause().contains("orders") && error.key().is_some(), "{error}");
        assert_eq!(problems(&WORLDS, &file, &[]), Ok(vec![error.clone()]));
        let other = read_scenario(&WORLDS, &file, &["seed=3".into()]).err().expect("wrong");
        assert_eq!(other, error, "no override causes it");
        let caused =
            read_scenario(&WORLDS, &file, &["airspace.dt_s=-3".into()]).err().expect("wrong");
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
            read_scenario(&WORLDS, &file, &overrides).err().expect("wrong")
        };
        let error = of(&["airspace.dt_s=4", "airspace.generator.n=-3", "airspace.shield=off"]);
        assert!(error.place().ends_with("s.toml with --set airspace.generator.n=-3"), "{error}");
        assert_eq!((error.line_and_column(), error.cause()), (None, "n = -3"));
        std::fs::write(&file, text.replace("n = 3", "n = -4")).expect("written");
        let error = of(&["airspace.dt_s=4"]);
        assert_eq!((error.line_and_column(), error.cause()), (Some((5, 5)), "n = -4"));
        assert!(error.place().ends_with("s.toml"), "{error}");
    }

    #[test]
    fn options_of_an_import_change_what_is_read_and_are_no_keys_of_a_scenario() {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("t.csv");
        let row = |k: u32, minutes: u32| {
            let time_s = 60 * minutes + 10 * k;
            format!("{time_s},a,47.0,{:.2},35000\n", 7.0 + 0.03 * f64::from(k))
        };
        let rows: String = (0..6).map(|k| row(k, if k < 3 { 0 } else { 5 })).collect();
        std::fs::write(&file, format!("time_s,icao24,lat_deg,lon_deg,alt_ft\n{rows}"))
            .expect("written");
        let bodies = |overrides: &[&str]| {
            let overrides: Vec<String> = overrides.iter().map(ToString::to_string).collect();
            read_scenario(&WORLDS, &file, &overrides).map(|(_, compiled)| compiled.body_count())
        };
        assert_eq!(bodies(&[]), Ok(1));
        assert_eq!(bodies(&["import.max_gap_s=60", "seed=3"]), Ok(2));
        let error = bodies(&["import.gap=60"]).expect_err("no such option");
        assert!(error.remedy().contains("max_gap_s"), "{error}");
        let toml = folder.path().join("s.toml");
        let text = "format = 1\nworld = \"airspace\"\n[airspace.generator]\n\
                    kind = \"superconflict\"\nn = 3\n";
        std::fs::write(&toml, text).expect("written");
        assert!(read_scenario(&WORLDS, &toml, &["import.max_gap_s=60".into()]).is_err());
    }
}
