//! Generated traffic: the super-conflict, random crossings, converging streams, and terminal areas.

mod terminal;

use super::flight::{
    AircraftModel, AirplaneStart, ChangeAlternatives, Performance, Point, Pose2, distance_m,
};
use super::purpose;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sidestep_kernel::stream::{Draws, Streams};
use sidestep_kernel::{interrupt, math};
use std::collections::BTreeMap;
use std::f64::consts::TAU;
pub(super) use terminal::TerminalParams;

/// Largest number of draws, per airplane, for a start far enough from all others.
const MAX_TRIES: usize = 2_000;

/// Kinds of generated traffic.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum GeneratorKind {
    /// Airplanes on a circle, each bound for the opposite point.
    Superconflict,
    /// Flights from anywhere to anywhere in a disc.
    Random,
    /// Three streams that meet.
    Streams,
    /// Departures from a runway, arrivals to the same field, and overflights, all of which change their level.
    Terminal,
}

/// The traffic to generate, with the settings that only its kind has.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum TrafficKind {
    Superconflict,
    Random,
    Streams,
    Terminal(TerminalParams),
}

/// Parameters of the traffic to generate.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct GeneratorParams<'a> {
    pub(super) kind: TrafficKind,
    pub(super) n: usize,
    pub(super) radius_m: f64,
    pub(super) jitter_m: f64,
    pub(super) model: &'a AircraftModel,
    pub(super) performance: &'a Performance,
    pub(super) changes: &'a ChangeAlternatives,
    /// Further meters between the starts of random traffic, for errors that the shield allows for.
    pub(super) errors_m: f64,
}

/// Returns the airplanes, or, as an error, how many found a start before there was none left.
pub(super) fn generate(
    params: &GeneratorParams<'_>,
    streams: &Streams,
) -> Result<Vec<AirplaneStart>, usize> {
    match &params.kind {
        TrafficKind::Superconflict => Ok(superconflict(params, streams)),
        TrafficKind::Random => random_traffic(params, streams),
        TrafficKind::Streams => Ok(converging_streams(params, streams)),
        TrafficKind::Terminal(terminal) => terminal::terminal_traffic(params, terminal, streams),
    }
}

fn airplane(params: &GeneratorParams<'_>, from: Point, to: Vec<Point>) -> AirplaneStart {
    let first = to.first().copied().unwrap_or(from);
    let heading_rad = math::atan2(first[1] - from[1], first[0] - from[0]);
    AirplaneStart {
        callsign: None,
        model: params.model.clone(),
        performance: params.performance.clone(),
        start: Pose2 { at: from, heading_rad },
        mission: to,
        detours: Vec::new(),
        altitude_m: 0.0,
        appears_s: 0.0,
        leaves_s: f64::INFINITY,
        orders: Vec::new(),
        track: None,
        is_non_cooperative: false,
        priority: 0,
        changes: params.changes.clone(),
        commanded_speeds_m_s: None,
    }
}

fn on_circle(radius_m: f64, angle_rad: f64) -> Point {
    [radius_m * math::cos(angle_rad), radius_m * math::sin(angle_rad)]
}

fn airplane_draws(streams: &Streams, id: usize) -> Draws {
    streams.draws(id as u32, 0, purpose::PLACE)
}

/// Returns airplanes evenly spread on a circle, each flying to the opposite point. The seed turns
/// the circle, and moves each airplane along it by up to the jitter.
fn superconflict(params: &GeneratorParams<'_>, streams: &Streams) -> Vec<AirplaneStart> {
    let rotation_rad = TAU * airplane_draws(streams, params.n).uniform();
    let mut airplanes = Vec::with_capacity(params.n);
    for k in 0..params.n {
        let jitter_m = params.jitter_m * (2.0 * airplane_draws(streams, k).uniform() - 1.0);
        let angle_rad =
            rotation_rad + TAU * k as f64 / params.n as f64 + jitter_m / params.radius_m;
        let start = on_circle(params.radius_m, angle_rad);
        let goal = on_circle(params.radius_m, angle_rad + TAU / 2.0);
        airplanes.push(airplane(params, start, vec![goal]));
    }
    airplanes
}

/// Returns airplanes anywhere in a disc, each flying to a point of the disc at least half its
/// radius away. Starts are so far apart that first fallbacks are, too: an orbit's diameter each,
/// and the separation.
fn random_traffic(
    params: &GeneratorParams<'_>,
    streams: &Streams,
) -> Result<Vec<AirplaneStart>, usize> {
    let gap_m =
        4.0 * params.model.turn_radius_m() + params.model.separation_m + params.errors_m + 1.0;
    let mut starts = SpacedPointGrid { gap_m, by_square: BTreeMap::new() };
    let mut airplanes = Vec::new();
    for id in 0..params.n {
        let mut draws = airplane_draws(streams, id);
        let start = (0..MAX_TRIES)
            .map(|_| random_point_in_disc(params.radius_m, &mut draws))
            .find(|at| starts.has_room_at(*at));
        let start = start.ok_or(id)?;
        let goal = (0..MAX_TRIES)
            .map(|_| random_point_in_disc(params.radius_m, &mut draws))
            .find(|goal| distance_m(start, *goal) >= 0.5 * params.radius_m);
        starts.add(start);
        // Many draws are far enough, so the point opposite hardly ever has to do.
        airplanes.push(airplane(params, start, vec![goal.unwrap_or([-start[0], -start[1]])]));
    }
    Ok(airplanes)
}

/// Points that are apart from each other, by squares as wide as the gap, so that a point has to be compared only with
/// those in the squares around it.
struct SpacedPointGrid {
    gap_m: f64,
    by_square: BTreeMap<[i64; 2], Vec<Point>>,
}

impl SpacedPointGrid {
    fn grid_square(&self, at: Point) -> [i64; 2] {
        at.map(|v| (v / self.gap_m).floor() as i64)
    }

    fn has_room_at(&self, at: Point) -> bool {
        let [x, y] = self.grid_square(at);
        let rows = (x - 1..=x + 1).map(|x| self.by_square.range([x, y - 1]..=[x, y + 1]));
        let mut near = rows.flatten().flat_map(|(_, points)| points);
        near.all(|other| {
            interrupt::check();
            distance_m(at, *other) >= self.gap_m
        })
    }

    fn add(&mut self, at: Point) {
        self.by_square.entry(self.grid_square(at)).or_default().push(at);
    }
}

fn random_point_in_disc(radius_m: f64, draws: &mut Draws) -> Point {
    // The root makes all places of the disc equally likely.
    let r = radius_m * draws.uniform().sqrt();
    on_circle(r, TAU * draws.uniform())
}

/// Returns three streams that meet at the center and continue together. Airplanes of a stream
/// follow each other at four separations; the first of each stream reach the center at the same
/// time, and so do the second, and so on.
fn converging_streams(params: &GeneratorParams<'_>, streams: &Streams) -> Vec<AirplaneStart> {
    let spacing_m = 4.0 * params.model.separation_m;
    let mut airplanes = Vec::with_capacity(params.n);
    for k in 0..params.n {
        let stream = k % 3;
        let place = (k / 3) as f64;
        let jitter_m = params.jitter_m * (2.0 * airplane_draws(streams, k).uniform() - 1.0);
        let behind_m = place * spacing_m + jitter_m;
        let angle_rad = TAU / 2.0 + (stream as f64 - 1.0) * TAU / 12.0;
        let start = on_circle(params.radius_m + behind_m, angle_rad);
        airplanes.push(airplane(params, start, vec![[0.0, 0.0], [params.radius_m, 0.0]]));
    }
    airplanes
}
