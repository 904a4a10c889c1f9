//! A driver of the program's own: what its initiator perceives, and what it proposes.

use super::Initiator;
use crate::driver::own_driver::{DriverAction, DriverPercept, NearbyObstacle, OwnDriver};
use crate::state::ChainBodyState;
use crate::world::{OTHER_CHAIN, purpose};
use sidestep_rods::geometry::{Aabb, Point, convert_dimensions, norm, scaled, sub};
use sidestep_rods::{Chain, Obstacles};
use std::cmp::Ordering;

/// Returns what a driver of the program's own proposes.
pub(super) fn ask_own_driver<const D: usize>(
    initiator: Initiator<'_, D>,
    body: &mut ChainBodyState<D>,
    driver: &OwnDriver,
) -> DriverAction {
    let Initiator { context, task, .. } = initiator;
    let connectors_m: Vec<Point<3>> =
        body.chain.points().iter().map(|at| convert_dimensions(*at)).collect();
    let look_m = context.world.look_m;
    let obstacles = nearby_obstacles(&body.chain, task.agent, context.obstacles, look_m);
    let percept = DriverPercept {
        now: context.now,
        cycles: body.driving.cycles,
        idle: body.driving.idle,
        dt_s: context.world.dt_s,
        step_m: initiator.step_m(),
        connector: task.agent,
        connectors_m: &connectors_m,
        ahead: body.driving.ahead,
        objection: body.driving.objection,
        obstacles: &obstacles,
    };
    let draws = &mut context.random_draws(purpose::DRIVER);
    driver.decide(&percept, &mut body.driver_memory, draws)
}

/// Returns the obstacles within `look_m` of a connector, the nearest first.
fn nearby_obstacles<const D: usize>(
    chain: &Chain<D>,
    k: usize,
    obstacles: &Obstacles<D>,
    look_m: f64,
) -> Vec<NearbyObstacle> {
    let at = chain.points()[k];
    let radius_m = chain.connectors()[k].radius_m;
    let room = Aabb::from_points(&[at]).grown(radius_m + look_m);
    let mut nearby = Vec::new();
    obstacles.visit(&room, |obstacle| {
        let nearest = obstacle.core.nearest_to_point(at);
        let gap_m = nearest.distance_m - radius_m - obstacle.radius_m;
        if gap_m > look_m {
            return;
        }
        let to_core = sub(nearest.on_core, at);
        let fraction = 1.0 - obstacle.radius_m / norm(to_core);
        // In the very middle of a ball its surface lies in no direction.
        let to_surface = if fraction.is_finite() { scaled(to_core, fraction) } else { [0.0; D] };
        nearby.push(NearbyObstacle {
            // Ids from there on are those of the parts of other chains.
            id: (obstacle.id < OTHER_CHAIN).then_some(obstacle.id),
            gap_m,
            to_surface_m: convert_dimensions(to_surface),
            velocity_m_s: convert_dimensions(obstacle.velocity_m_s),
        });
    });
    // A full order, because obstacles are visited in that of the grid.
    nearby.sort_by(|a, b| {
        let by_gap = a.gap_m.total_cmp(&b.gap_m);
        by_gap.then(a.id.cmp(&b.id)).then_with(|| compare_points(a.to_surface_m, b.to_surface_m))
    });
    nearby
}

fn compare_points(a: Point<3>, b: Point<3>) -> Ordering {
    let [x, y, z] = [0, 1, 2].map(|i| a[i].total_cmp(&b[i]));
    x.then(y).then(z)
}

#[cfg(test)]
mod tests {
    use super::*;
    use sidestep_rods::{Connector, Obstacle, Rod};

    #[test]
    fn the_nearest_obstacle_comes_first() {
        let chain = Chain::straight(
            [0.0, 0.0],
            [-1.0, 0.0],
            2,
            Rod::with_fixed_length(0.5, 0.01),
            Connector::free(0.1),
        )
        .expect("a chain");
        let ball = |id: u32, x: f64| Obstacle::ball(id, [x, 0.0], 0.2);
        let obstacles =
            Obstacles::new(vec![ball(4, 1.0), ball(OTHER_CHAIN, 0.5), ball(5, 9.0)], 1.0);
        let nearby = nearby_obstacles(&chain, 0, &obstacles.expect("balls"), 2.0);
        let ids: Vec<Option<u32>> = nearby.iter().map(|one| one.id).collect();
        assert_eq!(ids, [None, Some(4)]);
        assert!((nearby[1].gap_m - 0.7).abs() < 1e-12, "{nearby:?}");
        assert!((nearby[1].to_surface_m[0] - 0.8).abs() < 1e-12, "{nearby:?}");
    }
}
