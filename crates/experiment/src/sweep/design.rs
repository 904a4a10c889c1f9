//! The variants of a scenario that a sweep runs.

use super::variant::{Setting, Variant, parse_value};
use sidestep_kernel::math::{exp, ln};
use sidestep_kernel::{InputError, Seed, stream::Purpose, stream::Streams};
use std::collections::BTreeSet;
use toml::Value;

/// Largest number of variants of a sweep: each is compiled and has a scenario of its own in the folder.
pub const MAX_VARIANTS: usize = 1_000_000;

/// The random stream of a hypercube's permutations and places.
const SAMPLE_STREAM: Purpose = Purpose(0);

/// A key and all values that it takes.
#[derive(Debug, Clone, PartialEq)]
pub struct Factor {
    /// Path of the key, e.g. `robots.count`.
    pub key: String,
    /// Its values, at least one.
    pub values: Vec<Value>,
}

impl Factor {
    /// Parses `robots.count=10,20,40` or `regime=both,sensors`. Values are TOML; anything else is
    /// text.
    ///
    /// # Errors
    /// When `=`, the key or all values are missing.
    pub fn parse(text: &str) -> Result<Self, InputError> {
        let place = format!("--vary {text}");
        let remedy = "write --vary key=value,value, e.g. --vary robots.count=10,20,40";
        let Some((key, values)) = text.split_once('=') else {
            return Err(InputError::new(place, "there is no `=`", remedy));
        };
        let key = key.trim();
        if key.is_empty() || key.split('.').any(str::is_empty) {
            return Err(InputError::new(place, "a part of the key is empty", remedy));
        }
        if values.trim().is_empty() {
            return Err(InputError::new(place, "there is no value", remedy));
        }
        Ok(Self { key: key.into(), values: parse_values(values) })
    }
}

impl Factor {
    /// In the order of the values; each variant sets this key alone.
    fn variants(&self) -> Vec<Variant> {
        let mut variants = Vec::with_capacity(self.values.len());
        for value in &self.values {
            variants.push(vec![Setting { key: self.key.clone(), value: value.clone() }].into());
        }
        variants
    }
}

/// Returns a list of TOML values, or otherwise of words separated by commas.
fn parse_values(text: &str) -> Vec<Value> {
    if let Ok(table) = format!("v = [{text}]").parse::<toml::Table>()
        && let Some(Value::Array(values)) = table.get("v")
    {
        return values.clone();
    }
    text.split(',').map(|word| parse_value(word.trim())).collect()
}

/// Latin hypercube sampling: of each range, every n-th part is used once (McKay, Beckman, Conover,
/// "A comparison of three methods for selecting values of input variables", 1979).
#[derive(Debug, Clone, PartialEq)]
pub struct LatinHypercube {
    /// Number of samples, at least 1.
    pub samples: usize,
    /// Random seed of places and pairings.
    pub seed: u64,
    /// The sides of the box, one for each key that is sampled.
    pub ranges: Vec<ParameterRange>,
}

/// A side of a hypercube.
#[derive(Debug, Clone, PartialEq)]
pub struct ParameterRange {
    /// Path of the key, e.g. `robots.count`.
    pub key: String,
    /// Its smallest value.
    pub low: f64,
    /// Its largest value; `low` < `high`.
    pub high: f64,
    /// Whether parts are equal in the logarithm; both ends must be above 0 then.
    pub is_log: bool,
    /// Whether the values are whole numbers, both ends included.
    pub is_integer: bool,
}

impl ParameterRange {
    /// Returns the value at `share` (0 included, 1 excluded) of the range from `low` to `high`.
    fn value_at(&self, share: f64) -> Value {
        let low = self.low;
        // Each whole number gets an equal part of the range.
        let high = if self.is_integer { self.high + 1.0 } else { self.high };
        let value = if self.is_log {
            exp(ln(low) + share * (ln(high) - ln(low)))
        } else {
            low + share * (high - low)
        };
        // Rounding must not leave the range.
        let value = value.clamp(self.low, self.high);
        if self.is_integer {
            Value::Integer(value.floor().clamp(self.low, self.high) as i64)
        } else {
            Value::Float(value)
        }
    }
}

impl LatinHypercube {
    /// Each sample sets the keys of all ranges.
    fn samples(&self) -> Vec<Variant> {
        let streams = Streams::new(Seed(self.seed));
        let mut settings: Vec<Vec<Setting>> = vec![Vec::new(); self.samples];
        for (side, range) in (0u32..).zip(&self.ranges) {
            for (sample, value) in settings.iter_mut().zip(self.side_values(&streams, side, range))
            {
                sample.push(Setting { key: range.key.clone(), value });
            }
        }
        settings.into_iter().map(Variant::from).collect()
    }

    /// Returns the value of one side in every sample.
    fn side_values(&self, streams: &Streams, side: u32, range: &ParameterRange) -> Vec<Value> {
        // A random permutation of the parts (Fisher and Yates). One stream per side and sample, because a stream has
        // 2^18 words and there may be more samples; even cycles permute, odd ones place.
        let mut parts: Vec<usize> = (0..self.samples).collect();
        for k in (1..self.samples).rev() {
            let mut draws = streams.draws(side, 2 * k as u64, SAMPLE_STREAM);
            parts.swap(k, draws.uniform_below(k as u32 + 1) as usize);
        }
        let mut values = Vec::with_capacity(self.samples);
        for (k, part) in parts.into_iter().enumerate() {
            let u = streams.draws(side, 2 * k as u64 + 1, SAMPLE_STREAM).uniform();
            values.push(range.value_at((part as f64 + u) / self.samples as f64));
        }
        values
    }
}

/// All variants of a sweep: every entry of the list (or sample of the hypercube) with every
/// combination of the factors' values. Without any of them, the scenario unchanged.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Design {
    /// Variants that are listed one by one; if empty, the scenario unchanged.
    pub list: Vec<Variant>,
    /// Samples of a hypercube, each combined with every entry of the list.
    pub hypercube: Option<LatinHypercube>,
    /// Keys that are varied independently; the last one changes first.
    pub factors: Vec<Factor>,
}

impl Design {
    /// Returns the number of variants, or `None` if it is too large for an integer.
    fn len(&self) -> Option<usize> {
        let samples = self.hypercube.as_ref().map_or(1, |h| h.samples);
        let start = self.list.len().max(1).checked_mul(samples)?;
        self.factors.iter().try_fold(start, |n, factor| n.checked_mul(factor.values.len()))
    }

    /// Returns the variants.
    ///
    /// # Errors
    /// When a key is set twice in a variant, or there are more than [`MAX_VARIANTS`].
    pub fn variants(&self, place: &str) -> Result<Vec<Variant>, InputError> {
        self.check_len(place)?;
        self.check_unique().map_err(|what| {
            let cause = format!("{what} is there twice");
            InputError::new(place, cause, "give every value once; --replicate runs it again")
        })?;
        let mut variants = self.list.clone();
        if variants.is_empty() {
            variants.push(Variant::default());
        }
        if let Some(hypercube) = &self.hypercube {
            variants = cross_product(variants, &hypercube.samples());
        }
        for factor in &self.factors {
            variants = cross_product(variants, &factor.variants());
        }
        for variant in &variants {
            check_keys(&variant.settings).map_err(|key| {
                let cause = format!("`{key}` is set twice in one variant");
                InputError::new(place, cause, "vary every key in one place")
            })?;
        }
        Ok(variants)
    }

    /// Checks the number of variants before any is made: a few factors of many values are more than fit into memory.
    fn check_len(&self, place: &str) -> Result<(), InputError> {
        let count = match self.len() {
            Some(1..=MAX_VARIANTS) => return Ok(()),
            Some(0) => {
                return Err(InputError::new(place, "a key has no values", "give at least one"));
            }
            Some(count) => count.to_string(),
            None => "too many".to_string(),
        };
        let cause = format!("there are {count} variants");
        Err(InputError::new(place, cause, "vary less: at most a million variants"))
    }
}

impl Design {
    /// Returns all keys that variants set, some of them more than once.
    pub(super) fn keys(&self) -> impl Iterator<Item = &str> {
        self.list.iter().flat_map(Variant::keys).chain(self.shared_keys())
    }

    /// Returns the keys that every variant sets, regardless of its entry in the list.
    fn shared_keys(&self) -> impl Iterator<Item = &str> {
        let ranges = self.hypercube.iter().flat_map(|h| &h.ranges).map(|r| &r.key);
        ranges.chain(self.factors.iter().map(|f| &f.key)).map(String::as_str)
    }

    /// Returns a key of this kind that variants set, if every variant sets one.
    pub(super) fn common_key(&self, is_such: impl Fn(&str) -> bool) -> Option<&str> {
        if let Some(key) = self.shared_keys().find(|key| is_such(key)) {
            return Some(key);
        }
        // Every variant has the settings of one entry of the list.
        let keys = self.list.iter().map(|entry| entry.keys().find(|key| is_such(key)));
        keys.collect::<Option<Vec<_>>>()?.first().copied()
    }

    /// Checks that nothing is requested twice. Samples of a hypercube may coincide, because whole
    /// numbers are few.
    fn check_unique(&self) -> Result<(), String> {
        let listed = self.list.iter().map(|variant| {
            let settings: Vec<String> = variant.settings.iter().map(Setting::to_override).collect();
            settings.join(", ")
        });
        if let Some(twice) = first_duplicate(listed) {
            return Err(format!("the variant `{twice}`"));
        }
        let names = self.list.iter().filter_map(|variant| variant.name.clone());
        if let Some(twice) = first_duplicate(names) {
            return Err(format!("a variant with the name `{twice}`"));
        }
        for Factor { key, values } in &self.factors {
            if let Some(twice) = first_duplicate(values.iter().map(Value::to_string)) {
                return Err(format!("`{key}` = {twice}"));
            }
        }
        Ok(())
    }
}

/// Returns the first word that was there before.
fn first_duplicate(mut words: impl Iterator<Item = String>) -> Option<String> {
    let mut seen = BTreeSet::new();
    words.find(|word| !seen.insert(word.clone()))
}

/// Returns every one of `firsts` with every one of `seconds`.
fn cross_product(firsts: Vec<Variant>, seconds: &[Variant]) -> Vec<Variant> {
    firsts.iter().flat_map(|a| seconds.iter().map(move |b| a.with_settings_of(b))).collect()
}

/// Checks that no key is set twice; the error is the first such key.
fn check_keys(variant: &[Setting]) -> Result<(), &str> {
    for (k, setting) in variant.iter().enumerate() {
        if variant[..k].iter().any(|earlier| earlier.key == setting.key) {
            return Err(&setting.key);
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use sidestep_kernel::math::log10;

    fn keys(design: &Design) -> Vec<String> {
        let variants = design.variants("test").expect("valid");
        let words = |v: &Variant| v.settings.iter().map(Setting::to_override).collect::<Vec<_>>();
        variants.iter().map(|v| words(v).join(" ")).collect()
    }

    fn factors(texts: &[&str]) -> Design {
        let factors = texts.iter().map(|t| Factor::parse(t).expect("valid")).collect();
        Design { factors, ..Design::default() }
    }

    #[test]
    fn a_grid_has_every_combination_and_the_last_key_changes_first() {
        let design = factors(&["a.n=1,2", "b=x,y"]);
        assert_eq!(
            keys(&design),
            ["a.n=1 b=\"x\"", "a.n=1 b=\"y\"", "a.n=2 b=\"x\"", "a.n=2 b=\"y\""]
        );
        assert_eq!(keys(&Design::default()), [""], "the scenario as it is");
    }

    #[test]
    fn values_are_toml_where_they_can_be_and_words_elsewhere() {
        let of = |text: &str| Factor::parse(text).expect(text).values;
        assert_eq!(of("a=1,2.5"), [Value::Integer(1), Value::Float(2.5)]);
        assert_eq!(of("a=both,3"), [Value::String("both".into()), Value::Integer(3)]);
        assert_eq!(of("a=[1, 2],[3]").len(), 2, "commas inside of brackets do not separate");
        assert_eq!(of("a=\"x,y\""), [Value::String("x,y".into())]);
        assert_eq!(of("a=true,off"), [Value::Boolean(true), Value::String("off".into())]);
        for bad in ["a", "=1", "a=", "a..b=1"] {
            assert!(Factor::parse(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn a_list_is_combined_with_a_grid() {
        let list = [("a", 1), ("a", 2)]
            .map(|(key, n)| vec![Setting { key: key.into(), value: Value::Integer(n) }].into());
        let design = Design { list: list.to_vec(), ..factors(&["b=3,4"]) };
        assert_eq!(keys(&design), ["a=1 b=3", "a=1 b=4", "a=2 b=3", "a=2 b=4"]);
    }

    #[test]
    fn a_hypercube_meets_every_part_of_every_side_once() {
        let range = |key: &str, is_log, is_integer| ParameterRange {
            key: key.into(),
            low: 1.0,
            high: 10.0,
            is_log,
            is_integer,
        };
        let n = 50;
        let ranges =
            vec![range("a", false, false), range("b", true, false), range("c", false, true)];
        let design = Design {
            hypercube: Some(LatinHypercube { samples: n, seed: 3, ranges }),
            ..Design::default()
        };
        let variants = design.variants("test").expect("valid");
        let column = |k: usize| variants.iter().map(move |v| &v.settings[k].value);
        let part = |x: f64| (x * n as f64) as usize;
        let mut a: Vec<_> =
            column(0).map(|v| part((v.as_float().expect("float") - 1.0) / 9.0)).collect();
        let mut b: Vec<_> = column(1).map(|v| part(log10(v.as_float().expect("float")))).collect();
        assert_ne!(a, b, "the sides are paired at random");
        a.sort_unstable();
        b.sort_unstable();
        let all: Vec<usize> = (0..n).collect();
        assert_eq!((a, b), (all.clone(), all));
        let counts = (1..=10).map(|n| column(2).filter(|v| v.as_integer() == Some(n)).count());
        assert_eq!(counts.collect::<Vec<_>>(), [5; 10], "whole numbers are equally frequent");
        assert_eq!(design.variants("test"), Ok(variants), "the same seed, the same samples");
    }

    #[test]
    fn what_is_asked_for_twice_is_refused() {
        let error = factors(&["m=none,pc,none"]).variants("here").expect_err("twice");
        assert!(error.cause().contains("`m` = \"none\" is there twice"), "{error}");
        let entry = || vec![Setting { key: "a".into(), value: Value::Integer(1) }].into();
        let design = Design { list: vec![entry(), entry()], ..Design::default() };
        assert!(design.variants("here").expect_err("twice").cause().contains("`a=1`"));
    }

    #[test]
    fn a_key_is_set_once_and_variants_are_not_without_number() {
        let error = factors(&["a=1", "a=2"]).variants("here").expect_err("twice");
        assert!(error.to_string().contains("`a` is set twice"), "{error}");
        let numbers: Vec<String> = (0..2000).map(|n| n.to_string()).collect();
        let wide = format!("a={}", numbers.join(","));
        let texts = [wide.clone(), wide.replace('a', "b")];
        let design = factors(&[&texts[0], &texts[1]]);
        assert!(design.variants("here").expect_err("many").cause().contains("4000000"));
    }
}
