//! Knowledge of an airplane, the worth of each of its actions, its choice, the shield's decision on
//! that, and the outcome: the cycle is tried on a copy of the state, for its group alone.

#[cfg(test)]
mod tests;
mod told;

use super::act;
use super::flight::{Known, Point};
use super::join;
use super::notes::Notes;
use super::perceive::{self, seen};
use super::state::AirspaceState;
use super::world::AirspaceWorld;
use super::{Scratch, Turn};
use sidestep_kernel::ports::ManualClock;
use sidestep_kernel::view::{self, Inspection, Kind, MarkShape, Role, Section, Table, Value, Who};
use sidestep_kernel::{Cycle, EntityId, Slot};

impl AirspaceWorld {
    /// Returns the report on an airplane in cycle `now`; `None` for one that is not in the air.
    pub(super) fn inspect(
        &self,
        state: &AirspaceState,
        now: Cycle,
        who: Who,
    ) -> Option<Inspection> {
        let Who { kind, number: id, part } = who;
        let is_airplane = kind == Kind::Airplane && part.is_none();
        if !is_airplane || id as usize >= self.airplanes.len() || !state.is_there(self, id, now) {
            return None;
        }
        let copy = AirspaceState::restore(self, &state.snapshot(now));
        let notes = Box::new(Notes { slot: id, ..Notes::default() });
        let mut scratch = Scratch { notes: Some(notes), ..Scratch::default() };
        let group = self.try_cycle(&copy, now, id, &mut scratch);
        let mut notes = *scratch.notes.take()?;
        notes.events = scratch.events;
        notes.events.retain(|event| event.airplane == id || event.other == id);
        let told = Inspection::new(who, now, format!("airplane {}", self.called(id)));
        let look = Looking { world: self, before: state, after: &copy, now, id, group, notes };
        Some(look.all(told))
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
        let turn = &mut Turn { world: self, state, now, clock, scratch };
        let groups = join::groups(turn);
        let mut group = Vec::new();
        groups.members(groups.leader(id), &mut group);
        act::act(turn, &group);
        group.sort_unstable();
        group
    }
}

/// A look at one airplane, before and after a cycle.
struct Looking<'a> {
    world: &'a AirspaceWorld,
    before: &'a AirspaceState,
    after: &'a AirspaceState,
    now: Cycle,
    id: EntityId,
    /// Its conflict group, by id.
    group: Vec<Slot>,
    notes: Notes,
}

impl Looking<'_> {
    fn all(self, mut told: Inspection) -> Inspection {
        self.is_now(&mut told);
        self.is_in_group(&mut told);
        self.knows(&mut told);
        self.decides(&mut told);
        self.is_shielded(&mut told);
        self.talks(&mut told);
        self.comes_out(&mut told);
        told
    }

    /// Returns the airplane as its group sees it.
    fn known(&self) -> Known {
        let own = self.notes.own(&self.notes.group).copied();
        own.unwrap_or_else(|| perceive::known(self.world, self.before, self.now, self.id))
    }

    /// Returns a point on the level of the airplane.
    fn place(&self, [x_m, y_m]: Point) -> view::Place {
        [x_m, y_m, self.before.airplanes[self.id as usize].altitude_m.get()]
    }

    fn is_now(&self, told: &mut Inspection) {
        let (cell, stage) =
            (&self.before.airplanes[self.id as usize], self.before.stage(self.world, self.id));
        let minds = match () {
            () if self.world.is_replayed(self.id, self.now) => "nobody: it follows its track",
            () if self.world.is_intruder(self.id, self.now) => "nobody",
            () => "all others near it",
        };
        let next = cell.next.get() as usize;
        let ahead = stage.mission.get(next);
        told.tell(
            Section::new("Now")
                .fact("place", self.place(cell.pose().at))
                .fact("heading", Value::degrees(cell.pose().heading_rad))
                .fact("airspeed", Value::number(stage.model.v_m_s, "m/s"))
                .fact("separation", Value::meters(stage.model.separation_m))
                .fact("way-points left", Value::count(stage.mission.len().saturating_sub(next)))
                .fact("next way-point", ahead.map(|&at| self.place(at)))
                .fact("minds", minds),
        );
        let way = [cell.pose().at].into_iter().chain(stage.mission.iter().skip(next).copied());
        let points_m: Vec<view::Place> = way.map(|at| self.place(at)).collect();
        if points_m.len() > 1 {
            told.mark(Role::Target, "way-points", MarkShape::Line { points_m });
        }
    }

    /// Tells its group, and where the others are seen.
    fn is_in_group(&self, told: &mut Inspection) {
        let mut table = Table::new(["airplane", "distance", "minds others"]);
        let own = self.known().pose.at;
        for &other in self.group.iter().filter(|&&other| other != self.id) {
            let cell = &self.before.airplanes[other as usize];
            let [x_m, y_m] = seen(self.world, other, self.now, cell.pose()).at;
            let (who, at_m) = (airplane(other), [x_m, y_m, cell.altitude_m.get()]);
            let apart_m = super::flight::distance_m(own, [x_m, y_m]);
            let minds = !self.world.is_intruder(other, self.now);
            table.row([who.into(), Value::meters(apart_m), minds.into()]);
            told.mark(Role::Group, self.world.called(other), MarkShape::Point { at_m });
        }
        told.tell(
            Section::new("Conflict group")
                .fact("airplanes", Value::count(self.group.len()))
                .fact("method", self.world.method.name())
                .table(table),
        );
    }

    /// Tells its knowledge of others where messages get lost, and the cycles in which they were heard.
    fn knows(&self, told: &mut Inspection) {
        let mut table = Table::new([
            "airplane",
            "heard or first seen in cycle",
            "not heard in cycle",
            "place then",
            "presumed on its orbit",
        ]);
        let cycle = |cycle: Cycle| Value::number(cycle as f64, "");
        for (&other, contact) in &self.notes.contacts {
            let at_m = self.place(contact.beacon.pose.at);
            let (heard, unheard) = (cycle(contact.heard_in), contact.unheard_in.map(cycle));
            let is_presumed = contact.presumed.is_some().into();
            table.row([airplane(other).into(), heard, unheard.into(), at_m.into(), is_presumed]);
            let label = format!("{} in cycle {}", self.world.called(other), contact.heard_in);
            told.mark(Role::Known, label, MarkShape::Point { at_m });
        }
        let how = match self.world.network {
            Some(_) => "by messages, which may get lost",
            None => "all of its group as they are now",
        };
        told.tell(Section::new("Knows of others").fact("how", how).table(table));
    }
}

/// Returns the body that stands for an airplane.
fn airplane(id: EntityId) -> Who {
    Who::new(Kind::Airplane, id, None)
}
