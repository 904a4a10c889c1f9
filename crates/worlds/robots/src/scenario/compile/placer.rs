//! Places of bodies at the start: those that the scenario gives, and those that a seed draws.

use super::bodies::{BodyGroup, GroupTypes};
use super::*;
use crate::scenario::StartPose;
use crate::team::Team;

/// The part of a scenario on which the places at the start depend: another seed needs nothing else of it.
#[derive(Debug)]
pub(crate) struct Placer {
    pub(super) source: Arc<Source>,
    pub(super) map: Arc<GridMap>,
    pub(super) groups: Vec<BodyGroup>,
    /// Width and height in boxes of each type of bodies.
    pub(super) sizes: Vec<(u32, u32)>,
}

/// Bodies, and their places and facings at the start, by id.
pub(super) struct Placement {
    pub(super) bodies: Vec<Body>,
    pub(super) start: Vec<((u32, u32), u8)>,
}

impl Placer {
    /// Returns the first id of each group: robots, people, doors, in whichever order they are placed.
    pub(super) fn first_ids(&self) -> Vec<EntityId> {
        let mut first_ids = Vec::with_capacity(self.groups.len());
        let mut next = 0;
        for group in &self.groups {
            first_ids.push(next);
            next += group.count as EntityId;
        }
        first_ids
    }

    /// Returns the robots that planners lead, by their teams; the sections of one follow each other.
    pub(super) fn planner_teams(&self) -> Vec<Team> {
        let mut teams: Vec<(usize, Team)> = Vec::new();
        for (group, first) in self.groups.iter().zip(self.first_ids()) {
            let Some(of_group) = group.team.as_ref().filter(|_| group.count > 0) else { continue };
            let end = first + group.count as EntityId;
            match teams.last_mut().filter(|(number, _)| *number == of_group.number) {
                Some((_, team)) => team.robots.end = end,
                None => {
                    let leader = of_group.leader.clone();
                    let tasks = group.tasks.clone();
                    let team = Team { robots: first..end, leader, tasks, goal_distances: None };
                    teams.push((of_group.number, team));
                }
            }
        }
        teams.into_iter().map(|(_, team)| team).collect()
    }

    /// Places all bodies, with the draws of `streams`.
    pub(super) fn place(&self, streams: &Streams) -> Result<Placement, InputError> {
        let n = self.groups.iter().map(|group| group.count as usize).sum();
        let mut builder = PlacementBuilder {
            placer: self,
            streams,
            floor: PlacementGrid::new(&self.map),
            spans: vec![0..0; n],
            bodies: vec![Body { id: 0, ty: 0, period: 1, phase: 0, action_cycles: 1 }; n],
            start: vec![((0, 0), 0); n],
        };
        // Bodies with a given place, as all doors are, come first, because draws must find the free boxes
        // that these leave.
        for is_given in [true, false] {
            for (group, first) in self.groups.iter().zip(self.first_ids()) {
                if group.places.is_empty() != is_given {
                    builder.add_group(group, first)?;
                }
            }
        }
        Ok(Placement { bodies: builder.bodies, start: builder.start })
    }
}

/// Bodies in the course of being placed.
struct PlacementBuilder<'a> {
    placer: &'a Placer,
    streams: &'a Streams,
    floor: PlacementGrid,
    /// Spans by id, to name the other body when two bodies stand on each other.
    spans: Vec<Range<usize>>,
    bodies: Vec<Body>,
    start: Vec<((u32, u32), u8)>,
}

impl PlacementBuilder<'_> {
    fn add_group(&mut self, group: &BodyGroup, first: EntityId) -> Result<(), InputError> {
        for k in 0..group.count as usize {
            let id = first + k as EntityId;
            let ty = match &group.ty {
                GroupTypes::Shared(ty) => *ty,
                GroupTypes::PerBody(types) => types[k],
            };
            let size = self.placer.sizes[usize::from(ty)];
            let (at, span) = match group.places.get(k) {
                Some(place) => (self.given_place(place, id, size)?, place.span()),
                None => (self.drawn_place(group, k, id, size)?, group.span.clone()),
            };
            let facing = group.places.get(k).and_then(|place| place.get_ref().facing);
            // The index is one that no draw of a place comes to.
            let facing = facing.unwrap_or_else(|| {
                self.streams.block(id, 0, purpose::PLACE, u16::MAX)[0] as u8 % 4
            });
            let phase = group.phase.unwrap_or_else(|| {
                self.streams.draws(id, 0, purpose::PHASE).uniform_below(group.period)
            });
            self.start[id as usize] = (at, facing);
            self.spans[id as usize] = span;
            self.bodies[id as usize] = Body {
                id,
                ty,
                period: group.period,
                phase: phase % group.period,
                action_cycles: group.action_cycles,
            };
        }
        Ok(())
    }

    fn given_place(
        &mut self,
        place: &Spanned<StartPose>,
        id: EntityId,
        size: (u32, u32),
    ) -> Result<(u32, u32), InputError> {
        let at = place.get_ref().at;
        let boxes = Rect { col: at.0, row: at.1, width: size.0, height: size.1 };
        match self.floor.place(id, boxes) {
            Ok(()) => Ok(at),
            Err(obstacle) => Err(self.position_not_free(place.span(), boxes, obstacle)),
        }
    }

    fn drawn_place(
        &mut self,
        group: &BodyGroup,
        k: usize,
        id: EntityId,
        size: (u32, u32),
    ) -> Result<(u32, u32), InputError> {
        let region = group.region.unwrap_or_else(|| self.floor.region());
        self.floor.draw_place(self.streams, id, size, region).ok_or_else(|| {
            let (width, height) = size;
            let cause = format!(
                "no free place is left for number {} of these {} bodies of {width} x {height} boxes",
                k + 1,
                group.count,
            );
            let remedy = "give fewer or smaller bodies, or a larger map or region";
            self.placer.source.error(group.span.clone(), cause, remedy)
        })
    }

    fn position_not_free(
        &self,
        span: Range<usize>,
        boxes: Rect,
        obstacle: PlacementError,
    ) -> InputError {
        let Rect { col, row, width, height } = boxes;
        let body = format!("a body of {width} x {height} boxes at [{col}, {row}]");
        let cause = match obstacle {
            PlacementError::OffMap => {
                let (width, height) = (self.placer.map.width(), self.placer.map.height());
                format!("{body} leaves the map of {width} x {height} boxes")
            }
            PlacementError::Wall(c, r) => format!("{body} stands in the wall at [{c}, {r}]"),
            PlacementError::Body(id, c, r) => {
                // An error knows the line of a span.
                let span = self.spans[id as usize].clone();
                let other = self.placer.source.error(span, "", "").line_and_column();
                let line = other.map_or(String::new(), |(line, _)| format!(" (line {line})"));
                format!("{body} stands on body {id}{line} at [{c}, {r}]")
            }
        };
        let remedy = "place it in free boxes; `sidestep map FILE --box B` shows them";
        self.placer.source.error(span, cause, remedy)
    }
}
