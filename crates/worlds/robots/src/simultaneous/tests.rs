//! The policy `simultaneous`: all transitions of a group are drawn, then made at once. A box that is left can be
//! entered in the same cycle, swaps fail, rings rotate, of two that want a box exactly one gets it, and whoever is
//! blocked stays with a contact that says whom it met.

use crate::RobotsRun;
use crate::scenario::{Behaviours, Compiled, StorageOrder};
use proptest::prelude::*;
use sidestep_kernel::Simulation;
use sidestep_scenario::Source;

fn compiled(source: &Source) -> Result<Compiled, sidestep_kernel::InputError> {
    Compiled::new(source, &Behaviours::new(), StorageOrder::Spatial)
}

/// A run that always uses all its workers.
fn simulation(text: &str, workers: usize) -> RobotsRun {
    let source = Source::new("test", text, "");
    let mut run = compiled(&source).unwrap_or_else(|e| panic!("{e}")).start(&source, workers);
    run.force_parallel();
    run
}

/// Returns a run of robots that go forward again and again, from places with a heading.
fn forward_run(map: &str, robots: &str, more: &str) -> RobotsRun {
    let text = format!(
        "format = 1\nworld = \"robots\"\nconflict_policy = \"simultaneous\"\n\
         [map]\nascii = \"\"\"\n{map}\n\"\"\"\n[robots]\nat = {robots}\n\
         behaviour = {{ kind = \"replay\", actions = [\"forward\"], repeat = true }}\n{more}"
    );
    simulation(&text, 1)
}

fn advance_audited(run: &mut RobotsRun) {
    run.advance(1);
    run.world().audit(run.state()).unwrap_or_else(|e| panic!("cycle {}: {e}", run.cycle()));
}

fn places(run: &RobotsRun) -> Vec<(u32, u32)> {
    run.snapshot().bodies.iter().map(|body| body.at).collect()
}

/// Returns the kinds that the robots touched in their last action.
fn contacts(run: &RobotsRun) -> Vec<Option<u8>> {
    let robots = run.world().robots().iter();
    robots.map(|&id| run.state().body(id).contact.get().get().map(|c| c.kind)).collect()
}

#[test]
fn a_queue_moves_as_one_and_stays_as_one_behind_a_wall() {
    let mut run = forward_run("......", "[[0, 0, 0], [1, 0, 0], [2, 0, 0], [3, 0, 0]]", "");
    advance_audited(&mut run);
    assert_eq!(places(&run), [(1, 0), (2, 0), (3, 0), (4, 0)]);
    advance_audited(&mut run);
    assert_eq!(places(&run), [(2, 0), (3, 0), (4, 0), (5, 0)]);
    assert_eq!(contacts(&run), [None; 4]);
    advance_audited(&mut run);
    assert_eq!(places(&run), [(2, 0), (3, 0), (4, 0), (5, 0)]);
    let kinds = &run.world().kinds;
    let touched: Vec<&str> =
        contacts(&run).into_iter().map(|kind| &*kinds[usize::from(kind.expect("all"))]).collect();
    assert_eq!(touched, ["robot", "robot", "robot", "wall"]);
}

#[test]
fn two_head_on_robots_and_the_queues_behind_them_stay() {
    let mut run = forward_run("....", "[[0, 0, 0], [1, 0, 0], [2, 0, 2], [3, 0, 2]]", "");
    let start = places(&run);
    advance_audited(&mut run);
    assert_eq!(places(&run), start);
    assert!(contacts(&run).iter().all(Option::is_some));
}

/// Each robot goes as far as it is wide: one step alone would still cover a box that the one behind wants.
#[test]
fn rings_of_robots_of_all_sizes_rotate() {
    for size in 1..=3 {
        let side = 2 * size;
        let map = vec![".".repeat(side); side].join("\n");
        // Counterclockwise, each toward the next.
        let robots = format!("[[0, 0, 0], [{size}, 0, 1], [{size}, {size}, 2], [0, {size}, 3]]");
        let path = "F".repeat(size);
        let more = format!(
            "size = {size}\neffector = \"far\"\n[effectors.far]\nforward = [{{ p = 1.0, path = \"{path}\" }}]\n"
        );
        let mut run = forward_run(&map, &robots, &more);
        advance_audited(&mut run);
        assert_eq!(contacts(&run), [None; 4], "size {size}");
        let size = size as u32;
        assert_eq!(places(&run), [(size, 0), (size, size), (0, size), (0, 0)]);
    }
}

#[test]
fn a_ring_rotates_past_one_that_wants_to_enter_it() {
    let robots = "[[1, 0, 0], [2, 0, 1], [2, 1, 2], [1, 1, 3], [0, 0, 0]]";
    let mut run = forward_run("....\n....", robots, "");
    advance_audited(&mut run);
    assert_eq!(places(&run), [(2, 0), (2, 1), (1, 1), (1, 0), (0, 0)]);
}

/// 400 fair draws; fewer than 140 or more than 260 fall to one side with probability 2e-9. Seeds are fixed.
#[test]
fn of_two_that_want_a_box_exactly_one_gets_it_by_a_fair_draw() {
    let mut first = 0;
    for seed in 0..400 {
        let text = format!(
            "format = 1\nworld = \"robots\"\nseed = {seed}\nconflict_policy = \"simultaneous\"\n\
             [map]\nascii = \"...\"\n[robots]\nat = [[0, 0, 0], [2, 0, 2]]\n\
             behaviour = {{ kind = \"replay\", actions = [\"forward\"] }}\n"
        );
        let mut run = simulation(&text, 1);
        advance_audited(&mut run);
        let moved: Vec<u32> = (0..2).map(|id| run.state().body(id).moves.get()).collect();
        assert_eq!(moved.iter().sum::<u32>(), 1, "seed {seed}");
        first += moved[0];
        let contacts = contacts(&run);
        assert_eq!(contacts.iter().filter(|contact| contact.is_some()).count(), 1, "seed {seed}");
    }
    assert!((140..=260).contains(&first), "{first}");
}

/// The one ahead slips on through the box that a third one wants: only one of both may sweep it.
#[test]
fn a_box_is_closed_to_others_once_it_was_passed_through() {
    let slips = "effector = \"slips\"\n[effectors.slips]\nforward = [{ p = 1.0, path = \"FF\" }]\n";
    for seed in 0..40 {
        // The second wants a box through which the first passes.
        let robots = "[[0, 1, 0], [1, 2, 3]]";
        let text =
            format!("[map]\nascii = \"\"\"\n...\n...\n...\n\"\"\"\n[robots]\nat = {robots}\n");
        let text = format!(
            "format = 1\nworld = \"robots\"\nseed = {seed}\nconflict_policy = \"simultaneous\"\n{text}\
             behaviour = {{ kind = \"replay\", actions = [\"forward\"] }}\n{slips}"
        );
        let mut run = simulation(&text, 1);
        advance_audited(&mut run);
        let moved: Vec<u32> = (0..2).map(|id| run.state().body(id).moves.get()).collect();
        assert!(moved == [2, 0] || moved == [0, 2], "seed {seed}: {moved:?}");
    }
}

/// Under `renormalise` only what cannot make room strikes a transition out.
#[test]
fn a_follower_under_renormalise_draws_as_if_the_one_ahead_had_left() {
    let text = "format = 1\nworld = \"robots\"\nconflict_policy = \"simultaneous\"\nobstacle_rule = \"renormalise\"\n\
        [map]\nascii = \"....\"\n[robots]\nat = [[0, 0, 0], [1, 0, 0]]\neffector = \"lazy\"\n\
        behaviour = { kind = \"replay\", actions = [\"forward\"] }\n\
        [effectors.lazy]\nforward = [{ p = 1.0, path = \"F\" }, { p = 0.0 }]\n";
    let mut run = simulation(text, 1);
    advance_audited(&mut run);
    assert_eq!(places(&run), [(1, 0), (2, 0)]);
}

#[test]
fn a_door_opens_before_the_moves_and_closes_after_them() {
    let doors = "[doors]\nat = [[1, 0]]\nperiodic = { open = 1, closed = 2, phase = 0 }\n";
    let mut run = forward_run("...", "[[0, 0, 0]]", doors);
    // In cycle 0 the door opens and the robot enters; it leaves in cycle 1, in which the door wants to close.
    advance_audited(&mut run);
    assert_eq!(places(&run)[0], (1, 0));
    advance_audited(&mut run);
    assert_eq!(places(&run)[0], (2, 0));
    assert!(!run.snapshot().bodies[1].facing.is_open(), "the robot has left it in the same cycle");
}

/// Single steps of robots of one box: nobody swaps, and whoever is blocked has something before it.
#[test]
fn nobody_swaps_and_nobody_is_stopped_by_a_box_that_stays_free() {
    let map = vec![".".repeat(9); 9].join("\n");
    let text = format!(
        "format = 1\nworld = \"robots\"\nconflict_policy = \"simultaneous\"\n[map]\nascii = \"\"\"\n{map}\n\"\"\"\n\
         [robots]\ncount = 55\nbehaviour = {{ kind = \"random\", weights = {{ forward = 5, left = 1, right = 1 }} }}\n"
    );
    let mut run = simulation(&text, 2);
    let mut contacts = 0;
    let mut followed = 0;
    for _ in 0..400 {
        let before = places(&run);
        advance_audited(&mut run);
        let after = places(&run);
        for (id, (&from, &to)) in (0..).zip(before.iter().zip(&after)) {
            if let Some(other) = before.iter().position(|&at| at == to && at != from) {
                assert_ne!(after[other], from, "robots {id} and {other} swap");
                followed += 1;
            }
            let body = run.state().body(id);
            if body.contact.get().get().is_some() {
                contacts += 1;
                let [dx, dy] =
                    [[1, 0], [0, 1], [-1, 0], [0, -1]][usize::from(body.facing.get().heading())];
                let ahead = (from.0 as i32 + dx, from.1 as i32 + dy);
                let is_inside = [ahead.0, ahead.1].iter().all(|k| (0..9).contains(k));
                let is_taken = after.contains(&(ahead.0 as u32, ahead.1 as u32));
                assert!(!is_inside || is_taken, "robot {id} was stopped by a free box");
            }
        }
    }
    assert!(contacts > 1000 && followed > 500, "{contacts} contacts, {followed} followed");
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, ..ProptestConfig::default() })]

    /// Crowds of robots of 1 to 3 boxes a side with all errors, people of two shapes, doors: no two share a box, and
    /// every number of workers gives the same bits.
    #[test]
    fn no_two_bodies_share_a_box_and_workers_leave_no_trace(
        walls in prop::collection::vec(0u8..12, 14 * 14),
        seed in 0u64..1000,
        counts in [0u32..20, 0u32..6, 0u32..4, 0u32..8, 0u32..3],
        law in prop::sample::select(vec!["cut", "stay", "renormalise"]),
        periods in [1u32..3, 1u32..3],
    ) {
        let rows: Vec<String> = walls
            .chunks(14)
            .map(|row| row.iter().map(|&w| if w == 0 { '#' } else { '.' }).collect())
            .collect();
        let [small, middle, large, people, wide] = counts;
        let [fast, slow] = periods;
        let text = format!(
            "format = 1\nworld = \"robots\"\nseed = {seed}\nconflict_policy = \"simultaneous\"\n\
             obstacle_rule = \"{law}\"\n[map]\nascii = \"\"\"\n{}\n\"\"\"\n\
             [[robots]]\ncount = {small}\nsensors = [\"sonar-8\"]\neffector = \"nomad\"\nperiod = {fast}\n\
             [[robots]]\ncount = {middle}\nsize = 2\neffector = \"wild\"\nperiod = {slow}\n\
             [[robots]]\ncount = {large}\nsize = 3\neffector = \"wild\"\n\
             [[people]]\ncount = {people}\n[[people]]\ncount = {wide}\nsize = [2, 1]\n\
             [[doors]]\nat = [[0, 13], [13, 0]]\nrandom = {{ p_open = 0.5, p_close = 0.5 }}\n\
             [effectors.wild]\nforward = [\n\
             {{ p = 0.4, path = \"F\" }}, {{ p = 0.1, path = \"FF\" }}, {{ p = 0.1, path = \"FL\" }},\n\
             {{ p = 0.1, path = \"FR\" }}, {{ p = 0.1, path = \"B\" }}, {{ p = 0.1, path = \"FFLB\", turn = 180 }},\n\
             {{ p = 0.1, path = \"FB\" }} ]\n",
            rows.join("\n")
        );
        prop_assume!(compiled(&Source::new("test", text.as_str(), "")).is_ok());
        let digest_with = |workers| {
            let mut run = simulation(&text, workers);
            (0..25).for_each(|_| advance_audited(&mut run));
            run.digest()
        };
        let alone = digest_with(1);
        for workers in [2, 3, 8] {
            prop_assert_eq!(digest_with(workers), alone);
        }
    }
}
