//! Positions of other programs' traffic, as a geographic scenario writes them.

use sidestep_import::local_plane::{LatLon, center};
use sidestep_kernel::geodesy::{GeoPosition, MIN_CURVATURE_RADIUS_M, turn_rad};
use sidestep_kernel::math;

/// Largest number of seconds between two way-points on the path of an aircraft that keeps its heading.
const WAY_POINT_INTERVAL_S: f64 = 120.0;
/// Largest distance in meters by which the shortest path between two of them leads past it.
const MAX_BOW_M: f64 = 5.0;
/// Steps between two of them, in which a path of one heading is followed.
const STEPS: u32 = 4;
/// Latitude in radians beyond which a heading is not kept: at a pole it has no meaning.
const MAX_LATITUDE_RAD: f64 = 1.5;

fn geo_position(at: LatLon) -> GeoPosition {
    GeoPosition::from_degrees(at.lat_deg, at.lon_deg)
}

fn lat_lon(at: GeoPosition) -> LatLon {
    let [lat_deg, lon_deg] = at.to_degrees();
    LatLon { lat_deg, lon_deg }
}

/// Returns a position as it stands in a list of coordinates: latitude and longitude in degrees.
pub(super) fn position_text(at: LatLon) -> String {
    let LatLon { lat_deg, lon_deg } = at;
    format!("{lat_deg:?}, {lon_deg:?}")
}

/// Returns positions as the value of a key.
pub(super) fn positions_text(all: &[LatLon]) -> String {
    let all: Vec<String> = all.iter().map(|at| format!("[{}]", position_text(*at))).collect();
    format!("[{}]", all.join(", "))
}

/// Returns the line that says where drawings of a scenario have their origin: the center of its traffic. `None` without
/// any.
pub(super) fn origin_text(positions: impl IntoIterator<Item = LatLon>) -> Option<String> {
    let LatLon { lat_deg, lon_deg } = center(positions)?;
    Some(format!("origin_deg = {:?}\n", [lat_deg, lon_deg]))
}

/// Returns the position that is reached on the shortest path in a direction clockwise from north.
pub(super) fn straight_ahead(from: LatLon, track_deg: f64, distance_m: f64) -> LatLon {
    let (sin, cos) = math::sin_cos(track_deg.to_radians());
    lat_lon(geo_position(from).destination([sin, cos], distance_m).0)
}

/// Returns way-points of an aircraft that keeps its heading, clockwise from north, for some seconds. Near a pole, where
/// a heading means nothing, it flies straight on.
pub(super) fn path_of_heading(
    from: LatLon,
    heading_deg: f64,
    v_m_s: f64,
    seconds: f64,
) -> Vec<LatLon> {
    let heading_rad = heading_deg.to_radians();
    let longest_m = v_m_s * WAY_POINT_INTERVAL_S;
    let mut left_m = v_m_s * seconds;
    let mut at = geo_position(from);
    let mut path = Vec::new();
    loop {
        let legs = (left_m / longest_m.min(longest_leg_m(at, heading_rad))).ceil().max(1.0);
        let step_m = left_m / legs / f64::from(STEPS);
        for _ in 0..STEPS {
            at = step_along_heading(at, heading_rad, step_m);
        }
        if at.latitude_rad.abs() > MAX_LATITUDE_RAD {
            return vec![straight_ahead(from, heading_deg, v_m_s * seconds)];
        }
        path.push(lat_lon(at));
        if legs <= 1.0 {
            return path;
        }
        left_m -= left_m / legs;
    }
}

/// Returns the length of a shortest path that leads past the path of one heading by [`MAX_BOW_M`]: that bends as much as
/// the meridians close in.
fn longest_leg_m(at: GeoPosition, heading_rad: f64) -> f64 {
    let (sin, cos) = math::sin_cos(at.latitude_rad);
    let bend = (sin / cos * math::sin(heading_rad)).abs() / MIN_CURVATURE_RADIUS_M;
    (8.0 * MAX_BOW_M / bend.max(f64::MIN_POSITIVE)).sqrt()
}

/// Returns the end of a shortest path that has this heading, clockwise from north, in its middle.
fn step_along_heading(from: GeoPosition, heading_rad: f64, step_m: f64) -> GeoPosition {
    let (sin, cos) = math::sin_cos(heading_rad);
    let (_, middle) = from.destination([sin, cos], 0.5 * step_m);
    let (sin, cos) = math::sin_cos(heading_rad + turn_rad([sin, cos], middle));
    from.destination([sin, cos], step_m).0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_heading_that_is_kept_to_the_east_stays_on_its_parallel() {
        let from = LatLon { lat_deg: 60.0, lon_deg: 179.0 };
        let path = path_of_heading(from, 90.0, 250.0, 1800.0);
        assert_eq!(path.len(), 38);
        let last = path[37];
        assert!((last.lat_deg - 60.0).abs() < 1e-6, "{last:?}");
        assert!(last.lon_deg < -172.0, "{last:?}");
        let straight = straight_ahead(from, 90.0, 450_000.0);
        assert!(straight.lat_deg < 59.8, "the shortest path leads to the south: {straight:?}");
        let middle = geo_position(path[1]).geodesic_to(geo_position(path[2]));
        let (there, _) = geo_position(path[1]).destination(middle.start, 0.5 * middle.length_m);
        let bow_m = (there.latitude_rad - 60f64.to_radians()).abs() * MIN_CURVATURE_RADIUS_M;
        assert!((1.0..=MAX_BOW_M).contains(&bow_m), "{bow_m} m");
        assert_eq!(path_of_heading(from, 0.0, 250.0, 1800.0).len(), 15, "along a meridian");
        let over_the_pole = LatLon { lat_deg: 89.5, lon_deg: 0.0 };
        assert_eq!(path_of_heading(over_the_pole, 0.0, 250.0, 1800.0).len(), 1);
    }
}
