//! Properties that all bodies have in common: number, places, size, and how often they act.

use super::super::{Period, Placing, Side};
use super::*;

/// Bodies that a scenario describes together.
pub(super) struct Group {
    pub(super) count: u64,
    /// Given places; drawn inside `region` where empty.
    pub(super) places: Vec<Spanned<Placing>>,
    pub(super) region: Option<[u32; 4]>,
    pub(super) span: Range<usize>,
    pub(super) ty: TypeOf,
    pub(super) period: u32,
    pub(super) phase: Option<u32>,
}

/// One type for all of a group, or one for each body.
pub(super) enum TypeOf {
    All(u16),
    Each(Vec<u16>),
}

impl Compiler<'_> {
    pub(super) fn groups(&mut self) -> Result<Vec<Group>, InputError> {
        let robots = std::mem::take(&mut self.file.robots.0);
        let people = std::mem::take(&mut self.file.people.0);
        let doors = std::mem::take(&mut self.file.doors.0);
        let mut groups = Vec::new();
        for section in &robots {
            groups.push(self.robots(section.get_ref(), section.span())?);
        }
        for section in &people {
            groups.push(self.people(section.get_ref(), section.span())?);
        }
        for section in &doors {
            groups.push(self.doors(section.get_ref(), section.span())?);
        }
        let bodies: u64 = groups.iter().map(|g| g.count).sum();
        if bodies > MAX_BODIES {
            let cause = format!("{bodies} bodies");
            let most = groups.iter().max_by_key(|g| g.count).map_or(0..0, |g| g.span.clone());
            return Err(self.source.error(most, cause, format!("give at most {MAX_BODIES}")));
        }
        if bodies == 0 {
            let remedy = "add [robots] with count = 1";
            return Err(self.source.error(None, "the scenario has no bodies", remedy));
        }
        Ok(groups)
    }

    pub(super) fn add_group(&mut self, group: &Group, first: EntityId) -> Result<(), InputError> {
        for k in 0..group.count as usize {
            let id = first + k as EntityId;
            let ty = match &group.ty {
                TypeOf::All(ty) => *ty,
                TypeOf::Each(types) => types[k],
            };
            let size = self.types[usize::from(ty)].size;
            let (at, span) = match group.places.get(k) {
                Some(place) => (self.given_place(place, id, size)?, place.span()),
                None => (self.drawn_place(group, k, id, size)?, group.span.clone()),
            };
            let facing = group.places.get(k).and_then(|place| place.get_ref().facing);
            let facing = facing.unwrap_or_else(|| {
                self.streams.block(id, 0, purpose::PLACE, u16::MAX)[0] as u8 % 4
            });
            let phase = group
                .phase
                .unwrap_or_else(|| self.streams.draws(id, 0, purpose::PHASE).below(group.period));
            self.start[id as usize] = (at, facing);
            self.spans[id as usize] = span;
            self.bodies[id as usize] =
                Body { id, ty, period: group.period, phase: phase % group.period };
        }
        Ok(())
    }

    fn given_place(
        &mut self,
        place: &Spanned<Placing>,
        id: EntityId,
        size: (u32, u32),
    ) -> Result<(u32, u32), InputError> {
        let at = place.get_ref().at;
        match self.floor.place(id, at, size) {
            Ok(()) => Ok(at),
            Err(obstacle) => Err(self.in_the_way(place.span(), at, size, obstacle)),
        }
    }

    fn drawn_place(
        &mut self,
        group: &Group,
        k: usize,
        id: EntityId,
        size: (u32, u32),
    ) -> Result<(u32, u32), InputError> {
        let region = group.region.unwrap_or_else(|| self.floor.region());
        self.floor.draw_place(&self.streams, id, size, region).ok_or_else(|| {
            let (width, height) = size;
            let cause = format!(
                "no free place is left for number {} of these {} bodies of {width} x {height} boxes",
                k + 1,
                group.count,
            );
            let remedy = "give fewer or smaller bodies, or a larger map or region";
            self.source.error(group.span.clone(), cause, remedy)
        })
    }

    fn in_the_way(
        &self,
        span: Range<usize>,
        at: (u32, u32),
        size: (u32, u32),
        obstacle: Obstacle,
    ) -> InputError {
        let body = format!("a body of {} x {} boxes at [{}, {}]", size.0, size.1, at.0, at.1);
        let cause = match obstacle {
            Obstacle::Outside => {
                let (width, height) = (self.map.width(), self.map.height());
                format!("{body} leaves the map of {width} x {height} boxes")
            }
            Obstacle::Wall(c, r) => format!("{body} stands in the wall at [{c}, {r}]"),
            Obstacle::Body(id, c, r) => {
                let other = self.source.error(self.spans[id as usize].clone(), "", "").position();
                let line = other.map_or(String::new(), |(line, _)| format!(" (line {line})"));
                format!("{body} stands on body {id}{line} at [{c}, {r}]")
            }
        };
        let remedy = "place it in free boxes; `sidestep map FILE --box B` shows them";
        self.source.error(span, cause, remedy)
    }

    /// Returns the number of bodies: given, or that of the given places.
    pub(super) fn count(
        &self,
        count: Option<&Spanned<u32>>,
        places: &[Spanned<Placing>],
        span: &Range<usize>,
    ) -> Result<u64, InputError> {
        match count {
            Some(c) if !places.is_empty() && *c.get_ref() as usize != places.len() => {
                let cause = format!("count = {} with {} places", c.get_ref(), places.len());
                let remedy = "leave out `count`, or give as many places in `at`";
                Err(self.source.error(c.span(), cause, remedy))
            }
            Some(c) => Ok(u64::from(*c.get_ref())),
            None if !places.is_empty() => Ok(places.len() as u64),
            None => {
                let cause = "neither `count` nor `at` is given";
                let remedy = "add count = 10, or at = [[col, row], ...]";
                Err(self.source.error(span.clone(), cause, remedy))
            }
        }
    }

    pub(super) fn add_type(
        &mut self,
        ty: BodyType,
        span: &Range<usize>,
    ) -> Result<u16, InputError> {
        let index = u16::try_from(self.types.len()).map_err(|_| {
            let remedy = "share behaviours between robots";
            self.source.error(span.clone(), "more than 65,536 body types", remedy)
        })?;
        self.types.push(ty);
        Ok(index)
    }

    pub(super) fn body_type(
        &mut self,
        kind: &Spanned<String>,
        size: (u32, u32),
        actions: Arc<[Action]>,
        role: Role,
    ) -> Result<BodyType, InputError> {
        let own = own_boxes(size, self.stride());
        let marks = matches!(role, Role::Robot(_));
        Ok(BodyType { kind: self.kinds.number(kind)?, size, own, marks, actions, role })
    }

    pub(super) fn region(
        &self,
        region: Option<&Spanned<[u32; 4]>>,
    ) -> Result<Option<[u32; 4]>, InputError> {
        let Some(spanned) = region else { return Ok(None) };
        let r = *spanned.get_ref();
        self.check_rect(r, spanned.span())?;
        Ok(Some(r))
    }

    pub(super) fn check_rect(
        &self,
        [col, row, width, height]: [u32; 4],
        span: Range<usize>,
    ) -> Result<(), InputError> {
        let fits = |from: u32, extent: u32, limit: u32| {
            extent > 0 && from.checked_add(extent).is_some_and(|end| end <= limit)
        };
        if fits(col, width, self.map.width()) && fits(row, height, self.map.height()) {
            return Ok(());
        }
        let (columns, rows) = (self.map.width(), self.map.height());
        let cause = format!(
            "the region [{col}, {row}, {width}, {height}] is empty or leaves the map of \
             {columns} x {rows} boxes"
        );
        Err(self.source.error(span, cause, "write [col, row, width, height] in boxes"))
    }
}

/// Returns the number of cycles from one action to the next.
pub(super) fn cycles_of(period: Option<Period>) -> u32 {
    period.map_or(1, |period| period.get() as u32)
}

/// Returns width and height in boxes.
pub(super) fn boxes(size: Option<[Side; 2]>) -> (u32, u32) {
    size.map_or((1, 1), |[width, height]| (width.get() as u32, height.get() as u32))
}
