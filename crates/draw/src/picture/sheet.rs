//! The surroundings of the map: title, axes in meters, scale bar, legend, caption.

use crate::legend::{Legend, LegendEntry, paragraph, small_print_style, title_style};
use crate::style::{INK, Style};
use crate::svg::{Anchor, Rect, Svg, TextStyle};
use crate::text::{self, Weight};
use crate::ticks::{LabelSpacing, Ticks, decimals, label, nice_step};

pub(super) const EDGE_PX: f64 = 10.0;
const TICK_PX: f64 = 4.0;
/// Gap between the map and a legend beside it.
pub(super) const COLUMN_GAP_PX: f64 = 16.0;
/// The length of "y (m)" in letter sizes.
const Y_LABEL_LETTERS: f64 = 3.0;
/// Least width of a picture, in letters, to make room for title and legend, and for a legend alone.
const MIN_WIDTH_LETTERS: [f64; 2] = [32.0, 24.0];
/// Extent from which on axes are in kilometers, meters.
const MIN_KM_EXTENT_M: f64 = 5000.0;

/// Returns the unit of length for something of this extent, and its length in meters.
pub(super) fn unit(extent_m: f64) -> (&'static str, f64) {
    if extent_m < MIN_KM_EXTENT_M { ("m", 1.0) } else { ("km", 1000.0) }
}

/// The content of a sheet: a rectangle in meters, and the words around it.
pub(super) struct SheetContent<'a> {
    /// World coordinates of its lower left corner.
    pub(super) origin_m: [f64; 2],
    /// Width and height.
    pub(super) size_m: [f64; 2],
    /// The names of the horizontal and the vertical axis.
    pub(super) axes: [&'static str; 2],
    /// Least width of all of it: with more room, the legend has fewer rows, and the map is in the middle.
    pub(super) min_width_px: f64,
    /// Where the legend stands.
    pub(super) legend: LegendPlace,
    pub(super) entries: Vec<LegendEntry>,
    pub(super) title: &'a str,
    pub(super) caption: &'a str,
}

/// Where the legend of a sheet stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum LegendPlace {
    /// Below the map, in rows.
    Below,
    /// On the right of the map, in a column.
    Beside,
}

/// The position of the map in the picture.
pub(super) struct Sheet {
    /// The map in pixels.
    pub(super) map: Rect,
    /// Pixels per meter.
    px: f64,
    axes: [&'static str; 2],
    unit: (&'static str, f64),
    width: f64,
    /// Distance of the label of the vertical axis from the picture's left edge.
    label_x: f64,
    /// Length by which the label of a low map's vertical axis extends above and below it.
    spill: f64,
}

/// One edge of the map in its unit.
struct SheetEdge {
    origin: f64,
    length: f64,
    ticks: Ticks,
}

impl SheetEdge {
    fn new(origin: f64, length: f64, length_px: f64, tick_room_px: f64) -> Self {
        let most = ((length_px / tick_room_px) as usize).clamp(1, 12);
        // Sizes that a double cannot resolve at this origin have no ticks.
        let exact = length > 1e-9 * origin.abs() && length.is_finite();
        let ticks =
            if exact { Ticks::linear(origin, origin + length, most) } else { Ticks::default() };
        Self { origin, length, ticks }
    }

    /// Returns each tick's distance from the edge's start, as part of the edge, and its label.
    fn marks(&self) -> impl Iterator<Item = (f64, &str)> {
        self.ticks.major.iter().map(|(v, label)| ((v - self.origin) / self.length, label.as_str()))
    }
}

impl Sheet {
    /// Draws title and axes, and returns the place of the map.
    pub(super) fn open(svg: &mut Svg, area: &SheetContent<'_>, style: &Style, px: f64) -> Self {
        let size = style.small_px();
        let [x0, y0] = area.origin_m;
        let [width, height] = area.size_m;
        let unit = unit(width.max(height));
        let (_, unit_m) = unit;
        let across = SheetEdge::new(x0 / unit_m, width / unit_m, width * px, 6.0 * size);
        let upward = SheetEdge::new(y0 / unit_m, height / unit_m, height * px, 4.0 * size);
        let labels = upward.ticks.max_label_px(|label| text::width(label, size, Weight::Regular));
        let left = EDGE_PX + 1.5 * style.font_px + labels + TICK_PX + 4.0;
        let map_width = width * px;
        let map_height = height * px;
        let min_letters = MIN_WIDTH_LETTERS[usize::from(area.title.is_empty())];
        let column_px = match area.legend {
            LegendPlace::Below => 0.0,
            LegendPlace::Beside => COLUMN_GAP_PX + Legend::column_px(&area.entries, size),
        };
        let own_width = left + map_width + column_px + 2.0 * EDGE_PX + size;
        let width = own_width.max(min_letters * style.font_px).max(area.min_width_px);
        let aside = if area.min_width_px > 0.0 { 0.5 * (width - own_width) } else { 0.0 };
        let lines = text::wrap(area.title, style.title_px(), Weight::Bold, width - 2.0 * EDGE_PX);
        let top = paragraph(svg, &lines, (EDGE_PX, EDGE_PX), &title_style(style.title_px()));
        // The label of the y axis may be longer than a low map: it then needs space above and below.
        let spill = ((Y_LABEL_LETTERS * style.font_px - map_height) / 2.0).max(0.0);
        // Whole pixels, for sharp edges.
        let map = Rect {
            x: (left + aside).ceil(),
            y: (top + spill + 8.0).ceil(),
            width: map_width,
            height: map_height,
        };
        let label_x = EDGE_PX + aside;
        let sheet = Self { map, px, axes: area.axes, unit, width, label_x, spill };
        sheet.draw_across(svg, style, &across);
        sheet.draw_upward(svg, style, &upward);
        sheet
    }

    /// Draws everything below the map and finishes the picture.
    pub(super) fn close(&self, mut svg: Svg, area: SheetContent<'_>, style: &Style) -> String {
        let axis_px = TICK_PX + style.small_px() + 1.6 * style.font_px + 14.0;
        let top = self.map.bottom() + axis_px.max(self.spill + 8.0);
        let bar_px = self.draw_scale_bar(&mut svg, style, top);
        let size = style.small_px();
        let scale_px = 2.4 * size;
        let top = match area.legend {
            LegendPlace::Below => {
                let left = self.map.x + bar_px + 2.0 * style.font_px;
                let legend = Legend::new(area.entries, size, self.width - left - EDGE_PX);
                legend.draw(&mut svg, left, top - 4.0);
                top + legend.height_px().max(scale_px) + 6.0
            }
            LegendPlace::Beside => {
                let column_px = Legend::column_px(&area.entries, size);
                let legend = Legend::new(area.entries, size, column_px);
                legend.draw(&mut svg, self.map.right() + COLUMN_GAP_PX, self.map.y);
                (top + scale_px).max(self.map.y + legend.height_px()) + 6.0
            }
        };
        let lines = text::wrap(area.caption, size, Weight::Regular, self.width - 2.0 * EDGE_PX);
        let end = paragraph(&mut svg, &lines, (EDGE_PX, top), &small_print_style(size));
        svg.finish(self.width, end + EDGE_PX, area.title)
    }

    fn draw_across(&self, svg: &mut Svg, style: &Style, edge: &SheetEdge) {
        let bottom = self.map.bottom();
        let text_style = TextStyle::new(style.small_px(), Anchor::Middle);
        let baseline = bottom + TICK_PX + 3.0 + text_style.size_px;
        let mut spacing = LabelSpacing::new();
        for (part, label) in edge.marks() {
            let x = self.map.x + part * self.map.width;
            let label_px =
                text::width(label, text_style.size_px, Weight::Regular) + 0.5 * text_style.size_px;
            if spacing.try_place(x, label_px) {
                svg.line((x, bottom), (x, bottom + TICK_PX), format_args!(r#"stroke="{INK}""#));
                svg.text(x, baseline, label, &text_style);
            }
        }
        let text_style = TextStyle::new(style.font_px, Anchor::Middle);
        svg.text(
            self.map.x + self.map.width / 2.0,
            baseline + 1.45 * style.font_px,
            &format!("{} ({})", self.axes[0], self.unit.0),
            &text_style,
        );
    }

    fn draw_upward(&self, svg: &mut Svg, style: &Style, edge: &SheetEdge) {
        let left = self.map.x;
        let text_style = TextStyle::new(style.small_px(), Anchor::End);
        let mut spacing = LabelSpacing::new();
        for (part, label) in edge.marks() {
            let y = self.map.bottom() - part * self.map.height;
            if spacing.try_place(-y, text_style.size_px) {
                svg.line((left - TICK_PX, y), (left, y), format_args!(r#"stroke="{INK}""#));
                svg.text(left - TICK_PX - 3.0, y + text_style.middle_px(), label, &text_style);
            }
        }
        let text_style =
            TextStyle { upward: true, ..TextStyle::new(style.font_px, Anchor::Middle) };
        let words = format!("{} ({})", self.axes[1], self.unit.0);
        svg.text(
            self.label_x + style.font_px,
            self.map.y + self.map.height / 2.0,
            &words,
            &text_style,
        );
    }

    /// Draws a bar of round length, about a fifth of the map's longer side but less than half the
    /// picture's width. Returns its height, in pixels.
    fn draw_scale_bar(&self, svg: &mut Svg, style: &Style, top: f64) -> f64 {
        let per_px = 1.0 / (self.px * self.unit.1);
        let wanted_px = (0.2 * self.map.width.max(self.map.height)).min(0.18 * self.width);
        let length = nice_step(wanted_px * per_px, 1);
        let length_px = length / per_px;
        if !length_px.is_finite() {
            return 0.0;
        }
        let words = format!("{} {}", label(length, decimals(length)), self.unit.0);
        let text_style = TextStyle::new(style.small_px(), Anchor::Middle);
        let text_px = text::width(&words, text_style.size_px, Weight::Regular);
        let bar = Rect {
            x: self.map.x + ((text_px - length_px) / 2.0).max(0.0),
            y: top,
            width: length_px,
            height: 4.0,
        };
        svg.rect(bar, format_args!(r#"class="scale-bar" fill="{INK}""#));
        svg.text(bar.x + length_px / 2.0, top + 8.0 + text_style.size_px, &words, &text_style);
        text_px.max(length_px)
    }
}
