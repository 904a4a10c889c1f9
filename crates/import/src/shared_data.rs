//! Tests of the importers against results that other programs have computed for the same real
//! files: pixel and box counts, components and distances of every map in `../shared/data`.

use sidestep_testing::shared_data as shared;
use std::collections::BTreeSet;

use serde_json::Value;

use super::{movingai, rosmap};
use sidestep_map::planning::{Distances, FreeSpace, octile_distance};
use sidestep_map::{Cell, GridMap, UnknownPolicy};

/// The entries of a file of expected results.
fn expected(name: &str) -> Vec<(String, Value)> {
    let Some(path) = shared(name) else { return Vec::new() };
    let text = std::fs::read_to_string(path).expect("readable");
    match serde_json::from_str(&text).expect("JSON") {
        Value::Object(entries) => entries.into_iter().collect(),
        other => panic!("expected an object, not {other}"),
    }
}

fn number(value: &Value, key: &str) -> usize {
    value[key].as_u64().unwrap_or_else(|| panic!("{key} in {value}")) as usize
}

fn numbers(value: &Value) -> Vec<u32> {
    let numbers = value.as_array().expect("an array").iter();
    numbers.map(|n| n.as_u64().expect("a number") as u32).collect()
}

#[test]
fn every_ros_map_has_the_expected_pixels_boxes_components_and_distances() {
    for (name, expected) in expected("expected/maps.json") {
        let map = rosmap::load(&shared(&name).expect("the map")).expect(&name);
        assert_eq!(map.width() as usize, number(&expected, "width"), "{name}");
        assert_eq!(map.height() as usize, number(&expected, "height"), "{name}");
        assert_eq!(Some(map.resolution_m()), expected["resolution"].as_f64(), "{name}");
        let origin = expected["origin"].as_array().expect("an origin");
        assert_eq!(
            map.plane().origin_m.map(Some),
            [origin[0].as_f64(), origin[1].as_f64()],
            "{name}"
        );
        let (counts, cells) = (map.counts(), &expected["cells"]);
        assert_eq!(counts.free, number(cells, "free"), "{name}");
        assert_eq!(counts.wall, number(cells, "occupied"), "{name}");
        assert_eq!(counts.unknown, number(cells, "unknown"), "{name}");
        for (size, expected) in expected["boxes"].as_object().expect("box sizes") {
            let box_size_m = size.parse().expect("a box size");
            let boxes = map.to_boxes(box_size_m, UnknownPolicy::Keep).expect("boxes");
            check_boxes(&format!("{name} at {size} m"), &boxes, expected);
        }
    }
}

fn check_boxes(name: &str, boxes: &GridMap, expected: &Value) {
    assert_eq!(boxes.width() as usize, number(expected, "nx"), "{name}");
    assert_eq!(boxes.height() as usize, number(expected, "ny"), "{name}");
    let counts = boxes.counts();
    assert_eq!(counts.free, number(expected, "free"), "{name}");
    assert_eq!(counts.wall, number(expected, "wall"), "{name}");
    assert_eq!(counts.unknown, number(expected, "unknown"), "{name}");
    let components = boxes.components(UnknownPolicy::Keep);
    assert_eq!(components.sizes().len(), number(expected, "free_components"), "{name}");
    assert_eq!(components.largest_size(), number(expected, "largest_free"), "{name}");
    let from = numbers(&expected["bfs_from"]);
    let distances = Distances::to_nearest(&FreeSpace::from_map(boxes), 1, &[(from[0], from[1])]);
    assert_eq!(
        distances.max_steps().map(|max| max as usize),
        Some(number(expected, "bfs_max")),
        "{name}"
    );
}

#[test]
fn every_movingai_map_has_the_expected_boxes() {
    for (name, expected) in maps_or_scens(".map") {
        let map = movingai::load_map(&shared(&name).expect("the map"), 1.0).expect(&name).map;
        assert_eq!(map.width() as usize, number(&expected, "width"), "{name}");
        assert_eq!(map.height() as usize, number(&expected, "height"), "{name}");
        assert_eq!(map.count(Cell::Free), number(&expected, "passable"), "{name}");
        let chars = expected["chars"].as_object().expect("characters");
        let boxes_of = |signs: &str| -> u64 {
            let of_sign = chars.iter().filter(|(sign, _)| signs.contains(sign.as_str()));
            of_sign.map(|(_, count)| count.as_u64().expect("a count")).sum()
        };
        assert_eq!(map.count(Cell::Free) as u64, boxes_of(".GS"), "{name}");
        assert_eq!(map.count(Cell::Wall) as u64, boxes_of("@OTW"), "{name}");
    }
}

fn maps_or_scens(extension: &str) -> impl Iterator<Item = (String, Value)> {
    expected("expected/mapf.json").into_iter().filter(move |(name, _)| name.ends_with(extension))
}

#[test]
fn every_movingai_scenario_has_the_expected_lengths() {
    for (name, expected) in maps_or_scens(".scen") {
        let path = shared(&name).expect("the scenario");
        let rows = movingai::load_scen(&path).expect(&name).rows;
        assert_eq!(rows.len(), number(&expected, "rows"), "{name}");
        let map = movingai::load_map(&path.with_file_name(&rows[0].map), 1.0).expect(&name).map;
        assert_eq!(rows.iter().find_map(|row| row.check_against(&name, &map).err()), None);
        let free = FreeSpace::from_map(&map);
        let checked = &rows[..number(&expected, "checked")];
        let matching = |rows: &[movingai::ScenRow]| {
            rows.iter().filter(|row| has_octile_length(&free, row)).count()
        };
        assert_eq!(matching(checked), number(&expected, "octile_matches_file"), "{name}");
        assert_eq!(expected["octile_mismatch"], Value::Array(Vec::new()), "{name}");
        assert_eq!(matching(&rows), rows.len(), "{name}: the rows that nobody has checked yet");
        check_steps(&name, &free, checked, &expected);
        check_ends(&name, &free, &rows, &expected);
    }
}

fn has_octile_length(free: &FreeSpace, row: &movingai::ScenRow) -> bool {
    // The files give 8 digits after the decimal point.
    octile_distance(free, row.start, row.goal)
        .zip(row.optimal_length)
        .is_some_and(|(length, given)| (length - given).abs() < 1e-6)
}

/// The lengths on 4 neighbors.
fn check_steps(name: &str, free: &FreeSpace, rows: &[movingai::ScenRow], expected: &Value) {
    let steps_of = |row: &movingai::ScenRow| {
        let distances = Distances::to_nearest(free, 1, &[row.goal]);
        distances.steps(row.start.0, row.start.1).expect("a way")
    };
    let steps: Vec<u32> = rows.iter().map(steps_of).collect();
    let sum = |steps: &[u32]| steps.iter().sum::<u32>() as usize;
    assert_eq!(steps[..10], numbers(&expected["dist4_first10"]), "{name}");
    assert_eq!(sum(&steps[..10]), number(expected, "sum_dist4_first10"), "{name}");
    assert_eq!(sum(&steps[..50]), number(expected, "sum_dist4_first50"), "{name}");
    assert_eq!(sum(&steps), number(expected, "sum_dist4_checked"), "{name}");
    let makespan = steps[..50].iter().max().map(|&max| max as usize);
    assert_eq!(makespan, Some(number(expected, "makespan_lb_first50")), "{name}");
}

fn check_ends(name: &str, free: &FreeSpace, rows: &[movingai::ScenRow], expected: &Value) {
    let starts: Vec<_> = rows.iter().map(|row| row.start).collect();
    let goals: Vec<_> = rows.iter().map(|row| row.goal).collect();
    let distinct =
        |ends: &[(u32, u32)]| Some(ends.iter().collect::<BTreeSet<_>>().len() == ends.len());
    assert_eq!(distinct(&starts), expected["all_starts_distinct"].as_bool(), "{name}");
    assert_eq!(distinct(&goals), expected["all_goals_distinct"].as_bool(), "{name}");
    let passable = starts.iter().chain(&goals).all(|&(col, row)| free.is_free(col, row));
    assert_eq!(Some(passable), expected["all_passable"].as_bool(), "{name}");
}
