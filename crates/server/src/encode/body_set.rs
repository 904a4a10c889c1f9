//! Body tables: the bodies that the columns of frames stand for.

use super::{CONDITIONS, convert};
use crate::protocol::{Appearance, BodyTable, SessionId};
use sidestep_kernel::view::{BODY_COLORS, Body, BodyKind, Shape};
use std::collections::BTreeMap;

/// The part of a body that stays the same as long as the body table does.
#[derive(PartialEq)]
struct BodyIdentity {
    kind: BodyKind,
    number: u32,
    part: Option<u32>,
    /// Moving obstacles look different from those at rest.
    moves: bool,
    shape: u32,
}

impl BodyIdentity {
    /// Returns what decides the appearance of a body: its kind, its color's index, and whether it is moved.
    fn appearance_group(&self) -> (BodyKind, usize, bool) {
        (self.kind, self.number as usize % BODY_COLORS.len(), self.moves)
    }
}

/// The bodies of a body table, in the order of the frames.
pub(super) struct BodySet {
    members: Vec<BodyIdentity>,
    /// All different shapes, those of lines without their points.
    shapes: Vec<Shape>,
    forms: Vec<ShapeKey>,
    /// Whether everything lies in a plane, where heights are not seen: a door that opens there stays the same body.
    is_flat: bool,
}

/// A shape in a form that can be sorted: its kind and its measures as bits, without the points of a line. Those
/// change in every frame, and frames have them; a change of the key would send a new body table.
type ShapeKey = (u8, [u64; 3]);

impl BodySet {
    /// Returns the set of the bodies of a frame; those of one shape share it, because tables of thousands of bodies
    /// have few.
    pub(super) fn from_bodies(bodies: &[Body], dimensions: u8) -> Self {
        let is_flat = dimensions == 2;
        let members = Vec::with_capacity(bodies.len());
        let mut body_set = Self { members, shapes: Vec::new(), forms: Vec::new(), is_flat };
        let mut known = BTreeMap::new();
        for body in bodies {
            let form = shape_key(&body.shape, is_flat);
            let shape = *known.entry(form).or_insert_with(|| {
                body_set.shapes.push(without_points(&body.shape));
                body_set.forms.push(form);
                body_set.forms.len() as u32 - 1
            });
            let &Body { kind, number, part, .. } = body;
            body_set.members.push(BodyIdentity {
                kind,
                number,
                part,
                moves: is_moved_obstacle(body),
                shape,
            });
        }
        body_set
    }

    /// Returns whether the given bodies are its own, in their order, with the same shapes.
    pub(super) fn matches(&self, bodies: &[Body]) -> bool {
        self.members.len() == bodies.len()
            && self.members.iter().zip(bodies).all(|(member, body)| self.is_same_body(member, body))
    }

    /// Returns whether a body has the identity and the shape of a member: if all do, the page's table still holds.
    fn is_same_body(&self, member: &BodyIdentity, body: &Body) -> bool {
        member.kind == body.kind
            && member.number == body.number
            && member.part == body.part
            && member.moves == is_moved_obstacle(body)
            && self.forms[member.shape as usize] == shape_key(&body.shape, self.is_flat)
    }

    /// Returns its table, as the page gets it.
    pub(super) fn to_table(
        &self,
        session: SessionId,
        id: u32,
        bodies: &[Body],
        names: &BTreeMap<(BodyKind, u32), String>,
    ) -> BodyTable {
        let (kinds, kind) = index_distinct(self.members.iter().map(|member| member.kind));
        let (groups, appearance) =
            index_distinct(self.members.iter().map(BodyIdentity::appearance_group));
        let dimensions = if self.is_flat { 2 } else { 3 };
        let mut group_appearances = Vec::new();
        for group in &groups {
            // All bodies of a group look alike, so the first one stands for them.
            let first = self.members.iter().position(|member| member.appearance_group() == *group);
            group_appearances
                .extend(first.map(|k| appearance_per_condition(&bodies[k], dimensions)));
        }
        let mut own_names = Vec::new();
        for (index, member) in (0..).zip(&self.members) {
            if let Some(name) = names.get(&(member.kind, member.number)) {
                own_names.push((index, name.clone()));
            }
        }
        BodyTable {
            session,
            id,
            kinds: kinds.iter().map(|kind| kind.name().into()).collect(),
            kind: kind.iter().map(|&kind| kind as u8).collect(),
            number: self.members.iter().map(|member| member.number).collect(),
            part: self.members.iter().map(|m| m.part.map_or(-1, |part| part as i32)).collect(),
            shapes: self.shapes.iter().map(convert::shape).collect(),
            shape: self.members.iter().map(|member| member.shape).collect(),
            appearances: group_appearances,
            appearance,
            names: own_names,
            is_agent: self.members.iter().map(|member| member.kind.is_agent()).collect(),
        }
    }
}

/// Returns whether a body is an obstacle that moves. The velocities of traffic are in the frames: they change no table.
fn is_moved_obstacle(body: &Body) -> bool {
    body.kind == BodyKind::OBSTACLE && body.is_moving()
}

/// Returns all different items in the order in which they first occur, and the number of each item among them.
fn index_distinct<T: Ord + Copy>(items: impl Iterator<Item = T>) -> (Vec<T>, Vec<u16>) {
    let mut distinct = Vec::new();
    let mut numbers = Vec::new();
    let mut number_of = BTreeMap::new();
    for item in items {
        let number = *number_of.entry(item).or_insert_with(|| {
            distinct.push(item);
            distinct.len() as u16 - 1
        });
        numbers.push(number);
    }
    (distinct, numbers)
}

/// Returns the appearance of a body in each condition, because conditions change from frame to frame.
fn appearance_per_condition(body: &Body, dimensions: u8) -> [Appearance; 5] {
    CONDITIONS.map(|state| convert::appearance(&Body { state, ..body.clone() }, dimensions))
}

fn without_points(shape: &Shape) -> Shape {
    match shape {
        Shape::Line { thickness_m, .. } => {
            Shape::Line { points_m: Vec::new(), thickness_m: *thickness_m }
        }
        other => other.clone(),
    }
}

fn shape_key(shape: &Shape, is_flat: bool) -> ShapeKey {
    let height = if is_flat { 0.0 } else { 1.0 };
    let (kind, sizes_m) = match *shape {
        Shape::Cuboid { size_m: [x, y, z] } => (0, [x, y, height * z]),
        Shape::Cylinder { radius_m, height_m } => (1, [radius_m, height * height_m, 0.0]),
        Shape::Sphere { radius_m } => (2, [radius_m, 0.0, 0.0]),
        Shape::Line { thickness_m, .. } => (3, [thickness_m, 0.0, 0.0]),
        Shape::Dart { length_m, width_m } => (4, [length_m, width_m, 0.0]),
    };
    (kind, sizes_m.map(f64::to_bits))
}
