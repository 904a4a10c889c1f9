//! Motions proven to bring no parts near each other move as those whose parts were looked at.

use super::*;

/// An obstacle so far away that it only makes every motion look at each part.
fn far<const D: usize>() -> Obstacles<D> {
    Obstacles::new(vec![Obstacle::ball(0, [1e4; D], 1.0)], 1.0).unwrap()
}

/// Balls about the chain's start, and in its way.
fn near<const D: usize>(seed: u64) -> Obstacles<D> {
    let mut numbers = TestRng::new(seed ^ 0xba11);
    let ball = |id| Obstacle::ball(id, numbers.point(12.0), 0.4);
    Obstacles::new((0..if D == 2 { 12 } else { 60 }).map(ball).collect(), 1.0).unwrap()
}

/// Leads a chain about by one of its connectors, with the proof and without it; returns the numbers
/// of motions and of vetoes.
fn led_both_ways<const D: usize>(
    seed: u64,
    propagator: &mut Propagator<D>,
    obstacles: &Obstacles<D>,
) -> [usize; 2] {
    let mut numbers = TestRng::new(seed);
    let n_rods = 8 + (40.0 * numbers.unit()) as usize;
    let slack = if numbers.unit() < 0.5 { 0.0 } else { 0.3 };
    let radius_m = numbers.uniform(0.0, 0.3);
    let rod = Rod { min_m: 1.0 - slack, max_m: 1.0, radius_m: 0.5 * radius_m };
    let mut apart = crooked::<D>(seed, n_rods, rod, radius_m);
    let mut looked = apart.clone();
    propagator.rules = ReactionRules { self_collision: true, ..ReactionRules::default() };
    let mut looking = Propagator { proofs: SeparationProofSchedule::never(), ..propagator.clone() };
    let k = if numbers.unit() < 0.5 { 0 } else { (n_rods as f64 * numbers.unit()) as usize };
    let (mut walk, mut vetoes) = (Wanderer::new(seed), 0);
    for _ in 0..60 {
        let to = walk.next(apart.points()[k], numbers.uniform(0.0, 0.6));
        let mode =
            if numbers.unit() < 0.5 { VetoEffect::Exact } else { VetoEffect::AsFarAsPossible };
        let request = MotionRequest { mode, ..MotionRequest::from_operator(k, to) };
        let outcome = propagator.propagate(&mut apart, obstacles, &request).unwrap();
        assert_eq!(outcome, looking.propagate(&mut looked, obstacles, &request).unwrap(), "{seed}");
        assert_eq!(bits(&apart), bits(&looked), "{seed}");
        if outcome.veto().is_some() {
            vetoes += 1;
            walk.turn_anywhere();
        }
    }
    [60, vetoes]
}

/// Leads chains of many shapes about, alone and among balls.
fn lead_many(seeds: std::ops::Range<u64>) {
    // One propagator for all, because its memory of other chains must not matter.
    let (mut plane, mut space) = (Propagator::default(), Propagator::default());
    let mut sum = [0, 0];
    for seed in seeds {
        for [motions, vetoes] in [
            led_both_ways::<2>(seed, &mut plane, &far()),
            led_both_ways::<3>(seed, &mut space, &far()),
            led_both_ways::<2>(seed, &mut plane, &near(seed)),
            led_both_ways::<3>(seed, &mut space, &near(seed)),
        ] {
            sum = [sum[0] + motions, sum[1] + vetoes];
        }
    }
    let [motions, vetoes] = sum;
    assert!(vetoes > 100 && vetoes < motions / 2, "{vetoes} of {motions} are vetoed");
}

#[test]
fn a_chain_in_its_own_way_moves_the_same_whether_or_not_its_parts_are_looked_at() {
    lead_many(0..20);
}

/// Alone, a chain whose parts stay apart moves as if its own body were nothing to it, however it has moved before.
#[test]
fn alone_a_chain_that_does_not_meet_itself_moves_as_without_its_own_body() {
    let mut solid = Propagator::<3>::new(own());
    let mut open = Propagator::<3>::default();
    for seed in 0..8 {
        let rod = Rod::with_fixed_length(0.05, 0.008);
        let n_rods = 30 + 40 * seed as usize;
        let start = Chain::straight([0.0; 3], [-1.0, 0.0, 0.0], n_rods, rod, Connector::free(0.02));
        let mut walk = Wanderer::new(seed);
        let mut with = start.unwrap();
        let mut without = with.clone();
        for _ in 0..40 {
            let request = MotionRequest::from_operator(0, walk.next(with.points()[0], 0.012));
            let outcome = solid.propagate(&mut with, &Obstacles::default(), &request).unwrap();
            assert!(outcome.motion().is_some(), "{seed}");
            open.propagate(&mut without, &Obstacles::default(), &request).unwrap();
            assert_eq!(bits(&with), bits(&without), "{seed}");
        }
    }
}

/// What a propagator has moved before does not matter.
#[test]
fn alone_a_chain_moves_the_same_whatever_was_moved_before() {
    let mut used = Propagator::<2>::new(own());
    for seed in 0..40 {
        let mut numbers = TestRng::new(seed);
        let radius_m = numbers.uniform(0.01, 0.4);
        let rod = Rod { min_m: 0.9, max_m: 1.0, radius_m: 0.5 * radius_m };
        let mut chain = crooked::<2>(seed, 4 + 4 * seed as usize, rod, radius_m);
        let k = (chain.points().len() as f64 * numbers.unit()) as usize;
        let mut walk = Wanderer::new(seed);
        for _ in 0..15 {
            let to = walk.next(chain.points()[k], numbers.uniform(0.0, 0.3));
            let request = MotionRequest::from_operator(k, to);
            let mut other = chain.clone();
            let outcome = used.propagate(&mut chain, &Obstacles::default(), &request).unwrap();
            let fresh =
                Propagator::new(own()).propagate(&mut other, &Obstacles::default(), &request);
            assert_eq!(fresh.unwrap(), outcome, "{seed}");
            assert_eq!(bits(&other), bits(&chain), "{seed}");
        }
    }
}

#[test]
#[ignore = "a minute and a half: for .ci/soak"]
fn many_more_chains_in_their_own_way_move_the_same() {
    lead_many(20..150);
}

/// What earlier sub-steps have moved is taken back, whether they were proven or tested.
#[test]
fn a_vetoed_request_of_a_coiled_chain_leaves_every_bit() {
    let rod = Rod { min_m: 0.2, max_m: 0.3, radius_m: 0.064 };
    let rules =
        ReactionRules { self_collision: true, step_m: Some(0.005), ..ReactionRules::default() };
    let mut vetoes = 0;
    for seed in 0..40 {
        let mut chain =
            Chain::straight([0.0, 0.0], [1.0, 0.0], 39, rod, Connector::free(0.08)).unwrap();
        let mut propagator = Propagator::new(rules);
        let mut walk = Wanderer::new(seed);
        for _ in 0..400 {
            let before = bits(&chain);
            let at = chain.points()[0];
            let to = walk.next(at, 0.025);
            let is_within = to.iter().all(|x| x.abs() < 1.5);
            let mode = VetoEffect::Exact;
            let request = MotionRequest { mode, ..MotionRequest::from_operator(0, to) };
            let obstacles = Obstacles::default();
            let outcome = propagator.propagate(&mut chain, &obstacles, &request).unwrap();
            if outcome.veto().is_some() {
                assert_eq!(bits(&chain), before, "{seed}");
                vetoes += 1;
            }
            if outcome.veto().is_some() || !is_within {
                walk.turn_anywhere();
            }
        }
    }
    assert!(vetoes > 20, "{vetoes}");
}
