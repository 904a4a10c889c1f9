//! An arm's reach: moving one connector of a chain held by others: a fixed base, a base on a line, on a
//! plane or in a box, two ends, or any of them in between.
//!
//! A connector that is held vetoes a pull of rods of fixed length that would take it away, so its objection
//! is answered by return passes: all held connectors move tentatively, and are then led back, each to its
//! place if it is fixed, and to the nearest one allowed if it is not. All passes and the check of the whole
//! way are one transaction.

use super::chain::{Chain, LENGTH_TOLERANCE_M, Mobility};
use super::geometry::{Point, distance};
use super::obstacle::Obstacles;
use super::propagate::Propagator;
use super::tunneling::find_tunneling;
use super::veto::{Motion, Outcome, Request, RequestSource, Veto, VetoEffect, VetoReason};
use sidestep_kernel::{InputError, interrupt};

/// Most double passes before the search is given up.
const MAX_DOUBLE_PASSES: usize = 40;
/// Most double passes where several connectors are held, because their return passes disturb each other.
const MAX_MUTUAL_PASSES: usize = 400;
/// Least relative gain of a double pass; one that brings the connector nearer by less ends the
/// search.
const MIN_GAIN: f64 = 1e-4;
/// Distance from their places within which several held connectors count as being back; each is put
/// there exactly then, which takes up a tenth of the tolerance of the rods' lengths.
const RETURN_TOLERANCE_M: f64 = 0.1 * LENGTH_TOLERANCE_M;

/// The target of a connector, and the base.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ReachRequest<const D: usize> {
    /// The connector that is to move.
    pub k: usize,
    /// Its target.
    pub target: Point<D>,
    /// The connector that keeps its place even if it is free to move.
    pub base: usize,
    /// Distance at which the target counts as reached, meters.
    pub tolerance_m: f64,
}

/// Outcome of a reach.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ReachOutcome<const D: usize> {
    /// The connector is at the target.
    There {
        /// Distance from the target, meters.
        off_m: f64,
        /// Passes to the target and back.
        double_passes: usize,
    },
    /// The target cannot be reached in this way; nothing has changed.
    Short {
        /// The place nearest to the target that the connector could have reached.
        nearest: Point<D>,
        /// The objection, if there was one; otherwise the passes came no nearer.
        veto: Option<Veto<D>>,
    },
}

/// A connector that is held, its place before, and its constraint.
#[derive(Debug, Clone, Copy)]
struct HeldConnector<const D: usize> {
    k: usize,
    home: Point<D>,
    mobility: Mobility<D>,
    failed: bool,
}

impl<const D: usize> HeldConnector<D> {
    /// Returns the place to which the connector goes back from where it is.
    fn home_position(&self, chain: &Chain<D>) -> Point<D> {
        match self.mobility {
            _ if self.failed => self.home,
            Mobility::Free | Mobility::Fixed => self.home,
            on => on.project(chain.points()[self.k], self.home),
        }
    }
}

/// Moves a connector to a target while the base keeps its place, bit for bit, and all other held
/// connectors stay at allowed places.
///
/// # Errors
/// As [`Propagator::propagate`]; also when the chain does not have the base.
pub fn reach<const D: usize>(
    propagator: &mut Propagator<D>,
    chain: &mut Chain<D>,
    obstacles: &Obstacles<D>,
    order: &ReachRequest<D>,
) -> Result<ReachOutcome<D>, InputError> {
    if order.base >= chain.points().len() || order.base == order.k {
        return Err(InputError::new(
            "base",
            format!("is connector {}, of {}", order.base, chain.points().len()),
            "name another connector than the one that moves, counted from 0",
        ));
    }
    let before = chain.points().to_vec();
    let held = held_connectors(chain, order);
    for h in &held {
        chain.set_mobility(h.k, Mobility::Free)?;
        chain.set_failed(h.k, false);
    }
    let came = run_passes(propagator, chain, obstacles, order, &held);
    for h in &held {
        chain.set_mobility(h.k, h.mobility)?;
        chain.set_failed(h.k, h.failed);
    }
    let came = came.map(|came| match came {
        ReachOutcome::There { .. } => {
            path_veto(chain, obstacles, &before, order).map_or(came, |veto| ReachOutcome::Short {
                nearest: chain.points()[order.k],
                veto: Some(veto),
            })
        }
        short @ ReachOutcome::Short { .. } => short,
    });
    if !matches!(came, Ok(ReachOutcome::There { .. })) {
        chain.points_mut().copy_from_slice(&before);
    }
    came
}

/// Returns the connectors that are not free to go anywhere, and the base.
fn held_connectors<const D: usize>(
    chain: &Chain<D>,
    order: &ReachRequest<D>,
) -> Vec<HeldConnector<D>> {
    let is_held = |k: usize| {
        let connector = &chain.connectors()[k];
        k != order.k
            && (k == order.base || connector.failed || connector.mobility != Mobility::Free)
    };
    let held = (0..chain.points().len()).filter(|&k| is_held(k)).map(|k| {
        let connector = &chain.connectors()[k];
        let home = chain.points()[k];
        HeldConnector { k, home, mobility: connector.mobility, failed: connector.failed }
    });
    held.collect()
}

fn run_passes<const D: usize>(
    propagator: &mut Propagator<D>,
    chain: &mut Chain<D>,
    obstacles: &Obstacles<D>,
    order: &ReachRequest<D>,
    held: &[HeldConnector<D>],
) -> Result<ReachOutcome<D>, InputError> {
    let most = if held.len() > 1 { MAX_MUTUAL_PASSES } else { MAX_DOUBLE_PASSES };
    let mut nearest = chain.points()[order.k];
    let mut off_m = distance(nearest, order.target);
    for double_passes in 0..=most {
        interrupt::check();
        if off_m <= order.tolerance_m && restore_held(chain, held) {
            return Ok(ReachOutcome::There { off_m, double_passes });
        }
        if let Some(veto) = double_pass(propagator, chain, obstacles, order, held)? {
            return Ok(ReachOutcome::Short { nearest, veto: Some(veto) });
        }
        let now_m = distance(chain.points()[order.k], order.target) + max_error_m(chain, held);
        if now_m > off_m * (1.0 - MIN_GAIN) && now_m > order.tolerance_m {
            return Ok(ReachOutcome::Short { nearest, veto: None });
        }
        (nearest, off_m) = (chain.points()[order.k], now_m);
    }
    Ok(ReachOutcome::Short { nearest, veto: None })
}

/// Leads the initiator to its target, and then all held connectors back; returns the objection, if there
/// is one.
fn double_pass<const D: usize>(
    propagator: &mut Propagator<D>,
    chain: &mut Chain<D>,
    obstacles: &Obstacles<D>,
    order: &ReachRequest<D>,
    held: &[HeldConnector<D>],
) -> Result<Option<Veto<D>>, InputError> {
    for pass in 0..=held.len() {
        let (k, to) = match pass.checked_sub(1) {
            None => (order.k, order.target),
            Some(i) => (held[i].k, held[i].home_position(chain)),
        };
        let motion = Motion::Connector { k, to };
        let request = Request { motion, source: RequestSource::Planner, mode: VetoEffect::Exact };
        if let Outcome::Vetoed(veto) = propagator.propagate(chain, obstacles, &request)? {
            return Ok(Some(veto));
        }
        // A last move shorter than the least counts as none, so a held connector is put exactly home.
        if pass > 0 {
            chain.points_mut()[k] = to;
        }
    }
    Ok(None)
}

/// Returns the greatest distance of a held connector from its place, meters.
fn max_error_m<const D: usize>(chain: &Chain<D>, held: &[HeldConnector<D>]) -> f64 {
    let off_m = held.iter().map(|h| distance(chain.points()[h.k], h.home_position(chain)));
    off_m.fold(0.0, f64::max)
}

/// Puts all held connectors exactly where they belong, if they are as good as there; returns whether they are.
fn restore_held<const D: usize>(chain: &mut Chain<D>, held: &[HeldConnector<D>]) -> bool {
    let is_back = max_error_m(chain, held) <= RETURN_TOLERANCE_M;
    for h in held.iter().filter(|_| is_back) {
        let place = h.home_position(chain);
        chain.points_mut()[h.k] = place;
    }
    is_back
}

/// Returns the veto of an obstacle on the way from the old state to the new one, because no pass has
/// checked that whole way.
fn path_veto<const D: usize>(
    chain: &Chain<D>,
    obstacles: &Obstacles<D>,
    before: &[Point<D>],
    order: &ReachRequest<D>,
) -> Option<Veto<D>> {
    find_tunneling(chain, before, obstacles, 0.0).map(|passed| Veto {
        by: passed.rod + 1,
        from: order.k,
        reason: VetoReason::WouldTunnel,
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
        let order = ReachRequest { k: 6, target: [3.0, 2.5], base: 0, tolerance_m: 1e-6 };
        let came = reach(&mut Propagator::default(), &mut chain, &Obstacles::default(), &order);
        assert!(matches!(came.unwrap(), ReachOutcome::There { .. }));
        assert_eq!(chain.points()[0], [0.0, 0.0]);
        assert!(distance(chain.points()[6], order.target) <= 1e-6);
        assert!(chain.max_rod_violation_m() <= 1e-9);
        assert_eq!(chain.connectors()[0].mobility, Mobility::Fixed);
    }

    #[test]
    fn a_target_out_of_reach_changes_nothing() {
        let mut chain = arm();
        let before = chain.clone();
        let order = ReachRequest { k: 6, target: [0.0, 9.0], base: 0, tolerance_m: 1e-6 };
        let came = reach(&mut Propagator::default(), &mut chain, &Obstacles::default(), &order);
        assert!(matches!(came.unwrap(), ReachOutcome::Short { veto: None, .. }));
        assert_eq!(chain, before);
        assert!(
            reach(
                &mut Propagator::default(),
                &mut chain,
                &Obstacles::default(),
                &ReachRequest { base: 6, ..order }
            )
            .is_err()
        );
    }

    #[test]
    fn a_blocked_target_is_told() {
        let mut chain = arm();
        let before = chain.clone();
        let obstacles = Obstacles::new(vec![Obstacle::ball(4, [4.0, 2.0], 0.5)], 1.0).unwrap();
        let order = ReachRequest { k: 6, target: [4.0, 2.0], base: 0, tolerance_m: 1e-6 };
        let came = reach(&mut Propagator::default(), &mut chain, &obstacles, &order).unwrap();
        let ReachOutcome::Short { veto: Some(veto), .. } = came else { panic!("{came:?}") };
        assert_eq!((veto.reason, veto.obstacle), (VetoReason::TargetBlocked, Some(4)));
        assert_eq!(chain, before);
    }
}
