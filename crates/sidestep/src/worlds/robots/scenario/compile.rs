//! A scenario's text -> an immutable world and where everybody starts.

use super::placing::{Floor, Obstacle};
use super::random;
use super::tables::{self, Kinds, Located};
use super::{
    BehaviourSection, DoorSection, EffectorSection, MapSection, MoverSection, ProfileFile,
    RecordSection, RobotSection, RobotsFile, SensorSection,
};
use crate::import;
use crate::map::{Cell, GridMap, Rect};
use crate::planning::{FlowField, FreeSpace};
use crate::scenario::{OneOrMany, Source, nearest};
use crate::worlds::robots::decide::{Behaviour, External, Goto, Replay, Sector, Shuttle, Wander};
use crate::worlds::robots::effector::{Action, EffectorModel, Side, Transition, own_boxes};
use crate::worlds::robots::resolve::ConflictPolicy;
use crate::worlds::robots::sensor::SensorModel;
use crate::worlds::robots::state::VISITED;
use crate::worlds::robots::world::{
    BORDER, Body, BodyType, Door, MountedSensor, Mover, Radio, RobotBody, RobotModel, RobotsWorld,
    Role, purpose,
};
use sidestep_kernel::distr::Chance;
use sidestep_kernel::space::ClaimGrid;
use sidestep_kernel::stream::{Purpose, Streams};
use sidestep_kernel::{EntityId, InputError, Seed, Slot};
use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::Arc;
use toml::Spanned;

/// Farthest corner of a map: poses are recorded with 15 bits per coordinate.
const MAX_SIDE: u32 = (1 << 15) - 2 * BORDER;
/// Most bodies of a scenario.
const MAX_BODIES: u64 = 10_000_000;
/// Largest body, in boxes.
const MAX_SIZE: u32 = 64;
const MAX_RANGE_BOXES: f64 = 4096.0;

/// Behaviours of the library's user, by the name a scenario gives them.
pub type Behaviours = BTreeMap<String, Arc<dyn Behaviour>>;

/// The order in which bodies are stored; no result depends on it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum StorageOrder {
    /// Neighbors at the start are neighbors in memory.
    #[default]
    Spatial,
    /// By entity id.
    ById,
    /// Shuffled by this number; for tests.
    Shuffled(u64),
}

/// What a scenario compiles to.
#[derive(Debug, Clone)]
pub struct Compiled {
    /// The immutable world.
    pub world: Arc<RobotsWorld>,
    /// Place and facing of each entity at the start, by id.
    pub start: Arc<[((u32, u32), u8)]>,
    /// Name of the scenario, may be empty.
    pub name: String,
    /// The seed.
    pub seed: u64,
    /// Cycles that the scenario asks for.
    pub cycles: u64,
    /// What to keep.
    pub record: RecordSection,
}

impl Compiled {
    /// Compiles a scenario.
    ///
    /// # Errors
    /// With place, line, column, cause and remedy for anything that is wrong in it.
    pub fn new(source: &Source, own: &Behaviours, order: StorageOrder) -> Result<Self, InputError> {
        Compiler::new(source, own)?.compile(order)
    }
}

struct Compiler<'a> {
    source: Arc<Source>,
    own: &'a Behaviours,
    file: RobotsFile,
    map: Arc<GridMap>,
    office_doors: Vec<Rect>,
    kinds: Vec<String>,
    sensors: BTreeMap<String, Located<SensorSection>>,
    effectors: BTreeMap<String, Located<EffectorSection>>,
    streams: Streams,
    types: Vec<BodyType>,
    bodies: Vec<Body>,
    start: Vec<((u32, u32), u8)>,
    floor: Floor,
    /// Spans by id, to name the other body when two stand on each other.
    spans: Vec<Range<usize>>,
    /// Most boxes that a claim reaches beside a body, and most with the body itself.
    reach: u32,
    longest: u32,
}

impl<'a> Compiler<'a> {
    fn new(source: &Source, own: &'a Behaviours) -> Result<Self, InputError> {
        let source = Arc::new(source.clone());
        let file: RobotsFile = source.parse()?;
        let (map, office_doors) = load_map(&source, &file.map)?;
        let (mut sensors, mut effectors) = (BTreeMap::new(), BTreeMap::new());
        let presets = Source::new("presets", include_str!("../presets.toml"), "");
        add_profile(Arc::new(presets), &mut sensors, &mut effectors)?;
        for profile in &file.profiles {
            let path = source.path(profile.get_ref());
            let profile = Source::read(&path, &[])?;
            add_profile(Arc::new(profile), &mut sensors, &mut effectors)?;
        }
        add_all(&source, &file.sensors, &mut sensors);
        add_all(&source, &file.effectors, &mut effectors);
        let kinds = kinds(&source, &file)?;
        let streams = Streams::new(Seed(file.seed));
        let floor = Floor::new(&map);
        Ok(Self {
            source,
            own,
            kinds,
            sensors,
            effectors,
            streams,
            types: Vec::new(),
            bodies: Vec::new(),
            start: Vec::new(),
            floor,
            spans: Vec::new(),
            reach: 0,
            longest: 1,
            map,
            office_doors,
            file,
        })
    }

    fn compile(mut self, order: StorageOrder) -> Result<Compiled, InputError> {
        let groups = self.groups()?;
        // Doors and bodies with a given place first, so that draws find what is left; ids
        // go robots, people, doors whatever is placed first.
        let mut first_id = 0;
        let firsts: Vec<EntityId> = groups
            .iter()
            .map(|g| {
                let id = first_id;
                first_id += g.count as EntityId;
                id
            })
            .collect();
        let n = first_id as usize;
        self.bodies = vec![Body { id: 0, ty: 0, period: 1, phase: 0 }; n];
        self.start = vec![((0, 0), 0); n];
        self.spans = vec![0..0; n];
        for given in [true, false] {
            for (group, &first) in groups.iter().zip(&firsts) {
                if group.places.is_empty() != given {
                    self.add_group(group, first)?;
                }
            }
        }
        self.finish(order)
    }

    fn finish(self, order: StorageOrder) -> Result<Compiled, InputError> {
        let slots = storage(&self.start, self.map.width(), order);
        let mut slot_of_id = vec![0; slots.len()];
        slots.iter().enumerate().for_each(|(slot, &id)| slot_of_id[id as usize] = slot as Slot);
        let bodies: Vec<Body> = slots.iter().map(|&id| self.bodies[id as usize]).collect();
        let is_robot = |b: &Body| matches!(self.types[usize::from(b.ty)].role, Role::Robot(_));
        let mut robot_slots: Vec<Slot> =
            (0..bodies.len() as Slot).filter(|&s| is_robot(&bodies[s as usize])).collect();
        robot_slots.sort_unstable_by_key(|&s| bodies[s as usize].id);
        let start: Arc<[_]> = self.start.clone().into();
        let stride = self.stride();
        let rows = self.map.height() + 2 * BORDER;
        let radio = self.radio()?;
        let kind_rank = self.kind_rank()?;
        let world = RobotsWorld {
            walls: padded(&self.map, stride, rows),
            regime: self.file.regime,
            obstacle_rule: self.file.obstacle_rule,
            policy: self.file.conflict_policy,
            kinds: self.kinds,
            map: self.map,
            types: self.types,
            bodies,
            kind_rank,
            radio,
            robot_slots,
            slot_of_id,
            streams: self.streams,
            stride,
            rows,
            start: Arc::clone(&start),
            extent: (self.reach, self.longest + self.reach),
        };
        Ok(Compiled {
            world: Arc::new(world),
            start,
            name: self.file.name,
            seed: self.file.seed,
            cycles: self.file.cycles,
            record: self.file.record,
        })
    }

    fn stride(&self) -> u32 {
        self.map.width() + 2 * BORDER
    }

    fn error(
        &self,
        span: Range<usize>,
        cause: impl Into<String>,
        remedy: impl Into<String>,
    ) -> InputError {
        self.source.error((span != (0..0)).then_some(span), cause, remedy)
    }

    fn radio(&self) -> Result<Option<Radio>, InputError> {
        let Some(radio) = &self.file.radio else { return Ok(None) };
        let r = radio.get_ref();
        if !(r.range_m > 0.0 && r.range_m < 1e6 && (0.0..=1.0).contains(&r.loss)) {
            let cause = format!("range {} m with loss {}", r.range_m, r.loss);
            return Err(self.error(
                radio.span(),
                cause,
                "give a range above 0 m and a loss between 0 and 1",
            ));
        }
        Ok(Some(Radio::new(r.range_m, self.map.box_size_m, r.loss)))
    }

    /// Rank of each kind in `kind_order`; kinds that are not named come last.
    fn kind_rank(&self) -> Result<Vec<u8>, InputError> {
        let mut rank = vec![self.file.kind_order.len() as u8; self.kinds.len()];
        for (k, kind) in self.file.kind_order.iter().enumerate() {
            rank[usize::from(self.kind(kind)?)] = k as u8;
        }
        if self.file.conflict_policy == ConflictPolicy::ByKind && self.file.kind_order.is_empty() {
            let remedy = "add kind_order = [\"person\", \"robot\"], first the kind that goes first";
            return Err(self.error(0..0, "conflict_policy \"by_kind\" needs kind_order", remedy));
        }
        Ok(rank)
    }

    fn kind(&self, name: &Spanned<String>) -> Result<u8, InputError> {
        let known = || self.kinds.iter().skip(1).map(String::as_str).collect::<Vec<_>>();
        self.kinds.iter().skip(1).position(|k| k == name.get_ref()).map(|k| k as u8 + 1).ok_or_else(
            || {
                let cause = format!("unknown kind `{}`", name.get_ref());
                self.error(
                    name.span(),
                    cause,
                    format!(
                        "{}; new kinds are made by [kinds.NAME]",
                        nearest(name.get_ref(), &known())
                    ),
                )
            },
        )
    }
}

/// Bodies that a scenario describes together.
struct Group {
    count: u64,
    /// Given places (column, row, facing); drawn inside `region` where empty.
    places: Vec<(Placing, Range<usize>)>,
    region: Option<[u32; 4]>,
    span: Range<usize>,
    ty: TypeOf,
    period: u32,
    phase: Option<u32>,
}

/// Number of bodies, their given places, and their period.
type Common = (u64, Vec<(Placing, Range<usize>)>, u32);

/// Column and row, and the facing if it is not to be drawn.
type Placing = ((u32, u32), Option<u8>);

/// One type for all of a group, or one for each body.
enum TypeOf {
    All(u16),
    Each(Vec<u16>),
}

impl Compiler<'_> {
    fn groups(&mut self) -> Result<Vec<Group>, InputError> {
        let robots = take(&mut self.file.robots);
        let people = take(&mut self.file.people);
        let doors = take(&mut self.file.doors);
        let mut groups = Vec::new();
        for section in &robots.1 {
            groups.push(self.robots(section, robots.0.clone())?);
        }
        for section in &people.1 {
            groups.push(self.people(section, people.0.clone())?);
        }
        for section in &doors.1 {
            groups.push(self.doors(section, doors.0.clone())?);
        }
        let bodies: u64 = groups.iter().map(|g| g.count).sum();
        if bodies > MAX_BODIES {
            let cause = format!("{bodies} bodies");
            let most = groups.iter().max_by_key(|g| g.count).map_or(0..0, |g| g.span.clone());
            return Err(self.error(most, cause, format!("give at most {MAX_BODIES}")));
        }
        if bodies == 0 {
            return Err(self.error(
                0..0,
                "the scenario has no bodies",
                "add [robots] with count = 1",
            ));
        }
        Ok(groups)
    }

    fn add_group(&mut self, group: &Group, first: EntityId) -> Result<(), InputError> {
        let region = group.region.unwrap_or_else(|| self.floor.region());
        for k in 0..group.count as usize {
            let id = first + k as EntityId;
            let ty = match &group.ty {
                TypeOf::All(ty) => *ty,
                TypeOf::Each(types) => types[k],
            };
            let size = self.types[usize::from(ty)].size;
            let (at, facing, span) = match group.places.get(k) {
                Some(((at, facing), span)) => {
                    self.floor
                        .place(id, *at, size)
                        .map_err(|o| self.in_the_way(span, *at, size, o))?;
                    (*at, *facing, span.clone())
                }
                None => {
                    let at = self.floor.draw_place(&self.streams, id, size, region).ok_or_else(
                        || {
                            let cause = format!(
                                "no free place is left for body {id} of {} x {} boxes",
                                size.0, size.1
                            );
                            self.error(
                                group.span.clone(),
                                cause,
                                "give fewer or smaller bodies, or a larger map or region",
                            )
                        },
                    )?;
                    (at, None, group.span.clone())
                }
            };
            let draw = |purpose: Purpose, n: u32| self.streams.draws(id, 0, purpose).below(n);
            let facing = facing.unwrap_or_else(|| {
                self.streams.block(id, 0, purpose::PLACE, u16::MAX)[0] as u8 % 4
            });
            let phase = group.phase.unwrap_or_else(|| draw(purpose::PHASE, group.period));
            self.start[id as usize] = (at, facing);
            self.spans[id as usize] = span;
            self.bodies[id as usize] =
                Body { id, ty, period: group.period, phase: phase % group.period };
        }
        Ok(())
    }

    fn in_the_way(
        &self,
        span: &Range<usize>,
        at: (u32, u32),
        size: (u32, u32),
        obstacle: Obstacle,
    ) -> InputError {
        let body = format!("a body of {} x {} boxes at [{}, {}]", size.0, size.1, at.0, at.1);
        let cause = match obstacle {
            Obstacle::Outside => format!(
                "{body} leaves the map of {} x {} boxes",
                self.map.width(),
                self.map.height()
            ),
            Obstacle::Wall(c, r) => format!("{body} stands in the wall at [{c}, {r}]"),
            Obstacle::Body(id, c, r) => format!("{body} stands on body {id} at [{c}, {r}]"),
        };
        self.error(
            span.clone(),
            cause,
            "place it in free boxes; `sidestep map FILE --box B` shows them",
        )
    }

    fn common(
        &self,
        count: Option<&Spanned<u32>>,
        places: &[Spanned<Vec<u32>>],
        period: Option<&Spanned<u32>>,
        span: &Range<usize>,
    ) -> Result<Common, InputError> {
        let places: Vec<_> = places
            .iter()
            .map(|p| Ok((self.placing(p)?, p.span())))
            .collect::<Result<_, InputError>>()?;
        let count = match count {
            Some(c) if !places.is_empty() && *c.get_ref() as usize != places.len() => {
                let cause = format!("count = {} with {} places", c.get_ref(), places.len());
                return Err(self.error(
                    c.span(),
                    cause,
                    "leave out `count`, or give as many places in `at`",
                ));
            }
            Some(c) => u64::from(*c.get_ref()),
            None if !places.is_empty() => places.len() as u64,
            None => {
                return Err(self.error(
                    span.clone(),
                    "neither `count` nor `at` is given",
                    "add count = 10, or at = [[col, row], ...]",
                ));
            }
        };
        let steps = period.map_or(1, |p| *p.get_ref());
        if steps == 0 {
            let span = period.map_or(span.clone(), Spanned::span);
            return Err(self.error(
                span,
                "a period of 0 cycles",
                "give 1 (acts every cycle) or more",
            ));
        }
        Ok((count, places, steps))
    }

    fn placing(&self, place: &Spanned<Vec<u32>>) -> Result<Placing, InputError> {
        match place.get_ref()[..] {
            [col, row] => Ok(((col, row), None)),
            [col, row, facing] if facing < 4 => Ok(((col, row), Some(facing as u8))),
            _ => Err(self.error(
                place.span(),
                "this is no place",
                "write [col, row] or [col, row, heading] with heading 0 east, 1 north, 2 west, 3 south",
            )),
        }
    }

    fn add_type(&mut self, ty: BodyType, span: &Range<usize>) -> Result<u16, InputError> {
        let index = u16::try_from(self.types.len()).map_err(|_| {
            self.error(
                span.clone(),
                "more than 65,536 body types",
                "share behaviours between robots",
            )
        })?;
        self.types.push(ty);
        Ok(index)
    }

    fn body_type(
        &mut self,
        kind: &Spanned<String>,
        size: (u32, u32),
        actions: Arc<[Action]>,
        role: Role,
    ) -> Result<BodyType, InputError> {
        let own = own_boxes(size, self.stride());
        let marks = if matches!(role, Role::Robot(_)) { VISITED } else { 0 };
        Ok(BodyType { kind: self.kind(kind)?, size, own, marks, actions, role })
    }

    /// Notes how far the claims of a body reach, for tags that tell bodies apart.
    fn note_reach(
        &mut self,
        size: (u32, u32),
        longest_path: usize,
        span: &Range<usize>,
    ) -> Result<(), InputError> {
        let reach = longest_path as u32;
        self.reach = self.reach.max(reach);
        self.longest = self.longest.max(size.0.max(size.1) + reach);
        let extent = self.longest + self.reach;
        if extent > ClaimGrid::MAX_EXTENT {
            let cause = format!("bodies and paths reach over {extent} boxes");
            return Err(self.error(
                span.clone(),
                cause,
                format!("keep size plus twice the longest path below {}", ClaimGrid::MAX_EXTENT),
            ));
        }
        Ok(())
    }

    fn size(&self, size: [u32; 2], span: Range<usize>) -> Result<(u32, u32), InputError> {
        if size.iter().all(|s| (1..=MAX_SIZE).contains(s)) {
            return Ok((size[0], size[1]));
        }
        let cause = format!("a body of {} x {} boxes", size[0], size[1]);
        Err(self.error(span, cause, format!("give 1 to {MAX_SIZE} boxes a side")))
    }

    fn region(&self, region: Option<&Spanned<[u32; 4]>>) -> Result<Option<[u32; 4]>, InputError> {
        let Some(spanned) = region else { return Ok(None) };
        let r = *spanned.get_ref();
        self.check_rect(r, spanned.span())?;
        Ok(Some(r))
    }

    fn check_rect(
        &self,
        [col, row, width, height]: [u32; 4],
        span: Range<usize>,
    ) -> Result<(), InputError> {
        let fits = |from: u32, extent: u32, limit: u32| {
            extent > 0 && from.checked_add(extent).is_some_and(|end| end <= limit)
        };
        if fits(col, width, self.map.width()) && fits(row, height, self.map.height()) {
            return Ok(());
        }
        let cause = format!(
            "the region [{col}, {row}, {width}, {height}] is empty or leaves the map of {} x {} boxes",
            self.map.width(),
            self.map.height()
        );
        Err(self.error(span, cause, "write [col, row, width, height] in boxes"))
    }
}

impl Compiler<'_> {
    fn robots(&mut self, s: &RobotSection, span: Range<usize>) -> Result<Group, InputError> {
        if let Some(scen) = &s.scen {
            return self.robots_of_scen(s, scen, &span);
        }
        let (count, places, period) =
            self.common(s.count.as_ref(), &s.at, s.period.as_ref(), &span)?;
        let size = self.robot_size(s)?;
        let body = Arc::new(self.robot_body(s, size, &span)?);
        let behaviour = self.behaviour(s.behaviour.as_ref(), size, &body)?;
        let actions = Arc::clone(&body.actions);
        let role = Role::Robot(RobotModel { body, behaviour });
        let ty = self.body_type(&s.kind, (size, size), actions, role)?;
        let ty = TypeOf::All(self.add_type(ty, &span)?);
        Ok(Group {
            count,
            places,
            region: self.region(s.region.as_ref())?,
            span,
            ty,
            period,
            phase: s.phase,
        })
    }

    /// Starts and goals from a MovingAI list: the first `count` rows, one robot each.
    fn robots_of_scen(
        &mut self,
        s: &RobotSection,
        scen: &Spanned<std::path::PathBuf>,
        span: &Range<usize>,
    ) -> Result<Group, InputError> {
        let rows = import::movingai::load_scen(&self.source.path(scen.get_ref()))?;
        let count = s.count.as_ref().map_or(rows.len(), |c| *c.get_ref() as usize);
        if count > rows.len() {
            let cause = format!("count = {count}, but the list has {} rows", rows.len());
            return Err(self.error(scen.span(), cause, "give a smaller count"));
        }
        let size = self.robot_size(s)?;
        let body = Arc::new(self.robot_body(s, size, span)?);
        let free = FreeSpace::of_map(&self.map);
        let (mut places, mut types) = (Vec::new(), Vec::new());
        for row in &rows[..count] {
            let goals = vec![Arc::new(FlowField::towards(&free, size, &[row.goal]))];
            let behaviour: Arc<dyn Behaviour> = Arc::new(Goto { goals, repeat: false });
            let model = RobotModel { body: Arc::clone(&body), behaviour };
            let actions = Arc::clone(&body.actions);
            let ty = self.body_type(&s.kind, (size, size), actions, Role::Robot(model))?;
            types.push(self.add_type(ty, span)?);
            places.push(((row.start, None), scen.span()));
        }
        let period = s.period.as_ref().map_or(1, |p| *p.get_ref()).max(1);
        Ok(Group {
            count: count as u64,
            places,
            region: None,
            span: span.clone(),
            ty: TypeOf::Each(types),
            period,
            phase: s.phase,
        })
    }

    fn robot_size(&self, s: &RobotSection) -> Result<u32, InputError> {
        let span = s.size.as_ref().map_or(0..0, Spanned::span);
        let side = s.size.as_ref().map_or(1, |v| *v.get_ref());
        self.size([side, side], span).map(|size| size.0)
    }

    fn robot_body(
        &mut self,
        s: &RobotSection,
        size: u32,
        span: &Range<usize>,
    ) -> Result<RobotBody, InputError> {
        let sensors =
            s.sensors.iter().map(|name| self.mounted(name, size)).collect::<Result<Vec<_>, _>>()?;
        let effector = self.effector(s.effector.as_ref())?;
        let reliable = self.file.regime.reliable_effectors();
        let longest =
            effector.transitions.iter().flatten().map(|t| t.path.len()).max().unwrap_or(0);
        self.note_reach((size, size), longest, span)?;
        let actions =
            (0..effector.actions.len()).map(|a| effector.transitions_of(a as u8, reliable));
        let actions =
            actions_at_headings(&actions.collect::<Vec<_>>(), (size, size), self.stride());
        let bearings = sensors.iter().flat_map(|m| m.model.bearings_deg.iter());
        let sectors = bearings.map(|&deg| Sector::of(deg)).collect();
        Ok(RobotBody { sectors, sensors, actions, effector })
    }

    fn mounted(&self, name: &Spanned<String>, size: u32) -> Result<MountedSensor, InputError> {
        let model = self.sensor_model(name)?;
        let box_size_m = self.map.box_size_m;
        let range_boxes = model.range_m / box_size_m;
        if range_boxes * model.bearings_deg.len() as f64 > 60_000.0 || range_boxes > MAX_RANGE_BOXES
        {
            let cause = format!(
                "sensor `{}` reaches over {range_boxes:.0} boxes with {} beams",
                name.get_ref(),
                model.bearings_deg.len()
            );
            return Err(self.error(
                name.span(),
                cause,
                "give a shorter range, fewer beams or larger boxes",
            ));
        }
        let reliable = self.file.regime.reliable_sensors();
        Ok(MountedSensor::new(model, size, box_size_m, self.stride(), reliable)
            .expect("the sensor's rows were checked"))
    }

    fn sensor_model(&self, name: &Spanned<String>) -> Result<SensorModel, InputError> {
        let section = self.lookup(&self.sensors, name, "sensor")?;
        let mut used = vec![false; self.kinds.len()];
        used[1] = true;
        let people = self.file.people.get_ref().0.iter().map(|p| &p.kind);
        let doors = self.file.doors.get_ref().0.iter().map(|d| &d.kind);
        for kind in people.chain(doors) {
            used[usize::from(self.kind(kind)?)] = true;
        }
        used[usize::from(self.kind(&super::robot_kind())?)] = true;
        let kinds = Kinds { names: self.kinds.clone(), observations: self.observations(), used };
        tables::sensor(name.get_ref(), section, &kinds)
    }

    /// The observation each kind designates: its own name where nothing else is said.
    fn observations(&self) -> Vec<String> {
        let own = |kind: &String| {
            let section = self.file.kinds.iter().find(|(name, _)| name.get_ref() == kind);
            section.and_then(|(_, s)| s.observation.clone()).unwrap_or_else(|| kind.clone())
        };
        self.kinds.iter().map(own).collect()
    }

    fn effector(&self, name: Option<&Spanned<String>>) -> Result<EffectorModel, InputError> {
        let Some(name) = name else { return Ok(EffectorModel::perfect()) };
        let section = self.lookup(&self.effectors, name, "effector")?;
        tables::effector(name.get_ref(), section)
    }

    fn lookup<'m, T>(
        &self,
        all: &'m BTreeMap<String, Located<T>>,
        name: &Spanned<String>,
        what: &str,
    ) -> Result<&'m Located<T>, InputError> {
        all.get(name.get_ref()).ok_or_else(|| {
            let known: Vec<&str> = all.keys().map(String::as_str).collect();
            let cause = format!("unknown {what} `{}`", name.get_ref());
            self.error(name.span(), cause, nearest(name.get_ref(), &known))
        })
    }

    fn behaviour(
        &self,
        section: Option<&Spanned<BehaviourSection>>,
        size: u32,
        body: &RobotBody,
    ) -> Result<Arc<dyn Behaviour>, InputError> {
        let Some(spanned) = section else { return Ok(Arc::new(Wander::default())) };
        let (s, span) = (spanned.get_ref(), spanned.span());
        let missing = |key: &str, example: &str| {
            self.error(
                span.clone(),
                format!("behaviour `{}` needs `{key}`", s.kind),
                format!("add {example}"),
            )
        };
        let way = |rect: [u32; 4]| -> Result<Arc<FlowField>, InputError> {
            self.check_rect(rect, span.clone())?;
            let goals: Vec<_> = (rect[1]..rect[1] + rect[3])
                .flat_map(|r| (rect[0]..rect[0] + rect[2]).map(move |c| (c, r)))
                .collect();
            let field = FlowField::towards(&FreeSpace::of_map(&self.map), size, &goals);
            if goals.iter().any(|&(c, r)| field.is_goal(c, r)) {
                return Ok(Arc::new(field));
            }
            let cause = format!(
                "a robot of {size} x {size} boxes fits nowhere in [{}, {}, {}, {}]",
                rect[0], rect[1], rect[2], rect[3]
            );
            Err(self.error(
                span.clone(),
                cause,
                "name a region with free boxes; its boxes stand for the robot's lower-left box",
            ))
        };
        Ok(match s.kind.as_str() {
            "wander" => Arc::new(Wander {
                turn_every: s.turn_every.unwrap_or(Wander::default().turn_every).max(1),
            }),
            "shuttle" => {
                let a = s.a.ok_or_else(|| missing("a", "a = [col, row, width, height]"))?;
                let b = s.b.ok_or_else(|| missing("b", "b = [col, row, width, height]"))?;
                Arc::new(Shuttle { ends: [way(a)?, way(b)?] })
            }
            "goto" => {
                let goals = s
                    .goals
                    .as_ref()
                    .ok_or_else(|| missing("goals", "goals = [[col, row], ...]"))?;
                let goals =
                    goals.iter().map(|&(c, r)| way([c, r, 1, 1])).collect::<Result<_, _>>()?;
                Arc::new(Goto { goals, repeat: s.repeat.unwrap_or(false) })
            }
            "replay" => {
                let names = s
                    .actions
                    .as_ref()
                    .ok_or_else(|| missing("actions", "actions = [\"forward\", \"left\"]"))?;
                let known: Vec<&str> = body.effector.actions.iter().map(String::as_str).collect();
                let id = |name: &String| {
                    known.iter().position(|k| k == name).map(|k| k as u8).ok_or_else(|| {
                        self.error(
                            span.clone(),
                            format!("unknown action `{name}`"),
                            nearest(name, &known),
                        )
                    })
                };
                let actions = names.iter().map(id).collect::<Result<_, _>>()?;
                Arc::new(Replay { actions, repeat: s.repeat.unwrap_or(false) })
            }
            "random" => {
                let random = random::behaviour(s, &body.effector.actions);
                Arc::new(random.map_err(|(cause, remedy)| self.error(span, cause, remedy))?)
            }
            "external" => Arc::new(External),
            other => match self.own.get(other) {
                Some(own) => Arc::clone(own),
                None => {
                    let mut known =
                        vec!["wander", "shuttle", "goto", "replay", "random", "external"];
                    known.extend(self.own.keys().map(String::as_str));
                    return Err(self.error(
                        span,
                        format!("unknown behaviour `{other}`"),
                        nearest(other, &known),
                    ));
                }
            },
        })
    }
}

impl Compiler<'_> {
    fn people(&mut self, s: &MoverSection, span: Range<usize>) -> Result<Group, InputError> {
        let (count, places, period) =
            self.common(s.count.as_ref(), &s.at, s.period.as_ref(), &span)?;
        let size = self.size(*s.size.get_ref(), s.size.span())?;
        let straight = *s.p_straight.get_ref();
        if !(0.0..=1.0).contains(&straight) {
            let cause = format!("p_straight = {straight}");
            return Err(self.error(
                s.p_straight.span(),
                cause,
                "give a probability between 0 and 1",
            ));
        }
        self.note_reach(size, 1, &span)?;
        let step = [Transition { p: 1.0, path: vec![Side::Front], turn: 0 }];
        let actions = actions_at_headings(&[step.to_vec()], size, self.stride());
        let role = Role::Mover(Mover { straight: Chance::new(straight) });
        let ty = self.body_type(&s.kind, size, actions, role)?;
        let ty = TypeOf::All(self.add_type(ty, &span)?);
        Ok(Group {
            count,
            places,
            region: self.region(s.region.as_ref())?,
            span,
            ty,
            period,
            phase: s.phase,
        })
    }

    fn doors(&mut self, s: &DoorSection, span: Range<usize>) -> Result<Group, InputError> {
        let rects = self.door_rects(s, &span)?;
        let (mut places, mut types) = (Vec::new(), Vec::new());
        for (k, (rect, at)) in rects.iter().enumerate() {
            let size = self.size([rect.width, rect.height], at.clone())?;
            self.note_reach(size, 0, &span)?;
            // Without a given phase the doors of a section do not all toggle at once.
            let door = self.door(s, &span, k as u64, rects.len() as u64)?;
            let role = Role::Door(door);
            let ty = self.body_type(&s.kind, size, Arc::new([]), role)?;
            types.push(self.add_type(ty, &span)?);
            places.push((((rect.col, rect.row), Some(0)), at.clone()));
        }
        Ok(Group {
            count: rects.len() as u64,
            places,
            region: None,
            span,
            ty: TypeOf::Each(types),
            period: 1,
            phase: Some(0),
        })
    }

    fn door_rects(
        &self,
        s: &DoorSection,
        span: &Range<usize>,
    ) -> Result<Vec<(Rect, Range<usize>)>, InputError> {
        let [width, height] = *s.size.get_ref();
        let mut rects = Vec::new();
        for place in &s.at {
            let ((col, row), _) = self.placing(place)?;
            rects.push((Rect { col, row, width, height }, place.span()));
        }
        if s.office {
            rects.extend(self.office_doors.iter().map(|r| (*r, span.clone())));
        }
        if rects.is_empty() {
            return Err(self.error(
                span.clone(),
                "these doors stand nowhere",
                "add at = [[col, row]], or office = true on a generated office",
            ));
        }
        Ok(rects)
    }

    fn door(
        &self,
        s: &DoorSection,
        span: &Range<usize>,
        index: u64,
        of: u64,
    ) -> Result<Door, InputError> {
        match (&s.periodic, &s.random) {
            (Some(p), None) => {
                let (at, p) = (p.span(), p.get_ref());
                let total = p.open.checked_add(p.closed).filter(|t| *t > 0 && *t < 1 << 40);
                let total = total.ok_or_else(|| self.error(at, "a period of 0 or far too many cycles", "give open = 200, closed = 100"))?;
                Ok(Door::Periodic { open: p.open, closed: p.closed, phase: p.phase.unwrap_or(index * total / of) % total })
            }
            (None, Some(r)) => {
                let (at, r) = (r.span(), r.get_ref());
                if !(0.0..=1.0).contains(&r.p_open) || !(0.0..=1.0).contains(&r.p_close) {
                    return Err(self.error(at, "p_open or p_close is no probability", "give numbers between 0 and 1"));
                }
                Ok(Door::Random { open: Chance::new(r.p_open), close: Chance::new(r.p_close) })
            }
            _ => Err(self.error(span.clone(), "a door needs one schedule", "add periodic = { open = 200, closed = 100 } or random = { p_open = 0.01, p_close = 0.01 }")),
        }
    }
}

/// Every action at every heading, see `BodyType::actions`.
fn actions_at_headings(
    actions: &[Vec<Transition>],
    size: (u32, u32),
    stride: u32,
) -> Arc<[Action]> {
    let at = |heading: u8| {
        let build = move |a| Action::new(a, heading, size, stride).expect("the rows were checked");
        actions.iter().map(Vec::as_slice).map(build)
    };
    (0..4).flat_map(at).collect()
}

fn load_map(
    source: &Source,
    section: &Spanned<MapSection>,
) -> Result<(Arc<GridMap>, Vec<Rect>), InputError> {
    let s = section.get_ref();
    let size_span = s.box_size_m.as_ref().map_or(section.span(), Spanned::span);
    let box_size_m = s.box_size_m.as_ref().map_or(0.25, |b| *b.get_ref());
    if !(box_size_m > 0.0 && box_size_m <= 1000.0) {
        let cause = format!("boxes of {box_size_m} m");
        return Err(source.error(
            Some(size_span),
            cause,
            "give a side above 0 m, typically 0.1 to 0.5",
        ));
    }
    let (map, doors) = match (&s.file, &s.ascii, &s.office) {
        (Some(file), None, None) => {
            let path = source.path(file.get_ref());
            (import::map_file(&path, box_size_m, s.unknown)?, Vec::new())
        }
        (None, Some(art), None) => {
            let map = import::ascii::parse(
                &format!("{} (map.ascii)", source.place),
                art.get_ref(),
                box_size_m,
            )?;
            (map.with_unknown(s.unknown), Vec::new())
        }
        (None, None, Some(spec)) => {
            let office = spec.get_ref().build(box_size_m).map_err(|e| {
                source.error(Some(spec.span()), format!("{}: {}", e.place(), e.cause()), e.remedy())
            })?;
            (office.map, office.doors)
        }
        _ => {
            return Err(source.error(
                Some(section.span()),
                "the map needs exactly one of `file`, `ascii` and `office`",
                "write e.g. [map] with file = \"building.yaml\"",
            ));
        }
    };
    if map.width() > MAX_SIDE || map.height() > MAX_SIDE {
        let cause = format!("a map of {} x {} boxes", map.width(), map.height());
        return Err(source.error(
            Some(section.span()),
            cause,
            format!("use larger boxes: at most {MAX_SIDE} a side"),
        ));
    }
    if map.count(Cell::Free) == 0 {
        return Err(source.error(
            Some(section.span()),
            "the map has no free box",
            "use smaller boxes, another map, or unknown = \"free\"",
        ));
    }
    Ok((Arc::new(map), doors))
}

fn padded(map: &GridMap, stride: u32, rows: u32) -> Vec<u8> {
    use crate::worlds::robots::state::{FREE, WALL};
    let mut grid = vec![WALL; stride as usize * rows as usize];
    let width = map.width() as usize;
    for (row, cells) in map.cells().chunks(width.max(1)).enumerate() {
        let first = (row + BORDER as usize) * stride as usize + BORDER as usize;
        for (to, &cell) in grid[first..first + width].iter_mut().zip(cells) {
            *to = if cell == Cell::Free { FREE } else { WALL };
        }
    }
    grid
}

/// Names of the kinds: `free` and `wall` first, then the built-in ones, then the user's own.
fn kinds(source: &Source, file: &RobotsFile) -> Result<Vec<String>, InputError> {
    let mut kinds: Vec<String> =
        ["free", "wall", "door", "person", "robot"].map(String::from).to_vec();
    for name in file.kinds.keys() {
        if name.get_ref() == "free" {
            return Err(source.error(
                Some(name.span()),
                "`free` is no kind",
                "name the kind otherwise",
            ));
        }
        if !kinds.contains(name.get_ref()) {
            kinds.push(name.get_ref().clone());
        }
    }
    if kinds.len() > 127 {
        return Err(source.error(
            None,
            "more than 122 kinds of your own",
            "let kinds share a name",
        ));
    }
    Ok(kinds)
}

fn add_profile(
    source: Arc<Source>,
    sensors: &mut BTreeMap<String, Located<SensorSection>>,
    effectors: &mut BTreeMap<String, Located<EffectorSection>>,
) -> Result<(), InputError> {
    let file: ProfileFile = source.parse()?;
    if *file.format.get_ref() != crate::scenario::FORMAT {
        let cause = format!("profile format {} is not known", file.format.get_ref());
        return Err(source.error(
            Some(file.format.span()),
            cause,
            "learn the profile anew, or write `format = 1`",
        ));
    }
    add_all(&source, &file.sensors, sensors);
    add_all(&source, &file.effectors, effectors);
    Ok(())
}

fn add_all<T: Clone>(
    source: &Arc<Source>,
    from: &BTreeMap<String, Spanned<T>>,
    into: &mut BTreeMap<String, Located<T>>,
) {
    for (name, section) in from {
        into.insert(name.clone(), Located { section: section.clone(), source: Arc::clone(source) });
    }
}

/// Moves the sections of one key out of the file, with the key's place.
fn take<T>(sections: &mut Spanned<OneOrMany<T>>) -> (Range<usize>, Vec<T>) {
    (sections.span(), std::mem::take(&mut sections.get_mut().0))
}

/// Entity ids in the order of storage.
fn storage(start: &[((u32, u32), u8)], width: u32, order: StorageOrder) -> Vec<EntityId> {
    let mut ids: Vec<EntityId> = (0..start.len() as EntityId).collect();
    match order {
        StorageOrder::ById => {}
        StorageOrder::Spatial => ids.sort_by_key(|&id| {
            let ((col, row), _) = start[id as usize];
            ((row / 16) * (width / 16 + 1) + col / 16, row, col)
        }),
        StorageOrder::Shuffled(by) => {
            let streams = Streams::new(Seed(by));
            ids.sort_by_key(|&id| streams.block(id, 0, Purpose(0), 0));
        }
    }
    ids
}

/// The presets as text, for `sidestep new` and the documentation.
pub fn presets() -> &'static str {
    include_str!("../presets.toml")
}
