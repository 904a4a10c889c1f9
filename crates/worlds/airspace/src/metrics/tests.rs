//! Tests of metrics.

use crate::airspace_run;
use crate::state::FlightEnd;
use sidestep_kernel::Simulation;
use sidestep_scenario::Source;

/// Alone, the first is ordered to keep a heading before it reaches its way-point. In traffic an
/// order may have to wait, and so it may arrive after all.
#[test]
fn a_flight_that_alone_would_never_end_has_no_delay() {
    let text = "format = 1\nworld = \"airspace\"\n\
                [[airplanes]]\nat_m = [0, 0]\nheading_deg = 0\nway_points_m = [[700, 0]]\n\
                orders = [{ at_s = 5.0, heading_deg = 0.0 }]\n\
                [[airplanes]]\nat_m = [0, 9000]\nheading_deg = 0\nway_points_m = [[700, 9000]]\n";
    let source = Source::new("n", text, "");
    let mut run = airspace_run(&source, 1).expect("a scenario");
    run.advance(30);
    let world = run.world();
    assert_eq!(world.alone_s[0], f64::INFINITY);
    run.state().airplanes[0].set_end(FlightEnd::Arrived(20));
    let first = super::airplane_metrics(world, run.state(), 0);
    assert_eq!((first.flown_s, first.delay_s(), first.delay_percent), (Some(20.0), None, None));
    let metrics = run.metrics();
    assert!(metrics.mean_delay_percent.is_some_and(f64::is_finite), "{metrics:?}");
}

/// The first arrives, the second is on its way, the third has not appeared.
#[test]
fn the_mean_delay_says_how_many_flights_it_leaves_out_because_they_have_not_ended() {
    let text = "format = 1\nworld = \"airspace\"\n\
                [[airplanes]]\nat_m = [0, 0]\nheading_deg = 0\nway_points_m = [[700, 0]]\n\
                [[airplanes]]\nat_m = [0, 9000]\nheading_deg = 0\nway_points_m = [[90000, 9000]]\n\
                [[airplanes]]\nat_m = [0, 19000]\nheading_deg = 0\nappears_s = 3000\n\
                way_points_m = [[700, 19000]]\n";
    let mut run = airspace_run(&Source::new("n", text, ""), 1).expect("a scenario");
    run.advance(30);
    let metrics = run.metrics();
    assert_eq!((metrics.arrived, metrics.in_flight, metrics.not_appeared), (1, 1, 1));
    assert!(metrics.mean_delay_percent.is_some());
}

#[test]
fn losses_of_pairs_that_the_shield_reported_are_apart_from_all_others() {
    let losses = |shield: &str| {
        let text = format!(
            "format = 1\nworld = \"airspace\"\n[airspace]\nmethod = \"none\"\nshield = {shield:?}\n\
             [airspace.generator]\nkind = \"superconflict\"\nn = 6\nradius_m = 600\n"
        );
        let mut run = airspace_run(&Source::new("n", text, ""), 1).expect("a scenario");
        run.advance(40);
        let metrics = run.metrics();
        let parts = [metrics.losses_of_reported_pairs, metrics.losses_of_unreported_pairs];
        assert_eq!(parts[0] + parts[1], metrics.losses_of_separation);
        assert!(metrics.losses_of_separation > 0);
        parts
    };
    assert_eq!(losses("on")[1], 0);
    assert_eq!(losses("off")[0], 0);
}

/// A climbs through the level of B, and C meets D on another level.
#[test]
fn losses_and_delays_of_recorded_flights_are_told_apart_by_phase() {
    let metrics = |until_s: &str| {
        let text = format!(
            "format = 1\nworld = \"airspace\"\n[airspace]\nshield = \"off\"\nmethod = \"none\"\n\
             vertical_m = 300\nreplay_until_s = {until_s}\n[airplane]\nseparation_m = 1000\n\
             [[airplanes]]\ntrack = [[0, 0, 0, 0], [200, 20000, 0, 2000]]\n\
             [[airplanes]]\ntrack = [[0, 10000, -10000, 1000], [200, 10000, 10000, 1000]]\n\
             [[airplanes]]\ntrack = [[0, 50000, 0, 5000], [200, 70000, 0, 5000]]\n\
             [[airplanes]]\ntrack = [[0, 70000, 0, 5000], [200, 50000, 0, 5000]]\n"
        );
        let mut run = airspace_run(&Source::new("p", text, ""), 1).expect("a scenario");
        run.advance(100);
        run.metrics()
    };
    let in_phases = |m: &super::Metrics| {
        ([m.losses_in_climb, m.losses_in_descent, m.losses_in_cruise], m.losses_of_separation)
    };
    let replayed = metrics("inf");
    assert_eq!(in_phases(&replayed), ([Some(1), Some(0), Some(1)], 2));
    let flown = metrics("0");
    // The first is flown on the level at which it was taken over, below the second.
    assert_eq!(in_phases(&flown), ([Some(0), Some(0), Some(1)], 1));
    let delays =
        [flown.climb_delay_percent, flown.descent_delay_percent, flown.cruise_delay_percent];
    assert_eq!(delays.map(|delay| delay.is_some()), [true, false, true]);
    assert_eq!(replayed.climb_delay_percent, None, "nothing delays a record");
    let planned =
        "format = 1\nworld = \"airspace\"\n[airspace.generator]\nkind = \"superconflict\"\nn = 2\n";
    let run = airspace_run(&Source::new("n", planned, ""), 1).expect("a scenario");
    assert_eq!(in_phases(&run.metrics()).0, [None; 3], "no record says so");
}

#[test]
fn a_pair_that_is_named_again_is_one_pair_without_a_promise_since_the_first_time() {
    let mut text = "format = 1\nworld = \"airspace\"\nseed = 4\n[airspace]\nmethod = \"none\"\n\
                    [airspace.generator]\nkind = \"random\"\nn = 12\nradius_m = 8000.0\n"
        .to_string();
    for (start, way) in [
        (
            "at_m = [-9000, 0]\nheading_deg = 0",
            "[[0, 900], [3000, -3000], [-3000, -3000], [0, 3000], [5000, 0], [-5000, 0]]",
        ),
        (
            "at_m = [9000, 2000]\nheading_deg = 180",
            "[[0, -900], [-3000, 3000], [3000, 3000], [0, -3000], [-5000, 0], [5000, 0]]",
        ),
    ] {
        text +=
            &format!("[[airplanes]]\n{start}\nway_points_m = {way}\nv_m_s = 60\nintruder = true\n");
    }
    let mut run = airspace_run(&Source::new("n", text, ""), 1).expect("a scenario");
    run.advance(run.config().cycles);
    let events = run.collector().counters.event_count(super::EventKind::Intruder);
    let too_close = run.metrics().too_close;
    let mut pairs: Vec<_> = too_close.iter().map(|one| one.airplanes).collect();
    pairs.sort_unstable();
    pairs.dedup();
    assert_eq!(pairs.len(), too_close.len(), "{too_close:?}");
    assert!(events > too_close.len() as u64, "one is exempt twice: {events}, {too_close:?}");
    assert!(too_close.is_sorted_by_key(|one| one.at_s), "{too_close:?}");
}
