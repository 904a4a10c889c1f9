//! Commands about the routes of aircraft.

use super::{CommandError, CommandOutcome, CommandResult, Interpreter, refusal, upper};
use crate::bluesky::MAX_WAY_POINTS;
use crate::bluesky::traffic::WayPoint;
use crate::bluesky::values::{Arguments, altitude_ft, duration_s, speed};
use crate::report::Treatment;
use crate::table::Token;
use sidestep_kernel::InputError;

/// Modes that `ADDWPT` takes in place of a way-point. Airplanes here fly over all way-points, which is named where that
/// is not what is asked for.
const TURN_MODES: [&str; 2] = ["FLYBY", "FLYOVER"];

/// Settings of turns that `ADDWPT` takes in place of a way-point, with a value.
const TURN_SETTINGS: [&str; 11] = [
    "FLYTURN",
    "TURNRAD",
    "TURNRADIUS",
    "TURNSPD",
    "TURNSPEED",
    "TURNHDG",
    "TURNHDGR",
    "TURNHDGRATE",
    "TURNBANK",
    "TURNPHI",
    "TAKEOFF",
];

const NOT_FLOWN_YET: &str = "give ALT or SPD with a time";

/// A place in a route.
#[derive(Clone, Copy, PartialEq)]
enum RouteSide {
    Before,
    After,
}

impl Interpreter {
    /// `ADDWPT aircraft,place[,altitude[,speed[,after[,before]]]]`
    pub(super) fn add_way_point(&mut self, arguments: &mut Arguments) -> CommandResult {
        let id = arguments.peek();
        let index = self.existing_aircraft(arguments)?;
        let mode = arguments.peek().unwrap_or("").to_ascii_uppercase().replace('-', "");
        if TURN_MODES.contains(&&*mode) {
            arguments.next();
            self.builders[index].flies_over = mode == "FLYOVER";
            return Ok(CommandOutcome::Done);
        }
        if TURN_SETTINGS.contains(&&*mode) {
            let reason = "airplanes here turn at 25 degrees of bank, and start in the air";
            return Ok(CommandOutcome::NotUnderstood(format!("ADDWPT {mode}"), reason));
        }
        let way_point = self.way_point(index, arguments)?;
        let slot = match (arguments.next(), arguments.next()) {
            (Some(after), _) => self.slot_beside(index, after, arguments, RouteSide::After)?,
            (None, Some(before)) => {
                self.slot_beside(index, before, arguments, RouteSide::Before)?
            }
            (None, None) => self.builders[index].aircraft.way_points.len(),
        };
        self.insert_way_point(index, slot, way_point, (arguments, id))
    }

    /// `AFTER aircraft,after,ADDWPT,place[,altitude[,speed]]`, and `BEFORE`
    pub(super) fn add_way_point_beside(
        &mut self,
        name: &str,
        arguments: &mut Arguments,
    ) -> CommandResult {
        let id = arguments.peek();
        let index = self.existing_aircraft(arguments)?;
        let beside = arguments.required("a way-point of the route")?;
        let variant = upper(arguments.required("ADDWPT")?);
        if variant != "ADDWPT" {
            let reason = "only ADDWPT is known behind it";
            return Ok(CommandOutcome::NotUnderstood(format!("{name} {variant}"), reason));
        }
        let way_point = self.way_point(index, arguments)?;
        let side = if name == "AFTER" { RouteSide::After } else { RouteSide::Before };
        let slot = self.slot_beside(index, beside, arguments, side)?;
        self.insert_way_point(index, slot, way_point, (arguments, id))
    }

    /// Reads a way-point of an aircraft.
    fn way_point(
        &mut self,
        index: usize,
        arguments: &mut Arguments,
    ) -> Result<WayPoint, CommandError> {
        let aircraft = &self.builders[index].aircraft;
        let last = aircraft.way_points.iter().rev().find_map(|point| point.place.position());
        self.reference = last.unwrap_or_else(|| aircraft.position());
        let place = self.place(arguments)?;
        let name = place.name().unwrap_or(&self.builders[index].aircraft.id).to_string();
        let name = self.free_name(index, &name, place.name().is_none());
        Ok(WayPoint {
            name,
            place,
            altitude_ft: arguments.optional(altitude_ft)?,
            speed: arguments.optional(speed)?,
            required_s: None,
            added_s: self.now_s,
        })
    }

    /// Returns the name of a new way-point: that of its place, or the aircraft's with a number.
    fn free_name(&mut self, index: usize, name: &str, is_position: bool) -> String {
        if !is_position {
            return name.to_string();
        }
        let builder = &mut self.builders[index];
        builder.unnamed_way_points += 1;
        format!("{name}{:03}", builder.unnamed_way_points)
    }

    fn insert_way_point(
        &mut self,
        index: usize,
        slot: usize,
        way_point: WayPoint,
        (arguments, id): (&Arguments, Option<&str>),
    ) -> CommandResult {
        let route_length = self.builders[index].aircraft.way_points.len();
        if route_length >= MAX_WAY_POINTS {
            let cause = format!("the route has more than {MAX_WAY_POINTS} way-points");
            return Err(refusal(arguments, arguments.command, cause, "write fewer"));
        }
        self.add_unresolved(arguments.command, id, &way_point.place);
        let aircraft = &self.builders[index].aircraft;
        // Until now it flew to its destination.
        let precedes_all =
            route_length == 0 && aircraft.destination_s.is_some_and(|s| s < self.now_s);
        if (slot < route_length || precedes_all) && self.now_s > aircraft.created_s {
            let rule = "way-points that are put into a route on the way: the route has them from the start";
            self.note(Treatment::Guessed, rule, "");
        }
        self.note_constraints(way_point.altitude_ft.is_some(), way_point.speed.is_some());
        let place = self.place.clone();
        let builder = &mut self.builders[index];
        if !builder.flies_over {
            builder.fly_by_place.get_or_insert(place);
        }
        builder.aircraft.way_points.insert(slot, way_point);
        Ok(CommandOutcome::Done)
    }

    fn note_constraints(&mut self, has_altitude: bool, has_speed: bool) {
        if has_altitude {
            let rule = "altitudes at way-points: not flown yet";
            self.note(Treatment::NotUsed, rule, NOT_FLOWN_YET);
        }
        if has_speed {
            let rule = "speeds at way-points: not flown yet";
            self.note(Treatment::NotUsed, rule, NOT_FLOWN_YET);
        }
    }

    /// `AT aircraft,way-point,ALT|SPD,value`, `AT aircraft,way-point,altitude/speed`, or `AT .. DEL ALT|SPD|BOTH|ALL`
    pub(super) fn constrain_way_point(&mut self, arguments: &mut Arguments) -> CommandResult {
        let index = self.existing_aircraft(arguments)?;
        let slot = self.route_slot(index, arguments)?;
        let Some(what) = arguments.next() else { return Ok(CommandOutcome::Done) };
        let point = &mut self.builders[index].aircraft.way_points[slot];
        let what_name = upper(what);
        match what_name.as_str() {
            "ALT" => point.altitude_ft = arguments.optional(altitude_ft)?.or(point.altitude_ft),
            "SPD" | "SPEED" => point.speed = arguments.optional(speed)?.or(point.speed),
            "DEL" | "DELETE" | "CLR" | "CLEAR" => {
                let kind = upper(arguments.required("ALT, SPD, BOTH or ALL")?);
                if kind != "SPD" && kind != "SPEED" {
                    point.altitude_ft = None;
                }
                if kind != "ALT" {
                    point.speed = None;
                }
                return Ok(CommandOutcome::Done);
            }
            "DO" | "STACK" => {
                arguments.skip_all();
                let reason = "commands at a way-point are not flown yet";
                return Ok(CommandOutcome::NotUnderstood("AT DO".to_string(), reason));
            }
            both => set_both(point, arguments, what, both)?,
        }
        let is_speed_alone = matches!(what_name.as_str(), "SPD" | "SPEED");
        self.note_constraints(!is_speed_alone, what_name != "ALT");
        Ok(CommandOutcome::Done)
    }

    /// `RTA aircraft,way-point,time`
    pub(super) fn require_time(&mut self, arguments: &mut Arguments) -> CommandResult {
        let index = self.existing_aircraft(arguments)?;
        let slot = self.route_slot(index, arguments)?;
        let time = arguments.required("a time")?;
        let required_s = duration_s(arguments.place, time)?;
        self.builders[index].aircraft.way_points[slot].required_s = Some(required_s);
        self.note(
            Treatment::NotUsed,
            "times at way-points (RTA): not flown yet",
            "give SPD with a time",
        );
        Ok(CommandOutcome::Done)
    }

    /// Returns the place in a route of the way-point that is the next argument.
    fn route_slot(&self, index: usize, arguments: &mut Arguments) -> Result<usize, CommandError> {
        let word = arguments.required("a way-point of the route")?;
        self.find_way_point(index, word, arguments)
    }

    fn find_way_point(
        &self,
        index: usize,
        word: Token,
        arguments: &Arguments,
    ) -> Result<usize, CommandError> {
        let name = upper(word);
        let route = &self.builders[index].aircraft.way_points;
        route.iter().rposition(|earlier| earlier.name == name).ok_or_else(|| {
            let cause = format!("no way-point {name} is on the route");
            refusal(arguments, word, cause, "add that one first")
        })
    }

    /// Returns the position of a new way-point in an aircraft's route, beside the last one of a name.
    fn slot_beside(
        &self,
        index: usize,
        word: Token,
        arguments: &Arguments,
        side: RouteSide,
    ) -> Result<usize, CommandError> {
        let slot = self.find_way_point(index, word, arguments)?;
        Ok(if side == RouteSide::After { slot + 1 } else { slot })
    }

    /// `ORIG aircraft,place` and `DEST aircraft,place`
    pub(super) fn set_endpoint(&mut self, name: &str, arguments: &mut Arguments) -> CommandResult {
        let id = arguments.peek();
        let index = self.existing_aircraft(arguments)?;
        // Without a place the command is a query.
        if arguments.remaining() == 0 {
            return Ok(CommandOutcome::Done);
        }
        let place = self.place(arguments)?;
        self.add_unresolved(arguments.command, id, &place);
        if name == "ORIG" {
            self.builders[index].aircraft.origin = Some(place);
            return Ok(CommandOutcome::Done);
        }
        let aircraft = &self.builders[index].aircraft;
        let is_changed = aircraft.destination.is_some() && self.now_s > aircraft.created_s;
        if is_changed {
            let rule =
                "destinations that change on the way: the route has the last one from the start";
            self.note(Treatment::Guessed, rule, "");
        }
        self.note(
            Treatment::NotUsed,
            "descents to destinations: not flown yet",
            "give ALT with a time",
        );
        let aircraft = &mut self.builders[index].aircraft;
        aircraft.destination = Some(place);
        aircraft.destination_s = Some(self.now_s);
        Ok(CommandOutcome::Done)
    }
}

/// Sets altitude and speed of a way-point from `FL090/250`; `---` deletes one.
fn set_both(
    point: &mut WayPoint,
    arguments: &Arguments,
    word: Token,
    text: &str,
) -> Result<(), InputError> {
    let Some((altitude, knots)) = text.split_once('/') else {
        let cause = format!("`{text}` is no constraint of a way-point");
        return Err(arguments.error(word, cause, "write ALT FL100, SPD 250 or FL100/250"));
    };
    let is_deleted = |text: &str| text.contains("--");
    point.altitude_ft = if is_deleted(altitude) {
        None
    } else {
        Some(altitude_ft(arguments.place, Token { text: altitude, ..word })?)
    };
    point.speed = if is_deleted(knots) {
        None
    } else {
        Some(speed(arguments.place, Token { text: knots, ..word })?)
    };
    Ok(())
}
