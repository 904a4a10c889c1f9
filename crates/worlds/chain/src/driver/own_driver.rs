//! Drivers of a program's own.

use super::VetoRecord;
use serde::{Deserialize, Serialize};
use sidestep_kernel::Cycle;
use sidestep_kernel::stream::Draws;
use sidestep_rods::geometry::Point;
use std::collections::BTreeMap;
use std::fmt::Debug;
use std::sync::Arc;

/// Drivers of a program's own, by the names that scenarios call them.
pub type DriverRegistry = BTreeMap<String, Arc<dyn Driver>>;

/// A rule by which an initiator chooses its motions. Implement it for drivers of your own; see
/// `crates/sidestep/examples/own_driver.rs`.
pub trait Driver: Debug + Send + Sync {
    /// Returns what the initiator of a chain is to do in a cycle. It may depend only on the percept, the memory (which
    /// it may change) and the chain's random stream of this cycle, because chains act in any order.
    ///
    /// The motion is a proposal: the rest of the chain follows or vetoes it, and after a veto the initiator climbs the
    /// recovery ladder, as those do that wander.
    fn decide(
        &self,
        percept: &DriverPercept<'_>,
        memory: &mut DriverMemory,
        draws: &mut Draws,
    ) -> DriverAction;
}

/// A driver's memory between two cycles of its task: four words; their meaning is up to the driver.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct DriverMemory {
    /// The words; all 0 at the start of a task.
    pub words: [u32; 4],
}

/// What an initiator is to do in a cycle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum DriverAction {
    /// Rest; it moves only to get out of the way.
    Rest,
    /// Go toward a place, in meters, as far as its speed allows; in the plane the last coordinate counts for nothing.
    GoTo(Point<3>),
    /// Nothing: its task is done.
    Done,
}

/// What an initiator perceives in a cycle: places in meters; in the plane the last coordinate is 0.
#[derive(Debug, Clone)]
pub struct DriverPercept<'a> {
    /// The present cycle, from 0.
    pub now: Cycle,
    /// Cycles since its task began: 1 in the first one.
    pub cycles: Cycle,
    /// Cycles in a row in which it did not get anywhere.
    pub idle: u32,
    /// Duration of a cycle, s.
    pub dt_s: f64,
    /// The distance that it may go in a cycle, meters.
    pub step_m: f64,
    /// The connector that it moves, an index of `connectors_m`.
    pub connector: usize,
    /// The places of the chain's connectors before its motion, in their order.
    pub connectors_m: &'a [Point<3>],
    /// The direction in which it moved last, a unit vector; at first away from the chain.
    pub ahead: Point<3>,
    /// The last objection to a motion that it wanted in this task, if there was one.
    pub objection: Option<VetoRecord>,
    /// The obstacles near it, the nearest first: those within the chain's look (`chain.look_m`).
    pub obstacles: &'a [NearbyObstacle],
}

/// An obstacle as a connector perceives it, where it will be at the end of the cycle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NearbyObstacle {
    /// The number of the obstacle; none for a part of another chain.
    pub id: Option<u32>,
    /// Gap between it and the connector, meters; negative inside it.
    pub gap_m: f64,
    /// The vector from the middle of the connector to its surface, meters.
    pub to_surface_m: Point<3>,
    /// Its velocity, m/s; zero for a static obstacle.
    pub velocity_m_s: Point<3>,
}

/// A driver of the program's own, with its name.
#[derive(Debug, Clone)]
pub(crate) struct OwnDriver {
    /// The name by which the scenario calls it.
    pub(crate) name: Arc<str>,
    driver: Arc<dyn Driver>,
}

impl OwnDriver {
    pub(crate) fn new(name: &str, driver: &Arc<dyn Driver>) -> Self {
        Self { name: name.into(), driver: Arc::clone(driver) }
    }

    /// Returns what the driver proposes.
    ///
    /// # Panics
    /// When that is no place: the initiator would have no position any more.
    pub(crate) fn decide(
        &self,
        percept: &DriverPercept<'_>,
        memory: &mut DriverMemory,
        draws: &mut Draws,
    ) -> DriverAction {
        let proposal = self.driver.decide(percept, memory, draws);
        if let DriverAction::GoTo(to) = proposal {
            let is_place = to.iter().all(|coordinate| coordinate.is_finite());
            assert!(
                is_place,
                "driver `{}` sent connector {} to {to:?}",
                self.name, percept.connector
            );
        }
        proposal
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ChainRun;
    use crate::own_parts::CustomBehaviors;
    use crate::scenario::AnyChainScenario;
    use sidestep_kernel::Simulation;
    use sidestep_scenario::Source;

    /// Proposes one thing, for as many cycles as its memory counts.
    #[derive(Debug)]
    struct Always(DriverAction, u32);

    impl Driver for Always {
        fn decide(
            &self,
            percept: &DriverPercept<'_>,
            memory: &mut DriverMemory,
            _: &mut Draws,
        ) -> DriverAction {
            let [count, ..] = &mut memory.words;
            *count += 1;
            assert_eq!(percept.cycles, u64::from(*count), "a task begins without memories");
            if *count > self.1 { DriverAction::Done } else { self.0 }
        }
    }

    fn run(driver: Always, tasks: &str, cycles: u64) -> ChainRun<2> {
        let text = format!(
            "format = 1\nworld = \"chain\"\n[[obstacles]]\nat_m = [0.5, 0.2]\nradius_m = 0.1\n\
             [[chains]]\nconnectors = 3\nat_m = [0.0, 0.0]\nrod_m = 0.5\ntasks = [{tasks}]\n"
        );
        let source = Source::new("s.toml", text, "");
        let mut own = CustomBehaviors::default();
        own.drivers.insert("own".into(), Arc::new(driver));
        let AnyChainScenario::Plane(compiled) =
            AnyChainScenario::with_custom_behaviors(&source, &own).expect("a scenario")
        else {
            panic!("it is in the plane")
        };
        let mut run = compiled.start(&source, 1);
        run.advance(cycles);
        run
    }

    #[test]
    fn an_own_driver_that_goes_to_a_place_moves_the_chain_as_a_target_does() {
        let to = [-1.0, -1.0, 0.0];
        let built_in = "{ kind = \"targets\", targets_m = [[-1.0, -1.0]], lasts_s = 1.0 }";
        let places = |tasks: &str| {
            let run = run(Always(DriverAction::GoTo(to), u32::MAX), tasks, 40);
            run.state().body(0).chain.points().to_vec()
        };
        assert_eq!(places("{ kind = \"own\", lasts_s = 1.0 }"), places(built_in));
    }

    #[test]
    fn a_driver_that_is_done_makes_room_for_the_next_task() {
        let driver = Always(DriverAction::Rest, 5);
        let run = run(driver, "{ kind = \"own\" }, { kind = \"own\" }", 100);
        assert!(run.is_over());
        assert_eq!(run.metrics().done, 2);
    }

    #[test]
    fn memory_is_part_of_the_digest_and_of_checkpoints() {
        let start = |cycles: u64| run(Always(DriverAction::Rest, 50), "{ kind = \"own\" }", cycles);
        let saved = start(20).checkpoint();
        let mut resumed = start(3);
        resumed.restore(&saved).expect("its own checkpoint");
        assert_eq!(resumed.digest(), start(20).digest());
        resumed.advance(100);
        assert_eq!(resumed.digest(), start(120).digest());
    }
}
