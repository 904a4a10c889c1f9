//! Events that a run reports are those that its record shows.

use super::recount::balls;
use super::*;

/// Places of one connector, cycle by cycle.
fn track(rows: &MemoryRecorder, connector: u32) -> Vec<[f64; 2]> {
    let column = |name| rows.column("trajectories", name).expect("a column");
    match (column("connector"), column("x_m"), column("y_m")) {
        (ColumnValues::U32(who), ColumnValues::F64(x), ColumnValues::F64(y)) => {
            let rows = who.iter().zip(x.iter().zip(y)).filter(|(who, _)| **who == connector);
            rows.map(|(_, (x, y))| [*x, *y]).collect()
        }
        other => panic!("{other:?}"),
    }
}

/// Events as (cycle, name, connector, reason, value).
fn events<const D: usize>(
    run: &TestRun<D>,
    rows: &MemoryRecorder,
) -> Vec<(u64, String, u32, String, f64)> {
    let schemas = run.schemas();
    let table = schemas.iter().find(|s| s.name == "events").expect("events are recorded");
    let labels = |name: &str| &table.columns.iter().find(|c| c.name == name).expect(name).labels;
    let column = |name| rows.column("events", name).expect("a column");
    match (column("cycle"), column("event"), column("connector"), column("reason"), column("value"))
    {
        (
            ColumnValues::U64(cycle),
            ColumnValues::Label(event),
            ColumnValues::U32(who),
            ColumnValues::Label(why),
            ColumnValues::F64(value),
        ) => {
            let row = |k: usize| {
                let [event, why] = [(event[k], "event"), (why[k], "reason")]
                    .map(|(label, name)| labels(name)[label as usize].clone());
                (cycle[k], event, who[k], why, value[k])
            };
            (0..cycle.len()).map(row).collect()
        }
        other => panic!("{other:?}"),
    }
}

const PULLED: &str = "
[chain]
dt_s = 0.1
[[chains]]
connectors = 6
at_m = [0.0, 0.0]
rod_m = [0.9, 1.0]
radius_m = 0.1
";

#[test]
fn a_connector_that_is_fixed_or_has_failed_never_moves() {
    for limit in ["mobility = \"fixed\"", "failed = true"] {
        let text = format!(
            "{PULLED}[[chains.limits]]\nconnector = 3\n{limit}\n[[chains.tasks]]\nkind = \"wander\"\n\
             turn_deg = 90\npatience_s = 1000\n"
        );
        let (run, rows) = recorded::<2>(&source(4, &text), 1, 300);
        let still = track(&rows, 3);
        assert_eq!(still.len(), 300);
        assert!(still.iter().all(|at| *at == [-3.0, 0.0]), "{limit}");
        assert!(track(&rows, 0).windows(2).any(|w| w[0] != w[1]), "{limit}: nothing moved");
        assert!(run.metrics().max_rod_violation_m <= 1e-9);
    }
}

/// All rods at their greatest length, and the last connector fixed: nothing can come along.
#[test]
fn a_vetoed_order_is_told_and_leaves_every_bit_until_patience_ends() {
    let text = format!(
        "{PULLED}[[chains.limits]]\nconnector = 5\nmobility = \"fixed\"\n[[chains.tasks]]\n\
         kind = \"script\"\nscript = \"forward 1\"\npatience_s = 2.0\n"
    );
    let (run, rows) = recorded::<2>(&source(1, &text), 1, 500);
    let told = events(&run, &rows);
    assert_eq!(told.len(), 2, "{told:?}");
    assert_eq!(
        (told[0].0, told[0].1.as_str(), told[0].2, told[0].3.as_str()),
        (0, "veto", 5, "out-of-reach")
    );
    // It is tried for 2 s of 0.1 s, and once more.
    assert_eq!((told[1].0, told[1].1.as_str()), (20, "given-up"));
    assert!((0..6).all(|k| track(&rows, k).iter().all(|at| *at == [-f64::from(k), 0.0])));
    assert!(run.is_over() && run.cycle() == 21, "{}", run.cycle());
    let metrics = run.metrics();
    assert_eq!((metrics.vetoes, metrics.vetoes_by_reason["out-of-reach"]), (21, 21));
    let given_up = &metrics.given_up[0].what;
    assert_eq!(
        (given_up.task, given_up.by, given_up.reason.as_deref()),
        (0, Some(5), Some("out-of-reach"))
    );
    assert_eq!(given_up.nearest_m, 1.0);
    assert_eq!(metrics.progress, 0.0, "what was given up is not done");
}

#[test]
fn a_gap_too_long_is_told_with_the_number_of_missing_parts() {
    let text = BROKEN.replace("by_m = 2.0", "by_m = 2.0\napart_m = [-2.5, 0.0]");
    let (run, rows) = recorded::<2>(&source(1, &text), 1, 60);
    let told = events(&run, &rows);
    let gap = told.iter().position(|event| event.1 == "gap-too-long").expect("a gap");
    assert!((told[gap].4 - 2.5).abs() < 1e-9, "{told:?}");
    let Some(ColumnValues::U32(missing)) = rows.column("events", "missing") else {
        panic!("no column")
    };
    // 2.5 m of rods of 1.1 m; of other events nothing is missing.
    assert_eq!(missing.iter().sum::<u32>(), 3, "{missing:?}");
    assert_eq!(missing[gap], 3);
    assert_eq!(run.metrics().missing_parts, 3);
}

/// The second of three targets is inside a pillar.
#[test]
fn a_target_that_is_given_up_is_told_with_how_near_it_was_and_why() {
    let text = format!(
        "{PULLED}[[obstacles]]\nat_m = [3.0, 0.0]\nradius_m = 0.5\n[[chains.tasks]]\nkind = \"targets\"\n\
         targets_m = [[1.0, 0.0], [3.0, 0.0], [1.0, 1.0]]\npatience_s = 1.0\n"
    );
    let (run, rows) = recorded::<2>(&source(1, &text), 1, 3000);
    let metrics = run.metrics();
    assert!(run.is_over() && run.cycle() < 3000);
    let [given_up] = &metrics.given_up[..] else { panic!("{:?}", metrics.given_up) };
    assert_eq!((given_up.chain, given_up.what.task, given_up.what.part), (0, 0, 1));
    assert!((0.6 - 1e-6..0.7).contains(&given_up.what.nearest_m), "{given_up:?}");
    assert!(given_up.what.reason.is_some() && given_up.what.by.is_some(), "{given_up:?}");
    assert!((metrics.progress - 2.0 / 3.0).abs() < 1e-12, "{}", metrics.progress);
    let names: Vec<_> = events(&run, &rows).into_iter().map(|e| (e.1, e.4)).collect();
    for told in [("target", 0.0), ("target-given-up", 1.0), ("target", 2.0), ("done", 0.0)] {
        assert!(names.contains(&(told.0.into(), told.1)), "{told:?} in {names:?}");
    }
    assert_eq!(metrics.penetrations, 0);
}

#[test]
fn changes_take_effect_at_their_time() {
    let text = format!(
        "{PULLED}[[chains.changes]]\nat_s = 1.0\nconnector = 5\nfailed = true\n\
         [[chains.changes]]\nat_s = 2.0\nconnector = 5\nfailed = false\n\
         [[chains.changes]]\nat_s = 3.0\nconnector = 0\nmobility = \"fixed\"\n\
         [[chains.tasks]]\nkind = \"script\"\nscript = \"forward 10\"\nspeed_m_s = 0.5\n"
    );
    let (run, rows) = recorded::<2>(&source(1, &text), 1, 50);
    let last = track(&rows, 5);
    let moves = |from: usize, to: usize| (from..to).filter(|&k| last[k] != last[k + 1]).count();
    assert_eq!((moves(0, 10), moves(10, 20), moves(20, 30), moves(30, 49)), (10, 0, 10, 0));
    let told = events(&run, &rows);
    let changed: Vec<_> = told.iter().filter(|e| e.1 == "changed").map(|e| (e.0, e.2)).collect();
    assert_eq!(changed, [(10, 5), (20, 5), (30, 0)]);
    let vetoes: Vec<_> =
        told.iter().filter(|e| e.1 == "veto").map(|e| (e.0, e.3.as_str())).collect();
    assert_eq!(vetoes, [(10, "failed"), (30, "fixed")]);
}

/// A chain that is led around a corner may bend as far as its limit says at the time.
#[test]
fn a_bend_limit_takes_effect_at_its_time() {
    let text = format!(
        "{PULLED}[[chains.changes]]\nat_s = 2.0\nconnector = 1\nmax_bend_deg = 30\n\
         [[chains.tasks]]\nkind = \"script\"\nscript = \"wait 3 turn 120 forward 2\"\npatience_s = 1\n"
    );
    let bend_deg = |text: &str| {
        let mut run = run::<2>(&source(1, text), 1);
        let mut most_deg = 0.0f64;
        while run.cycle() < 100 && !run.is_over() {
            run.advance(1);
            let bend_rad = run.state().body(0).chain.bend_rad(1).expect("an inner connector");
            most_deg = most_deg.max(bend_rad.to_degrees());
        }
        most_deg
    };
    assert!(bend_deg(&text) <= 30.0 + 1e-6, "{}", bend_deg(&text));
    let free = bend_deg(&text.replace("max_bend_deg = 30", "max_bend_deg = 180"));
    assert!(free > 60.0, "{free}");
}

#[test]
fn a_run_is_over_when_all_tasks_of_all_chains_are_done() {
    let mut run = run::<2>(&source(1, BROKEN), 1);
    let mut least = 0.0;
    while !run.is_over() {
        assert!(run.cycle() < 1000, "it never ends");
        run.advance(1);
        let progress = run.metrics().progress;
        assert!((0.0..=1.0).contains(&progress) && progress >= least - 1e-12, "{progress}");
        least = progress;
    }
    let metrics = run.metrics();
    assert_eq!((metrics.progress, metrics.reformed, metrics.done), (1.0, 1, 2));
    assert!(metrics.max_rod_violation_m <= 1e-9 && metrics.given_up.is_empty(), "{metrics:?}");
}

/// Progress is measured by time for a duration, by motions for a script, by targets for targets, and by the run
/// without an end.
#[test]
fn progress_means_what_the_task_asks_for() {
    let progress = |task: &str, cycles: u64| {
        let mut run = run::<2>(&source(1, &format!("{PULLED}[[chains.tasks]]\n{task}\n")), 1);
        advance_to(&mut run, cycles);
        run.metrics().progress
    };
    let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-9, "{a}, not {b}");
    near(progress("kind = \"rest\"\nlasts_s = 4.0", 10), 0.25);
    near(progress("kind = \"wander\"\nlasts_s = 4.0", 10), 0.25);
    // Without an end, by the most that can be done in the 2000 cycles of the run.
    near(progress("kind = \"wander\"\nturn_deg = 1", 10), 0.005);
    near(progress("kind = \"rest\"", 10), 0.005);
    let script = "kind = \"script\"\nscript = \"forward 0.5 turn 10 wait 100 forward 1\"";
    near(progress(script, 30), 0.5);
    near(progress("kind = \"targets\"\ntargets_m = [[0.5, 0.0], [9.0, 0.0]]", 30), 0.5);
    let two = "kind = \"rest\"\nlasts_s = 1.0\n[[chains.tasks]]\nkind = \"rest\"\nlasts_s = 2.0";
    near(progress(two, 20), 0.75);
    near(progress(two, 100), 1.0);
}

#[test]
fn what_moves_comes_back_in_the_table_of_movers() {
    let (run, rows) = recorded::<2>(&source(2, DODGING), 2, 40);
    let column = |name| rows.column("movers", name).expect("a column");
    let (
        ColumnValues::U64(cycle),
        ColumnValues::U32(who),
        ColumnValues::F64(x),
        ColumnValues::F64(y),
    ) = (column("cycle"), column("obstacle"), column("x_m"), column("y_m"))
    else {
        panic!("other columns")
    };
    assert_eq!(cycle.len(), 40 * 14);
    let mut row = 0;
    for now in 0..40 {
        for (at, _) in balls(&run, now) {
            assert_eq!((cycle[row], [x[row], y[row]]), (now, at));
            row += 1;
        }
    }
    assert_eq!(who[..14], who[14..28]);
    assert_eq!(rows.row_count("robots"), 0, "nothing is on wheels");
    let (_, swarm) = recorded::<2>(&source(2, SWARM), 1, 20);
    assert_eq!((swarm.row_count("robots"), swarm.row_count("movers")), (20 * 5, 20));
}
