//! D1 for chains: the same build, scenario and seed give identical bits for 1, 2, 3 and 8
//! workers, recorded or not, resumed or not (bits.rs); laws and metrics (recount.rs); the report of a
//! run (reports.rs); targets of arms (arms.rs); an agent per connector (team.rs); robots on wheels (wheels.rs).

use sidestep::kernel::Simulation;
use sidestep::kernel::ports::{ColumnValues, MemoryRecorder, Recorder};
use sidestep::scenario::Source;
use sidestep::worlds::chain::metrics::{ChainMetrics, Metrics};
use sidestep::worlds::chain::{ChainRun, ChainWorld, ChainWorldState, chain_run};
use sidestep_kernel::math::hypot;
use std::any::Any;
use std::ops::{Deref, DerefMut};

mod arms;
mod bits;
mod recount;
mod reports;
mod team;
mod wheels;

/// Four chains that wander among pillars in a room of 5 m, and often come near each other.
pub(crate) const SEVERAL: &str = "
[chain]
dt_s = 0.05
[[fields]]
lo_m = [-4.0, -4.0]
hi_m = [4.0, 4.0]
part = 0.05
radius_m = 0.2
[[chains]]
count = 4
apart_m = [0.0, 1.0]
connectors = 8
at_m = [0.0, -1.5]
rod_m = [0.25, 0.35]
radius_m = 0.08
[[chains.tasks]]
kind = \"wander\"
speed_m_s = 1.0
turn_deg = 60
within_m = [[-2.5, -2.5], [2.5, 2.5]]
patience_s = 1000.0
";

/// Two chains, each between two discs that go through each other.
pub(crate) const CAUGHT: &str = r#"
[chain]
dt_s = 0.02
escape_speed_m_s = 1.0
[[obstacles]]
at_m = [0.1, 1.5]
radius_m = 0.4
velocity_m_s = [0.0, -0.5]
[[obstacles]]
at_m = [0.1, -1.5]
radius_m = 0.4
velocity_m_s = [0.0, 0.5]
[[obstacles]]
at_m = [0.3, 9.5]
radius_m = 0.3
velocity_m_s = [0.0, -0.5]
[[obstacles]]
at_m = [0.3, 6.5]
radius_m = 0.5
velocity_m_s = [0.0, 0.5]
[[chains]]
connectors = 12
at_m = [4.0, 0.0]
rod_m = [0.6, 0.8]
radius_m = 0.25
rod_radius_m = 0.05
count = 2
apart_m = [0.0, 8.0]
[[chains.tasks]]
kind = "rest"
"#;

/// One chain that balls fly at, and that gets out of their way.
const DODGING: &str = "
[chain]
dt_s = 0.05
[[fields]]
lo_m = [-4.0, -4.0]
hi_m = [4.0, 4.0]
n = 14
radius_m = [0.1, 0.3]
speed_m_s = [0.2, 0.6]
[[chains]]
connectors = 12
at_m = [2.0, 0.0]
rod_m = [0.3, 0.4]
radius_m = 0.08
[[chains.tasks]]
kind = \"wander\"
speed_m_s = 0.4
within_m = [[-3.0, -3.0], [3.0, 3.0]]
patience_s = 1000.0
";

/// Robots on wheels in a corridor with a bend, and a person who walks to and fro in it.
pub(crate) const SWARM: &str = "
[ground]
corridor = { width_m = 2.4, legs = [{ straight_m = 6 }, { radius_m = 2, turn_deg = 90 }, { straight_m = 4 }] }
[[obstacles]]
at_m = [5.0, 0.9]
radius_m = 0.15
patrol_m = [[5.0, 0.9], [7.0, 0.9]]
speed_m_s = 0.3
[[chains]]
connectors = 5
at_m = [4.0, 0.0]
heading_deg = 0
rod_m = [0.6, 0.8]
rod_radius_m = 0.05
robots = { radius_m = 0.2 }
[[chains.tasks]]
kind = \"navigate\"
speed_m_s = 0.5
navigator = { noise_m = 0.01 }
";

/// A snake in space, past balls that stand still and balls that fly.
pub(crate) const SNAKE: &str = "
[chain]
dimensions = 3
[[fields]]
lo_m = [-3.0, -3.0, -3.0]
hi_m = [3.0, 3.0, 3.0]
part = 0.1
radius_m = 0.3
[[fields]]
lo_m = [-3.0, -3.0, -3.0]
hi_m = [3.0, 3.0, 3.0]
n = 10
radius_m = [0.1, 0.2]
speed_m_s = [0.1, 0.4]
[[chains]]
connectors = 30
at_m = [-1.0, -1.0, 0.0]
along = [0.0, 0.0, -1.0]
rod_m = 0.1
radius_m = 0.03
rod_radius_m = 0.02
[[chains.tasks]]
kind = \"wander\"
speed_m_s = 0.5
turn_deg = 40
patience_s = 1000.0
";

/// A chain that breaks in cycle 10 and is joined from cycle 20 on, and one that stays whole.
pub(crate) const BROKEN: &str = "
[chain]
dt_s = 0.1
self_collision = false
[[chains]]
connectors = 14
at_m = [0.0, 0.0]
rod_m = [0.9, 1.1]
radius_m = 0.1
[[chains.changes]]
at_s = 1.0
scatter = [4, 9]
by_m = 2.0
[[chains.changes]]
at_s = 2.0
reform = true
speed_m_s = 1.0
[[chains.tasks]]
kind = \"script\"
script = \"wait 1 forward 1 turn 90 forward 1\"
[[chains]]
connectors = 3
at_m = [0.0, 40.0]
rod_m = 1.0
[[chains.tasks]]
kind = \"rest\"
lasts_s = 1.0
";

/// Two tasks of an operator, one of targets, and connectors that break down.
pub(crate) const REPORTING: &str = "
[chain]
dt_s = 0.05
[[obstacles]]
at_m = [1.5, 0.6]
radius_m = 0.3
[[chains]]
connectors = 8
at_m = [0.0, 0.0]
rod_m = [0.25, 0.35]
radius_m = 0.05
max_bend_deg = 100
[[chains.limits]]
connector = 3
max_bend_deg = 60
[[chains.changes]]
at_s = 2.0
connector = 7
failed = true
[[chains.changes]]
at_s = 3.0
connector = 7
failed = false
[[chains.tasks]]
kind = \"script\"
script = \"to step :m forward :m turn 30 end repeat 3 [ step 0.5 ]\"
patience_s = 1.0
[[chains.tasks]]
kind = \"targets\"
connector = 7
targets_m = [[-2.0, 1.0], [-1.0, 1.5]]
tolerance_m = 0.05
patience_s = 1.0
";

/// A chain to which nothing can object, so that it may follow several motions at once: anywhere, to
/// places, as a script says, with a connector that fails and works again, and a slack tail.
const OPEN: &str = "
[chain]
dimensions = 3
dt_s = 0.05
self_collision = false
[[chains]]
connectors = 60
at_m = [0.0, 0.0, 0.0]
rod_m = [0.2, 0.3]
radius_m = 0.05
[[chains.changes]]
at_s = 4.0
connector = 30
failed = true
[[chains.changes]]
at_s = 4.5
connector = 30
failed = false
[[chains.tasks]]
kind = \"wander\"
turn_deg = 60
lasts_s = 6.0
[[chains.tasks]]
kind = \"targets\"
targets_m = [[1.0, 1.0, 0.0], [0.0, 1.0, 1.0]]
[[chains.tasks]]
kind = \"script\"
script = \"forward 0.31 wait 0.2 turn 90 forward 0.4 turn 180 forward 0.6\"
";

/// The same in a chain's own way: tight turns, so that its parts come near each other.
const COILED: &str = "
[chain]
dt_s = 0.05
[[chains]]
connectors = 40
at_m = [0.0, 0.0]
rod_m = [0.2, 0.3]
radius_m = 0.08
[[chains.tasks]]
kind = \"wander\"
turn_deg = 90
within_m = [[-1.5, -1.5], [1.5, 1.5]]
patience_s = 1000.0
";

/// An arm with its tool behind a wall around which it knows no way without a plan.
pub(crate) const PLANNED: &str = "
[chain]
dt_s = 0.05
[[obstacles]]
ends_m = [[0.5, 0.35], [2.5, 0.35]]
radius_m = 0.05
[[chains]]
points_m = [[0.0, 0.0], [0.0, -0.4], [0.4, -0.4], [0.4, 0.0], [0.8, 0.0], [1.2, 0.0]]
rod_m = 0.4
radius_m = 0.03
[[chains.limits]]
connector = 0
mobility = \"fixed\"
[[chains.tasks]]
kind = \"targets\"
connector = 5
targets_m = [[1.0, 0.9]]
tolerance_m = 0.005
planner = \"rrt-connect\"
";

pub(crate) fn source(seed: u64, text: &str) -> Source {
    let text = format!("format = 1\nworld = \"chain\"\nseed = {seed}\n{text}");
    Source::new("s.toml", text, "")
}

/// A run with a state that tests look into. It stays behind the face of all worlds, so that the chain
/// is not compiled once more for its tests.
struct TestRun<const D: usize>(Box<dyn Simulation>);

impl<const D: usize> TestRun<D> {
    fn state(&self) -> &ChainWorldState<D> {
        self.chains().state()
    }

    fn world(&self) -> &ChainWorld<D> {
        self.chains().world()
    }

    fn metrics(&self) -> Metrics {
        self.chains().metrics()
    }

    fn chains(&self) -> &ChainRun<D> {
        let run: &dyn Any = &*self.0;
        run.downcast_ref().expect("a run of that many dimensions")
    }
}

impl<const D: usize> Deref for TestRun<D> {
    type Target = dyn Simulation;

    fn deref(&self) -> &dyn Simulation {
        &*self.0
    }
}

impl<const D: usize> DerefMut for TestRun<D> {
    fn deref_mut(&mut self) -> &mut dyn Simulation {
        &mut *self.0
    }
}

fn run<const D: usize>(source: &Source, workers: usize) -> TestRun<D> {
    let mut run = chain_run(source, workers).unwrap_or_else(|e| panic!("{e}"));
    let chains: &mut dyn Any = &mut *run;
    chains.downcast_mut::<ChainRun<D>>().expect("of that many dimensions").force_parallel();
    TestRun(run)
}

/// Advances the run to a cycle, or to the end of all tasks.
fn advance_to<const D: usize>(run: &mut TestRun<D>, cycle: u64) {
    while run.cycle() < cycle && !run.is_over() {
        let left = cycle - run.cycle();
        run.advance(left);
    }
}

fn recorded<const D: usize>(
    source: &Source,
    workers: usize,
    cycles: u64,
) -> (TestRun<D>, MemoryRecorder) {
    let mut run = run::<D>(source, workers);
    run.start_recording();
    let mut recorder = MemoryRecorder::new(&run.schemas());
    while run.cycle() < cycles && !run.is_over() {
        let left = cycles - run.cycle();
        run.advance(left.min(7));
        run.record(&mut recorder).expect("memory has room");
    }
    recorder.finish().expect("memory has room");
    (run, recorder)
}

/// The outcome of each chain; nothing in it is about time that was spent.
fn outcome<const D: usize>(run: &TestRun<D>) -> String {
    let one = |slot| format!("{:?}", run.world().chain_metrics(run.state(), slot));
    (0..run.state().len()).map(one).collect()
}

fn assert_d1<const D: usize>(text: &str, cycles: u64, stops: &[u64]) {
    let source = source(3, text);
    let mut alone = run::<D>(&source, 1);
    advance_to(&mut alone, cycles);
    for workers in [2, 3, 8] {
        let mut team = run::<D>(&source, workers);
        advance_to(&mut team, cycles);
        assert_eq!(team.digest(), alone.digest(), "{workers} workers, {text}");
        assert_eq!(outcome(&team), outcome(&alone), "{workers} workers, {text}");
    }
    let (kept, rows) = recorded::<D>(&source, 1, cycles);
    assert_eq!(kept.digest(), alone.digest(), "recorded, {text}");
    assert_eq!(outcome(&kept), outcome(&alone), "recorded, {text}");
    let (_, same) = recorded::<D>(&source, 3, cycles);
    assert!(rows == same, "rows differ for 3 workers, {text}");
    let mut first = run::<D>(&source, 2);
    for &stop in stops {
        advance_to(&mut first, stop);
        let saved = first.checkpoint();
        let mut second = run::<D>(&source, 3);
        second.restore(&saved).expect("its own checkpoint");
        assert_eq!((second.cycle(), second.digest()), (first.cycle(), first.digest()));
        assert_eq!(second.checkpoint(), saved, "a checkpoint is a function of the state");
        advance_to(&mut second, cycles);
        assert_eq!(second.digest(), alone.digest(), "resumed at {stop}, {text}");
        assert_eq!(outcome(&second), outcome(&alone), "resumed at {stop}, {text}");
    }
}
