//! Common plans: what each airplane of a group flies without a word from the others.
//!
//! All see each other, and know the filed flights. So each computes for all what the method would choose and what the
//! shield would allow, from nothing else than that, and all come to the same. An airplane flies its common plan where
//! the conversations with the others do not lead to a better one: where its radio is dead, it keeps to its way rather
//! than orbit.
//!
//! A common plan keeps apart from those of all others, and from the fallbacks of all, because an airplane whose process
//! has failed stays on its fallback (`PlanCertainty::Mixable`). Its end may be any fallback, not an orbit alone: all know
//! it. After a plan that was agreed on in a conversation, others cannot be sure of the fallback of an airplane, since
//! they may not have heard it. Until it has flown a common plan or its fallback again it has no common plan, and others
//! reckon with both orbits.

use super::percept::{Percept, TrackedState};
use crate::avoid::NonCooperativeAvoidance;
use crate::decide::candidates_for_group;
use crate::flight::KnownAircraft;
use crate::pilot::common_knowledge::{plan_certainty, watched_aircraft};
use crate::shield::{
    CommonPlan, Fallback, OrbitSide, PlanEnding, PlanRules, ShieldDecision, ShieldedAircraft,
    TurnProfile, filter_maneuvers,
};
use crate::world::AirspaceWorld;
use std::sync::{Arc, OnceLock};

/// The common plans of the members of a group, by place; `None` for one that has none, and stays on its fallback.
///
/// Pilots in one process share them, because all would compute the same.
#[derive(Debug, Clone, Default)]
pub(crate) struct CommonPlans(Arc<OnceLock<Vec<Option<CommonPlan>>>>);

impl CommonPlans {
    /// Returns them as an airplane of the group computes them.
    pub(super) fn of_group(
        &self,
        world: &AirspaceWorld,
        percept: &Percept,
    ) -> Vec<Option<CommonPlan>> {
        // Where groups are heard, each pilot may believe in another one, and they share nothing.
        if !world.has_common_plans() {
            return vec![None; percept.group.len()];
        }
        self.0.get_or_init(|| common_plans(world, percept)).clone()
    }
}

/// The profiles that the shield may give to an airplane.
struct Wishes {
    /// Its place in the group.
    place: usize,
    /// Their numbers among those that the method would choose for it.
    allowed: Vec<usize>,
}

/// Computes the common plans of a group from what all of it see.
fn common_plans(world: &AirspaceWorld, percept: &Percept) -> Vec<Option<CommonPlan>> {
    let tracked: Vec<Option<TrackedState>> = percept.group.iter().map(|one| one.tracked).collect();
    if tracked.iter().all(Option::is_none) {
        return vec![None; tracked.len()];
    }
    let group: Vec<KnownAircraft> =
        percept.group.iter().map(|one| one.as_tracked_aircraft()).collect();
    // Nobody sees which conflicts another one resolves.
    let mut resolving = vec![Default::default(); group.len()];
    let non_cooperative = &percept.non_cooperative;
    let candidates =
        candidates_for_group(world, &group, non_cooperative, &mut resolving, percept.cycle);
    let steps = world.timing.points_per_dt();
    let mut aircraft = Vec::new();
    let mut profiles: Vec<Vec<TurnProfile>> = Vec::new();
    let mut wanted = Vec::new();
    for (place, one) in percept.group.iter().enumerate() {
        let seen = watched_aircraft(world, percept, one);
        if tracked[place].is_none() {
            // It may be on either orbit.
            for side in OrbitSide::BOTH {
                let fallback = Fallback::from_side(side);
                aircraft.push(ShieldedAircraft { fallback, ..seen.clone() });
                profiles.push(Vec::new());
                wanted.push(None);
            }
            continue;
        }
        let avoidance = NonCooperativeAvoidance::new(&seen, non_cooperative, world.timing.dtau_s);
        let wishes = &candidates[place].profiles;
        let allowed = avoidance.allowed_profiles(wishes, || TurnProfile::on_fallback(&seen, steps));
        profiles.push(allowed.iter().map(|&k| wishes[k].clone()).collect());
        aircraft.push(seen);
        wanted.push(Some(Wishes { place, allowed }));
    }
    let rules = PlanRules {
        steps,
        dtau_s: world.timing.dtau_s,
        certainty: plan_certainty(world),
        ending: PlanEnding::AnyFallback,
    };
    let mut plans = vec![None; tracked.len()];
    let decisions = filter_maneuvers(&aircraft, &profiles, rules);
    for (k, ShieldDecision { candidate, fallback, .. }) in decisions.into_iter().enumerate() {
        let (Some(Wishes { place, allowed }), Some(candidate)) = (&wanted[k], candidate) else {
            continue;
        };
        let profile = profiles[k][candidate].clone();
        let candidate = allowed[candidate] as u32;
        // Where it moves as on its fallback, nobody could see which of the two it flies.
        if profile != TurnProfile::on_fallback(&aircraft[k], steps) {
            plans[*place] = Some(CommonPlan { candidate, profile, fallback });
        }
    }
    plans
}
