//! Logs that are written here, in every form.

use super::*;

const SMALL: &str = "# head\nPARAM a b\nODOM 0 0 0 0 0 0 0.1 h 0.1\n\
    FLASER 2 1.5 81.83 0 0 0.5 0 0 0.5 1.0 h 1.0\nNEFF 30\n\
    ODOM 0 0 0.5 0 0 0 1e-42 h 0\nODOM 1 0 0.5 0 0 0 1.9 h 1.9\n\
    FLASER 2 1.5 2 1 0.1 0.5 1 0.1 0.5 2.0 h 2.0\n";

fn read_text(text: &str) -> CarmenLog {
    parse("f.log", text, None).unwrap()
}

fn corrected(text: &str) -> CorrectedLog {
    match read_text(text).motion {
        CarmenMotion::Corrected(log) => log,
        other => panic!("{other:?}"),
    }
}

fn tracks(text: &str) -> [Track; 2] {
    match read_text(text).motion {
        CarmenMotion::Tracks { odometry, truth } => [odometry, truth],
        other => panic!("{other:?}"),
    }
}

fn lines(report: &ImportReport) -> Vec<String> {
    report.findings.iter().map(ToString::to_string).collect()
}

/// A log of ROBOTLASER1 whose odometry is short by a part of the way.
fn robotlaser(n: u32, odometry_share: f64) -> String {
    let mut text = String::new();
    for k in 0..n {
        let (t, x_m) = (0.3 * f64::from(k), 0.1 * f64::from(k));
        let odometry_m = odometry_share * x_m;
        text += &format!("ODOM {odometry_m:.4} 0 0 0.3 0 0 {t:.3} host {t:.3}\n");
        text += &format!(
            "ROBOTLASER1 0 -1.57 3.14 0.78 81.83 0.01 0 3 2.0 2.0 2.0 1 7 {:.4} 0 0 {x_m:.4} 0 0 0.3 0 0.1 0.1 0 \
             {t:.3} host {t:.3}\n",
            x_m + 0.2
        );
    }
    text
}

#[test]
fn odometry_belongs_to_the_scan_before_it() {
    let log = corrected(SMALL);
    assert_eq!(log.odometry_before.len(), 1);
    assert_eq!(log.scans.len(), 2);
    assert_eq!(log.scans[0].odometry, [[0.0, 0.0, 0.5], [1.0, 0.0, 0.5]]);
    assert_eq!((log.scans[1].t_secs, log.scans[1].pose), (2.0, [1.0, 0.1, 0.5]));
    let said = lines(&read_text(SMALL).report);
    assert_eq!(said, ["not used: messages NEFF, 1 of them", "not used: messages PARAM, 1 of them"]);
}

#[test]
fn the_robot_of_robotlaser_is_compared_with_odometry_in_a_frame_of_its_own() {
    let [odometry, truth] = tracks(&robotlaser(40, 0.97));
    assert_eq!((odometry.len(), truth.len()), (40, 40));
    assert!((truth[39].position_m[0] - 3.9).abs() < 1e-9);
    assert!((odometry[39].position_m[0] - 3.783).abs() < 1e-9);
    assert!((truth[39].t_secs - 11.7).abs() < 1e-9);
}

#[test]
fn robotlaser_that_odometry_starts_again_at_is_a_corrected_log() {
    let text = "ROBOTLASER1 0 0 0 0 9 0 0 1 2.0 0 0 0 0 0 0 0 0 0 0 0 0 0.0 h 0\nODOM 0 0 0 0 0 0 0 h 0\n\
        ODOM 1.1 0 0 0 0 0 0 h 0\nROBOTLASER1 0 0 0 0 9 0 0 1 2.0 0 0 0 0 1 0 0 0 0 0 0 0 2.0 h 0\n\
        ODOM 1 0 0 0 0 0 0 h 0\n";
    let log = corrected(text);
    assert_eq!(log.scans[0].odometry, [[0.0; 3], [1.1, 0.0, 0.0]]);
    assert_eq!(log.scans[1].pose, [1.0, 0.0, 0.0]);
}

#[test]
fn true_poses_are_compared_with_the_odometry_beside_them() {
    let mut text = String::new();
    for k in 0..40 {
        let x_m = 0.1 * f64::from(k);
        text += &format!(
            "TRUEPOS {x_m:.4} 0 0 {:.4} 0 0 {:.3} host 0\n",
            0.97 * x_m,
            0.3 * f64::from(k)
        );
    }
    let [odometry, truth] = tracks(&text);
    assert!((truth[39].position_m[0] - 3.9).abs() < 1e-9);
    assert!((odometry[39].position_m[0] - 3.783).abs() < 1e-9);
    let both = format!("{text}{}", robotlaser(40, 0.97));
    assert!(lines(&read_text(&both).report)[0].contains("ROBOTLASER1, 40 of them, beside TRUEPOS"));
    // A body that is lost for a while, and a clock that is set back.
    let lost =
        text.replace("TRUEPOS 2.0000 0 0", "TRUEPOS 0 0 0").replace("11.400 host", "0.100 host");
    let log = read_text(&lost);
    let said = lines(&log.report);
    assert!(
        said[0].contains("stamps that go back") && said[1].contains("jumps of the true poses"),
        "{said:?}"
    );
    assert_eq!(log.report.dropped(), 1);
}

#[test]
fn a_log_in_millimeters_and_a_clock_that_is_set_forward_are_suspicious() {
    let said_of = |length: f64, jump_s: f64| {
        let mut text = String::new();
        for k in 0..40 {
            let x = 0.1 * length * f64::from(k);
            let t_s = 0.3 * f64::from(k) + if k >= 20 { jump_s } else { 0.0 };
            text += &format!("TRUEPOS {x:.4} 0 0 {:.4} 0 0 {t_s:.3} host {t_s:.3}\n", 0.97 * x);
        }
        lines(&read_text(&text).report)
    };
    assert_eq!(said_of(1.0, 0.0), [""; 0]);
    let said = said_of(1000.0, 0.0);
    assert!(said[0].starts_with("suspicious: the usual speed of ODOM is 323 m/s"), "{said:?}");
    let said = said_of(1.0, 1e6);
    assert!(said[0].starts_with("suspicious: stamps that jump ahead"), "{said:?}");
}

#[test]
fn flaser_with_a_second_pose_and_no_odom_is_compared_with_that() {
    let mut text = String::new();
    for k in 0..40 {
        let x_m = 0.1 * f64::from(k);
        let t = 0.3 * f64::from(k);
        text += &format!("FLASER 1 2.0 {x_m:.4} 0 0 {:.4} 0 0 {t:.3} h 0\n", 0.9 * x_m);
    }
    let [odometry, _] = tracks(&text);
    assert!((odometry[39].position_m[0] - 3.51).abs() < 1e-9);
    let copied = robotlaser(0, 1.0)
        + &(0..40).map(|k| format!("FLASER 1 2.0 {k} 0 0 {k} 0 0 {k} h 0\n")).collect::<String>();
    let error = parse("f", &copied, None).unwrap_err();
    assert!(error.cause().contains("40 FLASER messages are those of odometry"), "{error}");
}

#[test]
fn a_log_that_nobody_has_corrected_teaches_nothing() {
    let error = parse("f.log", &robotlaser(40, 1.0), None).unwrap_err();
    assert!(error.cause().contains("no program has corrected it"), "{error}");
    assert!(error.remedy().contains("TRUEPOS"));
}

#[test]
fn damaged_messages_are_skipped_and_counted() {
    let text = format!("{SMALL}ODOM 0 0 0\nFLASER 3 1 2\n");
    let report = read_text(&text).report;
    assert_eq!(report.dropped(), 2);
    let said = lines(&report);
    assert!(
        said[0].contains("line 9: the ODOM message has 4 words instead of 10, line 10"),
        "{said:?}"
    );
    let folder = tempfile::tempdir().unwrap();
    let [path, out] = ["a.log", "b.log"].map(|name| folder.path().join(name));
    std::fs::write(&path, &text).unwrap();
    assert_eq!(write_clean(&path, &out).unwrap().dropped(), 2);
    assert_eq!(std::fs::read_to_string(&out).unwrap(), SMALL);
    assert_eq!(inspect(&out).unwrap().dropped(), 0);
}

#[test]
fn a_log_of_which_more_than_half_is_damaged_names_line_and_column() {
    let cases = [
        ("ODOM 0 0 0\n", (1, 10)),
        ("\nODOM 0 x 0 0 0 0 0 h 0\n", (2, 8)),
        ("FLASER 3 1 2 0 0 0 0 0 0 1 h 1\n", (1, 30)),
        ("FLASER 4000000000 1\n", (1, 8)),
        ("FLASER -1 1\n", (1, 8)),
        ("FLASER\n", (1, 1)),
        ("ROBOTLASER1 0 0 0 0 9 0 0 2 1 1 4000000000\n", (1, 33)),
        ("TRUEPOS 0 0 0\n", (1, 13)),
    ];
    for (text, position) in cases {
        assert_eq!(parse("f", text, None).unwrap_err().line_and_column(), Some(position), "{text}");
    }
}

#[test]
fn a_log_without_poses_to_compare_with_says_what_it_has() {
    let error = parse("f", "ODOM 0 0 0 0 0 0 0 h 0\nRAWLASER1 x\n", None).unwrap_err();
    assert!(error.cause().contains("it has 1 ODOM, 1 RAWLASER1"), "{error}");
    let error = parse("f", &robotlaser(40, 0.9).replace("ODOM", "PARAM"), None).unwrap_err();
    assert!(error.cause().contains("no odometry"), "{error}");
}

proptest::proptest! {
    #[test]
    fn any_text_is_a_log_or_an_error(
        text in "((ODOM|FLASER|ROBOTLASER1|TRUEPOS|NEFF|#)?( -?[0-9.e]{0,4}){0,24}\n){0,8}",
    ) {
        let _ = parse("f", &text, None);
    }
}
