//! The effects of the commands of a scenario.

mod aircraft;
mod calling;
mod conflict;
mod notes;
mod place;
mod reason;
mod route;
mod setting;

use super::calls::CallFolder;
use super::lines::{CommandFile, CommandText};
use super::navdata::NavigationData;
use super::schedule::Schedule;
use super::text::ScnText;
use super::traffic::{AircraftCommand, ScnAircraft, UnplacedAircraft};
use super::values::Arguments;
use super::{Airspeed, DISPLAY_RULE, ScnFile, UnusedCommand};
use crate::local_plane::LatLon;
use crate::report::{ImportReport, Treatment};
use crate::table::Token;
use reason::{canonical_name, is_aircraft_command, is_command, is_display, reason_without_effect};
use setting::SettingDefaults;
use sidestep_kernel::InputError;
use std::collections::BTreeMap;
use std::rc::Rc;
use std::sync::Arc;

/// The maximum number of rules in a report.
const MAX_RULES: usize = 500;

/// The maximum number of commands without effect that are listed one by one.
const MAX_UNUSED: usize = 100_000;

/// The result of a command.
enum CommandOutcome {
    Done,
    /// It has no effect, is counted under this name, and this is the reason.
    NotUnderstood(String, &'static str),
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
    /// The altitude that it was given last, in ft.
    last_altitude_ft: f64,
    /// Number of its way-points without a name of their own.
    unnamed_way_points: usize,
    /// Vertical speed at its creation in ft/min.
    vertical_speed_fpm: f64,
    /// Whether it is gone before any time has passed.
    is_void: bool,
    /// Whether its way-points are to be flown over from now on.
    flies_over: bool,
    /// The places where it was given a way-point that BlueSky flies by.
    fly_by_place: Option<String>,
    /// The places of its vertical speeds until it is given a level.
    vertical_speed_places: Vec<String>,
}

impl AircraftBuilder {
    /// Returns the speed that it was given last.
    fn last_speed(&self) -> Airspeed {
        let speed = |(_, command): &(f64, AircraftCommand)| match command {
            AircraftCommand::Speed(speed) => Some(*speed),
            _ => None,
        };
        self.aircraft.changes.iter().rev().find_map(speed).unwrap_or(self.aircraft.speed)
    }
}

/// Carries out commands in their order.
pub(super) struct Interpreter {
    folder: CallFolder,
    navdata: Arc<NavigationData>,
    schedule: Schedule,
    result: ScnFile,
    builders: Vec<AircraftBuilder>,
    /// The last builder with each identifier.
    by_id: BTreeMap<String, usize>,
    /// The way-points that `DEFWPT` has defined.
    defined: BTreeMap<String, LatLon>,
    /// The place from which places of the same name are told apart.
    reference: LatLon,
    /// The heading of the runway that was named last, in degrees.
    runway_deg: Option<f64>,
    /// The place of the first command that asks for MVP, unless its limits are given.
    mvp_place: Option<String>,
    has_resolution_limits: bool,
    defaults: SettingDefaults,
    /// Commands for each new aircraft (`CRECMD`).
    creation_commands: Vec<CommandText>,
    calls: u64,
    now_s: f64,
    /// The file of the present command.
    source: Rc<CommandFile>,
    /// The line of the present command.
    line: usize,
    /// The place of the present command in reports.
    place: String,
}

impl Interpreter {
    pub(super) fn new(folder: CallFolder, navdata: Arc<NavigationData>) -> Self {
        let source = CommandFile { name: String::new(), prefix: String::new(), depth: 0 };
        Self {
            folder,
            navdata,
            schedule: Schedule::default(),
            result: ScnFile::default(),
            builders: Vec::new(),
            by_id: BTreeMap::new(),
            defined: BTreeMap::new(),
            reference: LatLon { lat_deg: 0.0, lon_deg: 0.0 },
            runway_deg: None,
            mvp_place: None,
            has_resolution_limits: false,
            defaults: SettingDefaults::default(),
            creation_commands: Vec::new(),
            calls: 0,
            now_s: 0.0,
            source: Rc::new(source),
            line: 1,
            place: String::new(),
        }
    }

    /// Carries out the commands of a text, which is `name` in errors.
    pub(super) fn run(mut self, name: &str, text: &ScnText) -> ScnFile {
        self.result.report = ImportReport::new("BlueSky scenario (.scn)");
        let file = CommandFile { name: name.to_string(), prefix: String::new(), depth: 0 };
        self.add_file(Rc::new(file), text, &[], 0.0);
        while let Some(command) = self.schedule.next() {
            self.execute(&command);
        }
        self.finish()
    }

    fn finish(mut self) -> ScnFile {
        self.note_differences();
        self.result.unparsed.sort_by_key(InputError::line_and_column);
        for builder in self.builders.into_iter().filter(|builder| !builder.is_void) {
            let AircraftBuilder { aircraft, unresolved_start, .. } = builder;
            match unresolved_start {
                None => self.result.traffic.aircraft.push(aircraft),
                Some(place) => {
                    self.result.traffic.unplaced.push(UnplacedAircraft { place, aircraft });
                }
            }
        }
        let file = &mut self.result;
        add_facts(&mut file.report, &file.traffic.aircraft);
        file.report.add_kept("command lines", file.command_lines as usize);
        file.report.add_kept("aircraft", file.traffic.aircraft.len());
        if file.short_lines > 0 {
            let rule = format!("{} lines of fewer than 10 characters", file.short_lines);
            file.report.record(Treatment::NotUsed, rule, "", "the simulator skips them as well");
        }
        self.result
    }

    fn execute(&mut self, command: &CommandText) {
        self.now_s = command.time_s;
        self.source = Rc::clone(&command.file);
        self.line = command.line();
        self.place = command.place();
        let source = Rc::clone(&command.file);
        let (name, mut arguments) = self.name_and_arguments(&source.name, command.words());
        count(&mut self.result.commands, name.clone());
        if is_display(&name) {
            self.note_unused(&name, "it changes or asks a display only");
            self.note(Treatment::NotUsed, DISPLAY_RULE, "");
            return count(&mut self.result.ignored, name);
        }
        match self.dispatch(&name, command, &mut arguments) {
            Ok(CommandOutcome::Done) => self.note_further_arguments(&name, &arguments),
            Ok(CommandOutcome::NotUnderstood(what, reason)) => {
                self.note_unused(&name, reason);
                self.note(Treatment::NotUsed, &format!("{what}: {reason}"), "");
                count(&mut self.result.not_understood, what);
            }
            Err(CommandError::Unparsed(error)) => {
                self.note_unused(&name, error.cause());
                self.note(Treatment::Dropped, "commands that cannot be read", "see each error");
                self.result.unparsed.push(error);
            }
            Err(CommandError::Refused(error)) => {
                self.note_unused(&name, error.cause());
                self.note(
                    Treatment::Dropped,
                    "commands that cannot be carried out",
                    "see each error",
                );
                self.result.refused.push(error);
            }
        }
    }

    /// Splits a command into its name and its arguments; an aircraft before the name becomes the first argument.
    fn name_and_arguments<'a>(
        &self,
        place: &'a dyn std::fmt::Display,
        mut words: Vec<Token<'a>>,
    ) -> (String, Arguments<'a>) {
        let first = upper(words[0]);
        let second = words.get(1).map(|word| upper(*word));
        // An aircraft that a command without effect here has created, such as MCRE, is recognized by its command.
        let is_aircraft = self.by_id.contains_key(&first)
            || (!is_command(&first)
                && second.as_ref().is_some_and(|name| is_aircraft_command(name)));
        let (name, command) = match (is_aircraft, second) {
            (false, _) => (first, words.remove(0)),
            (true, Some(name)) => (name, words.remove(1)),
            (true, None) => ("POS".to_string(), words[0]),
        };
        (name, Arguments::new(place, command, words))
    }

    fn dispatch(
        &mut self,
        name: &str,
        command: &CommandText,
        arguments: &mut Arguments,
    ) -> CommandResult {
        match canonical_name(name) {
            "CRE" => self.create(arguments),
            "CRECMD" => self.add_creation_command(command, arguments),
            "CLRCRECMD" => self.clear_creation_commands(),
            "CRECONFS" => self.create_conflict(arguments),
            "DEL" => self.delete(arguments),
            "DEFWPT" => self.define(arguments),
            "ADDWPT" => self.add_way_point(arguments),
            "AFTER" | "BEFORE" => self.add_way_point_beside(name, arguments),
            "AT" => self.constrain_way_point(arguments),
            "RTA" => self.require_time(arguments),
            "ORIG" | "DEST" => self.set_endpoint(name, arguments),
            "HDG" | "SPD" | "ALT" | "VS" | "LNAV" | "VNAV" => self.change(arguments, name),
            "SYN" => self.synthesize(arguments),
            "ZONER" | "ZONEDH" => self.set_zone(arguments, name),
            "NORESO" | "RESOOFF" => self.toggle_avoidance(arguments, name),
            "ASAS" | "CDMETHOD" | "RESO" | "DTLOOK" | "NOISE" | "RFACH" | "RFACV" | "RMETHH"
            | "RMETHV" | "PRIORULES" => self.set(arguments, name),
            "WIND" => self.add_wind(arguments),
            "PCALL" => self.call(arguments),
            "IC" => self.load(arguments),
            "SCHEDULE" | "DELAY" => self.schedule_command(command, arguments, name),
            "RESET" => self.reset(),
            "QUIT" => self.quit(),
            "" => {
                let cause = "the command has no name".to_string();
                Err(arguments.error(arguments.command, cause, "remove the comma").into())
            }
            _ => Ok(CommandOutcome::NotUnderstood(name.to_string(), reason_without_effect(name))),
        }
    }

    /// Adds a finding at the present command.
    fn note(&mut self, treatment: Treatment, rule: &str, remedy: &str) {
        let place = self.place.clone();
        let report = &mut self.result.report;
        // Each rule is looked for among all, and names in a file are of any number.
        let is_full = report.findings.len() >= MAX_RULES;
        if is_full && !report.findings.iter().any(|found| found.rule == rule) {
            return report.record(treatment, "further commands without effect", place, "");
        }
        report.record(treatment, rule, place, remedy);
    }

    /// Lists the present command as one without effect.
    fn note_unused(&mut self, name: &str, reason: &str) {
        if self.result.unused.len() >= MAX_UNUSED {
            return;
        }
        let one = UnusedCommand {
            place: self.place.clone(),
            command: name.to_string(),
            reason: reason.to_string(),
        };
        self.result.unused.push(one);
    }

    /// Names the arguments that a command has not read.
    fn note_further_arguments(&mut self, name: &str, arguments: &Arguments) {
        if arguments.has_further() {
            let rule = format!("further arguments of {name}");
            self.note(Treatment::NotUsed, &rule, "leave them out");
        }
    }
}

/// Adds the extent of the aircraft's starts in space and time.
fn add_facts(report: &mut ImportReport, aircraft: &[ScnAircraft]) {
    let bounds = |number: fn(&ScnAircraft) -> f64| {
        let numbers = || aircraft.iter().map(number);
        [numbers().fold(f64::INFINITY, f64::min), numbers().fold(f64::NEG_INFINITY, f64::max)]
    };
    if aircraft.is_empty() {
        return;
    }
    let [south, north] = bounds(|one| one.lat_deg);
    let [west, east] = bounds(|one| one.lon_deg);
    let [first_s, last_s] = bounds(|one| one.created_s);
    report.add_fact("units", "degrees, feet, knots, nautical miles");
    report.add_fact("starts", format!("latitude {south} to {north}, longitude {west} to {east}"));
    report.add_fact("created", format!("{first_s} to {last_s} s"));
}

fn upper(word: Token) -> String {
    word.text.to_ascii_uppercase()
}

fn count(counts: &mut BTreeMap<String, u64>, name: String) {
    *counts.entry(name).or_default() += 1;
}

fn refusal(arguments: &Arguments, word: Token, cause: String, remedy: &str) -> CommandError {
    CommandError::Refused(arguments.error(word, cause, remedy))
}
