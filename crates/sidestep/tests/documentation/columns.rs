//! The book's chapter of columns says what the program declares: no column more, none less, with its unit.
//!
//! The tables between the marks of the chapter are written by `SIDESTEP_WRITE=columns cargo test -p sidestep
//! --test documentation`.

use super::{read, root};
use serde_json::Value;
use sidestep::kernel::Simulation;
use sidestep::kernel::control::ValueSpace;
use sidestep::kernel::ports::{ColumnSpec, TableSchema};
use sidestep::scenario::{MetricInfo, Source, metric_label};
use sidestep::worlds::WORLDS;
use std::fmt::Write;
use std::sync::{Mutex, PoisonError};

const CHAPTER: &str = "docs/src/columns.md";

/// A scenario of each world that records every table there is.
const SCENARIOS: [(&str, &str); 3] = [
    (
        "robots",
        "[map]\nascii = \"....\\n....\"\n[robots]\ncount = 1\nsensors = [\"sonar-8\", \"lidar\"]\n\
         effector = \"late\"\n[effectors.late]\nforward = [{ p = 1, path = \"F\" }]\n\
         delays = { p = 0.1, min = 1, max = 2 }\n[record]\ncalibration = true\n[sensors.lidar]\nbearings_deg = [0]\nrange_m = 1.0\n\
         observations = [\"nothing\", \"wall\"]\ndesignates = { robot = \"wall\" }\n\
         beam = { hit = 1, short = 0, max = 0, random = 0, sigma_hit_m = 0.1, lambda_short_per_m = 1 }\n",
    ),
    ("airspace", "[airspace.generator]\nkind = \"superconflict\"\nn = 2\n"),
    (
        "chain",
        "[[obstacles]]\nat_m = [3.0, 2.0]\nradius_m = 0.2\npatrol_m = [[3.0, 2.0], [3.0, 3.0]]\nspeed_m_s = 0.1\n\
         [[chains]]\nconnectors = 3\nat_m = [0.0, 0.0]\nrod_m = 0.7\nrobots = { radius_m = 0.2 }\n\
         [[chains.tasks]]\nkind = \"navigate\"\n",
    ),
];

/// A scenario of each world with an agent that is decided from outside.
const EXTERNAL: [(&str, &str); 3] = [
    (
        "robots",
        "[map]\nascii = \"....\"\n[radio]\nrange_m = 100\n[robots]\ncount = 2\nsensors = [\"sonar-8\"]\n\
         effector = \"nomad\"\nbehaviour = { kind = \"external\" }\n",
    ),
    (
        "airspace",
        "[airspace]\nmethod = \"external\"\n[airspace.generator]\nkind = \"superconflict\"\nn = 2\n",
    ),
    (
        "chain",
        "[[chains]]\nconnectors = 3\nat_m = [0.0, 0.0]\nrod_m = 0.7\n\
         [[chains.tasks]]\nkind = \"external\"\n",
    ),
];

/// A scenario whose airplanes may be flown from outside.
const FLOWN: &str = "[airspace]\ndeployment = \"team\"\n[airspace.generator]\nkind = \"superconflict\"\nn = 2\n\
                     [record]\ncontrols = true\n";

/// An arm, with joints that are a table that no other chain has.
const ARM: &str = "[chain]\ndimensions = 3\n[[chains]]\narm = { urdf = \"scenarios/chain/arm.urdf\" }\n\
                   [[chains.tasks]]\nkind = \"rest\"\n";

/// The table of metrics over time.
const SERIES: &str = "series";

fn started(world: &str, scenario: &str) -> Box<dyn Simulation> {
    let text = format!("format = 1\nworld = \"{world}\"\n{scenario}");
    let source = Source::new(world, &text, root());
    let compiled = WORLDS.compile(&source).unwrap_or_else(|error| panic!("{error}"));
    let mut run = compiled.start(&source, 1);
    run.start_recording();
    // Some metrics are there from the first cycle on only.
    run.advance(1);
    run
}

/// Returns the part of the chapter between the marks of a name.
fn marked<'a>(chapter: &'a str, name: &str) -> &'a str {
    let begin = format!("<!-- {name} -->\n");
    let from = chapter.find(&begin).unwrap_or_else(|| panic!("{CHAPTER} has no mark {begin}"));
    let rest = &chapter[from + begin.len()..];
    &rest[..rest.find("<!-- end -->").expect("the end of a marked part")]
}

fn row(column: &ColumnSpec) -> String {
    let (unit, ty) = (column.unit().unwrap_or(""), column.ty.name());
    let missing = if column.is_nullable { "; may be missing" } else { "" };
    format!("| `{}` | {ty} | {unit} | {}{missing} |\n", column.name, column.meaning)
}

fn rendered(schemas: &[TableSchema]) -> String {
    let mut text = String::new();
    for schema in schemas {
        write!(text, "\n### `{}`\n\n| column | type | unit | meaning |\n", schema.name)
            .expect("text");
        text += "| --- | --- | --- | --- |\n";
        schema.columns.iter().for_each(|column| text += &row(column));
    }
    text + "\n"
}

/// Returns spaces as a table, a row each, in the order in which arrays have them.
fn rendered_spaces(spaces: &[ValueSpace]) -> String {
    let mut text = "\n| | name | shape | unit | values | meaning |\n".to_string();
    text += "| --- | --- | --- | --- | --- | --- |\n";
    for (k, space) in spaces.iter().enumerate() {
        let shape: Vec<_> = space.shape.iter().map(ToString::to_string).collect();
        let (name, unit, words) = (&space.name, space.unit().unwrap_or(""), space.describe());
        let (shape, meaning) = (shape.join(" x "), &space.meaning);
        writeln!(text, "| {k} | `{name}` | {shape} | {unit} | {words} | {meaning} |")
            .expect("text");
    }
    text + "\n"
}

/// Returns a run's metrics with their names; counts by kind of something are one, by reason too.
fn metrics<'a>(value: &'a Value, path: &str) -> Vec<(String, &'a Value)> {
    let name = path.trim_start_matches('.').to_string();
    match value.as_object() {
        Some(members) if !is_by_kind(&name) => members
            .iter()
            .flat_map(|(key, value)| metrics(value, &format!("{path}.{key}")))
            .collect(),
        _ => vec![(name, value)],
    }
}

/// Returns whether a metric has a number for every kind or reason.
fn is_by_kind(name: &str) -> bool {
    name.contains("_by_")
}

/// Returns the name of a metric, or of one of a metric's numbers by kind, under which its world has words.
fn labeled_name(name: &str) -> String {
    if is_by_kind(name) { format!("{name}.some") } else { name.to_string() }
}

/// Returns metrics as a table, with the words of their world.
fn rendered_metrics(metrics: &[(String, &Value)], infos: &[MetricInfo]) -> String {
    let mut text = "\n| metric | unit | meaning |\n| --- | --- | --- |\n".to_string();
    for (name, value) in metrics {
        let label = metric_label(infos, &labeled_name(name));
        let (unit, meaning) = (label.unit.unwrap_or(""), label.meaning);
        let counted = format!("{name}_count");
        let meaning = if is_by_kind(name) {
            let first = value.as_object().and_then(|kinds| kinds.keys().next());
            let example =
                first.map_or_else(String::new, |kind| format!(", such as `{name}.{kind}`"));
            format!("{meaning} (in sweeps a column for each{example})")
        } else if value.is_array() && infos.iter().any(|info| info.name == counted) {
            format!("list: {meaning} (in sweeps their number, `{counted}`)")
        } else if value.is_array() {
            format!("list: {meaning} (not in sweeps)")
        } else {
            meaning.into()
        };
        writeln!(text, "| `{name}` | {unit} | {meaning} |").expect("text");
    }
    text + "\n"
}

/// Compares a marked part of the chapter with the expected text, or writes it.
fn compare(name: &str, expected: &str) {
    // Two tests that write would undo each other's parts.
    static WRITING: Mutex<()> = Mutex::new(());
    let _one = WRITING.lock().unwrap_or_else(PoisonError::into_inner);
    let chapter = read(CHAPTER);
    let mark = format!("<!-- {name} -->\n");
    let found = marked(&chapter, name);
    if std::env::var("SIDESTEP_WRITE").is_ok_and(|what| what == "columns") {
        let chapter = chapter.replace(&format!("{mark}{found}"), &format!("{mark}{expected}"));
        std::fs::write(root().join(CHAPTER), &chapter).expect("written");
    } else {
        assert_eq!(found, expected, "to write it: see the head of {}", file!());
    }
}

#[test]
fn the_chapter_of_columns_has_the_tables_that_a_run_declares() {
    for (world, scenario) in SCENARIOS {
        let mut schemas = started(world, scenario).schemas();
        // Its columns are the metrics, which the chapter lists in tables of their own.
        schemas.retain(|schema| schema.name != SERIES);
        compare(&format!("tables of {world}"), &rendered(&schemas));
    }
    let mut of_arms = started("chain", ARM).schemas();
    of_arms.retain(|schema| schema.name == "joints");
    compare("tables of arms", &rendered(&of_arms));
    let only = |table: &str, (world, scenario)| {
        let schemas = started(world, scenario).schemas();
        rendered(&schemas.into_iter().filter(|schema| schema.name == table).collect::<Vec<_>>())
    };
    compare("tables of controls", &only("controls", ("airspace", FLOWN)));
    let of_worlds = EXTERNAL.map(|external| only("orders", external));
    compare("tables of orders", &of_worlds[0]);
    assert!(of_worlds.iter().all(|one| *one == of_worlds[0]), "{of_worlds:?}");
}

#[test]
fn the_chapter_of_columns_has_what_agents_observe_and_take() {
    for (world, scenario) in EXTERNAL {
        let run = started(world, scenario);
        let team = &run.agent_teams()[0];
        compare(&format!("observed of {world}"), &rendered_spaces(&team.observation_spaces));
        compare(&format!("ordered of {world}"), &rendered_spaces(&team.action_spaces));
    }
}

#[test]
fn the_chapter_of_columns_names_every_event_and_no_other() {
    let chapter = read(CHAPTER);
    for (world, scenario) in SCENARIOS {
        let schemas = started(world, scenario).schemas();
        let events = schemas.iter().find(|schema| schema.name == "events").expect("events");
        let event = events.columns.iter().find(|column| column.name == "event").expect("a kind");
        let rows = marked(&chapter, &format!("events of {world}")).lines();
        let name = |row: &str| row.strip_prefix("| `")?.split('`').next().map(String::from);
        let named: Vec<String> = rows.filter_map(name).collect();
        assert_eq!(named, event.labels, "events of {world}");
    }
}

#[test]
fn every_metric_is_told_in_words_with_a_meaning() {
    for (world, scenario) in SCENARIOS {
        let meanings = WORLDS.find(world).expect("a world").metric_infos();
        let found = started(world, scenario).metrics();
        for (name, _) in metrics(&found, "") {
            let label = metric_label(meanings, &labeled_name(&name));
            assert_ne!(label.meaning, "", "{world}: `{name}`");
        }
    }
}

#[test]
fn every_column_of_metrics_over_time_is_told_in_words_and_no_number_is_left_out() {
    for (world, scenario) in SCENARIOS {
        let run = started(world, scenario);
        let schemas = run.schemas();
        let series =
            schemas.iter().find(|schema| schema.name == SERIES).expect("metrics over time");
        for column in &series.columns {
            assert_ne!(column.meaning, "", "{world}: `{}`", column.name);
        }
        let columns: Vec<_> = series.columns.iter().map(|column| column.name.as_str()).collect();
        for (name, value) in metrics(&run.metrics(), "") {
            let is_one = !value.is_array() && !value.is_object() && !name.ends_with("cpu_s");
            assert_eq!(columns.contains(&name.as_str()), is_one, "{world}: `{name}`");
        }
    }
}

#[test]
fn the_chapter_of_columns_has_every_metric_in_the_words_of_its_world() {
    for (world, scenario) in SCENARIOS {
        let infos = WORLDS.find(world).expect("a world").metric_infos();
        let found = started(world, scenario).metrics();
        let expected = rendered_metrics(&metrics(&found, ""), infos);
        compare(&format!("metrics of {world}"), &expected);
    }
}
