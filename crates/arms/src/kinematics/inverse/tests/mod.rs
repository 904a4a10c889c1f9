mod poses;

use super::criteria::PostureEvaluator;
use super::step::JointRanges;
use super::*;
use crate::ik::IkEngine;
use crate::kinematics::RecoverError;
use crate::kinematics::{Transform, Vector};
use proptest::prelude::*;
use sidestep_import::urdf::Model;
use sidestep_kernel::geometry::{norm, sub};
use sidestep_testing::robot_model as shared;
use std::f64::consts::PI;

fn arm_of(text: &str) -> SerialChain {
    let model = Model::parse("arm", text).expect("a model");
    SerialChain::new(&model, model.root, model.default_tip(), "tip").expect("a chain")
}

/// Shoulder of two axes, elbow, slide, and a last joint that mimics the elbow.
fn arm() -> SerialChain {
    arm_of(
        "<robot name='arm'><link name='a'/><link name='b'/><link name='c'/><link name='d'/>\
         <link name='e'/><link name='f'/>\
         <joint name='yaw' type='continuous'><parent link='a'/><child link='b'/>\
         <origin xyz='0 0 0.5'/><axis xyz='0 0 1'/></joint>\
         <joint name='pitch' type='revolute'><parent link='b'/><child link='c'/>\
         <axis xyz='0 1 0'/><limit lower='-1.5' upper='1.5'/></joint>\
         <joint name='elbow' type='revolute'><parent link='c'/><child link='d'/>\
         <origin xyz='1 0.1 0'/><axis xyz='0 1 0'/><limit lower='-2' upper='2'/></joint>\
         <joint name='slide' type='prismatic'><parent link='d'/><child link='e'/>\
         <origin xyz='0.5 0 0'/><axis xyz='1 0 0'/><limit lower='0' upper='0.4'/></joint>\
         <joint name='nod' type='revolute'><parent link='e'/><child link='f'/>\
         <origin xyz='0.2 0 0'/><axis xyz='0 1 0'/><limit lower='-0.5' upper='0.5'/>\
         <mimic joint='elbow' multiplier='-0.5' offset='0.1'/></joint>\
         <link name='tip'/><joint name='mount' type='fixed'><parent link='f'/><child link='tip'/>\
         <origin xyz='0.3 0 0.1'/></joint></robot>",
    )
}

fn apart_m(a: Vector, b: Vector) -> f64 {
    norm(sub(a, b))
}

fn inside(chain: &SerialChain, shares: &[f64]) -> Vec<f64> {
    let ranges = JointRanges::from_chain(chain).ranges;
    let value = |(range, share): (&[f64; 2], &f64)| {
        let [lower, upper] = range.map(|x| x.clamp(-PI, PI));
        lower + share * (upper - lower)
    };
    ranges.iter().zip(shares).map(value).collect()
}

proptest! {
    #[test]
    fn what_the_arm_reaches_is_reached_inside_its_limits(
        there in prop::array::uniform4(0.0..1.0f64),
        start in prop::array::uniform4(0.0..1.0f64),
    ) {
        let arm = arm();
        prop_assert_eq!(arm.variables.len(), 4);
        let target = arm.forward_kinematics(&inside(&arm, &there)).tip.origin_m;
        for engine in [IkEngine::Dls, IkEngine::Chain] {
            let goal = ArmGoal { engine, ..ArmGoal::new(target) };
            let answer = arm.solve(&goal, &inside(&arm, &start)).expect("right");
            prop_assert!(answer.reached, "{:?}", answer.reason);
            prop_assert!(apart_m(arm.forward_kinematics(&answer.values).tip.origin_m, target) <= 1e-6);
            prop_assert!(arm.outside_limits(&answer.values).is_empty());
            prop_assert_eq!(&answer, &arm.solve(&goal, &inside(&arm, &start)).expect("right"));
        }
    }

    #[test]
    fn the_jacobian_is_the_slope_of_the_errors(
        there in prop::array::uniform4(0.0..1.0f64),
        target in prop::array::uniform4(0.0..1.0f64),
        variable in 0usize..4,
        turn in prop::sample::select(vec![
            OrientationMask::Free, OrientationMask::Axis(FrameAxis::X), OrientationMask::Axis(FrameAxis::Z), OrientationMask::Whole,
        ]),
    ) {
        let arm = arm();
        let skeleton = arm.skeleton();
        let [values, target] = [there, target].map(|shares| inside(&arm, &shares));
        let spheres = vec![ObstacleSphere { center_m: [0.4, 0.3, 0.6], radius_m: 3.0 }];
        let asked = PoseMask { along: [true, false, true], turn };
        let goal = ArmGoal { spheres, asked, ..ArmGoal::from_pose(arm.forward_kinematics(&target).tip) };
        let scene = PostureEvaluator::new(&arm, &skeleton, &goal);
        let look_at = |by: f64| {
            let mut values = values.clone();
            values[variable] += by;
            let mut look = PostureEvaluator::empty_evaluation(&arm);
            scene.evaluate(&values, &mut look);
            look
        };
        let (here, mut rows) = (look_at(0.0), Vec::new());
        // At half a turn the errors have a kink.
        prop_assume!(here.turn_rad < 3.1);
        scene.jacobian(&here, 4, &mut rows);
        // Rows give the rates at which the wanted changes shrink.
        let products = rows.chunks_exact(4).zip(&here.wanted).map(|(row, w)| row[variable] * w);
        let by_rows = -2.0 * products.sum::<f64>();
        let by_differences = (look_at(1e-6).merit() - look_at(-1e-6).merit()) / 2e-6;
        prop_assert!((by_rows - by_differences).abs() < 1e-6, "{by_rows} {by_differences}");
    }
}

#[test]
fn reasons_name_the_joint_the_obstacle_or_the_reach() {
    let arm = arm();
    let start = arm.rest_values();
    let solve = |goal: &ArmGoal| arm.solve(goal, &start).expect("right");
    let far = solve(&ArmGoal::new([9.0, 0.0, 0.5]));
    assert!(matches!(far.reason, Some(IkFailure::TooFar { .. })), "{far:?}");
    // Nearer to the shoulder than the elbow may fold.
    let near = arm.forward_kinematics(&[0.0, 0.2, 2.9, 0.0]).tip.origin_m;
    let limited = solve(&ArmGoal { restarts: 10, ..ArmGoal::new(near) });
    let Some(IkFailure::OutsideLimits { joint, .. }) = &limited.reason else {
        panic!("{limited:?}")
    };
    assert!(["pitch", "elbow", "slide"].contains(&joint.as_str()));
    let ignored = solve(&ArmGoal { ignore_limits: true, ..ArmGoal::new(near) });
    assert!(ignored.reached);
    let target = arm.forward_kinematics(&[0.3, 0.2, 0.4, 0.2]).tip.origin_m;
    let spheres = vec![ObstacleSphere { center_m: target, radius_m: 0.2 }];
    let blocked = solve(&ArmGoal { spheres, restarts: 10, ..ArmGoal::new(target) });
    let Some(IkFailure::Blocked(hit)) = &blocked.reason else { panic!("{blocked:?}") };
    assert_eq!(hit.against, CollidesWith::Sphere(0));
}

#[test]
fn wrong_goals_are_named() {
    let arm = arm();
    let right = ArmGoal::new([0.5, 0.0, 0.5]);
    let bad_sphere = ObstacleSphere { center_m: [0.0; 3], radius_m: -1.0 };
    for (goal, place) in [
        (ArmGoal::new([f64::NAN, 0.0, 0.0]), "target"),
        (
            ArmGoal::from_pose(Transform { rotation: [[1.0; 3]; 3], ..Transform::IDENTITY }),
            "target",
        ),
        (
            ArmGoal {
                asked: PoseMask { along: [false; 3], turn: OrientationMask::Free },
                ..right.clone()
            },
            "target",
        ),
        (ArmGoal { tolerance_rad: 0.0, ..right.clone() }, "tolerance"),
        (ArmGoal { tolerance_m: -1.0, ..right.clone() }, "tolerance"),
        (ArmGoal { spheres: vec![bad_sphere], ..right.clone() }, "obstacle 1"),
    ] {
        assert_eq!(arm.solve(&goal, &arm.rest_values()).expect_err("wrong").place(), place);
    }
    assert!(arm.solve(&right, &[0.0]).is_err());
    assert!(arm.solve(&right, &[f64::NAN; 4]).is_err());
}

#[test]
fn a_rigid_body_is_where_it_is() {
    let rigid = arm_of(
        "<robot name='r'><link name='a'/><link name='b'/><joint name='j' type='fixed'>\
         <parent link='a'/><child link='b'/><origin xyz='1 2 3'/></joint></robot>",
    );
    assert!(rigid.solve(&ArmGoal::new([1.0, 2.0, 3.0]), &[]).expect("right").reached);
    let off = rigid.solve(&ArmGoal::new([1.0, 2.0, 2.5]), &[]).expect("right");
    assert!(!off.reached && (off.error_m - 0.5).abs() < 1e-12);
}

#[test]
fn shared_arms_reach_what_they_have_reached() {
    for name in [
        "chain/iiwa7.urdf",
        "chain/panda.urdf",
        "chain/ur5.urdf",
        "z1.urdf",
        "chain/snake16_own.urdf",
        "REU_snake.urdf",
        "pendulum5.urdf",
    ] {
        let Some(path) = shared(name) else { return };
        let model = Model::load(&path).expect(name);
        let arm = SerialChain::new(&model, model.root, model.default_tip(), "tip").expect("arm");
        for seed in 0..20u32 {
            let share = |k: usize| (f64::from(seed) * 0.37 + k as f64 * 0.618_034).fract();
            let shares: Vec<f64> = (0..arm.variables.len()).map(share).collect();
            let target = arm.forward_kinematics(&inside(&arm, &shares)).tip.origin_m;
            let answer = arm.solve(&ArmGoal::new(target), &arm.rest_values()).expect("right");
            assert!(answer.reached, "{name}: {:?}", answer.reason);
            assert!(
                apart_m(arm.forward_kinematics(&answer.values).tip.origin_m, target) <= 1e-6,
                "{name}"
            );
            assert!(arm.outside_limits(&answer.values).is_empty(), "{name}");
        }
    }
}

#[test]
fn the_connectors_of_an_iiwa_lead_to_its_joints_and_those_of_a_panda_do_not() {
    let Some(path) = shared("chain/iiwa7.urdf") else { return };
    let engine_of = |path: &std::path::Path| {
        let model = Model::load(path).expect("a model");
        let arm = SerialChain::new(&model, model.root, model.default_tip(), "tip").expect("arm");
        let goal = ArmGoal { engine: IkEngine::Chain, ..ArmGoal::new([0.35, 0.2, 0.5]) };
        let answer = arm.solve(&goal, &arm.rest_values()).expect("right");
        assert!(answer.reached, "{:?}", answer.reason);
        let skeleton = arm.skeleton();
        let connectors =
            arm.connector_positions(&skeleton, &arm.forward_kinematics(&answer.values));
        (answer.engine, arm.recover_joint_values(&skeleton, &connectors, &answer.values))
    };
    let (engine, recovered) = engine_of(&path);
    assert_eq!(engine, IkEngine::Chain);
    assert!(recovered.is_ok());
    let panda = shared("chain/panda.urdf").expect("there");
    let (engine, recovered) = engine_of(&panda);
    assert_eq!(engine, IkEngine::Dls);
    assert!(matches!(recovered, Err(RecoverError::Coupled { .. })), "{recovered:?}");
}
