//! Closest approaches and losses of separation are those of the motion, however short they are, and
//! from the first instant to the last.

use sidestep_airspace::metrics::Metrics;
use sidestep_airspace::{AirspaceRun, airspace_run};
use sidestep_kernel::Simulation;
use sidestep_kernel::ports::{ColumnValues, MemoryRecorder};
use sidestep_scenario::Source;

/// A run of airplanes that do not mind each other: place, heading in degrees, way-point.
fn run(separation_m: f64, airplanes: &[([f64; 2], f64, [f64; 2])]) -> AirspaceRun {
    let mut text = format!(
        "format = 1\nworld = \"airspace\"\n[airspace]\nmethod = \"none\"\nshield = \"off\"\n\
         [airplane]\nseparation_m = {separation_m:?}\n"
    );
    for (at_m, heading_deg, goal_m) in airplanes {
        text += &format!(
            "[[airplanes]]\nat_m = {at_m:?}\nheading_deg = {heading_deg:?}\nway_points_m = [{goal_m:?}]\n"
        );
    }
    airspace_run(&Source::new("a", text, ""), 1).expect("a scenario")
}

fn flown(separation_m: f64, airplanes: &[([f64; 2], f64, [f64; 2])]) -> Metrics {
    let mut run = run(separation_m, airplanes);
    run.advance(100);
    run.metrics()
}

#[test]
fn a_head_on_pass_is_told_as_what_it_is() {
    let head_on = [([0.0, 0.0], 0.0, [9e3, 0.0]), ([7007.3, 0.0], 180.0, [-2e3, 0.0])];
    let metrics = flown(500.0, &head_on);
    assert!(metrics.min_separation_m.is_some_and(|d| d < 1e-6), "{metrics:?}");
    assert_eq!(metrics.losses_of_separation, 1);
    assert!((metrics.lost_s - 1000.0 / 70.0).abs() < 1e-6, "{}", metrics.lost_s);
}

/// At 70 m/s two airplanes are within 5 m of each other for a seventh of a second.
#[test]
fn no_loss_is_too_short_to_be_seen() {
    for k in 0..40 {
        let (aside_m, ahead_m) = (0.12 * f64::from(k), 7000.0 + 3.7 * f64::from(k));
        let pass = [([0.0, 0.0], 0.0, [9e3, 0.0]), ([ahead_m, aside_m], 180.0, [-2e3, aside_m])];
        let metrics = flown(5.0, &pass);
        assert_eq!(metrics.losses_of_separation, 1, "{k}: {metrics:?}");
        let nearest_m = metrics.min_separation_m.expect("near");
        assert!((nearest_m - aside_m).abs() < 1e-6, "{nearest_m} for {aside_m}");
        let half_m = (25.0 - aside_m * aside_m).sqrt();
        assert!((metrics.lost_s - half_m / 35.0).abs() < 1e-5, "{k}: {}", metrics.lost_s);
    }
}

#[test]
fn the_first_instant_counts() {
    let apart = [([0.0, 0.0], 180.0, [-5e3, 0.0]), ([100.0, 0.0], 0.0, [5e3, 0.0])];
    let metrics = flown(500.0, &apart);
    assert_eq!(metrics.min_separation_m, Some(100.0));
    assert_eq!(metrics.losses_of_separation, 1);
    assert!((metrics.lost_s - 400.0 / 70.0).abs() < 1e-6, "{}", metrics.lost_s);
}

#[test]
fn the_last_row_of_an_airplane_is_the_place_where_it_has_arrived() {
    let mut run = run(500.0, &[([0.0, 0.0], 0.0, [1000.0, 0.0])]);
    run.start_recording();
    run.advance(20);
    let mut recorder = MemoryRecorder::new(&run.schemas());
    run.record(&mut recorder).expect("memory has room");
    let numbers = |name: &str| match recorder.column("trajectories", name) {
        Some(ColumnValues::F64(values)) => values.clone(),
        other => panic!("{name}: {other:?}"),
    };
    let (x_m, from_s, until_s) = (numbers("x_m"), numbers("from_s"), numbers("until_s"));
    let last = x_m.len() - 1;
    // The first whole second in which it is nearer than 100 m to its way-point.
    assert_eq!((x_m[last], from_s[last], until_s[last]), (910.0, 26.0, 26.0));
    assert_eq!(until_s[last - 1], 26.0);
    assert!(numbers("altitude_m").iter().all(|m| *m == 0.0));
}
