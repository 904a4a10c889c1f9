//! Chains and requests at the edge of what there can be.

use super::*;

#[test]
fn wrong_requests_are_errors_and_a_target_reached_is_no_motion() {
    let rod = Rod::fixed(1.0, 0.0);
    let mut chain = Chain::straight([0.0; 2], [1.0, 0.0], 1, rod, Connector::free(0.0)).unwrap();
    let mut propagator = Propagator::default();
    let mut ask =
        |k, to| propagator.propagate(&mut chain, &Obstacles::default(), &Request::exact(k, to));
    assert!(ask(0, [f64::NAN, 0.0]).is_err());
    assert!(ask(2, [0.0, 0.0]).is_err());
    let still = ask(0, [0.0, 0.0]).unwrap();
    assert_eq!(still.moved().unwrap().touched, 0..0);
    // Onto the slave: the rod goes where it was.
    assert!(ask(0, [1.0, 0.0]).unwrap().moved().is_some());
    assert_eq!(chain.points()[1], [2.0, 0.0]);
}

#[test]
fn who_starts_inside_may_leave_but_not_go_deeper() {
    let rod = Rod { min_m: 0.5, max_m: 1.0, radius_m: 0.0 };
    let mut chain = Chain::straight([0.0, 0.0], [-1.0, 0.0], 1, rod, Connector::free(0.1)).unwrap();
    let obstacles = Obstacles::new(vec![Obstacle::ball(1, [0.05, 0.3], 0.3)], 1.0).unwrap();
    let deeper = go(&mut chain, &obstacles, 0, [0.02, 0.05]);
    assert_eq!(deeper.veto().unwrap().reason, Reason::Inside);
    assert!(go(&mut chain, &obstacles, 0, [0.0, -0.2]).moved().is_some());
}
