//! Conversion of recorded tracks to a scenario, which replays them.

use super::{FOOT_M, KNOT_M_S, NAUTICAL_MILE_M, banked_turn_deg_s, callsign, header_text, origin};
use crate::flight::SeparationMinima;
use sidestep_import::local_plane::LocalPlane;
use sidestep_import::traffic::{RecordedTraffic, Track};
use std::fmt::Write;

/// Separation of recorded traffic in meters: five nautical miles and a thousand feet.
const ZONE: SeparationMinima =
    SeparationMinima { gap_m: 5.0 * NAUTICAL_MILE_M, vertical_m: 1000.0 * FOOT_M };

/// Returns the scenario of recorded tracks, which replays them. `None` without any track.
pub fn from_tracks(name: &str, traffic: &RecordedTraffic) -> Option<String> {
    let samples = || traffic.tracks.iter().flat_map(|track| &track.samples);
    let plane = LocalPlane::from_positions(samples().map(|s| s.position))?;
    let start_s = samples().map(|s| s.time_s).fold(f64::INFINITY, f64::min);
    let replay = "# seconds after which recorded airplanes are flown anew; inf: never\n\
                  replay_until_s = inf\n";
    let more = format!("{replay}start_utc_s = {start_s:?}\n{}", origin(&plane));
    let mut text = header_text(name, ZONE, None, &more);
    let tracks: Vec<&Track> =
        traffic.tracks.iter().filter(|track| has_enough_samples(track)).collect();
    for track in &tracks {
        write_track(&mut text, track, &plane, start_s);
    }
    (!tracks.is_empty()).then_some(text)
}

/// Returns whether a track has the two samples that it needs at least to lead anywhere.
pub fn has_enough_samples(track: &Track) -> bool {
    track.samples.len() >= 2
}

fn write_track(text: &mut String, track: &Track, plane: &LocalPlane, start_s: f64) {
    let speed_kt =
        track.samples.iter().map(|s| s.ground_speed_kt).sum::<f64>() / track.samples.len() as f64;
    let omega_deg_s = banked_turn_deg_s((speed_kt * KNOT_M_S).max(1.0));
    let name = if track.callsign.trim().is_empty() { &track.icao24 } else { &track.callsign };
    // Writing to a string cannot fail. A name with a line end would end the comment.
    let _ = write!(
        text,
        "\n[[airplanes]] # {}\n{}omega_max_deg_s = {omega_deg_s:?}\ntrack = [\n",
        track.icao24.escape_debug(),
        callsign(name)
    );
    for sample in &track.samples {
        let [x, y] = plane.to_plane_m(sample.position);
        let t_s = sample.time_s - start_s;
        let altitude_m = sample.altitude_ft * FOOT_M;
        let _ = writeln!(text, "  [{t_s:?}, {x:?}, {y:?}, {altitude_m:?}],");
    }
    text.push_str("]\n");
}
