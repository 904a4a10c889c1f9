//! `cargo run -p sidestep-cli --example own_command -- check wall.toml`: the whole command, for robots that
//! keep to the wall on their left.

use sidestep::kernel::stream::Draws;
use sidestep::worlds::WORLDS;
use sidestep::worlds::robots::Robots;
use sidestep::worlds::robots::decide::{Behaviour, Decision, Memory, Percept, Sector};
use sidestep::worlds::robots::effector::{FORWARD, LEFT, RIGHT};

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

fn main() -> std::process::ExitCode {
    let robots = Robots::new().with_behaviour("wall", FollowWall);
    sidestep_cli::main_with(WORLDS.clone().with(robots))
}
