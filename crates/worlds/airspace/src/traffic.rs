//! Traffic of others -> a scenario: BlueSky `.scn` files and recorded tracks.
//!
//! The text that comes out is a scenario like any other, complete in itself: it goes into the run
//! folder and can be edited. Latitude and longitude become a plane about the traffic's center.
//! Turn rates are those of a turn at 25 degrees of bank at the airplane's greatest speed.
//!
//! Aircraft of BlueSky files fly their routes, and what they are told on the way (`HDG`, `SPD`,
//! `ALT`, `LNAV ON`, `DEL`). One that has nowhere to go flies half an hour ahead. A true airspeed
//! stays as it is until the next `SPD`, also in climbs. `not_flown` counts what else they say.
//!
//! Recorded tracks are replayed as they are; from `airspace.replay_until_s` on, which stands at
//! infinity, they are flown anew.

use super::flight::Point;
use super::flight_plan::CLIMB_M_S;
use sidestep_import::bluesky::{Change, ScnAircraft, ScnFile};
use sidestep_import::local_plane::LocalPlane;
use sidestep_import::traffic::{RecordedTraffic, Track};
use sidestep_kernel::math;
use std::collections::BTreeMap;
use std::fmt::Write;

const NAUTICAL_MILE_M: f64 = 1852.0;
const FOOT_M: f64 = 0.3048;
const KNOT_M_S: f64 = NAUTICAL_MILE_M / 3600.0;
/// The turn rate at 25 degrees of bank is this over the airspeed: g tan 25.
const BANKED_M_S2: f64 = 9.80665 * 0.466_307_658_154_998_6;
/// How far ahead an airplane flies that has nowhere to go.
const AHEAD_S: f64 = 1800.0;
/// Time between two decisions: a route that is told no later than this counts as known at once.
const DT_S: f64 = 10.0;
/// Separation of recorded traffic: five nautical miles and a thousand feet.
const ZONE: (f64, f64) = (5.0 * NAUTICAL_MILE_M, 1000.0 * FOOT_M);

/// The scenario of a BlueSky file; `None` when no aircraft of it has a place.
pub fn from_bluesky(name: &str, file: &ScnFile) -> Option<String> {
    let traffic = &file.traffic;
    let plane = LocalPlane::about_all(traffic.aircraft.iter().map(ScnAircraft::position))?;
    let zone = (traffic.zone_radius_nm * NAUTICAL_MILE_M, traffic.zone_half_height_ft * FOOT_M);
    let mut text = heading(name, zone, "");
    for aircraft in &traffic.aircraft {
        write_aircraft(&mut text, aircraft, &plane);
    }
    Some(text)
}

/// Settings of conflict detection and resolution: here that is the scenario's method.
const SETTINGS: [&str; 4] = ["ASAS", "CDMETHOD", "DTLOOK", "RESO"];

/// What a BlueSky file tells its aircraft and the scenario leaves out, with counts.
pub(crate) fn not_flown(file: &ScnFile) -> BTreeMap<String, u64> {
    let mut counts = BTreeMap::new();
    let mut count = |what: &str, n: usize| {
        if n > 0 {
            *counts.entry(what.to_string()).or_default() += n as u64;
        }
    };
    count("WIND", file.traffic.wind.len());
    count("NOISE ON", usize::from(file.traffic.noise));
    for name in SETTINGS {
        count(name, file.commands.get(name).map_or(0, |n| *n as usize));
    }
    for aircraft in &file.traffic.aircraft {
        let points = &aircraft.way_points;
        count("ADDWPT altitude", points.iter().filter(|p| p.altitude_ft.is_some()).count());
        count("ADDWPT speed", points.iter().filter(|p| p.speed.is_some()).count());
        let told = |is: fn(&Change) -> bool| aircraft.changes.iter().filter(|(_, c)| is(c)).count();
        count("VNAV", told(|c| matches!(c, Change::VerticalNavigation(_))));
        count("LNAV OFF", told(|c| matches!(c, Change::LateralNavigation(false))));
        if told(|c| matches!(c, Change::AltitudeFt(_))) == 0 {
            count("VS", told(|c| matches!(c, Change::VerticalSpeedFpm(_))));
        }
    }
    counts
}

/// What an airplane is told, as a scenario says it.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Told {
    /// Degrees counter-clockwise from east.
    Heading(f64),
    Speed(f64),
    /// Meters, and meters per second.
    Altitude(f64, f64),
    Proceeds,
    Leaves,
}

impl Told {
    fn text(self) -> String {
        match self {
            Self::Heading(deg) => format!("heading_deg = {deg:?}"),
            Self::Speed(v_m_s) => format!("speed_m_s = {v_m_s:?}"),
            Self::Altitude(altitude_m, climb_m_s) => {
                format!("altitude_m = {altitude_m:?}, climb_m_s = {climb_m_s:?}")
            }
            Self::Proceeds => "proceeds = true".into(),
            Self::Leaves => "leaves = true".into(),
        }
    }
}

fn write_aircraft(text: &mut String, aircraft: &ScnAircraft, plane: &LocalPlane) {
    let at_m = plane.to_plane_m(aircraft.position());
    let heading_deg = 90.0 - aircraft.heading_deg;
    let v_m_s = aircraft.speed.true_airspeed_mps(aircraft.altitude_ft).max(1.0);
    let mut way_points_m: Vec<Point> =
        aircraft.known_goals().map(|at| plane.to_plane_m(at)).collect();
    let orders = orders(aircraft, !way_points_m.is_empty());
    if way_points_m.is_empty() {
        let (heading_rad, ahead_m) = (heading_deg.to_radians(), AHEAD_S * v_m_s);
        let goal = [
            at_m[0] + ahead_m * math::cos(heading_rad),
            at_m[1] + ahead_m * math::sin(heading_rad),
        ];
        way_points_m.push(goal);
    }
    let told_m_s = orders.iter().filter_map(|(_, told)| match told {
        Told::Speed(v_m_s) => Some(*v_m_s),
        _ => None,
    });
    let omega_deg_s = banked_deg_s(told_m_s.fold(v_m_s, f64::max));
    let (altitude_m, appears_s) = (aircraft.altitude_ft * FOOT_M, aircraft.created_s);
    // Writing to a string cannot fail.
    let _ = write!(
        text,
        "\n[[airplanes]]\nat_m = {at_m:?}\nheading_deg = {heading_deg:?}\n\
         way_points_m = {way_points_m:?}\naltitude_m = {altitude_m:?}\n\
         appears_s = {appears_s:?}\nv_m_s = {v_m_s:?}\nomega_max_deg_s = {omega_deg_s:?}\n"
    );
    if orders.is_empty() {
        return;
    }
    text.push_str("orders = [\n");
    for (at_s, told) in orders {
        let _ = writeln!(text, "  {{ at_s = {at_s:?}, {} }},", told.text());
    }
    text.push_str("]\n");
}

/// What an aircraft is told on its way, by rising time.
fn orders(aircraft: &ScnAircraft, has_route: bool) -> Vec<(f64, Told)> {
    let mut orders: Vec<(f64, Told)> = Vec::new();
    let mut routed_s: Vec<f64> = route_times_s(aircraft);
    if has_route && routed_s.first().is_some_and(|first_s| *first_s > aircraft.created_s + DT_S) {
        orders.push((aircraft.created_s, Told::Heading(90.0 - aircraft.heading_deg)));
    }
    routed_s.retain(|at_s| has_route && *at_s > aircraft.created_s);
    // Whoever gets a way-point flies there, whatever heading it was told before.
    orders.extend(routed_s.into_iter().map(|at_s| (at_s, Told::Proceeds)));
    orders.extend(changes(aircraft, has_route));
    orders.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut keeps_heading = false;
    // Proceeding changes nothing for an airplane that does.
    orders.retain(|(_, told)| match told {
        Told::Heading(_) => {
            keeps_heading = true;
            true
        }
        Told::Proceeds => std::mem::take(&mut keeps_heading),
        _ => true,
    });
    let last_s = orders.last().map_or(aircraft.created_s, |(at_s, _)| *at_s);
    let ends_s = aircraft.deleted_s.or(keeps_heading.then_some(last_s + AHEAD_S));
    if let Some(ends_s) = ends_s {
        orders.retain(|(at_s, _)| *at_s < ends_s);
        orders.push((ends_s, Told::Leaves));
    }
    orders
}

/// When an aircraft was told where to go, rising.
fn route_times_s(aircraft: &ScnAircraft) -> Vec<f64> {
    let known = aircraft.way_points.iter().filter(|p| p.place.position().is_some());
    let destination = aircraft.destination.as_ref().filter(|place| place.position().is_some());
    let destination_s = destination.and(aircraft.destination_s);
    let mut all: Vec<f64> = known.map(|p| p.added_s).chain(destination_s).collect();
    all.sort_by(f64::total_cmp);
    all
}

fn changes(aircraft: &ScnAircraft, has_route: bool) -> Vec<(f64, Told)> {
    let (mut altitude_ft, mut climb_m_s) = (aircraft.altitude_ft, CLIMB_M_S);
    let mut told: Vec<(f64, Told)> = Vec::new();
    for &(at_s, change) in &aircraft.changes {
        match change {
            Change::HeadingDeg(deg) => told.push((at_s, Told::Heading(90.0 - deg))),
            Change::Speed(speed) => {
                let v_m_s = speed.true_airspeed_mps(altitude_ft).max(1.0);
                told.push((at_s, Told::Speed(v_m_s)));
            }
            Change::AltitudeFt(to_ft) => {
                altitude_ft = to_ft;
                told.push((at_s, Told::Altitude(to_ft * FOOT_M, climb_m_s)));
            }
            Change::VerticalSpeedFpm(fpm) if fpm != 0.0 => {
                climb_m_s = fpm.abs() * FOOT_M / 60.0;
                // Behind an ALT of the same time it is meant for that one.
                if let Some((last_s, Told::Altitude(_, rate_m_s))) = told.last_mut()
                    && *last_s == at_s
                {
                    *rate_m_s = climb_m_s;
                }
            }
            Change::LateralNavigation(true) if has_route => told.push((at_s, Told::Proceeds)),
            _ => {}
        }
    }
    told
}

/// The scenario of recorded tracks, which replays them. `None` without any track.
pub fn from_tracks(name: &str, traffic: &RecordedTraffic) -> Option<String> {
    let samples = || traffic.tracks.iter().flat_map(|track| &track.samples);
    let plane = LocalPlane::about_all(samples().map(|s| s.position))?;
    let begins_s = samples().map(|s| s.time_s).fold(f64::INFINITY, f64::min);
    let replay = "# seconds after which recorded airplanes are flown anew; inf: never\n\
                  replay_until_s = inf\n";
    let mut text = heading(name, ZONE, replay);
    let tracks = || traffic.tracks.iter().filter(|track| has_length(track));
    tracks().for_each(|track| write_track(&mut text, track, &plane, begins_s));
    tracks().next().map(|_| text)
}

/// Whether a track has the two samples of which a way can be made.
pub fn has_length(track: &Track) -> bool {
    track.samples.len() >= 2
}

fn write_track(text: &mut String, track: &Track, plane: &LocalPlane, begins_s: f64) {
    let speed_kt =
        track.samples.iter().map(|s| s.ground_speed_kt).sum::<f64>() / track.samples.len() as f64;
    let omega_deg_s = banked_deg_s((speed_kt * KNOT_M_S).max(1.0));
    let label = format!("{} {}", track.icao24, track.callsign);
    // Writing to a string cannot fail. A name with a line end would end the comment.
    let _ = write!(
        text,
        "\n[[airplanes]] # {}\nomega_max_deg_s = {omega_deg_s:?}\ntrack = [\n",
        label.trim().escape_debug()
    );
    for sample in &track.samples {
        let [x, y] = plane.to_plane_m(sample.position);
        let (t_s, altitude_m) = (sample.time_s - begins_s, sample.altitude_ft * FOOT_M);
        let _ = writeln!(text, "  [{t_s:?}, {x:?}, {y:?}, {altitude_m:?}],");
    }
    text.push_str("]\n");
}

fn banked_deg_s(v_m_s: f64) -> f64 {
    (BANKED_M_S2 / v_m_s).to_degrees()
}

fn heading(name: &str, (separation_m, vertical_m): (f64, f64), more: &str) -> String {
    format!(
        "format = 1\nworld = \"airspace\"\nname = {name:?}\ncycles = 4000\n\n\
         [airspace]\nvertical_m = {vertical_m:?}\nhorizon = 60\ndt_s = {DT_S:?}\ndtau_s = 5.0\n\
         legs = {{ turns_s = [20.0, 40.0, 60.0], until_s = [240.0] }}\n{more}\n[airplane]\nseparation_m = {separation_m:?}\n"
    )
}

#[cfg(test)]
mod tests {
    use super::super::airspace_run;
    use super::*;
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
        assert_eq!(run.agents(), 3);
        run.advance(200);
        let metrics = run.metrics();
        assert_eq!(metrics.losses_of_separation, 0);
        assert!(metrics.min_separation_m.is_some_and(|d| d < 20_000.0), "they have met");
    }
}
