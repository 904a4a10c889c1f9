//! Floors of pixels: ROS maps and Stage bitmaps.
//!
//! A floor becomes walls without thickness along the edges between free and solid pixels, each as
//! long as the edge is straight. That is exact: for a body outside, the nearest solid point lies on
//! such an edge. It is also compact: a straight wall is one segment, where a box would have four
//! sides, and the inside of solid areas needs nothing. No chain gets there, because walls that meet
//! share their corners bit for bit, and no motion passes through a wall, however thin (see
//! [`Sweep`](sidestep_rods::Sweep)). The walls do not detect a chain that starts inside a solid area;
//! [`FloorMap::is_free`] does.

use sidestep_import::PixelMap;
use sidestep_kernel::math::{cos, sin};
use sidestep_map::{Cell, UnknownPolicy};
use sidestep_rods::Obstacle;
use sidestep_rods::geometry::{Aabb, Point, add, add_scaled, dot, scaled, sub};

/// A plane of pixels, free or solid.
#[derive(Debug, Clone, PartialEq)]
pub struct FloorMap {
    width: u32,
    height: u32,
    /// Row by row from the bottom; length `width * height`.
    solid: Vec<bool>,
    /// Size of a pixel along its row, and across, meters.
    pixel_m: [f64; 2],
    /// Position of the lower-left corner of the lower-left pixel.
    corner_m: Point<2>,
    /// Unit vectors along rows and columns.
    axes: [Point<2>; 2],
    /// Whether everything around the floor is solid.
    is_walled: bool,
}

impl FloorMap {
    /// Returns a floor of `width` x `height` pixels of size `pixel_m`; `solid` holds them row by
    /// row from the bottom. Its lower-left corner lies at the origin, and everything around it is
    /// solid.
    ///
    /// # Panics
    /// If `solid` has another length, there is no pixel, or pixels have no size.
    pub fn new(width: u32, height: u32, pixel_m: [f64; 2], solid: Vec<bool>) -> Self {
        assert_eq!(solid.len(), width as usize * height as usize, "one entry per pixel");
        assert!(!solid.is_empty(), "a floor has a pixel");
        assert!(pixel_m.iter().all(|m| m.is_finite() && *m > 0.0), "a pixel has a size");
        let axes = [[1.0, 0.0], [0.0, 1.0]];
        Self { width, height, solid, pixel_m, corner_m: [0.0; 2], axes, is_walled: true }
    }

    /// Returns the floor of a map; unknown pixels are solid unless `unknown` says that they are
    /// free.
    pub fn from_pixel_map(map: &PixelMap, unknown: UnknownPolicy) -> Self {
        let solid = map.pixels().iter().map(|&cell| unknown.apply(cell) != Cell::Free).collect();
        let floor = Self::new(map.width(), map.height(), [map.resolution_m(); 2], solid);
        let plane = map.plane();
        Self { corner_m: plane.origin_m, axes: axes_from_yaw(plane.yaw_rad), ..floor }
    }

    /// Returns the same floor with its middle at a place, turned about it.
    #[must_use]
    pub fn centered_at(mut self, middle: Point<2>, yaw_rad: f64) -> Self {
        self.axes = axes_from_yaw(yaw_rad);
        let [w, h] = self.extent_m();
        self.corner_m =
            add_scaled(add_scaled(middle, self.axes[0], -0.5 * w), self.axes[1], -0.5 * h);
        self
    }

    /// Returns the same floor with open ground around it.
    #[must_use]
    pub fn without_outer_walls(self) -> Self {
        Self { is_walled: false, ..self }
    }

    /// Returns the number of pixels along a row.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Returns the number of rows.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// Returns the size of a pixel along its row, and across, meters.
    pub fn pixel_m(&self) -> [f64; 2] {
        self.pixel_m
    }

    /// Returns the size of the floor along its rows, and across, meters.
    fn extent_m(&self) -> [f64; 2] {
        [f64::from(self.width) * self.pixel_m[0], f64::from(self.height) * self.pixel_m[1]]
    }

    /// Returns the number of solid pixels.
    pub fn count_solid(&self) -> usize {
        self.solid.iter().filter(|&&solid| solid).count()
    }

    /// Returns whether a pixel is solid; pixels outside the floor are like its surroundings.
    pub fn is_pixel_solid(&self, col: i64, row: i64) -> bool {
        let inside =
            (0..i64::from(self.width)).contains(&col) && (0..i64::from(self.height)).contains(&row);
        if inside {
            self.solid[row as usize * self.width as usize + col as usize]
        } else {
            self.is_walled
        }
    }

    /// Returns whether a place is on no solid pixel; beyond the floor, whether its surroundings are
    /// open.
    pub fn is_free(&self, at: Point<2>) -> bool {
        let from = sub(at, self.corner_m);
        let col = (dot(from, self.axes[0]) / self.pixel_m[0]).floor() as i64;
        let row = (dot(from, self.axes[1]) / self.pixel_m[1]).floor() as i64;
        !self.is_pixel_solid(col, row)
    }

    /// Returns the middle of a pixel in meters; rows count from the bottom.
    pub fn pixel_center(&self, col: u32, row: u32) -> Point<2> {
        self.pixel_to_world(f64::from(col) + 0.5, f64::from(row) + 0.5)
    }

    /// Returns the box around the floor.
    pub fn bounds(&self) -> Aabb<2> {
        let w = f64::from(self.width);
        let h = f64::from(self.height);
        Aabb::from_points(
            &[(0.0, 0.0), (w, 0.0), (0.0, h), (w, h)].map(|(x, y)| self.pixel_to_world(x, y)),
        )
    }

    /// Returns the place of a point counted in pixels; the same bits for the same point.
    fn pixel_to_world(&self, col: f64, row: f64) -> Point<2> {
        let x = col * self.pixel_m[0];
        let y = row * self.pixel_m[1];
        add(self.corner_m, add(scaled(self.axes[0], x), scaled(self.axes[1], y)))
    }

    /// Returns the walls between free and solid pixels, numbered on from `first_id`: first those
    /// along rows, from the bottom, then those along columns, from the left.
    pub fn walls(&self, first_id: u32) -> Vec<Obstacle<2>> {
        let width = i64::from(self.width);
        let height = i64::from(self.height);
        let mut ends = Vec::new();
        for row in 0..=height {
            let edges = (0..width)
                .map(|col| self.is_pixel_solid(col, row - 1) != self.is_pixel_solid(col, row));
            for run in runs(edges) {
                ends.push(run.map(|col| self.pixel_to_world(col as f64, row as f64)));
            }
        }
        for col in 0..=width {
            let edges = (0..height)
                .map(|row| self.is_pixel_solid(col - 1, row) != self.is_pixel_solid(col, row));
            for run in runs(edges) {
                ends.push(run.map(|row| self.pixel_to_world(col as f64, row as f64)));
            }
        }
        (first_id..).zip(ends).map(|(id, ends)| Obstacle::capsule(id, ends, 0.0)).collect()
    }
}

/// Returns the unit vectors along rows and columns of a floor that is turned.
fn axes_from_yaw(yaw_rad: f64) -> [Point<2>; 2] {
    let s = sin(yaw_rad);
    let c = cos(yaw_rad);
    [[c, s], [-s, c]]
}

/// Returns the start and the end of every run of true values, the end excluded.
fn runs(flags: impl Iterator<Item = bool>) -> Vec<[usize; 2]> {
    let mut runs = Vec::new();
    let mut start = None;
    // One false value more ends the last run.
    for (k, flag) in flags.chain([false]).enumerate() {
        match start {
            None if flag => start = Some(k),
            Some(from) if !flag => {
                runs.push([from, k]);
                start = None;
            }
            _ => {}
        }
    }
    runs
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use sidestep_import::rosmap;
    use sidestep_kernel::view::Isometry2;
    use sidestep_rods::geometry::{ConvexCore, Cuboid, distance};
    use sidestep_testing::shared_data as shared;

    /// A floor drawn at random, turned and stretched.
    fn floor() -> impl Strategy<Value = FloorMap> {
        let pixels = (1u32..9, 1u32..9).prop_flat_map(|(width, height)| {
            let solid = prop::collection::vec(prop::bool::weighted(0.4), (width * height) as usize);
            (Just(width), Just(height), solid)
        });
        let size = prop::array::uniform2(0.1..2.0f64);
        let middle = prop::array::uniform2(-5.0..5.0f64);
        (pixels, size, middle, -3.0..3.0f64, any::<bool>()).prop_map(
            |((width, height, solid), pixel_m, middle, yaw_rad, is_walled)| {
                let floor =
                    FloorMap::new(width, height, pixel_m, solid).centered_at(middle, yaw_rad);
                if is_walled { floor } else { floor.without_outer_walls() }
            },
        )
    }

    /// All pixels of the floor and around it that are solid, or free, as boxes.
    fn boxes(floor: &FloorMap, solid: bool) -> Vec<ConvexCore<2>> {
        let (width, height) = (i64::from(floor.width), i64::from(floor.height));
        let all = (-1..=height).flat_map(|row| (-1..=width).map(move |col| (col, row)));
        all.filter(|&(col, row)| floor.is_pixel_solid(col, row) == solid)
            .map(|(col, row)| {
                ConvexCore::Cuboid(Cuboid {
                    center: floor.pixel_to_world(col as f64 + 0.5, row as f64 + 0.5),
                    axes: floor.axes,
                    half_m: floor.pixel_m.map(|m| 0.5 * m),
                })
            })
            .collect()
    }

    proptest! {
        #[test]
        fn walls_are_exactly_as_near_as_what_they_stand_for(
            floor in floor(), part in prop::array::uniform2(0.0..1.0f64),
        ) {
            let at = floor.pixel_to_world(
                part[0] * f64::from(floor.width),
                part[1] * f64::from(floor.height),
            );
            let other_sort = boxes(&floor, floor.is_free(at));
            let nearest_m = |cores: Vec<ConvexCore<2>>| {
                let all = cores.iter().map(|core| core.nearest_to_point(at).distance_m);
                all.fold(f64::INFINITY, f64::min)
            };
            let walls: Vec<_> = floor.walls(0).iter().map(|wall| wall.core).collect();
            let (by_walls_m, by_pixels_m) = (nearest_m(walls), nearest_m(other_sort));
            prop_assert!(
                by_walls_m == by_pixels_m || (by_walls_m - by_pixels_m).abs() < 1e-9,
                "{by_walls_m} and {by_pixels_m} at {at:?}"
            );
        }

        #[test]
        fn a_way_crosses_a_wall_as_often_as_what_it_is_in_changes(
            floor in floor(), parts in prop::array::uniform4(-0.1..1.1f64),
        ) {
            let point = |k: usize| floor.pixel_to_world(
                parts[k] * f64::from(floor.width),
                parts[k + 1] * f64::from(floor.height),
            );
            let way = [point(0), point(2)];
            let crosses = |wall: &Obstacle<2>| match wall.core {
                ConvexCore::Segment(ends) => sidestep_rods::geometry::segments_cross(way, ends),
                _ => false,
            };
            let crossed = floor.walls(0).iter().filter(|wall| crosses(wall)).count();
            let changes = floor.is_free(way[0]) != floor.is_free(way[1]);
            // A way through a shared corner itself has no chance to come up.
            prop_assert_eq!(crossed % 2 == 1, changes);
        }
    }

    #[test]
    fn straight_edges_are_one_wall() {
        let room = ["#####", "#...#", "#.#.#", "#...#", "#####"];
        let solid = room.iter().rev().flat_map(|row| row.chars().map(|c| c == '#')).collect();
        let floor = FloorMap::new(5, 5, [0.5, 0.25], solid);
        let walls = floor.walls(10);
        assert_eq!(walls.len(), 8, "four of the room, four of the pillar");
        assert_eq!(walls[0], Obstacle::capsule(10, [[0.5, 0.25], [2.0, 0.25]], 0.0));
        assert!(floor.is_free([0.6, 0.3]) && !floor.is_free([1.25, 0.6]));
        assert!(
            !floor.is_free([-0.1, 0.3]) && floor.clone().without_outer_walls().is_free([-0.1, 0.3])
        );
        assert_eq!(floor.without_outer_walls().walls(10).len(), 12, "and four outside");
    }

    #[test]
    fn unknown_pixels_are_solid_unless_they_are_said_to_be_free() {
        let pixels = vec![Cell::Free, Cell::Wall, Cell::Unknown];
        let plane = Isometry2 { origin_m: [1.0, 2.0], yaw_rad: 0.0 };
        let map = PixelMap::new(3, 1, 0.5, plane, pixels);
        let solid = |policy| FloorMap::from_pixel_map(&map, policy).count_solid();
        let policies = [UnknownPolicy::Wall, UnknownPolicy::Keep, UnknownPolicy::Free];
        assert_eq!(policies.map(solid), [2, 2, 1]);
        assert!(FloorMap::from_pixel_map(&map, UnknownPolicy::Wall).is_free([1.25, 2.25]));
    }

    #[test]
    fn a_turned_map_has_its_walls_where_the_world_has_them() {
        let pixels = [Cell::Free, Cell::Wall, Cell::Free, Cell::Free, Cell::Free, Cell::Free];
        for yaw_rad in [0.0, 0.5, 3.0] {
            let plane = Isometry2 { origin_m: [1.0, 2.0], yaw_rad };
            let map = PixelMap::new(3, 2, 0.5, plane, pixels.to_vec());
            let floor = FloorMap::from_pixel_map(&map, UnknownPolicy::Wall);
            for (k, cell) in pixels.iter().enumerate() {
                let middle = [0.5 * (k % 3) as f64 + 0.25, 0.5 * (k / 3) as f64 + 0.25];
                let at = plane.transform_point(middle);
                assert_eq!(floor.is_free(at), *cell == Cell::Free, "{yaw_rad}: {at:?}");
            }
        }
    }

    #[test]
    fn real_maps_have_walls_as_long_as_the_edges_of_their_pixels() {
        for (name, most_walls) in [("porto/porto", 1500), ("berlin/berlin", 2500)] {
            let Some(path) = shared(&format!("maps/{name}.yaml")) else { return };
            let map = rosmap::load(&path).expect(name);
            let floor = FloorMap::from_pixel_map(&map, UnknownPolicy::Wall);
            let counts = map.counts();
            assert_eq!(floor.count_solid(), counts.wall + counts.unknown);
            let walls = floor.walls(0);
            let length_m = |wall: &Obstacle<2>| match wall.core {
                ConvexCore::Segment([a, b]) => distance(a, b),
                _ => f64::NAN,
            };
            let edges = walls.iter().map(length_m).sum::<f64>() / map.resolution_m();
            assert!((edges - count_edges(&floor) as f64).abs() < 1e-3, "{name}: {edges}");
            println!("{name}: {} solid pixels, {} walls", floor.count_solid(), walls.len());
            assert!(walls.len() < most_walls, "{name}: {}", walls.len());
        }
    }

    fn count_edges(floor: &FloorMap) -> usize {
        let (width, height) = (i64::from(floor.width), i64::from(floor.height));
        let all = (-1..=height).flat_map(|row| (-1..=width).map(move |col| (col, row)));
        let edges = all.map(|(col, row)| {
            let solid = floor.is_pixel_solid(col, row);
            let differs = |col, row| usize::from(floor.is_pixel_solid(col, row) != solid);
            differs(col + 1, row) + differs(col, row + 1)
        });
        edges.sum()
    }
}
