//! Robots that wait for each other in a circle.
//!
//! A robot waits where every step that would bring it nearer to its goal meets a body. Robots in a jam stray, so a
//! circle is rarely whole at one look: what counts are all looks since a robot came nearer. A robot that at each of
//! them had a step on which only others stood, which are not stalled, may go on, and is taken out, until none is left
//! that may. In what remains each robot has, for every step of some look, a robot in its way that remains too.
//! Following these leads into a circle, because there are finitely many. So a queue before a robot that moves, a door
//! or a person is no gridlock, nor is one before a robot that has arrived.

use crate::effector::HEADINGS;
use crate::progress::Obstruction;
use crate::state::{BodyState, RobotsState};
use crate::world::RobotsWorld;
use sidestep_kernel::EntityId;
use sidestep_kernel::space::{GridPosition, Occupant};
use sidestep_map::planning::FlowField;

/// Boxes of a path within which a robot waits for a body: those that sense others keep away from them.
const MAX_BOXES_AHEAD: usize = 8;

/// A robot that has not come nearer for long, and those that were in its way since then.
pub(super) struct WaitingRobot<'a> {
    pub(super) id: EntityId,
    pub(super) obstructions: &'a [Obstruction],
}

/// Returns the robots of each circle, with those that wait for them, among some robots by rising id.
pub(super) fn find_circles(mut waiting: Vec<WaitingRobot<'_>>) -> Vec<Vec<EntityId>> {
    loop {
        let ids: Vec<EntityId> = waiting.iter().map(|robot| robot.id).collect();
        let remains = |id: &EntityId| ids.binary_search(id).is_ok();
        let before = waiting.len();
        waiting.retain(|robot| robot.obstructions.iter().any(|one| one.is_complete(remains)));
        if waiting.len() == before {
            return connected(&waiting, &ids);
        }
    }
}

/// Returns the first bodies on each path to a robot's goal, by the steps with which these paths begin; none where one
/// of them is free as far as the robot looks ahead, or where no step leads there.
pub(super) fn bodies_in_way(
    world: &RobotsWorld,
    state: &RobotsState,
    body: &BodyState,
    field: &FlowField,
) -> Option<Vec<Vec<EntityId>>> {
    let (col, row) = world.map_position(body.position());
    let leads_nearer =
        |&direction: &u8| field.rise(col, row, direction).is_some_and(|rise| rise < 0);
    let mut in_way = Vec::new();
    for direction in (0..4).filter(leads_nearer) {
        let bodies = first_bodies_on_path(world, state, (body, field), direction);
        if bodies.is_empty() {
            return None;
        }
        in_way.push(bodies);
    }
    (!in_way.is_empty()).then_some(in_way)
}

/// Returns the other bodies in the first boxes on a robot's path to its goal that are not free.
fn first_bodies_on_path(
    world: &RobotsWorld,
    state: &RobotsState,
    (body, field): (&BodyState, &FlowField),
    first_direction: u8,
) -> Vec<EntityId> {
    let mut position = body.position();
    let mut next = Some(first_direction);
    for _ in 0..MAX_BOXES_AHEAD {
        let Some(direction) = next else { break };
        let (east, north) = HEADINGS[usize::from(direction)];
        position = position.translate(east, north);
        let bodies = bodies_at(world, state, body, position);
        if !bodies.is_empty() {
            return bodies;
        }
        let (col, row) = world.map_position(position);
        next = field.direction(col, row);
    }
    Vec::new()
}

/// Returns the other bodies in the boxes that a robot would cover at a place.
fn bodies_at(
    world: &RobotsWorld,
    state: &RobotsState,
    body: &BodyState,
    position: GridPosition,
) -> Vec<EntityId> {
    let base = position.row_major_index(world.stride);
    let mut bodies = Vec::new();
    for &offset in &world.type_of(body.id).own {
        let index = base.wrapping_add_signed(offset) as usize;
        if let Occupant::Body(slot) = state.floor.occupant(index) {
            let id = state.bodies[slot as usize].id;
            if id != body.id && !bodies.contains(&id) {
                bodies.push(id);
            }
        }
    }
    bodies
}

/// Returns the connected parts of robots of which each waited for some others of them, by their lowest ids.
fn connected(waiting: &[WaitingRobot<'_>], ids: &[EntityId]) -> Vec<Vec<EntityId>> {
    let remains = |id: &EntityId| ids.binary_search(id).is_ok();
    let mut part: Vec<usize> = (0..waiting.len()).collect();
    for (place, robot) in waiting.iter().enumerate() {
        let complete = robot.obstructions.iter().filter(|one| one.is_complete(remains));
        for other in complete.flat_map(|one| one.steps.iter().flatten()) {
            if let Ok(other) = ids.binary_search(other) {
                let roots = [root(&mut part, place), root(&mut part, other)];
                // The lowest place is the root, whatever the order.
                part[roots[0].max(roots[1])] = roots[0].min(roots[1]);
            }
        }
    }
    let mut parts: Vec<Vec<EntityId>> = vec![Vec::new(); waiting.len()];
    for (place, &id) in ids.iter().enumerate() {
        parts[root(&mut part, place)].push(id);
    }
    parts.retain(|part| !part.is_empty());
    parts
}

fn root(part: &mut [usize], mut place: usize) -> usize {
    while part[place] != place {
        part[place] = part[part[place]];
        place = part[place];
    }
    place
}
