use super::srdf::Semantics;
use super::*;
use sidestep_testing::{ROBOT_MODELS as SHARED, robot_model as shared};

pub(crate) const ARM: &str = r#"<robot name="arm">
  <link name="base"/>
  <link name="upper"/>
  <link name="hand"/>
  <joint name="shoulder" type="revolute">
    <parent link="base"/><child link="upper"/>
    <axis xyz="0 0 1"/><limit lower="-1" upper="2"/>
  </joint>
  <joint name="wrist" type="fixed">
    <parent link="upper"/><child link="hand"/>
    <origin xyz="1 0 0"/><axis xyz="0 0 0"/>
  </joint>
</robot>
"#;

fn error_of(old: &str, new: &str) -> InputError {
    assert!(ARM.contains(old), "{old}");
    Model::parse("arm.urdf", &ARM.replacen(old, new, 1)).expect_err(new)
}

#[test]
fn a_small_arm_is_read_with_all_defaults() {
    let arm = Model::parse("arm.urdf", ARM).expect("a model");
    assert_eq!(arm.links, ["base", "upper", "hand"]);
    assert_eq!((arm.root, arm.default_tip()), (0, 2));
    let [shoulder, wrist] = &arm.joints[..] else { panic!("two joints") };
    assert_eq!(shoulder.axis, [0.0, 0.0, 1.0]);
    assert_eq!(shoulder.origin, Origin::default());
    assert_eq!(shoulder.limits, Some(Limits { lower: -1.0, upper: 2.0 }));
    assert_eq!((wrist.kind, wrist.limits), (JointKind::Fixed, None));
    assert_eq!(arm.joint_path(0, 2), Some(vec![0, 1]));
    assert_eq!(arm.joint_path(2, 0), None);
}

#[test]
fn every_wrong_thing_is_named_with_its_place_and_what_would_be_right() {
    let cases = [
        ("child link=\"hand\"", "child link=\"hnad\"", 10, "hnad", "`hand`?"),
        ("\"0 0 1\"", "\"0 0 0\"", 7, "no direction", "0 0 1"),
        ("\"0 0 1\"", "\"0 NaN 1\"", 7, "`NaN`", "number"),
        ("\"0 0 1\"", "\"0 1\"", 7, "2 numbers", "three"),
        ("lower=\"-1\"", "lower=\"3\"", 7, "above", "smaller"),
        ("<limit lower=\"-1\" upper=\"2\"/>", "", 5, "lacks <limit>", "add <limit"),
        ("revolute", "revolut", 5, "revolut", "`revolute`?"),
        ("<parent link=\"base\"/>", "", 5, "lacks <parent>", "add <parent"),
        ("link name=\"hand\"", "link name=\"base\"", 4, "second link", "own"),
        ("joint name=\"wrist\"", "joint name=\"shoulder\"", 9, "second joint", "own"),
        ("parent link=\"upper\"", "parent link=\"hand\"", 9, "loop", "base"),
        ("child link=\"hand\"", "child link=\"upper\"", 9, "hangs on joint", "tree"),
        ("child link=\"hand\"", "child link=\"base\"", 9, "loop", "tree"),
        ("<robot", "<sdf", 13, "closes", "</sdf>"),
        ("xyz=\"1 0 0\"", "xyz=\"1e9 0 0\"", 11, "1e6", "meters"),
        ("xyz=\"1 0 0\"", "xyz=\"${x} 0 0\"", 11, "xacro", "xacro FILE"),
        ("<axis xyz=\"0 0 1\"/>", "<mimic joint=\"shoulder\"/>", 5, "circle", "<mimic>"),
        ("<axis xyz=\"0 0 1\"/>", "<mimic joint=\"wrist\"/>", 7, "cannot move", "value"),
        ("<axis xyz=\"0 0 1\"/>", "<mimic joint=\"wirst\"/>", 7, "wirst", "`wrist`?"),
    ];
    for (old, new, line, cause, remedy) in cases {
        let error = error_of(old, new);
        assert_eq!(error.line_and_column().map(|p| p.0), Some(line), "{error}");
        assert!(error.cause().contains(cause) && error.remedy().contains(remedy), "{error}");
    }
    assert_eq!(error_of("\"0 0 1\"", "\"0 0 0\"").line_and_column(), Some((7, 16)));
    let circle = ARM.replace("<link name=\"hand\"/>", "").replace("\"hand\"", "\"base\"");
    let error = Model::parse("arm.urdf", &circle).expect_err("no root");
    assert!(error.cause().contains("every link hangs on another"), "{error}");
}

#[test]
fn xacro_is_refused_and_its_unused_prefix_is_not() {
    let unused = ARM.replace("name=\"arm\"", "name=\"arm\" xmlns:xacro=\"http://ros.org/xacro\"");
    assert!(Model::parse("f", &unused).is_ok());
    let used = unused.replace("<link name=\"hand\"/>", "<xacro:hand/>");
    let undeclared = ARM.replace("<link name=\"hand\"/>", "<xacro:hand/>");
    for text in [used, undeclared] {
        let error = Model::parse("f", &text).expect_err("xacro");
        assert!(error.cause().contains("xacro") && error.line_and_column().is_some(), "{error}");
        assert!(error.remedy().contains("xacro FILE"), "{error}");
    }
    assert!(
        Model::load(std::path::Path::new("a.urdf.xacro")).is_err_and(|e| e.cause() == xacro::CAUSE)
    );
}

#[test]
fn other_elements_prefixes_and_missing_meshes_do_not_matter() {
    let link = r#"<link name="hand"><visual><geometry>
        <mesh filename="package://no/such.stl"/></geometry></visual>
        <d:proximity xmlns:d="http://drake.mit.edu"/></link><gazebo/><transmission name="t"/>"#;
    let text = ARM.replace("<link name=\"hand\"/>", link);
    let model = Model::parse("f", &text).expect("a model");
    let arm = Model::parse("f", ARM).expect("a model");
    assert_eq!(
        findings(&model),
        [
            "not used: elements <gazebo>, line 6",
            "not used: elements <transmission>, line 6",
            "not used: elements <d:proximity> of links, line 6",
        ]
    );
    assert_eq!(Model { report: arm.report.clone(), ..model }, arm);
}

fn findings(model: &Model) -> Vec<String> {
    model.report.findings.iter().map(ToString::to_string).collect()
}

#[test]
fn a_link_without_joints_is_left_out_and_said_and_a_second_robot_is_refused() {
    let arm = Model::parse("f", ARM).expect("a model");
    let solid = "<link name=\"floor\"><collision><geometry><sphere radius=\"1\"/></geometry></collision></link>";
    for before in ["<link name=\"base\"/>", "<link name=\"hand\"/>", "<joint name=\"shoulder\""] {
        let model = Model::parse("f", &ARM.replace(before, &format!("{solid}{before}")));
        let model = model.expect("a model");
        let findings = findings(&model);
        assert!(findings[0].starts_with("dropped: links that no joint connects"), "{findings:?}");
        assert!(findings[0].contains("`floor` at line"), "{findings:?}");
        assert_eq!(Model { report: arm.report.clone(), ..model }, arm);
    }
    let error = error_of(
        "</robot>",
        "<link name=\"x\"/><link name=\"y\"/><joint name=\"j\" type=\"fixed\"><parent link=\"x\"/>\
         <child link=\"y\"/></joint></robot>",
    );
    assert_eq!(error.line_and_column(), Some((13, 1)), "{error}");
    assert!(error.cause().contains("2 links hang on nothing: `base`, `x`"), "{error}");
    assert!(error.remedy().contains("joints"), "{error}");
    let none = "<robot name=\"r\"><link name=\"a\"/><link name=\"b\"/></robot>";
    assert!(Model::parse("f", none).is_err());
}

#[test]
fn a_default_namespace_changes_nothing() {
    let arm = Model::parse("f", ARM).expect("a model");
    for address in ["http://www.ros.org", "http://drake.mit.edu", "http://ros.org/wiki/xacro"] {
        let text = ARM.replace("name=\"arm\"", &format!("name=\"arm\" xmlns=\"{address}\""));
        assert_eq!(Model::parse("f", &text).expect("a model"), arm, "{address}");
    }
    // Elements of another program stay out, even where their prefix stands for the default namespace.
    let text = ARM
        .replace("name=\"arm\"", "name=\"arm\" xmlns=\"http://d\" xmlns:d=\"http://d\"")
        .replace("</robot>", "<d:joint name=\"x\" type=\"gear\"/></robot>");
    let model = Model::parse("f", &text).expect("a model");
    assert_eq!(model.joints, arm.joints);
    assert_eq!(findings(&model), ["not used: elements <d:joint>, line 13"]);
}

/// Returns the small arm with another `<limit>`.
fn with_limit(limit: &str) -> Model {
    let text = ARM.replace("<limit lower=\"-1\" upper=\"2\"/>", limit);
    Model::parse("f", &text).expect(limit)
}

#[test]
fn numbers_that_stand_for_no_limit_are_none_and_said() {
    const UNLIMITED: &str = "repaired: limits beyond 1e6, which are none (2 times), line 7";
    for infinity in ["1e+16", "1e16", "1.79769e+308", "1.8e308", "inf", "3.4e38", "1e10"] {
        let model = with_limit(&format!("<limit lower=\"-{infinity}\" upper=\"{infinity}\"/>"));
        assert_eq!(model.joints[0].limits, None, "{infinity}");
        assert_eq!(findings(&model), [UNLIMITED]);
    }
    // One end alone.
    let model = with_limit("<limit lower=\"-1e16\" upper=\"2\"/>");
    assert_eq!(model.joints[0].limits, Some(Limits { lower: -1e6, upper: 2.0 }));
    let speeds = [
        ("-1", "repaired: a velocity below 0"),
        ("-1e16", "repaired: a velocity below 0"),
        ("1.79769e+308", "repaired: a velocity beyond 1e6"),
        ("1.8e308", "repaired: a velocity beyond 1e6"),
        ("0", "guessed: a velocity of 0"),
    ];
    for (speed, finding) in speeds {
        let limit = format!("<limit lower=\"-1\" upper=\"2\" effort=\"-1\" velocity=\"{speed}\"/>");
        let model = with_limit(&limit);
        assert_eq!(model.joints[0].max_speed, None, "{speed}");
        assert_eq!(model.joints[0].limits, Some(Limits { lower: -1.0, upper: 2.0 }));
        assert!(findings(&model)[0].starts_with(finding), "{:?}", findings(&model));
    }
    let model = with_limit("<limit lower=\"-1\" upper=\"2\" velocity=\"3\"/>");
    assert_eq!(model.joints[0].max_speed, Some(3.0));
    assert_eq!(findings(&model), [""; 0]);
    let wrong = [
        ("lower=\"1e16\" upper=\"1e16\"", "above"),
        ("lower=\"1e16\" upper=\"-1e16\"", "above"),
        ("lower=\"nan\" upper=\"1\"", "`nan`"),
        ("lower=\"-1\" upper=\"1\" velocity=\"nan\"", "`nan`"),
    ];
    for (limit, cause) in wrong {
        let error = error_of("lower=\"-1\" upper=\"2\"", limit);
        assert!(error.cause().contains(cause), "{error}");
    }
}

#[test]
fn soft_limits_narrow_the_limits_of_a_joint() {
    const HARD: &str = "<limit lower=\"-1\" upper=\"2\"/>";
    let both = |lower: f64, upper: f64| Some(Limits { lower, upper });
    let cases = [
        (
            HARD,
            "k_position=\"20\" soft_lower_limit=\"-0.5\" soft_upper_limit=\"0.5\"",
            both(-0.5, 0.5),
            "",
        ),
        (HARD, "soft_lower_limit=\"-0.5\" soft_upper_limit=\"3\"", both(-0.5, 2.0), ""),
        (HARD, "soft_lower_limit=\"-1\" soft_upper_limit=\"2\"", both(-1.0, 2.0), ""),
        (
            HARD,
            "soft_lower_limit=\"-1e16\" soft_upper_limit=\"1e16\"",
            both(-1.0, 2.0),
            "repaired: limits",
        ),
        (HARD, "k_velocity=\"20\"", both(-1.0, 2.0), ""),
        (
            HARD,
            "soft_lower_limit=\"0\" soft_upper_limit=\"0\"",
            both(-1.0, 2.0),
            "not used: soft limits",
        ),
        (HARD, "soft_upper_limit=\"1\"", both(0.0, 1.0), "suspicious: soft limits of which one"),
        (
            "<limit lower=\"-1e16\" upper=\"1e16\"/>",
            "soft_lower_limit=\"-3\" soft_upper_limit=\"3\"",
            both(-3.0, 3.0),
            "repaired: limits",
        ),
    ];
    for (hard, soft, limits, finding) in cases {
        let model = with_limit(&format!("{hard}<safety_controller {soft}/>"));
        assert_eq!(model.joints[0].limits, limits, "{soft}");
        let findings = findings(&model);
        assert!(findings.first().map_or("", String::as_str).starts_with(finding), "{findings:?}");
        assert_eq!(findings.is_empty(), finding.is_empty(), "{findings:?}");
    }
    for (soft, cause) in [
        ("soft_lower_limit=\"3\" soft_upper_limit=\"4\"", "3 to 4 leave nothing of -1 to 2"),
        ("soft_lower_limit=\"1\" soft_upper_limit=\"-1\"", "above"),
    ] {
        let error = error_of("upper=\"2\"/>", &format!("upper=\"2\"/><safety_controller {soft}/>"));
        assert!(error.cause().contains(cause), "{error}");
    }
    // A continuous joint turns without end.
    let text = ARM.replace("revolute", "continuous").replace(
        "lower=\"-1\" upper=\"2\"/>",
        "/><safety_controller soft_lower_limit=\"-1\" soft_upper_limit=\"1\"/>",
    );
    let model = Model::parse("f", &text).expect("a model");
    assert_eq!(model.joints[0].limits, None);
    assert!(findings(&model)[0].starts_with("not used: soft limits of continuous joints"));
}

#[test]
fn limits_that_do_not_hold_or_are_not_there_are_said() {
    let model = with_limit("<limit effort=\"1\"/>");
    assert_eq!(model.joints[0].limits, Some(Limits { lower: 0.0, upper: 0.0 }));
    assert!(findings(&model)[0].starts_with("suspicious: limits without `lower`"));
    for (bounds, count) in [("lower=\"-1\" upper=\"2\"", 1), ("lower=\"-1e16\" upper=\"1e16\"", 0)]
    {
        let text =
            ARM.replace("lower=\"-1\" upper=\"2\"", bounds).replace("revolute", "continuous");
        let model = Model::parse("f", &text).expect("a model");
        assert_eq!(model.joints[0].limits, None);
        assert_eq!(findings(&model).len(), count, "{:?}", findings(&model));
    }
}

#[test]
fn what_a_urdf_says_and_kinematics_does_not_read_is_named() {
    let joint = |text: &str| ARM.replacen("<axis xyz=\"0 0 1\"/>", text, 1);
    let link = |text: &str| {
        ARM.replace("<link name=\"hand\"/>", &format!("<link name=\"hand\">{text}</link>"))
    };
    let shape = |text: &str| link(&format!("<collision><geometry>{text}</geometry></collision>"));
    let mass = |kg: &str| link(&format!("<inertial><mass value=\"{kg}\"/></inertial>"));
    for (text, expected) in [
        (joint("<dynamics damping=\"1\"/>"), "not used: elements <dynamics> of joints, line 7"),
        (joint("<calibration rising=\"1\"/>"), "not used: elements <calibration> of joints"),
        (joint("<drake:gear/>"), "not used: elements <drake:gear> of joints, line 7"),
        (joint("<axis xyz=\"0 0 3\"/>"), "repaired: axes whose length is not 1, of which"),
        (joint("<axis xyz=\"0 0 1\" frame=\"a\"/>"), "not used: `frame` of <axis>, line 7"),
        (joint("<origin xyz=\"0 0 300\"/>"), "suspicious: origins beyond 100 m, which look like"),
        (joint("<origin rpy=\"0 0 90\"/>"), "suspicious: angles of more than a turn, which look"),
        (ARM.replace("upper=\"2\"", "upper=\"180\""), "suspicious: limits of more than ten turns"),
        (
            ARM.replace("upper=\"2\"", "upper=\"180\"").replace("revolute", "prismatic"),
            "suspicious: limits beyond 100 m, which look like millimeters, line 7; URDF has meters",
        ),
        (ARM.replace("fixed", "floating"), "not used: the motion of floating joints: what they"),
        (
            ARM.replace("fixed", "planar").replace("0 0 0", "0 0 1"),
            "not used: the motion of planar",
        ),
        (link("<contact/>"), "not used: elements <contact> of links, line 4"),
        (mass("0"), "suspicious: masses of 0, which simulators of forces refuse, line 4"),
        (mass("-1"), "suspicious: a mass of `-1` kg, line 4"),
        (mass("nan"), "suspicious: a mass of `nan` kg, line 4"),
        (shape("<drake:capsule/>"), "not used: collision shapes <drake:capsule>, line 4"),
        (shape("<capsule radius=\"1\"/>"), "not used: collision shapes <capsule>, line 4"),
        (shape(""), "dropped: collision shapes that are empty, line 4"),
        (shape("<sphere radius=\"1\"/><sphere radius=\"2\"/>"), "dropped: a second shape in one"),
    ] {
        let model = Model::parse("f", &text).expect(expected);
        let lines = findings(&model);
        assert!(lines.iter().any(|line| line.starts_with(expected)), "{lines:?}: {expected}");
    }
}

#[test]
fn a_prefix_that_is_declared_nowhere_is_said_and_does_not_matter() {
    let camera = "<gazebo><sensor:camera name=\"rgb\"/></gazebo>\n</robot>";
    let text = ARM.replace("</robot>", camera);
    let model = Model::parse("f", &text).expect("a model");
    assert_eq!(model.joints, Model::parse("f", ARM).expect("a model").joints);
    let repaired = "repaired: the prefix `sensor:`, which is declared nowhere, line 13";
    assert_eq!(findings(&model)[0], repaired);
    // Errors after it still point at their places.
    let error = Model::parse("f", &text.replace("revolute", "revolut")).expect_err("wrong");
    assert_eq!(error.line_and_column(), Some((5, 32)), "{error}");
}

#[test]
fn every_shared_model_is_read() {
    for name in SHARED {
        let Some(path) = shared(name) else { return };
        let model = Model::load(&path).expect(name);
        assert_eq!(model.links.len(), model.joints.len() + 1, "{name}");
    }
}

#[test]
fn the_panda_has_a_mimic_joint_a_posture_and_groups() {
    let (Some(urdf), Some(srdf)) = (shared("chain/panda.urdf"), shared("chain/panda.srdf")) else {
        return;
    };
    let model = Model::load(&urdf).expect("a model");
    let mimic = model.joints.iter().find_map(|joint| joint.mimic).expect("a mimic joint");
    assert_eq!(model.joints[mimic.joint].name, "panda_finger_joint1");
    let semantics = Semantics::load(&srdf, &model).expect("an SRDF");
    assert_eq!(semantics.groups.len(), 3);
    assert_eq!(semantics.group("--group", "arm_and_hand").expect("there").groups, ["arm", "hand"]);
    assert_eq!(semantics.posture("--posture", "default").expect("there").len(), 8);
    assert_eq!(semantics.end_effectors[0].name, "end_effector");
    assert!(semantics.disabled_collisions.iter().any(|d| d.reason == "Never"));
    let error = semantics.posture("--posture", "defalt").expect_err("wrong");
    assert_eq!(error.remedy(), "did you mean `default`?");
    let ur5 = shared("chain/ur5.urdf").zip(shared("chain/ur5.srdf")).expect("both");
    let model = Model::load(&ur5.0).expect("a model");
    assert_eq!(Semantics::load(&ur5.1, &model).expect("SRDF").disabled_collisions.len(), 10);
}
