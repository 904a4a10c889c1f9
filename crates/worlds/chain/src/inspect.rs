//! The move that a chain's initiator wants, the vetoes and their reasons, the response of the recovery ladder, and the
//! outcome for one connector: the cycle is tried on a copy of the state, for its conflict group alone.

mod joints;
mod motion;
#[cfg(test)]
mod tests;

use super::driver::{Task, TaskKind};
use super::perceive::Perceiver;
use super::scratch::Scratch;
use super::state::{ChainBodyState, ChainWorldState};
use super::trace::InspectionTrace;
use super::view::obstacle_body_id;
use super::world::ChainWorld;
use super::{act, claim, join};
use crate::kinds;
use sidestep_kernel::conflict::ConflictGroups;
use sidestep_kernel::ports::ManualClock;
use sidestep_kernel::view::{
    BodyId, BodyKind, FactSection, FactTable, FactValue, Inspection, MarkRole, MarkShape,
};
use sidestep_kernel::{Cycle, EntitySlot, PhaseContext};
use sidestep_rods::Veto;
use sidestep_rods::geometry::{Point, convert_dimensions, distance};

impl<const D: usize> ChainWorld<D> {
    /// Returns the inspection of a connector, or of its robot, in cycle `now`; `None` for one that does
    /// not exist.
    pub(crate) fn inspect(
        &self,
        state: &ChainWorldState<D>,
        now: Cycle,
        who: BodyId,
    ) -> Option<Inspection> {
        let BodyId { kind, number: slot, part: Some(part) } = who else { return None };
        if slot as usize >= state.len() {
            return None;
        }
        let before = state.body(slot as usize).clone();
        let parts = if kind == kinds::CONNECTOR {
            before.chain.points().len()
        } else if kind == kinds::ROBOT {
            before.robots.len()
        } else {
            0
        };
        if part as usize >= parts {
            return None;
        }
        let mut scratch = Scratch::new(self);
        scratch.trace = Some(Box::new(InspectionTrace { slot, ..InspectionTrace::default() }));
        let mut inspection = Inspection::new(who, now, self.title(who));
        let mut phase = PhaseContext {
            world: self,
            state: &state.trial_copy(),
            now,
            clock: &ManualClock::default(),
            scratch: &mut scratch,
        };
        let (after, group) = self.try_cycle(&mut phase, slot, &mut inspection);
        let trace = *scratch.trace.take()?;
        let asked = ConnectorInspection {
            world: self,
            slot,
            kind,
            k: part as usize,
            before,
            after,
            trace,
            scratch,
        };
        asked.add_all_sections(&mut inspection, &group);
        Some(inspection)
    }

    /// Returns the name of a connector, or of its robot, for people.
    fn title(&self, who: BodyId) -> String {
        let BodyId { kind, number: slot, part } = who;
        let name = &self.chains[slot as usize].name;
        let chain = if name.is_empty() { format!("chain {slot}") } else { name.clone() };
        format!("{kind} {} of {chain}", part.unwrap_or_default())
    }

    /// Runs a cycle of the group of one chain, up to that chain's turn; returns the chain after that,
    /// and the group.
    fn try_cycle(
        &self,
        phase: &mut PhaseContext<'_, Self>,
        slot: EntitySlot,
        inspection: &mut Inspection,
    ) -> (ChainBodyState<D>, Vec<EntitySlot>) {
        let &mut PhaseContext { state, now, .. } = phase;
        let groups = ConflictGroups::new(state.len());
        for slot in 0..state.len() {
            claim::claim_box(phase, slot);
        }
        join::join_conflict_groups(phase, 0..state.len(), &groups);
        let mut group = Vec::new();
        groups.members(groups.leader(slot), &mut group);
        group.sort_unstable();
        for &member in &group {
            let mut perceiver = Perceiver { world: self, state, now, scratch: phase.scratch };
            if member == slot {
                add_navigator_percept(&mut perceiver, slot, inspection);
            }
            let decision = perceiver.decide(member);
            state.set_decision(member as usize, decision);
        }
        for &member in group.iter().take_while(|&&member| member <= slot) {
            if member == slot {
                // The events of members before it are not about the chain.
                phase.scratch.events.clear();
            }
            act::act_one(phase, &group, member);
        }
        (state.body(slot as usize).clone(), group)
    }
}

/// Adds the perception of a leader on wheels, and the layer that acts.
fn add_navigator_percept<const D: usize>(
    perceiver: &mut Perceiver<'_, D>,
    slot: EntitySlot,
    inspection: &mut Inspection,
) {
    let Some(sight) = perceiver.percept(slot) else { return };
    let leader = &sight.navigator.leader;
    let decision = leader.decide(sight.leader.followed, &sight.percept);
    let walls = sight.percept.walls_m;
    let target = sight.percept.target;
    inspection.add_section(
        FactSection::new("Perceives")
            .fact("wall on the left", FactValue::meters(walls.left))
            .fact("wall on the right", FactValue::meters(walls.right))
            .fact("range of the laser", FactValue::meters(leader.laser.range_m()))
            .fact("target ahead", target.map(|target| FactValue::degrees(target.bearing_rad)))
            .fact("way to it is free", target.map(|target| target.way_is_free)),
    );
    let left_m_s = decision.wheels.left_m_s;
    let right_m_s = decision.wheels.right_m_s;
    inspection.add_section(
        FactSection::new("Decides")
            .fact("layer", format!("{}: {}", decision.layer as u8, decision.layer.name()))
            .fact("left wheel", FactValue::number(left_m_s, "m/s"))
            .fact("right wheel", FactValue::number(right_m_s, "m/s"))
            .fact("follows the left wall", decision.followed.left)
            .fact("follows the right wall", decision.followed.right),
    );
}

/// A look at one connector, or its robot, before and after a cycle.
struct ConnectorInspection<'a, const D: usize> {
    world: &'a ChainWorld<D>,
    slot: EntitySlot,
    kind: BodyKind,
    k: usize,
    before: ChainBodyState<D>,
    after: ChainBodyState<D>,
    trace: InspectionTrace<D>,
    scratch: Scratch<D>,
}

impl<const D: usize> ConnectorInspection<'_, D> {
    fn add_all_sections(&self, inspection: &mut Inspection, group: &[EntitySlot]) {
        self.add_connector_state(inspection);
        self.add_joint_table(inspection);
        self.add_group_table(inspection, group);
        self.add_intention(inspection);
        self.add_veto_table(inspection);
        self.add_recovery_section(inspection);
        self.add_moved_connectors(inspection);
        self.add_robot_lags(inspection);
        self.add_outcome_section(inspection);
    }

    /// Returns its present task; none after the last.
    fn task(&self) -> Option<&Task<D>> {
        self.world.chains[self.slot as usize].tasks.get(self.before.driving.task as usize)
    }

    fn connector_body_id(&self, k: usize) -> BodyId {
        BodyId::new(kinds::CONNECTOR, self.slot, Some(k as u32))
    }

    /// Returns the place of the connector or robot in a state of the chain.
    fn position(&self, body: &ChainBodyState<D>) -> [f64; 3] {
        if self.kind == kinds::ROBOT {
            convert_dimensions(body.robots[self.k].pose.at)
        } else {
            convert_dimensions(body.chain.points()[self.k])
        }
    }

    fn add_connector_state(&self, inspection: &mut Inspection) {
        let connector = &self.before.chain.connectors()[self.k];
        let task = self.task();
        let leader =
            task.filter(|task| !matches!(task.driver, TaskKind::Rest)).map(|task| task.agent);
        let tasks = self.world.chains[self.slot as usize].tasks.len();
        let number = (self.before.driving.task as usize + 1).min(tasks);
        inspection.add_section(
            FactSection::new("Now")
                .fact("place", self.position(&self.before))
                .fact("leads", leader == Some(self.k))
                .fact("initiator", leader.map(|k| self.connector_body_id(k)))
                .fact("task", task.map_or("all are done", |task| task.driver.name()))
                .fact("task number", format!("{number} of {tasks}"))
                .fact("cycles without progress", FactValue::count(self.before.driving.idle))
                .fact("has failed", connector.failed)
                .fact("is scattered", self.before.scattered.is_some()),
        );
    }

    fn add_group_table(&self, inspection: &mut Inspection, group: &[EntitySlot]) {
        let mut table = FactTable::new(["turn", "chain"]);
        for (turn, &slot) in group.iter().enumerate().filter(|_| group.len() > 1) {
            table.push_row([
                FactValue::count(turn + 1),
                FactValue::Body(BodyId::new(kinds::RODS, slot, None)),
            ]);
        }
        let turn = group.iter().position(|&slot| slot == self.slot).map_or(0, |turn| turn + 1);
        inspection.add_section(
            FactSection::new("Conflict group")
                .fact("chains", FactValue::count(group.len()))
                .fact("turn", FactValue::count(turn))
                .table(table),
        );
    }

    /// Adds what the initiator wants, and where its task leads it.
    fn add_intention(&self, inspection: &mut Inspection) {
        let Some(task) = self.task() else { return };
        let Some(intended) = self.trace.intended else { return };
        let at = self.before.chain.points()[intended.connector];
        let target = match &task.driver {
            TaskKind::Targets(targets) => targets.places.get(self.before.driving.next as usize),
            _ => None,
        };
        inspection.add_section(
            FactSection::new("Wish")
                .fact("of", self.connector_body_id(intended.connector))
                .fact("what", intended.words)
                .fact("to", intended.to.map(convert_dimensions::<D, 3>))
                .fact("way", intended.to.map(|to| FactValue::meters(distance(at, to))))
                .fact_if("target", target.map(|target| convert_dimensions::<D, 3>(*target)))
                .fact_if("way to the target", target.map(|t| FactValue::meters(distance(at, *t)))),
        );
        if let Some(to) = intended.to {
            inspection.add_mark(MarkRole::Wish, intended.words, line_mark(&[at, to]));
        }
        if let Some(target) = target {
            inspection.add_mark(
                MarkRole::Target,
                "target",
                MarkShape::Point { at_m: convert_dimensions(*target) },
            );
        }
    }

    /// Adds the objecting connector, its reason, the obstacle, and how far the initiator could have gone.
    fn add_veto_table(&self, inspection: &mut Inspection) {
        let before = self.before.chain.points();
        let mut table = FactTable::new(["by", "reason", "because of", "could go"]);
        for veto in self.vetoes() {
            let because = veto.obstacle.map(obstacle_body_id);
            let by = self.connector_body_id(veto.by).into();
            table.push_row([
                by,
                veto.reason.name().into(),
                because.into(),
                FactValue::meters(distance(veto.reached, before[veto.from])),
            ]);
            let at_m = convert_dimensions(before[veto.by]);
            inspection.add_mark(
                MarkRole::Refused,
                veto.reason.to_string(),
                MarkShape::Point { at_m },
            );
            let way = line_mark(&[before[veto.from], veto.reached]);
            inspection.add_mark(MarkRole::Refused, "as far as it could go", way);
        }
        let Some(first) = self.vetoes().next() else { return };
        inspection.add_section(
            FactSection::new("Veto")
                .fact("by", self.connector_body_id(first.by))
                .fact("reason", first.reason.name())
                .fact("why", first.reason.to_string())
                .fact("because of", first.obstacle.map(obstacle_body_id))
                .fact("could go", FactValue::meters(distance(first.reached, before[first.from])))
                .fact("as far as", convert_dimensions::<D, 3>(first.reached))
                .table(table),
        );
    }

    /// Returns all objections, each once.
    fn vetoes(&self) -> impl Iterator<Item = &Veto<D>> {
        use super::motion::recovery::RecoveryOutcome;
        let others = match &self.trace.climbed {
            Some(RecoveryOutcome::Stuck { vetoes }) => &vetoes[..],
            _ => &[],
        };
        let own = &self.trace.vetoes;
        own.iter().chain(others.iter().filter(|veto| !own.contains(veto)))
    }
}

fn line_mark<const D: usize>(points: &[Point<D>]) -> MarkShape {
    MarkShape::Line { points_m: points.iter().map(|at| convert_dimensions(*at)).collect() }
}
