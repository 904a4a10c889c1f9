//! Parts of a program's own keep D1: same build, scenario, seed: identical bits for 1, 2, 3, 8 workers, recorded or
//! not, resumed or not. They are used by name, as built-in ones are.

use sidestep::experiment::sweep::{Factor, Setting, Sweep, SweepOverrides};
use sidestep::kernel::stream::Draws;
use sidestep::rods::VetoReason;
use sidestep::rods::geometry::{Point, add, scaled, sub};
use sidestep::scenario::{Source, Worlds};
use sidestep::session::sweep::{SweepEnd, run_in_memory};
use sidestep::session::{ManagedRun, NoWatcher};
use sidestep::worlds::WORLDS;
use sidestep::worlds::airspace::Airspace;
use sidestep::worlds::airspace::method::{Method, MethodPercept, Steering};
use sidestep::worlds::chain::{
    Chains, Driver, DriverAction, DriverMemory, DriverPercept, MasterMove, Reaction,
};
use sidestep::worlds::robots::Robots;
use sidestep::worlds::robots::decide::{self, Behaviour, Decision};
use sidestep::worlds::robots::effector::{FORWARD, LEFT};
use sidestep::{Run, Scenario};
use std::path::Path;

const ROBOTS: &str = r#"format = 1
world = "robots"
cycles = 120
map = { office = { corridors = 1, rooms_per_side = 2 } }
robots = { count = 6, size = 2, sensors = ["sonar-8"], effector = "nomad", behaviour = { kind = "dice" } }
record = { checkpoint_every = 20 }"#;

const AIRPLANES: &str = r#"format = 1
world = "airspace"
cycles = 60
airspace = { method = "swerve", generator = { kind = "superconflict", n = 8 } }
record = { checkpoint_every = 10 }"#;

const CHAINS: &str = r#"format = 1
world = "chain"
cycles = 200
record = { checkpoint_every = 30 }
[chain]
rotation = "stiff"
[[obstacles]]
at_m = [2.0, 0.3]
radius_m = 0.3
[[chains]]
connectors = 6
at_m = [0.0, 0.0]
rod_m = [0.4, 0.5]
tasks = [{ kind = "dice" }]
[[chains]]
connectors = 4
at_m = [0.0, 3.0]
rod_m = 0.5
tasks = [{ kind = "dice", lasts_s = 1.0 }, { kind = "wander" }]"#;

#[derive(Debug)]
struct Dice;

impl Behaviour for Dice {
    fn decide(
        &self,
        _: &decide::Percept<'_>,
        memory: &mut decide::Memory,
        draws: &mut Draws,
    ) -> Decision {
        memory.words[0] += 1;
        if draws.uniform() < 0.3 { LEFT.into() } else { FORWARD.into() }
    }
}

impl Method for Dice {
    fn decide(&self, percept: &MethodPercept<'_>, draws: &mut Draws) -> Steering {
        let side = if draws.uniform() < 0.5 { 1.0 } else { -1.0 };
        match percept.others.len() {
            0 => Steering::Proceed,
            1..4 => Steering::TurnRate(side * percept.omega_max_rad_s),
            _ => Steering::Heading(percept.own.preferred_rad - 0.5 * draws.uniform()),
        }
    }
}

/// Goes ahead, and turns by a random angle now and then.
impl Driver for Dice {
    fn decide(
        &self,
        percept: &DriverPercept<'_>,
        memory: &mut DriverMemory,
        draws: &mut Draws,
    ) -> DriverAction {
        memory.words[0] += 1;
        let at = percept.connectors_m[percept.connector];
        let [x, y, _] = percept.ahead;
        let turn = if memory.words[0].is_multiple_of(5) { draws.uniform() - 0.5 } else { 0.0 };
        let near = percept.obstacles.first().map_or([0.0; 3], |one| one.to_surface_m);
        let ahead = [x - turn * y - 0.1 * near[0], y + turn * x - 0.1 * near[1], 0.0];
        DriverAction::GoTo(add(at, ahead))
    }
}

/// Follows as the built-in reaction does, but gives way to nothing: where it may not be, it vetoes.
#[derive(Debug)]
struct Stiff;

impl Reaction for Stiff {
    fn react(&self, percept: &MasterMove<'_>) -> Result<Point<3>, VetoReason> {
        percept.check(percept.guided_m)?;
        Ok(percept.guided_m)
    }
}

/// Follows half a millimeter beside the line to its master, and a little nearer, where it may.
#[derive(Debug)]
struct Sloppy;

impl Reaction for Sloppy {
    fn react(&self, percept: &MasterMove<'_>) -> Result<Point<3>, VetoReason> {
        let [x, y, _] = sub(percept.guided_m, percept.master_to_m);
        let beside = add(percept.master_to_m, scaled([x - 1e-3 * y, y + 1e-3 * x, 0.0], 0.9999));
        Ok(if percept.check(beside).is_ok() { beside } else { percept.guided_m })
    }
}

fn worlds() -> Worlds {
    let chains = Chains::new().with_driver("dice", Dice);
    let chains = chains.with_reaction("stiff", Stiff).with_reaction("sloppy", Sloppy);
    WORLDS
        .clone()
        .with(Robots::new().with_behaviour("dice", Dice))
        .with(Airspace::new().with_method("swerve", Dice))
        .with(chains)
}

fn start(text: &str, workers: usize) -> Run {
    let scenario = Scenario::parse(&worlds(), text).workers(workers);
    scenario.start().unwrap_or_else(|error| panic!("{error}"))
}

fn digest(text: &str, workers: usize) -> String {
    start(text, workers).finish().expect("it runs").digest
}

/// Records a run up to a cycle, as if its process had been killed there, and resumes it to its end.
fn resumed(text: &str, stop: u64, folder: &Path) -> String {
    let mut run = Scenario::parse(&worlds(), text).workers(2).record_to(folder).start().unwrap();
    run.advance(stop).expect("room");
    run.stop().expect("room");
    let run = ManagedRun::resume(&worlds(), folder, 1, None).expect("its own build");
    run.run_to_end(&NoWatcher).expect("room").digest
}

#[test]
fn bits_do_not_depend_on_workers_or_pauses() {
    let sloppy = CHAINS.replace("stiff", "sloppy");
    for text in [ROBOTS, AIRPLANES, CHAINS, &sloppy] {
        let whole = digest(text, 1);
        for workers in [2, 3, 8] {
            assert_eq!(digest(text, workers), whole, "{workers} workers: {text}");
        }
        let folder = tempfile::tempdir().expect("a folder");
        assert_eq!(resumed(text, 17, &folder.path().join("run")), whole, "{text}");
    }
    assert_ne!(digest(CHAINS, 1), digest(&sloppy, 1), "a reaction changes nothing");
}

#[test]
fn agents_that_talk_come_to_what_one_process_comes_to() {
    let team = AIRPLANES.replace("method =", "deployment = \"team\", method =");
    assert_eq!(digest(&team, 2), digest(AIRPLANES, 2));
    for reaction in ["stiff", "sloppy"] {
        let direct = CHAINS.replace(
            "\"stiff\"",
            &format!("\"{reaction}\"\nself_collision = false\nbacktracks = 0"),
        );
        let team = direct.replace("[chain]", "[chain]\ndeployment = \"team\"");
        assert_eq!(digest(&team, 2), digest(&direct, 1), "{reaction}");
    }
}

#[test]
fn sweeps_run_own_parts_on_any_number_of_workers() {
    for (text, key) in [
        (ROBOTS, "robots.count=4,6"),
        (AIRPLANES, "airspace.method=swerve,orca"),
        (CHAINS, "chain.rotation=stiff,sloppy,union"),
    ] {
        let table = |workers: usize| {
            let changes = SweepOverrides {
                fixed: vec![Setting::parse("cycles=40").expect("a setting")],
                factors: vec![Factor::parse(key).expect("a factor")],
                replicates: Some(2),
                ..SweepOverrides::default()
            };
            let sweep = Sweep::from_source(Source::new("s.toml", text, ""));
            let sweep = sweep.with_overrides(changes).expect("it fits");
            let (_, end) = run_in_memory(&worlds(), &sweep, workers, &NoWatcher).expect("it runs");
            let SweepEnd::Done(result) = end else { panic!("nothing interrupts it") };
            // Without the times that the runs took.
            result.table.results().into_iter().cloned().collect::<Vec<_>>()
        };
        assert_eq!(table(1), table(2), "{key}");
    }
}

#[test]
fn an_unknown_name_is_an_error_with_a_remedy() {
    for (text, name, cause, remedy) in [
        (ROBOTS, "dice", "unknown behaviour `dcie`", "did you mean `dice`?"),
        (AIRPLANES, "swerve", "unknown value `swevre`", "did you mean `swerve`?"),
        (CHAINS, "stiff", "unknown value `stif`", "did you mean `stiff`?"),
        (CHAINS, "dice", "unknown value `dcie`", "did you mean `dice`?"),
    ] {
        let wrong = cause.split('`').nth(1).expect("a name");
        let text = text.replace(&format!("\"{name}\""), &format!("\"{wrong}\""));
        let problems = Scenario::parse(&worlds(), &text).check().expect_err("refused");
        let problem = &problems.0[0];
        assert_eq!((problem.cause(), problem.remedy()), (cause, remedy));
        let (line, column) = problem.line_and_column().expect("a position");
        let at = text.lines().nth(line - 1).expect("a line");
        assert!(at[column - 1..].starts_with(&format!("\"{wrong}\"")), "{at}, column {column}");
    }
    let known = Scenario::parse(&WORLDS, AIRPLANES).check().expect_err("it is not built in");
    assert_eq!(known.0[0].remedy(), "known are: pc, orca, mvp, bands, none, external");
}

#[test]
fn schemas_list_the_names_of_own_parts() {
    for (world, name) in [("robots", "dice"), ("airspace", "swerve"), ("chain", "stiff")] {
        let schema = |worlds: &Worlds| worlds.schema(Some(world)).expect("a world").to_string();
        assert!(schema(&worlds()).contains(&format!("\"{name}\"")), "{world}");
        assert!(!schema(&WORLDS).contains(&format!("\"{name}\"")), "{world}");
    }
}
