//! Chains and requests at the edge of the possible.

use super::*;

#[test]
fn wrong_requests_are_errors_and_a_target_reached_is_no_motion() {
    let rod = Rod::with_fixed_length(1.0, 0.0);
    let mut chain = Chain::straight([0.0; 2], [1.0, 0.0], 1, rod, Connector::free(0.0)).unwrap();
    let mut propagator = Propagator::default();
    let mut ask = |k, to| {
        propagator.propagate(
            &mut chain,
            &Obstacles::default(),
            &MotionRequest::from_operator(k, to),
        )
    };
    assert!(ask(0, [f64::NAN, 0.0]).is_err());
    assert!(ask(2, [0.0, 0.0]).is_err());
    let still = ask(0, [0.0, 0.0]).unwrap();
    assert_eq!(still.motion().unwrap().touched, 0..0);
    // Onto the slave: the rod goes on along its old direction.
    assert!(ask(0, [1.0, 0.0]).unwrap().motion().is_some());
    assert_eq!(chain.points()[1], [2.0, 0.0]);
}

#[test]
fn who_starts_inside_may_leave_but_not_go_deeper() {
    let rod = Rod { min_m: 0.5, max_m: 1.0, radius_m: 0.0 };
    let mut chain = Chain::straight([0.0, 0.0], [-1.0, 0.0], 1, rod, Connector::free(0.1)).unwrap();
    let obstacles = Obstacles::new(vec![Obstacle::ball(1, [0.05, 0.3], 0.3)], 1.0).unwrap();
    let deeper = go(&mut chain, &obstacles, 0, [0.02, 0.05]);
    assert_eq!(deeper.veto().unwrap().reason, VetoReason::Inside);
    assert!(go(&mut chain, &obstacles, 0, [0.0, -0.2]).motion().is_some());
}

#[test]
fn one_connector_alone_goes_where_nothing_is_in_the_way() {
    let mut alone = Chain::new(vec![[0.0; 2]], vec![Connector::free(0.1)], vec![]).unwrap();
    let obstacles = Obstacles::new(vec![Obstacle::ball(4, [1.0, 0.0], 0.3)], 1.0).unwrap();
    assert_eq!(go(&mut alone, &obstacles, 0, [0.0, 0.5]).motion().unwrap().touched, 0..1);
    let veto = go(&mut alone, &obstacles, 0, [1.0, 0.2]);
    assert_eq!(veto.veto().unwrap().reason, VetoReason::TargetBlocked);
    assert_eq!(alone.points()[0], [0.0, 0.5]);
}

#[test]
fn one_rod_follows_from_both_ends_and_turns_on_the_spot_of_its_slave() {
    let rod = Rod::with_fixed_length(1.0, 0.05);
    for k in [0, 1] {
        let mut chain =
            Chain::straight([0.0; 3], [1.0, 0.0, 0.0], 1, rod, Connector::free(0.1)).unwrap();
        // The head exactly onto its slave, and back.
        let other = chain.points()[1 - k];
        let home = chain.points()[k];
        for to in [other, home, other] {
            assert!(go(&mut chain, &Obstacles::default(), k, to).motion().is_some());
            assert!(chain.points()[0].iter().chain(&chain.points()[1]).all(|x| x.is_finite()));
            assert!(chain.max_rod_violation_m() <= 1e-12);
        }
    }
}

#[test]
fn a_base_inside_an_obstacle_objects_and_never_moves() {
    let rod = Rod { min_m: 0.5, max_m: 1.0, radius_m: 0.02 };
    let mut chain = Chain::straight([0.0; 2], [1.0, 0.0], 3, rod, Connector::free(0.1)).unwrap();
    chain.set_mobility(0, Mobility::Fixed).unwrap();
    let obstacles = Obstacles::new(vec![Obstacle::ball(2, [0.0, 0.0], 0.4)], 1.0).unwrap();
    let mut numbers = TestRng::new(3);
    for _ in 0..200 {
        let to = add(chain.points()[3], numbers.point(0.2));
        let before = bits(&chain);
        if go(&mut chain, &obstacles, 3, to).veto().is_some() {
            assert_eq!(bits(&chain), before);
        }
        assert_eq!(chain.points()[0], [0.0, 0.0]);
        assert!(chain.max_rod_violation_m() <= 1e-9);
    }
}

#[test]
fn requests_that_are_absurd_are_errors_and_change_nothing() {
    let rod = Rod::with_fixed_length(1.0, 0.05);
    let mut chain = Chain::straight([0.0; 2], [1.0, 0.0], 3, rod, Connector::free(0.1)).unwrap();
    let obstacles = Obstacles::new(vec![Obstacle::ball(2, [0.0, 3.0], 0.4)], 1.0).unwrap();
    let before = bits(&chain);
    for to in [[f64::INFINITY, 0.0], [0.0, f64::NAN], [1e300, 0.0], [-1e9, 0.0]] {
        let request = MotionRequest::from_operator(0, to);
        assert!(
            Propagator::default().propagate(&mut chain, &obstacles, &request).is_err(),
            "{to:?}"
        );
        assert_eq!(bits(&chain), before);
    }
}

#[test]
fn rods_keep_their_lengths_as_far_out_as_a_chain_may_be() {
    let rod = Rod::with_fixed_length(1.0, 0.0);
    let start = [999_000.0, -999_000.0, 999_000.0];
    let u = [0.6, 0.0, 0.8];
    let mut chain = Chain::straight(start, u, 20, rod, Connector::free(0.0)).unwrap();
    let mut walk = Wanderer::new(1);
    for _ in 0..100 {
        let to = walk.next(chain.points()[0], 0.7);
        assert!(go(&mut chain, &Obstacles::default(), 0, to).motion().is_some());
        assert!(chain.max_rod_violation_m() <= 1e-9);
    }
    let error = Propagator::default().propagate(
        &mut chain,
        &Obstacles::default(),
        &MotionRequest::from_operator(0, [1.1e6, 0.0, 0.0]),
    );
    assert_eq!(error.unwrap_err().place(), "target");
}
