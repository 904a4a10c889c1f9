//! Tables of recorded runs name their bodies, which other programs need to join and to draw them.

use crate::support::TestFolder;
use sidestep::kernel::ports::{ColumnSpec, ColumnValues};
use sidestep_record::{Table, read_table};
use std::collections::BTreeMap;

const FLOOR: &str = r#"format = 1
world = "robots"
cycles = 5
map = { box_size_m = 0.25, ascii = """
......
......
......
""" }
robots = { count = 3 }
people = { count = 2 }
doors = { at = [[5, 1]], random = { p_open = 0.1, p_close = 0.1 } }
"#;

const TWO: &str = r#"format = 1
world = "airspace"
cycles = 4
[[airplanes]]
callsign = "ZULU9"
at_m = [0, 0]
heading_deg = 0
way_points_m = [[90000, 0]]
[[airplanes]]
callsign = "ALFA1"
at_m = [0, 50000]
heading_deg = 0
way_points_m = [[90000, 50000]]
"#;

fn record(text: &str) -> TestFolder {
    let place = TestFolder::new();
    place.write("s.toml", text);
    let ended = place.run(&["run", "s.toml", "--out", "s"]);
    assert_eq!(ended.code(), 0, "{}", ended.err());
    place
}

#[test]
fn boxes_can_be_drawn_in_meters_and_ids_told_by_kind_from_the_table_alone() {
    let place = record(FLOOR);
    for name in ["trajectories", "events"] {
        let table = read_table(&place.path("s"), name, ..).expect("it is complete");
        let about: BTreeMap<_, _> = table.schema.about.into_iter().collect();
        let of = |name: &str| about.get(name).map(String::as_str);
        assert_eq!(of("box_m"), Some("0.25"), "{name}");
        let place = ["origin_x_m", "origin_y_m", "yaw_rad"].map(of);
        assert_eq!(place, [Some("0"); 3], "{name}");
        let ids = ["ids_robot", "ids_person", "ids_door"].map(of);
        assert_eq!(ids, [Some("0-2"), Some("3-4"), Some("5-5")], "{name}");
    }
}

fn text_column<'t>(table: &'t Table, name: &str) -> (&'t ColumnSpec, &'t ColumnValues) {
    let spec = table.schema.columns.iter().find(|column| column.name == name);
    spec.zip(table.column(name)).expect("a column of that name")
}

#[test]
fn every_leg_is_told_with_the_call_sign_of_its_airplane() {
    let place = record(TWO);
    let table = read_table(&place.path("s"), "trajectories", ..).expect("it is complete");
    let (column, values) = text_column(&table, "callsign");
    let (ids, airplanes) = text_column(&table, "airplane");
    assert!(table.rows() > 0);
    for row in 0..table.rows() {
        let id: usize = ids.text(airplanes, row).parse().expect("a number");
        assert_eq!(column.text(values, row), ["ZULU9", "ALFA1"][id]);
    }
}
