//! Ground read from files: floors of pixels and boxes.

use super::GroundPose;
use super::floor::FloorMap;
use sidestep_import::{PixelMap, stage};
use sidestep_kernel::math::{cos, sin};
use sidestep_map::UnknownPolicy;
use sidestep_rods::geometry::{Aabb, ConvexCore, Cuboid, Point};
use sidestep_rods::{Obstacle, outline_walls};

/// Floors, and solid things that stand on them.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct GroundMap {
    floors: Vec<FloorMap>,
    /// Boxes, and walls around floors; their ids are given later.
    solids: Vec<Obstacle<2>>,
}

impl GroundMap {
    /// Returns the site of a map, solid all around.
    pub fn from_pixel_map(map: &PixelMap, unknown: UnknownPolicy) -> Self {
        Self { floors: vec![FloorMap::from_pixel_map(map, unknown)], solids: Vec::new() }
    }

    /// Returns the site of a Stage world, without its robots (see [`stage::Robot`] for their
    /// starts). A floor plan with a boundary has thin walls around it; without one, nothing beside
    /// it is solid.
    pub fn from_stage_world(world: &stage::World) -> Self {
        let mut site = Self::default();
        for plan in &world.floor_plans {
            let pixel_m =
                [plan.size_m[0] / f64::from(plan.width), plan.size_m[1] / f64::from(plan.height)];
            let floor = FloorMap::new(plan.width, plan.height, pixel_m, plan.solid.clone());
            // Stage places models by their middles.
            let pose = GroundPose::from(plan.pose);
            site.floors.push(floor.centered_at(pose.at, pose.heading_rad).without_outer_walls());
            if plan.has_boundary {
                let edges = cuboid(pose, plan.size_m).edges_2d();
                site.solids.extend(outline_walls(0, &edges.map(|edge| edge[0]), 0.0));
            }
        }
        for body in &world.boxes {
            let solid = ConvexCore::Cuboid(cuboid(body.pose.into(), body.size_m));
            site.solids.push(Obstacle::new_static(0, solid, 0.0));
        }
        site
    }

    /// Returns the floors of pixels; a map has one, a Stage world one for each floor plan.
    pub fn floors(&self) -> &[FloorMap] {
        &self.floors
    }

    /// Returns walls along pixels, then all other solids, numbered on from `first_id`.
    pub fn obstacles(&self, first_id: u32) -> Vec<Obstacle<2>> {
        let walls = self.floors.iter().flat_map(|floor| floor.walls(0));
        let all = walls.chain(self.solids.iter().copied());
        (first_id..).zip(all).map(|(id, obstacle)| Obstacle { id, ..obstacle }).collect()
    }

    /// Returns whether a place is on no solid pixel. Boxes are ignored: see
    /// [`Obstacles::clearance_m`](sidestep_rods::Obstacles::clearance_m).
    pub fn is_free(&self, at: Point<2>) -> bool {
        self.floors.iter().all(|floor| floor.is_free(at))
    }

    /// Returns the box around all floors.
    pub fn bounds(&self) -> Aabb<2> {
        self.floors.iter().fold(Aabb::empty(), |all, floor| all.joined(&floor.bounds()))
    }
}

impl From<stage::Pose2> for GroundPose {
    fn from(pose: stage::Pose2) -> Self {
        Self { at: [pose.x_m, pose.y_m], heading_rad: pose.yaw_rad }
    }
}

fn cuboid(pose: GroundPose, size_m: [f64; 2]) -> Cuboid<2> {
    let s = sin(pose.heading_rad);
    let c = cos(pose.heading_rad);
    Cuboid { center: pose.at, axes: [[c, s], [-s, c]], half_m: size_m.map(|m| 0.5 * m) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sidestep_rods::Obstacles;
    use sidestep_testing::shared_data as shared;

    #[test]
    fn a_stage_world_is_its_floors_boundaries_and_boxes() {
        let pose = stage::Pose2 { x_m: 10.0, y_m: 0.0, yaw_rad: std::f64::consts::FRAC_PI_2 };
        let plan = stage::FloorPlan {
            name: String::new(),
            width: 2,
            height: 1,
            solid: vec![true, false],
            size_m: [4.0, 1.0],
            pose,
            has_boundary: true,
        };
        let body = stage::BoxObstacle { name: String::new(), pose, size_m: [0.2, 0.1] };
        let world =
            stage::World { floor_plans: vec![plan], boxes: vec![body], ..Default::default() };
        let site = GroundMap::from_stage_world(&world);
        // Turned to the left: the solid pixel is the southern one.
        assert!(!site.is_free([10.0, -1.0]) && site.is_free([10.0, 1.0]) && site.is_free([0.0; 2]));
        let obstacles = site.obstacles(3);
        assert!((3..).zip(&obstacles).all(|(id, o)| o.id == id));
        assert_eq!(obstacles.len(), 4 + 4 + 1);
        let all = Obstacles::new(obstacles, 1.0).unwrap();
        assert!((all.clearance_m([[10.0, 1.8]; 2], 0.0, 1.0) - 0.2).abs() < 1e-12);
        assert!((all.clearance_m([[10.0, 0.25]; 2], 0.0, 1.0) - 0.15).abs() < 1e-12);
    }

    #[test]
    fn robots_of_real_worlds_stand_free() {
        for name in ["stage/simple", "stage/SFU", "willow/willow-erratic"] {
            let Some(path) = shared(&format!("worlds/{name}.world")) else { return };
            let world = stage::load(&path).expect(name);
            let site = GroundMap::from_stage_world(&world);
            let obstacles = site.obstacles(0);
            println!("{name}: {} obstacles", obstacles.len());
            let all = Obstacles::new(obstacles, 1.0).unwrap();
            for robot in &world.robots {
                let at = GroundPose::from(robot.pose).at;
                assert!(site.is_free(at) && all.clearance_m([at; 2], robot.radius_m, 1.0) > 0.0);
            }
        }
    }
}
