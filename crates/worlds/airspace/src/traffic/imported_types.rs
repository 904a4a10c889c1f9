//! Types of the aircraft of a BlueSky file, from an installed OpenAP, as BlueSky has them from its own copy of it.
//!
//! Commands beyond what a type can fly are not refused, as those of a scenario are, because a file of another program has
//! them from there: they are clipped, and counted.

use super::MIN_SPEED_M_S;
use super::scn_flight::FlightCommand;
use sidestep_import::bluesky::ScnFile;
use sidestep_import::openap::{self, OpenapType};
use sidestep_kernel::InputError;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;
use std::path::Path;

/// Bank in degrees with which aircraft of a type turn at any speed: OpenAP has none, and BlueSky's is 25 degrees.
const BANK_MAX_DEG: f64 = 25.0;

/// The types of a file.
#[derive(Debug, Clone, Default)]
pub(crate) struct ImportedTypes {
    /// OpenAP's folder `data`, which is where the scenario reads them from, too.
    folder: String,
    /// Those that OpenAP has, by the names that the file has for them.
    known: BTreeMap<String, OpenapType>,
    /// The other names of the file.
    pub(crate) unknown: BTreeSet<String>,
}

/// Numbers of commands, and of aircraft at their start, that were clipped to what a type can fly.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct ClipCounts {
    pub(crate) speeds: usize,
    pub(crate) altitudes: usize,
    pub(crate) vertical_speeds: usize,
}

impl ImportedTypes {
    /// Reads the types of a file's aircraft from OpenAP's folder `data`.
    ///
    /// # Errors
    /// When it is no such folder, or a file of it cannot be read.
    pub(crate) fn load(folder: &str, file: &ScnFile) -> Result<Self, InputError> {
        let absolute = std::path::absolute(folder);
        let path = absolute.unwrap_or_else(|_| Path::new(folder).to_path_buf());
        let mut types = Self { folder: path.display().to_string(), ..Self::default() };
        let names: BTreeSet<&str> =
            file.traffic.aircraft.iter().map(|aircraft| aircraft.kind.as_str()).collect();
        for name in names.into_iter().filter(|name| !name.is_empty()) {
            match openap::load(&path, name)? {
                Some(found) => {
                    types.known.insert(name.into(), found);
                }
                None => {
                    types.unknown.insert(name.into());
                }
            }
        }
        Ok(types)
    }

    /// Returns whether OpenAP has a type of the file.
    pub(crate) fn has_any(&self) -> bool {
        !self.known.is_empty()
    }

    /// Returns the line of a scenario that names the folder; none without types.
    pub(super) fn folder_text(&self) -> String {
        if !self.has_any() {
            return String::new();
        }
        format!("openap_folder = {}\n", toml::Value::from(self.folder.as_str()))
    }

    /// Returns the flight of an aircraft of a type by name, with all that it cannot fly clipped; `None` for other names.
    pub(super) fn clipped(&self, name: &str, flight: TypedFlight) -> Option<ClippedFlight> {
        let found = self.known.get(name)?;
        let mut clipped = ClippedFlight { flight, counts: ClipCounts::default() };
        clipped.clip(found);
        Some(clipped)
    }
}

/// The start of an aircraft, and its commands.
#[derive(Debug, Clone)]
pub(super) struct TypedFlight {
    pub(super) v_m_s: f64,
    pub(super) altitude_m: f64,
    pub(super) orders: Vec<(f64, FlightCommand)>,
}

/// The same within the limits of a type.
#[derive(Debug, Clone)]
pub(super) struct ClippedFlight {
    pub(super) flight: TypedFlight,
    pub(super) counts: ClipCounts,
}

impl ClippedFlight {
    fn clip(&mut self, found: &OpenapType) {
        let slowest_m_s = found.v_min_m_s.unwrap_or(MIN_SPEED_M_S);
        let fastest_m_s = found.v_max_m_s.unwrap_or(f64::INFINITY).max(slowest_m_s);
        let ceiling_m = found.ceiling_m.unwrap_or(f64::INFINITY);
        let Self { flight, counts } = self;
        clip(&mut flight.v_m_s, slowest_m_s, fastest_m_s, &mut counts.speeds);
        clip(&mut flight.altitude_m, f64::NEG_INFINITY, ceiling_m, &mut counts.altitudes);
        let mut level_m = flight.altitude_m;
        for (_, command) in &mut flight.orders {
            match command {
                FlightCommand::Speed(v_m_s) => {
                    clip(v_m_s, slowest_m_s, fastest_m_s, &mut counts.speeds);
                }
                FlightCommand::Altitude(altitude_m, rate_m_s) => {
                    clip(altitude_m, f64::NEG_INFINITY, ceiling_m, &mut counts.altitudes);
                    let is_climb = *altitude_m > level_m;
                    let limit_m_s =
                        if is_climb { found.climb_max_m_s } else { found.descent_max_m_s };
                    let limit_m_s = limit_m_s.unwrap_or(f64::INFINITY);
                    clip(rate_m_s, 0.0, limit_m_s, &mut counts.vertical_speeds);
                    level_m = *altitude_m;
                }
                FlightCommand::Heading(_) | FlightCommand::Proceed | FlightCommand::Leave => {}
            }
        }
    }

    /// Writes the keys of the type to an airplane.
    pub(super) fn write_type(text: &mut String, name: &str) {
        // Writing to a string cannot fail.
        let _ =
            writeln!(text, "type = {}\nbank_max_deg = {BANK_MAX_DEG:?}", toml::Value::from(name));
    }
}

/// Clips a number to a range, and counts it if it was outside.
fn clip(number: &mut f64, from: f64, to: f64, count: &mut usize) {
    let clipped = number.clamp(from, to);
    *count += usize::from(clipped != *number);
    *number = clipped;
}

impl ClipCounts {
    /// Adds those of another aircraft.
    pub(super) fn add(&mut self, other: Self) {
        self.speeds += other.speeds;
        self.altitudes += other.altitudes;
        self.vertical_speeds += other.vertical_speeds;
    }
}

#[cfg(test)]
mod tests {
    use super::super::FOOT_M;
    use super::*;

    #[test]
    fn what_a_type_cannot_fly_is_clipped_and_counted() {
        let found = OpenapType {
            v_min_m_s: Some(70.0),
            v_max_m_s: Some(240.0),
            climb_max_m_s: Some(10.0),
            descent_max_m_s: Some(20.0),
            ceiling_m: Some(40_000.0 * FOOT_M),
            ..OpenapType::default()
        };
        let known = BTreeMap::from([("B744".to_string(), found)]);
        let types = ImportedTypes { known, ..ImportedTypes::default() };
        let climb = FlightCommand::Altitude(41_000.0 * FOOT_M, 15.0);
        let descent = FlightCommand::Altitude(1000.0, 15.0);
        let orders = vec![(1.0, FlightCommand::Speed(300.0)), (2.0, climb), (3.0, descent)];
        let flight = TypedFlight { v_m_s: 50.0, altitude_m: 3000.0, orders };
        let clipped = types.clipped("B744", flight.clone()).expect("known");
        assert_eq!(clipped.counts, ClipCounts { speeds: 2, altitudes: 1, vertical_speeds: 1 });
        assert_eq!(clipped.flight.v_m_s, 70.0);
        let commands: Vec<FlightCommand> =
            clipped.flight.orders.into_iter().map(|(_, command)| command).collect();
        let level_m = 40_000.0 * FOOT_M;
        let expected =
            [FlightCommand::Speed(240.0), FlightCommand::Altitude(level_m, 10.0), descent];
        assert_eq!(commands, expected);
        assert!(types.clipped("B748", flight).is_none());
    }
}
