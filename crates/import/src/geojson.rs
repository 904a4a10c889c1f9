//! Areas of the airspace in GeoJSON (RFC 7946): polygons, each with what is said of it.
//!
//! A file is a `FeatureCollection`, a `Feature`, or a geometry; polygons and multi-polygons are read, with their holes.
//! Positions are longitude and latitude, in this order. These properties of a feature are read:
//!
//! | property | meaning |
//! |---|---|
//! | `name` | its name |
//! | `kind` | `out`, to stay out of it, or `in`, to stay inside of it |
//! | `floor_m`, `ceiling_m` | the levels between which it counts, in meters; also `floor_ft` and `ceiling_ft`, in feet |
//! | `from_s`, `until_s` | when it begins and ends, in seconds after the start of the run |
//! | `velocity_m_s` | how it moves to the east and to the north, as a list of two numbers |
//!
//! Everything else is counted in the import report.

use crate::local_plane::LatLon;
use crate::report::{ImportReport, Treatment};
use geojson::{Feature, GeoJson, Geometry, GeometryValue, Position};
use serde_json::Value;
use sidestep_kernel::InputError;
use sidestep_scenario::file::read_text;
use std::path::Path;

/// The maximum size of a file in bytes: the airspaces of a continent take a tenth of that.
const MAX_BYTES: u64 = 64 << 20;
/// Meters of a foot.
const FOOT_M: f64 = 0.3048;
const PROPERTIES: &str = "the properties that are read are name, kind, floor_m, ceiling_m, floor_ft, ceiling_ft, \
                          from_s, until_s and velocity_m_s";

/// An area of a file.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct GeoArea {
    /// Its name, if it has one.
    pub name: Option<String>,
    /// Whether airplanes have to stay inside of it, instead of out of it.
    pub is_fence: bool,
    /// Closed rings of corners, without a repetition of the first: outlines, and holes in them.
    pub rings: Vec<Vec<LatLon>>,
    /// The lowest of its levels, in meters.
    pub floor_m: Option<f64>,
    /// The highest of its levels, in meters.
    pub ceiling_m: Option<f64>,
    /// When it begins, in seconds after the start.
    pub from_s: Option<f64>,
    /// When it ends, in seconds after the start.
    pub until_s: Option<f64>,
    /// How it moves to the east and to the north, in meters per second.
    pub velocity_m_s: Option<[f64; 2]>,
}

/// The content of a file of areas.
#[derive(Debug, Clone, PartialEq)]
pub struct GeoAreas {
    /// Its areas, in the order of the file.
    pub areas: Vec<GeoArea>,
    /// What became of the file.
    pub report: ImportReport,
}

/// Returns the areas of the file at `path`.
///
/// # Errors
/// When it cannot be read, or is no GeoJSON.
pub fn load(path: &Path) -> Result<GeoAreas, InputError> {
    parse(&path.display().to_string(), &read_text(path, MAX_BYTES)?)
}

/// Returns the areas of a text; `place` names it in errors.
///
/// # Errors
/// When it is no GeoJSON.
pub fn parse(place: &str, text: &str) -> Result<GeoAreas, InputError> {
    let json: GeoJson = text.parse().map_err(|error: geojson::Error| {
        let remedy = "give a FeatureCollection of polygons as RFC 7946 has it";
        InputError::new(place, format!("is no GeoJSON: {error}"), remedy)
    })?;
    let mut reader = Reader { areas: Vec::new(), report: ImportReport::new("GeoJSON (RFC 7946)") };
    match json {
        GeoJson::FeatureCollection(all) => {
            for (k, feature) in all.features.iter().enumerate() {
                reader.read_feature(feature, &format!("feature {k}"));
            }
        }
        GeoJson::Feature(feature) => reader.read_feature(&feature, "the feature"),
        GeoJson::Geometry(geometry) => {
            reader.read_geometry(&geometry, &GeoArea::default(), "the geometry");
        }
    }
    let Reader { areas, mut report } = reader;
    report.add_kept("areas", areas.len());
    Ok(GeoAreas { areas, report })
}

struct Reader {
    areas: Vec<GeoArea>,
    report: ImportReport,
}

impl Reader {
    fn read_feature(&mut self, feature: &Feature, place: &str) {
        let mut area = GeoArea::default();
        for (name, value) in feature.properties.iter().flatten() {
            self.read_property(&mut area, name, value, place);
        }
        match &feature.geometry {
            Some(geometry) => self.read_geometry(geometry, &area, place),
            None => self.drop("features without a geometry", place, ""),
        }
    }

    fn read_property(&mut self, area: &mut GeoArea, name: &str, value: &Value, place: &str) {
        if value.is_null() {
            return;
        }
        let number = value.as_f64();
        let is_read = match name {
            "name" => {
                area.name = value.as_str().map(str::to_owned);
                area.name.is_some()
            }
            "kind" => {
                area.is_fence = value.as_str() == Some("in");
                matches!(value.as_str(), Some("in" | "out"))
            }
            "floor_m" => set(&mut area.floor_m, number),
            "ceiling_m" => set(&mut area.ceiling_m, number),
            "floor_ft" => set(&mut area.floor_m, number.map(|feet| FOOT_M * feet)),
            "ceiling_ft" => set(&mut area.ceiling_m, number.map(|feet| FOOT_M * feet)),
            "from_s" => set(&mut area.from_s, number),
            "until_s" => set(&mut area.until_s, number),
            "velocity_m_s" => {
                let both = value.as_array().filter(|all| all.len() == 2);
                let velocity = both.and_then(|all| Some([all[0].as_f64()?, all[1].as_f64()?]));
                set(&mut area.velocity_m_s, velocity)
            }
            _ => {
                let rule = format!("the property `{name}`");
                return self.report.record(Treatment::NotUsed, rule, place, PROPERTIES);
            }
        };
        if !is_read {
            let rule = format!("values of the property `{name}` that it cannot have");
            self.drop(
                &rule,
                place,
                "give texts for name and kind, which is out or in, and numbers for the others",
            );
        }
    }

    fn read_geometry(&mut self, geometry: &Geometry, area: &GeoArea, place: &str) {
        match &geometry.value {
            GeometryValue::Polygon { coordinates } => self.add(area, [coordinates], place),
            GeometryValue::MultiPolygon { coordinates } => self.add(area, coordinates, place),
            GeometryValue::GeometryCollection { geometries } => {
                geometries.iter().for_each(|one| self.read_geometry(one, area, place));
            }
            other => {
                let rule = format!("geometries of type {}", other.type_name());
                self.drop(&rule, place, "give polygons; a circle is a polygon of many corners");
            }
        }
    }

    /// Adds an area of some polygons.
    fn add<'a>(
        &mut self,
        area: &GeoArea,
        polygons: impl IntoIterator<Item = &'a Vec<Vec<Position>>>,
        place: &str,
    ) {
        let mut rings = Vec::new();
        for ring in polygons.into_iter().flatten() {
            let mut corners: Vec<LatLon> = Vec::with_capacity(ring.len());
            for position in ring {
                let Some(corner) = lat_lon(position) else {
                    let remedy = "give [longitude, latitude] in degrees";
                    self.drop("areas with positions that are none on the earth", place, remedy);
                    return;
                };
                if position.as_slice().len() > 2 {
                    let remedy = "give floor_m and ceiling_m";
                    self.report.record(Treatment::NotUsed, "heights of positions", place, remedy);
                }
                corners.push(corner);
            }
            if corners.len() > 1 && corners.first() == corners.last() {
                corners.pop();
            } else {
                self.report.record(Treatment::Repaired, "rings that are not closed", place, "");
            }
            if corners.len() < 3 {
                self.drop("areas with rings of fewer than three corners", place, "");
                return;
            }
            rings.push(corners);
        }
        if rings.is_empty() {
            self.drop("areas without corners", place, "");
            return;
        }
        self.areas.push(GeoArea { rings, ..area.clone() });
    }

    fn drop(&mut self, rule: &str, place: &str, remedy: &str) {
        self.report.record(Treatment::Dropped, rule, place, remedy);
    }
}

/// Sets a value, if there is one; returns whether there is.
fn set<T>(to: &mut Option<T>, value: Option<T>) -> bool {
    let is_given = value.is_some();
    *to = value.or(to.take());
    is_given
}

/// Returns a position, if it is one on the earth.
fn lat_lon(position: &Position) -> Option<LatLon> {
    let [lon_deg, lat_deg, ..] = *position.as_slice() else { return None };
    let is_on_earth = lat_deg.abs() <= 90.0 && lon_deg.abs() <= 360.0;
    is_on_earth.then_some(LatLon { lat_deg, lon_deg })
}

#[cfg(test)]
mod tests {
    use super::*;

    const SQUARE: &str = "[[[14.0, 50.0], [14.2, 50.0], [14.2, 50.1], [14.0, 50.1], [14.0, 50.0]]]";

    fn feature(geometry: &str, properties: &str) -> String {
        format!(
            "{{ \"type\": \"Feature\", \"geometry\": {geometry}, \"properties\": {{ {properties} }} }}"
        )
    }

    fn polygon(coordinates: &str) -> String {
        format!("{{ \"type\": \"Polygon\", \"coordinates\": {coordinates} }}")
    }

    #[test]
    fn polygons_are_read_with_longitude_first_and_their_properties() {
        let properties = "\"name\": \"TSA 12\", \"kind\": \"in\", \"floor_ft\": 10000, \"ceiling_m\": 5000, \
                          \"from_s\": 60, \"until_s\": 600.5, \"velocity_m_s\": [3, -4], \"class\": \"D\"";
        let found = parse("a.geojson", &feature(&polygon(SQUARE), properties)).expect("GeoJSON");
        let [area] = &found.areas[..] else { panic!("one") };
        assert_eq!(area.name.as_deref(), Some("TSA 12"));
        assert!(area.is_fence);
        assert_eq!(area.rings.len(), 1);
        assert_eq!(area.rings[0].len(), 4, "the last corner is the first one");
        assert_eq!(area.rings[0][1], LatLon { lat_deg: 50.0, lon_deg: 14.2 });
        assert_eq!((area.floor_m, area.ceiling_m), (Some(3048.0), Some(5000.0)));
        assert_eq!((area.from_s, area.until_s), (Some(60.0), Some(600.5)));
        assert_eq!(area.velocity_m_s, Some([3.0, -4.0]));
        let rules: Vec<&str> = found.report.findings.iter().map(|one| &one.rule[..]).collect();
        assert_eq!(rules, ["the property `class`"]);
    }

    #[test]
    fn collections_multi_polygons_and_holes_are_read_and_the_rest_is_counted() {
        let hole = "[[[14.0, 50.0], [14.2, 50.0], [14.2, 50.1]], [[14.1, 50.02], [14.15, 50.02], [14.15, 50.05], [14.1, 50.02]]]";
        let multi =
            format!("{{ \"type\": \"MultiPolygon\", \"coordinates\": [{SQUARE}, {hole}] }}");
        let point = "{ \"type\": \"Point\", \"coordinates\": [14, 50] }";
        let wrong = polygon("[[[14.0, 95.0], [14.2, 50.0], [14.2, 50.1], [14.0, 95.0]]]");
        let features = [
            feature(&multi, "\"kind\": 5"),
            feature(point, ""),
            feature("null", ""),
            feature(&wrong, ""),
            feature(&polygon(SQUARE), "\"name\": null"),
        ];
        let text = format!(
            "{{ \"type\": \"FeatureCollection\", \"features\": [{}] }}",
            features.join(",")
        );
        let found = parse("a.geojson", &text).expect("GeoJSON");
        assert_eq!(found.areas.iter().map(|area| area.rings.len()).collect::<Vec<_>>(), [3, 1]);
        assert_eq!(found.report.dropped(), 4, "{:?}", found.report);
        let repaired =
            found.report.findings.iter().find(|one| one.treatment == Treatment::Repaired);
        assert_eq!(repaired.map(|one| one.count), Some(1), "one ring is not closed");
    }

    #[test]
    fn what_is_no_geojson_is_refused() {
        for text in ["", "[]", "{}", "{ \"type\": \"Topology\" }", "{ \"type\": \"Polygon\" }"] {
            let error = parse("a.geojson", text).expect_err(text).to_string();
            assert!(error.contains("is no GeoJSON"), "{error}");
        }
    }
}
