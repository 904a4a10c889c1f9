//! The rung of the ladder, the connectors that moved, the robots that follow, and the outcome.

use super::{Asked, line};
use crate::motion::replan::Climbed;
use crate::rods::geometry::{Point, distance, in_dimensions, sub};
use crate::rods::veto::Moved;
use crate::view::who_of_obstacle;
use sidestep_kernel::geometry::angle_rad;
use sidestep_kernel::view::{Amount, Inspection, Kind, Role, Section, Table, Value, Who};
use std::borrow::Cow;

/// Connectors that are told, at most.
const MOST_TOLD: usize = 64;

impl<const D: usize> Asked<'_, D> {
    /// Tells the rung of the ladder on which the initiator ended.
    pub(super) fn climbs(&self, told: &mut Inspection) {
        let Some(climbed) = &self.notes.climbed else { return };
        let section = Section::new("Ladder");
        let (rung, moved) = match climbed {
            Climbed::Straight(moved) => ("as wanted".into(), Some(moved)),
            Climbed::Shorter { part, moved } => (format!("{part} of the step"), Some(moved)),
            Climbed::Sideways { turn_rad, moved, .. } => {
                (format!("{:.0}° to the side", turn_rad.to_degrees()), Some(moved))
            }
            Climbed::TurnOnTheSpot { side } => {
                let side = if *side > 0 { "left" } else { "right" };
                (format!("turns on the spot to the {side}"), None)
            }
            Climbed::Waiting { n } => (format!("waits, for {n} cycles so far"), None),
            Climbed::PulledBack { by, moved } => {
                (format!("connector {by}, the other end, leads"), Some(moved))
            }
            Climbed::Stuck { .. } => ("stuck".into(), None),
            Climbed::Vetoed(_) => ("none: an operator gets the veto".into(), None),
        };
        let section = section.fact("rung", rung);
        told.tell(match moved {
            Some(moved) => self.said(section, moved),
            None => section,
        });
    }

    fn said(&self, section: Section, moved: &Moved<D>) -> Section {
        let cut = moved.cut_short.map(|veto| {
            let because = veto
                .obstacle
                .map_or(String::new(), |id| format!(", because of {}", who_of_obstacle(id)));
            format!("by connector {}: {}{because}", veto.by, veto.reason)
        });
        let touched = match moved.touched.is_empty() {
            true => "none yet".into(),
            false => format!("{} to {}", moved.touched.start, moved.touched.end - 1),
        };
        section
            .fact("connectors that reacted", touched)
            .fact("rods turned for obstacles", Value::count(moved.rotated))
            .fact("longest way of a slave", Value::meters(moved.max_slave_step_m))
            .fact("cut short", cut)
    }

    /// Tells which connectors move, how far, and how far their rods turn.
    pub(super) fn moves(&self, told: &mut Inspection) {
        let (before, after) = (self.before.chain.points(), self.after.chain.points());
        let way_m = |k: usize| distance(before[k], after[k]);
        let moved: Vec<usize> = (0..before.len()).filter(|&k| way_m(k) > 0.0).collect();
        let from = moved.partition_point(|&k| k < self.k).saturating_sub(MOST_TOLD / 2);
        let mut table = Table::new(["connector", "way", "turn of the rod behind it"]);
        for &k in moved.iter().skip(from).take(MOST_TOLD) {
            let rod = |points: &[Point<D>]| sub(points[k + 1], points[k]);
            let turn = (k + 1 < before.len()).then(|| angle_rad(rod(before), rod(after)));
            let turn = turn.map(Value::degrees);
            table.row([self.connector(k).into(), Value::meters(way_m(k)), turn.into()]);
            told.mark(Role::Done, format!("connector {k}"), line(&[before[k], after[k]]));
        }
        told.tell(
            Section::new("Moves")
                .fact("connectors", Value::count(moved.len()))
                .fact("motions out of the way", Value::count(self.notes.escapes))
                .table(table),
        );
    }

    /// Tells how late the robots are that keep to the connectors.
    pub(super) fn follows(&self, told: &mut Inspection) {
        let Some(robots) = &self.world.chains[self.slot as usize].robots else { return };
        let mut table = Table::new(["robot", "behind now", "behind then", "touches"]);
        let behind_m = |body: &crate::state::Body<D>, k: usize| {
            distance(body.robots[k].pose.at, in_dimensions(body.chain.points()[k]))
        };
        let all = 0..self.before.robots.len();
        for k in all.clone().take(MOST_TOLD) {
            let then = Value::meters(behind_m(&self.after, k));
            let (now, touches) =
                (Value::meters(behind_m(&self.before, k)), self.after.robots[k].is_bumped);
            table.row([
                Who::new(Kind::Robot, self.slot, Some(k as u32)).into(),
                now,
                then,
                touches.into(),
            ]);
        }
        let latest_m = all.map(|k| behind_m(&self.before, k)).fold(0.0, f64::max);
        told.tell(
            Section::new("Robots")
                .fact("the latest is behind by", Value::meters(latest_m))
                .fact("the leader waits from", Value::meters(robots.lag_limit_m))
                .table(table),
        );
    }

    /// Tells the outcome.
    pub(super) fn comes_out(&self, told: &mut Inspection) {
        let mut table = Table::new(["event", "connector", "with", "value"]);
        for event in &self.scratch.events {
            let entry = crate::view::entry(event);
            let value = entry.value.map(|amount| Value::number(amount.value, unit(&amount)));
            table.row([
                entry.kind.name().into(),
                entry.who.into(),
                entry.with.into(),
                value.into(),
            ]);
        }
        let (now, next) = (self.place(&self.before), self.place(&self.after));
        told.tell(
            Section::new("Outcome")
                .fact("way", Value::meters(distance(now, next)))
                .fact("next place", next)
                .table(table),
        );
    }
}

/// Returns the unit of an amount, as worlds write it.
fn unit(amount: &Amount) -> &'static str {
    match amount.unit {
        Cow::Borrowed(unit) => unit,
        Cow::Owned(_) => "",
    }
}
