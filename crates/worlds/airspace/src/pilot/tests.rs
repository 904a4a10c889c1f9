//! Pilots outside of a run: they act like those in it.

mod fleet;
mod hostile;
mod order;
mod silence;

use super::*;
use crate::deploy::run_pilot_conversations;
use crate::world::AirspaceWorld;
use crate::{AirspaceRun, RemotePilotRun, airspace_run};
use sidestep_kernel::network::{NetworkAgent, OutgoingPacket};
use sidestep_kernel::{Cycle, EntityId, Simulation};
use sidestep_scenario::Source;
use std::sync::Arc;

/// All cases that concern the shield: changes of level, an airplane that comes in late, one that minds no other, and
/// two that start too close.
const TROUBLE: &str = "[airspace.generator]\nkind = \"superconflict\"\nn = 3\nradius_m = 2600.0\n\
    [[airplanes]]\nat_m = [0, 3000]\nheading_deg = -90\nway_points_m = [[0, -6000]]\naltitude_m = 600.0\n\
    orders = [{ at_s = 10.0, altitude_m = 0.0, climb_m_s = 20.0 }, { at_s = 20.0, speed_m_s = 45.0 }]\n\
    [[airplanes]]\nat_m = [100, 3300]\nheading_deg = -90\nway_points_m = [[0, -6000]]\naltitude_m = 600.0\n\
    [[airplanes]]\nat_m = [2000, 2500]\nheading_deg = -120\nway_points_m = [[-4000, -4000]]\nappears_s = 15.0\n\
    [[airplanes]]\nat_m = [-3000, 0]\nheading_deg = 0\nway_points_m = [[9000, 0]]\nintruder = true\n";

fn run(airspace: &str, airplanes: &str) -> AirspaceRun {
    let text = format!(
        "format = 1\nworld = \"airspace\"\nseed = 5\n[airspace]\n{airspace}\nmax_rounds = 12\n{airplanes}\n\
         [record]\ncontrols = true\n"
    );
    airspace_run(&Source::new("pilots", text, ""), 1).unwrap_or_else(|e| panic!("{e}"))
}

/// A pilot for each airplane, outside of a run.
struct TestPilots {
    world: Arc<AirspaceWorld>,
    pilots: Vec<Pilot>,
}

impl TestPilots {
    fn from_run(run: &AirspaceRun) -> Self {
        let world = run.world().clone();
        let all = 0..world.airplanes.len() as EntityId;
        let pilots = all.map(|id| Pilot::new(world.clone(), id, Default::default())).collect();
        Self { world, pilots }
    }

    /// Lets the pilots that perceive something decide, over the network of the scenario.
    fn decide(&mut self, run: &AirspaceRun) -> Vec<AirplaneControl> {
        let now = run.cycle();
        let schedule = ConversationSchedule::for_cycle(now, self.world.conversation_windows());
        // As they come off a network.
        let percepts: Vec<Percept> = run.percepts().iter().map(over_the_wire).collect();
        let is_due = |pilot: &Pilot| percepts.iter().any(|percept| percept.own.id == pilot.id());
        let (mut due, rest): (Vec<Pilot>, Vec<Pilot>) =
            std::mem::take(&mut self.pilots).into_iter().partition(is_due);
        for (pilot, percept) in due.iter_mut().zip(percepts) {
            pilot.start_with_schedule(percept, schedule);
        }
        run_pilot_conversations(&self.world, run.state(), (now, schedule), &mut due);
        let controls = due.iter().map(|pilot| pilot.control().expect("all end")).collect();
        self.pilots = due.into_iter().chain(rest).collect();
        self.pilots.sort_unstable_by_key(Pilot::id);
        controls
    }
}

fn over_the_wire<T: serde::Serialize + serde::de::DeserializeOwned>(value: &T) -> T {
    let bytes = postcard::to_stdvec(value).expect("plain data");
    postcard::from_bytes(&bytes).expect("what was written")
}

/// Everything that others cannot see of an airplane changes, and the percepts of the others stay the same.
#[test]
fn a_sight_holds_nothing_of_others_that_cannot_be_seen() {
    let mut run = run(
        "deployment = \"team\"\nmethod = \"mvp\"",
        "[airspace.generator]\nkind = \"superconflict\"\nn = 5\nradius_m = 2600.0\n",
    );
    run.advance(8);
    let (world, now) = (run.world().clone(), run.cycle());
    let percepts = run.percepts();
    assert_eq!(percepts.len(), 5);
    assert!(percepts.iter().all(|percept| percept.check(&world).is_ok()));
    let lost = Percept { group: percepts[0].group[1..].to_vec(), ..percepts[0].clone() };
    assert_eq!(
        lost.check(&world),
        Err(crate::agents::InvalidMessage::Airplane),
        "it is not in its group"
    );
    let mut hidden = 0;
    for (own, percept) in percepts.iter().enumerate() {
        let mut snapshot = run.state().snapshot(now);
        for (id, airplane) in snapshot.airplanes.iter_mut().enumerate().filter(|(id, _)| *id != own)
        {
            let [next, overrides, orbits, orbiting] = &mut airplane.counts;
            (*next, *overrides, *orbits) = (1 - (*next).min(1), *overrides + 7, *orbits + 3);
            airplane.turn_rate_rad_s += 0.01;
            if *orbiting == 0 {
                airplane.fallback.orbit_side = airplane.fallback.orbit_side.opposite();
                hidden += 1;
            }
            snapshot.resolving[id] = crate::baseline::mvp::ActiveResolutions::default();
        }
        let changed = crate::state::AirspaceState::restore(&world, &snapshot);
        assert_eq!(world.percepts(&changed, now)[own], *percept, "airplane {own}");
    }
    assert!(hidden > 10, "{hidden}");
}
