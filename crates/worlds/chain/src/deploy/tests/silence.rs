//! Connectors that are not heard, wherever and whenever: the chain stands and names them, no rod is
//! torn, no connector moves on a veto, and all go on when those are back.

use super::{compared_on, network, talked};
use crate::agents::{ConnectorMove, LeaderOutcome};
use crate::chain_run;
use crate::deploy::final_positions;
use crate::fixtures::chains::AnyWorld;
use proptest::prelude::*;
use sidestep_kernel::Simulation;
use sidestep_kernel::network::{Network, RadioOutage, TimeWindow, UnidirectionalLink};
use sidestep_kernel::view::{FrameOptions, LogEventKind};
use sidestep_rods::{
    LENGTH_TOLERANCE_M, MotionRequest, ReactionRules, RequestSource, RequestedMotion,
};
use sidestep_scenario::Source as Text;

/// A chain of slack or fixed rods that is led along, with a network of some keys.
fn led(network: &str, rod: &str) -> Box<dyn Simulation> {
    let text = format!(
        "format = 1\nworld = \"chain\"\ncycles = 400\n[chain]\ndt_s = 0.05\nself_collision = false\n\
         backtracks = 0\ndeployment = \"team\"\n[chain.network]\n{network}\n\
         [[obstacles]]\nat_m = [2, 1]\nradius_m = 0.5\n\
         [[chains]]\nconnectors = 10\nrod_m = {rod}\nradius_m = 0.1\n\
         [[chains.tasks]]\nkind = \"script\"\nscript = \"forward 9\"\n"
    );
    let mut run = chain_run(&Text::new("s", text, ""), 1).unwrap_or_else(|e| panic!("{e}"));
    run.enable_events();
    run
}

/// Kinds of events since the last look, with their connectors.
fn told(run: &mut dyn Simulation) -> Vec<(LogEventKind, Option<u32>)> {
    run.frame(FrameOptions::with_first_scans(0))
        .log
        .iter()
        .map(|entry| (entry.kind, entry.who.part))
        .collect()
}

#[test]
fn a_chain_stands_within_a_cycle_says_who_is_lost_and_goes_on() {
    for (loss, rod) in [("0.0", "0.5"), ("0.2", "0.5"), ("0.0", "[0.3, 0.6]")] {
        let network =
            format!("loss = {loss}\nsilent = [{{ connector = 6, from_s = 2.0, until_s = 4.0 }}]");
        let mut run = led(&network, rod);
        run.advance(40);
        let moving = told(&mut *run);
        assert!(!moving.iter().any(|(kind, _)| *kind == LogEventKind::Unheard), "{moving:?}");
        run.advance(1);
        assert_eq!(told(&mut *run), [(LogEventKind::Unheard, Some(6))], "loss {loss}, rods {rod}");
        // A motion agreed with the leader by then may have been carried out; from now on none is.
        let stands = run.poses().text;
        run.advance(39);
        assert_eq!(run.poses().text, stands, "loss {loss}, rods {rod}");
        assert_eq!(told(&mut *run), []);
        run.advance(1);
        assert_eq!(told(&mut *run), [(LogEventKind::Heard, Some(6))]);
        run.advance(1);
        assert_ne!(run.poses().text, stands, "it goes on");
        let metrics = run.metrics();
        assert_eq!(metrics["contacts_lost"], 1);
        assert!(metrics["stood"].as_u64() >= Some(40), "{metrics}");
        assert_eq!(metrics["given_up"].as_array().map(Vec::len), Some(0), "it lost no patience");
    }
}

#[test]
fn a_link_that_works_one_way_only_stops_the_chain_as_well() {
    for (sender, receiver) in [(3, 4), (4, 3)] {
        let network = format!(
            "one_way = [{{ sender = {sender}, receiver = {receiver}, from_s = 1.0, until_s = 2.0 }}]"
        );
        let mut run = led(&network, "0.5");
        run.advance(22);
        let lost: Vec<u32> = told(&mut *run)
            .iter()
            .filter(|t| t.0 == LogEventKind::Unheard)
            .filter_map(|t| t.1)
            .collect();
        // The receiver's packets get lost: its sender misses it.
        assert!(lost.contains(&receiver), "{lost:?}");
        let stands = run.poses().text;
        run.advance(18);
        assert_eq!(run.poses().text, stands);
        run.advance(20);
        assert_ne!(run.poses().text, stands);
    }
}

#[test]
fn a_partition_and_a_radio_that_does_not_reach_stop_the_chain() {
    let cut = "partitions = [{ from_s = 1.0, until_s = 2.0, sides = [[0, 1, 2, 3], [4, 5]] }]";
    let mut run = led(cut, "0.5");
    run.advance(22);
    let lost: Vec<_> =
        told(&mut *run).into_iter().filter(|t| t.0 == LogEventKind::Unheard).collect();
    assert_eq!(lost, [3, 4].map(|k| (LogEventKind::Unheard, Some(k))));
    let stands = run.poses().text;
    run.advance(18);
    assert_eq!(run.poses().text, stands);
    run.advance(20);
    assert_ne!(run.poses().text, stands);
    let mut short = led("range_m = 0.4", "0.5");
    let stands = short.poses().text;
    short.advance(5);
    assert_eq!(short.poses().text, stands);
    assert_eq!(short.metrics()["contacts_lost"], 10, "nobody reaches anybody");
}

#[test]
fn bursts_of_losses_stop_the_chain_for_a_while_and_narrow_links_cost_time_alone() {
    let moved = |network: &str| {
        let mut run = led(network, "0.5");
        run.advance(300);
        let metrics = run.metrics();
        let count = |name: &str| metrics[name].as_u64().expect("a count");
        (run.poses().text, count("stood"))
    };
    let wide = moved("");
    let narrow = moved("bandwidth_bit_s = 3e7\npatience_s = 1e-3");
    assert_eq!((&narrow.0, narrow.1, wide.1), (&wide.0, 0, 0));
    let bursts = moved("bursts = { loss = 1.0, lasts_s = 0.2, every_s = 2.0 }");
    assert!(bursts.1 > 10 && bursts.0 != wide.0, "{bursts:?}");
}

#[test]
fn a_motion_that_takes_longer_than_a_cycle_is_not_carried_out_and_told() {
    let mut run = led("latency_s = 5e-3\npatience_s = 5e-3", "0.5");
    let stands = run.poses().text;
    run.advance(5);
    assert_eq!(run.poses().text, stands);
    let told = told(&mut *run);
    assert!(
        told.iter().all(|(kind, _)| *kind == LogEventKind::Deadline) && told.len() == 5,
        "{told:?}"
    );
    assert_eq!(run.metrics()["deadlines_missed"], 5);
}

#[test]
fn a_silent_leader_knows_it_and_stands() {
    let mut run = led("silent = [{ connector = 0, from_s = 1.0, until_s = 2.0 }]", "0.5");
    run.advance(20);
    let stands = run.poses().text;
    run.advance(20);
    assert_eq!(run.poses().text, stands);
    run.advance(3);
    assert_ne!(run.poses().text, stands);
}

/// A random fault in a talk.
fn faulty(
    loss: f64,
    delay: f64,
    deadline: f64,
    silent: Option<u32>,
    cut: Option<(u32, bool)>,
) -> Network {
    let whole = |agent| RadioOutage { agent, window: TimeWindow::ALWAYS };
    let one_way = |(k, up): (u32, bool)| {
        let (sender, receiver) = if up { (k, k + 1) } else { (k + 1, k) };
        UnidirectionalLink { sender, receiver, window: TimeWindow::ALWAYS }
    };
    Network {
        radio_outages: silent.into_iter().map(whole).collect(),
        unidirectional_links: cut.into_iter().map(one_way).collect(),
        ..network(loss, delay, 0.1, deadline)
    }
}

/// One motion of a random chain over a faulty network: all of it is carried out, as one process does it, or
/// no connector moves; a vetoed motion is not; a connector that does not know goes with its master or not at
/// all.
fn all_or_nothing<const D: usize>(seed: u64, network: &Network) -> Result<bool, TestCaseError> {
    let mut world = AnyWorld::<D>::new(seed);
    let rules = ReactionRules { self_collision: false, backtracks: 0, ..world.rules };
    let MotionRequest { motion: RequestedMotion::Connector { k, to }, .. } =
        world.any_request(0.15)
    else {
        return Ok(false);
    };
    let (chain, obstacles) = (&world.chain, &world.obstacles);
    let told = (k, to, RequestSource::Operator);
    let controls = talked((chain, obstacles, &rules), told, Some(network), seed);
    prop_assert!(controls.iter().all(Option::is_some), "everybody comes to a decision");
    let led = controls.iter().flatten().find_map(|control| control.led);
    let points = final_positions(chain, &controls);
    prop_assert_eq!(points.is_some(), led.is_some(), "what is led is carried out by all");
    for control in controls.iter().flatten() {
        let is_within = |led: crate::agents::ExecutedMotion| {
            (led.first..=led.last).contains(&control.connector)
        };
        if let ConnectorMove::To { to, .. } = control.goes {
            let stays = to == chain.points()[control.connector as usize];
            prop_assert!(stays || led.is_some_and(is_within), "nobody goes alone");
        }
    }
    let vetoed = matches!(
        controls[k].as_ref().and_then(|control| control.ended.clone()),
        Some(LeaderOutcome::Climbed { objection: Some(_), .. })
    );
    prop_assert!(!vetoed || points.is_none(), "nobody moves on a veto");
    if let Some(points) = points {
        let whole = compared_on(&mut world, &rules, (k, to));
        prop_assert_eq!(&points[..], whole.points());
        prop_assert!(whole.max_rod_violation_m() < 1.1 * LENGTH_TOLERANCE_M);
        return Ok(true);
    }
    Ok(false)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]
    #[test]
    fn over_any_network_a_motion_is_carried_out_by_all_or_by_nobody(
        seed in 0u64..100_000, loss in 0.0f64..0.7, delay in 0.0f64..4.0, deadline in 8.0f64..300.0,
        silent in prop::option::weighted(0.2, 0u32..11),
        cut in prop::option::weighted(0.2, (0u32..10, any::<bool>())),
    ) {
        let network = faulty(loss, delay, deadline, silent, cut);
        all_or_nothing::<2>(seed, &network)?;
        all_or_nothing::<3>(seed, &network)?;
    }
}

/// Deadlines at every tick of a motion: also those at which only some have heard that it is carried out.
#[test]
fn whenever_time_is_up_all_move_or_nobody_does() {
    let mut carried_out = [0, 0];
    for seed in 0..12 {
        for deadline in 4..70 {
            let network = faulty(0.1, 0.0, f64::from(deadline), None, None);
            let is = all_or_nothing::<2>(seed, &network)
                .unwrap_or_else(|e| panic!("{seed} {deadline} {e}"));
            carried_out[usize::from(is)] += 1;
        }
    }
    assert!(carried_out.iter().all(|&n| n > 50), "{carried_out:?}");
}
