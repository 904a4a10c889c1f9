//! The shield: a filter that provably keeps airplanes apart.
//!
//! It stands between any method and the airplanes. Every airplane stores a *fallback* that it can
//! fly for ever: an orbit at its largest turn rate, to the left or to the right.
//!
//! **Invariant.** The stored fallbacks of all airplanes are pairwise at least `R` apart, from now
//! on and for all time.
//!
//! Each `dt` every airplane is given a *plan*: some way for `dt`, and then an orbit from where
//! that ends. Plans are *compatible* when they stay `R` apart during `dt` and on the orbits ever
//! after. [`filter`] hands out plans that are pairwise compatible:
//!
//! 1. *Start.* If the fallbacks are apart, staying on them for `dt` and ever after is a plan for
//!    each, and these plans are pairwise compatible: they are the same motions as the invariant
//!    speaks of. So an assignment of compatible plans exists.
//! 2. *Search.* Each airplane starts with the plan that the method proposes. While some pair is
//!    not compatible, one of the two, the one with the lower rank unless it is on its fallback
//!    already, takes another plan that is compatible with all present ones, or its fallback. The
//!    first lowers the number of incompatible pairs, the second raises the number of airplanes on
//!    fallbacks, and none leaves a fallback during the search, so it ends. It can only end without
//!    an incompatible pair, because two airplanes on fallbacks are compatible by the invariant.
//! 3. *Better again.* An airplane that has fallen back may take another plan if that is compatible
//!    with all present ones. Each such exchange keeps all pairs compatible.
//! 4. *Step.* All fly `dt` of their plans, and store the orbit at its end. The plans were
//!    compatible, so nobody came nearer than `R` during `dt`, and the stored orbits keep the
//!    invariant.
//!
//! By induction over `dt` there is never a loss of separation once the first fallbacks are apart
//! (`first_fallbacks` chooses them). Where they are not, the pair is left to the method until
//! they are, and the induction is about all other pairs. An airplane that leaves the world keeps
//! every other pair as it was. A wind that all know moves everybody alike and changes no distance.
//! Each step is a property test in `tests.rs`.
//!
//! Numbers: `orbit.rs` never wrongly finds that motions stay apart. New plans must keep slightly
//! more than `R` (by `SLACK_M`), so that rounding never adds up to a loss.

mod errors;
mod fallback;
mod flyer;
mod orbit;
mod plan;
#[cfg(test)]
mod price;
#[cfg(test)]
mod promise;
mod search;
#[cfg(test)]
mod tests;

pub use errors::Bounds;
pub(crate) use errors::{Holding, common_rates};
pub(crate) use fallback::{entry_fallbacks, first_fallbacks, side_apart};
pub use flyer::Flyer;
pub(crate) use flyer::Named;
pub use orbit::Side;
pub(crate) use orbit::apart_for;
pub(crate) use plan::Plan;
pub use plan::Way;
pub use search::{Certainty, Decision, filter};
