//! The scenario's coordinates and those of the earth.

use sidestep::kernel::geodesy::is_latitude_rad;
use sidestep::kernel::math::wrap_angle;
use sidestep::worlds::airspace::flight::{Frame, Pose2, Surface, coordinates_from_degrees};
use std::f64::consts::{FRAC_PI_2, TAU};

/// Units of latitude and longitude in a degree, as MAVLink counts them.
const UNITS_PER_DEGREE: f64 = 1e7;

/// The place on the earth at which the origin of a plane lies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Origin {
    /// Geodetic latitude in degrees.
    pub latitude_deg: f64,
    /// Longitude in degrees.
    pub longitude_deg: f64,
    /// Altitude above mean sea level at which the scenario's altitudes begin, in meters; without one they are above the
    /// home of the vehicle.
    pub altitude_m: Option<f64>,
}

impl Origin {
    /// Reads `LATITUDE,LONGITUDE` or `LATITUDE,LONGITUDE,ALTITUDE`, in degrees and meters.
    ///
    /// # Errors
    /// With what is wrong.
    pub fn parse(text: &str) -> Result<Self, String> {
        let form = "give LATITUDE,LONGITUDE or LATITUDE,LONGITUDE,ALTITUDE in degrees and meters above mean sea level, \
                    as in 47.3977,8.5456,488";
        let mut numbers = Vec::new();
        for part in text.split(',') {
            let number = part.trim().parse::<f64>().ok().filter(|number| number.is_finite());
            numbers.push(number.ok_or_else(|| format!("`{part}` is no number: {form}"))?);
        }
        if !(2..=3).contains(&numbers.len()) {
            return Err(format!("it has {} numbers: {form}", numbers.len()));
        }
        let latitude_deg = numbers[0];
        let longitude_deg = numbers[1];
        if !is_latitude_rad(latitude_deg.to_radians()) || longitude_deg.abs() > 180.0 {
            return Err(format!("it is no place on the earth: {form}"));
        }
        Ok(Self { latitude_deg, longitude_deg, altitude_m: numbers.get(2).copied() })
    }
}

/// What altitudes of a scenario are above.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Datum {
    /// Mean sea level.
    Sea,
    /// A place at an altitude above mean sea level, in meters.
    Place(f64),
    /// The home of the vehicle, where it was armed.
    Home,
}

/// Where the coordinates of a scenario are on the earth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GeoFrame {
    /// The plane of the scenario; none where its coordinates are longitude and latitude.
    plane: Option<Frame>,
    datum: Datum,
}

/// A place and a direction on the earth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct GeoPose {
    /// Longitude and latitude in radians.
    pub at: [f64; 2],
    /// Counterclockwise from the true east.
    pub heading_rad: f64,
}

/// Altitudes that a vehicle tells, in meters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct VehicleAltitude {
    /// Above mean sea level.
    pub sea_m: f64,
    /// Above its home.
    pub home_m: f64,
}

/// An altitude that a vehicle is told, in meters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum AltitudeTarget {
    /// Above mean sea level.
    Sea(f64),
    /// Above its home.
    Home(f64),
}

impl GeoFrame {
    /// Returns the frame of a scenario on a surface.
    ///
    /// # Errors
    /// When a plane has no origin, or the earth has one.
    pub fn new(surface: Surface, origin: Option<Origin>) -> Result<Self, String> {
        match (surface, origin) {
            (Surface::Earth, None) => Ok(Self { plane: None, datum: Datum::Sea }),
            (Surface::Earth, Some(_)) => {
                Err("the scenario is on the earth already: leave the origin out".into())
            }
            (Surface::Plane, None) => {
                Err("the scenario is on a plane: say where its origin lies on the earth, as LATITUDE,LONGITUDE".into())
            }
            (Surface::Plane, Some(origin)) => {
                let at = coordinates_from_degrees([origin.latitude_deg, origin.longitude_deg]);
                let datum = origin.altitude_m.map_or(Datum::Home, Datum::Place);
                Ok(Self { plane: Some(Surface::Earth.frame_at(at)), datum })
            }
        }
    }

    /// Returns a pose in the scenario's coordinates.
    pub(super) fn to_scenario(self, pose: GeoPose) -> Pose2 {
        let pose = Pose2 { at: pose.at, heading_rad: pose.heading_rad };
        self.plane.map_or(pose, |plane| plane.pose_to_local(pose))
    }

    /// Returns a pose of the scenario on the earth.
    pub(super) fn to_earth(self, pose: Pose2) -> GeoPose {
        let pose = self.plane.map_or(pose, |plane| plane.pose_to_world(pose));
        GeoPose { at: pose.at, heading_rad: pose.heading_rad }
    }

    /// Returns the altitude in the scenario's datum, in meters.
    pub(super) fn altitude_m(self, altitude: VehicleAltitude) -> f64 {
        match self.datum {
            Datum::Sea => altitude.sea_m,
            Datum::Place(place_m) => altitude.sea_m - place_m,
            Datum::Home => altitude.home_m,
        }
    }

    /// Returns what a vehicle is told so that it is at an altitude of the scenario's datum.
    pub(super) fn altitude_target(self, altitude_m: f64) -> AltitudeTarget {
        match self.datum {
            Datum::Sea => AltitudeTarget::Sea(altitude_m),
            Datum::Place(place_m) => AltitudeTarget::Sea(place_m + altitude_m),
            Datum::Home => AltitudeTarget::Home(altitude_m),
        }
    }
}

impl GeoPose {
    /// Returns latitude and longitude as MAVLink counts them, in 1e-7 degrees: a centimeter.
    pub(super) fn units(self) -> [i32; 2] {
        let units = |rad: f64| (rad.to_degrees() * UNITS_PER_DEGREE).round() as i32;
        [units(self.at[1]), units(self.at[0])]
    }

    /// Returns the compass direction in radians, clockwise from the true north, in [0, 2 pi).
    pub(super) fn compass_rad(self) -> f64 {
        compass_rad(self.heading_rad)
    }
}

/// Returns the direction clockwise from the north of one counterclockwise from the east, in [0, 2 pi).
pub(super) fn compass_rad(heading_rad: f64) -> f64 {
    (FRAC_PI_2 - heading_rad).rem_euclid(TAU)
}

/// Returns the direction counterclockwise from the east of one clockwise from the north, within half a turn.
pub(super) fn heading_rad(compass_rad: f64) -> f64 {
    wrap_angle(FRAC_PI_2 - compass_rad)
}

/// Returns longitude and latitude in radians of a latitude and a longitude in 1e-7 degrees; none if they are no place.
pub(super) fn place_of_units([latitude, longitude]: [i32; 2]) -> Option<[f64; 2]> {
    let degrees = |units: i32| f64::from(units) / UNITS_PER_DEGREE;
    let latitude_deg = degrees(latitude);
    let longitude_deg = degrees(longitude);
    let is_place = latitude_deg.abs() <= 90.0 && longitude_deg.abs() <= 180.0;
    // Autopilots send zeros before they know where they are.
    let is_known = latitude != 0 || longitude != 0;
    (is_place && is_known).then(|| coordinates_from_degrees([latitude_deg, longitude_deg]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_origin_has_two_or_three_numbers_of_a_place() {
        let origin = Origin { latitude_deg: 47.4, longitude_deg: -8.5, altitude_m: None };
        assert_eq!(Origin::parse("47.4, -8.5"), Ok(origin));
        let high = Origin { altitude_m: Some(488.0), ..origin };
        assert_eq!(Origin::parse("47.4,-8.5,488"), Ok(high));
        for (text, cause) in [
            ("47.4", "1 numbers"),
            ("a,b", "no number"),
            ("91,0", "no place"),
            ("1,2,3,4", "4 numbers"),
        ] {
            let error = Origin::parse(text).expect_err(text);
            assert!(error.contains(cause), "{text}: {error}");
        }
    }

    #[test]
    fn a_plane_goes_to_the_earth_and_back_within_a_centimeter() {
        let origin = Origin { latitude_deg: 47.4, longitude_deg: 8.5, altitude_m: Some(488.0) };
        let frame = GeoFrame::new(Surface::Plane, Some(origin)).expect("an origin");
        let pose = Pose2 { at: [3000.0, -2000.0], heading_rad: 1.0 };
        let there = frame.to_earth(pose);
        let at = place_of_units(there.units()).expect("a place");
        let back = frame.to_scenario(GeoPose { at, ..there });
        let off = [0, 1].map(|k| (back.at[k] - pose.at[k]).abs());
        assert!(off.iter().all(|off| *off < 0.01), "{back:?}");
        assert!((back.heading_rad - 1.0).abs() < 1e-6);
        let altitude = VehicleAltitude { sea_m: 500.0, home_m: 10.0 };
        assert_eq!(frame.altitude_m(altitude), 12.0);
        assert_eq!(frame.altitude_target(12.0), AltitudeTarget::Sea(500.0));
    }

    #[test]
    fn a_plane_needs_an_origin_and_the_earth_has_none() {
        let origin = Origin { latitude_deg: 0.0, longitude_deg: 0.0, altitude_m: None };
        assert!(GeoFrame::new(Surface::Plane, None).is_err());
        assert!(GeoFrame::new(Surface::Earth, Some(origin)).is_err());
        let frame = GeoFrame::new(Surface::Plane, Some(origin)).expect("an origin");
        let altitude = VehicleAltitude { sea_m: 500.0, home_m: 10.0 };
        assert_eq!(frame.altitude_m(altitude), 10.0);
        assert_eq!(frame.altitude_target(10.0), AltitudeTarget::Home(10.0));
    }

    #[test]
    fn compass_directions_are_clockwise_from_the_north() {
        assert_eq!(compass_rad(FRAC_PI_2), 0.0);
        assert_eq!(compass_rad(0.0), FRAC_PI_2);
        assert_eq!(compass_rad(-FRAC_PI_2), 2.0 * FRAC_PI_2);
        assert_eq!(heading_rad(FRAC_PI_2), 0.0);
        assert_eq!(heading_rad(4.0 * FRAC_PI_2), FRAC_PI_2);
    }
}
