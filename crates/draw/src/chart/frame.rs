//! The frame of a chart: margins that fit the labels, grid, ticks, axis labels, title, legend.

use crate::axis::{FittedAxis, Scale};
use crate::chart::{DrawnChart, Spot};
use crate::legend::{Legend, LegendEntry, paragraph, title_style};
use crate::style::{FAINT_INK, GRID, INK, Style};
use crate::svg::{Anchor, Rect, Svg, SvgNumber, TextStyle};
use crate::text::{self, Weight};
use crate::ticks::LabelSpacing;

const TICK_PX: f64 = 5.0;
const EDGE_PX: f64 = 10.0;
const LABEL_GAP_PX: f64 = 5.0;
const NOTE_GAP_PX: f64 = 8.0;
/// Gap between the names of two categories.
const SLOT_GAP_PX: f64 = 6.0;
/// Gap between an upright name and the axis.
const UPRIGHT_GAP_PX: f64 = 4.0;
/// Largest fraction of the picture's height that upright names take; longer ones are cut off.
const MAX_UPRIGHT_FRACTION: f64 = 0.4;
/// Least fraction of the picture's height for the data: long labels make the picture higher, not the data flat.
const MIN_AREA_FRACTION: f64 = 0.4;
/// Largest fraction of the picture's width that labels of the vertical axis take; longer ones are broken. Numbers never
/// are so long, names of metrics are.
pub(crate) const MAX_TICK_LABEL_FRACTION: f64 = 0.34;

/// The content of the horizontal axis.
pub(crate) enum XAxis<'a> {
    /// A numeric axis, its range known.
    Values(FittedAxis),
    /// Named slots of equal width.
    Categories(&'a [String]),
}

/// The words of a frame, and the room that they take beside the data.
#[derive(Default)]
pub(crate) struct FrameText<'a> {
    pub(crate) title: &'a str,
    pub(crate) note: &'a str,
    pub(crate) x_label: &'a str,
    pub(crate) y_label: &'a str,
    pub(crate) legend: Vec<LegendEntry>,
    /// Room on the right of the area, for text beside the data.
    pub(crate) beside_px: f64,
    /// Least height of the area, for data in rows.
    pub(crate) rows_px: f64,
}

/// Returns the number of labeled ticks that fit a picture of this style, across and upward.
pub(crate) fn max_ticks(style: &Style) -> (usize, usize) {
    // A label of five digits is about four letters wide, and needs space beside it.
    let across = style.width_px / (7.0 * style.font_px);
    let upward = style.height_px / (4.5 * style.font_px);
    ((across as usize).clamp(2, 12), (upward as usize).clamp(2, 10))
}

/// A chart under construction: its axes are drawn, the data come next.
pub(crate) struct ChartFrame {
    pub(crate) svg: Svg,
    /// The area of the data.
    pub(crate) area: Rect,
    pub(crate) y: Scale,
    style: Style,
    title: String,
    note: Vec<String>,
    note_top: f64,
    spots: Vec<Spot>,
}

/// The lines of text around the area, broken to fit.
struct WrappedLabels {
    title: Vec<String>,
    note: Vec<String>,
    x: Vec<String>,
    y: Vec<String>,
    y_ticks: Vec<Vec<String>>,
    slots: SlotNames,
}

/// The names under a bar chart's slots.
#[derive(Default)]
struct SlotNames {
    names: Vec<Vec<String>>,
    /// Whether the slots are too narrow for a word, so that names read upward.
    upright: bool,
    height_px: f64,
}

impl WrappedLabels {
    /// Breaks the text beside the area, which decides how wide that is.
    fn beside(style: &Style, words: &FrameText<'_>, up: &FittedAxis) -> Self {
        let least_height = MIN_AREA_FRACTION * style.height_px;
        let room = MAX_TICK_LABEL_FRACTION * style.width_px;
        let wrap_tick = |label: &String| text::wrap(label, style.small_px(), Weight::Regular, room);
        Self {
            title: vec![],
            note: vec![],
            x: vec![],
            y: text::wrap(words.y_label, style.font_px, Weight::Regular, least_height),
            y_ticks: up.ticks.major.iter().map(|(_, label)| wrap_tick(label)).collect(),
            slots: SlotNames::default(),
        }
    }

    /// Breaks the text above and below an area `width` pixels wide.
    fn wrap(self, style: &Style, words: &FrameText<'_>, across: &XAxis<'_>, width: f64) -> Self {
        let whole = style.width_px - 2.0 * EDGE_PX;
        Self {
            title: text::wrap(words.title, style.title_px(), Weight::Bold, whole),
            note: text::wrap(words.note, style.small_px(), Weight::Regular, whole),
            x: text::wrap(words.x_label, style.font_px, Weight::Regular, width),
            slots: SlotNames::wrap(style, across, width),
            ..self
        }
    }

    /// Returns the width of everything between the left edge and the area.
    fn left_px(&self, style: &Style) -> f64 {
        let lines = self.y_ticks.iter().flatten();
        let widths = lines.map(|line| text::width(line, style.small_px(), Weight::Regular));
        let ticks_px = widths.fold(0.0, f64::max) + TICK_PX + 8.0;
        EDGE_PX + self.y.len() as f64 * line_px(style) + ticks_px
    }

    /// Returns the height of everything between the area and the note.
    fn below_px(&self, style: &Style) -> f64 {
        let ticks = TICK_PX + self.slots.height_px.max(style.small_px() * 1.35);
        ticks + self.x.len() as f64 * line_px(style) + LABEL_GAP_PX + NOTE_GAP_PX
    }
}

impl SlotNames {
    fn wrap(style: &Style, across: &XAxis<'_>, width: f64) -> Self {
        let XAxis::Categories(names) = across else { return Self::default() };
        let size = style.small_px();
        let slot_px = width / names.len().max(1) as f64 - SLOT_GAP_PX;
        let mut words = names.iter().flat_map(|name| name.split(' '));
        // A word that is wider than its slot cannot be broken, so all names stand upright.
        if words.any(|word| text::width(word, size, Weight::Regular) > slot_px) {
            let most = MAX_UPRIGHT_FRACTION * style.height_px;
            let names: Vec<_> = names
                .iter()
                .map(|name| vec![text::shorten(name, size, Weight::Regular, most)])
                .collect();
            let heights_px =
                names.iter().flatten().map(|name| text::width(name, size, Weight::Regular));
            let height_px = heights_px.fold(0.0, f64::max) + UPRIGHT_GAP_PX;
            return Self { names, upright: true, height_px };
        }
        let names: Vec<_> =
            names.iter().map(|name| text::wrap(name, size, Weight::Regular, slot_px)).collect();
        let most_lines = names.iter().map(Vec::len).max().unwrap_or(0);
        Self { names, upright: false, height_px: most_lines as f64 * size * 1.35 }
    }
}

impl ChartFrame {
    /// Lays out and draws everything except the data.
    pub(crate) fn open(
        style: &Style,
        words: FrameText<'_>,
        across: &XAxis<'_>,
        up: &FittedAxis,
    ) -> Self {
        let beside = WrappedLabels::beside(style, &words, up);
        let left = beside.left_px(style);
        let right = EDGE_PX + right_room(style, across) + words.beside_px;
        let width = (style.width_px - left - right).max(60.0);
        let labels = beside.wrap(style, &words, across, width);
        let legend = Legend::new(words.legend, style.font_px, style.width_px - 2.0 * EDGE_PX);
        let mut svg = Svg::default();
        let top = draw_head(&mut svg, style, &labels.title, &legend);
        let below = labels.below_px(style);
        let note_px = labels.note.len() as f64 * style.small_px() * 1.35;
        let least_height = (MIN_AREA_FRACTION * style.height_px).max(words.rows_px);
        let height = (style.height_px - top - below - note_px - EDGE_PX).max(least_height);
        let area = Rect { x: left, y: top, width, height };
        let title = words.title.to_string();
        let y = up.scale_between(area.bottom(), area.y);
        let note_top = area.bottom() + below;
        let mut frame =
            Self { svg, area, y, style: *style, title, note: vec![], note_top, spots: vec![] };
        frame.draw_axes(across, up, &labels);
        frame.note = labels.note;
        frame
    }

    pub(crate) fn x_scale(&self, across: &FittedAxis) -> Scale {
        across.scale_between(self.area.x, self.area.right())
    }

    /// Opens a group for data, of which only the part inside the area is visible.
    pub(crate) fn open_data(&mut self) {
        self.svg.open_clip(self.area.grown(6.0));
    }

    /// Notes where the mark of a value is.
    pub(crate) fn push_spot(&mut self, (x, y): (f64, f64), series: usize, point: usize) {
        self.spots.push(Spot { x_px: x, y_px: y, series, point });
    }

    pub(crate) fn finish(mut self) -> DrawnChart {
        let text_style =
            TextStyle { fill: FAINT_INK, ..TextStyle::new(self.style.small_px(), Anchor::Start) };
        let end = paragraph(&mut self.svg, &self.note, (EDGE_PX, self.note_top), &text_style);
        let height = (end + EDGE_PX).max(self.style.height_px);
        let svg = self.svg.finish(self.style.width_px, height, &self.title);
        DrawnChart { svg, spots: self.spots }
    }

    fn draw_axes(&mut self, across: &XAxis<'_>, up: &FittedAxis, labels: &WrappedLabels) {
        self.draw_y_ticks(up, &labels.y_ticks);
        match across {
            XAxis::Values(fitted) => self.draw_x_ticks(fitted),
            XAxis::Categories(_) => self.draw_categories(&labels.slots),
        }
        let (left, bottom, right) = (self.area.x, self.area.bottom(), self.area.right());
        let ink = axis_ink();
        self.svg.line((left, bottom), (right, bottom), &ink);
        self.svg.line((left, self.area.y), (left, bottom), &ink);
        self.draw_axis_labels(labels);
    }

    fn draw_y_ticks(&mut self, up: &FittedAxis, labels: &[Vec<String>]) {
        let (left, right) = (self.area.x, self.area.right());
        let text_style = TextStyle::new(self.style.small_px(), Anchor::End);
        let mut spacing = LabelSpacing::new();
        for ((value, _), lines) in up.ticks.major.iter().zip(labels) {
            let y = self.y.px(*value);
            self.svg.line((left, y), (right, y), grid_ink());
            self.svg.line((left - TICK_PX, y), (left, y), axis_ink());
            let line_px = 1.15 * text_style.size_px;
            let more_lines_px = lines.len().saturating_sub(1) as f64 * line_px;
            if spacing.try_place(-y, text_style.size_px + more_lines_px) {
                let first = y + text_style.middle_px() - more_lines_px / 2.0;
                for (row, line) in lines.iter().enumerate() {
                    let baseline = first + row as f64 * line_px;
                    self.svg.text(left - TICK_PX - 3.0, baseline, line, &text_style);
                }
            }
        }
        for value in &up.ticks.minor {
            let y = self.y.px(*value);
            self.svg.line((left - 0.6 * TICK_PX, y), (left, y), axis_ink());
        }
    }

    fn draw_x_ticks(&mut self, across: &FittedAxis) {
        let x = self.x_scale(across);
        let (top, bottom) = (self.area.y, self.area.bottom());
        let text_style = TextStyle::new(self.style.small_px(), Anchor::Middle);
        let mut spacing = LabelSpacing::new();
        for (value, label) in &across.ticks.major {
            let at = x.px(*value);
            self.svg.line((at, top), (at, bottom), grid_ink());
            self.svg.line((at, bottom), (at, bottom + TICK_PX), axis_ink());
            let label_px = text::width(label, text_style.size_px, Weight::Regular);
            // Given ticks may be too close together for all their labels.
            if spacing.try_place(at, label_px + 0.4 * text_style.size_px) {
                self.svg.text(at, bottom + TICK_PX + 2.0 + text_style.size_px, label, &text_style);
            }
        }
        for value in &across.ticks.minor {
            let at = x.px(*value);
            self.svg.line((at, bottom), (at, bottom + 0.6 * TICK_PX), axis_ink());
        }
    }

    fn draw_categories(&mut self, slots: &SlotNames) {
        let slot = self.area.width / slots.names.len().max(1) as f64;
        let top = self.area.bottom() + TICK_PX;
        let anchor = if slots.upright { Anchor::End } else { Anchor::Middle };
        let text_style =
            TextStyle { upward: slots.upright, ..TextStyle::new(self.style.small_px(), anchor) };
        for (index, lines) in slots.names.iter().enumerate() {
            let center = self.area.x + (index as f64 + 0.5) * slot;
            if slots.upright {
                self.svg.text(center + text_style.middle_px(), top, &lines.concat(), &text_style);
            } else {
                paragraph(&mut self.svg, lines, (center, top), &text_style);
            }
        }
    }

    fn draw_axis_labels(&mut self, labels: &WrappedLabels) {
        let Rect { x, y, width, height } = self.area;
        let line = line_px(&self.style);
        let text_style = TextStyle::new(self.style.font_px, Anchor::Middle);
        let top = self.note_top - labels.x.len() as f64 * line - NOTE_GAP_PX;
        paragraph(&mut self.svg, &labels.x, (x + width / 2.0, top), &text_style);
        let upward = TextStyle { upward: true, ..text_style };
        for (row, text) in labels.y.iter().enumerate() {
            let baseline = EDGE_PX + row as f64 * line + self.style.font_px;
            self.svg.text(baseline, y + height / 2.0, text, &upward);
        }
    }
}

fn axis_ink() -> String {
    format!(r#"stroke="{INK}""#)
}

fn grid_ink() -> String {
    format!(r#"stroke="{GRID}""#)
}

fn line_px(style: &Style) -> f64 {
    style.font_px * 1.35
}

/// Returns the room on the right, because half of the last tick's label may extend beyond the area.
fn right_room(style: &Style, across: &XAxis<'_>) -> f64 {
    let XAxis::Values(fitted) = across else { return 0.0 };
    let last = fitted.ticks.major.last();
    last.map_or(0.0, |(_, label)| text::width(label, style.small_px(), Weight::Regular) / 2.0)
}

/// Draws title and legend; returns where the area may start.
fn draw_head(svg: &mut Svg, style: &Style, title: &[String], legend: &Legend) -> f64 {
    let top = paragraph(svg, title, (EDGE_PX, EDGE_PX), &title_style(style.title_px()));
    legend.draw(svg, EDGE_PX, top + 2.0);
    top + legend.height_px() + 14.0
}

/// Returns path data of a polyline through points in pixels.
pub(crate) fn polyline(points: impl Iterator<Item = (f64, f64)>) -> String {
    let mut data = String::new();
    for (x, y) in points {
        let command = if data.is_empty() { 'M' } else { 'L' };
        data.push_str(&format!("{command}{} {}", SvgNumber(x), SvgNumber(y)));
    }
    data
}
