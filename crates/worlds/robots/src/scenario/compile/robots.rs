//! Robot sections: bodies with sensors and effectors, and behaviours.

use super::bodies::{Group, TypeOf};
use super::*;

impl Compiler<'_> {
    pub(super) fn robots(
        &mut self,
        s: &RobotSection,
        span: Range<usize>,
    ) -> Result<Group, InputError> {
        if let Some(scen) = &s.scen {
            return self.robots_of_scen(s, scen, &span);
        }
        let (count, places, period) =
            self.common(s.count.as_ref(), &s.at, s.period.as_ref(), &span)?;
        let size = self.robot_size(s)?;
        let body = Arc::new(self.robot_body(s, size)?);
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
        let rows = sidestep_import::movingai::load_scen(&self.source.path(scen.get_ref()))?;
        let count = s.count.as_ref().map_or(rows.len(), |c| *c.get_ref() as usize);
        if count > rows.len() {
            let cause = format!("count = {count}, but the list has {} rows", rows.len());
            return Err(self.error(scen.span(), cause, "give a smaller count"));
        }
        let size = self.robot_size(s)?;
        let body = Arc::new(self.robot_body(s, size)?);
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
        let period = self.period(s.period.as_ref())?;
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

    fn robot_body(&mut self, s: &RobotSection, size: u32) -> Result<RobotBody, InputError> {
        let sensors =
            s.sensors.iter().map(|name| self.mounted(name, size)).collect::<Result<Vec<_>, _>>()?;
        let effector = self.effector(s.effector.as_ref())?;
        let reliable = self.file.regime.reliable_effectors();
        let longest =
            effector.transitions.iter().flatten().map(|t| t.path.len()).max().unwrap_or(0);
        self.reach = self.reach.max(longest as u32);
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
        used[usize::from(self.kind(&super::super::robot_kind())?)] = true;
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
