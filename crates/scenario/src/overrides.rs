//! Overrides: `key=value` set in the text of a scenario, keeping its comments and its order.

use sidestep_kernel::InputError;
use toml_edit::{DocumentMut, Item, Value};

/// Sets one key.
pub(crate) fn set(document: &mut DocumentMut, override_text: &str) -> Result<(), InputError> {
    let place = format!("--set {override_text}");
    let (key, value) = override_text.split_once('=').ok_or_else(|| {
        InputError::new(
            &place,
            "there is no `=`",
            "write --set key=value, e.g. --set robots.count=20",
        )
    })?;
    // Text needs no quotes on a command line, so a value that is not TOML is text.
    let value: Value = value.trim().parse().unwrap_or_else(|_| Value::from(value.trim()));
    let keys: Vec<&str> = key.trim().split('.').collect();
    let (last, path) = keys.split_last().expect("split gives at least one part");
    if keys.iter().any(|k| k.is_empty()) {
        return Err(InputError::new(&place, "a part of the key is empty", "write a.b.c=value"));
    }
    let mut item = document.as_item_mut();
    for part in path {
        item = descend(item, part, &place)?;
    }
    let item = only_element(item);
    let table = item.as_table_like_mut().ok_or_else(|| not_a_table(&place, last))?;
    match table.get_mut(last).and_then(Item::as_value_mut) {
        // The comments around the old value are kept.
        Some(old) => {
            let decor = old.decor().clone();
            *old = value;
            *old.decor_mut() = decor;
        }
        None => {
            table.insert(last, Item::Value(value));
        }
    }
    Ok(())
}

fn descend<'a>(item: &'a mut Item, part: &str, place: &str) -> Result<&'a mut Item, InputError> {
    if let Ok(index) = part.parse::<usize>() {
        return item.get_mut(index).ok_or_else(|| {
            InputError::new(place, format!("there is no element {index}"), "count from 0")
        });
    }
    let item = only_element(item);
    if !item.is_table_like() {
        return Err(not_a_table(place, part));
    }
    let table = item.as_table_like_mut().expect("checked just now");
    if !table.contains_key(part) {
        let mut new = toml_edit::Table::new();
        new.set_implicit(true);
        table.insert(part, Item::Table(new));
    }
    Ok(table.get_mut(part).expect("inserted just now"))
}

/// Returns the table itself, or the only table of an array of tables.
fn only_element(item: &mut Item) -> &mut Item {
    let is_single = item.as_array_of_tables().is_some_and(|a| a.len() == 1)
        || item.as_array().is_some_and(|a| a.len() == 1);
    if is_single { item.get_mut(0).expect("one element") } else { item }
}

fn not_a_table(place: &str, key: &str) -> InputError {
    InputError::new(
        place,
        format!("`{key}` does not stand in a table"),
        "name the element of an array by its number, e.g. robots.0.count",
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Source;

    fn with(text: &str, overrides: &[&str]) -> Result<String, InputError> {
        let overrides: Vec<String> = overrides.iter().map(ToString::to_string).collect();
        Source::new("s.toml", text, "").with(&overrides).map(|s| s.text)
    }

    #[test]
    fn overrides_replace_add_and_reach_into_arrays() {
        let text = "seed = 1 # why\n[[robots]]\ncount = 2\n";
        let set = with(text, &["seed=7", "robots.count=20", "map.box_size_m=0.5", "regime=both"]);
        let table: toml::Table = set.expect("fits").parse().expect("TOML");
        assert_eq!(table["seed"].as_integer(), Some(7));
        assert_eq!(table["robots"][0]["count"].as_integer(), Some(20));
        assert_eq!(table["map"]["box_size_m"].as_float(), Some(0.5));
        assert_eq!(table["regime"].as_str(), Some("both"));
    }

    #[test]
    fn an_override_that_does_not_fit_says_so() {
        for bad in ["seed", "=1", "a..b=1", "seed.x=1", "robots.5.count=1"] {
            let error = with("seed = 1\n[[robots]]\n[[robots]]\n", &[bad]).expect_err(bad);
            assert_eq!(error.place(), format!("--set {bad}"));
        }
    }
}
