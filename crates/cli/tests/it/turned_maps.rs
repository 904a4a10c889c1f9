//! ROS maps with a turned image: boxes stay along the image, and places are given in the world.

use crate::support::{SCENARIO, TestFolder};
use serde_json::Value;

const ORIGIN_M: [f64; 2] = [-3.0, 7.5];

/// Writes the small building as a ROS map that is turned, and returns the scenario in it.
pub(crate) fn on_a_map(place: &TestFolder, yaw_deg: f64, cycles: u64) -> String {
    let (before, rest) = SCENARIO.split_once("ascii = \"\"\"\n").expect("a map");
    let (rows, after) = rest.split_once("\"\"\"\n").expect("its end");
    let gray = |c: char| if c == '#' { 0 } else { 254 };
    let mut image = b"P5 24 8 255\n".to_vec();
    image.extend(rows.lines().flat_map(str::chars).map(gray));
    place.write("m.pgm", image);
    let ([x, y], yaw_rad) = (ORIGIN_M, yaw_deg.to_radians());
    place.write(
        "m.yaml",
        format!(
            "image: m.pgm\nresolution: 0.25\norigin: [{x:?}, {y:?}, {yaw_rad:?}]\nnegate: 0\n\
             occupied_thresh: 0.65\nfree_thresh: 0.196\n"
        ),
    );
    let whole = format!("{before}file = \"m.yaml\"\n{after}");
    whole.replace("cycles = 3000", &format!("cycles = {cycles}"))
}

/// The numbers of a body.
fn number(body: &Value, key: &str) -> f64 {
    body[key].as_f64().expect(key)
}

#[test]
fn a_turned_map_is_the_same_building_elsewhere_in_the_world() {
    let mut straight: Option<(Value, Vec<Value>)> = None;
    for yaw_deg in [0.0, 90.0, 180.0, 30.0] {
        let place = TestFolder::new();
        place.write("turned.toml", on_a_map(&place, yaw_deg, 60));
        let map = place.json(&["map", "m.yaml"]);
        assert_eq!(map["yaw_rad"], yaw_deg.to_radians(), "{map}");
        assert_eq!((&map["width_boxes"], &map["boxes"]["wall"]), (&24.into(), &64.into()), "{map}");
        let ran = place.json(&["run", "turned.toml", "--out", "r", "--mcap", "r.mcap"]);
        let bodies = place.json(&["replay", "r", "--cycle", "40"])["bodies"].clone();
        let bodies = bodies.as_array().expect("bodies").clone();
        let (digest, still) = straight.get_or_insert((ran["digest"].clone(), bodies.clone()));
        assert_eq!(&ran["digest"], digest, "boxes are counted along the image");
        let (s, c) = yaw_deg.to_radians().sin_cos();
        for (body, before) in bodies.iter().zip(&*still) {
            let [x, y] = [("x_m", 0), ("y_m", 1)].map(|(key, k)| number(before, key) - ORIGIN_M[k]);
            let expected = [ORIGIN_M[0] + c * x - s * y, ORIGIN_M[1] + s * x + c * y];
            let found = [number(body, "x_m"), number(body, "y_m")];
            let error_m = (0..2).map(|k| (found[k] - expected[k]).abs()).fold(0.0, f64::max);
            assert!(error_m < 1e-9, "{yaw_deg}: {found:?}, not {expected:?}");
            assert_eq!(body["col_boxes"], before["col_boxes"]);
            if body["heading_deg"].is_number() {
                let turned_deg = number(body, "heading_deg") - number(before, "heading_deg");
                assert!((turned_deg - yaw_deg).abs() < 1e-9, "{body}");
            }
        }
        // The recording alone runs the same way again, and the map in the folder is as turned.
        assert_eq!(place.run(&["replay", "r.mcap"]).code(), 0);
        assert!(place.read("r/inputs/map.yaml").contains(&format!("{:?}]", yaw_deg.to_radians())));
        // Labels are turned about a place of theirs, the floor of a turned map about its origin.
        let picture = place.read("r/trajectories.svg");
        let turns = picture.split("rotate(").skip(1).filter_map(|rest| rest.split(')').next());
        let is_turned = turns.clone().any(|turn| !turn.contains(' '));
        assert_eq!(is_turned, yaw_deg != 0.0, "{yaw_deg}");
    }
}
