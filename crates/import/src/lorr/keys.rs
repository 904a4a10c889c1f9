//! The keys of a problem's JSON file, with the places of errors.

use crate::char_map::SourceText;
use crate::report::{ImportReport, Treatment};
use serde_json::{Map, Value};
use sidestep_kernel::InputError;

/// An object of a JSON text.
pub(super) struct Keys<'a> {
    source: SourceText<'a>,
    /// The key whose value it is; empty for the whole text.
    path: &'static str,
    values: Map<String, Value>,
}

impl<'a> Keys<'a> {
    /// Parses a text that is one object.
    pub(super) fn new(place: &'a str, text: &'a str) -> Result<Self, InputError> {
        let source = SourceText { place, text };
        match serde_json::from_str(text) {
            Ok(Value::Object(values)) => Ok(Self { source, path: "", values }),
            Ok(_) => Err(source.error(0, "is no object", "begin with { and end with }")),
            Err(error) => {
                let remedy = if error.is_eof() {
                    "copy the whole file: it is cut off here"
                } else {
                    "write JSON: \"key\": value, with a comma between each two"
                };
                let cause = format!("is not JSON: {error}");
                let position = [error.line(), error.column()].map(|number| number.max(1));
                Err(InputError::new(place, cause, remedy).with_position(position[0], position[1]))
            }
        }
    }

    /// Returns the error of a key, which points at it; at the start of the text where it is absent.
    pub(super) fn error(
        &self,
        key: &str,
        cause: impl Into<String>,
        remedy: impl Into<String>,
    ) -> InputError {
        let offset = self.source.text.find(&format!("\"{key}\"")).unwrap_or(0);
        self.source.error(offset, cause, remedy)
    }

    /// Returns the object that is the value of a key, if there is the key.
    pub(super) fn object(&self, key: &'static str) -> Result<Option<Self>, InputError> {
        match self.values.get(key) {
            None => Ok(None),
            Some(Value::Object(values)) => {
                Ok(Some(Self { source: self.source, path: key, values: values.clone() }))
            }
            Some(_) => Err(self.error(key, format!("{key} is no object"), "write { } around it")),
        }
    }

    /// Records the keys that nobody reads.
    pub(super) fn record_others(&self, known: &[&str], report: &mut ImportReport) {
        for key in self.values.keys().filter(|key| !known.contains(&key.as_str())) {
            let key = key.escape_debug();
            let rule = format!("the key `{}`", self.name(&key.to_string()));
            report.record(Treatment::NotUsed, rule, "", "");
        }
    }

    pub(super) fn text(&self, key: &str) -> Result<String, InputError> {
        match self.optional_text(key)? {
            Some(text) => Ok(text),
            None => Err(self.absent(key, "text")),
        }
    }

    pub(super) fn optional_text(&self, key: &str) -> Result<Option<String>, InputError> {
        match self.values.get(key) {
            None => Ok(None),
            Some(Value::String(text)) => Ok(Some(text.clone())),
            Some(other) => {
                let cause = format!("{} is {other}, which is no text", self.name(key));
                Err(self.error(key, cause, "write it in quotes"))
            }
        }
    }

    pub(super) fn whole(&self, key: &str, min: u64, max: u64) -> Result<u64, InputError> {
        let Some(value) = self.values.get(key) else { return Err(self.absent(key, "number")) };
        value.as_u64().filter(|number| (min..=max).contains(number)).ok_or_else(|| {
            let cause = format!("{} is {value}", self.name(key));
            self.error(key, cause, format!("write a whole number from {min} to {max}"))
        })
    }

    pub(super) fn whole_or(
        &self,
        key: &str,
        [min, max]: [u64; 2],
        default: u64,
        report: &mut ImportReport,
    ) -> Result<u64, InputError> {
        if self.values.contains_key(key) {
            return self.whole(key, min, max);
        }
        self.record_guess(key, &default.to_string(), report);
        Ok(default)
    }

    pub(super) fn number(&self, key: &str, min: f64, max: f64) -> Result<f64, InputError> {
        let Some(value) = self.values.get(key) else { return Err(self.absent(key, "number")) };
        value.as_f64().filter(|number| (min..=max).contains(number)).ok_or_else(|| {
            let cause = format!("{} is {value}", self.name(key));
            let above =
                if min == f64::MIN_POSITIVE { "above 0".into() } else { format!("from {min}") };
            self.error(key, cause, format!("write a number {above} to {max}"))
        })
    }

    pub(super) fn number_or(
        &self,
        key: &str,
        [min, max]: [f64; 2],
        default: f64,
        report: &mut ImportReport,
    ) -> Result<f64, InputError> {
        if self.values.contains_key(key) {
            return self.number(key, min, max);
        }
        self.record_guess(key, &default.to_string(), report);
        Ok(default)
    }

    fn record_guess(&self, key: &str, value: &str, report: &mut ImportReport) {
        let rule = format!("{} is {value}: the file does not say", self.name(key));
        report.record(Treatment::Guessed, rule, "", "write the key");
    }

    fn absent(&self, key: &str, kind: &str) -> InputError {
        let remedy = format!("write \"{key}\": with a {kind} behind it");
        self.error(key, format!("lacks the key {}", self.name(key)), remedy)
    }

    fn name(&self, key: &str) -> String {
        if self.path.is_empty() { key.to_string() } else { format!("{}.{key}", self.path) }
    }
}
