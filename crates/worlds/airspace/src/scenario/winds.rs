//! Winds: one for all, layers by altitude, and grids from a file; and what cannot be flown in them.

use super::compile::Compiler;
use crate::flight::{
    AirplaneStart, FlightLevelRange, FlightTask, Point, Surface, WindField, WindGridError, WindNode,
};
use crate::flight_plan::BoundedNumber;
use crate::world::AirspaceWorld;
use schemars::JsonSchema;
use serde::Deserialize;
use sidestep_import::local_plane::LatLon;
use sidestep_import::table::{CsvRow, CsvTable};
use sidestep_kernel::{InputError, math};
use sidestep_scenario::{Point as PointKey, Source, Spanned};
use std::ops::Range;
use std::path::Path;
use std::sync::Arc;

/// Largest number of winds: as many as a grid of 100 times 100 places on 100 levels has.
const MAX_WINDS: usize = 1_000_000;
/// Largest coordinate and altitude of a file in meters, and speed of the air in meters per second.
const MAX_COORDINATE_M: f64 = 1e9;
const MAX_WIND_M_S: f64 = 1000.0;

/// A wind at an altitude.
#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct WindLayerSection {
    /// Altitude.
    altitude_m: BoundedNumber,
    /// The wind there, east and north.
    wind_m_s: PointKey<2>,
}

/// The table of a file of winds.
#[derive(Debug)]
pub(super) struct WindTable {
    pub(super) rows: Vec<WindRow>,
    places: WindPlaces,
    place: String,
}

/// A wind of a file, as it stands there.
#[derive(Debug, Clone, Copy)]
pub(super) struct WindRow {
    altitude_m: f64,
    /// As [`WindPlaces`] says; zero where there are no places.
    at: [f64; 2],
    velocity_m_s: Point,
    line: usize,
}

/// The form in which a file gives places.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum WindPlaces {
    /// None: the wind is the same in all places.
    None,
    /// `x_m` and `y_m`.
    Plane,
    /// `latitude_deg` and `longitude_deg`.
    Earth,
}

/// Reads the file of winds that a scenario names, if it names one.
pub(super) fn load_wind_file(
    source: &Source,
    file: Option<&Spanned<String>>,
) -> Result<Option<WindTable>, InputError> {
    let Some(file) = file else { return Ok(None) };
    let found = WindTable::read(&source.path(file.get_ref().as_ref()));
    found.map(Some).map_err(|error| source.with_key_at(file.span(), error))
}

impl WindTable {
    fn read(path: &Path) -> Result<Self, InputError> {
        Self::from_csv(&CsvTable::read(path)?)
    }

    fn from_csv(table: &CsvTable) -> Result<Self, InputError> {
        let wind = table.columns(["east_m_s", "north_m_s"])?;
        let altitude = table.find("altitude_m");
        let has = |name: &str| table.find(name).is_some();
        let (places, columns) = if has("x_m") || has("y_m") {
            (WindPlaces::Plane, Some(table.columns(["x_m", "y_m"])?))
        } else if has("latitude_deg") || has("longitude_deg") {
            (WindPlaces::Earth, Some(table.columns(["latitude_deg", "longitude_deg"])?))
        } else {
            (WindPlaces::None, None)
        };
        let known =
            ["east_m_s", "north_m_s", "altitude_m", "x_m", "y_m", "latitude_deg", "longitude_deg"];
        let is_mixed = places == WindPlaces::Plane && (has("latitude_deg") || has("longitude_deg"));
        if let Some(name) = table.header().iter().find(|name| !known.contains(&name.as_str())) {
            let cause = format!("a column {name:?}, which a file of winds does not have");
            let remedy = "give altitude_m, x_m and y_m or latitude_deg and longitude_deg, east_m_s and north_m_s";
            return Err(
                InputError::new(table.place(), cause, remedy).with_position(table.header_line(), 1)
            );
        }
        if is_mixed {
            let remedy = "give either x_m and y_m or latitude_deg and longitude_deg";
            let cause = "places on a plane beside places on the earth";
            return Err(
                InputError::new(table.place(), cause, remedy).with_position(table.header_line(), 1)
            );
        }
        let mut rows = Vec::new();
        for row in table.rows() {
            if rows.len() == MAX_WINDS {
                let cause = format!("more than {MAX_WINDS} winds");
                return Err(InputError::new(table.place(), cause, "give a coarser grid"));
            }
            let at_most = |column: usize, most: f64| bounded(&row, column, most);
            let altitude_m =
                altitude.map(|column| at_most(column, MAX_COORDINATE_M)).transpose()?;
            let at = match columns {
                None => [0.0; 2],
                Some([first, second]) if places == WindPlaces::Plane => {
                    [at_most(first, MAX_COORDINATE_M)?, at_most(second, MAX_COORDINATE_M)?]
                }
                Some([latitude, longitude]) => {
                    [at_most(latitude, 90.0)?, at_most(longitude, 360.0)?]
                }
            };
            let velocity_m_s = [at_most(wind[0], MAX_WIND_M_S)?, at_most(wind[1], MAX_WIND_M_S)?];
            let altitude_m = altitude_m.unwrap_or_default();
            rows.push(WindRow { altitude_m, at, velocity_m_s, line: row.line() });
        }
        if rows.is_empty() {
            return Err(InputError::new(
                table.place(),
                "no wind",
                "give a row for each level and place",
            ));
        }
        Ok(Self { rows, places, place: table.place().to_string() })
    }

    fn error(&self, line: Option<usize>, cause: String, remedy: &str) -> InputError {
        let error = InputError::new(&self.place, cause, remedy);
        match line {
            Some(line) => error.with_position(line, 1),
            None => error,
        }
    }
}

/// Returns a number of a row, which is at most so large, positive or negative.
fn bounded(row: &CsvRow<'_>, column: usize, most: f64) -> Result<f64, InputError> {
    let field = row.field(column);
    let number = field.number(&row.place())?;
    if number.abs() <= most {
        return Ok(number);
    }
    let remedy = format!("give a number from -{most} to {most}");
    Err(field.error(&row.place(), format!("{number} is too large"), &remedy))
}

/// The wind of a scenario.
#[derive(Debug, Default)]
pub(super) struct CompiledWind {
    /// The wind that is the same everywhere, or the middle of those that are not.
    pub(super) wind_m_s: Point,
    pub(super) field: Option<Arc<WindField>>,
}

impl Compiler<'_> {
    /// Returns the wind of a scenario over a surface.
    ///
    /// # Errors
    /// When it is given in two ways, is no grid, or an airplane cannot fly against it.
    pub(super) fn wind(
        &self,
        surface: Surface,
        airplanes: &[AirplaneStart],
    ) -> Result<CompiledWind, InputError> {
        let section = &self.file.airspace;
        let given = section.wind_m_s.as_ref();
        let layers = &section.winds;
        let Some(span) = self.wind_field_span() else {
            let wind_m_s = given.map_or([0.0; 2], |given| given.get_ref().get());
            let speed_m_s = math::hypot(wind_m_s[0], wind_m_s[1]);
            self.check_wind(speed_m_s, given.map(Spanned::span), airplanes)?;
            return Ok(CompiledWind { wind_m_s, field: None });
        };
        let are_both = !layers.is_empty() && section.wind_file.is_some();
        if given.is_some() || are_both {
            let cause = "a wind that is given in two ways";
            let remedy = "give one of wind_m_s, winds and wind_file";
            return Err(self.source.error(span, cause, remedy));
        }
        let field = match (&section.wind_file, &self.recipe.wind_file) {
            (Some(file), Some(table)) => {
                let field = self.field_of_table(table, surface);
                field.map_err(|error| self.source.with_key_at(file.span(), error))?
            }
            _ => self.field_of_layers(layers, surface)?,
        };
        self.check_field_speed(&field, span, airplanes)?;
        Ok(CompiledWind { wind_m_s: field.middle_m_s, field: Some(Arc::new(field)) })
    }

    /// Returns where a wind is given that differs from level to level or from place to place.
    fn wind_field_span(&self) -> Option<Range<usize>> {
        let section = &self.file.airspace;
        let layers = section.winds.first().map(Spanned::span);
        layers.or_else(|| section.wind_file.as_ref().map(Spanned::span))
    }

    /// Returns the wind of some layers, of which there is one at least.
    pub(super) fn field_of_layers(
        &self,
        layers: &[Spanned<WindLayerSection>],
        surface: Surface,
    ) -> Result<WindField, InputError> {
        let nodes: Vec<WindNode> = layers
            .iter()
            .map(|layer| WindNode {
                altitude_m: layer.get_ref().altitude_m.get(),
                at: [0.0; 2],
                velocity_m_s: layer.get_ref().wind_m_s.get(),
            })
            .collect();
        WindField::new(surface, &nodes).map_err(|error| {
            let number = match error {
                WindGridError::Twice(number) => number,
                // Each layer is a level of its own.
                WindGridError::Missing { .. } => 0,
            };
            let cause = format!("two winds at an altitude of {} m", nodes[number].altitude_m);
            let remedy = "give one wind for each altitude; between altitudes it changes steadily";
            self.source.error(layers[number].span(), cause, remedy)
        })
    }

    fn field_of_table(&self, table: &WindTable, surface: Surface) -> Result<WindField, InputError> {
        if table.places == WindPlaces::Plane && surface == Surface::Earth {
            let cause = "places on a plane, and a scenario on the earth".to_string();
            return Err(table.error(None, cause, "give latitude_deg and longitude_deg"));
        }
        let on_earth = match table.places {
            WindPlaces::Earth => Some(self.coordinates_of_file(Path::new(&table.place), surface)?),
            WindPlaces::None | WindPlaces::Plane => None,
        };
        let first_lon_deg = table.rows[0].at[1];
        let nodes: Vec<WindNode> = table
            .rows
            .iter()
            .map(|row| WindNode {
                altitude_m: row.altitude_m,
                at: match &on_earth {
                    None => row.at,
                    Some(to_coordinates) => {
                        let at = LatLon { lat_deg: row.at[0], lon_deg: row.at[1] };
                        let [x, y] = to_coordinates(&at);
                        match surface {
                            Surface::Plane => [x, y],
                            // A grid may lie across the date line.
                            Surface::Earth => [unwrapped_rad(row.at[1], first_lon_deg), y],
                        }
                    }
                },
                velocity_m_s: row.velocity_m_s,
            })
            .collect();
        WindField::new(surface, &nodes).map_err(|error| match error {
            WindGridError::Twice(number) => {
                let cause = "a second wind on this level in this place".to_string();
                table.error(Some(table.rows[number].line), cause, "leave one of the two out")
            }
            WindGridError::Missing { nodes } => {
                let cause = format!(
                    "{} winds, and a grid of {nodes} levels and places",
                    table.rows.len()
                );
                let remedy = "give a row for each altitude_m at each combination of the two coordinates that occur";
                table.error(None, cause, remedy)
            }
        })
    }

    /// Refuses winds against which an airplane cannot fly on the levels that it comes to.
    pub(super) fn check_field_speed(
        &self,
        field: &WindField,
        span: Range<usize>,
        airplanes: &[AirplaneStart],
    ) -> Result<(), InputError> {
        for airplane in airplanes {
            let speed_m_s = field.max_speed_on_levels_m_s(planned_levels(airplane));
            self.check_wind(speed_m_s, Some(span.clone()), std::slice::from_ref(airplane))?;
        }
        Ok(())
    }

    /// Refuses a wind against which an airplane cannot fly.
    pub(super) fn check_wind(
        &self,
        wind_speed_m_s: f64,
        span: Option<Range<usize>>,
        airplanes: &[AirplaneStart],
    ) -> Result<(), InputError> {
        let min_speed_m_s = airplanes
            .iter()
            .flat_map(AirplaneStart::planned_speeds_m_s)
            .fold(f64::INFINITY, f64::min);
        if wind_speed_m_s < min_speed_m_s {
            return Ok(());
        }
        let cause = format!("a wind of {wind_speed_m_s} m/s, and airplanes of {min_speed_m_s} m/s");
        let remedy = "give a wind that all airplanes can fly against";
        Err(self.source.error(span, cause, remedy))
    }

    /// Refuses what cannot be flown in a wind that differs from level to level or from place to place.
    pub(super) fn check_wind_field(&self, world: &AirspaceWorld) -> Result<(), InputError> {
        // Also those that blow from a time on.
        let mut fields = world
            .all_rules()
            .filter_map(|rules| rules.wind_field.as_ref().map(|field| (field, rules.shield)));
        fields.try_for_each(|(field, is_shielded)| self.check_one_field(world, field, is_shielded))
    }

    fn check_one_field(
        &self,
        world: &AirspaceWorld,
        field: &WindField,
        is_shielded: bool,
    ) -> Result<(), InputError> {
        let error = |cause: &str, remedy: &str| {
            Err(self.source.error(self.wind_field_span(), cause, remedy))
        };
        if world.network.is_some() {
            let cause = "a wind that differs, over an unreliable network, where airplanes that are not heard are believed \
                         on orbits that drift with a wind that is the same everywhere";
            return error(
                cause,
                "give wind_m_s in place of winds, or leave out [airspace.network]",
            );
        }
        if is_shielded && world.surface == Surface::Earth {
            let cause = "a wind on the earth under the shield: east is another direction for each airplane, and a \
                         wind would drive stored orbits apart or together";
            return error(cause, "set airspace.shield = \"off\", or leave out the wind");
        }
        if is_shielded && field.varies_by_place() && world.has_position_errors {
            let cause = "a wind that differs from place to place under the shield, and errors of position: nobody would \
                         know in which wind an airplane is";
            let remedy = "leave out position_noise_m and nac_p, give a wind that differs by altitude alone, or set airspace.shield \
                          = \"off\"";
            return error(cause, remedy);
        }
        Ok(())
    }
}

/// Returns a longitude in radians that is within half a turn of another one, both given in degrees.
fn unwrapped_rad(lon_deg: f64, near_deg: f64) -> f64 {
    near_deg.to_radians() + math::wrap_angle((lon_deg - near_deg).to_radians())
}

/// Returns the levels that an airplane may come to.
fn planned_levels(airplane: &AirplaneStart) -> FlightLevelRange {
    let levels = FlightLevelRange::from_level(airplane.altitude_m);
    airplane.orders.iter().fold(levels, |levels, order| match order.task {
        FlightTask::Altitude { altitude_m, .. } => levels.extended_by_level(altitude_m),
        _ => levels,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenario::CompiledAirspace;

    const AIRPLANE: &str =
        "[[airplanes]]\nat_m = [0, 0]\nheading_deg = 0\nway_points_m = [[9000, 0]]\n";
    const LAYERS: &str = "winds = [{ altitude_m = 0, wind_m_s = [2, 0] }, { altitude_m = 1000, wind_m_s = [20, 10] }]";

    fn compiled(airspace: &str, rest: &str) -> Result<CompiledAirspace, String> {
        let text = format!("format = 1\nworld = \"airspace\"\n[airspace]\n{airspace}\n{rest}");
        CompiledAirspace::new(&Source::new("w", text, "")).map_err(|error| error.to_string())
    }

    fn table(text: &str) -> Result<WindTable, String> {
        let csv = CsvTable::parse(&"w.csv", text).map_err(|error| error.to_string())?;
        WindTable::from_csv(&csv).map_err(|error| error.to_string())
    }

    #[test]
    fn layers_are_the_wind_on_their_levels_and_between_them() {
        let world = compiled(LAYERS, AIRPLANE).expect("right").world;
        let wind = |altitude_m: f64| world.air_at([5.0, 6.0], altitude_m).wind_m_s;
        assert_eq!([wind(0.0), wind(500.0), wind(2000.0)], [[2.0, 0.0], [11.0, 5.0], [20.0, 10.0]]);
        let climbs = "orders = [{ at_s = 10, altitude_m = 900 }]\n";
        let alone_s = |more: &str| {
            compiled(LAYERS, &format!("{AIRPLANE}{more}")).expect("right").world.alone_s[0]
        };
        // Its tail wind is stronger there.
        assert!(alone_s("altitude_m = 1000\n") < alone_s(climbs) - 10.0);
        assert!(alone_s(climbs) < alone_s("") - 10.0);
    }

    #[test]
    fn what_cannot_be_flown_in_winds_that_differ_is_an_error_with_a_remedy() {
        let earth =
            "[[airplanes]]\nat_deg = [50, 14]\nheading_deg = 0\nway_points_deg = [[50, 15]]\n";
        for (airspace, rest, cause) in [
            (format!("{LAYERS}\nwind_m_s = [1, 0]"), AIRPLANE, "given in two ways"),
            (LAYERS.replace("1000", "0"), AIRPLANE, "two winds at an altitude of 0 m"),
            (
                LAYERS.replace("20, 10", "60, 0"),
                &format!("{AIRPLANE}altitude_m = 900\n"),
                "a wind of 60 m/s",
            ),
            (LAYERS.to_string(), earth, "on the earth under the shield"),
            (
                format!("deployment = \"team\"\n{LAYERS}\n[airspace.network]"),
                AIRPLANE,
                "unreliable network",
            ),
        ] {
            let error = compiled(&airspace, rest).expect_err(cause);
            assert!(error.contains(cause), "{error}");
        }
        // No airplane comes to that level.
        assert!(compiled(&LAYERS.replace("20, 10", "60, 0"), AIRPLANE).is_ok());
        assert!(compiled(&format!("shield = \"off\"\n{LAYERS}"), earth).is_ok());
    }

    #[test]
    fn a_file_of_winds_has_columns_by_name_and_a_row_for_each_node() {
        let rows = "altitude_m,x_m,y_m,east_m_s,north_m_s\n0,0,0,1,2\n0,100,0,3,4\n";
        assert_eq!(table(rows).expect("right").rows.len(), 2);
        for (text, cause) in [
            ("altitude_m,east_m_s\n0,1\n", "north_m_s"),
            ("x_m,east_m_s,north_m_s\n0,1,2\n", "y_m"),
            ("x_m,y_m,latitude_deg,east_m_s,north_m_s\n0,0,0,1,2\n", "beside places on the earth"),
            ("time_s,east_m_s,north_m_s\n0,1,2\n", "time_s"),
            ("east_m_s,north_m_s\n1,2000\n", "2000 is too large"),
            ("east_m_s,north_m_s\n", "no wind"),
        ] {
            let error = table(text).expect_err(cause);
            assert!(error.contains(cause), "{error}");
        }
    }
}
