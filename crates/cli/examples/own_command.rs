//! `cargo run -p sidestep-cli --example own_command -- check wall.toml`: the whole command, with parts of its own:
//! robots that keep to the wall on their left, airplanes that pass each other on the right, and chains that are led
//! back and forth and never turn a rod.

use sidestep::kernel::stream::Draws;
use sidestep::rods::VetoReason;
use sidestep::rods::geometry::{Point, add};
use sidestep::worlds::WORLDS;
use sidestep::worlds::airspace::Airspace;
use sidestep::worlds::airspace::flight::distance_m;
use sidestep::worlds::airspace::method::{Method, MethodPercept, Steering};
use sidestep::worlds::chain::{
    self, Chains, Driver, DriverAction, DriverPercept, MasterMove, Reaction,
};
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

#[derive(Debug)]
struct KeepRight;

impl Method for KeepRight {
    fn decide(&self, percept: &MethodPercept<'_>, _: &mut Draws) -> Steering {
        let own = percept.own;
        let near_m = 6.0 * own.separation_m;
        if percept.others.iter().any(|other| distance_m(own.at, other.at) < near_m) {
            return Steering::Heading(own.preferred_rad - 0.8);
        }
        Steering::Proceed
    }
}

/// Changes sides every second, by the cycles in its memory.
#[derive(Debug)]
struct BackAndForth;

impl Driver for BackAndForth {
    fn decide(
        &self,
        percept: &DriverPercept<'_>,
        memory: &mut chain::DriverMemory,
        _: &mut Draws,
    ) -> DriverAction {
        let [cycles, ..] = &mut memory.words;
        *cycles += 1;
        let seconds = f64::from(*cycles) * percept.dt_s;
        let side = if (seconds as u64).is_multiple_of(2) { 1.0 } else { -1.0 };
        DriverAction::GoTo(add(percept.connectors_m[percept.connector], [0.3, side, 0.0]))
    }
}

#[derive(Debug)]
struct Straight;

impl Reaction for Straight {
    fn react(&self, percept: &MasterMove<'_>) -> Result<Point<3>, VetoReason> {
        Ok(percept.guided_m)
    }
}

fn main() -> std::process::ExitCode {
    let robots = Robots::new().with_behaviour("wall", FollowWall);
    let airspace = Airspace::new().with_method("keep-right", KeepRight);
    let chains = Chains::new().with_driver("back-and-forth", BackAndForth);
    let chains = chains.with_reaction("straight", Straight);
    sidestep_cli::main_with(WORLDS.clone().with(robots).with(airspace).with(chains))
}
