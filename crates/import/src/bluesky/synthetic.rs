//! The traffic patterns that `SYN` creates, about latitude and longitude 0.
//!
//! Sizes and identifiers are those of the simulator that the scenarios are written for. Every
//! aircraft flies at FL200 with a calibrated airspeed of 200 m/s and goes straight to the mirror
//! image of its start, which is also its destination. Existing aircraft stay.

use std::f64::consts::TAU;

use super::speed::{Airspeed, KNOT_MPS};
use super::traffic::{PositionRef, ScnAircraft};
use crate::local_plane::LatLon;
use sidestep_kernel::math;

/// Radius of the circle of a super-conflict in degrees: 55.6 km.
const SUPER_RADIUS_DEG: f64 = 0.5;

/// Distance of a wall, and of the aircraft that meets it, from the center in degrees.
const WALL_DISTANCE_DEG: f64 = 0.6;

/// Number of aircraft in a wall.
const WALL_SIZE: u32 = 20;

const ALTITUDE_FT: f64 = 20_000.0;
const SPEED_MPS: f64 = 200.0;
const M_PER_NM: f64 = 1852.0;

/// Meters per degree in these patterns.
const M_PER_DEG: f64 = 111_319.0;

/// Distance of neighbors as a multiple of the protected zone's radius.
const SPACING_FACTOR: f64 = 1.1;

/// Time that a matrix flies until its first lines cross, in s.
const MATRIX_APPROACH_S: f64 = 330.0;

/// Returns `n` aircraft, evenly spaced on a circle of half a degree, each with the opposite goal.
pub(super) fn super_conflict(n: u32, created_s: f64) -> Vec<ScnAircraft> {
    let pattern = Pattern { kind: "SUPER", created_s };
    let mut aircraft = Vec::with_capacity(n as usize);
    for i in 0..n {
        let turn = f64::from(i) / f64::from(n);
        let lat_deg = -SUPER_RADIUS_DEG * math::cos(TAU * turn);
        let lon_deg = SUPER_RADIUS_DEG * math::sin(TAU * turn);
        // Not 360, which is outside of the range of headings.
        let heading_deg = if i == 0 { 0.0 } else { 360.0 * (1.0 - turn) };
        let goal = LatLon { lat_deg: -lat_deg, lon_deg: -lon_deg };
        aircraft.push(pattern.aircraft(format!("SUP{i}"), [lat_deg, lon_deg], heading_deg, goal));
    }
    aircraft
}

/// Returns one aircraft that flies east against a wall of 20 that fly west, 1.1 zone radii apart.
pub(super) fn wall(zone_radius_nm: f64, created_s: f64) -> Vec<ScnAircraft> {
    let pattern = Pattern { kind: "WALL", created_s };
    let goal = LatLon { lat_deg: 0.0, lon_deg: WALL_DISTANCE_DEG };
    let start = [0.0, -WALL_DISTANCE_DEG];
    let mut aircraft = vec![pattern.aircraft("OWNSHIP".to_string(), start, 90.0, goal)];
    for i in 0..WALL_SIZE {
        let lat_deg = (f64::from(i) - f64::from(WALL_SIZE / 2)) * spacing_deg(zone_radius_nm);
        let goal = LatLon { lat_deg, lon_deg: -WALL_DISTANCE_DEG };
        let start = [lat_deg, WALL_DISTANCE_DEG];
        aircraft.push(pattern.aircraft(format!("OTHER{i}"), start, 270.0, goal));
    }
    aircraft
}

/// Returns `n` aircraft from each side, 1.1 zone radii apart, that cross in a grid.
pub(super) fn matrix(n: u32, zone_radius_nm: f64, created_s: f64) -> Vec<ScnAircraft> {
    let pattern = Pattern { kind: "MATRIX", created_s };
    let half_deg = spacing_deg(zone_radius_nm) * (f64::from(n) - 1.0) / 2.0;
    let out_deg = half_deg + MATRIX_APPROACH_S * SPEED_MPS / M_PER_DEG;
    let mut aircraft = Vec::with_capacity(4 * n as usize);
    for i in 0..n {
        let along_deg = f64::from(i) * spacing_deg(zone_radius_nm) - half_deg;
        for (side, start, heading_deg, [lat_deg, lon_deg]) in [
            ("NORTH", [out_deg, along_deg], 180.0, [-out_deg, along_deg]),
            ("SOUTH", [-out_deg, along_deg], 0.0, [out_deg, along_deg]),
            ("EAST", [along_deg, out_deg], 270.0, [along_deg, -out_deg]),
            ("WEST", [along_deg, -out_deg], 90.0, [along_deg, out_deg]),
        ] {
            let goal = LatLon { lat_deg, lon_deg };
            aircraft.push(pattern.aircraft(format!("{side}{i}"), start, heading_deg, goal));
        }
    }
    aircraft
}

/// Returns the distance of neighbors in degrees.
fn spacing_deg(zone_radius_nm: f64) -> f64 {
    SPACING_FACTOR * zone_radius_nm * M_PER_NM / M_PER_DEG
}

/// Common data of the aircraft of one pattern.
struct Pattern {
    kind: &'static str,
    created_s: f64,
}

impl Pattern {
    fn aircraft(
        &self,
        id: String,
        [lat_deg, lon_deg]: [f64; 2],
        heading_deg: f64,
        goal: LatLon,
    ) -> ScnAircraft {
        ScnAircraft {
            id,
            kind: self.kind.to_string(),
            created_s: self.created_s,
            lat_deg,
            lon_deg,
            heading_deg,
            altitude_ft: ALTITUDE_FT,
            speed: Airspeed::CasKt(SPEED_MPS / KNOT_MPS),
            way_points: Vec::new(),
            origin: None,
            destination: Some(PositionRef::At(goal)),
            destination_s: Some(self.created_s),
            changes: Vec::new(),
            settings: Vec::new(),
            deleted_s: None,
        }
    }
}
