//! Joint choices of fallbacks: a search by enumeration where airplanes that change one at a time end with some that are
//! not apart.
//!
//! A pair is named, because its separation is not guaranteed, only if there is *no* joint choice: none of the fallbacks
//! that the airplanes that enter may choose, and of those that the ones that fly already may take in place of theirs,
//! keeps this pair apart together with all pairs that are not named. [`JointSearch`] decides that for one pair after
//! the other. Each pair that it can keep apart leaves fewer, so what is left at the end can be left out by none of
//! them.
//!
//! The search repairs: it looks for a pair that is not apart, lets one of the two take each of its fallbacks that are
//! apart from those that are decided already, and goes on with the pairs that this brings together. Airplanes that no
//! such pair concerns keep what they have, so it stays near the pair with which it begins, however large the group is.
//! It misses no joint choice, because in each of them the airplane has one of these fallbacks.

use super::fallback::Fallback;
use super::shielded_aircraft::ShieldedAircraft;
use sidestep_kernel::interrupt;
use std::collections::BTreeSet;

/// Largest number of steps of the search for one pair, each of which decides on a fallback of one airplane: about a
/// tenth of a second. In 1,500 dense random groups and in 200 mornings of departures no search came to it
/// (the tests below, and `terminal_tests.rs`).
const MAX_STEPS: u32 = 10_000;
/// Largest number of steps of the searches for all pairs of a group in one cycle: about a second. Only a heap of
/// airplanes within each other's separation comes to it, in which no search finds anything.
const MAX_GROUP_STEPS: u32 = 100_000;
/// Largest number of airplanes that are decided at the same time: a bound on the depth of the recursion.
const MAX_DECIDED: usize = 60;

/// What an airplane may do about its fallback when others enter, or it enters itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum EntryRole {
    /// It enters, and chooses one.
    Enter,
    /// It flies already, and may take another of its choices, as long as it stays apart from all others that fly.
    Yield,
    /// It keeps the one that it has: others reckon with that.
    Keep,
}

/// The result of a search for one pair.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum JointOutcome {
    /// A joint choice was found.
    Found,
    /// There is none.
    None,
    /// Nobody knows: the search has ended at its limit.
    Unknown,
}

/// Whether two fallbacks of a pair stay apart, as far as it was computed.
type PairTable = Vec<Option<bool>>;

/// A search for fallbacks of a group that are pairwise apart.
pub(super) struct JointSearch<'a> {
    group: &'a [ShieldedAircraft],
    /// For each airplane the others from which it is kept apart and that it may come near, by rising number.
    near: &'a [Vec<usize>],
    roles: &'a [EntryRole],
    /// The fallbacks that each may have, the present one first; empty until they are asked for.
    domains: Vec<Vec<Fallback>>,
    /// The place of the fallback in its domain that each has now.
    present: Vec<usize>,
    /// For each airplane and each other near it of a larger number: which of their fallbacks stay apart.
    tables: Vec<Vec<PairTable>>,
    /// Whether the fallback of an airplane is decided, in the search for a pair.
    is_decided: Vec<bool>,
    decided: Vec<usize>,
    /// The pair for which it searches.
    pair: (usize, usize),
    /// Pairs that need not be kept apart in the search for a pair.
    allowed: BTreeSet<(usize, usize)>,
    steps: u32,
    /// See [`MAX_STEPS`].
    max_steps: u32,
    /// Steps that are left of [`MAX_GROUP_STEPS`].
    group_steps_left: u32,
    /// Whether a search has come to a limit.
    is_limited: bool,
}

impl<'a> JointSearch<'a> {
    /// Returns a search that begins with some fallbacks. Those of airplanes that do not enter are the stored ones, which
    /// are apart by the invariant.
    pub(super) fn new(
        group: &'a [ShieldedAircraft],
        near: &'a [Vec<usize>],
        roles: &'a [EntryRole],
        fallbacks: &[Fallback],
    ) -> Self {
        let domains = group
            .iter()
            .zip(roles)
            .zip(fallbacks)
            .map(|((aircraft, role), present)| domain(aircraft, *role, *present))
            .collect();
        Self {
            group,
            near,
            roles,
            domains,
            present: vec![0; group.len()],
            tables: near.iter().map(|others| vec![PairTable::new(); others.len()]).collect(),
            is_decided: vec![false; group.len()],
            decided: Vec::new(),
            pair: (0, 0),
            allowed: BTreeSet::new(),
            steps: 0,
            max_steps: MAX_STEPS,
            group_steps_left: MAX_GROUP_STEPS,
            is_limited: false,
        }
    }

    /// Returns the fallback that an airplane has now.
    pub(super) fn fallback(&self, i: usize) -> Fallback {
        self.domains[i][self.present[i]]
    }

    /// Returns whether two airplanes near each other have fallbacks that are apart now.
    pub(super) fn is_pair_apart(&mut self, (i, j): (usize, usize)) -> bool {
        self.are_apart((i, self.present[i]), (j, self.present[j]))
    }

    /// Looks for a joint choice that keeps a pair apart, and all others but those in `allowed`. The fallbacks that are
    /// found take the place of the present ones.
    pub(super) fn find(
        &mut self,
        pair: (usize, usize),
        allowed: &BTreeSet<(usize, usize)>,
    ) -> JointOutcome {
        self.allowed.clone_from(allowed);
        self.allowed.remove(&pair);
        self.pair = pair;
        self.steps = 0;
        self.max_steps = self.max_steps.min(self.group_steps_left);
        self.is_limited = false;
        let before = self.present.clone();
        let is_found = self.repair();
        self.group_steps_left = self.group_steps_left.saturating_sub(self.steps);
        for i in std::mem::take(&mut self.decided) {
            self.is_decided[i] = false;
        }
        if is_found {
            return JointOutcome::Found;
        }
        self.present = before;
        if self.is_limited { JointOutcome::Unknown } else { JointOutcome::None }
    }

    /// Keeps apart all pairs that have to be, given the fallbacks that are decided; returns whether that is possible.
    fn repair(&mut self) -> bool {
        let Some(next) = self.next_airplane() else { return true };
        if self.steps >= self.max_steps || self.decided.len() >= MAX_DECIDED {
            self.is_limited = true;
            return false;
        }
        let kept = self.present[next];
        for value in self.values_by_conflicts(next) {
            self.steps += 1;
            self.present[next] = value;
            self.is_decided[next] = true;
            self.decided.push(next);
            if self.leaves_values_for_others(next) && self.repair() {
                return true;
            }
            self.decided.pop();
            self.is_decided[next] = false;
            if self.steps >= self.max_steps {
                self.is_limited = true;
                break;
            }
        }
        self.present[next] = kept;
        false
    }

    /// Returns the airplane to decide on next: of those in pairs that are not apart the one that has the fewest fallbacks
    /// left, so that what is impossible shows soon.
    fn next_airplane(&mut self) -> Option<usize> {
        let mut best: Option<(usize, usize)> = None;
        for i in self.candidates() {
            if self.is_decided[i] || !self.is_in_conflict(i) {
                continue;
            }
            let values = self.values_left(i).len();
            if best.is_none_or(|(fewest, _)| values < fewest) {
                best = Some((values, i));
            }
        }
        best.map(|(_, i)| i)
    }

    /// Returns the airplanes that may be in a pair that is not apart: those of the pair with which the search began, and
    /// those near decided ones, because nothing else has changed.
    fn candidates(&self) -> BTreeSet<usize> {
        let near_decided = self.decided.iter().flat_map(|&i| self.near[i].iter().copied());
        near_decided.chain([self.pair.0, self.pair.1]).collect()
    }

    fn is_in_conflict(&mut self, i: usize) -> bool {
        let near = self.near;
        near[i].iter().any(|&j| !self.is_allowed(i, j) && !self.is_pair_apart((i, j)))
    }

    fn is_allowed(&self, i: usize, j: usize) -> bool {
        self.allowed.contains(&(i.min(j), i.max(j)))
    }

    /// Returns the fallbacks of an airplane that are apart from all that are decided.
    fn values_left(&mut self, i: usize) -> Vec<usize> {
        (0..self.domains[i].len()).filter(|&value| self.is_apart_from_decided(i, value)).collect()
    }

    fn is_apart_from_decided(&mut self, i: usize, value: usize) -> bool {
        let near = self.near;
        near[i].iter().all(|&j| {
            !self.is_decided[j]
                || self.is_allowed(i, j)
                || self.are_apart((i, value), (j, self.present[j]))
        })
    }

    /// Returns the same, those first that bring it too near the fewest others as they are now, and then into the fewest
    /// areas.
    fn values_by_conflicts(&mut self, i: usize) -> Vec<usize> {
        let near = self.near;
        let mut rated: Vec<([usize; 2], usize)> = Vec::new();
        for value in self.values_left(i) {
            let is_conflict = |&&j: &&usize| {
                !self.is_allowed(i, j) && !self.are_apart((i, value), (j, self.present[j]))
            };
            let conflicts = near[i].iter().filter(is_conflict).count();
            let area_conflicts = self.group[i].area_conflicts(self.domains[i][value]);
            rated.push(([conflicts, area_conflicts], value));
        }
        // A stable sort: of equal ones that which is preferred, as everywhere.
        rated.sort_by_key(|(conflicts, _)| *conflicts);
        rated.into_iter().map(|(_, value)| value).collect()
    }

    /// Returns whether all others near an airplane that was decided still have a fallback.
    fn leaves_values_for_others(&mut self, decided: usize) -> bool {
        let near = self.near;
        near[decided].iter().all(|&j| {
            self.is_decided[j]
                || (0..self.domains[j].len()).any(|value| self.is_apart_from_decided(j, value))
        })
    }

    /// Returns whether a fallback of an airplane and one of another near it stay apart.
    fn are_apart(&mut self, one: (usize, usize), other: (usize, usize)) -> bool {
        let [(i, of_i), (j, of_j)] = if one.0 < other.0 { [one, other] } else { [other, one] };
        let is_entry = [i, j].iter().any(|&k| self.roles[k] == EntryRole::Enter);
        // By the invariant; with errors of position the two need not be seen apart anew.
        if !is_entry && of_i == 0 && of_j == 0 {
            return true;
        }
        let place = self.near[i].binary_search(&j).expect("the two are near each other");
        let columns = self.domains[j].len();
        let table = &mut self.tables[i][place];
        if table.is_empty() {
            table.resize(self.domains[i].len() * columns, None);
        }
        let entry = &mut table[of_i * columns + of_j];
        if let Some(are_apart) = *entry {
            return are_apart;
        }
        interrupt::check();
        let fallback = self.domains[i][of_i];
        let other_fallback = self.domains[j][of_j];
        let are_apart =
            self.group[i].do_fallbacks_stay_apart(fallback, &self.group[j], other_fallback);
        *entry = Some(are_apart);
        are_apart
    }
}

/// Returns the fallbacks that an airplane may have, the present one first.
fn domain(aircraft: &ShieldedAircraft, role: EntryRole, present: Fallback) -> Vec<Fallback> {
    let mut domain = vec![present];
    if role == EntryRole::Keep {
        return domain;
    }
    for &choice in aircraft.choices.iter().filter(|&&choice| choice != present) {
        // One that flies came under the guarantee beside areas, too, and stays under it.
        if role == EntryRole::Enter || aircraft.is_as_clear_as(choice, aircraft) {
            domain.push(choice);
        }
    }
    domain
}

#[cfg(test)]
mod tests {
    use super::super::change::{EntryFallbacks, entry_fallbacks};
    use super::super::neighbors::neighbors;
    use super::super::tests::aircraft;
    use super::*;
    use proptest::prelude::*;
    use std::sync::Arc;

    /// Airplanes in a space so small that hardly any joint choice is apart. The first `flying` of them fly already.
    fn crowd() -> impl Strategy<Value = (Vec<ShieldedAircraft>, usize)> {
        let place = (-1400.0f64..1400.0, -1400.0f64..1400.0, -3.1f64..3.1, 0.5f64..1.0);
        (prop::collection::vec(place, 2..6), 0usize..4).prop_map(|(places, flying)| {
            let mut group = Vec::new();
            for (i, (x, y, heading_rad, slow)) in places.into_iter().enumerate() {
                let mut one = aircraft(x, y, heading_rad, i as u64);
                if i % 2 == 1 {
                    one.v_m_s *= slow;
                }
                // Five choices each, of all kinds, so that all joint ones can be tried.
                one.choices = Arc::from([0, 1, 2, 5, 8].map(|k| one.choices[k]));
                group.push(one);
            }
            (group, flying)
        })
    }

    /// Stores fallbacks of those that fly already, which are apart; those of which that is impossible enter.
    fn with_stored(
        group: &mut [ShieldedAircraft],
        flying: usize,
        others: EntryRole,
    ) -> Vec<EntryRole> {
        let mut roles = vec![EntryRole::Enter; group.len()];
        for i in 0..flying.min(group.len()) {
            let is_free = |choice: &Fallback, group: &[ShieldedAircraft]| {
                (0..i).filter(|&j| roles[j] != EntryRole::Enter).all(|j| {
                    group[i].do_fallbacks_stay_apart(*choice, &group[j], group[j].fallback)
                })
            };
            let choices = Arc::clone(&group[i].choices);
            if let Some(choice) = choices.iter().find(|choice| is_free(choice, group)) {
                group[i].fallback = *choice;
                roles[i] = others;
            }
        }
        roles
    }

    /// Returns whether some joint choice keeps apart all pairs but those that are allowed to meet, by trying all.
    fn has_joint_choice(
        group: &[ShieldedAircraft],
        roles: &[EntryRole],
        allowed: &BTreeSet<(usize, usize)>,
    ) -> bool {
        let domains: Vec<Vec<Fallback>> = group
            .iter()
            .zip(roles)
            .map(|(one, role)| match role {
                EntryRole::Keep => vec![one.fallback],
                EntryRole::Enter | EntryRole::Yield => one.choices.to_vec(),
            })
            .collect();
        let mut places = vec![0; group.len()];
        loop {
            let is_apart = |(i, j): (usize, usize)| {
                allowed.contains(&(i, j))
                    || group[i].do_fallbacks_stay_apart(
                        domains[i][places[i]],
                        &group[j],
                        domains[j][places[j]],
                    )
            };
            let mut pairs = (0..group.len()).flat_map(|j| (0..j).map(move |i| (i, j)));
            if pairs.all(is_apart) {
                return true;
            }
            let Some(next) = (0..places.len()).find(|&i| places[i] + 1 < domains[i].len()) else {
                return false;
            };
            places[..next].fill(0);
            places[next] += 1;
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(1500))]

        /// No pair is named if there is a joint choice; each that is named is in the way of all joint choices, even where
        /// the other named ones may meet; and all that is not named is apart.
        #[test]
        fn pairs_are_named_if_and_only_if_no_joint_choice_keeps_them_apart(
            (mut group, flying) in crowd(), yields in any::<bool>(),
        ) {
            let others = if yields { EntryRole::Yield } else { EntryRole::Keep };
            let roles = with_stored(&mut group, flying, others);
            let EntryFallbacks { fallbacks, too_close, unproved } = entry_fallbacks(&group, &roles);
            let named: BTreeSet<(usize, usize)> = too_close.into_iter().collect();
            prop_assert!(unproved.is_empty());
            prop_assert_eq!(named.is_empty(), has_joint_choice(&group, &roles, &BTreeSet::new()));
            for pair in &named {
                let mut rest = named.clone();
                rest.remove(pair);
                prop_assert!(!has_joint_choice(&group, &roles, &rest), "{pair:?} of {named:?}");
            }
            for j in 0..group.len() {
                for i in (0..j).filter(|&i| !named.contains(&(i, j))) {
                    prop_assert!(group[i].do_fallbacks_stay_apart(fallbacks[i], &group[j], fallbacks[j]));
                }
                if roles[j] != EntryRole::Enter {
                    prop_assert!(yields || fallbacks[j] == group[j].fallback);
                }
            }
        }
    }

    /// A place in [-1400, 1400] and a heading from a row of numbers that look random.
    fn scattered(k: u32) -> ShieldedAircraft {
        let part = |factor: f64| (f64::from(k) * factor).fract();
        let [x, y] = [part(0.618_034), part(0.754_878)].map(|part| 2800.0 * (part - 0.5));
        aircraft(x, y, 6.2 * (part(0.569_840) - 0.5), k.into())
    }

    #[test]
    fn those_that_fly_make_room_for_one_that_enters() {
        let mut fewer = 0;
        for k in 0..400 {
            let mut group: Vec<_> = (0..4).map(|i| scattered(4 * k + i)).collect();
            let yielding = with_stored(&mut group, 3, EntryRole::Yield);
            let keeping: Vec<EntryRole> = yielding
                .iter()
                .map(|role| match role {
                    EntryRole::Enter => EntryRole::Enter,
                    EntryRole::Yield | EntryRole::Keep => EntryRole::Keep,
                })
                .collect();
            let kept = entry_fallbacks(&group, &keeping);
            let yielded = entry_fallbacks(&group, &yielding);
            assert!(yielded.too_close.len() <= kept.too_close.len(), "{k}");
            fewer += u32::from(yielded.too_close.len() < kept.too_close.len());
        }
        assert!(fewer > 5, "{fewer}");
    }

    #[test]
    fn a_search_that_comes_to_its_limit_says_so() {
        let group: Vec<_> = (0..12).map(scattered).collect();
        let near = neighbors(&group, ShieldedAircraft::fallback_reach_m);
        let roles = vec![EntryRole::Enter; group.len()];
        let fallbacks = vec![Fallback::default(); group.len()];
        let mut search = JointSearch::new(&group, &near, &roles, &fallbacks);
        let mut pairs = near
            .iter()
            .enumerate()
            .flat_map(|(i, others)| others.iter().filter(move |&&j| i < j).map(move |&j| (i, j)));
        let pair = pairs.find(|&(i, j)| !search.is_pair_apart((i, j))).expect("a dense group");
        search.max_steps = 0;
        assert_eq!(search.find(pair, &BTreeSet::new()), JointOutcome::Unknown);
        search.max_steps = MAX_STEPS;
        search.group_steps_left = 0;
        assert_eq!(search.find(pair, &BTreeSet::new()), JointOutcome::Unknown);
        assert!((0..group.len()).all(|i| search.fallback(i) == fallbacks[i]));
    }
}
