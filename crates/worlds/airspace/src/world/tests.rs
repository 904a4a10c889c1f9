use crate::scenario::Compiled;
use proptest::prelude::*;
use sidestep_kernel::math;
use sidestep_scenario::Source;

proptest! {
    /// Straight stretches that are not flown step by step end where the steps would have.
    #[test]
    fn a_flight_alone_takes_as_long_as_flying_it_step_by_step(
        speed in 0.0f64..20.0, from_rad in -3.2f64..3.2, heading_deg in -180.0f64..180.0,
        goals in prop::collection::vec(prop::array::uniform2(-40_000.0f64..40_000.0), 1..4),
    ) {
        let wind = [speed * math::cos(from_rad), speed * math::sin(from_rad)];
        let text = format!(
            "format = 1\nworld = \"airspace\"\n[airspace]\nwind_m_s = {wind:?}\n[[airplanes]]\n\
             at_m = [0, 0]\nheading_deg = {heading_deg:?}\nway_points_m = {goals:?}\n"
        );
        let world = Compiled::new(&Source::new("w", text, "")).expect("a scenario").world;
        let air = world.air();
        let pilot = air.pilot(&world.airplanes[0].model, &world.airplanes[0].mission);
        let (mut pose, mut next, mut steps) = (world.airplanes[0].start, 0, 0);
        while next < goals.len() {
            let omega = air.steer(&pilot, pose, next);
            pose = air.blown(pose.step(pilot.model.v_m_s, omega, 1.0));
            next = pilot.next(pose, next);
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
        let world = Compiled::new(&Source::new("w", text, "")).expect("a scenario").world;
        prop_assert!(world.alone_s[0] < 3000.0, "{wind:?}: {}", world.alone_s[0]);
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
        Compiled::new(&Source::new("o", text, "")).expect("a scenario").world.alone_s[0]
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
        let world = Compiled::new(&Source::new("w", text, "")).expect("a scenario").world;
        let along = 35f64 * 35.0 - wind[0] * wind[0];
        let expected_s = 8900.0 / (along.sqrt() + wind[1]);
        assert!((world.alone_s[0] - expected_s).abs() < 12.0, "{wind:?}: {}", world.alone_s[0]);
    }
}
