//! Independent mistakes are reported together, each at its key, and nothing else is.

use crate::shipped;
use serde_json::Value;
use sidestep::experiment::problems;
use sidestep::scenario::Source;
use sidestep::worlds::WORLDS;
use std::ops::Range;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// A mistake that can be made in a text: the key at which it is to be reported, and the replaced text.
#[derive(Debug, Clone, PartialEq)]
struct Mistake {
    key: Vec<String>,
    sort: &'static str,
    at: Range<usize>,
    text: String,
}

impl Mistake {
    fn key(&self) -> String {
        self.key.join(".")
    }
}

/// Tables with keys that are names given by the scenario.
const NAMES: [&str; 9] = [
    "sensors",
    "effectors",
    "kinds",
    "designates",
    "confusion",
    "confusion_by_class",
    "distance_confusion",
    "weights",
    "evidence",
];

/// Gathers mistakes of all sorts in a text.
struct Mistakes<'a> {
    text: &'a str,
    schema: &'a Value,
    found: Vec<Mistake>,
}

impl Mistakes<'_> {
    fn add(
        &mut self,
        key: &[String],
        sort: &'static str,
        at: Range<usize>,
        text: impl Into<String>,
    ) {
        self.found.push(Mistake { key: key.to_vec(), sort, at, text: text.into() });
    }

    fn table(&mut self, table: &DeTable<'_>, way: &[String]) {
        let has_names = way.iter().any(|part| NAMES.contains(&part.as_str()));
        for (name, value) in table.iter() {
            let key = [way, &[name.get_ref().to_string()]].concat();
            if key == ["format"] || key == ["world"] {
                continue;
            }
            let is_dotted = self.text[name.span().end..].starts_with('.');
            if !has_names && !is_dotted && !self.is_header(value) {
                let misspelled = format!("{}_", name.get_ref());
                let at = [way, std::slice::from_ref(&misspelled)].concat();
                self.add(&at, "a misspelled key", name.span(), misspelled.clone());
            }
            self.value(value, &key);
        }
    }

    fn is_header(&self, value: &Spanned<DeValue<'_>>) -> bool {
        let is_table = |value: &Spanned<DeValue<'_>>| {
            let begins = &self.text[value.span().start..];
            value.get_ref().is_table() && !begins.starts_with('{')
        };
        let first = value.get_ref().as_array().and_then(|many| many.first());
        is_table(value) || first.is_some_and(is_table)
    }

    fn value(&mut self, value: &Spanned<DeValue<'_>>, key: &[String]) {
        let span = value.span();
        let last = key.last().map_or("", String::as_str);
        match value.get_ref() {
            DeValue::Table(table) => {
                let is_named = key.iter().any(|part| NAMES.contains(&part.as_str()));
                if self.text[span.clone()].starts_with('[') && !is_named {
                    let unknown = [key, &["nonsense".to_string()]].concat();
                    let at = span.end..span.end;
                    self.add(&unknown, "an unknown key", at, "\nnonsense = 1");
                }
                self.table(table, key);
            }
            DeValue::Array(many) => self.array(value, many, key),
            DeValue::String(_) if ["effector", "kind"].contains(&last) => {
                self.add(key, "an unknown name", span, "\"nobody\"");
            }
            DeValue::Integer(_) | DeValue::Float(_) => {
                self.add(key, "a wrong type", span.clone(), "\"many\"");
                if self.is_not_negative(key) {
                    self.add(key, "out of range", span, "-7");
                }
            }
            DeValue::Boolean(_) => self.add(key, "a wrong type", span, "\"maybe\""),
            _ => self.add(key, "a wrong type", span, "[[]]"),
        }
    }

    fn array(
        &mut self,
        value: &Spanned<DeValue<'_>>,
        many: &[Spanned<DeValue<'_>>],
        key: &[String],
    ) {
        let span = value.span();
        if key.iter().any(|part| part.contains("confusion")) {
            let doubled = format!("[0.75, {}", &self.text[span.start + 1..span.end]);
            return self.add(key, "a bad row", span, doubled);
        }
        if key.last().is_some_and(|last| last == "sensors") {
            let at = many.first().expect("a sensor").span();
            let element = [key, &["0".to_string()]].concat();
            return self.add(&element, "an unknown name", at, "\"nobody\"");
        }
        if !self.is_header(value) {
            self.add(key, "a wrong type", span, "true");
        }
        for (i, one) in many.iter().enumerate().filter(|(_, one)| one.get_ref().is_table()) {
            self.value(one, &[key, &[i.to_string()]].concat());
        }
    }

    /// Returns whether the schema says that a number must be 0 or more.
    fn is_not_negative(&self, key: &[String]) -> bool {
        let mut part = self.schema;
        for name in key.iter().filter(|name| name.parse::<usize>().is_err()) {
            let Some(inner) = inside(self.schema, part, name) else { return false };
            part = inner;
        }
        let least = part.get("minimum").or_else(|| part.get("exclusiveMinimum"));
        least.and_then(Value::as_f64).is_some_and(|least| least >= 0.0)
    }
}

fn inside<'s>(root: &'s Value, part: &'s Value, name: &str) -> Option<&'s Value> {
    if let Some(target) = part.get("$ref").and_then(Value::as_str) {
        return inside(root, root.pointer(target.trim_start_matches('#'))?, name);
    }
    let first = part.get("oneOf").or_else(|| part.get("anyOf")).and_then(|all| all.get(0));
    if let Some(found) = first.and_then(|first| inside(root, first, name)) {
        return Some(found);
    }
    part.get("properties").and_then(|own| own.get(name))
}

fn mistakes(source: &Source, schema: &Value) -> Vec<Mistake> {
    let root = DeTable::parse(&source.text).expect("TOML");
    let mut all = Mistakes { text: &source.text, schema, found: Vec::new() };
    all.table(root.get_ref(), &[]);
    all.found
}

fn with(source: &Source, mistakes: &[&Mistake]) -> Source {
    let mut text = source.text.clone();
    let mut sorted = mistakes.to_vec();
    sorted.sort_by_key(|mistake| std::cmp::Reverse(mistake.at.start));
    sorted.iter().for_each(|mistake| text.replace_range(mistake.at.clone(), &mistake.text));
    Source { text, ..source.clone() }
}

fn reported_problems(source: &Source) -> Vec<String> {
    let keys = problems(&WORLDS, source).into_iter();
    let mut keys: Vec<String> =
        keys.map(|e| e.key().map_or_else(|| e.to_string(), String::from)).collect();
    keys.sort();
    keys
}

/// Returns whether two mistakes have nothing to do with each other.
fn are_independent(a: &Mistake, b: &Mistake) -> bool {
    let key = |one: &Mistake| {
        one.key.iter().map(|part| part.trim_end_matches('_').to_string()).collect::<Vec<_>>()
    };
    let (one, other) = (key(a), key(b));
    !one.starts_with(&other) && !other.starts_with(&one) && a.at.start != b.at.start
}

/// Returns `count` independent mistakes, from one to the next by a stride.
fn some_of(all: &[Mistake], count: usize, start: usize) -> Vec<&Mistake> {
    let stride = if all.len().is_multiple_of(17) { 19 } else { 17 };
    let mut chosen: Vec<&Mistake> = Vec::new();
    // Without its dimensions a chain's places are read as those of the plane, so every other one is wrong too.
    let rules_others = |one: &Mistake| {
        let parts: Vec<&str> = one.key.iter().map(|part| part.trim_end_matches('_')).collect();
        // Without its time no break comes before what joins the parts again, which then joins nothing.
        let is_time_of_change = matches!(parts[..], ["chains", _, "changes", _, "at_s"]);
        parts == ["chain", "dimensions"] || is_time_of_change
    };
    let in_turn = (0..all.len()).map(|i| &all[(start + stride * i) % all.len()]);
    for one in in_turn.filter(|one| !rules_others(one)) {
        if chosen.len() < count && chosen.iter().all(|other| are_independent(other, one)) {
            chosen.push(one);
        }
    }
    assert_eq!(chosen.len(), count);
    chosen
}

#[test]
fn right_scenarios_have_no_problems() {
    for (_, source) in shipped::all() {
        assert_eq!(reported_problems(&source), [""; 0], "{}", source.place);
    }
}

#[test]
fn two_to_five_mistakes_are_all_told_at_their_keys_and_nothing_else_is() {
    let (mut right, mut wrong) = (0, Vec::new());
    for (i, (world, source)) in shipped::all().into_iter().enumerate() {
        let schema = WORLDS.schema(Some(&world)).expect("a world");
        let all = mistakes(&source, &schema);
        for k in [2 + i % 4, 5 - i % 4] {
            let chosen = some_of(&all, k, 7 * i + k);
            let mut keys: Vec<String> = chosen.iter().map(|mistake| mistake.key()).collect();
            keys.sort();
            let told = reported_problems(&with(&source, &chosen));
            if told == keys {
                right += 1;
            } else {
                wrong.push(format!("{}\n  made {keys:?}\n  told {told:?}", source.place));
            }
        }
    }
    assert!(wrong.is_empty(), "{right} are right\n{}", wrong.join("\n"));
}

#[test]
fn what_a_draft_was_given_is_never_told() {
    let text = "format = 1\nworld = \"chain\"\n[chain]\ndimensions = 3\n[chains]\nconnectors = 4\n\
                at_m = [0.0, 0.0]\nrod_m = 1.0\n[chains.tasks]\nkind = \"targets\"\n\
                targets_m = [[1.0, 0.0]]\n";
    let source = Source::new("c.toml", text, "");
    assert_eq!(reported_problems(&source), ["chains.at_m", "chains.tasks.targets_m"]);
}

#[test]
fn a_door_that_a_sensor_cannot_tell_is_one_problem_with_a_remedy_that_works() {
    let text = "format = 1\nworld = \"robots\"\ncycles = 10\n[map]\nascii = \"\"\"\n......\n......\n\"\"\"\n\
                [sensors.eye]\nobservations = [\"nothing\", \"wall\", \"robot\"]\nbearings_deg = [0]\nrange_m = 2\n\
                [sensors.eye.confusion]\nnothing = [1, 0, 0]\nwall = [0, 1, 0]\nrobot = [0, 0, 1]\n\
                [[robots]]\ncount = 1\nsensors = [\"eye\"]\n\
                [[doors]]\nat = [[2, 1]]\nperiodic = { open = 5, closed = 5 }\n";
    let told = problems(&WORLDS, &Source::new("s.toml", text, ""));
    let [one] = &told[..] else { panic!("{} problems: {told:?}", told.len()) };
    assert_eq!(one.key(), Some("sensors.eye.observations"), "{one}");
    let (_, remedy) = one.remedy().split_once("takes it for: ").expect("a remedy to paste");
    let (statement, _) = remedy.split_once(" where").expect("the remedy's end");
    let text = text.replace("range_m = 2", &format!("range_m = 2\n{statement}"));
    assert_eq!(problems(&WORLDS, &Source::new("s.toml", text, "")), []);
}
