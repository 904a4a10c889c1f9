//! Conversion of other programs' traffic to a scenario: BlueSky `.scn` files and recorded tracks.
//!
//! The resulting text is a scenario like any other, complete in itself: it goes into the run folder
//! and can be edited. Positions stay latitudes and longitudes: the scenario is geographic. Turn rates
//! are those of a turn at 25 degrees of bank at the airplane's greatest speed.
//!
//! Recorded tracks are replayed as they are; from `airspace.replay_until_s` on, which is infinity
//! by default, they are flown anew.

mod bluesky;
mod flyable_aircraft;
mod import_settings;
mod imported_types;
mod position;
mod recorded;
mod scn_flight;

pub use bluesky::from_bluesky;
pub(crate) use bluesky::{
    BlueskyScenario, from_bluesky_with_types, omitted_commands, settings_from_bluesky,
};
pub(crate) use import_settings::ImportedScenarioSettings;
pub(crate) use imported_types::{ClipCounts, ImportedTypes};
pub use recorded::from_tracks;

use super::flight::SeparationMinima;

const NAUTICAL_MILE_M: f64 = 1852.0;
const FOOT_M: f64 = 0.3048;
const KNOT_M_S: f64 = NAUTICAL_MILE_M / 3600.0;
/// The turn rate at 25 degrees of bank is this over the airspeed: g tan 25.
const BANKED_TURN_M_S2: f64 = 9.80665 * 0.466_307_658_154_998_6;
/// Seconds between two decisions of methods that plan, for traffic with long horizons.
const DT_S: f64 = 10.0;
/// Seconds between two looks of methods that look anew each time, as in BlueSky (`asas_dt`).
const LOOK_EVERY_S: f64 = 1.0;
/// Look-ahead of ORCA in seconds, unless a file gives a shorter one. In its authors' library (RVO2, the example of a circle) agents
/// of 1.5 m radius look ahead 10 s, in which they fly 6.7 radii; airliners fly as many radii of 2.5 nautical miles in
/// 140 s. The 45 s of scenarios in the paper's size are as many for its airplanes, and too few for airliners.
const ORCA_LOOK_AHEAD_S: f64 = 150.0;
/// Look-ahead of track bands in seconds, unless a file gives a shorter one: DAIDALUS's own (`lookahead_time`).
const BANDS_LOOK_AHEAD_S: f64 = 180.0;
/// Look-ahead of MVP in seconds in a BlueSky file, unless that gives one: BlueSky's own (`asas_dtlookahead`).
const MVP_LOOK_AHEAD_S: f64 = 300.0;

/// Smallest speed in meters per second at which an aircraft counts as in the air.
const MIN_SPEED_M_S: f64 = 1.0;
/// Time in seconds for which an airplane without a destination flies ahead.
const UNROUTED_FLIGHT_S: f64 = 1800.0;

/// Returns a call sign as a line of the scenario; none where it would not be one.
fn callsign(name: &str) -> String {
    let name: String = name.trim().chars().filter(|c| !c.is_control()).take(40).collect();
    if name.is_empty() {
        return String::new();
    }
    format!("callsign = {}\n", toml::Value::from(name))
}

fn banked_turn_deg_s(v_m_s: f64) -> f64 {
    (BANKED_TURN_M_S2 / v_m_s).to_degrees()
}

fn header_text(name: &str, zone: SeparationMinima, horizon_s: Option<f64>, more: &str) -> String {
    let SeparationMinima { gap_m, vertical_m } = zone;
    // Airliners fly seven times as fast as the paper's airplanes and turn more slowly, so all times are longer.
    let horizon_s = horizon_s.unwrap_or(300.0);
    let orca_s = horizon_s.min(ORCA_LOOK_AHEAD_S);
    let bands_s = horizon_s.min(BANDS_LOOK_AHEAD_S);
    // Rust's own escapes are not those of TOML: an accent of its own would be `\u{301}`.
    let name = toml::Value::from(name);
    format!(
        "format = 1\nworld = \"airspace\"\nname = {name}\n\n\
         [airspace]\nvertical_m = {vertical_m:?}\nhorizon_s = {horizon_s:?}\ndt_s = {DT_S:?}\ndtau_s = 5.0\n\
         look_every_s = {LOOK_EVERY_S:?}\npasses_abeam = true\n\
         orca = {{ look_ahead_s = {orca_s:?} }}\n\
         bands = {{ look_ahead_s = {bands_s:?} }}\n\
         legs = {{ turns_s = [20.0, 40.0, 60.0], until_s = [240.0] }}\n{more}\n[airplane]\nseparation_m = {gap_m:?}\n"
    )
}
