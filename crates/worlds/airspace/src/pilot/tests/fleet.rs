//! Promise D2: a run that is flown by pilots outside of it is the run that flies itself; and D1: one that lost some
//! of their controls is computed again from those that it had.

use super::*;
use sidestep_kernel::control::ControlLog;
use sidestep_kernel::ports::{ColumnValues, MemoryRecorder, Recorder, TableSchema};

const FOUR: &str = "[airspace.generator]\nkind = \"superconflict\"\nn = 4\nradius_m = 2600.0\n";
const CYCLES: Cycle = 12;

/// Flies some cycles, by `before` each of them; returns the rows.
fn flown(
    run: &mut AirspaceRun,
    cycles: Cycle,
    mut before: impl FnMut(&mut AirspaceRun),
) -> MemoryRecorder {
    run.start_recording();
    let mut rows = MemoryRecorder::new(&run.schemas());
    for _ in 0..cycles {
        before(run);
        run.advance(1);
        run.record(&mut rows).expect("memory suffices");
    }
    rows.finish().expect("memory suffices");
    rows
}

fn tables(rows: &mut MemoryRecorder) -> Vec<(TableSchema, Vec<ColumnValues>)> {
    rows.take().into_iter().filter(|(schema, _)| schema.name != "controls").collect()
}

/// Returns the metrics without those that a clock has measured.
fn metrics(run: &AirspaceRun) -> crate::metrics::Metrics {
    crate::metrics::Metrics { optimize_cpu_s: 0.0, ..run.metrics() }
}

fn is_flown_alike(airspace: &str, airplanes: &str, mut orders: impl FnMut(&mut AirspaceRun)) {
    let (mut own, mut driven) = (run(airspace, airplanes), run(airspace, airplanes));
    let mut expected = flown(&mut own, CYCLES, &mut orders);
    let mut crew = TestPilots::from_run(&driven);
    let mut found = flown(&mut driven, CYCLES, |run| {
        orders(run);
        let controls = crew.decide(run);
        run.submit(controls.iter().map(over_the_wire).collect()).expect("what pilots decide");
    });
    assert_eq!(driven.digest(), own.digest(), "{airspace}");
    assert_eq!(metrics(&driven), metrics(&own), "{airspace}");
    assert_eq!(tables(&mut found), tables(&mut expected), "{airspace}");
    // Packets of one that believes in another group are refused, and so are those that come too
    // early to be kept.
    let may_disagree = airspace.contains("heard") && airspace.contains("loss");
    let is_sound = |pilot: &Pilot| may_disagree || pilot.drop_counts().total() == 0;
    assert!(crew.pilots.iter().all(is_sound), "{airspace}");
}

#[test]
fn a_run_flown_from_outside_is_the_run_that_flies_itself() {
    for deployment in ["team", "compact-team", "pim", "hierarchical-pim"] {
        for method in ["pc", "mvp", "orca", "bands", "none"] {
            let airspace = format!("deployment = \"{deployment}\"\nmethod = \"{method}\"");
            is_flown_alike(&airspace, FOUR, |_| {});
        }
        let paper = format!("deployment = \"{deployment}\"\npreset = \"paper\"");
        is_flown_alike(&paper, FOUR, |_| {});
    }
    for method in ["pc", "mvp"] {
        let noise = "position_noise_m = 5.0\nheading_noise_deg = 0.05\nwind_m_s = [3.0, 1.0]";
        let airspace = format!("deployment = \"team\"\nmethod = \"{method}\"\n{noise}");
        is_flown_alike(&airspace, TROUBLE, |_| {});
    }
    is_flown_alike("deployment = \"team\"\nshield = \"off\"", FOUR, |_| {});
}

/// Commands that are not cleared, which the airspace alone decides, pilots learn from their percepts.
#[test]
fn a_run_in_which_levels_and_speeds_are_commanded_is_flown_alike_from_outside() {
    let mvp = |resolution: &str| {
        format!("method = \"mvp\"\nmvp = {{ resolution = \"{resolution}\", vertical_lead_s = 40 }}")
    };
    let faults =
        "network = { loss = 0.3, max_delay_s = 0.005, silent = [{ airplane = 2, from_s = 20.0 }] }";
    for resolution in ["speed", "vertical", "heading-speed-vertical"] {
        let airspace = format!("deployment = \"team\"\n{}", mvp(resolution));
        is_flown_alike(&airspace, TROUBLE, |_| {});
        is_flown_alike(&format!("{airspace}\n{faults}"), FOUR, |_| {});
    }
    let changes = "[airplane]\nlevel_changes_m = [-310.0, 310.0]\nspeed_changes_m_s = [-5.0]\n";
    for deployment in ["team", "pim"] {
        let airspace = format!("deployment = \"{deployment}\"\nlevel_weight = 0.01");
        is_flown_alike(&airspace, &format!("{changes}{TROUBLE}"), |_| {});
        is_flown_alike(&format!("{airspace}\n{faults}"), &format!("{changes}{FOUR}"), |_| {});
    }
}

#[test]
fn over_a_network_that_loses_messages_it_is_the_same_run_too() {
    let faults = "network = { loss = 0.2, duplication = 0.1, max_delay_s = 0.005, range_m = 6000.0, \
                  silent = [{ airplane = 2, from_s = 20.0 }], \
                  one_way = [{ sender = 0, receiver = 1, until_s = 30.0 }] }";
    for airspace in ["deployment = \"team\"", "deployment = \"compact-team\"\nmethod = \"orca\""] {
        is_flown_alike(&format!("{airspace}\n{faults}"), FOUR, |_| {});
    }
}

/// Also by pilots that see no others than those near them.
#[test]
fn pilots_that_find_their_groups_fly_the_run_that_flies_itself() {
    let faults = "network = { loss = 0.2, max_delay_s = 0.005, range_m = 4000.0, \
                  one_way = [{ sender = 0, receiver = 1, until_s = 30.0 }] }";
    for deployment in ["team", "compact-team", "pim", "hierarchical-pim"] {
        let airspace = format!("deployment = \"{deployment}\"\ngroups = \"heard\"");
        is_flown_alike(&airspace, TROUBLE, |_| {});
        is_flown_alike(&format!("{airspace}\n{faults}"), FOUR, |_| {});
    }
}

#[test]
fn what_was_ordered_from_outside_is_in_the_sight() {
    use crate::external_action::ExternalAction;
    use sidestep_kernel::control::MultiAgentOrder;
    let order = |run: &mut AirspaceRun| {
        let turn = if run.cycle().is_multiple_of(2) { 0.03 } else { -0.02 };
        let orders = MultiAgentOrder {
            order: ExternalAction::TURN_RATE,
            agents: &[0, 2],
            values: &[turn, -turn],
        };
        run.order(&orders).expect("right");
    };
    is_flown_alike("deployment = \"team\"\nmethod = \"external\"", FOUR, order);
}

/// The shield's filter, run once for all, and by each airplane from the messages that it has heard.
#[test]
fn everybody_filters_as_one_process_does_to_the_bit() {
    let noise = "position_noise_m = 5.0\nheading_noise_deg = 0.05\nwind_m_s = [3.0, 1.0]";
    for method in ["pc", "mvp", "orca", "bands", "none"] {
        for more in ["", noise] {
            let digest = |deployment: &str| {
                let airspace =
                    format!("deployment = \"{deployment}\"\nmethod = \"{method}\"\n{more}");
                let mut run = run(&airspace, TROUBLE);
                let mut filtered = 0;
                for _ in 0..30 {
                    run.advance(1);
                    let fallbacks = run.state().airplanes.iter().map(|one| one.fallback.get());
                    filtered += fallbacks.filter(|one| !one.is_orbiting()).count();
                }
                filtered += run.metrics().shield_overrides as usize;
                assert!(filtered > 0, "{method}: all fly their wishes, and orbit after them");
                run.digest()
            };
            let direct = digest("direct");
            assert_eq!(digest("team"), direct, "{method} {more}");
            assert_eq!(digest("compact-team"), direct, "{method} {more}");
        }
    }
}

/// Drops some controls, by cycle and id.
fn with_gaps(run: &AirspaceRun, controls: Vec<AirplaneControl>) -> Vec<AirplaneControl> {
    let is_lost = |id: EntityId| (u64::from(id) * 5 + run.cycle() * 3).is_multiple_of(7);
    let silent = run.cycle() == 4;
    controls.into_iter().filter(|control| !silent && !is_lost(control.id)).collect()
}

#[test]
fn a_run_with_missing_controls_is_computed_again_to_its_digest() {
    for network in ["", "network = { loss = 0.1 }\n"] {
        let airspace = format!("deployment = \"team\"\n{network}");
        let mut driven = run(&airspace, FOUR);
        let mut crew = TestPilots::from_run(&driven);
        let rows = flown(&mut driven, CYCLES, |run| {
            let controls = with_gaps(run, crew.decide(run));
            run.submit(controls).expect("what pilots decide");
        });
        let absent = driven.collector().counters.events[&crate::events::EventKind::Absent];
        assert!(absent > 8, "{absent}");
        assert_eq!(driven.metrics().losses_of_separation, 0);
        driven.advance(3);
        let book = ControlLog::from_recorder(&rows).expect("controls are recorded");
        let mut again = run(&airspace, FOUR);
        again.replay_controls(book.clone());
        again.advance(5);
        let checkpoint = again.checkpoint();
        again.advance(CYCLES + 3 - 5);
        assert_eq!(again.digest(), driven.digest(), "{network}");
        assert_eq!(again.collector().counters, driven.collector().counters, "{network}");
        let mut resumed = run(&airspace, FOUR);
        resumed.replay_controls(book);
        resumed.restore(&checkpoint).expect("the same scenario");
        resumed.advance(CYCLES + 3 - 5);
        assert_eq!(resumed.digest(), driven.digest(), "{network}");
    }
}

#[test]
fn a_checkpoint_has_the_controls_that_were_handed_over() {
    let mut driven = run("deployment = \"team\"", FOUR);
    let mut crew = TestPilots::from_run(&driven);
    let controls = crew.decide(&driven);
    driven.submit(controls[1..].to_vec()).expect("what pilots decide");
    let mut resumed = run("deployment = \"team\"", FOUR);
    resumed.restore(&driven.checkpoint()).expect("the same scenario");
    assert_eq!(resumed.digest(), driven.digest());
    assert_eq!((driven.advance(2), resumed.advance(2)), (2, 2));
    assert_eq!(resumed.digest(), driven.digest());
}

#[test]
fn what_cannot_be_flown_is_refused_with_the_reason_and_nothing_is_taken() {
    let mut driven = run("deployment = \"team\"\nnetwork = {}", FOUR);
    let good = TestPilots::from_run(&driven).decide(&driven);
    let before = driven.digest();
    let changed = |change: &dyn Fn(&mut AirplaneControl)| {
        let mut controls = good.clone();
        change(&mut controls[1]);
        controls
    };
    let profile = |omegas_rad_s: Vec<f64>| Maneuver::Profile {
        candidate: 0,
        profile: crate::shield::TurnProfile { omegas_rad_s },
        fallback: crate::shield::Fallback::default(),
        is_common: false,
    };
    let falls_back_far_away = Maneuver::Profile {
        candidate: 0,
        profile: crate::shield::TurnProfile { omegas_rad_s: vec![0.0; 5] },
        fallback: crate::shield::Fallback::after_straight(100, crate::shield::OrbitSide::Left),
        is_common: false,
    };
    let commanded = crate::flight::MethodCommand { level: None, v_m_s: Some(36.0) };
    let wrong: [(Vec<AirplaneControl>, &str); 9] = [
        (
            changed(&|control| control.memory.command = commanded),
            "its memory or its optimization are impossible",
        ),
        (changed(&|control| control.id = 9), "it does not decide in this cycle"),
        (changed(&|control| control.cycle = 3), "give that of airplane 1 and cycle 0"),
        (changed(&|control| control.maneuver = profile(vec![0.0; 4])), "give 5, one for each step"),
        (changed(&|control| control.maneuver = profile(vec![f64::NAN; 5])), "a turn rate of NaN"),
        (changed(&|control| control.maneuver = profile(vec![9.0; 5])), "a turn rate of 9"),
        (
            changed(&|control| control.maneuver = falls_back_far_away.clone()),
            "orbits after 100 cycles; give one that does after at most 13",
        ),
        (
            changed(&|control| control.maneuver = profile(vec![0.001; 5])),
            "those of none of its actions",
        ),
        ([good.clone(), good.clone()].concat(), "there are two of it"),
    ];
    for (controls, cause) in wrong {
        let error = driven.submit(controls).expect_err("refused").to_string();
        assert!(error.contains(cause), "{error}");
        assert_eq!(driven.digest(), before, "nothing was taken");
    }
    let garbage = vec![(0, vec![0; 3])];
    let error = driven.submit_controls(&garbage).expect_err("refused").to_string();
    assert!(error.contains("its bytes are no control"), "{error}");
    let mut direct = run("", FOUR);
    let error = direct.submit(Vec::new()).expect_err("refused").to_string();
    assert!(error.contains("one process decides for all"), "{error}");
}

#[test]
fn a_run_that_is_recorded_without_its_controls_takes_none() {
    let text = "format = 1\nworld = \"airspace\"\n[airspace]\ndeployment = \"team\"\n\
                [airspace.generator]\nkind = \"superconflict\"\nn = 2\n";
    let mut run = airspace_run(&Source::new("s", text, ""), 1).expect("a scenario");
    run.start_recording();
    let error = run.submit(Vec::new()).expect_err("refused").to_string();
    assert!(error.contains("set record.controls = true"), "{error}");
}
