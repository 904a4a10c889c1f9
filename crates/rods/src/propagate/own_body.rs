//! Checks of a chain's own body that concern more than one reaction: of the neighbors of a part where a sweep ends,
//! and of the paths of all parts that a request moves.

use super::{ConnectorVeto, PropagationContext, Propagator};
use crate::chain::Chain;
use crate::geometry::distance_of_segments_m;
use crate::motion_context::{IncompleteVeto, MotionContext, contact_distance_m};
use crate::own_body::{ChainPart, ChainSweep, ROUNDING_M};
use crate::pass::ChainDirection;
use crate::veto::VetoReason;

impl<const D: usize> MotionContext<'_, D> {
    /// Returns whether the parts beyond a slave at which a sweep ends keep their distances from those before it. Parts
    /// near along the chain are checked only once both have their places; these have theirs now.
    pub(super) fn may_end_at(&self, sweep: PropagationContext<'_, D>, slave: usize) -> bool {
        if !self.rules.self_collision {
            return true;
        }
        let mut outer = slave;
        // The parts of the next two connectors are near moved ones; those farther out are near none.
        for _ in 0..2 {
            let Some(next) = sweep.next(outer) else { return true };
            outer = next;
            if !self.are_neighbors_apart(outer, sweep.direction) {
                return false;
            }
        }
        true
    }

    /// Returns whether the connector and the rod that end at `outer` keep their distances from the parts near along the
    /// chain toward the initiator.
    fn are_neighbors_apart(&self, outer: usize, direction: ChainDirection) -> bool {
        let connectors = self.chain.points().len();
        let [rod, near_rod, far_rod, near_connector] = match direction {
            ChainDirection::Up => {
                [Some(outer - 1), outer.checked_sub(2), outer.checked_sub(3), outer.checked_sub(2)]
            }
            ChainDirection::Down => {
                let up_to = |k: usize, end: usize| (k < end).then_some(k);
                let rods = connectors - 1;
                [
                    Some(outer),
                    up_to(outer + 1, rods),
                    up_to(outer + 2, rods),
                    up_to(outer + 2, connectors),
                ]
            }
        };
        let rod = rod.map(ChainPart::Rod);
        let near_connector = near_connector.map(ChainPart::Connector);
        let connector = Some(ChainPart::Connector(outer));
        let pairs = [
            (rod, far_rod.map(ChainPart::Rod)),
            (rod, near_connector),
            (connector, near_rod.map(ChainPart::Rod)),
            (connector, near_connector),
        ];
        // The connectors below the initiator follow in the second sweep, which checks them.
        let first_settled = match direction {
            ChainDirection::Up => self.tentative.from,
            ChainDirection::Down => 0,
        };
        pairs.into_iter().all(|pair| match pair {
            (Some(one), Some(other)) => {
                other.connector() < first_settled || self.keeps_distance([one, other])
            }
            _ => true,
        })
    }

    /// Returns whether two parts keep their distance, or come no nearer than before.
    fn keeps_distance(&self, [one, other]: [ChainPart; 2]) -> bool {
        let Some(separation_m) = self.chain.min_separation_m(one, other) else { return true };
        let ends_now =
            |part: ChainPart| [part.connector(), part.last_connector()].map(|k| self.position(k));
        let now_m = distance_of_segments_m(ends_now(one), ends_now(other));
        if now_m >= contact_distance_m(separation_m) {
            return true;
        }
        let points = self.chain.points();
        now_m >= distance_of_segments_m(one.ends(points), other.ends(points)) - ROUNDING_M
    }
}

impl<const D: usize> Propagator<D> {
    /// Checks the paths of all parts that have moved against each other. Each reaction was checked against parts at
    /// rest; that two parts pass each other, both in motion, only this check sees.
    pub(super) fn check_own_paths(&self, chain: &Chain<D>) -> Result<(), ConnectorVeto> {
        if !self.rules.self_collision {
            return Ok(());
        }
        let sweep = ChainSweep {
            chain,
            from: chain.points(),
            moved: self.tentative.moved_range(),
            to: self.tentative.positions(),
        };
        match sweep.find_passage(&self.own_rods) {
            None => Ok(()),
            Some([_, other]) => {
                Err((other.last_connector(), IncompleteVeto::new(VetoReason::SelfCollision)))
            }
        }
    }
}
