//! Airplanes of mixed types: what they fly is within their limits, and the shield keeps its promise.

use crate::shield::guarantee_tests::lost_and_named;
use crate::{AirspaceRun, airspace_run};
use proptest::prelude::*;
use sidestep_kernel::{EntitySlot, Simulation};
use sidestep_scenario::Source;

/// Number of cases of the long test.
const MANY: u32 = 10_000;

fn run(airspace: &str, airplanes: &str) -> AirspaceRun {
    let text =
        format!("format = 1\nworld = \"airspace\"\nseed = 3\n[airspace]\n{airspace}\n{airplanes}");
    airspace_run(&Source::new("types", text, ""), 1).unwrap_or_else(|e| panic!("{e}"))
}

/// A kind of airplane, with the limits within which it is given orders.
#[derive(Debug, Clone, Copy)]
struct TestType {
    /// Keys of the airplane.
    keys: &'static str,
    speeds_m_s: [f64; 2],
    climb_max_m_s: f64,
}

const TYPES: [TestType; 5] = [
    TestType { keys: "type = \"light-airplane\"", speeds_m_s: [24.7, 66.4], climb_max_m_s: 3.7 },
    TestType { keys: "type = \"small-fixed-wing\"", speeds_m_s: [11.0, 30.0], climb_max_m_s: 3.0 },
    TestType { keys: "type = \"quadrotor\"", speeds_m_s: [0.5, 15.0], climb_max_m_s: 6.0 },
    // Bank is felt at high speeds, and the turn rate at low ones.
    TestType {
        keys: "v_m_s = 40.0\nbank_max_deg = 30.0\nomega_max_deg_s = 6.0\nacceleration_m_s2 = 0.4",
        speeds_m_s: [20.0, 90.0],
        climb_max_m_s: 50.0,
    },
    TestType { keys: "v_m_s = 35.0", speeds_m_s: [20.0, 50.0], climb_max_m_s: 50.0 },
];

/// Orders by rising time, within the limits of a type.
fn orders(kind: TestType) -> impl Strategy<Value = String> {
    let order = (5.0f64..250.0, 0u8..7, 0.0f64..1.0).prop_map(move |(at_s, task, part)| {
        let [slow_m_s, fast_m_s] = kind.speeds_m_s;
        let words = match task {
            0..=2 => format!("speed_m_s = {:?}", slow_m_s + part * (fast_m_s - slow_m_s)),
            3 | 4 => {
                let altitude_m = 400.0 * (3.0 * part).floor();
                let climb_m_s = 0.5 + part * (kind.climb_max_m_s - 0.5);
                format!("altitude_m = {altitude_m:?}, climb_m_s = {climb_m_s:?}")
            }
            5 => format!("heading_deg = {:?}", 360.0 * part),
            _ => "proceeds = true".to_string(),
        };
        (at_s, words)
    });
    prop::collection::vec(order, 0..6).prop_map(|mut orders| {
        orders.sort_by(|a, b| a.0.total_cmp(&b.0));
        let words: Vec<String> =
            orders.iter().map(|(at_s, task)| format!("{{ at_s = {at_s:?}, {task} }}")).collect();
        format!("orders = [{}]", words.join(", "))
    })
}

/// Airplanes of several types on three levels, with orders of speed and level.
pub(crate) fn mixed_crowd() -> impl Strategy<Value = String> {
    let coordinate = || -3000.0f64..3000.0;
    let one = (0usize..TYPES.len()).prop_flat_map(move |kind| {
        let kind = TYPES[kind];
        let places = [coordinate(), coordinate(), coordinate(), coordinate()];
        (places, -180.0f64..180.0, 0.0f64..150.0, 0u8..3, orders(kind)).prop_map(
            move |([x, y, to_x, to_y], heading_deg, late_s, level, orders)| {
                let appears_s = (late_s - 75.0).max(0.0);
                let altitude_m = 400.0 * f64::from(level);
                format!(
                    "[[airplanes]]\nat_m = [{x:?}, {y:?}]\nheading_deg = {heading_deg:?}\n\
                     way_points_m = [[{to_x:?}, {to_y:?}]]\nappears_s = {appears_s:?}\n\
                     altitude_m = {altitude_m:?}\n{}\n{orders}\n",
                    kind.keys
                )
            },
        )
    });
    prop::collection::vec(one, 2..7).prop_map(|all| all.concat())
}

/// The speed and the altitude of an airplane.
#[derive(Clone, Copy)]
pub(super) struct SpeedAndLevel {
    pub(super) v_m_s: f64,
    pub(super) altitude_m: f64,
}

pub(super) fn speed_and_level(run: &AirspaceRun, slot: usize) -> SpeedAndLevel {
    let segment = run.state().segment(run.world(), slot as EntitySlot);
    let altitude_m = run.state().airplanes[slot].altitude_m.get();
    SpeedAndLevel { v_m_s: segment.model.v_m_s, altitude_m }
}

/// Flies some cycles, and checks in each that no airplane does more than it can.
pub(super) fn fly_within_limits(run: &mut AirspaceRun, cycles: u64) -> Result<(), TestCaseError> {
    let world = run.world().clone();
    let dt_s = world.timing.dt_s;
    for _ in 0..cycles {
        let before: Vec<SpeedAndLevel> =
            (0..world.airplanes.len()).map(|slot| speed_and_level(run, slot)).collect();
        run.advance(1);
        for (slot, before) in before.into_iter().enumerate() {
            let performance = &world.airplanes[slot].performance;
            let now = speed_and_level(run, slot);
            let changes_m_s = (now.v_m_s - before.v_m_s).abs();
            prop_assert!(changes_m_s <= performance.acceleration_m_s2 * dt_s + 1e-9);
            prop_assert!(performance.allows_speed(now.v_m_s), "{} m/s", now.v_m_s);
            let turn_rad_s = run.state().turn_rate_rad_s(slot as EntitySlot).abs();
            prop_assert!(turn_rad_s <= performance.turn.omega_rad_s(now.v_m_s), "{turn_rad_s}");
            let climbs_m = now.altitude_m - before.altitude_m;
            let max_m_s = performance.vertical_max_m_s(climbs_m > 0.0);
            prop_assert!(climbs_m.abs() <= max_m_s * dt_s + 1e-9, "{climbs_m} m");
            prop_assert!(performance.allows_altitude(now.altitude_m));
        }
    }
    Ok(())
}

fn only_named_pairs_lose(airspace: &str, airplanes: &str) -> Result<(), TestCaseError> {
    let mut run = run(airspace, airplanes);
    fly_within_limits(&mut run, 120)?;
    let (lost, named) = lost_and_named(&run);
    prop_assert!(lost.is_subset(&named), "{lost:?} but only {named:?} were named\n{airplanes}");
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn airplanes_of_all_types_stay_within_their_limits_and_no_pair_that_is_not_named_loses(
        airplanes in mixed_crowd(), method in prop::sample::select(vec!["none", "mvp", "pc"]),
        errors in prop::sample::select(vec!["", "position_noise_m = 5.0", "heading_noise_deg = 0.1"]),
    ) {
        let more = if method == "pc" { "max_rounds = 10" } else { "" };
        only_named_pairs_lose(&format!("method = \"{method}\"\n{more}\n{errors}"), &airplanes)?;
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(MANY))]

    #[test]
    #[ignore = "ten thousand runs: minutes"]
    fn no_pair_of_any_types_that_is_not_named_loses_in_ten_thousand_runs(
        airplanes in mixed_crowd(), method in prop::sample::select(vec!["none", "mvp"]),
        errors in prop::sample::select(vec!["", "position_noise_m = 5.0"]),
    ) {
        only_named_pairs_lose(&format!("method = \"{method}\"\n{errors}"), &airplanes)?;
    }
}

/// Four that meet at one place, each with orders of speed that its acceleration and its bank limit.
const MEETING: &str = "[[airplanes]]\nat_m = [-4000, 0]\nheading_deg = 0\nway_points_m = [[9000, 0]]\n\
    type = \"light-airplane\"\norders = [{ at_s = 10.0, speed_m_s = 30.0 }, { at_s = 60.0, speed_m_s = 66.0 }]\n\
    [[airplanes]]\nat_m = [0, -3000]\nheading_deg = 90\nway_points_m = [[0, 9000]]\nv_m_s = 40.0\n\
    bank_max_deg = 25.0\nacceleration_m_s2 = 0.8\norders = [{ at_s = 7.0, speed_m_s = 70.0 }]\n\
    [[airplanes]]\nat_m = [1500, 1000]\nheading_deg = 200\nway_points_m = [[-9000, -900]]\ntype = \"quadrotor\"\n\
    orders = [{ at_s = 12.0, speed_m_s = 3.0 }, { at_s = 40.0, altitude_m = 90.0 }]\n\
    [[airplanes]]\nat_m = [4000, 500]\nheading_deg = 180\nway_points_m = [[-9000, 0]]\nv_m_s = 35.0\n\
    orders = [{ at_s = 30.0, speed_m_s = 45.0 }]\n";

#[test]
fn every_deployment_flies_types_that_accelerate_by_the_same_bits() {
    let digest = |deployment: &str, settings: &str| {
        let airspace = format!("deployment = \"{deployment}\"\nmax_rounds = 20\n{settings}");
        let mut run = run(&airspace, MEETING);
        run.advance(30);
        run.digest()
    };
    for settings in ["", "preset = \"paper\"", "method = \"mvp\"", "groups = \"heard\""] {
        let reference = if settings.starts_with("groups") { "" } else { settings };
        let direct = digest("direct", reference);
        for deployment in ["team", "compact-team", "replica-team", "pim", "hierarchical-pim"] {
            assert_eq!(digest(deployment, settings), direct, "{deployment} {settings}");
        }
    }
}

#[test]
fn an_airplane_reaches_an_ordered_speed_as_fast_as_it_accelerates() {
    let alone = "[[airplanes]]\nat_m = [0, 0]\nheading_deg = 0\nway_points_m = [[20000, 0]]\nv_m_s = 30.0\n\
                 acceleration_m_s2 = 0.5\norders = [{ at_s = 10.0, speed_m_s = 50.0 }]\n";
    let mut run = run("method = \"none\"", alone);
    // 20 m/s take 40 s: 300 m before, 40 s of 40 m/s on average, and 10 s of 50 m/s.
    run.advance(12);
    let at_m = run.state().airplanes[0].pose().at;
    assert!((at_m[0] - (300.0 + 1600.0 + 500.0)).abs() < 1e-6, "{at_m:?}");
    assert_eq!(speed_and_level(&run, 0).v_m_s, 50.0);
    assert_eq!(run.metrics().orders, 1, "one order, however many cycles it takes");
}

#[test]
fn orders_that_had_to_wait_are_not_caught_up_with_at_once() {
    // It comes in long after its order.
    let late = "[[airplanes]]\nat_m = [0, 0]\nheading_deg = 0\nway_points_m = [[20000, 0]]\nv_m_s = 30.0\n\
                appears_s = 100.0\nacceleration_m_s2 = 0.5\norders = [{ at_s = 10.0, speed_m_s = 50.0 }]\n";
    let mut run = run("method = \"none\"", late);
    run.advance(21);
    assert_eq!(speed_and_level(&run, 0).v_m_s, 31.25);
    fly_within_limits(&mut run, 10).expect("within its limits");
    assert_eq!(speed_and_level(&run, 0).v_m_s, 50.0);
}

#[test]
fn a_faster_airplane_turns_as_its_bank_allows() {
    let turns = "[[airplanes]]\nat_m = [0, 0]\nheading_deg = 0\nway_points_m = [[-50000, 0]]\nv_m_s = 30.0\n\
                 bank_max_deg = 20.0\norders = [{ at_s = 20.0, speed_m_s = 60.0 }]\n";
    let mut run = run("method = \"none\"", turns);
    let limit = run.world().airplanes[0].performance.turn;
    for (cycles, v_m_s) in [(2, 30.0), (4, 60.0)] {
        run.advance(cycles);
        assert!((run.state().turn_rate_rad_s(0).abs() - limit.omega_rad_s(v_m_s)).abs() < 1e-12);
    }
}
