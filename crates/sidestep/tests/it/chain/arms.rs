//! Arms with a fixed base reach what they can reach, where nothing stands around them.

use super::*;
use sidestep_kernel::stream::{Purpose, Streams};

/// Returns targets at any distance from 0.8 m to nine tenths of an arm's reach.
fn targets<const D: usize>(links: usize, seed: u64) -> Vec<[f64; D]> {
    let mut draws = Streams::new(sidestep_kernel::Seed(seed)).draws(0, 0, Purpose(1));
    let mut target = || loop {
        let at: [f64; D] = std::array::from_fn(|_| 2.0 * draws.uniform() - 1.0);
        let length = at.iter().fold(0.0, |all, x| hypot(all, *x));
        let far_m = 0.9 * links as f64 * draws.uniform();
        if (0.1..1.0).contains(&length) && far_m > 0.8 {
            return at.map(|x| x / length * far_m);
        }
    };
    (0..4).map(|_| target()).collect()
}

/// Returns an arm of rods of 1 m, straight or a zigzag, that goes to four targets.
fn scenario<const D: usize>(links: usize, is_bent: bool, is_solid: bool) -> String {
    let mut points = vec![[0.0; D]];
    for k in 0..links {
        let rise = if !is_bent { 0.0 } else { [0.3, -0.2][k % 2] };
        let mut at = points[k];
        at[0] += f64::sqrt(1.0 - rise * rise);
        at[1] += rise;
        points.push(at);
    }
    let targets = targets::<D>(links, (10 * links + D) as u64);
    format!(
        "[chain]
dimensions = {D}
self_collision = {is_solid}
[[chains]]
points_m = {points:?}
rod_m = 1.0
radius_m = 0.05
rod_radius_m = 0.03
[[chains.limits]]
connector = 0
mobility = \"fixed\"
[[chains.tasks]]
kind = \"targets\"
connector = {links}
targets_m = {targets:?}
speed_m_s = 2.0
"
    )
}

fn assert_all_reached<const D: usize>(links: &[usize]) {
    for &links in links {
        for (is_bent, is_solid) in [(false, false), (false, true), (true, false), (true, true)] {
            let mut run = run::<D>(&source(1, &scenario::<D>(links, is_bent, is_solid)), 1);
            advance_to(&mut run, 20_000);
            let metrics = run.metrics();
            let case = format!("{links} links in {D}-d, bent {is_bent}, solid {is_solid}");
            assert!(metrics.given_up.is_empty(), "{case}: {:?}", metrics.given_up);
            assert_eq!(metrics.progress, 1.0, "{case}");
        }
    }
}

#[test]
fn arms_of_3_to_11_links_in_the_plane_and_to_25_in_space_reach_all_targets_within_reach() {
    assert_all_reached::<2>(&[3, 7, 11]);
    assert_all_reached::<3>(&[3, 7, 11, 25]);
}
