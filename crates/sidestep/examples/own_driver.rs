//! `cargo run -p sidestep --example own_driver`: a chain whose first connector goes round a square.

use sidestep::kernel::stream::Draws;
use sidestep::rods::geometry::{Point, distance};
use sidestep::worlds::WORLDS;
use sidestep::worlds::chain::{Chains, Driver, DriverAction, DriverMemory, DriverPercept};
use sidestep::{Error, Scenario};

const SCENARIO: &str = r#"format = 1
world = "chain"
[[chains]]
connectors = 5
at_m = [0.0, 0.0]
rod_m = 0.5
tasks = [{ kind = "square", speed_m_s = 0.5 }]"#;

const CORNERS_M: [Point<3>; 4] = [[2.0, 0.0, 0.0], [2.0, 2.0, 0.0], [0.0, 2.0, 0.0], [0.0; 3]];

#[derive(Debug)]
struct Square;

impl Driver for Square {
    fn decide(&self, view: &DriverPercept, own: &mut DriverMemory, _: &mut Draws) -> DriverAction {
        let [next, ..] = &mut own.words;
        let Some(corner) = CORNERS_M.get(*next as usize) else { return DriverAction::Done };
        if distance(view.connectors_m[view.connector], *corner) < 0.01 {
            *next += 1;
        }
        DriverAction::GoTo(*corner)
    }
}

fn main() -> Result<(), Error> {
    let worlds = WORLDS.clone().with(Chains::new().with_driver("square", Square));
    let summary = Scenario::parse(&worlds, SCENARIO).start()?.finish()?;
    println!("{:#}", summary.metrics);
    Ok(())
}
