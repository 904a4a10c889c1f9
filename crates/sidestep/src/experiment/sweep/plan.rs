//! The cells of a sweep, and their shares.

use super::design::Setting;
use super::file::{Sweep, Until};
use super::summary::{Summary, SummaryOptions};
use super::table::{Role, RunTable};
use crate::scenario::nearest;
use crate::worlds::WORLDS;
use serde::{Deserialize, Serialize};
use sidestep_kernel::InputError;
use sidestep_kernel::ports::Values;
use std::collections::BTreeMap;
use std::fmt;
use std::str::FromStr;

/// All runs of a sweep: variants times replicates.
///
/// A cell has the number `variant * replicates + replicate`, so rows sorted by cell are sorted by
/// variant. Cells are run replicate by replicate, so that the first results are a small complete
/// experiment.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Plan {
    /// Name of the sweep; may be empty.
    pub name: String,
    /// Name of the world.
    pub world: String,
    /// Keys that differ between variants, in the order of their columns.
    pub parameters: Vec<String>,
    /// The variants.
    pub variants: Vec<Variant>,
    /// Largest number of runs of each variant.
    pub replicates: u32,
    /// The seed of replicate 0; replicate `k` has this plus `k`.
    pub first_seed: u64,
    /// The precision at which a variant has had enough runs, if it is not run for all replicates.
    pub until: Option<Until>,
    /// The metrics to report; all that vary if empty.
    pub metrics: Vec<String>,
    /// The variant that others are compared with.
    pub baseline: Option<u32>,
    /// Number of agents of the largest variant.
    pub agents: u64,
    /// Whether every run is recorded in a folder of its own.
    pub record: bool,
}

/// One variant of the scenario.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Variant {
    /// Its settings, beside those that all variants share.
    pub settings: Vec<Setting>,
}

/// Largest number of runs of a sweep: joining a table of ten million takes some gigabytes.
const MOST_RUNS: u64 = 10_000_000;

impl Variant {
    /// Returns the value of a parameter, if this variant sets it.
    pub fn value(&self, key: &str) -> Option<&toml::Value> {
        self.settings.iter().find(|s| s.key == key).map(|s| &s.value)
    }

    /// Whether the variant has this setting; 2 and 2.0 are the same.
    fn has(&self, setting: &Setting) -> bool {
        let number = |v: &toml::Value| v.as_float().or(v.as_integer().map(|n| n as f64));
        self.value(&setting.key).is_some_and(|value| {
            *value == setting.value
                || number(value).is_some_and(|n| Some(n) == number(&setting.value))
        })
    }
}

/// Writes the settings as text: `robots.count = 10, regime = "both"`.
impl fmt::Display for Variant {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.settings.is_empty() {
            return f.write_str("the scenario as it is");
        }
        for (k, Setting { key, value }) in self.settings.iter().enumerate() {
            let separator = if k == 0 { "" } else { ", " };
            write!(f, "{separator}{key} = {value}")?;
        }
        Ok(())
    }
}

/// The unit of work: a variant with a seed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Cell {
    /// Its number.
    pub id: u64,
    /// Number of its variant.
    pub variant: u32,
    /// Number of the run among those of its variant.
    pub replicate: u32,
    /// The seed.
    pub seed: u64,
}

impl Plan {
    /// Returns a plan of these variants, which are known to be valid.
    ///
    /// # Errors
    /// When seeds overflow, or the baseline is no variant or matches several.
    pub fn new(
        sweep: &Sweep,
        variants: Vec<Vec<Setting>>,
        (world, seed): (&str, u64),
    ) -> Result<Self, InputError> {
        let mut parameters: Vec<String> = Vec::new();
        for setting in variants.iter().flatten() {
            if !parameters.contains(&setting.key) {
                parameters.push(setting.key.clone());
            }
        }
        let first_seed = sweep.first_seed.unwrap_or(seed);
        let last = first_seed.checked_add(u64::from(sweep.replicates));
        if last.is_none_or(|last| last > i64::MAX as u64) {
            let cause = format!("{} seeds from {first_seed} on run over", sweep.replicates);
            return Err(InputError::new(&sweep.place, cause, "begin with a smaller seed"));
        }
        let variants: Vec<Variant> =
            variants.into_iter().map(|settings| Variant { settings }).collect();
        let baseline = baseline(&sweep.baseline, &variants, &sweep.place)?;
        Ok(Self {
            name: sweep.name.clone(),
            world: world.into(),
            parameters,
            variants,
            replicates: sweep.replicates,
            first_seed,
            until: sweep.until.clone(),
            metrics: sweep.metrics.clone(),
            baseline,
            agents: 0,
            record: sweep.record,
        })
    }

    /// Returns the names of the variants in tables and figures: their parameters, in short
    /// (`method=pc, n=8`).
    pub fn names(&self) -> Vec<String> {
        let last = |key: &str| key.rsplit('.').next().unwrap_or(key).to_string();
        let is_alone =
            |key: &str| self.parameters.iter().filter(|k| last(k) == last(key)).count() == 1;
        let named = |s: &Setting| {
            let key = if is_alone(&s.key) { last(&s.key) } else { s.key.clone() };
            let value = s.value.as_str().map_or_else(|| s.value.to_string(), str::to_string);
            format!("{key}={value}")
        };
        let name = |v: &Variant| v.settings.iter().map(named).collect::<Vec<_>>().join(", ");
        let mut names: Vec<String> = self.variants.iter().map(name).collect();
        let plain = if names.len() == 1 { "all runs" } else { "as in the scenario" };
        names.iter_mut().filter(|name| name.is_empty()).for_each(|name| *name = plain.into());
        number_twins(&mut names);
        names
    }

    /// Returns the summary of the runs of this plan, with its metrics and baseline.
    ///
    /// # Errors
    /// When a metric that is to be reported does not exist, or the table is not of this plan.
    pub fn summary(&self, runs: &RunTable) -> Result<Summary, InputError> {
        let names = self.names();
        let mut named = runs.clone();
        for column in named.columns.iter_mut().filter(|c| c.role == Role::Variant) {
            let name = |k: usize| {
                let variant = column.values.number(k)? as usize;
                names.get(variant).cloned()
            };
            column.values = Values::Text((0..runs.runs()).map(name).collect());
        }
        let options = SummaryOptions {
            metrics: (!self.metrics.is_empty()).then(|| self.metrics.clone()),
            // A sweep in progress may have no run of the baseline yet.
            baseline: self
                .baseline
                .filter(|variant| has_runs(runs, *variant))
                .map(|variant| names[variant as usize].clone()),
            meanings: WORLDS.named(&self.world).map_or(&[], |world| world.meanings()),
            ..SummaryOptions::default()
        };
        Summary::of(&named, &options)
    }

    /// Checks that there are not too many runs for the memory of a machine.
    ///
    /// # Errors
    /// When there are too many.
    pub fn check_size(variants: usize, replicates: u32, place: &str) -> Result<(), InputError> {
        let runs = variants as u64 * u64::from(replicates);
        if runs <= MOST_RUNS {
            return Ok(());
        }
        let remedy = format!("sweep over less: up to {MOST_RUNS} runs, or several sweeps");
        Err(InputError::new(place, format!("there are {runs} runs"), remedy))
    }

    /// Returns the largest number of cells.
    pub fn len(&self) -> u64 {
        self.variants.len() as u64 * u64::from(self.replicates)
    }

    /// Whether there are no cells; a plan always has some.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Returns the cell of a variant and a replicate.
    pub fn cell(&self, variant: u32, replicate: u32) -> Cell {
        Cell {
            id: u64::from(variant) * u64::from(self.replicates) + u64::from(replicate),
            variant,
            replicate,
            seed: self.first_seed + u64::from(replicate),
        }
    }

    /// Returns the cell with this number, if it exists.
    pub fn cell_of(&self, id: u64) -> Option<Cell> {
        let replicates = u64::from(self.replicates);
        let cell = || self.cell((id / replicates) as u32, (id % replicates) as u32);
        (id < self.len()).then(cell)
    }

    /// Returns the cells of a share, in the order in which they are run: every `count`-th cell,
    /// counted over variants and replicates alike, so that no share gets all the expensive
    /// variants.
    pub fn share(&self, shard: Shard) -> impl Iterator<Item = Cell> + '_ {
        let (index, count) = (u64::from(shard.index), u64::from(shard.count));
        let variants = self.variants.len() as u32;
        let cells = (0..self.replicates)
            .flat_map(move |replicate| (0..variants).map(move |v| self.cell(v, replicate)));
        cells.filter(move |c| (u64::from(c.variant) + u64::from(c.replicate)) % count == index)
    }
}

/// Whether the table has a run of a variant.
fn has_runs(runs: &RunTable, variant: u32) -> bool {
    let mut columns = runs.of_role(Role::Variant);
    columns.any(|c| (0..runs.runs()).any(|k| c.values.number(k) == Some(f64::from(variant))))
}

/// Numbers equal names from the second on, because samples of whole numbers may coincide.
fn number_twins(names: &mut [String]) {
    let mut seen: BTreeMap<String, u32> = BTreeMap::new();
    for name in names {
        let count = seen.entry(name.clone()).or_default();
        *count += 1;
        if *count > 1 {
            *name = format!("{name} ({count})");
        }
    }
}

/// Returns the variant that has all these settings.
fn baseline(
    wanted: &[Setting],
    variants: &[Variant],
    place: &str,
) -> Result<Option<u32>, InputError> {
    if wanted.is_empty() {
        return Ok(None);
    }
    let fits = |v: &Variant| wanted.iter().all(|s| v.has(s));
    let found: Vec<usize> = (0..variants.len()).filter(|&k| fits(&variants[k])).collect();
    match found[..] {
        [one] => Ok(Some(one as u32)),
        [] => Err(no_baseline(wanted, variants, place)),
        _ => {
            let cause = format!("{} variants have the settings of the baseline", found.len());
            Err(InputError::new(place, cause, "give the value of every key that is varied"))
        }
    }
}

/// Returns an error that names the settings that no variant has, and the existing values.
fn no_baseline(wanted: &[Setting], variants: &[Variant], place: &str) -> InputError {
    let is_missing = |s: &&Setting| !variants.iter().any(|v| v.has(s));
    let Some(Setting { key, value }) = wanted.iter().find(is_missing) else {
        let cause = "no variant has all settings of the baseline at once";
        return InputError::new(place, cause, "give those of one variant");
    };
    let mut values: Vec<String> = Vec::new();
    for value in variants.iter().filter_map(|v| v.value(key)).map(toml::Value::to_string) {
        if !values.contains(&value) && values.len() < MOST_NAMED {
            values.push(value);
        }
    }
    if !values.is_empty() {
        let cause = format!("the baseline has `{key}` = {value}, which no variant has");
        return InputError::new(place, cause, format!("it is varied over {}", values.join(", ")));
    }
    let mut keys: Vec<&str> = Vec::new();
    for setting in variants.iter().flat_map(|v| &v.settings) {
        if !keys.contains(&setting.key.as_str()) {
            keys.push(&setting.key);
        }
    }
    let cause = format!("the baseline has `{key}`, which is not varied");
    let remedy = match keys.is_empty() {
        true => format!("vary it, e.g. --vary {key}={value},..."),
        false => nearest(key, &keys),
    };
    InputError::new(place, cause, remedy)
}

/// Largest number of values that an error lists.
const MOST_NAMED: usize = 20;

/// A share of the cells: number `index` of `count`, from 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Shard {
    /// Its number.
    pub index: u32,
    /// The number of shares.
    pub count: u32,
}

impl Shard {
    /// The share of all cells.
    pub const ALL: Self = Self { index: 0, count: 1 };
}

/// Parses `0/4`, the first of four shares.
impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || format!("`{text}` is no share: write I/N with I from 0 to N-1, e.g. 0/4");
        let (index, count) = text.split_once('/').ok_or_else(wrong)?;
        let number = |t: &str| t.trim().parse::<u32>().map_err(|_| wrong());
        let shard = Self { index: number(index)?, count: number(count)? };
        if shard.index < shard.count { Ok(shard) } else { Err(wrong()) }
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.index, self.count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::experiment::sweep::Factor;
    use proptest::prelude::*;
    use std::collections::BTreeSet;

    fn plan(variants: usize, replicates: u32) -> Plan {
        let values = (0..variants).map(|n| n.to_string()).collect::<Vec<_>>().join(",");
        let mut sweep = Sweep::of_scenario("s.toml");
        sweep.design.factors = vec![Factor::parse(&format!("n={values}")).expect("valid")];
        sweep.replicates = replicates;
        let variants = sweep.design.variants("test").expect("valid");
        Plan::new(&sweep, variants, ("robots", 7)).expect("valid")
    }

    proptest! {
        #[test]
        fn shares_are_disjoint_and_together_are_all_cells(
            variants in 1usize..12, replicates in 1u32..12, count in 1u32..9,
        ) {
            let plan = plan(variants, replicates);
            let mut seen = BTreeSet::new();
            for index in 0..count {
                for cell in plan.share(Shard { index, count }) {
                    prop_assert_eq!(plan.cell_of(cell.id), Some(cell));
                    prop_assert!(seen.insert(cell.id), "cell {} is in two shares", cell.id);
                }
            }
            prop_assert_eq!(seen.len() as u64, plan.len());
            prop_assert_eq!(plan.cell_of(plan.len()), None);
        }
    }

    #[test]
    fn replicates_of_all_variants_have_the_same_seeds() {
        let plan = plan(3, 4);
        for cell in plan.share(Shard::ALL) {
            assert_eq!(cell.seed, 7 + u64::from(cell.replicate));
        }
        let first: Vec<u32> = plan.share(Shard::ALL).take(3).map(|c| c.replicate).collect();
        assert_eq!(first, [0, 0, 0], "the first replicate of every variant comes first");
    }

    #[test]
    fn a_share_has_variants_and_replicates_of_all_kinds() {
        let plan = plan(2, 6);
        let half: Vec<Cell> = plan.share(Shard { index: 0, count: 2 }).collect();
        assert_eq!(half.iter().filter(|c| c.variant == 0).count(), 3);
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
