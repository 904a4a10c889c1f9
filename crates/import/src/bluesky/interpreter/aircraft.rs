//! Commands that create, change and remove aircraft.

use super::notes::{MIN_SPEED_MPS, RUNWAY_HEADING_RULE, STANDING_RULE, SUPERSONIC_CLIMB_RULE};
use super::{
    AircraftBuilder, CommandError, CommandOutcome, CommandResult, Interpreter, refusal, upper,
};
use crate::bluesky::lines::CommandText;
use crate::bluesky::speed::sound_mps;
use crate::bluesky::traffic::{
    AircraftCommand, AircraftSetting, PositionRef, ScnAircraft, Setting,
};
use crate::bluesky::values::{
    Arguments, altitude_ft, heading_deg, on_off, speed, vertical_speed_fpm,
};
use crate::bluesky::{Airspeed, MAX_AIRCRAFT, TYPES_RULE, synthetic};
use crate::local_plane::{EARTH_RADIUS_M, LatLon, wrap_deg};
use crate::report::Treatment;
use crate::table::Token;
use sidestep_kernel::math;

/// Where an aircraft is and how it flies, as far as its commands alone tell it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct KnownState {
    pub(super) position: LatLon,
    pub(super) heading_deg: f64,
    pub(super) altitude_ft: f64,
    pub(super) true_airspeed_mps: f64,
    pub(super) vertical_speed_fpm: f64,
}

impl Interpreter {
    /// `CRE aircraft,type,place[,heading[,altitude[,speed]]]`
    pub(super) fn create(&mut self, arguments: &mut Arguments) -> CommandResult {
        let id = arguments.required("an aircraft")?;
        let kind = arguments.next().map_or(String::new(), |word| word.text.to_owned());
        self.runway_deg = None;
        let place = self.place(arguments)?;
        let heading_deg = arguments.optional(heading_deg)?;
        let runway_deg = self.runway_deg.filter(|_| heading_deg.is_none());
        let aircraft = ScnAircraft {
            id: upper(id),
            kind,
            created_s: self.now_s,
            lat_deg: place.position().map_or(0.0, |position| position.lat_deg),
            lon_deg: place.position().map_or(0.0, |position| position.lon_deg),
            heading_deg: heading_deg.or(runway_deg).unwrap_or(0.0),
            altitude_ft: arguments.optional(altitude_ft)?.unwrap_or(0.0),
            speed: arguments.optional(speed)?.unwrap_or(Airspeed::CasKt(0.0)),
            way_points: Vec::new(),
            origin: None,
            destination: None,
            destination_s: None,
            changes: Vec::new(),
            settings: Vec::new(),
            deleted_s: None,
        };
        let unresolved_start = match &place {
            PositionRef::Unresolved(name) => Some(name.clone()),
            _ => None,
        };
        let speed = aircraft.speed;
        let altitude_ft = aircraft.altitude_ft;
        let has_type = !aircraft.kind.is_empty();
        self.add_aircraft(arguments, id, aircraft)?;
        self.note_supersonic(speed, altitude_ft);
        if has_type {
            self.note(Treatment::NotUsed, TYPES_RULE, "");
        }
        if runway_deg.is_some() {
            self.note(Treatment::Guessed, RUNWAY_HEADING_RULE, "give the heading");
        }
        self.set_unresolved_start(unresolved_start);
        self.add_unresolved(arguments.command, Some(id.text), &place);
        Ok(CommandOutcome::Done)
    }

    /// Names a speed at which no airliner flies: a calibrated airspeed means more and more on higher levels.
    fn note_supersonic(&mut self, speed: Airspeed, altitude_ft: f64) {
        if is_supersonic(speed, altitude_ft) {
            let rule = "speeds above that of sound, which no limit of a type reduces here";
            self.note(Treatment::Suspicious, rule, "give a Mach number such as M0.8");
        }
    }

    /// Names a speed that an aircraft is given and does not fly with.
    fn note_speed(&mut self, index: usize, speed: Airspeed) {
        let builder = &self.builders[index];
        let altitude_ft = builder.last_altitude_ft;
        let is_flying = builder.aircraft.speed.true_airspeed_mps(altitude_ft) >= MIN_SPEED_MPS;
        if is_flying && speed.true_airspeed_mps(altitude_ft) < MIN_SPEED_MPS {
            self.note(Treatment::Guessed, STANDING_RULE, "delete it with DEL");
        }
        self.note_supersonic(speed, altitude_ft);
    }

    fn set_unresolved_start(&mut self, name: Option<String>) {
        if let Some(last) = self.builders.last_mut() {
            last.unresolved_start = name;
        }
    }

    /// Adds a new aircraft; errors point at `word`. An identifier may be used again once its aircraft is deleted.
    pub(super) fn add_aircraft(
        &mut self,
        arguments: &Arguments,
        word: Token,
        mut aircraft: ScnAircraft,
    ) -> Result<(), CommandError> {
        if self.builders.len() >= MAX_AIRCRAFT {
            let cause = format!("this is more than {MAX_AIRCRAFT} aircraft");
            return Err(refusal(arguments, word, cause, "create fewer"));
        }
        let id = aircraft.id.clone();
        if let Some(&earlier) = self.by_id.get(&id)
            && self.builders[earlier].aircraft.deleted_s.is_none()
        {
            let cause = format!("aircraft {id} exists already");
            let remedy = "delete it first, or take another identifier";
            return Err(refusal(arguments, word, cause, remedy));
        }
        aircraft.settings.extend(self.defaults.own_settings().map(|own| (self.now_s, own)));
        self.by_id.insert(id.clone(), self.builders.len());
        self.builders.push(AircraftBuilder {
            last_altitude_ft: aircraft.altitude_ft,
            unnamed_way_points: 0,
            aircraft,
            unresolved_start: None,
            vertical_speed_fpm: 0.0,
            is_void: false,
            flies_over: false,
            fly_by_place: None,
            vertical_speed_places: Vec::new(),
        });
        for command in &self.creation_commands {
            let told = command.with_text(format!("{id} {}", command.text));
            self.schedule.add_last(self.now_s, told);
        }
        Ok(())
    }

    /// `CRECMD command`, which each aircraft is given on its creation from now on.
    pub(super) fn add_creation_command(
        &mut self,
        command: &CommandText,
        arguments: &mut Arguments,
    ) -> CommandResult {
        let first = arguments.required("a command")?;
        let text = command.text_from(first).to_string();
        arguments.skip_all();
        self.creation_commands.push(command.with_text(text));
        Ok(CommandOutcome::Done)
    }

    /// `CLRCRECMD`: new aircraft are given no commands any more.
    pub(super) fn clear_creation_commands(&mut self) -> CommandResult {
        self.creation_commands.clear();
        Ok(CommandOutcome::Done)
    }

    /// `DEL aircraft,...` or `DEL WIND`
    pub(super) fn delete(&mut self, arguments: &mut Arguments) -> CommandResult {
        if arguments.peek().is_some_and(|word| word.eq_ignore_ascii_case("WIND")) {
            arguments.next();
            self.add_setting("WIND", Setting::NoWind);
            return Ok(CommandOutcome::Done);
        }
        loop {
            let index = self.existing_aircraft(arguments)?;
            self.builders[index].aircraft.deleted_s = Some(self.now_s);
            if !arguments.has_further() {
                return Ok(CommandOutcome::Done);
            }
        }
    }

    /// Removes all aircraft.
    pub(super) fn delete_all(&mut self) {
        for builder in &mut self.builders {
            let aircraft = &mut builder.aircraft;
            if aircraft.deleted_s.is_none() {
                aircraft.deleted_s = Some(self.now_s);
                builder.is_void = aircraft.created_s >= self.now_s;
            }
        }
    }

    /// Returns the next argument, which must be an existing aircraft.
    pub(super) fn existing_aircraft(
        &self,
        arguments: &mut Arguments,
    ) -> Result<usize, CommandError> {
        let word = arguments.required("an aircraft")?;
        let problem = match self.by_id.get(&upper(word)).copied() {
            Some(index) if self.builders[index].aircraft.deleted_s.is_none() => return Ok(index),
            Some(_) => "was deleted before",
            None => "was not created before",
        };
        let cause = format!("aircraft {} {problem}", word.text);
        Err(refusal(arguments, word, cause, "check the identifier and the times"))
    }

    /// `HDG aircraft,heading` and similar commands. Without a value they are queries and change
    /// nothing.
    pub(super) fn change(&mut self, arguments: &mut Arguments, name: &str) -> CommandResult {
        let index = self.existing_aircraft(arguments)?;
        let change = match name {
            "HDG" | "HEADING" | "TURN" => {
                arguments.optional(heading_deg)?.map(AircraftCommand::HeadingDeg)
            }
            "SPD" | "SPEED" => arguments.optional(speed)?.map(AircraftCommand::Speed),
            "ALT" => arguments.optional(altitude_ft)?.map(AircraftCommand::AltitudeFt),
            "LNAV" => arguments.optional(on_off)?.map(AircraftCommand::LateralNavigation),
            "VNAV" => arguments.optional(on_off)?.map(AircraftCommand::VerticalNavigation),
            _ => arguments.optional(vertical_speed_fpm)?.map(AircraftCommand::VerticalSpeedFpm),
        };
        // ALT may have the vertical speed as a further argument.
        let climb = if name == "ALT" { arguments.optional(vertical_speed_fpm)? } else { None };
        match change {
            Some(AircraftCommand::VerticalNavigation(true)) => {
                let rule = "VNAV ON: altitudes and speeds of a route are not flown yet";
                self.note(Treatment::NotUsed, rule, "give ALT and SPD with a time");
            }
            Some(AircraftCommand::LateralNavigation(false)) => {
                let rule = "LNAV OFF: the heading that is kept is not known beforehand, the route is flown";
                self.note(Treatment::NotUsed, rule, "give HDG");
            }
            _ => {}
        }
        match change {
            Some(AircraftCommand::Speed(speed)) => self.note_speed(index, speed),
            Some(AircraftCommand::AltitudeFt(altitude_ft)) => {
                if is_supersonic(self.builders[index].last_speed(), altitude_ft) {
                    self.note(Treatment::Suspicious, SUPERSONIC_CLIMB_RULE, "give a lower level");
                }
                self.builders[index].last_altitude_ft = altitude_ft;
                self.builders[index].vertical_speed_places.clear();
            }
            Some(AircraftCommand::VerticalSpeedFpm(_)) => {
                let place = self.place.clone();
                let has_level = |(_, command): &(f64, AircraftCommand)| {
                    matches!(command, AircraftCommand::AltitudeFt(_))
                };
                let builder = &mut self.builders[index];
                if !builder.aircraft.changes.iter().any(has_level) {
                    builder.vertical_speed_places.push(place);
                }
            }
            _ => {}
        }
        let changes = change.into_iter().chain(climb.map(AircraftCommand::VerticalSpeedFpm));
        let changes = changes.map(|change| (self.now_s, change));
        self.builders[index].aircraft.changes.extend(changes);
        Ok(CommandOutcome::Done)
    }

    /// `SYN SUPER n`, `SYN WALL`, `SYN MATRIX n`
    pub(super) fn synthesize(&mut self, arguments: &mut Arguments) -> CommandResult {
        let variant = arguments.required("SUPER, WALL or MATRIX")?;
        let spacing_nm = self.defaults.zone_radius_nm;
        let now_s = self.now_s;
        let aircraft = match upper(variant).as_str() {
            "SUPER" => synthetic::super_conflict(pattern_size(arguments, 1)?, now_s),
            "WALL" => synthetic::wall(spacing_nm, now_s),
            "MATRIX" => synthetic::matrix(pattern_size(arguments, 4)?, spacing_nm, now_s),
            other => {
                let reason = "only SUPER, WALL and MATRIX are known";
                return Ok(CommandOutcome::NotUnderstood(format!("SYN {other}"), reason));
            }
        };
        if aircraft.iter().any(|one| one.lat_deg.abs() > 90.0 || one.lon_deg.abs() > 180.0) {
            let cause = "the pattern is larger than the earth".to_string();
            let remedy = "take a smaller number or a smaller ZONER";
            return Err(refusal(arguments, variant, cause, remedy));
        }
        for aircraft in aircraft {
            self.add_aircraft(arguments, variant, aircraft)?;
        }
        Ok(CommandOutcome::Done)
    }

    /// `RESOOFF aircraft,...` switches whether each of them avoids others, and `NORESO` whether others avoid it.
    pub(super) fn toggle_avoidance(
        &mut self,
        arguments: &mut Arguments,
        name: &str,
    ) -> CommandResult {
        if name == "NORESO" && arguments.has_further() {
            arguments.skip_all();
            let reason =
                "aircraft that nobody avoids are not known here; others avoid them as well";
            return Ok(CommandOutcome::NotUnderstood(name.to_string(), reason));
        }
        while arguments.has_further() {
            let index = self.existing_aircraft(arguments)?;
            let settings = &mut self.builders[index].aircraft.settings;
            let avoids = settings.iter().rev().find_map(|(_, setting)| match setting {
                AircraftSetting::Avoids(avoids) => Some(*avoids),
                AircraftSetting::ZoneRadiusNm(_) => None,
            });
            let changed = AircraftSetting::Avoids(!avoids.unwrap_or(true));
            settings.push((self.now_s, changed));
        }
        Ok(CommandOutcome::Done)
    }

    /// Returns the state of an aircraft now; `None` where it depends on how the aircraft turns, climbs or drifts.
    pub(super) fn known_state(&self, index: usize) -> Option<KnownState> {
        let builder = &self.builders[index];
        let aircraft = &builder.aircraft;
        if builder.unresolved_start.is_some() {
            return None;
        }
        let flown_s = self.now_s - aircraft.created_s;
        let is_straight = aircraft.way_points.is_empty()
            && aircraft.destination.is_none()
            && aircraft.changes.first().is_none_or(|(at_s, _)| *at_s >= self.now_s)
            && builder.vertical_speed_fpm == 0.0
            && !self.has_wind();
        if flown_s > 0.0 && !is_straight {
            return None;
        }
        let speed_mps = aircraft.speed.true_airspeed_mps(aircraft.altitude_ft);
        let heading_rad = aircraft.heading_deg.to_radians();
        let way_rad = speed_mps * flown_s / EARTH_RADIUS_M;
        let start = aircraft.position();
        let north_rad = way_rad * math::cos(heading_rad);
        let east_rad = way_rad * math::sin(heading_rad);
        let middle_rad = start.lat_deg.to_radians() + 0.5 * north_rad;
        let east_deg = (east_rad / math::cos(middle_rad).max(1e-9)).to_degrees();
        Some(KnownState {
            position: LatLon {
                lat_deg: start.lat_deg + north_rad.to_degrees(),
                lon_deg: wrap_deg(start.lon_deg + east_deg),
            },
            heading_deg: aircraft.heading_deg,
            altitude_ft: aircraft.altitude_ft,
            true_airspeed_mps: speed_mps,
            vertical_speed_fpm: builder.vertical_speed_fpm,
        })
    }
}

/// Returns the size of a pattern that has `per_size` aircraft for each unit of size.
fn pattern_size(arguments: &mut Arguments, per_size: usize) -> Result<u32, CommandError> {
    let word = arguments.required("a number of aircraft")?;
    let size = word.integer(&arguments.place)?;
    if size == 0 || (size as usize).saturating_mul(per_size) > MAX_AIRCRAFT {
        let cause = format!("a pattern has 1 to {MAX_AIRCRAFT} aircraft");
        return Err(refusal(arguments, word, cause, "take another number"));
    }
    Ok(size)
}

fn is_supersonic(speed: Airspeed, altitude_ft: f64) -> bool {
    speed.true_airspeed_mps(altitude_ft) > sound_mps(altitude_ft)
}
