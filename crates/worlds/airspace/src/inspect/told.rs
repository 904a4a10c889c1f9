//! Actions with their expected results, the shield, the talk, and the outcome.

use super::{Looking, airplane};
use crate::agents::traffic::Traffic;
use crate::flight::{Point, Pose};
use crate::shield::{Side, Way};
use crate::world::Method;
use sidestep_kernel::view::{Inspection, MarkShape, Place, Role, Section, Table, Value};

/// Points of a predicted way that are drawn, at most, beside those of the next `dt`.
const MOST_POINTS: usize = 32;
/// Weight of predicted ways without a known probability.
const UNKNOWN: f64 = 0.2;

impl Looking<'_> {
    /// Tells the actions of the airplane, and the one that it chooses.
    pub(super) fn decides(&self, told: &mut Inspection) {
        let Some(own) = self.notes.own(&self.notes.group) else { return };
        let section = Section::new("Decides");
        let Some(decided) = &self.notes.decided else {
            let wish = self.notes.wishes.first().map(|action| action.to_string());
            let wish = wish.unwrap_or_else(|| match self.world.method {
                Method::External => "the turn that was ordered".into(),
                _ => "the heading that the method gives it".into(),
            });
            return told.tell(section.fact("action", wish));
        };
        let actions = self.world.actions_of(self.id);
        let options = self.world.options(*own, &self.notes.intruders);
        let chances = self.chances();
        let mut table = Table::new(["action", "probability", "expected cost", "chosen"]);
        for (k, action) in actions.iter().enumerate() {
            let chance = chances.get(k).copied();
            let is_chosen = k == decided.chosen;
            let expected = Value::number(decided.expected[k], "");
            table.row([
                action.to_string().into(),
                chance.map_or(Value::None, Value::Share),
                expected,
                is_chosen.into(),
            ]);
            let ahead = options.predictions[k].points.iter().copied();
            let shape = self.line(&[own.pose.at].into_iter().chain(ahead).collect::<Vec<_>>());
            let role = if is_chosen { Role::Chosen } else { Role::Predicted };
            told.weigh(role, action.to_string(), chance.unwrap_or(UNKNOWN), shape);
        }
        told.tell(
            section
                .fact("action", actions[decided.chosen].to_string())
                .fact("rounds", Value::count(decided.rounds))
                .fact("has settled", decided.converged)
                .table(table),
        );
    }

    /// Returns the probabilities of its actions. A coordinator does not carry them along; where no
    /// message is lost they are those that one process for all would find.
    fn chances(&self) -> Vec<f64> {
        let own = self.notes.decided.as_ref().map_or(&[][..], |decided| &decided.chances);
        if !own.is_empty() || self.world.network.is_some() {
            return own.to_vec();
        }
        let (group, intruders) = (&self.notes.group, &self.notes.intruders);
        let all = crate::decide::direct(self.world, group, intruders, self.now);
        self.notes.own(&all).cloned().flatten().map_or_else(Vec::new, |decided| decided.chances)
    }

    /// Returns some points on the airplane's level as a line: all of the next `dt`, and then some.
    fn line(&self, points: &[Point]) -> MarkShape {
        let (every, near) =
            (points.len().div_ceil(MOST_POINTS).max(1), self.world.timing.points_per_dt());
        let is_kept =
            |(k, _): &(usize, &Point)| *k <= near || k % every == 0 || k + 1 == points.len();
        let kept = points.iter().enumerate().filter(is_kept);
        MarkShape::Line { points_m: kept.map(|(_, at)| self.place(*at)).collect() }
    }

    /// Tells the shield's decision on the wish, and the others that it depends on.
    pub(super) fn is_shielded(&self, told: &mut Inspection) {
        let (Some(decision), Some(flyer)) = (self.notes.decision, &self.notes.flyer) else {
            return;
        };
        let flies = match decision.candidate {
            Some(0) => "what it wants".into(),
            Some(k) => format!("another way: number {} of {}", k + 1, self.notes.ways.len()),
            None => "its stored orbit".into(),
        };
        let reached = |event: &&crate::events::Event| {
            event.kind == crate::events::EventKind::Intruder && event.airplane == self.id
        };
        let intruder = self.notes.events.iter().find(reached).map(|event| airplane(event.other));
        let mut table = Table::new(["because of"]);
        self.notes.because.iter().for_each(|&other| table.row([airplane(other).into()]));
        let orbit = flyer.orbit(flyer.fallback);
        told.tell(
            Section::new("Shield")
                .fact("lets it fly", flies)
                .fact("because of", self.notes.because.first().map(|&other| airplane(other)))
                .fact("stored orbit", side(flyer.fallback))
                .fact("orbit after that", side(decision.fallback))
                .fact("radius of the orbit", Value::meters(orbit.radius_m))
                .fact("named with", Value::count(flyer.named.len()))
                .fact_if("can be reached by", intruder)
                .table(table),
        );
        let (at_m, radius_m) = (self.place(orbit.center()), orbit.radius_m);
        told.mark(Role::Orbit, side(flyer.fallback), MarkShape::Circle { at_m, radius_m });
        if let Some(wish) = self.notes.ways.first().filter(|_| decision.candidate != Some(0)) {
            told.mark(Role::Refused, "what it wanted", self.flown(wish));
        }
    }

    /// Returns the way of one `dt` as a line.
    fn flown(&self, way: &Way) -> MarkShape {
        // Orders are carried out before anything is flown.
        let v_m_s = self.after.stage(self.world, self.id).model.v_m_s;
        let mut pose: Pose = self.before.airplanes[self.id as usize].pose();
        let mut points = vec![pose.at];
        for &omega in &way.omegas_rad_s {
            pose = self.world.air().blown(pose.step(v_m_s, omega, self.world.timing.dtau_s));
            points.push(pose.at);
        }
        self.line(&points)
    }

    /// Tells the messages of its group.
    pub(super) fn talks(&self, told: &mut Inspection) {
        if self.notes.group.len() < 2 {
            return;
        }
        let mut table = Table::new(["about", "messages", "bytes", "as multicasts", "bytes then"]);
        let number = |value: u64, unit| Value::number(value as f64, unit);
        let row = |about: &str, t: Traffic| {
            let (bytes, multicast) = (number(t.bytes, "B"), number(t.multicast_bytes, "B"));
            [about.into(), number(t.messages, ""), bytes, number(t.multicasts, ""), multicast]
        };
        if self.notes.beacons != Traffic::default() {
            table.row(row("the group", self.notes.beacons));
        }
        table.row(row("actions", self.notes.talk));
        table.row(row("the shield", self.notes.exchanged));
        let deployment = self.world.deployment.name();
        told.tell(Section::new("Talk of the group").fact("deployment", deployment).table(table));
    }

    /// Tells the outcome.
    pub(super) fn comes_out(&self, told: &mut Inspection) {
        let (cell, way) = (&self.after.airplanes[self.id as usize], &self.notes.flown);
        let turn = way.as_ref().and_then(|way| way.omegas_rad_s.first().copied());
        let [x_m, y_m] = cell.pose().at;
        let next: Option<Place> = cell.is_flying().then_some([x_m, y_m, cell.altitude_m.get()]);
        let heading = cell.is_flying().then(|| Value::degrees(cell.pose().heading_rad));
        let mut table = Table::new(["event", "with", "value"]);
        for event in &self.notes.events {
            let with = event.partner().map(airplane);
            let value = event.kind.measure().map(|m| Value::number(event.value, m.unit()));
            table.row([event.kind.name().into(), with.into(), value.into()]);
        }
        told.tell(
            Section::new("Outcome")
                .fact_if(
                    "turns at first",
                    turn.map(|rad_s| Value::number(rad_s.to_degrees(), "°/s")),
                )
                .fact("arrives", cell.arrived_step().is_some())
                .fact("next place", next)
                .fact("next heading", heading)
                .table(table),
        );
        if let Some(way) = way {
            told.mark(Role::Done, "what it flies", self.flown(way));
        }
    }
}

fn side(side: Side) -> &'static str {
    match side {
        Side::Left => "to the left",
        Side::Right => "to the right",
    }
}
