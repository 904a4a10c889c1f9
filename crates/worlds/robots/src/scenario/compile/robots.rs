//! Robot sections: bodies with sensors and effectors, and behaviors.

use super::super::{AvoidanceSection, StartPose};
use super::bodies::{BodyGroup, GroupTypes, action_cycles, period_cycles};
use super::random::UnlocatedError;
use super::unused_keys::BEHAVIOURS;
use super::*;
use crate::delay::Delays;
use crate::routes::RoutePlanner;
use sidestep_import::movingai::{ScenRow, load_scen};

impl Compiler<'_> {
    pub(super) fn robots(
        &mut self,
        s: &RobotSection,
        span: Range<usize>,
    ) -> Result<BodyGroup, InputError> {
        if let Some(scen) = &s.scen {
            return self.robots_from_scen(s, scen, &span);
        }
        let count = self.body_count(s.count.as_ref(), &s.at, &span)?;
        let size = side_boxes(s);
        let body = Arc::new(self.robot_body(s, size)?);
        let team = self.team(s, &body.effector)?;
        let has_planner = team.is_some();
        let team_orders = team.as_ref().and_then(|team| team.leader.orders);
        let robot = RobotKind { size, body: &body, has_planner };
        let tasks = self.tasks(s, count)?.map(Arc::new);
        let behaviour = match tasks {
            Some(_) => Arc::new(Errands),
            None => self.behaviour(s.behaviour.as_ref(), robot)?,
        };
        let actions = Arc::clone(&body.actions);
        let role = Role::Robot(RobotModel::new(body, behaviour, team_orders));
        let ty = self.body_type(&s.kind, (size, size), actions, role)?;
        let ty = GroupTypes::Shared(self.add_type(ty, &span)?);
        let group = BodyGroup {
            name: s.name.clone(),
            count,
            places: s.at.clone(),
            region: self.region(s.region.as_ref())?,
            span,
            ty,
            period: period_cycles(s.period),
            phase: s.phase,
            action_cycles: action_cycles(s),
            team,
            tasks,
        };
        self.start_as_planned(s, group)
    }

    /// Reads starts and goals from a MovingAI list: the first `count` rows, one robot each.
    fn robots_from_scen(
        &mut self,
        s: &RobotSection,
        scen: &Spanned<PathBuf>,
        span: &Range<usize>,
    ) -> Result<BodyGroup, InputError> {
        let list = load_scen(&self.source.path(scen.get_ref()));
        let rows = list.map_err(|error| self.source.with_key_at(scen.span(), error))?.rows;
        let remark = self.other_map_remark(&rows);
        self.remarks.extend(remark);
        let count = s.count.as_ref().map_or(rows.len(), |c| *c.get_ref() as usize);
        if count > rows.len() {
            let cause = format!("count = {count}, but the list has {} rows", rows.len());
            return Err(self.source.error(scen.span(), cause, "give a smaller count"));
        }
        let size = side_boxes(s);
        let body = Arc::new(self.robot_body(s, size)?);
        let team = self.team(s, &body.effector)?;
        let has_planner = team.is_some();
        let team_orders = team.as_ref().and_then(|team| team.leader.orders);
        let routes = route_planner(&self.map, size, None, &body, has_planner);
        let alone = (!has_planner).then(|| self.avoidance(None, &routes, &body));
        let mut places = Vec::new();
        let mut types = Vec::new();
        for row in &rows[..count] {
            let goals = vec![self.scen_goal(scen, row, &routes)?];
            let avoidance = alone.clone().unwrap_or_else(|| Avoidance::Team(vec![vec![row.goal]]));
            let behaviour: Arc<dyn Behaviour> = Arc::new(Goto { goals, repeat: false, avoidance });
            let model = RobotModel::new(Arc::clone(&body), behaviour, team_orders);
            let actions = Arc::clone(&body.actions);
            let ty = self.body_type(&s.kind, (size, size), actions, Role::Robot(model))?;
            types.push(self.add_type(ty, span)?);
            places.push(Spanned::new(scen.span(), StartPose { at: row.start, facing: None }));
        }
        let group = BodyGroup {
            name: s.name.clone(),
            count: count as u64,
            places,
            region: None,
            span: span.clone(),
            ty: GroupTypes::PerBody(types),
            period: period_cycles(s.period),
            phase: s.phase,
            action_cycles: action_cycles(s),
            team,
            tasks: None,
        };
        self.start_as_planned(s, group)
    }

    /// Returns a warning where rows of a list are for a map of another name than that of the scenario.
    fn other_map_remark(&self, rows: &[ScenRow]) -> Option<Remark> {
        let file = self.file.map.get_ref().file.as_ref()?;
        let name_of = |path: &str| path.rsplit(['/', '\\']).next().unwrap_or_default().to_owned();
        let own = name_of(&file.get_ref().display().to_string());
        let own = own.strip_suffix(".gz").unwrap_or(&own);
        let other = rows.iter().find(|row| name_of(&row.map) != own)?;
        let words = format!(
            "line {} of the list is for the map `{}`, and the scenario has `{}`: starts and goals may be others than meant",
            other.line,
            other.map.escape_debug(),
            own.escape_debug()
        );
        Some(Remark::warning("robots.scen", words))
    }

    /// Returns the shortest paths to the goal of a row of a MovingAI list.
    fn scen_goal(
        &self,
        scen: &Spanned<PathBuf>,
        row: &ScenRow,
        routes: &RoutePlanner,
    ) -> Result<Arc<FlowField>, InputError> {
        let place = self.source.path(scen.get_ref()).display().to_string();
        let checked = row.check_against(&place, &self.map);
        checked.map_err(|error| self.source.with_key_at(scen.span(), error))?;
        let field = routes.to_nearest(&[row.goal]);
        if !field.is_goal(row.goal.0, row.goal.1) {
            let size = routes.size;
            let cause = format!("a robot of {size} x {size} boxes does not fit at {:?}", row.goal);
            let remedy = "give smaller robots, or another list";
            return Err(InputError::new(&place, cause, remedy).with_position(row.line, 1));
        }
        Ok(Arc::new(field))
    }

    fn robot_body(&mut self, s: &RobotSection, size: u32) -> Result<RobotBody, InputError> {
        let mut sensors = Vec::with_capacity(s.sensors.len());
        let mut sectors = Vec::new();
        for name in &s.sensors {
            let sensor = self.mounted_sensor(name, size)?;
            let bearings_deg = sensor.model.bearings_deg.iter();
            sectors.extend(bearings_deg.map(|&deg| Sector::from_bearing_deg(deg)));
            sensors.push(sensor);
        }
        let effector = self.effector(s.effector.as_ref())?;
        let transitions = effector.transitions.iter().flatten();
        let max_steps = transitions.map(|transition| transition.path.len()).max().unwrap_or(0);
        self.reach = self.reach.max(max_steps as u32);
        let is_reliable = self.file.regime.has_reliable_effectors();
        let mut actions = Vec::with_capacity(effector.actions.len());
        for action in 0..effector.actions.len() {
            actions.push(effector.transitions_of(action as u8, is_reliable));
        }
        let actions = actions_at_headings(&actions, (size, size), self.stride());
        let delays = effector.delays.as_ref().filter(|_| !is_reliable).and_then(Delays::new);
        Ok(RobotBody { sectors, sensors, actions, effector, delays })
    }

    fn mounted_sensor(
        &self,
        name: &Spanned<String>,
        size: u32,
    ) -> Result<MountedSensor, InputError> {
        let model = self.sensor_model(name)?;
        let box_size_m = self.map.box_size_m;
        let range_boxes = model.range_m / box_size_m;
        let beams = model.bearings_deg.len();
        if range_boxes * beams as f64 > MAX_BEAM_BOXES || range_boxes > MAX_RANGE_BOXES {
            let sensor = name.get_ref();
            let cause =
                format!("sensor `{sensor}` reaches over {range_boxes:.0} boxes with {beams} beams");
            let remedy = "give a shorter range, fewer beams or larger boxes";
            return Err(self.source.error(name.span(), cause, remedy));
        }
        let reliable = self.file.regime.has_reliable_sensors();
        Ok(MountedSensor::new(model, size, box_size_m, self.stride(), reliable)
            .expect("the sensor's rows were checked"))
    }

    fn sensor_model(&self, name: &Spanned<String>) -> Result<SensorModel, InputError> {
        let section = find_named(&self.source, &self.sensors, name, "sensor")?;
        tables::sensor(name.get_ref(), section, &self.kinds, true)
    }

    fn effector(&self, name: Option<&Spanned<String>>) -> Result<EffectorModel, InputError> {
        let Some(name) = name else { return Ok(EffectorModel::perfect()) };
        let section = find_named(&self.source, &self.effectors, name, "effector")?;
        tables::effector(name.get_ref(), section)
    }

    fn behaviour(
        &self,
        section: Option<&Spanned<BehaviourSection>>,
        robot: RobotKind<'_>,
    ) -> Result<Arc<dyn Behaviour>, InputError> {
        let RobotKind { body, has_planner, .. } = robot;
        let Some(section) = section else {
            return Ok(self.with_stall_detector(Arc::new(Wander::default()), body));
        };
        let builder = BehaviourBuilder { compiler: self, section, robot };
        let kind = section.get_ref().kind.get_ref().as_str();
        let behaviour = builder.build(kind)?;
        // Planners need no contact: they see obstacles, and leave deadlocks by straying.
        let waits_for_contacts = ["wander", "shuttle", "goto"].contains(&kind)
            && !behaviour.has_requests()
            && !has_planner;
        if waits_for_contacts {
            Ok(self.with_stall_detector(behaviour, body))
        } else {
            Ok(behaviour)
        }
    }

    /// Returns a behavior that turns on contact, which also notices that it is blocked where there may be no
    /// contact.
    fn with_stall_detector(
        &self,
        inner: Arc<dyn Behaviour>,
        body: &RobotBody,
    ) -> Arc<dyn Behaviour> {
        if self.has_no_contacts(body) { Arc::new(StallDetector { inner }) } else { inner }
    }

    /// Returns whether a step that is blocked may do nothing, without a contact. Behaviors that turn
    /// on contact then need a [`StallDetector`].
    fn has_no_contacts(&self, body: &RobotBody) -> bool {
        let is_reliable = self.file.regime.has_reliable_effectors();
        let steps = body.effector.transitions_of(FORWARD, is_reliable);
        let may_stay = steps.iter().any(|step| step.p > 0.0 && step.path.is_empty());
        self.file.obstacle_rule == ObstacleRule::Renormalise && may_stay
    }

    fn avoidance(
        &self,
        section: Option<AvoidanceSection>,
        routes: &RoutePlanner,
        body: &RobotBody,
    ) -> Avoidance {
        match section.unwrap_or_default() {
            AvoidanceSection::Plan => {
                let box_size_m = self.map.box_size_m;
                Avoidance::Plan(Arc::new(routes.planner(body, box_size_m, self.file.regime)))
            }
            AvoidanceSection::Avoid => Avoidance::Sidestep(SensorTrust::OneBeam),
            AvoidanceSection::Filter => Avoidance::Sidestep(SensorTrust::TwoReports),
            AvoidanceSection::Touch => Avoidance::Touch,
        }
    }

    fn unknown_behaviour(&self, name: &str) -> UnlocatedError {
        let own = self.own.keys().map(String::as_str);
        let known: Vec<&str> = BEHAVIOURS.iter().map(|(name, _)| *name).chain(own).collect();
        (format!("unknown behaviour `{name}`"), suggestion(name, &known))
    }
}

/// Returns the ways of robots with a body, for a rule by which they get past obstacles.
fn route_planner(
    map: &GridMap,
    size: u32,
    avoidance: Option<AvoidanceSection>,
    body: &RobotBody,
    has_planner: bool,
) -> RoutePlanner {
    let is_planned = avoidance.unwrap_or_default() == AvoidanceSection::Plan;
    let has_lanes = is_planned && !has_planner && !body.sensors.is_empty();
    RoutePlanner::new(map, size, has_lanes)
}

/// The robots of one section, for which a behavior is made.
#[derive(Clone, Copy)]
struct RobotKind<'c> {
    size: u32,
    body: &'c RobotBody,
    /// Whether a planner leads them.
    has_planner: bool,
}

/// The behavior of one section of robots in the making, with the robots that it is for.
struct BehaviourBuilder<'c, 'a> {
    compiler: &'c Compiler<'a>,
    section: &'c Spanned<BehaviourSection>,
    robot: RobotKind<'c>,
}

impl BehaviourBuilder<'_, '_> {
    fn build(&self, kind: &str) -> Result<Arc<dyn Behaviour>, InputError> {
        let s = self.section.get_ref();
        let actions = &self.robot.body.effector.actions;
        Ok(match kind {
            "wander" => Arc::new(wander(s)),
            "announce" => Arc::new(Announce { wander: wander(s), size: self.robot.size }),
            "shuttle" => self.shuttle()?,
            "goto" => self.goto()?,
            "replay" => Arc::new(replay(s, actions).map_err(|error| self.located(error))?),
            "random" => {
                Arc::new(random::behaviour(s, actions).map_err(|error| self.located(error))?)
            }
            "external" => Arc::new(External),
            other => match self.compiler.own.get(other) {
                Some(own) => Arc::clone(own),
                None => {
                    let (cause, remedy) = self.compiler.unknown_behaviour(other);
                    return Err(self.compiler.source.error(s.kind.span(), cause, remedy));
                }
            },
        })
    }

    fn shuttle(&self) -> Result<Arc<dyn Behaviour>, InputError> {
        let s = self.section.get_ref();
        let routes = self.routes();
        let a = self.required("a", s.a, "[col, row, width, height]")?;
        let start = self.flow_field(&routes, a)?;
        let b = self.required("b", s.b, "[col, row, width, height]")?;
        let end = self.flow_field(&routes, b)?;
        let avoidance = self.avoidance(&routes, &[(a, &start), (b, &end)]);
        Ok(Arc::new(Shuttle { ends: [start, end], avoidance }))
    }

    fn goto(&self) -> Result<Arc<dyn Behaviour>, InputError> {
        let s = self.section.get_ref();
        let routes = self.routes();
        let mut goals = Vec::new();
        let boxes = self.required("goals", s.goals.as_ref(), "[[col, row], ...]")?;
        for &(col, row) in boxes {
            goals.push(self.flow_field(&routes, [col, row, 1, 1])?);
        }
        let regions: Vec<_> =
            boxes.iter().map(|&(col, row)| [col, row, 1, 1]).zip(&goals).collect();
        let avoidance = self.avoidance(&routes, &regions);
        Ok(Arc::new(Goto { goals, repeat: s.repeat.unwrap_or(false), avoidance }))
    }

    fn routes(&self) -> RoutePlanner {
        let RobotKind { size, body, has_planner } = self.robot;
        let avoidance = self.section.get_ref().avoidance;
        route_planner(&self.compiler.map, size, avoidance, body, has_planner)
    }

    /// Returns the way past obstacles to regions; a planner chooses among those of their boxes where the body fits.
    fn avoidance(
        &self,
        routes: &RoutePlanner,
        regions: &[([u32; 4], &Arc<FlowField>)],
    ) -> Avoidance {
        if !self.robot.has_planner {
            let avoidance = self.section.get_ref().avoidance;
            return self.compiler.avoidance(avoidance, routes, self.robot.body);
        }
        let mut anchors = Vec::with_capacity(regions.len());
        for &(rect, field) in regions {
            let fits = |&(col, row): &(u32, u32)| field.is_goal(col, row);
            anchors.push(boxes_of(rect).filter(fits).collect());
        }
        Avoidance::Team(anchors)
    }

    /// Returns the value of a key that the behavior cannot do without.
    fn required<T>(&self, key: &str, given: Option<T>, example: &str) -> Result<T, InputError> {
        required(self.section.get_ref(), key, given, example).map_err(|error| self.located(error))
    }

    /// Returns the shortest paths to a region in which there is room for a robot.
    fn flow_field(
        &self,
        routes: &RoutePlanner,
        rect: [u32; 4],
    ) -> Result<Arc<FlowField>, InputError> {
        let size = self.robot.size;
        self.compiler.check_rect(rect, self.section.span())?;
        let goals: Vec<_> = boxes_of(rect).collect();
        let field = routes.to_nearest(&goals);
        // A box of the region in which a robot does not fit is no goal.
        if goals.iter().any(|&(c, r)| field.is_goal(c, r)) {
            return Ok(Arc::new(field));
        }
        let cause = format!("a robot of {size} x {size} boxes fits nowhere in {rect:?}");
        let remedy =
            "give a region with free boxes; its boxes stand for the robot's lower-left box";
        Err(self.compiler.source.error(self.section.span(), cause, remedy))
    }

    /// Puts an error at the section.
    fn located(&self, (cause, remedy): UnlocatedError) -> InputError {
        self.compiler.source.error(self.section.span(), cause, remedy)
    }
}

/// Returns the value of a key that a behavior cannot do without.
fn required<T>(
    s: &BehaviourSection,
    key: &str,
    given: Option<T>,
    example: &str,
) -> Result<T, UnlocatedError> {
    given.ok_or_else(|| {
        let cause = format!("behaviour `{}` needs `{key}`", s.kind.get_ref());
        let remedy = format!("add {key} = {example}");
        (cause, remedy)
    })
}

fn wander(s: &BehaviourSection) -> Wander {
    Wander { turn_every: s.turn_every.unwrap_or(Wander::default().turn_every).max(1) }
}

fn replay(s: &BehaviourSection, actions: &[String]) -> Result<Replay, UnlocatedError> {
    let names = required(s, "actions", s.actions.as_ref(), "[\"forward\", \"left\"]")?;
    let ids = names.iter().map(|name| random::action_id(name, actions).map(|id| id as u8));
    Ok(Replay { actions: ids.collect::<Result<_, _>>()?, repeat: s.repeat.unwrap_or(false) })
}

/// Returns the boxes of a region, row by row.
fn boxes_of([col, row, width, height]: [u32; 4]) -> impl Iterator<Item = (u32, u32)> {
    (row..row + height).flat_map(move |r| (col..col + width).map(move |c| (c, r)))
}

/// One box unless the scenario says otherwise.
pub(super) fn side_boxes(s: &RobotSection) -> u32 {
    s.size.map_or(1, |side| side.get() as u32)
}
