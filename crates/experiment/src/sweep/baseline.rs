//! The baseline that the variants of a sweep are compared with.
//!
//! A baseline that gives the values of some keys is matched within the others: with
//! `method = "none"` in a grid of methods and numbers of airplanes, every variant is compared with
//! the variant without a method *and its own number of airplanes*. One that gives all keys, or fits
//! a single variant for another reason, is that variant, for all others.

use super::variant::{BaseScenario, DEFAULT_LABEL, Setting, Variant};
use serde::{Deserialize, Serialize};
use sidestep_kernel::InputError;
use sidestep_scenario::suggestion;
use std::collections::{BTreeMap, BTreeSet};
use toml::Value;

/// Largest number of values that an error lists: more are no longer read.
const MAX_LISTED_VALUES: usize = 20;

/// The baseline as requested: the values of some keys, the name of a variant, or both.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct BaselineSpec {
    /// The name of a listed variant.
    pub name: Option<String>,
    /// Values; `(default)` where a variant does not set the key.
    pub settings: Vec<Setting>,
}

/// The baseline that the variants are compared with.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Baseline {
    /// Its name in tables: `method=none`.
    pub name: String,
    /// The variant that each variant is compared with; `None` for those that are the baseline, and
    /// those to which no baseline corresponds.
    pub of: Vec<Option<u32>>,
    /// Number of variants to which no baseline corresponds.
    pub alone: usize,
}

impl Baseline {
    /// Checks that it compares this many variants with each other, and with no others.
    pub(super) fn check(&self, variants: usize) -> Result<(), String> {
        if self.of.len() != variants {
            return Err(format!("a baseline of {} variants, of {variants}", self.of.len()));
        }
        match self.of.iter().flatten().find(|k| **k as usize >= variants) {
            Some(k) => Err(format!("variant {k} is a baseline, and there are {variants} variants")),
            None => Ok(()),
        }
    }
}

/// The variants, and the requested baseline.
pub(super) struct BaselineMatcher<'a> {
    pub(super) wanted: &'a BaselineSpec,
    pub(super) variants: &'a [Variant],
    /// Keys that variants set, in the order of their columns.
    pub(super) parameters: &'a [String],
    pub(super) base: BaseScenario<'a>,
    pub(super) place: &'a str,
}

impl BaselineMatcher<'_> {
    /// Returns the baseline; `variant_name` and `setting_name` give the names of a variant and of a setting.
    ///
    /// # Errors
    /// When no variant is the baseline, or no other variant corresponds to one.
    pub(super) fn baseline(
        &self,
        variant_name: impl Fn(usize) -> String,
        setting_name: impl Fn(&Setting) -> String,
    ) -> Result<Option<Baseline>, InputError> {
        let BaselineSpec { name, settings } = self.wanted;
        if name.is_none() && settings.is_empty() {
            return Ok(None);
        }
        let defaults = self.defaults();
        let matching: Vec<bool> =
            self.variants.iter().map(|v| self.matches_spec(v, &defaults)).collect();
        let found: Vec<usize> = (0..matching.len()).filter(|&k| matching[k]).collect();
        match found[..] {
            [] => Err(self.no_match_error(&defaults)),
            [one] => {
                let of = (0..matching.len()).map(|k| (k != one).then_some(one as u32)).collect();
                Ok(Some(Baseline { name: variant_name(one), of, alone: 0 }))
            }
            _ => {
                let names = name.iter().cloned().chain(settings.iter().map(setting_name));
                let name = names.collect::<Vec<_>>().join(", ");
                self.paired_baseline(name, &matching, &defaults).map(Some)
            }
        }
    }

    /// Returns the baseline of which each variant has one of its own: that with the same values of
    /// all other keys.
    fn paired_baseline(
        &self,
        name: String,
        matching: &[bool],
        defaults: &Defaults,
    ) -> Result<Baseline, InputError> {
        let other_keys = self.unmatched_keys();
        let mut baselines: BTreeMap<Vec<String>, u32> = BTreeMap::new();
        for k in (0..matching.len()).filter(|&k| matching[k]) {
            // Samples of whole numbers may coincide; the first one is the baseline then.
            baselines.entry(self.values_of(k, &other_keys, defaults)).or_insert(k as u32);
        }
        let mut of = Vec::with_capacity(matching.len());
        let mut alone = 0;
        for (k, is_baseline) in matching.iter().enumerate() {
            if *is_baseline {
                of.push(None);
                continue;
            }
            let baseline = baselines.get(&self.values_of(k, &other_keys, defaults)).copied();
            alone += usize::from(baseline.is_none());
            of.push(baseline);
        }
        if of.iter().all(Option::is_none) {
            let cause = format!("no variant differs from the baseline `{name}` in that alone");
            let remedy = "give the value of every key that is varied, to compare with one variant";
            return Err(InputError::new(self.place, cause, remedy));
        }
        Ok(Baseline { name, of, alone })
    }

    /// Returns a variant's values of some keys, in a form in which equal numbers are equal.
    fn values_of(&self, variant: usize, keys: &[&String], defaults: &Defaults) -> Vec<String> {
        let values = keys.iter().map(|key| value_of(&self.variants[variant], key, defaults));
        values.map(|value| value.map_or_else(String::new, canonical)).collect()
    }

    /// Returns the keys to which the baseline gives no value; the name of a listed variant stands for
    /// all keys of the list.
    fn unmatched_keys(&self) -> Vec<&String> {
        let mut matched: BTreeSet<&str> = BTreeSet::new();
        if self.wanted.name.is_some() {
            for variant in self.variants {
                matched.extend(variant.settings[..variant.named].iter().map(|s| s.key.as_str()));
            }
        }
        matched.extend(self.wanted.settings.iter().map(|s| s.key.as_str()));
        self.parameters.iter().filter(|key| !matched.contains(key.as_str())).collect()
    }

    /// Returns the scenario's own values of the parameters.
    fn defaults(&self) -> Defaults {
        let mut defaults = Defaults::new();
        for key in self.parameters {
            if let Some(value) = self.base.source.value(key) {
                defaults.insert(key.clone(), value);
            }
        }
        defaults
    }

    fn matches_spec(&self, variant: &Variant, defaults: &Defaults) -> bool {
        let BaselineSpec { name, settings } = self.wanted;
        let has_name = name.is_none() || *name == variant.name;
        has_name && settings.iter().all(|setting| self.has_setting(variant, setting, defaults))
    }

    /// Returns whether the variant has this setting, or the scenario where the variant does not set the key.
    fn has_setting(
        &self,
        variant: &Variant,
        Setting { key, value }: &Setting,
        defaults: &Defaults,
    ) -> bool {
        if value.as_str() == Some(DEFAULT_LABEL) {
            return self.parameters.contains(key) && variant.value(key).is_none();
        }
        let own = value_of(variant, key, defaults);
        self.parameters.contains(key) && own.is_some_and(|own| canonical(own) == canonical(value))
    }

    /// Returns the error that names the setting that no variant has, and the existing ones instead.
    fn no_match_error(&self, defaults: &Defaults) -> InputError {
        let names: Vec<&str> = self.variants.iter().filter_map(|v| v.name.as_deref()).collect();
        if let Some(name) = &self.wanted.name
            && !names.contains(&name.as_str())
        {
            return self.unknown_name_error(name, &names);
        }
        for setting in &self.wanted.settings {
            if !self.variants.iter().any(|v| self.has_setting(v, setting, defaults)) {
                return self.unknown_setting_error(setting, defaults);
            }
        }
        let cause = "no variant has all of the baseline at once";
        InputError::new(self.place, cause, "give what one variant has")
    }

    fn unknown_name_error(&self, name: &str, names: &[&str]) -> InputError {
        let cause = format!("no variant has the name `{name}`");
        let remedy = if names.is_empty() {
            "give a value, e.g. regime=both, or give the variants of the sweep's file".to_string()
        } else {
            suggestion(name, names)
        };
        InputError::new(self.place, cause, remedy)
    }

    fn unknown_setting_error(
        &self,
        Setting { key, value }: &Setting,
        defaults: &Defaults,
    ) -> InputError {
        if self.parameters.contains(key) {
            let values = self.values(key, defaults).join(", ");
            let cause = format!("the baseline has `{key}` = {value}, which no variant has");
            return InputError::new(self.place, cause, format!("it is varied over {values}"));
        }
        let cause = format!("the baseline has `{key}`, which is not varied");
        let known: Vec<&str> = self.parameters.iter().map(String::as_str).collect();
        let remedy = if known.is_empty() {
            format!("vary it, e.g. --vary {key}={value},...")
        } else {
            suggestion(key, &known)
        };
        InputError::new(self.place, cause, remedy)
    }

    /// Returns the first values of a key, as an error lists them.
    fn values(&self, key: &str, defaults: &Defaults) -> Vec<String> {
        let mut values: Vec<String> = Vec::new();
        for variant in self.variants {
            let value = value_of(variant, key, defaults);
            let value = value.map_or_else(|| DEFAULT_LABEL.to_string(), Value::to_string);
            if !values.contains(&value) && values.len() < MAX_LISTED_VALUES {
                values.push(value);
            }
        }
        values
    }
}

/// The scenario's values of the keys that variants set.
type Defaults = BTreeMap<String, Value>;

fn value_of<'a>(variant: &'a Variant, key: &str, defaults: &'a Defaults) -> Option<&'a Value> {
    variant.value(key).or_else(|| defaults.get(key))
}

/// Returns a value as text, the same for 2 and 2.0.
fn canonical(value: &Value) -> String {
    match value {
        Value::Integer(n) => (*n as f64).to_string(),
        Value::Float(x) => x.to_string(),
        other => other.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sweep::{Plan, Sweep};
    use sidestep_scenario::Source;

    const SCENARIO: &str = "format = 1\nregime = \"both\"\n[robots]\ncount = 3\n";

    /// Returns the baseline's name and partners in the sweep that a file's end describes.
    fn baseline(file: &str) -> Result<(String, Vec<Option<u32>>), InputError> {
        let text = format!("format = 1\nscenario = \"s.toml\"\n{file}");
        let sweep = Sweep::parse(&Source::new("sweep.toml", text, ""))?;
        let variants = sweep.design.variants(&sweep.place)?;
        let source = Source::new("s.toml", SCENARIO, "");
        let plan =
            Plan::new(&sweep, variants, BaseScenario { world: "w", seed: 1, source: &source })?;
        plan.baseline.map(|b| (b.name, b.of)).ok_or_else(|| InputError::new("", "none", ""))
    }

    #[test]
    fn each_variant_is_compared_within_the_other_factors() {
        let grid = "[vary]\nm = [\"none\", \"mvp\", \"pc\"]\nn = [4, 8]\n";
        let (name, of) = baseline(&format!("baseline = {{ m = \"none\" }}\n{grid}")).expect("one");
        assert_eq!(name, "m=none");
        assert_eq!(of, [None, None, Some(0), Some(1), Some(0), Some(1)]);
        let (name, of) =
            baseline(&format!("baseline = {{ m = \"none\", n = 8.0 }}\n{grid}")).expect("one");
        assert_eq!((name.as_str(), of[0], of[1], of[4]), ("m=none, n=8", Some(1), None, Some(1)));
    }

    #[test]
    fn what_a_variant_does_not_set_it_has_from_the_scenario() {
        let list = "[[variant]]\nrobots.count = 9\n[[variant]]\nregime = \"sensors\"\n";
        let of = |b: &str| baseline(&format!("baseline = {b}\n{list}")).map(|(_, of)| of);
        assert_eq!(of("{ robots.count = 3 }"), Ok(vec![Some(1), None]));
        assert_eq!(of("{ regime = \"both\" }"), Ok(vec![None, Some(0)]));
        assert_eq!(of("{ regime = \"(default)\" }"), Ok(vec![None, Some(0)]));
        let error = of("{ robots.count = 4 }").expect_err("no such value");
        assert!(error.remedy().contains("varied over 9, 3"), "{error}");
    }

    #[test]
    fn a_named_variant_is_a_baseline_within_the_factors_beside_the_list() {
        let list = "[[variant]]\nname = \"plain\"\n[[variant]]\nname = \"many\"\nrobots.count = 9\n\
                    regime = \"sensors\"\n";
        let factor = "[vary]\nn = [1, 2]\n";
        let (name, of) = baseline(&format!("baseline = \"plain\"\n{list}{factor}")).expect("named");
        assert_eq!((name.as_str(), of), ("plain", vec![None, None, Some(0), Some(1)]));
        let error = baseline(&format!("baseline = \"plan\"\n{list}")).expect_err("misspelled");
        assert!(error.remedy().contains("did you mean `plain`"), "{error}");
    }

    #[test]
    fn a_baseline_without_a_counterpart_is_refused() {
        let list =
            "[[variant]]\na = 1\nb = 1\n[[variant]]\na = 1\nb = 2\n[[variant]]\na = 2\nb = 3\n";
        let error = baseline(&format!("baseline = {{ a = 1 }}\n{list}")).expect_err("alone");
        assert!(error.cause().contains("in that alone"), "{error}");
    }
}
