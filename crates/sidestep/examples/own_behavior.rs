//! `cargo run -p sidestep --example own_behavior`: robots that keep to the wall on their left.

use sidestep::kernel::stream::Draws;
use sidestep::worlds::WORLDS;
use sidestep::worlds::robots::Robots;
use sidestep::worlds::robots::decide::{Behaviour, Decision, Memory, Percept, Sector};
use sidestep::worlds::robots::effector::{FORWARD, LEFT, RIGHT};
use sidestep::{Error, Scenario};

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

fn main() -> Result<(), Error> {
    let worlds = WORLDS.clone().with(Robots::new().with_behaviour("wall", FollowWall));
    let mut run = Scenario::parse(&worlds, SCENARIO).start()?;
    run.advance(10_000)?;
    println!("{:#}", run.metrics());
    Ok(())
}
