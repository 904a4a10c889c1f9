//! Robot sections: bodies with sensors and effectors, and behaviors.

use super::super::{AvoidanceSection, StartPose};
use super::bodies::{BodyGroup, GroupTypes, period_cycles};
use super::random::UnlocatedError;
use super::unused_keys::BEHAVIOURS;
use super::*;

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
        let behaviour = self.behaviour(s.behaviour.as_ref(), size, &body)?;
        let actions = Arc::clone(&body.actions);
        let role = Role::Robot(RobotModel::new(body, behaviour));
        let ty = self.body_type(&s.kind, (size, size), actions, role)?;
        let ty = GroupTypes::Shared(self.add_type(ty, &span)?);
        Ok(BodyGroup {
            count,
            places: s.at.clone(),
            region: self.region(s.region.as_ref())?,
            span,
            ty,
            period: period_cycles(s.period),
            phase: s.phase,
        })
    }

    /// Reads starts and goals from a MovingAI list: the first `count` rows, one robot each.
    fn robots_from_scen(
        &mut self,
        s: &RobotSection,
        scen: &Spanned<std::path::PathBuf>,
        span: &Range<usize>,
    ) -> Result<BodyGroup, InputError> {
        let rows = sidestep_import::movingai::load_scen(&self.source.path(scen.get_ref()));
        let rows = rows.map_err(|error| self.source.with_key_at(scen.span(), error))?;
        let count = s.count.as_ref().map_or(rows.len(), |c| *c.get_ref() as usize);
        if count > rows.len() {
            let cause = format!("count = {count}, but the list has {} rows", rows.len());
            return Err(self.source.error(scen.span(), cause, "give a smaller count"));
        }
        let size = side_boxes(s);
        let body = Arc::new(self.robot_body(s, size)?);
        let free = Arc::new(FreeSpace::from_map(&self.map));
        let avoidance = self.avoidance(None, &free, size, &body);
        let (mut places, mut types) = (Vec::new(), Vec::new());
        let place = self.source.path(scen.get_ref()).display().to_string();
        for row in &rows[..count] {
            let checked = row.check_against(&place, &self.map);
            checked.map_err(|error| self.source.with_key_at(scen.span(), error))?;
            let goals = vec![Arc::new(FlowField::to_nearest(&free, size, &[row.goal]))];
            let avoidance = avoidance.clone();
            if !goals[0].is_goal(row.goal.0, row.goal.1) {
                let cause =
                    format!("a robot of {size} x {size} boxes does not fit at {:?}", row.goal);
                let remedy = "give smaller robots, or another list";
                return Err(InputError::new(&place, cause, remedy).with_position(row.line, 1));
            }
            let behaviour: Arc<dyn Behaviour> = Arc::new(Goto { goals, repeat: false, avoidance });
            let model = RobotModel::new(Arc::clone(&body), behaviour);
            let actions = Arc::clone(&body.actions);
            let ty = self.body_type(&s.kind, (size, size), actions, Role::Robot(model))?;
            types.push(self.add_type(ty, span)?);
            places.push(Spanned::new(scen.span(), StartPose { at: row.start, facing: None }));
        }
        Ok(BodyGroup {
            count: count as u64,
            places,
            region: None,
            span: span.clone(),
            ty: GroupTypes::PerBody(types),
            period: period_cycles(s.period),
            phase: s.phase,
        })
    }

    fn robot_body(&mut self, s: &RobotSection, size: u32) -> Result<RobotBody, InputError> {
        let sensors = s
            .sensors
            .iter()
            .map(|name| self.mounted_sensor(name, size))
            .collect::<Result<Vec<_>, _>>()?;
        let effector = self.effector(s.effector.as_ref())?;
        let reliable = self.file.regime.has_reliable_effectors();
        let longest =
            effector.transitions.iter().flatten().map(|t| t.path.len()).max().unwrap_or(0);
        self.reach = self.reach.max(longest as u32);
        let actions =
            (0..effector.actions.len()).map(|a| effector.transitions_of(a as u8, reliable));
        let actions =
            actions_at_headings(&actions.collect::<Vec<_>>(), (size, size), self.stride());
        let bearings = sensors.iter().flat_map(|m| m.model.bearings_deg.iter());
        let sectors = bearings.map(|&deg| Sector::from_bearing_deg(deg)).collect();
        Ok(RobotBody { sectors, sensors, actions, effector })
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
        if range_boxes * beams as f64 > 60_000.0 || range_boxes > MAX_RANGE_BOXES {
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
        size: u32,
        body: &RobotBody,
    ) -> Result<Arc<dyn Behaviour>, InputError> {
        let Some(section) = section else {
            return Ok(self.with_stall_detector(Arc::new(Wander::default()), body));
        };
        let s = section.get_ref();
        let error = |wrong: UnlocatedError| self.source.error(section.span(), wrong.0, wrong.1);
        let free = Arc::new(FreeSpace::from_map(&self.map));
        let ways = FlowFieldBuilder { compiler: self, free: &free, size, span: section.span() };
        let avoidance = || self.avoidance(s.avoidance, &free, size, body);
        let actions = &body.effector.actions;
        let behaviour: Arc<dyn Behaviour> = match s.kind.get_ref().as_str() {
            "wander" => Arc::new(wander(s)),
            "announce" => Arc::new(Announce { wander: wander(s), size }),
            "shuttle" => {
                let end = |given: Option<[u32; 4]>, key: &str| {
                    ways.build(required(s, key, given, "[col, row, width, height]").map_err(error)?)
                };
                Arc::new(Shuttle { ends: [end(s.a, "a")?, end(s.b, "b")?], avoidance: avoidance() })
            }
            "goto" => {
                let goals = required(s, "goals", s.goals.as_ref(), "[[col, row], ...]");
                let goals = goals.map_err(error)?.iter().map(|&(c, r)| ways.build([c, r, 1, 1]));
                let goals = goals.collect::<Result<_, _>>()?;
                let repeat = s.repeat.unwrap_or(false);
                Arc::new(Goto { goals, repeat, avoidance: avoidance() })
            }
            "replay" => Arc::new(replay(s, actions).map_err(error)?),
            "random" => Arc::new(random::behaviour(s, actions).map_err(error)?),
            "external" => Arc::new(External),
            other => match self.own.get(other) {
                Some(own) => Arc::clone(own),
                None => {
                    let (cause, remedy) = self.unknown_behaviour(other);
                    return Err(self.source.error(s.kind.span(), cause, remedy));
                }
            },
        };
        let waits = ["wander", "shuttle", "goto"].contains(&s.kind.get_ref().as_str());
        Ok(if waits && !behaviour.has_requests() {
            self.with_stall_detector(behaviour, body)
        } else {
            behaviour
        })
    }

    /// Returns a behavior that turns on contact, with another way to notice that it is blocked where
    /// there may be no contact.
    fn with_stall_detector(
        &self,
        inner: Arc<dyn Behaviour>,
        body: &RobotBody,
    ) -> Arc<dyn Behaviour> {
        if self.has_no_contacts(body) { Arc::new(StallDetector { inner }) } else { inner }
    }

    /// Returns whether a step that is blocked may do nothing, without a contact. Behaviors that turn
    /// on contact then need another way to notice it.
    fn has_no_contacts(&self, body: &RobotBody) -> bool {
        let reliable = self.file.regime.has_reliable_effectors();
        let may_stay = |t: &Transition| t.p > 0.0 && t.path.is_empty();
        self.file.obstacle_rule == ObstacleRule::Renormalise
            && body.effector.transitions_of(FORWARD, reliable).iter().any(may_stay)
    }

    fn avoidance(
        &self,
        section: Option<AvoidanceSection>,
        free: &Arc<FreeSpace>,
        size: u32,
        body: &RobotBody,
    ) -> Avoidance {
        match section.unwrap_or_default() {
            AvoidanceSection::Plan => {
                let (free, box_size_m) = (Arc::clone(free), self.map.box_size_m);
                let wheels_err =
                    !self.file.regime.has_reliable_effectors() && body.effector.has_errors();
                Avoidance::Plan(Arc::new(Planner::new(free, size, body, box_size_m, wheels_err)))
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

/// Ways for robots of one size, asked for at one place of the scenario.
struct FlowFieldBuilder<'c, 'a> {
    compiler: &'c Compiler<'a>,
    free: &'c FreeSpace,
    size: u32,
    span: Range<usize>,
}

impl FlowFieldBuilder<'_, '_> {
    /// Returns the way to a region in which there is room for a robot.
    fn build(&self, rect: [u32; 4]) -> Result<Arc<FlowField>, InputError> {
        let (compiler, size) = (self.compiler, self.size);
        compiler.check_rect(rect, self.span.clone())?;
        let [col, row, width, height] = rect;
        let goals: Vec<_> =
            (row..row + height).flat_map(|r| (col..col + width).map(move |c| (c, r))).collect();
        let field = FlowField::to_nearest(self.free, size, &goals);
        if goals.iter().any(|&(c, r)| field.is_goal(c, r)) {
            return Ok(Arc::new(field));
        }
        let cause = format!("a robot of {size} x {size} boxes fits nowhere in {rect:?}");
        let remedy =
            "give a region with free boxes; its boxes stand for the robot's lower-left box";
        Err(compiler.source.error(self.span.clone(), cause, remedy))
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
        (
            format!("behaviour `{}` needs `{key}`", s.kind.get_ref()),
            format!("add {key} = {example}"),
        )
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

/// Returns the number of boxes of a robot's side.
fn side_boxes(s: &RobotSection) -> u32 {
    s.size.map_or(1, |side| side.get() as u32)
}
