use super::*;
use crate::urdf::tests::ARM;

const SRDF: &str = r#"<robot name="arm">
  <virtual_joint name="floor" type="floating" parent_frame="w" child_link="base"/>
  <group name="all"><chain base_link="base" tip_link="hand"/></group>
  <group name="both"><group name="all"/><joint name="shoulder"/><link name="hand"/></group>
  <group_state name="up" group="all">
    <joint name="floor" value="0 0 0"/><joint name="shoulder" value="1.5"/>
  </group_state>
  <end_effector name="tool" parent_link="hand" group="all"/>
  <disable_collisions link1="base" link2="upper" reason="Adjacent"/>
</robot>
"#;

fn arm() -> Model {
    Model::parse("arm.urdf", ARM).expect("a model")
}

fn read(text: &str) -> Result<Semantics, InputError> {
    Semantics::parse("arm.srdf", text, &arm())
}

/// What is said of the parts of an SRDF.
fn said(parts: &str) -> Vec<String> {
    let semantics = read(&format!("<robot name='arm'>\n{parts}\n</robot>")).expect(parts);
    semantics.report.findings.iter().map(ToString::to_string).collect()
}

#[test]
fn an_srdf_is_read_whole_and_its_errors_are_pointed_at() {
    let semantics = read(SRDF).expect("an SRDF");
    assert_eq!(semantics.groups[0].chains, [(0, 2)]);
    assert_eq!(semantics.posture("--posture", "up"), Ok(vec![(0, 1.5)]));
    assert_eq!(semantics.disabled_collisions[0].links, (0, 1));
    let cases = [
        ("tip_link=\"hand\"", "tip_link=\"hnd\"", 3, "`hand`?"),
        ("<group name=\"all\"/>", "<group name=\"al\"/>", 4, "`all`?"),
        ("name=\"both\"", "name=\"all\"", 4, "own"),
        ("group=\"all\">", "group=\"alls\">", 5, "`all`?"),
        ("value=\"1.5\"", "value=\"up\"", 6, "number"),
        ("group=\"all\"/>", "group=\"al\"/>", 8, "`all`?"),
        ("<link name=\"hand\"/>", "<link name=\"${side}hand\"/>", 4, "xacro FILE.srdf.xacro"),
        ("<group name=\"all\"/>", "<xacro:arm/>", 4, "xacro FILE.srdf.xacro"),
        ("<end_effector", "<xacro:hand/><end_effector", 8, "xacro FILE.srdf.xacro"),
    ];
    for (old, new, line, remedy) in cases {
        let error = read(&SRDF.replacen(old, new, 1)).expect_err(new);
        assert_eq!(error.line_and_column().map(|p| p.0), Some(line), "{error}");
        assert!(error.remedy().contains(remedy), "{error}");
    }
}

#[test]
fn what_an_srdf_says_and_nobody_uses_is_named() {
    for (part, expected) in [
        ("<virtual_joint name='f'/>", "not used: elements <virtual_joint>: the robot stands where"),
        (
            "<passive_joint name='shoulder'/>",
            "not used: elements <passive_joint>, whose joints move",
        ),
        ("<joint_property joint_name='j'/>", "not used: elements <joint_property>, line 2"),
        ("<link_sphere_approximation link='hand'/>", "not used: elements <link_sphere_approx"),
        ("<x:y/>", "not used: elements <x:y>, line 2"),
        ("<colour/>", "not used: elements <colour>, line 2"),
        ("<group name='g'/>", "suspicious: the group `g` is empty, line 2"),
        ("<group name='g'><box/></group>", "not used: elements <box>, line 2"),
        (
            "<disable_collisions link1='base' link2='hand' margin='1'/>",
            "not used: `margin` of <dis",
        ),
        (
            "<end_effector name='e' parent_link='hand' parent_group='g'/>",
            "not used: `parent_group` of <end_effector>, line 2",
        ),
        (
            "<end_effector name='e' parent_link='hand'/>",
            "not used: end effectors, from which no tip is taken, line 2; give their link as the tip: hand",
        ),
        (
            "<disable_collisions link1='base' link2='gripper'/>",
            "dropped: collisions of the link `gripper`, which the URDF does not have, line 2",
        ),
        (
            "<group name='g'><chain base_link='hand' tip_link='base'/></group>",
            "not used: the chain from `hand` to `base`, which does not lead outward",
        ),
        ("<xacro:property name='a' value='1'/>", "dropped: definitions of xacro"),
    ] {
        let lines = said(part);
        assert!(lines.iter().any(|line| line.starts_with(expected)), "{lines:?}");
    }
    let renamed = read("<robot name='other'/>").expect("an SRDF").report.findings;
    assert!(renamed[0].to_string().starts_with("suspicious: the robot is `other`"), "{renamed:?}");
    assert_eq!(said("<disable_collisions link1='base' link2='upper' reason='Never'/>"), [""; 0]);
}

#[test]
fn a_posture_given_twice_and_values_of_joints_that_have_none_are_said() {
    let group = "<group name='g'><joint name='shoulder'/><joint name='f'/></group>\n\
                 <virtual_joint name='f'/>";
    let twice = "<group_state name='p' group='g'><joint name='shoulder' value='1'/></group_state>";
    let lines = said(&format!("{group}\n{twice}\n{twice}"));
    assert!(lines[1].starts_with("not used: virtual joints in groups, line 2"), "{lines:?}");
    assert!(lines[2].starts_with("suspicious: a second posture `p` of the group `g`"), "{lines:?}");
}

#[test]
fn collisions_off_by_default_are_off_but_for_pairs_that_are_on_again() {
    let parts = "<robot name='arm'><disable_default_collisions link='hand'/>\
                 <enable_collisions link1='base' link2='hand'/>";
    let all = BTreeSet::from([0, 1, 2]);
    let semantics = read(&format!("{parts}</robot>")).expect("an SRDF");
    assert_eq!(semantics.may_touch(&all), [(1, 2)]);
    assert_eq!(semantics.may_touch(&BTreeSet::from([0, 1])), []);
    let off = "<disable_collisions link1='hand' link2='base'/></robot>";
    let semantics = read(&format!("{parts}{off}")).expect("an SRDF");
    assert_eq!(semantics.may_touch(&all), [(0, 2), (1, 2)]);
}

#[test]
fn a_macro_file_is_refused_by_its_name() {
    let error = Semantics::load(Path::new("arm.srdf.xacro"), &arm()).expect_err("xacro");
    assert!(error.remedy().contains("xacro FILE.srdf.xacro > FILE.srdf"), "{error}");
}
