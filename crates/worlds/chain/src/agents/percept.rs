//! The percept of a connector at the start of a cycle: the only input of its agent besides messages.

use crate::motion::recovery::{InitiatorSituation, RecoveryMemory};
use serde::{Deserialize, Serialize};
use sidestep_kernel::{Cycle, EntityId, InputError};
use sidestep_rods::geometry::{ConvexCore, Cuboid, Point, distance};
use sidestep_rods::serde_point::WirePoint;
use sidestep_rods::{Obstacle, RequestSource, is_in_range};
use std::f64::consts::PI;

/// A connector's perception at the start of a cycle.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ConnectorPercept<const D: usize> {
    /// The cycle that begins with this percept.
    pub cycle: Cycle,
    /// Its position, meters.
    pub at: WirePoint<D>,
    /// The positions of the neighbors below and above, where there is one.
    pub neighbors: [Option<WirePoint<D>>; 2],
    /// Its bend limit in this cycle, rad.
    pub max_bend_rad: f64,
    /// Obstacles that its sensors see: all those to which a motion of this cycle may bring it near.
    pub seen: Vec<SensedObstacle>,
    /// Whether its radio is dead in this cycle.
    pub is_silent: bool,
    /// The nearest lost connectors below and above, as it knew at the end of the cycle before.
    pub missing: [Option<u32>; 2],
    /// Its role in this cycle.
    pub role: ConnectorRole<D>,
}

/// Id of a chain, and what each of its connectors perceives, from connector 0 on.
pub type ChainPercepts<const D: usize> = (EntityId, Vec<ConnectorPercept<D>>);

/// Whether a connector leads its chain in a cycle, which only one does.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum ConnectorRole<const D: usize> {
    /// Another one leads: it answers its neighbors.
    Follows,
    /// It leads the chain, which rests.
    Rests,
    /// It leads the chain.
    Leads(Intention<D>),
}

/// A leader's intention in a cycle: its own, or by order of a planner or an operator.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Intention<const D: usize> {
    /// The position that it wants to reach by the end of the cycle, meters.
    pub to: WirePoint<D>,
    /// Who wants it, which decides what the leader tries after a veto.
    pub source: RequestSource,
    /// Its knowledge beside its neighborhood.
    pub situation: InitiatorSituation,
    /// Its memory of vetoes in earlier cycles.
    pub memory: RecoveryMemory,
    /// Whether it is known that there is no obstacle anywhere.
    pub is_empty: bool,
    /// Whether it is known that nothing can veto.
    pub is_open: bool,
}

/// An obstacle as sensors see it, without its velocity.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SensedObstacle {
    /// Its id in vetoes.
    pub id: u32,
    /// Its reach beyond its core, meters.
    pub radius_m: f64,
    /// Coordinates of its core in `D` dimensions, meters: of a point (`D`), of the two ends of a segment
    /// (`2 D`), or of a box: middle, directions of its edges, half its extents (`D (D + 2)`).
    pub core: Vec<f64>,
}

impl SensedObstacle {
    /// Returns an obstacle in numbers of any dimension.
    pub fn from_obstacle<const D: usize>(obstacle: &Obstacle<D>) -> Self {
        let core = match &obstacle.core {
            ConvexCore::Point(at) => at.to_vec(),
            ConvexCore::Segment(ends) => ends.as_flattened().to_vec(),
            ConvexCore::Cuboid(Cuboid { center, axes, half_m }) => {
                [center, axes.as_flattened(), half_m].concat()
            }
        };
        Self { id: obstacle.id, radius_m: obstacle.radius_m, core }
    }

    /// Returns the obstacle; none if its core is of no shape.
    pub fn to_obstacle<const D: usize>(&self) -> Option<Obstacle<D>> {
        let core = match self.core.len() {
            n if n == D => ConvexCore::Point(self.point(0)),
            n if n == 2 * D => ConvexCore::Segment([self.point(0), self.point(1)]),
            n if n == D * (D + 2) => ConvexCore::Cuboid(Cuboid {
                center: self.point(0),
                axes: std::array::from_fn(|axis| self.point(1 + axis)),
                half_m: self.point(1 + D),
            }),
            _ => return None,
        };
        Some(Obstacle::new_static(self.id, core, self.radius_m))
    }

    /// Returns the coordinates `k` times `D` and after.
    fn point<const D: usize>(&self, k: usize) -> Point<D> {
        std::array::from_fn(|i| self.core[k * D + i])
    }
}

fn invalid_percept(me: u32, cause: &str) -> InputError {
    let remedy = "give what its sensors have measured: finite numbers, up to 1e6 m";
    InputError::new(format!("sight of connector {me}"), cause.to_string(), remedy)
}

impl<const D: usize> ConnectorPercept<D> {
    /// Returns the distances to the neighbors below and above, where there is one, meters.
    pub fn neighbor_distances_m(&self) -> [Option<f64>; 2] {
        self.neighbors.map(|place| place.map(|WirePoint(at)| distance(self.at.0, at)))
    }

    /// Returns the obstacles in sight.
    ///
    /// # Errors
    /// When a number is invalid for connector `me` of `n`.
    pub(super) fn validated_obstacles(
        &self,
        me: u32,
        n: u32,
    ) -> Result<Vec<Obstacle<D>>, InputError> {
        let places = self.neighbors.iter().flatten().chain(std::iter::once(&self.at));
        if !places.map(|WirePoint(at)| at).all(is_in_range) {
            return Err(invalid_percept(me, "a place is out of range"));
        }
        if self.neighbors.map(|place| place.is_some()) != [me > 0, me + 1 < n] {
            let cause = "its neighbors are not those of its place in the chain";
            return Err(invalid_percept(me, cause));
        }
        if !(self.max_bend_rad > 0.0 && self.max_bend_rad <= PI) {
            return Err(invalid_percept(me, "its bend limit is not in (0, pi]"));
        }
        if self.missing.iter().flatten().any(|&k| k >= n || k == me) {
            return Err(invalid_percept(me, "a lost connector is none of its chain"));
        }
        let seen = self.seen.iter().map(SensedObstacle::to_obstacle);
        seen.collect::<Option<_>>().ok_or_else(|| invalid_percept(me, "an obstacle has no shape"))
    }
}
