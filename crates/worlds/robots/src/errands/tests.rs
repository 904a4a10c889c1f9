//! A team with tasks does the errands of each in order, gets new ones without end, and is the same run on any number of
//! workers, resumed or not. What cannot be carried out is refused.

use crate::RobotsRun;
use crate::scenario::{Behaviours, Compiled, StorageOrder};
use crate::test_runs::run_in_order;
use sidestep_kernel::Simulation;
use sidestep_scenario::Source;

fn compile(
    text: &str,
    order: StorageOrder,
) -> Result<(Source, Compiled), sidestep_kernel::InputError> {
    let source = Source::new("test", text, "");
    let compiled = Compiled::new(&source, &Behaviours::new(), order)?;
    Ok((source, compiled))
}

fn run(text: &str) -> RobotsRun {
    run_in_order(text, 1, StorageOrder::Spatial)
}

/// One robot in a corridor, with these tasks.
fn corridor(tasks: &str) -> String {
    format!(
        "format = 1\nworld = \"robots\"\n[map]\nascii = \".....#..\"\n[robots]\nat = [[0, 0, 0]]\n\
         planner = {{ method = \"pibt\" }}\ntasks = {tasks}\n"
    )
}

/// Twelve robots between shelves, some of them late, with a person among them.
fn shelves(policy: &str) -> String {
    format!(
        "format = 1\nworld = \"robots\"\nseed = 3\n[map]\nascii = \"\"\"\n\
         ...............\n...............\n.###.#####.###.\n...............\n...............\n\
         .###.#####.###.\n...............\n\"\"\"\n\
         [[robots]]\ncount = 12\naction_cycles = 3\neffector = \"w\"\nplanner = {{ method = \"pibt\" }}\n\
         [robots.tasks]\nreveal = 1.5\npolicy = \"{policy}\"\n\
         list = [[[0, 0], [14, 4]], [[7, 2]], [[14, 0], [0, 4], [4, 1]], [[2, 2], [10, 3]], [[9, 0], [4, 4]]]\n\
         [people]\ncount = 1\n[effectors.w]\nforward = [{{ p = 0.95, path = \"F\" }}, {{ p = 0.05 }}]\n\
         [effectors.w.delays]\np = 0.05\nper = \"cycle\"\nmin = 1\nmax = 4\n"
    )
}

#[test]
fn a_robot_does_its_errands_in_order_and_a_task_is_a_trip() {
    let mut run = run(&corridor("{ list = [[[3, 0], [1, 0]], [[2, 0]]] }"));
    let mut finished = Vec::new();
    for _ in 0..30 {
        run.advance(1);
        finished.push((
            run.state().body(0).position().col() - run.world().border,
            run.metrics().tasks_finished,
        ));
    }
    // Three steps, two turns, two steps back; then two turns and a step to the next one.
    assert_eq!(finished[2], (3, 0));
    assert_eq!(finished[6], (1, 0));
    assert_eq!(finished[7].1, 1, "it is noted before the next cycle");
    assert_eq!(finished.iter().position(|&(_, tasks)| tasks == 2), Some(10), "{finished:?}");
    let metrics = run.metrics();
    assert_eq!(metrics.tasks_open, 1);
    assert_eq!(metrics.total.trips, metrics.tasks_finished);
    assert_eq!(metrics.total.trips_under_way, 1);
    assert!(metrics.total.trip_cycles_mean.is_some_and(|mean| mean > 3.0 && mean < 8.0));
}

#[test]
fn tasks_are_the_same_bits_on_any_number_of_workers_in_any_storage_and_resumed() {
    for policy in ["nearest", "fifo", "optimal"] {
        let text = shelves(policy);
        let mut one = run(&text);
        one.advance(600);
        assert!(one.metrics().tasks_finished > 10, "{policy}: {}", one.metrics().tasks_finished);
        assert_eq!(one.metrics().tasks_open, 18, "{policy}");
        for (workers, order) in [
            (2, StorageOrder::Spatial),
            (3, StorageOrder::Spatial),
            (8, StorageOrder::Spatial),
            (2, StorageOrder::Shuffled(3)),
        ] {
            let mut many = run_in_order(&text, workers, order);
            many.advance(600);
            assert_eq!(many.digest(), one.digest(), "{policy}, {workers} workers, {order:?}");
        }
        for at in [1, 64, 250] {
            let mut first = run(&text);
            first.advance(at);
            // Nothing of the planner itself is kept, as after a resume in another process.
            let mut resumed = run_in_order(&text, 2, StorageOrder::Spatial);
            resumed.restore(&first.checkpoint()).expect("fits");
            assert_eq!(resumed.digest(), first.digest(), "{policy}, resumed at {at}");
            resumed.advance(600 - at);
            assert_eq!(resumed.digest(), one.digest(), "{policy}, resumed at {at}");
            assert_eq!(resumed.metrics().tasks_finished, one.metrics().tasks_finished);
        }
    }
}

#[test]
fn whole_plans_carry_tasks_out_and_are_the_same_when_resumed_in_the_midst_of_actions() {
    for planner in [
        "lacam\", budget_expansions = 100, window = 30, executor = \"adg",
        "prioritized",
        "pibt\", report_every = 4, report_loss = 0.1, places = \"believed",
    ] {
        let text = shelves("nearest").replace("method = \"pibt", &format!("method = \"{planner}"));
        let mut whole = run(&text);
        // Plans are made anew at each errand that is done, so the robots are slower than step by step.
        whole.advance(1200);
        let metrics = whole.metrics();
        assert!(metrics.tasks_finished > 10, "{planner}: {}", metrics.tasks_finished);
        assert!(metrics.plans > metrics.plan_failures, "{planner}: {}", metrics.plans);
        let mut first = run(&text);
        first.advance(100);
        let mut resumed = run_in_order(&text, 2, StorageOrder::Spatial);
        resumed.restore(&first.checkpoint()).expect("fits");
        resumed.advance(1100);
        assert_eq!(resumed.digest(), whole.digest(), "{planner}");
    }
}

#[test]
fn looking_at_a_robot_with_tasks_changes_nothing() {
    let mut watched = run(&shelves("nearest"));
    let mut unwatched = run(&shelves("nearest"));
    for _ in 0..60 {
        let body = watched.world().body_id(3);
        assert!(watched.inspect(body).is_some());
        watched.advance(1);
        unwatched.advance(1);
        assert_eq!(watched.digest(), unwatched.digest());
    }
}

#[test]
fn the_digest_depends_on_the_open_tasks() {
    let mut run = run(&shelves("fifo"));
    run.advance(50);
    let mut other = run.snapshot();
    *other.bodies[0].contacts.last_mut().expect("has words") += 1;
    assert_ne!(other.digest(), run.snapshot().digest());
}

#[test]
fn tasks_that_nobody_can_carry_out_are_refused_with_place_and_remedy() {
    let refused = |text: &str, line: usize, cause: &str, remedy: &str| {
        let error = compile(text, StorageOrder::ById).map(|_| ()).expect_err(text);
        assert_eq!(error.line_and_column().map(|at| at.0), Some(line), "{error}");
        assert!(error.cause().contains(cause), "{error}");
        assert!(error.remedy().contains(remedy), "{error}");
    };
    let of = |list: &str| corridor(&format!("{{ list = {list} }}"));
    refused(&of("[[[5, 0]]]"), 8, "does not fit at the errand [5, 0]", "sidestep map");
    refused(
        &of("[[[1, 0]], [[1, 1]]]"),
        8,
        "[1, 1] is outside the map of 8 x 1 boxes",
        "free place",
    );
    refused(&of("[]"), 8, "no tasks are given", "list = [[[col, row]");
    refused(&of("[[]]"), 8, "no errand", "at least one [col, row]");
    refused(&corridor("{ reveal = 2 }"), 8, "no tasks are given", "list = ");
    let alone = of("[[[1, 0]]]").replace("planner = { method = \"pibt\" }\n", "");
    refused(&alone, 7, "no planner", "planner = { method = \"pibt\" }");
    let twice = of("[[[1, 0]]]") + "behaviour = { kind = \"wander\" }\n";
    let error = compile(&twice, StorageOrder::ById).map(|_| ()).expect_err("both");
    assert!(error.to_string().contains("beside `tasks`"), "{error}");
}
