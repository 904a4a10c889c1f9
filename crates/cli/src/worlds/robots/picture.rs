//! The trajectory picture: map, doors, and robots' tracks as wide as the robots.

use super::Pictured;
use super::poses::{self, RecordedPose};
use crate::console::grouped;
use crate::exit::Failure;
use sidestep::Cell;
use sidestep::kernel::{Cycle, InputError, Simulation};
use sidestep::worlds::robots::RobotsWorld;
use sidestep::worlds::robots::simulation::RobotsSimulation;
use sidestep::worlds::robots::state::{BodyRecord, Snapshot};
use sidestep::worlds::robots::world::Role;
use sidestep_draw::{BodyRect, BodyShade, CellShade, DoorRect, GridScene, Style, Track, to_svg};
use sidestep_record::read_table;
use std::ops::Range;
use std::path::Path;

/// More tracks than there are colors cannot be told apart.
const MOST_TRACKS: usize = 6;
/// Bodies without a track of their own are black, the last of seven colors.
const OTHERS: usize = 6;
/// Longer tracks would cover the whole floor.
const MOST_CYCLES: Cycle = 400;

/// The state of `simulation` with the tracks that led to it.
pub(super) fn svg(simulation: &RobotsSimulation, of: Pictured<'_>) -> Result<String, Failure> {
    let snapshot = simulation.snapshot();
    let shown = evenly_chosen(&robots(simulation.world()), MOST_TRACKS);
    let cycles = simulation.cycle().saturating_sub(MOST_CYCLES)..simulation.cycle();
    let tracks = match of.folder.filter(|f| poses::has_rows(f)) {
        Some(folder) => tracks(simulation, folder, &shown, cycles.clone())?,
        None => Vec::new(),
    };
    let caption = caption(&tracks, robots(simulation.world()).len(), cycles, of.origin);
    let scene = GridScene {
        tracks,
        caption,
        title: simulation.compiled().name.clone(),
        ..scene(simulation.world(), &snapshot, &shown)
    };
    Ok(to_svg(&scene, &Style::MAP)?)
}

/// Map, doors and bodies.
fn scene(world: &RobotsWorld, snapshot: &Snapshot, shown: &[u32]) -> GridScene {
    let mut scene = GridScene {
        width: world.map.width(),
        height: world.map.height(),
        box_size_m: world.map.box_size_m,
        origin_m: world.map.origin_m,
        cells: world.map.cells().iter().map(|&cell| shade(cell)).collect(),
        ..GridScene::default()
    };
    for (id, record) in snapshot.bodies.iter().enumerate() {
        add_body(&mut scene, world, id as u32, record, shown);
    }
    scene
}

/// How a box looks.
pub(crate) fn shade(cell: Cell) -> CellShade {
    match cell {
        Cell::Free => CellShade::Free,
        Cell::Wall => CellShade::Wall,
        Cell::Unknown => CellShade::Unknown,
    }
}

fn add_body(
    scene: &mut GridScene,
    world: &RobotsWorld,
    id: u32,
    record: &BodyRecord,
    shown: &[u32],
) {
    let ty = world.body_type(world.slot(id));
    let ((col, row), (width, height)) = (record.at, ty.size);
    let (shade, heading) = match &ty.role {
        Role::Door(_) => {
            scene.doors.push(DoorRect { col, row, width, height, open: record.facing == 1 });
            return;
        }
        Role::Mover(_) => (BodyShade::Active, None),
        Role::Robot(_) => {
            let color = shown.iter().position(|&s| s == id).unwrap_or(OTHERS);
            (BodyShade::Robot(color), Some(record.facing))
        }
    };
    scene.bodies.push(BodyRect { col, row, width, height, heading, shade });
}

/// Entity ids of the robots.
fn robots(world: &RobotsWorld) -> Vec<u32> {
    world.robots().iter().map(|&slot| world.bodies[slot as usize].id).collect()
}

/// At most `most` of `ids`, at equal steps, the first among them.
fn evenly_chosen(ids: &[u32], most: usize) -> Vec<u32> {
    let chosen = ids.len().min(most);
    (0..chosen).map(|k| ids[k * ids.len() / chosen]).collect()
}

fn tracks(
    simulation: &RobotsSimulation,
    folder: &Path,
    shown: &[u32],
    cycles: Range<Cycle>,
) -> Result<Vec<Track>, InputError> {
    let table = read_table(folder, poses::TABLE, cycles)?;
    let mut rows = poses::recorded(&table).unwrap_or_default();
    rows.retain(|row| shown.contains(&row.body));
    rows.sort_unstable_by_key(|row| (row.body, row.cycle));
    let now = simulation.snapshot();
    let track = |&id: &u32| {
        let of_this = rows.iter().filter(|row| row.body == id).map(|row: &RecordedPose| row.at);
        let way = of_this.chain([now.bodies[id as usize].at]);
        track(simulation.world(), id, way)
    };
    Ok(shown.iter().map(track).collect())
}

fn track(world: &RobotsWorld, id: u32, way: impl Iterator<Item = (u32, u32)>) -> Track {
    let (width, height) = world.body_type(world.slot(id)).size;
    let center = |(col, row): (u32, u32)| {
        (f64::from(col) + f64::from(width) / 2.0, f64::from(row) + f64::from(height) / 2.0)
    };
    Track {
        width_boxes: f64::from(width),
        points: way.map(center).collect(),
        label: format!("robot {id}"),
        highlighted: false,
    }
}

fn caption(tracks: &[Track], robots: usize, cycles: Range<Cycle>, origin: &str) -> String {
    let (from, to) = (grouped(cycles.start), grouped(cycles.end));
    let what = match tracks.len() {
        0 => format!("{robots} robots before cycle {to}"),
        n if n == robots => format!("Tracks of all {n} robots, cycles {from} to {to}"),
        n => format!("Tracks of {n} of {robots} robots (the others black), cycles {from} to {to}"),
    };
    format!("{what}. {origin}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn robots_are_chosen_evenly() {
        let ids: Vec<u32> = (0..24).collect();
        assert_eq!(evenly_chosen(&ids, 6), [0, 4, 8, 12, 16, 20]);
        assert_eq!(evenly_chosen(&ids[..3], 6), [0, 1, 2]);
        assert!(evenly_chosen(&[], 6).is_empty());
    }
}
