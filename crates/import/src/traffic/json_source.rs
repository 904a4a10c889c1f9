//! JSON: answers of the REST interface of the OpenSky Network, one or many, with states as lists or as objects, and its
//! answer to a request for a track; and rows of any table as objects, as the library `traffic` writes them.

use super::columns::{Field, Layout, Source};
use super::rows::{RowCollector, RowValues};
use super::value::Value;
use serde::Deserialize;
use serde_json::{Deserializer, Map, Value as Json};
use sidestep_kernel::InputError;

/// The maximum size of a file in bytes: as values it takes several times the memory.
const MAX_JSON_BYTES: usize = 64 << 20;

/// The names of a state's values, in the order in which the REST interface lists them; `time` stands before them.
const STATE_KEYS: [&str; 18] = [
    "time",
    "icao24",
    "callsign",
    "origin_country",
    "time_position",
    "last_contact",
    "longitude",
    "latitude",
    "baro_altitude",
    "on_ground",
    "velocity",
    "true_track",
    "vertical_rate",
    "sensors",
    "geo_altitude",
    "squawk",
    "spi",
    "position_source",
];

/// The names of the values of a track's points, in the order in which the REST interface lists them.
const PATH_KEYS: [&str; 6] =
    ["time", "latitude", "longitude", "baro_altitude", "true_track", "on_ground"];

/// One answer: a state of the air, or a track.
#[derive(Debug, Deserialize)]
struct Answer {
    /// When the states were, in s since 1970.
    time: Option<f64>,
    states: Option<Vec<Json>>,
    icao24: Option<String>,
    #[serde(alias = "calllsign")]
    callsign: Option<String>,
    path: Option<Vec<Json>>,
}

/// A row of values, in the order of the columns of its layout.
struct ValueRow(Vec<Json>);

impl RowValues for ValueRow {
    fn value(&self, column: usize) -> Value<'_> {
        match self.0.get(column) {
            Some(Json::Bool(flag)) => Value::Flag(*flag),
            Some(Json::Number(number)) => number.as_f64().map_or(Value::Missing, Value::Number),
            Some(Json::String(text)) => Value::from_text(text),
            _ => Value::Missing,
        }
    }
}

/// The greatest number of names of columns.
const MAX_COLUMNS: usize = 1000;

/// Reads the states of all answers or the rows in a text, which stand in a list or one after the other.
///
/// # Errors
/// When the text is no JSON of this kind, or its rows lack what a track cannot be without.
pub(super) fn collect(collector: &mut RowCollector, text: &str) -> Result<(), InputError> {
    if text.len() > MAX_JSON_BYTES {
        let cause = format!("the JSON has more than {} MB", MAX_JSON_BYTES >> 20);
        return Err(InputError::new(collector.place(), cause, "give a part of it, or CSV"));
    }
    let layout = state_layout()?;
    collector.set_noun("state");
    let mut states = StateReader { collector, layout, count: 0, records: Vec::new() };
    for document in Deserializer::from_str(text).into_iter::<Json>() {
        match document {
            Ok(Json::Array(items)) => {
                items.into_iter().try_for_each(|item| states.push_item(item))?
            }
            Ok(item) => states.push_item(item)?,
            Err(error) => return Err(states.error(&error.to_string())),
        }
    }
    states.push_records()
}

/// Returns where the fields of a state are.
fn state_layout() -> Result<Layout, InputError> {
    let names = STATE_KEYS.map(str::to_owned);
    let mut layout = Layout::find("OpenSky", &names)?;
    // What it says beside positions is not worth a line.
    layout.unused.clear();
    debug_assert_eq!(layout.source, Source::OpenSky);
    debug_assert!(layout.column(Field::PositionTime).is_some());
    Ok(layout)
}

struct StateReader<'a> {
    collector: &'a mut RowCollector,
    layout: Layout,
    count: usize,
    /// Rows of a table, whose columns are those of all of them.
    records: Vec<Map<String, Json>>,
}

impl StateReader<'_> {
    fn error(&self, cause: &str) -> InputError {
        let remedy = "give answers of OpenSky's REST interface with `time` and `states`, or rows as objects, in a list \
                      or one after the other";
        let cause = format!("is no JSON of recorded traffic: {cause}");
        InputError::new(self.collector.place(), cause, remedy)
    }

    fn push_item(&mut self, item: Json) -> Result<(), InputError> {
        let Json::Object(map) = item else {
            return Err(self.error("a list has something else than objects"));
        };
        if !map.contains_key("states") && !map.contains_key("path") {
            self.records.push(map);
            return Ok(());
        }
        let answer = serde_json::from_value(Json::Object(map));
        let answer: Answer = answer.map_err(|error| self.error(&error.to_string()))?;
        self.push_answer(answer);
        Ok(())
    }

    fn push_answer(&mut self, answer: Answer) {
        if self.count == 0 {
            self.collector.describe_source(&self.layout, "JSON");
        }
        let Answer { time, states, icao24, callsign, path } = answer;
        let time = time.map_or(Json::Null, Json::from);
        for state in states.unwrap_or_default() {
            let row = state_row(state, &time);
            self.push(row);
        }
        let address = icao24.map_or(Json::Null, Json::from);
        let callsign = callsign.map_or(Json::Null, Json::from);
        for point in path.unwrap_or_default() {
            let row = path_row(point, [&address, &callsign]);
            self.push(row);
        }
    }

    /// Reads the rows of a table, of whose columns any row may lack some.
    fn push_records(&mut self) -> Result<(), InputError> {
        if self.records.is_empty() {
            return Ok(());
        }
        let mut names: Vec<String> = Vec::new();
        for name in self.records.iter().flat_map(|record| record.keys()) {
            if !names.contains(name) {
                names.push(name.clone());
            }
            if names.len() > MAX_COLUMNS {
                return Err(self.error(&format!("its rows have more than {MAX_COLUMNS} columns")));
            }
        }
        let layout = Layout::find(self.collector.place(), &names)?;
        self.collector.describe_source(&layout, "JSON");
        self.collector.set_noun("row");
        for (k, mut record) in std::mem::take(&mut self.records).into_iter().enumerate() {
            let value = |name: &String| record.remove(name).unwrap_or(Json::Null);
            let row = ValueRow(names.iter().map(value).collect());
            self.collector.push(k + 1, &layout, &row);
        }
        Ok(())
    }

    fn push(&mut self, row: Option<ValueRow>) {
        self.count += 1;
        match row {
            Some(row) => self.collector.push(self.count, &self.layout, &row),
            None => {
                self.collector.leave_out(self.count, 1, "states that are no list and no object")
            }
        }
    }
}

/// Returns a state as a row: a list, or an object with the names of the REST interface.
fn state_row(state: Json, time: &Json) -> Option<ValueRow> {
    let mut row = match state {
        Json::Array(values) => std::iter::once(Json::Null).chain(values).collect(),
        Json::Object(map) => STATE_KEYS.map(|key| state_value(&map, key)).to_vec(),
        _ => return None,
    };
    if row[0].is_null() {
        row[0] = time.clone();
    }
    Some(ValueRow(row))
}

/// Returns a value of a state by its name, or by the one that tables of states use.
fn state_value(map: &Map<String, Json>, key: &str) -> Json {
    let other = match key {
        "time" => "timestamp",
        "longitude" => "lon",
        "latitude" => "lat",
        "baro_altitude" => "baroaltitude",
        "geo_altitude" => "geoaltitude",
        "on_ground" => "onground",
        "true_track" => "heading",
        "vertical_rate" => "vertrate",
        "time_position" => "lastposupdate",
        _ => key,
    };
    map.get(key).or_else(|| map.get(other)).cloned().unwrap_or(Json::Null)
}

/// Returns a point of a track as a row of a state.
fn path_row(point: Json, [address, callsign]: [&Json; 2]) -> Option<ValueRow> {
    let Json::Array(values) = point else { return None };
    let mut row = vec![Json::Null; STATE_KEYS.len()];
    for (key, value) in PATH_KEYS.iter().zip(values) {
        let index = STATE_KEYS.iter().position(|name| name == key)?;
        row[index] = value;
    }
    row[1] = address.clone();
    row[2] = callsign.clone();
    Some(ValueRow(row))
}
