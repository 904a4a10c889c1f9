//! The worlds whose scenarios tests beside the code run.

use sidestep_airspace::Airspace;
use sidestep_robots::Robots;
use sidestep_scenario::Worlds;
use std::sync::LazyLock;

pub(crate) static WORLDS: LazyLock<Worlds> =
    LazyLock::new(|| Worlds::new("tests").with(Robots::new()).with(Airspace::new()));
