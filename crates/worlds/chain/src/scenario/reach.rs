//! Targets that no posture of a chain reaches: too far from where its held connectors may be, or too near.

use super::super::driver::{Task, TaskKind};
use super::ChainScenarioCompiler;
use sidestep_kernel::InputError;
use sidestep_rods::geometry::{Point, distance};
use sidestep_rods::{Chain, Mobility, Rod};
use std::ops::Range;

/// Rounding of distances that is allowed beside the tolerance of targets, meters.
const ROUNDING_M: f64 = 1e-9;

/// The distances between two connectors that the rods between them allow.
#[derive(Debug, Clone, Copy, PartialEq)]
struct ReachRange {
    min_m: f64,
    max_m: f64,
}

impl ReachRange {
    /// Returns the range of the rods between connectors `i` and `j`.
    fn between<const D: usize>(chain: &Chain<D>, i: usize, j: usize) -> Self {
        let rods = &chain.rods()[i.min(j)..i.max(j)];
        let max_m = rods.iter().map(|rod| rod.max_m).sum();
        // A rod that is longer than all others together keeps a hole free around the held connector.
        let hole_m = |rod: &Rod| rod.min_m - (max_m - rod.max_m);
        let min_m = rods.iter().map(hole_m).fold(0.0, f64::max);
        Self { min_m, max_m }
    }
}

impl<const D: usize> ChainScenarioCompiler<'_, D> {
    /// Refuses targets that no posture reaches, as long as connectors are held where they are at the start.
    pub(super) fn check_reach(
        &self,
        chain: &Chain<D>,
        task: &Task<D>,
        at: Range<usize>,
    ) -> Result<(), InputError> {
        let TaskKind::Targets(targets) = &task.driver else { return Ok(()) };
        let k = task.agent;
        for (number, target) in targets.places.iter().enumerate() {
            for (held, connector) in chain.connectors().iter().enumerate() {
                // The connector that is led is asked where it may be, by the rules of its own mobility.
                if held == k || connector.mobility == Mobility::Free {
                    continue;
                }
                let range = ReachRange::between(chain, held, k);
                let from = chain.points()[held];
                let slack_m = targets.tolerance_m + ROUNDING_M;
                let nearest_m = distance(connector.mobility.project(*target, from), *target);
                let farthest_m = farthest_m(&connector.mobility, from, *target);
                let problem = if nearest_m > range.max_m + slack_m {
                    let words = format!(
                        "it is {nearest_m:.4} m from {}, and {} rods reach {:.4} m",
                        held_place(held, &connector.mobility),
                        held.abs_diff(k),
                        range.max_m
                    );
                    Some((words, format!("at most {:.4} m from there", range.max_m)))
                } else if farthest_m < range.min_m - slack_m {
                    let words = format!(
                        "it is at most {farthest_m:.4} m from {}, and the rods keep at least {:.4} m from there",
                        held_place(held, &connector.mobility),
                        range.min_m
                    );
                    Some((words, format!("at least {:.4} m from there", range.min_m)))
                } else {
                    None
                };
                if let Some((words, right)) = problem {
                    let at = self.source.key_span(at, &["targets_m", "kind"]);
                    let cause = format!("no posture reaches target {number}, {target:?}: {words}");
                    let remedy =
                        format!("give a target {right}, or hold connector {held} elsewhere");
                    return Err(self.source.error(at, cause, remedy));
                }
            }
        }
        Ok(())
    }
}

/// Returns words for where a held connector may be.
fn held_place<const D: usize>(held: usize, mobility: &Mobility<D>) -> String {
    match mobility {
        Mobility::OnSegment(_) => format!("the segment of connector {held}"),
        Mobility::OnPlane { .. } => format!("the plane of connector {held}"),
        Mobility::InBox { .. } => format!("the box of connector {held}"),
        Mobility::Fixed | Mobility::Free => format!("connector {held}, which is fixed"),
    }
}

/// Returns the distance of a target from the farthest place that a connector may have, meters.
fn farthest_m<const D: usize>(mobility: &Mobility<D>, at: Point<D>, target: Point<D>) -> f64 {
    match mobility {
        Mobility::Fixed => distance(at, target),
        Mobility::OnSegment(ends) => {
            ends.iter().map(|end| distance(*end, target)).fold(0.0, f64::max)
        }
        Mobility::InBox { lo, hi } => {
            let corner: Point<D> = std::array::from_fn(|axis| {
                let is_low = (target[axis] - lo[axis]).abs() > (target[axis] - hi[axis]).abs();
                if is_low { lo[axis] } else { hi[axis] }
            });
            distance(corner, target)
        }
        Mobility::OnPlane { .. } | Mobility::Free => f64::INFINITY,
    }
}
