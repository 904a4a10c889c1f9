//! Repairs of an error: the change that its author may have meant, or nothing at all.

use super::draft::Draft;
use super::tree::{find, key_path};
use serde_json::Value;
use sidestep_kernel::InputError;
use sidestep_scenario::schema;

/// Largest number of examples that are tried for a key: each costs a compilation.
const MAX_EXAMPLES: usize = 3;

/// A change to a draft.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Repair {
    /// The key that is changed.
    target: Vec<String>,
    what: RepairKind,
    /// Whether its author is likely to have meant it.
    is_meant: bool,
    /// Names of keys that are gone with it: what refers to them is wrong because of the repair.
    removed_names: Vec<String>,
}

#[derive(Debug, Clone, PartialEq)]
enum RepairKind {
    /// The key has another name.
    Rename(String),
    /// The key has another value.
    Replace(String),
    /// The key is new, and has this value.
    Insert(String),
    /// The key is gone.
    Remove,
}

/// Returns repairs of an error, the likeliest first.
pub(super) fn repairs(draft: &Draft, error: &InputError, schema: &Value) -> Vec<Repair> {
    let own = error.key().map(key_path).unwrap_or_default();
    let mut all = suggested_repair(draft, error, &own);
    all.extend(missing_key_repairs(draft, error, &own, schema));
    if !own.is_empty() {
        // A section with all its keys gives fewer errors that only follow.
        all.extend(other_value_repairs(draft, &own, schema));
        all.push(Repair::from_removal(draft, &own));
    }
    // At last the tables around the key, the innermost first: the less is removed, the more errors
    // of the rest are found.
    for count in (1..own.len()).rev() {
        all.push(Repair::from_removal(draft, &own[..count]));
    }
    all
}

/// Returns the change that the error's remedy takes for the meaning of the author.
fn suggested_repair(draft: &Draft, error: &InputError, own: &[String]) -> Vec<Repair> {
    let meant = text_between(error.remedy(), "did you mean `", "`");
    let (Some(meant), Some(wrong)) = (meant, text_between(error.cause(), "`", "`")) else {
        return Vec::new();
    };
    let what = if own.last().is_some_and(|name| name == wrong) {
        let renamed = [&own[..own.len() - 1], &[meant.to_string()]].concat();
        if find(draft.text(), &renamed).is_some() {
            return Vec::new();
        }
        RepairKind::Rename(toml_edit::Key::new(meant).display_repr().into_owned())
    } else {
        RepairKind::Replace(toml::Value::from(meant).to_string())
    };
    vec![Repair { target: own.to_vec(), what, is_meant: true, removed_names: Vec::new() }]
}

/// The error's text names the key; its values are examples of the schema, then the list beside it.
fn missing_key_repairs(
    draft: &Draft,
    error: &InputError,
    own: &[String],
    schema: &Value,
) -> Vec<Repair> {
    let named = text_between(error.cause(), "the key `", "` is missing");
    let named = named.or_else(|| text_between(error.cause(), "the row `", "` is missing"));
    let Some(name) = named.or_else(|| text_between(error.remedy(), "add ", " = ")) else {
        return Vec::new();
    };
    let name = name.trim_matches('`');
    let target = [own, &[name.to_string()]].concat();
    let lists = find(draft.text(), own).map(|found| found.lists).unwrap_or_default();
    let values = examples(schema, &target).chain(lists.into_iter().take(1));
    values.map(|value| Repair::from_guess(&target, RepairKind::Insert(value))).collect()
}

/// Returns other values for a key: those that its world shows, and that of a list beside it.
fn other_value_repairs(draft: &Draft, own: &[String], schema: &Value) -> Vec<Repair> {
    let Some(found) = find(draft.text(), own) else { return Vec::new() };
    let values = examples(schema, own).chain(found.lists.into_iter().take(1));
    values.map(|value| Repair::from_guess(own, RepairKind::Replace(value))).collect()
}

fn examples(schema: &Value, key: &[String]) -> impl Iterator<Item = String> {
    // Elements of arrays have no place of their own in a schema.
    let names: Vec<String> = key.iter().filter(|p| p.parse::<usize>().is_err()).cloned().collect();
    let is_element = key.last().is_some_and(|part| part.parse::<usize>().is_ok());
    let known = if is_element { Vec::new() } else { schema::examples(schema, &names) };
    let texts = known.into_iter().filter_map(|value| toml::Value::try_from(value).ok());
    texts.map(|value| value.to_string()).take(MAX_EXAMPLES)
}

fn text_between<'a>(text: &'a str, before: &str, after: &str) -> Option<&'a str> {
    text.split_once(before)?.1.split_once(after).map(|(inside, _)| inside)
}

impl Repair {
    fn from_guess(target: &[String], what: RepairKind) -> Self {
        Self { target: target.to_vec(), what, is_meant: false, removed_names: Vec::new() }
    }

    fn from_removal(draft: &Draft, target: &[String]) -> Self {
        let removed = find(draft.text(), target);
        let removed_names = removed.map(|found| found.inner_names).unwrap_or_default();
        Self { removed_names, ..Self::from_guess(target, RepairKind::Remove) }
    }

    /// Returns the guess that it makes, unless its author is likely to have meant it.
    pub(super) fn guess(&self) -> Option<Guess> {
        (!self.is_meant).then(|| self.clone().into())
    }

    /// Returns the draft with this change; none if it does not fit.
    pub(super) fn applied_to(&self, draft: &Draft) -> Option<Draft> {
        let parts = match &self.what {
            RepairKind::Rename(name) => {
                vec![(find(draft.text(), &self.target)?.name?, name.clone())]
            }
            RepairKind::Replace(value) => {
                vec![(find(draft.text(), &self.target)?.value?, value.clone())]
            }
            RepairKind::Remove => {
                let parts = find(draft.text(), &self.target)?.parts;
                parts.into_iter().map(|part| (part, String::new())).collect()
            }
            RepairKind::Insert(value) => {
                let (name, table) = self.target.split_last()?;
                let at = find(draft.text(), table)?.inside?;
                let line = format!("{} = {value}", toml_edit::Key::new(name).display_repr());
                let (before, after) = match draft.text()[at.clone()].chars().next() {
                    None => ("", "\n"),
                    Some('{') => (" ", ","),
                    Some(_) => ("\n", ""),
                };
                vec![(at.end..at.end, format!("{before}{line}{after}"))]
            }
        };
        draft.with_replacements(parts)
    }

    /// Returns whether an error of the draft with this change may only be there because of it.
    pub(super) fn may_lead_to(&self, next: &InputError) -> bool {
        let key = next.key().map(key_path).unwrap_or_default();
        if let RepairKind::Rename(name) = &self.what {
            // A value that does not fit the other key was hardly meant for it.
            let table = &self.target[..self.target.len() - 1];
            let renamed = [table, &[name.trim_matches(['"', '\'']).to_string()]].concat();
            return key.starts_with(&renamed);
        }
        let guess = Guess::from(self.clone());
        if self.is_meant { guess.contains(&key) } else { guess.may_lead_to(next) }
    }
}

/// A key to which a draft gives a value, or none, that its author did not mean.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Guess {
    key: Vec<String>,
    is_removed: bool,
    removed_names: Vec<String>,
}

impl From<Repair> for Guess {
    fn from(repair: Repair) -> Self {
        let is_removed = repair.what == RepairKind::Remove;
        Self { key: repair.target, is_removed, removed_names: repair.removed_names }
    }
}

impl Guess {
    /// Returns whether a key is in the value that it gives. Where an element was removed, the next one has its
    /// number.
    fn contains(&self, key: &[String]) -> bool {
        !self.is_removed && key.starts_with(&self.key)
    }

    /// Returns whether an error may only be there because of this: one in the value, one of a table around it,
    /// unless that misses another key, or one elsewhere that names it.
    pub(super) fn may_lead_to(&self, error: &InputError) -> bool {
        let Some(key) = error.key().map(key_path) else { return true };
        if self.contains(&key) {
            return true;
        }
        if error.cause().starts_with("unknown key") {
            return false;
        }
        if let Some(name) = self.key.strip_prefix(&key[..]).and_then(|rest| rest.first()) {
            let missing = text_between(error.cause(), "the key `", "` is missing");
            return missing.is_none_or(|missing| missing == name);
        }
        // Keys beside it may have nothing to do.
        let table = &self.key[..self.key.len().saturating_sub(1)];
        let is_about_others = error.cause().contains("does nothing")
            // Rows have as many entries as a list beside them has names.
            || error.cause().contains(" entries, not ");
        if is_about_others && key.starts_with(table) {
            return true;
        }
        // Names of its own key are in the error anyway, and numbers of elements are no names.
        let mut names =
            self.key.iter().filter(|part| part.parse::<usize>().is_err() && !key.contains(part));
        names.any(|name| mentions(error, name))
            || self.is_unknown_by_removal(error)
            || self.is_unknown_without_profile(error)
    }

    /// Returns whether an error is about a name that nothing has because the table with it was removed.
    fn is_unknown_by_removal(&self, error: &InputError) -> bool {
        let is_unknown = error.cause().starts_with("unknown ");
        let named = text_between(error.cause(), "`", "`");
        is_unknown && named.is_some_and(|named| self.removed_names.iter().any(|name| name == named))
    }

    /// Returns whether an error is about a name that a profile may have given, which cannot be read.
    fn is_unknown_without_profile(&self, error: &InputError) -> bool {
        let is_profile = self.is_removed && self.key.first().is_some_and(|key| key == "profiles");
        let kinds = ["unknown sensor ", "unknown effector "];
        is_profile && kinds.iter().any(|kind| error.cause().starts_with(kind))
    }
}

fn mentions(error: &InputError, name: &str) -> bool {
    // A remedy of the reader's names the world, and sections may have its name.
    let is_of_the_reader = error.remedy().starts_with("see what");
    // A name of several words stands in backticks, and so does one of a letter: `a` is a word of most sentences.
    let is_word = name.chars().nth(1).is_some();
    error.cause().contains(&format!("`{name}`"))
        || is_word && has_word(error.cause(), name)
        || is_word && !is_of_the_reader && has_word(error.remedy(), name)
}

fn has_word(text: &str, word: &str) -> bool {
    text.split(|c: char| !c.is_alphanumeric() && !"_-".contains(c)).any(|one| one == word)
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;
    use sidestep_scenario::Source;

    const TEXT: &str = "[[robots]]\ncuont = 3\nkind = \"cat\"\nat = [1, 2]\n";

    /// Returns the texts to which repairs of an error lead.
    fn repaired(part: &str, cause: &str, remedy: &str) -> Vec<String> {
        let draft = Draft::new(Source::new("s.toml", TEXT, ""));
        let start = TEXT.find(part).expect(part);
        let error = draft.source().error(start..start + part.len(), cause, remedy);
        let schema = json!({ "properties": { "robots": { "properties": {
            "kind": { "examples": ["person"] }, "size": { "examples": [2] },
        } } } });
        let all = repairs(&draft, &error, &schema);
        all.iter().filter_map(|one| one.applied_to(&draft)).map(|d| d.text().into()).collect()
    }

    #[test]
    fn what_was_meant_comes_first_and_what_is_around_last() {
        let texts = repaired("cuont", "unknown key `cuont`", "did you mean `count`?");
        assert_eq!(texts[0], TEXT.replace("cuont", "count"));
        assert_eq!(texts[1], TEXT.replace("cuont = 3", ""));
        assert_eq!(texts.last().map(String::as_str), Some(""));
        let texts = repaired("\"cat\"", "unknown kind `cat`", "did you mean `cart`?");
        assert_eq!(texts[0], TEXT.replace("cat", "cart"));
        assert_eq!(texts[1], TEXT.replace("cat", "person"));
        let texts = repaired("[[robots]]", "the key `size` is missing", "add `size = ...`");
        assert_eq!(texts[0], TEXT.replace("[[robots]]", "[[robots]]\nsize = 2"));
    }

    #[test]
    fn what_may_follow_from_a_repair_is_known_by_its_key_and_by_its_words() {
        let repair = |key: &str, what: RepairKind| Repair::from_guess(&key_path(key), what);
        let error = |key: &str, cause: &str| InputError::new("s", cause, "r").with_key(key);
        let gone = repair("sensors.eye", RepairKind::Remove);
        assert!(gone.may_lead_to(&error("robots.0.sensors.0", "unknown sensor `eye`")));
        assert!(gone.may_lead_to(&InputError::new("s", "no robots", "add some")));
        assert!(!gone.may_lead_to(&error("robots.0.effector", "unknown effector `ear`")));
        assert!(!gone.may_lead_to(&error("robots.0.eye", "unknown key `eye`")));
        let profile = repair("profiles.0", RepairKind::Remove);
        assert!(profile.may_lead_to(&error("robots.0.sensors.0", "unknown sensor `eye`")));
        assert!(profile.may_lead_to(&error("robots.0.effector", "unknown effector `ear`")));
        assert!(!profile.may_lead_to(&error("robots.0.kind", "unknown kind `ear`")));
        let renamed = Repair {
            is_meant: true,
            ..repair("map.unknwon", RepairKind::Rename("unknown".into()))
        };
        assert!(renamed.may_lead_to(&error("map.unknown", "wanted a word")));
        assert!(!renamed.may_lead_to(&error("map.file", "wanted a word")));
        let other = repair("robots.0.size", RepairKind::Replace("2".into()));
        assert!(other.may_lead_to(&error("robots.0.size", "size = 2")));
        assert!(other.may_lead_to(&error("robots.0", "no place is free")));
        assert!(!other.may_lead_to(&error("robots.0", "the key `kind` is missing")));
        assert!(!other.may_lead_to(&error("robots.1", "no place is free")));
        assert!(other.may_lead_to(&error("people.0", "no place beside a size of 2")));
        assert!(!other.may_lead_to(&error("people.0.size", "size = 0")));
        let list = repair("sensors.eye.seen", RepairKind::Replace("[\"nothing\"]".into()));
        let row = "row `wall` has 3 entries, not 1";
        assert!(list.may_lead_to(&error("sensors.eye.confusion.wall", row)));
        assert!(!list.may_lead_to(&error("sensors.ear.confusion.wall", row)));
    }
}
