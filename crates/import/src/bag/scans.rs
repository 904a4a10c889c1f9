//! Laser scans by REP 117: `inf` where nothing answers, `-inf` nearer than the scanner measures, NaN for no measurement.
//!
//! Many drivers break it. How one writes "no echo" is recognized by counts over the whole recording, and named; the
//! scans that are handed on follow REP 117.

use super::messages::LaserScan;
use crate::report::{ImportReport, Treatment};

/// Maximum number of beams of a scan: as many as a message of a megabyte holds.
const MAX_BEAMS: usize = 1 << 18;
/// Ranges are equal to a limit within this fraction of it: they are numbers of 32 bits.
const LIMIT_TOLERANCE: f32 = 1e-6;
/// A driver that gives each scan the greatest of its own ranges as limit has one beam at that limit, rarely more.
const MIN_AT_OWN_LIMIT: f64 = 0.5;
const MAX_AT_OWN_LIMIT: f64 = 2.0;
/// So many ranges at one limit, and this share of all, are no measurements: one of 32 bits hits a number by chance once
/// in a million times.
const MIN_AT_LIMIT: u64 = 3;
const MIN_SHARE_AT_LIMIT: f64 = 0.001;

/// What a driver writes where nothing answers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum NoEcho {
    /// `inf`, as REP 117 says.
    Infinite,
    /// NaN.
    NotANumber,
    /// 0, or a negative number.
    Zero,
    /// The greatest range.
    Maximum,
}

impl NoEcho {
    /// Parses `inf`, `nan`, `zero` or `max`.
    pub fn from_name(name: &str) -> Option<Self> {
        match name {
            "inf" => Some(Self::Infinite),
            "nan" => Some(Self::NotANumber),
            "zero" => Some(Self::Zero),
            "max" => Some(Self::Maximum),
            _ => None,
        }
    }

    fn describe(self) -> &'static str {
        match self {
            Self::Infinite => "inf",
            Self::NotANumber => "NaN",
            Self::Zero => "0",
            Self::Maximum => "the greatest range",
        }
    }
}

/// Checks that a scan has beams, and that its bearings and limits are valid.
pub(super) fn check(scan: &LaserScan) -> Result<(), String> {
    let n = scan.ranges_m.len();
    let bearings = [scan.angle_min_rad, scan.angle_increment_rad];
    let limits = [scan.range_min_m, scan.range_max_m];
    if n == 0 || n > MAX_BEAMS {
        return Err(format!("its scan has {n} beams"));
    }
    if !bearings.iter().all(|angle| angle.is_finite()) {
        return Err("its bearings are not finite".into());
    }
    if limits.iter().any(|limit| limit.is_nan()) || limits[0] < 0.0 || limits[1] <= limits[0] {
        return Err(format!("it measures ranges from {} to {} m", limits[0], limits[1]));
    }
    Ok(())
}

/// The kind of a range, by its own scan.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum RangeKind {
    /// Between the limits.
    Measured,
    Infinite,
    NotANumber,
    /// 0 or negative, `-inf` too.
    Zero,
    /// `-inf`, or above 0 and below the least range.
    TooNear,
    AtMaximum,
    BeyondMaximum,
}

fn kind_of(range_m: f32, scan: &LaserScan) -> RangeKind {
    let max_m = scan.range_max_m;
    if range_m.is_nan() {
        RangeKind::NotANumber
    } else if range_m == f32::INFINITY {
        RangeKind::Infinite
    } else if range_m == f32::NEG_INFINITY {
        RangeKind::TooNear
    } else if range_m <= 0.0 {
        RangeKind::Zero
    } else if max_m.is_finite() && (range_m - max_m).abs() <= LIMIT_TOLERANCE * max_m {
        RangeKind::AtMaximum
    } else if range_m > max_m {
        RangeKind::BeyondMaximum
    } else if range_m < scan.range_min_m {
        RangeKind::TooNear
    } else {
        RangeKind::Measured
    }
}

/// Counts of ranges by their kind, over the scans of a topic.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct RangeCounts {
    pub(super) scans: u64,
    pub(super) beams: u64,
    measured: u64,
    infinite: u64,
    not_a_number: u64,
    zero: u64,
    too_near: u64,
    at_maximum: u64,
    beyond_maximum: u64,
    /// The least and the greatest limit of the ranges of a scan.
    max_m: Option<[f32; 2]>,
    /// The greatest range between the limits of its scan.
    greatest_m: f32,
}

impl RangeCounts {
    pub(super) fn add(&mut self, scan: &LaserScan) {
        self.scans += 1;
        self.beams += scan.ranges_m.len() as u64;
        for range_m in &scan.ranges_m {
            let kind = kind_of(*range_m, scan);
            if kind == RangeKind::Measured {
                self.greatest_m = self.greatest_m.max(*range_m);
            }
            *match kind {
                RangeKind::Measured => &mut self.measured,
                RangeKind::Infinite => &mut self.infinite,
                RangeKind::NotANumber => &mut self.not_a_number,
                RangeKind::Zero => &mut self.zero,
                RangeKind::TooNear => &mut self.too_near,
                RangeKind::AtMaximum => &mut self.at_maximum,
                RangeKind::BeyondMaximum => &mut self.beyond_maximum,
            } += 1;
        }
        let max_m = scan.range_max_m;
        let [low, high] = self.max_m.unwrap_or([max_m; 2]);
        self.max_m = Some([low.min(max_m), high.max(max_m)]);
    }

    /// Returns whether each scan has the greatest of its own ranges as limit, so that a range at it is an echo.
    fn is_limit_measured(&self) -> bool {
        let is_varied = self.max_m.is_some_and(|[low, high]| low < high);
        let at_limit = self.at_maximum as f64 / (self.scans as f64).max(1.0);
        is_varied && (MIN_AT_OWN_LIMIT..=MAX_AT_OWN_LIMIT).contains(&at_limit)
    }

    /// Returns the limit for all scans where their own are none.
    fn measured_limit_m(&self) -> Option<f32> {
        let [_, high] = self.max_m?;
        if !high.is_finite() && self.greatest_m > 0.0 {
            return Some(self.greatest_m);
        }
        self.is_limit_measured().then_some(high)
    }

    /// Returns the most frequent value that may stand for "no echo"; `None` where none occurs.
    fn guess(&self) -> Option<NoEcho> {
        if self.infinite > 0 {
            return Some(NoEcho::Infinite);
        }
        let at_maximum = if self.is_limit_measured() { 0 } else { self.at_maximum };
        let counts = [
            (NoEcho::Maximum, at_maximum + self.beyond_maximum),
            (NoEcho::NotANumber, self.not_a_number),
            (NoEcho::Zero, self.zero),
        ];
        let (most, n) = counts.into_iter().max_by_key(|(_, n)| *n)?;
        (n > 0).then_some(most)
    }

    /// Chooses how the driver writes "no echo", and records what is not as REP 117 has it; `topic` is its name.
    pub(super) fn convention(
        &self,
        topic: &str,
        given: Option<NoEcho>,
        report: &mut ImportReport,
    ) -> ScanConvention {
        let no_echo = given.or_else(|| self.guess()).unwrap_or(NoEcho::Infinite);
        let convention = ScanConvention {
            no_echo,
            measured_limit_m: self.measured_limit_m(),
            is_maximum_no_echo: no_echo == NoEcho::Maximum
                || given.is_none() && self.is_maximum_repeated(),
        };
        self.record(topic, given.is_some(), &convention, report);
        convention
    }

    /// Returns whether ranges are equal to the limit more often than measurements can be.
    fn is_maximum_repeated(&self) -> bool {
        self.at_maximum >= MIN_AT_LIMIT
            && self.at_maximum as f64 >= MIN_SHARE_AT_LIMIT * self.beams as f64
            && !self.is_limit_measured()
    }

    fn count_of(&self, no_echo: NoEcho) -> u64 {
        match no_echo {
            NoEcho::Infinite => self.infinite,
            NoEcho::NotANumber => self.not_a_number,
            NoEcho::Zero => self.zero,
            NoEcho::Maximum => self.at_maximum + self.beyond_maximum,
        }
    }

    fn record(
        &self,
        topic: &str,
        is_given: bool,
        convention: &ScanConvention,
        report: &mut ImportReport,
    ) {
        let percent = |n: u64| {
            format!(
                "{n} of {} ranges, {:.2} %",
                self.beams,
                100.0 * n as f64 / self.beams.max(1) as f64
            )
        };
        let no_echo = convention.no_echo;
        let n = self.count_of(no_echo);
        if !is_given && no_echo != NoEcho::Infinite && n > 0 {
            let rule = format!(
                "{} on {topic} is no echo ({}), as no range is inf, which REP 117 asks for",
                no_echo.describe(),
                percent(n)
            );
            let remedy = "give --no-echo inf where it is no measurement";
            report.record(Treatment::Guessed, rule, "", remedy);
        }
        if let Some(limit_m) = convention.measured_limit_m {
            let cause =
                if self.is_limit_measured() { "its own greatest range" } else { "infinite" };
            let rule = format!(
                "range_max of each scan on {topic} is {cause}: {limit_m} m, the greatest of all, is taken for the limit"
            );
            report.record(Treatment::Guessed, rule, "", "");
        }
        let others = [
            (NoEcho::NotANumber, self.not_a_number, "NaN"),
            (NoEcho::Zero, self.zero, "0 or negative"),
        ];
        for (kind, n, name) in others {
            if n > 0 && kind != no_echo {
                let rule =
                    format!("ranges on {topic} that are {name}: no measurement ({})", percent(n));
                report.record(Treatment::NotUsed, rule, "", "");
            }
        }
        if convention.is_maximum_no_echo && no_echo != NoEcho::Maximum {
            let rule = format!(
                "ranges on {topic} equal to range_max: no echo ({})",
                percent(self.at_maximum)
            );
            report.record(Treatment::Guessed, rule, "", "");
        }
        // A wall at the limit is measured beyond it at times: where REP 117 is followed, that guesses nothing.
        let treatment = if self.infinite > 0 { Treatment::NotUsed } else { Treatment::Guessed };
        if self.beyond_maximum > 0 && no_echo != NoEcho::Maximum {
            let rule = format!(
                "ranges on {topic} above range_max: no echo ({})",
                percent(self.beyond_maximum)
            );
            report.record(treatment, rule, "", "");
        }
    }
}

/// How the scans of a topic are to be read.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ScanConvention {
    no_echo: NoEcho,
    /// The greatest range of all scans, where each has its own greatest range as limit.
    measured_limit_m: Option<f32>,
    /// Whether a range at the limit is no echo.
    is_maximum_no_echo: bool,
}

impl ScanConvention {
    /// Rewrites a scan by REP 117.
    pub(super) fn apply(&self, scan: &mut LaserScan) {
        let kinds: Vec<RangeKind> =
            scan.ranges_m.iter().map(|range_m| kind_of(*range_m, scan)).collect();
        for (range_m, kind) in scan.ranges_m.iter_mut().zip(kinds) {
            *range_m = self.by_rep_117(*range_m, kind);
        }
        if let Some(limit_m) = self.measured_limit_m {
            scan.range_max_m = limit_m;
        }
    }

    fn by_rep_117(&self, range_m: f32, kind: RangeKind) -> f32 {
        let is_no_echo = match kind {
            RangeKind::Infinite | RangeKind::BeyondMaximum => true,
            RangeKind::NotANumber => self.no_echo == NoEcho::NotANumber,
            RangeKind::Zero => self.no_echo == NoEcho::Zero,
            RangeKind::AtMaximum => self.is_maximum_no_echo && self.measured_limit_m.is_none(),
            RangeKind::Measured | RangeKind::TooNear => false,
        };
        match kind {
            _ if is_no_echo => f32::INFINITY,
            RangeKind::NotANumber | RangeKind::Zero => f32::NAN,
            RangeKind::TooNear => f32::NEG_INFINITY,
            _ => range_m,
        }
    }
}

/// Returns whether a scan has neither an echo nor a range of another meaning than "no measurement": the scanner was
/// still starting.
pub(super) fn is_blank(scan: &LaserScan) -> bool {
    scan.ranges_m
        .iter()
        .all(|range_m| matches!(kind_of(*range_m, scan), RangeKind::NotANumber | RangeKind::Zero))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bag::messages::{Header, Time};

    fn scan(range_max_m: f32, ranges_m: &[f32]) -> LaserScan {
        LaserScan {
            header: Header { stamp: Time::from_ns(0), frame_id: "laser".into() },
            angle_min_rad: 0.0,
            angle_max_rad: 1.0,
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
            (&[1.0, 0.0, 2.0, 0.0], "guessed: 0 on /scan is no echo (2 of 4"),
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
        let all = [
            scan(5.5, &[1.0, 5.5, 2.0]),
            scan(6.25, &[6.25, INF, 2.0]),
            scan(4.0, &[1.0, 4.0, 3.0]),
        ];
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
        assert_eq!(
            (scans[1].range_max_m, &scans[1].ranges_m[..]),
            (8.0, &[INF, INF, INF, 6.0][..])
        );
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
}
