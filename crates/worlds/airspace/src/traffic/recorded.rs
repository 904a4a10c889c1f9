//! Conversion of recorded tracks to a scenario, which replays them.

use super::position::{origin_text, position_text, straight_ahead};
use super::{
    FOOT_M, KNOT_M_S, MIN_SPEED_M_S, NAUTICAL_MILE_M, UNROUTED_FLIGHT_S, banked_turn_deg_s,
    callsign, header_text,
};
use crate::flight::SeparationMinima;
use sidestep_import::local_plane::LocalPlane;
use sidestep_import::traffic::{RecordedTraffic, Track};
use sidestep_kernel::math;
use std::fmt::Write;

/// Separation of recorded traffic in meters: five nautical miles and a thousand feet.
const ZONE: SeparationMinima =
    SeparationMinima { gap_m: 5.0 * NAUTICAL_MILE_M, vertical_m: 1000.0 * FOOT_M };

/// Returns the scenario of recorded flights, which replays them; those of one instant fly straight on. `None` without
/// any flight.
pub fn from_tracks(name: &str, traffic: &RecordedTraffic) -> Option<String> {
    let samples = || traffic.tracks.iter().flat_map(|track| &track.samples);
    let origin = origin_text(samples().map(|s| s.position))?;
    let start_s = samples().map(|s| s.time_s).fold(f64::INFINITY, f64::min);
    let replay = "# seconds after which recorded airplanes are flown anew; inf: never\n\
                  replay_until_s = inf\n";
    let replay = if traffic.is_snapshot { "" } else { replay };
    let more = format!("{replay}start_utc_s = {start_s:?}\n{origin}");
    let mut text = header_text(name, ZONE, None, &more);
    for track in &traffic.tracks {
        if traffic.is_snapshot {
            write_straight_flight(&mut text, track, start_s);
        } else {
            write_track(&mut text, track, start_s);
        }
    }
    (!traffic.tracks.is_empty()).then_some(text)
}

/// Returns the first lines of an airplane's section: its address as a comment, and its name.
fn section_head(track: &Track) -> String {
    let name = if track.callsign.trim().is_empty() { &track.icao24 } else { &track.callsign };
    // A name with a line end would end the comment.
    format!("\n[[airplanes]] # {}\n{}", track.icao24.escape_debug(), callsign(name))
}

fn write_track(text: &mut String, track: &Track, start_s: f64) {
    let v_m_s = typical_speed_m_s(track).max(MIN_SPEED_M_S);
    let omega_deg_s = banked_turn_deg_s(v_m_s);
    text.push_str(&section_head(track));
    // Writing to a string cannot fail.
    if has_jump(track, v_m_s) {
        let _ = writeln!(text, "v_m_s = {v_m_s:?}");
    }
    let _ = writeln!(text, "omega_max_deg_s = {omega_deg_s:?}\ntrack_deg = [");
    for sample in &track.samples {
        let at = position_text(sample.position);
        let t_s = sample.time_s - start_s;
        let altitude_m = sample.altitude_ft * FOOT_M;
        let _ = writeln!(text, "  [{t_s:?}, {at}, {altitude_m:?}],");
    }
    text.push_str("]\n");
}

/// Writes an aircraft of one instant, which flies straight on at its speed and level.
fn write_straight_flight(text: &mut String, track: &Track, start_s: f64) {
    let Some(sample) = track.samples.first() else { return };
    let v_m_s = sample.ground_speed_kt.map_or(0.0, |kt| kt * KNOT_M_S).max(MIN_SPEED_M_S);
    let track_deg = sample.track_deg.unwrap_or(0.0);
    let goal = straight_ahead(sample.position, track_deg, UNROUTED_FLIGHT_S * v_m_s);
    text.push_str(&section_head(track));
    // Writing to a string cannot fail.
    let _ = write!(
        text,
        "at_deg = [{}]\nheading_deg = {:?}\nway_points_deg = [[{}]]\naltitude_m = {:?}\n\
         appears_s = {:?}\nv_m_s = {v_m_s:?}\nomega_max_deg_s = {:?}\n",
        position_text(sample.position),
        90.0 - track_deg,
        position_text(goal),
        sample.altitude_ft * FOOT_M,
        sample.time_s - start_s,
        banked_turn_deg_s(v_m_s)
    );
}

/// A step between rows that is longer than this factor of what its speed gives, and half a nautical mile more, is a jump.
const JUMP_FACTOR: f64 = 2.0;

/// Returns whether a flight of this speed jumps: then the length of its way does not give its speed.
fn has_jump(track: &Track, v_m_s: f64) -> bool {
    track.samples.windows(2).any(|pair| {
        let step_m = LocalPlane::centered_at(pair[0].position).to_plane_m(pair[1].position);
        let step_s = pair[1].time_s - pair[0].time_s;
        let reach_m = JUMP_FACTOR * v_m_s * step_s + 0.5 * NAUTICAL_MILE_M;
        math::hypot(step_m[0], step_m[1]) > reach_m
    })
}

/// Returns the speed of a flight: the mean of those that it reports, or else the median of its rows. The mean of its way
/// would be too fast where a position is wrong.
fn typical_speed_m_s(track: &Track) -> f64 {
    let mut sum_kt = 0.0;
    let mut count = 0.0;
    for speed_kt in track.samples.iter().filter_map(|sample| sample.ground_speed_kt) {
        sum_kt += speed_kt;
        count += 1.0;
    }
    if count > 0.0 {
        return sum_kt / count * KNOT_M_S;
    }
    track.median_speed_m_s().unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenario::CompiledAirspace;
    use sidestep_import::traffic::parse;
    use sidestep_kernel::Simulation;
    use sidestep_scenario::Source;

    fn scenario(text: &str) -> String {
        from_tracks("t", &parse(&"t.csv", text).expect("traffic")).expect("flights")
    }

    #[test]
    fn nothing_is_flown_in_a_gap() {
        let mut text = String::from("time_s,icao24,callsign,lat_deg,lon_deg,alt_ft,gs_kt\n");
        for k in 0..120 {
            // Both fly on, but nobody sees one of them on the way.
            let lon_deg = 7.0 + 0.03 * f64::from(k);
            if !(10..110).contains(&k) {
                let _ = writeln!(text, "{},aaaaa1,A1,47.0,{lon_deg:.2},35000,440", 10 * k);
            }
            let lat_deg = 45.2 + 0.03 * f64::from(k);
            let _ = writeln!(text, "{},bbbbb2,B2,{lat_deg:.2},8.8,35000,640", 10 * k);
        }
        let source = Source::new("t", scenario(&text), "");
        let mut run = crate::airspace_run(&source, 1).expect("a scenario");
        assert_eq!(run.agent_count(), 3, "two flights of one aircraft, and the other one");
        run.advance(130);
        assert_eq!(run.metrics().losses_of_separation, 0, "no ghost in the gap");
    }

    #[test]
    fn aircraft_of_one_instant_fly_straight_on() {
        let text = "time_s,icao24,lat_deg,lon_deg,alt_ft,gs_kt,track_deg\n\
                    100,aaaaa1,47.0,7.0,35000,440,90\n100,bbbbb2,48.0,7.0,35000,440,0\n";
        let compiled = CompiledAirspace::new(&Source::new("t", scenario(text), "")).expect("valid");
        let world = &compiled.world;
        let first = &world.airplanes[0];
        let [east_m, north_m] = world.surface.offset_m(first.start.at, first.mission[0]);
        assert!(first.start.heading_rad.abs() < 1e-9 && east_m > 400_000.0);
        assert!(north_m.abs() < 1.0);
    }

    #[test]
    fn a_recording_with_a_jump_that_inspect_keeps_can_be_run() {
        let mut text = String::from("time_s,icao24,callsign,lat_deg,lon_deg,alt_ft,gs_kt\n");
        for k in 0..20 {
            let lon_deg = 7.0 + 0.03 * f64::from(k);
            let lat_deg = if k < 10 { 47.0 } else { 54.0 };
            let _ = writeln!(text, "{},aaaaa1,A1,{lat_deg},{lon_deg:.2},35000,440", 10 * k);
        }
        let compiled = CompiledAirspace::new(&Source::new("t", scenario(&text), ""));
        let v_m_s = compiled.expect("a scenario").world.airplanes[0].model.v_m_s;
        assert!((v_m_s - 227.0).abs() < 30.0, "{v_m_s}");
    }

    #[test]
    fn a_flight_without_reported_speeds_turns_as_fast_as_it_flies() {
        let text =
            "time_s,icao24,lat_deg,lon_deg,alt_ft\n0,a,47.0,7.0,35000\n10,a,47.0,7.03,35000\n";
        let traffic = parse(&"t.csv", text).expect("traffic");
        let v_m_s = typical_speed_m_s(&traffic.tracks[0]);
        assert!((v_m_s - 227.5).abs() < 0.5, "{v_m_s}");
    }

    #[test]
    fn a_jump_makes_no_flight_faster_whether_it_reports_speeds_or_not() {
        for speed in ["440", ""] {
            let mut text = String::from("time_s,icao24,callsign,lat_deg,lon_deg,alt_ft,gs_kt\n");
            for k in 0..40 {
                let lon_deg = 7.0 + 0.03 * f64::from(k);
                // A hundred kilometers: the mean of the way would be some 480 m/s.
                let lat_deg = if k < 20 { 47.0 } else { 47.9 };
                let _ = writeln!(text, "{},aaaaa1,A1,{lat_deg},{lon_deg:.2},35000,{speed}", 10 * k);
            }
            let compiled = CompiledAirspace::new(&Source::new("t", scenario(&text), ""));
            let v_m_s = compiled.expect("a scenario").world.airplanes[0].model.v_m_s;
            assert!((v_m_s - 227.0).abs() < 5.0, "{v_m_s} {speed}");
        }
    }
}
