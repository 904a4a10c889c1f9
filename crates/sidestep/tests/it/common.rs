//! Worlds that several tests use.

use sidestep::scenario::Source;
use sidestep::worlds::robots::RobotsRun;
use sidestep::worlds::robots::scenario::{Behaviours, Compiled, StorageOrder};

/// A crowded floor: rooms, corridors, doors of both sorts, people of two sizes and speeds,
/// robots of four sizes, several behaviors, sensors and periods, radio.
pub(crate) const CROWD: &str = r#"
format = 1
world = "robots"
seed = 5
[map]
box_size_m = 0.25
office = { corridors = 2, rooms_per_side = 3, room_width_m = 3.0, room_depth_m = 2.5, corridor_width_m = 2.5, door_width_m = 1.5 }
[[robots]]
count = 25
size = 1
sensors = ["sonar-8", "bumper-4"]
effector = "nomad"
behaviour = { kind = "wander", turn_every = 10 }
[[robots]]
count = 12
size = 2
sensors = ["sonar-ring"]
effector = "nomad"
period = 2
[[robots]]
count = 8
size = 3
sensors = ["camera"]
effector = "slippery"
behaviour = { kind = "shuttle", a = [2, 11, 4, 6], b = [28, 11, 8, 6] }
[[robots]]
count = 2
size = 5
sensors = ["sonar-8"]
effector = "slippery"
[[people]]
count = 25
period = 3
[[people]]
count = 6
size = [2, 1]
p_straight = 0.5
[[doors]]
office = true
random = { p_open = 0.05, p_close = 0.2 }
[radio]
range_m = 3.0
loss = 0.2
[effectors.slippery]
forward = [
    { p = 0.5, path = "F" }, { p = 0.1 }, { p = 0.1, path = "FF" }, { p = 0.1, path = "FL" },
    { p = 0.1, path = "FR" }, { p = 0.05, path = "B" }, { p = 0.05, path = "FFLB", turn = 180 },
]
left = [{ p = 0.7, turn = 90 }, { p = 0.1 }, { p = 0.2, turn = 90, path = "L" }]
right = [{ p = 0.7, turn = -90 }, { p = 0.1 }, { p = 0.2, turn = -90, path = "R" }]
"#;

/// A scenario text with overrides applied.
pub(crate) fn source(text: &str, overrides: &[&str]) -> Source {
    let overrides: Vec<String> = overrides.iter().map(ToString::to_string).collect();
    Source::new("test", text, "").with_overrides(&overrides).expect("the overrides fit")
}

/// A run that always uses all its workers.
pub(crate) fn simulation(source: &Source, workers: usize) -> RobotsRun {
    stored(source, workers, StorageOrder::Spatial)
}

/// The same with bodies stored in another order.
pub(crate) fn stored(source: &Source, workers: usize, order: StorageOrder) -> RobotsRun {
    let compiled = Compiled::new(source, &Behaviours::new(), order);
    let compiled = compiled.unwrap_or_else(|e| panic!("{e}"));
    let mut simulation = compiled.start(source, workers);
    simulation.force_parallel();
    simulation
}
