//! The frame of a chart: margins that fit the labels, grid, ticks, axis labels, title, legend.

use crate::axis::{Fitted, Scale};
use crate::legend::{Entry, Legend, paragraph, title_look};
use crate::style::{FAINT_INK, GRID, INK, Style};
use crate::svg::{Anchor, Num, Rect, Svg, TextLook};
use crate::text::{self, Weight};

const TICK_PX: f64 = 5.0;
const EDGE_PX: f64 = 10.0;
const LABEL_GAP_PX: f64 = 5.0;

/// What runs along the horizontal axis.
pub(crate) enum Across<'a> {
    /// Numbers.
    Values(Fitted),
    /// Named slots of equal width.
    Categories(&'a [String]),
}

/// All that a frame says.
pub(crate) struct Words<'a> {
    pub(crate) title: &'a str,
    pub(crate) note: &'a str,
    pub(crate) x_label: &'a str,
    pub(crate) y_label: &'a str,
    pub(crate) legend: Vec<Entry>,
}

/// How many labeled ticks a picture of this style has room for, across and upward.
pub(crate) fn most_ticks(style: &Style) -> (usize, usize) {
    let across = style.width_px / (7.0 * style.font_px);
    let upward = style.height_px / (4.5 * style.font_px);
    ((across as usize).clamp(2, 12), (upward as usize).clamp(2, 10))
}

/// A chart under construction: its axes stand, the data come next.
pub(crate) struct Frame {
    pub(crate) svg: Svg,
    /// Where the data go.
    pub(crate) area: Rect,
    pub(crate) y: Scale,
    style: Style,
    title: String,
    note: Vec<String>,
    note_top: f64,
}

/// The lines of text around the area, broken for the room there is.
struct Labels {
    title: Vec<String>,
    x: Vec<String>,
    y: Vec<String>,
    categories: Vec<Vec<String>>,
}

impl Frame {
    /// Lays out and draws everything but the data.
    pub(crate) fn open(style: &Style, words: Words<'_>, across: &Across<'_>, up: &Fitted) -> Self {
        let small = style.small_px();
        let y = text::wrap(words.y_label, style.font_px, Weight::Regular, 0.7 * style.height_px);
        let ticks_px = up.ticks.widest_px(|label| text::width(label, small, Weight::Regular));
        let left = EDGE_PX + y.len() as f64 * line_px(style) + ticks_px + TICK_PX + 8.0;
        let width = (style.width_px - left - EDGE_PX - right_room(style, across)).max(60.0);
        let labels = Labels {
            title: text::wrap(
                words.title,
                style.title_px(),
                Weight::Bold,
                style.width_px - 2.0 * EDGE_PX,
            ),
            x: text::wrap(words.x_label, style.font_px, Weight::Regular, width),
            y,
            categories: wrapped_categories(style, across, width),
        };
        let note = text::wrap(words.note, small, Weight::Regular, style.width_px - 2.0 * EDGE_PX);
        let legend = Legend::lay_out(words.legend, style.font_px, style.width_px - 2.0 * EDGE_PX);
        let mut svg = Svg::default();
        let top = draw_head(&mut svg, style, &labels.title, &legend);
        let below = below_px(style, &labels);
        let note_px = note.len() as f64 * small * 1.35;
        let height = (style.height_px - top - below - note_px - EDGE_PX).max(80.0);
        let area = Rect { x: left, y: top, width, height };
        let y = up.between(area.bottom(), area.y);
        let title = words.title.to_string();
        let mut frame =
            Self { svg, area, y, style: *style, title, note, note_top: area.bottom() + below };
        frame.draw_axes(across, up, &labels);
        frame
    }

    /// The horizontal scale of `across`.
    pub(crate) fn x_scale(&self, across: &Fitted) -> Scale {
        across.between(self.area.x, self.area.right())
    }

    /// Opens a group for data, of which only what lies in the area is seen.
    pub(crate) fn open_data(&mut self) {
        self.svg.open_clip(self.area.grown(6.0));
    }

    /// The finished picture.
    pub(crate) fn finish(mut self) -> String {
        let look =
            TextLook { fill: FAINT_INK, ..TextLook::new(self.style.small_px(), Anchor::Start) };
        let end = paragraph(&mut self.svg, &self.note, (EDGE_PX, self.note_top), &look);
        self.svg.finish(self.style.width_px, (end + EDGE_PX).max(self.style.height_px), &self.title)
    }

    fn draw_axes(&mut self, across: &Across<'_>, up: &Fitted, labels: &Labels) {
        self.draw_y_ticks(up);
        match across {
            Across::Values(fitted) => self.draw_x_ticks(fitted),
            Across::Categories(_) => self.draw_categories(&labels.categories),
        }
        let (left, bottom, right) = (self.area.x, self.area.bottom(), self.area.right());
        let ink = axis_ink();
        self.svg.line((left, bottom), (right, bottom), &ink);
        self.svg.line((left, self.area.y), (left, bottom), &ink);
        self.draw_axis_labels(labels);
    }

    fn draw_y_ticks(&mut self, up: &Fitted) {
        let (left, right) = (self.area.x, self.area.right());
        let look = TextLook::new(self.style.small_px(), Anchor::End);
        for (value, label) in &up.ticks.major {
            let y = self.y.px(*value);
            self.svg.line((left, y), (right, y), grid_ink());
            self.svg.line((left - TICK_PX, y), (left, y), axis_ink());
            self.svg.text(left - TICK_PX - 3.0, y + look.middle_px(), label, &look);
        }
        for value in &up.ticks.minor {
            let y = self.y.px(*value);
            self.svg.line((left - 0.6 * TICK_PX, y), (left, y), axis_ink());
        }
    }

    fn draw_x_ticks(&mut self, across: &Fitted) {
        let x = self.x_scale(across);
        let (top, bottom) = (self.area.y, self.area.bottom());
        let look = TextLook::new(self.style.small_px(), Anchor::Middle);
        let mut free_from = f64::NEG_INFINITY;
        for (value, label) in &across.ticks.major {
            let at = x.px(*value);
            self.svg.line((at, top), (at, bottom), grid_ink());
            self.svg.line((at, bottom), (at, bottom + TICK_PX), axis_ink());
            let half = text::width(label, look.size_px, Weight::Regular) / 2.0;
            // Given ticks may stand too close for all their labels.
            if at - half >= free_from {
                self.svg.text(at, bottom + TICK_PX + 2.0 + look.size_px, label, &look);
                free_from = at + half + 0.4 * look.size_px;
            }
        }
        for value in &across.ticks.minor {
            let at = x.px(*value);
            self.svg.line((at, bottom), (at, bottom + 0.6 * TICK_PX), axis_ink());
        }
    }

    fn draw_categories(&mut self, categories: &[Vec<String>]) {
        let slot = self.area.width / categories.len().max(1) as f64;
        let look = TextLook::new(self.style.small_px(), Anchor::Middle);
        for (index, lines) in categories.iter().enumerate() {
            let center = self.area.x + (index as f64 + 0.5) * slot;
            paragraph(&mut self.svg, lines, (center, self.area.bottom() + TICK_PX), &look);
        }
    }

    fn draw_axis_labels(&mut self, labels: &Labels) {
        let Rect { x, y, width, height } = self.area;
        let line = line_px(&self.style);
        let look = TextLook::new(self.style.font_px, Anchor::Middle);
        let top = self.note_top - labels.x.len() as f64 * line - 8.0;
        paragraph(&mut self.svg, &labels.x, (x + width / 2.0, top), &look);
        let upward = TextLook { upward: true, ..look };
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

/// Half of the last tick's label may stand out beyond the area.
fn right_room(style: &Style, across: &Across<'_>) -> f64 {
    let Across::Values(fitted) = across else { return 0.0 };
    let last = fitted.ticks.major.last();
    last.map_or(0.0, |(_, label)| text::width(label, style.small_px(), Weight::Regular) / 2.0)
}

fn wrapped_categories(style: &Style, across: &Across<'_>, width: f64) -> Vec<Vec<String>> {
    let Across::Categories(names) = across else { return vec![] };
    let room = width / names.len().max(1) as f64 - 6.0;
    names.iter().map(|name| text::wrap(name, style.small_px(), Weight::Regular, room)).collect()
}

/// Draws title and legend; returns where the area may begin.
fn draw_head(svg: &mut Svg, style: &Style, title: &[String], legend: &Legend) -> f64 {
    let top = paragraph(svg, title, (EDGE_PX, EDGE_PX), &title_look(style.title_px()));
    legend.draw(svg, EDGE_PX, top + 2.0);
    top + legend.height_px() + 14.0
}

/// The height of all that stands between the area and the note.
fn below_px(style: &Style, labels: &Labels) -> f64 {
    let rows = labels.categories.iter().map(Vec::len).max().unwrap_or(1).max(1) as f64;
    let ticks = TICK_PX + rows * style.small_px() * 1.35;
    ticks + labels.x.len() as f64 * line_px(style) + LABEL_GAP_PX + 8.0
}

/// A polyline's path data through points in pixels.
pub(crate) fn polyline(points: impl Iterator<Item = (f64, f64)>) -> String {
    let mut data = String::new();
    for (x, y) in points {
        let command = if data.is_empty() { 'M' } else { 'L' };
        data.push_str(&format!("{command}{} {}", Num(x), Num(y)));
    }
    data
}
