//! Arms with a fixed base reach all targets within reach, where nothing stands around them.

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

/// Returns a chain of five rods, the first connector of which is held, and that goes to places which the held
/// one's places reach.
fn held(mobility: &str) -> String {
    format!(
        "[[chains]]
connectors = 6
at_m = [5.0, 0.0]
rod_m = 1.0
[[chains.limits]]
connector = 0
mobility = {mobility}
[[chains.tasks]]
kind = \"targets\"
connector = 5
targets_m = [[-2.0, 2.0], [4.0, 3.0], [8.0, -2.0], [3.0, -4.0]]
"
    )
}

#[test]
fn bases_on_a_rail_a_line_and_in_a_box_reach_all_that_they_can_with_the_same_bits() {
    for mobility in [
        "{ on_segment = [[0.0, 0.0], [6.0, 0.0]] }",
        "{ on_plane = { normal = [0, 1], offset_m = 0 } }",
        "{ in_box = [[0, -1], [6, 1]] }",
    ] {
        let text = held(mobility);
        let mut run = run::<2>(&source(1, &text), 1);
        advance_to(&mut run, 8000);
        let metrics = run.metrics();
        assert!(metrics.given_up.is_empty(), "{mobility}: {:?}", metrics.given_up);
        assert_eq!(metrics.progress, 1.0, "{mobility}");
        assert!(metrics.max_speed_m_s <= 1.0 + 1e-9, "twice the tool: {}", metrics.max_speed_m_s);
        assert_d1::<2>(&text, 600, &[0, 300, 599]);
    }
}

#[test]
fn a_script_leads_the_tool_of_a_chain_with_a_fixed_base_to_its_end() {
    let text = "[[chains]]\nconnectors = 6\nat_m = [0.0, 0.0]\nalong = [1.0, 0.3]\nrod_m = 0.5\n\
                [[chains.limits]]\nconnector = 0\nmobility = \"fixed\"\n\
                [[chains.tasks]]\nkind = \"script\"\nconnector = 5\nscript = \"goto 1.5, 1.0\"\n";
    let mut run = run::<2>(&source(1, text), 1);
    advance_to(&mut run, 1000);
    assert_eq!(run.metrics().progress, 1.0, "{:?}", run.metrics());
    let [x, y] = run.state().body(0).chain.points()[5];
    assert!(hypot(x - 1.5, y - 1.0) <= 1e-7, "{x}, {y}");
}

/// Wanderers among each other and pillars, with rods that turn aside: no part is thrown about.
#[test]
fn no_part_is_thrown_about_where_a_rod_turns_aside() {
    let fastest_m_s = |text: &str| {
        let mut run = run::<2>(&source(1, text), 1);
        run.advance(600);
        (run.metrics().max_speed_m_s, run.metrics().progress)
    };
    let (usual_m_s, progress) = fastest_m_s(SEVERAL);
    // Steps of 2 cm at most, of 5 cm in a cycle, each with slaves up to four times as far.
    assert!(usual_m_s <= 3.0 * 0.08 / 0.05 + 1e-9, "{usual_m_s} m/s for leaders at 1 m/s");
    // Of a run of 2,000 cycles, these are three tenths; chains whose own body is in their way wait a little.
    assert!(progress > 0.26, "{progress}");
    let text = SEVERAL.replace("dt_s = 0.05", "dt_s = 0.05\nslave_step_max_m = inf");
    assert!(fastest_m_s(&text).0 > usual_m_s, "there is a limit to keep to");
}
