//! Properties that all bodies have in common: number, places, size, and how often they act.

use super::super::{Period, SideBoxes, StartPose};
use super::*;
use crate::team::TeamLeader;
use sidestep_planners::TeamTasks;

/// Bodies that a scenario describes together.
#[derive(Debug)]
pub(super) struct BodyGroup {
    /// The name that the scenario gives them; may be empty.
    pub(super) name: String,
    pub(super) count: u64,
    /// Given places; drawn inside `region` where empty.
    pub(super) places: Vec<Spanned<StartPose>>,
    pub(super) region: Option<[u32; 4]>,
    pub(super) span: Range<usize>,
    pub(super) ty: GroupTypes,
    pub(super) period: u32,
    pub(super) phase: Option<u32>,
    pub(super) action_cycles: u32,
    /// The team to which they belong, if a planner leads them.
    pub(super) team: Option<GroupTeam>,
    /// What they carry out, led by the planner.
    pub(super) tasks: Option<Arc<TeamTasks>>,
}

/// The team of a group of robots.
#[derive(Debug)]
pub(super) struct GroupTeam {
    /// Equal for the groups of one team.
    pub(super) number: usize,
    pub(super) leader: TeamLeader,
}

impl BodyGroup {
    /// Returns the type of its first body.
    pub(super) fn first_type(&self) -> Option<u16> {
        match &self.ty {
            GroupTypes::Shared(ty) => Some(*ty),
            GroupTypes::PerBody(types) => types.first().copied(),
        }
    }
}

/// One type for all of a group, or one for each body where goals or phases are its own.
#[derive(Debug)]
pub(super) enum GroupTypes {
    Shared(u16),
    PerBody(Vec<u16>),
}

impl Compiler<'_> {
    /// Returns the bodies of all sections: robots, people, doors, in the order of their ids.
    pub(super) fn groups(&mut self) -> Result<Vec<BodyGroup>, InputError> {
        // Taken out, because making a group adds its types to the compiler.
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

    /// Returns the number of bodies: given, or that of the given places.
    pub(super) fn body_count(
        &self,
        count: Option<&Spanned<u32>>,
        places: &[Spanned<StartPose>],
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
        region: Option<&Spanned<FixedList<u32, 4>>>,
    ) -> Result<Option<[u32; 4]>, InputError> {
        let Some(spanned) = region else { return Ok(None) };
        let r = spanned.get_ref().get();
        self.check_rect(r, spanned.span())?;
        Ok(Some(r))
    }

    pub(super) fn check_rect(
        &self,
        [col, row, width, height]: [u32; 4],
        span: Range<usize>,
    ) -> Result<(), InputError> {
        let columns = self.map.width();
        let rows = self.map.height();
        if is_inside(col, width, columns) && is_inside(row, height, rows) {
            return Ok(());
        }
        let cause = format!(
            "the region [{col}, {row}, {width}, {height}] is empty or leaves the map of \
             {columns} x {rows} boxes"
        );
        Err(self.source.error(span, cause, "write [col, row, width, height] in boxes"))
    }
}

/// Returns whether a row of boxes is not empty and ends before a limit; the numbers come from a file, and may
/// overflow.
fn is_inside(from: u32, extent: u32, limit: u32) -> bool {
    extent > 0 && from.checked_add(extent).is_some_and(|end| end <= limit)
}

/// Bodies act in every cycle unless the scenario says otherwise.
pub(super) fn period_cycles(period: Option<Period>) -> u32 {
    period.map_or(1, |period| period.get() as u32)
}

/// Actions of robots take one cycle unless the scenario says otherwise.
pub(super) fn action_cycles(s: &RobotSection) -> u32 {
    s.action_cycles.map_or(1, |cycles| cycles.get() as u32)
}

/// Bodies cover one box unless the scenario says otherwise.
pub(super) fn size_boxes(size: Option<[SideBoxes; 2]>) -> (u32, u32) {
    size.map_or((1, 1), |[width, height]| (width.get() as u32, height.get() as u32))
}
