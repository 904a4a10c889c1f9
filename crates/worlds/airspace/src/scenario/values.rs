//! Values of airplanes that check themselves on reading.

use serde::Deserialize;
use sidestep_scenario::{AboveBelow, Number, Rule, refused};

/// A speed or a separation.
pub(crate) type Measure = Number<AboveBelow<0, 1_000_000>>;

/// Turn rates of airplanes: slower ones would make orbits without end.
#[derive(Debug, Clone, Copy)]
pub(crate) struct TurnRate;

impl Rule for TurnRate {
    fn allows(deg_s: f64) -> bool {
        (1e-3..=360.0).contains(&deg_s)
    }

    fn words() -> String {
        "0.001 to 360 degrees per second".into()
    }
}

/// A number of turns to choose from.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Turns(pub(super) usize);

impl<'de> Deserialize<'de> for Turns {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let turns = i64::deserialize(deserializer)?;
        if !(3..=99).contains(&turns) || turns % 2 == 0 {
            let remedy = "give an odd number from 3 to 99, so that straight flight is among them";
            return Err(refused(turns, remedy));
        }
        Ok(Self(turns as usize))
    }
}
