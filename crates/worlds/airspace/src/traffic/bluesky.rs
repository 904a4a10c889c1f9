//! Conversion of BlueSky `.scn` files to scenarios.
//!
//! Aircraft fly their routes, and follow the commands on the way (`HDG`, `SPD`, `ALT`, `LNAV ON`, `DEL`). One without a
//! destination flies half an hour ahead, and one that is created without a speed enters when it gets one. In a climb the
//! calibrated airspeed or the Mach number stays, so the true one changes with the level. Settings are rules of the scenario or refused by name
//! (`import_settings.rs`); `not_flown` counts all other commands.

use super::flyable_aircraft::{
    FlyableScnAircraft, aircraft_at_flying_speed, commands_from_changes,
};
use super::import_settings::{
    ImportedChange, ImportedRules, ImportedScenarioSettings, ImportedWind, import_settings,
};
use super::imported_types::{ClipCounts, ClippedFlight, ImportedTypes, TypedFlight};
use super::position::{origin_text, path_of_heading, position_text, positions_text};
use super::scn_flight::FlightCommand;
use super::{
    DT_S, FOOT_M, LOOK_EVERY_S, MVP_LOOK_AHEAD_S, NAUTICAL_MILE_M, UNROUTED_FLIGHT_S,
    banked_turn_deg_s, callsign, header_text,
};
use crate::flight::SeparationMinima;
use crate::settings::RightOfWayRule;
use sidestep_import::bluesky::{AircraftCommand, AircraftSetting, ScnAircraft, ScnFile};
use sidestep_import::local_plane::{LatLon, LocalPlane};
use sidestep_kernel::{InputError, math};
use std::collections::BTreeMap;
use std::fmt::Write;

/// Returns the scenario of a BlueSky file; `None` when none of its aircraft has a position and a speed.
pub fn from_bluesky(name: &str, file: &ScnFile) -> Option<String> {
    Some(from_bluesky_with_types(name, file, &ImportedTypes::default())?.text)
}

/// A BlueSky file as a scenario.
pub(crate) struct BlueskyScenario {
    pub(crate) text: String,
    /// Commands beyond what a type can fly.
    pub(crate) clipped: ClipCounts,
}

/// Returns the scenario of a BlueSky file, with types of aircraft.
pub(crate) fn from_bluesky_with_types(
    name: &str,
    file: &ScnFile,
    types: &ImportedTypes,
) -> Option<BlueskyScenario> {
    let settings = &settings_from_bluesky(name, file);
    let aircraft: Vec<FlyableScnAircraft> =
        file.traffic.aircraft.iter().filter_map(aircraft_at_flying_speed).collect();
    let origin = origin_text(aircraft.iter().map(|one| one.0.position()))?;
    let start = &settings.start;
    let zone = SeparationMinima { gap_m: start.separation_m, vertical_m: start.vertical_m };
    let more = settings_text(settings) + &types.folder_text() + &origin;
    // A prediction reaches as far as one decision at least.
    let horizon_s = start.look_ahead_s.map(|s| s.max(DT_S));
    let mut text = header_text(name, zone, horizon_s, &more);
    let context = FlightContext { ends_s: file.traffic.ends_s, winds: &settings.winds, types };
    let mut clipped = ClipCounts::default();
    for one in &aircraft {
        clipped.add(write_aircraft(&mut text, &one.0, context));
    }
    Some(BlueskyScenario { text, clipped })
}

/// Returns the rules of a BlueSky file, which is `place` in errors, and all aircraft that cannot
/// fly among them.
pub(crate) fn settings_from_bluesky(place: &str, file: &ScnFile) -> ImportedScenarioSettings {
    let mut settings = import_settings(file);
    let never_moving =
        file.traffic.aircraft.iter().filter(|one| aircraft_at_flying_speed(one).is_none());
    for ScnAircraft { id, .. } in never_moving {
        let cause = format!("aircraft {id} is never given a speed, and is left out");
        let error =
            InputError::new(place, cause, "give it one with CRE or SPD before it is deleted");
        settings.refused.push(error);
    }
    settings
}

/// Returns the settings of a scenario that follow from those of a file.
fn settings_text(settings: &ImportedScenarioSettings) -> String {
    let start = &settings.start;
    let mut text = String::new();
    // Writing to a string cannot fail.
    if let Some(method) = start.method {
        let _ = writeln!(text, "method = {method:?}");
    }
    // BlueSky's own method looks as far ahead as the predictions of others, wherever it is chosen.
    let look_ahead_s = start.look_ahead_s.or(Some(MVP_LOOK_AHEAD_S));
    let mvp = ImportedRules { look_ahead_s, ..start.clone() }.mvp_text();
    let _ = writeln!(text, "mvp = {{ {mvp} }}");
    if start.is_bare {
        text.push_str("shield = \"off\"\n");
    }
    let right_of_way = start.right_of_way.unwrap_or_default();
    if right_of_way != RightOfWayRule::None {
        let _ = writeln!(text, "right_of_way = {:?}", right_of_way.name());
    }
    if let Some(wind) = &start.wind {
        let _ = writeln!(text, "{}", wind.key_text());
    }
    if !settings.changes.is_empty() {
        text.push_str("changes = [\n");
        for ImportedChange { at_s, text: keys } in &settings.changes {
            let _ = writeln!(text, "  {{ at_s = {at_s:?}{keys} }},");
        }
        text.push_str("]\n");
    }
    text
}

/// Returns the commands of a BlueSky file that the scenario leaves out, with counts.
pub(crate) fn omitted_commands(file: &ScnFile) -> BTreeMap<String, u64> {
    let mut counts = BTreeMap::new();
    let mut count = |what: &str, n: usize| {
        if n > 0 {
            *counts.entry(what.to_string()).or_default() += n as u64;
        }
    };
    for aircraft in &file.traffic.aircraft {
        let points = &aircraft.way_points;
        count("ADDWPT altitude", points.iter().filter(|p| p.altitude_ft.is_some()).count());
        count("ADDWPT speed", points.iter().filter(|p| p.speed.is_some()).count());
        let given = |is: fn(&AircraftCommand) -> bool| {
            aircraft.changes.iter().filter(|(_, command)| is(command)).count()
        };
        count("VNAV", given(|c| matches!(c, AircraftCommand::VerticalNavigation(_))));
        count("LNAV OFF", given(|c| matches!(c, AircraftCommand::LateralNavigation(false))));
        // Without a change of level, a vertical speed has no effect.
        if given(|c| matches!(c, AircraftCommand::AltitudeFt(_))) == 0 {
            count("VS", given(|c| matches!(c, AircraftCommand::VerticalSpeedFpm(_))));
        }
    }
    counts
}

/// What all aircraft of a file have in common.
#[derive(Clone, Copy)]
struct FlightContext<'a> {
    /// Time at which the file ends the simulation, and all leave.
    ends_s: Option<f64>,
    /// The winds, each from its time on.
    winds: &'a [(f64, ImportedWind)],
    types: &'a ImportedTypes,
}

/// Writes an aircraft, and returns how often its commands were beyond what its type can fly.
fn write_aircraft(
    text: &mut String,
    aircraft: &ScnAircraft,
    context: FlightContext<'_>,
) -> ClipCounts {
    let at_deg = position_text(aircraft.position());
    let heading_deg = 90.0 - aircraft.heading_deg;
    let mut v_m_s = aircraft.speed.true_airspeed_mps(aircraft.altitude_ft);
    let mut altitude_m = aircraft.altitude_ft * FOOT_M;
    let mut way_points: Vec<LatLon> = aircraft.known_goals().collect();
    let mut orders = flight_commands(aircraft, !way_points.is_empty(), context.winds);
    if let Some(ends_s) = context.ends_s {
        orders.retain(|(at_s, _)| *at_s < ends_s);
        orders.push((ends_s, FlightCommand::Leave));
    }
    let flight = TypedFlight { v_m_s, altitude_m, orders: orders.clone() };
    let typed = context.types.clipped(&aircraft.kind, flight);
    let mut counts = ClipCounts::default();
    if let Some(clipped) = &typed {
        TypedFlight { v_m_s, altitude_m, orders } = clipped.flight.clone();
        counts = clipped.counts;
    }
    if way_points.is_empty() {
        way_points =
            path_of_heading(aircraft.position(), aircraft.heading_deg, v_m_s, UNROUTED_FLIGHT_S);
    }
    if !is_routed_late(aircraft) && is_first_passed_at_start(aircraft, &way_points) {
        // A leg without a length has nothing abeam of it: the aircraft flies there, wherever it is.
        way_points.insert(0, way_points[0]);
    }
    let way_points_deg = positions_text(&way_points);
    let ordered_m_s = orders.iter().filter_map(|(_, command)| match command {
        FlightCommand::Speed(v_m_s) => Some(*v_m_s),
        _ => None,
    });
    let omega_deg_s = banked_turn_deg_s(ordered_m_s.fold(v_m_s, f64::max));
    let appears_s = aircraft.created_s;
    // Writing to a string cannot fail.
    let _ = write!(
        text,
        "\n[[airplanes]]\n{}at_deg = [{at_deg}]\nheading_deg = {heading_deg:?}\n\
         way_points_deg = {way_points_deg}\naltitude_m = {altitude_m:?}\n\
         appears_s = {appears_s:?}\nv_m_s = {v_m_s:?}\n",
        callsign(&aircraft.id)
    );
    if typed.is_some() {
        ClippedFlight::write_type(text, &aircraft.kind);
    } else {
        let _ = writeln!(text, "omega_max_deg_s = {omega_deg_s:?}");
    }
    write_own_settings(text, aircraft);
    if orders.is_empty() {
        return counts;
    }
    text.push_str("orders = [\n");
    for (at_s, command) in orders {
        let _ = writeln!(text, "  {{ at_s = {at_s:?}, {} }},", command.text());
    }
    text.push_str("]\n");
    counts
}

/// Returns whether an aircraft has its first way-point behind it where it is created, and beside the leg that leads on:
/// without the leg that leads to it, it would count as passed abeam. In BlueSky the leg to the first one begins where the
/// aircraft is, and it flies back.
fn is_first_passed_at_start(aircraft: &ScnAircraft, way_points: &[LatLon]) -> bool {
    let [first, second, ..] = way_points else { return false };
    let [east_m, north_m] = LocalPlane::centered_at(aircraft.position()).to_plane_m(*first);
    let (sin, cos) = math::sin_cos(aircraft.heading_deg.to_radians());
    let leg_m = LocalPlane::centered_at(*first).to_plane_m(*second);
    let from_first_m = LocalPlane::centered_at(*first).to_plane_m(aircraft.position());
    let is_beyond = from_first_m[0] * leg_m[0] + from_first_m[1] * leg_m[1] > 0.0;
    is_beyond && east_m * sin + north_m * cos <= 0.0
}

/// Returns whether an aircraft has a route, and is given it after its creation, at a place that is not known beforehand.
fn is_routed_late(aircraft: &ScnAircraft) -> bool {
    let first_s = route_command_times_s(aircraft).first().copied();
    first_s.is_some_and(|first_s| first_s > aircraft.created_s + LOOK_EVERY_S)
}

/// Writes the settings of its own that an aircraft has from the start.
fn write_own_settings(text: &mut String, aircraft: &ScnAircraft) {
    let mut radius_nm = None;
    let mut avoids = true;
    for &(at_s, setting) in &aircraft.settings {
        match setting {
            _ if at_s > aircraft.created_s => {}
            AircraftSetting::ZoneRadiusNm(nm) => radius_nm = Some(nm),
            AircraftSetting::Avoids(is_on) => avoids = is_on,
        }
    }
    // Writing to a string cannot fail.
    if let Some(nm) = radius_nm {
        let _ = writeln!(text, "separation_m = {:?}", nm * NAUTICAL_MILE_M);
    }
    if !avoids {
        text.push_str("non_cooperative = true\n");
    }
}

/// Returns the commands to an aircraft in flight, by rising time.
fn flight_commands(
    aircraft: &ScnAircraft,
    has_route: bool,
    winds: &[(f64, ImportedWind)],
) -> Vec<(f64, FlightCommand)> {
    let mut orders: Vec<(f64, FlightCommand)> = Vec::new();
    let mut routed_s: Vec<f64> = route_command_times_s(aircraft);
    // A path along the heading is one over the ground, from which a wind would drive an aircraft off.
    let drifts = !has_route && !winds.is_empty();
    if drifts || (has_route && is_routed_late(aircraft)) {
        orders.push((aircraft.created_s, FlightCommand::Heading(90.0 - aircraft.heading_deg)));
    }
    routed_s.retain(|at_s| has_route && *at_s > aircraft.created_s);
    let last_routed_s = routed_s.last().copied();
    // An aircraft that gets a way-point flies there, regardless of earlier headings.
    orders.extend(routed_s.into_iter().map(|at_s| (at_s, FlightCommand::Proceed)));
    orders.extend(commands_from_changes(aircraft, has_route));
    orders.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut keeps_heading = false;
    // Proceeding changes nothing for an airplane that is already doing so.
    orders.retain(|(_, command)| match command {
        FlightCommand::Heading(_) => {
            keeps_heading = true;
            true
        }
        FlightCommand::Proceed => std::mem::take(&mut keeps_heading),
        _ => true,
    });
    // The speeds of a climb are none of the file's commands.
    let changed_s = aircraft.changes.iter().map(|(at_s, _)| *at_s);
    let last_s = changed_s.chain(last_routed_s).fold(aircraft.created_s, f64::max);
    turn_headings_to_tracks(&mut orders, aircraft, winds);
    let ends_s = aircraft.deleted_s.or(keeps_heading.then_some(last_s + UNROUTED_FLIGHT_S));
    if let Some(ends_s) = ends_s {
        orders.retain(|(at_s, _)| *at_s < ends_s);
        orders.push((ends_s, FlightCommand::Leave));
    }
    orders
}

/// Turns headings to the tracks over the ground on which they lead at the time of their command: here, as in BlueSky, an
/// airplane that is given a direction keeps its track in a wind.
fn turn_headings_to_tracks(
    orders: &mut [(f64, FlightCommand)],
    aircraft: &ScnAircraft,
    winds: &[(f64, ImportedWind)],
) {
    let mut v_m_s = aircraft.speed.true_airspeed_mps(aircraft.altitude_ft);
    let mut level_m = aircraft.altitude_ft * FOOT_M;
    for (at_s, command) in orders {
        match command {
            FlightCommand::Speed(new_m_s) => v_m_s = *new_m_s,
            // It flies most of the way to its next command on the level that it is sent to.
            FlightCommand::Altitude(altitude_m, _) => level_m = *altitude_m,
            FlightCommand::Heading(deg) => {
                let blowing = winds.iter().rfind(|(from_s, _)| from_s <= at_s);
                let wind_m_s = blowing.map(|(_, wind)| wind.at_altitude_m_s(level_m));
                if let Some([east_m_s, north_m_s]) = wind_m_s.filter(|wind| *wind != [0.0; 2]) {
                    let (sin, cos) = math::sin_cos(deg.to_radians());
                    let track_rad = math::atan2(v_m_s * sin + north_m_s, v_m_s * cos + east_m_s);
                    *deg = track_rad.to_degrees();
                }
            }
            _ => {}
        }
    }
}

/// Returns the times of an aircraft's commands about where to go, rising.
fn route_command_times_s(aircraft: &ScnAircraft) -> Vec<f64> {
    let known = aircraft.way_points.iter().filter(|p| p.place.position().is_some());
    let destination = aircraft.destination.as_ref().filter(|place| place.position().is_some());
    let destination_s = destination.and(aircraft.destination_s);
    let mut all: Vec<f64> = known.map(|p| p.added_s).chain(destination_s).collect();
    all.sort_by(f64::total_cmp);
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::airspace_run;
    use crate::scenario::CompiledAirspace;
    use sidestep_import::bluesky::parse;
    use sidestep_kernel::Simulation;
    use sidestep_scenario::Source;

    #[test]
    fn two_head_on_aircraft_of_a_bluesky_file_pass_each_other() {
        let file = parse(
            &"two.scn",
            "00:00:00.00>CRE A1,B744,0,-0.4,90,FL200,250\n\
             00:00:00.00>CRE B2,B744,0,0.4,270,FL200,250\n\
             00:00:00.00>CRE C3,B744,0.01,0.0,180,FL300,250\n\
             00:00:00.00>DEST A1 0,0.4\n00:00:00.00>DEST B2 0,-0.4\n",
        );
        let text = from_bluesky("two", &file).expect("it has aircraft");
        let mut run = airspace_run(&Source::new("two", text, ""), 1).expect("valid");
        assert_eq!(run.agent_count(), 3);
        run.advance(200);
        let metrics = run.metrics();
        assert_eq!(metrics.losses_of_separation, 0);
        assert!(metrics.min_separation_m.is_some_and(|d| d < 20_000.0), "they have met");
    }

    fn compiled(commands: &str) -> CompiledAirspace {
        let line = |command: &str| format!("00:00:00.00>{command}\n");
        let text: String = commands.lines().map(line).collect();
        let text = from_bluesky("bluesky", &parse(&"bluesky.scn", &text)).expect("it has aircraft");
        CompiledAirspace::new(&Source::new("bluesky", text, "")).expect("a scenario")
    }

    #[test]
    fn the_method_that_flies_looks_as_far_ahead_as_the_file_says_and_check_tells_it() {
        let flights = "CRE A1,B744,0,-0.4,90,FL200,250\nCRE B2,B744,0,0.4,270,FL200,250\n";
        for (settings, s) in [
            ("RESO MVP\nDTLOOK 60", 60.0),
            ("RESO MVP\nDTLOOK 1200", 1200.0),
            ("RESO MVP", 300.0),
            ("DTLOOK 120", 120.0),
            ("", 300.0),
        ] {
            let compiled = compiled(&format!("{flights}{settings}"));
            assert_eq!(compiled.world.reactive_settings().look_ahead_s, s, "{settings}");
            // In BlueSky a conflict is found with the zone itself, and moved out of 1.01 of it.
            let factors = if settings.contains("MVP") { (1.0, 1.01) } else { (1.05, 1.05) };
            let mvp = compiled.world.mvp;
            assert_eq!((mvp.margin, mvp.resolution_factor), factors, "{settings}");
            let contents = crate::text::describe_scenario(&compiled).text;
            let looks = match settings.contains("MVP") {
                true => format!("decides every 1 s, looks {s} s ahead, anew every 1 s"),
                false => format!("decides every 10 s, looks {s} s ahead\n"),
            };
            assert!(contents.contains(&looks), "{contents}");
        }
        // MVP that is chosen by `--set` instead of the file looks as far; ORCA as far as its authors do, or less.
        for (settings, mvp_s, orca_s) in
            [("DTLOOK 120", 120.0, 120.0), ("", 300.0, 150.0), ("RESO MVP", 300.0, 150.0)]
        {
            let world = compiled(&format!("{flights}{settings}")).world;
            assert_eq!([world.mvp.look_ahead_s, world.orca.look_ahead_s], [mvp_s, orca_s]);
        }
    }

    /// With the 45 s that airplanes of the paper look ahead, airliners lose separation here.
    #[test]
    fn imported_flights_keep_apart_by_orca_or_bands_alone() {
        let flights = [
            ("00:00", "NOR01,A320,52.7,4.0,180", "51.3,4.0"),
            ("00:00", "SOU02,B738,51.3,4.0,0", "52.7,4.0"),
            ("00:00", "WES03,A320,52.0,2.9,90", "52.0,5.1"),
            ("00:00", "EAS04,B738,52.0,5.1,270", "52.0,2.9"),
            ("00:30", "LAT06,A320,51.5,3.2,45", "52.5,4.8"),
        ];
        let lines = flights.map(|(time, flight, goal)| {
            let name = &flight[..5];
            format!("00:{time}>CRE {flight},FL300,270\n00:{time}>ADDWPT {name},{goal}\n")
        });
        let text = from_bluesky("five", &parse(&"five.scn", &lines.concat()));
        let source = Source::new("five", text.expect("it has aircraft"), "");
        for method in ["orca", "bands"] {
            let set = [format!("airspace.method={method:?}"), "airspace.shield=\"off\"".into()];
            let source = source.clone().with_overrides(&set).expect("known keys");
            let mut run = airspace_run(&source, 1).expect("a scenario");
            run.advance(run.config().cycles);
            let metrics = run.metrics();
            assert_eq!((metrics.losses_of_separation, metrics.arrived), (0, 5), "{method}");
        }
    }

    /// Losses of separation, and the nearest approach in meters, of two that meet head on after 7 minutes.
    fn head_on(more: &str) -> (u64, f64) {
        let text = "00:00:00>CRE AAA1,A320,52.0,4.0,090,FL300,270\n\
                    00:00:00>CRE BBB2,A320,52.0,5.5,270,FL300,270\n";
        let text = from_bluesky("ho", &parse(&"ho.scn", &format!("{text}{more}")));
        let source = Source::new("ho", text.expect("it has aircraft"), "");
        let mut run = airspace_run(&source, 1).expect("a scenario");
        // A run may be split anywhere.
        run.advance(30);
        let mut resumed = airspace_run(&source, 1).expect("a scenario");
        resumed.restore(&run.checkpoint()).expect("its own checkpoint");
        resumed.advance(370);
        let metrics = resumed.metrics();
        (metrics.losses_of_separation, metrics.min_separation_m.expect("they meet"))
    }

    #[test]
    fn imported_mvp_looks_every_second_and_comes_as_near_as_in_bluesky() {
        // BlueSky 1.1.1: 9,612 m. The shield keeps a margin, and MVP one of 5 %.
        let (losses, nearest_m) = head_on("00:00:00>ASAS ON\n00:00:00>RESO MVP\n");
        assert!(losses == 0 && nearest_m < 12_000.0, "{losses} {nearest_m}");
    }

    #[test]
    fn a_method_flies_from_its_time_until_another_one() {
        for (more, loses) in [
            ("00:00:00>RESO MVP\n02:00:00>ASAS OFF\n", false),
            ("00:00:00>RESO MVP\n00:01:00>RESO OFF\n", true),
            ("00:01:00>RESO MVP\n", false),
            ("00:00:00>ASAS ON\n00:06:00>RESO MVP\n", true),
            ("00:00:00>RESO OFF\n", true),
            ("00:00:00>RESO MVP\n00:00:10>RESOOFF AAA1\n00:00:10>RESOOFF BBB2\n", true),
            ("00:00:00>RESO MVP\n00:00:00>RESOOFF AAA1\n", false),
        ] {
            let (losses, nearest_m) = head_on(more);
            assert_eq!(losses > 0, loses, "{more}: {nearest_m} m");
        }
    }

    #[test]
    fn a_zone_of_one_aircraft_is_its_own_and_one_for_all_holds_from_its_time_on() {
        let flights =
            "00:00:00>CRE A1,B744,0,-0.4,90,FL200,250\n00:00:00>CRE B2,B744,0,0.4,270,FL200,250\n";
        let of = |settings: &str| {
            let text = from_bluesky("z", &parse(&"z.scn", &format!("{flights}{settings}")));
            let source = Source::new("z", text.expect("it has aircraft"), "");
            CompiledAirspace::new(&source).expect("a scenario").world
        };
        let zones = |world: &crate::world::AirspaceWorld| {
            [0, 1].map(|i: usize| world.airplanes[i].model.separation_m)
        };
        assert_eq!(zones(&of("00:00:00>ZONER 3 B2\n")), [9260.0, 5556.0]);
        let world = of("00:00:00>ZONER 3 B2\n00:00:00>RESO MVP\n00:02:00>ZONER 2 A1\n");
        assert_eq!(zones(world.with_rules_of(119)), [9260.0, 5556.0]);
        assert_eq!(zones(world.with_rules_of(120)), [3704.0, 5556.0]);
        let world =
            of("00:00:00>RESO MVP\n00:02:00>ZONER 2;ZONEDH 500\n00:03:00>WIND 0,0,,270,36\n");
        assert_eq!(zones(world.with_rules_of(119)), [9260.0, 9260.0]);
        let later = world.with_rules_of(200);
        assert_eq!((zones(later), later.vertical_m.round()), ([3704.0, 3704.0], 152.0));
        assert_eq!((later.wind_m_s[0].round(), world.wind_m_s), (19.0, [0.0, 0.0]));
    }

    #[test]
    fn a_wind_drives_off_an_aircraft_that_keeps_a_heading_as_in_bluesky() {
        let text = "00:00:00>WIND 52 4 20000 270 50\n00:00:00>CRE A1 B744 52 4 0 FL200 250\n\
                    00:01:00>A1 HDG 45\n";
        let text = from_bluesky("w", &parse(&"w.scn", text)).expect("it has aircraft");
        let method = ["airspace.method=\"none\"".to_string()];
        let source = Source::new("w", text, "").with_overrides(&method).expect("a method");
        let mut run = airspace_run(&source, 1).expect("a scenario");
        run.advance((300.0 / run.world().timing.dt_s) as u64);
        let [lon_rad, lat_rad] = run.state().airplanes[0].pose().at;
        // Where it is in BlueSky 1.1.1 after 300 s.
        let off_deg = [lat_rad.to_degrees() - 52.3657, lon_rad.to_degrees() - 4.5197];
        assert!(off_deg.iter().all(|deg| deg.abs() < 0.005), "{off_deg:?}");
    }

    /// In BlueSky the leg to the first way-point begins where the aircraft is created.
    #[test]
    fn a_first_way_point_behind_an_aircraft_is_flown_back_to_as_in_bluesky() {
        for (first, is_behind) in [("52,3.5", true), ("52,4.5", false)] {
            let text = format!(
                "00:00:00>CRE A1,A320,52,4,90,FL300,270\n00:00:00>ADDWPT A1,{first}\n\
                 00:00:00>ADDWPT A1,52,6\n"
            );
            let text = from_bluesky("b", &parse(&"b.scn", &text)).expect("it has aircraft");
            let method = ["airspace.method=\"none\"".to_string()];
            let source = Source::new("b", text, "").with_overrides(&method).expect("a method");
            let mut run = airspace_run(&source, 1).expect("a scenario");
            let mut west_deg = f64::INFINITY;
            for _ in 0..40 {
                run.advance(10);
                let lon_rad = run.state().airplanes[0].pose().at[0];
                west_deg = west_deg.min(lon_rad.to_degrees());
            }
            assert_eq!(west_deg < 3.6, is_behind, "{first}: {west_deg}");
        }
    }

    #[test]
    fn all_leave_where_the_file_ends_the_simulation() {
        let text = "00:00:00>CRE A1,A320,52,4,90,FL300,270\n00:01:00>QUIT NOW\n";
        let text = from_bluesky("q", &parse(&"q.scn", text)).expect("it has aircraft");
        let mut run = airspace_run(&Source::new("q", text, ""), 1).expect("a scenario");
        run.advance(200);
        assert_eq!((run.metrics().left, run.cycle()), (1, 7));
    }

    #[test]
    fn an_imported_flight_that_begins_late_in_a_long_day_is_flown_to_its_end() {
        let short = compiled("CRE A1,A320,52,4,90,FL300,270");
        let thrice_ahead = 530..=540;
        assert!(thrice_ahead.contains(&short.cycles), "{}", short.cycles);
        let text = "00:00:00.00>CRE A1,A320,52.0,4.0,90,FL300,270\n\
                    13:00:00.00>CRE B2,A320,52.0,5.0,90,FL300,270\n";
        let text = from_bluesky("day", &parse(&"day.scn", text)).expect("it has aircraft");
        let mut run = airspace_run(&Source::new("day", text, ""), 1).expect("a scenario");
        run.advance(run.config().cycles);
        let metrics = run.metrics();
        assert_eq!((metrics.arrived, metrics.not_appeared), (2, 0));
    }

    #[test]
    fn any_name_of_a_file_is_the_name_of_its_scenario() {
        let file = parse(&"f.scn", "00:00:00.00>CRE A1,A320,52.0,4.0,90,FL300,270\n");
        for name in ["cafe\u{301}", "a \"b\" \\ 'c'", "tab\tline\nend", "\u{feff}\u{7f}\u{0}", ""] {
            let text = from_bluesky(name, &file).expect("it has aircraft");
            let compiled = CompiledAirspace::new(&Source::new(name, text, "")).expect("a scenario");
            assert_eq!(compiled.name, name);
        }
    }

    #[test]
    fn check_tells_how_far_orca_looks_ahead() {
        let text = "format = 1\nworld = \"airspace\"\nairspace.method = \"orca\"\n\
                    [airspace.generator]\nkind = \"superconflict\"\nn = 3\n";
        let compiled = CompiledAirspace::new(&Source::new("o", text, "")).expect("a scenario");
        let contents = crate::text::describe_scenario(&compiled).text;
        assert!(contents.contains("looks 45 s ahead"), "{contents}");
    }

    #[test]
    fn a_flight_created_at_speed_0_flies_as_far_as_the_speed_that_it_gets_takes_it() {
        let file = parse(
            &"late.scn",
            "00:00:00.00>CRE A1,B744,0,-0.4,90,FL200,0\n\
             00:00:30.00>HDG A1 180\n00:01:00.00>SPD A1 250\n\
             00:00:00.00>CRE B2,B744,1,0.4,270,FL200,250\n\
             00:00:00.00>CRE C3,B744,2,0.4,270,FL200,0\n",
        );
        let rules = settings_from_bluesky("late.scn", &file);
        let [stands] = &rules.refused[..] else { panic!("{:?}", rules.refused) };
        assert!(stands.cause().contains("C3 is never given a speed"), "{stands}");
        let text = from_bluesky("late", &file).expect("two fly");
        let mut run = airspace_run(&Source::new("late", text, ""), 1).expect("valid");
        run.advance(400);
        let world = run.world().clone();
        assert_eq!(world.airplanes[0].appears_s, 60.0);
        for id in 0..2 {
            let flown = crate::metrics::airplane_metrics(&world, run.state(), id);
            let (s, delay) = (flown.flown_s, flown.delay_percent);
            assert!(s.is_some_and(|s| s > 0.95 * UNROUTED_FLIGHT_S), "{id}: {s:?}");
            assert!(delay.is_some_and(|percent| percent.abs() < 1.0), "{id}: {delay:?}");
        }
    }
}
