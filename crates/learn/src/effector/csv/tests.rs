//! Promise: a table of displacements gives its shares back, and says what in it is not one law.

use super::*;
use sidestep_import::table::CsvTable;

const HEAD: &str = "action,ahead_boxes,left_boxes,turn_deg\n";

fn learned(rows: &str, alpha: f64) -> Result<LearnedEffector, InputError> {
    learned_table(&format!("{HEAD}{rows}"), alpha, |options| options)
}

fn learned_table(
    text: &str,
    alpha: f64,
    change: impl FnOnce(EffectorOptions) -> EffectorOptions,
) -> Result<LearnedEffector, InputError> {
    let options = EstimateOptions { alpha, ..Default::default() }.into();
    learn(&CsvTable::parse(&"f.csv", text)?, &change(options))
}

#[test]
fn whole_displacements_are_counted_as_they_are() {
    let rows = "forward,1,0,0\nforward,1,0,0\nforward,1,1,0\nforward,0,0,90\n\
        left,0,0,90\nleft,0,0,0\nright,0,0,-90\nstay,0,0,0\n";
    let model = learned(rows, 0.0).unwrap();
    let shares = model.report.transitions.unwrap();
    assert_eq!((shares.ahead, shares.ahead_left, shares.other), (0.5, 0.25, 0.25));
    assert_eq!((model.report.events, model.report.actions["left"]["stay"]), (4, 1.0));
    let forward: Vec<_> = model
        .profile
        .action("forward")
        .unwrap()
        .iter()
        .map(|t| (t.path.as_str(), t.turn_deg, t.p))
        .collect();
    assert_eq!(forward, [("F", 0, 0.5), ("", 90, 0.25), ("FL", 0, 0.25)]);
    assert_eq!(model.profile.action("right").unwrap().len(), 1);
    assert!(model.profile.action("stay").is_some());
    assert!(model.profile.assumed.is_empty());
}

#[test]
fn displacements_between_boxes_are_phase_averaged() {
    let model = learned("forward,1.25,0,0\n", 0.0).unwrap();
    let forward: Vec<_> =
        model.profile.action("forward").unwrap().iter().map(|t| (t.path.as_str(), t.p)).collect();
    assert_eq!(forward, [("F", 0.75), ("FF", 0.25)]);
    assert_eq!(model.profile.assumed, ["left: never fails", "right: never fails"]);
}

#[test]
fn the_intended_outcome_comes_first_though_it_was_never_seen() {
    let model = learned("forward,0,0,0\n", 0.5).unwrap();
    let forward: Vec<_> =
        model.profile.action("forward").unwrap().iter().map(|t| (t.path.as_str(), t.p)).collect();
    assert_eq!(forward, [("F", 0.25), ("", 0.75)]);
}

#[test]
fn a_recorded_table_of_motions_is_read_and_contacts_are_left_out() {
    let text = "cycle,robot,action,ahead_boxes,left_boxes,turn_deg,contact\n\
        0,0,0,1,0,0,no\n1,0,0,0,0,0,yes\n2,0,1,0,0,90,no\n3,0,1,0,0,270,no\n4,0,1,0,0,-90,no\n";
    let table = CsvTable::parse(&"f.csv", text).unwrap();
    let report = learn(&table, &EffectorOptions::default()).unwrap().report;
    assert_eq!((report.events, report.rejected["contact"]), (1, 1));
    assert!(report.warnings[0].contains("learn in the open"));
    assert_eq!(report.actions["left"]["turn -90"], 2.0, "270 degrees to the left end alike");
}

#[test]
fn a_turn_that_overshoots_has_the_same_moments_on_both_sides() {
    let turns = |rows: &str| learned(rows, 0.0).unwrap().report.turns.unwrap();
    // A recording calls two quarters 180 degrees, whichever way they were turned.
    let (left, right) = (turns("left,0,0,180\n"), turns("right,0,0,180\n"));
    assert_eq!(left.error_deg_along_turn.map(|m| m.mean.round()), Some(90.0));
    assert_eq!(right.error_deg_along_turn, left.error_deg_along_turn);
    assert_eq!(right.true_over_commanded, left.true_over_commanded);
    assert_eq!(right.hist_15deg, left.hist_15deg);
    let astray = learned("forward,1,0,270\n", 0.0).unwrap().report.moments;
    assert!((astray["dtheta_minus_cmd_rad"].mean + std::f64::consts::FRAC_PI_2).abs() < 1e-12);
}

#[test]
fn damaged_rows_name_line_and_column() {
    let cases = [
        ("jump,1,0,0\n", (2, 1)),
        ("forward,x,0,0\n", (2, 9)),
        ("forward,1e9,0,0\n", (2, 9)),
        ("forward,1,0,720\n", (2, 13)),
    ];
    for (row, position) in cases {
        assert_eq!(learned(row, 0.5).unwrap_err().line_and_column(), Some(position), "{row}");
    }
    assert!(learned("", 0.5).unwrap_err().cause().contains("no displacements"));
}

/// Rows of forward moves of robots with a chance of success, in turns.
fn rows_of_robots(chances_percent: &[u32], moves: u32) -> String {
    let mut text = String::from("cycle,robot,action,ahead_boxes,left_boxes,turn_deg\n");
    for cycle in 0..moves {
        for (robot, percent) in chances_percent.iter().enumerate() {
            // Spread evenly, so that each robot has its share in every quarter.
            let ahead = u32::from((cycle * 37 + robot as u32 * 11) % 100 < *percent);
            text += &format!("{cycle},{robot},forward,{ahead},0,0\n");
        }
    }
    text
}

#[test]
fn robots_that_differ_are_a_warning_that_names_them() {
    let mut chances = [60; 13];
    chances[10..].fill(88);
    let same = |options| options;
    let model = learned_table(&rows_of_robots(&chances, 400), 0.5, same).unwrap();
    let told = model.report.to_string().replace('\n', " ");
    assert!(told.contains("the 13 robots differ"), "{told}");
    let odd = &model.report.hold_out.iter().find(|fit| !fit.odd_parts.is_empty()).unwrap();
    assert_eq!(odd.odd_parts.len(), 3, "{odd:?}");
    let alike = learned_table(&rows_of_robots(&[60; 13], 400), 0.5, same).unwrap();
    assert!(alike.report.to_string().contains("agree as far as"), "{}", alike.report);
    let only = |options| EffectorOptions { robots: vec![10, 11, 12], ..options };
    let chosen = learned_table(&rows_of_robots(&chances, 400), 0.0, only).unwrap();
    assert!((chosen.report.transitions.unwrap().ahead - 0.88).abs() < 1e-9);
}

#[test]
fn errors_that_change_in_time_are_a_warning_though_every_second_move_agrees() {
    let first = rows_of_robots(&[90, 90], 400);
    let later = rows_of_robots(&[75, 75], 400);
    let both = first + later.split_once('\n').unwrap().1;
    let report = learned_table(&both, 0.5, |options| options).unwrap().report;
    let told = report.to_string().replace('\n', " ");
    assert!(told.contains("the quarters of the log differ"), "{told}");
    assert!(!told.contains("robots differ"), "both robots change alike: {told}");
}

#[test]
fn effectors_are_told_apart_and_a_table_may_know_its_box() {
    let text = "effector,box_m,action,ahead_boxes,left_boxes,turn_deg\n\
        slow,0.5,forward,0,0,0\nfast,0.5,forward,1,0,0\nfast,0.5,4,1,0,0\n";
    let error = learned_table(text, 0.0, |options| options).unwrap_err();
    assert!(error.cause().contains("`fast`, `slow`") && error.remedy().contains("--effector fast"));
    let named = |name: &str| {
        let effector = Some(name.to_string());
        learned_table(text, 0.0, |options| EffectorOptions { effector, ..options })
    };
    let model = named("fast").unwrap();
    assert_eq!(model.report.transitions.unwrap().ahead, 1.0);
    assert_eq!((model.profile.box_m, model.report.rejected["own_action"]), (Some(0.5), 1));
    assert!(named("quick").unwrap_err().remedy().contains("`fast`, `slow`"));
    let effector = Some("fast".to_string());
    let other = |options| EffectorOptions { box_m: Some(0.25), effector, ..options };
    assert!(learned_table(text, 0.0, other).unwrap_err().cause().contains("0.5 m beside"));
}

#[test]
fn a_damaged_row_is_counted_and_too_many_take_the_intervals() {
    let rows =
        |damaged: usize| "forward,1,0,0\n".repeat(90) + &"forward,oops,0,0\n".repeat(damaged);
    let few = learned(&rows(4), 0.5).unwrap();
    assert_eq!((few.report.left_out.samples, few.report.left_out.unexplained), (94, 4));
    assert!(
        few.report.warnings[0].contains("4 damaged rows")
            && few.report.warnings[0].contains("92:9")
    );
    assert!(few.report.probabilities.iter().all(|estimate| estimate.interval.is_some()));
    let many = learned(&rows(10), 0.5).unwrap();
    assert!(many.report.warnings[0].starts_with("no intervals: 10 of 100 samples (10.0 %)"));
    assert!(many.report.probabilities.iter().all(|estimate| estimate.interval.is_none()));
    let accepted = |mut options: EffectorOptions| {
        options.estimate.max_unexplained = 0.11;
        options
    };
    let told = learned_table(&format!("{HEAD}{}", rows(10)), 0.5, accepted).unwrap();
    assert!(told.report.probabilities.iter().all(|estimate| estimate.interval.is_some()));
    assert!(learned(&rows(91), 0.5).is_err(), "more than half");
}

#[test]
fn a_run_knows_its_box_and_whether_its_wheels_err() {
    let table = CsvTable::parse(&"motions", &format!("{HEAD}forward,1,0,0\n")).unwrap();
    let facts = |regime: &str| {
        let facts = [("box_m", "0.25"), ("regime", regime), ("obstacle_rule", "renormalise")];
        facts.map(|(name, fact)| (name.to_string(), fact.to_string()))
    };
    let options = EffectorOptions::default();
    let model = crate::effector::learn_run(&table, &facts("sensors"), &options).unwrap();
    assert_eq!((model.profile.box_m, model.report.warnings.len()), (Some(0.25), 2));
    let other = EffectorOptions { box_m: Some(0.5), ..options.clone() };
    let error = crate::effector::learn_run(&table, &facts("both"), &other).unwrap_err();
    assert!(error.cause().contains("boxes of 0.25 m, not 0.5 m"), "{error}");
    let without = crate::effector::learn_csv(&table, &options).unwrap();
    assert!(without.report.warnings[0].contains("--box") && without.profile.box_m.is_none());
}

proptest::proptest! {
    #[test]
    fn any_rows_are_learned_or_refused(
        rows in "((forward|left|right|stay|3),-?[0-9]{1,2}(\\.[0-9])?,-?[0-9](\\.[0-9])?,-?[0-9]{0,3}\n){0,9}"
    ) {
        if let Ok(model) = learned(&rows, 0.5) {
            for (action, transitions) in &model.profile.actions {
                let sum: f64 = transitions.iter().map(|transition| transition.p).sum();
                proptest::prop_assert!((sum - 1.0).abs() < 1e-9, "{}: {}", action, sum);
                proptest::prop_assert!(transitions.iter().all(|t| t.path.len() <= 16));
            }
        }
    }
}

#[test]
fn rows_with_fields_too_many_or_too_few_are_left_out_and_counted() {
    let rows = "forward,1,0,0\n".repeat(8);
    let text = format!("{HEAD}{rows}forward,1,0\nforward,1,0,0,9\n");
    let table = CsvTable::parse_recording(&"f.csv", &text).unwrap();
    let report = learn(&table, &EffectorOptions::default()).unwrap().report;
    assert_eq!((report.events, report.rejected["damaged_row"]), (8, 2));
    let warning = report.warnings.iter().find(|warning| warning.contains("damaged rows")).unwrap();
    assert!(warning.contains("f.csv:10:1: the row has 3 fields, the header 4"), "{warning}");
    let half = format!("{HEAD}forward,1,0,0\nforward,1\nforward,1\n");
    let table = CsvTable::parse_recording(&"f.csv", &half).unwrap();
    assert!(learn(&table, &EffectorOptions::default()).is_err(), "more than half");
}

#[test]
fn an_effector_has_its_share_of_the_rows_whose_own_is_not_known() {
    let text = format!(
        "effector,action,ahead_boxes,left_boxes,turn_deg\n{}{}{}",
        "slow,forward,0,0,0\n".repeat(90),
        "fast,forward,1,0,0\n".repeat(10),
        "forward\n".repeat(20)
    );
    let table = CsvTable::parse_recording(&"f.csv", &text).unwrap();
    for (name, rows, damaged) in [("fast", 10, 2), ("slow", 90, 18)] {
        let effector = Some(name.to_string());
        let report =
            learn(&table, &EffectorOptions { effector, ..Default::default() }).unwrap().report;
        assert_eq!((report.events, report.rejected["damaged_row"]), (rows, damaged));
    }
}

#[test]
fn turns_in_radians_are_warned_of() {
    let warnings = |turn: &str| {
        let turn: f64 = turn.parse().unwrap();
        let rows = format!("left,0,0,{turn}\nright,0,0,{}\n", -turn).repeat(5);
        learned(&rows, 0.5).unwrap().report.warnings
    };
    assert!(warnings("1.571").iter().any(|w| w.ends_with("turn_deg looks like radians")));
    assert!(!warnings("88").iter().any(|w| w.contains("radians")));
    assert!(!warnings("88").iter().any(|w| w.contains("not commanded")));
    let other_side = warnings("-88");
    assert!(
        other_side
            .iter()
            .any(|w| w.starts_with("10 of 10 turns go to the side that was not commanded")),
        "{other_side:?}"
    );
    // A turn of 270 degrees to the left ends on the right.
    assert!(warnings("270").iter().any(|w| w.contains("not commanded")));
}

#[test]
fn moves_in_meters_are_warned_of() {
    let warnings = |ahead: &str, box_m: Option<f64>| {
        let text = format!("{HEAD}{}", format!("forward,{ahead},0,0\n").repeat(20));
        let options = |options| EffectorOptions { box_m, ..options };
        learned_table(&text, 0.5, options).unwrap().report.warnings
    };
    let has = |warnings: Vec<String>| warnings.iter().any(|w| w.ends_with("looks like meters"));
    assert!(has(warnings("0.248", None)) && has(warnings("0.248", Some(0.25))));
    assert!(!has(warnings("0.98", None)) && !has(warnings("0.3", Some(0.5))));
}

#[test]
fn a_row_whose_box_is_none_is_damaged_and_the_boxes_of_other_effectors_do_not_count() {
    let text = format!(
        "effector,box_m,action,ahead_boxes,left_boxes,turn_deg\n{}fast,,forward,1,0,0\nfast,-1,forward,1,0,0\n\
         slow,0.5,forward,1,0,0\n",
        "fast,0.25,forward,1,0,0\n".repeat(8)
    );
    let effector = Some("fast".to_string());
    let chosen = |options| EffectorOptions { effector, ..options };
    let model = learned_table(&text, 0.5, chosen).unwrap();
    assert_eq!((model.profile.box_m, model.report.rejected["damaged_row"]), (Some(0.25), 2));
    let warned = &model.report.warnings;
    assert!(warned.iter().any(|w| w.contains("10:6: `` is not a finite number")), "{warned:?}");
}

#[test]
fn the_remedy_for_several_effectors_is_a_command_that_works() {
    let head = "effector,action,ahead_boxes,left_boxes,turn_deg\n";
    let text = format!("{head},forward,1,0,0\nmy wheels,forward,1,0,0\n");
    let error = learned_table(&text, 0.5, |options| options).unwrap_err();
    assert!(error.remedy().ends_with("--effector 'my wheels'"), "{error}");
}

#[test]
fn a_table_of_which_no_row_fits_its_header_says_so() {
    // Commas between fields and in numbers.
    let text = format!("{HEAD}forward,1,0,0,0,0,0\nforward,0,9,0,0,0,0\n");
    let table = CsvTable::parse_recording(&"f.csv", &text).unwrap();
    let error = learn(&table, &EffectorOptions::default()).unwrap_err();
    assert!(error.cause().starts_with("the row has 7 fields, the header 4"), "{error}");
    let blanks = format!("{}forward 1 0 0\n", HEAD.replace(',', " "));
    let table = CsvTable::parse_recording(&"f.csv", &blanks).unwrap();
    let error = learn(&table, &EffectorOptions::default()).unwrap_err();
    assert!(error.remedy().starts_with("separate the columns"), "{error}");
}

#[test]
fn a_table_says_which_columns_are_not_read_and_how_numbers_were() {
    let text =
        format!("{}forward;1,5;0;0;no\n", HEAD.replace(',', ";").replace("deg", "deg;contakt"));
    let table = CsvTable::parse(&"f.csv", &text).unwrap();
    let warnings =
        super::super::learn_csv(&table, &EffectorOptions::default()).unwrap().report.warnings;
    let has = |words: &str| warnings.iter().any(|warning| warning.contains(words));
    assert!(has("guessed: commas in numbers are decimal commas"), "{warnings:?}");
    assert!(has("not used: columns `contakt`"), "{warnings:?}");
}
