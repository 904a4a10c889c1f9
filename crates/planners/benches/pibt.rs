//! Speed of PIBT where each agent gets a new goal when it arrives, and of the first plan of LaCAM*.
//!
//! `cargo bench -p sidestep-planners`; CPU time of a step, and goals reached per step. A tenth of the boxes are walls.

use cpu_time::ProcessTime;
use sidestep_kernel::Seed;
use sidestep_kernel::stream::{Purpose, Streams};
use sidestep_planners::lacam::{self, LacamConfig};
use sidestep_planners::{
    ActionModel, Agent, FreeSpace, GridPose, Instance, Pibt, PibtConfig, PibtState,
};

/// Boxes of a floor of 200 x 200 with scattered walls, of which none encloses another.
const SIDE: u32 = 200;

const WALLS: Purpose = Purpose(10);
const GOALS: Purpose = Purpose(11);

struct Fleet {
    poses: Vec<GridPose>,
    goals: Vec<Option<(u32, u32)>>,
    streams: Streams,
    /// Number of goals drawn so far.
    draws: u64,
    places: Vec<(u32, u32)>,
}

impl Fleet {
    /// Creates agents of so many boxes at the first places that are apart.
    fn new(free: &FreeSpace, agents: usize, size: u32) -> Self {
        let free = free.anchors(size);
        let boxes = (0..SIDE).flat_map(|row| (0..SIDE).map(move |col| (col, row)));
        let places: Vec<_> = boxes.filter(|&(col, row)| free.is_free(col, row)).collect();
        let starts =
            places.iter().filter(|(col, row)| col.is_multiple_of(size) && row.is_multiple_of(size));
        let starts: Vec<_> = starts.collect();
        let stride = starts.len() / agents;
        let start = |agent: usize| starts[agent * stride];
        let poses = (0..agents).map(start).map(|&(col, row)| GridPose::new(col, row, 0)).collect();
        let streams = Streams::new(Seed(1));
        let mut fleet = Self { poses, goals: Vec::new(), streams, draws: 0, places };
        fleet.goals = (0..agents).map(|_| Some(fleet.next_goal())).collect();
        fleet
    }

    fn next_goal(&mut self) -> (u32, u32) {
        self.draws += 1;
        let word = self.streams.block(0, self.draws, GOALS, 0)[0];
        self.places[word as usize % self.places.len()]
    }

    /// Gives a new goal to each agent that arrived; returns how many did.
    fn renew(&mut self) -> usize {
        let mut arrivals = 0;
        for agent in 0..self.poses.len() {
            if Some(self.poses[agent].position()) == self.goals[agent] {
                self.goals[agent] = Some(self.next_goal());
                arrivals += 1;
            }
        }
        arrivals
    }
}

/// Pillars in rows and columns at a distance, a part of which is left out.
fn floor(distance: u32) -> FreeSpace {
    let streams = Streams::new(Seed(2));
    FreeSpace::new(SIDE, SIDE, |col, row| {
        let is_pillar = streams.block(col, u64::from(row), WALLS, 0)[0] % 10 < 9;
        !(col % distance == 1 && row % distance == 1 && is_pillar)
    })
}

fn measure(agents: usize, size: u32, model: ActionModel) {
    // There is room for two bodies beside each other between pillars.
    let free = floor(2 * size + 1);
    let mut fleet = Fleet::new(&free, agents, size);
    let config = PibtConfig { model, ..PibtConfig::default() };
    let mut pibt = Pibt::new(&free, &vec![size; agents], config).expect("sizes are positive");
    let mut state = PibtState::new(agents);
    let mut advance = |fleet: &mut Fleet| {
        let actions = pibt.step(&mut state, &fleet.poses, &fleet.goals).expect("goals are free");
        for (pose, &action) in fleet.poses.iter_mut().zip(actions) {
            *pose = pose.after(action).expect("on the floor");
        }
        fleet.renew()
    };
    let started = ProcessTime::now();
    advance(&mut fleet);
    let first_s = started.elapsed().as_secs_f64();
    let steps = 300;
    let started = ProcessTime::now();
    let arrivals: usize = (0..steps).map(|_| advance(&mut fleet)).sum();
    let step_s = started.elapsed().as_secs_f64() / f64::from(steps);
    println!(
        "{agents:>6} agents of {size} x {size} boxes, {model:?}: first step {:.0} ms, then {:.2} ms ({:.0} steps/s), {:.1} goals per step",
        1e3 * first_s,
        1e3 * step_s,
        1.0 / step_s,
        arrivals as f64 / f64::from(steps)
    );
}

/// Measures the first plan on a floor of 32 x 32 boxes, where starts and goals lie apart, and what a budget makes of
/// it.
fn measure_lacam(agents: usize, model: ActionModel) {
    let free = FreeSpace::new(32, 32, |col, row| !(col % 4 == 1 && row % 4 == 1));
    let boxes = (0..32u32 * 32).map(|index| (index % 32, index / 32));
    let places: Vec<_> = boxes.filter(|&(col, row)| free.is_free(col, row)).collect();
    // Both steps are coprime to the number of places, so that no place comes up twice.
    let agent = |index: usize| {
        let (col, row) = places[index * 7 % places.len()];
        let goal = places[(index * 11 + 400) % places.len()];
        Agent { size: 1, start: GridPose::new(col, row, 0), goal }
    };
    let all = (0..agents).map(agent).collect();
    let instance = Instance::new(&free, model, all).expect("places are free");
    for (budget, is_first_enough) in [(100_000, true), (1000, false)] {
        let config =
            LacamConfig { budget_expansions: budget, is_first_enough, ..LacamConfig::default() };
        let started = ProcessTime::now();
        let outcome = lacam::plan(&instance, config).expect("goals are reachable");
        let time_s = started.elapsed().as_secs_f64();
        let bounds = instance.bounds().expect("goals are reachable");
        let gap = outcome.plan.map(|plan| bounds.gap(&plan.costs(&instance)));
        println!(
            "LaCAM*, {agents} agents, {model:?}: {} expansions, {:.0} ms, gap {gap:.2?}",
            outcome.expansions,
            1e3 * time_s
        );
    }
}

fn main() {
    for agents in [100, 400] {
        measure_lacam(agents, ActionModel::Turns);
        measure_lacam(agents, ActionModel::Classical);
    }
    for agents in [100, 500] {
        measure(agents, 3, ActionModel::Turns);
    }
    for agents in [1000, 10_000] {
        measure(agents, 1, ActionModel::Turns);
        measure(agents, 1, ActionModel::Classical);
    }
}
