//! The trials of a sweep, and their shares.

use super::baseline::{Baseline, BaselineMatcher};
use super::file::{Precision, Sweep};
use super::front::Aim;
use super::variant::{BaseScenario, Setting, Variant};
use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use sidestep_kernel::InputError;
use sidestep_scenario::SeedEffect;
use std::collections::BTreeMap;
use std::fmt;
use std::str::FromStr;

/// All runs of a sweep: variants times replicates.
///
/// A trial has the number `variant * replicates + replicate`, so rows sorted by trial are sorted by
/// variant. Trials are run replicate by replicate, so that the first results are a small complete
/// experiment.
///
/// A plan that is read back is checked ([`Plan::check`]): all other code may trust it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(remote = "Self")]
pub struct Plan {
    /// Name of the sweep; may be empty.
    pub name: String,
    /// Name of the world, in whose words a summary speaks of metrics.
    pub world: String,
    /// Keys that differ between variants, in the order of their columns.
    pub parameters: Vec<String>,
    /// The variants; trials refer to them by index.
    pub variants: Vec<Variant>,
    /// Largest number of runs of each variant.
    pub replicates: u32,
    /// The seed of replicate 0; replicate `k` has this plus `k`.
    pub first_seed: u64,
    /// The precision at which a variant has had enough runs, if it is not run for all replicates.
    pub until: Option<Precision>,
    /// The metrics to report; all that vary if empty.
    pub metrics: Vec<String>,
    /// Two metrics with the values that are better, or none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub better: Vec<Aim>,
    /// The baseline that the variants are compared with.
    pub baseline: Option<Baseline>,
    /// Number of agents of the largest variant.
    pub agents: u64,
    /// Whether every run is recorded in a folder of its own.
    pub record: bool,
    /// The metrics that its runs keep over time; none for those that their world is about.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub series: Option<Vec<String>>,
}

/// Largest number of runs of a sweep: joining a table of ten million takes some gigabytes.
const MAX_SWEEP_RUNS: u64 = 10_000_000;

/// The largest number of runs of a sweep whose metrics over time are kept: some 3 KB each, as much as all else of a run,
/// and means over so many runs need no more.
const MAX_SERIES_RUNS: u64 = 20_000;

/// The end of the name of a variant in which somebody knows what no agent could.
pub const PRIVILEGE_MARK: &str = " *";
/// Most variants that the note on privileged ones lists by name.
const MAX_PRIVILEGED_NAMES: usize = 6;

impl Serialize for Plan {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        Self::serialize(self, to)
    }
}

impl<'de> Deserialize<'de> for Plan {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        let plan = Self::deserialize(from)?;
        plan.check().map_err(D::Error::custom)?;
        Ok(plan)
    }
}

/// The unit of work: a variant with a seed. Files and `--json` call it `cell`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Trial {
    /// Its number, as [`Plan`] counts trials.
    pub id: u64,
    /// Index of its variant in [`Plan::variants`].
    pub variant: u32,
    /// Number of the run among those of its variant.
    pub replicate: u32,
    /// The seed, the same for equal replicates of all variants.
    pub seed: u64,
}

impl Plan {
    /// Returns a plan of these variants, which are known to be valid.
    ///
    /// # Errors
    /// When seeds overflow, or the baseline is no variant.
    pub fn new(
        sweep: &Sweep,
        variants: Vec<Variant>,
        base: BaseScenario<'_>,
    ) -> Result<Self, InputError> {
        let mut parameters: Vec<String> = Vec::new();
        for setting in variants.iter().flat_map(|v| &v.settings) {
            if !parameters.contains(&setting.key) {
                parameters.push(setting.key.clone());
            }
        }
        let first_seed = sweep.first_seed.unwrap_or(base.seed);
        check_seeds(first_seed, sweep.replicates.into())
            .map_err(|cause| InputError::new(&sweep.place, cause, "begin with a smaller seed"))?;
        let mut plan = Self {
            name: sweep.name.clone(),
            world: base.world.into(),
            parameters,
            variants,
            replicates: sweep.replicates,
            first_seed,
            until: sweep.until.clone(),
            metrics: sweep.metrics.clone(),
            better: sweep.better.clone(),
            baseline: None,
            agents: 0,
            record: sweep.record,
            series: sweep.series.clone(),
        };
        plan.baseline = plan.baseline_of(sweep, base)?;
        Ok(plan)
    }

    /// Returns whether metrics over time of its runs are kept.
    pub fn keeps_series(&self) -> bool {
        self.runs() <= MAX_SERIES_RUNS
    }

    /// Returns the baseline that is asked for, among the plan's variants.
    fn baseline_of(
        &self,
        sweep: &Sweep,
        base: BaseScenario<'_>,
    ) -> Result<Option<Baseline>, InputError> {
        let matcher = BaselineMatcher {
            wanted: &sweep.baseline,
            variants: &self.variants,
            parameters: &self.parameters,
            base,
            place: &sweep.place,
        };
        matcher.baseline(|k| self.names().swap_remove(k), |setting| self.short_setting(setting))
    }

    /// Checks that the parts of the plan fit together, as they do in every plan that [`Plan::new`] makes.
    ///
    /// # Errors
    /// The cause, in words.
    pub fn check(&self) -> Result<(), String> {
        let variants = self.variants.len();
        let replicates = u64::from(self.replicates);
        if variants == 0 || replicates == 0 {
            return Err(format!("a plan of {variants} variants with {replicates} runs each"));
        }
        if (variants as u64).checked_mul(replicates).is_none_or(|runs| runs > MAX_SWEEP_RUNS) {
            return Err(format!("{variants} variants with {replicates} runs each are too many"));
        }
        check_seeds(self.first_seed, replicates)?;
        self.until.iter().try_for_each(Precision::check)?;
        self.variants.iter().try_for_each(|variant| variant.check(&self.parameters))?;
        self.baseline.iter().try_for_each(|baseline| baseline.check(variants))
    }

    /// Returns the names of the variants in tables and figures: their parameters, in short
    /// (`method=pc, n=8`).
    pub fn names(&self) -> Vec<String> {
        let mut names: Vec<String> =
            self.variants.iter().map(|v| v.label(|s| self.short_setting(s))).collect();
        let unchanged = if names.len() == 1 { "all runs" } else { "as in the scenario" };
        for name in names.iter_mut().filter(|name| name.is_empty()) {
            *name = unchanged.into();
        }
        number_duplicates(&mut names);
        // Where all are, there is nothing to tell apart.
        let has_equals = self.variants.iter().any(|variant| variant.privilege.is_none());
        for (name, variant) in names.iter_mut().zip(&self.variants) {
            if has_equals && variant.privilege.is_some() {
                name.push_str(PRIVILEGE_MARK);
            }
        }
        names
    }

    /// Returns the note that explains the mark of variants in which somebody knows what no agent could; none without any.
    pub fn privilege_note(&self) -> Option<String> {
        let privileged: Vec<&Variant> =
            self.variants.iter().filter(|variant| variant.privilege.is_some()).collect();
        let mut reasons: Vec<&str> =
            privileged.iter().filter_map(|variant| variant.privilege.as_deref()).collect();
        reasons.sort_unstable();
        reasons.dedup();
        let reasons = reasons.join("; ");
        if privileged.is_empty() {
            return None;
        }
        let which = if privileged.len() == self.variants.len() {
            "All variants are".into()
        } else {
            // In figures by parameter no name of a variant is seen.
            let names = self.names().into_iter().zip(&self.variants);
            let marked = names.filter(|(_, variant)| variant.privilege.is_some());
            let names: Vec<String> =
                marked.map(|(name, _)| name).take(MAX_PRIVILEGED_NAMES).collect();
            let more = if privileged.len() > names.len() { ", and others" } else { "" };
            format!("Variants with * ({}{more}) are", names.join("; "))
        };
        Some(format!("{which} privileged, a bound rather than an equal of others: {reasons}."))
    }

    /// Returns a setting in short, `method=pc`: with the whole path of its key only where another
    /// parameter ends like it.
    fn short_setting(&self, Setting { key, value }: &Setting) -> String {
        let end = last_part(key);
        let with_same_end = self.parameters.iter().filter(|other| last_part(other) == end).count();
        let key = if with_same_end > 1 { key.as_str() } else { end };
        let value = value.as_str().map_or_else(|| value.to_string(), str::to_string);
        format!("{key}={value}")
    }

    /// Checks that there are not too many runs for the memory of a machine.
    ///
    /// # Errors
    /// When there are too many.
    pub fn check_size(variants: usize, replicates: u32, place: &str) -> Result<(), InputError> {
        let runs = variants as u64 * u64::from(replicates);
        if runs <= MAX_SWEEP_RUNS {
            return Ok(());
        }
        let remedy = format!("sweep over less: up to {MAX_SWEEP_RUNS} runs, or several sweeps");
        Err(InputError::new(place, format!("there are {runs} runs"), remedy))
    }

    /// As the world knows it before any run.
    pub(super) fn seeds(&self, variant: u32) -> SeedEffect {
        self.variants[variant as usize].seeds
    }

    /// Returns the number of runs of a variant, at most: one where seeds change nothing.
    pub fn runs_of(&self, variant: u32) -> u32 {
        if self.seeds(variant) == SeedEffect::Nothing { 1 } else { self.replicates }
    }

    /// Returns the number of runs, at most.
    pub fn runs(&self) -> u64 {
        (0..self.variants.len() as u32).map(|v| u64::from(self.runs_of(v))).sum()
    }

    /// Returns the number of trials; not all are run where seeds change nothing.
    pub fn len(&self) -> u64 {
        self.variants.len() as u64 * u64::from(self.replicates)
    }

    /// Returns whether there are no trials; a plan always has some.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Returns the trial of a variant and a replicate, which must be below [`Plan::replicates`],
    /// because numbers of trials would overlap otherwise.
    pub fn trial(&self, variant: u32, replicate: u32) -> Trial {
        Trial {
            id: u64::from(variant) * u64::from(self.replicates) + u64::from(replicate),
            variant,
            replicate,
            seed: self.first_seed + u64::from(replicate),
        }
    }

    /// Returns the trial with this number, if it exists.
    pub fn trial_of(&self, id: u64) -> Option<Trial> {
        if id >= self.len() {
            return None;
        }
        let replicates = u64::from(self.replicates);
        Some(self.trial((id / replicates) as u32, (id % replicates) as u32))
    }

    /// Returns the trials of a share, in the order in which they are run: every `count`-th trial,
    /// counted over variants and replicates alike, so that no share gets all the expensive
    /// variants.
    pub fn shard_trials(&self, shard: Shard) -> impl Iterator<Item = Trial> + '_ {
        let index = u64::from(shard.index);
        let count = u64::from(shard.count);
        let variants = self.variants.len() as u32;
        let trials = (0..self.replicates)
            .flat_map(move |replicate| (0..variants).map(move |v| self.trial(v, replicate)));
        let trials = trials.filter(|trial| trial.replicate < self.runs_of(trial.variant));
        trials.filter(move |trial| {
            (u64::from(trial.variant) + u64::from(trial.replicate)) % count == index
        })
    }
}

/// Checks that runs with seeds from `first` on have seeds that scenarios can have, up to 2^63 - 1.
///
/// # Errors
/// The cause, in words.
pub fn check_seeds(first: u64, runs: u64) -> Result<(), String> {
    let last = first.checked_add(runs.saturating_sub(1));
    if last.is_some_and(|last| last <= i64::MAX as u64) {
        return Ok(());
    }
    Err(format!("{runs} seeds from {first} on exceed 2^63 - 1"))
}

/// `count` of `robots.count`.
fn last_part(key: &str) -> &str {
    key.rsplit('.').next().unwrap_or(key)
}

/// Numbers equal names from the second on, because samples of whole numbers may coincide.
fn number_duplicates(names: &mut [String]) {
    let mut seen: BTreeMap<String, u32> = BTreeMap::new();
    for name in names {
        let count = seen.entry(name.clone()).or_default();
        *count += 1;
        if *count > 1 {
            *name = format!("{name} ({count})");
        }
    }
}

/// A share of the trials: number `index` of `count`, from 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Shard {
    /// From 0 to `count - 1`.
    pub index: u32,
    /// The number of shares.
    pub count: u32,
}

impl Shard {
    /// The share of all trials.
    pub const ALL: Self = Self { index: 0, count: 1 };
}

/// Parses `0/4`, the first of four shares.
impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        parse_shard(text).ok_or_else(|| {
            format!("`{text}` is no share: write I/N with I from 0 to N-1, e.g. 0/4")
        })
    }
}

fn parse_shard(text: &str) -> Option<Shard> {
    let (index, count) = text.split_once('/')?;
    let index = index.trim().parse().ok()?;
    let count = count.trim().parse().ok()?;
    (index < count).then_some(Shard { index, count })
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.index, self.count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sweep::Factor;
    use proptest::prelude::*;
    use sidestep_scenario::Source;
    use std::collections::BTreeSet;

    fn plan(variants: usize, replicates: u32) -> Plan {
        let values = (0..variants).map(|n| n.to_string()).collect::<Vec<_>>().join(",");
        let mut sweep = Sweep::from_scenario("s.toml");
        sweep.design.factors = vec![Factor::parse(&format!("n={values}")).expect("valid")];
        sweep.replicates = replicates;
        let variants = sweep.design.variants("test").expect("valid");
        let source = Source::new("s.toml", "", "");
        let base = BaseScenario { world: "robots", seed: 7, source: &source };
        Plan::new(&sweep, variants, base).expect("valid")
    }

    proptest! {
        #[test]
        fn shares_are_disjoint_and_together_are_all_trials(
            variants in 1usize..12, replicates in 1u32..12, count in 1u32..9,
        ) {
            let plan = plan(variants, replicates);
            let mut seen = BTreeSet::new();
            for index in 0..count {
                for trial in plan.shard_trials(Shard { index, count }) {
                    prop_assert_eq!(plan.trial_of(trial.id), Some(trial));
                    prop_assert!(seen.insert(trial.id), "trial {} is in two shares", trial.id);
                }
            }
            prop_assert_eq!(seen.len() as u64, plan.len());
            prop_assert_eq!(plan.trial_of(plan.len()), None);
        }
    }

    #[test]
    fn privileged_variants_are_marked_and_explained_unless_all_are() {
        let mut plan = plan(3, 1);
        assert_eq!(plan.privilege_note(), None);
        for variant in &mut plan.variants[1..] {
            variant.privilege = Some("a planner knows all".into());
        }
        assert_eq!(plan.names(), ["n=0", "n=1 *", "n=2 *"]);
        let note = plan.privilege_note().expect("some are");
        assert!(note.starts_with("Variants with * (n=1 *; n=2 *) are privileged"), "{note}");
        assert!(note.ends_with("others: a planner knows all."), "{note}");
        plan.variants[0].privilege = Some("a planner knows all".into());
        assert_eq!(plan.names(), ["n=0", "n=1", "n=2"]);
        assert!(plan.privilege_note().expect("all are").starts_with("All variants are privileged"));
    }

    #[test]
    fn replicates_of_all_variants_have_the_same_seeds() {
        let plan = plan(3, 4);
        for trial in plan.shard_trials(Shard::ALL) {
            assert_eq!(trial.seed, 7 + u64::from(trial.replicate));
        }
        let first: Vec<u32> =
            plan.shard_trials(Shard::ALL).take(3).map(|trial| trial.replicate).collect();
        assert_eq!(first, [0, 0, 0], "the first replicate of every variant comes first");
    }

    #[test]
    fn a_share_has_variants_and_replicates_of_all_kinds() {
        let plan = plan(2, 6);
        let half: Vec<Trial> = plan.shard_trials(Shard { index: 0, count: 2 }).collect();
        assert_eq!(half.iter().filter(|trial| trial.variant == 0).count(), 3);
        assert_eq!(half.len(), 6);
    }

    #[test]
    fn shares_are_written_as_index_of_count() {
        assert_eq!("1/4".parse(), Ok(Shard { index: 1, count: 4 }));
        for bad in ["4/4", "1", "a/2", "-1/2", "0/0", ""] {
            assert!(bad.parse::<Shard>().is_err(), "{bad}");
        }
    }
}
