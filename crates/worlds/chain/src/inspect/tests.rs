use crate::chain_run;
use crate::kinds;
use sidestep_kernel::Simulation;
use sidestep_kernel::view::{BodyId, BodyKind, FactValue, Inspection, MarkRole};
use sidestep_scenario::Source;

fn run(text: &str) -> Box<dyn Simulation> {
    let text = format!("format = 1\nworld = \"chain\"\n{text}");
    chain_run(&Source::new("s", text, ""), 1).unwrap_or_else(|e| panic!("{e}"))
}

fn told(run: &dyn Simulation, k: u32) -> Inspection {
    run.inspect(BodyId::new(kinds::CONNECTOR, 0, Some(k))).expect("it is there")
}

/// A chain that an operator drives against a disc: its head touches it at x = 0.6.
const AGAINST_A_DISC: &str = "[chain]\ndt_s = 0.1\n[[obstacles]]\nat_m = [1.0, 0.0]\nradius_m = 0.3\n\
    [[chains]]\nconnectors = 4\nat_m = [0.0, 0.0]\nrod_m = [0.4, 0.5]\nradius_m = 0.1\n\
    [[chains.tasks]]\nkind = \"script\"\nscript = \"forward 5\"\nspeed_m_s = 0.7\npatience_s = 9.0\n";

#[test]
fn a_veto_names_the_obstacle_and_says_how_far_the_initiator_could_have_gone() {
    let mut run = run(AGAINST_A_DISC);
    let free = told(&*run, 0);
    assert_eq!(free.section("Veto"), None);
    assert_eq!(free.fact_value("Wish", "what"), Some(&"go".into()));
    assert_eq!(free.fact_value("Ladder", "rung"), Some(&"as wanted".into()));
    run.advance(20);
    let told = told(&*run, 2);
    let head: BodyId = BodyId::new(kinds::CONNECTOR, 0, Some(0));
    assert_eq!(told.fact_value("Veto", "by"), Some(&FactValue::Body(head)));
    assert_eq!(told.fact_value("Veto", "reason"), Some(&"target-blocked".into()));
    let disc = BodyId::new(BodyKind::OBSTACLE, 0, None);
    assert_eq!(told.fact_value("Veto", "because of"), Some(&FactValue::from(Some(disc))));
    let Some(FactValue::Place([x_m, ..])) = told.fact_value("Veto", "as far as") else {
        panic!("nowhere")
    };
    assert!((0.56..=0.6).contains(x_m), "the disc begins at 0.6 m, and it can go to {x_m} m");
    let Some(FactValue::Number { value: far_m, unit: "m" }) = told.fact_value("Veto", "could go")
    else {
        panic!("no way")
    };
    assert!((0.0..0.07).contains(far_m), "less than a step, and not {far_m} m");
    assert_eq!(told.fact_value("Outcome", "next place"), told.fact_value("Now", "place"));
    assert_eq!(told.fact_value("Wish", "of"), Some(&FactValue::Body(head)));
    assert_eq!(told.marks_with_role(MarkRole::Wish).count(), 1);
    assert_eq!(told.fact_value("Moves", "connectors"), Some(&FactValue::count(0)));
}

#[test]
fn the_layer_of_a_leader_and_the_lateness_of_its_robots_are_told() {
    let text = "[ground]\ncorridor = { width_m = 2.4, legs = [{ straight_m = 12 }] }\n[[chains]]\n\
        connectors = 4\nat_m = [4.0, 0.0]\nheading_deg = 0\nrod_m = [0.6, 0.8]\n\
        rod_radius_m = 0.05\nrobots = { radius_m = 0.2 }\n[[chains.tasks]]\nkind = \"navigate\"\n\
        speed_m_s = 0.5\n";
    let mut run = run(text);
    run.advance(30);
    let told = run.inspect(BodyId::new(kinds::ROBOT, 0, Some(3))).expect("it is there");
    let Some(FactValue::Text(layer)) = told.fact_value("Decides", "layer") else {
        panic!("no layer")
    };
    assert!(layer.starts_with(|digit| ('1'..='6').contains(&digit)), "{layer}");
    let robots = told.section("Robots").and_then(|s| s.table.as_ref()).expect("four robots");
    assert_eq!(robots.rows.len(), 4);
    run.advance(1);
    let then = run.inspect(BodyId::new(kinds::ROBOT, 0, Some(3))).expect("it is there");
    assert_eq!(then.fact_value("Now", "place"), told.fact_value("Outcome", "next place"));
    let table = then.section("Robots").and_then(|s| s.table.as_ref()).expect("four robots");
    let [was, is] = [(robots, "behind then"), (table, "behind now")]
        .map(|(table, head)| table.column(head).expect("a column").cloned().collect::<Vec<_>>());
    assert_eq!(was, is);
}

#[test]
fn nobody_is_told_of_who_is_not_there() {
    let run = run(AGAINST_A_DISC);
    for who in [
        BodyId::new(kinds::CONNECTOR, 0, Some(4)),
        BodyId::new(kinds::CONNECTOR, 1, Some(0)),
        BodyId::new(kinds::CONNECTOR, 0, None),
        BodyId::new(kinds::ROBOT, 0, Some(0)),
        BodyId::new(kinds::RODS, 0, Some(0)),
    ] {
        assert_eq!(run.inspect(who), None, "{who:?}");
    }
}

#[test]
fn the_joints_of_an_arm_are_told_in_degrees_with_their_limits() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../scenarios/chain");
    let text = std::fs::read_to_string(format!("{folder}/arm.toml")).expect("shipped");
    let source = Source::new("arm.toml", text, folder);
    let mut run = chain_run(&source, 1).unwrap_or_else(|e| panic!("{e}"));
    let values = |inspection: &Inspection, column: &str| {
        let table = inspection.section("Joints").and_then(|joints| joints.table.as_ref());
        let column = table.and_then(|table| table.column(column)).expect("a column");
        column.cloned().collect::<Vec<FactValue>>()
    };
    let start = told(&*run, 0);
    let degrees = |value_rad: f64| FactValue::degrees(value_rad);
    assert_eq!(
        values(&start, "value"),
        [0.0, 0.5, 0.0, 1.0, 0.0, 0.5, 0.0].map(degrees),
        "the posture of the scenario"
    );
    run.advance(40);
    let later = told(&*run, 0);
    assert_ne!(values(&later, "value"), values(&start, "value"), "it moves");
    assert_eq!(values(&later, "highest"), values(&start, "highest"));
    let summary = run.agent_metrics()[0]["joints"].clone();
    let names = values(&later, "joint");
    for (name, value) in names.iter().zip(values(&later, "value")) {
        let FactValue::Text(name) = name else { panic!("no name") };
        let value_rad = summary[name.as_str()].as_f64().expect("a joint");
        let FactValue::Number { value: value_deg, unit: "°" } = value else { panic!("{value:?}") };
        assert!((value_deg - value_rad.to_degrees()).abs() < 1e-9, "{name}");
    }
}
