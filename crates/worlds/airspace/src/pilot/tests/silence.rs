//! Common plans: what airplanes fly where nobody is heard.

use super::*;
use crate::metrics::Metrics;
use crate::pilot::common_plans::CommonPlans;
use crate::shield::guarantee_tests::lost_and_named;
use proptest::prelude::*;

const SIX: &str = "[airspace.generator]\nkind = \"superconflict\"\nn = 6\nradius_m = 4000.0\n";

/// Returns a network on which all radios are dead, or only some.
fn silent(ids: impl Iterator<Item = u32>) -> String {
    let all: Vec<String> = ids.map(|id| format!("{{ airplane = {id}, from_s = 0.0 }}")).collect();
    format!("network = {{ silent = [{}] }}", all.join(", "))
}

fn flown(airspace: &str, airplanes: &str) -> (AirspaceRun, Metrics) {
    let mut run = run(airspace, airplanes);
    run.advance(160);
    let metrics = run.metrics();
    (run, metrics)
}

#[test]
fn where_nobody_talks_all_are_kept_apart_and_delayed_by_three_times_what_mvp_costs_at_most() {
    for (kind, n) in [("superconflict", 6), ("random", 8)] {
        let airplanes = format!("[airspace.generator]\nkind = \"{kind}\"\nn = {n}\n");
        let (_, bare) = flown("method = \"mvp\"\nshield = \"off\"", &airplanes);
        let bound_percent = 3.0 * bare.mean_delay_percent.expect("all arrive") + 2.0;
        for deployment in ["team", "replica-team", "pim"] {
            let airspace = format!("deployment = \"{deployment}\"\n{}", silent(0..n));
            let (run, silent) = flown(&airspace, &airplanes);
            assert_eq!(silent.losses_of_separation, 0, "{kind} {deployment}");
            assert_eq!(silent.arrived, u64::from(n), "{kind} {deployment}");
            let delay_percent = silent.mean_delay_percent.expect("all arrive");
            assert!(delay_percent <= bound_percent, "{kind} {deployment}: {delay_percent}");
            assert_eq!(run.metrics().messages, 0);
        }
    }
}

#[test]
fn all_of_a_group_compute_the_same_plans_from_what_each_sees() {
    let airspace = format!("deployment = \"team\"\nposition_noise_m = 3.0\n{}", silent(0..6));
    let mut run = run(&airspace, SIX);
    let mut planned = 0;
    for _ in 0..25 {
        let percepts = run.percepts();
        let plans: Vec<_> = percepts
            .iter()
            .map(|percept| {
                let percept = over_the_wire(percept);
                CommonPlans::default().of_group(run.world(), &percept)
            })
            .collect();
        assert!(plans.windows(2).all(|pair| pair[0] == pair[1]), "cycle {}", run.cycle());
        planned += plans[0].iter().flatten().count();
        run.advance(1);
    }
    assert!(planned > 100, "{planned}");
}

#[test]
fn nobody_sees_the_fallback_after_a_plan_that_only_some_have_heard() {
    // Nobody else knows of orders, so this one has no common plan.
    let ordered = "[[airplanes]]\nat_m = [0, 5000]\nheading_deg = -90\nway_points_m = [[0, -5000]]\n\
                   orders = [{ at_s = 100.0, way_points_m = [[500, -5000]] }]\n";
    let mut run =
        run("deployment = \"team\"\nnetwork = { loss = 0.3 }", &format!("{SIX}{ordered}"));
    let mut hidden = 0;
    for _ in 0..25 {
        let now = run.cycle();
        let before = run.percepts();
        let mut snapshot = run.state().snapshot(now);
        for (id, airplane) in snapshot.airplanes.iter_mut().enumerate() {
            if airplane.counts[3] == 0 && (id == 6 || !airplane.is_tracked) {
                airplane.fallback.orbit_side = airplane.fallback.orbit_side.opposite();
                airplane.counts[0] = 1 - airplane.counts[0].min(1);
                hidden += 1;
            }
        }
        let changed = crate::state::AirspaceState::restore(run.world(), &snapshot);
        let groups = |percepts: &[Percept]| -> Vec<_> {
            percepts.iter().map(|percept| percept.group.clone()).collect()
        };
        assert_eq!(groups(&run.world().percepts(&changed, now)), groups(&before));
        run.advance(1);
    }
    assert!(hidden > 10, "{hidden}");
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 12, ..ProptestConfig::default() })]

    /// Some talk, some do not, and the processes of some fail in any cycle.
    #[test]
    fn nobody_is_lost_where_processes_fail_among_airplanes_that_do_not_hear_each_other(
        quiet in proptest::collection::vec(any::<bool>(), 5),
        absent in proptest::collection::vec(proptest::collection::vec(any::<bool>(), 5), 40),
        loss in 0.0..0.9,
        method in prop_oneof![Just("pc"), Just("mvp"), Just("none")],
    ) {
        let ids = (0..5).filter(|&id| quiet[id as usize]);
        let silent = silent(ids).replace("{ silent", &format!("{{ loss = {loss:.2}, silent"));
        let airplanes = "[airspace.generator]\nkind = \"superconflict\"\nn = 5\nradius_m = 2600.0\n";
        let mut run = run(&format!("deployment = \"team\"\nmethod = \"{method}\"\n{silent}"), airplanes);
        let mut crew = TestPilots::from_run(&run);
        for gone in &absent {
            let mut controls = crew.decide(&run);
            // Three in four stay.
            controls.retain(|control| !(gone[control.id as usize] && gone[(control.id as usize + 1) % 5]));
            run.submit(controls).expect("what pilots decide");
            run.advance(1);
        }
        let (lost, named) = lost_and_named(&run);
        prop_assert!(lost.is_subset(&named), "{lost:?}");
    }
}
