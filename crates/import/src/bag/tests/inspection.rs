//! What the report of a bag says without anything being learned from it.

use super::*;

/// What is said of a drive of 60 s with truth at these stamps in ms and positions in m, by the time of the recording.
fn said_of(
    stamp_ms: impl Fn(u64) -> u64,
    truth_m: impl Fn(u64, f64) -> f64,
    odometry_m: impl Fn(u64, f64) -> f64,
) -> Vec<String> {
    let mut entries = Vec::new();
    for k in 0..600 {
        let t_ms = 7_000_000 + 100 * k;
        let x_m = 0.05 * k as f64;
        entries.push((t_ms + 5, odometry(t_ms, odometry_m(k, x_m))));
        entries.push((t_ms + 6, truth(stamp_ms(t_ms), truth_m(k, x_m))));
    }
    let (_folder, path) = timed_bag(&entries);
    inspect(&path).unwrap().findings.iter().map(ToString::to_string).collect()
}

fn as_it_is(_: u64, x_m: f64) -> f64 {
    x_m
}

#[test]
fn a_report_names_truth_that_jumps_and_odometry_that_starts_again() {
    assert_eq!(said_of(|t_ms| t_ms, as_it_is, as_it_is), [""; 0]);
    let lost =
        said_of(|t_ms| t_ms, |k, x_m| if (300..320).contains(&k) { 0.0 } else { x_m }, as_it_is);
    let words = "suspicious: jumps of /truth, which no robot makes that drives at most 1.50 m/s (2 times), \
                 at 7030.000 s: 14.95 m and 0.00 rad in 0.100 s";
    assert!(lost.len() == 1 && lost[0].starts_with(words), "{lost:?}");
    let restarted =
        said_of(|t_ms| t_ms, as_it_is, |k, x_m| if k >= 300 { x_m - 15.0 } else { x_m });
    let words = "suspicious: jumps of /odom (odom > base), which no robot makes";
    assert!(restarted.len() == 1 && restarted[0].starts_with(words), "{restarted:?}");
}

#[test]
fn a_report_names_clocks_that_are_set_that_differ_and_that_run_at_another_rate() {
    let cases: [(&dyn Fn(u64) -> u64, &str); 5] = [
        (
            &|t_ms| if t_ms < 7_030_000 { t_ms } else { t_ms + 9_000_000 },
            "suspicious: stamps of /truth that jump ahead, at 16030.000 s by 9000.100 s",
        ),
        (
            &|t_ms| t_ms - 6_990_000,
            "suspicious: the stamps of /truth are 6990.001 s behind those of /odom",
        ),
        (&|t_ms| t_ms - 2000, "suspicious: the stamps of /truth are 2.001 s behind those of /odom"),
        (&|t_ms| 3_500_000 + t_ms / 2, "note: the stamps of /truth run 0.50 times as fast"),
        (
            &|t_ms| if t_ms == 7_030_000 { 0 } else { t_ms },
            "suspicious: messages on /truth whose stamp is 0, message 301",
        ),
    ];
    for (stamp_ms, words) in cases {
        let said = said_of(stamp_ms, as_it_is, as_it_is);
        assert!(said.iter().any(|line| line.starts_with(words)), "{words}: {said:?}");
    }
}

#[test]
fn a_report_of_a_bag_counts_topics_messages_and_what_is_odd() {
    let mut entries = drive();
    entries.extend([scan(0, "base", &[1.0, f32::NAN]), truth(0, 0.0)]);
    let (_folder, path) = bag(&entries);
    let report = inspect(&path).unwrap();
    assert_eq!(report.format, "bag (MCAP)");
    assert_eq!(report.facts[0].value, "/odom: nav_msgs/msg/Odometry, 20 messages");
    let lines: Vec<String> = report.findings.iter().map(ToString::to_string).collect();
    assert_eq!(lines[0], "suspicious: stamps of /truth that go back, message 21: 1.900 s");
    assert!(lines[1].starts_with("guessed: NaN on /scan is no echo (1 of 2 ranges"), "{lines:?}");
    assert_eq!((report.kept[0].count, report.kept[1].count), (3, 42));
}

#[test]
fn a_report_warns_of_a_clock_that_is_ahead_and_not_of_one_stray_stamp() {
    let said = |stamp_ms: &dyn Fn(u64) -> u64| {
        let entries: Vec<(u64, Entry)> =
            (0..9000).map(|k| (7_000_000 + 100 * k, truth(stamp_ms(k), 0.0))).collect();
        let (_folder, path) = timed_bag(&entries);
        let report = inspect(&path).unwrap();
        report.findings.iter().map(ToString::to_string).collect::<Vec<_>>()
    };
    let stray = said(&|k| 7_000_000 + 100 * k + if k == 4321 { 450 } else { 0 });
    assert_eq!(stray, [""; 0]);
    let ahead = said(&|k| 7_000_400 + 100 * k);
    assert!(
        ahead[0].starts_with("suspicious: stamps of /truth that lie 0.400 s after the recording"),
        "{ahead:?}"
    );
}

#[test]
fn a_report_lists_the_stamps_of_a_few_topics() {
    let names: Vec<&'static str> = vec![
        "/a", "/b", "/c", "/d", "/e", "/f", "/g", "/h", "/i", "/j", "/k", "/l", "/m", "/n", "/o",
        "/p", "/q", "/r", "/s", "/t", "/u", "/v",
    ];
    let entries: Vec<Entry> = names.iter().map(|name| posed(name, 5, at(0.0, 0.0))).collect();
    let (_folder, path) = bag(&entries);
    let report = inspect(&path).unwrap();
    let stamps: Vec<&str> =
        report.facts.iter().filter(|fact| fact.name == "stamps").map(|fact| &*fact.value).collect();
    assert_eq!((stamps.len(), stamps[20]), (21, "2 more topics"));
}

#[test]
fn the_frames_of_transforms_are_listed() {
    let edges = [("map", "odom", at(0.0, 0.0)), ("odom", "base", at(1.0, 0.0))];
    let (_folder, path) = bag(&[transforms("/tf", 0, &edges), transforms("/tf", 100, &edges[1..])]);
    let report = inspect(&path).unwrap();
    let frames: Vec<&str> =
        report.facts.iter().filter(|fact| fact.name == "frames").map(|fact| &*fact.value).collect();
    assert_eq!(frames, ["/tf: map > odom, 1 transforms", "/tf: odom > base, 2 transforms"]);
}
