//! Chains that are pulled through the pinned corridor.

use crate::fixtures::{clearance_m, corridor_line, corridor_walls, straight_chain};
use sidestep_rods::geometry::distance;
use sidestep_rods::{
    MotionOutcome, MotionRequest, Obstacles, Propagator, ReactionRules, Rod, RotationRule,
};

/// The leader's start: in the first, straight part, which is 14 m long.
const LEAD_M: f64 = 13.0;

struct Run {
    vetoes: usize,
    least_clearance_m: f64,
    worst_rod_m: f64,
    /// The longest way of a slave in one step, in steps of the leader.
    longest_slave_steps: f64,
}

/// Pulls a chain along the middle of the corridor.
fn through_the_corridor(
    width_m: f64,
    followers: usize,
    rod: Rod,
    step_m: f64,
    rotation: RotationRule,
) -> Run {
    let mut chain = straight_chain(LEAD_M, followers, rod, 0.25);
    let obstacles = Obstacles::new(corridor_walls(width_m), rod.max_m + 0.5).unwrap();
    let mut propagator = Propagator::new(ReactionRules { rotation, ..ReactionRules::default() });
    let mut run =
        Run { vetoes: 0, least_clearance_m: 1.0, worst_rod_m: 0.0, longest_slave_steps: 0.0 };
    let line = corridor_line(step_m);
    let last = line.len() - (1.0 / step_m) as usize;
    for (at, _) in line[..last].iter().filter(|(at, _)| at[0] > LEAD_M || at[1] != 0.0) {
        let way_m = distance(*at, chain.points()[0]);
        let request = MotionRequest::from_operator(0, *at);
        match propagator.propagate(&mut chain, &obstacles, &request).unwrap() {
            MotionOutcome::Moved(moved) => {
                let steps = moved.max_slave_step_m / way_m;
                run.longest_slave_steps = run.longest_slave_steps.max(steps);
            }
            MotionOutcome::Vetoed(_) => run.vetoes += 1,
        }
        run.least_clearance_m = run.least_clearance_m.min(clearance_m(&chain, &obstacles));
        run.worst_rod_m = run.worst_rod_m.max(chain.max_rod_violation_m());
    }
    run
}

fn assert_clean(width_m: f64, followers: usize, rod: Rod, step_m: f64) -> Run {
    let what = format!("width {width_m}, {followers} followers, {rod:?}, step {step_m}");
    let run = through_the_corridor(width_m, followers, rod, step_m, RotationRule::Union);
    assert_eq!(run.vetoes, 0, "{what}");
    assert!(run.least_clearance_m >= -1e-9, "{what}: {}", run.least_clearance_m);
    assert!(run.worst_rod_m <= 1e-9, "{what}: {}", run.worst_rod_m);
    run
}

const WIDTHS_M: [f64; 5] = [1.2, 1.6, 2.0, 2.5, 3.0];
const LENGTHS_M: [(f64, f64); 3] = [(0.6, 0.8), (1.0, 1.0), (1.5, 1.5)];

/// Rods of 1.5 m as thick as the robots cannot go around the narrowest bend of the narrowest corridor.
fn fits_round(width_m: f64, rod: Rod) -> bool {
    !(width_m == 1.2 && rod.max_m == 1.5 && rod.radius_m == 0.25)
}

/// The whole table is printed by the bench of `sidestep-rods`, part `corridors`.
#[test]
fn a_pulled_chain_never_objects_in_the_pinned_corridor() {
    for width_m in WIDTHS_M {
        for (min_m, max_m) in LENGTHS_M {
            for radius_m in [0.05, 0.25] {
                let rod = Rod { min_m, max_m, radius_m };
                if fits_round(width_m, rod) {
                    assert_clean(width_m, 15, rod, 0.1);
                }
            }
        }
    }
}

#[test]
fn long_steps_through_the_corridor_are_cut_to_safe_ones() {
    let rod = Rod { min_m: 0.6, max_m: 0.8, radius_m: 0.05 };
    assert_clean(2.0, 15, rod, 0.2);
}

#[test]
fn thin_rods_do_not_make_slaves_jump_in_the_corridor() {
    let rod = Rod { min_m: 0.6, max_m: 0.8, radius_m: 0.05 };
    for width_m in [1.2, 1.6, 2.0] {
        let run = assert_clean(width_m, 40, rod, 0.01);
        assert!(run.longest_slave_steps < 1.3, "{width_m}: {}", run.longest_slave_steps);
    }
}

#[test]
fn the_literal_rule_runs_into_walls_where_the_union_does_not() {
    let rod = Rod { min_m: 0.6, max_m: 0.8, radius_m: 0.05 };
    let run = through_the_corridor(2.0, 15, rod, 0.05, RotationRule::Literal);
    assert!(run.least_clearance_m < -0.005, "{}", run.least_clearance_m);
}
