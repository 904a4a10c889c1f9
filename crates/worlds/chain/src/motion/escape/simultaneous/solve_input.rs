//! The input of a solve, and its soft constraints.

use super::super::EscapeMargin;
use sidestep_rods::geometry::{Point, distance};
use sidestep_rods::{Chain, Obstacles, ReactionRules};

#[derive(Clone, Copy)]
pub(super) struct EscapeSolveInput<'a, const D: usize> {
    pub(super) chain: &'a Chain<D>,
    pub(super) obstacles: &'a Obstacles<D>,
    pub(super) rules: &'a ReactionRules,
    /// Positions from which displacements count.
    pub(super) start: &'a [Point<D>],
    /// Longest displacement of a connector, meters.
    pub(super) max_step_m: f64,
}

impl<const D: usize> EscapeSolveInput<'_, D> {
    /// Returns the distance from its start that a connector may have, meters: as far as its speed
    /// allows, or as far as it already is.
    pub(super) fn max_travel_m(&self, k: usize) -> f64 {
        self.max_step_m.max(distance(self.start[k], self.chain.points()[k]))
    }
}

/// What a leader would do in a tick, vetoes and escapes aside.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LeadMotion<const D: usize> {
    pub(crate) k: usize,
    /// The displacement that it wants in this tick, meters.
    pub(crate) displacement_m: Point<D>,
}

/// What a leader chooses by: its chain, what is around it, and the motion that it wants.
#[derive(Clone, Copy)]
pub(crate) struct LeaderChoice<'a, const D: usize> {
    pub(crate) chain: &'a Chain<D>,
    pub(crate) obstacles: &'a Obstacles<D>,
    pub(crate) rules: &'a ReactionRules,
    pub(crate) lead: LeadMotion<D>,
}

/// An exit through an obstacle: parts in it leave in one direction, even if another is shorter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ExitDirection<const D: usize> {
    pub(super) obstacle: u32,
    /// Unit vector.
    pub(super) toward: Point<D>,
}

/// The soft constraints of a solve, beside the hard ones.
#[derive(Clone, Copy)]
pub(super) struct SoftConstraints<const D: usize> {
    pub(super) margin: EscapeMargin,
    pub(super) through: Option<ExitDirection<D>>,
    /// Rounds with margins, and rounds without.
    pub(super) rounds: [usize; 2],
}
