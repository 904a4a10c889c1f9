//! The pictures: the swarm in its corridor, the snake in space, the broken chain before and after.

use super::SerpentineConfig;
use super::{broken_chain, corridor, snake};
use crate::Scene;
use crate::study::{downcast, setting, source};
use sidestep::experiment::sweep::Setting;
use sidestep::kernel::view::{
    Body, BodyId, BodyKind, Frame, FrameOptions, Pose, Scenery, Shape, Trail, Vec3,
};
use sidestep::kernel::{InputError, Simulation};
use sidestep::rods::geometry::{Point, distance};
use sidestep::worlds::chain::kinds::{CONNECTOR, RODS};
use sidestep::worlds::chain::{ChainRun, chain_run};

/// Number of cycles from one point of a trail to the next: 10 cm at the leader's 0.5 m/s.
const TRAIL_INTERVAL_CYCLES: u64 = 10;
/// Balls farther than this from every connector are left out of the picture in space, meters: all of them would hide the
/// snake.
const MAX_BALL_DISTANCE_M: f64 = 0.7;

/// The swarm, the snake, and the broken chain before and after.
pub(super) fn all(plan: &SerpentineConfig) -> Result<Vec<Scene>, InputError> {
    let mut scenes = vec![swarm(plan)?, creeping(plan)?];
    scenes.extend(broken_chain()?);
    Ok(scenes)
}

/// A run, and the ways of both ends of its chain.
type TracedRun = (Box<dyn Simulation>, Vec<Trail>);

/// Runs `cycles`, and keeps the ways of both ends of the chain.
fn trace_ends<const D: usize>(
    text: &str,
    settings: &[Setting],
    cycles: u64,
) -> Result<TracedRun, InputError> {
    let mut run = chain_run(&source(text, settings)?, 1)?;
    let last = run.agent_count() as u32 - 1;
    let mut trails = vec![empty_trail(0), empty_trail(last)];
    while run.cycle() < cycles && !run.is_over() {
        if run.cycle().is_multiple_of(TRAIL_INTERVAL_CYCLES) {
            let body = downcast::<ChainRun<D>>(&*run).state().body(0);
            let points = body.chain.points();
            for (trail, point) in trails.iter_mut().zip([points[0], points[points.len() - 1]]) {
                trail.points.push((run.cycle(), in_space(point)));
            }
        }
        run.advance(1);
    }
    Ok((run, trails))
}

fn empty_trail(connector: u32) -> Trail {
    Trail { of: BodyId::new(CONNECTOR, 0, Some(connector)), points: Vec::new() }
}

fn swarm(plan: &SerpentineConfig) -> Result<Scene, InputError> {
    let cycles = plan.corridor_cycles.min(plan.pictured_cycles);
    let (mut run, trails) =
        trace_ends::<2>(corridor::SCENARIO, &[setting("cycles", cycles as i64)], cycles)?;
    Ok(Scene {
        title: "A leader and 15 followers in the corridor of 2 m".into(),
        caption: format!("Seed 1, after {} cycles; ways of leader and last follower.", run.cycle()),
        scenery: run.scenery(),
        frame: run.frame(FrameOptions::WITHOUT_SCANS),
        trails,
    })
}

fn creeping(plan: &SerpentineConfig) -> Result<Scene, InputError> {
    let cycles = setting("cycles", plan.snake_cycles as i64);
    let (mut run, trails) = trace_ends::<3>(snake::SCENARIO, &[cycles], plan.snake_cycles)?;
    let mut scenery = run.scenery();
    let frame = run.frame(FrameOptions::WITHOUT_SCANS);
    let connectors = frame.bodies.iter().filter(|body| body.kind == CONNECTOR);
    let snake: Vec<Vec3> = connectors.map(|body| body.pose.at_m).collect();
    scenery.bodies.retain(|body| is_near(body, &snake));
    Ok(Scene {
        title: "A snake of 450 connectors among balls that fill a tenth of the room".into(),
        caption: format!(
            "Seed 1, after {} cycles; balls within {MAX_BALL_DISTANCE_M} m of it.",
            run.cycle()
        ),
        scenery,
        frame,
        trails: trails.into_iter().take(1).collect(),
    })
}

/// Returns whether a ball is near to one of these places; always true for other bodies.
fn is_near(body: &Body, places: &[Vec3]) -> bool {
    let Shape::Sphere { radius_m } = &body.shape else { return true };
    if body.kind != BodyKind::OBSTACLE {
        return true;
    }
    places.iter().any(|p| distance(*p, body.pose.at_m) - radius_m < MAX_BALL_DISTANCE_M)
}

fn broken_chain() -> Result<[Scene; 2], InputError> {
    let [before, after] = broken_chain::before_and_after(1)?;
    Ok([
        scene_of_chain("A broken chain", before),
        scene_of_chain("The same joined again with fewer parts: its end has come", after),
    ])
}

fn scene_of_chain(title: &str, points: Vec<Point<2>>) -> Scene {
    Scene {
        title: title.into(),
        caption: "Seed 1; of 40 connectors two are gone and 18 thrown about by 5 m.".into(),
        scenery: Scenery {
            name: String::new(),
            dimensions: 2,
            cycle_s: 1.0,
            floor: None,
            bodies: Vec::new(),
            names: vec![(CONNECTOR, 0, "chain".into())],
            groups: Vec::new(),
            earth: Default::default(),
            traffic: None,
        },
        frame: Frame { bodies: chain(points), ..Frame::default() },
        trails: Vec::new(),
    }
}

/// Returns a chain as drawn bodies: rods first, so that connectors cover their ends.
fn chain(points: Vec<Point<2>>) -> Vec<Body> {
    let points_m: Vec<Vec3> = points.into_iter().map(in_space).collect();
    let mut balls = Vec::with_capacity(points_m.len());
    for (part, at_m) in (0..).zip(&points_m) {
        let ball = Shape::Sphere { radius_m: 0.2 };
        let at = Pose::from_position(*at_m);
        balls.push(Body::new(CONNECTOR, 0, at, ball).with_part(part));
    }
    let rods = Shape::Line { points_m, thickness_m: 0.1 };
    let mut bodies = vec![Body::new(RODS, 0, Pose::from_position([0.0; 3]), rods)];
    bodies.append(&mut balls);
    bodies
}

fn in_space<const D: usize>(at: Point<D>) -> Vec3 {
    std::array::from_fn(|k| at.get(k).copied().unwrap_or(0.0))
}
