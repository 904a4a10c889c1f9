//! Tables of airports, fixes and radio beacons, in the formats that BlueSky reads: `airports.dat`, `fix.dat` and
//! `nav.dat`.

use crate::local_plane::{LatLon, wrap_deg};
use sidestep_kernel::{InputError, math};
use std::collections::BTreeMap;
use std::path::Path;

/// The maximum size of a table in bytes after decompression: ten times the largest known.
const MAX_TABLE_BYTES: u64 = 1 << 26;

/// The numbers of kinds of beacons in `nav.dat` that are places to fly to: NDB, VOR, DME and TACAN.
const BEACON_KINDS: [&str; 4] = ["2", "3", "12", "13"];

/// Places by their names in capital letters.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct NavigationData {
    airports: BTreeMap<String, LatLon>,
    /// Fixes and beacons; many names occur in several places of the earth.
    fixes: BTreeMap<String, Vec<LatLon>>,
}

impl NavigationData {
    /// Reads the tables in a folder, plain or compressed with gzip; those that are missing are empty.
    ///
    /// # Errors
    /// When none of them is there, one cannot be read, or they hold no places.
    pub fn read(folder: &Path) -> Result<Self, InputError> {
        let mut data = Self::default();
        let mut found = 0;
        for (name, add) in [
            ("airports.dat", Self::add_airport as fn(&mut Self, &str) -> Option<()>),
            ("nav.dat", Self::add_beacon),
            ("fix.dat", Self::add_fix),
        ] {
            let Ok(file) = crate::table::find_file(folder, name) else { continue };
            found += 1;
            for line in read_latin_text(&file)?.lines() {
                // Titles and kinds of places that nobody flies to are no entries.
                let _ = add(&mut data, line.trim());
            }
        }
        if found == 0 {
            let cause = "none of airports.dat, fix.dat and nav.dat is there";
            let remedy = "give the folder of BlueSky's navdata, which has these tables";
            return Err(InputError::new(folder.display(), cause, remedy));
        }
        if data.airports.is_empty() && data.fixes.is_empty() {
            let cause = "its tables hold no places";
            let remedy = "give tables in the format of BlueSky: `52.0 4.5 NAME` in fix.dat";
            return Err(InputError::new(folder.display(), cause, remedy));
        }
        Ok(data)
    }

    /// Adds an airport: `EHAM, SCHIPHOL, 52.309, 4.764, Large, 12467, NL`.
    fn add_airport(&mut self, line: &str) -> Option<()> {
        let fields: Vec<&str> = line.split(',').map(str::trim).collect();
        let [id, _, lat, lon, ..] = fields[..] else { return None };
        let is_closed = fields.get(4).is_some_and(|kind| *kind == "Closed");
        if id.is_empty() || id.starts_with('#') || is_closed {
            return None;
        }
        let position = position(lat, lon)?;
        self.airports.entry(id.to_ascii_uppercase()).or_insert(position);
        Some(())
    }

    /// Adds a beacon: `3  31.26894444 -085.73  334 11120  40  -3.0 OZR  CAIRNS VOR-DME`.
    fn add_beacon(&mut self, line: &str) -> Option<()> {
        let fields: Vec<&str> = line.split_whitespace().collect();
        let [kind, lat, lon, _, _, _, _, id, ..] = fields[..] else { return None };
        if !BEACON_KINDS.contains(&kind) {
            return None;
        }
        self.add_place(id, position(lat, lon)?);
        Some(())
    }

    /// Adds a fix: `30.580372 -094.384169 FAREL`.
    fn add_fix(&mut self, line: &str) -> Option<()> {
        let mut fields = line.split_whitespace();
        let (lat, lon, id) = (fields.next()?, fields.next()?, fields.next()?);
        self.add_place(id, position(lat, lon)?);
        Some(())
    }

    fn add_place(&mut self, id: &str, position: LatLon) {
        self.fixes.entry(id.to_ascii_uppercase()).or_default().push(position);
    }

    /// Returns the airport with a name, or else the fix or beacon with it that is nearest to a reference.
    pub(super) fn find(&self, name: &str, reference: LatLon) -> Option<LatLon> {
        if let Some(&airport) = self.airports.get(name) {
            return Some(airport);
        }
        let places = self.fixes.get(name)?;
        let by_distance = |a: &&LatLon, b: &&LatLon| {
            squared_distance(reference, **a).total_cmp(&squared_distance(reference, **b))
        };
        places.iter().min_by(by_distance).copied()
    }
}

/// Returns the square of a distance in degrees of a great circle, on a plane about the middle of both.
fn squared_distance(a: LatLon, b: LatLon) -> f64 {
    let scale = math::cos((0.5 * (a.lat_deg + b.lat_deg)).to_radians());
    let east = scale * wrap_deg(b.lon_deg - a.lon_deg);
    let north = b.lat_deg - a.lat_deg;
    east * east + north * north
}

/// Returns a position in degrees.
fn position(lat: &str, lon: &str) -> Option<LatLon> {
    let lat_deg: f64 = lat.parse().ok()?;
    let lon_deg: f64 = lon.parse().ok()?;
    let is_on_earth = lat_deg.abs() <= 90.0 && lon_deg.abs() <= 180.0;
    is_on_earth.then_some(LatLon { lat_deg, lon_deg })
}

/// Returns a table's text; names of airports are not always UTF-8, and nobody reads these.
fn read_latin_text(file: &Path) -> Result<String, InputError> {
    let bytes = sidestep_scenario::file::read_bytes(file, MAX_TABLE_BYTES)?;
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_of_several_places_with_one_name_is_found() {
        let mut data = NavigationData::default();
        data.add_fix(" 52.0 4.0 SPY");
        data.add_fix("-33.0 -179.9 SPY");
        data.add_beacon("3 40.0 10.0 0 11120 40 0.0 OZR SOME VOR");
        data.add_beacon("4 41.0 10.0 0 11120 40 0.0 ILS SOME ILS");
        data.add_airport("EHAM, SCHIPHOL, 52.309, 4.764, Large, 12467, NL");
        data.add_airport("EHXX, GONE, 52.309, 4.764, Closed, 12467, NL");
        let near = |lat_deg, lon_deg| LatLon { lat_deg, lon_deg };
        assert_eq!(data.find("SPY", near(50.0, 5.0)), Some(near(52.0, 4.0)));
        assert_eq!(data.find("SPY", near(-30.0, 179.0)), Some(near(-33.0, -179.9)));
        assert_eq!(data.find("EHAM", near(0.0, 0.0)), Some(near(52.309, 4.764)));
        assert_eq!(data.find("OZR", near(0.0, 0.0)), Some(near(40.0, 10.0)));
        assert_eq!(
            [data.find("ILS", near(0.0, 0.0)), data.find("EHXX", near(0.0, 0.0))],
            [None; 2]
        );
    }
}
