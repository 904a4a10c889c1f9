//! Robots on wheels roll: they slide nowhere, turn no faster than their wheels, and go through no other robot.

use super::*;
use sidestep_kernel::math::{cos, sin, wrap_angle};

/// A corridor of 3 m that a disc crosses to and fro while a swarm goes along it.
const CROSSED: &str = "
[ground]
corridor = { width_m = 3.0, legs = [{ straight_m = 30 }] }
[[obstacles]]
at_m = [20.0, -0.5]
radius_m = 0.3
patrol_m = [[20.0, -0.5], [20.0, 0.5]]
speed_m_s = 0.4
[[chains]]
connectors = 16
at_m = [12.3, 0.0]
rod_m = [0.6, 0.8]
rod_radius_m = 0.05
robots = { radius_m = 0.25, margin_m = 0.08 }
[[chains.tasks]]
kind = \"navigate\"
speed_m_s = 0.5
patience_s = 30.0
navigator = { noise_m = 0.01 }
";

/// Robots with a leader that goes where a script says, with sharp turns.
const SCRIPTED: &str = "
[[chains]]
connectors = 5
at_m = [0.0, 0.0]
rod_m = [0.6, 0.8]
rod_radius_m = 0.05
robots = { radius_m = 0.25 }
[[chains.tasks]]
kind = \"script\"
script = \"forward 1 turn 120 forward 1.5 turn -150 forward 1 turn 90 forward 1\"
";

/// A dead end, in which a leader has to be pulled back.
const DEAD_END: &str = "
[ground]
corridor = { width_m = 1.6, legs = [{ straight_m = 12 }] }
[[obstacles]]
ends_m = [[9.0, -0.8], [9.0, 0.8]]
radius_m = 0.05
[[chains]]
connectors = 6
at_m = [6.0, 0.0]
rod_m = [0.6, 0.8]
rod_radius_m = 0.05
robots = { radius_m = 0.25 }
[[chains.tasks]]
kind = \"navigate\"
speed_m_s = 0.5
patience_s = 1000.0
";

/// The most that robots did in a run and wheels cannot: a slip across the way in meters, a turn in rad in a
/// cycle, an overlap of two bodies in meters.
fn excesses(text: &str, seed: u64, cycles: u64) -> [f64; 3] {
    let mut run = run::<2>(&source(seed, text), 1);
    let mut most = [0.0, 0.0, f64::NEG_INFINITY];
    let mut was = run.state().body(0).robots.clone();
    while run.cycle() < cycles && run.advance(1) > 0 {
        let is = run.state().body(0).robots.clone();
        for (k, (a, b)) in was.iter().zip(&is).enumerate() {
            let (a, b) = (a.pose, b.pose);
            let turn = wrap_angle(b.heading_rad - a.heading_rad);
            let along = a.heading_rad + 0.5 * turn;
            let [x, y] = [b.at[0] - a.at[0], b.at[1] - a.at[1]];
            most[0] = f64::max(most[0], (y * cos(along) - x * sin(along)).abs());
            most[1] = f64::max(most[1], turn.abs());
            for other in &is[..k] {
                let apart_m = hypot(b.at[0] - other.pose.at[0], b.at[1] - other.pose.at[1]);
                most[2] = f64::max(most[2], 0.5 - apart_m);
            }
        }
        was = is;
    }
    most
}

#[test]
fn no_robot_slides_jumps_round_or_goes_through_another() {
    // From wall to wall the disc carries robots along that are on its way.
    let swept = CROSSED.replace("-0.5]", "-1.0]").replace("0.5]]", "1.0]]");
    for (text, cycles) in [(CROSSED, 4000), (&swept, 3000), (SCRIPTED, 1500), (DEAD_END, 4000)] {
        let [slip_m, turn_rad, overlap_m] = excesses(text, 1, cycles);
        assert!(slip_m < 1e-9, "{slip_m} m to the side, in {text}");
        // Two wheels at 0.6 m/s, 0.4 m apart, for 0.02 s.
        assert!(turn_rad <= 0.06 + 1e-9, "{turn_rad} rad in a cycle, in {text}");
        assert!(overlap_m < 1e-9, "an overlap of {overlap_m} m, in {text}");
    }
}

#[test]
fn a_swarm_gets_past_a_disc_that_crosses_its_corridor() {
    for seed in 0..6 {
        let mut run = run::<2>(&source(seed, CROSSED), 1);
        advance_to(&mut run, 6000);
        assert_eq!(run.metrics().progress, 1.0, "seed {seed}: {:?}", run.metrics());
    }
}

#[test]
fn a_swarm_past_a_disc_has_the_same_bits_however_it_is_run() {
    assert_d1::<2>(CROSSED, 1500, &[0, 850, 1100, 1499]);
}

/// Returns whether two neighbors of the swarm can be on both sides of the disc while it is as near to the wall as it
/// comes: a search over their places, in steps of 2 cm. Distances are in meters from the middle of the disc, and from
/// the wall.
fn neighbors_fit_beside(room_m: f64, robot_m: f64) -> bool {
    let (disc_m, longest_m) = (0.3, 0.8);
    let places = |side: f64| {
        let all = (0..=40).flat_map(|i| (0..=150).map(move |j| [0.02 * i as f64, 0.02 * j as f64]));
        let all = all.map(move |[x, up]| [side * x, robot_m + up]);
        let middle_m = room_m + disc_m;
        all.filter(move |[x, y]| hypot(*x, y - middle_m) >= robot_m + disc_m).collect::<Vec<_>>()
    };
    let (before, behind) = (places(-1.0), places(1.0));
    before.iter().any(|a| {
        behind.iter().any(|b| {
            let part = if b[0] > a[0] { -a[0] / (b[0] - a[0]) } else { 0.5 };
            let passes_m = a[1] + part * (b[1] - a[1]);
            hypot(b[0] - a[0], b[1] - a[1]) <= longest_m && passes_m < room_m
        })
    })
}

/// A line that lies across the way of the disc is always on the same side of it. Where no two neighbors fit between
/// the disc and the wall on that side, none of it may be across its way whenever the disc is there: every 10 s from
/// wall to wall. A line in single file takes longer to pass, even at its shortest and as fast as wheels go.
#[test]
fn no_line_gets_past_a_disc_that_leaves_too_little_room_beside_it() {
    // Robots keep 0.08 m around themselves; from wall to wall not even their bodies fit.
    assert!(neighbors_fit_beside(0.7, 0.33) && !neighbors_fit_beside(0.4, 0.33));
    assert!(!neighbors_fit_beside(0.2, 0.25));
    let (line_m, fastest_m_s, away_s) = (15.0 * 0.6, 1.2 * 0.5, 2.0 * 2.0 / 0.4);
    assert!(line_m / fastest_m_s > away_s);
}
