use super::*;
use crate::tick_planner::TickSituation;
use std::collections::BTreeSet;

/// A floor with pillars, agents in its first rows, and tasks all over it.
fn crowd(agents: u32, policy: TaskPolicy) -> (Lifelong, LifelongState) {
    let free = FreeSpace::new(12, 10, |col, row| col % 3 != 1 || row % 4 != 2);
    let starts: Vec<_> = (0..120).map(|index| (index % 12, index / 12)).collect();
    let starts: Vec<_> = starts.into_iter().filter(|&(col, row)| free.is_free(col, row)).collect();
    let place = |index: u32| starts[(index * 37) as usize % starts.len()];
    let tasks: Vec<_> = (0..90).map(|task| vec![place(task), place(task * 5 + 3)]).collect();
    let starts = &starts[..agents as usize];
    let config = LifelongConfig { policy, ..LifelongConfig::default() };
    Lifelong::new(&free, starts, &tasks, agents as usize * 2, config).expect("a free floor")
}

/// The delays of a tick: every so often, one agent after the other.
fn delays(tick: u64, agents: usize) -> Vec<(usize, u32)> {
    if tick.is_multiple_of(3) {
        vec![(tick as usize * 7 % agents, 1 + tick as u32 % 9)]
    } else {
        Vec::new()
    }
}

#[test]
fn no_box_is_held_twice_whatever_the_delays_and_tasks_are_finished_by_each_policy() {
    for policy in [TaskPolicy::Nearest, TaskPolicy::Fifo, TaskPolicy::Optimal { window: 16 }] {
        let (mut lifelong, mut state) = crowd(25, policy);
        for tick in 0..1500 {
            lifelong.tick(&mut state, &delays(tick, 25));
            let mut held = BTreeSet::new();
            for agent in &state.agents {
                assert!(held.insert(agent.at), "{policy:?}, tick {tick}");
                assert!(agent.to == agent.at || held.insert(agent.to), "{policy:?}, tick {tick}");
            }
        }
        assert!(state.tasks.finished > 150, "{policy:?}: {}", state.tasks.finished);
    }
}

#[test]
fn an_action_takes_its_ticks_and_those_of_a_delay() {
    let free = FreeSpace::new(5, 1, |_, _| true);
    let arrival = |delays: &[(usize, u32)]| {
        let tasks = [vec![(4, 0)]];
        let config = LifelongConfig::default();
        let made = Lifelong::new(&free, &[(0, 0)], &tasks, 1, config);
        let (mut lifelong, mut state) = made.expect("a free floor");
        while state.tasks.finished == 0 {
            let delays = if state.tick == 4 { delays } else { &[] };
            lifelong.tick(&mut state, delays);
        }
        // It is noted at the start of the next tick.
        state.tick - 1
    };
    assert_eq!((arrival(&[]), arrival(&[(0, 7)])), (12, 19));
}

#[test]
fn a_state_that_was_kept_goes_on_as_the_run_itself() {
    let (mut lifelong, mut state) = crowd(20, TaskPolicy::Nearest);
    for tick in 0..200 {
        lifelong.tick(&mut state, &delays(tick, 20));
    }
    let (mut other, _) = crowd(20, TaskPolicy::Nearest);
    let mut copy = state.clone();
    other.resume(&copy);
    for tick in 200..400 {
        lifelong.tick(&mut state, &delays(tick, 20));
        other.tick(&mut copy, &delays(tick, 20));
    }
    assert_eq!(copy, state);
}

#[test]
fn agents_go_around_walls_although_the_steps_from_each_box_do_not_fit() {
    // A wall of 80 boxes with a gap at its end, and the goal right behind its middle.
    let free = FreeSpace::new(100, 90, |col, row| col != 50 || row > 79);
    let arrival = |max_field_bytes: usize| {
        let config = LifelongConfig { max_field_bytes, ..LifelongConfig::default() };
        let made = Lifelong::new(&free, &[(48, 40)], &[vec![(52, 40)]], 1, config);
        let (mut lifelong, mut state) = made.expect("a free floor");
        assert!(lifelong.plans_around_walls());
        while state.tasks.finished == 0 && state.tick < 1_000 {
            lifelong.tick(&mut state, &[]);
        }
        state.tick
    };
    let best = arrival(1 << 20);
    let by_regions = arrival(20_000);
    assert!((best..best * 5 / 4).contains(&by_regions), "{by_regions} for {best}");
}

#[test]
fn the_box_that_an_agent_wants_after_its_action_is_kept_for_it() {
    let free = FreeSpace::new(6, 2, |_, _| true);
    let mut planner = TickPlanner::new(&free, 2, 3, Seed(0), 1 << 20);
    let agent = |at: (u32, u32), heading: u8, ticks_left: u32, age: u32| {
        let at = planner.box_number(at);
        LifelongAgent { at, to: at, heading, ticks_left, delay: 0, age }
    };
    // The first one turns to the east; the second one looks at the box that the first one comes to next.
    let turning = agent((0, 0), 0, 1, 9);
    let second = agent((1, 1), 3, 0, 0);
    let goals = [Some((5, 0)), Some((1, 0))];
    let mut action = |agents: &[LifelongAgent; 2]| {
        planner.step(TickSituation { tick: 0, agents, goals: &goals, others: &[] })[1]
    };
    assert_eq!(action(&[turning, second]), Action::Wait);
    let late = LifelongAgent { delay: 5, ..turning };
    assert_eq!(action(&[late, second]), Action::Forward);
}
