use std::f64::consts::{FRAC_PI_2, PI};

use proptest::prelude::*;

use super::*;
use sidestep_import::urdf::Model;
use sidestep_kernel::geometry::{dot, norm, sub};
use sidestep_testing::{ROBOT_MODELS as SHARED, robot_model as shared};

fn chain_of(model: &Model, tip: Option<&str>) -> SerialChain {
    let tip = tip.map_or(model.default_tip(), |name| model.link("tip", name).expect("a link"));
    SerialChain::new(model, model.root, tip, "tip").expect("a chain")
}

fn shared_chain(name: &str, tip: Option<&str>) -> Option<SerialChain> {
    let model = Model::load(&shared(name)?).expect(name);
    Some(chain_of(&model, tip))
}

/// Kind, xyz, rpy, axis and limits of a joint.
type Row = (&'static str, [f64; 3], [f64; 3], [f64; 3], [f64; 2]);

/// A robot of a serial chain.
fn serial(joints: &[Row]) -> SerialChain {
    let words = |v: &[f64; 3]| format!("{} {} {}", v[0], v[1], v[2]);
    let mut text = String::from("<robot name='r'><link name='l0'/>");
    for (i, (kind, xyz, rpy, axis, [lower, upper])) in joints.iter().enumerate() {
        text += &format!(
            "<link name='l{}'/><joint name='j{i}' type='{kind}'><parent link='l{i}'/>\
             <child link='l{}'/><origin xyz='{}' rpy='{}'/><axis xyz='{}'/>\
             <limit lower='{lower}' upper='{upper}'/></joint>",
            i + 1,
            i + 1,
            words(xyz),
            words(rpy),
            words(axis)
        );
    }
    chain_of(&Model::parse("r", &(text + "</robot>")).expect("a model"), None)
}

const X: [f64; 3] = [1.0, 0.0, 0.0];
const Y: [f64; 3] = [0.0, 1.0, 0.0];
const Z: [f64; 3] = [0.0, 0.0, 1.0];
const O: [f64; 3] = [0.0; 3];
const TURN: [f64; 2] = [-3.0, 3.0];

fn assert_near(found: Vector, expected: Vector, tolerance: f64) {
    assert!(norm(sub(found, expected)) <= tolerance, "{found:?} is not {expected:?}");
}

#[test]
fn hand_computed_poses() {
    let planar = serial(&[
        ("revolute", O, O, Z, TURN),
        ("revolute", X, O, Z, TURN),
        ("fixed", X, O, X, TURN),
    ]);
    assert_near(planar.forward_kinematics(&[0.0, 0.0]).tip.origin_m, [2.0, 0.0, 0.0], 1e-15);
    assert_near(
        planar.forward_kinematics(&[FRAC_PI_2, -FRAC_PI_2]).tip.origin_m,
        [1.0, 1.0, 0.0],
        1e-15,
    );
    // Roll first, then pitch, then yaw about fixed axes: x goes to y, y to z, z to x.
    let turned =
        serial(&[("prismatic", [0.0, 0.0, 1.0], [FRAC_PI_2, 0.0, FRAC_PI_2], X, [0.0, 1.0])]);
    assert_near(turned.forward_kinematics(&[0.5]).tip.origin_m, [0.0, 0.5, 1.0], 1e-15);
    assert_near(turned.forward_kinematics(&[0.5]).tip.transform_direction(Y), Z, 1e-15);
}

#[test]
fn forward_kinematics_agrees_with_the_oracle() {
    let Some(path) = shared("../expected/urdf.json") else { return };
    let text = std::fs::read_to_string(path).expect("readable");
    let all: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    for (name, expected) in all.as_object().expect("an object") {
        let chain = shared_chain(name.trim_start_matches("urdf/"), expected["tip"].as_str())
            .expect("the file");
        assert_eq!(expected["tip"], chain.tip.as_str(), "{name}");
        let names: Vec<&str> = chain.variables.iter().map(|v| v.name.as_str()).collect();
        assert_eq!(expected["chain_movable"], serde_json::json!(names), "{name}");
        let q_test: Vec<f64> = serde_json::from_value(expected["q_test"].clone()).expect("numbers");
        for (values, key) in [(vec![0.0; names.len()], "fk_zero"), (q_test, "fk_test")] {
            let rows: Vec<[f64; 4]> = serde_json::from_value(expected[key].clone()).expect("rows");
            let tip = chain.forward_kinematics(&values).tip;
            for (i, row) in rows[..3].iter().enumerate() {
                assert_near(tip.rotation[i], [row[0], row[1], row[2]], 2e-6);
                assert!((tip.origin_m[i] - row[3]).abs() < 1e-6, "{name} {key}: {tip:?}");
            }
        }
    }
}

#[test]
fn every_shared_arm_has_rods_of_its_lengths_in_every_posture() {
    for name in SHARED {
        let Some(chain) = shared_chain(name, None) else { return };
        let skeleton = chain.skeleton();
        for seed in 0..50 {
            let values = posture(&chain, seed);
            let frames = chain.forward_kinematics(&values);
            check_rotation(&frames.tip);
            let connectors = chain.connector_positions(&skeleton, &frames);
            assert_near(connectors[connectors.len() - 1], frames.tip.origin_m, 1e-9);
            for (pair, rod) in connectors.windows(2).zip(&skeleton.rods) {
                let length_m = norm(sub(pair[1], pair[0]));
                let range = rod.min_m - 1e-9..=rod.max_m + 1e-9;
                assert!(range.contains(&length_m), "{name}: {length_m} {rod:?}");
                assert!(rod.max_m > 1e-6, "{name}: {rod:?}");
            }
        }
    }
}

fn check_rotation(pose: &Transform) {
    let [x, y, z] = pose.rotation;
    for (a, b, expected) in
        [(x, x, 1.0), (y, y, 1.0), (z, z, 1.0), (x, y, 0.0), (y, z, 0.0), (z, x, 0.0)]
    {
        assert!((dot(a, b) - expected).abs() < 1e-12, "{pose:?}");
    }
}

/// Values inside the limits, from golden-ratio steps.
fn posture(chain: &SerialChain, seed: u32) -> Vec<f64> {
    let share =
        |k: usize| (0.5 + (f64::from(seed) * 1.7 + k as f64 + 1.0) * 0.618_033_988_75).fract();
    let value = |(k, v): (usize, &Dof)| {
        let (lower, upper) = v.limits.map_or((-PI, PI), |l| (l.lower, l.upper));
        lower + share(k) * (upper - lower)
    };
    chain.variables.iter().enumerate().map(value).collect()
}

fn rod_lengths(skeleton: &Skeleton) -> Vec<f64> {
    skeleton.rods.iter().map(|rod| (rod.max_m * 1e4).round() / 1e4).collect()
}

#[test]
fn connectors_are_where_axes_meet_and_not_the_origins_of_joints() {
    let Some(iiwa) = shared_chain("chain/iiwa7.urdf", None) else { return };
    let skeleton = iiwa.skeleton();
    let connectors = iiwa.connector_positions(&skeleton, &iiwa.forward_kinematics(&[0.0; 7]));
    let expected = [0.34, 0.74, 1.14, 1.266].map(|z| [0.0, 0.0, z]);
    assert_eq!(connectors.len(), 4);
    for (found, expected) in connectors.iter().zip(expected) {
        assert_near(*found, expected, 1e-12);
    }
    assert_eq!(rod_lengths(&skeleton), [0.4, 0.4, 0.126]);

    let panda = shared_chain("chain/panda.urdf", Some("panda_link8")).expect("there");
    let skeleton = panda.skeleton();
    assert_eq!(rod_lengths(&skeleton), [0.3266, 0.3928, 0.1385]);
    assert_eq!(
        shared_chain("chain/snake16_own.urdf", None).expect("there").skeleton().rods.len(),
        16
    );
}

#[test]
fn iiwa_limits_of_even_joints_are_exact_bend_limits() {
    let Some(iiwa) = shared_chain("chain/iiwa7.urdf", None) else { return };
    let skeleton = iiwa.skeleton();
    assert_near(skeleton.base_direction.expect("axis 1"), Z, 1e-12);
    let limits = iiwa.bend_limits(&skeleton);
    // The soft limits of the model, two degrees inside its limits.
    for (limit, joint) in limits.iter().zip(["iiwa_joint_2", "iiwa_joint_4", "iiwa_joint_6"]) {
        let limit = limit.as_ref().expect("a limit");
        assert_eq!((limit.joint.as_str(), limit.is_exact), (joint, true));
        assert!((limit.max_bend_rad - 2.059_488_517_353_308_6).abs() < 1e-9, "{limit:?}");
    }
    assert_eq!(limits[3], None);
    let panda = shared_chain("chain/panda.urdf", Some("panda_link8")).expect("there");
    let elbow = panda.bend_limits(&panda.skeleton())[1].clone().expect("joint 4 alone");
    assert_eq!((elbow.joint.as_str(), elbow.is_exact), ("panda_joint4", false));
}

#[test]
fn a_prismatic_joint_is_a_rod_of_variable_length_also_off_its_axis() {
    let along = serial(&[
        ("revolute", O, O, Z, TURN),
        ("prismatic", [0.3, 0.0, 0.0], O, X, [-0.1, 0.4]),
        ("revolute", [0.2, 0.0, 0.0], O, Z, TURN),
        ("fixed", X, O, X, TURN),
    ]);
    let skeleton = along.skeleton();
    let lengths: Vec<[f64; 2]> = skeleton.rods.iter().map(|r| [r.min_m, r.max_m]).collect();
    assert_eq!(lengths.len(), 2);
    assert!((lengths[0][0] - 0.4).abs() < 1e-12 && (lengths[0][1] - 0.9).abs() < 1e-12);
    let offset = serial(&[
        ("revolute", O, O, Z, TURN),
        ("prismatic", [0.3, 0.0, 0.0], O, X, [-1.0, 0.4]),
        ("fixed", [0.2, 0.5, 0.0], O, X, TURN),
    ]);
    let rod = offset.skeleton().rods[0];
    assert!((rod.min_m - 0.5).abs() < 1e-12, "{rod:?}: the tip passes the foot at q = -0.5");
    assert!((rod.max_m - (0.25 + 0.81f64).sqrt()).abs() < 1e-12, "{rod:?}");
}

fn check_recovery(chain: &SerialChain, values: &[f64], reference: &[f64]) -> RecoveredJoints {
    let skeleton = chain.skeleton();
    let connectors = chain.connector_positions(&skeleton, &chain.forward_kinematics(values));
    let found =
        chain.recover_joint_values(&skeleton, &connectors, reference).expect("joint values");
    assert!(found.residual_m < 1e-9, "{values:?}: {found:?}");
    chain.check_limits("recovered", &found.values).expect("inside the limits");
    found
}

#[test]
fn joint_values_come_back_from_connectors_where_they_are_determined() {
    let arms = [
        ("chain/iiwa7.urdf", None),
        ("iiwa14_primitive_collision.urdf", None),
        ("chain/ur5.urdf", None),
        ("chain/snake16_own.urdf", None),
        ("RSNAKE_snake.urdf", None),
        ("REU_snake.urdf", None),
        ("z1.urdf", None),
        ("pendulum5.urdf", None),
    ];
    for (name, tip) in arms {
        let Some(chain) = shared_chain(name, tip) else { return };
        for seed in 0..200 {
            let values = posture(&chain, seed);
            let found = check_recovery(&chain, &values, &values);
            for (found, expected) in found.values.iter().zip(&values) {
                assert!((found - expected).abs() < 1e-6, "{name}: {found} is not {expected}");
            }
        }
    }
}

#[test]
fn straight_arms_are_recovered_too() {
    for name in ["chain/iiwa7.urdf", "chain/ur5.urdf"] {
        let Some(chain) = shared_chain(name, None) else { return };
        let rest = chain.rest_values();
        let found = check_recovery(&chain, &rest, &rest);
        assert!(!found.open.is_empty(), "{found:?}");
        let mut other = rest.clone();
        other[0] = 0.7;
        check_recovery(&chain, &rest, &other);
    }
}

#[test]
fn what_cannot_be_recovered_has_a_reason() {
    let Some(panda) = shared_chain("chain/panda.urdf", Some("panda_link8")) else { return };
    let skeleton = panda.skeleton();
    let values = panda.rest_values();
    let connectors = panda.connector_positions(&skeleton, &panda.forward_kinematics(&values));
    let error = panda.recover_joint_values(&skeleton, &connectors, &values).expect_err("offsets");
    assert!(
        matches!(&error, RecoverError::Coupled { connector: 1, joints } if joints.len() == 3),
        "{error}"
    );

    let iiwa = shared_chain("chain/iiwa7.urdf", None).expect("there");
    let skeleton = iiwa.skeleton();
    let mut bent = [0.0; 7];
    bent[3] = 2.5;
    let connectors = iiwa.connector_positions(&skeleton, &iiwa.forward_kinematics(&bent));
    let error = iiwa.recover_joint_values(&skeleton, &connectors, &[0.0; 7]).expect_err("a limit");
    assert!(
        matches!(&error, RecoverError::OutsideLimits { joint, .. } if joint == "iiwa_joint_4"),
        "{error}"
    );
    bent[3] = 1.5;
    let mut torn = iiwa.connector_positions(&skeleton, &iiwa.forward_kinematics(&bent));
    torn[2][0] += 0.1;
    let error = iiwa.recover_joint_values(&skeleton, &torn, &[0.0; 7]).expect_err("torn");
    assert!(matches!(error, RecoverError::DoesNotFit { connector: 2, .. }), "{error}");
    torn[2][0] = f64::NAN;
    assert!(iiwa.recover_joint_values(&skeleton, &torn, &[0.0; 7]).is_err());
    assert!(iiwa.recover_joint_values(&skeleton, &connectors[1..], &[0.0; 7]).is_err());
}

#[test]
fn mimic_joints_follow_their_driver() {
    let Some(hand) = shared_chain("chain/panda.urdf", Some("panda_rightfinger")) else { return };
    assert_eq!(hand.variables.last().expect("eight").name, "panda_finger_joint1");
    assert_eq!(hand.variables.len(), 8);
    let mut values = hand.rest_values();
    let closed = hand.forward_kinematics(&values).tip.origin_m;
    values[7] = 0.03;
    assert!(
        (norm(sub(hand.forward_kinematics(&values).tip.origin_m, closed)) - 0.03).abs() < 1e-12
    );
    let skeleton = hand.skeleton();
    let connectors = hand.connector_positions(&skeleton, &hand.forward_kinematics(&values));
    assert!(hand.recover_joint_values(&skeleton, &connectors, &values).is_err());
}

#[test]
fn an_arm_without_joints_is_one_rod_or_one_point() {
    let rod = serial(&[("fixed", X, O, X, TURN)]);
    assert_eq!(rod_lengths(&rod.skeleton()), [1.0]);
    assert_eq!(serial(&[("fixed", O, O, X, TURN)]).skeleton().rods, []);
}

#[test]
fn wrong_values_are_errors_that_name_the_joints() {
    let arm = serial(&[("revolute", O, O, Z, TURN), ("revolute", X, O, Z, TURN)]);
    let error = arm.check_joint_values("--joints", &[1.0]).expect_err("one too few");
    assert!(error.remedy().contains("j0, j1"), "{error}");
    let error = arm.check_limits("--joints", &[1.0, 3.5]).expect_err("outside");
    assert!(error.cause().contains("`j1`") && error.remedy().contains("-3 and 3"), "{error}");
    assert!(arm.check_joint_values("--joints", &[1.0, f64::NAN]).is_err());
}

fn vector() -> impl Strategy<Value = [f64; 3]> {
    proptest::array::uniform3(-1.0..1.0f64)
}

proptest! {
    #[test]
    fn random_arms_keep_their_rods(
        joints in prop::collection::vec((vector(), vector(), vector(), any::<bool>()), 1..9),
        values in prop::collection::vec(-2.0..2.0f64, 9),
    ) {
        let unit = |a: [f64; 3]| if norm(a) < 0.1 { Z } else { a };
        let kind = |slides: bool| if slides { "prismatic" } else { "revolute" };
        let rows: Vec<_> =
            joints.iter().map(|&(xyz, rpy, axis, s)| (kind(s), xyz, rpy, unit(axis), [-2.0, 2.0])).collect();
        let chain = serial(&rows);
        let skeleton = chain.skeleton();
        let frames = chain.forward_kinematics(&values[..joints.len()]);
        let connectors = chain.connector_positions(&skeleton, &frames);
        prop_assert_eq!(connectors.len(), skeleton.rods.len() + 1);
        for (pair, rod) in connectors.windows(2).zip(&skeleton.rods) {
            let length_m = norm(sub(pair[1], pair[0]));
            prop_assert!(rod.min_m - 1e-7 <= length_m && length_m <= rod.max_m + 1e-7, "{} {:?}", length_m, rod);
        }
    }

    #[test]
    fn iiwa_connectors_give_joints_that_give_the_connectors(
        shares in prop::collection::vec(0.0..1.0f64, 7),
        reference in prop::collection::vec(0.0..1.0f64, 7),
    ) {
        let Some(chain) = shared_chain("chain/iiwa7.urdf", None) else { return Ok(()) };
        let at = |shares: &[f64]| -> Vec<f64> {
            let limits = chain.variables.iter().map(|v| v.limits.expect("limits"));
            limits.zip(shares).map(|(l, s)| l.lower + s * (l.upper - l.lower)).collect()
        };
        let (values, reference) = (at(&shares), at(&reference));
        let skeleton = chain.skeleton();
        let connectors = chain.connector_positions(&skeleton, &chain.forward_kinematics(&values));
        let found = chain.recover_joint_values(&skeleton, &connectors, &reference).expect("joint values");
        prop_assert!(found.residual_m < 1e-9);
        let again = chain.connector_positions(&skeleton, &chain.forward_kinematics(&found.values));
        for (a, b) in again.iter().zip(&connectors) {
            prop_assert!(norm(sub(*a, *b)) < 1e-9);
        }
    }
}

/// An arm with a second joint that mimics the first, with an offset, and a third joint with a limit and a velocity.
fn mimic(
    [offset, multiplier, upper, velocity]: [&str; 4],
) -> Result<Model, sidestep_kernel::InputError> {
    let text = format!(
        "<robot name='m'><link name='l0'/><link name='l1'/><link name='l2'/><link name='l3'/><link name='l4'/>
        <joint name='a' type='continuous'><parent link='l0'/><child link='l1'/><axis xyz='0 0 1'/></joint>
        <joint name='b' type='prismatic'><parent link='l1'/><child link='l2'/><origin xyz='0.5 0 0'/>\
        <axis xyz='1 0 0'/><limit lower='-1' upper='0'/>\
        <mimic joint='a' multiplier='{multiplier}' offset='{offset}'/></joint>
        <joint name='c' type='revolute'><parent link='l2'/><child link='l3'/>\
        <origin xyz='0 0.5 0.3' rpy='0.3 0.3 0.5'/><axis xyz='0 0 1'/>\
        <limit lower='-1' upper='{upper}' velocity='{velocity}'/></joint>
        <joint name='d' type='prismatic'><parent link='l3'/><child link='l4'/><origin xyz='0.8 0 0.5'/>\
        <axis xyz='0 1 0'/><limit lower='0' upper='1' velocity='1'/></joint></robot>"
    );
    Model::parse("m.urdf", &text)
}

#[test]
fn numbers_of_joints_that_no_robot_has_are_refused_at_their_place() {
    let usual = ["0.1", "-1", "1", "1"];
    mimic(usual).expect("usual numbers");
    for k in [0, 1] {
        let mut numbers = usual;
        numbers[k] = "1e300";
        let error = mimic(numbers).expect_err("an absurd number");
        assert_eq!(error.cause(), "1e300 is beyond 1e6");
        assert_eq!(error.line_and_column().map(|(line, _)| line), Some(3), "{error}");
    }
    // As a limit or a velocity such a number says that there is none.
    let unlimited = mimic(["0.1", "-1", "1e300", "1e300"]).expect("no limit");
    assert_eq!(unlimited.joints[2].max_speed, None);
    assert_eq!(unlimited.report.findings.len(), 2);
}

#[test]
fn arms_far_from_their_base_have_connectors_from_base_to_tip() {
    for offset in ["1e3", "1e4", "1e5", "1e6", "-1e6", "123456.789"] {
        let arm = chain_of(&mimic([offset, "-1", "1", "1"]).expect("a model"), None);
        let skeleton = arm.skeleton();
        let places =
            arm.connector_positions(&skeleton, &arm.forward_kinematics(&arm.rest_values()));
        assert_eq!(places.len(), skeleton.rods.len() + 1, "{offset}");
        assert!(places.iter().flatten().all(|x| x.is_finite()), "{offset}");
    }
}
