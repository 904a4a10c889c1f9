//! The effects of the commands of a scenario.

use std::collections::BTreeMap;
use std::fmt;

use super::lines::Command;
use super::values::{
    Arguments, ZONE_HALF_HEIGHTS_FT, ZONE_RADII_NM, altitude_ft, heading_deg, is_latitude, number,
    on_off, positive, speed, vertical_speed_fpm, zone_size,
};
use super::{
    AircraftCommand, Airspeed, MAX_AIRCRAFT, MAX_WAY_POINTS, PositionRef, ResolutionMethod,
    ScnAircraft, ScnFile, UnplacedAircraft, UnresolvedPosition, WayPoint, Wind, synthetic,
};
use crate::local_plane::LatLon;
use crate::table::Token;
use sidestep_kernel::InputError;

/// Commands to one aircraft; its identifier may precede them.
const AIRCRAFT_COMMANDS: [&str; 27] = [
    "ADDWPT", "AFTER", "ALT", "AT", "ATALT", "ATDIST", "ATSPD", "BEFORE", "DEL", "DELETE",
    "DELRTE", "DELWPT", "DEST", "DIRECT", "HDG", "HEADING", "LISTRTE", "LNAV", "MOVE", "ORIG",
    "POS", "SPD", "SPEED", "SWTOC", "TURN", "VNAV", "VS",
];

/// Commands that change or query a display.
const DISPLAY_COMMANDS: [&str; 12] = [
    "ECHO",
    "FILTERALT",
    "LABEL",
    "LISTRTE",
    "PAN",
    "POS",
    "SSD",
    "SWRAD",
    "SYMBOL",
    "TRAIL",
    "TRAILS",
    "ZOOM",
];

/// Modes that `ADDWPT` takes in place of a way-point. Airplanes here fly by all way-points, so both have no
/// effect.
const TURN_MODES: [&str; 2] = ["FLYBY", "FLYOVER"];

/// The result of a command.
enum CommandOutcome {
    Done,
    /// It has no effect, and is counted under this name.
    NotUnderstood(String),
}

/// The reason why a command had no effect.
enum CommandError {
    Unparsed(InputError),
    Refused(InputError),
}

impl From<InputError> for CommandError {
    fn from(error: InputError) -> Self {
        Self::Unparsed(error)
    }
}

type CommandResult = Result<CommandOutcome, CommandError>;

/// An aircraft that is being built.
struct AircraftBuilder {
    aircraft: ScnAircraft,
    /// The name of its start, where the position of that is not known.
    unresolved_start: Option<String>,
}

/// Carries out commands in their order.
pub(super) struct Interpreter<'p> {
    place: &'p dyn fmt::Display,
    file: ScnFile,
    builders: Vec<AircraftBuilder>,
    /// The last builder with each identifier.
    by_id: BTreeMap<String, usize>,
    /// The way-points that `DEFWPT` has defined.
    defined: BTreeMap<String, LatLon>,
}

impl<'p> Interpreter<'p> {
    pub(super) fn new(place: &'p dyn fmt::Display, file: ScnFile) -> Self {
        Self { place, file, builders: Vec::new(), by_id: BTreeMap::new(), defined: BTreeMap::new() }
    }

    /// Carries out `commands`, which are sorted by time.
    pub(super) fn run(mut self, commands: Vec<Command>) -> ScnFile {
        for command in commands {
            self.execute(command);
        }
        for AircraftBuilder { aircraft, unresolved_start } in self.builders {
            match unresolved_start {
                None => self.file.traffic.aircraft.push(aircraft),
                Some(place) => {
                    self.file.traffic.unplaced.push(UnplacedAircraft { place, aircraft });
                }
            }
        }
        self.file
    }

    fn execute(&mut self, command: Command) {
        let time_s = command.time_s;
        let (name, mut arguments) = self.name_and_arguments(command.words);
        count(&mut self.file.commands, name.clone());
        self.file.last_lines.insert(name.clone(), arguments.command.line);
        if is_display(&name) {
            return count(&mut self.file.ignored, name);
        }
        match self.dispatch(&name, time_s, &mut arguments) {
            Ok(CommandOutcome::Done) => {}
            Ok(CommandOutcome::NotUnderstood(what)) => count(&mut self.file.not_understood, what),
            Err(CommandError::Unparsed(error)) => self.file.unparsed.push(error),
            Err(CommandError::Refused(error)) => self.file.refused.push(error),
        }
    }

    /// Splits a command into its name and its arguments; an aircraft before the name becomes the first argument.
    fn name_and_arguments<'a>(&self, mut words: Vec<Token<'a>>) -> (String, Arguments<'a>)
    where
        'p: 'a,
    {
        let first = upper(words[0]);
        let second = words.get(1).map(|word| upper(*word));
        // An aircraft that a command without effect here has created, such as MCRE, is recognized by its command.
        let is_aircraft = self.by_id.contains_key(&first)
            || (!is_command(&first)
                && second.as_ref().is_some_and(|name| AIRCRAFT_COMMANDS.contains(&&**name)));
        let (name, command) = match (is_aircraft, second) {
            (false, _) => (first, words.remove(0)),
            (true, Some(name)) => (name, words.remove(1)),
            (true, None) => ("POS".to_string(), words[0]),
        };
        (name, Arguments::new(self.place, command, words))
    }

    fn dispatch(&mut self, name: &str, time_s: f64, arguments: &mut Arguments) -> CommandResult {
        match name {
            "CRE" | "CREATE" => self.create(time_s, arguments),
            "DEL" | "DELETE" => self.delete(time_s, arguments),
            "DEFWPT" => self.define(arguments),
            "ADDWPT" => self.add_way_point(time_s, arguments),
            "AFTER" => self.add_way_point_after(time_s, arguments),
            "ORIG" | "DEST" => self.set_endpoint(name, time_s, arguments),
            "HDG" | "HEADING" | "TURN" | "SPD" | "SPEED" | "ALT" | "VS" | "LNAV" | "VNAV" => {
                self.change(name, time_s, arguments)
            }
            "SYN" => self.synthesize(time_s, arguments),
            "ASAS" | "CDMETHOD" | "RESO" | "ZONER" | "ZONEDH" | "DTLOOK" | "NOISE" => {
                self.set(name, arguments)
            }
            "WIND" => self.add_wind(arguments),
            "" => {
                let cause = "the command has no name".to_string();
                Err(arguments.command.error(self.place, cause, "remove the comma").into())
            }
            _ => Ok(CommandOutcome::NotUnderstood(name.to_string())),
        }
    }

    /// `CRE aircraft,type,place[,heading[,altitude[,speed]]]`
    fn create(&mut self, time_s: f64, arguments: &mut Arguments) -> CommandResult {
        let id = arguments.required("an aircraft")?;
        let kind = arguments.next().map_or(String::new(), |word| word.text.to_owned());
        let place = self.place(arguments)?;
        let aircraft = ScnAircraft {
            id: upper(id),
            kind,
            created_s: time_s,
            lat_deg: place.position().map_or(0.0, |position| position.lat_deg),
            lon_deg: place.position().map_or(0.0, |position| position.lon_deg),
            heading_deg: arguments.optional(heading_deg)?.unwrap_or(0.0),
            altitude_ft: arguments.optional(altitude_ft)?.unwrap_or(0.0),
            speed: arguments.optional(speed)?.unwrap_or(Airspeed::CasKt(0.0)),
            way_points: Vec::new(),
            origin: None,
            destination: None,
            destination_s: None,
            changes: Vec::new(),
            deleted_s: None,
        };
        let unresolved_start = match &place {
            PositionRef::Unresolved(name) => Some(name.clone()),
            _ => None,
        };
        self.add_aircraft(id, AircraftBuilder { aircraft, unresolved_start })?;
        self.add_unresolved(arguments.command, Some(id.text), &place);
        Ok(CommandOutcome::Done)
    }

    /// Adds a new aircraft; errors point at `word`. An identifier may be used again once its aircraft is deleted.
    fn add_aircraft(&mut self, word: Token, builder: AircraftBuilder) -> Result<(), CommandError> {
        if self.builders.len() >= MAX_AIRCRAFT {
            let cause = format!("this is more than {MAX_AIRCRAFT} aircraft");
            return Err(self.refusal(word, cause, "create fewer"));
        }
        let id = builder.aircraft.id.clone();
        if let Some(&earlier) = self.by_id.get(&id)
            && self.builders[earlier].aircraft.deleted_s.is_none()
        {
            let cause = format!("aircraft {id} exists already");
            return Err(self.refusal(word, cause, "delete it first, or take another identifier"));
        }
        self.by_id.insert(id, self.builders.len());
        self.builders.push(builder);
        Ok(())
    }

    /// `DEL aircraft,...` or `DEL WIND`
    fn delete(&mut self, time_s: f64, arguments: &mut Arguments) -> CommandResult {
        if arguments.peek().is_some_and(|word| word.eq_ignore_ascii_case("WIND")) {
            self.file.traffic.wind.clear();
            return Ok(CommandOutcome::Done);
        }
        loop {
            let index = self.existing_aircraft(arguments)?;
            self.builders[index].aircraft.deleted_s = Some(time_s);
            if arguments.remaining() == 0 {
                return Ok(CommandOutcome::Done);
            }
        }
    }

    /// Returns the next argument, which must be an existing aircraft.
    fn existing_aircraft(&self, arguments: &mut Arguments) -> Result<usize, CommandError> {
        let word = arguments.required("an aircraft")?;
        let problem = match self.by_id.get(&upper(word)).copied() {
            Some(index) if self.builders[index].aircraft.deleted_s.is_none() => return Ok(index),
            Some(_) => "was deleted before",
            None => "was not created before",
        };
        let cause = format!("aircraft {} {problem}", word.text);
        Err(self.refusal(word, cause, "check the identifier and the times"))
    }

    /// `DEFWPT name,place`
    fn define(&mut self, arguments: &mut Arguments) -> CommandResult {
        let name = arguments.required("a name")?;
        let place = self.place(arguments)?;
        if let Some(position) = place.position() {
            self.defined.insert(upper(name), position);
        }
        self.add_unresolved(arguments.command, None, &place);
        Ok(CommandOutcome::Done)
    }

    /// `ADDWPT aircraft,place[,altitude[,speed[,after]]]`
    fn add_way_point(&mut self, time_s: f64, arguments: &mut Arguments) -> CommandResult {
        let id = arguments.peek();
        let index = self.existing_aircraft(arguments)?;
        let mode = arguments.peek().unwrap_or("").to_ascii_uppercase();
        if TURN_MODES.contains(&&*mode) {
            return Ok(CommandOutcome::Done);
        }
        let way_point = self.way_point(time_s, arguments)?;
        let after = arguments.next();
        let slot = self.route_slot(index, after, arguments.command)?;
        self.add_unresolved(arguments.command, id, &way_point.place);
        self.builders[index].aircraft.way_points.insert(slot, way_point);
        Ok(CommandOutcome::Done)
    }

    /// `AFTER aircraft,after,ADDWPT,place[,altitude[,speed]]`
    fn add_way_point_after(&mut self, time_s: f64, arguments: &mut Arguments) -> CommandResult {
        let id = arguments.peek();
        let index = self.existing_aircraft(arguments)?;
        let after = arguments.required("a way-point of the route")?;
        let variant = upper(arguments.required("ADDWPT")?);
        if variant != "ADDWPT" {
            return Ok(CommandOutcome::NotUnderstood(format!("AFTER {variant}")));
        }
        let way_point = self.way_point(time_s, arguments)?;
        let slot = self.route_slot(index, Some(after), arguments.command)?;
        self.add_unresolved(arguments.command, id, &way_point.place);
        self.builders[index].aircraft.way_points.insert(slot, way_point);
        Ok(CommandOutcome::Done)
    }

    fn way_point(&self, added_s: f64, arguments: &mut Arguments) -> Result<WayPoint, InputError> {
        Ok(WayPoint {
            place: self.place(arguments)?,
            altitude_ft: arguments.optional(altitude_ft)?,
            speed: arguments.optional(speed)?,
            added_s,
        })
    }

    /// Returns the position of a new way-point in an aircraft's route: after the last one called `after`, or at the
    /// end.
    fn route_slot(
        &self,
        index: usize,
        after: Option<Token>,
        command: Token,
    ) -> Result<usize, CommandError> {
        let route = &self.builders[index].aircraft.way_points;
        if route.len() >= MAX_WAY_POINTS {
            let cause = format!("the route has more than {MAX_WAY_POINTS} way-points");
            return Err(self.refusal(command, cause, "write fewer"));
        }
        let Some(after) = after else { return Ok(route.len()) };
        let name = upper(after);
        match route.iter().rposition(|earlier| earlier.place.name() == Some(&name)) {
            Some(earlier) => Ok(earlier + 1),
            None => {
                let cause = format!("no way-point {name} is on the route");
                Err(self.refusal(after, cause, "add that one first"))
            }
        }
    }

    /// `ORIG aircraft,place` and `DEST aircraft,place`
    fn set_endpoint(
        &mut self,
        name: &str,
        time_s: f64,
        arguments: &mut Arguments,
    ) -> CommandResult {
        let id = arguments.peek();
        let index = self.existing_aircraft(arguments)?;
        // Without a place the command is a query.
        if arguments.remaining() == 0 {
            return Ok(CommandOutcome::Done);
        }
        let place = self.place(arguments)?;
        self.add_unresolved(arguments.command, id, &place);
        let aircraft = &mut self.builders[index].aircraft;
        if name == "ORIG" {
            aircraft.origin = Some(place);
        } else {
            aircraft.destination = Some(place);
            aircraft.destination_s = Some(time_s);
        }
        Ok(CommandOutcome::Done)
    }

    /// `HDG aircraft,heading` and similar commands. Without a value they are queries and change
    /// nothing.
    fn change(&mut self, name: &str, time_s: f64, arguments: &mut Arguments) -> CommandResult {
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
        let changes = change.into_iter().chain(climb.map(AircraftCommand::VerticalSpeedFpm));
        self.builders[index].aircraft.changes.extend(changes.map(|change| (time_s, change)));
        Ok(CommandOutcome::Done)
    }

    /// `SYN SUPER n`, `SYN WALL`, `SYN MATRIX n`
    fn synthesize(&mut self, time_s: f64, arguments: &mut Arguments) -> CommandResult {
        let variant = arguments.required("SUPER, WALL or MATRIX")?;
        let spacing_nm = self.file.traffic.zone_radius_nm;
        let aircraft = match upper(variant).as_str() {
            "SUPER" => synthetic::super_conflict(self.pattern_size(arguments, 1)?, time_s),
            "WALL" => synthetic::wall(spacing_nm, time_s),
            "MATRIX" => synthetic::matrix(self.pattern_size(arguments, 4)?, spacing_nm, time_s),
            other => return Ok(CommandOutcome::NotUnderstood(format!("SYN {other}"))),
        };
        if aircraft.iter().any(|one| one.lat_deg.abs() > 90.0 || one.lon_deg.abs() > 180.0) {
            let cause = "the pattern is larger than the earth".to_string();
            return Err(self.refusal(variant, cause, "take a smaller number or a smaller ZONER"));
        }
        for aircraft in aircraft {
            self.add_aircraft(variant, AircraftBuilder { aircraft, unresolved_start: None })?;
        }
        Ok(CommandOutcome::Done)
    }

    /// Returns the size of a pattern that has `per_size` aircraft for each unit of size.
    fn pattern_size(
        &self,
        arguments: &mut Arguments,
        per_size: usize,
    ) -> Result<u32, CommandError> {
        let word = arguments.required("a number of aircraft")?;
        let size = word.integer(&self.place)?;
        if size == 0 || (size as usize).saturating_mul(per_size) > MAX_AIRCRAFT {
            let cause = format!("a pattern has 1 to {MAX_AIRCRAFT} aircraft");
            return Err(self.refusal(word, cause, "take another number"));
        }
        Ok(size)
    }

    /// A setting. Without a value it is a query and changes nothing.
    fn set(&mut self, name: &str, arguments: &mut Arguments) -> CommandResult {
        if arguments.peek().is_none() {
            return Ok(CommandOutcome::Done);
        }
        let value = arguments.required("a value")?;
        let place = self.place;
        if name == "RESO" {
            self.file.traffic.resolution = Some(self.resolution(value)?);
            return Ok(CommandOutcome::Done);
        }
        let traffic = &mut self.file.traffic;
        match name {
            "ZONER" => traffic.zone_radius_nm = zone_size(place, value, &ZONE_RADII_NM, "NM")?,
            "ZONEDH" => {
                traffic.zone_half_height_ft = zone_size(place, value, &ZONE_HALF_HEIGHTS_FT, "ft")?;
            }
            "DTLOOK" => traffic.lookahead_s = positive(place, value)?,
            "NOISE" => traffic.noise = on_off(place, value)?,
            _ if upper(value) == "STATEBASED" => traffic.detection = Some(true),
            _ => traffic.detection = Some(on_off(place, value)?),
        }
        Ok(CommandOutcome::Done)
    }

    fn resolution(&self, word: Token) -> Result<ResolutionMethod, CommandError> {
        match upper(word).as_str() {
            "OFF" => Ok(ResolutionMethod::Off),
            "MVP" => Ok(ResolutionMethod::Mvp),
            "SSD" => Ok(ResolutionMethod::Ssd),
            "EBY" => Ok(ResolutionMethod::Eby),
            other => {
                let cause = format!("no resolution method `{other}` is known");
                Err(self.refusal(word, cause, "take OFF, MVP, SSD or EBY"))
            }
        }
    }

    /// `WIND place,direction,speed`, or `WIND place` followed by `altitude,direction,speed` for
    /// each altitude, where the altitude may be left out.
    fn add_wind(&mut self, arguments: &mut Arguments) -> CommandResult {
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
                from_deg: heading_deg(self.place, from)?,
                speed_kt: number(self.place, speed)?,
            });
            if arguments.remaining() == 0 {
                break;
            }
        }
        self.add_unresolved(arguments.command, None, &place);
        if place.position().is_some() {
            self.file.traffic.wind.append(&mut winds);
        }
        Ok(CommandOutcome::Done)
    }

    /// Reads a latitude and a longitude, a defined way-point, or a name with or without a runway.
    fn place(&self, arguments: &mut Arguments) -> Result<PositionRef, InputError> {
        let next = arguments.peek().unwrap_or("").to_ascii_uppercase();
        if let Some(&position) = self.defined.get(&next) {
            arguments.next();
            return Ok(PositionRef::Defined { name: next, position });
        }
        if is_latitude(&next) {
            return Ok(PositionRef::At(arguments.lat_lon()?));
        }
        let mut name = upper(arguments.required("a place")?);
        let runway = arguments.peek().unwrap_or("").to_ascii_uppercase();
        if is_runway(&runway) {
            arguments.next();
            name = format!("{name} {runway}");
        }
        Ok(PositionRef::Unresolved(name))
    }

    /// Adds a place without a known position to the list.
    fn add_unresolved(&mut self, command: Token, aircraft: Option<&str>, place: &PositionRef) {
        if let PositionRef::Unresolved(name) = place {
            self.file.unresolved_places.push(UnresolvedPosition {
                name: name.clone(),
                command: upper(command),
                aircraft: aircraft.map(str::to_ascii_uppercase),
                line: command.line,
            });
        }
    }

    fn refusal(&self, word: Token, cause: String, remedy: &str) -> CommandError {
        CommandError::Refused(word.error(self.place, cause, remedy))
    }
}

fn upper(word: Token) -> String {
    word.text.to_ascii_uppercase()
}

fn count(counts: &mut BTreeMap<String, u64>, name: String) {
    *counts.entry(name).or_default() += 1;
}

/// Returns whether a command affects the display only: a name of the list, or zooming with `+` and `-`.
fn is_display(name: &str) -> bool {
    let is_zoom = !name.is_empty() && name.chars().all(|c| "+-=".contains(c));
    is_zoom || DISPLAY_COMMANDS.contains(&name)
}

/// Returns whether the first word is a command, not an aircraft.
fn is_command(name: &str) -> bool {
    const OTHER_COMMANDS: [&str; 12] = [
        "ASAS", "CDMETHOD", "CRE", "CREATE", "DEFWPT", "DTLOOK", "NOISE", "RESO", "SYN", "WIND",
        "ZONEDH", "ZONER",
    ];
    is_display(name) || AIRCRAFT_COMMANDS.contains(&name) || OTHER_COMMANDS.contains(&name)
}

/// `RW18L` or `RWY18L`.
fn is_runway(name: &str) -> bool {
    let number = name.strip_prefix("RWY").or_else(|| name.strip_prefix("RW"));
    number.is_some_and(|number| number.starts_with(|c: char| c.is_ascii_digit()))
}
