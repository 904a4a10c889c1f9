//! What a chain follows from: one robot, and everything else at rest.

use crate::obstacle::GridPose;
use sidestep_error_models::effector::{ActionId, EffectorModel, ObstacleRule, Transition};
use sidestep_error_models::sensor::{FREE, SensorModel, WALL};
use sidestep_kernel::InputError;
use sidestep_kernel::distr::check_probability_row;
use sidestep_map::{Cell, GridMap};
use std::collections::BTreeMap;
use std::sync::Arc;

/// A robot alone among walls and closed doors.
#[derive(Debug, Clone)]
pub struct SingleRobot {
    /// Name of the scenario in errors.
    pub place: String,
    /// The map without bodies. There are walls all around it.
    pub map: Arc<GridMap>,
    /// Kind of each box that a closed door covers, by column and row.
    pub doors: BTreeMap<(i32, i32), u8>,
    /// Names of the kinds by number: 0 `free`, 1 `wall`, then those of doors and sensors.
    pub kinds: Vec<String>,
    /// The rule for paths that meet an obstacle.
    pub obstacle_rule: ObstacleRule,
    /// Pose at the start, the first pose of the model.
    pub start: GridPose,
    /// Side of the robot in boxes.
    pub size: u32,
    /// Number of cycles from one action to the next.
    pub period: u32,
    /// The robot acts in the cycles where `(cycle + phase) % period` is 0.
    pub phase: u32,
    /// The sensors, each with an observation for every kind.
    pub sensors: Vec<SensorModel>,
    /// Whether every reading is the truth.
    pub has_reliable_sensors: bool,
    /// The effector, as in free space; obstacles change its transitions by `obstacle_rule`.
    pub effector: EffectorModel,
    /// Whether every action ends as intended.
    pub has_reliable_effector: bool,
}

impl SingleRobot {
    /// Returns a robot of one box that acts in every cycle, without sensors, on a map without doors; paths that meet
    /// a wall are cut.
    pub fn new(map: GridMap, effector: EffectorModel, start: GridPose) -> Self {
        Self {
            place: "the robot".into(),
            map: Arc::new(map),
            doors: BTreeMap::new(),
            kinds: ["free", "wall"].map(String::from).to_vec(),
            obstacle_rule: ObstacleRule::default(),
            start,
            size: 1,
            period: 1,
            phase: 0,
            sensors: Vec::new(),
            has_reliable_sensors: false,
            effector,
            has_reliable_effector: false,
        }
    }

    /// Checks what a scenario's compiler has checked, for robots that are made by hand.
    pub(crate) fn check(&self) -> Result<(), InputError> {
        if self.size == 0 || self.period == 0 {
            let cause =
                format!("a robot of {} boxes that acts every {}th cycle", self.size, self.period);
            let remedy = "give a size and a period of 1 or more";
            return Err(InputError::new(&self.place, cause, remedy));
        }
        for (action, transitions) in self.effector.actions.iter().zip(&self.effector.transitions) {
            let row: Vec<f64> = transitions.iter().map(|transition| transition.p).collect();
            if let Err(error) = check_probability_row(&row) {
                let cause = format!("action `{action}`: {error}");
                let remedy = "make the probabilities `p` of its transitions sum to 1";
                return Err(InputError::new(&self.place, cause, remedy));
            }
        }
        Ok(())
    }

    /// Returns the transitions of each action in free space.
    pub(crate) fn transitions(&self) -> Vec<Vec<Transition>> {
        let effector = &self.effector;
        let ids = 0..effector.actions.len() as ActionId;
        ids.map(|action| effector.transitions_of(action, self.has_reliable_effector)).collect()
    }

    /// Returns the kind of a box's occupant.
    pub(crate) fn kind_at(&self, col: i32, row: i32) -> u8 {
        let (Ok(c), Ok(r)) = (u32::try_from(col), u32::try_from(row)) else { return WALL };
        // As in the world of robots, there are walls all around the map.
        if c >= self.map.width() || r >= self.map.height() || self.map.cell(c, r) != Cell::Free {
            return WALL;
        }
        self.doors.get(&(col, row)).copied().unwrap_or(FREE)
    }
}
