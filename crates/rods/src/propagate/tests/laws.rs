//! Laws that hold after every request, in worlds of every kind.

use super::*;
use crate::fixtures::{AnyWorld, apart_m, depth_of_part_m, own_clearance_m};

const TOLERANCE: f64 = 1.1e-9;

/// Makes requests of any kind, and looks after each one whether all laws hold.
fn keeps_the_laws<const D: usize>(seed: u64) {
    let mut world = AnyWorld::<D>::new(seed);
    let mut propagator = Propagator::new(world.rules);
    for k in 0..12 {
        let request = world.any_request([0.03, 0.3][k % 2]);
        let before = world.chain.clone();
        let AnyWorld { chain, obstacles, .. } = &mut world;
        let outcome = propagator.propagate(chain, obstacles, &request).unwrap();
        match &outcome {
            MotionOutcome::Vetoed(_) => {
                assert_eq!(bits(chain), bits(&before), "a veto leaves every bit")
            }
            MotionOutcome::Moved(moved) => touches_what_it_says(&before, chain, moved),
        }
        is_whole(chain, &before);
        is_clear(&world, seed);
    }
}

fn touches_what_it_says<const D: usize>(
    before: &Chain<D>,
    after: &Chain<D>,
    moved: &CompletedMotion<D>,
) {
    let (old, new) = (bits(before), bits(after));
    let changed: Vec<_> = (0..new.len()).filter(|&i| new[i] != old[i]).collect();
    assert!(changed.iter().all(|i| moved.touched.contains(i)), "{changed:?} {moved:?}");
    assert!(moved.changed >= changed.len());
}

fn is_whole<const D: usize>(chain: &Chain<D>, before: &Chain<D>) {
    assert!(chain.max_rod_violation_m() <= 1e-9);
    for (i, connector) in chain.connectors().iter().enumerate() {
        let at = chain.points()[i];
        if connector.is_still() {
            assert_eq!(at.map(f64::to_bits), before.points()[i].map(f64::to_bits));
        }
        assert!(connector.mobility.allows(at, at), "{connector:?} {at:?}");
        if let Some(bend_rad) = chain.bend_rad(i) {
            assert!(bend_rad <= connector.max_bend_rad + TOLERANCE, "{i}: {bend_rad}");
        }
    }
}

fn is_clear<const D: usize>(world: &AnyWorld<D>, seed: u64) {
    for o in &world.all {
        let apart_m = apart_m(&world.chain, o);
        assert!(apart_m >= -TOLERANCE, "seed {seed}, {o:?}: {apart_m}");
    }
    if world.rules.self_collision {
        let apart_m = own_clearance_m(&world.chain);
        assert!(apart_m >= -TOLERANCE, "seed {seed}: {apart_m} to itself");
    }
}

#[test]
fn rods_bends_clearances_and_bases_keep_the_laws_in_any_world() {
    for seed in 0..400 {
        keeps_the_laws::<2>(seed);
        keeps_the_laws::<3>(seed);
    }
}

/// `cargo test --release -- --ignored many_worlds`
#[test]
#[ignore = "minutes; four hundred worlds run every day"]
fn many_worlds_keep_the_laws() {
    for seed in 0..100_000 {
        keeps_the_laws::<2>(seed);
        keeps_the_laws::<3>(seed);
    }
}

/// Takes away the constraint that a veto names; the same request must succeed, or fail elsewhere.
fn without<const D: usize>(world: &AnyWorld<D>, veto: &Veto<D>) -> AnyWorld<D> {
    let mut rules = world.rules;
    let mut chain = world.chain.clone();
    match veto.reason {
        VetoReason::Fixed | VetoReason::Failed | VetoReason::Mobility => {
            chain.set_connector_failed(veto.by, false);
            chain.set_mobility(veto.by, Mobility::Free).unwrap();
        }
        VetoReason::BendLimit => {
            for i in veto.by.saturating_sub(1)..(veto.by + 2).min(chain.points().len()) {
                chain.set_max_bend_rad(i, std::f64::consts::PI).unwrap();
            }
        }
        VetoReason::SelfCollision => rules.self_collision = false,
        VetoReason::StepLimit => rules.slave_step_max_m = f64::INFINITY,
        VetoReason::Limit => rules.backtracks = usize::MAX,
        _ => {}
    }
    let all: Vec<_> = world.all.iter().filter(|o| Some(o.id) != veto.obstacle).copied().collect();
    let obstacles = Obstacles::new(all.clone(), 0.8).unwrap();
    AnyWorld { chain, all, obstacles, rules, numbers: TestRng::new(0) }
}

fn blames_what_matters<const D: usize>(seed: u64, blamed: &mut Vec<VetoReason>) {
    let mut world = AnyWorld::<D>::new(seed);
    for _ in 0..6 {
        let request = MotionRequest { mode: VetoEffect::Exact, ..world.any_request(0.3) };
        let ask = |world: &AnyWorld<D>| {
            let mut chain = world.chain.clone();
            let mut propagator = Propagator::new(world.rules);
            (propagator.propagate(&mut chain, &world.obstacles, &request).unwrap(), chain)
        };
        let (outcome, moved) = ask(&world);
        let Some(veto) = outcome.veto() else {
            world.chain = moved;
            continue;
        };
        let (again, _) = ask(&without(&world, veto));
        let what = |v: &Veto<D>| (v.by, v.reason, v.obstacle);
        assert_ne!(again.veto().map(what), Some(what(veto)), "seed {seed}");
        if !blamed.contains(&veto.reason) {
            blamed.push(veto.reason);
        }
    }
}

#[test]
fn a_veto_names_a_constraint_without_which_it_is_gone_or_elsewhere() {
    let mut blamed = Vec::new();
    for seed in 0..400 {
        blames_what_matters::<2>(seed, &mut blamed);
        blames_what_matters::<3>(seed, &mut blamed);
    }
    for reason in [
        VetoReason::Fixed,
        VetoReason::Failed,
        VetoReason::Mobility,
        VetoReason::TargetBlocked,
        VetoReason::BothSidesBlocked,
        VetoReason::BendLimit,
        VetoReason::SelfCollision,
        VetoReason::StepLimit,
    ] {
        assert!(blamed.contains(&reason), "{reason:?} never happened");
    }
}

/// Obstacles placed over a part of the chain: the chain may leave, but not go deeper.
fn goes_no_deeper<const D: usize>(seed: u64) -> usize {
    let mut world = AnyWorld::<D>::new(seed);
    let n = world.chain.points().len();
    let mut numbers = TestRng::new(seed + 1_000_000);
    for id in 0..3 {
        let at = world.chain.points()[(numbers.unit() * n as f64) as usize];
        world.all.push(Obstacle::ball(900 + id, add(at, numbers.point(0.2)), 0.12));
    }
    world.obstacles = Obstacles::new(world.all.clone(), 0.8).unwrap();
    let mut propagator = Propagator::new(world.rules);
    let mut moves = 0;
    for _ in 0..6 {
        let depths = |chain: &Chain<D>| -> Vec<f64> {
            let of = |i: usize| world.all.iter().map(move |o| depth_of_part_m(chain, i, o));
            (0..n).flat_map(of).collect()
        };
        let before = depths(&world.chain);
        let to = add(world.chain.points()[0], numbers.point(0.1));
        let request = MotionRequest::from_operator(0, to);
        let mut chain = world.chain.clone();
        let outcome = propagator.propagate(&mut chain, &world.obstacles, &request).unwrap();
        moves += usize::from(outcome.motion().is_some());
        for (was_m, is_m) in before.iter().zip(depths(&chain)) {
            assert!(is_m <= was_m.max(1e-9) + 1e-12, "seed {seed}: {was_m} -> {is_m}");
        }
        world.chain = chain;
    }
    moves
}

#[test]
fn who_starts_inside_goes_no_deeper_in_any_world() {
    let moves = (0..300).map(|seed| goes_no_deeper::<2>(seed) + goes_no_deeper::<3>(seed));
    assert!(moves.sum::<usize>() > 300);
}

/// A chain of rods with slack, where a motion ends at the first rod that has enough of it.
fn ends_where_nobody_need_move<const D: usize>(seed: u64, among_balls: bool) -> bool {
    let rod = Rod { min_m: 0.4, max_m: 0.6, radius_m: 0.01 };
    let mut chain = crooked::<D>(seed, 20, rod, 0.05);
    let field = if among_balls { ball_field(seed, 6.0, 0.03, 0.2, 0.1) } else { Vec::new() };
    let field = field.into_iter().filter(|o| apart_m(&chain, o) > 0.0).collect();
    let obstacles = Obstacles::new(field, 0.8).unwrap();
    let mut numbers = TestRng::new(seed + 7);
    let before = bits(&chain);
    let k = (numbers.unit() * 21.0) as usize;
    let to = add(chain.points()[k], numbers.point(0.005));
    let MotionOutcome::Moved(moved) = go(&mut chain, &obstacles, k, to) else { return false };
    let after = bits(&chain);
    let changed: Vec<_> = (0..21).filter(|&i| after[i] != before[i]).collect();
    assert_eq!(changed, moved.touched.clone().collect::<Vec<_>>(), "seed {seed}");
    assert_eq!(moved.changed, changed.len());
    moved.touched.len() < 21
}

#[test]
fn a_rod_that_only_changes_its_length_leaves_every_bit_beyond() {
    let ended = (0..200).flat_map(|seed| {
        [
            ends_where_nobody_need_move::<2>(seed, false),
            ends_where_nobody_need_move::<2>(seed, true),
            ends_where_nobody_need_move::<3>(seed, false),
            ends_where_nobody_need_move::<3>(seed, true),
        ]
    });
    assert!(ended.filter(|&early| early).count() > 400);
}

/// Everything that a world does, as bytes.
fn history<const D: usize>(seed: u64, shared: Option<&Obstacles<D>>) -> Vec<Vec<[u64; D]>> {
    let mut world = AnyWorld::<D>::new(seed);
    let obstacles = shared.cloned().unwrap_or(world.obstacles.clone());
    let mut propagator = Propagator::new(world.rules);
    let step = |_| {
        let request = world.any_request(0.1);
        let _ = propagator.propagate(&mut world.chain, &obstacles, &request).unwrap();
        bits(&world.chain)
    };
    (0..20).map(step).collect()
}

#[test]
fn the_same_seed_gives_the_same_bytes_on_any_number_of_threads() {
    for seed in 0..20 {
        let shared = AnyWorld::<3>::new(seed).obstacles;
        let alone = history::<3>(seed, None);
        let shared = &shared;
        #[expect(clippy::disallowed_methods, reason = "tested from several threads")]
        std::thread::scope(|scope| {
            let threads: Vec<_> =
                (0..3).map(|_| scope.spawn(move || history::<3>(seed, Some(shared)))).collect();
            for thread in threads {
                assert_eq!(thread.join().unwrap(), alone);
            }
        });
    }
}

#[test]
fn a_chain_that_is_pushed_never_runs_into_itself() {
    let mut blocked = 0;
    for seed in 0..12 {
        let rod = Rod { min_m: 0.6, max_m: 0.8, radius_m: 0.05 };
        let mut chain =
            Chain::straight([0.0; 2], [-1.0, 0.0], 12, rod, Connector::free(0.25)).unwrap();
        let walls = [-1.0, 1.0].map(|y| Obstacle::capsule(1, [[-40.0, y], [5.0, y]], 0.0));
        let obstacles = Obstacles::new(walls.to_vec(), 1.3).unwrap();
        let (mut propagator, mut numbers) = (Propagator::new(own()), TestRng::new(seed));
        for _ in 0..200 {
            let by = [-0.05, numbers.uniform(-0.02, 0.02)];
            let request = MotionRequest::from_operator(0, add(chain.points()[0], by));
            let outcome = propagator.propagate(&mut chain, &obstacles, &request).unwrap();
            blocked += usize::from(outcome.veto().is_some());
            assert!(own_clearance_m(&chain) >= -TOLERANCE);
            assert!(clearance_m(&chain, &obstacles) >= -TOLERANCE);
        }
    }
    assert!(blocked > 0, "pushing is unstable: it must jam at times");
}
