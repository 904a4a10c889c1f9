//! Sections of people (any mobile objects) and doors.

use super::super::StartPose;
use super::bodies::{BodyGroup, GroupTypes, period_cycles, size_boxes};
use super::*;
use crate::effector::Side;

/// Longest side of a door that a map brings, in boxes: the same as of one that a scenario gives.
const MAX_DOOR_SIDE_BOXES: u32 = 64;

/// Place of a door, and its columns and rows.
type SizedPosition = (Spanned<StartPose>, (u32, u32));

impl Compiler<'_> {
    pub(super) fn people(
        &mut self,
        s: &MoverSection,
        span: Range<usize>,
    ) -> Result<BodyGroup, InputError> {
        let count = self.body_count(s.count.as_ref(), &s.at, &span)?;
        let size = size_boxes(s.size);
        self.reach = self.reach.max(1);
        let step = [Transition { p: 1.0, path: vec![Side::Front], turn: 0 }];
        let actions = actions_at_headings(&[step.to_vec()], size, self.stride());
        // By default a person draws a new direction at every fifth action on average: it crosses
        // rooms, and soon leaves a wall that it has run into.
        let straight = Bernoulli::new(s.p_straight.map_or(0.8, f64::from));
        let ty = self.body_type(&s.kind, size, actions, Role::Mover(Mover { straight }))?;
        let ty = GroupTypes::Shared(self.add_type(ty, &span)?);
        Ok(BodyGroup {
            name: String::new(),
            count,
            places: s.at.clone(),
            region: self.region(s.region.as_ref())?,
            span,
            ty,
            period: period_cycles(s.period),
            phase: s.phase,
            action_cycles: 1,
            team: None,
            tasks: None,
        })
    }

    pub(super) fn doors(
        &mut self,
        s: &DoorSection,
        span: Range<usize>,
    ) -> Result<BodyGroup, InputError> {
        let doors = self.door_places(s, &span)?;
        let mut places = Vec::new();
        let mut types = Vec::new();
        for (k, (place, size)) in doors.iter().enumerate() {
            // Each door gets a phase, because otherwise all doors of a section would toggle at
            // once.
            let door = self.door(s, &span, k as u64, doors.len() as u64)?;
            let ty = self.body_type(&s.kind, *size, Arc::new([]), Role::Door(door))?;
            types.push(self.add_type(ty, &span)?);
            places.push(place.clone());
        }
        Ok(BodyGroup {
            name: String::new(),
            count: doors.len() as u64,
            places,
            region: None,
            span,
            ty: GroupTypes::PerBody(types),
            period: 1,
            phase: Some(0),
            action_cycles: 1,
            team: None,
            tasks: None,
        })
    }

    /// Returns the places and sizes of doors; all of them are closed.
    fn door_places(
        &self,
        s: &DoorSection,
        span: &Range<usize>,
    ) -> Result<Vec<SizedPosition>, InputError> {
        // The facing of a door is whether it is open, see `Facing`.
        let facing = Some(0);
        let mut doors = Vec::new();
        for place in &s.at {
            let closed = StartPose { facing, ..*place.get_ref() };
            doors.push((Spanned::new(place.span(), closed), size_boxes(s.size)));
        }
        for rect in self.office_doors.iter().filter(|_| s.office) {
            let sides = 1..=MAX_DOOR_SIDE_BOXES;
            if !sides.contains(&rect.width) || !sides.contains(&rect.height) {
                let cause = format!("a door of {} x {} boxes", rect.width, rect.height);
                let remedy = format!("give 1 to {MAX_DOOR_SIDE_BOXES} boxes a side");
                return Err(self.source.error(span.clone(), cause, remedy));
            }
            let place = StartPose { at: (rect.col, rect.row), facing };
            doors.push((Spanned::new(span.clone(), place), (rect.width, rect.height)));
        }
        if doors.is_empty() {
            let remedy = "add at = [[col, row]], or office = true on a generated office";
            return Err(self.source.error(span.clone(), "these doors stand nowhere", remedy));
        }
        Ok(doors)
    }

    fn door(
        &self,
        s: &DoorSection,
        span: &Range<usize>,
        index: u64,
        of: u64,
    ) -> Result<Door, InputError> {
        match (&s.periodic, &s.random) {
            (Some(periodic), None) => {
                let p = periodic.get_ref();
                // Below 2^40, so that the product with the number of a door does not overflow.
                let total = p.open.checked_add(p.closed).filter(|t| *t > 0 && *t < 1 << 40);
                let total = total.ok_or_else(|| {
                    let cause = "a period of 0 or far too many cycles";
                    self.source.error(periodic.span(), cause, "give open = 200, closed = 100")
                })?;
                let phase = p.phase.unwrap_or(index * total / of) % total;
                Ok(Door::Periodic { open: p.open, closed: p.closed, phase })
            }
            (None, Some(r)) => Ok(Door::Random {
                open: Bernoulli::new(r.p_open.get()),
                close: Bernoulli::new(r.p_close.get()),
            }),
            _ => {
                let remedy = "add periodic = { open = 200, closed = 100 } or \
                              random = { p_open = 0.01, p_close = 0.01 }";
                Err(self.source.error(span.clone(), "a door needs one schedule", remedy))
            }
        }
    }
}
