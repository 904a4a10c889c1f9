//! Lines and points over numeric axes.

use crate::axis::{Axis, FittedAxis, Scale};
use crate::chart::frame::{ChartFrame, FrameText, XAxis, max_ticks, polyline};
use crate::chart::{DrawnChart, error_bar, level_error_bar};
use crate::error::DrawError;
use crate::legend::{
    LegendEntry, LegendSymbol, Marker, arrowhead, reference_line_attributes, start_mark,
};
use crate::style::{FAINT_INK, SeriesLook, Style, series_color};
use crate::svg::{Rect, Svg};
use sidestep_kernel::math::hypot;

/// Distance below which two points of a line cannot be distinguished, pixels.
const MIN_POINT_DISTANCE_PX: f64 = 0.5;
/// Straight pieces of an ideal line, which is a curve if one axis is logarithmic.
const IDEAL_LINE_SEGMENTS: u32 = 64;
/// Opacity of bands: two of them over each other are still told apart.
const BAND_OPACITY: f64 = 0.2;
/// Radius of a marker as a multiple of the size of text: intervals of some percent are still longer.
const MARKER_FRACTION: f64 = 0.27;
/// Longest series with a marker at each point; longer ones show only their line.
const MAX_MARKERS: usize = 60;

/// A measured value, optionally with its interval.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point {
    /// Position along the horizontal axis. A point that is not a number interrupts its line.
    pub x: f64,
    /// Position along the vertical axis; one that is not a number interrupts the line.
    pub y: f64,
    /// Lower and upper end of the error bar, in units of the vertical axis.
    pub interval: Option<(f64, f64)>,
    /// Left and right end of the error bar along the horizontal axis.
    pub x_interval: Option<(f64, f64)>,
}

impl Point {
    /// Returns a value without an error bar.
    pub fn new(x: f64, y: f64) -> Self {
        Self { x, y, interval: None, x_interval: None }
    }

    /// Adds an error bar from `low` to `high`, e.g. a 95 % confidence interval.
    #[must_use]
    pub fn with_interval(mut self, low: f64, high: f64) -> Self {
        self.interval = Some((low, high));
        self
    }
}

/// The form in which the points of a series are drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mark {
    /// A line, with markers if the points are few.
    Line,
    /// A line alone, within a band of the intervals.
    Band,
    /// A path in the plane: a line alone, with a ring where it starts and an arrowhead where it ends.
    Path,
    /// Markers only.
    Points,
    /// Steps: level up to the next point, as a share of runs is; the first one rises from the low end of the axis,
    /// and the last level goes on to its right end.
    Steps,
}

/// Points that belong together.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// Label in the legend; an empty label has no place there.
    pub label: String,
    /// The points, in the order in which the line runs.
    pub points: Vec<Point>,
    /// Line or points.
    pub mark: Mark,
    /// Color, marker and dashes; without them they follow from the series' number.
    pub look: Option<SeriesLook>,
}

impl Series {
    /// Returns points joined by a line in their order, with markers if they are few.
    pub fn line(label: impl Into<String>, points: Vec<Point>) -> Self {
        Self { label: label.into(), points, mark: Mark::Line, look: None }
    }

    /// Returns points joined by a line, their intervals as a band around it.
    pub fn band(label: impl Into<String>, points: Vec<Point>) -> Self {
        Self { mark: Mark::Band, ..Self::line(label, points) }
    }

    /// Returns points with markers alone.
    pub fn points(label: impl Into<String>, points: Vec<Point>) -> Self {
        Self { mark: Mark::Points, ..Self::line(label, points) }
    }

    fn shows_markers(&self) -> bool {
        match self.mark {
            Mark::Points => true,
            Mark::Line => self.points.len() <= MAX_MARKERS,
            Mark::Band | Mark::Path | Mark::Steps => false,
        }
    }
}

/// A part of a legend that explains one thing of looks: the levels of a factor, say.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct LegendGroup {
    /// The words before it, such as the name of the factor.
    pub heading: String,
    /// The looks that it explains, each with its label.
    pub entries: Vec<(LegendLook, String)>,
}

/// What an entry of a group shows of the looks of series.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LegendLook {
    /// Number of a color; gray without one.
    pub color: Option<usize>,
    /// Number of a marker; none, or a filled box where there are no lines, without one.
    pub marker: Option<usize>,
    /// Number of dashes; 0 is a whole line.
    pub dash: usize,
}

/// A straight line in data coordinates, such as the ideal speed-up.
#[derive(Debug, Clone, PartialEq)]
struct IdealLine {
    label: String,
    intercept: f64,
    slope: f64,
}

/// A chart of one or more [`Series`] over numeric axes.
///
/// Points that an axis cannot hold (NaN, or zero on a logarithmic one) are left out; without any
/// points the picture is an empty pair of axes.
#[derive(Debug, Clone, PartialEq)]
pub struct Plot {
    title: String,
    note: String,
    x: Axis,
    y: Axis,
    series: Vec<Series>,
    legend_groups: Vec<LegendGroup>,
    interval_label: String,
    ideals: Vec<IdealLine>,
    references: Vec<ReferencePath>,
}

/// Straight pieces through points in data coordinates, such as the front of what can be had of two quantities.
#[derive(Debug, Clone, PartialEq)]
struct ReferencePath {
    label: String,
    points: Vec<(f64, f64)>,
}

impl Plot {
    /// Returns an empty plot with linear axes `x` and `y`. An empty title takes no space.
    pub fn new(title: impl Into<String>) -> Self {
        Self {
            title: title.into(),
            note: String::new(),
            x: Axis::linear("x"),
            y: Axis::linear("y"),
            series: vec![],
            legend_groups: Vec::new(),
            interval_label: String::new(),
            ideals: vec![],
            references: vec![],
        }
    }

    /// Sets the horizontal axis.
    #[must_use]
    pub fn x_axis(mut self, axis: Axis) -> Self {
        self.x = axis;
        self
    }

    /// Sets the vertical axis.
    #[must_use]
    pub fn y_axis(mut self, axis: Axis) -> Self {
        self.y = axis;
        self
    }

    /// Adds a series.
    #[must_use]
    pub fn series(mut self, series: Series) -> Self {
        self.series.push(series);
        self
    }

    /// Explains colors and patterns one by one, in place of a list of all series.
    #[must_use]
    pub fn legend_groups(mut self, groups: Vec<LegendGroup>) -> Self {
        self.legend_groups = groups;
        self
    }

    /// Sets what the legend says of the intervals; empty words have no place there.
    #[must_use]
    pub fn interval_label(mut self, label: impl Into<String>) -> Self {
        self.interval_label = label.into();
        self
    }

    fn look(&self, index: usize) -> SeriesLook {
        self.series[index].look.unwrap_or_else(|| SeriesLook::of_series(index))
    }

    /// Adds the dashed line `y = intercept + slope * x` behind the data: slope 1 for the ideal
    /// speed-up, intercept 1 and slope 0 for the ideal efficiency. It does not widen the axes.
    #[must_use]
    pub fn ideal_line(mut self, label: impl Into<String>, intercept: f64, slope: f64) -> Self {
        self.ideals.push(IdealLine { label: label.into(), intercept, slope });
        self
    }

    /// Adds a dashed line through `points` behind the data. It does not widen the axes.
    #[must_use]
    pub fn reference_path(mut self, label: impl Into<String>, points: Vec<(f64, f64)>) -> Self {
        self.references.push(ReferencePath { label: label.into(), points });
        self
    }

    /// Sets the small print under the plot, e.g. the meaning of the error bars.
    #[must_use]
    pub fn note(mut self, note: impl Into<String>) -> Self {
        self.note = note.into();
        self
    }

    /// Draws the plot.
    ///
    /// # Errors
    /// [`DrawError::Value`] if the style or an axis's given range is impossible.
    pub fn to_svg(&self, style: &Style) -> Result<String, DrawError> {
        self.draw(style).map(|chart| chart.svg)
    }

    /// Draws the plot, and returns where its marks are.
    ///
    /// # Errors
    /// As [`Self::to_svg`].
    pub fn draw(&self, style: &Style) -> Result<DrawnChart, DrawError> {
        style.check()?;
        let (most_across, most_up) = max_ticks(style);
        let has_markers = self.series.iter().any(Series::shows_markers);
        let fit = |axis: &Axis, values: Vec<f64>, most: usize| {
            let values = values.into_iter();
            if has_markers { axis.fit_marks(values, most) } else { axis.fit(values, most) }
        };
        let x = fit(&self.x, self.drawable().flat_map(x_values).collect(), most_across)?;
        let y = fit(&self.y, self.drawable().flat_map(y_values).collect(), most_up)?;
        let words = FrameText {
            title: &self.title,
            note: &self.note,
            x_label: self.x.label(),
            y_label: self.y.label(),
            legend: self.legend(),
            ..FrameText::default()
        };
        let across = XAxis::Values(x.clone());
        let mut frame = ChartFrame::open(style, words, &across, &y);
        frame.open_data();
        let x_scale = frame.x_scale(&x);
        for ideal in &self.ideals {
            draw_ideal_line(&mut frame, ideal, &x, x_scale, &self.y);
        }
        for reference in &self.references {
            let y = frame.y;
            let places = reference.points.iter().map(|point| (x_scale.px(point.0), y.px(point.1)));
            let data = polyline(places);
            frame.svg.path(&data, reference_line_attributes(FAINT_INK));
        }
        for index in 0..self.series.len() {
            self.draw_lines(&mut frame, x_scale, index, style);
        }
        // Bars over all lines, and markers over all bars: no marker of another series hides a line's end.
        for index in 0..self.series.len() {
            self.draw_intervals(&mut frame, x_scale, index, style);
        }
        for index in 0..self.series.len() {
            self.draw_markers(&mut frame, x_scale, index, style);
        }
        frame.svg.close_group();
        Ok(frame.finish())
    }

    fn contains(&self, point: &Point) -> bool {
        self.x.contains(point.x) && self.y.contains(point.y)
    }

    fn drawable(&self) -> impl Iterator<Item = &Point> {
        self.series.iter().flat_map(|s| &s.points).filter(|p| self.contains(p))
    }

    /// Returns one entry per series, or those of the groups, and one per ideal line.
    fn legend(&self) -> Vec<LegendEntry> {
        let groups = self.legend_groups.iter().flat_map(|group| self.group_entries(group));
        let listed = if self.legend_groups.is_empty() { &self.series[..] } else { &[] };
        let series = listed.iter().enumerate().map(|(index, series)| {
            let look = self.look(index);
            let color = series_color(look.color).into();
            let marker = Marker::of_series(look.marker);
            let symbol = match series.mark {
                Mark::Points => LegendSymbol::Marker { color, marker },
                Mark::Line | Mark::Band | Mark::Path | Mark::Steps => {
                    let marker = series.shows_markers().then_some(marker);
                    LegendSymbol::Line { color, marker, dash: look.dash_attribute() }
                }
            };
            LegendEntry::new(symbol, &series.label)
        });
        let ideals = self.ideals.iter().map(|line| &line.label);
        let references = self.references.iter().map(|line| &line.label);
        let dashes = ideals
            .chain(references)
            .map(|label| LegendEntry::new(LegendSymbol::Dashes { color: FAINT_INK }, label));
        let are_bands = self.series.iter().any(|series| series.mark == Mark::Band);
        let intervals = if are_bands {
            let fill = FAINT_INK.into();
            LegendSymbol::Swatch { fill, rim: "none".into(), opacity: BAND_OPACITY }
        } else {
            LegendSymbol::Mean { color: FAINT_INK.into() }
        };
        let intervals = LegendEntry::new(intervals, &self.interval_label);
        groups.chain(series).chain(dashes).chain([intervals]).collect()
    }

    /// Returns the heading of a group and its entries.
    fn group_entries(&self, group: &LegendGroup) -> Vec<LegendEntry> {
        let has_markers = self.series.iter().any(Series::shows_markers);
        let has_lines = self.series.iter().any(|series| series.mark != Mark::Points);
        let mut entries = vec![LegendEntry::new(LegendSymbol::None, &group.heading)];
        for (look, label) in &group.entries {
            let color = look.color.map_or_else(|| FAINT_INK.to_string(), series_color);
            let marker = look.marker.map(Marker::of_series).filter(|_| has_markers);
            let symbol = match (has_lines, marker) {
                (false, Some(marker)) => LegendSymbol::Marker { color: color.into(), marker },
                (true, marker) => {
                    let own = SeriesLook { dash: look.dash, ..SeriesLook::of_series(0) };
                    LegendSymbol::Line { color: color.into(), marker, dash: own.dash_attribute() }
                }
                (false, None) => {
                    LegendSymbol::Swatch { fill: color.into(), rim: "none".into(), opacity: 1.0 }
                }
            };
            entries.push(LegendEntry::new(symbol, label));
        }
        entries
    }

    fn draw_lines(&self, frame: &mut ChartFrame, x: Scale, index: usize, style: &Style) {
        let series = &self.series[index];
        if series.mark == Mark::Band {
            self.draw_band(frame, x, &series_color(self.look(index).color), series);
        }
        if series.mark != Mark::Points {
            self.draw_line(frame, x, index, style);
        }
    }

    /// Draws the intervals of a series as bars.
    fn draw_intervals(&self, frame: &mut ChartFrame, x: Scale, index: usize, style: &Style) {
        let series = &self.series[index];
        let color = &series_color(self.look(index).color);
        let y = frame.y;
        let cap_px = 0.3 * style.font_px;
        for point in series.points.iter().filter(|point| self.contains(point)) {
            let at = (x.px(point.x), y.px(point.y));
            if let Some((low, high)) =
                point.x_interval.filter(|(l, h)| l.is_finite() && h.is_finite())
            {
                level_error_bar(&mut frame.svg, at.1, (x.px(low), x.px(high)), cap_px, color);
            }
            if let Some((low, high)) = bounds(point).filter(|_| series.mark != Mark::Band) {
                error_bar(&mut frame.svg, at.0, (y.px(low), y.px(high)), cap_px, color);
            }
        }
    }

    fn draw_markers(&self, frame: &mut ChartFrame, x: Scale, index: usize, style: &Style) {
        let series = &self.series[index];
        let look = self.look(index);
        let color = &series_color(look.color);
        let marker = Marker::of_series(look.marker);
        for (number, point) in series.points.iter().enumerate() {
            if !self.contains(point) {
                continue;
            }
            let at = (x.px(point.x), frame.y.px(point.y));
            frame.push_spot(at, index, number);
            if series.shows_markers() {
                marker.draw(&mut frame.svg, at, MARKER_FRACTION * style.font_px, color);
            }
        }
    }

    /// Draws the line of a series, interrupted at points that have no place on the axes.
    fn draw_line(&self, frame: &mut ChartFrame, x: Scale, index: usize, style: &Style) {
        let series = &self.series[index];
        let look = self.look(index);
        let color = &series_color(look.color);
        let dash = look.dash_attribute();
        let y = frame.y;
        for run in
            series.points.split(|p| !self.contains(p)).filter(|run| has_line(series.mark, run))
        {
            let places: Vec<Px> = run.iter().map(|p| (x.px(p.x), y.px(p.y))).collect();
            let data = if series.mark == Mark::Steps {
                polyline(steps(&places, frame.area).into_iter())
            } else {
                polyline(decimate(places.iter().copied()))
            };
            // Steps of several series lie side by side.
            let width_px = if series.mark == Mark::Steps { 1.6 } else { 2.0 };
            let attributes =
                format!(r#"fill="none" stroke-width="{width_px}" stroke-linejoin="round""#);
            frame.svg.path(&data, format_args!(r#"stroke="{color}" {attributes}{dash}"#));
            if series.mark == Mark::Path {
                draw_ends(&mut frame.svg, &places, color, 0.7 * style.font_px);
            }
        }
    }

    /// Fills the area between the ends of the intervals, over each run of points that have them.
    fn draw_band(&self, frame: &mut ChartFrame, x: Scale, color: &str, series: &Series) {
        let y = frame.y;
        let runs = series.points.split(|p| !self.contains(p) || bounds(p).is_none());
        for run in runs.filter(|run| run.len() > 1) {
            let upper = run.iter().map(|p| (x.px(p.x), y.px(ends(p).1)));
            let lower = run.iter().rev().map(|p| (x.px(p.x), y.px(ends(p).0)));
            let data = polyline(upper.chain(lower)) + "Z";
            frame.svg.path(&data, format_args!(r#"fill="{color}" fill-opacity="{BAND_OPACITY}""#));
        }
    }
}

/// Returns whether a run of points has a line: one point alone has none, but a step.
fn has_line(mark: Mark, run: &[Point]) -> bool {
    run.len() > 1 || (mark == Mark::Steps && !run.is_empty())
}

/// Returns the corners of steps through points, from the lower edge of an area to its right edge.
fn steps(places: &[Px], area: Rect) -> Vec<Px> {
    let mut corners = Vec::with_capacity(2 * places.len() + 1);
    let mut level = area.bottom();
    for (x, y) in places {
        corners.push((*x, level));
        corners.push((*x, *y));
        level = *y;
    }
    corners.push((area.right(), level));
    corners
}

/// Returns the horizontal values that a point covers.
fn x_values(point: &Point) -> impl Iterator<Item = f64> {
    let (low, high) = point.x_interval.unwrap_or((point.x, point.x));
    [low, point.x, high].into_iter()
}

/// Returns a point's interval, if it can be drawn.
fn bounds(point: &Point) -> Option<(f64, f64)> {
    point.interval.filter(|(low, high)| low.is_finite() && high.is_finite())
}

/// Returns the ends of a point's interval; without one both are its value.
fn ends(point: &Point) -> (f64, f64) {
    bounds(point).unwrap_or((point.y, point.y))
}

/// Returns the vertical values that a point covers.
fn y_values(point: &Point) -> impl Iterator<Item = f64> {
    let (low, high) = point.interval.unwrap_or((point.y, point.y));
    [low, point.y, high].into_iter()
}

/// Leaves out points less than half a pixel from the last one kept, because they would not be
/// visible. The last point always stays.
fn decimate(points: impl Iterator<Item = (f64, f64)>) -> impl Iterator<Item = (f64, f64)> {
    let mut points = points.peekable();
    let mut kept: Option<(f64, f64)> = None;
    std::iter::from_fn(move || {
        loop {
            let point = points.next()?;
            let is_apart = kept.is_none_or(|last| {
                (point.0 - last.0).abs().max((point.1 - last.1).abs()) >= MIN_POINT_DISTANCE_PX
            });
            if is_apart || points.peek().is_none() {
                kept = Some(point);
                return kept;
            }
        }
    })
}

fn draw_ideal_line(
    frame: &mut ChartFrame,
    ideal: &IdealLine,
    x: &FittedAxis,
    x_scale: Scale,
    y_axis: &Axis,
) {
    let y_scale = frame.y;
    let places = (0..=IDEAL_LINE_SEGMENTS).map(|k| f64::from(k) / f64::from(IDEAL_LINE_SEGMENTS));
    let points = places
        .map(|part| x.value_at(part))
        .map(|x| (x, ideal.intercept + ideal.slope * x))
        .filter(|(_, y)| y_axis.contains(*y))
        .map(|(x, y)| (x_scale.px(x), y_scale.px(y)));
    let data = polyline(points);
    if !data.is_empty() {
        frame.svg.path(&data, reference_line_attributes(FAINT_INK));
    }
}
/// A point in pixels, y downward.
type Px = (f64, f64);

/// Marks where a path starts, and where and in which direction it ends.
fn draw_ends(svg: &mut Svg, places: &[Px], color: &str, head_px: f64) {
    let [start, .., end] = places else { return };
    start_mark(svg, *start, 0.4 * head_px, color);
    let mut backward = places.iter().rev();
    // Two points at one place have no direction.
    if let Some(before) = backward.find(|p| hypot(p.0 - end.0, p.1 - end.1) > MIN_POINT_DISTANCE_PX)
    {
        arrowhead(svg, *before, *end, head_px, color);
    }
}
