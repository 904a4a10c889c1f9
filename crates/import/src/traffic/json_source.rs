//! JSON: answers of the REST interface of the OpenSky Network, one or many, with states as lists or as objects, and its
//! answer to a request for a track; rows of any table as objects, as the library `traffic` writes them; and lists of such
//! rows within an object, as other networks give them: readsb, adsb.lol, ADS-B Exchange, Flightradar24, FlightAware.

use super::POINTS_REMEDY;
use super::columns::{Field, Layout, Source};
use super::json_frames::rows_of;
use super::json_items::{Broken, Item, JsonItems};
use super::rows::{RowCollector, RowValues};
use super::value::Value;
use serde::Deserialize;
use serde_json::{Map, Value as Json};
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

/// Names of lists of rows within an object: of readsb, of the networks that give its rows, of Virtual Radar Server, of
/// Flightradar24, of FlightAware.
const LIST_KEYS: [&str; 6] = ["aircraft", "ac", "acList", "data", "tracks", "positions"];

/// Names of values beside such a list that each of its rows has.
const SHARED_KEYS: [&str; 8] =
    ["now", "time", "timestamp", "fr24_id", "fa_flight_id", "ident", "callsign", "hex"];

/// The names of the values of a trace's points of readsb, in the order of its lists. Source: readsb, README-json.md.
const TRACE_KEYS: [&str; 11] = [
    "timestamp",
    "lat",
    "lon",
    "alt_baro",
    "gs",
    "track",
    "flags",
    "baro_rate",
    "details",
    "source",
    "alt_geom",
];
/// The greatest number of bytes of a text that all rows of a list have: names of flights are shorter.
const MAX_SHARED_BYTES: usize = 64;

/// The rule by which items of a list are left out.
const NO_OBJECT_RULE: &str = "items of a list that are no object";

/// The flag of a point whose altitude is the geometric one.
const GEOMETRIC_FLAG: u64 = 8;

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
    let mut states = StateReader {
        collector,
        layout,
        count: 0,
        records: Vec::new(),
        broken: Vec::new(),
        other_count: 0,
    };
    let mut items = JsonItems::new(text);
    while let Some(item) = items.next().map_err(|cause| states.error(&cause))? {
        match item {
            Item::Value(value, line) => states.push_item(value, line)?,
            Item::Broken(broken) => states.broken.push(broken),
        }
    }
    states.check_any(items.first_error())?;
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
    broken: Vec<Broken>,
    /// Number of items that are no object.
    other_count: usize,
}

const GEO_JSON_CAUSE: &str = "is GeoJSON, whose lines have no times";

impl StateReader<'_> {
    fn error(&self, cause: &str) -> InputError {
        let remedy = "give answers of OpenSky's REST interface with `time` and `states`, or rows as objects, in a list \
                      or one after the other";
        let cause = format!("is no JSON of recorded traffic: {cause}");
        InputError::new(self.collector.place(), cause, remedy)
    }

    /// Checks that something was read: if not, the whole text is something else.
    fn check_any(&self, first_error: Option<String>) -> Result<(), InputError> {
        if self.count > 0 || !self.records.is_empty() {
            return Ok(());
        }
        if let Some(error) = first_error {
            return Err(self.error(&error));
        }
        if self.other_count > 0 {
            return Err(self.error("a list has something else than objects"));
        }
        Ok(())
    }

    /// Counts something in a list that is no row; `noun` and `number` are its place.
    fn leave_out(&mut self, noun: &'static str, number: usize, rule: &str) {
        self.other_count += 1;
        let row_noun = self.collector.noun();
        self.collector.set_noun(noun);
        self.collector.leave_out(number, 1, rule);
        self.collector.set_noun(row_noun);
    }

    fn push_item(&mut self, item: Json, line: usize) -> Result<(), InputError> {
        let Json::Object(mut map) = item else {
            self.leave_out("line", line, NO_OBJECT_RULE);
            return Ok(());
        };
        if map.get("type").is_some_and(|kind| kind == "FeatureCollection" || kind == "Feature") {
            return Err(InputError::new(self.collector.place(), GEO_JSON_CAUSE, POINTS_REMEDY));
        }
        map = match rows_of(map) {
            Ok(rows) => {
                self.records.extend(rows);
                return Ok(());
            }
            Err(map) => map,
        };
        if let Some(Json::Array(points)) = map.get_mut("trace").map(Json::take) {
            self.push_trace(&map, points);
            return Ok(());
        }
        let list_key = LIST_KEYS.iter().find(|key| map.get(**key).is_some_and(Json::is_array));
        if let Some(Json::Array(items)) = list_key.and_then(|key| map.remove(*key)) {
            self.push_list(&map, items);
            return Ok(());
        }
        if !map.contains_key("states") && !map.contains_key("path") {
            self.records.push(map);
            return Ok(());
        }
        let answer = serde_json::from_value(Json::Object(map));
        let answer: Answer = answer.map_err(|error| self.error(&error.to_string()))?;
        self.push_answer(answer);
        Ok(())
    }

    /// Keeps the rows of a list, each with what the object around the list says of all.
    fn push_list(&mut self, around: &Map<String, Json>, items: Vec<Json>) {
        let shared: Vec<(&str, Json)> = SHARED_KEYS
            .into_iter()
            .filter_map(|key| Some((key, shared_value(around, key)?)))
            .collect();
        for (k, item) in items.into_iter().enumerate() {
            let Json::Object(mut row) = item else {
                self.leave_out("item", k + 1, NO_OBJECT_RULE);
                continue;
            };
            for (key, value) in &shared {
                if !row.contains_key(*key) {
                    row.insert((*key).to_owned(), value.clone());
                }
            }
            self.records.push(row);
        }
    }

    /// Keeps the points of a trace of readsb, whose times are seconds after that of the trace.
    fn push_trace(&mut self, around: &Map<String, Json>, points: Vec<Json>) {
        let begin_s = around.get("timestamp").and_then(Json::as_f64).unwrap_or(0.0);
        let address = shared_value(around, "icao").unwrap_or(Json::Null);
        for (k, point) in points.into_iter().enumerate() {
            let Json::Array(values) = point else {
                self.leave_out("point", k + 1, "points of a trace that are no list");
                continue;
            };
            let mut row = Map::new();
            row.extend(TRACE_KEYS.map(str::to_owned).into_iter().zip(values));
            let after_s = row.get("timestamp").and_then(Json::as_f64);
            row.insert("timestamp".into(), after_s.map_or(Json::Null, |s| Json::from(begin_s + s)));
            row.insert("icao".into(), address.clone());
            if let Some(Json::Object(mut details)) = row.remove("details") {
                row.extend(details.remove("flight").map(|flight| ("flight".into(), flight)));
            }
            row.remove("source");
            let flags = row.remove("flags").and_then(|flags| flags.as_u64()).unwrap_or(0);
            if flags & GEOMETRIC_FLAG > 0
                && let Some(altitude) = row.insert("alt_baro".into(), Json::Null)
            {
                row.insert("alt_geom".into(), altitude);
            }
            self.records.push(row);
        }
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
        let name = |name: Option<String>| name.filter(|name| name.len() <= MAX_SHARED_BYTES);
        let address = name(icao24).map_or(Json::Null, Json::from);
        let callsign = name(callsign).map_or(Json::Null, Json::from);
        for point in path.unwrap_or_default() {
            let row = path_row(point, [&address, &callsign]);
            self.push(row);
        }
    }

    /// Reads the rows of a table, of whose columns any row may lack some.
    fn push_records(&mut self) -> Result<(), InputError> {
        self.push_records_as_rows()?;
        let row_noun = self.collector.noun();
        self.collector.set_noun("line");
        for broken in std::mem::take(&mut self.broken) {
            self.collector.leave_out(broken.line, broken.count, "rows that are no JSON");
        }
        self.collector.set_noun(row_noun);
        Ok(())
    }

    fn push_records_as_rows(&mut self) -> Result<(), InputError> {
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

/// Returns a value that an object gives for all rows of a list in it. It is a short one: a file can have millions of rows.
fn shared_value(around: &Map<String, Json>, key: &str) -> Option<Json> {
    let value = around.get(key)?;
    let is_short = match value {
        Json::Null | Json::Bool(_) | Json::Number(_) => true,
        Json::String(text) => text.len() <= MAX_SHARED_BYTES,
        Json::Array(_) | Json::Object(_) => false,
    };
    is_short.then(|| value.clone())
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
