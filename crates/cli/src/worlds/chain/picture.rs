//! The picture of a run: obstacles, chains, and where their ends went.

use super::super::{Comparison, Pictured};
use crate::console::grouped;
use crate::exit::Failure;
use sidestep::kernel::ports::Values;
use sidestep::kernel::{Cycle, InputError, Simulation};
use sidestep::worlds::chain::geometry::Core;
use sidestep::worlds::chain::obstacle::Obstacle;
use sidestep::worlds::chain::simulation::ChainSimulation;
use sidestep_draw::{self as draw, BodyScene, DrawError, Shape, Strand, Style, Trail};
use sidestep_record::{Table, read_table};
use std::ops::RangeInclusive;
use std::path::Path;

/// The table that holds positions.
const TABLE: &str = "trajectories";
const AXES: [&str; 3] = ["x_m", "y_m", "z_m"];
/// So many recorded positions are read for trails; of longer runs the last ones.
const MOST_ROWS: u64 = 4_000_000;
/// Chains with trails: more cannot be told apart.
const MOST_TRAILS: usize = 6;

/// A scene that can be drawn, in as many dimensions as it has.
pub(super) trait Drawn {
    /// As SVG.
    fn svg(&self, style: &Style) -> Result<String, DrawError>;
}

impl Drawn for BodyScene<2> {
    fn svg(&self, style: &Style) -> Result<String, DrawError> {
        self.to_svg(style)
    }
}

impl Drawn for BodyScene<3> {
    fn svg(&self, style: &Style) -> Result<String, DrawError> {
        self.to_svg(style)
    }
}

/// One recorded position.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Recorded<const D: usize> {
    chain: u32,
    connector: u32,
    at: [f64; D],
}

/// The chains of `simulation` as they are, among all obstacles.
pub(super) fn svg<const D: usize>(
    simulation: &ChainSimulation<D>,
    of: Pictured<'_>,
) -> Result<String, Failure>
where
    BodyScene<D>: Drawn,
{
    let (world, state) = (simulation.world(), simulation.state());
    let movers = world.movers.at(world.starts_s(simulation.cycle()));
    let obstacles = world.obstacles.still().iter().copied().chain(movers);
    let scene = BodyScene {
        obstacles: obstacles.map(|o| drawn_obstacle(&o)).collect(),
        strands: (0..state.len()).map(|slot| strand(simulation, slot)).collect(),
        trails: match of.folder {
            Some(folder) => trails(simulation, folder)?,
            None => Vec::new(),
        },
        view_m: None,
        title: simulation.compiled().name.clone(),
        caption: format!("after {} cycles; {}", grouped(simulation.cycle()), of.origin),
    };
    Ok(scene.svg(&Style::MAP)?)
}

/// An obstacle as it is drawn.
pub(crate) fn drawn_obstacle<const D: usize>(obstacle: &Obstacle<D>) -> draw::Obstacle<D> {
    let radius_m = obstacle.radius_m;
    let shape = match obstacle.core {
        Core::Point(center) => Shape::Ball { center, radius_m },
        Core::Segment(ends) => Shape::Capsule { ends, radius_m },
        Core::Cuboid(c) => Shape::Cuboid {
            center: c.center,
            axes: c.axes,
            half_m: c.half_m.map(|half_m| half_m + radius_m),
        },
    };
    draw::Obstacle { shape, velocity_m_s: obstacle.velocity_m_s }
}

/// A chain, or the robots that follow it.
fn strand<const D: usize>(simulation: &ChainSimulation<D>, slot: usize) -> Strand<D> {
    let (body, spec) = (simulation.state().body(slot), &simulation.world().chains[slot]);
    let connectors = body.chain.connectors().iter().map(|c| c.radius_m);
    let in_plane = |at: [f64; 2]| std::array::from_fn(|i| at.get(i).copied().unwrap_or(0.0));
    let robots = body.robots.iter().map(|robot| in_plane(robot.pose.at));
    let points = match body.robots.is_empty() {
        true => body.chain.points().to_vec(),
        false => robots.collect(),
    };
    Strand {
        points,
        connector_radius_m: match &spec.robots {
            Some(robots) => robots.follower.ring.radius_m,
            None => connectors.fold(0.0, f64::max),
        },
        rod_radius_m: body.chain.rods().iter().map(|rod| rod.radius_m).fold(0.0, f64::max),
        label: spec.name.clone(),
    }
}

/// Where the first and the last connector of the first chains went.
fn trails<const D: usize>(
    simulation: &ChainSimulation<D>,
    folder: &Path,
) -> Result<Vec<Trail<D>>, InputError> {
    let every = simulation.compiled().record.every;
    let recorded_cycles = (MOST_ROWS / simulation.agents().max(1) as u64).max(1);
    let from = simulation.cycle().saturating_sub(recorded_cycles.saturating_mul(every));
    let Some(rows) = rows::<D>(folder, from..=simulation.cycle())? else { return Ok(Vec::new()) };
    let shown = simulation.state().len().min(MOST_TRAILS);
    let mut trails = Vec::new();
    for slot in 0..shown {
        let last = simulation.state().body(slot).chain.points().len() as u32 - 1;
        for end in [0, last] {
            let is_its = |r: &&Recorded<D>| r.chain == slot as u32 && r.connector == end;
            let points = rows.iter().filter(is_its).map(|r| r.at).collect();
            trails.push(Trail { points, color: slot, label: String::new() });
        }
    }
    Ok(trails)
}

/// Compares the present positions with those recorded for the present cycle.
pub(super) fn compare<const D: usize>(
    simulation: &ChainSimulation<D>,
    folder: &Path,
) -> Result<Comparison, InputError> {
    let cycle = simulation.cycle();
    let Some(recorded) = rows::<D>(folder, cycle..=cycle)?.filter(|rows| !rows.is_empty()) else {
        return Ok(Comparison::NotRecorded);
    };
    let state = simulation.state();
    let differs = |row: &&Recorded<D>| {
        let slot = row.chain as usize;
        let point = |slot| state.body(slot).chain.points().get(row.connector as usize).copied();
        (slot < state.len()).then(|| point(slot)).flatten() != Some(row.at)
    };
    let mut different: Vec<u32> = recorded.iter().filter(differs).map(|r| r.connector).collect();
    different.sort_unstable();
    different.dedup();
    Ok(match different.is_empty() {
        true => Comparison::Equal(recorded.len()),
        false => Comparison::Different(different),
    })
}

/// The recorded positions of some cycles; `None` where there are none, or in another form.
fn rows<const D: usize>(
    folder: &Path,
    cycles: RangeInclusive<Cycle>,
) -> Result<Option<Vec<Recorded<D>>>, InputError> {
    if !crate::recorded::has_rows(folder, TABLE) {
        return Ok(None);
    }
    Ok(in_words(&read_table(folder, TABLE, cycles)?))
}

fn in_words<const D: usize>(table: &Table) -> Option<Vec<Recorded<D>>> {
    let ids = |name| match table.column(name)? {
        Values::U32(values) => Some(values),
        _ => None,
    };
    let numbers = |name| match table.column(name)? {
        Values::F64(values) => Some(values),
        _ => None,
    };
    let (chains, connectors) = (ids("chain")?, ids("connector")?);
    let axes: Vec<&Vec<f64>> = AXES[..D].iter().map(|axis| numbers(axis)).collect::<Option<_>>()?;
    let row = |k: usize| Recorded {
        chain: chains[k],
        connector: connectors[k],
        at: std::array::from_fn(|i| axes[i][k]),
    };
    Some((0..chains.len()).map(row).collect())
}
