//! The settings of a BlueSky file, with their times: those that are flown, and those that cannot be.

use super::flyable_aircraft::aircraft_at_flying_speed;
use super::{FOOT_M, KNOT_M_S, MVP_LOOK_AHEAD_S, NAUTICAL_MILE_M};
use crate::settings::{Resolution, RightOfWayRule};
use sidestep_import::bluesky::{
    AircraftSetting, HorizontalResolution, PriorityRule, ResolutionMethod, ScnAircraft, ScnFile,
    Setting, TimedSetting, Wind,
};
use sidestep_kernel::geometry::{lerp, norm};
use sidestep_kernel::{InputError, math};
use std::fmt::Write;

/// The rules of a scenario; `None` leaves the scenario's own.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct ImportedRules {
    pub(super) method: Option<&'static str>,
    /// Whether conflicts are left as they are, by the shield too.
    pub(super) is_bare: bool,
    /// The look-ahead that the file asks for, or that its method has in BlueSky; `None` where it says
    /// nothing about either.
    pub(super) look_ahead_s: Option<f64>,
    pub(super) resolution_factor: Option<f64>,
    /// What MVP changes; `None` where the file says nothing about that.
    pub(super) resolution: Option<Resolution>,
    pub(super) vertical_factor: Option<f64>,
    /// Who gives way; `None` where the file says nothing about that.
    pub(super) right_of_way: Option<RightOfWayRule>,
    pub(super) wind: Option<ImportedWind>,
    pub(super) separation_m: f64,
    pub(super) vertical_m: f64,
}

/// A wind at some altitudes, one and the same in all places.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct ImportedWind {
    /// By rising altitude in meters, each to the east and to the north in meters per second; a single one at all altitudes,
    /// and none in still air.
    layers: Vec<(f64, [f64; 2])>,
}

/// A change of rules on the way, as a scenario writes it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ImportedChange {
    pub(super) at_s: f64,
    /// The keys that change, with their values.
    pub(super) text: String,
}

/// The settings of a scenario.
#[derive(Debug, Default, PartialEq)]
pub(crate) struct ImportedScenarioSettings {
    /// The rules at the start.
    pub(super) start: ImportedRules,
    /// Changes on the way, by rising time.
    pub(super) changes: Vec<ImportedChange>,
    /// The winds that blow, each from its time on.
    pub(super) winds: Vec<(f64, ImportedWind)>,
    /// Commands that cannot be flown.
    pub(crate) refused: Vec<InputError>,
    /// Choices that are not in the file.
    pub(crate) guesses: Vec<String>,
}

/// Largest number of changes on the way: each is a world of its own.
const MAX_CHANGES: usize = 1000;
/// Shortest and longest look-ahead of a scenario in seconds.
const MIN_LOOK_AHEAD_S: f64 = 1.0;
const MAX_LOOK_AHEAD_S: f64 = 36_000.0;
/// The factor on the zone out of which BlueSky's MVP moves a conflict, unless `RFACH` gives another one. Conflicts are
/// found with the zone itself.
///
/// In BlueSky's nycGrid.scn (zone of 0.027 NM and 25 ft, DTLOOK 30) these factors lead to 149 losses of separation here, and
/// the margin of 5 % of own scenarios to 47; BlueSky 1.1.1 has 205 with its own MVP, which changes speeds as well.
const DEFAULT_RESOLUTION_FACTOR: f64 = 1.01;

/// The settings that hold at one time, as BlueSky keeps them.
#[derive(Debug, Clone)]
struct SettingsInForce {
    detection: Option<bool>,
    resolution: Option<ResolutionMethod>,
    look_ahead_s: Option<f64>,
    resolution_factor: Option<f64>,
    limits: Option<ResolutionLimits>,
    vertical_factor: Option<f64>,
    priority_rule: Option<PriorityRule>,
    radius_nm: f64,
    half_height_ft: f64,
    winds: Vec<Wind>,
}

impl Default for SettingsInForce {
    fn default() -> Self {
        Self {
            detection: None,
            resolution: None,
            look_ahead_s: None,
            resolution_factor: None,
            limits: None,
            vertical_factor: None,
            priority_rule: None,
            radius_nm: 5.0,
            half_height_ft: 1000.0,
            winds: Vec::new(),
        }
    }
}

/// What MVP may change, as BlueSky keeps it: each command of one direction may undo one of the other.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct ResolutionLimits {
    heading: bool,
    speed: bool,
    vertical: bool,
}

impl ResolutionLimits {
    /// BlueSky's own: in the horizontal.
    const AT_START: Self = Self { heading: true, speed: true, vertical: false };

    fn with_horizontal(self, resolution: HorizontalResolution) -> Self {
        match resolution {
            HorizontalResolution::Both => Self::AT_START,
            HorizontalResolution::Speed => Self { heading: false, ..Self::AT_START },
            HorizontalResolution::Heading => Self { speed: false, ..Self::AT_START },
            HorizontalResolution::Off => Self { heading: false, speed: false, ..self },
        }
    }

    fn with_vertical(self, is_on: bool) -> Self {
        if is_on {
            Self { heading: false, speed: false, vertical: true }
        } else {
            Self { vertical: false, ..self }
        }
    }

    fn resolution(self) -> Resolution {
        if self.heading && self.speed {
            Resolution::HeadingSpeed
        } else if self.heading {
            Resolution::Heading
        } else if self.speed {
            Resolution::Speed
        } else if self.vertical {
            Resolution::Vertical
        } else {
            // Without any limit BlueSky changes everything.
            Resolution::HeadingSpeedVertical
        }
    }
}

/// Reads the settings of a file in the order of their times.
struct SettingsReader<'a> {
    file: &'a ScnFile,
    now: SettingsInForce,
    refused: Vec<InputError>,
}

/// Returns the settings of a file.
pub(super) fn import_settings(file: &ScnFile) -> ImportedScenarioSettings {
    let settings = &file.traffic.settings;
    // What holds before anything flies holds from the start.
    let created = file.traffic.aircraft.iter().map(|one| one.created_s);
    let first_s = created.fold(f64::INFINITY, f64::min);
    let first_s = if first_s.is_finite() { first_s } else { 0.0 };
    let later = settings.partition_point(|timed| timed.at_s <= first_s);
    let mut reader = SettingsReader { file, now: SettingsInForce::default(), refused: Vec::new() };
    settings[..later].iter().for_each(|timed| reader.read(timed));
    let mut states = vec![(0.0, reader.rules(None))];
    for (k, timed) in settings.iter().enumerate().skip(later) {
        reader.read(timed);
        let is_last_of_its_time = settings.get(k + 1).is_none_or(|next| next.at_s > timed.at_s);
        if is_last_of_its_time {
            states.push((timed.at_s, reader.rules(Some(timed))));
        }
    }
    let guesses = fill_silent_start(&mut states);
    let mut imported = ImportedScenarioSettings {
        start: states[0].1.clone(),
        changes: changes_between(&states),
        winds: winds_of(&states),
        refused: reader.refused,
        guesses,
    };
    imported.changes.extend(changes_of_aircraft(file));
    imported.changes.sort_by(|a, b| a.at_s.total_cmp(&b.at_s));
    if imported.changes.len() > MAX_CHANGES {
        let left_out = imported.changes.split_off(MAX_CHANGES);
        let cause = format!("{} changes of settings on the way", MAX_CHANGES + left_out.len());
        let remedy = format!("write up to {MAX_CHANGES}; the first ones hold");
        let place = settings.last().map_or("the file", |last| last.file.as_str());
        imported.refused.push(InputError::new(place, cause, remedy));
    }
    imported
}

/// Decides what flies before a file first says something about conflicts, and whether the shield flies. Returns the
/// choices.
fn fill_silent_start(states: &mut [(f64, ImportedRules)]) -> Vec<String> {
    let mut guesses = Vec::new();
    let first_on = states.iter().position(|(_, rules)| rules.method == Some("mvp"));
    if let Some(first_on) = first_on.filter(|k| *k > 0) {
        // In BlueSky nothing is detected and resolved until it is switched on.
        for (_, rules) in states[..first_on].iter_mut().filter(|(_, rules)| rules.method.is_none())
        {
            rules.method = Some("none");
            rules.is_bare = true;
        }
    }
    let is_switched_on = states.windows(2).any(|pair| pair[0].1.is_bare && !pair[1].1.is_bare);
    if is_switched_on {
        states.iter_mut().for_each(|(_, rules)| rules.is_bare = true);
        guesses.push(
            "conflicts are resolved from a time on: without the shield, which keeps separation from the start".into(),
        );
    }
    if states.iter().any(|(_, rules)| rules.wind.is_some() && !rules.is_bare) {
        states.iter_mut().for_each(|(_, rules)| rules.is_bare = true);
        guesses.push(
            "a wind blows: without the shield, whose stored orbits a wind would drive apart or together on the earth"
                .into(),
        );
    }
    let is_silent = states[0].1.method.is_none();
    if is_silent && states.iter().any(|(_, rules)| rules.method.is_some()) {
        guesses.push(
            "until its first command about conflicts the scenario's own method flies; in BlueSky nobody resolves any".into(),
        );
    }
    guesses
}

/// Returns the winds of all states; none where none blows at any time.
fn winds_of(states: &[(f64, ImportedRules)]) -> Vec<(f64, ImportedWind)> {
    if states.iter().all(|(_, rules)| rules.wind.is_none()) {
        return Vec::new();
    }
    states.iter().map(|(at_s, rules)| (*at_s, rules.wind.clone().unwrap_or_default())).collect()
}

/// Returns the changes from each state to the next.
fn changes_between(states: &[(f64, ImportedRules)]) -> Vec<ImportedChange> {
    let mut changes = Vec::new();
    for pair in states.windows(2) {
        let [(_, before), (at_s, after)] = pair else { continue };
        let text = change_text(before, after);
        if !text.is_empty() {
            changes.push(ImportedChange { at_s: *at_s, text });
        }
    }
    changes
}

/// Returns the keys of a change; empty where nothing changes.
fn change_text(before: &ImportedRules, after: &ImportedRules) -> String {
    let mut text = String::new();
    // Writing to a string cannot fail.
    if after.method != before.method
        && let Some(method) = after.method
    {
        let _ = write!(text, ", method = {method:?}");
    }
    if after.is_bare && !before.is_bare {
        text.push_str(", shield = \"off\"");
    }
    let old_mvp = before.mvp_text();
    let new_mvp = after.mvp_text();
    if new_mvp != old_mvp && !new_mvp.is_empty() {
        let _ = write!(text, ", mvp = {{ {new_mvp} }}");
    }
    if after.right_of_way != before.right_of_way {
        let rule = after.right_of_way.unwrap_or_default();
        let _ = write!(text, ", right_of_way = {:?}", rule.name());
    }
    if after.separation_m != before.separation_m {
        let _ = write!(text, ", separation_m = {:?}", after.separation_m);
    }
    if after.vertical_m != before.vertical_m {
        let _ = write!(text, ", vertical_m = {:?}", after.vertical_m);
    }
    if after.wind != before.wind {
        let _ = write!(text, ", {}", after.wind.clone().unwrap_or_default().key_text());
    }
    text
}

/// Returns the changes of single aircraft on their way; `aircraft` are those that fly, in the order of the scenario.
fn changes_of_aircraft(file: &ScnFile) -> Vec<ImportedChange> {
    let flying = file.traffic.aircraft.iter().filter_map(aircraft_at_flying_speed);
    let mut changes = Vec::new();
    for (id, one) in flying.enumerate() {
        let aircraft = one.scn();
        for &(at_s, setting) in &aircraft.settings {
            if at_s <= aircraft.created_s {
                continue;
            }
            let key = match setting {
                AircraftSetting::ZoneRadiusNm(nm) => {
                    format!("separation_m = {:?}", nm * NAUTICAL_MILE_M)
                }
                AircraftSetting::Avoids(avoids) => format!("non_cooperative = {}", !avoids),
            };
            changes.push(ImportedChange { at_s, text: format!(", airplanes = [{id}], {key}") });
        }
    }
    changes
}

impl ImportedWind {
    /// Returns its key with its value, as a scenario writes it.
    pub(super) fn key_text(&self) -> String {
        match &self.layers[..] {
            [] => "wind_m_s = [0.0, 0.0]".to_string(),
            [(_, wind_m_s)] => format!("wind_m_s = {wind_m_s:?}"),
            layers => {
                let layer = |(altitude_m, wind_m_s): &(f64, [f64; 2])| {
                    format!("{{ altitude_m = {altitude_m:?}, wind_m_s = {wind_m_s:?} }}")
                };
                let layers: Vec<String> = layers.iter().map(layer).collect();
                format!("winds = [{}]", layers.join(", "))
            }
        }
    }

    /// Returns the wind at an altitude, in meters per second.
    pub(super) fn at_altitude_m_s(&self, altitude_m: f64) -> [f64; 2] {
        let above = self.layers.partition_point(|(layer_m, _)| *layer_m <= altitude_m);
        match (above.checked_sub(1).map(|below| self.layers[below]), self.layers.get(above)) {
            (Some((low_m, low)), Some(&(high_m, high))) => {
                lerp(low, high, (altitude_m - low_m) / (high_m - low_m))
            }
            // Beyond the layers it is as in the last one.
            (Some((_, wind_m_s)), None) | (None, Some(&(_, wind_m_s))) => wind_m_s,
            (None, None) => [0.0; 2],
        }
    }
}

impl ImportedRules {
    /// Returns the settings of MVP, as a scenario writes them: where the file asks for it, those of BlueSky; else empty for
    /// the scenario's own.
    pub(super) fn mvp_text(&self) -> String {
        let is_chosen = self.method == Some("mvp");
        let look_ahead = self.look_ahead_s.map(|s| format!("look_ahead_s = {s:?}"));
        let margin = is_chosen.then(|| "margin = 1.0".to_string());
        let default = is_chosen.then_some(DEFAULT_RESOLUTION_FACTOR);
        let factor = self.resolution_factor.or(default);
        let factor = factor.map(|factor| format!("resolution_factor = {factor:?}"));
        let resolution = self.resolution.filter(|_| is_chosen);
        let words = resolution.map(|resolution| format!("resolution = \"{}\"", resolution.name()));
        let changes_level = resolution.is_some_and(Resolution::changes_level);
        let vertical_factor = self.vertical_factor.unwrap_or(DEFAULT_RESOLUTION_FACTOR);
        let vertical = changes_level.then(|| format!("vertical_factor = {vertical_factor:?}"));
        let changes_horizontal = resolution != Some(Resolution::Vertical);
        let factor = factor.filter(|_| changes_horizontal);
        let keys = [look_ahead, margin, factor, words, vertical];
        keys.into_iter().flatten().collect::<Vec<String>>().join(", ")
    }
}

impl SettingsReader<'_> {
    fn refuse(&mut self, timed: &TimedSetting, cause: String, remedy: &str) {
        let error = InputError::new(&timed.file, format!("{}: {cause}", timed.command), remedy);
        self.refused.push(error.with_position(timed.line, 1));
    }

    /// Takes a setting that holds from now on.
    fn read(&mut self, timed: &TimedSetting) {
        match timed.setting {
            Setting::ZoneRadiusNm(nm) => self.now.radius_nm = nm,
            Setting::ZoneHalfHeightFt(ft) => self.now.half_height_ft = ft,
            Setting::Detection(is_on) => self.now.detection = Some(is_on),
            Setting::Resolution(ResolutionMethod::Ssd | ResolutionMethod::Eby) => {
                let cause = "this method is not known here; what flew before flies on";
                let remedy = "write RESO OFF or MVP, or choose with --set airspace.method=...";
                self.refuse(timed, cause.into(), remedy);
            }
            Setting::Resolution(method) => self.now.resolution = Some(method),
            Setting::ResolutionFactor(factor) if (0.5..=10.0).contains(&factor) => {
                self.now.resolution_factor = Some(factor);
            }
            Setting::ResolutionFactor(factor) => {
                self.refuse(timed, format!("a factor of {factor}"), "give 0.5 to 10");
            }
            Setting::HorizontalResolution(resolution) => {
                let limits = self.now.limits.unwrap_or(ResolutionLimits::AT_START);
                self.now.limits = Some(limits.with_horizontal(resolution));
            }
            // Off without anything before it is how BlueSky begins.
            Setting::VerticalResolution(false) if self.now.limits.is_none() => {}
            Setting::VerticalResolution(is_on) => {
                let limits = self.now.limits.unwrap_or(ResolutionLimits::AT_START);
                self.now.limits = Some(limits.with_vertical(is_on));
            }
            Setting::VerticalResolutionFactor(factor) if (0.5..=10.0).contains(&factor) => {
                self.now.vertical_factor = Some(factor);
            }
            Setting::VerticalResolutionFactor(factor) => {
                self.refuse(timed, format!("a factor of {factor}"), "give 0.5 to 10");
            }
            Setting::PriorityRule(rule) => self.now.priority_rule = Some(rule),
            Setting::LookAheadS(s) if (MIN_LOOK_AHEAD_S..=MAX_LOOK_AHEAD_S).contains(&s) => {
                self.now.look_ahead_s = Some(s);
            }
            Setting::LookAheadS(s) => {
                let remedy = format!("give {MIN_LOOK_AHEAD_S} to {MAX_LOOK_AHEAD_S} s");
                self.refuse(timed, format!("a look-ahead of {s} s"), &remedy);
            }
            Setting::AddedWind(wind) => self.now.winds.push(wind),
            Setting::NoWind => self.now.winds.clear(),
            Setting::Noise(true) => {
                // Of its model of ADS-B: 0.0001 degrees and 100 feet, the same for all who receive it.
                let cause =
                    "it also shakes each aircraft, and errs in altitude; positions are exact";
                let remedy = "choose with --set airspace.position_noise_m=11.1, as much as its positions err, or with keys of \
                              airspace.surveillance errors of each observer";
                self.refuse(timed, cause.into(), remedy);
            }
            Setting::Noise(false) => {}
            Setting::Reset => self.now = SettingsInForce::default(),
        }
    }

    /// Returns the rules that hold now; the last of the settings was read at `timed`.
    fn rules(&mut self, timed: Option<&TimedSetting>) -> ImportedRules {
        let (method, is_bare) = resolution_method(&self.now);
        let mut look_ahead_s = self.now.look_ahead_s;
        if look_ahead_s.is_none() && method == Some("mvp") {
            look_ahead_s = Some(MVP_LOOK_AHEAD_S);
        }
        let wind = imported_wind(&self.now.winds, &self.file.traffic.aircraft);
        let wind = wind.unwrap_or_else(|cause| {
            let given = self.file.traffic.settings.iter();
            let mut winds = given.filter(|one| matches!(one.setting, Setting::AddedWind(_)));
            let last_s = timed.map_or(f64::INFINITY, |timed| timed.at_s);
            if let Some(last) = winds.rfind(|one| one.at_s <= last_s).cloned() {
                let remedy = "give winds in one place, each at an altitude of its own, below the speed of all aircraft";
                self.refuse(&last, cause, remedy);
            }
            // It is told once.
            self.now.winds.clear();
            None
        });
        ImportedRules {
            method,
            is_bare,
            look_ahead_s,
            resolution_factor: self.now.resolution_factor,
            resolution: self.now.limits.map(ResolutionLimits::resolution),
            vertical_factor: self.now.vertical_factor,
            right_of_way: self.now.priority_rule.map(right_of_way),
            wind,
            separation_m: self.now.radius_nm * NAUTICAL_MILE_M,
            vertical_m: self.now.half_height_ft * FOOT_M,
        }
    }
}

/// Returns the rule of a scenario that says the same as one of BlueSky.
fn right_of_way(rule: PriorityRule) -> RightOfWayRule {
    match rule {
        PriorityRule::Both => RightOfWayRule::None,
        PriorityRule::CruisingFirst => RightOfWayRule::CruisingFirst,
        PriorityRule::ClimbingFirst => RightOfWayRule::ClimbingFirst,
        PriorityRule::CruisingFirstHorizontal => RightOfWayRule::CruisingFirstHorizontal,
        PriorityRule::ClimbingFirstHorizontal => RightOfWayRule::ClimbingFirstHorizontal,
    }
}

/// Returns the method that the settings ask for, and whether nothing is to keep aircraft apart.
/// Without detection nothing is resolved.
fn resolution_method(now: &SettingsInForce) -> (Option<&'static str>, bool) {
    match (now.detection, now.resolution) {
        (Some(false), _) | (_, Some(ResolutionMethod::Off)) => (Some("none"), true),
        (_, Some(ResolutionMethod::Mvp)) => (Some("mvp"), false),
        (_, Some(ResolutionMethod::Ssd | ResolutionMethod::Eby) | None) => (None, false),
    }
}

/// Returns the wind of a file, if it has any: one that is the same everywhere, or one for each of some altitudes.
///
/// # Errors
/// The cause, when winds differ from place to place, or some aircraft could not fly against it.
fn imported_wind(winds: &[Wind], aircraft: &[ScnAircraft]) -> Result<Option<ImportedWind>, String> {
    let Some(first) = winds.first() else { return Ok(None) };
    let is_like_first =
        |other: &Wind| other.from_deg == first.from_deg && other.speed_kt == first.speed_kt;
    let mut layers = Vec::with_capacity(winds.len());
    if winds.iter().all(is_like_first) {
        layers.push((0.0, velocity_m_s(first)));
    } else {
        for wind in winds {
            match wind.altitude_ft {
                Some(altitude_ft) if wind.position == first.position => {
                    layers.push((altitude_ft * FOOT_M, velocity_m_s(wind)));
                }
                _ => return Err(format!("{} winds that differ; none blows", winds.len())),
            }
        }
        layers.sort_by(|(a_m, _), (b_m, _)| a_m.total_cmp(b_m));
        if let Some(pair) = layers.windows(2).find(|pair| pair[0].0 == pair[1].0) {
            let altitude_m = pair[0].0;
            return Err(format!("two winds at an altitude of {altitude_m:.0} m; none blows"));
        }
    }
    let speeds_m_s = layers.iter().map(|(_, wind_m_s)| norm(*wind_m_s));
    let speed_m_s = speeds_m_s.fold(0.0, f64::max);
    if let Some(slow) = aircraft.iter().find(|one| min_speed_m_s(one) <= speed_m_s) {
        return Err(format!("{speed_m_s:.1} m/s, and {} is slower; it does not blow", slow.id));
    }
    Ok(Some(ImportedWind { layers }))
}

/// Returns the velocity of a wind to the east and to the north, in meters per second.
fn velocity_m_s(wind: &Wind) -> [f64; 2] {
    let from_rad = wind.from_deg.to_radians();
    let speed_m_s = wind.speed_kt * KNOT_M_S;
    // It blows from there, clockwise from north.
    [-speed_m_s * math::sin(from_rad), -speed_m_s * math::cos(from_rad)]
}

/// Returns the smallest speed of an aircraft once it moves.
fn min_speed_m_s(aircraft: &ScnAircraft) -> f64 {
    aircraft_at_flying_speed(aircraft).map_or(f64::INFINITY, |one| one.min_speed_m_s())
}

#[cfg(test)]
mod tests {
    use super::*;
    use sidestep_import::bluesky::parse;

    fn found_at(timed: &str) -> (ImportedScenarioSettings, Vec<String>) {
        let start = "00:00:00>CRE A1,B744,0,-0.4,90,FL200,250\n";
        let settings = import_settings(&parse(&"a.scn", &format!("{start}{timed}")));
        let refused = settings.refused.iter().map(ToString::to_string).collect();
        (settings, refused)
    }

    fn found(commands: &str) -> (ImportedScenarioSettings, Vec<String>) {
        let timed: String = commands.lines().map(|line| format!("00:00:00.00>{line}\n")).collect();
        found_at(&timed)
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
            let (settings, refused) = found(commands);
            let start = &settings.start;
            assert_eq!((start.method, start.is_bare), (method, is_bare), "{commands}");
            assert_eq!((refused, settings.changes), (vec![], vec![]), "{commands}");
        }
        let (settings, _) = found("DTLOOK 120\nWIND 0,1,,270,36\nRFACH 1.2\nZONER 3\nZONEDH 500");
        let start = settings.start;
        assert_eq!(start.mvp_text(), "look_ahead_s = 120.0, resolution_factor = 1.2");
        let (settings, _) = found("RESO MVP\nRFACH 1.2");
        let as_in_bluesky = "look_ahead_s = 300.0, margin = 1.0, resolution_factor = 1.2";
        assert_eq!(settings.start.mvp_text(), as_in_bluesky);
        assert_eq!((start.separation_m, start.vertical_m), (5556.0, 152.4));
        let [east, north] = start.wind.expect("a wind").at_altitude_m_s(900.0);
        assert!((east - 18.52).abs() < 1e-9 && north.abs() < 1e-9, "{east} {north}");
    }

    #[test]
    fn resolutions_are_those_that_bluesky_comes_to_by_the_same_commands() {
        for (commands, keys) in [
            ("RESO MVP\nRMETHV OFF", None),
            ("RESO MVP\nRMETHH HDG", Some("heading")),
            ("RESO MVP\nRMETHH SPD", Some("speed")),
            ("RESO MVP\nRMETHH ON", Some("heading-speed")),
            ("RESO MVP\nRMETHH HDG\nRMETHV V/S", Some("vertical")),
            ("RESO MVP\nRMETHV V/S\nRMETHH OFF", Some("vertical")),
            ("RESO MVP\nRMETHV V/S\nRMETHH SPD", Some("speed")),
            ("RESO MVP\nRMETHH OFF", Some("heading-speed-vertical")),
            ("RESO MVP\nRMETHV V/S\nRMETHV OFF", Some("heading-speed-vertical")),
        ] {
            let (settings, refused) = found(commands);
            assert_eq!(refused, [""; 0], "{commands}");
            let resolution = settings.start.resolution.map(Resolution::name);
            assert_eq!(resolution, keys, "{commands}");
        }
        let (settings, _) = found("RESO MVP\nRMETHV V/S\nRFACV 1.2");
        let keys =
            "look_ahead_s = 300.0, margin = 1.0, resolution = \"vertical\", vertical_factor = 1.2";
        assert_eq!(settings.start.mvp_text(), keys);
        let (settings, _) = found("RMETHV V/S");
        assert_eq!(settings.start.mvp_text(), "", "as long as nothing is resolved");
    }

    #[test]
    fn rules_of_priority_are_rights_of_way() {
        let (settings, _) = found("RESO MVP\nPRIORULES ON FF2");
        assert_eq!(settings.start.right_of_way, Some(RightOfWayRule::CruisingFirst));
        let (settings, _) = found_at(
            "00:00:00>RESO MVP\n00:01:00>PRIORULES ON LAY2\n00:02:00>RFACH 1.2\n00:03:00>PRIORULES ON FF1\n",
        );
        assert_eq!(settings.start.right_of_way, None);
        let changes: Vec<&str> = settings.changes.iter().map(|one| one.text.as_str()).collect();
        let rules = ["climbing-first-horizontal", "none"];
        let [on, off] = rules.map(|rule| format!(", right_of_way = {rule:?}"));
        assert_eq!([changes[0], changes[2]], [on, off]);
        assert_eq!(changes.len(), 3);
    }

    #[test]
    fn a_setting_holds_from_its_time_on_and_not_before() {
        for (timed, method, changes) in [
            (
                "00:00:00>RESO MVP\n00:20:00>RESO OFF\n",
                Some("mvp"),
                vec![(1200.0, ", method = \"none\", shield = \"off\"")],
            ),
            ("02:00:00>ASAS OFF\n", None, vec![(7200.0, ", method = \"none\", shield = \"off\"")]),
            (
                "00:10:00>RESO MVP\n",
                Some("none"),
                vec![(
                    600.0,
                    ", method = \"mvp\", mvp = { look_ahead_s = 300.0, margin = 1.0, resolution_factor = 1.01 }",
                )],
            ),
            (
                "00:00:00>RESO MVP\n00:01:00>ZONER 3;DTLOOK 60\n00:02:00>ZONEDH 500;ZONER 3\n",
                Some("mvp"),
                vec![
                    (
                        60.0,
                        ", mvp = { look_ahead_s = 60.0, margin = 1.0, resolution_factor = 1.01 }, separation_m = 5556.0",
                    ),
                    (120.0, ", vertical_m = 152.4"),
                ],
            ),
            (
                "00:00:00>WIND 0,1,,270,36\n00:01:00>DEL WIND\n",
                None,
                vec![(60.0, ", wind_m_s = [0.0, 0.0]")],
            ),
            (
                "00:01:00>ZONER 3 A1\n00:02:00>RESOOFF A1\n",
                None,
                vec![
                    (60.0, ", airplanes = [0], separation_m = 5556.0"),
                    (120.0, ", airplanes = [0], non_cooperative = true"),
                ],
            ),
        ] {
            let (settings, refused) = found_at(timed);
            assert_eq!((settings.start.method, refused), (method, vec![]), "{timed}");
            let found: Vec<(f64, &str)> =
                settings.changes.iter().map(|one| (one.at_s, one.text.as_str())).collect();
            assert_eq!(found, changes, "{timed}");
        }
    }

    #[test]
    fn what_cannot_be_flown_is_refused_by_name_and_line() {
        for (commands, name, line) in [
            ("RESO SSD", "RESO", 2),
            ("ZONER 3\nRESO EBY", "RESO", 3),
            ("NOISE ON", "NOISE", 2),
            ("DTLOOK 0.5", "DTLOOK", 2),
            ("RFACH 20", "RFACH", 2),
            ("RFACV 20", "RFACV", 2),
            ("WIND 0,1,,270,36\nWIND 0,2,,90,36", "WIND", 3),
            ("WIND 0,1,,270,600", "WIND", 2),
        ] {
            let (settings, refused) = found(commands);
            let [one] = &refused[..] else { panic!("{commands}: {refused:?}") };
            assert!(one.contains(&format!("{name}: ")), "{one}");
            assert_eq!(settings.refused[0].line_and_column(), Some((line, 1)), "{commands}");
            let start = &settings.start;
            assert_eq!((start.look_ahead_s, &start.wind), (None, &None), "{commands}");
        }
    }
}
