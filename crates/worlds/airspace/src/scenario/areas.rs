//! Areas to stay out of, or inside of: from keys, and from a GeoJSON file.

use super::compile::Compiler;
use crate::areas::{Area, AreaKind, AreaShape, Areas, find_crossing};
use crate::flight::{FlightLevelRange, Point, Surface, coordinates_from_degrees, distance_m};
use crate::flight_plan::{BoundedPoint, BoundedTime, LatLonDeg};
use schemars::JsonSchema;
use serde::Deserialize;
use sidestep_import::geojson::{self, GeoArea, GeoAreas};
use sidestep_import::local_plane::{LatLon, LocalPlane};
use sidestep_kernel::InputError;
use sidestep_kernel::geometry::{lerp, sub};
use sidestep_scenario::{Closed, FixedList, LeftOpen, Number, Point as PointKey, Source, Spanned};
use std::ops::Range;
use std::path::Path;
use std::sync::Arc;

/// Largest number of areas: each is looked at for each airplane.
const MAX_AREAS: usize = 10_000;
/// Largest number of corners of an area: the borders near an airplane are looked at for each of its plans.
const MAX_CORNERS: usize = 100_000;
/// Largest distance in meters of a corner from the center of an area on the earth: beyond it no plane is like the earth.
const MAX_EARTH_RADIUS_M: f64 = 1e6;
/// Largest radius of a circle on the earth in meters: beyond it, its border near an airplane is no longer an arc in the
/// plane there.
const MAX_EARTH_CIRCLE_M: f64 = 100_000.0;
/// Length in meters of the pieces into which edges on the earth are divided, so that each piece of a shortest path is
/// straight in all planes near it to within centimeters.
const EARTH_PIECE_M: f64 = 5_000.0;
/// Largest component of the velocity of an area in meters per second, as in its section.
const MAX_SPEED_M_S: f64 = 1000.0;
/// Smallest extent of an area in meters: in a smaller one no border can be told from another.
const MIN_EXTENT_M: f64 = 1e-3;

/// An area to stay out of, or inside of.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub(super) struct AreaSection {
    /// Its name.
    name: Option<String>,
    /// Whether airplanes stay out of it, or inside of it.
    kind: AreaKind,
    /// Its corners.
    polygon_m: Option<Spanned<Vec<BoundedPoint>>>,
    /// Its corners on the earth, as latitudes and longitudes.
    polygon_deg: Option<Spanned<Vec<LatLonDeg>>>,
    circle: Option<Spanned<CircleSection>>,
    /// The levels between which it counts.
    levels_m: Option<Spanned<FixedList<f64, 2>>>,
    /// Time when it begins.
    from_s: Option<BoundedTime>,
    /// Time when it ends.
    until_s: Option<Spanned<BoundedTime>>,
    /// How it moves to the east and to the north, from where it is when it begins.
    velocity_m_s: Option<PointKey<2, Closed<-1000, 1000>>>,
}

/// A circle as the outline of an area.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct CircleSection {
    /// Its center.
    at_m: Option<BoundedPoint>,
    /// Its center on the earth, as latitude and longitude.
    at_deg: Option<LatLonDeg>,
    /// Its radius.
    radius_m: Number<LeftOpen<0, 1_000_000>>,
}

/// Returns the content of the file of areas that a scenario names, if it names one.
pub(super) fn load_areas_file(
    source: &Source,
    file: Option<&Spanned<String>>,
) -> Result<Option<GeoAreas>, InputError> {
    let Some(file) = file else { return Ok(None) };
    let found = geojson::load(&source.path(file.get_ref().as_ref()));
    found.map(Some).map_err(|error| source.with_key_at(file.span(), error))
}

/// The outline of an area in coordinates of the scenario.
pub(super) enum Outline {
    Circle {
        center: Point,
        radius_m: f64,
    },
    /// Rings of corners, the last not a repetition of the first.
    Rings(Vec<Vec<Point>>),
}

/// Why an outline is none.
pub(super) struct OutlineError {
    pub(super) cause: String,
    pub(super) remedy: &'static str,
}

impl OutlineError {
    fn new(cause: impl Into<String>, remedy: &'static str) -> Self {
        Self { cause: cause.into(), remedy }
    }
}

impl Compiler<'_> {
    /// Returns the areas of a scenario over a surface.
    pub(super) fn areas(&self, surface: Surface) -> Result<Areas, InputError> {
        let sections = &self.file.airspace.areas;
        let mut areas = Vec::with_capacity(sections.len());
        for section in sections {
            areas.push(Arc::new(self.area(section, surface)?));
        }
        if let Some((file, found)) =
            self.file.airspace.areas_file.as_ref().zip(self.areas_of_file())
        {
            let path = self.source.path(file.get_ref().as_ref());
            for one in &found.areas {
                let area = self.area_of_file(&path, one, surface);
                let area = area.map_err(|error| self.source.with_key_at(file.span(), error))?;
                areas.push(Arc::new(area));
            }
        }
        if areas.len() > MAX_AREAS {
            let cause = format!("{} areas, of at most {MAX_AREAS}", areas.len());
            return Err(self.source.error(None, cause, "leave out areas"));
        }
        Ok(areas.into())
    }

    /// Returns an area of a GeoJSON file.
    fn area_of_file(
        &self,
        path: &Path,
        given: &GeoArea,
        surface: Surface,
    ) -> Result<Area, InputError> {
        let name = given.name.as_deref().unwrap_or("an area without a name");
        let error = |cause: String, remedy: &str| {
            InputError::new(path.display(), format!("{name}: {cause}"), remedy)
        };
        let to_coordinates = self.coordinates_of_file(path, surface)?;
        let rings = given.rings.iter().map(|ring| ring.iter().map(&to_coordinates).collect());
        let (shape, center) = shape_of_outline(Outline::Rings(rings.collect()), surface)
            .map_err(|OutlineError { cause, remedy }| error(cause, remedy))?;
        let levels = FlightLevelRange {
            low_m: given.floor_m.unwrap_or(f64::NEG_INFINITY),
            high_m: given.ceiling_m.unwrap_or(f64::INFINITY),
        };
        if levels.low_m >= levels.high_m {
            let cause = format!("levels from {} to {} m", levels.low_m, levels.high_m);
            return Err(error(cause, "give a ceiling above the floor"));
        }
        let from_s = given.from_s.unwrap_or(0.0).max(0.0);
        let until_s = given.until_s.unwrap_or(f64::INFINITY);
        if until_s <= from_s {
            let cause = format!("it begins at {from_s} s and ends at {until_s} s");
            return Err(error(cause, "give an end after its begin and after the start of the run"));
        }
        let velocity_m_s = given.velocity_m_s.unwrap_or_default();
        if velocity_m_s.iter().any(|speed| speed.abs() > MAX_SPEED_M_S) {
            let cause = format!("a velocity of {velocity_m_s:?} m/s");
            return Err(error(cause, "give at most 1000 m/s"));
        }
        let kind = if given.is_fence { AreaKind::In } else { AreaKind::Out };
        let name = given.name.clone();
        Ok(Area { name, kind, shape, center, levels, from_s, until_s, velocity_m_s })
    }

    /// Returns how positions of a file on the earth become coordinates of the scenario.
    pub(super) fn coordinates_of_file(
        &self,
        path: &Path,
        surface: Surface,
    ) -> Result<impl Fn(&LatLon) -> Point, InputError> {
        let origin_deg = self.file.airspace.origin_deg.as_ref().map(|at| at.get_ref().get());
        let plane = match (surface, origin_deg) {
            (Surface::Earth, _) => None,
            (Surface::Plane, Some([lat_deg, lon_deg])) => {
                Some(LocalPlane::centered_at(LatLon { lat_deg, lon_deg }))
            }
            (Surface::Plane, None) => {
                let cause =
                    "has positions on the earth, and the scenario is a plane without an origin";
                let remedy = "give airspace.origin_deg = [latitude, longitude], or all airplanes at_deg and \
                              way_points_deg";
                return Err(InputError::new(path.display(), cause, remedy));
            }
        };
        Ok(move |at: &LatLon| match &plane {
            Some(plane) => plane.to_plane_m(*at),
            None => coordinates_from_degrees([at.lat_deg, at.lon_deg]),
        })
    }

    fn area(&self, section: &Spanned<AreaSection>, surface: Surface) -> Result<Area, InputError> {
        let given = section.get_ref();
        let error = |span: Range<usize>, cause: String, remedy: &str| {
            Err(self.source.error(span, cause, remedy))
        };
        let (outline, span) = self.outline(section, surface)?;
        let (shape, center) = match shape_of_outline(outline, surface) {
            Ok(shape) => shape,
            Err(OutlineError { cause, remedy }) => return error(span, cause, remedy),
        };
        let levels = match &given.levels_m {
            Some(levels) => {
                let [low_m, high_m] = levels.get_ref().get();
                if low_m.is_nan() || high_m.is_nan() || low_m >= high_m {
                    let cause = format!("levels from {low_m} to {high_m} m");
                    return error(levels.span(), cause, "give [lowest, highest], in meters");
                }
                FlightLevelRange { low_m, high_m }
            }
            None => FlightLevelRange::ALL,
        };
        let from_s = given.from_s.map_or(0.0, f64::from);
        let until_s = match &given.until_s {
            Some(until_s) if until_s.get_ref().get() <= from_s => {
                let cause = format!("an area that ends at {} s", until_s.get_ref().get());
                let remedy = format!("give a time after from_s, which is {from_s} s");
                return error(until_s.span(), cause, &remedy);
            }
            Some(until_s) => until_s.get_ref().get(),
            None => f64::INFINITY,
        };
        Ok(Area {
            name: given.name.clone(),
            kind: given.kind,
            shape,
            center,
            levels,
            from_s,
            until_s,
            velocity_m_s: given.velocity_m_s.map_or([0.0; 2], PointKey::get),
        })
    }

    /// Returns the outline of an area, and where it stands.
    fn outline(
        &self,
        section: &Spanned<AreaSection>,
        surface: Surface,
    ) -> Result<(Outline, Range<usize>), InputError> {
        let AreaSection { polygon_m, polygon_deg, circle, .. } = section.get_ref();
        let count = [polygon_m.is_some(), polygon_deg.is_some(), circle.is_some()];
        if count.into_iter().filter(|is_given| *is_given).count() != 1 {
            let cause = "an area has one outline";
            let remedy = "give just one of polygon_m = [[x, y], ...], polygon_deg = [[latitude, longitude], ...] and \
                          circle = { at_m = [x, y], radius_m = r }";
            return Err(self.source.error(section.span(), cause, remedy));
        }
        let on = |own: Surface, span: Range<usize>| {
            if own == surface { Ok(()) } else { Err(self.mixed_surfaces(surface, span)) }
        };
        if let Some(polygon) = polygon_m {
            on(Surface::Plane, polygon.span())?;
            let corners = polygon.get_ref().iter().map(|corner| corner.get()).collect();
            return Ok((Outline::Rings(vec![corners]), polygon.span()));
        }
        if let Some(polygon) = polygon_deg {
            on(Surface::Earth, polygon.span())?;
            let mut corners = Vec::with_capacity(polygon.get_ref().len());
            for corner in polygon.get_ref() {
                corners.push(self.area_coordinates(*corner, polygon.span())?);
            }
            return Ok((Outline::Rings(vec![corners]), polygon.span()));
        }
        let circle = circle.as_ref().expect("one of the three is given");
        let radius_m = circle.get_ref().radius_m.get();
        let center = match circle.get_ref() {
            CircleSection { at_m: Some(at), at_deg: None, .. } => {
                on(Surface::Plane, circle.span())?;
                at.get()
            }
            CircleSection { at_m: None, at_deg: Some(at), .. } => {
                on(Surface::Earth, circle.span())?;
                self.area_coordinates(*at, circle.span())?
            }
            _ => {
                let remedy = "give just one of at_m = [x, y] and at_deg = [latitude, longitude]";
                return Err(self.source.error(circle.span(), "a circle has one center", remedy));
            }
        };
        Ok((Outline::Circle { center, radius_m }, circle.span()))
    }

    /// Returns the error of an area that is not on the surface of the airplanes.
    fn mixed_surfaces(&self, surface: Surface, span: Range<usize>) -> InputError {
        let (cause, remedy) = match surface {
            Surface::Plane => (
                "an area in degrees beside airplanes in meters",
                "give polygon_m = [[x, y], ...] or circle = { at_m = [x, y], radius_m = r }, or the airplanes at_deg",
            ),
            Surface::Earth => (
                "an area in meters beside airplanes in degrees",
                "give polygon_deg = [[latitude, longitude], ...] or circle = { at_deg = [latitude, longitude], \
                 radius_m = r }, or the airplanes at_m",
            ),
        };
        self.source.error(span, cause, remedy)
    }

    fn area_coordinates(&self, at: LatLonDeg, span: Range<usize>) -> Result<Point, InputError> {
        let lat_lon_deg = at.get();
        if lat_lon_deg[0].abs() <= 90.0 {
            return Ok(coordinates_from_degrees(lat_lon_deg));
        }
        let cause = format!("a latitude of {} degrees", lat_lon_deg[0]);
        let remedy = "give [latitude, longitude], the latitude from -90 to 90";
        Err(self.source.error(span, cause, remedy))
    }
}

/// Returns the shape of an area with this outline, and where its center is.
pub(super) fn shape_of_outline(
    outline: Outline,
    surface: Surface,
) -> Result<(AreaShape, Point), OutlineError> {
    let rings = match outline {
        Outline::Circle { radius_m, .. }
            if surface == Surface::Earth && radius_m > MAX_EARTH_CIRCLE_M =>
        {
            let cause = format!("a circle of {:.0} km on the earth", 1e-3 * radius_m);
            return Err(OutlineError::new(cause, "give at most 100 km, or a polygon"));
        }
        Outline::Circle { center, radius_m } => {
            return Ok((AreaShape::Circle { radius_m }, center));
        }
        Outline::Rings(rings) => rings,
    };
    let mut corners: Vec<Vec<Point>> = Vec::with_capacity(rings.len());
    for mut ring in rings {
        // Many close a ring by its first corner.
        ring.dedup();
        while ring.len() > 1 && ring.first() == ring.last() {
            ring.pop();
        }
        if ring.len() < 3 {
            let cause = format!("a polygon of {} different corners", ring.len());
            return Err(OutlineError::new(cause, "give at least three corners"));
        }
        corners.push(ring);
    }
    if corners.iter().map(Vec::len).sum::<usize>() > MAX_CORNERS {
        let cause = format!("a polygon of more than {MAX_CORNERS} corners");
        return Err(OutlineError::new(cause, "give fewer corners"));
    }
    let first = corners[0][0];
    let frame = surface.frame_at(first);
    let about_first: Vec<Vec<Point>> = corners
        .iter()
        .map(|ring| ring.iter().map(|&corner| frame.to_local(corner)).collect())
        .collect();
    let center = frame.to_world(middle(&about_first));
    let frame = surface.frame_at(center);
    let origin = frame.to_local(center);
    let rings: Vec<Vec<Point>> = corners
        .iter()
        .map(|ring| match surface {
            Surface::Plane => ring.iter().map(|&corner| sub(corner, origin)).collect(),
            Surface::Earth => {
                divided(ring).into_iter().map(|corner| frame.to_local(corner)).collect()
            }
        })
        .collect();
    let shape = AreaShape::from_rings(rings);
    if surface == Surface::Earth && shape.radius_m() > MAX_EARTH_RADIUS_M {
        let cause = format!("a polygon of {:.0} km on the earth", 2e-3 * shape.radius_m());
        return Err(OutlineError::new(cause, "divide it into areas of at most 2000 km"));
    }
    if shape.radius_m() < MIN_EXTENT_M {
        return Err(OutlineError::new("a polygon without extent", "give corners that are apart"));
    }
    if let Some([x, y]) = find_crossing(&shape) {
        let cause = format!(
            "a polygon whose border crosses itself, {x:.0} m to the east and {y:.0} m to the north of its middle"
        );
        return Err(OutlineError::new(
            cause,
            "give the corners in the order in which the border passes them",
        ));
    }
    Ok((shape, center))
}

/// Returns the middle of the smallest upright rectangle around some rings.
fn middle(rings: &[Vec<Point>]) -> Point {
    let mut low = [f64::INFINITY; 2];
    let mut high = [f64::NEG_INFINITY; 2];
    for corner in rings.iter().flatten() {
        for k in 0..2 {
            low[k] = low[k].min(corner[k]);
            high[k] = high[k].max(corner[k]);
        }
    }
    lerp(low, high, 0.5)
}

/// Returns the corners of a ring on the earth with further ones on the shortest paths between them.
fn divided(ring: &[Point]) -> Vec<Point> {
    let mut divided = Vec::with_capacity(ring.len());
    for (k, &corner) in ring.iter().enumerate() {
        let frame = Surface::Earth.frame_at(corner);
        let next = frame.to_local(ring[(k + 1) % ring.len()]);
        // The conversion saturates.
        let pieces = (distance_m([0.0; 2], next) / EARTH_PIECE_M).ceil().max(1.0) as usize;
        divided.push(corner);
        for piece in 1..pieces.min(MAX_CORNERS) {
            divided.push(frame.to_world(lerp([0.0; 2], next, piece as f64 / pieces as f64)));
        }
    }
    divided
}
