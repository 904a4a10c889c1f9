//! Orientations, free axes, several postures and the nearest one.

use super::*;
use sidestep_import::urdf::{Limits, Origin};
use sidestep_kernel::math::{acos, wrap_angle};

/// Six joints with offsets everywhere, so that no two axes meet.
fn six() -> SerialChain {
    let joint = |i: usize, origin: &str, axis: &str, limits: &str| {
        format!(
            "<joint name='j{i}' type='revolute'><parent link='l{}'/><child link='l{i}'/>\
             <origin {origin}/><axis xyz='{axis}'/><limit {limits}/></joint>",
            i - 1
        )
    };
    let links: String = (0..=6).map(|i| format!("<link name='l{i}'/>")).collect();
    let joints = [
        joint(1, "xyz='0 0 0.4' rpy='0 0 0.3'", "0 0 1", "lower='-2.9' upper='2.9'"),
        joint(2, "xyz='0.05 0.02 0' rpy='0.1 0 0'", "0 1 0", "lower='-2' upper='2'"),
        joint(3, "xyz='0 0 0.5'", "0 1 0", "lower='-2.5' upper='2.5'"),
        joint(4, "xyz='0.03 0 0.4' rpy='0 -0.2 0'", "0 0 1", "lower='-3.1' upper='3.1'"),
        joint(5, "", "0 1 0", "lower='-2.1' upper='2.1'"),
        joint(6, "xyz='0 0 0.08'", "0 0 1", "lower='-3.1' upper='3.1'"),
    ];
    arm_of(&format!(
        "<robot name='six'>{links}<link name='tool'/>{}<joint name='mount' type='fixed'>\
         <parent link='l6'/><child link='tool'/><origin xyz='0.02 0 0.11' rpy='0 0.4 0'/></joint>\
         </robot>",
        joints.concat()
    ))
}

/// Joint values, position, roll pitch yaw, and quaternion (x, y, z, w) of the tool.
type Known = ([f64; 6], Vector, Vector, [f64; 4]);

/// Computed by pinocchio 4.1.0 (`framesForwardKinematics`) from the same model.
const KNOWN: [Known; 4] = [
    (
        [0.89, 1.01, -0.62, -2.26, 0.24, -1.75],
        [0.315658175974, 0.570872189716, 1.208397837049],
        [-0.153197040811, 0.153792677872, -2.878105185293],
        [-0.065908907986, -0.085698125553, 0.984734417571, -0.136418378436],
    ),
    (
        [1.02, -0.49, -0.17, 2.36, 0.95, 1.71],
        [-0.178538368051, -0.544994567788, 1.161871271449],
        [1.784271520652, 0.463277298369, -0.413838649725],
        [0.771070435746, -0.014610447871, -0.300414978874, 0.561237702226],
    ),
    (
        [0.26, 1.41, -1.93, 1.93, -0.37, -1.33],
        [0.289797996858, 0.071558207244, 0.995105327621],
        [-0.017259090973, -0.327015898898, 1.258459007194],
        [0.088912572408, -0.136610840562, 0.579515191641, 0.798494943858],
    ),
    (
        [0.16, 1.42, -0.68, 2.03, -0.11, 2.32],
        [0.867423077512, 0.35382960242, 0.903606126429],
        [-0.653116937217, 0.297701033301, -1.701144565118],
        [-0.103654474631, 0.331098025885, -0.672685019111, 0.653547788771],
    ),
];

/// The angle between two orientations by the trace, which the solver does not use.
fn angle_rad(a: &Transform, b: &Transform) -> f64 {
    let trace: f64 =
        (0..3).map(|i| sidestep_kernel::geometry::dot(a.rotation[i], b.rotation[i])).sum();
    acos((0.5 * (trace - 1.0)).clamp(-1.0, 1.0))
}

fn assert_met(arm: &SerialChain, goal: &ArmGoal, values: &[f64]) {
    let tip = arm.forward_kinematics(values).tip;
    assert!(apart_m(tip.origin_m, goal.target.origin_m) <= goal.tolerance_m);
    // The arc cosine of nearly 1 knows half of the digits.
    assert!(angle_rad(&tip, &goal.target) <= goal.tolerance_rad.max(1e-7));
    assert!(arm.outside_limits(values).is_empty());
}

#[test]
fn poses_of_an_independent_library_are_those_of_rpy_quaternion_and_forward_kinematics() {
    let arm = six();
    for (values, xyz_m, rpy_rad, quaternion) in KNOWN {
        let tip = arm.forward_kinematics(&values).tip;
        let by_rpy = Transform::from_urdf_origin(&Origin { xyz_m, rpy_rad });
        let by_quaternion = Transform::from_quaternion("q", xyz_m, quaternion).expect("right");
        for pose in [by_rpy, by_quaternion] {
            assert!(apart_m(pose.origin_m, tip.origin_m) < 1e-11);
            for (row, expected) in pose.rotation.iter().zip(tip.rotation) {
                assert!(apart_m(*row, expected) < 1e-11, "{pose:?} {tip:?}");
            }
        }
        let sign = quaternion[3].signum();
        let back = tip.quaternion();
        assert!((0..4).all(|i| (back[i] - sign * quaternion[i]).abs() < 1e-11), "{back:?}");
    }
}

#[test]
fn poses_of_an_independent_library_are_reached() {
    let arm = six();
    for (_, xyz_m, rpy_rad, _) in KNOWN {
        let goal = ArmGoal::from_pose(Transform::from_urdf_origin(&Origin { xyz_m, rpy_rad }));
        let answer = arm.solve(&goal, &arm.rest_values()).expect("right");
        assert!(answer.reached, "{:?}", answer.reason);
        assert!(answer.error_m <= 1e-6 && answer.error_rad <= 1e-6);
        assert_met(&arm, &goal, &answer.values);
    }
}

#[test]
fn quaternions_of_length_zero_are_refused_and_others_have_length_one() {
    for wrong in [[0.0; 4], [f64::NAN, 0.0, 0.0, 1.0], [f64::INFINITY; 4]] {
        let error = Transform::from_quaternion("--quaternion", [0.0; 3], wrong).expect_err("wrong");
        assert!(error.remedy().contains("scalar last"), "{error}");
    }
    let half = Transform::from_quaternion("q", [0.0; 3], [0.0, 0.0, 5.0, 0.0]).expect("right");
    assert_eq!(half.rotation, [[-1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0]]);
}

proptest! {
    #[test]
    fn poses_that_the_arm_can_take_are_found(
        there in prop::array::uniform6(0.0..1.0f64),
        start in prop::array::uniform6(0.0..1.0f64),
    ) {
        let arm = six();
        let goal = ArmGoal::from_pose(arm.forward_kinematics(&inside(&arm, &there)).tip);
        let answer = arm.solve(&goal, &inside(&arm, &start)).expect("right");
        prop_assert!(answer.reached, "{:?}", answer.reason);
        assert_met(&arm, &goal, &answer.values);
        prop_assert_eq!(&answer, &arm.solve(&goal, &inside(&arm, &start)).expect("right"));
    }

    #[test]
    fn what_is_free_is_free_and_the_rest_is_met(
        there in prop::array::uniform6(0.0..1.0f64),
        off in prop::array::uniform3(-3.0..3.0f64),
        axis in 0usize..3,
    ) {
        let arm = six();
        let tip = arm.forward_kinematics(&inside(&arm, &there)).tip;
        // Turned about the free axis, and shifted along it, which the arm may undo.
        let mut rpy_rad = [0.0; 3];
        rpy_rad[axis] = off[axis];
        let target = tip.compose(&Transform::from_urdf_origin(&Origin { xyz_m: [0.0; 3], rpy_rad }));
        let asked = PoseMask { along: [true; 3], turn: OrientationMask::Axis(FrameAxis::ALL[axis]) };
        let goal = ArmGoal { asked, ..ArmGoal::from_pose(target) };
        let answer = arm.solve(&goal, &arm.rest_values()).expect("right");
        prop_assert!(answer.reached, "{:?}", answer.reason);
        let found = arm.forward_kinematics(&answer.values).tip;
        prop_assert!(apart_m(found.origin_m, target.origin_m) <= 1e-6);
        prop_assert!(apart_m(found.axis(axis), target.axis(axis)) <= 1e-6);
        // Nowhere along x, but turned as the tip was.
        let away = tip.compose(&Transform::from_translation([100.0 * off[0], 0.0, 0.0]));
        let asked = PoseMask { along: [false, true, true], turn: OrientationMask::Whole };
        let answer = arm.solve(&ArmGoal { asked, ..ArmGoal::from_pose(away) }, &arm.rest_values()).expect("right");
        prop_assert!(answer.reached && answer.error_m <= 1e-6, "{:?}", answer.reason);
        prop_assert!(angle_rad(&arm.forward_kinematics(&answer.values).tip, &tip) <= 1e-6);
    }

    #[test]
    fn several_postures_all_reach_the_target_and_differ(there in prop::array::uniform6(0.1..0.9f64)) {
        let arm = six();
        let tip = arm.forward_kinematics(&inside(&arm, &there)).tip;
        let goal = ArmGoal { solutions: 4, apart: 0.2, ..ArmGoal::from_pose(tip) };
        let answer = arm.solve(&goal, &arm.rest_values()).expect("right");
        prop_assert!(answer.reached);
        let all: Vec<&Vec<f64>> =
            std::iter::once(&answer.values).chain(answer.others.iter().map(|p| &p.values)).collect();
        prop_assert!(all.len() <= 4);
        for (i, a) in all.iter().enumerate() {
            assert_met(&arm, &goal, a);
            for b in &all[..i] {
                prop_assert!(a.iter().zip(*b).any(|(a, b)| wrap_angle(a - b).abs() >= 0.2));
            }
        }
        let away = |values: &[f64]| values.iter().zip(arm.rest_values()).map(|(a, b)| (a - b) * (a - b)).sum::<f64>();
        prop_assert!(all.windows(2).all(|pair| away(pair[0]) <= away(pair[1])));
    }

    #[test]
    fn the_nearest_posture_is_no_farther_than_the_one_that_the_target_came_from(
        there in prop::array::uniform6(0.1..0.9f64),
        off in prop::array::uniform6(-0.2..0.2f64),
        whole in any::<bool>(),
    ) {
        let arm = six();
        let values = inside(&arm, &there);
        let start: Vec<f64> = values.iter().zip(off).map(|(v, off)| v + off).collect();
        let asked = if whole { PoseMask::POSE } else { PoseMask::POSITION };
        let tip = arm.forward_kinematics(&values).tip;
        let goal = ArmGoal { nearest: true, restarts: 20, asked, ..ArmGoal::from_pose(tip) };
        let answer = arm.solve(&goal, &start).expect("right");
        prop_assert!(answer.reached && answer.others.is_empty());
        let away = |a: &[f64]| a.iter().zip(&start).map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt();
        prop_assert!(away(&answer.values) <= 1.02 * away(&values) + 1e-5);
    }
}

#[test]
fn full_turns_are_no_posture_of_their_own_and_the_nearest_counts() {
    let arm = arm_of(
        "<robot name='r'><link name='a'/><link name='b'/><link name='c'/>\
         <joint name='i' type='revolute'><parent link='a'/><child link='b'/>\
         <axis xyz='0 0 1'/><limit lower='-6.3' upper='6.3'/></joint>\
         <joint name='j' type='revolute'><parent link='b'/><child link='c'/><origin xyz='1 0 0'/>\
         <axis xyz='0 0 1'/><limit lower='-6.3' upper='6.3'/></joint><link name='t'/>\
         <joint name='k' type='fixed'><parent link='c'/><child link='t'/>\
         <origin xyz='1 0 0'/></joint></robot>",
    );
    let goal = ArmGoal { solutions: 9, ..ArmGoal::new([1.2, 0.3, 0.0]) };
    // Elbow on the left and on the right.
    let answer = arm.solve(&goal, &[6.0, 0.5]).expect("right");
    assert!(answer.reached && answer.others.len() == 1, "{answer:?}");
    assert!((answer.values[0] - 6.0).abs() < std::f64::consts::PI);
}

/// A pose that the arm reaches with one joint slightly beyond its limit: however many joints an unlimited search moves
/// outside, that one is the reason, with its excess, and with what remains within the limits.
#[test]
fn the_nearest_cause_is_the_limit_that_is_missed_by_least() {
    let mut arm = six();
    let beyond = [0.4, 1.25, -0.5, 0.3, 0.6, 0.2];
    // So narrow that no other posture of the elbow or of the wrist is within the limits.
    for (variable, value) in arm.variables.iter_mut().zip(beyond) {
        variable.limits = Some(Limits { lower: value - 0.3, upper: value + 0.3 });
    }
    arm.variables[1].limits = Some(Limits { lower: 0.8, upper: 1.2 });
    let target = arm.forward_kinematics(&beyond).tip;
    let goal = ArmGoal { restarts: 30, ..ArmGoal::from_pose(target) };
    let answer = arm.solve(&goal, &arm.rest_values()).expect("right");
    let Some(IkFailure::OutsideLimits { joint, value, upper, error_m, .. }) = answer.reason else {
        panic!("{:?}", answer.reason)
    };
    assert!(joint == "j2" && (value - upper - 0.05).abs() < 1e-3, "{joint}: {value}");
    assert!((error_m - answer.error_m).abs() < 1e-9 && error_m > 0.0, "{error_m}");
}

#[test]
fn orientations_out_of_reach_are_told_as_such() {
    let arm = six();
    // As far as the arm gets, it points outward.
    let far = arm.forward_kinematics(&[0.0; 6]).tip.origin_m;
    let back = Transform::from_urdf_origin(&Origin { xyz_m: far, rpy_rad: [3.0, 0.0, 0.0] });
    let goal = ArmGoal { ignore_limits: true, restarts: 20, ..ArmGoal::from_pose(back) };
    let answer = arm.solve(&goal, &arm.rest_values()).expect("right");
    assert!(matches!(answer.reason, Some(IkFailure::NotTurned { .. })), "{answer:?}");
    assert!(answer.reason.expect("there").to_string().contains("not turned as asked"));
}

#[test]
fn shared_arms_take_poses_that_they_have_taken() {
    for name in
        ["chain/iiwa7.urdf", "chain/panda.urdf", "chain/ur5.urdf", "z1.urdf", "REU_snake.urdf"]
    {
        let Some(path) = shared(name) else { return };
        let model = Model::load(&path).expect(name);
        let arm = SerialChain::new(&model, model.root, model.default_tip(), "tip").expect("arm");
        for seed in 0..20u32 {
            let share = |k: usize| (f64::from(seed) * 0.37 + k as f64 * 0.618_034).fract();
            let shares: Vec<f64> = (0..arm.variables.len()).map(share).collect();
            let goal = ArmGoal::from_pose(arm.forward_kinematics(&inside(&arm, &shares)).tip);
            let answer = arm.solve(&goal, &arm.rest_values()).expect("right");
            assert!(answer.reached, "{name}: {:?}", answer.reason);
            assert_met(&arm, &goal, &answer.values);
        }
    }
}
