//! The rung of the ladder, the connectors that moved, the robots that follow, and the outcome.

use super::{ConnectorInspection, line_mark};
use crate::kinds;
use crate::motion::recovery::RecoveryOutcome;
use crate::state::ChainBodyState;
use crate::view::obstacle_body_id;
use sidestep_kernel::geometry::angle_between_rad;
use sidestep_kernel::view::{
    BodyId, FactSection, FactTable, FactValue, Inspection, MarkRole, Quantity,
};
use sidestep_rods::CompletedMotion;
use sidestep_rods::geometry::{convert_dimensions, distance, sub};
use std::borrow::Cow;

/// Most connectors that an inspection lists.
const MAX_LISTED_CONNECTORS: usize = 64;

impl<const D: usize> ConnectorInspection<'_, D> {
    /// Adds the rung of the ladder on which the initiator ended.
    pub(super) fn add_recovery_section(&self, inspection: &mut Inspection) {
        let Some(climbed) = &self.trace.climbed else { return };
        let section = FactSection::new("Ladder");
        let (rung, moved) = match climbed {
            RecoveryOutcome::Straight(moved) => ("as wanted".into(), Some(moved)),
            RecoveryOutcome::Shorter { part, moved } => {
                (format!("{part} of the step"), Some(moved))
            }
            RecoveryOutcome::Sideways { turn_rad, moved, .. } => {
                (format!("{:.0}° to the side", turn_rad.to_degrees()), Some(moved))
            }
            RecoveryOutcome::TurnOnTheSpot { side } => {
                let side = if *side > 0 { "left" } else { "right" };
                (format!("turns on the spot to the {side}"), None)
            }
            RecoveryOutcome::Waiting { n } => (format!("waits, for {n} cycles so far"), None),
            RecoveryOutcome::PulledBack { by, moved } => {
                (format!("connector {by}, the other end, leads"), Some(moved))
            }
            RecoveryOutcome::Stuck { .. } => ("stuck".into(), None),
            RecoveryOutcome::Vetoed(_) => ("none: an operator gets the veto".into(), None),
        };
        let section = section.fact("rung", rung);
        inspection.add_section(match moved {
            Some(moved) => self.with_motion_facts(section, moved),
            None => section,
        });
    }

    fn with_motion_facts(&self, section: FactSection, moved: &CompletedMotion<D>) -> FactSection {
        let cut = moved.cut_short.map(|veto| {
            let because = veto
                .obstacle
                .map_or(String::new(), |id| format!(", because of {}", obstacle_body_id(id)));
            format!("by connector {}: {}{because}", veto.by, veto.reason)
        });
        let touched = if moved.touched.is_empty() {
            "none yet".into()
        } else {
            format!("{} to {}", moved.touched.start, moved.touched.end - 1)
        };
        section
            .fact("connectors that reacted", touched)
            .fact("rods turned for obstacles", FactValue::count(moved.rotated))
            .fact("longest way of a slave", FactValue::meters(moved.max_slave_step_m))
            .fact("cut short", cut)
    }

    /// Adds the connectors that move, how far, and how far their rods turn.
    pub(super) fn add_moved_connectors(&self, inspection: &mut Inspection) {
        let before = self.before.chain.points();
        let after = self.after.chain.points();
        let moved: Vec<usize> =
            (0..before.len()).filter(|&k| distance(before[k], after[k]) > 0.0).collect();
        // Of many, those around the connector that is inspected.
        let from = moved.partition_point(|&k| k < self.k).saturating_sub(MAX_LISTED_CONNECTORS / 2);
        let mut table = FactTable::new(["connector", "way", "turn of the rod behind it"]);
        for &k in moved.iter().skip(from).take(MAX_LISTED_CONNECTORS) {
            // The last connector has no rod behind it.
            let turn = (k + 1 < before.len()).then(|| {
                let was = sub(before[k + 1], before[k]);
                let is = sub(after[k + 1], after[k]);
                FactValue::degrees(angle_between_rad(was, is))
            });
            let way = FactValue::meters(distance(before[k], after[k]));
            table.push_row([self.connector_body_id(k).into(), way, turn.into()]);
            inspection.add_mark(
                MarkRole::Done,
                format!("connector {k}"),
                line_mark(&[before[k], after[k]]),
            );
        }
        inspection.add_section(
            FactSection::new("Moves")
                .fact("connectors", FactValue::count(moved.len()))
                .fact("motions out of the way", FactValue::count(self.trace.escapes))
                .table(table),
        );
    }

    /// Adds the lags of the robots that keep to the connectors.
    pub(super) fn add_robot_lags(&self, inspection: &mut Inspection) {
        let Some(robots) = &self.world.chains[self.slot as usize].robots else { return };
        let mut table = FactTable::new(["robot", "behind now", "behind then", "touches"]);
        let all = 0..self.before.robots.len();
        for k in all.clone().take(MAX_LISTED_CONNECTORS) {
            let now = FactValue::meters(lag_m(&self.before, k));
            let then = FactValue::meters(lag_m(&self.after, k));
            let touches = self.after.robots[k].is_bumped;
            table.push_row([
                BodyId::new(kinds::ROBOT, self.slot, Some(k as u32)).into(),
                now,
                then,
                touches.into(),
            ]);
        }
        let latest_m = all.map(|k| lag_m(&self.before, k)).fold(0.0, f64::max);
        inspection.add_section(
            FactSection::new("Robots")
                .fact("the latest is behind by", FactValue::meters(latest_m))
                .fact("the leader waits from", FactValue::meters(robots.lag_limit_m))
                .table(table),
        );
    }

    /// Adds how far the connector gets, and all events of the cycle.
    pub(super) fn add_outcome_section(&self, inspection: &mut Inspection) {
        let mut table = FactTable::new(["event", "connector", "with", "value"]);
        for event in &self.scratch.events {
            let entry = crate::view::view_event(event);
            let value =
                entry.value.map(|amount| FactValue::number(amount.value, unit_name(&amount)));
            table.push_row([
                entry.kind.name().into(),
                entry.who.into(),
                entry.with.into(),
                value.into(),
            ]);
        }
        let now = self.position(&self.before);
        let next = self.position(&self.after);
        inspection.add_section(
            FactSection::new("Outcome")
                .fact("way", FactValue::meters(distance(now, next)))
                .fact("next place", next)
                .table(table),
        );
    }
}

/// Returns the distance of a robot from its connector.
fn lag_m<const D: usize>(body: &ChainBodyState<D>, k: usize) -> f64 {
    distance(body.robots[k].pose.at, convert_dimensions(body.chain.points()[k]))
}

/// Returns the unit of an amount, as worlds write it.
fn unit_name(amount: &Quantity) -> &'static str {
    match amount.unit {
        Cow::Borrowed(unit) => unit,
        Cow::Owned(_) => "",
    }
}
