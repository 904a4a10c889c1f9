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
    [here, there]: [&Obstacles<D>; 2],
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
        let outcome = propagator.propagate(&mut apart, here, &request).unwrap();
        assert_eq!(outcome, looking.propagate(&mut looked, there, &request).unwrap(), "{seed}");
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
    let nowhere = (Obstacles::default(), Obstacles::default());
    for seed in seeds {
        for [motions, vetoes] in [
            led_both_ways::<2>(seed, &mut plane, [&nowhere.0, &far()]),
            led_both_ways::<3>(seed, &mut space, [&nowhere.1, &far()]),
            led_both_ways::<2>(seed, &mut plane, [&far(); 2]),
            led_both_ways::<3>(seed, &mut space, [&far(); 2]),
            led_both_ways::<2>(seed, &mut plane, [&near(seed); 2]),
            led_both_ways::<3>(seed, &mut space, [&near(seed); 2]),
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

#[test]
#[ignore = "a minute and a half: for .ci/soak"]
fn many_more_chains_in_their_own_way_move_the_same() {
    lead_many(20..150);
}
