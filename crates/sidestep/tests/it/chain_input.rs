//! E1 for chains: a scenario with any contents is refused or runs; nothing panics.

use sidestep::kernel::Simulation;
use sidestep::scenario::Source;
use sidestep::worlds::chain::chain_run;
use toml::Value;

const FOLDER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenarios/chain");
const NUMBERS: [f64; 7] = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 0.0, -1.0, 1e300, 1e-300];
const COUNTS: [i64; 5] = [0, -1, 1_000_000_000_000, i64::MAX, i64::MIN];

/// All scenarios that there are of a number, each with another one in its place.
fn mutants(value: &Value) -> Vec<Value> {
    fn put(of: Vec<Value>, whole: impl Fn(Value) -> Value) -> Vec<Value> {
        of.into_iter().map(whole).collect()
    }
    match value {
        Value::Float(_) => NUMBERS.map(Value::Float).to_vec(),
        Value::Integer(_) => {
            COUNTS.map(Value::Integer).into_iter().chain(NUMBERS.map(Value::Float)).collect()
        }
        Value::Array(items) => {
            let at = |k: usize| {
                put(mutants(&items[k]), |changed| {
                    let mut items = items.clone();
                    items[k] = changed;
                    Value::Array(items)
                })
            };
            (0..items.len()).flat_map(at).collect()
        }
        Value::Table(table) => {
            let at = |(key, item): (&String, &Value)| {
                put(mutants(item), |changed| {
                    let mut table = table.clone();
                    table.insert(key.clone(), changed);
                    Value::Table(table)
                })
            };
            table.iter().flat_map(at).collect()
        }
        _ => Vec::new(),
    }
}

fn text_of(mutant: &Value) -> String {
    toml::to_string(mutant).expect("a table")
}

fn try_out(mut run: Box<dyn Simulation>) {
    run.start_recording();
    run.advance(3);
    run.metrics();
    run.digest();
}

/// The numbers of those that were refused, and of those that ran.
fn try_all(text: &str) -> [usize; 2] {
    let table: toml::Table = text.parse().expect("a right scenario");
    let mut told = [0; 2];
    for mutant in mutants(&Value::Table(table)) {
        let source = Source::new("s.toml", text_of(&mutant), FOLDER);
        match chain_run(&source, 1) {
            Err(error) => {
                assert!(!error.cause().is_empty() && !error.remedy().is_empty(), "{error}");
                told[0] += 1;
            }
            Ok(run) => {
                try_out(run);
                told[1] += 1;
            }
        }
    }
    told
}

fn shipped(name: &str) -> String {
    std::fs::read_to_string(format!("{FOLDER}/{name}")).expect(name)
}

fn assert_robust(text: &str) {
    let [refused, ran] = try_all(text);
    assert!(refused > 20 && ran > 20, "{refused} refused, {ran} ran");
}

#[test]
fn no_number_in_the_scenario_of_a_team_panics() {
    assert_robust(&shipped("team.toml").replace("from_s = 12.0", "from_s = 0.05").replace(
        "loss = 0.05",
        "loss = 0.05\nduplication = 0.1\nlatency_s = 1e-5\npatience_s = 2e-4\ndeadline_s = 0.04\n\
         one_way = [{ sender = 1, receiver = 2, chain = 0, from_s = 0.0, until_s = 0.1 }]",
    ));
}

#[test]
fn no_number_in_the_scenario_of_an_arm_panics() {
    assert_robust(&shipped("arm.toml"));
}

#[test]
fn no_number_in_the_scenario_of_a_broken_chain_panics() {
    assert_robust(
        &shipped("broken.toml")
            .replace("at_s = 1.0", "at_s = 0.0")
            .replace("at_s = 3.0", "at_s = 0.02"),
    );
}

#[test]
fn no_number_in_the_scenario_of_a_corridor_panics() {
    assert_robust(&shipped("pushed-and-pulled.toml"));
    assert_robust(&shipped("serpentine.toml").replace(
        "navigator = { noise_m = 0.01 }",
        "navigator = { near_m = 0.7, far_m = 0.9, lost_m = 3.0, \
        sector_deg = [30.0, 80.0], beams = 90, range_m = 3.0, field_deg = 180.0, noise_m = 0.01, \
        wheelbase_m = 0.4, target_m = [9.0, 9.0], tolerance_m = 0.5, detects_from_m = 9.0 }",
    ));
}

#[test]
fn no_number_in_the_scenario_of_a_snake_panics() {
    let text = shipped("snake3d.toml");
    assert_robust(
        &text
            .replace("connectors = 450", "connectors = 40")
            .replace("12.0", "3.0")
            .replace("11.0", "2.0")
            .replace("n = 60", "n = 8"),
    );
}

/// Everything that no scenario of those above has.
#[test]
fn no_number_anywhere_else_panics() {
    assert_robust(
        r#"
format = 1
world = "chain"
[chain]
dimensions = 2
dt_s = 0.05
step_m = 0.02
slave_step_max_m = 0.5
backtracks = 10
look_m = 0.5
escape_speed_m_s = 1.0
[record]
every = 2
checkpoint_every = 10
[[obstacles]]
at_m = [3.0, 3.0]
size_m = [1.0, 0.5]
turn_deg = 30.0
velocity_m_s = [0.5, 0.1]
bounces_m = [[0.0, 0.0], [6.0, 6.0]]
[[obstacles]]
ends_m = [[-3.0, 3.0], [-2.0, 3.0]]
radius_m = 0.1
patrol_m = [[-3.0, 3.0], [-2.0, 3.5], [-2.0, 4.0]]
speed_m_s = 0.4
closed = true
[[obstacles]]
corners_m = [[4.0, -4.0], [5.0, -4.0], [5.0, -3.0]]
radius_m = 0.05
[[fields]]
lo_m = [-9.0, -9.0]
hi_m = [-5.0, -5.0]
fill_fraction = 0.1
radius_m = 0.1
length_m = 0.3
keep_m = 0.2
[[chains]]
name = "one"
count = 2
apart_m = [0.0, 1.0]
connectors = 6
at_m = [0.0, 0.0]
heading_deg = 10.0
rod_m = [0.4, 0.5]
radius_m = 0.05
rod_radius_m = 0.02
max_bend_deg = 90.0
[[chains.limits]]
connector = 2
max_bend_deg = 60.0
radius_m = 0.04
[[chains.changes]]
at_s = 0.05
connector = 3
mobility = { in_box = [[-9.0, -9.0], [9.0, 9.0]] }
[[chains.changes]]
at_s = 0.1
connector = 3
max_bend_deg = 50.0
[[chains.tasks]]
kind = "targets"
connector = 0
speed_m_s = 0.5
lasts_s = 0.1
patience_s = 0.05
targets_m = [[1.0, 0.5]]
tolerance_m = 0.01
[[chains.tasks]]
kind = "wander"
turn_deg = 20.0
within_m = [[-5.0, -5.0], [5.0, 5.0]]
[[chains]]
points_m = [[-2.0, -2.0], [-2.0, -2.5]]
rod_m = 0.5
radius_m = 0.25
robots = { margin_m = 0.05, wheelbase_m = 0.3, wheel_speed_m_s = 1.0, sensors_m = 0.6, lag_limit_m = 0.2, gain_per_s = 2.0, turn_gain_per_s = 3.0 }
[[chains.tasks]]
kind = "navigate"
"#.replace("radius_m = 0.25\n", "").as_str(),
    );
}
