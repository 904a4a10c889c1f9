//! `ik`: orientations, several postures, tables of targets.

use crate::support::TestFolder;
use serde_json::{Value, json};

/// Six joints with offsets everywhere.
fn place() -> TestFolder {
    let place = TestFolder::new();
    place.write("six.urdf", SIX);
    place
}

const SIX: &str = r#"<robot name="six">
  <link name="base"/><link name="l1"/><link name="l2"/><link name="l3"/>
  <link name="l4"/><link name="l5"/><link name="l6"/><link name="tool"/>
  <joint name="j1" type="revolute"><parent link="base"/><child link="l1"/>
    <origin xyz="0 0 0.4" rpy="0 0 0.3"/><axis xyz="0 0 1"/><limit lower="-2.9" upper="2.9"/></joint>
  <joint name="j2" type="revolute"><parent link="l1"/><child link="l2"/>
    <origin xyz="0.05 0.02 0" rpy="0.1 0 0"/><axis xyz="0 1 0"/><limit lower="-2" upper="2"/></joint>
  <joint name="j3" type="revolute"><parent link="l2"/><child link="l3"/>
    <origin xyz="0 0 0.5"/><axis xyz="0 1 0"/><limit lower="-2.5" upper="2.5"/></joint>
  <joint name="j4" type="revolute"><parent link="l3"/><child link="l4"/>
    <origin xyz="0.03 0 0.4" rpy="0 -0.2 0"/><axis xyz="0 0 1"/><limit lower="-3.1" upper="3.1"/></joint>
  <joint name="j5" type="revolute"><parent link="l4"/><child link="l5"/>
    <axis xyz="0 1 0"/><limit lower="-2.1" upper="2.1"/></joint>
  <joint name="j6" type="revolute"><parent link="l5"/><child link="l6"/>
    <origin xyz="0 0 0.08"/><axis xyz="0 0 1"/><limit lower="-3.1" upper="3.1"/></joint>
  <joint name="mount" type="fixed"><parent link="l6"/><child link="tool"/>
    <origin xyz="0.02 0 0.11" rpy="0 0.4 0"/></joint>
</robot>
"#;

/// A pose that pinocchio 4.1.0 computed for this arm, its rotation by rows.
const AT: &str = "0.315658175974,0.570872189716,1.208397837049";
const RPY: &str = "-0.153197040811,0.153792677872,-2.878105185293";
const QUATERNION: &str = "-0.065908907986,-0.085698125553,0.984734417571,-0.136418378436";

fn number(value: &Value) -> f64 {
    value.as_f64().expect("a number")
}

fn joints(values: &Value) -> String {
    let values = values.as_array().expect("joints").iter();
    values.map(Value::to_string).collect::<Vec<_>>().join(",")
}

/// The rotation of the tip at some joint values, row by row.
fn rotation(place: &TestFolder, values: &Value) -> Vec<f64> {
    let fk = place.json(&["fk", "six.urdf", "--joints", &joints(values)]);
    assert_eq!(fk["outside_limits"], json!([]));
    let rows = fk["rotation"].as_array().expect("rows").iter();
    rows.flat_map(|row| row.as_array().expect("a row").iter().map(number)).collect()
}

#[test]
fn an_orientation_is_taken_as_angles_or_as_a_quaternion() {
    let place = place();
    // Ry and Rz of the pose, by hand: the first column is (cy cp, sy cp, -sp).
    let (p, y) = (0.153_792_677_872_f64, -2.878_105_185_293_f64);
    let first = [y.cos() * p.cos(), y.sin() * p.cos(), -p.sin()];
    for turned in [["--rpy", RPY], ["--quaternion", QUATERNION]] {
        let found = place.json(&["ik", "six.urdf", "--target", AT, turned[0], turned[1]]);
        assert_eq!(found["reached"], json!(true), "{found}");
        assert!(number(&found["error_m"]) <= 1e-6 && number(&found["error_rad"]) <= 1e-6);
        let rows = rotation(&place, &found["joints"]);
        for i in 0..3 {
            assert!((rows[3 * i] - first[i]).abs() < 3e-6, "{found}");
        }
        assert!((number(&found["target_quaternion"][2]) + 0.984734417571).abs() < 1e-9, "{found}");
    }
    let words = place.run(&["ik", "six.urdf", "--target", AT, "--rpy", RPY]).out();
    assert!(words.contains("quaternion") && words.contains("turned off"), "{words}");
}

#[test]
fn free_axes_leave_the_tools_axis_alone() {
    let place = place();
    // The tool points down at a place where the turn about it does not matter.
    let down = ["ik", "six.urdf", "--target", "0.5,0.2,0.5", "--rpy", "3.14159265,0,0.7"];
    let found = place.json(&[&down[..], &["--free", "rz"]].concat());
    let rows = rotation(&place, &found["joints"]);
    assert!((rows[8] + 1.0).abs() < 1e-6, "{found}");
    // Free of all turns is the position alone.
    let alone = place.json(&["ik", "six.urdf", "--target", "0.5,0.2,0.5"]);
    let free = place.json(&[&down[..], &["--free", "rx,ry,rz"]].concat());
    assert_eq!(alone["joints"], free["joints"]);
    assert_eq!(alone["error_rad"], Value::Null);
    // Free along all axes is the orientation alone, wherever that is.
    let away = ["ik", "six.urdf", "--target", "9,9,9", "--rpy", RPY, "--free", "x,y,z"];
    assert_eq!(place.json(&away)["reached"], json!(true));
}

#[test]
fn several_postures_are_listed_and_the_nearest_is_near() {
    let place = place();
    let all = ["ik", "six.urdf", "--target", AT, "--rpy", RPY, "--solutions", "3"];
    let found = place.json(&all);
    let list = found["solutions"].as_array().expect("a list");
    assert_eq!(list.len(), 3, "{found}");
    assert_eq!(list[0]["joints"], found["joints"]);
    for solution in list {
        let values = joints(&solution["joints"]);
        let tip = &place.json(&["fk", "six.urdf", "--joints", &values])["tip"];
        assert!((number(&tip[0]) - 0.315658175974).abs() < 2e-6, "{tip}");
    }
    let words = place.run(&all).out();
    assert!(words.contains("posture 3"), "{words}");
    let start = ["--joints", "0.9,1,-0.6,-2.2,0.2,-1.7", "--nearest"];
    let near = place.json(&[&all[..6], &start[..]].concat());
    // The posture that the pose was computed from.
    for (found, known) in near["joints"].as_array().expect("joints").iter().zip([0.89, 1.01, -0.62])
    {
        assert!((number(found) - known).abs() < 1e-4, "{near}");
    }
}

#[test]
fn tables_of_targets_have_a_row_for_each_answer() {
    let place = place();
    place.write("rpy.csv", format!("x,y,z,roll,pitch,yaw\n{AT},{RPY}\n5,0,0,0,0,0\n"));
    place.write("q.csv", format!("x,y,z,qx,qy,qz,qw\n{AT},{QUATERNION}\n"));
    let ended = place.run(&["ik", "six.urdf", "--targets", "rpy.csv"]);
    assert_eq!(ended.code(), 1);
    let out = ended.out();
    let lines: Vec<&str> = out.lines().collect();
    assert_eq!(lines.len(), 3, "{out}");
    assert!(lines[0].starts_with("target,reached,error_m") && lines[0].contains("\"j6\""), "{out}");
    assert!(lines[1].starts_with("1,true,") && lines[2].contains("reach"), "{out}");
    let one = place.json(&["ik", "six.urdf", "--target", AT, "--rpy", RPY]);
    let many = place.json(&["ik", "six.urdf", "--targets", "q.csv", "--solutions", "2"]);
    assert_eq!((&many["targets"], &many["reached"]), (&json!(1), &json!(1)));
    assert_eq!(many["answers"][0]["others"].as_array().expect("a list").len(), 1);
    assert_eq!(one["solutions"].as_array().expect("a list").len(), 1);
}

#[test]
fn wrong_poses_are_answered_with_what_would_be_right() {
    let place = place();
    place.write("both.csv", "x,y,z,roll,pitch,yaw,qx,qy,qz,qw\n");
    place.write("half.csv", "x,y,z,roll\n1,2,3,4\n");
    place.write("zero.csv", "x,y,z,qx,qy,qz,qw\n1,2,3,0,0,0,0\n");
    place.write("nan.csv", "x,y,z\n1,2,nan\n");
    let to = ["ik", "six.urdf", "--target", "0.5,0,0.5"];
    for (args, reasons) in [
        (&["--quaternion", "0,0,0,0"][..], ["length 0", "scalar last"]),
        (&["--quaternion", "0,0,1"], ["3 of 4", "x,y,z,w"]),
        (&["--quaternion", "0,0,NaN,1"], ["NaN", "x,y,z,w"]),
        (&["--rpy", "1,2"], ["2 of 3", "roll,pitch,yaw"]),
        (&["--rpy", "0,0,0", "--quaternion", "0,0,0,1"], ["--rpy", "cannot be used"]),
        (&["--free", "rz"], ["--free", "--rpy"]),
        (&["--rpy", "0,0,0", "--free", "rx,ry"], ["two turns", "all three"]),
        (&["--free", "x,y,z"], ["everything", "leave"]),
        (&["--free", "up"], ["`up`", "rz"]),
        (&["--rpy", "0,0,0", "--tolerance-rad", "0"], ["--tolerance-rad", "above 0"]),
        (&["--solutions", "0"], ["--solutions", "1 to"]),
        (&["--apart", "0"], ["--apart", "above 0"]),
        (&["--targets", "q.csv"], ["--targets", "cannot be used"]),
    ] {
        let ended = place.run(&[&to[..], args].concat());
        assert_eq!((ended.code(), ended.out().as_str()), (2, ""), "{args:?}");
        let err = ended.err().replace('\'', "`");
        assert!(reasons.iter().all(|r| err.contains(r)), "{args:?}: {err}");
    }
    for (file, reason) in [
        ("both.csv", "both angles and quaternions"),
        ("half.csv", "lacks `pitch`, `yaw`"),
        ("zero.csv", "zero.csv:2:7"),
        ("nan.csv", "nan.csv:2:5"),
        ("none.csv", "none.csv"),
    ] {
        let ended = place.run(&["ik", "six.urdf", "--targets", file]);
        assert_eq!((ended.code(), ended.out().as_str()), (2, ""), "{file}");
        assert!(ended.err().contains(reason), "{file}: {}", ended.err());
    }
}

/// The arm with bars as links, of which the last is a mesh.
fn with_shapes(mesh: &str) -> String {
    let bar = |link: &str, z: f64, shape: &str| {
        let at = format!("<origin xyz='0 0 {z}'/><geometry>{shape}</geometry>");
        let whole = format!("<link name=\"{link}\"><collision>{at}</collision></link>");
        (format!("<link name=\"{link}\"/>"), whole)
    };
    let bars = [
        bar("base", 0.2, "<cylinder radius='0.1' length='0.3'/>"),
        bar("l2", 0.2, "<box size='0.1 0.1 0.3'/>"),
        bar("l3", 0.2, "<cylinder radius='0.05' length='0.2'/>"),
        bar("l6", 0.06, &format!("<mesh filename='{mesh}' scale='0.001 0.001 0.001'/>")),
    ];
    bars.iter().fold(SIX.to_owned(), |text, (old, new)| text.replace(old, new))
}

/// A mesh in mm: two triangles, whose hull reaches from -50 to 50 along x and y, and 100 along z.
const MESH: &str = "solid t\nfacet normal 0 0 1\nouter loop\nvertex -50 -50 0\nvertex 50 50 0\n\
    vertex 0 0 100\nendloop\nendfacet\nfacet normal 0 0 1\nouter loop\nvertex -50 50 0\n\
    vertex 50 -50 0\nvertex 0 0 100\nendloop\nendfacet\nendsolid t\n";

#[test]
fn shapes_of_links_count_for_obstacles_and_meshes_as_their_hulls() {
    let place = place();
    place.write("tool.stl", MESH);
    place.write("bars.urdf", with_shapes("tool.stl"));
    place.write("lost.urdf", with_shapes("package://six/no/such.stl"));
    // Beside the column: no rod is there, but the cylinder of the base is.
    let beside = ["--obstacle", "0.13,0,0.2,0.05", "--target", "0.5,0.2,0.5"];
    let ask = |model: &'static str, more: &[&'static str]| {
        place.run(&[&["ik", model, "--json", "--restarts", "10"], &beside[..], more].concat())
    };
    let blocked = ask("bars.urdf", &[]);
    assert_eq!(blocked.code(), 1, "{}", blocked.out());
    let reason = blocked.json()["reason"].to_string();
    assert!(reason.contains("link `base`") && reason.contains("obstacle 1"), "{reason}");
    assert_eq!(blocked.json()["remarks"], json!(["meshes stand as their convex hulls: 1"]));
    assert_eq!(ask("bars.urdf", &["--body", "rods"]).code(), 0);
    let lost = ask("lost.urdf", &[]).json()["remarks"].to_string();
    assert!(lost.contains("`l6`") && lost.contains("absent"), "{lost}");
    let words = place.run(&[&["ik", "lost.urdf"], &beside[..]].concat());
    assert!(words.err().contains("absent"), "{}", words.err());
}

#[test]
fn links_keep_off_each_other_unless_the_srdf_lets_them() {
    let place = place();
    place.write("tool.stl", MESH);
    place.write("bars.urdf", with_shapes("tool.stl"));
    place.write("none.srdf", "<robot name='six'/>");
    place.write(
        "masks.srdf",
        "<robot name='six'><disable_collisions link1='l6' link2='base'/>\
         <disable_collisions link1='l6' link2='l2'/></robot>",
    );
    // The tool inside the column of the base.
    let inside = ["--target", "0,0.02,0.25", "--body", "own", "--ignore-limits", "--json"];
    let ask = |srdf: &'static str| {
        place.run(&[&["ik", "bars.urdf", "--srdf", srdf, "--restarts", "20"], &inside[..]].concat())
    };
    let kept = ask("none.srdf");
    assert_eq!(kept.code(), 1, "{}", kept.out());
    let reason = kept.json()["reason"].to_string();
    assert!(reason.contains("deep in link"), "{reason}");
    let let_in = ask("masks.srdf");
    assert_eq!(let_in.code(), 0, "{}", let_in.out());
    // Without any shape, its own body means nothing.
    let bare = place.run(&["ik", "six.urdf", "--target", "0.5,0,0.5", "--body", "own"]);
    assert_eq!((bare.code(), bare.out().as_str()), (2, ""));
    assert!(bare.err().contains("--body") && bare.err().contains("boxes"), "{}", bare.err());
}
