//! An arm's reach: moving one connector of a chain whose base is fixed.
//!
//! A strict base vetoes every pull of rods of fixed length, so the base's objection is answered by
//! a return pass: it moves in thought, and is then led back to its place (pitfall 6). Both passes
//! and the check of the whole way are one transaction.

use super::chain::{Chain, Mobility};
use super::geometry::{Point, distance};
use super::obstacle::Obstacles;
use super::passage::passed;
use super::propagate::Propagator;
use super::veto::{Mode, Motion, Outcome, Reason, Request, Source, Veto};
use sidestep_kernel::InputError;

/// Double passes before it is given up.
const MAX_DOUBLE_PASSES: usize = 40;
/// A double pass that does not bring the connector nearer by this part ends the search.
const LEAST_GAIN: f64 = 1e-4;

/// Where a connector shall be, and which one is the base.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Reach<const D: usize> {
    /// The connector that is to move.
    pub(crate) k: usize,
    /// Where to.
    pub(crate) target: Point<D>,
    /// The fixed connector.
    pub(crate) base: usize,
    /// How near counts as there, meters.
    pub(crate) tolerance_m: f64,
}

/// What came of a reach.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Reached<const D: usize> {
    /// The connector is there.
    There {
        /// How far from the target.
        off_m: f64,
        /// Passes to the target and back.
        double_passes: usize,
    },
    /// It cannot be reached in this way; nothing has changed.
    Short {
        /// The nearest that the connector could have come.
        nearest: Point<D>,
        /// The objection, if there was one; otherwise the passes came no nearer.
        veto: Option<Veto<D>>,
    },
}

/// Moves a connector to a target while the base keeps its place, bit for bit.
///
/// # Errors
/// As [`Propagator::propagate`]; a base that the chain does not have.
pub(crate) fn reach<const D: usize>(
    propagator: &mut Propagator<D>,
    chain: &mut Chain<D>,
    obstacles: &Obstacles<D>,
    order: &Reach<D>,
) -> Result<Reached<D>, InputError> {
    if order.base >= chain.points().len() || order.base == order.k {
        return Err(InputError::new(
            "base",
            format!("is connector {}, of {}", order.base, chain.points().len()),
            "name another connector than the one that moves, counted from 0",
        ));
    }
    let before = chain.points().to_vec();
    let was = (chain.connectors()[order.base].mobility, chain.connectors()[order.base].failed);
    chain.set_mobility(order.base, Mobility::Free)?;
    chain.set_failed(order.base, false);
    let came = passes(propagator, chain, obstacles, order);
    chain.set_mobility(order.base, was.0)?;
    chain.set_failed(order.base, was.1);
    let came = came.map(|came| match came {
        Reached::There { .. } => {
            blocked_way(chain, obstacles, &before, order).map_or(came, |veto| Reached::Short {
                nearest: chain.points()[order.k],
                veto: Some(veto),
            })
        }
        short @ Reached::Short { .. } => short,
    });
    if !matches!(came, Ok(Reached::There { .. })) {
        chain.points_mut().copy_from_slice(&before);
    }
    came
}

fn passes<const D: usize>(
    propagator: &mut Propagator<D>,
    chain: &mut Chain<D>,
    obstacles: &Obstacles<D>,
    order: &Reach<D>,
) -> Result<Reached<D>, InputError> {
    let home = chain.points()[order.base];
    let mut nearest = chain.points()[order.k];
    let mut off_m = distance(nearest, order.target);
    for double_passes in 0..=MAX_DOUBLE_PASSES {
        if off_m <= order.tolerance_m {
            return Ok(Reached::There { off_m, double_passes });
        }
        for (k, to) in [(order.k, order.target), (order.base, home)] {
            let motion = Motion::Connector { k, to };
            let request = Request { motion, source: Source::Planner, mode: Mode::Exact };
            if let Outcome::Vetoed(veto) = propagator.propagate(chain, obstacles, &request)? {
                return Ok(Reached::Short { nearest, veto: Some(veto) });
            }
        }
        // A last move that is shorter than the least counts as none: the base is at home.
        chain.points_mut()[order.base] = home;
        let now_m = distance(chain.points()[order.k], order.target);
        if now_m > off_m * (1.0 - LEAST_GAIN) && now_m > order.tolerance_m {
            return Ok(Reached::Short { nearest, veto: None });
        }
        (nearest, off_m) = (chain.points()[order.k], now_m);
    }
    Ok(Reached::Short { nearest, veto: None })
}

/// What is in the way from the old state to the new one, which no pass has looked at
/// (pitfall 16).
fn blocked_way<const D: usize>(
    chain: &Chain<D>,
    obstacles: &Obstacles<D>,
    before: &[Point<D>],
    order: &Reach<D>,
) -> Option<Veto<D>> {
    passed(chain, before, obstacles, 0.0).map(|passed| Veto {
        by: passed.rod + 1,
        from: order.k,
        reason: Reason::WouldTunnel,
        obstacle: Some(passed.obstacle),
        reached: before[order.k],
    })
}

#[cfg(test)]
mod tests {
    use super::super::chain::{Connector, Rod};
    use super::super::obstacle::Obstacle;
    use super::*;

    fn arm() -> Chain<2> {
        let rod = Rod::fixed(1.0, 0.02);
        let mut arm =
            Chain::straight([0.0, 0.0], [1.0, 0.0], 6, rod, Connector::free(0.05)).unwrap();
        arm.set_mobility(0, Mobility::Fixed).unwrap();
        arm
    }

    #[test]
    fn an_arm_reaches_and_its_base_keeps_every_bit() {
        let mut chain = arm();
        let order = Reach { k: 6, target: [3.0, 2.5], base: 0, tolerance_m: 1e-6 };
        let came = reach(&mut Propagator::default(), &mut chain, &Obstacles::default(), &order);
        assert!(matches!(came.unwrap(), Reached::There { .. }));
        assert_eq!(chain.points()[0], [0.0, 0.0]);
        assert!(distance(chain.points()[6], order.target) <= 1e-6);
        assert!(chain.max_rod_violation_m() <= 1e-9);
        assert_eq!(chain.connectors()[0].mobility, Mobility::Fixed);
    }

    #[test]
    fn a_target_out_of_reach_changes_nothing() {
        let mut chain = arm();
        let before = chain.clone();
        let order = Reach { k: 6, target: [0.0, 9.0], base: 0, tolerance_m: 1e-6 };
        let came = reach(&mut Propagator::default(), &mut chain, &Obstacles::default(), &order);
        assert!(matches!(came.unwrap(), Reached::Short { veto: None, .. }));
        assert_eq!(chain, before);
        assert!(
            reach(
                &mut Propagator::default(),
                &mut chain,
                &Obstacles::default(),
                &Reach { base: 6, ..order }
            )
            .is_err()
        );
    }

    #[test]
    fn a_blocked_target_is_told() {
        let mut chain = arm();
        let before = chain.clone();
        let obstacles = Obstacles::new(vec![Obstacle::ball(4, [4.0, 2.0], 0.5)], 1.0).unwrap();
        let order = Reach { k: 6, target: [4.0, 2.0], base: 0, tolerance_m: 1e-6 };
        let came = reach(&mut Propagator::default(), &mut chain, &obstacles, &order).unwrap();
        let Reached::Short { veto: Some(veto), .. } = came else { panic!("{came:?}") };
        assert_eq!((veto.reason, veto.obstacle), (Reason::TargetBlocked, Some(4)));
        assert_eq!(chain, before);
    }
}
