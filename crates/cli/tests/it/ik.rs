//! `ik`: inverse kinematics of robot models.

use crate::support::TestFolder;
use serde_json::{Value, json};

/// Shoulder (two axes that meet) and elbow: rods of 1 m; the shoulder does not turn all around.
const ARM: &str = r#"<robot name="arm">
  <link name="base"/> <link name="shoulder"/> <link name="upper"/> <link name="lower"/> <link name="hand"/>
  <joint name="yaw" type="revolute">
    <parent link="base"/> <child link="shoulder"/> <axis xyz="0 0 1"/> <limit lower="-1" upper="1"/>
  </joint>
  <joint name="pitch" type="revolute">
    <parent link="shoulder"/> <child link="upper"/> <axis xyz="0 1 0"/> <limit lower="-2" upper="2"/>
  </joint>
  <joint name="elbow" type="revolute">
    <parent link="upper"/> <child link="lower"/> <origin xyz="1 0 0"/> <axis xyz="0 1 0"/>
    <limit lower="-2.5" upper="2.5"/>
  </joint>
  <joint name="mount" type="fixed">
    <parent link="lower"/> <child link="hand"/> <origin xyz="1 0 0"/>
  </joint>
</robot>
"#;

fn place() -> TestFolder {
    let place = TestFolder::new();
    place.write("arm.urdf", ARM);
    place
}

fn numbers(list: &Value) -> Vec<f64> {
    list.as_array().expect("a list").iter().map(|x| x.as_f64().expect("a number")).collect()
}

/// The answer's joint values, as `fk` takes them.
fn joints(found: &Value) -> String {
    let values = found["joints"].as_array().expect("joints").iter();
    values.map(Value::to_string).collect::<Vec<_>>().join(",")
}

fn apart(a: &Value, b: [f64; 3]) -> f64 {
    numbers(a).iter().zip(b).map(|(x, y)| (x - y) * (x - y)).sum::<f64>().sqrt()
}

/// The JSON of an answer that is no.
fn unreached(place: &TestFolder, args: &[&str]) -> Value {
    let mut all = args.to_vec();
    all.push("--json");
    let ended = place.run(&all);
    assert_eq!((ended.code(), ended.err().as_str()), (1, ""), "{args:?}");
    let found = ended.json();
    assert_eq!(found["reached"], json!(false));
    found
}

#[test]
fn joints_fed_to_fk_put_the_tip_at_the_target() {
    let place = place();
    for engine in ["auto", "chain", "dls"] {
        let found = place.json(&["ik", "arm.urdf", "--target", "1.1,0.5,-0.6", "--engine", engine]);
        assert_eq!((&found["reached"], &found["reason"]), (&json!(true), &Value::Null));
        assert!(found["error_m"].as_f64().expect("a number") <= 1e-6);
        let fk = place.json(&["fk", "arm.urdf", "--joints", &joints(&found)]);
        assert!(apart(&fk["tip"], [1.1, 0.5, -0.6]) <= 1e-6, "{engine}");
        assert_eq!(fk["outside_limits"], json!([]));
        assert_eq!(fk["joints"], found["joints"]);
    }
}

#[test]
fn the_same_seed_gives_the_same_answer() {
    let place = place();
    let args = ["ik", "arm.urdf", "--target", "-0.5,0.3,0.8", "--seed", "5", "--json"];
    assert_eq!(place.run(&args).out(), place.run(&args).out());
}

#[test]
fn what_cannot_be_reached_is_told_with_its_reason_and_the_nearest_posture() {
    let place = place();
    let far = unreached(&place, &["ik", "arm.urdf", "--target", "3,0,0"]);
    assert!(far["reason"].as_str().expect("words").contains("reach 2.0"), "{far}");
    assert!((far["error_m"].as_f64().expect("a number") - 1.0).abs() < 1e-3, "{far}");
    assert!(apart(&far["tip"], [2.0, 0.0, 0.0]) < 0.1, "{far}");
    let fk = place.json(&["fk", "arm.urdf", "--joints", &joints(&far)]);
    assert_eq!(fk["tip"], far["tip"]);

    let beside = ["ik", "arm.urdf", "--target", "0,1.9,0"];
    let limited = unreached(&place, &beside);
    assert!(limited["reason"].as_str().expect("words").contains("joint `yaw`"), "{limited}");
    assert_eq!(limited["outside_limits"], json!([]));
    let free = place.json(&[&beside[..], &["--ignore-limits"]].concat());
    let outside = free["outside_limits"].as_array().expect("a list");
    assert!(outside.contains(&json!("yaw")), "{free}");

    let words = place.run(&beside);
    assert_eq!(words.code(), 1);
    assert!(words.out().contains("not reached") && words.out().contains("yaw"), "{}", words.out());
}

#[test]
fn obstacles_are_avoided_or_named() {
    let place = place();
    // The elbow goes up or down; a sphere where it would go one way leaves the other.
    let target = ["ik", "arm.urdf", "--target", "1.4,0,0"];
    let elbow = |found: &Value| numbers(&found["connectors"][1])[2];
    let free = place.json(&target);
    let sphere = format!("0.7,0,{},0.3", 0.714 * elbow(&free).signum());
    let around = place.json(&[&target[..], &["--obstacle", &sphere]].concat());
    assert!(elbow(&around) * elbow(&free) < 0.0, "{around}");
    let both = ["--obstacle", "0.7,0,0.714,0.3", "--obstacle", "0.7,0,-0.714,0.3"];
    let blocked = unreached(&place, &[&target[..], &both[..], &["--restarts", "20"]].concat());
    assert!(blocked["reason"].as_str().expect("words").contains("obstacle"), "{blocked}");
}

#[test]
fn wrong_input_is_answered_with_what_would_be_right() {
    let place = place();
    place.write("arm.xacro", ARM);
    place.write("loop.urdf", ARM.replace(r#"<child link="hand"/>"#, r#"<child link="upper"/>"#));
    let to = ["--target", "1,0,0"];
    for (args, reasons) in [
        (&["ik", "arm.urdf"][..], ["--target", "required"]),
        (&["ik", "arm.urdf", "--target", "1,2"], ["2 of 3", "x,y,z"]),
        (&["ik", "arm.urdf", "--target", "1,NaN,0"], ["NaN", "x,y,z"]),
        (&["ik", "arm.urdf", "--target", "1,inf,0"], ["inf", "x,y,z"]),
        (&["ik", "arm.urdf", "--target", "1,x,0"], ["`x`", "commas"]),
        (&["ik", "arm.urdf", "--target", ""], ["0 of 3", "x,y,z"]),
        (&[&["ik", "arm.xacro"], &to[..]].concat(), ["arm.xacro", "expand"]),
        (&[&["ik", "loop.urdf"], &to[..]].concat(), ["loop.urdf", "upper"]),
        (&[&["ik", "missing.urdf"], &to[..]].concat(), ["missing.urdf", "path"]),
        (&[&["ik", "arm.urdf", "--tip", "hnad"], &to[..]].concat(), ["`hnad`", "`hand`?"]),
        (&[&["ik", "arm.urdf", "--obstacle", "1,2,3"], &to[..]].concat(), ["3 of 4", "radius"]),
        (
            &[&["ik", "arm.urdf", "--obstacle", "1,2,3,-1"], &to[..]].concat(),
            ["negative", "0 or more"],
        ),
        (
            &[&["ik", "arm.urdf", "--tolerance-m", "0"], &to[..]].concat(),
            ["--tolerance-m", "above 0"],
        ),
        (
            &[&["ik", "arm.urdf", "--tolerance-m", "nan"], &to[..]].concat(),
            ["--tolerance-m", "above 0"],
        ),
        (&[&["ik", "arm.urdf", "--engine", "magic"], &to[..]].concat(), ["magic", "chain"]),
        (
            &[&["ik", "arm.urdf", "--joints", "1"], &to[..]].concat(),
            ["1 values", "yaw, pitch, elbow"],
        ),
        (&[&["ik", "arm.urdf", "--group", "arm"], &to[..]].concat(), ["--srdf", "required"]),
    ] {
        let ended = place.run(args);
        assert_eq!((ended.code(), ended.out().as_str()), (2, ""), "{args:?}");
        assert!(reasons.iter().all(|r| ended.err().contains(r)), "{args:?}: {}", ended.err());
    }
}

#[test]
fn shared_arms_reach_where_their_forward_kinematics_has_been() {
    let data = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/data/urdf");
    if std::fs::metadata(data).is_err() {
        sidestep_testing::skip("../shared/data is not here");
        return;
    }
    let place = TestFolder::new();
    for (name, values) in [
        ("chain/iiwa7.urdf", "0.3,-0.6,0.9,1.1,-0.4,0.7,0"),
        ("chain/panda.urdf", "0.3,-0.6,0.9,-1.1,-0.4,0.7,0"),
        ("chain/ur5.urdf", "0.3,-0.6,0.9,1.1,-0.4,0.7"),
        ("z1.urdf", "0.3,0.6,-0.9,0.5,-0.4,0.7"),
        ("pendulum5.urdf", "0.3,-0.6,0.9,1.1,-0.4"),
    ] {
        let path = format!("{data}/{name}");
        let tip = numbers(&place.json(&["fk", &path, "--joints", values])["tip"]);
        let target = tip.iter().map(f64::to_string).collect::<Vec<_>>().join(",");
        let found = place.json(&["ik", &path, "--target", &target]);
        assert_eq!((&found["reached"], &found["outside_limits"]), (&json!(true), &json!([])));
        let fk = place.json(&["fk", &path, "--joints", &joints(&found)]);
        assert!(apart(&fk["tip"], [tip[0], tip[1], tip[2]]) <= 1e-6, "{name}");
    }
}
