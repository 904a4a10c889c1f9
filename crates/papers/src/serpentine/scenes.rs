//! Pictures of bodies as plain data: the swarm in its corridor, the snake in space, the broken
//! chain before and after.

use super::Plan;
use super::{broken, corridor, snake};
use crate::study::{setting, source};
use sidestep::experiment::sweep::Setting;
use sidestep::kernel::{InputError, Simulation};
use sidestep::worlds::chain::Obstacle;
use sidestep::worlds::chain::geometry::{Point, distance};
use sidestep::worlds::chain::scenario::Compiled;
use sidestep::worlds::chain::simulation::ChainSimulation;

/// A picture in the plane or in space.
#[derive(Debug, Clone, PartialEq)]
pub enum Scene {
    /// Seen from above.
    Plane(View<2>),
    /// In space.
    Space(View<3>),
}

/// What is to be seen.
#[derive(Debug, Clone, PartialEq)]
pub struct View<const D: usize> {
    /// What it shows.
    pub title: String,
    /// Small print.
    pub caption: String,
    /// What stands and moves in it.
    pub obstacles: Vec<Obstacle<D>>,
    /// Chains.
    pub strands: Vec<Strand<D>>,
    /// Ways of the first and the last connector of the first chain.
    pub trails: Vec<Vec<Point<D>>>,
}

/// A chain.
#[derive(Debug, Clone, PartialEq)]
pub struct Strand<const D: usize> {
    /// Its connectors, the first one leads.
    pub points: Vec<Point<D>>,
    /// Their radius,
    pub connector_radius_m: f64,
    /// and that of the rods.
    pub rod_radius_m: f64,
    /// Its name.
    pub name: String,
}

/// Of how many cycles one is a point of a trail.
const EVERY: u64 = 10;
/// Balls further than this from every connector are left out of the picture in space.
const NEAR_M: f64 = 0.7;

/// All pictures.
pub(super) fn all(plan: &Plan) -> Result<Vec<Scene>, InputError> {
    let mut scenes = vec![swarm(plan)?, creeping(plan)?];
    scenes.extend(broken_chain()?);
    Ok(scenes)
}

/// Runs `cycles`, and keeps the ways of both ends.
fn traced<const D: usize>(
    text: &str,
    settings: &[Setting],
    cycles: u64,
) -> Result<(ChainSimulation<D>, Vec<Vec<Point<D>>>), InputError> {
    let source = source(text, settings)?;
    let mut run = ChainSimulation::<D>::new(Compiled::new(&source)?, &source, 1);
    let mut trails = vec![Vec::new(); 2];
    while run.cycle() < cycles && !run.is_over() {
        if run.cycle() % EVERY == 0 {
            let body = run.state().body(0);
            let points = body.chain.points();
            trails[0].push(points[0]);
            trails[1].push(points[points.len() - 1]);
        }
        run.advance(1);
    }
    Ok((run, trails))
}

fn strand<const D: usize>(run: &ChainSimulation<D>) -> Strand<D> {
    let body = run.state().body(0);
    let chain = &body.chain;
    Strand {
        points: chain.points().to_vec(),
        connector_radius_m: chain.connectors().iter().map(|c| c.radius_m).fold(0.0, f64::max),
        rod_radius_m: chain.rods().iter().map(|r| r.radius_m).fold(0.0, f64::max),
        name: run.world().chains[0].name.clone(),
    }
}

fn swarm(plan: &Plan) -> Result<Scene, InputError> {
    let cycles = plan.corridor_cycles.min(plan.pictured_cycles);
    let (run, trails) =
        traced::<2>(corridor::SCENARIO, &[setting("cycles", cycles as i64)], cycles)?;
    Ok(Scene::Plane(View {
        title: "A leader and 15 followers in the corridor of 2 m".into(),
        caption: format!("Seed 1, after {} cycles; ways of leader and last follower.", run.cycle()),
        obstacles: run.world().obstacles.still().to_vec(),
        strands: vec![strand(&run)],
        trails,
    }))
}

fn creeping(plan: &Plan) -> Result<Scene, InputError> {
    let cycles = setting("cycles", plan.snake_cycles as i64);
    let (run, trails) = traced::<3>(snake::SCENARIO, &[cycles], plan.snake_cycles)?;
    let strand = strand(&run);
    let is_near = |o: &Obstacle<3>| {
        let apart_m = |p: &Point<3>| distance(o.core.nearest_to_point(*p).on_core, *p) - o.radius_m;
        strand.points.iter().any(|p| apart_m(p) < NEAR_M)
    };
    let obstacles = run.world().obstacles.still().iter().filter(|o| is_near(o)).copied().collect();
    Ok(Scene::Space(View {
        title: "A snake of 450 connectors among balls that fill a tenth of the room".into(),
        caption: format!("Seed 1, after {} cycles; balls within {NEAR_M} m of it.", run.cycle()),
        obstacles,
        strands: vec![strand],
        trails: trails.into_iter().take(1).collect(),
    }))
}

fn broken_chain() -> Result<[Scene; 2], InputError> {
    let [before, after] = broken::before_and_after(1)?;
    let view = |title: &str, points: Vec<Point<2>>| {
        let name = "chain".into();
        let strand = Strand { points, connector_radius_m: 0.2, rod_radius_m: 0.05, name };
        Scene::Plane(View {
            title: title.into(),
            caption: "Seed 1; of 40 connectors two are gone and 18 thrown about by 5 m.".into(),
            obstacles: Vec::new(),
            strands: vec![strand],
            trails: Vec::new(),
        })
    };
    Ok([
        view("A broken chain", before),
        view("The same joined again with fewer parts: its end has come", after),
    ])
}
