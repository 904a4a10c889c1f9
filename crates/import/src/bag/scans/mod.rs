//! Laser scans by REP 117: `inf` where nothing answers, `-inf` nearer than the scanner measures, NaN for no measurement.
//!
//! Many drivers break it. How one writes "no echo" is recognized by counts over the whole recording, and named; the
//! scans that are handed on follow REP 117.

mod beams;
mod counts;
mod kinds;
mod repeated;
mod report;
#[cfg(test)]
mod tests;

pub(super) use self::counts::RangeCounts;
use self::kinds::{RangeKind, kind_of};
use super::messages::LaserScan;

/// Maximum number of beams of a scan: as many as a message of a megabyte holds.
const MAX_BEAMS: usize = 1 << 18;
/// No scanner is blind as far as this: the least range of a scan in millimeters is larger.
const MAX_LEAST_RANGE_M: f32 = 50.0;
/// Beams span a turn, or a little more where they overlap.
const MAX_SPAN_RAD: f32 = 2.5 * std::f32::consts::TAU / 2.0;

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
