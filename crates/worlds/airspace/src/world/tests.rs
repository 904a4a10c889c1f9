use crate::scenario::CompiledAirspace;
use proptest::prelude::*;
use sidestep_kernel::math;
use sidestep_scenario::Source;

proptest! {
    /// Straight stretches that are not flown step by step end where the steps would have.
    #[test]
    fn a_flight_alone_takes_as_long_as_flying_it_step_by_step(
        speed in 0.0f64..20.0, from_rad in -3.2f64..3.2, heading_deg in -180.0f64..180.0,
        goals in prop::collection::vec(prop::array::uniform2(-40_000.0f64..40_000.0), 1..4), abeam in any::<bool>(),
    ) {
        let wind = [speed * math::cos(from_rad), speed * math::sin(from_rad)];
        let text = format!(
            "format = 1\nworld = \"airspace\"\n[airspace]\nwind_m_s = {wind:?}\npasses_abeam = {abeam}\n[[airplanes]]\n\
             at_m = [0, 0]\nheading_deg = {heading_deg:?}\nway_points_m = {goals:?}\n"
        );
        let world = CompiledAirspace::new(&Source::new("w", text, "")).expect("a scenario").world;
        let air = world.flight_environment();
        let pilot = air.autopilot(&world.airplanes[0].model, &world.airplanes[0].mission);
        let (mut pose, mut next, mut steps) = (world.airplanes[0].start, 0, 0);
        while next < goals.len() {
            let omega = air.steer(&pilot, pose, next);
            let before = pose;
            pose = air.after_wind_step(before.step(pilot.model.v_m_s, omega, 1.0));
            next = pilot.next_way_point((before, pose), next);
            steps += 1;
        }
        prop_assert_eq!(world.alone_s[0], f64::from(steps));
    }

    /// Flying to a way-point ends, wherever it lies and however the wind blows.
    #[test]
    fn nobody_circles_in_the_wind_for_ever(
        speed in 0.0f64..30.0, from_rad in -3.2f64..3.2, x in -2000.0f64..2000.0,
        y in -2000.0f64..2000.0,
    ) {
        let wind = [speed * math::cos(from_rad), speed * math::sin(from_rad)];
        let text = format!(
            "format = 1\nworld = \"airspace\"\n[airspace]\nwind_m_s = {wind:?}\n\
             tolerance_m = 20.0\n\
             [[airplanes]]\nat_m = [0, 0]\nheading_deg = 90\nway_points_m = [[{x}, {y}]]\n"
        );
        let world = CompiledAirspace::new(&Source::new("w", text, "")).expect("a scenario").world;
        prop_assert!(world.alone_s[0] < 3000.0, "{wind:?}: {}", world.alone_s[0]);
    }
}

/// Returns the seconds of the flight alone of the first airplane of a scenario.
fn alone_s(airspace: &str, airplanes: &str) -> f64 {
    let text = format!("format = 1\nworld = \"airspace\"\n[airspace]\n{airspace}\n{airplanes}");
    CompiledAirspace::new(&Source::new("a", text, ""))
        .unwrap_or_else(|e| panic!("{e}"))
        .world
        .alone_s[0]
}

#[test]
fn a_long_flight_in_small_steps_is_not_endless() {
    let far = "[[airplanes]]\nat_m = [0, 0]\nheading_deg = 0\nway_points_m = [[200000, 0]]\n";
    for (dtau_s, more) in [(0.005, ""), (0.005, "leaves_s"), (1.0, "")] {
        let orders =
            if more.is_empty() { "" } else { "orders = [{ at_s = 9000.0, leaves = true }]\n" };
        let found_s =
            alone_s(&format!("dtau_s = {dtau_s:?}\nhorizon_s = 50.0"), &format!("{far}{orders}"));
        assert!((found_s - 199_900.0 / 35.0).abs() <= 1.0, "{dtau_s} {more}: {found_s}");
    }
}

#[test]
fn the_slowest_flights_are_followed_to_their_end() {
    let slow = |to_m: f64| {
        let airplane = format!(
            "[[airplanes]]\nat_m = [0, 0]\nheading_deg = 0\nway_points_m = [[{to_m:?}, 0]]\nv_m_s = 0.001\n"
        );
        alone_s("", &airplane)
    };
    // To within 100 m.
    assert!((slow(1000.0) - 900_000.0).abs() < 1000.0, "{}", slow(1000.0));
    assert_eq!(slow(1e9), f64::INFINITY);
    // A headwind that leaves hardly any speed over the ground.
    let held = "[[airplanes]]\nat_m = [-1e9, 0]\nheading_deg = 0\nway_points_m = [[1e9, 0]]\n";
    assert_eq!(alone_s("wind_m_s = [-34.9999999999999, 0.0]", held), f64::INFINITY);
}

#[test]
fn speeds_that_rounding_would_swallow_are_refused_with_the_least_one() {
    let slow = |more: &str| {
        format!(
            "format = 1\nworld = \"airspace\"\n{more}[[airplanes]]\nat_m = [0, 0]\nheading_deg = 0\n\
             way_points_m = [[9, 0]]\n"
        )
    };
    for text in [
        slow("[airplane]\nv_m_s = 1e-14\n"),
        slow("") + "v_m_s = 1e-300\n",
        slow("") + "orders = [{ at_s = 5, speed_m_s = 1e-5 }]\n",
    ] {
        let error =
            CompiledAirspace::new(&Source::new("s", text, "")).expect_err("refused").to_string();
        assert!(error.contains("give 0.001 to 1e6 m/s"), "{error}");
    }
}

/// It is led 6 km aside, and has the first way-point abeam there.
#[test]
fn an_airplane_that_was_kept_off_its_way_does_not_turn_back_where_way_points_are_passed_abeam() {
    let flight = "[[airplanes]]\nat_m = [0, 0]\nheading_deg = 0\nway_points_m = [[9000, 0], [30000, 0]]\n\
                  orders = [{ at_s = 5, heading_deg = 60 }, { at_s = 250, heading_deg = 0 }, { at_s = 400, proceeds = true }]\n";
    let [back_s, on_s] =
        [false, true].map(|abeam| alone_s(&format!("passes_abeam = {abeam}"), flight));
    // At 60 degrees half of the way is not ahead, and it comes back as steeply at most.
    let detour_s = 245.0;
    assert!(on_s < 30_000.0 / 35.0 + detour_s, "{on_s}");
    assert!(back_s > on_s + 200.0, "{back_s} {on_s}");
}

#[test]
fn an_airplane_that_turns_round_in_a_step_arrives() {
    for (v_m_s, omega_deg_s) in [(10.0, 180.0), (10.0, 360.0), (30.0, 90.0), (25.0, 120.0)] {
        let model = format!(
            "[airplane]\nv_m_s = {v_m_s:?}\nomega_max_deg_s = {omega_deg_s:?}\nseparation_m = 10.0\n"
        );
        let flight = "[[airplanes]]\nat_m = [0, 0]\nheading_deg = 0\nway_points_m = [[205, 0], [205, 33], [1, 7]]\n";
        let found_s = alone_s("method = \"none\"", &format!("{model}{flight}"));
        assert!(found_s < 800.0 / v_m_s, "{v_m_s} m/s, {omega_deg_s} deg/s: {found_s} s");
    }
}

#[test]
fn an_order_after_the_arrival_makes_no_flight_endless() {
    let alone_s = |at_s: f64| {
        let text = format!(
            "format = 1\nworld = \"airspace\"\n[[airplanes]]\nat_m = [0, 0]\n\
             heading_deg = 0\nway_points_m = [[3500, 0]]\n\
             orders = [{{ at_s = {at_s:?}, heading_deg = 90.0 }}]\n"
        );
        CompiledAirspace::new(&Source::new("o", text, "")).expect("a scenario").world.alone_s[0]
    };
    assert!((90.0..=100.0).contains(&alone_s(500.0)), "{}", alone_s(500.0));
    assert_eq!(alone_s(50.0), f64::INFINITY);
}

#[test]
fn against_any_wind_an_airplane_tracks_its_way() {
    for wind in [[10.0, 0.0], [0.0, 10.0], [-7.0, 7.0]] {
        let text = format!(
            "format = 1\nworld = \"airspace\"\n[airspace]\nwind_m_s = {wind:?}\n\
             [[airplanes]]\nat_m = [0, 0]\nheading_deg = 90\nway_points_m = [[0, 9000]]\n"
        );
        let world = CompiledAirspace::new(&Source::new("w", text, "")).expect("a scenario").world;
        let along = 35f64 * 35.0 - wind[0] * wind[0];
        let expected_s = 8900.0 / (along.sqrt() + wind[1]);
        assert!((world.alone_s[0] - expected_s).abs() < 12.0, "{wind:?}: {}", world.alone_s[0]);
    }
}
