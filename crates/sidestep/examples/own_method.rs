//! `cargo run -p sidestep --example own_method`: airplanes that pass each other on the right.

use sidestep::kernel::math::{atan2, wrap_angle};
use sidestep::kernel::stream::Draws;
use sidestep::worlds::WORLDS;
use sidestep::worlds::airspace::Airspace;
use sidestep::worlds::airspace::baseline::AircraftState;
use sidestep::worlds::airspace::flight::distance_m;
use sidestep::worlds::airspace::method::{Method, MethodPercept, Steering};
use sidestep::{Error, Scenario};

const SCENARIO: &str = r#"format = 1
world = "airspace"
airspace = { method = "keep-right", generator = { kind = "superconflict", n = 6 } }"#;

#[derive(Debug)]
struct KeepRight;

impl Method for KeepRight {
    fn decide(&self, percept: &MethodPercept<'_>, _: &mut Draws) -> Steering {
        let own = percept.own;
        if percept.others.iter().any(|other| is_ahead(own, other)) {
            return Steering::Heading(own.preferred_rad - 0.8);
        }
        Steering::Proceed
    }
}

fn is_ahead(own: &AircraftState, other: &AircraftState) -> bool {
    let bearing_rad = atan2(other.at[1] - own.at[1], other.at[0] - own.at[0]);
    let is_in_front = wrap_angle(bearing_rad - own.preferred_rad).abs() < 1.2;
    is_in_front && distance_m(own.at, other.at) < 6.0 * own.separation_m
}

fn main() -> Result<(), Error> {
    let worlds = WORLDS.clone().with(Airspace::new().with_method("keep-right", KeepRight));
    let summary = Scenario::parse(&worlds, SCENARIO).start()?.finish()?;
    println!("{:#}", summary.metrics);
    Ok(())
}
