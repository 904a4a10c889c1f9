//! `fk`: forward kinematics of robot models.

use crate::support::TestFolder;
use serde_json::{Value, json};

/// Two links of 1 m in the plane, and a hand that slides out.
const ARM: &str = r#"<robot name="arm">
  <link name="base"/> <link name="upper"/> <link name="lower"/> <link name="hand"/>
  <joint name="shoulder" type="revolute">
    <parent link="base"/> <child link="upper"/>
    <axis xyz="0 0 1"/> <limit lower="-2" upper="2"/>
  </joint>
  <joint name="elbow" type="continuous">
    <parent link="upper"/> <child link="lower"/>
    <origin xyz="1 0 0"/> <axis xyz="0 0 1"/>
  </joint>
  <joint name="slide" type="prismatic">
    <parent link="lower"/> <child link="hand"/>
    <origin xyz="1 0 0"/> <axis xyz="1 0 0"/> <limit lower="0.1" upper="0.5"/>
  </joint>
</robot>
"#;

const SRDF: &str = r#"<robot name="arm">
  <group name="arm"><chain base_link="base" tip_link="hand"/></group>
  <group_state name="bent" group="arm"><joint name="elbow" value="1.5707963267948966"/></group_state>
</robot>
"#;

fn place() -> TestFolder {
    let place = TestFolder::new();
    place.write("arm.urdf", ARM);
    place.write("arm.srdf", SRDF);
    place
}

fn assert_near(found: &Value, expected: [f64; 3]) {
    for (i, expected) in expected.into_iter().enumerate() {
        let found = found[i].as_f64().expect("a number");
        assert!((found - expected).abs() < 1e-6, "{found} is not {expected}");
    }
}

#[test]
fn an_arm_is_drawn_by_fk_and_with_its_target_by_ik() {
    let place = place();
    place.json(&["fk", "arm.urdf", "--joints", "0.3,0.4,0.25", "--png", "fk.png"]);
    place.json(&["ik", "arm.urdf", "--target", "1.2,0.9,0", "--png", "ik.png"]);
    for name in ["fk.png", "ik.png"] {
        let picture = image::open(place.path(name)).expect("a picture").to_rgb8();
        let inked = picture.pixels().filter(|pixel| pixel.0 != [255; 3]).count();
        assert!(inked > 2000, "{name}: only {inked} pixels are drawn");
    }
    let many = ["ik", "arm.urdf", "--targets", "none.csv", "--png", "x.png"];
    assert_eq!(place.run(&many).code(), 2);
}

#[test]
fn tip_joints_and_connectors_are_told() {
    let place = place();
    let fk = place.json(&["fk", "arm.urdf", "--joints", "-1.5707963267948966,0,0.25"]);
    assert_near(&fk["tip"], [0.0, -2.25, 0.0]);
    let connectors = fk["connectors"].as_array().expect("a list");
    assert_eq!(connectors.len(), 3);
    for (found, y) in connectors.iter().zip([0.0, -1.0, -2.25]) {
        assert_near(found, [0.0, y, 0.0]);
    }
    let names: Vec<_> =
        fk["joint_info"].as_array().expect("joints").iter().map(|j| &j["name"]).collect();
    assert_eq!(names, ["shoulder", "elbow", "slide"]);
    assert_eq!(fk["joints"], json!([-std::f64::consts::FRAC_PI_2, 0.0, 0.25]));
    assert_eq!(fk["joint_info"][0]["limits"], json!([-2.0, 2.0]));
    assert_eq!(fk["joint_info"][1]["limits"], Value::Null);
    assert_eq!(
        fk["joint_info"][2],
        json!({"name": "slide", "value": 0.25, "unit": "m", "limits": [0.1, 0.5]})
    );
    assert!((fk["rods"][1]["max_m"].as_f64().expect("a length") - 1.5).abs() < 1e-12);
}

#[test]
fn tips_postures_and_words_for_people() {
    let place = place();
    assert_near(&place.json(&["fk", "arm.urdf", "--tip", "lower"])["tip"], [1.0, 0.0, 0.0]);
    let bent = place.json(&["fk", "arm.urdf", "--posture", "bent", "--srdf", "arm.srdf"]);
    assert_near(&bent["tip"], [1.0, 1.1, 0.0]);
    let text = place.run(&["fk", "arm.urdf"]).out();
    assert!(text.starts_with("arm from base to hand\n"), "{text}");
    assert!(text.contains("no limits") && text.contains("2.100000"), "{text}");
}

#[test]
fn wrong_input_is_answered_with_what_would_be_right() {
    let place = place();
    place.write("arm.xacro", ARM);
    place.write("bad.urdf", ARM.replace("xyz=\"0 0 1\"", "xyz=\"0 0 0\""));
    for (args, reasons) in [
        (&["fk", "arm.urdf", "--joints", "1,2"][..], ["2 values", "shoulder, elbow, slide"]),
        (&["fk", "arm.urdf", "--joints", "1,x,0.2"], ["`x`", "commas"]),
        (&["fk", "arm.urdf", "--joints", "1,NaN,0.2"], ["elbow", "finite"]),
        (&["fk", "arm.urdf", "--tip", "hnad"], ["`hnad`", "`hand`?"]),
        (&["fk", "arm.urdf", "--posture", "bend", "--srdf", "arm.srdf"], ["`bend`", "`bent`?"]),
        (&["fk", "arm.urdf", "--posture", "bent"], ["--srdf", "required"]),
        (&["fk", "arm.xacro"], ["arm.xacro", "expand"]),
        (&["fk", "bad.urdf"], ["bad.urdf:5:16", "0 0 1"]),
        (&["fk", "missing.urdf"], ["missing.urdf", "path"]),
    ] {
        let ended = place.run(args);
        assert_eq!((ended.code(), ended.out().as_str()), (2, ""), "{args:?}");
        assert!(reasons.iter().all(|r| ended.err().contains(r)), "{args:?}: {}", ended.err());
    }
}

#[test]
fn what_limits_forbid_is_computed_with_a_warning() {
    let place = place();
    let beyond = place.run(&["fk", "arm.urdf", "--joints", "2.5,0,3", "--json"]);
    assert_eq!(beyond.code(), 0);
    assert_eq!(beyond.json()["outside_limits"], json!(["shoulder", "slide"]));
    assert!(beyond.err().contains("outside limits: shoulder, slide"), "{}", beyond.err());
    let straight = place.json(&["fk", "arm.urdf", "--joints", "0,0,3"]);
    assert_near(&straight["tip"], [5.0, 0.0, 0.0]);
    let inside = place.run(&["fk", "arm.urdf", "--joints", "0,0,0.3", "--json"]);
    assert_eq!((inside.json()["outside_limits"].clone(), inside.err().as_str()), (json!([]), ""));
}

#[test]
fn groups_and_bases_choose_a_part_of_the_robot() {
    let place = place();
    place.write(
        "parts.srdf",
        r#"<robot name="arm"><group name="upper"><joint name="shoulder"/><joint name="elbow"/></group>
        <group name="end"><joint name="slide"/></group>
        <group name="all"><group name="end"/><group name="upper"/></group></robot>"#,
    );
    let links = |group: &str| {
        let fk = place.json(&["fk", "arm.urdf", "--srdf", "parts.srdf", "--group", group]);
        [fk["base_link"].clone(), fk["tip_link"].clone()]
    };
    assert_eq!(links("upper"), ["base", "lower"]);
    assert_eq!(links("end"), ["lower", "hand"]);
    assert_eq!(links("all"), ["base", "hand"]);
    let from = place.json(&["fk", "arm.urdf", "--base", "lower", "--joints", "0.2"]);
    assert_near(&from["tip"], [1.2, 0.0, 0.0]);
    let backward = place.run(&["fk", "arm.urdf", "--base", "hand", "--tip", "base"]);
    assert_eq!(backward.code(), 2);
}

#[test]
fn shared_models_are_where_others_computed_them() {
    let data = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/data");
    let Ok(text) = std::fs::read_to_string(format!("{data}/expected/urdf.json")) else {
        sidestep_testing::skip("../shared/data is not here");
        return;
    };
    let place = TestFolder::new();
    let all: Value = serde_json::from_str(&text).expect("JSON");
    for (name, expected) in all.as_object().expect("models") {
        let values = expected["q_test"].as_array().expect("values").iter();
        let joints = values.map(Value::to_string).collect::<Vec<_>>().join(",");
        let path = format!("{data}/{name}");
        let tip = expected["tip"].as_str().expect("a link");
        let fk = place.json(&["fk", &path, "--tip", tip, "--joints", &joints]);
        let row = |i: usize| expected["fk_test"][i][3].as_f64().expect("a number");
        assert_near(&fk["tip"], [row(0), row(1), row(2)]);
        assert_eq!(fk["tip_link"], expected["tip"], "{name}");
    }
}
