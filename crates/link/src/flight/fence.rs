//! The area that an aircraft must not leave.

use sidestep::kernel::geometry::sub;
use sidestep::worlds::airspace::flight::{Point, Pose2, Surface, coordinates_from_degrees};
use sidestep_session::fleet::FenceSettings;

/// A fence: a circle, a polygon and a band of altitudes, as far as they are given.
#[derive(Debug, Clone)]
pub struct Fence {
    surface: Surface,
    circle: Option<(Point, f64)>,
    polygon: Vec<Point>,
    altitude_m: Option<[f64; 2]>,
}

impl Fence {
    /// Returns the fence of some settings.
    ///
    /// # Errors
    /// When they are no area, with the reason.
    pub fn new(settings: &FenceSettings, surface: Surface) -> Result<Self, String> {
        let place = |given: [f64; 2]| match surface {
            Surface::Plane => given,
            Surface::Earth => coordinates_from_degrees(given),
        };
        let is_finite = |point: &[f64; 2]| point.iter().all(|x| x.is_finite());
        let mut corners = settings.polygon.iter().chain(settings.circle.iter().map(|(at, _)| at));
        if !corners.all(is_finite) {
            return Err("a place in it is no number".into());
        }
        let is_radius = |radius_m: f64| radius_m > 0.0 && radius_m.is_finite();
        if settings.circle.is_some_and(|(_, radius_m)| !is_radius(radius_m)) {
            return Err("its radius is not above 0".into());
        }
        if (1..3).contains(&settings.polygon.len()) {
            return Err("a polygon has at least 3 corners".into());
        }
        let is_band = |[low, high]: [f64; 2]| low < high;
        if settings.altitude_m.is_some_and(|band| !is_band(band)) {
            return Err("its lowest altitude is not below its highest".into());
        }
        Ok(Self {
            surface,
            circle: settings.circle.map(|(at, radius_m)| (place(at), radius_m)),
            polygon: settings.polygon.iter().copied().map(place).collect(),
            altitude_m: settings.altitude_m,
        })
    }

    /// Returns whether a place and an altitude are inside.
    pub fn contains(&self, at: Point, altitude_m: f64) -> bool {
        let is_on_level =
            self.altitude_m.is_none_or(|[low, high]| (low..=high).contains(&altitude_m));
        let is_in_circle = self
            .circle
            .is_none_or(|(center, radius_m)| self.surface.distance_m(center, at) <= radius_m);
        is_on_level && is_in_circle && self.is_in_polygon(at)
    }

    /// Returns whether an aircraft is inside, and will be after some seconds as it flies now.
    pub fn keeps(&self, pose: Pose2, altitude_m: f64, ahead_m: f64) -> bool {
        let frame = self.surface.frame_at(pose.at);
        let local = frame.pose_to_local(pose);
        let ahead = [
            local.at[0] + ahead_m * local.heading_rad.cos(),
            local.at[1] + ahead_m * local.heading_rad.sin(),
        ];
        self.contains(pose.at, altitude_m) && self.contains(frame.to_world(ahead), altitude_m)
    }

    /// Returns whether a place is inside of the polygon, if there is one: a ray to the east crosses an odd number of edges.
    fn is_in_polygon(&self, at: Point) -> bool {
        if self.polygon.is_empty() {
            return true;
        }
        let mut is_inside = false;
        let mut from = self.polygon[self.polygon.len() - 1];
        for &to in &self.polygon {
            let is_crossing = (from[1] > at[1]) != (to[1] > at[1]);
            let [dx, dy] = sub(to, from);
            if is_crossing && at[0] < from[0] + dx * (at[1] - from[1]) / dy {
                is_inside = !is_inside;
            }
            from = to;
        }
        is_inside
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn fence(settings: &FenceSettings) -> Fence {
        Fence::new(settings, Surface::Plane).expect("a fence")
    }

    #[test]
    fn a_place_is_inside_of_all_that_is_given() {
        let all = FenceSettings {
            circle: Some(([0.0, 0.0], 100.0)),
            polygon: vec![[-50.0, -200.0], [200.0, -200.0], [200.0, 200.0], [-50.0, 200.0]],
            altitude_m: Some([10.0, 50.0]),
        };
        let fence = fence(&all);
        assert!(fence.contains([20.0, 20.0], 30.0));
        for (at, altitude_m) in [([-60.0, 0.0], 30.0), ([99.0, 99.0], 30.0), ([20.0, 20.0], 51.0)] {
            assert!(!fence.contains(at, altitude_m), "{at:?} {altitude_m}");
        }
        assert!(!fence.contains([f64::NAN, 0.0], 30.0), "no place at all");
        let east = Pose2 { at: [95.0, 0.0], heading_rad: 0.0 };
        assert!(fence.keeps(east, 30.0, 4.0) && !fence.keeps(east, 30.0, 6.0));
    }

    #[test]
    fn what_is_no_area_is_refused_by_what_is_wrong() {
        let refused =
            |settings: FenceSettings| Fence::new(&settings, Surface::Plane).expect_err("refused");
        let polygon = vec![[0.0, 0.0], [1.0, 0.0]];
        let circle = Some(([0.0, 0.0], 0.0));
        let altitude_m = Some([5.0, 5.0]);
        assert!(refused(FenceSettings { polygon, ..Default::default() }).contains("3 corners"));
        assert!(refused(FenceSettings { circle, ..Default::default() }).contains("radius"));
        assert!(refused(FenceSettings { altitude_m, ..Default::default() }).contains("altitude"));
        let circle = Some(([f64::NAN, 0.0], 9.0));
        assert!(refused(FenceSettings { circle, ..Default::default() }).contains("no number"));
    }

    #[test]
    fn on_the_earth_places_are_latitudes_and_longitudes() {
        let circle = Some(([50.0, 14.0], 1000.0));
        let settings = FenceSettings { circle, ..FenceSettings::default() };
        let fence = Fence::new(&settings, Surface::Earth).expect("a fence");
        assert!(fence.contains(coordinates_from_degrees([50.005, 14.0]), 0.0));
        assert!(!fence.contains(coordinates_from_degrees([50.02, 14.0]), 0.0));
    }

    proptest! {
        /// A square turned by any angle holds what its turned-back place says.
        #[test]
        fn a_polygon_is_the_same_however_it_is_turned(
            angle in 0.0f64..6.3, x in -2.0f64..2.0, y in -2.0f64..2.0,
        ) {
            prop_assume!((x.abs() - 1.0).abs() > 1e-6 && (y.abs() - 1.0).abs() > 1e-6);
            let turn = |[x, y]: [f64; 2]| [x * angle.cos() - y * angle.sin(), x * angle.sin() + y * angle.cos()];
            let square = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
            let settings = FenceSettings { polygon: square.map(turn).to_vec(), ..FenceSettings::default() };
            prop_assert_eq!(fence(&settings).contains(turn([x, y]), 0.0), x.abs() < 1.0 && y.abs() < 1.0);
        }
    }
}
