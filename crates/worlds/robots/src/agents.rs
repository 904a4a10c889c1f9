//! Robots outside of a run: what one perceives in a cycle, and the program that decides by it.
//!
//! A percept holds all that a decision depends on, the robot's memory included, so that a robot's program remembers
//! nothing between cycles: another process can go on in its place.

use super::decide::{
    ActionId, Behaviour, Contact, Decision, Memory, Percept, ReceivedMessage, TripEvent,
    nearest_by_sector,
};
use super::effector::STAY;
use super::purpose;
use super::sensor::{NOTHING, Reading};
use super::world::{RobotBody, RobotModel, RobotsWorld, Role};
use serde::{Deserialize, Serialize};
use sidestep_kernel::{Cycle, EntityId};
use std::sync::Arc;

/// Everything that a robot knows when it decides, and its memory.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct RobotPercept {
    /// The robot that perceives it.
    pub id: EntityId,
    /// The cycle in which it decides.
    pub cycle: Cycle,
    /// One reading per beam, the sensors one after the other in the scenario's order.
    pub readings: Vec<Reading>,
    /// The obstacle that stopped the last action, if there was one.
    pub contact: Option<Contact>,
    /// Column and row of the robot's lower-left box.
    pub at: (u32, u32),
    /// Heading: 0 east, 1 north, 2 west, 3 south.
    pub heading: u8,
    /// Last broadcasts of the robots in radio range, by sender.
    pub heard: Vec<ReceivedMessage>,
    /// The words of its memory.
    pub memory: [u32; 4],
}

impl RobotPercept {
    /// Returns a percept with the memory of its robot, for a process elsewhere.
    pub(super) fn new(percept: &Percept<'_>, memory: Memory) -> Self {
        Self {
            id: percept.id,
            cycle: percept.now,
            readings: percept.readings.to_vec(),
            contact: percept.contact,
            at: percept.at,
            heading: percept.heading,
            heard: percept.heard.to_vec(),
            memory: memory.words,
        }
    }
}

/// A robot's decision in a cycle, and its memory after that.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct RobotControl {
    /// The robot that has decided.
    pub id: EntityId,
    /// The cycle for which it has decided.
    pub cycle: Cycle,
    /// The action to try, by its number in the robot's effector.
    pub action: ActionId,
    /// Whether its last action started or completed a trip.
    pub trip: Option<TripEvent>,
    /// Message that others in radio range hear from the next cycle on; `None` keeps the last one.
    pub broadcast: Option<u64>,
    /// The words of its memory.
    pub memory: [u32; 4],
}

impl RobotControl {
    /// Returns its decision, without the memory.
    pub(super) fn decision(&self) -> Decision {
        Decision { action: self.action, trip: self.trip, broadcast: self.broadcast }
    }
}

/// The program of one robot: the behavior that the scenario gives it, outside of a run.
#[derive(Debug, Clone)]
pub struct RobotAgent {
    world: Arc<RobotsWorld>,
    id: EntityId,
}

impl RobotAgent {
    /// Returns the program of a robot; none for another body, and for a robot that follows the orders of a caller.
    pub fn new(world: Arc<RobotsWorld>, id: EntityId) -> Option<Self> {
        let is_agent = world.robot_model(id).is_some_and(|model| !model.is_external);
        is_agent.then_some(Self { world, id })
    }

    /// Returns what a robot that follows the orders of a caller can do by a behavior that its caller has for it; none for
    /// another body.
    pub(super) fn under_orders(world: Arc<RobotsWorld>, id: EntityId) -> Option<Self> {
        world.is_external_robot(id).then_some(Self { world, id })
    }

    /// Returns the id of its robot.
    pub fn id(&self) -> EntityId {
        self.id
    }

    /// Decides by a percept.
    ///
    /// # Errors
    /// When it cannot be one of this robot in this scenario, with the reason.
    pub fn decide(&self, percept: &RobotPercept) -> Result<RobotControl, String> {
        let model = self.world.robot_model(self.id).ok_or("it is of a body that is no robot")?;
        self.decide_by(&*model.behaviour, percept)
    }

    /// Decides by a percept and a behavior.
    ///
    /// # Errors
    /// Those of [`Self::decide`].
    pub(super) fn decide_by(
        &self,
        behaviour: &dyn Behaviour,
        percept: &RobotPercept,
    ) -> Result<RobotControl, String> {
        let model = self.world.robot_model(self.id).ok_or("it is of a body that is no robot")?;
        self.check(model, percept)?;
        let sectors = &model.body.sectors;
        let seen = Percept {
            now: percept.cycle,
            id: self.id,
            readings: &percept.readings,
            sectors,
            nearest_in: nearest_by_sector(&percept.readings, sectors),
            contact: percept.contact,
            at: percept.at,
            heading: percept.heading,
            heard: &percept.heard,
        };
        let mut memory = Memory { words: percept.memory };
        let mut draws = self.world.streams.draws(self.id, percept.cycle, purpose::DECIDE);
        let decision = behaviour.decide(&seen, &mut memory, &mut draws);
        let is_known = usize::from(decision.action) < model.body.effector.actions.len();
        Ok(RobotControl {
            id: self.id,
            cycle: percept.cycle,
            // A behavior of a user, or one with a memory that it has not written, may choose an action that there is not.
            action: if is_known { decision.action } else { STAY },
            trip: decision.trip,
            broadcast: decision.broadcast,
            memory: memory.words,
        })
    }

    /// Checks what behaviors rely on: they index tables by it.
    fn check(&self, model: &RobotModel, percept: &RobotPercept) -> Result<(), String> {
        if percept.id != self.id {
            return Err(format!("it is of robot {}; give that of robot {}", percept.id, self.id));
        }
        check_readings(&model.body, &percept.readings)?;
        let (width, height) = self.world.type_of(self.id).size;
        let map = &self.world.map;
        let (col, row) = percept.at;
        let fits = |first: u32, length: u32, end: u32| {
            first.checked_add(length).is_some_and(|last| last <= end)
        };
        if !fits(col, width, map.width()) || !fits(row, height, map.height()) {
            return Err(format!(
                "it stands at column {col}, row {row}; the map has {} x {} boxes",
                map.width(),
                map.height()
            ));
        }
        if percept.heading > 3 {
            return Err(format!("its heading is {}; give 0 to 3", percept.heading));
        }
        let kinds = self.world.kinds.len();
        if let Some(contact) = percept.contact.filter(|one| usize::from(one.kind) >= kinds) {
            let kind = contact.kind;
            return Err(format!(
                "it touched kind {kind}; the scenario has kinds 0 to {}",
                kinds - 1
            ));
        }
        let robots = self.world.robots.len();
        let is_known = |heard: &ReceivedMessage| (heard.sender as usize) < robots;
        let is_rising = percept.heard.is_sorted_by(|a, b| a.sender < b.sender);
        if !is_rising || !percept.heard.iter().all(is_known) {
            return Err("it hears robots that are not there, or one of them twice".into());
        }
        Ok(())
    }
}

/// Checks that readings are ones that the sensors of a body can have.
fn check_readings(body: &RobotBody, readings: &[Reading]) -> Result<(), String> {
    let beams = body.sectors.len();
    if readings.len() != beams {
        return Err(format!("it has {} readings; give {beams}, one for each beam", readings.len()));
    }
    let mut rest = readings;
    for sensor in &body.sensors {
        let model = &sensor.model;
        let (own, others) = rest.split_at(model.bearings_deg.len());
        rest = others;
        let is_possible = |reading: &Reading| {
            let is_class = usize::from(reading.class) < model.distance_classes.len();
            let is_observation = usize::from(reading.observation) < model.observations.len();
            is_observation && (is_class || reading.observation == NOTHING)
        };
        if let Some(reading) = own.iter().find(|reading| !is_possible(reading)) {
            return Err(format!(
                "sensor `{}` reports observation {} in class {}; it has {} observations and {} classes",
                model.name,
                reading.observation,
                reading.class,
                model.observations.len(),
                model.distance_classes.len()
            ));
        }
    }
    Ok(())
}

impl RobotsWorld {
    /// Returns the model of a robot; none for another body.
    pub(super) fn robot_model(&self, id: EntityId) -> Option<&RobotModel> {
        if id as usize >= self.bodies.len() {
            return None;
        }
        match &self.type_of(id).role {
            Role::Robot(model) => Some(model),
            _ => None,
        }
    }
}
