use crate::flight::distance_m;
use crate::kinds;
use crate::{AirspaceRun, airspace_run};
use sidestep_kernel::Simulation;
use sidestep_kernel::view::{BodyId, FactValue, Inspection, MarkRole, MarkShape};
use sidestep_scenario::Source;

fn run(airspace: &str, seed: u32, n: u32) -> AirspaceRun {
    let text = format!(
        "format = 1\nworld = \"airspace\"\nseed = {seed}\n[airspace]\n{airspace}\n\
         [airspace.generator]\nkind = \"superconflict\"\nn = {n}\n"
    );
    airspace_run(&Source::new("s", text, ""), 1).unwrap_or_else(|e| panic!("{e}"))
}

fn inspect_airplane(run: &AirspaceRun, id: u32) -> Inspection {
    run.inspect(BodyId::new(kinds::AIRPLANE, id, None)).expect("it is in the air")
}

/// Returns the probabilities of the actions; none of an airplane that is alone.
fn chances(inspection: &Inspection) -> Option<Vec<f64>> {
    let table = inspection.section("Decides").and_then(|s| s.table.as_ref())?;
    let share = |value: &FactValue| match value {
        FactValue::Share(p) => *p,
        other => panic!("{other:?} is no probability"),
    };
    Some(table.column("probability").expect("a column").map(share).collect())
}

#[test]
fn an_airplane_shows_its_tracks_and_how_far_they_are_off() {
    let airspace = "method = \"mvp\"\nsurveillance = { latency_s = 2.0, position_noise_m = 30.0 }";
    let mut run = run(airspace, 1, 3);
    // By then they are so near that they have to avoid each other.
    run.advance(20);
    let inspection = inspect_airplane(&run, 0);
    let table = inspection.section("Tracks").and_then(|section| section.table.as_ref());
    let table = table.expect("tracks");
    let ages: Vec<&FactValue> = table.column("last report").expect("a column").collect();
    assert_eq!(ages, [&FactValue::number(2.0, "s"); 2]);
    let mut all_see_all = self::run("method = \"mvp\"", 1, 3);
    all_see_all.advance(20);
    assert!(inspect_airplane(&all_see_all, 0).section("Tracks").is_none());
}

/// With sampled and with exact expectations, in every deployment.
#[test]
fn probabilities_of_the_actions_sum_to_1_and_the_chosen_one_is_flown_unless_the_shield_objects() {
    for preset in ["default", "paper"] {
        for deployment in ["direct", "team", "compact-team", "pim", "hierarchical-pim"] {
            let airspace =
                format!("preset = \"{preset}\"\ndeployment = \"{deployment}\"\nmax_rounds = 30");
            let mut run = run(&airspace, 3, 4);
            let (mut as_wanted, mut kept) = (0, 0);
            run.advance(12);
            for _ in 0..4 {
                run.advance(4);
                let all: Vec<Inspection> = (0..4).map(|id| inspect_airplane(&run, id)).collect();
                run.advance(1);
                for (id, inspection) in (0..).zip(&all) {
                    let Some(chances) = chances(inspection) else { continue };
                    let sum: f64 = chances.iter().sum();
                    assert!((sum - 1.0).abs() < 1e-9, "{deployment}, {preset}: {sum}");
                    assert_eq!(
                        inspection.marks_with_role(MarkRole::Predicted).count() + 1,
                        chances.len()
                    );
                    let Some(chosen) = inspection.marks_with_role(MarkRole::Chosen).next() else {
                        panic!("none")
                    };
                    let MarkShape::Line { points_m } = &chosen.shape else { panic!("no way") };
                    let at = run.state().airplanes[id].pose().at;
                    // Chosen ways are drawn from where the airplane is, in steps of some seconds.
                    let gap_m = nearest_m(points_m, at);
                    if inspection.fact_value("Shield", "lets it fly")
                        == Some(&"what it wants".into())
                    {
                        assert!(
                            gap_m < 1e-3,
                            "{deployment}, {preset}: {gap_m} m from the chosen way"
                        );
                        as_wanted += 1;
                    } else {
                        assert!(
                            !inspection.section("Shield").expect("it is shown").facts.is_empty()
                        );
                        kept += 1;
                    }
                }
            }
            assert!(as_wanted > 4, "{deployment}, {preset}: {as_wanted}, {kept} kept");
        }
    }
}

/// Returns the distance of a point from a polyline.
fn nearest_m(points_m: &[[f64; 3]], [x, y]: [f64; 2]) -> f64 {
    let from = |pair: &[[f64; 3]]| {
        let ([ax, ay, _], [bx, by, _]) = (pair[0], pair[1]);
        let (dx, dy) = (bx - ax, by - ay);
        let t = (((x - ax) * dx + (y - ay) * dy) / (dx * dx + dy * dy)).clamp(0.0, 1.0);
        distance_m([x, y], [ax + t * dx, ay + t * dy])
    };
    points_m.windows(2).map(from).fold(f64::INFINITY, f64::min)
}

#[test]
fn who_is_kept_from_its_action_is_shown_because_of_whom() {
    let mut run = run("method = \"none\"", 5, 6);
    let mut kept = 0;
    while !run.is_over() && run.cycle() < 80 {
        for id in 0..6 {
            let Some(inspection) = run.inspect(BodyId::new(kinds::AIRPLANE, id, None)) else {
                continue;
            };
            assert_eq!(
                inspection.marks_with_role(MarkRole::Orbit).count(),
                1,
                "its stored orbit is drawn"
            );
            if inspection.fact_value("Shield", "lets it fly") == Some(&"what it wants".into()) {
                assert_eq!(inspection.fact_value("Shield", "because of"), Some(&FactValue::None));
                continue;
            }
            kept += 1;
            let Some(FactValue::Body(BodyId { kind, number: other, part: None })) =
                inspection.fact_value("Shield", "because of")
            else {
                panic!("nobody is the reason: {inspection:?}")
            };
            assert_eq!(*kind, kinds::AIRPLANE);
            assert!(*other != id && *other < 6);
            assert_eq!(inspection.marks_with_role(MarkRole::Refused).count(), 1);
        }
        run.advance(1);
    }
    assert!(kept > 5, "{kept}");
}

#[test]
fn on_a_bad_network_it_is_shown_since_when_others_were_heard() {
    let network = "deployment = \"team\"\nnetwork = { loss = 0.3, silent = [{ airplane = 2, from_s = 80.0 }] }";
    let mut run = run(network, 1, 4);
    run.advance(20);
    let inspection = inspect_airplane(&run, 0);
    let table =
        inspection.section("Knows of others").and_then(|s| s.table.as_ref()).expect("three others");
    let heard: Vec<&FactValue> =
        table.column("heard or first seen in cycle").expect("a column").collect();
    assert_eq!(heard.len(), 3);
    assert_eq!(heard[1], &FactValue::number(15.0, ""), "before its radio fell silent: {heard:?}");
    assert_eq!(inspection.marks_with_role(MarkRole::Known).count(), 3);
    let Some(conversation) = inspection.section("Talk of the group").and_then(|s| s.table.as_ref())
    else {
        panic!()
    };
    let messages = conversation.column("messages").expect("a column").cloned().collect::<Vec<_>>();
    assert!(
        messages.iter().all(|n| matches!(n, FactValue::Number { value, .. } if *value > 0.0)),
        "{messages:?}"
    );
}
