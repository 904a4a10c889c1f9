//! The page of a plan: title, plan, profile, axes, legend, and small print.

use super::aircraft::{aircraft, is_in_conflict, lookahead_s};
use super::areas::{self, AREA_COLOR, DrawnArea};
use super::data_blocks::BlockCount;
use super::graticule::{Graticule, GraticuleAxis, PlanWindow};
use super::profile::{ProfileWindow, altitude_range_m};
use super::routes::shown_routes;
use super::units::Units;
use super::{Plan, Scene};
use crate::error::DrawError;
use crate::legend::{Legend, LegendEntry, LegendSymbol, paragraph, small_print_style, title_style};
use crate::picture::canvas::Canvas;
use crate::picture::sheet::{COLUMN_GAP_PX, EDGE_PX, LegendPlace};
use crate::picture::{DrawnPicture, PictureOptions, extent};
use crate::style::{FAINT_INK, GRID, INK, Style, hex};
use crate::svg::{Anchor, Rect, Svg, SvgNumber, TextStyle};
use crate::text::{self, Weight};
use crate::ticks::{LabelSpacing, decimals, label, nice_step};
use sidestep_kernel::view::{ALERT_COLOR, BodyRole, Shape, TrafficPlan};
use std::fmt::Write as _;

/// Height of a profile as a fraction of the plan's, and its limits.
const PROFILE_FRACTION: f64 = 0.24;
pub(super) const PROFILE_HEIGHT_PX: [f64; 2] = [80.0, 190.0];
/// Space between plan and profile, in sizes of letters.
const GAP_LETTERS: f64 = 2.4;
/// Length of a tick outside of the plan.
const TICK_PX: f64 = 4.0;
/// Least width of a picture, in letters, to make room for title and legend.
const MIN_WIDTH_LETTERS: f64 = 34.0;
/// Color of symbols in the legend that stand for all colors.
const ANY_COLOR: &str = "#707070";

/// Draws traffic in plan view, with its legend somewhere.
pub(in crate::picture) fn draw(
    scene: &Scene<'_>,
    traffic: &TrafficPlan,
    options: &PictureOptions,
    place: LegendPlace,
) -> Result<DrawnPicture, DrawError> {
    let style = &options.style;
    let [low_m, high_m] = extent::scene_bounds(scene)?;
    let areas = areas::areas(scene, traffic);
    let range_m = altitude_range_m(scene, &areas);
    let layout = SheetLayout::new(
        scene,
        style,
        [low_m[0], low_m[1]],
        [high_m[0], high_m[1]],
        range_m.is_some(),
    );
    // What the legend says depends on the scale alone, and how wide the page is on what it says.
    let window = layout.window([low_m[0], low_m[1]], 0.0);
    let mut plan = Plan {
        scene,
        traffic,
        units: Units::of_scenery(scene.scenery),
        window,
        style,
        lookahead_s: lookahead_s(scene.frame, Plan::extent_m(&window)),
        name_x_px: EDGE_PX + style.font_px,
    };
    let entries = plan.legend_entries(&areas);
    let width_px = layout.page_width_px(place, &entries);
    let mut svg = Svg::default();
    let text_width_px = width_px - 2.0 * EDGE_PX;
    let title = text::wrap(&options.title, style.title_px(), Weight::Bold, text_width_px);
    let top = paragraph(&mut svg, &title, (EDGE_PX, EDGE_PX), &title_style(style.title_px()));
    plan.window = layout.window([low_m[0], low_m[1]], top);
    let top = plan.window.map.bottom();
    let mut sheet = PlanSheet { plan: &plan, areas: &areas, svg, top };
    let blocks = sheet.draw_plan();
    let mut notes = plan.notes(blocks);
    if let Some(range_m) = range_m {
        let profile = sheet.draw_profile(range_m, layout.profile_height_px);
        let times = nice_ratio(profile.exaggeration());
        notes.push(format!(
            "Below, altitudes seen from the south, drawn {times} times as long as distances."
        ));
    }
    let words = format!("{} {}", options.caption, notes.join(" "));
    match place {
        LegendPlace::Below => {
            sheet.draw_legend_below(entries, width_px);
            sheet.draw_words(&words, EDGE_PX, width_px);
        }
        LegendPlace::Beside => sheet.draw_column(entries, &words, width_px),
    }
    let svg = sheet.svg.finish(width_px, sheet.top + EDGE_PX, &options.title);
    Ok(DrawnPicture { svg, px_per_m: layout.px_per_m })
}

/// Returns a ratio with two digits.
fn nice_ratio(ratio: f64) -> String {
    let step = nice_step(ratio, 20);
    label((ratio / step).round() * step, decimals(step))
}

/// Sizes that follow from the extent of what is shown.
struct SheetLayout {
    /// Size of small letters,
    size_px: f64,
    /// and the least width of the page.
    min_width_px: f64,
    left_px: f64,
    map_width_px: f64,
    map_height_px: f64,
    profile_height_px: f64,
    px_per_m: f64,
}

impl SheetLayout {
    fn new(
        scene: &Scene<'_>,
        style: &Style,
        low_m: [f64; 2],
        high_m: [f64; 2],
        has_profile: bool,
    ) -> Self {
        let size_m = [high_m[0] - low_m[0], high_m[1] - low_m[1]];
        let (part, gap_px) =
            if has_profile { (PROFILE_FRACTION, GAP_LETTERS * style.font_px) } else { (0.0, 0.0) };
        let map_room_px = ((style.height_px - gap_px) / (1.0 + part)).max(10.0);
        let px_per_m = (style.width_px / size_m[0]).min(map_room_px / size_m[1]);
        let map_width_px = size_m[0] * px_per_m;
        let map_height_px = size_m[1] * px_per_m;
        // Labels depend on the window alone, not on where it stands.
        let map = Rect { x: 0.0, y: 0.0, width: map_width_px, height: map_height_px };
        let window = PlanWindow { canvas: Canvas::above(low_m, px_per_m, map), map };
        let size_px = style.small_px();
        let graticule = Graticule::new(scene.scenery, &window, size_px);
        let labels = graticule.lines.iter().filter(|line| line.axis == GraticuleAxis::North);
        let label_px = labels.map(|line| text::width(&line.label, size_px, Weight::Regular));
        let altitude_px = text::width("10 000", size_px, Weight::Regular);
        let label_px = label_px.fold(altitude_px, f64::max);
        let left_px = (EDGE_PX + 1.5 * style.font_px + label_px + TICK_PX + 4.0).ceil();
        let min_width_px = MIN_WIDTH_LETTERS * style.font_px;
        let [least_px, most_px] = PROFILE_HEIGHT_PX;
        let profile_height_px = (part * map_height_px).clamp(least_px, most_px);
        Self {
            size_px,
            min_width_px,
            left_px,
            map_width_px,
            map_height_px,
            profile_height_px,
            px_per_m,
        }
    }

    /// Returns the width of the page with a legend.
    fn page_width_px(&self, place: LegendPlace, entries: &[LegendEntry]) -> f64 {
        let column_px = match place {
            LegendPlace::Below => 0.0,
            LegendPlace::Beside => COLUMN_GAP_PX + Legend::column_px(entries, self.size_px),
        };
        let own_px = self.left_px + self.map_width_px + column_px + 2.0 * EDGE_PX + self.size_px;
        own_px.max(self.min_width_px)
    }

    /// Returns the window of the plan below `top`.
    fn window(&self, low_m: [f64; 2], top: f64) -> PlanWindow {
        let map = Rect {
            x: self.left_px,
            y: (top + 8.0).ceil(),
            width: self.map_width_px,
            height: self.map_height_px,
        };
        PlanWindow { canvas: Canvas::above(low_m, self.px_per_m, map), map }
    }
}

impl Plan<'_> {
    /// Returns what the small print says of the plan.
    fn notes(&self, blocks: BlockCount) -> Vec<String> {
        let mut notes = Vec::new();
        if blocks.drawn > 0 {
            notes.push(format!("North is up; {}.", self.units.block_meaning()));
        } else {
            notes.push("North is up.".to_string());
        }
        if blocks.left_out > 0 {
            let all = blocks.drawn + blocks.left_out;
            notes.push(format!("{} of {all} data blocks have no space.", blocks.left_out));
        }
        notes
    }

    fn legend_entries(&self, areas: &[DrawnArea<'_>]) -> Vec<LegendEntry> {
        let mut entries = Vec::new();
        let line = |dash| LegendSymbol::Line { color: ANY_COLOR.into(), marker: None, dash };
        if let Some(lookahead_s) = self.lookahead_s {
            let time = if lookahead_s >= 120.0 {
                format!("{} min", label(lookahead_s / 60.0, 0))
            } else {
                format!("{} s", label(lookahead_s, 0))
            };
            entries.push(LegendEntry::new(line(""), format!("velocity: where it is in {time}")));
        }
        entries.extend(self.zone_entries());
        if areas.iter().any(|area| !area.levels.is_fence) {
            let fill = LegendSymbol::Swatch {
                fill: AREA_COLOR.into(),
                rim: AREA_COLOR.into(),
                opacity: 0.25,
            };
            entries.push(LegendEntry::new(fill, "area to stay out of"));
        }
        if areas.iter().any(|area| area.levels.is_fence) {
            let dashes = LegendSymbol::Dashes { color: AREA_COLOR };
            entries.push(LegendEntry::new(dashes, "area to stay inside of"));
        }
        if !shown_routes(self).is_empty() {
            let dashes = LegendSymbol::Dashes { color: ANY_COLOR };
            entries.push(LegendEntry::new(dashes, "route with way-points"));
        }
        if !self.scene.trails.is_empty() {
            entries.push(LegendEntry::new(LegendSymbol::Ring, "beginning of a track"));
        }
        entries
    }

    /// Returns the entries of zones, with the separation that they stand for if it is the same for all.
    fn zone_entries(&self) -> Vec<LegendEntry> {
        let mut radii_m: Vec<f64> = Vec::new();
        for body in &self.scene.frame.bodies {
            let is_zone = matches!(body.kind.role(), BodyRole::AroundAgent(_));
            if let Shape::Cylinder { radius_m, .. } = body.shape
                && is_zone
            {
                radii_m.push(radius_m);
            }
        }
        let Some(&first_m) = radii_m.first() else { return Vec::new() };
        let mut words = "zone: separation lost where two meet".to_string();
        if radii_m.iter().all(|radius_m| *radius_m == first_m) {
            let (unit, unit_m) = self.units.distance(2.0 * first_m);
            let separation = 2.0 * first_m / unit_m;
            let digits = decimals(nice_step(separation, 20)).min(2);
            let _ = write!(words, " (at {} {unit})", label(separation, digits));
        }
        let rim = LegendSymbol::Swatch { fill: "none".into(), rim: ANY_COLOR.into(), opacity: 1.0 };
        let mut entries = vec![LegendEntry::new(rim, words)];
        if aircraft(self.scene.frame).any(is_in_conflict) {
            let alert = hex(ALERT_COLOR);
            let fill = LegendSymbol::Swatch {
                fill: alert.clone().into(),
                rim: alert.into(),
                opacity: 0.25,
            };
            entries.push(LegendEntry::new(fill, "separation lost"));
        }
        entries
    }
}

/// A page that is drawn from the top down.
struct PlanSheet<'a> {
    plan: &'a Plan<'a>,
    areas: &'a [DrawnArea<'a>],
    svg: Svg,
    /// Where the next part begins.
    top: f64,
}

impl PlanSheet<'_> {
    fn draw_plan(&mut self) -> BlockCount {
        let map = self.plan.window.map;
        let style = self.plan.style;
        let graticule =
            Graticule::new(self.plan.scene.scenery, &self.plan.window, style.small_px());
        draw_lines(&mut self.svg, &graticule, map);
        self.plan.draw_content(&mut self.svg, self.areas);
        self.draw_labels(&graticule);
        let arrow = draw_north_arrow(&mut self.svg, map, style);
        let blocks = self.plan.draw_words(&mut self.svg, self.areas, vec![arrow]);
        self.svg.rect(map, format_args!(r#"class="plan" fill="none" stroke="{INK}""#));
        blocks
    }

    /// Writes the labels of the graticule below and to the left of the plan.
    fn draw_labels(&mut self, graticule: &Graticule) {
        let map = self.plan.window.map;
        let style = self.plan.style;
        let size_px = style.small_px();
        let below = TextStyle::new(size_px, Anchor::Middle);
        let beside = TextStyle::new(size_px, Anchor::End);
        let baseline = map.bottom() + TICK_PX + 2.0 + size_px;
        let mut across = LabelSpacing::new();
        let mut upward = LabelSpacing::new();
        for line in &graticule.lines {
            let Some(&(x, y)) = line.points.first() else { continue };
            let width = text::width(&line.label, size_px, Weight::Regular) + size_px;
            match line.axis {
                // A line that begins at another edge has no label there.
                GraticuleAxis::East if y > map.bottom() - 1.0 && across.try_place(x, width) => {
                    let end = (x, map.bottom() + TICK_PX);
                    self.svg.line((x, map.bottom()), end, format_args!(r#"stroke="{INK}""#));
                    self.svg.text(x, baseline, &line.label, &below);
                }
                GraticuleAxis::North if x < map.x + 1.0 && upward.try_place(-y, size_px) => {
                    let end = (map.x - TICK_PX, y);
                    self.svg.line((map.x, y), end, format_args!(r#"stroke="{INK}""#));
                    self.svg.text(end.0 - 3.0, y + beside.middle_px(), &line.label, &beside);
                }
                _ => {}
            }
        }
        self.top = baseline + 0.4 * size_px;
        let Some([east, north]) = &graticule.names else { return };
        let name_style = TextStyle::new(style.font_px, Anchor::Middle);
        self.top += 1.2 * style.font_px;
        self.svg.text(map.x + 0.5 * map.width, self.top, east, &name_style);
        self.top += 0.4 * style.font_px;
        let upward_style = TextStyle { upward: true, ..name_style };
        let middle = map.y + 0.5 * map.height;
        self.svg.text(self.plan.name_x_px, middle, north, &upward_style);
    }

    fn draw_profile(&mut self, range_m: [f64; 2], height_px: f64) -> ProfileWindow {
        let map = self.plan.window.map;
        let gap_px = 0.5 * GAP_LETTERS * self.plan.style.font_px;
        let area = Rect { y: (self.top + gap_px).ceil(), height: height_px.round(), ..map };
        let profile = ProfileWindow::new(area, range_m, &self.plan.window.canvas);
        profile.draw_axis(&mut self.svg, self.plan);
        self.svg.open_clip(area);
        profile.draw_content(&mut self.svg, self.plan, self.areas);
        self.svg.close_group();
        profile.draw_frame(&mut self.svg);
        self.top = area.bottom() + 4.0;
        profile
    }

    /// Draws the scale bar, and the legend in rows beside it.
    fn draw_legend_below(&mut self, entries: Vec<LegendEntry>, width_px: f64) {
        let plan = self.plan;
        let top = self.top + 12.0;
        let bar_px = draw_scale_bar(&mut self.svg, plan, (plan.window.map.x, top), width_px);
        let size_px = plan.style.small_px();
        let beside = plan.window.map.x + bar_px + 2.0 * plan.style.font_px;
        let widths =
            entries.iter().map(|entry| text::width(&entry.label, size_px, Weight::Regular));
        // With its symbol.
        let longest_px = widths.fold(0.0, f64::max) + 4.0 * size_px;
        // In a narrow picture the words go below the bar, or they would be cut.
        let (left, legend_top) = if beside + longest_px <= width_px - EDGE_PX {
            (beside, top - 4.0)
        } else {
            (EDGE_PX, top + 2.6 * size_px)
        };
        let legend = Legend::new(entries, size_px, width_px - left - EDGE_PX);
        legend.draw(&mut self.svg, left, legend_top);
        let bottom = (legend_top + 4.0 + legend.height_px()).max(top + 2.4 * size_px);
        self.top = bottom + 6.0;
    }

    /// Draws legend, scale bar and small print in a column on the right of the plan, which then has the height for itself.
    fn draw_column(&mut self, entries: Vec<LegendEntry>, words: &str, width_px: f64) {
        let map = self.plan.window.map;
        let size_px = self.plan.style.small_px();
        let left = map.right() + COLUMN_GAP_PX;
        let plan_bottom = self.top;
        let legend = Legend::new(entries, size_px, width_px - left - EDGE_PX);
        legend.draw(&mut self.svg, left, map.y);
        let bar_top = map.y + legend.height_px() + size_px;
        draw_scale_bar(&mut self.svg, self.plan, (left, bar_top), width_px);
        self.top = bar_top + 3.6 * size_px;
        self.draw_words(words, left, width_px);
        self.top = self.top.max(plan_bottom);
    }

    /// Writes the small print from `left` on.
    fn draw_words(&mut self, words: &str, left: f64, width_px: f64) {
        let size_px = self.plan.style.small_px();
        let lines = text::wrap(words, size_px, Weight::Regular, width_px - left - EDGE_PX);
        let style = small_print_style(size_px);
        self.top = paragraph(&mut self.svg, &lines, (left, self.top), &style);
    }
}

/// Draws the lines of a graticule, clipped to the plan.
pub(super) fn draw_lines(svg: &mut Svg, graticule: &Graticule, map: Rect) {
    svg.open_clip(map);
    for line in &graticule.lines {
        let mut data = String::new();
        for (k, &(x, y)) in line.points.iter().enumerate() {
            let command = if k == 0 { 'M' } else { 'L' };
            // Writing into a String cannot fail.
            let _ = write!(data, "{command}{} {}", SvgNumber(x), SvgNumber(y));
        }
        svg.path(&data, format_args!(r#"class="graticule" fill="none" stroke="{GRID}""#));
    }
    svg.close_group();
}

/// Draws an arrow that points north in the upper right corner; returns its place.
pub(super) fn draw_north_arrow(svg: &mut Svg, map: Rect, style: &Style) -> Rect {
    let size_px = style.small_px();
    let height = 2.9 * size_px;
    let width = 1.4 * size_px;
    let rect = Rect { x: map.right() - width - 5.0, y: map.y + 5.0, width, height };
    let x = rect.x + 0.5 * width;
    let foot = rect.y + 1.5 * size_px;
    let half = 0.42 * size_px;
    let [left, right] = [x - half, x + half].map(SvgNumber);
    let data = format!(
        "M{} {}L{right} {}L{} {}L{left} {}Z",
        SvgNumber(x),
        SvgNumber(rect.y),
        SvgNumber(foot),
        SvgNumber(x),
        SvgNumber(foot - 0.4 * size_px),
        SvgNumber(foot),
    );
    svg.path(&data, format_args!(r#"class="north" fill="{FAINT_INK}""#));
    let text_style =
        TextStyle { fill: FAINT_INK, halo: true, ..TextStyle::new(size_px, Anchor::Middle) };
    svg.text(x, rect.y + 2.6 * size_px, "N", &text_style);
    rect
}

/// Draws a bar of round length with its length in words; returns its width.
fn draw_scale_bar(svg: &mut Svg, plan: &Plan<'_>, (x, top): (f64, f64), width_px: f64) -> f64 {
    let map = plan.window.map;
    let (unit, unit_m) = plan.units.distance(Plan::extent_m(&plan.window));
    let px_per_unit = plan.window.canvas.px_per_m * unit_m;
    let wanted_px = (0.2 * map.width.max(map.height)).min(0.18 * width_px);
    let length = nice_step(wanted_px / px_per_unit, 1);
    let length_px = length * px_per_unit;
    let words = format!("{} {unit}", label(length, decimals(length)));
    let text_style = TextStyle::new(plan.style.small_px(), Anchor::Middle);
    let text_px = text::width(&words, text_style.size_px, Weight::Regular);
    let left = x + (0.5 * (text_px - length_px)).max(0.0);
    let bar = Rect { x: left, y: top, width: length_px, height: 4.0 };
    svg.rect(bar, format_args!(r#"class="scale-bar" fill="{INK}""#));
    let middle = left + 0.5 * length_px;
    svg.text(middle, top + 8.0 + text_style.size_px, &words, &text_style);
    text_px.max(length_px)
}
