//! Rounds of a cycle: percepts out to those whose turn it is, and controls in; after the last one the world goes on.

use super::{Broken, Server};
use crate::ports::{Absurd, Controls, Sight};
use crate::wire::Party;
use crate::words::{Control, Word};
use sidestep::kernel::EntityId;
use std::time::Instant;

/// Those who decide together.
pub(super) type Group = Vec<EntityId>;

impl Server<'_> {
    /// Hands each agent whose turn it is its percept; returns the groups of those who decide together.
    pub(super) fn hand_out_sights(&mut self) -> Vec<Group> {
        self.seats.values_mut().for_each(|seat| seat.control = None);
        let mut groups = Vec::new();
        for Sight { agent, group, begin } in self.stage.sights() {
            self.mail.letter(Party::Node(agent), Word::Begin(begin));
            if group.first() == Some(&agent) {
                groups.push(group);
            }
        }
        groups
    }

    pub(super) fn on_control(&mut self, agent: EntityId, Control { cycle, control }: Control) {
        let Some(seat) = self.seats.get_mut(&agent) else { return };
        if cycle == self.stage.cycle() {
            seat.control = Some(control);
        }
    }

    /// Whether an agent has sent its control.
    pub(super) fn has_control(&self, agent: EntityId) -> bool {
        self.seats.get(&agent).is_some_and(|seat| seat.control.is_some())
    }

    /// Takes the controls that are there, and counts those that are not.
    pub(super) fn take_controls(&mut self, groups: &[Group]) {
        let mut controls = Controls::new();
        let mut gone = Vec::new();
        for &agent in groups.iter().flatten() {
            if self.is_gone(agent) {
                gone.push(agent);
            }
            let Some(seat) = self.seats.get_mut(&agent) else { continue };
            match seat.control.take() {
                Some(control) => {
                    seat.flown += 1;
                    controls.push((agent, control));
                }
                None => {
                    let (who, cycle) = (self.stage.called(agent), self.stage.cycle());
                    let talk = &*seat.status.doing;
                    tracing::info!(agent, who, cycle, talk, "a control is late");
                    seat.late += 1;
                    self.tally.late_controls += 1;
                }
            }
        }
        let absurd = self.stage.take(groups, controls, &gone);
        self.note_absurd(absurd);
    }

    /// Lets the world go on.
    ///
    /// # Errors
    /// When it cannot.
    pub(super) fn advance(&mut self) -> Result<(), Broken> {
        let began = Instant::now();
        let cycle = self.stage.cycle();
        let absurd = self.stage.advance()?;
        self.note_absurd(absurd);
        self.tally.advanced.add(began.elapsed());
        // A node may tell of a cycle until it hears of the next one.
        let past = self.packets.extract_if(.., |(_, packet)| packet.cycle < cycle).collect();
        self.attendant.take_packets(past);
        Ok(())
    }

    fn note_absurd(&mut self, absurd: Vec<Absurd>) {
        for Absurd { agent, reason } in absurd {
            let (who, cycle) = (self.stage.called(agent), self.stage.cycle());
            tracing::warn!(agent, who, cycle, reason, "an absurd control");
            self.tally.absurd_controls += 1;
            if let Some(seat) = self.seats.get_mut(&agent) {
                seat.absurd += 1;
                seat.flown -= 1;
            }
        }
    }
}
