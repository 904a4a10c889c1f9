//! Actions with their expected results, the shield, the talk, and the outcome.

use super::{Inspector, airplane};
use crate::agents::network_traffic::NetworkTraffic;
use crate::flight::{Point, Pose2};
use crate::settings::Method;
use crate::shield::{Side, TurnProfile};
use sidestep_kernel::view::{
    FactSection, FactTable, FactValue, Inspection, MarkRole, MarkShape, Vec3,
};

/// Points of a predicted way that are drawn, at most, beside those of the next `dt`.
const MAX_POINTS: usize = 32;
/// Weight of predicted ways without a known probability.
const UNKNOWN_WEIGHT: f64 = 0.2;

impl Inspector<'_> {
    /// Tells the actions of the airplane, and the one that it chooses.
    pub(super) fn add_decision(&self, told: &mut Inspection) {
        let Some(own) = self.trace.own_part(&self.trace.group) else { return };
        let section = FactSection::new("Decides");
        let Some(decided) = &self.trace.choice else {
            let wish = self.trace.wishes.first().map(|action| action.to_string());
            let wish = wish.unwrap_or_else(|| match self.world.method {
                Method::External => "the turn that was ordered".into(),
                _ => "the heading that the method gives it".into(),
            });
            return told.add_section(section.fact("action", wish));
        };
        let actions = self.world.actions(self.id);
        let options = self.world.action_predictions(*own, &self.trace.intruders);
        let chances = self.probabilities();
        let mut table = FactTable::new(["action", "probability", "expected cost", "chosen"]);
        for (k, action) in actions.iter().enumerate() {
            let chance = chances.get(k).copied();
            let is_chosen = k == decided.chosen;
            let expected = FactValue::number(decided.expected[k], "");
            table.push_row([
                action.to_string().into(),
                chance.map_or(FactValue::None, FactValue::Share),
                expected,
                is_chosen.into(),
            ]);
            let ahead = options.predictions[k].points.iter().copied();
            let shape = self.line(&[own.pose.at].into_iter().chain(ahead).collect::<Vec<_>>());
            let role = if is_chosen { MarkRole::Chosen } else { MarkRole::Predicted };
            told.add_weighted_mark(
                role,
                action.to_string(),
                chance.unwrap_or(UNKNOWN_WEIGHT),
                shape,
            );
        }
        told.add_section(
            section
                .fact("action", actions[decided.chosen].to_string())
                .fact("rounds", FactValue::count(decided.rounds))
                .fact("has settled", decided.converged)
                .table(table),
        );
    }

    /// Returns the probabilities of its actions. A coordinator does not carry them along; where no
    /// message is lost they are those that one process for all would find.
    fn probabilities(&self) -> Vec<f64> {
        let own = self.trace.choice.as_ref().map_or(&[][..], |decided| &decided.chances);
        if !own.is_empty() || self.world.network.is_some() {
            return own.to_vec();
        }
        let (group, intruders) = (&self.trace.group, &self.trace.intruders);
        let all = crate::decide::decide_centrally(self.world, group, intruders, self.now);
        self.trace
            .own_part(&all)
            .cloned()
            .flatten()
            .map_or_else(Vec::new, |decided| decided.chances)
    }

    /// Returns some points on the airplane's level as a line: all of the next `dt`, and then some.
    fn line(&self, points: &[Point]) -> MarkShape {
        let (every, near) =
            (points.len().div_ceil(MAX_POINTS).max(1), self.world.timing.points_per_dt());
        let is_kept =
            |(k, _): &(usize, &Point)| *k <= near || k % every == 0 || k + 1 == points.len();
        let kept = points.iter().enumerate().filter(is_kept);
        MarkShape::Line { points_m: kept.map(|(_, at)| self.place(*at)).collect() }
    }

    /// Tells the shield's decision on the wish, and the others that it depends on.
    pub(super) fn add_shield(&self, told: &mut Inspection) {
        let (Some(decision), Some(flyer)) = (self.trace.decision, &self.trace.aircraft) else {
            return;
        };
        let flies = match decision.candidate {
            Some(0) => "what it wants".into(),
            Some(k) => format!("another way: number {} of {}", k + 1, self.trace.ways.len()),
            None => "its stored orbit".into(),
        };
        let reached = |event: &&crate::events::Event| {
            event.kind == crate::events::EventKind::Intruder && event.airplane == self.id
        };
        let intruder = self.trace.events.iter().find(reached).map(|event| airplane(event.other));
        let mut table = FactTable::new(["because of"]);
        self.trace.blockers.iter().for_each(|&other| table.push_row([airplane(other).into()]));
        let orbit = flyer.orbit(flyer.fallback);
        told.add_section(
            FactSection::new("Shield")
                .fact("lets it fly", flies)
                .fact("because of", self.trace.blockers.first().map(|&other| airplane(other)))
                .fact("stored orbit", side(flyer.fallback))
                .fact("orbit after that", side(decision.fallback))
                .fact("radius of the orbit", FactValue::meters(orbit.radius_m))
                .fact("named with", FactValue::count(flyer.exempt.len()))
                .fact_if("can be reached by", intruder)
                .table(table),
        );
        let (at_m, radius_m) = (self.place(orbit.center()), orbit.radius_m);
        told.add_mark(MarkRole::Orbit, side(flyer.fallback), MarkShape::Circle { at_m, radius_m });
        if let Some(wish) = self.trace.ways.first().filter(|_| decision.candidate != Some(0)) {
            told.add_mark(MarkRole::Refused, "what it wanted", self.profile_line(wish));
        }
    }

    /// Returns the way of one `dt` as a line.
    fn profile_line(&self, way: &TurnProfile) -> MarkShape {
        // Orders are carried out before anything is flown.
        let v_m_s = self.after.segment(self.world, self.id).model.v_m_s;
        let mut pose: Pose2 = self.before.airplanes[self.id as usize].pose();
        let mut points = vec![pose.at];
        for &omega in &way.omegas_rad_s {
            pose =
                self.world.air().after_wind_step(pose.step(v_m_s, omega, self.world.timing.dtau_s));
            points.push(pose.at);
        }
        self.line(&points)
    }

    /// Tells the messages of its group.
    pub(super) fn add_messages(&self, told: &mut Inspection) {
        if self.trace.group.len() < 2 {
            return;
        }
        let mut table =
            FactTable::new(["about", "messages", "bytes", "as multicasts", "bytes then"]);
        let number = |value: u64, unit| FactValue::number(value as f64, unit);
        let row = |about: &str, t: NetworkTraffic| {
            let (bytes, multicast) = (number(t.bytes, "B"), number(t.multicast_bytes, "B"));
            [about.into(), number(t.messages, ""), bytes, number(t.multicasts, ""), multicast]
        };
        if self.trace.beacons != NetworkTraffic::default() {
            table.push_row(row("the group", self.trace.beacons));
        }
        table.push_row(row("actions", self.trace.optimization));
        table.push_row(row("the shield", self.trace.exchange));
        let deployment = self.world.deployment.name();
        told.add_section(
            FactSection::new("Talk of the group").fact("deployment", deployment).table(table),
        );
    }

    /// Tells the outcome.
    pub(super) fn add_outcome(&self, told: &mut Inspection) {
        let (cell, way) = (&self.after.airplanes[self.id as usize], &self.trace.flown);
        let turn = way.as_ref().and_then(|way| way.omegas_rad_s.first().copied());
        let [x_m, y_m] = cell.pose().at;
        let next: Option<Vec3> = cell.is_flying().then_some([x_m, y_m, cell.altitude_m.get()]);
        let heading = cell.is_flying().then(|| FactValue::degrees(cell.pose().heading_rad));
        let mut table = FactTable::new(["event", "with", "value"]);
        for event in &self.trace.events {
            let with = event.partner().map(airplane);
            let value = event.kind.measure().map(|m| FactValue::number(event.value, m.unit()));
            table.push_row([event.kind.name().into(), with.into(), value.into()]);
        }
        told.add_section(
            FactSection::new("Outcome")
                .fact_if(
                    "turns at first",
                    turn.map(|rad_s| FactValue::number(rad_s.to_degrees(), "°/s")),
                )
                .fact("arrives", cell.arrived_step().is_some())
                .fact("next place", next)
                .fact("next heading", heading)
                .table(table),
        );
        if let Some(way) = way {
            told.add_mark(MarkRole::Done, "what it flies", self.profile_line(way));
        }
    }
}

fn side(side: Side) -> &'static str {
    match side {
        Side::Left => "to the left",
        Side::Right => "to the right",
    }
}
