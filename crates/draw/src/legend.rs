//! Markers, and the legend: symbols with labels, in rows as wide as the picture.

use std::borrow::Cow;

use crate::chart::error_bar;
use crate::style::{FAINT_INK, INK};
use crate::svg::{Anchor, Rect, Svg, SvgNumber, TextStyle};
use crate::text::{self, Weight};
use sidestep_kernel::math::hypot;

/// The shape that distinguishes a series besides its color.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Marker {
    Circle,
    Square,
    Triangle,
    Diamond,
    Cross,
}

impl Marker {
    /// Returns the marker of the series with this number. Five shapes and seven colors are coprime,
    /// so 35 series differ.
    pub(crate) fn of_series(index: usize) -> Self {
        let all = [Self::Circle, Self::Square, Self::Triangle, Self::Diamond, Self::Cross];
        all[index % all.len()]
    }

    /// Draws the marker around `(x, y)`, `radius` pixels large.
    pub(crate) fn draw(self, svg: &mut Svg, (x, y): (f64, f64), radius: f64, color: &str) {
        let rim = format!(r##"fill="{color}" stroke="#FFFFFF" stroke-width="0.8""##);
        match self {
            Self::Circle => svg.circle((x, y), radius, rim),
            Self::Square => svg.path(
                &polygon((x, y), radius, &[(-0.9, -0.9), (0.9, -0.9), (0.9, 0.9), (-0.9, 0.9)]),
                rim,
            ),
            Self::Triangle => {
                svg.path(&polygon((x, y), radius, &[(0.0, -1.2), (1.1, 0.8), (-1.1, 0.8)]), rim)
            }
            Self::Diamond => svg.path(
                &polygon((x, y), radius, &[(0.0, -1.3), (1.2, 0.0), (0.0, 1.3), (-1.2, 0.0)]),
                rim,
            ),
            Self::Cross => svg.path(&polygon((x, y), radius, &CROSS), rim),
        }
    }
}

/// Returns the path of a polygon around a point, whose corners are given for a radius of 1.
fn polygon((x, y): (f64, f64), radius: f64, corners: &[(f64, f64)]) -> String {
    let places = corners
        .iter()
        .map(|(dx, dy)| format!("{} {}", SvgNumber(x + dx * radius), SvgNumber(y + dy * radius)));
    format!("M{}Z", places.collect::<Vec<_>>().join("L"))
}

/// An upright cross with bars 0.8 radii wide.
const CROSS: [(f64, f64); 12] = [
    (-0.4, -1.2),
    (0.4, -1.2),
    (0.4, -0.4),
    (1.2, -0.4),
    (1.2, 0.4),
    (0.4, 0.4),
    (0.4, 1.2),
    (-0.4, 1.2),
    (-0.4, 0.4),
    (-1.2, 0.4),
    (-1.2, -0.4),
    (-0.4, -0.4),
];

/// Draws the mark of a mean, a bar across: it hides no interval, however short that is.
pub(crate) fn mean_mark(svg: &mut Svg, (x, y): (f64, f64), half_px: f64, color: &str) {
    let attributes = format_args!(r#"class="mean" stroke="{color}" stroke-width="2.4""#);
    svg.line((x - half_px, y), (x + half_px, y), attributes);
}

/// A color in SVG notation: borrowed where it is fixed, owned where it follows from a number.
pub(crate) type SvgColor = Cow<'static, str>;

/// The symbol before a legend's label.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum LegendSymbol {
    /// Nothing: words about the entries that follow.
    None,
    /// A piece of a line, perhaps with its marker, and its dashes as an attribute.
    Line { color: SvgColor, marker: Option<Marker>, dash: &'static str },
    /// A mean with the bar of its interval.
    Mean { color: SvgColor },
    /// A marker alone.
    Marker { color: SvgColor, marker: Marker },
    /// The dashes of a reference line.
    Dashes { color: &'static str },
    /// A filled box.
    Swatch { fill: SvgColor, rim: SvgColor, opacity: f64 },
    /// The mark at a track's start.
    Ring,
    /// The mark of a leader.
    Leader,
    /// The mark of a target.
    Target,
}

impl LegendSymbol {
    /// Returns the room that it takes before its label.
    fn room_px(&self, font_px: f64) -> f64 {
        if *self == Self::None { 0.0 } else { 2.8 * font_px }
    }
}

/// A line of a legend; entries without a label are left out.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct LegendEntry {
    pub(crate) symbol: LegendSymbol,
    pub(crate) label: String,
}

impl LegendEntry {
    pub(crate) fn new(symbol: LegendSymbol, label: impl Into<String>) -> Self {
        Self { symbol, label: label.into() }
    }
}

/// A legend laid out for a given width.
#[derive(Debug)]
pub(crate) struct Legend {
    /// Left edge and row of each entry.
    placed: Vec<(f64, usize, LegendEntry)>,
    font_px: f64,
}

impl Legend {
    /// Flows `entries` into rows at most `room_px` wide. Entries without a label are left out.
    pub(crate) fn new(entries: Vec<LegendEntry>, font_px: f64, room_px: f64) -> Self {
        let mut x = 0.0;
        let mut row = 0;
        let mut placed = Vec::new();
        for mut entry in entries.into_iter().filter(|entry| !entry.label.trim().is_empty()) {
            let symbol_px = entry.symbol.room_px(font_px);
            entry.label =
                text::shorten(&entry.label, font_px, Weight::Regular, room_px - symbol_px);
            let width = symbol_px + text::width(&entry.label, font_px, Weight::Regular);
            // Words about the entries that follow begin a row.
            let is_heading = entry.symbol == LegendSymbol::None;
            if x > 0.0 && (is_heading || x + width > room_px) {
                x = 0.0;
                row += 1;
            }
            placed.push((x, row, entry));
            x += width + 1.5 * font_px;
        }
        Self { placed, font_px }
    }

    /// Returns the width of a legend with one entry in each row.
    pub(crate) fn column_px(entries: &[LegendEntry], font_px: f64) -> f64 {
        let width = |entry: &LegendEntry| {
            text::width(&entry.label, font_px, Weight::Regular) + entry.symbol.room_px(font_px)
        };
        entries.iter().map(width).fold(0.0, f64::max)
    }

    fn row_px(&self) -> f64 {
        self.font_px * 1.6
    }

    pub(crate) fn height_px(&self) -> f64 {
        self.placed.last().map_or(0.0, |(_, row, _)| (*row as f64 + 1.0) * self.row_px())
    }

    /// Draws the legend with its upper left corner at `(left, top)`.
    pub(crate) fn draw(&self, svg: &mut Svg, left: f64, top: f64) {
        let text_style = TextStyle::new(self.font_px, Anchor::Start);
        for (x, row, entry) in &self.placed {
            let middle = top + (*row as f64 + 0.5) * self.row_px();
            self.draw_symbol(svg, &entry.symbol, left + x, middle);
            let text_x = match entry.symbol {
                LegendSymbol::None => left + x,
                _ => left + x + 2.4 * self.font_px,
            };
            svg.text(text_x, middle + text_style.middle_px(), &entry.label, &text_style);
        }
    }

    /// Draws `symbol` two letters wide, its left end at `x`.
    fn draw_symbol(&self, svg: &mut Svg, symbol: &LegendSymbol, x: f64, y: f64) {
        let size = self.font_px;
        let center = (x + size, y);
        let end = (x + 2.0 * size, y);
        match symbol {
            LegendSymbol::None => {}
            LegendSymbol::Line { color, marker, dash } => {
                let attributes = format_args!(r#"stroke="{color}" stroke-width="2"{dash}"#);
                svg.line((x, y), end, attributes);
                if let Some(marker) = marker {
                    marker.draw(svg, center, 0.32 * size, color);
                }
            }
            LegendSymbol::Mean { color } => {
                let half_px = 0.62 * size;
                error_bar(svg, center.0, (y - half_px, y + half_px), 0.26 * size, color);
                mean_mark(svg, center, 0.4 * size, color);
            }
            LegendSymbol::Marker { color, marker } => marker.draw(svg, center, 0.32 * size, color),
            LegendSymbol::Dashes { color } => {
                svg.line((x, y), end, reference_line_attributes(color))
            }
            LegendSymbol::Swatch { fill, rim, opacity } => {
                let half = 0.45 * size;
                let swatch = Rect {
                    x: center.0 - 2.0 * half,
                    y: y - half,
                    width: 4.0 * half,
                    height: 2.0 * half,
                };
                svg.rect(
                    swatch,
                    format_args!(r#"fill="{fill}" fill-opacity="{opacity}" stroke="{rim}""#),
                );
            }
            LegendSymbol::Leader => leader_mark(svg, center, 0.36 * size, FAINT_INK),
            LegendSymbol::Target => {
                target_mark(svg, center, [0.3 * size, 0.5 * size], FAINT_INK);
            }
            LegendSymbol::Ring => start_mark(svg, center, 0.36 * size, FAINT_INK),
        }
    }
}

/// Returns the attributes of a reference line, dashed so that no series is taken for it.
pub(crate) fn reference_line_attributes(color: &str) -> String {
    format!(r#"stroke="{color}" stroke-width="1.4" stroke-dasharray="6 4" fill="none""#)
}

/// Draws the mark where a track starts: a ring, filled so that no line shows through.
pub(crate) fn start_mark(svg: &mut Svg, center: (f64, f64), radius: f64, color: &str) {
    svg.circle(
        center,
        radius,
        format_args!(r##"fill="#FFFFFF" stroke="{color}" stroke-width="2""##),
    );
}

/// Draws the mark of a leader: a ring around a dot.
pub(crate) fn leader_mark(svg: &mut Svg, center: (f64, f64), radius: f64, color: &str) {
    start_mark(svg, center, radius, color);
    svg.circle(center, 0.45 * radius, format_args!(r#"class="leader" fill="{color}""#));
}

/// Draws the mark of a target: a ring, and a cross that reaches beyond it.
pub(crate) fn target_mark(
    svg: &mut Svg,
    (x, y): (f64, f64),
    [radius, reach]: [f64; 2],
    color: &str,
) {
    let attributes = format!(r#"stroke="{color}" stroke-width="1.3""#);
    svg.circle((x, y), radius, format_args!(r#"class="target" fill="none" {attributes}"#));
    svg.line((x - reach, y), (x + reach, y), &attributes);
    svg.line((x, y - reach), (x, y + reach), &attributes);
}

/// Draws the head, `head_px` long, of an arrow from one point to another.
pub(crate) fn arrowhead(
    svg: &mut Svg,
    from: (f64, f64),
    (x, y): (f64, f64),
    head_px: f64,
    color: &str,
) {
    let length = hypot(x - from.0, y - from.1);
    let ux = head_px * (x - from.0) / length;
    let uy = head_px * (y - from.1) / length;
    let [(ax, ay), (bx, by)] = [1.0, -1.0].map(|side| {
        let wing_x = x - ux + side * 0.5 * uy;
        let wing_y = y - uy - side * 0.5 * ux;
        (SvgNumber(wing_x), SvgNumber(wing_y))
    });
    let data = format!("M{ax} {ay}L{} {}L{bx} {by}Z", SvgNumber(x), SvgNumber(y));
    let rim = r##"stroke="#FFFFFF" stroke-width="0.6""##;
    svg.path(&data, format_args!(r#"class="direction" fill="{color}" {rim}"#));
}

/// Draws the mark where a track ends: a dot, unlike the ring at its start.
pub(crate) fn end_mark(svg: &mut Svg, center: (f64, f64), radius: f64, color: &str) {
    svg.circle(center, radius + 1.0, format_args!(r##"fill="{color}" stroke="#FFFFFF""##));
}

/// Writes lines of text downward from `top` and returns where they end.
pub(crate) fn paragraph(
    svg: &mut Svg,
    lines: &[String],
    (x, top): (f64, f64),
    text_style: &TextStyle<'_>,
) -> f64 {
    let line_px = text_style.size_px * 1.35;
    for (row, line) in lines.iter().enumerate() {
        svg.text(x, top + row as f64 * line_px + text_style.size_px, line, text_style);
    }
    top + lines.len() as f64 * line_px
}

/// Returns the text style of a picture's title.
pub(crate) fn title_style(size_px: f64) -> TextStyle<'static> {
    TextStyle { weight: Weight::Bold, fill: INK, ..TextStyle::new(size_px, Anchor::Start) }
}

pub(crate) fn small_print_style(size_px: f64) -> TextStyle<'static> {
    TextStyle { fill: FAINT_INK, ..TextStyle::new(size_px, Anchor::Start) }
}
