//! Targets that a tool passes without coming to rest.

use super::*;

/// Places, and the joint values of some postures.
const PLACES: &str =
    "targets_m = [[0.5, -0.2, 0.6], [0.55, 0.0, 0.7], [0.5, 0.2, 0.6], [0.3, 0.5, 0.6]]";
const POSTURES: &str = "joints = [[0.3, 0.6, 0.2, 1.1, 0.1, 0.6, 0.1], [0.6, 0.4, 0.4, 1.3, 0.2, 0.4, 0.3], \
                        [0.9, 0.6, 0.3, 1.0, 0.4, 0.5, 0.2]]";

/// What a run of the shipped arm through targets was like.
struct PassedTargets {
    /// Least distance of the tool from each of them, m.
    nearest_m: Vec<f64>,
    /// Least speed of the tool from the first target to the one before the last, m/s.
    slowest_m_s: f64,
    cycles: u64,
}

fn pass(targets: &str, more: &str) -> PassedTargets {
    let task = format!("kind = \"targets\"\nconnector = 3\nspeed_m_s = 0.4\n{targets}\n{more}");
    let start = || arm(&shipped(), "[chain]\ndimensions = 3", &task);
    assert_joints_keep_their_laws(&mut start(), 5000, more);
    let mut run = start();
    let TaskKind::Targets(asked) = run.world().chains[0].tasks[0].driver.clone() else {
        panic!("targets")
    };
    let tool = |run: &ChainRun<3>| run.state().body(0).chain.points()[3];
    let mut nearest_m = vec![f64::INFINITY; asked.places.len()];
    let mut slowest_m_s = f64::INFINITY;
    while run.cycle() < 5000 && !run.is_over() {
        let before = tool(&run);
        run.advance(1);
        let at = tool(&run);
        for (nearest_m, place) in nearest_m.iter_mut().zip(&asked.places) {
            *nearest_m = nearest_m.min(distance(at, *place));
        }
        let next = run.state().body(0).driving.next as usize;
        if (1..asked.places.len() - 1).contains(&next) {
            slowest_m_s = f64::min(slowest_m_s, distance(before, at) / 0.02);
        }
    }
    assert_all_is_reached(&run, more);
    PassedTargets { nearest_m, slowest_m_s, cycles: run.cycle() }
}

#[test]
fn a_tool_passes_all_targets_but_the_last_within_its_blend_distance_without_stopping() {
    for targets in [PLACES, POSTURES] {
        let near = pass(targets, "");
        let blended = pass(targets, "blend_m = 0.06");
        assert!(blended.cycles + 10 < near.cycles, "{} {}", blended.cycles, near.cycles);
        let least_m_s = 1.3 * near.slowest_m_s + 0.05;
        assert!(blended.slowest_m_s > least_m_s, "{} {}", blended.slowest_m_s, near.slowest_m_s);
        let (last_m, passed_m) = blended.nearest_m.split_last().expect("targets");
        assert!(passed_m.iter().all(|left_m| *left_m <= 0.06), "{passed_m:?}");
        assert!(passed_m.iter().any(|left_m| *left_m > 0.001), "{passed_m:?}");
        assert!(*last_m <= 0.001, "{last_m}");
        assert!(near.nearest_m.iter().all(|left_m| *left_m <= 0.001), "{:?}", near.nearest_m);
    }
}

#[test]
fn what_cannot_blend_is_refused() {
    let cause_of = |targets_m: &str, chain: &str, more: &str| {
        let text = format!(
            "format = 1\nworld = \"chain\"\n[chain]\ndimensions = 3\n[[chains]]\n{chain}\n[[chains.tasks]]\n\
             kind = \"targets\"\nconnector = 3\ntargets_m = {targets_m}\nblend_m = 0.05\n{more}"
        );
        let source = Source::new("s.toml", &text, root());
        ChainScenario::<3>::new(&source).err().map(|error| error.cause().to_string())
    };
    let cause =
        |chain: &str, more: &str| cause_of("[[0.4, 0.1, 0.6], [0.4, -0.1, 0.6]]", chain, more);
    let reacher = format!("arm = {{ urdf = {} }}\nradius_m = 0.02", shipped());
    assert_eq!(cause(&reacher, ""), None);
    let alone = cause_of("[[0.4, 0.1, 0.6]]", &reacher, "").expect("one target");
    assert!(alone.contains("no other one"), "{alone}");
    let line = cause(&reacher, "path = \"line\"").expect("a line");
    assert!(line.contains("comes to rest"), "{line}");
    let rods = cause("connectors = 4\nrod_m = 0.3\nradius_m = 0.02", "").expect("no arm");
    assert!(rods.contains("only the tool of an arm"), "{rods}");
}
