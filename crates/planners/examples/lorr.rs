//! A problem of the League of Robot Runners, tick by tick with its delays.
//!
//! `cargo run --release -p sidestep-planners --example lorr -- PROBLEM.json [TICKS [SEEDS]]`
//!
//! Prints the tasks that each seed of delays finished, with the CPU time of the planner.

use cpu_time::ProcessTime;
use sidestep_import::lorr::{Delays, DurationModel, EventModel, Problem, load};
use sidestep_kernel::distr::normal;
use sidestep_kernel::stream::{Purpose, Streams};
use sidestep_planners::lifelong::{Lifelong, LifelongConfig, LifelongState};
use sidestep_planners::{FreeSpace, InputError, Seed};
use std::path::Path;

/// Draws of who is delayed, and for how long.
const EVENTS: Purpose = Purpose(100);
const DURATIONS: Purpose = Purpose(101);

fn main() -> Result<(), InputError> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let number = |index: usize, default: u64| {
        arguments.get(index).and_then(|word| word.parse().ok()).unwrap_or(default)
    };
    let Some(path) = arguments.first() else {
        return Err(InputError::new("lorr", "no problem is given", "give its JSON file"));
    };
    let problem = load(Path::new(path))?;
    let ticks = number(1, 1500);
    let seeds = number(2, 10);
    let mut sum = 0;
    for seed in 0..seeds {
        sum += run(&problem, Seed(seed), ticks)?;
    }
    println!("mean {:.1} tasks of {seeds} seeds", sum as f64 / seeds as f64);
    Ok(())
}

/// Runs a problem with one seed of delays. Returns the number of tasks that were finished.
fn run(problem: &Problem, seed: Seed, ticks: u64) -> Result<u64, InputError> {
    let free = FreeSpace::from_map(&problem.map);
    let robots = problem.starts.len();
    let known = (problem.settings.revealed_per_robot * robots as f64) as usize;
    let ticks_per_action = problem.settings.ticks_per_action;
    let config = LifelongConfig { ticks_per_action, ..LifelongConfig::default() };
    let made = Lifelong::new(&free, &problem.starts, &problem.tasks, known, config);
    let (mut lifelong, mut state) = made?;
    if !lifelong.plans_around_walls() {
        println!("the steps to all goals do not fit in memory: robots stick behind walls");
    }
    let streams = Streams::new(seed);
    let mut total_ms = 0.0;
    let mut max_ms = 0.0f64;
    for _ in 0..ticks {
        let delays = draw(&problem.settings.delays, &streams, &state);
        let start = ProcessTime::now();
        lifelong.tick(&mut state, &delays);
        let ms = start.elapsed().as_secs_f64() * 1e3;
        total_ms += ms;
        max_ms = max_ms.max(ms);
    }
    let mean_ms = total_ms / ticks as f64;
    println!(
        "seed {}: {} tasks; planner {mean_ms:.2} ms a tick, at most {max_ms:.1}; {:.0} ticks a second",
        seed.0,
        state.tasks.finished,
        1e3 / mean_ms
    );
    Ok(state.tasks.finished)
}

/// Draws the delays that begin in a tick.
fn draw(delays: &Delays, streams: &Streams, state: &LifelongState) -> Vec<(usize, u32)> {
    let mut draws = streams.draws(0, state.tick, EVENTS);
    let unit = |word: u32| f64::from(word) / (f64::from(u32::MAX) + 1.0);
    let mut ready: Vec<usize> =
        (0..state.agents.len()).filter(|&agent| state.agents[agent].delay == 0).collect();
    let mut chosen = Vec::new();
    match delays.events {
        EventModel::Bernoulli => {
            chosen.extend(ready.iter().filter(|_| unit(draws.next_u32()) < delays.chance));
        }
        EventModel::Poisson => {
            let mean = state.agents.len() as f64 * delays.chance;
            // The number of arrivals before the product of uniform numbers falls below e^-mean.
            let mut product = unit(draws.next_u32());
            while product > (-mean).exp() && !ready.is_empty() {
                chosen.push(ready.swap_remove(draws.uniform_below(ready.len() as u32) as usize));
                product *= unit(draws.next_u32());
            }
        }
    }
    chosen.into_iter().map(|agent| (agent, duration(delays, streams, state.tick, agent))).collect()
}

fn duration(delays: &Delays, streams: &Streams, tick: u64, agent: usize) -> u32 {
    let mut draws = streams.draws(agent as u32, tick, DURATIONS);
    let range = delays.max_ticks - delays.min_ticks;
    match delays.duration {
        DurationModel::Uniform => delays.min_ticks + draws.next_u32() % (range + 1),
        DurationModel::Gaussian { mean_ratio, deviation_ratio } => {
            let above = (mean_ratio + deviation_ratio * normal(&mut draws)) * f64::from(range);
            delays.min_ticks + above.round().clamp(0.0, f64::from(range)) as u32
        }
    }
}
