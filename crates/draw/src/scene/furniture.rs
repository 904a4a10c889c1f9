//! What surrounds the map: title, axes in meters, scale bar, legend, caption.

use super::{ACTIVE, ACTIVE_RIM, BodyShade, CellShade, GridScene, UNKNOWN, WALL, faint};
use crate::error::DrawError;
use crate::legend::{Entry, Legend, Symbol, paragraph, title_look};
use crate::style::{INK, Style, series_color};
use crate::svg::{Anchor, Rect, Svg, TextLook};
use crate::text::{self, Weight};
use crate::ticks::{Spacing, Ticks, decimals, label, nice_step};

const EDGE_PX: f64 = 10.0;
const TICK_PX: f64 = 4.0;
/// The length of "y (m)" in letter sizes.
const Y_LABEL_LETTERS: f64 = 3.0;
/// Pictures are at least this wide, in letters, for the sake of title and legend.
const LEAST_LETTERS: f64 = 32.0;
/// Tracks beyond this share one line of the legend.
const MOST_TRACKS_NAMED: usize = 10;

/// What a sheet shows: a rectangle in boxes, and the words around it.
pub(crate) struct Area<'a> {
    /// World coordinates of its lower left corner.
    pub(crate) origin_m: [f64; 2],
    /// Width and height in boxes.
    pub(crate) boxes: [f64; 2],
    pub(crate) box_size_m: f64,
    pub(crate) title: &'a str,
    pub(crate) caption: &'a str,
}

/// Where the map stands in the picture.
pub(crate) struct Sheet {
    /// The map in pixels.
    pub(crate) map: Rect,
    /// Pixels per box.
    pub(super) px: f64,
    width: f64,
    /// How far the label of a low map's vertical axis stands out above and below it.
    spill: f64,
}

/// One edge of the map in meters.
struct Edge {
    origin_m: f64,
    meters: f64,
    ticks: Ticks,
}

impl Edge {
    fn new(origin_m: f64, boxes: f64, box_size_m: f64, px: f64, tick_room_px: f64) -> Self {
        let meters = boxes * box_size_m;
        let most = ((boxes * px / tick_room_px) as usize).clamp(1, 12);
        // Sizes that a double cannot tell apart at this origin have no ticks.
        let exact = meters > 1e-9 * origin_m.abs() && meters.is_finite();
        let ticks =
            if exact { Ticks::linear(origin_m, origin_m + meters, most) } else { Ticks::default() };
        Self { origin_m, meters, ticks }
    }

    /// Each tick's distance from the edge's beginning, as part of the edge, and its label.
    fn marks(&self) -> impl Iterator<Item = (f64, &str)> {
        self.ticks
            .major
            .iter()
            .map(|(v, label)| ((v - self.origin_m) / self.meters, label.as_str()))
    }
}

impl Sheet {
    /// Draws title and axes, and says where the map goes.
    pub(crate) fn open(svg: &mut Svg, area: &Area<'_>, style: &Style, px: f64) -> Self {
        let size = style.small_px();
        let ([x0, y0], [width, height]) = (area.origin_m, area.boxes);
        let across = Edge::new(x0, width, area.box_size_m, px, 6.0 * size);
        let upward = Edge::new(y0, height, area.box_size_m, px, 4.0 * size);
        let labels = upward.ticks.widest_px(|label| text::width(label, size, Weight::Regular));
        let left = EDGE_PX + 1.5 * style.font_px + labels + TICK_PX + 4.0;
        let (map_width, map_height) = (width * px, height * px);
        let width = (left + map_width + 2.0 * EDGE_PX + size).max(LEAST_LETTERS * style.font_px);
        let lines = text::wrap(area.title, style.title_px(), Weight::Bold, width - 2.0 * EDGE_PX);
        let top = paragraph(svg, &lines, (EDGE_PX, EDGE_PX), &title_look(style.title_px()));
        // Whole pixels, for sharp edges.
        let spill = ((Y_LABEL_LETTERS * style.font_px - map_height) / 2.0).max(0.0);
        let (x, y) = (left.ceil(), (top + spill + 8.0).ceil());
        let map = Rect { x, y, width: map_width, height: map_height };
        let sheet = Self { map, px, width, spill };
        sheet.draw_across(svg, style, &across);
        sheet.draw_upward(svg, style, &upward);
        sheet
    }

    /// Draws what stands under the map and ends the picture.
    pub(crate) fn close(
        &self,
        mut svg: Svg,
        area: &Area<'_>,
        entries: Vec<Entry>,
        style: &Style,
    ) -> Result<String, DrawError> {
        let axis_px = TICK_PX + style.small_px() + 1.6 * style.font_px + 14.0;
        let top = self.map.bottom() + axis_px.max(self.spill + 8.0);
        let bar_px = self.draw_scale_bar(&mut svg, area, style, top);
        let left = self.map.x + bar_px + 2.0 * style.font_px;
        let legend = Legend::lay_out(entries, style.small_px(), self.width - left - EDGE_PX);
        legend.draw(&mut svg, left, top - 4.0);
        let top = top + legend.height_px().max(2.4 * style.small_px()) + 6.0;
        let size = style.small_px();
        let lines = text::wrap(area.caption, size, Weight::Regular, self.width - 2.0 * EDGE_PX);
        let end = paragraph(&mut svg, &lines, (EDGE_PX, top), &faint(size));
        Ok(svg.finish(self.width, end + EDGE_PX, area.title))
    }

    /// The pixel of a point in boxes; far outside the map distances shrink to 100 000 px.
    pub(crate) fn at(&self, (col, row): (f64, f64)) -> (f64, f64) {
        let x = (col * self.px).clamp(-1e5, 1e5);
        let y = (row * self.px).clamp(-1e5, 1e5);
        (self.map.x + x, self.map.bottom() - y)
    }

    /// Whether a point in boxes lies on the map.
    pub(super) fn shows(&self, point: (f64, f64)) -> bool {
        let (x, y) = self.at(point);
        let Rect { x: left, y: top, .. } = self.map;
        (left..=self.map.right()).contains(&x) && (top..=self.map.bottom()).contains(&y)
    }

    fn draw_across(&self, svg: &mut Svg, style: &Style, edge: &Edge) {
        let bottom = self.map.bottom();
        let look = TextLook::new(style.small_px(), Anchor::Middle);
        let baseline = bottom + TICK_PX + 3.0 + look.size_px;
        let mut spacing = Spacing::new();
        for (part, label) in edge.marks() {
            let x = self.map.x + part * self.map.width;
            let label_px = text::width(label, look.size_px, Weight::Regular) + 0.5 * look.size_px;
            if spacing.admits(x, label_px) {
                svg.line((x, bottom), (x, bottom + TICK_PX), format_args!(r#"stroke="{INK}""#));
                svg.text(x, baseline, label, &look);
            }
        }
        let look = TextLook::new(style.font_px, Anchor::Middle);
        svg.text(
            self.map.x + self.map.width / 2.0,
            baseline + 1.45 * style.font_px,
            "x (m)",
            &look,
        );
    }

    fn draw_upward(&self, svg: &mut Svg, style: &Style, edge: &Edge) {
        let left = self.map.x;
        let look = TextLook::new(style.small_px(), Anchor::End);
        let mut spacing = Spacing::new();
        for (part, label) in edge.marks() {
            let y = self.map.bottom() - part * self.map.height;
            if spacing.admits(-y, look.size_px) {
                svg.line((left - TICK_PX, y), (left, y), format_args!(r#"stroke="{INK}""#));
                svg.text(left - TICK_PX - 3.0, y + look.middle_px(), label, &look);
            }
        }
        let look = TextLook { upward: true, ..TextLook::new(style.font_px, Anchor::Middle) };
        svg.text(EDGE_PX + style.font_px, self.map.y + self.map.height / 2.0, "y (m)", &look);
    }

    /// Draws a bar of round length, about a fifth of the map's longer side but less than half the
    /// picture's width. Returns the room it takes, in pixels.
    fn draw_scale_bar(&self, svg: &mut Svg, area: &Area<'_>, style: &Style, top: f64) -> f64 {
        let meters_per_px = area.box_size_m / self.px;
        let wanted_px = (0.2 * self.map.width.max(self.map.height)).min(0.18 * self.width);
        let length_m = nice_step(wanted_px * meters_per_px, 1);
        let length_px = length_m / meters_per_px;
        if !length_px.is_finite() {
            return 0.0;
        }
        let words = format!("{} m", label(length_m, decimals(length_m)));
        let look = TextLook::new(style.small_px(), Anchor::Middle);
        let text_px = text::width(&words, look.size_px, Weight::Regular);
        let bar = Rect {
            x: self.map.x + ((text_px - length_px) / 2.0).max(0.0),
            y: top,
            width: length_px,
            height: 4.0,
        };
        svg.rect(bar, format_args!(r#"class="scale-bar" fill="{INK}""#));
        svg.text(bar.x + length_px / 2.0, top + 8.0 + look.size_px, &words, &look);
        text_px.max(length_px)
    }
}

/// The legend: only what the picture has.
pub(super) fn entries(scene: &GridScene) -> Vec<Entry> {
    let swatch = |fill, rim| Symbol::Swatch { fill, rim, opacity: 1.0 };
    let is_mobile = |shade: BodyShade| shade == BodyShade::Active;
    let kinds = [
        (scene.cells.contains(&CellShade::Wall), swatch(WALL, "none"), "wall"),
        (scene.cells.contains(&CellShade::Unknown), swatch(UNKNOWN, "#CCCCCC"), "unknown"),
        (scene.doors.iter().any(|d| !d.open), swatch(ACTIVE, ACTIVE_RIM), "door, closed"),
        (scene.doors.iter().any(|d| d.open), swatch("#FFFFFF", ACTIVE_RIM), "door, open"),
        (
            scene.bodies.iter().any(|b| is_mobile(b.shade)),
            swatch(ACTIVE, ACTIVE_RIM),
            "mobile object",
        ),
        (!scene.tracks.is_empty(), Symbol::Ring, "start"),
        (!scene.tracks.is_empty(), Symbol::Disc, "end"),
    ];
    let shown = kinds.into_iter().filter(|(present, ..)| *present);
    let mut entries: Vec<Entry> =
        shown.map(|(_, symbol, label)| Entry::new(symbol, label)).collect();
    entries.extend(track_entries(scene));
    entries
}

fn track_entries(scene: &GridScene) -> Vec<Entry> {
    let ribbon = |index: usize, highlighted: bool| {
        let fill = series_color(index);
        Symbol::Swatch { fill, rim: "none", opacity: if highlighted { 0.75 } else { 0.4 } }
    };
    let named = scene.tracks.iter().enumerate().take(MOST_TRACKS_NAMED);
    let mut entries: Vec<Entry> =
        named.map(|(i, track)| Entry::new(ribbon(i, track.highlighted), &track.label)).collect();
    if scene.tracks.len() > MOST_TRACKS_NAMED {
        let more = format!("and {} more tracks", scene.tracks.len() - MOST_TRACKS_NAMED);
        entries.push(Entry::new(ribbon(MOST_TRACKS_NAMED, false), more));
    }
    entries
}
