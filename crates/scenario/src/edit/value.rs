//! Values in the notation of TOML.

use super::path::quoted_name;
use super::{EditError, edit_error};
use serde_json::{Map, Number, Value as Json};
use std::fmt::Write;
use toml_edit::{Datetime, Value};

/// The number up to which whole numbers are exact as floats.
const MAX_EXACT_INTEGER: f64 = 9_007_199_254_740_992.0;

/// A value that is set, from the page or from an override.
#[derive(Clone, Copy)]
pub(super) enum NewValue<'v> {
    /// A value by its meaning.
    Json(&'v Json),
    /// A piece of TOML, to be written as it is.
    Toml(&'v str),
}

impl NewValue<'_> {
    /// Returns its text; `old` is the value that it replaces.
    pub(super) fn to_toml(self, old: Option<&Value>) -> Result<String, EditError> {
        match self {
            NewValue::Toml(text) => Ok(text.to_string()),
            NewValue::Json(Json::String(text)) if is_date(old, text) => Ok(text.clone()),
            NewValue::Json(value) => text_of(value, old.is_some_and(has_floats)),
        }
    }
}

/// JSON has no dates: a text in place of one stays a date if it can be read as one.
fn is_date(old: Option<&Value>, text: &str) -> bool {
    old.is_some_and(Value::is_datetime) && text.parse::<Datetime>().is_ok()
}

/// Such a value stays one of floats: 2 in place of 1.5 is written as 2.0.
pub(super) fn has_floats(value: &Value) -> bool {
    match value {
        Value::Float(_) => true,
        Value::Array(items) => !items.is_empty() && items.iter().all(has_floats),
        _ => false,
    }
}

/// Returns the text of a value on one line, except for strings of several lines.
pub(super) fn text_of(value: &Json, floats: bool) -> Result<String, EditError> {
    let mut text = String::new();
    write_value(&mut text, value, floats)?;
    Ok(text)
}

fn write_value(text: &mut String, value: &Json, floats: bool) -> Result<(), EditError> {
    match value {
        Json::Null => {
            let remedy = "leave the key out; NaN and infinite numbers become null in JSON";
            return Err(edit_error("null is no value of TOML", remedy));
        }
        Json::Bool(value) => text.push_str(if *value { "true" } else { "false" }),
        Json::Number(number) => text.push_str(&number_text(number, floats)?),
        Json::String(string) => text.push_str(&string_text(string)),
        Json::Array(items) => {
            text.push('[');
            for (k, item) in items.iter().enumerate() {
                text.push_str(if k == 0 { "" } else { ", " });
                write_value(text, item, floats)?;
            }
            text.push(']');
        }
        Json::Object(members) => write_members(text, members)?,
    }
    Ok(())
}

fn write_members(text: &mut String, members: &Map<String, Json>) -> Result<(), EditError> {
    if members.is_empty() {
        text.push_str("{}");
        return Ok(());
    }
    for (k, (name, member)) in members.iter().enumerate() {
        text.push_str(if k == 0 { "{ " } else { ", " });
        text.push_str(&quoted_name(name));
        text.push_str(" = ");
        write_value(text, member, false)?;
    }
    text.push_str(" }");
    Ok(())
}

/// Returns the text of a number. JSON has one type of numbers, so a whole one becomes an integer of TOML unless floats
/// are asked for.
fn number_text(number: &Number, floats: bool) -> Result<String, EditError> {
    let float = number.as_f64().filter(|x| x.is_finite());
    match (number.as_i64(), float) {
        (Some(whole), _) if !floats => Ok(whole.to_string()),
        (None, Some(x)) if !floats && x.trunc() == x && x.abs() <= MAX_EXACT_INTEGER => {
            Ok(format!("{x:.0}"))
        }
        (None, Some(x)) if floats || number.is_f64() => Ok(format!("{x:?}")),
        (Some(_), Some(x)) => Ok(format!("{x:?}")),
        _ => {
            let cause = format!("{number} is larger than any whole number of TOML");
            Err(edit_error(cause, format!("give at most {}", i64::MAX)))
        }
    }
}

/// Returns a string in quotes: on several lines if it has several.
fn string_text(string: &str) -> String {
    if !string.contains('\n') {
        return Value::from(string).to_string();
    }
    // Adjacent quotes, or one at the end, could be read as the end of the string.
    let escapes_quotes = string.contains("\"\"") || string.ends_with('"');
    let mut text = String::from("\"\"\"\n");
    for c in string.chars() {
        match c {
            '\\' => text.push_str("\\\\"),
            '"' if escapes_quotes => text.push_str("\\\""),
            '\n' | '\t' => text.push(c),
            _ if c.is_control() => drop(write!(text, "\\u{:04X}", u32::from(c))),
            _ => text.push(c),
        }
    }
    text + "\"\"\""
}

/// Such a value is not written, so that its notation in the text stays: `1e3`, or an array over several lines.
pub(super) fn is_same(old: &Value, new: &Json) -> bool {
    match (old, new) {
        (Value::String(a), Json::String(b)) => a.value() == b,
        (Value::Datetime(a), Json::String(b)) => a.value().to_string() == *b,
        (Value::Boolean(a), Json::Bool(b)) => a.value() == b,
        (Value::Integer(a), Json::Number(b)) => match b.as_i64() {
            Some(b) => *a.value() == b,
            None => {
                b.as_f64().is_some_and(|b| b.abs() <= MAX_EXACT_INTEGER && *a.value() as f64 == b)
            }
        },
        (Value::Float(a), Json::Number(b)) => b.as_f64() == Some(*a.value()),
        (Value::Array(a), Json::Array(b)) => {
            a.len() == b.len() && a.iter().zip(b).all(|(a, b)| is_same(a, b))
        }
        (Value::InlineTable(a), Json::Object(b)) => {
            a.len() == b.len() && a.iter().all(|(key, a)| b.get(key).is_some_and(|b| is_same(a, b)))
        }
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn read(text: &str) -> Value {
        text.parse().expect("TOML")
    }

    #[test]
    fn values_come_back_from_their_text() {
        for value in [
            json!(true),
            json!(-3),
            json!(0.1),
            json!(1e300),
            json!(i64::MIN),
            json!("a \"b\" \\ c\u{7f}"),
            json!("two\nlines \"\"\" \\ \u{1}\r\n\""),
            json!([[1, 2.5], []]),
            json!({ "a b": { "c": [] }, "d": {} }),
        ] {
            let text = text_of(&value, false).expect("a value");
            assert!(is_same(&read(&text), &value), "{text}");
        }
    }

    #[test]
    fn whole_numbers_are_integers_unless_a_float_was_there() {
        let written = |old: Option<&str>, new: Json| {
            NewValue::Json(&new).to_toml(old.map(read).as_ref()).map_err(|r| r.cause)
        };
        assert_eq!(written(None, json!(2.0)), Ok("2".into()));
        assert_eq!(written(Some("1"), json!(2.0)), Ok("2".into()));
        assert_eq!(written(Some("1.5"), json!(2)), Ok("2.0".into()));
        assert_eq!(written(Some("[1.5, 2.5]"), json!([3, 4, 0.5])), Ok("[3.0, 4.0, 0.5]".into()));
        assert_eq!(written(Some("[1.5, 2]"), json!([3])), Ok("[3]".into()));
        assert_eq!(written(None, json!(1e21)), Ok("1e21".into()));
        assert_eq!(written(Some("1.0"), json!(u64::MAX)), Ok("1.8446744073709552e19".into()));
        assert!(written(None, json!(u64::MAX)).expect_err("too large").contains("larger"));
        assert_eq!(written(Some("2020-01-01"), json!("2021-02-03")), Ok("2021-02-03".into()));
        assert!(written(None, json!([1, null])).expect_err("null").contains("null"));
    }
}
