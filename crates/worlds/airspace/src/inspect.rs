//! Knowledge of an airplane, the expected cost of each of its actions, its choice, the shield's decision on
//! that, and the outcome: the cycle is tried on a copy of the state, for its group alone.

mod areas;
mod sections;
#[cfg(test)]
mod tests;
mod tracks;

use super::act;
use super::flight::{KnownAircraft, Point};
use super::join;
use super::perceive::{self, observed_pose};
use super::scratch::{PhaseContext, Scratch};
use super::state::AirspaceState;
use super::surveillance::each_decides_by_tracks;
use super::trace::InspectionTrace;
use super::world::AirspaceWorld;
use crate::kinds;
use sidestep_kernel::ports::ManualClock;
use sidestep_kernel::view::{
    self, BodyId, FactSection, FactTable, FactValue, Inspection, MarkRole, MarkShape,
};
use sidestep_kernel::{Cycle, EntityId, EntitySlot};

impl AirspaceWorld {
    /// Returns the report on an airplane in cycle `now`; `None` for one that is not in the air.
    pub(super) fn inspect(
        &self,
        state: &AirspaceState,
        now: Cycle,
        who: BodyId,
    ) -> Option<Inspection> {
        let BodyId { kind, number: id, part } = who;
        let is_airplane = kind == kinds::AIRPLANE && part.is_none();
        if !is_airplane || id as usize >= self.airplanes.len() || !state.is_active(self, id, now) {
            return None;
        }
        let copy = AirspaceState::restore(self, &state.snapshot(now));
        let trace = Box::new(InspectionTrace { slot: id, ..InspectionTrace::default() });
        let mut scratch = Scratch { trace: Some(trace), ..Scratch::default() };
        let group = self.run_group_cycle(&copy, now, id, &mut scratch);
        let mut trace = *scratch.trace.take()?;
        trace.events = scratch.events;
        trace.events.retain(|event| event.airplane == id || event.other == id);
        let inspection = Inspection::new(who, now, format!("airplane {}", self.display_name(id)));
        let inspector =
            Inspector { world: self, before: state, after: &copy, now, id, group, trace };
        Some(inspector.inspect(inspection))
    }

    /// Runs a cycle of the group of one airplane; returns the group, by id.
    pub(super) fn run_group_cycle(
        &self,
        state: &AirspaceState,
        now: Cycle,
        id: EntityId,
        scratch: &mut Scratch,
    ) -> Vec<EntitySlot> {
        let clock = &ManualClock::default();
        let context = &mut PhaseContext { world: self, state, now, clock, scratch };
        let groups = join::form_groups(context);
        let mut group = Vec::new();
        groups.members(groups.leader(id), &mut group);
        act::act(context, &group);
        group.sort_unstable();
        group
    }
}

/// One airplane, before and after a cycle.
struct Inspector<'a> {
    world: &'a AirspaceWorld,
    before: &'a AirspaceState,
    after: &'a AirspaceState,
    now: Cycle,
    id: EntityId,
    /// Its conflict group, by id.
    group: Vec<EntitySlot>,
    trace: InspectionTrace,
}

impl Inspector<'_> {
    fn inspect(self, mut inspection: Inspection) -> Inspection {
        self.add_state_section(&mut inspection);
        self.add_group(&mut inspection);
        self.add_knowledge_section(&mut inspection);
        self.add_tracks_section(&mut inspection);
        self.add_decision(&mut inspection);
        self.add_shield_section(&mut inspection);
        self.add_areas_section(&mut inspection);
        self.add_messages_section(&mut inspection);
        self.add_outcome(&mut inspection);
        inspection
    }

    /// Returns the airplane as its group sees it.
    fn known_airplane(&self) -> KnownAircraft {
        let own = self.trace.own_part(&self.trace.group).copied();
        own.unwrap_or_else(|| perceive::known_aircraft(self.world, self.before, self.now, self.id))
    }

    /// Returns a position, as it is drawn, on the level of the airplane.
    fn point_on_level(&self, at: Point) -> view::Vec3 {
        let [x_m, y_m] = self.world.display_m(at);
        [x_m, y_m, self.before.airplanes[self.id as usize].altitude_m.get()]
    }

    fn add_state_section(&self, inspection: &mut Inspection) {
        let current = &self.before.airplanes[self.id as usize];
        let segment = self.before.segment(self.world, self.id);
        let command = self.before.command_in_force(self.id);
        let commanded_level = command.level.map(|level| FactValue::meters(level.altitude_m));
        let commanded_speed = command.v_m_s.map(|v_m_s| FactValue::number(v_m_s, "m/s"));
        let avoids = if self.world.is_replayed(self.id, self.now) {
            "nobody: it follows its track"
        } else if self.world.is_non_cooperative(self.id, self.now) {
            "nobody"
        } else {
            "all others near it"
        };
        let performance = &self.world.airplanes[self.id as usize].performance;
        let next = current.next.get() as usize;
        let ahead = segment.mission.get(next);
        inspection.add_section(
            FactSection::new("Now")
                .fact("place", self.point_on_level(current.pose().at))
                .fact("heading", FactValue::degrees(current.pose().heading_rad))
                .fact_if("type", performance.type_name.clone())
                .fact("airspeed", FactValue::number(segment.model.v_m_s, "m/s"))
                .fact_if("commanded airspeed", commanded_speed)
                .fact_if("commanded level", commanded_level)
                .fact("separation", FactValue::meters(segment.model.separation_m))
                .fact(
                    "way-points left",
                    FactValue::count(segment.mission.len().saturating_sub(next)),
                )
                .fact("next way-point", ahead.map(|&at| self.point_on_level(at)))
                .fact("minds", avoids),
        );
        let way_points = segment.mission.iter().skip(next).copied();
        let route = [current.pose().at].into_iter().chain(way_points);
        let points_m: Vec<view::Vec3> = route.map(|at| self.point_on_level(at)).collect();
        if points_m.len() > 1 {
            inspection.add_mark(MarkRole::Target, "way-points", MarkShape::Line { points_m });
        }
    }

    /// Adds its group, and where the others are seen.
    fn add_group(&self, inspection: &mut Inspection) {
        let mut table = FactTable::new(["airplane", "distance", "minds others"]);
        let own = self.known_airplane().pose.at;
        for &other in self.group.iter().filter(|&&other| other != self.id) {
            let current = &self.before.airplanes[other as usize];
            let at = observed_pose(self.world, other, self.now, current.pose()).at;
            let [x_m, y_m] = self.world.display_m(at);
            let at_m = [x_m, y_m, current.altitude_m.get()];
            let apart_m = self.world.surface.distance_m(own, at);
            let avoids = !self.world.is_non_cooperative(other, self.now);
            table.push_row([airplane(other).into(), FactValue::meters(apart_m), avoids.into()]);
            inspection.add_mark(
                MarkRole::Group,
                self.world.display_name(other),
                MarkShape::Point { at_m },
            );
        }
        inspection.add_section(
            FactSection::new("Conflict group")
                .fact("airplanes", FactValue::count(self.group.len()))
                .fact("method", self.world.method.name())
                .table(table),
        );
    }

    /// Adds its knowledge of others where messages get lost, and the cycles in which they were heard.
    fn add_knowledge_section(&self, inspection: &mut Inspection) {
        let mut table = FactTable::new([
            "airplane",
            "heard or first seen in cycle",
            "not heard in cycle",
            "place then",
            "presumed on its orbit",
        ]);
        let cycle = |cycle: Cycle| FactValue::number(cycle as f64, "");
        for (&other, contact) in &self.trace.contacts {
            let at_m = self.point_on_level(contact.beacon.pose.at);
            table.push_row([
                airplane(other).into(),
                cycle(contact.heard_in),
                contact.unheard_in.map(cycle).into(),
                at_m.into(),
                contact.presumed.is_some().into(),
            ]);
            let label = format!("{} in cycle {}", self.world.display_name(other), contact.heard_in);
            inspection.add_mark(MarkRole::Known, label, MarkShape::Point { at_m });
        }
        let how = match self.world.network {
            Some(_) => "by messages, which may get lost",
            None if each_decides_by_tracks(self.world) && self.world.surveillance.is_some() => {
                "by reports of others, of which it has tracks"
            }
            None => "all of its group as they are now",
        };
        inspection.add_section(FactSection::new("Knows of others").fact("how", how).table(table));
    }
}

/// Returns the body that stands for an airplane.
fn airplane(id: EntityId) -> BodyId {
    BodyId::new(kinds::AIRPLANE, id, None)
}
