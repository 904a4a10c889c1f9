use crate::kinds;
use crate::{RobotsRun, robots_run};
use sidestep_kernel::Simulation;
use sidestep_kernel::view::{BodyId, FactValue, Inspection, MarkRole, MarkShape};
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

/// The bodies for which a robot waits.
fn waits_for(told: &Inspection) -> Vec<FactValue> {
    let table = told.section("Plan").and_then(|section| section.table.as_ref());
    let column = table.and_then(|table| table.column("waits for"));
    column.into_iter().flatten().cloned().collect()
}

#[test]
fn robots_in_a_gridlock_are_told_and_drawn_with_those_they_wait_for() {
    let text = "format = 1\nworld = \"robots\"\nregime = \"reliable\"\n\
        [map]\nbox_size_m = 0.5\nascii = \"....................\"\n\
        [[robots]]\nat = [[2, 0, 0]]\nsensors = [\"sonar-ring\"]\n\
        behaviour = { kind = \"shuttle\", a = [0, 0, 1, 1], b = [19, 0, 1, 1] }\n\
        [[robots]]\nat = [[16, 0, 2]]\nsensors = [\"sonar-ring\"]\n\
        behaviour = { kind = \"shuttle\", b = [0, 0, 1, 1], a = [19, 0, 1, 1] }\n";
    let mut run = robots_run(&Source::new("s", text, ""), 1).unwrap_or_else(|e| panic!("{e}"));
    let first = told(&run, 0);
    assert_eq!(waits_for(&first), []);
    assert_eq!(first.fact_value("Plan", "gridlock"), Some(&FactValue::None));
    let way = first.marks_with_role(MarkRole::Plan).next().expect("a way");
    assert_eq!(first.marks_with_role(MarkRole::Target).count(), 1);
    let MarkShape::Line { points_m } = &way.shape else { panic!("a line: {way:?}") };
    assert_eq!(points_m.first(), Some(&[1.25, 0.25, points_m[0][2]]), "from where it stands");
    assert_eq!(points_m.last(), Some(&[0.25, 0.25, points_m[0][2]]), "to its goal");
    run.advance(1_000);
    let first = told(&run, 0);
    assert_eq!(waits_for(&first), [FactValue::Body(robot(1))]);
    let Some(FactValue::Text(words)) = first.fact_value("Plan", "gridlock") else {
        panic!("in a gridlock: {:?}", first.section("Plan"))
    };
    assert!(words.starts_with("2 robots (0, 1)"), "{words}");
    let labels: Vec<&str> =
        first.marks_with_role(MarkRole::Wait).map(|mark| mark.label.as_str()).collect();
    assert_eq!(labels, ["robot 0 waits for robot 1", "robot 1 waits for robot 0"]);
}

#[test]
fn a_robot_that_a_planner_leads_is_told_with_the_rest_of_its_plan_and_who_passes_before_it() {
    // Two that cross at (3, 3): the plan says who passes first.
    let text = "format = 1\nworld = \"robots\"\nregime = \"reliable\"\n\
        [map]\nbox_size_m = 1.0\nascii = \"\"\"\n###.###\n###.###\n###.###\n.......\n###.###\n###.###\n###.###\n\"\"\"\n\
        [robots]\nat = [[0, 3, 0], [3, 0, 1]]\n\
        behaviour = { kind = \"goto\", goals = [[6, 3], [3, 6]] }\n\
        planner = { method = \"cbs\", budget_expansions = 10000 }\n";
    let mut run = robots_run(&Source::new("s", text, ""), 1).unwrap_or_else(|e| panic!("{e}"));
    let mut waits = Vec::new();
    for _ in 0..12 {
        for id in [0, 1] {
            let told = told(&run, id);
            let Some(way) = told.marks_with_role(MarkRole::Plan).next() else { continue };
            let MarkShape::Line { points_m } = &way.shape else { panic!("a line: {way:?}") };
            assert_eq!(told.fact_value("Now", "place"), Some(&points_m[0].into()), "{told:?}");
            waits.extend(waits_for(&told).into_iter().map(|other| (id, other)));
        }
        run.advance(1);
    }
    let other = |id: u32| FactValue::Body(robot(1 - id));
    assert!(!waits.is_empty(), "one lets the other pass");
    assert!(waits.iter().all(|(id, named)| *named == other(*id)), "{waits:?}");
}
