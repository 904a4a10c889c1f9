//! The trajectory picture: map, doors, and robots' tracks as wide as the robots.

use super::Pictured;
use super::poses;
use crate::console::grouped;
use crate::exit::Failure;
use crate::recorded::has_rows;
use sidestep::Cell;
use sidestep::kernel::{Cycle, InputError, Simulation};
use sidestep::worlds::robots::RobotsWorld;
use sidestep::worlds::robots::simulation::RobotsSimulation;
use sidestep::worlds::robots::state::{BodyRecord, Snapshot};
use sidestep::worlds::robots::world::Role;
use sidestep_draw::{BodyRect, BodyShade, CellShade, DoorRect, GridScene, Style, Track, to_svg};
use sidestep_record::read_table;
use std::collections::BTreeMap;
use std::ops::Range;
use std::path::Path;

/// More tracks than there are colors cannot be told apart.
const MOST_TRACKS: usize = 6;
/// Bodies without a track of their own are black, the last of seven colors.
const OTHERS: usize = 6;
/// Lengths of tracks in cycles, the longest first: shorter ones are for crowds, where long
/// ones would cover each other.
const LENGTHS: [Cycle; 4] = [400, 200, 100, 50];
/// Tracks are shortened while more than this share of what they cover is covered twice.
const MOST_SHARED: f64 = 0.3;

/// The state of `simulation` with the tracks that led to it.
pub(super) fn svg(simulation: &RobotsSimulation, of: Pictured<'_>) -> Result<String, Failure> {
    let ways = match of.folder.filter(|f| has_rows(f, poses::TABLE)) {
        Some(folder) => Ways::read(simulation, folder, &shown(simulation.world()))?,
        None => Ways::default(),
    };
    let title = simulation.compiled().name.clone();
    let scene = GridScene { title, ..with_ways(simulation, ways, of.origin) };
    Ok(to_svg(&scene, &Style::MAP)?)
}

/// The state of `simulation` with the last part of some of the `ways` that led to it, and a
/// caption about them that ends with `origin`.
pub(crate) fn with_ways(simulation: &RobotsSimulation, mut ways: Ways, origin: &str) -> GridScene {
    let world = simulation.world();
    let shown = shown(world);
    ways.of.retain(|(id, _)| shown.contains(id));
    let ways = ways.shortened(world);
    let tracks: Vec<Track> = ways.of.iter().map(|(id, way)| track(world, *id, way)).collect();
    let cycles = ways.from..simulation.cycle();
    GridScene {
        caption: caption(tracks.len(), world.robots().len(), cycles, origin),
        tracks,
        ..scene(world, &simulation.snapshot(), &shown)
    }
}

/// Entity ids of the robots that have a color.
fn shown(world: &RobotsWorld) -> Vec<u32> {
    evenly_chosen(world.robots(), MOST_TRACKS)
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
    let ty = world.type_of(id);
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

/// At most `most` of `ids`, at equal steps, the first among them.
fn evenly_chosen(ids: &[u32], most: usize) -> Vec<u32> {
    let chosen = ids.len().min(most);
    (0..chosen).map(|k| ids[k * ids.len() / chosen]).collect()
}

/// The ways of some robots up to now: places, and the headings in which they were left.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Ways {
    /// The cycle at which they begin.
    pub(crate) from: Cycle,
    /// By entity id.
    pub(crate) of: Vec<(u32, Vec<Place>)>,
}

/// Column and row, and the heading.
pub(crate) type Place = ((u32, u32), u32);

impl Ways {
    /// Reads the recorded poses of the last [`LENGTHS`]`[0]` cycles.
    fn read(
        simulation: &RobotsSimulation,
        folder: &Path,
        shown: &[u32],
    ) -> Result<Self, InputError> {
        let from = simulation.cycle().saturating_sub(LENGTHS[0]);
        let table = read_table(folder, poses::TABLE, from..simulation.cycle())?;
        let mut rows = poses::recorded(&table).unwrap_or_default();
        rows.retain(|row| shown.contains(&row.body));
        rows.sort_unstable_by_key(|row| (row.body, row.cycle));
        if rows.last().is_none_or(|row| row.cycle + 1 != simulation.cycle()) {
            // The record ends before this moment: a track would leap.
            return Ok(Self::default());
        }
        let now = simulation.snapshot();
        let way = |id: u32| {
            let of_this = rows.iter().filter(|row| row.body == id);
            let last = (now.bodies[id as usize].at, 0);
            of_this.map(|row| (row.at, row.heading)).chain([last]).collect()
        };
        Ok(Self { from, of: shown.iter().map(|&id| (id, way(id))).collect() })
    }

    /// The last part of the ways that leaves them distinguishable.
    fn shortened(self, world: &RobotsWorld) -> Self {
        let fits = |length: &Cycle| self.last(*length).shared(world) <= MOST_SHARED;
        let length = LENGTHS.into_iter().find(fits).unwrap_or(LENGTHS[LENGTHS.len() - 1]);
        self.last(length)
    }

    /// The last `length` cycles.
    fn last(&self, length: Cycle) -> Self {
        let longest = self.of.iter().map(|(_, way)| way.len()).max().unwrap_or(0);
        let dropped = longest.saturating_sub(length as usize + 1);
        let cut = |way: &Vec<Place>| way[dropped.min(way.len())..].to_vec();
        Self {
            from: self.from + dropped as Cycle,
            of: self.of.iter().map(|(id, way)| (*id, cut(way))).collect(),
        }
    }

    /// The share of the covered boxes that two robots or more have covered.
    fn shared(&self, world: &RobotsWorld) -> f64 {
        let mut robots_in = BTreeMap::<(u32, u32), u32>::new();
        for (index, (id, way)) in self.of.iter().enumerate() {
            let (width, height) = world.type_of(*id).size;
            for ((col, row), _) in way {
                let boxes = (0..height).flat_map(|y| (0..width).map(move |x| (col + x, row + y)));
                boxes.for_each(|at| *robots_in.entry(at).or_default() |= 1 << index);
            }
        }
        let twice = robots_in.values().filter(|robots| robots.count_ones() > 1).count();
        twice as f64 / robots_in.len().max(1) as f64
    }
}

/// The ribbon of a robot's way.
fn track(world: &RobotsWorld, id: u32, way: &[Place]) -> Track {
    let (width, height) = world.type_of(id).size;
    let center = |(col, row): (u32, u32)| {
        (f64::from(col) + f64::from(width) / 2.0, f64::from(row) + f64::from(height) / 2.0)
    };
    let first = way.first().map(|(at, _)| *at);
    let steps = way.windows(2).flat_map(|w| [corner(w[0], w[1].0), w[1].0]);
    Track {
        width_boxes: f64::from(width),
        points: first.into_iter().chain(steps).map(center).collect(),
        label: format!("robot {id}"),
        highlighted: false,
    }
}

/// Where a robot that slips to the side is half-way: straight ahead of where it was.
fn corner((from, heading): Place, to: (u32, u32)) -> (u32, u32) {
    if heading % 2 == 0 { (to.0, from.1) } else { (from.0, to.1) }
}

fn caption(tracks: usize, robots: usize, cycles: Range<Cycle>, origin: &str) -> String {
    let (from, to) = (grouped(cycles.start), grouped(cycles.end));
    let what = match tracks {
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
    fn a_slip_goes_ahead_before_it_goes_aside() {
        let (east, north) = (0, 1);
        assert_eq!(corner(((5, 5), east), (6, 6)), (6, 5));
        assert_eq!(corner(((5, 5), north), (4, 6)), (5, 6));
        assert_eq!(corner(((5, 5), east), (5, 5)), (5, 5));
    }

    #[test]
    fn robots_are_chosen_evenly() {
        let ids: Vec<u32> = (0..24).collect();
        assert_eq!(evenly_chosen(&ids, 6), [0, 4, 8, 12, 16, 20]);
        assert_eq!(evenly_chosen(&ids[..3], 6), [0, 1, 2]);
        assert!(evenly_chosen(&[], 6).is_empty());
    }
}
