//! Laser scans by REP 117: `inf` where nothing answers, `-inf` nearer than the scanner measures, NaN for no measurement.
//!
//! Many drivers break it. How one writes "no echo" is recognized by counts over the whole recording, and named; the
//! scans that are handed on follow REP 117.

use super::beams::BeamSet;
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
/// Nothing answers in several directions; a wall or a part of the robot is seen in one, by beams side by side.
const MIN_RUNS: u64 = 2;
/// Parts of the robot are seen by the same beams in so great a share of the scans.
const FIXED_SHARE: f64 = 0.9;

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
    /// A range below the least one.
    TooNear,
}

impl NoEcho {
    /// Parses `inf`, `nan`, `zero`, `max` or `near`.
    pub fn from_name(name: &str) -> Option<Self> {
        match name {
            "inf" => Some(Self::Infinite),
            "nan" => Some(Self::NotANumber),
            "zero" => Some(Self::Zero),
            "max" => Some(Self::Maximum),
            "near" => Some(Self::TooNear),
            _ => None,
        }
    }

    fn describe(self) -> &'static str {
        match self {
            Self::Infinite => "inf",
            Self::NotANumber => "NaN",
            Self::Zero => "0 or less",
            Self::Maximum => "the greatest range",
            Self::TooNear => "a range below the least one",
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
    if limits[0] > MAX_LEAST_RANGE_M {
        return Err(format!("its least range is {} m, which looks like millimeters", limits[0]));
    }
    let span_rad = scan.angle_increment_rad.abs() * (n - 1) as f32;
    if span_rad > MAX_SPAN_RAD {
        return Err(format!("its beams span {span_rad} rad, which looks like degrees"));
    }
    if n > 1 && scan.angle_increment_rad == 0.0 {
        return Err(format!("its {n} beams have one bearing: angle_increment is 0"));
    }
    Ok(())
}

/// No scanner is blind as far as this: the least range of a scan in millimeters is larger.
const MAX_LEAST_RANGE_M: f32 = 50.0;
/// Beams span a turn, or a little more where they overlap.
const MAX_SPAN_RAD: f32 = 2.5 * std::f32::consts::TAU / 2.0;
/// A limit beyond this is none: drivers without one give the greatest number that there is.
const MAX_LIMIT_M: f32 = 1e5;

/// Returns whether a scan has a limit of its ranges.
fn is_limited(scan: &LaserScan) -> bool {
    scan.range_max_m < MAX_LIMIT_M
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
    } else if range_m == f32::INFINITY || range_m >= MAX_LIMIT_M && !is_limited(scan) {
        RangeKind::Infinite
    } else if range_m == f32::NEG_INFINITY {
        RangeKind::TooNear
    } else if range_m <= 0.0 {
        RangeKind::Zero
    } else if is_limited(scan) && (range_m - max_m).abs() <= LIMIT_TOLERANCE * max_m {
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
    /// Number of ranges just below their limit; a value that most of them may have, its votes against the others, and how
    /// often it was seen.
    near_limit: u64,
    candidate_m: f32,
    votes: u64,
    at_candidate: u64,
    /// The value of the ranges that are too near; `None` where there are several.
    near_mark_m: Option<f32>,
    has_several_near: bool,
    /// The beams with the value near to the limit, and those with one that is too near.
    candidate_beams: BeamSet,
    near_beams: BeamSet,
    /// Number of scans whose last bearing is not that of their last beam.
    other_end: u64,
}

/// The last bearing of a scan may be that of its last beam, or of the one that would follow, in steps between beams.
const MAX_END_STEPS: f32 = 1.5;
/// A range is just below its limit from this share of it on.
const NEAR_LIMIT: f32 = 0.99;
/// So great a share of the ranges near to the limit is at one value where that value is a mark.
const MIN_MARK_SHARE: f64 = 0.5;
/// So many more ranges than are usual at the ends of a robot, as a share of all, are suspicious where they are too near.
const MAX_NEAR_SHARE: f64 = 0.05;

impl RangeCounts {
    pub(super) fn add(&mut self, scan: &LaserScan) {
        self.scans += 1;
        self.beams += scan.ranges_m.len() as u64;
        for (beam, range_m) in scan.ranges_m.iter().enumerate() {
            let kind = kind_of(*range_m, scan);
            match kind {
                RangeKind::Measured => self.add_measured(beam, *range_m, scan),
                RangeKind::TooNear => self.add_near(beam, *range_m),
                _ => {}
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
        let last_rad = scan.angle_increment_rad * (scan.ranges_m.len() as f32 - 1.0);
        let off_rad = (scan.angle_max_rad - scan.angle_min_rad - last_rad).abs();
        self.other_end += u64::from(off_rad > MAX_END_STEPS * scan.angle_increment_rad.abs());
    }

    fn add_measured(&mut self, beam: usize, range_m: f32, scan: &LaserScan) {
        self.greatest_m = self.greatest_m.max(range_m);
        if range_m <= NEAR_LIMIT * scan.range_max_m {
            return;
        }
        self.near_limit += 1;
        // The vote of Boyer and Moore, which finds a value that most have without keeping them.
        if self.votes == 0 && range_m != self.candidate_m {
            (self.candidate_m, self.at_candidate) = (range_m, 0);
            self.candidate_beams.clear();
        }
        if range_m == self.candidate_m {
            (self.votes, self.at_candidate) = (self.votes + 1, self.at_candidate + 1);
            self.candidate_beams.insert(beam);
        } else {
            self.votes -= 1;
        }
    }

    fn add_near(&mut self, beam: usize, range_m: f32) {
        self.near_beams.insert(beam);
        self.has_several_near |= self.near_mark_m.is_some_and(|mark_m| mark_m != range_m);
        self.near_mark_m = Some(range_m);
    }

    /// Returns the value just below the limit that a driver writes for no echo, where most ranges there have it.
    fn mark_m(&self) -> Option<f32> {
        let [low, high] = self.max_m?;
        let is_mark = self.infinite == 0
            && low == high
            && self.at_candidate >= MIN_AT_LIMIT
            && self.at_candidate as f64 >= MIN_SHARE_AT_LIMIT * self.beams as f64
            && self.at_candidate as f64 >= MIN_MARK_SHARE * self.near_limit as f64
            && self.candidate_beams.runs() >= MIN_RUNS
            && self.at_maximum + self.beyond_maximum == 0;
        is_mark.then_some(self.candidate_m)
    }

    /// Returns whether all ranges that are too near are at one value, which is no measurement then.
    fn is_near_mark(&self) -> bool {
        let is_one_value = self.near_mark_m.is_some_and(f32::is_finite) && !self.has_several_near;
        let n = self.too_near as f64;
        let in_all_scans = self.near_beams.len() as f64 * self.scans as f64;
        let is_of_robot = self.scans > 1
            && n >= FIXED_SHARE * in_all_scans
            && n <= MAX_NEAR_SHARE * self.beams as f64;
        self.infinite == 0
            && is_one_value
            && self.too_near >= MIN_AT_LIMIT
            && n >= MIN_SHARE_AT_LIMIT * self.beams as f64
            && self.near_beams.runs() >= MIN_RUNS
            && !is_of_robot
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
        if high >= MAX_LIMIT_M && self.greatest_m > 0.0 {
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
        let at_mark = self.mark_m().map_or(0, |_| self.at_candidate);
        let near = if self.is_near_mark() { self.too_near } else { 0 };
        let counts = [
            (NoEcho::TooNear, near),
            (NoEcho::Maximum, at_maximum + self.beyond_maximum + at_mark),
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
            mark_m: self.mark_m().filter(|_| no_echo == NoEcho::Maximum),
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
            NoEcho::Maximum => {
                self.at_maximum
                    + self.beyond_maximum
                    + self.mark_m().map_or(0, |_| self.at_candidate)
            }
            NoEcho::TooNear => self.too_near,
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
        self.record_doubts(topic, no_echo, report);
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

impl RangeCounts {
    /// Records what can hardly be right with the ranges of a topic.
    fn record_doubts(&self, topic: &str, no_echo: NoEcho, report: &mut ImportReport) {
        let percent = |n: u64| 100.0 * n as f64 / self.beams.max(1) as f64;
        if self.measured == 0 && self.beams > 0 {
            let rule = format!("none of the {} ranges on {topic} is an echo", self.beams);
            let remedy = "check that the scanner turned, and that lengths are in meters";
            report.record(Treatment::Suspicious, rule, "", remedy);
        }
        let far_share = self.beyond_maximum as f64 / self.beams.max(1) as f64;
        if far_share > 0.5 {
            let rule = format!(
                "{:.2} % of the ranges on {topic} are beyond range_max",
                percent(self.beyond_maximum)
            );
            report.record(
                Treatment::Suspicious,
                rule,
                "",
                "check that ranges and range_max are both in meters",
            );
        }
        let is_near_often = self.too_near as f64 > MAX_NEAR_SHARE * self.beams as f64;
        if is_near_often && self.infinite == 0 && no_echo != NoEcho::TooNear {
            let rule = format!(
                "{:.2} % of the ranges on {topic} are nearer than the scanner measures, and none is inf",
                percent(self.too_near)
            );
            let remedy = "give --no-echo near if the driver writes so where nothing answers";
            report.record(Treatment::Suspicious, rule, "", remedy);
        }
        if self.other_end > 0 {
            let rule = format!(
                "scans on {topic} whose angle_max is not the bearing of their last beam: angle_min and angle_increment count \
                 ({} of {} scans)",
                self.other_end, self.scans
            );
            report.record(Treatment::Suspicious, rule, "", "");
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
    /// A range below the limit that is no echo.
    mark_m: Option<f32>,
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
            RangeKind::Measured => self.mark_m == Some(range_m),
            RangeKind::TooNear => self.no_echo == NoEcho::TooNear,
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
        let (scans, said) =
            read(&[scan(8.0, &[7.93, 7.94, 7.95, 7.96, 7.97, 7.99, 7.99, 7.99])], None);
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
        let moving: Vec<LaserScan> =
            (0..20).map(|k| with(&[k, 30 + 2 * k, 90 - k], 0.05)).collect();
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
            cause(|scan| (scan.range_min_m, scan.range_max_m) = (100.0, 8e3))
                .contains("millimeters")
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
}
