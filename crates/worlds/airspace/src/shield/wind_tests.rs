//! The promise of the shield in winds that differ from level to level and from place to place, tried on whole runs: only
//! pairs that were named lose separation.

use super::area_tests::{moving, some_areas as area_text, unnamed_entries};
use super::guarantee_tests::{crowd, erring, lost_and_named, plane, run};
use crate::{AirspaceRun, airspace_run};
use proptest::prelude::*;
use sidestep_kernel::Simulation;
use sidestep_scenario::Source;

/// Number of cases of the long tests.
const MANY: u32 = 2_000;

/// Winds at some altitudes, as fast as the slowest airplanes permit.
fn layers() -> impl Strategy<Value = String> {
    let wind = || prop::array::uniform2(-13.0f64..13.0);
    prop::collection::vec((0.0f64..300.0, wind()), 2..6).prop_map(|all| {
        let mut altitude_m = -100.0;
        let mut layers = Vec::with_capacity(all.len());
        for (above_m, wind_m_s) in all {
            altitude_m += above_m + 1.0;
            layers.push(format!("{{ altitude_m = {altitude_m:?}, wind_m_s = {wind_m_s:?} }}"));
        }
        format!("winds = [{}]", layers.join(", "))
    })
}

/// The text of a file of winds on three levels, in nine places each.
fn grid() -> impl Strategy<Value = String> {
    let wind = || prop::array::uniform2(-13.0f64..13.0);
    prop::collection::vec(wind(), 27).prop_map(|winds| {
        let mut text = "altitude_m,x_m,y_m,east_m_s,north_m_s\n".to_string();
        for (k, [east, north]) in winds.into_iter().enumerate() {
            let axis = |k: usize| [-4000.0, 500.0, 3000.0][k % 3];
            let altitude_m = [0.0, 300.0, 800.0][k / 9];
            text += &format!("{altitude_m},{},{},{east},{north}\n", axis(k), axis(k / 3));
        }
        text
    })
}

/// Airplanes of different speeds, turn rates and separations among those of [`crowd`].
fn mixed_crowd() -> impl Strategy<Value = String> {
    let kind = (25.0f64..60.0, 2.0f64..9.0, 300.0f64..800.0, 10.0f64..45.0);
    (crowd(), prop::collection::vec(kind, 1..6)).prop_map(|(airplanes, kinds)| {
        let mut kinds = kinds.into_iter().cycle();
        let parts = airplanes.split("[[airplanes]]\n").filter(|part| !part.is_empty());
        let typed = parts.map(|part| {
            let (v_m_s, deg_s, separation_m, bank_deg) = kinds.next().expect("a cycle");
            format!(
                "[[airplanes]]\nv_m_s = {v_m_s:?}\nomega_max_deg_s = {deg_s:?}\nseparation_m = {separation_m:?}\n\
                 bank_max_deg = {bank_deg:?}\n{part}"
            )
        });
        typed.collect()
    })
}

/// A run in winds of a file.
fn run_in_grid(airspace: &str, grid: &str, airplanes: &str) -> AirspaceRun {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("grid.csv"), grid).expect("a file");
    let text = format!(
        "format = 1\nworld = \"airspace\"\n[airspace]\nwind_file = \"grid.csv\"\n{airspace}\n{airplanes}"
    );
    airspace_run(&Source::new("grid", text, folder.path()), 1).expect("a scenario")
}

/// Flies a run for ten minutes.
fn only_named_ones_lose(mut run: AirspaceRun, about: &str) -> Result<(), TestCaseError> {
    run.advance(120);
    let (lost, named) = lost_and_named(&run);
    prop_assert!(lost.is_subset(&named), "{lost:?} but only {named:?} were named\n{about}");
    let entries = unnamed_entries(&run);
    prop_assert!(entries.is_empty(), "{entries:?} were not named\n{about}");
    // With `SIDESTEP_SHOW=1` and `--no-capture`: how many were named, and how many of these lost.
    if std::env::var_os("SIDESTEP_SHOW").is_some() {
        println!("named {} lost {} flights {}", named.len(), lost.len(), run.agent_count());
    }
    Ok(())
}

const METHODS: [&str; 4] = ["none", "mvp", "orca", "pc"];

fn some_method() -> impl Strategy<Value = &'static str> {
    // Methods `none` and `mvp` bring airplanes nearest to each other, and take the least time.
    prop::sample::select(METHODS[..2].to_vec())
}

fn some_areas() -> impl Strategy<Value = String> {
    prop_oneof![Just(String::new()), area_text(moving())]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn no_pair_that_is_not_named_loses_separation_in_layers_of_wind(
        airplanes in mixed_crowd(), layers in layers(), areas in some_areas(), method in some_method(),
    ) {
        let run = run(&format!("method = \"{method}\"\n{layers}"), &format!("{areas}{airplanes}"));
        only_named_ones_lose(run, &format!("{method}\n{layers}\n{areas}{airplanes}"))?;
    }

    #[test]
    fn no_pair_that_is_not_named_loses_separation_in_winds_that_differ_from_place_to_place(
        airplanes in mixed_crowd(), grid in grid(), areas in some_areas(), method in some_method(),
    ) {
        let airspace = format!("method = \"{method}\"");
        let run = run_in_grid(&airspace, &grid, &format!("{areas}{airplanes}"));
        only_named_ones_lose(run, &format!("{method}\n{grid}\n{areas}{airplanes}"))?;
    }

    #[test]
    fn no_pair_that_is_not_named_loses_separation_in_layers_of_wind_with_errors(
        airplanes in crowd(), layers in layers(), sigma_m in 0.0f64..20.0, sigma_deg in 0.0f64..1.0,
    ) {
        let run = run(&erring(sigma_m, sigma_deg, &layers), &airplanes);
        only_named_ones_lose(run, &format!("{sigma_m} {sigma_deg}\n{layers}\n{airplanes}"))?;
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(MANY))]

    #[test]
    #[ignore = "two thousand runs: minutes"]
    fn no_pair_that_is_not_named_loses_separation_in_layers_of_wind_in_two_thousand_runs(
        airplanes in mixed_crowd(), layers in layers(), areas in some_areas(),
        method in prop::sample::select(METHODS.to_vec()),
    ) {
        let run = run(&format!("method = \"{method}\"\n{layers}"), &format!("{areas}{airplanes}"));
        only_named_ones_lose(run, &format!("{method}\n{layers}\n{areas}{airplanes}"))?;
    }

    #[test]
    #[ignore = "two thousand runs: minutes"]
    fn no_pair_that_is_not_named_loses_separation_in_grids_of_wind_in_two_thousand_runs(
        airplanes in mixed_crowd(), grid in grid(), areas in some_areas(),
        method in prop::sample::select(METHODS.to_vec()),
    ) {
        let airspace = format!("method = \"{method}\"");
        let run = run_in_grid(&airspace, &grid, &format!("{areas}{airplanes}"));
        only_named_ones_lose(run, &format!("{method}\n{grid}\n{areas}{airplanes}"))?;
    }
}

/// Airplanes that cross on two levels 200 m from each other, in winds that drive those on the upper one against the others.
#[test]
fn two_on_levels_that_meet_are_kept_apart_in_winds_that_drive_their_orbits_together() {
    let layers =
        "winds = [{ altitude_m = 0, wind_m_s = [0, 0] }, { altitude_m = 200, wind_m_s = [15, 0] }]";
    for method in METHODS {
        let airplanes = plane([-6000.0, 40.0], 0.0, [6000.0, 40.0], "altitude_m = 200")
            + &plane([6000.0, 0.0], 180.0, [-6000.0, 0.0], "")
            + &plane([6000.0, 700.0], 180.0, [-6000.0, 700.0], "altitude_m = 100")
            + &plane([0.0, 6000.0], -90.0, [0.0, -6000.0], "altitude_m = 50");
        let mut run = run(&format!("method = \"{method}\"\n{layers}"), &airplanes);
        run.advance(400);
        let (lost, named) = lost_and_named(&run);
        assert!(lost.is_empty() && named.is_empty(), "{method}: {lost:?} {named:?}");
        assert_eq!(run.metrics().arrived, 4, "{method}");
    }
}

/// All deployments choose the same bits, also where the winds on the levels of two airplanes differ.
#[test]
fn every_deployment_flies_alike_in_layers_of_wind() {
    let layers = "winds = [{ altitude_m = 0, wind_m_s = [0, 5] }, { altitude_m = 200, wind_m_s = [15, -9] }]";
    let digest = |deployment: &str, method: &str| {
        let climbs =
            "altitude_m = 200\norders = [{ at_s = 30.0, altitude_m = 0.0, climb_m_s = 3.0 }]";
        let airplanes = plane([-4000.0, 40.0], 0.0, [6000.0, 40.0], climbs)
            + &plane([4000.0, 0.0], 180.0, [-6000.0, 0.0], "")
            + &plane([0.0, 4000.0], -90.0, [0.0, -6000.0], "altitude_m = 120");
        let airspace = format!(
            "method = \"{method}\"\nmax_rounds = 40\ndeployment = \"{deployment}\"\n{layers}"
        );
        let mut run = run(&airspace, &airplanes);
        run.advance(60);
        run.digest()
    };
    for method in ["pc", "mvp"] {
        for deployment in ["team", "compact-team", "replica-team", "pim", "hierarchical-pim"] {
            assert_eq!(digest(deployment, method), digest("direct", method), "{deployment}");
        }
    }
}
