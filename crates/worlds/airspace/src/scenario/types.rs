//! Types of airplanes by name: those of a file of the user, of an installed OpenAP, and some built-in ones.

use super::AirspaceFile;
use crate::settings::{AbilityKeys, TypeSection};
use serde::Deserialize;
use sidestep_import::openap::{self, OpenapType};
use sidestep_kernel::InputError;
use sidestep_scenario::file::read_text;
use sidestep_scenario::{Source, Spanned, suggestion};
use std::collections::BTreeMap;
use std::path::Path;

/// The types that need no file, with the sources of their numbers.
const BUILT_IN: &str = include_str!("../types.toml");
/// Largest size in bytes of a file of types: some ten thousand of them.
const MAX_TYPES_BYTES: u64 = 4 << 20;

/// A file of types.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct TypesFile {
    /// The types by name.
    types: BTreeMap<String, TypeSection>,
}

/// The types that a scenario names.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct TypeTable {
    /// By the names that the scenario has for them.
    used: BTreeMap<String, AbilityKeys>,
    /// What their sources leave out, a line for each type.
    pub(super) missing: BTreeMap<String, Vec<String>>,
}

impl TypeTable {
    /// Reads the types that a scenario names.
    ///
    /// # Errors
    /// When a file cannot be read, or no table has a type.
    pub(super) fn load(source: &Source, file: &AirspaceFile) -> Result<Self, InputError> {
        let own = own_types(source, file)?;
        let mut table = Self::default();
        for name in named_types(file) {
            if table.used.contains_key(name.get_ref()) {
                continue;
            }
            if let Some(abilities) = find(&own, name.get_ref()) {
                table.used.insert(name.get_ref().clone(), abilities);
                continue;
            }
            if let Some(found) = openap_type(source, file, name.get_ref())? {
                table.add_openap_type(name.get_ref(), &found);
                continue;
            }
            match find(&built_in_types(), name.get_ref()) {
                Some(abilities) => table.used.insert(name.get_ref().clone(), abilities),
                None => return Err(unknown_type(source, file, &own, name)),
            };
        }
        Ok(table)
    }

    fn add_openap_type(&mut self, name: &str, found: &OpenapType) {
        let abilities = AbilityKeys {
            v_m_s: found.cruise_m_s,
            v_min_m_s: found.v_min_m_s,
            v_max_m_s: found.v_max_m_s,
            climb_max_m_s: found.climb_max_m_s,
            descent_max_m_s: found.descent_max_m_s,
            ceiling_m: found.ceiling_m,
            ..AbilityKeys::default()
        };
        self.used.insert(name.into(), abilities);
        let limits = [
            "bank_max_deg",
            "v_min_m_s",
            "v_max_m_s",
            "climb_max_m_s",
            "descent_max_m_s",
            "ceiling_m",
            "acceleration_m_s2",
        ];
        let given: Vec<&str> = abilities.given().into_iter().map(|(key, _)| key).collect();
        let missing = limits.into_iter().filter(|key| !given.contains(key));
        self.missing.insert(name.into(), missing.map(String::from).collect());
    }

    /// Returns the abilities of a type that the scenario names.
    pub(super) fn abilities(&self, name: &str) -> AbilityKeys {
        self.used.get(name).copied().unwrap_or_default()
    }

    /// Returns whether the scenario names no type.
    pub(super) fn is_empty(&self) -> bool {
        self.used.is_empty()
    }

    /// Returns a file with the types that the scenario names, as it has read them.
    pub(super) fn text(&self) -> String {
        let mut text = String::from("# The types of airplanes as the simulation read them.\n");
        for (name, abilities) in &self.used {
            text += &format!("\n[types.{}]\n", toml::Value::from(name.as_str()));
            for (key, value) in abilities.given() {
                text += &format!("{key} = {value:?}\n");
            }
        }
        text
    }
}

/// Returns all names of types in a scenario.
fn named_types(file: &AirspaceFile) -> impl Iterator<Item = &Spanned<String>> {
    let common = file.airplane.as_ref().and_then(|section| section.type_name.as_ref());
    let own = file.airplanes.0.iter().filter_map(|section| section.get_ref().type_name.as_ref());
    common.into_iter().chain(own)
}

/// Returns the abilities of a type; letters count alike in both cases, as in `a320`.
fn find(types: &BTreeMap<String, TypeSection>, name: &str) -> Option<AbilityKeys> {
    let exact = types.get(name);
    let found = exact.or_else(|| {
        let alike = types.iter().find(|(known, _)| known.eq_ignore_ascii_case(name));
        alike.map(|(_, section)| section)
    });
    found.map(TypeSection::abilities)
}

fn built_in_types() -> BTreeMap<String, TypeSection> {
    let file: TypesFile =
        Source::new("types.toml", BUILT_IN, "").parse().expect("a test reads the built-in types");
    file.types
}

/// Returns the types of the user's file; none without one.
fn own_types(
    source: &Source,
    file: &AirspaceFile,
) -> Result<BTreeMap<String, TypeSection>, InputError> {
    let Some(given) = &file.airspace.types_file else { return Ok(BTreeMap::new()) };
    let path = source.path(Path::new(given.get_ref()));
    let read = read_text(&path, MAX_TYPES_BYTES)
        .and_then(|text| Source::new(path.display().to_string(), text, "").parse::<TypesFile>());
    read.map(|file| file.types).map_err(|error| source.with_key_at(given.span(), error))
}

fn openap_type(
    source: &Source,
    file: &AirspaceFile,
    name: &str,
) -> Result<Option<OpenapType>, InputError> {
    let Some(given) = &file.airspace.openap_folder else { return Ok(None) };
    let folder = source.path(Path::new(given.get_ref()));
    openap::load(&folder, name).map_err(|error| source.with_key_at(given.span(), error))
}

fn unknown_type(
    source: &Source,
    file: &AirspaceFile,
    own: &BTreeMap<String, TypeSection>,
    name: &Spanned<String>,
) -> InputError {
    let built_in = built_in_types();
    let folder = file.airspace.openap_folder.as_ref();
    let in_folder = folder.map(|given| openap::names(&source.path(Path::new(given.get_ref()))));
    let in_folder = in_folder.unwrap_or_default();
    let names = own.keys().chain(built_in.keys()).chain(&in_folder);
    let known: Vec<&str> = names.map(String::as_str).collect();
    let cause = format!("no type {:?}", name.get_ref());
    let near = suggestion(name.get_ref(), &known);
    let more = "or name a table with it by airspace.types_file or airspace.openap_folder";
    source.error(name.span(), cause, format!("{near}; {more}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bundle::resolve_scenario;
    use crate::scenario::CompiledAirspace;
    use tempfile::TempDir;

    fn text(airspace: &str, airplane: &str) -> String {
        format!(
            "format = 1\nworld = \"airspace\"\n[airspace]\n{airspace}\n[[airplanes]]\nat_m = [0, 0]\n\
             heading_deg = 0\nway_points_m = [[9000, 0]]\n{airplane}\n"
        )
    }

    fn compiled(folder: &Path, airspace: &str, airplane: &str) -> Result<CompiledAirspace, String> {
        let source = Source::new("t.toml", text(airspace, airplane), folder);
        CompiledAirspace::new(&source).map_err(|error| error.to_string())
    }

    fn folder_with(files: &[(&str, &str)]) -> TempDir {
        let folder = TempDir::new().expect("a folder");
        for (path, text) in files {
            let path = folder.path().join(path);
            std::fs::create_dir_all(path.parent().expect("a folder")).expect("room");
            std::fs::write(path, text).expect("room");
        }
        folder
    }

    const OPENAP: [(&str, &str); 4] = [
        (
            "data/aircraft/a320.yml",
            "aircraft: Airbus A320\nvmo: 350\nmmo: 0.82\nceiling: 12500\ncruise:\n  height: 11000\n  mach: 0.78\n",
        ),
        ("data/aircraft/a20n.yml", "ceiling: 12100\n"),
        (
            "data/wrap/a320.txt",
            "variable flight phase name opt min max model parameters\n\
             ic_vs_avg initial_climb Mean vertical rate 12.59 9.15 16.04 norm 12.59|2.09\n\
             de_vs_avg_cas_const descent Mean descent rate, constant-CAS -10.03 -14.68 -5.35 norm -10.02|2.84\n\
             fa_va_avg final_approach Mean airspeed 72 67 77 norm 72.43|3.49\n",
        ),
        ("data/wrap/_synonym.csv", "orig,new\na20n,a320\n"),
    ];

    #[test]
    fn every_built_in_type_flies() {
        let types = built_in_types();
        assert_eq!(types.len(), 4);
        for name in types.keys() {
            let compiled = compiled(Path::new(""), "", &format!("type = {name:?}"));
            let airplane = &compiled.expect("right").world.airplanes[0];
            assert_eq!(airplane.performance.type_name.as_ref(), Some(name));
            assert!(airplane.performance.accelerates(), "{name}");
        }
    }

    #[test]
    fn an_unknown_type_is_an_error_with_the_names_that_are_near() {
        let error = compiled(Path::new(""), "", "type = \"quadrotr\"").expect_err("unknown");
        for words in ["no type \"quadrotr\"", "did you mean `quadrotor`?", "airspace.types_file"] {
            assert!(error.contains(words), "{error}");
        }
    }

    #[test]
    fn own_types_come_before_built_in_ones_and_own_keys_before_types() {
        let own = "[types.quadrotor]\nv_m_s = 9.0\n[types.X1]\nv_m_s = 20.0\nv_max_m_s = 21.0\n";
        let folder = folder_with(&[("types.toml", own)]);
        let speed = |airplane: &str| {
            let airspace = "types_file = \"types.toml\"";
            compiled(folder.path(), airspace, airplane).map(|c| c.world.airplanes[0].model.v_m_s)
        };
        assert_eq!(speed("type = \"quadrotor\""), Ok(9.0));
        assert_eq!(speed("type = \"x1\""), Ok(20.0));
        assert_eq!(speed("type = \"X1\"\nv_m_s = 21.0"), Ok(21.0));
        assert!(speed("type = \"X1\"\nv_m_s = 22.0").is_err());
        assert_eq!(speed("type = \"airliner\""), Ok(231.0));
    }

    #[test]
    fn a_mistake_in_a_file_of_types_is_told_at_its_key_with_its_place() {
        let folder = folder_with(&[("types.toml", "[types.X1]\nspeed = 3.0\n")]);
        let error = compiled(folder.path(), "types_file = \"types.toml\"", "").expect_err("wrong");
        assert!(error.contains("types.toml:2") && error.contains("speed"), "{error}");
        let error = compiled(folder.path(), "types_file = \"no.toml\"", "").expect_err("none");
        assert!(error.contains("no.toml"), "{error}");
    }

    #[test]
    fn types_of_openap_are_read_from_its_folder_and_what_they_leave_out_is_known() {
        let folder = folder_with(&OPENAP);
        let airspace = "openap_folder = \"data\"";
        let compiled = compiled(folder.path(), airspace, "type = \"A320\"\naltitude_m = 11000.0");
        let compiled = compiled.expect("right");
        let airplane = &compiled.world.airplanes[0];
        let performance = &airplane.performance;
        assert!((airplane.model.v_m_s - 230.2).abs() < 0.1, "{}", airplane.model.v_m_s);
        assert!((performance.v_max_m_s - 242.0).abs() < 0.1, "{}", performance.v_max_m_s);
        assert_eq!([performance.v_min_m_s, performance.ceiling_m], [67.0, 12500.0]);
        assert_eq!([performance.climb_max_m_s, performance.descent_max_m_s], [16.04, 14.68]);
        let remarks = crate::scenario::scenario_remarks(&compiled);
        let words: Vec<&str> = remarks.iter().map(|remark| remark.words.as_str()).collect();
        assert!(
            words.iter().any(|w| w.contains("A320") && w.contains("bank_max_deg")),
            "{words:?}"
        );
    }

    #[test]
    fn a_type_of_openap_without_kinematics_has_those_of_its_synonym() {
        let folder = folder_with(&OPENAP);
        let neo =
            compiled(folder.path(), "openap_folder = \"data\"", "type = \"A20N\"\nv_m_s = 90.0");
        let performance = neo.expect("right").world.airplanes[0].performance.clone();
        assert_eq!((performance.climb_max_m_s, performance.v_max_m_s), (16.04, f64::INFINITY));
        let error = compiled(folder.path(), "openap_folder = \"data\"", "type = \"A32\"")
            .expect_err("none");
        assert!(error.contains("did you mean `A320`?"), "{error}");
        let error =
            compiled(folder.path(), "openap_folder = \".\"", "type = \"A320\"").expect_err("wrong");
        assert!(error.contains("no folder `aircraft`"), "{error}");
    }

    #[test]
    fn a_resolved_scenario_has_the_types_that_it_was_read_with() {
        let folder = folder_with(&OPENAP);
        let own = text("openap_folder = \"data\"", "type = \"A320\"");
        let source = Source::new("t.toml", own, folder.path());
        let compiled = CompiledAirspace::new(&source).expect("right");
        let resolved = resolve_scenario(&source, &compiled).expect("right");
        let elsewhere = TempDir::new().expect("a folder");
        for (path, bytes) in &resolved.files {
            let path = elsewhere.path().join(path);
            std::fs::create_dir_all(path.parent().expect("a folder")).expect("room");
            std::fs::write(path, bytes).expect("room");
        }
        let again = Source::new("t.toml", resolved.text, elsewhere.path());
        let again = CompiledAirspace::new(&again).expect("needs no OpenAP");
        assert_eq!(again.world.airplanes, compiled.world.airplanes);
    }
}
