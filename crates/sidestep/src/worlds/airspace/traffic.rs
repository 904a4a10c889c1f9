//! Traffic of others -> a scenario: BlueSky `.scn` files and recorded tracks.
//!
//! The text that comes out is a scenario like any other, complete in itself: it goes into the run
//! folder and can be edited. Latitude and longitude become a plane about the traffic's centre.
//! Airplanes keep the level and the true airspeed with which they begin; their turn rate is that
//! of a turn at 25 degrees of bank. One that has nowhere to go flies half an hour ahead.

use super::airplane::Point;
use crate::import::bluesky::{ScnAircraft, ScnFile};
use crate::import::local_plane::{LatLon, LocalPlane};
use crate::import::traffic::{RecordedTraffic, Track};
use sidestep_kernel::math;
use std::fmt::Write;

const NAUTICAL_MILE_M: f64 = 1852.0;
const FOOT_M: f64 = 0.3048;
const KNOT_M_S: f64 = NAUTICAL_MILE_M / 3600.0;
/// The turn rate at 25 degrees of bank is this over the airspeed: g tan 25.
const BANKED_M_S2: f64 = 9.80665 * 0.466_307_658_154_998_6;
/// How far ahead an airplane flies that has nowhere to go.
const AHEAD_S: f64 = 1800.0;
/// Separation of recorded traffic: five nautical miles and a thousand feet.
const ZONE: (f64, f64) = (5.0 * NAUTICAL_MILE_M, 1000.0 * FOOT_M);

/// One airplane of a scenario.
struct Entry {
    at_m: Point,
    heading_deg: f64,
    way_points_m: Vec<Point>,
    altitude_m: f64,
    appears_s: f64,
    v_m_s: f64,
}

/// The scenario of a BlueSky file; `None` when no aircraft of it has a place.
pub fn from_bluesky(name: &str, file: &ScnFile) -> Option<String> {
    let traffic = &file.traffic;
    let plane = LocalPlane::about_all(traffic.aircraft.iter().map(ScnAircraft::position))?;
    let zone = (traffic.zone_radius_nm * NAUTICAL_MILE_M, traffic.zone_half_height_ft * FOOT_M);
    let entries = traffic.aircraft.iter().map(|aircraft| {
        let v_m_s = aircraft.speed.true_airspeed_mps(aircraft.altitude_ft).max(1.0);
        let goals: Vec<Point> = aircraft.known_goals().map(|at| plane.to_plane_m(at)).collect();
        Entry {
            at_m: plane.to_plane_m(aircraft.position()),
            heading_deg: 90.0 - aircraft.heading_deg,
            way_points_m: goals,
            altitude_m: aircraft.altitude_ft * FOOT_M,
            appears_s: aircraft.created_s,
            v_m_s,
        }
    });
    Some(scenario(name, zone, entries))
}

/// The scenario of recorded tracks: each airplane flies from its first place through its places
/// every two minutes to its last, at its mean speed. `None` without any track.
pub fn from_tracks(name: &str, traffic: &RecordedTraffic) -> Option<String> {
    let samples = || traffic.tracks.iter().flat_map(|track| &track.samples);
    let plane = LocalPlane::about_all(samples().map(|s| s.position))?;
    let begins_s = samples().map(|s| s.time_s).fold(f64::INFINITY, f64::min);
    let entries = traffic.tracks.iter().filter_map(|track| entry(track, &plane, begins_s));
    Some(scenario(name, ZONE, entries))
}

fn entry(track: &Track, plane: &LocalPlane, begins_s: f64) -> Option<Entry> {
    let (first, rest) = track.samples.split_first()?;
    let last = rest.last()?;
    let at = |position: LatLon| plane.to_plane_m(position);
    let mut way_points_m: Vec<Point> = Vec::new();
    let mut due_s = first.time_s + 120.0;
    for sample in rest {
        if sample.time_s >= due_s || sample.time_s >= last.time_s {
            way_points_m.push(at(sample.position));
            due_s = sample.time_s + 120.0;
        }
    }
    let n = track.samples.len() as f64;
    let speed_kt = track.samples.iter().map(|s| s.ground_speed_kt).sum::<f64>() / n;
    Some(Entry {
        at_m: at(first.position),
        heading_deg: 90.0 - first.track_deg,
        way_points_m,
        altitude_m: first.altitude_ft * FOOT_M,
        appears_s: first.time_s - begins_s,
        v_m_s: (speed_kt * KNOT_M_S).max(1.0),
    })
}

fn scenario(
    name: &str,
    (separation_m, vertical_m): (f64, f64),
    entries: impl Iterator<Item = Entry>,
) -> String {
    let mut text = format!(
        "format = 1\nworld = \"airspace\"\nname = {name:?}\ncycles = 4000\n\n\
         [airspace]\nvertical_m = {vertical_m:?}\nhorizon = 60\ndt_s = 10.0\ndtau_s = 5.0\n\
         holds_s = [60.0]\n\n[airplane]\nseparation_m = {separation_m:?}\n"
    );
    for mut entry in entries {
        if entry.way_points_m.is_empty() {
            let psi_rad = entry.heading_deg.to_radians();
            let ahead_m = AHEAD_S * entry.v_m_s;
            let [x, y] = entry.at_m;
            let goal = [x + ahead_m * math::cos(psi_rad), y + ahead_m * math::sin(psi_rad)];
            entry.way_points_m.push(goal);
        }
        let Entry { at_m, heading_deg, way_points_m, altitude_m, appears_s, v_m_s } = entry;
        let omega_deg_s = (BANKED_M_S2 / v_m_s).to_degrees();
        // Writing to a string cannot fail.
        let _ = write!(
            text,
            "\n[[airplanes]]\nat_m = {at_m:?}\nheading_deg = {heading_deg:?}\n\
             way_points_m = {way_points_m:?}\naltitude_m = {altitude_m:?}\n\
             appears_s = {appears_s:?}\nv_m_s = {v_m_s:?}\nomega_max_deg_s = {omega_deg_s:?}\n"
        );
    }
    text
}

#[cfg(test)]
mod tests {
    use super::super::simulation::AirspaceSimulation;
    use super::*;
    use crate::import::bluesky::parse;
    use crate::scenario::Source;
    use sidestep_kernel::Simulation;

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
        let mut run = AirspaceSimulation::new(&Source::new("two", text, ""), 1).expect("valid");
        assert_eq!(run.agents(), 3);
        run.advance(200);
        let metrics = run.airspace_metrics();
        assert_eq!(metrics.losses_of_separation, 0);
        assert!(metrics.min_separation_m.is_some_and(|d| d < 20_000.0), "they have met");
    }
}
