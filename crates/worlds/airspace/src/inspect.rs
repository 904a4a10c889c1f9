//! Knowledge of an airplane, the worth of each of its actions, its choice, the shield's decision on
//! that, and the outcome: the cycle is tried on a copy of the state, for its group alone.

mod sections;
#[cfg(test)]
mod tests;

use super::act;
use super::flight::{KnownAircraft, Point};
use super::join;
use super::perceive::{self, observed_pose};
use super::scratch::{PhaseContext, Scratch};
use super::state::AirspaceState;
use super::trace::InspectionTrace;
use super::world::AirspaceWorld;
use sidestep_kernel::ports::ManualClock;
use sidestep_kernel::view::{
    self, BodyId, BodyKind, FactSection, FactTable, FactValue, Inspection, MarkRole, MarkShape,
};
use sidestep_kernel::{Cycle, EntityId, Slot};

impl AirspaceWorld {
    /// Returns the report on an airplane in cycle `now`; `None` for one that is not in the air.
    pub(super) fn inspect(
        &self,
        state: &AirspaceState,
        now: Cycle,
        who: BodyId,
    ) -> Option<Inspection> {
        let BodyId { kind, number: id, part } = who;
        let is_airplane = kind == BodyKind::Airplane && part.is_none();
        if !is_airplane || id as usize >= self.airplanes.len() || !state.is_active(self, id, now) {
            return None;
        }
        let copy = AirspaceState::restore(self, &state.snapshot(now));
        let notes = Box::new(InspectionTrace { slot: id, ..InspectionTrace::default() });
        let mut scratch = Scratch { trace: Some(notes), ..Scratch::default() };
        let group = self.try_cycle(&copy, now, id, &mut scratch);
        let mut notes = *scratch.trace.take()?;
        notes.events = scratch.events;
        notes.events.retain(|event| event.airplane == id || event.other == id);
        let told = Inspection::new(who, now, format!("airplane {}", self.display_name(id)));
        let look =
            Inspector { world: self, before: state, after: &copy, now, id, group, trace: notes };
        Some(look.inspect(told))
    }

    /// Runs a cycle of the group of one airplane; returns the group, by id.
    pub(super) fn try_cycle(
        &self,
        state: &AirspaceState,
        now: Cycle,
        id: EntityId,
        scratch: &mut Scratch,
    ) -> Vec<Slot> {
        let clock = &ManualClock::default();
        let turn = &mut PhaseContext { world: self, state, now, clock, scratch };
        let groups = join::groups(turn);
        let mut group = Vec::new();
        groups.members(groups.leader(id), &mut group);
        act::act(turn, &group);
        group.sort_unstable();
        group
    }
}

/// A look at one airplane, before and after a cycle.
struct Inspector<'a> {
    world: &'a AirspaceWorld,
    before: &'a AirspaceState,
    after: &'a AirspaceState,
    now: Cycle,
    id: EntityId,
    /// Its conflict group, by id.
    group: Vec<Slot>,
    trace: InspectionTrace,
}

impl Inspector<'_> {
    fn inspect(self, mut told: Inspection) -> Inspection {
        self.add_present(&mut told);
        self.add_group(&mut told);
        self.add_knowledge(&mut told);
        self.add_decision(&mut told);
        self.add_shield(&mut told);
        self.add_messages(&mut told);
        self.add_outcome(&mut told);
        told
    }

    /// Returns the airplane as its group sees it.
    fn known(&self) -> KnownAircraft {
        let own = self.trace.own_part(&self.trace.group).copied();
        own.unwrap_or_else(|| perceive::known_aircraft(self.world, self.before, self.now, self.id))
    }

    /// Returns a point on the level of the airplane.
    fn place(&self, [x_m, y_m]: Point) -> view::Vec3 {
        [x_m, y_m, self.before.airplanes[self.id as usize].altitude_m.get()]
    }

    fn add_present(&self, told: &mut Inspection) {
        let (cell, stage) =
            (&self.before.airplanes[self.id as usize], self.before.segment(self.world, self.id));
        let minds = match () {
            () if self.world.is_replayed(self.id, self.now) => "nobody: it follows its track",
            () if self.world.is_non_cooperative(self.id, self.now) => "nobody",
            () => "all others near it",
        };
        let next = cell.next.get() as usize;
        let ahead = stage.mission.get(next);
        told.add_section(
            FactSection::new("Now")
                .fact("place", self.place(cell.pose().at))
                .fact("heading", FactValue::degrees(cell.pose().heading_rad))
                .fact("airspeed", FactValue::number(stage.model.v_m_s, "m/s"))
                .fact("separation", FactValue::meters(stage.model.separation_m))
                .fact("way-points left", FactValue::count(stage.mission.len().saturating_sub(next)))
                .fact("next way-point", ahead.map(|&at| self.place(at)))
                .fact("minds", minds),
        );
        let way = [cell.pose().at].into_iter().chain(stage.mission.iter().skip(next).copied());
        let points_m: Vec<view::Vec3> = way.map(|at| self.place(at)).collect();
        if points_m.len() > 1 {
            told.add_mark(MarkRole::Target, "way-points", MarkShape::Line { points_m });
        }
    }

    /// Tells its group, and where the others are seen.
    fn add_group(&self, told: &mut Inspection) {
        let mut table = FactTable::new(["airplane", "distance", "minds others"]);
        let own = self.known().pose.at;
        for &other in self.group.iter().filter(|&&other| other != self.id) {
            let cell = &self.before.airplanes[other as usize];
            let [x_m, y_m] = observed_pose(self.world, other, self.now, cell.pose()).at;
            let (who, at_m) = (airplane(other), [x_m, y_m, cell.altitude_m.get()]);
            let apart_m = super::flight::distance_m(own, [x_m, y_m]);
            let minds = !self.world.is_non_cooperative(other, self.now);
            table.push_row([who.into(), FactValue::meters(apart_m), minds.into()]);
            told.add_mark(
                MarkRole::Group,
                self.world.display_name(other),
                MarkShape::Point { at_m },
            );
        }
        told.add_section(
            FactSection::new("Conflict group")
                .fact("airplanes", FactValue::count(self.group.len()))
                .fact("method", self.world.method.name())
                .table(table),
        );
    }

    /// Tells its knowledge of others where messages get lost, and the cycles in which they were heard.
    fn add_knowledge(&self, told: &mut Inspection) {
        let mut table = FactTable::new([
            "airplane",
            "heard or first seen in cycle",
            "not heard in cycle",
            "place then",
            "presumed on its orbit",
        ]);
        let cycle = |cycle: Cycle| FactValue::number(cycle as f64, "");
        for (&other, contact) in &self.trace.contacts {
            let at_m = self.place(contact.beacon.pose.at);
            let (heard, unheard) = (cycle(contact.heard_in), contact.unheard_in.map(cycle));
            let is_presumed = contact.presumed.is_some().into();
            table.push_row([
                airplane(other).into(),
                heard,
                unheard.into(),
                at_m.into(),
                is_presumed,
            ]);
            let label = format!("{} in cycle {}", self.world.display_name(other), contact.heard_in);
            told.add_mark(MarkRole::Known, label, MarkShape::Point { at_m });
        }
        let how = match self.world.network {
            Some(_) => "by messages, which may get lost",
            None => "all of its group as they are now",
        };
        told.add_section(FactSection::new("Knows of others").fact("how", how).table(table));
    }
}

/// Returns the body that stands for an airplane.
fn airplane(id: EntityId) -> BodyId {
    BodyId::new(BodyKind::Airplane, id, None)
}
