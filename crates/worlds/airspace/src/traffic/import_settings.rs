//! The settings of a BlueSky file that hold for all its aircraft: those that are flown, and those
//! that cannot be.

use super::KNOT_M_S;
use super::bluesky::aircraft_at_flying_speed;
use sidestep_import::bluesky::{ResolutionMethod, ScnAircraft, ScnFile, Traffic, Wind};
use sidestep_kernel::{InputError, math};

/// Settings of a scenario; `None` leaves the scenario's own.
#[derive(Debug, Default, PartialEq)]
pub(crate) struct ImportedScenarioSettings {
    pub(super) method: Option<&'static str>,
    /// Whether conflicts are left as they are, by the shield too.
    pub(super) is_bare: bool,
    /// The look-ahead that the file asks for, or that its method has in BlueSky; `None` where it says
    /// nothing about either.
    pub(super) look_ahead_s: Option<f64>,
    pub(super) wind_m_s: Option<[f64; 2]>,
    /// Commands that cannot be flown.
    pub(crate) refused: Vec<InputError>,
}

/// Returns the rules of a file, which is `place` in errors; a decision is made every `dt_s`.
pub(super) fn import_settings(place: &str, file: &ScnFile, dt_s: f64) -> ImportedScenarioSettings {
    let mut rules = ImportedScenarioSettings::default();
    let mut refuse = |command: &str, cause: String, remedy: &str| {
        let error = InputError::new(place, format!("{command}: {cause}"), remedy);
        let line = file.last_lines.get(command).copied().unwrap_or(1);
        rules.refused.push(error.with_position(line, 1));
    };
    let traffic = &file.traffic;
    if let Some(ResolutionMethod::Ssd | ResolutionMethod::Eby) = traffic.resolution {
        let cause = "this method is not known here; the scenario's own flies".to_string();
        refuse("RESO", cause, "write RESO OFF or MVP, or choose with --set airspace.method=...");
    }
    if traffic.noise {
        let cause = "its amounts are unknown; positions are exact".to_string();
        refuse("NOISE", cause, "choose with --set airspace.position_noise_m=...");
    }
    let wind_m_s = wind_m_s(traffic).unwrap_or_else(|cause| {
        refuse("WIND", cause, "give one wind below the speed of all aircraft");
        None
    });
    let mut look_ahead_s = file.commands.contains_key("DTLOOK").then_some(traffic.lookahead_s);
    if let Some(s) = look_ahead_s
        && !(dt_s..=MAX_LOOK_AHEAD_S).contains(&s)
    {
        let cause = format!("a look-ahead of {s} s");
        refuse("DTLOOK", cause, &format!("give {dt_s} to {MAX_LOOK_AHEAD_S} s"));
        look_ahead_s = None;
    }
    let (method, is_bare) = resolution_method(traffic);
    if look_ahead_s.is_none() && method == Some("mvp") {
        look_ahead_s = Some(Traffic::default().lookahead_s);
    }
    ImportedScenarioSettings { method, is_bare, look_ahead_s, wind_m_s, ..rules }
}

/// Longest look-ahead of a scenario in seconds.
const MAX_LOOK_AHEAD_S: f64 = 36_000.0;

/// Returns the method that the file asks for, and whether nothing is to keep aircraft apart.
/// Without detection nothing is resolved.
fn resolution_method(traffic: &Traffic) -> (Option<&'static str>, bool) {
    match (traffic.detection, traffic.resolution) {
        (Some(false), _) | (_, Some(ResolutionMethod::Off)) => (Some("none"), true),
        (_, Some(ResolutionMethod::Mvp)) => (Some("mvp"), false),
        (_, Some(ResolutionMethod::Ssd | ResolutionMethod::Eby) | None) => (None, false),
    }
}

/// Returns the one wind of a file, if it has any.
///
/// # Errors
/// The cause, when winds differ from place to place, or no aircraft could fly against it.
fn wind_m_s(traffic: &Traffic) -> Result<Option<[f64; 2]>, String> {
    let Some(first) = traffic.wind.first() else { return Ok(None) };
    let is_uniform = traffic
        .wind
        .iter()
        .all(|other: &Wind| other.from_deg == first.from_deg && other.speed_kt == first.speed_kt);
    if !is_uniform {
        return Err(format!("{} winds that differ; none blows", traffic.wind.len()));
    }
    let from_rad = first.from_deg.to_radians();
    let speed_m_s = first.speed_kt * KNOT_M_S;
    if let Some(slow) = traffic.aircraft.iter().find(|one| min_speed_m_s(one) <= speed_m_s) {
        return Err(format!("{speed_m_s:.1} m/s, and {} is slower; it does not blow", slow.id));
    }
    // It blows from there, clockwise from north.
    Ok(Some([-speed_m_s * math::sin(from_rad), -speed_m_s * math::cos(from_rad)]))
}

/// Returns the smallest speed of an aircraft once it moves.
fn min_speed_m_s(aircraft: &ScnAircraft) -> f64 {
    aircraft_at_flying_speed(aircraft).map_or(f64::INFINITY, |one| one.min_speed_m_s())
}

#[cfg(test)]
mod tests {
    use super::*;
    use sidestep_import::bluesky::parse;

    fn found(commands: &str) -> (ImportedScenarioSettings, Vec<String>) {
        let text: String = std::iter::once("CRE A1,B744,0,-0.4,90,FL200,250")
            .chain(commands.lines())
            .map(|line| format!("00:00:00.00>{line}\n"))
            .collect();
        let rules = import_settings("a.scn", &parse(&"a.scn", &text), 10.0);
        let refused = rules.refused.iter().map(ToString::to_string).collect();
        (rules, refused)
    }

    #[test]
    fn what_a_file_says_about_conflicts_and_wind_is_flown() {
        for (commands, method, is_bare) in [
            ("", None, false),
            ("ASAS ON", None, false),
            ("ASAS OFF\nRESO MVP", Some("none"), true),
            ("ASAS ON\nRESO OFF", Some("none"), true),
            ("CDMETHOD STATEBASED\nRESO MVP", Some("mvp"), false),
        ] {
            let (rules, refused) = found(commands);
            assert_eq!((rules.method, rules.is_bare), (method, is_bare), "{commands}");
            assert_eq!(refused, [""; 0], "{commands}");
        }
        let (rules, _) = found("DTLOOK 120\nWIND 0,1,,270,36");
        assert_eq!(rules.look_ahead_s, Some(120.0));
        let [east, north] = rules.wind_m_s.expect("a wind");
        assert!((east - 18.52).abs() < 1e-9 && north.abs() < 1e-9, "{east} {north}");
    }

    #[test]
    fn what_cannot_be_flown_is_refused_by_name_and_line() {
        for (commands, name, line) in [
            ("RESO SSD", "RESO", 2),
            ("ZONER 3\nRESO EBY", "RESO", 3),
            ("NOISE ON", "NOISE", 2),
            ("DTLOOK 1", "DTLOOK", 2),
            ("WIND 0,1,,270,36\nWIND 0,2,,90,36", "WIND", 3),
            ("WIND 0,1,,270,600", "WIND", 2),
        ] {
            let (rules, refused) = found(commands);
            let [one] = &refused[..] else { panic!("{commands}: {refused:?}") };
            assert!(one.contains(&format!("{name}: ")), "{one}");
            assert_eq!(rules.refused[0].line_and_column(), Some((line, 1)), "{commands}");
            assert_eq!((rules.look_ahead_s, rules.wind_m_s), (None, None), "{commands}");
        }
    }
}
