//! The camera of the MRCLAM robots.

use serde_json::{Value, json};

use super::{assert_close, assert_moments, expected, shared};
use crate::sensor::{LearnedSensor, SensorOptions, from_mrclam};

fn learned() -> Option<(LearnedSensor, Value, Value)> {
    let model = from_mrclam(&shared("logs/mrclam7")?, None, &SensorOptions::default()).unwrap();
    let report = serde_json::to_value(&model.report).unwrap();
    Some((model, report, expected("mrclam7_dev_sensor.json")))
}

#[test]
fn sightings_and_confusion_are_those_of_the_oracle() {
    let Some((_, report, expected)) = learned() else { return };
    assert_eq!(report["measurements"], expected["measurements"]);
    assert_close(&report["skipped"], &expected["skipped"]["observer_no_gt"], 2.0, "skipped");
    assert_close(&report["correct"], &expected["correct"], 2.0, "correct");
    let nearest = &expected["nearest_only"];
    assert_close(&report["sightings"], &nearest["total"], 2.0, "sightings");
    assert_close(&report["nearest_agrees"], &nearest["correct"], 2.0, "nearest");
    assert_close(&report["unknown_codes"], &expected["unknown_codes"], 0.0, "codes");
    for cell in expected["off_diagonal"].as_array().unwrap() {
        let [truth, observed] = [0, 1].map(|i| cell[i].as_str().unwrap());
        assert_close(&report["confusion"][truth][observed], &cell[2], 2.0, truth);
    }
    let kinds = json!({
        "ROBOT": {"ROBOT": 4204, "LANDMARK": 3, "UNKNOWN": 8},
        "LANDMARK": {"LANDMARK": 16045, "UNKNOWN": 1},
    });
    assert_eq!(report["kinds"], kinds);
}

#[test]
fn every_cell_of_the_confusion_is_that_of_the_oracle() {
    let Some((_, report, expected)) = learned() else { return };
    for (i, row) in expected["confusion_counts"].as_array().unwrap().iter().enumerate() {
        for (j, count) in row.as_array().unwrap().iter().enumerate() {
            let name = |index: usize, last: &str| {
                if index == 20 { last.to_string() } else { format!("S{}", index + 1) }
            };
            let (truth, observed) = (name(i, "NONE"), name(j, "UNKNOWN"));
            let found = report["confusion"][&truth][&observed].as_f64().unwrap_or(0.0);
            assert!((found - count.as_f64().unwrap()).abs() <= 2.0, "{truth} {observed}: {found}");
        }
    }
}

#[test]
fn distances_are_those_of_the_oracle() {
    let Some((_, report, expected)) = learned() else { return };
    for key in ["distance_edges_m", "distance_counts", "distance3_edges_m", "distance3_counts"] {
        assert_close(&report[key], &expected[key], 2.0, key);
    }
    let robots = &expected["distance_counts_robot_targets"];
    assert_close(&report["distance_counts_robots"], robots, 2.0, "robots");
    let landmarks = &expected["distance_counts_landmark_targets"];
    assert_close(&report["distance_counts_landmarks"], landmarks, 2.0, "landmarks");
}

#[test]
fn errors_of_range_and_bearing_are_those_of_the_oracle() {
    let Some((_, report, expected)) = learned() else { return };
    for key in ["range_error_m", "bearing_error_rad"] {
        assert_moments(&report[key], &expected[key], 2.0, key);
        for observer in ["1", "2", "3", "4", "5"] {
            let [found, wanted] = [&report, &expected].map(|v| &v["per_observer"][observer][key]);
            assert_moments(found, wanted, 2.0, observer);
        }
    }
    let key = "range_error_by_true_class";
    for class in 0..6 {
        assert_moments(&report[key][class], &expected[key][class], 2.0, key);
    }
}

#[test]
fn detection_is_that_of_the_oracle() {
    let Some((model, _, expected)) = learned() else { return };
    let detection = model.report.detection.unwrap();
    for (class, row) in detection.all.cells().iter().enumerate() {
        let found = json!({"in_view": row[0] + row[1], "seen": row[0]});
        let wanted = &expected["detection_1s"];
        let wanted = json!({"in_view": wanted["in_view"][class], "seen": wanted["seen"][class]});
        assert_close(&found, &wanted, 2.0, &detection.all.rows()[class]);
    }
}

#[test]
fn the_printed_report_names_the_figures_that_matter() {
    let Some((model, ..)) = learned() else { return };
    let printed = model.report.to_string();
    assert!(printed.contains("20282 readings: 21 skipped, 20261 judged, 20244 of them right"));
    assert!(printed.contains("kinds NONE: 0"), "thin rows are named");
}

#[test]
fn every_row_of_the_camera_sums_to_one() {
    let Some((model, ..)) = learned() else { return };
    let profile = model.profile;
    let by_class = profile.confusion_by_class.iter().flat_map(|(_, rows)| rows);
    for row in profile.confusion.iter().chain(by_class).chain(&profile.distance_confusion) {
        assert!((row.probabilities.iter().sum::<f64>() - 1.0).abs() < 1e-9, "{row:?}");
    }
    assert!(profile.confusion[0].probabilities[0] > 0.999);
}
