//! The search for plans that are pairwise compatible.

mod joint_plans;

use super::areas::ClearFallbacks;
use super::fallback::Fallback;
use super::neighbors::neighbors;
use super::safe_maneuver::{CommonPlan, PlanSource, SafeManeuver, TurnProfile};
use super::shielded_aircraft::ShieldedAircraft;
use rustc_hash::FxHashMap;
use sidestep_kernel::EntityId;
use std::cell::RefCell;
use std::collections::BTreeMap;
use std::hash::{Hash, Hasher};

/// The plan that the shield gives an airplane.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ShieldDecision {
    /// Number of the candidate to fly; `None` for the plan that all compute for it, or else for the stored fallback.
    pub candidate: Option<usize>,
    /// The fallback to store after that.
    pub fallback: Fallback,
    /// A non-cooperative aircraft of which the airplane is not clear, though some joint choice of plans might be: the search
    /// for one has come to its limit.
    pub unproved_threat: Option<EntityId>,
}

impl ShieldDecision {
    /// Returns the decision to fly the stored fallback, or what all compute for the airplane, and to store a fallback.
    pub fn from_fallback(fallback: Fallback) -> Self {
        Self { candidate: None, fallback, unproved_threat: None }
    }
}

/// What the candidates of an airplane are worth beside non-cooperative aircraft, which may come too near on its path in
/// the next `dt`.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct CandidateThreats {
    /// The candidates that it prefers to its fallback, the best one first.
    pub(crate) preferred: Vec<usize>,
    /// The non-cooperative ones of which each candidate is not clear, by id.
    pub(crate) of_candidates: Vec<Vec<EntityId>>,
    /// Those of which its fallback is not clear.
    pub(crate) of_fallback: Vec<EntityId>,
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

/// The fallbacks that plans may end with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PlanEnding {
    /// All that the airplane may choose.
    AnyFallback,
    /// Orbits at once, because others may have to guess it.
    Orbit,
}

impl PlanEnding {
    /// Returns whether a plan may end with a fallback.
    fn allows(self, fallback: Fallback) -> bool {
        self == Self::AnyFallback || fallback.is_orbiting()
    }
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
    /// The fallbacks with which they may end.
    pub ending: PlanEnding,
}

impl PlanRules {
    /// Returns the fallback that a plan ends with before another one is tried: the stored one, as far as it may.
    fn stored_fallback(&self, aircraft: &ShieldedAircraft) -> Fallback {
        match self.ending {
            PlanEnding::AnyFallback => aircraft.fallback,
            PlanEnding::Orbit => Fallback::from_side(aircraft.fallback.orbit_side),
        }
    }
}

/// Decides for airplanes with stored fallbacks that are pairwise apart. `candidates[i]` are the
/// turn profiles that airplane `i` may fly, the preferred one first; without any it stays on its fallback.
pub fn filter_maneuvers(
    group: &[ShieldedAircraft],
    candidates: &[Vec<TurnProfile>],
    rules: PlanRules,
) -> Vec<ShieldDecision> {
    let beside = Surroundings::default();
    filter_maneuvers_beside(group, candidates, &beside, rules)
}

/// What there is beside the airplanes of a group and their candidates, by airplane; empty where there is nothing.
#[derive(Debug, Default)]
pub(crate) struct Surroundings {
    /// The plan that all compute for an airplane, which it flies rather than its fallback. Those plans, and the fallbacks
    /// of all, are pairwise compatible in any mixture.
    pub(crate) common: Vec<Option<CommonPlan>>,
    /// What non-cooperative aircraft make of its candidates.
    pub(crate) threats: Vec<Option<CandidateThreats>>,
}

/// Decides likewise beside common plans and non-cooperative aircraft.
pub(crate) fn filter_maneuvers_beside(
    group: &[ShieldedAircraft],
    candidates: &[Vec<TurnProfile>],
    beside: &Surroundings,
    rules: PlanRules,
) -> Vec<ShieldDecision> {
    let mut search = ShieldSearch::new(group, candidates, beside, rules);
    search.resolve_conflicts();
    search.improve_plans();
    let unproved = search.keep_clear();
    let each = search.plans.iter().enumerate();
    each.map(|(i, plan)| ShieldDecision {
        candidate: plan.candidate(),
        fallback: plan.fallback(),
        unproved_threat: unproved.iter().find(|(of, _)| *of == i).map(|(_, other)| *other),
    })
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
    /// The plans that all compute, of those that have one.
    common: Vec<Option<SafeManeuver>>,
    /// What non-cooperative aircraft make of candidates; empty where there are none.
    threats: &'a [Option<CandidateThreats>],
    /// The candidates of each airplane beside areas; none for those that have none around them.
    beside_areas: Vec<Option<CandidatesBesideAreas>>,
    /// Airplanes by rising rank.
    by_rank: Vec<usize>,
    /// Those with which a plan of each airplane may be incompatible.
    near: Vec<Vec<usize>>,
    /// Whether two plans are compatible, as far as it was asked; only looked up, never iterated.
    answers: RefCell<FxHashMap<[PlanKey; 2], bool>>,
    /// The airplane that was in the way of a plan when that was asked last: it is mostly still there. Only looked up, too.
    last_in_the_way: RefCell<FxHashMap<PlanKey, usize>>,
}

/// What an airplane may fly beside areas.
struct CandidatesBesideAreas {
    /// The candidates with plans that it may fly: first those that are clear of all areas, each kind in the order of
    /// preference.
    order: Vec<usize>,
    /// The fallbacks of these plans, by candidate.
    clear: Vec<ClearFallbacks>,
}

impl CandidatesBesideAreas {
    /// Returns the plans that an airplane may fly, of those in `preferred`; none where there are no areas around it.
    fn new(
        aircraft: &ShieldedAircraft,
        profiles: &[TurnProfile],
        preferred: impl Iterator<Item = usize>,
        rules: PlanRules,
    ) -> Option<Self> {
        if !aircraft.has_areas() {
            return None;
        }
        let mut clear = Vec::with_capacity(profiles.len());
        for profile in profiles {
            let plan =
                SafeManeuver::new(aircraft.clone(), profile, rules.dtau_s, aircraft.fallback);
            let mut found = aircraft.clear_fallbacks(&plan);
            found.fallbacks.retain(|fallback| rules.ending.allows(*fallback));
            clear.push(found);
        }
        let mut order: Vec<usize> = preferred.filter(|&k| !clear[k].fallbacks.is_empty()).collect();
        // A stable sort.
        order.sort_by_key(|&k| !clear[k].is_clear);
        Some(Self { order, clear })
    }
}

/// Returns the numbers of the candidates that an airplane prefers to its fallback, of as many as it has.
fn preferred_numbers(
    threats: &[Option<CandidateThreats>],
    i: usize,
    candidates: usize,
) -> impl Iterator<Item = usize> + use<'_> {
    let preferred = threats.get(i).and_then(Option::as_ref).map(|threats| &threats.preferred[..]);
    let all = 0..if preferred.is_some() { 0 } else { candidates };
    preferred.unwrap_or_default().iter().copied().chain(all)
}

/// A plan among those of a group.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct PlanKey {
    airplane: u32,
    /// See [`PlanSource::number`].
    source: u32,
    fallback: u16,
}

impl PlanKey {
    fn new(airplane: usize, plan: &SafeManeuver) -> Self {
        let airplane = u32::try_from(airplane).expect("fewer airplanes than fit into memory");
        Self { airplane, source: plan.source.number(), fallback: plan.fallback().into() }
    }
}

// In two words, because most of a dense search is looking up answers.
impl Hash for PlanKey {
    fn hash<H: Hasher>(&self, state: &mut H) {
        state.write_u64(u64::from(self.airplane) << 32 | u64::from(self.source));
        state.write_u16(self.fallback);
    }
}

impl<'a> ShieldSearch<'a> {
    fn new(
        group: &'a [ShieldedAircraft],
        candidates: &'a [Vec<TurnProfile>],
        beside: &'a Surroundings,
        rules: PlanRules,
    ) -> Self {
        let PlanRules { steps, dtau_s, .. } = rules;
        let threats = &beside.threats;
        let fallbacks: Vec<SafeManeuver> = group
            .iter()
            .map(|aircraft| SafeManeuver::on_fallback(aircraft.clone(), steps, dtau_s))
            .collect();
        let common: Vec<Option<SafeManeuver>> = group
            .iter()
            .enumerate()
            .map(|(i, aircraft)| {
                let common = beside.common.get(i)?.as_ref()?;
                Some(common.to_maneuver(aircraft.clone(), dtau_s))
            })
            .collect();
        let plans: Vec<SafeManeuver> = common
            .iter()
            .zip(&fallbacks)
            .map(|(common, fallback)| common.as_ref().unwrap_or(fallback).clone())
            .collect();
        let beside_areas = group
            .iter()
            .zip(candidates)
            .enumerate()
            .map(|(i, (aircraft, profiles))| {
                let preferred = preferred_numbers(threats, i, profiles.len());
                CandidatesBesideAreas::new(aircraft, profiles, preferred, rules)
            })
            .collect();
        let mut by_rank: Vec<usize> = (0..group.len()).collect();
        by_rank.sort_unstable_by_key(|&i| group[i].rank);
        let near = neighbors(group, ShieldedAircraft::plan_reach_m);
        let mut search = Self {
            group,
            candidates,
            rules,
            plans,
            fallbacks,
            common,
            threats,
            beside_areas,
            by_rank,
            near,
            answers: RefCell::default(),
            last_in_the_way: RefCell::default(),
        };
        for i in 0..group.len() {
            let first = search.candidate_numbers(i).next();
            if let Some(first) = first {
                search.plans[i] = search.candidate(i, first);
            }
        }
        search
    }

    /// Returns the numbers of the candidates of an airplane, the one that it flies most readily first.
    fn candidate_numbers(&self, i: usize) -> impl Iterator<Item = usize> + use<'_, 'a> {
        let beside_areas = self.beside_areas[i].as_ref().map(|one| &one.order[..]);
        let all = if beside_areas.is_some() { 0 } else { self.candidates[i].len() };
        let preferred = (all > 0).then(|| preferred_numbers(self.threats, i, all));
        beside_areas.unwrap_or_default().iter().copied().chain(preferred.into_iter().flatten())
    }

    /// Returns the fallbacks that a plan of an airplane may end with, in the order in which they are tried.
    fn fallback_choices(
        &self,
        i: usize,
        plan: &SafeManeuver,
    ) -> impl Iterator<Item = Fallback> + use<'_, 'a> {
        let all = match (&self.beside_areas[i], plan.candidate()) {
            (Some(beside_areas), Some(k)) => &beside_areas.clear[k].fallbacks[..],
            _ => &self.group[i].choices,
        };
        let ending = self.rules.ending;
        all.iter().copied().filter(move |fallback| ending.allows(*fallback))
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
        // Each pair is asked for from both sides.
        if i > j {
            return self.is_compatible_with_plan(j, other, i, plan);
        }
        // The search asks for some of them again and again, and no answer depends on any other plan.
        let asked = [PlanKey::new(i, plan), PlanKey::new(j, other)];
        if let Some(&answer) = self.answers.borrow().get(&asked) {
            return answer;
        }
        // Unless all plans are sure to be flown, either one may fly its fallback instead, or what all compute for it.
        let answer = plan.is_compatible(other)
            && (self.rules.certainty == PlanCertainty::Sure
                || (self.settled_plans(j).all(|settled| plan.is_compatible(settled))
                    && self.settled_plans(i).all(|settled| settled.is_compatible(other))));
        self.answers.borrow_mut().insert(asked, answer);
        answer
    }

    /// Returns an airplane with which a plan of airplane `i` is incompatible, where `plan_of` are the plans of the others.
    fn find_in_the_way<'p>(
        &'p self,
        i: usize,
        plan: &SafeManeuver,
        plan_of: impl Fn(usize) -> &'p SafeManeuver,
    ) -> Option<usize> {
        let is_in_the_way = |j: usize| !self.is_compatible_with_plan(i, plan, j, plan_of(j));
        let key = PlanKey::new(i, plan);
        // Few plans change between two questions, so one answer takes the place of dozens.
        let last = self.last_in_the_way.borrow().get(&key).copied();
        if let Some(j) = last.filter(|&j| is_in_the_way(j)) {
            return Some(j);
        }
        let found = self.near[i].iter().copied().find(|&j| is_in_the_way(j))?;
        self.last_in_the_way.borrow_mut().insert(key, found);
        Some(found)
    }

    /// Returns what an airplane may fly without the consent of others.
    fn settled_plans(&self, i: usize) -> impl Iterator<Item = &SafeManeuver> {
        std::iter::once(&self.fallbacks[i]).chain(&self.common[i])
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
                .unwrap_or_else(|| [(loser, self.settled_plan(loser).clone())].into());
            pairs.retain(|(i, j)| !changes.contains_key(i) && !changes.contains_key(j));
            self.apply(changes);
            pairs.extend(self.incompatible_pairs_with(loser));
        }
    }

    /// Returns what an airplane flies if none of its candidates fits.
    fn settled_plan(&self, i: usize) -> &SafeManeuver {
        self.common[i].as_ref().unwrap_or(&self.fallbacks[i])
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

    /// Returns whether an airplane has to give way in some pair: to one of a higher rank, or to one that flies none
    /// of its candidates, which it never does again.
    fn has_to_give_way(&self, i: usize, pairs: &[(usize, usize)]) -> bool {
        let gives_way_to = |other: usize| {
            self.plans[other].is_settled() || self.group[other].rank > self.group[i].rank
        };
        !self.plans[i].is_settled()
            && pairs
                .iter()
                .any(|&(a, b)| (a == i && gives_way_to(b)) || (b == i && gives_way_to(a)))
    }

    /// Returns a plan with another fallback, with which it is compatible with all present plans.
    fn with_own_fallback(&self, i: usize, plan: &SafeManeuver) -> Option<PlanChanges> {
        self.fallback_choices(i, plan).find_map(|fallback| {
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
        self.fallback_choices(i, plan).find_map(|fallback| {
            let plan = plan.with_fallback(fallback);
            // Those that change nothing are asked first: mostly the question ends with one of them.
            let is_settled = |j: &usize| self.plans[*j].is_settled();
            let in_the_way = |j: &usize| !self.is_compatible(i, &plan, *j);
            if self.near[i].iter().filter(|j| is_settled(j)).any(&in_the_way) {
                return None;
            }
            let mut changes: PlanChanges = [(i, plan.clone())].into();
            for &j in self.near[i].iter().filter(|j| !is_settled(j) && in_the_way(j)) {
                let other = self.fallback_beside(j, &changes)?;
                changes.insert(j, other);
            }
            Some(changes)
        })
    }

    /// Returns the present plan of an airplane with another fallback, with which it is compatible with all, once others
    /// have changed theirs.
    fn fallback_beside(&self, j: usize, changes: &PlanChanges) -> Option<SafeManeuver> {
        self.fallback_choices(j, &self.plans[j]).find_map(|fallback| {
            let plan = self.plans[j].with_fallback(fallback);
            let plan_of = |k: usize| changes.get(&k).unwrap_or(&self.plans[k]);
            let in_the_way = self.find_in_the_way(j, &plan, plan_of);
            in_the_way.is_none().then_some(plan)
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
        self.candidate_numbers(i).find_map(|k| self.with_own_fallback(i, &self.candidate(i, k)))
    }

    /// Returns the plan of an airplane with a candidate, and the stored fallback after it, or beside areas one that is
    /// clear of them.
    fn candidate(&self, i: usize, k: usize) -> SafeManeuver {
        let aircraft = self.group[i].clone();
        let clear = self.beside_areas[i].as_ref().map(|beside_areas| &beside_areas.clear[k]);
        let stored =
            clear.map_or_else(|| self.rules.stored_fallback(&aircraft), |clear| clear.fallbacks[0]);
        let profile = &self.candidates[i][k];
        let source = PlanSource::Candidate(k);
        SafeManeuver::from_source(aircraft, profile, self.rules.dtau_s, source, stored)
    }

    fn is_compatible_with_all(&self, i: usize, plan: &SafeManeuver) -> bool {
        self.find_in_the_way(i, plan, |j| &self.plans[j]).is_none()
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
        let present = self.plans[i].candidate();
        self.candidate_numbers(i)
            .take_while(|&k| Some(k) != present)
            .find_map(|k| self.with_other_fallbacks(i, &self.candidate(i, k)))
    }
}
