use crate::kinds;
use crate::{RobotsRun, robots_run};
use sidestep_kernel::Simulation;
use sidestep_kernel::view::{BodyId, FactValue, Inspection, MarkRole};
use sidestep_scenario::Source;

/// Two robots that want the box between them; the one with the smaller id goes first.
fn head_on() -> RobotsRun {
    let text = "format = 1\nworld = \"robots\"\nregime = \"reliable\"\nconflict_policy = \"fixed\"\n\
        [map]\nbox_size_m = 0.5\nascii = \"\"\"\n######\n#...##\n######\n\"\"\"\n\
        [robots]\nat = [[1, 1, 0], [3, 1, 2]]\nsensors = [\"eye\"]\n\
        behaviour = { kind = \"replay\", actions = [\"forward\"] }\n\
        [sensors.eye]\nbearings_deg = [0, 90]\nrange_m = 2\n\
        observations = [\"nothing\", \"wall\", \"robot\"]\ndistance_edges_m = [0.4]\n\
        distance_classes = [\"near\", \"far\"]\n[sensors.eye.confusion]\nnothing = [1, 0, 0]\n\
        wall = [0, 1, 0]\nrobot = [0, 0, 1]\n[sensors.eye.distance_confusion]\nnear = [1, 0]\n\
        far = [0, 1]\nbeyond = [0, 1]\n";
    robots_run(&Source::new("s", text, ""), 1).unwrap_or_else(|e| panic!("{e}"))
}

fn robot(id: u32) -> BodyId {
    BodyId::new(kinds::ROBOT, id, None)
}

fn told(run: &RobotsRun, id: u32) -> Inspection {
    run.inspect(robot(id)).expect("it is there")
}

#[test]
fn a_robot_that_is_cut_is_told_by_whom_and_what_it_saw_and_claimed() {
    let mut run = head_on();
    let second = told(&run, 1);
    let beams = second.section("Perceives").and_then(|s| s.table.as_ref()).expect("two beams");
    let column = |head| beams.column(head).expect("a column").cloned().collect::<Vec<_>>();
    assert_eq!(column("bearing"), [FactValue::number(0.0, "°"), FactValue::number(90.0, "°")]);
    assert_eq!(column("truth"), ["robot".into(), "wall".into()]);
    assert_eq!(column("true class"), ["far".into(), "near".into()]);
    assert_eq!(column("true range"), [FactValue::meters(0.5), FactValue::meters(0.0)]);
    assert_eq!(column("report"), column("truth"), "sensors are reliable");
    assert_eq!(column("chance of the report"), [FactValue::Share(1.0), FactValue::Share(1.0)]);
    assert_eq!(second.fact_value("Decides", "action"), Some(&"forward".into()));
    assert_eq!(second.marks_with_role(MarkRole::Claim).count(), 1);
    assert_eq!(second.fact_value("Conflict group", "bodies"), Some(&FactValue::count(2)));
    assert_eq!(second.fact_value("Conflict group", "turn"), Some(&FactValue::count(2)));
    let order = second.section("Conflict group").and_then(|s| s.table.as_ref()).expect("an order");
    let turns: Vec<_> = order.column("body").expect("a column").collect();
    assert_eq!(turns, [&FactValue::Body(robot(0)), &FactValue::Body(robot(1))]);
    assert_eq!(second.fact_value("Outcome", "cut by"), Some(&FactValue::from(Some(robot(0)))));
    assert_eq!(second.fact_value("Outcome", "steps made"), Some(&FactValue::count(0)));
    assert_eq!(second.fact_value("Outcome", "probability"), Some(&FactValue::Share(1.0)));
    assert_eq!(second.fact_value("Outcome", "next place"), second.fact_value("Now", "place"));
    let first = told(&run, 0);
    assert_eq!(first.fact_value("Outcome", "steps made"), Some(&FactValue::count(1)));
    assert_eq!(first.fact_value("Outcome", "cut by"), None);
    run.advance(1);
    let then = [0, 1].map(|id| told(&run, id));
    assert_eq!(then[0].fact_value("Now", "place"), first.fact_value("Outcome", "next place"));
    assert_eq!(then[1].fact_value("Now", "last contact"), Some(&"robot at its front".into()));
    assert_eq!(then[1].fact_value("Perceives", "nothing of the kind"), None);
}

#[test]
fn nobody_is_told_of_who_is_not_there() {
    let run = head_on();
    for who in [
        BodyId::new(kinds::ROBOT, 2, None),
        BodyId::new(kinds::PERSON, 0, None),
        BodyId::new(kinds::ROBOT, 0, Some(0)),
    ] {
        assert_eq!(run.inspect(who), None, "{who:?}");
    }
}

/// The reported transition must be the one that the run then makes, of robots and people, under
/// every obstacle rule and conflict policy.
#[test]
fn what_is_told_of_an_action_is_what_comes_of_it() {
    for rule in ["cut", "stay", "renormalise"] {
        for policy in ["random", "fixed", "by_kind", "right_of_way", "rounds", "simultaneous"] {
            let order = match policy {
                "by_kind" => "kind_order = [\"person\", \"robot\"]\n",
                _ => "",
            };
            let text = format!(
                "format = 1\nworld = \"robots\"\nseed = 3\nobstacle_rule = \"{rule}\"\n\
                 conflict_policy = \"{policy}\"\n{order}[map]\nbox_size_m = 0.25\nascii = \"\"\"\n{}\"\"\"\n\
                 [[robots]]\ncount = 20\nsize = 1\neffector = \"nomad\"\nsensors = [\"sonar-8\"]\n\
                 [[robots]]\ncount = 6\nsize = 2\neffector = \"nomad\"\nperiod = 2\n\
                 [[people]]\ncount = 8\n",
                "............\n".repeat(12)
            );
            let mut run =
                robots_run(&Source::new("s", text, ""), 1).unwrap_or_else(|e| panic!("{e}"));
            let mut moved = 0;
            for _ in 0..12 {
                run.advance(5);
                let bodies = run.world().bodies.len() as u32;
                let all: Vec<Inspection> = (0..bodies)
                    .map(|id| run.inspect(run.world().body_id(id)).expect("it is there"))
                    .collect();
                run.advance(1);
                for (id, told) in (0..).zip(&all) {
                    let then = run.inspect(run.world().body_id(id)).expect("it is there");
                    for (now, next) in [("place", "next place"), ("heading", "next heading")] {
                        let (now, next) =
                            (then.fact_value("Now", now), told.fact_value("Outcome", next));
                        // A body that goes straight is reported so before it turns at its next decision.
                        assert_eq!(now, next, "{rule}, {policy}: {:?}", told.body);
                    }
                    moved += usize::from(
                        told.fact_value("Now", "place") != then.fact_value("Now", "place"),
                    );
                }
            }
            assert!(moved > 50, "{rule}, {policy}: {moved} moved");
        }
    }
}
