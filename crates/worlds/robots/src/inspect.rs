//! Percepts, decisions and claims of a body in a cycle, and their outcome: the cycle is tried on a copy
//! of the state, up to and with this body's action.

mod outcome;
mod plan;
mod senses;
#[cfg(test)]
mod tests;

use super::action::Action;
use super::cycle_context::{CycleContext, with_cycle};
use super::effector::HEADING_NAMES;
use super::join::GroupMember;
use super::policy::ConflictPolicy;
use super::state::RobotsState;
use super::world::{RobotsWorld, Role};
use sidestep_kernel::conflict::ConflictGroups;
use sidestep_kernel::space::OccupantWord;
use sidestep_kernel::view::{
    self, BodyId, FactSection, FactTable, FactValue, Inspection, MarkShape,
};
use sidestep_kernel::{Cycle, EntityId, EntitySlot, Phases};
use sidestep_map::Rect;

/// Largest number of members of a conflict group that are listed: those that act just before and after the body.
const MAX_MEMBERS: usize = 64;

impl RobotsWorld {
    /// Returns the inspection of a body in cycle `now`; `None` for one that is not there.
    pub(super) fn inspect(
        &self,
        state: &RobotsState,
        now: Cycle,
        body: BodyId,
    ) -> Option<Inspection> {
        let id = body.number;
        if id as usize >= self.bodies.len() || self.body_id(id) != body {
            return None;
        }
        let copy = state.trial_copy(self);
        self.plan(&copy, now);
        let slot = copy.slot_of_id[id as usize];
        let kind = &self.kinds[usize::from(self.type_of(id).kind)];
        let inspection = Inspection::new(body, now, format!("{kind} {id}"));
        with_cycle!(self, &copy, now, |cycle| {
            let inspector = Inspector { cycle, present: state, slot, id, inspection };
            Some(inspector.inspect())
        })
    }

    fn heading_name(heading: u8) -> &'static str {
        HEADING_NAMES[usize::from(heading % 4)]
    }
}

/// An inspection of one body in the making, on a copy of the state.
struct Inspector<'a, T: OccupantWord> {
    cycle: &'a CycleContext<'a, T>,
    /// The state that the copy is of: it alone has the progress of robots.
    present: &'a RobotsState,
    slot: EntitySlot,
    id: EntityId,
    inspection: Inspection,
}

impl<'a, T: OccupantWord> Inspector<'a, T> {
    fn inspect(mut self) -> Inspection {
        let scratch = &mut self.cycle.world.new_scratch();
        // Robots decided from outside perceive within a cycle only where readings are recorded.
        scratch.keep_readings = true;
        self.add_present();
        self.add_plan();
        self.add_percept(scratch);
        let bodies = 0..self.cycle.world.bodies.len() as EntitySlot;
        bodies.clone().for_each(|slot| self.cycle.perceive(slot, scratch));
        self.add_claims();
        // All bodies take part, because a group may reach over any of them.
        let groups = ConflictGroups::new(bodies.len());
        bodies.for_each(|slot| self.cycle.join(slot, &groups));
        let mut members = Vec::new();
        groups.members(groups.leader(self.slot), &mut members);
        self.cycle.order(&members, scratch);
        let order = std::mem::take(&mut scratch.order);
        self.add_conflict_group(&order);
        if self.cycle.world.policy == ConflictPolicy::Simultaneous {
            scratch.order = order;
            self.add_outcome_at_once(scratch);
            return self.inspection;
        }
        for place in order.iter().take_while(|place| place.slot != self.slot) {
            self.cycle.act(place.slot, place.word, scratch);
        }
        let own = order.iter().find(|place| place.slot == self.slot);
        self.add_outcome(own.map_or(0, |place| place.word), scratch);
        self.inspection
    }

    /// Adds the facts known before the cycle.
    fn add_present(&mut self) {
        let cycle = self.cycle;
        let body = cycle.body(self.slot);
        let timing = &cycle.world.bodies[self.id as usize];
        let section = FactSection::new("Now")
            .fact("place", self.position_m())
            .fact("heading", self.facing())
            .fact("due", cycle.is_turn(body))
            .fact("acts every", FactValue::number(f64::from(timing.period), "cycles"));
        let section = if cycle.world.has_long_actions {
            let left = cycle.state.action_progress.left(self.id);
            section.fact("action goes on for", FactValue::number(f64::from(left), "cycles"))
        } else {
            section
        };
        let section = if cycle.world.has_delays {
            let remaining = cycle.state.delays.remaining(self.id);
            section.fact("delayed for", FactValue::number(f64::from(remaining), "cycles"))
        } else {
            section
        };
        let section = match &cycle.type_of(body).role {
            Role::Robot(_) => section.fact("last contact", self.last_contact()),
            _ => section,
        };
        self.inspection.add_section(section);
    }

    fn position_m(&self) -> view::Vec3 {
        self.cycle.world.visible_body(self.id, self.cycle.body(self.slot)).pose.at_m
    }

    /// Returns its heading, or of a door whether it is open.
    fn facing(&self) -> FactValue {
        let body = self.cycle.body(self.slot);
        match &self.cycle.type_of(body).role {
            Role::Door(_) => (if body.facing.get().is_open() { "open" } else { "closed" }).into(),
            _ => RobotsWorld::heading_name(body.facing.get().heading()).into(),
        }
    }

    fn last_contact(&self) -> FactValue {
        let Some(contact) = self.cycle.body(self.slot).contact.get().get() else {
            return FactValue::None;
        };
        let kind = &self.cycle.world.kinds[usize::from(contact.kind)];
        format!("{kind} at its {}", contact.side.name()).into()
    }

    /// Returns the action that it is about to do; none for doors, and for those that do nothing.
    fn action(&self) -> Option<&'a Action> {
        let body = self.cycle.body(self.slot);
        let is_idle = body.intent.get().is_idle();
        let action = self.cycle.type_of(body).actions.get(usize::from(body.action.get()));
        action.filter(|_| !is_idle)
    }

    /// Adds the boxes that it may come to cover.
    fn add_claims(&mut self) {
        let cycle = self.cycle;
        let slot = self.slot;
        let intent = cycle.body(slot).intent.get();
        let mut boxes = Vec::new();
        if !intent.is_idle() {
            cycle.for_each_claimed(slot, |index, word| boxes.push((index, word)));
        }
        // A box may be on several paths.
        boxes.sort_unstable_by_key(|(index, _)| *index);
        boxes.dedup_by_key(|(index, _)| *index);
        let taken = boxes.iter().filter(|(_, word)| !word.is_free() && word.slot() != slot).count();
        self.inspection.add_section(
            FactSection::new("Claims")
                .fact("boxes", FactValue::count(boxes.len()))
                .fact("boxes that others cover", FactValue::count(taken)),
        );
        for (index, _) in boxes {
            let corners_m = self.box_corners_m(index);
            self.inspection.add_mark(
                view::MarkRole::Claim,
                "claimed",
                MarkShape::Area { corners_m },
            );
        }
    }

    /// Returns the corners of a box, by its index in the padded grid.
    fn box_corners_m(&self, index: usize) -> Vec<view::Vec3> {
        let world = self.cycle.world;
        let col = index as u32 % world.stride - world.border;
        let row = index as u32 / world.stride - world.border;
        world.corners_m(Rect { col, row, width: 1, height: 1 })
    }

    /// Adds the group that is in conflict, in its order of acting.
    fn add_conflict_group(&mut self, order: &[GroupMember]) {
        let world = self.cycle.world;
        let own = order.iter().position(|place| place.slot == self.slot).unwrap_or(0);
        let from = own.saturating_sub(MAX_MEMBERS / 2);
        let mut table = FactTable::new(["turn", "body", "draw"]);
        let members = order.iter().enumerate().skip(from).take(MAX_MEMBERS);
        for (k, place) in members.filter(|_| order.len() > 1) {
            let body = self.cycle.body(place.slot);
            let who = world.body_id(body.id);
            // The draw is a word of 32 bits, shown as a number below 1.
            let draw = f64::from(place.key.1) / 4_294_967_296.0;
            let draw = match world.policy {
                ConflictPolicy::Fixed => FactValue::None,
                _ => FactValue::number(draw, ""),
            };
            table.push_row([FactValue::count(k + 1), who.into(), draw]);
            let boxes = world.type_of(body.id).boxes(world.map_position(body.position()));
            let corners_m = world.corners_m(boxes);
            let label = format!("{}. {who}", k + 1);
            self.inspection.add_mark(view::MarkRole::Group, label, MarkShape::Area { corners_m });
        }
        self.inspection.add_section(
            FactSection::new("Conflict group")
                .fact("bodies", FactValue::count(order.len()))
                .fact("policy", world.policy.name())
                .fact("turn", FactValue::count(own + 1))
                .table(table),
        );
    }
}

impl RobotsWorld {
    /// The corners come counterclockwise from the lower left.
    fn corners_m(&self, Rect { col, row, width, height }: Rect) -> Vec<view::Vec3> {
        let east = col + width;
        let north = row + height;
        let corners = [(col, row), (east, row), (east, north), (col, north)];
        corners.map(|(col, row)| self.corner_m(col, row)).to_vec()
    }

    /// Returns the lower-left corner of a box.
    fn corner_m(&self, col: u32, row: u32) -> view::Vec3 {
        let side_m = self.map.box_size_m;
        let [x_m, y_m] =
            self.map.plane.transform_point([f64::from(col) * side_m, f64::from(row) * side_m]);
        [x_m, y_m, 0.0]
    }
}
