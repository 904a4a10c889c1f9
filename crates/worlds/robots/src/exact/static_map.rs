//! The part of a scenario that a chain needs: one robot, and everything else at rest.

use super::obstacle::GridPose;
use crate::effector::{ActionId, Transition};
use crate::scenario::Compiled;
use crate::sensor::{FREE, WALL};
use crate::world::{Body, Door, RobotBody, RobotModel, Role};
use sidestep_kernel::distr::Bernoulli;
use sidestep_kernel::{EntityId, InputError};
use sidestep_map::{Cell, GridMap};
use std::collections::BTreeMap;
use std::sync::Arc;

/// The map with its closed doors.
#[derive(Debug, Clone)]
pub(super) struct StaticMap {
    pub(super) map: Arc<GridMap>,
    doors: BTreeMap<(i32, i32), u8>,
}

/// The one robot.
#[derive(Debug, Clone)]
pub(super) struct Robot {
    pub(super) start: GridPose,
    pub(super) size: u32,
    /// The cycles in which it acts.
    pub(super) timing: Body,
    /// Sensors, and the names of the actions.
    pub(super) body: Arc<RobotBody>,
    /// Transitions of each action in free space, in the scenario's regime.
    pub(super) actions: Vec<Vec<Transition>>,
}

impl StaticMap {
    /// Returns the kind of a box's occupant; there are walls all around the map.
    pub(super) fn kind_at(&self, col: i32, row: i32) -> u8 {
        let (Ok(c), Ok(r)) = (u32::try_from(col), u32::try_from(row)) else { return WALL };
        if c >= self.map.width() || r >= self.map.height() || self.map.cell(c, r) != Cell::Free {
            return WALL;
        }
        self.doors.get(&(col, row)).copied().unwrap_or(FREE)
    }
}

/// Returns the name of the scenario in errors.
pub(super) fn source_name(compiled: &Compiled) -> String {
    if compiled.name.is_empty() {
        "the scenario".into()
    } else {
        format!("scenario `{}`", compiled.name)
    }
}

/// Takes a scenario apart, and refuses one that is not a chain over one robot's poses.
pub(super) fn single_robot(compiled: &Compiled) -> Result<(StaticMap, Robot), InputError> {
    let world = &compiled.world;
    let refuse =
        |cause: String, remedy: &str| Err(InputError::new(source_name(compiled), cause, remedy));
    let mut doors = BTreeMap::new();
    let mut robots = Vec::new();
    for &body in &world.bodies {
        let ty = &world.types[usize::from(body.ty)];
        match &ty.role {
            Role::Robot(model) => robots.push((body, model, ty.size.0)),
            Role::Mover(_) => {
                let kind = &world.kinds[usize::from(ty.kind)];
                let cause = format!("body {} (kind `{kind}`) moves by itself", body.id);
                return refuse(cause, "leave out [people]: a chain has one moving body");
            }
            Role::Door(door) if is_always_closed(door) => {
                doors.extend(covered_boxes(compiled, body.id).map(|at| (at, ty.kind)));
            }
            Role::Door(_) => {
                return refuse(
                    format!("door {} opens", body.id),
                    "keep doors closed with periodic = { open = 0, closed = 1 }, or leave out [doors]",
                );
            }
        }
    }
    let building = StaticMap { map: Arc::clone(&world.map), doors };
    match robots[..] {
        [(body, model, size)] => Ok((building, robot(compiled, body, model, size))),
        _ => refuse(
            format!("{} robots", robots.len()),
            "give one robot: [robots] with count = 1, or --set robots.count=1",
        ),
    }
}

fn is_always_closed(door: &Door) -> bool {
    match *door {
        Door::Periodic { open, .. } => open == 0,
        Door::Random { open, .. } => open == Bernoulli::new(0.0),
    }
}

/// Returns the boxes that a body covers at the start.
fn covered_boxes(compiled: &Compiled, id: EntityId) -> impl Iterator<Item = (i32, i32)> {
    let (width, height) = compiled.world.type_of(id).size;
    let ((col, row), _) = compiled.start[id as usize];
    let boxes = (row..row + height).flat_map(move |r| (col..col + width).map(move |c| (c, r)));
    boxes.map(|(c, r)| (c as i32, r as i32))
}

fn robot(compiled: &Compiled, timing: Body, model: &RobotModel, size: u32) -> Robot {
    let ((col, row), heading) = compiled.start[timing.id as usize];
    let start = GridPose { col: col as i32, row: row as i32, heading };
    let (body, reliable) = (&model.body, compiled.world.regime.has_reliable_effectors());
    let ids = 0..body.effector.actions.len() as ActionId;
    let actions = ids.map(|action| body.effector.transitions_of(action, reliable)).collect();
    Robot { start, size, timing, actions, body: Arc::clone(body) }
}
