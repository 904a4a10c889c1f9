//! The moves and turns of the MRCLAM robots and of two robots with corrected logs.

use serde_json::{Value, json};

use super::{assert_close, assert_moments, expected, shared};
use crate::EstimateOptions;
use crate::effector::{LearnedEffector, from_carmen, from_mrclam};

const MOMENTS: [&str; 4] = ["ahead_boxes", "left_boxes", "dtheta_minus_cmd_rad", "duration_s"];

fn as_json(model: &LearnedEffector) -> Value {
    serde_json::to_value(&model.report).unwrap()
}

/// The oracle's names of the six classes in lower case.
fn lower(shares: &Value) -> Value {
    let entries = shares.as_object().unwrap().iter();
    entries.map(|(name, share)| (name.to_lowercase(), share.clone())).collect()
}

fn assert_forward(report: &Value, expected: &Value, what: &str) {
    assert_close(&report["events"], &expected["n"], 1.0, what);
    for key in MOMENTS {
        assert_moments(&report["moments"][key], &expected[key], 1.0, &format!("{what} {key}"));
    }
    let shares = [("transitions", "phase_averaged_paper"), ("transitions_rounded", "rounded_prob")];
    for (key, theirs) in shares {
        assert_close(&report[key], &lower(&expected[theirs]), 0.002, what);
    }
    assert_close(&report["outcomes"], &expected["phase_averaged_prob"], 0.002, what);
    assert_close(&report["rounded_counts"], &expected["rounded_counts"], 1.0, what);
}

#[test]
fn moves_of_every_box_size_are_those_of_the_oracle() {
    let Some(folder) = shared("logs/mrclam7") else { return };
    let expected = expected("mrclam7_dev_effector.json");
    for (box_m, key) in
        [(0.1, "forward_0.1"), (0.25, "forward_0.25"), (0.5, "forward_0.5"), (1.0, "forward_1.0")]
    {
        let model = from_mrclam(&folder, box_m, None, &EstimateOptions::default()).unwrap();
        let report = as_json(&model);
        assert_forward(&report, &expected[key], key);
        let rejected = &expected[key]["rejected"];
        let names = [("turn", "turn"), ("no_ground_truth", "no_gt")];
        for (ours, theirs) in names.iter().filter(|(_, theirs)| rejected.get(theirs).is_some()) {
            assert_close(&report["rejected"][ours], &rejected[theirs], 1.0, key);
        }
        assert_eq!(report["lateral_slip_sd"], Value::Null);
    }
}

#[test]
fn turns_are_those_of_the_oracle() {
    let Some(folder) = shared("logs/mrclam7") else { return };
    let model = from_mrclam(&folder, 0.25, None, &EstimateOptions::default()).unwrap();
    let (report, expected) = (as_json(&model), expected("mrclam7_dev_effector.json"));
    let (turns, expected) = (&report["turns"], &expected["turn_45deg"]);
    for key in ["n", "n_left", "n_right", "hist_15deg"] {
        assert_close(&turns[key], &expected[key], 1.0, key);
    }
    for key in ["true_over_commanded", "error_deg_along_turn", "duration_s"] {
        assert_moments(&turns[key], &expected[key], 1.0, key);
    }
}

fn assert_carmen(log: &str, oracle: &str) {
    let Some(file) = shared(log) else { return };
    let model = from_carmen(&file, None, &EstimateOptions::default()).unwrap();
    let (report, expected) = (as_json(&model), expected(oracle));
    assert_forward(&report, &expected["forward_one_box"], log);
    assert_moments(&report["lateral_slip"], &expected["lateral_slip_ratio"], 1.0, "slip");
    assert_close(&report["lateral_slip_sd"], &expected["lateral_slip_ratio"]["sd"], 1e-5, "slip");
    assert_eq!(report["warnings"], json!([]));
    let moments = &report["moments"];
    assert_moments(&moments["odometry_forward_m"], &expected["odometry_forward_m"], 1.0, log);
    for (ours, theirs) in [("error_ahead_m", "ahead"), ("error_left_m", "left")] {
        assert_moments(&moments[ours], &expected["abs_error_boxes_1.0"][theirs], 1.0, ours);
    }
    let (turns, expected) = (&report["turns"], &expected["turn_in_place"]);
    assert_close(&turns["n"], &expected["n"], 1.0, "turns");
    assert_moments(&turns["true_over_commanded"], &expected["true_over_odometry"], 1.0, "ratio");
    assert_moments(&turns["error_deg_along_turn"], &expected["error_deg_along_turn"], 1.0, "deg");
    assert_close(&turns["error_hist_5deg"], &expected["hist_5deg"], 1.0, "histogram");
}

#[test]
fn the_intel_log_gives_the_moves_of_the_oracle() {
    assert_carmen("logs/carmen/intel-corrected.log.gz", "carmen_intel_dev.json");
}

#[test]
fn the_fhw_log_gives_the_moves_of_the_oracle() {
    assert_carmen("logs/carmen/fhw-corrected.log.gz", "carmen_fhw_dev.json");
}

#[test]
fn the_printed_report_names_the_figures_that_matter() {
    let Some(folder) = shared("logs/mrclam7") else { return };
    let model = from_mrclam(&folder, 0.25, None, &EstimateOptions::default()).unwrap();
    let printed = model.report.to_string();
    assert!(printed.contains("498 moves of one box (0.25 m) ahead"));
    let p: f64 =
        model.profile.action("forward").unwrap().iter().map(|transition| transition.p).sum();
    assert!((p - 1.0).abs() < 1e-9);
}
