//! The pictures: the swarm in its corridor, the snake in space, the broken chain before and after.

use super::SerpentinePlan;
use super::{broken, corridor, snake};
use crate::Scene;
use crate::study::{known, setting, source};
use sidestep::experiment::sweep::Setting;
use sidestep::kernel::view::{Body, Frame, Kind, Look, Place, Pose, Scenery, Shape, Trail, Who};
use sidestep::kernel::{InputError, Simulation};
use sidestep::worlds::chain::geometry::Point;
use sidestep::worlds::chain::{ChainRun, chain_run};

/// Number of cycles from one point of a trail to the next.
const EVERY: u64 = 10;
/// Balls farther than this from every connector are left out of the picture in space, meters.
const NEAR_M: f64 = 0.7;

/// Returns all pictures.
pub(super) fn all(plan: &SerpentinePlan) -> Result<Vec<Scene>, InputError> {
    let mut scenes = vec![swarm(plan)?, creeping(plan)?];
    scenes.extend(broken_chain()?);
    Ok(scenes)
}

/// A run, and the ways of both ends of its chain.
type Traced = (Box<dyn Simulation>, Vec<Trail>);

/// Runs `cycles`, and keeps the ways of both ends of the chain.
fn traced<const D: usize>(
    text: &str,
    settings: &[Setting],
    cycles: u64,
) -> Result<Traced, InputError> {
    let mut run = chain_run(&source(text, settings)?, 1)?;
    let last = run.agents() as u32 - 1;
    let trail = |part| Trail { of: Who::new(Kind::Connector, 0, Some(part)), way: Vec::new() };
    let mut trails: Vec<Trail> = [0, last].map(trail).to_vec();
    while run.cycle() < cycles && !run.is_over() {
        if run.cycle().is_multiple_of(EVERY) {
            let body = known::<ChainRun<D>>(&*run).state().body(0);
            let points = body.chain.points();
            for (trail, point) in trails.iter_mut().zip([points[0], points[points.len() - 1]]) {
                trail.way.push((run.cycle(), in_space(point)));
            }
        }
        run.advance(1);
    }
    Ok((run, trails))
}

fn swarm(plan: &SerpentinePlan) -> Result<Scene, InputError> {
    let cycles = plan.corridor_cycles.min(plan.pictured_cycles);
    let (mut run, trails) =
        traced::<2>(corridor::SCENARIO, &[setting("cycles", cycles as i64)], cycles)?;
    Ok(Scene {
        title: "A leader and 15 followers in the corridor of 2 m".into(),
        caption: format!("Seed 1, after {} cycles; ways of leader and last follower.", run.cycle()),
        scenery: run.scenery(),
        frame: run.frame(Look::BODIES),
        trails,
    })
}

fn creeping(plan: &SerpentinePlan) -> Result<Scene, InputError> {
    let cycles = setting("cycles", plan.snake_cycles as i64);
    let (mut run, trails) = traced::<3>(snake::SCENARIO, &[cycles], plan.snake_cycles)?;
    let (mut scenery, frame) = (run.scenery(), run.frame(Look::BODIES));
    let connectors = frame.bodies.iter().filter(|body| body.kind == Kind::Connector);
    let snake: Vec<Place> = connectors.map(|body| body.pose.at_m).collect();
    scenery.bodies.retain(|body| is_near(body, &snake));
    Ok(Scene {
        title: "A snake of 450 connectors among balls that fill a tenth of the room".into(),
        caption: format!("Seed 1, after {} cycles; balls within {NEAR_M} m of it.", run.cycle()),
        scenery,
        frame,
        trails: trails.into_iter().take(1).collect(),
    })
}

/// Returns whether a ball is near to one of these places; always true for other bodies.
fn is_near(body: &Body, places: &[Place]) -> bool {
    let (Kind::Obstacle, Shape::Sphere { radius_m }) = (body.kind, &body.shape) else {
        return true;
    };
    let apart_m = |p: &Place| -> f64 {
        (0..3).map(|k| (p[k] - body.pose.at_m[k]) * (p[k] - body.pose.at_m[k])).sum::<f64>().sqrt()
    };
    places.iter().any(|p| apart_m(p) - radius_m < NEAR_M)
}

fn broken_chain() -> Result<[Scene; 2], InputError> {
    let [before, after] = broken::before_and_after(1)?;
    let scene = |title: &str, points: Vec<Point<2>>| Scene {
        title: title.into(),
        caption: "Seed 1; of 40 connectors two are gone and 18 thrown about by 5 m.".into(),
        scenery: Scenery {
            name: String::new(),
            dimensions: 2,
            cycle_s: 1.0,
            floor: None,
            bodies: Vec::new(),
            names: vec![(Kind::Connector, 0, "chain".into())],
        },
        frame: Frame { bodies: chain(points), ..Frame::default() },
        trails: Vec::new(),
    };
    Ok([
        scene("A broken chain", before),
        scene("The same joined again with fewer parts: its end has come", after),
    ])
}

/// Returns a chain as drawn bodies.
fn chain(points: Vec<Point<2>>) -> Vec<Body> {
    let points_m: Vec<Place> = points.into_iter().map(in_space).collect();
    let ball = |(part, at_m): (u32, &Place)| {
        Body::new(Kind::Connector, 0, Pose::at(*at_m), Shape::Sphere { radius_m: 0.2 }).part(part)
    };
    let balls: Vec<Body> = (0..).zip(&points_m).map(ball).collect();
    let rods = Shape::Line { points_m, thickness_m: 0.1 };
    [Body::new(Kind::Rods, 0, Pose::at([0.0; 3]), rods)].into_iter().chain(balls).collect()
}

fn in_space<const D: usize>(at: Point<D>) -> Place {
    std::array::from_fn(|k| at.get(k).copied().unwrap_or(0.0))
}
