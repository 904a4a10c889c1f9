//! The buildings of the experiments, our own: the paper's floor is not published.

use super::patrol::{Patrol, Trust};
use serde::Serialize;
use sidestep::map::Rect;
use sidestep::office::{Office, OfficeSpec};
use sidestep::planning::{FlowField, FreeSpace};
use sidestep::worlds::robots::decide::{Behaviour, Shuttle};
use std::sync::Arc;

/// Side of a box in metres: the paper's robot, 0.53 m across, covers 2 x 2 of them.
pub const BOX_SIZE_M: f64 = 0.25;

/// Boxes at each end of a corridor that count as its end.
const END_BOXES: u32 = 4;

/// How a robot goes to and fro.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Mind {
    /// The built-in `shuttle`: keeps to its way until it touches something.
    Touch,
    /// Steps around what its sonar reports, on one beam's word.
    Avoid,
    /// The same, but believes only what two reports agree on.
    Filter,
}

impl Mind {
    /// All three.
    pub const ALL: [Self; 3] = [Self::Touch, Self::Avoid, Self::Filter];

    /// Its name in tables.
    pub fn name(self) -> &'static str {
        ["touch", "avoid", "filter"][self as usize]
    }

    fn between(self, ends: [Arc<FlowField>; 2]) -> Arc<dyn Behaviour> {
        match self {
            Self::Touch => Arc::new(Shuttle { ends }),
            Self::Avoid => Arc::new(Patrol { ends, trust: Trust::OneBeam }),
            Self::Filter => Arc::new(Patrol { ends, trust: Trust::TwoReports }),
        }
    }
}

/// A floor of corridors and rooms, and who is in it.
#[derive(Debug, Clone, Serialize)]
pub struct Floor {
    /// Its name in tables.
    pub name: String,
    /// How it is built.
    pub spec: OfficeSpec,
    /// Robots in each corridor.
    pub robots_per_corridor: u32,
    /// People on the floor.
    pub people: u32,
    /// The building.
    #[serde(skip)]
    pub office: Arc<Office>,
}

impl Floor {
    /// A floor of an office.
    ///
    /// # Panics
    /// When the specification is not that of an office; the experiments' own are.
    pub fn new(name: &str, spec: OfficeSpec, robots_per_corridor: u32, people: u32) -> Self {
        let office = Arc::new(spec.build(BOX_SIZE_M).expect("the experiments' offices stand"));
        Self { name: name.into(), spec, robots_per_corridor, people, office }
    }

    /// One corridor with 8 rooms.
    pub fn small() -> Self {
        let spec = OfficeSpec { corridors: 1, rooms_per_side: 4, ..Self::spec() };
        Self::new("small", spec, 8, 4)
    }

    /// Two corridors with 24 rooms; the floor of the experiments that name none.
    pub fn medium() -> Self {
        Self::new("medium", Self::spec(), 8, 8)
    }

    /// Two floors of three corridors with 96 rooms.
    pub fn large() -> Self {
        let spec = OfficeSpec { floors: 2, corridors: 3, rooms_per_side: 8, ..Self::spec() };
        Self::new("large", spec, 6, 24)
    }

    fn spec() -> OfficeSpec {
        OfficeSpec { corridor_width_m: 3.0, ..OfficeSpec::default() }
    }

    /// The corridors along which robots go: not those across, nor passages.
    pub fn corridors(&self) -> impl Iterator<Item = &Rect> {
        self.office.corridors.iter().filter(|c| c.width > 4 * c.height)
    }

    /// Robots on the floor.
    pub fn robots(&self) -> u32 {
        self.robots_per_corridor * self.corridors().count() as u32
    }

    /// The behaviour of the robots of each corridor, for bodies of `size` x `size` boxes.
    pub fn behaviours(&self, mind: Mind, size: u32) -> Vec<Arc<dyn Behaviour>> {
        let free = FreeSpace::of_map(&self.office.map);
        self.corridors().map(|corridor| mind.between(ends(&free, corridor, size))).collect()
    }

    /// `[map]` of a scenario.
    pub fn map_section(&self) -> String {
        let s = &self.spec;
        format!(
            "[map]\nbox_size_m = {BOX_SIZE_M:?}\n[map.office]\nfloors = {}\ncorridors = {}\n\
             rooms_per_side = {}\nroom_width_m = {:?}\nroom_depth_m = {:?}\n\
             corridor_width_m = {:?}\ndoor_width_m = {:?}\n",
            s.floors,
            s.corridors,
            s.rooms_per_side,
            s.room_width_m,
            s.room_depth_m,
            s.corridor_width_m,
            s.door_width_m,
        )
    }

    /// What the floor is, in words.
    pub fn describe(&self) -> String {
        let map = &self.office.map;
        format!(
            "{}: {} x {} boxes of {BOX_SIZE_M} m, corridors {}, rooms with doors {}, robots {}, \
             people {}",
            self.name,
            map.width(),
            map.height(),
            self.corridors().count(),
            self.office.rooms.len(),
            self.robots(),
            self.people,
        )
    }
}

/// Ways to the west and to the east end of a corridor.
fn ends(free: &FreeSpace, corridor: &Rect, size: u32) -> [Arc<FlowField>; 2] {
    let last = corridor.col + corridor.width - size;
    let way = |from: u32| {
        let goals: Vec<_> = (from..from + END_BOXES)
            .flat_map(|col| (corridor.row..corridor.row + corridor.height).map(move |r| (col, r)))
            .collect();
        Arc::new(FlowField::towards(free, size, &goals))
    };
    [way(corridor.col), way(last + 1 - END_BOXES)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn robots_of_every_size_find_a_way_along_every_corridor_of_every_floor() {
        for floor in [Floor::small(), Floor::medium(), Floor::large()] {
            let free = FreeSpace::of_map(&floor.office.map);
            assert_eq!(floor.corridors().count() as u32, floor.spec.floors * floor.spec.corridors);
            for (corridor, size) in floor.corridors().flat_map(|c| (1..=5).map(move |s| (c, s))) {
                let [west, east] = ends(&free, corridor, size);
                let middle = (corridor.col + corridor.width / 2, corridor.row);
                assert_eq!(west.direction(middle.0, middle.1), Some(2));
                assert_eq!(east.direction(middle.0, middle.1), Some(0));
                assert!(west.is_goal(corridor.col, corridor.row));
                assert!(east.is_goal(corridor.col + corridor.width - size, corridor.row));
            }
        }
    }
}
