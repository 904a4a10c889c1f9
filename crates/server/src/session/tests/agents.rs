//! What a page asks of all agents: their groups, their metrics as colors, and events found by words.

use super::*;

const COURIERS: &str = "format = 1\nworld = \"robots\"\nseed = 5\ncycles = 600\n[map]\nbox_size_m = 0.25\nascii = \"\"\"\n\
    ..............\n..............\n....##........\n....##........\n..............\n..............\n\"\"\"\n\
    [[robots]]\nname = \"couriers\"\ncount = 4\nsensors = [\"sonar-8\"]\neffector = \"nomad\"\n\
    [[robots]]\nname = \"guards\"\ncount = 2\nsensors = [\"sonar-8\"]\neffector = \"nomad\"\n\
    [people]\ncount = 2\n";

/// Returns the metrics of each agent of a plain run after so many cycles.
fn plain_agents(text: &str, cycles: u64) -> Vec<Value> {
    let source = Source::new("s.toml", text, "");
    let mut run = WORLDS.compile(&source).expect("valid").start(&source, 1);
    while run.cycle() < cycles && run.advance(cycles - run.cycle()) > 0 {}
    run.agent_metrics().as_array().expect("agents").clone()
}

fn keys(names: &Value) -> Vec<&str> {
    names
        .as_array()
        .expect("names")
        .iter()
        .map(|name| name["key"].as_str().expect("a key"))
        .collect()
}

#[test]
fn a_scene_names_the_groups_of_its_agents() {
    let (_page, opened) = Page::open(COURIERS, 1);
    assert_eq!(
        opened["answer"]["scene"]["groups"],
        json!([
            { "name": "couriers", "kind": "robot", "first": 0, "count": 4 },
            { "name": "guards", "kind": "robot", "first": 4, "count": 2 },
        ])
    );
}

#[test]
fn metrics_of_agents_are_those_of_a_plain_run_in_every_world() {
    for (text, cycle, key) in
        [(COURIERS, 200, "counts.contacts"), (CHAINS, 60, "progress"), (AIRPLANES, 30, "alone_s")]
    {
        let (mut page, _) = Page::open(text, 2);
        let digest = page.digest_at(cycle);
        let told = page.ask(json!({ "do": "agent-metrics", "metric": null }));
        let names = keys(&told["names"]);
        assert!(names.contains(&key), "{names:?}");
        for number in ["body", "chain", "airplane"] {
            assert!(!names.contains(&number), "the number of an agent is no metric: {names:?}");
        }
        assert_eq!(told["values"], json!([]));
        let agents = plain_agents(text, cycle);
        for key in names {
            let told = page.ask(json!({ "do": "agent-metrics", "metric": key }));
            let pointer = format!("/{}", key.replace('.', "/"));
            let expected = agents.iter().map(|agent| match agent.pointer(&pointer) {
                Some(Value::Bool(flag)) => Some(f64::from(u8::from(*flag))),
                value => value.and_then(Value::as_f64),
            });
            let expected: Vec<Option<f64>> = expected.collect();
            assert_eq!(
                (&told["cycle"], &told["values"]),
                (&json!(cycle as f64), &json!(expected)),
                "{key}"
            );
        }
        assert_eq!(page.digest_at(cycle), digest);
    }
}

#[test]
fn a_metric_that_no_agent_has_is_refused_with_those_that_they_have() {
    let (mut page, _) = Page::open(COURIERS, 1);
    let id = page.send(json!({ "do": "agent-metrics", "metric": "counts.kontakts" }));
    let problem = page.wait(id)["problem"].clone();
    assert_eq!(problem["place"], "metric counts.kontakts");
    assert!(problem["remedy"].as_str().expect("text").contains("counts.contacts,"), "{problem}");
}

#[test]
fn a_search_finds_the_events_of_all_cycles_page_by_page() {
    let (mut page, _) = Page::open(COURIERS, 2);
    page.ask(json!({ "do": "play", "speed": "fastest" }));
    page.state("over");
    let all = page.ask(json!({ "do": "events", "from": 0, "until": 9999, "limit": 5000 }));
    let of_robot_3: Vec<&Value> = all["entries"]
        .as_array()
        .expect("events")
        .iter()
        .filter(|event| {
            let is_3 = |body: &Value| body["kind"] == "robot" && body["number"] == 3;
            event["kind"] == "contact" && (is_3(&event["body"]) || is_3(&event["other"]))
        })
        .collect();
    assert!(of_robot_3.len() > 5, "{}", of_robot_3.len());
    let search = |page: &mut Page, skip: usize| {
        let kinds = ["contact"];
        let call = json!({ "do": "find-events", "text": "Robot 3", "kinds": kinds, "skip": skip, "limit": 4 });
        page.ask(call)
    };
    let mut found: Vec<Value> = Vec::new();
    loop {
        let told = search(&mut page, found.len());
        assert_eq!(told["found"], of_robot_3.len());
        assert_eq!(told["searched"], all["entries"].as_array().map(Vec::len).unwrap_or_default());
        let entries = told["entries"].as_array().expect("events");
        if entries.is_empty() {
            break;
        }
        found.extend(entries.iter().cloned());
    }
    assert_eq!(found.iter().collect::<Vec<_>>(), of_robot_3);
}
