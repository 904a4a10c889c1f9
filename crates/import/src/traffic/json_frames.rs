//! JSON that is no list of rows: tables by column, as pandas writes them unless told otherwise, and the live list of
//! Flightradar24.

use super::columns::Layout;
use serde_json::{Map, Value as Json};

/// The names of the values of an aircraft in Flightradar24's live list, in its order. Source: the package FlightRadarAPI,
/// `entities/flight.py`.
const LIVE_KEYS: [&str; 17] = [
    "hex",
    "lat",
    "lon",
    "track",
    "alt",
    "gspeed",
    "squawk",
    "radar",
    "type",
    "registration",
    "timestamp",
    "origin",
    "destination",
    "number",
    "on_ground",
    "vspeed",
    "callsign",
];

/// The names of the two values with which that list begins.
const LIVE_HEAD: [&str; 2] = ["full_count", "version"];

/// Returns the rows of a table that is not given by rows; the object itself where it is none.
pub(super) fn rows_of(
    mut map: Map<String, Json>,
) -> Result<Vec<Map<String, Json>>, Map<String, Json>> {
    if LIVE_HEAD.iter().all(|key| map.contains_key(*key)) {
        return Ok(live_rows(map));
    }
    if let Some(names) = split_names(&map) {
        let rows = map.remove("data").and_then(into_array).unwrap_or_default();
        return Ok(rows.into_iter().filter_map(into_array).map(|row| named(&names, row)).collect());
    }
    if map.values().all(Json::is_object)
        && map.values().next().and_then(Json::as_object).is_some_and(is_table)
    {
        let mut rows: Vec<(String, Json)> = map.into_iter().collect();
        rows.sort_by_key(|(key, _)| row_number(key));
        return Ok(rows.into_iter().filter_map(|(_, row)| into_object(row)).collect());
    }
    if !is_table(&map) {
        return Err(map);
    }
    if map.values().all(Json::is_object) || map.values().all(Json::is_array) {
        return Ok(rows_of_columns(map));
    }
    Err(map)
}

/// Returns whether the names of an object are those of the columns of tracks.
fn is_table(map: &Map<String, Json>) -> bool {
    let names: Vec<String> = map.keys().cloned().collect();
    Layout::find("", &names).is_ok()
}

/// Returns the names of columns that stand beside a list of rows.
fn split_names(map: &Map<String, Json>) -> Option<Vec<String>> {
    let names = map.get("columns")?.as_array()?;
    map.get("data")?.as_array()?.first()?.as_array()?;
    names.iter().map(|name| name.as_str().map(str::to_owned)).collect()
}

/// Returns the rows of columns, each of which is a list, or an object with the numbers of rows.
fn rows_of_columns(columns: Map<String, Json>) -> Vec<Map<String, Json>> {
    let mut rows: Vec<Map<String, Json>> = Vec::new();
    for (name, column) in columns {
        let values = match column {
            Json::Array(values) => values,
            Json::Object(cells) => {
                let mut cells: Vec<(String, Json)> = cells.into_iter().collect();
                cells.sort_by_key(|(key, _)| row_number(key));
                cells.into_iter().map(|(_, value)| value).collect()
            }
            _ => continue,
        };
        if rows.len() < values.len() {
            rows.resize_with(values.len(), Map::new);
        }
        for (row, value) in rows.iter_mut().zip(values) {
            row.insert(name.clone(), value);
        }
    }
    rows
}

/// Returns the order of a row: names that are numbers are not in the order of their letters.
fn row_number(key: &str) -> (u64, String) {
    (key.parse().unwrap_or(u64::MAX), key.to_owned())
}

fn live_rows(map: Map<String, Json>) -> Vec<Map<String, Json>> {
    let names = LIVE_KEYS.map(str::to_owned);
    let mut rows = Vec::new();
    for (id, values) in map {
        if let Json::Array(values) = values {
            let mut row = named(&names, values);
            row.insert("fr24_id".to_owned(), id.into());
            rows.push(row);
        }
    }
    rows
}

fn named(names: &[String], values: Vec<Json>) -> Map<String, Json> {
    names.iter().cloned().zip(values).collect()
}

fn into_array(value: Json) -> Option<Vec<Json>> {
    match value {
        Json::Array(values) => Some(values),
        _ => None,
    }
}

fn into_object(value: Json) -> Option<Map<String, Json>> {
    match value {
        Json::Object(map) => Some(map),
        _ => None,
    }
}
