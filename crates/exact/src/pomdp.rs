//! The model as a POMDP in Cassandra's text format, for planners.
//!
//! - A state is a pose, with the contact in which the last action ended (`c3r4-east`,
//!   `c3r4-east-front-wall`).
//! - An observation is that contact, which a robot feels without error, and the reports of some
//!   beams (`free_wall-near`). It is only some, because all beams of a ring together would make too
//!   many observations for any planner.
//! - The reward is 1 for each action that ends at the goal; without a goal, 0 throughout.
//!
//! Format: <https://www.pomdp.org/code/pomdp-file-spec.html>.

mod text;

use crate::model::{MarkovModel, ModelTransition};
use crate::names;
use crate::observe::{Beam, MountedBeam, forward_beam};
use crate::sparse::SparseMatrix;
use serde::Serialize;
use sidestep_error_models::effector::{HEADING_NAMES, Side};
use sidestep_error_models::sensor::Reading;
use sidestep_kernel::InputError;
use std::collections::BTreeMap;

/// The contents of a POMDP to write.
#[derive(Debug, Clone, PartialEq)]
pub struct PomdpOptions {
    /// Discount per action, above 0 and below 1.
    pub discount: f64,
    /// Column and row that the robot's lower-left box is to reach.
    pub goal: Option<(u32, u32)>,
    /// Whether the robot feels its contacts; they become part of the states.
    pub contacts: bool,
    /// The beams with observed readings, at most [`MAX_BEAMS`]; `None` for the one that points most
    /// nearly ahead.
    pub beams: Option<Vec<Beam>>,
}

/// Largest number of beams that are observed together: observations multiply with each beam.
pub const MAX_BEAMS: usize = 3;
/// Largest number of lines of a file: it has several hundred megabytes.
const MAX_LINES: usize = 10_000_000;

impl Default for PomdpOptions {
    fn default() -> Self {
        Self { discount: 0.95, goal: None, contacts: true, beams: None }
    }
}

/// The size of a POMDP, by which a planner's memory and time can be judged.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct PomdpSize {
    /// Number of states: of pairs of a pose and a contact in which an action may end there.
    pub states: usize,
    /// Number of actions, the same in each state.
    pub actions: usize,
    /// Number of observations that can occur in some state.
    pub observations: usize,
    /// Number of entries of the transition matrices above 0.
    pub transitions: usize,
    /// Number of entries of the observation matrix above 0.
    pub readings: usize,
}

/// A POMDP, displayed as a file of Cassandra's format.
#[derive(Debug, Clone)]
pub struct Pomdp {
    place: String,
    discount: f64,
    states: Vec<String>,
    actions: Vec<String>,
    observations: Vec<String>,
    /// Successors, in row `state * actions + action`.
    transitions: SparseMatrix<(u32, f64)>,
    /// Observations, in row `state`.
    readings: SparseMatrix<(u32, f64)>,
    /// States at the goal.
    goals: Vec<u32>,
}

type PomdpContact = Option<(u8, Side)>;
/// A contact and the (observation, class) of each beam.
type Observation = (PomdpContact, Vec<(u8, u8)>);
/// Index of a pose, and the contact in which the last action ended there.
type PomdpState = (u32, PomdpContact);

impl MarkovModel {
    /// Returns the model with its observations, in the form that planners read.
    ///
    /// # Errors
    /// When `options` do not fit the robot, or ask for too much.
    pub fn pomdp(&self, options: &PomdpOptions) -> Result<Pomdp, InputError> {
        Pomdp::new(self, options)
    }
}

impl Pomdp {
    fn new(model: &MarkovModel, options: &PomdpOptions) -> Result<Self, InputError> {
        check_discount(options.discount)?;
        let beams = beams(model, options)?;
        let (states, order) = states(model, options.contacts);
        let transitions = transitions(model, options.contacts, &states, &order);
        check_lines(model, transitions.len())?;
        let (observations, readings) = observation_matrix(model, &beams, &order)?;
        Ok(Self {
            place: model.robot.place.clone(),
            discount: options.discount,
            states: names::valid_names(order.iter().map(|state| state_name(model, state))),
            actions: names::valid_names(model.actions().iter().cloned()),
            observations: names::valid_names(
                observations.iter().map(|o| observation_name(model, &beams, options.contacts, o)),
            ),
            transitions,
            readings,
            goals: goal_states(model, options.goal, &order)?,
        })
    }

    /// Returns its size, without the text being written.
    pub fn size(&self) -> PomdpSize {
        PomdpSize {
            states: self.states.len(),
            actions: self.actions.len(),
            observations: self.observations.len(),
            transitions: self.transitions.len(),
            readings: self.readings.len(),
        }
    }
}

fn check_discount(discount: f64) -> Result<(), InputError> {
    if discount > 0.0 && discount < 1.0 {
        return Ok(());
    }
    let cause = format!("a discount of {discount}");
    Err(InputError::new("--discount", cause, "give a number above 0 and below 1, e.g. 0.95"))
}

fn check_lines(model: &MarkovModel, lines: usize) -> Result<(), InputError> {
    if lines <= MAX_LINES {
        return Ok(());
    }
    let cause = format!("a file of more than {MAX_LINES} lines");
    Err(InputError::new(&model.robot.place, cause, "observe fewer beams, or use a smaller map"))
}

fn beams<'a>(
    model: &'a MarkovModel,
    options: &PomdpOptions,
) -> Result<Vec<MountedBeam<'a>>, InputError> {
    let chosen = match &options.beams {
        Some(beams) => beams.clone(),
        None => forward_beam(model).into_iter().collect(),
    };
    if chosen.len() > MAX_BEAMS {
        let cause = format!("{} beams", chosen.len());
        return Err(InputError::new("--beam", cause, format!("choose at most {MAX_BEAMS}")));
    }
    chosen.iter().map(|beam| MountedBeam::new(model, beam)).collect()
}

/// Returns the number of each state, and the states in that order; the start is the first.
fn states(model: &MarkovModel, contacts: bool) -> (BTreeMap<PomdpState, u32>, Vec<PomdpState>) {
    let start = (0, None);
    let mut numbers = BTreeMap::from([(start, 0)]);
    let mut order = vec![start];
    for arrival in model.outcomes.rows().flatten() {
        let state = state_after(arrival, contacts);
        numbers.entry(state).or_insert_with(|| {
            order.push(state);
            order.len() as u32 - 1
        });
    }
    (numbers, order)
}

fn state_after(arrival: &ModelTransition, contacts: bool) -> PomdpState {
    (arrival.to, arrival.contact.filter(|_| contacts))
}

fn transitions(
    model: &MarkovModel,
    contacts: bool,
    states: &BTreeMap<PomdpState, u32>,
    order: &[PomdpState],
) -> SparseMatrix<(u32, f64)> {
    let mut rows = SparseMatrix::default();
    for &(pose, _) in order {
        for action in 0..model.actions().len() {
            let mut row = BTreeMap::new();
            for arrival in model.model_transitions(pose as usize, action) {
                let to = states[&state_after(arrival, contacts)];
                *row.entry(to).or_insert(0.0) += arrival.p;
            }
            rows.push(row);
        }
    }
    rows
}

/// The observations that occur, and each state's distribution over them.
type ObservationMatrix = (Vec<Observation>, SparseMatrix<(u32, f64)>);

fn observation_matrix(
    model: &MarkovModel,
    beams: &[MountedBeam<'_>],
    order: &[PomdpState],
) -> Result<ObservationMatrix, InputError> {
    let mut numbers: BTreeMap<Observation, u32> = BTreeMap::new();
    let mut rows = SparseMatrix::default();
    for &(pose, contact) in order {
        let row = joint_readings(model, beams, pose);
        check_lines(model, rows.len() + row.len())?;
        let mut numbered = Vec::with_capacity(row.len());
        for (readings, p) in row {
            let new = numbers.len() as u32;
            numbered.push((*numbers.entry((contact, readings)).or_insert(new), p));
        }
        rows.push(numbered);
    }
    let mut observations: Vec<(Observation, u32)> = numbers.into_iter().collect();
    observations.sort_by_key(|o| o.1);
    Ok((observations.into_iter().map(|o| o.0).collect(), rows))
}

/// Returns the readings of all beams at a pose: a product, because they are independent given the
/// pose.
fn joint_readings(
    model: &MarkovModel,
    beams: &[MountedBeam<'_>],
    pose: u32,
) -> Vec<(Vec<(u8, u8)>, f64)> {
    let pose = model.poses[pose as usize];
    let mut joint = vec![(Vec::new(), 1.0)];
    for beam in beams {
        let readings = beam.readings(&model.robot, pose);
        let mut extended = Vec::with_capacity(joint.len() * readings.len());
        for (before, p) in &joint {
            for (reading, q) in &readings {
                let mut all = before.clone();
                all.push((reading.observation, reading.class));
                extended.push((all, p * q));
            }
        }
        joint = extended;
    }
    joint
}

fn goal_states(
    model: &MarkovModel,
    goal: Option<(u32, u32)>,
    order: &[PomdpState],
) -> Result<Vec<u32>, InputError> {
    let Some((col, row)) = goal else { return Ok(Vec::new()) };
    let mut states = Vec::new();
    for (number, (pose, _)) in order.iter().enumerate() {
        let pose = model.poses[*pose as usize];
        if i64::from(pose.col) == i64::from(col) && i64::from(pose.row) == i64::from(row) {
            states.push(number as u32);
        }
    }
    if states.is_empty() {
        let cause = format!("the robot never reaches [{col}, {row}]");
        let remedy = "name a free box that its lower-left box can come to";
        return Err(InputError::new("--goal", cause, remedy));
    }
    Ok(states)
}

fn state_name(model: &MarkovModel, state: &PomdpState) -> String {
    let &(pose, contact) = state;
    let pose = model.poses[pose as usize];
    let heading = HEADING_NAMES[usize::from(pose.heading)];
    let place = format!("c{}r{}-{heading}", pose.col, pose.row);
    match contact {
        Some((kind, side)) => format!("{place}-{}", contact_name(model, kind, side)),
        None => place,
    }
}

fn contact_name(model: &MarkovModel, kind: u8, side: Side) -> String {
    format!("{}-{}", side.name(), model.robot.kinds[usize::from(kind)])
}

fn observation_name(
    model: &MarkovModel,
    beams: &[MountedBeam<'_>],
    contacts: bool,
    observation: &Observation,
) -> String {
    let (contact, readings) = observation;
    let mut parts = Vec::new();
    if contacts {
        parts.push(match *contact {
            Some((kind, side)) => contact_name(model, kind, side),
            None => "free".to_string(),
        });
    }
    for (&(observation, class), beam) in readings.iter().zip(beams) {
        let (seen, class) = beam.sensor.names_of(Reading { observation, class });
        // The report `nothing` has no distance.
        let is_nothing = observation == 0;
        parts.push(if is_nothing { seen.to_string() } else { format!("{seen}-{class}") });
    }
    if parts.is_empty() { "nothing".into() } else { parts.join("_") }
}
