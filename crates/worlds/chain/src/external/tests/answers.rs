//! Outcomes of orders, as the caller observes them.

use super::{name, observed, order, plane, source};
use crate::chain_run;
use sidestep_kernel::Simulation;
use sidestep_kernel::control::MultiAgentOrder;

/// A chain under orders in front of a disc that begins at x = 0.7; its last connector is fixed or not.
fn facing_a_disc(more: &str) -> crate::ChainRun<2> {
    let text = format!(
        "[chain]\ndt_s = 0.1\n[[obstacles]]\nat_m = [1.0, 0.0]\nradius_m = 0.3\n[[chains]]\n\
         connectors = 4\nat_m = [0.575, 0.0]\nrod_m = [0.4, 0.5]\nradius_m = 0.1\n{more}\
         [[chains.tasks]]\nkind = \"external\"\nspeed_m_s = 0.5\n"
    );
    plane(&text, 1)
}

/// Returns whether values are the same apart from rounding.
fn is_near(values: &[f64], expected: &[f64]) -> bool {
    values.len() == expected.len()
        && values.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12)
}

#[test]
fn a_connector_goes_toward_its_place_at_its_speed_and_arrives() {
    let mut run = facing_a_disc("");
    assert_eq!(
        (name(&run, 0, "answer"), name(&run, 0, "heeds")),
        ("no-order".into(), "yes".into())
    );
    order(&mut run, "to_m", 0, &[0.575, 0.07]);
    run.advance(1);
    let seen = observed(&run, 0);
    assert_eq!(name(&run, 0, "answer"), "moved");
    assert_eq!(seen["done_share"], [1.0]);
    assert!(is_near(&seen["joints_m"][..2], &[0.575, 0.05]), "{:?}", seen["joints_m"]);
    assert!(is_near(&seen["wish_m"], &[0.575, 0.05, 0.575, 0.05]), "{:?}", seen["wish_m"]);
    assert_eq!(seen["reached_m"][..], seen["joints_m"][..2]);
    run.advance(1);
    assert_eq!(name(&run, 0, "answer"), "no-order", "an order is for one cycle");
    assert_eq!(observed(&run, 0)["joints_m"], seen["joints_m"], "and then the chain rests");
}

#[test]
fn a_veto_is_told_with_who_objects_and_why_and_nothing_moves() {
    let mut run = facing_a_disc("");
    let before = observed(&run, 0);
    order(&mut run, "to_m", 0, &[0.9, 0.0]);
    run.advance(1);
    let seen = observed(&run, 0);
    assert_eq!(name(&run, 0, "answer"), "vetoed");
    assert_eq!(name(&run, 0, "veto"), "target-blocked");
    assert_eq!((name(&run, 0, "veto_cause"), seen["veto_cause_id"][0]), ("obstacle".into(), 0.0));
    assert_eq!((seen["veto_part"][0], seen["done_share"][0]), (0.0, 0.0));
    assert_eq!(seen["joints_m"], before["joints_m"]);
    assert!(is_near(&seen["wish_m"][..2], &[0.625, 0.0]), "{:?}", seen["wish_m"]);
    assert!((0.575..=0.6).contains(&seen["reached_m"][0]), "{:?}", seen["reached_m"]);
}

#[test]
fn as_far_as_it_goes_it_goes_to_the_obstacle() {
    let mut run = facing_a_disc("");
    order(&mut run, "to_m", 0, &[0.9, 0.0]);
    order(&mut run, "reach", 0, &[1.0]);
    run.advance(1);
    let seen = observed(&run, 0);
    assert_eq!(
        (name(&run, 0, "answer"), name(&run, 0, "veto")),
        ("cut-short".into(), "target-blocked".into())
    );
    // Half of the way of 0.05 m is free, and it is found to within 1/256.
    assert!((0.599..0.6001).contains(&seen["joints_m"][0]), "{:?}", seen["joints_m"]);
    assert!((seen["done_share"][0] - 0.5).abs() < 0.02, "{:?}", seen["done_share"]);
    assert_eq!(seen["reached_m"][..], seen["joints_m"][..2]);
    assert!(seen["gap_m"][0].abs() < 1e-3, "{:?}", seen["gap_m"]);
}

#[test]
fn a_rod_goes_with_both_ends_and_a_third_connector_follows() {
    let mut run = facing_a_disc("");
    order(&mut run, "rod_to_m", 0, &[0.075, 0.04, -0.425, 0.04]);
    order(&mut run, "rod", 0, &[1.0]);
    run.advance(1);
    let seen = observed(&run, 0);
    assert_eq!(name(&run, 0, "answer"), "moved");
    assert_eq!(seen["joints_m"][2..6], [0.075, 0.04, -0.425, 0.04]);
    assert_eq!(seen["wish_m"], [0.075, 0.04, -0.425, 0.04]);
    // Without a number it is the rod behind the leader.
    order(&mut run, "rod_to_m", 0, &[0.5, 0.0, 0.05, 0.0]);
    run.advance(1);
    assert_eq!(observed(&run, 0)["joints_m"][4..6], [-0.425, 0.04]);
    assert_ne!(observed(&run, 0)["joints_m"][..2], seen["joints_m"][..2]);
}

#[test]
fn a_connector_that_is_held_objects_and_goes_along_its_line_as_far_as_that_goes() {
    let held = |mobility: &str| {
        facing_a_disc(&format!("[[chains.limits]]\nconnector = 3\nmobility = {mobility}\n"))
    };
    let mut run = held("\"fixed\"");
    for reach in [0.0, 1.0] {
        order(&mut run, "to_m", 0, &[-1.0, 0.3]);
        order(&mut run, "connector", 0, &[3.0]);
        order(&mut run, "reach", 0, &[reach]);
        run.advance(1);
        assert_eq!(
            (name(&run, 0, "answer"), name(&run, 0, "veto")),
            ("vetoed".into(), "fixed".into())
        );
        assert_eq!(observed(&run, 0)["veto_part"], [3.0]);
        assert_eq!(name(&run, 0, "veto_cause"), "none");
    }
    let mut run = held("{ on_segment = [[-3, 0], [3, 0]] }");
    for (reach, answer) in [(0.0, "vetoed"), (1.0, "moved")] {
        order(&mut run, "to_m", 0, &[-0.9, 0.3]);
        order(&mut run, "connector", 0, &[3.0]);
        order(&mut run, "reach", 0, &[reach]);
        run.advance(1);
        assert_eq!(name(&run, 0, "answer"), answer);
    }
    assert!((observed(&run, 0)["joints_m"][6] + 0.9).abs() < 1e-12);
}

#[test]
fn orders_that_the_present_task_does_not_take_are_told_as_unheard() {
    let text = "[chain]\ndt_s = 0.1\n[[chains]]\nconnectors = 3\nrod_m = 0.3\n[[chains.tasks]]\n\
                kind = \"rest\"\nlasts_s = 0.3\n[[chains.tasks]]\nkind = \"external\"\nconnector = 2\n";
    let mut run = plane(text, 1);
    let mut told = Vec::new();
    for _ in 0..5 {
        let heeds = name(&run, 0, "heeds");
        order(&mut run, "to_m", 0, &[-5.0, 0.0]);
        run.advance(1);
        told.push((heeds, name(&run, 0, "answer"), observed(&run, 0)["leads"][0]));
    }
    let expected = [("no", "unheard", -1.0), ("no", "unheard", -1.0), ("no", "unheard", 2.0)];
    let expected = expected.into_iter().chain([("yes", "moved", 2.0); 2]);
    let expected: Vec<_> = expected.map(|(h, a, l)| (h.to_string(), a.to_string(), l)).collect();
    assert_eq!(told, expected);
    assert!((observed(&run, 0)["joints_m"][4] + 0.7).abs() < 1e-12, "two cycles of 0.05 m");
}

#[test]
fn a_chain_that_gets_out_of_the_way_lets_orders_wait_or_carries_them_out_and_touches_nothing() {
    let text = "[[obstacles]]\nat_m = [0.0, -1.0]\nradius_m = 0.3\nvelocity_m_s = [0.0, 0.4]\n\
                [[chains]]\nconnectors = 6\nat_m = [0.6, 0.0]\nrod_m = [0.2, 0.3]\n\
                [[chains.tasks]]\nkind = \"external\"\n";
    let mut run = plane(text, 1);
    let mut answers = std::collections::BTreeSet::new();
    for _ in 0..200 {
        order(&mut run, "to_m", 0, &[0.0, -0.5]);
        order(&mut run, "connector", 0, &[2.0]);
        run.advance(1);
        answers.insert(name(&run, 0, "answer"));
    }
    assert!(answers.len() > 1 && !answers.contains("no-order"), "{answers:?}");
    assert_eq!(run.agent_metrics()[0]["penetrations"], 0);
}

#[test]
fn an_arm_in_space_is_led_out_to_its_reach() {
    let text = "[chain]\ndimensions = 3\ndt_s = 0.1\n[[chains]]\n\
                points_m = [[0, 0, 0], [0, 0, 0.5], [0.3, 0, 0.9]]\nrod_m = 0.5\n\
                [[chains.limits]]\nconnector = 0\nmobility = \"fixed\"\n\
                [[chains.tasks]]\nkind = \"external\"\nconnector = 2\n";
    let run = &mut *chain_run(&source(text), 1).unwrap_or_else(|error| panic!("{error}"));
    for _ in 0..40 {
        order(run, "to_m", 0, &[0.0, 2.0, 0.0]);
        order(run, "reach", 0, &[1.0]);
        run.advance(1);
    }
    let seen = observed(run, 0);
    assert_eq!(
        (name(run, 0, "answer"), name(run, 0, "veto")),
        ("vetoed".into(), "out-of-reach".into())
    );
    assert_eq!((seen["veto_part"][0], seen["joints_m"].len()), (0.0, 9));
    assert!(seen["joints_m"][7] > 0.8, "{:?}", seen["joints_m"]);
}

/// An arm of two joints about parallel axes, each of which turns by 0.1 rad in a cycle at most, and a wall of its own.
const ARM: &str = "[chain]\ndimensions = 3\ndt_s = 0.1\n[[obstacles]]\nat_m = [0.0, 0.8, 0.2]\nradius_m = 0.2\n\
    [[chains]]\narm = { joints = [0.0, 0.5], urdf_text = \"\"\"<robot name='r'><link name='a'/><link name='b'/><link name='c'/>\
    <link name='d'/><joint name='turn' type='revolute'><parent link='a'/><child link='b'/><origin xyz='0 0 0.2'/>\
    <axis xyz='0 0 1'/><limit lower='-3' upper='3' effort='1' velocity='1'/></joint>\
    <joint name='bend' type='revolute'><parent link='b'/><child link='c'/><origin xyz='0.4 0 0'/>\
    <axis xyz='0 0 1'/><limit lower='-2' upper='2' effort='1' velocity='1'/></joint>\
    <joint name='tool' type='fixed'><parent link='c'/><child link='d'/><origin xyz='0.4 0 0'/></joint></robot>\"\"\" }\n\
    radius_m = 0.03\n[[chains.tasks]]\nkind = \"external\"\nconnector = 2\nspeed_m_s = 2.0\n";

fn joints(run: &mut dyn Simulation) -> Vec<f64> {
    use sidestep_kernel::view::FrameOptions;
    run.enable_odometry();
    run.frame(FrameOptions::WITHOUT_SCANS)
        .joints
        .first()
        .map_or(Vec::new(), |arm| arm.values.clone())
}

#[test]
fn the_joints_of_an_arm_go_where_they_are_ordered_within_their_rates_and_stop_before_things() {
    let run = &mut *chain_run(&source(ARM), 1).unwrap_or_else(|error| panic!("{error}"));
    let wanted = [-0.5, 1.0];
    let mut before = joints(run);
    assert_eq!(before, [0.0, 0.5]);
    for _ in 0..30 {
        order(run, "joints", 0, &wanted);
        run.advance(1);
        let now = joints(run);
        assert!(now.iter().zip(&before).all(|(a, b)| (a - b).abs() < 0.1 + 1e-9), "{now:?}");
        before = now;
    }
    assert_eq!(before, wanted);
    assert_eq!(name(run, 0, "answer"), "moved");
    assert_eq!(observed(run, 0)["done_share"], [1.0]);
    // Without a new order they stay, and an order of another sort is no order to joints.
    run.advance(3);
    order(run, "joints", 0, &[0.0, 0.0]);
    order(run, "to_m", 0, &[0.6, -0.4, 0.2]);
    run.advance(1);
    assert_ne!(name(run, 0, "answer"), "no-order");
    // The ball is in the way of a quarter turn.
    for _ in 0..60 {
        order(run, "joints", 0, &[1.8, 0.0]);
        run.advance(1);
    }
    assert_eq!(name(run, 0, "answer"), "vetoed");
    assert!(joints(run)[0] < 1.5 && joints(run)[0] > 0.5, "{:?}", joints(run));
    assert_eq!(run.agent_metrics()[0]["penetrations"], 0);
    let beyond = MultiAgentOrder { order: "joints", agents: &[0], values: &[3.5, 0.0] };
    let refused = run.order(&beyond).expect_err("beyond its limits").to_string();
    assert!(refused.contains("turn"), "{refused}");
}
