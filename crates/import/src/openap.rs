//! Types of airplanes from an installed OpenAP (TU Delft, <https://openap.dev>; its data are under the GPL, so we do not
//! ship them).
//!
//! Of its folder `openap/data`, the files `aircraft/NAME.yml` give speeds and ceiling, and those of its kinematic model
//! WRAP, `wrap/NAME.txt`, vertical speeds and approaches, from recorded flights (Sun, Ellerbroek and Hoekstra, "WRAP: An
//! open-source kinematic aircraft performance model", 2019). Types without a file of their own in `wrap` fly as the one
//! that `wrap/_synonym.csv` names.

use super::bluesky::Airspeed;
use saphyr::{LoadableYamlNode, Yaml};
use sidestep_kernel::InputError;
use sidestep_scenario::file::read_text;
use std::path::{Path, PathBuf};

/// Largest size of a file in bytes; the largest of OpenAP has 4 KiB.
const MAX_BYTES: u64 = 64 << 10;
/// Longest name of a type; ICAO's designators have four characters.
const MAX_NAME_BYTES: usize = 8;
/// Longest line of a file in `aircraft`, in bytes; OpenAP's have up to 100.
const MAX_LINE_BYTES: usize = 400;
const FOOT_M: f64 = 0.3048;

/// One type of OpenAP. What its files leave out is `None`.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct OpenapType {
    /// True airspeed of the cruise, in meters per second.
    pub cruise_m_s: Option<f64>,
    /// Smallest speed of recorded final approaches, in meters per second.
    pub v_min_m_s: Option<f64>,
    /// True airspeed at the largest calibrated airspeed or Mach number, at the altitude of the cruise, in meters per
    /// second.
    pub v_max_m_s: Option<f64>,
    /// Largest mean rate of climb of recorded climbs, in meters per second.
    pub climb_max_m_s: Option<f64>,
    /// Largest mean rate of descent of recorded descents, positive, in meters per second.
    pub descent_max_m_s: Option<f64>,
    /// Highest altitude in meters.
    pub ceiling_m: Option<f64>,
}

/// Returns a type of OpenAP by its ICAO designator, in letters of either case; `None` if `folder`, its `openap/data`, has
/// no such type.
///
/// # Errors
/// When the folder is not that of OpenAP, or a file of the type cannot be read.
pub fn load(folder: &Path, name: &str) -> Result<Option<OpenapType>, InputError> {
    let aircraft = folder.join("aircraft");
    if !aircraft.is_dir() {
        let place = folder.display().to_string();
        let cause = "it has no folder `aircraft`";
        let remedy = "give the folder openap/data of an installed OpenAP, e.g. that which \
                      `python -c \"import openap; print(openap.__path__[0] + '/data')\"` prints";
        return Err(InputError::new(place, cause, remedy));
    }
    // A name leads to no other folder.
    let is_name = name.len() <= MAX_NAME_BYTES && name.chars().all(|c| c.is_ascii_alphanumeric());
    let name = name.to_ascii_lowercase();
    let path = aircraft.join(format!("{name}.yml"));
    if !is_name || !path.is_file() {
        return Ok(None);
    }
    let aircraft = read_text(&path, MAX_BYTES)?;
    let kinematics = match wrap_file(folder, &name)? {
        Some(path) => read_text(&path, MAX_BYTES)?,
        None => String::new(),
    };
    parse(&path.display().to_string(), &aircraft, &kinematics).map(Some)
}

/// Returns a type from the text of its file in `aircraft`, which is `place` in errors, and of its file in `wrap`.
///
/// # Errors
/// When the first is not as OpenAP has it.
pub fn parse(place: &str, aircraft: &str, kinematics: &str) -> Result<OpenapType, InputError> {
    let mut found = parse_aircraft(place, aircraft)?;
    add_kinematics(&mut found, kinematics);
    Ok(found)
}

/// Returns the names of the types that a folder has, in upper case; none if it cannot be read.
pub fn names(folder: &Path) -> Vec<String> {
    let Ok(entries) = std::fs::read_dir(folder.join("aircraft")) else { return Vec::new() };
    let files = entries.filter_map(|entry| Some(entry.ok()?.path()));
    let types = files.filter(|path| path.extension().is_some_and(|end| end == "yml"));
    let mut names: Vec<String> =
        types.filter_map(|path| Some(path.file_stem()?.to_str()?.to_ascii_uppercase())).collect();
    names.sort_unstable();
    names
}

/// Returns the file of the kinematic model of a type, which may be that of another type; `None` where there is none.
fn wrap_file(folder: &Path, name: &str) -> Result<Option<PathBuf>, InputError> {
    let wrap = folder.join("wrap");
    let own = wrap.join(format!("{name}.txt"));
    if own.is_file() {
        return Ok(Some(own));
    }
    let synonyms = wrap.join("_synonym.csv");
    if !synonyms.is_file() {
        return Ok(None);
    }
    let text = read_text(&synonyms, MAX_BYTES)?;
    // Lines of two names: the type, and the one whose model it has.
    let other = text.lines().find_map(|line| {
        let (one, other) = line.split_once(',')?;
        (one.trim() == name).then(|| other.trim().to_string())
    });
    let path = other.map(|other| wrap.join(format!("{other}.txt")));
    Ok(path.filter(|path| path.is_file()))
}

/// Reads the file of a type in `aircraft`.
fn parse_aircraft(place: &str, text: &str) -> Result<OpenapType, InputError> {
    let error = |cause: String| {
        let remedy = "give a file of OpenAP's folder aircraft as it is installed";
        InputError::new(place, cause, remedy)
    };
    // The parser calls itself for a list within a list: without brackets, the length of a line bounds their depth.
    let is_deep = |line: &str| line.len() > MAX_LINE_BYTES || line.contains(['[', '{']);
    if text.lines().any(is_deep) {
        return Err(error("it has long lines or brackets, which no file of OpenAP has".into()));
    }
    let documents = Yaml::load_from_str(text).map_err(|e| error(format!("it is no YAML: {e}")))?;
    let document = documents.first().ok_or_else(|| error("it is empty".into()))?;
    let number = |keys: &[&str]| {
        let node = keys.iter().try_fold(document, |node, key| node.as_mapping_get(key))?;
        let value = node.as_floating_point().or_else(|| Some(node.as_integer()? as f64));
        value.filter(|value| value.is_finite() && *value > 0.0)
    };
    let Some(ceiling_m) = number(&["ceiling"]) else {
        return Err(error("it has no `ceiling` in meters".into()));
    };
    let cruise_ft = number(&["cruise", "height"]).map(|height_m| height_m / FOOT_M);
    let true_m_s =
        |speed: Airspeed| cruise_ft.map(|altitude_ft| speed.true_airspeed_mps(altitude_ft));
    let by_mach = number(&["mmo"]).and_then(|mach| true_m_s(Airspeed::Mach(mach)));
    let by_cas = number(&["vmo"]).and_then(|cas_kt| true_m_s(Airspeed::CasKt(cas_kt)));
    Ok(OpenapType {
        cruise_m_s: number(&["cruise", "mach"]).and_then(|mach| true_m_s(Airspeed::Mach(mach))),
        v_max_m_s: [by_mach, by_cas].into_iter().flatten().reduce(f64::min),
        ceiling_m: Some(ceiling_m),
        ..OpenapType::default()
    })
}

/// Adds what a file of the kinematic model tells: columns are the variable, the phase, a name of several words, and then
/// the usual, the smallest and the largest value.
fn add_kinematics(found: &mut OpenapType, text: &str) {
    for line in text.lines() {
        let mut words = line.split_whitespace();
        let Some(variable) = words.next() else { continue };
        let numbers: Vec<f64> =
            words.filter_map(|word| word.parse().ok()).filter(|x: &f64| x.is_finite()).collect();
        let [_, min, max, ..] = numbers[..] else { continue };
        if variable == "ic_vs_avg" || variable.starts_with("cl_vs_avg") {
            found.climb_max_m_s = larger(found.climb_max_m_s, max);
        } else if variable.starts_with("de_vs_avg") {
            found.descent_max_m_s = larger(found.descent_max_m_s, -min);
        } else if variable == "fa_va_avg" && min > 0.0 {
            found.v_min_m_s = Some(min);
        }
    }
}

/// Returns the larger of a positive rate and those before it.
fn larger(before: Option<f64>, rate_m_s: f64) -> Option<f64> {
    let most_m_s = before.unwrap_or(0.0).max(rate_m_s);
    (most_m_s > 0.0).then_some(most_m_s)
}

#[cfg(test)]
mod tests {
    use super::*;

    const AIRCRAFT: &str = "vmo: 350\nmmo: 0.82\nceiling: 12500\ncruise:\n  height: 11000\n  mach: 0.78\nwing:\n  t/c: null\n";

    #[test]
    fn a_type_has_the_limits_of_its_files() {
        let kinematics = "variable flight phase name opt min max model parameters\n\
            ic_vs_avg initial_climb Mean vertical rate 12.59 9.15 16.04 norm 12.59|2.09\n\
            cl_vs_avg_mach_const climb Mean climb rate, constant-Mach 5.28 3.6 6.97 norm 5.29|1.03\n\
            de_vs_avg_cas_const descent Mean descent rate, constant-CAS -10.03 -14.68 -5.35 norm -10.02|2.84\n\
            fa_va_avg final_approach Mean airspeed 72 67 77 norm 72.43|3.49\n";
        let found = parse("a320.yml", AIRCRAFT, kinematics).expect("right");
        assert_eq!([found.climb_max_m_s, found.descent_max_m_s], [Some(16.04), Some(14.68)]);
        assert_eq!([found.v_min_m_s, found.ceiling_m], [Some(67.0), Some(12500.0)]);
        let cruise_ft = 11_000.0 / FOOT_M;
        let cruise_m_s = Airspeed::Mach(0.78).true_airspeed_mps(cruise_ft);
        let by_mach_m_s = Airspeed::Mach(0.82).true_airspeed_mps(cruise_ft);
        assert_eq!([found.cruise_m_s, found.v_max_m_s], [Some(cruise_m_s), Some(by_mach_m_s)]);
        assert!(Airspeed::CasKt(350.0).true_airspeed_mps(cruise_ft) > by_mach_m_s);
    }

    #[test]
    fn what_the_files_leave_out_is_none() {
        let found = parse("x.yml", "ceiling: 9000\n", "fa_va_avg x 1\nnonsense\n").expect("right");
        assert_eq!(found, OpenapType { ceiling_m: Some(9000.0), ..OpenapType::default() });
    }

    #[test]
    fn a_file_of_another_kind_is_an_error_with_a_remedy() {
        let nested = "[\n".repeat(30_000);
        for (text, cause) in [
            ("", "it is empty"),
            ("ceiling: low\n", "no `ceiling`"),
            ("ceiling: -3\n", "no `ceiling`"),
            ("a: b: c\n", "no YAML"),
            (nested.as_str(), "brackets"),
        ] {
            let error = parse("x.yml", text, "").expect_err(cause).to_string();
            assert!(error.contains(cause) && error.contains("as it is installed"), "{error}");
        }
    }
}
