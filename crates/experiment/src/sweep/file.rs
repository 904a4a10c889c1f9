//! A sweep file: the scenario, its variants, and the number of runs.

use super::baseline::BaselineSpec;
use super::design::{Design, Factor, LatinHypercube, ParameterRange};
use super::front::{Aim, Better};
use super::variant::{Setting, Variant};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sidestep_kernel::InputError;
use sidestep_scenario::{FORMAT, Source, Spanned, schema};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use toml::Value;

/// Default number of runs of each variant: enough for a first interval, and soon done.
const DEFAULT_REPLICATES: u32 = 10;
/// Default of the largest number of runs of each variant, if a precision ends them: one out of
/// reach would never.
pub const DEFAULT_MAX_RUNS: u32 = 1000;
/// Largest number of samples of a hypercube, and of runs of a variant: a sample is a variant, and a
/// sweep has no more of them.
const MAX_COUNT: u64 = 1_000_000;

/// The description of a sweep, as requested.
#[derive(Debug, Clone, PartialEq)]
pub struct Sweep {
    /// The name that errors give for its place.
    pub place: String,
    /// Its name; may be empty.
    pub name: String,
    /// The scenario's file; not read where [`Self::given`] has its text.
    pub scenario: PathBuf,
    /// The scenario itself, where it was read already and is no file.
    pub given: Option<Source>,
    /// Settings of every variant, applied before its own.
    pub fixed: Vec<Setting>,
    /// The variants to run; by default the scenario alone.
    pub design: Design,
    /// Largest number of runs of each variant; at least 1.
    pub replicates: u32,
    /// The seed of the first run, if it is not the scenario's.
    pub first_seed: Option<u64>,
    /// The precision at which a variant has had enough runs, if it is not run for all replicates.
    pub until: Option<Precision>,
    /// The metrics to report; all that vary if empty.
    pub metrics: Vec<String>,
    /// Metrics with the values that are better; the first two are shown with their front.
    pub better: Vec<Aim>,
    /// The variant that others are compared with; empty for no comparison.
    pub baseline: BaselineSpec,
    /// Whether every run is recorded in a folder of its own.
    pub record: bool,
    /// The metrics that runs keep over time; none for those that their world is about.
    pub series: Option<Vec<String>>,
}

/// Number of metrics that a front has.
const AIMS: usize = 2;

/// A requested precision: a variant is run until the 95 % confidence intervals of means are this
/// narrow.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Precision {
    /// Largest half width of the interval; above 0.
    pub half_width: f64,
    /// Whether the half width is a share of the mean.
    pub is_relative: bool,
    /// The metrics it applies to; all that vary if empty.
    pub metrics: Vec<String>,
}

impl Precision {
    /// Checks that the half width is one that an interval can have.
    pub(super) fn check(&self) -> Result<(), String> {
        if self.half_width > 0.0 && self.half_width.is_finite() {
            return Ok(());
        }
        Err(format!("a precision of {}", self.half_width))
    }
}

/// Parses `ci=0.05`, a share of the mean, or `abs=2.5`, in the metric's unit.
impl FromStr for Precision {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        parse_precision(text).ok_or_else(|| {
            format!("`{text}` is no precision: write ci=0.05 (of the mean) or abs=2.5 (in units)")
        })
    }
}

fn parse_precision(text: &str) -> Option<Precision> {
    let (kind, number) = text.split_once('=')?;
    let half_width: f64 = number.trim().parse().ok()?;
    let is_relative = match kind.trim() {
        "ci" => true,
        "abs" => false,
        _ => return None,
    };
    let precision = Precision { half_width, is_relative, metrics: Vec::new() };
    precision.check().is_ok().then_some(precision)
}

/// The keys of the file.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct SweepFile {
    /// Version of the file's format.
    format: Spanned<u32>,
    /// The scenario's file, relative to this one.
    scenario: PathBuf,
    /// Name of the sweep; the scenario's if it has none.
    #[serde(default)]
    name: String,
    /// Number of runs of each variant; 10 if neither this nor `until` is given.
    replicates: Option<Spanned<u64>>,
    /// Seed of the first run of each variant; the scenario's if it is not given.
    first_seed: Option<u64>,
    /// Keys of the scenario that are set in all variants.
    #[serde(default)]
    #[schemars(with = "AnyTable")]
    set: toml::Table,
    /// Keys of the scenario, each with a list of values: all combinations of them are variants.
    #[schemars(with = "Option<AnyTable>")]
    vary: Option<Spanned<toml::Table>>,
    /// Variants one by one: keys of the scenario with their values, and perhaps a `name`.
    #[serde(default)]
    #[schemars(with = "Vec<AnyTable>")]
    variant: Vec<Spanned<toml::Table>>,
    /// Variants as samples of a box of parameters.
    latin_hypercube: Option<Spanned<HypercubeSection>>,
    /// The precision at which a variant has had enough runs; instead of `replicates`.
    until: Option<Spanned<UntilSection>>,
    /// Metrics to report; all that vary if none is named.
    #[serde(default)]
    metrics: Vec<String>,
    /// Which values of two metrics are better, `low` or `high`: a figure shows the front of the variants, those that
    /// no other one beats in both.
    #[serde(default)]
    #[schemars(with = "AnyTable")]
    better: Option<Spanned<toml::Table>>,
    /// The variant that others are compared with: values of keys, or its name.
    #[schemars(with = "Option<BaselineValue>")]
    baseline: Option<Spanned<Value>>,
    /// Whether every run is recorded in a folder of its own.
    #[serde(default)]
    record: bool,
    /// Metrics that runs keep over time, for bands over their seeds; those that the world is about if it is not given,
    /// none for an empty list.
    series: Option<Vec<String>>,
}

/// A table of keys of a scenario, dotted or nested.
type AnyTable = serde_json::Map<String, serde_json::Value>;

/// Values of keys, or the name of a variant.
#[derive(JsonSchema)]
#[serde(untagged)]
#[expect(dead_code, reason = "only its schema is of interest")]
enum BaselineValue {
    Name(String),
    Values(AnyTable),
}

#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct HypercubeSection {
    /// Number of samples, and so of variants.
    samples: Spanned<u64>,
    /// Seed of the places; not that of runs.
    #[serde(default)]
    seed: u64,
    /// Keys of the scenario, each with `low` and `high`, and perhaps `log = true` or `integer = true`.
    #[schemars(with = "AnyTable")]
    range: Spanned<toml::Table>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct RangeSection {
    low: f64,
    high: f64,
    #[serde(default)]
    log: bool,
    #[serde(default)]
    integer: bool,
}

#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct UntilSection {
    /// Half width of the 95 % interval of each mean, as a share of the mean.
    ci: Option<f64>,
    /// The same in the metric's unit, instead.
    abs: Option<f64>,
    /// Metrics of which the means are to be so precise; all that vary if none is named.
    #[serde(default)]
    metrics: Vec<String>,
    /// Largest number of runs of each variant; 1000 if it is not given.
    max_runs: Option<u64>,
}

/// Returns the JSON Schema of a sweep file, by which editors complete and check it.
pub fn schema() -> serde_json::Value {
    let mut keys = schema::for_type::<SweepFile>();
    keys["properties"]["format"]["const"] = FORMAT.into();
    schema::for_file("A sweep: many variants of a scenario", keys, "")
}

/// Keys that no scenario has.
const SWEEP_KEYS: [&str; 6] =
    ["replicates", "vary", "variant", "latin_hypercube", "until", "baseline"];

impl Sweep {
    /// Returns a sweep of the unchanged scenario, with ten runs.
    pub fn from_scenario(scenario: impl Into<PathBuf>) -> Self {
        let scenario = scenario.into();
        Self {
            place: scenario.display().to_string(),
            name: String::new(),
            scenario,
            given: None,
            fixed: Vec::new(),
            design: Design::default(),
            replicates: DEFAULT_REPLICATES,
            first_seed: None,
            until: None,
            metrics: Vec::new(),
            better: Vec::new(),
            baseline: BaselineSpec::default(),
            record: false,
            series: None,
        }
    }

    /// Returns a sweep like [`Sweep::from_scenario`] of a scenario that was read already.
    pub fn from_source(source: Source) -> Self {
        let place = source.place.clone();
        Self { given: Some(source), ..Self::from_scenario(place) }
    }

    /// Reads a sweep file; a scenario file stands for [`Sweep::from_scenario`]. The key `scenario`
    /// distinguishes the two.
    ///
    /// # Errors
    /// When the file cannot be read, or anything in it is wrong.
    pub fn read(path: &Path) -> Result<Self, InputError> {
        let is_toml = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("toml"));
        if !is_toml {
            return Ok(Self::from_scenario(path));
        }
        let source = Source::read(path, &[])?;
        let table: toml::Table = source.parse()?;
        // A file with a misspelled `scenario` gets a better error from the reader of sweeps.
        let has_sweep_key = SWEEP_KEYS.iter().any(|key| table.contains_key(*key));
        if table.contains_key("scenario") || (!table.contains_key("world") && has_sweep_key) {
            Self::parse(&source)
        } else {
            Ok(Self::from_scenario(path))
        }
    }

    /// Reads a sweep from the text of a sweep file.
    ///
    /// # Errors
    /// When anything in it is wrong.
    pub fn parse(source: &Source) -> Result<Self, InputError> {
        let file: SweepFile = source.parse()?;
        if *file.format.get_ref() != FORMAT {
            let cause = format!("sweep format {} is not known", file.format.get_ref());
            let remedy = format!("write `format = {FORMAT}`");
            return Err(source.error(Some(file.format.span()), cause, remedy));
        }
        let reader = SweepReader { source };
        let until = file.until.as_ref().map(|section| reader.precision(section)).transpose()?;
        let replicates = reader.replicates(&file)?;
        let design = reader.design(&file)?;
        let baseline = match &file.baseline {
            Some(baseline) => reader.baseline(baseline)?,
            None => BaselineSpec::default(),
        };
        let better = match &file.better {
            Some(table) => reader.aims(table)?,
            None => Vec::new(),
        };
        Ok(Self {
            place: source.place.clone(),
            scenario: source.path(&file.scenario),
            given: None,
            fixed: settings(&file.set),
            design,
            replicates,
            first_seed: file.first_seed,
            until,
            metrics: file.metrics,
            better,
            baseline,
            name: file.name,
            record: file.record,
            series: file.series,
        })
    }

    /// Checks for keys that a sweep cannot vary.
    ///
    /// # Errors
    /// When seeds are varied as if they were a parameter.
    pub fn check(&self) -> Result<(), InputError> {
        let mut keys = self.design.keys().chain(self.fixed.iter().map(|s| s.key.as_str()));
        if keys.any(|key| key == "seed") {
            let cause = "`seed` is set: each variant is run with the same seeds";
            let remedy = "give `replicates` and `first_seed` instead";
            return Err(InputError::new(&self.place, cause, remedy));
        }
        Ok(())
    }
}

/// Returns nested tables as dotted keys.
fn settings(table: &toml::Table) -> Vec<Setting> {
    leaves(table, &|_| false).into_iter().map(|(key, value)| Setting { key, value }).collect()
}

/// Returns all values below a table with dotted keys; tables for which `is_leaf` holds are values.
fn leaves(table: &toml::Table, is_leaf: &impl Fn(&toml::Table) -> bool) -> Vec<(String, Value)> {
    let mut found = Vec::new();
    for (key, value) in table {
        match value {
            Value::Table(inner) if !is_leaf(inner) => {
                let inner = leaves(inner, is_leaf).into_iter();
                found.extend(inner.map(|(rest, value)| (format!("{key}.{rest}"), value)));
            }
            value => found.push((key.clone(), value.clone())),
        }
    }
    found
}

/// Returns whether a table is the range of a key; a key that ends in `.low` would be a table there.
fn is_range(table: &toml::Table) -> bool {
    table.contains_key("low") && !table["low"].is_table()
}

struct SweepReader<'a> {
    source: &'a Source,
}

impl SweepReader<'_> {
    fn design(&self, file: &SweepFile) -> Result<Design, InputError> {
        let listed = file.variant.iter().map(|table| self.listed_variant(table));
        let list = listed.collect::<Result<_, _>>()?;
        let hypercube = file.latin_hypercube.as_ref().map(|section| self.hypercube(section));
        let hypercube = hypercube.transpose()?;
        let factors = match &file.vary {
            Some(table) => self.factors(table)?,
            None => Vec::new(),
        };
        Ok(Design { list, hypercube, factors })
    }

    /// Returns how often each variant is run, at most.
    fn replicates(&self, file: &SweepFile) -> Result<u32, InputError> {
        match (&file.replicates, &file.until) {
            (Some(n), Some(_)) => {
                let cause = "`replicates` and `until` both say how often to run";
                let remedy = "leave `replicates` out; `until.max_runs` is the limit";
                Err(self.source.error(Some(n.span()), cause, remedy))
            }
            (Some(n), None) => self.count(*n.get_ref(), n.span(), "replicates"),
            (None, Some(until)) => {
                let max = until.get_ref().max_runs.unwrap_or(DEFAULT_MAX_RUNS.into());
                self.count(max, until.span(), "max_runs")
            }
            (None, None) => Ok(DEFAULT_REPLICATES),
        }
    }

    fn factors(&self, table: &Spanned<toml::Table>) -> Result<Vec<Factor>, InputError> {
        let mut factors = Vec::new();
        for (key, value) in leaves(table.get_ref(), &|_| false) {
            match value {
                Value::Array(values) if !values.is_empty() => factors.push(Factor { key, values }),
                _ => {
                    let cause = format!("`{key}` has no list of values");
                    let remedy = "give a list, e.g. robots.count = [10, 20]; what does not vary \
                                  belongs under [set]";
                    return Err(self.source.error(Some(table.span()), cause, remedy));
                }
            }
        }
        Ok(factors)
    }

    /// Returns an entry of the list; its `name` is no setting.
    fn listed_variant(&self, table: &Spanned<toml::Table>) -> Result<Variant, InputError> {
        let mut own = table.get_ref().clone();
        if own.contains_key("set") {
            let cause = "a variant has its keys directly, without `set`";
            let remedy = "write robots.count = 20 in it, or in [set] for all variants";
            return Err(self.source.error(Some(table.span()), cause, remedy));
        }
        match own.remove("name") {
            None => Ok(settings(&own).into()),
            Some(Value::String(name)) if !name.is_empty() => {
                Ok(Variant::with_name(name, settings(&own)))
            }
            Some(name) => {
                let cause = format!("`name` = {name} is no name of a variant");
                Err(self.source.error(Some(table.span()), cause, "give a word, in quotes"))
            }
        }
    }

    /// Returns which values of metrics are better.
    fn aims(&self, table: &Spanned<toml::Table>) -> Result<Vec<Aim>, InputError> {
        let wrong = |cause: &str| {
            let remedy =
                "name two metrics: better = { mean_delay_percent = \"low\", trips = \"high\" }";
            self.source.error(Some(table.span()), cause, remedy)
        };
        let mut aims = Vec::new();
        for (metric, value) in leaves(table.get_ref(), &|_| false) {
            let better = match value.as_str() {
                Some("low") => Better::Low,
                Some("high") => Better::High,
                _ => return Err(wrong("better values of a metric are `low` or `high` ones")),
            };
            aims.push(Aim { metric, better });
        }
        if aims.len() != AIMS {
            return Err(wrong("a front is that of two metrics"));
        }
        Ok(aims)
    }

    /// Returns the baseline: a table of settings, or the name of a variant.
    fn baseline(&self, value: &Spanned<Value>) -> Result<BaselineSpec, InputError> {
        match value.get_ref() {
            Value::String(name) => {
                Ok(BaselineSpec { name: Some(name.clone()), settings: Vec::new() })
            }
            Value::Table(table) => Ok(BaselineSpec { name: None, settings: settings(table) }),
            _ => {
                let remedy = "give the values of one or several keys, { regime = \"both\" }, or the \
                              name of a variant, in quotes";
                Err(self.source.error(Some(value.span()), "this is no baseline", remedy))
            }
        }
    }

    fn hypercube(&self, section: &Spanned<HypercubeSection>) -> Result<LatinHypercube, InputError> {
        let HypercubeSection { samples, seed, range } = section.get_ref();
        let found = leaves(range.get_ref(), &is_range);
        if found.is_empty() {
            let remedy = "give e.g. a.b = { low = 1, high = 5 }";
            return Err(self.source.error(Some(range.span()), "no key has a range", remedy));
        }
        let mut ranges = Vec::new();
        for (key, value) in found {
            ranges.push(self.parameter_range(range.span(), key, value)?);
        }
        let samples = self.count(*samples.get_ref(), samples.span(), "samples")? as usize;
        Ok(LatinHypercube { samples, seed: *seed, ranges })
    }

    fn parameter_range(
        &self,
        span: Range<usize>,
        key: String,
        value: Value,
    ) -> Result<ParameterRange, InputError> {
        let section: RangeSection = match value.try_into() {
            Ok(section) => section,
            Err(e) => {
                let cause = format!("the range of `{key}`: {}", e.message());
                let remedy = "give { low = 1, high = 5 }, with log = true or integer = true";
                return Err(self.source.error(Some(span), cause, remedy));
            }
        };
        let RangeSection { low, high, log: is_log, integer: is_integer } = section;
        let is_ordered = low < high && low.is_finite() && high.is_finite();
        if !is_ordered || (is_log && low <= 0.0) {
            let cause = format!("the range of `{key}` is {low} to {high}");
            let remedy = "low is below high, and above 0 where log = true";
            return Err(self.source.error(Some(span), cause, remedy));
        }
        if is_integer && (low.fract() != 0.0 || high.fract() != 0.0) {
            let cause = format!("the range of `{key}` is {low} to {high}, with integer = true");
            let remedy = "give whole numbers; both ends are included";
            return Err(self.source.error(Some(span), cause, remedy));
        }
        Ok(ParameterRange { key, low, high, is_log, is_integer })
    }

    fn precision(&self, section: &Spanned<UntilSection>) -> Result<Precision, InputError> {
        let UntilSection { ci, abs, metrics, .. } = section.get_ref();
        let (half_width, is_relative) = match (ci, abs) {
            (Some(ci), None) => (*ci, true),
            (None, Some(abs)) => (*abs, false),
            _ => {
                let remedy = "give either ci = 0.05 (of the mean) or abs = 2.5 (in its unit)";
                return Err(self.source.error(Some(section.span()), "no single precision", remedy));
            }
        };
        let precision = Precision { half_width, is_relative, metrics: metrics.clone() };
        precision.check().map_err(|cause| {
            self.source.error(Some(section.span()), cause, "give a number above 0")
        })?;
        Ok(precision)
    }

    fn count(&self, n: u64, span: Range<usize>, key: &str) -> Result<u32, InputError> {
        match n {
            1..=MAX_COUNT => Ok(n as u32),
            _ => {
                let cause = format!("{key} = {n}");
                Err(self.source.error(Some(span), cause, format!("give 1 to {MAX_COUNT}")))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FILE: &str = r#"
format = 1
scenario = "s.toml"
name = "methods"
metrics = ["losses_of_separation"]
baseline = { airspace.method = "none" }

[set]
airspace.shield = "off"

[vary]
airspace.generator.n = [2, 4]
airspace.method = ["none", "pc"]

[until]
ci = 0.05
max_runs = 200
"#;

    #[test]
    fn the_schema_knows_the_keys_of_a_sweep_and_no_others() {
        let schema = schema();
        let table: toml::Table = FILE.parse().expect("TOML");
        let keys = schema["properties"].as_object().expect("keys");
        assert!(table.keys().all(|key| keys.contains_key(key)), "{schema:#}");
        assert!(keys.values().all(|key| key["description"].is_string()), "{schema:#}");
        assert_eq!(schema["additionalProperties"], false);
        assert_eq!(schema["required"], serde_json::json!(["format", "scenario"]));
        let until = &schema["$defs"]["UntilSection"]["properties"];
        assert_eq!(
            (&until["ci"]["type"], &until["cu"]),
            (&"number".into(), &serde_json::Value::Null)
        );
    }

    fn parse(text: &str) -> Result<Sweep, InputError> {
        Sweep::parse(&Source::new("sweep.toml", text, "dir"))
    }

    #[test]
    fn a_sweep_file_says_what_to_vary_and_how_often() {
        let sweep = parse(FILE).expect("valid");
        assert_eq!(sweep.scenario, Path::new("dir/s.toml"));
        assert_eq!(sweep.fixed[0].to_override(), "airspace.shield=\"off\"");
        let keys: Vec<&str> = sweep.design.factors.iter().map(|f| f.key.as_str()).collect();
        assert_eq!(keys, ["airspace.generator.n", "airspace.method"]);
        assert_eq!((sweep.replicates, sweep.until.map(|u| u.half_width)), (200, Some(0.05)));
        assert_eq!(sweep.baseline.settings[0].key, "airspace.method");
    }

    #[test]
    fn ranges_of_a_hypercube_are_found_below_dotted_keys() {
        let text = "format = 1\nscenario = \"s.toml\"\n[latin_hypercube]\nsamples = 5\n\
                    [latin_hypercube.range]\na.b = { low = 1, high = 2 }\n\
                    c = { low = 1, high = 100, log = true, integer = true }\n";
        let hypercube = parse(text).expect("valid").design.hypercube.expect("there");
        let told: Vec<_> = hypercube.ranges.iter().map(|r| (r.key.as_str(), r.is_log)).collect();
        assert_eq!((hypercube.samples, told), (5, vec![("a.b", false), ("c", true)]));
    }

    #[test]
    fn what_is_wrong_is_told_with_its_place() {
        let head = "format = 1\nscenario = \"s.toml\"\n";
        for (text, cause) in [
            ("replicates = 0\n", "replicates = 0"),
            ("replicates = 5\n[until]\nci = 0.1\n", "both say how often"),
            ("[until]\nci = 0.1\nabs = 1.0\n", "no single precision"),
            ("[until]\nci = -1.0\n", "a precision of -1"),
            ("[vary]\nseeds = 3\n", "`seeds` has no list"),
            ("[latin_hypercube]\nsamples = 3\nrange = {}\n", "no key has a range"),
            ("[latin_hypercube]\nsamples = 3\nrange.a = { low = 2, high = 1 }\n", "2 to 1"),
            (
                "[latin_hypercube]\nsamples = 3\nrange.a = { low = 0, high = 1, log = true }\n",
                "0 to 1",
            ),
            ("repliactes = 3\n", "unknown key `repliactes`"),
            ("[[variant]]\nname = \"a\"\nset = { b = 3 }\n", "without `set`"),
        ] {
            let error = parse(&format!("{head}{text}")).expect_err(text);
            assert!(error.cause().contains(cause), "{error}");
            assert!(error.line_and_column().is_some(), "{error}");
        }
    }

    #[test]
    fn seeds_are_no_parameter() {
        let mut sweep = Sweep::from_scenario("s.toml");
        sweep.design.factors.push(Factor::parse("seed=1,2").expect("valid"));
        assert!(sweep.check().expect_err("refused").remedy().contains("first_seed"));
    }

    #[test]
    fn precisions_are_written_as_shares_or_in_units() {
        assert_eq!(
            "ci=0.05".parse::<Precision>().map(|u| (u.half_width, u.is_relative)),
            Ok((0.05, true))
        );
        assert_eq!(
            "abs=2".parse::<Precision>().map(|u| (u.half_width, u.is_relative)),
            Ok((2.0, false))
        );
        for bad in ["ci", "ci=0", "ci=x", "sd=1", "abs=inf"] {
            assert!(bad.parse::<Precision>().is_err(), "{bad}");
        }
    }
}
