//! Whether robots arrive where they meet: crowds that go to and fro through passages with room for two bodies.
//!
//! `cargo bench -p sidestep --bench traffic [-- CASES [SEEDS [POLICY [METHOD]]]]` flies each case whose name contains one of
//! the words of `CASES` (separated by commas; all without) with seeds 1 to `SEEDS` (100) for 8,000 cycles, and prints how
//! many seeds *stop*: no trip ends in the last 2,000 cycles. Conflicts are resolved by `POLICY` (random). With a `METHOD`,
//! such as pibt, a planner leads all robots as one team, which is the bound for robots that decide alone.

use sidestep::kernel::workers::available_workers;
use sidestep::scenario::Source;
use sidestep::worlds::robots::{RobotsRun, robots_run};
use sidestep_kernel::Simulation;
use std::sync::atomic::{AtomicU64, Ordering};

const CYCLES: u64 = 8_000;
/// A run in which no trip ends in so many cycles at its end has stopped.
const STANDSTILL_CYCLES: u64 = 2_000;
const DEFAULT_SEEDS: u64 = 100;
/// Length of a corridor in boxes.
const CORRIDOR_BOXES: usize = 60;
/// Cells of the map that are walls.
const WALL: u8 = b'#';
const FREE: u8 = b'.';

/// Robots of one team, that go to and fro between two regions `[col, row, width, height]`.
struct Team {
    robots: usize,
    start: Option<[usize; 4]>,
    ends: [[usize; 4]; 2],
}

struct Case {
    name: String,
    regime: &'static str,
    size: usize,
    /// Rows of the map.
    map: Vec<Vec<u8>>,
    teams: Vec<Team>,
}

/// What all runs have in common.
struct Setup {
    seeds: u64,
    conflict_policy: String,
    /// The planner that leads all robots; none for robots that decide alone.
    method: Option<String>,
}

impl Setup {
    /// Reads the arguments of the command line after the words that choose cases.
    fn from_arguments(mut arguments: impl Iterator<Item = String>) -> Self {
        let seeds = arguments.next();
        Self {
            seeds: seeds.map_or(DEFAULT_SEEDS, |seeds| seeds.parse().expect("SEEDS is a number")),
            conflict_policy: arguments.next().unwrap_or_else(|| "random".to_owned()),
            method: arguments.next(),
        }
    }
}

impl Case {
    fn source(&self, setup: &Setup, seed: u64) -> Source {
        let rows = self.map.iter().map(|row| String::from_utf8_lossy(row).into_owned() + "\n");
        let map: String = rows.collect();
        let regime = self.regime;
        let policy = &setup.conflict_policy;
        let mut text = format!(
            "format = 1\nworld = \"robots\"\nseed = {seed}\nregime = \"{regime}\"\nconflict_policy = \"{policy}\"\n\
             [map]\nascii = \"\"\"\n{map}\"\"\"\n"
        );
        for (number, Team { robots, start, ends: [a, b] }) in self.teams.iter().enumerate() {
            let leader = match &setup.method {
                None => String::new(),
                Some(method) if number == 0 => {
                    format!("name = \"all\"\nplanner = {{ method = \"{method}\" }}\n")
                }
                Some(_) => "team = \"all\"\n".to_owned(),
            };
            let size = self.size;
            let region = start.map_or(String::new(), |start| format!("region = {start:?}\n"));
            text += &format!(
                "[[robots]]\ncount = {robots}\nsize = {size}\n{region}sensors = [\"sonar-ring\"]\neffector = \"nomad\"\n\
                 behaviour = {{ kind = \"shuttle\", a = {a:?}, b = {b:?} }}\n{leader}"
            );
        }
        Source::new(self.name.as_str(), text, "")
    }
}

/// Robots from both ends of a corridor.
fn corridor(width: usize, size: usize, share_percent: usize) -> (Vec<Vec<u8>>, Vec<Team>) {
    let wall = vec![WALL; CORRIDOR_BOXES];
    let mut map = vec![vec![FREE; CORRIDOR_BOXES]; width + 2];
    map[0] = wall.clone();
    map[width + 1] = wall;
    let robots = width * CORRIDOR_BOXES * share_percent / 100 / (size * size);
    let west = [0, 1, 3, width];
    let east = [CORRIDOR_BOXES - 3, 1, 3, width];
    let half = CORRIDOR_BOXES / 2;
    let teams = vec![
        Team {
            robots: robots.div_ceil(2),
            start: Some([0, 1, half - 2, width]),
            ends: [west, east],
        },
        Team { robots: robots / 2, start: Some([half, 1, half - 2, width]), ends: [east, west] },
    ];
    (map, teams)
}

/// Three by three rooms of eight bodies a side, with doors of two bodies; robots go to the opposite corner.
fn rooms(size: usize, share_percent: usize) -> (Vec<Vec<u8>>, Vec<Team>) {
    const ROOMS: usize = 3;
    let side = 8 * size;
    let door = 2 * size;
    let pitch = side + 1;
    let length = ROOMS * pitch + 1;
    let is_wall = |at: usize| at.is_multiple_of(pitch);
    let is_door = |at: usize| {
        let in_room = at % pitch;
        let first = 1 + side / 2 - door / 2;
        (first..first + door).contains(&in_room)
    };
    let is_outside = |at: usize| at == 0 || at == length - 1;
    let cell = |col: usize, row: usize| {
        let in_wall = is_wall(col) && (is_outside(col) || !is_door(row))
            || is_wall(row) && (is_outside(row) || !is_door(col));
        if in_wall { WALL } else { FREE }
    };
    let map = (0..length).map(|row| (0..length).map(|col| cell(col, row)).collect()).collect();
    let robots = ROOMS * ROOMS * side * side * share_percent / 100 / (size * size) / 4;
    let far = (ROOMS - 1) * pitch + 1;
    let room = |col, row| [col, row, side, side];
    let ways = [
        [room(1, 1), room(far, far)],
        [room(far, 1), room(1, far)],
        [room(far, far), room(1, 1)],
        [room(1, far), room(far, 1)],
    ];
    (map, ways.map(|ends| Team { robots, start: None, ends }).into())
}

/// Shelves in three columns and four rows, with aisles of two bodies; robots go across in both directions.
fn warehouse(size: usize, share_percent: usize) -> (Vec<Vec<u8>>, Vec<Team>) {
    const SHELVES: (usize, usize) = (3, 4);
    let aisle = 2 * size;
    let shelf = (8 * size, 2 * size);
    let width = SHELVES.0 * (shelf.0 + aisle) + aisle;
    let height = SHELVES.1 * (shelf.1 + aisle) + aisle;
    let is_shelf = |at: usize, length: usize| at % (length + aisle) >= aisle;
    let cell = |col: usize, row: usize| {
        if is_shelf(col, shelf.0) && is_shelf(row, shelf.1) { WALL } else { FREE }
    };
    let map: Vec<Vec<u8>> =
        (0..height).map(|row| (0..width).map(|col| cell(col, row)).collect()).collect();
    let free = map.iter().flatten().filter(|&&cell| cell == FREE).count();
    let robots = free * share_percent / 100 / (size * size) / 4;
    let west = [0, 0, aisle, height];
    let east = [width - aisle, 0, aisle, height];
    let south = [0, 0, width, aisle];
    let north = [0, height - aisle, width, aisle];
    let ways = [[west, east], [east, west], [south, north], [north, south]];
    (map, ways.map(|ends| Team { robots, start: None, ends }).into())
}

fn cases() -> Vec<Case> {
    let mut cases = Vec::new();
    for regime in ["reliable", "both"] {
        for share_percent in [10, 20] {
            let mut add = |place: &str, size: usize, (map, teams): (Vec<Vec<u8>>, Vec<Team>)| {
                let name = format!("{place}-{size}x{size}-{share_percent}%-{regime}");
                cases.push(Case { name, regime, size, map, teams });
            };
            for (width, size) in [(2, 1), (3, 1), (4, 1), (8, 1), (4, 2), (8, 2)] {
                add(&format!("corridor-{width}"), size, corridor(width, size, share_percent));
            }
            for size in [1, 2] {
                add("rooms", size, rooms(size, share_percent));
                add("warehouse", size, warehouse(size, share_percent));
            }
        }
    }
    cases
}

/// What came of one run.
#[derive(Clone, Copy, Default)]
struct Outcome {
    trips: u64,
    actions: u64,
    contacts: u64,
    is_stopped: bool,
}

fn fly(source: &Source) -> Outcome {
    let mut run = robots_run(source, 1).expect("the case is a valid scenario");
    advance_to(&mut run, CYCLES - STANDSTILL_CYCLES);
    let trips_before = run.metrics().total.trips;
    advance_to(&mut run, CYCLES);
    let total = run.metrics().total;
    Outcome {
        trips: total.trips,
        actions: total.actions,
        contacts: total.contacts,
        is_stopped: total.trips == trips_before,
    }
}

fn advance_to(run: &mut RobotsRun, cycle: u64) {
    while run.cycle() < cycle {
        run.advance(cycle - run.cycle());
    }
}

/// Returns the outcomes of the seeds from 1 on, each flown by one worker.
fn fly_seeds(case: &Case, setup: &Setup) -> Vec<Outcome> {
    let next = AtomicU64::new(1);
    let work = || {
        let take =
            || Some(next.fetch_add(1, Ordering::Relaxed)).filter(|&seed| seed <= setup.seeds);
        let flown = std::iter::from_fn(take).map(|seed| (seed, fly(&case.source(setup, seed))));
        flown.collect::<Vec<_>>()
    };
    let mut outcomes: Vec<(u64, Outcome)> = std::thread::scope(|scope| {
        let workers: Vec<_> = (0..available_workers()).map(|_| scope.spawn(work)).collect();
        workers.into_iter().flat_map(|worker| worker.join().expect("no panic")).collect()
    });
    outcomes.sort_by_key(|&(seed, _)| seed);
    outcomes.into_iter().map(|(_, outcome)| outcome).collect()
}

fn main() {
    let mut arguments = std::env::args().skip(1).filter(|argument| argument != "--bench");
    let words = arguments.next().unwrap_or_default();
    let setup = Setup::from_arguments(arguments);
    println!(
        "{} seeds of {CYCLES} cycles, conflicts {}, led by {}; per 1,000 robot-cycles: trips (there and back), contacts",
        setup.seeds,
        setup.conflict_policy,
        setup.method.as_deref().unwrap_or("nobody")
    );
    println!("{:32} {:>7} {:>7} {:>9}  seeds that stop", "case", "robots", "trips", "contacts");
    let is_wanted = |case: &Case| words.split(',').any(|word| case.name.contains(word));
    let mut stopped_runs = 0;
    let mut runs = 0;
    for case in cases().into_iter().filter(is_wanted) {
        let outcomes = fly_seeds(&case, &setup);
        let sum = |count: fn(&Outcome) -> u64| outcomes.iter().map(count).sum::<u64>() as f64;
        let per_thousand = 1e3 / sum(|outcome| outcome.actions);
        let stopped: Vec<usize> = (1..)
            .zip(&outcomes)
            .filter(|(_, outcome)| outcome.is_stopped)
            .map(|(seed, _)| seed)
            .collect();
        println!(
            "{:32} {:7} {:7.3} {:9.2}  {} {stopped:?}",
            case.name,
            case.teams.iter().map(|team| team.robots).sum::<usize>(),
            sum(|outcome| outcome.trips) * per_thousand,
            sum(|outcome| outcome.contacts) * per_thousand,
            stopped.len(),
        );
        stopped_runs += stopped.len();
        runs += outcomes.len();
    }
    println!("{stopped_runs} of {runs} runs stop");
}
