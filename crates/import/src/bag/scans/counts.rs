//! Counts of ranges by their kind, which tell how a driver writes that nothing answers.

use super::NoEcho;
use super::kinds::{MAX_LIMIT_M, RangeKind, kind_of};
use super::repeated::RepeatedRange;
use crate::bag::messages::LaserScan;

/// A driver that gives each scan the greatest of its own ranges as limit has one beam at that limit, rarely more.
const MIN_AT_OWN_LIMIT: f64 = 0.5;
const MAX_AT_OWN_LIMIT: f64 = 2.0;
/// So many ranges at one limit, and this share of all, are no measurements: one of 32 bits hits a number by chance once
/// in a million times.
pub(super) const MIN_AT_LIMIT: u64 = 3;
pub(super) const MIN_SHARE_AT_LIMIT: f64 = 0.001;
/// The same of the greatest range, which some beam has in any recording.
const MIN_SHARE_AT_FARTHEST: f64 = 0.01;
/// Parts of the robot are seen by the same beams in so great a share of the scans.
const FIXED_SHARE: f64 = 0.9;

/// Counts of ranges by their kind, over the scans of a topic.
#[derive(Debug, Clone, Default, PartialEq)]
pub(in crate::bag) struct RangeCounts {
    pub(in crate::bag) scans: u64,
    pub(in crate::bag) beams: u64,
    pub(super) measured: u64,
    pub(super) infinite: u64,
    pub(super) not_a_number: u64,
    pub(super) zero: u64,
    pub(super) too_near: u64,
    pub(super) at_maximum: u64,
    pub(super) beyond_maximum: u64,
    /// The least and the greatest limit of the ranges of a scan.
    pub(super) max_m: Option<[f32; 2]>,
    /// Number of ranges just below their limit; a value that most of them may have, and its votes against the others.
    near_limit: u64,
    candidate: RepeatedRange,
    votes: u64,
    /// The ranges that are the greatest of all between the limits.
    farthest: RepeatedRange,
    /// The ranges that are too near, and whether they have several values.
    nearest: RepeatedRange,
    has_several_near: bool,
    /// The greatest number of beams of a scan.
    most_beams: u64,
    /// Number of scans whose last bearing is not that of their last beam.
    pub(super) other_end: u64,
}

/// The last bearing of a scan may be that of its last beam, or of the one that would follow, in steps between beams.
const MAX_END_STEPS: f32 = 1.5;
/// A range is just below its limit from this share of it on.
const NEAR_LIMIT: f32 = 0.99;
/// So great a share of the ranges near to the limit is at one value where that value is a mark.
const MIN_MARK_SHARE: f64 = 0.5;
/// So many more ranges than are usual at the ends of a robot, as a share of all, are suspicious where they are too near.
pub(super) const MAX_NEAR_SHARE: f64 = 0.05;

impl RangeCounts {
    /// Adds the ranges of a scan.
    pub(in crate::bag) fn add(&mut self, scan: &LaserScan) {
        self.scans += 1;
        self.beams += scan.ranges_m.len() as u64;
        self.most_beams = self.most_beams.max(scan.ranges_m.len() as u64);
        for repeated in [&mut self.candidate, &mut self.farthest, &mut self.nearest] {
            repeated.begin_scan();
        }
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
        if range_m > self.farthest.value_m {
            self.farthest.restart(range_m);
        }
        if range_m == self.farthest.value_m {
            self.farthest.add(beam);
        }
        if range_m <= NEAR_LIMIT * scan.range_max_m {
            return;
        }
        self.near_limit += 1;
        // The vote of Boyer and Moore, which finds a value that most have without keeping them.
        if self.votes == 0 && range_m != self.candidate.value_m {
            self.candidate.restart(range_m);
        }
        if range_m == self.candidate.value_m {
            self.votes += 1;
            self.candidate.add(beam);
        } else {
            self.votes -= 1;
        }
    }

    fn add_near(&mut self, beam: usize, range_m: f32) {
        if self.nearest.count == 0 {
            self.nearest.restart(range_m);
        }
        self.has_several_near |= self.nearest.value_m != range_m;
        self.nearest.add(beam);
    }

    /// Returns the ranges below the limit by which a driver says that nothing answers: those at a value just below the
    /// limit that most ranges there have, or at the greatest of all where most beams have it at times.
    pub(super) fn mark(&self) -> Option<&RepeatedRange> {
        let is_limit_free = self.infinite == 0 && self.at_maximum + self.beyond_maximum == 0;
        let is_varied = self.max_m.is_none_or(|[low, high]| low < high);
        let candidate = &self.candidate;
        let is_near_limit = !is_varied
            && self.is_frequent(candidate, MIN_SHARE_AT_LIMIT)
            && candidate.count as f64 >= MIN_MARK_SHARE * self.near_limit as f64
            && (candidate.is_in_several_directions() || candidate.is_all_around(self.most_beams));
        let farthest = &self.farthest;
        let is_farthest = self.is_frequent(farthest, MIN_SHARE_AT_FARTHEST)
            && farthest.is_all_around(self.most_beams);
        if !is_limit_free {
            None
        } else if is_near_limit {
            Some(candidate)
        } else if is_farthest {
            Some(farthest)
        } else {
            None
        }
    }

    fn is_frequent(&self, repeated: &RepeatedRange, min_share: f64) -> bool {
        repeated.count >= MIN_AT_LIMIT && repeated.count as f64 >= min_share * self.beams as f64
    }

    /// Returns whether all ranges that are too near are at one value, which is no measurement then.
    fn is_near_mark(&self) -> bool {
        let nearest = &self.nearest;
        let is_one_value = nearest.value_m.is_finite() && !self.has_several_near;
        let n = self.too_near as f64;
        let in_all_scans = nearest.beams() as f64 * self.scans as f64;
        let is_of_robot = self.scans > 1
            && n >= FIXED_SHARE * in_all_scans
            && n <= MAX_NEAR_SHARE * self.beams as f64;
        self.infinite == 0
            && is_one_value
            && self.is_frequent(nearest, MIN_SHARE_AT_LIMIT)
            && nearest.is_in_several_directions()
            && !is_of_robot
    }

    /// Returns whether each scan has the greatest of its own ranges as limit, so that a range at it is an echo.
    pub(super) fn is_limit_measured(&self) -> bool {
        let is_varied = self.max_m.is_some_and(|[low, high]| low < high);
        let at_limit = self.at_maximum as f64 / (self.scans as f64).max(1.0);
        is_varied && (MIN_AT_OWN_LIMIT..=MAX_AT_OWN_LIMIT).contains(&at_limit)
    }

    /// Returns the limit for all scans where their own are none.
    pub(super) fn measured_limit_m(&self) -> Option<f32> {
        let [_, high] = self.max_m?;
        if high >= MAX_LIMIT_M && self.farthest.value_m > 0.0 {
            return Some(self.farthest.value_m);
        }
        self.is_limit_measured().then_some(high)
    }

    /// Returns the most frequent value that may stand for "no echo"; `None` where none occurs.
    pub(super) fn guess(&self) -> Option<NoEcho> {
        if self.infinite > 0 {
            return Some(NoEcho::Infinite);
        }
        let at_maximum = if self.is_limit_measured() { 0 } else { self.at_maximum };
        let at_mark = self.mark().map_or(0, |mark| mark.count);
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
}
