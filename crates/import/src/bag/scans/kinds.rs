//! The kinds of ranges, by the limits of their scan.

use crate::bag::messages::LaserScan;

/// Ranges are equal to a limit within this fraction of it: they are numbers of 32 bits.
pub(super) const LIMIT_TOLERANCE: f32 = 1e-6;
/// A limit beyond this is none: drivers without one give the greatest number that there is.
pub(super) const MAX_LIMIT_M: f32 = 1e5;

/// Returns whether a scan has a limit of its ranges.
fn is_limited(scan: &LaserScan) -> bool {
    scan.range_max_m < MAX_LIMIT_M
}

/// The kind of a range, by its own scan.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum RangeKind {
    /// Between the limits.
    Measured,
    Infinite,
    NotANumber,
    /// 0 or negative, but for `-inf`.
    Zero,
    /// `-inf`, or above 0 and no more than the least range, at which nothing is measured but by chance.
    TooNear,
    AtMaximum,
    BeyondMaximum,
}

/// Returns the kind of a range.
pub(super) fn kind_of(range_m: f32, scan: &LaserScan) -> RangeKind {
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
    } else if range_m <= scan.range_min_m * (1.0 + LIMIT_TOLERANCE) {
        RangeKind::TooNear
    } else {
        RangeKind::Measured
    }
}
