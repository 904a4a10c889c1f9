//! The buildings of the experiments, our own because the paper's floor is not published.

use serde::{Deserialize, Serialize};
use sidestep::map::Rect;
use sidestep::office::{Office, OfficeSpec};
use std::sync::Arc;

/// The floors: boxes of 0.25 m, of which the paper's robot, 0.53 m across, covers 2 x 2.
const SMALL: &str = include_str!("../../scenarios/loria/small.toml");
const MEDIUM: &str = include_str!("../../scenarios/loria/medium.toml");
const LARGE: &str = include_str!("../../scenarios/loria/large.toml");

/// Boxes at each end of a corridor that count as its end: room for two robots behind each other.
const END_BOXES: u32 = 4;

/// How a robot that goes to and fro avoids obstacles, by the names of a scenario.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum AvoidancePolicy {
    /// Keeps to its path until it touches something.
    Touch,
    /// Steps around things that its sonar reports, as soon as one beam does.
    Avoid,
    /// The same, but believes only things on which two reports agree.
    Filter,
}

impl AvoidancePolicy {
    #[cfg(test)]
    pub(super) const ALL: [Self; 3] = [Self::Touch, Self::Avoid, Self::Filter];

    /// Returns its name in tables.
    pub(super) fn name(self) -> &'static str {
        ["touch", "avoid", "filter"][self as usize]
    }
}

/// A floor of corridors and rooms, with its robots and people.
#[derive(Debug, Clone)]
pub(super) struct Floor {
    /// Its name in tables.
    pub(super) name: &'static str,
    /// The text of its scenario, which a variant changes.
    pub(super) scenario: &'static str,
    /// The building that the scenario describes.
    pub(super) office: Arc<Office>,
    robots_per_corridor: u32,
    people: u32,
}

/// The parts of a scenario that the experiments must know.
#[derive(Deserialize)]
struct ScenarioExcerpt {
    map: MapSection,
    robots: Vec<GroupSection>,
    people: Vec<GroupSection>,
}

#[derive(Deserialize)]
struct MapSection {
    box_size_m: f64,
    office: OfficeSpec,
}

#[derive(Deserialize)]
struct GroupSection {
    count: u32,
}

impl Floor {
    fn new(name: &'static str, scenario: &'static str) -> Self {
        let excerpt: ScenarioExcerpt =
            toml::from_str(scenario).expect("the experiments' scenarios are valid");
        let office = excerpt.map.office.build(excerpt.map.box_size_m);
        Self {
            name,
            scenario,
            office: Arc::new(office.expect("the experiments' offices stand")),
            // Every corridor has a group of robots of its own, all of them equally many.
            robots_per_corridor: excerpt.robots[0].count,
            people: excerpt.people[0].count,
        }
    }

    /// Returns one corridor with 8 rooms.
    pub(super) fn small() -> Self {
        Self::new("small", SMALL)
    }

    /// Returns two corridors with 24 rooms; the floor of the experiments that name none.
    pub(super) fn medium() -> Self {
        Self::new("medium", MEDIUM)
    }

    /// Returns two floors of three corridors with 96 rooms.
    pub(super) fn large() -> Self {
        Self::new("large", LARGE)
    }

    /// Returns the corridors along which robots go: those that are long from west to east, which the cross corridors and the
    /// passages are not.
    pub(super) fn corridors(&self) -> impl Iterator<Item = &Rect> {
        self.office.corridors.iter().filter(|c| c.width > 4 * c.height)
    }

    /// Every corridor has as many of them.
    pub(super) fn robots(&self) -> u32 {
        self.robots_per_corridor * self.corridors().count() as u32
    }

    /// Size, corridors, rooms, robots and people, for notes of tables.
    pub(super) fn describe(&self) -> String {
        let map = &self.office.map;
        format!(
            "{}: {} x {} boxes of {} m, corridors {}, rooms with doors {}, robots {}, \
             people {}",
            self.name,
            map.width(),
            map.height(),
            map.box_size_m,
            self.corridors().count(),
            self.office.rooms.len(),
            self.robots(),
            self.people,
        )
    }
}

/// Returns the west and the east end of a corridor as regions of a scenario, for bodies of `size` x
/// `size` boxes.
pub(super) fn ends(corridor: &Rect, size: u32) -> [[u32; 4]; 2] {
    // Regions are of places of a body's corner box, the last of which leaves room for the body before the east wall.
    let last = corridor.col + corridor.width - size;
    [corridor.col, last + 1 - END_BOXES].map(|col| [col, corridor.row, END_BOXES, corridor.height])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn there_is_a_group_of_robots_for_every_corridor_and_its_ends_are_those_of_the_scenario() {
        for floor in [Floor::small(), Floor::medium(), Floor::large()] {
            let scenario: toml::Table = toml::from_str(floor.scenario).expect("a right scenario");
            let groups = scenario["robots"].as_array().expect("a list");
            assert_eq!(floor.corridors().count(), groups.len());
            for (corridor, group) in floor.corridors().zip(groups) {
                let end = |key: &str| group["behaviour"][key].clone().try_into().expect("a region");
                let expected: [[u32; 4]; 2] = [end("a"), end("b")];
                assert_eq!(ends(corridor, 2), expected);
            }
        }
    }
}
