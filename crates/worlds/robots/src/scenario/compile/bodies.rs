//! What all bodies have in common: how many, where, how large, how often they act.

use super::*;

/// Bodies that a scenario describes together.
pub(super) struct Group {
    pub(super) count: u64,
    /// Given places (column, row, facing); drawn inside `region` where empty.
    pub(super) places: Vec<(Placing, Range<usize>)>,
    pub(super) region: Option<[u32; 4]>,
    pub(super) span: Range<usize>,
    pub(super) ty: TypeOf,
    pub(super) period: u32,
    pub(super) phase: Option<u32>,
}

/// Number of bodies, their given places, and their period.
pub(super) type Common = (u64, Vec<(Placing, Range<usize>)>, u32);

/// Column and row, and the facing if it is not to be drawn.
pub(super) type Placing = ((u32, u32), Option<u8>);

/// One type for all of a group, or one for each body.
pub(super) enum TypeOf {
    All(u16),
    Each(Vec<u16>),
}

impl Compiler<'_> {
    pub(super) fn groups(&mut self) -> Result<Vec<Group>, InputError> {
        let robots = take(&mut self.file.robots);
        let people = take(&mut self.file.people);
        let doors = take(&mut self.file.doors);
        let mut groups = Vec::new();
        for section in &robots.1 {
            groups.push(self.robots(section, robots.0.clone())?);
        }
        for section in &people.1 {
            groups.push(self.people(section, people.0.clone())?);
        }
        for section in &doors.1 {
            groups.push(self.doors(section, doors.0.clone())?);
        }
        let bodies: u64 = groups.iter().map(|g| g.count).sum();
        if bodies > MAX_BODIES {
            let cause = format!("{bodies} bodies");
            let most = groups.iter().max_by_key(|g| g.count).map_or(0..0, |g| g.span.clone());
            return Err(self.error(most, cause, format!("give at most {MAX_BODIES}")));
        }
        if bodies == 0 {
            return Err(self.error(
                0..0,
                "the scenario has no bodies",
                "add [robots] with count = 1",
            ));
        }
        Ok(groups)
    }

    pub(super) fn add_group(&mut self, group: &Group, first: EntityId) -> Result<(), InputError> {
        let region = group.region.unwrap_or_else(|| self.floor.region());
        for k in 0..group.count as usize {
            let id = first + k as EntityId;
            let ty = match &group.ty {
                TypeOf::All(ty) => *ty,
                TypeOf::Each(types) => types[k],
            };
            let size = self.types[usize::from(ty)].size;
            let (at, facing, span) = match group.places.get(k) {
                Some(((at, facing), span)) => {
                    self.floor
                        .place(id, *at, size)
                        .map_err(|o| self.in_the_way(span, *at, size, o))?;
                    (*at, *facing, span.clone())
                }
                None => {
                    let at = self.floor.draw_place(&self.streams, id, size, region).ok_or_else(
                        || {
                            let cause = format!(
                                "no free place is left for body {id} of {} x {} boxes",
                                size.0, size.1
                            );
                            self.error(
                                group.span.clone(),
                                cause,
                                "give fewer or smaller bodies, or a larger map or region",
                            )
                        },
                    )?;
                    (at, None, group.span.clone())
                }
            };
            let draw = |purpose: Purpose, n: u32| self.streams.draws(id, 0, purpose).below(n);
            let facing = facing.unwrap_or_else(|| {
                self.streams.block(id, 0, purpose::PLACE, u16::MAX)[0] as u8 % 4
            });
            let phase = group.phase.unwrap_or_else(|| draw(purpose::PHASE, group.period));
            self.start[id as usize] = (at, facing);
            self.spans[id as usize] = span;
            self.bodies[id as usize] =
                Body { id, ty, period: group.period, phase: phase % group.period };
        }
        Ok(())
    }

    pub(super) fn in_the_way(
        &self,
        span: &Range<usize>,
        at: (u32, u32),
        size: (u32, u32),
        obstacle: Obstacle,
    ) -> InputError {
        let body = format!("a body of {} x {} boxes at [{}, {}]", size.0, size.1, at.0, at.1);
        let cause = match obstacle {
            Obstacle::Outside => format!(
                "{body} leaves the map of {} x {} boxes",
                self.map.width(),
                self.map.height()
            ),
            Obstacle::Wall(c, r) => format!("{body} stands in the wall at [{c}, {r}]"),
            Obstacle::Body(id, c, r) => format!("{body} stands on body {id} at [{c}, {r}]"),
        };
        self.error(
            span.clone(),
            cause,
            "place it in free boxes; `sidestep map FILE --box B` shows them",
        )
    }

    pub(super) fn common(
        &self,
        count: Option<&Spanned<u32>>,
        places: &[Spanned<Vec<u32>>],
        period: Option<&Spanned<u32>>,
        span: &Range<usize>,
    ) -> Result<Common, InputError> {
        let places: Vec<_> = places
            .iter()
            .map(|p| Ok((self.placing(p)?, p.span())))
            .collect::<Result<_, InputError>>()?;
        let count = match count {
            Some(c) if !places.is_empty() && *c.get_ref() as usize != places.len() => {
                let cause = format!("count = {} with {} places", c.get_ref(), places.len());
                return Err(self.error(
                    c.span(),
                    cause,
                    "leave out `count`, or give as many places in `at`",
                ));
            }
            Some(c) => u64::from(*c.get_ref()),
            None if !places.is_empty() => places.len() as u64,
            None => {
                return Err(self.error(
                    span.clone(),
                    "neither `count` nor `at` is given",
                    "add count = 10, or at = [[col, row], ...]",
                ));
            }
        };
        Ok((count, places, self.period(period)?))
    }

    /// The cycles from one action to the next.
    pub(super) fn period(&self, period: Option<&Spanned<u32>>) -> Result<u32, InputError> {
        match period {
            None => Ok(1),
            Some(period) if *period.get_ref() == 0 => {
                let remedy = "give 1 (acts every cycle) or more";
                Err(self.error(period.span(), "a period of 0 cycles", remedy))
            }
            Some(period) => Ok(*period.get_ref()),
        }
    }

    pub(super) fn placing(&self, place: &Spanned<Vec<u32>>) -> Result<Placing, InputError> {
        match place.get_ref()[..] {
            [col, row] => Ok(((col, row), None)),
            [col, row, facing] if facing < 4 => Ok(((col, row), Some(facing as u8))),
            _ => Err(self.error(
                place.span(),
                "this is no place",
                "write [col, row] or [col, row, heading] with heading 0 east, 1 north, 2 west, 3 south",
            )),
        }
    }

    pub(super) fn add_type(
        &mut self,
        ty: BodyType,
        span: &Range<usize>,
    ) -> Result<u16, InputError> {
        let index = u16::try_from(self.types.len()).map_err(|_| {
            self.error(
                span.clone(),
                "more than 65,536 body types",
                "share behaviours between robots",
            )
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
        Ok(BodyType { kind: self.kind(kind)?, size, own, marks, actions, role })
    }

    pub(super) fn size(
        &self,
        size: [u32; 2],
        span: Range<usize>,
    ) -> Result<(u32, u32), InputError> {
        if size.iter().all(|s| (1..=MAX_SIZE).contains(s)) {
            return Ok((size[0], size[1]));
        }
        let cause = format!("a body of {} x {} boxes", size[0], size[1]);
        Err(self.error(span, cause, format!("give 1 to {MAX_SIZE} boxes a side")))
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
        let cause = format!(
            "the region [{col}, {row}, {width}, {height}] is empty or leaves the map of {} x {} boxes",
            self.map.width(),
            self.map.height()
        );
        Err(self.error(span, cause, "write [col, row, width, height] in boxes"))
    }
}
