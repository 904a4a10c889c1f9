//! A forest: effects with their intervals, one below the other, against zero.

use crate::axis::{Axis, Scale};
use crate::chart::frame::{ChartFrame, FrameText, MAX_TICK_LABEL_FRACTION, XAxis, max_ticks};
use crate::chart::{DrawnChart, level_error_bar};
use crate::error::DrawError;
use crate::legend::{LegendEntry, LegendSymbol, Marker};
use crate::style::{FAINT_INK, GROUND, INK, Style, series_color};
use crate::svg::{Anchor, TextStyle};
use crate::text::{self, Weight};

/// Height of a line of a row as a multiple of the size of its text.
const LINE: f64 = 1.5;
/// Height of a line of text that is broken, as a multiple of its size.
const TEXT_LINE: f64 = 1.2;
/// Gap between the area and the text beside it.
const TEXT_GAP_PX: f64 = 10.0;
/// Radius of a mark as a multiple of the size of small text.
const MARK_FRACTION: f64 = 0.34;
/// An end of an interval farther from zero than this multiple of the third quartile of all ends is cut off, with an
/// arrow: one large effect would press all others against zero.
const MAX_SPREAD: f64 = 3.0;
/// Reach of the axis beyond the outermost effects as a fraction of its length, so that no mark sits on the frame.
const MARGIN_FRACTION: f64 = 0.05;
/// Largest fraction of the width for the names of rows and the text together; text that needs more is broken, and left
/// out only where a word alone needs more.
const MAX_WORDS_FRACTION: f64 = 0.68;

/// An effect in one row.
#[derive(Debug, Clone, PartialEq)]
pub struct ForestMark {
    /// The effect in units of the axis; one that is not a number has only its text.
    pub value: f64,
    /// Lower and upper end of its interval, if it has one. Where that has zero in it, the mark is hollow.
    pub interval: Option<(f64, f64)>,
    /// The effect in words, which stand on the right.
    pub text: String,
}

/// Effects of one color: one in each row.
#[derive(Debug, Clone, PartialEq)]
pub struct ForestSeries {
    /// Label in the legend.
    pub label: String,
    /// One effect per row, in their order.
    pub marks: Vec<ForestMark>,
}

/// A chart of effects against zero, e.g. of differences between two variants in many quantities.
#[derive(Debug, Clone, PartialEq)]
pub struct ForestChart {
    title: String,
    note: String,
    x: Axis,
    rows: Vec<String>,
    series: Vec<ForestSeries>,
    /// The head of the text on the right.
    heading: String,
    /// Why an effect has text and no mark.
    unmarked: String,
}

impl ForestChart {
    /// Returns an empty chart with these rows from top to bottom, over an axis of effects.
    pub fn new(
        title: impl Into<String>,
        x: Axis,
        rows: impl IntoIterator<Item = impl Into<String>>,
    ) -> Self {
        Self {
            title: title.into(),
            note: String::new(),
            x,
            rows: rows.into_iter().map(Into::into).collect(),
            series: vec![],
            heading: String::new(),
            unmarked: String::new(),
        }
    }

    /// Sets the head of the text on the right, and why an effect has only its text.
    #[must_use]
    pub fn words(mut self, heading: impl Into<String>, unmarked: impl Into<String>) -> Self {
        self.heading = heading.into();
        self.unmarked = unmarked.into();
        self
    }

    /// Adds a series.
    #[must_use]
    pub fn series(mut self, series: ForestSeries) -> Self {
        self.series.push(series);
        self
    }

    /// Sets the small print under the chart.
    #[must_use]
    pub fn note(mut self, note: impl Into<String>) -> Self {
        self.note = note.into();
        self
    }

    /// Draws the chart. It is as high as its rows need, whatever the height of the style.
    ///
    /// # Errors
    /// [`DrawError::Length`] if a series has not one effect per row, [`DrawError::Value`] if the style or the axis's
    /// given range is impossible.
    pub fn draw(&self, style: &Style) -> Result<DrawnChart, DrawError> {
        style.check()?;
        for series in &self.series {
            DrawError::length("effects of a series", self.rows.len(), series.marks.len())?;
        }
        let limit = self.limit();
        let shown = self.ends().map(|end| end.clamp(-limit, limit));
        let beside = self.beside(style);
        // The axis has less room than that of other charts, so that it does not end at round numbers.
        // Two ticks beside that at zero tell the scale.
        let across = max_ticks(&Style { width_px: 0.55 * style.width_px, ..*style }).0.max(3);
        let (low, high) =
            shown.fold((0.0, 0.0), |(low, high): (f64, f64), end| (low.min(end), high.max(end)));
        let axis = if low < high {
            let margin = MARGIN_FRACTION * (high - low);
            self.x.clone().range(low - margin, high + margin)
        } else {
            self.x.clone()
        };
        let x = axis.fit(std::iter::once(0.0), across)?;
        let words = FrameText {
            title: &self.title,
            note: &self.note,
            x_label: self.x.label(),
            legend: self.legend(),
            beside_px: beside.width_px,
            rows_px: self.rows.len() as f64 * self.row_px(style, beside.max_lines()),
            ..FrameText::default()
        };
        let rows = crate::axis::FittedAxis::rows(&self.rows);
        let low_style = Style { height_px: MIN_HEIGHT_PX, ..*style };
        let across = XAxis::Values(x.clone());
        let mut frame = ChartFrame::open(&low_style, words, &across, &rows);
        let x_scale = frame.x_scale(&x);
        let area = frame.area;
        let zero = x_scale.px(0.0);
        frame.svg.line(
            (zero, area.y),
            (zero, area.bottom()),
            format_args!(r#"stroke="{INK}" stroke-width="1.2""#),
        );
        self.draw_heading(&mut frame, style, &beside);
        for index in 0..self.series.len() {
            self.draw_series(&mut frame, x_scale, index, (style, &beside));
        }
        Ok(frame.finish())
    }

    /// Writes the head of the text above it, and above the area where it is wider: nothing else is there.
    fn draw_heading(&self, frame: &mut ChartFrame, style: &Style, beside: &EffectText) {
        let size = style.small_px();
        let text_style = TextStyle { fill: FAINT_INK, ..TextStyle::new(size, Anchor::End) };
        let end = frame.area.right() + beside.width_px;
        let width_px = text::width(&self.heading, size, Weight::Regular);
        if beside.width_px > 0.0 && width_px < end {
            // Where there is room, it begins where the text does.
            let x = end.min(frame.area.right() + TEXT_GAP_PX + width_px).max(width_px);
            frame.svg.text(x, frame.area.y - 3.0, &self.heading, &text_style);
        }
    }

    /// Returns the height of a row: names of quantities may take two lines, and each effect some of text.
    fn row_px(&self, style: &Style, text_lines: usize) -> f64 {
        let lines = self.series.len().max(1) as f64 * lines_of_effect(text_lines) + 0.6;
        lines.max(2.0) * LINE * style.small_px()
    }

    fn marks(&self) -> impl Iterator<Item = &ForestMark> {
        self.series.iter().flat_map(|series| &series.marks)
    }

    /// Returns all values and ends of intervals.
    fn ends(&self) -> impl Iterator<Item = f64> {
        let of_mark = |mark: &ForestMark| {
            let (low, high) = mark.interval.unwrap_or((mark.value, mark.value));
            [low, mark.value, high]
        };
        self.marks().flat_map(of_mark).filter(|end| end.is_finite())
    }

    /// Returns the distance from zero beyond which effects are cut off.
    fn limit(&self) -> f64 {
        let mut distances: Vec<f64> = self.ends().map(f64::abs).collect();
        distances.sort_by(f64::total_cmp);
        let rank = distances.len().saturating_sub(1) * 3 / 4;
        let third_quartile = distances.get(rank).copied().unwrap_or(0.0);
        if third_quartile > 0.0 { MAX_SPREAD * third_quartile } else { f64::INFINITY }
    }

    /// Returns the text beside the effects, broken to fit; none where a word alone is too long.
    fn beside(&self, style: &Style) -> EffectText {
        let size = style.small_px();
        let width = |text: &str| text::width(text, size, Weight::Regular);
        // Names that are longer are broken.
        let max_name = MAX_TICK_LABEL_FRACTION * style.width_px;
        let names = self.rows.iter().map(|row| width(row)).fold(0.0, f64::max).min(max_name);
        let room = MAX_WORDS_FRACTION * style.width_px - names;
        let is_broken = self.marks().any(|mark| width(&mark.text) > room);
        let mut lines = Vec::with_capacity(self.series.len());
        for series in &self.series {
            let of_mark = |mark: &ForestMark| match mark.text.rsplit_once(", p ") {
                _ if !is_broken => vec![mark.text.clone()],
                // All are broken at the same place, or lines of two effects run together.
                Some((effect, p)) => [format!("{effect},"), format!("p {p}")]
                    .iter()
                    .flat_map(|part| text::wrap(&bound_words(part), size, Weight::Regular, room))
                    .collect(),
                None => text::wrap(&bound_words(&mark.text), size, Weight::Regular, room),
            };
            lines.push(series.marks.iter().map(of_mark).collect::<Vec<_>>());
        }
        let all = lines.iter().flatten().flatten();
        // A line that was cut off would be a wrong number.
        if all.clone().any(|line| line.contains('\u{2026}')) {
            return EffectText::default();
        }
        let widest = all.map(|line| width(line)).fold(0.0, f64::max);
        let width_px = if widest > 0.0 { widest + TEXT_GAP_PX } else { 0.0 };
        EffectText { lines, width_px }
    }

    /// A single series needs no legend.
    fn legend(&self) -> Vec<LegendEntry> {
        if self.series.len() < 2 {
            return vec![];
        }
        let entry = |(index, series): (usize, &ForestSeries)| {
            let color = series_color(index).into();
            let marker = Marker::of_series(index);
            LegendEntry::new(LegendSymbol::Marker { color, marker }, &series.label)
        };
        self.series.iter().enumerate().map(entry).collect()
    }

    fn draw_series(
        &self,
        frame: &mut ChartFrame,
        x: Scale,
        index: usize,
        (style, beside): (&Style, &EffectText),
    ) {
        let size = style.small_px();
        let effect_px = lines_of_effect(beside.max_lines()) * LINE * size;
        let aside = (index as f64 - (self.series.len() as f64 - 1.0) / 2.0) * effect_px;
        let color = series_color(index);
        let text_style = TextStyle { fill: INK, ..TextStyle::new(size, Anchor::Start) };
        for (row, mark) in self.series[index].marks.iter().enumerate() {
            let y = frame.y.px(self.rows.len() as f64 - 0.5 - row as f64) + aside;
            let text_x = frame.area.right() + TEXT_GAP_PX;
            let lines = beside.lines.get(index).map_or(&[][..], |marks| &marks[row]);
            let first = y - 0.5 * (lines.len().max(1) - 1) as f64 * TEXT_LINE * size;
            for (k, line) in lines.iter().enumerate() {
                let baseline = first + k as f64 * TEXT_LINE * size + text_style.middle_px();
                frame.svg.text(text_x, baseline, line, &text_style);
            }
            if mark.value.is_finite() {
                let place = MarkPlace { x, y, radius: MARK_FRACTION * size };
                place.draw(frame, mark, Marker::of_series(index), &color);
                let at = x.px(mark.value).clamp(frame.area.x, frame.area.right());
                frame.push_spot((at, y), index, row);
            } else if !self.unmarked.is_empty() && !mark.text.is_empty() {
                // Beside zero, on the side where more room is.
                let zero = x.px(0.0);
                let rooms_px = [zero - frame.area.x, frame.area.right() - zero];
                let is_left = rooms_px[0] > rooms_px[1];
                let anchor = if is_left { Anchor::End } else { Anchor::Start };
                let faint = TextStyle { fill: FAINT_INK, halo: true, anchor, ..text_style };
                let room_px = rooms_px[0].max(rooms_px[1]) - size;
                let words = text::shorten(&self.unmarked, size, Weight::Regular, room_px);
                let aside_px = if is_left { -0.6 * size } else { 0.6 * size };
                frame.svg.text(zero + aside_px, y + faint.middle_px(), &words, &faint);
            }
        }
    }
}

/// The text beside the effects.
#[derive(Debug, Default)]
struct EffectText {
    /// The lines of each effect, series by series and row by row; empty if they are left out.
    lines: Vec<Vec<Vec<String>>>,
    width_px: f64,
}

impl EffectText {
    fn max_lines(&self) -> usize {
        self.lines.iter().flatten().map(Vec::len).max().unwrap_or(0)
    }
}

/// Returns the height of an effect in lines of rows, whose text has some lines of its own.
fn lines_of_effect(text_lines: usize) -> f64 {
    (text_lines as f64 * TEXT_LINE / LINE).max(1.0)
}

/// Returns a text that is broken before an interval and before a p-value, but not within one.
fn bound_words(text: &str) -> String {
    const NO_BREAK: &str = "\u{a0}";
    let mut bound = String::new();
    let mut is_in_interval = false;
    for word in text.split(' ') {
        let is_relation = matches!(word, "=" | "<");
        let follows_relation = bound.ends_with('=') || bound.ends_with('<');
        let gap = if is_in_interval || is_relation || follows_relation { NO_BREAK } else { " " };
        if !bound.is_empty() {
            bound += gap;
        }
        bound += word;
        is_in_interval = (is_in_interval || word.starts_with('[')) && !word.contains(']');
    }
    bound
}

/// Returns an effect with its sign and about three digits: its text has the whole number.
fn signed_words(value: f64) -> String {
    let decimals = if value.abs() < 10.0 { 2 } else { 0 };
    format!("{value:+.decimals$}").replace('-', "\u{2212}")
}

/// Least height that a style may have: the rows decide.
const MIN_HEIGHT_PX: f64 = 100.0;

/// Where a mark is drawn.
struct MarkPlace {
    x: Scale,
    y: f64,
    radius: f64,
}

impl MarkPlace {
    /// Draws an effect and its interval; what lies outside of the area becomes an arrow at its edge.
    fn draw(&self, frame: &mut ChartFrame, mark: &ForestMark, marker: Marker, color: &str) {
        let (left, right) = (frame.area.x, frame.area.right());
        let interval = mark.interval.filter(|(low, high)| low.is_finite() && high.is_finite());
        if let Some((low, high)) = interval {
            let ends = (self.x.px(low).max(left), self.x.px(high).min(right));
            if ends.0 < ends.1 {
                level_error_bar(&mut frame.svg, self.y, ends, 0.6 * self.radius, color);
            }
        }
        let (low, high) = interval.unwrap_or((mark.value, mark.value));
        if self.x.px(low) < left - 0.5 {
            self.arrow(frame, left, -1.0, color);
        }
        if self.x.px(high) > right + 0.5 {
            self.arrow(frame, right, 1.0, color);
        }
        let at = self.x.px(mark.value);
        let is_left = at < left - 0.5;
        if is_left || at > right + 0.5 {
            // The mark that the axis has no room for is a number, beside what is seen of its interval.
            let (inner, side) = if is_left { (high, 1.0) } else { (low, -1.0) };
            let end_px = self.x.px(inner).clamp(left, right);
            self.write_value(frame, mark.value, (end_px, side));
            return;
        }
        let has_zero = interval.is_some_and(|(low, high)| low <= 0.0 && high >= 0.0);
        marker.draw(&mut frame.svg, (at, self.y), self.radius, color);
        if has_zero {
            // The same marker, smaller and in the color of the ground, leaves a rim.
            marker.draw(&mut frame.svg, (at, self.y), 0.55 * self.radius, GROUND);
        }
    }

    /// Writes a value, in units of the axis, to one side of a place.
    fn write_value(&self, frame: &mut ChartFrame, value: f64, (x, side): (f64, f64)) {
        let size = self.radius / MARK_FRACTION;
        let anchor = if side < 0.0 { Anchor::End } else { Anchor::Start };
        let style = TextStyle { fill: INK, halo: true, ..TextStyle::new(size, anchor) };
        let words = signed_words(value);
        frame.svg.text(x + side * 0.8 * size, self.y + style.middle_px(), &words, &style);
    }

    /// Draws the head of an arrow that points out of the area.
    fn arrow(&self, frame: &mut ChartFrame, edge: f64, side: f64, color: &str) {
        let tip = edge + side * self.radius;
        let back = edge - side * self.radius;
        let (top, bottom) = (self.y - self.radius, self.y + self.radius);
        let data =
            crate::chart::frame::polyline([(tip, self.y), (back, top), (back, bottom)].into_iter())
                + "Z";
        frame.svg.path(&data, format_args!(r#"fill="{color}""#));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chart(effects: [f64; 4], text: &str) -> ForestChart {
        let mark = |value: f64| ForestMark {
            value,
            interval: Some((value - 1.0, value + 1.0)),
            text: text.into(),
        };
        let series = ForestSeries { label: "b".into(), marks: effects.map(mark).to_vec() };
        let rows = ["way", "trips", "waits", "hits"];
        ForestChart::new("T", Axis::linear("difference (%)"), rows).series(series)
    }

    #[test]
    fn a_mark_is_hollow_where_its_interval_has_zero_in_it_and_an_arrow_where_it_is_far_away() {
        let drawn = chart([5.0, 0.5, -6.0, 900.0], "+5.0").draw(&Style::CHART).unwrap();
        // Three marks, one of them with a hole; the fourth lies beyond the axis.
        assert_eq!(drawn.svg.matches("<circle").count(), 4);
        assert_eq!((drawn.spots.len(), drawn.svg.matches(">+5.0</text>").count()), (4, 4));
        assert!(drawn.svg.contains("Z\" fill=\"#0072B2\""), "{}", drawn.svg);
        assert!(drawn.svg.contains(">+900</text>"), "the arrow says how far: {}", drawn.svg);
        let below = chart([5.0, 0.5, 6.0, -1234.5], "").draw(&Style::CHART).unwrap().svg;
        assert!(below.contains(">\u{2212}1234</text>"), "{below}");
        assert_eq!(signed_words(-1.256), "\u{2212}1.26");
    }

    #[test]
    fn words_beside_the_effects_are_broken_where_they_have_no_room() {
        let long = "+5.0 [4.0, 6.0], p = 0.0003";
        let narrow = Style { width_px: 240.0, ..Style::CHART };
        let draw = |text: &str| chart([1.0, 2.0, 3.0, 4.0], text).draw(&narrow).unwrap().svg;
        let svg = draw(long);
        let count = |words: &str| svg.matches(&format!(">{words}</text>")).count();
        assert_eq!(count("+5.0 [4.0,\u{a0}6.0],") + count("[4.0,\u{a0}6.0],"), 4, "{svg}");
        assert_eq!(count("p\u{a0}=\u{a0}0.0003"), 4, "{svg}");
        let word = "antidisestablishmentarianism";
        assert!(!draw(word).contains("antidis"), "a word that has no room is left out");
    }

    #[test]
    fn a_chart_needs_an_effect_for_each_row() {
        let narrow = Style { width_px: 240.0, ..Style::CHART };
        let short = ForestChart::new("T", Axis::linear(""), ["a"])
            .series(ForestSeries { label: String::new(), marks: vec![] });
        assert!(short.draw(&narrow).is_err());
    }
}
