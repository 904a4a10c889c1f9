//! Where on earth, and when, the things of a run are.

use crate::geodesy::{GeoPosition, turn_rad};
use crate::math;
use serde::{Deserialize, Serialize};

/// Smallest cosine of a latitude by which an equirectangular map is inverted.
const MIN_COSINE: f64 = 1e-9;

/// Where on earth, and when, a run is, as far as its scenario says so.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct EarthReference {
    /// How positions in meters stand for places on earth.
    pub chart: Option<EarthChart>,
    /// Time of the run's start, in seconds since 1970, UTC.
    pub start_utc_s: Option<f64>,
}

/// A map of the earth: x east and y north of its origin, in meters.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct EarthChart {
    /// Latitude and longitude of the origin, in degrees.
    pub origin_deg: [f64; 2],
    /// How places are projected.
    pub projection: EarthProjection,
}

/// How places on earth are projected to a plane.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum EarthProjection {
    /// Each place lies as far from the origin, and in the direction, in which it is on the WGS84 ellipsoid.
    AzimuthalEquidistant,
    /// Latitudes and longitudes of a sphere of this radius in meters, longitudes as long as at the origin.
    Equirectangular {
        /// Radius of the sphere.
        radius_m: f64,
    },
}

impl EarthChart {
    /// Returns latitude and longitude of a place on the map, in degrees.
    pub fn lat_lon_deg(&self, [x_m, y_m]: [f64; 2]) -> [f64; 2] {
        let [lat_deg, lon_deg] = self.origin_deg;
        match self.projection {
            EarthProjection::AzimuthalEquidistant => {
                let origin = GeoPosition::from_degrees(lat_deg, lon_deg);
                let length_m = math::hypot(x_m, y_m);
                if length_m == 0.0 {
                    return origin.to_degrees();
                }
                let direction = [x_m / length_m, y_m / length_m];
                origin.destination(direction, length_m).0.to_degrees()
            }
            EarthProjection::Equirectangular { radius_m } => {
                let east_scale = math::cos(lat_deg.to_radians()).max(MIN_COSINE);
                let east_deg = (x_m / (radius_m * east_scale)).to_degrees();
                let place = GeoPosition::from_degrees(
                    lat_deg + (y_m / radius_m).to_degrees(),
                    lon_deg + east_deg,
                );
                place.to_degrees()
            }
        }
    }
}

impl EarthChart {
    /// Returns the heading on earth, counterclockwise from the true east at a place on the map, of a heading on the map.
    pub fn true_heading_rad(&self, [x_m, y_m]: [f64; 2], heading_rad: f64) -> f64 {
        let [lat_deg, lon_deg] = self.origin_deg;
        let length_m = math::hypot(x_m, y_m);
        if self.projection != EarthProjection::AzimuthalEquidistant || length_m == 0.0 {
            return heading_rad;
        }
        let origin = GeoPosition::from_degrees(lat_deg, lon_deg);
        let direction = [x_m / length_m, y_m / length_m];
        heading_rad + turn_rad(direction, origin.destination(direction, length_m).1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_place_on_the_map_is_one_on_earth() {
        let origin_deg = [52.0, 179.9];
        let round = EarthChart { origin_deg, projection: EarthProjection::AzimuthalEquidistant };
        assert_eq!(round.lat_lon_deg([0.0, 0.0]).map(|deg| (deg * 1e9).round() / 1e9), origin_deg);
        let [lat, lon] = round.lat_lon_deg([50_000.0, 0.0]);
        assert!(lat < 52.0 && lat > 51.99 && (lon + 179.372).abs() < 1e-3, "{lat} {lon}");
        let projection = EarthProjection::Equirectangular { radius_m: 6_371_000.0 };
        let flat = EarthChart { origin_deg, projection };
        let [lat, lon] = flat.lat_lon_deg([50_000.0, 111_194.9]);
        assert!((lat - 53.0).abs() < 1e-5 && (lon + 179.370).abs() < 1e-3, "{lat} {lon}");
    }
}
