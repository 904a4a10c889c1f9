mod maneuvers;

use crate::external_action::ExternalAction;
use crate::flight::{KnownAircraft, Pose2, distance_m};
use crate::non_cooperative::NonCooperativeAircraft;
use crate::trace::InspectionTrace;
use crate::{AirspaceRun, Scratch, airspace_run};
use sidestep_kernel::control::{AgentTeam, BufferMut, MultiAgentOrder, OrderLog};
use sidestep_kernel::math::cos;
use sidestep_kernel::ports::{MemoryRecorder, Recorder};
use sidestep_kernel::{Cycle, EntitySlot, Simulation};
use sidestep_scenario::Source;
use std::collections::BTreeMap;

const CYCLES: u64 = 50;

/// Five airplanes that meet, and five of which one turns slower and comes later, one has orders of its flight plan,
/// one minds no other, and two are recorded: one until the method takes over, one to the end of its track. Positions
/// and headings have errors.
const MIXED: &str = r#"
format = 1
world = "airspace"
seed = 5
cycles = 50
[airspace]
method = "external"
position_noise_m = 5.0
heading_noise_deg = 0.2
wind_m_s = [3.0, -2.0]
replay_until_s = 40.0
[airspace.generator]
kind = "superconflict"
n = 5
radius_m = 4000.0
[[airplanes]]
at_m = [5000, 500]
heading_deg = 180
way_points_m = [[0, 3000], [-5000, 500]]
omega_max_deg_s = 3.0
appears_s = 60.0
[[airplanes]]
at_m = [-5000, -2000]
heading_deg = 0
way_points_m = [[5000, -2000]]
orders = [{ at_s = 50.0, heading_deg = 45.0 }, { at_s = 70.0, speed_m_s = 40.0 }, { at_s = 80.0, proceeds = true }]
[[airplanes]]
at_m = [0, 6000]
heading_deg = -90
way_points_m = [[0, -9000]]
intruder = true
[[airplanes]]
track = [[0, -2000, 4000, 0], [200, 5000, 4000, 0]]
[[airplanes]]
track = [[0, 2000, -3000, 0], [30, 3000, -3000, 0]]
"#;

fn source(text: &str) -> Source {
    Source::new("s.toml", text, "")
}

fn run_of(text: &str, workers: usize) -> AirspaceRun {
    let mut run = airspace_run(&source(text), workers).unwrap_or_else(|e| panic!("{e}"));
    run.force_parallel();
    run
}

fn run(workers: usize) -> AirspaceRun {
    run_of(MIXED, workers)
}

/// Returns the observations of a team: one vector per space, as real numbers.
fn observed(run: &dyn Simulation, team: usize) -> BTreeMap<String, Vec<f64>> {
    let AgentTeam { agents, observation_spaces: observed, .. } = &run.agent_teams()[team];
    let width = |k: usize| observed[k].value_count() * agents.len();
    // Filled with something, because all of it must be written.
    let mut whole: Vec<_> = (0..observed.len()).map(|k| vec![77; width(k)]).collect();
    let mut real: Vec<_> = (0..observed.len()).map(|k| vec![f64::NAN; width(k)]).collect();
    let rooms = observed.iter().zip(whole.iter_mut().zip(&mut real));
    let mut rooms: Vec<BufferMut<'_>> = rooms
        .map(|(space, (whole, real))| match space.is_integer() {
            true => BufferMut::Integer(whole),
            false => BufferMut::Real(real),
        })
        .collect();
    run.observe(team, &mut rooms).expect("the room fits");
    let values = observed.iter().zip(whole.into_iter().zip(real)).map(|(space, (whole, real))| {
        let values: Vec<f64> = match space.is_integer() {
            true => whole.into_iter().map(|value| value as f64).collect(),
            false => real,
        };
        assert!(values.iter().all(|&value| space.contains(value)), "{}: {values:?}", space.name);
        (space.name.clone(), values)
    });
    values.collect()
}

/// A policy that depends on all it observes, and orders in all forms; an airplane that is alone gets no order.
fn order_all(run: &mut AirspaceRun) {
    for (k, team) in run.agent_teams().to_vec().iter().enumerate() {
        let seen = observed(run, k);
        for (row, &agent) in team.agents.iter().enumerate() {
            let one = |name: &str, part: usize| {
                seen[name][row * seen[name].len() / team.agents.len() + part]
            };
            if one("neighbors", 0) == 0.0 {
                continue;
            }
            let [x, y] = [0, 1].map(|part| one("neighbor_place_m", part));
            let actions = team.action_spaces[0].value_count();
            let first = (one("delay_s", 0).abs() + x.abs()) as usize % actions;
            let ranking: Vec<f64> = (0..actions).map(|k| ((first + k) % actions) as f64).collect();
            let turn = -0.5 * one("turn_rate_rad_s", 0) + 0.01 * cos(one("heading_rad", 0));
            let (order, values) = match (run.cycle() as usize + row) % 3 {
                0 => (ExternalAction::RANKING, ranking),
                1 => (ExternalAction::TURN_RATE, vec![turn]),
                _ => (ExternalAction::VELOCITY, vec![-x, y]),
            };
            run.order(&MultiAgentOrder { order, agents: &[agent], values: &values })
                .expect("right");
        }
    }
}

fn decided(run: &mut AirspaceRun, cycles: u64) {
    for _ in 0..cycles {
        order_all(run);
        run.advance(1);
    }
}

/// The book of all orders that were recorded.
fn book(recorder: &MemoryRecorder) -> OrderLog {
    OrderLog::from_recorder(recorder).expect("orders are recorded")
}

fn recorded(
    run: &mut AirspaceRun,
    until: Cycle,
    go_on: impl Fn(&mut AirspaceRun),
) -> MemoryRecorder {
    run.start_recording();
    let mut recorder = MemoryRecorder::new(&run.schemas());
    while run.cycle() < until {
        go_on(run);
        run.record(&mut recorder).expect("memory suffices");
    }
    recorder.finish().expect("memory suffices");
    recorder
}

#[test]
fn a_run_is_the_same_from_its_recorded_orders_whatever_the_workers() {
    let mut first = run(1);
    let rows = recorded(&mut first, CYCLES, |run| decided(run, 7.min(CYCLES - run.cycle())));
    let orders = book(&rows);
    assert!(orders.iter().count() > 100, "{}", orders.iter().count());
    for workers in [1, 2, 3, 8] {
        let mut again = run(workers);
        again.replay_orders(orders.clone()).expect("they were obeyed once");
        let its = recorded(&mut again, CYCLES, |run| {
            run.advance(CYCLES - run.cycle());
        });
        assert_eq!(again.digest(), first.digest(), "{workers} workers");
        assert_eq!(again.collector().counters, first.collector().counters, "{workers} workers");
        assert_eq!(book(&its), orders, "{workers} workers");
    }
}

#[test]
fn a_run_that_is_resumed_at_any_cycle_goes_on_with_the_order_that_was_given() {
    let mut whole = run(1);
    for at in 0..CYCLES {
        // The policy sees the state of the checkpoint: an order is given, and lies in it.
        order_all(&mut whole);
        let checkpoint = whole.checkpoint();
        let mut after = run(2);
        after.restore(&checkpoint).expect("the same scenario");
        assert_eq!(after.digest(), whole.digest(), "restored at {at}");
        whole.advance(1);
        after.advance(1);
        decided(&mut after, 2);
        let mut before = run(1);
        before.restore(&whole.checkpoint()).expect("the same scenario");
        decided(&mut before, 2);
        assert_eq!(after.digest(), before.digest(), "resumed at {at}");
    }
}

#[test]
fn going_back_gives_the_same_orders_again() {
    let mut first = run(1);
    let rows = recorded(&mut first, CYCLES, |run| decided(run, CYCLES));
    let mut again = run(1);
    again.replay_orders(book(&rows)).expect("they were obeyed once");
    again.advance(20);
    let checkpoint = again.checkpoint();
    for _ in 0..3 {
        again.restore(&checkpoint).expect("its own");
        again.advance(CYCLES - 20);
        assert_eq!(again.digest(), first.digest());
    }
}

/// Returns the knowledge of an airplane's group when it decides in the present cycle; nothing if
/// the airplane does not.
fn known_in(
    run: &AirspaceRun,
    id: EntitySlot,
) -> (Vec<KnownAircraft>, Vec<NonCooperativeAircraft>) {
    let (world, now) = (run.world(), run.cycle());
    let copy = crate::state::AirspaceState::restore(world, &run.state().snapshot(now));
    let notes = Some(Box::new(InspectionTrace { slot: id, ..InspectionTrace::default() }));
    let mut scratch = Scratch { trace: notes, ..Scratch::default() };
    world.run_group_cycle(&copy, now, id, &mut scratch);
    let notes = *scratch.trace.take().expect("they were put there");
    (notes.group, notes.non_cooperative)
}

/// Values of one airplane's row.
type Row<'a> = &'a dyn Fn(&str, usize) -> f64;

/// Compares an airplane's observation of itself with the knowledge of its group.
fn compare_own(run: &AirspaceRun, of: Row<'_>, me: &KnownAircraft) {
    let Pose2 { at: [x, y], heading_rad } = me.pose;
    let pose = [of("place_m", 0), of("place_m", 1), of("heading_rad", 0)];
    assert_eq!(pose, [x, y, heading_rad]);
    let segment = run.world().segment(me.slot, me.orders);
    assert_eq!(of("speed_m_s", 0), segment.model.v_m_s);
    assert_eq!(of("way_points_left", 0), (segment.mission.len() - me.next) as f64);
    let [goal_x, goal_y] = segment.mission[me.next];
    assert_eq!([of("way_point_m", 0), of("way_point_m", 1)], [goal_x - x, goal_y - y]);
}

/// Compares an airplane's observation of others with the knowledge of its group; returns how many there are that mind
/// others, and that do not.
fn compare_others(
    of: Row<'_>,
    me: &KnownAircraft,
    group: &[KnownAircraft],
    non_cooperative: &[NonCooperativeAircraft],
) -> [usize; 2] {
    let [x, y] = me.pose.at;
    let flying = group.iter().map(|known| (known.slot, known.pose.at, true));
    let minding_nobody = non_cooperative.iter().map(|one| (one.slot, one.at, false));
    let others = flying.chain(minding_nobody).filter(|(slot, ..)| *slot != me.slot);
    let mut near: Vec<_> = others.collect();
    near.sort_by(|a, b| distance_m(a.1, [x, y]).total_cmp(&distance_m(b.1, [x, y])));
    assert_eq!(of("neighbors", 0), near.len() as f64);
    for (k, &(slot, [their_x, their_y], minds)) in near.iter().enumerate() {
        assert_eq!(of("neighbor_id", k), f64::from(slot));
        let place = [2 * k, 2 * k + 1].map(|part| of("neighbor_place_m", part));
        assert_eq!(place, [their_x - x, their_y - y]);
        assert_eq!(of("neighbor_minds", k), f64::from(minds));
    }
    [group.len() - 1, non_cooperative.len()]
}

#[test]
fn what_is_observed_is_what_the_group_knows_when_it_decides() {
    let mut run = run(1);
    let (mut own, mut minding, mut minding_nobody) = (0, 0, 0);
    for _ in 0..CYCLES {
        for team in 0..run.agent_teams().len() {
            let (seen, agents) = (observed(&run, team), run.agent_teams()[team].agents.clone());
            for (row, &id) in agents.iter().enumerate() {
                let (group, non_cooperative) = known_in(&run, id);
                let width = |name: &str| seen[name].len() / agents.len();
                let of = |name: &str, part: usize| seen[name][row * width(name) + part];
                let me = group.iter().find(|known| known.slot == id);
                assert_eq!(of("due", 0), f64::from(me.is_some()));
                let Some(me) = me else {
                    assert_eq!([of("neighbors", 0), of("neighbor_id", 0)], [0.0, -1.0]);
                    continue;
                };
                compare_own(&run, &of, me);
                let [some, more] = compare_others(&of, me, &group, &non_cooperative);
                (own, minding, minding_nobody) = (own + 1, minding + some, minding_nobody + more);
            }
        }
        decided(&mut run, 1);
    }
    assert!(own > 150 && minding > 300 && minding_nobody > 30, "{own} {minding} {minding_nobody}");
}

#[test]
fn looking_changes_nothing() {
    let (mut seen, mut unseen) = (run(1), run(1));
    for _ in 0..20 {
        observed(&seen, 0);
        seen.advance(1);
    }
    unseen.advance(20);
    assert_eq!(seen.digest(), unseen.digest());
}

#[test]
fn an_airplane_without_an_order_follows_its_flight_plan() {
    let straight = MIXED.replace("\"external\"", "\"none\"");
    let (mut free, mut left_alone) = (run_of(&straight, 1), run(1));
    free.advance(CYCLES);
    left_alone.advance(CYCLES);
    let airplanes = |run: &AirspaceRun| run.state().snapshot(0).airplanes;
    assert_eq!(airplanes(&left_alone), airplanes(&free));
}
