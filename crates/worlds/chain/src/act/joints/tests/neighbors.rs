//! Arms beside each other: their links are what others meet.

use super::*;

/// Joints of the first arm, of which no link is near the other one.
const AWAY: [f64; 3] = [-0.3, 0.5, 0.4];

/// Returns the text of two arms of boxes: one that leads its tool to a place 1.5 cm deep in the links of the other, which
/// lies along the first axis and rests.
fn beside(joints: [f64; 3], other: &str) -> String {
    let chain = |more: &str, at_m: [f64; 3], joints: [f64; 3], task: &str| {
        format!(
            "[[chains]]\nat_m = {at_m:?}\narm = {{ urdf_text = \"\"\"{}\"\"\", joints = {joints:?}{more} }}\n\
             radius_m = 0.015\nrod_radius_m = 0.01\n[[chains.tasks]]\n{task}\n",
            boxed()
        )
    };
    let goes = "kind = \"targets\"\nconnector = 3\ntargets_m = [[0.4, 0.715, 0.0]]\nspeed_m_s = 0.3\npatience_s = 2";
    format!(
        "format = 1\nworld = \"chain\"\ncycles = 20000\n[chain]\ndimensions = 3\n{}{}",
        chain("", [0.0; 3], joints, goes),
        chain(other, [-0.3, 0.75, 0.0], [0.0; 3], "kind = \"rest\"\nlasts_s = 20.0")
    )
}

/// Returns the deepest overlap in m of the boxes of both arms in a run, the cycles checked one by one.
fn deepest_m(run: &mut ChainRun<3>) -> f64 {
    let arms = [0, 1].map(|slot| run.world().chains[slot].arm.clone().expect("an arm"));
    let model = Model::parse("boxed", &boxed()).expect("a model");
    let solids = model.solids(Path::new("boxed.urdf")).solids;
    let bodies = arms.clone().map(|arm| ArmBody::new(&model, &arm.serial, &solids, &[]));
    let mut deepest_m: f64 = 0.0;
    for _ in 0..600 {
        run.advance(1);
        let values = [0, 1].map(|slot| run.state().body(slot).joints.clone().expect("an arm"));
        let boxes = bodies[1].enclosures::<3>(arms[1].posture(&values[1]), 0);
        let boxes = Obstacles::new(boxes, 1.0).expect("valid");
        let contact = bodies[0].deepest_contact(arms[0].posture(&values[0]), &boxes, false);
        deepest_m = contact.map_or(deepest_m, |contact| deepest_m.max(contact.depth_m));
    }
    deepest_m
}

#[test]
fn the_links_of_an_arm_are_what_another_arm_meets() {
    let run = |text: &str| {
        let source = Source::new("s.toml", text, root());
        ChainScenario::<3>::new(&source).expect("valid").start(&source, 1)
    };
    assert_eq!(deepest_m(&mut run(&beside(AWAY, ""))), 0.0);
    // Where only its rods count, the other arm is in their way no sooner.
    let deep_m = deepest_m(&mut run(&beside(AWAY, ", body = \"rods\"")));
    assert!(deep_m > 0.01, "{deep_m}");
}

#[test]
fn arms_whose_links_overlap_at_the_start_are_refused() {
    let refused = |text: &str| {
        let source = Source::new("s.toml", text, root());
        ChainScenario::<3>::new(&source).err().map(|error| error.cause().to_string())
    };
    // The tool is 0.065 m from the middle of the other one's links, which are 0.1 m thick.
    let near = [0.3, 0.5, 0.4];
    let cause = refused(&beside(near, "")).expect("links that overlap");
    assert!(cause.contains("deep in chain 1"), "{cause}");
    assert_eq!(refused(&beside(AWAY, "")), None);
    let rods = beside(near, ", body = \"rods\"").replace("0.4] }", "0.4], body = \"rods\" }");
    assert_eq!(refused(&rods), None);
}
