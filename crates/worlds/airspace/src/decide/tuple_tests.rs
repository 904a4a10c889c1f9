//! Actions that are tuples of a turn, a change of level and a change of speed: what is chosen is flown and given back, and
//! the shield keeps its promise.

use crate::shield::guarantee_tests::{crowd, lost_and_named, plane};
use crate::{AirspaceRun, airspace_run};
use proptest::prelude::*;
use sidestep_kernel::Simulation;
use sidestep_scenario::Source;

fn run(airspace: &str, airplanes: &str) -> AirspaceRun {
    let text =
        format!("format = 1\nworld = \"airspace\"\nseed = 3\n[airspace]\n{airspace}\n{airplanes}");
    airspace_run(&Source::new("tuples", text, ""), 1).unwrap_or_else(|e| panic!("{e}"))
}

/// How far an airplane has been from what is filed, at the farthest.
#[derive(Debug, Clone, Copy, Default)]
struct Deviation {
    /// From the line on which it flies, in meters.
    side_m: f64,
    level_m: f64,
    speed_m_s: f64,
}

/// Flies two that cross at right angles at 35 m/s on level 1000 m, and returns how far each has deviated.
fn cross(airspace: &str, keys: &str) -> ([Deviation; 2], AirspaceRun) {
    let level = format!("altitude_m = 1000.0\n{keys}");
    let airplanes = plane([-4000.0, 0.0], 0.0, [6000.0, 0.0], &level)
        + &plane([0.0, -4000.0], 90.0, [0.0, 6000.0], &level);
    let mut run = run(airspace, &airplanes);
    let mut deviations = [Deviation::default(); 2];
    for cycle in 0..80 {
        run.advance(1);
        let world = run.world();
        let state = run.state();
        for (slot, deviation) in (0..).zip(&mut deviations) {
            let airplane = &state.airplanes[slot as usize];
            if !state.is_active(world, slot, cycle) {
                continue;
            }
            let segment = state.segment(world, slot);
            let off = |now: f64, filed: f64, before: f64| before.max((now - filed).abs());
            let side = airplane.pose().at[1 - slot as usize];
            deviation.side_m = off(side, 0.0, deviation.side_m);
            deviation.level_m = off(airplane.altitude_m.get(), 1000.0, deviation.level_m);
            deviation.speed_m_s = off(segment.model.v_m_s, 35.0, deviation.speed_m_s);
        }
    }
    let metrics = run.metrics();
    assert_eq!(metrics.losses_of_separation, 0, "{airspace}\n{keys}");
    assert_eq!(metrics.arrived, 2, "{airspace}\n{keys}");
    (deviations, run)
}

#[test]
fn where_levels_are_cheap_one_passes_above_the_other_and_both_come_back_to_their_level() {
    for shield in ["on", "off"] {
        let airspace = format!("vertical_m = 150.0\nlevel_weight = 0.01\nshield = \"{shield}\"");
        let (deviations, run) = cross(&airspace, "level_changes_m = [-160.0, 160.0]");
        let levels_m = deviations.map(|one| one.level_m);
        assert!(levels_m.iter().any(|m| *m >= 75.0), "{shield}: {deviations:?}");
        // A climb takes time, in which the shield may let one turn a little.
        let max_side_m = if shield == "on" { 200.0 } else { 30.0 };
        assert!(deviations.iter().all(|one| one.side_m < max_side_m), "{shield}: {deviations:?}");
        for airplane in &run.state().airplanes {
            assert!(
                (airplane.altitude_m.get() - 1000.0).abs() < 1.0,
                "{shield}: back at its level"
            );
        }
    }
}

#[test]
fn where_levels_are_dear_both_turn() {
    let airspace = "vertical_m = 150.0\nlevel_weight = 10000.0";
    let (deviations, _) = cross(airspace, "level_changes_m = [-160.0, 160.0]");
    assert!(deviations.iter().all(|one| one.level_m < 1.0), "{deviations:?}");
    assert!(deviations.iter().any(|one| one.side_m > 30.0), "{deviations:?}");
}

#[test]
fn one_slows_down_within_its_limits_and_flies_on_as_filed() {
    for limits in ["", "v_min_m_s = 30.0\nacceleration_m_s2 = 0.5\n"] {
        // With one turn rate that hardly turns, speeds are what is left.
        let keys = format!("omega_max_deg_s = 0.2\nspeed_changes_m_s = [-8.0, 8.0]\n{limits}");
        let (deviations, run) = cross("shield = \"off\"\nhorizon_s = 150.0", &keys);
        let speeds_m_s = deviations.map(|one| one.speed_m_s);
        assert!(speeds_m_s.iter().any(|change| *change > 2.0), "{limits}: {deviations:?}");
        if !limits.is_empty() {
            assert!(speeds_m_s.iter().all(|change| *change <= 8.0), "{deviations:?}");
        }
        assert!(run.metrics().mean_delay_percent.is_some_and(|delay| delay < 15.0));
    }
}

#[test]
fn a_product_of_turns_levels_and_speeds_is_optimized_as_one_set() {
    let airspace =
        "vertical_m = 150.0\ncombinations = \"all\"\nlevel_weight = 0.01\nshield = \"off\"";
    let keys = "turns = 3\nlevel_changes_m = [160.0]\nspeed_changes_m_s = [-5.0]";
    let (_, run) = cross(airspace, keys);
    let world = run.world();
    // Two turns with three legs each, straight on in two ways, and the way-point: beside four combinations of the rest.
    assert_eq!(world.actions(0).len(), 9 * 4);
}

#[test]
fn a_change_that_leaves_no_speed_is_refused() {
    let text = "format = 1\nworld = \"airspace\"\n[airspace.generator]\nkind = \"superconflict\"\nn = 3\n\
                [airplane]\nspeed_changes_m_s = [-35.0]\n";
    let error = airspace_run(&Source::new("s", text, ""), 1).expect_err("0 m/s").to_string();
    assert!(error.contains("give changes above -35 m/s"), "{error}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn no_pair_that_is_not_named_loses_separation_where_levels_and_speeds_are_chosen(
        airplanes in crowd(), level_m in 50.0f64..500.0, speed_m_s in 1.0f64..15.0,
        combinations in prop::sample::select(vec!["none", "all"]), has_acceleration in any::<bool>(),
    ) {
        let acceleration = if has_acceleration { "acceleration_m_s2 = 0.5\n" } else { "" };
        let airspace = format!("combinations = \"{combinations}\"\nlevel_weight = 0.1\n");
        let airplanes = format!(
            "[airplane]\nturns = 3\nlevel_changes_m = [-{level_m:?}, {level_m:?}]\n\
             speed_changes_m_s = [-{speed_m_s:?}, {speed_m_s:?}]\n{acceleration}{airplanes}"
        );
        let mut run = run(&airspace, &airplanes);
        run.advance(120);
        let (lost, named) = lost_and_named(&run);
        prop_assert!(lost.is_subset(&named), "{lost:?} but only {named:?} were named\n{airplanes}");
    }
}
