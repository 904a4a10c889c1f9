//! Encounters of DAIDALUS, NASA's detect-and-avoid library: a line of names, a line of units in brackets, and a line per
//! aircraft and instant. Times are seconds of the encounter. Source: DAIDALUS Reference Manual, "Simple Daa files".

use super::columns::{FOOT_M, Field, Layout, NAUTICAL_MILE_M, Source};
use super::rows::{RowCollector, RowValues};
use super::value::Value;
use crate::table::data_lines;
use sidestep_kernel::InputError;

/// The names of columns, each with its field. The first line of data may have further ones.
const NAMES: [(&str, Field); 20] = [
    ("name", Field::Callsign),
    ("id", Field::Callsign),
    ("aircraft", Field::Callsign),
    ("time", Field::Time),
    ("tm", Field::Time),
    ("clock", Field::Time),
    ("st", Field::Time),
    ("lat", Field::Latitude),
    ("latitude", Field::Latitude),
    ("lon", Field::Longitude),
    ("long", Field::Longitude),
    ("longitude", Field::Longitude),
    ("alt", Field::Altitude),
    ("altitude", Field::Altitude),
    ("trk", Field::Track),
    ("track", Field::Track),
    ("gs", Field::GroundSpeed),
    ("groundspeed", Field::GroundSpeed),
    ("vs", Field::VerticalSpeed),
    ("verticalspeed", Field::VerticalSpeed),
];

/// A line of values.
struct Words<'a>(Vec<&'a str>);

impl RowValues for Words<'_> {
    fn value(&self, column: usize) -> Value<'_> {
        self.0.get(column).map_or(Value::Missing, |word| Value::from_text(word))
    }
}

/// Returns whether a text is such a file: its second line is of units in brackets.
pub(super) fn is_daa(text: &str) -> bool {
    let mut lines = data_lines(text);
    let names = lines.next().map(|(_, line)| words(line));
    let units = lines.next().map(|(_, line)| words(line));
    let (Some(names), Some(units)) = (names, units) else { return false };
    names.len() == units.len() && units.iter().all(|word| unit(word).is_some())
}

/// Reads the lines after those of names and units.
///
/// # Errors
/// When a column is missing that a track cannot be without, or has no unit of its quantity.
pub(super) fn collect(collector: &mut RowCollector, text: &str) -> Result<(), InputError> {
    let mut lines = data_lines(text);
    let (header_line, names) = lines.next().map_or((1, ""), |line| line);
    let (units_line, units) = lines.next().map_or((2, ""), |line| line);
    let mut columns = Vec::new();
    for (index, (name, word)) in words(names).iter().zip(words(units)).enumerate() {
        let plain = name.to_ascii_lowercase();
        let Some(&(_, field)) = NAMES.iter().find(|(known, _)| *known == plain) else { continue };
        let unit = unit(word).unwrap_or("");
        let Some(factor) = factor(field, unit) else {
            let cause = format!("`{name:.40}` has the unit [{unit:.40}]");
            let remedy = "give angles in [deg] or [rad], lengths in [ft], [m] or [NM], speeds in [knot], [m/s] or \
                          [fpm], and times in [s]";
            return Err(
                InputError::new(collector.place(), cause, remedy).with_position(units_line, 1)
            );
        };
        columns.push((field, index, factor));
    }
    let layout = Layout::new(Source::Encounter, &columns);
    layout.check_fields(collector.place()).map_err(|e| e.with_position(header_line, 1))?;
    collector.describe_source(&layout, "DAIDALUS");
    for (number, line) in lines {
        let row = Words(words(line));
        collector.push(number, &layout, &row);
    }
    Ok(())
}

/// Returns the words of a line, separated by commas, semicolons or blanks.
fn words(line: &str) -> Vec<&str> {
    if line.contains([',', ';']) {
        return line.split([',', ';']).map(str::trim).collect();
    }
    line.split_ascii_whitespace().collect()
}

/// Returns a unit without its brackets.
fn unit(word: &str) -> Option<&str> {
    word.strip_prefix('[')?.strip_suffix(']')
}

/// Returns the factor from a unit to the one of a field; `None` for a unit of another quantity.
fn factor(field: Field, unit: &str) -> Option<f64> {
    let knot_m_s = NAUTICAL_MILE_M / 3600.0;
    let m_s = || match unit {
        "m/s" | "mps" => Some(1.0),
        "knot" | "kn" | "knots" | "kts" | "kt" => Some(knot_m_s),
        "kph" | "km/h" => Some(1.0 / 3.6),
        "fpm" | "ft/min" => Some(FOOT_M / 60.0),
        "ft/s" | "fps" => Some(FOOT_M),
        _ => None,
    };
    match field {
        Field::Latitude | Field::Longitude | Field::Track => match unit {
            "deg" | "degree" | "degrees" => Some(1.0),
            "rad" => Some(1f64.to_degrees()),
            _ => None,
        },
        Field::Altitude => match unit {
            "ft" | "feet" => Some(1.0),
            "m" | "meter" | "meters" => Some(1.0 / FOOT_M),
            "km" => Some(1000.0 / FOOT_M),
            "NM" | "nmi" | "nm" => Some(NAUTICAL_MILE_M / FOOT_M),
            _ => None,
        },
        Field::GroundSpeed => m_s().map(|m_s| m_s / knot_m_s),
        Field::VerticalSpeed => m_s().map(|m_s| m_s * 60.0 / FOOT_M),
        Field::Time => match unit {
            "s" | "sec" | "second" | "seconds" => Some(1.0),
            _ => None,
        },
        _ => Some(1.0),
    }
}
