//! Robots as a caller sees them: their observations, and the orders for those that are decided from
//! outside.

use super::Scratch;
use super::cycle_context::{CycleContext, with_cycle};
use super::decide::{ActionId, Avoidance, External};
use super::effector::{HEADING_NAMES, STANDARD_ACTIONS, Side};
use super::plan::{action_of_order, place_in_team};
use super::state::RobotsState;
use super::team::TeamOrders;
use super::world::{BodyType, RobotModel, RobotsWorld, Role};
use sidestep_kernel::control::{AgentTeam, AgentTeams, BufferMut, Order, ValueDomain, ValueSpace};
use sidestep_kernel::space::OccupantWord;
use sidestep_kernel::{Cycle, EntityId, Phases, World};
use sidestep_planners::GridPose;
use std::sync::Arc;

#[cfg(test)]
mod tests;

/// Most words of others that one robot observes: those of the first senders by id. An observation has one shape
/// for a whole run, which would else grow with the number of robots.
const MAX_HEARD: usize = 64;

/// The order of a plan, by its name: a row of actions by their numbers.
const PLAN: &str = "plan";

/// Robots that make up a team.
struct AlikeRobots<'a> {
    ty: &'a BodyType,
    model: &'a RobotModel,
    agents: Vec<EntityId>,
}

impl AlikeRobots<'_> {
    /// Returns whether a robot of this type belongs to them.
    fn accepts(&self, ty: &BodyType, model: &RobotModel) -> bool {
        self.ty.kind == ty.kind
            && Arc::ptr_eq(&self.model.body, &model.body)
            && self.model.is_external == model.is_external
            && self.model.team_orders == model.team_orders
    }
}

/// Returns the numbers from 0 on, by these names.
fn choice<S: Into<String>>(names: impl IntoIterator<Item = S>) -> ValueDomain {
    ValueDomain::Discrete(names.into_iter().map(Into::into).collect())
}

impl RobotsWorld {
    /// Returns the teams: robots of one kind that have one body, and decide themselves or do not.
    pub(super) fn find_teams(&self) -> AgentTeams {
        let mut alike: Vec<AlikeRobots<'_>> = Vec::new();
        for &id in &self.robots {
            let ty = self.type_of(id);
            let Role::Robot(model) = &ty.role else { continue };
            // From the last one, because the robots of one section follow each other.
            match alike.iter_mut().rev().find(|others| others.accepts(ty, model)) {
                Some(others) => others.agents.push(id),
                None => alike.push(AlikeRobots { ty, model, agents: vec![id] }),
            }
        }
        let mut teams = Vec::with_capacity(alike.len());
        for AlikeRobots { ty, model, agents } in alike {
            teams.push(AgentTeam {
                name: self.kinds[usize::from(ty.kind)].clone(),
                agents,
                observation_spaces: self.observation_spaces(model),
                action_spaces: if model.is_external {
                    self.action_spaces(model)
                } else {
                    Vec::new()
                },
            });
        }
        AgentTeams::new(teams, Self::AGENT)
    }

    /// Returns the spaces of a robot's percept, in the order in which [`Self::observe`] writes them.
    fn observation_spaces(&self, model: &RobotModel) -> Vec<ValueSpace> {
        let mut spaces = Vec::new();
        for (k, sensor) in model.body.sensors.iter().enumerate() {
            let model = &sensor.model;
            let name = match k {
                0 => model.name.clone(),
                k => format!("{}_{}", model.name, k + 1),
            };
            let beams = [model.bearings_deg.len()];
            let reports = ValueDomain::Discrete(model.observations.clone());
            let meaning = format!("what each beam of sensor `{}` reports", model.name);
            spaces.push(
                ValueSpace::new(format!("{name}_report"), reports, meaning).with_shape(beams),
            );
            let beyond = std::iter::once("beyond".to_string());
            let classes = model.distance_classes.iter().cloned().chain(beyond).collect();
            let meaning = format!("the distance class that each beam of `{}` reports", model.name);
            spaces.push(
                ValueSpace::new(format!("{name}_class"), ValueDomain::Discrete(classes), meaning)
                    .with_shape(beams),
            );
        }
        spaces.extend(self.common_observation_spaces());
        if let Some(orders) = model.team_orders {
            spaces.extend(self.planner_observation_spaces(orders));
        }
        spaces
    }

    /// Returns the spaces that robots perceive without sensors.
    fn common_observation_spaces(&self) -> Vec<ValueSpace> {
        let kinds = choice(["none"].into_iter().chain(self.kinds.iter().map(String::as_str)));
        let sides = choice(["none"].into_iter().chain(Side::ALL.iter().map(|side| side.name())));
        let longest_side = self.map.width().max(self.map.height());
        let boxes = ValueDomain::Integer { low: 0, high: i64::from(longest_side) - 1 };
        let mut spaces = vec![
            ValueSpace::new("contact", kinds, "kind of what stopped its last action"),
            ValueSpace::new("contact_side", sides, "its side that touched that"),
            ValueSpace::new("at_boxes", boxes, "column and row of its lower-left box")
                .with_shape([2]),
            ValueSpace::new("heading", choice(HEADING_NAMES), "where it looks"),
            ValueSpace::new("due", choice(["no", "yes"]), "whether it acts in the next cycle"),
        ];
        if self.radio.is_some() {
            let heard = [self.max_heard()];
            let max_id = self.bodies.len() as i64 - 1;
            let from = ValueDomain::Integer { low: -1, high: max_id };
            let meaning = "ids of those whose word it hears, rising; -1 where there are no more";
            spaces.push(ValueSpace::new("heard_from", from, meaning).with_shape(heard));
            let word = ValueDomain::Integer { low: 0, high: i64::MAX };
            let meaning =
                "the last word of each of them (its low 63 bits); 0 where there are no more";
            spaces.push(ValueSpace::new("heard_word", word, meaning).with_shape(heard));
        }
        spaces
    }

    /// Returns the spaces of what a planner knows beyond what the robot itself perceives.
    fn planner_observation_spaces(&self, orders: TeamOrders) -> Vec<ValueSpace> {
        let longest_side = self.map.width().max(self.map.height());
        let boxes = ValueDomain::Integer { low: -1, high: i64::from(longest_side) - 1 };
        let cycles = ValueDomain::Integer { low: 0, high: i64::from(u32::MAX) };
        let goal = "column and row where it has to go next; -1 for one with no goal";
        let steps = ValueDomain::Integer { low: -1, high: i64::from(u32::MAX) };
        let to_goal =
            "boxes of the shortest path to its goal past walls; -1 where none leads there";
        let by_one = ValueDomain::Integer { low: -1, high: 1 };
        let nearer = "steps by which the box ahead, to the left, behind and to the right is nearer to its goal; 0 where it \
                      does not fit";
        let busy = "cycles of delay, and of an action that goes on, before it can act";
        let mut spaces = vec![
            ValueSpace::new("goal_boxes", boxes, goal).with_shape([2]),
            ValueSpace::new("goal_steps", steps, to_goal),
            ValueSpace::new("goal_nearer", by_one, nearer).with_shape([4]),
            ValueSpace::new("busy_cycles", cycles, busy),
        ];
        if let TeamOrders::Plans { actions } = orders {
            let left = ValueDomain::Integer { low: 0, high: i64::from(actions) };
            let meaning = "actions of its plan that it has yet to do; 0 for all where a plan is over or given up";
            spaces.push(ValueSpace::new("plan_left", left, meaning));
        }
        spaces
    }

    fn max_heard(&self) -> usize {
        self.robots.len().saturating_sub(1).min(MAX_HEARD)
    }

    /// Returns the spaces of a robot's orders.
    fn action_spaces(&self, model: &RobotModel) -> Vec<ValueSpace> {
        let actions = ValueDomain::Discrete(model.body.effector.actions.clone());
        match model.team_orders {
            Some(TeamOrders::Actions) => {
                return vec![ValueSpace::new(
                    External::ACTION,
                    actions,
                    "the action that it tries",
                )];
            }
            Some(TeamOrders::Plans { actions: length }) => {
                let standard = choice(STANDARD_ACTIONS);
                let meaning = "its actions in the plan of its team, from its next turn on";
                return vec![
                    ValueSpace::new(PLAN, standard, meaning).with_shape([length as usize]),
                ];
            }
            None => {}
        }
        let trip = choice(["none", "begun", "done"]);
        let mut spaces = vec![
            ValueSpace::new(External::ACTION, actions, "the action that it tries"),
            ValueSpace::new(External::TRIP, trip, "a mark on its way: trips are counted and timed"),
        ];
        if self.radio.is_some() {
            let word = ValueDomain::Integer { low: 0, high: ValueSpace::MAX_INTEGER };
            let meaning = "the word that others in range hear from the next cycle on";
            spaces.push(ValueSpace::new(External::BROADCAST, word, meaning));
        }
        spaces
    }

    /// Records an order in the memory of its robot.
    pub(super) fn record_order(&self, state: &RobotsState, order: &Order<'_>) {
        let memory = &state.body(order.agent).memory;
        let Role::Robot(model) = &self.type_of(order.agent).role else { return };
        match (model.team_orders, order.values) {
            (Some(TeamOrders::Plans { .. }), values) => {
                let Some((team, robot)) = place_in_team(self, order.agent) else { return };
                let actions = values.iter().map(|&value| action_of_order(value as u8)).collect();
                state.planner_teams[team].order_plan(robot, actions);
            }
            (Some(TeamOrders::Actions), &[value]) => {
                self.order_action(state, order.agent, value as ActionId);
            }
            (None, &[value]) => {
                let space = &self.teams.as_slice()[order.team].action_spaces[order.space];
                External::record_order(memory, &space.name, value as u64);
            }
            _ => {}
        }
    }

    /// Records an action that a caller orders for a robot of a team: for the robot itself, or where robots report, for the
    /// planner, which hands it out when it believes that the robot can act.
    fn order_action(&self, state: &RobotsState, id: EntityId, action: ActionId) {
        let team = place_in_team(self, id);
        let reporting = team.filter(|&(team, _)| self.planner_teams[team].leader.reports.is_some());
        match reporting {
            Some((team, robot)) => state.planner_teams[team].order_action(robot, action),
            None => Avoidance::order(&state.body(id).memory, action),
        }
    }

    /// Writes the percepts of a team.
    pub(super) fn observe(
        &self,
        state: &RobotsState,
        now: Cycle,
        team: usize,
        buffers: &mut [BufferMut<'_>],
    ) {
        state.release_boxes(self);
        let scratch = &mut self.new_scratch();
        with_cycle!(self, state, now, |cycle| {
            for (row, &id) in self.teams.as_slice()[team].agents.iter().enumerate() {
                cycle.observe(id, row, scratch, buffers);
            }
        });
        self.observe_goals(state, now, team, buffers);
    }

    /// Writes what a planner knows of a team that it leads from outside: goals and who is busy into the last buffers, and
    /// where robots report, what it believes over their own places, headings, contacts and turns.
    fn observe_goals(
        &self,
        state: &RobotsState,
        now: Cycle,
        team: usize,
        buffers: &mut [BufferMut<'_>],
    ) {
        let agents = &self.teams.as_slice()[team].agents;
        let first = agents.first().map(|&id| &self.type_of(id).role);
        let Some(Role::Robot(model)) = first.filter(|_| !buffers.is_empty()) else { return };
        let Some(orders) = model.team_orders else { return };
        let (_, others) = buffers.split_at_mut(2 * model.body.sensors.len());
        let count = self.planner_observation_spaces(orders).len();
        let Some(split) = others.len().checked_sub(count) else { return };
        let (percepts, of_planner) = others.split_at_mut(split);
        let [goals, goal_steps, goal_nearer, busy, plan_left @ ..] = of_planner else { return };
        let teams = self.planner_teams.iter().zip(&state.planner_teams);
        // Robots of one section are all in one team, but a team may have several sections.
        let shown = teams.filter(|(team, _)| agents.binary_search(&team.robots.start).is_ok());
        for (team, team_state) in shown {
            let known = self.situation_ahead(state, team, team_state, now);
            let mut busy_cycles = vec![0; known.poses.len()];
            for one in &known.busy {
                busy_cycles[one.agent as usize] = one.delay_steps + one.steps_left;
            }
            for (robot, id) in team.robots.clone().enumerate() {
                let Ok(row) = agents.binary_search(&id) else { continue };
                let goal = known.goals[robot];
                set_boxes(
                    goals,
                    row,
                    goal.map_or([-1; 2], |(col, row)| [i64::from(col), i64::from(row)]),
                );
                let (steps, nearer) = team.steps_to(known.poses[robot], goal);
                goal_steps.set_integer(row, steps);
                for (side, by) in nearer.into_iter().enumerate() {
                    goal_nearer.set_integer(4 * row + side, by);
                }
                busy.set_integer(row, i64::from(busy_cycles[robot]));
                for left in plan_left.iter_mut() {
                    left.set_integer(row, known.actions_left[robot] as i64);
                }
                if team.leader.reports.is_some() {
                    let GridPose { col, row: map_row, heading } = known.poses[robot];
                    set_boxes(&mut percepts[2], row, [col, map_row].map(i64::from));
                    percepts[3].set_integer(row, i64::from(heading));
                    let is_due = self.bodies[id as usize].is_due(now) && busy_cycles[robot] == 0;
                    percepts[4].set_integer(row, i64::from(is_due));
                    // What it ran against, it tells in a report.
                    if !known.is_known[robot] {
                        percepts[0].set_integer(row, 0);
                        percepts[1].set_integer(row, 0);
                    }
                }
            }
        }
    }
}

/// Writes a column and a row of the map into a row of a buffer.
fn set_boxes(buffer: &mut BufferMut<'_>, row: usize, [col, map_row]: [i64; 2]) {
    buffer.set_integer(2 * row, col);
    buffer.set_integer(2 * row + 1, map_row);
}

impl<T: OccupantWord> CycleContext<'_, T> {
    /// Writes a robot's percept into its row of each buffer, in the order of the spaces.
    fn observe(
        &self,
        id: EntityId,
        row: usize,
        scratch: &mut Scratch,
        buffers: &mut [BufferMut<'_>],
    ) {
        let slot = self.state.slot_of_id[id as usize];
        let body = self.body(slot);
        let Role::Robot(model) = &self.type_of(body).role else { return };
        self.sense(model, body, scratch);
        let (of_sensors, others) = buffers.split_at_mut(2 * model.body.sensors.len());
        let mut readings = scratch.readings.iter();
        for (sensor, pair) in model.body.sensors.iter().zip(of_sensors.as_chunks_mut().0) {
            let beams = sensor.ends.len();
            let [reports, classes]: &mut [BufferMut<'_>; 2] = pair;
            for (k, reading) in readings.by_ref().take(beams).enumerate() {
                reports.set_integer(row * beams + k, i64::from(reading.observation));
                classes.set_integer(row * beams + k, i64::from(reading.class));
            }
        }
        let contact = body.contact.get().get();
        let (col, map_row) = self.world.map_position(body.position());
        let is_due = self.is_turn(body);
        // 0 is no contact.
        others[0].set_integer(row, contact.map_or(0, |contact| i64::from(contact.kind) + 1));
        others[1].set_integer(row, contact.map_or(0, |contact| contact.side as i64 + 1));
        set_boxes(&mut others[2], row, [col, map_row].map(i64::from));
        others[3].set_integer(row, i64::from(body.facing.get().heading()));
        others[4].set_integer(row, i64::from(is_due));
        if let Some(radio) = &self.world.radio {
            scratch.heard.clear();
            self.listen(radio, slot, &mut scratch.heard);
            let max_heard = self.world.max_heard();
            for k in 0..max_heard {
                let heard = scratch.heard.get(k);
                let sender = heard.map_or(-1, |heard| heard.sender.into());
                others[5].set_integer(row * max_heard + k, sender);
                let word = heard.map_or(0, |heard| heard.word);
                others[6].set_integer(row * max_heard + k, (word & i64::MAX as u64) as i64);
            }
        }
    }
}
