//! Sections of people (any mobile objects) and doors.

use super::bodies::{Group, TypeOf};
use super::*;

impl Compiler<'_> {
    pub(super) fn people(
        &mut self,
        s: &MoverSection,
        span: Range<usize>,
    ) -> Result<Group, InputError> {
        let (count, places, period) =
            self.common(s.count.as_ref(), &s.at, s.period.as_ref(), &span)?;
        let size = self.size(*s.size.get_ref(), s.size.span())?;
        let straight = *s.p_straight.get_ref();
        if !(0.0..=1.0).contains(&straight) {
            let cause = format!("p_straight = {straight}");
            return Err(self.error(
                s.p_straight.span(),
                cause,
                "give a probability between 0 and 1",
            ));
        }
        self.reach = self.reach.max(1);
        let step = [Transition { p: 1.0, path: vec![Side::Front], turn: 0 }];
        let actions = actions_at_headings(&[step.to_vec()], size, self.stride());
        let role = Role::Mover(Mover { straight: Chance::new(straight) });
        let ty = self.body_type(&s.kind, size, actions, role)?;
        let ty = TypeOf::All(self.add_type(ty, &span)?);
        Ok(Group {
            count,
            places,
            region: self.region(s.region.as_ref())?,
            span,
            ty,
            period,
            phase: s.phase,
        })
    }

    pub(super) fn doors(
        &mut self,
        s: &DoorSection,
        span: Range<usize>,
    ) -> Result<Group, InputError> {
        let rects = self.door_rects(s, &span)?;
        let (mut places, mut types) = (Vec::new(), Vec::new());
        for (k, (rect, at)) in rects.iter().enumerate() {
            let size = self.size([rect.width, rect.height], at.clone())?;
            // Without a given phase the doors of a section do not all toggle at once.
            let door = self.door(s, &span, k as u64, rects.len() as u64)?;
            let role = Role::Door(door);
            let ty = self.body_type(&s.kind, size, Arc::new([]), role)?;
            types.push(self.add_type(ty, &span)?);
            places.push((((rect.col, rect.row), Some(0)), at.clone()));
        }
        Ok(Group {
            count: rects.len() as u64,
            places,
            region: None,
            span,
            ty: TypeOf::Each(types),
            period: 1,
            phase: Some(0),
        })
    }

    fn door_rects(
        &self,
        s: &DoorSection,
        span: &Range<usize>,
    ) -> Result<Vec<(Rect, Range<usize>)>, InputError> {
        let [width, height] = *s.size.get_ref();
        let mut rects = Vec::new();
        for place in &s.at {
            let ((col, row), _) = self.placing(place)?;
            rects.push((Rect { col, row, width, height }, place.span()));
        }
        if s.office {
            rects.extend(self.office_doors.iter().map(|r| (*r, span.clone())));
        }
        if rects.is_empty() {
            return Err(self.error(
                span.clone(),
                "these doors stand nowhere",
                "add at = [[col, row]], or office = true on a generated office",
            ));
        }
        Ok(rects)
    }

    fn door(
        &self,
        s: &DoorSection,
        span: &Range<usize>,
        index: u64,
        of: u64,
    ) -> Result<Door, InputError> {
        match (&s.periodic, &s.random) {
            (Some(p), None) => {
                let (at, p) = (p.span(), p.get_ref());
                let total = p.open.checked_add(p.closed).filter(|t| *t > 0 && *t < 1 << 40);
                let total = total.ok_or_else(|| self.error(at, "a period of 0 or far too many cycles", "give open = 200, closed = 100"))?;
                Ok(Door::Periodic { open: p.open, closed: p.closed, phase: p.phase.unwrap_or(index * total / of) % total })
            }
            (None, Some(r)) => {
                let (at, r) = (r.span(), r.get_ref());
                if !(0.0..=1.0).contains(&r.p_open) || !(0.0..=1.0).contains(&r.p_close) {
                    return Err(self.error(at, "p_open or p_close is no probability", "give numbers between 0 and 1"));
                }
                Ok(Door::Random { open: Chance::new(r.p_open), close: Chance::new(r.p_close) })
            }
            _ => Err(self.error(span.clone(), "a door needs one schedule", "add periodic = { open = 200, closed = 100 } or random = { p_open = 0.01, p_close = 0.01 }")),
        }
    }
}
