//! The lines behind a plan: latitudes and longitudes where a scene is on earth, else round distances east and north.

use crate::picture::canvas::{Canvas, Px};
use crate::svg::Rect;
use crate::ticks::Ticks;
use sidestep_kernel::view::{EarthChart, Scenery};

use super::units::Units;

/// Steps of latitudes and longitudes in arc seconds.
const STEPS_ARC_S: [f64; 22] = [
    1.0, 2.0, 5.0, 10.0, 15.0, 30.0, 60.0, 120.0, 300.0, 600.0, 900.0, 1200.0, 1800.0, 3600.0,
    7200.0, 18_000.0, 36_000.0, 54_000.0, 72_000.0, 108_000.0, 162_000.0, 324_000.0,
];
/// Points of a line, which is straight on few charts.
const POINTS: u32 = 17;
/// Halvings of an interval in which a line crosses a column or row: they find it to a millionth of the plan.
const BISECTIONS: u32 = 20;
/// Least distance of two lines on the picture, in sizes of letters.
const MIN_SPACING_LETTERS: f64 = 8.0;

/// The direction of a coordinate on the plan.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum GraticuleAxis {
    /// Its lines go up the picture; labels are below.
    East,
    /// Its lines go across the picture; labels are at the left.
    North,
}

/// A line of equal latitude, longitude or distance.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct GraticuleLine {
    pub(super) axis: GraticuleAxis,
    /// Its label, without the unit of distances.
    pub(super) label: String,
    /// Its points, from the lower or left edge on.
    pub(super) points: Vec<Px>,
}

/// The lines of a plan, and the names of its axes.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Graticule {
    pub(super) lines: Vec<GraticuleLine>,
    /// The names of the axes; none where the labels say it.
    pub(super) names: Option<[String; 2]>,
}

/// The part of the world that a plan shows.
#[derive(Debug, Clone, Copy)]
pub(super) struct PlanWindow {
    pub(super) canvas: Canvas,
    pub(super) map: Rect,
}

impl PlanWindow {
    fn width_m(&self) -> f64 {
        self.map.width / self.canvas.px_per_m
    }

    fn height_m(&self) -> f64 {
        self.map.height / self.canvas.px_per_m
    }

    /// Returns the place at fractions of the width and the height.
    fn place(&self, across: f64, upward: f64) -> [f64; 2] {
        let [x_m, y_m] = self.canvas.origin_m;
        [x_m + across * self.width_m(), y_m + upward * self.height_m()]
    }

    fn px(&self, across: f64, upward: f64) -> Px {
        (self.map.x + across * self.map.width, self.map.bottom() - upward * self.map.height)
    }
}

impl Graticule {
    pub(super) fn new(scenery: &Scenery, window: &PlanWindow, letter_px: f64) -> Self {
        let spacing_px = MIN_SPACING_LETTERS * letter_px;
        match &scenery.earth.chart {
            Some(chart) => Self { lines: earth_lines(chart, window, spacing_px), names: None },
            None => plane_lines(scenery, window, spacing_px),
        }
    }
}

fn plane_lines(scenery: &Scenery, window: &PlanWindow, spacing_px: f64) -> Graticule {
    let extent_m = window.width_m().max(window.height_m());
    let (unit, unit_m) = Units::of_scenery(scenery).distance(extent_m);
    let [x_m, y_m] = window.canvas.origin_m;
    let mut lines = Vec::new();
    for (axis, low_m, length_m, length_px) in [
        (GraticuleAxis::East, x_m, window.width_m(), window.map.width),
        (GraticuleAxis::North, y_m, window.height_m(), window.map.height),
    ] {
        let most = ((length_px / spacing_px) as usize).clamp(1, 12);
        let ticks = Ticks::linear(low_m / unit_m, (low_m + length_m) / unit_m, most);
        for (value, label) in ticks.major {
            let part = (value * unit_m - low_m) / length_m;
            let points = match axis {
                GraticuleAxis::East => vec![window.px(part, 0.0), window.px(part, 1.0)],
                GraticuleAxis::North => vec![window.px(0.0, part), window.px(1.0, part)],
            };
            lines.push(GraticuleLine { axis, label, points });
        }
    }
    let names = ["east", "north"].map(|direction| format!("{direction} ({unit})"));
    Graticule { lines, names: Some(names) }
}

fn earth_lines(chart: &EarthChart, window: &PlanWindow, spacing_px: f64) -> Vec<GraticuleLine> {
    let mut lines = Vec::new();
    for axis in [GraticuleAxis::East, GraticuleAxis::North] {
        let coordinate = EarthCoordinate { chart, window, axis };
        let [low_deg, high_deg] = coordinate.range_deg();
        let length_px = match axis {
            GraticuleAxis::East => window.map.width,
            GraticuleAxis::North => window.map.height,
        };
        let most = (length_px / spacing_px).max(1.0);
        let step_arc_s = earth_step_arc_s((high_deg - low_deg) * 3600.0 / most);
        let first = (low_deg * 3600.0 / step_arc_s).ceil() as i64;
        let last = (high_deg * 3600.0 / step_arc_s).floor() as i64;
        for k in first..=last {
            let value_deg = k as f64 * step_arc_s / 3600.0;
            let points = coordinate.line(value_deg);
            if points.len() > 1 {
                let label = angle_label(value_deg, step_arc_s, axis);
                lines.push(GraticuleLine { axis, label, points });
            }
        }
    }
    lines
}

/// Returns the smallest step of round angles that is not below a given one.
fn earth_step_arc_s(min_arc_s: f64) -> f64 {
    let enough = STEPS_ARC_S.into_iter().find(|step| *step >= min_arc_s);
    enough.unwrap_or(STEPS_ARC_S[STEPS_ARC_S.len() - 1])
}

/// Latitude or longitude over a window.
struct EarthCoordinate<'a> {
    chart: &'a EarthChart,
    window: &'a PlanWindow,
    axis: GraticuleAxis,
}

impl EarthCoordinate<'_> {
    /// Returns the coordinate at fractions of the width and the height. Longitudes go on beyond 180 degrees, so that
    /// they grow across the picture.
    fn at_deg(&self, across: f64, upward: f64) -> f64 {
        let [lat_deg, lon_deg] = self.chart.lat_lon_deg(self.window.place(across, upward));
        match self.axis {
            GraticuleAxis::North => lat_deg,
            GraticuleAxis::East => {
                let origin_deg = self.chart.origin_deg[1];
                origin_deg + (lon_deg - origin_deg + 540.0).rem_euclid(360.0) - 180.0
            }
        }
    }

    /// Returns the coordinate `along` its own direction, in the column or row `beside`.
    fn in_row_deg(&self, along: f64, beside: f64) -> f64 {
        match self.axis {
            GraticuleAxis::East => self.at_deg(along, beside),
            GraticuleAxis::North => self.at_deg(beside, along),
        }
    }

    /// Returns the lowest and the highest value at the edges.
    fn range_deg(&self) -> [f64; 2] {
        let mut range = [f64::INFINITY, f64::NEG_INFINITY];
        for k in 0..POINTS {
            let beside = f64::from(k) / f64::from(POINTS - 1);
            for along in [0.0, 1.0] {
                let value_deg = self.in_row_deg(along, beside);
                range = [range[0].min(value_deg), range[1].max(value_deg)];
            }
        }
        range
    }

    /// Returns the points of the window with a value, one in each row or column that has it.
    fn line(&self, value_deg: f64) -> Vec<Px> {
        let mut points = Vec::new();
        for k in 0..POINTS {
            let beside = f64::from(k) / f64::from(POINTS - 1);
            let Some(along) = self.crossing(value_deg, beside) else { continue };
            points.push(match self.axis {
                GraticuleAxis::East => self.window.px(along, beside),
                GraticuleAxis::North => self.window.px(beside, along),
            });
        }
        points
    }

    /// Returns where in a row or column the coordinate has a value.
    fn crossing(&self, value_deg: f64, beside: f64) -> Option<f64> {
        let mut low = 0.0;
        let mut high = 1.0;
        let is_inside =
            self.in_row_deg(low, beside) <= value_deg && value_deg <= self.in_row_deg(high, beside);
        if !is_inside {
            return None;
        }
        for _ in 0..BISECTIONS {
            let middle = 0.5 * (low + high);
            if self.in_row_deg(middle, beside) < value_deg {
                low = middle;
            } else {
                high = middle;
            }
        }
        Some(0.5 * (low + high))
    }
}

/// Returns a latitude or longitude with the digits that multiples of a step need.
pub(super) fn angle_label(value_deg: f64, step_arc_s: f64, axis: GraticuleAxis) -> String {
    let wrapped_deg = match axis {
        GraticuleAxis::East => (value_deg + 180.0).rem_euclid(360.0) - 180.0,
        GraticuleAxis::North => value_deg,
    };
    let arc_s = (wrapped_deg.abs() * 3600.0).round() as u64;
    let is_negative = wrapped_deg < 0.0 && arc_s > 0;
    // On the date line, neither east nor west is right.
    let has_side = arc_s > 0 && arc_s < 180 * 3600;
    let side = match axis {
        _ if !has_side => "",
        GraticuleAxis::East if is_negative => "W",
        GraticuleAxis::East => "E",
        GraticuleAxis::North if is_negative => "S",
        GraticuleAxis::North => "N",
    };
    let degrees = arc_s / 3600;
    let minutes = arc_s / 60 % 60;
    let seconds = arc_s % 60;
    if step_arc_s >= 3600.0 {
        format!("{degrees}\u{b0}{side}")
    } else if step_arc_s >= 60.0 {
        format!("{degrees}\u{b0}{minutes:02}\u{2032}{side}")
    } else {
        format!("{degrees}\u{b0}{minutes:02}\u{2032}{seconds:02}\u{2033}{side}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_have_their_side_and_the_digits_of_their_step() {
        let east = |deg: f64, step| angle_label(deg, step, GraticuleAxis::East);
        assert_eq!(
            [east(4.5, 1800.0), east(-0.5, 1800.0)],
            ["4\u{b0}30\u{2032}E", "0\u{b0}30\u{2032}W"]
        );
        assert_eq!([east(0.0, 3600.0), east(190.0, 3600.0)], ["0\u{b0}", "170\u{b0}W"]);
        let south = angle_label(-33.004_166_666, 15.0, GraticuleAxis::North);
        assert_eq!(south, "33\u{b0}00\u{2032}15\u{2033}S");
    }

    #[test]
    fn steps_are_round_in_degrees_minutes_or_seconds() {
        assert_eq!([3.0, 61.0, 1900.0, 1e9].map(earth_step_arc_s), [5.0, 120.0, 3600.0, 324_000.0]);
    }
}
