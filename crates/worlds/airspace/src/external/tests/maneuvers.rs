//! Outcomes and refusals of orders.

use super::{MIXED, observed, run, run_of};
use crate::AirspaceRun;
use crate::external::observation::MAX_NEIGHBORS;
use crate::external_action::ExternalAction;
use crate::flight::distance_m;
use crate::kinds;
use sidestep_kernel::control::{MultiAgentOrder, OrderLog};
use sidestep_kernel::math::{cos, sin};
use sidestep_kernel::view::BodyId;
use sidestep_kernel::{EntityId, Simulation};

/// One airplane far from its way-point, without the shield.
fn lone(more: &str) -> AirspaceRun {
    let text = format!(
        "format = 1\nworld = \"airspace\"\n[airspace]\nmethod = \"external\"\nshield = \"off\"\n{more}\n\
         [[airplanes]]\nat_m = [0, 0]\nheading_deg = 0\nway_points_m = [[90000, 0]]\n"
    );
    run_of(&text, 1)
}

fn heading_rad(run: &AirspaceRun, id: usize) -> f64 {
    run.state().airplanes[id].pose().heading_rad
}

#[test]
fn a_turn_is_flown_for_one_decision_and_the_last_order_counts() {
    let mut run = lone("");
    let actions = run.agent_teams()[0].action_spaces[0].value_count();
    let ranking: Vec<f64> = (0..actions).map(|k| k as f64).collect();
    let orders: [(&str, &[f64]); 3] = [
        (ExternalAction::RANKING, &ranking),
        (ExternalAction::VELOCITY, &[0.0, -1.0]),
        (ExternalAction::TURN_RATE, &[0.02]),
    ];
    for (order, values) in orders {
        run.order(&MultiAgentOrder { order, agents: &[0], values }).expect("right");
    }
    run.advance(1);
    assert!((heading_rad(&run, 0) - 0.1).abs() < 1e-12, "{}", heading_rad(&run, 0));
    assert_eq!(observed(&run, 0)["turn_rate_rad_s"], [0.02]);
    run.advance(1);
    assert!(heading_rad(&run, 0) < 0.0, "it is on its way again");
}

#[test]
fn a_velocity_is_turned_to_as_fast_as_may_be() {
    let mut run = lone("");
    let north = std::f64::consts::FRAC_PI_2;
    for cycle in 1..=6 {
        run.order(&MultiAgentOrder {
            order: ExternalAction::VELOCITY,
            agents: &[0],
            values: &[0.0, 7.0],
        })
        .expect("right");
        run.advance(1);
        // Four degrees per second, for five seconds each.
        let expected_rad = (f64::from(cycle) * 20_f64.to_radians()).min(north);
        assert!((heading_rad(&run, 0) - expected_rad).abs() < 1e-9, "cycle {cycle}");
    }
}

#[test]
fn the_first_of_a_ranking_is_flown() {
    let mut run = lone("");
    let actions = run.agent_teams()[0].action_spaces[0].value_count();
    // The first action turns right as fast as it can, the last proceeds.
    let first: Vec<f64> = (0..actions).map(|k| k as f64).collect();
    let last: Vec<f64> = first.iter().rev().copied().collect();
    run.order(&MultiAgentOrder { order: ExternalAction::RANKING, agents: &[0], values: &last })
        .expect("right");
    run.advance(1);
    assert_eq!(heading_rad(&run, 0), 0.0);
    run.order(&MultiAgentOrder { order: ExternalAction::RANKING, agents: &[0], values: &first })
        .expect("right");
    run.advance(1);
    assert!((heading_rad(&run, 0) + 20_f64.to_radians()).abs() < 1e-12);
}

/// In every cycle all are ordered to where the others come from.
fn ordered_into_each_other(shield: &str) -> AirspaceRun {
    let text = format!(
        "format = 1\nworld = \"airspace\"\n[airspace]\nmethod = \"external\"\nshield = \"{shield}\"\n\
         [airspace.generator]\nkind = \"superconflict\"\nn = 6\nradius_m = 3000.0\n"
    );
    let mut run = run_of(&text, 1);
    for _ in 0..40 {
        let agents: Vec<EntityId> = (0..6).collect();
        let toward = |slot: &EntityId| run.state().airplanes[*slot as usize].pose().at.map(|v| -v);
        let values: Vec<f64> = agents.iter().flat_map(toward).collect();
        run.order(&MultiAgentOrder {
            order: ExternalAction::VELOCITY,
            agents: &agents,
            values: &values,
        })
        .expect("right");
        run.advance(1);
    }
    run
}

#[test]
fn the_shield_keeps_those_apart_whom_orders_lead_together() {
    let (with, without) = (ordered_into_each_other("on"), ordered_into_each_other("off"));
    assert_eq!(with.metrics().losses_of_separation, 0);
    assert!(with.metrics().shield_overrides > 20);
    assert!(without.metrics().losses_of_separation > 10);
}

#[test]
fn an_order_stands_until_its_airplane_comes_in_and_none_after_its_flight() {
    let text = "format = 1\nworld = \"airspace\"\n[airspace]\nmethod = \"external\"\n[[airplanes]]\n\
                at_m = [0, 0]\nheading_deg = 0\nway_points_m = [[9000, 0]]\nappears_s = 20.0\n\
                [[airplanes]]\nat_m = [0, 9000]\nheading_deg = 0\nway_points_m = [[300, 9000]]\n";
    let mut run = run_of(text, 1);
    run.order(&MultiAgentOrder { order: ExternalAction::TURN_RATE, agents: &[0], values: &[0.03] })
        .expect("right");
    run.advance(4);
    assert_eq!(heading_rad(&run, 0), 0.0);
    assert_eq!(observed(&run, 0)["due"], [1.0, 0.0]);
    run.advance(1);
    assert!((heading_rad(&run, 0) - 0.15).abs() < 1e-12);
    let before = run.digest();
    run.order(&MultiAgentOrder { order: ExternalAction::TURN_RATE, agents: &[1], values: &[0.03] })
        .expect("right");
    assert_eq!(run.digest(), before, "it has arrived");
}

#[test]
fn no_more_than_the_nearest_are_observed_and_the_rest_is_padding() {
    let text = |n: usize| {
        format!(
            "format = 1\nworld = \"airspace\"\n[airspace]\nmethod = \"external\"\n\
             deployment = \"team\"\n[airspace.network]\nloss = 0.3\nlatency_s = 0.001\n\
             [airspace.generator]\nkind = \"superconflict\"\nn = {n}\n"
        )
    };
    for (n, expected) in [(3, 2), (MAX_NEIGHBORS + 4, MAX_NEIGHBORS)] {
        let mut run = run_of(&text(n), 1);
        run.advance(25);
        let seen = observed(&run, 0);
        assert_eq!(seen["neighbors"], vec![expected as f64; n]);
        let of_first = |name: &str| &seen[name][..MAX_NEIGHBORS];
        let is_there: Vec<bool> = of_first("neighbor_id").iter().map(|&id| id >= 0.0).collect();
        assert_eq!(is_there, (0..MAX_NEIGHBORS).map(|k| k < expected).collect::<Vec<_>>());
        let places = seen["neighbor_place_m"][..2 * MAX_NEIGHBORS].as_chunks().0;
        let apart: Vec<f64> =
            places.iter().map(|&at: &[f64; 2]| distance_m(at, [0.0; 2])).collect();
        assert!(apart[..expected].is_sorted() && apart[0] > 0.0, "{apart:?}");
        assert!(apart[expected..].iter().all(|&m| m == 0.0), "{apart:?}");
        assert!(of_first("neighbor_unheard_s")[..expected].iter().all(|&s| s >= 0.0));
        assert_eq!(of_first("neighbor_separation_m")[0], 500.0);
    }
}

#[test]
fn the_delay_so_far_grows_with_a_detour_only() {
    let mut run = lone("");
    let delay = |run: &AirspaceRun| observed(run, 0)["delay_s"][0];
    let at_first = delay(&run);
    run.advance(20);
    assert!((delay(&run) - at_first).abs() < 1e-6, "{} {at_first}", delay(&run));
    // Ten seconds back, and the turns there.
    for _ in 0..10 {
        let back = [-cos(0.3), sin(0.3)];
        run.order(&MultiAgentOrder {
            order: ExternalAction::VELOCITY,
            agents: &[0],
            values: &back,
        })
        .expect("right");
        run.advance(1);
    }
    assert!(delay(&run) > at_first + 20.0, "{} {at_first}", delay(&run));
}

#[test]
fn others_that_decide_themselves_are_observed_and_take_no_orders() {
    let mut run = run_of(&MIXED.replace("\"external\"", "\"mvp\""), 1);
    run.advance(10);
    assert_eq!(observed(&run, 0)["due"].iter().sum::<f64>(), 7.0);
    let error = run.order(&MultiAgentOrder {
        order: ExternalAction::TURN_RATE,
        agents: &[0],
        values: &[0.0],
    });
    let error = error.expect_err("it decides itself").to_string();
    assert!(error.contains("airplane 0 decides for itself"), "{error}");
}

#[test]
fn what_cannot_be_obeyed_is_refused_and_nothing_of_it_noted() {
    let mut run = run(1);
    let before = run.digest();
    let actions = run.agent_teams()[0].action_spaces[0].value_count();
    let double = [vec![1.0], (1..actions).map(|k| k as f64).collect()].concat();
    let (turn, velocity) = (ExternalAction::TURN_RATE, ExternalAction::VELOCITY);
    let refused: [(MultiAgentOrder<'_>, &str); 10] = [
        (MultiAgentOrder { order: turn, agents: &[99], values: &[0.0] }, "there is no airplane 99"),
        (MultiAgentOrder { order: turn, agents: &[7], values: &[0.0] }, "there is no airplane 7"),
        (
            MultiAgentOrder { order: "climb", agents: &[0], values: &[0.0] },
            "it takes ranking, turn_rate_rad_s",
        ),
        (
            MultiAgentOrder { order: turn, agents: &[0, 1], values: &[0.0] },
            "needs 2 x 1 values, not 1",
        ),
        (
            MultiAgentOrder { order: turn, agents: &[0], values: &[0.08] },
            "it must be a number from -0.0698",
        ),
        // The slower one may turn by 3 degrees per second only.
        (
            MultiAgentOrder { order: turn, agents: &[5], values: &[0.06] },
            "it must be a number from -0.0523",
        ),
        (
            MultiAgentOrder { order: velocity, agents: &[0], values: &[0.0, -0.0] },
            "0 has no direction",
        ),
        (
            MultiAgentOrder { order: velocity, agents: &[0], values: &[f64::NAN, 1.0] },
            "must be a finite number",
        ),
        (
            MultiAgentOrder {
                order: ExternalAction::RANKING,
                agents: &[0],
                values: &vec![99.0; actions],
            },
            "is 99; it must be",
        ),
        (
            MultiAgentOrder { order: ExternalAction::RANKING, agents: &[0], values: &double },
            "action 1 stands in it 2 times and action 0 not at all; give each action from 0 to",
        ),
    ];
    for (orders, words) in refused {
        let error = run.order(&orders).expect_err(words).to_string();
        assert!(error.contains(words), "{error}");
        assert_eq!(run.digest(), before, "{error}");
    }
    let mut book = OrderLog::default();
    book.add(3, &MultiAgentOrder { order: velocity, agents: &[0], values: &[0.0, 0.0] });
    let error = run.replay_orders(book).expect_err("no direction").to_string();
    assert!(error.contains("to airplane 0 cannot be obeyed: 0 has no direction"), "{error}");
}

#[test]
fn who_asks_what_was_ordered_does_not_use_it_up() {
    let mut run = lone("");
    run.order(&MultiAgentOrder { order: ExternalAction::TURN_RATE, agents: &[0], values: &[0.02] })
        .expect("right");
    let inspection = run.inspect(BodyId::new(kinds::AIRPLANE, 0, None)).expect("it is in the air");
    assert_eq!(
        inspection.fact_value("Decides", "action"),
        Some(&"the turn that was ordered".into())
    );
    run.advance(1);
    assert!((heading_rad(&run, 0) - 0.1).abs() < 1e-12, "{}", heading_rad(&run, 0));
    let inspection = run.inspect(BodyId::new(kinds::AIRPLANE, 0, None)).expect("it is in the air");
    assert_eq!(inspection.fact_value("Decides", "action"), Some(&"to the way-point".into()));
}
