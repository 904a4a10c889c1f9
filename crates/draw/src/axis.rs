//! Axes: the user's settings, the range that follows from data and settings, and the map to pixels.

use libm::{floor, log10, pow};

use crate::error::DrawError;
use crate::ticks::{Ticks, nice_step};

/// Largest number that counts as a value: no measurement is larger, and spans between larger
/// numbers would overflow.
const MAX_MAGNITUDE: f64 = 1e100;

/// A numeric axis: its label, its scale and, unless the data decide, its range and ticks.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    label: String,
    log: bool,
    range: Option<(f64, f64)>,
    ticks: Option<Vec<f64>>,
}

impl Axis {
    /// Returns a linear axis; `label` names the quantity and its unit, e.g. `"trip time (s)"`.
    pub fn linear(label: impl Into<String>) -> Self {
        Self { label: label.into(), log: false, range: None, ticks: None }
    }

    /// Returns a logarithmic axis. Values of zero and below have no place on it and are left out.
    pub fn log(label: impl Into<String>) -> Self {
        Self { log: true, ..Self::linear(label) }
    }

    /// Shows exactly the values from `low` to `high`; without this the data decide.
    #[must_use]
    pub fn range(mut self, low: f64, high: f64) -> Self {
        self.range = Some((low, high));
        self
    }

    /// Puts labeled ticks at these values instead of at round numbers, e.g. at the numbers of
    /// workers that were measured.
    #[must_use]
    pub fn ticks(mut self, at: impl IntoIterator<Item = f64>) -> Self {
        self.ticks = Some(at.into_iter().collect());
        self
    }

    pub(crate) fn label(&self) -> &str {
        &self.label
    }

    /// Returns whether a value has a place on this axis at all.
    pub(crate) fn contains(&self, value: f64) -> bool {
        value.abs() <= MAX_MAGNITUDE && (!self.log || value >= 1.0 / MAX_MAGNITUDE)
    }

    /// Fixes the range, given the smallest and largest of the `values` that have a place on the
    /// axis; `most` is the number of ticks that fit.
    pub(crate) fn fit(
        &self,
        values: impl Iterator<Item = f64>,
        most: usize,
    ) -> Result<FittedAxis, DrawError> {
        self.fit_with_room(values, most, Room::None)
    }

    /// Fixes the range like [`Self::fit`], for values with marks: none lies on the frame, which would hide half of it,
    /// unless its range is given or the frame is at zero.
    pub(crate) fn fit_marks(
        &self,
        values: impl Iterator<Item = f64>,
        most: usize,
    ) -> Result<FittedAxis, DrawError> {
        self.fit_with_room(values, most, Room::ForMarks)
    }

    fn fit_with_room(
        &self,
        values: impl Iterator<Item = f64>,
        most: usize,
        room: Room,
    ) -> Result<FittedAxis, DrawError> {
        let ticks: Vec<f64> =
            self.ticks.iter().flatten().copied().filter(|v| self.contains(*v)).collect();
        let values = values.chain(ticks.iter().copied()).filter(|v| self.contains(*v));
        let extent = extent(values);
        let (low, high) = match self.range {
            Some(range) => self.checked(range)?,
            None => self.round_out(extent, most),
        };
        let ticks = match (&self.ticks, self.log) {
            (Some(_), _) => Ticks::from_values(&ticks),
            (None, true) => Ticks::log(low, high, most),
            (None, false) => Ticks::linear(low, high, most),
        };
        let ticks = clip_ticks(ticks, low, high);
        let mut fitted = FittedAxis { log: self.log, low, high, ticks };
        if let (Room::ForMarks, None, Some(extent)) = (room, self.range, extent) {
            fitted.make_room(extent);
        }
        Ok(fitted)
    }

    fn checked(&self, (low, high): (f64, f64)) -> Result<(f64, f64), DrawError> {
        let what = "axis range";
        for value in [low, high] {
            if !self.contains(value) {
                return Err(DrawError::Value {
                    what,
                    value,
                    must: "finite, and above zero if log",
                });
            }
        }
        if high - low <= 1e-12 * low.abs().max(high.abs()) {
            return Err(DrawError::Value { what, value: high, must: "above the range's low end" });
        }
        Ok((low, high))
    }

    /// Returns the range that shows all of `extent` and ends at round numbers; with given ticks, it
    /// ends a little beyond the outermost.
    fn round_out(&self, extent: Option<(f64, f64)>, most: usize) -> (f64, f64) {
        match (self.log, self.ticks.is_some(), extent) {
            (true, _, None) => (1.0, 10.0),
            (false, _, None) => (0.0, 1.0),
            (true, false, Some(extent)) => round_log(extent),
            (true, true, Some((low, high))) => (low / 1.1, high * 1.1),
            (false, given, Some(extent)) => round_linear(extent, given, most),
        }
    }
}

/// Whether values may lie on the frame of a chart.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Room {
    None,
    ForMarks,
}

fn round_linear(extent: (f64, f64), ticks_given: bool, most: usize) -> (f64, f64) {
    let (low, high) = widened(extent);
    if ticks_given {
        let margin = 0.04 * (high - low);
        return (low - margin, high + margin);
    }
    // Zero belongs on an axis that comes near it: the data then still take more than half of the length.
    let low = if low > 0.0 && low < 0.4 * high { 0.0 } else { low };
    let high = if high < 0.0 && high > 0.4 * low { 0.0 } else { high };
    let step = nice_step(high - low, most);
    (floor(low / step + 1e-9) * step, -floor(1e-9 - high / step) * step)
}

/// Returns an extent that is more than one point.
fn widened((low, high): (f64, f64)) -> (f64, f64) {
    let size = low.abs().max(high.abs());
    if high - low > 1e-9 * size && high - low > 1.0 / MAX_MAGNITUDE {
        return (low, high);
    }
    let margin = if size > 1.0 / MAX_MAGNITUDE { 0.1 * size } else { 0.5 };
    (low - margin, high + margin)
}

fn extent(values: impl Iterator<Item = f64>) -> Option<(f64, f64)> {
    values.fold(None, |extent, v| match extent {
        None => Some((v, v)),
        Some((low, high)) => Some((v.min(low), v.max(high))),
    })
}

/// Ends a log range at powers of ten, or at 1, 2, 5 times one if it spans less than three decades.
fn round_log((low, high): (f64, f64)) -> (f64, f64) {
    let digits: &[f64] = if high / low > 1000.0 { &[1.0, 10.0] } else { &[1.0, 2.0, 5.0, 10.0] };
    let low_power = power_of_ten(low);
    let below = digits.iter().map(|digit| digit * low_power);
    // The slack keeps an end that is such a number up to rounding.
    let below = below.take_while(|v| *v <= low * (1.0 + 1e-9)).last().unwrap_or(low);
    let high_power = power_of_ten(high);
    let mut above = digits.iter().map(|digit| digit * high_power);
    let above = above.find(|v| *v >= high * (1.0 - 1e-9)).unwrap_or(high);
    if below < above { (below, above) } else { (below / 2.0, above * 2.0) }
}

/// Returns the greatest power of ten that is at most `value`, up to rounding.
fn power_of_ten(value: f64) -> f64 {
    pow(10.0, floor(log10(value) + 1e-12))
}

fn clip_ticks(mut ticks: Ticks, low: f64, high: f64) -> Ticks {
    let slack = 1e-9 * (high - low);
    let kept = low - slack..=high + slack;
    ticks.major.retain(|(v, _)| kept.contains(v));
    ticks.minor.retain(|v| kept.contains(v));
    ticks
}

/// An axis with a known range, but not yet a place in the picture.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct FittedAxis {
    pub(crate) log: bool,
    pub(crate) low: f64,
    pub(crate) high: f64,
    pub(crate) ticks: Ticks,
}

impl FittedAxis {
    /// Returns an axis of named rows of height 1, the first one highest.
    pub(crate) fn rows(names: &[String]) -> Self {
        let high = names.len().max(1) as f64;
        Self { log: false, low: 0.0, high, ticks: Ticks::rows(names) }
    }

    /// Moves the ends on which values lie outward, beyond the last tick; zero stays, since bars and shares start there.
    fn make_room(&mut self, extent: (f64, f64)) {
        // The part of the axis that a mark takes up, with some air.
        const MARK_PART: f64 = 0.04;
        let low = self.value_at(-MARK_PART);
        let high = self.value_at(1.0 + MARK_PART);
        let is_near_low = extent.0 < self.value_at(MARK_PART / 2.0);
        let is_near_high = extent.1 > self.value_at(1.0 - MARK_PART / 2.0);
        if is_near_low && self.low != 0.0 {
            self.low = low;
        }
        if is_near_high && self.high != 0.0 {
            self.high = high;
        }
    }

    /// Lays the range's low end at pixel `from` and its high end at pixel `to`.
    pub(crate) fn scale_between(&self, from: f64, to: f64) -> Scale {
        let low = self.transform(self.low);
        let high = self.transform(self.high);
        Scale {
            log: self.log,
            low,
            per_unit: (to - from) / (high - low),
            from,
            low_value: self.low,
        }
    }

    pub(crate) fn value_at(&self, part: f64) -> f64 {
        if self.log {
            return self.low * pow(self.high / self.low, part);
        }
        self.low + part * (self.high - self.low)
    }

    fn transform(&self, value: f64) -> f64 {
        if self.log { log10(value) } else { value }
    }
}

/// The map from values to pixels.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Scale {
    log: bool,
    low: f64,
    low_value: f64,
    per_unit: f64,
    from: f64,
}

impl Scale {
    /// Returns the pixel of `value`; values that a log axis cannot hold lie at its low end. Far
    /// outside the picture distances are limited to 100 000 px, which a clip hides.
    pub(crate) fn px(&self, value: f64) -> f64 {
        let value = if self.log { log10(value.max(1.0 / MAX_MAGNITUDE)) } else { value };
        let offset = (value - self.low) * self.per_unit;
        self.from + offset.clamp(-1e5, 1e5)
    }

    /// Returns the pixel where bars start: zero, or the low end of a log axis.
    pub(crate) fn base_px(&self) -> f64 {
        self.px(if self.log { self.low_value } else { 0.0 })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fit(axis: &Axis, values: &[f64]) -> (f64, f64) {
        let fitted = axis.fit(values.iter().copied(), 5).unwrap();
        (fitted.low, fitted.high)
    }

    #[test]
    fn a_linear_range_ends_at_round_numbers_and_shows_zero_if_near() {
        let axis = Axis::linear("t (s)");
        assert_eq!(fit(&axis, &[1.2, 9.3]), (0.0, 10.0));
        assert_eq!(fit(&axis, &[101.0, 109.0]), (100.0, 110.0));
        assert_eq!(fit(&axis, &[-3.0, 4.0]), (-4.0, 4.0));
        assert_eq!(fit(&axis, &[]), (0.0, 1.0));
    }

    #[test]
    fn one_value_and_no_value_still_have_a_range() {
        for axis in [Axis::linear("a"), Axis::log("b")] {
            for values in [&[][..], &[0.0], &[7.0], &[f64::NAN], &[-1.0, f64::INFINITY], &[1e-300]]
            {
                let (low, high) = fit(&axis, values);
                assert!(low < high, "{axis:?} {values:?} {low} {high}");
            }
        }
    }

    #[test]
    fn a_log_range_ends_at_one_two_five() {
        assert_eq!(fit(&Axis::log("t"), &[0.3, 70.0, -1.0]), (0.2, 100.0));
        assert_eq!(fit(&Axis::log("t"), &[0.3, 7000.0]), (0.1, 10_000.0));
        assert_eq!(fit(&Axis::log("t"), &[1.0, 10.0]), (1.0, 10.0));
        assert_eq!(fit(&Axis::log("t"), &[10.0]), (5.0, 20.0));
    }

    #[test]
    fn marks_do_not_lie_on_the_frame_unless_it_is_at_zero() {
        let fit = |axis: &Axis, values: &[f64]| {
            let fitted = axis.fit_marks(values.iter().copied(), 5).unwrap();
            let last_tick = fitted.ticks.major.last().unwrap().0;
            (fitted.low, fitted.high, last_tick)
        };
        let axis = Axis::linear("n");
        assert_eq!(fit(&axis, &[8.0, 16.0]), (7.68, 16.32, 16.0));
        assert_eq!(fit(&axis, &[0.0, 1.0]), (0.0, 1.04, 1.0));
        assert_eq!(fit(&axis, &[0.0, 0.9]), (0.0, 1.0, 1.0));
        assert_eq!(fit(&axis.range(0.0, 1.0), &[0.0, 1.0]), (0.0, 1.0, 1.0));
        let (low, high, last_tick) = fit(&Axis::log("t"), &[1.0, 10.0]);
        assert!(low < 1.0 && high > 10.0 && last_tick == 10.0, "{low} {high} {last_tick}");
    }

    #[test]
    fn an_impossible_range_is_refused() {
        for (axis, low, high) in [
            (Axis::linear("a"), 1.0, 1.0),
            (Axis::linear("a"), 2.0, 1.0),
            (Axis::linear("a"), f64::NAN, 1.0),
            (Axis::log("a"), 0.0, 1.0),
        ] {
            assert!(axis.range(low, high).fit([].into_iter(), 5).is_err());
        }
    }

    #[test]
    fn values_map_to_pixels_linearly_or_by_logarithm() {
        let linear = Axis::linear("a").range(0.0, 10.0).fit([].into_iter(), 5).unwrap();
        assert_eq!(linear.scale_between(100.0, 0.0).px(2.5), 75.0);
        let log = Axis::log("a").range(1.0, 100.0).fit([].into_iter(), 5).unwrap();
        assert_eq!(log.scale_between(0.0, 200.0).px(10.0), 100.0);
        assert_eq!(log.scale_between(0.0, 200.0).base_px(), 0.0);
        assert!(log.scale_between(0.0, 200.0).px(0.0).is_finite());
    }
}
