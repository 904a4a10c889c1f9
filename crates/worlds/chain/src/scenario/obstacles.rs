//! Obstacles: grounds, single obstacles, and fields of them.

use super::super::ground::fields::{BouncingBallField, RandomObstacleField};
use super::super::ground::{
    Corridor, CorridorLeg, GroundMap, MovingObstacle, MovingObstacles, ObstaclePath,
};
use super::super::world::{ChainSpec, push_part_obstacles};
use super::tasks::DEFAULT_SPEED_M_S;
use super::{ChainScenarioCompiler, MAX_VALUE, MIN_REACH_M, PointValue, PositiveNumber};
use schemars::JsonSchema;
use serde::Deserialize;
use sidestep_import::{rosmap, stage};
use sidestep_kernel::{InputError, Seed, math};
use sidestep_map::UnknownPolicy;
use sidestep_rods::geometry::{Aabb, ConvexCore, Cuboid, Point};
use sidestep_rods::{Chain, Obstacle, Obstacles, outline_walls};
use sidestep_scenario::{NumberRange, Remark, Spanned};
use std::ops::{Range, RangeInclusive};

/// Default distance of generated obstacles from chains at the start, meters.
const DEFAULT_KEEP_M: f64 = 0.1;

#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct GroundSection {
    corridor: Option<Spanned<CorridorSection>>,
    /// A map of ROS (`.yaml`).
    map: Option<String>,
    unknown: Option<UnknownWord>,
    /// A world of Stage (`.world`).
    stage: Option<String>,
}

/// The meaning of a map's unknown pixels.
#[derive(Debug, Clone, Copy, Default, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
enum UnknownWord {
    #[default]
    Solid,
    Free,
}

#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct CorridorSection {
    /// Its width.
    width_m: f64,
    /// Its legs, one after the other.
    legs: Option<Vec<Spanned<LegSection>>>,
}

/// `{ straight_m = 8 }` or `{ radius_m = 2, turn_deg = 90 }`.
#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct LegSection {
    /// Length of a straight leg.
    straight_m: Option<f64>,
    /// Radius of a bend.
    radius_m: Option<f64>,
    /// Turn of a bend, positive to the left.
    turn_deg: Option<f64>,
}

/// One obstacle: a ball (`at_m`, `radius_m`), a capsule or a thin wall (`ends_m`), a box
/// (`at_m`, `size_m`) or the outline of a polygon (`corners_m`).
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "ObstacleSection")]
pub(super) struct ObstacleSection<const D: usize> {
    /// Center of a ball or a box.
    at_m: Option<PointValue<D>>,
    /// Ends of a capsule or of a thin wall.
    ends_m: Option<[PointValue<D>; 2]>,
    /// Size of a box.
    size_m: Option<PointValue<D>>,
    /// Corners of a polygon, whose walls stand.
    corners_m: Option<Vec<PointValue<D>>>,
    #[serde(default)]
    radius_m: f64,
    turn_deg: Option<f64>,
    /// Velocity of an obstacle that moves straight on.
    velocity_m_s: Option<PointValue<D>>,
    bounces_m: Option<[PointValue<D>; 2]>,
    /// Way points of an obstacle that goes from one to the next.
    patrol_m: Option<Vec<PointValue<D>>>,
    closed: Option<bool>,
    /// Speed along them.
    speed_m_s: Option<PositiveNumber>,
}

impl<const D: usize> ObstacleSection<D> {
    fn moves(&self) -> bool {
        self.velocity_m_s.is_some() || self.patrol_m.is_some()
    }
}

/// Obstacles at random.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "FieldSection")]
pub(super) struct FieldSection<const D: usize> {
    /// Lower corner of the field.
    lo_m: PointValue<D>,
    /// Upper corner of the field.
    hi_m: PointValue<D>,
    fill_fraction: Option<f64>,
    /// Earlier name of fill_fraction.
    part: Option<f64>,
    /// Number of balls that move.
    n: Option<u32>,
    /// Radius, or the least and the greatest.
    radius_m: NumberRange,
    length_m: Option<f64>,
    /// Speed, or the least and the greatest.
    speed_m_s: Option<NumberRange>,
    /// Distance from chains at the start.
    keep_m: Option<f64>,
}

/// All obstacles for a world's chains.
pub(super) struct ScenarioObstacles<const D: usize> {
    pub(super) obstacles: Obstacles<D>,
    pub(super) movers: MovingObstacles<D>,
}

/// The obstacles gathered so far.
struct ObstacleBuilder<const D: usize> {
    still: Vec<Obstacle<D>>,
    movers: Vec<MovingObstacle<D>>,
    next_id: u32,
}

impl<const D: usize> ObstacleBuilder<D> {
    fn add_static(&mut self, obstacles: impl IntoIterator<Item = Obstacle<D>>) {
        for obstacle in obstacles {
            self.next_id = self.next_id.max(obstacle.id + 1);
            self.still.push(obstacle);
        }
    }
}

impl<const D: usize> ChainScenarioCompiler<'_, D> {
    /// Returns whether any obstacle moves.
    pub(super) fn has_movers(&self) -> bool {
        let moves = |section: &Spanned<ObstacleSection<D>>| section.get_ref().moves();
        let are_moving = |section: &Spanned<FieldSection<D>>| section.get_ref().n.is_some();
        self.file.obstacles.0.iter().any(moves) || self.file.fields.0.iter().any(are_moving)
    }

    /// Returns the ground of a world; random obstacles come last, because they keep away from
    /// chains.
    pub(super) fn compile_ground(
        &self,
        site: Option<&GroundMap>,
        chains: &[ChainSpec<D>],
    ) -> Result<ScenarioObstacles<D>, InputError> {
        let mut all = self.given_obstacles(site)?;
        for (k, section) in (0..).zip(&self.file.fields.0) {
            self.add_obstacle_field(section, k, chains, &mut all)?;
        }
        let reach_m = chains.iter().map(longest_part_m).fold(0.0, f64::max).max(MIN_REACH_M);
        let obstacles = Obstacles::new(all.still, reach_m);
        let movers = MovingObstacles::new(all.movers);
        Ok(ScenarioObstacles {
            obstacles: obstacles.map_err(|error| self.ground_error(&error))?,
            movers: movers.map_err(|error| self.ground_error(&error))?,
        })
    }

    /// Returns an error that is about an obstacle by its id, and of no section.
    fn ground_error(&self, error: &InputError) -> InputError {
        let place = format!("{}, {}", self.source.place, error.place());
        InputError::new(place, error.cause(), error.remedy())
    }

    /// Returns all obstacles except those at random places, which keep away from chains.
    fn given_obstacles(&self, site: Option<&GroundMap>) -> Result<ObstacleBuilder<D>, InputError> {
        let mut all = ObstacleBuilder { still: Vec::new(), movers: Vec::new(), next_id: 0 };
        self.add_corridor(&mut all)?;
        if let Some(site) = site {
            all.add_static(site.obstacles(0).iter().map(convert_wall_dimensions));
        }
        for section in &self.file.obstacles.0 {
            self.add_obstacle(section, &mut all)?;
        }
        Ok(all)
    }

    /// Returns the obstacles among which a chain is placed: all except those at random places, as they are at the
    /// start, and the parts of the chains that are placed already.
    pub(super) fn placement_obstacles(
        &self,
        site: Option<&GroundMap>,
        placed: &[ChainSpec<D>],
    ) -> Result<Vec<Obstacle<D>>, InputError> {
        let ObstacleBuilder { still: mut all, movers, .. } = self.given_obstacles(site)?;
        all.extend(movers.iter().map(|mover| mover.at(0.0)));
        for (slot, spec) in (0..).zip(placed) {
            push_part_obstacles(&mut all, slot, spec, spec.start_parts());
        }
        Ok(all)
    }

    /// Returns the floors of a map or of a Stage world, if the scenario names one, with remarks on its file.
    pub(super) fn compile_ground_map(
        &self,
    ) -> Result<Option<(GroundMap, Vec<Remark>)>, InputError> {
        let Some(section) = &self.file.ground else { return Ok(None) };
        let s = section.get_ref();
        let at = section.span();
        let kinds = [s.corridor.is_some(), s.map.is_some(), s.stage.is_some()];
        let given = kinds.iter().filter(|is_given| **is_given).count();
        if given != 1 {
            let remedy = "give one of corridor, map and stage";
            return Err(self.source.error(at, format!("{given} grounds"), remedy));
        }
        if D != 2 {
            let remedy = "set chain.dimensions = 2, or leave [ground] out";
            return Err(self.source.error(at, "a ground lies in the plane", remedy));
        }
        let unknown = [("unknown", s.unknown.is_some(), s.map.is_some())];
        self.source.refuse_unused_keys(at.clone(), &unknown, "without ground.map")?;
        let unknown = match s.unknown.unwrap_or_default() {
            UnknownWord::Solid => UnknownPolicy::Wall,
            UnknownWord::Free => UnknownPolicy::Free,
        };
        Ok(match (&s.map, &s.stage) {
            (Some(map), _) => {
                let map = rosmap::load(&self.source.path(map.as_ref()));
                let map = self.source.with_file_key(at, "map", map)?;
                let remarks = map.report().remarks("ground.map");
                Some((GroundMap::from_pixel_map(&map, unknown), remarks))
            }
            (_, Some(world)) => {
                let world = stage::load(&self.source.path(world.as_ref()));
                let world = self.source.with_file_key(at, "stage", world)?;
                let remarks = world.report.remarks("ground.stage");
                Some((GroundMap::from_stage_world(&world), remarks))
            }
            _ => None,
        })
    }

    fn add_corridor(&self, all: &mut ObstacleBuilder<D>) -> Result<(), InputError> {
        let Some(corridor) = self.corridor()? else { return Ok(()) };
        let walls = corridor.walls(all.next_id);
        all.add_static(walls.iter().map(convert_wall_dimensions));
        Ok(())
    }

    /// Returns the middle of the corridor, and its width in meters, if the scenario has one.
    pub(super) fn corridor_center_line(
        &self,
        step_m: f64,
    ) -> Result<Option<(Vec<Point<2>>, f64)>, InputError> {
        let Some(corridor) = self.corridor()? else { return Ok(None) };
        let middle = corridor.center_line(step_m).iter().map(|pose| pose.at).collect();
        Ok(Some((middle, corridor.width_m())))
    }

    /// Returns the corridor, if the scenario has one.
    fn corridor(&self) -> Result<Option<Corridor>, InputError> {
        let ground = self.file.ground.as_ref();
        let section = ground.and_then(|ground| ground.get_ref().corridor.as_ref());
        let Some(given) = section else { return Ok(None) };
        let s = given.get_ref();
        let corridor = match &s.legs {
            None => Corridor::reference_corridor(s.width_m),
            Some(legs) => {
                let legs: Result<Vec<CorridorLeg>, _> =
                    legs.iter().map(|leg| self.leg(leg)).collect();
                Corridor::new(legs?, s.width_m)
            }
        };
        corridor.map(Some).map_err(|error| self.source.error_from(given.span(), &error))
    }

    fn leg(&self, given: &Spanned<LegSection>) -> Result<CorridorLeg, InputError> {
        let LegSection { straight_m, radius_m, turn_deg } = *given.get_ref();
        match (straight_m, radius_m, turn_deg) {
            (Some(length_m), None, None) => Ok(CorridorLeg::Straight { length_m }),
            (None, Some(radius_m), Some(turn_deg)) => Ok(CorridorLeg::Bend { radius_m, turn_deg }),
            _ => {
                let remedy = "give straight_m, or radius_m and turn_deg";
                let cause = "a leg that is neither straight nor a bend";
                Err(self.source.error(given.span(), cause, remedy))
            }
        }
    }

    fn add_obstacle(
        &self,
        section: &Spanned<ObstacleSection<D>>,
        all: &mut ObstacleBuilder<D>,
    ) -> Result<(), InputError> {
        let s = section.get_ref();
        let at = section.span();
        let id = all.next_id;
        self.check_shape_keys(s, at.clone())?;
        if let Some(corners) = &s.corners_m {
            return self.add_polygon_walls(s, corners, at, all);
        }
        let body = Obstacle::new_static(id, self.compile_obstacle_core(s, at.clone())?, s.radius_m);
        body.check().map_err(|error| {
            let at = self.source.key_span(at.clone(), &["radius_m", "size_m"]);
            self.source.error_from(at, &error)
        })?;
        all.next_id += 1;
        match self.compile_obstacle_path(s, at.clone())? {
            None => all.still.push(body),
            Some(course) => {
                let mover = MovingObstacle::new(body, course);
                let mover = mover.map_err(|error| self.source.error_from(at, &error))?;
                all.movers.push(mover);
            }
        }
        Ok(())
    }

    /// Refuses keys that have no effect for a shape or a way to move.
    fn check_shape_keys(&self, s: &ObstacleSection<D>, at: Range<usize>) -> Result<(), InputError> {
        let is_box = s.size_m.is_some() && s.corners_m.is_none();
        let keys = [
            ("size_m", s.size_m.is_some(), is_box),
            ("turn_deg", s.turn_deg.is_some(), is_box),
            ("bounces_m", s.bounces_m.is_some(), s.velocity_m_s.is_some()),
            ("closed", s.closed.is_some(), s.patrol_m.is_some()),
            ("speed_m_s", s.speed_m_s.is_some(), s.patrol_m.is_some()),
        ];
        self.source.refuse_unused_keys(at, &keys, "for this obstacle")
    }

    fn add_polygon_walls(
        &self,
        s: &ObstacleSection<D>,
        corners: &[PointValue<D>],
        at: Range<usize>,
        all: &mut ObstacleBuilder<D>,
    ) -> Result<(), InputError> {
        let moves = s.moves();
        if D != 2 || corners.len() < 3 || moves || s.at_m.is_some() || s.ends_m.is_some() {
            let remedy = "give three corners or more, in two dimensions, and nothing that moves";
            let at = self.source.key_span(at, &["corners_m"]);
            return Err(self.source.error(at, "this is no polygon", remedy));
        }
        let corners: Vec<Point<2>> =
            corners.iter().map(|corner| to_dimensions(corner.get())).collect();
        let walls = outline_walls(all.next_id, &corners, s.radius_m);
        all.add_static(walls.iter().map(convert_wall_dimensions));
        Ok(())
    }

    fn compile_obstacle_core(
        &self,
        s: &ObstacleSection<D>,
        at: Range<usize>,
    ) -> Result<ConvexCore<D>, InputError> {
        match (s.at_m, s.ends_m, s.size_m) {
            (Some(center), None, None) => Ok(ConvexCore::Point(center.get())),
            (None, Some(ends), None) => Ok(ConvexCore::Segment(ends.map(PointValue::get))),
            (Some(_), None, Some(size)) if size.get().contains(&0.0) => {
                let at = self.source.key_span(at, &["size_m"]);
                let remedy = "give every side a length, or leave size_m out for a ball";
                Err(self.source.error(at, "a box of no size", remedy))
            }
            (Some(center), None, Some(size)) => {
                let half_m = size.get().map(|x| 0.5 * x.abs());
                let axes = turned_axes(s.turn_deg.unwrap_or(0.0));
                Ok(ConvexCore::Cuboid(Cuboid { center: center.get(), axes, half_m }))
            }
            _ => {
                let remedy = "give at_m and radius_m (a ball), ends_m (a capsule or a wall), \
                              at_m and size_m (a box), or corners_m (a polygon)";
                Err(self.source.error(at, "an obstacle without a shape, or with two", remedy))
            }
        }
    }

    /// Returns the course of an obstacle; `None` if it stands still.
    fn compile_obstacle_path(
        &self,
        s: &ObstacleSection<D>,
        at: Range<usize>,
    ) -> Result<Option<ObstaclePath<D>>, InputError> {
        let course = match (s.velocity_m_s.map(PointValue::get), s.bounces_m, &s.patrol_m) {
            (None, None, None) => return Ok(None),
            (Some(velocity_m_s), None, None) => ObstaclePath::Straight { velocity_m_s },
            (Some(velocity_m_s), Some(corners), None) => {
                let [lo, hi] = corners.map(PointValue::get);
                ObstaclePath::Bouncing { velocity_m_s, room: Aabb { lo, hi } }
            }
            (None, None, Some(way_points)) => ObstaclePath::Patrol {
                way_points: way_points.iter().map(|place| place.get()).collect(),
                closed: s.closed.unwrap_or(false),
                speed_m_s: s.speed_m_s.map_or(DEFAULT_SPEED_M_S, f64::from),
            },
            _ => {
                let remedy = "give velocity_m_s, or it and bounces_m, or patrol_m and speed_m_s";
                let at = self.source.key_span(at, &["patrol_m", "bounces_m"]);
                return Err(self.source.error(at, "an obstacle with two motions", remedy));
            }
        };
        Ok(Some(course))
    }

    fn add_obstacle_field(
        &self,
        section: &Spanned<FieldSection<D>>,
        number: u64,
        chains: &[ChainSpec<D>],
        all: &mut ObstacleBuilder<D>,
    ) -> Result<(), InputError> {
        let s = section.get_ref();
        let room = Aabb { lo: s.lo_m.get(), hi: s.hi_m.get() };
        let keep_clear = chains.iter().flat_map(|spec| parts(&spec.start)).collect();
        let connectors = chains.iter().flat_map(|spec| spec.start.connectors());
        let widest_m = connectors.map(|c| c.radius_m).fold(0.0, f64::max);
        let keep_m = widest_m + s.keep_m.unwrap_or(DEFAULT_KEEP_M);
        // With one seed for all, fields in the same room would have their obstacles at the same
        // places; with numbers one apart, at those of a run with the next seed.
        let seed = Seed(self.head.seed.wrapping_add(number << 32));
        let NumberRange { low: least, high: greatest } = s.radius_m;
        if s.fill_fraction.is_some() && s.part.is_some() {
            let cause = "`part` is an earlier name of `fill_fraction`, which is also given";
            return Err(self.source.error(section.span(), cause, "leave out `part`"));
        }
        match (s.fill_fraction.or(s.part), s.n, s.speed_m_s) {
            (Some(part), None, None) if least == greatest => {
                let length_m = s.length_m.unwrap_or(0.0);
                let field = RandomObstacleField {
                    room,
                    part,
                    radius_m: least,
                    length_m,
                    keep_clear,
                    keep_m,
                };
                let obstacles = field.generate_obstacles(seed, all.next_id);
                all.add_static(
                    obstacles.map_err(|error| self.source.error_from(section.span(), &error))?,
                );
            }
            (None, Some(n), Some(speed_m_s)) if s.length_m.is_none() => {
                let [radius_m, speed_m_s] =
                    self.crowd_radii_and_speeds([s.radius_m, speed_m_s], section.span())?;
                let crowd = BouncingBallField { room, n, radius_m, speed_m_s, keep_clear, keep_m };
                let movers = crowd.generate(seed, all.next_id);
                all.movers.extend(
                    movers.map_err(|error| self.source.error_from(section.span(), &error))?,
                );
                all.next_id += n;
            }
            _ => {
                let remedy = "give fill_fraction, one radius_m and maybe length_m for obstacles that stand \
                              still, or n and speed_m_s for balls that move";
                let cause = "a field that is neither still nor moving";
                return Err(self.source.error(section.span(), cause, remedy));
            }
        }
        Ok(())
    }

    /// Returns the radii and speeds of a crowd.
    fn crowd_radii_and_speeds(
        &self,
        limits: [NumberRange; 2],
        at: Range<usize>,
    ) -> Result<[RangeInclusive<f64>; 2], InputError> {
        let mut ends = limits.iter().flat_map(|limits| [limits.low, limits.high]);
        match ends.find(|x| !(0.0..=MAX_VALUE).contains(x)) {
            None => Ok(limits.map(|limits| limits.low..=limits.high)),
            Some(x) => {
                let cause = format!("a radius_m or a speed_m_s of {x}");
                let at = self.source.key_span(at, &["radius_m", "speed_m_s"]);
                Err(self.source.error(at, cause, "give numbers from 0 to 1e6"))
            }
        }
    }
}

/// Returns the length of the longest rod of a chain, with the connectors at both its ends, meters.
fn longest_part_m<const D: usize>(spec: &ChainSpec<D>) -> f64 {
    let rod_m = spec.start.rods().iter().map(|rod| rod.max_m).fold(0.0, f64::max);
    let radius_m = spec.start.connectors().iter().map(|c| c.radius_m).fold(0.0, f64::max);
    rod_m + 2.0 * radius_m
}

/// Returns the rods of a chain; of a chain without rods its connector.
fn parts<const D: usize>(chain: &Chain<D>) -> impl Iterator<Item = ConvexCore<D>> + '_ {
    let points = chain.points();
    let one = (points.len() == 1).then(|| ConvexCore::Point(points[0]));
    points.windows(2).map(|ends| ConvexCore::Segment([ends[0], ends[1]])).chain(one)
}

/// Sets coordinates that are missing to 0, and drops those beyond.
pub(super) fn to_dimensions<const FROM: usize, const TO: usize>(p: Point<FROM>) -> Point<TO> {
    std::array::from_fn(|i| p.get(i).copied().unwrap_or(0.0))
}

/// Returns a plane wall in the required number of dimensions.
fn convert_wall_dimensions<const D: usize>(wall: &Obstacle<2>) -> Obstacle<D> {
    let core = match wall.core {
        ConvexCore::Point(c) => ConvexCore::Point(to_dimensions(c)),
        ConvexCore::Segment(ends) => ConvexCore::Segment(ends.map(to_dimensions)),
        ConvexCore::Cuboid(Cuboid { center, axes, half_m }) => {
            let axes =
                std::array::from_fn(|i| axes.get(i).map_or([0.0; D], |axis| to_dimensions(*axis)));
            ConvexCore::Cuboid(Cuboid {
                center: to_dimensions(center),
                axes,
                half_m: to_dimensions(half_m),
            })
        }
    };
    Obstacle::new_static(wall.id, core, wall.radius_m)
}

/// Returns the axes of a box that is turned in the plane of the first two: in space, about the third axis.
fn turned_axes<const D: usize>(turn_deg: f64) -> [Point<D>; D] {
    let s = math::sin(turn_deg.to_radians());
    let c = math::cos(turn_deg.to_radians());
    std::array::from_fn(|i| {
        let mut axis = [0.0; D];
        match i {
            0 => (axis[0], axis[1]) = (c, s),
            1 => (axis[0], axis[1]) = (-s, c),
            _ => axis[i] = 1.0,
        }
        axis
    })
}
