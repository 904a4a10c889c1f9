//! Fallbacks of airplanes that enter, or that are about to change speed or level, and how far they may change that.

use super::drift::AirDrift;
use super::fallback::Fallback;
use super::joint_fallbacks::{EntryRole, JointOutcome, JointSearch};
use super::neighbors::neighbors;
use super::shielded_aircraft::{MARGIN_M, ShieldedAircraft};
use crate::flight::FlightLevelRange;
use std::collections::BTreeSet;

/// Meters by which an airplane may climb or descend farther than was computed, by what is rounded. The difference of
/// altitude that keeps levels apart is less than the scenario's by twice as much, so that levels that are apart
/// nominally do not meet.
const CLIMB_ROUNDING_M: f64 = 5e-7;

/// Fallbacks of a group of which some airplanes enter.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct EntryFallbacks {
    /// The fallback of each airplane.
    pub(crate) fallbacks: Vec<Fallback>,
    /// The pairs that no joint choice of fallbacks keeps apart beside all others: they are too close.
    pub(crate) too_close: Vec<(usize, usize)>,
    /// Those of them for which the search has come to its limit, so that there may be a joint choice.
    pub(crate) unproved: Vec<(usize, usize)>,
}

/// Returns first fallbacks out of `choices` that are pairwise apart, as far as there are any.
pub(crate) fn first_fallbacks(group: &[ShieldedAircraft]) -> EntryFallbacks {
    entry_fallbacks(group, &vec![EntryRole::Enter; group.len()])
}

/// Returns the same for airplanes some of which have fallbacks already, with the role of each. Only pairs with one that
/// enters are reported.
pub(crate) fn entry_fallbacks(group: &[ShieldedAircraft], roles: &[EntryRole]) -> EntryFallbacks {
    let near = neighbors(group, ShieldedAircraft::fallback_reach_m);
    let enters = |i: usize| roles[i] == EntryRole::Enter;
    let fallbacks = descend(group, &near, &enters);
    let mut too_close = BTreeSet::new();
    for (i, others) in near.iter().enumerate() {
        for &j in others.iter().filter(|&&j| i < j && (enters(i) || enters(j))) {
            if !group[i].do_fallbacks_stay_apart(fallbacks[i], &group[j], fallbacks[j]) {
                too_close.insert((i, j));
            }
        }
    }
    if too_close.is_empty() {
        return EntryFallbacks { fallbacks, too_close: Vec::new(), unproved: Vec::new() };
    }
    let mut search = JointSearch::new(group, &near, roles, &fallbacks);
    let mut unproved = Vec::new();
    for pair in too_close.clone() {
        if search.is_pair_apart(pair) {
            continue;
        }
        match search.find(pair, &too_close) {
            // The same choice may keep others apart as well.
            JointOutcome::Found => too_close.retain(|&pair| !search.is_pair_apart(pair)),
            JointOutcome::None => {}
            JointOutcome::Unknown => unproved.push(pair),
        }
    }
    unproved.retain(|pair| too_close.contains(pair));
    let fallbacks = (0..group.len()).map(|i| search.fallback(i)).collect();
    EntryFallbacks { fallbacks, too_close: too_close.into_iter().collect(), unproved }
}

/// Returns fallbacks of a group that has the fewest conflicts that changes of one airplane at a time lead to. That
/// nearly always is none, and takes no search.
fn descend(
    group: &[ShieldedAircraft],
    near: &[Vec<usize>],
    enters: &impl Fn(usize) -> bool,
) -> Vec<Fallback> {
    let mut chosen: Vec<Fallback> = Vec::with_capacity(group.len());
    for (i, aircraft) in group.iter().enumerate() {
        chosen.push(if enters(i) { aircraft.entry_fallback() } else { aircraft.fallback });
    }
    let stay_apart = |(i, of_i): (usize, Fallback), (j, of_j): (usize, Fallback)| {
        group[i].do_fallbacks_stay_apart(of_i, &group[j], of_j)
    };
    let count_conflicts = |chosen: &[Fallback], i: usize, fallback: Fallback| {
        let too_close = near[i].iter().filter(|&&j| !stay_apart((i, fallback), (j, chosen[j])));
        too_close.count() + group[i].area_conflicts(fallback)
    };
    // An airplane with fewer conflicts on another fallback changes over. Conflicts only decrease, so this
    // ends.
    let mut has_changed = true;
    while has_changed {
        has_changed = false;
        for i in (0..chosen.len()).filter(|&i| enters(i)) {
            let present = count_conflicts(&chosen, i, chosen[i]);
            let best = group[i]
                .choices
                .iter()
                .map(|&fallback| (count_conflicts(&chosen, i, fallback), fallback))
                .min_by_key(|(conflicts, _)| *conflicts);
            if let Some((conflicts, fallback)) = best
                && conflicts < present
            {
                chosen[i] = fallback;
                has_changed = true;
            }
        }
    }
    chosen
}

/// Returns the fallback out of `choices` with which an airplane that is about to fly as `changed` is apart from
/// the stored fallbacks of others, and as clear of areas as `before`, if there is one; preferably the stored one.
pub(crate) fn safe_fallback(
    changed: &ShieldedAircraft,
    before: &ShieldedAircraft,
    others: impl Iterator<Item = ShieldedAircraft>,
) -> Option<Fallback> {
    let others: Vec<ShieldedAircraft> =
        others.filter(|other| changed.is_protected_from(other)).collect();
    stored_first(changed).find(|&fallback| {
        changed.is_as_clear_as(fallback, before)
            && others
                .iter()
                .all(|other| changed.do_fallbacks_stay_apart(fallback, other, other.fallback))
    })
}

/// Returns the stored fallback of an airplane, and then all other choices.
fn stored_first(aircraft: &ShieldedAircraft) -> impl Iterator<Item = Fallback> {
    let stored = aircraft.fallback;
    [stored]
        .into_iter()
        .chain(aircraft.choices.iter().copied().filter(move |&choice| choice != stored))
}

/// Returns the altitude in meters, between its own and `to_m`, to which an airplane may change its level, and the
/// fallback out of `choices` that is then apart from the stored ones of all others whose levels it meets: the one that
/// lets it go farthest, preferably the stored one. `limit_m` is how far it may go with a fallback whatever these others
/// do.
///
/// The shield keeps it apart from those whose levels it is on already, so it can always stay where it is.
///
/// `drift` is how its air moves if it comes to an altitude by the end of this `dt`. Where that differs from level to level,
/// a level short of those in the way is one in another wind, in which its fallback has to be apart anew.
pub(crate) fn next_altitude(
    changing: &ShieldedAircraft,
    to_m: f64,
    others: &[ShieldedAircraft],
    drift: impl Fn(f64) -> AirDrift,
    limit_m: impl Fn(Fallback) -> f64,
) -> (f64, Fallback) {
    let from_m = changing.levels.low_m;
    let whole = LevelChange::new(changing, to_m, drift(to_m), others);
    let altitude_m = |fallback: Fallback| {
        let mut free_m = whole.free_altitude_m(fallback, limit_m(fallback))?;
        let mut drift_m_s = whole.passing.drift;
        // Each time it stops short of more of the others, or goes where it has been found free, so this ends.
        while free_m != from_m && drift(free_m) != drift_m_s {
            drift_m_s = drift(free_m);
            let shorter = LevelChange::new(changing, free_m, drift_m_s, others);
            free_m = shorter.free_altitude_m(fallback, free_m)?;
        }
        Some(free_m)
    };
    let mut best = (from_m, changing.fallback);
    for fallback in stored_first(changing) {
        if let Some(free_m) = altitude_m(fallback)
            && (free_m - from_m).abs() > (best.0 - from_m).abs() + MARGIN_M
        {
            best = (free_m, fallback);
        }
        if best.0 == to_m {
            break;
        }
    }
    best
}
/// A change of level in one `dt`.
struct LevelChange<'a> {
    /// The airplane before it.
    changing: &'a ShieldedAircraft,
    /// The airplane on all levels that it passes, in the winds that it comes to.
    passing: ShieldedAircraft,
    /// The others whose levels it meets.
    met: Vec<&'a ShieldedAircraft>,
}

impl<'a> LevelChange<'a> {
    /// Returns the change to an altitude, where the air moves like that.
    fn new(
        changing: &'a ShieldedAircraft,
        to_m: f64,
        drift: AirDrift,
        others: &'a [ShieldedAircraft],
    ) -> Self {
        // Between two `dt` it is on one level.
        let from_m = changing.levels.low_m;
        // In steps of `dtau` it may come out beyond `to_m` by what is rounded.
        let beyond_m = to_m + CLIMB_ROUNDING_M * (to_m - from_m).signum();
        let levels = FlightLevelRange::between(from_m, beyond_m);
        let passing = ShieldedAircraft { levels, drift, ..changing.clone() };
        let met = others.iter().filter(|other| passing.is_protected_from(other)).collect();
        Self { changing, passing, met }
    }

    /// Returns the altitude up to which it may go with a fallback, and at most to `limit_m`; `None` where it would lose the
    /// fallback that keeps it apart from those on its own level.
    fn free_altitude_m(&self, fallback: Fallback, limit_m: f64) -> Option<f64> {
        let Self { changing, passing, met, .. } = self;
        let from_m = changing.levels.low_m;
        let mut free_m = limit_m;
        for area in passing.areas_on_levels() {
            let is_met_now = area.is_on_levels(&changing.levels);
            // By the invariant; and where it is exempt, a change of level brings it no nearer.
            let is_kept_clear = is_met_now && fallback == changing.fallback;
            if is_kept_clear || passing.is_fallback_clear(fallback, area) {
                continue;
            }
            if is_met_now {
                return None;
            }
            free_m = altitude_short_of(area.levels(), 0.0, from_m, free_m);
        }
        let stays_in_wind = passing.drift == changing.drift;
        for &other in met {
            let is_met_now = changing.is_protected_from(other);
            // By the invariant; with errors of position the two need not be seen apart anew.
            let is_kept_apart = is_met_now && stays_in_wind && fallback == changing.fallback;
            if is_kept_apart || passing.do_fallbacks_stay_apart(fallback, other, other.fallback) {
                continue;
            }
            if is_met_now {
                return None;
            }
            let vertical_m = passing.vertical_m.max(other.vertical_m);
            free_m = altitude_short_of(other.levels, vertical_m, from_m, free_m);
        }
        Some(free_m)
    }
}

/// Returns the altitude in meters, between `from_m` and `to_m`, up to which a change of level stays off the levels of
/// another airplane: `vertical_m` from them.
pub(crate) fn altitude_short_of(
    levels: FlightLevelRange,
    vertical_m: f64,
    from_m: f64,
    to_m: f64,
) -> f64 {
    // By a margin, so that rounding never makes them meet.
    let gap_m = vertical_m + MARGIN_M;
    if to_m >= from_m {
        (levels.low_m - gap_m).clamp(from_m, to_m)
    } else {
        (levels.high_m + gap_m).clamp(to_m, from_m)
    }
}
