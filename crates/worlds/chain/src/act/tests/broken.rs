//! Runs of chains that break: how their parts come together again.

use super::{count, run, told};
use crate::metrics::ChainTally;
use crate::state::Snapshot;
use crate::{ChainRun, ChainWorldState};
use sidestep_kernel::stream::{Purpose, Streams};
use sidestep_kernel::{Seed, Simulation};

/// A chain that breaks, and is to be joined again, with more in the way.
fn broken(joins_s: &str, by_m: f64, more: &str) -> String {
    format!(
        "seed = 3\ncycles = 1500\n{more}\n[[chains]]\nconnectors = 6\nrod_m = [0.4, 0.5]\n\
         tasks = [{{ kind = \"rest\", lasts_s = 8.0 }}]\n\
         changes = [{{ at_s = {joins_s}, reform = true }}, {{ at_s = 1.0, scatter = [1, 4], by_m = {by_m} }}]\n"
    )
}

#[test]
fn a_chain_that_breaks_in_a_cycle_can_be_joined_in_it_wherever_the_file_says_so() {
    // Both are in cycle 50.
    let mut run = run(&broken("1.005", 0.5, ""));
    let events = told(&mut run, 1500);
    let kinds: Vec<_> = events.iter().map(|(kind, _)| kind.as_str()).collect();
    assert_eq!(&kinds[..2], ["broken", "reforming"], "{events:?}");
    assert_eq!(count(&events, "reformed"), 1, "{events:?}");
    assert!(run.is_over() && run.state().body(0).scattered.is_none());
}

/// Walls all around a chain: a part that is thrown out has no way back.
fn closed_room() -> String {
    let corners = [[-3.2, -0.4], [0.7, -0.4], [0.7, 0.4], [-3.2, 0.4]];
    let mut walls = String::new();
    for k in 0..4 {
        let ends = [corners[k], corners[(k + 1) % 4]];
        walls += &format!("[[obstacles]]\nends_m = {ends:?}\nradius_m = 0.02\n");
    }
    walls
}

/// Advances a run; asserts that no connector passes through its obstacles, nor is deeper in one than by rounding.
fn assert_nothing_is_passed(run: &mut ChainRun<2>, cycles: u64, case: &str) -> usize {
    let obstacles = run.world().obstacles.clone();
    let (mut before, mut reformed) = (run.state().body(0).chain.points().to_vec(), 0);
    while run.cycle() < cycles && !run.is_over() {
        let was_whole = run.state().body(0).scattered.is_none();
        run.advance(1);
        let body = run.state().body(0);
        let is_whole = body.scattered.is_none();
        reformed += usize::from(is_whole && !was_whole);
        // A part that is thrown flies over whatever is below.
        let is_thrown = was_whole && !is_whole;
        for (k, (was, at)) in before.iter().zip(body.chain.points()).enumerate() {
            let from = if is_thrown { at } else { was };
            let gap_m = obstacles.clearance_m([*from, *at], 0.05, 1.0);
            assert!(gap_m > -1e-9, "{case}, cycle {}: {k} is {gap_m} m away", run.cycle());
        }
        for rod in body.chain.points().windows(2).filter(|_| is_whole) {
            assert!(obstacles.clearance_m([rod[0], rod[1]], 0.01, 1.0) > -1e-9, "{case}");
        }
        before.copy_from_slice(body.chain.points());
    }
    reformed
}

#[test]
fn parts_that_come_back_pass_through_nothing_and_the_chain_is_whole_only_where_there_is_room() {
    let mut reformed = 0;
    for seed in 1..=12 {
        let wall = "[[obstacles]]\nends_m = [[-1.2, 0.3], [-1.2, 30.0]]\nradius_m = 0.05";
        let field = "[[fields]]\nlo_m = [-3.5, -1.5]\nhi_m = [1.0, 1.5]\npart = 0.06\nradius_m = 0.08\nkeep_m = 0.02";
        for (more, by_m) in [(wall, 2.0), (field, 0.5), ("", 1.0)] {
            let text = broken("1.5", by_m, more).replace("seed = 3", &format!("seed = {seed}"));
            let case = format!("{seed} {by_m}");
            reformed += assert_nothing_is_passed(&mut run(&text), 1500, &case);
        }
    }
    assert!(reformed >= 12, "{reformed}");
}

#[test]
fn parts_that_something_keeps_from_coming_back_are_told_with_what_it_is() {
    let room = closed_room();
    let told_of = |seed: u32| {
        let text = broken("1.5", 2.0, &room).replace("seed = 3", &format!("seed = {seed}"));
        let mut run = run(&text);
        let events = told(&mut run, 1500);
        (count(&events, "not-reformed"), run.metrics().not_reformed, run.is_over())
    };
    let all: Vec<_> = (1..=12).map(told_of).collect();
    assert!(all.iter().any(|(told, ..)| *told == 1), "{all:?}");
    assert!(
        all.iter().all(|(told, counted, is_over)| {
            *told as u64 == *counted && (*told == 0) == *is_over
        })
    );
}

/// Nothing but the wait goes on, so it alone tells two of these states apart.
#[test]
fn the_time_for_which_scattered_parts_have_waited_is_a_part_of_the_state() {
    let room = closed_room();
    let stuck = |seed: u32| {
        let text = broken("1.5", 2.0, &room).replace("seed = 3", &format!("seed = {seed}"));
        let events = told(&mut run(&text), 1500);
        let is_stuck = ["reforming", "not-reformed"].iter().all(|kind| count(&events, kind) == 1);
        is_stuck.then_some(text)
    };
    let text = (1..=12).find_map(stuck).expect("a chain that something keeps from coming together");
    let mut whole = run(&text);
    while whole.metrics().not_reformed == 0 {
        whole.advance(1);
    }
    let ends = whole.cycle();
    let mut run = run(&text);
    run.advance(ends - 100);
    let [before, after] = [0, 1].map(|cycles| {
        run.advance(cycles);
        Snapshot { cycle: 0, ..run.state().snapshot(0) }
    });
    assert_eq!(before.chains[0].points_m, after.chains[0].points_m, "nothing moves");
    assert_ne!(before.digest(), after.digest());

    // Also without its counts a chain that is restored gives up when it would have.
    let world = run.world();
    let state = ChainWorldState::restore(world, &after, vec![ChainTally::default()])
        .expect("its own state");
    let waited = |state: &ChainWorldState<2>| state.body(0).scattered.as_ref().map(|s| s.waited);
    assert!(waited(&state).is_some_and(|cycles| cycles > 100), "{:?}", waited(&state));
    assert_eq!(waited(&state), waited(run.state()));
    let told = run.agent_metrics().to_string();
    assert!(told.contains("\"not_reformed\"") && !told.contains("reform_waits"), "{told}");
}

#[test]
fn parts_that_come_back_stay_in_the_claim_of_their_chain_from_the_first_cycle_on() {
    let fast = "changes = [{ at_s = 1.0, scatter = [1, 4], by_m = 0.001 }, { at_s = 1.0, reform = true, speed_m_s = 50.0 }]";
    let text = format!(
        "seed = 1\ncycles = 100\n[[chains]]\nconnectors = 6\nrod_m = 0.5\n\
         tasks = [{{ kind = \"rest\", lasts_s = 2.0 }}]\n{fast}\n\
         [[chains]]\nconnectors = 2\nat_m = [0.0, 9.0]\nrod_m = 0.5\ntasks = [{{ kind = \"rest\" }}]\n"
    );
    let mut run = run(&text);
    run.advance(51);
    let (claim, body) = (run.state().claim(0), run.state().body(0));
    let way_m = 50.0 * run.world().dt_s;
    assert!(claim.lo[1] <= -way_m && claim.hi[1] >= way_m, "{claim:?}: {way_m} m a cycle");
    assert!(body.chain.points().iter().all(|p| claim.lo[1] <= p[1] && p[1] <= claim.hi[1]));
}

/// A chain of 31 connectors, four of which are thrown among balls; with `may_come` the end behind them comes, too.
fn scattered_among_balls(seed: u64, balls: u32, may_come: &str) -> String {
    let mut draws = Streams::new(Seed(seed)).draws(balls, 0, Purpose(1));
    let mut obstacles = String::new();
    for _ in 0..balls {
        let x = -10.0 + 7.0 * draws.uniform();
        // Beside the chain, which lies along the first axis.
        let side = if draws.uniform() < 0.5 { -1.0 } else { 1.0 };
        let y = side * (0.65 + 2.0 * draws.uniform());
        obstacles += &format!("[[obstacles]]\nat_m = [{x}, {y}]\nradius_m = 0.5\n");
    }
    let apart_m = if may_come == "nobody" { "[0.0, 0.0]" } else { "[-1.0, 0.0]" };
    format!(
        "seed = {seed}\ncycles = 3000\n[chain]\ndt_s = 0.02\nself_collision = false\n{obstacles}[[chains]]\n\
         connectors = 31\nrod_m = [0.4, 0.5]\nradius_m = 0.05\nrod_radius_m = 0.02\n\
         tasks = [{{ kind = \"rest\", lasts_s = 3.0 }}]\n\
         changes = [{{ at_s = 0.5, scatter = [12, 15], by_m = 3.0, apart_m = {apart_m} }}, \
         {{ at_s = 2.0, reform = true, may_come = \"{may_come}\" }}]\n"
    )
}

#[test]
fn parts_and_ends_find_their_ways_around_what_stands_between() {
    for (balls, may_come) in [(1, "nobody"), (6, "nobody"), (3, "last")] {
        for seed in 1..=8 {
            let text = scattered_among_balls(seed, balls, may_come);
            let case = format!("{balls} balls, {may_come}, seed {seed}");
            let reformed = assert_nothing_is_passed(&mut run(&text), 3000, &case);
            assert_eq!(reformed, 1, "{case}");
        }
    }
}

#[test]
fn a_chain_is_joined_where_no_obstacle_is_though_its_parts_would_be_nearer_elsewhere() {
    // Where the passes would join it, seeds 1 to 4: a chain that lies on one line has its new places on it.
    for seed in 1..=4 {
        let on_line = "[[obstacles]]\nat_m = [-1.25, 0.12]\nradius_m = 0.05\n";
        let text = broken("1.5", 0.1, on_line).replace("seed = 3", &format!("seed = {seed}"));
        let text = text.replace("rod_m = [0.4, 0.5]", "rod_m = [0.3, 0.6]\nradius_m = 0.02");
        let reformed = assert_nothing_is_passed(&mut run(&text), 1500, &format!("{seed}"));
        assert_eq!(reformed, 1, "seed {seed}");
    }
}

/// A run that resumes forgets no way: parts that set out again straight would wait at the first ball.
#[test]
fn ways_of_parts_are_a_part_of_the_state() {
    let way_points = |state: &ChainWorldState<2>| {
        state.body(0).scattered.as_ref().map(|s| s.way_points_m.clone()).unwrap_or_default()
    };
    let on_the_way = |seed: u64| {
        let mut run = run(&scattered_among_balls(seed, 6, "nobody"));
        run.advance(120);
        (!way_points(run.state()).is_empty()).then_some(run)
    };
    let mut whole = (1..=8).find_map(on_the_way).expect("parts that go around a ball");
    let snapshot = whole.state().snapshot(120);
    let restored = |snapshot: &Snapshot| {
        ChainWorldState::restore(whole.world(), snapshot, vec![ChainTally::default()])
    };
    let state = restored(&snapshot).expect("its own state");
    assert_eq!(way_points(&state), way_points(whole.state()));

    let mut without = snapshot.clone();
    without.gathering.clear();
    assert_ne!(without.digest(), snapshot.digest());
    for damaged in [vec![vec![0.0, 0.0]], vec![vec![0.0]; 6]] {
        let mut other = snapshot.clone();
        other.gathering[0].1.way_points_m = damaged;
        assert!(restored(&other).is_err(), "ways of another chain");
    }
    whole.advance(2000);
    assert_eq!(whole.metrics().reformed, 1);
}
