//! Trajectories of robots as pictures: on the medium floor, without errors and with both kinds.

use super::LoriaConfig;
use super::floor::Floor;
use super::measure::{LoriaVariant, Track, run_recorded};
use crate::Scene;
use sidestep::kernel::ports::ColumnValues;
use sidestep::kernel::view::{BodyId, FrameOptions, Trail};
use sidestep::kernel::{Cycle, Simulation};
use sidestep::worlds::robots::kinds::ROBOT;
use sidestep::worlds::robots::world::Regime;
use std::sync::Arc;

/// Cycles of a run: by then all robots have left their starts.
const CYCLES: Cycle = 600;
/// Cycles at the end of the run for which trails are drawn.
const TRAIL_CYCLES: Cycle = 400;
/// One seed for all scenes, so that the same robots start at the same places.
const SEED: u64 = 1;

/// Returns all pictures: the same floor and seed, without errors and with both.
pub fn all(plan: &LoriaConfig) -> [Scene; 2] {
    let floor = Arc::new(Floor::medium());
    let cycles = CYCLES.min(plan.cycles);
    [
        ("Ways of robots, all reliable", Regime::Reliable),
        ("Ways of the same robots, sensors and effectors unreliable", Regime::Both),
    ]
    .map(|(title, regime)| scene(title, &LoriaVariant::new(&floor, regime), cycles))
}

fn scene(title: &str, variant: &LoriaVariant, cycles: Cycle) -> Scene {
    let (mut run, tracks) = run_recorded(variant, SEED, cycles);
    let scenery = run.scenery();
    let frame = run.frame(FrameOptions::WITHOUT_SCANS);
    let columns = columns(&tracks, cycles.saturating_sub(TRAIL_CYCLES));
    let robots = frame.bodies.iter().filter(|body| body.kind == ROBOT);
    let bodies: Vec<BodyId> = robots.map(|body| body.id()).collect();
    let mut trails: Vec<Trail> = Vec::new();
    for positions in run.position_columns() {
        let found = positions.trails(&scenery, &frame, &bodies, |name: &str| {
            columns.iter().find(|(own, _)| *own == name).map(|(_, values)| values)
        });
        trails.extend(found.unwrap_or_default());
    }
    Scene {
        title: title.into(),
        caption: format!("Medium floor, seed {SEED}."),
        scenery,
        frame,
        trails,
    }
}

/// Returns the tracks from a cycle on as columns of the table of trajectories.
fn columns(tracks: &[Track], from: Cycle) -> [(&'static str, ColumnValues); 5] {
    let mut cycles: Vec<u64> = Vec::new();
    let mut bodies: Vec<u32> = Vec::new();
    let mut cols: Vec<u32> = Vec::new();
    let mut rows: Vec<u32> = Vec::new();
    let mut headings: Vec<u32> = Vec::new();
    for (body, track) in (0..).zip(tracks) {
        for (cycle, &(col, row, heading)) in (0..).zip(track).skip(from as usize) {
            cycles.push(cycle);
            bodies.push(body);
            cols.push(col);
            rows.push(row);
            headings.push(u32::from(heading));
        }
    }
    [
        ("cycle", ColumnValues::U64(cycles.into_iter().collect())),
        ("body", ColumnValues::U32(bodies.into_iter().collect())),
        ("col_boxes", ColumnValues::U32(cols.into_iter().collect())),
        ("row_boxes", ColumnValues::U32(rows.into_iter().collect())),
        ("heading", ColumnValues::Label(headings.into_iter().collect())),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use sidestep::kernel::view::Vec3;

    #[test]
    fn ways_are_whole_and_end_where_the_robots_are() {
        let scenes = all(&LoriaConfig { cycles: 450, ..LoriaConfig::quick() });
        for scene in &scenes {
            let robots = scene.frame.bodies.iter().filter(|body| body.kind == ROBOT).count();
            assert_eq!(scene.trails.len(), robots);
            let box_m = scene.scenery.floor.as_ref().expect("a floor").box_m;
            let far = |pair: &[(Cycle, Vec3)]| {
                let (a, b) = (pair[0].1, pair[1].1);
                (a[0] - b[0]).abs().max((a[1] - b[1]).abs())
            };
            for trail in &scene.trails {
                assert_eq!((trail.points[0].0, trail.points[trail.points.len() - 1].0), (50, 450));
                let cycles = trail.points.chunk_by(|a, b| a.0 == b.0).count();
                assert_eq!(cycles as Cycle, TRAIL_CYCLES + 1);
                let leaps = trail.points.windows(2).filter(|pair| far(pair) > 2.01 * box_m).count();
                assert_eq!(leaps, 0, "no trail leaps");
            }
        }
        assert_ne!(scenes[0].trails, scenes[1].trails);
    }
}
