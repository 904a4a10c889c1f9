//! Values of airplanes that check themselves on reading.

use serde::Deserialize;
use serde_json::{Value, json};
use sidestep_import::traffic::MAX_SPEED_M_S;
use sidestep_scenario::{Integer, Number, Open, Rule, invalid_value, schema_by_hand};

/// A category of surveillance from 1 on: 0 stands for what is unknown.
pub(crate) type SurveillanceCategory = Integer<1, 11>;
/// A category of the accuracy of velocities from 1 on, likewise.
pub(crate) type VelocityCategory = Integer<1, 4>;
/// A separation in meters.
pub(crate) type SeparationM = Number<Open<0, 1_000_000>>;

/// Defines rules for numbers with bounds, with errors that give the reason for the bounds.
macro_rules! bounds {
    ($($name:ident, $least:expr, $most:expr, $words:literal, $reason:literal;)*) => {$(
        #[doc = concat!("Numbers from ", $words, ": ", $reason, ".")]
        #[derive(Debug, Clone, Copy)]
        pub(crate) struct $name;

        impl Rule for $name {
            fn allows(number: f64) -> bool {
                ($least..=$most).contains(&number)
            }

            fn description() -> String {
                concat!($words, ": ", $reason).into()
            }

            fn limits() -> Value {
                json!({ "minimum": $least, "maximum": $most })
            }
        }
    )*};
}

bounds! {
    Speed, 1e-3, MAX_SPEED_M_S, "0.001 to 1e6 m/s", "slower steps are lost in rounding, and nothing is faster";
    TurnRate, 1e-3, 360.0, "0.001 to 360 degrees per second", "slower turns make orbits without end";
    Bank, 1.0, 85.0, "1 to 85 degrees of bank", "flatter turns take forever, and steeper ones pull eleven times gravity";
    Decision, 0.01, 3600.0, "0.01 to 3600 s", "one decision per hour is too slow for collision avoidance";
    Step, 0.001, 3600.0, "0.001 to 3600 s", "a step is part of dt_s, and a run has many";
    LookAhead, 0.001, 86_400.0, "0.001 to 86400 s", "predictions are limited to one day";
    Held, 0.001, 86_400.0, "0.001 to 86400 s", "no turn or leg takes more than a day";
    Tolerance, 0.001, 1e6, "0.001 to 1e6 m", "way-points are reached to the millimeter at best";
    Weight, 1e-12, 1e6, "1e-12 to 1e6", "beyond that rounding hides one part of the objective";
    ChangeWeight, 0.0, 1e6, "0 to 1e6", "beyond that nothing else counts";
    Fading, 1e-3, 1.0, "0.001 to 1", "the future counts less than the present, but it counts";
    Inflation, 0.1, 10.0, "0.1 to 10", "it is a margin on the separation";
    Cooling, 0.01, 1.0, "0.01 to 1", "faster than a hundredth a round leaves nothing to learn from";
    LevelGap, 1.0, 1e9, "1 to 1e9 m", "levels nearer than that are one for any altimeter";
    Gibibytes, 1e-6, 1024.0, "1e-6 to 1024 GiB", "it is memory of this machine";
    HeadingNoise, 0.0, 180.0, "0 to 180 degrees", "beyond half a turn nothing is left of a heading";
}

/// A number of rounds of an optimization.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RoundCount(pub(crate) u32);

impl<'de> Deserialize<'de> for RoundCount {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let rounds = i64::deserialize(deserializer)?;
        if (1..=10_000).contains(&rounds) {
            return Ok(Self(rounds as u32));
        }
        let remedy = "give 1 or more rounds, up to 10000: temperatures are at rest long before";
        Err(invalid_value(rounds, remedy))
    }
}

schema_by_hand!(RoundCount, json!({ "type": "integer", "minimum": 1, "maximum": 10_000 }));

/// A number of turns to choose from.
#[derive(Debug, Clone, Copy)]
pub(crate) struct TurnCount(pub(crate) usize);

impl<'de> Deserialize<'de> for TurnCount {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let turns = i64::deserialize(deserializer)?;
        if !(3..=99).contains(&turns) || turns % 2 == 0 {
            let remedy = "give an odd number from 3 to 99, so that straight flight is among them";
            return Err(invalid_value(turns, remedy));
        }
        Ok(Self(turns as usize))
    }
}

schema_by_hand!(TurnCount, {
    let odd: Vec<u32> = (3..=99).step_by(2).collect();
    json!({ "type": "integer", "enum": odd })
});
