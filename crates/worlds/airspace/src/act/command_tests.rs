//! Levels and speeds that methods command: the shield keeps its promise whatever they are, airplanes stay within their
//! limits, and all come back to what is filed.

use super::performance_tests::{fly_within_limits, mixed_crowd, speed_and_level};
use crate::flight::{CommandKinds, LevelCommand, MethodCommand, SpeedFactors};
use crate::method::{Method, MethodPercept, Methods, Steering};
use crate::scenario::CompiledAirspace;
use crate::shield::guarantee_tests::{crowd, lost_and_named, plane};
use crate::state::AirspaceState;
use crate::{AirspaceRun, airspace_run};
use proptest::prelude::*;
use sidestep_kernel::Simulation;
use sidestep_kernel::stream::Draws;
use sidestep_scenario::Source;
use std::sync::Arc;

/// Number of cases of the long test.
const MANY: u32 = 10_000;
const RESOLUTIONS: [&str; 5] =
    ["heading", "speed", "heading-speed", "vertical", "heading-speed-vertical"];

fn source(airspace: &str, airplanes: &str) -> Source {
    let text =
        format!("format = 1\nworld = \"airspace\"\nseed = 3\n[airspace]\n{airspace}\n{airplanes}");
    Source::new("commands", text, "")
}

pub(crate) fn run(airspace: &str, airplanes: &str) -> AirspaceRun {
    airspace_run(&source(airspace, airplanes), 1).unwrap_or_else(|e| panic!("{e}"))
}

pub(crate) fn run_own(
    method: impl Method + 'static,
    airspace: &str,
    airplanes: &str,
) -> AirspaceRun {
    let source = source(&format!("method = \"own\"\n{airspace}"), airplanes);
    let method: Arc<dyn Method> = Arc::new(method);
    let own = Methods::from([("own".to_string(), method)]);
    CompiledAirspace::with_methods(&source, &own).expect("a scenario").start(&source, 1)
}

pub(crate) fn by_mvp(resolution: &str, more: &str) -> String {
    format!("method = \"mvp\"\nmvp = {{ resolution = \"{resolution}\" }}\n{more}")
}

/// Commands at random, sometimes nothing, and turns at random.
#[derive(Debug)]
pub(crate) struct AtRandom;

impl Method for AtRandom {
    fn decide(&self, percept: &MethodPercept<'_>, draws: &mut Draws) -> Steering {
        if draws.uniform() < 0.5 {
            return Steering::Proceed;
        }
        Steering::TurnRate((2.0 * draws.uniform() - 1.0) * percept.omega_max_rad_s)
    }

    fn command_kinds(&self) -> CommandKinds {
        CommandKinds { levels: true, speeds: Some(SpeedFactors { least: 0.5, largest: 2.0 }) }
    }

    fn command(&self, percept: &MethodPercept<'_>, draws: &mut Draws) -> MethodCommand {
        let [keeps, altitude, rate, speed] = [0; 4].map(|_| draws.uniform());
        if keeps < 0.7 {
            return percept.command;
        }
        let level = LevelCommand { altitude_m: 1200.0 * altitude, vertical_m_s: 60.0 * rate };
        MethodCommand {
            level: (rate > 0.2).then_some(level),
            v_m_s: (speed > 0.2).then_some(100.0 * speed),
        }
    }
}

/// Commands one thing for some time, and then gives it back.
#[derive(Debug)]
struct For {
    command: MethodCommand,
    cycles: u64,
}

impl Method for For {
    fn decide(&self, _: &MethodPercept<'_>, _: &mut Draws) -> Steering {
        Steering::Proceed
    }

    fn command_kinds(&self) -> CommandKinds {
        CommandKinds { levels: true, speeds: Some(SpeedFactors { least: 0.5, largest: 2.0 }) }
    }

    fn command(&self, percept: &MethodPercept<'_>, _: &mut Draws) -> MethodCommand {
        if percept.now < self.cycles { self.command } else { MethodCommand::NONE }
    }
}

fn only_named_pairs_lose(run: &mut AirspaceRun, airplanes: &str) -> Result<(), TestCaseError> {
    fly_within_limits(run, 120)?;
    let (lost, named) = lost_and_named(run);
    prop_assert!(lost.is_subset(&named), "{lost:?} but only {named:?} were named\n{airplanes}");
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn no_pair_that_is_not_named_loses_separation_by_any_resolution(
        airplanes in prop_oneof![crowd(), mixed_crowd()],
        resolution in prop::sample::select(&RESOLUTIONS[..]),
        errors in prop::sample::select(vec!["", "position_noise_m = 5.0", "heading_noise_deg = 0.1"]),
    ) {
        let mut run = run(&by_mvp(resolution, errors), &airplanes);
        only_named_pairs_lose(&mut run, &airplanes)?;
    }

    #[test]
    fn no_pair_that_is_not_named_loses_separation_whatever_is_commanded(
        airplanes in prop_oneof![crowd(), mixed_crowd()],
        errors in prop::sample::select(vec!["", "position_noise_m = 5.0", "heading_noise_deg = 0.1"]),
    ) {
        let mut run = run_own(AtRandom, errors, &airplanes);
        only_named_pairs_lose(&mut run, &airplanes)?;
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(MANY))]

    #[test]
    #[ignore = "ten thousand runs: minutes"]
    fn no_pair_that_is_not_named_loses_whatever_is_commanded_in_ten_thousand_runs(
        airplanes in prop_oneof![crowd(), mixed_crowd()],
        resolution in prop::sample::select(&["own", "speed", "heading-speed", "vertical", "heading-speed-vertical"][..]),
        errors in prop::sample::select(vec!["", "position_noise_m = 5.0"]),
    ) {
        let mut run = match resolution {
            "own" => run_own(AtRandom, errors, &airplanes),
            _ => run(&by_mvp(resolution, errors), &airplanes),
        };
        only_named_pairs_lose(&mut run, &airplanes)?;
    }
}

/// Two that meet head-on on one level, and two that meet at right angles beside them.
pub(crate) fn meeting() -> String {
    let far = "altitude_m = 2000.0";
    plane([-6000.0, 0.0], 0.0, [12_000.0, 0.0], far)
        + &plane([6000.0, 100.0], 180.0, [-12_000.0, 100.0], far)
        + &plane([40_000.0, -6000.0], 90.0, [40_000.0, 9000.0], far)
        + &plane([34_000.0, 200.0], 0.0, [49_000.0, 200.0], far)
}

#[test]
fn pairs_are_kept_apart_in_the_vertical_and_come_back_to_their_levels() {
    for shield in ["on", "off"] {
        let airspace = format!(
            "method = \"mvp\"\nmvp = {{ resolution = \"vertical\", vertical_lead_s = 45 }}\n\
             shield = \"{shield}\""
        );
        let mut run = run(&airspace, &meeting());
        let mut farthest_m: f64 = 0.0;
        for _ in 0..50 {
            run.advance(1);
            for slot in 0..4 {
                let altitude_m = speed_and_level(&run, slot).altitude_m;
                farthest_m = farthest_m.max((altitude_m - 2000.0).abs());
            }
        }
        assert!(farthest_m > 150.0 && farthest_m < 170.0, "{shield}: {farthest_m}");
        let flown = run.metrics();
        assert_eq!(flown.losses_of_separation, 0, "{shield}");
        // Straight on: nobody has turned.
        assert_eq!(flown.maneuvers, Some(0), "{shield}");
        for slot in 0..4 {
            assert_eq!(speed_and_level(&run, slot).altitude_m, 2000.0, "{shield} {slot}");
            assert!(run.state().command_in_force(slot as u32).is_none(), "{shield} {slot}");
        }
    }
}

#[test]
fn pairs_that_cross_are_kept_apart_by_speed_and_come_back_to_their_speeds() {
    let crossing = plane([-6000.0, 0.0], 0.0, [9000.0, 0.0], "acceleration_m_s2 = 0.5")
        + &plane([0.0, -6500.0], 90.0, [0.0, 9000.0], "");
    for shield in ["on", "off"] {
        let more = format!("shield = \"{shield}\"");
        let mut run = run(&by_mvp("speed", &more), &crossing);
        let mut farthest_m_s = [0.0_f64; 2];
        for _ in 0..85 {
            fly_within_limits(&mut run, 1).expect("within its limits");
            for (slot, farthest_m_s) in farthest_m_s.iter_mut().enumerate() {
                let v_m_s = speed_and_level(&run, slot).v_m_s;
                *farthest_m_s = farthest_m_s.max((v_m_s - 35.0).abs());
            }
        }
        assert!(farthest_m_s.iter().all(|most| (0.5..7.01).contains(most)), "{farthest_m_s:?}");
        assert_eq!(run.metrics().losses_of_separation, 0, "{shield}");
        assert_eq!(speed_and_level(&run, 0).v_m_s, 35.0, "{shield}");
        run.advance(40);
        assert_eq!(run.metrics().arrived, 2, "{shield}");
    }
}

#[test]
fn a_command_overlays_the_filed_flight_until_it_is_given_back() {
    let alone = plane([0.0, 0.0], 0.0, [50_000.0, 0.0], "acceleration_m_s2 = 0.4");
    let level = LevelCommand { altitude_m: 100.0, vertical_m_s: 4.0 };
    let command = MethodCommand { level: Some(level), v_m_s: Some(38.0) };
    let mut run = run_own(For { command, cycles: 10 }, "", &alone);
    // It is in force from the cycle after the first decision on.
    let expected = [(1, 35.0, 0.0), (2, 37.0, 20.0), (3, 38.0, 40.0), (6, 38.0, 100.0)];
    let given_back = [(11, 38.0, 100.0), (12, 36.0, 61.9), (13, 35.0, 23.8), (15, 35.0, 0.0)];
    for (cycle, v_m_s, altitude_m) in expected.into_iter().chain(given_back) {
        run.advance(cycle - run.cycle());
        let found = speed_and_level(&run, 0);
        assert_eq!(found.v_m_s, v_m_s, "{cycle}");
        assert!((found.altitude_m - altitude_m).abs() < 1e-9, "{cycle} {}", found.altitude_m);
    }
    run.advance(1);
    assert!(run.state().command_in_force(0).is_none());
}

#[test]
fn an_order_while_a_speed_is_commanded_counts_once_that_is_given_back() {
    let ordered = "orders = [{ at_s = 20.0, speed_m_s = 44.0 }]\nacceleration_m_s2 = 0.4";
    let alone = plane([0.0, 0.0], 0.0, [50_000.0, 0.0], ordered);
    let command = MethodCommand { level: None, v_m_s: Some(31.0) };
    let mut run = run_own(For { command, cycles: 10 }, "", &alone);
    run.advance(11);
    assert_eq!(speed_and_level(&run, 0).v_m_s, 31.0);
    fly_within_limits(&mut run, 7).expect("it accelerates from there");
    assert_eq!(speed_and_level(&run, 0).v_m_s, 44.0);
    assert_eq!(run.metrics().orders, 1);
}

#[test]
fn a_level_that_another_airplane_holds_is_not_cleared_and_that_is_counted() {
    let above = "altitude_m = 400.0";
    let airplanes = plane([0.0, 0.0], 0.0, [30_000.0, 0.0], "")
        + &plane([0.0, 0.0], 0.0, [30_000.0, 0.0], above);
    let level = LevelCommand { altitude_m: 200.0, vertical_m_s: 10.0 };
    let command = MethodCommand { level: Some(level), v_m_s: None };
    let mut run = run_own(For { command, cycles: 1000 }, "", &airplanes);
    run.advance(60);
    let found: Vec<f64> = (0..2).map(|slot| speed_and_level(&run, slot).altitude_m).collect();
    // Both are sent to 200 m. They fly side by side, and stay 300 m from each other.
    assert!((found[1] - found[0] - 300.0).abs() < 1.0, "{found:?}");
    let metrics = run.metrics();
    assert!(metrics.commands_held.is_some_and(|held| held > 10), "{:?}", metrics.commands_held);
    assert_eq!((metrics.losses_of_separation, metrics.orders_delayed), (0, 0));
}

#[test]
fn a_state_with_commands_goes_on_from_its_snapshot_by_the_same_bits() {
    let mut whole = run_own(AtRandom, "", &meeting());
    whole.advance(20);
    let snapshot = whole.state().snapshot(20);
    let restored = AirspaceState::restore(whole.world(), &snapshot);
    assert!(snapshot.commands.iter().any(|command| !command.in_force.is_none()));
    assert_eq!(restored.snapshot(20), snapshot);
}

#[test]
fn rules_that_change_to_another_method_give_commands_back() {
    let airspace = by_mvp("vertical", "changes = [{ at_s = 100.0, method = \"none\" }]");
    let mut run = run(&airspace, &meeting());
    run.advance(20);
    assert!((0..4).any(|slot| speed_and_level(&run, slot).altitude_m != 2000.0));
    run.advance(20);
    assert!((0..4).all(|slot| speed_and_level(&run, slot).altitude_m == 2000.0));
}

#[test]
fn where_nothing_is_commanded_the_state_has_no_commands() {
    let run = run(&by_mvp("heading", ""), &meeting());
    assert!(run.state().snapshot(0).commands.is_empty());
    assert_eq!(run.metrics().commands_held, None);
}

/// Flies a scenario that is shipped to its end, and checks that no pair that is not named loses separation, and that all
/// come back to what is filed.
fn flown_scenario(text: &str, airspace: &str) -> AirspaceRun {
    let text = text.replace("[airspace]\n", &format!("[airspace]\n{airspace}\n"));
    let mut run = airspace_run(&Source::new("shipped", text, ""), 1).expect("a scenario");
    let last_cycle = 600;
    while run.metrics().arrived < run.metrics().airplanes && run.cycle() < last_cycle {
        fly_within_limits(&mut run, 1).expect("within its limits");
    }
    let metrics = run.metrics();
    assert_eq!(metrics.arrived, metrics.airplanes, "{airspace}");
    assert_eq!(metrics.losses_of_unreported_pairs, 0, "{airspace}");
    for slot in 0..metrics.airplanes as usize {
        let filed =
            run.world().segment(slot as u32, run.state().airplanes[slot].orders.get().into());
        let found = speed_and_level(&run, slot);
        assert_eq!(found.altitude_m, filed.altitude_m, "{airspace} {slot}");
        assert_eq!(found.v_m_s, filed.model.v_m_s, "{airspace} {slot}");
    }
    run
}

#[test]
fn the_scenario_of_vertical_resolutions_keeps_all_apart_on_their_routes_and_brings_them_back() {
    let text = include_str!("../../../../../scenarios/airspace/mvp-vertical.toml");
    for shield in ["", "shield = \"off\""] {
        let run = flown_scenario(text, shield);
        assert_eq!(run.metrics().losses_of_separation, 0, "{shield}");
        assert_eq!(run.metrics().maneuvers, Some(0), "{shield}");
    }
    let turning = text.replace("resolution = \"vertical\"", "resolution = \"heading\"");
    let turning = turning.replace(", vertical_lead_s = 90.0", "");
    assert!(flown_scenario(&turning, "").metrics().maneuvers > Some(0));
    let none = text.replace("method = \"mvp\"", "method = \"none\"");
    assert!(flown_bare(&none) > 0);
}

#[test]
fn the_scenario_of_speed_resolutions_keeps_all_apart_on_their_routes_and_brings_them_back() {
    let text = include_str!("../../../../../scenarios/airspace/mvp-speed.toml");
    for shield in ["", "shield = \"off\""] {
        let run = flown_scenario(text, shield);
        assert_eq!(run.metrics().losses_of_separation, 0, "{shield}");
        assert_eq!(run.metrics().maneuvers, Some(0), "{shield}");
    }
    let none = text.replace("method = \"mvp\"", "method = \"none\"");
    assert!(flown_bare(&none) > 0);
}

/// Returns the losses of separation of a scenario without the shield.
fn flown_bare(text: &str) -> u64 {
    let text = text.replace("[airspace]\n", "[airspace]\nshield = \"off\"\n");
    let mut run = airspace_run(&Source::new("bare", text, ""), 1).expect("a scenario");
    run.advance(300);
    run.metrics().losses_of_separation
}
