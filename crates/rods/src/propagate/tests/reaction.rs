//! Reactions of a program's own.

use super::*;
use crate::fixtures::AnyWorld;
use crate::geometry::convert_dimensions;
use crate::reaction::{MasterMove, Reaction};

/// Goes where it is pushed or pulled to.
#[derive(Debug)]
struct Guided;

impl Reaction for Guided {
    fn react(&self, percept: &MasterMove<'_>) -> Result<Point<3>, VetoReason> {
        Ok(percept.guided_m)
    }
}

/// Gives one answer for ever.
#[derive(Debug)]
struct Always(Result<Point<3>, VetoReason>);

impl Reaction for Always {
    fn react(&self, _: &MasterMove<'_>) -> Result<Point<3>, VetoReason> {
        self.0
    }
}

fn own<const D: usize>(rules: ReactionRules, reaction: impl Reaction + 'static) -> Propagator<D> {
    Propagator::new(rules).with_reaction(Some(Arc::new(reaction)))
}

/// Makes random motions by the rule that never turns a rod, built in and as an own reaction; returns the numbers of
/// motions and of vetoes.
fn compare<const D: usize>(seed: u64) -> [usize; 2] {
    let mut world = AnyWorld::<D>::new(seed);
    let is_boxed = |c: &Connector<D>| !matches!(c.mobility, Mobility::Free | Mobility::Fixed);
    // Only the built-in rule looks for further places in a box.
    if world.chain.connectors().iter().any(is_boxed) {
        return [0; 2];
    }
    // With a length of its own for sub-steps; otherwise the built-in rule makes a motion that nothing can object to
    // as one.
    let step_m = Some(world.chain.step_m());
    let rules = ReactionRules { rotation: RotationRule::Never, step_m, ..world.rules };
    let mut built_in = Propagator::new(rules);
    let mut own = own(rules, Guided);
    let mut counts = [0; 2];
    for _ in 0..20 {
        let request = world.any_request(0.15);
        let mut other = world.chain.clone();
        let outcome = built_in.propagate(&mut world.chain, &world.obstacles, &request).unwrap();
        let own_outcome = own.propagate(&mut other, &world.obstacles, &request).unwrap();
        assert_eq!(own_outcome, outcome, "seed {seed}");
        assert_eq!(bits(&other), bits(&world.chain), "seed {seed}");
        counts[usize::from(outcome.veto().is_some())] += 1;
    }
    counts
}

#[test]
fn an_own_reaction_that_does_as_a_built_in_one_gives_its_bits() {
    let mut counts = [0; 2];
    for seed in 0..60 {
        for [moved, vetoed] in [compare::<2>(seed), compare::<3>(seed)] {
            counts = [counts[0] + moved, counts[1] + vetoed];
        }
    }
    assert!(counts.iter().all(|count| *count > 100), "{counts:?}");
}

#[test]
fn a_veto_or_a_place_that_breaks_a_law_leaves_every_bit() {
    let rod = Rod { min_m: 0.8, max_m: 1.0, radius_m: 0.02 };
    let start = Chain::straight([0.0, 0.0], [-1.0, 0.0], 4, rod, Connector::free(0.1)).unwrap();
    let wall = Obstacles::new(vec![Obstacle::ball(3, [-0.8, 0.5], 0.2)], 1.0).unwrap();
    let request = MotionRequest::from_operator(0, [0.1, 0.0]);
    for (answer, reason, obstacle) in [
        (Err(VetoReason::Limit), VetoReason::Limit, None),
        (Ok([-5.0, 0.0, 0.0]), VetoReason::Mobility, None),
        (Ok([f64::NAN, 0.0, 0.0]), VetoReason::Mobility, None),
        (Ok([-0.7, 0.45, 0.0]), VetoReason::BothSidesBlocked, Some(3)),
    ] {
        let mut chain = start.clone();
        let mut propagator = own(ReactionRules::default(), Always(answer));
        let outcome = propagator.propagate(&mut chain, &wall, &request).unwrap();
        let veto = outcome.veto().expect("a veto");
        assert_eq!((veto.by, veto.reason, veto.obstacle), (1, reason, obstacle), "{answer:?}");
        assert_eq!(bits(&chain), bits(&start), "{answer:?}");
    }
}

#[test]
fn a_reaction_perceives_its_master_and_what_is_in_the_way() {
    /// Steps aside by half a meter if that is free, else stays on the line.
    #[derive(Debug)]
    struct Aside;

    impl Reaction for Aside {
        fn react(&self, percept: &MasterMove<'_>) -> Result<Point<3>, VetoReason> {
            assert_eq!(percept.master_from_m, [0.0; 3]);
            let [x, y, z] = percept.guided_m;
            let [min_m, max_m] = percept.rod_m;
            assert!(min_m < max_m && percept.radius_m == 0.1 && z == 0.0);
            let aside = [x + 0.15, y + 0.5, 0.0];
            Ok(if percept.check(aside).is_ok() { aside } else { percept.guided_m })
        }
    }

    let rod = Rod { min_m: 0.8, max_m: 1.0, radius_m: 0.02 };
    let wall = Obstacles::new(vec![Obstacle::ball(3, [-0.8, 0.7], 0.2)], 1.0).unwrap();
    for (obstacles, y_m) in [(Obstacles::default(), 0.5), (wall, 0.0)] {
        let mut chain =
            Chain::straight([0.0, 0.0], [-1.0, 0.0], 1, rod, Connector::free(0.1)).unwrap();
        let mut propagator =
            own(ReactionRules { step_m: Some(1.0), ..ReactionRules::default() }, Aside);
        let request = MotionRequest::from_operator(0, [0.1, 0.0]);
        propagator.propagate(&mut chain, &obstacles, &request).unwrap();
        let at: Point<3> = convert_dimensions(chain.points()[1]);
        assert!((at[1] - y_m).abs() < 1e-12, "{at:?}");
    }
}
