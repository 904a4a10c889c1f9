//! Perception of the connectors of a chain at the start of their talk.

use crate::agents::side::Side;
use crate::agents::{ConnectorPercept, Role, SensedObstacle};
use crate::driver::Task;
use crate::state::Body;
use crate::world::{ChainSpec, ChainWorld};
use sidestep_kernel::network::Network;
use sidestep_kernel::{Cycle, EntityId};
use sidestep_rods::serde_point::WirePoint;
use sidestep_rods::{Obstacles, bounds_around};

/// Distance beyond that needed by any motion, meters: far more than tolerances and rounding.
const MARGIN_M: f64 = 1e-3;

/// A chain in a cycle, and what is around it.
#[derive(Clone, Copy)]
pub(crate) struct SensingContext<'a, const D: usize> {
    pub(crate) chain: EntityId,
    pub(crate) now: Cycle,
    pub(crate) body: &'a Body<D>,
    pub(crate) obstacles: &'a Obstacles<D>,
}

impl<const D: usize> ChainWorld<D> {
    /// Returns the id on the network of a chain's connector 0; the others follow.
    pub(crate) fn first_id(&self, chain: EntityId) -> EntityId {
        let before = self.chains[..chain as usize].iter().map(|spec| spec.start.points().len());
        before.sum::<usize>() as EntityId
    }

    /// Returns what the connectors of a chain perceive; `leader` has the part `role`, the others follow.
    pub(crate) fn percepts(
        &self,
        sensed: SensingContext<'_, D>,
        leader: usize,
        role: &Role<D>,
    ) -> Vec<ConnectorPercept<D>> {
        let SensingContext { chain, now, body, obstacles } = sensed;
        let points = body.chain.points();
        let n = points.len() as u32;
        let (first_id, at_s) = (self.first_id(chain), self.start_time_s(now));
        let sees_m = self.sensor_range_m(&self.chains[chain as usize]);
        let sight = |k: u32| {
            let connector = body.chain.connectors()[k as usize];
            let at = points[k as usize];
            let mut seen = Vec::new();
            let half_m = sees_m + connector.radius_m;
            obstacles.visit(&bounds_around(at, half_m), |obstacle| {
                seen.push(SensedObstacle::from_obstacle(obstacle))
            });
            let neighbor = |side: Side| side.neighbor(k, n).map(|j| WirePoint(points[j as usize]));
            let is_silent = |network: &Network| network.is_radio_off(first_id + k, at_s);
            ConnectorPercept {
                cycle: now,
                at: WirePoint(at),
                neighbors: Side::ALL.map(neighbor),
                max_bend_rad: connector.max_bend_rad,
                seen,
                is_silent: self.network.as_ref().is_some_and(is_silent),
                missing: body.missing.get(k as usize).copied().unwrap_or_default(),
                role: if k as usize == leader { role.clone() } else { Role::Follows },
            }
        };
        (0..n).map(sight).collect()
    }

    /// Returns the distance in which a connector's sensors see everything to which a motion of a cycle
    /// may bring its rods near, meters. Its master is at most a rod's length away, its own place at
    /// most another one, and both go on for as many sub-steps as the initiator makes.
    fn sensor_range_m(&self, spec: &ChainSpec<D>) -> f64 {
        let chain = &spec.start;
        let longest_m = chain.rods().iter().map(|rod| rod.max_m).fold(0.0, f64::max);
        let way_m = |task: &Task<D>| task.speed_m_s * self.dt_s;
        let led_m = spec.tasks.iter().map(way_m).fold(0.0, f64::max);
        let step_m = self.rules.step_m.unwrap_or(chain.step_m());
        let steps = (led_m / step_m).ceil() + 1.0;
        2.0 * longest_m + 2.0 * led_m.max(steps * self.rules.slave_step_max_m) + MARGIN_M
    }
}
