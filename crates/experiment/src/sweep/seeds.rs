//! Variants in which seeds change nothing: one run is enough.
//!
//! Where a scenario draws no random number, its world reports it, and there is one run. Where draws
//! only guide a search, the first two runs decide: if they end in the same state to the bit, with
//! the same cycles, seeds are taken to change nothing, and there are no more runs.

use super::plan::{Plan, Trial};
use super::table::{Role, RunTable};
use super::trial::Outcome;
use sidestep_scenario::{SeedEffect, WorldType};
use std::collections::{BTreeMap, BTreeSet};

/// Number of runs of a variant before the others, where its world cannot tell.
const PILOT_RUNS: u32 = 2;

/// The first runs of variants where their world cannot tell.
#[derive(Debug)]
pub struct PilotRuns<'a> {
    plan: &'a Plan,
    /// Digests of the last states of pilots, by variant and replicate.
    ends: BTreeMap<u32, BTreeMap<u32, String>>,
}

impl<'a> PilotRuns<'a> {
    /// Returns the pilots before any run: no variant is settled.
    pub fn new(plan: &'a Plan) -> Self {
        Self { plan, ends: BTreeMap::new() }
    }

    /// The pilots among the rows of a table; none where it has no digests.
    pub(super) fn from_table(plan: &'a Plan, runs: &RunTable) -> Self {
        let mut pilots = Self::new(plan);
        let Some(trials) = runs.columns_with_role(Role::Trial).next() else { return pilots };
        let Some(digests) = runs.columns_with_role(Role::Digest).next() else { return pilots };
        for row in 0..runs.runs() {
            let trial = trials.values.number(row).map(|id| id as u64);
            pilots.add_digest(trial, digests.values.text(row));
        }
        pilots
    }

    /// Adds an outcome; one that is not of a pilot changes nothing.
    pub fn add(&mut self, outcome: &Outcome) {
        self.add_digest(Some(outcome.trial), outcome.digest.clone());
    }

    pub(super) fn add_digest(&mut self, trial: Option<u64>, digest: String) {
        let Some(trial) = trial.and_then(|id| self.plan.trial_of(id)) else { return };
        // A precision has a rule of its own for variants without spread.
        let has_pilots =
            self.plan.until.is_none() && self.plan.seeds(trial.variant) == SeedEffect::Perhaps;
        // A failed run has no digest, and settles nothing.
        if has_pilots && trial.replicate < PILOT_RUNS && !digest.is_empty() {
            self.ends.entry(trial.variant).or_default().insert(trial.replicate, digest);
        }
    }

    /// Returns whether all pilots of a variant ended alike.
    pub fn is_settled(&self, variant: u32) -> bool {
        let Some(ends) = self.ends.get(&variant) else { return false };
        let mut ends = ends.values();
        let first = ends.next();
        ends.len() + 1 == PILOT_RUNS as usize && ends.all(|end| Some(end) == first)
    }

    /// Returns whether a trial is of use: it is not where its variant is settled without it.
    pub fn needs(&self, trial: &Trial) -> bool {
        trial.replicate < PILOT_RUNS || !self.is_settled(trial.variant)
    }

    /// Returns the trials to run next: those of which the others may depend, if there are any.
    pub fn next_trials(&self, open: Vec<Trial>) -> Vec<Trial> {
        let has_open_pilots = open.iter().any(|trial| {
            trial.replicate < PILOT_RUNS && self.plan.seeds(trial.variant) == SeedEffect::Perhaps
        });
        if has_open_pilots {
            return open.into_iter().filter(|trial| trial.replicate < PILOT_RUNS).collect();
        }
        open.into_iter().filter(|trial| self.needs(trial)).collect()
    }
}

/// Returns for each variant whether seeds change nothing in it, or have changed nothing: its runs are one case.
pub(super) fn seedless_variants(plan: &Plan, runs: &RunTable) -> Vec<bool> {
    let pilots = PilotRuns::from_table(plan, runs);
    let unchanged = unchanged_variants(plan, runs);
    let is_seedless = |variant: u32| {
        plan.seeds(variant) == SeedEffect::Nothing
            || pilots.is_settled(variant)
            || unchanged.contains(&variant)
    };
    (0..plan.variants.len() as u32).map(is_seedless).collect()
}

/// Returns the notes that a reader must know about the seeds of these runs.
pub(super) fn seed_notes(
    plan: &Plan,
    runs: &RunTable,
    world: Option<&dyn WorldType>,
) -> Vec<String> {
    let pilots = PilotRuns::from_table(plan, runs);
    let variants = 0..plan.variants.len() as u32;
    let mut notes = Vec::new();
    let undrawn = variants.clone().filter(|v| plan.seeds(*v) == SeedEffect::Nothing).count();
    if undrawn > 0 {
        notes.push(format!(
            "Seeds change nothing{}: no random number is drawn. So there is one run of each, and no \
             interval.",
            in_variants(plan, undrawn)
        ));
    }
    let settled = variants.filter(|v| pilots.is_settled(*v)).count();
    if settled > 0 {
        notes.push(format!(
            "Seeds are taken to change nothing{}: the runs with the seeds {} and {} ended in the same \
             state, to the bit. So there are no more runs, and no interval.",
            in_variants(plan, settled),
            plan.first_seed,
            plan.first_seed + 1
        ));
    }
    let unchanged = unchanged_variants(plan, runs).len();
    if unchanged > 0 {
        notes.push(format!(
            "All runs{} ended in the same state, to the bit: seeds changed nothing there. So these runs \
             count as one, without an interval.",
            in_variants(plan, unchanged)
        ));
    }
    if !notes.is_empty() {
        notes.extend(world.and_then(seed_remedy));
    }
    notes
}

/// Returns the number of variants in words; nothing if it is all of them.
fn in_variants(plan: &Plan, count: usize) -> String {
    let all = plan.variants.len();
    if count == all { String::new() } else { format!(" in {count} of {all} variants") }
}

/// Returns the features to ask for in a scenario of a world so that its seeds change something; `None` where the
/// world lists none.
pub fn seed_remedy(world: &dyn WorldType) -> Option<String> {
    let draws = world.random_quantities();
    (!draws.is_empty()).then(|| format!("Seeds change what is drawn: {draws}."))
}

/// Returns the variants of which all runs ended alike, although seeds might decide.
fn unchanged_variants(plan: &Plan, runs: &RunTable) -> BTreeSet<u32> {
    let Some(trials) = runs.columns_with_role(Role::Trial).next() else { return BTreeSet::new() };
    let Some(digests) = runs.columns_with_role(Role::Digest).next() else {
        return BTreeSet::new();
    };
    let mut ends: BTreeMap<u32, (BTreeSet<String>, usize)> = BTreeMap::new();
    for row in 0..runs.runs() {
        let trial = trials.values.number(row).and_then(|id| plan.trial_of(id as u64));
        let Some(trial) = trial else { continue };
        let digest = digests.values.text(row);
        // A failed run has no digest.
        if plan.seeds(trial.variant) == SeedEffect::Decide && !digest.is_empty() {
            let (different, count) = ends.entry(trial.variant).or_default();
            different.insert(digest);
            *count += 1;
        }
    }
    let are_alike =
        |(different, count): &(BTreeSet<String>, usize)| different.len() == 1 && *count > 1;
    ends.iter().filter(|(_, end)| are_alike(end)).map(|(variant, _)| *variant).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sweep::{BaseScenario, Factor, RunTableBuilder, Sweep};
    use crate::testing::worlds;
    use sidestep_scenario::Source;

    /// A plan of two variants with four runs each.
    fn plan(seeds: [SeedEffect; 2]) -> Plan {
        let mut sweep = Sweep::from_scenario("s.toml");
        sweep.design.factors = vec![Factor::parse("n=1,2").expect("valid")];
        sweep.replicates = 4;
        let mut variants = sweep.design.variants("test").expect("valid");
        variants.iter_mut().zip(seeds).for_each(|(v, seeds)| v.seeds = seeds);
        let source = Source::new("s.toml", "", "");
        Plan::new(&sweep, variants, BaseScenario { world: "chain", seed: 7, source: &source })
            .expect("valid")
    }

    fn outcome(trial: Trial, digest: &str) -> Outcome {
        Outcome { digest: digest.into(), failure: None, ..Outcome::from_failure(trial, "") }
    }

    #[test]
    fn what_draws_nothing_is_planned_once() {
        let plan = plan([SeedEffect::Nothing, SeedEffect::Decide]);
        let trials: Vec<Trial> = plan.shard_trials(crate::sweep::Shard::ALL).collect();
        assert_eq!((plan.runs(), trials.len()), (5, 5));
        assert_eq!(trials.iter().filter(|trial| trial.variant == 0).count(), 1);
    }

    #[test]
    fn two_equal_ends_settle_a_variant_whose_world_cannot_tell_and_no_other() {
        for (digests, settled) in [(["a", "a"], true), (["a", "b"], false), (["", ""], false)] {
            let plan = plan([SeedEffect::Perhaps, SeedEffect::Decide]);
            let mut pilots = PilotRuns::new(&plan);
            let open: Vec<Trial> = plan.shard_trials(crate::sweep::Shard::ALL).collect();
            let first = pilots.next_trials(open.clone());
            assert!(
                first.len() == 4 && first.iter().all(|trial| trial.replicate < PILOT_RUNS),
                "{first:?}"
            );
            for (replicate, digest) in (0..).zip(digests) {
                (0..2).for_each(|v| pilots.add(&outcome(plan.trial(v, replicate), digest)));
            }
            assert_eq!([pilots.is_settled(0), pilots.is_settled(1)], [settled, false]);
            assert_eq!(pilots.needs(&plan.trial(0, 2)), !settled);
        }
    }

    #[test]
    fn the_table_has_no_runs_beyond_trials_that_settle_and_readers_are_told() {
        let plan = plan([SeedEffect::Perhaps, SeedEffect::Decide]);
        let mut rows = RunTableBuilder::default();
        for trial in plan.shard_trials(crate::sweep::Shard::ALL) {
            rows.push(&outcome(trial, "the same"));
        }
        let table = rows.build(&plan).expect("no twins");
        assert_eq!(table.runs(), 2 + 4);
        assert_eq!(seedless_variants(&plan, &table), [true, true]);
        let told = seed_notes(&plan, &table, worlds().find("chain"));
        assert!(
            told[0].contains("in 1 of 2 variants: the runs with the seeds 7 and 8"),
            "{told:?}"
        );
        assert!(
            told[1].contains("All runs in 1 of 2 variants ended in the same state"),
            "{told:?}"
        );
        assert!(told[2].starts_with("Seeds change what is drawn: fields"), "{told:?}");
    }

    #[test]
    fn where_seeds_decide_nothing_is_said_of_what_they_could_change() {
        let plan = plan([SeedEffect::Decide, SeedEffect::Decide]);
        let mut rows = RunTableBuilder::default();
        for (k, trial) in plan.shard_trials(crate::sweep::Shard::ALL).enumerate() {
            rows.push(&outcome(trial, &format!("end {k}")));
        }
        let table = rows.build(&plan).expect("no twins");
        assert!(seed_notes(&plan, &table, worlds().find("chain")).is_empty());
        assert!(worlds().iter().all(|world| seed_remedy(world).is_some()));
    }
}
