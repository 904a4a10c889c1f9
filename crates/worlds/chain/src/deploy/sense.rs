//! Perception of the connectors of a chain at the start of their talk.

use crate::agents::side::NeighborSide;
use crate::agents::{ConnectorPercept, ConnectorRole, SensedObstacle};
use crate::state::ChainBodyState;
use crate::world::{ChainSpec, ChainWorld};
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
    pub(crate) body: &'a ChainBodyState<D>,
    pub(crate) obstacles: &'a Obstacles<D>,
}

impl<const D: usize> SensingContext<'_, D> {
    /// Returns the position of the neighbor of connector `k` on a side, if there is one.
    fn neighbor_position(&self, k: u32, side: NeighborSide) -> Option<WirePoint<D>> {
        let points = self.body.chain.points();
        let neighbor = side.neighbor(k, points.len() as u32)?;
        Some(WirePoint(points[neighbor as usize]))
    }

    /// Returns the obstacles of which connector `k` sees something, up to a distance from its surface.
    fn obstacles_near(&self, k: u32, range_m: f64) -> Vec<SensedObstacle> {
        let at = self.body.chain.points()[k as usize];
        let radius_m = self.body.chain.connectors()[k as usize].radius_m;
        let mut seen = Vec::new();
        self.obstacles.visit(&bounds_around(at, range_m + radius_m), |obstacle| {
            seen.push(SensedObstacle::from_obstacle(obstacle));
        });
        seen
    }
}

impl<const D: usize> ChainWorld<D> {
    /// Returns the id on the network of a chain's connector 0; the others follow.
    pub(crate) fn first_connector_id(&self, chain: EntityId) -> EntityId {
        let before = self.chains[..chain as usize].iter().map(|spec| spec.start.points().len());
        before.sum::<usize>() as EntityId
    }

    /// Returns what the connectors of a chain perceive; `leader` has the part `role`, the others follow.
    pub(crate) fn percepts(
        &self,
        sensed: SensingContext<'_, D>,
        leader: usize,
        role: &ConnectorRole<D>,
    ) -> Vec<ConnectorPercept<D>> {
        let SensingContext { chain, now, body, .. } = sensed;
        let first_id = self.first_connector_id(chain);
        let at_s = self.cycle_start_time_s(now);
        let sees_m = self.sensor_range_m(&self.chains[chain as usize]);
        let n = body.chain.points().len() as u32;
        let mut percepts = Vec::with_capacity(n as usize);
        for k in 0..n {
            let is_leader = k as usize == leader;
            let network = self.network.as_ref();
            let is_silent = network.is_some_and(|network| network.is_radio_off(first_id + k, at_s));
            percepts.push(ConnectorPercept {
                cycle: now,
                at: WirePoint(body.chain.points()[k as usize]),
                neighbors: NeighborSide::ALL.map(|side| sensed.neighbor_position(k, side)),
                max_bend_rad: body.chain.connectors()[k as usize].max_bend_rad,
                seen: sensed.obstacles_near(k, sees_m),
                is_silent,
                missing: body.missing.get(k as usize).copied().unwrap_or_default(),
                role: if is_leader { role.clone() } else { ConnectorRole::Follows },
            });
        }
        percepts
    }

    /// Returns the distance in which a connector's sensors see everything to which a motion of a cycle
    /// may bring its rods near, meters. Its master is at most a rod's length away, its own place at
    /// most another one, and both go on for as many sub-steps as the initiator makes.
    fn sensor_range_m(&self, spec: &ChainSpec<D>) -> f64 {
        let chain = &spec.start;
        let longest_m = chain.rods().iter().map(|rod| rod.max_m).fold(0.0, f64::max);
        let led_m = spec.tasks.iter().map(|task| task.speed_m_s * self.dt_s).fold(0.0, f64::max);
        let step_m = self.rules.step_m.unwrap_or(chain.step_m());
        let steps = (led_m / step_m).ceil() + 1.0;
        2.0 * longest_m + 2.0 * led_m.max(steps * self.rules.slave_step_max_m) + MARGIN_M
    }
}
