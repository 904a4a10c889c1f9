//! Joint choices of plans that keep clear of non-cooperative aircraft.
//!
//! One of these has no choice, and may be anywhere within its reach (`avoid.rs`), so whether a plan is clear of it concerns
//! that plan alone. But plans of others may stand in the way of all clear ones of an airplane, and then a pair with a
//! non-cooperative aircraft would be named because of airplanes that could make room. So before it is, a search tries all
//! joint choices: of each airplane all of its candidates, each with all of its fallbacks, and its stored fallback. Pairs
//! that are kept clear stay so. A pair is named only if *none* keeps it clear, beside all that is not named.
//!
//! It repairs like `joint_fallbacks.rs`, and misses no joint choice for the same reason. Airplanes of which messages may get
//! lost have no such search: each decides by itself there.

use super::{PlanCertainty, SafeManeuver, ShieldSearch};
use sidestep_kernel::EntityId;
use sidestep_kernel::interrupt;
use std::collections::{BTreeMap, BTreeSet};

/// Largest number of steps of the search for one pair, each of which decides on a plan of one airplane.
const MAX_STEPS: u32 = 2_000;
/// Largest number of airplanes that are decided at the same time: a bound on the depth of the recursion.
const MAX_DECIDED: usize = 60;

/// An airplane, by its place, and a non-cooperative aircraft of which its plan is not clear.
pub(super) type Threat = (usize, EntityId);

/// The result of a search for one pair.
enum JointOutcome {
    /// These plans keep it clear.
    Found(Vec<SafeManeuver>),
    /// None do.
    None,
    /// Nobody knows: the search has ended at its limit.
    Unknown,
}

impl ShieldSearch<'_> {
    /// Replaces plans that are not clear of non-cooperative aircraft, as far as a joint choice is. Returns the pairs of which
    /// that is not known.
    pub(super) fn keep_clear(&mut self) -> BTreeSet<Threat> {
        let mut unproved = BTreeSet::new();
        // Where messages may get lost, nobody is sure of what others do.
        if self.threats.is_empty() || self.rules.certainty != PlanCertainty::Sure {
            return unproved;
        }
        let mut present = self.present_threats();
        for threat in present.clone() {
            if !present.contains(&threat) {
                continue;
            }
            let outcome = JointPlans::new(self, threat, &present).find();
            match outcome {
                JointOutcome::Found(plans) => {
                    self.plans = plans;
                    // The same plans may keep others clear as well.
                    present = self.present_threats();
                }
                JointOutcome::None => {}
                JointOutcome::Unknown => {
                    unproved.insert(threat);
                }
            }
        }
        unproved.retain(|threat| present.contains(threat));
        unproved
    }

    fn present_threats(&self) -> BTreeSet<Threat> {
        let of = |i: usize| self.threats_of(i, &self.plans[i]).iter().map(move |&other| (i, other));
        (0..self.plans.len()).flat_map(of).collect()
    }

    /// Returns the non-cooperative aircraft of which a plan of an airplane is not clear.
    fn threats_of(&self, i: usize, plan: &SafeManeuver) -> &[EntityId] {
        let Some(threats) = self.threats.get(i).and_then(Option::as_ref) else { return &[] };
        match plan.candidate() {
            Some(k) => &threats.of_candidates[k],
            None => &threats.of_fallback,
        }
    }

    /// Returns the numbers of all candidates of an airplane, first those that it prefers to its fallback.
    fn all_candidate_numbers(&self, i: usize) -> Vec<usize> {
        let preferred: Vec<usize> = self.candidate_numbers(i).collect();
        let beside_areas = self.beside_areas[i].as_ref();
        let may_fly = |k: usize| beside_areas.is_none_or(|one| !one.clear[k].fallbacks.is_empty());
        let others = (0..self.candidates[i].len()).filter(|k| !preferred.contains(k));
        let others: Vec<usize> = others.filter(|&k| may_fly(k)).collect();
        [preferred, others].concat()
    }
}

/// A search for plans of a group that are pairwise compatible, and clear of non-cooperative aircraft.
struct JointPlans<'s, 'a> {
    search: &'s ShieldSearch<'a>,
    /// The pair for which it searches.
    threat: Threat,
    /// Pairs that need not be kept clear.
    allowed: BTreeSet<Threat>,
    plans: Vec<SafeManeuver>,
    /// All plans of an airplane that keep clear of what they have to; of those that were asked for.
    domains: BTreeMap<usize, Vec<SafeManeuver>>,
    is_decided: Vec<bool>,
    decided: Vec<usize>,
    steps: u32,
    /// Whether it has come to a limit.
    is_limited: bool,
}

impl<'s, 'a> JointPlans<'s, 'a> {
    /// Returns the search for a pair, that may leave the others of `present` as they are.
    fn new(search: &'s ShieldSearch<'a>, threat: Threat, present: &BTreeSet<Threat>) -> Self {
        let mut allowed = present.clone();
        allowed.remove(&threat);
        Self {
            search,
            threat,
            allowed,
            plans: search.plans.clone(),
            domains: BTreeMap::new(),
            is_decided: vec![false; search.plans.len()],
            decided: Vec::new(),
            steps: 0,
            is_limited: false,
        }
    }

    fn find(mut self) -> JointOutcome {
        if self.repair() {
            JointOutcome::Found(self.plans)
        } else if self.is_limited {
            JointOutcome::Unknown
        } else {
            JointOutcome::None
        }
    }

    /// Keeps clear and compatible what has to be, given the plans that are decided; returns whether that is possible.
    fn repair(&mut self) -> bool {
        let Some(next) = self.next_airplane() else { return true };
        if self.steps >= MAX_STEPS || self.decided.len() >= MAX_DECIDED {
            self.is_limited = true;
            return false;
        }
        let kept = self.plans[next].clone();
        for plan in self.plans_by_conflicts(next) {
            self.steps += 1;
            self.plans[next] = plan;
            self.is_decided[next] = true;
            self.decided.push(next);
            if self.leaves_plans_for_others(next) && self.repair() {
                return true;
            }
            self.decided.pop();
            self.is_decided[next] = false;
            if self.steps >= MAX_STEPS {
                self.is_limited = true;
                break;
            }
        }
        self.plans[next] = kept;
        false
    }

    /// Returns the airplane to decide on next: of those whose present plan cannot stay beside the others the one that has
    /// the fewest plans left, so that what is impossible shows soon.
    fn next_airplane(&mut self) -> Option<usize> {
        let near_decided = self.decided.iter().flat_map(|&i| self.search.near[i].iter().copied());
        let candidates: BTreeSet<usize> = near_decided.chain([self.threat.0]).collect();
        let mut best: Option<(usize, usize)> = None;
        for i in candidates {
            if self.is_decided[i] || !self.is_in_conflict(i) {
                continue;
            }
            let left = self.count_plans_left(i);
            if best.is_none_or(|(fewest, _)| left < fewest) {
                best = Some((left, i));
            }
        }
        best.map(|(_, i)| i)
    }

    fn is_in_conflict(&self, i: usize) -> bool {
        let plan = &self.plans[i];
        !self.is_clear(i, plan)
            || self.search.near[i].iter().any(|&j| !self.is_compatible_with_present(i, plan, j))
    }

    /// Returns whether a plan is clear of all that it has to be clear of.
    fn is_clear(&self, i: usize, plan: &SafeManeuver) -> bool {
        let threats = self.search.threats_of(i, plan);
        threats.iter().all(|&other| self.allowed.contains(&(i, other)))
    }

    fn is_compatible_with_present(&self, i: usize, plan: &SafeManeuver, j: usize) -> bool {
        self.search.is_compatible_with_plan(i, plan, j, &self.plans[j])
    }

    fn is_compatible_with_decided(&self, i: usize, plan: &SafeManeuver) -> bool {
        let mut near = self.search.near[i].iter();
        near.all(|&j| !self.is_decided[j] || self.is_compatible_with_present(i, plan, j))
    }

    /// Computes the plans among which an airplane has a choice.
    fn find_domain(&mut self, i: usize) {
        if self.domains.contains_key(&i) {
            return;
        }
        interrupt::check();
        let search = self.search;
        let mut domain = Vec::new();
        for k in search.all_candidate_numbers(i) {
            let plan = search.candidate(i, k);
            if self.is_clear(i, &plan) {
                let fallbacks = search.fallback_choices(i, &plan);
                domain.extend(fallbacks.map(|fallback| plan.with_fallback(fallback)));
            }
        }
        let fallback = &search.fallbacks[i];
        if self.is_clear(i, fallback) {
            domain.push(fallback.clone());
        }
        self.domains.insert(i, domain);
    }

    fn plans_left(&mut self, i: usize) -> impl Iterator<Item = &SafeManeuver> {
        self.find_domain(i);
        let this = &*self;
        this.domains[&i].iter().filter(move |plan| this.is_compatible_with_decided(i, plan))
    }

    fn count_plans_left(&mut self, i: usize) -> usize {
        self.plans_left(i).count()
    }

    /// Returns the plans of an airplane that are compatible with all that are decided, first those that are compatible with
    /// most of the others as they are now.
    fn plans_by_conflicts(&mut self, i: usize) -> Vec<SafeManeuver> {
        let left: Vec<SafeManeuver> = self.plans_left(i).cloned().collect();
        let mut rated = Vec::with_capacity(left.len());
        for plan in left {
            let near = self.search.near[i].iter();
            let conflicts = near.filter(|&&j| !self.is_compatible_with_present(i, &plan, j));
            rated.push((conflicts.count(), plan));
        }
        // A stable sort: of equal ones that which is preferred, as everywhere.
        rated.sort_by_key(|(conflicts, _)| *conflicts);
        rated.into_iter().map(|(_, plan)| plan).collect()
    }

    /// Returns whether all others near an airplane that was decided still have a plan.
    fn leaves_plans_for_others(&mut self, decided: usize) -> bool {
        let near = &self.search.near[decided];
        near.iter().all(|&j| self.is_decided[j] || self.plans_left(j).next().is_some())
    }
}

#[cfg(test)]
mod tests {
    use super::super::{CandidateThreats, Surroundings, filter_maneuvers_beside};
    use super::*;
    use crate::shield::tests::{aircraft, rules, with_fallbacks};
    use crate::shield::{ShieldDecision, ShieldedAircraft, TurnProfile};
    use proptest::prelude::*;
    use std::sync::Arc;

    const STEPS: usize = 5;
    const DTAU_S: f64 = 1.0;
    /// Two non-cooperative aircraft.
    const OTHERS: [EntityId; 2] = [100, 101];

    /// An airplane, its candidates, and what those two make of them: a bit for each, of each candidate and of its fallback.
    type Case = (ShieldedAircraft, Vec<TurnProfile>, Vec<u8>);

    /// Airplanes so near each other that they stand in each other's way.
    fn crowd() -> impl Strategy<Value = Vec<Case>> {
        let place = (-1500.0f64..1500.0, -1500.0f64..1500.0, -3.1f64..3.1);
        let wishes = prop::collection::vec(-1.0f64..1.0, 2);
        let threats = prop::collection::vec(0u8..4, 3);
        let one = (place, wishes, threats);
        prop::collection::vec(one, 2..5).prop_map(|all| {
            let mut cases = Vec::new();
            for (k, ((x, y, heading_rad), wishes, threats)) in all.into_iter().enumerate() {
                let mut one = aircraft(x, y, heading_rad, k as u64);
                one.choices = Arc::from([0, 1, 5].map(|k| one.choices[k]));
                let profile = |part: f64| TurnProfile {
                    omegas_rad_s: vec![part * one.omega_max_rad_s; STEPS],
                };
                let profiles = wishes.into_iter().map(profile).collect();
                cases.push((one, profiles, threats));
            }
            cases
        })
    }

    fn others_of(bits: u8) -> Vec<EntityId> {
        (0..2).filter(|k| bits >> k & 1 == 1).map(|k| OTHERS[k]).collect()
    }

    fn candidate_threats(bits: &[u8]) -> CandidateThreats {
        let (of_fallback, of_candidates) = bits.split_last().expect("that of the fallback");
        CandidateThreats {
            preferred: (0..of_candidates.len())
                .filter(|&k| of_candidates[k].count_ones() < of_fallback.count_ones().max(1))
                .collect(),
            of_candidates: of_candidates.iter().map(|bits| others_of(*bits)).collect(),
            of_fallback: others_of(*of_fallback),
        }
    }

    /// All that an airplane may fly, with the aircraft of which it is not clear.
    fn all_plans((aircraft, profiles, bits): &Case) -> Vec<(SafeManeuver, Vec<EntityId>)> {
        let mut plans = Vec::new();
        for (profile, bits) in profiles.iter().zip(bits) {
            for &fallback in aircraft.choices.iter() {
                let plan = SafeManeuver::new(aircraft.clone(), profile, DTAU_S, fallback);
                plans.push((plan, others_of(*bits)));
            }
        }
        let fallback = SafeManeuver::on_fallback(aircraft.clone(), STEPS, DTAU_S);
        plans.push((fallback, others_of(bits[profiles.len()])));
        plans
    }

    /// Returns whether some joint choice keeps all clear but the pairs that are allowed, by trying all.
    fn has_joint_choice(
        plans: &[Vec<(SafeManeuver, Vec<EntityId>)>],
        allowed: &BTreeSet<Threat>,
        chosen: &mut Vec<usize>,
    ) -> bool {
        let i = chosen.len();
        if i == plans.len() {
            return true;
        }
        (0..plans[i].len()).any(|k| {
            let (plan, others) = &plans[i][k];
            let is_clear = others.iter().all(|&other| allowed.contains(&(i, other)));
            let mut before = chosen.iter().enumerate();
            if !is_clear || !before.all(|(j, &of_j)| plan.is_compatible(&plans[j][of_j].0)) {
                return false;
            }
            chosen.push(k);
            let is_found = has_joint_choice(plans, allowed, chosen);
            chosen.pop();
            is_found
        })
    }

    fn flown(case: &Case, decision: &ShieldDecision) -> (SafeManeuver, Vec<EntityId>) {
        let (aircraft, profiles, bits) = case;
        match decision.candidate {
            Some(k) => {
                let plan =
                    SafeManeuver::new(aircraft.clone(), &profiles[k], DTAU_S, decision.fallback);
                (plan, others_of(bits[k]))
            }
            None => {
                let plan = SafeManeuver::on_fallback(aircraft.clone(), STEPS, DTAU_S);
                (plan, others_of(bits[profiles.len()]))
            }
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(400))]

        /// A pair with a non-cooperative aircraft is named if and only if it is in the way of all joint choices, even where
        /// the other named ones may be; and what is flown is compatible.
        #[test]
        fn pairs_with_intruders_are_named_if_and_only_if_no_joint_choice_of_plans_is_clear(
            cases in crowd(),
        ) {
            let all: Vec<ShieldedAircraft> = cases.iter().map(|(one, ..)| one.clone()).collect();
            let group = with_fallbacks(all);
            let mut cases = cases;
            cases.retain(|(one, ..)| group.iter().any(|kept| kept.id == one.id));
            for (case, one) in cases.iter_mut().zip(&group) {
                case.0 = one.clone();
            }
            let candidates: Vec<Vec<TurnProfile>> =
                cases.iter().map(|(_, profiles, _)| profiles.clone()).collect();
            let threats = cases.iter().map(|(.., bits)| Some(candidate_threats(bits))).collect();
            let beside = Surroundings { threats, ..Surroundings::default() };
            let decisions =
                filter_maneuvers_beside(&group, &candidates, &beside, rules(PlanCertainty::Sure));
            let flown: Vec<_> =
                cases.iter().zip(&decisions).map(|(case, decision)| flown(case, decision)).collect();
            let mut named: BTreeSet<Threat> = BTreeSet::new();
            for (i, (plan, others)) in flown.iter().enumerate() {
                prop_assert!(decisions[i].unproved_threat.is_none());
                prop_assert!(flown[..i].iter().all(|(other, _)| plan.is_compatible(other)));
                named.extend(others.iter().map(|&other| (i, other)));
            }
            let plans: Vec<_> = cases.iter().map(all_plans).collect();
            let is_possible = |allowed: &BTreeSet<Threat>| has_joint_choice(&plans, allowed, &mut Vec::new());
            prop_assert_eq!(named.is_empty(), is_possible(&BTreeSet::new()));
            for pair in &named {
                let mut rest = named.clone();
                rest.remove(pair);
                prop_assert!(!is_possible(&rest), "{pair:?} of {named:?}");
            }
        }
    }
}
