//! Shortest paths on the earth: on the surface of the WGS84 ellipsoid, whatever the altitude.
//!
//! Source: T. Vincenty, "Direct and inverse solutions of geodesics on the ellipsoid with application of nested
//! equations", Survey Review 23 (1975). Both solutions are within a millimeter, at the poles and across the date line
//! too. Differences of angles are computed as such, so that a meter is as exact as a continent. Between places that
//! lie nearly opposite each other (within about half a degree) the inverse solution does not converge; there it gives
//! the great circle of the auxiliary sphere, whose length is within 1 % and whose direction leads away from the
//! opposite place, so that whoever flies it soon has an exact one.
//!
//! Directions are unit vectors `[east, north]` at the place where they are meant. All functions come from
//! [`crate::math`], so that results have the same bits on every machine, and those of a pair do not depend on its
//! order, except for the signs of directions.

use crate::geometry::{Point, dot, norm_squared, sub};
use crate::math;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Equatorial radius of WGS84, in meters.
pub const EQUATORIAL_RADIUS_M: f64 = 6_378_137.0;
/// Flattening of WGS84.
pub const FLATTENING: f64 = 1.0 / 298.257_223_563;
/// Distance from the center to a pole, in meters.
pub const POLAR_RADIUS_M: f64 = EQUATORIAL_RADIUS_M * (1.0 - FLATTENING);
/// Smallest radius of curvature of the surface, in meters: that of a meridian at the equator. No two places are
/// nearer to each other than their difference of latitude on a circle of this radius.
pub const MIN_CURVATURE_RADIUS_M: f64 = POLAR_RADIUS_M * (1.0 - FLATTENING);

/// A radius between those of the curvature of the surface, in meters.
const MEAN_RADIUS_M: f64 = 6_371_000.0;
/// Largest length of a straight line in meters from which a path on the surface follows.
const MAX_CHORD_M: f64 = 200_000.0;

/// Difference of two iterates below which they count as the same, in radians: a tenth of a micrometer.
const TOLERANCE_RAD: f64 = 1e-14;
/// Number of iterates after which two places count as opposite.
const MAX_ITERATIONS: usize = 50;
/// Length in meters below which a path has no direction of its own.
const MIN_LENGTH_M: f64 = 1e-7;

/// A place on the ellipsoid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GeoPosition {
    /// Geodetic latitude in radians, positive to the north.
    pub latitude_rad: f64,
    /// Longitude in radians, positive to the east.
    pub longitude_rad: f64,
}

/// The shortest path between two places.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Geodesic {
    /// Its length in meters.
    pub length_m: f64,
    /// The direction in which it leaves the first place.
    pub start: Point<2>,
    /// The direction in which it arrives at the second place.
    pub end: Point<2>,
}

/// A latitude on the auxiliary sphere.
#[derive(Clone, Copy)]
struct ReducedLatitude {
    rad: f64,
    sin: f64,
    cos: f64,
}

impl GeoPosition {
    /// Returns a position from degrees; its longitude is within half a turn.
    pub fn from_degrees(latitude_deg: f64, longitude_deg: f64) -> Self {
        Self {
            latitude_rad: latitude_deg.to_radians(),
            longitude_rad: wrap_longitude_rad(longitude_deg.to_radians()),
        }
    }

    /// Returns latitude and longitude in degrees.
    pub fn to_degrees(self) -> [f64; 2] {
        [self.latitude_rad.to_degrees(), self.longitude_rad.to_degrees()]
    }

    /// Returns its position in space in meters: from the center of the earth to the crossing of equator and prime
    /// meridian, to the equator at 90 degrees east, and to the north pole. No two places are nearer to each other on
    /// the surface than in space.
    pub fn in_space_m(self) -> Point<3> {
        let ReducedLatitude { sin, cos, .. } = self.reduced_latitude();
        let (sin_lon, cos_lon) = math::sin_cos(self.longitude_rad);
        let from_axis_m = EQUATORIAL_RADIUS_M * cos;
        [from_axis_m * cos_lon, from_axis_m * sin_lon, POLAR_RADIUS_M * sin]
    }

    /// Returns the plane that touches the ellipsoid here.
    pub fn tangent_plane(self) -> TangentPlane {
        let (sin_lat, cos_lat) = math::sin_cos(self.latitude_rad);
        let (sin_lon, cos_lon) = math::sin_cos(self.longitude_rad);
        let squeeze = (1.0 - FLATTENING) * (1.0 - FLATTENING);
        // The radius of curvature across the meridian.
        let normal_m = EQUATORIAL_RADIUS_M / (1.0 - (1.0 - squeeze) * sin_lat * sin_lat).sqrt();
        let from_axis_m = normal_m * cos_lat;
        TangentPlane {
            origin: self,
            at_m: [from_axis_m * cos_lon, from_axis_m * sin_lon, squeeze * normal_m * sin_lat],
            east: [-sin_lon, cos_lon, 0.0],
            north: [-sin_lat * cos_lon, -sin_lat * sin_lon, cos_lat],
        }
    }

    fn reduced_latitude(self) -> ReducedLatitude {
        let (sin, cos) = math::sin_cos(self.latitude_rad);
        let rad = math::atan2((1.0 - FLATTENING) * sin, cos);
        let (sin, cos) = math::sin_cos(rad);
        ReducedLatitude { rad, sin, cos }
    }

    fn is_before(&self, other: &Self) -> bool {
        let by_latitude = self.latitude_rad.total_cmp(&other.latitude_rad);
        by_latitude.then(self.longitude_rad.total_cmp(&other.longitude_rad)).is_lt()
    }

    /// Returns the shortest path to another place.
    pub fn geodesic_to(self, other: Self) -> Geodesic {
        if other.is_before(&self) {
            let Geodesic { length_m, start, end } = other.ordered_geodesic_to(self);
            return Geodesic { length_m, start: end.map(|v| -v), end: start.map(|v| -v) };
        }
        self.ordered_geodesic_to(other)
    }

    /// Returns the same from a place to one that does not come before it.
    fn ordered_geodesic_to(self, other: Self) -> Geodesic {
        let (u1, u2) = (self.reduced_latitude(), other.reduced_latitude());
        let difference_rad = wrap_longitude_rad(other.longitude_rad - self.longitude_rad);
        let mut lambda_rad = difference_rad;
        let mut arc = SphereArc::between(u1, u2, lambda_rad);
        for _ in 0..MAX_ITERATIONS {
            if arc.sin_sigma == 0.0 {
                break;
            }
            let next_rad = difference_rad + arc.longitude_excess_rad();
            if next_rad.abs() > PI {
                arc = SphereArc::between(u1, u2, difference_rad);
                break;
            }
            let change_rad = next_rad - lambda_rad;
            lambda_rad = next_rad;
            arc = SphereArc::between(u1, u2, lambda_rad);
            if change_rad.abs() < TOLERANCE_RAD {
                break;
            }
        }
        arc.geodesic(self.latitude_rad, difference_rad)
    }

    /// Returns the place that is reached on a shortest path of a length in a direction, and the direction in which it
    /// arrives there.
    pub fn destination(self, direction: Point<2>, length_m: f64) -> (Self, Point<2>) {
        let [sin_alpha1, cos_alpha1] = direction;
        let u1 = self.reduced_latitude();
        let sigma1_rad = math::atan2(u1.sin, u1.cos * cos_alpha1);
        let sin_alpha = u1.cos * sin_alpha1;
        let series = Series::new(1.0 - sin_alpha * sin_alpha);
        let first_rad = length_m / (POLAR_RADIUS_M * series.a);
        let mut sigma_rad = first_rad;
        for _ in 0..MAX_ITERATIONS {
            let (sin, cos) = math::sin_cos(sigma_rad);
            let cos_2m = math::cos(2.0 * sigma1_rad + sigma_rad);
            let next_rad = first_rad + series.correction_rad(sin, cos, cos_2m);
            let change_rad = next_rad - sigma_rad;
            sigma_rad = next_rad;
            if change_rad.abs() < TOLERANCE_RAD {
                break;
            }
        }
        let (sin, cos) = math::sin_cos(sigma_rad);
        let cos_2m = math::cos(2.0 * sigma1_rad + sigma_rad);
        let backward = u1.sin * sin - u1.cos * cos * cos_alpha1;
        let from_axis = math::hypot(sin_alpha, backward);
        let latitude_rad =
            math::atan2(u1.sin * cos + u1.cos * sin * cos_alpha1, (1.0 - FLATTENING) * from_axis);
        let lambda_rad = math::atan2(sin * sin_alpha1, u1.cos * cos - u1.sin * sin * cos_alpha1);
        let c = series.c;
        let bracket = cos_2m + c * cos * (2.0 * cos_2m * cos_2m - 1.0);
        let difference_rad =
            lambda_rad - (1.0 - c) * FLATTENING * sin_alpha * (sigma_rad + c * sin * bracket);
        let longitude_rad = wrap_longitude_rad(self.longitude_rad + difference_rad);
        let end = unit([sin_alpha, -backward]).unwrap_or([0.0, 1.0]);
        (Self { latitude_rad, longitude_rad }, end)
    }
}

/// The plane that touches the ellipsoid in a place, with its position in space, so that paths to places nearby cost
/// little.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TangentPlane {
    /// The place.
    pub origin: GeoPosition,
    /// Its position in space, see [`GeoPosition::in_space_m`].
    at_m: Point<3>,
    /// Unit vectors to the east and to the north.
    east: Point<3>,
    north: Point<3>,
}

impl TangentPlane {
    /// Returns whether another place is farther away than a limit even on the straight line through the earth: on the
    /// surface it is still farther.
    pub fn is_surely_beyond(&self, other: &Self, limit_m: f64) -> bool {
        norm_squared(sub(other.at_m, self.at_m)) > limit_m * limit_m
    }

    /// Returns the shortest path to the origin of another plane. Up to 200 km it follows from the straight line through
    /// the earth: its length within half a millionth, and its directions, those of normal sections, within a microradian.
    pub fn path_to(&self, other: &Self) -> Geodesic {
        let chord = sub(other.at_m, self.at_m);
        let chord2_m2 = norm_squared(chord);
        if chord2_m2 > MAX_CHORD_M * MAX_CHORD_M {
            return self.origin.geodesic_to(other.origin);
        }
        let start = [dot(chord, self.east), dot(chord, self.north)];
        let end = [dot(chord, other.east), dot(chord, other.north)];
        let length_m =
            chord2_m2.sqrt() * (1.0 + chord2_m2 / (24.0 * MEAN_RADIUS_M * MEAN_RADIUS_M));
        match unit(start).zip(unit(end)).filter(|_| length_m >= MIN_LENGTH_M) {
            Some((start, end)) => Geodesic { length_m, start, end },
            None => {
                // Any direction will do, but it must be one and the same in both planes.
                let end = [dot(self.east, other.east), dot(self.east, other.north)];
                Geodesic { length_m, start: [1.0, 0.0], end: unit(end).unwrap_or([1.0, 0.0]) }
            }
        }
    }
}

/// Vincenty's series for one geodesic, by the square of the cosine of its azimuth at the equator.
struct Series {
    a: f64,
    b: f64,
    c: f64,
}

impl Series {
    fn new(cos2_alpha: f64) -> Self {
        let second_eccentricity2 = (EQUATORIAL_RADIUS_M * EQUATORIAL_RADIUS_M
            - POLAR_RADIUS_M * POLAR_RADIUS_M)
            / (POLAR_RADIUS_M * POLAR_RADIUS_M);
        let u2 = cos2_alpha * second_eccentricity2;
        Self {
            a: 1.0 + u2 / 16384.0 * (4096.0 + u2 * (-768.0 + u2 * (320.0 - 175.0 * u2))),
            b: u2 / 1024.0 * (256.0 + u2 * (-128.0 + u2 * (74.0 - 47.0 * u2))),
            c: FLATTENING / 16.0 * cos2_alpha * (4.0 + FLATTENING * (4.0 - 3.0 * cos2_alpha)),
        }
    }

    /// Returns the difference between the angle on the auxiliary sphere and the scaled length.
    fn correction_rad(&self, sin: f64, cos: f64, cos_2m: f64) -> f64 {
        let b = self.b;
        let first = cos * (2.0 * cos_2m * cos_2m - 1.0);
        let second = b / 6.0 * cos_2m * (4.0 * sin * sin - 3.0) * (4.0 * cos_2m * cos_2m - 3.0);
        b * sin * (cos_2m + b / 4.0 * (first - second))
    }
}

/// A great circle's arc on the auxiliary sphere.
struct SphereArc {
    sin_sigma: f64,
    cos_sigma: f64,
    sigma_rad: f64,
    /// Sine of the azimuth at the equator.
    sin_alpha: f64,
    cos_2m: f64,
    series: Series,
    /// Not normalized: east and north parts of the direction at either end.
    start: Point<2>,
    end: Point<2>,
}

impl SphereArc {
    fn between(u1: ReducedLatitude, u2: ReducedLatitude, lambda_rad: f64) -> Self {
        let (sin_lambda, cos_lambda) = math::sin_cos(lambda_rad);
        let half = math::sin(0.5 * lambda_rad);
        let one_minus_cos = 2.0 * half * half;
        // The difference of latitudes is exact where the places are near each other.
        let north = math::sin(u2.rad - u1.rad);
        let start = [u2.cos * sin_lambda, north + u1.sin * u2.cos * one_minus_cos];
        let end = [u1.cos * sin_lambda, north - u1.cos * u2.sin * one_minus_cos];
        let sin_sigma = math::hypot(start[0], start[1]);
        let cos_sigma = u1.sin * u2.sin + u1.cos * u2.cos * cos_lambda;
        let sin_alpha =
            if sin_sigma > 0.0 { u1.cos * u2.cos * sin_lambda / sin_sigma } else { 0.0 };
        let cos2_alpha = 1.0 - sin_alpha * sin_alpha;
        // On the equator all terms with it vanish.
        let cos_2m =
            if cos2_alpha > 1e-30 { cos_sigma - 2.0 * u1.sin * u2.sin / cos2_alpha } else { 0.0 };
        Self {
            sin_sigma,
            cos_sigma,
            sigma_rad: math::atan2(sin_sigma, cos_sigma),
            sin_alpha,
            cos_2m,
            series: Series::new(cos2_alpha),
            start,
            end,
        }
    }

    /// Returns by how much the difference of longitudes on the auxiliary sphere is larger than on the ellipsoid.
    fn longitude_excess_rad(&self) -> f64 {
        let Self { sin_sigma, cos_sigma, sigma_rad, sin_alpha, cos_2m, series, .. } = self;
        let c = series.c;
        let bracket = cos_2m + c * cos_sigma * (2.0 * cos_2m * cos_2m - 1.0);
        (1.0 - c) * FLATTENING * sin_alpha * (sigma_rad + c * sin_sigma * bracket)
    }

    fn geodesic(&self, latitude_rad: f64, difference_rad: f64) -> Geodesic {
        let Self { sin_sigma, cos_sigma, sigma_rad, cos_2m, series, .. } = self;
        let correction_rad = series.correction_rad(*sin_sigma, *cos_sigma, *cos_2m);
        let length_m = POLAR_RADIUS_M * series.a * (sigma_rad - correction_rad);
        let ends = unit(self.start).zip(unit(self.end));
        match ends.filter(|_| length_m >= MIN_LENGTH_M) {
            Some((start, end)) => Geodesic { length_m, start, end },
            // Any direction will do, but it must be one and the same at both places, whose meridians differ.
            None => {
                let turn_rad = -difference_rad * math::sin(latitude_rad);
                let (sin, cos) = math::sin_cos(turn_rad);
                Geodesic { length_m: length_m.max(0.0), start: [1.0, 0.0], end: [cos, sin] }
            }
        }
    }
}

/// Returns a vector of length 1 in the same direction, if it has one.
fn unit(vector: Point<2>) -> Option<Point<2>> {
    let length = math::hypot(vector[0], vector[1]);
    (length > 0.0).then(|| vector.map(|v| v / length))
}

/// Returns the angle by which a direction turns to the left from one unit vector to another, in radians.
pub fn turn_rad(from: Point<2>, to: Point<2>) -> f64 {
    math::atan2(from[0] * to[1] - from[1] * to[0], dot(from, to))
}

/// Returns a longitude, or a difference of two, in [-pi, pi].
pub fn wrap_longitude_rad(rad: f64) -> f64 {
    if rad.abs() <= PI { rad } else { rad - TAU * (rad / TAU).round() }
}

/// Returns whether a latitude is one.
pub fn is_latitude_rad(rad: f64) -> bool {
    rad.abs() <= FRAC_PI_2
}

#[cfg(test)]
mod tests {
    use super::*;
    use geographiclib_rs::{DirectGeodesic, Geodesic as Oracle, InverseGeodesic};
    use proptest::prelude::*;

    fn oracle(a: GeoPosition, b: GeoPosition) -> (f64, f64, f64) {
        let [lat1, lon1] = a.to_degrees();
        let [lat2, lon2] = b.to_degrees();
        let (length_m, azimuth1, azimuth2, _) = Oracle::wgs84().inverse(lat1, lon1, lat2, lon2);
        (length_m, azimuth1, azimuth2)
    }

    fn azimuth_deg([east, north]: Point<2>) -> f64 {
        math::atan2(east, north).to_degrees()
    }

    fn difference_deg(a: f64, b: f64) -> f64 {
        math::wrap_angle((a - b).to_radians()).to_degrees().abs()
    }

    /// Latitudes anywhere, many of them near the poles and the equator.
    fn latitude_deg() -> impl Strategy<Value = f64> {
        prop_oneof![-90.0f64..=90.0, 89.0f64..=90.0, -90.0f64..=-89.5, -0.2f64..0.2]
    }

    fn longitude_deg() -> impl Strategy<Value = f64> {
        prop_oneof![-180.0f64..=180.0, 179.5f64..=180.0, -180.0f64..=-179.9]
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(1000))]

        #[test]
        fn a_place_at_a_distance_is_where_a_reference_puts_it_and_the_way_back_is_as_long(
            lat in latitude_deg(), lon in longitude_deg(), azimuth in -180.0f64..180.0, log_m in 0.0f64..7.2,
        ) {
            let length_m = math::powf(10.0, log_m);
            let from = GeoPosition::from_degrees(lat, lon);
            let (sin, cos) = math::sin_cos(azimuth.to_radians());
            let (to, end) = from.destination([sin, cos], length_m);
            let (lat2, lon2): (f64, f64) = Oracle::wgs84().direct(lat, lon, azimuth, length_m);
            let off_m = oracle(to, GeoPosition::from_degrees(lat2, lon2)).0;
            prop_assert!(off_m < 1e-3, "{off_m} m");
            let back = from.geodesic_to(to);
            prop_assert!((back.length_m - length_m).abs() < 1e-3, "{} for {length_m}", back.length_m);
            // A micrometer across at either end.
            prop_assert!(turn_rad(back.start, [sin, cos]).abs() * length_m.min(6e6) < 1e-2);
            let arrival_rad = turn_rad(back.end, end).abs();
            prop_assert!(arrival_rad * length_m.min(6e6) < 1e-2 , "{arrival_rad}");
        }

        #[test]
        fn any_two_places_are_as_far_apart_as_a_reference_says(
            lat1 in latitude_deg(), lon1 in longitude_deg(), lat2 in latitude_deg(), lon2 in longitude_deg(),
        ) {
            let a = GeoPosition::from_degrees(lat1, lon1);
            let b = GeoPosition::from_degrees(lat2, lon2);
            let (length_m, azimuth1, azimuth2) = oracle(a, b);
            let found = a.geodesic_to(b);
            if length_m < 1.9e7 {
                prop_assert!((found.length_m - length_m).abs() < 1e-3, "{found:?} {length_m}");
                if (1e3..1.8e7).contains(&length_m) && lat1.abs().max(lat2.abs()) < 89.99 {
                    prop_assert!(difference_deg(azimuth_deg(found.start), azimuth1) < 1e-6);
                    prop_assert!(difference_deg(azimuth_deg(found.end), azimuth2) < 1e-6);
                }
            } else {
                prop_assert!((found.length_m / length_m - 1.0).abs() < 0.01, "{found:?} {length_m}");
            }
            let reverse = b.geodesic_to(a);
            prop_assert_eq!(reverse.length_m.to_bits(), found.length_m.to_bits());
            prop_assert_eq!(reverse.start, found.end.map(|v| -v));
            let chord_m = crate::geometry::norm(crate::geometry::sub(a.in_space_m(), b.in_space_m()));
            prop_assert!(chord_m <= length_m + 1e-6);
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(1000))]

        #[test]
        fn a_path_to_a_place_nearby_is_that_of_a_reference(
            lat in latitude_deg(), lon in longitude_deg(), azimuth in -180.0f64..180.0, log_m in 0.0f64..5.3,
        ) {
            let length_m = math::powf(10.0, log_m);
            let from = GeoPosition::from_degrees(lat, lon);
            let (sin, cos) = math::sin_cos(azimuth.to_radians());
            let (to, end) = from.destination([sin, cos], length_m);
            let (here, there) = (from.tangent_plane(), to.tangent_plane());
            let path = here.path_to(&there);
            prop_assert!((path.length_m / length_m - 1.0).abs() < 5e-7 + 1e-8 / length_m);
            prop_assert!(turn_rad(path.start, [sin, cos]).abs() < 1e-6 + 1e-8 / length_m);
            prop_assert!(turn_rad(path.end, end).abs() < 1e-6 + 1e-8 / length_m);
            let back = there.path_to(&here);
            prop_assert_eq!(back.length_m.to_bits(), path.length_m.to_bits());
            prop_assert_eq!(back.start, path.end.map(|v| -v));
            prop_assert!(!here.is_surely_beyond(&there, length_m + 1e-6));
            prop_assert!(here.is_surely_beyond(&there, 0.99 * length_m));
        }
    }

    #[test]
    fn two_places_that_are_one_differ_by_their_meridians_alone() {
        let pole = |lon: f64| GeoPosition::from_degrees(90.0, lon);
        let same = pole(10.0).geodesic_to(pole(100.0));
        assert!(same.length_m < 1e-6);
        // What is east on the meridian of 10 degrees leads south on that of 100 degrees.
        assert!((turn_rad(same.start, same.end) + FRAC_PI_2).abs() < 1e-12);
        let here = GeoPosition::from_degrees(50.0, 5.0);
        assert_eq!(here.geodesic_to(here).length_m, 0.0);
        assert_eq!(here.destination([0.0, 1.0], 0.0).0.longitude_rad, here.longitude_rad);
    }

    #[test]
    fn over_a_pole_a_path_goes_on_to_the_south() {
        let (there, end) = GeoPosition::from_degrees(89.5, 0.0).destination([0.0, 1.0], 111_694.0);
        assert!((there.longitude_rad.abs() - PI).abs() < 1e-9);
        assert!(end[1] < -0.999);
        assert!((there.latitude_rad.to_degrees() - 89.5).abs() < 1e-3);
    }

    #[test]
    fn bits_are_those_of_every_other_machine() {
        let a = GeoPosition::from_degrees(52.3, 4.76);
        let b = GeoPosition::from_degrees(50.03, 8.57);
        let found = a.geodesic_to(b);
        assert_eq!(found.length_m.to_bits(), 4_690_049_645_176_182_809);
    }
}
