use super::*;
use crate::kinematics::{ArmBodyPart as HitPart, ArmGoal, CollidesWith, IkFailure, ObstacleSphere};
use proptest::prelude::*;
use sidestep_import::urdf::Solid;
use sidestep_import::urdf::srdf::Semantics;
use sidestep_kernel::math;
use sidestep_rods::{Obstacle, Obstacles};
use sidestep_testing::robot_model as shared;
use std::path::Path;

/// Three bars of 1 m that turn in a plane, 0.1 m thick, on a column, with a tool of two fingers of
/// which the second follows the first.
const BARS: &str = "<robot name='bars'>\
    <link name='floor'/>\
    <link name='column'><collision><origin xyz='0 0 -0.5'/>\
        <geometry><cylinder radius='0.1' length='0.8'/></geometry></collision></link>\
    <joint name='stand' type='fixed'><parent link='floor'/><child link='column'/>\
        <origin xyz='0 0 1'/></joint>\
    <link name='a'><collision><origin xyz='0.5 0 0'/>\
        <geometry><box size='0.8 0.1 0.1'/></geometry></collision></link>\
    <link name='b'><collision><origin xyz='0.5 0 0' rpy='0 1.5707963267948966 0'/>\
        <geometry><cylinder radius='0.05' length='0.8'/></geometry></collision></link>\
    <link name='c'><collision><origin xyz='0.9 0 0'/>\
        <geometry><sphere radius='0.1'/></geometry></collision></link>\
    <joint name='ja' type='revolute'><parent link='column'/><child link='a'/>\
        <axis xyz='0 0 1'/><limit lower='-3' upper='3'/></joint>\
    <joint name='jb' type='revolute'><parent link='a'/><child link='b'/><origin xyz='1 0 0'/>\
        <axis xyz='0 0 1'/><limit lower='-3' upper='3'/></joint>\
    <joint name='jc' type='revolute'><parent link='b'/><child link='c'/><origin xyz='1 0 0'/>\
        <axis xyz='0 0 1'/><limit lower='-3' upper='3'/></joint>\
    <link name='tip'/><joint name='mount' type='fixed'><parent link='c'/><child link='tip'/>\
        <origin xyz='1 0 0'/></joint>\
    <link name='left'/><link name='right'><collision><geometry><sphere radius='0.02'/></geometry>\
        </collision></link>\
    <joint name='jl' type='prismatic'><parent link='tip'/><child link='left'/><axis xyz='0 1 0'/>\
        <limit lower='0' upper='0.1'/></joint>\
    <joint name='jr' type='prismatic'><parent link='tip'/><child link='right'/><axis xyz='0 -1 0'/>\
        <limit lower='0' upper='0.1'/><mimic joint='jl'/></joint></robot>";

fn bars(tip: &str) -> (Model, SerialChain) {
    let model = Model::parse("bars", BARS).expect("a model");
    let link = model.link("tip", tip).expect("a link");
    let chain = SerialChain::new(&model, model.root, link, "tip").expect("a chain");
    (model, chain)
}

fn body_of(model: &Model, chain: &SerialChain, may_touch: &[(usize, usize)]) -> ArmBody {
    ArmBody::new(model, chain, &model.solids(Path::new("bars.urdf")).solids, may_touch)
}

#[test]
fn neighbors_rigid_links_and_masked_pairs_may_touch() {
    let (model, chain) = bars("left");
    let all = body_of(&model, &chain, &[]).pairs().len();
    // column-b, column-c, column-right, a-c, a-right, b-right; the tool is rigid but for its joints.
    assert_eq!(all, 6);
    let link = |name: &str| model.link("", name).expect("a link");
    let masked = body_of(&model, &chain, &[(link("c"), link("a")), (link("b"), link("right"))]);
    assert_eq!(
        masked.pairs(),
        [("a", "right"), ("column", "b"), ("column", "c"), ("column", "right")]
    );
}

#[test]
fn overlaps_are_as_deep_as_computed_by_hand() {
    let (model, chain) = bars("left");
    let body = body_of(&model, &chain, &[]);
    assert!(body.link_overlaps(&chain, &[0.0, 0.3, 0.3, 0.0]).is_empty());
    // An equilateral triangle: the ball of the last bar stands 0.1 m before the first joint.
    let turn = 2.0 * std::f64::consts::PI / 3.0;
    let overlaps = body.link_overlaps(&chain, &[0.0, turn, turn, 0.0]);
    // Its center is 0.0866 m beside the axis of the first bar, which is 0.05 m thick, at 0.05 m:
    // 0.05 m before the bar's end at 0.1 m.
    let gap = norm([0.1 * 3f64.sqrt() / 2.0 - 0.05, 0.05]);
    let of_a: Vec<_> = overlaps.iter().filter(|(a, b, _)| (*a, *b) == ("a", "c")).collect();
    let [(_, _, depth_m)] = of_a[..] else { panic!("{overlaps:?}") };
    assert!((depth_m - (0.1 - gap)).abs() < 1e-6, "{depth_m} {gap}");
}

#[test]
fn what_hangs_beside_the_arm_follows_its_joints() {
    let (model, chain) = bars("left");
    let body = body_of(&model, &chain, &[]);
    let right = body.parts.iter().find(|part| part.link == "right").expect("a finger");
    let values = [0.0, 0.0, 0.0, 0.07];
    let at = right.mount.transform(&chain.forward_kinematics(&values).links, &values);
    assert!(apart_m(at.origin_m, [3.0, -0.07, 1.0]) < 1e-12, "{at:?}");
    // From the bar `a` out, the column stands behind it.
    let [base, tip] = ["a", "tip"].map(|name| model.link("", name).expect("a link"));
    let outer = SerialChain::new(&model, base, tip, "tip").expect("a chain");
    let body = body_of(&model, &outer, &[]);
    let column = body.parts.iter().find(|part| part.link == "column").expect("a column");
    let at = column.mount.transform(&outer.forward_kinematics(&[0.0, 0.0]).links, &[0.0, 0.0]);
    assert!(apart_m(at.origin_m, [0.0, 0.0, -0.5]) < 1e-12, "{at:?}");
}

proptest! {
    #[test]
    fn answers_keep_links_off_each_other_and_off_obstacles(
        there in prop::array::uniform3(-1.8..1.8f64),
        at in prop::array::uniform3(-2.0..2.0f64),
    ) {
        let (model, chain) = bars("tip");
        let body = body_of(&model, &chain, &[]);
        let target = chain.forward_kinematics(&there).tip.origin_m;
        let sphere = ObstacleSphere { center_m: [at[0], at[1], 1.0], radius_m: 0.2 };
        let is_clear = |values: &[f64]| {
            let mut shapes = Vec::new();
            body.place_shapes(&chain.forward_kinematics(values), values, &mut shapes);
            let placed = PlacedBody { body: &body, shapes: &shapes };
            let ObstacleSphere { center_m, radius_m } = sphere;
            let mut parts = 0..body.len();
            body.link_overlaps(&chain, values).is_empty()
                && !parts.any(|part| placed.ball_proximity(part, center_m, radius_m, 0.0).is_some())
        };
        let goal = ArmGoal {
            body: Some(body.clone()),
            own_body: true,
            spheres: vec![sphere],
            restarts: 50,
            ..ArmGoal::new(target)
        };
        let answer = chain.solve(&goal, &chain.rest_values()).expect("right");
        // The posture that the target came from is an answer, if it is clear.
        prop_assert!(answer.reached || !is_clear(&there), "{:?}", answer.reason);
        prop_assert!(!answer.reached || is_clear(&answer.values));
    }
}

#[test]
fn the_link_that_is_in_the_way_is_named() {
    let (model, chain) = bars("tip");
    let body = Some(body_of(&model, &chain, &[]));
    let target = chain.forward_kinematics(&[0.0; 3]).tip.origin_m;
    // Straight, there is no other posture. The bar is 0.05 m thick, so that its rod is not hit.
    let sphere = ObstacleSphere { center_m: [0.5, 0.14, 1.0], radius_m: 0.1 };
    let goal = ArmGoal { spheres: vec![sphere], ..ArmGoal::new(target) };
    assert!(chain.solve(&goal, &chain.rest_values()).expect("right").reached);
    let answer = chain.solve(&ArmGoal { body, ..goal }, &chain.rest_values()).expect("right");
    let Some(IkFailure::Blocked(hit)) = answer.reason else { panic!("{answer:?}") };
    assert_eq!((hit.part, hit.against), (HitPart::Link("a".into()), CollidesWith::Sphere(0)));
    assert!((hit.depth_m - 0.01).abs() < 1e-3);
}

#[test]
fn shared_arms_have_bodies_or_remarks_why_not() {
    for (name, parts) in
        [("iiwa14_primitive_collision.urdf", 6), ("pendulum5.urdf", 5), ("ur5_robot.urdf", 1)]
    {
        let Some(path) = shared(name) else { return };
        let model = Model::load(&path).expect(name);
        let chain = SerialChain::new(&model, model.root, model.default_tip(), "tip").expect(name);
        let solids = model.solids(&path);
        let body = ArmBody::new(&model, &chain, &solids.solids, &[]);
        assert_eq!(body.len(), parts, "{name}: {:?}", solids.report);
        let has_meshes = name != "pendulum5.urdf";
        assert_eq!(
            solids.report.findings.len(),
            usize::from(has_meshes),
            "{name}: {:?}",
            solids.report
        );
    }
    let (Some(urdf), Some(srdf)) = (shared("chain/panda.urdf"), shared("chain/panda.srdf")) else {
        return;
    };
    let model = Model::load(&urdf).expect("a model");
    let masks = Semantics::load(&srdf, &model).expect("an SRDF").disabled_collisions;
    let chain = SerialChain::new(&model, model.root, model.default_tip(), "tip").expect("an arm");
    let masks: Vec<_> = masks.iter().map(|mask| mask.links).collect();
    let body = ArmBody::new(&model, &chain, &model.solids(&urdf).solids, &masks);
    // Boxes of two fingers, which may touch each other.
    assert_eq!((body.len(), body.pairs().len()), (8, 0));
}

fn balls(balls: &[([f64; 3], f64)]) -> Obstacles<3> {
    let ids = 0..;
    let all = ids.zip(balls).map(|(id, &(at, radius_m))| Obstacle::ball(id, at, radius_m));
    Obstacles::new(all.collect(), 1.0).expect("obstacles")
}

fn at<'a>(chain: &'a SerialChain, values: &'a [f64]) -> BodyPosture<'a> {
    BodyPosture { chain, at_m: [0.0; 3], values }
}

#[test]
fn a_part_in_one_obstacle_may_not_go_as_deep_into_another() {
    let (model, chain) = bars("tip");
    let body = body_of(&model, &chain, &[]);
    // The first bar is 0.03 m deep in one ball at its left side; turned to the right it meets the other one.
    let obstacles = balls(&[([0.5, 0.12, 1.0], 0.1), ([0.5, -0.18, 1.0], 0.1)]);
    let allowed = body.contacts(at(&chain, &[0.0; 3]), &obstacles, true);
    let depths: Vec<(Option<u32>, f64)> = allowed.iter().map(|c| (c.obstacle, c.depth_m)).collect();
    let [(Some(0), depth_m)] = depths[..] else { panic!("{depths:?}") };
    assert!((depth_m - 0.03).abs() < 1e-6, "{depth_m}");
    let deeper = |turn: f64| {
        let values = [turn, 0.0, 0.0];
        let posture = at(&chain, &values);
        let found = body.find_deeper_contact(posture, &obstacles, true, &allowed);
        let has_one = body.has_deeper_contact(posture, &obstacles, true, &allowed);
        assert_eq!(found.is_some(), has_one);
        found.map(|contact| contact.obstacle)
    };
    // 0.02 m of way at the ball: out of the first one.
    assert_eq!(deeper(-0.04), None);
    assert_eq!(deeper(0.04), Some(Some(0)));
    // Less deep in the second one than it was in the first.
    let turned = [-0.1, 0.0, 0.0];
    let second = body.deepest_contact(at(&chain, &turned), &obstacles, true).expect("a contact");
    assert_eq!(second.obstacle, Some(1));
    assert!(second.depth_m < depth_m, "{second:?}");
    assert_eq!(deeper(-0.1), Some(Some(1)));
    // Of the second bar in the first ball nothing was allowed, nor of the arm in itself.
    let turn = 2.0 * std::f64::consts::PI / 3.0;
    let folded = [0.0, turn, turn];
    let own = body.find_deeper_contact(at(&chain, &folded), &balls(&[]), true, &allowed);
    assert_eq!(own.map(|contact| contact.obstacle), Some(None));
    assert_eq!(body.find_deeper_contact(at(&chain, &folded), &balls(&[]), false, &allowed), None);
}

proptest! {
    /// By many postures on the path.
    #[test]
    fn a_path_is_free_exactly_if_no_posture_on_it_overlaps(
        ends in prop::array::uniform2(prop::array::uniform3(-2.5..2.5f64)),
        ball in prop::array::uniform3(-2.0..2.0f64),
        steps in 1_usize..200,
    ) {
        let (model, chain) = bars("left");
        let body = body_of(&model, &chain, &[]);
        let obstacles = balls(&[([ball[0], ball[1], 1.0], 0.1 + 0.1 * ball[2].abs())]);
        let [from, to] = ends.map(|[a, b, c]| [a, b, c, 0.02 + 0.01 * c.abs()]);
        let travel = BodyTravel::new(&chain, &body);
        let allowed = body.contacts(at(&chain, &from), &obstacles, true);
        let check = BodyPathCheck {
            body: &body,
            travel: &travel,
            start: at(&chain, &from),
            obstacles: &obstacles,
            own: true,
            allowed: &allowed,
        };
        let is_free = check.is_free(&to, steps);
        let depth_at = |fraction: f64| {
            let values: Vec<f64> =
                from.iter().zip(&to).map(|(from, to)| from + fraction * (to - from)).collect();
            let contact =
                body.find_deeper_contact(at(&chain, &values), &obstacles, true, &allowed);
            contact.map_or(0.0, |contact| contact.depth_m)
        };
        // A piece of the least length may hide an overlap no deeper than what is traveled on half of it.
        let changes: Vec<f64> = from.iter().zip(&to).map(|(from, to)| to - from).collect();
        let most_m = (0..body.len()).map(|part| travel.part_m(part, &changes)).fold(0.0, f64::max);
        let missed_m = 2.0 * most_m / steps as f64;
        let deepest_m = (0..=1024).map(|k| depth_at(f64::from(k) / 1024.0)).fold(0.0, f64::max);
        if is_free {
            prop_assert!(deepest_m <= missed_m, "{deepest_m} {missed_m}");
        } else {
            // Middles of pieces are among these, as long as pieces are no shorter.
            prop_assert!(deepest_m > 0.0);
        }
    }

    /// Of points as far from the centers of parts as they reach.
    #[test]
    fn no_part_travels_farther_than_its_bound(
        turns in prop::array::uniform2(prop::array::uniform3(-2.0..2.0f64)),
        slides in prop::array::uniform2(0.0..0.1f64),
    ) {
        let (model, chain) = bars("left");
        let body = body_of(&model, &chain, &[]);
        let travel = BodyTravel::new(&chain, &body);
        let [from, to] = [0, 1].map(|k| [turns[k][0], turns[k][1], turns[k][2], slides[k]]);
        let changes: Vec<f64> = from.iter().zip(&to).map(|(from, to)| to - from).collect();
        let place = |values: &[f64], part: usize| {
            let frames = chain.forward_kinematics(values);
            body.parts[part].mount.transform(&frames.links, values)
        };
        for a in 0..body.len() {
            let far = [0.0, body.parts[a].radius_m, 0.0];
            let [p, q] = [&from, &to].map(|values| place(values, a).transform_point(far));
            prop_assert!(apart_m(p, q) <= travel.part_m(a, &changes) + 1e-9, "part {a}");
            for b in 0..a {
                let against = |values: &[f64; 4]| {
                    let at = place(values, a).transform_point(far);
                    place(values, b).inverse_transform_point(at)
                };
                let bound_m = travel.pair_m(a, b, &changes);
                prop_assert!((travel.pair_m(b, a, &changes) - bound_m).abs() < 1e-12);
                // Seen from the part that is nearer to the base.
                if body.link(b) <= body.link(a) {
                    let moved_m = apart_m(against(&from), against(&to));
                    prop_assert!(moved_m <= bound_m + 1e-9, "parts {a} and {b}: {moved_m} {bound_m}");
                }
            }
        }
    }
}

/// Every point of a part is in the obstacle that encloses it: points on the surfaces, drawn in its own axes.
#[test]
fn enclosures_hold_their_parts() {
    let (model, chain) = bars("left");
    let rod =
        Solid { shape: Shape::Cylinder { radius_m: 0.02, length_m: 0.8 }, ..solid_of(&model) };
    let disc = Solid { shape: Shape::Cylinder { radius_m: 0.2, length_m: 0.1 }, ..rod.clone() };
    let corners = [[0.0, 0.0, 0.0], [0.3, 0.0, 0.1], [0.0, 0.2, 0.0], [0.1, 0.1, 0.4]];
    let hull = Solid { shape: Shape::Hull { points_m: corners.to_vec() }, ..rod.clone() };
    let solids: Vec<Solid> =
        model.solids(Path::new("bars.urdf")).solids.into_iter().chain([rod, disc, hull]).collect();
    let body = ArmBody::new(&model, &chain, &solids, &[]);
    let values = [0.4, -0.8, 1.1, 0.03];
    let enclosures: Vec<Obstacle<3>> = body.enclosures(at(&chain, &values), 9);
    assert_eq!(enclosures.len(), body.len());
    let mut shapes = Vec::new();
    body.place_shapes(&chain.forward_kinematics(&values), &values, &mut shapes);
    for ((part, shape), enclosure) in body.parts.iter().zip(&shapes).zip(&enclosures) {
        assert_eq!(enclosure.id, 9);
        // The farthest point of the part in each of many directions, by its support function.
        let support = part.core.shape().as_support_map().expect("convex");
        for k in 0..200 {
            let turn = 2.4 * f64::from(k);
            let rise = f64::from(k) / 100.0 - 0.995;
            let flat = (1.0 - rise * rise).sqrt();
            let direction = vector([flat * math::cos(turn), flat * math::sin(turn), rise]);
            let farthest = point(support.support_point(&shape.pose, direction));
            let outside_m =
                enclosure.core.nearest_to_point(farthest).distance_m - enclosure.radius_m;
            assert!(outside_m < 1e-9, "{}: {outside_m}", part.link);
        }
        // And it is no larger than twice the ball around the part.
        let bounds = enclosure.bounds();
        let size_m = [0, 1, 2].map(|i| bounds.hi[i] - bounds.lo[i]);
        assert!(size_m.iter().all(|size| *size <= 4.0 * part.radius_m), "{}", part.link);
    }
}

fn solid_of(model: &Model) -> Solid {
    model.solids(Path::new("bars.urdf")).solids[1].clone()
}

#[test]
fn no_part_leaves_the_box_that_it_may_enter() {
    let (model, chain) = bars("left");
    let body = body_of(&model, &chain, &[]);
    let travel = BodyTravel::new(&chain, &body);
    let values = [0.4, -0.8, 1.1, 0.03];
    let changes = [0.2, 0.1, 0.3, 0.01];
    let reach = body.reach_box(&travel, at(&chain, &values), &changes);
    for signs in 0..16 {
        let moved: Vec<f64> = (0..4)
            .map(|i| values[i] + changes[i] * if signs >> i & 1 == 1 { 1.0 } else { -1.0 })
            .collect();
        for enclosure in body.enclosures::<3>(at(&chain, &moved), 0) {
            let bounds = enclosure.bounds();
            let center = [0, 1, 2].map(|i| 0.5 * (bounds.lo[i] + bounds.hi[i]));
            assert!((0..3).all(|i| reach.lo[i] <= center[i] && center[i] <= reach.hi[i]));
        }
    }
    let still = body.reach_box(&travel, at(&chain, &values), &[0.0; 4]);
    assert!((0..3).all(|i| reach.hi[i] - reach.lo[i] > still.hi[i] - still.lo[i]));
}
