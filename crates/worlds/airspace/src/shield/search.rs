//! The search for plans that are pairwise compatible.

use super::fallback::Fallback;
use super::neighbors::neighbors;
use super::safe_maneuver::{SafeManeuver, TurnProfile};
use super::shielded_aircraft::ShieldedAircraft;
use rustc_hash::FxHashMap;
use std::cell::RefCell;
use std::collections::BTreeMap;

/// The plan that the shield gives an airplane.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ShieldDecision {
    /// Number of the candidate to fly, `None` for the stored fallback.
    pub candidate: Option<usize>,
    /// The fallback to store after that.
    pub fallback: Fallback,
}

/// The certainty that all airplanes fly the plans they are given.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PlanCertainty {
    /// All of them do.
    Sure,
    /// Each may fly its stored fallback instead, so plans have to keep apart from those of others
    /// too. They are compatible in any mixture in which they are flown.
    Mixable,
}

/// What plans consist of, the same for all airplanes.
#[derive(Debug, Clone, Copy)]
pub struct PlanRules {
    /// Number of steps in a `dt`.
    pub steps: usize,
    /// Length of a step in seconds.
    pub dtau_s: f64,
    /// Whether all are sure to be flown.
    pub certainty: PlanCertainty,
}

/// Decides for airplanes with stored fallbacks that are pairwise apart. `candidates[i]` are the
/// turn profiles that airplane `i` may fly, the preferred one first; without any it stays on its fallback.
pub fn filter_maneuvers(
    group: &[ShieldedAircraft],
    candidates: &[Vec<TurnProfile>],
    rules: PlanRules,
) -> Vec<ShieldDecision> {
    let mut search = ShieldSearch::new(group, candidates, rules);
    search.resolve_conflicts();
    search.improve_plans();
    search
        .plans
        .iter()
        .map(|p| ShieldDecision { candidate: p.candidate, fallback: p.fallback() })
        .collect()
}

/// Plans that replace others, by the place of the airplane in its group.
type PlanChanges = BTreeMap<usize, SafeManeuver>;

struct ShieldSearch<'a> {
    group: &'a [ShieldedAircraft],
    candidates: &'a [Vec<TurnProfile>],
    rules: PlanRules,
    plans: Vec<SafeManeuver>,
    fallbacks: Vec<SafeManeuver>,
    /// Airplanes by rising rank.
    by_rank: Vec<usize>,
    /// Those with which a plan of each airplane may be incompatible.
    near: Vec<Vec<usize>>,
    /// Whether two plans are compatible, as far as it was asked; only looked up, never iterated.
    answers: RefCell<FxHashMap<[PlanKey; 2], bool>>,
}

/// A plan among those of a group.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
struct PlanKey {
    airplane: usize,
    candidate: Option<usize>,
    fallback: u16,
}

impl PlanKey {
    fn new(airplane: usize, plan: &SafeManeuver) -> Self {
        Self { airplane, candidate: plan.candidate, fallback: plan.fallback().into() }
    }
}

impl<'a> ShieldSearch<'a> {
    fn new(
        group: &'a [ShieldedAircraft],
        candidates: &'a [Vec<TurnProfile>],
        rules: PlanRules,
    ) -> Self {
        let PlanRules { steps, dtau_s, .. } = rules;
        let fallbacks: Vec<SafeManeuver> = group
            .iter()
            .map(|aircraft| SafeManeuver::on_fallback(aircraft.clone(), steps, dtau_s))
            .collect();
        let mut plans = fallbacks.clone();
        for ((aircraft, profiles), plan) in group.iter().zip(candidates).zip(&mut plans) {
            if let Some(first) = profiles.first() {
                let stored = aircraft.fallback;
                *plan =
                    SafeManeuver::from_candidate(aircraft.clone(), first, dtau_s, Some(0), stored);
            }
        }
        let mut by_rank: Vec<usize> = (0..group.len()).collect();
        by_rank.sort_unstable_by_key(|&i| group[i].rank);
        let near = neighbors(group, ShieldedAircraft::plan_reach_m);
        Self {
            group,
            candidates,
            rules,
            plans,
            fallbacks,
            by_rank,
            near,
            answers: RefCell::default(),
        }
    }

    /// Returns whether a plan of airplane `i` is compatible with everything that `j` may fly.
    fn is_compatible(&self, i: usize, plan: &SafeManeuver, j: usize) -> bool {
        self.is_compatible_with_plan(i, plan, j, &self.plans[j])
    }

    /// Returns the same for another plan of `j`.
    fn is_compatible_with_plan(
        &self,
        i: usize,
        plan: &SafeManeuver,
        j: usize,
        other: &SafeManeuver,
    ) -> bool {
        // The search asks for some of them again and again, and no answer depends on any other plan.
        let asked = [PlanKey::new(i, plan), PlanKey::new(j, other)];
        if let Some(&answer) = self.answers.borrow().get(&asked) {
            return answer;
        }
        // Unless all plans are sure to be flown, either one may fly its fallback instead.
        let answer = plan.is_compatible(other)
            && (self.rules.certainty == PlanCertainty::Sure
                || (plan.is_compatible(&self.fallbacks[j])
                    && self.fallbacks[i].is_compatible(other)));
        self.answers.borrow_mut().insert(asked, answer);
        answer
    }

    fn resolve_conflicts(&mut self) {
        let mut pairs = self.incompatible_pairs();
        while let Some(loser) = self.lowest_ranked_to_yield(&pairs) {
            let plan = &self.plans[loser];
            // Other fallbacks after its candidate cost nothing, its own less than those of others, which may not fit all
            // the better. Another candidate costs delay.
            let changes = self
                .with_own_fallback(loser, plan)
                .or_else(|| self.with_other_fallbacks(loser, plan))
                .or_else(|| self.alternative_plan(loser))
                .unwrap_or_else(|| [(loser, self.fallbacks[loser].clone())].into());
            pairs.retain(|(i, j)| !changes.contains_key(i) && !changes.contains_key(j));
            self.apply(changes);
            pairs.extend(self.incompatible_pairs_with(loser));
        }
    }

    fn apply(&mut self, changes: PlanChanges) {
        for (i, plan) in changes {
            self.plans[i] = plan;
        }
    }

    /// Returns the airplane of lowest rank that has to give way in some pair.
    fn lowest_ranked_to_yield(&self, pairs: &[(usize, usize)]) -> Option<usize> {
        self.by_rank.iter().copied().find(|&i| self.has_to_give_way(i, pairs))
    }

    /// Returns whether an airplane has to give way in some pair: to one of a higher rank, or to one on its fallback,
    /// which never leaves it.
    fn has_to_give_way(&self, i: usize, pairs: &[(usize, usize)]) -> bool {
        let gives_way_to = |other: usize| {
            self.plans[other].is_on_fallback() || self.group[other].rank > self.group[i].rank
        };
        !self.plans[i].is_on_fallback()
            && pairs
                .iter()
                .any(|&(a, b)| (a == i && gives_way_to(b)) || (b == i && gives_way_to(a)))
    }

    /// Returns a plan with another fallback, with which it is compatible with all present plans.
    fn with_own_fallback(&self, i: usize, plan: &SafeManeuver) -> Option<PlanChanges> {
        self.group[i].choices.iter().find_map(|&fallback| {
            let plan = plan.with_fallback(fallback);
            self.is_compatible_with_all(i, &plan).then(|| [(i, plan)].into())
        })
    }

    /// Returns a plan of an airplane with some fallback, and the present plans of others with other fallbacks, so that
    /// each of them is compatible with all.
    ///
    /// Two that pass each other have to turn to the same side: to the one on which they part. If
    /// they are set to the other side, neither of them can change alone.
    fn with_other_fallbacks(&self, i: usize, plan: &SafeManeuver) -> Option<PlanChanges> {
        self.group[i].choices.iter().find_map(|&fallback| {
            let mut changes: PlanChanges = [(i, plan.with_fallback(fallback))].into();
            let in_the_way: Vec<usize> = self.near[i]
                .iter()
                .copied()
                .filter(|&j| !self.is_compatible(i, &changes[&i], j))
                .collect();
            if in_the_way.iter().any(|&j| self.plans[j].is_on_fallback()) {
                return None;
            }
            for j in in_the_way {
                let other = self.fallback_beside(j, &changes)?;
                changes.insert(j, other);
            }
            Some(changes)
        })
    }

    /// Returns the present plan of an airplane with another fallback, with which it is compatible with all, once others
    /// have changed theirs.
    fn fallback_beside(&self, j: usize, changes: &PlanChanges) -> Option<SafeManeuver> {
        self.group[j].choices.iter().find_map(|&fallback| {
            let plan = self.plans[j].with_fallback(fallback);
            let is_compatible_with_all = self.near[j].iter().all(|&k| {
                let other = changes.get(&k).unwrap_or(&self.plans[k]);
                self.is_compatible_with_plan(j, &plan, k, other)
            });
            is_compatible_with_all.then_some(plan)
        })
    }

    fn incompatible_pairs(&self) -> Vec<(usize, usize)> {
        let n = self.plans.len();
        let all = (0..n).flat_map(|i| self.near[i].iter().map(move |&j| (i, j)));
        all.filter(|&(i, j)| i < j && !self.is_compatible(i, &self.plans[i], j)).collect()
    }

    fn incompatible_pairs_with(&self, i: usize) -> Vec<(usize, usize)> {
        let others = self.near[i].iter().copied();
        others.filter(|&j| !self.is_compatible(i, &self.plans[i], j)).map(|j| (i, j)).collect()
    }

    /// Returns the first plan of an airplane that is compatible with all present ones.
    fn alternative_plan(&self, i: usize) -> Option<PlanChanges> {
        (0..self.candidates[i].len()).find_map(|k| self.with_own_fallback(i, &self.candidate(i, k)))
    }

    /// Returns the plan of an airplane with a candidate, and the stored fallback after it.
    fn candidate(&self, i: usize, k: usize) -> SafeManeuver {
        let aircraft = self.group[i].clone();
        let stored = aircraft.fallback;
        let profile = &self.candidates[i][k];
        SafeManeuver::from_candidate(aircraft, profile, self.rules.dtau_s, Some(k), stored)
    }

    fn is_compatible_with_all(&self, i: usize, plan: &SafeManeuver) -> bool {
        self.near[i].iter().all(|&j| self.is_compatible(i, plan, j))
    }

    /// Lets those that do not fly their first candidate try better ones once more, by falling rank, as long as that helps
    /// any. Each time one flies a better candidate and all others the same ones, so this ends.
    fn improve_plans(&mut self) {
        let mut has_changed = true;
        while has_changed {
            has_changed = false;
            for k in (0..self.by_rank.len()).rev() {
                let i = self.by_rank[k];
                if let Some(changes) = self.better_plan(i) {
                    self.apply(changes);
                    has_changed = true;
                }
            }
        }
    }

    /// Returns a plan with a candidate that an airplane prefers to that of its present plan.
    fn better_plan(&self, i: usize) -> Option<PlanChanges> {
        let present = self.plans[i].candidate.unwrap_or(self.candidates[i].len());
        (0..present).find_map(|k| self.with_other_fallbacks(i, &self.candidate(i, k)))
    }
}
