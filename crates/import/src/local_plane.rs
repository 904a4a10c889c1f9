//! A flat map of a part of the earth: latitude and longitude to meters east and north.

use sidestep_kernel::math;

/// The mean radius of the earth, in meters.
pub const EARTH_RADIUS_M: f64 = 6_371_000.0;

/// The smallest cosine of a center's latitude, so that a plane at a pole stays invertible.
const MIN_COSINE: f64 = 1e-9;

/// A position on the earth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LatLon {
    /// Latitude in degrees, + to the north.
    pub lat_deg: f64,
    /// Longitude in degrees, + to the east.
    pub lon_deg: f64,
}

/// The plane that touches a sphere of radius [`EARTH_RADIUS_M`] in its center: x east, y north.
///
/// The projection is equirectangular. North-south distances are those of the sphere; east-west ones
/// are those at the center's latitude, so at a place `d` meters further north they are too long by
/// the fraction `d * tan(latitude) / radius`: per 100 km 0.9 % at 30 degrees, 2.1 % at 52 degrees,
/// and none at the equator, where the error is of second order (0.01 % at 100 km). The earth's
/// flattening adds up to 0.7 %. Not for use near the poles.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LocalPlane {
    center: LatLon,
    /// Cosine of the center's latitude.
    east_scale: f64,
}

impl LocalPlane {
    /// Creates the plane around `center`, which becomes its origin.
    pub fn centered_at(center: LatLon) -> Self {
        let east_scale = math::cos(center.lat_deg.to_radians()).max(MIN_COSINE);
        Self { center, east_scale }
    }

    /// Creates the plane around the [`center`] of `positions`, where there are any.
    pub fn from_positions(positions: impl IntoIterator<Item = LatLon>) -> Option<Self> {
        center(positions).map(Self::centered_at)
    }

    /// Returns the position of the origin.
    pub fn center(&self) -> LatLon {
        self.center
    }

    /// Returns the meters east and north of the center, across the date line where that is shorter.
    pub fn to_plane_m(&self, position: LatLon) -> [f64; 2] {
        let east_deg = wrap_deg(position.lon_deg - self.center.lon_deg);
        let north_deg = position.lat_deg - self.center.lat_deg;
        [
            EARTH_RADIUS_M * self.east_scale * east_deg.to_radians(),
            EARTH_RADIUS_M * north_deg.to_radians(),
        ]
    }

    /// Returns the position at `[east, north]` meters from the center; its longitude is in [-180,
    /// 180).
    pub fn to_lat_lon(&self, [east_m, north_m]: [f64; 2]) -> LatLon {
        let east_deg = (east_m / (EARTH_RADIUS_M * self.east_scale)).to_degrees();
        LatLon {
            lat_deg: self.center.lat_deg + (north_m / EARTH_RADIUS_M).to_degrees(),
            lon_deg: wrap_deg(self.center.lon_deg + east_deg),
        }
    }
}

/// Returns the center of `positions`, where there are any: the direction of the sum of their unit
/// vectors from the earth's center, which is correct across the date line.
pub fn center(positions: impl IntoIterator<Item = LatLon>) -> Option<LatLon> {
    let mut sum = [0.0; 3];
    let mut is_empty = true;
    for position in positions {
        is_empty = false;
        let lat = position.lat_deg.to_radians();
        let lon = position.lon_deg.to_radians();
        sum[0] += math::cos(lat) * math::cos(lon);
        sum[1] += math::cos(lat) * math::sin(lon);
        sum[2] += math::sin(lat);
    }
    let [x, y, z] = sum;
    (!is_empty).then(|| LatLon {
        lat_deg: math::atan2(z, math::hypot(x, y)).to_degrees(),
        lon_deg: wrap_deg(math::atan2(y, x).to_degrees()),
    })
}

/// Returns a longitude or a difference of two, in [-180, 180).
pub(super) fn wrap_deg(deg: f64) -> f64 {
    let shifted = (deg + 180.0).rem_euclid(360.0);
    // rem_euclid may round up to the modulus itself, which is outside the range.
    if shifted >= 360.0 { -180.0 } else { shifted - 180.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(lat_deg: f64, lon_deg: f64) -> LatLon {
        LatLon { lat_deg, lon_deg }
    }

    /// The distance on the sphere, in m.
    fn great_circle_m(a: LatLon, b: LatLon) -> f64 {
        let half = |deg: f64| math::sin(deg.to_radians() / 2.0);
        let (dlat, dlon) = (half(b.lat_deg - a.lat_deg), half(b.lon_deg - a.lon_deg));
        let shrink = math::cos(a.lat_deg.to_radians()) * math::cos(b.lat_deg.to_radians());
        2.0 * EARTH_RADIUS_M * math::asin((dlat * dlat + shrink * dlon * dlon).sqrt())
    }

    #[test]
    fn a_degree_north_is_111_km_and_one_east_shrinks_with_latitude() {
        let plane = LocalPlane::centered_at(at(60.0, 4.0));
        let [east, north] = plane.to_plane_m(at(61.0, 5.0));
        assert!((north - 111_194.9).abs() < 0.1, "{north}");
        assert!((east - 111_194.9 / 2.0).abs() < 0.1, "{east}");
        assert_eq!(plane.to_plane_m(plane.center()), [0.0, 0.0]);
    }

    #[test]
    fn there_and_back_is_the_same_place_even_across_the_date_line() {
        for center in [at(47.0, 8.0), at(-33.0, 179.9), at(0.0, -180.0)] {
            let plane = LocalPlane::centered_at(center);
            for point in [[0.0, 0.0], [30_000.0, -70_000.0], [-90_000.0, 10.0]] {
                let back = plane.to_plane_m(plane.to_lat_lon(point));
                assert!((back[0] - point[0]).abs() < 1e-3, "{back:?}");
                assert!((back[1] - point[1]).abs() < 1e-3, "{back:?}");
            }
        }
    }

    #[test]
    fn the_center_of_two_places_on_both_sides_of_the_date_line_is_on_it() {
        let plane = LocalPlane::from_positions([at(0.0, 179.5), at(0.0, -179.5)]).unwrap();
        assert!((plane.center().lon_deg.abs() - 180.0).abs() < 1e-9);
        let [east, _] = plane.to_plane_m(at(0.0, -179.5));
        assert!((east - 55_597.5).abs() < 0.1, "{east}");
        let [west, _] = plane.to_plane_m(at(0.0, 179.5));
        assert!((west + 55_597.5).abs() < 0.1, "{west}");
        assert_eq!(center([]), None);
    }

    #[test]
    fn the_error_of_the_plane_is_the_documented_one() {
        let north_deg = 100_000.0 / 111_194.9;
        for (lat_deg, fraction) in [(0.0, 0.000_13), (30.0, 0.0092), (52.0, 0.0206)] {
            let plane = LocalPlane::centered_at(at(lat_deg, 10.0));
            let (a, b) = (at(lat_deg + north_deg, 10.0), at(lat_deg + north_deg, 10.1));
            let length = plane.to_plane_m(b)[0] - plane.to_plane_m(a)[0];
            let excess = length / great_circle_m(a, b) - 1.0;
            assert!((excess - fraction).abs() < 0.000_3, "{lat_deg}: {excess}");
        }
    }
}
