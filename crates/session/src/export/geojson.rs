//! The paths of airplanes on earth as GeoJSON (RFC 7946), for maps.
//!
//! A feature for each airplane: a line of longitudes, latitudes and altitudes, cut where it crosses the date line, with
//! its id, its call sign, and for each place the seconds since the start of the run, or since 1970 where the run has a
//! date.

use super::tables::{TableExport, TableFormat};
use super::target::Target;
use super::{ExportContext, ExportResult};
use crate::Error;
use serde_json::{Value, json};
use sidestep_kernel::InputError;
use sidestep_kernel::ports::ColumnValues;
use sidestep_record::Table;
use std::collections::BTreeMap;
use std::io::Write;

/// The table that has the paths.
const TABLE: &str = "trajectories";

/// A place of a path: longitude, latitude and altitude.
type Place = [f64; 3];

/// The path of one airplane so far.
#[derive(Default)]
struct Path {
    callsign: Option<String>,
    /// Its parts on either side of the date line.
    lines: Vec<Vec<Place>>,
    times_s: Vec<f64>,
}

impl Path {
    fn push(&mut self, place: Place, time_s: f64) {
        self.times_s.push(time_s);
        let Some(line) = self.lines.last_mut() else {
            self.lines.push(vec![place]);
            return;
        };
        let last = line[line.len() - 1];
        if (last[0] - place[0]).abs() <= 180.0 {
            line.push(place);
        } else if line.len() == 1 && last[0].abs() == 180.0 {
            // It begins on the date line, which lies on either side.
            *line = vec![[-last[0], last[1], last[2]], place];
        } else {
            let [end, start] = date_line_crossing(last, place);
            line.push(end);
            self.lines.push(vec![start, place]);
        }
    }

    fn feature(&self, airplane: u64, has_date: bool) -> Value {
        // A line has two places at least.
        let lines: Vec<Vec<Place>> = self
            .lines
            .iter()
            .map(|line| if line.len() == 1 { vec![line[0]; 2] } else { line.clone() })
            .collect();
        let times = if has_date { "utc_s" } else { "time_s" };
        json!({
            "type": "Feature",
            "properties": {
                "airplane": airplane,
                "callsign": self.callsign,
                times: self.times_s,
            },
            "geometry": { "type": "MultiLineString", "coordinates": lines },
        })
    }
}

/// Returns the places on either side of the date line where a path crosses it, as straight as a map draws it.
fn date_line_crossing(from: Place, to: Place) -> [Place; 2] {
    let side = from[0].signum();
    // Longitudes rise on to the east of the line, or fall to its west.
    let beyond = to[0] + side * 360.0;
    let fraction = ((side * 180.0 - from[0]) / (beyond - from[0])).clamp(0.0, 1.0);
    let [latitude, altitude] = [1, 2].map(|k| from[k] + fraction * (to[k] - from[k]));
    [[side * 180.0, latitude, altitude], [-side * 180.0, latitude, altitude]]
}

/// Exports the paths of all airplanes.
pub(super) fn export(job: &ExportContext<'_>) -> Result<ExportResult, Error> {
    let source = TableExport::new(job, TableFormat::Csv)?;
    source.check_table(TABLE)?;
    let target = Target::for_file(job, ".geojson")?;
    let mut paths: BTreeMap<u64, Path> = BTreeMap::new();
    let mut has_date = false;
    source.for_each_block_of(TABLE, |block| {
        has_date = block.column("utc_s").is_some();
        append(&mut paths, &block).ok_or_else(|| not_on_earth(job))?;
        Ok(())
    })?;
    let features: Vec<Value> =
        paths.iter().map(|(airplane, path)| path.feature(*airplane, has_date)).collect();
    let collection = json!({ "type": "FeatureCollection", "features": features });
    target.write_stream(|out| {
        serde_json::to_writer(&mut *out, &collection)?;
        out.write_all(b"\n")
    })?;
    Ok(ExportResult::single_file(target.path(), false))
}

fn not_on_earth(job: &ExportContext<'_>) -> Error {
    let cause = "the positions of this run are not on earth: its scenario gives neither latitudes and longitudes nor \
                 airspace.origin_deg";
    let remedy = "export it to csv, or give the scenario airspace.origin_deg and run it again";
    InputError::new(job.recorded.path.display(), cause, remedy).into()
}

/// Adds the rows of a block; `None` where they have no place on earth.
fn append(paths: &mut BTreeMap<u64, Path>, block: &Table) -> Option<()> {
    let numbers = |name: &str| match block.column(name)? {
        ColumnValues::F64(values) => Some(values),
        _ => None,
    };
    let longitudes = numbers("longitude_deg")?;
    let latitudes = numbers("latitude_deg")?;
    let altitudes = numbers("altitude_m")?;
    let times_s = numbers("utc_s").or_else(|| numbers("from_s"))?;
    let ColumnValues::U32(airplanes) = block.column("airplane")? else { return None };
    for row in 0..block.rows() {
        let path = paths.entry(airplanes[row].into()).or_default();
        if path.callsign.is_none() {
            path.callsign = text(block, "callsign", row);
        }
        path.push([longitudes[row], latitudes[row], altitudes[row]], times_s[row]);
    }
    Some(())
}

/// Returns the text of a column in a row, if there is any.
fn text(block: &Table, name: &str, row: usize) -> Option<String> {
    let at = block.schema.columns.iter().position(|column| column.name == name)?;
    let mut text = String::new();
    block.columns[at].write(row, &block.schema.columns[at].labels, &mut text).ok()?;
    (!text.is_empty()).then_some(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_over_the_date_line_is_cut_there() {
        let mut path = Path::default();
        path.push([179.0, 10.0, 900.0], 0.0);
        path.push([-179.0, 12.0, 1100.0], 10.0);
        path.push([-178.0, 12.0, 1100.0], 20.0);
        assert_eq!(
            path.lines,
            [
                vec![[179.0, 10.0, 900.0], [180.0, 11.0, 1000.0]],
                vec![[-180.0, 11.0, 1000.0], [-179.0, 12.0, 1100.0], [-178.0, 12.0, 1100.0]],
            ]
        );
        let mut begun_there = Path::default();
        begun_there.push([180.0, 9.0, 0.0], 0.0);
        begun_there.push([-179.9, 9.1, 0.0], 5.0);
        assert_eq!(begun_there.lines, [vec![[-180.0, 9.0, 0.0], [-179.9, 9.1, 0.0]]]);
        let feature = path.feature(7, true);
        assert_eq!(feature["properties"]["utc_s"], json!([0.0, 10.0, 20.0]));
        assert_eq!(feature["geometry"]["type"], "MultiLineString");
    }
}
