//! JSON: answers of the REST interface of the OpenSky Network, one or many, with states as lists or as objects, and its
//! answer to a request for a track; rows of any table as objects, as the library `traffic` writes them; and lists of such
//! rows within an object, as other networks give them: readsb, adsb.lol, ADS-B Exchange, Flightradar24, FlightAware.

use super::POINTS_REMEDY;
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

/// Names of lists of rows within an object: of readsb, of the networks that give its rows, of Flightradar24, of
/// FlightAware.
const LIST_KEYS: [&str; 5] = ["aircraft", "ac", "data", "tracks", "positions"];

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
    let mut states =
        StateReader { collector, layout, count: 0, records: Vec::new(), broken_lines: Vec::new() };
    let mut begin = 0;
    while begin < text.len() {
        let mut documents = Deserializer::from_str(&text[begin..]).into_iter::<Json>();
        let error = loop {
            match documents.next() {
                Some(Ok(Json::Array(items))) => {
                    items.into_iter().try_for_each(|item| states.push_item(item))?;
                }
                Some(Ok(item)) => states.push_item(item)?,
                Some(Err(error)) => break Some(error),
                None => break None,
            }
        };
        let Some(error) = error else { break };
        let good_end = begin + documents.byte_offset();
        let list_end = good_end + states.push_items_of_cut_list(&text[good_end..])?;
        begin = states.leave_out_line(text, list_end, &error)?;
    }
    states.push_records()
}

/// Returns whether a character stands between the items of a list.
fn is_separator(c: char) -> bool {
    c == ',' || c.is_whitespace()
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
    /// Numbers of lines from which on a line is no JSON.
    broken_lines: Vec<usize>,
}

const GEO_JSON_CAUSE: &str = "is GeoJSON, whose lines have no times";

impl StateReader<'_> {
    fn error(&self, cause: &str) -> InputError {
        let remedy = "give answers of OpenSky's REST interface with `time` and `states`, or rows as objects, in a list \
                      or one after the other";
        let cause = format!("is no JSON of recorded traffic: {cause}");
        InputError::new(self.collector.place(), cause, remedy)
    }

    /// Reads the items of a list that is not whole, as of a file that was cut short. Returns where the last whole one
    /// ends; 0 where the text begins with no list.
    fn push_items_of_cut_list(&mut self, text: &str) -> Result<usize, InputError> {
        let Some(mut rest) = text.trim_start().strip_prefix('[') else { return Ok(0) };
        let mut end = 0;
        loop {
            rest = rest.trim_start_matches(is_separator);
            let mut items = Deserializer::from_str(rest).into_iter::<Json>();
            let Some(Ok(item)) = items.next() else { return Ok(end) };
            let length = items.byte_offset();
            self.push_item(item)?;
            rest = &rest[length..];
            end = text.len() - rest.len();
        }
    }

    /// Leaves out what is no JSON up to the end of its line, after `good_end`; returns where the next line begins.
    ///
    /// # Errors
    /// When nothing was read before it: then the whole text is something else.
    fn leave_out_line(
        &mut self,
        text: &str,
        good_end: usize,
        error: &serde_json::Error,
    ) -> Result<usize, InputError> {
        if self.count == 0 && self.records.is_empty() {
            return Err(self.error(&error.to_string()));
        }
        let rest = &text[good_end..];
        let bad_begin = good_end + (rest.len() - rest.trim_start_matches(is_separator).len());
        let line = 1 + text[..bad_begin].matches('\n').count();
        self.broken_lines.push(line);
        let line_length = text[bad_begin..].find('\n').map(|length| length + 1);
        Ok(line_length.map_or(text.len(), |length| bad_begin + length))
    }

    fn push_item(&mut self, item: Json) -> Result<(), InputError> {
        let Json::Object(mut map) = item else {
            return Err(self.error("a list has something else than objects"));
        };
        if map.get("type").is_some_and(|kind| kind == "FeatureCollection" || kind == "Feature") {
            return Err(InputError::new(self.collector.place(), GEO_JSON_CAUSE, POINTS_REMEDY));
        }
        if let Some(Json::Array(points)) = map.get_mut("trace").map(Json::take) {
            self.push_trace(&map, points);
            return Ok(());
        }
        let list_key = LIST_KEYS.iter().find(|key| map.get(**key).is_some_and(Json::is_array));
        if let Some(Json::Array(items)) = list_key.and_then(|key| map.remove(*key)) {
            return self.push_list(&map, items);
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
    fn push_list(
        &mut self,
        around: &Map<String, Json>,
        items: Vec<Json>,
    ) -> Result<(), InputError> {
        for item in items {
            let Json::Object(mut row) = item else {
                return Err(self.error("a list of rows has something else than objects"));
            };
            for key in SHARED_KEYS {
                if let Some(value) = around.get(key)
                    && !row.contains_key(key)
                {
                    row.insert(key.to_owned(), value.clone());
                }
            }
            self.records.push(row);
        }
        Ok(())
    }

    /// Keeps the points of a trace of readsb, whose times are seconds after that of the trace.
    fn push_trace(&mut self, around: &Map<String, Json>, points: Vec<Json>) {
        let begin_s = around.get("timestamp").and_then(Json::as_f64).unwrap_or(0.0);
        for point in points {
            let Json::Array(values) = point else { continue };
            let mut row = Map::new();
            row.extend(TRACE_KEYS.map(str::to_owned).into_iter().zip(values));
            let after_s = row.get("timestamp").and_then(Json::as_f64);
            row.insert("timestamp".into(), after_s.map_or(Json::Null, |s| Json::from(begin_s + s)));
            row.insert("icao".into(), around.get("icao").cloned().unwrap_or(Json::Null));
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
        let address = icao24.map_or(Json::Null, Json::from);
        let callsign = callsign.map_or(Json::Null, Json::from);
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
        for line in std::mem::take(&mut self.broken_lines) {
            self.collector.leave_out(line, 1, "lines that are no JSON");
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
