//! The shield: a filter that provably keeps airplanes apart.
//!
//! It stands between any method and the airplanes. Every airplane stores a *fallback* that it can
//! fly forever: an orbit to the left or to the right, or a turn, straight flight, and then an orbit (`fallback.rs`).
//! Level flight straight on is what passes another airplane, or flies beside it; the orbit keeps it within reach.
//!
//! **Invariant.** The stored fallbacks of any two airplanes that are not *exempt* as a pair are at
//! least `R` apart, from now on and for all time, unless the two are on levels that do not meet.
//!
//! Each `dt` every airplane is given a *plan*: some turn rates for `dt`, and then a fallback from where those
//! end. Plans are *compatible* when they stay `R` apart during `dt` and on the fallbacks forever
//! after it, or when the pair need not be kept apart: it is exempt, or the levels that the two keep
//! or pass do not meet. [`filter_maneuvers`] assigns plans that are pairwise compatible:
//!
//! 1. *Start.* If the fallbacks are apart, staying on them for `dt` and forever after is a plan for
//!    each, and these plans are pairwise compatible: they are the motions of which the invariant
//!    speaks. So an assignment of compatible plans exists.
//! 2. *Search.* Each airplane starts with the plan that the method proposes. While some pair is
//!    not compatible, one of the two, the one with the lower rank unless it is on its fallback already, takes another
//!    plan that is compatible with all present ones, if others, too, may end with other fallbacks that are compatible
//!    with all; or else it stays on its fallback. The first lowers the number of
//!    incompatible pairs, the second raises the number of airplanes on fallbacks, and none leaves a fallback during
//!    the search, so it ends. It can only end without an incompatible pair, because two airplanes on fallbacks are
//!    compatible by the invariant.
//! 3. *Better again.* An airplane that does not fly its first candidate may take a better one in the same way. Each such
//!    exchange keeps all pairs compatible.
//!    Then, as far as some plan is not clear of a non-cooperative aircraft, all plans are exchanged for such a joint choice
//!    if there is any (`search/joint_plans.rs`), and it is compatible, too.
//! 4. *Step.* All fly `dt` of their plans, and store the fallback at its end. The plans were
//!    compatible, so no two came nearer than `R` during `dt`, and the stored fallbacks keep the
//!    invariant.
//! 5. *Changes.* Between two `dt` a pair comes under the invariant in three ways, and never without
//!    fallbacks that are apart: one of the two enters, and chooses a fallback apart from the other's, which may take
//!    another one of its own for that, or else the pair is exempt, because there is no joint choice (`entry_fallbacks`,
//!    `joint_fallbacks.rs`); one is ordered to a speed, or passes levels in the next `dt`,
//!    which it does only as far as it has a fallback apart from those of all that it then has to avoid, regardless of
//!    other exempt pairs (`safe_fallback`, `next_altitude`); or the exemption of the pair ends, which it does
//!    once their fallbacks are apart (`act/entry.rs`). An airplane that leaves the world keeps every other pair as it was.
//! 6. *Levels.* An airplane can level off at any time, so between two `dt` it occupies its own level alone. Then those
//!    that change it are cleared one after the other, each with regard to the levels that those before it pass: from
//!    those that it meets anew its fallback has to be apart, and those that it has met already are apart by the
//!    invariant, or because they were cleared with regard to it.
//!
//! 7. *Areas.* Of each candidate only those fallbacks are left after which the plan keeps clear of areas, before any plans
//!    are compared (`areas.rs`); the stored fallback always is. So the search ends as before, and stored fallbacks stay
//!    clear.
//!
//! By induction over `dt` no pair that is not exempt ever loses separation. In a plane, a wind that all know
//! moves all alike and changes no distance; `shear.rs` has what is proved of pairs that fly in different winds. On the earth each pair is compared in a plane of its own, and
//! `curvature.rs` has the margin for what that leaves. `errors.rs` has the margin that errors of position and
//! heading add to `R`, and `avoid.rs` the guarantee beside non-cooperative aircraft. Each step is
//! a property test in `tests.rs`, the whole one in `guarantee_tests.rs`, and among areas in `area_tests.rs`.
//!
//! Airplanes that turn at different rates orbit at one rate, which all can fly (`common_orbit_rates`).
//! Then plans of airplanes that pass each other are nearly always compatible, and the shield costs
//! little (`delay_tests.rs`). Where messages get lost, plans of which others
//! have to hear end with orbits alone: an airplane is seen to orbit, and to which side, and so others know its fallback
//! without hearing of it. Plans that all compute from what all see may end with any (`pilot/common_plans.rs`).
//!
//! Numbers: `orbit.rs` and `fallback.rs` never wrongly find that motions stay apart. New plans must keep slightly
//! more than `R` (by `MARGIN_M`), so that rounding never adds up to a loss.

#[cfg(test)]
pub(crate) mod area_tests;
mod areas;
mod change;
mod curvature;
#[cfg(test)]
mod delay_tests;
mod drift;
mod errors;
mod fallback;
#[cfg(test)]
pub(crate) mod guarantee_tests;
mod joint_fallbacks;
mod neighbors;
mod orbit;
mod safe_maneuver;
#[cfg(test)]
mod scenario_tests;
mod search;
mod shear;
mod shielded_aircraft;
#[cfg(test)]
mod terminal_tests;
#[cfg(test)]
mod tests;
#[cfg(test)]
mod wind_tests;

pub(crate) use change::{
    EntryFallbacks, altitude_short_of, entry_fallbacks, first_fallbacks, next_altitude,
    safe_fallback,
};
pub(crate) use curvature::curvature_error_m;
pub use drift::AirDrift;
pub use errors::ErrorBounds;
pub(crate) use errors::{OrbitTracker, common_orbit_rates};
pub use fallback::Fallback;
pub(crate) use joint_fallbacks::EntryRole;
pub use orbit::OrbitSide;
pub(crate) use orbit::stays_apart_for;
pub(crate) use safe_maneuver::SafeManeuver;
pub use safe_maneuver::{CommonPlan, TurnProfile};
pub(crate) use search::{CandidateThreats, Surroundings, filter_maneuvers_beside};
pub use search::{PlanCertainty, PlanEnding, PlanRules, ShieldDecision, filter_maneuvers};
pub(crate) use shear::renewed_fallbacks;
pub(crate) use shielded_aircraft::ExemptIds;
pub use shielded_aircraft::ShieldedAircraft;
