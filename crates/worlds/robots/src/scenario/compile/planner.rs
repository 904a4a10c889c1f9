//! Teams that a planner leads: what their robots must be like.

use super::super::{PlannerMethod, RobotSection};
use super::bodies::period_cycles;
use super::*;
use crate::effector::{LEFT, RIGHT, STANDARD_ACTIONS, STAY, Side};

/// Behaviors that have goals, which is all that a planner asks of them.
const WITH_GOALS: [&str; 2] = ["shuttle", "goto"];

/// The transition that each standard action is meant to make where a planner chooses it: steps, and quarter turns to the
/// left.
const PLANNED_TRANSITIONS: [(ActionId, &[Side], u8); 4] =
    [(FORWARD, &[Side::Front], 0), (LEFT, &[], 1), (RIGHT, &[], 3), (STAY, &[], 0)];

impl Compiler<'_> {
    /// Refuses a planner of robots that it cannot lead.
    pub(super) fn check_planner(
        &self,
        s: &RobotSection,
        effector: &EffectorModel,
    ) -> Result<(), InputError> {
        let Some(planner) = &s.planner else { return Ok(()) };
        let PlannerMethod::Pibt = planner.get_ref().method;
        let span = planner.span();
        self.check_planned_behaviour(s, span.clone())?;
        if period_cycles(s.period) > 1 && s.phase.is_none() {
            let cause = "the planner leads robots whose period starts in cycles that are drawn";
            let remedy = "add phase = 0, because a team acts in the same cycles";
            return Err(self.source.error(span, cause, remedy));
        }
        for (action, path, turn) in PLANNED_TRANSITIONS {
            let action = usize::from(action);
            let meant = &effector.transitions[action][0];
            if meant.path != path || meant.turn != turn {
                let cause = format!(
                    "the planner plans with steps of one box and quarter turns, and the first transition of `{}` of \
                     effector `{}` is another one",
                    STANDARD_ACTIONS[action], effector.name
                );
                let remedy = "give an effector like forward = [{ p = 0.9, path = \"F\" }, { p = 0.1 }], whose first \
                              transitions are forward one box, left and right 90 degrees, and stay nothing";
                return Err(self.source.error(span, cause, remedy));
            }
        }
        Ok(())
    }

    fn check_planned_behaviour(
        &self,
        s: &RobotSection,
        span: Range<usize>,
    ) -> Result<(), InputError> {
        // A list of starts and goals is the behavior `goto`.
        if s.scen.is_some() {
            return Ok(());
        }
        let behaviour = s.behaviour.as_ref().map(Spanned::get_ref);
        let kind = behaviour.map_or("wander", |b| b.kind.get_ref().as_str());
        if !WITH_GOALS.contains(&kind) {
            let cause = format!(
                "the planner leads robots that go somewhere, and the behavior of these is `{kind}`"
            );
            let remedy = "give them behaviour = { kind = \"shuttle\", a = [...], b = [...] } or { kind = \"goto\", goals = [...] }, \
                 or leave out the planner";
            return Err(self.source.error(span, cause, remedy));
        }
        if behaviour.is_some_and(|b| b.avoidance.is_some()) {
            let cause = "robots with a planner have `avoidance`, which is the way of robots that decide alone";
            return Err(self.source.error(span, cause, "leave out `avoidance`, or the planner"));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn compiled(robots: &str) -> Result<Compiled, InputError> {
        let text = format!(
            "format = 1\nworld = \"robots\"\nmap.ascii = \"......\"\n[[robots]]\ncount = 2\n{robots}\n"
        );
        let source = Source::new("s.toml", text, "");
        Compiled::new(&source, &Behaviours::new(), StorageOrder::Spatial)
    }

    const GOES: &str = "behaviour = { kind = \"shuttle\", a = [0, 0, 1, 1], b = [5, 0, 1, 1] }\n";

    fn assert_refused(robots: &str, cause: &str, remedy: &str) {
        let error = compiled(robots).map(|_| ()).expect_err(robots);
        let line = 6 + robots.lines().position(|line| line.contains("planner")).expect("has one");
        assert_eq!(error.line_and_column().map(|at| at.0), Some(line), "{error}");
        assert!(error.cause().contains(cause), "{error}");
        assert!(error.remedy().contains(remedy), "{error}");
    }

    #[test]
    fn a_planner_of_robots_that_it_cannot_lead_is_refused() {
        let planner = "planner = { method = \"pibt\" }\n";
        assert!(compiled(&format!("{GOES}{planner}")).is_ok());
        assert!(compiled(&format!("{GOES}{planner}period = 3\nphase = 1\n")).is_ok());
        assert_refused(planner, "behavior of these is `wander`", "kind = \"shuttle\"");
        let avoids = GOES.replace(" }", ", avoidance = \"touch\" }");
        assert_refused(&format!("{avoids}{planner}"), "`avoidance`", "leave out `avoidance`");
        assert_refused(&format!("{GOES}{planner}period = 3\n"), "drawn", "phase = 0");
        let unknown = "planner = { method = \"astar\" }\n";
        let error = compiled(&format!("{GOES}{unknown}")).map(|_| ()).expect_err(unknown);
        assert!(error.to_string().contains("pibt"), "{error}");
        let fast = format!(
            "{GOES}{planner}effector = \"fast\"\n[effectors.fast]\nforward = [{{ p = 1.0, path = \"FF\" }}]\n"
        );
        assert_refused(&fast, "`forward` of effector `fast`", "path = \"F\"");
    }
}
