//! D1 for many worlds at once: a world of a batch has the bits of a run of its own, on any number of workers and
//! independently of the others; a fresh start by seed is that of a scenario compiled with it.

use crate::chain::SEVERAL;
use crate::common::CROWD;
use sidestep::kernel::batch::{Batch, BatchError, SimulationFactory};
use sidestep::kernel::control::{BufferMut, MultiAgentOrder, OrderError};
use sidestep::kernel::stream::Draws;
use sidestep::kernel::{Digest, InputError, Simulation};
use sidestep::scenario::{CompiledScenario, Source};
use sidestep::worlds::WORLDS;
use sidestep::worlds::robots;
use sidestep::worlds::robots::decide::{Behaviour, Decision, Memory, Percept};
use sidestep::worlds::robots::scenario::{Behaviours, StorageOrder};
use std::fmt::Write;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;

const WANDERING: &str = "[[obstacles]]\nat_m = [1.0, 0.9]\nradius_m = 0.2\n[[chains]]\nconnectors = 6\n\
    at_m = [0.0, 0.0]\nrod_m = 0.3\nradius_m = 0.08\n[[chains.tasks]]\nkind = \"wander\"\n";
const ANYWHERE: &str = "[ground]\nmap = \"m.yaml\"\n[[chains]]\nconnectors = 3\nanywhere = true\nrod_m = 0.3\n\
    radius_m = 0.1\n[[chains.tasks]]\nkind = \"wander\"\n";
const PLANNED: &str = "[[airplanes]]\nat_m = [5000, 500]\nheading_deg = 180\nway_points_m = [[-5000, 500]]\n\
    [[airplanes]]\nat_m = [-5000, 600]\nheading_deg = 0\nway_points_m = [[5000, 400]]\n\
    orders = [{ at_s = 60.0, heading_deg = 10.0 }]\n";
const DRAWN: &str = "[airspace.generator]\nkind = \"random\"\nn = 9\n";
/// External robots with beams, among others.
const ORDERED: &str = "[map]\nascii = \"\"\"\nMAP\"\"\"\n[radio]\nrange_m = 50\n[[robots]]\ncount = 6\n\
    sensors = [\"sonar-8\"]\neffector = \"nomad\"\nbehaviour = { kind = \"external\" }\n[[robots]]\ncount = 3\n";

fn source(world: &str, more: &str, seed: u64) -> Source {
    let more = more.replace("MAP", &"............\n".repeat(9));
    Source::new("s", format!("format = 1\nworld = \"{world}\"\nseed = {seed}\n{more}"), "")
}

fn compiled(source: &Source) -> Box<dyn CompiledScenario> {
    WORLDS.compile(source).unwrap_or_else(|error| panic!("{error}"))
}

/// Returns all that depends on a seed: the digest after some cycles, the teams, and the texts about the scenario.
fn seed_dependent_output(compiled: &dyn CompiledScenario, source: &Source) -> (Digest, String) {
    let mut run = compiled.start(source, 1);
    let mut told = format!("{:?}", run.agent_teams());
    write!(told, "{:?}{:?}", compiled.contents(source), compiled.plan()).expect("text");
    run.advance(40);
    write!(told, "{:?}", run.metrics()["arrived"]).expect("text");
    (run.digest(), told)
}

fn assert_fresh_starts_are_those_of_compiling(of: impl Fn(u64) -> Source) {
    let (first, before) = (compiled(&of(1)), seed_dependent_output(&*compiled(&of(1)), &of(1)));
    let mut last = None;
    for seed in [2, 99, u64::MAX >> 1] {
        let again = first.reseeded(seed).expect("it takes less").expect("there is room");
        assert_eq!(
            seed_dependent_output(&*again, &of(seed)),
            seed_dependent_output(&*compiled(&of(seed)), &of(seed)),
            "{seed}"
        );
        last = Some(again);
    }
    // Of a fresh start another one, and the first is as it was.
    let back = last.expect("some").reseeded(1).expect("it takes less").expect("there is room");
    assert_eq!(seed_dependent_output(&*back, &of(1)), before);
    assert_eq!(seed_dependent_output(&*first, &of(1)), before);
}

#[test]
fn a_fresh_start_of_chains_is_that_of_compiling() {
    let folder = tempfile::tempdir().expect("a folder");
    let map = "P2\n40 20\n255\n".to_string() + &"254 ".repeat(800);
    std::fs::write(folder.path().join("m.pgm"), map).expect("written");
    let about = "image: m.pgm\nresolution: 0.25\norigin: [0, 0, 0]\nnegate: 0\n\
                 occupied_thresh: 0.65\nfree_thresh: 0.196\n";
    std::fs::write(folder.path().join("m.yaml"), about).expect("written");
    for more in [WANDERING, SEVERAL, ANYWHERE] {
        assert_fresh_starts_are_those_of_compiling(|seed| Source {
            folder: folder.path().into(),
            ..source("chain", more, seed)
        });
    }
}

#[test]
fn a_fresh_start_of_airplanes_is_that_of_compiling() {
    let erring = "[airspace]\nposition_noise_m = 20.0\nheading_noise_deg = 0.5\n";
    let paper = "[airspace]\npreset = \"paper\"\nmax_rounds = 5\n";
    for more in [
        PLANNED.to_string(),
        DRAWN.to_string(),
        format!("{erring}{PLANNED}"),
        format!("{erring}{DRAWN}{PLANNED}"),
        format!("{paper}{PLANNED}"),
    ] {
        assert_fresh_starts_are_those_of_compiling(|seed| source("airspace", &more, seed));
    }
}

#[test]
fn a_fresh_start_of_robots_is_that_of_compiling() {
    assert_fresh_starts_are_those_of_compiling(|seed| {
        Source::new("s", CROWD.replace("seed = 5", &format!("seed = {seed}")), "")
    });
}

/// Returns a start of worlds of a scenario.
fn start(source: Source) -> Arc<SimulationFactory> {
    let compiled = compiled(&source);
    Arc::new(move |seed| {
        let fresh = compiled.reseeded(seed).expect("it takes less")?;
        Ok(fresh.start(&source, 1))
    })
}

/// Orders that differ by world, agent and cycle.
fn action(seed: u64, agent: usize, cycle: u64) -> f64 {
    ((seed + 3 * agent as u64 + cycle) % 3) as f64
}

/// Returns the digests of a batch in which some worlds are restarted on the way, and all that was observed.
fn batch_digests(workers: usize) -> (Vec<Digest>, Vec<i64>) {
    let seeds: Vec<u64> = (10..43).collect();
    let mut batch = Batch::new(start(source("robots", ORDERED, 1)), &seeds, workers).expect("room");
    let team = batch.agent_teams()[0].clone();
    let mut seen = Vec::new();
    for cycle in 0..30 {
        let worlds = batch.seeds().into_iter().zip(batch.cycles().expect("whole"));
        let values = worlds.flat_map(|(seed, at)| (0..6).map(move |k| action(seed, k, at)));
        batch.order(0, "action", values.collect()).expect("right orders");
        let mask: Vec<bool> = (0..seeds.len()).map(|k| cycle != 20 || k % 2 == 0).collect();
        batch.advance(1, (cycle == 20).then_some(&mask)).expect("whole");
        if cycle == 12 {
            let some = (0..seeds.len() as u64).map(|k| (k % 5 == 2).then_some(100 + k));
            batch.restart(&some.collect::<Vec<_>>()).expect("room");
        }
        let room = |space: &sidestep::kernel::control::ValueSpace| {
            vec![-7; seeds.len() * 6 * space.value_count()]
        };
        let mut rooms: Vec<Vec<i64>> = team.observation_spaces.iter().map(room).collect();
        let mut cells: Vec<_> = rooms.iter_mut().map(|room| BufferMut::Integer(room)).collect();
        batch.observe(0, &mut cells).expect("room");
        seen.extend(rooms.into_iter().flatten());
    }
    (batch.digests().expect("whole"), seen)
}

#[test]
fn a_batch_has_the_bits_of_runs_alone_on_any_number_of_workers() {
    let alone = batch_digests(1);
    for workers in [2, 3, 8] {
        assert_eq!(batch_digests(workers), alone, "{workers} workers");
    }
    for (k, digest) in alone.0.into_iter().enumerate() {
        let (seed, from) = if k % 5 == 2 { (100 + k as u64, 13) } else { (10 + k as u64, 0) };
        let source = source("robots", ORDERED, seed);
        let mut run = compiled(&source).start(&source, 1);
        for cycle in from..30 {
            // In cycle 20 half of the worlds stand still, and their orders are dropped.
            if cycle != 20 || k % 2 == 0 {
                let values: Vec<f64> =
                    (0..6).map(|agent| action(seed, agent, run.cycle())).collect();
                let agents = &run.agent_teams()[0].agents.clone();
                run.order(&MultiAgentOrder { order: "action", agents, values: &values })
                    .expect("right");
                run.advance(1);
            }
        }
        assert_eq!(run.digest(), digest, "world {k}");
    }
}

#[test]
fn a_wrong_order_is_told_with_its_world_and_nobody_is_ordered_anything() {
    let mut batch = Batch::new(start(source("robots", ORDERED, 1)), &[1, 2, 3], 2).expect("room");
    let before = batch.digests();
    let mut values = vec![0.0; 18];
    values[17] = 99.0;
    let wrong = batch.order(0, "action", values).expect_err("no such action");
    assert!(
        wrong.to_string().starts_with("world 2: the order `action` to robot 5 is 99"),
        "{wrong}"
    );
    let few = batch.order(0, "action", vec![0.0; 17]).expect_err("too few");
    assert!(few.to_string().contains("17"), "{few}");
    let few = batch.order(0, "action", vec![0.0; 15]).expect_err("too few");
    assert!(
        matches!(few, BatchError::Order { world: 0, error: OrderError::Shape { .. } }),
        "{few}"
    );
    assert!(
        batch
            .order(7, "action", vec![0.0; 18])
            .expect_err("no team")
            .to_string()
            .contains("no team 7")
    );
    assert!(
        batch.order(1, "action", vec![0.0; 9]).expect_err("own").to_string().contains("for itself")
    );
    batch.advance(0, None).expect("whole");
    assert_eq!(batch.digests(), before);
    let room = batch.observe(0, &mut [BufferMut::Real(&mut [0.0; 3])]).expect_err("another shape");
    assert!(room.to_string().contains("contact of 3 x 6 whole values"), "{room}");
    let masks = batch.advance(1, Some(&[true])).expect_err("one truth value");
    assert_eq!(masks.to_string(), "a batch of 3 worlds needs 3 truth values, not 1");
    assert!(batch.restart(&[None]).is_err());
    assert_eq!(
        Batch::new(start(source("robots", ORDERED, 1)), &[], 2).unwrap_err(),
        BatchError::Empty
    );
}

/// Panics in the fifth cycle of worlds in which a robot draws a number below a quarter then.
#[derive(Debug)]
struct Fragile;

impl Behaviour for Fragile {
    fn decide(&self, _: &Percept<'_>, memory: &mut Memory, draws: &mut Draws) -> Decision {
        memory.words[0] += 1;
        assert!(memory.words[0] != 5 || draws.uniform() > 0.25, "no idea");
        0.into()
    }
}

#[test]
fn a_world_that_breaks_off_is_named_and_the_others_are_whole() {
    const TEXT: &str = "[map]\nascii = \"\"\"\nMAP\"\"\"\n[robots]\ncount = 1\nbehaviour = { kind = \"fragile\" }\n";
    let own: Behaviours = [("fragile".to_string(), Arc::new(Fragile) as Arc<dyn Behaviour>)].into();
    let first =
        robots::scenario::Compiled::new(&source("robots", TEXT, 1), &own, StorageOrder::Spatial);
    let first = first.expect("a scenario");
    let fresh = move |seed| -> Result<Box<dyn Simulation>, InputError> {
        Ok(Box::new(first.reseeded(seed)?.start(&source("robots", TEXT, seed), 1)))
    };
    let fresh: Arc<SimulationFactory> = Arc::new(fresh);
    let breaks = |seed: u64| {
        let mut run = fresh(seed).expect("room");
        run.advance(4);
        catch_unwind(AssertUnwindSafe(|| run.advance(1))).is_err()
    };
    let (bad, good): (Vec<u64>, Vec<u64>) = (0..40).partition(|&seed| breaks(seed));
    assert!(bad.len() > 3 && good.len() > 20);
    for workers in [1, 3] {
        let seeds = [&good[..9], &bad[..1], &good[9..15], &bad[1..2], &good[15..18]].concat();
        let mut batch = Batch::new(Arc::clone(&fresh), &seeds, workers).expect("room");
        let broken = batch.advance(7, None).expect_err("two break off");
        let first = bad[0];
        let words =
            format!("world 9 (seed {first}) broke off after cycle 0, which is a bug: no idea");
        assert!(broken.to_string().starts_with(&words), "{broken}");
        // Nothing is done until both are restarted; the others stand where they were.
        assert_eq!(batch.advance(1, None), Err(broken.clone()));
        assert_eq!(batch.digests(), Err(broken));
        let restart =
            |world: usize| (0..20).map(|k| (k == world).then_some(good[18])).collect::<Vec<_>>();
        batch.restart(&restart(9)).expect("room");
        let other = batch.advance(1, None).expect_err("another one is broken");
        assert!(matches!(other, BatchError::Broken { world: 16, cycle: 0, .. }), "{other}");
        batch.restart(&restart(16)).expect("room");
        batch.advance(3, None).expect("whole");
        let cycles: Vec<u64> = (0..20).map(|k| if k == 9 || k == 16 { 3 } else { 10 }).collect();
        assert_eq!(batch.cycles(), Ok(cycles.clone()));
        for (k, digest) in batch.digests().expect("whole").into_iter().enumerate() {
            let mut run = fresh(batch.seeds()[k]).expect("room");
            run.advance(cycles[k]);
            assert_eq!(run.digest(), digest, "world {k}");
        }
    }
}

#[test]
fn a_seed_with_which_nobody_can_start_leaves_the_world_as_it_is() {
    let mut batch = Batch::new(start_but(7), &[1, 2, 3], 2).expect("room");
    batch.advance(5, None).expect("whole");
    let before = batch.digests().expect("whole");
    let refused = batch.restart(&[Some(9), Some(7), None]).expect_err("no room");
    assert!(refused.to_string().starts_with("world 1 cannot start with seed 7: "), "{refused}");
    assert_eq!((batch.seeds(), batch.cycles()), (vec![9, 2, 3], Ok(vec![0, 5, 5])));
    assert_eq!(batch.digests().expect("whole")[1..], before[1..]);
    assert!(matches!(
        Batch::new(start_but(7), &[1, 7], 2),
        Err(BatchError::Start { world: 1, .. })
    ));
}

#[test]
fn worlds_of_another_shape_are_refused() {
    let [small, large] = [2, 3].map(|count| {
        start(source("robots", &ORDERED.replace("count = 6", &format!("count = {count}")), 1))
    });
    let either: Arc<SimulationFactory> =
        Arc::new(move |seed| if seed < 9 { small(seed) } else { large(seed) });
    let refused = Batch::new(Arc::clone(&either), &[1, 2, 9], 2).expect_err("another shape");
    assert_eq!(refused, BatchError::Shape { world: 2 });
    let mut batch = Batch::new(either, &[1, 2], 2).expect("room");
    assert_eq!(batch.restart(&[None, Some(10)]), Err(BatchError::Shape { world: 1 }));
    assert_eq!(batch.seeds(), [1, 2]);
}

/// Returns a start of worlds that finds no room with one seed.
fn start_but(wrong: u64) -> Arc<SimulationFactory> {
    let start = start(source("robots", ORDERED, 1));
    Arc::new(move |seed| match seed == wrong {
        true => Err(InputError::new("s", "no free place is left", "give a larger map")),
        false => start(seed),
    })
}
