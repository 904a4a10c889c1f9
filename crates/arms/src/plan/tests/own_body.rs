//! Paths of chains that are in their own way.

use super::super::own_path::OwnPath;
use super::*;
use sidestep_kernel::math;
use sidestep_rods::geometry::{distance, segments_cross};

const SOLID: ReactionRules = ReactionRules {
    self_collision: true,
    rotation: sidestep_rods::RotationRule::Union,
    slave_step_max_m: f64::INFINITY,
    joint_step_max_m: f64::INFINITY,
    free_step_max_m: f64::INFINITY,
    backtracks: 64,
    step_m: None,
};

/// Returns a chain of equal rods in given directions, rad, from the origin.
fn chain_along(directions_rad: &[f64]) -> Chain<2> {
    let mut points = vec![[0.0, 0.0]];
    for (i, direction_rad) in directions_rad.iter().enumerate() {
        let [x, y] = points[i];
        points.push([x + 0.3 * math::cos(*direction_rad), y + 0.3 * math::sin(*direction_rad)]);
    }
    let rods = vec![Rod { min_m: 0.299, max_m: 0.301, radius_m: 0.01 }; directions_rad.len()];
    Chain::new(points.clone(), vec![Connector::free(0.02); points.len()], rods).unwrap()
}

/// Returns a spiral in which the tool lies innermost.
fn spiral(rods: usize) -> Chain<2> {
    let mut direction_rad = 0.0;
    let directions = (0..rods).map(|i| {
        let was_rad = direction_rad;
        direction_rad += 0.35 + 0.07 * i as f64;
        was_rad
    });
    chain_along(&directions.collect::<Vec<_>>())
}

/// Asserts that a path keeps rods and ends, and that no two rods cross anywhere on it.
fn assert_is_sound(chain: &Chain<2>, k: usize, path: &[ChainPosture<2>]) {
    let obstacles = Obstacles::default();
    let space = ChainConfigurationSpace::new(chain, &obstacles, true, k).unwrap();
    let mut from = space.present_posture();
    let n = from.len();
    for next in path {
        assert!(space.distance_m(&from, next) <= 4.0 * space.refined_step_m());
        for part in 1..=4 {
            let at = space.interpolate(&from, next, f64::from(part) / 4.0);
            for (i, connector) in chain.connectors().iter().enumerate() {
                let is_still = connector.mobility == Mobility::Fixed;
                assert!(!is_still || at[i] == chain.points()[i], "connector {i} has moved");
            }
            for i in 0..n - 1 {
                let length_m = distance(at[i], at[i + 1]);
                assert!((0.299 - 1e-9..=0.301 + 1e-9).contains(&length_m), "rod {i}: {length_m} m");
                for j in i + 2..n - 1 {
                    let crosses = segments_cross([at[i], at[i + 1]], [at[j], at[j + 1]]);
                    assert!(!crosses, "rods {i} and {j}");
                }
            }
        }
        from.clone_from(next);
    }
}

#[test]
fn a_way_through_the_chain_itself_is_seen_though_both_ends_are_free() {
    // The last of six rods is outside the jaw of the others.
    let jaw = |last_rad: f64| chain_along(&[0.0, 0.0, 1.5, 3.15, 3.9, last_rad]);
    let from = jaw(-2.9);
    let obstacles = Obstacles::default();
    let space = ChainConfigurationSpace::new(&from, &obstacles, true, 6).unwrap();
    let present = space.present_posture();
    let [away, through] = [2.8, 0.0].map(|last_rad| jaw(last_rad).points().to_vec());
    assert!(space.is_free(&away) && space.is_free(&through));
    assert!(space.is_path_free(&present, &away), "the rod turns away from the others");
    assert!(!space.is_path_free(&present, &through), "it would pass through the first rod");
    let thin = ChainConfigurationSpace::new(&from, &obstacles, false, 6).unwrap();
    assert!(thin.is_path_free(&present, &through), "which is not solid here");
}

#[test]
fn a_jump_is_no_way_of_a_chain_that_is_projected() {
    let chain = chain_along(&[0.3, -0.3]);
    let from = chain.points().to_vec();
    let mut to = from.clone();
    to[1][1] = -to[1][1];
    let is_clear = |even_m: f64| {
        let jumping = |fraction: f64| Some(if fraction < 0.41 { from.clone() } else { to.clone() });
        let way = OwnPath {
            chain: &chain,
            from: &from,
            to: &to,
            posture_at: jumping,
            is_solid: true,
            step_m: 1e-3,
            even_m,
        };
        way.is_clear()
    };
    assert!(!is_clear(0.02));
    assert!(is_clear(f64::INFINITY), "a rod that goes evenly turns as far in one piece");
}

#[test]
fn a_spiral_unfolds_and_any_place_can_be_reached_from_it() {
    for (rods, target) in [(12, [1.0, -1.5]), (16, [-2.0, 0.4]), (16, [0.2, 0.1])] {
        let chain = spiral(rods);
        let query = PlanningQuery { k: rods, target, tolerance_m: 1e-3 };
        let path = plan(&chain, &Obstacles::default(), SOLID, &query, &mut draws(1)).unwrap();
        let path = path.unwrap_or_else(|| panic!("{rods} rods: no path to {target:?}"));
        assert_is_sound(&chain, rods, &path);
        assert!(distance(path.last().unwrap()[rods], target) <= query.tolerance_m);
    }
}

#[test]
fn repulsion_alone_opens_a_spiral() {
    let chain = spiral(14);
    let obstacles = Obstacles::default();
    let space = ChainConfigurationSpace::new(&chain, &obstacles, true, 14).unwrap();
    let trail = space.unfolding_postures(&space.present_posture(), |_| false);
    let last = trail.last().expect("a way out");
    let stretched_m = distance(last[0], last[14]);
    assert!(stretched_m > 0.9 * 0.3 * 14.0, "{stretched_m} m after {} steps", trail.len());
    assert_is_sound(&chain, 14, &refined_path(&space, trail).expect("a short path"));
}

/// Returns a chain between two fixed ends, in an arc above them.
fn arch(rods: usize) -> Chain<2> {
    let bend_rad = -3.9 / rods as f64;
    let first_rad = -0.5 * bend_rad * (rods as f64 - 1.0);
    let directions: Vec<f64> = (0..rods).map(|i| first_rad + i as f64 * bend_rad).collect();
    let mut chain = chain_along(&directions);
    chain.set_mobility(0, Mobility::Fixed).unwrap();
    chain.set_mobility(rods, Mobility::Fixed).unwrap();
    chain
}

#[test]
fn a_chain_between_two_ends_is_led_to_both_sides_of_them() {
    let chain = arch(12);
    let end = chain.points()[12];
    for target in [[0.5 * end[0], 1.0], [0.5 * end[0], -0.9], [0.2, 0.3], [1.4, 0.6]] {
        let query = PlanningQuery { k: 6, target, tolerance_m: 1e-3 };
        let path = plan(&chain, &Obstacles::default(), SOLID, &query, &mut draws(1)).unwrap();
        let path = path.unwrap_or_else(|| panic!("no path to {target:?}"));
        assert_is_sound(&chain, 6, &path);
        assert!(distance(path.last().unwrap()[6], target) <= query.tolerance_m);
    }
}
