//! Balls around agents in space: those that are near, and those that hide an agent.
//!
//! A room full of balls shows nothing of a snake in it. So only balls near an agent are drawn, and of these the ones
//! between it and the eye let it show through.

use super::canvas::{Camera, Canvas, Px};
use sidestep_kernel::geometry::{distance, nearest_on_segment};
use sidestep_kernel::math::hypot;
use sidestep_kernel::view::{Body, BodyKind, Frame, Scenery, Shape, Vec3};

/// Most balls of which all are drawn, wherever they are.
const MAX_ALL: usize = 60;
/// Largest gap between an agent and a ball that is near, in mean radii of the balls.
const NEAR_RADII: f64 = 2.0;
/// Distance in pixels from the edge of a ball at which it hides an agent.
const HIDES_PX: f64 = 2.0;

/// A ball.
#[derive(Debug, Clone, Copy)]
struct Ball<'a> {
    body: &'a Body,
    radius_m: f64,
}

/// The balls of a moment in space, as far as they are drawn.
#[derive(Debug, Default)]
pub(super) struct Surroundings<'a> {
    /// Everything that is drawn, also what is no ball.
    visible: Vec<&'a Body>,
    /// The balls among these.
    balls: Vec<&'a Body>,
    /// Number of balls in all.
    count: usize,
    /// The largest gap of a ball that is drawn; none if all are.
    near_m: Option<f64>,
}

impl<'a> Surroundings<'a> {
    pub(super) fn new(scenery: &'a Scenery, frame: &'a Frame) -> Self {
        let bodies = scenery.bodies.iter().chain(&frame.bodies);
        let radii_m: Vec<f64> = bodies.clone().filter_map(ball).map(|ball| ball.radius_m).collect();
        let segments = agent_segments(frame);
        let count = radii_m.len();
        if count <= MAX_ALL || segments.is_empty() {
            let balls = bodies.clone().filter(|body| ball(body).is_some()).collect();
            return Self { visible: bodies.collect(), balls, count, near_m: None };
        }
        let near_m = NEAR_RADII * radii_m.iter().sum::<f64>() / count as f64;
        let [lo, hi] = bounds(&segments);
        let is_near = |Ball { body, radius_m }: Ball<'_>| {
            let at = body.pose.at_m;
            let reach_m = radius_m + near_m;
            // Most balls are far from all agents, which a look at the box around these shows.
            let may_be_near = (0..3).all(|k| (lo[k] - reach_m..=hi[k] + reach_m).contains(&at[k]));
            may_be_near && segments.iter().any(|ends| gap_m(at, ends) <= reach_m)
        };
        let visible: Vec<&Body> = bodies.filter(|body| ball(body).is_none_or(is_near)).collect();
        let balls = visible.iter().copied().filter(|body| ball(body).is_some()).collect();
        Self { visible, balls, count, near_m: Some(near_m) }
    }

    /// Returns everything that is drawn.
    pub(super) fn visible(&self) -> &[&'a Body] {
        &self.visible
    }

    /// Returns the balls that are drawn.
    pub(super) fn balls(&self) -> &[&'a Body] {
        &self.balls
    }

    /// Returns the largest gap of a ball that is drawn in meters, their number and that of all; none if all are drawn.
    pub(super) fn cut(&self) -> Option<(f64, usize, usize)> {
        self.near_m.map(|near_m| (near_m, self.balls.len(), self.count))
    }
}

/// Returns a body as a ball, if it is an obstacle of which there may be thousands.
fn ball(body: &Body) -> Option<Ball<'_>> {
    match body.shape {
        Shape::Sphere { radius_m } if body.kind == BodyKind::OBSTACLE => {
            Some(Ball { body, radius_m })
        }
        _ => None,
    }
}

/// Returns the agents of a moment as segments: those of lines, and bodies as points.
pub(super) fn agent_segments(frame: &Frame) -> Vec<[Vec3; 2]> {
    let mut segments = Vec::new();
    for body in frame.bodies.iter().filter(|body| body.kind.is_of_agent()) {
        match &body.shape {
            Shape::Line { points_m, .. } => {
                segments.extend(points_m.windows(2).map(|pair| [pair[0], pair[1]]));
            }
            _ => segments.push([body.pose.at_m; 2]),
        }
    }
    segments
}

fn bounds(segments: &[[Vec3; 2]]) -> [Vec3; 2] {
    let mut lo = [f64::INFINITY; 3];
    let mut hi = [f64::NEG_INFINITY; 3];
    for at in segments.iter().flatten() {
        for k in 0..3 {
            lo[k] = lo[k].min(at[k]);
            hi[k] = hi[k].max(at[k]);
        }
    }
    [lo, hi]
}

/// Returns the distance of a point from a segment.
fn gap_m(at: Vec3, [a, b]: &[Vec3; 2]) -> f64 {
    if a == b { distance(at, *a) } else { distance(at, nearest_on_segment(at, *a, *b)) }
}

/// The agents of a moment as they are seen, to find what hides them.
pub(super) struct AgentProjections {
    /// Where their points are seen, and how near to the eye.
    points: Vec<(Px, f64)>,
}

impl AgentProjections {
    pub(super) fn new(frame: &Frame, canvas: &Canvas) -> Self {
        let segments = agent_segments(frame);
        let seen = |at: Vec3| (canvas.px(at), canvas.camera.depth_m(at));
        let middle = |[a, b]: &[Vec3; 2]| std::array::from_fn(|k| 0.5 * (a[k] + b[k]));
        // The ends of segments are those of their neighbors, too.
        let points = segments.iter().flat_map(|ends| [seen(ends[0]), seen(middle(ends))]).collect();
        Self { points }
    }

    /// Returns whether a ball is between an agent and the eye.
    pub(super) fn are_behind(&self, body: &Body, canvas: &Canvas) -> bool {
        let Some(Ball { radius_m, .. }) = ball(body) else { return false };
        let (x, y) = canvas.px(body.pose.at_m);
        let depth_m = canvas.camera.depth_m(body.pose.at_m);
        let reach_px = radius_m * canvas.px_per_m + HIDES_PX;
        let mut points = self.points.iter();
        points.any(|&((a, b), at_m)| at_m < depth_m && hypot(a - x, b - y) < reach_px)
    }
}

/// Steps in degrees between the directions from which the one that shows most is chosen.
const TURN_DEG: f64 = 45.0;
/// Elevation of these directions: low enough to see heights, and high enough to see the floor.
const ELEVATIONS_DEG: [f64; 2] = [36.87, 22.0];
/// Part of what a hidden point of an agent counts.
const HIDDEN: f64 = 0.4;
/// How much more another direction than the usual one has to show.
const GAIN: f64 = 1.1;
/// Most points of agents, and most balls, by which directions are compared.
const MAX_COMPARED: usize = 300;

/// Returns the camera that shows most of the agents of some frames: as far apart as possible, and hidden by few balls.
pub(crate) fn best_camera(frames: &[&Frame], balls: &[&Body]) -> Camera {
    let usual = Camera::CORNER;
    let all: Vec<Vec3> = frames.iter().flat_map(|frame| agent_segments(frame)).flatten().collect();
    let step = all.len().div_ceil(MAX_COMPARED).max(1);
    let points: Vec<Vec3> = all.into_iter().step_by(step).collect();
    let balls = &balls[..balls.len().min(MAX_COMPARED)];
    let mut best = usual;
    let mut most = GAIN * visibility(usual, &points, balls);
    for elevation_deg in ELEVATIONS_DEG {
        for turn in 0..(360.0 / TURN_DEG) as u32 {
            // The first one is the usual direction about the vertical.
            let azimuth_deg = -53.13 + f64::from(turn) * TURN_DEG;
            let camera = Camera::from_angles(azimuth_deg.to_radians(), elevation_deg.to_radians());
            let shown = visibility(camera, &points, balls);
            if shown > most {
                most = shown;
                best = camera;
            }
        }
    }
    best
}

/// Returns the area over which points are spread, less where balls hide them.
fn visibility(camera: Camera, points: &[Vec3], balls: &[&Body]) -> f64 {
    let seen: Vec<[f64; 2]> = points.iter().map(|&at| camera.project(at)).collect();
    let count = seen.len().max(1) as f64;
    let mean = [0, 1].map(|k| seen.iter().map(|at| at[k]).sum::<f64>() / count);
    let spread = |i: usize, j: usize| {
        seen.iter().map(|at| (at[i] - mean[i]) * (at[j] - mean[j])).sum::<f64>() / count
    };
    let along = spread(0, 0);
    let upward = spread(1, 1);
    let area = (along * upward - spread(0, 1) * spread(0, 1)).max(0.0).sqrt();
    // Agents on a line have no area from anywhere: their length counts a little.
    let extent = area + 0.05 * (along + upward);
    let is_hidden = |at: Vec3, seen: [f64; 2]| {
        balls.iter().filter_map(|body| ball(body)).any(|Ball { body, radius_m }| {
            let center = camera.project(body.pose.at_m);
            let is_nearer = camera.depth_m(body.pose.at_m) > camera.depth_m(at);
            is_nearer && hypot(center[0] - seen[0], center[1] - seen[1]) < radius_m
        })
    };
    let hidden = points.iter().zip(&seen).filter(|(at, seen)| is_hidden(**at, **seen)).count();
    extent * (1.0 - (1.0 - HIDDEN) * hidden as f64 / count)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{ball as round, moment, open};
    use sidestep_chain::kinds::CONNECTOR;

    /// A chain along x, and balls in rows beside it.
    fn among_balls(rows: u32) -> (Scenery, Frame) {
        let chain: Vec<Body> = (0..10)
            .map(|k| round(CONNECTOR, 0, [f64::from(k), 0.0, 0.0], 0.1).with_part(k))
            .collect();
        let row = |y: u32| (0..10).map(move |x| [f64::from(x), f64::from(y) + 1.0, 0.0]);
        let places = (0..rows).flat_map(row);
        let bodies =
            (0..).zip(places).map(|(k, at)| round(BodyKind::OBSTACLE, k, at, 0.4)).collect();
        (Scenery { bodies, ..open(3) }, moment(chain))
    }

    #[test]
    fn of_many_balls_only_those_near_an_agent_are_shown() {
        let (scenery, frame) = among_balls(20);
        let near = Surroundings::new(&scenery, &frame);
        // Gaps up to 0.8 m: the row at 1 m, but not that at 2 m.
        assert_eq!(near.cut().map(|(_, shown, all)| (shown, all)), Some((10, 200)));
        assert!(near.balls().iter().all(|body| body.number < 10));
        assert_eq!(near.visible().len(), 20, "what is no ball is always shown");
        let (scenery, frame) = among_balls(6);
        assert_eq!(
            Surroundings::new(&scenery, &frame).cut(),
            None,
            "few are shown wherever they are"
        );
    }

    #[test]
    fn a_ball_hides_an_agent_only_between_it_and_the_eye() {
        let canvas = Canvas {
            camera: Camera::FRONT,
            px_per_m: 100.0,
            zero: (0.0, 0.0),
            origin_m: [0.0; 2],
            depths_m: [0.0, 1.0],
            is_plane: false,
        };
        let (_, frame) = among_balls(0);
        let seen = AgentProjections::new(&frame, &canvas);
        let at = |place| round(BodyKind::OBSTACLE, 0, place, 0.4);
        assert!(seen.are_behind(&at([2.0, -3.0, 0.0]), &canvas), "the eye is where y is low");
        assert!(!seen.are_behind(&at([2.0, 3.0, 0.0]), &canvas));
        assert!(!seen.are_behind(&at([2.0, -3.0, 1.0]), &canvas));
    }

    #[test]
    fn the_best_view_of_a_wall_of_agents_is_not_along_it() {
        // Agents in a plane that the usual direction sees almost edge-on.
        let along = [0.48, -0.64, 0.0];
        let bodies = (0..100).map(|k| {
            let (i, j) = (f64::from(k / 10), f64::from(k % 10));
            round(CONNECTOR, k, [along[0] * i, along[1] * i, j], 0.1)
        });
        let frame = moment(bodies.collect());
        let points: Vec<Vec3> = frame.bodies.iter().map(|body| body.pose.at_m).collect();
        let best = best_camera(&[&frame], &[]);
        let usual = visibility(Camera::CORNER, &points, &[]);
        assert!(visibility(best, &points, &[]) > 1.5 * usual);
    }
}
