//! The parts of a chain near a moving obstacle, with their distances.

use sidestep_rods::geometry::{Aabb, Point, distance, normalized, perpendicular, sub, unit_x};
use sidestep_rods::{Chain, ChainPart, Obstacle, Obstacles, RodBvh};
use std::ops::Range;

/// Returns whether a part is one of some connectors, or a rod that ends at one of them.
pub(super) fn is_among(part: ChainPart, connectors: &Range<usize>) -> bool {
    connectors.contains(&part.connector()) || connectors.contains(&part.last_connector())
}

/// A part and a moving obstacle that may get too near to each other in this tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Threat {
    pub(super) part: ChainPart,
    /// Index among [`Obstacles::moving`].
    pub(super) mover: usize,
    /// The free space required around the obstacle, meters.
    pub(super) margin_m: f64,
    /// Depth of the part in that space, as last measured, meters.
    pub(super) depth_m: f64,
    /// Whether it could not be relieved.
    pub(super) given_up: bool,
}

/// The position of a part relative to an obstacle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ObstacleProximity<const D: usize> {
    /// Distance of the surfaces, meters; negative if they overlap.
    pub(super) gap_m: f64,
    /// Unit vector from the obstacle to the part. If the cores overlap it is perpendicular to the obstacle's velocity,
    /// to its left.
    pub(super) away: Point<D>,
    /// Position on the rod: 0 at its first end, 1 at its second.
    pub(super) along_rod: f64,
}

/// Returns the position of a part relative to an obstacle.
pub(super) fn obstacle_proximity<const D: usize>(
    chain: &Chain<D>,
    part: ChainPart,
    mover: &Obstacle<D>,
) -> ObstacleProximity<D> {
    let (body, radius_m) = part_body(chain, part);
    let nearest = mover.core.nearest_to_segment(body);
    let length_m = distance(body[0], body[1]);
    let along_rod =
        if length_m > 0.0 { distance(body[0], nearest.on_body) / length_m } else { 0.0 };
    ObstacleProximity {
        gap_m: nearest.distance_m - mover.radius_m - radius_m,
        away: normalized(sub(nearest.on_body, nearest.on_core))
            .unwrap_or_else(|| leftward_direction(mover)),
        along_rod,
    }
}

/// Returns the distance of the surfaces of a part and an obstacle, meters; negative if they overlap.
pub(super) fn gap_m<const D: usize>(chain: &Chain<D>, part: ChainPart, mover: &Obstacle<D>) -> f64 {
    let (body, radius_m) = part_body(chain, part);
    mover.core.nearest_to_segment(body).distance_m - mover.radius_m - radius_m
}

/// Returns the ends of a part, and its radius, meters.
fn part_body<const D: usize>(chain: &Chain<D>, part: ChainPart) -> ([Point<D>; 2], f64) {
    let points = chain.points();
    match part {
        ChainPart::Connector(i) => ([points[i]; 2], chain.connectors()[i].radius_m),
        ChainPart::Rod(i) => ([points[i], points[i + 1]], chain.rods()[i].radius_m),
    }
}

/// Returns the direction perpendicular to the velocity of an obstacle, to its left.
pub(super) fn leftward_direction<const D: usize>(mover: &Obstacle<D>) -> Point<D> {
    perpendicular(normalized(mover.velocity_m_s).unwrap_or(unit_x()))
}

/// Collects all parts that are nearer than `within_m` to a moving obstacle.
pub(super) fn collect_threats<const D: usize>(
    chain: &Chain<D>,
    obstacles: &Obstacles<D>,
    body: &mut RodBvh<D>,
    within_m: impl Fn(&Obstacle<D>) -> f64,
    threats: &mut Vec<Threat>,
) {
    threats.clear();
    if obstacles.moving().is_empty() {
        return;
    }
    let n_rods = chain.rods().len();
    body.rebuild((0..n_rods).map(|i| rod_box(chain, i)));
    // Parts of other chains are among the moving obstacles, but chains do not escape from them: both stay in their
    // claims, and two that escaped from each other would push each other away for ever.
    let movers = obstacles.moving().iter().enumerate();
    for (k, mover) in movers.filter(|(_, mover)| mover.is_moving()) {
        let within_m = within_m(mover);
        let reach = ThreatZone { chain, mover, index: k, within_m };
        body.visit(&mover.bounds().grown(within_m), |rod| {
            reach.add_if_near(ChainPart::Connector(rod), threats);
            reach.add_if_near(ChainPart::Rod(rod), threats);
        });
        // The last connector starts no rod.
        reach.add_if_near(ChainPart::Connector(n_rods), threats);
    }
}

/// The surroundings of an obstacle in which parts are threatened.
struct ThreatZone<'a, const D: usize> {
    chain: &'a Chain<D>,
    mover: &'a Obstacle<D>,
    /// Index among [`Obstacles::moving`].
    index: usize,
    within_m: f64,
}

impl<const D: usize> ThreatZone<'_, D> {
    #[inline]
    fn add_if_near(&self, part: ChainPart, threats: &mut Vec<Threat>) {
        if gap_m(self.chain, part, self.mover) < self.within_m {
            let mover = self.index;
            threats.push(Threat { part, mover, margin_m: 0.0, depth_m: 0.0, given_up: false });
        }
    }
}

fn rod_box<const D: usize>(chain: &Chain<D>, i: usize) -> Aabb<D> {
    // Rods are no thicker than their connectors.
    let radius_m = chain.connectors()[i].radius_m.max(chain.connectors()[i + 1].radius_m);
    Aabb::from_points(&[chain.points()[i], chain.points()[i + 1]]).grown(radius_m)
}
