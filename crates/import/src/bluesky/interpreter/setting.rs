//! Settings of all aircraft or of one, with the times from which they hold.

use super::{
    CommandError, CommandOutcome, CommandResult, Interpreter, canonical_name, refusal, upper,
};
use crate::bluesky::traffic::{
    AircraftSetting, HorizontalResolution, PriorityRule, ResolutionMethod, Setting, TimedSetting,
    Wind,
};
use crate::bluesky::values::{
    Arguments, ZONE_HALF_HEIGHTS_FT, ZONE_RADII_NM, altitude_ft, duration_s, heading_deg, number,
    on_off, positive, zone_size,
};
use crate::local_plane::LatLon;
use crate::report::Treatment;
use crate::table::Token;

/// The zones of aircraft that are created from now on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct SettingDefaults {
    pub(super) zone_radius_nm: f64,
    /// Whether an aircraft has a radius of its own: then all have, and `ZONER` is for new ones only.
    has_own_radius: bool,
    has_wind: bool,
    detects: bool,
    /// Whether sizes of zones or a look-ahead are given.
    has_zones: bool,
    /// Whether some conflicts are resolved by one airplane alone.
    has_priority_rule: bool,
}

impl Default for SettingDefaults {
    fn default() -> Self {
        Self {
            zone_radius_nm: 5.0,
            has_own_radius: false,
            has_wind: false,
            detects: false,
            has_zones: false,
            has_priority_rule: false,
        }
    }
}

impl SettingDefaults {
    /// Returns the settings of its own that a new aircraft has.
    pub(super) fn own_settings(&self) -> impl Iterator<Item = AircraftSetting> + use<> {
        let radius = AircraftSetting::ZoneRadiusNm(self.zone_radius_nm);
        self.has_own_radius.then_some(radius).into_iter()
    }
}

impl Interpreter {
    pub(super) fn has_wind(&self) -> bool {
        self.defaults.has_wind
    }

    /// Adds a setting for all aircraft that holds from now on.
    pub(super) fn add_setting(&mut self, command: &'static str, setting: Setting) {
        match setting {
            Setting::AddedWind(_) => self.defaults.has_wind = true,
            Setting::NoWind => self.defaults.has_wind = false,
            Setting::Reset => {
                self.defaults.has_wind = false;
                self.defaults.has_priority_rule = false;
            }
            Setting::PriorityRule(rule) => {
                self.defaults.has_priority_rule = rule != PriorityRule::Both;
            }
            Setting::ZoneRadiusNm(_) | Setting::ZoneHalfHeightFt(_) | Setting::LookAheadS(_) => {
                self.defaults.has_zones = true;
            }
            Setting::Detection(is_on) => self.note_detection(is_on),
            _ => {}
        }
        self.result.traffic.settings.push(TimedSetting {
            at_s: self.now_s,
            command,
            file: self.source.name.clone(),
            line: self.line,
            setting,
        });
    }

    /// Names zones that BlueSky forgets: each of its methods has its own, and those given before it is selected stay with
    /// the one before.
    fn note_detection(&mut self, is_on: bool) {
        let is_switched_on = is_on && !self.defaults.detects;
        self.defaults.detects = is_on;
        if is_switched_on && self.defaults.has_zones {
            let rule =
                "ZONER, ZONEDH or DTLOOK before CDMETHOD or ASAS: kept; BlueSky 1.1.1 forgets them";
            self.note(Treatment::Guessed, rule, "write CDMETHOD or ASAS in front of them");
        }
    }

    /// `ZONER radius[,aircraft,...]` and `ZONEDH height[,aircraft,...]`. Without a value they are queries.
    pub(super) fn set_zone(&mut self, arguments: &mut Arguments, name: &str) -> CommandResult {
        let Some(word) = arguments.next() else { return Ok(CommandOutcome::Done) };
        let is_radius = canonical_name(name) == "ZONER";
        let (range, unit) =
            if is_radius { (&ZONE_RADII_NM, "NM") } else { (&ZONE_HALF_HEIGHTS_FT, "ft") };
        let size = zone_size(arguments.place, word, range, unit)?;
        if !arguments.has_further() {
            self.set_common_zone(is_radius, size);
            return Ok(CommandOutcome::Done);
        }
        if !is_radius {
            arguments.skip_all();
            let reason = "heights of single zones are not known here; all have that of ZONEDH without aircraft";
            return Ok(CommandOutcome::NotUnderstood(format!("{name} aircraft"), reason));
        }
        while arguments.has_further() {
            let index = self.existing_aircraft(arguments)?;
            let own = AircraftSetting::ZoneRadiusNm(size);
            self.builders[index].aircraft.settings.push((self.now_s, own));
        }
        self.defaults.has_own_radius = true;
        Ok(CommandOutcome::Done)
    }

    /// Sets the zone of all aircraft, or of new ones only where aircraft have zones of their own, as BlueSky does.
    fn set_common_zone(&mut self, is_radius: bool, size: f64) {
        if !is_radius {
            self.add_setting("ZONEDH", Setting::ZoneHalfHeightFt(size));
            return;
        }
        self.defaults.zone_radius_nm = size;
        if self.defaults.has_own_radius {
            let rule =
                "ZONER for all after one for an aircraft: as in BlueSky, new aircraft have it";
            self.note(Treatment::Guessed, rule, "name the aircraft");
        } else {
            self.add_setting("ZONER", Setting::ZoneRadiusNm(size));
        }
    }

    /// A setting for all. Without a value it is a query and changes nothing.
    pub(super) fn set(&mut self, arguments: &mut Arguments, name: &str) -> CommandResult {
        if arguments.peek().is_none() {
            return Ok(CommandOutcome::Done);
        }
        let value = arguments.required("a value")?;
        let place = arguments.place;
        match canonical_name(name) {
            "RESO" => {
                let method = resolution(arguments, value)?;
                if method == ResolutionMethod::Mvp {
                    self.note_early_priority_rule();
                    self.mvp_place.get_or_insert(self.place.clone());
                }
                self.add_setting("RESO", Setting::Resolution(method));
            }
            "DTLOOK" => {
                let look_ahead_s = duration_s(place, value)?;
                if look_ahead_s <= 0.0 {
                    let cause = "a look-ahead of no time".to_string();
                    return Err(arguments.error(value, cause, "write seconds such as 300").into());
                }
                if arguments.has_further() {
                    arguments.skip_all();
                    let reason = "look-ahead times of single aircraft are not known here";
                    return Ok(CommandOutcome::NotUnderstood("DTLOOK aircraft".into(), reason));
                }
                self.add_setting("DTLOOK", Setting::LookAheadS(look_ahead_s));
            }
            "RFACH" => {
                let factor = positive(place, value)?;
                self.add_setting("RFACH", Setting::ResolutionFactor(factor));
            }
            "RFACV" => {
                let factor = positive(place, value)?;
                self.add_setting("RFACV", Setting::VerticalResolutionFactor(factor));
            }
            "RMETHH" => return Ok(self.limit_horizontal_resolution(value)),
            "RMETHV" => return Ok(self.limit_vertical_resolution(value)),
            "PRIORULES" => return Ok(self.set_priority_rule(arguments, value)),
            "NOISE" => {
                let is_on = on_off(place, value)?;
                self.add_setting("NOISE", Setting::Noise(is_on));
            }
            other => {
                let is_method = ["STATEBASED", "CSTATEBASED"].contains(&&*upper(value));
                let is_on = is_method || on_off(place, value)?;
                let command = if other == "ASAS" { "ASAS" } else { "CDMETHOD" };
                self.add_setting(command, Setting::Detection(is_on));
            }
        }
        Ok(CommandOutcome::Done)
    }

    /// Names a rule of priority that BlueSky forgets: it stays with the method before.
    fn note_early_priority_rule(&mut self) {
        if self.mvp_place.is_none() && self.defaults.has_priority_rule {
            let rule = "PRIORULES before RESO MVP: kept; BlueSky 1.1.1 forgets it";
            self.note(Treatment::Guessed, rule, "write RESO MVP in front of it");
        }
    }

    /// `RMETHH`: what MVP changes in the horizontal.
    fn limit_horizontal_resolution(&mut self, value: Token) -> CommandOutcome {
        let resolution = match upper(value).as_str() {
            "ON" | "BOTH" => HorizontalResolution::Both,
            "SPD" => HorizontalResolution::Speed,
            "HDG" => HorizontalResolution::Heading,
            "OFF" | "OF" | "NONE" => HorizontalResolution::Off,
            other => {
                let reason = "write RMETHH BOTH, SPD, HDG or OFF";
                return CommandOutcome::NotUnderstood(format!("RMETHH {other}"), reason);
            }
        };
        self.has_resolution_limits = true;
        self.add_setting("RMETHH", Setting::HorizontalResolution(resolution));
        CommandOutcome::Done
    }

    /// `RMETHV`: whether MVP changes vertical speeds, and nothing else.
    fn limit_vertical_resolution(&mut self, value: Token) -> CommandOutcome {
        let is_on = match upper(value).as_str() {
            "ON" | "V/S" => true,
            "OFF" | "OF" | "NONE" => false,
            other => {
                let reason = "write RMETHV V/S or OFF";
                return CommandOutcome::NotUnderstood(format!("RMETHV {other}"), reason);
            }
        };
        // Off it leaves the horizontal as it is.
        self.has_resolution_limits |= is_on;
        self.add_setting("RMETHV", Setting::VerticalResolution(is_on));
        CommandOutcome::Done
    }

    /// `PRIORULES ON code`, or `PRIORULES OFF`. In BlueSky 1.1.1 a code switches the rule on, whatever is before it, and without
    /// a code MVP refuses the command.
    fn set_priority_rule(&mut self, arguments: &mut Arguments, value: Token) -> CommandOutcome {
        let switch = upper(value);
        let code = arguments.next().map(upper).unwrap_or_default();
        if ["OFF", "FALSE", "NO", "0"].contains(&&*switch) {
            if self.defaults.has_priority_rule {
                let rule = "PRIORULES OFF: off; BlueSky 1.1.1 keeps the rule";
                self.note(Treatment::Guessed, rule, "write PRIORULES ON FF1");
            }
            self.add_setting("PRIORULES", Setting::PriorityRule(PriorityRule::Both));
            return CommandOutcome::Done;
        }
        let is_on = ["ON", "TRUE", "YES", "1"].contains(&&*switch);
        let rule = match code.as_str() {
            "FF1" => PriorityRule::Both,
            "FF2" => PriorityRule::CruisingFirst,
            "FF3" => PriorityRule::ClimbingFirst,
            "LAY1" => PriorityRule::CruisingFirstHorizontal,
            "LAY2" => PriorityRule::ClimbingFirstHorizontal,
            _ => return unknown_priority_rule(&switch, &code),
        };
        if !is_on {
            return unknown_priority_rule(&switch, &code);
        }
        self.add_setting("PRIORULES", Setting::PriorityRule(rule));
        CommandOutcome::Done
    }

    /// `WIND place,direction,speed`, or `WIND place` followed by `altitude,direction,speed` for
    /// each altitude, where the altitude may be left out.
    pub(super) fn add_wind(&mut self, arguments: &mut Arguments) -> CommandResult {
        let place = self.place(arguments)?;
        let has_altitudes = arguments.remaining() != 2;
        let mut winds = Vec::new();
        let position = place.position().unwrap_or(LatLon { lat_deg: 0.0, lon_deg: 0.0 });
        loop {
            let altitude_ft = if has_altitudes { arguments.optional(altitude_ft)? } else { None };
            let from = arguments.required("the direction the wind blows from")?;
            let speed = arguments.required("the wind's speed in kt")?;
            winds.push(Wind {
                position,
                altitude_ft,
                from_deg: heading_deg(arguments.place, from)?,
                speed_kt: number(arguments.place, speed)?,
            });
            if arguments.remaining() == 0 {
                break;
            }
        }
        self.add_unresolved(arguments.command, None, &place);
        if place.position().is_some() {
            for wind in winds {
                self.add_setting("WIND", Setting::AddedWind(wind));
            }
        }
        Ok(CommandOutcome::Done)
    }
}

fn unknown_priority_rule(switch: &str, code: &str) -> CommandOutcome {
    let reason = "write PRIORULES ON FF1, FF2, FF3, LAY1 or LAY2";
    CommandOutcome::NotUnderstood(format!("PRIORULES {switch} {code}").trim_end().into(), reason)
}

fn resolution(arguments: &Arguments, word: Token) -> Result<ResolutionMethod, CommandError> {
    match upper(word).as_str() {
        "OFF" => Ok(ResolutionMethod::Off),
        "MVP" => Ok(ResolutionMethod::Mvp),
        "SSD" => Ok(ResolutionMethod::Ssd),
        "EBY" => Ok(ResolutionMethod::Eby),
        other => {
            let cause = format!("no resolution method `{other}` is known");
            Err(refusal(arguments, word, cause, "take OFF, MVP, SSD or EBY"))
        }
    }
}
