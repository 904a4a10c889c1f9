//! Generated traffic: the super-conflict, random crossings, and converging streams.

use super::flight::{Airplane, Model, Point, Pose2, distance_m};
use super::purpose;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sidestep_kernel::stream::{Draws, Streams};
use sidestep_kernel::{interrupt, math};
use std::collections::BTreeMap;
use std::f64::consts::TAU;

/// Largest number of draws, per airplane, for a place far enough from all others.
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
}

/// Parameters of the traffic to generate.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct GeneratorParams<'a> {
    pub(super) kind: GeneratorKind,
    pub(super) n: usize,
    pub(super) radius_m: f64,
    pub(super) jitter_m: f64,
    pub(super) model: &'a Model,
    /// Further meters between the starts of random traffic, for errors that the shield allows for.
    pub(super) errors_m: f64,
}

/// Returns the airplanes, or, as an error, how many found a place before there was none left.
pub(super) fn generate(
    order: &GeneratorParams<'_>,
    streams: &Streams,
) -> Result<Vec<Airplane>, usize> {
    match order.kind {
        GeneratorKind::Superconflict => Ok(superconflict(order, streams)),
        GeneratorKind::Random => random(order, streams),
        GeneratorKind::Streams => Ok(converging(order, streams)),
    }
}

fn airplane(order: &GeneratorParams<'_>, from: Point, to: Vec<Point>) -> Airplane {
    let first = to.first().copied().unwrap_or(from);
    let heading_rad = math::atan2(first[1] - from[1], first[0] - from[0]);
    Airplane {
        callsign: None,
        model: order.model.clone(),
        start: Pose2 { at: from, heading_rad },
        mission: to,
        altitude_m: 0.0,
        appears_s: 0.0,
        leaves_s: f64::INFINITY,
        orders: Vec::new(),
        track: None,
        is_intruder: false,
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
fn superconflict(order: &GeneratorParams<'_>, streams: &Streams) -> Vec<Airplane> {
    let turned = TAU * airplane_draws(streams, order.n).uniform();
    let place = |k: usize| {
        let jitter = order.jitter_m * (2.0 * airplane_draws(streams, k).uniform() - 1.0);
        turned + TAU * k as f64 / order.n as f64 + jitter / order.radius_m
    };
    (0..order.n)
        .map(|k| {
            let (from, to) = (place(k), place(k) + TAU / 2.0);
            airplane(order, on_circle(order.radius_m, from), vec![on_circle(order.radius_m, to)])
        })
        .collect()
}

/// Returns airplanes anywhere in a disc, each flying to a point of the disc at least half its
/// radius away. Starts are so far apart that first fallbacks are, too: an orbit's diameter each,
/// and the separation.
fn random(order: &GeneratorParams<'_>, streams: &Streams) -> Result<Vec<Airplane>, usize> {
    let gap_m = 4.0 * order.model.turn_radius_m() + order.model.separation_m + order.errors_m + 1.0;
    // Starts by squares as wide as the gap, so that only those around a place are compared with it.
    let mut starts: BTreeMap<[i64; 2], Vec<Point>> = BTreeMap::new();
    let square = |at: Point| at.map(|v| (v / gap_m).floor() as i64);
    let mut all = Vec::new();
    for id in 0..order.n {
        let mut draws = airplane_draws(streams, id);
        let free = |at: &Point| {
            let [x, y] = square(*at);
            let rows = (x - 1..=x + 1).map(|x| starts.range([x, y - 1]..=[x, y + 1]));
            let mut near = rows.flatten().flat_map(|(_, starts)| starts);
            near.all(|other| {
                interrupt::check();
                distance_m(*at, *other) >= gap_m
            })
        };
        let from = (0..MAX_TRIES).map(|_| in_disc(order.radius_m, &mut draws)).find(free);
        let from = from.ok_or(id)?;
        let far = |to: &Point| distance_m(from, *to) >= 0.5 * order.radius_m;
        let to = (0..MAX_TRIES).map(|_| in_disc(order.radius_m, &mut draws)).find(far);
        starts.entry(square(from)).or_default().push(from);
        all.push(airplane(order, from, vec![to.unwrap_or([-from[0], -from[1]])]));
    }
    Ok(all)
}

fn in_disc(radius_m: f64, draws: &mut Draws) -> Point {
    let r = radius_m * draws.uniform().sqrt();
    on_circle(r, TAU * draws.uniform())
}

/// Returns three streams that meet at the center and continue together. Airplanes of a stream
/// follow each other at four separations; the first of each stream reach the center at the same
/// time, and so do the second, and so on.
fn converging(order: &GeneratorParams<'_>, streams: &Streams) -> Vec<Airplane> {
    let spacing_m = 4.0 * order.model.separation_m;
    (0..order.n)
        .map(|k| {
            let (stream, place) = (k % 3, (k / 3) as f64);
            let jitter = order.jitter_m * (2.0 * airplane_draws(streams, k).uniform() - 1.0);
            let behind_m = place * spacing_m + jitter;
            let angle = TAU / 2.0 + (stream as f64 - 1.0) * TAU / 12.0;
            let from = on_circle(order.radius_m + behind_m, angle);
            airplane(order, from, vec![[0.0, 0.0], [order.radius_m, 0.0]])
        })
        .collect()
}
