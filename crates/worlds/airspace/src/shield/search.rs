//! The search for plans that are pairwise compatible.

use super::orbit::OrbitSide;
use super::safe_maneuver::{SafeManeuver, TurnProfile};
use super::shielded_aircraft::ShieldedAircraft;
use std::collections::{BTreeMap, BTreeSet};

/// The plan that the shield gives an airplane.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ShieldDecision {
    /// Number of the candidate to fly, `None` for the stored fallback.
    pub candidate: Option<usize>,
    /// The fallback to store after that.
    pub fallback: OrbitSide,
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

/// Decides for airplanes with stored fallbacks that are pairwise apart. `candidates[i]` are the
/// turn profiles that airplane `i` may fly, the preferred one first, each of `steps` steps of `dtau_s` seconds;
/// without any it stays on its fallback.
pub fn filter_maneuvers(
    group: &[ShieldedAircraft],
    candidates: &[Vec<TurnProfile>],
    steps: usize,
    dtau_s: f64,
    certainty: PlanCertainty,
) -> Vec<ShieldDecision> {
    let mut search = ShieldSearch::new(group, candidates, steps, dtau_s, certainty);
    search.resolve_conflicts();
    search.replan_fallback_aircraft();
    search
        .plans
        .iter()
        .map(|p| ShieldDecision { candidate: p.candidate, fallback: p.side })
        .collect()
}

struct ShieldSearch<'a> {
    group: &'a [ShieldedAircraft],
    candidates: &'a [Vec<TurnProfile>],
    dtau_s: f64,
    certainty: PlanCertainty,
    plans: Vec<SafeManeuver>,
    fallbacks: Vec<SafeManeuver>,
    /// Airplanes by rising rank.
    by_rank: Vec<usize>,
}

impl<'a> ShieldSearch<'a> {
    fn new(
        group: &'a [ShieldedAircraft],
        candidates: &'a [Vec<TurnProfile>],
        steps: usize,
        dtau_s: f64,
        certainty: PlanCertainty,
    ) -> Self {
        let fallbacks: Vec<SafeManeuver> = group
            .iter()
            .map(|aircraft| SafeManeuver::fallback(aircraft.clone(), steps, dtau_s))
            .collect();
        let mut plans = fallbacks.clone();
        for ((aircraft, profiles), plan) in group.iter().zip(candidates).zip(&mut plans) {
            if let Some(first) = profiles.first() {
                let side = aircraft.fallback;
                *plan =
                    SafeManeuver::from_candidate(aircraft.clone(), first, dtau_s, Some(0), side);
            }
        }
        let mut by_rank: Vec<usize> = (0..group.len()).collect();
        by_rank.sort_unstable_by_key(|&i| group[i].rank);
        Self { group, candidates, dtau_s, certainty, plans, fallbacks, by_rank }
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
        // Unless all plans are sure to be flown, either one may fly its fallback instead.
        plan.is_compatible(other)
            && (self.certainty == PlanCertainty::Sure
                || (plan.is_compatible(&self.fallbacks[j])
                    && self.fallbacks[i].is_compatible(other)))
    }

    fn resolve_conflicts(&mut self) {
        let mut pairs = self.incompatible_pairs();
        while let Some(loser) = self.lowest_ranked_to_yield(&pairs) {
            let other = self.alternative_plan(loser);
            let present = self.plans[loser].candidate;
            // Another side of its candidate costs nothing. Before it takes another candidate, which costs delay, it
            // and those with which it is not compatible try to turn to one side together.
            let keeps_candidate = other.as_ref().is_some_and(|plan| plan.candidate == present);
            if !keeps_candidate && let Some(turned) = self.turn_jointly(loser, &pairs) {
                pairs.retain(|&(i, j)| i != loser && j != loser);
                turned.into_iter().for_each(|(k, plan)| self.plans[k] = plan);
                continue;
            }
            self.plans[loser] = other.unwrap_or_else(|| self.fallbacks[loser].clone());
            pairs.retain(|&(i, j)| i != loser && j != loser);
            pairs.extend(self.incompatible_pairs_with(loser));
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
            self.plans[other].is_fallback() || self.group[other].rank > self.group[i].rank
        };
        !self.plans[i].is_fallback()
            && pairs
                .iter()
                .any(|&(a, b)| (a == i && gives_way_to(b)) || (b == i && gives_way_to(a)))
    }

    /// Returns the present plans of an airplane and of all with which it is not compatible, with
    /// orbits to one side, if those are compatible with each other and with all others.
    ///
    /// Two that pass each other have to turn to the same side: to the one on which they part. If
    /// they are set to the other side, neither of them can change alone.
    fn turn_jointly(
        &self,
        i: usize,
        pairs: &[(usize, usize)],
    ) -> Option<BTreeMap<usize, SafeManeuver>> {
        let concerned = pairs.iter().filter(|&&(a, b)| a == i || b == i);
        let all: BTreeSet<usize> = concerned.flat_map(|&(a, b)| [a, b]).collect();
        if all.iter().any(|&k| self.plans[k].is_fallback()) {
            return None;
        }
        for side in OrbitSide::BOTH {
            let turned: BTreeMap<usize, SafeManeuver> =
                all.iter().map(|&k| (k, self.plans[k].with_side(side))).collect();
            if turned.keys().all(|&k| self.is_compatible_when_turned(k, &turned)) {
                return Some(turned);
            }
        }
        None
    }

    /// Returns whether the plan of an airplane among some that have turned is compatible with theirs and all others.
    fn is_compatible_when_turned(&self, k: usize, turned: &BTreeMap<usize, SafeManeuver>) -> bool {
        let mut others = (0..self.plans.len()).filter(|&j| j != k);
        others.all(|j| {
            let other = turned.get(&j).unwrap_or(&self.plans[j]);
            self.is_compatible_with_plan(k, &turned[&k], j, other)
        })
    }

    fn incompatible_pairs(&self) -> Vec<(usize, usize)> {
        let n = self.plans.len();
        let all = (0..n).flat_map(|i| (i + 1..n).map(move |j| (i, j)));
        all.filter(|&(i, j)| !self.is_compatible(i, &self.plans[i], j)).collect()
    }

    fn incompatible_pairs_with(&self, i: usize) -> Vec<(usize, usize)> {
        let others = (0..self.plans.len()).filter(|&j| j != i);
        others.filter(|&j| !self.is_compatible(i, &self.plans[i], j)).map(|j| (i, j)).collect()
    }

    /// Returns the first plan of an airplane that is compatible with all present ones.
    fn alternative_plan(&self, i: usize) -> Option<SafeManeuver> {
        let aircraft = &self.group[i];
        for (k, profile) in self.candidates[i].iter().enumerate() {
            for side in OrbitSide::BOTH {
                let plan = SafeManeuver::from_candidate(
                    aircraft.clone(),
                    profile,
                    self.dtau_s,
                    Some(k),
                    side,
                );
                if self.is_compatible_with_all(i, &plan) {
                    return Some(plan);
                }
            }
        }
        None
    }

    fn is_compatible_with_all(&self, i: usize, plan: &SafeManeuver) -> bool {
        (0..self.plans.len()).filter(|&j| j != i).all(|j| self.is_compatible(i, plan, j))
    }

    /// Lets those that have fallen back try once more, by falling rank, as long as that helps any.
    fn replan_fallback_aircraft(&mut self) {
        let mut has_changed = true;
        while has_changed {
            has_changed = false;
            for k in (0..self.by_rank.len()).rev() {
                let i = self.by_rank[k];
                if self.plans[i].is_fallback()
                    && let Some(plan) = self.alternative_plan(i)
                {
                    self.plans[i] = plan;
                    has_changed = true;
                }
            }
        }
    }
}
