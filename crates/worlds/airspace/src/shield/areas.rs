//! Areas under the shield: plans that keep clear of them.
//!
//! Whether a plan keeps clear of an area concerns its airplane alone, so it is settled before plans are compared: of each
//! candidate only the fallbacks are left after which the whole plan is clear.
//!
//! **Areas that do not move relative to the air.** A plan is *clear* of one if it keeps out of it (or inside of one of kind
//! `in`) during `dt`, and on the fallback forever after that, as long as the area lasts. Of one that begins later the
//! fallback has to keep clear from then on, so that an airplane may be in it before as long as some fallback leads out in time
//! (`world/later_areas.rs`). *Invariant:* the stored fallback of an airplane is clear of each such area,
//! unless it is exempt from it. It is kept as the one about pairs: all plans are clear, and the fallback is itself one. So
//! an airplane that is not exempt never enters an area. It is exempt from an area as long as its stored fallback is not
//! clear of it, and so it can become exempt only where it enters, or other rules begin; from then on its plans may come to
//! the area no sooner than its stored fallback. It is reported (`area-exempt`) if its first fallback is not clear as plans
//! have to be, and once its fallback is clear, the
//! invariant holds for good. No message says so: all that know a fallback know whether it is clear.
//!
//! Orders keep that: a new speed is accepted only with a fallback that is as clear, and levels are changed only as far as
//! an airplane has a fallback that is clear of the areas on them.
//!
//! **Areas that move relative to the air**: weather cells, and in a wind all others. No fallback is clear of them forever:
//! an orbit does not get out of the way. Plans are clear of one if they are for as long as the shield looks ahead: a `dt`,
//! the longest way to an orbit, and one turn. Where an airplane has no such plan, it may fly those that come to the area no
//! sooner than its stored fallback. That proves less, which is reported: an airplane that is about to enter an area within
//! `dt` is named with it before (`area-exempt`). On a path that is clear during `dt` it does not enter it in that time,
//! and if the path that is flown is not clear, it is named.
//!
//! **Numbers.** New plans keep the bound on errors and [`PLAN_MARGIN_M`] from borders, as they are seen. A stored fallback
//! is then farther than that, less twice the bound, wherever it is seen later; so it counts as not clear only if it comes
//! to be beyond the border by more than the bound.

use super::fallback::Fallback;
use super::safe_maneuver::SafeManeuver;
use super::shielded_aircraft::ShieldedAircraft;
use crate::areas::{AREA_TOLERANCE_M, LocalArea};

/// Meters that new plans keep from borders, beside the bound on errors: more than [`STORED_MARGIN_M`] by more than what is
/// rounded and the tolerance with which paths are found clear.
const PLAN_MARGIN_M: f64 = STORED_MARGIN_M + AREA_TOLERANCE_M + 0.1;
/// Meters that a stored fallback has to keep from borders, less the bound on errors.
const STORED_MARGIN_M: f64 = 0.1;

/// The fallbacks after which a candidate may be flown.
#[derive(Debug, Clone, Default)]
pub(super) struct ClearFallbacks {
    /// Whether these are clear of all areas as far as the shield looks ahead.
    pub(super) is_clear: bool,
    /// The stored one first, if it is one of them.
    pub(super) fallbacks: Vec<Fallback>,
}

impl ShieldedAircraft {
    /// Returns the areas near it that are on its levels.
    pub(super) fn areas_on_levels(&self) -> impl Iterator<Item = &LocalArea> {
        let all = self.areas.as_deref().unwrap_or_default();
        all.iter().filter(|area| area.is_on_levels(&self.levels))
    }

    /// Returns whether there are areas of which its plans have to keep clear.
    pub(super) fn has_areas(&self) -> bool {
        self.areas_on_levels().next().is_some()
    }

    /// Returns the distance in meters that its new plans keep from borders.
    fn plan_margin_m(&self) -> f64 {
        self.error_m + PLAN_MARGIN_M
    }

    /// Returns when an airplane on its stored fallback comes to an area, in seconds from now; infinite for never.
    pub(crate) fn stored_conflict_s(&self, area: &LocalArea) -> f64 {
        let path = self.fallback_path(self.fallback);
        area.conflict_s(path.pieces(0.0), STORED_MARGIN_M - self.error_m)
    }

    /// Returns the same for a fallback that it is to store anew.
    fn fallback_conflict_s(&self, fallback: Fallback, area: &LocalArea) -> f64 {
        area.conflict_s(self.fallback_path(fallback).pieces(0.0), self.plan_margin_m())
    }

    /// Returns the number of areas on its levels of which a fallback that it is to store anew is not clear.
    pub(super) fn area_conflicts(&self, fallback: Fallback) -> usize {
        self.unclear_areas(fallback).count()
    }

    /// Returns the numbers of these areas.
    pub(crate) fn unclear_areas(&self, fallback: Fallback) -> impl Iterator<Item = u32> {
        let areas = self.areas_on_levels();
        areas.filter(move |area| !self.is_fallback_clear(fallback, area)).map(|area| area.number)
    }

    /// Returns whether a fallback comes to the areas on its levels no sooner than the stored one of the airplane as it was.
    pub(super) fn is_as_clear_as(&self, fallback: Fallback, before: &Self) -> bool {
        self.areas_on_levels().all(|area| {
            let conflict_s = self.fallback_conflict_s(fallback, area);
            conflict_s == f64::INFINITY
                || (area.is_on_levels(&before.levels)
                    && conflict_s >= before.stored_conflict_s(area))
        })
    }

    /// Returns whether a fallback is clear of an area.
    pub(super) fn is_fallback_clear(&self, fallback: Fallback, area: &LocalArea) -> bool {
        self.fallback_conflict_s(fallback, area) == f64::INFINITY
    }

    /// Returns the fallbacks after which it may fly a plan's motion.
    pub(super) fn clear_fallbacks(&self, plan: &SafeManeuver) -> ClearFallbacks {
        let required_s: Vec<f64> =
            self.areas_on_levels().map(|area| self.stored_conflict_s(area)).collect();
        let is_exempt = required_s.iter().any(|conflict_s| *conflict_s < f64::INFINITY);
        let mut clear = Vec::new();
        let mut as_clear = Vec::new();
        let stored = self.fallback;
        let others = self.choices.iter().copied().filter(|choice| *choice != stored);
        for fallback in [stored].into_iter().chain(others) {
            let plan = plan.with_fallback(fallback);
            let conflicts_s: Vec<f64> = self
                .areas_on_levels()
                .map(|area| area.conflict_s(plan.pieces(), self.plan_margin_m()))
                .collect();
            if conflicts_s.iter().all(|conflict_s| *conflict_s == f64::INFINITY) {
                clear.push(fallback);
            } else if is_exempt
                && conflicts_s
                    .iter()
                    .zip(&required_s)
                    .all(|(conflict_s, required_s)| conflict_s >= required_s)
            {
                as_clear.push(fallback);
            }
        }
        let is_clear = !clear.is_empty();
        ClearFallbacks { is_clear, fallbacks: if is_clear { clear } else { as_clear } }
    }

    /// Returns the numbers of the areas that it may enter within `dt` on the motion of a plan, unless it is there already.
    pub(crate) fn areas_entered_within_dt(&self, plan: &SafeManeuver) -> Vec<u32> {
        let mut entered = Vec::new();
        for area in self.areas_on_levels() {
            // It keeps clear of it by the invariant.
            if self.stored_conflict_s(area) == f64::INFINITY {
                continue;
            }
            let conflict_s = area.conflict_s(plan.motion_pieces(), self.error_m);
            let is_there = area.lasts_at(0.0) && area.clearance_m(self.local_pose().at, 0.0) < 0.0;
            if conflict_s < f64::INFINITY && !is_there {
                entered.push(area.number);
            }
        }
        entered
    }
}
