//! Space for a chain on a floor: a start for its leader, and a free path behind it.

use super::{GroundMap, GroundPose, purposes};
use sidestep_kernel::math::atan2;
use sidestep_kernel::stream::Streams;
use sidestep_kernel::{InputError, Seed};
use sidestep_map::planning::{Distances, FreeSpace, STEPS};
use sidestep_rods::Obstacles;
use sidestep_rods::geometry::{Aabb, Point, add_scaled, distance, dot, lerp, normalized, sub};

/// Random positions that are tried: many, because the test of one is cheap and little of a map may be free.
const MAX_PLACES: u64 = 20_000;
/// Free positions among them from which a path for the chain is searched; each search visits the whole grid.
const MAX_STARTS: u32 = 64;
/// Largest half side, in boxes, of the grid in which the path behind the leader is searched: some million boxes.
const MAX_HALF_BOXES: f64 = 500.0;

/// The space that a chain needs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct SpaceRequirement {
    /// Leader and followers.
    pub(crate) connectors: usize,
    /// Distance from each connector to the next, meters.
    pub(crate) spacing_m: f64,
    /// Free distance around every connector's middle, and along the path, meters.
    pub(crate) clearance_m: f64,
    /// Free distance around the straight line from each connector to the next, meters.
    pub(crate) rod_clearance_m: f64,
    /// Distance ahead of the leader that has to be free as well, meters.
    pub(crate) ahead_m: f64,
    /// Region where the leader starts; by default anywhere on the site. Many sites have blocks
    /// whose insides are free and lead nowhere.
    pub(crate) within: Option<Aabb<2>>,
}

#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ChainPlacement {
    /// The leader, which faces away from its chain.
    pub(crate) leader: GroundPose,
    /// All connectors, the leader first.
    pub(crate) points: Vec<Point<2>>,
}

/// Counts that explain why no start was found.
#[derive(Debug, Default)]
struct PlacementFailure {
    free_places: u32,
    longest_m: f64,
    laid: u32,
}

/// Returns a start for a chain on a site, from the seed and the chain's `number` alone; `obstacles` are all obstacles
/// there.
///
/// Random positions are tried. From a free one, a breadth-first search finds the positions that are the
/// most steps away within the chain's reach; the chain lies on the path to one of them, straightened.
///
/// # Errors
/// When sizes are not positive, or there is no room, with the cause.
pub(crate) fn find_placement(
    site: &GroundMap,
    obstacles: &Obstacles<2>,
    required: &SpaceRequirement,
    seed: Seed,
    number: u32,
) -> Result<ChainPlacement, InputError> {
    required.check()?;
    let search = RouteSearch { site, obstacles, required };
    let streams = Streams::new(seed);
    let mut failure = PlacementFailure::default();
    let bounds = required.within.unwrap_or_else(|| site.bounds());
    for place in 0..MAX_PLACES {
        // A stream for each position, so that the draws of one do not depend on the outcome of another.
        let mut draws = streams.draws(number, place, purposes::ROUTE);
        let leader =
            std::array::from_fn(|i| bounds.lo[i] + (bounds.hi[i] - bounds.lo[i]) * draws.uniform());
        if !search.is_free(leader) {
            continue;
        }
        failure.free_places += 1;
        let path = search.route_away_from(leader, draws.next_u32());
        failure.longest_m = failure.longest_m.max(length_m(&path));
        if let Some(points) = search.lay_chain(&path) {
            failure.laid += 1;
            if let Some(start) = search.placement(points) {
                return Ok(start);
            }
        }
        if failure.free_places >= MAX_STARTS {
            break;
        }
    }
    Err(failure.error(required))
}

impl SpaceRequirement {
    fn length_m(&self) -> f64 {
        self.spacing_m * (self.connectors.max(1) - 1) as f64
    }

    fn check(&self) -> Result<(), InputError> {
        let lengths = [self.clearance_m, self.rod_clearance_m, self.ahead_m];
        let has_place =
            self.within.is_none_or(|b| (0..2).all(|i| b.lo[i] <= b.hi[i] && b.hi[i].is_finite()));
        let is_good = has_place
            && self.connectors > 0
            && self.spacing_m > 0.0
            && self.clearance_m > 0.0
            && self.length_m() <= 1e5
            && lengths.iter().all(|m| (0.0..=1e3).contains(m));
        if is_good {
            return Ok(());
        }
        let cause = format!("a start for {self:?}");
        Err(InputError::new("start", cause, "give positive lengths in m, and a connector"))
    }
}

impl PlacementFailure {
    fn error(&self, required: &SpaceRequirement) -> InputError {
        let (cause, remedy) = if self.free_places == 0 {
            let cause = format!(
                "no place with {} m free around it among {MAX_PLACES} random ones",
                required.clearance_m
            );
            (cause, "make the robots smaller or the clearance less")
        } else if self.laid == 0 {
            let cause = format!(
                "no free path for a chain of {:.1} m from {} places; the longest is {:.1} m",
                required.length_m(),
                self.free_places,
                self.longest_m
            );
            (cause, "take fewer followers, a shorter spacing or less clearance")
        } else {
            let cause = format!("nowhere {} m free ahead of the leader", required.ahead_m);
            (cause, "ask for less room ahead")
        };
        InputError::new("start", cause, remedy)
    }
}

struct RouteSearch<'a> {
    site: &'a GroundMap,
    obstacles: &'a Obstacles<2>,
    required: &'a SpaceRequirement,
}

impl RouteSearch<'_> {
    fn is_clear(&self, ends: [Point<2>; 2], radius_m: f64) -> bool {
        self.obstacles.clearance_m(ends, 0.0, radius_m) >= radius_m
    }

    fn is_free(&self, at: Point<2>) -> bool {
        self.site.is_free(at) && self.is_clear([at; 2], self.required.clearance_m)
    }

    /// Returns a long path away from a position, straightened.
    fn route_away_from(&self, leader: Point<2>, choice: u32) -> Vec<Point<2>> {
        let SpaceRequirement { spacing_m, clearance_m, .. } = *self.required;
        // On a grid of 4 neighbors a path is up to sqrt(2) times as long as in a straight line.
        let reach_m = 1.5 * self.required.length_m() + spacing_m;
        // Boxes of half the clearance, so that no wall fits between two neighbors that are both free.
        let box_m = (0.5 * clearance_m.min(spacing_m)).max(reach_m / MAX_HALF_BOXES);
        let grid = SearchGrid { leader, half: (reach_m / box_m).ceil() as u32, box_m };
        let side = 2 * grid.half + 1;
        let free = FreeSpace::new(side, side, |col, row| self.is_free(grid.place((col, row))));
        let steps = Distances::to_nearest(&free, 1, &[(grid.half, grid.half)]);
        let path = path_back(&steps, choose_far_box(&steps, grid.half, choice));
        self.straighten_path(path.into_iter().rev().map(|at| grid.place(at)).collect())
    }

    /// Returns a path with fewer corners: from each, straight ahead as far as there is clearance.
    fn straighten_path(&self, path: Vec<Point<2>>) -> Vec<Point<2>> {
        let mut straightened = vec![path[0]];
        let mut from = 0;
        while from + 1 < path.len() {
            // The next point is clear of itself: it is a free neighbor.
            let mut to = from + 1;
            while to + 1 < path.len()
                && self.is_clear([path[from], path[to + 1]], self.required.clearance_m)
            {
                to += 1;
            }
            straightened.push(path[to]);
            from = to;
        }
        straightened
    }

    /// Returns connectors along a path, each at the spacing from the one before; `None` if it is too
    /// short, or a rod would come too near to an obstacle.
    fn lay_chain(&self, path: &[Point<2>]) -> Option<Vec<Point<2>>> {
        let SpaceRequirement { connectors, spacing_m, rod_clearance_m, .. } = *self.required;
        let mut points = vec![path[0]];
        // The leg on which the last connector lies, and the fraction of that leg behind it: the next one is never placed
        // farther back, where the path enters the circle around the last one again.
        let mut leg = 0;
        let mut part = 0.0;
        while points.len() < connectors {
            let last = points[points.len() - 1];
            loop {
                let a = *path.get(leg)?;
                let b = *path.get(leg + 1)?;
                match exit_fraction(last, spacing_m, [a, b]).filter(|&p| p >= part) {
                    Some(found) => {
                        points.push(lerp(a, b, found));
                        part = found;
                        break;
                    }
                    None => {
                        leg += 1;
                        part = 0.0;
                    }
                }
            }
        }
        // Rods cut the corners of the path.
        let mut rods = points.windows(2);
        let are_rods_clear = rods.all(|rod| self.is_clear([rod[0], rod[1]], rod_clearance_m));
        let is_clear = are_rods_clear && points.iter().all(|&p| self.is_free(p));
        is_clear.then_some(points)
    }

    /// Returns the start of a chain that lies at `points`, if there is room ahead of it.
    fn placement(&self, points: Vec<Point<2>>) -> Option<ChainPlacement> {
        let at = points[0];
        let u = points.get(1).and_then(|&next| normalized(sub(at, next))).unwrap_or([1.0, 0.0]);
        let ahead = [at, add_scaled(at, u, self.required.ahead_m)];
        let leader = GroundPose { at, heading_rad: atan2(u[1], u[0]) };
        self.is_clear(ahead, self.required.clearance_m).then_some(ChainPlacement { leader, points })
    }
}

/// The grid of boxes around a leader in which a path is searched.
struct SearchGrid {
    leader: Point<2>,
    /// Boxes from the leader's to the edge.
    half: u32,
    /// Side of a box, meters.
    box_m: f64,
}

impl SearchGrid {
    fn place(&self, (col, row): (u32, u32)) -> Point<2> {
        let [x, y] = [col, row].map(|k| (f64::from(k) - f64::from(self.half)) * self.box_m);
        [self.leader[0] + x, self.leader[1] + y]
    }
}

/// Returns one of the boxes that are nearly the most steps away: with the farthest alone, all chains of a site would lie
/// in the same dead end.
fn choose_far_box(steps: &Distances, half: u32, choice: u32) -> (u32, u32) {
    let most = steps.max_steps().unwrap_or(0);
    let mut far = Vec::new();
    for row in 0..=2 * half {
        for col in 0..=2 * half {
            if steps.steps(col, row).is_some_and(|n| n + most / 20 >= most) {
                far.push((col, row));
            }
        }
    }
    far.get(choice as usize % far.len().max(1)).copied().unwrap_or((half, half))
}

/// Returns the boxes from one to that at 0 steps, each a step nearer.
fn path_back(steps: &Distances, mut at: (u32, u32)) -> Vec<(u32, u32)> {
    let mut path = vec![at];
    while let Some(n) = steps.steps(at.0, at.1).filter(|&n| n > 0) {
        let beside = STEPS
            .map(|(east, north)| (at.0.wrapping_add_signed(east), at.1.wrapping_add_signed(north)));
        let nearer = beside.into_iter().find(|&(col, row)| steps.steps(col, row) == Some(n - 1));
        let Some(next) = nearer else { break };
        at = next;
        path.push(at);
    }
    path
}

/// Returns the fraction of a segment at which a path along it leaves the circle around a point, if it
/// does.
fn exit_fraction(center: Point<2>, radius_m: f64, [a, b]: [Point<2>; 2]) -> Option<f64> {
    let d = sub(b, a);
    let r = sub(a, center);
    let dd = dot(d, d);
    let dr = dot(d, r);
    let root = dr * dr - dd * (dot(r, r) - radius_m * radius_m);
    let part = (-dr + root.max(0.0).sqrt()) / dd;
    (dd > 0.0 && root >= 0.0 && (0.0..=1.0).contains(&part)).then_some(part)
}

fn length_m(path: &[Point<2>]) -> f64 {
    path.windows(2).map(|leg| distance(leg[0], leg[1])).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use sidestep_import::{PixelMap, rosmap, stage};
    use sidestep_kernel::view::Isometry2;
    use sidestep_map::{Cell, UnknownPolicy};
    use sidestep_rods::{Chain, Connector, Rod};
    use sidestep_testing::shared_data as shared;

    const WANTED: SpaceRequirement = SpaceRequirement {
        connectors: 16,
        spacing_m: 0.7,
        clearance_m: 0.33,
        rod_clearance_m: 0.05,
        ahead_m: 1.0,
        within: None,
    };

    /// A corridor with a bend: `#` is solid, a pixel has a side of 0.5 m.
    fn bent() -> GroundMap {
        let rows = [
            "####################",
            "#..................#",
            "#..................#",
            "#..###########...#.#",
            "#..###########...#.#",
            "####################",
        ];
        let pixels = rows.iter().rev().flat_map(|row| row.chars());
        let cell = |c| if c == '#' { Cell::Wall } else { Cell::Free };
        let plane = Isometry2 { origin_m: [-2.0, 1.0], yaw_rad: 0.0 };
        let map = PixelMap::new(20, 6, 0.5, plane, pixels.map(cell).collect());
        GroundMap::from_pixel_map(&map, UnknownPolicy::Wall)
    }

    fn check(name: &str, site: &GroundMap, required: &SpaceRequirement, seeds: u64) {
        let obstacles = Obstacles::new(site.obstacles(0), 1.0).unwrap();
        for seed in 0..seeds {
            let start = find_placement(site, &obstacles, required, Seed(seed), 0).expect(name);
            assert_eq!(start, find_placement(site, &obstacles, required, Seed(seed), 0).unwrap());
            assert_eq!(
                (start.points.len(), start.points[0]),
                (required.connectors, start.leader.at)
            );
            let within = required.within.unwrap_or_else(|| site.bounds());
            assert!(within.intersects(&Aabb::from_points(&[start.leader.at])));
            for rod in start.points.windows(2) {
                assert!((distance(rod[0], rod[1]) - required.spacing_m).abs() < 1e-9);
                let apart_m = obstacles.clearance_m([rod[0], rod[1]], 0.0, 1.0);
                assert!(apart_m >= required.rod_clearance_m, "{name}: rod at {apart_m}");
            }
            for &p in &start.points {
                assert!(site.is_free(p));
                assert!(obstacles.clearance_m([p; 2], 0.0, 1.0) >= required.clearance_m);
            }
            let rod = Rod::with_fixed_length(required.spacing_m, required.rod_clearance_m);
            let n = required.connectors;
            let connectors = vec![Connector::free(required.clearance_m); n];
            assert!(Chain::new(start.points, connectors, vec![rod; n - 1]).is_ok());
        }
    }

    #[test]
    fn a_chain_has_room_in_a_bent_corridor() {
        check("bent", &bent(), &SpaceRequirement { connectors: 10, ..WANTED }, 10);
        check("alone", &bent(), &SpaceRequirement { connectors: 1, ..WANTED }, 3);
    }

    #[test]
    fn starts_differ_by_seed_and_number() {
        let site = bent();
        let obstacles = Obstacles::new(site.obstacles(0), 1.0).unwrap();
        let required = SpaceRequirement { connectors: 5, ..WANTED };
        let start = |seed| find_placement(&site, &obstacles, &required, Seed(seed), 0).unwrap();
        assert_ne!(start(1), start(2));
        let of_number =
            |number| find_placement(&site, &obstacles, &required, Seed(1), number).unwrap();
        assert_ne!(of_number(0), of_number(1));
    }

    #[test]
    fn what_is_wanting_is_said() {
        let site = bent();
        let obstacles = Obstacles::new(site.obstacles(0), 1.0).unwrap();
        let cause = |required: SpaceRequirement| {
            find_placement(&site, &obstacles, &required, Seed(1), 0).unwrap_err().cause().to_owned()
        };
        assert!(
            cause(SpaceRequirement { clearance_m: 2.0, ..WANTED }).contains("no place with 2 m")
        );
        let too_long = cause(SpaceRequirement { connectors: 40, ..WANTED });
        assert!(too_long.contains("no free path for a chain of 27.3"), "{too_long}");
        let no_room = cause(SpaceRequirement { connectors: 3, ahead_m: 50.0, ..WANTED });
        assert!(no_room.contains("nowhere 50 m free"), "{no_room}");
        for wrong in [
            SpaceRequirement { connectors: 0, ..WANTED },
            SpaceRequirement { spacing_m: 0.0, ..WANTED },
            SpaceRequirement { clearance_m: f64::NAN, ..WANTED },
            SpaceRequirement { spacing_m: f64::INFINITY, ..WANTED },
        ] {
            assert!(find_placement(&site, &obstacles, &wrong, Seed(1), 0).is_err());
        }
    }

    #[test]
    fn real_maps_have_room_for_fifteen_followers() {
        for name in ["porto/porto", "berlin/berlin"] {
            let Some(path) = shared(&format!("maps/{name}.yaml")) else { return };
            let map = rosmap::load(&path).expect(name);
            check(name, &GroundMap::from_pixel_map(&map, UnknownPolicy::Wall), &WANTED, 4);
        }
        let path = shared("worlds/stage/SFU.world").expect("there");
        let world = stage::load(&path).expect("SFU");
        let within = Some(Aabb { lo: [-20.0, -10.0], hi: [5.0, 10.0] });
        check(
            "SFU",
            &GroundMap::from_stage_world(&world),
            &SpaceRequirement { within, ..WANTED },
            3,
        );
    }
}
