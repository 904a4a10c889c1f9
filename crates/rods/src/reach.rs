//! Reaching: moving one connector of a chain while others hold it: a fixed base, a base on a line, on a
//! plane or in a box, two ends, or any connectors in between.
//!
//! With rods of fixed length a held connector would veto every pull, and no target could be reached. So
//! the held connectors are set free for the time being, and return passes lead them back, each to its
//! place if it is fixed, and to the nearest one allowed if it is not. For one fixed base a double pass
//! is an iteration of FABRIK (Aristidou and Lasenby, 2011). All passes and the check of the whole path
//! are one transaction.

use super::chain::{Chain, Connector, LENGTH_TOLERANCE_M, Mobility};
use super::geometry::{Point, distance};
use super::obstacle::Obstacles;
use super::propagate::Propagator;
use super::veto::{MotionRequest, RequestSource, RequestedMotion, Veto, VetoEffect};
use sidestep_kernel::{InputError, interrupt};

/// Largest number of double passes before the search is given up. One held connector converges in few passes (a
/// median of 3 to 16 for arms of 7 to 100 rods in the plane), unless the target is at full reach.
const MAX_DOUBLE_PASSES: usize = 40;
/// The same where several connectors are held, whose return passes disturb each other.
const MAX_MUTUAL_PASSES: usize = 400;
/// Least relative gain of a double pass; one that brings the connector nearer by less ends the
/// search: at 0.01 % a pass, 40 passes would come nearer by 0.4 %.
const MIN_GAIN: f64 = 1e-4;
/// Distance from their places within which several held connectors count as being back. Then each is
/// put there exactly, which uses up a tenth of the tolerance of the rods' lengths.
const RETURN_TOLERANCE_M: f64 = 0.1 * LENGTH_TOLERANCE_M;

/// The target of a connector, and the base.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ReachRequest<const D: usize> {
    /// The connector that is to move.
    pub k: usize,
    /// Where it is to be, meters.
    pub target: Point<D>,
    /// The connector that keeps its place even if it is free to move.
    pub base: usize,
    /// Distance at which the target counts as reached, meters.
    pub tolerance_m: f64,
}

/// Where a reach ended; only the first of them changes the chain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ReachOutcome<const D: usize> {
    /// The connector is at the target.
    There {
        /// Distance from the target, meters.
        off_m: f64,
        /// Passes to the target and back.
        double_passes: usize,
    },
    /// The passes did not reach the target; nothing has changed.
    Short {
        /// The place nearest to the target that the connector could have reached.
        nearest: Point<D>,
        /// The objection, if there was one; otherwise the passes came no nearer.
        veto: Option<Veto<D>>,
    },
}

/// A connector that is held, its place before, and its constraint.
#[derive(Debug, Clone, Copy)]
struct ConstrainedConnector<const D: usize> {
    k: usize,
    home: Point<D>,
    mobility: Mobility<D>,
    failed: bool,
}

impl<const D: usize> ConstrainedConnector<D> {
    /// Returns the place to which the connector is to return.
    fn home_position(&self, chain: &Chain<D>) -> Point<D> {
        if self.failed {
            return self.home;
        }
        match self.mobility {
            Mobility::Free | Mobility::Fixed => self.home,
            on => on.project(chain.points()[self.k], self.home),
        }
    }
}

/// A chain whose held connectors are set free, and the goal of its passes.
struct ReachSolver<'a, const D: usize> {
    propagator: &'a mut Propagator<D>,
    chain: &'a mut Chain<D>,
    obstacles: &'a Obstacles<D>,
    request: &'a ReachRequest<D>,
    held: &'a [ConstrainedConnector<D>],
}

/// Moves a connector to a target while the base keeps its place, bit for bit, and all other held
/// connectors stay at allowed places.
///
/// # Errors
/// As [`Propagator::propagate`]; also when the chain does not have the base.
pub fn reach_target<const D: usize>(
    propagator: &mut Propagator<D>,
    chain: &mut Chain<D>,
    obstacles: &Obstacles<D>,
    request: &ReachRequest<D>,
) -> Result<ReachOutcome<D>, InputError> {
    if request.base >= chain.points().len() || request.base == request.k {
        return Err(InputError::new(
            "base",
            format!("is connector {}, of {}", request.base, chain.points().len()),
            "give another connector than the one that moves, counted from 0",
        ));
    }
    let before = chain.points().to_vec();
    let held = held_connectors(chain, request);
    for h in &held {
        chain.set_mobility(h.k, Mobility::Free)?;
        chain.set_connector_failed(h.k, false);
    }
    let passes = ReachSolver { propagator, chain, obstacles, request, held: &held };
    let outcome = passes.run();
    for h in &held {
        chain.set_mobility(h.k, h.mobility)?;
        chain.set_connector_failed(h.k, h.failed);
    }
    let outcome = outcome.map(|outcome| {
        if let ReachOutcome::Short { .. } = outcome {
            return outcome;
        }
        // Each pass was checked, but not the straight path that the chain appears to take.
        match propagator.find_path_veto(chain, obstacles, &before, request.k) {
            None => outcome,
            Some(veto) => {
                ReachOutcome::Short { nearest: chain.points()[request.k], veto: Some(veto) }
            }
        }
    });
    if !matches!(outcome, Ok(ReachOutcome::There { .. })) {
        chain.points_mut().copy_from_slice(&before);
    }
    outcome
}

/// Returns the connectors that are not free to go anywhere, and the base.
fn held_connectors<const D: usize>(
    chain: &Chain<D>,
    request: &ReachRequest<D>,
) -> Vec<ConstrainedConnector<D>> {
    let mut held = Vec::new();
    for (k, connector) in chain.connectors().iter().enumerate() {
        let is_bound = connector.failed || connector.mobility != Mobility::Free;
        if k != request.k && (k == request.base || is_bound) {
            let home = chain.points()[k];
            let Connector { mobility, failed, .. } = *connector;
            held.push(ConstrainedConnector { k, home, mobility, failed });
        }
    }
    held
}

impl<const D: usize> ReachSolver<'_, D> {
    fn run(mut self) -> Result<ReachOutcome<D>, InputError> {
        let ReachRequest { k, target, tolerance_m, .. } = *self.request;
        let max_passes = if self.held.len() > 1 { MAX_MUTUAL_PASSES } else { MAX_DOUBLE_PASSES };
        let mut nearest = self.chain.points()[k];
        let mut off_m = distance(nearest, target);
        for double_passes in 0..=max_passes {
            interrupt::check();
            if off_m <= tolerance_m && self.restore_held() {
                return Ok(ReachOutcome::There { off_m, double_passes });
            }
            if let Some(veto) = self.double_pass()? {
                return Ok(ReachOutcome::Short { nearest, veto: Some(veto) });
            }
            // The errors of the held connectors count too: a pass that only trades one for the other
            // is no gain.
            let now_m = distance(self.chain.points()[k], target) + self.max_error_m();
            if now_m > off_m * (1.0 - MIN_GAIN) && now_m > tolerance_m {
                return Ok(ReachOutcome::Short { nearest, veto: None });
            }
            nearest = self.chain.points()[k];
            off_m = now_m;
        }
        Ok(ReachOutcome::Short { nearest, veto: None })
    }

    /// Leads the initiator to its target, and then all held connectors back; returns the objection, if
    /// there is one.
    fn double_pass(&mut self) -> Result<Option<Veto<D>>, InputError> {
        let ReachRequest { k, target, .. } = *self.request;
        if let Some(veto) = self.move_connector(k, target)? {
            return Ok(Some(veto));
        }
        for h in self.held {
            let home = h.home_position(self.chain);
            if let Some(veto) = self.move_connector(h.k, home)? {
                return Ok(Some(veto));
            }
            // A last move shorter than the least counts as none, so a held connector is put exactly
            // home.
            self.chain.points_mut()[h.k] = home;
        }
        Ok(None)
    }

    /// Moves one connector, or returns the veto.
    fn move_connector(&mut self, k: usize, to: Point<D>) -> Result<Option<Veto<D>>, InputError> {
        let motion = RequestedMotion::Connector { k, to };
        let request =
            MotionRequest { motion, source: RequestSource::Planner, mode: VetoEffect::Exact };
        let outcome = self.propagator.propagate(self.chain, self.obstacles, &request)?;
        Ok(outcome.veto().copied())
    }

    /// Returns the greatest distance of a held connector from its place, meters.
    fn max_error_m(&self) -> f64 {
        let chain = &*self.chain;
        let off_m = self.held.iter().map(|h| distance(chain.points()[h.k], h.home_position(chain)));
        off_m.fold(0.0, f64::max)
    }

    /// Puts all held connectors exactly where they belong, if all are nearly there; returns whether they
    /// are.
    fn restore_held(&mut self) -> bool {
        if self.max_error_m() > RETURN_TOLERANCE_M {
            return false;
        }
        for h in self.held {
            let home = h.home_position(self.chain);
            self.chain.points_mut()[h.k] = home;
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use super::super::chain::Rod;
    use super::super::obstacle::Obstacle;
    use super::super::veto::VetoReason;
    use super::*;

    fn arm() -> Chain<2> {
        let rod = Rod::with_fixed_length(1.0, 0.02);
        let mut arm =
            Chain::straight([0.0, 0.0], [1.0, 0.0], 6, rod, Connector::free(0.05)).unwrap();
        arm.set_mobility(0, Mobility::Fixed).unwrap();
        arm
    }

    #[test]
    fn an_arm_reaches_and_its_base_keeps_every_bit() {
        let mut chain = arm();
        let request = ReachRequest { k: 6, target: [3.0, 2.5], base: 0, tolerance_m: 1e-6 };
        let outcome =
            reach_target(&mut Propagator::default(), &mut chain, &Obstacles::default(), &request);
        assert!(matches!(outcome.unwrap(), ReachOutcome::There { .. }));
        assert_eq!(chain.points()[0], [0.0, 0.0]);
        assert!(distance(chain.points()[6], request.target) <= 1e-6);
        assert!(chain.max_rod_violation_m() <= 1e-9);
        assert_eq!(chain.connectors()[0].mobility, Mobility::Fixed);
    }

    #[test]
    fn a_target_out_of_reach_changes_nothing() {
        let mut chain = arm();
        let before = chain.clone();
        let request = ReachRequest { k: 6, target: [0.0, 9.0], base: 0, tolerance_m: 1e-6 };
        let outcome =
            reach_target(&mut Propagator::default(), &mut chain, &Obstacles::default(), &request);
        assert!(matches!(outcome.unwrap(), ReachOutcome::Short { veto: None, .. }));
        assert_eq!(chain, before);
        assert!(
            reach_target(
                &mut Propagator::default(),
                &mut chain,
                &Obstacles::default(),
                &ReachRequest { base: 6, ..request }
            )
            .is_err()
        );
    }

    #[test]
    fn a_blocked_target_is_reported() {
        let mut chain = arm();
        let before = chain.clone();
        let obstacles = Obstacles::new(vec![Obstacle::ball(4, [4.0, 2.0], 0.5)], 1.0).unwrap();
        let request = ReachRequest { k: 6, target: [4.0, 2.0], base: 0, tolerance_m: 1e-6 };
        let outcome =
            reach_target(&mut Propagator::default(), &mut chain, &obstacles, &request).unwrap();
        let ReachOutcome::Short { veto: Some(veto), .. } = outcome else { panic!("{outcome:?}") };
        assert_eq!((veto.reason, veto.obstacle), (VetoReason::TargetBlocked, Some(4)));
        assert_eq!(chain, before);
    }
}
