//! Casts: the bodies that the columns of frames stand for.

use super::{CONDITIONS, plain};
use crate::protocol::{Cast, Look, SessionId};
use sidestep::kernel::view::{Body, COLORS, Kind, Shape};
use std::collections::BTreeMap;

/// The part of a body that stays the same as long as the cast does.
#[derive(PartialEq)]
struct Member {
    kind: Kind,
    number: u32,
    part: Option<u32>,
    /// Things that are moved look different from those that stand still.
    moves: bool,
    shape: u32,
}

/// The bodies of a cast, in the order of the frames.
pub(super) struct Troupe {
    members: Vec<Member>,
    /// All different shapes, those of lines without their points.
    shapes: Vec<Shape>,
    forms: Vec<Form>,
    /// Whether everything lies in a plane, where heights are not seen: a door that opens there stays the same body.
    is_flat: bool,
}

/// A shape as far as it matters, in a form that can be sorted.
type Form = (u8, [u64; 3]);

impl Troupe {
    /// Returns the troupe of these bodies.
    pub(super) fn of(bodies: &[Body], dimensions: u8) -> Self {
        let is_flat = dimensions == 2;
        let members = Vec::with_capacity(bodies.len());
        let mut troupe = Self { members, shapes: Vec::new(), forms: Vec::new(), is_flat };
        let mut known = BTreeMap::new();
        for body in bodies {
            let form = form(&body.shape, is_flat);
            let shape = *known.entry(form).or_insert_with(|| {
                troupe.shapes.push(without_points(&body.shape));
                troupe.forms.push(form);
                troupe.forms.len() as u32 - 1
            });
            let &Body { kind, number, part, .. } = body;
            troupe.members.push(Member { kind, number, part, moves: body.moves(), shape });
        }
        troupe
    }

    /// Returns whether the given bodies are its own, in their order, with the same shapes.
    pub(super) fn is_of(&self, bodies: &[Body]) -> bool {
        let is_same = |(member, body): (&Member, &Body)| {
            member.kind == body.kind
                && member.number == body.number
                && member.part == body.part
                && member.moves == body.moves()
                && self.forms[member.shape as usize] == form(&body.shape, self.is_flat)
        };
        self.members.len() == bodies.len() && self.members.iter().zip(bodies).all(is_same)
    }

    /// Returns its cast, as the page gets it.
    pub(super) fn cast(
        &self,
        session: SessionId,
        cast: u32,
        bodies: &[Body],
        names: &BTreeMap<(Kind, u32), String>,
    ) -> Cast {
        let (kinds, kind) = numbered(self.members.iter().map(|member| member.kind));
        let group = |m: &Member| (m.kind, m.number as usize % COLORS.len(), m.moves);
        let (groups, look) = numbered(self.members.iter().map(group));
        let first = |of: &_| bodies.iter().zip(&self.members).find(|(_, m)| group(m) == *of);
        let looks = groups
            .iter()
            .filter_map(first)
            .map(|(body, _)| looks(body, if self.is_flat { 2 } else { 3 }));
        let name = |(index, m): (u32, &Member)| {
            names.get(&(m.kind, m.number)).map(|name| (index, name.clone()))
        };
        Cast {
            session,
            cast,
            kinds: kinds.iter().map(|kind| kind.name().into()).collect(),
            kind: kind.iter().map(|&kind| kind as u8).collect(),
            number: self.members.iter().map(|member| member.number).collect(),
            part: self.members.iter().map(|m| m.part.map_or(-1, |part| part as i32)).collect(),
            shapes: self.shapes.iter().map(plain::shape).collect(),
            shape: self.members.iter().map(|member| member.shape).collect(),
            looks: looks.collect(),
            look,
            names: (0..).zip(&self.members).filter_map(name).collect(),
            is_agent: self.members.iter().map(|member| member.kind.is_agent()).collect(),
        }
    }
}

/// Returns all different items in the order in which they first come, and the number of each item among them.
fn numbered<T: Ord + Copy>(items: impl Iterator<Item = T>) -> (Vec<T>, Vec<u16>) {
    let (mut all, mut known) = (Vec::new(), BTreeMap::new());
    let number = |item: T| {
        *known.entry(item).or_insert_with(|| {
            all.push(item);
            all.len() as u16 - 1
        })
    };
    let numbers = items.map(number).collect();
    (all, numbers)
}

/// Returns the look of a body in each condition.
fn looks(body: &Body, dimensions: u8) -> [Look; 5] {
    CONDITIONS.map(|state| plain::look(&Body { state, ..body.clone() }, dimensions))
}

fn without_points(shape: &Shape) -> Shape {
    match shape {
        Shape::Line { thickness_m, .. } => {
            Shape::Line { points_m: Vec::new(), thickness_m: *thickness_m }
        }
        other => other.clone(),
    }
}

fn form(shape: &Shape, is_flat: bool) -> Form {
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
