//! The promise of the shield about areas, tried on whole runs: only airplanes that were named come to where an area does
//! not permit them to be, and no other pair for it.

use super::guarantee_tests::{crowd, erring, lost_and_named, plane, run};
use crate::AirspaceRun;
use proptest::prelude::*;
use sidestep_kernel::Simulation;
use std::collections::BTreeSet;

/// Number of cases of the long tests.
const MANY: u32 = 2_000;

/// Airplanes that came to where an area does not permit them to be without having been named, each with the area.
pub(crate) fn unnamed_entries(run: &AirspaceRun) -> BTreeSet<(u32, u32)> {
    let counters = &run.collector().counters;
    let is_unnamed = |key: &(u32, u32)| {
        !counters.exempt_areas.contains_key(key) && !counters.beyond_bound.contains_key(&key.0)
    };
    counters.areas.keys().copied().filter(is_unnamed).collect()
}

fn out(outline: &str, more: &str) -> String {
    format!("[[airspace.areas]]\n{outline}\n{more}\n")
}

/// The text of an area at random, which may begin late and end early.
fn some_area(velocity_m_s: BoxedStrategy<[f64; 2]>) -> impl Strategy<Value = String> {
    let place = || [-4000.0f64..4000.0, -4000.0f64..4000.0];
    let outline = prop_oneof![
        (place(), 200.0f64..2500.0).prop_map(|(at, radius_m)| format!(
            "circle = {{ at_m = {at:?}, radius_m = {radius_m:?} }}"
        )),
        (place(), prop::collection::vec(200.0f64..2500.0, 3..8)).prop_map(|(at, radii_m)| {
            let corners: Vec<[f64; 2]> = (0..radii_m.len())
                .map(|k| {
                    let rad = std::f64::consts::TAU * k as f64 / radii_m.len() as f64;
                    let (sin, cos) = sidestep_kernel::math::sin_cos(rad);
                    [at[0] + radii_m[k] * cos, at[1] + radii_m[k] * sin]
                })
                .collect();
            format!("polygon_m = {corners:?}")
        }),
    ];
    let levels = prop_oneof![
        Just(String::new()),
        (0u8..3).prop_map(|k| format!(
            "levels_m = [{:?}, {:?}]\n",
            400.0 * f64::from(k) - 100.0,
            400.0 * f64::from(k) + 100.0
        )),
    ];
    let times = prop_oneof![
        Just(String::new()),
        (0.0f64..200.0, 20.0f64..300.0).prop_map(|(from_s, lasts_s)| format!(
            "from_s = {from_s:?}\nuntil_s = {:?}\n",
            from_s + lasts_s
        )),
    ];
    (outline, levels, times, velocity_m_s, 0u8..6).prop_map(
        |(outline, levels, times, velocity, kind)| {
            // A fence around little would hold nobody.
            let kind =
                if kind == 0 && outline.starts_with("circle") { "kind = \"in\"\n" } else { "" };
            out(&outline, &format!("{levels}{times}velocity_m_s = {velocity:?}\n{kind}"))
        },
    )
}

pub(crate) fn some_areas(velocity_m_s: BoxedStrategy<[f64; 2]>) -> impl Strategy<Value = String> {
    prop::collection::vec(some_area(velocity_m_s), 1..4).prop_map(|all| all.concat())
}

fn at_rest() -> BoxedStrategy<[f64; 2]> {
    Just([0.0; 2]).boxed()
}

pub(crate) fn moving() -> BoxedStrategy<[f64; 2]> {
    [-25.0f64..25.0, -25.0f64..25.0].boxed()
}

/// Flies some airplanes among areas for ten minutes.
fn only_named_ones_enter(
    airspace: &str,
    areas: &str,
    airplanes: &str,
) -> Result<AirspaceRun, TestCaseError> {
    let mut run = run(airspace, &format!("{areas}{airplanes}"));
    run.advance(120);
    let entries = unnamed_entries(&run);
    let named = &run.collector().counters.exempt_areas;
    prop_assert!(
        entries.is_empty(),
        "{entries:?} but only {named:?} were named\n{areas}{airplanes}"
    );
    let (lost, named) = lost_and_named(&run);
    prop_assert!(
        lost.is_subset(&named),
        "{lost:?} but only {named:?} were named\n{areas}{airplanes}"
    );
    Ok(run)
}

const METHODS: [&str; 5] = ["none", "mvp", "orca", "bands", "pc"];

fn some_method() -> impl Strategy<Value = &'static str> {
    prop::sample::select(METHODS.to_vec())
}

/// An airplane flies straight at a wall, behind which it has its way-point.
#[test]
fn an_airplane_never_enters_an_area_by_whatever_method_it_flies() {
    let wall = out(
        "polygon_m = [[3000, -2000], [4000, -2000], [4000, 2000], [3000, 2000]]",
        "name = \"wall\"",
    );
    let airplane = plane([0.0, 0.0], 0.0, [8000.0, 0.0], "");
    for method in METHODS {
        let mut run = run(&format!("method = \"{method}\""), &format!("{wall}{airplane}"));
        run.advance(400);
        let metrics = run.metrics();
        assert_eq!(metrics.area_entries, Some(0), "{method}");
        assert!(metrics.exempt_areas.is_empty(), "{method}: {:?}", metrics.exempt_areas);
    }
}

#[test]
fn an_airplane_that_starts_in_an_area_is_named_and_once_out_stays_out() {
    let cell = out("circle = { at_m = [0, 0], radius_m = 1000 }", "name = \"cell\"");
    let airplane = plane([0.0, 0.0], 0.0, [6000.0, 0.0], "");
    let back = "orders = [{ at_s = 120.0, way_points_m = [[-6000.0, 0.0]] }]";
    let returning = plane([0.0, 0.0], 0.0, [9000.0, 0.0], back);
    for airplane in [airplane, returning] {
        let mut run = run("method = \"none\"", &format!("{cell}{airplane}"));
        run.advance(200);
        let metrics = run.metrics();
        let names: Vec<&str> = metrics.exempt_areas.iter().map(|one| &one.area[..]).collect();
        assert_eq!((names, metrics.exempt_areas[0].at_s), (vec!["cell"], 0.0));
        assert_eq!((metrics.area_entries, metrics.area_entries_unreported), (Some(1), Some(0)));
        // It takes the straight way out.
        assert!(
            (metrics.area_s.unwrap_or(0.0) - 1000.0 / 35.0).abs() < 0.1,
            "{:?}",
            metrics.area_s
        );
    }
}

#[test]
fn levels_and_times_of_an_area_are_those_in_which_it_counts() {
    // It minds no area, and flies straight on.
    let airplane = |altitude_m: f64| {
        let more = format!("altitude_m = {altitude_m:?}\nnon_cooperative = true");
        plane([0.0, 0.0], 0.0, [8000.0, 0.0], &more)
    };
    let entered = |more: &str, altitude_m: f64| {
        let wall =
            out("polygon_m = [[3000, -9000], [5000, -9000], [5000, 9000], [3000, 9000]]", more);
        let mut run = run("method = \"none\"", &format!("{wall}{}", airplane(altitude_m)));
        run.advance(100);
        run.metrics().area_s.unwrap_or(f64::NAN)
    };
    assert!((entered("", 0.0) - 2000.0 / 35.0).abs() < 0.1);
    let levels = "levels_m = [100, 500]";
    assert_eq!([0.0, 100.0, 500.0].map(|altitude_m| entered(levels, altitude_m)), [0.0; 3]);
    assert!(entered(levels, 300.0) > 50.0);
    // It enters after 85.7 s and leaves after 142.9 s.
    assert!((entered("until_s = 100.0", 0.0) - 14.3).abs() < 0.1);
    assert!((entered("from_s = 100.0", 0.0) - 42.9).abs() < 0.1);
    assert_eq!(entered("from_s = 143.0", 0.0), 0.0);
    // It flies along with the area, and never comes to its edge.
    assert_eq!(entered("velocity_m_s = [35.0, 0.0]", 0.0), 0.0);
}

#[test]
fn an_airplane_stays_inside_of_a_fence() {
    let fence = out("circle = { at_m = [0, 0], radius_m = 4000 }", "kind = \"in\"");
    // The way-point is outside.
    let airplane = plane([0.0, 0.0], 0.0, [9000.0, 0.0], "");
    for method in METHODS {
        let mut run = run(&format!("method = \"{method}\""), &format!("{fence}{airplane}"));
        run.advance(200);
        let metrics = run.metrics();
        assert_eq!((metrics.area_entries, metrics.exempt_areas.len()), (Some(0), 0), "{method}");
    }
}

#[test]
fn a_climb_ends_below_an_area_until_there_is_a_fallback_clear_of_it() {
    let above = out("circle = { at_m = [4000, 0], radius_m = 2500 }", "levels_m = [500, 2000]");
    let climbs = "orders = [{ at_s = 20.0, altitude_m = 1000.0, climb_m_s = 20.0 }]";
    let airplane = plane([0.0, 0.0], 0.0, [14_000.0, 0.0], climbs);
    let mut run = run("method = \"none\"", &format!("{above}{airplane}"));
    run.advance(400);
    let metrics = run.metrics();
    assert_eq!((metrics.area_entries, metrics.exempt_areas.len()), (Some(0), 0));
    assert_eq!(metrics.arrived, 1);
}

#[test]
fn all_deployments_keep_clear_of_areas_alike() {
    let areas = out("polygon_m = [[-500, -1000], [900, -800], [700, 1200], [-600, 900]]", "")
        + &out("circle = { at_m = [3000, 3000], radius_m = 800 }", "velocity_m_s = [-6.0, -3.0]");
    let airplanes: String = [[-6000.0, 0.0], [0.0, -6000.0], [5000.0, 5000.0], [-4000.0, 4500.0]]
        .map(|[x, y]| plane([x, y], 90.0, [-x, -y], ""))
        .concat();
    let digest = |deployment: &str, more: &str| {
        let airspace = format!("deployment = \"{deployment}\"\n{more}");
        let mut run = run(&airspace, &format!("{areas}{airplanes}"));
        run.advance(60);
        assert_eq!(unnamed_entries(&run), BTreeSet::new(), "{deployment} {more}");
        run.digest()
    };
    let all = ["team", "compact-team", "replica-team", "pim", "hierarchical-pim"];
    for deployment in all {
        for more in ["", "preset = \"paper\"\nmax_rounds = 20\n"] {
            if deployment == "replica-team" && !more.is_empty() {
                continue;
            }
            assert_eq!(digest(deployment, more), digest("direct", more), "{deployment} {more}");
        }
    }
    for method in ["mvp", "orca", "bands", "none"] {
        let more = format!("method = \"{method}\"");
        assert_eq!(digest("team", &more), digest("direct", &more), "{method}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn no_airplane_that_is_not_named_enters_an_area_at_rest(
        airplanes in crowd(), areas in some_areas(at_rest()), method in some_method(),
    ) {
        let run = only_named_ones_enter(&format!("method = \"{method}\""), &areas, &airplanes)?;
        // They are named when they come in, and never later.
        for (&(airplane, _), &cycle) in &run.collector().counters.exempt_areas {
            prop_assert_eq!(cycle, run.world().first_controlled_cycle(airplane as usize));
        }
    }

    #[test]
    fn no_airplane_that_is_not_named_enters_an_area_that_moves_or_in_a_wind(
        airplanes in crowd(), areas in some_areas(moving()), method in some_method(),
        wind in prop_oneof![Just(""), Just("wind_m_s = [9.0, -4.0]\n")],
    ) {
        only_named_ones_enter(&format!("method = \"{method}\"\n{wind}"), &areas, &airplanes)?;
    }

    #[test]
    fn within_the_bounds_on_errors_no_airplane_that_is_not_named_enters_an_area(
        airplanes in crowd(), areas in some_areas(at_rest()), sigma_m in 0.0f64..20.0, sigma_deg in 0.0f64..1.0,
    ) {
        only_named_ones_enter(&erring(sigma_m, sigma_deg, ""), &areas, &airplanes)?;
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(MANY))]

    #[test]
    #[ignore = "two thousand runs: minutes"]
    fn no_airplane_that_is_not_named_enters_an_area_in_thousands_of_runs(
        airplanes in crowd(), areas in some_areas(prop_oneof![at_rest(), moving()].boxed()), method in some_method(),
        sigma_m in prop_oneof![Just(0.0), 0.0f64..20.0], sigma_deg in prop_oneof![Just(0.0), 0.0f64..1.0],
    ) {
        let errors = format!("position_noise_m = {sigma_m:?}\nheading_noise_deg = {sigma_deg:?}");
        only_named_ones_enter(&format!("method = \"{method}\"\n{errors}"), &areas, &airplanes)?;
    }
}
