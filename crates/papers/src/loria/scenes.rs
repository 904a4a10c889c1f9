//! Where robots go, as a picture shows it: on the medium floor, all reliable and nothing.

use super::Plan;
use super::floor::Floor;
use super::measure::{Variant, recorded};
use sidestep::kernel::Cycle;
use sidestep::worlds::robots::simulation::RobotsSimulation;
use sidestep::worlds::robots::world::Regime;
use std::sync::Arc;

/// A run that is to be seen, and the ways of its robots up to now.
pub struct Scene {
    /// What it shows.
    pub title: &'static str,
    /// The run at its end.
    pub simulation: RobotsSimulation,
    /// The cycle at which the ways begin.
    pub from: Cycle,
    /// Of each robot, by entity id, its places by cycle.
    pub ways: Vec<(u32, Vec<Place>)>,
}

/// Column and row, and the heading in which they are left.
pub type Place = ((u32, u32), u32);

/// Cycles of a run: all robots are on their way then.
const CYCLES: Cycle = 600;
/// Of which so many are seen.
const SEEN: Cycle = 400;
/// The seed of all scenes.
pub const SEED: u64 = 1;

/// All pictures: the same floor and seed, without errors and with both.
pub fn all(plan: &Plan) -> [Scene; 2] {
    let floor = Arc::new(Floor::medium());
    let scene =
        |title, regime| scene(title, &Variant::new(&floor, regime), CYCLES.min(plan.cycles));
    [
        scene("Ways of robots, all reliable", Regime::Reliable),
        scene("Ways of the same robots, sensors and effectors unreliable", Regime::Both),
    ]
}

fn scene(title: &'static str, variant: &Variant, cycles: Cycle) -> Scene {
    let (simulation, tracks) = recorded(variant, &variant.behaviours(), SEED, cycles);
    let from = cycles.saturating_sub(SEEN);
    let way = |id: u32| {
        let seen = &tracks[id as usize][from as usize..];
        let now = simulation.snapshot().bodies[id as usize].at;
        let left = seen.iter().map(|&(col, row, heading)| ((col, row), u32::from(heading)));
        (id, left.chain([(now, 0)]).collect())
    };
    let ways = simulation.world().robots().iter().map(|&id| way(id)).collect();
    Scene { title, simulation, from, ways }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sidestep::kernel::Simulation;

    #[test]
    fn ways_are_whole_and_end_where_the_robots_are() {
        let scenes = all(&Plan { cycles: 450, ..Plan::quick() });
        for scene in &scenes {
            assert_eq!((scene.from, scene.ways.len()), (50, scene.simulation.agents()));
            let steps = |way: &[Place]| {
                let far = |pair: &[Place]| {
                    let ((a, b), (c, d)) = (pair[0].0, pair[1].0);
                    a.abs_diff(c).max(b.abs_diff(d))
                };
                way.windows(2).map(far).max()
            };
            for (_, way) in &scene.ways {
                assert_eq!(way.len() as Cycle, SEEN + 1);
                assert!(steps(way) <= Some(2), "no way leaps");
            }
        }
        assert_ne!(scenes[0].ways, scenes[1].ways);
    }
}
