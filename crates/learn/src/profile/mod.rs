//! Profiles: files of sensors and effectors that a scenario loads by name.
//!
//! [`empty`] makes one, [`with_sensor`] and [`with_effector`] add learned sections to it and leave
//! the rest of the text as it is, comments included. Each section ends with a table `evidence` that
//! the simulation ignores: source, rule, every probability with its count and 95 % interval, rows
//! that are thin or assumed, and the hold-out fit.

mod evidence;

use toml_edit::{Array, DocumentMut, InlineTable, Item, Table, Value, value};

use super::effector::{LearnedEffector, ProfileTransition};
use super::sensor::{BeamFit, LearnedSensor, NamedRow, SensorProfile};
use sidestep_error_models::delay::DelayModel;
use sidestep_kernel::InputError;
use sidestep_scenario::FORMAT;

/// Returns a profile without sensors and effectors, called `name`.
pub fn empty(name: &str) -> String {
    let mut document = DocumentMut::new();
    document["format"] = value(i64::from(FORMAT));
    document["profile"] = value(name);
    document.to_string()
}

/// Returns the profile `text` with the sensor `name` added, or replaced, and where ranges were learned with the sensor
/// [`beam_name`], which has their beam model; `place` names the text in errors.
///
/// # Errors
/// When `text` is not a profile or `name` is empty.
pub fn with_sensor(
    place: &str,
    text: &str,
    name: &str,
    model: &LearnedSensor,
) -> Result<String, InputError> {
    let text = with_section(place, text, ["sensors", name], sensor(model))?;
    match &model.report.beam {
        Some(fit) => {
            let section = beam_sensor(model, fit);
            with_section(place, &text, ["sensors", &beam_name(name)], section)
        }
        None => Ok(text),
    }
}

/// Returns the name of the sensor of a profile that has the beam model beside the tables of the sensor `name`.
pub fn beam_name(name: &str) -> String {
    format!("{name}-beam")
}

/// Returns the profile `text` with the effector `name` added, or replaced; `place` names the text
/// in errors.
///
/// # Errors
/// When `text` is not a profile or `name` is empty.
pub fn with_effector(
    place: &str,
    text: &str,
    name: &str,
    model: &LearnedEffector,
) -> Result<String, InputError> {
    with_section(place, text, ["effectors", name], effector(model))
}

/// The name of what was learned in a profile of its own, see [`with_learned`].
const LEARNED: &str = "learned";

/// Returns a profile of the sensor alone, from which [`with_learned`] takes it.
///
/// # Errors
/// None that a learned sensor has.
pub fn of_sensor(model: &LearnedSensor) -> Result<String, InputError> {
    with_sensor("profile", &empty(LEARNED), LEARNED, model)
}

/// Returns a profile of the effector alone, from which [`with_learned`] takes it.
///
/// # Errors
/// None that a learned effector has.
pub fn of_effector(model: &LearnedEffector) -> Result<String, InputError> {
    with_effector("profile", &empty(LEARNED), LEARNED, model)
}

/// Returns the profile `text` with what was learned added, or replaced, as [`with_sensor`] and [`with_effector`] do;
/// `learned` is the text that [`of_sensor`] or [`of_effector`] returned. What was learned can be kept as that text.
///
/// # Errors
/// When `text` is not a profile or `name` is empty; when `learned` is not such a text.
pub fn with_learned(
    place: &str,
    text: &str,
    name: &str,
    learned: &str,
) -> Result<String, InputError> {
    let document = parse("learned", learned)?;
    let mut text = text.to_owned();
    let mut is_empty = true;
    for group in ["sensors", "effectors"] {
        let sections = document.get(group).and_then(Item::as_table);
        for (key, item) in sections.into_iter().flat_map(Table::iter) {
            let (Some(suffix), Some(section)) = (key.strip_prefix(LEARNED), item.as_table()) else {
                continue;
            };
            is_empty = false;
            let own_name = if suffix.is_empty() { name.to_owned() } else { beam_name(name) };
            text = with_section(place, &text, [group, &own_name], without_places(section))?;
        }
    }
    if is_empty {
        let cause = format!("there is no sensor and no effector `{LEARNED}`");
        return Err(InputError::new("learned", cause, "give the text unchanged"));
    }
    Ok(text)
}

/// Returns the same table as one that was made here: the places of its parts in the text that they come from would mix
/// them with others.
fn without_places(table: &Table) -> Table {
    let mut fresh = Table::new();
    fresh.set_implicit(table.is_implicit());
    for (key, item) in table {
        let item = match item {
            Item::Table(part) => Item::Table(without_places(part)),
            Item::ArrayOfTables(parts) => {
                Item::ArrayOfTables(parts.iter().map(without_places).collect())
            }
            Item::Value(part) => {
                let mut part = part.clone();
                part.decor_mut().clear();
                Item::Value(part)
            }
            other => other.clone(),
        };
        fresh.insert(key, item);
    }
    fresh
}

/// Returns whether the profile `text` has a section `name` among the `group` "sensors" or "effectors".
pub fn has_section(text: &str, group: &str, name: &str) -> bool {
    let Ok(document) = text.parse::<DocumentMut>() else { return false };
    let sections = document.get(group);
    sections.is_some_and(|sections| sections.get(name).is_some())
}

fn with_section(
    place: &str,
    text: &str,
    [group, name]: [&str; 2],
    section: Table,
) -> Result<String, InputError> {
    if name.trim().is_empty() {
        let cause = format!("one of the {group} has no name");
        return Err(InputError::new(place, cause, "give it a name, e.g. camera"));
    }
    let mut document = parse(place, text)?;
    let sections = document.entry(group).or_insert_with(|| Item::Table(implicit()));
    let sections = sections.as_table_mut().ok_or_else(|| {
        let cause = format!("`{group}` is no table");
        InputError::new(place, cause, format!("write [{group}.{name}] for a section"))
    })?;
    // Removed first, so that the new section stands at the end instead of among the rest.
    sections.remove(name);
    sections.insert(name, Item::Table(section));
    Ok(document.to_string())
}

/// Returns the document, if it is a profile of the format that is written here.
fn parse(place: &str, text: &str) -> Result<DocumentMut, InputError> {
    let document: DocumentMut = text.parse().map_err(|e: toml_edit::TomlError| {
        let error = InputError::new(place, e.message(), "write valid TOML");
        e.span().map_or(error.clone(), |span| error.with_byte_offset(text, span.start))
    })?;
    let format = document.get("format").and_then(Item::as_integer);
    if format != Some(i64::from(FORMAT)) || !document.contains_key("profile") {
        let remedy = format!("begin it with `format = {FORMAT}` and `profile = \"name\"`");
        return Err(InputError::new(place, "the file is no profile", remedy));
    }
    Ok(document)
}

/// Returns a table without a header of its own.
fn implicit() -> Table {
    let mut table = Table::new();
    table.set_implicit(true);
    table
}

/// Returns the keys of a sensor that do not concern its errors.
fn shape(profile: &SensorProfile) -> Table {
    let mut section = Table::new();
    section["bearings_deg"] = numbers(&profile.bearings_deg);
    section["range_m"] = value(profile.range_m);
    section["observations"] = words(&profile.observations);
    if !profile.designates.is_empty() {
        let named = profile.designates.iter().map(|(kind, seen)| (kind, seen.as_str()));
        section["designates"] = value(InlineTable::from_iter(named));
    }
    section["distance_edges_m"] = numbers(&profile.distance_edges_m);
    section["distance_classes"] = words(&profile.distance_classes);
    section
}

fn sensor(model: &LearnedSensor) -> Table {
    let profile = &model.profile;
    let mut section = shape(profile);
    section["confusion"] = rows(&profile.confusion);
    if !profile.confusion_by_class.is_empty() {
        let mut by_class = implicit();
        for (class, class_rows) in &profile.confusion_by_class {
            by_class[class] = rows(class_rows);
        }
        section["confusion_by_class"] = Item::Table(by_class);
    }
    section["distance_confusion"] = rows(&profile.distance_confusion);
    section["evidence"] = Item::Table(evidence::sensor_evidence(model));
    section
}

/// Returns the same sensor with its beam model in place of the rows.
fn beam_sensor(model: &LearnedSensor, fit: &BeamFit) -> Table {
    let mut section = shape(&model.profile);
    let mut beam = InlineTable::new();
    for (name, number) in fit.rounded_parameters() {
        beam.insert(name, number.into());
    }
    section["beam"] = value(beam);
    section["evidence"] = Item::Table(evidence::beam_evidence(model, fit));
    section
}

fn effector(model: &LearnedEffector) -> Table {
    let mut section = Table::new();
    if let Some(box_m) = model.profile.box_m {
        section["box_m"] = value(box_m);
    }
    for (action, transitions) in &model.profile.actions {
        section[action] = value(Array::from_iter(transitions.iter().map(transition)));
    }
    if let Some(model) = &model.profile.delays {
        section["delays"] = Item::Table(delays(model));
    }
    section["evidence"] = Item::Table(evidence::effector_evidence(model));
    section
}

fn delays(model: &DelayModel) -> Table {
    let mut section = Table::new();
    section["p"] = value(model.p);
    section["per"] = value(model.per.name());
    let durations = model.durations.iter().map(|duration| {
        let mut fields = InlineTable::new();
        fields.insert("cycles", i64::from(duration.cycles).into());
        fields.insert("p", duration.p.into());
        Value::from(fields)
    });
    section["durations"] = value(Array::from_iter(durations));
    section
}

/// Returns `{ p = 0.9, path = "F" }`; a turn of 0 is left out, and so is the path of a turn in
/// place.
fn transition(transition: &ProfileTransition) -> Value {
    let mut fields = InlineTable::new();
    fields.insert("p", transition.p.into());
    if !transition.path.is_empty() || transition.turn_deg == 0 {
        fields.insert("path", transition.path.as_str().into());
    }
    if transition.turn_deg != 0 {
        fields.insert("turn", i64::from(transition.turn_deg).into());
    }
    fields.into()
}

fn rows(rows: &[NamedRow]) -> Item {
    let mut table = Table::new();
    for row in rows {
        table[&row.name] = numbers(&row.probabilities);
    }
    Item::Table(table)
}

fn numbers(numbers: &[f64]) -> Item {
    value(Array::from_iter(numbers.iter().copied()))
}

fn words(words: &[String]) -> Item {
    value(Array::from_iter(words.iter().map(String::as_str)))
}

#[cfg(test)]
mod tests;
