//! Whole runs of small scenarios: what chains do to each other, and what is told of it.

use crate::events::EventKind;
use crate::rods::geometry::distance;
use crate::scenario::Compiled;
use crate::{
    Chain, ChainRun, Connector, Mode, Motion, Obstacle, Obstacles, Propagator, Request, Rod, Source,
};
use sidestep_kernel::Simulation;
use sidestep_kernel::interrupt::Interrupt;
use sidestep_kernel::ports::{MemoryRecorder, Recorder, Values};
use sidestep_scenario::Source as Text;
use sidestep_testing::root;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// Returns a run of a scenario in the plane.
fn run(text: &str) -> ChainRun<2> {
    let source = Text::new("s.toml", format!("format = 1\nworld = \"chain\"\n{text}"), root());
    Compiled::new(&source).unwrap_or_else(|error| panic!("{error}")).start(&source, 1)
}

/// Two swarms, one of which cannot keep up with its connectors, cross at some angle.
fn crossing(heading_deg: u32) -> String {
    format!(
        "seed = 1\ncycles = 700\n[[chains]]\nconnectors = 2\nat_m = [0.0, 0.0]\nrod_m = [0.8, 1.0]\n\
         robots = {{ radius_m = 0.25, wheel_speed_m_s = 0.05 }}\n\
         tasks = [{{ kind = \"script\", script = \"forward 5\" }}]\n\
         [[chains]]\nconnectors = 2\nat_m = [0.0, -3.0]\nheading_deg = {heading_deg}\nrod_m = [0.8, 1.0]\n\
         robots = {{ radius_m = 0.25 }}\ntasks = [{{ kind = \"script\", script = \"wait 2 forward 6\" }}]\n"
    )
}

#[test]
fn robots_of_different_chains_never_overlap_however_far_they_lag() {
    for heading_deg in [80, 90, 100] {
        let mut run = run(&crossing(heading_deg));
        while run.cycle() < 700 && !run.is_over() {
            run.advance(1);
            let [a, b] = [0, 1].map(|slot| run.state().body(slot).robots.clone());
            let pairs = a.iter().flat_map(|a| b.iter().map(move |b| (a, b)));
            let gap_m = pairs.map(|(a, b)| distance(a.pose.at, b.pose.at) - 0.5);
            let least_m = gap_m.fold(f64::INFINITY, f64::min);
            assert!(least_m > -1e-9, "{heading_deg} deg, cycle {}: {least_m} m", run.cycle());
        }
    }
}
