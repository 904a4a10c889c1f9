//! A generated office building of any size: corridors with rooms on both sides.
//!
//! ```text
//!  #############################      A floor has `corridors` corridors from west to east, each
//!  #   #      #      #      #  #      with `rooms_per_side` rooms to the north and to the south.
//!  #   #      #      #      #  #      Every room has one door to its corridor. With two or more
//!  #   ###++#####++#####++###  #      corridors, two cross corridors along the west and the east
//!  #                           #      edge join them.
//!  #   ###++#####++#####++###  #      `floors` such floors stand side by side, each joined to the
//!  #   #      #      #      #  #      next by a passage between their southernmost corridors.
//!  ...                                Walls are one box thick; `+` is a door.
//! ```

use std::fmt;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sidestep_kernel::InputError;

use crate::{Cell, GridMap, MAX_BOXES, Rect, check_box_count, check_box_size};

/// The dimensions of the building. Lengths are rounded to whole boxes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct OfficeSpec {
    /// Floors side by side, at least 1.
    pub floors: u32,
    /// Corridors from west to east on each floor, at least 1.
    pub corridors: u32,
    /// Rooms on either side of each corridor, at least 1.
    pub rooms_per_side: u32,
    /// Inner width of a room along the corridor, in meters.
    pub room_width_m: f64,
    /// Inner depth of a room away from the corridor, in meters.
    pub room_depth_m: f64,
    /// Width of all corridors and passages, in meters.
    pub corridor_width_m: f64,
    /// Width of the doors, in meters; not more than `room_width_m`.
    pub door_width_m: f64,
}

impl Default for OfficeSpec {
    /// One floor with two corridors and 24 rooms of 4 m x 5 m.
    fn default() -> Self {
        Self {
            floors: 1,
            corridors: 2,
            rooms_per_side: 6,
            room_width_m: 4.0,
            room_depth_m: 5.0,
            corridor_width_m: 2.5,
            door_width_m: 1.0,
        }
    }
}

/// A generated building. Doors, rooms and corridors are free in `map`; doors that can close are
/// bodies, which the world puts into the doors' rectangles.
#[derive(Debug, Clone, PartialEq)]
pub struct Office {
    /// The building; its lower-left corner is the origin of the world.
    pub map: GridMap,
    /// One door per room, in the order of `rooms`.
    pub doors: Vec<Rect>,
    /// Corridors from west to east, floor by floor and from the south, followed on each floor by
    /// its cross corridors (west, east); the passages between floors come last. Corridors overlap
    /// where they meet.
    pub corridors: Vec<Rect>,
    /// Rooms floor by floor; on a floor, corridor by corridor from the south; at a corridor, the
    /// rooms to the south of it from the west, then those to the north.
    pub rooms: Vec<Rect>,
}

impl OfficeSpec {
    /// Builds the office from boxes with a side of `box_size_m` meters.
    ///
    /// # Errors
    /// When a number is 0 or a length less than half a box, the doors are wider than the rooms,
    /// or the building has more than [`MAX_BOXES`]. The error's place is
    /// `office.` and the invalid key.
    pub fn build(&self, box_size_m: f64) -> Result<Office, InputError> {
        BoxDimensions::new(self, check_box_size(box_size_m)?)?.build(box_size_m)
    }
}

/// The specification in boxes.
#[derive(Debug, Clone, Copy)]
struct BoxDimensions {
    floors: u32,
    corridors: u32,
    rooms_per_side: u32,
    room_width: u32,
    room_depth: u32,
    corridor_width: u32,
    door_width: u32,
}

impl BoxDimensions {
    fn new(spec: &OfficeSpec, box_size_m: f64) -> Result<Self, InputError> {
        let dimensions = Self {
            floors: check_positive("floors", spec.floors)?,
            corridors: check_positive("corridors", spec.corridors)?,
            rooms_per_side: check_positive("rooms_per_side", spec.rooms_per_side)?,
            room_width: boxes("room_width_m", spec.room_width_m, box_size_m)?,
            room_depth: boxes("room_depth_m", spec.room_depth_m, box_size_m)?,
            corridor_width: boxes("corridor_width_m", spec.corridor_width_m, box_size_m)?,
            door_width: boxes("door_width_m", spec.door_width_m, box_size_m)?,
        };
        if dimensions.door_width > dimensions.room_width {
            let cause = format!(
                "doors of {} m are wider than rooms of {} m",
                spec.door_width_m, spec.room_width_m
            );
            return Err(spec_error("door_width_m", cause, "give narrower doors or wider rooms"));
        }
        Ok(dimensions)
    }

    fn build(&self, box_size_m: f64) -> Result<Office, InputError> {
        let (width, height) = self.size()?;
        let mut layout = Layout::default();
        for floor in 0..self.floors {
            self.build_floor(&mut layout, floor * self.floor_pitch());
        }
        for floor in 1..self.floors {
            self.build_passage(&mut layout, floor * self.floor_pitch());
        }
        let cells = layout.to_cells(width, height);
        let map = GridMap::new(width, height, box_size_m, cells);
        let Layout { doors, corridors, rooms } = layout;
        Ok(Office { map, doors, corridors, rooms })
    }

    /// Returns width and height of the building in boxes, all walls included.
    fn size(&self) -> Result<(u32, u32), InputError> {
        // In 64 bits and saturating, because numbers from a file may be anything.
        let [floors, corridors, rooms_per_side, room_width, corridor_width] = [
            self.floors,
            self.corridors,
            self.rooms_per_side,
            self.room_width,
            self.corridor_width,
        ]
        .map(u64::from);
        let rooms = rooms_per_side.saturating_mul(room_width + 1);
        let floor = rooms.saturating_add(1 + 2 * self.cross_pitch());
        let gaps = (floors - 1).saturating_mul(corridor_width);
        let width = floor.saturating_mul(floors).saturating_add(gaps);
        let bands = corridors.saturating_mul(self.band_pitch());
        check_box_count("office", width, bands.saturating_add(1))
    }

    /// Number of boxes from one corridor to the next: two rows of rooms, three walls and a
    /// corridor.
    fn band_pitch(&self) -> u64 {
        2 * u64::from(self.room_depth) + u64::from(self.corridor_width) + 3
    }

    /// Number of boxes of a cross corridor and its wall; 0 where there is none.
    fn cross_pitch(&self) -> u64 {
        if self.corridors > 1 { u64::from(self.corridor_width) + 1 } else { 0 }
    }

    // The sums below stay within the building, because `size` has checked its size.

    /// Number of boxes of a cross corridor and its wall, within a building of checked size.
    fn cross_width(&self) -> u32 {
        self.cross_pitch() as u32
    }

    /// Number of boxes from the west edge of a floor to that of the next.
    fn floor_pitch(&self) -> u32 {
        self.floor_width() + self.corridor_width
    }

    fn floor_width(&self) -> u32 {
        1 + self.rooms_per_side * (self.room_width + 1) + 2 * self.cross_width()
    }

    /// Returns the southernmost row of a corridor: the first lies north of the outer wall, a room and its wall with the
    /// door, each further one a whole band farther north.
    fn corridor_row(&self, corridor: u32) -> u32 {
        corridor * self.band_pitch() as u32 + self.room_depth + 2
    }

    fn build_floor(&self, layout: &mut Layout, west: u32) {
        for corridor in 0..self.corridors {
            let row = self.corridor_row(corridor);
            self.build_corridor(layout, west, row);
            let first_room = west + 1 + self.cross_width();
            self.build_rooms(layout, first_room, row - 1 - self.room_depth, row - 1);
            let north_wall = row + self.corridor_width;
            self.build_rooms(layout, first_room, north_wall + 1, north_wall);
        }
        if self.corridors > 1 {
            self.build_cross_corridors(layout, west);
        }
    }

    fn build_corridor(&self, layout: &mut Layout, west: u32, row: u32) {
        let width = self.floor_width() - 2;
        layout.corridors.push(Rect { col: west + 1, row, width, height: self.corridor_width });
    }

    /// Builds rooms with their lowest row at `row` and their doors in the row `door_row`.
    fn build_rooms(&self, layout: &mut Layout, west: u32, row: u32, door_row: u32) {
        for room in 0..self.rooms_per_side {
            let col = west + room * (self.room_width + 1);
            layout.rooms.push(Rect { col, row, width: self.room_width, height: self.room_depth });
            layout.doors.push(Rect {
                col: col + (self.room_width - self.door_width) / 2,
                row: door_row,
                width: self.door_width,
                height: 1,
            });
        }
    }

    fn build_cross_corridors(&self, layout: &mut Layout, west: u32) {
        let row = self.corridor_row(0);
        let height = self.corridor_row(self.corridors - 1) + self.corridor_width - row;
        let width = self.corridor_width;
        for col in [west + 1, west + self.floor_width() - 1 - width] {
            layout.corridors.push(Rect { col, row, width, height });
        }
    }

    /// Builds the passage to the floor that starts at column `west` from the one before it.
    fn build_passage(&self, layout: &mut Layout, west: u32) {
        layout.corridors.push(Rect {
            col: west - self.corridor_width - 1,
            row: self.corridor_row(0),
            // Through the outer walls of both floors.
            width: self.corridor_width + 2,
            height: self.corridor_width,
        });
    }
}

/// The free parts of the building; everything else is wall.
#[derive(Debug, Default)]
struct Layout {
    doors: Vec<Rect>,
    corridors: Vec<Rect>,
    rooms: Vec<Rect>,
}

impl Layout {
    /// Returns the boxes of a `width` x `height` building: free where the layout has a rectangle.
    fn to_cells(&self, width: u32, height: u32) -> Vec<Cell> {
        let mut cells = vec![Cell::Wall; width as usize * height as usize];
        for rect in self.rooms.iter().chain(&self.doors).chain(&self.corridors) {
            for row in rect.row..rect.row + rect.height {
                let start = row as usize * width as usize + rect.col as usize;
                cells[start..start + rect.width as usize].fill(Cell::Free);
            }
        }
        cells
    }
}

fn boxes(key: &str, length_m: f64, box_size_m: f64) -> Result<u32, InputError> {
    let boxes = (length_m / box_size_m).round();
    // NaN is refused too, because it is in no range.
    if (1.0..=MAX_BOXES as f64).contains(&boxes) {
        return Ok(boxes as u32);
    }
    let cause = format!("{length_m} m are not from 1 to {MAX_BOXES} boxes of {box_size_m} m");
    Err(spec_error(key, cause, "give a length in meters that is at least one box"))
}

fn check_positive(key: &str, number: u32) -> Result<u32, InputError> {
    if number == 0 {
        return Err(spec_error(key, "an office has at least one of these", "give 1 or more"));
    }
    Ok(number)
}

fn spec_error(key: impl fmt::Display, cause: impl Into<String>, remedy: &str) -> InputError {
    InputError::new(format!("office.{key}"), cause, remedy)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::UnknownPolicy;
    use proptest::prelude::*;

    fn small() -> OfficeSpec {
        OfficeSpec {
            corridors: 1,
            rooms_per_side: 2,
            room_width_m: 3.0,
            room_depth_m: 1.0,
            corridor_width_m: 2.0,
            ..OfficeSpec::default()
        }
    }

    fn drawn(spec: &OfficeSpec) -> String {
        spec.build(1.0).expect("an office").map.to_text(80)
    }

    #[test]
    fn one_corridor_has_rooms_with_doors_on_both_sides() {
        let expected = "\
#########
#...#...#
##.###.##
#.......#
#.......#
##.###.##
#...#...#
#########
";
        assert_eq!(drawn(&small()), expected);
    }

    #[test]
    fn cross_corridors_join_corridors_and_passages_join_floors() {
        let spec = OfficeSpec {
            floors: 2,
            corridors: 2,
            rooms_per_side: 1,
            corridor_width_m: 1.0,
            ..small()
        };
        let expected = "\
###################
###...#######...###
####.#########.####
#.......###.......#
#.##.##.###.##.##.#
#.#...#.###.#...#.#
#.#####.###.#####.#
#.#...#.###.#...#.#
#.##.##.###.##.##.#
#.................#
####.#########.####
###...#######...###
###################
";
        assert_eq!(drawn(&spec), expected);
    }

    #[test]
    fn the_default_office_is_one_connected_building() {
        let office = OfficeSpec::default().build(0.25).expect("an office");
        assert_eq!((office.rooms.len(), office.doors.len()), (24, 24));
        assert_eq!(office.corridors.len(), 4);
        assert_eq!(office.map.components(UnknownPolicy::Keep).sizes().len(), 1);
    }

    #[test]
    fn wrong_numbers_name_their_key() {
        let refused = |spec: OfficeSpec| spec.build(0.5).expect_err("wrong").place().to_owned();
        let default = OfficeSpec::default;
        assert_eq!(refused(OfficeSpec { floors: 0, ..default() }), "office.floors");
        assert_eq!(refused(OfficeSpec { corridors: 0, ..default() }), "office.corridors");
        assert_eq!(refused(OfficeSpec { rooms_per_side: 0, ..default() }), "office.rooms_per_side");
        assert_eq!(refused(OfficeSpec { room_width_m: 0.2, ..default() }), "office.room_width_m");
        assert_eq!(
            refused(OfficeSpec { room_depth_m: f64::NAN, ..default() }),
            "office.room_depth_m"
        );
        let endless = OfficeSpec { corridor_width_m: f64::INFINITY, ..default() };
        assert_eq!(refused(endless), "office.corridor_width_m");
        assert_eq!(refused(OfficeSpec { door_width_m: 5.0, ..default() }), "office.door_width_m");
        assert!(default().build(0.0).is_err());
    }

    #[test]
    fn absurd_sizes_are_refused_before_memory_is_allocated() {
        let most = OfficeSpec {
            floors: u32::MAX,
            corridors: u32::MAX,
            rooms_per_side: u32::MAX,
            ..OfficeSpec::default()
        };
        assert!(most.build(0.25).is_err());
        assert!(OfficeSpec { floors: u32::MAX, ..small() }.build(0.25).is_err());
        assert!(OfficeSpec { room_depth_m: 1e7, ..small() }.build(0.25).is_err());
    }

    #[test]
    fn ten_million_boxes_are_built() {
        let spec = OfficeSpec { corridors: 60, rooms_per_side: 180, ..OfficeSpec::default() };
        let office = spec.build(0.25).expect("a large office");
        assert!(office.map.cells().len() > 9_000_000, "{}", office.map.cells().len());
        assert_eq!(office.rooms.len(), 60 * 180 * 2);
    }

    #[test]
    fn a_table_may_leave_out_every_key_but_misspell_none() {
        let spec: OfficeSpec = toml::from_str("floors = 3\ndoor_width_m = 0.9").expect("a spec");
        let expected = OfficeSpec { floors: 3, door_width_m: 0.9, ..OfficeSpec::default() };
        assert_eq!(spec, expected);
        assert!(toml::from_str::<OfficeSpec>("storeys = 3").is_err());
    }

    proptest! {
        #[test]
        fn every_office_is_connected_walled_in_and_free_in_its_rectangles(
            floors in 1u32..4, corridors in 1u32..4, rooms_per_side in 1u32..5,
            room_width in 1u32..6, depth in 1u32..4, corridor in 1u32..4, door in 1u32..4,
        ) {
            let spec = OfficeSpec {
                floors,
                corridors,
                rooms_per_side,
                room_width_m: f64::from(room_width.max(door)) * 0.3,
                room_depth_m: f64::from(depth) * 0.3,
                corridor_width_m: f64::from(corridor) * 0.3,
                door_width_m: f64::from(door) * 0.3,
            };
            let office = spec.build(0.3).expect("an office");
            let map = &office.map;
            prop_assert_eq!(map.components(UnknownPolicy::Keep).sizes().len(), 1);
            let rects = office.rooms.iter().chain(&office.doors).chain(&office.corridors);
            let in_rects = |col, row| rects.clone().any(|rect: &Rect| rect.contains(col, row));
            for row in 0..map.height() {
                for col in 0..map.width() {
                    let edge = [col, row].contains(&0)
                        || col + 1 == map.width() || row + 1 == map.height();
                    let is_free = map.cell(col, row) == Cell::Free;
                    prop_assert_eq!(is_free, in_rects(col, row));
                    prop_assert!(!(edge && is_free));
                }
            }
        }
    }
}
