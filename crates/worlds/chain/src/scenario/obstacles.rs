//! What is in the way: grounds, obstacles one by one, and fields of them.

use super::super::chain::Chain;
use super::super::geometry::{Bounds, Core, Cuboid, Point};
use super::super::ground::fields::{Crowd, Field};
use super::super::ground::{Corridor, Course, Leg, Mover, Movers, Site};
use super::super::obstacle::{Obstacle, Obstacles, outline};
use super::super::world::ChainSpec;
use super::{Compiler, MOST};
use serde::Deserialize;
use sidestep_import::{rosmap, stage};
use sidestep_kernel::{InputError, Seed, math};
use sidestep_map::UnknownPolicy;
use std::ops::Range;
use toml::Spanned;

/// How far generated obstacles stay away from chains at the start, unless it is said.
const KEEP_M: f64 = 0.1;

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct GroundSection {
    corridor: Option<Spanned<CorridorSection>>,
    /// A map of ROS (`.yaml`).
    map: Option<Spanned<String>>,
    #[serde(default)]
    unknown: UnknownWord,
    /// A world of Stage (`.world`).
    stage: Option<Spanned<String>>,
}

/// What unknown pixels of a map are.
#[derive(Debug, Clone, Copy, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum UnknownWord {
    #[default]
    Solid,
    Free,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct CorridorSection {
    width_m: f64,
    legs: Option<Vec<LegSection>>,
}

/// `{ straight_m = 8 }` or `{ radius_m = 2, turn_deg = 90 }`.
#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(untagged, deny_unknown_fields)]
enum LegSection {
    Straight { straight_m: f64 },
    Bend { radius_m: f64, turn_deg: f64 },
}

/// One obstacle: a ball (`at_m`, `radius_m`), a capsule or a thin wall (`ends_m`), a box
/// (`at_m`, `size_m`) or the outline of a polygon (`corners_m`).
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ObstacleSection {
    at_m: Option<Vec<f64>>,
    ends_m: Option<[Vec<f64>; 2]>,
    size_m: Option<Vec<f64>>,
    corners_m: Option<Vec<Vec<f64>>>,
    #[serde(default)]
    radius_m: f64,
    turn_deg: Option<f64>,
    velocity_m_s: Option<Vec<f64>>,
    bounces_m: Option<[Vec<f64>; 2]>,
    patrol_m: Option<Vec<Vec<f64>>>,
    closed: Option<bool>,
    speed_m_s: Option<f64>,
}

/// Obstacles at random.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct FieldSection {
    lo_m: Vec<f64>,
    hi_m: Vec<f64>,
    part: Option<f64>,
    n: Option<u32>,
    radius_m: Spanned<Range1>,
    length_m: Option<f64>,
    speed_m_s: Option<Range1>,
    keep_m: Option<f64>,
}

/// A number, or the least and the greatest.
#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(untagged)]
enum Range1 {
    One(f64),
    Two([f64; 2]),
}

impl Range1 {
    fn range(self) -> std::ops::RangeInclusive<f64> {
        match self {
            Self::One(x) => x..=x,
            Self::Two([lo, hi]) => lo..=hi,
        }
    }
}

/// What is in the way of a world's chains.
pub(super) struct Ground<const D: usize> {
    pub(super) obstacles: Obstacles<D>,
    pub(super) movers: Movers<D>,
}

/// What is gathered of it.
struct Gathered<const D: usize> {
    still: Vec<Obstacle<D>>,
    movers: Vec<Mover<D>>,
    next_id: u32,
}

impl<const D: usize> Gathered<D> {
    fn add_still(&mut self, obstacles: impl IntoIterator<Item = Obstacle<D>>) {
        for obstacle in obstacles {
            self.next_id = self.next_id.max(obstacle.id + 1);
            self.still.push(obstacle);
        }
    }
}

impl Compiler<'_> {
    /// All obstacles.
    pub(super) fn ground<const D: usize>(
        &self,
        site: Option<&Site>,
        chains: &[ChainSpec<D>],
    ) -> Result<Ground<D>, InputError> {
        let mut all = Gathered { still: Vec::new(), movers: Vec::new(), next_id: 0 };
        self.add_corridor(&mut all)?;
        if let Some(site) = site {
            all.add_still(site.obstacles(0).iter().map(lifted));
        }
        for section in &self.file.obstacles.0 {
            self.add_obstacle(section, &mut all)?;
        }
        for (k, section) in (0..).zip(&self.file.fields.0) {
            self.add_field(section, k, chains, &mut all)?;
        }
        let longest = |spec: &ChainSpec<D>| {
            let rods = spec.start.rods().iter().map(|rod| rod.max_m).fold(0.0, f64::max);
            let radii = spec.start.connectors().iter().map(|c| c.radius_m).fold(0.0, f64::max);
            rods + 2.0 * radii
        };
        let reach_m = chains.iter().map(longest).fold(0.0, f64::max).max(1e-3);
        let told = |error: InputError| {
            let place = format!("{}, {}", self.source.place, error.place());
            InputError::new(place, error.cause(), error.remedy())
        };
        Ok(Ground {
            obstacles: Obstacles::new(all.still, reach_m).map_err(told)?,
            movers: Movers::new(all.movers).map_err(told)?,
        })
    }

    /// The floors of a map or of a Stage world, if the scenario names one.
    pub(super) fn site(&self) -> Result<Option<Site>, InputError> {
        let Some(section) = &self.file.ground else { return Ok(None) };
        let (s, at) = (section.get_ref(), section.span());
        let given = [s.corridor.is_some(), s.map.is_some(), s.stage.is_some()]
            .iter()
            .filter(|g| **g)
            .count();
        if given != 1 {
            let remedy = "give one of corridor, map and stage";
            return Err(self.error(Some(at), format!("{given} grounds"), remedy));
        }
        if self.file.chain.dimensions.as_ref().is_some_and(|n| *n.get_ref() != 2) {
            let remedy = "set chain.dimensions = 2, or leave [ground] out";
            return Err(self.error(Some(at), "a ground lies in the plane", remedy));
        }
        let unknown = match s.unknown {
            UnknownWord::Solid => UnknownPolicy::Wall,
            UnknownWord::Free => UnknownPolicy::Free,
        };
        Ok(match (&s.map, &s.stage) {
            (Some(map), _) => {
                let map = rosmap::load(&self.source.path(map.get_ref().as_ref()))?;
                Some(Site::of_map(&map, unknown))
            }
            (_, Some(world)) => {
                let world = stage::load(&self.source.path(world.get_ref().as_ref()))?;
                Some(Site::of_stage(&world))
            }
            _ => None,
        })
    }

    fn add_corridor<const D: usize>(&self, all: &mut Gathered<D>) -> Result<(), InputError> {
        let section =
            self.file.ground.as_ref().and_then(|ground| ground.get_ref().corridor.as_ref());
        let Some(given) = section else { return Ok(()) };
        let walls = self.corridor(given)?.walls(all.next_id);
        all.add_still(walls.iter().map(lifted));
        Ok(())
    }

    /// The middle of the corridor, if the scenario has one.
    pub(super) fn corridor_line(&self, step_m: f64) -> Result<Option<Vec<Point<2>>>, InputError> {
        let section =
            self.file.ground.as_ref().and_then(|ground| ground.get_ref().corridor.as_ref());
        let line = |given| self.corridor(given).map(|corridor| corridor.line(step_m));
        let line = section.map(line).transpose()?;
        Ok(line.map(|line| line.iter().map(|pose| pose.at).collect()))
    }

    fn corridor(&self, given: &Spanned<CorridorSection>) -> Result<Corridor, InputError> {
        let s = given.get_ref();
        let corridor = match &s.legs {
            None => Corridor::pinned(s.width_m),
            Some(legs) => {
                let leg = |leg: &LegSection| match *leg {
                    LegSection::Straight { straight_m } => Leg::Straight { length_m: straight_m },
                    LegSection::Bend { radius_m, turn_deg } => Leg::Bend { radius_m, turn_deg },
                };
                Corridor::new(legs.iter().map(leg).collect(), s.width_m)
            }
        };
        corridor.map_err(|error| self.at(given.span(), &error))
    }

    fn add_obstacle<const D: usize>(
        &self,
        section: &Spanned<ObstacleSection>,
        all: &mut Gathered<D>,
    ) -> Result<(), InputError> {
        let (s, at) = (section.get_ref(), section.span());
        let id = all.next_id;
        self.shapes_one_thing(s, at.clone())?;
        if let Some(corners) = &s.corners_m {
            return self.add_outline(s, corners, at, all);
        }
        let body = Obstacle::still(id, self.core(s, at.clone())?, s.radius_m);
        body.check().map_err(|error| self.at(at.clone(), &error))?;
        all.next_id += 1;
        match self.course(s, at.clone())? {
            None => all.still.push(body),
            Some(course) => {
                let mover = Mover::new(body, course).map_err(|error| self.at(at, &error))?;
                all.movers.push(mover);
            }
        }
        Ok(())
    }

    /// Refuses keys that do nothing for a shape or a way to move.
    fn shapes_one_thing(&self, s: &ObstacleSection, at: Range<usize>) -> Result<(), InputError> {
        let is_box = s.size_m.is_some() && s.corners_m.is_none();
        let keys = [
            ("size_m", s.size_m.is_some(), is_box),
            ("turn_deg", s.turn_deg.is_some(), is_box),
            ("bounces_m", s.bounces_m.is_some(), s.velocity_m_s.is_some()),
            ("closed", s.closed.is_some(), s.patrol_m.is_some()),
            ("speed_m_s", s.speed_m_s.is_some(), s.patrol_m.is_some()),
        ];
        match keys.iter().find(|(_, is_given, does_something)| *is_given && !does_something) {
            None => Ok(()),
            Some((key, ..)) => {
                let cause = format!("`{key}` does nothing for this obstacle");
                Err(self.error(Some(at), cause, "leave it out, or give what it belongs to"))
            }
        }
    }

    fn add_outline<const D: usize>(
        &self,
        s: &ObstacleSection,
        corners: &[Vec<f64>],
        at: Range<usize>,
        all: &mut Gathered<D>,
    ) -> Result<(), InputError> {
        let moves = s.velocity_m_s.is_some() || s.patrol_m.is_some();
        if D != 2 || corners.len() < 3 || moves || s.at_m.is_some() || s.ends_m.is_some() {
            let remedy = "give three corners or more, in two dimensions, and nothing that moves";
            return Err(self.error(Some(at), "this is no polygon", remedy));
        }
        let corners = corners
            .iter()
            .map(|corner| self.point::<2>(corner, "corners_m", at.clone()))
            .collect::<Result<Vec<_>, _>>()?;
        let walls = outline(all.next_id, &corners, s.radius_m);
        all.add_still(walls.iter().map(lifted));
        Ok(())
    }

    fn core<const D: usize>(
        &self,
        s: &ObstacleSection,
        at: Range<usize>,
    ) -> Result<Core<D>, InputError> {
        let point = |p: &[f64], key: &str| self.point::<D>(p, key, at.clone());
        match (&s.at_m, &s.ends_m, &s.size_m) {
            (Some(center), None, None) => Ok(Core::Point(point(center, "at_m")?)),
            (None, Some([a, b]), None) => {
                Ok(Core::Segment([point(a, "ends_m")?, point(b, "ends_m")?]))
            }
            (Some(center), None, Some(size)) => {
                let size: Point<D> = point(size, "size_m")?;
                let half_m = size.map(|x| 0.5 * x.abs());
                let (center, axes) = (point(center, "at_m")?, turned(s.turn_deg.unwrap_or(0.0)));
                Ok(Core::Cuboid(Cuboid { center, axes, half_m }))
            }
            _ => {
                let remedy = "give at_m and radius_m (a ball), ends_m (a capsule or a wall), \
                              at_m and size_m (a box), or corners_m (a polygon)";
                Err(self.error(Some(at), "an obstacle without a shape, or with two", remedy))
            }
        }
    }

    /// How an obstacle moves; `None` where it stands still.
    fn course<const D: usize>(
        &self,
        s: &ObstacleSection,
        at: Range<usize>,
    ) -> Result<Option<Course<D>>, InputError> {
        let point = |p: &[f64], key: &str| self.point::<D>(p, key, at.clone());
        match (&s.velocity_m_s, &s.bounces_m, &s.patrol_m) {
            (None, None, None) => Ok(None),
            (Some(v), None, None) => {
                Ok(Some(Course::Straight { velocity_m_s: point(v, "velocity_m_s")? }))
            }
            (Some(v), Some([lo, hi]), None) => {
                let room = Bounds { lo: point(lo, "bounces_m")?, hi: point(hi, "bounces_m")? };
                Ok(Some(Course::Bouncing { velocity_m_s: point(v, "velocity_m_s")?, room }))
            }
            (None, None, Some(_)) if s.speed_m_s.is_some_and(|speed_m_s| speed_m_s > MOST) => {
                let cause = format!("speed_m_s = {:?}", s.speed_m_s.unwrap_or_default());
                Err(self.error(Some(at), cause, "give at most 1e6 m/s"))
            }
            (None, None, Some(way_points)) => Ok(Some(Course::Patrol {
                way_points: way_points
                    .iter()
                    .map(|p| point(p, "patrol_m"))
                    .collect::<Result<_, _>>()?,
                closed: s.closed.unwrap_or(false),
                speed_m_s: s.speed_m_s.unwrap_or(0.5),
            })),
            _ => {
                let remedy = "give velocity_m_s, or it and bounces_m, or patrol_m and speed_m_s";
                Err(self.error(Some(at), "an obstacle that moves in two ways", remedy))
            }
        }
    }

    fn add_field<const D: usize>(
        &self,
        section: &Spanned<FieldSection>,
        number: u64,
        chains: &[ChainSpec<D>],
        all: &mut Gathered<D>,
    ) -> Result<(), InputError> {
        let (s, at) = (section.get_ref(), section.span());
        let corner = |p: &[f64], key| self.point::<D>(p, key, at.clone());
        let room = Bounds { lo: corner(&s.lo_m, "lo_m")?, hi: corner(&s.hi_m, "hi_m")? };
        let keep_clear = chains.iter().flat_map(|spec| parts(&spec.start)).collect();
        let widest = chains.iter().flat_map(|spec| spec.start.connectors());
        let widest_m = widest.map(|c| c.radius_m).fold(0.0, f64::max);
        let keep_m = widest_m + s.keep_m.unwrap_or(KEEP_M);
        // Every field has places of its own.
        let seed = Seed(self.file.seed.wrapping_add(number << 32));
        let radius_m = s.radius_m.get_ref().range();
        match (s.part, s.n) {
            (Some(part), None) if s.speed_m_s.is_none() && radius_m.start() == radius_m.end() => {
                let (radius_m, length_m) = (*radius_m.start(), s.length_m.unwrap_or(0.0));
                let field = Field { room, part, radius_m, length_m, keep_clear, keep_m };
                let filled = field.fill(seed, all.next_id);
                all.add_still(filled.map_err(|error| self.at(at, &error))?);
            }
            (None, Some(n)) if s.length_m.is_none() && s.speed_m_s.is_some() => {
                let speed_m_s = s.speed_m_s.map_or(0.0..=0.0, Range1::range);
                let ends = [&radius_m, &speed_m_s].map(|range| [*range.start(), *range.end()]);
                if let Some(x) = ends.iter().flatten().find(|x| !(0.0..=MOST).contains(*x)) {
                    let cause = format!("a radius_m or a speed_m_s of {x}");
                    return Err(self.error(Some(at), cause, "give numbers from 0 to 1e6"));
                }
                let crowd = Crowd { room, n, radius_m, speed_m_s, keep_clear, keep_m };
                let gathered = crowd.gather(seed, all.next_id);
                all.movers.extend(gathered.map_err(|error| self.at(at, &error))?);
                all.next_id += n;
            }
            _ => {
                let remedy = "give part, one radius_m and maybe length_m for obstacles that stand \
                              still, or n and speed_m_s for balls that move";
                return Err(self.error(
                    Some(at),
                    "a field that is neither still nor moving",
                    remedy,
                ));
            }
        }
        Ok(())
    }
}

/// The rods of a chain.
fn parts<const D: usize>(chain: &Chain<D>) -> impl Iterator<Item = Core<D>> + '_ {
    let points = chain.points();
    let one = (points.len() == 1).then(|| Core::Point(points[0]));
    points.windows(2).map(|ends| Core::Segment([ends[0], ends[1]])).chain(one)
}

/// A plane wall in as many dimensions as asked for.
fn lifted<const D: usize>(wall: &Obstacle<2>) -> Obstacle<D> {
    let point = |p: Point<2>| std::array::from_fn(|i| p.get(i).copied().unwrap_or(0.0));
    let core = match wall.core {
        Core::Point(c) => Core::Point(point(c)),
        Core::Segment([a, b]) => Core::Segment([point(a), point(b)]),
        Core::Cuboid(Cuboid { center, axes, half_m }) => {
            let axes = std::array::from_fn(|i| axes.get(i).map_or([0.0; D], |axis| point(*axis)));
            Core::Cuboid(Cuboid { center: point(center), axes, half_m: point(half_m) })
        }
    };
    Obstacle::still(wall.id, core, wall.radius_m)
}

/// Axes of a box turned in the plane of the first two.
fn turned<const D: usize>(turn_deg: f64) -> [Point<D>; D] {
    let (s, c) = (math::sin(turn_deg.to_radians()), math::cos(turn_deg.to_radians()));
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
