//! A fleet that carries goods between shelves, cycle by cycle.
//!
//! `cargo run -p sidestep-planners --example warehouse`
//!
//! Orders come in at shelves. Free robots get them at the lowest sum of distances, and PIBT leads all robots. In one
//! of twenty cycles all of them pause: the next one plans from where the robots are.

use sidestep_kernel::stream::{Purpose, Streams};
use sidestep_planners::assignment::{CostMatrix, kuhn_munkres};
use sidestep_planners::{FreeSpace, GridPose, InputError, Pibt, PibtConfig, PibtState, Seed};

const WIDTH: u32 = 40;
const HEIGHT: u32 = 24;
const ROBOTS: usize = 60;
const CYCLES: u64 = 500;

/// Draws of the places of orders, and of pauses.
const ORDERS: Purpose = Purpose(100);
const PAUSES: Purpose = Purpose(101);

fn main() -> Result<(), InputError> {
    let floor = FreeSpace::new(WIDTH, HEIGHT, |col, row| !is_shelf(col, row));
    let streams = Streams::new(Seed(7));
    let mut pibt = Pibt::new(&floor, &[1; ROBOTS], PibtConfig::default())?;
    let mut state = PibtState::new(ROBOTS);
    let mut poses: Vec<_> = (0..ROBOTS as u32).map(start).collect();
    let mut goals = vec![None; ROBOTS];
    let mut delivered = 0;
    for cycle in 0..CYCLES {
        for (goal, pose) in goals.iter_mut().zip(&poses) {
            if *goal == Some(pose.position()) {
                *goal = None;
                delivered += 1;
            }
        }
        assign(&streams, cycle, &poses, &mut goals);
        let actions = pibt.step(&mut state, &poses, &goals)?.to_vec();
        if !streams.block(0, cycle, PAUSES, 0)[0].is_multiple_of(20) {
            for (pose, action) in poses.iter_mut().zip(actions) {
                *pose = pose.after(action).expect("actions stay on the floor");
            }
        }
    }
    println!("{ROBOTS} robots delivered {delivered} orders in {CYCLES} cycles");
    Ok(())
}

/// Pairs of shelves with aisles around them.
fn is_shelf(col: u32, row: u32) -> bool {
    (4..WIDTH - 4).contains(&col) && !col.is_multiple_of(6) && !row.is_multiple_of(3)
}

/// The robots begin in the columns without shelves.
fn start(robot: u32) -> GridPose {
    GridPose::new(robot / HEIGHT, robot % HEIGHT, 0)
}

/// Gives new orders to the robots that have none.
fn assign(streams: &Streams, cycle: u64, poses: &[GridPose], goals: &mut [Option<(u32, u32)>]) {
    let free: Vec<usize> = (0..ROBOTS).filter(|&robot| goals[robot].is_none()).collect();
    let order = |index: usize| {
        let words = streams.block(index as u32, cycle, ORDERS, 0);
        (words[0] % WIDTH, words[1] % (HEIGHT / 3) * 3)
    };
    let orders: Vec<(u32, u32)> = (0..free.len()).map(order).collect();
    let costs = CostMatrix::new(free.len(), orders.len(), |robot, order| {
        let pose = poses[free[robot]];
        pose.col.abs_diff(orders[order].0) + pose.row.abs_diff(orders[order].1)
    });
    for (robot, order) in free.iter().zip(kuhn_munkres(&costs)) {
        goals[*robot] = order.map(|order| orders[order]);
    }
}
