//! The search for plans that are pairwise compatible.

use super::orbit::Side;
use super::safe_maneuver::{SafeManeuver, TurnProfile};
use super::shielded_aircraft::ShieldedAircraft;
use std::collections::{BTreeMap, BTreeSet};

/// Decision of the shield for one airplane.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ShieldDecision {
    /// Number of the candidate to fly, `None` for the stored fallback.
    pub candidate: Option<usize>,
    /// The fallback to store after that.
    pub fallback: Side,
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
/// ways that airplane `i` may fly, the wanted one first, each of `steps` steps of `dtau_s` seconds;
/// without any it stays on its fallback.
pub fn filter(
    flyers: &[ShieldedAircraft],
    candidates: &[Vec<TurnProfile>],
    steps: usize,
    dtau_s: f64,
    certainty: PlanCertainty,
) -> Vec<ShieldDecision> {
    let mut search = Search::new(flyers, candidates, steps, dtau_s, certainty);
    search.resolve_conflicts();
    search.retry_fallbacks();
    search
        .plans
        .iter()
        .map(|p| ShieldDecision { candidate: p.candidate, fallback: p.side })
        .collect()
}

struct Search<'a> {
    flyers: &'a [ShieldedAircraft],
    candidates: &'a [Vec<TurnProfile>],
    dtau_s: f64,
    certainty: PlanCertainty,
    plans: Vec<SafeManeuver>,
    fallbacks: Vec<SafeManeuver>,
    /// Airplanes by rising rank.
    by_rank: Vec<usize>,
}

impl<'a> Search<'a> {
    fn new(
        flyers: &'a [ShieldedAircraft],
        candidates: &'a [Vec<TurnProfile>],
        steps: usize,
        dtau_s: f64,
        certainty: PlanCertainty,
    ) -> Self {
        let fallbacks: Vec<SafeManeuver> = flyers
            .iter()
            .map(|flyer| SafeManeuver::fallback(flyer.clone(), steps, dtau_s))
            .collect();
        let first =
            |((flyer, ways), fallback): ((&ShieldedAircraft, &Vec<TurnProfile>), &SafeManeuver)| {
                match ways.first() {
                    Some(way) => SafeManeuver::from_candidate(
                        flyer.clone(),
                        way,
                        dtau_s,
                        Some(0),
                        flyer.fallback,
                    ),
                    None => fallback.clone(),
                }
            };
        let plans = flyers.iter().zip(candidates).zip(&fallbacks).map(first).collect();
        let mut by_rank: Vec<usize> = (0..flyers.len()).collect();
        by_rank.sort_unstable_by_key(|&i| flyers[i].rank);
        Self { flyers, candidates, dtau_s, certainty, plans, fallbacks, by_rank }
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
        while let Some(loser) = self.lowest_rank(&pairs) {
            let other = self.alternative_plan(loser);
            let present = self.plans[loser].candidate;
            let keeps_way = other.as_ref().is_some_and(|plan| plan.candidate == present);
            if !keeps_way && let Some(turned) = self.turn_jointly(loser, &pairs) {
                pairs.retain(|&(i, j)| i != loser && j != loser);
                turned.into_iter().for_each(|(k, plan)| self.plans[k] = plan);
                continue;
            }
            self.plans[loser] = other.unwrap_or_else(|| self.fallbacks[loser].clone());
            pairs.retain(|&(i, j)| i != loser && j != loser);
            pairs.extend(self.incompatible_with(loser));
        }
    }

    /// Returns the airplane of lowest rank that has to give way in some pair.
    fn lowest_rank(&self, pairs: &[(usize, usize)]) -> Option<usize> {
        let gives_way = |i: usize| {
            !self.plans[i].is_fallback()
                && pairs.iter().any(|&(a, b)| {
                    let other = if a == i { b } else { a };
                    (a == i || b == i)
                        && (self.plans[other].is_fallback()
                            || self.flyers[other].rank > self.flyers[i].rank)
                })
        };
        self.by_rank.iter().copied().find(|&i| gives_way(i))
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
        Side::BOTH.into_iter().find_map(|side| {
            let turned: BTreeMap<usize, SafeManeuver> =
                all.iter().map(|&k| (k, self.plans[k].with_side(side))).collect();
            let fits = |(&k, plan): (&usize, &SafeManeuver)| {
                (0..self.plans.len()).filter(|&j| j != k).all(|j| {
                    self.is_compatible_with_plan(
                        k,
                        plan,
                        j,
                        turned.get(&j).unwrap_or(&self.plans[j]),
                    )
                })
            };
            turned.iter().all(fits).then_some(turned)
        })
    }

    fn incompatible_pairs(&self) -> Vec<(usize, usize)> {
        let n = self.plans.len();
        let all = (0..n).flat_map(|i| (i + 1..n).map(move |j| (i, j)));
        all.filter(|&(i, j)| !self.is_compatible(i, &self.plans[i], j)).collect()
    }

    fn incompatible_with(&self, i: usize) -> Vec<(usize, usize)> {
        let others = (0..self.plans.len()).filter(|&j| j != i);
        others.filter(|&j| !self.is_compatible(i, &self.plans[i], j)).map(|j| (i, j)).collect()
    }

    /// Returns the first plan of an airplane that is compatible with all present ones.
    fn alternative_plan(&self, i: usize) -> Option<SafeManeuver> {
        let others: Vec<usize> = (0..self.plans.len()).filter(|&j| j != i).collect();
        let fits = |plan: &SafeManeuver| others.iter().all(|&j| self.is_compatible(i, plan, j));
        self.candidates[i].iter().enumerate().find_map(|(k, way)| {
            Side::BOTH
                .into_iter()
                .map(|side| {
                    SafeManeuver::from_candidate(
                        self.flyers[i].clone(),
                        way,
                        self.dtau_s,
                        Some(k),
                        side,
                    )
                })
                .find(|plan| fits(plan))
        })
    }

    /// Lets those that have fallen back try once more, by falling rank, as long as that helps any.
    fn retry_fallbacks(&mut self) {
        let mut helped = true;
        while helped {
            helped = false;
            for k in (0..self.by_rank.len()).rev() {
                let i = self.by_rank[k];
                if self.plans[i].is_fallback()
                    && let Some(plan) = self.alternative_plan(i)
                {
                    self.plans[i] = plan;
                    helped = true;
                }
            }
        }
    }
}
