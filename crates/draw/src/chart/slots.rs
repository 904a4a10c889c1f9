//! Values of single runs in named slots: joined from slot to slot, or as swarms over boxes of their quartiles.

use crate::axis::Axis;
use crate::chart::frame::{ChartFrame, FrameText, XAxis, max_ticks, polyline};
use crate::chart::{DrawnChart, error_bar};
use crate::error::DrawError;
use crate::legend::{LegendEntry, LegendSymbol, mean_mark};
use crate::style::{FAINT_INK, INK, Style, reference_line, series_color};
use crate::svg::Rect;

/// Radius of the mark of a run as a multiple of the size of text.
const POINT_FRACTION: f64 = 0.24;
/// Width of a box, and the largest of a swarm, as fractions of its slot.
const BOX_FRACTION: f64 = 0.36;
const SWARM_FRACTION: f64 = 0.56;
/// Largest width of a box.
const MAX_BOX_PX: f64 = 64.0;
/// Largest distance of a mean from the middle of its slot, as a fraction of the slot: beyond it the next one begins.
const MAX_MEAN_FRACTION: f64 = 0.42;

/// The quartiles of a slot, and how far its values reach.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct QuartileBox {
    /// Ends of the whiskers.
    pub whiskers: [f64; 2],
    /// First quartile, median, and third quartile.
    pub quartiles: [f64; 3],
}

/// The values of one slot.
#[derive(Debug, Clone, PartialEq)]
pub struct Slot {
    /// Its name below the axis.
    pub label: String,
    /// A value for each run; those of one index belong to one seed. One that is not a number is left out.
    pub values: Vec<f64>,
    /// The mean and the ends of its interval, drawn beside the runs.
    pub mean: Option<(f64, Option<(f64, f64)>)>,
    /// The quartiles, drawn behind the runs.
    pub quartiles: Option<QuartileBox>,
}

/// A chart of the runs in named slots.
#[derive(Debug, Clone, PartialEq)]
pub struct SlotChart {
    title: String,
    note: String,
    x_label: String,
    y: Axis,
    slots: Vec<Slot>,
    is_joined: bool,
    has_zero_line: bool,
    has_bars: bool,
    seed_label: String,
    mean_label: String,
}

impl SlotChart {
    /// Returns a chart of these slots from left to right.
    pub fn new(title: impl Into<String>, y: Axis, slots: Vec<Slot>) -> Self {
        Self {
            title: title.into(),
            note: String::new(),
            x_label: String::new(),
            y,
            slots,
            is_joined: false,
            has_zero_line: false,
            has_bars: false,
            seed_label: "one seed".into(),
            mean_label: "mean, 95 % interval".into(),
        }
    }

    /// Joins the values of one index from slot to slot: a line for each seed.
    #[must_use]
    pub fn joined(mut self) -> Self {
        self.is_joined = true;
        self
    }

    /// Draws a line at zero, as differences need it.
    #[must_use]
    pub fn zero_line(mut self) -> Self {
        self.has_zero_line = true;
        self
    }

    /// Draws bars from zero to the means, as counts need them.
    #[must_use]
    pub fn bars(mut self) -> Self {
        self.has_bars = true;
        self
    }

    /// Sets what the legend calls a line of a seed, and a mean with its interval.
    #[must_use]
    pub fn legend_words(mut self, seed: impl Into<String>, mean: impl Into<String>) -> Self {
        self.seed_label = seed.into();
        self.mean_label = mean.into();
        self
    }

    /// Names the slots as a whole.
    #[must_use]
    pub fn x_label(mut self, label: impl Into<String>) -> Self {
        self.x_label = label.into();
        self
    }

    /// Sets the small print under the chart.
    #[must_use]
    pub fn note(mut self, note: impl Into<String>) -> Self {
        self.note = note.into();
        self
    }

    /// Draws the chart.
    ///
    /// # Errors
    /// [`DrawError::Value`] if the style or the axis's given range is impossible.
    pub fn draw(&self, style: &Style) -> Result<DrawnChart, DrawError> {
        style.check()?;
        let y = self.y.fit_marks(self.heights(), max_ticks(style).1)?;
        let names: Vec<String> = self.slots.iter().map(|slot| slot.label.clone()).collect();
        let words = FrameText {
            title: &self.title,
            note: &self.note,
            x_label: &self.x_label,
            y_label: self.y.label(),
            legend: self.legend(),
            ..FrameText::default()
        };
        let mut frame = ChartFrame::open(style, words, &XAxis::Categories(&names), &y);
        frame.open_data();
        if self.has_zero_line {
            let zero = frame.y.px(0.0);
            let area = frame.area;
            frame.svg.line((area.x, zero), (area.right(), zero), format_args!(r#"stroke="{INK}""#));
        }
        let width = frame.area.width / self.slots.len().max(1) as f64;
        if self.is_joined {
            self.draw_joins(&mut frame, width, style);
        }
        for index in 0..self.slots.len() {
            let place = SlotPlace::new(&frame, width, index, style);
            self.draw_slot(&mut frame, &place, index);
        }
        frame.svg.close_group();
        Ok(frame.finish())
    }

    fn heights(&self) -> impl Iterator<Item = f64> {
        let values = self.slots.iter().flat_map(|slot| slot.values.iter().copied());
        let means = self.slots.iter().filter_map(|slot| slot.mean).flat_map(|(mean, interval)| {
            let (low, high) = interval.unwrap_or((mean, mean));
            [low, mean, high]
        });
        let boxes = self.slots.iter().filter_map(|slot| slot.quartiles);
        let zero = (self.has_zero_line || self.has_bars).then_some(0.0);
        values.chain(means).chain(boxes.flat_map(|quartiles| quartiles.whiskers)).chain(zero)
    }

    fn legend(&self) -> Vec<LegendEntry> {
        let mut entries = Vec::new();
        if self.is_joined {
            let symbol = LegendSymbol::Line { color: FAINT_INK.into(), marker: None, dash: "" };
            entries.push(LegendEntry::new(symbol, &self.seed_label));
        }
        if self.slots.iter().any(|slot| slot.mean.is_some()) {
            let symbol = LegendSymbol::Mean { color: INK.into() };
            entries.push(LegendEntry::new(symbol, &self.mean_label));
        }
        entries
    }

    /// Draws a line for each seed.
    fn draw_joins(&self, frame: &mut ChartFrame, width: f64, style: &Style) {
        let runs = self.slots.iter().map(|slot| slot.values.len()).max().unwrap_or(0);
        let stroke = if runs > 40 { 0.6 } else { 0.9 };
        for run in 0..runs {
            let value = |slot: &Slot| slot.values.get(run).copied().unwrap_or(f64::NAN);
            let values: Vec<f64> = self.slots.iter().map(value).collect();
            let places: Vec<Option<(f64, f64)>> = values
                .iter()
                .enumerate()
                .map(|(index, value)| {
                    let place = SlotPlace::new(frame, width, index, style);
                    self.y.contains(*value).then(|| (place.center, frame.y.px(*value)))
                })
                .collect();
            for part in places.split(Option::is_none).filter(|part| part.len() > 1) {
                let data = polyline(part.iter().flatten().copied());
                let attributes = reference_line(FAINT_INK, stroke);
                frame.svg.path(&data, attributes);
            }
        }
    }

    fn draw_slot(&self, frame: &mut ChartFrame, place: &SlotPlace, index: usize) {
        let slot = &self.slots[index];
        let color = series_color(index);
        if self.has_bars
            && let Some((mean, _)) = slot.mean
        {
            place.draw_bar(frame, mean, &color);
        }
        if let Some(quartiles) = &slot.quartiles {
            place.draw_box(frame, quartiles, &color);
        }
        let shown: Vec<(usize, f64)> = (0..)
            .zip(slot.values.iter().copied())
            .filter(|(_, value)| self.y.contains(*value))
            .collect();
        let heights: Vec<f64> = shown.iter().map(|(_, value)| frame.y.px(*value)).collect();
        let asides = if self.is_joined {
            vec![0.0; heights.len()]
        } else {
            swarm(&heights, 2.0 * place.radius, SWARM_FRACTION / 2.0 * place.width)
        };
        for (((run, _), height), aside) in shown.iter().zip(&heights).zip(&asides) {
            let at = (place.center + aside, *height);
            let attributes = format_args!(r#"fill="{color}" fill-opacity="0.75""#);
            frame.svg.circle(at, place.radius, attributes);
            frame.push_spot(at, index, *run);
        }
        if let Some((mean, interval)) = slot.mean.filter(|(mean, _)| self.y.contains(*mean)) {
            let box_px = if slot.quartiles.is_some() { place.box_width() / 2.0 } else { 0.0 };
            let widest = asides.iter().fold(box_px, |widest, aside| widest.max(aside.abs()));
            // The first of several joined slots has its mean on the left, where no line is.
            let side =
                if self.is_joined && index == 0 && self.slots.len() > 1 { -1.0 } else { 1.0 };
            let x = place.center + side * place.mean_aside(widest);
            place.draw_mean(frame, x, mean, interval);
        }
    }
}

/// Where a slot is, and how large its marks are.
struct SlotPlace {
    center: f64,
    width: f64,
    radius: f64,
}

impl SlotPlace {
    fn new(frame: &ChartFrame, width: f64, index: usize, style: &Style) -> Self {
        let center = frame.area.x + (index as f64 + 0.5) * width;
        Self { center, width, radius: POINT_FRACTION * style.font_px }
    }

    /// Returns how far from the middle of the slot the mean is: beyond the marks of runs.
    fn mean_aside(&self, widest_px: f64) -> f64 {
        (widest_px + 4.5 * self.radius).min(MAX_MEAN_FRACTION * self.width)
    }

    fn box_width(&self) -> f64 {
        (BOX_FRACTION * self.width).min(MAX_BOX_PX)
    }

    /// Draws a bar from zero, pale so that the runs on it are seen.
    fn draw_bar(&self, frame: &mut ChartFrame, mean: f64, color: &str) {
        let width = self.box_width();
        let base = frame.y.px(0.0);
        let top = frame.y.px(mean);
        let x = self.center - 0.5 * width;
        let bar = Rect { x, y: base.min(top), width, height: (base - top).abs() };
        let rim = format!(r#"stroke="{color}" stroke-width="1.2""#);
        frame
            .svg
            .rect(bar, format_args!(r#"class="bar" fill="{color}" fill-opacity="0.25" {rim}"#));
    }

    fn draw_box(&self, frame: &mut ChartFrame, quartiles: &QuartileBox, color: &str) {
        let width = self.box_width();
        let [first, median, third] = quartiles.quartiles.map(|value| frame.y.px(value));
        let [low, high] = quartiles.whiskers.map(|value| frame.y.px(value));
        let left = self.center - width / 2.0;
        let rect = Rect { x: left, y: third, width, height: (first - third).max(0.0) };
        let rim = format!(r#"stroke="{color}" stroke-width="1.2""#);
        frame.svg.rect(rect, format_args!(r#"fill="{color}" fill-opacity="0.14" {rim}"#));
        frame.svg.line((self.center, first), (self.center, low), &rim);
        frame.svg.line((self.center, third), (self.center, high), &rim);
        let thick = format!(r#"stroke="{color}" stroke-width="2.4""#);
        frame.svg.line((left, median), (left + width, median), &thick);
    }

    fn draw_mean(&self, frame: &mut ChartFrame, x: f64, mean: f64, interval: Option<(f64, f64)>) {
        if let Some((low, high)) = interval.filter(|(l, h)| l.is_finite() && h.is_finite()) {
            let ends = (frame.y.px(low), frame.y.px(high));
            error_bar(&mut frame.svg, x, ends, 1.1 * self.radius, INK);
        }
        let y = frame.y.px(mean);
        mean_mark(&mut frame.svg, (x, y), 1.7 * self.radius, INK);
    }
}

/// Returns how far aside of the middle each of some heights stands, so that marks `size_px` large touch as little as
/// they can within `room_px` to either side. Each takes the first free place, nearest to the middle first.
fn swarm(heights: &[f64], size_px: f64, room_px: f64) -> Vec<f64> {
    let mut order: Vec<usize> = (0..heights.len()).collect();
    order.sort_by(|a, b| heights[*a].total_cmp(&heights[*b]));
    let mut asides = vec![0.0; heights.len()];
    let mut placed: Vec<usize> = Vec::with_capacity(heights.len());
    // Marks may overlap a little, so that swarms stay narrow.
    let step = 0.85 * size_px;
    let steps = (room_px / step).floor().max(0.0) as i32;
    for index in order {
        // Only the last ones can be near, because heights rise.
        let near: Vec<usize> = placed
            .iter()
            .rev()
            .copied()
            .take_while(|other| (heights[*other] - heights[index]).abs() < step)
            .collect();
        let is_free = |aside: f64| {
            near.iter().all(|other: &usize| {
                let dx: f64 = asides[*other] - aside;
                let dy = heights[*other] - heights[index];
                dx * dx + dy * dy >= step * step * 0.98
            })
        };
        let candidates = (0..=steps).flat_map(|k| [f64::from(k) * step, -f64::from(k) * step]);
        let mut free = candidates.into_iter().filter(|aside| is_free(*aside));
        // Where all places are taken, marks lie over each other, each at a place of its own in turn.
        let turn = placed.len() as i32 % (2 * steps + 1) - steps;
        let aside = free.next().unwrap_or(f64::from(turn) * step);
        asides[index] = aside;
        placed.push(index);
    }
    asides
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn marks_of_a_swarm_stay_within_its_room_and_touch_only_where_it_is_full() {
        let heights = [10.0, 10.0, 10.5, 40.0, 10.2];
        let asides = swarm(&heights, 6.0, 30.0);
        assert_eq!((asides[0], asides[3]), (0.0, 0.0));
        let mut taken: Vec<f64> = vec![asides[0], asides[1], asides[2], asides[4]];
        taken.sort_by(f64::total_cmp);
        assert!(taken.windows(2).all(|pair| pair[1] - pair[0] > 4.9), "{asides:?}");
        let crowd = swarm(&[5.0; 100], 6.0, 30.0);
        assert!(crowd.iter().all(|aside| aside.abs() <= 30.0));
    }

    #[test]
    fn bars_begin_at_zero_and_have_their_runs_on_them() {
        let slot = |label: &str, values: [f64; 3]| Slot {
            label: label.into(),
            values: values.to_vec(),
            mean: Some((values.iter().sum::<f64>() / 3.0, None)),
            quartiles: None,
        };
        let slots = vec![slot("a", [4.0, 6.0, 8.0]), slot("b", [9.0, 12.0, 15.0])];
        let chart = SlotChart::new("T", Axis::linear("hits"), slots).bars();
        let drawn = chart.draw(&Style::CHART).unwrap();
        let bars: Vec<&str> =
            drawn.svg.lines().filter(|line| line.contains("class=\"bar\"")).collect();
        let number = |line: &str, name: &str| -> f64 {
            let rest = line.split(&format!(" {name}=\"")).nth(1).unwrap();
            rest.split('"').next().unwrap().parse().unwrap()
        };
        let heights: Vec<f64> = bars.iter().map(|bar| number(bar, "height")).collect();
        assert!((heights[1] / heights[0] - 2.0).abs() < 0.01, "means are 6 and 12: {heights:?}");
        let bottom = |bar: &str| number(bar, "y") + number(bar, "height");
        assert!((bottom(bars[0]) - bottom(bars[1])).abs() < 0.02, "both begin at zero");
        assert_eq!(drawn.spots.len(), 6, "each run is a point");
    }

    #[test]
    fn each_seed_is_a_line_and_each_slot_has_its_mean() {
        let slot = |label: &str, values: [f64; 3]| Slot {
            label: label.into(),
            values: values.to_vec(),
            mean: Some((2.0, Some((1.0, 3.0)))),
            quartiles: None,
        };
        let slots = vec![slot("a", [1.0, 2.0, 3.0]), slot("b", [2.0, f64::NAN, 4.0])];
        let chart = SlotChart::new("T", Axis::linear("y"), slots).joined();
        let drawn = chart.draw(&Style::CHART).unwrap();
        assert_eq!(drawn.spots.len(), 5);
        assert_eq!(
            drawn.svg.matches("stroke-opacity").count(),
            2,
            "a seed without a pair has no line"
        );
    }
}
