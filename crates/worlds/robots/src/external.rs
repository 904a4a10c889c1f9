//! Robots as a caller sees them: their observations, and the orders for those that are decided from
//! outside.

use super::Scratch;
use super::cycle_context::{CycleContext, with_scene};
use super::decide::External;
use super::effector::{HEADING_NAMES, Side};
use super::state::RobotsState;
use super::world::{BodyType, RobotModel, RobotsWorld, Role};
use sidestep_kernel::control::{BufferMut, Order, Space, SpaceKind, Team, Teams};
use sidestep_kernel::space::BoxWord;
use sidestep_kernel::{Cycle, EntityId, Phases, World};
use std::sync::Arc;

#[cfg(test)]
mod tests;

/// Most words of others that one robot observes: those of the first senders by id.
const MAX_HEARD: usize = 64;

impl RobotsWorld {
    /// Returns the teams: robots of one kind that have one body, and decide themselves or do not.
    pub(super) fn find_teams(&self) -> Teams {
        let mut alike: Vec<(&BodyType, &RobotModel, Vec<EntityId>)> = Vec::new();
        for &id in &self.robots {
            let ty = self.type_of(id);
            let Role::Robot(model) = &ty.role else { continue };
            let is_same = |(other, its, _): &&mut (&BodyType, &RobotModel, Vec<EntityId>)| {
                other.kind == ty.kind
                    && Arc::ptr_eq(&its.body, &model.body)
                    && its.is_external == model.is_external
            };
            match alike.iter_mut().rev().find(is_same) {
                Some((.., agents)) => agents.push(id),
                None => alike.push((ty, model, vec![id])),
            }
        }
        let team = |(ty, model, agents): (&BodyType, &RobotModel, Vec<EntityId>)| {
            let ordered = if model.is_external { self.action_spaces(model) } else { Vec::new() };
            let name = self.kinds[usize::from(ty.kind)].clone();
            Team {
                name,
                agents,
                observation_spaces: self.observation_spaces(model),
                action_spaces: ordered,
            }
        };
        Teams::new(alike.into_iter().map(team).collect(), Self::AGENT)
    }

    /// Returns the spaces of a robot's percept, in the order in which [`Self::observe`] writes them.
    fn observation_spaces(&self, model: &RobotModel) -> Vec<Space> {
        let mut spaces = Vec::new();
        for (k, sensor) in model.body.sensors.iter().enumerate() {
            let model = &sensor.model;
            let name = match k {
                0 => model.name.clone(),
                k => format!("{}_{}", model.name, k + 1),
            };
            let beams = [model.bearings_deg.len()];
            let reports = SpaceKind::Discrete(model.observations.clone());
            let meaning = format!("what each beam of sensor `{}` reports", model.name);
            spaces.push(Space::new(format!("{name}_report"), reports, meaning).with_shape(beams));
            let beyond = std::iter::once("beyond".to_string());
            let classes = model.distance_classes.iter().cloned().chain(beyond).collect();
            let meaning = format!("the distance class that each beam of `{}` reports", model.name);
            spaces.push(
                Space::new(format!("{name}_class"), SpaceKind::Discrete(classes), meaning)
                    .with_shape(beams),
            );
        }
        spaces.extend(self.common_observation_spaces());
        spaces
    }

    /// Returns the spaces that robots perceive without sensors.
    fn common_observation_spaces(&self) -> Vec<Space> {
        let none = || std::iter::once("none".to_string());
        let kinds = none().chain(self.kinds.iter().cloned()).collect();
        let sides = none().chain(Side::ALL.iter().map(|side| side.name().to_string())).collect();
        let names =
            |names: &[&str]| SpaceKind::Discrete(names.iter().map(|n| (*n).into()).collect());
        let (width, height) = (self.map.width(), self.map.height());
        let boxes = SpaceKind::Integer { low: 0, high: i64::from(width.max(height)) - 1 };
        let mut spaces = vec![
            Space::new(
                "contact",
                SpaceKind::Discrete(kinds),
                "kind of what stopped its last action",
            ),
            Space::new("contact_side", SpaceKind::Discrete(sides), "its side that touched that"),
            Space::new("at_boxes", boxes, "column and row of its lower-left box").with_shape([2]),
            Space::new("heading", names(&HEADING_NAMES), "where it looks"),
            Space::new("due", names(&["no", "yes"]), "whether it acts in the next cycle"),
        ];
        if self.radio.is_some() {
            let heard = [self.max_heard()];
            let most = self.bodies.len() as i64 - 1;
            let from = SpaceKind::Integer { low: -1, high: most };
            let meaning = "ids of those whose word it hears, rising; -1 where there are no more";
            spaces.push(Space::new("heard_from", from, meaning).with_shape(heard));
            let word = SpaceKind::Integer { low: 0, high: i64::MAX };
            let meaning =
                "the last word of each of them (its low 63 bits); 0 where there are no more";
            spaces.push(Space::new("heard_word", word, meaning).with_shape(heard));
        }
        spaces
    }

    fn max_heard(&self) -> usize {
        self.robots.len().saturating_sub(1).min(MAX_HEARD)
    }

    /// Returns the spaces of a robot's orders.
    fn action_spaces(&self, model: &RobotModel) -> Vec<Space> {
        let actions = SpaceKind::Discrete(model.body.effector.actions.clone());
        let trip = SpaceKind::Discrete(["none", "begun", "done"].map(String::from).into());
        let mut spaces = vec![
            Space::new(External::ACTION, actions, "the action that it tries"),
            Space::new(External::TRIP, trip, "a mark on its way: trips are counted and timed"),
        ];
        if self.radio.is_some() {
            let word = SpaceKind::Integer { low: 0, high: Space::MAX_INTEGER };
            let meaning = "the word that others in range hear from the next cycle on";
            spaces.push(Space::new(External::BROADCAST, word, meaning));
        }
        spaces
    }

    /// Notes an order in the memory of its robot.
    pub(super) fn record_order(&self, state: &RobotsState, order: &Order<'_>) {
        let [value] = *order.values else { return };
        let space = &self.teams.all()[order.team].action_spaces[order.space];
        External::record_order(&state.body(order.agent).memory, &space.name, value as u64);
    }

    /// Writes the percepts of a team.
    pub(super) fn observe(
        &self,
        state: &RobotsState,
        now: Cycle,
        team: usize,
        room: &mut [BufferMut<'_>],
    ) {
        let scratch = &mut self.scratch();
        with_scene!(self, state, now, |scene| {
            for (row, &id) in self.teams.all()[team].agents.iter().enumerate() {
                scene.observe(id, row, scratch, room);
            }
        });
    }
}

impl<T: BoxWord> CycleContext<'_, T> {
    /// Writes a robot's percept into its row of each room.
    fn observe(&self, id: EntityId, row: usize, scratch: &mut Scratch, room: &mut [BufferMut<'_>]) {
        let slot = self.state.slot_of_id[id as usize];
        let cell = self.cell(slot);
        let Role::Robot(model) = &self.type_of(cell).role else { return };
        self.sense(model, cell, scratch);
        let (of_sensors, others) = room.split_at_mut(2 * model.body.sensors.len());
        let mut readings = scratch.readings.iter();
        for (sensor, pair) in model.body.sensors.iter().zip(of_sensors.as_chunks_mut().0) {
            let beams = sensor.ends.len();
            let [reports, classes]: &mut [BufferMut<'_>; 2] = pair;
            for (k, reading) in readings.by_ref().take(beams).enumerate() {
                reports.set_integer(row * beams + k, i64::from(reading.observation));
                classes.set_integer(row * beams + k, i64::from(reading.class));
            }
        }
        let contact = cell.contact.get().get();
        let (col, line) = self.world.map_position(cell.position());
        let is_due = self.world.bodies[id as usize].is_due(self.now);
        others[0].set_integer(row, contact.map_or(0, |contact| i64::from(contact.kind) + 1));
        others[1].set_integer(row, contact.map_or(0, |contact| contact.side as i64 + 1));
        others[2].set_integer(2 * row, i64::from(col));
        others[2].set_integer(2 * row + 1, i64::from(line));
        others[3].set_integer(row, i64::from(cell.facing.get().heading()));
        others[4].set_integer(row, i64::from(is_due));
        if let Some(radio) = &self.world.radio {
            scratch.heard.clear();
            self.listen(radio, slot, &mut scratch.heard);
            let most = self.world.max_heard();
            for k in 0..most {
                let heard = scratch.heard.get(k);
                others[5]
                    .set_integer(row * most + k, heard.map_or(-1, |heard| heard.sender.into()));
                let word = heard.map_or(0, |heard| heard.word);
                others[6].set_integer(row * most + k, (word & i64::MAX as u64) as i64);
            }
        }
    }
}
