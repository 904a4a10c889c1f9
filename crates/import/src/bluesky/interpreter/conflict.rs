//! Aircraft that are created in conflict with another one (`CRECONFS`), as BlueSky 1.1.1 places them.

use super::aircraft::KnownState;
use super::{CommandOutcome, CommandResult, Interpreter, refusal, upper};
use crate::bluesky::traffic::{AircraftCommand, ScnAircraft};
use crate::bluesky::values::{Arguments, altitude_ft, duration_s, number, speed};
use crate::bluesky::{Airspeed, KNOT_MPS};
use crate::local_plane::{LatLon, wrap_deg};
use sidestep_kernel::math;

/// The zone for which BlueSky computes the conflict, whatever `ZONER` and `ZONEDH` say: 5 nautical miles, 1000 ft.
const ZONE_RADIUS_M: f64 = 5.0 * NAUTICAL_MILE_M;
const ZONE_HALF_HEIGHT_FT: f64 = 1000.0;
const NAUTICAL_MILE_M: f64 = 1852.0;

/// The arguments of a conflict.
struct ConflictGeometry {
    /// Angle from the track of the other to that of the new one, in degrees.
    track_change_deg: f64,
    /// Distance at the closest point of approach, in m.
    closest_m: f64,
    /// Time until separation is lost horizontally, in s.
    horizontal_s: f64,
    /// Height above the other, in ft, and the time until separation is lost vertically, in s.
    vertical: Option<(f64, f64)>,
    speed: Option<Airspeed>,
}

/// The start of the new aircraft.
struct ConflictStart {
    position: LatLon,
    heading_deg: f64,
    altitude_ft: f64,
    true_airspeed_mps: f64,
    vertical_speed_fpm: f64,
}

impl Interpreter {
    /// `CRECONFS aircraft,type,target,angle,distance,time[,height[,vertical time[,speed]]]`
    pub(super) fn create_conflict(&mut self, arguments: &mut Arguments) -> CommandResult {
        let id = arguments.required("an aircraft")?;
        let kind = arguments.next().map_or(String::new(), |word| word.text.to_owned());
        let target_word = arguments.peek().unwrap_or("").to_string();
        let target = self.existing_aircraft(arguments)?;
        let geometry = geometry(arguments)?;
        let state = self.known_state(target).filter(|state| state.true_airspeed_mps > 0.0);
        let Some(state) = state.filter(|_| !self.has_wind()) else {
            let cause = format!(
                "where {target_word} is at that time, and how it flies, depends on its flight or the wind"
            );
            let remedy = "create it together with its target, or with CRE";
            return Err(refusal(arguments, id, cause, remedy));
        };
        let Some(start) = conflict_start(&state, &geometry) else {
            let cause = format!("{} would not move against {target_word}", id.text);
            return Err(refusal(arguments, id, cause, "give another angle or another speed"));
        };
        if start.position.lat_deg.abs() > 90.0 {
            let cause = format!("{} would start beyond a pole", id.text);
            let remedy = "create it with CRE, or give a shorter time";
            return Err(refusal(arguments, id, cause, remedy));
        }
        let speed = cas_of(start.true_airspeed_mps, start.altitude_ft);
        let mut changes = Vec::new();
        if start.altitude_ft != state.altitude_ft {
            changes.push((self.now_s, AircraftCommand::AltitudeFt(state.altitude_ft)));
            changes.push((self.now_s, AircraftCommand::VerticalSpeedFpm(start.vertical_speed_fpm)));
        }
        let aircraft = ScnAircraft {
            id: upper(id),
            kind,
            created_s: self.now_s,
            lat_deg: start.position.lat_deg,
            lon_deg: start.position.lon_deg,
            heading_deg: start.heading_deg,
            altitude_ft: start.altitude_ft,
            speed,
            way_points: Vec::new(),
            origin: None,
            destination: None,
            destination_s: None,
            changes,
            settings: Vec::new(),
            deleted_s: None,
        };
        self.add_aircraft(arguments, id, aircraft)?;
        if let Some(last) = self.builders.last_mut() {
            last.vertical_speed_fpm = start.vertical_speed_fpm;
        }
        Ok(CommandOutcome::Done)
    }
}

fn geometry(arguments: &mut Arguments) -> Result<ConflictGeometry, super::CommandError> {
    let place = arguments.place;
    let angle = arguments.required("the angle between the tracks")?;
    let distance = arguments.required("the distance at the closest approach in NM")?;
    let time = arguments.required("the time until separation is lost")?;
    let height_ft = arguments.optional(altitude_ft)?;
    let vertical_s = arguments.optional(duration_s)?;
    let speed = arguments.optional(speed)?;
    let horizontal_s = duration_s(place, time)?;
    Ok(ConflictGeometry {
        track_change_deg: number(place, angle)?,
        closest_m: number(place, distance)? * NAUTICAL_MILE_M,
        horizontal_s,
        vertical: height_ft.map(|height_ft| (height_ft, vertical_s.unwrap_or(horizontal_s))),
        // A speed of zero is none.
        speed: speed.filter(|speed| !matches!(speed, Airspeed::CasKt(0.0) | Airspeed::Mach(0.0))),
    })
}

/// Returns where the new aircraft starts; `None` where the two do not move against each other.
fn conflict_start(target: &KnownState, geometry: &ConflictGeometry) -> Option<ConflictStart> {
    let altitude_ft =
        target.altitude_ft + geometry.vertical.map_or(0.0, |(height_ft, _)| height_ft);
    let track_rad = target.heading_deg.to_radians();
    let own_track_rad = track_rad + geometry.track_change_deg.to_radians();
    let target_mps = target.true_airspeed_mps;
    let own_mps = geometry.speed.map_or(target_mps, |speed| speed.true_airspeed_mps(altitude_ft));
    let closing_north = target_mps * math::cos(track_rad) - own_mps * math::cos(own_track_rad);
    let closing_east = target_mps * math::sin(track_rad) - own_mps * math::sin(own_track_rad);
    let closing_mps = math::hypot(closing_north, closing_east);
    let closest_m = geometry.closest_m;
    let inside_m = if closest_m > ZONE_RADIUS_M {
        0.0
    } else {
        (ZONE_RADIUS_M * ZONE_RADIUS_M - closest_m * closest_m).sqrt()
    };
    let way_m = geometry.horizontal_s * closing_mps + inside_m;
    let distance_m = math::hypot(way_m, closest_m);
    if distance_m <= 0.0 || closing_mps <= 0.0 {
        return None;
    }
    // The closing velocity, turned by the angle between it and the line of sight, points at the new one.
    let along = way_m / distance_m;
    let across = closest_m / distance_m;
    let north = along * closing_north + across * closing_east;
    let east = along * closing_east - across * closing_north;
    let bearing_rad = math::atan2(east, north);
    let distance_nm = distance_m / NAUTICAL_MILE_M;
    let scale = math::cos(target.position.lat_deg.to_radians());
    let north_deg = distance_nm * math::cos(bearing_rad) / 60.0;
    let east_deg = distance_nm * math::sin(bearing_rad) / (60.0 * scale).max(0.01);
    let heading_deg = own_track_rad.to_degrees().rem_euclid(360.0);
    Some(ConflictStart {
        position: LatLon {
            lat_deg: target.position.lat_deg + north_deg,
            lon_deg: wrap_deg(target.position.lon_deg + east_deg),
        },
        heading_deg: if heading_deg >= 360.0 { 0.0 } else { heading_deg },
        altitude_ft,
        true_airspeed_mps: own_mps,
        vertical_speed_fpm: vertical_speed_fpm(target, geometry),
    })
}

/// Returns the vertical speed with which the new one comes to the target's level; 0 on one level.
fn vertical_speed_fpm(target: &KnownState, geometry: &ConflictGeometry) -> f64 {
    match geometry.vertical {
        Some((height_ft, time_s)) if height_ft != 0.0 && time_s > 0.0 => {
            let way_ft = height_ft.abs() - ZONE_HALF_HEIGHT_FT;
            target.vertical_speed_fpm - height_ft.signum() * way_ft / time_s * 60.0
        }
        _ => 0.0,
    }
}

/// Returns the calibrated airspeed with this true airspeed: the one between which and the next the true one lies.
fn cas_of(true_airspeed_mps: f64, altitude_ft: f64) -> Airspeed {
    let mut low_kt = 0.0;
    let mut high_kt = true_airspeed_mps / KNOT_MPS * 4.0;
    for _ in 0..80 {
        let middle_kt = 0.5 * (low_kt + high_kt);
        if Airspeed::CasKt(middle_kt).true_airspeed_mps(altitude_ft) < true_airspeed_mps {
            low_kt = middle_kt;
        } else {
            high_kt = middle_kt;
        }
    }
    Airspeed::CasKt(high_kt)
}
