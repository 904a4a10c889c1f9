//! `cargo run -p sidestep --example own_behaviour`: robots that keep to the wall on their left.

use sidestep::kernel::{InputError, Simulation, stream::Draws};
use sidestep::scenario::Source;
use sidestep::worlds::robots::decide::{Behaviour, Decision, Memory, Percept, Sector};
use sidestep::worlds::robots::effector::{FORWARD, LEFT, RIGHT};
use sidestep::worlds::robots::scenario::{Behaviours, Compiled, StorageOrder};

use std::sync::Arc;

const SCENARIO: &str = r#"format = 1
world = "robots"
map = { office = { corridors = 1, rooms_per_side = 3 } }
robots = { count = 5, size = 2, sensors = ["sonar-8"], effector = "nomad", behaviour = { kind = "wall" } }"#;

#[derive(Debug)]
struct FollowWall;

impl Behaviour for FollowWall {
    fn decide(&self, percept: &Percept<'_>, _: &mut Memory, _: &mut Draws) -> Decision {
        if percept.contact.is_some() || percept.nearest(Sector::Ahead) == Some(0) {
            return RIGHT.into();
        }
        let has_lost_wall = percept.nearest(Sector::Left) != Some(0);
        let may_look_for_it = percept.now.is_multiple_of(8);
        if has_lost_wall && may_look_for_it { LEFT.into() } else { FORWARD.into() }
    }
}

fn main() -> Result<(), InputError> {
    let source = Source::new("own_behaviour.rs", SCENARIO, "");
    let own = Behaviours::from([("wall".into(), Arc::new(FollowWall) as Arc<dyn Behaviour>)]);
    let compiled = Compiled::new(&source, &own, StorageOrder::Spatial)?;
    let mut run = compiled.start(&source, 2);
    run.advance(10_000);
    println!("{:#}", Simulation::metrics(&run));
    Ok(())
}
