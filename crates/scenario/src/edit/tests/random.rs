//! Random edits of all scenarios of this repository: the text that they do not name stays, and the values become
//! those that a second, plain way of editing gives.

use super::{insert, relocate, remove, rename, set};
use crate::Source;
use crate::edit::Edit;
use proptest::prelude::*;
use serde_json::json;
use std::path::{Path, PathBuf};
use toml::{Table, Value};

pub(super) fn scenario(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenarios").join(name)
}

/// Returns the texts of all scenarios.
fn texts() -> Vec<String> {
    let mut texts = Vec::new();
    for folder in ["airspace", "chain", "robots", "sweeps"] {
        let entries = std::fs::read_dir(scenario(folder)).expect("a folder");
        let mut paths: Vec<PathBuf> =
            entries.map(|entry| entry.expect("an entry").path()).collect();
        paths.sort();
        let is_toml = |path: &&PathBuf| path.extension().is_some_and(|ending| ending == "toml");
        let read = |path: &PathBuf| std::fs::read_to_string(path).expect("a text");
        texts.extend(paths.iter().filter(is_toml).map(read));
    }
    texts
}

/// A path into values: keys, and numbers of elements.
type ValuePath = Vec<Result<String, usize>>;

fn collect_paths(value: &Value, way: &mut ValuePath, found: &mut Vec<ValuePath>) {
    if !way.is_empty() {
        found.push(way.clone());
    }
    let mut below = |step, inner: &Value| {
        way.push(step);
        collect_paths(inner, way, found);
        way.pop();
    };
    match value {
        Value::Table(table) => table.iter().for_each(|(key, inner)| below(Ok(key.clone()), inner)),
        Value::Array(items) => items.iter().enumerate().for_each(|(n, inner)| below(Err(n), inner)),
        _ => {}
    }
}

fn key(way: &ValuePath) -> String {
    let parts = way.iter().map(|step| match step {
        Ok(name) => format!("{name:?}"),
        Err(number) => number.to_string(),
    });
    parts.collect::<Vec<_>>().join(".")
}

fn get<'v>(root: &'v mut Value, way: &[Result<String, usize>]) -> &'v mut Value {
    way.iter().fold(root, |value, step| match step {
        Ok(name) => value.get_mut(name).expect("a key"),
        Err(number) => value.get_mut(*number).expect("an element"),
    })
}

fn value_of(value: &serde_json::Value) -> Value {
    Value::try_from(value).expect("a value")
}

fn parsed(text: &str) -> Value {
    Value::Table(text.parse::<Table>().unwrap_or_else(|error| panic!("{error}\n{text}")))
}

/// Values without the empty tables and arrays that are left where sections were removed, without the order of keys,
/// and with whole floats as integers.
fn plain(value: &Value) -> serde_json::Value {
    match value {
        Value::Float(x) if x.trunc() == *x => json!(*x as i64),
        Value::Array(items) => json!(items.iter().map(plain).collect::<Vec<_>>()),
        Value::Table(table) => {
            let mut names: Vec<&String> = table.keys().collect();
            names.sort();
            let members = names.into_iter().map(|name| (name.clone(), plain(&table[name])));
            let is_left = |inner: &serde_json::Value| *inner != json!({}) && *inner != json!([]);
            members.filter(|(_, inner)| is_left(inner)).collect()
        }
        other => serde_json::to_value(other).expect("JSON"),
    }
}

/// Edits values in a plain way.
fn edit_values(root: &mut Value, way: &ValuePath, edit: &Edit) {
    let (last, parent) = way.split_last().expect("a way");
    match (edit, last) {
        (Edit::Set { value, .. }, Err(_)) => *get(root, way) = value_of(value),
        (Edit::Set { value, .. }, Ok(name)) => {
            let table = get(root, parent).as_table_mut().expect("a table");
            table.insert(name.clone(), value_of(value));
        }
        (Edit::Insert { at, value, .. }, _) => {
            let items = get(root, way).as_array_mut().expect("an array");
            items.insert(at.unwrap_or(items.len()), value_of(value));
        }
        (Edit::Remove { .. }, Ok(name)) => {
            drop(get(root, parent).as_table_mut().expect("a table").remove(name));
        }
        (Edit::Remove { .. }, Err(number)) => {
            drop(get(root, parent).as_array_mut().expect("an array").remove(*number));
        }
        (Edit::Move { to, .. }, Err(number)) => {
            let items = get(root, parent).as_array_mut().expect("an array");
            let moved = items.remove(*number);
            items.insert(*to, moved);
        }
        (Edit::Rename { to, .. }, Ok(name)) => {
            let table = get(root, parent).as_table_mut().expect("a table");
            let value = table.remove(name).expect("a key");
            table.insert(to.clone(), value);
        }
        other => panic!("{other:?}"),
    }
}

fn any_value() -> impl Strategy<Value = serde_json::Value> {
    prop_oneof![
        any::<bool>().prop_map(|x| json!(x)),
        (-1000_i64..1000).prop_map(|x| json!(x)),
        (-1e3..1e3).prop_map(|x: f64| json!(x)),
        "[a-z#\"'\\\\ ]{0,8}(\n[a-z\"]{1,3}){0,2}".prop_map(|x| json!(x)),
        prop::collection::vec(0.0..9.0, 0..4).prop_map(|x: Vec<f64>| json!(x)),
        (0_u32..9).prop_map(|x| json!({ "count": x, "at": [1, 2], "deep": { "er": "x" } })),
    ]
}

/// Returns an edit of a random kind at a random place, with its way; `None` where it does not fit.
fn edit_at(
    root: &mut Value,
    pick: &(usize, u8, usize, serde_json::Value),
) -> Option<(ValuePath, Edit)> {
    let (place, kind, at, value) = pick;
    let mut all = Vec::new();
    collect_paths(root, &mut Vec::new(), &mut all);
    let mut way = all[place % all.len()].clone();
    let count = get(root, &way).as_array().map(Vec::len);
    let is_list = get(root, &way).as_array().is_some_and(|items| items.iter().all(Value::is_table));
    let edit = match kind {
        // A section of a list can only be a table.
        0 | 1 if way.last().is_some_and(Result::is_err) && get(root, &way).is_table() => {
            return None;
        }
        0 | 1 => set(&key(&way), value.clone()),
        2 => {
            get(root, &way).as_table()?;
            way.push(Ok("new key".into()));
            set(&key(&way), value.clone())
        }
        3 => {
            let at = at % (count? + 1);
            let value = if is_list { json!({ "count": at, "x": value }) } else { value.clone() };
            insert(&key(&way), Some(at).filter(|at| *at < count.unwrap_or(0)), value)
        }
        4 => remove(&key(&way)),
        5 => {
            way.push(Err(at % count.filter(|count| *count > 0)?));
            relocate(&key(&way), (at / 7) % count?)
        }
        _ => {
            way.last()?.as_ref().ok()?;
            rename(&key(&way), &format!("new.{at}"))
        }
    };
    Some((way, edit))
}

/// Returns whether all of these lines stand in a text, in their order.
fn stand_in<'t>(lines: impl Iterator<Item = &'t str>, text: &str) -> Result<(), String> {
    let mut others = text.lines();
    for line in lines {
        if !others.any(|other| other == line) {
            return Err(format!("`{line}` is gone"));
        }
    }
    Ok(())
}

fn pick() -> impl Strategy<Value = (usize, u8, usize, serde_json::Value)> {
    (any::<usize>(), 0_u8..7, any::<usize>(), any_value())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(500))]

    #[test]
    fn edits_give_the_values_of_a_plain_way_and_keep_all_comments_that_stand_alone(
        file in any::<usize>(), picks in prop::collection::vec(pick(), 1..4), crlf in any::<bool>()
    ) {
        let texts = texts();
        let text = texts[file % texts.len()].clone();
        let mut source = Source::new("s.toml", if crlf { text.replace('\n', "\r\n") } else { text }, "");
        for pick in &picks {
            let mut root = parsed(&source.text);
            let Some((way, edit)) = edit_at(&mut root, pick) else { continue };
            let edited = source.edited(std::slice::from_ref(&edit));
            let edited = edited.unwrap_or_else(|error| panic!("{edit:?}: {error}\n{}", source.text));
            edit_values(&mut root, &way, &edit);
            prop_assert_eq!(plain(&parsed(&edited.text)), plain(&root), "{:?}\n{}", edit, edited.text);
            // Text that is no TOML at all: comments set apart from the lines below them.
            let lines: Vec<&str> = source.text.lines().collect();
            let is_apart = |at: &usize| lines[*at].starts_with('#')
                && lines[at + 1..].iter().find(|line| !line.starts_with('#')).is_none_or(|line| line.is_empty());
            if !matches!(edit, Edit::Remove { .. } | Edit::Set { .. }) {
                let apart = (0..lines.len()).filter(is_apart).map(|at| lines[at]);
                prop_assert_eq!(stand_in(apart, &edited.text), Ok(()), "{:?}\n{}", edit, edited.text);
            }
            source = edited;
        }
    }

    #[test]
    fn a_value_that_is_set_changes_its_own_bytes_alone_and_back(
        file in any::<usize>(), place in any::<usize>(), value in any_value()
    ) {
        let texts = texts();
        let source = Source::new("s.toml", texts[file % texts.len()].as_str(), "");
        let mut root = parsed(&source.text);
        let mut all = Vec::new();
        collect_paths(&root, &mut Vec::new(), &mut all);
        let way = &all[place % all.len()];
        let (document, key) = (source.text.parse::<toml_edit::Document<String>>().expect("TOML"), key(way));
        let item = way.iter().fold(document.as_item(), |item, step| match step {
            Ok(name) => &item[name.as_str()],
            Err(number) => &item[*number],
        });
        let is_dotted = item.as_inline_table().is_some_and(toml_edit::InlineTable::is_dotted);
        let value_there = item.as_value().filter(|_| !is_dotted);
        let Some(span) = value_there.and_then(toml_edit::Value::span) else { return Ok(()) };
        let old = serde_json::to_value(&*get(&mut root, way)).expect("JSON");
        let edited = source.edited(&[set(&key, value.clone())]).expect("it fits");
        let (before, behind) = (&source.text[..span.start], &source.text[span.end..]);
        prop_assert!(edited.text.starts_with(before) && edited.text.ends_with(behind), "{}", edited.text);
        // The text of a value is not unique: 0.50, or blanks in brackets.
        let back = edited.edited(&[set(&key, old.clone())]).expect("it fits");
        prop_assert!(back.text.starts_with(before) && back.text.ends_with(behind));
        let written = source.edited(&[set(&key, json!("x")), set(&key, old)]).expect("it fits");
        prop_assert_eq!(plain(&parsed(&back.text)), plain(&parsed(&source.text)));
        prop_assert_eq!(plain(&parsed(&written.text)), plain(&parsed(&source.text)));
        if written.text == source.text {
            prop_assert_eq!(&back.text.replace(".0", ""), &source.text.replace(".0", ""));
        }
    }

    #[test]
    fn what_is_inserted_and_removed_again_leaves_no_trace(
        file in any::<usize>(), place in any::<usize>(), at in any::<usize>(), value in any_value(), end in any::<bool>()
    ) {
        let texts = texts();
        let text = texts[file % texts.len()].as_str();
        let source = Source::new("s.toml", if end { text } else { text.trim_end() }, "");
        let mut root = parsed(&source.text);
        let mut all = Vec::new();
        collect_paths(&root, &mut Vec::new(), &mut all);
        let way = &all[place % all.len()];
        let (edit, gone) = match get(&mut root, way) {
            Value::Array(items) => {
                let at = at % (items.len() + 1);
                let is_list = items.iter().all(Value::is_table);
                let value = if is_list { json!({ "v": value }) } else { value };
                (insert(&key(way), Some(at), value), format!("{}.{at}", key(way)))
            }
            Value::Table(_) => {
                // A header that was made for it stays.
                let document = source.text.parse::<toml_edit::DocumentMut>().expect("TOML");
                let item = way.iter().fold(document.as_item(), |item, step| match step {
                    Ok(name) => &item[name.as_str()],
                    Err(number) => &item[*number],
                });
                prop_assume!(item.as_table().is_none_or(|t| t.position().is_some()));
                let gone = format!("{}.new", key(way));
                (set(&gone, value), gone)
            }
            _ => (set("new", value), "new".into()),
        };
        let back = source.edited(&[edit.clone(), remove(&gone)]).expect("they fit");
        prop_assert_eq!(&back.text, &source.text, "{:?}", edit);
    }
}
