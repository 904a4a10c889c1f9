//! A scenario and its variants: settings, and perhaps a name.

use serde::{Deserialize, Serialize};
use sidestep_kernel::InputError;
use sidestep_scenario::{SeedEffect, Source};
use std::fmt;
use toml::Value;

/// The value of a key that a variant does not set, as tables write it.
pub(super) const DEFAULT_LABEL: &str = "(default)";

/// The scenario of which variants are run, before their settings.
#[derive(Debug, Clone, Copy)]
pub struct BaseScenario<'a> {
    /// Name of the world that reads the scenario.
    pub world: &'a str,
    /// Its seed, that of replicate 0 unless the sweep gives another.
    pub seed: u64,
    /// Its text, with the settings that all variants share.
    pub source: &'a Source,
}

/// A key of the scenario, and the value that it is set to.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Setting {
    /// Path of the key, e.g. `robots.count`.
    pub key: String,
    /// Its value; of any type that TOML has.
    pub value: Value,
}

impl Setting {
    /// Parses `key=value`, where the value is TOML, or otherwise text.
    ///
    /// # Errors
    /// When `=` or the key is missing.
    pub fn parse(text: &str) -> Result<Self, InputError> {
        let remedy = "write key=value, e.g. robots.count=20";
        let Some((key, value)) = text.split_once('=') else {
            return Err(InputError::new(text, "there is no `=`", remedy));
        };
        let key = key.trim();
        if key.split('.').any(str::is_empty) {
            return Err(InputError::new(text, "a part of the key is empty", remedy));
        }
        Ok(Self { key: key.into(), value: parse_value(value.trim()) })
    }

    /// Returns the setting as an override of a scenario, see
    /// [`Source::with_overrides`](sidestep_scenario::Source::with_overrides).
    pub fn to_override(&self) -> String {
        format!("{}={}", self.key, self.value)
    }
}

/// Returns a TOML value, or otherwise a word.
pub(super) fn parse_value(word: &str) -> Value {
    let table = format!("v = {word}").parse::<toml::Table>().unwrap_or_default();
    // A word with a line break could hold a second key.
    let only_value = if table.len() == 1 { table.get("v").cloned() } else { None };
    only_value.unwrap_or_else(|| Value::String(word.into()))
}

/// One variant of the scenario.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Variant {
    /// Its name, if the sweep file gives one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// Number of the first settings that the name stands for; 0 without a name.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub named: usize,
    /// The effect of another seed on its runs.
    #[serde(default)]
    pub seeds: SeedEffect,
    /// What somebody in it knows that no agent could, see
    /// [`CompiledScenario::privilege`](sidestep_scenario::CompiledScenario::privilege).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub privilege: Option<String>,
    /// Its settings, beside those that all variants share.
    pub settings: Vec<Setting>,
}

fn is_zero(n: &usize) -> bool {
    *n == 0
}

impl From<Vec<Setting>> for Variant {
    fn from(settings: Vec<Setting>) -> Self {
        Self { settings, ..Self::default() }
    }
}

impl Variant {
    /// Returns a variant with a name that stands for all of `settings` in tables; settings added
    /// later are listed beside it.
    pub fn with_name(name: impl Into<String>, settings: Vec<Setting>) -> Self {
        Self { name: Some(name.into()), named: settings.len(), ..settings.into() }
    }

    /// Checks that it sets nothing but these parameters, and has the settings that its name stands for.
    pub(super) fn check(&self, parameters: &[String]) -> Result<(), String> {
        let Self { named, settings, .. } = self;
        if let Some(Setting { key, .. }) = settings.iter().find(|s| !parameters.contains(&s.key)) {
            return Err(format!("a variant sets `{key}`, which is no parameter of the plan"));
        }
        if *named > settings.len() {
            return Err(format!("a name stands for {named} of {} settings", settings.len()));
        }
        Ok(())
    }

    pub(super) fn keys(&self) -> impl Iterator<Item = &str> {
        self.settings.iter().map(|setting| setting.key.as_str())
    }

    /// Returns the value of a parameter, if this variant sets it.
    pub fn value(&self, key: &str) -> Option<&Value> {
        self.settings.iter().find(|s| s.key == key).map(|s| &s.value)
    }

    /// Returns the variant with further settings, which its name does not stand for.
    pub(super) fn with_settings_of(&self, more: &Self) -> Self {
        let settings = [self.settings.clone(), more.settings.clone()].concat();
        Self { settings, ..self.clone() }
    }

    /// Returns its name and the settings beside it, each written by `setting_name`.
    pub(super) fn label(&self, setting_name: impl Fn(&Setting) -> String) -> String {
        let settings = self.settings[self.named..].iter().map(setting_name);
        self.name.iter().cloned().chain(settings).collect::<Vec<_>>().join(", ")
    }
}

/// Writes the name and the settings as text: `robots.count = 10, regime = "both"`.
impl fmt::Display for Variant {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let label = self.label(|Setting { key, value }| format!("{key} = {value}"));
        f.write_str(if label.is_empty() { "the scenario as it is" } else { &label })
    }
}
