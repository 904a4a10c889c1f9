//! Actions with their expected results, the shield, the conversation, and the outcome.

use super::{Inspector, airplane};
use crate::agents::ActionChoice;
use crate::agents::network_traffic::NetworkTraffic;
use crate::decide::{decide_centrally, joint_action_cost};
use crate::events::EventKind;
use crate::flight::{Point, Pose2};
use crate::method::MethodKind;
use crate::shield::{Fallback, OrbitSide, TurnProfile};
use crate::trace::InspectionTrace;
use sidestep_kernel::view::{
    FactSection, FactTable, FactValue, Inspection, MarkRole, MarkShape, Vec3,
};

/// Points of a predicted path that are drawn, at most, in addition to those of the next `dt`.
const MAX_POINTS: usize = 32;
/// Weight of predicted paths without a known probability: faint, and visible.
const UNKNOWN_WEIGHT: f64 = 0.2;

/// Groups of up to this many airplanes are shown their true minimum, which takes some milliseconds.
const MAX_MINIMUM_AIRPLANES: usize = 8;

/// What the joint action of a group costs, as far as it is known.
struct JointCosts {
    cost: Option<f64>,
    bound: Option<f64>,
    minimum: Option<f64>,
}

impl Inspector<'_> {
    /// Adds the actions of the airplane, and the one that it chooses.
    pub(super) fn add_decision(&self, inspection: &mut Inspection) {
        let Some(own) = self.trace.own_part(&self.trace.group) else { return };
        let section = FactSection::new("Decides");
        let Some(decided) = &self.trace.choice else {
            let action = self.trace.actions.first().map(|action| action.to_string());
            let action = action.unwrap_or_else(|| match self.world.method {
                MethodKind::External => "the turn that was ordered".into(),
                _ => "the heading that the method gives it".into(),
            });
            return inspection.add_section(section.fact("action", action));
        };
        let actions = self.world.actions(self.id);
        let options = self.world.action_predictions(*own, &self.trace.non_cooperative, self.now);
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
            let frame = options.frame;
            let ahead = options.predictions[k].points.iter().map(|at| frame.to_world(*at));
            let shape = self.path_mark(&[own.pose.at].into_iter().chain(ahead).collect::<Vec<_>>());
            let role = if is_chosen { MarkRole::Chosen } else { MarkRole::Predicted };
            inspection.add_weighted_mark(
                role,
                action.to_string(),
                chance.unwrap_or(UNKNOWN_WEIGHT),
                shape,
            );
        }
        let JointCosts { cost, bound, minimum } = self.joint_costs(decided);
        inspection.add_section(
            section
                .fact("action", actions[decided.chosen].to_string())
                .fact("rounds", FactValue::count(decided.rounds))
                .fact("has settled", decided.converged)
                .fact("cost of all together", cost.map(|cost| FactValue::number(cost, "")))
                .fact("at least", bound.map(|bound| FactValue::number(bound, "")))
                .fact("true minimum", minimum.map(|least| FactValue::number(least, "")))
                .table(table),
        );
    }

    /// Returns what the actions of the whole group cost: as the airplane knows, or in a small group as one who knows all
    /// computes it.
    fn joint_costs(&self, decided: &ActionChoice) -> JointCosts {
        let InspectionTrace { group, non_cooperative, joint, .. } = &self.trace;
        let joint = joint.as_ref().filter(|joint| joint.len() <= MAX_MINIMUM_AIRPLANES);
        let known = joint
            .map(|joint| joint_action_cost(self.world, group, non_cooperative, joint, self.now));
        let reached = known.as_ref().map(|known| known.reached).or(decided.reached);
        JointCosts {
            cost: reached.map(|reached| reached.cost),
            bound: reached.map(|reached| reached.bound),
            minimum: known.and_then(|known| known.minimum),
        }
    }

    /// Returns the probabilities of its actions. A coordinator does not carry them along; where no
    /// message is lost they are those that one process for all would find.
    fn probabilities(&self) -> Vec<f64> {
        let own = self.trace.choice.as_ref().map_or(&[][..], |decided| &decided.chances);
        if !own.is_empty() || self.world.network.is_some() {
            return own.to_vec();
        }
        let InspectionTrace { group, non_cooperative, .. } = &self.trace;
        let all = decide_centrally(self.world, group, non_cooperative, self.now);
        self.trace
            .own_part(&all)
            .cloned()
            .flatten()
            .map_or_else(Vec::new, |decided| decided.chances)
    }

    /// Returns some points on the airplane's level as a line: all of the next `dt`, and then some.
    fn path_mark(&self, points: &[Point]) -> MarkShape {
        let stride = points.len().div_ceil(MAX_POINTS).max(1);
        let next_dt = self.world.timing.points_per_dt();
        let mut points_m = Vec::new();
        for (k, at) in points.iter().enumerate() {
            if k <= next_dt || k % stride == 0 || k + 1 == points.len() {
                points_m.push(self.point_on_level(*at));
            }
        }
        MarkShape::Line { points_m }
    }

    /// Adds the shield's decision on the preferred profile, and the others that it depends on.
    pub(super) fn add_shield_section(&self, inspection: &mut Inspection) {
        let (Some(decision), Some(aircraft)) = (self.trace.decision, &self.trace.aircraft) else {
            return;
        };
        let flies = match decision.candidate {
            Some(0) => "what it wants".into(),
            Some(k) => format!("another way: number {} of {}", k + 1, self.trace.profiles.len()),
            None => "its stored fallback".into(),
        };
        let threat = self
            .trace
            .events
            .iter()
            .find(|event| event.kind == EventKind::Intruder && event.airplane == self.id);
        let mut table = FactTable::new(["because of"]);
        for &other in &self.trace.blockers {
            table.push_row([airplane(other).into()]);
        }
        let path = aircraft.fallback_path(aircraft.fallback);
        let orbit = path.orbit();
        inspection.add_section(
            FactSection::new("Shield")
                .fact("lets it fly", flies)
                .fact("because of", self.trace.blockers.first().map(|&other| airplane(other)))
                .fact("stored fallback", fallback_text(aircraft.fallback, aircraft.dt_s))
                .fact("fallback after that", fallback_text(decision.fallback, aircraft.dt_s))
                .fact("radius of the orbit", FactValue::meters(orbit.radius_m))
                .fact("named with", FactValue::count(aircraft.exempt.len()))
                .fact_if("can be reached by", threat.map(|event| airplane(event.other)))
                .table(table),
        );
        let at_m = self.point_on_level(aircraft.frame.to_world(orbit.center()));
        let radius_m = orbit.radius_m;
        inspection.add_mark(
            MarkRole::Orbit,
            fallback_text(aircraft.fallback, aircraft.dt_s),
            MarkShape::Circle { at_m, radius_m },
        );
        if decision.candidate != Some(0)
            && let Some(preferred) = self.trace.profiles.first()
        {
            inspection.add_mark(
                MarkRole::Refused,
                "what it wanted",
                self.turn_profile_line(preferred),
            );
        }
    }

    /// Returns the path of one `dt` as a line.
    fn turn_profile_line(&self, profile: &TurnProfile) -> MarkShape {
        // Orders are carried out before anything is flown.
        let v_m_s = self.after.segment(self.world, self.id).model.v_m_s;
        let current = &self.before.airplanes[self.id as usize];
        let start: Pose2 = current.pose();
        let air = self.world.air_at(start.at, current.altitude_m.get());
        let frame = self.world.surface.frame_at(start.at);
        let mut pose = frame.pose_to_local(start);
        let mut points = vec![start.at];
        for &omega in &profile.omegas_rad_s {
            pose = air.after_wind_step(pose.step(v_m_s, omega, self.world.timing.dtau_s));
            points.push(frame.to_world(pose.at));
        }
        self.path_mark(&points)
    }

    /// Adds the messages of its group; an airplane that is alone in one has sent none.
    pub(super) fn add_messages_section(&self, inspection: &mut Inspection) {
        if self.trace.group.len() < 2 {
            return;
        }
        let mut table =
            FactTable::new(["about", "messages", "bytes", "as multicasts", "bytes then"]);
        if self.trace.beacons != NetworkTraffic::default() {
            table.push_row(network_traffic_row("the group", self.trace.beacons));
        }
        table.push_row(network_traffic_row("actions", self.trace.optimization));
        table.push_row(network_traffic_row("the shield", self.trace.exchange));
        let deployment = self.world.deployment.name();
        inspection.add_section(
            FactSection::new("Talk of the group").fact("deployment", deployment).table(table),
        );
    }

    /// Adds the airplane after the cycle, and the events in which it had a part.
    pub(super) fn add_outcome(&self, inspection: &mut Inspection) {
        let current = &self.after.airplanes[self.id as usize];
        let profile = &self.trace.flown;
        let turn = profile.as_ref().and_then(|profile| profile.omegas_rad_s.first().copied());
        let [x_m, y_m] = self.world.display_m(current.pose().at);
        let next: Option<Vec3> =
            current.is_unfinished().then_some([x_m, y_m, current.altitude_m.get()]);
        let heading =
            current.is_unfinished().then(|| FactValue::degrees(current.pose().heading_rad));
        let mut table = FactTable::new(["event", "with", "value"]);
        for event in &self.trace.events {
            let with = event.other_airplane().map(airplane);
            let value =
                event.kind.measured_quantity().map(|m| FactValue::number(event.value, m.unit()));
            table.push_row([event.kind.name().into(), with.into(), value.into()]);
        }
        inspection.add_section(
            FactSection::new("Outcome")
                .fact_if(
                    "turns at first",
                    turn.map(|rad_s| FactValue::number(rad_s.to_degrees(), "°/s")),
                )
                .fact("arrives", current.arrived_step().is_some())
                .fact("next place", next)
                .fact("next heading", heading)
                .table(table),
        );
        if let Some(profile) = profile {
            inspection.add_mark(MarkRole::Done, "what it flies", self.turn_profile_line(profile));
        }
    }
}

fn network_traffic_row(about: &str, traffic: NetworkTraffic) -> [FactValue; 5] {
    [
        about.into(),
        FactValue::number(traffic.messages as f64, ""),
        FactValue::number(traffic.bytes as f64, "B"),
        FactValue::number(traffic.multicasts as f64, ""),
        FactValue::number(traffic.multicast_bytes as f64, "B"),
    ]
}

fn fallback_text(fallback: Fallback, dt_s: f64) -> String {
    let Fallback { turn_side, turn_cycles, straight_cycles, orbit_side } = fallback;
    let mut text = String::new();
    if turn_cycles > 0 {
        let duration = duration_text(turn_cycles, dt_s);
        text += &format!("turn {} for {duration}, ", side_text(turn_side));
    }
    if straight_cycles > 0 {
        text += &format!("straight on for {}, ", duration_text(straight_cycles, dt_s));
    }
    text + "orbit " + side_text(orbit_side)
}

/// Returns the duration of some cycles, to the hundredth of a second: sums of fractions have errors of rounding.
fn duration_text(cycles: impl Into<f64>, dt_s: f64) -> String {
    let text = format!("{:.2}", cycles.into() * dt_s);
    format!("{} s", text.trim_end_matches('0').trim_end_matches('.'))
}

fn side_text(side: OrbitSide) -> &'static str {
    match side {
        OrbitSide::Left => "to the left",
        OrbitSide::Right => "to the right",
    }
}
