//! Scans as drivers write them.

use super::kinds::LIMIT_TOLERANCE;
use super::*;
use crate::bag::messages::{Header, Time};
use crate::report::ImportReport;

fn scan(range_max_m: f32, ranges_m: &[f32]) -> LaserScan {
    LaserScan {
        header: Header { stamp: Time::from_ns(0), frame_id: "laser".into() },
        angle_min_rad: 0.0,
        angle_max_rad: 0.1 * (ranges_m.len() as f32 - 1.0),
        angle_increment_rad: 0.1,
        time_increment_s: 0.0,
        scan_time_s: 0.1,
        range_min_m: 0.1,
        range_max_m,
        ranges_m: ranges_m.to_vec(),
        intensities: Vec::new(),
    }
}

/// The scans by REP 117, and what is said about them.
fn read(scans: &[LaserScan], given: Option<NoEcho>) -> (Vec<LaserScan>, Vec<String>) {
    let mut counts = RangeCounts::default();
    scans.iter().for_each(|scan| counts.add(scan));
    let mut report = ImportReport::new("bag");
    let convention = counts.convention("/scan", given, &mut report);
    let mut scans = scans.to_vec();
    scans.iter_mut().for_each(|scan| convention.apply(scan));
    (scans, report.findings.iter().map(ToString::to_string).collect())
}

const INF: f32 = f32::INFINITY;
const NAN: f32 = f32::NAN;

fn same(a: &[f32], b: &[f32]) -> bool {
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| a == b || a.is_nan() && b.is_nan())
}

#[test]
fn scans_by_rep_117_stay_as_they_are() {
    let ranges = [1.0, INF, 7.9, 8.0, -INF, NAN];
    let (scans, said) = read(&[scan(8.0, &ranges)], None);
    assert!(same(&scans[0].ranges_m, &ranges), "{:?}", scans[0].ranges_m);
    assert_eq!(said.len(), 1);
    assert!(said[0].starts_with("not used: ranges on /scan that are NaN"), "{said:?}");
}

#[test]
fn each_way_to_write_no_echo_is_recognized_by_its_count_and_named() {
    let cases: [(&[f32], &str); 4] = [
        (&[1.0, NAN, 2.0, NAN], "guessed: NaN on /scan is no echo (2 of 4 ranges, 50.00 %)"),
        (&[1.0, 0.0, 2.0, 0.0], "guessed: 0 or less on /scan is no echo (2 of 4"),
        (&[1.0, 8.0, 2.0, 8.0], "guessed: the greatest range on /scan is no echo (2 of 4"),
        (&[1.0, 9.0, 2.0, 8.001], "guessed: the greatest range on /scan is no echo (2 of 4"),
    ];
    for (ranges, words) in cases {
        let (scans, said) = read(&[scan(8.0, ranges)], None);
        assert_eq!(scans[0].ranges_m, [1.0, INF, 2.0, INF], "{words}");
        assert!(said[0].starts_with(words), "{said:?}");
        assert!(said[0].ends_with("give --no-echo inf where it is no measurement"), "{said:?}");
    }
}

#[test]
fn the_choice_can_be_given() {
    let (scans, said) = read(&[scan(8.0, &[1.0, NAN])], Some(NoEcho::Infinite));
    assert!(same(&scans[0].ranges_m, &[1.0, NAN]));
    assert!(said[0].starts_with("not used: ranges on /scan that are NaN"), "{said:?}");
    assert_eq!(
        ["inf", "nan", "zero", "max", "x"].map(NoEcho::from_name).map(|n| n.is_some()),
        [true, true, true, true, false]
    );
}

#[test]
fn a_limit_that_is_the_greatest_range_of_its_own_scan_is_an_echo() {
    let all =
        [scan(5.5, &[1.0, 5.5, 2.0]), scan(6.25, &[6.25, INF, 2.0]), scan(4.0, &[1.0, 4.0, 3.0])];
    let (scans, said) = read(&all, None);
    assert!(scans.iter().all(|scan| scan.range_max_m == 6.25));
    assert_eq!(scans[0].ranges_m, [1.0, 5.5, 2.0]);
    assert_eq!(scans[1].ranges_m, [6.25, INF, 2.0]);
    assert!(
        said[0].contains("range_max of each scan on /scan is its own greatest range: 6.25 m"),
        "{said:?}"
    );
}

#[test]
fn a_scanner_without_a_limit_reaches_as_far_as_it_has_measured() {
    let (scans, said) = read(&[scan(INF, &[1.0, 7.5, INF]), scan(INF, &[2.0, 3.0, INF])], None);
    assert_eq!((scans[1].range_max_m, &scans[0].ranges_m[..]), (7.5, &[1.0, 7.5, INF][..]));
    assert!(said[0].contains("is infinite: 7.5 m"), "{said:?}");
}

#[test]
fn limits_that_differ_by_scan_hold_for_their_scans() {
    let all = [scan(5.0, &[1.0, 5.0, 5.0, 5.0]), scan(8.0, &[8.0, 8.0, 8.0, 6.0])];
    let (scans, _) = read(&all, None);
    assert_eq!(scans[0].ranges_m, [1.0, INF, INF, INF]);
    assert_eq!((scans[1].range_max_m, &scans[1].ranges_m[..]), (8.0, &[INF, INF, INF, 6.0][..]));
}

#[test]
fn what_is_nearer_than_the_least_range_is_too_near() {
    let (scans, _) = read(&[scan(8.0, &[0.05, INF, -1.0])], None);
    assert!(same(&scans[0].ranges_m, &[-INF, INF, NAN]), "{:?}", scans[0].ranges_m);
}

#[test]
fn a_scan_without_any_range_is_blank() {
    assert!(is_blank(&scan(8.0, &[0.0, NAN])));
    assert!(!is_blank(&scan(8.0, &[0.0, INF])) && !is_blank(&scan(8.0, &[0.0, 8.0])));
}

#[test]
fn a_value_below_the_least_range_or_just_below_the_limit_is_no_echo_where_all_have_it() {
    let near = [scan(8.0, &[1.0, 0.05, 2.0, 0.05, 0.05])];
    let (scans, said) = read(&near, None);
    assert_eq!(scans[0].ranges_m, [1.0, INF, 2.0, INF, INF]);
    assert!(
        said[0].starts_with("guessed: a range below the least one on /scan is no echo (3 of 5"),
        "{said:?}"
    );
    let (scans, _) = read(&near, Some(NoEcho::Infinite));
    assert_eq!(scans[0].ranges_m, [1.0, -INF, 2.0, -INF, -INF]);
    let (scans, said) = read(&[scan(8.0, &[1.0, 7.99, 7.995, 7.99, 7.99, 7.5])], None);
    assert_eq!(scans[0].ranges_m, [1.0, INF, 7.995, INF, INF, 7.5]);
    assert!(
        said[0].starts_with("guessed: the greatest range on /scan is no echo (3 of 6"),
        "{said:?}"
    );
    // A wall that is seen at many ranges near to the limit.
    let (scans, said) = read(&[scan(8.0, &[7.93, 7.94, 7.95, 7.96, 7.97, 7.99, 7.99, 7.99])], None);
    assert!(
        scans[0].ranges_m.iter().all(|range_m| range_m.is_finite()) && said.is_empty(),
        "{said:?}"
    );
}

#[test]
fn what_is_near_in_one_direction_or_by_the_same_beams_is_no_mark() {
    let with = |beams: &[usize], range_m: f32| {
        let mut ranges_m: Vec<f32> = (0..100_u8).map(|k| 1.0 + 0.01 * f32::from(k)).collect();
        beams.iter().for_each(|beam| ranges_m[*beam] = range_m);
        scan(8.0, &ranges_m)
    };
    // Two struts of the robot, and a wall just within the least range, as a robot sees them that stands.
    let wall: Vec<usize> = (40..60).collect();
    for beams in [&[7, 93][..], &wall] {
        let (scans, said) = read(&vec![with(beams, 0.09); 20], None);
        assert_eq!(scans[0].ranges_m[beams[0]], -INF, "{said:?}");
        assert!(!said.iter().any(|line| line.contains("is no echo")), "{said:?}");
    }
    // A few equal ranges in a long recording.
    let mut rare = vec![with(&[], 0.0); 100];
    for (k, beam) in [(3, 8), (50, 20), (70, 77)] {
        rare[k] = with(&[beam], 0.09);
    }
    let (_, said) = read(&rare, None);
    assert_eq!(said, [""; 0]);
    let (scans, said) = read(&vec![with(&wall, 7.96); 20], None);
    assert_eq!((scans[0].ranges_m[50], said.len()), (7.96, 0), "{said:?}");
    let moving: Vec<LaserScan> = (0..20).map(|k| with(&[k, 30 + 2 * k, 90 - k], 0.05)).collect();
    let (scans, said) = read(&moving, None);
    assert_eq!(scans[0].ranges_m[0], INF, "{said:?}");
}

#[test]
fn ranges_that_are_too_near_often_are_doubted() {
    let all = [scan(8.0, &[1.0, -INF, 2.0, -INF])];
    let (scans, said) = read(&all, None);
    assert_eq!(scans[0].ranges_m, [1.0, -INF, 2.0, -INF]);
    assert!(
        said[0].starts_with("suspicious: 50.00 % of the ranges on /scan are nearer"),
        "{said:?}"
    );
    assert!(
        said[0].ends_with("give --no-echo near if the driver writes so where nothing answers"),
        "{said:?}"
    );
    let (scans, _) = read(&all, Some(NoEcho::TooNear));
    assert_eq!(scans[0].ranges_m, [1.0, INF, 2.0, INF]);
    let (_, said) = read(&[scan(8.0, &[INF, -INF, 2.0])], None);
    assert_eq!(said, [""; 0], "a driver that writes inf for no echo means -inf");
}

#[test]
fn scans_in_degrees_or_millimeters_and_without_bearings_are_bad() {
    let plain = scan(8.0, &[1.0; 31]);
    assert_eq!(check(&plain), Ok(()));
    let cause = |change: fn(&mut LaserScan)| {
        let mut other = plain.clone();
        change(&mut other);
        check(&other).expect_err("a bad scan")
    };
    assert!(cause(|scan| scan.angle_increment_rad = 6.0).contains("looks like degrees"));
    assert!(cause(|scan| scan.angle_increment_rad = 0.0).contains("one bearing"));
    assert!(
        cause(|scan| (scan.range_min_m, scan.range_max_m) = (100.0, 8e3)).contains("millimeters")
    );
}

#[test]
fn a_limit_that_is_the_greatest_number_is_none() {
    let (scans, said) = read(&[scan(f32::MAX, &[1.0, 7.5, f32::MAX])], None);
    assert_eq!((scans[0].range_max_m, &scans[0].ranges_m[..]), (7.5, &[1.0, 7.5, INF][..]));
    assert!(said[0].contains("7.5 m, the greatest of all"), "{said:?}");
}

#[test]
fn scans_without_an_echo_and_those_that_end_elsewhere_are_doubted() {
    let (_, said) = read(&[scan(8.0, &[INF, INF])], None);
    assert!(
        said[0].starts_with("suspicious: none of the 2 ranges on /scan is an echo"),
        "{said:?}"
    );
    let mut other = scan(8.0, &[1.0, 2.0, 3.0, 4.0]);
    other.angle_max_rad = other.angle_min_rad + 9.0 * other.angle_increment_rad;
    let (_, said) = read(&[other], None);
    assert!(said[0].contains("angle_max is not the bearing of their last beam"), "{said:?}");
}

proptest::proptest! {
    #[test]
    fn any_scans_become_scans_by_rep_117(
        ranges in proptest::collection::vec(proptest::num::f32::ANY, 1..20),
        range_max_m in 0.2_f32..50.0,
    ) {
        let (scans, _) = read(&[scan(range_max_m, &ranges)], None);
        for range_m in &scans[0].ranges_m {
            let is_measured = (0.1..=scans[0].range_max_m * (1.0 + LIMIT_TOLERANCE)).contains(range_m);
            assert!(is_measured || range_m.is_nan() || range_m.is_infinite(), "{range_m}");
        }
    }
}

/// Where nothing answers changes from scan to scan, so that in all scans together every beam has the mark at times.
#[test]
fn a_mark_that_all_beams_have_at_times_is_no_echo_as_well() {
    let drive = |range_max_m: f32, mark_m: f32| {
        let ranges = |k: u16| {
            let range = move |beam: u16| match (k + 7 * beam) % 5 {
                0 => mark_m,
                other => 1.0 + 0.1 * f32::from(other) + 0.001 * f32::from(beam + k),
            };
            (0..40).map(range).collect::<Vec<f32>>()
        };
        let scans: Vec<LaserScan> = (0..50).map(|k| scan(range_max_m, &ranges(k))).collect();
        read(&scans, None)
    };
    // Just below the limit, far below it, and at the least range.
    for (range_max_m, mark_m, words) in [
        (8.0, 7.999, "the greatest range"),
        (8.0, 5.0, "the greatest range"),
        (8.0, 0.1, "a range below the least one"),
    ] {
        let (scans, said) = drive(range_max_m, mark_m);
        assert_eq!(scans[0].ranges_m[0], INF, "{mark_m}: {said:?}");
        assert!(said[0].starts_with(&format!("guessed: {words} on /scan is no echo (400 of 2000")));
    }
    // The greatest range of a scanner that stands, in a few directions.
    let still = vec![scan(8.0, &[5.0, 1.0, 2.0, 5.0, 3.0, 4.0]); 50];
    let (scans, said) = read(&still, None);
    assert_eq!((scans[0].ranges_m[0], said.len()), (5.0, 0), "{said:?}");
}
