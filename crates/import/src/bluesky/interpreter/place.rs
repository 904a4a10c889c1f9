//! Places in a scenario: positions, way-points of the file, tables of navigation data, and aircraft.

use super::{CommandError, CommandOutcome, CommandResult, Interpreter, refusal, upper};
use crate::bluesky::UnresolvedPosition;
use crate::bluesky::traffic::PositionRef;
use crate::bluesky::values::{Arguments, is_latitude};
use crate::local_plane::LatLon;
use crate::report::Treatment;
use crate::table::Token;

impl Interpreter {
    /// `DEFWPT name,place[,kind]`, or `DEFWPT name,DEL`
    pub(super) fn define(&mut self, arguments: &mut Arguments) -> CommandResult {
        let name = arguments.required("a name")?;
        if arguments.peek().is_some_and(is_deletion) {
            arguments.next();
            self.defined.remove(&upper(name));
            return Ok(CommandOutcome::Done);
        }
        let place = self.place(arguments)?;
        let kind = arguments.next();
        match place.position() {
            _ if kind.is_some_and(|kind| is_deletion(kind.text)) => {
                self.defined.remove(&upper(name));
            }
            Some(position) => {
                self.defined.insert(upper(name), position);
            }
            None => {}
        }
        self.add_unresolved(arguments.command, None, &place);
        Ok(CommandOutcome::Done)
    }

    /// Reads a latitude and a longitude, an aircraft, a defined way-point, or a name with or without a runway.
    pub(super) fn place(&mut self, arguments: &mut Arguments) -> Result<PositionRef, CommandError> {
        let next = arguments.peek().unwrap_or("").to_ascii_uppercase();
        if let Some(position) = self.aircraft_place(arguments, &next)? {
            return Ok(PositionRef::At(position));
        }
        if let Some(&position) = self.defined.get(&next) {
            arguments.next();
            return Ok(PositionRef::Defined { name: next, position });
        }
        if is_latitude(&next) {
            return Ok(PositionRef::At(arguments.lat_lon()?));
        }
        let mut name = upper(arguments.required("a place")?);
        let mut airport = name.split('/').next().unwrap_or_default().to_string();
        let runway = arguments.peek().unwrap_or("").to_ascii_uppercase();
        if let Some((_, runway)) = name.split_once('/') {
            self.runway_deg = runway_heading_deg(runway);
        } else if is_runway(&runway) {
            arguments.next();
            airport.clone_from(&name);
            name = format!("{name} {runway}");
            self.runway_deg = runway_heading_deg(&runway);
        }
        let Some(position) = self.navdata.find(&airport, self.reference) else {
            return Ok(PositionRef::Unresolved(name));
        };
        if airport != name {
            let rule = "runways: the place of their airport stands for them";
            self.note(Treatment::Guessed, rule, "give latitude and longitude");
        }
        Ok(PositionRef::Defined { name, position })
    }

    /// Returns the position of an aircraft that is named as a place.
    fn aircraft_place(
        &self,
        arguments: &mut Arguments,
        name: &str,
    ) -> Result<Option<LatLon>, CommandError> {
        let Some(&index) = self.by_id.get(name) else { return Ok(None) };
        if self.builders[index].aircraft.deleted_s.is_some() {
            return Ok(None);
        }
        let word = arguments.required("a place")?;
        let Some(state) = self.known_state(index) else {
            let cause = format!("the place of aircraft {name} at that time depends on its flight");
            return Err(refusal(arguments, word, cause, "give latitude and longitude"));
        };
        Ok(Some(state.position))
    }

    /// Adds a place without a known position to the list.
    pub(super) fn add_unresolved(
        &mut self,
        command: Token,
        aircraft: Option<&str>,
        place: &PositionRef,
    ) {
        if let PositionRef::Unresolved(name) = place {
            self.result.unresolved_places.push(UnresolvedPosition {
                name: name.clone(),
                command: upper(command),
                aircraft: aircraft.map(str::to_ascii_uppercase),
                line: command.line,
            });
            let rule = "places that the file does not define";
            self.note(
                Treatment::Dropped,
                rule,
                "give --navdata with the folder of a navigation database",
            );
        }
        if let Some(position) = place.position() {
            self.reference = position;
        }
    }
}

fn is_deletion(word: &str) -> bool {
    ["DEL", "DELETE"].iter().any(|name| word.eq_ignore_ascii_case(name))
}

/// `RW18L` or `RWY18L`.
fn is_runway(name: &str) -> bool {
    runway_heading_deg(name).is_some()
}

/// Returns the heading that the number of a runway stands for: 180 for `RW18L`.
fn runway_heading_deg(name: &str) -> Option<f64> {
    let number = name.strip_prefix("RWY").or_else(|| name.strip_prefix("RW"))?;
    let digits = number.trim_end_matches(|c: char| !c.is_ascii_digit());
    let number: u32 = digits.get(..digits.len().min(2))?.parse().ok()?;
    Some(f64::from(number * 10 % 360))
}
